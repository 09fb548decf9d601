// SPDX-License-Identifier: MIT
// Where contact acts (server/sim/README.md, "Contact of faces"): on frozen sheets, so that
// nothing but geometry plays. Forces must be conservative and without jumps wherever a tool goes,
// found faces must be all the faces there are, and a free border must have no side.
#include "test.h"
#include "contact_bench.h"
#include "random.h"

#include "geometry/distance.h"

static const double PI = 3.14159265358979323846;
static const double KAPPA = 1e6; // stiffness per area of the sheets [N/m3]
static const double DEEP = 1e-3; // [m]

static void make_sheet(Bench *bench, double edge, int cells, ToolOptions tool)
{
    BenchOptions options = bench_with_tool(bench_sheet(edge, cells), tool);
    options.fixing = BENCH_FROZEN;
    options.contact_damping = options.friction = 0.0; // only what has an energy
    bench_create(bench, &options);
    bench->body->contact_kappa = KAPPA;
}

// The next place may be anywhere: the proxy does not have to walk there.
static void lift(Bench *bench)
{
    bench_withdraw(bench, 0);
    sim_step(bench->sim);
}

// Half k d^2 of one face pressed as deep as the tests press.
static double press_energy(double edge)
{
    return 0.5 * KAPPA * sqrt(0.1875) * edge * edge * DEEP * DEEP;
}

// ---------------------------------------------------------------------------------------------

// Circles with a depth that changes on the way, started anywhere on the sheet.
static Vec3 on_loop(Vec3 center, double way, double radius, double z)
{
    double phase = 2.0 * PI * way;
    return vec3(center.x + 0.008 * cos(phase), center.y + 0.008 * sin(phase),
                z + radius - DEEP * (0.5 + 0.5 * sin(2.0 * phase + center.x * 1e3)));
}

TEST(closed_loops_cost_no_work)
{
    static const double edges[] = {0.004, 0.008, 0.016};
    enum { STEPS = 4000 };
    uint64_t random = 21;
    for (int e = 0; e < 3; e++) {
        SCOPED(bench_destroy) Bench bench;
        make_sheet(&bench, edges[e], (int)(0.06 / edges[e]) + 2, bench_ball(0.005));
        for (int loop = 0; loop < 6; loop++) {
            Vec3 center = vec3_scale(0.01, random_vec3(&random));
            lift(&bench);
            Vec3 last = on_loop(center, 0.0, 0.005, 0.0), force = bench_touch(&bench, 0, last);
            double work = 0.0;
            for (int i = 1; i <= STEPS; i++) {
                Vec3 next = on_loop(center, (double)i / STEPS, 0.005, 0.0);
                Vec3 then = bench_touch(&bench, 0, next);
                work += 0.5 * vec3_dot(vec3_add(force, then), vec3_sub(next, last));
                last = next;
                force = then;
            }
            // The trapezoid rule leaves 0.01..0.1 % at this step.
            expect_near(work / press_energy(edges[e]), 0.0, 2e-3);
        }
    }
}

TEST(closed_loops_of_a_tilting_capsule_cost_no_work)
{
    enum { STEPS = 4000 };
    SCOPED(bench_destroy) Bench bench;
    make_sheet(&bench, 0.008, 10, bench_capsule(0.04, 0.005));
    for (int loop = 0; loop < 4; loop++) {
        Vec3 last_place = {0, 0, 0}, last_force = {0, 0, 0}, last_torque = {0, 0, 0};
        Quat last_turn = {1, 0, 0, 0};
        double work = 0.0;
        lift(&bench);
        for (int i = 0; i <= STEPS; i++) {
            double phase = 2.0 * PI * i / STEPS;
            Vec3 place = vec3(0.003 * cos(phase + loop), 0.004 * sin(2.0 * phase),
                              0.005 - DEEP * (0.6 + 0.4 * sin(phase)));
            Quat turn = quat_multiply(
                quat_from_rotation(vec3(0.0, 0.03 * sin(phase), 0.0)),
                quat_from_rotation(vec3(0.0, 0.0, 0.7 * loop + 0.1 * cos(3.0 * phase))));
            bench_place(&bench, 0, place, turn);
            sim_step(bench.sim);
            const ToolWrench *wrench = sim_wrench(bench.sim, 0);
            if (i > 0) {
                Vec3 move = vec3_sub(place, last_place);
                Vec3 spin = quat_to_rotation(quat_multiply(turn, quat_conjugate(last_turn)));
                work += 0.5 * vec3_dot(vec3_add(last_force, wrench->force), move) +
                        0.5 * vec3_dot(vec3_add(last_torque, wrench->torque), spin);
            }
            last_place = place;
            last_turn = turn;
            last_force = wrench->force;
            last_torque = wrench->torque;
        }
        expect_near(work / press_energy(0.008), 0.0, 2e-3); // as above
    }
}

