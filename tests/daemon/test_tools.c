// SPDX-License-Identifier: MIT
// Poses: the force on a tool, who owns it, when it is withdrawn.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

static const char HEAD[] = "publish = { nodes_hz = 20.0; contact_hz = 1000.0; status_hz = 20.0; };";
// The ball of 5 mm pressed 3 mm into the top of the sphere at z = 0.05 m, and away from it.
static const double PRESS[3] = {0.0, 0.0, 0.052}, AWAY[3] = {0.0, 0.0, 0.2};

static int start_daemon(void **state)
{
    return fixture_start(state, "%s", write_scene("tools.cfg", HEAD, PROBE_TOOL));
}

AROUND_ALL(start_daemon, fixture_end)

// What pliant-probe has sent, as a listener gets it.
typedef struct Heard {
    int repeated, overtaken;
    int32_t newest; // they count from 1
    bool withdrawn;
} Heard;

HANDLER(hear_pose, pliant_tool_pose_t, pose)
{
    Heard *heard = user;
    heard->withdrawn |= !pose->active;
    if (!pose->active)
        return;
    heard->repeated += pose->sequence == heard->newest;
    heard->overtaken += pose->sequence < heard->newest;
    heard->newest = pose->sequence > heard->newest ? pose->sequence : heard->newest;
    for (int k = 0; k < 3; k++) {
        const double steps = pose->position[k] / 1e-4;
        expect_near(steps, round(steps), 1e-9); // roundings of 600 steps
    }
}

TEST(poses_of_a_poor_device_arrive_and_what_was_overtaken_is_refused)
{
    Client *client = ((Fixture *)*test_state)->client;
    Process probe;
    Heard heard = {0};
    pliant_tool_pose_t_subscription_t *on =
        pliant_tool_pose_t_subscribe(client->lcm, "PLIANT_TOOL_POSE", hear_pose, &heard);
    process_start(&probe, program_path("pliant-probe"),
                  "--press 0,0,0.058 --depth 0.008 --hold 0.2 --device "
                  "quantum=1e-4,reorder=0.02,duplicate,loss=0.1,gap=0.06/0.25,seed=2");
    wait_until(client, heard.withdrawn);
    pliant_tool_pose_t_unsubscribe(client->lcm, on);
    process_wait(&probe);
    expect_ended(&probe, 0, "device: ");
    int silent, overtaken;
    assert_int_equal(sscanf(strstr(probe.out, "device: "),
                            "device: %*d samples, %d in gaps; %*d messages lost, %*d arrived, %d ",
                            &silent, &overtaken),
                     2);
    client_fresh_status(client);
    // A busy machine loses datagrams, so only bounds hold: what is lost overtakes nothing. It may
    // also stop the server for a while, to which poses are then stale.
    assert_in_range(refused(client, "overtaken"), 1, overtaken);
    assert_in_range(heard.overtaken, 1, overtaken);
    assert_int_equal(client->status.rejected,
                     refused(client, "overtaken") + refused(client, "stale"));
    assert_true(silent > 0 && heard.repeated > 0);
}

TEST(a_pressed_tool_feels_a_force_away_from_the_body)
{
    Client *client = ((Fixture *)*test_state)->client;
    hold_pose_until(client, AWAY, client->contact.pose_utime != 0);
    assert_false(client->contact.contact);
    hold_pose_until(client, PRESS, client->contact.depth > 1e-5);
    const pliant_contact_t *contact = &client->contact;
    assert_int_equal(contact->tool, 1);
    expect_at_least(contact->force[2], 1e-6); // upwards, out of the top
    expect_at_most(contact->force[2], 5.0);   // max_force
    expect_at_least(contact->normal[2], 0.5);
    expect_at_least((double)(contact->valid_until - contact->utime), 1000.0);
    assert_true(contact->pose_utime <= contact->utime);
    int contacts = client->contacts;
    int64_t step = contact->step;
    hold_pose_until(client, PRESS, client->contacts > contacts + 50);
    // One a tick: between two messages lie as many steps as messages, but for lost or late ones.
    expect_at_least((double)(client->contact.step - step), 50.0);
}

