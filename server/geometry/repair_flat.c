// SPDX-License-Identifier: MIT
// Removes triangles without area, without leaving a crack. Such a triangle is a line: the middle
// node lies on the edge between the other two. Dropping it alone would leave that edge without a
// face beside the two shorter ones (a T-junction), so
//   - at a border it is dropped: the two shorter edges become the border;
//   - else its longest edge is turned: the neighbour across is cut in two at the middle node;
//   - where that gives no better triangles because two nodes almost coincide, those are merged;
// and all other cases are refused. Of two adjacent such triangles, the one whose neighbour across
// has no area either waits for it, unless they share their longest edge: then turning it makes both
// shorter. Each is examined again only when a neighbour has changed.
#include "geometry/repair.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

enum {
    MERGES = 8,
    LOOKS = 100
}; // most rounds of merging; most looks at a flat triangle, on average

// Nodes nearer to each other than this fraction of the triangle's longest edge may be merged: a
// distance at the rounding error of single-precision coordinates.
static const double NEAR = 1e-6;

typedef struct Flats {
    Repair *repair;
    HalfEdges half; // with up-to-date twins
    int *waiting;   // [capacity] triangles to examine, a stack
    int count, capacity;
    bool *listed; // [triangle] is on the stack
} Flats;

static bool is_flat(const TriMesh *mesh, int a, int b, int c)
{
    return !(mesh_relative_height(mesh->position, (const int[3]){a, b, c}) > MESH_SMALLEST_HEIGHT);
}

static bool is_flat_triangle(const TriMesh *mesh, int triangle)
{
    const int *node = mesh->triangle[triangle];
    return is_flat(mesh, node[0], node[1], node[2]);
}

static double distance(const TriMesh *mesh, int a, int b)
{
    return vec3_length(vec3_sub(mesh->position[a], mesh->position[b]));
}

static double length(const TriMesh *mesh, int h)
{
    return distance(mesh, half_edge_from(mesh, h), half_edge_to(mesh, h));
}

static int longest_edge(const TriMesh *mesh, int triangle)
{
    int longest = 3 * triangle;
    for (int h = longest + 1; h < 3 * triangle + 3; h++)
        if (length(mesh, h) > length(mesh, longest))
            longest = h;
    return longest;
}

// Returns the node across from half-edge h in its triangle.
static int apex(const TriMesh *mesh, int h)
{
    return half_edge_from(mesh, half_edge_previous(h));
}

// --- neighbours of a node ---

// A walk around the start of a half-edge, one way, then the other if there is a border.
typedef struct FanWalk {
    int start, at;
    int last; // the neighbour at the border, still to be returned, or -1
    bool back;
} FanWalk;

// Returns the next neighbour, -1 after the last.
static int next_neighbour(const Flats *flats, FanWalk *walk)
{
    const TriMesh *mesh = &flats->repair->mesh;
    if (walk->at < 0)
        return -1;
    // Forward until the walk closes or meets a border; then return the border node and walk back.
    if (!walk->back) {
        int neighbour = half_edge_to(mesh, walk->at), previous = half_edge_previous(walk->at);
        walk->at = flats->half.twin[previous];
        if (walk->at == walk->start) {
            walk->at = -1;
        } else if (walk->at < 0) {
            walk->back = true;
            walk->last = half_edge_from(mesh, previous);
            walk->at = walk->start;
        }
        return neighbour;
    }
    // At the turn, the node across the border.
    if (walk->last >= 0) {
        int neighbour = walk->last;
        walk->last = -1;
        return neighbour;
    }
    // Backward from the start until the other border.
    int twin = flats->half.twin[walk->at];
    walk->at = twin < 0 ? -1 : half_edge_next(twin);
    return walk->at < 0 ? -1 : half_edge_to(mesh, walk->at);
}

// True if the starts of two half-edges are neighbours. Walks around both at once, so that the cost
// is that of the smaller fan, however large the other one is.
static bool share_an_edge(const Flats *flats, int h, int g)
{
    const TriMesh *mesh = &flats->repair->mesh;
    int a = half_edge_from(mesh, h), b = half_edge_from(mesh, g);
    FanWalk round_a = {h, h, -1, false}, round_b = {g, g, -1, false};
    for (;;) {
        int next_a = next_neighbour(flats, &round_a), next_b = next_neighbour(flats, &round_b);
        if (next_a == b || next_b == a)
            return true;
        if (next_a < 0 || next_b < 0)
            return false;
    }
}

