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

static void create_with(DetailBench *bench, MeshKind kind, SurfaceOptions *options, double much,
                        const ToolOptions *tool)
{
    TriMesh mesh;
    make_mesh(kind, &mesh);
    size_t nodes = (size_t)mesh.node_count;
    Vec3 *x = calloc(nodes, sizeof *x), *v = calloc(nodes, sizeof *v);
    deform(&mesh, much, x, v);
    options->initial_position = x;
    options->initial_velocity = v;
    bench_create(bench, BENCH_CUTTABLE, &mesh, options, tool, NULL);
    free(x);
    free(v);
}

static void create(DetailBench *bench, MeshKind kind, SurfaceOptions *options, double much)
{
    create_with(bench, kind, options, much, NULL);
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

// Again at once: how many more links break. If none, the state does not even know that it was
// asked.
static int count_repeated(DetailBench *bench, const CutOptions *options)
{
    uint64_t before = state_hash(&bench->state);
    CutOutcome outcome = cut(bench, options);
    if (outcome.separated == 0)
        assert_true(state_hash(&bench->state) == before);
    return outcome.separated;
}

static void random_cuts_keep_every_invariant(void **unused)
{
    (void)unused;
    uint64_t random = 20261;
    int severed = 0, most_pieces = 0, copies = 0, repeats = 0, cuts = 0;
    const char *wanted = getenv("PLIANT_TEST_CUTS");
    int sequences = wanted != NULL ? atoi(wanted) / 10 : EFFORT(20);
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
            assert_true(!cut_refuses(outcome.verdict) || outcome.verdict == CUT_TOO_TWISTED);
            severed += outcome.separated;
            cuts++;
            repeats += count_repeated(&bench, &last);
            expect_sound(&bench, &shape, 0);
            most_pieces = shape.pieces > most_pieces ? shape.pieces : most_pieces;
        }
        copies += (int)*bench.detail->cut->copies;
        assert_int_equal(sim_resets(bench.sim), 0);
        bench_destroy(&bench);
    }
    print_message("%d cuts: %d links severed, %d copies, at most %d pieces, %d links by repeats\n",
                  cuts, severed, copies, most_pieces, repeats);
    assert_true(severed > 10 * cuts);
    // Nodes that have moved onto the blade make it meet a few others (1 % here).
    assert_true(50 * repeats < severed);
}

// The most that can be said of a cut across the whole body, at rest.
static void a_whole_plane_makes_two_pieces_of_a_sphere(void **unused)
{
    (void)unused;
    uint64_t random = 5;
    for (int i = 0; i < EFFORT(12); i++) {
        SurfaceOptions options = cut_options(2, i % 3);
        options.adaptive = i % 2 == 0;
        DetailBench bench;
        create(&bench, SPHERE, &options, 0.0);
        Vec3 along = vec3_unit(random_vec3(&random));
        Vec3 forward = vec3_unit(vec3_cross(along, random_vec3(&random)));
        Vec3 middle = vec3_scale(0.02, random_vec3(&random));
        CutOptions plane = sweep_at(middle, along, forward, 0.3, 0.3);
        CutOutcome outcome = cut(&bench, &plane);
        assert_int_equal(outcome.verdict, CUT_DONE);
        assert_int_equal(outcome.pieces, 2);
        assert_int_equal(outcome.small_pieces, 0);
        WallShape shape;
        expect_sound(&bench, &shape, 0);
        assert_int_equal(shape.borders, 2);
        // Each node of one border has its copy on the other: nothing was deleted.
        assert_int_equal(shape.border_edges, 2 * outcome.separated);
        assert_int_equal(outcome.nodes_added, outcome.separated);
        bench_destroy(&bench);
    }
}

