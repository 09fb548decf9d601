// SPDX-License-Identifier: MIT
// Joins borders that are one but for rounding: the seam of a surface of revolution whose last
// meridian was computed again, patches that were rounded one by one. Never nodes by their distance
// alone, which would fold thin parts: two border edges are joined if each is the only one that runs
// beside the other, end by end, if their faces do not lie on each other, and if no edge gets a
// third face. Takes O(n log n) for any mesh.
#include "geometry/repair.h"

#include "base/check.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum {
    NEAR_MOST = 8, // nodes near a node that are looked at; with more it is left alone
    CROWD = 128,   // of one cell of the search
    ROUNDS = 8,    // tries to join without a third face at an edge
};

// Ends of edges that are rounded twice differ by less: 1e-6 of the extent, or two roundings of
// three coordinates in single precision, sqrt(3) 2^-23 of the largest; both with something to
// spare.
static const double ROUNDING = 1.5e-6, SINGLE = 2.5e-7;
// Nodes farther apart than this share of the shortest edge at either are different nodes. Border
// edges that are as near to each other, and within LOOSE of the extent, are counted and reported.
static const double SHARE = 0.25, LOOSE = 1e-2;
// Cosine of the least angle between faces that are joined, 5 degrees.
static const double FOLD = 0.996;

typedef struct Place {
    uint64_t cell;
    int node;
} Place;

typedef struct Seams {
    const Repair *repair;
    const TriMesh *mesh;
    int *edge; // [edge_count] half-edges with a single face, by (smaller node, larger node)
    int edge_count;
    int *node; // [node_count] their ends
    int node_count;
    double *reach; // [mesh node] how far the node may be moved; 0: on no border
    double cell;   // [units of the file] side of the cells of the search
    Vec3 low;
    Place *place;           // [node_count] sorted
    int (*near)[NEAR_MOST]; // [mesh node] nodes within reach, itself among them
    int *near_count;        // [mesh node]
    int *partner;           // [edge_count] the edge that it is joined to, or -1
    bool *barred;           // [mesh node] joining it would make an edge of three faces
} Seams;

static double apart(const Seams *seams, int a, int b)
{
    return vec3_length(vec3_sub(seams->mesh->position[a], seams->mesh->position[b]));
}

// --- borders ---

static void find_borders(Seams *seams)
{
    const TriMesh *mesh = seams->mesh;
    HalfEdges half;
    half_edge_create(&half, mesh);
    seams->edge = malloc(((size_t)half.count + 1) * sizeof *seams->edge);
    seams->node = malloc((2 * (size_t)half.count + 1) * sizeof *seams->node);
    ASSERT(seams->edge != NULL && seams->node != NULL);
    for (int i = 0; i < half.count;) {
        const int end = half_edge_group_end(&half, mesh, i);
        if (end == i + 1)
            seams->edge[seams->edge_count++] = half.order[i];
        i = end;
    }
    half_edge_destroy(&half);
}

// Sets how far each end of a border edge may be moved.
static void find_reach(Seams *seams, double tolerance)
{
    const TriMesh *mesh = seams->mesh;
    double most = 0.0;
    memset(seams->reach, 0, ((size_t)mesh->node_count + 1) * sizeof *seams->reach);
    seams->node_count = 0;
    for (int i = 0; i < 2 * seams->edge_count; i++) {
        const int h = seams->edge[i / 2];
        const int node = i % 2 == 0 ? half_edge_from(mesh, h) : half_edge_to(mesh, h);
        if (seams->reach[node] == 0.0)
            seams->node[seams->node_count++] = node;
        seams->reach[node] = tolerance;
    }
    // No farther than a share of its shortest edge.
    for (int h = 0; h < 3 * mesh->triangle_count; h++) {
        const int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h);
        const double share = SHARE * apart(seams, a, b);
        seams->reach[a] = fmin(seams->reach[a], share);
        seams->reach[b] = fmin(seams->reach[b], share);
    }
    for (int i = 0; i < seams->node_count; i++)
        most = fmax(most, seams->reach[seams->node[i]]);
    seams->cell = 2.0 * most;
}

// --- nodes that are near ---

