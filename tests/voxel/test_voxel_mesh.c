// SPDX-License-Identifier: MIT
#include "test.h"
#include "sample_mesh.h"

static int leaf_of_slot(const Sample *sample, const int point[3], int slot)
{
    return layout_leaf_at(&sample->layout, point[0] - 1 + (slot & 1),
                          point[1] - 1 + (slot >> 1 & 1), point[2] - 1 + (slot >> 2));
}

// --- counts ---

static long count_incidences(const LatticeMesh *mesh)
{
    long incidences = 0;
    for (int e = 0; e < mesh->element_count; e++)
        for (int n = 0; n < NODE_COUNT; n++)
            incidences += mesh->vertex[e][n] >= 0;
    return incidences;
}

// Vertices and incidences of an independent program; surface vertices of a cube in closed form.
TEST(cubes_and_balls_have_the_known_counts)
{
    static const struct {
        int n, ball, vertices, incidences;
    } known[] = {
        {16, 0, 3681, 21328},  {32, 0, 17219, 102752}, {64, 0, 74943, 452752},
        {32, 1, 11487, 65128}, {64, 1, 51013, 294384},
    };
    for (size_t c = 0; c < sizeof known / sizeof known[0]; c++) {
        int n = known[c].n;
        SCOPED(drop) Sample sample;
        sample_mesh(&sample, known[c].ball ? sample_ball(n) : sample_box(n, n, n), 3);
        assert_int_equal(sample.mesh.vertex_count, known[c].vertices);
        assert_int_equal(count_incidences(&sample.mesh), known[c].incidences);
        assert_int_equal(sample.mesh.piece_count, 1);
        if (!known[c].ball) {
            assert_int_equal(sample.mesh.surface_count, 6 * n * n + 2);
            assert_int_equal(sample.mesh.face_count, 12 * n * n);
        }
    }
}

static int count_masks(const LatticeMesh *mesh)
{
    FREED unsigned char *seen = calloc(1 << (NODE_COUNT - NODE_CORNERS), 1);
    int masks = 0;
    for (int e = 0; e < mesh->element_count; e++) {
        unsigned mask = template_mask_of(mesh->vertex[e]);
        masks += !seen[mask];
        seen[mask] = 1;
    }
    return masks;
}

// A cube's element is plain, or has finer ones beyond its faces on one side or another of each axis
// or neither: 3^3 with the plain one.
TEST(cube_has_27_kinds_of_elements)
{
    SCOPED(drop) Sample sample;
    sample_mesh(&sample, sample_box(64, 64, 64), 3);
    assert_int_equal(count_masks(&sample.mesh), 27);
}

// --- vertices, derived a second time ---

// What the eight cells around a point share, by walks of any length from cell to cell.
typedef struct Around {
    int leaf[8];
    bool joined[8][8];
    bool corner[8]; // the point is a corner of that leaf
} Around;

static Around look_around(const Sample *sample, const int point[3])
{
    Around around = {0};
    for (int s = 0; s < 8; s++) {
        int leaf = around.leaf[s] = leaf_of_slot(sample, point, s);
        around.corner[s] = leaf >= 0;
        for (int d = 0; d < 3 && leaf >= 0; d++) {
            const Leaf *l = &sample->layout.leaf[leaf];
            int from_low = point[d] - l->cell[d];
            if (from_low != 0 && from_low != 1 << l->level)
                around.corner[s] = false;
        }
    }
    for (int s = 0; s < 8; s++)
        for (int t = 0; t < 8; t++) {
            int step = s ^ t;
            bool face = step == 0 || step == 1 || step == 2 || step == 4;
            around.joined[s][t] = around.leaf[s] >= 0 && around.leaf[t] >= 0 &&
                                  (face || around.leaf[s] == around.leaf[t]);
        }
    for (int via = 0; via < 8; via++)
        for (int s = 0; s < 8; s++)
            for (int t = 0; t < 8; t++)
                around.joined[s][t] |= around.joined[s][via] && around.joined[via][t];
    return around;
}

static int node_of(const Leaf *leaf, const int point[3])
{
    for (int node = 0; node < NODE_COUNT; node++) {
        bool here = true;
        for (int d = 0; d < 3; d++)
            here &= 2 * (point[d] - leaf->cell[d]) == NODE_OFFSET[node][d] << leaf->level;
        if (here)
            return node;
    }
    return -1;
}

