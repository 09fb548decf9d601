// SPDX-License-Identifier: MIT
// Rows: what goes in comes out, whatever they hold, and a base frame that follows its body changes
// nothing in the world.
#include "test.h"
#include "random.h"

#include "base/memory.h"
#include "body/rows.h"

#include <float.h>

enum { COUNT = 40, PADDING = COUNT - 1 };
static const double SIZE = 0.1; // of the body [m]

typedef struct Kind {
    Precision precision;
    bool displaced, floating;
} Kind;

static const Kind KINDS[] = {
    {PRECISION_DOUBLE, false, false}, {PRECISION_DOUBLE, true, false},
    {PRECISION_DOUBLE, true, true},   {PRECISION_SINGLE, true, false},
    {PRECISION_SINGLE, true, true},
};
enum { KIND_COUNT = sizeof KINDS / sizeof *KINDS };

typedef struct Cloud {
    Rows rows;
    Arena arena;
    StateList state;
    BaseFrame frame;
    double rest[COUNT][3], weight[COUNT];
    int owner[COUNT];
    _Alignas(32) double row[COUNT * ROW]; // of floats, half of it
} Cloud;

// Points about an origin far off, the last row nobody's; in a base frame that has moved already if
// it can. At rest in that frame.
static void create_cloud(Cloud *c, Kind kind)
{
    *c = (Cloud){0};
    uint64_t random = 3;
    const Vec3 origin = vec3(20.0, -30.0, 10.0);
    c->frame = (BaseFrame){.origin = origin, .turn = {1.0, 0.0, 0.0, 0.0}};
    for (int i = 0; i < COUNT; i++) {
        Vec3 p = i == PADDING ? vec3(0.0, 0.0, 0.0) : vec3_scale(SIZE, random_vec3(&random));
        if (!kind.displaced && i != PADDING)
            p = vec3_add(p, origin);
        c->rest[i][0] = p.x, c->rest[i][1] = p.y, c->rest[i][2] = p.z;
        c->weight[i] = i == PADDING ? 0.0 : random_between(&random, 0.5, 2.0);
        c->owner[i] = i == PADDING ? -1 : i;
    }
    c->rows = (Rows){.precision = kind.precision,
                     .displaced = kind.displaced,
                     .floating = kind.floating,
                     .turned = kind.floating,
                     .rest_turn = QUAT_NONE,
                     .count = COUNT,
                     .owner = c->owner,
                     .rest = c->rest,
                     .longest_edge = 100.0 * SIZE};
    if (kind.displaced) {
        c->rows.rest_origin = origin;
        c->rows.frame = &c->frame;
    }
    c->rows.rigid =
        rigid_frame_create("cloud", kind.precision, kind.displaced, COUNT,
                           (const double(*)[3])c->rest, c->weight, &c->arena, &c->state);
    rows_return_to_rest(&c->rows, c->row);
    if (kind.floating) {
        c->frame.origin = vec3_add(origin, vec3(0.7, 0.2, -0.4));
        c->frame.turn = quat_from_rotation(vec3(0.3, -1.2, 2.0));
    }
}

static void destroy_cloud(Cloud *c)
{
    state_destroy(&c->state);
    arena_destroy(&c->arena);
}

// Where a node is at rest in the world, as the scene placed it.
static Vec3 rest_of(const Cloud *c, int i)
{
    return vec3_add(c->rows.rest_origin, vec3(c->rest[i][0], c->rest[i][1], c->rest[i][2]));
}

// Of one number of size `value` in a row; positions far from the origin cost double rounding too.
static double rounding(Precision precision, double value)
{
    return (precision == PRECISION_SINGLE ? (double)FLT_EPSILON : DBL_EPSILON) * value +
           64.0 * DBL_EPSILON * 40.0;
}

static void expect_same(Vec3 actual, Vec3 expected, double tolerance)
{
    expect_near(actual.x, expected.x, tolerance);
    expect_near(actual.y, expected.y, tolerance);
    expect_near(actual.z, expected.z, tolerance);
}

// ---------------------------------------------------------------------------------------------

TEST(what_is_written_is_read)
{
    for (int k = 0; k < KIND_COUNT; k++) {
        Cloud c;
        create_cloud(&c, KINDS[k]);
        uint64_t random = 7;
        const double most = 0.5 * SIZE;
        for (int i = 0; i < PADDING; i++) {
            Vec3 x, v = random_vec3(&random), read, speed, again;
            rows_read(&c.rows, c.row, i, &x, NULL);
            x = vec3_add(x, vec3_scale(most / 2.0, random_vec3(&random)));
            rows_write(&c.rows, c.row, i, x, v);
            rows_read(&c.rows, c.row, i, &read, &speed);
            expect_same(read, x, rounding(KINDS[k].precision, most));
            expect_same(speed, v, 2.0 * rounding(KINDS[k].precision, 1.0));
            rows_read(&c.rows, c.row, i, &again, NULL);
            assert_memory_equal(&again, &read, sizeof read);
        }
        destroy_cloud(&c);
    }
}

