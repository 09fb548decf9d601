// SPDX-License-Identifier: MIT
// The errors of bodies and of tools' forces from the real daemon (error_t), and where on a body
// they are (error_map_t).
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

#include "pliant_error_map_t.h"
#include "pliant_error_t.h"

enum { SPHERE = 642 };

static const double PRESS[3] = {0.0, 0.0, 0.051}, AWAY[3] = {0.0, 0.0, 0.2};

// What has come.
typedef struct Errors {
    int count, maps;
    pliant_error_t *newest; // owned
    int32_t topology;       // of the newest map
    int parts;
    unsigned char share[SPHERE];
} Errors;

HANDLER(on_error, pliant_error_t, message)
{
    Errors *errors = user;
    if (errors->newest != NULL) {
        assert_int_equal(message->sequence, errors->newest->sequence + 1);
        assert_true(message->step >= errors->newest->step);
        pliant_error_t_destroy(errors->newest);
    }
    errors->newest = pliant_error_t_copy(message);
    errors->count++;
    assert_int_equal(message->num_bodies, 1);
    assert_string_equal(message->body[0].name, "sphere");
    // Sums are those of their parts, and what is not known is -1.
    const pliant_error_body_t *body = &message->body[0];
    assert_true((body->age < 0) == (body->space == -1.0));
    assert_true(body->steps == -1.0 || body->steps >= 0.0);
    assert_true(body->total == (body->age < 0 ? -1.0 : body->space + fmax(0.0, body->steps)));
    assert_true((body->relative >= 0.0) == (body->age >= 0));
    for (int t = 0; t < message->num_tools; t++)
        assert_true(message->tool[t].tool == 1 && message->tool[t].force > 0.0);
}

HANDLER(on_map, pliant_error_map_t, message)
{
    Errors *errors = user;
    assert_int_equal(message->node_count, SPHERE);
    assert_in_range(message->first + message->num_values, 1, SPHERE);
    memcpy(errors->share + message->first, message->share, (size_t)message->num_values);
    errors->parts = message->chunk == 0 ? 1 : errors->parts + 1;
    errors->maps += errors->parts == message->chunk_count;
    errors->topology = message->topology;
}

static void listen_to(Client *client, Errors *errors)
{
    pliant_error_t_subscription_set_queue_capacity(
        pliant_error_t_subscribe(client->lcm, "PLIANT_ERROR", on_error, errors), 4096);
    pliant_error_map_t_subscription_set_queue_capacity(
        pliant_error_map_t_subscribe(client->lcm, "PLIANT_ERROR_MAP_sphere", on_map, errors), 4096);
}

static void forget(Errors *errors)
{
    if (errors->newest != NULL)
        pliant_error_t_destroy(errors->newest);
}
#define SCOPED_ERRORS SCOPED(forget) Errors

static const char *write_ball(const char *head)
{
    return write_body_scene(
        "ball.cfg",
        &(SceneParts){.head = head, .source = ICO_SPHERE(642, 0.05), .tail = PROBE_TOOL});
}

TEST(a_pressed_wall_tells_its_error_and_that_of_the_force)
{
    SCOPED_ERRORS errors = {0};
    SCOPED_CLIENT Client *client = client_create();
    listen_to(client, &errors);
    server_start_for(client, &pliantd, "%s",
                     write_ball(LOCKSTEP_HEAD("error_hz = 50.0; error_map = true;")));
    // In lockstep errors come with each STEP, whose ticks leave no spare time for tries.
    send_pose_at(client, PRESS);
    step_daemon(client, 200);
    wait_until(client, errors.count > 0 && errors.newest->step == client->frames.step);
    const pliant_error_body_t *body = &errors.newest->body[0];
    assert_true(body->space > 0.0 && body->steps == -1.0);
    assert_in_range(body->age, 0, 199); // of a round that ended since the start
    assert_int_equal(errors.newest->num_tools, 1);
    const pliant_error_tool_t *tool = &errors.newest->tool[0];
    assert_true(tool->error > 0.0 && tool->error < tool->force);
    expect_near(tool->share, tool->error / tool->force, 1e-12);
    expect_near(tool->force, fabs(client->contact.force[2]), 0.02 * tool->force); // it has friction
    // The map has the largest error somewhere, and is of the mesh that is shown.
    wait_until(client, errors.maps > 0);
    assert_int_equal(errors.topology, client->frames.topology);
    int most = 0;
    for (int i = 0; i < SPHERE; i++)
        most = errors.share[i] > most ? errors.share[i] : most;
    assert_int_equal(most, 255);

    // Who comes later asks, also while time stands still.
    const int count = errors.count, maps = errors.maps;
    assert_true(command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "")->ok);
    wait_until(client, errors.count > count && errors.maps > maps);

    // Live there is spare time, and the steps' error is told; a tool that leaves is listed no more.
    command(client, PLIANT_COMMAND_T_RESUME, 0, "");
    hold_pose_until(client, PRESS, errors.newest->body[0].steps >= 0.0);
    hold_pose_until(client, AWAY, errors.newest->num_tools == 0);
    process_end(&pliantd);
}

TEST(unasked_nobody_estimates_or_tells)
{
    SCOPED_ERRORS errors = {0};
    SCOPED_CLIENT Client *client = client_create();
    listen_to(client, &errors);
    server_start_for(client, &pliantd, "%s", write_ball(LOCKSTEP_HEAD("")));
    step_daemon(client, 50);
    assert_true(command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "")->ok);
    step_daemon(client, 1); // behind all that DESCRIBE brings
    assert_int_equal(errors.count + errors.maps, 0);
    process_end(&pliantd);
    // Nor is there memory for it.
    run_daemon_well(&pliantd, "--explain %s", write_ball(LOCKSTEP_HEAD("")));
    expect_in(pliantd.out, "error of bodies in messages");
    assert_null(strstr(pliantd.out, "errors/"));
    assert_null(strstr(pliantd.out, "run/error"));
    run_daemon_well(&pliantd, "--explain %s", write_ball(LOCKSTEP_HEAD("error_hz = 10.0;")));
    expect_in(pliantd.out, "errors/bodies");
    expect_in(pliantd.out, "run/error");
    assert_null(strstr(pliantd.out, "run/error_map"));
}
