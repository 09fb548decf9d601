// SPDX-License-Identifier: MIT
// Nothing that arrives stops the loop: every message that does not fit is refused, counted by its
// reason, and changes nothing.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

static const char *const channels[] = {"PLIANT_TOOL_POSE", "PLIANT_CUT", "PLIANT_LOAD",
                                       "PLIANT_COMMAND", "PLIANT_TIE"};
enum { CHANNELS = sizeof channels / sizeof *channels };
static Process the_daemon;

static int start_daemon(void **state)
{
    Client *client = client_create();
    daemon_start(
        &the_daemon, "%s",
        write_scene("hostile.cfg", "publish = { status_hz = 20.0; nodes_hz = 5.0; };", PROBE_TOOL));
    client_wait_for_daemon(client);
    *state = client;
    return 0;
}

static int stop_daemon(void **state)
{
    process_finish(&the_daemon, SIGTERM);
    client_destroy(*state);
    return the_daemon.code;
}

static void expect_alive(Client *client)
{
    int64_t step = client->status.step;
    wait_until(client, client->status.step > step);
}

static size_t encode_valid(int channel, unsigned char *data)
{
    char text[] = "sphere";
    switch (channel) {
    case 0: {
        pliant_tool_pose_t m = {.tool = 1, .orientation = {1.0, 0.0, 0.0, 0.0}};
        return (size_t)pliant_tool_pose_t_encode(data, 0, 512, &m);
    }
    case 1: {
        pliant_cut_t m = {.body = text};
        return (size_t)pliant_cut_t_encode(data, 0, 512, &m);
    }
    case 2: {
        pliant_load_t m = {.radius = 1.0, .duration = 1e-3, .body = text};
        return (size_t)pliant_load_t_encode(data, 0, 512, &m);
    }
    case 4: {
        pliant_tie_t m = {.action = 99, .body = text};
        return (size_t)pliant_tie_t_encode(data, 0, 512, &m);
    }
    default: {
        pliant_command_t m = {.kind = 99, .argument = text};
        return (size_t)pliant_command_t_encode(data, 0, 512, &m);
    }
    }
}

// Messages that are to be refused.
typedef struct Batch {
    int count;
    struct {
        int channel;
        size_t size;
        unsigned char data[600];
    } message[2048];
} Batch;

static void add(Batch *batch, int channel, const unsigned char *data, size_t size)
{
    assert_in_range(batch->count, 0, sizeof batch->message / sizeof *batch->message - 1);
    assert_in_range(size, 0, sizeof batch->message->data);
    batch->message[batch->count].channel = channel;
    batch->message[batch->count].size = size;
    memcpy(batch->message[batch->count++].data, data, size);
}

static int64_t refusals(const Client *client, const char *reason)
{
    return reason != NULL ? refused(client, reason) : client->status.rejected;
}

// Sends the messages [from, to); true when each was counted. A busy machine may lose some.
static bool all_are_counted(Client *client, const char *reason, const Batch *batch, int from,
                            int to)
{
    client_fresh_status(client);
    const int64_t expected = refusals(client, reason) + to - from;
    for (int i = from; i < to; i++) {
        send_bytes(client, channels[batch->message[i].channel], batch->message[i].data,
                   batch->message[i].size);
        client_listen(client, 0);
    }
    for (double limit = client_now() + 2.0;
         refusals(client, reason) < expected && client_now() < limit;)
        client_listen(client, 20);
    assert_true(refusals(client, reason) <= expected);
    return refusals(client, reason) == expected;
}

// Each message is refused, once, for this reason (NULL: for any). What was lost is sent again, a
// part at a time.
static void expect_refused(Client *client, const char *reason, const Batch *batch)
{
    enum { PART = 64, ATTEMPTS = 20 };
    for (int from = 0; from < batch->count; from += PART) {
        const int to = from + PART < batch->count ? from + PART : batch->count;
        int attempt = 0;
        while (attempt < ATTEMPTS && !all_are_counted(client, reason, batch, from, to))
            attempt++;
        assert_true(attempt < ATTEMPTS);
    }
    expect_alive(client);
}