// Checks what the leaves around a point have there; returns how many entries of theirs it has seen.
static int expect_point(const Sample *sample, const int point[3])
{
    const LatticeMesh *mesh = &sample->mesh;
    const int *n = sample->lattice.count;
    int points = (n[0] + 1) * (n[1] + 1) * (n[2] + 1), seen = 0;
    int index = (point[2] * (n[1] + 1) + point[1]) * (n[0] + 1) + point[0];
    Around around = look_around(sample, point);
    int vertex[8], found = 0; // of each slot's part; -1: none
    for (int s = 0; s < 8; s++) {
        vertex[s] = -1;
        if (around.leaf[s] < 0)
            continue;
        bool owns = false;
        int lowest = 8, node = node_of(&sample->layout.leaf[around.leaf[s]], point);
        for (int t = 7; t >= 0; t--)
            if (around.joined[s][t]) {
                owns |= around.corner[t];
                lowest = t;
            }
        if (node >= 0) {
            vertex[s] = mesh->vertex[around.leaf[s]][node];
            seen += vertex[s] >= 0;
        }
        assert_int_equal(vertex[s] >= 0, owns);
        if (!owns)
            continue;
        assert_memory_equal(mesh->point[vertex[s]], point, sizeof(int[3]));
        if (lowest == s)
            assert_int_equal(mesh->id[vertex[s]], index + (found++ == 0 ? 0 : points * s));
        for (int t = 0; t < s; t++)
            if (vertex[t] >= 0)
                assert_int_equal(vertex[t] == vertex[s], around.joined[s][t]);
    }
    return seen;
}

// A leaf meets a point at its edge in two slots, at its face in four.
static long count_slots(const LatticeMesh *mesh)
{
    long slots = 0;
    for (int e = 0; e < mesh->element_count; e++)
        for (int n = 0; n < NODE_COUNT; n++)
            if (mesh->vertex[e][n] >= 0)
                slots += n < NODE_CORNERS ? 1 : n < NODE_CORNERS + 12 ? 2 : 4;
    return slots;
}

static void expect_vertices(const Sample *sample)
{
    const int *n = sample->lattice.count;
    long seen = 0;
    for (int z = 0; z <= n[2]; z++)
        for (int y = 0; y <= n[1]; y++)
            for (int x = 0; x <= n[0]; x++)
                seen += expect_point(sample, (int[3]){x, y, z});
    // Nothing elsewhere.
    assert_int_equal(seen, count_slots(&sample->mesh));
}

TEST(vertices_are_what_the_cells_around_share)
{
    on_all_sorts(expect_vertices, 10, 17);
}

// Every vertex belongs to an element; those of the outer faces, and no others, come first; each
// group in the order of points, then of slots.
static void expect_numbers(const Sample *sample)
{
    const LatticeMesh *mesh = &sample->mesh;
    FREED char *use = calloc((size_t)mesh->vertex_count, 1);
    for (int e = 0; e < mesh->element_count; e++)
        for (int n = 0; n < NODE_COUNT; n++)
            if (mesh->vertex[e][n] >= 0)
                use[mesh->vertex[e][n]] |= 1;
    for (int f = 0; f < mesh->face_count; f++)
        for (int k = 0; k < 3; k++)
            use[mesh->face[f][k]] |= 2;
    for (int v = 0; v < mesh->vertex_count; v++) {
        assert_int_equal(use[v], v < mesh->surface_count ? 3 : 1);
        if (v == 0 || v == mesh->surface_count)
            continue;
        const int *a = mesh->point[v - 1], *b = mesh->point[v];
        int before = a[2] != b[2]   ? a[2] - b[2]
                     : a[1] != b[1] ? a[1] - b[1]
                     : a[0] != b[0] ? a[0] - b[0]
                                    : mesh->id[v - 1] - mesh->id[v];
        assert_true(before < 0);
    }
}

TEST(every_vertex_has_a_use_and_surface_comes_first)
{
    on_all_sorts(expect_numbers, 20, 23);
}

// --- pieces ---

