// SPDX-License-Identifier: MIT
#include "study/context.h"

#include "base/fnv.h"
#include "base/isa.h"
#include "base/sets.h"
#include "run/realtime.h"
#include "study/study.h"
#include "study/inputs.h"
#include "study/sampler.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double SAMPLE_S = 0.01;
static const double LEAST_LIMIT_S = 10.0, SLOWEST = 30.0; // times slower than real time

int study_mesh_of(const StudyContext *context, const StudyCase *what)
{
    for (int m = 0; m < context->mesh_count; m++) {
        const StudyMesh *mesh = &context->mesh[m];
        const StudyCase of = {
            .level = mesh->level, .threshold = mesh->threshold, .paper_rule = mesh->paper_rule};
        if (study_same_mesh(&of, what))
            return m;
    }
    return -1;
}

// ---------------------------------------------------------------------------------------------
// Points

// A candidate during the choice of points.
typedef struct Candidate {
    int id; // first, for compare_ints
    Vec3 rest;
    double area, weight;
} Candidate;

static Candidate *find_candidate(Candidate *list, int count, int id)
{
    const Candidate key = {.id = id};
    return bsearch(&key, list, (size_t)count, sizeof *list, compare_ints);
}

// Lists every published node of the surface with its share of the area; the caller frees it.
static Candidate *list_candidates(const Body *body, int *count)
{
    const BodyMesh *mesh = &body->mesh;
    size_t rows = (size_t)body->state_capacity;
    Candidate *list = calloc(rows, sizeof *list);
    Vec3 *x = calloc(rows, sizeof *x), *v = calloc(rows, sizeof *v);
    int *id = malloc(rows * sizeof *id);
    *count = 0;
    if (list != NULL && x != NULL && v != NULL && id != NULL) {
        // Candidates by id, so that triangles find their nodes by search.
        int used = body->ops->read_state(body->model, id, x, v);
        for (int r = 0; r < used; r++)
            if (id[r] >= 0)
                list[(*count)++] = (Candidate){.id = id[r], .rest = x[r]};
        qsort(list, (size_t)*count, sizeof *list, compare_ints);
        // A third of each triangle's area to each of its corners.
        for (int t = 0; t < mesh->triangle_count; t++) {
            Candidate *corner[3];
            for (int k = 0; k < 3; k++)
                corner[k] = find_candidate(list, *count, mesh->id[mesh->triangle[t][k]]);
            if (corner[0] == corner[1] || corner[0] == NULL || corner[1] == NULL ||
                corner[2] == NULL)
                continue;
            Vec3 normal = vec3_cross(vec3_sub(corner[1]->rest, corner[0]->rest),
                                     vec3_sub(corner[2]->rest, corner[0]->rest));
            for (int k = 0; k < 3; k++)
                corner[k]->area += vec3_length(normal) / 6.0;
        }
        // Nodes inside a solid have no area and are dropped.
        int kept = 0;
        for (int i = 0; i < *count; i++)
            if (list[i].area > 0.0)
                list[kept++] = list[i];
        *count = kept;
    }
    free(x);
    free(v);
    free(id);
    return list;
}

// Distributes `amount` over the nodes inside a sphere, by area; with none inside, the nearest gets
// it all.
static void share(Candidate *list, int count, Vec3 center, double radius, double amount)
{
    // The area inside the sphere, and the node nearest to its centre.
    double area = 0.0, nearest = HUGE_VAL;
    int closest = 0;
    for (int i = 0; i < count; i++) {
        double distance = vec3_length(vec3_sub(list[i].rest, center));
        if (distance < nearest)
            nearest = distance, closest = i;
        if (distance <= radius)
            area += list[i].area;
    }
    if (!(area > 0.0)) {
        list[closest].weight += amount;
        return;
    }
    // By area, as a load does it.
    for (int i = 0; i < count; i++)
        if (vec3_length(vec3_sub(list[i].rest, center)) <= radius)
            list[i].weight += amount * list[i].area / area;
}

