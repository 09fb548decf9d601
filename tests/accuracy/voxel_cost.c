// SPDX-License-Identifier: MIT
// Table 1 and Fig. 11 in space: what a step costs an element, by process, for a cube with a ball
// pressed into it. plane_cost.c does the same for the paper's disc.
#include "voxel_accuracy.h"
#include "sim_steps.h"

#include "base/check.h"
#include "base/clock.h"
#include "bench/voxel_textbook.h"
#include "voxel/model.h"
#include "voxel_world.h"
#include "scoped.h"

#include <stdlib.h>
#include <string.h>

enum { CELLS = 32, CHUNKS = 12, CHUNK = 4 };

static const double EDGE = 0.1, RADIUS = 0.03, DEPTH = 0.02, E = 1e4, DENSITY = 1000.0, BETA = 0.2;

// Processes of Table 1; b, the reconstruction, is not part of a body that is not cut.
typedef enum Process { ELASTIC, UPDATE, COLLISION, PROCESSES } Process;

typedef struct Cost {
    double ns[PROCESSES]; // a step; least of all chunks
    double contact_ns;    // a step of the server's own contact, which is not the paper's
    int elements, vertices;
} Cost;

typedef struct Version {
    const char *name;
    VoxelLaw law;
    int levels;
    double damping;
    Precision precision;
} Version;

enum { VERSIONS = 4 };
static const Version SERVER[VERSIONS] = {
    {"server, double", VOXEL_AFFINE, 0, BETA, PRECISION_DOUBLE},
    {"server, single", VOXEL_AFFINE, 0, BETA, PRECISION_SINGLE},
    {"server, single, graded", VOXEL_AFFINE, 2, BETA, PRECISION_SINGLE},
    {"server, miyazaki2004, undamped, single, graded", VOXEL_MIYAZAKI2004, 2, 0.0,
     PRECISION_SINGLE}};

static const Vec3 BALL = {0.0, 0.0, 0.5 * 0.1 + 0.03 - 0.02}; // its middle, pressed [m]

static void create_world(VoxelWorld *world, const Version *version)
{
    static const FixedRegion BOTTOM = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.0499}};
    VoxelWorldOptions options = voxel_world_cube(CELLS);
    options.body.body.levels = version->levels;
    options.body.law = version->law;
    options.body.damping = BETA; // while it is pressed; see evaluate
    options.body.body.precision = version->precision;
    fix_within(&options.body.body, &BOTTOM);
    options.rate_hz = 500.0;
    options.tool[options.tool_count++] = (ToolOptions){.id = 1,
                                                       .kind = TOOL_PROBE,
                                                       .capsule_count = 1,
                                                       .capsule = {{.radius = RADIUS}},
                                                       .max_force = 100.0};
    voxel_world_create(world, &options);
    sim_set_lockstep(world->sim, true);
    long ticks = 100; // 0.2 s
    for (long k = 1; k <= ticks; k++) {
        Vec3 place = vec3_add(BALL, vec3(0.0, 0.0, DEPTH * (1.0 - (double)k / (double)ticks)));
        ToolPose pose = {.position = place, .orientation = {1.0, 0.0, 0.0, 0.0}, .active = true};
        sim_apply_pose(world->sim, 0, &pose, true);
        sim_step(world->sim);
    }
    ASSERT(sim_resets(world->sim) == 0);
}

// The paper's collision: a vertex inside the manipulator is moved out, and its velocity follows.
static void push_out(double x[3], double v[3], double dt)
{
    double d[3] = {x[0] - BALL.x, x[1] - BALL.y, x[2] - BALL.z};
    double square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (square >= RADIUS * RADIUS || square == 0.0)
        return;
    double push = RADIUS / sqrt(square) - 1.0;
    for (int c = 0; c < 3; c++) {
        x[c] += push * d[c];
        v[c] += push * d[c] / dt;
    }
}

// ---------------------------------------------------------------------------------------------

