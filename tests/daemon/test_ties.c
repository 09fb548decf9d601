// SPDX-License-Identifier: MIT
// Ties over LCM: made, repeated, changed, released, refused and broken by a real daemon, and
// repeated from its log; then by pliant-tie.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

// Two balls that fall side by side.
static const char SCENE[] =
    "name = \"ties\"; max_ties = 4; gravity = [0.0, 0.0, -1.0]; start = \"paused\";\n"
    "publish = { nodes_hz = 20.0; status_hz = 20.0; };\n"
    "bodies = (\n"
    "  { name = \"one\"; mesh = { generator = \"sphere\"; nodes = 162; radius = 0.05; }; },\n"
    "  { name = \"two\"; mesh = { generator = \"sphere\"; nodes = 162; radius = 0.05;\n"
    "      place = { translation = [0.102, 0.0, 0.0]; }; }; } );\n"
    "tools = ( { id = 1; kind = \"probe\"; capsules = ( { radius = 0.01; } ); } );\n";
static const double TOP[3] = {0.0, 0.0, 0.05}, BESIDE[3] = {0.05, 0.0, 0.0};

static const char *write_ties_scene(void)
{
    const char *path = scratch("ties.cfg");
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(SCENE, file);
    assert_int_equal(fclose(file), 0);
    return path;
}

static void expect_text(const Reply *reply, bool ok, const char *says)
{
    if (reply->ok != ok || strstr(reply->text, says) == NULL)
        fail_msg("%s: '%s' does not say '%s'", reply->ok ? "done" : "refused", reply->text, says);
    assert_string_equal(reply->channel, "PLIANT_TIE");
}

TEST(ties_are_made_changed_released_and_repeated)
{
    Process daemon, again;
    const char *scene = write_ties_scene();
    SCOPED_CLIENT Client *client =
        server_start(&daemon, "--log-inputs %s %s", scratch("ties.log"), scene);
    step_daemon(client, 20);
    // A pin holds one ball, and through a tie the other.
    pliant_tie_t pin = make_tie(client, PLIANT_TIE_T_PIN, TOP, 0.02, "one");
    expect_text(apply_tie(client, &pin), true, "tie 1: pin of ");
    pliant_tie_t tie = make_tie(client, PLIANT_TIE_T_TIE, BESIDE, 0.02, "one");
    memcpy(tie.to_body, "two", 3);
    tie.tie = 7;
    expect_text(apply_tie(client, &tie), true, "tie 7: tie of ");
    wait_until(client, saw_event(client, "tie"));
    // Sent once more, with the same number, it is answered and not made again.
    const int replies = count_replies(client, tie.id);
    pliant_tie_t_publish(client->lcm, "PLIANT_TIE", &tie);
    wait_until(client, count_replies(client, tie.id) > replies);
    expect_text(find_reply(client, tie.id), true, "tie 7: tie of ");
    step_daemon(client, 1000);
    client_fresh_status(client);
    // A second of falling would be half a metre.
    expect_at_most(client->status.max_displacement, 0.3);
    // Refused, by the gate and by the scene.
    pliant_tie_t bad = make_tie(client, PLIANT_TIE_T_PIN, TOP, 0.02, "three");
    expect_text(apply_tie(client, &bad), false, "body 'three'");
    bad = make_tie(client, PLIANT_TIE_T_PIN, TOP, 0.02, "one");
    bad.stiffness = (double)NAN;
    expect_text(apply_tie(client, &bad), false, "stiffness");
    bad = make_tie(client, PLIANT_TIE_T_TIE, TOP, 0.02, "one");
    expect_text(apply_tie(client, &bad), false, "to_body");
    bad = make_tie(client, PLIANT_TIE_T_CARRY, TOP, 0.02, "one");
    bad.tool = 5;
    expect_text(apply_tie(client, &bad), false, "tool 5");
    bad = make_tie(client, PLIANT_TIE_T_PIN, TOP, 0.02, "");
    expect_text(apply_tie(client, &bad), false, "name one of the 2");
    bad = tie;
    bad.id = ++client->next_id;
    expect_text(apply_tie(client, &bad), false, "tie 7 exists");
    wait_until(client, refused(client, "not_possible") > 0 && refused(client, "not_finite") > 0 &&
                           refused(client, "unknown_body") > 0 &&
                           refused(client, "unknown_tool") > 0);
    // Changed so that it breaks under the weight.
    pliant_tie_t change = make_tie(client, 0, TOP, 0.0, "");
    change.action = PLIANT_TIE_T_CHANGE;
    change.tie = 7;
    change.stiffness = 0.1;
    change.break_force = 1e-3;
    expect_text(apply_tie(client, &change), true, "tie 7: stiffness 0.1, ");
    step_daemon(client, 200);
    wait_until(client, saw_event(client, "tie_broken"));
    change.action = PLIANT_TIE_T_RELEASE;
    change.id = ++client->next_id;
    expect_text(apply_tie(client, &change), false, "tie 7 does not exist");
    change.tie = 1;
    change.id = ++client->next_id;
    expect_text(apply_tie(client, &change), true, "tie 1 released");
    step_daemon(client, 100);
    const Reply *about = command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "");
    expect_in(about->text, "ties by message: at most 4");
    process_end(&daemon);
    // The log has all of it.
    char live[32], repeated[32];
    printed_state(&daemon, live);
    run_daemon_well(&again, "--offline 1000 --input %s %s", scratch("ties.log"), scene);
    printed_state(&again, repeated);
    assert_string_equal(live, repeated);
}

// --- pliant-tie ---

static void expect_tie(int code, const char *says, const char *arguments)
{
    Process tie;
    process_run(&tie, program_path("pliant-tie"), "%s", arguments);
    const char *said = code == 0 ? tie.out : tie.err;
    if (tie.code != code || strstr(said, says) == NULL)
        fail_msg("%s: %d, '%s' does not say '%s'", arguments, tie.code, said, says);
}

TEST(pliant_tie_makes_changes_and_releases)
{
    SCOPED_CLIENT Client *client = server_start(&pliantd, "%s", write_ties_scene());
    expect_tie(0, "tie 1: pin of ", "--make pin --body one --at 0,0,0.05 --radius 0.02");
    expect_tie(0, "tie 5: tie of ",
               "--make tie --body one --to two --at 0.05,0,0 --radius 0.02 -n 5");
    expect_tie(0, "tie 2: clip of ", "--make clip --body one --at 0.02,0,0 --radius 0.048");
    expect_tie(0, "tie 3: carry of 2 nodes of body two to tool 1",
               "--make carry --body two --nodes 3,4 --tool 1");
    expect_tie(1, "all 4 ties are in use (max_ties)",
               "--make pin --body one --at 0,0,0.05 --radius 0.02");
    expect_tie(0, "tie 1: stiffness 0.1, damping_ratio 1, break_force 2 N",
               "--change 1 --stiffness 0.1 --damping-ratio 1 --break-force 2");
    expect_tie(0, "tie 5 released", "--release 5");
    expect_tie(1, "the daemon refuses: tie 5 does not exist", "--release 5");
    // What cannot be is not sent.
    expect_tie(2, "one of --make, --change and --release", "--at 0,0,0");
    expect_tie(2, "one of --at and --nodes", "--make pin --body one");
    expect_tie(2, "needs --to", "--make tie --body one --at 0,0,0");
    expect_tie(2, "--stiffness", "--change 1 --stiffness 5");
    step_daemon(client, 20);
    assert_int_equal(client->status.resets, 0);
    process_end(&pliantd);
    expect_tie(1, "no reply on PLIANT_REPLY", "--release 1 --timeout 0.05 --tries 2");
}
