// Welds nodes and cuts polygons into triangles; drops degenerate and duplicate faces.
#include "geometry/repair.h"

#include "base/check.h"
#include "geometry/polygon.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// --- triangles ---

// The corners of a polygon, without repetitions of the same node: their draft corners, node numbers
// and positions.
typedef struct Outline {
    int *corner, *node;
    Vec3 *position;
    int (*triangle)[3];
    int count;
} Outline;

static int longest_outline(const MeshDraft *draft)
{
    int longest = 3;
    for (int p = 0; p < draft->polygon_count; p++) {
        int size = draft->end[p] - mesh_draft_start(draft, p);
        longest = size > longest ? size : longest;
    }
    return longest;
}

static void trace_outline(const Repair *repair, int polygon, Outline *outline)
{
    const MeshDraft *draft = repair->draft;
    int count = 0;
    for (int c = mesh_draft_start(draft, polygon); c < draft->end[polygon]; c++) {
        int node = repair_node(repair, draft->corner[c]);
        if (count > 0 && outline->node[count - 1] == node)
            continue;
        outline->corner[count] = c;
        outline->node[count] = node;
        outline->position[count++] = repair->mesh.position[node];
    }
    while (count > 1 && outline->node[count - 1] == outline->node[0])
        count--;
    outline->count = count;
}

static void add_triangle(Repair *repair, int polygon, const Outline *outline, const int corner[3])
{
    int t = repair->mesh.triangle_count++;
    repair->polygon[t] = polygon;
    for (int k = 0; k < 3; k++) {
        repair->corner[t][k] = outline->corner[corner[k]];
        repair->mesh.triangle[t][k] = outline->node[corner[k]];
    }
}

static bool cut_polygon(Repair *repair, int polygon, Outline *outline)
{
    trace_outline(repair, polygon, outline);
    if (outline->count < 3) {
        repair->repairs->degenerate_faces++;
        return true;
    }
    repair->repairs->polygons += outline->count > 3;
    if (outline->count == 3) {
        add_triangle(repair, polygon, outline, (const int[3]){0, 1, 2});
        return true;
    }
    if (!polygon_triangulate(outline->position, outline->node, outline->count, outline->triangle)) {
        repair->fault->triangle = polygon;
        snprintf(repair->fault->text, sizeof repair->fault->text,
                 outline->count > POLYGON_CORNERS
                     ? "face %d has %d corners and is not convex, more than can be cut up"
                     : "face %d has %d corners and crosses itself",
                 polygon, outline->count);
        return false;
    }
    for (int t = 0; t < outline->count - 2; t++)
        add_triangle(repair, polygon, outline, outline->triangle[t]);
    return true;
}

static bool cut_polygons(Repair *repair)
{
    size_t longest = (size_t)longest_outline(repair->draft);
    Outline outline = {
        .corner = malloc(longest * sizeof *outline.corner),
        .node = malloc(longest * sizeof *outline.node),
        .position = malloc(longest * sizeof *outline.position),
        .triangle = malloc(longest * sizeof *outline.triangle),
    };
    ASSERT(outline.corner != NULL && outline.node != NULL && outline.position != NULL &&
           outline.triangle != NULL);
    bool ok = true;
    for (int p = 0; ok && p < repair->draft->polygon_count; p++)
        ok = cut_polygon(repair, p, &outline);
    free(outline.corner);
    free(outline.node);
    free(outline.position);
    free(outline.triangle);
    return ok;
}

static bool repeats_a_node(const int corner[3])
{
    return corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0];
}

// Drops triangles that welding collapsed; a polygon that loses all its triangles is a degenerate
// face.
static void drop_degenerate(Repair *repair)
{
    TriMesh *mesh = &repair->mesh;
    for (int t = 0; t < mesh->triangle_count;) {
        int polygon = repair->polygon[t], left = 0;
        for (; t < mesh->triangle_count && repair->polygon[t] == polygon; t++) {
            if (repeats_a_node(mesh->triangle[t]))
                mesh->triangle[t][0] = -1;
            else
                left++;
        }
        repair->repairs->degenerate_faces += left == 0;
    }
    for (int t = 0; t < mesh->triangle_count; t++)
        if (mesh->triangle[t][0] < 0)
            repair->polygon[t] = -1;
    repair_compact(repair);
}

// The nodes of a triangle, ascending.
static void sorted_nodes(const int corner[3], int node[3])
{
    memcpy(node, corner, 3 * sizeof *node);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 2; k++)
            if (node[k] > node[k + 1]) {
                int swap = node[k];
                node[k] = node[k + 1];
                node[k + 1] = swap;
            }
}