// ---------------------------------------------------------------------------------------------

// Slides 24 mm at constant depth along a line of the sheet; largest change between two steps of
// 0.08 mm and least force, as shares of the mean.
static void slide(double radius, double edge, Vec3 from, Vec3 to, double *jump, double *least)
{
    SCOPED(bench_destroy) Bench bench;
    make_sheet(&bench, edge, (int)(0.06 / edge) + 2, bench_ball(radius));
    double length = vec3_length(vec3_sub(to, from)), sum = 0.0, last = 0.0;
    int steps = (int)(length / 8e-5);
    *jump = 0.0;
    *least = HUGE_VAL;
    for (int i = 0; i <= steps; i++) {
        Vec3 place = vec3_madd(from, (double)i / steps, vec3_sub(to, from));
        place.z = radius - DEEP;
        double force = bench_touch(&bench, 0, place).z;
        if (i > 0)
            *jump = fmax(*jump, fabs(force - last));
        *least = fmin(*least, force);
        last = force;
        sum += force;
    }
    *jump /= sum / (steps + 1);
    *least /= sum / (steps + 1);
}

TEST(sliding_over_vertices_and_edges_has_no_jumps)
{
    // A step changed the force by up to 10.7 % of its mean, where some faces have not come to their
    // stiffness. In the prototype by which the law was chosen it never fell below 0.4 of it where a
    // face's middle is crossed: a quarter is a safe meaning of "never 0" (server/sim/README.md,
    // "Contact of faces").
    static const double cases[][2] = {
        {0.003, 0.004}, {0.003, 0.008}, {0.005, 0.008}, {0.005, 0.016}, {0.010, 0.016}};
    for (int k = 0; k < 5; k++) {
        double radius = cases[k][0], edge = cases[k][1], jump, least;
        // along an edge, over the vertices at its ends
        slide(radius, edge, vec3(-0.012, 0, 0), vec3(0.012, 0, 0), &jump, &least);
        expect_at_most(jump, 0.11);
        expect_at_least(least, 0.25);
        // across edges, through faces
        slide(radius, edge, vec3(-0.012, 0.3 * edge, 0), vec3(0.012, 0.3 * edge, 0), &jump, &least);
        expect_at_most(jump, 0.11);
        expect_at_least(least, 0.25);
        // askew over the vertex in the middle
        slide(radius, edge, vec3(-0.011, -0.005, 0), vec3(0.011, 0.005, 0), &jump, &least);
        expect_at_most(jump, 0.11);
        expect_at_least(least, 0.25);
    }
}

// The capsule lies askew to the edges: exactly along one, the nearest point jumps from end to end
// of that edge, which no soft minimum over pairs can hide.
TEST(tilting_a_capsule_turns_its_torque_without_jumps)
{
    static const double edges[] = {0.002, 0.004, 0.008, 0.016}, yaws[] = {0.2, 0.6};
    enum { STEPS = 400 }; // of 0.005 degrees
    for (int e = 0; e < 8; e++) {
        double edge = edges[e / 2];
        SCOPED(bench_destroy) Bench bench;
        make_sheet(&bench, edge, (int)(0.06 / edge) + 2, bench_capsule(0.04, 0.005));
        Quat yaw = quat_from_rotation(vec3(0.0, 0.0, yaws[e % 2]));
        double largest = 0.0, jump = 0.0, last = 0.0;
        for (int i = 0; i <= STEPS; i++) {
            double tilt = (i - STEPS / 2) * 0.005 * PI / 180.0;
            Quat turn = quat_multiply(yaw, quat_from_rotation(vec3(0.0, tilt, 0.0)));
            bench_place(&bench, 0, vec3(0.0007, 0.0011, 0.005 - DEEP), turn);
            sim_step(bench.sim);
            double torque =
                vec3_dot(sim_wrench(bench.sim, 0)->torque, quat_rotate(yaw, vec3(0.0, 1.0, 0.0)));
            largest = fmax(largest, fabs(torque));
            if (i > 0)
                jump = fmax(jump, fabs(torque - last));
            last = torque;
        }
        // The torque's own slope is 0.5 % a step; a single closest pair would jump by 7..44 %.
        expect_at_most(jump, 0.01 * largest);
    }
}