static void weigh(const StudyContext *context, Candidate *list, int count)
{
    const StudyInputs *inputs = &context->inputs;
    const Scene *scene = &context->scene;
    bool shared = false;
    // The patch is where loads act, in proportion to their forces.
    for (int k = 0; k < scene->load_count && inputs->drive == DRIVE_LOADS; k++) {
        const LoadOptions *load = &scene->load[k].load;
        double force = vec3_length(load->force);
        if ((load->body >= 0 && load->body != context->body) || !(force > 0.0))
            continue;
        share(list, count, load->center, load->radius, force);
        shared = true;
    }
    // Else it is around the press.
    if (!shared)
        share(list, count, inputs->center, inputs->radius, 1.0);
}

// Takes the points of the patch, and as many evenly spaced others as fit.
static void take_points(StudyPoints *points, const Candidate *list, int count)
{
    // How many points are in the patch, and how many outside.
    double sum = 0.0;
    int others = 0;
    points->count = 0;
    for (int i = 0; i < count; i++) {
        others += !(list[i].weight > 0.0);
        sum += list[i].weight;
    }
    // Strides over the patch and over the others, so that all fit STUDY_POINTS.
    const int patch = count - others;
    const int stride = patch > STUDY_POINTS ? (count + STUDY_POINTS - 1) / STUDY_POINTS : 1;
    const int room = STUDY_POINTS - (patch + stride - 1) / stride;
    const int other_stride = room > 0 ? (others + room - 1) / room : count + 1;
    int seen[2] = {0, 0};
    for (int i = 0; i < count && points->count < STUDY_POINTS; i++) {
        bool other = !(list[i].weight > 0.0);
        if (seen[other]++ % (other ? (other_stride > 0 ? other_stride : 1) : stride) != 0)
            continue;
        int p = points->count++;
        points->id[p] = list[i].id;
        points->fine_id[p] = -1;
        points->rest[p] = list[i].rest;
        points->weight[p] = list[i].weight / sum;
    }
    // If only some of the patch were taken, their weights must again sum to 1.
    double kept = 0.0;
    for (int p = 0; p < points->count; p++)
        kept += points->weight[p];
    for (int p = 0; p < points->count; p++)
        points->weight[p] /= kept;
}

// Finds the vertices at the same positions in a lattice of half the cell size.
static void find_fine_points(StudyContext *context, const Body *body)
{
    int count;
    Candidate *list = list_candidates(body, &count);
    for (int p = 0; p < context->points.count && list != NULL; p++)
        for (int i = 0; i < count; i++)
            if (vec3_length(vec3_sub(list[i].rest, context->points.rest[p])) <
                1e-5 * context->extent)
                context->points.fine_id[p] = list[i].id;
    free(list);
}

// ---------------------------------------------------------------------------------------------
// The rest

// Builds the coarsest mesh of the scene, or its lattice, at rest. Takes the study's points if
// `first`, else finds them in the lattice of half the cell size.
static bool look_at_rest(StudyContext *context, StudyCase what, bool first, Status *status)
{
    StudyScene copy;
    World world;
    const BuildOptions options = {.isa = context->options.isa, .may_load = true};
    if (!study_copy_scene(&context->scene, &copy))
        return status_fail(status, STATUS_FAILED, "out of memory");
    // At rest: the scene without initial state and settling.
    what.time_step = 0.0;
    study_change_scene(&copy, &what, context->sample_s);
    copy.scene.settle_s = 0.0;
    for (int b = 0; b < copy.scene.body_count; b++)
        copy.body[b].initial = NULL;
    // With the built world in hand find the points, or those of the finer lattice.
    bool ok = world_build(&world, &copy.scene, &options, status);
    if (ok && first) {
        int count;
        const Body *body = sim_body(world.sim, context->body);
        Candidate *list = list_candidates(body, &count);
        Sampler sampler;
        ok = list != NULL && sampler_create(&sampler, context, &world, false);
        // Points by their part in the patch, and the volume that the body encloses.
        if (ok) {
            weigh(context, list, count);
            take_points(&context->points, list, count);
            body->ops->snapshot(body->model, sampler.mesh, NULL);
            context->rest_volume = sampler_volume(&body->mesh, sampler.mesh, context->extent);
            sampler_destroy(&sampler);
        } else {
            status_fail(status, STATUS_FAILED, "out of memory");
        }
        free(list);
    } else if (ok) {
        find_fine_points(context, sim_body(world.sim, context->body));
    }
    if (world.sim != NULL)
        world_destroy(&world);
    study_destroy_scene(&copy);
    return ok;
}

