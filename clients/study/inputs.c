#include "study/inputs.h"

#include "study/press.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
    for (int k = 0; k < context->scene.load_count; k++) {
        const LoadOptions *load = &context->scene.load[k].load;
        double end = load->start + load->duration;
        inputs->end_s = fmax(inputs->end_s, load->duration > LASTING_S ? load->start + 1.0 : end);
    }
    if (context->scene.load[0].load.body >= 0)
        context->body = context->scene.load[0].load.body;
    inputs->center = context->scene.load[0].load.center;
    inputs->radius = context->scene.load[0].load.radius;
    say(context, "the scene's own loads, %d of them, until %g s", context->scene.load_count,
        inputs->end_s);
}

static int find_tool(const Scene *scene)
{
    static const ToolKind order[] = {TOOL_PROBE, TOOL_GRASPER, TOOL_BLADE};
    for (size_t k = 0; k < sizeof order / sizeof *order; k++)
        for (int t = 0; t < scene->tool_count; t++)
            if (scene->tool[t].kind == order[k] && scene->tool[t].capsule_count > 0)
                return t;
    return -1;
}

static bool is_moved(const StudyContext *context)
{
    return vec3_length(context->scene.gravity) > 0.0 && !(context->scene.settle_s > 0.0);
}

// Returns a force that visibly deforms a body of this size and stiffness, by a few hundredths.
static double gentle_force(const StudyContext *context)
{
    const SceneBody *body = &context->scene.body[context->body];
    const SurfaceMaterial *wall = &body->surface.material;
    if (body->model == MODEL_VOXEL)
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
    double force = gentle_force(context);
    load->load = (LoadOptions){.body = context->body,
                               .center = site->point,
                               .radius = fmax(0.2 * context->extent, 1.5 * site->edge),
                               .force = vec3_scale(force, site->inward),
                               .duration = 0.3};
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
    int tool = find_tool(&context->scene);
    if (tool < 0 && is_moved(context)) {
        inputs->drive = DRIVE_LOADS;
        inputs->radius = HUGE_VAL;
        inputs->end_s = 1.0;
        say(context, "its own weight, from where the scene puts it; the patch is all of it");
        return true;
    }
    if (!press_find_site(sim_body(world->sim, context->body), context->plane, &site))
        return status_fail(status, STATUS_INVALID, "%s: body %s has no free node to press on",
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
