// SPDX-License-Identifier: MIT
// Contact of one tool with one body. Hollow walls (server/sim/README.md, "Contact of faces"): a
// penalty on faces with one closest pair each, a soft minimum for capsules, remembered sides, a
// proxy that yields beyond max_force, bristle friction. Solids ("Contact of solids"): one
// potential, implicit impulses. Independent of the body's physics: it reads node rows and adds
// forces or impulses. Step thread.
#ifndef PLIANT_SIM_CONTACT_H
#define PLIANT_SIM_CONTACT_H

#include "base/memory.h"
#include "body/body.h"
#include "sim/tool.h"

typedef struct Contact Contact;

// Sums of a contact over a tick; read when the tick ends, cleared by contact_begin_tick.
typedef struct ContactSums {
    Vec3 impulse;  // on the tool [N s]
    Vec3 about;    // the proxy's position at the start of the tick [m]
    Vec3 moment;   // of the impulse about that point [N m s]
    Vec3 point;    // impulse-weighted contact point, times `weight`
    Vec3 normal;   // impulse-weighted normal out of the body, times `weight`
    double weight; // [N s]
    double time;   // that has passed [s]
    double depth;  // largest [m]
    double work;   // of the contact's springs and dampers on the body's nodes [J]
} ContactSums;

// Sets contact_kappa so that the stiffness of a contact is the given fraction of the body's own
// (server/sim/README.md, "Contact stiffness"), and the firmness of faces and nodes if the body has
// memory for it. Such a body calls it again when its faces or masses have changed: kappa may change
// then; its product with firmness changes only where masses or areas did.
void contact_set_stiffness(Body *body);
// Computes what one tool adds to the bounds of the body: of M^-1 K [1/s2] and M^-1 C [1/s].
void contact_bounds(const Body *body, const ToolOptions *tool, double *lambda, double *damping);
// Returns how many times the contacts with a tool count in these bounds: more than once if they
// have little damping, in a scheme without numerical damping (server/sim/README.md, "Contacts of
// little damping").
double contact_bounce_share(const Body *body, const ToolOptions *tool);
// The same for contacts of so many times the body's own stiffness.
double contact_bounce_of(const Body *body, double share);

// Creates the contact of the tool's capsules or of its plane; a tool with both has two contacts.
// Load time. `name` is "body/tool7" in lists of arrays. The body and the options outlive the
// contact.
Contact *contact_create(const char *name, const ToolOptions *tool, bool plane, Body *body,
                        Arena *arena, StateList *state);

// Clears the sums; finds the faces (or nodes) that the tool can reach as it moves, and on which
// side of them it is. Once per tick.
void contact_begin_tick(Contact *contact, const ToolMotion *motion, double tick, int64_t step);
// Returns false if the tool cannot reach the body in this tick: contact_apply is not needed.
bool contact_is_near(const Contact *contact);
// Returns true while a tool that was led out of the body is not yet felt with all its force: it is
// where the proxy is, whether it pushes or not.
bool contact_is_easing(const Contact *contact);
// Chooses the proxy's motion in a substep, towards the tool's pose; before its first evaluation.
void contact_begin_substep(Contact *contact, Vec3 target, Quat orientation, double h);
// Adds the contact's forces to the body's nodes for this evaluation, with the proxy a `fraction` of
// its way along; `weight` is the evaluation's share of the substep's impulse. At every evaluation.
// With solids only evaluates them.
void contact_apply(Contact *contact, double fraction, double weight, double h);
// With solids: gives the nodes their impulses of this substep, after the body's own kick, and the
// proxy its motion (server/sim/README.md, "Contact of solids"). Others have nothing left to do.
void contact_kick(Contact *contact, const Evaluation *evaluation, double h);
// Updates the friction's memory; after the last evaluation of a substep.
void contact_end_substep(Contact *contact);
// Completes the work in the sums; after a good tick, with its result as the current state.
void contact_end_tick(Contact *contact);
// Follows a change of the body's topology, before the next contact_begin_tick: new faces are on the
// same side of the tool as those that they replace; new nodes stick to the plane as their parents
// do. The proxy and its friction stay.
void contact_topology_changed(Contact *contact, const TopologyChange *change);
// True if the state read from a checkpoint can have been written by a contact.
bool contact_check(const Contact *contact);
// Clears sides, friction and proxy, after the tool was withdrawn or the body was restored.
void contact_clear(Contact *contact);

// Returns the most nodes that one evaluation can push, for BodyOps.reserve_forces.
int contact_node_capacity(const Contact *contact);
// Returns the number of faces, since the start, within the tool's reach but beyond the capacity for
// candidates: they have no effect.
int64_t contact_refused(const Contact *contact);

// One push, as a spring between the tool and a point of a face.
typedef struct ContactSpring {
    int node[3];      // of BodySurface
    int local[3];     // their local numbers in this tick
    double weight[3]; // barycentric
    Vec3 normal;      // unit
    double stiffness; // [N/m]
    // Sideways yield, for a point that stays while the tool moves: the force acts from it, and so
    // turns as the tool moves around. force / distance [N/m]; negative: it pulls back.
    double yield;
    bool stays; // the point stays in the face (solids), else it slides in it towards the tool
} ContactSpring;

// Lists the springs at the end of the last tick, without friction; between two ticks. Returns their
// number; -1: more than `capacity`.
int contact_springs(Contact *contact, ContactSpring *spring, int capacity);

const ContactSums *contact_sums(const Contact *contact);
// Returns position and orientation of the proxy.
void contact_proxy(const Contact *contact, Vec3 *position, Quat *orientation);

#endif
