// SPDX-License-Identifier: MIT
// Needs only what is published (ids and parents): nothing of the hierarchy that made the mesh, so
// that it judges that hierarchy independently.
#include "mesh_check.h"
#include "scoped.h"

#include "base/check.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

// An edge of a triangle in its direction there; low and high are the same two slots in order.
typedef struct Side {
    int from, to, low, high;
} Side;

// A piece of a border: where it lies on the edge of level 0 that joins ids low < high.
typedef struct Piece {
    int low, high;   // ids
    double from, to; // 0 at low, 1 at high; multiples of a power of two: exact
} Piece;

typedef struct Check {
    const BodyMesh *mesh;
    const Vec3 *position;
    int *slot_of; // [id_count] -1: no such node
    int id_count;
    bool *used; // [node_count]
    Side *side; // [side_count] of all triangles
    int side_count;
    Piece *piece; // [piece_count]
    int piece_count;
    char *why;
} Check;

static bool fault(Check *check, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(check->why, MESH_CHECK_TEXT, format, arguments);
    va_end(arguments);
    return false;
}

// --- nodes ---

static bool list_ids(Check *check)
{
    const BodyMesh *mesh = check->mesh;
    for (int i = 0; i < mesh->node_count; i++)
        if (mesh->id[i] >= check->id_count)
            check->id_count = mesh->id[i] + 1;
    check->slot_of = zeroed(check->id_count, sizeof *check->slot_of);
    memset(check->slot_of, -1, (size_t)check->id_count * sizeof *check->slot_of);
    for (int i = 0; i < mesh->node_count; i++) {
        int id = mesh->id[i];
        if (id < -1)
            return fault(check, "slot %d has id %d", i, id);
        if (id >= 0 && check->slot_of[id] >= 0)
            return fault(check, "slots %d and %d both have id %d", check->slot_of[id], i, id);
        if (id >= 0)
            check->slot_of[id] = i;
    }
    return true;
}

static int find_slot(const Check *check, int id)
{
    return id >= 0 && id < check->id_count ? check->slot_of[id] : -1;
}

static bool check_parents(Check *check)
{
    const BodyMesh *mesh = check->mesh;
    for (int i = 0; i < mesh->node_count; i++) {
        const int *parent = mesh->parent[i];
        int level = mesh->level[i];
        if (mesh->id[i] < 0)
            continue;
        if (level < 0)
            return fault(check, "node %d has level %d", mesh->id[i], level);
        if (level == 0 && (parent[0] != mesh->id[i] || parent[1] != mesh->id[i]))
            return fault(check, "node %d of level 0 has parents %d and %d", mesh->id[i], parent[0],
                         parent[1]);
        if (level > 0 && parent[0] == parent[1])
            return fault(check, "midpoint %d has parent %d twice", mesh->id[i], parent[0]);
        for (int k = 0; k < 2; k++) {
            int slot = find_slot(check, parent[k]);
            if (slot < 0)
                return fault(check, "parent %d of node %d is not in the mesh", parent[k],
                             mesh->id[i]);
            if (level > 0 && mesh->level[slot] >= level)
                return fault(check, "node %d of level %d has parent %d of level %d", mesh->id[i],
                             level, parent[k], mesh->level[slot]);
        }
    }
    return true;
}

static bool check_position(Check *check, int triangle)
{
    const int *corner = check->mesh->triangle[triangle];
    for (int k = 0; k < 3; k++) {
        Vec3 p = check->position[corner[k]];
        if (!isfinite(p.x) || !isfinite(p.y) || !isfinite(p.z))
            return fault(check, "node %d is not at a finite place", check->mesh->id[corner[k]]);
    }
    double height = mesh_relative_height(check->position, corner);
    return height > MESH_SMALLEST_HEIGHT ||
           fault(check, "triangle %d of nodes %d, %d, %d has no area", triangle,
                 check->mesh->id[corner[0]], check->mesh->id[corner[1]],
                 check->mesh->id[corner[2]]);
}