static size_t hash_nodes(const int node[3])
{
    uint64_t hash = 0;
    for (int k = 0; k < 3; k++) {
        hash = (hash ^ (uint64_t)node[k]) * UINT64_C(0x9e3779b97f4a7c15);
        hash ^= hash >> 29;
    }
    return (size_t)(hash * UINT64_C(0xbf58476d1ce4e5b9) >> 20);
}

// Keeps the first of the triangles with the same nodes, whatever their orientations.
static void drop_duplicates(Repair *repair)
{
    TriMesh *mesh = &repair->mesh;
    // A hash table with open addressing, at most half full.
    size_t slots = 16;
    while (slots < 2 * (size_t)mesh->triangle_count)
        slots *= 2;
    int *slot = malloc(slots * sizeof *slot), last = -1;
    ASSERT(slot != NULL);
    memset(slot, 0xff, slots * sizeof *slot);
    for (int t = 0; t < mesh->triangle_count; t++) {
        int node[3], other[3];
        sorted_nodes(mesh->triangle[t], node);
        size_t at = hash_nodes(node) & (slots - 1);
        for (; slot[at] >= 0; at = (at + 1) & (slots - 1)) {
            sorted_nodes(mesh->triangle[slot[at]], other);
            if (memcmp(node, other, sizeof node) == 0)
                break;
        }
        if (slot[at] < 0) {
            slot[at] = t;
            continue;
        }
        // A quad that occurs twice is one duplicate face.
        repair->repairs->duplicate_faces += repair->polygon[t] != last;
        last = repair->polygon[t];
        repair->polygon[t] = -1;
    }
    free(slot);
    repair_compact(repair);
}

// --- nodes ---

static void weld_all(Repair *repair)
{
    mesh_find_equal(repair->draft->position, repair->draft->node_count, repair->kept);
}

static void join(Repair *repair, int a, int b)
{
    a = repair_node(repair, a);
    b = repair_node(repair, b);
    repair->kept[a > b ? a : b] = a > b ? b : a;
}

// Welds bit-equal nodes where that closes a gap: on borders, and along edges without length. Closed
// surfaces that touch each other stay separate.
static void weld_borders(Repair *repair)
{
    const TriMesh *mesh = &repair->mesh;
    int nodes = repair->draft->node_count;
    int *equal = malloc(((size_t)nodes + 1) * sizeof *equal);
    int *first = malloc(((size_t)nodes + 1) * sizeof *first);
    bool *inside = calloc((size_t)nodes + 1, sizeof *inside); // used, and on no border
    ASSERT(equal != NULL && first != NULL && inside != NULL);
    mesh_find_equal(repair->draft->position, nodes, equal);

    HalfEdges half;
    half_edge_create(&half, mesh);
    // Mark nodes inside a surface, then unmark both ends of each border edge.
    for (int h = 0; h < half.count; h++)
        inside[half_edge_from(mesh, h)] = true;
    for (int i = 0; i < half.count;) {
        int end = half_edge_group_end(&half, mesh, i), h = half.order[i];
        int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h);
        if (end == i + 1)
            inside[a] = inside[b] = false;
        if (equal[a] == equal[b])
            join(repair, a, b);
        i = end;
    }
    half_edge_destroy(&half);

    // All border nodes at one position become one node.
    memset(first, 0xff, ((size_t)nodes + 1) * sizeof *first);
    for (int i = 0; i < nodes; i++) {
        if (inside[i])
            continue;
        if (first[equal[i]] < 0)
            first[equal[i]] = i;
        else
            join(repair, i, first[equal[i]]);
    }
    free(equal);
    free(first);
    free(inside);
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            mesh->triangle[t][k] = repair_node(repair, mesh->triangle[t][k]);
}

bool repair_faces(Repair *repair)
{
    for (int i = 0; i < repair->draft->node_count; i++)
        repair->kept[i] = i;
    if (!repair->ties_borders)
        weld_all(repair);
    if (!cut_polygons(repair))
        return false;
    drop_degenerate(repair);
    drop_duplicates(repair);
    if (repair->ties_borders) {
        weld_borders(repair);
        drop_degenerate(repair);
        drop_duplicates(repair);
    }
    if (repair->mesh.triangle_count == 0)
        return repair_fail(repair, -1, -1, "the mesh has no face with an area");
    return true;
}
