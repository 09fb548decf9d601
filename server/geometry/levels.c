// SPDX-License-Identifier: MIT
// Builds the levels from the coarsest down, or validates levels that were built before; once at
// load, read-only afterwards.
#include "geometry/levels.h"

#include "base/check.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

// --- where midpoints lie ---
// The four rules of the modified butterfly. Load time only; never on the step thread.

static const double PI = 3.14159265358979323846;

typedef struct Stencil {
    const WingedMesh *winged;
    const int (*face)[3];
    const Vec3 *position;
} Stencil;

static bool is_regular(const WingedMesh *winged, int node)
{
    return winged_valence(winged, node) == 6 || winged_is_boundary_node(winged, node);
}

// Returns the node of a face that is neither u nor v.
static int third_node(const int face[3], int u, int v)
{
    for (int k = 0; k < 2; k++)
        if (face[k] != u && face[k] != v)
            return face[k];
    return face[2];
}

// --- boundary edges ---

// Returns the boundary edge's neighbour: the node before `node` when the boundary is walked towards
// `edge`.
static int along_boundary(const WingedMesh *winged, int node, int edge)
{
    // The edges round a border node start and end with its two border edges.
    int first = winged->node_edge[winged->node_edge_start[node]];
    int last = winged->node_edge[winged->node_edge_start[node + 1] - 1];
    return winged_other(winged, first == edge ? last : first, node);
}

// Returns the point beyond a, seen from b: the next one of the boundary, or at a corner the
// reflection.
static Vec3 beyond(const Stencil *s, int a, int b, int edge)
{
    Vec3 at = s->position[a], before = s->position[along_boundary(s->winged, a, edge)];
    Vec3 in = vec3_sub(at, before), out = vec3_sub(s->position[b], at);
    if (vec3_dot(in, out) < BUTTERFLY_CORNER * vec3_length(in) * vec3_length(out))
        return vec3_sub(vec3_scale(2.0, at), s->position[b]);
    return before;
}

static Vec3 boundary_point(const Stencil *s, int edge)
{
    const int *end = s->winged->edge[edge].node;
    Vec3 inner = vec3_add(s->position[end[0]], s->position[end[1]]);
    Vec3 outer = vec3_add(beyond(s, end[0], end[1], edge), beyond(s, end[1], end[0], edge));
    return vec3_madd(vec3_scale(9.0 / 16.0, inner), -1.0 / 16.0, outer);
}

// --- regular edges ---

// Returns the wing of the face across its edge (u, v), whose third node is w.
static Vec3 wing(const Stencil *s, int face, int u, int v, int w)
{
    for (int k = 0; k < 3; k++) {
        int other = s->winged->face_neighbor[face][k];
        if (other >= 0 && s->face[face][(k + 2) % 3] == w)
            return s->position[third_node(s->face[other], u, v)];
    }
    return vec3_sub(vec3_add(s->position[u], s->position[v]), s->position[w]);
}

static Vec3 regular_point(const Stencil *s, int edge)
{
    const WingedEdge *e = &s->winged->edge[edge];
    int a = e->node[0], b = e->node[1];
    Vec3 opposite = {0.0, 0.0, 0.0}, wings = opposite;
    // On each side the node opposite the edge, and the wings beyond that face.
    for (int side = 0; side < 2; side++) {
        int face = e->face[side], c = third_node(s->face[face], a, b);
        opposite = vec3_add(opposite, s->position[c]);
        wings = vec3_add(wings, vec3_add(wing(s, face, b, c, a), wing(s, face, c, a, b)));
    }
    Vec3 point = vec3_scale(0.5, vec3_add(s->position[a], s->position[b]));
    return vec3_madd(vec3_madd(point, 1.0 / 8.0, opposite), -1.0 / 16.0, wings);
}

// --- extraordinary nodes ---

