// SPDX-License-Identifier: MIT
// The plane body in a scene: what it keeps, what it refuses, and that it stays in its plane.
#include "test.h"
#include "sim_steps.h"
#include "plane_world.h"
#include "random.h"

static void disturb(PlaneWorld *world, double length, double speed)
{
    uint64_t seed = 4;
    for (int i = 0; i < world->model->vertices.count; i++) {
        Vec3 x, v;
        plane_world_read(world, i, &x, &v);
        x.x += random_between(&seed, -length, length);
        x.y += random_between(&seed, -length, length);
        v.x += random_between(&seed, -speed, speed);
        v.y += random_between(&seed, -speed, speed);
        plane_world_write(world, i, x, v);
    }
}

static void expect_in_plane(const PlaneWorld *world)
{
    assert_true(
        world->body->ops->check(world->model)); // z and its velocity are 0, the frame upright
}

TEST(masses_add_up_and_balance)
{
    for (int law = 0; law < 2; law++) {
        PlaneWorldOptions options = plane_world_disc(16);
        options.body.law = law == 0 ? PLANE_AFFINE : PLANE_MIYAZAKI2004;
        SCOPED(plane_world_destroy) PlaneWorld world;
        plane_world_create(&world, &options);
        double mass = 0.0;
        Vec3 moment = {0, 0, 0};
        for (int i = 0; i < world.model->vertices.count; i++) {
            Vec3 x, v;
            plane_world_read(&world, i, &x, &v);
            mass += world.model->vertices.mass[i];
            moment = vec3_madd(moment, world.model->vertices.mass[i], x);
        }
        const double expected = 1000.0 * 812 * pow(0.002, 3);
        expect_near(mass / expected, 1.0, 1e-13); // sums of 172 elements
        expect_near(world.body->mass / expected, 1.0, 1e-13);
        expect_near(vec3_length(moment) / (expected * 0.032), 0.0, 1e-14); // centre of the disc
    }
}

TEST(free_sheet_keeps_its_momentum)
{
    for (int law = 0; law < 2; law++)
        for (int precision = 0; precision < PRECISION_COUNT; precision++) {
            PlaneWorldOptions options = plane_world_disc(16);
            options.body.law = law == 0 ? PLANE_AFFINE : PLANE_MIYAZAKI2004;
            options.body.body.precision = (Precision)precision;
            SCOPED(plane_world_destroy) PlaneWorld world;
            plane_world_create(&world, &options);
            disturb(&world, 0.001, 0.3);
            BodyMeasure before = measure_of(world.body);
            Vec3 p[2], l[2];
            plane_world_momentum(&world, &p[0], &l[0]);
            plane_world_run(&world, 1.0);
            plane_world_momentum(&world, &p[1], &l[1]);
            const double scale = world.body->mass * 0.3;
            // Steps of rounding: a thousand ticks of a few substeps each, added at random.
            const double rounding = precision == PRECISION_SINGLE ? 1e-5 : 1e-13;
            expect_near(vec3_length(vec3_sub(p[1], p[0])) / scale, 0.0, rounding);
            expect_near(vec3_length(vec3_sub(l[1], l[0])) / (scale * 0.032), 0.0, 10.0 * rounding);
            // Damping, by the speed of strain, leaves but the slow modes and the rigid motion.
            BodyMeasure after = measure_of(world.body);
            expect_at_most(after.elastic + after.kinetic, 0.02 * (before.elastic + before.kinetic));
            expect_in_plane(&world);
        }
}

// A sheet that spins and flies: in its base frame it hardly moves.
TEST(single_precision_follows_double_far_away)
{
    PlaneWorld world[2];
    for (int k = 0; k < 2; k++) {
        PlaneWorldOptions options = plane_world_disc(12);
        options.lattice.origin = vec3_add(options.lattice.origin, vec3(30.0, -20.0, 5.0));
        options.lattice.turn = quat_from_rotation(vec3(0.0, 0.0, 0.7));
        options.body.body.precision = k == 0 ? PRECISION_DOUBLE : PRECISION_SINGLE;
        plane_world_create(&world[k], &options);
        Vec3 center = world[k].model->vertices.rows.rest_origin;
        for (int i = 0; i < world[k].model->vertices.count; i++) {
            Vec3 x, v;
            plane_world_read(&world[k], i, &x, &v);
            Vec3 r = vec3_sub(x, center);
            v = vec3(1.0 - 20.0 * r.y, 2.0 + 20.0 * r.x, 0.0);
            plane_world_write(&world[k], i, x, v);
        }
        plane_world_run(&world[k], 1.0); // 20 rad
        expect_in_plane(&world[k]);
    }
    for (int i = 0; i < world[0].model->vertices.count; i++) {
        Vec3 x[2], v[2];
        for (int k = 0; k < 2; k++)
            plane_world_read(&world[k], i, &x[k], &v[k]);
        expect_near(x[0].z, 5.0, 1e-15);
        // A hundred thousandth of a radius after 20 rad and 2 m: 1e-7 a move of the frame.
        expect_near(vec3_length(vec3_sub(x[0], x[1])), 0.0, 5e-6);
    }
    plane_world_destroy(&world[0]);
    plane_world_destroy(&world[1]);
}

