// SPDX-License-Identifier: MIT
// pliant-plane-cost OUT [REPEATS]: Table 1 and Fig. 11 of Miyazaki et al. 2004 on this machine, as
// plane1.tsv and plane2.tsv in the folder OUT: what a step costs an element, by process, for the
// paper's disc with its 172 elements and with one a cell; and what that makes of a frame.
#include "base/check.h"
#include "base/clock.h"
#include "sim/sim.h"
#include "plane_textbook.h"
#include "scoped.h"
#include "plane/model.h"

#include <stdio.h>
#include <stdlib.h>
#ifdef __SSE2__
#include <xmmintrin.h>
#endif

enum { STEPS = 1000, CHUNKS = 40, CHUNK = 25 }; // steps to press, and chunks of steps timed

static const double SIZE = 0.002, E = 1e4, DENSITY = 1000.0, RADIUS = 0.01, BETA = 0.2;
static const int CELLS = 16;

// Processes of Table 1; b, the reconstruction, is not part of a body that is not cut.
typedef enum Process { ELASTIC, SUM, UPDATE, COLLISION, PROCESSES } Process;

typedef struct Cost {
    double ns[PROCESSES]; // a step; least of all chunks; negative: not apart from the one before
    double contact_ns;    // a tick of the server's own contact, which is not the paper's
    int elements, vertices;
    int uses; // of vertices by elements
} Cost;

static double step_of(void)
{
    return 0.6 * SIZE * sqrt(DENSITY / E);
}

// The manipulator comes down on the disc and stays: from above, a quarter of its radius deep.
static double height_of(int step)
{
    double depth = 0.25 * RADIUS * fmin(1.0, step / (double)STEPS);
    return CELLS * SIZE + RADIUS - depth;
}

// What reading the clock costs: the least of many [ns].
static double clock_cost(void)
{
    static int64_t least = 0;
    for (int k = 0; k < 1000 && (k > 0 || least == 0); k++) {
        int64_t a = clock_now_ns(), b = clock_now_ns();
        least = k == 0 || b - a < least ? b - a : least;
    }
    return (double)least;
}

// So far, in all [ns].
static double contact_ns(const Sim *sim)
{
    return (double)(sim_stage_ns(sim, STAGE_FIND_CONTACTS) + sim_stage_ns(sim, STAGE_CONTACT) +
                    sim_stage_ns(sim, STAGE_WRENCHES));
}

static void keep_least(double *least, double ns)
{
    *least = *least == 0.0 || ns < *least ? ns : *least;
}

// ---------------------------------------------------------------------------------------------

static void time_textbook(const PlaneLayout *layout, const PlaneMesh *mesh, Cost *cost)
{
    SCOPED(textbook_destroy) Textbook book;
    textbook_create(&book, layout, mesh, SIZE, E, DENSITY);
    const double dt = step_of();
    for (int chunk = -STEPS / CHUNK; chunk < CHUNKS; chunk++) {
        int64_t ns[PROCESSES] = {0};
        for (int k = 0; k < CHUNK; k++) {
            int step = (chunk + STEPS / CHUNK) * CHUNK + k;
            int64_t t[PROCESSES + 1];
            t[0] = clock_now_ns();
            textbook_elastic_forces(&book);
            t[1] = clock_now_ns();
            textbook_sum_forces(&book);
            t[2] = clock_now_ns();
            textbook_update(&book, dt, 1.0, (Vec2){0.0, 0.0});
            t[3] = clock_now_ns();
            textbook_collide(&book, (Vec2){0.0, height_of(step)}, RADIUS, dt);
            t[4] = clock_now_ns();
            for (int p = 0; p < PROCESSES; p++)
                ns[p] += t[p + 1] - t[p];
        }
        for (int p = 0; p < PROCESSES && chunk >= 0; p++)
            keep_least(&cost->ns[p], (double)ns[p] / CHUNK - clock_cost());
    }
    cost->elements = book.element_count;
    cost->vertices = book.vertex_count;
    cost->uses = 0;
    for (int e = 0; e < book.element_count; e++)
        cost->uses += book.element[e].count;
}

// The paper's collision on the server's rows: the same work as textbook_collide.
static void push_out(const PlaneModel *model, void *rows, double dt)
{
    const Vec3 origin = model->vertices.rows.frame->origin;
    const double x0 = -origin.x, y0 = height_of(STEPS) - origin.y;
    for (int v = 0; v < model->vertices.count; v++) {
        double u[4];
        for (int d = 0; d < 2; d++) {
            u[d] = rows_get(&model->vertices.rows, rows, (long)v * ROW + d);
            u[2 + d] = rows_get(&model->vertices.rows, rows, (long)v * ROW + 4 + d);
        }
        double dx = model->vertices.rows.rest[v][0] + u[0] - x0,
               dy = model->vertices.rows.rest[v][1] + u[1] - y0;
        double square = dx * dx + dy * dy;
        if (square >= RADIUS * RADIUS || square == 0.0)
            continue;
        double push = RADIUS / sqrt(square) - 1.0;
        for (int d = 0; d < 2; d++) {
            double way = push * (d == 0 ? dx : dy);
            rows_put(&model->vertices.rows, rows, (long)v * ROW + d, u[d] + way);
            rows_put(&model->vertices.rows, rows, (long)v * ROW + 4 + d, u[2 + d] + way / dt);
        }
    }
}

