// SPDX-License-Identifier: MIT
// What cutting a graded voxel body costs: a face that breaks and a division that follows, by what
// has to follow them; ticks with a blade that goes through half of the body; heat.
#include "bench.h"

#include "base/clock.h"
#include "sim/sim_data.h"
#include "voxel/cut/cut_body.h"
#include "voxel/voxel.h"

#include <stdio.h>
#include <stdlib.h>

static const double SIZE = 3.125e-3, RATE = 1000.0;

typedef struct World {
    Arena arena;
    StateList state;
    Sim *sim;
    Body *body;
    VoxelCuts *cuts;
} World;

static bool world_create(World *world, int cells, bool heats, const char *isa, Status *status)
{
    *world = (World){.sim = NULL};
    Lattice lattice = {0};
    if (!lattice_box(&lattice, (int[3]){cells, cells, cells}, SIZE, status))
        return false;
    const SolidMaterial material = {.youngs_modulus = 1e4, .density = 1000.0};
    const FixedRegion floor = {.kind = FIXED_BOX,
                               .low = {-1.0, -1.0, -1.0},
                               .high = {1.0, 1.0, -0.5 * SIZE * cells + 1e-6}};
    const VoxelOptions options = {.body.name = "body",
                                  .lattice = &lattice,
                                  .body.levels = 2,
                                  .material_count = 1,
                                  .material = &material,
                                  .damping = 0.2,
                                  .body.precision = PRECISION_SINGLE,
                                  .body.fixed_count = 1,
                                  .body.fixed = &floor,
                                  .body.contact_ratio = 0.5,
                                  .body.cuttable = true,
                                  .split_budget = 16,
                                  .heats = heats,
                                  .coagulated_stiffness = HEAT_STIFFER,
                                  .body.isa = isa};
    const SimOptions sim = {.rate_hz = RATE, .tool_timeout_s = 10.0};
    world->sim = sim_create(&sim, &world->arena, &world->state);
    Body body = {0};
    const bool good = voxel_create(&body, &options, &world->arena, &world->state, status);
    lattice_destroy(&lattice);
    if (!good)
        return false;
    world->body = sim_add_body(world->sim, &body);
    world->cuts = ((VoxelModel *)body.model)->cuts;
    const ToolOptions blade = {.id = 1,
                               .kind = TOOL_BLADE,
                               .edge = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.06}},
                               .max_force = 10.0};
    sim_add_tool(world->sim, &blade);
    return sim_seal(world->sim, 0.0, status);
}

static void world_destroy(World *world)
{
    state_destroy(&world->state);
    arena_destroy(&world->arena);
}

// --- by stage ---

enum { LATTICE, PIECES, MASSES, WINDOWS, FACES, PARTS };
static const char *const PART_NAME[PARTS] = {"lattice", "pieces", "masses", "windows", "faces"};

typedef struct Cost {
    int count; // of faces or divisions
    int64_t ns[PARTS];
    double most; // of one call, for each of its faces or divisions [ns]
} Cost;

static void follow(World *world, Cost *cost, bool divided, bool came, int64_t begin)
{
    VoxelCuts *cuts = world->cuts;
    TopologyChange change;
    cut_masses_follow(&cuts->masses, divided);
    int64_t end = clock_now_ns();
    cost->ns[MASSES] += end - begin;
    cut_windows_update(&cuts->windows);
    begin = clock_now_ns();
    cost->ns[WINDOWS] += begin - end;
    cut_faces_follow(&cuts->faces, came, world->body, &change);
    cut_lattice_forget_changes(&cuts->lattice);
    cost->ns[FACES] += clock_now_ns() - begin;
}

static void break_row(World *world, Cost *cost, const int (*face)[2], int count)
{
    VoxelCuts *cuts = world->cuts;
    const int64_t start = clock_now_ns();
    cut_lattice_break(&cuts->lattice, face, count);
    int64_t begin = clock_now_ns();
    cost->ns[LATTICE] += begin - start;
    const bool came = cut_pieces_follow(&cuts->pieces, face, count);
    const int64_t end = clock_now_ns();
    cost->ns[PIECES] += end - begin;
    follow(world, cost, false, came, end);
    cost->count += count;
    const double each = (double)(clock_now_ns() - start) / count;
    cost->most = each > cost->most ? each : cost->most;
}

