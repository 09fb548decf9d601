// SPDX-License-Identifier: MIT
// How long a tick takes on this machine, for --check: measured, not counted, as the processor time
// of the thread that steps, which other programs do not change. With `threads` it includes waiting
// for the others. Main thread, in place of a run; the world is of no use afterwards.
#include "run/modes.h"

#include "base/check.h"
#include "base/log.h"
#include "run/realtime.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>

enum {
    TICKS_MOST = 400,
    TICKS_LEAST = 5,
    TICKS_WARM_UP = 3, // caches, and contacts that settle
};
static const double BUDGET = 0.25; // of a measurement [s]; of the bodies, of all together
// What the ticks of a scene may take of the time that they have: presses elsewhere add up to a
// third, and whatever else the machine does needs the rest.
static const double FITS = 0.5, TIGHT = 0.9;

static const char *verdict(double share)
{
    return share <= FITS ? "fits" : share <= TIGHT ? "tight" : "misses";
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// --- pressing ------------------------------------------------------------------------------------

// Where a tool presses a body: from above, at the highest node that may move.
typedef struct Press {
    bool found;
    Vec3 top;     // [m]
    double depth; // at the end [m]
} Press;

static Press find_press(const Body *body)
{
    const BodySurface *surface = &body->surface;
    const BodyOutline outline = body_outline(body);
    Press press = {.depth = 0.05 * box_extent(&outline.box)};
    for (int i = 0; i < surface->node_used; i++) {
        Vec3 at;
        if (surface->node_face_end[i] <= surface->node_face_start[i] ||
            body->ops->is_fixed(body->model, i))
            continue;
        body->ops->read_nodes(body->model, &i, 1, &at, NULL);
        if (!press.found || at.z > press.top.z)
            press.top = at;
        press.found = true;
    }
    return press;
}

// Returns the lowest point of a tool in its own frame.
static Vec3 lowest_point(const ToolOptions *tool)
{
    Vec3 lowest = {0.0, 0.0, HUGE_VAL};
    for (int i = 0; i < tool->capsule_count; i++) {
        const Capsule *c = &tool->capsule[i];
        Vec3 end = c->from.z <= c->to.z ? c->from : c->to;
        end.z -= c->radius;
        if (end.z < lowest.z)
            lowest = end;
    }
    return lowest;
}

// Moves every probe and grasper towards a body each, from `depth` above it to `depth` inside.
// Returns false if the scene has none.
static bool move_tools(Sim *sim, const Press *press, double part)
{
    bool any = false;
    for (int t = 0; t < sim_tool_count(sim); t++) {
        const ToolOptions *tool = sim_tool(sim, t);
        const Press *at = &press[t % sim_body_count(sim)];
        if ((tool->kind != TOOL_PROBE && tool->kind != TOOL_GRASPER) || tool->capsule_count == 0 ||
            !at->found)
            continue;
        any = true;
        const Vec3 above = {0.0, 0.0, at->depth * (1.0 - 2.0 * part)};
        const ToolPose pose = {
            .position = vec3_add(vec3_sub(at->top, lowest_point(tool)), above),
            .orientation = {1.0, 0.0, 0.0, 0.0},
            .active = true,
        };
        sim_apply_pose(sim, t, &pose, false);
    }
    return any;
}

// --- measuring -----------------------------------------------------------------------------------

// What the whole scene does meanwhile.
enum { RESTS, PRESSED, REFINED, OPENED, KINDS };

// The time of a tick [s]: of the processor, and by the clock, where other programs ran meanwhile.
typedef struct Duration {
    double busy, passed;
} Duration;

static double median(double *time, int count)
{
    qsort(time, (size_t)count, sizeof *time, by_size);
    return time[count / 2];
}

static void print_duration(const char *comma, const Duration *time, const char *what, FILE *out)
{
    fprintf(out, "%s%.3g (%.3g by the clock) ms%s", comma, 1e3 * time->busy, 1e3 * time->passed,
            what);
}

// Steps a world for a while: at rest, or with tools that come down if `press` is given, or a body
// (unless -1) alone. Returns the medians of a tick; of a press those of the second half, when the
// tools have arrived.
static Duration measure(Sim *sim, int body, const Press *press, double budget)
{
    double busy[TICKS_MOST], passed[TICKS_MOST];
    const int64_t begin = clock_now_ns();
    double spent = 0.0;
    int count = 0;
    for (int i = -TICKS_WARM_UP; i < TICKS_MOST; i++) {
        // Tools of slow scenes, which have few ticks, are as fast as the time runs out.
        const double part = fmax(fmax((double)i / TICKS_MOST, spent / budget), 0.0);
        if (press != NULL)
            move_tools(sim, press, fmin(part, 1.0));
        const int64_t start = clock_now_ns(), start_busy = clock_thread_ns();
        if (body < 0)
            sim_step(sim);
        else
            sim_step_alone(sim, body);
        const int64_t end_busy = clock_thread_ns(), end = clock_now_ns();
        if (i >= 0) {
            busy[count] = 1e-9 * (double)(end_busy - start_busy);
            passed[count++] = 1e-9 * (double)(end - start);
        }
        spent = 1e-9 * (double)(end - begin);
        if (count >= TICKS_LEAST && spent > budget)
            break;
    }
    const int first = press != NULL ? count / 2 : 0;
    return (Duration){median(busy + first, count - first), median(passed + first, count - first)};
}

// Deepens the bodies of a scene that adapt to their finest level. Returns false if there are none.
static bool refine(Scene *scene)
{
    bool any = false;
    for (int i = 0; i < scene->body_count; i++) {
        SurfaceOptions *surface = &scene->body[i].surface;
        if (scene->body[i].model != MODEL_SURFACE || !surface->adaptive)
            continue;
        surface->start_level = surface->adapt.coarsest = surface->body.levels;
        any = true;
    }
    return any;
}

// Cuts every body that may be cut from three sides nearly to its middle, where it holds together.
// Returns false if none was cut.
static bool cut(Sim *sim)
{
    const double pi = 3.14159265358979323846, inner = 0.1;
    bool any = false;
    for (int k = 0; k < 3 * sim_body_count(sim); k++) {
        const BodyOutline outline = body_outline(sim_body(sim, k / 3));
        const Vec3 low = box_low(&outline.box), high = box_high(&outline.box),
                   middle = vec3_scale(0.5, vec3_add(low, high)), up = {0.0, 0.0, high.z - low.z};
        // Off the axes, along which cells and the edges of spheres lie.
        const double angle = 0.3 + 2.0 / 3.0 * pi * (k % 3), far = vec3_length(vec3_sub(high, low));
        const Vec3 out = vec3_scale(far, vec3(cos(angle), sin(angle), 0.0));
        const BladeEdge edge = {{vec3_sub(middle, up), vec3_add(middle, up)}};
        CutOptions sweep = {.body = k / 3, .before = edge, .after = edge};
        for (int e = 0; e < 2; e++) {
            sweep.before.end[e] = vec3_add(edge.end[e], out);
            sweep.after.end[e] = vec3_add(edge.end[e], vec3_scale(inner, out));
        }
        char why[SIM_EVENT_TEXT];
        CutOutcome outcome;
        any |= sim_apply_cut(sim, &sweep, &outcome, why, sizeof why);
    }
    return any;
}

// The same at rest of another world of the scene, refined or cut; 0: nothing of it can be, or it
// cannot be built.
static Duration measure_changed(const Scene *scene, const BuildOptions *options, bool cuts)
{
    Scene changed = *scene;
    const size_t bytes = (size_t)scene->body_count * sizeof *changed.body;
    changed.body = malloc(bytes);
    ASSERT(changed.body != NULL);
    memcpy(changed.body, scene->body, bytes);
    bool may = !cuts && refine(&changed);
    for (int i = 0; i < scene->body_count; i++)
        may |= cuts && scene->body[i].options.cuttable;
    World world = {0};
    Status status = {0};
    Duration time = {0};
    log_set_level(LOG_ERROR); // what it warns of was said of the first
    if (may && world_build(&world, &changed, options, &status) &&
        realtime_start_team(world.team, false, &status) && (!cuts || cut(world.sim)))
        time = measure(world.sim, -1, NULL, BUDGET);
    if (may)
        world_destroy(&world);
    free(changed.body);
    return time;
}

// --- advice --------------------------------------------------------------------------------------

typedef struct Costly {
    const Scene *scene;
    const SceneBody *described;
    const Body *body;
} Costly;

static bool is_surface(const Costly *c)
{
    return c->described->model == MODEL_SURFACE;
}

static bool is_explicit_surface(const Costly *c)
{
    return is_surface(c) && c->body->integrator != INTEGRATOR_IMPLICIT;
}

static bool gains_by_implicit(const Costly *c)
{
    return is_explicit_surface(c) &&
           cost_tick(c->body, c->body->substeps) > cost_implicit(c->body->spring_count);
}

static bool is_rk4(const Costly *c)
{
    return is_explicit_surface(c) && integrator_get(c->body->integrator)->evaluation_count > 1;
}

static bool is_double(const Costly *c)
{
    return c->body->integrator != INTEGRATOR_IMPLICIT && c->scene->precision == PRECISION_DOUBLE;
}

static bool has_fine_levels(const Costly *c)
{
    return is_surface(c) && c->described->options.levels > 0;
}

static bool is_adaptive(const Costly *c)
{
    return is_surface(c) && c->described->surface.adaptive;
}

// A solid of many elements that could adapt, and does not.
static bool gains_by_adapting(const Costly *c)
{
    const SceneBody *body = c->described;
    return body->model == MODEL_VOXEL && body->voxel.surface_level == 0 &&
           body->voxel.law == VOXEL_AFFINE && body->skin.file == NULL && body->initial == NULL &&
           body->voxel.weight_count == 0 && c->scene->publish.nodes != NODES_ALL &&
           c->body->element_count >= 4000;
}

static bool has_equal_cells(const Costly *c)
{
    return !is_surface(c) && c->described->options.levels < 2;
}

static bool is_solid(const Costly *c)
{
    return !is_surface(c);
}

// Sizes from which threads share the work of a body.
static bool gains_by_threads(const Costly *c)
{
    return c->scene->threads < 2 && sysconf(_SC_NPROCESSORS_ONLN) > 1 &&
           (c->body->spring_count >= 3000 || c->body->element_count >= 2000);
}

// What makes a tick of a body cheaper, the most effective first.
static const struct {
    bool (*helps)(const Costly *costly);
    const char *text;
} ADVICE[] = {
    {gains_by_implicit, "integrator = \"implicit\" (contacts are as stiff as its step allows)"},
    {has_fine_levels, "fewer levels"},
    {is_adaptive, "a smaller capacity"},
    {is_surface, "a coarser mesh (edges of twice the length: an eighth of the time)"},
    {gains_by_implicit, "a solid from the same mesh if it is closed (model = \"voxel\")"},
    {gains_by_adapting,
     "levels = { inside = 2; surface = 2; } (small elements around tools alone)"},
    {is_solid, "larger cells (of twice the size: about a tenth of the time)"},
    {has_equal_cells, "levels = 2 (larger elements inside)"},
    {is_rk4, "integrator = \"leapfrog\""},
    {is_double, "precision = \"single\""},
    {gains_by_threads, "threads = 2"},
};

static void print_advice(const Costly *costly, FILE *out)
{
    fprintf(out, "try for body %s: ", costly->body->name);
    for (size_t i = 0; i < sizeof ADVICE / sizeof *ADVICE; i++)
        if (ADVICE[i].helps(costly))
            fprintf(out, "%s; ", ADVICE[i].text);
    fprintf(out, "a lower rate_hz");
}

// --- all of it -----------------------------------------------------------------------------------

// Prints a line for each body, and returns the costliest.
static int print_bodies(Sim *sim, FILE *out)
{
    const int count = sim_body_count(sim);
    const double tick = sim_tick(sim);
    double most = 0.0;
    int costliest = 0;
    for (int i = 0; i < count; i++) {
        const Duration time = measure(sim, i, NULL, BUDGET / count);
        fprintf(out, "time of a tick of body %s alone: ", sim_body(sim, i)->name);
        print_duration("", &time, "", out);
        fprintf(out, " of %.3g ms: %s\n", 1e3 * tick, verdict(time.busy / tick));
        costliest = time.busy > most ? i : costliest;
        most = fmax(most, time.busy);
    }
    return costliest;
}

// Prints what was measured of the whole scene, and returns the longest [s].
static double print_times(const Duration time[KINDS], FILE *out)
{
    static const char *const kinds[KINDS] = {" at rest", " pressed by its tools",
                                             " with all faces at the finest level",
                                             " after three deep cuts"};
    double most = 0.0;
    fprintf(out, "time of a tick on this machine: ");
    for (int k = 0; k < KINDS; k++) {
        if (time[k].passed > 0.0)
            print_duration(k > 0 ? ", " : "", &time[k], kinds[k], out);
        most = fmax(most, time[k].busy);
    }
    return most;
}

bool explain_time(World *world, const Scene *scene, const BuildOptions *options, FILE *out,
                  Status *status)
{
    Sim *sim = world->sim;
    const double tick = sim_tick(sim);
    Press *press = calloc((size_t)sim_body_count(sim), sizeof *press);
    ASSERT(press != NULL);
    for (int i = 0; i < sim_body_count(sim); i++)
        press[i] = find_press(sim_body(sim, i));
    // With the threads that a run has.
    const bool whole = realtime_start_team(world->team, false, status);
    if (whole) {
        realtime_pin_step(world->team, pthread_self());
        sim_set_lockstep(sim, true); // tools do not become stale
        // The whole scene last: what to do about it depends on the bodies.
        Duration time[KINDS] = {measure(sim, -1, NULL, BUDGET)};
        if (move_tools(sim, press, 0.0))
            time[PRESSED] = measure(sim, -1, press, BUDGET);
        const int costliest = print_bodies(sim, out);
        time[REFINED] = measure_changed(scene, options, false);
        time[OPENED] = measure_changed(scene, options, true);
        const double share = print_times(time, out) / tick;
        fprintf(out, ", of %.3g ms: %s", 1e3 * tick, verdict(share));
        if (share > FITS) {
            fprintf(out, ": ");
            print_advice(&(Costly){scene, &scene->body[costliest], sim_body(sim, costliest)}, out);
        }
        fputc('\n', out);
    }
    free(press);
    return whole;
}
