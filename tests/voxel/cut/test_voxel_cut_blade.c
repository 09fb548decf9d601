// SPDX-License-Identifier: MIT
// A blade that passes through a voxel body separates it and leaves no leak, whatever the body's
// shape and motion; one that stops halfway does not.
#include "cut_bench.h"
#include "effort.h"
#include "test.h"
#include "random.h"

#include "voxel/cut/cut_centre.h"

enum { LONG = 24, WIDE = 8 }; // the bar, in cells of 1 m

static void make_bar(CutBench *bench, int levels)
{
    Lattice lattice;
    assert_true(lattice_box(&lattice, (int[3]){LONG, WIDE, WIDE}, 1.0, &(Status){0}));
    cut_bench_create(bench, lattice,
                     (CutBenchOptions){.levels = levels,
                                       .split_budget = 16,
                                       .face_capacity = 40 * LONG * WIDE * WIDE});
}

// ---------------------------------------------------------------------------------------------
// Shapes

typedef struct Shape {
    int kind;
    double time;            // of the moving one
    double way, turn, wave; // a unit of time
    double noise;
} Shape;

enum { REST, BENT, TWISTED, MIRRORED, FLAT, LINE, NOISE, MOVING, KINDS };

static double hash(Vec3 p, int axis)
{
    uint64_t z = (uint64_t)(p.x * 73856093.0 + p.y * 19349663.0 + p.z * 83492791.0 + axis * 7919) +
                 UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return (double)(z >> 12) * 0x1p-51 - 1.0;
}

static Vec3 place(const void *context, Vec3 p)
{
    const Shape *shape = context;
    Vec3 x = vec3_sub(p, vec3(0.5 * LONG, 0.5 * WIDE, 0.5 * WIDE));
    double angle;
    switch (shape->kind) {
    case BENT: // a third of a circle
        angle = x.x / 12.0;
        return vec3((12.0 + x.y) * sin(angle), (12.0 + x.y) * cos(angle) - 12.0, x.z);
    case TWISTED:
        angle = 0.1 * x.x;
        return vec3(x.x, x.y * cos(angle) - x.z * sin(angle), x.y * sin(angle) + x.z * cos(angle));
    case MIRRORED:
        return vec3(-x.x, x.y, x.z);
    case FLAT:
        return vec3(x.x, x.y, 0.0);
    case LINE:
        return vec3(x.x, 0.0, 0.0);
    case NOISE:
        return vec3_add(x, vec3_scale(shape->noise, vec3(hash(p, 0), hash(p, 1), hash(p, 2))));
    case MOVING:
        angle = shape->turn * shape->time;
        x = vec3(x.x * cos(angle) - x.y * sin(angle), x.x * sin(angle) + x.y * cos(angle), x.z);
        x.y += shape->wave * sin(0.4 * x.x + shape->way * shape->time);
        x.z += shape->wave * sin(0.5 * x.x - 1.3 * shape->way * shape->time);
        x.x += shape->wave * cos(0.7 * x.y + shape->way * shape->time);
        return x;
    default:
        return x;
    }
}

// ---------------------------------------------------------------------------------------------
// Strokes

// An edge of `length` about a middle that moves along `way`, turning about it.
typedef struct Stroke {
    Vec3 middle, along, way;
    double length, from, to, twist; // [m], [m], rad
    int ticks;
} Stroke;

static BladeEdge edge_at(const Stroke *stroke, double t)
{
    const Vec3 side = vec3_cross(stroke->way, stroke->along);
    const double angle = stroke->twist * (t - 0.5);
    const Vec3 along =
        vec3_add(vec3_scale(cos(angle), stroke->along), vec3_scale(sin(angle), side));
    const Vec3 at =
        vec3_madd(stroke->middle, stroke->from + t * (stroke->to - stroke->from), stroke->way);
    return (BladeEdge){
        {vec3_madd(at, -0.5 * stroke->length, along), vec3_madd(at, 0.5 * stroke->length, along)}};
}

