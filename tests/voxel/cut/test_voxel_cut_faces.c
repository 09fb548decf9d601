// SPDX-License-Identifier: MIT
// What a cuttable voxel body shows: closed surfaces, in places that stay, the same from scratch as
// step by step.
#include "cut_bench.h"
#include "cut_sample.h"
#include "test.h"
#include "random.h"

static void make_box(CutBench *bench, int x, int y, int z, CutBenchOptions options)
{
    Lattice lattice;
    assert_true(lattice_box(&lattice, (int[3]){x, y, z}, 0.5, &(Status){0}));
    options.split_budget = options.split_budget == 0 ? 1000 : options.split_budget;
    options.face_capacity = 12 * x * y * z;
    cut_bench_create(bench, lattice, options);
}

// ---------------------------------------------------------------------------------------------
// Invariants

static Vec3 at_rest(const CutBench *bench, int vertex)
{
    const double *place = bench->vertices.rows.rest[vertex];
    return vec3(place[0], place[1], place[2]);
}

// The mesh encloses, piece by piece, the volume of the piece's cells; and its nodes are of one
// piece a triangle. As long as larger elements wait to be divided they hold pieces together: then
// this is true of the whole.
static void expect_volumes(const CutBench *bench)
{
    const BodyMesh *mesh = &bench->body.mesh;
    const bool whole = bench->cut.wanted_count > 0;
    const int pieces = whole ? 1 : (int)*bench->pieces.count;
    FREED double *volume = calloc((size_t)pieces, sizeof *volume);
    FREED int *cells = calloc((size_t)pieces, sizeof *cells);
    for (int c = 0; c < bench->cut.level_first[1]; c++)
        cells[whole ? 0 : cut_pieces_of(&bench->pieces, c)]++;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *node = mesh->triangle[t];
        Vec3 x[3];
        for (int k = 0; k < 3; k++) {
            assert_in_range(node[k], 0, mesh->node_count - 1);
            assert_true(whole || mesh->piece[node[k]] == mesh->piece[node[0]]);
            x[k] = at_rest(bench, bench->faces.slot_vertex[node[k]]);
        }
        volume[whole ? 0 : mesh->piece[node[0]]] += vec3_dot(x[0], vec3_cross(x[1], x[2])) / 6.0;
    }
    const double cell = bench->lattice.size * bench->lattice.size * bench->lattice.size;
    for (int p = 0; p < pieces; p++) // all numbers are exact in binary but for the sixths
        expect_near(volume[p], cell * cells[p], 1e-9 * bench->cut.level_first[1] * cell);
}

// Lists of faces around nodes say what the faces say.
static void expect_lists(const CutBench *bench)
{
    const BodySurface *surface = &bench->body.surface;
    long listed = 0;
    for (int v = 0; v < surface->node_used; v++) {
        const int start = surface->node_face_start[v], end = surface->node_face_end[v];
        listed += end - start;
        double area = 0.0;
        for (int k = start; k < end; k++) {
            const int *face = surface->face[surface->node_face[k]];
            assert_true(face[0] == v || face[1] == v || face[2] == v);
            assert_true(k == start || surface->node_face[k - 1] < surface->node_face[k]);
            area += body_face_area(surface, surface->node_face[k]) / 3.0;
        }
        expect_near(surface->node_area[v], area, 1e-12);
    }
    assert_int_equal(listed, 3L * surface->face_used);
}

static void expect_ids(const CutBench *bench)
{
    const BodyMesh *mesh = &bench->body.mesh;
    for (int i = 0; i < mesh->node_count; i++) {
        const int vertex = bench->faces.slot_vertex[i];
        assert_int_equal(mesh->id[i], bench->cut.vertex_id[vertex]);
        assert_int_equal(bench->faces.slot_of[vertex], i);
        const int points = (bench->cut.lattice_count[0] + 1) * (bench->cut.lattice_count[1] + 1) *
                           (bench->cut.lattice_count[2] + 1);
        assert_int_equal(mesh->origin[i] % points, mesh->id[i] % points);
    }
}

// A copy of all that follows from the state.
typedef struct Shown {
    BodySurface surface;
    BodyMesh mesh;
    void *bytes[16];
    size_t size[16];
    const void *from[16];
    int count;
} Shown;

static void keep(Shown *shown, const void *from, size_t size)
{
    const int k = shown->count++;
    assert_true(k < 16);
    shown->from[k] = from;
    shown->size[k] = size;
    shown->bytes[k] = malloc(size + 1);
    memcpy(shown->bytes[k], from, size);
}

