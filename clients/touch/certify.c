// SPDX-License-Identifier: MIT
#include "touch/certify.h"

#include "study/inputs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double CLEAR = 3e-3;       // of the tissue, where a hand begins [m]
static const double BEGIN_S = 0.1;      // at rest there
static const double PRESS_SPEED = 0.02; // [m/s]
static const double DRAG_SPEED = 0.05;
static const double STEP_SPEED = 0.5;
static const double PULL_SPEED = 0.05;
static const double FREE_S = 0.1; // after which a tool that was lifted must feel nothing

typedef struct Certifier {
    Bench *bench;
    DeviceOptions device; // of the real stream
    double rate;          // of the server [Hz]
    Curve curve;          // of the present trial
    Certificate *to;
    // of the clean press, for the trials after it
    double force, stiffness, tick; // [N], [N/m], share of the peak
} Certifier;

static void set(Certifier *certifier, FigureId id, double value)
{
    certifier->to->value[id] = certifier->curve.whole ? value : (double)NAN;
}

// Returns `part` in percent of `whole`.
static double percent(double part, double whole)
{
    return whole > 0.0 ? 100.0 * part / whole : (double)NAN;
}

// A stretch of a curve.
typedef struct Window {
    int first, count;
} Window;

static Window window(const Curve *curve, double from, double to)
{
    Window in = {0, 0};
    while (in.first < curve->count && curve->time[in.first] < from - 1e-9)
        in.first++;
    while (in.first + in.count < curve->count && curve->time[in.first + in.count] <= to + 1e-9)
        in.count++;
    return in;
}

// Runs a way of the hand as the server sees it, each tick its pose, without a device.
static void run_clean(Certifier *certifier, const Leg *leg, int count)
{
    const Trial trial = {.leg = leg, .leg_count = count, .rate_hz = certifier->rate, .scale = 1.0};
    trial_run(certifier->bench, &trial, &certifier->curve);
}

static double largest_after(const Curve *curve, double from)
{
    const Window in = window(curve, from, HUGE_VAL);
    return figure_largest(curve->force + in.first, in.count);
}

// --- shapes ---

typedef struct NodeAt {
    int id;
    Vec3 x;
} NodeAt;

static int by_id(const void *a, const void *b)
{
    const int first = ((const NodeAt *)a)->id, second = ((const NodeAt *)b)->id;
    return (first > second) - (first < second);
}

// Lists where the nodes of the body are, by id; the caller frees it. Levels may add and remove
// some.
static NodeAt *list_nodes(const Bench *bench, int *count)
{
    const Body *body = sim_body(bench->world.sim, bench->body);
    const size_t rows = (size_t)body->state_capacity;
    NodeAt *list = calloc(rows, sizeof *list);
    Vec3 *x = calloc(rows, sizeof *x), *v = calloc(rows, sizeof *v);
    int *id = calloc(rows, sizeof *id);
    if (list == NULL || x == NULL || v == NULL || id == NULL)
        abort(); // the machine is out of memory
    const int used = body->ops->read_state(body->model, id, x, v);
    *count = 0;
    for (int r = 0; r < used; r++)
        if (id[r] >= 0)
            list[(*count)++] = (NodeAt){id[r], x[r]};
    qsort(list, (size_t)*count, sizeof *list, by_id);
    free(x);
    free(v);
    free(id);
    return list;
}

// Returns how far a node is now at most from where it would be, had nothing touched it [m].
static double farthest(Bench *bench)
{
    int other_count, count;
    Sim *sim = bench->world.sim;
    NodeAt *now = list_nodes(bench, &count);
    const int64_t end = sim_steps(sim);
    bench_restart(bench);
    while (sim_steps(sim) < end)
        sim_step(sim);
    NodeAt *other = list_nodes(bench, &other_count);
    double most = 0.0;
    for (int i = 0; i < count; i++) {
        const NodeAt *alone = bsearch(&now[i], other, (size_t)other_count, sizeof *other, by_id);
        if (alone != NULL)
            most = fmax(most, vec3_length(vec3_sub(now[i].x, alone->x)));
    }
    free(now);
    free(other);
    return most;
}

// --- trials ---

