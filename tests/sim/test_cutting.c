// SPDX-License-Identifier: MIT
// Cuts in the pipeline, on a wall of links that the exact test breaks: strokes of blades from tick
// to tick, commands, what follows a change, and what is told of it.
#include "toy_body.h"
#include "sim/cutting.h"
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "random.h"

static const double CELL = 0.01; // [m]
enum { CELLS = 8 };              // a sheet of 0.08 m round the origin

// The blade stands across the sheet, its lower end at the tool's origin.
static const ToolOptions BLADE = {
    .id = 7, .kind = TOOL_BLADE, .edge = {{0, 0, 0}, {0, 0, 0.02}}, .max_force = 3.3};

static void create(ToyScene *scene, bool tears)
{
    toy_scene_create(scene, &(ToySceneOptions){.cells = CELLS,
                                               .cell = CELL,
                                               .rate_hz = 1000.0,
                                               .cuttable = true,
                                               .may_load = true,
                                               .tears = tears,
                                               .tool_count = 1,
                                               .tool = &BLADE});
}

// The blade's tip at (x, y), at once.
static void move_to(ToyScene *scene, double x, double y)
{
    put_tool(scene->sim, 0, (Vec3){x, y, -0.01});
    sim_step(scene->sim);
}

static void lift(ToyScene *scene)
{
    withdraw_tool(scene->sim, 0);
    sim_step(scene->sim);
}

// From one side of the sheet to the other in so many ticks, a little off its lattice.
static void cut_through(ToyScene *scene, int ticks)
{
    for (int i = 0; i <= ticks; i++)
        move_to(scene, 0.0013, -0.05 + 0.1 * i / ticks);
}

static bool next_event(ToyScene *scene, const char *kind, SimEvent *event)
{
    while (sim_take_event(scene->sim, event))
        if (strcmp(event->kind, kind) == 0)
            return true;
    return false;
}

// --- strokes ---

TEST(a_stroke_cuts_through_at_any_speed)
{
    // 0.1 m in one tick of 1 ms is 100 m/s, just below a jump; the other is 50 mm/s.
    SCOPED(toy_scene_destroy) ToyScene fast, slow;
    create(&fast, false);
    create(&slow, false);
    cut_through(&fast, 1);
    cut_through(&slow, 2000);
    assert_int_equal(toy_pieces(fast.toy[0]), 2);
    assert_int_equal(toy_pieces(slow.toy[0]), 2);
    // What a still body's cut is does not depend on how the way is divided, but for links whose
    // centre lies within a rounding of the plane: here none does.
    assert_memory_equal(fast.toy[0]->cuts->broken, slow.toy[0]->cuts->broken,
                        (size_t)fast.toy[0]->cuts->links);
    assert_int_equal(*fast.toy[0]->cuts->used, *slow.toy[0]->cuts->used);
}

// One stroke of an edge whose ends move evenly, in so many ticks, on a fresh sheet that is not
// flat.
static Toy *stroke_evenly(ToyScene *scene, const CutSweep *whole, int ticks)
{
    uint64_t random = 77;
    create(scene, false);
    for (int i = 0; i < *scene->toy[0]->cuts->used; i++)
        scene->toy[0]->position[i] =
            vec3_madd(scene->toy[0]->position[i], 0.2 * CELL, random_vec3(&random));
    CutStroke stroke = {.under_way = 1};
    BladeEdge before = whole->before;
    for (int t = 0; t <= ticks; t++) {
        CutSweep sweep = {
            .phase = t == 0 ? CUT_BEGINS : CUT_GOES_ON, .before = before, .stroke = &stroke};
        for (int k = 0; k < 2; k++)
            sweep.after.end[k] = vec3_madd(whole->before.end[k], (double)t / ticks,
                                           vec3_sub(whole->after.end[k], whole->before.end[k]));
        CutOutcome outcome = {0};
        TopologyChange change = {0};
        scene->body[0]->ops->cut(scene->body[0], &sweep, &outcome, &change);
        assert_false(cut_refuses(outcome.verdict));
        before = sweep.after;
    }
    return scene->toy[0];
}