static void reconstruct(World *world, Cost *cost)
{
    VoxelCuts *cuts = world->cuts;
    const int64_t start = clock_now_ns();
    const int divided = cut_lattice_reconstruct(&cuts->lattice);
    const int64_t end = clock_now_ns();
    cost->ns[LATTICE] += end - start;
    if (divided == 0)
        return;
    follow(world, cost, true, false, end);
    cost->count += divided;
    const double each = (double)(clock_now_ns() - start) / divided;
    cost->most = each > cost->most ? each : cost->most;
}

// Rows of faces in the middle plane, half way, each broken and then all that it asks for divided.
static void cut_half(World *world, int cells, Cost *broken, Cost *divided)
{
    const CutLattice *lattice = &world->cuts->lattice;
    int(*face)[2] = malloc((size_t)cells * sizeof *face);
    for (int row = 0; row < cells / 2; row++) {
        for (int k = 0; k < cells; k++) {
            face[k][0] = cut_lattice_cell(lattice, cells / 2 - 1, row, k);
            face[k][1] = 0;
        }
        break_row(world, broken, (const int(*)[2])face, cells);
        while (lattice->wanted_count > 0)
            reconstruct(world, divided);
    }
    free(face);
}

static void print_cost(Bench *bench, const char *name, int size, const Cost *cost)
{
    int64_t total = 0;
    char metric[64];
    for (int part = 0; part < PARTS; part++) {
        total += cost->ns[part];
        snprintf(metric, sizeof metric, "%s_each", PART_NAME[part]);
        bench_row(bench, name, size, metric, 1e-3 * (double)cost->ns[part] / cost->count, "us");
    }
    bench_row(bench, name, size, "each", 1e-3 * (double)total / cost->count, "us");
    bench_row(bench, name, size, "each_worst_call", 1e-3 * cost->most, "us");
    bench_row(bench, name, size, "count", cost->count, "1");
}

static void take_least(const Cost *cost, Cost *least)
{
    const bool first = least->count == 0;
    for (int part = 0; part < PARTS; part++)
        if (first || cost->ns[part] < least->ns[part])
            least->ns[part] = cost->ns[part];
    least->most = first || cost->most < least->most ? cost->most : least->most;
    least->count = cost->count;
}

static void run_parts(Bench *bench, int cells)
{
    if (!bench_wants(bench, "voxel.cut.face") && !bench_wants(bench, "voxel.cut.division"))
        return;
    Status status = {0};
    World world;
    Cost broken = {0}, divided = {0};
    if (!world_create(&world, cells, false, bench->isa, &status)) {
        bench_fail(bench, "voxel.cut.face", status.text);
        return;
    }
    // Minimum over repeats: the one that was disturbed least, with all memory touched before.
    for (int repeat = 0; repeat < (bench->quick ? 2 : 200); repeat++) {
        Cost of_faces = {0}, of_divisions = {0};
        cut_half(&world, cells, &of_faces, &of_divisions);
        sim_reset(world.sim);
        take_least(&of_faces, &broken);
        take_least(&of_divisions, &divided);
    }
    world_destroy(&world);
    print_cost(bench, "voxel.cut.face", cells, &broken);
    print_cost(bench, "voxel.cut.division", cells, &divided);
}

// --- ticks with a blade ---

static void move_blade(World *world, double way, double depth, bool active)
{
    const ToolPose pose = {.utime = (int64_t)(1e6 * way / 0.05),
                           .position = {1e-4, -0.5 * SIZE * 32 - 0.002 + way, depth},
                           .orientation = {1.0, 0.0, 0.0, 0.0},
                           .active = active};
    sim_apply_pose(world->sim, 0, &pose, true);
}

