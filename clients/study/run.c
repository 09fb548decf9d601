// SPDX-License-Identifier: MIT
// Runs cases.
#include "study/run.h"

#include "base/clock.h"
#include "base/sets.h"
#include "run/realtime.h"
#include "study/inputs.h"
#include "study/pool.h"
#include "study/sampler.h"
#include "study/context.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// --- adaptive steps ------------------------------------------------------------------------------

enum { MOST_TRIES = 6 };
// Factor on the substeps of the stability bound: where contacts begin and end no step is short
// enough.
enum { MOST_FINER = 32 };
// The constants of Numerical Recipes, which keep the step from oscillating.
static const double SAFETY = 0.9, SHRINK = -0.25, GROW = -0.2, MOST_CHANGE = 5.0;

bool step_doubling_create(StepDoubling *doubling, World *world, int body, double tolerance)
{
    const Body *of = sim_body(world->sim, body);
    size_t rows = (size_t)of->state_capacity;
    *doubling = (StepDoubling){
        .world = world, .body = body, .tolerance = tolerance, .substeps = of->substeps};
    doubling->most_substeps = MOST_FINER * of->substeps;
    // Memory for the state and for both results.
    doubling->before = malloc(state_bytes(&world->state));
    doubling->coarse = calloc(rows, sizeof(Vec3));
    doubling->fine = calloc(rows, sizeof(Vec3));
    doubling->velocity = calloc(rows, sizeof(Vec3));
    if (doubling->before != NULL && doubling->coarse != NULL && doubling->fine != NULL &&
        doubling->velocity != NULL)
        return true;
    step_doubling_destroy(doubling);
    return false;
}

void step_doubling_destroy(StepDoubling *doubling)
{
    free(doubling->before);
    free(doubling->coarse);
    free(doubling->fine);
    free(doubling->velocity);
    *doubling = (StepDoubling){0};
}

// Computes one tick with so many substeps. Sets them as an unsafe request, which stays valid if the
// topology changes within the tick.
static int64_t pass(StepDoubling *doubling, int substeps, Vec3 *position, int64_t *resets)
{
    Sim *sim = doubling->world->sim;
    Body *body = sim_body(sim, doubling->body);
    int64_t resets_before = sim_resets(sim);
    // The step of this pass, whatever the body would choose.
    body->unsafe_time_step = true;
    body->time_step_wanted = sim_tick(sim) / substeps;
    body->substeps = substeps;
    body->h = sim_tick(sim) / substeps;
    // Only the step itself counts.
    int64_t begin = clock_thread_ns();
    sim_step(sim);
    int64_t spent = clock_thread_ns() - begin;
    doubling->rows = body->ops->read_state(body->model, NULL, position, doubling->velocity);
    *resets = sim_resets(sim) - resets_before;
    doubling->passes++;
    return spent;
}

static double largest_difference(const Vec3 *a, const Vec3 *b, int count)
{
    double worst = 0.0;
    for (int i = 0; i < count; i++)
        worst = fmax(worst, vec3_length(vec3_sub(a[i], b[i])));
    return worst;
}

// Returns the substeps for a difference equal to the tolerance, given those that made `difference`.
static int choose(const StepDoubling *doubling, double difference)
{
    double ratio = difference / doubling->tolerance;
    double change = ratio > 1.0 ? pow(ratio, SHRINK) : pow(fmax(ratio, 1e-12), GROW);
    change = fmin(fmax(SAFETY * change, 1.0 / MOST_CHANGE), MOST_CHANGE); // factor on the step
    double substeps = ceil(doubling->substeps / change);
    if (ratio > 1.0)
        substeps = fmax(substeps, doubling->substeps + 1.0);
    return (int)fmin(fmax(substeps, 1.0), doubling->most_substeps);
}

