// SPDX-License-Identifier: MIT
// Which nodes an attachment holds: grasping and releasing, once per tick, and what becomes of the
// held nodes after a change of topology (nodes created between them, copies, removed nodes,
// replaced faces). Step thread.
#include "base/bits.h"
#include "sim/hold/attachment_data.h"
#include "sim/contact/contact_data.h"
#include "geometry/distance.h"

#include <string.h>

// --- grasping and releasing ---

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
            bits_add(attachment->mark, attachment->found[i]);
    }
}

// Writes the marked nodes to `found`, ascending, and clears the marks. Returns how many.
static int collect_marked(Attachment *attachment)
{
    return bits_move(attachment->mark, attachment->body->surface.node_count, attachment->found);
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
    // Where nodes come and go, also the nodes around: new ones appear between two known ones.
    double margin = attachment->changes ? 2.0 * body->surface.longest_edge : 0.0;
    mark_near(attachment, position, orientation, margin);
    int found = collect_marked(attachment), within = 0;
    // Each is known by its place in the tool's frame, and held if it is free and within.
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
    // The face in the world, against each capsule.
    body->ops->read_nodes(body->model, body->surface.face[face], 3, x, NULL);
    bool within = false;
    double deepest = 0.0;
    for (int k = 0; k < attachment->tool->capsule_count; k++) {
        const Capsule *capsule = &attachment->tool->capsule[k];
        Vec3 p, q;
        ClosestPair pair;
        contact_axis(capsule, at, &p, &q);
        contact_nearest_pair(x, p, q, contact_is_sphere(capsule), &pair);
        // Of several capsules the one in which the face lies deepest.
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
        bits_add(attachment->mark, attachment->found[i]);
    for (int i = 0; i < found; i++) {
        int node = attachment->found[i];
        for (int j = surface->node_face_start[node]; j < surface->node_face_end[node]; j++) {
            int face = surface->node_face[j];
            // Each face counts once, at its lowest corner, and only if one of its corners is free.
            bool lowest = true, any_free = false;
            for (int k = 0; k < 3; k++) {
                int corner = surface->face[face][k];
                lowest &= corner >= node || !bits_has(attachment->mark, corner);
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
    collect_marked(attachment); // clears the marks
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
    // Nodes of a region keep their list and get new places.
    if (!attachment->grasper) {
        for (int64_t i = 0; i < hold->count; i++) {
            Vec3 x;
            attachment->body->ops->read_nodes(attachment->body->model, &attachment->node[i], 1, &x,
                                              NULL);
            attachment->held[i].local = local_position(x, position, orientation);
        }
    } else if (take_nodes(attachment, position, orientation) < NODES_ENOUGH) {
        // With too few nodes hold points of faces in their place.
        for (int64_t i = 0; i < hold->count; i++)
            attachment->held[i].share = 0.0;
        if (find_points(attachment, position, orientation, true) == 0)
            attachment_release(attachment);
    }
    // A grasp counts if anything is held.
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
    hold->count = hold->points = hold->slips = 0;
    hold->ease = hold->strength = 0.0;
}

// --- changes of topology ---

Vec3 attachment_point(const Attachment *attachment, const HeldPoint *point)
{
    const Body *body = attachment->body;
    Vec3 x[3], sum = {0.0, 0.0, 0.0};
    body->ops->read_nodes(body->model, body->surface.face[point->face], 3, x, NULL);
    for (int k = 0; k < 3; k++)
        sum = vec3_madd(sum, point->weight[k], x[k]);
    return sum;
}

void attachment_remember(Attachment *attachment)
{
    for (int64_t i = 0; i < attachment->hold->points; i++)
        attachment->before[i] = attachment_point(attachment, &attachment->point[i]);
}

static void give(Attachment *attachment, int node, Vec3 local, double share)
{
    bits_add(attachment->mark, node);
    attachment->given[node] = (HeldNode){local, share};
}

// Decides if a new node between known ones is held: by a grasper's capsules; elsewhere if both of
// its parents are, like fixed nodes of the scene.
static double judge(const Attachment *attachment, int node, Vec3 local, double both)
{
    const Body *body = attachment->body;
    if (body->ops->is_fixed(body->model, node) || attachment->hold->points > 0)
        return 0.0;
    if (!attachment->grasper)
        return both;
    return attachment_is_within(attachment, local) ? 1.0 : 0.0;
}

// Updates the marked nodes after a change. If no held node would be left, the parents of removed
// ones are held instead.
static void change_nodes(Attachment *attachment, int held, const TopologyChange *change)
{
    // How many held nodes are left without those that go.
    for (int i = 0; i < change->gone_count; i++)
        if (bits_has(attachment->mark, change->gone[i]))
            held -= attachment->given[change->gone[i]].share > 0.0;
    // A held node that goes hands its place to its parents, if nothing else is held.
    for (int i = 0; i < change->gone_count; i++) {
        int node = change->gone[i];
        if (!bits_has(attachment->mark, node))
            continue;
        bits_remove(attachment->mark, node);
        const HeldNode went = attachment->given[node];
        for (int k = 0; k < 2 && held == 0 && went.share > 0.0; k++) {
            int parent = change->gone_parent[i][k];
            bool known = bits_has(attachment->mark, parent);
            // Where a tie knows no place of the parent, that is where it is when the tick begins.
            attachment->hold->holding &= known || !attachment->of_tie;
            if (!attachment->body->ops->is_fixed(attachment->body->model, parent))
                give(attachment, parent, known ? attachment->given[parent].local : went.local, 1.0);
        }
    }
    // A new node is held if both its parents are, and if it would have been within.
    for (int i = 0; i < change->born_count; i++) {
        const NodeBirth *born = &change->born[i];
        int a = born->parent[0], b = born->parent[1];
        if (!bits_has(attachment->mark, a) || !bits_has(attachment->mark, b))
            continue;
        const HeldNode *from = &attachment->given[a], *to = &attachment->given[b];
        Vec3 local = vec3_scale(0.5, vec3_add(from->local, to->local));
        double both = fmin(from->share, to->share);
        // A copy of a node is held as the node is.
        give(attachment, born->node, local,
             a == b ? both : judge(attachment, born->node, local, both));
    }
}

static void follow_nodes(Attachment *attachment, const TopologyChange *change)
{
    HoldState *hold = attachment->hold;
    const int before = (int)hold->count;
    // Spread the list over the nodes, to find parents at once.
    int held = 0;
    for (int i = 0; i < before; i++) {
        give(attachment, attachment->node[i], attachment->held[i].local, attachment->held[i].share);
        held += attachment->held[i].share > 0.0;
    }
    change_nodes(attachment, held, change);
    // Back to an ascending list, by the marks, which are cleared on the way.
    int count = 0;
    for (int word = 0; word < bits_words(attachment->body->surface.node_count); word++) {
        for (uint64_t left = attachment->mark[word]; left != 0;) {
            const int node = bits_take(&left, word);
            // What exceeds the capacity stays free and is counted.
            if (count == attachment->capacity) {
                attachment->refused += attachment->given[node].share > 0.0;
                continue;
            }
            attachment->node[count] = node;
            attachment->held[count++] = attachment->given[node];
        }
        attachment->mark[word] = 0;
    }
    // The state is zero beyond what is in use.
    for (int i = count; i < before; i++) {
        attachment->node[i] = 0;
        memset(&attachment->held[i], 0, sizeof attachment->held[i]);
    }
    hold->count = count;
}

// Moves each point to the nearest of the faces that replaced its own. Points that reach the same
// face become one: its mass counts once.
static void follow_points(Attachment *attachment, const TopologyChange *change)
{
    const Body *body = attachment->body;
    HoldState *hold = attachment->hold;
    int64_t kept = 0;
    for (int64_t i = 0; i < hold->points; i++) {
        HeldPoint point = attachment->point[i];
        const Vec3 before = attachment->before[i];
        bool replaced = false, any = false;
        double least = (double)INFINITY;
        // Among the faces that replaced the point's own, the nearest to its old position.
        for (int c = 0; c < change->face_count; c++) {
            replaced |= change->face[c].face == attachment->point[i].face;
            if (change->face[c].from != attachment->point[i].face)
                continue;
            Vec3 x[3];
            ClosestPair pair;
            int face = change->face[c].face;
            body->ops->read_nodes(body->model, body->surface.face[face], 3, x, NULL);
            distance_point_triangle(before, x, &pair);
            if (pair.distance >= least)
                continue;
            least = pair.distance;
            any = true;
            point.face = face;
            memcpy(point.weight, pair.weight, sizeof point.weight);
        }
        if (replaced && !any)
            continue; // no face replaced it
        // Each face carries one point at most.
        bool twice = false;
        for (int64_t k = 0; k < kept; k++)
            twice |= attachment->point[k].face == point.face;
        if (twice)
            continue; // an older point has this face
        attachment->before[kept] = before;
        attachment->point[kept++] = point;
    }
    // The state is zero beyond what is in use.
    memset(&attachment->point[kept], 0, (size_t)(hold->points - kept) * sizeof(HeldPoint));
    hold->points = kept;
}

// Holds nodes instead of points as soon as enough are within the capsules.
static void prefer_nodes(Attachment *attachment)
{
    HoldState *hold = attachment->hold;
    const Body *body = attachment->body;
    // Count first and change after: with fewer than three nodes the points stay.
    int within = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int64_t i = 0; i < hold->count; i++) {
            bool is_free = !body->ops->is_fixed(body->model, attachment->node[i]);
            bool inside = is_free && attachment_is_within(attachment, attachment->held[i].local);
            within +=
                inside && pass == 0 &&
                body->surface.node_mass[attachment->node[i]] > 0.0; // else it is a hanging node
            if (pass == 1)
                attachment->held[i].share = inside ? 1.0 : 0.0;
        }
        if (within < 3)
            return;
    }
    // From now on nodes are held in place of points.
    memset(attachment->point, 0, (size_t)hold->points * sizeof(HeldPoint));
    hold->points = 0;
}

void attachment_topology_changed(Attachment *attachment, const TopologyChange *change)
{
    HoldState *hold = attachment->hold;
    if (attachment->grasper && hold->holding == 0)
        return;
    follow_nodes(attachment, change);
    if (hold->points > 0) {
        follow_points(attachment, change);
        prefer_nodes(attachment);
    }
    if (attachment->grasper && hold->count + hold->points == 0)
        attachment_release(attachment);
}
