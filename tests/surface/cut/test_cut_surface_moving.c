// SPDX-License-Identifier: MIT
// A blade that cuts tick by tick through a triangle surface that moves meanwhile.
#include "test.h"

#include "cut_blades.h"
#include "effort.h"
#include "random.h"

// How a body moves during a stroke, and the blade with its handle.
typedef struct Stroke {
    int ticks;
    double amount;                       // of the shape's bend
    Vec3 turn;                           // [rad] of the body over the stroke
    Vec3 drift;                          // [m] likewise
    double wave;                         // [m] amplitude of ripples, two periods
    Vec3 through, normal, along, across; // blade: its plane, its way, its edge
    double reach;                        // [m] half its way
    Vec3 blade_turn;                     // [rad] over the stroke: a twisted sweep
    int straights; // the edge's ends go along so many straight lines; 0: they turn evenly
} Stroke;

static void place_body(CutModel *model, const Stroke *stroke, double t)
{
    Quat turn = quat_from_rotation(vec3_scale(t, stroke->turn));
    for (int n = 0; n < model->node_count; n++) {
        Vec3 x = model->levels.position[model->origin[n]];
        x = cut_model_deformed(model, x, stroke->amount);
        x = vec3_madd(x, stroke->wave * sin(12.6 * t + 60.0 * x.x), vec3(0.3, -0.5, 0.8));
        model->x[n] = vec3_madd(quat_rotate(turn, x), t, stroke->drift);
    }
}

static BladeEdge edge_on_way(const Stroke *stroke, double t)
{
    Quat turn = quat_from_rotation(vec3_scale(t - 0.5, stroke->blade_turn));
    Vec3 half = vec3_scale(0.4, quat_rotate(turn, stroke->across));
    Vec3 middle = vec3_madd(stroke->through, (2.0 * t - 1.0) * stroke->reach, stroke->along);
    return (BladeEdge){{vec3_sub(middle, half), vec3_add(middle, half)}};
}

static BladeEdge edge_at(const Stroke *stroke, double t)
{
    if (stroke->straights == 0)
        return edge_on_way(stroke, t);
    double at = floor(t * stroke->straights), s = t * stroke->straights - at;
    BladeEdge from = edge_on_way(stroke, at / stroke->straights);
    BladeEdge to = edge_on_way(stroke, (at + 1.0) / stroke->straights);
    for (int end = 0; end < 2; end++)
        from.end[end] = vec3_madd(vec3_scale(1.0 - s, from.end[end]), s, to.end[end]);
    return from;
}

static Stroke random_stroke(const CutModel *model, double speed, uint64_t *seed)
{
    Stroke stroke = {.ticks = 10 + random_below(seed, 41),
                     .amount = random_between(seed, 0.0, 1.0),
                     .reach = 0.25};
    // Their share of the blade's 0.5 m.
    stroke.turn = vec3_scale(speed * 4.0, blade_direction(seed));
    stroke.drift = vec3_scale(speed * 0.1, blade_direction(seed));
    stroke.wave = speed * 0.01;
    stroke.through = vec3_scale(0.5, model->levels.position[random_below(seed, model->vertices)]);
    stroke.normal = blade_direction(seed);
    stroke.along = vec3_unit(vec3_cross(stroke.normal, blade_direction(seed)));
    stroke.across = vec3_cross(stroke.normal, stroke.along);
    return stroke;
}

// Runs the stroke up to time `until`, in ticks of 1 / ticks; how many links broke.
static int run(CutModel *model, const Stroke *stroke, double until)
{
    CutSweep sweep = {.phase = CUT_BEGINS, .after = edge_at(stroke, 0.0)};
    int broken = 0;
    for (int tick = 0; tick <= stroke->ticks && tick <= until * stroke->ticks; tick++) {
        double t = (double)tick / stroke->ticks;
        place_body(model, stroke, t);
        sweep.after = edge_at(stroke, t);
        broken += cut_model_stroke(model, &sweep);
        sweep.phase = CUT_GOES_ON;
        sweep.before = sweep.after;
    }
    CutTissue tissue = cut_model_tissue(model);
    sweep.phase = CUT_ENDS;
    assert_int_equal(cut_find_tick(&model->finder, &tissue, &sweep), CUT_MET_NOTHING);
    return broken;
}

TEST(a_blade_that_passes_through_moving_tissue_separates_it)
{
    // Of the tissue over that of the blade.
    const double speed[4] = {0.0, 0.02, 0.1, 0.4};
    for (int shape = 0; shape < CUT_SHAPES; shape++) {
        SCOPED(cut_model_destroy) CutModel model;
        cut_model_create(&model, (CutShape)shape);
        uint64_t seed = 21;
        int met = 0, more = 0;
        for (int trial = 0; trial < EFFORT(60); trial++) {
            cut_model_reset(&model, 0.0);
            Stroke stroke = random_stroke(&model, speed[trial % 4], &seed);
            int broken = run(&model, &stroke, 1.0);
            int pieces = cut_model_expect_sound(&model).pieces;
            // Whatever was met was met for good: on both sides of the blade's way there is matter.
            assert_true(broken == 0 || pieces >= 2);
            met += broken > 0;
            more += pieces > 2;
        }
        print_message("%s: %d strokes met tissue, %d made more than two pieces\n",
                      CUT_SHAPE_NAME[shape], met, more);
        assert_true(met > 0);
    }
}