int64_t step_doubling_step(StepDoubling *doubling)
{
    World *world = doubling->world;
    int64_t spent = 0, coarse_resets, fine_resets;
    // Both passes start from the same state.
    state_copy_out(&world->state, doubling->before);
    for (int tries = 0;; tries++) {
        spent += pass(doubling, doubling->substeps, doubling->coarse, &coarse_resets);
        state_copy_in(&world->state, doubling->before);
        sim_restored(world->sim);
        spent += pass(doubling, 2 * doubling->substeps, doubling->fine, &fine_resets);
        // Rows are the same nodes in both passes: adaptation happens before the substeps.
        double difference = largest_difference(doubling->coarse, doubling->fine, doubling->rows);
        if (coarse_resets + fine_resets > 0 || !isfinite(difference))
            difference = HUGE_VAL;
        // After many tries the step is accepted as it is.
        bool accepted = difference <= doubling->tolerance || tries + 1 >= MOST_TRIES;
        if (accepted) {
            doubling->worst = fmax(doubling->worst, difference);
            doubling->resets += fine_resets;
        }
        // The next tick begins with what this one would have needed.
        doubling->substeps = choose(doubling, difference);
        if (accepted)
            return spent;
        doubling->refused++;
        // Again, from the start.
        state_copy_in(&world->state, doubling->before);
        sim_restored(world->sim);
    }
}

// --- cases ---------------------------------------------------------------------------------------

static const double FAR = 100.0; // extents of the body: larger motion is a failure
static const double REPEAT_UP_TO = 20.0, QUICKLY_UP_TO = 2.0; // [s] of all repeats together

// One run of a case.
typedef struct Once {
    const StudyContext *context;
    const StudyCase *what;
    StudyRun *run;
    StudyTrace *trace; // or NULL
    bool estimates;    // its bodies estimate their errors
    double *tick_s;    // [tick_count] CPU time of each tick
    int tick_count;
    double cpu_s; // of all
} Once;

