// SPDX-License-Identifier: MIT
#include "cut_bench.h"

#include "expect.h"

static void create_vertices(CutBench *bench)
{
    const int capacity = bench->cut.vertex_capacity;
    Vertices *vertices = &bench->vertices;
    vertices->count = capacity;
    vertices->rows = (Rows){.precision = PRECISION_DOUBLE,
                            .displaced = true,
                            .turned = true,
                            .count = capacity,
                            .rest_turn = QUAT_NONE,
                            .frame = &bench->frame,
                            .longest_edge = bench->lattice.size};
    bench->frame.turn = QUAT_NONE;
    vertices->rows.rest = calloc((size_t)capacity, sizeof *vertices->rows.rest);
    vertices->row[0] = calloc((size_t)capacity * ROW, sizeof(double));
    vertices->present = vertices->row[0];
    vertices->mass = calloc((size_t)capacity, sizeof *vertices->mass);
    double *inverse = calloc((size_t)capacity, sizeof *inverse);
    vertices->inverse_mass = inverse;
    for (int v = 0; v < capacity; v++)
        vertices->mass[v] = inverse[v] = 1.0;
}

static void place_vertices(CutBench *bench, int from)
{
    for (int v = from; v < cut_lattice_used(&bench->cut); v++) {
        int point[3];
        if (bench->cut.vertex_id[v] < 0)
            continue;
        cut_lattice_point(&bench->cut, v, point);
        for (int d = 0; d < 3; d++)
            bench->vertices.rows.rest[v][d] = bench->lattice.size * point[d];
    }
}

void cut_bench_create(CutBench *bench, Lattice lattice, CutBenchOptions options)
{
    Status status = {0};
    *bench = (CutBench){.lattice = lattice};
    layout_create(&bench->layout, &bench->lattice, options.levels);
    assert_true(lattice_mesh_create(&bench->mesh, &bench->layout, &status));
    const VoxelOptions body = {
        .body = {.name = "body", .levels = options.levels, .face_capacity = options.face_capacity},
        .lattice = &bench->lattice,
        .split_budget = options.split_budget,
        .publish_all = options.publish_all,
        .surface_level = options.surface_level,
    };
    const VoxelMaking making = {.options = &body,
                                .layout = bench->layout,
                                .mesh = bench->mesh,
                                .capacity = 8 * (int)lattice_solid(&bench->lattice)};
    assert_true(cut_lattice_create(&bench->cut, &making, &bench->arena, &bench->state, &status));
    create_vertices(bench);
    place_vertices(bench, 0);
    cut_pieces_create(&bench->pieces, &bench->cut, &making, &bench->arena, &bench->state);
    const int *n = bench->lattice.count;
    bench->masses =
        (CutMasses){.lattice = &bench->cut,
                    .vertices = &bench->vertices,
                    .held = arena_allocate(
                        &bench->arena, ARENA_TOPOLOGY,
                        (size_t)(n[0] + 1) * (size_t)(n[1] + 1) * (size_t)(n[2] + 1), 1, "held"),
                    .node_mass = bench->vertices.mass};
    assert_true(cut_faces_create(&bench->faces, &bench->pieces, &bench->masses, &making,
                                 &bench->body, &bench->arena, &bench->state, &status));
    cut_blades_create(&bench->blades, "body", &bench->cut, &bench->vertices.rows,
                      bench->lattice.size, &bench->arena);
    cut_blades_reserve(&bench->blades, "body", 1, &bench->arena, &bench->state);
    bench->start = malloc(state_bytes(&bench->state));
    state_copy_out(&bench->state, bench->start);
}

void cut_bench_destroy(CutBench *bench)
{
    free(bench->start);
    free(bench->vertices.rows.rest);
    free(bench->vertices.row[0]);
    free(bench->vertices.mass);
    free(bench->vertices.inverse_mass);
    arena_destroy(&bench->arena);
    state_destroy(&bench->state);
    lattice_mesh_destroy(&bench->mesh);
    layout_destroy(&bench->layout);
    lattice_destroy(&bench->lattice);
}