// Far beyond the bar, whose half diagonal is 13.3.
static Stroke random_stroke(uint64_t *seed, int least, int most)
{
    Stroke stroke = {.length = 60.0, .from = -30.0, .to = 30.0};
    stroke.middle = vec3(random_between(seed, -11.0, 11.0), random_between(seed, -3.0, 3.0),
                         random_between(seed, -3.0, 3.0));
    stroke.along = vec3_unit(random_vec3(seed));
    stroke.way = vec3_unit(vec3_cross(stroke.along, random_vec3(seed)));
    stroke.ticks = least + random_below(seed, most - least + 1);
    if (stroke.ticks >= 8 && random_below(seed, 2))
        stroke.twist = random_between(seed, -0.4, 0.4);
    return stroke;
}

// On planes of the lattice or of its centres, with ends there too.
static Stroke lattice_stroke(uint64_t *seed, int least, int most)
{
    Stroke stroke = {.length = 60.0, .from = -30.0, .to = 30.0};
    stroke.middle = vec3(0.5 * (random_below(seed, 45) - 22), 0.5 * (random_below(seed, 13) - 6),
                         0.5 * (random_below(seed, 13) - 6));
    const int axis = random_below(seed, 3), other = (axis + 1 + random_below(seed, 2)) % 3;
    *(&stroke.along.x + axis) = 1.0;
    *(&stroke.way.x + other) = random_below(seed, 2) ? 1.0 : -1.0;
    stroke.ticks = least + random_below(seed, most - least + 1);
    return stroke;
}

// A link that a stroke only just touches may be met twice, in neighbouring ticks of a twisted
// stroke or as tissue moves: then both its ends are on one side, and it is broken for nothing.
// Where tissue rests and the sweep is flat no link can be met twice.
typedef struct Count {
    int met, separated, more, shifted;
    int broken, dead; // links; dead ends among them
    int odd_flat;     // odd loops of flat sweeps through still tissue
} Count;

// Tick by tick; `shape` moves on by 1 over the stroke if it moves.
static int run(CutBench *bench, const Stroke *stroke, Shape *shape)
{
    int broken = cut_bench_sweep(bench, CUT_BEGINS, edge_at(stroke, 0.0), edge_at(stroke, 0.0));
    for (int k = 0; k < stroke->ticks; k++) {
        if (shape->kind == MOVING) {
            shape->time = (k + 1.0) / stroke->ticks;
            cut_bench_move(bench, place, shape);
        }
        broken += cut_bench_sweep(bench, CUT_GOES_ON, edge_at(stroke, (double)k / stroke->ticks),
                                  edge_at(stroke, (k + 1.0) / stroke->ticks));
    }
    cut_bench_sweep(bench, CUT_ENDS, edge_at(stroke, 1.0), edge_at(stroke, 1.0));
    return broken;
}

static void look(const CutBench *bench, int broken, bool flat, Count *count)
{
    const int pieces = cut_bench_pieces(bench);
    assert_int_equal(pieces, (int)*bench->pieces.count);
    count->met += broken > 0;
    count->separated += broken > 0 && pieces > 1;
    count->more += pieces > 2;
    count->broken += broken;
    count->dead += cut_bench_dead_ends(bench);
    count->odd_flat += flat ? cut_bench_odd_loops(bench) + cut_bench_dead_ends(bench) : 0;
    count->shifted += bench->stroke.tries > 0;
}

static Count try_shape(Shape shape, int strokes, bool aligned, int least, int most, uint64_t seed)
{
    SCOPED(cut_bench_destroy) CutBench bench;
    make_bar(&bench, 2);
    Count count = {0};
    for (int s = 0; s < strokes; s++) {
        cut_bench_reset(&bench);
        shape.time = 0.0;
        cut_bench_shape(&bench, place, &shape);
        const Stroke stroke =
            aligned ? lattice_stroke(&seed, least, most) : random_stroke(&seed, least, most);
        const int broken = run(&bench, &stroke, &shape);
        // A shift makes a bend in an edge that rested on centres.
        const bool flat = stroke.twist == 0.0 && shape.kind != MOVING && bench.stroke.tries == 0;
        look(&bench, broken, flat, &count);
    }
    return count;
}

