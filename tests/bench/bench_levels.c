// SPDX-License-Identifier: MIT
// Bodies that adapt their level of detail. Against the same bodies wholly refined, with the scenes
// of the paper's experiments: CPU time and how far the curves lie apart. And what looking and
// changing cost a tick of a large body at 1 kHz while a tool is drawn over it.
#include "bench.h"
#include "daemon.h"
#include "run.h"

#include "base/clock.h"

#include <limits.h>
#include <math.h>
#include <unistd.h>

static const double SECONDS = 1.2; // pressed for one half, released for the other
static const double WALL = 0.002;  // thickness of walls that bend [m]

enum { COARSE, REFINED, ADAPTIVE, REFINED_1, ADAPTIVE_1, MODEL_COUNT };
static const Model *const models[MODEL_COUNT] = {&MODEL_COARSE, &MODEL_REFINED_2, &MODEL_ADAPTIVE_2,
                                                 &MODEL_REFINED_1, &MODEL_ADAPTIVE_1};

// All stages of a tick; contacts are part of the forces.
static double all_stages_ns(const Sim *sim)
{
    int64_t sum = 0;
    for (int i = 0; i < sim_stage_count(sim); i++)
        sum += sim_stage(sim, i) == STAGE_CONTACT ? 0 : sim_stage_ns(sim, sim_stage(sim, i));
    return (double)sum;
}

// One press and release. Adds up the time of stage ADAPT and of all.
static void run_model(const Scene *scene, const Model *model, const Probe *probe, Trace *trace,
                      double ns[2])
{
    World world;
    run_build(scene, model, &world);
    run_steps(&world, probe, SECONDS, trace);
    ns[0] += (double)sim_stage_ns(world.sim, STAGE_ADAPT);
    ns[1] += all_stages_ns(world.sim);
    world_destroy(&world);
}

// As the scene has it (RK4 at 60 Hz), or at the rate of a haptic device with the default
// integrator.
typedef enum Pace { AS_SCENE, HAPTIC } Pace;

// How far the adaptive body's displacements lie from those of the refined one: at all nodes of the
// finest level, sixty times a second, as the root of the sums of squares.
static double field_difference(const Scene *scene, const Probe *probe)
{
    World world[2];
    Levels levels;
    Arena arena = {0};
    Status status = {0};
    if (!levels_create(&levels, &probe->mesh, models[ADAPTIVE]->levels, "field", &arena, &status))
        return (double)NAN;
    const int nodes = levels.level[levels.finest].node_count;
    Vec3 *u[2];
    double sum = 0.0, size = 0.0;
    for (int k = 0; k < 2; k++) {
        run_build(scene, models[k == 0 ? REFINED : ADAPTIVE], &world[k]);
        u[k] = arena_allocate(&arena, ARENA_TOPOLOGY, (size_t)nodes, sizeof *u[k], "field");
    }
    const int ticks = (int)lround(SECONDS * scene->sim.rate_hz);
    const int every = (int)fmax(1.0, lround(scene->sim.rate_hz / 60.0));
    for (int t = 1; t <= ticks; t++) {
        for (int k = 0; k < 2; k++) {
            run_step(&world[k]);
            if (t % every == 0)
                run_displacements(&world[k], &levels, u[k]);
        }
        for (int i = 0; t % every == 0 && i < nodes; i++) {
            const Vec3 apart = vec3_sub(u[1][i], u[0][i]);
            sum += vec3_dot(apart, apart);
            size += vec3_dot(u[0][i], u[0][i]);
        }
    }
    for (int k = 0; k < 2; k++)
        world_destroy(&world[k]);
    arena_destroy(&arena);
    return sqrt(sum / size);
}

