// SPDX-License-Identifier: MIT
// Contact: a sphere and a capsule pressed 10 mm into a held sphere of 0.2 m at 1 kHz, against the
// same ticks without the tool.
#include "bench.h"
#include "world.h"

#include "base/clock.h"
#include "geometry/generator.h"
#ifdef PLIANT_WITH_VOXEL
#include "daemon.h"

#include "scene/build.h"

#include <unistd.h>
#endif

static const double RADIUS = 0.2; // of the body [m]

static double time_ticks(Sim *sim, int ticks)
{
    int64_t begin = clock_thread_ns();
    for (int i = 0; i < ticks; i++)
        sim_step(sim);
    return (double)(clock_thread_ns() - begin) * 1e-3 / ticks;
}

static void run_case(Bench *bench, const char *name, const ToolOptions *tool, int subdivisions)
{
    TriMesh mesh;
    Status status = {0};
    BenchWorld world = {0}, free_world = {0};
    // The body that no tool can touch runs the same substeps.
    BenchWorldOptions options = {.integrator = INTEGRATOR_LEAPFROG,
                                 .precision = PRECISION_SINGLE,
                                 .rate_hz = 1000.0,
                                 .held_below = true,
                                 .tool = tool};
    bool whole = generate_ico_sphere(&mesh, subdivisions, RADIUS, &status) &&
                 bench_world_create(&world, &mesh, &options, &status);
    if (whole) {
        options.tool = NULL;
        options.time_step = world.body->h;
        whole = bench_world_create(&free_world, &mesh, &options, &status);
    }
    if (!whole) {
        bench_fail(bench, name, status.text);
    } else {
        ToolPose pose = {.position = {0.0, 0.0, RADIUS + tool->capsule[0].radius - 0.010},
                         .orientation = {1.0, 0.0, 0.0, 0.0},
                         .active = true};
        sim_apply_pose(world.sim, 0, &pose, true);
        time_ticks(world.sim, bench->quick ? 50 : 500); // until it rests
        Samples pressed = {0}, free_ticks = {0};
        for (int r = 0; r < (bench->quick ? 3 : 25); r++) {
            samples_add(&pressed, time_ticks(world.sim, 20));
            samples_add(&free_ticks, time_ticks(free_world.sim, 20));
        }
        if (!sim_wrench(world.sim, 0)->contact)
            bench_fail(bench, name, "the tool does not touch the body");
        double us = samples_min(&pressed), us_free = samples_min(&free_ticks);
        bench_row(bench, name, mesh.node_count, "us_per_tick", us, "us");
        bench_row(bench, name, mesh.node_count, "us_per_tick_median", samples_median(&pressed),
                  "us");
        bench_row(bench, name, mesh.node_count, "us_per_tick_without_tool", us_free, "us");
        bench_row(bench, name, mesh.node_count, "us_contact", us - us_free, "us");
    }
    bench_world_destroy(&world);
    bench_world_destroy(&free_world);
    mesh_destroy(&mesh);
}

// Jaws closed on the top of the same body and drawn 10 mm away: what holding costs, a tick and a
// held node and evaluation.
static void run_grasp(Bench *bench, const char *name, double radius, int subdivisions)
{
    TriMesh mesh;
    Status status = {0};
    BenchWorld world = {0}, free_world = {0};
    const ToolOptions tool = {.id = 1,
                              .kind = TOOL_GRASPER,
                              .capsule_count = 1,
                              .capsule = {{.radius = radius}},
                              .max_force = 100.0,
                              .grip_stiffness = 0.3,
                              .grip_damping = 0.5};
    BenchWorldOptions options = {.integrator = INTEGRATOR_LEAPFROG,
                                 .precision = PRECISION_SINGLE,
                                 .rate_hz = 1000.0,
                                 .held_below = true,
                                 .tool = &tool};
    bool whole = generate_ico_sphere(&mesh, subdivisions, RADIUS, &status) &&
                 bench_world_create(&world, &mesh, &options, &status);
    if (whole) {
        options.tool = NULL;
        options.time_step = world.body->h;
        whole = bench_world_create(&free_world, &mesh, &options, &status);
    }
    GraspEvent event = {0};
    if (!whole) {
        bench_fail(bench, name, status.text);
    } else {
        ToolPose pose = {.position = {0.0, 0.0, RADIUS},
                         .orientation = {1.0, 0.0, 0.0, 0.0},
                         .active = true,
                         .grip = 1.0};
        sim_set_lockstep(world.sim, true); // the pose stays without being sent again
        sim_apply_pose(world.sim, 0, &pose, true);
        sim_step(world.sim);
        pose.position.z += 0.010;
        sim_apply_pose(world.sim, 0, &pose, true);
        time_ticks(world.sim, bench->quick ? 50 : 500);
        Samples held = {0}, free_ticks = {0};
        for (int r = 0; r < (bench->quick ? 3 : 25); r++) {
            samples_add(&held, time_ticks(world.sim, 20));
            samples_add(&free_ticks, time_ticks(free_world.sim, 20));
        }
        if (!sim_next_grasp(world.sim, &event) || event.nodes == 0)
            bench_fail(bench, name, "the jaws hold nothing");
        double us = samples_min(&held), us_free = samples_min(&free_ticks);
        bench_row(bench, name, event.nodes, "us_per_tick", us, "us");
        bench_row(bench, name, event.nodes, "us_per_tick_without_tool", us_free, "us");
        bench_row(bench, name, event.nodes, "us_grasp", us - us_free, "us");
        bench_row(bench, name, event.nodes, "ns_per_held_node",
                  1e3 * (us - us_free) / (event.nodes * world.body->substeps), "ns");
    }
    bench_world_destroy(&world);
    bench_world_destroy(&free_world);
    mesh_destroy(&mesh);
}

