// SPDX-License-Identifier: MIT
// The real body in a real scene, in double precision, moves as the same body put together from the
// readable element: shapes with levels and materials, laws, integrators, gravity, held vertices,
// loads, damping.
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "random.h"
#include "voxel_reference.h"
#include "voxel_world.h"

typedef struct Scene {
    VoxelWorldOptions options; // taken over
    bool held, loaded;
    double stir; // random velocities up to so many [m/s]
} Scene;

// Where the lowest vertices are; the world's axes are the lattice's.
static FixedRegion lowest(const Lattice *lattice)
{
    Vec3 low = vec3_madd(lattice->origin, -1.0, vec3(1.0, 1.0, 1.0));
    return (FixedRegion){.kind = FIXED_BOX,
                         .low = low,
                         .high = vec3(1.0, 1.0, lattice->origin.z + 0.5 * lattice->size)};
}

// The outer vertices inside share the force by the areas around them.
static void load_both(VoxelWorld *world, VoxelReference *reference)
{
    const Lattice *lattice = &world->lattice;
    LoadOptions load = {
        .center = lattice_point(lattice, 0.3 * lattice->count[0], 0.5 * lattice->count[1],
                                lattice->count[2]),
        .radius = 0.0287, // no vertex lies on the border
        .force = {0.05, 0.02, -0.1},
        .duration = 1.0,
    };
    apply_well(sim_apply_load, world->sim, &load);
    double sum = 0.0;
    for (int i = 0; i < reference->surface_count; i++)
        if (vec3_length(vec3_sub(reference->position[i], load.center)) <= load.radius)
            sum += world->body->surface.node_area[i];
    assert_true(sum > 0.0);
    for (int i = 0; i < reference->surface_count; i++)
        if (vec3_length(vec3_sub(reference->position[i], load.center)) <= load.radius)
            reference->load[i] = vec3_scale(world->body->surface.node_area[i] / sum, load.force);
}

static void expect_same_motion(const char *what, Scene *scene)
{
    SCOPED(voxel_world_destroy) VoxelWorld world;
    SCOPED(voxel_reference_destroy) VoxelReference reference;
    FixedRegion region = lowest(&scene->options.lattice);
    if (scene->held) {
        fix_within(&scene->options.body.body, &region);
    }
    voxel_world_create(&world, &scene->options);
    voxel_reference_create(&reference, &scene->options.body);
    assert_int_equal(world.count, reference.vertex_count);
    if (scene->loaded)
        load_both(&world, &reference);
    uint64_t random = 11;
    for (int i = 0; i < world.count; i++) {
        // Both begin where the real one says that it is.
        expect_near(vec3_length(vec3_sub(world.x[i], reference.rest[i])), 0.0, 1e-16);
        expect_near(world.mass[i] / reference.mass[i], 1.0, 1e-14); // sums of at most 8
        Vec3 spin = vec3_cross(vec3(2.0, -1.0, 3.0), world.x[i]);
        if (!reference.fixed[i])
            reference.velocity[i] = vec3_madd(spin, scene->stir, random_vec3(&random));
    }
    voxel_world_write(&world, reference.position, reference.velocity);

    const int ticks = EFFORT(150);
    for (int i = 0; i < ticks; i++) {
        sim_step(world.sim);
        voxel_reference_tick(&reference, world.body->substeps, world.body->h);
    }
    voxel_world_read(&world);
    double way = 0.0, place = 0.0, speed = 0.0, deformed = 0.0;
    for (int i = 0; i < world.count; i++) {
        place = fmax(place, vec3_length(vec3_sub(world.x[i], reference.position[i])));
        speed = fmax(speed, vec3_length(vec3_sub(world.v[i], reference.velocity[i])));
        way = fmax(way, vec3_length(vec3_sub(world.x[i], reference.rest[i])));
        double before = vec3_length(vec3_sub(reference.rest[i], reference.rest[0]));
        double after = vec3_length(vec3_sub(world.x[i], world.x[0]));
        deformed = fmax(deformed, fabs(after - before));
    }
    print_message("%s: %d ticks of %d steps, moved by %.2g m, deformed by %.2g m; apart by %.2g m, "
                  "%.2g m/s\n",
                  what, ticks, world.body->substeps, way, deformed, place, speed);
    // Rounding of 1e-17 m a step, which a stable motion does not enlarge, and of base frames.
    expect_near(place, 0.0, 1e-12);
    expect_near(speed, 0.0, 1e-10);  // times the highest frequency, 2 / dt0
    expect_at_least(deformed, 5e-5); // it was no rigid motion
    assert_int_equal(world.body->resets, 0);
}

static void run(const char *what, VoxelWorldOptions options, bool held, bool loaded, double stir,
                VoxelLaw law, IntegratorKind integrator)
{
    Scene scene = {options, held, loaded, stir};
    scene.options.body.law = law;
    scene.options.body.body.integrator = integrator;
    if (held || loaded)
        scene.options.body.body.gravity = vec3(1.0, 0.5, -9.81);
    expect_same_motion(what, &scene);
}

TEST(a_graded_cube_moves_as_the_reference)
{
    const IntegratorKind euler = INTEGRATOR_SYMPLECTIC_EULER, leapfrog = INTEGRATOR_LEAPFROG;
    run("cube, free", voxel_world_cube(8), false, false, 0.1, VOXEL_AFFINE, euler);
    run("cube, held", voxel_world_cube(8), true, true, 0.0, VOXEL_AFFINE, leapfrog);
    run("cube, held, 2004", voxel_world_cube(8), true, true, 0.0, VOXEL_MIYAZAKI2004, euler);
}

TEST(a_ball_moves_as_the_reference)
{
    const IntegratorKind euler = INTEGRATOR_SYMPLECTIC_EULER, leapfrog = INTEGRATOR_LEAPFROG;
    run("ball, free", voxel_world_ball(), false, true, 0.1, VOXEL_AFFINE, leapfrog);
    run("ball, free, 2004", voxel_world_ball(), false, false, 0.5, VOXEL_MIYAZAKI2004, leapfrog);
    run("ball, held", voxel_world_ball(), true, false, 0.1, VOXEL_AFFINE, euler);
}

TEST(a_corner_of_three_materials_moves_as_the_reference)
{
    const IntegratorKind euler = INTEGRATOR_SYMPLECTIC_EULER, leapfrog = INTEGRATOR_LEAPFROG;
    run("corner, free", voxel_world_corner(), false, true, 0.05, VOXEL_AFFINE, euler);
    run("corner, held", voxel_world_corner(), true, true, 0.05, VOXEL_AFFINE, leapfrog);
}

TEST(bodies_without_damping_move_as_the_reference)
{
    VoxelWorldOptions options = voxel_world_cube(8);
    options.body.damping = 0.0;
    run("cube, undamped", options, false, false, 0.05, VOXEL_AFFINE, INTEGRATOR_LEAPFROG);
    options = voxel_world_corner();
    options.body.damping = 0.0;
    run("corner, undamped", options, true, false, 0.02, VOXEL_AFFINE, INTEGRATOR_SYMPLECTIC_EULER);
}

TEST(a_turned_and_distant_body_moves_as_the_reference)
{
    VoxelWorldOptions options = voxel_world_cube(8);
    options.lattice.turn = quat_from_rotation(vec3(0.7, -0.3, 1.9));
    run("cube, turned", options, false, false, 0.1, VOXEL_AFFINE, INTEGRATOR_SYMPLECTIC_EULER);
}
