// adjust = "choi2005": a new node starts where the modified butterfly of the current positions puts
// it (section "Local spatial subdivision" of the paper). For the drawbacks, and for the default
// rule: README.md, "Momentum and mass across changes". The rule is linear and the rest positions
// obey it, so that it is applied to displacements; nodes that are off get the mean of their
// parents. Step thread, when a face is divided.
#include "surface/detail/detail.h"

#include "geometry/butterfly.h"

typedef struct Walk {
    const SurfaceModel *model;
    const Level *level;
} Walk;

static Vec3 displacement(const SurfaceModel *model, int node)
{
    const Detail *detail = model->detail;
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
    int at = edge, to = other_end(level, edge, node);
    while (face >= 0) {
        at = other_edge(level, face, node, at);
        face = levels_beyond(level, at, face);
    }
    const Vec3 *rest = walk->model->detail->set.levels.position;
    int before = other_end(level, at, node);
    Vec3 in = vec3_sub(rest[node], rest[before]), out = vec3_sub(rest[to], rest[node]);
    Vec3 u = displacement(walk->model, node);
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

Vec3 detail_butterfly(const SurfaceModel *model, int level, int edge)
{
    const Level *at = &model->detail->set.levels.level[level];
    const Walk walk = {model, at};
    const int *end = at->edge[edge];
    if (at->edge_face[edge][0] < 0 || at->edge_face[edge][1] < 0) {
        Vec3 inner = vec3_add(displacement(model, end[0]), displacement(model, end[1]));
        Vec3 outer = vec3_add(along_border(&walk, end[0], edge), along_border(&walk, end[1], edge));
        return vec3_madd(vec3_scale(9.0 / 16.0, inner), -1.0 / 16.0, outer);
    }
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
