// SPDX-License-Identifier: MIT
// Random sequences of ties by message, beside cuts, tears, refinement and tools: repeated from a
// log of inputs, from its start and from a checkpoint in the middle, they are bit-identical. With a
// number as argument, so many sequences.
#include "effort.h"
#include "test.h"
#include "scratch_folder.h"

#ifdef PLIANT_WITH_HDF5
#include "io/checkpoint.h"
#endif
#include "run/input_log.h"
#include "run/requests.h"

#include "pliant_tie_t.h"

enum { TICKS = 80, TIES = 5 };
static const char TEXT[] =
    "name = \"tied\"; max_ties = 5;\n"
    "bodies = (\n"
    "  { name = \"wall\"; mesh = { generator = \"sphere\"; nodes = 114; radius = 0.05; };\n"
    "    levels = 1; start_level = 0; prestress = 0.1; cuttable = true; tear = { stretch = 1.5; "
    "};\n"
    "    adapt = { force = 0.01; speed = 0.5; curvature = 0.4; check_hz = 500.0; };\n"
    "    integrator = \"leapfrog\"; shape = { angular_frequency = 50.0; damping_ratio = 0.3; }; "
    "},\n"
    "  { name = \"ball\"; mesh = { generator = \"sphere\"; nodes = 114; radius = 0.04;\n"
    "      place = { translation = [0.0, 0.0, 0.092]; }; }; integrator = \"leapfrog\"; },\n"
    "  { name = \"block\"; model = \"voxel\"; voxels = { generator = \"box\"; count = [4, 4, 4];\n"
    "      size = 0.02; place = { translation = [0.092, 0.0, 0.0]; }; };\n"
    "    levels = 1; cuttable = true; tear = { stress = 3000.0; }; integrator = \"leapfrog\";\n"
    "    material = { youngs_modulus = 1.0e4; density = 1000.0; damping = 0.2; }; } );\n"
    "tools = (\n"
    "  { id = 1; kind = \"probe\"; max_force = 3.0; capsules = ( { radius = 0.01; } ); },\n"
    "  { id = 3; kind = \"grasper\"; max_force = 3.0; capsules = ( { radius = 0.02; } ); } );\n";

typedef struct Rig {
    Scene scene;
    World world;
    void *start, *middle;
    WorldImage image; // of the middle
} Rig;

static void build(Rig *rig)
{
    Status status = {0};
    const BuildOptions options = {.isa = "auto", .may_load = true};
    *rig = (Rig){0};
    scratch_write(&scratch_space, "tied.cfg", TEXT, strlen(TEXT));
    expect_ok(scene_read(scratch_at("tied.cfg"), &rig->scene, &status) &&
                  world_build(&rig->world, &rig->scene, &options, &status),
              status);
    rig->start = malloc(state_bytes(&rig->world.state));
    rig->middle = malloc(state_bytes(&rig->world.state));
    assert_non_null(rig->start);
    assert_non_null(rig->middle);
    state_copy_out(&rig->world.state, rig->start);
    world_image_reserve(&rig->image, &rig->world.arena, &rig->world);
}

static void destroy(Rig *rig)
{
    free(rig->start);
    free(rig->middle);
    world_destroy(&rig->world);
    scene_destroy(&rig->scene);
}

static void go_to(Rig *rig, const void *state)
{
    SimEvent event;
    state_copy_in(&rig->world.state, state);
    sim_restored(rig->world.sim);
    sim_set_lockstep(rig->world.sim, false);
    rig->world.inputs = rig->world.inputs_step = 0;
    while (sim_take_event(rig->world.sim, &event))
        continue;
}

// --- what chance sends ---

static double between(double low, double high)
{
    return low + (high - low) * (double)random() / (double)RAND_MAX;
}

static void draw_point(double x[3])
{
    // On one of the bodies, more or less.
    static const double CENTERS[3][3] = {{0, 0, 0}, {0, 0, 0.092}, {0.092, 0, 0}};
    const double *center = CENTERS[random() % 3];
    for (int k = 0; k < 3; k++)
        x[k] = center[k] + between(-0.05, 0.05);
}

