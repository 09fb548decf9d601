// What a contact remembers of a body's faces and nodes, carried over a change of topology. Step
// thread, before the next tick's candidates are found.
#include "dynamics/contact_data.h"

// A tool does not cross a wall by its being divided: faces stand where those that lay there stood.
// Where several merge, the first that was a candidate tells.
static void follow_faces(Contact *contact, signed char *side, const TopologyChange *change)
{
    signed char *old = contact->old_side;
    for (int i = 0; i < change->face_count; i++) {
        const FaceChange *face = &change->face[i];
        if (face->from >= 0)
            old[face->from] = side[face->from];
    }
    for (int i = 0; i < change->face_count; i++)
        side[change->face[i].face] = 0;
    for (int i = 0; i < change->face_count; i++) {
        const FaceChange *face = &change->face[i];
        if (face->from >= 0 && side[face->face] == 0)
            side[face->face] = old[face->from];
    }
}

// A node on the plane comes with the hold that its place had between its parents.
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
            follow_faces(contact, contact->side[shape], change);
    contact_forget_candidates(contact);
}