AROUND_ALL(start_daemon, stop_daemon)

TEST(garbage_of_every_size_is_refused_and_counted)
{
    Client *client = *test_state;
    static Batch batch;
    unsigned char data[600];
    srand(7);
    for (size_t size = 0; size <= sizeof data; size += 3) {
        for (size_t i = 0; i < size; i++)
            data[i] = (unsigned char)rand();
        for (int c = 0; c < CHANNELS; c++)
            add(&batch, c, data, size);
    }
    expect_refused(client, NULL, &batch);
    assert_true(refused(client, "wrong_size") > 0 && refused(client, "wrong_type") > 0);
    // Each kind on its own, so that one sees which program is of another version.
    assert_true(refused(client, "wrong_type_cut_t") > 0);
}

TEST(cut_off_and_padded_messages_are_refused)
{
    Client *client = *test_state;
    static Batch batch;
    for (int c = 0; c < CHANNELS; c++) {
        unsigned char data[1024] = {0};
        size_t size = encode_valid(c, data);
        for (size_t cut = 8; cut < size; cut++)
            add(&batch, c, data, cut);
        for (size_t more = 1; more < 20; more++)
            add(&batch, c, data, size + more);
    }
    expect_refused(client, NULL, &batch);
}

TEST(corrupt_string_counts_are_refused)
{
    Client *client = *test_state;
    const uint32_t counts[] = {0, 1, 6, 8, 0x40000003, 0x7fffffff, 0x80000000, 0xffffffff};
    static Batch wrong_counts, wrong_ends;
    for (int c = 1; c < CHANNELS; c++) {
        unsigned char data[512];
        const size_t size = encode_valid(c, data);
        unsigned char *at = data + size - 7 - 4; // "sphere" and its NUL behind the count
        for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
            for (int b = 0; b < 4; b++)
                at[b] = (unsigned char)(counts[i] >> (24 - 8 * b));
            add(&wrong_counts, c, data, size);
        }
        encode_valid(c, data);
        data[size - 1] = 'x'; // no end
        add(&wrong_ends, c, data, size);
        data[size - 1] = '\0';
        data[size - 3] = '\0'; // an end inside
        add(&wrong_ends, c, data, size);
    }
    const int64_t before = refused(client, "bad_string");
    expect_refused(client, NULL, &wrong_counts);
    assert_int_equal(refused(client, "bad_string"), before); // refused for their size
    expect_refused(client, "bad_string", &wrong_ends);
}

static void add_pose(Batch *batch, const pliant_tool_pose_t *pose)
{
    unsigned char data[512];
    const int size = pliant_tool_pose_t_encode(data, 0, sizeof data, pose);
    add(batch, 0, data, (size_t)size);
}

TEST(bad_values_are_refused_by_their_reason)
{
    Client *client = *test_state;
    const double origin[3] = {0.0, 0.0, 0.2};
    static Batch not_finite, not_unit, out_of_range;
    const double bad[] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
    for (int i = 0; i < 3; i++) {
        pliant_tool_pose_t pose = make_pose(client, origin);
        double *fields[] = {&pose.position[i], &pose.orientation[i], &pose.twist[2 * i],
                            &pose.grip};
        for (int k = 0; k < 4; k++) {
            double kept = *fields[k];
            *fields[k] = bad[i];
            add_pose(&not_finite, &pose);
            *fields[k] = kept;
        }
    }
    pliant_tool_pose_t pose = make_pose(client, origin);
    pose.orientation[0] = 1.002;
    add_pose(&not_unit, &pose);
    pose.orientation[0] = 0.0;
    add_pose(&not_unit, &pose);
    pose = make_pose(client, origin);
    pose.position[1] = -1.1e3;
    add_pose(&out_of_range, &pose);
    expect_refused(client, "not_finite", &not_finite);
    expect_refused(client, "not_unit_quaternion", &not_unit);
    expect_refused(client, "out_of_range", &out_of_range);
}

