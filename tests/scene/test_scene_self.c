// SPDX-License-Identifier: MIT
// A body that touches itself: the pieces that it is cut into, and the lips of a cut.
#include "test.h"
#include "effort.h"
#include "touching_bodies.h"

#define SELF(more) "touch = ( { bodies = [\"one\"]; " more " } );\n"

// Marks the nodes that are connected by faces with a node.
static void spread(const Shell *shell, int from, bool *mark)
{
    mark[from] = true;
    for (bool again = true; again;) {
        again = false;
        for (int f = 0; f < shell->faces; f++) {
            const int *c = shell->face[f];
            if (is_face(shell, f) && (mark[c[0]] || mark[c[1]] || mark[c[2]]) &&
                !(mark[c[0]] && mark[c[1]] && mark[c[2]]))
                again = mark[c[0]] = mark[c[1]] = mark[c[2]] = true;
        }
    }
}

// The surface of what is connected with the lowest (or highest) node.
static Shell piece_of(Run *run, bool highest)
{
    Shell shell = shell_of(run, 0);
    int(*face)[3] = calloc((size_t)shell.faces + 1, sizeof *face), count = 0, from = -1;
    bool *mark = calloc((size_t)shell.nodes, sizeof *mark);
    for (int i = 0; i < shell.nodes; i++)
        if (shell.used[i] && (from < 0 || (shell.x[i].z > shell.x[from].z) == highest))
            from = i;
    spread(&shell, from, mark);
    for (int f = 0; f < shell.faces; f++)
        if (is_face(&shell, f) && mark[shell.face[f][0]])
            memcpy(face[count++], shell.face[f], sizeof *face);
    free(shell.used);
    shell.used = mark;
    shell.face = (const int(*)[3])face;
    shell.faces = count;
    return shell;
}

static void piece_free(Shell *shell)
{
    free((void *)shell->face);
    shell_free(shell);
}

static void cut(Run *run, Vec3 a, Vec3 b, Vec3 way)
{
    const CutOptions cut = {
        .body = 0, .before = {{a, b}}, .after = {{vec3_add(a, way), vec3_add(b, way)}}};
    CutOutcome sum = {0};
    apply_well(sim_apply_cut, run->world.sim, &cut, &sum);
}

static void step(Run *run, int ticks)
{
    sim_ticks(run->world.sim, ticks);
}

static double highest_speed(Run *run)
{
    const Body *body = sim_body(run->world.sim, 0);
    double most = 0.0;
    for (int i = 0; i < body->surface.node_count; i++) {
        Vec3 x, v;
        if (body->surface.node_face_end[i] == body->surface.node_face_start[i])
            continue;
        body->ops->read_nodes(body->model, &i, 1, &x, &v);
        most = fmax(most, vec3_length(v));
    }
    return most;
}

// Every force has its opposite. Returns whether there is any.
static bool forces_cancel(const Touch *touch)
{
    Vec3 force = {0, 0, 0}, moment = {0, 0, 0};
    double size = 0.0;
    for (int n = 0; n < touch->end[0].count; n++) {
        force = vec3_add(force, touch->end[0].f[n]);
        moment = vec3_add(moment, vec3_cross(touch->end[0].x[n], touch->end[0].f[n]));
        size += vec3_length(touch->end[0].f[n]);
    }
    // Rounding; an arm of 5 cm.
    expect_at_most(vec3_length(force), 1e-14 * size);
    expect_at_most(vec3_length(moment), 1e-14 * 0.05 * size);
    return size > 0.0;
}

// A run repeats itself from a state.
static void expect_repeats(Run *run, int ticks)
{
    FREED void *state = malloc(state_bytes(&run->world.state));
    uint64_t hash[2];
    assert_non_null(state);
    state_copy_out(&run->world.state, state);
    for (int pass = 0; pass < 2; pass++) {
        step(run, ticks);
        hash[pass] = state_hash(&run->world.state);
        if (pass == 0) {
            state_copy_in(&run->world.state, state);
            sim_restored(run->world.sim);
            assert_true(sim_check(run->world.sim));
        }
    }
    assert_true(hash[0] == hash[1]);
}