static void expect_separation(Shape shape, bool aligned, int strokes, int least, int most)
{
    const Count count = try_shape(shape, strokes, aligned, least, most, 17 + (uint64_t)shape.kind);
    print_message("shape %d%s: %d met, %d separated, %d in more than two, %d shifted; %d broken, "
                  "%d dead ends\n",
                  shape.kind, aligned ? ", along the lattice" : "", count.met, count.separated,
                  count.more, count.shifted, count.broken, count.dead);
    assert_int_equal(count.separated, count.met);
    assert_int_equal(count.odd_flat, 0);
    // Few links lie along the sweep.
    expect_at_most(count.dead, 0.02 * count.broken);
    assert_true(count.met > strokes / 3 || shape.kind == LINE);
}

TEST(full_strokes_separate_still_bodies)
{
    for (int kind = REST; kind <= NOISE; kind++)
        expect_separation((Shape){.kind = kind, .noise = 0.8}, false, EFFORT(150), 1, 40);
}

TEST(full_strokes_along_the_lattice_separate)
{
    for (int kind = REST; kind <= FLAT; kind++)
        expect_separation((Shape){.kind = kind}, true, EFFORT(150), 1, 20);
}

// Tissue moves by up to about `speed` of what the blade does.
TEST(full_strokes_separate_moving_bodies)
{
    const double part[3] = {0.05, 0.26, 1.0};
    for (int k = 0; k < 3; k++)
        expect_separation(
            (Shape){.kind = MOVING, .turn = 2.0 * part[k], .way = 16.0 * part[k], .wave = 0.8},
            false, EFFORT(40), 20, 120);
}

TEST(half_strokes_leave_one_piece)
{
    SCOPED(cut_bench_destroy) CutBench bench;
    make_bar(&bench, 2);
    uint64_t seed = 5;
    for (int kind = REST; kind <= NOISE; kind++) {
        if (kind == FLAT || kind == LINE)
            continue; // one tick can pass through the whole of it
        Shape shape = {.kind = kind, .noise = 0.4};
        for (int s = 0; s < EFFORT(100); s++) {
            cut_bench_reset(&bench);
            cut_bench_shape(&bench, place, &shape);
            Stroke stroke = random_stroke(&seed, 1, 20);
            stroke.to = 0.0;
            stroke.twist = 0.0;
            // Across the bar, so that it ends inside; only once, where it is bent.
            while (kind == BENT && fabs(vec3_cross(stroke.along, stroke.way).x) < 0.8) {
                stroke.along = vec3_unit(random_vec3(&seed));
                stroke.way = vec3_unit(vec3_cross(stroke.along, random_vec3(&seed)));
            }
            stroke.middle = vec3(kind == BENT ? 0.0 : random_between(&seed, -6.0, 6.0), 0.0, 0.0);
            const int broken = run(&bench, &stroke, &shape);
            const int pieces = cut_bench_pieces(&bench);
            if (pieces != 1)
                fail_msg("kind %d, stroke %d: %d broken, %d pieces", kind, s, broken, pieces);
        }
    }
}

// ---------------------------------------------------------------------------------------------

static Stroke plane_between_layers(int ticks)
{
    return (Stroke){.middle = {0.3, 0.0, 0.0},
                    .along = {0.0, 0.0, 1.0},
                    .way = {0.0, 1.0, 0.0},
                    .length = 40.0,
                    .from = -10.0,
                    .to = 10.0,
                    .ticks = ticks};
}

