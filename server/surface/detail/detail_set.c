// SPDX-License-Identifier: MIT
// The set of refined faces: which exist, which are leaves, which nodes hang; and how single faces
// are refined and coarsened. Step thread.
#include "surface/cavity.h"
#include "surface/detail/detail.h"

#include "base/check.h"

// ---------------------------------------------------------------------------------------------
// Queries

bool detail_is_refined(const LeafSet *set, int level, int face)
{
    return level < set->levels.finest && set->refined[set->face_base[level] + face] != 0;
}

bool detail_exists(const LeafSet *set, int level, int face)
{
    return level == 0 || detail_is_refined(set, level - 1, face / 4);
}

bool detail_is_gone(const LeafSet *set, int level, int face)
{
    return set->cut != NULL && level == set->levels.finest && detail_cut_is_gone(set->cut, face);
}

bool detail_is_leaf(const LeafSet *set, int level, int face)
{
    return detail_exists(set, level, face) && !detail_is_refined(set, level, face) &&
           !detail_is_gone(set, level, face);
}

int detail_original(const LeafSet *set, int node)
{
    if (set->cut == NULL || node < set->cut->base_count)
        return node;
    return set->cut->origin[node - set->cut->base_count];
}

const int *detail_uncut(const LeafSet *set, int level, int face)
{
    return set->cut != NULL && level == set->levels.finest ? set->cut->base[face]
                                                           : set->levels.level[level].face[face];
}

// Follows an existing face down to the leaf at the node's corner: child k keeps corner k.
static Leaf descend(const LeafSet *set, int level, int face, int node)
{
    const int *corner = detail_uncut(set, level, face);
    int k = corner[0] == node ? 0 : corner[1] == node ? 1 : 2;
    while (detail_is_refined(set, level, face)) {
        face = 4 * face + k;
        level++;
    }
    return (Leaf){level, face, k};
}

static int leaves_around_original(const LeafSet *set, int node, Leaf *leaf)
{
    const Levels *levels = &set->levels;
    int count = 0, born = levels_of_node(levels, node);
    // A corner of level 0: one leaf in each face around.
    if (born == 0) {
        for (int k = set->root_ring_start[node]; k < set->root_ring_start[node + 1]; k++)
            leaf[count++] = descend(set, 0, set->root_ring[k], node);
        return count;
    }
    // A midpoint belongs to three children of each face at its edge.
    const Level *above = &levels->level[born - 1];
    int edge = node - above->node_count;
    for (int side = 0; side < 2; side++) {
        int face = above->edge_face[edge][side];
        if (face < 0 || !detail_is_refined(set, born - 1, face))
            continue;
        const int *edges = above->face_edge[face];
        int k = edges[0] == edge ? 0 : edges[1] == edge ? 1 : 2;
        leaf[count++] = descend(set, born, 4 * face + k, node);
        leaf[count++] = descend(set, born, 4 * face + (k + 1) % 3, node);
        leaf[count++] = descend(set, born, 4 * face + 3, node);
    }
    return count;
}

int detail_leaves_around(const LeafSet *set, int node, Leaf *leaf)
{
    int count = leaves_around_original(set, detail_original(set, node), leaf), kept = 0;
    if (set->cut == NULL)
        return count;
    for (int i = 0; i < count; i++) // each copy of a node has its own leaves
        if (set->levels.level[leaf[i].level].face[leaf[i].face][leaf[i].corner] == node &&
            !detail_is_gone(set, leaf[i].level, leaf[i].face))
            leaf[kept++] = leaf[i];
    return kept;
}

int detail_midpoint(const LeafSet *set, int level, int edge)
{
    if (level == set->levels.finest)
        return -1;
    int node = set->levels.level[level].node_count + edge;
    return set->status[node] != NODE_OFF ? node : -1;
}

NodeStatus detail_status_of_midpoint(const LeafSet *set, int level, int edge)
{
    int refined = 0, sides = 0;
    for (int side = 0; side < 2; side++) {
        int face = set->levels.level[level].edge_face[edge][side];
        sides += face >= 0;
        refined += face >= 0 && detail_is_refined(set, level, face);
    }
    if (refined == 0)
        return NODE_OFF;
    return refined < sides && set->constrained ? NODE_HANGING : NODE_FREE;
}

