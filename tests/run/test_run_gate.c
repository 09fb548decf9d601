// SPDX-License-Identifier: MIT
// What is let in, with a clock of our own: ownership, repeats, counters. And when things are due.
#include "test.h"
#include "io/event_log.h"
#include "run/input.h"
#include "run/loop.h"

#include "receiver.h"

#include <unistd.h>

typedef struct Fixture {
    Arena arena;
    StateList state;
    Sim *sim;
    Gate gate;
} Fixture;

// A scene of tools alone: a probe (id 1) and a static one (id 4).
static int set_up(void **state)
{
    Fixture *fixture = calloc(1, sizeof *fixture);
    SimOptions options = {.rate_hz = 1000.0, .tool_timeout_s = 0.2};
    fixture->sim = sim_create(&options, &fixture->arena, &fixture->state);
    ToolOptions probe = {.id = 1, .kind = TOOL_PROBE, .capsule_count = 1, .max_force = 1.0};
    probe.capsule[0].radius = 0.01;
    ToolOptions table = {
        .id = 4, .kind = TOOL_STATIC, .has_plane = true, .plane = {.normal = {0.0, 0.0, 1.0}}};
    sim_add_tool(fixture->sim, &probe);
    sim_add_tool(fixture->sim, &table);
    gate_init(&fixture->gate, fixture->sim, 0.2, &fixture->arena);
    *state = fixture;
    return 0;
}

static int tear_down(void **state)
{
    FREED Fixture *fixture = *state;
    arena_destroy(&fixture->arena);
    state_destroy(&fixture->state);
    return 0;
}

static Refusal pass_numbered(Fixture *fixture, int32_t sequence, int64_t utime, bool active,
                             int sender, int tool, int64_t now_us)
{
    Input input = {.kind = INPUT_POSE,
                   .pose = {.sender = sender,
                            .sequence = sequence,
                            .utime = utime,
                            .tool = tool,
                            .orientation = {1.0},
                            .active = active}};
    unsigned char data[INPUT_WIRE_MAX];
    size_t size = input_encode(&input, data);
    static GateResult result;
    gate_pass(&fixture->gate, INPUT_POSE, data, size, now_us, &result);
    return result.refusal;
}

static Refusal pass_pose(Fixture *fixture, int sender, int tool, bool active, int64_t now_us)
{
    return pass_numbered(fixture, 0, 0, active, sender, tool, now_us);
}

// At a time, of a kind of command.
static Passage pass_at(Fixture *fixture, int sender, int id, int64_t now_us, int kind,
                       const Answer **answer)
{
    Input input = {.kind = INPUT_COMMAND, .command = {.sender = sender, .id = id, .kind = kind}};
    unsigned char data[INPUT_WIRE_MAX];
    size_t size = input_encode(&input, data);
    static GateResult result;
    gate_pass(&fixture->gate, INPUT_COMMAND, data, size, now_us, &result);
    if (answer != NULL)
        *answer = result.answer;
    return result.passage;
}

static Passage pass_request(Fixture *fixture, int sender, int id, const Answer **answer)
{
    return pass_at(fixture, sender, id, 0, 1, answer);
}

static void answer_request(Fixture *fixture, int sender, int id)
{
    const Answer answer = {.kind = INPUT_COMMAND, .sender = sender, .id = id, .ok = true};
    gate_answer(&fixture->gate, &answer);
}

AROUND_EACH(set_up, tear_down)

TEST(a_tool_belongs_to_its_first_sender_until_stale_or_given_up)
{
    Fixture *fixture = *test_state;
    assert_int_equal(pass_pose(fixture, 1, 1, true, 1000), ACCEPTED);
    assert_int_equal(pass_pose(fixture, 2, 1, true, 2000), REFUSED_OWNER);
    assert_int_equal(pass_pose(fixture, 2, 1, false, 2000), REFUSED_OWNER); // nor withdrawn
    assert_int_equal(pass_pose(fixture, 1, 1, true, 100000), ACCEPTED);
    assert_int_equal(pass_pose(fixture, 2, 1, true, 300000), REFUSED_OWNER); // exactly 0.2 s
    assert_int_equal(pass_pose(fixture, 2, 1, true, 300001), ACCEPTED);      // stale: taken over
    assert_int_equal(pass_pose(fixture, 1, 1, true, 300002), REFUSED_OWNER);
    assert_int_equal(pass_pose(fixture, 2, 1, false, 300003), ACCEPTED); // given up
    assert_int_equal(pass_pose(fixture, 1, 1, true, 300004), ACCEPTED);
    assert_int_equal(fixture->gate.refused[REFUSED_OWNER], 4);
    assert_int_equal(gate_refused(&fixture->gate), 4);
}

