// SPDX-License-Identifier: MIT
// What was severed of bodies whose cuts are known: a sheet along a line, a box through its middle.
#include "score_parts.h"

#include "test.h"

enum { NODES = 512, TRIANGLES = 1024, BIRTHS = 64 };

// A mesh as a recording has it.
typedef struct Mesh {
    int nodes, triangles, births;
    int id[NODES];
    Vec3 place[NODES];
    float position[NODES][3];
    int triangle[TRIANGLES][3];
    int origin[NODES], parent[NODES][2];
    // where nodes come from: id, origin, parents; a later one counts
    int birth[BIRTHS][4];
} Mesh;

static Mesh mesh;
static ScoreRules rules;
static ScoreTissue *tissue;
static ScoreBody body;

static int add_node(int id, Vec3 place)
{
    assert_true(mesh.nodes < NODES);
    mesh.id[mesh.nodes] = id;
    mesh.place[mesh.nodes] = place;
    return mesh.nodes++;
}

static void add_triangle(int a, int b, int c)
{
    assert_true(mesh.triangles < TRIANGLES);
    int *corner = mesh.triangle[mesh.triangles++];
    corner[0] = a;
    corner[1] = b;
    corner[2] = c;
}

static void add_square(int a, int b, int c, int d)
{
    add_triangle(a, b, c);
    add_triangle(a, c, d);
}

static int add_birth(int id, int origin, int parent, int other)
{
    int *birth = mesh.birth[mesh.births++];
    birth[0] = id;
    birth[1] = origin;
    birth[2] = parent;
    birth[3] = other;
    return id;
}

// Hands the mesh over, displaced as `turned` about z and stretched: no figure may depend on that.
static Severed take(double turned, double stretched)
{
    for (int i = 0; i < mesh.nodes; i++) {
        const Vec3 p = mesh.place[i];
        mesh.position[i][0] = (float)(stretched * (p.x * cos(turned) - p.y * sin(turned)));
        mesh.position[i][1] = (float)(stretched * (p.x * sin(turned) + p.y * cos(turned)));
        mesh.position[i][2] = (float)(p.z + (turned > 0.0 ? 0.5 : 0.0));
    }
    for (int i = 0; i < mesh.nodes; i++) {
        mesh.origin[i] = mesh.parent[i][0] = mesh.parent[i][1] = mesh.id[i];
        for (int k = 0; k < mesh.births; k++)
            if (mesh.birth[k][0] == mesh.id[i]) {
                mesh.origin[i] = mesh.birth[k][1];
                mesh.parent[i][0] = mesh.birth[k][2];
                mesh.parent[i][1] = mesh.birth[k][3];
            }
    }
    const RecordingTopology topology = {.number = 1,
                                        .node_count = mesh.nodes,
                                        .triangle_count = mesh.triangles,
                                        .node_id = mesh.id,
                                        .node_origin = mesh.origin,
                                        .node_parent = (const int(*)[2])mesh.parent,
                                        .triangle = (const int(*)[3])mesh.triangle};
    return score_tissue_mesh(tissue, &topology, &mesh.position[0][0]);
}

static void begin(int first_wall)
{
    memset(&mesh, 0, sizeof mesh);
    body = (ScoreBody){.name = "a"};
    tissue = score_tissue_create(&rules, "a", first_wall);
}

static int end(void **unused)
{
    (void)unused;
    if (tissue != NULL)
        score_tissue_destroy(tissue);
    tissue = NULL;
    rules = (ScoreRules){.fixed_count = 0};
    return 0;
}

// --- a sheet -------------------------------------------------------------------------------------

enum { COLUMNS = 10, ROWS = 5 }; // of squares of one centimetre

static int at(int column, int row)
{
    return row * (COLUMNS + 1) + column;
}

static void make_sheet(void)
{
    mesh.nodes = mesh.triangles = 0;
    for (int r = 0; r <= ROWS; r++)
        for (int c = 0; c <= COLUMNS; c++)
            add_node(at(c, r), vec3(0.01 * c, 0.01 * r, 0.0));
    for (int r = 0; r < ROWS; r++)
        for (int c = 0; c < COLUMNS; c++)
            add_square(at(c, r), at(c + 1, r), at(c + 1, r + 1), at(c, r + 1));
}

static void begin_sheet(void)
{
    begin(0);
    make_sheet();
    take(0.0, 1.0);
}