// --- edits ---

static void look_at(Flats *flats, int triangle)
{
    if (flats->listed[triangle] || flats->repair->polygon[triangle] < 0 ||
        !is_flat_triangle(&flats->repair->mesh, triangle))
        return;
    if (flats->count == flats->capacity) {
        flats->capacity = flats->capacity == 0 ? 64 : 2 * flats->capacity;
        flats->waiting = realloc(flats->waiting, (size_t)flats->capacity * sizeof *flats->waiting);
        ASSERT(flats->waiting != NULL);
    }
    flats->listed[triangle] = true;
    flats->waiting[flats->count++] = triangle;
}

static void look_at_neighbours(Flats *flats, int triangle)
{
    for (int h = 3 * triangle; h < 3 * triangle + 3; h++)
        if (flats->half.twin[h] >= 0)
            look_at(flats, flats->half.twin[h] / 3);
}

static void pair(Flats *flats, int h, int twin)
{
    flats->half.twin[h] = twin;
    if (twin >= 0)
        flats->half.twin[twin] = h;
}

static void drop(Flats *flats, int triangle)
{
    look_at_neighbours(flats, triangle);
    for (int h = 3 * triangle; h < 3 * triangle + 3; h++)
        if (flats->half.twin[h] >= 0)
            flats->half.twin[flats->half.twin[h]] = -1;
    flats->repair->polygon[triangle] = -1;
}

static void set_corner(Repair *repair, int h, int node, int corner)
{
    repair->mesh.triangle[h / 3][h % 3] = node;
    repair->corner[h / 3][h % 3] = corner;
}

// (a, b, c) with h = a b and (b, a, d) with its twin become (a, d, c) and (b, c, d).
static void turn(Flats *flats, int h)
{
    Repair *repair = flats->repair;
    const TriMesh *mesh = &repair->mesh;
    // The four nodes around the edge, and what lies beyond two of the sides.
    int g = flats->half.twin[h], h_next = half_edge_next(h), g_next = half_edge_next(g);
    int c = apex(mesh, h), d = apex(mesh, g);
    int corner_c = repair->corner[h / 3][half_edge_previous(h) % 3];
    int corner_d = repair->corner[g / 3][half_edge_previous(g) % 3];
    int beyond_b_c = flats->half.twin[h_next], beyond_a_d = flats->half.twin[g_next];
    // Each face gives one corner to the other.
    set_corner(repair, h_next, d, corner_d);
    set_corner(repair, g_next, c, corner_c);
    // Twins follow the corners.
    pair(flats, h, beyond_a_d);
    pair(flats, g, beyond_b_c);
    pair(flats, h_next, g_next);
    // Both faces and what lies beside them may be flat now, or not any longer.
    look_at(flats, h / 3);
    look_at(flats, g / 3);
    look_at_neighbours(flats, h / 3);
    look_at_neighbours(flats, g / 3);
}

static bool can_turn(const Flats *flats, int h)
{
    const TriMesh *mesh = &flats->repair->mesh;
    int g = flats->half.twin[h];
    int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h);
    int c = apex(mesh, h), d = apex(mesh, g);
    if (c == d || share_an_edge(flats, half_edge_previous(h), half_edge_previous(g)))
        return false;
    if (is_flat(mesh, b, a, d))
        return distance(mesh, c, d) < length(mesh, h) &&
               length(mesh, longest_edge(mesh, g / 3)) <= length(mesh, h);
    return !is_flat(mesh, a, d, c) && !is_flat(mesh, b, c, d);
}

// Removes what dropping and turning can; false when the limit of steps is reached.
static bool drop_and_turn(Flats *flats)
{
    const TriMesh *mesh = &flats->repair->mesh;
    // All flat triangles wait for a look.
    half_edge_create(&flats->half, mesh);
    for (int t = 0; t < mesh->triangle_count; t++)
        look_at(flats, t);
    long looks = (long)LOOKS * flats->count; // rounding must not keep it going
    while (flats->count > 0 && looks-- > 0) {
        int triangle = flats->waiting[--flats->count];
        flats->listed[triangle] = false;
        if (flats->repair->polygon[triangle] < 0 || !is_flat_triangle(mesh, triangle))
            continue;
        // Its longest edge: at a border the triangle can go, else that edge turns.
        int h = longest_edge(mesh, triangle);
        if (flats->half.twin[h] < 0)
            drop(flats, triangle);
        else if (can_turn(flats, h))
            turn(flats, h);
    }
    // Drop what was marked.
    half_edge_destroy(&flats->half);
    repair_compact(flats->repair);
    return flats->count == 0;
}

