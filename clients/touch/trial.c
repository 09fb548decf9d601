// SPDX-License-Identifier: MIT
#include "touch/trial.h"

#include "study/inputs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double CALM = 1.0;          // before anything, until bodies that fall lie [s]
static const double APPROACH = 5e-5;     // way of a tick [m]
static const double VALID = 0.02;        // of a contact, as the server tells [s]
static const double PUSH_RISES = 0.1;    // [s]
static const double INERTIA_STEP = 1e-4; // of the device's motion, at most [s]
static const double DEEPEST = 0.25;      // of the thickness: a full press is 2 radii, at most this

// --- the place ---

// Brings the tool on, at rest at each step, until it is felt.
static bool approach(Bench *bench, Vec3 from, Status *status)
{
    Sim *sim = bench->world.sim;
    sim_set_lockstep(sim, true);
    for (double way = 0.0; way < bench->extent; way += APPROACH) {
        const ToolPose pose = {.position = vec3_madd(from, way, bench->inward),
                               .orientation = bench->orientation,
                               .active = true};
        sim_apply_pose(sim, bench->tool, &pose, true);
        sim_step(sim);
        if (sim_wrench(sim, bench->tool)->contact) {
            bench->touch = vec3_madd(from, fmax(0.0, way - 2.0 * APPROACH), bench->inward);
            sim_set_lockstep(sim, false);
            return true;
        }
    }
    return status_fail(status, STATUS_FAILED, "the tool went through body %s and felt nothing",
                       sim_body(sim, bench->body)->name);
}

static bool find_place(Bench *bench, const Scene *scene, Status *status)
{
    const bool plane = scene->body[bench->body].model == MODEL_PLANE;
    const Body *body = sim_body(bench->world.sim, bench->body);
    PressSite site;
    if (!press_find_site(body, plane, &site))
        return status_fail(status, STATUS_INVALID,
                           "body %s has no free node to press on: all are fixed", body->name);
    StudyPress press;
    press_plan(&press, bench->tool, &scene->tool[bench->tool], &site, plane);
    bench->inward = press.inward;
    bench->orientation = press.orientation;
    bench->radius = scene->tool[bench->tool].capsule[0].radius;
    bench->extent = press_extent(body, &bench->thickness);
    bench->depth = fmin(2.0 * bench->radius, DEEPEST * bench->thickness);
    // In the plane of a plane body; else along the world's axis that is most across.
    Vec3 across = fabs(press.inward.y) < 0.8 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0);
    bench->sideways = vec3_unit(vec3_cross(press.inward, plane ? vec3(0.0, 0.0, 1.0) : across));
    return approach(bench, press.start, status);
}

bool bench_begin(Bench *bench, const Scene *scene, int body, int tool, Status *status)
{
    *bench = (Bench){.body = body, .tool = tool >= 0 ? tool : press_find_tool(scene)};
    if (bench->tool < 0)
        return status_fail(status, STATUS_INVALID, "%s: no tool that can press: give it a probe",
                           scene->path);
    const BuildOptions options = {.isa = "auto", .publishes = true};
    World *world = &bench->world;
    if (!world_build(world, scene, &options, status))
        return false;
    while (sim_time(world->sim) < CALM)
        sim_step(world->sim);
    bench->start = malloc(state_bytes(&world->state));
    if (bench->start == NULL)
        abort(); // the machine is out of memory
    state_copy_out(&world->state, bench->start);
    if (find_place(bench, scene, status))
        return true;
    bench_end(bench);
    return false;
}

void bench_end(Bench *bench)
{
    free(bench->start);
    world_destroy(&bench->world);
}

void bench_restart(Bench *bench)
{
    state_copy_in(&bench->world.state, bench->start);
    sim_restored(bench->world.sim);
}

// --- a run ---

typedef struct Run {
    Bench *bench;
    const Trial *trial;
    Device out, back;                      // poses to the server, contacts to the client
    PliantContact contact[DEVICE_WAITING]; // by the number of its message
    int32_t newest_pose, newest_contact;
    PliantHaptic *haptic;
    int64_t ticks;       // of the server
    double depth, speed; // of a pushed device
} Run;