NodeStatus detail_status(const LeafSet *set, int node)
{
    const int original = detail_original(set, node), born = levels_of_node(&set->levels, original);
    // Around copies and ends of broken edges all faces are of the finest level: some may be left.
    if (set->cut != NULL && (node != original || set->cut->is_end[node]))
        return detail_leaves_around(set, node, set->ring[0]) > 0 ? NODE_FREE : NODE_OFF;
    // A corner of level 0 is always on; a midpoint by the faces at its edge.
    return born == 0 ? NODE_FREE
                     : detail_status_of_midpoint(set, born - 1,
                                                 node - set->levels.level[born - 1].node_count);
}

int detail_face_slot(const LeafSet *set, int level, int face)
{
    return face << (2 * (set->levels.finest - level));
}

int detail_most_leaves(const LeafSet *set, int node)
{
    enum { AROUND_MIDPOINT = 6 };
    if (set->cut != NULL && node >= set->cut->base_count)
        return set->cut->most_around;
    return node < set->levels.level[0].node_count
               ? set->root_ring_start[node + 1] - set->root_ring_start[node]
               : AROUND_MIDPOINT;
}

// ---------------------------------------------------------------------------------------------
// Refining and coarsening: the bits, the nodes that are created and removed, and the marks of what
// must be packed and drawn again

void detail_mark(SurfaceModel *model, int node)
{
    Detail *detail = model->detail;
    DetailPack *pack = &detail->pack;
    pack->stale_window[model->slot[node] / pack->width] = true;
    pack->is_dirty[node] = true;
    if (detail->set.status[node] == NODE_HANGING) { // its masters carry its mass and springs
        int parent[2];
        levels_parents(&detail->set.levels, node, parent);
        detail_mark(model, parent[0]);
        detail_mark(model, parent[1]);
    }
}

// The rest position of a node has changed: update its springs, and the positions of nodes that hang
// on it.
static void follow_rest(SurfaceModel *model, int node, int depth)
{
    const LeafSet *set = &model->detail->set;
    Leaf *leaf = set->ring[depth];
    int count = detail_leaves_around(set, node, leaf);
    for (int i = 0; i < count; i++) {
        const Level *level = &set->levels.level[leaf[i].level];
        // All springs of the leaf are measured anew.
        for (int k = 0; k < 3; k++)
            detail_mark(model, level->face[leaf[i].face][k]);
        // Nodes that hang on its two edges there move along.
        const int side[2] = {leaf[i].corner, (leaf[i].corner + 2) % 3};
        for (int s = 0; s < 2; s++) {
            int middle =
                detail_midpoint(set, leaf[i].level, level->face_edge[leaf[i].face][side[s]]);
            if (middle >= 0 && set->status[middle] == NODE_HANGING) {
                detail_set_rest(model, middle);
                ASSERT(depth < LEVELS_MAX);
                follow_rest(model, middle, depth + 1);
            }
        }
    }
}

void detail_begin_change(SurfaceModel *model)
{
    Detail *detail = model->detail;
    detail->report.change =
        (TopologyChange){.face = detail->report.face_change,
                         .born = detail->report.born,
                         .gone = detail->report.gone,
                         .gone_parent = (const int(*)[2])detail->report.gone_parent};
    if (model->basis.rigid != NULL)
        rigid_frame_fit(model->basis.rigid, model->rows[model->current]);
    if (detail->frames != NULL)
        detail_frames_fit(model, model->rows[model->current]);
}

static void touch_leaf_across(Detail *detail, int level, int edge, int face)
{
    int across = levels_beyond(&detail->set.levels.level[level], edge, face);
    if (across >= 0 && detail_is_leaf(&detail->set, level, across))
        detail_touch(&detail->faces, level, across);
}

