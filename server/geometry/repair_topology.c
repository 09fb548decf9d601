// SPDX-License-Identifier: MIT
// Which faces belong together: at edges, by their orientation, at nodes. Load time only.
#include "geometry/repair.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

// --- edges ---
// Edges of more than two faces. Where polygons share two edges and were cut along the same
// diagonal, one is cut along the other (`repair_diagonals`). A face without area that merely lies
// along edges of others is removed; any other such edge is refused, because nothing says which of
// its faces belong together.

// The number of faces at the edge of each half-edge: count[group[h]].
typedef struct EdgeFaces {
    int *group; // [half-edge] its first index in `order`
    int *count; // [index in `order`]
} EdgeFaces;

// True if removing the triangle opens no border: at each of its edges it is either the only face or
// one of more than two.
static bool lies_along_others(const EdgeFaces *faces, int triangle)
{
    bool overfull = false;
    for (int k = 0; k < 3; k++) {
        int count = faces->count[faces->group[3 * triangle + k]];
        if (count == 2)
            return false;
        overfull = overfull || count > 2;
    }
    return overfull;
}

static bool is_overfull(const HalfEdges *half, const TriMesh *mesh)
{
    for (int i = 0; i < half->count;) {
        int end = half_edge_group_end(half, mesh, i);
        if (end - i > 2)
            return true;
        i = end;
    }
    return false;
}

// Returns the number of faces at the edge between two nodes.
static int faces_between(const HalfEdges *half, const TriMesh *mesh, int a, int b)
{
    const int small = a < b ? a : b, large = a < b ? b : a;
    int low = 0, high = half->count;
    while (low < high) {
        const int middle = low + (high - low) / 2, h = half->order[middle];
        const int from = half_edge_from(mesh, h), to = half_edge_to(mesh, h);
        const int s = from < to ? from : to, l = from < to ? to : from;
        if (s < small || (s == small && l < large))
            low = middle + 1;
        else
            high = middle;
    }
    if (low == half->count)
        return 0;
    const int h = half->order[low], from = half_edge_from(mesh, h), to = half_edge_to(mesh, h);
    const bool found = (from == a && to == b) || (from == b && to == a);
    return found ? half_edge_group_end(half, mesh, low) - low : 0;
}

static Vec3 normal_of(const TriMesh *mesh, int a, int b, int c)
{
    const Vec3 *x = mesh->position;
    return vec3_cross(vec3_sub(x[b], x[a]), vec3_sub(x[c], x[a]));
}

// True if the other diagonal of the two triangles at half-edges h and g makes two with an area and
// the same side, and is new, and if no other edge of theirs has too many faces: then it is not the
// diagonal that is to blame, but a polygon that is there twice.
static bool may_turn(const HalfEdges *half, const TriMesh *mesh, int h, int g)
{
    const int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h);
    const int c = half_edge_from(mesh, half_edge_previous(h));
    const int d = half_edge_from(mesh, half_edge_previous(g));
    const int outer[4][2] = {{a, c}, {c, b}, {b, d}, {d, a}};
    for (int k = 0; k < 4; k++)
        if (faces_between(half, mesh, outer[k][0], outer[k][1]) > 2)
            return false;
    const Vec3 side = vec3_add(normal_of(mesh, a, b, c), normal_of(mesh, b, a, d));
    return c != d && faces_between(half, mesh, c, d) == 0 &&
           vec3_dot(normal_of(mesh, c, a, d), side) > 0.0 &&
           vec3_dot(normal_of(mesh, d, b, c), side) > 0.0 &&
           mesh_relative_height(mesh->position, (const int[3]){c, a, d}) > MESH_SMALLEST_HEIGHT &&
           mesh_relative_height(mesh->position, (const int[3]){d, b, c}) > MESH_SMALLEST_HEIGHT;
}

// Makes a b c and b a d to c a d and d b c, in the mesh and in what leads to the draft.
static void turn_diagonal(Repair *repair, int h, int g)
{
    int(*const of[2])[3] = {repair->mesh.triangle, repair->corner};
    for (int k = 0; k < 2; k++) {
        int *p = of[k][h / 3], *q = of[k][g / 3];
        const int a = p[h % 3], b = p[(h + 1) % 3], c = p[(h + 2) % 3], d = q[(g + 2) % 3];
        memcpy(p, (const int[3]){c, a, d}, 3 * sizeof *p);
        memcpy(q, (const int[3]){d, b, c}, 3 * sizeof *q);
    }
}