// Spreads a piece's number over all cells that faces join.
static void flood(const Sample *sample, int *piece, int *stack, int from, int number)
{
    int top = 0;
    stack[top++] = from;
    piece[from] = number;
    while (top > 0) {
        int e = stack[--top];
        const Leaf *leaf = &sample->layout.leaf[e];
        int size = 1 << leaf->level;
        for (int side = 0; side < 6; side++)
            for (int c = 0; c < size * size; c++) {
                int at[3];
                at[side / 2] = leaf->cell[side / 2] + (side & 1 ? size : -1);
                at[(side / 2 + 1) % 3] = leaf->cell[(side / 2 + 1) % 3] + c % size;
                at[(side / 2 + 2) % 3] = leaf->cell[(side / 2 + 2) % 3] + c / size;
                int other = layout_leaf_at(&sample->layout, at[0], at[1], at[2]);
                if (other >= 0 && piece[other] < 0) {
                    piece[other] = number;
                    stack[top++] = other;
                }
            }
    }
}

static void expect_pieces(const Sample *sample)
{
    const LatticeMesh *mesh = &sample->mesh;
    size_t bytes = (size_t)mesh->element_count * sizeof(int);
    int *piece = malloc(bytes), *stack = malloc(bytes), count = 0;
    memset(piece, -1, bytes);
    for (int e = 0; e < mesh->element_count; e++) {
        if (piece[e] < 0)
            flood(sample, piece, stack, e, count++);
        for (int n = 0; n < NODE_COUNT; n++)
            if (mesh->vertex[e][n] >= 0)
                assert_int_equal(mesh->piece[mesh->vertex[e][n]], piece[e]);
    }
    assert_int_equal(mesh->piece_count, count);
    assert_int_equal(mesh->piece_count, lattice_pieces(&sample->lattice));
    free(piece);
    free(stack);
}

TEST(pieces_are_what_faces_join)
{
    on_all_sorts(expect_pieces, 20, 29);
}

// --- masses ---

// m_i = sum of density V w_i / 8 has the cells' mass and centre, with different materials too.
static void expect_mass(const Sample *sample)
{
    const LatticeMesh *mesh = &sample->mesh;
    double total = 0.0, moment[3] = {0}, expected = 0.0, place[3] = {0};
    FREED double *mass = calloc((size_t)mesh->vertex_count, sizeof *mass);
    for (int e = 0; e < mesh->element_count; e++) {
        const Leaf *leaf = &sample->layout.leaf[e];
        Template t;
        template_create(&t, template_mask_of(mesh->vertex[e]));
        double size = 1 << leaf->level, own = leaf->material * 900.0 * size * size * size;
        for (int i = 0; i < t.count; i++)
            mass[mesh->vertex[e][t.node[i]]] += own * t.weight[i] / 8.0;
        expected += own;
        for (int d = 0; d < 3; d++)
            place[d] += own * (leaf->cell[d] + 0.5 * size);
    }
    for (int v = 0; v < mesh->vertex_count; v++) {
        assert_true(mass[v] > 0.0);
        total += mass[v];
        for (int d = 0; d < 3; d++)
            moment[d] += mass[v] * mesh->point[v][d];
    }
    // Plain sums of some ten thousand positive terms, each within 1e-16 of its own: rounding
    // walks at random to about a hundredth of this.
    expect_near(total / expected, 1.0, 1e-13);
    for (int d = 0; d < 3; d++)
        expect_near(moment[d] / place[d], 1.0, 1e-13);
}

TEST(masses_and_their_centre_are_those_of_the_cells)
{
    on_all_sorts(expect_mass, 10, 31);
}

// --- small cases by hand ---

TEST(cells_that_touch_along_an_edge_share_nothing)
{
    Lattice lattice = sample_void(2, 2, 1);
    lattice.label[0] = lattice.label[3] = 1;
    SCOPED(drop) Sample sample;
    sample_mesh(&sample, lattice, 2);
    assert_int_equal(sample.mesh.vertex_count, 16);
    assert_int_equal(sample.mesh.piece_count, 2);
    assert_int_equal(sample.mesh.surface_count - sample.mesh.face_count / 2, 4); // Euler: 2 balls
    // Two vertices at each of the points (1, 1, 0) and (1, 1, 1), indices 4 and 13 of 18: slots 4
    // and 7 below, 0 and 3 above.
    int twice = 0;
    for (int v = 0; v < 16; v++)
        if (sample.mesh.id[v] >= 18) {
            assert_int_equal(sample.mesh.id[v], twice == 0 ? 4 + 18 * 7 : 13 + 18 * 3);
            twice++;
        }
    assert_int_equal(twice, 2);
}

