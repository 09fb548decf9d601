// Updates a contact's memory of a body's faces and nodes after a change of topology. Step thread,
// before the next tick's candidates are found.
#include "dynamics/contact_data.h"

// Refinement must not move a tool across a wall: new faces take the side of those that they
// replace. When several merge, the one that was nearest to the tool decides: others may have been
// seen across a fold.
static void follow_faces(Contact *contact, int shape, const TopologyChange *change)
{
    signed char *side = contact->side[shape], *old_side = contact->old_side;
    float *gap = contact->gap[shape], *old_gap = contact->old_gap;
    for (int i = 0; i < change->face_count; i++) {
        int from = change->face[i].from;
        if (from < 0)
            continue;
        old_side[from] = side[from];
        old_gap[from] = gap[from];
    }
    for (int i = 0; i < change->face_count; i++)
        side[change->face[i].face] = 0;
    for (int i = 0; i < change->face_count; i++) {
        int face = change->face[i].face, from = change->face[i].from;
        if (from < 0 || old_side[from] == 0 || (side[face] != 0 && gap[face] <= old_gap[from]))
            continue;
        side[face] = old_side[from];
        gap[face] = old_gap[from];
    }
}

// Gives a new node on the plane the mean bristle of its parents.
static void follow_nodes(Vec3 *bristle, const TopologyChange *change)
{
    for (int i = 0; i < change->gone_count; i++)
        bristle[change->gone[i]] = (Vec3){0.0, 0.0, 0.0};
    for (int i = 0; i < change->born_count; i++) {
        const NodeBirth *born = &change->born[i];
        bristle[born->node] =
            vec3_scale(0.5, vec3_add(bristle[born->parent[0]], bristle[born->parent[1]]));
    }
}

void contact_topology_changed(Contact *contact, const TopologyChange *change)
{
    if (contact->is_plane)
        follow_nodes(contact->plane_bristle, change);
    else
        for (int shape = 0; shape < contact->tool->capsule_count; shape++)
            follow_faces(contact, shape, change);
    contact_forget_candidates(contact);
}
