// SPDX-License-Identifier: MIT
// Single precision against double, after a second: also far from the origin, spinning, travelling
// and turned. What rounds is the displacement in a frame that moves along, not the place.
#include "test.h"
#include "sim_steps.h"
#include "voxel_world.h"

typedef struct Motion {
    VoxelWorldOptions (*shape)(void);
    Vec3 at; // [m]
    Quat turn;
    Vec3 speed, spin; // [m/s], [rad/s]
    double strain;    // of the start
    bool held;
    IntegratorKind integrator;
} Motion;

static VoxelWorldOptions cube(void)
{
    return voxel_world_cube(8);
}

static void create(VoxelWorld *world, const Motion *motion, Precision precision)
{
    VoxelWorldOptions options = motion->shape();
    lattice_place(&options.lattice, 1.0, quat_to_rotation(motion->turn), motion->at);
    options.body.body.precision = precision;
    options.body.body.integrator = motion->integrator;
    options.body.damping = 0.05; // so that it still swings at the end
    // Held: the middle of the face at the low end of the lattice's z.
    FixedRegion end = {
        .kind = FIXED_SPHERE,
        .center = vec3_madd(motion->at, -0.06, quat_rotate(motion->turn, vec3(0.0, 0.0, 1.0))),
        .radius = 0.03};
    if (motion->held) {
        fix_within(&options.body.body, &end);
        options.body.body.gravity = vec3(1.0, 2.0, -9.81);
    }
    voxel_world_create(world, &options);
    // Free: stretched along the lattice's z, thinner across, and in motion.
    Vec3 along = quat_rotate(motion->turn, vec3(0.0, 0.0, 1.0));
    for (int i = 0; i < world->count && !motion->held; i++) {
        Vec3 r = vec3_sub(world->x[i], motion->at);
        Vec3 axial = vec3_scale(vec3_dot(along, r), along);
        world->v[i] = vec3_add(motion->speed, vec3_cross(motion->spin, r));
        r = vec3_add(vec3_scale(1.0 - 0.5 * motion->strain, r),
                     vec3_scale(1.5 * motion->strain, axial));
        world->x[i] = vec3_add(motion->at, r);
    }
    voxel_world_write(world, world->x, world->v);
}

// Largest differences between the two: of distances within each, to some of its vertices, and of
// places in the world.
static void find_differences(const VoxelWorld *a, const VoxelWorld *b, double *shape, double *place)
{
    *shape = *place = 0.0;
    for (int i = 0; i < a->count; i++) {
        *place = fmax(*place, vec3_length(vec3_sub(a->x[i], b->x[i])));
        for (int k = 0; k < a->count; k += a->count / 7) {
            double one = vec3_length(vec3_sub(a->x[i], a->x[k]));
            double two = vec3_length(vec3_sub(b->x[i], b->x[k]));
            *shape = fmax(*shape, fabs(one - two));
        }
    }
}

// The bodies are 0.1 m wide.
static void expect_alike(const char *what, const Motion *motion)
{
    SCOPED(voxel_world_destroy) VoxelWorld exact, single;
    create(&exact, motion, PRECISION_DOUBLE);
    create(&single, motion, PRECISION_SINGLE);
    voxel_world_run(&exact, 1.0);
    voxel_world_run(&single, 1.0);
    voxel_world_read(&exact);
    voxel_world_read(&single);
    double shape, place;
    find_differences(&exact, &single, &shape, &place);
    BodyMeasure of_exact, of_single;
    of_exact = measure_of(exact.body);
    of_single = measure_of(single.body);
    const double way = of_exact.max_displacement;
    print_message("%s, %s: moved by %.3g m; shapes differ by %.2g m, places by %.2g m\n", what,
                  integrator_name(motion->integrator), way, shape, place);
    // A displacement of 0.1 m rounds by 4e-9 m; a thousand steps at random make 1e-7 of it. Less
    // than that stays within the shape of one that only travels, as its frame does so.
    expect_near(shape, 0.0, 2e-6);
    // A speed of 10 m/s rounds by 5e-7: in a second, relative to its way, by less than 1e-7 a step
    // at random.
    const double limit = way > 1.0 ? 1e-6 * way : 2e-6;
    expect_near(place, 0.0, limit);
    expect_near(of_single.max_displacement, way, limit);
    assert_int_equal(single.body->resets, 0);
}

static const Vec3 FAR = {600.0, -300.0, 100.0};
static const Quat TURNED = {0.7, 0.1, -0.5, 0.5}; // unit

TEST(held_bodies_swing_alike)
{
    for (int k = 0; k < 2; k++) {
        Motion motion = {.shape = cube,
                         .turn = QUAT_NONE,
                         .held = true,
                         .integrator = k == 0 ? INTEGRATOR_SYMPLECTIC_EULER : INTEGRATOR_LEAPFROG};
        expect_alike("held cube", &motion);
        motion.at = FAR, motion.turn = TURNED;
        expect_alike("held cube, turned, far away", &motion);
    }
}

TEST(free_bodies_swing_and_spin_alike)
{
    for (int k = 0; k < 2; k++) {
        Motion motion = {.shape = cube,
                         .turn = QUAT_NONE,
                         .strain = 0.1,
                         .integrator = k == 0 ? INTEGRATOR_SYMPLECTIC_EULER : INTEGRATOR_LEAPFROG};
        expect_alike("free cube", &motion);
        motion.spin = vec3(3.0, -4.0, 5.0);
        expect_alike("spinning cube", &motion);
        motion.turn = TURNED;
        expect_alike("spinning cube, turned", &motion);
    }
}

TEST(travellers_keep_their_accuracy_far_away)
{
    for (int k = 0; k < 2; k++) {
        Motion motion = {.shape = cube,
                         .at = FAR,
                         .turn = TURNED,
                         .speed = vec3(10.0, -4.0, 5.0),
                         .spin = vec3(3.0, -4.0, 5.0),
                         .strain = 0.1,
                         .integrator = k == 0 ? INTEGRATOR_SYMPLECTIC_EULER : INTEGRATOR_LEAPFROG};
        expect_alike("travelling cube", &motion);
        motion.shape = voxel_world_ball;
        expect_alike("travelling ball", &motion);
        motion.shape = voxel_world_corner;
        expect_alike("travelling corner of three materials", &motion);
    }
}