AROUND_ALL(scratch_begin, scratch_end)

// A tower of tissue is cut through, level and at a slope that friction holds: the upper piece stays
// on the lower one, from the tick of the cut on, and comes to rest. All of it repeats from the
// middle.
TEST(a_piece_lies_on_what_it_was_cut_from)
{
    static const double slope[] = {0.0, 0.2, 0.5};
    for (int k = test_is_long() ? 0 : 2; k < 3; k++) {
        START_RUN(run, DOUBLE
                  "gravity = [0, 0, -9.81];\n"
                  "bodies = ( { name = \"one\"; model = \"voxel\"; cuttable = true; voxels = { "
                  "generator = \"box\"; count = [6, 6, 8]; size = 0.005; };\n"
                  "fixed = ( { box = ([-1, -1, -1], [1, 1, -0.0199]); } ); } );\n" SELF(
                      "friction = 0.7;"));
        Sim *sim = run.world.sim;
        step(&run, 300);
        assert_true(touch_of(&run)->depth == 0.0); // no part of it touches another
        const double speed = highest_speed(&run), rise = 0.05 * slope[k];
        cut(&run, vec3(-0.05, -0.05, 0.0003 - rise), vec3(0.05, -0.05, 0.0003 + rise),
            vec3(0, 0.1, 0));
        double deepest = 0.0, jump = 0.0;
        int acted = 0;
        for (int i = 0; i < 1500; i++) {
            step(&run, 1);
            acted += forces_cancel(touch_of(&run));
            deepest = fmax(deepest, touch_of(&run)->depth);
            jump = i < 3 ? fmax(jump, highest_speed(&run) - speed) : jump;
        }
        assert_true(acted > 1000);
        expect_repeats(&run, 500);
        assert_int_equal(sim_pieces(sim, 0), 2);
        assert_int_equal(sim_resets(sim), 0);
        assert_int_equal(sim_refused_touches(sim), 0);
        Shell low = piece_of(&run, false), high = piece_of(&run, true);
        const double overlap = fmax(depth_inside(&low, &high), depth_inside(&high, &low));
        print_message(
            "slope %g: deepest %.3g m, %.3g m at rest, %.2g m/s after the cut, %.2g m/s at "
            "the end\n",
            slope[k], deepest, overlap, jump, highest_speed(&run));
        assert_true(touch_of(&run)->depth > 0.0);
        expect_at_most(deepest, 1e-3); // a fifth of a cell, as what hits at 0.1 m/s
        expect_at_most(overlap, 5e-4);
        // What was tense moves at once, but by no more than gravity lets it in a few ticks.
        expect_at_most(jump, 0.1);
        expect_at_most(highest_speed(&run), 5e-3);
        piece_free(&low);
        piece_free(&high);
    }
}

// The deepest node of a closed surface that is inside of it where it overlaps itself [m]: moved in
// a little, the surface winds around it twice.
static double overlap_of(const Shell *shell)
{
    FREED Vec3 *normal = calloc((size_t)shell->nodes, sizeof *normal);
    double deepest = 0.0;
    for (int f = 0; f < shell->faces; f++)
        for (int k = 0; k < 3 && is_face(shell, f); k++) {
            const int *c = shell->face[f];
            normal[c[k]] =
                vec3_add(normal[c[k]], vec3_cross(vec3_sub(shell->x[c[1]], shell->x[c[0]]),
                                                  vec3_sub(shell->x[c[2]], shell->x[c[0]])));
        }
    for (int i = 0; i < shell->nodes; i++) {
        if (!shell->used[i])
            continue;
        const Vec3 in = vec3_madd(shell->x[i], -1e-6, vec3_unit(normal[i]));
        if (winding(shell, in) < 1.5)
            continue;
        double least = 1.0;
        for (int f = 0; f < shell->faces; f++) {
            const int *c = shell->face[f];
            if (!is_face(shell, f) || c[0] == i || c[1] == i || c[2] == i)
                continue;
            const Vec3 x[3] = {shell->x[c[0]], shell->x[c[1]], shell->x[c[2]]};
            ClosestPair pair;
            distance_point_triangle(in, x, &pair);
            least = fmin(least, pair.distance);
        }
        deepest = fmax(deepest, least);
    }
    return deepest;
}