// x = origin + turn (rest + u), written out by another way: rotation by Rodrigues' formula.
TEST(displacements_are_in_the_coordinates_of_the_frame)
{
    for (int k = 0; k < KIND_COUNT; k++) {
        if (!KINDS[k].floating)
            continue;
        Cloud c;
        create_cloud(&c, KINDS[k]);
        const Vec3 u = vec3(0.25, -0.5, 0.125), v = vec3(2.0, 1.0, -4.0); // exact in a float
        const double row[ROW] = {u.x, u.y, u.z, 0.0, v.x, v.y, v.z, 0.0};
        for (int n = 0; n < ROW; n++)
            rows_put(&c.rows, c.row, 5 * ROW + n, row[n]);
        const Vec3 way = vec3(0.3, -1.2, 2.0); // of create_cloud
        const double angle = vec3_length(way);
        const Vec3 axis = vec3_scale(1.0 / angle, way);
        const Vec3 from[2] = {vec3_add(vec3(c.rest[5][0], c.rest[5][1], c.rest[5][2]), u), v};
        Vec3 to[2], x[2];
        for (int i = 0; i < 2; i++) {
            to[i] = vec3_scale(cos(angle), from[i]);
            to[i] = vec3_madd(to[i], sin(angle), vec3_cross(axis, from[i]));
            to[i] = vec3_madd(to[i], (1.0 - cos(angle)) * vec3_dot(axis, from[i]), axis);
        }
        rows_read(&c.rows, c.row, 5, &x[0], &x[1]);
        expect_same(x[0], vec3_add(c.frame.origin, to[0]), 1e-13); // 60 ulp of 30 m, and less
        expect_same(x[1], to[1], 1e-14);
        expect_same(rows_turn_in(&c.rows, to[1]), v, 1e-14);
        destroy_cloud(&c);
    }
}

TEST(snapshots_are_what_is_read_row_by_row)
{
    for (int k = 0; k < KIND_COUNT; k++) {
        Cloud c;
        create_cloud(&c, KINDS[k]);
        uint64_t random = 9;
        int slot[COUNT];
        for (int i = 0; i < COUNT; i++)
            slot[i] = (7 * i + 3) % COUNT; // any order; 7 and 40 have no factor in common
        for (int i = 0; i < PADDING; i++)
            rows_write(&c.rows, c.row, i,
                       vec3_add(c.frame.origin, vec3_scale(SIZE, random_vec3(&random))),
                       random_vec3(&random));
        for (int count = 0; count <= COUNT; count += count == 1 ? COUNT - 1 : 1) {
            // The number behind the last must stay.
            float position[3 * COUNT + 1], velocity[3 * COUNT + 1], alone[3 * COUNT + 1];
            position[3 * count] = velocity[3 * count] = alone[3 * count] = 77.0f;
            rows_snapshot(&c.rows, c.row, slot, count, position, velocity);
            rows_snapshot(&c.rows, c.row, slot, count, alone, NULL);
            assert_true(position[3 * count] == 77.0f && velocity[3 * count] == 77.0f &&
                        alone[3 * count] == 77.0f);
            assert_memory_equal(alone, position, 3 * (size_t)count * sizeof *alone);
            for (int i = 0; i < count; i++) {
                Vec3 x, v;
                rows_read(&c.rows, c.row, slot[i], &x, &v);
                const double read[6] = {x.x, x.y, x.z, v.x, v.y, v.z};
                for (int n = 0; n < 3; n++) { // to floats, rounded: 32 m and 2 m/s
                    expect_near((double)position[3 * i + n], read[n], 32.0 * 0x1p-24);
                    expect_near((double)velocity[3 * i + n], read[3 + n], 2.0 * 0x1p-24);
                }
            }
        }
        destroy_cloud(&c);
    }
}

