// SPDX-License-Identifier: MIT
// Loads, cuts and commands: what they do, that each is answered, and once only.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

#include "pliant_lcmtypes.h"

#include <time.h>

static const char HEAD[] = "publish = { nodes_hz = 20.0; contact_hz = 100.0; status_hz = 20.0; };";
static const double TOP[3] = {0.0, 0.0, 0.05}, DOWN[3] = {0.0, 0.0, -0.2};

static int start_running(void **state)
{
    return fixture_start(state, "%s", write_scene("requests.cfg", HEAD, PROBE_TOOL));
}

static int start_paused(void **state)
{
    char head[512];
    snprintf(head, sizeof head, "start = \"paused\";\n%s", HEAD);
    return fixture_start(state, "%s", write_scene("requests.cfg", head, PROBE_TOOL));
}

AROUND_ALL(start_running, fixture_end)

TEST(a_load_moves_the_body_and_ends)
{
    Client *client = ((Fixture *)*test_state)->client;
    const Reply *reply = apply_load(client, TOP, 0.03, DOWN, 0.5, "sphere");
    assert_true(reply->ok);
    assert_string_equal(reply->channel, "PLIANT_LOAD");
    assert_int_equal(reply->pieces, 1);
    wait_until(client, client->status.max_displacement > 1e-3);
    assert_true(saw_event(client, "load"));
    // Damped shape springs bring it back; a hundredth of the push is enough to tell.
    wait_until(client, client->status.max_displacement < 1e-5);
}

TEST(a_load_on_no_free_node_is_refused)
{
    Client *client = ((Fixture *)*test_state)->client;
    const double far[3] = {5.0, 0.0, 0.0};
    int64_t before = refused(client, "not_possible");
    assert_false(apply_load(client, far, 0.03, DOWN, 0.5, "")->ok);
    wait_until(client, refused(client, "not_possible") == before + 1);
}

static void publish_cut(Client *client, const void *message)
{
    pliant_cut_t_publish(client->lcm, "PLIANT_CUT", message);
}

TEST(a_cut_is_answered_but_not_made)
{
    Client *client = ((Fixture *)*test_state)->client;
    char name[] = "sphere";
    pliant_cut_t cut = {.sender = client->sender,
                        .id = ++client->next_id,
                        .before = {{-0.1, 0.0, 0.1}, {0.1, 0.0, 0.1}},
                        .after = {{-0.1, 0.0, 0.0}, {0.1, 0.0, 0.0}},
                        .body = name};
    const Reply *reply = answer_to(client, cut.id, publish_cut, &cut);
    assert_false(reply->ok);
    assert_string_equal(reply->text, "body 'sphere' is not cuttable (cuttable = true)");
    assert_string_equal(reply->channel, "PLIANT_CUT");
}

TEST(a_repeated_request_is_answered_again_and_not_executed)
{
    Client *client = ((Fixture *)*test_state)->client;
    int64_t step = command(client, PLIANT_COMMAND_T_PAUSE, 0, "")->step;
    assert_int_equal(command(client, PLIANT_COMMAND_T_STEP, 10, "")->step, step + 10);
    const int32_t id = client->next_id;
    for (int i = 0; i < 2; i++) {
        const int before = count_replies(client, id);
        for (double limit = client_now() + 60.0;
             count_replies(client, id) == before && client_now() < limit;) {
            client->next_id = id - 1; // the same id again
            send_command(client, PLIANT_COMMAND_T_STEP, 10, "");
            for (double next = client_now() + 1.0;
                 count_replies(client, id) == before && client_now() < next;)
                client_listen(client, 20);
        }
        assert_true(count_replies(client, id) > before);
        assert_int_equal(find_reply(client, id)->step, step + 10);
        assert_true(find_reply(client, id)->ok);
    }
    assert_int_equal(command(client, PLIANT_COMMAND_T_STEP, 1, "")->step, step + 11);
    command(client, PLIANT_COMMAND_T_RESUME, 0, "");
}

static void on_hello(const lcm_recv_buf_t *buffer, const char *channel, const pliant_hello_t *hello,
                     void *user)
{
    (void)buffer;
    assert_string_equal(channel, "PLIANT_HELLO");
    assert_string_equal(hello->program, "pliantd");
    assert_int_equal(strspn(hello->version, "0123456789."), strlen(hello->version));
    assert_string_equal(hello->prefix, "PLIANT");
    assert_string_equal(hello->input_prefix, "PLIANT");
    assert_int_equal(hello->types, PLIANT_LCMTYPES_COUNT);
    *(bool *)user = true;
}

TEST(a_server_says_which_version_it_is)
{
    Client *client = ((Fixture *)*test_state)->client;
    bool heard = false;
    pliant_hello_t_subscription_t *on =
        pliant_hello_t_subscribe(client->lcm, "PLIANT_HELLO", on_hello, &heard);
    wait_until(client, heard);
    pliant_hello_t_unsubscribe(client->lcm, on);
}

