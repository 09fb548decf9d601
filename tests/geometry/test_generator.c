// SPDX-License-Identifier: MIT
#include "test.h"
#include "winged.h"

#include "geometry/distance.h"
#include "geometry/edges.h"
#include "geometry/generator.h"

#include <float.h>

static const double PI = 3.14159265358979323846;

typedef struct Shape {
    int least_valence, most_valence;
    double least_angle; // [rad]
} Shape;

// Valid, one piece, closed like a sphere, outward; then its shape.
static Shape measure_closed(const TriMesh *mesh, int nodes)
{
    MeshFault fault;
    SCOPED(winged_destroy) WingedMesh winged;
    Shape shape = {.least_valence = 1000000, .least_angle = PI};
    assert_true(mesh_check(mesh, &fault));
    winged_create(&winged, mesh);
    assert_int_equal(mesh->node_count, nodes);
    assert_int_equal(mesh->file_node_count, nodes);
    assert_int_equal(winged.edge_count, 3 * nodes - 6);
    assert_int_equal(mesh->triangle_count, 2 * nodes - 4);
    assert_int_equal(winged_euler(&winged), 2);
    assert_int_equal(winged_components(&winged), 1);
    assert_int_equal(winged_boundary_loops(&winged), 0);
    expect_at_least(mesh_volume(mesh), 0.0);
    for (int i = 0; i < nodes; i++) {
        int valence = winged_valence(&winged, i);
        shape.least_valence = valence < shape.least_valence ? valence : shape.least_valence;
        shape.most_valence = valence > shape.most_valence ? valence : shape.most_valence;
        assert_int_equal(mesh->file_index[i], i);
    }
    for (int h = 0; h < 3 * mesh->triangle_count; h++) {
        const int *corner = mesh->triangle[h / 3];
        Vec3 a = mesh->position[corner[h % 3]];
        Vec3 u = vec3_sub(mesh->position[corner[(h + 1) % 3]], a);
        Vec3 v = vec3_sub(mesh->position[corner[(h + 2) % 3]], a);
        double angle = atan2(vec3_length(vec3_cross(u, v)), vec3_dot(u, v));
        shape.least_angle = fmin(shape.least_angle, angle);
    }
    return shape;
}

static void expect_radius(const TriMesh *mesh, double radius)
{
    for (int i = 0; i < mesh->node_count; i++) // two roundings of a unit vector, one of the product
        expect_near(vec3_length(mesh->position[i]), radius, 4.0 * DBL_EPSILON * radius);
}

static double degrees(double radians)
{
    return radians * 180.0 / PI;
}

TEST(sphere_of_114_nodes_is_the_papers)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    assert_true(generate_sphere(&mesh, 114, 0.05, &(Status){0}));
    Shape shape = measure_closed(&mesh, 114);
    assert_int_equal(mesh.triangle_count, 224);
    assert_true(shape.least_valence >= 5 && shape.most_valence <= 7);
    expect_at_least(degrees(shape.least_angle), 35.0);
    expect_radius(&mesh, 0.05);
}

TEST(sphere_is_even_for_every_node_count)
{
    // All small counts, where four nodes on one circle and other coincidences are common.
    for (int nodes = 4; nodes <= 200; nodes += nodes < 40 ? 1 : 7) {
        SCOPED(mesh_destroy) TriMesh mesh;
        assert_true(generate_sphere(&mesh, nodes, 1.0, &(Status){0}));
        Shape shape = measure_closed(&mesh, nodes);
        // Squares split in two have angles of 45 degrees; a cell much worse is not even.
        expect_at_least(degrees(shape.least_angle), 35.0);
        assert_true(shape.least_valence >= (nodes < 12 ? 3 : 4));
        assert_true(shape.most_valence <= 7);
        expect_radius(&mesh, 1.0);
    }
}

