// SPDX-License-Identifier: MIT
#include "detail_bench.h"

#include "mesh_check.h"
#include "random.h"
#include "scoped.h"

#include "base/check.h"
#include "surface/bending.h"

#include <stdlib.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

SurfaceOptions bench_options(int levels, int start_level)
{
    return (SurfaceOptions){
        .body.name = "body",
        .material = {.youngs_modulus_2d = 80.0, .areal_density = 4.2, .damping_time = 2e-4},
        .shape = {.wanted = true, .angular_frequency = 50.0, .damping_ratio = 0.1},
        .body.levels = levels,
        .start_level = start_level,
        .adapt = {.force = 0.005, .speed = 0.3, .curvature = 1.6, .check_hz = 1e-9},
        .body.integrator = INTEGRATOR_RK4,
        .body.precision = PRECISION_DOUBLE,
        .body.contact_ratio = 0.5,
        .body.contact_damping = 2e-4,
    };
}

void bench_create(DetailBench *bench, BenchKind kind, TriMesh *mesh, const SurfaceOptions *options,
                  const ToolOptions *tool, const LoadOptions *load)
{
    *bench = (DetailBench){.mesh = *mesh};
    *mesh = (TriMesh){0};
    Status status = {0};
    if (!levels_create(&bench->levels, &bench->mesh, options->body.levels, "body", &bench->arena,
                       &status))
        fail_msg("%s", status.text);
    SurfaceOptions own = *options;
    own.hierarchy = &bench->levels;
    own.adaptive = kind == BENCH_ADAPTIVE || (kind == BENCH_CUTTABLE && options->adaptive);
    own.body.cuttable = kind == BENCH_CUTTABLE;
    const TriMesh *from = &bench->mesh;
    if (kind == BENCH_DENSE) {
        levels_mesh(&bench->levels, options->start_level, &bench->mesh, &bench->dense);
        from = &bench->dense;
    }
    Body body;
    if (!surface_create(&body, from, &own, &bench->arena, &bench->state, &status))
        fail_msg("%s", status.text);
    SimOptions sim = {.rate_hz = 1000.0, .tool_timeout_s = 0.2, .may_load = true};
    bench->sim = sim_create(&sim, &bench->arena, &bench->state);
    bench->body = sim_add_body(bench->sim, &body);
    if (tool != NULL)
        sim_add_tool(bench->sim, tool);
    if (load != NULL)
        sim_add_load(bench->sim, load);
    if (!sim_seal(bench->sim, 0.0, &status))
        fail_msg("%s", status.text);
    bench->model = bench->body->model;
    bench->detail = bench->model->detail;
}

void bench_create_on(DetailBench *bench, BenchKind kind, void (*make)(TriMesh *),
                     const SurfaceOptions *options, const ToolOptions *tool,
                     const LoadOptions *load)
{
    TriMesh mesh;
    make(&mesh);
    bench_create(bench, kind, &mesh, options, tool, load);
}

void bench_destroy(DetailBench *bench)
{
    mesh_destroy(&bench->mesh);
    mesh_destroy(&bench->dense);
    state_destroy(&bench->state);
    arena_destroy(&bench->arena);
}

static int pick(const LeafSet *set, uint64_t *random, bool leaf, int *level)
{
    for (int tries = 0; tries < 1000; tries++) {
        *level = random_below(random, set->levels.finest);
        int face = random_below(random, set->levels.level[*level].face_count);
        if (leaf ? detail_is_leaf(set, *level, face)
                 : detail_is_refined(set, *level, face) && detail_may_coarsen(set, *level, face))
            return face;
    }
    return -1;
}

void bench_change_at_random(DetailBench *bench, uint64_t *random, int more)
{
    int level;
    bool divide = random_below(random, 10) < more;
    int face = pick(&bench->detail->set, random, divide, &level);
    if (face < 0)
        return;
    detail_begin_change(bench->model);
    if (divide)
        detail_refine(bench->model, level, face);
    else
        detail_coarsen(bench->model, level, face);
    assert_true(detail_end_change(bench->body));
}

// --- invariants ---

static int edge_of(const Level *level, int face, int k, int *across)
{
    int edge = level->face_edge[face][k];
    const int *sides = level->edge_face[edge];
    *across = sides[0] == face ? sides[1] : sides[0];
    return edge;
}

static void expect_balance(const Detail *detail)
{
    for (int l = 0; l <= detail->set.levels.finest; l++)
        for (int f = 0; f < detail->set.levels.level[l].face_count; f++) {
            if (!detail_exists(&detail->set, l, f))
                continue;
            if (detail_is_refined(&detail->set, l, f))
                for (int k = 0; k < 3; k++) { // what is across a refined face's edge exists
                    int across;
                    edge_of(&detail->set.levels.level[l], f, k, &across);
                    assert_true(across < 0 || detail_exists(&detail->set, l, across));
                }
        }
}

