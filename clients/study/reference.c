// SPDX-License-Identifier: MIT

#include "base/clock.h"
#include "study/study.h"
#include "study/sampler.h"
#include "study/pool.h"
#include "study/run.h"
#include "study/context.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RUNS = 3, FINEST = STUDY_MESHES, LISTS = STUDY_MESHES + 1 };

// One reference: up to three runs, each twice as fine as the one before.
typedef struct Refinement {
    StudyReference reference;
    StudyCase run[RUNS];
    int first;       // index of the first run that is made
    double expected; // expected order of convergence
    double seconds;  // estimated CPU time
    bool wanted;
    StudyTrace *trace[RUNS];
    bool failed;
} Refinement;

// Limit of a run's CPU time, relative to the budget of its mesh: estimates may be wrong.
static const double PATIENCE = 10.0;

// The work and its progress.
typedef struct Plan {
    StudyContext *context;
    Refinement list[LISTS]; // by mesh; [FINEST] for the total error
    int task_list[LISTS * RUNS], task_run[LISTS * RUNS];
    int task_count, done;
    size_t trace_bytes;
    bool stiff; // explicit methods would take too long
    int mesh_count;
    StudyMesh mesh[STUDY_MESHES]; // the context's
    StudyReferenceProgress *progress;
    void *user;
} Plan;

// The result of a task, followed by the trace.
typedef struct Reply {
    StudyVerdict verdict;
    char why[STUDY_WHY];
    double time_step;
} Reply;

// ---------------------------------------------------------------------------------------------
// Planning

static const SceneBody *first_body(const Plan *plan)
{
    return &plan->context->scene.body[0];
}

static bool is_voxel(const Plan *plan)
{
    return scene_has_cells(first_body(plan));
}

static double budget(const Plan *plan)
{
    return plan->context->options.quick ? 10.0 : 120.0;
}

// Returns the smallest step of any case [s].
static double smallest_step(const StudyCase *cases, int count, bool quick)
{
    double least = quick ? 2.5e-4 : 1e-4;
    for (int i = 0; i < count; i++)
        if (cases[i].time_step > 0.0)
            least = fmin(least, cases[i].time_step);
    return least;
}

// Cost and number of substeps, measured on a world that was built for it.
typedef struct Load {
    int substeps;   // per tick, at the stability bound of the finest level
    double substep; // CPU time, estimated [s]
    double edge;    // [m]
} Load;

static double time_substep(World *world, const Body *body)
{
    double least = HUGE_VAL;
    for (int i = 0; i < 2; i++) {
        int64_t begin = clock_thread_ns();
        sim_step(world->sim);
        least = fmin(least, 1e-9 * (double)(clock_thread_ns() - begin));
    }
    return least / body->substeps;
}

static bool weigh_case(const Plan *plan, StudyCase what, Load *load, Status *status)
{
    static const double OF_ADAPTIVE = 0.3; // most faces that are refined at a time, relative to all
    StudyScene copy;
    World world;
    what.time_step = 0.0;
    if (!study_build(plan->context, &what, false, &copy, &world, status))
        return false;
    // Faces that refine multiply both cost and substeps.
    const Body *body = sim_body(world.sim, plan->context->body);
    double growth = what.threshold > 0.0 ? fmax(OF_ADAPTIVE * exp2(2.0 * what.level), 1.0) : 1.0;
    load->substeps = body->finest_substeps;
    load->substep = growth * time_substep(&world, body);
    load->edge = body->surface.longest_edge * exp2(-(double)what.level);
    world_destroy(&world);
    study_destroy_scene(&copy);
    return true;
}

static double cost_of(const Plan *plan, const Load *load, double substeps)
{
    const StudyContext *context = plan->context;
    double ticks = context->sample_count * context->sample_s * context->scene.sim.rate_hz;
    return ticks * substeps * load->substep;
}

static StudyCase reference_case(const Plan *plan, StudyCase what)
{
    what.integrator = is_voxel(plan) ? INTEGRATOR_LEAPFROG
                      : plan->stiff  ? INTEGRATOR_IMPLICIT
                                     : INTEGRATOR_RK4;
    what.precision = PRECISION_DOUBLE;
    what.step_doubling = what.is_scene = false;
    return what;
}