// ---------------------------------------------------------------------------------------------

static double distance_to_face(const Bench *bench, Vec3 p, Vec3 q, int face)
{
    Vec3 x[3];
    for (int k = 0; k < 3; k++)
        x[k] = bench->x[bench->mesh.triangle[face][k]];
    double along, weight[3], least = HUGE_VAL;
    if (distance_segment_crosses(p, q, x, &along, weight))
        return 0.0;
    ClosestPair pair[DISTANCE_PAIRS];
    distance_segment_triangle_pairs(p, q, x, pair);
    for (int j = 0; j < DISTANCE_PAIRS; j++)
        least = fmin(least, pair[j].distance);
    return least;
}

// Begins a tick in which the tool moves from one place to another, to an orientation.
static void begin_tick(Bench *bench, Vec3 from, Vec3 to, Quat orientation)
{
    ToolMotion motion;
    tool_motion_init(&motion);
    motion.begin_position = from;
    motion.end_position = to;
    motion.begin_orientation = motion.end_orientation = orientation;
    contact_begin_tick(bench->sim->contact[0], &motion, sim_tick(bench->sim), 0);
}

static bool is_candidate(const Contact *contact, int face)
{
    for (int i = 0; i < contact->candidate_count; i++)
        if (contact->candidate[i].face == face)
            return true;
    return false;
}

// Every face within reach of the axis (twice the radius while the tool stands still) and no other,
// in ascending order.
TEST(candidates_are_all_faces_within_reach)
{
    uint64_t random = 22;
    for (int mesh = 0; mesh < 3; mesh++) {
        BenchOptions options = bench_with_tool(
            mesh == 0 ? bench_uv_sphere() : bench_ico_sphere(mesh + 1), bench_capsule(0.05, 0.006));
        SCOPED(bench_destroy) Bench bench;
        bench_create(&bench, &options);
        Contact *contact = bench.sim->contact[0];
        int found = 0;
        for (int trial = 0; trial < 150; trial++) {
            Vec3 place = vec3_scale(0.07, random_vec3(&random));
            Quat turn = quat_from_rotation(vec3_scale(3.0, random_vec3(&random)));
            Vec3 arm = quat_rotate(turn, vec3(0.025, 0.0, 0.0));
            Vec3 p = vec3_sub(place, arm), q = vec3_add(place, arm);
            contact_clear(contact);
            // It is there already: what appears inside is led out.
            *contact->proxy = (Proxy){.valid = 1, .position = place, .orientation = turn};
            begin_tick(&bench, place, place, turn);
            for (int i = 1; i < contact->candidate_count; i++)
                assert_true(contact->candidate[i].face > contact->candidate[i - 1].face);
            for (int f = 0; f < bench.mesh.triangle_count; f++) {
                double distance = distance_to_face(&bench, p, q, f);
                if (fabs(distance - 0.012) > 1e-12) // not decided by rounding
                    assert_int_equal(is_candidate(contact, f), distance < 0.012);
            }
            found += contact->candidate_count;
        }
        assert_true(found > 500);
    }
}

