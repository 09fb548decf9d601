// SPDX-License-Identifier: MIT
// The force that a haptic device shows between two contacts, and the guard that keeps it passive:
// an observer of the energy at the hand, after Hannaford and Ryu, "Time-domain passivity control of
// haptic interfaces", IEEE Trans. Robotics and Automation 18 (2002). Their controller adds damping
// after energy was generated; this one limits the force before, so that no damping is felt: softly,
// since a force that is cut off is no wall, and strictly when nothing is left to give back.
#include "pliant/client.h"

#include "hand.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double PERIOD_MOST = 0.05;  // [s] a velocity predicts no further,
static const double PERIOD_USUAL = 1e-3; // and before the second call this far

// What no prediction sees is paid from a credit: half of what is there is for a way as long as the
// longest of late.
static const double CREDIT = 1e-3, CREDIT_SPENT = 1.0 - 1e-6; // [J], share at most
static const double WAY_LEAST = 1e-4, WAY_FADES = 0.999;      // [m], per call

// The stiffness that was felt: over this time, from this way on, and if depth explains so much of
// the change of the force. The plane follows jumps within the other two times.
static const double FELT_TIME = 0.05, STIFFNESS_EASES = 0.02, FORCE_EASES = 0.006; // [s]
static const double FORCE_STEP = 0.02;                 // of the force, that is no jump
static const double FELT_WAY = 1e-4, FELT_SHARE = 0.5; // [m], of the variance
// The soft limit is a spring, so much stiffer than the plane. A hand that comes in with this
// velocity feels half of what the spring withholds. Damping with it was tried: it adds little.
static const double STIFFER = 1.5, INWARD = 0.02, SMOOTH_TIME = 4e-3; // [m/s], of the velocity [s]
// At least this share is shown: a hand that felt nothing would never put anything in.
static const double SHARE_LEAST = 0.03;

// What successive contacts have shown: means and (co)variances of late along the normal.
typedef struct Felt {
    double position[3], force[3];         // means [m], [N]
    double depth_2, force_2, depth_force; // [m^2], [N^2], [N m]
    double more;                          // stiffness beyond the published one [N/m]
} Felt;