TEST(sphere_is_the_convex_hull_of_its_nodes)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    assert_true(generate_sphere(&mesh, 188, 1.0, &(Status){0}));
    for (int t = 0; t < mesh.triangle_count; t++) {
        const int *corner = mesh.triangle[t];
        Vec3 a = mesh.position[corner[0]];
        Vec3 normal = vec3_cross(vec3_sub(mesh.position[corner[1]], a),
                                 vec3_sub(mesh.position[corner[2]], a));
        for (int i = 0; i < mesh.node_count; i++) // nothing above any face but rounding
            expect_at_most(vec3_dot(normal, vec3_sub(mesh.position[i], a)), 1e-12);
    }
}

TEST(few_nodes_find_the_regular_solids)
{
    // Volumes of the inscribed tetrahedron, octahedron and icosahedron.
    const int nodes[3] = {4, 6, 12};
    const double side = 1.0 / sin(0.4 * PI); // of the icosahedron
    const double volume[3] = {8.0 * sqrt(3.0) / 27.0, 4.0 / 3.0,
                              5.0 / 12.0 * (3.0 + sqrt(5.0)) * side * side * side};
    for (int i = 0; i < 3; i++) {
        SCOPED(mesh_destroy) TriMesh mesh;
        assert_true(generate_sphere(&mesh, nodes[i], 1.0, &(Status){0}));
        // The volume is stationary there: the error is the square of what relaxation left over.
        expect_near(mesh_volume(&mesh), volume[i], 1e-6);
    }
}

TEST(large_spheres_are_valid_and_round)
{
    const int nodes[2] = {2000, 20000};
    for (int i = 0; i < 2; i++) {
        SCOPED(mesh_destroy) TriMesh mesh;
        assert_true(generate_sphere(&mesh, nodes[i], 2.0, &(Status){0}));
        Shape shape = measure_closed(&mesh, nodes[i]);
        assert_true(shape.least_valence >= 5 && shape.most_valence <= 7);
        expect_at_least(degrees(shape.least_angle), 30.0);
        // 2 n equilateral facets with sides l lie l^2/8 below the sphere on average, which is
        // 3 l^2/8 = 5.44 / n of the ball; unequal ones lose more, a tenth is allowed.
        double ball = 4.0 / 3.0 * PI * 8.0;
        expect_near(mesh_volume(&mesh) / ball, 1.0 - 5.44 / nodes[i], 0.544 / nodes[i]);
    }
}

TEST(uv_sphere_of_8_by_14_is_the_papers)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    assert_true(generate_uv_sphere(&mesh, 8, 14, 0.05, &(Status){0}));
    measure_closed(&mesh, 114);
    expect_radius(&mesh, 0.05);
    // north pole, rings from north to south starting at +x, south pole
    expect_near(mesh.position[0].z, 0.05, 0.0);
    expect_near(mesh.position[113].z, -0.05, 0.0);
    for (int i = 1; i < 113; i++) {
        int ring = (i - 1) / 14, segment = (i - 1) % 14;
        expect_near(mesh.position[i].z, 0.05 * cos(PI * (ring + 1) / 9.0), 1e-16);
        double longitude = atan2(mesh.position[i].y, mesh.position[i].x);
        expect_near(cos(longitude - 2.0 * PI * segment / 14.0), 1.0, 1e-15);
    }
}

TEST(smallest_uv_sphere_is_valid)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    assert_true(generate_uv_sphere(&mesh, 1, 3, 1.0, &(Status){0}));
    measure_closed(&mesh, 5);
}

TEST(ico_sphere_has_twelve_nodes_of_valence_five)
{
    for (int s = 0, nodes = 12; s <= 5; s++, nodes = 4 * nodes - 6) {
        SCOPED(mesh_destroy) TriMesh mesh;
        SCOPED(winged_destroy) WingedMesh winged;
        assert_true(generate_ico_sphere(&mesh, s, 3.0, &(Status){0}));
        Shape shape = measure_closed(&mesh, nodes);
        expect_at_least(degrees(shape.least_angle), 50.0);
        expect_radius(&mesh, 3.0);
        winged_create(&winged, &mesh);
        for (int i = 0; i < nodes; i++)
            assert_int_equal(winged_valence(&winged, i), i < 12 ? 5 : 6);
    }
}