// Drops pairs of triangles with the same three nodes, which enclose nothing: a merge leaves one of
// a tetrahedron.
static void drop_pairs(Repair *repair)
{
    const TriMesh *mesh = &repair->mesh;
    HalfEdges half;
    half_edge_create(&half, mesh);
    for (int h = 0; h < half.count; h++)
        if (half.twin[h] >= 0 && apex(mesh, h) == apex(mesh, half.twin[h])) {
            repair->repairs->flat_faces += repair->polygon[h / 3] >= 0;
            repair->polygon[h / 3] = -1;
        }
    half_edge_destroy(&half);
    repair_compact(repair);
}

// Merges the two nearest nodes of flat triangles where they almost coincide; returns how many were
// merged.
static int merge(Repair *repair)
{
    TriMesh *mesh = &repair->mesh;
    int merged = 0, draft_nodes = repair->draft->node_count;
    for (int t = 0; t < mesh->triangle_count; t++) {
        if (!is_flat_triangle(mesh, t))
            continue;
        // The shorter of the two other edges joins the nodes that may coincide.
        int longest = longest_edge(mesh, t), h = half_edge_next(longest);
        if (length(mesh, half_edge_previous(longest)) < length(mesh, h))
            h = half_edge_previous(longest);
        int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h);
        // Only nodes of the source that lie close to each other, relative to the longest edge.
        if (a >= draft_nodes || b >= draft_nodes ||
            !(length(mesh, h) <= NEAR * length(mesh, longest)))
            continue;
        // The lower number stays.
        a = repair_node(repair, a);
        b = repair_node(repair, b);
        repair->kept[a > b ? a : b] = a > b ? b : a;
        merged += a != b;
    }
    // Rename the nodes in all triangles; those that collapse are dropped.
    for (int t = 0; merged > 0 && t < mesh->triangle_count; t++) {
        int *node = mesh->triangle[t];
        for (int k = 0; k < 3; k++)
            if (node[k] < draft_nodes)
                node[k] = repair_node(repair, node[k]);
        if (node[0] == node[1] || node[1] == node[2] || node[2] == node[0])
            repair->polygon[t] = -1;
    }
    repair_compact(repair);
    if (merged > 0)
        drop_pairs(repair);
    repair->repairs->merged_nodes += merged;
    return merged;
}

static int count_flat(const TriMesh *mesh)
{
    int count = 0;
    for (int t = 0; t < mesh->triangle_count; t++)
        count += is_flat_triangle(mesh, t);
    return count;
}

bool repair_flat_faces(Repair *repair)
{
    // Most meshes have none.
    const TriMesh *mesh = &repair->mesh;
    int flat = count_flat(mesh);
    if (flat == 0)
        return true;
    repair->repairs->flat_faces += flat;
    Flats flats = {.repair = repair};
    flats.listed = calloc((size_t)mesh->triangle_count + 1, sizeof *flats.listed);
    ASSERT(flats.listed != NULL);
    // A merge can make new flat triangles that dropping or turning removes, so alternate.
    for (int i = 0; i < MERGES; i++)
        if (!drop_and_turn(&flats) || count_flat(mesh) == 0 || merge(repair) == 0)
            break;
    // Whatever is still flat is refused with its nodes.
    free(flats.listed);
    free(flats.waiting);
    if (mesh->triangle_count == 0)
        return repair_fail(repair, -1, -1, "the mesh has no face with an area");
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *node = mesh->triangle[t];
        if (is_flat_triangle(mesh, t))
            return repair_fail(repair, -1, t,
                               "face %d (nodes %d, %d, %d) has no area and cannot be taken out "
                               "without a crack",
                               repair->polygon[t], node[0], node[1], node[2]);
    }
    return true;
}