TEST(pause_stops_and_resume_goes_on)
{
    Client *client = ((Fixture *)*test_state)->client;
    const Reply *reply = command(client, PLIANT_COMMAND_T_PAUSE, 0, "");
    assert_true(reply->ok);
    int64_t step = reply->step;
    client_fresh_status(client);
    assert_string_equal(client->status.state, "paused");
    assert_int_equal(client->status.step, step);
    assert_true(saw_event(client, "paused"));
    assert_true(command(client, PLIANT_COMMAND_T_RESUME, 0, "")->ok);
    wait_until(client, client->status.step > step + 100);
    assert_string_equal(client->status.state, "running");
    assert_true(saw_event(client, "resumed"));
}

TEST(a_try_of_set_answers_and_leaves_no_trace)
{
    Client *client = ((Fixture *)*test_state)->client;
    const int64_t not_possible = refused(client, "not_possible");
    const Reply *reply = command(client, PLIANT_COMMAND_T_SET, 0, "try sphere.stiffness_scale=0.5");
    assert_true(reply->ok);
    expect_in(reply->text, "sphere.stiffness_scale = 0.5 instead of 1: ");
    expect_in(reply->text, " substeps a tick");
    expect_in(reply->text, " ms of 1 ms a tick");
    reply = command(client, PLIANT_COMMAND_T_SET, 0, "try sphere.stiffness_scale");
    assert_true(reply->ok);
    expect_in(reply->text, "sphere.stiffness_scale = 1, from 0 to ");
    reply = command(client, PLIANT_COMMAND_T_SET, 0, "try gravity");
    assert_string_equal(reply->text, "gravity = (0, 0, 0)");
    reply = command(client, PLIANT_COMMAND_T_SET, 0, "try stiffness_scale=1e5");
    assert_false(reply->ok);
    expect_in(reply->text, "take at most ");
    assert_false(command(client, PLIANT_COMMAND_T_SET, 0, "try gravity=1e5 0 0")->ok);
    // What cannot be read is refused as ever.
    assert_false(command(client, PLIANT_COMMAND_T_SET, 0, "try ")->ok);
    assert_false(command(client, PLIANT_COMMAND_T_SET, 0, "try friction=nan")->ok);
    client_fresh_status(client);
    // Not even counted: only what could not be read was.
    assert_int_equal(refused(client, "not_possible"), not_possible);
    assert_false(saw_event(client, "set"));
    assert_true(command(client, PLIANT_COMMAND_T_SET, 0, "sphere.stiffness_scale=0.5")->ok);
    reply = command(client, PLIANT_COMMAND_T_SET, 0, "try sphere.stiffness_scale");
    expect_in(reply->text, "sphere.stiffness_scale = 0.5, from 0 to ");
    assert_true(command(client, PLIANT_COMMAND_T_SET, 0, "sphere.stiffness_scale=1")->ok);
}

TEST(set_changes_gravity_and_reset_brings_the_start_back)
{
    Client *client = ((Fixture *)*test_state)->client;
    assert_true(command(client, PLIANT_COMMAND_T_SET, 0, "gravity=0 0 -9.81")->ok);
    wait_until(client, client->status.max_displacement > 1e-4);
    assert_true(command(client, PLIANT_COMMAND_T_SET, 0, "gravity_z=0")->ok);
    command(client, PLIANT_COMMAND_T_PAUSE, 0, "");
    const Reply *reset = command(client, PLIANT_COMMAND_T_RESET, 0, "");
    assert_true(reset->ok);
    assert_true(reset->step > 0); // time goes on
    const Reply *step = command(client, PLIANT_COMMAND_T_STEP, 1, "");
    assert_true(step->ok);
    client_fresh_status(client);
    // At the start nothing is strained; a tick from there moves nothing beyond rounding of 0.05 m.
    expect_near(client->status.max_displacement, 0.0, 1e-12);
    command(client, PLIANT_COMMAND_T_RESUME, 0, "");
}

// Any message on the claims' channel asks for a status: one follows, but not one for each.
TEST(statuses_that_are_asked_for_are_few)
{
    Client *client = ((Fixture *)*test_state)->client;
    client_fresh_status(client);
    const int before = client->status.count;
    const double start = client_now();
    for (int sent = 0; sent < 400; sent++) {
        send_bytes(client, "PLIANT_CLAIM", "", 1);
        client_listen(client, 2);
    }
    const double seconds = client_now() - start;
    // 20 a second of the scene, 10 of those who ask; one more of each at either end.
    expect_at_most((double)(client->status.count - before), 30.0 * seconds + 4.0);
}

AROUND_ALL(start_paused, fixture_end)

