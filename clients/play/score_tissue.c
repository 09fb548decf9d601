// SPDX-License-Identifier: MIT
// What was severed of one body, from its meshes. A cut of a wall makes border edges on both of its
// sides, a cut of a solid makes walls on both: half of what was added is what was severed. Lengths,
// areas and places are those of the reference shape, the first frame, in which neither refinement
// nor motion changes them.
#include "score_body.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

// --- nodes by their ids --------------------------------------------------------------------------

static size_t slot_of(const ScoreTissue *tissue, int id)
{
    size_t at = ((uint32_t)id * 2654435761u) & (tissue->capacity - 1);
    while (tissue->node[at].used && tissue->node[at].id != id)
        at = (at + 1) & (tissue->capacity - 1);
    return at;
}

static void grow_nodes(ScoreTissue *tissue)
{
    Node *old = tissue->node;
    const size_t had = tissue->capacity;
    tissue->capacity = had == 0 ? 1024 : 2 * had;
    tissue->node = calloc(tissue->capacity, sizeof *tissue->node);
    ASSERT(tissue->node != NULL);
    for (size_t i = 0; i < had; i++)
        if (old[i].used)
            tissue->node[slot_of(tissue, old[i].id)] = old[i];
    free(old);
}

Node *score_find_node(const ScoreTissue *tissue, int id)
{
    Node *node = tissue->capacity > 0 ? &tissue->node[slot_of(tissue, id)] : NULL;
    return node != NULL && node->used ? node : NULL;
}

static Node *add_node(ScoreTissue *tissue, int id)
{
    if (2 * (tissue->count + 1) > tissue->capacity)
        grow_nodes(tissue);
    Node *node = &tissue->node[slot_of(tissue, id)];
    if (!node->used) {
        *node = (Node){.id = id, .used = true, .origin = id, .parent = {id, id}, .part = -1};
        tissue->count++;
    }
    return node;
}

// Notes where the nodes of a mesh come from.
static void note_births(ScoreTissue *tissue, const RecordingTopology *mesh)
{
    const bool known = mesh->node_origin != NULL && mesh->node_parent != NULL;
    for (int i = 0; i < mesh->node_count; i++) {
        Node *node = add_node(tissue, mesh->node_id[i]);
        if (!known)
            continue;
        const int origin = mesh->node_origin[i], *parent = mesh->node_parent[i];
        // After a reset an id may come again, for another node.
        if (node->origin != origin || node->parent[0] != parent[0] || node->parent[1] != parent[1])
            node->placed = false;
        node->origin = origin;
        node->parent[0] = parent[0];
        node->parent[1] = parent[1];
    }
}

// --- the reference shape -------------------------------------------------------------------------

static bool is_born(const Node *node)
{
    return node->origin != node->id || node->parent[0] != node->parent[1];
}

// Finds the place of a copy or of a midpoint by that of what it was made of.
static bool place_by_birth(const ScoreTissue *tissue, Node *node, int depth)
{
    enum { DEPTH = 64 }; // far more than there are levels: births of a damaged file form circles
    if (node == NULL || node->placed || depth == DEPTH || !is_born(node))
        return node != NULL && node->placed;
    Node *from[2] = {score_find_node(tissue, node->parent[0]),
                     score_find_node(tissue, node->parent[1])};
    if (node->origin != node->id)
        from[0] = from[1] = score_find_node(tissue, node->origin);
    if (place_by_birth(tissue, from[0], depth + 1) && place_by_birth(tissue, from[1], depth + 1)) {
        node->place = vec3_scale(0.5, vec3_add(from[0]->place, from[1]->place));
        node->placed = true;
        node->part = from[0]->part;
    }
    return node->placed;
}

static Vec3 position_of(const float *position, int i)
{
    const float *at = position + 3 * (size_t)i;
    return vec3((double)at[0], (double)at[1], (double)at[2]);
}

