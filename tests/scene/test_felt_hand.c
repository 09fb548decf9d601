// SPDX-License-Identifier: MIT
// The hand of pliant-probe --hand on the bodies of config/, in lockstep with the simulation: the
// stiffness that contacts tell is the slope of the force that is felt, and with it the hand gains
// no work, however late it hears of the force.
#include "test.h"

#include "sim/sim_data.h"
#include "sim/contact/contact_data.h"
#include "scene/build_parts.h"
#include "scene/scene.h"

#include "hand.h"

typedef struct Felt {
    Scene scene;
    World world;
    Vec3 touch, inwards;
    Quat orientation;
} Felt;

// Where a tool that comes from outside along `inwards` through the middle of the body is felt.
static void begin(Felt *felt, const char *path, Vec3 inwards)
{
    Status status = {0};
    const BuildOptions options = {.isa = "auto", .may_load = true, .publishes = true};
    *felt = (Felt){.inwards = inwards};
    expect_ok(scene_read(path, &felt->scene, &status) &&
                  world_build(&felt->world, &felt->scene, &options, &status),
              status);
    Sim *sim = felt->world.sim;
    sim_set_lockstep(sim, true);
    const Body *body = sim_body(sim, 0);
    const BodySurface *surface = &body->surface;
    Vec3 low = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high = vec3_scale(-1.0, low), x;
    for (int i = 0; i < surface->node_used; i++) {
        if (surface->node_face_end[i] == surface->node_face_start[i])
            continue;
        body->ops->read_nodes(body->model, &i, 1, &x, NULL);
        low = vec3(fmin(low.x, x.x), fmin(low.y, x.y), fmin(low.z, x.z));
        high = vec3(fmax(high.x, x.x), fmax(high.y, x.y), fmax(high.z, x.z));
    }
    // The shaft, +z of the tool, points back.
    const Vec3 back = vec3_scale(-1.0, inwards), axis = vec3_cross(vec3(0.0, 0.0, 1.0), back);
    felt->orientation = vec3_length(axis) > 0.0
                            ? quat_from_rotation(vec3_scale(acos(back.z), vec3_unit(axis)))
                            : (Quat){1.0, 0.0, 0.0, 0.0};
    const double size = vec3_length(vec3_sub(high, low)), step = 5e-5;
    Vec3 at = vec3_madd(vec3_scale(0.5, vec3_add(low, high)),
                        -0.5 * size - sim->contact[0]->largest_radius, inwards);
    for (double way = 0.0; way < 2.0 * size && !sim_wrench(sim, 0)->contact; way += step) {
        at = vec3_madd(at, step, inwards);
        const ToolPose pose = {.position = at, .orientation = felt->orientation, .active = true};
        sim_apply_pose(sim, 0, &pose, true);
        sim_step(sim);
    }
    assert_true(sim_wrench(sim, 0)->contact);
    felt->touch = vec3_madd(at, -2.0 * step, inwards);
}

static void end(Felt *felt)
{
    world_destroy(&felt->world);
    scene_destroy(&felt->scene);
}

// One tick of the device and, where the scene is slower, as many of the simulation as fall in it.
static HandForce hear(Felt *felt, Hand *hand, int tick, HandPose *newest)
{
    Sim *sim = felt->world.sim;
    HandPose next;
    while (hand_take_pose(hand, tick / HAND_RATE, &next)) {
        *newest = next;
        const ToolPose pose = {.position =
                                   vec3(next.position[0], next.position[1], next.position[2]),
                               .orientation = felt->orientation,
                               .linear = vec3(next.linear[0], next.linear[1], next.linear[2]),
                               .active = true};
        sim_apply_pose(sim, 0, &pose, true);
    }
    const int every = (int)lround(sim_tick(sim) * HAND_RATE);
    if (tick % every == 0)
        sim_step(sim);
    const ToolWrench *wrench = sim_wrench(sim, 0);
    const Sym3 k = wrench->stiffness;
    return (HandForce){.contact = wrench->contact,
                       .position = {wrench->position.x, wrench->position.y, wrench->position.z},
                       .force = {wrench->force.x, wrench->force.y, wrench->force.z},
                       .normal = {wrench->normal.x, wrench->normal.y, wrench->normal.z},
                       .stiffness = {{k.xx, k.xy, k.zx}, {k.xy, k.yy, k.yz}, {k.zx, k.yz, k.zz}}};
}