// A beam with a slit on its upper side is bent upwards: the lips close and press on each other.
// Without contact they pass through each other.
TEST(lips_of_a_slit_do_not_pass_each_other)
{
    double overlap[2];
    for (int with = 0; with < 2; with++) {
        char text[1024];
        SCOPED(run_destroy) Run run;
        snprintf(text, sizeof text,
                 "gravity = [0, 0, 9.0];\n"
                 "bodies = ( { name = \"one\"; model = \"voxel\"; cuttable = true; voxels = { "
                 "generator = \"box\"; count = [16, 4, 4]; size = 0.005; };\n"
                 "material = { youngs_modulus = 1.0e4; };\n"
                 "fixed = ( { box = ([-1, -1, -1], [-0.0399, 1, 1]); } ); } );\n%s",
                 with == 1 ? SELF("") : "");
        run_create(&run, text);
        cut(&run, vec3(-0.0204, -0.05, -0.0024), vec3(-0.0204, -0.05, 0.05), vec3(0, 0.1, 0));
        step(&run, 1500);
        SCOPED(shell_free) Shell shell = shell_of(&run, 0);
        overlap[with] = overlap_of(&shell);
        assert_int_equal(sim_pieces(run.world.sim, 0), 1);
        assert_int_equal(sim_resets(run.world.sim), 0);
    }
    print_message("lips overlap by %.3g m, by %.3g m without contact\n", overlap[1], overlap[0]);
    expect_at_least(overlap[0], 2e-3);
    // A tenth of a cell; a quarter at the rim of a lip, whose nodes see an edge of the other.
    expect_at_most(overlap[1], 0.3 * 0.005);
}

// Lips that lie on each other at rest are looked at once. What is remembered of them is what
// looking again would find: they move by the same bits with and without.
TEST(lips_at_rest_are_not_looked_at_again)
{
    Run run[2];
    const LoadOptions pull = {
        .center = {-0.01, 0.0, 0.01}, .radius = 0.01, .force = {0.02, 0.0, 0.0}, .duration = 0.1};
    for (int k = 0; k < 2; k++) {
        run_create(&run[k],
                   "gravity = [0, 0, 0]; rate_hz = 500.0;\n"
                   "bodies = ( { name = \"one\"; model = \"voxel\"; cuttable = true; voxels = { "
                   "generator = \"box\"; count = [8, 4, 4]; size = 0.005; };\n"
                   "material = { youngs_modulus = 1.0e4; density = 1000.0; };\n"
                   "fixed = ( { box = ([-1, -1, -1], [1, 1, -0.0099]); } ); } );\n" SELF(""));
        cut(&run[k], vec3(-0.0004, -0.05, -0.0004), vec3(-0.0004, -0.05, 0.05), vec3(0, 0.1, 0));
        step(&run[k], 1);
    }
    Touch *touch = touch_of(&run[0]);
    int64_t looks = touch->looks;
    assert_true(touch_is_near(touch) && looks > 0);
    step(&run[0], 100);
    assert_int_equal(touch->looks, looks);
    step(&run[1], 100);
    // Moved, they are looked at again.
    for (int k = 0; k < 2; k++)
        apply_well(sim_apply_load, run[k].world.sim, &pull);
    for (int tick = 0; tick < 500; tick++)
        for (int k = 0; k < 2; k++) {
            touch_of(&run[k])->looked &= k == 0; // the second looks in every tick
            step(&run[k], 1);
        }
    assert_true(touch->looks > looks);
    assert_int_equal(state_hash(&run[0].world.state), state_hash(&run[1].world.state));
    for (int k = 0; k < 2; k++)
        run_destroy(&run[k]);
}

