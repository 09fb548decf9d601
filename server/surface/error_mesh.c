// SPDX-License-Identifier: MIT
// The wall as it is and the wall with each face divided once more, as lists of springs and hinges
// (error.h). Step thread, after each change of topology; in the order of the hierarchy.
#include "surface/error.h"

#include "surface/detail/detail.h"

#include <math.h>
#include <string.h>

enum { COARSE, FINER };

// ---------------------------------------------------------------------------------------------
// The body, with levels or without

static const LeafSet *set_of(const SurfaceModel *model)
{
    return model->detail == NULL ? NULL : &model->detail->set;
}

static bool is_leaf(const SurfaceModel *model, int level, int face)
{
    return model->detail == NULL || detail_is_leaf(set_of(model), level, face);
}

static bool is_fixed(const SurfaceModel *model, int node)
{
    return model->detail != NULL
               ? model->detail->fixed[node]
               : model_get(model, model->nodes.inverse_mass, model->slot[node]) == 0.0;
}

// Returns the corner of a face that is neither of two others.
static int third(const int corner[3], int a, int b)
{
    return corner[0] + corner[1] + corner[2] - a - b;
}

// Returns what a face adds to a spring at its border of that length, or to one inside [N/m].
static double face_stiffness(const SurfaceError *error, int which, double area, double length,
                             int level, double share)
{
    const LevelRules *rules = error->rules;
    if (!rules->same_springs)
        return level_rules_face_stiffness(rules, area, length);
    // With choi2005 each level has half of the stiffness of the one above.
    return (which == FINER && rules->levels != NULL && rules->same_nodes ? 0.5 : 1.0) * share *
           rules->stiffness[level];
}

// ---------------------------------------------------------------------------------------------
// Nodes

static int add_node(SurfaceError *error, const ErrorNode *node)
{
    if (error->node_count == error->node_capacity) {
        error->full = 1;
        return 0;
    }
    error->node[error->node_count] = *node;
    return error->node_count++;
}

// Returns the number of a node of the body. Parents come before what hangs between them.
static int find_node(const SurfaceModel *model, int node)
{
    SurfaceError *error = model->error;
    if (error->of_node[node] >= 0)
        return error->of_node[node];
    const LeafSet *set = set_of(model);
    const Vec3 rest = model_rest(model, model->slot[node]);
    ErrorNode made = {.model = node,
                      .keep = node,
                      .parent = {-1, -1},
                      .wing = {-1, -1},
                      .fixed = is_fixed(model, node),
                      .rest = {rest, rest}};
    if (set != NULL && set->status[node] == NODE_HANGING) {
        int parent[2];
        levels_parents(&set->levels, node, parent);
        made.hangs = true;
        for (int k = 0; k < 2; k++)
            made.parent[k] = find_node(model, parent[k]);
        made.rest[FINER] = vec3_sub(set->levels.position[node], model->basis.rest_origin);
    }
    return error->of_node[node] = add_node(error, &made);
}

// True if the face across an edge exists at the same level, as a leaf or divided.
static bool has_equal(const SurfaceModel *model, int level, int across)
{
    return across >= 0 && (model->detail == NULL || detail_exists(set_of(model), level, across));
}

// Returns the number of the midpoint of a leaf's edge k.
static int find_middle(const SurfaceModel *model, int level, int face, int k)
{
    SurfaceError *error = model->error;
    const LeafSet *set = set_of(model);
    const Level *at = &error->levels->level[level];
    const int edge = at->face_edge[face][k], across = levels_beyond(at, edge, face);
    const int wing = find_node(model, at->face[face][(k + 2) % 3]);
    const bool broken = set != NULL && detail_is_broken(set, level, face, k);
    int *found = &error->of_edge[error->edge_base[level] + edge];
    // The finer side has it already.
    if (!broken && across >= 0 && set != NULL && detail_is_refined(set, level, across))
        *found = find_node(model, at->node_count + edge);
    else if (broken && at->edge_face[edge][1] == face)
        found = &error->of_lip[edge];
    if (*found >= 0) {
        ErrorNode *node = &error->node[*found];
        if (node->wing[0] != wing)
            node->wing[node->wing[0] >= 0] = wing;
        return *found;
    }
    // Where subdivision puts it, unless it hangs in the finer wall.
    const int a = find_node(model, at->face[face][k]),
              b = find_node(model, at->face[face][(k + 1) % 3]);
    const ErrorNode *end[2] = {&error->node[a], &error->node[b]};
    ErrorNode made = {.model = -1,
                      .keep = (level < error->levels->finest ? at->node_count : model->node_count) +
                              edge,
                      .parent = {a, b},
                      .wing = {wing, -1},
                      .fixed = end[0]->fixed && end[1]->fixed,
                      .tied = !broken && across >= 0 && !has_equal(model, level, across)};
    const Vec3 half = vec3_scale(0.5, vec3_add(end[0]->rest[FINER], end[1]->rest[FINER]));
    const Vec3 place = level < error->levels->finest
                           ? error->levels->position[at->node_count + edge]
                           : error->middle[edge];
    made.rest[COARSE] = made.rest[FINER] =
        made.tied ? half : vec3_sub(place, model->basis.rest_origin);
    *found = add_node(error, &made);
    if (made.tied && !error->full)
        error->tied[error->tied_count++] = *found;
    return *found;
}