// A tracker's wrong samples, 30 m away: the tool stays where it presses, and events tell of them.
// A busy machine may take a wrong one and the next in one tick, of which only the newest counts.
TEST(a_wrong_sample_moves_nothing)
{
    Client *client = ((Fixture *)*test_state)->client;
    hold_pose_until(client, PRESS, client->contact.contact);
    const int events = client->events;
    bool told = false;
    double farthest = 0.0;
    for (int k = 0; k < 3000 && !(told && k > 100); k++) {
        pliant_tool_pose_t pose = make_pose(client, PRESS);
        pose.position[0] += k % 10 == 5 ? 30.0 : 0.0;
        send_pose(client, &pose);
        client_listen(client, 5);
        farthest = fmax(farthest, fabs(client->contact.position[0]));
        for (int i = events; i < client->events; i++)
            told |= strstr(client->event[i].text, "ignored a pose 30 m away") != NULL;
    }
    assert_true(told);
    expect_at_most(farthest, 0.001); // it may slide a little
}

TEST(a_stale_tool_is_withdrawn)
{
    Client *client = ((Fixture *)*test_state)->client;
    hold_pose_until(client, PRESS, client->contact.contact);
    // No pose any more: tool_timeout_s later there is no force.
    wait_until(client, !client->contact.contact);
    for (int k = 0; k < 3; k++) {
        expect_near(client->contact.force[k], 0.0, 0.0);
        expect_near(client->contact.torque[k], 0.0, 0.0);
    }
}

TEST(the_first_sender_owns_the_tool_until_it_gives_it_up)
{
    Client *client = ((Fixture *)*test_state)->client;
    int64_t before = refused(client, "tool_owned_by_other");
    pliant_tool_pose_t mine = make_pose(client, AWAY), other = mine;
    other.sender = mine.sender + 5000;
    double limit = client_now() + 30.0;
    while (refused(client, "tool_owned_by_other") < before + 10 && client_now() < limit) {
        mine.utime++;
        send_pose(client, &mine);
        send_pose(client, &other);
        client_listen(client, 2);
    }
    expect_at_least((double)refused(client, "tool_owned_by_other"), (double)before + 10.0);
    wait_until(client, saw_event(client, "refused"));
    // Inactive gives it up: the other's next pose is taken at once.
    mine.active = 0;
    other.utime = 424242;
    for (limit = client_now() + 30.0;
         client->contact.pose_utime != 424242 && client_now() < limit;) {
        send_pose(client, &mine);
        send_pose(client, &other);
        client_listen(client, 20);
    }
    assert_true(client->contact.pose_utime == 424242);
    other.active = 0;
    send_pose(client, &other);
}

TEST(ten_thousand_poses_a_second_keep_the_newest)
{
    Client *client = ((Fixture *)*test_state)->client;
    int64_t step = client->status.step;
    double start = client_now();
    const int64_t last = 1000000 + 10000;
    for (int i = 0; i < 10000; i++) {
        pliant_tool_pose_t pose = make_pose(client, AWAY);
        pose.utime = 1000000 + i;
        send_pose(client, &pose);
        while (client_now() < start + (i + 1) * 1e-4)
            client_listen(client, 0);
    }
    // One more is applied whatever was lost before, and the loop went on all the time.
    for (double limit = client_now() + 30.0;
         client->contact.pose_utime != last && client_now() < limit;) {
        pliant_tool_pose_t pose = make_pose(client, AWAY);
        pose.utime = last;
        send_pose(client, &pose);
        client_listen(client, 20);
    }
    assert_true(client->contact.pose_utime == last);
    client_fresh_status(client);
    expect_at_least((double)(client->status.step - step + client->status.late_ticks), 1000.0);
}

TEST(poses_of_tools_that_are_not_there_are_refused)
{
    Client *client = ((Fixture *)*test_state)->client;
    int64_t before = refused(client, "unknown_tool");
    pliant_tool_pose_t pose = make_pose(client, AWAY);
    pose.tool = 77;
    for (double limit = client_now() + 30.0;
         refused(client, "unknown_tool") == before && client_now() < limit;) {
        send_pose(client, &pose);
        client_listen(client, 20);
    }
    assert_true(refused(client, "unknown_tool") > before);
}