// A body that is pressed far in but not cut moves as one that does not touch itself, bit for bit:
// neither its corners nor its thin parts touch anything.
TEST(a_whole_body_does_not_feel_itself)
{
    Run run[2];
    for (int with = 0; with < 2; with++) {
        char text[1024];
        snprintf(text, sizeof text,
                 "bodies = ( { name = \"one\"; model = \"voxel\"; time_step = 0.0002; voxels = { "
                 "generator = \"ball\"; radius = 0.03; size = 0.004; };\n"
                 "fixed = ( { box = ([-1, -1, -1], [1, 1, -0.02]); } ); } );\n"
                 "tools = ( { id = 1; kind = \"probe\"; max_force = 10.0;\n"
                 "  capsules = ( { radius = 0.008; } ); } );\n%s",
                 with == 1 ? SELF("") : "");
        run_create(&run[with], text);
        ToolPose pose = {
            .position = {0.0, 0.0, 0.05}, .orientation = {1.0, 0, 0, 0}, .active = true};
        for (int i = 0; i < 400; i++) {
            pose.position.z -= i < 150 ? 0.2e-3 : 0.0;
            sim_apply_pose(run[with].world.sim, 0, &pose, true);
            step(&run[with], 1);
            assert_true(with == 0 || touch_of(&run[with])->depth == 0.0);
        }
        assert_true(sim_wrench(run[with].world.sim, 0)->contact);
    }
    SCOPED(shell_free) Shell one = shell_of(&run[0], 0), two = shell_of(&run[1], 0);
    assert_memory_equal(one.x, two.x, (size_t)one.nodes * sizeof *one.x);
    for (int with = 0; with < 2; with++)
        run_destroy(&run[with]);
}

// A whole body that may touch itself moves and steps as one that may not, bit for bit, as long as
// nothing of it is near itself; from its first cut on its steps allow for contact.
TEST(a_whole_body_takes_shorter_steps_only_from_its_first_cut_on)
{
    // Stiff, so that a tick has many steps.
    static const char *const body[2] = {
        "{ name = \"one\"; model = \"voxel\"; cuttable = true; material = { youngs_modulus = 2e5; "
        "}; "
        "voxels = { generator = \"box\"; count = [6, 6, 8]; size = 0.005; }; "
        "fixed = ( { box = ([-1, -1, -1], [1, 1, -0.0199]); } ); }",
        "{ name = \"one\"; cuttable = true; material = { youngs_modulus_2d = 4e3; }; "
        "mesh = { generator = \"ico_sphere\"; nodes = 162; radius = 0.02; }; "
        "fixed = ( { box = ([-1, -1, -1], [1, 1, -0.015]); } ); }"};
    for (int k = 0; k < 2; k++) {
        Run run[2];
        int substeps[2];
        for (int with = 0; with < 2; with++) {
            char text[1024];
            snprintf(text, sizeof text, "gravity = [1, 0, -9.81]; bodies = ( %s ); %s", body[k],
                     with == 1 ? SELF("") : "");
            run_create(&run[with], text);
            step(&run[with], 50);
            substeps[with] = sim_body(run[with].world.sim, 0)->substeps;
        }
        assert_int_equal(substeps[0], substeps[1]);
        SCOPED(shell_free) Shell one = shell_of(&run[0], 0), two = shell_of(&run[1], 0);
        assert_memory_equal(one.x, two.x, (size_t)one.nodes * sizeof *one.x);
        cut(&run[1], vec3(-0.05, -0.05, 0.0003), vec3(0.05, -0.05, 0.0003), vec3(0, 0.1, 0));
        step(&run[1], 1);
        assert_true(sim_body(run[1].world.sim, 0)->substeps > substeps[1]);
        for (int with = 0; with < 2; with++)
            run_destroy(&run[with]);
    }
}

// A hollow ball is cut in two: the upper half falls into the lower one and stays there.
TEST(halves_of_a_hollow_ball_touch)
{
    START_RUN(run, "gravity = [0.0, 0, -9.0];\n"
                   "bodies = ( { name = \"one\"; cuttable = true; mesh = { generator = "
                   "\"sphere\"; nodes = 642; radius = 0.03; };\n"
                   "shape = { frame = \"body\"; angular_frequency = 150.0; };\n"
                   "fixed = ( { box = ([-1, -1, -1], [1, 1, -0.015]); } ); } );\n" SELF(""));
    cut(&run, vec3(-0.05, -0.1, 0.0003), vec3(-0.05, 0.1, 0.0003), vec3(0.1, 0.0, 0));
    step(&run, 1500);
    assert_int_equal(sim_pieces(run.world.sim, 0), 2);
    assert_int_equal(sim_resets(run.world.sim), 0);
    SCOPED(shell_free) Shell all = shell_of(&run, 0);
    double lowest = 1.0;
    for (int i = 0; i < all.nodes; i++)
        lowest = all.used[i] ? fmin(lowest, all.x[i].z) : lowest;
    print_message("lowest %.4f m, %.2g m/s\n", lowest, highest_speed(&run));
    expect_at_least(lowest, -0.0301); // it would have fallen by 10 m
    expect_at_most(highest_speed(&run), 0.02);
}

