// SPDX-License-Identifier: MIT
// A hundred subscribers of one daemon: all of them get what is published, and the daemon's own
// figures beside those of a run with one.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "figure.h"

#include "effort.h"

enum { CROWD = 100 };

typedef struct Listener {
    lcm_t *lcm;
    lcm_subscription_t *on;
    int messages;
} Listener;

static Listener listener[CROWD];

static void on_message(const lcm_recv_buf_t *message, const char *channel, void *user)
{
    (void)message;
    (void)channel;
    ((Listener *)user)->messages++;
}

static void open_listeners(int count)
{
    for (int i = 0; i < count; i++) {
        listener[i] = (Listener){.lcm = lcm_create(NULL)};
        assert_non_null(listener[i].lcm);
        listener[i].on =
            lcm_subscribe(listener[i].lcm, "PLIANT_NODES_sphere", on_message, &listener[i]);
        lcm_subscription_set_queue_capacity(listener[i].on, 1000);
    }
}

static void close_listeners(int count)
{
    for (int i = 0; i < count; i++) {
        lcm_unsubscribe(listener[i].lcm, listener[i].on);
        lcm_destroy(listener[i].lcm);
    }
}

// Until each has heard so many messages.
static void listen_to_all(Client *client, int count, int wanted)
{
    int least = 0;
    for (double limit = client_now() + 60.0; least < wanted && client_now() < limit;) {
        client_listen(client, 20);
        least = client->frames.whole;
        for (int i = 0; i < count; i++) {
            while (lcm_handle_timeout(listener[i].lcm, 0) > 0) {
            }
            least = listener[i].messages < least ? listener[i].messages : least;
        }
    }
    expect_at_least(least, wanted);
}

static void times_line(const Process *daemon, const char *name, char line[128])
{
    const char *at = strstr(daemon->out, name);
    assert_non_null(at);
    snprintf(line, 128, "%.*s", (int)strcspn(at, "\n"), at);
}

TEST(a_hundred_subscribers_all_get_what_is_published)
{
    for (int count = 0; count <= CROWD; count += CROWD) {
        SCOPED_CLIENT Client *client = client_create();
        daemon_start(&pliantd, "%s",
                     write_scene("crowd.cfg",
                                 "rate_hz = 1000.0; publish = { nodes_hz = 30.0; status_hz = 10.0; "
                                 "contact_hz = 100.0; };",
                                 PROBE_TOOL));
        client_wait_for_daemon(client);
        open_listeners(count);
        client->frames.whole = 0;
        listen_to_all(client, count, EFFORT(60));
        process_end(&pliantd);
        assert_null(strstr(pliantd.out, "not published"));
        char step[128], wake[128];
        times_line(&pliantd, "step time: ", step);
        times_line(&pliantd, "wake-up: ", wake);
        figure("%d subscribers: %s; %s; %lld of %lld ticks late", count + 1, step, wake,
               printed(&pliantd, "late ticks"),
               printed(&pliantd, "ticks") + printed(&pliantd, "late ticks"));
        close_listeners(count);
    }
}