// True for a generated box, which stays the same body with smaller cells.
static bool may_halve(const Scene *scene)
{
    for (int b = 0; b < scene->body_count; b++) {
        const SceneBody *body = &scene->body[b];
        if (!scene_has_cells(body) || body->voxels.kind != VOXELS_BOX || body->initial != NULL)
            return false;
        for (int k = 0; k < body->options.fixed_count; k++)
            if (body->options.fixed[k].kind == FIXED_NODES)
                return false;
    }
    return true;
}

static void choose_times(StudyContext *context)
{
    StudyOptions *options = &context->options;
    double tick = 1.0 / context->scene.sim.rate_hz, end = context->inputs.end_s;
    context->sample_s = tick * fmax(1.0, round(SAMPLE_S / tick));
    if (!(options->duration_s > 0.0)) // then long enough to return
        options->duration_s = end + fmin(fmax(end, 0.3), 0.6);
    context->sample_count =
        (int)fmin(ceil(options->duration_s / context->sample_s - 1e-9), 10000.0);
    context->sample_count = context->sample_count > 0 ? context->sample_count : 1;
    options->duration_s = context->sample_count * context->sample_s;
    // A case that is so far from real time is no choice.
    context->limit_s = fmax(LEAST_LIMIT_S, SLOWEST * options->duration_s);
}

static void complete_options(StudyContext *context, const StudyOptions *options)
{
    StudyOptions *own = &context->options;
    *own = *options;
    own->rate_hz = own->rate_hz > 0.0 ? own->rate_hz : context->given->sim.rate_hz;
    own->error = own->error > 0.0 ? own->error : 0.01;
    own->jobs = own->jobs > 0 ? own->jobs : 1;
    own->repeats = own->repeats > 0 ? own->repeats : options->quick ? 3 : 5;
    own->repeats = own->repeats < STUDY_REPEATS ? own->repeats : STUDY_REPEATS;
    own->isa = own->isa != NULL ? own->isa : "auto";
}

bool study_prepare(StudyContext *context, const Scene *scene, const StudyOptions *options,
                   Status *status)
{
    StudyScene copy;
    World world;
    memset(context, 0, sizeof *context);
    context->given = scene;
    context->scene = *scene;
    complete_options(context, options);
    if (scene->body_count == 0)
        return status_fail(status, STATUS_INVALID, "%s: no body to be studied", scene->path);
    // Same floating-point mode as the daemon.
    realtime_flush_denormals();
    // What the scene is, and how often it is sampled.
    const SceneBody *first = &scene->body[0];
    context->plane = first->model == MODEL_PLANE;
    context->sample_s = fmax(SAMPLE_S, 1.0 / scene->sim.rate_hz);
    const BuildOptions build = {.isa = context->options.isa, .may_load = true};
    if (!study_copy_scene(scene, &copy))
        return status_fail(status, STATUS_FAILED, "out of memory");
    bool ok = world_build(&world, &copy.scene, &build, status);
    // The body's size and the inputs follow from the scene as it is.
    if (ok) {
        double thickness;
        context->extent = press_extent(sim_body(world.sim, 0), &thickness);
        ok = study_choose_inputs(context, &world, status);
        world_destroy(&world);
    }
    study_destroy_scene(&copy);
    if (!ok) {
        study_destroy(context);
        return false;
    }
    choose_times(context);
    context->may_halve = may_halve(scene);
    // The points are those of the coarsest mesh, which all cases have.
    StudyCase coarse = study_scene_case(scene);
    coarse.is_scene = scene->body[0].options.unsafe_time_step;
    if (first->model == MODEL_SURFACE)
        coarse.detail = DETAIL_HELD, coarse.level = 0, coarse.threshold = 0.0;
    ok = look_at_rest(context, coarse, true, status);
    if (ok && context->may_halve) {
        Status said = {0};
        coarse.detail = DETAIL_HELD;
        coarse.level = -1;
        context->may_halve = look_at_rest(context, coarse, false, &said);
    }
    if (!ok)
        study_destroy(context);
    return ok;
}