TEST(bad_requests_are_answered_with_the_reason)
{
    Client *client = *test_state;
    const double top[3] = {0.0, 0.0, 0.05}, down[3] = {0.0, 0.0, -0.1};
    const double infinite[3] = {0.0, (double)INFINITY, 0.0}, huge[3] = {0.0, 2e6, 0.0};
    const struct {
        const double *center, *force;
        double radius, duration;
        const char *body, *needle;
    } loads[] = {
        {infinite, down, 0.02, 1.0, "sphere", "finite"},
        {top, infinite, 0.02, 1.0, "sphere", "finite"},
        {top, down, (double)NAN, 1.0, "sphere", "finite"},
        {top, huge, 0.02, 1.0, "sphere", "1e+06"},
        {top, down, 0.0, 1.0, "sphere", "radius"},
        {top, down, -1.0, 1.0, "sphere", "radius"},
        {top, down, 0.02, 0.0, "sphere", "duration"},
        {top, down, 0.02, 3601.0, "sphere", "duration"},
        {top, down, 0.02, 1.0, "liver", "liver"},
    };
    for (size_t i = 0; i < sizeof loads / sizeof *loads; i++) {
        const Reply *reply = apply_load(client, loads[i].center, loads[i].radius, loads[i].force,
                                        loads[i].duration, loads[i].body);
        assert_false(reply->ok);
        expect_in(reply->text, loads[i].needle);
        assert_string_equal(reply->channel, "PLIANT_LOAD");
    }
    const struct {
        int kind;
        int64_t value;
        const char *argument;
    } commands[] = {{0, 0, ""},
                    {9, 0, ""},
                    {-1, 0, ""},
                    {PLIANT_COMMAND_T_STEP, 0, ""},
                    {PLIANT_COMMAND_T_STEP, -5, ""},
                    {PLIANT_COMMAND_T_STEP, 10000001, ""},
                    {PLIANT_COMMAND_T_SET, 0, ""},
                    {PLIANT_COMMAND_T_SET, 0, "gravity_z"},
                    {PLIANT_COMMAND_T_SET, 0, "=1"},
                    {PLIANT_COMMAND_T_SET, 0, "gravity_z=down"},
                    {PLIANT_COMMAND_T_SET, 0, "gravity_z=nan"},
                    {PLIANT_COMMAND_T_SET, 0, "gravity_z=1e999"},
                    {PLIANT_COMMAND_T_SET, 0, "gravity=1 2"},
                    {PLIANT_COMMAND_T_SET, 0, "gravity=1e6 0 0"},
                    {PLIANT_COMMAND_T_SET, 0, "friction=1 2 3"},
                    {PLIANT_COMMAND_T_SET, 0, "no_such_key=1"},
                    {PLIANT_COMMAND_T_SET, 0, "liver.friction=1"},
                    {PLIANT_COMMAND_T_CHECKPOINT, 0, "elsewhere.h5"},
                    {PLIANT_COMMAND_T_CHECKPOINT, 0, ""}};
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++) {
        const Reply *reply =
            command(client, commands[i].kind, commands[i].value, commands[i].argument);
        if (reply->ok || reply->text[0] == '\0')
            fail_msg("command %d '%s' was not refused with a reason", commands[i].kind,
                     commands[i].argument);
    }
    expect_alive(client);
}

TEST(refusals_are_told_at_most_once_a_second)
{
    Client *client = *test_state;
    client_fresh_status(client);
    client->events = 0;
    double start = client_now();
    unsigned char byte = 0;
    for (int i = 0; i < 200; i++) {
        send_bytes(client, channels[i % CHANNELS], &byte, 1);
        client_listen(client, 1);
    }
    client_fresh_status(client);
    int told = 0;
    for (int i = 0; i < client->events; i++)
        told += strcmp(client->event[i].kind, "refused") == 0;
    // One reason: at most one event for each second begun.
    expect_at_most(told, 1.0 + ceil(client_now() - start));
}
