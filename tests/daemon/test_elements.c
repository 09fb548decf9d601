// SPDX-License-Identifier: MIT
// The elements at the surface of a solid that adapts from the real daemon (elements_t).
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

#include "pliant_elements_t.h"

enum { EDGE = 16, SQUARES = 6 * EDGE * EDGE };

static const double PRESS[3] = {0.0, 0.0, 0.052}, AWAY[3] = {0.0, 0.0, 0.3};

// What has come.
typedef struct Elements {
    int count, parts;
    int32_t topology, at_level[3]; // of the newest
    unsigned char level[SQUARES];
} Elements;

HANDLER(on_elements, pliant_elements_t, message)
{
    Elements *elements = user;
    assert_int_equal(message->square_count, SQUARES);
    assert_in_range(message->first + message->num_squares, 1, SQUARES);
    assert_true(message->num_levels >= 3);
    memcpy(elements->level + message->first, message->level, (size_t)message->num_squares);
    memcpy(elements->at_level, message->elements, sizeof elements->at_level);
    elements->parts = message->chunk == 0 ? 1 : elements->parts + 1;
    elements->count += elements->parts == message->chunk_count;
    elements->topology = message->topology;
}

static void listen_to(Client *client, Elements *elements)
{
    pliant_elements_t_subscription_set_queue_capacity(
        pliant_elements_t_subscribe(client->lcm, "PLIANT_ELEMENTS_cube", on_elements, elements),
        4096);
}

// 100 ticks a second, so that a busy machine has time to spare in each.
static const char *write_cube(const char *publish)
{
    char head[256];
    snprintf(head, sizeof head,
             "rate_hz = 100.0; start = \"paused\";\n"
             "publish = { mesh_hz = 0.0; status_hz = 20.0; %s };",
             publish);
    return write_body_scene(
        "cube.cfg", &(SceneParts){.head = head,
                                  .name = "cube",
                                  .source = "model = \"voxel\"; voxels = { generator = \"box\"; "
                                            "count = [16, 16, 16]; size = 0.00625; };",
                                  .material = "youngs_modulus = 5000.0; poisson_ratio = 0.3; "
                                              "density = 1050.0;",
                                  .body = "levels = { inside = 2; surface = 2; }; fixed = ( { box "
                                          "= ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0499]); } );",
                                  .tail = PROBE_TOOL});
}

static void step(Client *client, int ticks)
{
    assert_true(command(client, PLIANT_COMMAND_T_STEP, ticks, "")->ok);
}

static int fine_squares(const Elements *elements)
{
    int fine = 0;
    for (int q = 0; q < SQUARES; q++)
        fine += elements->level[q] == 0;
    return fine;
}

TEST(elements_are_told_when_they_change_and_on_request)
{
    static Elements elements;
    SCOPED_CLIENT Client *client = client_create();
    listen_to(client, &elements);
    server_start_for(client, &pliantd, "%s", write_cube("elements_hz = 10.0;"));
    // At rest all are large.
    step(client, 20);
    wait_until(client, elements.count > 0);
    assert_int_equal(fine_squares(&elements), 0);
    assert_true(elements.at_level[0] == 0 && elements.at_level[2] == 4 * 4 * 4);
    assert_int_equal(elements.topology, 1);
    // Nothing changes: no more is told, until a client asks.
    const int count = elements.count;
    step(client, 50);
    assert_int_equal(elements.count, count);
    assert_true(command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "")->ok);
    wait_until(client, elements.count > count);
    // Under a tool they are small, while the mesh is the same.
    send_pose_at(client, PRESS);
    step(client, 60);
    wait_until(client, fine_squares(&elements) > 30);
    assert_true(fine_squares(&elements) < SQUARES / 2 && elements.at_level[0] > 60);
    assert_int_equal(elements.topology, 1);
    // And large again behind it.
    send_pose_at(client, AWAY);
    step(client, 400);
    wait_until(client, fine_squares(&elements) == 0);
    assert_int_equal(elements.at_level[2], 4 * 4 * 4);
    process_end(&pliantd);
}

TEST(unasked_no_elements_are_told)
{
    static Elements elements;
    SCOPED_CLIENT Client *client = client_create();
    listen_to(client, &elements);
    server_start_for(client, &pliantd, "%s", write_cube(""));
    step(client, 20);
    assert_true(command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "")->ok);
    step(client, 1); // behind all that DESCRIBE brings
    assert_int_equal(elements.count, 0);
    process_end(&pliantd);
    // Nor is there memory for it.
    run_daemon_well(&pliantd, "--explain %s", write_cube(""));
    assert_null(strstr(pliantd.out, "run/element"));
    run_daemon_well(&pliantd, "--explain %s", write_cube("elements_hz = 10.0;"));
    expect_in(pliantd.out, "run/element");
}