TEST(plane_breaks_the_faces_of_one_layer)
{
    SCOPED(cut_bench_destroy) CutBench bench;
    make_bar(&bench, 2);
    Shape shape = {.kind = REST};
    const size_t cells = (size_t)bench.cut.level_first[1];
    FREED unsigned char *bits = malloc(cells);
    const int ticks[3] = {1, 7, 40};
    for (int through_centres = 0; through_centres < 2; through_centres++)
        for (int k = 0; k < 3; k++) {
            cut_bench_reset(&bench);
            cut_bench_shape(&bench, place, &shape);
            Stroke stroke = plane_between_layers(ticks[k]);
            stroke.middle.x = through_centres ? 0.5 : 0.3;
            const int broken = run(&bench, &stroke, &shape);
            assert_int_equal(cut_bench_pieces(&bench), 2);
            assert_int_equal(cut_bench_odd_loops(&bench), 0);
            // On centres the edge's ends are shifted, perhaps to two sides: steps by one layer.
            assert_in_range(broken, WIDE * WIDE, WIDE * (WIDE + 2 * through_centres));
            if (k > 0 && !through_centres)
                assert_memory_equal(bits, bench.cut.broken, cells);
            memcpy(bits, bench.cut.broken, cells);
        }
}

static int differing(const unsigned char *bits, const CutBench *bench)
{
    int count = 0;
    for (int c = 0; c < bench->cut.level_first[1]; c++)
        count += __builtin_popcount(bits[c] ^ bench->cut.broken[c]);
    return count;
}

// Ends of ticks are rounded to q: a centre within q of the sweep may change sides.
static void expect_alike(int differ, int faces)
{
    print_message("%d of %d faces differ\n", differ, faces);
    expect_at_most(differ, 2e-3 * faces);
}

TEST(command_breaks_what_a_stroke_breaks)
{
    SCOPED(cut_bench_destroy) CutBench bench;
    make_bar(&bench, 2);
    const size_t cells = (size_t)bench.cut.level_first[1];
    FREED unsigned char *bits = malloc(cells);
    uint64_t seed = 3;
    int differ = 0, faces = 0;
    for (int s = 0; s < EFFORT(60); s++) {
        Shape shape = {.kind = s % LINE, .noise = 0.4};
        Stroke stroke = random_stroke(&seed, 2, 20);
        stroke.twist = 0.0;
        const BladeEdge from = edge_at(&stroke, 0.0), to = edge_at(&stroke, 1.0);
        cut_bench_reset(&bench);
        cut_bench_shape(&bench, place, &shape);
        run(&bench, &stroke, &shape);
        memcpy(bits, bench.cut.broken, cells);
        cut_bench_reset(&bench);
        cut_bench_shape(&bench, place, &shape);
        faces += cut_bench_sweep(&bench, CUT_WHOLE, from, to);
        differ += differing(bits, &bench);
        // Once more breaks nothing.
        const int vertices = cut_lattice_used(&bench.cut);
        assert_int_equal(cut_bench_sweep(&bench, CUT_WHOLE, from, to), 0);
        assert_int_equal(cut_lattice_used(&bench.cut), vertices);
    }
    expect_alike(differ, faces);
}

// A twisted sweep is the same whether it comes in n ticks or in 2 n, since sub-ticks are powers of
// two.
TEST(twisted_stroke_is_the_same_in_twice_the_ticks)
{
    SCOPED(cut_bench_destroy) CutBench bench;
    make_bar(&bench, 0);
    const size_t cells = (size_t)bench.cut.level_first[1];
    FREED unsigned char *bits = malloc(cells);
    uint64_t seed = 11;
    int differ = 0, faces = 0;
    for (int s = 0; s < EFFORT(60); s++) {
        Shape shape = {.kind = REST};
        Stroke stroke = random_stroke(&seed, 1, 1);
        // 16 ticks of a quadrilateral that is straight in between.
        stroke.twist = s % 2 ? 0.3 : 0.1;
        const BladeEdge from = edge_at(&stroke, 0.0), to = edge_at(&stroke, 1.0);
        for (int twice = 0; twice < 2; twice++) {
            const int ticks = twice ? 32 : 16;
            cut_bench_reset(&bench);
            cut_bench_shape(&bench, place, &shape);
            int broken = 0;
            BladeEdge before = from;
            cut_bench_sweep(&bench, CUT_BEGINS, from, from);
            for (int k = 1; k <= ticks; k++) {
                BladeEdge after;
                for (int e = 0; e < 2; e++)
                    after.end[e] =
                        vec3_madd(from.end[e], (double)k / ticks, vec3_sub(to.end[e], from.end[e]));
                broken += cut_bench_sweep(&bench, CUT_GOES_ON, before, after);
                before = after;
            }
            differ += twice ? differing(bits, &bench) : 0;
            faces += broken;
            memcpy(bits, bench.cut.broken, cells);
        }
    }
    expect_alike(differ, faces);
}

