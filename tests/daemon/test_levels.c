// SPDX-License-Identifier: MIT
// A body that refines and coarsens, through the real daemon: what clients make of its meshes and
// deltas has no cracks at any time, checkpoints and input logs continue and repeat it bit for bit,
// recordings hold every mesh.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "mesh_check.h"

#include "pliant_mesh_delta_t.h"
#include "pliant_mesh_t.h"
#include "pliant_nodes_t.h"
#include "pliant_status_t.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#if WITH_HDF5
#include "recording_view.h"
#endif

static const char LIVE[] =
    "publish = { nodes_hz = 60.0; mesh_hz = 1.0; contact_hz = 100.0; status_hz = 20.0; };";
#if WITH_HDF5
static const char PAUSED[] =
    "start = \"paused\"; publish = { nodes_hz = 60.0; mesh_hz = 1.0; contact_hz = 100.0; };";
static const char LOADS[] = "loads = ( { body = \"sphere\"; center = [0.0, 0.0, 0.05];\n"
                            "  radius = 0.03; force = [0.1, 0.0, -0.4]; start = 0.05;\n"
                            "  duration = 0.4; } );";
#endif

// The small scene with levels.
static const char *write_levels(const char *file, const char *precision, const char *head,
                                const char *tail)
{
    char keys[512];
    snprintf(keys, sizeof keys, "precision = \"%s\"; %s", precision, head);
    return write_body_scene(
        file,
        &(SceneParts){
            .head = keys,
            .body = "levels = 3; adapt = { check_hz = 100.0; };\n"
                    "shape = { angular_frequency = 50.0; damping_ratio = 0.3; };\n" LOWER_FIXED,
            .tail = tail});
}

// ---------------------------------------------------------------------------------------------
// A client that keeps a mesh up to date

enum { SLOTS = 8192 };

typedef struct Watch {
    bool whole; // a mesh has come
    int topology, node_count, triangle_count;
    int id[SLOTS], origin[SLOTS], parent[SLOTS][2], piece[SLOTS], triangle[SLOTS][3];
    signed char level[SLOTS];
    // of what is under way
    int32_t sequence, delta_sequence;
    int parts, delta_parts, delta_chunks;
    bool skip;   // the delta is not of our mesh
    bool behind; // a busy machine has lost a delta: the next whole mesh makes up for it
    // seen
    int meshes, deltas, missed, most_nodes; // missed: though none had been lost
    int frames, frames_ahead;               // whose mesh had not come, likewise
    int32_t finest_level, status_nodes, status_topology;
    lcm_t *lcm;
    pliant_mesh_t_subscription_t *on_mesh;
    pliant_mesh_delta_t_subscription_t *on_delta;
    pliant_nodes_t_subscription_t *on_nodes;
    pliant_status_t_subscription_t *on_status;
} Watch;

static int live_nodes(const Watch *watch)
{
    int count = 0;
    for (int i = 0; i < watch->node_count; i++)
        count += watch->id[i] >= 0;
    return count;
}

static void look(Watch *watch)
{
    const BodyMesh mesh = {.topology = watch->topology,
                           .node_count = watch->node_count,
                           .triangle_count = watch->triangle_count,
                           .node_capacity = SLOTS,
                           .triangle_capacity = SLOTS,
                           .triangle = (const int(*)[3])watch->triangle,
                           .id = watch->id,
                           .origin = watch->origin,
                           .parent = (const int(*)[2])watch->parent,
                           .piece = watch->piece,
                           .level = watch->level};
    expect_crack_free(&mesh, NULL, NULL);
    int nodes = live_nodes(watch);
    watch->most_nodes = nodes > watch->most_nodes ? nodes : watch->most_nodes;
}

static void on_mesh(const lcm_recv_buf_t *buffer, const char *channel, const pliant_mesh_t *m,
                    void *user)
{
    (void)buffer;
    (void)channel;
    Watch *watch = user;
    if (m->sequence != watch->sequence)
        watch->parts = 0;
    watch->sequence = m->sequence;
    assert_in_range(m->node_count, 0, SLOTS);
    assert_in_range(m->triangle_count, 0, SLOTS);
    // Into the mesh itself: of one whose topology we have, nothing may differ in slots that matter.
    memcpy(watch->triangle[m->first_triangle], m->triangle,
           (size_t)m->num_indices * sizeof *m->triangle);
    for (int i = 0; i < m->num_nodes; i++) {
        int slot = m->first_node + i;
        if (watch->whole && watch->topology == m->topology)
            assert_int_equal(watch->id[slot], m->id[i]);
        watch->id[slot] = m->id[i];
        watch->origin[slot] = m->origin[i];
        watch->piece[slot] = m->piece[i];
        watch->level[slot] = m->level[i];
        memcpy(watch->parent[slot], m->parent + 2 * i, sizeof watch->parent[slot]);
    }
    if (++watch->parts < m->chunk_count)
        return;
    watch->whole = true;
    watch->behind = false;
    watch->topology = m->topology;
    watch->node_count = m->node_count;
    watch->triangle_count = m->triangle_count;
    watch->meshes++;
    look(watch);
}

