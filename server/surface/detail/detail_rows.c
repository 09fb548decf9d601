// SPDX-License-Identifier: MIT
// Rows of nodes that hang, are created or removed: displacements and velocities are transferred so
// that momentum is conserved and a body at rest stays at rest (README.md, "Hanging nodes" and
// README.md, "Momentum and mass across changes"). All in the rows' coordinates.
#include "surface/detail/detail.h"

#include "geometry/levels.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// Reading and pushing

static void *present_rows(const SurfaceModel *model)
{
    return model->rows[model->current];
}

static void read_middle(const SurfaceModel *model, int node, double row[ROW]);

// Reads a node's row, from its masters when it hangs.
static void read_carried(const SurfaceModel *model, int node, double row[ROW])
{
    const Detail *detail = model->detail;
    if (detail->set.status[node] != NODE_HANGING) {
        for (int c = 0; c < ROW; c++)
            row[c] = model_get(model, present_rows(model), (long)model->slot[node] * ROW + c);
        return;
    }
    read_middle(model, node, row);
}

// Reads the mean of its parents' rows, whatever the node's own status.
static void read_middle(const SurfaceModel *model, int node, double row[ROW])
{
    int parent[2];
    double other[ROW];
    levels_parents(&model->detail->set.levels, node, parent);
    read_carried(model, parent[0], row);
    read_carried(model, parent[1], other);
    for (int c = 0; c < ROW; c++)
        row[c] = 0.5 * (row[c] + other[c]);
}

Vec3 detail_velocity(const SurfaceModel *model, int node)
{
    double row[ROW];
    read_carried(model, node, row);
    return (Vec3){row[4], row[5], row[6]};
}

void detail_push(SurfaceModel *model, int node, Vec3 impulse)
{
    const Detail *detail = model->detail;
    // Masters carry the mass of a hanging node, half each.
    if (detail->set.status[node] == NODE_HANGING) {
        int parent[2];
        levels_parents(&detail->set.levels, node, parent);
        detail_push(model, parent[0], vec3_scale(0.5, impulse));
        detail_push(model, parent[1], vec3_scale(0.5, impulse));
        return;
    }
    if (detail->fixed[node])
        return;
    // A free node changes its velocity.
    const double share = 1.0 / detail_mass(model, node);
    const double change[3] = {share * impulse.x, share * impulse.y, share * impulse.z};
    for (int c = 0; c < 3; c++) {
        long at = (long)model->slot[node] * ROW + 4 + c;
        model_put(model, present_rows(model), at,
                  model_get(model, present_rows(model), at) + change[c]);
    }
}

// Returns how a step of the rest position changes a row: positions by the rotated step;
// displacements only by what the rotation adds.
static Vec3 shift_of_row(const SurfaceModel *model, int node, Vec3 step)
{
    bool single = model->basis.precision == PRECISION_SINGLE;
    const FramePose *pose = detail_frames_pose(model, node);
    if (pose == NULL)
        return single ? (Vec3){0.0, 0.0, 0.0} : step;
    const double(*r)[3] = (const double(*)[3])pose->rotation;
    Vec3 turned = {r[0][0] * step.x + r[0][1] * step.y + r[0][2] * step.z,
                   r[1][0] * step.x + r[1][1] * step.y + r[1][2] * step.z,
                   r[2][0] * step.x + r[2][1] * step.y + r[2][2] * step.z};
    return single ? vec3_sub(turned, step) : turned;
}

static Vec3 rest_of(const SurfaceModel *model, int node)
{
    return model_rest(model, model->slot[node]);
}

static Vec3 middle_of_parents(const SurfaceModel *model, int node)
{
    int parent[2];
    levels_parents(&model->detail->set.levels, node, parent);
    return vec3_scale(0.5, vec3_add(rest_of(model, parent[0]), rest_of(model, parent[1])));
}