static double along(Vec3 d, const double v[3])
{
    return d.x * v[0] + d.y * v[1] + d.z * v[2];
}

typedef struct Where {
    const char *path;
    Vec3 inwards;
    double least; // share of the places where the stiffness is 0.9 to 1.3 times the slope
} Where;

// Measured: 29 of 34, 32 of 32, 28 of 34, 19 of 33 and 32 of 37 places; two or three fewer are
// asked. Most that miss are on the way back: the slope falls, and on the liver's flank the force
// falls by itself at first, as the friction of the press goes.
static const Where WHERE[] = {
    {"../config/block.cfg", {0.0, 0.0, -1.0}, 0.77},
    {"../config/cube.cfg", {0.0, 0.0, -1.0}, 0.9},
    {"../config/stomach.cfg", {1.0, 0.0, 0.0}, 0.7},
    {"../config/organ-volume.cfg", {0.0, 1.0, 0.0}, 0.5},
    {"../config/adaptive-organ.cfg", {0.0, 0.0, -1.0}, 0.77},
};

enum { PLACES = sizeof WHERE / sizeof WHERE[0] };

// In and out once, 20 mm in four seconds: the slope is that of the force over 0.1 s, where the hand
// moves by 0.2 mm at least.
TEST(told_stiffness_is_the_slope_of_the_force)
{
    enum { TICKS = 4000, HALF = 50 };
    static double depth[TICKS], force[TICKS], told[TICKS];
    for (int k = 0; k < PLACES; k++) {
        Felt felt;
        begin(&felt, WHERE[k].path, WHERE[k].inwards);
        const HandOptions options = {.frequency = 0.25,
                                     .depth = 0.02,
                                     .rate_hz = HAND_RATE,
                                     .max_force = 1e3,
                                     .twist = true};
        const double touch[3] = {felt.touch.x, felt.touch.y, felt.touch.z},
                     inwards[3] = {felt.inwards.x, felt.inwards.y, felt.inwards.z};
        static Hand hand;
        HandPose pose = {0};
        double damping = 0.0;
        hand_begin(&hand, &options, touch, inwards);
        for (int i = 0; i < TICKS; i++) {
            const HandForce heard = hear(&felt, &hand, i, &pose);
            double row[3];
            for (int c = 0; c < 3; c++)
                row[c] = along(felt.inwards, heard.stiffness[c]);
            depth[i] = along(felt.inwards, pose.position);
            force[i] = -along(felt.inwards, heard.force);
            told[i] = along(felt.inwards, row);
            damping = fmax(damping, sim_wrench(felt.world.sim, 0)->damping);
        }
        // Measured: 0.17 on the cube, 0.05 at most on others. A wall about to buckle hardly resists
        // what is solved: that counted as 0.29 on the stomach, up to 14 000 from other sides.
        expect_at_most(damping, 0.2);
        int count = 0, near = 0;
        for (int i = 2 * HALF; i + HALF < TICKS; i += 2 * HALF) {
            const double way = depth[i + HALF] - depth[i - HALF];
            if (fabs(way) < 2e-4 || force[i] < 0.02 * force[TICKS / 2])
                continue;
            const double slope = (force[i + HALF] - force[i - HALF]) / way;
            count++;
            near += told[i] >= 0.9 * slope && told[i] <= 1.3 * slope;
        }
        print_message("%s: within -10 and +30 %% at %d of %d places, %.3g N s/m at most\n",
                      WHERE[k].path, near, count, damping);
        assert_true(count > 20);
        expect_at_least(near, WHERE[k].least * count);
        end(&felt);
    }
}

