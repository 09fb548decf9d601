// On which side of each face a tool stands (contact.md 3): a hollow wall pushes the tool back to
// the side from which it came, even after the axis has crossed it. Step thread, once a tick.
#include "dynamics/contact_data.h"

#include "geometry/distance.h"

// Nearest pair of a capsule's axis and a candidate; at no distance when the axis passes through.
static void nearest_pair(const Contact *contact, const Candidate *candidate, Vec3 p, Vec3 q,
                         ClosestPair *nearest)
{
    Vec3 x[3] = {contact->x[candidate->node[0]], contact->x[candidate->node[1]],
                 contact->x[candidate->node[2]]};
    ClosestPair pair[DISTANCE_PAIRS];
    double along, weight[3];
    distance_segment_triangle_pairs(p, q, x, pair);
    *nearest = pair[0];
    for (int j = 1; j < DISTANCE_PAIRS; j++)
        if (pair[j].distance < nearest->distance)
            *nearest = pair[j];
    if (distance_segment_crosses(p, q, x, &along, weight))
        nearest->distance = 0.0;
}

// On which side of a face the axis stands; at a free border, of the face's plane.
static signed char seen_side(const Contact *contact, const Candidate *candidate,
                             const ClosestPair *nearest)
{
    int sign = contact_sign(contact, candidate, nearest->weight, nearest->on_triangle,
                            nearest->on_segment);
    if (sign == 0) {
        Vec3 normal = contact_face_normal(contact, candidate);
        Vec3 away = vec3_sub(nearest->on_segment, nearest->on_triangle);
        sign = vec3_dot(away, normal) < 0.0 ? -1 : 1;
    }
    return (signed char)sign;
}

// Whether the nearest point of all candidates lies on a free border: the tool stands beside the
// body, may go to either side, and every side is as it is seen.
static bool is_beside_border(const Contact *contact, Vec3 p, Vec3 q)
{
    double least = (double)INFINITY;
    bool beside = false;
    for (int i = 0; i < contact->candidate_count; i++) {
        const Candidate *candidate = &contact->candidate[i];
        ClosestPair nearest;
        nearest_pair(contact, candidate, p, q, &nearest);
        if (nearest.distance < least) {
            least = nearest.distance;
            beside = contact_sign(contact, candidate, nearest.weight, nearest.on_triangle,
                                  nearest.on_segment) == 0;
        }
    }
    return beside;
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
    bool beside = contact->at_border && is_beside_border(contact, p, q);
    bool any_new = false;
    for (int i = 0; i < contact->candidate_count; i++) {
        const Candidate *candidate = &contact->candidate[i];
        if (side[candidate->face] != 0 && !beside)
            continue;
        ClosestPair nearest;
        nearest_pair(contact, candidate, p, q, &nearest);
        contact->distance[i] = nearest.distance;
        contact->seen_side[i] = seen_side(contact, candidate, &nearest);
        side[candidate->face] = 0;
        any_new = true;
    }
    for (int sweep = beside ? 2 : 0; any_new && sweep < 3; sweep++) {
        for (int i = 0; i < contact->candidate_count; i++) {
            const Candidate *candidate = &contact->candidate[i];
            if (side[candidate->face] != 0)
                continue;
            if (sweep == 2)
                side[candidate->face] = contact->seen_side[i];
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