TEST(turned_sheet_moves_alike)
{
    PlaneWorld world[2];
    const Quat turn = quat_from_rotation(vec3(0.0, 0.0, 1.1));
    const Vec3 gravity = vec3(3.0, -4.0, 0.0);
    for (int k = 0; k < 2; k++) {
        PlaneWorldOptions options = plane_world_disc(12);
        FixedRegion held = {.kind = FIXED_SPHERE, .center = vec3(0.02, 0.01, 0.0), .radius = 0.006};
        options.body.body.gravity = gravity;
        if (k == 1) {
            options.lattice.origin = quat_rotate(turn, options.lattice.origin);
            options.lattice.turn = turn;
            options.body.body.gravity = quat_rotate(turn, gravity);
            held.center = quat_rotate(turn, held.center);
        }
        fix_within(&options.body.body, &held);
        plane_world_create(&world[k], &options);
        plane_world_run(&world[k], 0.3);
    }
    for (int i = 0; i < world[0].model->vertices.count; i++) {
        Vec3 x[2], v[2];
        for (int k = 0; k < 2; k++)
            plane_world_read(&world[k], i, &x[k], &v[k]);
        // Stable motion: rounding does not grow.
        expect_near(vec3_length(vec3_sub(x[1], quat_rotate(turn, x[0]))), 0.0, 1e-12);
    }
    expect_at_least(measure_of(world[0].body).max_displacement, 0.002);
    plane_world_destroy(&world[0]);
    plane_world_destroy(&world[1]);
}

static double energy_after(int levels, double ratio, double step, bool *reset)
{
    PlaneWorldOptions options = plane_world_disc(8);
    options.material.poisson_ratio = ratio;
    options.body.body.levels = levels;
    options.body.damping = 0.0;
    // In plane stress 2 (mu + lambda) = E / (1 - nu).
    const double dt0 = 0.002 * sqrt(1000.0 * (1.0 - ratio) / 1e4);
    options.body.body.time_step = step * dt0;
    options.body.body.unsafe_time_step = true;
    options.rate_hz = 1.0 / options.body.body.time_step;
    SCOPED(plane_world_destroy) PlaneWorld world;
    plane_world_create(&world, &options);
    expect_near(2.0 / sqrt(world.body->lambda) / dt0, 1.0, 1e-7); // differences, as told there
    disturb(&world, 1e-7, 0.0);
    double before = measure_of(world.body).elastic;
    sim_ticks(world.sim, 4000);
    BodyMeasure after = measure_of(world.body);
    *reset = sim_resets(world.sim) > 0;
    return (after.elastic + after.kinetic) / before;
}

// dt0 = h sqrt(rho (1 - nu) / E): with nu = 0 all strains of a cell are alike, so that the pattern
// of cells stretched and pressed by turns has the full frequency: 2 % more blows up.
TEST(stability_bound_is_sharp)
{
    bool reset;
    // So near the bound kinetic and elastic energy do not sum up to a constant: 1 / (1 - 0.98^2).
    expect_at_most(energy_after(0, 0.0, 0.98, &reset), 30.0);
    assert_false(reset);
    expect_at_most(energy_after(2, 0.3, 0.98, &reset), 30.0);
    assert_false(reset);
    double energy = energy_after(0, 0.0, 1.02, &reset);
    assert_true(reset || energy > 1e6);
}