// Near the tissue, and away again.
static void free_space(Certifier *certifier)
{
    const Leg legs[] = {
        {BEGIN_S, -CLEAR, 0.0, 0.0}, {0.2, -0.1 * CLEAR, 0.0, 0.0}, {0.2, -CLEAR, 0.0, 0.0}};
    run_clean(certifier, legs, 3);
    set(certifier, FIGURE_FREE, largest_after(&certifier->curve, -BEGIN_S));
}

// The figures of the second before `end`, in which the hand rested.
static void held(Certifier *certifier, double end)
{
    const Curve *curve = &certifier->curve;
    const Window in = window(curve, end - 1.0 - 1.5 / certifier->rate, end);
    double peak;
    const double *force = curve->push + in.first;
    const double rms = figure_band(force, in.count, certifier->rate, 20.0, 300.0, &peak);
    certifier->force = figure_mean(force, in.count);
    set(certifier, FIGURE_FORCE, certifier->force);
    set(certifier, FIGURE_HOLD_PEAK, 1e3 * peak);
    set(certifier, FIGURE_HOLD_RMS, 1e3 * rms);
    set(certifier, FIGURE_HOLD_SHARE, percent(rms, certifier->force));
}

// A slow press to the full depth, a rest.
static void hold(Certifier *certifier)
{
    const double depth = certifier->bench->depth, down = (depth + CLEAR) / PRESS_SPEED;
    const Leg legs[] = {
        {BEGIN_S, -CLEAR, 0.0, 0.0}, {down, depth, 0.0, 0.0}, {2.0, depth, 0.0, 0.0}};
    run_clean(certifier, legs, 3);
    const Curve *curve = &certifier->curve;
    certifier->stiffness = curve->stiffness;
    set(certifier, FIGURE_STIFFNESS, certifier->stiffness);
    held(certifier, down + 2.0);
    const Window in = window(curve, 0.0, down);
    const double peak = figure_largest(curve->force + in.first, in.count);
    set(certifier, FIGURE_PRESS_FALL, percent(figure_fall(curve->push + in.first, in.count), peak));
    set(certifier, FIGURE_PRESS_WAY,
        percent(figure_change(curve->depth + in.first, curve->push + in.first, in.count, 1e-4),
                peak));
}

// The same without the rest, and back: the way is closed.
static void press(Certifier *certifier)
{
    const double depth = certifier->bench->depth, down = (depth + CLEAR) / PRESS_SPEED;
    const Leg legs[] = {{BEGIN_S, -CLEAR, 0.0, 0.0},
                        {down, depth, 0.0, 0.0},
                        {down, -CLEAR, 0.0, 0.0},
                        {2.0, -CLEAR, 0.0, 0.0}};
    run_clean(certifier, legs, 4);
    const Curve *curve = &certifier->curve;
    const double peak = figure_largest(curve->force, curve->count);
    certifier->tick = percent(figure_tick(curve->force, curve->count), peak);
    set(certifier, FIGURE_PRESS_TICK, certifier->tick);
    set(certifier, FIGURE_PRESS_ENERGY,
        1e3 * figure_energy(curve->hand, curve->force, curve->count, false));
    set(certifier, FIGURE_LIFT_FORCE, largest_after(curve, 2.0 * down + FREE_S));
    set(certifier, FIGURE_LIFT_SHAPE, 1e3 * farthest(certifier->bench));
}

// The last tenth of the depth as a step.
static void rise(Certifier *certifier)
{
    const double depth = certifier->bench->depth, step = 0.1 * depth;
    const double down = (depth - step + CLEAR) / PRESS_SPEED;
    const Leg legs[] = {{BEGIN_S, -CLEAR, 0.0, 0.0},
                        {down, depth - step, 0.0, 0.0},
                        {0.5, depth - step, 0.0, 0.0},
                        {step / STEP_SPEED, depth, 0.0, 0.0},
                        {0.4, depth, 0.0, 0.0}};
    run_clean(certifier, legs, 5);
    const Curve *curve = &certifier->curve;
    const Window in = window(curve, down + 0.5, HUGE_VAL);
    const int settled = (int)(0.05 * certifier->rate);
    if (in.count <= settled)
        return;
    const double *force = curve->push + in.first;
    const double more = figure_mean(force + in.count - settled, settled) - force[0];
    if (more > 0.0 && curve->stiffness > 0.0)
        set(certifier, FIGURE_TOLD, curve->stiffness * step / more);
    set(certifier, FIGURE_RISE, 1e3 / certifier->rate * figure_rise(force, in.count, settled));
}