// Carried off, turned and a little deformed: how large u may be after the frame has followed, and
// how much numbers that rows hold may be rounded.
static void follow(Kind kind, double deformation, double rest_u)
{
    Cloud c;
    create_cloud(&c, kind);
    uint64_t random = 21;
    const Quat turn = quat_from_rotation(vec3(1.0, 0.4, -0.6));
    Vec3 before[COUNT], speed[COUNT];
    for (int i = 0; i < COUNT; i++) {
        Vec3 x, arm;
        rows_read(&c.rows, c.row, i, &x, NULL);
        arm = vec3_sub(x, c.frame.origin);
        x = vec3_add(vec3_add(c.frame.origin, vec3(0.2, 0.1, -0.3)), quat_rotate(turn, arm));
        x = vec3_add(x, vec3_scale(deformation, random_vec3(&random)));
        rows_write(&c.rows, c.row, i, x, random_vec3(&random));
        rows_read(&c.rows, c.row, i, &before[i], &speed[i]);
    }
    double padding[ROW];
    for (int n = 0; n < ROW; n++)
        padding[n] = rows_get(&c.rows, c.row, PADDING * ROW + n);

    int ticks = 0;
    while (!rows_follow(&c.rows, c.row))
        assert_true(++ticks < 1000);
    for (int i = 0; i < PADDING; i++) {
        Vec3 x, v;
        rows_read(&c.rows, c.row, i, &x, &v);
        expect_same(x, before[i], rounding(kind.precision, rest_u));
        expect_same(v, speed[i], 2.0 * rounding(kind.precision, 1.0));
        for (int n = 0; n < 3; n++)
            expect_near(rows_get(&c.rows, c.row, i * ROW + n), 0.0, rest_u);
    }
    for (int n = 0; n < ROW; n++)
        assert_true(rows_get(&c.rows, c.row, PADDING * ROW + n) == padding[n]);
    destroy_cloud(&c);
}

TEST(a_frame_that_follows_leaves_the_body_where_it_is)
{
    for (int k = 0; k < KIND_COUNT; k++) {
        if (!KINDS[k].floating)
            continue;
        // u falls to the size of the deformation: that of a point, and as much again of the fit.
        follow(KINDS[k], 0.01 * SIZE, 3.0 * 0.01 * SIZE);
        // Of a rigid motion nothing is left but the rounding of u while it was large, under 1 m.
        follow(KINDS[k], 0.0, 4.0 * rounding(KINDS[k].precision, 1.0));
    }
}

TEST(a_frame_follows_now_and_then_and_early_when_it_lags)
{
    for (int k = 0; k < KIND_COUNT; k++) {
        if (!KINDS[k].floating)
            continue;
        for (int lags = 0; lags < 2; lags++) {
            Cloud c;
            create_cloud(&c, KINDS[k]);
            c.rows.longest_edge = lags ? SIZE : 100.0 * SIZE;
            rows_put(&c.rows, c.row, 0, 0.5 * SIZE); // of the first node
            int ticks = 1;
            for (; !rows_follow(&c.rows, c.row); ticks++)
                assert_true(ticks < 1000);
            assert_int_equal(ticks, lags ? 4 : 16); // as rows.c says
            assert_int_equal(c.frame.ticks, 0);
            destroy_cloud(&c);
        }
    }
}

// A tick of an integrator, by its own stages.
static void fall_through(Rows *rows, IntegratorKind kind, int substeps, double h, Vec3 gravity)
{
    const Integrator *integrator = integrator_get(kind);
    if (integrator->kicks)
        rows_drift(rows, integrator->first_drift * h);
    for (int k = 0; k < substeps; k++)
        for (int s = 0; s < integrator->evaluation_count; s++) {
            const Evaluation evaluation = integrator_evaluation(integrator, s, k == substeps - 1);
            rows_advance(rows, &evaluation, h, gravity);
        }
}

TEST(a_frame_falls_as_its_integrator_says)
{
    const Vec3 gravity = vec3(1.0, -2.0, 3.0), thrown = vec3(0.5, 0.25, -1.0);
    const int substeps = 7;
    const double h = 1e-3, time = substeps * h;
    for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++) {
        Cloud c;
        create_cloud(&c, (Kind){PRECISION_SINGLE, true, true});
        rows_let_fall(&c.rows, "cloud", &c.arena, &c.state);
        assert_true(vec3_length(rows_gravity(&c.rows, gravity)) == 0.0);
        c.rows.fall->velocity = thrown;
        Vec3 before, x, v, read_v;
        rows_read(&c.rows, c.row, 3, &before, NULL);
        const FrameFall start = *c.rows.fall;
        const BaseFrame frame = c.frame;

        // What a tick that is taken back leaves: nothing.
        fall_through(&c.rows, (IntegratorKind)kind, substeps, h, gravity);
        rows_end_tick(&c.rows, false);
        assert_memory_equal(c.rows.fall, &start, sizeof start);
        assert_memory_equal(&c.frame, &frame, sizeof frame);

        // Leapfrog and RK4 fall along the parabola, symplectic Euler half a substep ahead of it.
        fall_through(&c.rows, (IntegratorKind)kind, substeps, h, gravity);
        rows_read(&c.rows, c.row, 3, &x, &v);
        const double ahead = kind == INTEGRATOR_SYMPLECTIC_EULER ? h : 0.0;
        const Vec3 way = vec3_madd(vec3_scale(time, thrown), 0.5 * time * (time + ahead), gravity);
        expect_same(vec3_sub(x, before), way, 1e-13); // ulps of 30 m
        expect_same(v, vec3_madd(thrown, time, gravity), 1e-15);
        // The end of a tick moves nothing, nor does writing what was read.
        rows_end_tick(&c.rows, true);
        rows_write(&c.rows, c.row, 3, x, v);
        rows_read(&c.rows, c.row, 3, &before, &read_v);
        expect_same(before, x, rounding(PRECISION_SINGLE, SIZE));
        expect_same(read_v, v, 1e-15);
        destroy_cloud(&c);
    }
}