TEST(a_twisted_stroke_does_not_depend_on_how_it_is_divided)
{
    uint64_t random = 5;
    int severed = 0, apart = 0;
    for (int i = 0; i < EFFORT(60); i++) {
        // An edge of 80 cells that turns by 0.3 or 1.2 rad about the way that it goes.
        double turn = i % 2 == 0 ? 0.3 : 1.2, half = 40.0 * CELL;
        double x = random_between(&random, -0.02, 0.02), lean = random_between(&random, -0.5, 0.5);
        CutSweep whole;
        for (int late = 0; late < 2; late++)
            for (int k = 0; k < 2; k++) {
                double angle = lean + (late - 0.5) * turn, side = k == 0 ? -half : half;
                (late ? &whole.after : &whole.before)->end[k] =
                    vec3(x + side * sin(angle), late ? 0.06 : -0.06, side * cos(angle));
            }
        SCOPED(toy_scene_destroy) ToyScene once, twice;
        const Toy *a = stroke_evenly(&once, &whole, 20), *b = stroke_evenly(&twice, &whole, 40);
        for (int link = 0; link < a->cuts->links; link++)
            apart += a->cuts->broken[link] != b->cuts->broken[link];
        severed += toy_broken(a);
        assert_true(toy_pieces(a) >= 2);
    }
    // Sub-ticks end in the same places but for the rounding to a thousandth of a cell: of a
    // thousand links one may lie that near.
    assert_true(severed > EFFORT(60) * 10);
    expect_at_most((double)apart, 2e-3 * severed);
}

TEST(each_tick_begins_where_the_last_one_ended)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    for (int i = 0; i < 5; i++)
        move_to(&scene, 0.001 * i, -0.05);
    lift(&scene);
    const ToyCall *call = scene.toy[0]->cuts->call;
    assert_int_equal(scene.toy[0]->cuts->calls, 6);
    assert_int_equal(call[0].sweep.phase, CUT_BEGINS);
    assert_int_equal(call[5].sweep.phase, CUT_ENDS);
    for (int i = 1; i < 5; i++) {
        assert_int_equal(call[i].sweep.phase, CUT_GOES_ON);
        assert_memory_equal(&call[i].sweep.before, &call[i - 1].sweep.after, sizeof(BladeEdge));
        assert_int_equal(call[i].sweep.blade, 0);
        expect_near(call[i].sweep.after.end[0].x, 0.001 * i, 0.0);
        expect_near(call[i].sweep.after.end[1].z, 0.01, 1e-15); // a rounding of the turned edge
    }
}

TEST(tissue_that_moves_past_a_resting_blade_is_cut)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    toy_move(scene.toy[0], vec3(0.0013, 0.06, 0.0));
    for (int i = 0; i < 120; i++) {
        move_to(&scene, 0.0, 0.0);
        toy_move(scene.toy[0], vec3(0.0, -0.001, 0.0));
    }
    assert_int_equal(toy_pieces(scene.toy[0]), 2);
}

TEST(a_lifted_blade_cuts_nothing_on_its_way)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    move_to(&scene, 0.0013, -0.05);
    // Lifted and put down again between two ticks.
    withdraw_tool(scene.sim, 0);
    move_to(&scene, 0.0013, 0.05);
    assert_int_equal(toy_broken(scene.toy[0]), 0);
    const CutPhase expected[] = {CUT_BEGINS, CUT_ENDS, CUT_BEGINS};
    assert_int_equal(scene.toy[0]->cuts->calls, 3);
    for (int i = 0; i < 3; i++)
        assert_int_equal(scene.toy[0]->cuts->call[i].sweep.phase, expected[i]);
}