static void on_delta(const lcm_recv_buf_t *buffer, const char *channel,
                     const pliant_mesh_delta_t *m, void *user)
{
    (void)buffer;
    (void)channel;
    Watch *watch = user;
    if (m->sequence != watch->delta_sequence) {
        watch->behind |= watch->delta_parts < watch->delta_chunks ||
                         (watch->delta_chunks > 0 &&
                          (uint32_t)m->sequence != (uint32_t)watch->delta_sequence + 1);
        watch->delta_parts = 0;
        watch->delta_chunks = m->chunk_count;
        watch->skip = !watch->whole || m->from_topology != watch->topology;
        watch->missed += watch->whole && watch->skip && !watch->behind;
        assert_in_range(m->node_count, 0, SLOTS);
        assert_in_range(m->triangle_count, 0, SLOTS);
        // Slots that the mesh has not had are free unless the delta names them.
        for (int i = watch->node_count; !watch->skip && i < m->node_count; i++)
            watch->id[i] = -1;
        for (int t = watch->triangle_count; !watch->skip && t < m->triangle_count; t++)
            memset(watch->triangle[t], 0, sizeof watch->triangle[t]);
    }
    watch->delta_sequence = m->sequence;
    watch->delta_parts++;
    if (watch->skip)
        return;
    assert_true(m->topology > m->from_topology);
    for (int i = 0; i < m->num_triangles; i++) {
        assert_in_range(m->triangle_slot[i], 0, SLOTS - 1);
        memcpy(watch->triangle[m->triangle_slot[i]], m->triangle + 3 * i, 3 * sizeof *m->triangle);
    }
    for (int i = 0; i < m->num_nodes; i++) {
        int slot = m->node_slot[i];
        assert_in_range(slot, 0, SLOTS - 1);
        watch->id[slot] = m->id[i];
        watch->origin[slot] = m->origin[i];
        watch->piece[slot] = m->piece[i];
        watch->level[slot] = m->level[i];
        memcpy(watch->parent[slot], m->parent + 2 * i, sizeof watch->parent[slot]);
    }
    if (watch->delta_parts < m->chunk_count)
        return;
    watch->topology = m->topology;
    watch->node_count = m->node_count;
    watch->triangle_count = m->triangle_count;
    watch->deltas++;
    look(watch);
}

static void on_nodes(const lcm_recv_buf_t *buffer, const char *channel, const pliant_nodes_t *m,
                     void *user)
{
    (void)buffer;
    (void)channel;
    Watch *watch = user;
    for (int i = 0; i < m->num_values; i++)
        assert_true(isfinite(m->position[i]));
    if (!watch->whole)
        return;
    watch->frames++;
    watch->frames_ahead +=
        !watch->behind && (m->topology != watch->topology || m->node_count != watch->node_count);
}

static void on_status(const lcm_recv_buf_t *buffer, const char *channel, const pliant_status_t *m,
                      void *user)
{
    (void)buffer;
    (void)channel;
    Watch *watch = user;
    assert_int_equal(m->num_bodies, 1);
    watch->finest_level = m->body[0].finest_level;
    watch->status_nodes = m->body[0].nodes;
    watch->status_topology = m->body[0].topology;
    assert_true(isfinite(m->body[0].kinetic) && isfinite(m->body[0].elastic));
}

static Watch *watch_create(void)
{
    Watch *watch = calloc(1, sizeof *watch);
    watch->sequence = watch->delta_sequence = -1;
    watch->lcm = lcm_create(NULL);
    assert_non_null(watch->lcm);
    lcm_t *lcm = watch->lcm;
    watch->on_mesh = pliant_mesh_t_subscribe(lcm, "PLIANT_MESH_sphere", on_mesh, watch);
    watch->on_delta =
        pliant_mesh_delta_t_subscribe(lcm, "PLIANT_MESH_DELTA_sphere", on_delta, watch);
    watch->on_nodes = pliant_nodes_t_subscribe(lcm, "PLIANT_NODES_sphere", on_nodes, watch);
    watch->on_status = pliant_status_t_subscribe(lcm, "PLIANT_STATUS", on_status, watch);
    pliant_mesh_t_subscription_set_queue_capacity(watch->on_mesh, 4096);
    pliant_mesh_delta_t_subscription_set_queue_capacity(watch->on_delta, 4096);
    pliant_nodes_t_subscription_set_queue_capacity(watch->on_nodes, 4096);
    pliant_status_t_subscription_set_queue_capacity(watch->on_status, 4096);
    return watch;
}