TEST(sheet_is_flat_and_faces_up)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    MeshFault fault;
    SCOPED(winged_destroy) WingedMesh winged;
    assert_true(generate_sheet(&mesh, 7, 5, 0.6, 0.2, &(Status){0}));
    assert_true(mesh_check(&mesh, &fault));
    expect_near(mesh_area(&mesh), 0.6 * 0.2, 1e-16);
    for (int t = 0; t < mesh.triangle_count; t++) {
        const Vec3 *x = mesh.position;
        const int *corner = mesh.triangle[t];
        Vec3 normal =
            vec3_cross(vec3_sub(x[corner[1]], x[corner[0]]), vec3_sub(x[corner[2]], x[corner[0]]));
        expect_near(vec3_unit(normal).z, 1.0, 1e-15); // normalising rounds twice
    }
    winged_create(&winged, &mesh);
    for (int i = 0; i < mesh.node_count; i++)
        if (!winged_is_boundary_node(&winged, i))
            assert_int_equal(winged_valence(&winged, i), 6);
    assert_int_equal(winged_boundary_loops(&winged), 1);
    expect_near(mesh.position[0].x, -0.3, 0.0);
    expect_near(mesh.position[34].y, 0.1, 0.0);
}

// Edges that pass through triangles that they do not touch.
static int count_crossings(const TriMesh *mesh)
{
    SCOPED(winged_destroy) WingedMesh winged;
    winged_create(&winged, mesh);
    int crossings = 0;
    for (int e = 0; e < winged.edge_count; e++) {
        const int *end = winged.edge[e].node;
        for (int t = 0; t < mesh->triangle_count; t++) {
            const int *corner = mesh->triangle[t];
            Vec3 x[3];
            double along, weight[3];
            bool touches = false;
            for (int k = 0; k < 3; k++) {
                x[k] = mesh->position[corner[k]];
                touches = touches || corner[k] == end[0] || corner[k] == end[1];
            }
            crossings +=
                !touches && distance_segment_crosses(mesh->position[end[0]], mesh->position[end[1]],
                                                     x, &along, weight);
        }
    }
    return crossings;
}

TEST(stomach_of_188_nodes_is_the_papers)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    assert_true(generate_stomach(&mesh, 188, 0.25, &(Status){0}));
    Shape shape = measure_closed(&mesh, 188); // 558 edges
    assert_int_equal(mesh.triangle_count, 372);
    assert_true(shape.least_valence >= 4 && shape.most_valence <= 8);
    expect_at_least(degrees(shape.least_angle), 30.0);
    assert_int_equal(count_crossings(&mesh), 0);
}

TEST(stomach_is_well_shaped_for_every_size)
{
    const int nodes[] = {60, 61, 67, 75, 100, 133, 250, 400, 1000, 5000, 20000};
    for (size_t i = 0; i < sizeof nodes / sizeof *nodes; i++) {
        SCOPED(mesh_destroy) TriMesh mesh;
        assert_true(generate_stomach(&mesh, nodes[i], 1.0, &(Status){0}));
        Shape shape = measure_closed(&mesh, nodes[i]);
        assert_true(shape.least_valence >= 4 && shape.most_valence <= 8);
        expect_at_least(degrees(shape.least_angle), 20.0);
        if (nodes[i] <= 250)
            assert_int_equal(count_crossings(&mesh), 0);
    }
}

