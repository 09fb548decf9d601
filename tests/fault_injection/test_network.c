// SPDX-License-Identifier: MIT
// A network that moves to another interface, goes and returns, under a daemon and a client that
// run all the time: they hear each other again, and the daemon says what happened.
#include "test.h"
#include "harness.h"
#include "scene_writer.h"
#include "figure.h"

#include "pliant/client.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

// Of every wait, as in wait_until: far beyond what is asked for, for busy machines.
static const double PATIENCE_S = 60.0;

static const char ADD[] = "ip link add d0 type veth peer name d1 && ip link set d1 up && "
                          "ip link set d0 up multicast on && ip addr add 10.9.9.1/24 dev d0 && "
                          "ip route replace 224.0.0.0/4 dev d0";
#define REMOVE "ip link del d0"

static void run(const char *command)
{
    if (system(command) != 0)
        fail_msg("failed: %s", command);
}

static int64_t utime(void)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

static PliantClient *connect_to(const PliantOptions *options)
{
    PliantError error;
    PliantClient *client = pliant_open(options, &error);
    if (client == NULL)
        fail_msg("%s", error.text);
    return client;
}

// Holds the tool in the body until a contact comes that was computed with a pose of after this
// call: the daemon has heard the client, and the client the daemon. Returns the time it took [s].
static double touch(PliantClient *client)
{
    const PliantPose pose = {.tool = 1, .position = {0.0, 0.0, 0.053}, .active = true};
    const int64_t sent = utime();
    const double start = pliant_now();
    while (pliant_now() < start + PATIENCE_S) {
        pliant_pose(client, &pose); // fails while there is no route
        pliant_wait(client, 0.002);
        const PliantContact *contact = pliant_contact(client, 1);
        if (contact != NULL && contact->contact && contact->pose_utime >= sent)
            return pliant_now() - start;
    }
    fail_msg("the tool is not felt: %s", pliant_error(client));
    return 0.0;
}

static void wait_for_event(PliantClient *client, const char *text)
{
    for (const double limit = pliant_now() + PATIENCE_S; pliant_now() < limit;) {
        for (const PliantEvent *event; (event = pliant_next_event(client)) != NULL;)
            if (strcmp(event->kind, "network") == 0 && strstr(event->text, text) != NULL)
                return;
        pliant_wait(client, 0.02);
    }
    fail_msg("no event 'network' says '%s'", text);
}

static void wait_for_line(const Process *process, const char *text)
{
    for (const double limit = pliant_now() + PATIENCE_S; pliant_now() < limit;) {
        char said[4096] = "";
        FILE *file = fopen(process_errors(process), "r");
        if (file != NULL) { // else the program has not begun
            said[fread(said, 1, sizeof said - 1, file)] = '\0';
            fclose(file);
        }
        if (strstr(said, text) != NULL)
            return;
        nanosleep(&(struct timespec){.tv_nsec = 20000000}, NULL);
    }
    fail_msg("the daemon does not say '%s'", text);
}

static const char SCENE[] =
    "rate_hz = 500.0; publish = { nodes_hz = 50.0; contact_hz = 100.0; status_hz = 20.0; };";

TEST(a_server_and_a_program_that_start_before_the_network_wait_for_it)
{
    Process monitor;
    run("ip route del 224.0.0.0/4 dev lo");
    daemon_start(&pliantd, "%s", write_scene("late.cfg", SCENE, PROBE_TOOL));
    process_start(&monitor, program_path("pliant-monitor"), "--once");
    wait_for_line(&pliantd, "waiting for a network: no route for multicast to 239.255.76.67");
    wait_for_line(&pliantd, "ip route add 224.0.0.0/4 dev lo"); // what to do
    wait_for_line(&monitor, "waiting for a network: no route");
    run("ip route add 224.0.0.0/4 dev lo");
    process_wait_for(&monitor, 0);
    expect_printed(&monitor, "sphere");
    process_end(&pliantd);
    // Said once, however often it was looked for.
    const char *said = strstr(pliantd.err, "waiting for a network");
    assert_null(strstr(said + 1, "waiting for a network"));
}

TEST(a_server_that_waits_for_a_network_ends_by_a_signal)
{
    run("ip route del 224.0.0.0/4 dev lo");
    daemon_start(&pliantd, "%s", write_scene("ends.cfg", SCENE, PROBE_TOOL));
    wait_for_line(&pliantd, "waiting for a network");
    process_finish(&pliantd, SIGTERM);
    assert_int_equal(pliantd.code, 1000 + SIGTERM); // as while it loads
    run("ip route add 224.0.0.0/4 dev lo");
}