// Returns neighbour i of a node relative to it; as the weights sum to 1/4, 3/4 v + sum s_j p_j = v
// + sum s_j (p_j - v).
static Vec3 spoke(const Stencil *s, int node, int i)
{
    const WingedMesh *winged = s->winged;
    int edge = winged->node_edge[winged->node_edge_start[node] + i];
    return vec3_sub(s->position[winged_other(winged, edge, node)], s->position[node]);
}

double butterfly_weight(int valence, int j)
{
    static const double small[3][4] = {
        {0.5, 0.0}, {5.0 / 12.0, -1.0 / 12.0, -1.0 / 12.0}, {3.0 / 8.0, 0.0, -1.0 / 8.0, 0.0}};
    if (valence <= 4)
        return small[valence - 2][j];
    double angle = 2.0 * PI * j / valence;
    return (0.25 + cos(angle) + 0.5 * cos(2.0 * angle)) / valence;
}

// Adds `share` of the offset of spoke i's new point to middle[] of that spoke, for K <= 4.
static Vec3 small_offset(const Stencil *s, int node, int valence, int i)
{
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int j = 0; j < valence; j++)
        sum = vec3_madd(sum, butterfly_weight(valence, j), spoke(s, node, (i + j) % valence));
    return sum;
}

// Sums over the spokes that all stencils of a node share. With cos(2 pi (j - i)/K) = cos_i cos_j +
// sin_i sin_j a node takes O(K), not O(K^2).
typedef struct Moments {
    Vec3 sum, cos1, sin1, cos2, sin2;
} Moments;

// Cosine and sine of 2 pi i / K.
static void turn(int i, int valence, double *c, double *s)
{
    double angle = 2.0 * PI * i / valence;
    *c = cos(angle), *s = sin(angle);
}

static Moments spoke_moments(const Stencil *s, int node, int valence)
{
    Moments moments = {0};
    // Sums of spokes times the cosines and sines that the weights consist of.
    for (int j = 0; j < valence; j++) {
        double c1, s1;
        turn(j, valence, &c1, &s1);
        Vec3 d = spoke(s, node, j);
        moments.sum = vec3_add(moments.sum, d);
        moments.cos1 = vec3_madd(moments.cos1, c1, d);
        moments.sin1 = vec3_madd(moments.sin1, s1, d);
        moments.cos2 = vec3_madd(moments.cos2, c1 * c1 - s1 * s1, d);
        moments.sin2 = vec3_madd(moments.sin2, 2.0 * s1 * c1, d);
    }
    return moments;
}

static Vec3 large_offset(const Moments *moments, int valence, int i)
{
    double c1, s1;
    turn(i, valence, &c1, &s1);
    Vec3 sum = vec3_scale(0.25, moments->sum);
    sum = vec3_madd(vec3_madd(sum, c1, moments->cos1), s1, moments->sin1);
    sum = vec3_madd(sum, 0.5 * (c1 * c1 - s1 * s1), moments->cos2);
    sum = vec3_madd(sum, s1 * c1, moments->sin2);
    return vec3_scale(1.0 / valence, sum);
}

// Adds the share of an extraordinary node to the new points of its edges.
static void add_extraordinary(const Stencil *s, int node, Vec3 *middle)
{
    const WingedMesh *winged = s->winged;
    int valence = winged_valence(winged, node);
    Moments moments = {0};
    // The sums of large valences are shared by all edges of the node.
    if (valence >= 5)
        moments = spoke_moments(s, node, valence);
    for (int i = 0; i < valence; i++) {
        int edge = winged->node_edge[winged->node_edge_start[node] + i];
        // Of two extraordinary ends each gives half.
        double share = is_regular(winged, winged_other(winged, edge, node)) ? 1.0 : 0.5;
        Vec3 offset =
            valence >= 5 ? large_offset(&moments, valence, i) : small_offset(s, node, valence, i);
        Vec3 point = vec3_add(s->position[node], offset);
        middle[edge] = vec3_madd(middle[edge], share, point);
    }
}

