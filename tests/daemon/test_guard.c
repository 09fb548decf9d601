// SPDX-License-Identifier: MIT
// A daemon whose body is torn away, or that was given steps too long for it: every number that
// leaves is one, events say why, and a load that keeps being why is withdrawn. The body beside it
// and what was saved meanwhile are as ever.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

#include "pliant_event_t.h"
#include "pliant_nodes_t.h"
#include "pliant_status_t.h"

#include <lcm/lcm.h>

static const double TOP[3] = {0.0, 0.0, 0.05};

static const char *make_scene(const char *file, const char *keys, double modulus)
{
    char material[128], body[256];
    snprintf(material, sizeof material,
             "youngs_modulus_2d = %g; areal_density = 0.042; damping_time = 0.0;", modulus);
    snprintf(body, sizeof body, "%s " SMALL_SHAPE, keys);
    return write_body_scene(
        file,
        &(SceneParts){.head = "rate_hz = 500.0; gravity = [0.0, 0.0, -1.0];\n"
                              "publish = { nodes_hz = 500.0; contact_hz = 500.0; status_hz = 50.0; "
                              "velocity = true; };",
                      .material = material,
                      .body = body,
                      .others = ", { name = \"calm\"; " ICO_SPHERE(
                          42, 0.02) "material = { youngs_modulus_2d = 80.0; "
                                    "areal_density = 4.2; damping_time = 0.0; };\n" SMALL_SHAPE "}",
                      .tail = "tools = ( { id = 1; kind = \"probe\"; max_force = 5.0;\n"
                              "  capsules = ( { from = [0.0, 0.0, 0.0]; to = [0.0, 0.0, 0.0]; "
                              "radius = 0.01; } ); } );\n"});
}

// --- Every number that comes ---

typedef struct Numbers {
    long checked, bad;
    double calm_moved; // farthest that a number of "calm" was from its first one [m]
    float calm[126];
    bool saw_calm;
} Numbers;

static void look(Numbers *numbers, double value)
{
    numbers->checked++;
    numbers->bad += !(fabs(value) <= 1e12);
}

static void on_nodes(const lcm_recv_buf_t *buffer, const char *channel, const pliant_nodes_t *m,
                     void *user)
{
    (void)buffer;
    Numbers *numbers = user;
    for (int i = 0; i < m->num_values; i++)
        look(numbers, (double)m->position[i]);
    if (strcmp(channel, "PLIANT_NODES_calm") != 0)
        return;
    assert_int_equal(m->num_values, 126); // one chunk
    if (!numbers->saw_calm)
        memcpy(numbers->calm, m->position, sizeof numbers->calm);
    numbers->saw_calm = true;
    for (int i = 0; i < 126; i++)
        numbers->calm_moved =
            fmax(numbers->calm_moved, fabs((double)(m->position[i] - numbers->calm[i])));
}

HANDLER(on_contact, pliant_contact_t, m)
{
    Numbers *numbers = user;
    for (int c = 0; c < 3; c++) {
        look(numbers, m->position[c]);
        look(numbers, m->force[c]);
        look(numbers, m->torque[c]);
        look(numbers, m->point[c]);
        look(numbers, m->normal[c]);
        for (int k = 0; k < 3; k++)
            look(numbers, m->stiffness[c][k]);
    }
    look(numbers, m->depth);
    look(numbers, m->damping);
}

HANDLER(on_status, pliant_status_t, m)
{
    for (int i = 0; i < m->num_bodies; i++) {
        const pliant_body_status_t *body = &m->body[i];
        // Energies may be as large as a body of 1e5 m has them; but they are numbers.
        look(user, isfinite(body->kinetic) ? 0.0 : (double)NAN);
        look(user, isfinite(body->elastic) ? 0.0 : (double)NAN);
        look(user, body->max_displacement);
        look(user, body->time_step);
    }
}

typedef struct Watch {
    pliant_nodes_t_subscription_t *nodes, *velocities;
    pliant_contact_t_subscription_t *contacts;
    pliant_status_t_subscription_t *states;
} Watch;

static Watch watch(Client *client, Numbers *numbers)
{
    lcm_t *lcm = client->lcm;
    *numbers = (Numbers){0};
    return (Watch){
        .nodes = pliant_nodes_t_subscribe(lcm, "PLIANT_NODES_.*", on_nodes, numbers),
        .velocities = pliant_nodes_t_subscribe(lcm, "PLIANT_VELOCITY_.*", on_nodes, numbers),
        .contacts = pliant_contact_t_subscribe(lcm, "PLIANT_CONTACT", on_contact, numbers),
        .states = pliant_status_t_subscribe(lcm, "PLIANT_STATUS", on_status, numbers)};
}