// Returns the largest way sideways on which the body is still below.
static double drag_way(const Bench *bench)
{
    return fmin(8.0 * bench->radius, 0.25 * bench->extent);
}

// Adds the means of a stretch: what pulls the tool back along `sign` times sideways, and the push.
static void add_slide(const Certifier *certifier, double from, double to, double sign, double *side,
                      double *push)
{
    const Curve *curve = &certifier->curve;
    const Window in = window(curve, from, to);
    for (int i = in.first; i < in.first + in.count; i++) {
        *side -= sign * vec3_dot(curve->force[i], certifier->bench->sideways) / in.count;
        *push += curve->push[i] / in.count;
    }
}

// Friction from there and back over the same places around the touch, so that slopes cancel.
static void slide(Certifier *certifier)
{
    const Bench *bench = certifier->bench;
    const double depth = 0.4 * bench->radius, way = bench->radius, pass = 2.0 * way / DRAG_SPEED;
    const double down = (depth + CLEAR) / PRESS_SPEED, there = down + 0.5 * pass;
    const Leg legs[] = {{BEGIN_S, -CLEAR, 0.0, 0.0},
                        {down, depth, 0.0, 0.0},
                        {0.5 * pass, depth, -way, 0.0},
                        {pass, depth, way, 0.0},
                        {pass, depth, -way, 0.0}};
    run_clean(certifier, legs, 5);
    double side = 0.0, push = 0.0;
    add_slide(certifier, there + 0.25 * pass, there + 0.75 * pass, 1.0, &side, &push);
    add_slide(certifier, there + 1.25 * pass, there + 1.75 * pass, -1.0, &side, &push);
    const double ratio = push > 0.0 ? side / push : (double)NAN;
    const ToolOptions *tool = sim_tool(bench->world.sim, bench->tool);
    const double mu = tool->has_friction ? tool->friction
                                         : sim_body(bench->world.sim, bench->body)->tuning.friction;
    set(certifier, FIGURE_SLIDE_RATIO, ratio);
    set(certifier, FIGURE_SLIDE_ERROR, percent(fabs(ratio - mu), mu));
}

// At full depth there, back, and out.
static void drag(Certifier *certifier)
{
    const Bench *bench = certifier->bench;
    const double depth = bench->depth, way = drag_way(bench);
    const double down = (depth + CLEAR) / PRESS_SPEED, along = way / DRAG_SPEED;
    const Leg legs[] = {{BEGIN_S, -CLEAR, 0.0, 0.0}, {down, depth, 0.0, 0.0},
                        {along, depth, way, 0.0},    {along, depth, 0.0, 0.0},
                        {down, -CLEAR, 0.0, 0.0},    {1.0, -CLEAR, 0.0, 0.0}};
    run_clean(certifier, legs, 6);
    const Curve *curve = &certifier->curve;
    const double peak = figure_largest(curve->force, curve->count);
    set(certifier, FIGURE_DRAG_PEAK, peak / certifier->force);
    set(certifier, FIGURE_DRAG_TICK, percent(figure_tick(curve->force, curve->count), peak));
    set(certifier, FIGURE_DRAG_ENERGY,
        1e3 * figure_energy(curve->hand, curve->force, curve->count, false));
    set(certifier, FIGURE_DRAG_FORCE, largest_after(curve, 2.0 * (down + along) + FREE_S));
}

// The press through the device and the network, with all that they do.
static void stream(Certifier *certifier)
{
    const double depth = certifier->bench->depth, down = (depth + CLEAR) / PRESS_SPEED;
    const Leg legs[] = {{BEGIN_S, -CLEAR, 0.0, 0.0},
                        {down, depth, 0.0, 0.0},
                        {1.5, depth, 0.0, 0.0},
                        {down, -CLEAR, 0.0, 0.0}};
    const Trial trial = {.leg = legs,
                         .leg_count = 4,
                         .rate_hz = certifier->rate,
                         .device = certifier->device,
                         .scale = 1.0};
    trial_run(certifier->bench, &trial, &certifier->curve);
    const Curve *curve = &certifier->curve;
    const double peak = figure_largest(curve->force, curve->count);
    set(certifier, FIGURE_STREAM_TICK,
        percent(figure_tick(curve->force, curve->count), peak) / certifier->tick);
    const Window in = window(curve, down + 0.5, down + 1.5);
    const double *force = curve->push + in.first, mean = figure_mean(force, in.count);
    double square = 0.0;
    for (int i = 0; i < in.count; i++)
        square += (force[i] - mean) * (force[i] - mean) / in.count;
    set(certifier, FIGURE_STREAM_NOISE, percent(sqrt(square), mean));
}

