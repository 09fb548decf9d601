// SPDX-License-Identifier: MIT
// Repairs of meshes as files hold them, defect by defect: what comes out is a valid mesh of the
// same shape, what was done is counted, and what cannot be mended is refused by name.
#include "mesh_drafts.h"
#include "random.h"

#include "geometry/generator.h"

// --- nodes ---

TEST(a_sound_mesh_comes_out_as_it_was)
{
    SCOPED(mesh_destroy) TriMesh made;
    MeshDraft draft = {0};
    assert_true(generate_stomach(&made, 188, 0.25, &(Status){0}));
    add_nodes(&draft, made.position, made.node_count);
    for (int t = 0; t < made.triangle_count; t++)
        FACE(&draft, made.triangle[t][0], made.triangle[t][1], made.triangle[t][2]);
    SCOPED(result_destroy) Result result = repair(&draft);
    expect_repairs(&result, "");
    assert_memory_equal(result.mesh.triangle, made.triangle,
                        (size_t)made.triangle_count * sizeof *made.triangle);
    assert_memory_equal(result.mesh.position, made.position,
                        (size_t)made.node_count * sizeof *made.position);
}

TEST(quads_become_triangles)
{
    MeshDraft draft = cube_draft();
    SCOPED(result_destroy) Result result = repair(&draft);
    expect_cube(&result);
    expect_repairs(&result, "cut 6 polygons into triangles");
}

TEST(unused_nodes_go_even_if_they_are_no_numbers)
{
    MeshDraft draft = {0};
    mesh_draft_add_node(&draft, vec3((double)NAN, 0, 0));
    add_cube(&draft, vec3(0, 0, 0));
    mesh_draft_add_node(&draft, vec3(1e300, (double)INFINITY, 0));
    SCOPED(result_destroy) Result result = repair(&draft);
    expect_cube(&result);
    expect_repairs(&result, "dropped 2 unused nodes, cut 6 polygons into triangles");
    assert_int_equal(result.mesh.file_index[0], 1);
    assert_int_equal(mesh_node_of_file(&result.mesh, 0), -1);
    assert_int_equal(mesh_node_of_file(&result.mesh, 8), 7);
}

TEST(used_nodes_that_are_no_numbers_are_refused)
{
    MeshDraft draft = cube_draft();
    draft.position[6].y = -(double)INFINITY;
    expect_refusal(&draft, 1, "face 1 uses node 6, whose position (1, -inf, 1) is not finite");
}

TEST(nodes_out_of_range_are_refused)
{
    MeshDraft draft = cube_draft();
    mesh_draft_add_corner(&draft, 8, -1);
    mesh_draft_end_polygon(&draft, 0);
    expect_refusal(&draft, 6, "face 6 names node 8, but there are 8 nodes");
}

TEST(equal_nodes_are_welded_to_the_first)
{
    // Every face with corners of its own, as STL has them.
    MeshDraft draft = {0};
    for (int f = 0; f < 6; f++) {
        for (int k = 0; k < 4; k++) {
            mesh_draft_add_corner(&draft, draft.node_count, -1);
            mesh_draft_add_node(&draft, CUBE[CUBE_FACES[f][k]]);
        }
        mesh_draft_end_polygon(&draft, 0);
    }
    SCOPED(result_destroy) Result result = repair(&draft);
    expect_cube(&result);
    expect_repairs(&result, "welded 16 nodes, cut 6 polygons into triangles");
    for (int i = 0; i < 24; i++) { // whichever number names a corner, it is that corner
        Vec3 x = result.mesh.position[mesh_node_of_file(&result.mesh, i)];
        assert_memory_equal(&x, &CUBE[CUBE_FACES[i / 4][i % 4]], sizeof x);
    }
}

TEST(closed_surfaces_that_touch_stay_apart)
{
    // Two cubes with nodes of their own that share a corner, an edge, a face.
    static const Vec3 at[3] = {{1, 1, 1}, {1, 1, 0}, {1, 0, 0}};
    for (int i = 0; i < 3; i++) {
        MeshDraft draft = cube_draft();
        add_cube(&draft, at[i]);
        SCOPED(result_destroy) Result result = repair(&draft);
        assert_int_equal(result.mesh.node_count, 16);
        assert_int_equal(result.quality.component_count, 2);
        assert_int_equal(result.quality.border_loops, 0);
        expect_near(result.quality.volume, 2.0, 1e-15); // exact but for rounding
        for (int k = 0; k < 16; k++)
            assert_int_equal(result.mesh.file_index[k], k);
    }
}