static void watch_no_more(Client *client, const Watch *on)
{
    pliant_nodes_t_unsubscribe(client->lcm, on->nodes);
    pliant_nodes_t_unsubscribe(client->lcm, on->velocities);
    pliant_contact_t_unsubscribe(client->lcm, on->contacts);
    pliant_status_t_unsubscribe(client->lcm, on->states);
}

static void expect_resumable(const char *checkpoint, const char *scene)
{
    Process daemon;
    run_daemon_well(&daemon, "--offline 0.2 --resume %s %s", checkpoint, scene);
    assert_null(strstr(daemon.out, "nan"));
    assert_null(strstr(daemon.out, "inf"));
}

// ---------------------------------------------------------------------------------------------

TEST(a_load_that_tears_a_body_away_is_withdrawn)
{
    const char *scene = make_scene("load.cfg", "", 80.0);
    const char *checkpoint = scratch("load.h5"), *log = scratch("load.log");
    SCOPED_CLIENT Client *client = client_create();
    Numbers numbers;
    const Watch on = watch(client, &numbers);
    server_start_for(client, &pliantd, "--checkpoint %s --log-inputs %s %s", checkpoint, log,
                     scene);
    const double push[3] = {1e6, 0.0, 0.0};
    const Reply *reply = apply_load(client, TOP, 0.03, push, 100.0, "sphere");
    const int32_t id = reply->id;
    assert_true(reply->ok);
    wait_until(client, client->status.resets > 0);
    // In the middle of it a checkpoint is requested.
    assert_true(command(client, PLIANT_COMMAND_T_CHECKPOINT, 0, "")->ok);
    wait_until(client, refused(client, "withdrawn_loads") == 1);
    wait_until(client, client->status.max_displacement < 0.05); // hangs g / w^2 below
    assert_true(saw_event(client, "restored"));
    char who[64];
    snprintf(who, sizeof who, "load %d of sender %d", id, client->sender);
    expect_in(event_text(client, "restored"), who);
    expect_in(event_text(client, "withdrawn"), who);
    assert_true(refused(client, "restored_load") >= 3);
    assert_int_equal(refused(client, "restored_load"), client->status.resets);
    assert_true(numbers.checked > 1000);
    assert_int_equal(numbers.bad, 0);
    // Swings about g / w^2 below rest, 0.4 mm, no farther than twice that.
    assert_true(numbers.saw_calm);
    expect_at_most(numbers.calm_moved, 1e-3 + 1e-6);
    process_end(&pliantd);
    expect_in(pliantd.out, "  withdrawn_loads: 1\n");
    char live[32], repeated[32];
    printed_state(&pliantd, live);
    const long long ticks = printed(&pliantd, "step");
    expect_resumable(checkpoint, scene);
    // The same inputs, offline: the same restores, and the same bits.
    run_daemon_well(&pliantd, "--offline %.6f --input %s %s", (double)ticks / 500.0, log, scene);
    printed_state(&pliantd, repeated);
    assert_string_equal(live, repeated);
    expect_in(pliantd.out, "  withdrawn_loads: 1\n");
    watch_no_more(client, &on);
}

TEST(a_body_beyond_its_bound_tells_why_and_sends_nothing_else)
{
    const char *scene =
        make_scene("step.cfg", "time_step = 0.002; unsafe_time_step = true;", 8.0e5);
    const char *checkpoint = scratch("step.h5");
    SCOPED_CLIENT Client *client = client_create();
    Numbers numbers;
    const Watch on = watch(client, &numbers);
    server_start_for(client, &pliantd, "--checkpoint %s %s", checkpoint, scene);
    for (int i = 0; i < 500; i++) { // a hand that goes on pressing
        send_pose_at(client, TOP);
        client_listen(client, 5);
    }
    wait_until(client, saw_event(client, "restored"));
    expect_in(event_text(client, "restored"), "time_step 0.002 s beyond its bound");
    assert_true(refused(client, "restored_time_step") > 0);
    assert_true(refused(client, "rest_shapes") > 0);
    // It is frozen once, and the other body goes on.
    expect_in(event_text(client, "frozen"), "shorten time_step");
    assert_int_equal(refused(client, "frozen_bodies"), 1);
    client_fresh_status(client);
    const int64_t resets = client->status.resets, step = client->status.step;
    wait_until(client, client->status.step > step + 500);
    assert_int_equal(client->status.resets, resets);
    assert_true(command(client, PLIANT_COMMAND_T_CHECKPOINT, 0, "")->ok);
    assert_true(numbers.checked > 1000);
    assert_int_equal(numbers.bad, 0);
    expect_at_most(numbers.calm_moved, 1e-3 + 1e-6);
    process_end(&pliantd);
    expect_resumable(checkpoint, scene);
    watch_no_more(client, &on);
}