static void set_verdict(StudyRun *run, StudyVerdict verdict, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// Keeps the first verdict.
static void set_verdict(StudyRun *run, StudyVerdict verdict, const char *format, ...)
{
    if (run->verdict != STUDY_OK)
        return;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(run->why, sizeof run->why, format, arguments);
    va_end(arguments);
    run->verdict = verdict;
}

// Measures the cost of reading the clock [ns].
static int64_t clock_cost(void)
{
    int64_t least = INT64_MAX;
    for (int i = 0; i < 100; i++) {
        int64_t begin = clock_thread_ns(), spent = clock_thread_ns() - begin;
        least = spent < least ? spent : least;
    }
    return least;
}

// Returns the time of a tick, without that of estimates which the motion does not depend on.
static int64_t step(Sim *sim, int body, StepDoubling *doubling)
{
    double driven;
    if (doubling != NULL)
        return step_doubling_step(doubling);
    const Body *of = sim_body(sim, body);
    const bool counts = of->ops->get(of->model, BODY_ADAPT_ERROR, &driven);
    const int64_t before = sim_stage_ns(sim, STAGE_ERROR);
    const int64_t wall = clock_now_ns(), begin = clock_thread_ns();
    sim_step(sim);
    const int64_t spent = clock_thread_ns() - begin, passed = clock_now_ns() - wall;
    // Stages are timed by the clock on the wall: the same share of both is theirs.
    const double share = (double)(sim_stage_ns(sim, STAGE_ERROR) - before) / (double)passed;
    return counts ? spent : (int64_t)((1.0 - fmin(1.0, share)) * (double)spent);
}

static bool went_well(Once *once, const Sampler *sampler, bool finite, int64_t resets, double now)
{
    StudyRun *run = once->run;
    if (resets > 0)
        set_verdict(run, STUDY_BAD, "bad numbers at %.4g s: the state was reset", now);
    else if (!finite)
        set_verdict(run, STUDY_BAD, "a number is not finite at %.4g s", now);
    else if (sampler->moved > FAR * once->context->extent)
        set_verdict(run, STUDY_BAD, "a point moved %.3g m by %.4g s", sampler->moved, now);
    else if (once->cpu_s > once->context->limit_s)
        set_verdict(run, STUDY_SKIPPED, "took more than %g s for %.4g simulated s",
                    once->context->limit_s, now);
    return run->verdict == STUDY_OK;
}

// Runs a world to the end of its inputs.
static void play(Once *once, World *world, StudyPlay *inputs, Sampler *sampler,
                 StepDoubling *doubling)
{
    Sim *sim = world->sim;
    // Times are without the cost of the clock.
    const int64_t cost = clock_cost();
    const int ticks_per_sample = (int)lround(once->context->sample_s / sim_tick(sim));
    bool goes_on = true;
    for (int s = 0; s < once->context->sample_count && goes_on; s++) {
        for (int k = 0; k < ticks_per_sample; k++) {
            study_play_tick(inputs);
            int64_t spent = step(sim, once->context->body, doubling) - cost;
            double seconds = 1e-9 * (double)(spent > 0 ? spent : 0);
            once->tick_s[once->tick_count++] = seconds;
            once->cpu_s += seconds;
            sampler_feel(sampler);
        }
        // A sample at each of the study's times.
        SimEvent event;
        while (sim_take_event(sim, &event)) // events are discarded
            ;
        bool finite = sampler_take(sampler, once->trace);
        if (once->estimates)
            sampler_estimate(sampler);
        int64_t resets = doubling != NULL ? doubling->resets : sim_resets(sim);
        goes_on = went_well(once, sampler, finite, resets, sim_time(sim));
    }
}

static void describe(Once *once, const World *world, const Scene *scene)
{
    const Body *body = sim_body(world->sim, once->context->body);
    once->run->rate_hz = scene->sim.rate_hz;
    once->run->substeps = body->substeps;
    once->run->time_step = body->h;
    once->run->what.integrator = body->integrator; // resolves "auto"
}

static void out_of_memory(StudyRun *run)
{
    set_verdict(run, STUDY_SKIPPED, "out of memory");
}

// Removes file and line, which are those of the scene and thus of all cases.
static const char *without_path(const StudyContext *context, const char *text)
{
    size_t length = strlen(context->given->path);
    const char *colon = strstr(text, ": ");
    return strncmp(text, context->given->path, length) == 0 && colon != NULL ? colon + 2 : text;
}

// Builds the world and runs it.
static void run_once(Once *once)
{
    const StudyContext *context = once->context;
    StudyRun *run = once->run;
    // Build it; a scene that is refused is a result, too.
    StudyScene copy;
    World world;
    Status status = {0};
    if (!study_build(context, once->what, once->estimates, &copy, &world, &status)) {
        set_verdict(run, STUDY_REFUSED, "%s", without_path(context, status.text));
        return;
    }
    describe(once, &world, &copy.scene);
    // Memory for the samples; then the inputs, which may refuse the scene.
    StudyPlay inputs = {0};
    Sampler sampler = {0};
    StepDoubling doubling = {0};
    const int ticks =
        context->sample_count * ((int)lround(context->sample_s * copy.scene.sim.rate_hz) + 1);
    once->tick_s = malloc((size_t)ticks * sizeof *once->tick_s);
    bool ready = once->tick_s != NULL &&
                 sampler_create(&sampler, context, &world, once->what->level < 0) &&
                 (!once->what->step_doubling ||
                  step_doubling_create(&doubling, &world, context->body,
                                       once->what->tolerance * context->extent));
    // Run it if all is ready.
    if (!ready)
        out_of_memory(run);
    else if (!study_play_begin(&inputs, context, &world, &copy.scene, &status))
        set_verdict(run, STUDY_REFUSED, "%s", status.text);
    else
        play(once, &world, &inputs, &sampler, once->what->step_doubling ? &doubling : NULL);
    // What it had in use.
    if (sampler.id != NULL) {
        run->nodes_least = sampler.nodes_least;
        run->nodes_most = sampler.nodes_most;
        run->links = sampler.links_most;
        if (once->estimates)
            sampler_estimated(&sampler, &run->estimated, &run->estimated_force);
    }
    study_play_end(&inputs);
    step_doubling_destroy(&doubling);
    sampler_destroy(&sampler);
    world_destroy(&world);
    study_destroy_scene(&copy);
}

static double quantile(const double *sorted, int count, double share)
{
    int at = (int)ceil(share * count) - 1;
    return count == 0 ? 0.0 : sorted[at < 0 ? 0 : at];
}

// Takes the tick times of one repeat.
static void take_ticks(StudyRun *run, double *tick_s, int count)
{
    qsort(tick_s, (size_t)count, sizeof *tick_s, compare_doubles);
    run->tick_p50 = quantile(tick_s, count, 0.5);
    run->tick_p99 = quantile(tick_s, count, 0.99);
    run->tick_most = quantile(tick_s, count, 1.0);
}

// Sets the costs. The median is that of the lower middle repeat, whose tick times are used.
static void summarize(StudyRun *run, Once *repeat)
{
    int order[STUDY_REPEATS];
    // Repeats in the order of their cost.
    for (int i = 0; i < run->repeats; i++) {
        int k = i;
        for (; k > 0 && run->cpu_s[order[k - 1]] > run->cpu_s[i]; k--)
            order[k] = order[k - 1];
        order[k] = i;
    }
    // The one in the middle stands for all; its ticks make the percentiles.
    int middle = order[(run->repeats - 1) / 2];
    run->cpu_least = run->cpu_s[order[0]];
    run->cpu_median = run->cpu_s[middle];
    run->cpu_most = run->cpu_s[order[run->repeats - 1]];
    take_ticks(run, repeat[middle].tick_s, repeat[middle].tick_count);
}

static bool trace_case(const StudyContext *context, const StudyCase *what, int repeats,
                       bool estimates, StudyRun *run, StudyTrace *trace)
{
    Once repeat[STUDY_REPEATS] = {0};
    const double most = context->options.quick ? QUICKLY_UP_TO : REPEAT_UP_TO;
    double all = 0.0;
    memset(run, 0, sizeof *run);
    run->what = *what;
    run->time = run->total = study_no_errors();
    run->estimated = run->estimated_force = (double)NAN;
    realtime_flush_denormals();
    // Only the first repeat is sampled.
    if (trace != NULL) {
        trace->used = 0;
        trace->extent = context->extent;
        trace->rest_volume = context->rest_volume;
        trace->has_volume = isfinite(context->rest_volume);
        trace->has_force = context->scene.tool_count > 0;
    }
    // Repeat for the cost until the time for repeats is used up.
    for (int r = 0; r < repeats && (r == 0 || all < most); r++) {
        repeat[r] = (Once){.context = context,
                           .what = what,
                           .run = run,
                           .trace = r == 0 ? trace : NULL,
                           .estimates = estimates && r == 0 && !what->step_doubling};
        run_once(&repeat[r]);
        if (run->verdict != STUDY_OK)
            break;
        run->cpu_s[r] = repeat[r].cpu_s / (context->sample_count * context->sample_s);
        run->repeats = r + 1;
        all += repeat[r].cpu_s;
    }
    // The median of all repeats, from here on.
    if (run->repeats > 0)
        summarize(run, repeat);
    for (int r = 0; r < STUDY_REPEATS; r++)
        free(repeat[r].tick_s);
    return true;
}

bool study_trace_case(const StudyContext *context, const StudyCase *what, int repeats,
                      StudyRun *run, StudyTrace *trace)
{
    return trace_case(context, what, repeats, false, run, trace);
}

bool study_run_case(const StudyContext *context, const StudyCase *what, StudyRun *run)
{
    StudyTrace *trace = study_trace_create(context->sample_count, context->points.count);
    if (trace == NULL)
        return false;
    bool ok = trace_case(context, what, context->options.repeats, true, run, trace);
    int mesh = study_mesh_of(context, what);
    // Compared with the finest run on its mesh, and with the finest of all.
    if (run->verdict == STUDY_OK) {
        if (mesh >= 0 && context->mesh_trace[mesh] != NULL)
            run->time = study_errors(trace, context->mesh_trace[mesh]);
        if (context->finest_trace != NULL)
            run->total = study_errors(trace, context->finest_trace);
    }
    free(trace);
    return ok;
}

// Makes all inputs larger by STUDY_NUDGE. The loads are owned by the caller.
static bool nudge_inputs(StudyContext *context)
{
    Scene *scene = &context->scene;
    const double factor = 1.0 + STUDY_NUDGE;
    const size_t loads = (size_t)scene->load_count;
    context->inputs.press.way *= factor;
    if (loads == 0)
        scene->sim.gravity = vec3_scale(factor, scene->sim.gravity);
    SceneLoad *load = calloc(loads + 1, sizeof *load);
    if (load == NULL)
        return false;
    for (size_t i = 0; i < loads; i++) {
        load[i] = scene->load[i];
        load[i].load.force = vec3_scale(factor, load[i].load.force);
    }
    scene->load = load;
    return true;
}

static StudyErrors measure_nudge(const StudyContext *context, const StudyCase *what)
{
    StudyErrors moved = study_no_errors();
    StudyContext nudged = *context;
    if (context->inputs.drive == DRIVE_LOG || !nudge_inputs(&nudged))
        return moved;
    StudyRun run[2];
    StudyTrace *own = study_trace_create(context->sample_count, context->points.count);
    StudyTrace *other = study_trace_create(context->sample_count, context->points.count);
    if (own != NULL && other != NULL && study_trace_case(context, what, 1, &run[0], own) &&
        study_trace_case(&nudged, what, 1, &run[1], other) && run[0].verdict == STUDY_OK &&
        run[1].verdict == STUDY_OK)
        moved = study_errors(other, own);
    free(own);
    free(other);
    free(nudged.scene.load);
    return moved;
}

typedef struct Nudge {
    const StudyContext *context;
    const StudyCase *what;
    StudyErrors moved;
} Nudge;

static void run_nudge(void *user, int task, void *result)
{
    const Nudge *nudge = user;
    (void)task;
    *(StudyErrors *)result = measure_nudge(nudge->context, nudge->what);
}

static void lose_nudge(void *user, int task, void *result, const char *why)
{
    (void)user, (void)task, (void)why;
    *(StudyErrors *)result = study_no_errors();
}

static void nudge_done(void *user, int task, const void *result, const char *why)
{
    (void)task, (void)why;
    ((Nudge *)user)->moved = *(const StudyErrors *)result;
}

bool study_nudge(const StudyContext *context, const StudyCase *what, StudyErrors *moved,
                 Status *status)
{
    Nudge nudge = {.context = context, .what = what, .moved = study_no_errors()};
    const Pool pool = {.task_count = 1,
                       .jobs = 1,
                       .result_bytes = sizeof(StudyErrors),
                       .user = &nudge,
                       .run = run_nudge,
                       .done = nudge_done};
    const bool ok = parts_run(context->parts, "nudge", &pool, lose_nudge, status);
    *moved = nudge.moved;
    return ok;
}

// --- all cases -----------------------------------------------------------------------------------

typedef struct Schedule {
    const StudyContext *context;
    const StudyCase *cases;
    int count, done;
    StudyProgress *progress;
    void *user;
    StudyResult *result;
} Schedule;

static void lose_run(StudyRun *run, const StudyCase *what, StudyVerdict verdict, const char *why)
{
    memset(run, 0, sizeof *run);
    run->what = *what;
    run->verdict = verdict;
    run->time = run->total = study_no_errors();
    snprintf(run->why, sizeof run->why, "%s", why);
}

static void run_task(void *user, int task, void *result)
{
    const Schedule *schedule = user;
    const StudyCase *what = &schedule->cases[task];
    if (!study_run_case(schedule->context, what, result))
        lose_run(result, what, STUDY_SKIPPED, "out of memory");
}

static void lose(void *user, int task, void *result, const char *why)
{
    const Schedule *schedule = user;
    lose_run(result, &schedule->cases[task],
             strcmp(why, POOL_TOO_LONG) == 0 ? STUDY_SKIPPED : STUDY_BAD, why);
}

static void task_done(void *user, int task, const void *result, const char *why)
{
    Schedule *schedule = user;
    StudyRun *run = &schedule->result->run[task];
    if (result != NULL)
        memcpy(run, result, sizeof *run);
    else
        lose(user, task, run, why);
    schedule->done++;
    if (schedule->progress != NULL)
        schedule->progress(schedule->user, schedule->done, schedule->count, run);
}

bool study_run_all(const StudyContext *context, const StudyCase *cases, int count, int jobs,
                   StudyProgress *progress, void *user, StudyResult *result, Status *status)
{
    Schedule schedule = {.context = context,
                         .cases = cases,
                         .count = count,
                         .progress = progress,
                         .user = user,
                         .result = result};
    // A run ends itself after limit_s per repeat; one that goes on after that hangs.
    const Pool pool = {.task_count = count,
                       .jobs = jobs,
                       .result_bytes = sizeof(StudyRun),
                       .timeout_s = 4.0 * context->limit_s + 60.0,
                       .user = &schedule,
                       .run = run_task,
                       .done = task_done};
    result->run_count = count;
    return parts_run(context->parts, STUDY_CASE_PART, &pool, lose, status);
}
