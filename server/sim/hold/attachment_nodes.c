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
    attachment_read_face(body, face, x);
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

// Returns the current position of a held point [m].
static Vec3 find_point(const Attachment *attachment, const HeldPoint *point)
{
    Vec3 x[3], sum = {0.0, 0.0, 0.0};
    attachment_read_face(attachment->body, point->face, x);
    for (int k = 0; k < 3; k++)
        sum = vec3_madd(sum, point->weight[k], x[k]);
    return vec3_scale(1.0 / held_point_share(point), sum);
}

void attachment_remember(Attachment *attachment, const Body *of)
{
    for (int64_t i = 0; i < attachment->hold->points; i++)
        attachment->before[i] = find_point(attachment, &attachment->point[i]);
    for (int64_t i = 0; attachment->other == of && i < *attachment->ties; i++)
        attachment->before[i] = joint_end(attachment, &attachment->tie[i]);
}

int64_t attachment_heir(const Body *body, const TopologyChange *change, int64_t face, Vec3 at,
                        double weight[3])
{
    int64_t heir = FACE_STAYS;
    double least = (double)INFINITY;
    for (int c = 0; c < change->face_count; c++) {
        Vec3 x[3];
        ClosestPair pair;
        if (change->face[c].face == face && heir == FACE_STAYS)
            heir = FACE_ENDS; // unless there is one
        if (change->face[c].from != face)
            continue;
        attachment_read_face(body, change->face[c].face, x);
        distance_point_triangle(at, x, &pair);
        if (pair.distance >= least)
            continue;
        least = pair.distance;
        heir = change->face[c].face;
        memcpy(weight, pair.weight, sizeof pair.weight);
    }
    return heir;
}

// --- nodes that come and go ---