// A tool that moves and turns as far as it may in a tick meets no face that was not found at its
// beginning.
TEST(candidates_reach_as_far_as_the_proxy_may_go)
{
    uint64_t random = 23;
    BenchOptions options = bench_with_tool(bench_ico_sphere(3), bench_capsule(0.05, 0.003));
    options.fixing = BENCH_FREE;
    options.rate_hz = 100.0; // many substeps, long ways
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    Contact *contact = bench.sim->contact[0];
    double cap = 0.25 * 0.003 * bench.body->substeps;
    assert_true(cap > 0.006);
    int far = 0;
    for (int trial = 0; trial < 300; trial++) {
        Vec3 out = vec3_unit(random_vec3(&random)), turn = random_vec3(&random);
        Vec3 place = vec3_scale(random_between(&random, 0.055, 0.09), out);
        Quat begin = quat_from_rotation(vec3_scale(3.0, random_vec3(&random)));
        // The pose comes in and turns by more than allowed; the proxy does as much of it as it may.
        double swing = fmin(1.0, cap / (0.025 * vec3_length(turn)));
        Quat end = quat_multiply(quat_from_rotation(vec3_scale(swing, turn)), begin);
        Vec3 goal = vec3_madd(place, -cap, out);
        contact_clear(contact);
        begin_tick(&bench, place, place, begin);
        begin_tick(&bench, place, goal, end);
        if (contact->candidate_count == 0)
            continue;
        Vec3 arm = quat_rotate(end, vec3(0.025, 0.0, 0.0));
        for (int f = 0; f < bench.mesh.triangle_count; f++)
            if (distance_to_face(&bench, vec3_sub(goal, arm), vec3_add(goal, arm), f) < 0.003) {
                assert_true(is_candidate(contact, f));
                far++;
            }
    }
    assert_true(far > 100);
}

// ---------------------------------------------------------------------------------------------

// The rim of the sheet: its straight side y = -half the height (bench_sheet is sheared along x).
static double rim_of(const Bench *bench)
{
    double low = 0.0;
    for (int i = 0; i < bench->mesh.node_count; i++)
        low = fmin(low, bench->mesh.position[i].y);
    return low;
}

// Round the rim and back again: never pulled, never stuck, and from below the sheet pushes down.
static void go_round(double edge, int cells, double radius)
{
    SCOPED(bench_destroy) Bench bench;
    make_sheet(&bench, edge, cells, bench_ball(radius));
    double rim = rim_of(&bench), off = radius - 0.0005;        // half a millimetre deep
    const double part = 0.0005 / fmin(0.15 * radius, 0.00075); // of the onset
    const double felt = 0.0005 * (part < 1.0 ? 0.4 * pow(part, 1.5) : 1.0 - 0.6 / part);
    double face = KAPPA * sqrt(0.1875) * edge * edge * felt; // of one face [N]
    for (double x = -edge; x <= edge; x += 0.29 * edge) {
        lift(&bench);
        for (int i = 0; i <= 400; i++) { // above, round the rim, below; and back
            double s = i <= 200 ? i / 200.0 : 2.0 - i / 200.0;
            double way = (s - 0.5) * (0.020 + PI * off), half = 0.5 * PI * off;
            double angle = fmax(-0.5 * PI, fmin(0.5 * PI, way / off)); // +: below
            Vec3 out = vec3(0.0, -cos(angle), -sin(angle));
            Vec3 foot = vec3(x, rim + fmax(0.0, fabs(way) - half), 0.0);
            Vec3 force = bench_touch(&bench, 0, vec3_madd(foot, off, out));
            // At least the face that is met, and others around it, none of them backwards.
            expect_at_least(vec3_dot(force, out), 0.99 * face);
            expect_at_least(vec3_dot(force, out), 0.9 * vec3_length(force));
        }
    }
}

TEST(tool_goes_round_a_free_border)
{
    go_round(0.008, 6, 0.003);
    go_round(0.002, 24, 0.005); // many rows of faces are near at once
}

// A tool that comes to the rim from outside and then goes under the sheet stays under it.
TEST(side_is_decided_where_the_border_is_left)
{
    for (int side = -1; side <= 1; side += 2) {
        SCOPED(bench_destroy) Bench bench;
        make_sheet(&bench, 0.008, 6, bench_ball(0.003));
        double rim = rim_of(&bench);
        for (double y = -0.008; y <= 0.015; y += 1e-4) {
            Vec3 force = bench_touch(&bench, 0, vec3(0.001, rim + y, side * 0.0025));
            expect_at_least(side * force.z, y > 0.0 ? 1e-3 : 0.0);
        }
    }
}