// Finds places of nodes that come from the inside of a solid: as displaced as their neighbours in
// the mesh. Returns how many were found.
static int place_by_neighbors(ScoreTissue *tissue, const float *position, bool *known, Vec3 *moved,
                              int *neighbors)
{
    const int nodes = tissue->node_count;
    int found = 0;
    memset(neighbors, 0, (size_t)nodes * sizeof *neighbors);
    for (int t = 0; t < tissue->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            const int a = tissue->triangle[t][k], b = tissue->triangle[t][(k + 1) % 3];
            for (int side = 0; side < 2; side++) {
                const int to = side ? a : b, from = side ? b : a;
                if (known[to] || !known[from])
                    continue;
                const Vec3 by = vec3_sub(position_of(position, from), tissue->place[from]);
                moved[to] = neighbors[to]++ == 0 ? by : vec3_add(moved[to], by);
            }
        }
    for (int i = 0; i < nodes; i++)
        if (neighbors[i] > 0) {
            tissue->place[i] = vec3_madd(position_of(position, i), -1.0 / neighbors[i], moved[i]);
            known[i] = true;
            found++;
        }
    return found;
}

static void place_nodes(ScoreTissue *tissue, const float *position)
{
    enum { PASSES = 64 }; // layers of new nodes
    const int nodes = tissue->node_count;
    int unknown = 0;
    bool *known = score_allocate(nodes, sizeof *known);
    for (int i = 0; i < nodes; i++) {
        Node *node = score_find_node(tissue, tissue->id[i]);
        if (!tissue->any && !is_born(node) && !node->placed) {
            node->place = position_of(position, i);
            node->placed = true;
        }
    }
    for (int i = 0; i < nodes; i++) {
        Node *node = score_find_node(tissue, tissue->id[i]);
        known[i] = place_by_birth(tissue, node, 0);
        tissue->place[i] = node->place;
        unknown += !known[i];
    }
    // The rest are new: as their neighbours, else as they are.
    if (unknown > 0) {
        Vec3 *moved = score_allocate(nodes, sizeof *moved);
        int *neighbors = score_allocate(nodes, sizeof *neighbors), found = 1;
        for (int pass = 0; pass < PASSES && found > 0; pass++)
            found = place_by_neighbors(tissue, position, known, moved, neighbors);
        free(moved);
        free(neighbors);
    }
    for (int i = 0; i < nodes; i++) {
        Node *node = score_find_node(tissue, tissue->id[i]);
        if (!node->placed)
            node->place = tissue->place[i] = known[i] ? tissue->place[i] : position_of(position, i);
        node->placed = true;
    }
    free(known);
}

// --- borders and walls ---------------------------------------------------------------------------