TEST(planes_commute)
{
    SCOPED(cut_bench_destroy) CutBench bench;
    make_bar(&bench, 2);
    const size_t cells = (size_t)bench.cut.level_first[1];
    FREED unsigned char *bits = malloc(cells);
    FREED int *roots = malloc(cells * sizeof *roots);
    uint64_t seed = 23;
    for (int s = 0; s < EFFORT(60); s++) {
        Shape shape = {.kind = s % LINE};
        Stroke stroke[2];
        for (int k = 0; k < 2; k++) {
            stroke[k] = random_stroke(&seed, 1, 10);
            stroke[k].twist = 0.0;
        }
        for (int order = 0; order < 2; order++) {
            cut_bench_reset(&bench);
            cut_bench_shape(&bench, place, &shape);
            for (int k = 0; k < 2; k++)
                run(&bench, &stroke[k ^ order], &shape);
            for (int c = 0; c < (int)cells; c++) {
                const int root = cut_pieces_first(&bench.pieces, c);
                assert_true(order == 0 || root == roots[c]);
                roots[c] = root;
            }
            if (order == 1)
                assert_memory_equal(bits, bench.cut.broken, cells);
            memcpy(bits, bench.cut.broken, cells);
        }
    }
}

// Centres inside larger elements are those that a division gives.
TEST(division_moves_no_centre)
{
    SCOPED(cut_bench_destroy) CutBench bench;
    make_bar(&bench, 2);
    Shape shape = {.kind = NOISE, .noise = 0.3};
    cut_bench_shape(&bench, place, &shape);
    const int cells = bench.cut.level_first[1];
    FREED Vec3 *before = malloc((size_t)cells * sizeof *before);
    uint64_t seed = 2;
    double worst = 0.0;
    for (int round = 0; round < 20; round++) {
        CellCentres centres;
        cut_centres_begin(&centres, &bench.cut, &bench.vertices.rows, bench.vertices.present);
        for (int c = 0; c < cells; c++)
            before[c] = cut_centre(&centres, c);
        const int face[1][2] = {{random_below(&seed, cells), 0}};
        if (cut_lattice_beyond(&bench.cut, face[0][0], 0) < 0 || bench.cut.broken[face[0][0]] & 1)
            continue;
        cut_bench_break(&bench, face, 1);
        cut_bench_settle(&bench);
        cut_centres_begin(&centres, &bench.cut, &bench.vertices.rows, bench.vertices.present);
        for (int c = 0; c < cells; c++)
            worst = fmax(worst, vec3_length(vec3_sub(cut_centre(&centres, c), before[c])));
    }
    expect_at_most(worst, 1e-12); // a few roundings of places up to 24
}

// A bar with a bay along one of its edges, whose coarse elements are partly filled.
static void make_adapting_bar(CutBench *bench)
{
    Lattice lattice;
    assert_true(lattice_box(&lattice, (int[3]){LONG, WIDE, WIDE}, 1.0, &(Status){0}));
    for (int i = 0; i < LONG; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 1 + i % 3; k++)
                lattice.label[lattice_index(&lattice, i, j, k)] = 0;
    cut_bench_create(bench, lattice,
                     (CutBenchOptions){.levels = 2,
                                       .split_budget = 1,
                                       .face_capacity = 40 * LONG * WIDE * WIDE,
                                       .surface_level = 2});
}