// As long as it takes a server to prepare its scene; each then gets its answer.
TEST(programs_wait_for_a_server_that_is_not_there_yet)
{
    static const struct {
        const char *program, *arguments, *answer;
        int code;
    } rows[] = {
        {"pliant-probe", "--auto --depth 0.002 --speed 0.1 --hold 0.1", "round trip", 0},
        {"pliant-probe", "--press 0,0,0.055 --speed 0.1 --hold 0.1", "round trip", 0},
        {"pliant-cut", "--plane 0,0,0,0,0,1", "nothing was cut", 1},
        {"pliant-tie", "--make pin --at 0,0,0.05", "max_ties", 1},
    };
    enum { ROWS = sizeof rows / sizeof *rows };
    static Process process[ROWS];
    for (int k = 0; k < ROWS; k++)
        process_start(&process[k], program_path(rows[k].program), "%s", rows[k].arguments);
    for (int k = 0; k < ROWS; k++)
        wait_for_line(&process[k], "waiting for a server: no ");
    daemon_start(&pliantd, "%s", write_scene("prepared.cfg", SCENE, PROBE_TOOL));
    for (int k = 0; k < ROWS; k++) {
        process_wait_for(&process[k], rows[k].code);
        expect_ended(&process[k], rows[k].code, rows[k].answer);
    }
    process_end(&pliantd);
}

// Packets that came to a device, as its other end counts what was sent.
static long long received_by(const char *device)
{
    char line[256];
    long long count = -1;
    FILE *file = fopen("/proc/net/dev", "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file) != NULL) {
        const char *name = strstr(line, device);
        if (name != NULL && name[strlen(device)] == ':')
            assert_int_equal(sscanf(name + strlen(device) + 1, "%*s %lld", &count), 1);
    }
    fclose(file);
    return count;
}

TEST(a_url_chooses_the_interface_by_name_or_by_address)
{
    // The route leads to one interface, the URL to another, whose other end counts packets.
    run(ADD);
    run("ip link add u0 type veth peer name u1 && ip link set u1 up && ip link set u0 up multicast "
        "on && "
        "ip addr add 10.9.8.1/24 dev u0 && ip route replace 224.0.0.0/4 dev u0");
    daemon_start(&pliantd, "--lcm-url 'udpm://239.255.76.67:7667?ttl=1&interface=d0' %s",
                 write_scene("chosen.cfg", SCENE, PROBE_TOOL));
    const PliantOptions by_address = {.url = "udpm://239.255.76.67:7667?interface=10.9.9.1&ttl=1"};
    PliantClient *client = connect_to(&by_address), *other = connect_to(NULL);
    touch(client);
    expect_at_least((double)received_by("d1"), 10.0); // ten statuses alone are half a second
    // One at the route's end hears nothing, though the daemon speaks all the time.
    assert_false(pliant_wait_status(other, 0.5));
    // Replaced by another of the same name and address, both follow.
    run(REMOVE);
    run(ADD);
    run("ip route replace 224.0.0.0/4 dev u0");
    touch(client);
    pliant_close(other);
    pliant_close(client);
    process_end(&pliantd);
    run(REMOVE " && ip link del u0 && ip route add 224.0.0.0/4 dev lo");
}

TEST(a_server_waits_for_the_interface_of_its_url)
{
    daemon_start(&pliantd, "--lcm-url 'udpm://239.255.76.67:7667?interface=d0' %s",
                 write_scene("absent.cfg", SCENE, PROBE_TOOL));
    wait_for_line(&pliantd, "no interface 'd0' that is up");
    run(ADD);
    const PliantOptions there = {.url = "udpm://239.255.76.67:7667?interface=d0"};
    PliantClient *client = connect_to(&there);
    touch(client);
    pliant_close(client);
    process_end(&pliantd);
    run(REMOVE " && ip route add 224.0.0.0/4 dev lo");
}

TEST(a_network_that_moves_goes_and_returns_is_followed)
{
    daemon_start(&pliantd, "%s", write_scene("network.cfg", SCENE, PROBE_TOOL));
    PliantClient *client = connect_to(NULL);
    touch(client);
    // From the loopback device to another one.
    run(ADD);
    const double moved = touch(client);
    wait_for_event(client, "leads to another interface");
    // That one is replaced by another of the same name.
    run(REMOVE);
    run(ADD);
    const double replaced = touch(client);
    // There is none for a while.
    run(REMOVE);
    wait_for_line(&pliantd, "no route for multicast to 239.255.76.67 any more");
    run(ADD);
    const double back = touch(client);
    wait_for_event(client, "is back after");
    figure("route moved, interface replaced, gone and back: felt again after %.1f, %.1f, %.1f s",
           moved, replaced, back);
    pliant_close(client);
    process_end(&pliantd);
}