static Shown keep_all(const CutBench *bench)
{
    const CutFaces *faces = &bench->faces;
    const size_t triangles = 2 * (size_t)*faces->shown, vertices = (size_t)faces->vertex_count;
    const size_t slots = (size_t)*faces->slot_count;
    Shown shown = {.surface = bench->body.surface, .mesh = bench->body.mesh};
    keep(&shown, faces->face, triangles * sizeof *faces->face);
    keep(&shown, faces->neighbor, triangles * sizeof *faces->neighbor);
    keep(&shown, faces->face_firmness, triangles * sizeof *faces->face_firmness);
    keep(&shown, faces->node_area, vertices * sizeof *faces->node_area);
    keep(&shown, faces->node_firmness, vertices * sizeof *faces->node_firmness);
    keep(&shown, faces->cell_of, vertices * sizeof *faces->cell_of);
    keep(&shown, faces->slot_of, vertices * sizeof *faces->slot_of);
    keep(&shown, faces->triangle, triangles * sizeof *faces->triangle);
    keep(&shown, faces->id, slots * sizeof *faces->id);
    keep(&shown, faces->origin, slots * sizeof *faces->origin);
    keep(&shown, faces->piece, slots * sizeof *faces->piece);
    keep(&shown, faces->parent, slots * sizeof *faces->parent);
    keep(&shown, bench->pieces.label, (size_t)bench->pieces.cell_count * sizeof(int));
    keep(&shown, bench->pieces.size, (size_t)*bench->pieces.count * sizeof(int));
    return shown;
}

static void expect_same(Shown *shown, const CutBench *bench)
{
    assert_int_equal(shown->surface.node_used, bench->body.surface.node_used);
    assert_int_equal(shown->surface.face_used, bench->body.surface.face_used);
    assert_int_equal(shown->mesh.node_count, bench->body.mesh.node_count);
    assert_int_equal(shown->mesh.triangle_count, bench->body.mesh.triangle_count);
    for (int k = 0; k < shown->count; k++) {
        assert_memory_equal(shown->bytes[k], shown->from[k], shown->size[k]);
        free(shown->bytes[k]);
    }
}

static void expect_same_from_scratch(CutBench *bench)
{
    Shown shown = keep_all(bench);
    const int small = bench->pieces.small_count;
    const int64_t broken = bench->faces.wall_count;
    assert_true(cut_pieces_derive(&bench->pieces));
    assert_true(cut_faces_derive(&bench->faces, &bench->body));
    expect_same(&shown, bench);
    assert_int_equal(small, bench->pieces.small_count);
    assert_int_equal(broken, bench->faces.wall_count);
}

static void expect_sound(CutBench *bench)
{
    cut_bench_expect_closed(&bench->body.surface, NULL);
    expect_volumes(bench);
    expect_lists(bench);
    expect_ids(bench);
    assert_int_equal(cut_bench_pieces(bench), (int)*bench->pieces.count);
    expect_same_from_scratch(bench);
}

// ---------------------------------------------------------------------------------------------

TEST(uncut_body_shows_its_outer_faces)
{
    for (int all = 0; all < 2; all++) {
        Lattice lattice;
        assert_true(lattice_ball(&lattice, 2.6, 0.5, &(Status){0}));
        SCOPED(cut_bench_destroy) CutBench bench;
        cut_bench_create(&bench, lattice,
                         (CutBenchOptions){.levels = 2, .split_budget = 4, .publish_all = all});
        const LatticeMesh *mesh = &bench.mesh;
        const BodySurface *surface = &bench.body.surface;
        assert_int_equal(surface->face_used, mesh->face_count);
        assert_int_equal(bench.body.mesh.triangle_count, mesh->face_count);
        assert_int_equal(bench.body.mesh.node_count,
                         all ? mesh->vertex_count : mesh->surface_count);
        const size_t bytes = (size_t)mesh->face_count * 3 * sizeof(int);
        assert_memory_equal(surface->face, mesh->face, bytes);
        assert_memory_equal(surface->face_neighbor, mesh->face_neighbor, bytes);
        assert_memory_equal(bench.body.mesh.triangle, mesh->face, bytes);
        for (int i = 0; i < bench.body.mesh.node_count; i++) {
            assert_int_equal(bench.body.mesh.id[i], mesh->id[i]);
            assert_int_equal(bench.body.mesh.origin[i], mesh->id[i]);
            assert_int_equal(bench.body.mesh.piece[i], mesh->piece[i]);
        }
        expect_sound(&bench);
    }
}