// The server's own body, with its kernels. Its contact is not the paper's: it pushes faces, feels
// their friction and lets the tool yield.
static void time_server(const Lattice *lattice, int levels, PlaneLaw law, Precision precision,
                        double damping, Cost *cost)
{
    const FixedRegion held = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, -(CELLS - 0.5) * SIZE, 1.0}};
    const SolidMaterial material = {.youngs_modulus = E, .density = DENSITY};
    const PlaneOptions options = {.body.name = "disc",
                                  .lattice = lattice,
                                  .body.levels = levels,
                                  .law = law,
                                  .material_count = 1,
                                  .material = &material,
                                  .damping = damping,
                                  .body.integrator = INTEGRATOR_SYMPLECTIC_EULER,
                                  .body.precision = precision,
                                  .body.time_step = step_of(),
                                  .body.unsafe_time_step = true,
                                  .body.fixed_count = 1,
                                  .body.fixed = &held,
                                  .body.contact_ratio = 0.5,
                                  .body.contact_damping = 2e-4,
                                  .body.friction = 0.3,
                                  .body.without_loads = true};
    const ToolOptions tool = {.id = 1,
                              .kind = TOOL_PROBE,
                              .capsule_count = 1,
                              .capsule = {{.radius = RADIUS}},
                              .max_force = 3.3};
    const SimOptions sim_options = {.rate_hz = 1.0 / step_of(), .tool_timeout_s = 1.0};
    SCOPED(arena_destroy) Arena arena = {0};
    SCOPED(state_destroy) StateList state = {0};
    Body made;
    Sim *sim = sim_create(&sim_options, &arena, &state);
    ASSERT(plane_create(&made, &options, &arena, &state, &(Status){0}));
    Body *body = sim_add_body(sim, &made);
    sim_add_tool(sim, &tool);
    ASSERT(sim_seal(sim, 0.0, &(Status){0}));
    sim_set_lockstep(sim, true);
    PlaneModel *model = body->model;
    for (int chunk = -STEPS / CHUNK; chunk < CHUNKS; chunk++) {
        double before = contact_ns(sim);
        for (int k = 0; k < CHUNK; k++) {
            int step = (chunk + STEPS / CHUNK) * CHUNK + k;
            ToolPose pose = {.position = {0.0, height_of(step), 0.0},
                             .orientation = {1.0, 0.0, 0.0, 0.0},
                             .active = true};
            sim_apply_pose(sim, 0, &pose, true);
            sim_step(sim);
        }
        if (chunk >= 0)
            keep_least(&cost->contact_ns, (contact_ns(sim) - before) / CHUNK);
    }
    ASSERT(sim_resets(sim) == 0);

    // The processes by themselves, in the pressed state: kernels write beside it, and vertices are
    // pushed out once.
    const PlanePass pass = {.batches = &model->batches,
                            .law = law,
                            .damped = model->vertices.damping_time > 0.0,
                            .rows = model->vertices.present,
                            .force = model->vertices.force,
                            .stiffness_scale = 1.0,
                            .damping_scale = 1.0};
    const AdvancePass advance = {.present = model->vertices.present,
                                 .next = model->vertices.row[1 - model->vertices.current],
                                 .force = model->vertices.force,
                                 .inverse_mass = model->vertices.inverse_mass,
                                 .vertex_count = model->vertices.count + 1,
                                 .h = step_of(),
                                 .advance = 1.0,
                                 .position_limit = model->vertices.position_limit,
                                 .check = true};
    static const Process order[3] = {ELASTIC, UPDATE, COLLISION};
    bool good = true;
    for (int chunk = 0; chunk < CHUNKS; chunk++) {
        int64_t ns[3] = {0};
        for (int k = 0; k < CHUNK; k++) {
            int64_t t[4];
            t[0] = clock_now_ns();
            model->kernels->evaluate(&pass);
            t[1] = clock_now_ns();
            good &= model->vertices.kernels->advance(&advance);
            t[2] = clock_now_ns();
            push_out(model, model->vertices.row[1 - model->vertices.current], step_of());
            t[3] = clock_now_ns();
            for (int p = 0; p < 3; p++)
                ns[p] += t[p + 1] - t[p];
        }
        for (int p = 0; p < 3; p++)
            keep_least(&cost->ns[order[p]], (double)ns[p] / CHUNK - clock_cost());
    }
    ASSERT(good);
    cost->ns[SUM] = -1.0; // in the same pass
    cost->elements = model->element_count;
    cost->vertices = model->vertices.count;
    cost->uses = 0;
    for (int e = 0; e < model->element_count; e++)
        cost->uses += model->form[e].shape->count;
}

// ---------------------------------------------------------------------------------------------