static int by_number(const void *a, const void *b)
{
    const int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

static void add_border(const ScoreTissue *tissue, int a, int b, Severed *sum)
{
    const Vec3 x = tissue->place[a], y = tissue->place[b];
    const double length = 0.5 * vec3_length(vec3_sub(y, x));
    const double inside = length * score_share_of_segment(tissue->rules, x, y);
    sum->inside += inside;
    sum->outside += length - inside;
}

// Half the length of all edges of one triangle alone.
static Severed measure_borders(const ScoreTissue *tissue)
{
    Severed sum = {0.0, 0.0};
    const int nodes = tissue->node_count;
    // The other ends of edges by their lower end.
    int *start = score_allocate(nodes + 1, sizeof *start);
    int *other = score_allocate(3 * tissue->triangle_count, sizeof *other);
    for (int round = 0; round < 2; round++) {
        for (int t = 0; t < tissue->triangle_count; t++)
            for (int k = 0; k < 3; k++) {
                const int a = tissue->triangle[t][k], b = tissue->triangle[t][(k + 1) % 3];
                const int low = a < b ? a : b, high = a < b ? b : a;
                if (round == 0)
                    start[low + 1]++;
                else
                    other[start[low]++] = high;
            }
        for (int i = 0; i < nodes && round == 0; i++)
            start[i + 1] += start[i];
    }
    // Filling has moved each start to its end.
    for (int i = 0; i < nodes; i++) {
        const int first = i > 0 ? start[i - 1] : 0, end = start[i];
        qsort(other + first, (size_t)(end - first), sizeof *other, by_number);
        for (int k = first, same; k < end; k = same) {
            for (same = k + 1; same < end && other[same] == other[k];)
                same++;
            if (same == k + 1 && other[k] != i)
                add_border(tissue, i, other[k], &sum);
        }
    }
    free(start);
    free(other);
    return sum;
}

void score_corners(const ScoreTissue *tissue, int triangle, Vec3 corner[3])
{
    for (int k = 0; k < 3; k++)
        corner[k] = tissue->place[tissue->triangle[triangle][k]];
}

double score_area(const Vec3 corner[3])
{
    return 0.5 *
           vec3_length(vec3_cross(vec3_sub(corner[1], corner[0]), vec3_sub(corner[2], corner[0])));
}

// Half the area of all walls.
static Severed measure_walls(const ScoreTissue *tissue)
{
    Severed sum = {0.0, 0.0};
    for (int t = tissue->first_wall; t < tissue->triangle_count; t++) {
        Vec3 corner[3];
        score_corners(tissue, t, corner);
        const double area = 0.5 * score_area(corner);
        const double inside = area * score_share_of_triangle(tissue->rules, corner);
        sum.inside += inside;
        sum.outside += area - inside;
    }
    return sum;
}

// --- meshes --------------------------------------------------------------------------------------

ScoreTissue *score_tissue_create(const ScoreRules *rules, const char *body, int first_wall)
{
    ScoreTissue *tissue = calloc(1, sizeof *tissue);
    ASSERT(tissue != NULL);
    tissue->rules = rules;
    tissue->first_wall = first_wall;
    snprintf(tissue->body, sizeof tissue->body, "%s", body);
    return tissue;
}

void score_tissue_destroy(ScoreTissue *tissue)
{
    free(tissue->node);
    free(tissue->id);
    free(tissue->triangle);
    free(tissue->place);
    free(tissue);
}

static void copy_mesh(ScoreTissue *tissue, const RecordingTopology *mesh)
{
    free(tissue->id);
    free(tissue->triangle);
    free(tissue->place);
    tissue->node_count = mesh->node_count;
    tissue->triangle_count = mesh->triangle_count;
    tissue->id = score_allocate(mesh->node_count, sizeof *tissue->id);
    tissue->triangle = score_allocate(mesh->triangle_count, sizeof *tissue->triangle);
    tissue->place = score_allocate(mesh->node_count, sizeof *tissue->place);
    memcpy(tissue->id, mesh->node_id, (size_t)mesh->node_count * sizeof *tissue->id);
    memcpy(tissue->triangle, mesh->triangle,
           (size_t)mesh->triangle_count * sizeof *tissue->triangle);
}

Severed score_tissue_mesh(ScoreTissue *tissue, const RecordingTopology *mesh, const float *position)
{
    const double same = 1e-9; // of the whole: sums in another order
    copy_mesh(tissue, mesh);
    note_births(tissue, mesh);
    place_nodes(tissue, position);
    const Severed total = tissue->first_wall > 0 ? measure_walls(tissue) : measure_borders(tissue);
    const Severed before = tissue->any ? tissue->total : total;
    const double all = total.inside + total.outside;
    const double added = all - before.inside - before.outside;
    tissue->total = total;
    if (!tissue->any)
        score_note_parts(tissue);
    tissue->any = true;
    if (!(added > same * all))
        return (Severed){0.0, 0.0};
    return (Severed){.inside = fmax(0.0, total.inside - before.inside),
                     .outside = fmax(0.0, total.outside - before.outside)};
}