void detail_set_rest(SurfaceModel *model, int node)
{
    const LeafSet *set = &model->detail->set;
    Vec3 rest =
        set->status[node] == NODE_HANGING
            ? middle_of_parents(model, node)
            : vec3_sub(set->levels.position[detail_original(set, node)], model->basis.rest_origin);
    double *to = model->basis.rest[model->slot[node]];
    to[0] = rest.x, to[1] = rest.y, to[2] = rest.z;
}

static void put_row(SurfaceModel *model, int node, const double row[ROW])
{
    for (int c = 0; c < ROW; c++)
        model_put(model, present_rows(model), (long)model->slot[node] * ROW + c, row[c]);
    model->node[model->slot[node]] = node;
}

void detail_release(SurfaceModel *model, int node)
{
    Vec3 before = rest_of(model, node);
    detail_set_rest(model, node);
    Vec3 step = shift_of_row(model, node, vec3_sub(rest_of(model, node), before));
    const double shift[3] = {step.x, step.y, step.z};
    // Recompute it: its masters may have been released after the node was placed between them.
    double row[ROW];
    read_middle(model, node, row);
    put_row(model, node, row);
    for (int c = 0; c < 3; c++) {
        long at = (long)model->slot[node] * ROW + c;
        model_put(model, present_rows(model), at,
                  model_get(model, present_rows(model), at) + shift[c]);
    }
}

// ---------------------------------------------------------------------------------------------
// The butterfly, for adjust = "choi2005": a new node starts where the modified butterfly of the
// current positions puts it (section "Local spatial subdivision" of the paper). For the drawbacks,
// and for the default rule: README.md, "Momentum and mass across changes". The rule is linear and
// the rest positions obey it, so that it is applied to displacements; nodes that are off get the
// mean of their parents.

typedef struct Walk {
    const SurfaceModel *model;
    const Level *level;
} Walk;

static Vec3 displacement(const SurfaceModel *model, int node)
{
    const Detail *detail = model->detail;
    // A node that is off is in the middle of its parents.
    if (detail->set.status[node] == NODE_OFF) {
        int parent[2];
        levels_parents(&detail->set.levels, node, parent);
        return vec3_scale(0.5,
                          vec3_add(displacement(model, parent[0]), displacement(model, parent[1])));
    }
    const void *rows = model->rows[model->current];
    long at = (long)model->slot[node] * ROW;
    Vec3 u = {model_get(model, rows, at), model_get(model, rows, at + 1),
              model_get(model, rows, at + 2)};
    return model->basis.precision == PRECISION_SINGLE
               ? u
               : vec3_sub(u, model_rest(model, model->slot[node]));
}

static int other_end(const Level *level, int edge, int node)
{
    return level->edge[edge][level->edge[edge][0] == node];
}

// Returns the edge of a face at a node that is not `edge`.
static int other_edge(const Level *level, int face, int node, int edge)
{
    for (int k = 0; k < 3; k++) {
        int e = level->face_edge[face][k];
        if (e != edge && (level->edge[e][0] == node || level->edge[e][1] == node))
            return e;
    }
    return edge;
}

// Counts the edges of a node at this level, starting with one of them; 0 at a border.
static int count_edges(const Level *level, int node, int edge)
{
    int face = level->edge_face[edge][0], at = edge, count = 0;
    while (face >= 0) {
        at = other_edge(level, face, node, at);
        count++;
        if (at == edge)
            return count;
        face = levels_beyond(level, at, face);
    }
    return 0;
}

// Returns the point beyond `node` along a border, seen from the other end of a border edge: the
// next one of the border, or the reflection where the border turns by more than 60 degrees at rest.
static Vec3 along_border(const Walk *walk, int node, int edge)
{
    const Level *level = walk->level;
    int face =
        level->edge_face[edge][0] >= 0 ? level->edge_face[edge][0] : level->edge_face[edge][1];
    // Walk around the node to the other edge of the border.
    int at = edge, to = other_end(level, edge, node);
    while (face >= 0) {
        at = other_edge(level, face, node, at);
        face = levels_beyond(level, at, face);
    }
    const Vec3 *rest = walk->model->detail->set.levels.position;
    int before = other_end(level, at, node);
    Vec3 in = vec3_sub(rest[node], rest[before]), out = vec3_sub(rest[to], rest[node]);
    Vec3 u = displacement(walk->model, node);
    // At a corner the border does not go on: mirror the edge.
    if (vec3_dot(in, out) < BUTTERFLY_CORNER * vec3_length(in) * vec3_length(out))
        return vec3_sub(vec3_scale(2.0, u), displacement(walk->model, to));
    return displacement(walk->model, before);
}