void cut_bench_reset(CutBench *bench)
{
    state_copy_in(&bench->state, bench->start);
    assert_true(cut_lattice_derive(&bench->cut));
    assert_true(cut_pieces_derive(&bench->pieces));
    assert_true(cut_faces_derive(&bench->faces, &bench->body));
    cut_blades_restored(&bench->blades);
    place_vertices(bench, 0);
    memset(bench->vertices.row[0], 0, (size_t)bench->cut.vertex_capacity * ROW * sizeof(double));
}

static void put_vertices(CutBench *bench, CutBenchShape *shape, const void *context, double rate)
{
    double *row = bench->vertices.row[0];
    for (int v = 0; v < cut_lattice_used(&bench->cut); v++, row += ROW) {
        const double *place = bench->vertices.rows.rest[v];
        const Vec3 rest = vec3(place[0], place[1], place[2]);
        const Vec3 u = vec3_sub(shape(context, rest), rest);
        const double now[3] = {u.x, u.y, u.z};
        for (int d = 0; d < 3; d++) {
            row[4 + d] = rate * (now[d] - row[d]);
            row[d] = now[d];
        }
    }
}

void cut_bench_shape(CutBench *bench, CutBenchShape *shape, const void *context)
{
    put_vertices(bench, shape, context, 0.0);
}

void cut_bench_move(CutBench *bench, CutBenchShape *shape, const void *context)
{
    put_vertices(bench, shape, context, 1.0 / CUT_BENCH_TICK);
}

// New vertices lie between those that they came from.
static void place_births(CutBench *bench)
{
    const CutChanges *changes = &bench->cut.changes;
    double *row = bench->vertices.row[0];
    for (int b = 0; b < changes->birth_count; b++) {
        const CutBirth *birth = &changes->birth[b];
        const int v = birth->vertex;
        place_vertices(bench, v);
        for (int d = 0; d < 3; d++) {
            double sum = 0.0;
            for (int k = 0; k < birth->parent_count; k++)
                sum += row[ROW * birth->parent[k] + d];
            row[ROW * v + d] = sum / birth->parent_count;
        }
    }
}

static bool follow(CutBench *bench, bool pieces_came)
{
    place_births(bench);
    bool changed = cut_faces_follow(&bench->faces, pieces_came, &bench->body, &bench->change);
    cut_lattice_forget_changes(&bench->cut);
    return changed;
}

bool cut_bench_break(CutBench *bench, const int (*face)[2], int count)
{
    int needed, room;
    assert_true(cut_faces_has_room(&bench->faces, count, &needed, &room));
    cut_lattice_break(&bench->cut, face, count);
    bool changed = follow(bench, cut_pieces_follow(&bench->pieces, face, count));
    cut_lattice_reconstruct(&bench->cut);
    return follow(bench, false) || changed;
}

int cut_bench_sweep(CutBench *bench, CutPhase phase, BladeEdge before, BladeEdge after)
{
    CutOutcome outcome = {0};
    if (phase == CUT_BEGINS)
        bench->stroke = (CutStroke){.under_way = 1};
    const CutSweep sweep = {.phase = phase,
                            .before = before,
                            .after = after,
                            .blade = phase == CUT_WHOLE ? -1 : 0,
                            .stroke = phase == CUT_WHOLE ? NULL : &bench->stroke};
    bool met =
        cut_blades_find(&bench->blades, bench->vertices.present, CUT_BENCH_TICK, &sweep, &outcome);
    if (met)
        cut_bench_break(bench, (const int(*)[2])bench->blades.hit, bench->blades.hit_count);
    else
        assert_in_range(outcome.verdict, CUT_MET_NOTHING, CUT_WAS_CUT);
    return outcome.separated;
}

void cut_bench_settle(CutBench *bench)
{
    while (cut_lattice_reconstruct(&bench->cut) > 0)
        follow(bench, false);
}

bool cut_bench_divide(CutBench *bench, int element)
{
    if (cut_lattice_divide(&bench->cut, &element, 1) > 0)
        follow(bench, false);
    return bench->cut.divided[element];
}