TEST(stomach_fills_its_box_and_thins_towards_the_end)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    assert_true(generate_stomach(&mesh, 2000, 0.3, &(Status){0}));
    Vec3 low = mesh.position[0], high = low;
    double left_width = 0.0, right_width = 0.0; // across the bend, at the fundus and at the pylorus
    for (int i = 0; i < mesh.node_count; i++) {
        Vec3 x = mesh.position[i];
        low = vec3(fmin(low.x, x.x), fmin(low.y, x.y), fmin(low.z, x.z));
        high = vec3(fmax(high.x, x.x), fmax(high.y, x.y), fmax(high.z, x.z));
    }
    for (int i = 0; i < mesh.node_count; i++) {
        Vec3 x = mesh.position[i];
        if (x.z > high.z - 0.25 * (high.z - low.z))
            left_width = fmax(left_width, x.y);
        if (x.x > high.x - 0.15 * (high.x - low.x))
            right_width = fmax(right_width, x.y);
    }
    expect_near(fmax(high.x - low.x, high.z - low.z), 0.3, 1e-15);
    expect_near(low.x + high.x, 0.0, 1e-15);
    expect_near(low.z + high.z, 0.0, 1e-15);
    expect_at_least(left_width, 1.5 * right_width);
}

TEST(same_parameters_give_the_same_bits)
{
    TriMesh one, two;
    for (int kind = 0; kind < 2; kind++) {
        for (int i = 0; i < 2; i++) {
            TriMesh *mesh = i == 0 ? &one : &two;
            assert_true(kind == 0 ? generate_sphere(mesh, 300, 0.1, &(Status){0})
                                  : generate_stomach(mesh, 300, 0.1, &(Status){0}));
        }
        assert_memory_equal(one.position, two.position, 300 * sizeof *one.position);
        assert_memory_equal(one.triangle, two.triangle, 596 * sizeof *one.triangle);
        mesh_destroy(&one);
        mesh_destroy(&two);
    }
}

static void expect_refused(bool accepted, Status *status, const char *text)
{
    assert_false(accepted);
    assert_int_equal(status->code, STATUS_INVALID);
    assert_string_equal(status->text, text);
    *status = (Status){0};
}

TEST(parameters_out_of_range_are_refused)
{
    TriMesh mesh;
    Status status = {0};
    expect_refused(generate_sphere(&mesh, 3, 1.0, &status), &status, "nodes 3 outside [4, 20000]");
    expect_refused(generate_sphere(&mesh, 20001, 1.0, &status), &status,
                   "nodes 20001 outside [4, 20000]");
    expect_refused(generate_sphere(&mesh, 4, 0.0, &status), &status,
                   "radius 0 outside [1e-30, 1e+30] m");
    expect_refused(generate_sphere(&mesh, 4, (double)NAN, &status), &status,
                   "radius nan outside [1e-30, 1e+30] m");
    expect_refused(generate_uv_sphere(&mesh, 0, 3, 1.0, &status), &status,
                   "rings 0 outside [1, 2000]");
    expect_refused(generate_uv_sphere(&mesh, 1, 2, 1.0, &status), &status,
                   "segments 2 outside [3, 4000]");
    expect_refused(generate_uv_sphere(&mesh, 1, 3, -1.0, &status), &status,
                   "radius -1 outside [1e-30, 1e+30] m");
    expect_refused(generate_ico_sphere(&mesh, 9, 1.0, &status), &status,
                   "subdivisions 9 outside [0, 8]");
    expect_refused(generate_ico_sphere(&mesh, 0, HUGE_VAL, &status), &status,
                   "radius inf outside [1e-30, 1e+30] m");
    expect_refused(generate_sheet(&mesh, 1, 2, 1.0, 1.0, &status), &status,
                   "columns 1 outside [2, 4000]");
    expect_refused(generate_sheet(&mesh, 2, 4001, 1.0, 1.0, &status), &status,
                   "rows 4001 outside [2, 4000]");
    expect_refused(generate_sheet(&mesh, 2, 2, 0.0, 1.0, &status), &status,
                   "width 0 outside [1e-30, 1e+30] m");
    expect_refused(generate_sheet(&mesh, 2, 2, 1.0, -0.0, &status), &status,
                   "height -0 outside [1e-30, 1e+30] m");
    expect_refused(generate_stomach(&mesh, 59, 1.0, &status), &status,
                   "nodes 59 outside [60, 20000]");
    expect_refused(generate_stomach(&mesh, 60, -HUGE_VAL, &status), &status,
                   "length -inf outside [1e-30, 1e+30] m");
}