TEST(a_blade_that_jumps_begins_another_stroke)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    move_to(&scene, 0.0013, -0.05);
    move_to(&scene, 0.0013, 0.051); // 101 m/s
    assert_int_equal(toy_broken(scene.toy[0]), 0);
    assert_int_equal(scene.toy[0]->cuts->call[2].sweep.phase, CUT_BEGINS);
}

TEST(a_stale_blade_ends_its_stroke)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    move_to(&scene, 0.0, -0.05);
    for (int i = 0; i < 300; i++) // tool_timeout_s is 0.2
        sim_step(scene.sim);
    int calls = scene.toy[0]->cuts->calls;
    assert_int_equal(scene.toy[0]->cuts->call[calls - 1].sweep.phase, CUT_ENDS);
    assert_in_range(calls, 200, 203);
}

TEST(a_restored_body_did_not_pass_the_blade)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    move_to(&scene, 0.0, -0.05);
    scene.toy[0]->cuts->bad = true;
    move_to(&scene, 0.0, -0.05);
    toy_move(scene.toy[0], vec3(0.0, 0.2, 0.0)); // as if it had jumped back
    move_to(&scene, 0.0, -0.05);
    assert_int_equal(toy_broken(scene.toy[0]), 0);
    assert_int_equal(scene.toy[0]->cuts->call[2].sweep.phase, CUT_ENDS);
    assert_int_equal(scene.toy[0]->cuts->call[3].sweep.phase, CUT_BEGINS);
}

TEST(a_scene_has_the_stages_that_it_needs)
{
    ToyScene scene;
    create(&scene, false);
    const StageId expected[] = {STAGE_INPUTS,   STAGE_TOOLS,       STAGE_LOADS,
                                STAGE_CUT,      STAGE_RECONSTRUCT, STAGE_FORCES,
                                STAGE_WRENCHES, STAGE_CHECK,       STAGE_SNAPSHOT};
    assert_int_equal(sim_stage_count(scene.sim), sizeof expected / sizeof *expected);
    for (int i = 0; i < sim_stage_count(scene.sim); i++)
        assert_int_equal(sim_stage(scene.sim, i), expected[i]);
    assert_string_equal(stage_name(STAGE_CUT), "cut");
    assert_string_equal(stage_name(STAGE_RECONSTRUCT), "reconstruct");
    toy_scene_destroy(&scene);
    // Nothing that cuts or tears: messages cut between two ticks.
    toy_scene_create(
        &scene,
        &(ToySceneOptions){
            .cells = 2, .cell = CELL, .rate_hz = 1000.0, .cuttable = true, .may_load = true});
    for (int i = 0; i < sim_stage_count(scene.sim); i++)
        assert_int_not_equal(sim_stage(scene.sim, i), STAGE_CUT);
    toy_scene_destroy(&scene);
}

// --- state ---

TEST(reset_in_a_stroke_returns_to_an_uncut_body)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    uint64_t start = state_hash(&scene.state);
    for (int i = 0; i < 50; i++)
        move_to(&scene, 0.0013, -0.05 + 0.001 * i);
    assert_true(toy_broken(scene.toy[0]) > 0);
    int topology = scene.body[0]->mesh.topology, calls = scene.toy[0]->cuts->calls;
    SimClock clock = *scene.sim->clock;
    sim_reset(scene.sim);
    assert_true(scene.body[0]->mesh.topology > topology);
    assert_int_equal(toy_broken(scene.toy[0]), 0);
    *scene.sim->clock = (SimClock){0}; // time goes on over a reset
    assert_true(state_hash(&scene.state) == start);
    *scene.sim->clock = clock;
    move_to(&scene, 0.0013, 0.05); // the other side: a new stroke
    assert_int_equal(scene.toy[0]->cuts->call[calls].sweep.phase, CUT_BEGINS);
    assert_int_equal(toy_broken(scene.toy[0]), 0);
}