static Input draw_tie(void)
{
    static const char *const NAMES[] = {"wall", "ball", "block"};
    Input input = {.kind = INPUT_TIE};
    const long action = random() % 8;
    input.tie.action = action < 5    ? PLIANT_TIE_T_MAKE
                       : action == 5 ? PLIANT_TIE_T_CHANGE
                                     : PLIANT_TIE_T_RELEASE;
    input.tie.tie = input.tie.action == PLIANT_TIE_T_MAKE ? 0 : 1 + (int32_t)(random() % TIES);
    input.tie.kind = 1 + (int32_t)(random() % 4);
    input.tie.tool = random() % 2 == 0 ? 1 : 3;
    draw_point(input.tie.center);
    // Ties in the gaps between the bodies, as a rule.
    if (random() % 2 == 0) {
        const bool above = random() % 2 == 0;
        input.tie.center[0] = above ? 0.0 : 0.051;
        input.tie.center[1] = 0.0;
        input.tie.center[2] = above ? 0.051 : 0.0;
    }
    input.tie.radius = between(0.005, 0.06);
    input.tie.stiffness = between(0.01, 1.5);
    input.tie.damping_ratio = between(0.0, 1.0);
    input.tie.break_force = random() % 2 == 0 ? between(0.01, 2.0) : 0.0;
    snprintf(input.text, sizeof input.text, "%s", NAMES[random() % 3]);
    if (random() % 3 != 0)
        snprintf((char *)input.tie.to_body, sizeof input.tie.to_body, "%s", NAMES[random() % 3]);
    return input;
}

static Input draw_other(void)
{
    Input input = {.kind = INPUT_LOAD, .text = ""};
    const long what = random() % 8;
    if (what < 2) {
        input.kind = INPUT_CUT;
        draw_point(input.cut.before[0]);
        draw_point(input.cut.before[1]);
        draw_point(input.cut.after[0]);
        draw_point(input.cut.after[1]);
    } else if (what < 4) {
        draw_point(input.load.center);
        input.load.radius = between(0.01, 0.04);
        input.load.duration = between(0.002, 0.05);
        for (int k = 0; k < 3; k++)
            input.load.force[k] = between(-3.0, 3.0);
    } else {
        input.kind = INPUT_POSE;
        input.pose.tool = random() % 2 == 0 ? 1 : 3;
        draw_point(input.pose.position);
        input.pose.orientation[0] = 1.0;
        input.pose.active = random() % 5 != 0;
        input.pose.grip = between(0.0, 1.0);
    }
    return input;
}

// --- a run, and the same from its log ---

typedef struct Tally {
    int made, cut, broken, refused;
} Tally;

static void apply(Rig *rig, InputLogWriter *log, Input *input, int number, Tally *tally)
{
    Sim *sim = rig->world.sim;
    char why[INPUT_WHY_MAX];
    input->sender = 5;
    input->id = number;
    input->utime = 1000 + number;
    input->index = -1;
    if (input_check(input, sim, why) != ACCEPTED) {
        tally->refused++;
        return;
    }
    const AppliedInput applied = {.step = sim_steps(sim), .input = *input};
    assert_true(input_log_write(log, &applied));
    world_count_input(&rig->world);
    if (input->kind == INPUT_POSE) {
        const ToolPose pose = input_pose(input);
        sim_apply_pose(sim, input->index, &pose, false);
        return;
    }
    Answer answer = {0};
    const bool ok = requests_execute(sim, input, &answer);
    tally->made += ok && input->kind == INPUT_TIE && input->tie.action == PLIANT_TIE_T_MAKE;
    tally->cut += ok && input->kind == INPUT_CUT;
    tally->refused += !ok;
    // What is refused by the scene too leaves it as it can be.
    assert_true(answer.text[0] != '\0');
}

