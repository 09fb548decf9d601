// SPDX-License-Identifier: MIT
// Fig. 12 and Table 1: what adaptive models cost against wholly refined ones, and how far their
// curves lie apart; several places of the press each, since a shell that buckles does so by chance.
#include "accuracy.h"
#include "scoped.h"

#include "base/check.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

static const double SECONDS = 1.2;
static const double NEVER = 1e9; // a threshold that no face exceeds
static const Model *const MODELS[] = {&MODEL_COARSE, &MODEL_REFINED_1, &MODEL_ADAPTIVE_1,
                                      &MODEL_REFINED_2, &MODEL_ADAPTIVE_2};
enum { COARSE, REFINED_1, ADAPTIVE_1, REFINED_2, ADAPTIVE_2, MODEL_COUNT };
enum { PLACES_MOST = 6, REPEATS_MOST = 32 };

typedef struct Case {
    const char *name, *scene;
    double force;           // times the scene's
    int place[PLACES_MOST]; // nodes that are pressed inwards; -1: as the scene has it
    int place_count;
    int reference;    // level of the continuum's solution that errors are measured against
    bool force_alone; // no criterion but that of force refines
} Case;
static const Case CASES[] = {
    {"sphere-1N", "sphere", 1.0, {-1, 10, 30, 50, 70, 100}, 6, 3, false},
    {"sphere-0.2N", "sphere", 0.2, {-1, 10, 30, 50, 70, 100}, 6, 3, false},
    {"stomach-0.6N", "stomach", 1.0, {-1, 40, 110}, 3, 3, false},
    // As much of the sphere as the paper refined: 114 to 133 nodes.
    {"sphere-0.05N", "sphere", 0.05, {-1, 10, 30, 50, 70, 100}, 6, 3, true},
};
enum { CASE_COUNT = sizeof CASES / sizeof CASES[0] };

// Presses a node of the coarse mesh instead, against the normal of the surface there.
static void move_loads(Scene *scene, const TriMesh *mesh, int node)
{
    Vec3 normal = {0};
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *corner = mesh->triangle[t];
        if (corner[0] != node && corner[1] != node && corner[2] != node)
            continue;
        Vec3 a = mesh->position[corner[0]];
        normal = vec3_add(normal, vec3_cross(vec3_sub(mesh->position[corner[1]], a),
                                             vec3_sub(mesh->position[corner[2]], a)));
    }
    for (int k = 0; k < scene->load_count; k++) {
        LoadOptions *load = &scene->load[k].load;
        load->center = mesh->position[node];
        load->force = vec3_scale(-vec3_length(load->force) / vec3_length(normal), normal);
    }
}

static void read_case(const Experiment *experiment, const Case *what, int place, SurfaceAdjust rule,
                      IntegratorKind integrator, Scene *scene, Probe *probe)
{
    run_read(experiment->scenes, what->scene, scene);
    scene_scale_loads(scene, what->force);
    scene->body[0].surface.adjust = rule;
    scene->body[0].surface.body.integrator = integrator;
    if (what->force_alone) {
        scene->body[0].surface.adapt.speed = NEVER;
        scene->body[0].surface.adapt.curvature = NEVER;
    }
    probe_create(scene, probe);
    if (what->place[place] < 0)
        return;
    move_loads(scene, &probe->mesh, what->place[place]);
    probe_destroy(probe);
    probe_create(scene, probe);
}

// What the runs of one model at all places come to.
typedef struct Sums {
    double least, median; // CPU time, mean over the places [ms]
    int nodes[2], springs[2];
    double mean[2], worst[2]; // curve difference to refined 1 and 2
} Sums;