// Of the device what a closed loop has: its network, poses a thousand times per second, an encoder.
static DeviceOptions loop_device(const Certifier *certifier)
{
    DeviceOptions device = certifier->device;
    device.noise = device.gap_length = device.gap_every = device.wrong = device.wrong_every = 0.0;
    device.rate_hz = device.rate_hz > 0.0 ? device.rate_hz : 1000.0;
    return device;
}

// A hand that goes in and out, and feels what the client renders.
static void loop(Certifier *certifier, bool guard, FigureId energy, FigureId tick)
{
    const Trial trial = {.swing = certifier->bench->depth,
                         .hz = 2.0,
                         .seconds = 2.0,
                         .rate_hz = 1000.0,
                         .device = loop_device(certifier),
                         .haptic = true,
                         .guard = guard,
                         .scale = 1.0};
    trial_run(certifier->bench, &trial, &certifier->curve);
    const Curve *curve = &certifier->curve;
    set(certifier, energy, 1e3 * figure_energy(curve->hand, curve->force, curve->count, true));
    set(certifier, tick,
        percent(figure_tick(curve->force, curve->count),
                figure_largest(curve->force, curve->count)));
}

// --- the largest stiffness ---

// Returns how far the hand moved in a stretch; sets how deep it was at most.
static double span(const Curve *curve, double from, double to, double *deepest)
{
    const Window in = window(curve, from, to);
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int i = 0; i < in.count; i++) {
        low = fmin(low, curve->depth[in.first + i]);
        high = fmax(high, curve->depth[in.first + i]);
    }
    *deepest = high;
    return high - low;
}

// True if a device that is pushed with half the force of the press comes to rest, no deeper than
// it: the full force with its swing went beyond what was pressed, on cube.cfg into `max_force`, and
// a guard that gives no force lets it sink. With a wall that neither takes nor gives energy its own
// damping leaves exp(-0.8) = 0.45 of the motion from one window to the other, and a limit cycle
// leaves all; below two steps of the encoder there is rest.
static bool calms(Certifier *certifier, double rate_hz, bool guard, double stiffness)
{
    const double scale = stiffness / certifier->stiffness;
    const Trial trial = {.push = 0.5 * scale * certifier->force,
                         .seconds = 1.6,
                         .rate_hz = rate_hz,
                         .device = loop_device(certifier),
                         .haptic = true,
                         .guard = guard,
                         .scale = scale};
    trial_run(certifier->bench, &trial, &certifier->curve);
    double deepest;
    const double before = span(&certifier->curve, 0.4, 0.8, &deepest),
                 after = span(&certifier->curve, 1.2, 1.6, &deepest);
    return after <= fmax(0.7 * before, 2.0 * trial.device.quantum + 1e-6) &&
           deepest <= certifier->bench->depth;
}

// Scales what the client is told from 50 N/m, where the device still swings once in 0.3 s, octave
// by octave until it does not calm down, and by thirds in that octave. Stiffer ones may calm down
// again: a bisection found any of these. 0: not even the least calms down.
static double width(Certifier *certifier, double rate_hz, bool guard)
{
    enum { OCTAVES = 8 };
    double good = 0.0, next = 50.0;
    if (!(certifier->stiffness > 0.0))
        return (double)NAN;
    for (int k = 0; k < OCTAVES && calms(certifier, rate_hz, guard, next); k++, next *= 2.0)
        good = next;
    next = good * exp2(1.0 / 3.0);
    for (int k = 1; k < 3 && good > 0.0 && calms(certifier, rate_hz, guard, next); k++) {
        good = next;
        next *= exp2(1.0 / 3.0);
    }
    return good;
}

// --- grasping ---

static int find_grasper(const Scene *scene)
{
    for (int t = 0; t < scene->tool_count; t++)
        if (scene->tool[t].kind == TOOL_GRASPER && scene->tool[t].capsule_count > 0)
            return t;
    return -1;
}