TEST(cells_that_touch_at_a_corner_share_nothing)
{
    Lattice lattice = sample_void(2, 2, 2);
    lattice.label[0] = lattice.label[7] = 1;
    SCOPED(drop) Sample sample;
    sample_mesh(&sample, lattice, 2);
    assert_int_equal(sample.mesh.vertex_count, 16);
    assert_int_equal(sample.mesh.piece_count, 2);
}

// Around an edge two cells that a third one joins farther on: one vertex where it joins them, two
// at the other end.
TEST(edge_opens_from_one_vertex_into_two)
{
    Lattice lattice = sample_void(2, 2, 2);
    // below: (0,0) and (1,1); above: all but (0,1)
    lattice.label[0] = lattice.label[3] = 1;
    lattice.label[4] = lattice.label[5] = lattice.label[7] = 1;
    SCOPED(drop) Sample sample;
    sample_mesh(&sample, lattice, 0);
    int at_end = 0, at_middle = 0;
    for (int v = 0; v < sample.mesh.vertex_count; v++) {
        const int *p = sample.mesh.point[v];
        at_end += p[0] == 1 && p[1] == 1 && p[2] == 0;
        at_middle += p[0] == 1 && p[1] == 1 && p[2] == 1;
    }
    assert_int_equal(at_end, 2);
    assert_int_equal(at_middle, 1);
    assert_int_equal(sample.mesh.piece_count, 1);
    assert_int_equal(sample.mesh.surface_count - sample.mesh.face_count / 2, 2); // Euler: a ball
}

TEST(one_cell_is_a_cube_of_twelve_triangles)
{
    SCOPED(drop) Sample sample;
    sample_mesh(&sample, sample_box(1, 1, 1), 3);
    assert_int_equal(sample.mesh.vertex_count, 8);
    assert_int_equal(sample.mesh.surface_count, 8);
    assert_int_equal(sample.mesh.face_count, 12);
    for (int n = 0; n < NODE_COUNT; n++)
        assert_int_equal(sample.mesh.vertex[0][n], n < 8 ? n : -1);
    for (int v = 0; v < 8; v++)
        assert_int_equal(sample.mesh.id[v], v);
}

TEST(void_has_no_vertices)
{
    SCOPED(drop) Sample sample;
    sample_mesh(&sample, sample_void(3, 5, 2), 1);
    assert_int_equal(sample.mesh.vertex_count, 0);
    assert_int_equal(sample.mesh.piece_count, 0);
    assert_int_equal(sample.mesh.face_count, 0);
}

// Vertices keep their numbers whatever the levels: an element may be divided without renaming
// anything.
TEST(ids_do_not_depend_on_levels)
{
    SCOPED(drop) Sample fine, coarse;
    sample_mesh(&fine, sample_box(30, 27, 25), 0);
    sample_mesh(&coarse, sample_box(30, 27, 25), 3);
    assert_true(coarse.mesh.vertex_count < fine.mesh.vertex_count);
    assert_int_equal(coarse.mesh.surface_count, fine.mesh.surface_count);
    for (int v = 0; v < coarse.mesh.surface_count; v++)
        assert_int_equal(coarse.mesh.id[v], fine.mesh.id[v]);
    int at = fine.mesh.surface_count;
    for (int v = coarse.mesh.surface_count; v < coarse.mesh.vertex_count; v++) {
        while (fine.mesh.id[at] != coarse.mesh.id[v])
            assert_true(++at < fine.mesh.vertex_count);
        assert_memory_equal(fine.mesh.point[at], coarse.mesh.point[v], sizeof(int[3]));
    }
}

// An id is an int and counts every lattice point eight times.
TEST(lattice_with_too_many_points_is_refused)
{
    Layout layout = {.lattice_count = {645, 645, 645}, .count = {645, 645, 645}};
    SCOPED(lattice_mesh_destroy) LatticeMesh mesh;
    Status status = {0};
    assert_false(lattice_mesh_create(&mesh, &layout, &status));
    assert_int_equal(status.code, STATUS_INVALID);
    assert_non_null(strstr(status.text, "645"));
}
