// SPDX-License-Identifier: MIT
// integrator = "auto" through the real daemon: a body too stiff for leapfrog is implicit, says so,
// and answers a tool at 1 kHz.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

static const double PRESS[3] = {0.0, 0.0, 0.052}, AWAY[3] = {0.0, 0.0, 0.2};
static const char STIFF[] = "spring_stiffness = 1.0e8; node_mass = 1.0e-6;",
                  SOFT[] = "youngs_modulus_2d = 80.0; areal_density = 4.2;",
                  LIVE[] = "publish = { nodes_hz = 20.0; contact_hz = 1000.0; status_hz = 20.0; };",
                  // A slow rate, so that there is time left in ticks on any machine.
    ESTIMATED[] = "rate_hz = 50.0; estimate_error = true; gravity = [0.0, 0.0, -9.8];"
                  "publish = { status_hz = 20.0; };";

static const char *write_auto(const char *file, const char *material, const char *head,
                              const char *tail)
{
    return write_body_scene(
        file,
        &(SceneParts){
            .head = head,
            .source = "model = \"surface\"; integrator = \"auto\";\n"
                      "mesh = { generator = \"sphere\"; nodes = 114; radius = 0.05; };",
            .material = material,
            .body = "shape = { angular_frequency = 50.0; damping_ratio = 0.3; };\n" LOWER_FIXED,
            .tail = tail});
}

TEST(a_stiff_body_is_implicit_and_answers_a_tool)
{
    SCOPED_CLIENT Client *client =
        server_start(&pliantd, "%s", write_auto("stiff.cfg", STIFF, LIVE, PROBE_TOOL));
    assert_string_equal(client->status.integrator, "implicit");
    hold_pose_until(client, AWAY, client->contact.pose_utime != 0);
    hold_pose_until(client, PRESS, client->contact.depth > 1e-5);
    assert_true(client->contact.contact);
    expect_at_least(client->contact.force[2], 1e-9); // up, out of the top
    expect_at_most(client->contact.force[2], 5.0);   // max_force
    client_fresh_status(client);
    assert_int_equal(client->status.resets, 0);
    process_end(&pliantd);
}

TEST(implicit_steps_are_tried_for_the_estimate_too)
{
    SCOPED_CLIENT Client *client =
        server_start(&pliantd, "%s", write_auto("estimated.cfg", STIFF, ESTIMATED, ""));
    assert_string_equal(client->status.integrator, "implicit");
    wait_until(client, client->status.estimated_error > 0.0);
    // Steps of backward Euler's kind are off, but not by more than the body has moved.
    expect_at_most(client->status.estimated_error, 1.0);
    process_end(&pliantd);
}

TEST(the_choice_is_told_before_anything_runs)
{
    run_daemon_well(&pliantd, "--check %s", write_auto("stiff.cfg", STIFF, "", PROBE_TOOL));
    expect_in(pliantd.out, "model surface, implicit");
    expect_in(pliantd.out, "leapfrog would take more than 34 substeps");
    expect_in(pliantd.out, "contacts and attachments: ");
    expect_in(pliantd.out, "contact.stiffness changes nothing, time_step = ");
    run_daemon_well(&pliantd, "--explain %s", write_auto("soft.cfg", SOFT, "", ""));
    expect_in(pliantd.out, "model surface, leapfrog");
    expect_in(pliantd.out, "leapfrog would take at most 34 substeps");
    assert_null(strstr(pliantd.out, "sphere/implicit")); // no array
}

// One hangs on the other, which is fixed: springs between them are as stiff as the step allows too.
TEST(joined_stiff_bodies_hang_together)
{
    static const char FORMAT[] =
        "gravity = [0.0, 0.0, -9.81];\n"
        "bodies = ( { name = \"upper\"; model = \"surface\"; integrator = \"auto\";\n"
        "  mesh = { generator = \"sphere\"; nodes = 114; radius = 0.05; };\n"
        "  material = { spring_stiffness = %s; node_mass = 1.0e-4; };\n"
        "  fixed = ( { box = ([-1.0, -1.0, 0.025], [1.0, 1.0, 1.0]); } ); },\n"
        "{ name = \"lower\"; model = \"surface\"; integrator = \"implicit\";\n"
        "  mesh = { generator = \"sphere\"; nodes = 114; radius = 0.05;\n"
        "           place = { translation = [0.0, 0.0, -0.1]; }; };\n"
        "  material = { youngs_modulus_2d = 1.0e5; areal_density = 4.2; }; } );\n"
        "attachments = ( { body = \"lower\"; to_body = \"upper\";\n"
        "  box = ([-0.03, -0.03, -0.07], [0.03, 0.03, -0.04]); } );";
    char text[2048];
    snprintf(text, sizeof text, FORMAT, "1.0e8");
    write_text(scratch("joined.cfg"), text);
    run_daemon_well(&pliantd, "--offline 0.5 %s", scratch("joined.cfg"));
    assert_int_equal(printed(&pliantd, "resets"), 0);
    snprintf(text, sizeof text, FORMAT, "100.0"); // soft enough for leapfrog: not the other's
    write_text(scratch("joined.cfg"), text);
    run_daemon(&pliantd, "--check %s", scratch("joined.cfg"));
    expect_ended(&pliantd, 2, "must have one integrator");
}
