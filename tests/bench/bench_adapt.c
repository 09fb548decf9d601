// SPDX-License-Identifier: MIT
// What a solid costs that is fine only where a tool is (surface_level): ticks while a ball is
// pressed into it and dragged over it, changes of its elements and what the carried surface takes
// of them.
#include "bench.h"
#include "sim_steps.h"
#include "voxel_world.h"

#include "base/clock.h"
#include "voxel/cut/cut_body.h"

enum { WAIT = 50, PRESS = 100, HOLD = 100, DRAG = 500, TICKS = WAIT + PRESS + HOLD + DRAG };
static const double SPEED = 0.1; // [m/s]

typedef struct Try {
    int cells, levels;
    double radius, depth; // [m]
} Try;

// Times of a tick: all of it, and adapting.
typedef struct Ticks {
    int count;
    double us[TICKS], adapt[TICKS];
} Ticks;

// Of the one body: its operations, and what adapting took of this thread in the tick.
static const BodyOps *own;
static int64_t adapt_ns;

static bool timed_adapt(Body *body, int64_t step, double tick, TopologyChange *change)
{
    const int64_t begin = clock_thread_ns();
    const bool changed = own->adapt(body, step, tick, change);
    adapt_ns = clock_thread_ns() - begin;
    return changed;
}

static void time_adapting(Body *body)
{
    static BodyOps timed;
    own = body->ops;
    timed = *own;
    timed.adapt = timed_adapt;
    body->ops = &timed;
}

static void create(VoxelWorld *world, const Try *try, const char *isa)
{
    static const FixedRegion bottom = {
        .kind = FIXED_BOX, .low = {-1, -1, -1}, .high = {1, 1, -0.0499}};
    VoxelWorldOptions options = voxel_world_cube(try->cells);
    options.material.poisson_ratio = 0.3;
    options.body.body.levels = options.body.surface_level = try->levels;
    options.body.body.precision = PRECISION_SINGLE;
    options.body.body.isa = isa;
    fix_within(&options.body.body, &bottom);
    options.tool[options.tool_count++] = (ToolOptions){PROBE(try->radius, 10.0)};
    voxel_world_create(world, &options);
    sim_set_lockstep(world->sim, true);
    time_adapting(world->body);
}

// Lowered in 0.1 s, held for 0.1 s, then dragged.
static void pose(VoxelWorld *world, const Try *try, int tick)
{
    const double down = fmin(1.0, fmax(0.0, (tick - WAIT) / (double)PRESS)),
                 along = SPEED * fmax(0.0, tick - WAIT - PRESS - HOLD) * sim_tick(world->sim);
    const ToolPose pose = {
        .utime = (int64_t)(1e6 * tick * sim_tick(world->sim)),
        .position = {along - 0.025, 0.0, 0.0501 + try->radius - down * (try->depth + 1e-4)},
        .orientation = QUAT_NONE,
        .active = true};
    sim_apply_pose(world->sim, 0, &pose, true);
}

static void write_ticks(const Bench *bench, const char *name, int size, Ticks *ticks, bool adapts)
{
    bench_sort(ticks->us, ticks->count);
    bench_sort(ticks->adapt, ticks->count);
    const int last = ticks->count - 1;
    double sum = 0.0;
    for (int k = 0; k < ticks->count; k++)
        sum += ticks->adapt[k] / ticks->count;
    bench_row(bench, name, size, "us_per_tick_p50", ticks->us[ticks->count / 2], "us");
    bench_row(bench, name, size, "us_per_tick_p99", ticks->us[last * 99 / 100], "us");
    if (!adapts)
        return;
    bench_row(bench, name, size, "us_of_adapting_mean", sum, "us");
    bench_row(bench, name, size, "us_of_adapting_most", ticks->adapt[last], "us");
}

// What changes took, by their kind, in ticks that had some.
typedef struct Changes {
    int64_t divided, merged; // before a tick
    double division_us, merge_us, divisions, merges;
} Changes;

