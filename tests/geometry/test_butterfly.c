// SPDX-License-Identifier: MIT
#include "test.h"
#include "random.h"
#include "winged.h"

#include "geometry/generator.h"
#include "geometry/levels.h"

static const double PI = 3.14159265358979323846;

// One round of subdivision, looked at edge by edge.
typedef struct Round {
    TriMesh mesh;
    WingedMesh winged;
    Vec3 *middle; // [edge_count]
} Round;

static void subdivide(Round *round)
{
    butterfly_midpoints(&round->winged, (const int(*)[3])round->mesh.triangle, round->mesh.position,
                        round->middle);
}

static void take_mesh(Round *round, const TriMesh *mesh)
{
    *round = (Round){.mesh = *mesh};
    winged_create(&round->winged, mesh);
    round->middle = zeroed((size_t)round->winged.edge_count, sizeof *round->middle);
    subdivide(round);
}

static Vec3 middle_of(const Round *round, int a, int b)
{
    int edge = winged_find_edge(&round->winged, a, b);
    assert_true(edge >= 0);
    return round->middle[edge];
}

static void drop(Round *round)
{
    free(round->middle);
    winged_destroy(&round->winged);
    mesh_destroy(&round->mesh);
}

// A disc in z = 0 of `sectors` equal triangles round node 0, each a lattice of `rings` rows: only
// node 0 is extraordinary. Ring r starts at node 1 + sectors r (r - 1)/2; spokes have length 1.
static int disc_node(int sectors, int ring, int i)
{
    return ring == 0 ? 0 : 1 + sectors * ring * (ring - 1) / 2 + i % (sectors * ring);
}

static void make_disc(TriMesh *mesh, int sectors, int rings)
{
    mesh_create(mesh, 1 + sectors * rings * (rings + 1) / 2, sectors * rings * rings);
    int(*triangle)[3] = mesh->triangle;
    for (int ring = 1; ring <= rings; ring++)
        for (int sector = 0; sector < sectors; sector++)
            for (int i = 0; i < ring; i++) {
                double low = 2.0 * PI * sector / sectors, high = 2.0 * PI * (sector + 1) / sectors;
                int at = sector * ring + i, inner = sector * (ring - 1) + i;
                int node = disc_node(sectors, ring, at);
                mesh->position[node] = vec3((ring - i) * cos(low) + i * cos(high),
                                            (ring - i) * sin(low) + i * sin(high), 0.0);
                int outer[3] = {node, disc_node(sectors, ring, at + 1),
                                disc_node(sectors, ring - 1, inner)};
                memcpy(triangle++, outer, sizeof outer);
                if (i == ring - 1)
                    continue;
                int between[3] = {disc_node(sectors, ring - 1, inner), outer[1],
                                  disc_node(sectors, ring - 1, inner + 1)};
                memcpy(triangle++, between, sizeof between);
            }
    MeshFault fault;
    assert_ptr_equal(triangle, mesh->triangle + mesh->triangle_count);
    assert_true(mesh_check(mesh, &fault));
}

static void take_disc(Round *round, int sectors, int rings)
{
    TriMesh mesh;
    make_disc(&mesh, sectors, rings);
    take_mesh(round, &mesh);
}

// The weight of node j in the new point of (a, b): the answer to a unit at j alone.
static double weight_of(Round *round, int j, int a, int b)
{
    for (int i = 0; i < round->mesh.node_count; i++)
        round->mesh.position[i].z = i == j;
    subdivide(round);
    return middle_of(round, a, b).z;
}

static double printed_weight(int valence, int j)
{
    if (valence == 3)
        return j == 0 ? 5.0 / 12.0 : -1.0 / 12.0;
    if (valence == 4)
        return j == 0 ? 3.0 / 8.0 : j == 2 ? -1.0 / 8.0 : 0.0;
    return (0.25 + cos(2.0 * PI * j / valence) + 0.5 * cos(4.0 * PI * j / valence)) / valence;
}

TEST(extraordinary_weights_are_those_of_eq_5)
{
    for (int valence = 3; valence <= 12; valence++) {
        if (valence == 6)
            continue;
        SCOPED(drop) Round round;
        take_disc(&round, valence, 3);
        for (int j = 0; j < round.mesh.node_count; j++) {
            // With the centre's own weight of 3/4, which eq 4 forgets; both directions of the edge.
            double expected = j == 0 ? 0.75 : j <= valence ? printed_weight(valence, j - 1) : 0.0;
            expect_near(weight_of(&round, j, 0, 1), expected, 1e-15); // a few roundings of 1
            int from_last = j == 0 ? 0 : j <= valence ? 1 + j % valence : j;
            expect_near(weight_of(&round, from_last, 0, 2), expected, 1e-15);
        }
    }
}