#ifdef PLIANT_WITH_VOXEL
// A cube of 32 cells along each edge, held below; `pressed` differs from its twin by the pose
// alone.
static bool make_cube(World *world, Scene *scene, double radius, Status *status)
{
    char text[1024], path[64];
    snprintf(text, sizeof text,
             "bodies = ( { name = \"cube\";  model = \"voxel\";  levels = 2;\n"
             "    voxels = { generator = \"box\";  count = 32;  size = 0.003125; };\n"
             "    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0499]); } ); } );\n"
             "tools = ( { id = 1;  kind = \"probe\";  max_force = 100.0;\n"
             "    capsules = ( { radius = %g; } ); } );\n",
             radius);
    const BuildOptions options = {.isa = "auto"};
    if (!daemon_write_scene(text, path, sizeof path))
        return status_fail(status, STATUS_FAILED, "cannot write a scene");
    bool whole = scene_read(path, scene, status) && world_build(world, scene, &options, status);
    unlink(path);
    return whole;
}

static void run_voxels(Bench *bench, const char *name, double radius)
{
    World world[2] = {{.sim = NULL}, {.sim = NULL}};
    Scene scene[2] = {{0}, {0}};
    Status status = {0};
    if (!make_cube(&world[0], &scene[0], radius, &status) ||
        !make_cube(&world[1], &scene[1], radius, &status)) {
        bench_fail(bench, name, status.text);
    } else {
        ToolPose pose = {.position = {0.0, 0.0, 0.05 + radius - 0.010},
                         .orientation = {1.0, 0.0, 0.0, 0.0},
                         .active = true};
        sim_set_lockstep(world[0].sim, true); // the pose stays without being sent again
        sim_apply_pose(world[0].sim, 0, &pose, true);
        for (int k = 0; k < 2; k++)
            time_ticks(world[k].sim, bench->quick ? 20 : 200);
        Samples pressed = {0}, free_ticks = {0};
        for (int r = 0; r < (bench->quick ? 2 : 25); r++) {
            samples_add(&pressed, time_ticks(world[0].sim, 10));
            samples_add(&free_ticks, time_ticks(world[1].sim, 10));
        }
        if (!sim_wrench(world[0].sim, 0)->contact)
            bench_fail(bench, name, "the tool does not touch the body");
        const int nodes = sim_body(world[0].sim, 0)->surface.node_count;
        double us = samples_min(&pressed), us_free = samples_min(&free_ticks);
        bench_row(bench, name, nodes, "us_per_tick", us, "us");
        bench_row(bench, name, nodes, "us_per_tick_without_tool", us_free, "us");
        bench_row(bench, name, nodes, "us_contact", us - us_free, "us");
    }
    for (int k = 0; k < 2; k++) {
        world_destroy(&world[k]);
        scene_destroy(&scene[k]);
    }
}
#endif

void bench_contacts(Bench *bench)
{
#ifdef PLIANT_WITH_VOXEL
    if (bench_wants(bench, "contact.voxel.5mm"))
        run_voxels(bench, "contact.voxel.5mm", 0.005);
    if (bench_wants(bench, "contact.voxel.20mm"))
        run_voxels(bench, "contact.voxel.20mm", 0.02);
#endif
    if (bench_wants(bench, "grasp.small"))
        run_grasp(bench, "grasp.small", 0.03, 4);
    if (bench_wants(bench, "grasp.large"))
        run_grasp(bench, "grasp.large", 0.1, 4);
    static const ToolOptions sphere = {.id = 1,
                                       .kind = TOOL_PROBE,
                                       .capsule_count = 1,
                                       .capsule = {{.radius = 0.02}},
                                       .max_force = 100.0};
    static const ToolOptions capsule = {
        .id = 1,
        .kind = TOOL_PROBE,
        .capsule_count = 1,
        .capsule = {{.from = {-0.1, 0.0, 0.0}, .to = {0.1, 0.0, 0.0}, .radius = 0.01}},
        .max_force = 100.0};
    for (int subdivisions = 3; subdivisions <= (bench->quick ? 3 : 4); subdivisions++) {
        if (bench_wants(bench, "contact.sphere"))
            run_case(bench, "contact.sphere", &sphere, subdivisions);
        if (bench_wants(bench, "contact.capsule"))
            run_case(bench, "contact.capsule", &capsule, subdivisions);
    }
}