enum { GRADED, FULL, LAYOUTS };
enum { TEXTBOOK, PAPER_DOUBLE, PAPER_SINGLE, AFFINE_SINGLE, VERSIONS };
static const char *const VERSION_NAMES[VERSIONS] = {
    "textbook, double", "server, miyazaki2004, double", "server, miyazaki2004, single",
    "server, affine, damped, single"};

static double total(const Cost *cost)
{
    double sum = 0.0;
    for (int p = 0; p < PROCESSES; p++)
        sum += fmax(0.0, cost->ns[p]);
    return sum;
}

static FILE *open_table(const char *folder, const char *name)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *out = fopen(path, "w");
    if (out == NULL) {
        perror(path);
        exit(1);
    }
    return out;
}

static void write_table(const char *folder, Cost cost[VERSIONS][LAYOUTS])
{
    CLOSED FILE *out = open_table(folder, "plane1.tsv");
    fprintf(out, "version\telements\tvertices\ta elastic force\tb reconstruction\tc force "
                 "summation\td update\te "
                 "collision\ttotal [ns per element and step]\tstep [us]\tthe server's own contact "
                 "[us]\n");
    for (int v = 0; v < VERSIONS; v++)
        for (int l = 0; l < LAYOUTS; l++) {
            const Cost *c = &cost[v][l];
            fprintf(out, "%s\t%d\t%d", VERSION_NAMES[v], c->elements, c->vertices);
            for (int p = 0; p < PROCESSES; p++) {
                if (p == SUM)
                    fprintf(out, "\t0"); // b: paid when something breaks
                if (c->ns[p] < 0.0)
                    fprintf(out, "\tin a");
                else
                    fprintf(out, "\t%.1f", c->ns[p] / c->elements);
            }
            fprintf(out, "\t%.1f\t%.2f", total(c) / c->elements, 1e-3 * total(c));
            if (v == TEXTBOOK)
                fprintf(out, "\t-\n");
            else
                fprintf(out, "\t%.1f\n", 1e-3 * c->contact_ns);
        }
}

// A frame of 1/30 s holds (1/30 s - drawing) / step cycles; with the same drawing time for both
// layouts the ratio of their cycles is that of their steps.
static void write_ratios(const char *folder, Cost cost[VERSIONS][LAYOUTS])
{
    CLOSED FILE *out = open_table(folder, "plane2.tsv");
    fprintf(out, "version\telements, graded to full [%%]\ttheir vertices [%%]\ttime of a step, "
                 "graded to full [%%]\twithout "
                 "collision [%%]\tcycles in 1/30 s, graded\tfull\n");
    for (int v = 0; v < VERSIONS; v++) {
        const Cost *g = &cost[v][GRADED], *f = &cost[v][FULL];
        fprintf(out, "%s\t%.1f\t%.1f\t%.1f\t%.1f\t%.0f\t%.0f\n", VERSION_NAMES[v],
                100.0 * g->elements / f->elements, 100.0 * g->uses / f->uses,
                100.0 * total(g) / total(f),
                100.0 * (total(g) - g->ns[COLLISION]) / (total(f) - f->ns[COLLISION]),
                1e9 / 30.0 / total(g), 1e9 / 30.0 / total(f));
    }
}

int main(int argc, char **argv)
{
    int repeats = argc > 2 ? atoi(argv[2]) : 20;
    if (argc < 2 || argc > 3 || repeats < 1) {
        fprintf(stderr, "usage: pliant-plane-cost OUT [REPEATS]\n");
        return 2;
    }
#ifdef __SSE2__
    _mm_setcsr(_mm_getcsr() | 0x8040); // flush to zero, as the daemon does
#endif
    SCOPED(lattice_destroy) Lattice lattice;
    PlaneLayout layout[LAYOUTS];
    PlaneMesh mesh[LAYOUTS];
    static Cost cost[VERSIONS][LAYOUTS];
    ASSERT(lattice_disc(&lattice, CELLS * SIZE, SIZE, &(Status){0}));
    for (int l = 0; l < LAYOUTS; l++) {
        plane_layout_create(&layout[l], &lattice, l == GRADED ? 3 : 0);
        ASSERT(plane_mesh_create(&mesh[l], &layout[l], NULL, &(Status){0}));
    }
    for (int r = 0; r < repeats; r++)
        for (int l = 0; l < LAYOUTS; l++) {
            int levels = layout[l].levels;
            time_textbook(&layout[l], &mesh[l], &cost[TEXTBOOK][l]);
            time_server(&lattice, levels, PLANE_MIYAZAKI2004, PRECISION_DOUBLE, 0.0,
                        &cost[PAPER_DOUBLE][l]);
            time_server(&lattice, levels, PLANE_MIYAZAKI2004, PRECISION_SINGLE, 0.0,
                        &cost[PAPER_SINGLE][l]);
            time_server(&lattice, levels, PLANE_AFFINE, PRECISION_SINGLE, BETA,
                        &cost[AFFINE_SINGLE][l]);
        }
    write_table(argv[1], cost);
    write_ratios(argv[1], cost);
    for (int l = 0; l < LAYOUTS; l++) {
        plane_mesh_destroy(&mesh[l]);
        plane_layout_destroy(&layout[l]);
    }
    return 0;
}