TEST(a_node_shared_by_two_surfaces_is_copied_behind_the_others)
{
    const Vec3 x[7] = {{0, 0, 0},  {1, 0, 0},  {0, 1, 0}, {0, 0, 1},
                       {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
    MeshDraft draft = {0};
    add_nodes(&draft, x, 7);
    add_tetrahedron(&draft, 0, 1, 2, 3);
    add_tetrahedron(&draft, 0, 5, 4, 6);
    SCOPED(result_destroy) Result result = repair(&draft);
    expect_repairs(&result, "split 1 node in which surfaces met, kept 2 components apart");
    assert_int_equal(result.mesh.node_count, 8);
    assert_int_equal(result.mesh.copy_count, 1);
    assert_int_equal(result.mesh.file_index[7], 7); // the first number that no node of the file has
    assert_int_equal(mesh_file_row(&result.mesh, 7), 0);
    expect_near(result.quality.volume, 2.0 / 6.0, 1e-16);
}

TEST(a_node_that_is_there_twice_where_surfaces_meet_is_not_welded)
{
    const Vec3 x[8] = {{0, 0, 0},  {1, 0, 0},  {0, 1, 0},  {0, 0, 1},
                       {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}, {0, 0, 0}};
    MeshDraft draft = {0};
    add_nodes(&draft, x, 8);
    add_tetrahedron(&draft, 7, 1, 2, 3);
    add_tetrahedron(&draft, 0, 5, 4, 6);
    SCOPED(result_destroy) Result result = repair(&draft);
    assert_int_equal(result.mesh.node_count, 8);
    assert_int_equal(result.mesh.copy_count, 0);
    for (int i = 0; i < 8; i++) {
        assert_int_equal(result.mesh.file_index[i], i);
        assert_int_equal(mesh_node_of_file(&result.mesh, i), i);
    }
}

// --- faces ---

TEST(degenerate_faces_are_dropped)
{
    MeshDraft draft = cube_draft();
    FACE(&draft, 0, 1);
    FACE(&draft, 5);
    FACE(&draft, 3, 3, 2);
    FACE(&draft, 6, 7, 6, 7);
    mesh_draft_end_polygon(&draft, 0); // no corner at all
    SCOPED(result_destroy) Result result = repair(&draft);
    expect_cube(&result);
    expect_repairs(&result, "cut 7 polygons into triangles, dropped 5 degenerate faces");
}

TEST(duplicate_faces_are_dropped_whichever_way_they_run)
{
    MeshDraft draft = cube_draft();
    FACE(&draft, 3, 2, 1, 0); // rotated
    FACE(&draft, 4, 7, 6, 5); // reversed
    SCOPED(result_destroy) Result result = repair(&draft);
    expect_cube(&result);
    expect_repairs(&result, "cut 8 polygons into triangles, dropped 2 duplicate faces");
}

TEST(a_mesh_of_nothing_is_refused)
{
    MeshDraft none = {0}, line = {0}, fold = {0};
    expect_refusal(&none, -1, "the mesh has no faces");
    add_nodes(&line, CUBE, 8);
    FACE(&line, 0, 1);
    expect_refusal(&line, -1, "the mesh has no faces");
    const Vec3 x[3] = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
    add_nodes(&fold, x, 3);
    FACE(&fold, 0, 1, 2);
    expect_refusal(&fold, -1, "the mesh has no face with an area");
}

TEST(polygons_that_share_two_edges_are_cut_along_different_diagonals)
{
    // Node 0 belongs to two faces only, which have both of its edges, and the shorter diagonal too.
    // Above the square 1 2 3 4 a tent of quads or, with `more`, a quad and a pentagon.
    for (int more = 0; more < 2; more++)
        for (int turn = 0; turn < 4; turn++) {
            const Vec3 x[7] = {{0, 0, 0},     {0, 10, 50},  {40, 70, 30}, {0, 60, -10},
                               {-40, 70, 30}, {0, 120, 20}, {-30, 20, 45}};
            const int quad[2][5] = {{0, 1, 2, 3, -1}, {4, 1, 0, 3, -1}};
            MeshDraft draft = {0};
            add_nodes(&draft, x, 6 + more);
            for (int f = 0; f < 2; f++) {
                for (int k = 0; k < 4; k++) {
                    const int node = quad[f][(k + turn) % 4];
                    mesh_draft_add_corner(&draft, node, -1);
                    if (more && f == 1 && node == 4)
                        mesh_draft_add_corner(&draft, 6, -1);
                }
                mesh_draft_end_polygon(&draft, 0);
            }
            FACE(&draft, 2, 1, 5);
            FACE(&draft, 3, 2, 5);
            FACE(&draft, 4, 3, 5);
            if (more) {
                FACE(&draft, 1, 6, 5);
                FACE(&draft, 6, 4, 5);
            } else {
                FACE(&draft, 1, 4, 5);
            }
            SCOPED(result_destroy) Result result = repair(&draft);
            assert_int_equal(result.mesh.node_count, 6 + more);
            assert_int_equal(result.quality.border_loops, 0);
            assert_int_equal(result.quality.component_count, 1);
            assert_int_equal(result.quality.component[0].genus, 0);
            assert_int_equal(result.repairs.duplicate_faces, 0);
        }
}

TEST(a_polygon_that_crosses_itself_is_refused)
{
    MeshDraft draft = {0};
    add_nodes(&draft, CUBE, 8);
    FACE(&draft, 4, 5, 6, 7);
    FACE(&draft, 0, 2, 1, 3);
    expect_refusal(&draft, 1, "face 1 has 4 corners and crosses itself; export triangles");
}

// --- faces without area ---

// A tetrahedron a b c d with `more` nodes on its edge a b: one of the two faces there is drawn with
// those nodes, and faces without area fill up what lies between them and the edge.
static void add_split_tetrahedron(MeshDraft *draft, int more, uint64_t *random)
{
    const Vec3 x[4] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    add_nodes(draft, x, 4);
    FACE(draft, 0, 1, 3);
    FACE(draft, 1, 2, 3);
    FACE(draft, 2, 0, 3);
    int chain[16] = {1}, left = more + 2;
    for (int i = 1; i <= more; i++) {
        mesh_draft_add_node(draft, vec3(1.0 - i / (more + 1.0), 0, 0));
        chain[i] = 3 + i;
        FACE(draft, chain[i - 1], chain[i], 2);
    }
    FACE(draft, chain[more], 0, 2);
    chain[more + 1] = 0;
    // Cuts the degenerate polygon b .. a into triangles at random.
    for (; left > 2; left--) {
        int at = 1 + random_below(random, left - 2);
        FACE(draft, chain[at + 1], chain[at], chain[at - 1]);
        memmove(chain + at, chain + at + 1, (size_t)(left - at - 1) * sizeof *chain);
    }
}

TEST(faces_without_area_leave_no_crack)
{
    uint64_t random = 3;
    for (int round = 0; round < 400; round++) {
        int more = 1 + round % 12;
        MeshDraft draft = {0};
        add_split_tetrahedron(&draft, more, &random);
        // as it stands the draft is closed: 4 + more nodes, so 4 + 2 more triangles
        assert_int_equal(draft.polygon_count, 4 + 2 * more);
        SCOPED(result_destroy) Result result = repair(&draft);
        assert_int_equal(result.repairs.flat_faces, more);
        assert_int_equal(result.mesh.node_count, 4 + more);
        assert_int_equal(result.mesh.triangle_count, 4 + 2 * more);
        assert_int_equal(result.quality.border_loops, 0);
        assert_int_equal(result.quality.component[0].genus, 0);
        expect_near(result.quality.volume, 1.0 / 6.0, 1e-15); // exact but for rounding
    }
}

TEST(a_face_without_area_at_the_border_is_dropped)
{
    const Vec3 x[5] = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}, {1, 0, 0}};
    MeshDraft draft = {0};
    add_nodes(&draft, x, 5);
    FACE(&draft, 0, 4, 3);
    FACE(&draft, 4, 2, 3);
    FACE(&draft, 4, 1, 2);
    FACE(&draft, 0, 1, 4);
    SCOPED(result_destroy) Result result = repair(&draft);
    expect_repairs(&result, "took out 1 face without area");
    assert_int_equal(result.mesh.triangle_count, 3);
    assert_int_equal(result.quality.border_loops, 1);
    assert_int_equal(result.quality.border_edges, 5);
    expect_near(result.quality.area, 2.0, 1e-15);
}

