// SPDX-License-Identifier: MIT
// Seams of meshes that are closed but for rounding: what is joined, and what must not be.
#include "mesh_drafts.h"
#include "random.h"

// A ball of radius 1 of longitudes and latitudes whose last meridian is there twice, by `shift`
// apart; `scale` of all.
enum { MERIDIANS = 16, PARALLELS = 8 };

static MeshDraft seamed_ball(double shift, double scale)
{
    static const double PI = 3.14159265358979323846;
    MeshDraft draft = {0};
    for (int j = 0; j <= MERIDIANS; j++)
        for (int i = 1; i < PARALLELS; i++) {
            const double t = PI * i / PARALLELS, f = 2.0 * PI * (j % MERIDIANS) / MERIDIANS;
            const double more = j == MERIDIANS ? shift : 0.0;
            mesh_draft_add_node(&draft, vec3(scale * sin(t) * cos(f),
                                             scale * (sin(t) * sin(f) + more), scale * cos(t)));
        }
    const int top = draft.node_count, row = PARALLELS - 1;
    mesh_draft_add_node(&draft, vec3(0, 0, scale));
    mesh_draft_add_node(&draft, vec3(0, 0, -scale));
    for (int j = 0; j < MERIDIANS; j++) {
        const int a = j * row, b = a + row;
        FACE(&draft, top, a, b);
        for (int i = 0; i + 1 < row; i++) {
            FACE(&draft, a + i, a + i + 1, b + i + 1);
            FACE(&draft, a + i, b + i + 1, b + i);
        }
        FACE(&draft, top + 1, b + row - 1, a + row - 1);
    }
    return draft;
}

TEST(a_seam_that_is_closed_but_for_rounding_is_joined)
{
    static const double shift[] = {1e-16, 1e-12, 1e-7, 2e-6}, scale[] = {1e-3, 1.0, 30.0, 1e9};
    MeshDraft sound = seamed_ball(0.0, 1.0);
    SCOPED(result_destroy) Result closed = repair(&sound);
    expect_repairs(&closed, "welded 7 nodes"); // bit-equal: nothing is left to join
    for (int k = 0; k < 16; k++) {
        const double by = shift[k % 4], size = scale[k / 4];
        MeshDraft draft = seamed_ball(by, size);
        SCOPED(result_destroy) Result result = repair(&draft);
        assert_int_equal(result.repairs.joined_edges, 2 * PARALLELS);
        expect_near(result.repairs.joined_apart, by * size, 1e-15 * size); // rounding of a size
        assert_int_equal(result.quality.border_loops, 0);
        assert_int_equal(result.mesh.node_count, closed.mesh.node_count);
        // The nodes that stay are those of the sound ball: equal but for the rounding of a sum.
        expect_near(result.quality.volume / (size * size * size), closed.quality.volume, 1e-14);
    }
}

TEST(patches_that_were_rounded_one_by_one_become_one_surface)
{
    // Three of them meet in a corner. Either by 1e-6 of the side at most, or as far from the origin
    // as single precision of that size shows.
    uint64_t random = 7;
    for (int round = 0; round < 40; round++) {
        const double far = round % 2 == 0 ? 0.0 : 4000.0;
        MeshDraft draft = {0};
        for (int f = 0; f < 6; f++) {
            for (int k = 0; k < 4; k++) {
                Vec3 x = vec3_add(CUBE[CUBE_FACES[f][k]], vec3(far, far, far));
                x.x += 1e-7 * random_below(&random, 6) + far * 0x1p-24 * random_below(&random, 2);
                x.y += 1e-7 * random_below(&random, 6) - far * 0x1p-24 * random_below(&random, 2);
                mesh_draft_add_corner(&draft, draft.node_count, -1);
                mesh_draft_add_node(&draft, x);
            }
            mesh_draft_end_polygon(&draft, 0);
        }
        SCOPED(result_destroy) Result result = repair(&draft);
        assert_int_equal(result.mesh.node_count, 8);
        assert_int_equal(result.quality.border_loops, 0);
        // Six faces, each moved by as much as its nodes; far away 16 digits of a cube of 4000.
        expect_near(result.quality.volume, 1.0, far > 0.0 ? 6.0 * 5e-4 + 1e-4 : 6.0 * 5e-7);
    }
}

