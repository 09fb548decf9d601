// SPDX-License-Identifier: MIT
// A loop in real time over a body whose ticks take longer than their period until its thresholds
// are raised: the governor raises them, its actions are inputs like any other, and a run without
// clock that gets these inputs ends in the same state. And a PAUSE that overtakes other requests.
#include "test.h"
#include "geometry/levels.h"
#include "run/loop.h"
#include "run/requests.h"
#include "toy_body.h"

#include "pliant_command_t.h"

#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

enum { RATE = 100 }; // [Hz]

typedef struct Rig {
    World world;
    TriMesh mesh;
    Toy *toy;
    Exchange exchange;
    Loop loop;
    int done_fd;
} Rig;

// Where the thresholds are low everything is split.
static void decide(Toy *toy)
{
    toy_want_all(toy, toy->parameter[BODY_ADAPT_SCALE] < 4.0);
}

// Half as long again as a tick may take, or hardly anything.
static void labour(const Toy *toy)
{
    const struct timespec slow = {.tv_nsec = 15000000};
    if (toy->splits->split[0])
        nanosleep(&slow, NULL);
}

static void create(Rig *rig)
{
    memset(rig, 0, sizeof *rig);
    rig->mesh = toy_sheet(2, 0.01);
    SimOptions options = {.rate_hz = RATE, .tool_timeout_s = 0.2, .may_load = true};
    rig->world.sim = sim_create(&options, &rig->world.arena, &rig->world.state);
    Body body = toy_body(&rig->toy, "wall", &rig->mesh, &(ToyOptions){0}, &rig->world.arena,
                         &rig->world.state);
    body.time_step_wanted = 1.0 / RATE; // one evaluation per tick
    body.unsafe_time_step = true;
    rig->toy->parameter[BODY_ADAPT_SCALE] = 1.0;
    rig->toy->parameter[BODY_ADAPT_LEVEL] = LEVELS_MAX;
    rig->toy->splits->decide = decide;
    sim_add_body(rig->world.sim, &body);
    Status status = {0};
    assert_true(sim_seal(rig->world.sim, 0.0, &status));
}

static void destroy(Rig *rig)
{
    mesh_destroy(&rig->mesh);
    state_destroy(&rig->world.state);
    arena_destroy(&rig->world.arena);
}

static void create_loop(Rig *rig, double duration_s)
{
    Status status = {0};
    ExchangeOptions exchange = {.logs_inputs = true};
    exchange_create(&rig->exchange, &rig->world, &exchange);
    assert_true(exchange_open(&rig->exchange, &status));
    rig->done_fd = eventfd(0, EFD_CLOEXEC);
    static const Scene scene = {.sim = {.rate_hz = RATE, .tool_timeout_s = 0.2}};
    const LoopOptions loop = {.duration_s = duration_s};
    loop_init(&rig->loop, &rig->world, &scene, &rig->exchange, &loop, rig->done_fd);
}

static void close_loop(Rig *rig)
{
    exchange_close(&rig->exchange);
    close(rig->done_fd);
}

static void run_loop(Rig *rig)
{
    Status status = {0};
    assert_true(loop_start(&rig->loop, &status));
    loop_join(&rig->loop);
}

static int count_events(Rig *rig, const char *kind)
{
    int count = 0;
    for (const EventOut *event; (event = ring_peek(&rig->exchange.event)) != NULL;) {
        count += strcmp(event->kind, kind) == 0;
        ring_pop(&rig->exchange.event);
    }
    return count;
}

// Through the bytes of the log and back, as a run offline gets it.
static void replay_input(Sim *sim, const Input *input)
{
    unsigned char data[INPUT_WIRE_MAX];
    Input read;
    char text[INPUT_WHY_MAX];
    Answer answer = {0};
    size_t size = input_encode(input, data);
    assert_int_equal(input_decode(INPUT_COMMAND, data, size, &read, text), ACCEPTED);
    assert_int_equal(input_check(&read, sim, text), ACCEPTED);
    assert_true(requests_execute(sim, &read, &answer));
}

static void replay(Rig *live, Rig *twin)
{
    Ring *applied = &live->exchange.applied;
    int64_t end = sim_steps(live->world.sim);
    for (;;) {
        const AppliedInput *next;
        while ((next = ring_peek(applied)) != NULL && next->step == sim_steps(twin->world.sim)) {
            replay_input(twin->world.sim, &next->input);
            ring_pop(applied);
        }
        if (sim_steps(twin->world.sim) == end)
            break;
        sim_step(twin->world.sim);
    }
    assert_null(ring_peek(applied));
}

TEST(overrun_raises_thresholds_and_the_log_repeats_it)
{
    Rig live, twin;
    create(&live);
    live.toy->splits->labour = labour;
    create_loop(&live,
                4.0); // two windows of 0.25 s, and many times as long again
    run_loop(&live);
    // At least until the ticks were short; a busy machine may have made it go on.
    assert_true(live.loop.governor.actions >= 2);
    assert_true(live.toy->changes >= 2); // split, then joined again
    assert_int_equal(count_events(&live, "governor"), live.loop.governor.actions);
    const StatusOut *status = slot_take(&live.exchange.status);
    assert_non_null(status);
    assert_int_equal(status->governor_stage, live.loop.governor.reduction);
    assert_int_equal(status->governor_actions, live.loop.governor.actions);

    create(&twin);
    replay(&live, &twin);
    assert_true(state_hash(&live.world.state) == state_hash(&twin.world.state));
    destroy(&twin);
    close_loop(&live);
    destroy(&live);
}