TEST(division_of_partly_filled_elements_moves_no_centre)
{
    SCOPED(cut_bench_destroy) CutBench bench;
    make_adapting_bar(&bench);
    CutLattice *cut = &bench.cut;
    Shape shape = {.kind = NOISE, .noise = 0.3};
    while (cut_bench_merge(&bench, place, &shape) > 0)
        continue;
    cut_bench_shape(&bench, place, &shape);
    const int cells = cut->level_first[1];
    FREED Vec3 *before = malloc((size_t)cells * sizeof *before);
    uint64_t seed = 3;
    double worst = 0.0;
    int divided = 0, partly_filled = 0;
    for (int round = 0; round < 60; round++) {
        const int others = cut->element_count - cells, e = cells + random_below(&seed, others);
        if (!cut_lattice_is_leaf(cut, e))
            continue;
        CellCentres centres;
        cut_centres_begin(&centres, cut, &bench.vertices.rows, bench.vertices.present);
        for (int c = 0; c < cells; c++)
            before[c] = cut_centre(&centres, c);
        partly_filled += !cut->element[e].whole;
        divided += cut_bench_divide(&bench, e);
        cut_centres_begin(&centres, cut, &bench.vertices.rows, bench.vertices.present);
        for (int c = 0; c < cells; c++)
            worst = fmax(worst, vec3_length(vec3_sub(cut_centre(&centres, c), before[c])));
    }
    assert_true(divided > 10 && partly_filled > 2);
    expect_at_most(worst, 1e-12); // a few roundings of places up to 24
}

// Boxes of bricks are kept as long as nothing can have come near: what merging moves counts.
TEST(merging_counts_as_a_motion_of_centres)
{
    SCOPED(cut_bench_destroy) CutBench bench;
    make_adapting_bar(&bench);
    const Shape shape = {.kind = NOISE, .noise = 0.01};
    cut_bench_shape(&bench, place, &shape);
    const BladeEdge edge = {{{0.0, 5.0, -9.0}, {0.0, 5.0, 9.0}}};
    cut_bench_sweep(&bench, CUT_BEGINS, edge, edge);
    const int cells = bench.cut.level_first[1];
    FREED Vec3 *before = malloc((size_t)cells * sizeof *before);
    for (int level = 1; level <= 2; level++) {
        const double travel = bench.blades.blade[0].stroke->travel;
        CellCentres centres;
        cut_centres_begin(&centres, &bench.cut, &bench.vertices.rows, bench.vertices.present);
        for (int c = 0; c < cells; c++)
            before[c] = cut_centre(&centres, c);
        assert_true(cut_bench_merge(&bench, place, &shape) > 0);
        cut_centres_begin(&centres, &bench.cut, &bench.vertices.rows, bench.vertices.present);
        double worst = 0.0;
        for (int c = 0; c < cells; c++)
            worst = fmax(worst, vec3_length(vec3_sub(cut_centre(&centres, c), before[c])));
        assert_true(worst > 0.005); // it moves them indeed
        expect_at_most(worst, bench.blades.blade[0].stroke->travel - travel);
    }
}