// Links whose points the blade's edge meets exactly, at rest, in the grid of the integer points.
TEST(strokes_through_vertices_and_centroids_separate_too)
{
    SCOPED(cut_model_destroy) CutModel model;
    cut_model_create(&model, CUT_SHEET);
    uint64_t seed = 22;
    for (int trial = 0; trial < EFFORT(60); trial++) {
        cut_model_reset(&model, 0.0);
        int face = random_below(&seed, model.faces);
        bool upright = random_below(&seed, 2);
        Stroke stroke = {.ticks = 4 << random_below(&seed, 3), .reach = 0.128};
        stroke.through = trial % 2 ? blade_centroid(&model, face) : blade_corner(&model, face, 0);
        stroke.along = upright ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0);
        stroke.across = vec3(0.0, 0.0, 1.0);
        stroke.through =
            vec3(upright ? stroke.through.x : 0.0, upright ? 0.0 : stroke.through.y, 0.0);
        int broken = run(&model, &stroke, 1.0);
        int pieces = cut_model_expect_sound(&model).pieces;
        // Along the very border there may be nothing to meet.
        assert_true(broken == 0 ? pieces == 1 : pieces >= 2);
    }
}

TEST(a_blade_that_stops_inside_leaves_one_piece)
{
    SCOPED(cut_model_destroy) CutModel model;
    cut_model_create(&model, CUT_SPHERE);
    uint64_t seed = 23;
    int stopped = 0;
    for (int trial = 0; trial < EFFORT(24); trial++) {
        cut_model_reset(&model, 0.0);
        Stroke stroke = random_stroke(&model, trial % 2 ? 0.05 : 0.0, &seed);
        stroke.amount = 0.0;
        // The middle of the way lies within the sphere: some of it is still ahead.
        stroke.through = vec3_scale(0.5, stroke.through);
        stroke.drift = vec3(0.0, 0.0, 0.0);
        stopped += run(&model, &stroke, 0.5) > 0;
        assert_int_equal(cut_model_expect_sound(&model).pieces, 1);
    }
    assert_true(stopped > 0);
}

// A twisted sweep in n ticks and in 2 n: the sub-ticks are the same, and so are the links, but for
// those that the edge passes within the rounding of its places: 1/2048 of an edge's length.
TEST(twice_the_ticks_break_the_same_links)
{
    const double twist[2] = {0.3, 1.2}; // [rad]
    SCOPED(cut_model_destroy) CutModel model;
    cut_model_create(&model, CUT_SPHERE);
    uint64_t seed = 24;
    FREED unsigned char *bits = malloc((size_t)model.faces);
    int differ = 0, all = 0;
    for (int trial = 0; trial < EFFORT(16); trial++) {
        Stroke stroke = random_stroke(&model, 0.0, &seed);
        stroke.ticks = stroke.straights = 32;
        stroke.blade_turn = vec3_scale(twist[trial % 2], stroke.along);
        for (int twice = 0; twice < 2; twice++) {
            cut_model_reset(&model, 0.0);
            stroke.ticks *= twice + 1;
            run(&model, &stroke, 1.0);
            cut_model_expect_sound(&model);
            if (twice == 0)
                memcpy(bits, model.broken, (size_t)model.faces);
        }
        for (int f = 0; f < model.faces; f++) {
            differ += bits[f] != model.broken[f];
            all += bits[f] != 0;
        }
    }
    print_message("%d of %d faces differ\n", differ, all);
    expect_at_most((double)differ / all, 0.002);
}

// A stroke goes on the same after its state was copied out and in.
TEST(a_stroke_is_part_of_the_state)
{
    SCOPED(cut_model_destroy) CutModel model;
    cut_model_create(&model, CUT_TUBE);
    uint64_t seed = 25;
    Stroke stroke = random_stroke(&model, 0.1, &seed);
    stroke.ticks = 40;
    size_t bytes = state_bytes(&model.state);
    FREED void *half = malloc(bytes);
    FREED unsigned char *bits = malloc((size_t)model.faces), *before = malloc((size_t)model.faces);
    for (int again = 0; again < 2; again++) {
        if (!again)
            cut_model_reset(&model, 0.0);
        else
            memcpy(model.broken, before, (size_t)model.faces);
        if (again)
            state_copy_in(&model.state, half);
        assert_true(cut_find_check(&model.finder));
        for (int tick = again ? 20 : 0; tick <= 40; tick++) {
            CutSweep sweep = {.phase = tick ? CUT_GOES_ON : CUT_BEGINS,
                              .before = edge_at(&stroke, (tick ? tick - 1 : 0) / 40.0),
                              .after = edge_at(&stroke, tick / 40.0)};
            if (tick == 20 && !again) {
                state_copy_out(&model.state, half);
                memcpy(before, model.broken, (size_t)model.faces);
            }
            place_body(&model, &stroke, tick / 40.0);
            CutTissue tissue = cut_model_tissue(&model);
            if (cut_find_tick(&model.finder, &tissue, &sweep) == CUT_DONE)
                cut_model_break(&model);
        }
        if (!again)
            memcpy(bits, model.broken, (size_t)model.faces);
    }
    assert_memory_equal(bits, model.broken, (size_t)model.faces);
    model.finder.memory[0].points[7].middle[1].x[2] = INT64_MIN;
    assert_false(cut_find_check(&model.finder));
}
