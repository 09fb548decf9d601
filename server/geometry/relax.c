// Lloyd's relaxation and Delaunay edge flips on a triangle mesh in space: nodes end up evenly
// spread with five to seven neighbours each.
#include "geometry/relax.h"

#include "base/check.h"
#include "geometry/edges.h"

#include <stdlib.h>

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
    int across_bc = twin[half_edge_next(quad.h)], across_ca = twin[half_edge_previous(quad.h)];
    int across_ad = twin[half_edge_next(quad.g)], across_db = twin[half_edge_previous(quad.g)];
    int t = quad.h / 3, u = quad.g / 3;
    int *first = mesh->triangle[t], *second = mesh->triangle[u];
    first[0] = quad.c, first[1] = quad.a, first[2] = quad.d;
    second[0] = quad.d, second[1] = quad.b, second[2] = quad.c;
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
        turned = false;
        for (int h = 0; h < 3 * mesh->triangle_count; h++) {
            if (twin[h] < h)
                continue;
            Quad quad = quad_of(mesh, twin, h);
            if (!should_turn(mesh, twin, valence, quad))
                continue;
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
    half_edge_create(&half, mesh);
    int n = mesh->node_count;
    Relax relax = {.valence = new_ints(n),
                   .leaving = new_ints(n),
                   .stamp = new_ints(n),
                   .queue = new_ints(n),
                   .moved = malloc((size_t)n * sizeof *relax.moved)};
    ASSERT(relax.moved != NULL);
    for (int h = 0; h < half.count; h++)
        relax.valence[half_edge_from(mesh, h)]++;

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