// `thickness` of the wall [m]; 0: as in the paper, it does not bend.
static void run_press(Bench *bench, const char *name, const char *file, double force, Pace pace,
                      double thickness)
{
    static Trace trace[MODEL_COUNT];
    Scene scene;
    Probe probe;
    Samples samples[MODEL_COUNT] = {0};
    double ns[MODEL_COUNT][2] = {0};
    if (!bench_wants(bench, name))
        return;
    run_read(PLIANT_BENCH_SCENES, file, &scene);
    scene_scale_loads(&scene, force);
    scene.body[0].surface.material.thickness = thickness;
    if (pace == HAPTIC) {
        scene.sim.rate_hz = 1000.0;
        scene.body[0].surface.adapt.check_hz = 100.0;
        scene.body[0].surface.body.integrator = INTEGRATOR_LEAPFROG;
    }
    probe_create(&scene, &probe);
    for (int r = 0; r < (bench->quick ? 1 : 15); r++)
        for (int m = 0; m < MODEL_COUNT; m++) {
            run_model(&scene, models[m], &probe, &trace[m], ns[m]);
            samples_add(&samples[m], 1e-3 * (double)trace[m].cpu_ns);
        }
    const int nodes = probe.mesh.node_count;
    const double refined = samples_min(&samples[REFINED]);
    const double adaptive = samples_min(&samples[ADAPTIVE]);
    bench_row(bench, name, nodes, "us_coarse", samples_min(&samples[COARSE]), "us");
    bench_row(bench, name, nodes, "us_refined", refined, "us");
    bench_row(bench, name, nodes, "us_adaptive", adaptive, "us");
    bench_row(bench, name, nodes, "saved", 100.0 * (1.0 - adaptive / refined), "%");
    bench_row(bench, name, nodes, "curve_difference",
              100.0 * trace_difference(&trace[ADAPTIVE], &trace[REFINED]), "%");
    bench_row(bench, name, nodes, "field_difference", 100.0 * field_difference(&scene, &probe),
              "%");
    bench_row(bench, name, nodes, "adapt_share", 100.0 * ns[ADAPTIVE][0] / ns[ADAPTIVE][1], "%");
    const double saved_1 =
        1.0 - samples_min(&samples[ADAPTIVE_1]) / samples_min(&samples[REFINED_1]);
    bench_row(bench, name, nodes, "saved_of_1", 100.0 * saved_1, "%");
    bench_row(bench, name, nodes, "curve_difference_of_1",
              100.0 * trace_difference(&trace[ADAPTIVE_1], &trace[REFINED_1]), "%");
    bench_row(bench, name, nodes, "nodes_most", trace[ADAPTIVE].nodes[1], "1");
    // Adaptive from level 1 on.
    scene.body[0].surface.adapt.coarsest = 1;
    Samples from_1 = {0};
    for (int r = 0; r < (bench->quick ? 1 : 15); r++) {
        run_model(&scene, models[ADAPTIVE], &probe, &trace[ADAPTIVE], ns[ADAPTIVE]);
        samples_add(&from_1, 1e-3 * (double)trace[ADAPTIVE].cpu_ns);
    }
    bench_row(bench, name, nodes, "saved_from_1", 100.0 * (1.0 - samples_min(&from_1) / refined),
              "%");
    bench_row(bench, name, nodes, "field_difference_from_1",
              100.0 * field_difference(&scene, &probe), "%");
    probe_destroy(&probe);
    scene_destroy(&scene);
}

// ---------------------------------------------------------------------------------------------
// Bodies on which nothing was tuned

// At 1 kHz with the default integrator, criteria and springs; loads last 0.6 s.
static const char OTHER_SCENE[] =
    "name = \"other\";  rate_hz = 1000.0;  gravity = [%s];\n"
    "bodies = ( { name = \"other\";  mesh = { %s };  levels = 2;  adapt = {};  %s } );\n"
    "loads = ( %s );\n";
#define WORLD_SHAPE "shape = { angular_frequency = 50.0;  damping_ratio = 0.1; };"
#define FRAME                                                                                      \
    "fixed = ( { box = ([-1.0, -1.0, -1.0], [-0.0999, 1.0, 1.0]); },"                              \
    " { box = ([0.0999, -1.0, -1.0], [1.0, 1.0, 1.0]); } );"
#define STILL "0.0, 0.0, 0.0"
#define LOAD(at, radius, force)                                                                    \
    "{ center = [" at "];  radius = " radius ";  force = [" force "];  duration = 0.6; }"