TEST(a_pose_that_was_overtaken_is_refused_whatever_clocks_and_counts_do)
{
    Fixture *f = *test_state;
    const int64_t hour = INT64_C(3600000000);
    assert_int_equal(pass_numbered(f, 10, 5000, true, 1, 1, 1000), ACCEPTED);
    assert_int_equal(pass_numbered(f, 9, 4000, true, 1, 1, 2000), REFUSED_LATE);
    assert_int_equal(pass_numbered(f, 10, 5000, true, 1, 1, 3000), ACCEPTED); // came twice
    assert_int_equal(pass_numbered(f, 12, 7000, false, 1, 1, 4000), ACCEPTED);
    assert_int_equal(pass_numbered(f, 11, 6000, true, 1, 1, 5000), REFUSED_LATE); // it is given up
    // The sender's clock is set back, then forward; its counter starts again; it wraps.
    assert_int_equal(pass_numbered(f, 13, 8000 - hour, true, 1, 1, 6000), ACCEPTED);
    assert_int_equal(pass_numbered(f, 14, 9000 + hour, true, 1, 1, 7000), ACCEPTED);
    assert_int_equal(pass_numbered(f, 0, 10000 + hour, true, 1, 1, 8000), ACCEPTED);
    assert_int_equal(pass_numbered(f, INT32_MAX, 11000 + hour, true, 1, 1, 9000), ACCEPTED);
    assert_int_equal(pass_numbered(f, INT32_MIN, 12000 + hour, true, 1, 1, 10000), ACCEPTED);
    assert_int_equal(pass_numbered(f, INT32_MAX, 11000 + hour, true, 1, 1, 11000), REFUSED_LATE);
    // Of another sender, or long after: not overtaken.
    assert_int_equal(pass_numbered(f, INT32_MAX, 11000 + hour, true, 1, 1, 500000), ACCEPTED);
    assert_int_equal(pass_numbered(f, INT32_MAX - 1, 0, true, 2, 1, 900000), ACCEPTED);
    assert_int_equal(f->gate.refused[REFUSED_LATE], 3);
}

TEST(static_and_unknown_tools_take_no_poses)
{
    Fixture *fixture = *test_state;
    assert_int_equal(pass_pose(fixture, 1, 4, true, 0), REFUSED_TOOL);
    assert_int_equal(pass_pose(fixture, 1, 2, true, 0), REFUSED_TOOL);
}

TEST(a_repeat_is_pending_then_answered_from_the_store)
{
    Fixture *fixture = *test_state;
    const Answer *stored;
    assert_int_equal(pass_request(fixture, 5, 1, NULL), PASSAGE_OPEN);
    assert_int_equal(pass_request(fixture, 5, 1, NULL), PASSAGE_PENDING);
    assert_int_equal(pass_request(fixture, 6, 1, NULL), PASSAGE_OPEN); // another sender
    Answer answer = {
        .kind = INPUT_COMMAND, .sender = 5, .id = 1, .ok = true, .step = 42, .after_frame = true};
    gate_answer(&fixture->gate, &answer);
    assert_int_equal(pass_request(fixture, 5, 1, &stored), PASSAGE_ANSWERED);
    assert_int_equal(stored->step, 42);
    assert_false(stored->after_frame);
    assert_int_equal(pass_request(fixture, 6, 1, NULL), PASSAGE_PENDING);
}

TEST(the_newest_answers_of_a_sender_are_kept)
{
    Fixture *fixture = *test_state;
    for (int id = 0; id <= GATE_ANSWERS; id++) {
        assert_int_equal(pass_request(fixture, 5, id, NULL), PASSAGE_OPEN);
        Answer answer = {.kind = INPUT_COMMAND, .sender = 5, .id = id};
        gate_answer(&fixture->gate, &answer);
    }
    // It has half of the places: the others are left to others.
    assert_int_equal(pass_request(fixture, 5, GATE_ANSWERS / 2, NULL), PASSAGE_ANSWERED);
    assert_int_equal(pass_request(fixture, 5, GATE_ANSWERS, NULL), PASSAGE_ANSWERED);
    assert_int_equal(pass_request(fixture, 5, 0, NULL), PASSAGE_OPEN); // the oldest went
    assert_int_equal(pass_request(fixture, 7, 0, NULL), PASSAGE_OPEN);
}

