// SPDX-License-Identifier: MIT
#include "geometry/even.h"

#include "base/check.h"
#include "geometry/edges.h"

#include <stdint.h>
#include <stdlib.h>

// --- hull ---
// Incremental hull in shuffled order. Each point not yet inserted waits at one face that it sees,
// so that finding the first visible face is free; O(n log n) expected.

// A point sees a face from more than this height above it: far above the rounding error for points
// of size 1, far below the heights of 20000 even points on a sphere (about 1e-6).
static const double VISIBLE = 1e-13;

typedef struct Face {
    int corner[3];
    int neighbor[3]; // across the edge from corner k to corner k + 1
    int waiting;     // first of the points that wait at this face, or -1
    int stamp;       // number of the insertion that removed it
} Face;

// An edge of the rim between visible and hidden faces.
typedef struct RimEdge {
    int from, to;
    int outside; // the face that remains
} RimEdge;

typedef struct Hull {
    const Vec3 *point;
    Face *face;   // [2 count - 4] slots
    int *next;    // [count] next point that waits at the same face, or -1
    int *wait;    // [count] the face where a point waits; -1 for corners of the hull
    int *fan;     // [count] the new face that starts at a rim node
    int *seen;    // [2 count - 4] faces that the new point sees
    RimEdge *rim; // [2 count]
    int face_count;
    int seen_count, rim_count;
} Hull;

// Returns six volumes of the face's tetrahedron with the point: positive above the face.
static double height_above(const Hull *hull, int face, int point)
{
    const int *corner = hull->face[face].corner;
    Vec3 a = hull->point[corner[0]];
    Vec3 u = vec3_sub(hull->point[corner[1]], a), v = vec3_sub(hull->point[corner[2]], a);
    return vec3_dot(vec3_cross(u, v), vec3_sub(hull->point[point], a));
}

// Makes a point wait at the one of some faces above which it is highest.
static void wait_at_best(Hull *hull, int point, const int *face, int count)
{
    // The highest face sees the point best.
    int best = face[0];
    double height = height_above(hull, best, point);
    for (int i = 1; i < count; i++) {
        double other = height_above(hull, face[i], point);
        if (other > height) {
            height = other;
            best = face[i];
        }
    }
    // The point joins the list of those that wait there.
    hull->wait[point] = best;
    hull->next[point] = hull->face[best].waiting;
    hull->face[best].waiting = point;
}

// Picks four points far from one plane: the longest distance, then the widest triangle, then the
// highest apex.
static void pick_first(const Vec3 *point, int count, int first[4])
{
    for (int i = 0; i < 4; i++)
        first[i] = 0;
    // The farthest point, then the one farthest from their line, then from their plane.
    for (int stage = 1; stage < 4; stage++) {
        double best = -1.0;
        for (int i = 0; i < count; i++) {
            Vec3 x = vec3_sub(point[i], point[first[0]]);
            Vec3 u = vec3_sub(point[first[1]], point[first[0]]);
            Vec3 v = vec3_sub(point[first[2]], point[first[0]]);
            double size = stage == 1   ? vec3_length(x)
                          : stage == 2 ? vec3_length(vec3_cross(u, x))
                                       : fabs(vec3_dot(vec3_cross(u, v), x));
            if (size > best) {
                best = size;
                first[stage] = i;
            }
        }
    }
}