// Work lost in three cycles at 2 Hz, as a share of what the hand put in; negative: it gained. What
// the device shows is at most twice the largest force that there was: a spike against the hand's
// motion counts as work lost, and would pass as calm.
static double lost(const Where *where, double depth, double latency, bool stiffness)
{
    Felt felt;
    begin(&felt, where->path, where->inwards);
    const HandOptions options = {.frequency = 2.0,
                                 .depth = depth,
                                 .rate_hz = HAND_RATE,
                                 .latency = latency,
                                 .max_force = 10.0,
                                 .twist = true,
                                 .stiffness = stiffness};
    const double touch[3] = {felt.touch.x, felt.touch.y, felt.touch.z},
                 inwards[3] = {felt.inwards.x, felt.inwards.y, felt.inwards.z};
    static Hand hand;
    HandPose pose = {0};
    hand_begin(&hand, &options, touch, inwards);
    const int ticks = (int)lround(hand_duration(&options, 3) * HAND_RATE);
    double most = 0.0;
    for (int i = 0; i <= ticks; i++) {
        const HandForce heard = hear(&felt, &hand, i, &pose);
        most = fmax(most, hypot(hypot(heard.force[0], heard.force[1]), heard.force[2]));
        hand_hear(&hand, i / HAND_RATE, &heard);
        hand_feel(&hand, i / HAND_RATE);
    }
    expect_at_most(hand.figures.peak, 2.0 * most);
    end(&felt);
    return hand.figures.lost / hand.figures.put_in;
}

// Round trips of 0 and 20 ms. Without stiffness a delay of 20 ms gives the hand a third to two
// thirds of what it puts in. With it, it loses 1.9 % at least.
TEST(a_late_hand_gains_no_work)
{
    static const double DEPTH[] = {0.006, 0.012, 0.02};
    for (int k = 0; k < PLACES; k++)
        for (int d = 0; d < 3; d++) {
            const double now = lost(&WHERE[k], DEPTH[d], 0.0, true),
                         late = lost(&WHERE[k], DEPTH[d], 0.02, true);
            print_message("%s, %.0f mm: lost %.3f, 20 ms late %.3f\n", WHERE[k].path,
                          1e3 * DEPTH[d], now, late);
            expect_at_least(now, 0.0);
            expect_at_least(late, 0.0);
        }
    expect_at_most(lost(&WHERE[0], DEPTH[0], 0.02, false), -0.2);
}

// Presses the first tool to four radii at as many a second.
static void press_deep(const Where *where)
{
    Felt felt;
    begin(&felt, where->path, where->inwards);
    Sim *sim = felt.world.sim;
    const double radius = sim->contact[0]->largest_radius;
    double most = 0.0, fall = 0.0, last = 0.0;
    enum { TICKS = 1000 };
    for (int i = 1; i <= TICKS; i++) {
        const ToolPose pose = {.position =
                                   vec3_madd(felt.touch, 4.0 * radius * i / TICKS, felt.inwards),
                               .orientation = felt.orientation,
                               .active = true};
        sim_apply_pose(sim, 0, &pose, true);
        sim_step(sim);
        const double force = -vec3_dot(felt.inwards, sim_wrench(sim, 0)->force);
        most = fmax(most, force);
        fall = fmax(fall, most - force);
        if (i % (TICKS / 4) != 0)
            continue;
        print_message("%s: %.3f N at %d radii, %.3f N less than before\n", where->path, force,
                      4 * i / TICKS, fall);
        // Measured: a quarter to the double more, radius by radius.
        expect_at_least(force, 1.1 * last);
        last = force;
    }
    // The bar of press.fall (tests/touch/touch.md); measured: none.
    expect_at_most(fall, 0.01 * most);
    expect_at_least(most, 0.05); // it has touched
    end(&felt);
}

// Not the cube, whose tool may push no more than it does at a radius.
TEST(solids_push_back_more_the_deeper_to_four_radii)
{
    static const Where DEEP[] = {{"../config/block.cfg", {0.0, 0.0, -1.0}, 0.0},
                                 {"../config/block.cfg", {-1.0, 0.0, 0.0}, 0.0},
                                 {"../config/cut-block.cfg", {0.0, 0.0, -1.0}, 0.0},
                                 {"../config/organ-volume.cfg", {0.0, 1.0, 0.0}, 0.0}};
    for (size_t k = 0; k < sizeof DEEP / sizeof *DEEP; k++)
        press_deep(&DEEP[k]);
}
