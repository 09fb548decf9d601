// SPDX-License-Identifier: MIT
#include "wall_bench.h"

#include "expect.h"
#include "fixture.h"
#include "random.h"

#include "sim/follow.h"

SurfaceOptions wall_options(int levels, int start_level)
{
    SurfaceOptions options = bench_options(levels, start_level);
    options.prestress = 0.1;
    options.material.thickness = 0.002;
    return options;
}

static void make_mesh(WallMesh kind, TriMesh *mesh)
{
    if (kind == WALL_SPHERE)
        fixture_sphere(mesh);
    else
        fixture_sheet(mesh);
}

// The body swells along x, twists and moves, as far as level 0 can say it.
static void deform(const TriMesh *mesh, double much, Vec3 *x, Vec3 *v)
{
    for (int i = 0; i < mesh->node_count; i++) {
        Vec3 p = mesh->position[i];
        double turn = 8.0 * much * p.z;
        x[i] = vec3((1.0 + 0.3 * much) * (cos(turn) * p.x - sin(turn) * p.y),
                    sin(turn) * p.x + cos(turn) * p.y, p.z + 0.1 * much * sin(60.0 * p.x) * 0.1);
        v[i] = vec3_scale(much, vec3(0.3 * sin(50.0 * p.y) + 2.0 * p.y, -2.0 * p.x, 0.2));
    }
}

void wall_create_with(DetailBench *bench, WallMesh kind, SurfaceOptions *options, double much,
                      const ToolOptions *tool)
{
    TriMesh mesh;
    make_mesh(kind, &mesh);
    size_t nodes = (size_t)mesh.node_count;
    FREED Vec3 *x = calloc(nodes, sizeof *x), *v = calloc(nodes, sizeof *v);
    deform(&mesh, much, x, v);
    options->body.initial_position = x;
    options->body.initial_velocity = v;
    bench_create(bench, BENCH_CUTTABLE, &mesh, options, tool, NULL);
}

void wall_create(DetailBench *bench, WallMesh kind, SurfaceOptions *options, double much)
{
    wall_create_with(bench, kind, options, much, NULL);
}

Vec3 wall_random_node(const DetailBench *bench, uint64_t *random)
{
    for (;;) {
        int node = random_below(random, bench->detail->set.node_count);
        Vec3 x;
        if (bench->detail->set.status[node] == NODE_OFF)
            continue;
        bench->body->ops->read_nodes(bench->model, &node, 1, &x, NULL);
        return x;
    }
}

// A blade `length` wide that goes `way` far through a point, in any direction.
CutOptions wall_sweep_at(Vec3 middle, Vec3 along, Vec3 forward, double length, double way)
{
    Vec3 a = vec3_scale(0.5 * length, along), f = vec3_scale(0.5 * way, forward);
    CutOptions cut = {.body = 0};
    for (int k = 0; k < 2; k++) {
        Vec3 end = vec3_madd(middle, k == 0 ? -1.0 : 1.0, a);
        cut.before.end[k] = vec3_sub(end, f);
        cut.after.end[k] = vec3_add(end, f);
    }
    return cut;
}

// Whole planes, short and long cuts, sweeps exactly through nodes and along the line between two,
// sweeps that begin where the last one ended, twisted ones.
CutOptions wall_random_sweep(const DetailBench *bench, uint64_t *random, const CutOptions *last)
{
    Vec3 middle = wall_random_node(bench, random), along = vec3_unit(random_vec3(random));
    Vec3 forward = vec3_unit(vec3_cross(along, random_vec3(random)));
    int kind = random_below(random, 8);
    if (kind == 0)
        return wall_sweep_at(middle, along, forward, 0.5, 0.5);
    if (kind == 1)
        return wall_sweep_at(middle, along, forward, 0.05, random_between(random, 1e-4, 5e-3));
    if (kind == 2) { // exactly along the line between two nodes
        Vec3 other = wall_random_node(bench, random);
        CutOptions cut = {.body = 0};
        for (int k = 0; k < 2; k++) {
            Vec3 push = vec3_scale(k == 0 ? -0.02 : 0.02, along);
            cut.before.end[k] = vec3_add(middle, push);
            cut.after.end[k] = vec3_add(other, push);
        }
        return cut;
    }
    double length = random_between(random, 0.01, 0.1), way = random_between(random, 0.005, 0.12);
    CutOptions cut = wall_sweep_at(middle, along, forward, length, way);
    if (kind == 3) // where the last one ended
        cut.before = last->after;
    if (kind == 4)
        cut.after.end[1] = vec3_madd(cut.after.end[1], 0.02, along);
    return cut;
}

