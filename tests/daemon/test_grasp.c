// SPDX-License-Identifier: MIT
// A grasper over LCM: it closes on the top of a ball, pulls, is pulled back, releases; its log
// all repeats the run. And one of a scene that was proposed, with the blade beside it.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

static const char HEAD[] = "publish = { nodes_hz = 20.0; contact_hz = 1000.0; status_hz = 20.0; };";
static const char JAWS[] =
    "tools = ( { id = 1; kind = \"grasper\"; max_force = 5.0;\n"
    "  capsules = ( { from = [0.0, 0.0, 0.0]; radius = 0.02; } ); } );\n"
    "attachments = ( { body = \"sphere\"; sphere = [0.05, 0.0, 0.0]; radius = 0.03; "
    "to = \"world\"; } );";
static const double TOP = 0.05;

static void move(Client *client, double height, double grip)
{
    const double at[3] = {0.0, 0.0, height};
    pliant_tool_pose_t pose = make_pose(client, at);
    pose.grip = grip;
    send_pose(client, &pose);
    client_listen(client, 2);
}

#define move_until(client, height, grip, condition)                                                \
    do {                                                                                           \
        double limit_ = client_now() + 30.0;                                                       \
        while (!(condition) && client_now() < limit_)                                              \
            move((client), (height), (grip));                                                      \
        if (!(condition))                                                                          \
            fail_msg("moved the jaws in vain for: %s", #condition);                                \
    } while (0)

TEST(jaws_take_hold_pull_and_let_go)
{
    Process daemon, again;
    const char *scene = write_scene("grasp.cfg", HEAD, JAWS);
    SCOPED_CLIENT Client *client =
        server_start(&daemon, "--log-inputs %s %s", scratch("grasp.log"), scene);
    move_until(client, TOP + 0.1, 0.0, client->contact.pose_utime != 0);
    assert_false(client->contact.contact);
    move_until(client, TOP + 0.1, 0.9, client->contacts > 100); // on nothing
    assert_false(client->contact.contact);
    move_until(client, TOP + 0.1, 0.0, client->contacts > 200);
    // Onto the top, open, then closed: it holds without a jerk.
    int before = client->contacts;
    move_until(client, TOP, 1.0, client->contact.contact && client->contacts > before + 100);
    wait_until(client, saw_event(client, "grasp"));
    expect_in(event_text(client, "grasp"), "tool 1 grasped ");
    // Pulled up by 20 mm: drawn back down.
    for (int i = 0; i <= 200; i++)
        move(client, TOP + 1e-4 * i, 1.0);
    move_until(client, TOP + 0.02, 1.0, client->contact.force[2] < -0.1);
    double pull = client->contact.force[2];
    expect_at_least(pull, -5.0); // max_force
    expect_near(client->contact.depth, 0.0, 0.0);
    client_fresh_status(client);
    expect_at_least(client->status.max_displacement, 0.005);
    assert_false(saw_event(client, "release"));
    move_until(client, TOP + 0.02, 0.45, client->contact.contact); // half open holds
    move_until(client, TOP + 0.02, 0.1, !client->contact.contact);
    wait_until(client, saw_event(client, "release"));
    for (int k = 0; k < 3; k++)
        expect_near(client->contact.force[k], 0.0, 0.0);
    move_until(client, TOP + 0.1, 0.0, client->contacts > before + 1000);
    client_fresh_status(client);
    assert_int_equal(client->status.resets, 0);
    process_end(&daemon);

    char live[32], repeated[32];
    printed_state(&daemon, live);
    run_daemon_well(&again, "--offline 1000 --input %s %s", scratch("grasp.log"), scene);
    printed_state(&again, repeated);
    assert_string_equal(live, repeated);
}

#if WITH_VOXEL
// A ball of 60 mm, in millimetres, and its top [m].
static void write_ball(const char *path)
{
    enum { RINGS = 12, ROUND = 24, SOUTH = 2 + (RINGS - 1) * ROUND };
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file, "v 0 0 30\n");
    for (int i = 1; i < RINGS; i++)
        for (int k = 0; k < ROUND; k++) {
            const double down = M_PI * i / RINGS, along = 2.0 * M_PI * k / ROUND;
            fprintf(file, "v %.9g %.9g %.9g\n", 30.0 * sin(down) * cos(along),
                    30.0 * sin(down) * sin(along), 30.0 * cos(down));
        }
    fprintf(file, "v 0 0 -30\n");
    for (int k = 0; k < ROUND; k++) {
        const int l = (k + 1) % ROUND;
        fprintf(file, "f 1 %d %d\nf %d %d %d\n", 2 + k, 2 + l, SOUTH, SOUTH - ROUND + l,
                SOUTH - ROUND + k);
        for (int i = 0; i < RINGS - 2; i++) {
            const int a = 2 + ROUND * i + k, b = 2 + ROUND * i + l;
            fprintf(file, "f %d %d %d %d\n", a, a + ROUND, b + ROUND, b);
        }
    }
    assert_int_equal(fclose(file), 0);
}

// One tick of a paused server with a tool there.
static void step_with(Client *client, int tool, double y, double z, double grip)
{
    const double at[3] = {0.0, y, z};
    pliant_tool_pose_t pose = make_pose(client, at);
    pose.tool = tool;
    pose.grip = grip;
    send_pose(client, &pose);
    client->replies = 0; // none of them is looked up again
    step_daemon(client, 1);
}

TEST(a_proposed_scene_is_grasped_pulled_and_cut)
{
    static const char *const models[] = {"surface", "voxel"};
    write_ball(scratch("ball.obj"));
    for (int k = 0; k < 2; k++) {
        Process prepare, daemon;
        char name[32];
        snprintf(name, sizeof name, "%s.cfg", models[k]);
        process_run_well(&prepare, program_path("pliant-prepare"),
                         "--propose --units mm --model %s ball.obj -o %s", models[k], name);
        SCOPED_CLIENT Client *client = server_start(&daemon, "%s", scratch(name));
        assert_true(command(client, PLIANT_COMMAND_T_PAUSE, 0, "")->ok);
        client->contact_tool = 3;
        // The jaws appear closed, as those of the page, and pull.
        for (int i = 0; i <= 150; i++)
            step_with(client, 3, 0.0, 0.030 + 1e-4 * i, 1.0);
        wait_until(client, saw_event(client, "grasp"));
        client_fresh_status(client);
        const double pull = client->contact.force[2], moved = client->status.max_displacement;
        print_message("%s: %.3f N, moved %.4f m\n", models[k], pull, moved);
        // A quarter of the 0.45 N of the wall, the softer one; held by nothing, they feel none.
        expect_at_most(pull, -0.1);
        // All of the way of 15 mm, within the millimetre that held tissue may lag.
        expect_at_least(moved, 0.014);
        for (int i = 0; i <= 40; i++) // it eases for 20 ms; a datagram may be lost
            step_with(client, 3, 0.0, 0.045, 0.0);
        wait_until(client, saw_event(client, "release"));
        // The blade stands upright, below the ball, and crosses it.
        for (int i = 0; i <= 100; i++)
            step_with(client, 2, 0.04 - 8e-4 * i, -0.05, 0.0);
        wait_until(client, saw_event(client, "piece"));
        client_fresh_status(client);
        assert_int_equal(client->status.resets, 0);
        assert_int_equal(client->status.rejected, 0);
        process_end(&daemon);
    }
}
#endif