// What the rows have of a common velocity by other forces, the frame takes over: what is left in
// the rows is small, and what is read is the same.
TEST(a_frame_that_falls_takes_over_the_common_velocity)
{
    Cloud c;
    create_cloud(&c, (Kind){PRECISION_SINGLE, true, true});
    rows_let_fall(&c.rows, "cloud", &c.arena, &c.state);
    uint64_t random = 4;
    Vec3 before[COUNT], x;
    for (int i = 0; i < PADDING; i++) {
        rows_read(&c.rows, c.row, i, &x, NULL);
        rows_write(&c.rows, c.row, i, x,
                   vec3_madd(vec3(7.0, -3.0, 2.0), 1e-3, random_vec3(&random)));
        rows_read(&c.rows, c.row, i, &x, &before[i]);
    }
    while (!rows_follow(&c.rows, c.row))
        ;
    for (int i = 0; i < PADDING; i++) {
        Vec3 v;
        rows_read(&c.rows, c.row, i, &x, &v);
        // Of 7 m/s, in double precision; what the rows keep they keep to a float's last rest.
        expect_same(v, before[i], 1e-14 + rounding(PRECISION_SINGLE, 4e-3));
        expect_at_most(vec3_length(rows_vector(&c.rows, c.row, i, 4)), 4e-3);
    }
    rows_stop(&c.rows, c.row);
    rows_read(&c.rows, c.row, 3, &x, &before[0]);
    assert_true(vec3_length(before[0]) == 0.0);
    c.rows.fall->velocity.y = (double)NAN;
    assert_false(rows_are_valid(&c.rows, c.row, 100.0));
    destroy_cloud(&c);
}

TEST(rows_return_to_where_the_scene_placed_them)
{
    for (int k = 0; k < KIND_COUNT; k++) {
        Cloud c;
        create_cloud(&c, KINDS[k]);
        for (int i = 0; i < COUNT; i++)
            rows_write(&c.rows, c.row, i, vec3(i, 2.0, 3.0), vec3(4.0, 5.0, i));
        rows_return_to_rest(&c.rows, c.row);
        for (int i = 0; i < PADDING; i++) {
            Vec3 x, v;
            rows_read(&c.rows, c.row, i, &x, &v);
            expect_same(x, rest_of(&c, i), 0.0); // the same sum
            expect_same(v, vec3(0.0, 0.0, 0.0), 0.0);
        }
        destroy_cloud(&c);
    }
}

TEST(bad_numbers_are_found_wherever_they_are)
{
    for (int k = 0; k < KIND_COUNT; k++) {
        Cloud c;
        create_cloud(&c, KINDS[k]);
        assert_true(rows_are_valid(&c.rows, c.row, 100.0));
        const double bad[] = {(double)NAN, (double)INFINITY, -1e16};
        for (int at = 0; at < COUNT * ROW; at += 3) {
            double good = rows_get(&c.rows, c.row, at);
            for (int b = 0; b < 3; b++) {
                // Velocities in double precision may be larger.
                double value = b == 2 && KINDS[k].precision == PRECISION_DOUBLE ? -1e101 : bad[b];
                rows_put(&c.rows, c.row, at, value);
                assert_false(rows_are_valid(&c.rows, c.row, 100.0));
            }
            rows_put(&c.rows, c.row, at, good);
        }
        assert_true(rows_are_valid(&c.rows, c.row, 100.0));
        rows_put(&c.rows, c.row, 2, 101.0);
        assert_false(rows_are_valid(&c.rows, c.row, 100.0));
        rows_put(&c.rows, c.row, 2, 0.0);
        rows_put(&c.rows, c.row, 6, 101.0); // a velocity
        assert_true(rows_are_valid(&c.rows, c.row, 100.0));
        destroy_cloud(&c);
    }
}