void butterfly_midpoints(const WingedMesh *winged, const int (*face)[3], const Vec3 *position,
                         Vec3 *middle)
{
    Stencil s = {winged, face, position};
    // Edges with a rule of their own; the others are sums over their extraordinary ends.
    for (int e = 0; e < winged->edge_count; e++) {
        const int *end = winged->edge[e].node;
        if (winged_is_boundary_edge(winged, e))
            middle[e] = boundary_point(&s, e);
        else if (is_regular(winged, end[0]) && is_regular(winged, end[1]))
            middle[e] = regular_point(&s, e);
        else
            middle[e] = (Vec3){0.0, 0.0, 0.0};
    }
    for (int i = 0; i < winged->node_count; i++)
        if (!is_regular(winged, i))
            add_extraordinary(&s, i, middle);
}

// --- levels ---

#define ALLOCATE_LEVEL(count, array, label)                                                        \
    ((array) = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)(count), sizeof *(array),             \
                              "%s/level %d " label, name, l))

bool levels_reserve(Levels *levels, const int count[3], int finest, const char *name, Arena *arena,
                    Status *status)
{
    *levels = (Levels){.finest = finest};
    if (finest < 0 || finest > LEVELS_MAX)
        return status_fail(status, STATUS_INVALID, "levels %d outside [0, %d]", finest, LEVELS_MAX);
    // Count nodes and faces of all levels first: each edge and face multiplies, and the limit must
    // hold before anything is allocated.
    int64_t nodes = count[0], edges = count[1], faces = count[2];
    for (int l = 0;; l++) {
        if (nodes > MESH_COUNT_MAX || faces > MESH_COUNT_MAX)
            return status_fail(status, STATUS_INVALID,
                               "level %d has %lld nodes and %lld faces, more than %d", l,
                               (long long)nodes, (long long)faces, MESH_COUNT_MAX);
        // The next level: every edge gives a node and two edges, every face three edges more.
        levels->level[l] =
            (Level){.node_count = (int)nodes, .edge_count = (int)edges, .face_count = (int)faces};
        if (l == finest)
            break;
        nodes += edges;
        edges = 2 * edges + 3 * faces;
        faces *= 4;
    }
    // Memory for all levels.
    levels->position = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)nodes,
                                      sizeof *levels->position, "%s/level positions", name);
    for (int l = 0; l <= finest; l++) {
        Level *level = &levels->level[l];
        ALLOCATE_LEVEL(level->face_count, level->face, "faces");
        ALLOCATE_LEVEL(level->face_count, level->face_edge, "face edges");
        ALLOCATE_LEVEL(level->edge_count, level->edge, "edges");
        ALLOCATE_LEVEL(level->edge_count, level->edge_face, "edge faces");
    }
    return true;
}

// Copies the edges of a level whose faces exist.
static void copy_edges(Level *level, const WingedMesh *winged)
{
    ASSERT(winged->edge_count == level->edge_count);
    // Level and table number the edges alike.
    memcpy(level->face_edge, winged->face_edge,
           (size_t)level->face_count * sizeof *level->face_edge);
    for (int e = 0; e < level->edge_count; e++)
        for (int k = 0; k < 2; k++) {
            level->edge[e][k] = winged->edge[e].node[k];
            level->edge_face[e][k] = winged->edge[e].face[k];
        }
}

// Makes four children of every face, from the midpoints of its edges.
static void divide_faces(const Level *coarse, int (*fine)[3])
{
    for (int f = 0; f < coarse->face_count; f++) {
        // Three midpoints: one corner each of three children, all corners of the fourth.
        const int *corner = coarse->face[f];
        int mid[3];
        for (int k = 0; k < 3; k++)
            mid[k] = coarse->node_count + coarse->face_edge[f][k];
        const int child[4][3] = {{corner[0], mid[0], mid[2]},
                                 {mid[0], corner[1], mid[1]},
                                 {mid[2], mid[1], corner[2]},
                                 {mid[0], mid[1], mid[2]}};
        memcpy(fine[4 * f], child, sizeof child);
    }
}