static uint64_t cell_of(const Seams *seams, Vec3 x)
{
    const Vec3 d = vec3_scale(1.0 / seams->cell, vec3_sub(x, seams->low));
    const double at[3] = {floor(d.x), floor(d.y), floor(d.z)};
    uint64_t hash = 0;
    for (int k = 0; k < 3; k++) {
        // Cells beyond 2^62 are taken as one, whose crowd is left alone.
        const double most = 0x1p62;
        hash = (hash ^ (uint64_t)(int64_t)fmax(-most, fmin(most, at[k]))) *
               UINT64_C(0x9e3779b97f4a7c15);
        hash ^= hash >> 29;
    }
    return hash;
}

static int compare_places(const void *a, const void *b)
{
    const Place *p = a, *q = b;
    if (p->cell != q->cell)
        return p->cell < q->cell ? -1 : 1;
    return (p->node > q->node) - (p->node < q->node);
}

static int first_place(const Seams *seams, uint64_t cell)
{
    int low = 0, high = seams->node_count;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (seams->place[middle].cell < cell)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

// Finds the cells around a node, of which a corner of the box within its reach is in each.
static int find_cells(const Seams *seams, int node, uint64_t cell[8])
{
    const double reach = seams->reach[node] * (1.0 + 1e-9); // nodes at its very end, rounded
    int count = 0;
    for (int k = 0; k < 8; k++) {
        const Vec3 corner = {k & 1 ? reach : -reach, k & 2 ? reach : -reach,
                             k & 4 ? reach : -reach};
        const uint64_t next = cell_of(seams, vec3_add(seams->mesh->position[node], corner));
        int same = 0;
        while (same < count && cell[same] != next)
            same++;
        cell[same] = next;
        count += same == count;
    }
    return count;
}

// Lists the nodes near one; none where it is crowded, so that hostile meshes take no longer.
static void find_near(Seams *seams, int node)
{
    uint64_t cells[8];
    const int cell_count = find_cells(seams, node, cells);
    int count = 0;
    seams->near_count[node] = 0;
    for (int k = 0; k < cell_count; k++) {
        const uint64_t cell = cells[k];
        const int first = first_place(seams, cell);
        for (int i = first; i < seams->node_count && seams->place[i].cell == cell; i++) {
            const int other = seams->place[i].node;
            if (i == first + CROWD)
                return;
            if (apart(seams, node, other) > fmin(seams->reach[node], seams->reach[other]))
                continue;
            if (count == NEAR_MOST)
                return;
            seams->near[node][count++] = other;
        }
    }
    seams->near_count[node] = count;
}

static void find_all_near(Seams *seams, double tolerance)
{
    find_reach(seams, tolerance);
    for (int i = 0; i < seams->node_count; i++) {
        const int node = seams->node[i];
        seams->place[i] = (Place){cell_of(seams, seams->mesh->position[node]), node};
    }
    if (!(seams->cell > 0.0))
        return;
    qsort(seams->place, (size_t)seams->node_count, sizeof *seams->place, compare_places);
    for (int i = 0; i < seams->node_count; i++)
        find_near(seams, seams->node[i]);
}

// --- edges that run beside each other ---

// Returns the border edge between two nodes, or -1.
static int find_edge(const Seams *seams, int a, int b)
{
    const int small = a < b ? a : b, large = a < b ? b : a;
    int low = 0, high = seams->edge_count;
    while (low < high) {
        const int middle = low + (high - low) / 2, h = seams->edge[middle];
        const int from = half_edge_from(seams->mesh, h), to = half_edge_to(seams->mesh, h);
        const int s = from < to ? from : to, l = from < to ? to : from;
        if (s == small && l == large)
            return middle;
        if (s < small || (s == small && l < large))
            low = middle + 1;
        else
            high = middle;
    }
    return -1;
}

// Returns the direction from an edge into its face, of length 1.
static Vec3 inward(const TriMesh *mesh, int h)
{
    const Vec3 a = mesh->position[half_edge_from(mesh, h)];
    const Vec3 e = vec3_sub(mesh->position[half_edge_to(mesh, h)], a);
    const Vec3 w = vec3_sub(mesh->position[half_edge_from(mesh, half_edge_previous(h))], a);
    const Vec3 in = vec3_sub(w, vec3_scale(vec3_dot(w, e) / vec3_dot(e, e), e));
    return vec3_scale(1.0 / vec3_length(in), in);
}

// True if the faces of two edges lie on each other, or one has no area.
static bool folds(const Seams *seams, int i, int j)
{
    const Vec3 a = inward(seams->mesh, seams->edge[i]), b = inward(seams->mesh, seams->edge[j]);
    return !(vec3_dot(a, b) < FOLD);
}

// Sets the only border edge that runs beside edge i, or -1.
static void find_partner(Seams *seams, int i)
{
    const int h = seams->edge[i];
    const int a = half_edge_from(seams->mesh, h), b = half_edge_to(seams->mesh, h);
    int found = -1;
    seams->partner[i] = -1;
    for (int k = 0; k < seams->near_count[a]; k++)
        for (int l = 0; l < seams->near_count[b]; l++) {
            const int j = find_edge(seams, seams->near[a][k], seams->near[b][l]);
            if (j < 0 || j == i || j == found)
                continue;
            if (found >= 0)
                return;
            found = j;
        }
    if (found >= 0 && seams->edge[found] / 3 != h / 3 && !folds(seams, i, found))
        seams->partner[i] = found;
}

// Returns the other edge, or -1: only if each is the other's partner and neither end is barred.
static int partner_of(const Seams *seams, int i)
{
    const int j = seams->partner[i];
    if (j < 0 || seams->partner[j] != i)
        return -1;
    for (int k = 0; k < 4; k++) {
        const int h = seams->edge[k < 2 ? i : j];
        if (seams->barred[k % 2 == 0 ? half_edge_from(seams->mesh, h)
                                     : half_edge_to(seams->mesh, h)])
            return -1;
    }
    return j;
}

static void find_partners(Seams *seams, double tolerance)
{
    find_all_near(seams, tolerance);
    for (int i = 0; i < seams->edge_count; i++)
        find_partner(seams, i);
}

// Two border edges that run beside each other: nodes a and c, b and d are near.
typedef struct Pair {
    int a, b, c, d;
    double apart;
} Pair;

static Pair pair_of(const Seams *seams, int i, int j)
{
    const int h = seams->edge[i], g = seams->edge[j];
    const int a = half_edge_from(seams->mesh, h), b = half_edge_to(seams->mesh, h);
    const int c = half_edge_from(seams->mesh, g), d = half_edge_to(seams->mesh, g);
    const double along = fmax(apart(seams, a, c), apart(seams, b, d));
    const double against = fmax(apart(seams, a, d), apart(seams, b, c));
    return along < against ? (Pair){a, b, c, d, along} : (Pair){a, b, d, c, against};
}

// Counts the edges that have a partner and their largest distance; joins them in `repair`, if any.
static void visit_partners(const Seams *seams, Repair *repair, int *count, double *most)
{
    *count = 0;
    *most = 0.0;
    for (int i = 0; i < seams->edge_count; i++) {
        const int j = partner_of(seams, i);
        if (j < i)
            continue;
        const Pair pair = pair_of(seams, i, j);
        *count += 2;
        *most = fmax(*most, pair.apart);
        if (repair == NULL)
            continue;
        repair_join(repair, pair.a, pair.c);
        repair_join(repair, pair.b, pair.d);
    }
}

// --- joining ---

static void rename_corners(const Repair *repair, TriMesh *mesh)
{
    for (int h = 0; h < 3 * mesh->triangle_count; h++)
        mesh->triangle[h / 3][h % 3] = repair_node(repair, mesh->triangle[h / 3][h % 3]);
}

// Bars what was joined at edges that now have more than two faces; false if there are none.
static bool bar_overfull(Seams *seams, const TriMesh *joined)
{
    HalfEdges half;
    bool *bad = calloc((size_t)joined->node_count + 1, sizeof *bad), found = false;
    ASSERT(bad != NULL);
    half_edge_create(&half, joined);
    for (int i = 0; i < half.count;) {
        const int end = half_edge_group_end(&half, joined, i), h = half.order[i];
        if (end - i > 2)
            bad[half_edge_from(joined, h)] = bad[half_edge_to(joined, h)] = true;
        i = end;
    }
    half_edge_destroy(&half);
    for (int i = 0; i < seams->node_count; i++) {
        const int node = seams->node[i], kept = repair_node(seams->repair, node);
        // An edge of nodes that stay as they are had its faces before.
        found = found || (bad[kept] && !seams->barred[node]);
        seams->barred[node] = seams->barred[node] || bad[kept];
    }
    free(bad);
    return found;
}

// Joins all partners but those that would make an edge of three faces.
static void join_all(Seams *seams, Repair *repair)
{
    const size_t nodes = (size_t)repair->draft->node_count + 1;
    const size_t triangles = (size_t)repair->mesh.triangle_count + 1;
    int *kept = malloc(nodes * sizeof *kept);
    TriMesh joined = repair->mesh;
    joined.triangle = malloc(triangles * sizeof *joined.triangle);
    ASSERT(kept != NULL && joined.triangle != NULL);
    memcpy(kept, repair->kept, (nodes - 1) * sizeof *kept);
    bool done = false;
    for (int round = 0; round < ROUNDS && !done; round++) {
        memcpy(repair->kept, kept, (nodes - 1) * sizeof *kept);
        memcpy(joined.triangle, repair->mesh.triangle, (triangles - 1) * sizeof *joined.triangle);
        visit_partners(seams, repair, &repair->repairs->joined_edges,
                       &repair->repairs->joined_apart);
        rename_corners(repair, &joined);
        done = !bar_overfull(seams, &joined);
    }
    // None of them, where that finds no end.
    if (!done) {
        memcpy(repair->kept, kept, (nodes - 1) * sizeof *kept);
        repair->repairs->joined_edges = 0;
    }
    rename_corners(repair, &repair->mesh);
    free(kept);
    free(joined.triangle);
}

// --- all of it ---

static void seams_create(Seams *seams, const Repair *repair)
{
    const size_t nodes = (size_t)repair->mesh.node_count + 1;
    *seams = (Seams){.repair = repair, .mesh = &repair->mesh};
    find_borders(seams);
    const size_t edges = (size_t)seams->edge_count + 1;
    seams->reach = malloc(nodes * sizeof *seams->reach);
    seams->place = malloc(2 * edges * sizeof *seams->place);
    seams->near = malloc(nodes * sizeof *seams->near);
    seams->near_count = calloc(nodes, sizeof *seams->near_count);
    seams->partner = malloc(edges * sizeof *seams->partner);
    seams->barred = calloc(nodes, sizeof *seams->barred);
    ASSERT(seams->reach != NULL && seams->place != NULL && seams->near != NULL &&
           seams->near_count != NULL && seams->partner != NULL && seams->barred != NULL);
}

static void seams_destroy(Seams *seams)
{
    free(seams->edge);
    free(seams->node);
    free(seams->reach);
    free(seams->place);
    free(seams->near);
    free(seams->near_count);
    free(seams->partner);
    free(seams->barred);
}

// Returns the extent of the nodes in use, and what two roundings make of their positions.
static double extent_of(Seams *seams, double *rounding)
{
    const TriMesh *mesh = seams->mesh;
    Box box = box_empty();
    double size = 0.0;
    for (int h = 0; h < 3 * mesh->triangle_count; h++) {
        const Vec3 x = mesh->position[half_edge_from(mesh, h)];
        box_add(&box, x);
        size = fmax(size, fmax(fabs(x.x), fmax(fabs(x.y), fabs(x.z))));
    }
    seams->low = box_low(&box);
    const Vec3 side = box_size(&box);
    const double extent = fmax(side.x, fmax(side.y, side.z));
    *rounding = fmax(ROUNDING * extent, SINGLE * size);
    return extent;
}

void repair_seams(Repair *repair)
{
    // First what is joined, then what is left open, but nearly closed.
    for (int pass = 0; pass < 2; pass++) {
        Seams seams;
        double rounding;
        seams_create(&seams, repair);
        const double extent = extent_of(&seams, &rounding);
        const double weld = repair->draft->weld > 0.0 ? repair->draft->weld : rounding;
        const double tolerance = pass == 0 ? weld : LOOSE * extent;
        if (seams.edge_count > 0 && tolerance > 0.0) {
            find_partners(&seams, tolerance);
            if (pass == 0)
                join_all(&seams, repair);
            else
                visit_partners(&seams, NULL, &repair->repairs->near_edges,
                               &repair->repairs->near_apart);
        }
        seams_destroy(&seams);
    }
}