// Flat, mirrored and blown into a dot: with damping all come back.
TEST(sheet_recovers_from_inversion)
{
    for (int k = 0; k < 3; k++)
        for (int law = 0; law < 2; law++) {
            PlaneWorldOptions options = plane_world_disc(8);
            options.body.law = law == 0 ? PLANE_AFFINE : PLANE_MIYAZAKI2004;
            SCOPED(plane_world_destroy) PlaneWorld world;
            plane_world_create(&world, &options);
            uint64_t seed = 9;
            for (int i = 0; i < world.model->vertices.count; i++) {
                Vec3 x, v;
                plane_world_read(&world, i, &x, &v);
                double noise = random_between(&seed, -1e-5, 1e-5);
                if (k == 0)
                    x.y = noise;
                else if (k == 1)
                    x.y = -x.y + noise;
                else
                    x = vec3(noise, random_between(&seed, -1e-5, 1e-5), 0.0);
                plane_world_write(&world, i, x, vec3(0, 0, 0));
            }
            double before = measure_of(world.body).elastic;
            plane_world_run(&world, 4.0);
            expect_at_most(measure_of(world.body).elastic, 1e-4 * before);
            assert_int_equal(sim_resets(world.sim), 0);
            expect_in_plane(&world);
        }
}

// `half`: of the tool's length along z; 0: a ball.
static void make_pressed(PlaneWorld *world, PlaneLaw law, Precision precision, double half)
{
    static const FixedRegion held = {
        .kind = FIXED_BOX, .low = {-1, -1, -1}, .high = {1, -0.028, 1}};
    PlaneWorldOptions options = plane_world_disc(16);
    options.body.law = law;
    options.body.body.precision = precision;
    fix_within(&options.body.body, &held);
    options.body.body.friction = 0.3;
    options.tool[options.tool_count++] =
        (ToolOptions){.id = 1,
                      .kind = TOOL_PROBE,
                      .capsule_count = 1,
                      .capsule = {{{0, 0, -half}, {0, 0, half}, 0.01}},
                      .max_force = 3.3};
    plane_world_create(world, &options);
}

// A ball comes from above along -y, 8 mm deep, and leaves.
static Vec3 press(PlaneWorld *world)
{
    Vec3 force = {0, 0, 0};
    for (int i = 0; i <= 160; i++) {
        plane_world_place(world, 0, vec3(0.0, 0.042 - 0.008 * i / 160, 0.0));
        sim_step(world->sim);
    }
    plane_world_run(world, 0.5);
    force = sim_wrench(world->sim, 0)->force;
    return force;
}

TEST(tool_presses_the_sheet_by_its_section)
{
    double single = 0.0;
    for (int precision = PRECISION_COUNT - 1; precision >= 0; precision--)
        for (int law = 0; law < 2; law++) {
            SCOPED(plane_world_destroy) PlaneWorld world;
            make_pressed(&world, law == 0 ? PLANE_AFFINE : PLANE_MIYAZAKI2004, (Precision)precision,
                         0.0);
            Vec3 force = press(&world);
            // An 8 mm dent of a disc of 64 mm, 2 mm thick: E t times the strain 1/8 would be 2.5
            // N/m on some 10 mm.
            expect_at_least(force.y, 0.005);
            expect_at_most(force.y, 0.2);
            expect_at_most(fabs(force.x), 0.02 * force.y); // symmetric
            expect_at_most(fabs(force.z), 1e-6 * force.y); // halves of the strip pull alike
            assert_true(sim_wrench(world.sim, 0)->contact);
            expect_in_plane(&world);
            if (law == 0 && precision == PRECISION_SINGLE)
                single = force.y;
            else if (law == 0)
                expect_near(single / force.y, 1.0,
                            1e-4); // rounding of 1e-7, near a fold of contact
            // Released it swings, slowly damped, but never higher.
            BodyMeasure held = measure_of(world.body);
            plane_world_place(&world, 0, vec3(0.0, 0.1, 0.0));
            plane_world_run(&world, 1.0);
            BodyMeasure free = measure_of(world.body);
            assert_false(sim_wrench(world.sim, 0)->contact);
            expect_at_most(free.elastic + free.kinetic, held.elastic + held.kinetic);
            assert_int_equal(sim_resets(world.sim), 0);
        }
}