TEST(a_checkpoint_in_a_stroke_goes_on_bit_for_bit)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    FREED void *image = malloc(state_bytes(&scene.state));
    uint64_t hash[2];
    for (int i = 0; i < 33; i++)
        move_to(&scene, 0.0013, -0.05 + 0.001 * i);
    state_copy_out(&scene.state, image);
    for (int run = 0; run < 2; run++) {
        for (int i = 33; i <= 100; i++)
            move_to(&scene, 0.0013, -0.05 + 0.001 * i);
        assert_int_equal(toy_pieces(scene.toy[0]), 2);
        hash[run] = state_hash(&scene.state);
        resume(&scene.state, scene.sim, image);
        assert_true(sim_check(scene.sim));
    }
    assert_true(hash[0] == hash[1]);
}

TEST(strokes_that_cannot_be_are_found)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, true);
    move_to(&scene, 0.0, -0.05);
    Stroke good = scene.sim->cutting->stroke[0][0], *stroke = &scene.sim->cutting->stroke[0][0];
    BodyCuts cuts = *scene.sim->cutting->cuts[0];
    assert_true(sim_check(scene.sim));
    stroke->cut.under_way = 2;
    assert_false(sim_check(scene.sim));
    *stroke = good;
    stroke->cut.tries = -1;
    assert_false(sim_check(scene.sim));
    *stroke = good;
    stroke->cut.edge.end[1].y = (double)NAN;
    assert_false(sim_check(scene.sim));
    *stroke = good;
    scene.sim->cutting->cuts[0]->reported_step = INT64_MAX;
    assert_false(sim_check(scene.sim));
    *scene.sim->cutting->cuts[0] = cuts;
    scene.sim->cutting->cuts[0]->pieces = -4;
    assert_false(sim_check(scene.sim));
}

// --- what follows ---

static double sum_of_loads(const ToyScene *scene, int *nodes)
{
    double sum = 0.0;
    *nodes = 0;
    for (int i = 0; i < *scene->toy[0]->cuts->used; i++) {
        sum += scene->toy[0]->load[i].z;
        *nodes += scene->toy[0]->load[i].z != 0.0;
    }
    return sum;
}

TEST(a_load_goes_on_to_act_on_both_lips)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    LoadOptions load = {.body = -1, .radius = 0.025, .force = {0, 0, 2.0}, .duration = 100.0};
    apply_well(sim_apply_load, scene.sim, &load);
    int before, after;
    expect_near(sum_of_loads(&scene, &before), 2.0, 1e-14);
    cut_through(&scene, 10);
    // Two dozen shares of one force, each within a rounding.
    expect_near(sum_of_loads(&scene, &after), 2.0, 1e-13);
    int in_patch = 0;
    for (int i = scene.toy[0]->base_nodes; i < *scene.toy[0]->cuts->used; i++)
        in_patch += vec3_length(scene.toy[0]->position[i]) <= load.radius;
    assert_true(in_patch >= 4);
    assert_int_equal(after, before + in_patch);
    // A force an area, the same everywhere.
    double pressure = 0.0;
    for (int i = 0; i < *scene.toy[0]->cuts->used; i++) {
        if (scene.toy[0]->load[i].z == 0.0)
            continue;
        double here = scene.toy[0]->load[i].z / scene.toy[0]->node_area[i];
        pressure = pressure == 0.0 ? here : pressure;
        expect_near(here / pressure, 1.0, 1e-13);
    }
}

TEST(every_change_has_a_topology_number_of_its_own)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    int start = scene.body[0]->mesh.topology;
    cut_through(&scene, 100);
    assert_true(scene.toy[0]->changes > 5);
    assert_int_equal(scene.body[0]->mesh.topology - start, scene.toy[0]->changes);
    assert_int_equal(scene.toy[0]->cuts->reconstructions, 101); // once a tick
}

// --- commands ---