// 75 mm along the sphere of radius 50 mm, into a body of level 2; how long it takes is printed.
static void a_long_cut_opens_under_prestress(void **unused)
{
    (void)unused;
    SurfaceOptions options = cut_options(2, 0);
    DetailBench bench;
    create(&bench, SPHERE, &options, 0.0);
    // The blade reaches 0.03 m deep and turns about the middle of the sphere.
    double half = 0.75, longest = 0.0;
    for (int k = 0; k < 8; k++) {
        double at[2] = {-half + 2.0 * half * k / 8.0, -half + 2.0 * half * (k + 1) / 8.0};
        CutOptions sweep = {.body = 0};
        for (int end = 0; end < 2; end++) {
            double r = end == 0 ? 0.03 : 0.06;
            sweep.before.end[end] = vec3(r * sin(at[0]), 0.001, r * cos(at[0]));
            sweep.after.end[end] = vec3(r * sin(at[1]), 0.001, r * cos(at[1]));
        }
        clock_t begin = clock();
        CutOutcome outcome = cut(&bench, &sweep);
        double spent = (double)(clock() - begin) / CLOCKS_PER_SEC;
        longest = spent > longest ? spent : longest;
        assert_true(outcome.verdict == CUT_DONE);
    }
    WallShape shape;
    expect_sound(&bench, &shape, 0);
    assert_int_equal(shape.pieces, 1);
    assert_int_equal(shape.borders, 1);
    for (int k = 0; k < 500; k++)
        sim_step(bench.sim);
    assert_int_equal(sim_resets(bench.sim), 0);
    // How far copies are from their originals.
    double widest = 0.0;
    const DetailCut *state = bench.detail->cut;
    for (int c = 0; c < *state->copies; c++) {
        int pair[2] = {state->origin[c], state->base_count + c};
        Vec3 x[2];
        bench.body->ops->read_nodes(bench.model, pair, 2, x, NULL);
        widest = fmax(widest, vec3_length(vec3_sub(x[0], x[1])));
    }
    print_message("%lld copies, lips %.2f mm apart; the longest part took %.3f ms\n",
                  (long long)*state->copies, 1e3 * widest, 1e3 * longest);
    // Springs shortened by a tenth over a cut of 75 mm: millimetres.
    expect_at_least(widest, 1e-3);
    bench_destroy(&bench);
}

static Vec3 momentum_of_piece(const DetailBench *bench, int piece, double *mass, Vec3 *center)
{
    const Detail *detail = bench->detail;
    Vec3 sum = {0.0, 0.0, 0.0};
    *center = sum;
    *mass = 0.0;
    for (int i = 0; i < detail->node_count; i++) {
        if (detail->status[i] != NODE_FREE || detail->cut->node_piece[i] != piece)
            continue;
        Vec3 x, v;
        bench->body->ops->read_nodes(bench->model, &i, 1, &x, &v);
        sum = vec3_madd(sum, bench->model->mass[i], v);
        *center = vec3_madd(*center, bench->model->mass[i], x);
        *mass += bench->model->mass[i];
    }
    *center = vec3_scale(1.0 / *mass, *center);
    return sum;
}