// What a hollow body does: a scene and what is done to it, by ticks.
typedef struct Fold {
    const char *name, *scene;
    void (*act)(Run *run, int tick);
    int ticks, most; // crossings, seen every 100 ticks
    double speed;    // of any node at the end, at most: a flap flutters, the rest is calm [m/s]
} Fold;

#define SHEET(more, size)                                                                          \
    "bodies = ( { name = \"one\"; mesh = { generator = \"sheet\"; " size " };\n"                   \
    "  material = { youngs_modulus_2d = 200.0; areal_density = 1.0; damping_time = 8.0e-5;\n"      \
    "    thickness = " more " } );\n"

static void set_gravity(Run *run, double x, double z)
{
    Body *body = sim_body(run->world.sim, 0);
    assert_true(body->ops->set(body->model, BODY_GRAVITY_X, x));
    assert_true(body->ops->set(body->model, BODY_GRAVITY_Z, z));
}

static void place_tool(Run *run, int tool, Vec3 at)
{
    const ToolPose pose = {.position = at, .orientation = {1.0, 0, 0, 0}, .active = true};
    sim_apply_pose(run->world.sim, tool, &pose, true);
}

// A flap is cut on three sides, turned over by gravity and dropped onto the sheet beside its hinge.
static const char FLAP[] = SHEET(
    "0.0005; }; cuttable = true;\n"
    "  fixed = ( { box = ([-1, -1, -1], [-0.099, 1, 1]); },\n"
    "    { box = ([0.099, -1, -1], [1, 1, 1]); }, { box = ([-1, -1, -1], [1, -0.074, 1]); },\n"
    "    { box = ([-1, 0.074, -1], [1, 1, 1]); } ); ",
    "columns = 41; rows = 31; width = 0.2; height = 0.15;");

static void turn_flap(Run *run, int tick)
{
    if (tick == 0) {
        cut(run, vec3(0.0, -0.03, -0.02), vec3(0.0, -0.03, 0.02), vec3(0.06, 0, 0));
        cut(run, vec3(0.0, 0.03, -0.02), vec3(0.0, 0.03, 0.02), vec3(0.06, 0, 0));
        cut(run, vec3(0.058, -0.032, -0.02), vec3(0.058, -0.032, 0.02), vec3(0, 0.064, 0));
        set_gravity(run, -3.0, 2.0);
    }
    if (tick == 480)
        set_gravity(run, -3.0, -2.0);
}

// A sheet hangs over its fixed middle; two bars press its halves together.
#define BARS                                                                                       \
    "tools = ( { id = 1; kind = \"probe\"; max_force = 0.3;\n"                                     \
    "  capsules = ( { from = [0, -0.1, 0]; to = [0, 0.1, 0]; radius = 0.008; } ); },\n"            \
    "  { id = 2; kind = \"probe\"; max_force = 0.3;\n"                                             \
    "  capsules = ( { from = [0, -0.1, 0]; to = [0, 0.1, 0]; radius = 0.008; } ); } );\n"
static const char PINCHED[] = "gravity = [0, 0, -9.81];\n" SHEET(
    "0.002; };\n  fixed = ( { box = ([-0.004, -1, -1], [0.004, 1, 1]); } ); ",
    "columns = 31; rows = 7; width = 0.15; height = 0.03;") BARS;

