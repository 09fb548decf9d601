// SPDX-License-Identifier: MIT
// Welds nodes and cuts polygons into triangles; drops degenerate and duplicate faces.
#include "geometry/repair.h"

#include "base/check.h"
#include "geometry/mesh.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// --- one polygon ---
// Ear clipping in the plane of the polygon. An ear is a corner whose triangle contains no other
// corner; cutting it off leaves a polygon with one corner less. The best shaped ear goes first, and
// ears that would leave a corner almost on their own long edge go last: the remaining sliver would
// dictate the time step. The quality of every corner is stored and only the two beside a cut are
// updated, so that the work is quadratic in the corners.

// Smallest allowed distance of another corner from an ear, as a fraction of the ear.
static const double COMFORT = 1e-2;

enum { EAR_NONE, EAR_TIGHT, EAR_GOOD };

typedef struct Point {
    double x, y;
} Point;

typedef struct Ears {
    int count;
    Vec3 corner[POLYGON_CORNERS]; // relative to the first, divided by the extent
    Point point[POLYGON_CORNERS]; // in the plane, turning counter-clockwise
    int key[POLYGON_CORNERS];
    int next[POLYGON_CORNERS], previous[POLYGON_CORNERS];
    int standing[POLYGON_CORNERS];
    double quality[POLYGON_CORNERS]; // relative height of the ear
} Ears;

static double component(Vec3 v, int axis)
{
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

// Returns twice the area vector of the polygon (Newell).
static Vec3 area_vector(const Vec3 *x, int count)
{
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int i = 1; i + 1 < count; i++)
        sum = vec3_add(sum, vec3_cross(vec3_sub(x[i], x[0]), vec3_sub(x[i + 1], x[0])));
    return sum;
}

// Drops the coordinate in which the polygon is thinnest; containment and convexity are invariant
// under such a projection.
static Point project(Vec3 x, Vec3 normal)
{
    Vec3 size = {fabs(normal.x), fabs(normal.y), fabs(normal.z)};
    int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    double u = component(x, (axis + 1) % 3), v = component(x, (axis + 2) % 3);
    return component(normal, axis) > 0.0 ? (Point){u, v} : (Point){v, u};
}

