// Grasping and releasing. Step thread, once per tick.
#include "dynamics/attachment_data.h"
#include "dynamics/contact_data.h"

#include <string.h>

enum {
    NODES_ENOUGH = 3
}; // with fewer, points of faces are held: a single node cannot resist rotation

static Vec3 local_position(Vec3 x, Vec3 position, Quat orientation)
{
    return quat_rotate(quat_conjugate(orientation), vec3_sub(x, position));
}

bool attachment_is_within(const Attachment *attachment, Vec3 local)
{
    for (int k = 0; k < attachment->tool->capsule_count; k++) {
        const Capsule *capsule = &attachment->tool->capsule[k];
        if (distance_point_segment(local, capsule->from, capsule->to) <= capsule->radius)
            return true;
    }
    return false;
}

// Marks the nodes within `margin` of the capsules.
static void mark_near(Attachment *attachment, Vec3 position, Quat orientation, double margin)
{
    const Body *body = attachment->body;
    const ToolPlacement at = {.position = position, .orientation = orientation};
    for (int k = 0; k < attachment->tool->capsule_count; k++) {
        const Capsule *capsule = &attachment->tool->capsule[k];
        Region region = {.kind = REGION_CAPSULE, .radius = capsule->radius + margin};
        contact_axis(capsule, &at, &region.from, &region.to);
        int count = body->ops->find_nodes(body->model, &region, attachment->found,
                                          body->surface.node_count);
        for (int i = 0; i < count; i++)
            attachment_mark(attachment, attachment->found[i]);
    }
}

// Writes the marked nodes to `found`, ascending, and clears the marks. Returns how many.
static int collect_marked(Attachment *attachment)
{
    int count = 0;
    for (int word = 0; word < (attachment->body->surface.node_count + 63) / 64; word++) {
        for (uint64_t bits = attachment->mark[word]; bits != 0; bits &= bits - 1)
            attachment->found[count++] = word * 64 + __builtin_ctzll(bits);
        attachment->mark[word] = 0;
    }
    return count;
}

// Appends a node; returns false if no force can act on it: a hanging node has no mass.
static bool add_node(Attachment *attachment, int node, const HeldNode *held)
{
    HoldState *hold = attachment->hold;
    if (hold->count == attachment->capacity) {
        attachment->refused += held->share > 0.0;
        return false;
    }
    attachment->node[hold->count] = node;
    attachment->held[hold->count++] = *held;
    return held->share > 0.0 && attachment->body->surface.node_mass[node] > 0.0;
}

// Takes the nodes within the capsules and, if the topology changes, those around. Returns how many
// carry force by their mass.
static int take_nodes(Attachment *attachment, Vec3 position, Quat orientation)
{
    const Body *body = attachment->body;
    double margin = attachment->changes ? 2.0 * body->surface.longest_edge : 0.0;
    mark_near(attachment, position, orientation, margin);
    int found = collect_marked(attachment), within = 0;
    for (int i = 0; i < found; i++) {
        int node = attachment->found[i];
        Vec3 x;
        body->ops->read_nodes(body->model, &node, 1, &x, NULL);
        HeldNode held = {.local = local_position(x, position, orientation)};
        bool is_free = !body->ops->is_fixed(body->model, node);
        held.share = is_free && attachment_is_within(attachment, held.local) ? 1.0 : 0.0;
        if (attachment->changes || held.share > 0.0)
            within += add_node(attachment, node, &held);
    }
    return within;
}

