// SPDX-License-Identifier: MIT
// The inputs of a scene, and the built-in press.
#include "study/inputs.h"

#include "body/body.h"
#include "geometry/box.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// --- the built-in press --------------------------------------------------------------------------

static const double DEPTH = 0.1;  // as a fraction of the body's thickness
static const double CLEAR = 0.05; // as a fraction of it, before the tool starts

static const double FLAT = 0.05; // as a fraction of the extent: no thickness

static bool has_faces(const Body *body, int node)
{
    return body->surface.node_face_end[node] > body->surface.node_face_start[node];
}

static Vec3 position_of(const Body *body, int node)
{
    Vec3 x;
    body->ops->read_nodes(body->model, &node, 1, &x, NULL);
    return x;
}

double press_extent(const Body *body, double *thickness)
{
    Box box = box_empty();
    for (int i = 0; i < body->surface.node_used; i++)
        if (has_faces(body, i))
            box_add(&box, position_of(body, i));
    const double extent = fmax(0.0, box_extent(&box));
    *thickness = extent;
    for (int k = 0; k < 3; k++)
        if (box.high[k] - box.low[k] > FLAT * extent) // a sheet is as thick as it is long
            *thickness = fmin(*thickness, box.high[k] - box.low[k]);
    return extent;
}

// Finds the mean positions of all nodes and of the fixed ones.
static int find_middles(const Body *body, Vec3 *middle, Vec3 *held)
{
    int count = 0, held_count = 0;
    *middle = *held = (Vec3){0.0, 0.0, 0.0};
    // Sums over the surface: all nodes, and the fixed ones.
    for (int i = 0; i < body->surface.node_used; i++) {
        if (!has_faces(body, i))
            continue;
        Vec3 x = position_of(body, i);
        *middle = vec3_add(*middle, x);
        count++;
        if (!body->ops->is_fixed(body->model, i))
            continue;
        *held = vec3_add(*held, x);
        held_count++;
    }
    // Means of both.
    *middle = vec3_scale(1.0 / fmax(count, 1), *middle);
    *held = vec3_scale(1.0 / fmax(held_count, 1), *held);
    return held_count;
}

// Returns the mean outward normal of the faces around a node.
static Vec3 normal_at(const Body *body, int node)
{
    const BodySurface *surface = &body->surface;
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int k = surface->node_face_start[node]; k < surface->node_face_end[node]; k++) {
        const int *corner = surface->face[surface->node_face[k]];
        Vec3 x[3];
        body->ops->read_nodes(body->model, corner, 3, x, NULL);
        sum = vec3_add(sum, vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0])));
    }
    return vec3_unit(sum);
}

bool press_find_site(const Body *body, bool plane, PressSite *site)
{
    // From the middle of what is fixed to the middle of all: there the body yields most.
    Vec3 middle, held;
    int node = -1;
    double extent = press_extent(body, &site->thickness);
    int held_count = find_middles(body, &middle, &held);
    Vec3 away = vec3_sub(middle, held);
    if (plane)
        away.z = 0.0;
    // Fixed all around, or not at all: press from above.
    if (held_count == 0 || vec3_length(away) < 0.01 * extent)
        away = plane ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0);
    away = vec3_unit(away);
    // The node farthest in that direction, and little to its side.
    double best = -HUGE_VAL;
    for (int i = 0; i < body->surface.node_used; i++) {
        if (!has_faces(body, i) || body->ops->is_fixed(body->model, i))
            continue;
        Vec3 arm = vec3_sub(position_of(body, i), middle);
        double along = vec3_dot(arm, away);
        double beside = vec3_length(vec3_sub(arm, vec3_scale(along, away)));
        if (along - beside <= best)
            continue;
        best = along - beside;
        node = i;
    }
    if (node < 0)
        return false;
    site->point = position_of(body, node);
    if (plane) { // faces of a plane body have no usable normal
        site->inward = vec3_sub(middle, site->point);
        site->inward.z = site->point.z = 0.0;
        site->inward = vec3_unit(site->inward);
    } else { // along the normal, so that the tool does not slip off
        site->inward = vec3_scale(-1.0, normal_at(body, node));
    }
    site->edge = body->surface.longest_edge;
    return true;
}

int press_find_tool(const Scene *scene)
{
    static const ToolKind order[] = {TOOL_PROBE, TOOL_GRASPER, TOOL_BLADE};
    for (size_t k = 0; k < sizeof order / sizeof *order; k++)
        for (int t = 0; t < scene->tool_count; t++)
            if (scene->tool[t].kind == order[k] && scene->tool[t].capsule_count > 0)
                return t;
    return -1;
}

double press_depth(const PressSite *site)
{
    return DEPTH * site->thickness;
}

// Returns the shortest rotation from one unit vector to another.
static Quat turn_to(Vec3 from, Vec3 to)
{
    Vec3 axis = vec3_cross(from, to);
    double sine = vec3_length(axis), angle = atan2(sine, vec3_dot(from, to));
    if (sine < 1e-9) { // equal or opposite: rotate about any perpendicular axis
        Vec3 across = fabs(from.x) < 0.7 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
        axis = vec3_cross(from, across);
        sine = vec3_length(axis);
    }
    return quat_from_rotation(vec3_scale(angle / sine, axis));
}