// Finds a diagonal among the half-edges of an edge; the two halves of a diagonal are of one
// polygon. Returns its index in their order, -1: there is none, or its triangles are taken.
static int find_diagonal(const Repair *repair, const HalfEdges *half, int first, int end,
                         const bool *taken)
{
    const TriMesh *mesh = &repair->mesh;
    for (int i = first; i + 1 < end; i++) {
        const int h = half->order[i], g = half->order[i + 1];
        if (repair->polygon[h / 3] == repair->polygon[g / 3] && !taken[h / 3] && !taken[g / 3] &&
            half_edge_from(mesh, h) == half_edge_to(mesh, g) && may_turn(half, mesh, h, g))
            return i;
    }
    return -1;
}

// Turns a diagonal at each edge of too many faces; returns how many were turned.
static int turn_diagonals(Repair *repair)
{
    TriMesh *mesh = &repair->mesh;
    HalfEdges half;
    half_edge_create(&half, mesh);
    bool *taken = calloc((size_t)mesh->triangle_count + 1, sizeof *taken);
    int *turn = malloc(((size_t)half.count + 1) * sizeof *turn), count = 0;
    ASSERT(taken != NULL && turn != NULL);
    // All are found before the first is turned, since the order of half-edges is that of now.
    for (int i = 0; i < half.count;) {
        const int end = half_edge_group_end(&half, mesh, i);
        const int at = end - i > 2 ? find_diagonal(repair, &half, i, end, taken) : -1;
        if (at >= 0) {
            taken[half.order[at] / 3] = taken[half.order[at + 1] / 3] = true;
            turn[count++] = at;
        }
        i = end;
    }
    for (int k = 0; k < count; k++)
        turn_diagonal(repair, half.order[turn[k]], half.order[turn[k] + 1]);
    half_edge_destroy(&half);
    free(taken);
    free(turn);
    return count;
}

void repair_diagonals(Repair *repair)
{
    // A turned one may lie along another: a few rounds, and what is left is refused.
    for (int round = 0; round < 4 && turn_diagonals(repair) > 0; round++)
        continue;
}

static void drop_flat_fins(Repair *repair, const HalfEdges *half)
{
    TriMesh *mesh = &repair->mesh;
    EdgeFaces faces = {.group = malloc(((size_t)half->count + 1) * sizeof(int)),
                       .count = malloc(((size_t)half->count + 1) * sizeof(int))};
    ASSERT(faces.group != NULL && faces.count != NULL);
    // Group the half-edges of each edge and count its faces.
    for (int i = 0; i < half->count;) {
        int end = half_edge_group_end(half, mesh, i);
        faces.count[i] = end - i;
        for (int k = i; k < end; k++)
            faces.group[half->order[k]] = i;
        i = end;
    }
    // Counts fall with each removal, so that two fins at one edge are not both judged by the old
    // count.
    for (int t = 0; t < mesh->triangle_count; t++) {
        if (!lies_along_others(&faces, t) ||
            mesh_relative_height(mesh->position, mesh->triangle[t]) > MESH_SMALLEST_HEIGHT)
            continue;
        for (int k = 0; k < 3; k++)
            faces.count[faces.group[3 * t + k]]--;
        repair->polygon[t] = -1;
        repair->repairs->flat_faces++;
    }
    free(faces.group);
    free(faces.count);
    repair_compact(repair); // drops what was marked
}

