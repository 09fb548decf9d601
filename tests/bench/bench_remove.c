// SPDX-License-Identifier: MIT
// What taking cells away costs: a burr that goes through half of a graded cube, by the cell and by
// the tick.
#include "bench.h"

#include "base/clock.h"
#include "sim/sim_data.h"
#include "voxel/voxel.h"

#include <stdio.h>
#include <stdlib.h>

static const double EDGE = 0.1, RATE = 1000.0, SPEED = 0.02, BURR = 0.006; // [m], [Hz], [m/s]

typedef struct World {
    Arena arena;
    StateList state;
    Sim *sim;
    Body *body;
} World;

static bool world_create(World *world, int cells, const char *isa, Status *status)
{
    *world = (World){.sim = NULL};
    Lattice lattice = {0};
    if (!lattice_box(&lattice, (int[3]){cells, cells, cells}, EDGE / cells, status))
        return false;
    const SolidMaterial material = {.youngs_modulus = 1e4, .density = 1000.0};
    const FixedRegion floor = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.5 * EDGE + 1e-6}};
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
                                  .body.removable = true,
                                  .split_budget = 16,
                                  .body.isa = isa};
    const SimOptions sim = {.rate_hz = RATE, .tool_timeout_s = 10.0};
    world->sim = sim_create(&sim, &world->arena, &world->state);
    Body body = {0};
    const bool good = voxel_create(&body, &options, &world->arena, &world->state, status);
    lattice_destroy(&lattice);
    if (!good)
        return false;
    world->body = sim_add_body(world->sim, &body);
    const Capsule burr = {.radius = BURR};
    const ToolOptions drill = {.id = 1,
                               .kind = TOOL_REMOVER,
                               .removes = REMOVER_DRILL,
                               .mouth = burr,
                               .capsule_count = 1,
                               .capsule[0] = burr,
                               .max_force = 10.0};
    sim_add_tool(world->sim, &drill);
    return sim_seal(world->sim, 0.0, status);
}

static void world_destroy(World *world)
{
    state_destroy(&world->state);
    arena_destroy(&world->arena);
}

static Vec3 burr_at(int tick)
{
    return (Vec3){7e-4, 1.1e-3, 0.5 * EDGE + 0.5 * BURR - tick * SPEED / RATE};
}

// --- by the cell: what the body does, without a tick around it ---

static void run_cells(Bench *bench, const char *name, int cells)
{
    Status status = {0};
    World world;
    double us_search = 0.0, us_removal = 0.0, us_division = 0.0;
    int removed = 0, searches = 0, removals = 0;
    if (!world_create(&world, cells, bench->isa, &status)) {
        bench_fail(bench, name, status.text);
        return;
    }
    for (int tick = 0; tick < (int)(0.5 * EDGE / SPEED * RATE); tick++) {
        const Vec3 at = burr_at(tick);
        const Removal removal = {.kind = REMOVER_DRILL,
                                 .mouth = {REGION_CAPSULE, at, at, BURR},
                                 .volume = (double)INFINITY,
                                 .tick = 1.0 / RATE};
        TopologyChange change = {.again = true};
        world.body->step = tick;
        while (change.again) {
            RemovalOutcome outcome;
            change = (TopologyChange){.face_count = 0};
            const int64_t begin = clock_thread_ns();
            const bool changed = world.body->ops->remove(world.body, &removal, &outcome, &change);
            const double us = 1e-3 * (double)(clock_thread_ns() - begin);
            *(outcome.removed > 0 ? &us_removal : changed ? &us_division : &us_search) += us;
            removed += outcome.removed;
            searches += !changed;
            removals += outcome.removed > 0;
        }
    }
    bench_row(bench, name, cells, "us_search", us_search / searches, "us");
    bench_row(bench, name, cells, "us_removal", us_removal / removals, "us");
    bench_row(bench, name, cells, "us_cell", us_removal / removed, "us");
    bench_row(bench, name, cells, "us_cell_divisions", us_division / removed, "us");
    bench_row(bench, name, cells, "cells", removed, "1");
    world_destroy(&world);
}

// --- by the tick ---

static double run_ticks(World *world, double *us, int ticks, bool drills)
{
    const double mass = world->body->mass;
    for (int tick = 0; tick < ticks; tick++) {
        const ToolPose pose = {.utime = 1000 * tick,
                               .position = burr_at(tick),
                               .orientation = {1.0, 0.0, 0.0, 0.0},
                               .grip = 1.0,
                               .active = drills};
        sim_apply_pose(world->sim, 0, &pose, true);
        const int64_t begin = clock_thread_ns();
        sim_step(world->sim);
        const double spent = 1e-3 * (double)(clock_thread_ns() - begin);
        us[tick] = us[tick] == 0.0 || spent < us[tick] ? spent : us[tick];
    }
    return 1.0 - world->body->mass / mass;
}

static void run_tick(Bench *bench, const char *name, int cells)
{
    Status status = {0};
    World world;
    const int ticks = (int)(0.5 * EDGE / SPEED * RATE) / (bench->quick ? 20 : 1);
    double *on = calloc((size_t)ticks, sizeof *on), *off = calloc((size_t)ticks, sizeof *off);
    double share = 0.0;
    if (!world_create(&world, cells, bench->isa, &status)) {
        bench_fail(bench, name, status.text);
        return;
    }
    // Minimum over repeats, which do the same work.
    for (int repeat = 0; repeat < (bench->quick ? 1 : 3); repeat++) {
        share = run_ticks(&world, on, ticks, true);
        sim_reset(world.sim);
        run_ticks(&world, off, ticks, false);
        sim_reset(world.sim);
    }
    bench_sort(on, ticks);
    bench_sort(off, ticks);
    bench_row(bench, name, cells, "us_without_median", off[ticks / 2], "us");
    bench_row(bench, name, cells, "us_tick_median", on[ticks / 2], "us");
    bench_row(bench, name, cells, "us_tick_p99", on[ticks * 99 / 100], "us");
    bench_row(bench, name, cells, "us_tick_max", on[ticks - 1], "us");
    bench_row(bench, name, cells, "share_removed", share, "1");
    free(on);
    free(off);
    world_destroy(&world);
}

void bench_removals(Bench *bench)
{
    if (bench_wants(bench, "voxel.remove.cell"))
        run_cells(bench, "voxel.remove.cell", 32);
    if (bench_wants(bench, "voxel.remove.tick"))
        run_tick(bench, "voxel.remove.tick", 32);
}