// Shape springs on frames of their own: nothing holds the pieces together.
static void pieces_that_come_apart_move_apart(void **unused)
{
    (void)unused;
    for (int precision = 0; precision < 2; precision++) {
        SurfaceOptions options = cut_options(1, 0);
        options.shape.frame = SHAPE_BODY;
        options.precision = precision == 0 ? PRECISION_DOUBLE : PRECISION_SINGLE;
        TriMesh mesh;
        fixture_sphere(&mesh);
        Vec3 *v = calloc((size_t)mesh.node_count, sizeof *v);
        for (int i = 0; i < mesh.node_count; i++) // one half turns and rises, the other falls
            v[i] = mesh.position[i].z > 0.0
                       ? vec3(-3.0 * mesh.position[i].y, 3.0 * mesh.position[i].x, 0.4)
                       : vec3(0.0, 0.0, -0.4);
        options.initial_velocity = v;
        options.initial_position = mesh.position;
        DetailBench bench;
        bench_create(&bench, BENCH_CUTTABLE, &mesh, &options, NULL, NULL);
        free(v);
        CutOptions plane =
            sweep_at(vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), 0.3, 0.3);
        assert_int_equal(cut(&bench, &plane).pieces, 2);
        const int *piece = bench.detail->cut->piece;
        int number[2] = {0, -1}; // the lowest face is in one
        for (int f = 0; f < bench.detail->place_count; f++)
            number[1] = piece[f] != 0 ? piece[f] : number[1];
        double mass[2];
        Vec3 before[2], start[2], after[2], end[2];
        for (int k = 0; k < 2; k++)
            before[k] = momentum_of_piece(&bench, number[k], &mass[k], &start[k]);
        for (int i = 0; i < 400; i++)
            sim_step(bench.sim);
        assert_int_equal(sim_resets(bench.sim), 0);
        for (int k = 0; k < 2; k++) {
            after[k] = momentum_of_piece(&bench, number[k], &mass[k], &end[k]);
            // The frame's rest center and fit are good to rounding of forces of some newtons.
            expect_at_most(vec3_length(vec3_sub(after[k], before[k])),
                           (precision == 0 ? 1e-11 : 1e-4) * vec3_length(before[k]));
        }
        double gap = vec3_length(vec3_sub(end[1], end[0]));
        double was = vec3_length(vec3_sub(start[1], start[0]));
        // 0.4 s at the speeds that the pieces have; a few nodes at the border took the other's.
        Vec3 speed =
            vec3_sub(vec3_scale(1.0 / mass[1], before[1]), vec3_scale(1.0 / mass[0], before[0]));
        expect_near(gap, was + 0.4 * vec3_length(speed), precision == 0 ? 1e-3 : 2e-3);
        assert_true(gap > was + 0.2);
        WallShape shape;
        expect_sound(&bench, &shape, 0);
        bench_destroy(&bench);
    }
}

static const ToolOptions BLADE = {.id = 1,
                                  .kind = TOOL_BLADE,
                                  .edge = {{-0.2, 0.0, 0.0}, {0.2, 0.0, 0.0}},
                                  .max_force = 5.0,
                                  .friction = -1.0};

// Moves the blade along y from -0.1 m, `way` far in `ticks`, a little askew, and lifts it.
static void stroke(DetailBench *bench, double way, int ticks, double offset, double slant)
{
    double c = cos(0.5 * slant), s = sin(0.5 * slant);
    for (int tick = 0; tick <= ticks + 1; tick++) {
        ToolPose pose = {.position = {0.0, -0.1 + way * tick / ticks, offset},
                         .orientation = {c, 0.0, s, 0.0},
                         .active = tick <= ticks};
        sim_apply_pose(bench->sim, 0, &pose, true);
        sim_step(bench->sim);
    }
}

// --- the rule of nodes, edge by edge ---

static int break_edge(DetailBench *bench, int edge)
{
    CutOutcome outcome = {.verdict = CUT_MET_NOTHING};
    detail_begin_change(bench->model);
    assert_true(detail_cut_break(bench->model, &edge, 1, &outcome));
    detail_end_cut(bench->body);
    return outcome.nodes_added;
}

// The edge that goes on from `node` on the other side, as straight as a ring of six has it.
static int edge_opposite(const DetailBench *bench, int node, int edge)
{
    const Level *at = &bench->detail->cut->uncut;
    int face = at->edge_face[edge][0];
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            int e = at->face_edge[face][k];
            if (e != edge && (at->edge[e][0] == node || at->edge[e][1] == node)) {
                edge = e;
                break;
            }
        }
        face = levels_beyond(at, edge, face);
    }
    return edge;
}