TEST(random_cuts_leave_closed_surfaces)
{
    uint64_t seed = 77;
    for (int run = 0; run < EFFORT(16); run++) {
        SCOPED(cut_bench_destroy) CutBench bench;
        make_box(&bench, 6 + random_below(&seed, 4), 8, 6 + random_below(&seed, 3),
                 (CutBenchOptions){.levels = run % 3,
                                   .split_budget = run % 2 ? 2 : 1000,
                                   .publish_all = run % 5 == 4});
        FREED int(*face)[2] = malloc(3 * (size_t)bench.cut.level_first[1] * sizeof *face);
        for (int cut = 0; cut < 8; cut++) {
            const int known = bench.body.mesh.node_count;
            FREED int *ids = malloc((size_t)known * sizeof *ids);
            memcpy(ids, bench.body.mesh.id, (size_t)known * sizeof *ids);
            const int before = bench.body.surface.face_used;
            const int count = cut_sample_random(&bench.cut, &seed, face);
            cut_bench_break(&bench, (const int(*)[2])face, count);
            expect_sound(&bench);
            // Nodes and faces keep their places.
            assert_memory_equal(ids, bench.body.mesh.id, (size_t)known * sizeof *ids);
            assert_true(bench.body.surface.face_used >= before);
        }
        cut_bench_settle(&bench);
        expect_sound(&bench);
        assert_int_equal(bench.body.surface.face_used,
                         bench.mesh.face_count + 2 * (int)bench.faces.wall_count);
    }
}

// Euler's number of a closed surface without handles is 2; a staircase through a box has none.
TEST(halves_of_a_box_are_spheres)
{
    uint64_t seed = 9;
    for (int run = 0; run < EFFORT(30); run++) {
        SCOPED(cut_bench_destroy) CutBench bench;
        make_box(&bench, 8, 8, 8, (CutBenchOptions){.levels = 2});
        FREED int(*face)[2] = malloc(3 * (size_t)bench.cut.level_first[1] * sizeof *face);
        const Vec3 middle = vec3_add(vec3(4.0, 4.0, 4.0), random_vec3(&seed));
        const int count = cut_sample_disc(&bench.cut, middle, random_vec3(&seed), 100.0, face);
        cut_bench_break(&bench, (const int(*)[2])face, count);
        cut_bench_settle(&bench);
        expect_sound(&bench);
        assert_int_equal(*bench.pieces.count, 2);
        const BodyMesh *mesh = &bench.body.mesh;
        int euler[2] = {0, 0};
        for (int i = 0; i < mesh->node_count; i++)
            euler[mesh->piece[i]]++;
        for (int t = 0; t < mesh->triangle_count; t++) // with half of three edges each
            euler[mesh->piece[mesh->triangle[t][0]]] -= t % 2;
        assert_int_equal(euler[0], 2);
        assert_int_equal(euler[1], 2);
    }
}

TEST(one_broken_face_opens_two_squares)
{
    SCOPED(cut_bench_destroy) CutBench bench;
    make_box(&bench, 6, 6, 6, (CutBenchOptions){.levels = 0});
    const int cell = cut_lattice_cell(&bench.cut, 2, 2, 2);
    const int before = bench.body.surface.face_used, nodes = bench.body.mesh.node_count;
    const int vertices = cut_lattice_used(&bench.cut);
    assert_true(cut_bench_break(&bench, (const int[1][2]){{cell, 1}}, 1));
    assert_int_equal(bench.body.surface.face_used, before + 4);
    assert_int_equal(bench.body.mesh.node_count, nodes + 4);
    assert_int_equal(cut_lattice_used(&bench.cut), vertices);
    // A second one beside it doubles nothing yet; four around a point do.
    const int beside = cut_lattice_cell(&bench.cut, 3, 2, 2);
    cut_bench_break(&bench, (const int[1][2]){{beside, 1}}, 1);
    assert_int_equal(cut_lattice_used(&bench.cut), vertices);
    const int more[2][2] = {{cut_lattice_cell(&bench.cut, 2, 2, 3), 1},
                            {cut_lattice_cell(&bench.cut, 3, 2, 3), 1}};
    cut_bench_break(&bench, more, 2);
    assert_int_equal(cut_lattice_used(&bench.cut), vertices + 1);
    assert_int_equal(bench.change.born_count, 0); // of the empty change after the division
    const int slot = bench.faces.slot_of[vertices];
    assert_true(slot >= 0);
    assert_int_not_equal(bench.body.mesh.origin[slot], bench.body.mesh.id[slot]);
    expect_sound(&bench);
}