static bool check_edges(Repair *repair)
{
    // The first edge with too many faces names three of them.
    TriMesh *mesh = &repair->mesh;
    HalfEdges half;
    half_edge_create(&half, mesh);
    for (int i = 0; i < half.count && !repair->edges_overfull;) {
        int end = half_edge_group_end(&half, mesh, i), h = half.order[i];
        int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h);
        repair->edges_overfull = end - i > 2;
        if (repair->edges_overfull)
            repair_fail(repair, a, half.order[i + 2] / 3,
                        "edge between nodes %d and %d belongs to %d faces, more than two: %d, %d, "
                        "%d%s; MeshLab's Repair non Manifold Edges mends it",
                        a < b ? a : b, a < b ? b : a, end - i, repair->polygon[h / 3],
                        repair->polygon[half.order[i + 1] / 3],
                        repair->polygon[half.order[i + 2] / 3], end - i > 3 ? " ..." : "");
        i = end;
    }
    half_edge_destroy(&half);
    return !repair->edges_overfull;
}

bool repair_edges(Repair *repair)
{
    HalfEdges half;
    half_edge_create(&half, &repair->mesh);
    bool overfull = is_overfull(&half, &repair->mesh);
    if (overfull)
        drop_flat_fins(repair, &half);
    half_edge_destroy(&half);
    return !overfull || check_edges(repair);
}

// --- orientation ---
// Gives each component one orientation: turns faces until neighbours run through their common edge
// in opposite directions, then a closed component outward, an open one as most of its faces were.

// A closed component whose volume is below this fraction of the absolute volumes that it sums up
// has no definite inside: rounding must not decide which side is out.
static const double LEAST_VOLUME = 1e-9;

typedef struct Walk {
    HalfEdges half;
    int *queue;     // triangles of the component, in the order of discovery
    int count;      // of triangles in the queue
    bool *reached;  // [triangle]
    bool *opposite; // [triangle] opposite to the component's first triangle
    bool closed;
} Walk;

// Walks the component of a triangle; false with the fault set if it is one-sided.
static bool walk_component(Repair *repair, Walk *walk, int start)
{
    const TriMesh *mesh = &repair->mesh;
    // Begin with one face and go on across its edges.
    walk->queue[0] = start;
    walk->count = 1;
    walk->closed = true;
    walk->reached[start] = true;
    for (int i = 0; i < walk->count; i++)
        for (int k = 0; k < 3; k++) {
            int h = 3 * walk->queue[i] + k, twin = walk->half.twin[h];
            // An edge without a twin is a border.
            if (twin < 0) {
                walk->closed = false;
                continue;
            }
            int other = twin / 3;
            // Neighbours with one orientation run through the edge in opposite directions.
            bool agrees = half_edge_from(mesh, h) == half_edge_to(mesh, twin);
            bool opposite = walk->opposite[h / 3] != !agrees;
            // A face that is met first takes its side; met again it must agree.
            if (!walk->reached[other]) {
                walk->reached[other] = true;
                walk->opposite[other] = opposite;
                walk->queue[walk->count++] = other;
            } else if (walk->opposite[other] != opposite) {
                return repair_fail(repair, half_edge_from(mesh, h), other,
                                   "surface has one side only, like a Moebius strip: faces %d and "
                                   "%d cannot agree on the edge between nodes %d and %d; MeshLab's "
                                   "Uniform Mesh Resampling makes a new one",
                                   repair->polygon[h / 3], repair->polygon[other],
                                   half_edge_from(mesh, h), half_edge_to(mesh, h));
            }
        }
    return true;
}

static bool most_are_opposite(const Walk *walk)
{
    int opposite = 0;
    for (int i = 0; i < walk->count; i++)
        opposite += walk->opposite[walk->queue[i]];
    return 2 * opposite > walk->count;
}

static bool looks_inward(const Repair *repair, const Walk *walk, double extent)
{
    const TriMesh *mesh = &repair->mesh;
    // Relative to a node of the component and to its extent, so that no digits are lost.
    Vec3 origin = mesh->position[mesh->triangle[walk->queue[0]][0]];
    double sum = 0.0, size = 0.0;
    for (int i = 0; i < walk->count; i++) {
        Vec3 x[3];
        for (int k = 0; k < 3; k++) {
            int node = mesh->triangle[walk->queue[i]][k];
            x[k] = vec3_scale(1.0 / extent, vec3_sub(mesh->position[node], origin));
        }
        // Six volumes of the tetrahedron with the origin, by the orientation that was found.
        double volume = vec3_dot(x[0], vec3_cross(x[1], x[2]));
        sum += walk->opposite[walk->queue[i]] ? -volume : volume;
        size += fabs(volume);
    }
    // A volume of rounding alone decides nothing.
    return fabs(sum) > LEAST_VOLUME * size ? sum < 0.0 : most_are_opposite(walk);
}