static CutOptions sweep_at(double x)
{
    return (CutOptions){.body = 0,
                        .before = {{{x, -0.05, -0.01}, {x, -0.05, 0.01}}},
                        .after = {{{x, 0.05, -0.01}, {x, 0.05, 0.01}}}};
}

TEST(a_command_cuts_at_once_and_says_what)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    CutOutcome sum;
    char why[192];
    CutOptions cut = sweep_at(0.0013);
    assert_true(sim_apply_cut(scene.sim, &cut, &sum, why, sizeof why));
    assert_int_equal(sum.verdict, CUT_DONE);
    assert_int_equal(sum.separated, toy_broken(scene.toy[0]));
    assert_int_equal(sum.nodes_added, *scene.toy[0]->cuts->used - scene.toy[0]->base_nodes);
    assert_int_equal(sum.pieces, 2);
    assert_int_equal(sim_pieces(scene.sim, 0), 2);
    assert_non_null(strstr(why, "body 'wall': "));
    SimEvent event;
    assert_true(next_event(&scene, "piece", &event));
    assert_non_null(strstr(event.text, "in 2 pieces now, 1 more"));
    // The same again, and inside out.
    uint64_t hash = state_hash(&scene.state);
    for (int k = 0; k < 2; k++) {
        assert_false(sim_apply_cut(scene.sim, &cut, &sum, why, sizeof why));
        assert_int_equal(sum.verdict, CUT_WAS_CUT);
        assert_string_equal(why, "what the blade met of body 'wall' was cut already");
        BladeEdge turned = {{cut.after.end[1], cut.after.end[0]}};
        cut.after = (BladeEdge){{cut.before.end[1], cut.before.end[0]}};
        cut.before = turned;
    }
    assert_true(state_hash(&scene.state) == hash);
}

static void expect_refusal(ToyScene *scene, const CutOptions *cut, const char *text)
{
    CutOutcome sum;
    char why[192];
    uint64_t hash = state_hash(&scene->state);
    assert_false(sim_apply_cut(scene->sim, cut, &sum, why, sizeof why));
    assert_string_equal(why, text);
    assert_int_equal(sum.separated, 0);
    assert_true(state_hash(&scene->state) == hash);
}

TEST(commands_that_cannot_be_done_say_why_and_change_nothing)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    CutOptions cut = sweep_at(0.0013), good = cut;
    cut.before.end[1] = cut.before.end[0];
    cut.after.end[1] = cut.after.end[0];
    expect_refusal(&scene, &cut, "the blade has no length");
    cut = good;
    cut.after = cut.before;
    expect_refusal(&scene, &cut, "the sweep does not move");
    cut.after.end[0].z += 0.02;
    cut.after.end[1].z += 0.02;
    expect_refusal(&scene, &cut, "the sweep has no area: the blade moves along its own edge");
    cut = good;
    cut.before.end[0].y = (double)INFINITY;
    expect_refusal(&scene, &cut, "the sweep holds a number that is not finite");
    cut = sweep_at(0.2);
    expect_refusal(&scene, &cut, "the blade met no tissue of body 'wall'");
    cut = good;
    cut.after.end[0].x = 1e3;
    expect_refusal(&scene, &cut,
                   "the sweep is too twisted for body 'wall' (more than 64 parts): "
                   "cut in shorter steps");
    cut.after.end[0].x = cut.after.end[1].x = 1e9;
    expect_refusal(&scene, &cut, "the sweep reaches too far away from body 'wall'");
    scene.toy[0]->cuts->node_limit = scene.toy[0]->base_nodes + 3;
    cut = good;
    CutOutcome sum;
    char why[192], text[192];
    assert_false(sim_apply_cut(scene.sim, &cut, &sum, why, sizeof why));
    snprintf(text, sizeof text,
             "body 'wall' may need %d more nodes and has space for 3: raise capacity.nodes",
             sum.needed);
    assert_string_equal(why, text);
    assert_int_equal(toy_broken(scene.toy[0]), 0);
}