TEST(a_face_without_area_along_other_faces_is_dropped)
{
    // A fin on an edge of the cube: a node in its middle that no other face knows.
    MeshDraft draft = cube_draft();
    mesh_draft_add_node(&draft, vec3(0.5, 0, 0));
    FACE(&draft, 0, 1, 8);
    SCOPED(result_destroy) Result result = repair(&draft);
    expect_cube(&result);
    expect_repairs(&result, "dropped 1 unused node, cut 6 polygons into triangles, took out 1 face "
                            "without area");
}

TEST(nodes_that_all_but_coincide_are_merged_where_a_face_has_no_area)
{
    // An octahedron whose upper tip is an edge of length 1e-11: its two faces are needles.
    const Vec3 x[7] = {{0, 0, 1},  {1, 0, 0},  {0, 1, 0},        {-1, 0, 0},
                       {0, -1, 0}, {0, 0, -1}, {0, 0, 1 + 1e-11}};
    MeshDraft draft = {0};
    add_nodes(&draft, x, 7);
    FACE(&draft, 0, 1, 2);
    FACE(&draft, 6, 3, 4);
    FACE(&draft, 0, 2, 6);
    FACE(&draft, 2, 3, 6);
    FACE(&draft, 0, 6, 4);
    FACE(&draft, 0, 4, 1);
    FACE(&draft, 5, 2, 1);
    FACE(&draft, 5, 3, 2);
    FACE(&draft, 5, 4, 3);
    FACE(&draft, 5, 1, 4);
    SCOPED(result_destroy) Result result = repair(&draft);
    expect_repairs(&result, "merged 1 node with the next, took out 2 faces without area");
    assert_int_equal(result.mesh.node_count, 6);
    assert_int_equal(result.mesh.triangle_count, 8);
    assert_int_equal(result.quality.border_loops, 0);
    expect_near(result.quality.volume, 4.0 / 3.0, 1e-15); // of the octahedron
    assert_int_equal(mesh_node_of_file(&result.mesh, 6), 0);
}