static void set_coarsest(Levels *levels, const TriMesh *mesh)
{
    memcpy(levels->level[0].face, mesh->triangle,
           (size_t)mesh->triangle_count * sizeof *mesh->triangle);
    memcpy(levels->position, mesh->position, (size_t)mesh->node_count * sizeof *levels->position);
}

// Checks the areas of a level's faces: the butterfly, although smooth, can collapse faces of a very
// irregular mesh.
static bool check_faces(const Levels *levels, int l, const TriMesh *mesh, Status *status)
{
    const Level *level = &levels->level[l];
    for (int f = 0; f < level->face_count; f++) {
        if (mesh_relative_height(levels->position, level->face[f]) >= MESH_SMALLEST_HEIGHT)
            continue;
        // Name the face of the mesh that it comes from.
        const int *corner = mesh->triangle[f >> 2 * l];
        return status_fail(status, STATUS_INVALID,
                           "the triangle of nodes %d, %d and %d is divided into one without area "
                           "at level %d",
                           mesh->file_index[corner[0]], mesh->file_index[corner[1]],
                           mesh->file_index[corner[2]], l);
    }
    return true;
}

bool levels_create(Levels *levels, const TriMesh *mesh, int finest, const char *name, Arena *arena,
                   Status *status)
{
    WingedMesh winged;
    // The coarsest level is the mesh itself.
    winged_create(&winged, mesh);
    const int count[3] = {mesh->node_count, winged.edge_count, mesh->triangle_count};
    bool ok = levels_reserve(levels, count, finest, name, arena, status);
    if (ok) {
        set_coarsest(levels, mesh);
        copy_edges(&levels->level[0], &winged);
    }
    // Each level: positions of midpoints, then faces, then the edge table of the new faces.
    for (int l = 1; l <= finest && ok; l++) {
        const Level *coarse = &levels->level[l - 1];
        Level *fine = &levels->level[l];
        butterfly_midpoints(&winged, (const int(*)[3])coarse->face, levels->position,
                            levels->position + coarse->node_count);
        divide_faces(coarse, fine->face);
        // The edges of the new faces.
        TriMesh view = {.node_count = fine->node_count,
                        .triangle_count = fine->face_count,
                        .triangle = fine->face};
        winged_destroy(&winged);
        winged_create(&winged, &view);
        copy_edges(fine, &winged);
        ok = check_faces(levels, l, mesh, status);
    }
    winged_destroy(&winged);
    return ok;
}

// True if the edges of a level are those of its faces, each once and sorted: then they are number
// for number those of winged_create.
static bool check_edges(const Level *level, int l, Status *status)
{
    // Edges are sorted, join two existing nodes and have a face beside them.
    int sides = 0, both = 0;
    for (int e = 0; e < level->edge_count; e++) {
        const int *end = level->edge[e], *before = e > 0 ? level->edge[e - 1] : NULL;
        bool sorted =
            before == NULL || before[0] < end[0] || (before[0] == end[0] && before[1] < end[1]);
        if (!sorted || end[0] < 0 || end[0] >= end[1] || end[1] >= level->node_count)
            return status_fail(status, STATUS_INVALID, "level %d: edge %d joins nodes %d and %d", l,
                               e, end[0], end[1]);
        const int *beside = level->edge_face[e];
        if (beside[0] < -1 || beside[1] < -1 || (beside[0] < 0 && beside[1] < 0))
            return status_fail(status, STATUS_INVALID, "level %d: edge %d lies at faces %d and %d",
                               l, e, beside[0], beside[1]);
        both += (beside[0] >= 0) + (beside[1] >= 0);
    }
    // Each face must run along its edges in the direction that the edge's table says.
    for (int f = 0; f < level->face_count; f++)
        for (int k = 0; k < 3; k++) {
            int e = level->face_edge[f][k], from = level->face[f][k];
            int to = level->face[f][(k + 1) % 3];
            bool inside = e >= 0 && e < level->edge_count;
            int side = inside && level->edge[e][0] == from ? 0 : 1;
            if (!inside || level->edge[e][side] != from || level->edge[e][1 - side] != to ||
                level->edge_face[e][side] != f)
                return status_fail(status, STATUS_INVALID,
                                   "level %d: face %d does not lie at its edge %d", l, f, e);
            sides++;
        }
    // Each side of an edge with a face was counted above, unless the table names too many.
    return sides == both ||
           status_fail(status, STATUS_INVALID, "level %d: edges have %d faces beside them, not %d",
                       l, both, sides);
}