TEST(step_runs_exactly_n_ticks_with_nodes_and_contacts_before_the_reply)
{
    Client *client = ((Fixture *)*test_state)->client;
    assert_string_equal(client->status.state, "paused");
    int64_t done = client->status.step;
    assert_int_equal(done, 0);
    const int64_t counts[] = {1, 2, 7, 100, 1, 333};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        // From just above the top downwards, in steps that no proxy shortens.
        const double position[3] = {0.0, 0.0, 0.056 - 0.001 * (double)i};
        pliant_tool_pose_t pose = make_pose(client, position);
        int64_t utime = send_pose(client, &pose);
        const Reply *reply = command(client, PLIANT_COMMAND_T_STEP, counts[i], "");
        done += counts[i];
        assert_true(reply->ok);
        assert_int_equal(reply->step, done);
        assert_int_equal(reply->frame_step, done);
        assert_int_equal(reply->contact_step, done);
        assert_int_equal(client->contact.pose_utime, utime);
        // The tool is there at once, not on its way.
        if (!client->contact.contact)
            expect_near(client->contact.position[2], position[2], 1e-12);
    }
    assert_true(client->contact.contact);
    expect_at_least(client->contact.force[2], 1e-6);
    client_fresh_status(client);
    assert_string_equal(client->status.state, "lockstep");
    assert_int_equal(client->status.step, done);
}

TEST(in_lockstep_tools_do_not_become_stale)
{
    Client *client = ((Fixture *)*test_state)->client;
    assert_true(client->contact.contact);             // from the test before
    command(client, PLIANT_COMMAND_T_STEP, 2000, ""); // ten times tool_timeout_s
    assert_true(client->contact.contact);
}

TEST(a_pause_ends_a_long_step_early)
{
    Client *client = ((Fixture *)*test_state)->client;
    int32_t id = send_command(client, PLIANT_COMMAND_T_STEP, 10000000, "");
    client_listen(client, 50);
    assert_true(command(client, PLIANT_COMMAND_T_PAUSE, 0, "")->ok);
    wait_until(client, find_reply(client, id) != NULL);
    assert_false(find_reply(client, id)->ok);
    expect_in(find_reply(client, id)->text, "of 10000000 ticks");
}

TEST(more_requests_than_fit_are_refused_and_all_are_answered)
{
    Client *client = ((Fixture *)*test_state)->client;
    enum { MANY = 300 };
    // A long STEP keeps the others waiting; under a sanitizer it takes seconds.
    const int32_t step = send_command(client, PLIANT_COMMAND_T_STEP, 40000, "");
    for (int i = 0; i < MANY; i++) {
        send_command(client, PLIANT_COMMAND_T_CHECKPOINT, 0, ""); // a short answer: no file
        if (i % 8 == 0) // a kernel buffer holds some two hundred messages
            client_listen(client, 2);
    }
    wait_until(client, find_reply(client, step) != NULL);
    for (int round = 0; round < 10; round++) {
        client_listen(client, 200);
        repeat_unanswered(client, step + 1, PLIANT_COMMAND_T_CHECKPOINT, 0, "");
    }
    int full = 0;
    for (int32_t id = step + 1; id <= step + MANY; id++) {
        wait_until(client, find_reply(client, id) != NULL);
        full += strstr(find_reply(client, id)->text, "requests wait already") != NULL;
    }
    expect_at_least(full, 1.0);
    client_fresh_status(client);
    // A refusal whose reply was lost counts as well.
    expect_at_least((double)refused(client, "queue_full"), full);
}

static void publish_command(Client *client, const void *message)
{
    pliant_command_t_publish(client->lcm, "PLIANT_COMMAND", message);
}

static const Reply *pause_made_at(Client *client, int64_t utime)
{
    char nothing[] = "";
    pliant_command_t m = {.utime = utime,
                          .sender = client->sender,
                          .id = ++client->next_id,
                          .kind = PLIANT_COMMAND_T_PAUSE,
                          .argument = nothing};
    return answer_to(client, m.id, publish_command, &m);
}

AROUND_ALL(NULL, NULL)

// What a client repeats, with the time at which it was made, was meant for another daemon. A log
// that is played back, a clock that was set and a client that gives no time are not meant by that.
TEST(a_request_that_is_older_than_the_daemon_is_refused)
{
    SCOPED_CLIENT Client *client = server_start(&pliantd, "%s", write_scene("older.cfg", HEAD, ""));
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    const int64_t utime = (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
    const int64_t hour = INT64_C(3600000000);
    const Reply *reply = pause_made_at(client, utime - 1000000);
    assert_false(reply->ok);
    expect_in(reply->text, "before this daemon started");
    client_fresh_status(client);
    assert_int_equal(refused(client, "stale"), 1);
    assert_string_equal(client->status.state, "running");
    const int64_t fine[] = {utime, utime + hour, utime - hour, 0, INT64_MIN, INT64_MAX};
    for (size_t i = 0; i < sizeof fine / sizeof *fine; i++)
        assert_true(pause_made_at(client, fine[i])->ok);
    server_stop(client, &pliantd);
}

TEST(stop_ends_the_daemon_cleanly)
{
    SCOPED_CLIENT Client *client = client_create();
    daemon_start(&pliantd, "%s", write_scene("stop.cfg", HEAD, ""));
    wait_until(client, client->status.step > 0);
    server_stop(client, &pliantd);
    expect_at_least((double)printed(&pliantd, "ticks"), 1.0);
}