// Lips that followed cut by cut are those that the state gives.
static void expect_lips(DetailBench *bench)
{
    DetailCut *cut = bench->detail->set.cut;
    const DetailLips *lips = &cut->lips;
    const size_t nodes = (size_t)(cut->base_count + cut->copy_capacity);
    const int count = lips->count;
    FREED int *index = malloc((nodes + 1) * sizeof *index);
    FREED Lip *lip = malloc(((size_t)count + 1) * sizeof *lip);
    memcpy(index, lips->index, nodes * sizeof *index);
    memcpy(lip, lips->lip, (size_t)count * sizeof *lip);
    detail_lips_rebuild(bench->detail);
    assert_int_equal(lips->count, count);
    for (size_t i = 0; i < nodes; i++) {
        assert_int_equal(index[i] < 0, lips->index[i] < 0);
        if (index[i] >= 0)
            assert_memory_equal(&lip[index[i]], &lips->lip[lips->index[i]], sizeof *lip);
    }
    assert_true(detail_lips_check(&bench->detail->set));
}

void wall_expect_sound(DetailBench *bench, WallShape *shape, int handles)
{
    expect_lips(bench);
    *shape = wall_expect_manifold(&bench->body->mesh, handles);
    assert_int_equal(shape->pieces, bench->detail->set.cut->piece_count);
    wall_expect_locked(bench);
    bench_expect_sound(bench);
    // Thousands of additions in another order; in single precision of rounded numbers.
    bool single = bench->detail->options.body.precision == PRECISION_SINGLE;
    double expected = wall_expected_stiffness(bench);
    expect_near(wall_stiffness(bench), expected, (single ? 1e-7 : 1e-12) * expected);
}

void wall_read_row(const DetailBench *bench, int node, Vec3 *x, Vec3 *v)
{
    const SurfaceModel *model = bench->model;
    rows_read(&model->basis, model->rows[model->current], model->slot[node], x, v);
}

CutOutcome wall_cut(DetailBench *bench, const CutOptions *options)
{
    CutOutcome outcome;
    char why[256];
    double mass = bench_mass(bench);
    Vec3 momentum = bench_momentum(bench);
    sim_apply_cut(bench->sim, options, &outcome, why, sizeof why);
    expect_near(bench_mass(bench), mass, 1e-12 * mass);
    // Of nodes that move a metre a second or so; in single precision new ones get rounded means.
    double most = bench->detail->options.body.precision == PRECISION_SINGLE ? 1e-7 : 1e-12;
    expect_at_most(vec3_length(vec3_sub(bench_momentum(bench), momentum)), most * mass);
    return outcome;
}

static double area_present(const DetailBench *bench)
{
    double area = 0.0;
    for (int l = 0; l <= bench->detail->set.levels.finest; l++)
        for (int f = 0; f < bench->detail->set.levels.level[l].face_count; f++)
            if (detail_is_leaf(&bench->detail->set, l, f))
                area += level_rules_area(&bench->detail->rules, l, f);
    return area;
}

// In the world, where a removal counts.
static Vec3 world_momentum(const DetailBench *bench)
{
    Vec3 sum = vec3(0.0, 0.0, 0.0);
    for (int i = 0; i < bench->detail->set.node_count; i++) {
        Vec3 x, v;
        if (bench->detail->set.status[i] != NODE_FREE)
            continue;
        rows_read(&bench->model->basis, bench->model->rows[bench->model->current],
                  bench->model->slot[i], &x, &v);
        sum = vec3_madd(sum, bench->model->mass[i], v);
    }
    return sum;
}

typedef struct Removing {
    const Removal *removal;
    RemovalOutcome outcome;
} Removing;

static bool remove_once(Sim *sim, int b, void *context, TopologyChange *change)
{
    (void)b;
    Removing *removing = context;
    Body *body = &sim->body[0];
    return body->ops->remove(body, removing->removal, &removing->outcome, change);
}

RemovalOutcome wall_remove(DetailBench *bench, RemoverKind kind, const Region *mouth, double amount)
{
    const Removal removal = {.kind = kind,
                             .mouth = *mouth,
                             .volume = kind == REMOVER_DIATHERMY ? (double)INFINITY
                                                                 : amount * REMOVED_THICKNESS,
                             .heat = kind == REMOVER_DIATHERMY ? amount : 0.0,
                             .tick = 1e-3};
    Removing removing = {.removal = &removal};
    const double mass = bench_mass(bench), area = area_present(bench);
    const Vec3 momentum = world_momentum(bench);
    const uint64_t before = state_hash(&bench->state);
    change_body(bench->sim, 0, remove_once, &removing);
    const RemovalOutcome *went = &removing.outcome;
    if (went->removed == 0 && went->heat == 0.0)
        assert_true(state_hash(&bench->state) == before);
    // Sums of thousands of numbers; in single precision new nodes get rounded means.
    const double most = bench->detail->options.body.precision == PRECISION_SINGLE ? 1e-7 : 1e-12;
    expect_near(bench_mass(bench) + went->mass, mass, 1e-12 * mass);
    expect_near(area_present(bench) + went->area, area, 1e-12 * area);
    expect_at_most(vec3_length(vec3_sub(vec3_add(world_momentum(bench), went->momentum), momentum)),
                   most * mass);
    TissueAccount account;
    assert_int_equal(bench->body->ops->account(bench->model, &account, 1), 1);
    expect_near(account.attached + account.cut_off + account.removed, account.at_load,
                1e-12 * account.at_load);
    expect_near(account.attached + account.cut_off, area - went->area, 1e-12 * area);
    return *went;
}