static void one_broken_edge_opens_nothing_two_in_a_row_one_node(void **unused)
{
    (void)unused;
    for (int levels = 0; levels < 3; levels++) {
        SurfaceOptions options = cut_options(levels, 0);
        DetailBench bench;
        create(&bench, SPHERE, &options, 0.3);
        const Level *at = &bench.detail->cut->uncut;
        int edge = at->edge_count / 2, node = at->edge[edge][0];
        assert_int_equal(break_edge(&bench, edge), 0);
        WallShape shape;
        expect_sound(&bench, &shape, 0);
        assert_int_equal(shape.borders, 0);
        assert_int_equal(break_edge(&bench, edge_opposite(&bench, node, edge)), 1);
        expect_sound(&bench, &shape, 0);
        assert_int_equal(shape.borders, 1);
        assert_int_equal(shape.border_edges, 4);
        assert_int_equal(shape.pieces, 1);
        bench_destroy(&bench);
    }
}

// Any edges in any order: sums of mass and stiffness stay what they were, to rounding.
static void random_edges_keep_every_invariant(void **unused)
{
    (void)unused;
    uint64_t random = 15;
    for (int i = 0; i < EFFORT(8); i++) {
        SurfaceOptions options = cut_options(i % 2 + 1, i % 2 + 1);
        DetailBench bench;
        create(&bench, (MeshKind)(i % MESH_KINDS), &options, 0.5);
        const Level *at = &bench.detail->cut->uncut;
        double stiffness = wall_stiffness(&bench), mass = bench_mass(&bench);
        WallShape shape;
        for (int k = 0; k < 150; k++) {
            int edge = random_below(&random, at->edge_count);
            const int *face = at->edge_face[edge];
            bool inner = face[0] >= 0 && face[1] >= 0;
            for (int j = 0; j < 3 && inner; j++)
                inner = at->face_edge[face[0]][j] != edge ||
                        (bench.detail->cut->broken[face[0]] >> j & 1) == 0;
            if (!inner)
                continue;
            break_edge(&bench, edge);
            if (k % 10 == 0)
                expect_sound(&bench, &shape, 0);
        }
        // Thousands of additions in another order.
        expect_near(wall_stiffness(&bench), stiffness, 1e-12 * stiffness);
        expect_near(bench_mass(&bench), mass, 1e-12 * mass);
        bench_destroy(&bench);
    }
}

static void a_blade_through_moving_tissue_separates_it(void **unused)
{
    (void)unused;
    uint64_t random = 88;
    int cuts = EFFORT(12), most = 0, copies = 0;
    double slowest = 0.0;
    for (int i = 0; i < cuts; i++) {
        SurfaceOptions options = cut_options(1 + i % 3, 0);
        options.adaptive = i % 2 == 0;
        options.adapt.check_hz = 200.0;
        options.precision = i % 4 < 2 ? PRECISION_DOUBLE : PRECISION_SINGLE;
        options.shape.frame = i % 5 == 0 ? SHAPE_BODY : SHAPE_WORLD;
        bool half = i % 3 == 0;
        DetailBench bench;
        create_with(&bench, SPHERE, &options, random_between(&random, 0.0, 1.0), &BLADE);
        stroke(&bench, half ? 0.1 : 0.25, random_below(&random, 40) + 10,
               random_between(&random, -0.02, 0.02), random_between(&random, -0.4, 0.4));
        WallShape shape;
        expect_sound(&bench, &shape, 0);
        if (half)
            assert_int_equal(shape.pieces, 1);
        else
            assert_true(shape.pieces >= 2);
        assert_true(shape.borders > 0);
        assert_int_equal(sim_resets(bench.sim), 0);
        double spent =
            1e-3 * (double)sim_stage_ns(bench.sim, STAGE_CUT) / (double)sim_steps(bench.sim);
        slowest = spent > slowest ? spent : slowest;
        most = shape.pieces > most ? shape.pieces : most;
        copies += (int)*bench.detail->cut->copies;
        bench_destroy(&bench);
    }
    print_message("%d strokes: %d copies, at most %d pieces, at most %.0f us a tick\n", cuts,
                  copies, most, slowest);
}