void press_plan(StudyPress *press, int tool, const ToolOptions *options, const PressSite *site,
                bool plane)
{
    const Capsule *tip = &options->capsule[0];
    Vec3 shaft = vec3_sub(tip->to, tip->from), at = tip->from;
    press->tool = tool;
    press->orientation = (Quat){1.0, 0.0, 0.0, 0.0};
    press->inward = site->inward;
    // The shaft points outwards.
    if (!plane && vec3_length(shaft) > 0.0)
        press->orientation = turn_to(vec3_unit(shaft), vec3_scale(-1.0, site->inward));
    if (plane && tip->from.z * tip->to.z < 0.0) // the point where its axis intersects the plane
        at = vec3_madd(tip->from, -tip->from.z / shaft.z, shaft);
    // Clear of the surface, then in.
    double clear = CLEAR * site->thickness;
    Vec3 tip_at = vec3_madd(site->point, -(tip->radius + clear), site->inward);
    press->start = vec3_sub(tip_at, quat_rotate(press->orientation, at));
    press->way = clear + press_depth(site);
    press->down_s = 0.2;
    press->hold_s = 0.2;
    press->back_s = 0.2;
}

static double smooth_way(const StudyPress *press, double time)
{
    const double pi = 3.14159265358979323846;
    double back = time - press->down_s - press->hold_s;
    double s = fmin(fmax(time / press->down_s, 0.0), 1.0);
    if (back > 0.0)
        s = 1.0 - fmin(back / press->back_s, 1.0);
    return press->way * 0.5 * (1.0 - cos(pi * s));
}

double press_way_at(const StudyPress *press, double time, double knot_s)
{
    // Tolerate rounding: a tick that ends at a knot must not use the next segment.
    double knot = floor(time / knot_s + 1e-9);
    double from = smooth_way(press, knot * knot_s), to = smooth_way(press, (knot + 1.0) * knot_s);
    return from + (to - from) * fmax(time / knot_s - knot, 0.0);
}

// --- inputs --------------------------------------------------------------------------------------

// Loads that last longer count as permanent.
static const double LASTING_S = 30.0;