struct PliantHaptic {
    double max_force; // [N]
    bool guard;
    // the newest contact
    HandForce last;
    bool heard;
    double time, received, damping; // server's [s], pliant_now [s], [N s/m]
    double velocity[3];             // of the tool at the contact [m/s]
    bool velocity_known;
    Felt felt;
    // the last call
    bool called;
    double now, position[3], force[3];
    double smooth[3]; // velocity, low-passed [m/s]
    double period;    // between the last two calls [s]
    // Where the hand went last, mainly along each axis; 0: nowhere, or back [m].
    double recent[3][3];
    double longest; // way between two calls, fading [m]
    double energy;  // work of the hand that may be given back [J]
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
    haptic->period = PERIOD_USUAL;
    haptic->longest = WAY_LEAST;
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

// Returns the stiffness along a force or another direction [N/m]; 0: not known.
static double stiffness_along(const HandForce *plane, const double force[3])
{
    double sum = 0.0;
    for (int i = 0; i < 3; i++)
        sum += force[i] * dot(plane->stiffness[i], force);
    const double size = dot(force, force);
    return sum > 0.0 && size > 0.0 ? sum / size : 0.0;
}

// Takes the newest contact, so long after the one before, into what was felt [s].
static void feel(Felt *felt, const HandForce *plane, double passed)
{
    const double fresh = passed / (FELT_TIME + passed), old = 1.0 - fresh;
    double depth = 0.0, force = 0.0;
    for (int k = 0; k < 3; k++) {
        const double way = plane->position[k] - felt->position[k];
        const double change = plane->force[k] - felt->force[k];
        depth -= plane->normal[k] * way;
        force += plane->normal[k] * change;
        felt->position[k] += fresh * way;
        felt->force[k] += fresh * change;
    }
    felt->depth_2 = old * (felt->depth_2 + fresh * depth * depth);
    felt->force_2 = old * (felt->force_2 + fresh * force * force);
    felt->depth_force = old * (felt->depth_force + fresh * depth * force);
    // The slope of a line through them, if there is one: a body that moves by itself shows none.
    const double both = felt->depth_force, slope = both / felt->depth_2;
    if (felt->depth_2 > FELT_WAY * FELT_WAY && both > 0.0 && isfinite(slope) &&
        both * slope > FELT_SHARE * felt->force_2)
        felt->more = fmax(0.0, slope - stiffness_along(plane, plane->normal));
}

// Goes from the plane before towards the newest one: a jump of the stiffness is one of the force
// far from the contact, and the force of a wall that snaps, or of late contacts, jumps by itself.
// What is no jump is not delayed: a late plane is less of a wall.
static void ease(HandForce *plane, const HandForce *before, double passed)
{
    const double stiffer = passed / (STIFFNESS_EASES + passed);
    HandForce eased = *plane;
    double step[3];
    for (int i = 0; i < 3; i++) {
        step[i] = plane->force[i] - before->force[i];
        for (int k = 0; k < 3; k++) {
            step[i] += before->stiffness[i][k] * (plane->position[k] - before->position[k]);
            const double more = plane->stiffness[i][k] - before->stiffness[i][k];
            eased.stiffness[i][k] = before->stiffness[i][k] + stiffer * more;
        }
    }
    const double free = FORCE_STEP * sqrt(dot(plane->force, plane->force) / dot(step, step));
    const double later = 1.0 - fmin(1.0, fmax(passed / (FORCE_EASES + passed), free));
    for (int i = 0; i < 3 && later > 0.0; i++)
        eased.force[i] -= later * step[i];
    // Numbers too large to compute with must not stay.
    if (all_finite(eased.force, 3) && all_finite(&eased.stiffness[0][0], 9))
        *plane = eased;
}

// Makes a plane of the newest contact. Along its normal the stiffness is raised to the one that was
// felt: a plane that is softer than the body leaves the rest of it to contacts, which are late.
static void update_plane(PliantHaptic *haptic, const HandForce *before, double passed)
{
    HandForce *plane = &haptic->last;
    Felt *felt = &haptic->felt;
    const bool goes_on = haptic->heard && plane->contact && passed >= 0.0 && passed <= PERIOD_MOST;
    if (goes_on) {
        feel(felt, plane, passed);
    } else {
        *felt = (Felt){.more = 0.0};
        memcpy(felt->position, plane->position, sizeof felt->position);
        memcpy(felt->force, plane->force, sizeof felt->force);
    }
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            plane->stiffness[i][k] += felt->more * plane->normal[i] * plane->normal[k];
    if (goes_on && before->contact)
        ease(plane, before, passed);
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
    const HandForce before = haptic->last;
    haptic->last = (HandForce){.contact = contact->contact, .valid = contact->valid};
    memcpy(haptic->last.position, contact->position, sizeof contact->position);
    memcpy(haptic->last.force, contact->force, sizeof contact->force);
    memcpy(haptic->last.normal, contact->normal, sizeof contact->normal);
    memcpy(haptic->last.stiffness, contact->stiffness, sizeof contact->stiffness);
    update_plane(haptic, &before, passed);
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

// Remembers where the hand went since the last call, unless it rests. An encoder counts steps, one
// axis at a time and none in most calls: the next step goes where one of the last ones went, until
// the hand turns.
static void remember(PliantHaptic *haptic, const double way[3])
{
    int axis = 0;
    for (int k = 1; k < 3; k++)
        axis = fabs(way[k]) > fabs(way[axis]) ? k : axis;
    if (way[axis] == 0.0)
        return;
    for (int k = 0; k < 3; k++) {
        if (dot(haptic->recent[k], way) < 0.0)
            memset(haptic->recent[k], 0, sizeof haptic->recent[k]);
    }
    memcpy(haptic->recent[axis], way, sizeof haptic->recent[axis]);
}

// Adds the work of the hand since the last call; the device has held the last force. Returns false
// if the numbers are beyond any hand.
static bool observe(PliantHaptic *haptic, const double position[3])
{
    double way[3] = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3 && haptic->called; k++)
        way[k] = position[k] - haptic->position[k];
    if (!all_finite(way, 3))
        return false;
    haptic->energy -= dot(haptic->force, way);
    // A jump may cost more than the credit. A little is left, to be paid back from.
    haptic->energy = fmax(haptic->energy, -CREDIT_SPENT * CREDIT);
    haptic->longest = fmax(fmax(WAY_LEAST, sqrt(dot(way, way))), WAY_FADES * haptic->longest);
    remember(haptic, way);
    return true;
}

// Returns how much more than `most` the force would do on the way, per metre of its largest
// component, and that way scaled by it: a product of small numbers would be 0.
static double excess(const double force[3], const double way[3], double most, double scaled[3])
{
    const double size = fmax(fabs(way[0]), fmax(fabs(way[1]), fabs(way[2])));
    for (int k = 0; k < 3; k++)
        scaled[k] = size > 0.0 ? way[k] / size : 0.0;
    return size > 0.0 ? dot(force, scaled) - most / size : 0.0;
}

// Drops the part of the force along the way that would do more than `most`.
static void drop(double force[3], const double way[3], double most)
{
    double scaled[3];
    const double more = excess(force, way, most, scaled);
    for (int k = 0; k < 3 && more > 0.0; k++)
        force[k] -= more / dot(scaled, scaled) * scaled[k];
}

// Scales the force down until it does no more than `most`, but for what the steps before rounded.
static void scale(double force[3], const double way[3], double most)
{
    const double rounding = 1e-12;
    double scaled[3];
    const double more = excess(force, way, most, scaled), power = dot(force, scaled);
    if (!(more > rounding * sqrt(dot(force, force))))
        return;
    for (int k = 0; k < 3; k++)
        force[k] *= fmax(0.0, 1.0 - more / power);
}

// Limits the force to that of a spring that holds what is left: it ends no sooner than the hand
// leaves, where a force that lasts until nothing is left would end at once. A hand on its way in
// gives whatever it feels, and may feel more.
static void soften(const PliantHaptic *haptic, double stiffness, double left, double force[3])
{
    const double stored = 0.5 * dot(force, force) / stiffness; // by the plane [J]
    const double share = fmax(SHARE_LEAST, sqrt(STIFFER * left / stored));
    const double in = fmin(0.0, dot(haptic->smooth, haptic->last.normal)) / INWARD;
    const double shown = share + (1.0 - share) * in * in / (1.0 + in * in);
    for (int k = 0; k < 3 && share < 1.0; k++)
        force[k] *= shown;
}

// Reduces the force to one that gives no more than is left if the hand goes on as its velocity
// says, or as it went before. Every step makes the force smaller.
static void limit(PliantHaptic *haptic, const double velocity[3], double force[3])
{
    // Twice what a spring of this stiffness stores: tissue whose force grows as a power of the
    // depth d^n stores 2 n / (n + 1) times a spring's of its tangent stiffness, below 2.
    const double stiffness = stiffness_along(&haptic->last, force);
    if (stiffness > 0.0)
        haptic->energy = fmin(haptic->energy, dot(force, force) / stiffness);
    const double left = fmax(0.0, haptic->energy);
    if (stiffness > 0.0)
        soften(haptic, stiffness, left, force);
    const double *n = haptic->last.normal;
    const double inward[3] = {-n[0], -n[1], -n[2]};
    double going[4][3];
    for (int k = 0; k < 3; k++)
        going[0][k] = velocity[k] * haptic->period;
    memcpy(going[1], haptic->recent, sizeof haptic->recent);
    for (int i = 0; i < 4; i++)
        drop(force, going[i], left);
    // What was dropped of a slanted force may leave one into the body. Without that part it may
    // give more again.
    drop(force, inward, 0.0);
    for (int i = 0; i < 4; i++)
        scale(force, going[i], left);
    // And wherever it goes.
    const double most = 0.5 * (CREDIT + haptic->energy) / haptic->longest;
    const double size = sqrt(dot(force, force));
    for (int k = 0; k < 3 && size > most; k++)
        force[k] *= most / size;
}

void pliant_haptic_force(PliantHaptic *haptic, const double position[3], const double velocity[3],
                         double now, double force[3])
{
    memset(force, 0, 3 * sizeof *force);
    if (!isfinite(now) || !all_finite(position, 3) || (velocity && !all_finite(velocity, 3)) ||
        !observe(haptic, position)) {
        // Where the hand went is not known: nothing is left to give back.
        haptic->energy = fmin(haptic->energy, 0.0);
        haptic->called = false;
        memset(haptic->smooth, 0, sizeof haptic->smooth);
        return;
    }
    const double period = haptic->called ? now - haptic->now : 0.0;
    for (int k = 0; k < 3 && period > 0.0; k++)
        haptic->smooth[k] += ((position[k] - haptic->position[k]) - haptic->smooth[k] * period) /
                             (SMOOTH_TIME + period);
    if (!all_finite(haptic->smooth, 3))
        memset(haptic->smooth, 0, sizeof haptic->smooth);
    double going[3] = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3 && (velocity || (period > 0.0 && period <= PERIOD_MOST)); k++)
        going[k] = velocity ? velocity[k] : (position[k] - haptic->position[k]) / period;
    if (period > 0.0)
        haptic->period = fmin(period, PERIOD_MOST);
    // A force that has expired is none.
    if (haptic->heard && haptic->last.contact && now - haptic->received <= haptic->last.valid)
        show_plane(haptic, position, velocity ? velocity : haptic->smooth, force);
    const bool touches = dot(force, force) > 0.0;
    if (touches && haptic->guard)
        limit(haptic, going, force);
    if (!all_finite(force, 3))
        memset(force, 0, 3 * sizeof *force); // numbers beyond any device's
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
