// SPDX-License-Identifier: MIT
// Chooses a case and explains the choice in one sentence.

#include "study/study.h"
#include "study/report.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

typedef struct Want {
    const StudyResult *result;
    const StudyReference *finest; // NULL: error in time only
    const StudyCase *scene;       // whose mesh counts, for error in time only
    double error, rate_hz;
    bool estimated; // by what bodies say of themselves: there is no reference
} Want;

// The ratio of each quantity of a run to its limit: 1 is the limit.
typedef struct Measure {
    double error, force, p99, cost, rate;
} Measure;

// Returns at least the change by the last refinement: extrapolation relies on an order that three
// runs may show by chance, since loads act on other nodes of every mesh.
static double own_error(const StudyReference *reference)
{
    return fmax(reference->own_error, reference->difference[1]);
}

static bool is_usable(const StudyReference *reference, double error)
{
    return reference != NULL && reference->known && isfinite(reference->own_error) &&
           own_error(reference) <= error;
}

// Returns how far the motion itself is undefined; 0: unknown.
static double nudged(const StudyResult *result)
{
    const double moved = study_error(&result->nudged);
    return isfinite(moved) ? moved : 0.0;
}

// Includes the error of the reference, or what nearly equal inputs differ by; NAN: unknown.
static double whole_error(const Want *want, const StudyRun *run)
{
    const double least = nudged(want->result);
    if (want->estimated)
        return run->estimated > 0.0 ? run->estimated + least : (double)NAN;
    if (want->finest != NULL)
        return study_error(&run->total) + fmax(own_error(want->finest), least);
    const StudyReference *reference = study_time_reference(want->result, &run->what);
    return is_usable(reference, want->error)
               ? study_error(&run->time) + fmax(own_error(reference), least)
               : (double)NAN;
}

// Returns the error of the force on the tool, with what nearly equal inputs differ by; 0: unknown.
// Where a tool prescribes the displacement of the patch, this is what a hand feels.
static double force_error(const Want *want, const StudyRun *run)
{
    const double force = want->estimated        ? run->estimated_force
                         : want->finest != NULL ? run->total.force
                                                : run->time.force;
    const double least = want->result->nudged.force;
    return isfinite(force) ? force + (isfinite(least) ? least : 0.0) : 0.0;
}

static bool is_candidate(const Want *want, const StudyRun *run)
{
    if (run->verdict != STUDY_OK || run->what.step_doubling || run->what.level < 0 ||
        !isfinite(whole_error(want, run)) || !isfinite(run->tick_p99) || !isfinite(run->cpu_median))
        return false;
    return want->finest != NULL || want->estimated ||
           (want->scene != NULL && study_same_mesh(want->scene, &run->what));
}

static Measure measure(const Want *want, const StudyRun *run)
{
    return (Measure){.error = whole_error(want, run) / want->error,
                     .force = force_error(want, run) / want->error,
                     .p99 = run->tick_p99 * run->rate_hz / ADVICE_SHARE,
                     .cost = run->cpu_median / ADVICE_SHARE,
                     // only for a rate that was lowered for a long step; not for rounding
                     .rate = want->rate_hz / run->rate_hz - 1e-9};
}

static double slowness(const Measure *m)
{
    return fmax(fmax(m->p99, m->cost), m->rate);
}

// Returns the cheapest run within all limits; if none is, the one that exceeds them least, of those
// that hold the rate if there are any.
static int choose(const Want *want, bool *met, bool *holds)
{
    int best = -1;
    double best_cost = 0.0, best_miss = 0.0;
    bool best_slow = false;
    *met = *holds = false;
    // The least miss wins, and among runs that miss nothing the cheapest.
    for (int i = 0; i < want->result->run_count; i++) {
        const StudyRun *run = &want->result->run[i];
        if (!is_candidate(want, run))
            continue;
        Measure m = measure(want, run);
        const bool slow = slowness(&m) > 1.0;
        const double miss = fmax(fmax(fmax(m.error, m.force), slowness(&m)), 1.0),
                     cost = run->cpu_median;
        if (best >= 0 && slow && !best_slow)
            continue;
        if (best < 0 || slow != best_slow || miss < best_miss ||
            (miss <= best_miss && cost < best_cost)) {
            best = i;
            best_cost = cost;
            best_miss = miss;
            best_slow = slow;
            *met = miss <= 1.0;
            *holds = !slow;
        }
    }
    return best;
}

// --- words ---------------------------------------------------------------------------------------