TEST(blade_that_meets_nothing_says_so)
{
    SCOPED(cut_bench_destroy) CutBench bench;
    make_bar(&bench, 2);
    const BladeEdge far = {{{100.0, 0.0, 0.0}, {100.0, 1.0, 0.0}}},
                    farther = {{{100.0, 0.0, 5.0}, {100.0, 1.0, 5.0}}},
                    beyond = {{{1e12, 0.0, 0.0}, {1e12, 1.0, 0.0}}},
                    turned = {{{100.0, 1e3, 0.0}, {100.0, -1e3, 0.0}}};
    CutOutcome outcome;
    CutSweep sweep = {.phase = CUT_WHOLE, .before = far, .after = farther, .blade = -1};
    assert_false(cut_blades_find(&bench.blades, bench.vertices.present, 1e-3, &sweep, &outcome));
    assert_int_equal(outcome.verdict, CUT_MET_NOTHING);
    sweep.after = beyond;
    assert_false(cut_blades_find(&bench.blades, bench.vertices.present, 1e-3, &sweep, &outcome));
    assert_int_not_equal(outcome.verdict, CUT_DONE);
    sweep.after = turned;
    assert_false(cut_blades_find(&bench.blades, bench.vertices.present, 1e-3, &sweep, &outcome));
    assert_int_equal(outcome.verdict, CUT_TOO_TWISTED);
    const Stroke stroke = plane_between_layers(1);
    Shape shape = {.kind = REST};
    cut_bench_shape(&bench, place, &shape);
    sweep.before = edge_at(&stroke, 0.0), sweep.after = edge_at(&stroke, 1.0);
    assert_int_equal(cut_bench_sweep(&bench, CUT_WHOLE, sweep.before, sweep.after), WIDE * WIDE);
    assert_false(cut_blades_find(&bench.blades, bench.vertices.present, 1e-3, &sweep, &outcome));
    assert_int_equal(outcome.verdict, CUT_WAS_CUT);
}

// Its memory is part of the state: half an edge in it would not come back from a checkpoint.
TEST(stroke_that_begins_beyond_reach_leaves_nothing_behind)
{
    static const BladeStroke none = {0};
    SCOPED(cut_bench_destroy) CutBench bench;
    make_bar(&bench, 2);
    const BladeEdge half_out = {{{1.0, 1.0, 1.0}, {1e12, 0.0, 0.0}}};
    const CutSweep sweep = {
        .phase = CUT_BEGINS, .before = half_out, .after = half_out, .stroke = &bench.stroke};
    CutOutcome outcome;
    assert_false(cut_blades_find(&bench.blades, bench.vertices.present, 1e-3, &sweep, &outcome));
    assert_int_equal(outcome.verdict, CUT_TOO_LARGE);
    assert_memory_equal(bench.blades.blade[0].stroke, &none, sizeof none);
}

// What a file says of a stroke may be anything: it goes on, or begins anew.
TEST(any_memory_of_a_stroke_is_survived)
{
    SCOPED(cut_bench_destroy) CutBench bench;
    make_bar(&bench, 2);
    Shape shape = {.kind = BENT};
    uint64_t seed = 31;
    const BladeMemory *memory = &bench.blades.blade[0];
    for (int s = 0; s < EFFORT(200); s++) {
        cut_bench_reset(&bench);
        cut_bench_shape(&bench, place, &shape);
        const Stroke stroke = random_stroke(&seed, 4, 4);
        cut_bench_sweep(&bench, CUT_BEGINS, edge_at(&stroke, 0.4), edge_at(&stroke, 0.4));
        cut_bench_sweep(&bench, CUT_GOES_ON, edge_at(&stroke, 0.4), edge_at(&stroke, 0.45));
        unsigned char *bytes[3] = {(unsigned char *)memory->stroke,
                                   (unsigned char *)memory->centre[0],
                                   (unsigned char *)memory->box};
        const size_t size[3] = {sizeof *memory->stroke,
                                (size_t)bench.blades.cell_count * sizeof *memory->centre,
                                (size_t)bench.blades.brick_count * sizeof *memory->box};
        const int which = s % 3;
        for (int k = 0; k < 20; k++)
            bytes[which][random_bits(&seed) % size[which]] = (unsigned char)random_bits(&seed);
        cut_blades_restored(&bench.blades);
        CutOutcome outcome;
        const CutSweep sweep = {.phase = CUT_GOES_ON,
                                .before = edge_at(&stroke, 0.45),
                                .after = edge_at(&stroke, 0.5),
                                .stroke = &bench.stroke};
        cut_blades_find(&bench.blades, bench.vertices.present, 1e-3, &sweep, &outcome);
        assert_in_range(outcome.verdict, CUT_DONE, CUT_TOO_LARGE);
    }
}