static void cannot(Refinement *of, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void cannot(Refinement *of, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(of->reference.what, sizeof of->reference.what, format, arguments);
    va_end(arguments);
    of->wanted = false;
    of->reference.known = false;
    of->reference.order = of->reference.own_error = (double)NAN;
}

// Plans the reference of one mesh: half of the step, and half of that.
static void plan_time(Plan *plan, int m, StudyCase what, double step)
{
    Refinement *of = &plan->list[m];
    Status status = {0};
    Load load;
    char mesh[48];
    // What one run costs decides how fine it can be.
    what = reference_case(plan, what);
    study_name_mesh(&plan->context->scene, &what, mesh, sizeof mesh);
    if (!weigh_case(plan, what, &load, &status)) {
        cannot(of, "none: %s", status.text);
        return;
    }
    const double tick = 1.0 / plan->context->scene.sim.rate_hz;
    // The implicit method has order 1 or 2: it needs shorter steps than the cases that it judges.
    if (plan->stiff)
        step *= 0.25;
    // Fewer substeps than wanted if they exceed the budget, but never above the stability bound.
    double substeps = fmax(ceil(tick / step - 1e-9), load.substeps);
    while (cost_of(plan, &load, 7.0 * substeps) > budget(plan) && substeps > load.substeps)
        substeps = fmax(ceil(0.5 * substeps), load.substeps);
    of->seconds = cost_of(plan, &load, 7.0 * substeps);
    if (of->seconds > 5.0 * budget(plan)) {
        cannot(of, "none: %s would take %.0f s", mesh, of->seconds);
        return;
    }
    // Three runs, each with half the step of the one before.
    of->wanted = true;
    of->expected = is_voxel(plan) || plan->stiff ? 2.0 : 4.0;
    for (int k = 0; k < RUNS; k++) {
        of->run[k] = what;
        of->run[k].time_step = tick / (substeps * exp2(k));
        of->reference.step[k] = of->run[k].time_step;
    }
    snprintf(of->reference.what, sizeof of->reference.what, "%s double, %.4g ms, %s",
             integrator_name(what.integrator), 1e3 * of->run[RUNS - 1].time_step, mesh);
}

// Plans one run of the finest meshes; returns false if it is impossible or takes too long.
static bool plan_level(Plan *plan, int k, int level)
{
    Refinement *of = &plan->list[FINEST];
    StudyCase what = reference_case(plan, study_scene_case(&plan->context->scene));
    Status status = {0};
    Load load;
    // The scene's own body, held at one level.
    what.detail = DETAIL_HELD;
    what.level = level;
    what.threshold = 0.0;
    what.paper_rule = false;
    if (!weigh_case(plan, what, &load, &status)) {
        cannot(of, "none: %s", status.text);
        return false;
    }
    // Fine enough in time that only the mesh matters.
    double substeps = load.substeps * (plan->context->options.quick ? 1.0 : 2.0);
    if (plan->stiff) // no stability bound
        substeps = fmax(substeps, ceil(1e3 / plan->context->scene.sim.rate_hz));
    double seconds = cost_of(plan, &load, substeps);
    if (seconds > budget(plan)) {
        cannot(of, "none: level %d would take %.0f s", level, seconds);
        return false;
    }
    // It fits: note the run.
    of->seconds += seconds;
    of->run[k] = what;
    of->run[k].time_step = 1.0 / plan->context->scene.sim.rate_hz / substeps;
    of->reference.step[k] = load.edge;
    return true;
}

static void name_finest(Plan *plan)
{
    Refinement *of = &plan->list[FINEST];
    const StudyCase *last = &of->run[RUNS - 1];
    char mesh[48];
    study_name_mesh(&plan->context->scene, last, mesh, sizeof mesh);
    of->wanted = true;
    snprintf(of->reference.what, sizeof of->reference.what, "%s double, %.4g ms, %s",
             integrator_name(last->integrator), 1e3 * last->time_step, mesh);
}

// Plans one level above the scene's and the two below it, or as fine as time allows.
static void plan_finest_surface(Plan *plan)
{
    int top = first_body(plan)->surface.body.levels + 1;
    // The finest three levels that the budget allows.
    for (top = top > 2 ? top : 2; top >= 2; top--) {
        int k = RUNS;
        plan->list[FINEST].seconds = 0.0;
        while (k > 0 && plan_level(plan, k - 1, top - (RUNS - k)))
            k--;
        if (k == 0) {
            plan->list[FINEST].expected = 2.0;
            name_finest(plan);
            return;
        }
    }
}

// Plans elements of one cell; for a box also of half a cell, which is the best estimate of its own
// error.
static void plan_finest_voxel(Plan *plan)
{
    Refinement *of = &plan->list[FINEST];
    of->expected = 1.0;
    if (plan->context->may_halve && plan_level(plan, 2, -1) && plan_level(plan, 1, 0)) {
        of->first = 1;
    } else if (plan_level(plan, 2, 0)) {
        of->first = 2;
    } else {
        return;
    }
    name_finest(plan);
}

// True if RK4 at its bound takes too long on the scene's own mesh, and the implicit method does
// not.
static bool is_stiff(Plan *plan)
{
    Status status = {0};
    Load load;
    if (is_voxel(plan))
        return false;
    StudyCase what = reference_case(plan, study_scene_case(&plan->context->scene));
    if (weigh_case(plan, what, &load, &status) &&
        cost_of(plan, &load, 7.0 * load.substeps) <= 5.0 * budget(plan))
        return false;
    what.integrator = INTEGRATOR_IMPLICIT;
    status = (Status){0};
    return weigh_case(plan, what, &load, &status);
}

static void add_tasks(Plan *plan, int list)
{
    // The longest first, so that no process is left with it at the end.
    for (int k = RUNS - 1; k >= plan->list[list].first; k--) {
        plan->task_list[plan->task_count] = list;
        plan->task_run[plan->task_count++] = k;
    }
}

static void make_plan(Plan *plan, const StudyCase *cases, int count)
{
    StudyContext *context = plan->context;
    // How large a result is, and how small the steps of the cases are.
    plan->trace_bytes = study_trace_bytes(context->sample_count, context->points.count);
    double step = smallest_step(cases, count, context->options.quick);
    plan->stiff = is_stiff(plan);
    // The finest mesh first, then a reference in time for each mesh of the cases.
    if (is_voxel(plan))
        plan_finest_voxel(plan);
    else
        plan_finest_surface(plan);
    if (!plan->list[FINEST].wanted && !is_voxel(plan) && !plan->stiff) {
        plan->stiff = true; // finer meshes are stiffer
        plan_finest_surface(plan);
        plan->stiff = false;
    }
    if (plan->list[FINEST].wanted)
        add_tasks(plan, FINEST);
    // A mesh is planned when the first of its cases comes.
    context->mesh_count = 0;
    for (int i = 0; i < count && context->mesh_count < STUDY_MESHES; i++) {
        if (study_mesh_of(context, &cases[i]) >= 0)
            continue;
        // Solids that adapt are compared with the finest alone.
        if (is_voxel(plan) && cases[i].detail == DETAIL_ADAPTIVE)
            continue;
        int m = context->mesh_count++;
        context->mesh[m] = (StudyMesh){.detail = cases[i].detail,
                                       .level = cases[i].level,
                                       .threshold = cases[i].threshold,
                                       .paper_rule = cases[i].paper_rule};
        plan_time(plan, m, cases[i], step);
        if (plan->list[m].wanted)
            add_tasks(plan, m);
    }
    plan->mesh_count = context->mesh_count;
    memcpy(plan->mesh, context->mesh, sizeof plan->mesh);
}

// --- one plan for all processes: it depends on times that are measured ---

typedef struct Planning {
    StudyContext *context;
    const StudyCase *cases;
    int count;
    Plan *plan;
} Planning;

static void run_planning(void *user, int task, void *result)
{
    const Planning *planning = user;
    Plan *plan = result;
    (void)task;
    plan->context = planning->context;
    make_plan(plan, planning->cases, planning->count);
    plan->context = NULL; // an address is of one process
}

static void lose_planning(void *user, int task, void *result, const char *why)
{
    (void)user, (void)task, (void)why;
    memset(result, 0, sizeof(Plan)); // no reference
}

static void planning_done(void *user, int task, const void *result, const char *why)
{
    Planning *planning = user;
    (void)task, (void)why;
    memcpy(planning->plan, result, sizeof *planning->plan);
}

// Returns NULL with `status` if memory runs out.
static Plan *share_plan(StudyContext *context, const StudyCase *cases, int count, Status *status)
{
    Planning planning = {
        .context = context, .cases = cases, .count = count, .plan = calloc(1, sizeof(Plan))};
    const Pool pool = {.task_count = 1,
                       .jobs = 1,
                       .result_bytes = sizeof(Plan),
                       .user = &planning,
                       .run = run_planning,
                       .done = planning_done};
    if (planning.plan == NULL) {
        status_fail(status, STATUS_FAILED, "out of memory");
        return NULL;
    }
    if (!parts_run(context->parts, "plan", &pool, lose_planning, status)) {
        free(planning.plan);
        return NULL;
    }
    planning.plan->context = context;
    context->mesh_count = planning.plan->mesh_count;
    memcpy(context->mesh, planning.plan->mesh, sizeof context->mesh);
    return planning.plan;
}

static void destroy_plan(Plan *plan)
{
    for (int l = 0; l < LISTS; l++)
        for (int k = 0; k < RUNS; k++)
            free(plan->list[l].trace[k]);
    free(plan);
}

static void describe_plan(const Plan *plan, char *text, size_t size)
{
    double seconds = 0.0;
    for (int l = 0; l < LISTS; l++)
        seconds += plan->list[l].wanted ? plan->list[l].seconds : 0.0;
    snprintf(text, size, "%d runs for %d meshes, about %.0f s of one processor; finest: %s",
             plan->task_count, plan->context->mesh_count, seconds,
             plan->list[FINEST].reference.what);
}

// ---------------------------------------------------------------------------------------------
// Running

static void run_task(void *user, int task, void *result)
{
    const Plan *plan = user;
    StudyContext patient = *plan->context, *context = &patient;
    const Refinement *of = &plan->list[plan->task_list[task]];
    StudyTrace *trace = (StudyTrace *)((Reply *)result + 1);
    Reply *reply = result;
    StudyRun run;
    // A reference may take longer than a case.
    patient.limit_s = PATIENCE * budget(plan);
    trace->sample_count = context->sample_count;
    trace->point_count = context->points.count;
    study_trace_case(context, &of->run[plan->task_run[task]], 1, &run, trace);
    reply->verdict = run.verdict;
    reply->time_step = run.time_step;
    snprintf(reply->why, sizeof reply->why, "%s", run.why);
}

static void lose_task(void *user, int task, void *result, const char *why)
{
    Reply *reply = result;
    (void)user, (void)task;
    reply->verdict = STUDY_BAD;
    snprintf(reply->why, sizeof reply->why, "%s", why);
}

static void task_done(void *user, int task, const void *result, const char *why)
{
    Plan *plan = user;
    int k = plan->task_run[task];
    Refinement *of = &plan->list[plan->task_list[task]];
    const Reply *reply = result;
    char name[STUDY_NAME];
    snprintf(name, sizeof name, "%s", of->reference.what);
    // Keep the samples of a run that went well.
    if (reply != NULL && reply->verdict == STUDY_OK) {
        of->trace[k] = malloc(plan->trace_bytes);
        if (of->trace[k] != NULL)
            memcpy(of->trace[k], reply + 1, plan->trace_bytes);
    }
    // One missing run makes the whole reference unknown.
    if (of->trace[k] == NULL && !of->failed) {
        of->failed = true;
        cannot(of, "none: %s", reply != NULL ? reply->why : why);
    }
    plan->done++;
    if (plan->progress != NULL)
        plan->progress(plan->user, plan->done, plan->task_count, name);
}

// Estimates the reference's own error from its runs.
static void conclude(Refinement *of)
{
    StudyReference *reference = &of->reference;
    reference->difference[0] = reference->difference[1] = (double)NAN;
    if (!of->wanted || of->failed)
        return;
    // Runs are missing where another process has completed the study meanwhile.
    for (int k = of->first; k < RUNS; k++)
        if (of->trace[k] == NULL)
            return;
    for (int k = of->first; k + 1 < RUNS; k++)
        reference->difference[k] = study_errors(of->trace[k], of->trace[k + 1]).patch;
    study_richardson(reference, of->expected);
    if (of->first == 1) { // two runs give no order
        reference->own_error = reference->difference[1];
        reference->known = isfinite(reference->own_error);
    }
}

static StudyTrace *take_finest(Refinement *of)
{
    StudyTrace *trace = of->failed ? NULL : of->trace[RUNS - 1];
    if (trace != NULL)
        of->trace[RUNS - 1] = NULL;
    return trace;
}

bool study_make_references(StudyContext *context, const StudyCase *cases, int count,
                           StudyReferenceProgress *progress, void *user, StudyResult *result,
                           Status *status)
{
    study_forget_references(context);
    Plan *plan = share_plan(context, cases, count, status);
    if (plan == NULL)
        return false;
    // All runs of all references are tasks of one pool.
    plan->progress = progress;
    plan->user = user;
    const Pool pool = {.task_count = plan->task_count,
                       .jobs = context->options.jobs,
                       .result_bytes = sizeof(Reply) + plan->trace_bytes,
                       .timeout_s = 4.0 * PATIENCE * budget(plan) + 60.0,
                       .user = plan,
                       .run = run_task,
                       .done = task_done};
    char text[2 * STUDY_NAME];
    describe_plan(plan, text, sizeof text);
    // Run all, then keep what succeeded.
    if (progress != NULL)
        progress(user, 0, plan->task_count, text);
    bool ok = parts_run(context->parts, "reference", &pool, lose_task, status);
    for (int l = 0; l < LISTS && ok; l++)
        conclude(&plan->list[l]);
    for (int m = 0; m < context->mesh_count && ok; m++) {
        context->mesh[m].reference = plan->list[m].reference;
        context->mesh_trace[m] = take_finest(&plan->list[m]);
    }
    // The result has copies of what the report needs.
    if (ok) {
        context->finest = plan->list[FINEST].reference;
        context->finest_trace = take_finest(&plan->list[FINEST]);
        result->finest = context->finest;
        result->mesh_count = context->mesh_count;
        memcpy(result->mesh, context->mesh, sizeof result->mesh);
    }
    destroy_plan(plan);
    return ok;
}