// Finds the point of a face nearest to the capsules; returns false if none is within them.
static bool nearest_point(const Attachment *attachment, const ToolPlacement *at, int face,
                          ClosestPair *nearest)
{
    const Body *body = attachment->body;
    Vec3 x[3];
    body->ops->read_nodes(body->model, body->surface.face[face], 3, x, NULL);
    bool within = false;
    double deepest = 0.0;
    for (int k = 0; k < attachment->tool->capsule_count; k++) {
        const Capsule *capsule = &attachment->tool->capsule[k];
        Vec3 p, q;
        ClosestPair pair;
        contact_axis(capsule, at, &p, &q);
        contact_nearest_pair(x, p, q, contact_is_sphere(capsule), &pair);
        double depth = capsule->radius - pair.distance;
        if (depth < 0.0 || (within && depth <= deepest))
            continue;
        within = true;
        deepest = depth;
        *nearest = pair;
    }
    return within;
}

// Finds points of the faces around the nodes found, each face once: by its lowest corner among
// them. `take` false: only counts. Returns how many are within the capsules.
static int find_points(Attachment *attachment, Vec3 position, Quat orientation, bool take)
{
    const Body *body = attachment->body;
    const BodySurface *surface = &body->surface;
    const ToolPlacement at = {.position = position, .orientation = orientation};
    // The marks show which corners were found.
    mark_near(attachment, position, orientation, CONTACT_FACE_REACH * surface->longest_edge);
    int found = collect_marked(attachment), within = 0;
    for (int i = 0; i < found; i++)
        attachment_mark(attachment, attachment->found[i]);
    for (int i = 0; i < found; i++) {
        int node = attachment->found[i];
        for (int j = surface->node_face_start[node]; j < surface->node_face_end[node]; j++) {
            int face = surface->node_face[j];
            bool lowest = true, any_free = false;
            for (int k = 0; k < 3; k++) {
                int corner = surface->face[face][k];
                lowest &= corner >= node || !attachment_is_marked(attachment, corner);
                any_free |= !body->ops->is_fixed(body->model, corner);
            }
            ClosestPair pair;
            if (!lowest || !any_free || !nearest_point(attachment, &at, face, &pair))
                continue;
            within++;
            if (!take)
                continue;
            // Take the point, as far as there are slots.
            if (attachment->hold->points == HELD_POINTS) {
                attachment->refused++;
                continue;
            }
            HeldPoint *point = &attachment->point[attachment->hold->points++];
            point->face = face;
            memcpy(point->weight, pair.weight, sizeof point->weight);
            point->local = local_position(pair.on_triangle, position, orientation);
        }
    }
    collect_marked(attachment);
    return within;
}

bool attachment_is_clear(Attachment *attachment, Vec3 position, Quat orientation)
{
    return find_points(attachment, position, orientation, false) == 0;
}

void attachment_take(Attachment *attachment, Vec3 position, Quat orientation)
{
    HoldState *hold = attachment->hold;
    attachment_release(attachment);
    if (!attachment->grasper) {
        for (int64_t i = 0; i < hold->count; i++) {
            Vec3 x;
            attachment->body->ops->read_nodes(attachment->body->model, &attachment->node[i], 1, &x,
                                              NULL);
            attachment->held[i].local = local_position(x, position, orientation);
        }
    } else if (take_nodes(attachment, position, orientation) < NODES_ENOUGH) {
        for (int64_t i = 0; i < hold->count; i++)
            attachment->held[i].share = 0.0;
        if (find_points(attachment, position, orientation, true) == 0)
            attachment_release(attachment);
    }
    hold->holding = hold->count + hold->points > 0;
    attachment->taken += hold->holding;
}

void attachment_release(Attachment *attachment)
{
    HoldState *hold = attachment->hold;
    hold->holding = 0;
    if (!attachment->grasper) {
        for (int64_t i = 0; i < hold->count; i++)
            attachment->held[i].local = (Vec3){0.0, 0.0, 0.0};
        return;
    }
    memset(attachment->node, 0, (size_t)hold->count * sizeof *attachment->node);
    memset(attachment->held, 0, (size_t)hold->count * sizeof *attachment->held);
    if (hold->points > 0)
        memset(attachment->point, 0, (size_t)hold->points * sizeof *attachment->point);
    hold->count = hold->points = 0;
}
