// Nothing that arrives stops the loop: every message that does not fit is refused, counted by its
// reason, and changes nothing.
#include "lcm_client.h"
#include "scene_writer.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>

static const char *const channels[] = {"PLIANT_TOOL_POSE", "PLIANT_CUT", "PLIANT_LOAD",
                                       "PLIANT_COMMAND"};
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
    process_signal(&the_daemon, SIGTERM);
    process_wait(&the_daemon);
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
    default: {
        pliant_command_t m = {.kind = 99, .argument = text};
        return (size_t)pliant_command_t_encode(data, 0, 512, &m);
    }
    }
}

static void garbage_of_every_size_is_refused_and_counted(void **state)
{
    Client *client = *state;
    client_fresh_status(client);
    int64_t before = client->status.rejected;
    unsigned char data[600];
    srand(7);
    int sent = 0;
    for (size_t size = 0; size <= sizeof data; size += 3) {
        for (size_t i = 0; i < size; i++)
            data[i] = (unsigned char)rand();
        for (int c = 0; c < 4; c++, sent++)
            send_bytes(client, channels[c], data, size);
        client_listen(client, 1);
    }
    wait_until(client, client->status.rejected == before + sent);
    assert_true(refused(client, "wrong_size") > 0 && refused(client, "wrong_type") > 0);
    expect_alive(client);
}

static void cut_off_and_padded_messages_are_refused(void **state)
{
    Client *client = *state;
    client_fresh_status(client);
    int64_t before = client->status.rejected;
    int sent = 0;
    for (int c = 0; c < 4; c++) {
        unsigned char data[1024] = {0};
        size_t size = encode_valid(c, data);
        for (size_t cut = 8; cut < size; cut++, sent++) {
            send_bytes(client, channels[c], data, cut);
            client_listen(client, 0);
        }
        for (size_t more = 1; more < 20; more++, sent++)
            send_bytes(client, channels[c], data, size + more);
        client_listen(client, 1);
    }
    wait_until(client, client->status.rejected == before + sent);
    expect_alive(client);
}

static void corrupt_string_counts_are_refused(void **state)
{
    Client *client = *state;
    client_fresh_status(client);
    int64_t before = client->status.rejected;
    const uint32_t counts[] = {0, 1, 6, 8, 0x40000003, 0x7fffffff, 0x80000000, 0xffffffff};
    int sent = 0;
    for (int c = 1; c < 4; c++) {
        for (size_t i = 0; i < sizeof counts / sizeof *counts; i++, sent++) {
            unsigned char data[512];
            size_t size = encode_valid(c, data);
            unsigned char *at = data + size - 7 - 4; // "sphere" and its NUL behind the count
            for (int b = 0; b < 4; b++)
                at[b] = (unsigned char)(counts[i] >> (24 - 8 * b));
            send_bytes(client, channels[c], data, size);
        }
        unsigned char data[512];
        size_t size = encode_valid(c, data);
        data[size - 1] = 'x'; // no end
        send_bytes(client, channels[c], data, size);
        data[size - 1] = '\0';
        data[size - 3] = '\0'; // an end inside
        send_bytes(client, channels[c], data, size);
        sent += 2;
    }
    wait_until(client, client->status.rejected == before + sent);
    assert_int_equal(refused(client, "bad_string"), 6);
    expect_alive(client);
}

static void bad_values_are_refused_by_their_reason(void **state)
{
    Client *client = *state;
    client_fresh_status(client);
    const double origin[3] = {0.0, 0.0, 0.2};
    int64_t finite = refused(client, "not_finite"), unit = refused(client, "not_unit_quaternion");
    int64_t range = refused(client, "out_of_range");

    const double bad[] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
    for (int i = 0; i < 3; i++) {
        pliant_tool_pose_t pose = make_pose(client, origin);
        double *fields[] = {&pose.position[i], &pose.orientation[i], &pose.twist[2 * i],
                            &pose.grip};
        for (int k = 0; k < 4; k++) {
            double kept = *fields[k];
            *fields[k] = bad[i];
            send_pose(client, &pose);
            *fields[k] = kept;
        }
    }
    pliant_tool_pose_t pose = make_pose(client, origin);
    pose.orientation[0] = 1.002;
    send_pose(client, &pose);
    pose.orientation[0] = 0.0;
    send_pose(client, &pose);
    pose = make_pose(client, origin);
    pose.position[1] = -1.1e3;
    send_pose(client, &pose);
    wait_until(client, refused(client, "not_finite") == finite + 12);
    wait_until(client, refused(client, "not_unit_quaternion") == unit + 2);
    wait_until(client, refused(client, "out_of_range") == range + 1);
    expect_alive(client);
}

static void bad_requests_are_answered_with_the_reason(void **state)
{
    Client *client = *state;
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
        int32_t id = send_load(client, loads[i].center, loads[i].radius, loads[i].force,
                               loads[i].duration, loads[i].body);
        wait_until(client, find_reply(client, id) != NULL);
        assert_false(find_reply(client, id)->ok);
        if (strstr(find_reply(client, id)->text, loads[i].needle) == NULL)
            fail_msg("no '%s' in '%s'", loads[i].needle, find_reply(client, id)->text);
        assert_string_equal(find_reply(client, id)->channel, "PLIANT_LOAD");
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

static void refusals_are_told_at_most_once_a_second(void **state)
{
    Client *client = *state;
    client_fresh_status(client);
    client->events = 0;
    double start = client_now();
    unsigned char byte = 0;
    for (int i = 0; i < 200; i++) {
        send_bytes(client, channels[i % 4], &byte, 1);
        client_listen(client, 1);
    }
    client_fresh_status(client);
    int told = 0;
    for (int i = 0; i < client->events; i++)
        told += strcmp(client->event[i].kind, "refused") == 0;
    // One reason: at most one event for each second begun.
    expect_at_most(told, 1.0 + ceil(client_now() - start));
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(garbage_of_every_size_is_refused_and_counted),
        cmocka_unit_test(cut_off_and_padded_messages_are_refused),
        cmocka_unit_test(corrupt_string_counts_are_refused),
        cmocka_unit_test(bad_values_are_refused_by_their_reason),
        cmocka_unit_test(bad_requests_are_answered_with_the_reason),
        cmocka_unit_test(refusals_are_told_at_most_once_a_second),
    };
    harness_start(argc, argv);
    return harness_end(cmocka_run_group_tests(tests, start_daemon, stop_daemon));
}
