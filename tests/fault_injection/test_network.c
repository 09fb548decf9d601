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
static const char REMOVE[] = "ip link del d0";

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
        assert_non_null(file);
        said[fread(said, 1, sizeof said - 1, file)] = '\0';
        fclose(file);
        if (strstr(said, text) != NULL)
            return;
        nanosleep(&(struct timespec){.tv_nsec = 20000000}, NULL);
    }
    fail_msg("the daemon does not say '%s'", text);
}

TEST(a_network_that_moves_goes_and_returns_is_followed)
{
    daemon_start(&pliantd, "%s",
                 write_scene("network.cfg",
                             "rate_hz = 500.0; publish = { nodes_hz = 50.0; contact_hz = 100.0; "
                             "status_hz = 20.0; };",
                             PROBE_TOOL));
    PliantClient *client = pliant_open(NULL, NULL);
    assert_non_null(client);
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