TEST(a_flood_of_one_sender_makes_no_other_sender_s_repeat_new)
{
    Fixture *fixture = *test_state;
    assert_int_equal(pass_request(fixture, 5, 1, NULL), PASSAGE_OPEN);
    const Answer answer = {.kind = INPUT_COMMAND, .sender = 5, .id = 1, .ok = true, .step = 42};
    gate_answer(&fixture->gate, &answer);
    for (int id = 0; id < 10 * GATE_ANSWERS; id++) {
        assert_int_equal(pass_request(fixture, 66, id, NULL), PASSAGE_OPEN);
        const Answer done = {.kind = INPUT_COMMAND, .sender = 66, .id = id};
        gate_answer(&fixture->gate, &done);
    }
    const Answer *stored;
    assert_int_equal(pass_request(fixture, 5, 1, &stored), PASSAGE_ANSWERED);
    assert_int_equal(stored->step, 42);
    // Its own newest are kept, too.
    assert_int_equal(pass_request(fixture, 66, 10 * GATE_ANSWERS - 500, NULL), PASSAGE_ANSWERED);
}

TEST(refused_requests_of_many_senders_make_no_repeat_new)
{
    Fixture *fixture = *test_state;
    pass_request(fixture, 5, 1, NULL);
    answer_request(fixture, 5, 1);
    for (int sender = 100; sender < 100 + 2 * GATE_ANSWERS; sender++)
        assert_int_equal(pass_at(fixture, sender, 1, 0, 99, NULL), PASSAGE_REFUSED);
    assert_int_equal(pass_request(fixture, 5, 1, NULL), PASSAGE_ANSWERED);
}

// Neither a pending request nor one that may still be repeated gives its place to another sender's.
TEST(what_may_be_repeated_keeps_its_place)
{
    Fixture *fixture = *test_state;
    enum { RESUME = 2, PAUSE = 1, PLACES = GATE_ANSWERS - GATE_URGENT, LATER = GATE_REPEAT_US };
    for (int sender = 0; sender < PLACES; sender++) {
        assert_int_equal(pass_at(fixture, sender, 1, 0, RESUME, NULL), PASSAGE_OPEN);
        if (sender > 0)
            answer_request(fixture, sender, 1); // that of sender 0 stays pending
    }
    assert_int_equal(pass_at(fixture, PLACES, 1, LATER - 1, RESUME, NULL), PASSAGE_REFUSED);
    assert_int_equal(fixture->gate.refused[REFUSED_FULL], 1);
    assert_int_equal(pass_at(fixture, PLACES, 2, LATER - 1, PAUSE, NULL), PASSAGE_OPEN); // urgent
    // Later the oldest answered one goes, and one more each time.
    assert_int_equal(pass_at(fixture, PLACES, 1, LATER, RESUME, NULL), PASSAGE_OPEN);
    assert_int_equal(pass_at(fixture, 0, 1, LATER, RESUME, NULL), PASSAGE_PENDING);
    assert_int_equal(pass_at(fixture, 2, 1, LATER, RESUME, NULL), PASSAGE_ANSWERED);
    assert_int_equal(pass_at(fixture, 1, 1, LATER, RESUME, NULL), PASSAGE_OPEN);
}

// Twice does no harm, and the one who needs it is not who floods.
TEST(no_flood_of_urgent_requests_keeps_one_away)
{
    Fixture *fixture = *test_state;
    enum { PAUSE = 1, STOP = 8 };
    for (int sender = 0; sender < GATE_ANSWERS; sender++)
        assert_int_equal(pass_at(fixture, sender, 1, 0, PAUSE, NULL), PASSAGE_OPEN);
    assert_int_equal(pass_at(fixture, GATE_ANSWERS, 1, 0, STOP, NULL), PASSAGE_OPEN);
    assert_int_equal(pass_at(fixture, GATE_ANSWERS, 1, 0, STOP, NULL), PASSAGE_OPEN);
    assert_int_equal(pass_at(fixture, 5, 1, 0, PAUSE, NULL), PASSAGE_PENDING);
}