uint64_t study_key(const StudyContext *context, const StudyCase *cases, int count)
{
    const StudyOptions *options = &context->options;
    const StudyPoints *points = &context->points;
    uint64_t key = fnv_bytes(FNV_START, context->given->text, strlen(context->given->text));
    // The inputs, when and where they are sampled, and how.
    key = fnv_bytes(key, context->inputs.text, strlen(context->inputs.text));
    fnv_real(&key, options->duration_s);
    fnv_real(&key, context->scene.sim.rate_hz);
    fnv_real(&key, context->sample_s);
    fnv_real(&key, context->rest_volume);
    fnv_int(&key, context->sample_count);
    fnv_int(&key, options->quick);
    fnv_int(&key, options->repeats);
    for (int i = 0; i < points->count; i++)
        fnv_vector(&key, points->rest[i]);
    // The cases, and the form of a result.
    for (int i = 0; i < count; i++)
        key = fnv_bytes(key, cases[i].name, strlen(cases[i].name));
    fnv_int(&key, (int64_t)sizeof(StudyRun));
    return key;
}

void study_forget_references(StudyContext *context)
{
    for (int m = 0; m < STUDY_MESHES; m++) {
        free(context->mesh_trace[m]);
        context->mesh_trace[m] = NULL;
    }
    free(context->finest_trace);
    context->finest_trace = NULL;
    context->mesh_count = 0;
}

void study_destroy(StudyContext *context)
{
    study_forget_references(context);
    free(context->own_load);
    memset(context, 0, sizeof *context);
}

// --- what is printed before the first run --------------------------------------------------------

// Describes a study before its first run.

// Finds the processor's name, if the system reports it.
static void find_processor(char *name, size_t size)
{
    char line[256];
    FILE *file = fopen("/proc/cpuinfo", "r");
    snprintf(name, size, "unknown processor");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        const char *colon = strchr(line, ':');
        if (strncmp(line, "model name", 10) != 0 || colon == NULL)
            continue;
        snprintf(name, size, "%.*s", (int)strcspn(colon + 2, "\n"), colon + 2);
        break;
    }
    if (file != NULL)
        fclose(file);
}

#ifdef __clang__
#define COMPILER "clang " __clang_version__
#else
#define COMPILER "gcc " __VERSION__
#endif

void study_describe(const StudyContext *context, StudyResult *result)
{
    char processor[96];
    IsaLevel level = isa_find(context->options.isa);
    find_processor(processor, sizeof processor);
    snprintf(result->scene, sizeof result->scene, "%s", context->scene.name);
    snprintf(result->body, sizeof result->body, "%s", context->scene.body[context->body].name);
    snprintf(result->inputs, sizeof result->inputs, "%s", context->inputs.text);
    snprintf(result->machine, sizeof result->machine, "%s, %s, %s", processor,
             level < ISA_COUNT ? isa_name(level) : context->options.isa, COMPILER);
    result->duration_s = context->options.duration_s;
    result->rate_hz = context->options.rate_hz;
    const SceneBody *body = &context->scene.body[context->body];
    const SurfaceMaterial *material = &body->surface.material;
    result->wall = body->model == MODEL_SURFACE;
    result->bends =
        result->wall && (material->thickness > 0.0 || material->bending_stiffness > 0.0);
}