// Returns the wing across the edge (u, v) of a face, whose third node is w.
static Vec3 wing(const Walk *walk, int face, int edge, int w)
{
    const Level *level = walk->level;
    const int *end = level->edge[edge];
    int across = levels_beyond(level, edge, face);
    // Beyond a border: mirror the node in front.
    if (across < 0)
        return vec3_sub(
            vec3_add(displacement(walk->model, end[0]), displacement(walk->model, end[1])),
            displacement(walk->model, w));
    for (int k = 0; k < 3; k++) {
        int node = level->face[across][k];
        if (node != end[0] && node != end[1])
            return displacement(walk->model, node);
    }
    return (Vec3){0.0, 0.0, 0.0};
}

static Vec3 regular(const Walk *walk, int edge)
{
    const Level *level = walk->level;
    const int *end = level->edge[edge];
    // The ends, then on each side the third corner and two wings.
    Vec3 sum = vec3_scale(
        0.5, vec3_add(displacement(walk->model, end[0]), displacement(walk->model, end[1])));
    for (int side = 0; side < 2; side++) {
        int face = level->edge_face[edge][side];
        int to_a = other_edge(level, face, end[0], edge),
            to_b = other_edge(level, face, end[1], edge);
        sum = vec3_madd(sum, 1.0 / 8.0, displacement(walk->model, other_end(level, to_a, end[0])));
        sum = vec3_madd(sum, -1.0 / 16.0, wing(walk, face, to_a, end[1]));
        sum = vec3_madd(sum, -1.0 / 16.0, wing(walk, face, to_b, end[0]));
    }
    return sum;
}

// Returns the contribution of a node with `valence` edges that is not regular.
static Vec3 extraordinary(const Walk *walk, int node, int edge, int valence)
{
    const Level *level = walk->level;
    int face = level->edge_face[edge][0], at = edge;
    Vec3 own = displacement(walk->model, node), sum = own;
    for (int j = 0; j < valence; j++) {
        Vec3 spoke = vec3_sub(displacement(walk->model, other_end(level, at, node)), own);
        sum = vec3_madd(sum, butterfly_weight(valence, j), spoke);
        at = other_edge(level, face, node, at);
        face = levels_beyond(level, at, face);
    }
    return sum;
}

// Returns the displacement, in the rows' coordinates, that the modified butterfly gives the
// midpoint of an edge [m].
static Vec3 butterfly(const SurfaceModel *model, int level, int edge)
{
    const Level *at = &model->detail->set.levels.level[level];
    const Walk walk = {model, at};
    const int *end = at->edge[edge];
    // On the border: the four-point rule along it.
    if (at->edge_face[edge][0] < 0 || at->edge_face[edge][1] < 0) {
        Vec3 inner = vec3_add(displacement(model, end[0]), displacement(model, end[1]));
        Vec3 outer = vec3_add(along_border(&walk, end[0], edge), along_border(&walk, end[1], edge));
        return vec3_madd(vec3_scale(9.0 / 16.0, inner), -1.0 / 16.0, outer);
    }
    // Inside: the mean over the ends with another valence than 6, else the regular rule.
    Vec3 sum = {0.0, 0.0, 0.0};
    int count = 0;
    for (int k = 0; k < 2; k++) {
        int valence = count_edges(at, end[k], edge); // border nodes are regular
        if (valence == 0 || valence == 6)
            continue;
        sum = vec3_add(sum, extraordinary(&walk, end[k], edge, valence));
        count++;
    }
    return count > 0 ? vec3_scale(1.0 / count, sum) : regular(&walk, edge);
}

