// SPDX-License-Identifier: MIT
// A solid body in the real daemon: what it says of it, what it refuses, what tools and clients
// find.
#include "test.h"
#include "lcm_client.h"

// A ball of radius 24 mm around the origin whose lower part is fixed; it has the name that the
// client listens to.
#define VOXELS "voxels = { generator = \"ball\"; radius = 0.024; size = 0.004; };"
#define SCENE(head, voxels, more)                                                                  \
    "publish = { nodes_hz = 20.0; contact_hz = 500.0; status_hz = 20.0; };\n"                      \
    "rate_hz = 500.0;\n" head "\n"                                                                 \
    "bodies = ( { name = \"sphere\"; model = \"voxel\";\n" voxels "\n" more "\n"                   \
    "fixed = ( { box = ([-1, -1, -1], [1, 1, -0.0159]); } ); } );\n"                               \
    "tools = ( { id = 1; kind = \"probe\"; max_force = 5.0;\n"                                     \
    "capsules = ( { radius = 0.005; } ); } );\n"

static const char *write_solid(const char *name, const char *text)
{
    const char *path = scratch(name);
    write_text(path, text);
    return path;
}

TEST(bad_solids_exit_2_with_one_line)
{
    static const struct {
        const char *text, *needle;
    } cases[] = {
        {SCENE("", "", ""), "x.cfg:4: bodies.voxels is missing"},
        {SCENE("", "voxels = { file = \"none.nrrd\"; };", ""), "none.nrrd: No such file"},
        {SCENE("", "voxels = { file = \"x.cfg\"; };", ""), "x.cfg:4: "},
        {SCENE("", "voxels = { mesh = \"x.cfg\"; size = 0.01; };", ""), "x.cfg:4: "},
        {SCENE("", VOXELS, "mesh = { };"), "x.cfg:6: mesh means nothing for a voxel body"},
        {SCENE("", VOXELS, "integrator = \"rk4\";"), "x.cfg:6: integrator \"rk4\""},
        {SCENE("", VOXELS, "time_step = 0.01;"), "time_step"},
        {SCENE("", VOXELS, "skin = { mesh = \"none.obj\"; };"), "none.obj: No such file"},
        {SCENE("", VOXELS, "fixed = ( );"), "duplicate setting name"},
        {SCENE("capacity = { nodes = 9; };", VOXELS, ""), "capacity.nodes is 9"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        run_daemon(&pliantd, "--check %s", write_solid("x.cfg", cases[i].text));
        if (pliantd.code != 2 || strstr(pliantd.err, cases[i].needle) == NULL)
            fail_msg("exit %d with: %s, not '%s'", pliantd.code, pliantd.err, cases[i].needle);
        const char *end = strchr(pliantd.err, '\n');
        assert_true(end != NULL && end[1] == '\0'); // one line
        assert_string_equal(pliantd.out, "");
    }
}

static void expect_told(const Process *daemon, const char *const *parts)
{
    assert_int_equal(daemon->code, 0);
    for (; *parts != NULL; parts++)
        expect_printed(daemon, *parts);
}

TEST(check_and_explain_say_what_it_is_made_of)
{
    static const char *const checked[] = {"body sphere: model voxel, symplectic_euler",
                                          "cells 12 x 12 x 12 of 0.004 m",
                                          "elements ",
                                          "law \"affine\", 3 dimensions, levels 0 to 2",
                                          "critical step ",
                                          "damping 0.2 of it",
                                          ", drag 4 1/s: about loss ",
                                          " at 2 Hz, ",
                                          " at 10 Hz, ",
                                          " at 50 Hz; ",
                                          " substeps a tick, ",
                                          "label 1: E 10000 Pa, nu 0, density 1000 kg/m3",
                                          NULL};
    static const char *const explained[] = {"kernel of body sphere:", " by level)",
                                            "off  display surface ",
                                            "off  inner vertices in messages ", NULL};
    const char *scene = write_solid("x.cfg", SCENE("", VOXELS, ""));
    run_daemon(&pliantd, "--check %s", scene);
    expect_told(&pliantd, checked);
    run_daemon(&pliantd, "--explain %s", scene);
    expect_told(&pliantd, checked);
    expect_told(&pliantd, explained);
    // What only surface bodies can have is not missed here.
    assert_null(strstr(pliantd.out, "refinement at run time"));
}

TEST(instruction_sets_give_the_same_bits)
{
    const char *scene = write_solid("x.cfg", SCENE("gravity = [0.0, 0.0, -9.81];", VOXELS, ""));
    char first[32], other[32];
    run_daemon_well(&pliantd, "--offline 0.2 %s", scene);
    printed_state(&pliantd, first);
    run_daemon(&pliantd, "--offline 0.2 --isa baseline %s", scene);
    printed_state(&pliantd, other);
    assert_string_equal(first, other);
}

#if WITH_HDF5
TEST(resumed_run_ends_as_the_uninterrupted_one)
{
    const char *scene = write_solid("x.cfg", SCENE("gravity = [0.0, 0.0, -9.81];", VOXELS, ""));
    const char *part = scratch("part.h5");
    char whole[32], resumed[32];
    // Both can be resumed, so both have room for loads.
    run_daemon_well(&pliantd, "--offline 0.4 --checkpoint %s %s", scratch("whole.h5"), scene);
    printed_state(&pliantd, whole);
    run_daemon_well(&pliantd, "--offline 0.2 --checkpoint %s %s", part, scene);
    run_daemon_well(&pliantd, "--offline 0.2 --resume %s %s", part, scene);
    printed_state(&pliantd, resumed);
    assert_string_equal(whole, resumed);
    // Not one of another law.
    run_daemon(&pliantd, "--offline 0.2 --resume %s %s", part,
               write_solid("y.cfg", SCENE("gravity = [0.0, 0.0, -9.81];", VOXELS,
                                          "law = \"miyazaki2004\";")));
    assert_int_equal(pliantd.code, 2);
}
#endif

TEST(tools_and_clients_meet_a_solid)
{
    SCOPED_CLIENT Client *client =
        server_start(&pliantd, "%s", write_solid("x.cfg", SCENE("", VOXELS, "")));
    wait_until(client, client->mesh.whole > 0 && client->frames.whole > 0);
    assert_true(client->mesh.in_range);
    assert_int_equal(client->mesh.whole_nodes, client->frames.node_count);

    // The ball of 5 mm pressed 3 mm into the top of the staircase at z = 0.024 m.
    const double press[3] = {0.0, 0.0, 0.026};
    double limit = client_now() + 30.0;
    while (!(client->contact.force[2] > 1e-3) &&
           client_now() < limit) { // it appears inside: gently
        send_pose_at(client, press);
        client_listen(client, 2);
    }
    expect_at_least(client->contact.depth, 1e-5);
    expect_at_least(client->contact.force[2], 1e-6);

    const Reply *reply = command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "");
    assert_true(reply->ok);
    expect_in(reply->text, "model voxel");
    assert_true(command(client, PLIANT_COMMAND_T_SET, 0, "sphere.stiffness_scale=0.5")->ok);
    assert_true(command(client, PLIANT_COMMAND_T_SET, 0, "sphere.damping_scale=0.5")->ok);
    reply = command(client, PLIANT_COMMAND_T_SET, 0, "sphere.adapt_force=0.5");
    assert_false(reply->ok);
    expect_in(reply->text, "has no wall that adapts");
    assert_true(command(client, PLIANT_COMMAND_T_RESET, 0, "")->ok);

    process_end(&pliantd);
}