bool levels_check(Levels *levels, const TriMesh *mesh, Status *status)
{
    set_coarsest(levels, mesh);
    for (int l = 0; l <= levels->finest; l++) {
        // Each level from the one above, then its own tables.
        const Level *level = &levels->level[l];
        if (l > 0)
            divide_faces(level - 1, levels->level[l].face);
        if (!check_edges(level, l, status) || (l > 0 && !check_faces(levels, l, mesh, status)))
            return false;
    }
    return true;
}

int levels_of_node(const Levels *levels, int node)
{
    int l = 0;
    while (node >= levels->level[l].node_count)
        l++;
    return l;
}

void levels_parents(const Levels *levels, int node, int parent[2])
{
    int l = levels_of_node(levels, node);
    parent[0] = parent[1] = node;
    if (l > 0)
        memcpy(parent, levels->level[l - 1].edge[node - levels->level[l - 1].node_count],
               2 * sizeof *parent);
}

void levels_halves(const Levels *levels, int level, int edge, int half[2])
{
    // Edge k of a face is edge k of its child at corner k and of the child at corner k + 1. It runs
    // from its first to its second end in the left face, in the opposite direction in the right
    // one.
    const Level *coarse = &levels->level[level];
    int side = coarse->edge_face[edge][0] >= 0 ? 0 : 1;
    int face = coarse->edge_face[edge][side], k = 0;
    while (coarse->face_edge[face][k] != edge)
        k++;
    const int(*face_edge)[3] = (const int(*)[3])levels->level[level + 1].face_edge;
    half[side] = face_edge[4 * face + k][k];
    half[1 - side] = face_edge[4 * face + (k + 1) % 3][k];
}

void levels_spread(const Levels *levels, int level, Vec3 *row)
{
    for (int l = 0; l < level; l++) {
        const Level *coarse = &levels->level[l];
        for (int e = 0; e < coarse->edge_count; e++) {
            const int *end = coarse->edge[e];
            row[coarse->node_count + e] = vec3_scale(0.5, vec3_add(row[end[0]], row[end[1]]));
        }
    }
}

static int *copy_ints(const int *from, int count)
{
    if (from == NULL)
        return NULL;
    int *to = malloc(((size_t)count + 1) * sizeof *to);
    ASSERT(to != NULL);
    memcpy(to, from, (size_t)count * sizeof *to);
    return to;
}

void levels_mesh(const Levels *levels, int level, const TriMesh *mesh, TriMesh *out)
{
    const Level *of = &levels->level[level];
    // Nodes and faces are those of the level.
    mesh_create(out, of->node_count, of->face_count);
    memcpy(out->position, levels->position, (size_t)of->node_count * sizeof *out->position);
    memcpy(out->triangle, of->face, (size_t)of->face_count * sizeof *out->triangle);
    // Names of the source stay; nodes that it lacks follow after them.
    out->file_node_count = mesh->file_node_count;
    out->file_node = copy_ints(mesh->file_node, mesh->file_node_count);
    out->copy_count = mesh->copy_count;
    out->copy_of = copy_ints(mesh->copy_of, mesh->copy_count);
    int next = mesh->file_node_count + mesh->copy_count - mesh->node_count;
    for (int i = 0; i < of->node_count; i++)
        out->file_index[i] = i < mesh->node_count ? mesh->file_index[i] : next + i;
}