// Starts with the tetrahedron of the first four points, outward.
static void start_tetrahedron(Hull *hull, const int first[4])
{
    static const int corners[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
    static const int neighbors[4][3] = {{1, 2, 3}, {3, 2, 0}, {1, 3, 0}, {2, 1, 0}};
    for (int f = 0; f < 4; f++) {
        hull->face[f] = (Face){.waiting = -1, .stamp = -1};
        for (int k = 0; k < 3; k++) {
            hull->face[f].corner[k] = first[corners[f][k]];
            hull->face[f].neighbor[k] = neighbors[f][k];
        }
    }
    hull->face_count = 4;
}

// Finds the faces that the point sees, connected to the one where it waits, and their rim.
static void find_visible(Hull *hull, int point)
{
    // Flood fill over the visible faces, from the one where the point waits.
    hull->seen_count = hull->rim_count = 0;
    hull->seen[hull->seen_count++] = hull->wait[point];
    hull->face[hull->wait[point]].stamp = point;
    for (int i = 0; i < hull->seen_count; i++) {
        const Face *face = &hull->face[hull->seen[i]];
        for (int k = 0; k < 3; k++) {
            int other = face->neighbor[k];
            if (hull->face[other].stamp == point)
                continue;
            if (height_above(hull, other, point) > VISIBLE) {
                hull->face[other].stamp = point;
                hull->seen[hull->seen_count++] = other;
            }
        }
    }
    // The rim: edges between a visible and a hidden face.
    for (int i = 0; i < hull->seen_count; i++) {
        const Face *face = &hull->face[hull->seen[i]];
        for (int k = 0; k < 3; k++)
            if (hull->face[face->neighbor[k]].stamp != point)
                hull->rim[hull->rim_count++] =
                    (RimEdge){face->corner[k], face->corner[(k + 1) % 3], face->neighbor[k]};
    }
}

// Replaces the visible faces by a fan from the rim to the point. False if an inserted point would
// be buried, which means that the points are not in convex position.
static bool insert_point(Hull *hull, int point)
{
    // Rounding may let a point wait where it sees nothing (four coplanar points): search all faces.
    for (int f = 0; f < hull->face_count && height_above(hull, hull->wait[point], point) <= VISIBLE;
         f++)
        hull->wait[point] = f;
    if (height_above(hull, hull->wait[point], point) <= VISIBLE)
        return false;
    // The rim of what the point sees becomes the base of a fan of faces.
    find_visible(hull, point);
    if (hull->rim_count != hull->seen_count + 2)
        return false;
    // Collect the points that wait at removed faces in one list.
    int orphans = -1;
    for (int i = 0; i < hull->seen_count; i++) {
        int at = hull->face[hull->seen[i]].waiting;
        while (at >= 0) {
            int after = hull->next[at];
            if (at != point) {
                hull->next[at] = orphans;
                orphans = at;
            }
            at = after;
        }
    }
    hull->wait[point] = -1;

    // The fan has two more faces than were removed: reuse their slots and add two.
    hull->seen[hull->seen_count] = hull->face_count;
    hull->seen[hull->seen_count + 1] = hull->face_count + 1;
    hull->face_count += 2;
    // Each edge of the rim and the point make one face.
    for (int i = 0; i < hull->rim_count; i++) {
        const RimEdge *rim = &hull->rim[i];
        int f = hull->seen[i];
        hull->face[f] = (Face){.corner = {rim->from, rim->to, point},
                               .neighbor = {rim->outside, -1, -1},
                               .waiting = -1,
                               .stamp = -1};
        hull->fan[rim->from] = f;
        Face *outside = &hull->face[rim->outside];
        for (int k = 0; k < 3; k++)
            if (outside->corner[k] == rim->to)
                outside->neighbor[k] = f;
    }
    // Connect the faces of the fan to each other.
    for (int i = 0; i < hull->rim_count; i++) {
        int f = hull->seen[i], g = hull->fan[hull->rim[i].to];
        hull->face[f].neighbor[1] = g;
        hull->face[g].neighbor[2] = f;
    }
    // The orphans wait at one of the new faces.
    while (orphans >= 0) {
        int after = hull->next[orphans];
        wait_at_best(hull, orphans, hull->seen, hull->rim_count);
        orphans = after;
    }
    return true;
}

// Shuffles into the same pseudo-random order on every machine.
static void shuffle(int *order, int count)
{
    uint64_t state = 1;
    for (int i = 0; i < count; i++)
        order[i] = i;
    for (int i = count - 1; i > 0; i--) {
        state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        int other = (int)((state >> 33) % (uint64_t)(i + 1));
        int swap = order[i];
        order[i] = order[other];
        order[other] = swap;
    }
}

bool hull_triangulate(const Vec3 *point, int count, int (*triangle)[3])
{
    size_t n = (size_t)count;
    Hull hull = {.point = point,
                 .face = malloc(2 * n * sizeof *hull.face),
                 .next = malloc(n * sizeof *hull.next),
                 .wait = malloc(n * sizeof *hull.wait),
                 .fan = malloc(n * sizeof *hull.fan),
                 .seen = malloc(2 * n * sizeof *hull.seen),
                 .rim = malloc(6 * n * sizeof *hull.rim)};
    int *order = malloc(n * sizeof *order);
    ASSERT(hull.face != NULL && hull.next != NULL && hull.wait != NULL && hull.fan != NULL &&
           hull.seen != NULL && hull.rim != NULL && order != NULL);

    // Start with a large tetrahedron that faces outward.
    int first[4];
    static const int all[4] = {0, 1, 2, 3};
    pick_first(point, count, first);
    start_tetrahedron(&hull, first);
    if (height_above(&hull, 0, first[3]) > 0.0) { // the apex must be below the base
        int swap = first[0];
        first[0] = first[1];
        first[1] = swap;
        start_tetrahedron(&hull, first);
    }
    // Every other point waits at the face of the tetrahedron that it is highest above.
    bool convex = true;
    for (int i = 0; i < count; i++) {
        hull.wait[i] = -1;
        if (i != first[0] && i != first[1] && i != first[2] && i != first[3])
            wait_at_best(&hull, i, all, 4);
    }
    // A shuffled order keeps the expected time at n log n.
    shuffle(order, count);
    for (int i = 0; i < count && convex; i++)
        if (hull.wait[order[i]] >= 0)
            convex = insert_point(&hull, order[i]);
    // What remains are the faces of the hull.
    for (int f = 0; f < hull.face_count; f++)
        for (int k = 0; k < 3; k++)
            triangle[f][k] = hull.face[f].corner[k];
    free(hull.face);
    free(hull.next);
    free(hull.wait);
    free(hull.fan);
    free(hull.seen);
    free(hull.rim);
    free(order);
    return convex;
}

// --- relaxation ---
// Lloyd's relaxation and Delaunay edge flips on a triangle mesh in space: nodes end up evenly
// spread with five to seven neighbours each.

// In the plane the flips end by themselves; on a coarse curved surface two edges may alternate for
// ever, hence a limit.
enum { TURN_PASSES = 60 };

// The four nodes round an edge and the half-edges across the rim of its two triangles.
typedef struct Quad {
    int h, g;       // the two half-edges, a to b and b to a
    int a, b, c, d; // triangles a b c and b a d
} Quad;

static Quad quad_of(const TriMesh *mesh, const int *twin, int h)
{
    int g = twin[h];
    return (Quad){.h = h,
                  .g = g,
                  .a = half_edge_from(mesh, h),
                  .b = half_edge_to(mesh, h),
                  .c = half_edge_to(mesh, half_edge_next(h)),
                  .d = half_edge_to(mesh, half_edge_next(g))};
}

static Vec3 normal_of(const TriMesh *mesh, int a, int b, int c)
{
    return vec3_cross(vec3_sub(mesh->position[b], mesh->position[a]),
                      vec3_sub(mesh->position[c], mesh->position[a]));
}

// Returns the cotangent of the angle at `apex` between the directions to a and b.
static double cotangent(const TriMesh *mesh, int apex, int a, int b)
{
    Vec3 u = vec3_sub(mesh->position[a], mesh->position[apex]);
    Vec3 v = vec3_sub(mesh->position[b], mesh->position[apex]);
    return vec3_dot(u, v) / vec3_length(vec3_cross(u, v));
}

static bool are_joined(const TriMesh *mesh, const int *twin, int from, int h, int to)
{
    int at = h; // half-edges that leave `from`
    do {
        if (half_edge_to(mesh, at) == to)
            return true;
        at = twin[half_edge_previous(at)];
    } while (at != h);
    ASSERT(half_edge_from(mesh, h) == from);
    return false;
}

// True if the edge c d would give better shaped triangles than a b and keeps the surface sound.
static bool should_turn(const TriMesh *mesh, const int *twin, const int *valence, Quad quad)
{
    const double tie = -1e-6; // four nodes on one circle keep their edge
    if (!(cotangent(mesh, quad.c, quad.a, quad.b) + cotangent(mesh, quad.d, quad.b, quad.a) < tie))
        return false;
    // Nodes keep four neighbours: with three they become flat tips.
    if (valence[quad.a] <= 4 || valence[quad.b] <= 4)
        return false;
    Vec3 up =
        vec3_add(normal_of(mesh, quad.a, quad.b, quad.c), normal_of(mesh, quad.b, quad.a, quad.d));
    if (!(vec3_dot(up, normal_of(mesh, quad.c, quad.a, quad.d)) > 0.0) ||
        !(vec3_dot(up, normal_of(mesh, quad.d, quad.b, quad.c)) > 0.0))
        return false;
    return !are_joined(mesh, twin, quad.c, half_edge_previous(quad.h), quad.d);
}

static void join_twins(int *twin, int h, int g)
{
    twin[h] = g;
    twin[g] = h;
}

// Triangles a b c and b a d become c a d and d b c.
static void turn_edge(TriMesh *mesh, int *twin, Quad quad)
{
    // What lies beyond the four sides keeps its place; the diagonal moves.
    int across_bc = twin[half_edge_next(quad.h)], across_ca = twin[half_edge_previous(quad.h)];
    int across_ad = twin[half_edge_next(quad.g)], across_db = twin[half_edge_previous(quad.g)];
    int t = quad.h / 3, u = quad.g / 3;
    int *first = mesh->triangle[t], *second = mesh->triangle[u];
    first[0] = quad.c, first[1] = quad.a, first[2] = quad.d;
    second[0] = quad.d, second[1] = quad.b, second[2] = quad.c;
    // Each of the new sides meets its neighbour again.
    join_twins(twin, 3 * t, across_ca);
    join_twins(twin, 3 * t + 1, across_ad);
    join_twins(twin, 3 * t + 2, 3 * u + 2);
    join_twins(twin, 3 * u, across_db);
    join_twins(twin, 3 * u + 1, across_bc);
}

static void turn_edges(TriMesh *mesh, int *twin, int *valence)
{
    bool turned = true;
    for (int pass = 0; turned && pass < TURN_PASSES; pass++) {
        // Repeat until no edge wants to turn.
        turned = false;
        for (int h = 0; h < 3 * mesh->triangle_count; h++) {
            if (twin[h] < h) // each edge once
                continue;
            Quad quad = quad_of(mesh, twin, h);
            if (!should_turn(mesh, twin, valence, quad))
                continue;
            // Two nodes lose a neighbour, the two opposite ones gain it.
            turn_edge(mesh, twin, quad);
            valence[quad.a]--;
            valence[quad.b]--;
            valence[quad.c]++;
            valence[quad.d]++;
            turned = true;
        }
    }
}

// Returns the edge of an equilateral triangle with the mean area.
static double mean_edge(const TriMesh *mesh)
{
    return sqrt(4.0 / sqrt(3.0) * mesh_area(mesh) / mesh->triangle_count);
}

// Scratch memory of one relaxation, [node_count] each.
typedef struct Relax {
    int *valence;
    int *leaving; // a half-edge that leaves the node
    int *stamp;   // the last node in whose neighbourhood this one was found
    int *queue;
    Vec3 *moved;
} Relax;

// Returns the new position of a node that is pushed by all nodes within REACH mean edges l that are
// connected through such nodes: with (l / distance)^3, fading to nothing at REACH. The push does
// not depend on which edges exist, or nodes with many neighbours would drive away more of them.
static Vec3 pushed(const TriMesh *mesh, const int *twin, Relax *relax, int node, double l)
{
    const double REACH = 3.0;
    // A push p at distance d has the stiffness 3 p / d along the line between two nodes; the sum
    // over a ring of neighbours is half of that in any direction, and the stiffest mode oscillates
    // at twice the sum. Steps shrink with it where nodes are crowded; above a factor 1.5 they would
    // grow.
    const double STIFFNESS = 2.4;
    Vec3 push = {0.0, 0.0, 0.0};
    double stiffness = 0.0;
    int count = 0;
    // Breadth-first over the nodes within REACH; the stamp marks visited ones.
    relax->queue[count++] = node;
    relax->stamp[node] = node;
    for (int i = 0; i < count; i++) {
        int first = relax->leaving[relax->queue[i]], h = first;
        do {
            int other = half_edge_to(mesh, h);
            h = twin[half_edge_previous(h)];
            if (relax->stamp[other] == node)
                continue;
            relax->stamp[other] = node;
            Vec3 apart = vec3_sub(mesh->position[node], mesh->position[other]);
            double distance = vec3_length(apart) / l;
            if (distance >= REACH)
                continue;
            relax->queue[count++] = other;
            double fade = (1.0 - distance / REACH) / (distance * distance);
            push = vec3_madd(push, fade * fade, apart);
            stiffness += fade * fade;
        } while (h != first);
    }
    if (!(stiffness > 0.0))
        return mesh->position[node];
    return vec3_madd(mesh->position[node], 1.0 / (STIFFNESS * stiffness), push);
}

static void move_nodes(TriMesh *mesh, const int *twin, RelaxProject project, Relax *relax)
{
    double l = mean_edge(mesh);
    for (int h = 0; h < 3 * mesh->triangle_count; h++)
        relax->leaving[half_edge_from(mesh, h)] = h;
    for (int i = 0; i < mesh->node_count; i++)
        relax->stamp[i] = -1;
    for (int i = 0; i < mesh->node_count; i++)
        relax->moved[i] = project(pushed(mesh, twin, relax, i, l));
    for (int i = 0; i < mesh->node_count; i++)
        mesh->position[i] = relax->moved[i];
}

static int *new_ints(int count)
{
    int *array = calloc((size_t)count, sizeof *array);
    ASSERT(array != NULL);
    return array;
}

void relax_mesh(TriMesh *mesh, RelaxProject project, int sweeps)
{
    HalfEdges half;
    // The twins stay valid while edges turn.
    half_edge_create(&half, mesh);
    int n = mesh->node_count;
    Relax relax = {.valence = new_ints(n),
                   .leaving = new_ints(n),
                   .stamp = new_ints(n),
                   .queue = new_ints(n),
                   .moved = malloc((size_t)n * sizeof *relax.moved)};
    ASSERT(relax.moved != NULL);
    // Each half-edge that leaves a node is one of its neighbours.
    for (int h = 0; h < half.count; h++)
        relax.valence[half_edge_from(mesh, h)]++;

    // Connections follow the positions after every move.
    turn_edges(mesh, half.twin, relax.valence);
    for (int sweep = 0; sweep < sweeps; sweep++) {
        move_nodes(mesh, half.twin, project, &relax);
        turn_edges(mesh, half.twin, relax.valence);
    }
    half_edge_destroy(&half);
    free(relax.valence);
    free(relax.leaving);
    free(relax.stamp);
    free(relax.queue);
    free(relax.moved);
}

int relax_sweeps(int node_count)
{
    int sweeps = 100000 / node_count;
    return sweeps < 6 ? 6 : sweeps > 200 ? 200 : sweeps;
}