static void watch_destroy(Watch *watch)
{
    pliant_mesh_t_unsubscribe(watch->lcm, watch->on_mesh);
    pliant_mesh_delta_t_unsubscribe(watch->lcm, watch->on_delta);
    pliant_nodes_t_unsubscribe(watch->lcm, watch->on_nodes);
    pliant_status_t_unsubscribe(watch->lcm, watch->on_status);
    lcm_destroy(watch->lcm);
    free(watch);
}

static void watch_all(Watch *watch)
{
    while (lcm_handle_timeout(watch->lcm, 0) > 0)
        ;
}

// Presses for a number of poses, about 3 ms each; both watchers follow.
static void press(Client *client, Watch *watch, Watch *other, int poses)
{
    for (int i = 0; i < poses; i++) {
        double angle = 0.02 * i;
        double position[3] = {0.015 * cos(angle), 0.015 * sin(angle), 0.046};
        pliant_tool_pose_t pose = make_pose(client, position);
        send_pose(client, &pose);
        client_listen(client, 3);
        watch_all(watch);
        if (other != NULL)
            watch_all(other);
    }
}

#define watch_until(client, watch, condition)                                                      \
    do {                                                                                           \
        double limit_ = client_now() + 30.0;                                                       \
        while (!(condition) && client_now() < limit_) {                                            \
            client_listen(client, 5);                                                              \
            watch_all(watch);                                                                      \
        }                                                                                          \
        assert_true(condition);                                                                    \
    } while (0)

AROUND_EACH(NULL, harness_teardown)

// Every delta is of the mesh before it, unless a busy machine has lost one.
TEST(clients_see_a_mesh_without_cracks_at_all_times)
{
    Client *client = client_create();
    Watch *watch = watch_create();
    Process daemon;
    daemon_start(&daemon, "%s", write_levels("live.cfg", "single", LIVE, PROBE_TOOL));
    client_wait_for_daemon(client);
    watch_until(client, watch, watch->whole);
    assert_int_equal(live_nodes(watch), SPHERE_NODES);
    press(client, watch, NULL, 250);
    assert_true(watch->deltas > 3 && watch->most_nodes > 60);
    assert_true(watch->finest_level >= 1 && watch->status_nodes > SPHERE_NODES);

    // One who comes late has the mesh as soon as it asks, and follows from there.
    Watch *late = watch_create();
    assert_true(command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "")->ok);
    press(client, watch, late, 150);
    assert_true(late->whole);
    assert_int_equal(late->missed, 0);
    assert_true(late->deltas > 0);
    watch_destroy(late);

    // The tool is withdrawn by silence; the mesh becomes what it was.
    watch_until(client, watch, live_nodes(watch) == SPHERE_NODES && watch->finest_level == 0);
    assert_int_equal(watch->status_nodes, SPHERE_NODES);
    assert_int_equal(watch->missed, 0);
    assert_int_equal(watch->frames_ahead, 0);
    assert_true(watch->frames > 30);
    command(client, PLIANT_COMMAND_T_STOP, 0, "");
    process_wait(&daemon);
    assert_int_equal(daemon.code, 0);
    watch_destroy(watch);
    client_destroy(client);
}

TEST(a_reset_takes_clients_back_to_the_first_mesh)
{
    Client *client = client_create();
    Watch *watch = watch_create();
    Process daemon;
    daemon_start(&daemon, "%s", write_levels("reset.cfg", "double", LIVE, PROBE_TOOL));
    client_wait_for_daemon(client);
    watch_until(client, watch, watch->whole);
    press(client, watch, NULL, 150);
    int before = watch->topology;
    assert_true(live_nodes(watch) > SPHERE_NODES);
    // Softer than it was loaded, which no step forbids, while it is refined.
    assert_true(command(client, PLIANT_COMMAND_T_SET, 0, "stiffness_scale=0.9")->ok);
    command(client, PLIANT_COMMAND_T_RESET, 0, "");
    watch_until(client, watch, live_nodes(watch) == SPHERE_NODES);
    assert_true(watch->topology > before); // a number of its own
    press(client, watch, NULL, 100);
    assert_int_equal(watch->missed, 0);
    assert_int_equal(watch->frames_ahead, 0);
    command(client, PLIANT_COMMAND_T_STOP, 0, "");
    process_wait(&daemon);
    assert_int_equal(daemon.code, 0);
    watch_destroy(watch);
    client_destroy(client);
}