// A merge may leave two triangles of the same nodes of a tetrahedron. They enclose nothing, and
// divided they would share the edges inside them: they go, the rest stays.
TEST(what_a_merge_makes_of_a_flat_tetrahedron_is_taken_out)
{
    MeshDraft draft = cube_draft();
    const Vec3 x[4] = {{3, 0, 0}, {4, 0, 0}, {3, 1, 0}, {3, 0, 1e-11}};
    add_nodes(&draft, x, 4);
    add_tetrahedron(&draft, 8, 9, 10, 11);
    SCOPED(result_destroy) Result result = repair(&draft);
    assert_int_equal(result.mesh.triangle_count, 12);
    assert_int_equal(result.mesh.node_count, 8);
    // Such a pair is no mesh, whoever made it.
    TriMesh pair;
    MeshFault fault;
    mesh_create(&pair, 3, 2);
    memcpy(pair.position, x, 3 * sizeof *x);
    const int face[2][3] = {{0, 1, 2}, {2, 1, 0}};
    memcpy(pair.triangle, face, sizeof face);
    assert_false(mesh_check(&pair, &fault));
    assert_non_null(strstr(fault.text, "the same three nodes"));
    mesh_destroy(&pair);
}

// --- orientation ---

TEST(faces_are_turned_until_closed_surfaces_look_outward)
{
    uint64_t random = 5;
    SCOPED(mesh_destroy) TriMesh sphere;
    assert_true(generate_ico_sphere(&sphere, 2, 0.1, &(Status){0}));
    double volume = mesh_volume(&sphere);
    for (int round = 0; round < 20; round++) {
        MeshDraft draft = {0};
        int turned = 0;
        add_nodes(&draft, sphere.position, sphere.node_count);
        for (int t = 0; t < sphere.triangle_count; t++) {
            const int *node = sphere.triangle[t];
            // the last round: all of them, inside out
            bool turn = round == 19 || random_below(&random, 20) < round;
            turned += turn;
            if (turn)
                FACE(&draft, node[0], node[2], node[1]);
            else
                FACE(&draft, node[0], node[1], node[2]);
        }
        SCOPED(result_destroy) Result result = repair(&draft);
        assert_int_equal(result.repairs.turned_faces, turned);
        expect_near(result.quality.volume, volume, 1e-15); // rounding of sums of size 1e-3
    }
}