int cut_bench_merge(CutBench *bench, CutBenchShape *shape, const void *context)
{
    CutLattice *cut = &bench->cut;
    const CutChanges *changes = &cut->changes;
    double *row = bench->vertices.row[0];
    for (int e = cut->level_first[1]; e < cut->element_count; e++)
        if (cut_lattice_can_merge(cut, e))
            cut_lattice_merge(cut, e);
    place_vertices(bench, 0);
    for (int b = 0; b < changes->birth_count; b++) {
        const int v = changes->birth[b].vertex;
        const double *rest = bench->vertices.rows.rest[v];
        const Vec3 from = vec3(rest[0], rest[1], rest[2]);
        const Vec3 u = vec3_sub(shape(context, from), from);
        row[ROW * v] = u.x, row[ROW * v + 1] = u.y, row[ROW * v + 2] = u.z;
    }
    const int merged = changes->merged_count;
    cut_blades_follow(&bench->blades);
    cut_faces_follow(&bench->faces, false, &bench->body, &bench->change);
    cut_lattice_forget_changes(cut);
    return merged;
}

static bool broken_between(const CutLattice *cut, int cell, int axis)
{
    return cut->broken[cell] >> axis & 1;
}

int cut_bench_odd_loops(const CutBench *bench)
{
    const CutLattice *cut = &bench->cut;
    int odd = 0;
    for (int cell = 0; cell < cut->level_first[1]; cell++)
        for (int axis = 0; axis < 3; axis++) {
            const int a = (axis + 1) % 3, b = (axis + 2) % 3;
            const int right = cut_lattice_beyond(cut, cell, a),
                      up = cut_lattice_beyond(cut, cell, b);
            if (right < 0 || up < 0 || cut_lattice_beyond(cut, right, b) < 0)
                continue;
            odd += (broken_between(cut, cell, a) + broken_between(cut, cell, b) +
                    broken_between(cut, right, b) + broken_between(cut, up, a)) %
                   2;
        }
    return odd;
}

int cut_bench_dead_ends(const CutBench *bench)
{
    int count = 0;
    for (int cell = 0; cell < bench->cut.level_first[1]; cell++)
        for (int axis = 0; axis < 3; axis++)
            count += broken_between(&bench->cut, cell, axis) &&
                     cut_pieces_of(&bench->pieces, cell) ==
                         cut_pieces_of(&bench->pieces, cut_lattice_beyond(&bench->cut, cell, axis));
    return count;
}

int cut_bench_pieces(const CutBench *bench)
{
    const CutLattice *cut = &bench->cut;
    const int cells = cut->level_first[1];
    FREED int *label = malloc((size_t)cells * sizeof *label),
              *stack = malloc((size_t)cells * sizeof(int));
    int pieces = 0;
    memset(label, -1, (size_t)cells * sizeof *label);
    for (int first = 0; first < cells; first++) {
        if (label[first] >= 0)
            continue;
        int top = 0;
        stack[top++] = first;
        label[first] = pieces++;
        while (top > 0) {
            const int cell = stack[--top];
            const short *at = cut->element[cell].cell;
            assert_int_equal(cut_pieces_first(&bench->pieces, cell), first); // the lowest one
            for (int d = 0; d < 6; d++) {
                const int step = d & 1 ? 1 : -1, axis = d / 2;
                const int next =
                    cut_lattice_cell(cut, at[0] + step * (axis == 0), at[1] + step * (axis == 1),
                                     at[2] + step * (axis == 2));
                if (next < 0 || broken_between(cut, d & 1 ? cell : next, axis) || label[next] >= 0)
                    continue;
                label[next] = label[cell];
                stack[top++] = next;
            }
        }
    }
    return pieces;
}

void cut_bench_expect_closed(const BodySurface *surface, const int *square)
{
    for (int f = 0; f < surface->face_used; f++)
        for (int k = 0; k < 3; k++) {
            const int across = surface->face_neighbor[f][k];
            if (square != NULL && square[f / 2] < 0) {
                assert_true(across == -1 && surface->face[f][k] == 0);
                continue;
            }
            assert_in_range(across, 0, surface->face_used - 1);
            const int a = surface->face[f][k], b = surface->face[f][(k + 1) % 3];
            int back = -1;
            for (int j = 0; j < 3; j++)
                if (surface->face_neighbor[across][j] == f && surface->face[across][j] == b &&
                    surface->face[across][(j + 1) % 3] == a)
                    back = j;
            assert_true(back >= 0);
        }
}