// Cuts along a column, from the lower border up through so many rows.
static void cut_sheet(int column, int rows, int first_id)
{
    int copy[ROWS + 1];
    for (int r = 0; r <= rows; r++) {
        copy[r] = at(column, r);
        if (r == rows && rows < ROWS)
            break; // the tip of the cut stays whole
        copy[r] = add_node(add_birth(first_id + r, at(column, r), first_id + r, first_id + r),
                           mesh.place[at(column, r)]);
    }
    // The triangles on its right get the copies.
    for (int r = 0; r < rows; r++)
        for (int k = 0; k < 2; k++) {
            int *corner = mesh.triangle[2 * (r * COLUMNS + column) + k];
            for (int i = 0; i < 3; i++)
                for (int q = 0; q <= rows; q++)
                    corner[i] = corner[i] == at(column, q) ? copy[q] : corner[i];
        }
}

AROUND_EACH(NULL, end)

TEST(a_cut_sheet_has_lost_the_length_of_the_cut)
{
    rules.scene.region_count = 1;
    rules.scene.region[0].region =
        (FixedRegion){.kind = FIXED_BOX, .low = {-1.0, 0.015, -1.0}, .high = {1.0, 1.0, 1.0}};
    begin(0);
    make_sheet();
    Severed severed = take(0.0, 1.0);
    expect_near(severed.inside + severed.outside, 0.0, 0.0);
    cut_sheet(3, ROWS, 1000);
    severed = take(0.4, 1.3);
    expect_near(severed.inside + severed.outside, 0.05, 1e-8); // positions are in single precision
    expect_near(severed.inside, 0.035, 1e-8);
    score_tissue_pieces(tissue, &body);
    assert_int_equal(body.pieces_first, 1);
    assert_int_equal(body.pieces_last, 2);
    assert_int_equal(body.removed, 1);
    expect_near(body.removed_size, 0.03 * 0.05, 1e-9);
    expect_near(body.whole_size, 0.1 * 0.05, 1e-9);
    assert_false(body.solid);
}

TEST(two_cuts_add_up_and_a_repeated_mesh_adds_nothing)
{
    begin_sheet();
    cut_sheet(3, 2, 1000);
    expect_near(take(0.0, 1.0).outside, 0.02, 1e-8);
    expect_near(take(1.0, 0.8).outside, 0.0, 0.0);
    cut_sheet(6, ROWS, 2000);
    expect_near(take(0.2, 1.0).outside, 0.05, 1e-8);
}

TEST(restoring_the_body_severs_nothing_and_the_next_cut_counts)
{
    begin_sheet();
    cut_sheet(3, ROWS, 1000);
    expect_near(take(0.0, 1.0).outside, 0.05, 1e-8);
    make_sheet();
    expect_near(take(0.0, 1.0).outside, 0.0, 0.0);
    // The same ids are now copies of others.
    cut_sheet(6, ROWS, 1000);
    expect_near(take(0.0, 1.0).outside, 0.05, 1e-8);
    score_tissue_pieces(tissue, &body);
    expect_near(body.removed_size, 0.04 * 0.05, 1e-9);
}

TEST(refinement_at_the_border_severs_nothing)
{
    begin_sheet();
    // The lower edge of the first square is divided, where the body is bent: the new node does not
    // lie between its parents.
    const int middle = add_node(add_birth(500, 500, at(0, 0), at(1, 0)), vec3(0.005, -0.004, 0.0));
    mesh.triangle[0][1] = middle;
    add_triangle(middle, at(1, 0), at(1, 1));
    expect_near(take(0.0, 1.0).outside, 0.0, 0.0);
}

TEST(a_piece_with_fixed_nodes_is_not_removed)
{
    FixedRegion region = {.kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {0.001, 1.0, 1.0}};
    ScoreFixed fixed = {.body = "a", .region = &region, .count = 1};
    rules.fixed = &fixed;
    rules.fixed_count = 1;
    begin_sheet();
    cut_sheet(3, ROWS, 1000);
    take(0.0, 1.0);
    score_tissue_pieces(tissue, &body);
    assert_int_equal(body.pieces_last, 2);
    assert_int_equal(body.removed, 0);
}

// --- a box ---------------------------------------------------------------------------------------