TEST(thin_parts_are_not_folded)
{
    // The two walls of a pouch without its rim, and the three of a book, 1e-7 apart. Whatever is
    // joined would lie on itself, or have three faces at an edge.
    for (int walls = 2; walls <= 3; walls++) {
        MeshDraft draft = {0};
        for (int w = 0; w < walls; w++) {
            const Vec3 *x = CUBE;
            for (int k = 0; k < 4; k++)
                mesh_draft_add_node(&draft, vec3(x[k].x, x[k].y, 1e-7 * w));
            FACE(&draft, 4 * w, 4 * w + 1, 4 * w + 2, 4 * w + 3);
        }
        SCOPED(result_destroy) Result result = repair(&draft);
        assert_int_equal(result.repairs.joined_edges, 0);
        assert_int_equal(result.quality.component_count, walls);
        assert_int_equal(result.mesh.node_count, 4 * walls);
    }
}

TEST(three_sheets_that_meet_in_a_line_stay_apart)
{
    const Vec3 x[12] = {{0, 0, 0},    {0, 0, 1},    {1, 0, 0},   {1, 0, 1},
                        {0, 1e-8, 0}, {0, 1e-8, 1}, {0, 1, 0},   {0, 1, 1},
                        {1e-8, 0, 0}, {1e-8, 0, 1}, {-1, -1, 0}, {-1, -1, 1}};
    MeshDraft draft = {0};
    add_nodes(&draft, x, 12);
    for (int s = 0; s < 12; s += 4)
        FACE(&draft, s, s + 2, s + 3, s + 1);
    SCOPED(result_destroy) Result result = repair(&draft);
    assert_int_equal(result.repairs.joined_edges, 0);
    assert_int_equal(result.quality.component_count, 3);
}

TEST(a_slit_is_left_and_named_and_joined_on_request)
{
    for (int asked = 0; asked < 2; asked++) {
        MeshDraft draft = seamed_ball(1e-3, 30.0);
        draft.weld = asked ? 0.031 : 0.0;
        SCOPED(result_destroy) Result result = repair(&draft);
        assert_int_equal(result.quality.border_loops, !asked);
        assert_int_equal(result.repairs.joined_edges, asked ? 2 * PARALLELS : 0);
        assert_int_equal(result.repairs.near_edges, asked ? 0 : 2 * PARALLELS);
        const double apart = asked ? result.repairs.joined_apart : result.repairs.near_apart;
        expect_near(apart, 0.03, 1e-14); // rounding of numbers of 30
    }
    // Not by any distance: edges of 12 with a gap of 6 are two edges.
    MeshDraft draft = seamed_ball(0.2, 30.0);
    draft.weld = 100.0;
    SCOPED(result_destroy) Result result = repair(&draft);
    assert_int_equal(result.quality.border_loops, 1);
    assert_int_equal(result.repairs.near_edges, 0);
}

TEST(a_strip_is_not_joined_to_one_that_has_one_side)
{
    enum { TURNS = 12 };
    MeshDraft draft = {0};
    for (int i = 0; i <= TURNS; i++)
        for (int side = -1; side <= 1; side += 2) {
            const double angle = 6.283185307179586 * i / TURNS, twist = 0.5 * angle;
            const double radius = 1.0 + 0.2 * side * cos(twist);
            mesh_draft_add_node(&draft, vec3(radius * cos(angle) + 1e-9 * (i == TURNS),
                                             radius * sin(angle), 0.2 * side * sin(twist)));
        }
    for (int i = 0; i < TURNS; i++)
        FACE(&draft, 2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1);
    SCOPED(result_destroy) Result result = repair(&draft);
    assert_int_equal(result.repairs.joined_edges, 0);
    assert_int_equal(result.quality.border_loops, 1);
    assert_int_equal(result.mesh.node_count, 2 * TURNS + 2);
}