// Who is a corner of a leaf, found face by face; who hangs: a corner of leaves on one side of an
// edge of a leaf on the other.
static void expect_statuses(const DetailBench *bench)
{
    const Detail *detail = bench->detail;
    FREED unsigned char *on = calloc((size_t)detail->set.node_count, 1);
    FREED double *mass = calloc((size_t)detail->set.node_count, sizeof *mass);
    for (int l = 0; l <= detail->set.levels.finest; l++)
        for (int f = 0; f < detail->set.levels.level[l].face_count; f++)
            if (detail_is_leaf(&detail->set, l, f))
                for (int k = 0; k < 3; k++)
                    on[detail->set.levels.level[l].face[f][k]] = NODE_FREE;
    for (int l = 0; l < detail->set.levels.finest; l++)
        for (int f = 0; f < detail->set.levels.level[l].face_count; f++)
            if (detail_is_leaf(&detail->set, l, f))
                for (int k = 0; k < 3; k++) {
                    int middle = detail->set.levels.level[l].node_count +
                                 detail->set.levels.level[l].face_edge[f][k];
                    if (on[middle] && detail->set.constrained)
                        on[middle] = NODE_HANGING;
                }
    for (int i = 0; i < detail->set.node_count; i++)
        assert_int_equal(on[i], detail->set.status[i]);
    if (detail->set.constrained) {
        // Masses: thirds of the leaves, then those of hanging nodes to their masters, finest first.
        for (int l = 0; l <= detail->set.levels.finest; l++)
            for (int f = 0; f < detail->set.levels.level[l].face_count; f++)
                if (detail_is_leaf(&detail->set, l, f))
                    for (int k = 0; k < 3; k++)
                        mass[detail->set.levels.level[l].face[f][k]] +=
                            4.2 * level_rules_area(&detail->rules, l, f) / 3.0;
        for (int i = detail->set.node_count - 1; i >= 0; i--)
            if (on[i] == NODE_HANGING) {
                int parent[2];
                levels_parents(&detail->set.levels, i, parent);
                mass[parent[0]] += 0.5 * mass[i];
                mass[parent[1]] += 0.5 * mass[i];
                mass[i] = 0.0;
            }
        // A few additions in another order.
        for (int i = 0; i < detail->set.node_count; i++)
            if (on[i] == NODE_FREE)
                assert_true(fabs(mass[i] - bench->model->mass[i]) <= 1e-14 * mass[i]);
    }
}

static void expect_published(DetailBench *bench)
{
    const BodyMesh *mesh = &bench->body->mesh;
    FREED Vec3 *position = calloc((size_t)mesh->node_count, sizeof *position);
    FREED Vec3 *velocity = calloc((size_t)mesh->node_count, sizeof *velocity);
    bench->body->ops->read_state(bench->model, NULL, position, velocity);
    expect_crack_free(mesh, &bench->mesh, position);
}

// A broken edge whose ends still hold together has faces on both sides, and no hinge.
static bool is_broken_between(const DetailBench *bench, int face, int a, int b)
{
    const DetailCut *cut = bench->detail->set.cut;
    for (int k = 0; cut != NULL && k < 3; k++)
        if (cut->node[face][k] == a && cut->node[face][(k + 1) % 3] == b)
            return (cut->broken[face] >> k & 1) != 0;
    return false;
}

// As many hinges as triangles of different leaves meet: what clients draw has no cracks, so each of
// its edges belongs to one triangle or two.
static void expect_hinges(const DetailBench *bench)
{
    const BodySurface *surface = &bench->body->surface;
    const int finest = bench->detail->set.levels.finest;
    int count = 0;
    for (int f = 0; f < bench->detail->set.face_count; f++)
        for (int k = 0; k < 3 && surface->face[f][0] != surface->face[f][1]; k++) {
            const int other = surface->face_neighbor[f][k];
            if (other < f) // -1: a border
                continue;
            // Slots of triangles of one leaf have its number in common.
            bool same = false;
            for (int l = 0; l <= finest && !same; l++) {
                const int shift = 2 * (finest - l);
                same = f >> shift == other >> shift &&
                       detail_is_leaf(&bench->detail->set, l, f >> shift);
            }
            const int corner = surface->face[f][k], next = surface->face[f][(k + 1) % 3];
            count += !same && !is_broken_between(bench, f, corner, next);
        }
    assert_int_equal(count, bench->model->bending->hinge_count);
}

// What the kernel reads for every lane in use, and what contacts see, as one number.
static uint64_t mix(uint64_t hash, const void *data, size_t bytes)
{
    const unsigned char *byte = data;
    for (size_t i = 0; i < bytes; i++)
        hash = (hash ^ byte[i]) * UINT64_C(1099511628211);
    return hash;
}

