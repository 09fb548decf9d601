// SPDX-License-Identifier: MIT
// A hand behind a network, through the real daemon: the stiffness that contacts report makes its
// loop passive. In lockstep, so that a busy machine changes nothing: a tick of the daemon is one of
// the device.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

#include "hand.h"

static const char BODY[] = "shape = { angular_frequency = 50.0; damping_ratio = 0.3; };\n"
                           "contact = { stiffness = 1.0; };\n" FIXED_BELOW(-0.025);
static const double TOUCH[3] = {0.0, 0.0, 0.055}, DOWN[3] = {0.0, 0.0, -1.0};

static void start(Process *daemon, Client **client, const char *publish)
{
    char head[256];
    snprintf(head, sizeof head, "publish = { nodes_hz = 0.0; contact_hz = 1000.0; %s };", publish);
    const char *path = write_body_scene("hand.cfg", &(SceneParts){.head = head,
                                                                  .source = ICO_SPHERE(642, 0.05),
                                                                  .body = BODY,
                                                                  .tail = PROBE_TOOL});
    *client = client_create();
    daemon_start(daemon, "%s", path);
    client_wait_for_daemon(*client);
}

// One tick with the tool at its last pose.
static void step(Client *client)
{
    client->replies = 0; // none of them is looked up again
    step_daemon(client, 1);
}

static HandForce heard(const Client *client)
{
    const pliant_contact_t *contact = &client->contact;
    HandForce force = {.contact = contact->contact != 0};
    memcpy(force.position, contact->position, sizeof force.position);
    memcpy(force.force, contact->force, sizeof force.force);
    memcpy(force.normal, contact->normal, sizeof force.normal);
    memcpy(force.stiffness, contact->stiffness, sizeof force.stiffness);
    return force;
}

// A share: what the hand lost of the work that it put in.
static double feel(Client *client, bool stiffness)
{
    static Hand hand;
    HandOptions options = {.frequency = 2.0,
                           .depth = 0.006,
                           .rate_hz = HAND_RATE,
                           .latency = 0.04,
                           .max_force = 3.3,
                           .stiffness = stiffness};
    hand_begin(&hand, &options, TOUCH, DOWN);
    int ticks = (int)lround(hand_duration(&options, 1) * HAND_RATE);
    for (int i = 0; i <= ticks; i++) {
        HandPose pose;
        while (hand_take_pose(&hand, i / HAND_RATE, &pose)) {
            pliant_tool_pose_t message = make_pose(client, pose.position);
            send_pose(client, &message);
        }
        step(client);
        HandForce force = heard(client);
        hand_hear(&hand, i / HAND_RATE, &force);
        hand_feel(&hand, i / HAND_RATE);
    }
    return hand.figures.lost / hand.figures.put_in;
}

TEST(told_stiffness_makes_the_loop_passive)
{
    SCOPED_CLIENT Client *client;
    start(&pliantd, &client, "");
    double without = feel(client, false), with = feel(client, true);
    printf("lost without stiffness %.2f, with it %.2f\n", without, with);
    // 40 ms late: far from the border on both sides.
    expect_at_most(without, -0.1);
    expect_at_least(with, 0.1);
    process_end(&pliantd);
}

TEST(contacts_tell_a_symmetric_positive_stiffness)
{
    SCOPED_CLIENT Client *client;
    start(&pliantd, &client, "");
    double away[3] = {0.0, 0.0, 0.1}, inside[3] = {0.0, 0.0, 0.051};
    pliant_tool_pose_t pose = make_pose(client, away);
    send_pose(client, &pose);
    step(client);
    for (int i = 0; i < 9; i++)
        expect_near(client->contact.stiffness[i / 3][i % 3], 0.0, 0.0);
    pose = make_pose(client, inside);
    send_pose(client, &pose);
    for (int i = 0; i < 200; i++)
        step(client);
    assert_true(client->contact.contact);
    const double(*k)[3] = (const double(*)[3])client->contact.stiffness;
    for (int i = 0; i < 3; i++) {
        expect_at_least(k[i][i], 0.0);
        for (int j = 0; j < 3; j++) {
            expect_near(k[i][j], k[j][i], 0.0);
            expect_at_most(k[i][j] * k[i][j], k[i][i] * k[j][j] + 1e-9);
        }
    }
    // A few N/m along the normal: the body, not the contact's 600 N/m.
    expect_at_least(k[2][2], 1.0);
    expect_at_most(k[2][2], 30.0);
    expect_at_least(client->contact.damping, 0.0);
    process_end(&pliantd);
}

TEST(scene_can_leave_it_out)
{
    SCOPED_CLIENT Client *client;
    start(&pliantd, &client, "contact_stiffness = false;");
    double inside[3] = {0.0, 0.0, 0.051};
    send_pose_at(client, inside);
    for (int i = 0; i < 200; i++)
        step(client);
    assert_true(client->contact.contact);
    for (int i = 0; i < 9; i++)
        expect_near(client->contact.stiffness[i / 3][i % 3], 0.0, 0.0);
    process_end(&pliantd);
}