// Divides a leaf whose neighbours exist.
static void divide(SurfaceModel *model, int level, int face)
{
    Detail *detail = model->detail;
    LeafSet *set = &detail->set;
    const Level *at = &set->levels.level[level];
    // The bit, from which all else follows.
    set->refined[set->face_base[level] + face] = 1;
    set->leaf_count[level]--;
    set->leaf_count[level + 1] += 4;
    // Each edge gets a midpoint, or releases one that hung between the two levels.
    for (int k = 0; k < 3; k++) {
        int edge = at->face_edge[face][k], node = at->node_count + edge;
        NodeStatus before = set->status[node], now = detail_status_of_midpoint(set, level, edge);
        set->status[node] = (unsigned char)now;
        if (before == NODE_OFF) {
            detail_set_rest(model, node);
            detail_give_birth(model, node);
            slots_take_node(detail->faces.slots, node);
            detail->report.born[detail->report.change.born_count++] =
                (NodeBirth){node, {at->edge[edge][0], at->edge[edge][1]}};
        } else if (before != now) {
            detail_release(model, node);
            follow_rest(model, node, 0);
        }
        touch_leaf_across(detail, level, edge, face);
    }
    // All nodes of the face have other springs now.
    for (int k = 0; k < 3; k++) {
        detail_mark(model, at->face[face][k]);
        detail_mark(model, at->node_count + at->face_edge[face][k]);
    }
    // The face is drawn as its children.
    detail_touch(&detail->faces, level, face);
    for (int k = 0; k < 4; k++)
        detail_touch(&detail->faces, level + 1, 4 * face + k);
    detail->adapt.sweep->refined++;
}

bool detail_refine(SurfaceModel *model, int level, int face)
{
    Detail *detail = model->detail;
    const LeafSet *set = &detail->set;
    // The face must exist first.
    if (!detail_exists(set, level, face) && !detail_refine(model, level - 1, face / 4))
        return false;
    if (detail_is_refined(set, level, face))
        return true;
    const Level *at = &set->levels.level[level];
    for (int k = 0; k < 3; k++) { // 2:1 across edges
        int across = levels_beyond(at, at->face_edge[face][k], face);
        if (across >= 0 && !detail_exists(set, level, across) &&
            !detail_refine(model, level - 1, across / 4))
            return false;
    }
    // Capacity is counted before anything changes.
    if (!slots_reserve(detail->faces.slots)) {
        detail->adapt.sweep->refused++;
        return false;
    }
    divide(model, level, face);
    return true;
}

bool detail_may_coarsen(const LeafSet *set, int level, int face)
{
    if (set->cut != NULL && set->cut->locked[set->face_base[level] + face] != 0)
        return false;
    // Its children must be leaves.
    for (int k = 0; k < 4; k++)
        if (detail_is_refined(set, level + 1, 4 * face + k))
            return false;
    // No face beside them may be finer than they are.
    const Level *at = &set->levels.level[level];
    for (int k = 0; k < 3; k++) {
        int half[2];
        levels_halves(&set->levels, level, at->face_edge[face][k], half);
        if (detail_midpoint(set, level + 1, half[0]) >= 0 ||
            detail_midpoint(set, level + 1, half[1]) >= 0)
            return false;
    }
    return true;
}

// The momentum that the nodes of a face would lose when it is coarsened, by the node that receives
// it: each corner gets its part of the midpoints' masses at their velocities, and a midpoint that
// hangs from now on passes on its excess over the mean of its masters (README.md, "Momentum and
// mass across changes").
typedef struct Impulse {
    int node;
    Vec3 impulse;
} Impulse;