// A box of 4 by 2 by 1 cm in two storeys, the lower one of 3 mm: corners of three levels, walls
// between the storeys once it is cut. `inside`: id of the first corner of the middle.
static void make_box(bool cut)
{
    static const double HEIGHT[4] = {0.0, 0.003, 0.003, 0.01};
    const int levels = cut ? 4 : 3;
    int corner[4][4];
    mesh.nodes = mesh.triangles = 0;
    for (int level = 0; level < levels; level++)
        for (int i = 0; i < 4; i++) {
            const double z = HEIGHT[!cut && level == 2 ? 3 : level];
            const int id = 4 * (!cut || level < 2 ? level : level == 2 ? 3 : 2) + i;
            corner[level][i] =
                add_node(id, vec3(i == 1 || i == 2 ? 0.04 : 0.0, i >= 2 ? 0.02 : 0.0, z));
        }
    const int(*c)[4] = (const int(*)[4])corner;
    const int *top = c[levels - 1];
    add_square(c[0][3], c[0][2], c[0][1], c[0][0]);
    add_square(top[0], top[1], top[2], top[3]);
    for (int storey = 0; storey < 2; storey++) {
        const int *low = c[storey == 0 ? 0 : levels - 2], *high = c[storey == 0 ? 1 : levels - 1];
        for (int i = 0; i < 4; i++)
            add_square(low[i], low[(i + 1) % 4], high[(i + 1) % 4], high[i]);
    }
    if (!cut)
        return;
    add_square(c[1][0], c[1][1], c[1][2], c[1][3]);
    add_square(c[2][3], c[2][2], c[2][1], c[2][0]);
    for (int i = 0; i < 4; i++)
        add_birth(12 + i, 4 + i, 12 + i, 12 + i);
}

enum { BOX_OUTSIDE = 20 };

TEST(a_box_cut_in_two_has_lost_its_section)
{
    rules.scene.region_count = 1;
    rules.scene.region[0].region =
        (FixedRegion){.kind = FIXED_BOX, .low = {0.01, -1.0, -1.0}, .high = {1.0, 1.0, 1.0}};
    begin(BOX_OUTSIDE);
    make_box(false);
    Severed severed = take(0.0, 1.0);
    expect_near(severed.inside + severed.outside, 0.0, 0.0);
    make_box(true);
    severed = take(0.7, 1.1);
    expect_near(severed.inside + severed.outside, 0.04 * 0.02, 1e-10);
    // Shares of a triangle are found to a sixty-fourth, of two to less.
    expect_near(severed.inside, 0.03 * 0.02, 0.04 * 0.02 / 64.0);
    score_tissue_pieces(tissue, &body);
    assert_true(body.solid);
    assert_int_equal(body.pieces_last, 2);
    assert_int_equal(body.removed, 1);
    // Three lengths in single precision.
    expect_near(body.removed_size, 0.04 * 0.02 * 0.003, 2e-7 * 8e-6);
    expect_near(body.whole_size, 0.04 * 0.02 * 0.01, 2e-7 * 8e-6);
}

TEST(new_nodes_from_the_inside_are_displaced_as_their_neighbours)
{
    begin(BOX_OUTSIDE);
    make_box(false);
    take(0.0, 1.0);
    make_box(true);
    mesh.births = 0; // as of the inside of a solid: nothing tells where they come from
    // All is shifted by half a metre: what was severed is as large as it was at the start.
    for (int i = 0; i < mesh.nodes; i++)
        mesh.place[i].x += 0.5;
    expect_near(take(0.0, 1.0).outside, 0.04 * 0.02, 1e-9);
}

// --- damaged files -------------------------------------------------------------------------------

TEST(births_in_circles_end)
{
    begin(0);
    make_sheet();
    for (int i = 0; i < 30; i++)
        add_birth(i, (i + 1) % 30, (i + 7) % 30, (i + 3) % 30);
    take(0.0, 1.0);
    cut_sheet(3, 2, 1000);
    const Severed severed = take(0.0, 1.0);
    assert_true(isfinite(severed.inside) && isfinite(severed.outside));
    score_tissue_pieces(tissue, &body);
}

TEST(meshes_without_triangles_or_nodes_have_no_pieces)
{
    begin(0);
    take(0.0, 1.0);
    add_node(5, vec3(0.0, 0.0, 0.0));
    add_triangle(0, 0, 0);
    expect_near(take(0.0, 1.0).outside, 0.0, 0.0);
    score_tissue_pieces(tissue, &body);
    assert_int_equal(body.pieces_last, 0);
    assert_int_equal(body.removed, 0);
}

// --- regions -------------------------------------------------------------------------------------

TEST(regions_that_overlap_count_once)
{
    rules.scene.region_count = 3;
    rules.scene.region[0].region =
        (FixedRegion){.kind = FIXED_SPHERE, .center = {0.03, 0.01, 0.0}, .radius = 0.01};
    rules.scene.region[1].region =
        (FixedRegion){.kind = FIXED_BOX, .low = {-1.0, 0.015, -1.0}, .high = {1.0, 0.025, 1.0}};
    rules.scene.region[2].region =
        (FixedRegion){.kind = FIXED_SPHERE, .center = {1.0, 1.0, 0.0}, .radius = 0.5};
    begin_sheet();
    cut_sheet(3, ROWS, 1000);
    // From 0 to 25 mm of 50 mm.
    expect_near(take(0.0, 1.0).inside, 0.025, 1e-8);
}
