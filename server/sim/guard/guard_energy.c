// SPDX-License-Identifier: MIT
// The energy balance of bodies: their energy from time to time, against what they had and were
// given since. Step thread: a few numbers per tick for each tool in contact, and a measurement of
// all nodes so rarely that it takes less than half a percent of the time.
#include "sim/guard/guard.h"

#include "sim/hold/tie.h"

#include <math.h>

// A measurement costs a dozen evaluations of the forces: one in so many.
enum { EVALUATIONS_A_LOOK = 2048 };

static double most_growth(const Body *body)
{
    return integrator_get(body->integrator)->most_growth;
}

// Returns the energy below which nothing is reported: all nodes displaced by a hundredth of an
// edge, on springs of the largest stable stiffness. Far above rounding, and above what friction,
// starting contacts and settling refinement add outside the account.
static double least_energy(const Body *body)
{
    const double off = 1e-2 * body->surface.longest_edge;
    return body->mass * fmin(body->contact_lambda, 4.0 / (body->h * body->h)) * off * off;
}

// True for more energy than at ease; a number that is not finite counts as more.
static bool is_uneasy(const Body *body)
{
    BodyMeasure measure = {0};
    if (body->ops->measure != NULL)
        body->ops->measure(body->model, &measure);
    return !(measure.kinetic + measure.elastic <= least_energy(body));
}

bool guard_was_pushed(const Sim *sim, int b)
{
    const EnergyAccount *account = &sim->guard->energy[b];
    return sim->contact_count > 0 && !(account->touch <= least_energy(&sim->body[b]));
}

void guard_note_loads(Sim *sim)
{
    const LoadSet *loads = &sim->loads;
    // Loads whose last tick is over.
    for (int64_t k = 0; k < *loads->count; k++) {
        const Load *load = &loads->load[k];
        if (load->end_step > sim->clock->step)
            continue;
        // On each body that still moves or is deformed by it.
        for (int b = 0, first = 0; b < sim->body_count;
             first += sim->body[b++].surface.node_count) {
            GuardBody *at = &sim->guard->body[b];
            if (!loads_act_on(loads, k, first, sim->body[b].surface.node_count) ||
                !is_uneasy(&sim->body[b]))
                continue;
            // Of several the strongest is remembered.
            if (at->loaded > 0 && vec3_length(load->force) < vec3_length(at->load_force))
                continue;
            at->loaded = sim->clock->step + 1;
            at->load_force = load->force;
        }
    }
}

int64_t guard_energy_ticks(const Body *body)
{
    const int stages = integrator_get(body->integrator)->evaluation_count;
    const int64_t ticks = EVALUATIONS_A_LOOK / ((int64_t)body->finest_substeps * stages);
    return ticks > 16 ? ticks : 16;
}

void guard_renew(Sim *sim, int body)
{
    for (int b = 0; b < sim->body_count; b++)
        if (body < 0 || body == b)
            sim->guard->energy[b] = (EnergyAccount){0};
}

// Returns an upper bound of a tool's work on a body in this tick: forces of either sign times the
// path.
static double work_of(const Sim *sim, int k)
{
    const Contact *contact = sim->contact[k];
    const ContactSums *sums = contact_sums(contact);
    const ToolMotion *motion = &sim->motion[sim->contact_tool[k]];
    // The way of the proxy in this tick.
    Vec3 end;
    Quat orientation;
    contact_proxy(contact, &end, &orientation);
    // The turn of the tool in this tick.
    const Quat before = motion->begin_orientation, after = motion->end_orientation;
    const double half = fabs(before.w * after.w + before.x * after.x + before.y * after.y +
                             before.z * after.z); // of the cosine
    // Force over way plus moment over angle, at most.
    return ((sums->weight + vec3_length(sums->impulse)) * vec3_length(vec3_sub(end, sums->about)) +
            vec3_length(sums->moment) * 2.0 * acos(fmin(1.0, half))) /
           sim->tick;
}

// Returns an upper bound of the energy in the springs of contacts.
static double contacts_hold(const Sim *sim, int b)
{
    double energy = 0.0;
    for (int k = sim->contact_start[b]; k < sim->contact_start[b + 1]; k++) {
        const ContactSums *sums = contact_sums(sim->contact[k]);
        if (contact_is_near(sim->contact[k]) && sums->weight > 0.0)
            energy += sums->weight / sim->tick * sums->depth;
    }
    return energy;
}

// True if attachments, other bodies or the body itself act on the body: the account ignores the
// energy of their springs.
static bool is_held(const Sim *sim, int b)
{
    for (int k = sim->attachment_start[b]; k < sim->attachment_start[b + 1]; k++)
        if (attachment_is_holding(sim->attachment[k]))
            return true;
    if (sim->ties != NULL && sim->ties->lambda[b] > 0.0)
        return true;
    for (int t = 0; t < sim->touch_count; t++)
        if (touch_options(sim->touch[t])->body[0] == b ||
            touch_options(sim->touch[t])->body[1] == b)
            return true;
    return sim->group[b].first != b || sim->group[b].next >= 0; // joined with another
}

// Adds the contributions of the tick.
static void add_tick(Sim *sim, int b)
{
    EnergyAccount *account = &sim->guard->energy[b];
    for (int k = sim->contact_start[b]; k < sim->contact_start[b + 1]; k++) {
        if (!contact_is_near(sim->contact[k]) || !(contact_sums(sim->contact[k])->weight > 0.0))
            continue;
        contact_end_tick(sim->contact[k]);
        account->given += work_of(sim, k);
        account->touch += contact_sums(sim->contact[k])->work;
    }
}

EnergyVerdict guard_energy(Sim *sim, int b, double *has, double *most)
{
    Body *body = &sim->body[b];
    EnergyAccount *account = &sim->guard->energy[b];
    const int64_t tick = sim->clock->step + 1;
    add_tick(sim, b);
    // Not in every tick: energies are summed over all nodes.
    if (sim->settling || (tick + b) % guard_energy_ticks(body) != 0)
        return ENERGY_RIGHT;
    // A load that has ended is forgotten when its energy is gone.
    GuardBody *at = &sim->guard->body[b];
    if (at->loaded > 0 && !is_uneasy(body))
        at->loaded = 0;
    // Holds and ties do work that is not counted here.
    if (is_held(sim, b)) {
        *account = (EnergyAccount){0};
        return ENERGY_RIGHT;
    }
    // What the body has now.
    BodyMeasure measure;
    body->ops->measure(body->model, &measure);
    const EnergyAccount before = *account;
    const double held = contacts_hold(sim, b), least = least_energy(body),
                 growth = most_growth(body);
    const double energy = measure.kinetic + measure.elastic;
    // What it had and was given, plus the loss of outer potential; never more than it has now.
    double had = before.had + before.given + fmax(0.0, before.outer - measure.outer);
    if (before.known == 0)
        had = energy + held;
    // The next check starts from here.
    *account = (EnergyAccount){
        .had = fmin(had, energy + held), .outer = measure.outer, .held = held, .known = 1};
    if (before.known == 0)
        return ENERGY_RIGHT;
    // First the contacts by themselves, then all of the energy.
    *has = before.touch;
    *most = before.given + before.held;
    if (*has > *most + had + least)
        return ENERGY_WRONG_TOUCH;
    // Motion can be stopped, a shape must be replaced.
    *has = energy;
    *most = had;
    if (*has <= growth * had + least)
        return ENERGY_RIGHT;
    return measure.elastic > growth * had + least ? ENERGY_WRONG_SHAPE : ENERGY_WRONG_MOTION;
}