TEST(regular_weights_are_those_of_the_mask)
{
    SCOPED(drop) Round round;
    take_disc(&round, 6, 3);
    int outer[2] = {disc_node(6, 2, 1), disc_node(6, 2, 11)}; // beside the end of the spoke
    for (int j = 0; j < round.mesh.node_count; j++) {
        double expected = j == 0 || j == 1                 ? 1.0 / 2.0
                          : j == 2 || j == 6               ? 1.0 / 8.0
                          : j == 3 || j == 5               ? -1.0 / 16.0
                          : j == outer[0] || j == outer[1] ? -1.0 / 16.0
                                                           : 0.0;
        assert_true(weight_of(&round, j, 0, 1) == expected); // powers of two: exact
    }
}

typedef double Height(double x, double y);
static double x2(double x, double y)
{
    return (void)y, x * x;
}
static double xy(double x, double y)
{
    return x * y;
}
static double x3(double x, double y)
{
    return (void)y, x * x * x;
}
static double x2y(double x, double y)
{
    return x * x * y;
}
static double x4(double x, double y)
{
    return (void)y, x * x * x * x;
}

// Largest distance of new points from z = height(x, y), over edges whose stencil is whole.
static double reproduction_error(Height *height)
{
    SCOPED(drop) Round round;
    take_disc(&round, 6, 6);
    for (int i = 0; i < round.mesh.node_count; i++)
        round.mesh.position[i].z = height(round.mesh.position[i].x, round.mesh.position[i].y);
    subdivide(&round);
    double error = 0.0;
    int inner = disc_node(6, 4, 0); // nodes of rings 0 .. 3
    for (int e = 0; e < round.winged.edge_count; e++) {
        if (round.winged.edge[e].node[1] >= inner)
            continue;
        Vec3 m = round.middle[e];
        error = fmax(error, fabs(m.z - height(m.x, m.y)));
    }
    return error;
}

TEST(regular_mask_reproduces_cubics_and_no_more)
{
    // Heights up to 3^3: 27 times a few roundings.
    expect_at_most(reproduction_error(x2), 2e-14);
    expect_at_most(reproduction_error(xy), 2e-14);
    expect_at_most(reproduction_error(x3), 2e-14);
    expect_at_most(reproduction_error(x2y), 2e-14);
    // Four points in a row miss x^4 by 9/16 at step 1 along x: any such miss will do.
    expect_at_least(reproduction_error(x4), 0.1);
}

TEST(spokes_of_every_valence_meet_the_paraboloid)
{
    for (int valence = 3; valence <= 20; valence++) {
        if (valence == 6)
            continue;
        SCOPED(drop) Round round;
        take_disc(&round, valence, 3);
        for (int i = 0; i < round.mesh.node_count; i++) {
            Vec3 *x = &round.mesh.position[i];
            x->z = 0.1 * (x->x * x->x + x->y * x->y);
        }
        subdivide(&round);
        for (int k = 0; k < valence; k++) {
            Vec3 m = middle_of(&round, 0, 1 + k), end = round.mesh.position[1 + k];
            expect_near(m.x, 0.5 * end.x, 1e-15);
            expect_near(m.y, 0.5 * end.y, 1e-15);
            expect_near(m.z, 0.1 * 0.25, 1e-15);
        }
    }
}

// --- a second implementation, by plain search over the triangles and the printed sums ---

static int third_of(const TriMesh *mesh, int u, int v) // of the triangle that runs from u to v
{
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            if (mesh->triangle[t][k] == u && mesh->triangle[t][(k + 1) % 3] == v)
                return mesh->triangle[t][(k + 2) % 3];
    return -1;
}

static int closed_valence(const TriMesh *mesh, int node, int first)
{
    int valence = 0, at = first;
    do {
        valence++;
        at = third_of(mesh, node, at);
    } while (at != first);
    return valence;
}

static Vec3 one_sided(const TriMesh *mesh, int v, int other)
{
    int valence = closed_valence(mesh, v, other), at = other;
    Vec3 sum = vec3_scale(0.75, mesh->position[v]);
    for (int j = 0; j < valence; j++, at = third_of(mesh, v, at))
        sum = vec3_madd(sum, printed_weight(valence, j), mesh->position[at]);
    return sum;
}

