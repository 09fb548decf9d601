// The force that a haptic device shows between two contacts, and the guard that keeps it passive:
// an observer of the energy at the hand, after Hannaford and Ryu, "Time-domain passivity control of
// haptic interfaces", IEEE Trans. Robotics and Automation 18 (2002). Their controller adds damping
// after energy was generated; this one limits the force before, so that no damping is felt.
#include "pliant/client.h"

#include "hand.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double PERIOD_MOST = 0.05;  // [s] a longer pause predicts nothing,
static const double PERIOD_USUAL = 1e-3; // and this is assumed after it

struct PliantHaptic {
    double max_force; // [N]
    bool guard;
    // the newest contact
    HandForce last;
    bool heard;
    double time, received, damping; // server's [s], pliant_now [s], [N s/m]
    double velocity[3];             // of the tool at the contact [m/s]
    bool velocity_known;
    // the last call
    bool called;
    double now, position[3], force[3];
    double energy; // work of the hand that may be given back [J]
};

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static bool all_finite(const double *number, int count)
{
    for (int k = 0; k < count; k++) {
        if (!isfinite(number[k]))
            return false;
    }
    return true;
}

PliantHaptic *pliant_haptic_create(double max_force, bool guard)
{
    if (!(max_force > 0.0) || !isfinite(max_force))
        return NULL;
    PliantHaptic *haptic = calloc(1, sizeof *haptic);
    if (!haptic)
        abort(); // the machine is out of memory
    haptic->max_force = max_force;
    haptic->guard = guard;
    return haptic;
}

void pliant_haptic_destroy(PliantHaptic *haptic)
{
    free(haptic);
}

static bool contact_is_finite(const PliantContact *contact)
{
    return isfinite(contact->time) && isfinite(contact->received) && isfinite(contact->valid) &&
           isfinite(contact->damping) && all_finite(contact->position, 3) &&
           all_finite(contact->force, 3) && all_finite(contact->normal, 3) &&
           all_finite(&contact->stiffness[0][0], 9);
}

void pliant_haptic_take(PliantHaptic *haptic, const PliantContact *contact)
{
    if (contact == NULL || !contact_is_finite(contact) ||
        (haptic->heard && contact->received <= haptic->received))
        return;
    // How fast the tool moved: the force of the contact's damping is that of this velocity.
    const double passed = contact->time - haptic->time;
    haptic->velocity_known = haptic->heard && passed > 0.0 && passed <= PERIOD_MOST;
    for (int k = 0; k < 3 && haptic->velocity_known; k++)
        haptic->velocity[k] = (contact->position[k] - haptic->last.position[k]) / passed;
    // The contact itself.
    haptic->last = (HandForce){.contact = contact->contact, .valid = contact->valid};
    memcpy(haptic->last.position, contact->position, sizeof contact->position);
    memcpy(haptic->last.force, contact->force, sizeof contact->force);
    memcpy(haptic->last.normal, contact->normal, sizeof contact->normal);
    memcpy(haptic->last.stiffness, contact->stiffness, sizeof contact->stiffness);
    haptic->time = contact->time;
    haptic->received = contact->received;
    haptic->damping = fmax(0.0, contact->damping);
    haptic->heard = true;
}

// Computes the plane's force.
static void show_plane(const PliantHaptic *haptic, const double position[3],
                       const double velocity[3], double force[3])
{
    HandForce plane = haptic->last;
    const double faster = haptic->velocity_known
                              ? dot(plane.normal, velocity) - dot(plane.normal, haptic->velocity)
                              : 0.0;
    for (int k = 0; k < 3; k++)
        plane.force[k] -= haptic->damping * faster * plane.normal[k];
    hand_show(&plane, position, true, haptic->max_force, force);
}

// Returns the stiffness along the force [N/m]; 0: not known.
static double stiffness_along(const HandForce *plane, const double force[3])
{
    double sum = 0.0;
    for (int i = 0; i < 3; i++)
        sum += force[i] * dot(plane->stiffness[i], force);
    const double size = dot(force, force);
    return sum > 0.0 && size > 0.0 ? sum / size : 0.0;
}

// Adds the work of the hand since the last call; the device has held the last force.
static void observe(PliantHaptic *haptic, const double position[3])
{
    for (int k = 0; k < 3 && haptic->called; k++)
        haptic->energy -= haptic->force[k] * (position[k] - haptic->position[k]);
}

// Reduces the force by what would give more than is left, if the hand goes on for `period` [s].
static void limit(PliantHaptic *haptic, const double velocity[3], double period, double force[3])
{
    // Twice what a spring of this stiffness stores: tissue whose force grows as a power of the
    // depth d^n stores 2 n / (n + 1) times a spring's of its tangent stiffness, below 2.
    const double stiffness = stiffness_along(&haptic->last, force);
    if (stiffness > 0.0)
        haptic->energy = fmin(haptic->energy, dot(force, force) / stiffness);
    const double speed2 = dot(velocity, velocity), power = dot(force, velocity);
    const double left = fmax(0.0, haptic->energy);
    if (!(power * period > left))
        return;
    const double drop = (power - left / period) / speed2;
    for (int k = 0; k < 3; k++)
        force[k] -= drop * velocity[k];
}

void pliant_haptic_force(PliantHaptic *haptic, const double position[3], const double velocity[3],
                         double now, double force[3])
{
    memset(force, 0, 3 * sizeof *force);
    double going[3] = {0.0, 0.0, 0.0};
    const double period = haptic->called ? now - haptic->now : 0.0;
    const bool steady = period > 0.0 && period <= PERIOD_MOST;
    if (!isfinite(now) || !all_finite(position, 3) || (velocity && !all_finite(velocity, 3))) {
        // Where the hand went is not known: nothing is left to give back.
        haptic->energy = fmin(haptic->energy, 0.0);
        haptic->called = false;
        return;
    }
    for (int k = 0; k < 3 && (velocity || steady); k++)
        going[k] = velocity ? velocity[k] : (position[k] - haptic->position[k]) / period;
    observe(haptic, position);
    // A force that has expired is none.
    if (haptic->heard && haptic->last.contact && now - haptic->received <= haptic->last.valid)
        show_plane(haptic, position, going, force);
    const bool touches = dot(force, force) > 0.0;
    if (!all_finite(force, 3))
        memset(force, 0, 3 * sizeof *force); // numbers beyond any device's
    else if (touches && haptic->guard)
        limit(haptic, going, steady ? period : PERIOD_USUAL, force);
    if (!touches)
        haptic->energy = fmin(haptic->energy, 0.0);
    haptic->called = true;
    haptic->now = now;
    memcpy(haptic->position, position, sizeof haptic->position);
    memcpy(haptic->force, force, sizeof haptic->force);
}

double pliant_haptic_energy(const PliantHaptic *haptic)
{
    return haptic->energy;
}