TEST(a_triangle_swept_by_one_fixed_end_cuts)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    CutOptions cut = sweep_at(0.0013);
    cut.before.end[1] = cut.before.end[0]; // a blade that grows
    cut.before.end[0].z = cut.before.end[1].z = 0.0;
    CutOutcome sum;
    char why[192];
    assert_true(sim_apply_cut(scene.sim, &cut, &sum, why, sizeof why));
}

// --- what is told ---

TEST(a_stroke_is_told_of_once_when_it_ends)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    cut_through(&scene, 100);
    SimEvent event;
    assert_true(sim_take_event(scene.sim, &event)); // when it came apart
    assert_string_equal(event.kind, "piece");
    assert_false(sim_take_event(scene.sim, &event));
    lift(&scene);
    assert_true(sim_take_event(scene.sim, &event));
    assert_string_equal(event.kind, "cut");
    assert_int_equal(event.body, 0);
    char text[192];
    snprintf(text, sizeof text,
             "tool 7, stroke ended: body 'wall': %d links severed, %d nodes added, 2 pieces",
             toy_broken(scene.toy[0]), *scene.toy[0]->cuts->used - scene.toy[0]->base_nodes);
    assert_string_equal(event.text, text);
    // A stroke that met nothing is not told of.
    move_to(&scene, 0.2, 0.0);
    lift(&scene);
    assert_false(sim_take_event(scene.sim, &event));
}

TEST(refused_strokes_are_told_of_once_a_second)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    scene.toy[0]->cuts->node_limit = scene.toy[0]->base_nodes + 1;
    int told = 0;
    for (int i = 0; i < 2500; i++) {
        move_to(&scene, 0.0013, i % 2 == 0 ? -0.049 : 0.05);
        for (SimEvent event; next_event(&scene, "cut_refused", &event); told++)
            assert_non_null(strstr(event.text, "tool 7: body 'wall' may need "));
    }
    assert_int_equal(told, 3);
    assert_int_equal(*scene.toy[0]->cuts->used, scene.toy[0]->base_nodes);
}

TEST(a_stroke_that_the_body_breaks_off_is_told_of_once)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, false);
    // The first half fits, the rest does not.
    scene.toy[0]->cuts->node_limit = scene.toy[0]->base_nodes + 8;
    cut_through(&scene, 100);
    SimEvent event;
    assert_false(next_event(&scene, "cut", &event));
    assert_true(toy_broken(scene.toy[0]) > 0);
    lift(&scene);
    assert_true(next_event(&scene, "cut", &event));
    char text[64];
    snprintf(text, sizeof text, ": %d links severed", toy_broken(scene.toy[0]));
    assert_non_null(strstr(event.text, text));
    assert_false(next_event(&scene, "cut", &event));
}

TEST(tears_are_told_of_a_few_times_a_second)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, true);
    int told = 0, links = scene.toy[0]->cuts->links;
    for (int i = 0; i < links + 300; i++) {
        scene.toy[0]->cuts->tear_next = i < links ? i : links;
        sim_step(scene.sim);
        for (SimEvent event; next_event(&scene, "tear", &event); told++)
            assert_non_null(strstr(event.text, "body 'wall': "));
    }
    assert_int_equal(toy_broken(scene.toy[0]), links);
    assert_int_equal(sim_pieces(scene.sim, 0), scene.toy[0]->faces);
    assert_in_range(told, 2, 2 + (links + 300) / 250);
    assert_int_equal(scene.sim->cutting->cuts[0]->torn, 0); // the last ones too
}

TEST(events_that_nobody_takes_do_not_pile_up)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, true);
    for (int i = 0; i < scene.toy[0]->cuts->links; i++) {
        scene.toy[0]->cuts->tear_next = i;
        sim_step(scene.sim);
    }
    int taken = 0;
    for (SimEvent event; sim_take_event(scene.sim, &event);)
        taken++;
    assert_in_range(taken, 1, SIM_EVENTS);
}