static uint64_t hash_tables(const DetailBench *bench)
{
    const SurfaceModel *model = bench->model;
    const Detail *detail = bench->detail;
    const SpringTable *springs = &model->springs;
    size_t real = model_real_size(model);
    uint64_t hash = UINT64_C(14695981039346656037);
    for (int list = 0; list < 2; list++) {
        int count = list == 0 ? detail->lists.free_chunk_count : detail->lists.hanging_chunk_count;
        const int *chunks = list == 0 ? detail->lists.free_chunk : detail->lists.hanging_chunk;
        for (int i = 0; i < count; i++) {
            int chunk = chunks[i];
            hash = mix(hash, &chunk, sizeof chunk);
            hash = mix(hash, springs->own + (long)chunk * LANES, LANES * sizeof(int));
            for (int e = springs->start[chunk]; e < springs->end[chunk]; e++) {
                long at = (long)e * LANES;
                hash = mix(hash, springs->neighbour + at, LANES * sizeof(int));
                hash = mix(hash, (char *)springs->rest_length + (size_t)at * real, LANES * real);
                hash = mix(hash, (char *)springs->stiffness + (size_t)at * real, LANES * real);
            }
            hash = mix(hash, (char *)model->nodes.inverse_mass + (size_t)chunk * LANES * real,
                       LANES * real);
            if (model->nodes.rest != NULL)
                hash = mix(hash, (char *)model->nodes.rest + (size_t)chunk * 3 * LANES * real,
                           3 * LANES * real);
        }
    }
    const Bending *bending = model->bending;
    for (int i = 0; bending != NULL && i < bending->group_count; i++) {
        const long group = bending->group[i], values = bending->hinges.values;
        hash = mix(hash, bending->hinges.slot + 4 * LANES * group, 4 * LANES * sizeof(int));
        hash = mix(hash, (char *)bending->hinges.value + (size_t)(values * LANES * group) * real,
                   (size_t)(values * LANES) * real);
    }
    hash = mix(hash, detail->lists.hanging,
               (size_t)detail->lists.hanging_count * sizeof *detail->lists.hanging);
    hash = mix(hash, detail->lists.master,
               (size_t)detail->lists.hanging_count * sizeof *detail->lists.master);
    hash =
        mix(hash, bench->model->run, (size_t)bench->model->run_count * sizeof *bench->model->run);
    hash = mix(hash, model->basis.rest, (size_t)model->basis.count * sizeof *model->basis.rest);
    for (int p = 0; p < detail->set.face_count; p++)
        if (detail->faces.face[p][0] != detail->faces.face[p][1]) {
            hash = mix(hash, detail->faces.face[p], sizeof detail->faces.face[p]);
            hash = mix(hash, detail->faces.face_neighbor[p], sizeof detail->faces.face_neighbor[p]);
            hash = mix(hash, &detail->faces.face_area[p], sizeof(double));
        }
    for (int i = 0; i < detail->set.node_count; i++)
        hash = mix(hash, &detail->faces.node_face[detail->faces.node_face_start[i]],
                   (size_t)(detail->faces.node_face_end[i] - detail->faces.node_face_start[i]) *
                       sizeof(int));
    hash = mix(hash, detail->faces.node_area, (size_t)detail->set.node_count * sizeof(double));
    hash = mix(hash, &bench->body->lambda, sizeof(double));
    hash = mix(hash, &bench->body->damping, sizeof(double));
    hash = mix(hash, &bench->body->mass, sizeof(double));
    const BodyMesh *mesh = &bench->body->mesh;
    hash = mix(hash, mesh->triangle, (size_t)mesh->triangle_count * sizeof *mesh->triangle);
    hash = mix(hash, mesh->id, (size_t)mesh->node_count * sizeof *mesh->id);
    hash = mix(hash, mesh->origin, (size_t)mesh->node_count * sizeof *mesh->origin);
    hash = mix(hash, mesh->piece, (size_t)mesh->node_count * sizeof *mesh->piece);
    hash = mix(hash, mesh->level, (size_t)mesh->node_count * sizeof *mesh->level);
    return mix(hash, mesh->parent, (size_t)mesh->node_count * sizeof *mesh->parent);
}

void bench_expect_sound(DetailBench *bench)
{
    expect_balance(bench->detail);
    expect_statuses(bench);
    const DetailCut *cut = bench->detail->set.cut;
    if (cut == NULL || (*cut->copies == 0 && cut->gone_count == 0))
        expect_published(bench);
    if (bench->model->bending != NULL)
        expect_hinges(bench);
    uint64_t grown = hash_tables(bench), state = state_hash(&bench->state);
    detail_rebuild(bench->body);
    assert_true(hash_tables(bench) == grown);
    assert_true(state_hash(&bench->state) == state);
}

double bench_mass(const DetailBench *bench)
{
    double sum = 0.0;
    for (int i = 0; i < bench->detail->set.node_count; i++)
        sum += bench->detail->set.status[i] == NODE_FREE ? bench->model->mass[i] : 0.0;
    return sum;
}

Vec3 bench_momentum(const DetailBench *bench)
{
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int i = 0; i < bench->detail->set.node_count; i++)
        if (bench->detail->set.status[i] == NODE_FREE)
            sum = vec3_madd(sum, bench->model->mass[i], detail_velocity(bench->model, i));
    return sum;
}