static Vec3 closed_midpoint(const TriMesh *mesh, int a, int b)
{
    const Vec3 *x = mesh->position;
    bool a_regular = closed_valence(mesh, a, b) == 6, b_regular = closed_valence(mesh, b, a) == 6;
    if (a_regular && b_regular) {
        int c = third_of(mesh, a, b), d = third_of(mesh, b, a);
        Vec3 wings = vec3_add(x[third_of(mesh, c, b)], x[third_of(mesh, a, c)]);
        wings = vec3_add(wings, vec3_add(x[third_of(mesh, d, a)], x[third_of(mesh, b, d)]));
        Vec3 sum = vec3_scale(0.5, vec3_add(x[a], x[b]));
        return vec3_madd(vec3_madd(sum, 0.125, vec3_add(x[c], x[d])), -0.0625, wings);
    }
    Vec3 sum = {0.0, 0.0, 0.0};
    if (!a_regular)
        sum = vec3_add(sum, one_sided(mesh, a, b));
    if (!b_regular)
        sum = vec3_add(sum, one_sided(mesh, b, a));
    return vec3_scale(a_regular || b_regular ? 1.0 : 0.5, sum);
}

static void expect_like_second_implementation(TriMesh *mesh)
{
    SCOPED(drop) Round round;
    take_mesh(&round, mesh);
    for (int e = 0; e < round.winged.edge_count; e++) {
        const int *end = round.winged.edge[e].node;
        Vec3 expected = closed_midpoint(&round.mesh, end[0], end[1]);
        // Coordinates of the order of 1 and up to 50 terms.
        expect_near(vec3_length(vec3_sub(round.middle[e], expected)), 0.0, 1e-14);
    }
}

TEST(closed_meshes_follow_the_printed_sums)
{
    TriMesh mesh;
    Status status = {0};
    assert_true(generate_stomach(&mesh, 188, 1.0, &status));
    expect_like_second_implementation(&mesh);
    assert_true(generate_sphere(&mesh, 114, 1.0, &status));
    expect_like_second_implementation(&mesh);
    assert_true(generate_uv_sphere(&mesh, 3, 14, 1.0, &status)); // valences 14, 5 and 6, all mixed
    expect_like_second_implementation(&mesh);
}

TEST(constant_is_reproduced_whatever_the_valence)
{
    TriMesh mesh;
    SCOPED(drop) Round round;
    assert_true(generate_stomach(&mesh, 300, 1.0, &(Status){0}));
    for (int i = 0; i < mesh.node_count; i++)
        mesh.position[i] = vec3(1.0, -2.0, 0.5);
    take_mesh(&round, &mesh);
    for (int e = 0; e < round.winged.edge_count; e++)
        assert_memory_equal(&round.middle[e], &mesh.position[0], sizeof mesh.position[0]);
}

TEST(thousand_spokes_add_up)
{
    TriMesh mesh;
    SCOPED(drop) Round round;
    const int count = 4000;
    assert_true(generate_uv_sphere(&mesh, 1, count, 1.0, &(Status){0}));
    take_mesh(&round, &mesh);
    // The ring is a circle: the pole's share is (x/2, y/2, 3/4), that of a ring node, of valence 4,
    // is the same 3/4 of itself and 3/8 of the pole less 1/8 of the other pole.
    for (int k = 0; k < count; k += 37) {
        Vec3 p = mesh.position[1 + k], m = middle_of(&round, 0, 1 + k);
        expect_near(m.x, 0.5 * (0.5 + 0.75) * p.x, 1e-12); // sums of 4000 terms
        expect_near(m.y, 0.5 * (0.5 + 0.75) * p.y, 1e-12);
        expect_near(m.z, 0.5 * (0.75 + 0.5), 1e-12);
    }
}

// --- boundaries ---

// Two rows of nodes, the lower one given; the upper one far above it.
static void make_strip(TriMesh *mesh, const Vec3 *lower, int count)
{
    mesh_create(mesh, 2 * count, 2 * (count - 1));
    for (int i = 0; i < count; i++) {
        mesh->position[i] = lower[i];
        mesh->position[count + i] = vec3_add(lower[i], vec3(0.0, 40.0, 0.0));
    }
    for (int i = 0; i + 1 < count; i++) {
        memcpy(mesh->triangle[2 * i], (int[3]){i, i + 1, count + i + 1}, sizeof mesh->triangle[0]);
        memcpy(mesh->triangle[2 * i + 1], (int[3]){i, count + i + 1, count + i},
               sizeof mesh->triangle[0]);
    }
}

TEST(boundary_reproduces_cubics_of_the_boundary_alone)
{
    Vec3 lower[9];
    for (int i = 0; i < 9; i++)
        lower[i] = vec3(i, 0.01 * i * i * i, 0.02 * i * i); // turns by less than 60 degrees
    TriMesh mesh;
    SCOPED(drop) Round round;
    make_strip(&mesh, lower, 9);
    take_mesh(&round, &mesh);
    for (int i = 1; i + 2 < 9; i++) {
        double t = i + 0.5;
        Vec3 m = middle_of(&round, i, i + 1);
        expect_near(m.x, t, 1e-14);
        expect_near(m.y, 0.01 * t * t * t, 1e-14);
        expect_near(m.z, 0.02 * t * t, 1e-14);
    }
    // At the strip's corners the reflection stands in: 7/16 a + 10/16 b - 1/16 next.
    Vec3 first = middle_of(&round, 0, 1);
    expect_near(first.y, 10.0 / 16.0 * 0.01 - 1.0 / 16.0 * 0.08, 1e-15);
}

