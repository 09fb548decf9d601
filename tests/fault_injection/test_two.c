// SPDX-License-Identifier: MIT
// Two daemons on one output prefix: the second is refused, on one host and between two; what slips
// through because packets were lost, the link was cut or the first was stopped ends as soon as they
// hear each other, and one of them is left.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "hosts.h"

#include "pliant_claim_t.h"
#include "pliant_status_t.h"

static const char *write_small(void)
{
    return write_scene(
        "two.cfg",
        "rate_hz = 200.0; remote = true; publish = { nodes_hz = 10.0; status_hz = 10.0; };", "");
}

static void start_on(Host host, Process *daemon)
{
    hosts_enter(host);
    daemon_start(daemon, "%s", write_small());
    hosts_enter(HOST_SERVER);
}

static Client *client_on(Host host)
{
    hosts_enter(host);
    Client *client = client_create();
    hosts_enter(HOST_SERVER);
    return client;
}

static void expect_refused(Process *second)
{
    process_wait_for(second, 1);
    if (strstr(second->err, "another daemon publishes on PLIANT_STATUS") == NULL ||
        strstr(second->err, "another --prefix") == NULL)
        fail_msg("it said: %s", second->err);
}

static void expect_alive(Client *client, Process *daemon)
{
    int64_t step = client->status.step;
    wait_until(client, client->status.step > step + 20);
    server_stop(client, daemon);
}

// A good link, the first daemon on the server's host, and a client beside it that has heard it.
static Client *start_first(Process *first)
{
    hosts_fault(NULL);
    Client *client = client_on(HOST_SERVER);
    start_on(HOST_SERVER, first);
    client_wait_for_daemon(client);
    return client;
}

AROUND_ALL(hosts_begin, hosts_end)

TEST(a_second_daemon_is_refused_on_one_host_and_between_two)
{
    static const Host HOSTS[] = {HOST_SERVER, HOST_CLIENT};
    Process first, second;
    SCOPED_CLIENT Client *client = start_first(&first);
    for (int i = 0; i < 2; i++) {
        start_on(HOSTS[i], &second);
        expect_refused(&second);
    }
    expect_alive(client, &first);
}

// A paused one publishes seldom: it is asked, not waited for.
TEST(a_paused_daemon_holds_its_prefix)
{
    Process first, second;
    SCOPED_CLIENT Client *client = start_first(&first);
    assert_true(command(client, PLIANT_COMMAND_T_PAUSE, 0, "")->ok);
    start_on(HOST_CLIENT, &second);
    expect_refused(&second);
    assert_true(command(client, PLIANT_COMMAND_T_RESUME, 0, "")->ok);
    expect_alive(client, &first);
}

TEST(a_second_daemon_on_a_lossy_link_ends_and_the_first_does_not)
{
    Process first, second;
    SCOPED_CLIENT Client *client = start_first(&first);
    for (int i = 0; i < 3; i++) { // at its start or a moment later
        hosts_fault(&(LinkFaults){.loss = 0.5});
        start_on(HOST_CLIENT, &second);
        process_wait_for(&second, 1);
        expect_in(second.err, "another daemon");
    }
    expect_alive(client, &first);
}

TEST(of_two_that_started_apart_the_later_ends_when_the_link_is_back)
{
    Process first, second;
    SCOPED_CLIENT Client *client = start_first(&first), *other = client_on(HOST_CLIENT);
    hosts_fault(&(LinkFaults){.cut = true});
    int early = other->status.count;
    start_on(HOST_CLIENT, &second);
    // Statuses that were on their way may still come; new ones are the second's.
    wait_until(other, other->status.count > early + 5);
    hosts_fault(NULL);
    process_wait_for(&second, 1);
    expect_in(second.err, "has held the prefix PLIANT for longer");
    wait_until(client, saw_event(client, "rival") || saw_event(client, "yielded"));
    expect_alive(client, &first);
}

TEST(a_daemon_that_was_stopped_ends_when_another_has_taken_its_place)
{
    Process first, second;
    SCOPED_CLIENT Client *client = start_first(&first);
    process_signal(&first, SIGSTOP);
    client_listen(client, 100); // what it has sent before
    int before = client->status.count;
    start_on(HOST_CLIENT, &second);
    // Away for more than a second: before that, the first would stay.
    double enough = client_now() + 1.5;
    wait_until(client, client->status.count > before + 5 && client_now() > enough);
    process_signal(&first, SIGCONT);
    process_wait_for(&first, 1);
    expect_in(first.err, "has held the prefix PLIANT for longer");
    expect_alive(client, &second);
}

TEST(a_daemon_that_was_stopped_alone_goes_on)
{
    Process first;
    SCOPED_CLIENT Client *client = start_first(&first);
    process_signal(&first, SIGSTOP);
    for (double end = client_now() + 1.0; client_now() < end;)
        client_listen(client, 20);
    process_signal(&first, SIGCONT);
    expect_alive(client, &first);
}

// --- a log that is played back ---

typedef struct Logged {
    unsigned char data[4096];
    uint32_t size;
} Logged;

static void keep(const lcm_recv_buf_t *message, const char *channel, void *user)
{
    (void)channel;
    Logged *logged = user;
    if (message->data_size <= sizeof logged->data) {
        memcpy(logged->data, message->data, message->data_size);
        logged->size = message->data_size;
    }
}

TEST(a_log_that_is_played_back_ends_no_daemon)
{
    Process first;
    SCOPED_CLIENT Client *client = start_first(&first);
    Logged status = {.size = 0};
    lcm_subscription_t *on = lcm_subscribe(client->lcm, "PLIANT_STATUS", keep, &status);
    wait_until(client, status.size > 0);
    lcm_unsubscribe(client->lcm, on);
    status.data[15] ^= 0x55; // another utime: one that it did not send
    // An answer and a question of a daemon that has held the prefix for a year.
    pliant_claim_t claim[2] = {{.daemon = 7, .answers = 99, .held = INT64_C(31536000000000)},
                               {.daemon = 7, .question = 98, .held = INT64_C(31536000000000)}};
    for (int i = 0; i < 30; i++) {
        lcm_publish(client->lcm, "PLIANT_STATUS", status.data, status.size);
        pliant_claim_t_publish(client->lcm, "PLIANT_CLAIM", &claim[i % 2]);
        lcm_publish(client->lcm, "PLIANT_CLAIM", status.data, (unsigned)i);
        client_listen(client, 20);
    }
    expect_alive(client, &first);
    assert_false(saw_event(client, "yielded"));
}