// ---------------------------------------------------------------------------------------------
// Births and copies

// Creates a node with the mean velocity of its parents, which conserves momentum, and the mean of
// their displacements from their rest positions (README.md, "Momentum and mass across changes");
// with choi2005 at the butterfly's point.
void detail_give_birth(SurfaceModel *model, int node)
{
    const Levels *levels = &model->detail->set.levels;
    double row[ROW];
    read_middle(model, node, row);
    Vec3 rest = rest_of(model, node);
    // Where its masters hold it, or where the butterfly puts it.
    if (model->detail->set.constrained) {
        Vec3 step = shift_of_row(model, node, vec3_sub(rest, middle_of_parents(model, node)));
        row[0] += step.x, row[1] += step.y, row[2] += step.z;
    } else {
        int level = levels_of_node(levels, node) - 1;
        Vec3 at = butterfly(model, level, node - levels->level[level].node_count);
        if (model->basis.precision == PRECISION_DOUBLE)
            at = vec3_add(at, rest);
        row[0] = at.x, row[1] = at.y, row[2] = at.z;
    }
    put_row(model, node, row);
}

void detail_copy_row(SurfaceModel *model, int node, int from)
{
    double row[ROW];
    for (int c = 0; c < ROW; c++)
        row[c] = model_get(model, present_rows(model), (long)model->slot[from] * ROW + c);
    put_row(model, node, row);
}

// Unused rows are zero, so that the state is a function of the nodes that are on.
void detail_switch_off(SurfaceModel *model, int node)
{
    int slot = model->slot[node];
    size_t bytes = ROW * model_real_size(model);
    for (int k = 0; k < 2; k++)
        memset((char *)model->rows[k] + (size_t)slot * bytes, 0, bytes);
    memset(model->basis.rest[slot], 0, sizeof model->basis.rest[slot]);
    model->node[slot] = -1;
}

// ---------------------------------------------------------------------------------------------
// Hanging rows, in every evaluation

// Four numbers at a time, coarsest level first.
#define HANG(Real)                                                                                 \
    {                                                                                              \
        typedef Real Half __attribute__((vector_size(ROW / 2 * sizeof(Real))));                    \
        Half *row = rows;                                                                          \
        for (int i = lists->hanging_count - 1; i >= 0; i--)                                        \
            for (int k = 0; k < 2; k++)                                                            \
                row[2 * lists->hanging[i] + k] =                                                   \
                    (row[2 * lists->master[i][0] + k] + row[2 * lists->master[i][1] + k]) / 2;     \
    }

void detail_hang(const DetailLists *lists, Precision precision, void *rows)
{
    if (precision == PRECISION_SINGLE)
        HANG(float)
    else
        HANG(double)
}

void detail_clear_masters(const DetailLists *lists, Precision precision)
{
    const size_t row = ROW * (precision == PRECISION_SINGLE ? sizeof(float) : sizeof(double));
    for (int i = 0; i < lists->carrier_count; i++)
        memset((char *)lists->handed + (size_t)lists->carrier[i] * row, 0, row / 2);
}

// Finest level first, so that a master that hangs itself passes on what it received.
#define HAND_OVER(Real)                                                                            \
    {                                                                                              \
        typedef Real Force __attribute__((vector_size(4 * sizeof(Real))));                         \
        Force *force = lists->handed;                                                              \
        for (int i = 0; i < lists->hanging_count; i++) {                                           \
            Force half = force[2 * lists->hanging[i]] / 2;                                         \
            force[2 * lists->master[i][0]] += half;                                                \
            force[2 * lists->master[i][1]] += half;                                                \
        }                                                                                          \
    }

void detail_hand_over(const DetailLists *lists, Precision precision)
{
    if (precision == PRECISION_SINGLE)
        HAND_OVER(float)
    else
        HAND_OVER(double)
}