static void say(Advice *advice, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void say(Advice *advice, const char *format, ...)
{
    size_t used = strlen(advice->sentence);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(advice->sentence + used, sizeof advice->sentence - used, format, arguments);
    va_end(arguments);
}

// Prints a negligible error only as an upper limit.
static const char *own_words(const StudyReference *reference, char text[24])
{
    if (own_error(reference) >= 1e-5)
        return table_percent(own_error(reference), text);
    return strcpy(text, "0.001 %");
}

// Formats microseconds without powers of ten.
static const char *microseconds(double seconds, char text[24])
{
    snprintf(text, 24, seconds >= 1e-3 ? "%.0f us" : "%.3g us", 1e6 * seconds);
    return text;
}

static void say_error(const Want *want, const StudyRun *run, Advice *advice)
{
    char sum[24], own[24], measured[24];
    const StudyReference *reference =
        want->finest != NULL ? want->finest : study_time_reference(want->result, &run->what);
    const StudyErrors *errors = want->finest != NULL ? &run->total : &run->time;
    const bool unsure = nudged(want->result) > own_error(reference);
    say(advice, "%s error %s (%s measured, up to %s of the %s itself)",
        want->finest != NULL ? "total" : "time-discretisation", table_percent(advice->error, sum),
        table_percent(study_error(errors), measured),
        unsure ? table_percent(nudged(want->result), own) : own_words(reference, own),
        unsure ? "motion" : "reference");
    if (isfinite(errors->force))
        say(advice, ", of the force on the tool %s measured", table_percent(errors->force, own));
}

static void say_cost(const StudyRun *run, Advice *advice)
{
    char p99[24], period[24], most[24];
    say(advice,
        "99 of 100 ticks below %s of %s (%.0f %% may be used), the longest %s, %.3g ms for a "
        "simulated second",
        microseconds(run->tick_p99, p99), microseconds(1.0 / run->rate_hz, period),
        100.0 * ADVICE_SHARE, microseconds(run->tick_most, most), 1e3 * run->cpu_median);
}

static void say_misses(const Want *want, const StudyRun *run, Advice *advice)
{
    Measure m = measure(want, run);
    const char *comma = "";
    char limit[24];
    // Each limit that is missed, by how much.
    say(advice, "it misses ");
    if (m.error > 1.0) {
        say(advice, "the error (%.3g times what is allowed)", m.error);
        comma = " and ";
    }
    if (m.force > 1.0) {
        say(advice, "%sthe error of the force on the tool (%.3g times)", comma, m.force);
        comma = " and ";
    }
    if (m.rate > 1.0) {
        say(advice, "%sthe rate (its step needs %.4g Hz)", comma, run->rate_hz);
        comma = " and ";
    }
    if (m.p99 > 1.0 || m.cost > 1.0)
        say(advice, "%sthe time of a tick (%.3g times what is allowed)", comma,
            fmax(m.p99, m.cost));
    say(advice, "; nothing else is nearer to %s at %.4g Hz", table_percent(want->error, limit),
        want->rate_hz);
}

static void say_time_only(const Want *want, Advice *advice)
{
    char own[24];
    const StudyReference *finest = &want->result->finest;
    if (want->finest != NULL)
        return;
    if (finest->known && !isnan(finest->own_error))
        say(advice,
            " The promise is about the steps in time alone: the reference of the total "
            "error may itself err by %s.",
            table_percent(own_error(finest), own));
    else
        say(advice, " The promise is about the steps in time alone: there is no reference of the "
                    "total error whose own error is known.");
}

// Steps a tick from which an implicit step is worth trying: half of where costs cross
// (server/surface/README.md, "Implicit step").
enum { MANY_SUBSTEPS = 32 };

// Says why the total error may have no reference.
static void say_folds(const StudyResult *result, Advice *advice)
{
    if (advice->time_only && result->wall && !result->bends)
        say(advice, " A wall that does not bend folds at the size of its faces, elsewhere at each "
                    "level: give its material a thickness, and they can converge.");
}

// Says what to change in the scene where no case of the study is enough.
static void say_next(const Want *want, const StudyRun *run, Advice *advice)
{
    const StudyResult *result = want->result;
    if (advice->met)
        return;
    const Measure m = measure(want, run);
    const double slow = fmax(m.p99, m.cost);
    if (nudged(result) > 0.5 * want->error) {
        char moved[24];
        say(advice,
            " Inputs that differ by %g %% already move the patch by %s: no step and no mesh is "
            "much nearer, ask for --error %.2g%%.",
            100.0 * STUDY_NUDGE, table_percent(nudged(result), moved),
            100.0 * 1.05 * advice->error);
        if (slow <= 1.0)
            return;
    }
    if (slow <= 1.0) {
        say(advice, " Try one level more%s.",
            result->wall ? ", a finer or more even mesh, or a solid if the wall is thick"
                         : " or smaller cells");
        return;
    }
    if (result->wall && run->substeps >= MANY_SUBSTEPS &&
        run->what.integrator != INTEGRATOR_IMPLICIT)
        say(advice, " Try integrator = \"implicit\": %d steps a tick are many.", run->substeps);
    // Steps a tick grow with the root of the nodes of a wall, with their cube root in a solid.
    const double nodes = run->nodes_most * pow(slow, result->wall ? -2.0 / 3.0 : -3.0 / 4.0);
    say(advice, " A mesh of about %.2g %s would hold the rate%s.", nodes,
        result->wall ? "nodes" : "vertices",
        result->wall ? "; so do fewer levels" : "; larger elements inside (levels) cost less, too");
}

void advice_make(const StudyResult *result, double error, double rate_hz, Advice *advice)
{
    // What is compared: the finest reference, if it is good enough, and the scene's own choice.
    const StudyRun *scene = study_scene_run(result);
    Want want = {.result = result,
                 .finest = is_usable(&result->finest, error) ? &result->finest : NULL,
                 .scene = scene != NULL ? &scene->what : NULL,
                 .error = error,
                 .rate_hz = rate_hz};
    char limit[24];
    *advice = (Advice){.time_only = want.finest == NULL};
    advice->run = choose(&want, &advice->met, &advice->holds);
    // Nothing to compare: say so and stop.
    if (advice->run < 0) {
        say(advice,
            "No advice: no case that a scene can ask for could be compared with a "
            "reference that is known to %s.",
            table_percent(error, limit));
        say_folds(result, advice);
        const StudyReference *known = result->finest.known ? &result->finest : NULL;
        if (known == NULL && scene != NULL)
            known = study_time_reference(result, &scene->what);
        if (known != NULL && known->known && isfinite(own_error(known)))
            say(advice, " References are known to %s: ask for more with --error.",
                table_percent(own_error(known), limit));
        return;
    }
    // Of the chosen run its own error and that of its reference count.
    const StudyRun *run = &result->run[advice->run];
    advice->error = whole_error(&want, run);
    // The sentence: choice, error, cost, and what it misses.
    if (advice->met)
        say(advice, "The cheapest choice within %s that holds %.4g Hz on this machine is \"%s\": ",
            table_percent(error, limit), rate_hz, run->what.name);
    else if (advice->holds)
        say(advice,
            "Nothing here is within %s and holds %.4g Hz on this machine; the nearest is "
            "\"%s\": ",
            table_percent(error, limit), rate_hz, run->what.name);
    else
        say(advice,
            "No advice: nothing here holds %.4g Hz on this machine; the nearest is \"%s\": ",
            rate_hz, run->what.name);
    say_error(&want, run, advice);
    say(advice, "; ");
    say_cost(run, advice);
    if (!advice->met) {
        say(advice, "; ");
        say_misses(&want, run, advice);
    }
    say(advice, ".");
    say_time_only(&want, advice);
    say_folds(result, advice);
    say_next(&want, run, advice);
}

// --- the total error, as far as it is known ------------------------------------------------------

// Chooses within the asked-for error, or the least round one that can be promised.
static void choose_total(Want *want, Advice *advice)
{
    static const double LIMITS[] = {0.01, 0.02, 0.05, 0.1, 0.2, 0.5};
    const double error = want->error;
    advice->run = choose(want, &advice->met, &advice->holds);
    for (size_t i = 0; i < sizeof LIMITS / sizeof LIMITS[0] && !advice->met; i++) {
        if (LIMITS[i] <= error)
            continue;
        want->error = LIMITS[i];
        advice->run = choose(want, &advice->met, &advice->holds);
    }
    if (!advice->met)
        advice->run = -1;
}

// Advises by the errors that bodies estimate of themselves, the same numbers by which they steer
// their detail.
static void say_estimated(const StudyResult *result, double error, double rate_hz, Advice *advice)
{
    Want want = {.result = result, .error = error, .rate_hz = rate_hz, .estimated = true};
    char limit[24], sum[24], force[24];
    choose_total(&want, advice);
    if (advice->run < 0)
        return;
    const StudyRun *run = &result->run[advice->run];
    advice->error = whole_error(&want, run);
    say(advice,
        " By what the body estimates of itself, the cheapest choice within %s that holds %.4g Hz "
        "is \"%s\": error in space %s",
        table_percent(want.error, limit), rate_hz, run->what.name,
        table_percent(run->estimated, sum));
    if (isfinite(run->estimated_force))
        say(advice, ", of the force on the tool %s", table_percent(run->estimated_force, force));
    say(advice, ", %.3g ms for a simulated second.", 1e3 * run->cpu_median);
}

// Says why nothing can be said of the total error.
static void say_unknown(const StudyReference *finest, Advice *advice)
{
    static const char NONE[] = "none: ";
    if (strncmp(finest->what, NONE, strlen(NONE)) == 0)
        say(advice, "No advice in all: no reference, %s.", finest->what + strlen(NONE));
    else
        say(advice, "No advice in all: the finest mesh, %s, has no finer one to be judged by.",
            finest->what);
}

void advice_make_total(const StudyResult *result, double error, double rate_hz, Advice *advice)
{
    const StudyReference *finest = &result->finest;
    char limit[24];
    *advice = (Advice){.run = -1};
    if (!finest->known || !isfinite(own_error(finest))) {
        say_unknown(finest, advice);
        say_estimated(result, error, rate_hz, advice);
        return;
    }
    Want want = {.result = result, .finest = finest, .error = error, .rate_hz = rate_hz};
    choose_total(&want, advice);
    if (advice->run < 0) {
        say(advice, "No advice in all: nothing here is within %s and holds %.4g Hz",
            table_percent(want.error, limit), rate_hz);
    } else {
        const StudyRun *run = &result->run[advice->run];
        advice->error = whole_error(&want, run);
        say(advice, "In all, the cheapest choice within %s that holds %.4g Hz is \"%s\": ",
            table_percent(want.error, limit), rate_hz, run->what.name);
        say_error(&want, run, advice);
        say(advice, ", %.3g ms for a simulated second", 1e3 * run->cpu_median);
    }
    if (want.error > error)
        say(advice, "; the two finest meshes differ by %s%s",
            table_percent(finest->difference[1], limit),
            result->wall && !result->bends ? ", as a wall folds that does not bend" : "");
    say(advice, ".");
}

double study_error(const StudyErrors *errors)
{
    return isnan(errors->patch) ? errors->surface : errors->patch;
}

void pareto_front(int count, const double *costs, const double *errors, bool *front)
{
    for (int i = 0; i < count; i++) {
        front[i] = isfinite(costs[i]) && isfinite(errors[i]);
        for (int j = 0; j < count && front[i]; j++)
            if (costs[j] <= costs[i] && errors[j] <= errors[i] &&
                (costs[j] < costs[i] || errors[j] < errors[i]))
                front[i] = false;
    }
}

void study_front_total(const StudyResult *result, bool *front)
{
    double costs[STUDY_CASES], errors[STUDY_CASES];
    for (int i = 0; i < result->run_count; i++) {
        const StudyRun *run = &result->run[i];
        costs[i] = run->verdict == STUDY_OK ? run->cpu_median : (double)NAN;
        errors[i] = study_error(&run->total);
    }
    pareto_front(result->run_count, costs, errors, front);
}

const StudyRun *study_scene_run(const StudyResult *result)
{
    for (int i = 0; i < result->run_count; i++)
        if (result->run[i].what.is_scene)
            return &result->run[i];
    return NULL;
}

const StudyReference *study_time_reference(const StudyResult *result, const StudyCase *of)
{
    for (int i = 0; i < result->mesh_count; i++) {
        const StudyMesh *mesh = &result->mesh[i];
        const StudyCase like = {.detail = mesh->detail,
                                .level = mesh->level,
                                .threshold = mesh->threshold,
                                .paper_rule = mesh->paper_rule};
        if (study_same_mesh(&like, of))
            return &mesh->reference;
    }
    return NULL;
}

const char *study_mesh_words(const StudyResult *result, const StudyCase *like)
{
    for (int i = 0; i < result->run_count; i++) {
        const char *comma = strchr(result->run[i].what.name, ',');
        if (comma != NULL && comma[1] == ' ' && study_same_mesh(&result->run[i].what, like))
            return comma + 2;
    }
    return "no case's";
}
