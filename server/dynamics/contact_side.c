// On which side of each face a tool stands (contact.md 3): a hollow wall pushes the tool back to
// the side from which it came, even after the axis has crossed it. Step thread, once a tick.
#include "dynamics/contact_data.h"

#include "geometry/distance.h"

// Nearest pair of a capsule's axis and a candidate.
static void nearest_pair(const Contact *contact, const Candidate *candidate, Vec3 p, Vec3 q,
                         ClosestPair *nearest)
{
    Vec3 x[3] = {contact->x[candidate->node[0]], contact->x[candidate->node[1]],
                 contact->x[candidate->node[2]]};
    ClosestPair pair[DISTANCE_PAIRS];
    distance_segment_triangle_pairs(p, q, x, pair);
    *nearest = pair[0];
    for (int j = 1; j < DISTANCE_PAIRS; j++)
        if (pair[j].distance < nearest->distance)
            *nearest = pair[j];
}

// Neighbours across edges that already have a side give it to a new candidate.
static signed char inherited_side(const Contact *contact, const Candidate *candidate,
                                  const signed char *side)
{
    const int *across = contact->body->surface.face_neighbor[candidate->face];
    for (int k = 0; k < 3; k++)
        if (across[k] >= 0 && side[across[k]] != 0)
            return side[across[k]];
    return 0;
}

static void update_shape(Contact *contact, const ToolPlacement *at, int shape)
{
    const Capsule *capsule = &contact->tool->capsule[shape];
    signed char *side = contact->side[shape];
    Vec3 p, q;
    contact_axis(capsule, at, &p, &q);
    // Static tools have no proxy that keeps them in front: whatever they meet lies on the same
    // side.
    bool always_inherit = contact->tool->kind == TOOL_STATIC;
    bool any_new = false;
    for (int i = 0; i < contact->candidate_count; i++) {
        const Candidate *candidate = &contact->candidate[i];
        if (side[candidate->face] != 0)
            continue;
        ClosestPair nearest;
        nearest_pair(contact, candidate, p, q, &nearest);
        int sign = contact_sign(contact, candidate, nearest.weight, nearest.on_triangle,
                                nearest.on_segment);
        contact->distance[i] = nearest.distance;
        contact->geometric_side[i] = sign < 0 ? -1 : 1;
        any_new = true;
    }
    for (int sweep = 0; any_new && sweep < 3; sweep++) {
        for (int i = 0; i < contact->candidate_count; i++) {
            const Candidate *candidate = &contact->candidate[i];
            if (side[candidate->face] != 0)
                continue;
            if (sweep == 2)
                side[candidate->face] = contact->geometric_side[i];
            else if (always_inherit || contact->distance[i] < capsule->radius)
                side[candidate->face] = inherited_side(contact, candidate, side);
        }
    }
}

void contact_update_sides(Contact *contact, const ToolPlacement *at)
{
    for (int shape = 0; shape < contact->tool->capsule_count; shape++)
        update_shape(contact, at, shape);
}
