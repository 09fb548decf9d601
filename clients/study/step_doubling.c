#include "study/step_doubling.h"

#include "base/clock.h"

#include <math.h>
#include <stdlib.h>

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
    body->unsafe_time_step = true;
    body->time_step_wanted = sim_tick(sim) / substeps;
    body->substeps = substeps;
    body->h = sim_tick(sim) / substeps;
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
        bool accepted = difference <= doubling->tolerance || tries + 1 >= MOST_TRIES;
        if (accepted) {
            doubling->worst = fmax(doubling->worst, difference);
            doubling->resets += fine_resets;
        }
        doubling->substeps = choose(doubling, difference);
        if (accepted)
            return spent;
        doubling->refused++;
        state_copy_in(&world->state, doubling->before);
        sim_restored(world->sim);
    }
}