// --- triangles ---

static bool list_sides(Check *check)
{
    const BodyMesh *mesh = check->mesh;
    check->side = zeroed(3 * mesh->triangle_count, sizeof *check->side);
    check->used = zeroed(mesh->node_count, sizeof *check->used);
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *corner = mesh->triangle[t];
        if (corner[0] == 0 && corner[1] == 0 && corner[2] == 0)
            continue;
        for (int k = 0; k < 3; k++) {
            int from = corner[k], to = corner[(k + 1) % 3];
            if (from < 0 || from >= mesh->node_count || mesh->id[from] < 0)
                return fault(check, "triangle %d has slot %d, which is no node", t, from);
            if (from == to)
                return fault(check, "triangle %d has node %d twice", t, mesh->id[from]);
            if (to >= 0 && to < mesh->node_count && mesh->piece[from] != mesh->piece[to])
                return fault(check, "triangle %d joins pieces %d and %d", t, mesh->piece[from],
                             mesh->piece[to]);
            check->used[from] = true;
            check->side[check->side_count++] =
                (Side){from, to, from < to ? from : to, from < to ? to : from};
        }
        if (check->position != NULL && !check_position(check, t))
            return false;
    }
    for (int i = 0; i < mesh->node_count; i++)
        if (mesh->id[i] >= 0 && !check->used[i])
            return fault(check, "node %d is in no triangle", mesh->id[i]);
    return true;
}

static int compare_sides(const void *left, const void *right)
{
    const Side *a = left, *b = right;
    return a->low != b->low ? (a->low > b->low) - (a->low < b->low)
                            : (a->high > b->high) - (a->high < b->high);
}

// --- borders ---

// Where a node lies on the edge of level 0 that joins two ids, which may still be open (-1). False:
// on no edge, or another one.
static bool place_on_edge(const Check *check, int slot, int end[2], double *at)
{
    const BodyMesh *mesh = check->mesh;
    if (mesh->level[slot] == 0) {
        for (int k = 0; k < 2; k++) {
            if (end[k] != -1 && end[k] != mesh->id[slot])
                continue;
            end[k] = mesh->id[slot];
            *at = k;
            return true;
        }
        return false;
    }
    double place[2];
    for (int k = 0; k < 2; k++)
        if (!place_on_edge(check, find_slot(check, mesh->parent[slot][k]), end, &place[k]))
            return false;
    *at = 0.5 * (place[0] + place[1]);
    return true;
}

// A side without a partner must be a piece of an edge of level 0.
static bool take_border(Check *check, const Side *side)
{
    const int *id = check->mesh->id;
    int end[2] = {-1, -1};
    double from, to;
    if (!place_on_edge(check, side->from, end, &from) || !place_on_edge(check, side->to, end, &to))
        return fault(check, "edge from %d to %d lies in one triangle and on no border of level 0",
                     id[side->from], id[side->to]);
    bool turned = end[0] > end[1];
    check->piece[check->piece_count++] =
        (Piece){turned ? end[1] : end[0], turned ? end[0] : end[1], turned ? 1.0 - from : from,
                turned ? 1.0 - to : to};
    return true;
}

static int compare_pieces(const void *left, const void *right)
{
    const Piece *a = left, *b = right;
    if (a->low != b->low)
        return (a->low > b->low) - (a->low < b->low);
    if (a->high != b->high)
        return (a->high > b->high) - (a->high < b->high);
    double first = fmin(a->from, a->to), second = fmin(b->from, b->to);
    return (first > second) - (first < second);
}