// The section that a ball has with z = 0 pushes: a smaller one the higher the ball, and none above.
TEST(a_disc_meets_the_section_of_a_ball)
{
    static const FixedRegion below = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, -0.04, 1.0}};
    static const double heights[] = {0.0, 0.004, 0.02};
    double force[3];
    for (int k = 0; k < 3; k++) {
        PlaneWorldOptions options = plane_world_disc(16);
        options.lattice.size = 0.003125;
        options.lattice.origin = vec3(-0.05, -0.05, -0.5 * options.lattice.size);
        options.body.body.levels = 2;
        options.body.body.friction = 0.2;
        fix_within(&options.body.body, &below);
        options.tool[options.tool_count++] = (ToolOptions){PROBE(0.008, 50.0)};
        SCOPED(plane_world_destroy) PlaneWorld world;
        plane_world_create(&world, &options);
        enum { TICKS = 130 }; // 13 mm at 0.1 m/s
        for (int i = 1; i <= TICKS; i++) {
            plane_world_place(&world, 0, vec3(0.0, 0.065 - 0.013 * i / TICKS, heights[k]));
            sim_step(world.sim);
        }
        const ToolWrench *wrench = sim_wrench(world.sim, 0);
        force[k] = wrench->force.y;
        print_message("disc, ball %g mm off the plane: %.3g N, across %.2g N\n", heights[k] * 1e3,
                      force[k], wrench->force.z);
        expect_near(wrench->force.x, 0.0, 0.1 * force[0]);
        assert_int_equal(world.body->resets, 0);
        assert_int_equal(sim_refused_faces(world.sim), 0);
    }
    expect_at_least(force[0], 1e-5);
    expect_at_most(force[1], force[0]);
    expect_near(force[2], 0.0, 0.0);
}

// Tools of the same section push alike: a ball, a stick that ends at the strip's edges, one that
// ends inside it and a long one.
TEST(upright_stick_pushes_as_a_ball_of_its_section)
{
    static const double half[4] = {0.0, 0.001, 0.0005, 0.05};
    Vec3 force[4];
    for (int k = 0; k < 4; k++) {
        SCOPED(plane_world_destroy) PlaneWorld world;
        make_pressed(&world, PLANE_AFFINE, PRECISION_DOUBLE, half[k]);
        force[k] = press(&world);
    }
    // The soft minimum of a capsule's pairs lies up to 1.6 % of the radius nearer, of 8 mm.
    for (int k = 1; k < 4; k++)
        expect_near(force[k].y / force[0].y, 1.0, 0.04);
}

TEST(pressed_free_sheet_takes_what_the_tool_gives)
{
    PlaneWorldOptions options = plane_world_disc(12);
    options.tool[options.tool_count++] = (ToolOptions){PROBE(0.008, 3.3)};
    SCOPED(plane_world_destroy) PlaneWorld world;
    plane_world_create(&world, &options);
    Vec3 p, l, impulse = {0, 0, 0};
    double pushed = 0.0;
    for (int i = 0; i < 400; i++) {
        plane_world_place(&world, 0, vec3(0.003, 0.034 - 5e-5 * i, 0.0));
        sim_step(world.sim);
        const ToolWrench *wrench = sim_wrench(world.sim, 0);
        impulse = vec3_madd(impulse, 1e-3, wrench->force);
        pushed = fmax(pushed, vec3_length(wrench->force));
    }
    plane_world_momentum(&world, &p, &l);
    expect_at_least(pushed, 1e-3);
    // x and y as given. The body does not take the little along z: the two triangles of an edge's
    // strip do not mirror each other, and where the ball meets one of them inside, it meets the
    // other along their diagonal.
    expect_near(p.x + impulse.x, 0.0, 1e-13 * world.body->mass);
    expect_near(p.y + impulse.y, 0.0, 1e-13 * world.body->mass);
    expect_at_most(fabs(impulse.z), 0.02 * vec3_length(impulse));
}

TEST(restored_run_matches_uninterrupted_run)
{
    PlaneWorld world[2];
    for (int k = 0; k < 2; k++) {
        make_pressed(&world[k], PLANE_AFFINE, PRECISION_SINGLE, 0.0);
        LoadOptions load = {.body = 0,
                            .center = vec3(0.03, 0.0, 0.0),
                            .radius = 0.01,
                            .force = vec3(0.05, 0.0, 1.0),
                            .duration = 2.0};
        if (k == 0) {
            apply_well(sim_apply_load, world[k].sim, &load);
            press(&world[k]);
        }
    }
    size_t bytes = state_bytes(&world[0].state);
    assert_int_equal(bytes, state_bytes(&world[1].state));
    FREED unsigned char *block = calloc(1, bytes);
    state_copy_out(&world[0].state, block);
    resume(&world[1].state, world[1].sim, block);
    assert_true(world[1].body->ops->check(world[1].model));
    for (int k = 0; k < 2; k++)
        plane_world_run(&world[k], 0.2);
    assert_true(state_hash(&world[0].state) == state_hash(&world[1].state));
    plane_world_destroy(&world[0]);
    plane_world_destroy(&world[1]);
}