TEST(corner_is_a_turn_of_more_than_sixty_degrees)
{
    for (int degrees = 50; degrees <= 70; degrees++) {
        double turn = degrees * PI / 180.0;
        Vec3 lower[5] = {{-2.0, 0.0, 0.0}, {-1.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
        for (int i = 1; i <= 2; i++)
            lower[2 + i] = vec3(i * cos(turn), -i * sin(turn), 0.0);
        TriMesh mesh;
        SCOPED(drop) Round round;
        make_strip(&mesh, lower, 5);
        take_mesh(&round, &mesh);
        // Beyond the corner the straight side goes on, else it bends towards the next node.
        double expected = degrees > 60 ? 0.0 : sin(turn) / 16.0;
        expect_near(middle_of(&round, 1, 2).y, expected, 1e-15);
    }
}

TEST(missing_wings_are_parallelograms)
{
    TriMesh mesh;
    Round round;
    mesh_create(&mesh, 4, 2); // all four wings missing: what remains is the middle, however bent
    const Vec3 corner[4] = {{0.0, 0.0, 0.0}, {1.0, 0.2, 0.1}, {0.3, 0.9, -0.4}, {0.6, -0.8, 0.5}};
    memcpy(mesh.position, corner, sizeof corner);
    memcpy(mesh.triangle[0], (int[3]){0, 1, 2}, sizeof mesh.triangle[0]);
    memcpy(mesh.triangle[1], (int[3]){1, 0, 3}, sizeof mesh.triangle[1]);
    take_mesh(&round, &mesh);
    Vec3 m = middle_of(&round, 0, 1);
    expect_near(vec3_length(vec3_sub(m, vec3(0.5, 0.1, 0.05))), 0.0, 1e-15);
    drop(&round);

    // One missing: the mask with what stands in for it written out.
    assert_true(generate_sheet(&mesh, 4, 3, 3.0, 2.0, &(Status){0}));
    uint64_t seed = 7;
    for (int i = 0; i < mesh.node_count; i++)
        mesh.position[i].z = random_between(&seed, -1.0, 1.0);
    take_mesh(&round, &mesh);
    const Vec3 *x = mesh.position;
    // Rows 0 1 2 3, 4 5 6 7 and 8 9 10 11, diagonals from lower left to upper right. Edge 5-9 has
    // 10 and 4 opposite; its wings are 6, 0, 8 and one beyond the upper border.
    double ghost = x[9].z + x[10].z - x[5].z; // across 9-10, from 5
    double expected = 0.5 * (x[5].z + x[9].z) + 0.125 * (x[10].z + x[4].z) -
                      0.0625 * (ghost + x[6].z + x[0].z + x[8].z);
    expect_near(middle_of(&round, 5, 9).z, expected, 1e-15);
    drop(&round);
}

TEST(two_triangles_back_to_back_stay_what_they_are)
{
    TriMesh mesh;
    SCOPED(drop) Round round;
    mesh_create(&mesh, 3, 2); // closed, every node of valence 2
    mesh.position[1].x = mesh.position[2].y = 1.0;
    memcpy(mesh.triangle[0], (int[3]){0, 1, 2}, sizeof mesh.triangle[0]);
    memcpy(mesh.triangle[1], (int[3]){0, 2, 1}, sizeof mesh.triangle[1]);
    take_mesh(&round, &mesh);
    Vec3 m = middle_of(&round, 1, 2);
    expect_near(vec3_length(vec3_sub(m, vec3(0.5, 0.5, 0.0))), 0.0, 0.0);
}

TEST(coordinates_map_on_their_own)
{
    TriMesh mesh;
    assert_true(generate_stomach(&mesh, 188, 1.0, &(Status){0}));
    SCOPED(drop) Round round;
    take_mesh(&round, &mesh);
    size_t count = (size_t)round.winged.edge_count;
    FREED Vec3 *before = malloc(count * sizeof *before);
    memcpy(before, round.middle, count * sizeof *before);
    for (int i = 0; i < mesh.node_count; i++)
        mesh.position[i] = vec3(mesh.position[i].y, mesh.position[i].z, mesh.position[i].x);
    subdivide(&round);
    for (size_t e = 0; e < count; e++) {
        Vec3 turned = vec3(before[e].y, before[e].z, before[e].x);
        assert_memory_equal(&round.middle[e], &turned, sizeof turned);
    }
}