static void what_does_not_fit_is_refused_and_changes_nothing(void **unused)
{
    (void)unused;
    TriMesh mesh;
    fixture_sphere(&mesh);
    for (int which = 0; which < 2; which++) {
        SurfaceOptions options = cut_options(2, 0);
        DetailBench bench;
        // Room for the body itself and a little more; nodes, then faces.
        options.node_capacity = which == 0 ? 130 : 0;
        options.face_capacity = which == 1 ? 240 : 0;
        create(&bench, SPHERE, &options, 0.3);
        CutOptions plane =
            sweep_at(vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), 0.3, 0.3);
        uint64_t before = state_hash(&bench.state);
        int topology = bench.body->mesh.topology;
        CutOutcome outcome = cut(&bench, &plane);
        assert_int_equal(outcome.verdict, which == 0 ? CUT_NO_NODES : CUT_NO_FACES);
        assert_true(outcome.needed > outcome.room && outcome.room > 0);
        assert_int_equal(outcome.separated, 0);
        assert_true(state_hash(&bench.state) == before);
        assert_int_equal(bench.body->mesh.topology, topology);
        bench_expect_sound(&bench);
        bench_destroy(&bench);
    }
    mesh_destroy(&mesh);
}

// A body at its finest level from the start takes as many copies as it has room for, no more.
static void copies_end_with_their_capacity(void **unused)
{
    (void)unused;
    uint64_t random = 77;
    SurfaceOptions options = cut_options(0, 0);
    DetailBench bench;
    create(&bench, SPHERE, &options, 0.0);
    CutOptions last = {.body = 0};
    WallShape shape;
    for (int i = 0; i < 60; i++) {
        last = random_sweep(&bench, &random, &last);
        cut(&bench, &last);
    }
    // Every corner of every face at most has a node of its own.
    assert_true(*bench.detail->cut->copies <= 3 * bench.detail->place_count - 114);
    expect_sound(&bench, &shape, 0);
    for (int k = 0; k < 50; k++)
        sim_step(bench.sim);
    assert_int_equal(sim_resets(bench.sim), 0);
    bench_destroy(&bench);
}

static void prepare_cut_body(DetailBench *bench, uint64_t *random, int levels)
{
    SurfaceOptions options = cut_options(levels, 0);
    options.adaptive = levels > 0;
    options.adapt.check_hz = 100.0;
    options.shape.frame = levels == 2 ? SHAPE_BODY : SHAPE_WORLD;
    create(bench, SPHERE, &options, 0.3);
    CutOptions last = {.body = 0};
    for (int i = 0; i < 4; i++) {
        last = random_sweep(bench, random, &last);
        cut(bench, &last);
        sim_step(bench->sim);
    }
}

static void a_cut_state_goes_on_elsewhere_with_the_same_bits(void **unused)
{
    (void)unused;
    for (int levels = 0; levels < 3; levels++) {
        uint64_t random = 9 + (uint64_t)levels, other = 1234;
        DetailBench whole, rest;
        prepare_cut_body(&whole, &random, levels);
        prepare_cut_body(&rest, &other, levels); // whatever it was before
        assert_true(*whole.detail->cut->copies > 5);
        void *block = malloc(state_bytes(&whole.state));
        state_copy_out(&whole.state, block);
        state_copy_in(&rest.state, block);
        sim_restored(rest.sim);
        assert_true(rest.body->ops->check(rest.model));
        assert_true(state_hash(&rest.state) == state_hash(&whole.state));
        WallShape shape;
        expect_sound(&rest, &shape, 0);
        assert_int_equal(rest.body->substeps, whole.body->substeps);
        DetailBench *both[2] = {&whole, &rest};
        uint64_t end[2];
        for (int k = 0; k < 2; k++) {
            CutOptions more =
                sweep_at(vec3(0.01, 0.0, 0.0), vec3(0.0, 0.6, 0.8), vec3(0.0, 0.8, -0.6), 0.3, 0.3);
            cut(both[k], &more);
            for (int i = 0; i < 100; i++)
                sim_step(both[k]->sim);
            end[k] = state_hash(&both[k]->state);
        }
        assert_true(end[0] == end[1]);
        free(block);
        bench_destroy(&whole);
        bench_destroy(&rest);
    }
}