static void push_command(Rig *rig, int kind, int64_t value)
{
    Input input = {.kind = INPUT_COMMAND, .index = -1, .command = {.kind = kind, .value = value}};
    assert_true(ring_push(&rig->exchange.request, &input));
    exchange_wake(rig->exchange.step_fd);
}

// Ticks of a STEP are as slow as before: in lockstep the governor rests.
TEST(lockstep_is_not_governed)
{
    Rig rig;
    create(&rig);
    rig.toy->splits->labour = labour;
    create_loop(&rig, 0.0);
    push_command(&rig, PLIANT_COMMAND_T_STEP, 80);
    push_command(&rig, PLIANT_COMMAND_T_STOP, 0);
    run_loop(&rig);
    assert_int_equal(sim_steps(rig.world.sim), 80);
    assert_int_equal(rig.loop.governor.actions, 0);
    assert_int_equal(count_events(&rig, "governor"), 0);
    expect_near(rig.toy->parameter[BODY_ADAPT_SCALE], 1.0, 0.0);
    close_loop(&rig);
    destroy(&rig);
}

// A quarter of a second of ticks that take one and a half periods, so two.
static void govern_window(Rig *rig, int64_t *now_ns)
{
    for (int tick = 0; tick < 13; tick++) {
        requests_govern(&rig->loop, *now_ns, 15000000);
        *now_ns += 20000000;
    }
}

// What the governor holds back comes back when no time is measured any more, by inputs again.
TEST(lockstep_begins_with_all_detail)
{
    Rig rig;
    create(&rig);
    create_loop(&rig, 0.0);
    int64_t now_ns = 0;
    for (int stage = 1; stage <= 5; stage++) {
        sim_body(rig.world.sim, 0)->finest_level = 3;
        govern_window(&rig, &now_ns);
    }
    expect_near(rig.toy->parameter[BODY_ADAPT_SCALE], 8.0, 0.0);
    expect_near(rig.toy->parameter[BODY_ADAPT_LEVEL], 1.0, 0.0);
    push_command(&rig, PLIANT_COMMAND_T_STEP, 1);
    assert_true(requests_take(&rig.loop));
    expect_near(rig.toy->parameter[BODY_ADAPT_SCALE], 1.0, 0.0);
    expect_near(rig.toy->parameter[BODY_ADAPT_LEVEL], LEVELS_MAX, 0.0);
    assert_int_equal(rig.loop.governor.reduction, 0);
    int logged = 0;
    for (const AppliedInput *next; (next = ring_peek(&rig.exchange.applied)) != NULL; logged++)
        ring_pop(&rig.exchange.applied);
    assert_int_equal(logged, 5 + 1 + 2); // actions, STEP, both keys
    close_loop(&rig);
    destroy(&rig);
}

// RESET brings the thresholds back with the rest of the state; the governor begins again.
TEST(reset_restarts_the_governor)
{
    Rig rig;
    create(&rig);
    create_loop(&rig, 0.0);
    govern_window(&rig, &(int64_t){0});
    expect_near(rig.toy->parameter[BODY_ADAPT_SCALE], 2.0, 0.0);
    push_command(&rig, PLIANT_COMMAND_T_RESET, 0);
    assert_false(requests_take(&rig.loop));
    expect_near(rig.toy->parameter[BODY_ADAPT_SCALE], 1.0, 0.0);
    assert_int_equal(rig.loop.governor.reduction, 0);
    close_loop(&rig);
    destroy(&rig);
}

// What waits must not delay a PAUSE, nor undo it afterwards.
TEST(a_pause_overtakes_all_that_waits)
{
    Rig rig;
    create(&rig);
    create_loop(&rig, 0.0);
    const int waiting[] = {PLIANT_COMMAND_T_RESET, PLIANT_COMMAND_T_STEP, PLIANT_COMMAND_T_RESUME};
    for (int i = 0; i < 3; i++)
        push_command(&rig, waiting[i], i == 1 ? 5 : 0);
    const Input pause = {.kind = INPUT_COMMAND,
                         .index = -1,
                         .command = {.kind = PLIANT_COMMAND_T_PAUSE},
                         .arrival = 3};
    assert_true(ring_push(&rig.exchange.urgent, &pause));
    // The clock gives the others nothing: one that took long was before them.
    rig.loop.requests_due_ns = INT64_MAX;
    assert_false(requests_take(&rig.loop));
    const int order[] = {PLIANT_COMMAND_T_PAUSE, PLIANT_COMMAND_T_RESET, PLIANT_COMMAND_T_STEP,
                         PLIANT_COMMAND_T_RESUME};
    for (int i = 0; i < 4; i++) {
        const Answer *answer = ring_peek(&rig.exchange.answer);
        assert_non_null(answer);
        assert_int_equal(answer->command, order[i]);
        assert_int_equal(answer->ok, i < 2);
        ring_pop(&rig.exchange.answer);
    }
    assert_int_equal(rig.loop.state, RUN_PAUSED);
    assert_false(rig.loop.resumed);
    // A later RESUME counts, and what the pause took is no part of the first tick.
    const Input resume = {.kind = INPUT_COMMAND,
                          .index = -1,
                          .command = {.kind = PLIANT_COMMAND_T_RESUME},
                          .arrival = 4};
    assert_true(ring_push(&rig.exchange.request, &resume));
    assert_false(requests_take(&rig.loop));
    assert_int_equal(rig.loop.state, RUN_RUNNING);
    assert_true(rig.loop.resumed);
    close_loop(&rig);
    destroy(&rig);
}