static int earlier(const void *a, const void *b)
{
    int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

static void add_up(Sums *sums, const Trace *trace, const Trace *all, int64_t *cpu_ns, int repeats,
                   int places)
{
    ASSERT(trace->resets == 0);
    qsort(cpu_ns, (size_t)repeats, sizeof *cpu_ns, earlier);
    sums->least += 1e-6 * (double)cpu_ns[0] / places;
    sums->median += 1e-6 * (double)cpu_ns[repeats / 2] / places;
    for (int k = 0; k < 2; k++) {
        double d = trace_difference(trace, &all[k == 0 ? REFINED_1 : REFINED_2]);
        sums->mean[k] += d / places;
        sums->worst[k] = fmax(sums->worst[k], d);
        const int *nodes = trace->nodes, *springs = trace->springs;
        if (sums->nodes[k] == 0 || (k == 0) == (nodes[k] < sums->nodes[k]))
            sums->nodes[k] = nodes[k];
        if (sums->springs[k] == 0 || (k == 0) == (springs[k] < sums->springs[k]))
            sums->springs[k] = springs[k];
    }
}

// All models at one place, taking turns.
static void run_place(const Scene *scene, const Probe *probe, int repeats, int places,
                      Trace trace[MODEL_COUNT], Sums sums[MODEL_COUNT])
{
    static Trace again;
    int64_t cpu_ns[MODEL_COUNT][REPEATS_MOST];
    for (int r = 0; r < repeats; r++)
        for (int m = 0; m < MODEL_COUNT; m++) {
            Trace *to = r == 0 ? &trace[m] : &again;
            run_trace(scene, MODELS[m], probe, SECONDS, to);
            cpu_ns[m][r] = to->cpu_ns;
        }
    for (int m = 0; m < MODEL_COUNT; m++)
        add_up(&sums[m], &trace[m], trace, cpu_ns[m], repeats, places);
}

static void write_rows(FILE *out, const char *label, const Sums sums[MODEL_COUNT])
{
    for (int k = 0; k < 2; k++) {
        const Sums *coarse = &sums[COARSE], *refined = &sums[k == 0 ? REFINED_1 : REFINED_2];
        const Sums *adaptive = &sums[k == 0 ? ADAPTIVE_1 : ADAPTIVE_2];
        fprintf(out,
                "%s\t%d\t%d~%d\t%d~%d\t%.1f\t%.1f\t%.1f\t%.0f\t%.0f\t%.1f (%.1f)\t%.1f (%.1f)\n",
                label, k + 1, adaptive->nodes[0], adaptive->nodes[1], adaptive->springs[0],
                adaptive->springs[1], coarse->least, refined->least, adaptive->least,
                100.0 * (1.0 - adaptive->least / refined->least),
                100.0 * (1.0 - adaptive->median / refined->median), 100.0 * coarse->mean[k],
                100.0 * coarse->worst[k], 100.0 * adaptive->mean[k], 100.0 * adaptive->worst[k]);
    }
    fflush(out);
}

static void write_curves(const Experiment *experiment, const char *name, const Trace *trace)
{
    CLOSED FILE *out = experiment_open(experiment, name);
    fprintf(out, "time [s]; then [mm]");
    for (int m = 0; m < MODEL_COUNT; m++)
        fprintf(out, "\t%s", MODELS[m]->name);
    for (int i = 0; i < trace[0].count; i++) {
        fprintf(out, "\n%.4f", trace[0].time[i]);
        for (int m = 0; m < MODEL_COUNT; m++)
            fprintf(out, "\t%.4f", 1e3 * trace[m].displacement[i]);
    }
    fputc('\n', out);
}

// Against the continuum's own solution on a finer mesh than any of them.
static void write_errors(FILE *out, const Experiment *experiment, const Case *what,
                         const char *rule, const Trace *trace)
{
    static Trace reference[CASE_COUNT];
    Trace *own = &reference[what - CASES];
    if (own->count == 0) {
        const Model finest = {"reference", MODEL_HELD, what->reference};
        SCOPED(scene_destroy) Scene scene;
        SCOPED(probe_destroy) Probe probe;
        read_case(experiment, what, 0, ADJUST_CONTINUUM, INTEGRATOR_RK4, &scene, &probe);
        run_trace(&scene, &finest, &probe, SECONDS, own);
    }
    fprintf(out, "%s\t%s", what->name, rule);
    for (int m = 0; m < MODEL_COUNT; m++)
        fprintf(out, "\t%.1f", 100.0 * trace_difference(&trace[m], own));
    fputc('\n', out);
}

// What the threshold of curvature buys: adaptive 2 by the continuum rule, RK4.
void curvature_thresholds(const Experiment *experiment)
{
    static const double curvatures[] = {0.2, 0.4, 0.8, 1.6};
    static Trace refined, adaptive;
    CLOSED FILE *out = experiment_open(experiment, "thresholds.tsv");
    fprintf(out, "case\tcurvature [rad]\tnodes, most\tsaved [%%]\tadaptive differs [%%]\n");
    for (int c = 0; c < CASE_COUNT && !CASES[c].force_alone; c++)
        for (int k = 0; k < 4; k++) {
            const int places = CASES[c].place_count;
            double cpu[2] = {0.0, 0.0}, mean = 0.0, worst = 0.0;
            int nodes = 0;
            for (int p = 0; p < places; p++) {
                SCOPED(scene_destroy) Scene scene;
                SCOPED(probe_destroy) Probe probe;
                read_case(experiment, &CASES[c], p, ADJUST_CONTINUUM, INTEGRATOR_RK4, &scene,
                          &probe);
                scene.body[0].surface.adapt.curvature = curvatures[k];
                run_trace(&scene, &MODEL_REFINED_2, &probe, SECONDS, &refined);
                run_trace(&scene, &MODEL_ADAPTIVE_2, &probe, SECONDS, &adaptive);
                cpu[0] += (double)refined.cpu_ns;
                cpu[1] += (double)adaptive.cpu_ns;
                mean += trace_difference(&adaptive, &refined) / places;
                worst = fmax(worst, trace_difference(&adaptive, &refined));
                nodes = adaptive.nodes[1] > nodes ? adaptive.nodes[1] : nodes;
            }
            fprintf(out, "%s\t%g\t%d\t%.0f\t%.1f (%.1f)\n", CASES[c].name, curvatures[k], nodes,
                    100.0 * (1.0 - cpu[1] / cpu[0]), 100.0 * mean, 100.0 * worst);
        }
}

// The other reading of the paper: shape springs that every node has alike, whatever its level. By
// its rule masses of a level are alike, so what a scene gives a node of level 0 can make up for
// them.
void constant_shape_springs(const Experiment *experiment)
{
    CLOSED FILE *out = experiment_open(experiment, "constant.tsv");
    fprintf(out,
            "case\tmodel\tdisplacement when released, shape springs by mass [mm]\tconstant per "
            "node [mm]\tagainst coarse [%%]\n");
    static Trace by_mass, constant;
    for (int c = 0; c < CASE_COUNT && !CASES[c].force_alone; c++) {
        double coarse = 0.0;
        for (int level = 0; level <= 2; level++) {
            SCOPED(scene_destroy) Scene scene;
            SCOPED(probe_destroy) Probe probe;
            SCOPED(world_destroy) World world;
            const Model model = {"held", MODEL_HELD, level};
            read_case(experiment, &CASES[c], 0, ADJUST_CHOI2005, INTEGRATOR_RK4, &scene, &probe);
            run_trace(&scene, &model, &probe, SECONDS, &by_mass);
            run_build(&scene, &model, &world);
            const Body *body = sim_body(world.sim, 0);
            SurfaceShape *shape = &scene.body[0].surface.shape;
            const double w = shape->angular_frequency, nodes = probe.mesh.node_count;
            const double growth = body->mesh.node_count / nodes, mass = body->mass / nodes;
            shape->per_node = true;
            shape->stiffness = growth * mass * w * w;
            shape->damping = growth * 2.0 * shape->damping_ratio * w * mass;
            run_trace(&scene, &model, &probe, SECONDS, &constant);
            const int released = (int)lround(SECONDS / 2.0 * scene.sim.rate_hz) - 1;
            const double u = constant.displacement[released];
            coarse = level == 0 ? u : coarse;
            fprintf(out, "%s\tlevel %d\t%.2f\t%.2f\t%+.0f\n", CASES[c].name, level,
                    1e3 * by_mass.displacement[released], 1e3 * u, 100.0 * (u / coarse - 1.0));
        }
    }
}

void cost_and_curves(const Experiment *experiment)
{
    static Trace trace[MODEL_COUNT];
    const int repeats = experiment->repeats < REPEATS_MOST ? experiment->repeats : REPEATS_MOST;
    CLOSED FILE *table = experiment_open(experiment, "table1.tsv");
    CLOSED FILE *errors = experiment_open(experiment, "errors.tsv");
    fprintf(table, "case\trule\tintegrator\tlevel\tnodes\tsprings\tcoarse [ms]\trefined [ms]\t"
                   "adaptive [ms]\tsaved [%%]\tsaved, medians [%%]\t"
                   "coarse differs [%%]\tadaptive differs [%%]\n");
    fprintf(errors, "case\trule");
    for (int m = 0; m < MODEL_COUNT; m++)
        fprintf(errors, "\t%s", MODELS[m]->name);
    fputc('\n', errors);
    for (int c = 0; c < CASE_COUNT; c++)
        for (int r = 0; r < 2; r++)
            for (int k = 0; k < 2; k++) {
                SurfaceAdjust rule = r == 0 ? ADJUST_CHOI2005 : ADJUST_CONTINUUM;
                IntegratorKind integrator = k == 0 ? INTEGRATOR_RK4 : INTEGRATOR_LEAPFROG;
                Sums sums[MODEL_COUNT] = {0};
                for (int p = 0; p < CASES[c].place_count; p++) {
                    SCOPED(scene_destroy) Scene scene;
                    SCOPED(probe_destroy) Probe probe;
                    read_case(experiment, &CASES[c], p, rule, integrator, &scene, &probe);
                    run_place(&scene, &probe, repeats, CASES[c].place_count, trace, sums);
                    if (p == 0 && k == 0) {
                        char name[64];
                        snprintf(name, sizeof name, "fig12-%s-%s.dat", CASES[c].name,
                                 rule_name(rule));
                        write_curves(experiment, name, trace);
                        write_errors(errors, experiment, &CASES[c], rule_name(rule), trace);
                    }
                }
                char label[64];
                snprintf(label, sizeof label, "%s\t%s\t%s", CASES[c].name, rule_name(rule),
                         integrator_name(integrator));
                write_rows(table, label, sums);
            }
}