// The pieces of each border edge cover it once, all in one direction. Two sides of an inner edge
// that are divided differently (a T-junction) lie on it in both.
static bool check_borders(Check *check)
{
    qsort(check->piece, (size_t)check->piece_count, sizeof *check->piece, compare_pieces);
    for (int i = 0; i < check->piece_count;) {
        const Piece *first = &check->piece[i];
        bool forward = first->to > first->from;
        double reached = 0.0;
        for (; i < check->piece_count && check->piece[i].low == first->low &&
               check->piece[i].high == first->high;
             i++) {
            const Piece *piece = &check->piece[i];
            if ((piece->to > piece->from) != forward || fmin(piece->from, piece->to) != reached)
                return fault(check, "crack along the edge of level 0 between %d and %d", first->low,
                             first->high);
            reached = fmax(piece->from, piece->to);
        }
        if (reached != 1.0)
            return fault(check, "the edge of level 0 between %d and %d ends in its middle",
                         first->low, first->high);
    }
    return true;
}

static bool match_sides(Check *check)
{
    const int *id = check->mesh->id;
    check->piece = zeroed(check->side_count, sizeof *check->piece);
    qsort(check->side, (size_t)check->side_count, sizeof *check->side, compare_sides);
    for (int i = 0; i < check->side_count;) {
        const Side *side = &check->side[i];
        int count = 1;
        while (i + count < check->side_count && compare_sides(side, side + count) == 0)
            count++;
        if (count > 2)
            return fault(check, "edge between %d and %d lies in %d triangles", id[side->low],
                         id[side->high], count);
        if (count == 2 && side[0].from == side[1].from)
            return fault(check,
                         "the triangles at the edge between %d and %d turn against each "
                         "other",
                         id[side->low], id[side->high]);
        if (count == 1 && !take_border(check, side))
            return false;
        i += count;
    }
    return check_borders(check);
}

// --- the mesh of level 0 ---

// The partner of side k of triangle t: whether there is one. Quadratic: meshes of tests are small.
static bool has_partner(const TriMesh *base, int from, int to)
{
    for (int t = 0; t < base->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            if (base->triangle[t][k] == to && base->triangle[t][(k + 1) % 3] == from)
                return true;
    return false;
}

static bool is_border(const Check *check, int from, int to)
{
    int low = from < to ? from : to, high = from < to ? to : from;
    for (int i = 0; i < check->piece_count; i++)
        if (check->piece[i].low == low && check->piece[i].high == high)
            return (check->piece[i].to > check->piece[i].from) == (from == low);
    return false;
}

static bool check_base(Check *check, const TriMesh *base)
{
    int borders = 0, found = 0;
    for (int t = 0; t < base->triangle_count; t++) {
        for (int k = 0; k < 3; k++) {
            int from = base->triangle[t][k], to = base->triangle[t][(k + 1) % 3];
            if (has_partner(base, from, to))
                continue;
            borders++;
            if (!is_border(check, base->file_index[from], base->file_index[to]))
                return fault(check, "the border of level 0 from %d to %d is missing",
                             base->file_index[from], base->file_index[to]);
        }
    }
    for (int i = 0; i < check->piece_count; i++)
        found += i == 0 || check->piece[i].low != check->piece[i - 1].low ||
                 check->piece[i].high != check->piece[i - 1].high;
    return found == borders ||
           fault(check, "%d borders, but level 0 has %d: a whole face is missing", found, borders);
}

bool mesh_agrees(const BodyMesh *mesh, const TriMesh *base, const Vec3 *position,
                 char why[MESH_CHECK_TEXT])
{
    Check check = {.mesh = mesh, .position = position, .why = why};
    why[0] = '\0';
    bool ok = mesh->node_count > 0 && mesh->node_count <= mesh->node_capacity &&
              mesh->triangle_count > 0 && mesh->triangle_count <= mesh->triangle_capacity;
    if (!ok)
        fault(&check, "%d of %d nodes, %d of %d triangles", mesh->node_count, mesh->node_capacity,
              mesh->triangle_count, mesh->triangle_capacity);
    ok = ok && list_ids(&check) && check_parents(&check) && list_sides(&check) &&
         match_sides(&check) && (base == NULL || check_base(&check, base));
    free(check.slot_of);
    free(check.used);
    free(check.side);
    free(check.piece);
    return ok;
}