TEST(initial_state_goes_by_ascending_id)
{
    PlaneWorldOptions options = plane_world_disc(8);
    options.body.lattice = &options.lattice;
    options.body.material = &options.material;
    SCOPED(arena_destroy) Arena arena = {0};
    SCOPED(state_destroy) StateList list = {0};
    Status status = {0};
    Body rest, moved;
    // Two cells that touch in a corner: the ids of a point's second vertex come last.
    lattice_destroy(&options.lattice);
    assert_true(lattice_box(&options.lattice, (const int[]){2, 2, 1}, 0.002, &status));
    options.lattice.label[1] = options.lattice.label[2] = 0;
    assert_true(plane_create(&rest, &options.body, &arena, &list, &status));
    enum { COUNT = 8 };
    assert_int_equal(rest.mesh.node_count, COUNT);
    Vec3 x[COUNT], v[COUNT], sorted[COUNT], speed[COUNT];
    rest.ops->read_state(rest.model, NULL, x, v);
    for (int i = 0; i < COUNT; i++) {
        int rank = 0;
        for (int k = 0; k < COUNT; k++)
            rank += rest.mesh.id[k] < rest.mesh.id[i];
        sorted[rank] = vec3(x[i].x + 1e-4 * rest.mesh.id[i], x[i].y, x[i].z);
        speed[rank] = vec3(0.0, rest.mesh.id[i], 5.0);
    }
    options.body.body.name = "moved";
    options.body.body.initial_count = COUNT;
    options.body.body.initial_position = sorted;
    options.body.body.initial_velocity = speed;
    assert_true(plane_create(&moved, &options.body, &arena, &list, &status));
    assert_int_equal(moved.ops->read_state(moved.model, NULL, sorted, speed), COUNT);
    for (int i = 0; i < COUNT; i++) {
        expect_near(sorted[i].x, x[i].x + 1e-4 * rest.mesh.id[i], 1e-17);
        assert_true(speed[i].y == rest.mesh.id[i]);
        assert_true(speed[i].z == 0.0); // it cannot leave its plane
    }
    lattice_destroy(&options.lattice);
}

TEST(gravity_along_z_moves_nothing)
{
    PlaneWorldOptions options = plane_world_disc(8);
    options.body.body.gravity = vec3(0.0, 0.0, -9.81);
    SCOPED(plane_world_destroy) PlaneWorld world;
    plane_world_create(&world, &options);
    plane_world_run(&world, 0.1);
    assert_true(measure_of(world.body).max_displacement == 0.0);
    apply_well(sim_apply_set, world.sim, "gravity_x", 2.0);
    plane_world_run(&world, 0.1);
    Vec3 p, l;
    plane_world_momentum(&world, &p, &l);
    expect_near(p.x / (0.2 * world.body->mass), 1.0, 1e-12); // g t, sums of 100 ticks
    sim_reset(world.sim);
    assert_true(measure_of(world.body).max_displacement == 0.0);
}

TEST(what_is_no_plane_is_refused)
{
    for (int k = 0; k < 5; k++) {
        PlaneWorldOptions options = plane_world_disc(8);
        const int nowhere = 0; // the corner of the disc's box
        const FixedRegion region = {.kind = FIXED_NODES, .node = &nowhere, .node_count = 1};
        const int count[3] = {4, 4, 2};
        const char *word = "layer";
        Status status = {0};
        Body body;
        SCOPED(arena_destroy) Arena arena = {0};
        SCOPED(state_destroy) StateList list = {0};
        if (k == 0) {
            lattice_destroy(&options.lattice);
            assert_true(lattice_box(&options.lattice, count, 0.002, &status));
        } else if (k == 1) {
            options.lattice.turn = quat_from_rotation(vec3(0.1, 0.0, 0.0));
            word = "tilted";
        } else if (k == 2) {
            fix_within(&options.body.body, &region);
            word = "node 0";
        } else if (k == 3) {
            options.body.body.integrator = INTEGRATOR_RK4;
            word = "rk4";
        } else {
            Vec3 x = {0, 0, 0};
            options.body.body.initial_count = 1;
            options.body.body.initial_position = &x;
            word = "initial";
        }
        options.body.lattice = &options.lattice;
        options.body.material = &options.material;
        assert_false(plane_create(&body, &options.body, &arena, &list, &status));
        assert_int_equal(status.code, STATUS_INVALID);
        assert_non_null(strstr(status.text, word));
        lattice_destroy(&options.lattice);
    }
}