TEST(a_request_for_which_there_was_no_room_is_tried_again)
{
    Fixture *fixture = *test_state;
    assert_int_equal(pass_request(fixture, 5, 1, NULL), PASSAGE_OPEN);
    assert_int_equal(pass_request(fixture, 5, 2, NULL), PASSAGE_OPEN);
    assert_int_equal(gate_pending(&fixture->gate, 5, true), 2);
    const Input input = {.kind = INPUT_COMMAND, .sender = 5, .id = 1};
    gate_forget(&fixture->gate, &input);
    assert_int_equal(gate_pending(&fixture->gate, 5, true), 1);
    assert_int_equal(pass_request(fixture, 5, 1, NULL), PASSAGE_OPEN);
}

TEST(what_is_due_is_evenly_spread_and_counted_exactly)
{
    const struct {
        double hz, rate_hz;
        int expected; // in ten simulated seconds
    } cases[] = {{60.0, 1000.0, 600},  {1000.0, 1000.0, 10000}, {2000.0, 1000.0, 10000},
                 {0.5, 1000.0, 5},     {0.0, 1000.0, 0},        {2.0, 333.0, 20},
                 {29.97, 1000.0, 299}, {1000.0, 1.0, 10}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        int64_t last = 0, widest = 0;
        int count = 0;
        for (int64_t step = 1; step <= (int64_t)(10.0 * cases[i].rate_hz); step++) {
            if (!loop_due(step, cases[i].hz, cases[i].rate_hz))
                continue;
            widest = step - last > widest ? step - last : widest;
            last = step;
            count++;
        }
        assert_int_equal(count, cases[i].expected);
        if (count > 1) // neighbours differ by one tick at most
            expect_at_most((double)widest, ceil(cases[i].rate_hz / cases[i].hz) + 0.0);
    }
    assert_int_equal(loop_ticks(0.0001, 100.0), 1);
    assert_int_equal(loop_ticks(0.0, 100.0), 0);
}

TEST(urls_that_lcm_lacks_are_named)
{
    const char *const bad[] = {"http://x",
                               "udpm://10.0.0.1:7667",
                               "udpm://239.1.1.1:0",
                               "udpm://239.1.1.1:99999",
                               "udpm://239.1.1.1:1x",
                               "udpm://239.1.1.1"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        Network network;
        char why[RECEIVER_WHY_MAX];
        assert_false(network_read(&network, bad[i], why));
        expect_in(why, bad[i]);
    }
    Network network;
    char why[RECEIVER_WHY_MAX];
    assert_true(network_read(&network, "memq://", why) && !network.udpm);
    assert_true(network_read(&network, "tcpq://localhost:7700", why) && !network.udpm);
    assert_true(network_read(&network, "udpm://239.1.2.3:99?ttl=1&recv_buf_size=0x1000", why));
    assert_true(network.udpm && network.ttl == 1 && network.receive_bytes == 4096);
    assert_int_equal(network.port, 99);
    assert_int_equal(network.group, 0xef010203);
}

// Events with hostile lengths, each file read to its end or its fault.
TEST(hostile_event_logs_end_with_a_sentence)
{
    char path[] = "/tmp/pliant-log-XXXXXX";
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    close(fd);
    const unsigned char good[] = {0xED, 0xA1, 0xDA, 0x01, 0, 0, 0, 0, 0, 0, 0, 0, 0,   0,   0,  0,
                                  0,    0,    0,    9,    0, 0, 0, 1, 0, 0, 0, 2, 'c', 'x', 'y'};
    for (size_t at = 0; at < sizeof good; at++) {
        for (int value = 0; value < 256; value += 17) {
            unsigned char bytes[2 * sizeof good];
            memcpy(bytes, good, sizeof good);
            memcpy(bytes + sizeof good, good, sizeof good);
            bytes[at] = (unsigned char)value;
            FILE *file = fopen(path, "wb");
            assert_non_null(file);
            fwrite(bytes, 1, sizeof bytes, file);
            fclose(file);
            EventLog log;
            Status status = {0};
            static LogEvent event;
            assert_true(event_log_open(&log, path, &status));
            int events = 0;
            while (event_log_next(&log, &event, &status))
                events++;
            assert_true(events <= 2 && (events == 2 || status.code == STATUS_INVALID));
            event_log_close(&log);
        }
    }
    unlink(path);
}
