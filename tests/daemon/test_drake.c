// SPDX-License-Identifier: MIT
// pliant-drake between a real daemon and a viewer of Drake's, which is played here.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

#include "drake_lcmt_viewer_link_data.h"

// Computed by lcm-gen from Drake's own files: what a program of Drake's knows the messages by.
TEST(the_types_are_those_of_drake)
{
    assert_true(__drake_lcmt_viewer_geometry_data_get_hash() == 0x5d2e34cb3257db07);
    assert_true(__drake_lcmt_viewer_link_data_get_hash() == 0x51252725af982a63);
}

typedef struct Viewer {
    int messages;
    bool good;
} Viewer;

// What the triangles enclose [m3]: right only if each corner is the vertex that it should be.
static double enclosed(const float *x, const float *corner, int triangles)
{
    double volume = 0.0;
    for (int t = 0; t < triangles; t++) {
        const float *a = x + 3 * (int)corner[3 * t], *b = x + 3 * (int)corner[3 * t + 1],
                    *c = x + 3 * (int)corner[3 * t + 2];
        volume += (double)(a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
                           a[2] * (b[0] * c[1] - b[1] * c[0])) /
                  6.0;
    }
    return volume;
}

static void on_link(const lcm_recv_buf_t *buffer, const char *channel,
                    const drake_lcmt_viewer_link_data *link, void *user)
{
    (void)buffer, (void)channel;
    Viewer *viewer = user;
    viewer->messages++;
    viewer->good = false;
    assert_string_equal(link->name, "PLIANT");
    assert_int_equal(link->robot_num, 0);
    assert_int_equal(link->num_geom, 1);
    const drake_lcmt_viewer_geometry_data *shape = &link->geom[0];
    assert_string_equal(shape->string_data, "sphere");
    assert_int_equal(shape->type, 4);
    assert_true(shape->quaternion[0] == 1.0f && shape->quaternion[1] == 0.0f);
    assert_true(shape->color[0] == 0.25f && shape->color[3] == 1.0f);
    assert_int_equal(shape->num_float_data, 2 + 3 * SPHERE_NODES + 3 * SPHERE_TRIANGLES);
    const float *data = shape->float_data;
    assert_true(data[0] == SPHERE_NODES && data[1] == SPHERE_TRIANGLES);
    const float *corner = data + 2 + 3 * SPHERE_NODES;
    for (int k = 0; k < 3 * SPHERE_TRIANGLES; k++)
        assert_true(corner[k] >= 0.0f && corner[k] < SPHERE_NODES);
    // 42 points on a ball of 50 mm enclose 0.873 of it at rest; outward triangles count as
    // positive.
    double volume = enclosed(data + 2, corner, SPHERE_TRIANGLES);
    expect_near(volume, 0.873 * 4.18879 * 1.25e-4, 0.02 * 1.25e-4);
    viewer->good = true;
}

TEST(bodies_reach_a_viewer_as_triangles)
{
    Process daemon, drake;
    Viewer viewer = {0};
    SCOPED_CLIENT Client *client = client_create();
    drake_lcmt_viewer_link_data_subscription_t *links = drake_lcmt_viewer_link_data_subscribe(
        client->lcm, "DRAKE_VIEWER_DEFORMABLE", on_link, &viewer);
    daemon_start(&daemon, "%s", write_scene("drake.cfg", "rate_hz = 100.0;", ""));
    client_wait_for_daemon(client);
    process_start(&drake, program_path("pliant-drake"), "--color 0.25,0.5,0.5");
    wait_until(client, viewer.messages >= 3);
    assert_true(viewer.good);
    process_end(&drake);
    process_end(&daemon);
    drake_lcmt_viewer_link_data_unsubscribe(client->lcm, links);
}

TEST(no_daemon_is_told)
{
    Process drake;
    process_run(&drake, program_path("pliant-drake"), "--prefix OTHER --duration 0.1");
    expect_ended(&drake, 1, "no body came on OTHER_NODES_*");
}