static Vec3 place(const Bench *bench, double depth, double side)
{
    return vec3_madd(vec3_madd(bench->touch, depth, bench->inward), side, bench->sideways);
}

// Where the legs are at a time.
static Leg leg_at(const Trial *trial, double time)
{
    Leg at = trial->leg[0];
    double begin = at.seconds;
    for (int k = 1; k < trial->leg_count && time > begin; k++) {
        const Leg *to = &trial->leg[k];
        const double part = fmin(1.0, (time - begin) / to->seconds);
        at.depth += part * (to->depth - at.depth);
        at.side += part * (to->side - at.side);
        at.grip = to->grip;
        begin += to->seconds;
    }
    return at;
}

static PliantPose pose_at(const Run *run, double time)
{
    const Trial *trial = run->trial;
    Leg at = {.depth = run->depth};
    if (trial->leg != NULL)
        at = leg_at(trial, time);
    else if (trial->swing > 0.0)
        at.depth =
            trial->swing * 0.5 * (1.0 - cos(2.0 * 3.14159265358979323846 * trial->hz * time));
    const Vec3 x = place(run->bench, at.depth, at.side);
    const Quat q = run->bench->orientation;
    return (PliantPose){.position = {x.x, x.y, x.z},
                        .orientation = {q.w, q.x, q.y, q.z},
                        .active = true,
                        .grip = at.grip};
}

// As the server does: of what came it uses the newest, and nothing that was overtaken.
static void take_pose(Run *run, double time)
{
    DevicePose came;
    bool fresh = false;
    ToolPose pose;
    while (device_take(&run->out, time, &came)) {
        const double *x = came.pose.position, *q = came.pose.orientation;
        if (came.number < run->newest_pose)
            continue;
        run->newest_pose = came.number;
        fresh = true;
        pose = (ToolPose){.utime = 1 + llround(1e6 * came.time),
                          .position = vec3(x[0], x[1], x[2]),
                          .orientation = {q[0], q[1], q[2], q[3]},
                          .active = true,
                          .grip = came.pose.grip};
    }
    if (fresh)
        sim_apply_pose(run->bench->world.sim, run->bench->tool, &pose, false);
}

static void scaled(double to[3], double scale, Vec3 from)
{
    to[0] = scale * from.x;
    to[1] = scale * from.y;
    to[2] = scale * from.z;
}

// One tick of the server, whose contact is sent back.
static void serve(Run *run, double time)
{
    const Bench *bench = run->bench;
    const double scale = run->trial->scale;
    take_pose(run, time);
    sim_step(bench->world.sim);
    run->ticks++;
    const ToolWrench *wrench = sim_wrench(bench->world.sim, bench->tool);
    PliantContact *contact = &run->contact[run->back.samples % DEVICE_WAITING];
    *contact = (PliantContact){.time = time, .valid = VALID, .contact = wrench->contact};
    scaled(contact->position, 1.0, wrench->position);
    if (wrench->contact) {
        scaled(contact->force, scale, wrench->force);
        scaled(contact->normal, 1.0, wrench->normal);
        double stiffness[9];
        sym3_full(wrench->stiffness, stiffness);
        for (int k = 0; k < 9; k++)
            contact->stiffness[k / 3][k % 3] = scale * stiffness[k];
        contact->damping = scale * wrench->damping;
    }
    device_send(&run->back, time, &(PliantPose){.active = true});
}

static Vec3 feel(Run *run, const double position[3], double time)
{
    DevicePose came;
    while (device_take(&run->back, time, &came)) {
        if (came.number < run->newest_contact)
            continue;
        run->newest_contact = came.number;
        PliantContact *contact = &run->contact[came.number % DEVICE_WAITING];
        contact->received = came.arrives;
        pliant_haptic_take(run->haptic, contact);
    }
    if (!run->trial->haptic)
        return sim_wrench(run->bench->world.sim, run->bench->tool)->force;
    double force[3];
    pliant_haptic_force(run->haptic, position, NULL, time, force);
    return vec3(force[0], force[1], force[2]);
}