static const struct {
    const char *name, *gravity, *mesh, *rest, *loads;
} OTHERS[] = {
    {"ball.poked", STILL, "generator = \"ico_sphere\";  nodes = 162;  radius = 0.05;", WORLD_SHAPE,
     LOAD("0.0, 0.0, 0.05", "0.02", "0.0, 0.0, -0.3")},
    {"ball.pushed", STILL, "generator = \"sphere\";  nodes = 300;  radius = 0.06;", WORLD_SHAPE,
     LOAD("0.06, 0.0, 0.0", "0.03", "-0.5, 0.0, 0.0")},
    {"ball.large", STILL, "generator = \"sphere\";  nodes = 642;  radius = 0.06;", WORLD_SHAPE,
     LOAD("0.0, 0.0, 0.06", "0.015", "0.0, 0.0, -0.3")},
    {"ball.pinched", STILL,
     "generator = \"uv_sphere\";  rings = 10;  segments = 20;  radius = 0.05;", WORLD_SHAPE,
     LOAD("0.0, 0.05, 0.0", "0.02", "0.0, -0.3, 0.0") ", " LOAD("0.0, -0.05, 0.0", "0.02",
                                                                "0.0, 0.3, 0.0")},
    {"ball.half", STILL, "generator = \"sphere\";  nodes = 162;  radius = 0.05;",
     WORLD_SHAPE " fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.03]); } );",
     LOAD("0.0, 0.0, 0.05", "0.06", "0.0, 0.0, -2.0")},
    {"ball.swinging", "3.0, 0.0, 0.0", "generator = \"sphere\";  nodes = 114;  radius = 0.05;",
     WORLD_SHAPE, ""},
    {"sheet.poked", STILL,
     "generator = \"sheet\";  columns = 15;  rows = 15;  width = 0.2;  height = 0.2;",
     WORLD_SHAPE FRAME, LOAD("0.0, 0.0, 0.0", "0.03", "0.0, 0.0, -0.3")},
    {"sheet.sagging", "0.0, 0.0, -9.81",
     "generator = \"sheet\";  columns = 9;  rows = 9;  width = 0.2;  height = 0.2;", FRAME, ""},
    {"stomach.poked", STILL, "generator = \"stomach\";  nodes = 400;  length = 0.25;", WORLD_SHAPE,
     LOAD("-0.1067, 0.0, 0.0187", "0.03", "0.4, 0.0, 0.0")},
    {"stomach.pressed", STILL, "generator = \"stomach\";  nodes = 188;  length = 0.25;",
     WORLD_SHAPE,
     LOAD("-0.1067, 0.0, 0.0187", "0.06", "0.6, 0.0, 0.0") ", " LOAD(
         "0.05, 0.0, 0.0", "0.06", "-0.6, 0.0, 0.0") ", " LOAD("0.0, 0.03, 0.05", "0.06",
                                                               "0.0, -0.5, -0.5")},
};

// CPU time of the press as adaptive and as refined everywhere, with two levels and with one.
static void run_other(Bench *bench, int other)
{
    char name[64], text[2048], path[64];
    Scene scene = {0};
    Status status = {0};
    Samples samples[MODEL_COUNT] = {0};
    snprintf(name, sizeof name, "levels.other.%s", OTHERS[other].name);
    if (!bench_wants(bench, name))
        return;
    snprintf(text, sizeof text, OTHER_SCENE, OTHERS[other].gravity, OTHERS[other].mesh,
             OTHERS[other].rest, OTHERS[other].loads);
    if (!daemon_write_scene(text, path, sizeof path)) {
        bench_fail(bench, name, "cannot write a scene");
        return;
    }
    const bool read = scene_read(path, &scene, &status);
    unlink(path);
    if (!read) {
        bench_fail(bench, name, status.text);
        return;
    }
    int nodes = 0;
    for (int r = 0; r < (bench->quick ? 1 : 5); r++)
        for (int m = 0; m < MODEL_COUNT; m++) {
            World world;
            int64_t ns = 0;
            run_build(&scene, models[m], &world);
            nodes = m == COARSE ? run_node_count(sim_body(world.sim, 0)) : nodes;
            for (int i = 0; i < (bench->quick ? 20 : 1200); i++)
                ns += run_step(&world);
            world_destroy(&world);
            samples_add(&samples[m], 1e-3 * (double)ns);
        }
    bench_row(bench, name, nodes, "adaptive_over_refined",
              samples_min(&samples[ADAPTIVE]) / samples_min(&samples[REFINED]), "1");
    bench_row(bench, name, nodes, "adaptive_over_refined_of_1",
              samples_min(&samples[ADAPTIVE_1]) / samples_min(&samples[REFINED_1]), "1");
    scene_destroy(&scene);
}