TEST(each_component_looks_outward_by_itself)
{
    MeshDraft draft = cube_draft();
    int start = draft.corner_count;
    add_cube(&draft, vec3(50, 0, 0));
    for (int c = start; c < draft.corner_count; c += 4) { // inside out
        int swap = draft.corner[c];
        draft.corner[c] = draft.corner[c + 2];
        draft.corner[c + 2] = swap;
    }
    SCOPED(result_destroy) Result result = repair(&draft);
    expect_repairs(&result, "cut 12 polygons into triangles, turned 6 faces, kept 2 components "
                            "apart");
    for (int i = 0; i < 2; i++)
        expect_near(result.quality.component[i].volume, 1.0, 1e-12); // 50 away: 2500 times 1e-16
}

TEST(an_open_sheet_keeps_the_side_of_most_of_its_faces)
{
    SCOPED(mesh_destroy) TriMesh sheet;
    MeshDraft draft = {0};
    assert_true(generate_sheet(&sheet, 9, 9, 1.0, 1.0, &(Status){0}));
    add_nodes(&draft, sheet.position, sheet.node_count);
    for (int t = 0; t < sheet.triangle_count; t++) {
        const int *node = sheet.triangle[t];
        if (t < 3)
            FACE(&draft, node[0], node[2], node[1]);
        else
            FACE(&draft, node[0], node[1], node[2]);
    }
    SCOPED(result_destroy) Result result = repair(&draft);
    expect_repairs(&result, "turned 3 faces");
    for (int t = 0; t < result.mesh.triangle_count; t++) {
        const int *node = result.mesh.triangle[t];
        const Vec3 *x = result.mesh.position;
        Vec3 normal =
            vec3_cross(vec3_sub(x[node[1]], x[node[0]]), vec3_sub(x[node[2]], x[node[0]]));
        expect_at_least(normal.z, 0.0);
    }
}

TEST(a_moebius_strip_is_refused)
{
    enum { TURNS = 12 };
    SCOPED(mesh_draft_destroy) MeshDraft draft = {0};
    for (int i = 0; i < TURNS; i++) {
        double angle = 6.283185307179586 * i / TURNS, twist = 0.5 * angle;
        for (int side = -1; side <= 1; side += 2) {
            double radius = 1.0 + 0.2 * side * cos(twist);
            mesh_draft_add_node(
                &draft, vec3(radius * cos(angle), radius * sin(angle), 0.2 * side * sin(twist)));
        }
    }
    for (int i = 0; i + 1 < TURNS; i++)
        FACE(&draft, 2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1);
    FACE(&draft, 2 * TURNS - 2, 1, 0, 2 * TURNS - 1);
    TriMesh mesh;
    MeshRepairs repairs;
    MeshFault fault;
    assert_false(mesh_repair(&draft, &mesh, &repairs, &fault));
    assert_non_null(strstr(fault.text, "one side only, like a Moebius strip: faces"));
    assert_in_range(fault.triangle, 0, TURNS - 1);
}

// --- edges ---

TEST(an_edge_of_three_faces_is_refused)
{
    MeshDraft draft = cube_draft();
    mesh_draft_add_node(&draft, vec3(0.5, -1, 0.5));
    FACE(&draft, 0, 1, 8);
    expect_refusal(&draft, 6,
                   "edge between nodes 0 and 1 belongs to 3 faces, more than two: 0, 2, 6; "
                   "MeshLab's Repair non Manifold Edges mends it");
}

TEST(closed_surfaces_drawn_with_a_common_edge_are_refused)
{
    const Vec3 x[6] = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
    SCOPED(mesh_draft_destroy) MeshDraft draft = {0};
    add_nodes(&draft, x, 6);
    add_tetrahedron(&draft, 0, 2, 3, 1);
    add_tetrahedron(&draft, 0, 4, 5, 1);
    TriMesh mesh;
    MeshRepairs repairs;
    MeshFault fault;
    assert_false(mesh_repair(&draft, &mesh, &repairs, &fault));
    assert_string_equal(fault.text, "edge between nodes 0 and 1 belongs to 4 faces, more than two: "
                                    "1, 3, 5 ...; MeshLab's Repair non Manifold Edges mends it");
}

TEST(borders_stay_borders)
{
    MeshDraft draft = {0};
    add_nodes(&draft, CUBE, 8);
    for (int f = 2; f < 6; f++) // without floor and lid
        FACE(&draft, CUBE_FACES[f][0], CUBE_FACES[f][1], CUBE_FACES[f][2], CUBE_FACES[f][3]);
    SCOPED(result_destroy) Result result = repair(&draft);
    assert_int_equal(result.quality.border_loops, 2);
    assert_int_equal(result.quality.border_edges, 8);
    assert_int_equal(result.quality.component[0].genus, 0);
    expect_near(result.quality.area, 4.0, 1e-15);
}