// Returns how far the node that was nearest to the jaws has gone out of the body [m].
static double way_out(const Bench *bench, Vec3 jaws, const NodeAt *before, int before_count)
{
    int count;
    NodeAt *now = list_nodes(bench, &count);
    const NodeAt *near = &before[0];
    for (int i = 1; i < before_count; i++)
        if (vec3_length(vec3_sub(before[i].x, jaws)) < vec3_length(vec3_sub(near->x, jaws)))
            near = &before[i];
    const NodeAt *is = bsearch(near, now, (size_t)count, sizeof *now, by_id);
    const double way =
        is != NULL ? -vec3_dot(vec3_sub(is->x, near->x), bench->inward) : (double)NAN;
    free(now);
    return way;
}

// Closes the jaws with their middle at the surface and pulls them three radii out.
static void grasp(Certifier *certifier, Bench *bench)
{
    const double deep = bench->radius, way = 3.0 * deep;
    const Leg legs[] = {{BEGIN_S, -CLEAR, 0.0, 0.0},
                        {(deep + CLEAR) / PRESS_SPEED, deep, 0.0, 0.0},
                        {0.3, deep, 0.0, 1.0},
                        {way / PULL_SPEED, deep - way, 0.0, 1.0},
                        {0.5, deep - way, 0.0, 1.0}};
    Trial trial = {.leg = legs, .leg_count = 3, .rate_hz = certifier->rate, .scale = 1.0};
    trial_run(bench, &trial, &certifier->curve);
    int count;
    NodeAt *before = list_nodes(bench, &count);
    const Vec3 jaws = vec3_madd(bench->touch, deep, bench->inward);
    trial.leg_count = 5;
    trial_run(bench, &trial, &certifier->curve);
    set(certifier, FIGURE_GRASP_LAG, 1e3 * (way - way_out(bench, jaws, before, count)));
    free(before);
}

// --- all ---

// Finds a body by its name; NULL: the first.
static int find_body(const Scene *scene, const char *name)
{
    for (int b = 0; b < scene->body_count; b++)
        if (name == NULL || strcmp(scene->body[b].name, name) == 0)
            return b;
    return -1;
}

static void describe(const Certifier *certifier, const Scene *scene)
{
    Certificate *to = certifier->to;
    const Bench *bench = certifier->bench;
    to->tool = scene->tool[bench->tool].id;
    to->body = scene->body[bench->body].name;
    to->radius = bench->radius;
    to->depth = bench->depth;
    to->rate_hz = certifier->rate;
}

static void run_all(Certifier *certifier)
{
    free_space(certifier);
    hold(certifier);
    press(certifier);
    rise(certifier);
    slide(certifier);
    drag(certifier);
    stream(certifier);
    loop(certifier, true, FIGURE_LOOP_ENERGY, FIGURE_LOOP_TICK);
    loop(certifier, false, FIGURE_BARE_ENERGY, FIGURE_BARE_TICK);
    set(certifier, FIGURE_WIDTH_1, width(certifier, 1000.0, false));
    set(certifier, FIGURE_WIDTH_4, width(certifier, 4000.0, false));
    set(certifier, FIGURE_WIDTH_10, width(certifier, 10000.0, false));
    set(certifier, FIGURE_WIDTH_GUARD, width(certifier, 1000.0, true));
}

bool certify(const Scene *scene, const CertifyOptions *options, Certificate *certificate,
             Status *status)
{
    static Certifier certifier;
    Bench bench;
    *certificate = (Certificate){.scene = scene, .device = options->device_text};
    for (int k = 0; k < FIGURE_COUNT; k++)
        certificate->value[k] = (double)NAN;
    const int body = find_body(scene, options->body);
    if (body < 0)
        return status_fail(status, STATUS_INVALID, "%s: no body '%s'", scene->path,
                           options->body != NULL ? options->body : "");
    if (!bench_begin(&bench, scene, body, -1, status))
        return false;
    certifier = (Certifier){
        .bench = &bench, .device = options->device, .rate = scene->sim.rate_hz, .to = certificate};
    describe(&certifier, scene);
    run_all(&certifier);
    bench_end(&bench);
    // The jaws have a place of their own.
    const int grasper = find_grasper(scene);
    if (grasper < 0)
        return true;
    if (!bench_begin(&bench, scene, body, grasper, status))
        return false;
    grasp(&certifier, &bench);
    bench_end(&bench);
    return true;
}