static void say(StudyContext *context, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static void say(StudyContext *context, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(context->inputs.text, sizeof context->inputs.text, format, arguments);
    va_end(arguments);
}

static void use_loads(StudyContext *context)
{
    StudyInputs *inputs = &context->inputs;
    inputs->drive = DRIVE_LOADS;
    inputs->end_s = 0.0;
    // Loads that last for the whole run end it a little after they start.
    for (int k = 0; k < context->scene.load_count; k++) {
        const LoadOptions *load = &context->scene.load[k].load;
        double end = load->start + load->duration;
        inputs->end_s = fmax(inputs->end_s, load->duration > LASTING_S ? load->start + 1.0 : end);
    }
    // The first one is where the patch is.
    if (context->scene.load[0].load.body >= 0)
        context->body = context->scene.load[0].load.body;
    inputs->center = context->scene.load[0].load.center;
    inputs->radius = context->scene.load[0].load.radius;
    say(context, "the scene's own loads, %d of them, until %g s", context->scene.load_count,
        inputs->end_s);
}

static bool is_moved(const StudyContext *context)
{
    return vec3_length(context->scene.sim.gravity) > 0.0 && !(context->scene.settle_s > 0.0);
}

// Returns a force that visibly deforms a body of this size and stiffness, by a few hundredths.
static double gentle_force(const StudyContext *context)
{
    const SceneBody *body = &context->scene.body[context->body];
    const SurfaceMaterial *wall = &body->surface.material;
    if (scene_has_cells(body))
        return 0.02 * body->material[0].youngs_modulus * context->extent * context->extent;
    return 0.05 * context->extent *
           (wall->uniform ? wall->spring_stiffness : wall->youngs_modulus_2d);
}

// Adds a load if nothing else moves the body.
static bool add_load(StudyContext *context, const PressSite *site, Status *status)
{
    SceneLoad *load = calloc(1, sizeof *load);
    if (load == NULL)
        return status_fail(status, STATUS_FAILED, "out of memory");
    // Gentle, and wide enough to be seen by every mesh.
    double force = gentle_force(context);
    load->load = (LoadOptions){.body = context->body,
                               .center = site->point,
                               .radius = fmax(0.2 * context->extent, 1.5 * site->edge),
                               .force = vec3_scale(force, site->inward),
                               .duration = 0.3};
    // The study's own scene has it, and owns it.
    context->own_load = load;
    context->scene.load = load;
    context->scene.load_count = 1;
    use_loads(context);
    say(context, "a built-in load of %.3g N on the side away from what holds the body, for %g s",
        force, load->load.duration);
    return true;
}

// --- a log ---

// Runs the scene once to find where and until when the log drives it.
static bool use_log(StudyContext *context, World *world, Status *status)
{
    StudyInputs *inputs = &context->inputs;
    Sim *sim = world->sim;
    StudyPlay play;
    // A log decides on its own when it ends.
    inputs->drive = DRIVE_LOG;
    inputs->log = context->options.input_log;
    inputs->radius = HUGE_VAL;
    if (!study_play_begin(&play, context, world, &context->scene, status))
        return false;
    double most = context->options.duration_s > 0.0 ? context->options.duration_s : 600.0;
    bool touched = false;
    // Run to the log's end; the first contact of a moved tool is the centre of the patch.
    while (study_play_tick(&play) && sim_time(sim) < most &&
           (play.replay->waiting || (play.log.ended && sim_steps(sim) < play.replay->end_step))) {
        sim_step(sim);
        for (int t = 0; t < sim_tool_count(sim) && !touched; t++) {
            const ToolWrench *wrench = sim_wrench(sim, t);
            if (!wrench->contact || sim_tool(sim, t)->kind == TOOL_STATIC)
                continue;
            touched = true;
            inputs->center = wrench->point;
            inputs->radius = 0.1 * context->extent;
        }
    }
    // The end of the log is the end of all inputs.
    inputs->end_s = sim_time(sim);
    say(context, "the log %s, until %.3g s; %s", inputs->log, inputs->end_s,
        touched ? "the patch is where a tool first touched" : "the patch is the whole surface");
    study_play_end(&play);
    return true;
}

bool study_choose_inputs(StudyContext *context, World *world, Status *status)
{
    PressSite site;
    StudyInputs *inputs = &context->inputs;
    // In order of preference: a log, loads, the scene's own motion, a press by its tool, a load.
    if (context->options.input_log != NULL)
        return use_log(context, world, status);
    if (context->scene.load_count > 0) {
        use_loads(context);
        return true;
    }
    // Without a tool the scene's own motion is enough.
    int tool = press_find_tool(&context->scene);
    if (tool < 0 && is_moved(context)) {
        inputs->drive = DRIVE_LOADS;
        inputs->radius = HUGE_VAL;
        inputs->end_s = 1.0;
        say(context, "its own weight, from where the scene puts it; the patch is all of it");
        return true;
    }
    // Else press where the body yields: by the tool, or by a load where there is none.
    if (!press_find_site(sim_body(world->sim, context->body), context->plane, &site))
        return status_fail(status, STATUS_INVALID,
                           "%s: body %s has no free node to press on: all are fixed",
                           context->given->path, context->scene.body[context->body].name);
    if (tool < 0)
        return add_load(context, &site, status);
    press_plan(&inputs->press, tool, &context->scene.tool[tool], &site, context->plane);
    inputs->drive = DRIVE_PRESS;
    inputs->center = site.point;
    inputs->radius = fmax(2.0 * context->scene.tool[tool].capsule[0].radius, site.edge);
    inputs->end_s = inputs->press.down_s + inputs->press.hold_s + inputs->press.back_s;
    say(context, "a built-in press: tool %d comes down %.3g mm deep in %g s, stays %g s, goes back",
        context->scene.tool[tool].id, 1e3 * press_depth(&site), inputs->press.down_s,
        inputs->press.hold_s);
    return true;
}

// --- replay ---

// Sends the tool's pose for the next tick: its current position and the straight line to that at
// the end of the tick, which is exact within a tick.
static void send_pose(StudyPlay *play)
{
    const StudyContext *context = play->context;
    const StudyPress *press = &context->inputs.press;
    double tick = sim_tick(play->sim), now = sim_time(play->sim);
    // Here and at the end of the tick, so that the tool moves as it says.
    double here = press_way_at(press, now, context->sample_s);
    double there = press_way_at(press, now + tick, context->sample_s);
    ToolPose pose = {.utime = llround(now * 1e6),
                     .position = vec3_madd(press->start, here, press->inward),
                     .orientation = press->orientation,
                     .linear = vec3_scale((there - here) / tick, press->inward),
                     .twist_valid = true,
                     .active = true};
    sim_apply_pose(play->sim, press->tool, &pose, false);
}

bool study_play_begin(StudyPlay *play, const StudyContext *context, World *world,
                      const Scene *scene, Status *status)
{
    *play = (StudyPlay){.context = context, .sim = world->sim};
    sim_set_lockstep(world->sim, false);
    // Only a log needs more than the time.
    if (context->inputs.drive != DRIVE_LOG)
        return true;
    play->replay = malloc(sizeof *play->replay);
    if (play->replay == NULL)
        return status_fail(status, STATUS_FAILED, "out of memory");
    const ReplayOptions options = {.input = &play->log, .any_rate = true, .quiet = true};
    play->has_log = input_log_open(&play->log, context->inputs.log, status);
    if (play->has_log && replay_begin(play->replay, world, scene, INT64_MAX / 2, &options, status))
        return true;
    study_play_end(play);
    return false;
}

bool study_play_tick(StudyPlay *play)
{
    if (play->context->inputs.drive == DRIVE_PRESS)
        send_pose(play);
    if (play->replay == NULL)
        return true;
    replay_due(play->replay);
    return !play->replay->stopped;
}

void study_play_end(StudyPlay *play)
{
    if (play->has_log)
        input_log_close_reader(&play->log);
    free(play->replay);
    *play = (StudyPlay){0};
}