// 50 mm/s through the upper half.
static void run_stroke(Bench *bench, int cells)
{
    const char *name = "voxel.cut.tick";
    if (!bench_wants(bench, name))
        return;
    Status status = {0};
    World world;
    if (!world_create(&world, cells, false, bench->isa, &status)) {
        bench_fail(bench, name, status.text);
        return;
    }
    const int ticks = (int)((SIZE * cells + 0.004) / 0.05 * RATE) / (bench->quick ? 20 : 1);
    double *us = malloc((size_t)(ticks + 1) * sizeof *us), without = 0.0;
    for (int tick = 0; tick < 50; tick++) {
        const int64_t begin = clock_now_ns();
        sim_step(world.sim);
        const double took = 1e-3 * (double)(clock_now_ns() - begin);
        without = tick == 0 || took < without ? took : without;
    }
    for (int tick = 0; tick < ticks; tick++) {
        move_blade(&world, 0.05 * (tick + 1) / RATE, 0.0, true);
        const int64_t begin = clock_now_ns();
        sim_step(world.sim);
        us[tick] = 1e-3 * (double)(clock_now_ns() - begin);
    }
    bench_sort(us, ticks);
    const VoxelCuts *cuts = world.cuts;
    bench_row(bench, name, cells, "without_blade_min", without, "us");
    bench_row(bench, name, cells, "median", us[ticks / 2], "us");
    bench_row(bench, name, cells, "p99", us[ticks * 99 / 100], "us");
    bench_row(bench, name, cells, "worst", us[ticks - 1], "us");
    bench_row(bench, name, cells, "elements", cuts->lattice.leaf_count, "1");
    bench_row(bench, name, cells, "vertices", cut_lattice_used(&cuts->lattice), "1");
    free(us);
    world_destroy(&world);
}

// --- heat of diathermy ---

// What a tick of an electrode in the middle of a side costs: finding the cells that it heats, and
// heat that spreads through about 5000 of them.
static void run_heat(Bench *bench, int cells)
{
    const char *name = "voxel.heat";
    if (!bench_wants(bench, name))
        return;
    enum { WARM = 5000 };
    Status status = {0};
    World world;
    if (!world_create(&world, cells, true, bench->isa, &status)) {
        bench_fail(bench, name, status.text);
        return;
    }
    CutHeat *heat = world.cuts->heat;
    const Vertices *vertices = &((VoxelModel *)world.body->model)->vertices;
    const Vec3 at = {-0.5 * SIZE * cells, 1e-4, 2e-4};
    const Removal removal = {.kind = REMOVER_DIATHERMY,
                             .mouth = {.from = at, .to = at, .radius = 1.5 * SIZE},
                             .heat = 0.03};
    for (int cell = 0; cell < WARM && cell < heat->cell_count; cell++)
        heat->energy[cell] = (2.0 + cell % 7) * heat->capacity[0];
    cut_heat_derive(heat);
    const int ticks = bench->quick ? 10 : 2000;
    double *give = malloc((size_t)ticks * sizeof *give),
           *spread = malloc((size_t)ticks * sizeof *spread);
    for (int tick = 0; tick < ticks; tick++) {
        const int64_t begin = clock_now_ns();
        cut_heat_give(heat, &vertices->rows, vertices_row(vertices), &removal);
        const int64_t middle = clock_now_ns();
        cut_heat_spread(heat, 1.0 / RATE);
        give[tick] = 1e-3 * (double)(middle - begin);
        spread[tick] = 1e-3 * (double)(clock_now_ns() - middle);
    }
    bench_sort(give, ticks);
    bench_sort(spread, ticks);
    bench_row(bench, name, cells, "warm", heat->warm_count, "1");
    bench_row(bench, name, cells, "give", give[ticks / 2], "us");
    bench_row(bench, name, cells, "spread", spread[ticks / 2], "us");
    bench_row(bench, name, cells, "spread_p99", spread[ticks * 99 / 100], "us");
    free(give);
    free(spread);
    world_destroy(&world);
}

void bench_divisions(Bench *bench)
{
    run_parts(bench, 32);
    run_stroke(bench, 32);
    run_heat(bench, 32);
}