static bool carries_share(const void *row)
{
    return ((const HeldNode *)row)->share > 0.0;
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

static bool place_between(const Attachment *attachment, const NodeBirth *born, const void *from,
                          const void *to, void *row)
{
    const HeldNode *one = from, *two = to;
    const Vec3 local = vec3_scale(0.5, vec3_add(one->local, two->local));
    const double both = fmin(one->share, two->share);
    // A copy of a node is held as the node is.
    const bool copy = born->parent[0] == born->parent[1];
    *(HeldNode *)row = (HeldNode){local, copy ? both : judge(attachment, born->node, local, both)};
    return true;
}

static bool inherit_place(Attachment *attachment, int parent, const void *went, const void *known,
                          void *row)
{
    const HeldNode *like = known != NULL ? known : went;
    // Where a tie knows no place of the parent, that is where it is when the tick begins.
    attachment->hold->holding &= known != NULL || !attachment->of_tie;
    *(HeldNode *)row = (HeldNode){like->local, 1.0};
    return !attachment->body->ops->is_fixed(attachment->body->model, parent);
}

const HoldRow FRAME_ROW = {sizeof(HeldNode), carries_share, place_between, inherit_place};

// Returns how many rows there are; row number i, and that given to a node.
static int64_t *row_count(const Attachment *attachment)
{
    return attachment->other != NULL ? attachment->ties : &attachment->hold->count;
}

static char *row_at(const Attachment *attachment, int64_t i)
{
    char *rows = attachment->other != NULL ? (char *)attachment->tie : (char *)attachment->held;
    return rows + (size_t)i * attachment->row->size;
}

static char *given_at(const Attachment *attachment, int node)
{
    return attachment->given + (size_t)node * attachment->row->size;
}

static void give(Attachment *attachment, int node, const void *row)
{
    bits_add(attachment->mark, node);
    memcpy(given_at(attachment, node), row, attachment->row->size);
}

// Hands the row of a node that went to its parents.
static void hand_over(Attachment *attachment, const void *went, const int parent[2])
{
    union {
        HeldNode held;
        Tie tie;
    } row;
    for (int k = 0; k < 2; k++) {
        const bool known = bits_has(attachment->mark, parent[k]);
        if (attachment->row->inherit(attachment, parent[k], went,
                                     known ? given_at(attachment, parent[k]) : NULL, &row))
            give(attachment, parent[k], &row);
    }
}

// Updates the marked nodes after a change. If no held node would be left, the parents of removed
// ones are held instead.
static void change_nodes(Attachment *attachment, int held, const TopologyChange *change)
{
    const HoldRow *kind = attachment->row;
    // How many held nodes are left without those that go.
    for (int i = 0; i < change->gone_count; i++)
        if (bits_has(attachment->mark, change->gone[i]))
            held -= kind->carries(given_at(attachment, change->gone[i]));
    for (int i = 0; i < change->gone_count; i++) {
        const int node = change->gone[i];
        if (!bits_has(attachment->mark, node))
            continue;
        bits_remove(attachment->mark, node);
        if (held == 0 && kind->carries(given_at(attachment, node)) &&
            change->gone_parent[i][0] != NODE_NONE)
            hand_over(attachment, given_at(attachment, node), change->gone_parent[i]);
    }
    // A new node is held if both its parents are, and if it would have been within.
    for (int i = 0; i < change->born_count; i++) {
        const NodeBirth *born = &change->born[i];
        const int a = born->parent[0], b = born->parent[1];
        if (bits_has(attachment->mark, a) && bits_has(attachment->mark, b) &&
            kind->between(attachment, born, given_at(attachment, a), given_at(attachment, b),
                          given_at(attachment, born->node)))
            bits_add(attachment->mark, born->node);
    }
}

// Takes the marked nodes back into an ascending list, and clears the marks on the way. What exceeds
// the capacity stays free and is counted. Returns how many rows there are.
static int collect_rows(Attachment *attachment)
{
    int count = 0;
    for (int word = 0; word < bits_words(attachment->body->surface.node_count); word++) {
        for (uint64_t left = attachment->mark[word]; left != 0;) {
            const int node = bits_take(&left, word);
            if (count == attachment->capacity) {
                attachment->refused += attachment->row->carries(given_at(attachment, node));
                continue;
            }
            memcpy(row_at(attachment, count), given_at(attachment, node), attachment->row->size);
            if (attachment->other != NULL)
                attachment->tie[count].node = node;
            else
                attachment->node[count] = node;
            count++;
        }
        attachment->mark[word] = 0;
    }
    return count;
}

static void follow_nodes(Attachment *attachment, const TopologyChange *change)
{
    const int before = (int)*row_count(attachment);
    // Spread the list over the nodes, to find parents at once.
    int held = 0;
    for (int i = 0; i < before; i++) {
        const int64_t node =
            attachment->other != NULL ? attachment->tie[i].node : attachment->node[i];
        give(attachment, (int)node, row_at(attachment, i));
        held += attachment->row->carries(row_at(attachment, i));
    }
    change_nodes(attachment, held, change);
    const int count = collect_rows(attachment);
    // The state is zero beyond what is in use.
    for (int i = count; i < before; i++) {
        memset(row_at(attachment, i), 0, attachment->row->size);
        if (attachment->other == NULL)
            attachment->node[i] = 0;
    }
    *row_count(attachment) = count;
}

// Moves each point to the nearest of the faces that replaced its own. Points that reach the same
// face become one: its mass counts once.
static void follow_points(Attachment *attachment, const TopologyChange *change)
{
    HoldState *hold = attachment->hold;
    int64_t kept = 0;
    for (int64_t i = 0; i < hold->points; i++) {
        HeldPoint point = attachment->point[i];
        const Vec3 before = attachment->before[i];
        const int64_t heir =
            attachment_heir(attachment->body, change, point.face, before, point.weight);
        for (int k = 0; k < 3 && heir >= 0; k++)
            point.weight[k] *= held_point_share(&attachment->point[i]);
        point.face = heir >= 0 ? heir : point.face;
        // It ends, too, if an older point has this face.
        bool ends = heir == FACE_ENDS;
        for (int64_t k = 0; k < kept; k++)
            ends |= attachment->point[k].face == point.face;
        if (ends)
            continue;
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

void attachment_topology_changed(Attachment *attachment, const Body *of,
                                 const TopologyChange *change)
{
    HoldState *hold = attachment->hold;
    if (attachment->grasper && hold->holding == 0)
        return;
    if (attachment->other == of)
        joint_other_changed(attachment, change);
    if (attachment->body == of)
        follow_nodes(attachment, change);
    // Its corners have other shares and masses now.
    if (attachment->other != NULL && (attachment->body == of || attachment->other == of))
        joint_stiffen(attachment);
    if (hold->points > 0) {
        follow_points(attachment, change);
        prefer_nodes(attachment);
    }
    if (attachment->grasper && hold->count + hold->points == 0)
        attachment_release(attachment);
}
