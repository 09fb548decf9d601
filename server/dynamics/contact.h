// Contact of one tool with one body (contact.md): a penalty on faces with one closest pair each,
// soft minimum for capsules, remembered sides, a proxy that yields beyond max_force, bristle
// friction. Contact knows no physics of the body: it reads node rows and adds node forces. Step
// thread.
#ifndef PLIANT_DYNAMICS_CONTACT_H
#define PLIANT_DYNAMICS_CONTACT_H

#include "base/arena.h"
#include "base/state.h"
#include "dynamics/body.h"
#include "dynamics/tool.h"

typedef struct Contact Contact;

// What a contact gathers over a tick; read when the tick ends, cleared by contact_begin_tick.
typedef struct ContactSums {
    Vec3 impulse;  // on the tool [N s]
    Vec3 about;    // the proxy's position when the tick began [m]
    Vec3 moment;   // of the impulse about that point [N m s]
    Vec3 point;    // impulse-weighted contact point, times `weight`
    Vec3 normal;   // impulse-weighted normal out of the body, times `weight`
    double weight; // [N s]
    double depth;  // largest [m]
} ContactSums;

// The law of contact with this body: sets contact_kappa so that the stiffness of a contact stays in
// the given share of the body's own (contact.md 2.1), and the firmness of faces and nodes where the
// body has memory for it. Such a body calls it again when its faces or masses have changed: kappa
// may change then, its products with firmness do so only where masses or areas did.
void contact_set_stiffness(Body *body);
// What one tool adds to the bounds of the body: of M^-1 K [1/s2] and M^-1 C [1/s].
void contact_bounds(const Body *body, const ToolOptions *tool, double *lambda, double *damping);

// Load time. Either the tool's capsules or its plane; a tool with both has two contacts. `name` is
// "body/tool7" in lists of arrays. The body and the options outlive the contact.
Contact *contact_create(const char *name, const ToolOptions *tool, bool plane, Body *body,
                        Arena *arena, StateList *state);

// Once a tick: clears the sums; finds the faces (or nodes) that the tool can reach while it moves
// from `begin` to `end`, and the side on which it stands.
void contact_begin_tick(Contact *contact, Vec3 begin, Vec3 end, Quat orientation, double tick);
// False when the tool cannot reach the body in this tick: contact_apply is not needed.
bool contact_is_near(const Contact *contact);
// Before the first stage of each substep: chooses where the proxy goes in it, towards the tool's
// pose.
void contact_begin_substep(Contact *contact, Vec3 target, Quat orientation, double h);
// At every stage, with the proxy a `fraction` of its way along: adds the contact's forces to the
// body's nodes, for that evaluation; `weight` is the stage's share of the substep's impulse.
void contact_apply(Contact *contact, double fraction, double weight, double h);
// After the last stage of a substep: the friction's memory moves on.
void contact_end_substep(Contact *contact);
// After the body's topology has changed, before the next contact_begin_tick: faces that took over
// from others stand on the same side of the tool; nodes that came hold the plane as their parents
// do. The proxy and its friction stay.
void contact_topology_changed(Contact *contact, const TopologyChange *change);
// The tool was withdrawn, or the body was restored: forget sides, friction and proxy.
void contact_clear(Contact *contact);

// The most nodes that one evaluation can push, for BodyOps.reserve_forces.
int contact_node_capacity(const Contact *contact);
// Faces within the tool's reach that had no room among the candidates, since the start: they act as
// if they were not there.
int64_t contact_refused(const Contact *contact);

// One push as a spring between the tool and the point of a face.
typedef struct ContactSpring {
    int node[3];      // of BodySurface
    double weight[3]; // barycentric
    Vec3 normal;      // unit
    double stiffness; // [N/m]
    // What it gives way sideways, where the point stays as the tool moves: it pushes from it, and
    // so turns as the tool goes round. force / distance [N/m]; negative: it draws back.
    double yield;
} ContactSpring;

// Between two ticks: the springs that act at the end of the last one, without friction. Returns how
// many; -1: more than `capacity`.
int contact_springs(Contact *contact, ContactSpring *spring, int capacity);

const ContactSums *contact_sums(const Contact *contact);
// Where the proxy is.
void contact_proxy(const Contact *contact, Vec3 *position, Quat *orientation);

#endif