static double extent_of(const TriMesh *mesh)
{
    double extent = 0.0;
    Vec3 origin = mesh->position[mesh->triangle[0][0]];
    for (int h = 0; h < 3 * mesh->triangle_count; h++) {
        Vec3 d = vec3_sub(mesh->position[half_edge_from(mesh, h)], origin);
        extent = fmax(extent, fmax(fabs(d.x), fmax(fabs(d.y), fabs(d.z))));
    }
    return extent;
}

static void turn_faces(Repair *repair, const Walk *walk)
{
    TriMesh *mesh = &repair->mesh;
    int last = -1;
    for (int t = 0; t < mesh->triangle_count; t++) {
        if (!walk->opposite[t])
            continue;
        // Swap two corners, in the mesh and in what leads to the draft.
        int *const pair[2] = {mesh->triangle[t], repair->corner[t]};
        for (int k = 0; k < 2; k++) {
            int swap = pair[k][1];
            pair[k][1] = pair[k][2];
            pair[k][2] = swap;
        }
        // Parts of one polygon are counted once.
        repair->repairs->turned_faces += repair->polygon[t] != last;
        last = repair->polygon[t];
    }
}

bool repair_orientation(Repair *repair)
{
    const TriMesh *mesh = &repair->mesh;
    size_t count = (size_t)mesh->triangle_count;
    // All faces unknown at first.
    Walk walk = {.queue = malloc((count + 1) * sizeof *walk.queue),
                 .reached = calloc(count + 1, sizeof *walk.reached),
                 .opposite = calloc(count + 1, sizeof *walk.opposite)};
    ASSERT(walk.queue != NULL && walk.reached != NULL && walk.opposite != NULL);
    half_edge_create(&walk.half, mesh);
    double extent = extent_of(mesh);
    bool ok = true;
    // One component after the other.
    for (int t = 0; ok && t < mesh->triangle_count; t++) {
        if (walk.reached[t])
            continue;
        repair->repairs->components++;
        ok = walk_component(repair, &walk, t);
        // The whole component flips if it faces inward, or if most of its faces disagree with the
        // first.
        bool turn =
            ok && (walk.closed ? looks_inward(repair, &walk, extent) : most_are_opposite(&walk));
        for (int i = 0; turn && i < walk.count; i++)
            walk.opposite[walk.queue[i]] = !walk.opposite[walk.queue[i]];
    }
    // Turn the faces of all components at once.
    if (ok)
        turn_faces(repair, &walk);
    half_edge_destroy(&walk.half);
    free(walk.queue);
    free(walk.reached);
    free(walk.opposite);
    return ok;
}

// --- fans ---
// Splits nodes in which surfaces meet point to point, so that every node has one fan of triangles.
// A fan that has a node of its own in the source gets that node back; any other gets a copy,
// numbered after the nodes of the source.

typedef struct Fans {
    HalfEdges half;
    int *fan;     // [half-edge] the fan around its start
    int *member;  // [half-edge] the next of the same fan
    int *first;   // [fan] a half-edge
    int count;    // number of fans
    int *of_node; // [node] fans found so far
} Fans;

static void add_member(Fans *fans, int h)
{
    fans->fan[h] = fans->count;
    fans->member[h] = fans->first[fans->count];
    fans->first[fans->count] = h;
}

// Collects all half-edges that leave a node within the fan of h.
static void trace_fan(Fans *fans, int h)
{
    // Round the node until the start or a border, then from the start the other way.
    const int *twin = fans->half.twin;
    fans->first[fans->count] = -1;
    add_member(fans, h);
    int at = h;
    while ((at = twin[half_edge_previous(at)]) >= 0 && at != h)
        add_member(fans, at);
    for (int back = h; at != h && twin[back] >= 0;) {
        back = half_edge_next(twin[back]);
        add_member(fans, back);
    }
    fans->count++;
}