// What hangs gives its area to its parents.
static void carry(SurfaceError *error, int node, double area)
{
    ErrorNode *at = &error->node[node];
    if (!at->hangs) {
        at->carried += area;
        return;
    }
    carry(error, at->parent[0], 0.5 * area);
    carry(error, at->parent[1], 0.5 * area);
}

// ---------------------------------------------------------------------------------------------
// Springs and hinges

// Adds a spring to which a face of `area` adds, and one of `other` across it, unless 0.
static void add_link(SurfaceError *error, int which, int a, int b, double area, double other,
                     int level, double share)
{
    const Vec3 d = vec3_sub(error->node[a].rest[which], error->node[b].rest[which]);
    const double length = vec3_length(d);
    ErrorNet *net = &error->net[which];
    net->link[net->link_count++] = (ErrorLink){
        .node = {a, b},
        .stiffness = face_stiffness(error, which, area + other, length, level, share),
        .length = (1.0 - error->options.prestress) * length,
    };
}

double surface_error_angle(const Vec3 x[4])
{
    const Vec3 edge = vec3_sub(x[1], x[0]), d = vec3_sub(x[3], x[0]);
    const Vec3 left = vec3_cross(edge, vec3_sub(x[2], x[0])), right = vec3_cross(d, edge);
    return atan2(-vec3_dot(left, d) * vec3_length(edge), vec3_dot(left, right));
}

double surface_error_volume(Vec3 a, Vec3 b, Vec3 c)
{
    return vec3_dot(a, vec3_cross(b, c)) / 6.0;
}

void surface_error_child(const int face[6], int k, int corner[3])
{
    corner[0] = k < 3 ? face[k] : face[3];
    corner[1] = k < 3 ? face[3 + k] : face[4];
    corner[2] = k < 3 ? face[3 + (k + 2) % 3] : face[5];
}

static void add_hinge(SurfaceError *error, int which, int a, int b, int c, int d)
{
    Vec3 x[4];
    const int node[4] = {a, b, c, d};
    if (error->bending == 0.0)
        return;
    for (int k = 0; k < 4; k++)
        x[k] = error->node[node[k]].rest[which];
    // k = D l^2 / (A_1 + A_2).
    const Vec3 edge = vec3_sub(x[1], x[0]);
    const double area = 0.5 * (vec3_length(vec3_cross(edge, vec3_sub(x[2], x[0]))) +
                               vec3_length(vec3_cross(vec3_sub(x[3], x[0]), edge)));
    ErrorNet *net = &error->net[which];
    net->hinge[net->hinge_count++] =
        (ErrorHinge){.node = {a, b, c, d},
                     .stiffness = area > 0.0 ? error->bending * vec3_dot(edge, edge) / area : 0.0,
                     .angle = surface_error_angle(x)};
}

// The edge of a leaf whose other side is finer: hinges between the leaf and the finer leaves.
static void add_border(const SurfaceModel *model, int level, int face, int k, const int corner[3],
                       const int middle[3])
{
    SurfaceError *error = model->error;
    const Level *at = &error->levels->level[level], *fine = &error->levels->level[level + 1];
    const int across = levels_beyond(at, at->face_edge[face][k], face);
    const int *own = at->face[face], *whole = at->face[across];
    for (int end = 0; end < 2; end++) {
        const int node = own[(k + end) % 3], half = at->node_count + at->face_edge[face][k];
        const int q = whole[0] == node ? 0 : whole[1] == node ? 1 : 2;
        const int beyond = find_node(model, third(fine->face[4 * across + q], node, half));
        const int a = end == 0 ? corner[k] : middle[k],
                  b = end == 0 ? middle[k] : corner[(k + 1) % 3];
        add_hinge(error, COARSE, a, b, corner[(k + 2) % 3], beyond);
        add_hinge(error, FINER, a, b, middle[end == 0 ? (k + 2) % 3 : (k + 1) % 3], beyond);
    }
}