static void pinch(Run *run, int tick)
{
    const double x = fmax(0.0, 0.06 - 0.0005 * (tick - 250));
    for (int t = 0; t < 2 && tick >= 250; t++)
        place_tool(run, t, vec3(t == 0 ? x : -x, 0.0, -0.04));
}

// A hollow organ is pressed until its walls meet.
static const char PRESSED[] =
    "bodies = ( { name = \"one\"; mesh = { generator = \"stomach\"; nodes = 642; length = 0.25; "
    "};\n"
    "  material = { youngs_modulus_2d = 80.0; areal_density = 4.2; damping_time = 2.0e-4;\n"
    "    thickness = 0.002; };\n"
    "  shape = { angular_frequency = 20.0; damping_ratio = 0.1; };\n"
    "  fixed = ( { box = ([-1.0, -1.0, 0.08], [1.0, 1.0, 1.0]); } ); } );\n"
    "tools = ( { id = 1; kind = \"probe\"; max_force = 30.0;\n"
    "  capsules = ( { to = [0.0, 0.0, 0.1]; radius = 0.005; } ); } );\n";

static void press(Run *run, int tick)
{
    place_tool(run, 0, vec3(0.13 - 0.2e-3 * tick, 0.0, -0.05));
}

// A ball without stiffness against bending collapses onto itself: the hardest case.
static const char COLLAPSED[] =
    "gravity = [0, 0, -9.81];\n"
    "bodies = ( { name = \"one\"; mesh = { generator = \"sphere\"; nodes = 642; radius = 0.03; };\n"
    "  fixed = ( { box = ([-1, -1, -1], [1, 1, -0.025]); } ); } );\n";

static void leave(Run *run, int tick)
{
    (void)run;
    (void)tick;
}

// Without contact all of these pass through themselves. Walls that resist bending do not; a ball
// that crumples to single faces holds some tangles, and calms down. The flap may be caught at a
// moment.
TEST(folds_do_not_pass_each_other)
{
    // A sanitizer needs no comparison.
    const bool full = PLIANT_EFFORT == 1 && test_is_long();
    static const Fold fold[] = {{"flap", FLAP, turn_flap, 900, 4, 2.0},
                                {"pinched", PINCHED, pinch, 520, 0, 2.0},
                                {"pressed", PRESSED, press, 500, 0, 2.0},
                                {"collapsed", COLLAPSED, leave, 400, 1000, 0.5}};
    for (int i = test_is_long() ? 0 : 1; i < (test_is_long() ? 4 : 2); i++) {
        int most[2] = {0, 0}, last = 0;
        double speed = 0.0, deepest = 0.0;
        for (int with = full ? 0 : 1; with < 2; with++) {
            SCOPED(run_destroy) Run run;
            run_format(&run, "%s%s", fold[i].scene, with == 1 ? SELF("") : "");
            for (int tick = 0; tick < fold[i].ticks; tick++) {
                fold[i].act(&run, tick);
                step(&run, 1);
                if (with == 1) {
                    forces_cancel(touch_of(&run));
                    deepest = fmax(deepest, touch_of(&run)->depth);
                }
                if (tick % 100 < 99)
                    continue;
                SCOPED(shell_free) Shell shell = shell_of(&run, 0);
                last = crossings(&shell);
                most[with] = last > most[with] ? last : most[with];
            }
            speed = highest_speed(&run);
            expect_repeats(&run, 60);
            assert_int_equal(sim_resets(run.world.sim), 0);
            assert_int_equal(sim_refused_touches(run.world.sim), 0);
        }
        print_message("%s: at most %d crossings, %d at the end (%d without contact), deepest "
                      "%.3g m, %.2g m/s at the end\n",
                      fold[i].name, most[1], last, most[0], deepest, speed);
        assert_true(most[0] > 0 || !full);
        assert_true(most[1] <= fold[i].most);
        expect_at_most(speed, fold[i].speed);
    }
}

TEST(forces_of_folds_are_the_gradient_of_the_energy)
{
    SCOPED(run_destroy) Run run;
    run_format(&run, DOUBLE "%s" SELF(""), COLLAPSED);
    for (int i = 0; i < 300 && touch_of(&run)->depth < 1e-4; i++)
        step(&run, 1);
    expect_gradient(&run);
}
