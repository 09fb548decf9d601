// SPDX-License-Identifier: MIT
// Changes of a body's topology by any cause: everything that refers to its nodes and faces follows.
// Step thread.
#include "sim/follow.h"

#include "sim/hold/tie.h"
#include "sim/guard/guard.h"
#include "sim/time_step.h"

// Prepares everything that refers to a body's nodes for a possible change.
static void expect(Sim *sim, int b)
{
    for (int k = sim->attachment_start[b]; k < sim->attachment_start[b + 1]; k++)
        attachment_remember(sim->attachment[k], &sim->body[b]);
    for (int k = 0; k < sim->joint_count; k++)
        attachment_remember(sim->joint[k], &sim->body[b]);
}

static void follow(Sim *sim, int b, const TopologyChange *change)
{
    // Contacts: candidate faces and their sides.
    for (int k = sim->contact_start[b]; k < sim->contact_start[b + 1]; k++)
        contact_topology_changed(sim->contact[k], change);
    // What is held of the body, and what its ties hang on, on either side.
    for (int k = sim->attachment_start[b]; k < sim->attachment_start[b + 1]; k++)
        attachment_topology_changed(sim->attachment[k], &sim->body[b], change);
    for (int k = 0; k < sim->joint_count; k++)
        attachment_topology_changed(sim->joint[k], &sim->body[b], change);
    if (sim->ties != NULL)
        ties_bound(sim);
    // What touches the body, and what of it touches others.
    for (int k = 0; k < sim->touch_count; k++)
        for (int which = 0; which < touch_bodies(touch_options(sim->touch[k])); which++)
            if (touch_options(sim->touch[k])->body[which] == b)
                touch_topology_changed(sim->touch[k], which, change);
    // Loads keep their force; energies are counted anew, and steps may differ.
    loads_follow(&sim->loads, sim->body, sim->body_count, b, change);
    guard_renew(sim, b);
    time_step_follow(sim, &sim->body[b]);
}

void change_body(Sim *sim, int b, BodyChange *make, void *context)
{
    Body *body = &sim->body[b];
    TopologyChange change = {.again = true};
    body->step = sim->clock->step;
    while (change.again) {
        change = (TopologyChange){0};
        expect(sim, b);
        const int topology = body->mesh.topology;
        const bool changed = make(sim, b, context, &change);
        body->mesh.topology = changed ? topology_after(topology) : topology;
        if (!changed)
            return;
        follow(sim, b, &change);
    }
}

void change_inside(Sim *sim, int b, BodyChange *make, void *context)
{
    Body *body = &sim->body[b];
    TopologyChange change = {0};
    body->step = sim->clock->step;
    const int topology = body->mesh.topology;
    // A change inside leaves the account of energy as it is.
    if (make(sim, b, context, &change)) {
        body->mesh.topology = topology_after(topology);
        follow(sim, b, &change);
    }
}