static uint64_t run_live(Rig *rig, const char *path, unsigned seed, Tally *tally)
{
    Status status = {0};
    InputLogHeader header = {.rate_hz = rig->scene.sim.rate_hz};
    snprintf(header.scene, sizeof header.scene, "%s", rig->scene.name);
    snprintf(header.prefix, sizeof header.prefix, "%s", rig->scene.input_prefix);
    snprintf(header.isa, sizeof header.isa, "auto");
    remove(path);
    InputLogWriter *log = input_log_create(path, &header, &status);
    if (log == NULL)
        fail_msg("%s", status.text);
    srandom(seed);
    go_to(rig, rig->start);
    int number = 0;
    for (int tick = 0; tick < TICKS; tick++) {
        if (tick == TICKS / 2) {
            world_image_take(&rig->image, &rig->world);
            state_copy_out(&rig->world.state, rig->middle);
        }
        for (int i = 0; i < 2; i++) {
            Input input = random() % 2 == 0 ? draw_tie() : draw_other();
            if (random() % 4 == 0)
                apply(rig, log, &input, ++number, tally);
        }
        sim_step(rig->world.sim);
        SimEvent event;
        while (sim_take_event(rig->world.sim, &event))
            tally->broken += strcmp(event.kind, "tie_broken") == 0;
    }
    expect_ok(input_log_close(log, sim_steps(rig->world.sim), 0, &status), status);
    assert_true(sim_check(rig->world.sim));
    return state_hash(&rig->world.state);
}

static uint64_t run_again(Rig *rig, const char *path, const void *from)
{
    Status status = {0};
    InputLogReader reader;
    Replay replay;
    go_to(rig, from);
    expect_ok(input_log_open(&reader, path, &status), status);
    const ReplayOptions options = {.input = &reader, .quiet = true};
    expect_ok(replay_begin(&replay, &rig->world, &rig->scene, TICKS, &options, &status), status);
    while (sim_steps(rig->world.sim) < TICKS) {
        replay_due(&replay);
        sim_step(rig->world.sim);
    }
    input_log_close_reader(&reader);
    assert_true(sim_check(rig->world.sim));
    return state_hash(&rig->world.state);
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(random_sequences_repeat_bit_for_bit)
{
    static Rig live, again;
    char path[SCRATCH_PATH];
    Tally tally = {0};
    build(&live);
    build(&again);
    scratch_path(&scratch_space, "tied.log", path);
    const int sequences = EFFORT(test_is_long() ? 1000 : 20);
    for (int k = 0; k < sequences; k++) {
        const uint64_t hash = run_live(&live, path, 1000 + (unsigned)k, &tally);
        // In another world of the same scene, and on from the middle.
        if (run_again(&again, path, again.start) != hash)
            fail_msg("sequence %d differs from its log", k);
        if (run_again(&again, path, live.middle) != hash)
            fail_msg("sequence %d differs from the middle on", k);
#ifdef PLIANT_WITH_HDF5
        // The middle of some also through a file, which takes a process to read.
        char file[SCRATCH_PATH];
        Status status = {0};
        if (k % 20 != 0)
            continue;
        remove(scratch_path(&scratch_space, "tied.h5", file));
        expect_ok(checkpoint_write(file, &live.image, &live.world, &status) &&
                      checkpoint_read(file, &again.world, &status),
                  status);
        state_copy_out(&again.world.state, again.middle);
        if (run_again(&again, path, again.middle) != hash)
            fail_msg("sequence %d differs from a checkpoint of the middle on", k);
#endif
    }
    print_message("%d sequences: %d ties made, %d cuts, %d ties broken, %d refused, %lld bodies "
                  "restored\n",
                  sequences, tally.made, tally.cut, tally.broken, tally.refused,
                  (long long)sim_resets(live.world.sim));
    // Chance sent something of each.
    assert_true(tally.made > 2 * sequences && tally.cut > 0 && tally.broken > 0);
    destroy(&live);
    destroy(&again);
}