// ---------------------------------------------------------------------------------------------
// One tick

// The load holds a cap at the finest level; the probe, drawn over what is coarse, divides faces
// before it and leaves calm ones behind.
static const char TOPOLOGY[] = "levels.topology";
static const char TOPOLOGY_SCENE[] =
    "name = \"topology\";\n"
    "rate_hz = 1000.0;  tool_timeout_s = 3600.0;\n"
    "bodies = ( { name = \"ball\";\n"
    "    mesh = { generator = \"ico_sphere\";  nodes = %d;  radius = 0.2; };\n"
    "    levels = 2;  adapt = { force = 0.001;  check_hz = 100.0; };\n"
    "    shape = { angular_frequency = 50.0;  damping_ratio = 0.1; }; } );\n"
    "tools = ( { id = 1;  kind = \"probe\";  capsules = ( { radius = 0.01; } ); } );\n"
    "loads = ( { center = [0.0, 0.0, 0.2];  radius = %g;  force = [0.0, 0.0, %g];\n"
    "            duration = 1000.0; } );\n";
static const double BALL = 0.2, TIP = 0.01;        // radii [m]
static const double DEPTH = 0.01, SPEED = 0.2;     // of the probe [m], [m/s]
static const double REACH = 0.17, TRACTION = 40.0; // of the load [m], [N/m2]

enum { TICKS = 2000, WARM_UP = 1000 };

// What one tick took, at its least over the repeats: ticks of the same number do the same work, so
// what is above that belongs to other programs.
typedef struct Ticks {
    int count;
    double adapt[TICKS], all[TICKS]; // [us]
    int nodes[2];                    // least and most
    int changes;                     // of topology
} Ticks;

static ToolPose pose_at(double time)
{
    const double angle = SPEED * time / BALL, away = BALL + TIP - DEPTH;
    return (ToolPose){.position = {away * cos(angle), away * sin(angle), 0.0},
                      .orientation = {1.0, 0.0, 0.0, 0.0},
                      .active = true};
}

static void draw_over(Sim *sim, Ticks *ticks, bool first)
{
    const Body *body = sim_body(sim, 0);
    const int topology = body->mesh.topology;
    for (int i = 0; i < ticks->count; i++) {
        const ToolPose pose = pose_at(i * sim_tick(sim));
        sim_apply_pose(sim, 0, &pose, true);
        const int64_t adapt = sim_stage_ns(sim, STAGE_ADAPT), begin = clock_now_ns();
        sim_step(sim);
        const double all_us = 1e-3 * (double)(clock_now_ns() - begin);
        const double adapt_us = 1e-3 * (double)(sim_stage_ns(sim, STAGE_ADAPT) - adapt);
        const int nodes = run_node_count(body);
        ticks->adapt[i] = first ? adapt_us : fmin(ticks->adapt[i], adapt_us);
        ticks->all[i] = first ? all_us : fmin(ticks->all[i], all_us);
        ticks->nodes[0] = nodes < ticks->nodes[0] ? nodes : ticks->nodes[0];
        ticks->nodes[1] = nodes > ticks->nodes[1] ? nodes : ticks->nodes[1];
    }
    ticks->changes = body->mesh.topology - topology;
}

static bool run_ticks(const Bench *bench, const char *path, Ticks *ticks, Status *status)
{
    const BuildOptions options = {.isa = bench->isa};
    for (int r = 0; r < (bench->quick ? 1 : 5); r++) {
        Scene scene = {0};
        World world = {0};
        bool whole =
            scene_read(path, &scene, status) && world_build(&world, &scene, &options, status);
        for (int i = 0; whole && i < (bench->quick ? 10 : WARM_UP); i++)
            sim_step(world.sim);
        if (whole)
            draw_over(world.sim, ticks, r == 0);
        if (whole && sim_resets(world.sim) > 0)
            whole = status_fail(status, STATUS_FAILED, "the body was reset");
        world_destroy(&world);
        scene_destroy(&scene);
        if (!whole)
            return false;
    }
    return true;
}