// Returns the node of the source for a fan: its own in the draft, unless that is the shared one.
static int own_node(const Repair *repair, const Fans *fans, int fan)
{
    int smallest = repair->draft->node_count;
    for (int h = fans->first[fan]; h >= 0; h = fans->member[h]) {
        int node = repair->draft->corner[repair->corner[h / 3][h % 3]];
        smallest = node < smallest ? node : smallest;
    }
    return smallest;
}

static int add_copy(Repair *repair, int node)
{
    TriMesh *mesh = &repair->mesh;
    int copies = mesh->copy_count++;
    // Grow whenever the number so far is a power of two.
    if ((copies & (copies - 1)) == 0) {
        size_t room = copies == 0 ? 1 : 2 * (size_t)copies;
        mesh->copy_of = realloc(mesh->copy_of, room * sizeof *mesh->copy_of);
        size_t nodes = (size_t)repair->draft->node_count + room;
        mesh->position = realloc(mesh->position, nodes * sizeof *mesh->position);
        ASSERT(mesh->copy_of != NULL && mesh->position != NULL);
    }
    mesh->copy_of[copies] = node;
    mesh->position[mesh->node_count] = mesh->position[node];
    return mesh->node_count++;
}

static void rename_fan(Repair *repair, const Fans *fans, int fan, int node)
{
    for (int h = fans->first[fan]; h >= 0; h = fans->member[h])
        repair->mesh.triangle[h / 3][h % 3] = node;
}

static void split_nodes(Repair *repair, Fans *fans)
{
    int nodes = repair->draft->node_count;
    bool *taken = calloc((size_t)nodes + 1, sizeof *taken); // [draft node]
    bool *stays = calloc((size_t)fans->count + 1, sizeof *stays);
    ASSERT(taken != NULL && stays != NULL);
    // The fan drawn with the node itself keeps it; else the first of its fans.
    for (int pass = 0; pass < 2; pass++)
        for (int fan = 0; fan < fans->count; fan++) {
            int node = half_edge_from(&repair->mesh, fans->first[fan]);
            if (node >= nodes || fans->of_node[node] < 2)
                continue;
            if (!taken[node] && (pass == 1 || own_node(repair, fans, fan) == node))
                taken[node] = stays[fan] = true;
        }
    // All other fans get their own node of the source if it is free, or a copy.
    for (int fan = 0; fan < fans->count; fan++) {
        int node = half_edge_from(&repair->mesh, fans->first[fan]);
        if (node >= nodes || fans->of_node[node] < 2 || stays[fan])
            continue;
        int own = own_node(repair, fans, fan);
        bool is_free = !taken[own] && own != node;
        repair->repairs->split_nodes++;
        if (is_free) {
            taken[own] = true;
            repair->kept[own] = own; // stands for itself again
        }
        rename_fan(repair, fans, fan, is_free ? own : add_copy(repair, node));
    }
    free(taken);
    free(stays);
}

void repair_fans(Repair *repair)
{
    const TriMesh *mesh = &repair->mesh;
    Fans fans = {0};
    half_edge_create(&fans.half, mesh);
    // No half-edge belongs to a fan yet.
    size_t count = (size_t)fans.half.count + 1;
    fans.fan = malloc(count * sizeof *fans.fan);
    fans.member = malloc(count * sizeof *fans.member);
    fans.first = malloc(count * sizeof *fans.first);
    fans.of_node = calloc((size_t)mesh->node_count + 1, sizeof *fans.of_node);
    ASSERT(fans.fan != NULL && fans.member != NULL && fans.first != NULL && fans.of_node != NULL);
    memset(fans.fan, 0xff, count * sizeof *fans.fan);
    // Trace all fans; a node with a second one is shared.
    bool shared = false;
    for (int h = 0; h < fans.half.count; h++) {
        if (fans.fan[h] >= 0)
            continue;
        shared = fans.of_node[half_edge_from(mesh, h)]++ > 0 || shared;
        trace_fan(&fans, h);
    }
    // Fans beyond the first of a node get copies of it.
    if (shared)
        split_nodes(repair, &fans);
    half_edge_destroy(&fans.half);
    free(fans.fan);
    free(fans.member);
    free(fans.first);
    free(fans.of_node);
}