static void evaluate(const VoxelModel *model, bool damped)
{
    const VoxelPass pass = {.plain = &model->batches->plain,
                            .hanging = &model->batches->hanging,
                            .tables = model->batches->tables,
                            .classes = model->batches->classes,
                            .law = model->law,
                            .damped = damped,
                            .rows = model->vertices.present,
                            .force = model->vertices.force,
                            .last = model->batches->last,
                            .stiffness_scale = 1.0,
                            .damping_scale = 1.0};
    model->batches->kernels->evaluate(&pass);
}

static void advance(const VoxelModel *model, double h)
{
    const AdvancePass pass = {.present = model->vertices.present,
                              .next = model->vertices.row[1 - model->vertices.current],
                              .force = model->vertices.force,
                              .inverse_mass = model->vertices.inverse_mass,
                              .vertex_count = model->vertices.count + 1,
                              .h = h,
                              .advance = 1.0,
                              .position_limit = model->vertices.position_limit,
                              .check = true};
    ASSERT(model->vertices.kernels->advance(&pass));
}

// In place and velocity of the world, as the server's own code would see them.
static void collide(const VoxelModel *model, double h)
{
    void *rows = model->vertices.row[1 - model->vertices.current];
    const Vec3 origin = model->vertices.rows.frame->origin;
    const double shift[3] = {origin.x, origin.y, origin.z};
    for (int i = 0; i < model->vertices.count; i++) {
        double x[3], v[3], out[3];
        for (int c = 0; c < 3; c++) {
            double u = rows_get(&model->vertices.rows, rows, (long)i * ROW + c);
            out[c] = x[c] = shift[c] + model->vertices.rows.rest[i][c] + u;
            v[c] = rows_get(&model->vertices.rows, rows, (long)i * ROW + 4 + c);
        }
        push_out(out, v, h);
        if (memcmp(out, x, sizeof x) == 0)
            continue;
        for (int c = 0; c < 3; c++) {
            rows_put(&model->vertices.rows, rows, (long)i * ROW + c,
                     out[c] - shift[c] - model->vertices.rows.rest[i][c]);
            rows_put(&model->vertices.rows, rows, (long)i * ROW + 4 + c, v[c]);
        }
    }
}

static double contact_ns(const Sim *sim)
{
    return (double)(sim_stage_ns(sim, STAGE_FIND_CONTACTS) + sim_stage_ns(sim, STAGE_CONTACT) +
                    sim_stage_ns(sim, STAGE_WRENCHES));
}

// The processes by themselves, in the pressed state: kernels write beside it.
static void time_server(VoxelWorld *world, const Version *version, Cost *cost)
{
    const VoxelModel *model = world->body->model;
    const double h = world->body->h;
    for (int chunk = 0; chunk < CHUNKS; chunk++) {
        int64_t ns[PROCESSES] = {0};
        for (int k = 0; k < CHUNK; k++) {
            int64_t t0 = clock_thread_ns();
            evaluate(model, version->damping > 0.0);
            int64_t t1 = clock_thread_ns();
            advance(model, h);
            int64_t t2 = clock_thread_ns();
            collide(model, h);
            ns[ELASTIC] += t1 - t0;
            ns[UPDATE] += t2 - t1;
            ns[COLLISION] += clock_thread_ns() - t2;
        }
        for (int p = 0; p < PROCESSES; p++)
            keep_least(&cost->ns[p], (double)ns[p] / CHUNK);
        double before = contact_ns(world->sim);
        sim_step(world->sim);
        keep_least(&cost->contact_ns, (contact_ns(world->sim) - before) / world->body->substeps);
    }
    cost->elements = world->body->element_count;
    cost->vertices = model->vertices.count;
}