static void a_reset_makes_it_whole_again(void **unused)
{
    (void)unused;
    uint64_t random = 31;
    SurfaceOptions options = cut_options(2, 0);
    DetailBench bench;
    create(&bench, SPHERE, &options, 0.0);
    for (int round = 0; round < 2; round++) {
        CutOptions last = {.body = 0};
        for (int i = 0; i < 4; i++) {
            last = random_sweep(&bench, &random, &last);
            cut(&bench, &last);
            sim_step(bench.sim);
        }
        assert_true(*bench.detail->cut->copies > 5);
        int topology = bench.body->mesh.topology;
        sim_reset(bench.sim);
        assert_int_equal(bench.body->mesh.topology, topology + 1);
        assert_int_equal(*bench.detail->cut->copies, 0);
        assert_int_equal(bench.body->mesh.node_count, 114);
        bench_expect_sound(&bench);
    }
    bench_destroy(&bench);
}

// Numbers of the state changed at random, as by a damaged file: found out, or harmless.
static void a_cut_that_no_run_can_have_made_is_refused(void **unused)
{
    (void)unused;
    for (int levels = 0; levels < 3; levels++) {
        uint64_t random = 19;
        DetailBench bench;
        prepare_cut_body(&bench, &random, levels);
        size_t bytes = state_bytes(&bench.state);
        unsigned char *good = malloc(bytes);
        state_copy_out(&bench.state, good);
        int refused = 0, tries = 0;
        for (int i = 0; i < bench.state.count; i++) {
            StateArray *array = &bench.state.array[i];
            const char *part = strchr(array->name, '/');
            if (part == NULL || (strcmp(part, "/broken") != 0 && strcmp(part, "/corners") != 0 &&
                                 strcmp(part, "/copies") != 0 && strcmp(part, "/rest") != 0))
                continue;
            for (int k = 0; k < EFFORT(60); k++) {
                unsigned char *byte = state_memory(array);
                size_t at = (size_t)(random_bits(&random) % array->bytes);
                byte[at] ^= (unsigned char)(1 + random_below(&random, 255));
                sim_restored(bench.sim);
                bool sound = bench.body->ops->check(bench.model);
                refused += !sound;
                tries++;
                for (int t = 0; t < 2 && sound; t++)
                    sim_step(bench.sim); // what was let in can be stepped on
                state_copy_in(&bench.state, good);
                sim_restored(bench.sim);
                assert_true(bench.body->ops->check(bench.model));
            }
        }
        print_message("%d of %d refused\n", refused, tries);
        assert_true(tries > 0 && refused > tries / 2);
        WallShape shape;
        expect_sound(&bench, &shape, 0);
        free(good);
        bench_destroy(&bench);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_cuts_keep_every_invariant),
        cmocka_unit_test(a_whole_plane_makes_two_pieces_of_a_sphere),
        cmocka_unit_test(one_broken_edge_opens_nothing_two_in_a_row_one_node),
        cmocka_unit_test(random_edges_keep_every_invariant),
        cmocka_unit_test(a_long_cut_opens_under_prestress),
        cmocka_unit_test(pieces_that_come_apart_move_apart),
        cmocka_unit_test(a_blade_through_moving_tissue_separates_it),
        cmocka_unit_test(what_does_not_fit_is_refused_and_changes_nothing),
        cmocka_unit_test(copies_end_with_their_capacity),
        cmocka_unit_test(a_cut_state_goes_on_elsewhere_with_the_same_bits),
        cmocka_unit_test(a_reset_makes_it_whole_again),
        cmocka_unit_test(a_cut_that_no_run_can_have_made_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