static void run_topology(Bench *bench)
{
    static Ticks ticks;
    const double pi = 3.14159265358979323846;
    const int nodes = bench->quick ? 642 : 2562;
    char text[1024], path[64];
    Status status = {0};
    ticks = (Ticks){.count = bench->quick ? 50 : TICKS, .nodes = {INT_MAX, 0}};
    // A ball around a point of a sphere cuts out pi r^2 of its surface.
    snprintf(text, sizeof text, TOPOLOGY_SCENE, nodes, REACH, -TRACTION * pi * REACH * REACH);
    if (!daemon_write_scene(text, path, sizeof path)) {
        bench_fail(bench, TOPOLOGY, "cannot write a scene");
        return;
    }
    bool whole = run_ticks(bench, path, &ticks, &status);
    unlink(path);
    if (!whole) {
        bench_fail(bench, TOPOLOGY, status.text);
        return;
    }
    double adapt = 0.0, all = 0.0;
    for (int i = 0; i < ticks.count; i++) {
        adapt += ticks.adapt[i];
        all += ticks.all[i];
    }
    bench_sort(ticks.adapt, ticks.count);
    bench_sort(ticks.all, ticks.count);
    const int last = ticks.count - 1, p99 = last * 99 / 100;
    bench_row(bench, TOPOLOGY, nodes, "nodes_least", ticks.nodes[0], "1");
    bench_row(bench, TOPOLOGY, nodes, "nodes_most", ticks.nodes[1], "1");
    bench_row(bench, TOPOLOGY, nodes, "changes", ticks.changes, "1");
    bench_row(bench, TOPOLOGY, nodes, "wall_us_adapt_p50", ticks.adapt[last / 2], "us");
    bench_row(bench, TOPOLOGY, nodes, "wall_us_adapt_p99", ticks.adapt[p99], "us");
    bench_row(bench, TOPOLOGY, nodes, "wall_us_adapt_max", ticks.adapt[last], "us");
    bench_row(bench, TOPOLOGY, nodes, "wall_us_tick_p50", ticks.all[last / 2], "us");
    bench_row(bench, TOPOLOGY, nodes, "wall_us_tick_p99", ticks.all[p99], "us");
    bench_row(bench, TOPOLOGY, nodes, "adapt_share", 100.0 * adapt / all, "%");
}

void bench_levels(Bench *bench)
{
    run_press(bench, "levels.sphere.1N", "sphere", 1.0, AS_SCENE, 0.0);
    run_press(bench, "levels.sphere.0.2N", "sphere", 0.2, AS_SCENE, 0.0);
    run_press(bench, "levels.stomach", "stomach", 1.0, AS_SCENE, 0.0);
    run_press(bench, "levels.haptic.sphere.1N", "sphere", 1.0, HAPTIC, 0.0);
    run_press(bench, "levels.haptic.sphere.0.2N", "sphere", 0.2, HAPTIC, 0.0);
    run_press(bench, "levels.haptic.stomach", "stomach", 1.0, HAPTIC, 0.0);
    run_press(bench, "levels.bends.sphere.1N", "sphere", 1.0, AS_SCENE, WALL);
    run_press(bench, "levels.bends.sphere.0.2N", "sphere", 0.2, AS_SCENE, WALL);
    run_press(bench, "levels.bends.stomach", "stomach", 1.0, AS_SCENE, WALL);
    run_press(bench, "levels.bends.haptic.sphere.1N", "sphere", 1.0, HAPTIC, WALL);
    run_press(bench, "levels.bends.haptic.sphere.0.2N", "sphere", 0.2, HAPTIC, WALL);
    run_press(bench, "levels.bends.haptic.stomach", "stomach", 1.0, HAPTIC, WALL);
    for (int other = 0; other < (int)(sizeof OTHERS / sizeof *OTHERS); other++)
        run_other(bench, other);
    if (bench_wants(bench, TOPOLOGY))
        run_topology(bench);
}