// The same cube in the same state.
static void create_textbook(VoxelTextbook *textbook, VoxelWorld *world)
{
    SCOPED(layout_destroy) Layout layout;
    SCOPED(lattice_mesh_destroy) LatticeMesh mesh;
    layout_create(&layout, &world->lattice, 0);
    ASSERT(lattice_mesh_create(&mesh, &layout, &(Status){0}));
    ASSERT(mesh.vertex_count == world->count);
    voxel_world_read(world);
    FREED int(*corner)[8] = calloc((size_t)mesh.element_count, sizeof *corner);
    FREED double(*x)[3] = calloc((size_t)world->count, sizeof *x);
    ASSERT(corner != NULL && x != NULL);
    for (int e = 0; e < mesh.element_count; e++)
        memcpy(corner[e], mesh.vertex[e], sizeof corner[e]);
    for (int i = 0; i < world->count; i++) {
        ASSERT(mesh.id[i] == world->id[i]);
        x[i][0] = world->x[i].x, x[i][1] = world->x[i].y, x[i][2] = world->x[i].z;
    }
    double size = EDGE / CELLS;
    voxel_textbook_create(textbook, world->count, (const double(*)[3])x, NULL, mesh.element_count,
                          (const int(*)[8])corner, size, E, 0.0, DENSITY,
                          BETA * size * sqrt(DENSITY / E));
    for (int i = 0; i < world->count; i++)
        textbook->vertex[i].fixed = mesh.point[i][2] == 0;
}

// It adds its forces to the vertices as it goes. A step without elements is its update.
static void time_textbook(VoxelTextbook *textbook, double h, Cost *cost)
{
    int elements = textbook->element_count;
    for (int chunk = 0; chunk < CHUNKS; chunk++) {
        int64_t t0 = clock_thread_ns();
        voxel_textbook_forces(textbook);
        int64_t t1 = clock_thread_ns();
        textbook->element_count = 0;
        voxel_textbook_step(textbook, h);
        textbook->element_count = elements;
        int64_t t2 = clock_thread_ns();
        for (int i = 0; i < textbook->vertex_count; i++)
            push_out(textbook->vertex[i].x, textbook->vertex[i].v, h);
        keep_least(&cost->ns[COLLISION], (double)(clock_thread_ns() - t2));
        keep_least(&cost->ns[UPDATE], (double)(t2 - t1));
        keep_least(&cost->ns[ELASTIC], (double)(t1 - t0));
    }
    cost->elements = elements;
    cost->vertices = textbook->vertex_count;
}

static void write_cost(FILE *out, const char *name, const Cost *cost, const Cost *textbook)
{
    double total = 0.0, first = 0.0, share = cost->elements;
    for (int p = 0; p < PROCESSES; p++) {
        total += cost->ns[p];
        first += textbook->ns[p];
    }
    fprintf(out, "%s\t%d\t%d\t%.1f\t0\tin a\t%.2f\t%.2f\t%.1f\t%.1f\t%.0f\t", name, cost->elements,
            cost->vertices, cost->ns[ELASTIC] / share, cost->ns[UPDATE] / share,
            cost->ns[COLLISION] / share, total / share, first / textbook->elements / total * share,
            1e-3 * total);
    if (cost == textbook)
        fprintf(out, "-\n");
    else
        fprintf(out, "%.0f\n", 1e-3 * cost->contact_ns);
}

void process_costs(const Experiment *experiment)
{
    static Cost cost[VERSIONS], textbook_cost;
    static VoxelWorld world[VERSIONS];
    for (int v = 0; v < VERSIONS; v++)
        create_world(&world[v], &SERVER[v]);
    for (int round = 0; round < experiment->repeats; round++) {
        SCOPED(voxel_textbook_destroy) VoxelTextbook textbook; // anew, so that it has not moved far
        create_textbook(&textbook, &world[0]);
        time_textbook(&textbook, world[0].body->h, &textbook_cost);
        for (int v = 0; v < VERSIONS; v++)
            time_server(&world[v], &SERVER[v], &cost[v]);
    }
    CLOSED FILE *out = experiment_open(experiment, "cost-space.tsv");
    fprintf(out, "version\telements\tvertices\ta elastic force\tb reconstruction\tc force "
                 "summation\td update\te "
                 "collision\ttotal [ns per element and step]\tof the textbook's, times "
                 "faster\tstep [us]\tthe server's own contact [us]\n");
    write_cost(out, "textbook, double", &textbook_cost, &textbook_cost);
    for (int v = 0; v < VERSIONS; v++) {
        write_cost(out, SERVER[v].name, &cost[v], &textbook_cost);
        voxel_world_destroy(&world[v]);
    }
}
