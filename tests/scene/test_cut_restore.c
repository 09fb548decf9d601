// SPDX-License-Identifier: MIT
// Scenes that were cut, restored: from their own state they go on bit for bit, also in the middle
// of a stroke; from a damaged one they are refused, or go on somehow, and leave nothing behind.
#include "effort.h"
#include "test.h"
#include "random.h"
#include "world_run.h"

static const char SCENE[] =
    "name = \"cuts\";\n"
    "bodies = (\n"
    "  { name = \"box\"; model = \"voxel\"; levels = 1; cuttable = true;\n"
    "    voxels = { generator = \"box\"; count = [6, 6, 6]; size = 0.006; };\n"
    "    tear = { stress = 4000.0; };\n"
    "    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0179]); } ); },\n"
    "  { name = \"ball\"; model = \"surface\"; levels = 1; cuttable = true; shape = {};\n"
    "    mesh = { generator = \"ico_sphere\"; nodes = 42; radius = 0.02; }; prestress = 0.05;\n"
    "    tear = { stretch = 0.5; }; } );\n"
    "tools = ( { id = 1; kind = \"probe\";\n"
    "            capsules = ( { from = [0.0, 0.0, 0.0]; radius = 0.005; } ); },\n"
    "          { id = 2; kind = \"blade\"; edge = ([0.0, 0.0, 0.0], [0.0, 0.0, 0.06]); } );\n";

static void cut_at(Sim *sim, double x)
{
    const CutOptions cut = {.body = -1,
                            .before = {{{x, -0.05, -0.05}, {x, -0.05, 0.05}}},
                            .after = {{{x, 0.03, -0.05}, {x, 0.03, 0.05}}}};
    CutOutcome sum;
    char why[192];
    sim_apply_cut(sim, &cut, &sum, why, sizeof why);
}

// The blade on its way through both, the probe on top; `step` counts from the start of the stroke.
static void go_on(Sim *sim, int step)
{
    const ToolPose blade = {.position = {0.0011, -0.03 + 0.0005 * step, -0.03},
                            .orientation = {1.0, 0.0, 0.0, 0.0},
                            .active = true};
    const ToolPose probe = {
        .position = {0.004, 0.0, 0.022}, .orientation = {1.0, 0.0, 0.0, 0.0}, .active = true};
    sim_apply_pose(sim, 0, &probe, false);
    sim_apply_pose(sim, 1, &blade, false);
    sim_step(sim);
}

static bool is_valid(Sim *sim)
{
    bool sound = sim_check(sim);
    for (int b = 0; b < sim_body_count(sim); b++) {
        const Body *body = sim_body(sim, b);
        sound = (body->ops->check == NULL || body->ops->check(body->model)) && sound;
    }
    return sound;
}

// Says which arrays are not as in the image. What counts changes of topology does not go back: no
// number ever names two meshes of a run.
static void expect_state(const StateList *state, const unsigned char *image)
{
    int differ = 0;
    for (int i = 0; i < state->count; image += state->array[i++].bytes) {
        if (strstr(state->array[i].name, "/sweep") != NULL ||
            memcmp(state_memory(&state->array[i]), image, state->array[i].bytes) == 0)
            continue;
        print_error("%s differs\n", state->array[i].name);
        differ++;
    }
    assert_int_equal(differ, 0);
}

static void begin(Run *run)
{
    run_create(run, SCENE);
    cut_at(run->world.sim, -0.0071);
    for (int i = 0; i < 40; i++)
        go_on(run->world.sim, i);
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(a_cut_scene_goes_on_from_its_state_bit_for_bit)
{
    SCOPED(run_destroy) Run run;
    begin(&run);
    StateList *state = &run.world.state;
    Sim *sim = run.world.sim;
    FREED void *image = malloc(state_bytes(state)), *end = malloc(state_bytes(state));
    assert_true(image != NULL && end != NULL);
    state_copy_out(state, image);
    for (int k = 0; k < 2; k++) {
        for (int i = 40; i < 140; i++)
            go_on(sim, i);
        cut_at(sim, 0.0083);
        sim_ticks(sim, 20);
        if (k == 0)
            state_copy_out(state, end);
        else
            expect_state(state, end);
        state_copy_in(state, image);
        sim_restored(sim);
        assert_true(is_valid(sim));
        expect_state(state, image);
    }
    assert_true(sim_pieces(sim, 0) >= 1);
}

// As a file might be damaged on purpose: whole words of one array, small and large values.
static void damage(const StateList *state, uint64_t *random)
{
    const StateArray *array = &state->array[random_below(random, state->count)];
    if (array->bytes == 0)
        return;
    unsigned char *memory = state_memory(array);
    for (int k = 1 + random_below(random, 4); k > 0; k--) {
        size_t at = (size_t)(random_bits(random) % array->bytes);
        int32_t word = random_below(random, 2) == 0 ? random_below(random, 4000) - 100
                                                    : (int32_t)random_bits(random);
        size_t aligned = at / 4 * 4;
        if (random_below(random, 3) == 0 || aligned + 4 > array->bytes)
            memory[at] = (unsigned char)random_bits(random);
        else
            memcpy(memory + aligned, &word, sizeof word);
    }
}

TEST(damaged_states_are_refused_or_can_be_stepped_on)
{
    SCOPED(run_destroy) Run run;
    begin(&run);
    StateList *state = &run.world.state;
    Sim *sim = run.world.sim;
    FREED void *image = malloc(state_bytes(state));
    state_copy_out(state, image);
    uint64_t random = 3;
    int refused = 0, trials = EFFORT(1200);
    for (int i = 0; i < trials; i++) {
        damage(state, &random);
        sim_restored(sim);
        if (is_valid(sim)) {
            for (int k = 0; k < 2; k++)
                go_on(sim, 41 + k);
            cut_at(sim, 0.0083);
            sim_step(sim);
        } else {
            refused++;
        }
        state_copy_in(state, image);
        sim_restored(sim);
        assert_true(is_valid(sim));
        expect_state(state, image);
    }
    print_message("%d of %d refused\n", refused, trials);
    assert_true(refused > trials / 10);
    // What was refused has left nothing behind.
    FREED void *end = malloc(state_bytes(state));
    assert_non_null(end);
    for (int k = 0; k < 2; k++) {
        for (int i = 40; i < 60; i++)
            go_on(sim, i);
        if (k == 0)
            state_copy_out(state, end);
        else
            expect_state(state, end);
        state_copy_in(state, image);
        sim_restored(sim);
    }
}