// Returns twice the signed area of a triangle in the plane.
static double turn(Point a, Point b, Point c)
{
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// True if p lies in the triangle, widened by the fraction `margin` of its area over each edge.
static bool holds(Point a, Point b, Point c, double margin, Point p)
{
    double least = -margin * turn(a, b, c);
    return turn(a, b, p) >= least && turn(b, c, p) >= least && turn(c, a, p) >= least;
}

static void judge(Ears *ears, int i)
{
    int a = ears->previous[i], c = ears->next[i];
    const int corner[3] = {a, i, c};
    Point x = ears->point[a], y = ears->point[i], z = ears->point[c];
    // Reflex and flat corners are no ears.
    ears->standing[i] = EAR_NONE;
    ears->quality[i] = mesh_relative_height(ears->corner, corner);
    if (!(turn(x, y, z) > 0.0) || !(ears->quality[i] > MESH_SMALLEST_HEIGHT))
        return;
    // Any other corner within the ear or near it speaks against it.
    ears->standing[i] = EAR_GOOD;
    for (int k = ears->next[c]; k != a; k = ears->next[k]) {
        int key = ears->key[k];
        if (key == ears->key[a] || key == ears->key[i] || key == ears->key[c] ||
            !holds(x, y, z, COMFORT, ears->point[k]))
            continue;
        ears->standing[i] = EAR_TIGHT;
        // Within: cutting here would cross the outline.
        if (holds(x, y, z, 0.0, ears->point[k])) {
            ears->standing[i] = EAR_NONE;
            return;
        }
    }
}

// Returns the best of the remaining ears, or -1.
static int find_ear(const Ears *ears, int first)
{
    int best = -1, i = first;
    do {
        if (ears->standing[i] != EAR_NONE &&
            (best < 0 || ears->standing[i] > ears->standing[best] ||
             (ears->standing[i] == ears->standing[best] && ears->quality[i] > ears->quality[best])))
            best = i;
        i = ears->next[i];
    } while (i != first);
    return best;
}

// True if only a line remains: then every corner counts as an ear.
static bool is_flat(const Ears *ears, int first)
{
    for (int i = ears->next[first]; ears->next[i] != first; i = ears->next[i]) {
        const int corner[3] = {first, i, ears->next[i]};
        if (mesh_relative_height(ears->corner, corner) > MESH_SMALLEST_HEIGHT)
            return false;
    }
    return true;
}

static bool clip(Ears *ears, int (*triangle)[3])
{
    // Judge all corners once; each cut then changes two of them.
    for (int i = 0; i < ears->count; i++)
        judge(ears, i);
    int first = 0;
    for (int t = 0; t < ears->count - 2; t++) {
        int ear = find_ear(ears, first);
        // Without an ear only flat remainders may be cut, in any way.
        if (ear < 0) {
            if (!is_flat(ears, first))
                return false;
            ear = ears->next[first];
        }
        // Cut the ear off.
        int a = ears->previous[ear], c = ears->next[ear];
        triangle[t][0] = a;
        triangle[t][1] = ear;
        triangle[t][2] = c;
        ears->next[a] = c;
        ears->previous[c] = a;
        // Search from the lowest neighbour, so that the result depends on the outline alone.
        first = a < c ? a : c;
        judge(ears, a);
        judge(ears, c);
    }
    return true;
}

// Chooses where the list of corners begins and its direction, so that equal polygons are cut alike:
// at the smallest key, towards its smaller neighbour. Returns the step, +1 or -1.
static int canonical_order(const int *key, int count, int *first)
{
    *first = 0;
    for (int i = 1; i < count; i++)
        if (key[i] < key[*first])
            *first = i;
    return key[(*first + 1) % count] <= key[(*first + count - 1) % count] ? 1 : -1;
}

// Makes triangles from one corner to all edges, if that is a valid way to cut the polygon.
static bool fan(const Vec3 *x, int count, int first, int (*triangle)[3])
{
    Vec3 normal = area_vector(x, count);
    for (int i = 1; i + 1 < count; i++) {
        const int corner[3] = {first, (first + i) % count, (first + i + 1) % count};
        if (turn(project(x[corner[0]], normal), project(x[corner[1]], normal),
                 project(x[corner[2]], normal)) < 0.0)
            return false;
        memcpy(triangle[i - 1], corner, sizeof corner);
    }
    return true;
}

bool polygon_triangulate(const Vec3 *corner, const int *key, int count, int (*triangle)[3])
{
    int first, step = canonical_order(key, count, &first);
    // Too large for the search of ears: it must be convex.
    if (count > POLYGON_CORNERS)
        return fan(corner, count, first, triangle);
    static _Thread_local Ears ears; // too large for every stack
    // Scale by the extent: the thresholds are relative.
    double extent = 0.0;
    for (int i = 0; i < count; i++) {
        Vec3 d = vec3_sub(corner[i], corner[first]);
        extent = fmax(extent, fmax(fabs(d.x), fmax(fabs(d.y), fabs(d.z))));
    }
    // A ring of corners, in an order that does not depend on where the caller's list begins.
    ears.count = count;
    for (int i = 0; i < count; i++) {
        int from = (first + step * i + count) % count;
        ears.corner[i] = vec3_scale(1.0 / extent, vec3_sub(corner[from], corner[first]));
        ears.key[i] = key[from];
        ears.next[i] = (i + 1) % count;
        ears.previous[i] = (i + count - 1) % count;
    }
    // Project them to the plane of the polygon.
    Vec3 normal = area_vector(ears.corner, count);
    for (int i = 0; i < count; i++)
        ears.point[i] = project(ears.corner[i], normal);
    if (!clip(&ears, triangle))
        return false;
    // Return to the caller's order of corners.
    for (int t = 0; t < count - 2; t++) {
        for (int k = 0; k < 3; k++)
            triangle[t][k] = (first + step * triangle[t][k] + count) % count;
        if (step < 0) {
            int swap = triangle[t][1];
            triangle[t][1] = triangle[t][2];
            triangle[t][2] = swap;
        }
    }
    return true;
}

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
    // Corners of one node in succession count once, also across the end of the list.
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
    // What has no three different nodes is dropped.
    if (outline->count < 3) {
        repair->repairs->degenerate_faces++;
        return true;
    }
    // Triangles are taken as they are.
    repair->repairs->polygons += outline->count > 3;
    if (outline->count == 3) {
        add_triangle(repair, polygon, outline, (const int[3]){0, 1, 2});
        return true;
    }
    // A polygon that cannot be cut names itself.
    if (!polygon_triangulate(outline->position, outline->node, outline->count, outline->triangle)) {
        repair->fault->triangle = polygon;
        snprintf(repair->fault->text, sizeof repair->fault->text,
                 outline->count > POLYGON_CORNERS
                     ? "face %d has %d corners and is not convex, more than can be cut up; export "
                       "triangles"
                     : "face %d has %d corners and crosses itself; export triangles",
                 polygon, outline->count);
        return false;
    }
    for (int t = 0; t < outline->count - 2; t++)
        add_triangle(repair, polygon, outline, outline->triangle[t]);
    return true;
}