// An edge that the leaf owns, whose other side is a leaf of the same level.
static void add_fold(const SurfaceModel *model, int level, int across, int k, const int face,
                     const int corner[3], const int middle[3])
{
    SurfaceError *error = model->error;
    const Level *at = &error->levels->level[level];
    const int *beyond = at->face[across];
    const int a = at->face[face][k], b = at->face[face][(k + 1) % 3];
    const int q = beyond[0] == b ? 0 : beyond[1] == b ? 1 : 2; // edge q leads from b to a
    add_hinge(error, COARSE, corner[k], corner[(k + 1) % 3], corner[(k + 2) % 3],
              find_node(model, third(beyond, a, b)));
    add_hinge(error, FINER, corner[k], middle[k], middle[(k + 2) % 3],
              find_middle(model, level, across, (q + 1) % 3));
    add_hinge(error, FINER, middle[k], corner[(k + 1) % 3], middle[(k + 1) % 3],
              find_middle(model, level, across, (q + 2) % 3));
}

void surface_error_forget_edges(SurfaceError *error)
{
    memset(error->of_edge, -1, (size_t)error->edge_base[error->levels->finest + 1] * sizeof(int));
    memset(error->of_lip, -1,
           (size_t)error->levels->level[error->levels->finest].edge_count * sizeof(int));
}

void surface_error_forget(SurfaceError *error)
{
    for (int i = 0; i < error->node_count; i++)
        if (error->node[i].model >= 0)
            error->of_node[error->node[i].model] = -1;
    surface_error_forget_edges(error);
    error->node_count = error->level = error->at = error->face_count = error->tied_count = 0;
    error->order = 0.0;
    error->rest_volume[COARSE] = error->rest_volume[FINER] = 0.0;
    for (int k = 0; k < 2; k++)
        error->net[k].link_count = error->net[k].hinge_count = 0;
    error->full = 0;
}

void surface_error_add_leaf(const SurfaceModel *model, int level, int face)
{
    SurfaceError *error = model->error;
    const LeafSet *set = set_of(model);
    const Level *at = &error->levels->level[level];
    if (!is_leaf(model, level, face))
        return;
    const double area = level_rules_area(error->rules, level, face);
    int corner[3], middle[3];
    for (int k = 0; k < 3; k++)
        corner[k] = find_node(model, at->face[face][k]);
    for (int k = 0; k < 3; k++)
        middle[k] = find_middle(model, level, face, k);
    if (error->full)
        return;
    for (int k = 0; k < 3; k++) {
        // A third of the face to its corners, in the finer wall half of it to each midpoint.
        error->node[corner[k]].area += area / 3.0;
        carry(error, corner[k], area / 3.0);
        error->node[corner[k]].finer += area / 12.0;
        error->node[middle[k]].finer += area / 4.0;
    }
    // Of order 2: an error is the sum of what all finer levels would change, down to one more than
    // the finest.
    error->order += area * (1.0 - pow(0.25, error->levels->finest + 1 - level)) / 0.75;
    int *own = error->face[error->face_count++];
    for (int k = 0; k < 3; k++)
        own[k] = corner[k], own[3 + k] = middle[k];
    if (model->cavity != NULL) {
        Vec3 x[3];
        for (int k = 0; k < 3; k++)
            x[k] = error->node[corner[k]].rest[COARSE];
        error->rest_volume[COARSE] += surface_error_volume(x[0], x[1], x[2]);
        for (int k = 0; k < 4; k++) {
            int child[3];
            surface_error_child(own, k, child);
            for (int j = 0; j < 3; j++)
                x[j] = error->node[child[j]].rest[FINER];
            error->rest_volume[FINER] += surface_error_volume(x[0], x[1], x[2]);
        }
    }
    // Springs: whole edges of the wall itself; halves, and those between midpoints.
    for (int k = 0; k < 3; k++) {
        const int edge = at->face_edge[face][k], across = levels_beyond(at, edge, face);
        const bool joined = across >= 0 && !(set != NULL && detail_is_broken(set, level, face, k));
        const bool equal = joined && is_leaf(model, level, across);
        const int a = corner[k], b = corner[(k + 1) % 3], m = middle[k];
        add_link(error, FINER, m, middle[(k + 1) % 3], 0.5 * area, 0.0, level, 1.0);
        if (equal && across < face)
            continue; // the other side adds it
        const double other = equal ? level_rules_area(error->rules, level, across) : 0.0;
        const double share = across >= 0 && !equal ? 0.5 : 1.0;
        add_link(error, COARSE, a, b, area, other, level, share);
        add_link(error, FINER, a, m, 0.25 * area, 0.25 * other, level, share);
        add_link(error, FINER, m, b, 0.25 * area, 0.25 * other, level, share);
        if (equal)
            add_fold(model, level, across, k, face, corner, middle);
        else if (joined && set != NULL && detail_is_refined(set, level, across))
            add_border(model, level, face, k, corner, middle);
    }
    for (int k = 0; k < 3; k++)
        add_hinge(error, FINER, middle[k], middle[(k + 1) % 3], middle[(k + 2) % 3],
                  corner[(k + 1) % 3]);
}