// Moves a pushed device along the press; the force stays until the next call.
static void push(Run *run, double time, double against)
{
    const double period = 1.0 / run->trial->rate_hz;
    const double by = run->trial->push * fmin(1.0, time / PUSH_RISES) - against;
    const int steps = (int)ceil(period / INERTIA_STEP - 1e-9);
    for (int i = 0; i < steps; i++) {
        run->speed += period / steps * (by - DEVICE_DAMPING * run->speed) / DEVICE_MASS;
        run->depth += period / steps * run->speed;
    }
}

static void record(const Run *run, Curve *curve, double time, const double position[3], Vec3 force)
{
    const int i = curve->count;
    if (i == TRIAL_SAMPLES) {
        curve->whole = false;
        return;
    }
    curve->time[i] = time - (run->trial->leg != NULL ? run->trial->leg[0].seconds : 0.0);
    curve->hand[i] = vec3(position[0], position[1], position[2]);
    curve->force[i] = force;
    curve->depth[i] = vec3_dot(vec3_sub(curve->hand[i], run->bench->touch), run->bench->inward);
    curve->push[i] = -vec3_dot(force, run->bench->inward);
    curve->count++;
}

static double told_stiffness(const Bench *bench)
{
    double k[9];
    const Vec3 n = bench->inward;
    sym3_full(sim_wrench(bench->world.sim, bench->tool)->stiffness, k);
    const Vec3 row =
        vec3(k[0] * n.x + k[1] * n.y + k[2] * n.z, k[3] * n.x + k[4] * n.y + k[5] * n.z,
             k[6] * n.x + k[7] * n.y + k[8] * n.z);
    return vec3_dot(n, row);
}

static double seconds_of(const Trial *trial)
{
    double sum = trial->leg != NULL ? 0.0 : trial->seconds;
    for (int k = 0; k < trial->leg_count; k++)
        sum += trial->leg[k].seconds;
    return sum;
}

static void begin(Run *run, Bench *bench, const Trial *trial)
{
    // Contacts come back over the same network; the device has no part in them.
    DeviceOptions back = {.late = trial->device.late,
                          .jitter = trial->device.jitter,
                          .loss = trial->device.loss,
                          .seed = trial->device.seed + 1.0};
    run->bench = bench;
    run->trial = trial;
    run->haptic = pliant_haptic_create(1e3, trial->guard);
    device_begin(&run->out, &trial->device);
    device_begin(&run->back, &back);
    bench_restart(bench);
}

void trial_run(Bench *bench, const Trial *trial, Curve *curve)
{
    Run *run = calloc(1, sizeof *run);
    if (run == NULL)
        abort(); // the machine is out of memory
    begin(run, bench, trial);
    curve->count = 0;
    curve->whole = true;
    const double tick = sim_tick(bench->world.sim);
    const int64_t samples = llround(seconds_of(trial) * trial->rate_hz);
    for (int64_t i = 0; i < samples; i++) {
        const double time = (double)i / trial->rate_hz;
        const PliantPose pose = pose_at(run, time);
        device_send(&run->out, time, &pose);
        while ((double)run->ticks * tick <= time + 1e-9)
            serve(run, (double)run->ticks * tick);
        // An encoder is all that the client knows of its device.
        double seen[3];
        const double step = trial->device.quantum;
        for (int k = 0; k < 3; k++)
            seen[k] = step > 0.0 ? step * round(pose.position[k] / step) : pose.position[k];
        const Vec3 force = feel(run, seen, time);
        record(run, curve, time, pose.position, force);
        if (trial->push > 0.0)
            push(run, time, curve->push[curve->count - 1]);
    }
    curve->stiffness = told_stiffness(bench);
    pliant_haptic_destroy(run->haptic);
    free(run);
}