static int lost_momentum(const SurfaceModel *model, int level, int face, Impulse out[9])
{
    const Detail *detail = model->detail;
    const Level *at = &detail->set.levels.level[level];
    double area = level_rules_area(&detail->rules, level, face);
    double mass = detail->rules.areal_density * area;
    Vec3 corner[3], middle[3];
    int count = 0;
    // Velocities before the change.
    for (int k = 0; k < 3; k++) {
        corner[k] = detail_velocity(model, at->face[face][k]);
        middle[k] = detail_velocity(model, at->node_count + at->face_edge[face][k]);
    }
    // A midpoint's mass from this face goes back to the corners.
    for (int k = 0; k < 3; k++) {
        Vec3 sum = vec3_add(middle[k], middle[(k + 2) % 3]);
        out[count++] =
            (Impulse){at->face[face][k], vec3_scale(mass / 8.0, vec3_madd(sum, -2.0, corner[k]))};
    }
    // A midpoint that stays, hanging, loses its own velocity.
    for (int k = 0; k < 3; k++) {
        int edge = at->face_edge[face][k], node = at->node_count + edge;
        int across = levels_beyond(at, edge, face);
        if (across < 0 || !detail_is_refined(&detail->set, level, across))
            continue;
        int a = at->face[face][k], b = at->face[face][(k + 1) % 3];
        Vec3 mean = vec3_scale(0.5, vec3_add(corner[k], corner[(k + 1) % 3]));
        double left = detail_mass(model, node) - mass / 4.0;
        Vec3 half = vec3_scale(0.5 * left, vec3_sub(middle[k], mean));
        out[count++] = (Impulse){a, half};
        out[count++] = (Impulse){b, half};
    }
    return count;
}

void detail_coarsen(SurfaceModel *model, int level, int face)
{
    Detail *detail = model->detail;
    DetailReport *report = &detail->report;
    LeafSet *set = &detail->set;
    const Level *at = &set->levels.level[level];
    // Momentum before the change; it needs the old masses.
    Impulse impulse[9];
    int impulses = set->constrained ? lost_momentum(model, level, face, impulse) : 0;

    // The bit and the drawing.
    set->refined[set->face_base[level] + face] = 0;
    detail->adapt.calm_since[set->face_base[level] + face] = 0;
    set->leaf_count[level]++;
    set->leaf_count[level + 1] -= 4;
    for (int k = 0; k < 4; k++)
        detail_touch(&detail->faces, level + 1, 4 * face + k);
    detail_touch(&detail->faces, level, face);
    // Midpoints are switched off, or hang if the face across stays refined.
    for (int k = 0; k < 3; k++) {
        int edge = at->face_edge[face][k], node = at->node_count + edge;
        NodeStatus now = detail_status_of_midpoint(set, level, edge);
        detail->pack.stale_window[model->slot[node] / detail->pack.width] = true;
        if (now == NODE_OFF) {
            set->status[node] = NODE_OFF;
            detail_switch_off(model, node);
            slots_free_node(detail->faces.slots, node);
            for (int e = 0; e < 2; e++)
                report->gone_parent[report->change.gone_count][e] = at->edge[edge][e];
            report->gone[report->change.gone_count++] = node;
        } else if (now != set->status[node]) {
            set->status[node] = (unsigned char)now;
            detail_set_rest(model, node);
            follow_rest(model, node, 0);
        }
        touch_leaf_across(detail, level, edge, face);
        detail_mark(model, at->face[face][k]);
    }
    // Midpoints that stay have other springs now.
    for (int k = 0; k < 3; k++) {
        int node = at->node_count + at->face_edge[face][k];
        if (set->status[node] != NODE_OFF)
            detail_mark(model, node);
    }
    // Velocities last: masses and statuses are final now.
    for (int i = 0; i < impulses; i++)
        detail_push(model, impulse[i].node, impulse[i].impulse);
    detail->adapt.sweep->coarsened++;
}

void detail_end_cut(Body *body)
{
    SurfaceModel *model = body->model;
    detail_pack(model, true);
    detail_hang(&model->detail->lists, model->basis.precision, model->rows[model->current]);
    detail_draw(&model->detail->faces, &model->detail->report);
    model->detail->adapt.sweep->topology++;
    if (model->cavity != NULL)
        cavity_forget(model->cavity);
    detail_publish(body);
}

bool detail_end_change(Body *body)
{
    if (((SurfaceModel *)body->model)->detail->faces.touched_count == 0)
        return false;
    detail_end_cut(body);
    return true;
}