TEST(capacity_is_known_before_anything_breaks)
{
    Lattice lattice;
    SCOPED(cut_bench_destroy) CutBench bench;
    assert_true(lattice_box(&lattice, (int[3]){4, 4, 4}, 1.0, &(Status){0}));
    const int outer = 6 * 16;
    cut_bench_create(&bench, lattice,
                     (CutBenchOptions){.split_budget = 10, .face_capacity = 2 * (outer + 20)});
    int needed, room;
    assert_true(cut_faces_has_room(&bench.faces, 10, &needed, &room));
    assert_false(cut_faces_has_room(&bench.faces, 11, &needed, &room));
    assert_int_equal(needed, 44);
    assert_int_equal(room, 40);
    int face[10][2];
    for (int k = 0; k < 10; k++)
        face[k][0] = cut_lattice_cell(&bench.cut, 1, k % 4, k / 4), face[k][1] = 0;
    cut_bench_break(&bench, (const int(*)[2])face, 10);
    assert_false(cut_faces_has_room(&bench.faces, 1, &needed, &room));
    assert_int_equal(room, 0);
    expect_sound(&bench);
}

// Bytes of a state that cannot be are told, and leave a body that can be looked at.
TEST(impossible_states_are_told)
{
    SCOPED(cut_bench_destroy) CutBench bench;
    make_box(&bench, 6, 6, 6, (CutBenchOptions){.levels = 1});
    FREED int(*face)[2] = malloc(3 * (size_t)bench.cut.level_first[1] * sizeof *face);
    uint64_t seed = 4;
    cut_bench_break(
        &bench, (const int(*)[2])face,
        cut_sample_disc(&bench.cut, vec3(3.1, 3.0, 3.0), vec3(1.0, 0.3, 0.2), 9.0, face));
    cut_bench_settle(&bench);
    CutFaces *faces = &bench.faces;
    const size_t bytes = state_bytes(&bench.state);
    FREED void *good = malloc(bytes);
    state_copy_out(&bench.state, good);
    int told = 0, tries = EFFORT(300);
    for (int t = 0; t < tries; t++) {
        state_copy_in(&bench.state, good);
        int *where[5] = {faces->square + random_below(&seed, (int)*faces->shown),
                         faces->slot_vertex + random_below(&seed, (int)*faces->slot_count),
                         faces->copied_from + random_below(&seed, faces->vertex_count),
                         bench.pieces.first + random_below(&seed, (int)*bench.pieces.count), NULL};
        int64_t *count[3] = {faces->shown, faces->slot_count, bench.pieces.count};
        const int which = random_below(&seed, 5);
        const int64_t value = (int64_t)random_bits(&seed) >> random_below(&seed, 63);
        bool same;
        if (where[which] != NULL) {
            same = *where[which] == (int)value;
            *where[which] = (int)value;
        } else {
            same = *count[t % 3] == value;
            *count[t % 3] = value;
        }
        assert_true(cut_lattice_derive(&bench.cut));
        const bool pieces = cut_pieces_derive(&bench.pieces);
        const bool sound = cut_faces_derive(faces, &bench.body) && pieces;
        if (which != 2) // copies of other vertices of the same point cannot be told
            assert_true(same || !sound);
        told += !sound;
        cut_bench_expect_closed(&bench.body.surface, NULL);
        expect_lists(&bench);
    }
    print_message("%d of %d told\n", told, tries);
    assert_true(told > tries / 2);
}

TEST(nodes_are_found_on_the_surface_only)
{
    for (int all = 0; all < 2; all++) {
        SCOPED(cut_bench_destroy) CutBench bench;
        make_box(&bench, 6, 6, 6, (CutBenchOptions){.levels = 0, .publish_all = all});
        FREED int *node = malloc((size_t)bench.cut.vertex_capacity * sizeof *node);
        const Region inside = {
            .kind = REGION_CAPSULE, .from = {1.5, 1.5, 1.5}, .to = {1.5, 1.5, 1.5}, .radius = 0.6};
        assert_int_equal(cut_faces_find_nodes(&bench.faces, &inside, node, 100), 0);
        const int cell = cut_lattice_cell(&bench.cut, 2, 2, 2);
        cut_bench_break(&bench, (const int[1][2]){{cell, 1}}, 1);
        assert_int_equal(cut_faces_find_nodes(&bench.faces, &inside, node, 100), 3);
    }
}
