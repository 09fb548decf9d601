// Cuts of surface bodies through the simulation: on meshes that are refined, deformed and moving,
// with everything re-derived from scratch after each.
#include "wall_check.h"

#include "effort.h"
#include "expect.h"
#include "fixture.h"
#include "random.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef enum MeshKind { SPHERE, SHEET, MESH_KINDS } MeshKind;

static SurfaceOptions cut_options(int levels, int start_level)
{
    SurfaceOptions options = bench_options(levels, start_level);
    options.prestress = 0.1;
    return options;
}

static void make_mesh(MeshKind kind, TriMesh *mesh)
{
    if (kind == SPHERE)
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

static void create(DetailBench *bench, MeshKind kind, SurfaceOptions *options, double much)
{
    TriMesh mesh;
    make_mesh(kind, &mesh);
    size_t nodes = (size_t)mesh.node_count;
    Vec3 *x = calloc(nodes, sizeof *x), *v = calloc(nodes, sizeof *v);
    deform(&mesh, much, x, v);
    options->initial_position = x;
    options->initial_velocity = v;
    bench_create(bench, BENCH_CUTTABLE, &mesh, options, NULL, NULL);
    free(x);
    free(v);
}

static Vec3 random_node(const DetailBench *bench, uint64_t *random)
{
    for (;;) {
        int node = random_below(random, bench->detail->node_count);
        Vec3 x;
        if (bench->detail->status[node] == NODE_OFF)
            continue;
        bench->body->ops->read_nodes(bench->model, &node, 1, &x, NULL);
        return x;
    }
}

// A blade `length` wide that goes `way` far through a point, in any direction.
static CutOptions sweep_at(Vec3 middle, Vec3 along, Vec3 forward, double length, double way)
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
static CutOptions random_sweep(const DetailBench *bench, uint64_t *random, const CutOptions *last)
{
    Vec3 middle = random_node(bench, random), along = vec3_unit(random_vec3(random));
    Vec3 forward = vec3_unit(vec3_cross(along, random_vec3(random)));
    int kind = random_below(random, 8);
    if (kind == 0)
        return sweep_at(middle, along, forward, 0.5, 0.5);
    if (kind == 1)
        return sweep_at(middle, along, forward, 0.05, random_between(random, 1e-4, 5e-3));
    if (kind == 2) { // exactly along the line between two nodes
        Vec3 other = random_node(bench, random);
        CutOptions cut = {.body = 0};
        for (int k = 0; k < 2; k++) {
            Vec3 push = vec3_scale(k == 0 ? -0.02 : 0.02, along);
            cut.before.end[k] = vec3_add(middle, push);
            cut.after.end[k] = vec3_add(other, push);
        }
        return cut;
    }
    double length = random_between(random, 0.01, 0.1), way = random_between(random, 0.005, 0.12);
    CutOptions cut = sweep_at(middle, along, forward, length, way);
    if (kind == 3) // where the last one ended
        cut.before = last->after;
    if (kind == 4)
        cut.after.end[1] = vec3_madd(cut.after.end[1], 0.02, along);
    return cut;
}

static void expect_sound(DetailBench *bench, WallShape *shape, int handles)
{
    *shape = wall_expect_manifold(&bench->body->mesh, handles);
    assert_int_equal(shape->pieces, bench->detail->cut->piece_count);
    wall_expect_locked(bench);
    bench_expect_sound(bench);
    // Thousands of additions in another order; in single precision of rounded numbers.
    bool single = bench->detail->options.precision == PRECISION_SINGLE;
    double expected = wall_expected_stiffness(bench);
    expect_near(wall_stiffness(bench), expected, (single ? 1e-7 : 1e-12) * expected);
}

static CutOutcome cut(DetailBench *bench, const CutOptions *options)
{
    CutOutcome outcome;
    char why[256];
    double mass = bench_mass(bench);
    Vec3 momentum = bench_momentum(bench);
    sim_apply_cut(bench->sim, options, &outcome, why, sizeof why);
    expect_near(bench_mass(bench), mass, 1e-12 * mass);
    // Of nodes that move a metre a second or so; in single precision new ones get rounded means.
    double most = bench->detail->options.precision == PRECISION_SINGLE ? 1e-7 : 1e-12;
    expect_at_most(vec3_length(vec3_sub(bench_momentum(bench), momentum)), most * mass);
    return outcome;
}

// Again at once: nothing. The state does not even know that it was asked.
static int count_repeats(DetailBench *bench, const CutOptions *options)
{
    uint64_t before = state_hash(&bench->state);
    CutOutcome outcome = cut(bench, options);
    return outcome.separated != 0 || state_hash(&bench->state) != before;
}

static void random_cuts_keep_every_invariant(void **unused)
{
    (void)unused;
    uint64_t random = 20261;
    int severed = 0, most_pieces = 0, copies = 0, repeats = 0, cuts = 0;
    const char *wanted = getenv("PLIANT_TEST_CUTS");
    int sequences = wanted != NULL ? atoi(wanted) / 10 : EFFORT(40);
    for (int sequence = 0; sequence < sequences; sequence++) {
        SurfaceOptions options = cut_options(random_below(&random, 4), 0);
        options.start_level = random_below(&random, options.levels + 1);
        options.adaptive = options.levels > 0 && random_below(&random, 2) == 0;
        options.adapt.check_hz = 200.0;
        options.precision = random_below(&random, 2) == 0 ? PRECISION_DOUBLE : PRECISION_SINGLE;
        options.shape.frame = random_below(&random, 2) == 0 ? SHAPE_WORLD : SHAPE_BODY;
        DetailBench bench;
        create(&bench, (MeshKind)random_below(&random, MESH_KINDS), &options,
               random_between(&random, 0.0, 1.0));
        CutOptions last = {.body = 0};
        WallShape shape;
        for (int i = 0; i < 10; i++) {
            if (options.adaptive && options.levels > 0)
                for (int k = 0; k < 4; k++)
                    bench_change_at_random(&bench, &random, 6);
            int steps = random_below(&random, 6);
            for (int k = 0; k < steps; k++)
                sim_step(bench.sim);
            last = random_sweep(&bench, &random, &last);
            CutOutcome outcome = cut(&bench, &last);
            assert_false(cut_refuses(outcome.verdict));
            severed += outcome.separated;
            cuts++;
            repeats += count_repeats(&bench, &last);
            expect_sound(&bench, &shape, 0);
            most_pieces = shape.pieces > most_pieces ? shape.pieces : most_pieces;
        }
        copies += (int)*bench.detail->cut->copies;
        assert_int_equal(sim_resets(bench.sim), 0);
        bench_destroy(&bench);
    }
    print_message("%d cuts: %d links severed, %d copies, at most %d pieces, %d repeats changed\n",
                  cuts, severed, copies, most_pieces, repeats);
    assert_true(severed > 10 * cuts);
    assert_int_equal(repeats, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_cuts_keep_every_invariant),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