static void add_changes(Changes *sum, const CutAdapt *adapt, double us)
{
    const double divided = (double)(adapt->divided - sum->divided),
                 merged = (double)(adapt->merged - sum->merged);
    sum->divisions += divided;
    sum->merges += merged;
    sum->division_us += divided > 0.0 ? us : 0.0;
    sum->merge_us += merged > 0.0 ? us : 0.0;
}

static void write_changes(const Bench *bench, int size, const Changes *sum)
{
    static const char name[] = "voxel.adapt.change";
    bench_row(bench, name, size, "divisions_per_tick_dragged", sum->divisions / DRAG, "1");
    bench_row(bench, name, size, "merges_per_tick_dragged", sum->merges / DRAG, "1");
    if (sum->divisions > 0.0)
        bench_row(bench, name, size, "us_per_division", sum->division_us / sum->divisions, "us");
    if (sum->merges > 0.0)
        bench_row(bench, name, size, "us_per_merge", sum->merge_us / sum->merges, "us");
}

static void write_carry(const Bench *bench, VoxelWorld *world, int size)
{
    VoxelModel *model = world->body->model;
    CutCarry *carry = model->cuts->carry;
    Samples samples = {0};
    for (int k = 0; k < BENCH_REPEATS_MAX; k++) {
        const int64_t begin = clock_thread_ns();
        cut_carry_forget(carry);
        for (int i = 0; i < carry->leaf_count; i++)
            cut_carry_find(carry, carry->leaf[i]);
        samples_add(&samples, 1e-3 * (double)(clock_thread_ns() - begin));
    }
    const double least = samples_min(&samples);
    bench_row(bench, "voxel.adapt.carry", size, "us_per_tick", least, "us");
    bench_row(bench, "voxel.adapt.carry", size, "ns_per_vertex",
              1e3 * least / cut_carry_count(carry), "ns");
}

static void run(Bench *bench, const Try *try)
{
    static VoxelWorld world;
    static Ticks pressed, dragged;
    pressed.count = dragged.count = 0;
    create(&world, try, bench->isa);
    const CutAdapt *adapt = ((VoxelModel *)world.body->model)->cuts->adapt;
    const int size = world.body->surface.node_used, cells = try->cells;
    Changes changes = {0};
    double elements[2] = {0.0, 0.0};
    for (int tick = 0; tick < (bench->quick ? WAIT + PRESS + HOLD + 20 : TICKS); tick++) {
        pose(&world, try, tick);
        changes.divided = adapt->divided;
        changes.merged = adapt->merged;
        const int64_t begin = clock_thread_ns();
        sim_step(world.sim);
        const double us = 1e-3 * (double)(clock_thread_ns() - begin),
                     of_adapt = 1e-3 * (double)adapt_ns;
        const bool drags = tick >= WAIT + PRESS + HOLD;
        Ticks *to = drags ? &dragged : &pressed;
        if (tick < WAIT + PRESS + HOLD / 2)
            continue;
        to->us[to->count] = us;
        to->adapt[to->count++] = of_adapt;
        elements[drags] += world.body->element_count;
        if (drags)
            add_changes(&changes, adapt, of_adapt);
    }
    write_ticks(bench, "voxel.adapt.pressed", size, &pressed, false);
    bench_row(bench, "voxel.adapt.pressed", size, "elements", elements[0] / pressed.count, "1");
    write_ticks(bench, "voxel.adapt.dragged", size, &dragged, true);
    bench_row(bench, "voxel.adapt.dragged", size, "elements", elements[1] / dragged.count, "1");
    write_changes(bench, size, &changes);
    write_carry(bench, &world, size);
    bench_row(bench, "voxel.adapt.memory", size, "bytes_per_cell",
              (double)arena_bytes(&world.arena) / (cells * cells * cells), "B");
    voxel_world_destroy(&world);
}

void bench_adaptations(Bench *bench)
{
    if (!bench_wants(bench, "voxel.adapt"))
        return;
    run(bench, &(Try){bench->quick ? 16 : 32, 2, 0.015, 0.005});
    if (!bench->quick)
        run(bench, &(Try){64, 3, 0.005, 0.004});
}