#if WITH_HDF5
// ---------------------------------------------------------------------------------------------
// The same bits

// A live daemon in lockstep: `first` ticks and a checkpoint, then the rest.
static void step_live(const char *arguments, int ticks, char hash[32])
{
    Client *client = client_create();
    Process daemon;
    daemon_start(&daemon, "%s", arguments);
    client_wait_for_daemon(client);
    const Reply *reply = command(client, PLIANT_COMMAND_T_STEP, ticks, "");
    assert_true(reply->ok);
    command(client, PLIANT_COMMAND_T_STOP, 0, "");
    process_wait(&daemon);
    assert_int_equal(daemon.code, 0);
    printed_state(&daemon, hash);
    client_destroy(client);
}

TEST(a_live_run_is_resumed_with_the_same_bits)
{
    const char *scene = write_levels("lockstep.cfg", "single", PAUSED, LOADS);
    const char *part = scratch("lockstep.h5");
    char whole[32], half[32], resumed[32], arguments[1200];
    step_live(scene, 700, whole);
    snprintf(arguments, sizeof arguments, "--checkpoint %s %s", part, scene);
    step_live(arguments, 250, half);
    snprintf(arguments, sizeof arguments, "--resume %s %s", part, scene);
    step_live(arguments, 450, resumed);
    assert_string_not_equal(half, whole);
    assert_string_equal(resumed, whole);
}

// ---------------------------------------------------------------------------------------------
// Recordings

typedef struct Side {
    int32_t from, to;
} Side;

static int compare_sides(const void *left, const void *right)
{
    const Side *a = left, *b = right;
    int32_t low[2] = {a->from < a->to ? a->from : a->to, b->from < b->to ? b->from : b->to};
    int32_t high[2] = {a->from < a->to ? a->to : a->from, b->from < b->to ? b->to : b->from};
    return low[0] != low[1] ? (low[0] > low[1]) - (low[0] < low[1])
                            : (high[0] > high[1]) - (high[0] < high[1]);
}

// Closed: each edge in two triangles, which run along it in opposite directions.
static void expect_closed(int32_t (*triangle)[3], int count)
{
    Side *side = malloc(3 * (size_t)count * sizeof *side);
    for (int i = 0; i < 3 * count; i++)
        side[i] = (Side){triangle[i / 3][i % 3], triangle[i / 3][(i + 1) % 3]};
    qsort(side, 3 * (size_t)count, sizeof *side, compare_sides);
    for (int i = 0; i < 3 * count; i += 2) {
        assert_true(side[i].from == side[i + 1].to && side[i].to == side[i + 1].from);
        assert_true(i + 2 >= 3 * count || compare_sides(&side[i], &side[i + 2]) != 0);
    }
    free(side);
}

TEST(a_recording_holds_every_mesh_without_cracks)
{
    const char *path = scratch("levels.h5");
    Process daemon;
    run_daemon(&daemon, "--offline 1 --record %s %s", path,
               write_levels("record.cfg", "single", LIVE, LOADS));
    assert_int_equal(daemon.code, 0);
    hid_t file = view_open(path, false);
    assert_true(file >= 0);
    BodyView view;
    view_body(&view, file, "sphere");
    H5Fclose(file);
    assert_true(view.topologies > 5);
    int most = 0;
    for (int t = 0; t < view.topologies; t++) {
        assert_true(t == 0 || view.number[t] > view.number[t - 1]);
        expect_closed(view.triangle + view.first_triangle[t], view.triangle_count[t]);
        // Euler's formula for a sphere: V - E + F = 2 with E = 3 F / 2.
        assert_int_equal(view.node_count[t] - view.triangle_count[t] / 2, 2);
        most = view.node_count[t] > most ? view.node_count[t] : most;
    }
    assert_true(most > 2 * SPHERE_NODES);
    for (int f = 0; f < view.frames; f++) {
        int t = 0;
        while (view.number[t] != view.topology[f])
            assert_true(++t < view.topologies);
        assert_int_equal(view.count[f], view.node_count[t]);
        for (int i = 0; i < view.count[f]; i++)
            assert_true(isfinite(view.position[view.first[f] + i][0]) &&
                        isfinite(view.position[view.first[f] + i][1]) &&
                        isfinite(view.position[view.first[f] + i][2]));
    }
    int count;
    char xdmf[1100];
    snprintf(xdmf, sizeof xdmf, "%s.xdmf", path);
    SidecarFrame *frame = view_sidecar(xdmf, &count);
    expect_sidecar_matches(frame, count, &view, "sphere");
    free(frame);
    view_free(&view);
}
#endif