// --- sizes ---

TEST(tiny_and_huge_meshes_are_repaired_alike)
{
    static const double scale[] = {1e-80, 1e-9, 1.0, 1e12, 1e80};
    for (size_t i = 0; i < sizeof scale / sizeof *scale; i++) {
        uint64_t random = 11;
        MeshDraft draft = {0};
        add_split_tetrahedron(&draft, 4, &random);
        for (int k = 0; k < draft.node_count; k++)
            draft.position[k] = vec3_scale(scale[i], draft.position[k]);
        SCOPED(result_destroy) Result result = repair(&draft);
        assert_int_equal(result.repairs.flat_faces, 4);
        assert_int_equal(result.mesh.triangle_count, 12);
        assert_int_equal(result.quality.border_loops, 0);
    }
    static const double beyond[] = {1e-200, 1e200, 1e308};
    for (size_t i = 0; i < sizeof beyond / sizeof *beyond; i++) {
        SCOPED(mesh_draft_destroy) MeshDraft draft = {0};
        TriMesh mesh;
        MeshRepairs repairs;
        MeshFault fault;
        add_cube(&draft, vec3(-0.5, 0, 0));
        for (int k = 0; k < draft.node_count; k++)
            draft.position[k] = vec3_scale(beyond[i], draft.position[k]);
        assert_false(mesh_repair(&draft, &mesh, &repairs, &fault));
        assert_non_null(strstr(fault.text, "the mesh measures"));
    }
}

// --- anything ---

TEST(any_set_of_faces_is_made_valid_or_refused_with_a_sentence)
{
    uint64_t random = 17;
    int made = 0, refused = 0;
    for (int round = 0; round < 30000; round++) {
        // Few nodes on a coarse grid: collinear, coinciding and crossing in every way.
        SCOPED(mesh_draft_destroy) MeshDraft draft = {.keeps_uv = round % 3 == 0};
        int nodes = 3 + random_below(&random, 9), faces = 1 + random_below(&random, 10);
        int values = 2 + random_below(&random, 3);
        for (int i = 0; i < nodes; i++)
            mesh_draft_add_node(&draft,
                                vec3(random_below(&random, values), random_below(&random, values),
                                     random_below(&random, 2)));
        mesh_draft_add_uv(&draft, 0.5, 0.5);
        mesh_draft_add_uv(&draft, 0.25, 0.5);
        for (int f = 0; f < faces; f++) {
            int corners = random_below(&random, 8) == 0 ? random_below(&random, 8)
                                                        : 3 + random_below(&random, 2);
            for (int c = 0; c < corners; c++)
                mesh_draft_add_corner(&draft, random_below(&random, nodes),
                                      random_below(&random, 4) - 1);
            mesh_draft_end_polygon(&draft, 0);
        }
        TriMesh mesh;
        MeshRepairs repairs;
        MeshFault fault;
        if (mesh_repair(&draft, &mesh, &repairs, &fault)) {
            made++;
            assert_true(mesh_check(&mesh, &fault));
            for (int i = 0; i < mesh.node_count; i++)
                assert_in_range(mesh_file_row(&mesh, i), 0, nodes - 1);
            for (int i = 0; i < nodes; i++)
                assert_in_range(mesh_node_of_file(&mesh, i) + 1, 0, mesh.node_count);
            mesh_destroy(&mesh);
        } else {
            refused++;
            assert_true(fault.text[0] != '\0' && fault.triangle < faces);
        }
    }
    // Both happen often: the test tests something.
    assert_true(made > 1000 && refused > 1000);
}

TEST(repairs_do_not_change_a_repaired_mesh)
{
    uint64_t random = 23;
    for (int round = 0; round < 50; round++) {
        MeshDraft draft = {0}, again = {0};
        add_split_tetrahedron(&draft, 1 + round % 12, &random);
        SCOPED(result_destroy) Result first = repair(&draft);
        add_nodes(&again, first.mesh.position, first.mesh.node_count);
        for (int t = 0; t < first.mesh.triangle_count; t++)
            FACE(&again, first.mesh.triangle[t][0], first.mesh.triangle[t][1],
                 first.mesh.triangle[t][2]);
        SCOPED(result_destroy) Result second = repair(&again);
        expect_repairs(&second, "");
        assert_memory_equal(second.mesh.triangle, first.mesh.triangle,
                            (size_t)first.mesh.triangle_count * sizeof *first.mesh.triangle);
    }
}
