// Updates the held nodes after a change of topology: nodes created between held ones, copies,
// removed nodes, replaced faces. Step thread.
#include "dynamics/attachment_data.h"
#include "geometry/distance.h"

#include <string.h>

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
    attachment_mark(attachment, node);
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
    for (int i = 0; i < change->gone_count; i++)
        if (attachment_is_marked(attachment, change->gone[i]))
            held -= attachment->given[change->gone[i]].share > 0.0;
    for (int i = 0; i < change->gone_count; i++) {
        int node = change->gone[i];
        if (!attachment_is_marked(attachment, node))
            continue;
        attachment_unmark(attachment, node);
        const HeldNode went = attachment->given[node];
        for (int k = 0; k < 2 && held == 0 && went.share > 0.0; k++) {
            int parent = change->gone_parent[i][k];
            bool known = attachment_is_marked(attachment, parent);
            if (!attachment->body->ops->is_fixed(attachment->body->model, parent))
                give(attachment, parent, known ? attachment->given[parent].local : went.local, 1.0);
        }
    }
    for (int i = 0; i < change->born_count; i++) {
        const NodeBirth *born = &change->born[i];
        int a = born->parent[0], b = born->parent[1];
        if (!attachment_is_marked(attachment, a) || !attachment_is_marked(attachment, b))
            continue;
        const HeldNode *from = &attachment->given[a], *to = &attachment->given[b];
        Vec3 local = vec3_scale(0.5, vec3_add(from->local, to->local));
        double both = fmin(from->share, to->share);
        give(attachment, born->node, local,
             a == b ? both : judge(attachment, born->node, local, both));
    }
}

static void follow_nodes(Attachment *attachment, const TopologyChange *change)
{
    HoldState *hold = attachment->hold;
    const int before = (int)hold->count;
    int held = 0;
    for (int i = 0; i < before; i++) {
        give(attachment, attachment->node[i], attachment->held[i].local, attachment->held[i].share);
        held += attachment->held[i].share > 0.0;
    }
    change_nodes(attachment, held, change);
    int count = 0;
    for (int word = 0; word < (attachment->body->surface.node_count + 63) / 64; word++) {
        for (uint64_t bits = attachment->mark[word]; bits != 0; bits &= bits - 1) {
            int node = word * 64 + __builtin_ctzll(bits);
            if (count == attachment->capacity) {
                attachment->refused += attachment->given[node].share > 0.0;
                continue;
            }
            attachment->node[count] = node;
            attachment->held[count++] = attachment->given[node];
        }
        attachment->mark[word] = 0;
    }
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
            continue;
        attachment->before[kept] = before;
        attachment->point[kept++] = point;
    }
    memset(&attachment->point[kept], 0, (size_t)(hold->points - kept) * sizeof(HeldPoint));
    hold->points = kept;
}

// Holds nodes instead of points as soon as enough are within the capsules.
static void prefer_nodes(Attachment *attachment)
{
    HoldState *hold = attachment->hold;
    const Body *body = attachment->body;
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