static bool cut_polygons(Repair *repair)
{
    // Room for the longest polygon, used for all.
    size_t longest = (size_t)longest_outline(repair->draft);
    Outline outline = {
        .corner = malloc(longest * sizeof *outline.corner),
        .node = malloc(longest * sizeof *outline.node),
        .position = malloc(longest * sizeof *outline.position),
        .triangle = malloc(longest * sizeof *outline.triangle),
    };
    ASSERT(outline.corner != NULL && outline.node != NULL && outline.position != NULL &&
           outline.triangle != NULL);
    // The first polygon that cannot be cut ends the repair.
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
        // All triangles of one polygon; it is degenerate if none is left.
        int polygon = repair->polygon[t], left = 0;
        for (; t < mesh->triangle_count && repair->polygon[t] == polygon; t++) {
            if (repeats_a_node(mesh->triangle[t]))
                mesh->triangle[t][0] = -1;
            else
                left++;
        }
        repair->repairs->degenerate_faces += left == 0;
    }
    // The rest of a polygon stays.
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
        // Look for an earlier triangle of the same nodes.
        int node[3], other[3];
        sorted_nodes(mesh->triangle[t], node);
        size_t at = hash_nodes(node) & (slots - 1);
        for (; slot[at] >= 0; at = (at + 1) & (slots - 1)) {
            sorted_nodes(mesh->triangle[slot[at]], other);
            if (memcmp(node, other, sizeof node) == 0)
                break;
        }
        // New: later ones find it here.
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

// Welds bit-equal nodes where that closes a gap: on borders, and along edges without length. Closed
// surfaces that touch each other stay separate.
static void weld_borders(Repair *repair)
{
    // Which nodes lie at one position, and which are inside of a surface.
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
        // An edge of a single face is a border.
        if (end == i + 1)
            inside[a] = inside[b] = false;
        // An edge without length is a single node.
        if (equal[a] == equal[b])
            repair_join(repair, a, b);
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
            repair_join(repair, i, first[equal[i]]);
    }
    free(equal);
    free(first);
    free(inside);
    // Triangles take the nodes that remain.
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            mesh->triangle[t][k] = repair_node(repair, mesh->triangle[t][k]);
}

bool repair_faces(Repair *repair)
{
    // Every node stands for itself until it is welded.
    for (int i = 0; i < repair->draft->node_count; i++)
        repair->kept[i] = i;
    // Welding all equal nodes comes first, welding of borders alone must know the faces.
    if (!repair->ties_borders)
        weld_all(repair);
    if (!cut_polygons(repair))
        return false;
    drop_degenerate(repair);
    if (repair->repairs->polygons > 0)
        repair_diagonals(repair);
    drop_duplicates(repair);
    // Welded borders may collapse faces or make them equal.
    if (repair->ties_borders) {
        weld_borders(repair);
        drop_degenerate(repair);
        drop_duplicates(repair);
    }
    if (repair->mesh.triangle_count == 0)
        return repair_fail(repair, -1, -1, "the mesh has no face with an area");
    return true;
}
