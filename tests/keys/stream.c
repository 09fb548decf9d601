// SPDX-License-Identifier: MIT
#include "stream.h"

#include "lcm_client.h"

#include "pliant_contact_t.h"
#include "pliant_look_t.h"
#include "pliant_mesh_t.h"
#include "pliant_nodes_t.h"
#include "pliant_status_t.h"
#include "pliant_tool_pose_t.h"

#include <lcm/lcm.h>

#include <poll.h>
#include <sys/wait.h>

enum { RUNS = 24, FIRST_PORT = 7700, KIND_COUNT = 10 };
#define RATE    "rate_hz = 200.0;\n"
#define SECONDS "3.0" // two presses: the stiffness of a contact takes dozens of its ticks

// The kinds of channels by what stands behind the prefix.
static const char *const KIND[KIND_COUNT] = {"_NODES_",     "_VELOCITY_", "_MESH_",   "_REST_",
                                             "_CONTACT",    "_STATUS",    "_POINTS_", "_LOOK_",
                                             "_ERROR_MAP_", "_ELEMENTS_"};

// What came of one daemon; zero where nothing came.
typedef struct Stream {
    int count[KIND_COUNT]; // messages
    char body[64], scene[64];
    int nodes, tool;
    bool steps, touches, stiffness, error;
} Stream;

typedef struct StreamRun {
    const KeyRow *row; // NULL: the scene without a change
    Process daemon;
    lcm_t *lcm;
    Stream stream;
} StreamRun;

static void take_contact(Stream *stream, const lcm_recv_buf_t *buffer)
{
    pliant_contact_t contact;
    assert_true(pliant_contact_t_decode(buffer->data, 0, (int)buffer->data_size, &contact) > 0);
    stream->tool = contact.tool;
    stream->touches |= contact.contact;
    for (int i = 0; i < 9; i++)
        stream->stiffness |= contact.stiffness[i / 3][i % 3] != 0.0;
    pliant_contact_t_decode_cleanup(&contact);
}

static void take_status(Stream *stream, const lcm_recv_buf_t *buffer)
{
    pliant_status_t status;
    assert_true(pliant_status_t_decode(buffer->data, 0, (int)buffer->data_size, &status) > 0);
    snprintf(stream->scene, sizeof stream->scene, "%s", status.scene);
    stream->steps |= status.step > 0;
    for (int b = 0; b < status.num_bodies; b++)
        stream->error |= status.body[b].estimated_error > 0.0;
    pliant_status_t_decode_cleanup(&status);
}

static void on_message(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    Stream *stream = user;
    if (strncmp(channel, "PLIANT_", 7) != 0)
        return;
    for (int k = 0; k < KIND_COUNT; k++)
        if (strncmp(channel + 6, KIND[k], strlen(KIND[k])) == 0) {
            stream->count[k]++;
            if (k == 0) {
                pliant_nodes_t nodes;
                assert_true(pliant_nodes_t_decode(buffer->data, 0, (int)buffer->data_size, &nodes) >
                            0);
                stream->nodes = nodes.node_count;
                snprintf(stream->body, sizeof stream->body, "%s", channel + 6 + strlen(KIND[k]));
                pliant_nodes_t_decode_cleanup(&nodes);
            } else if (k == 4) {
                take_contact(stream, buffer);
            } else if (k == 5) {
                take_status(stream, buffer);
            }
            return;
        }
}

// A count is another when it is more than twice the other: late ticks take some messages away.
static bool differ(const Stream *a, const Stream *b)
{
    for (int k = 0; k < KIND_COUNT; k++) {
        int less = a->count[k] < b->count[k] ? a->count[k] : b->count[k];
        int more = a->count[k] + b->count[k] - less;
        if (more > 2 * less + 3 || (less == 0 && more > 0))
            return true;
    }
    return strcmp(a->body, b->body) != 0 || strcmp(a->scene, b->scene) != 0 ||
           a->nodes != b->nodes || a->tool != b->tool || a->steps != b->steps ||
           a->touches != b->touches || a->stiffness != b->stiffness || a->error != b->error;
}

static void begin(StreamRun *run, KeyModel model, int index)
{
    KeyRow row = run->row != NULL ? *run->row : (KeyRow){.part = HEAD};
    char url[64], name[32];
    row.also[0] = (Change){LOADS, ""};
    row.also[1] = (Change){BODY, "fixed = ( { box = ([-1, -1, -1], [1, 0.01, 0.01]); } );"};
    snprintf(url, sizeof url, "udpm://239.255.76.67:%d?ttl=0", FIRST_PORT + index);
    run->lcm = lcm_create(url);
    assert_non_null(run->lcm);
    lcm_subscription_t *all = lcm_subscribe(run->lcm, "PLIANT_.*", on_message, &run->stream);
    lcm_subscription_set_queue_capacity(all, 10000);
    FREED char *text = key_scene(&row, model, run->row != NULL, RATE);
    snprintf(name, sizeof name, "stream-%d.cfg", index);
    const char *path = scratch(name);
    write_text(path, text);
    // The command line has the last word, so the scene's own network is tried without.
    if (run->row != NULL && strcmp(run->row->key, "lcm_url") == 0)
        daemon_start(&run->daemon, "--duration " SECONDS " %s", path);
    else
        daemon_start(&run->daemon, "--duration " SECONDS " --lcm-url %s %s", url, path);
}

// A probe that is pressed into the body and comes back, until the daemon ends.
static void drive(StreamRun *run, KeyModel model, int sequence)
{
    pliant_tool_pose_t pose = {.utime = sequence,
                               .sender = 5,
                               .sequence = sequence,
                               .tool = 1,
                               .position = {0.0, 0.0, 0.0},
                               .orientation = {1.0, 0.0, 0.0, 0.0},
                               .active = true};
    const double part = fabs((sequence % 120) / 60.0 - 1.0); // 1, 0, 1 within 1.2 s
    pose.position[model == KEY_PLANE ? 1 : 2] = 0.045 + 0.03 * part;
    pliant_tool_pose_t_publish(run->lcm, "PLIANT_TOOL_POSE", &pose);
    pose.tool = 7; // of the row of tools.id; refused elsewhere
    if (run->row != NULL && strcmp(run->row->key, "id") == 0)
        pliant_tool_pose_t_publish(run->lcm, "PLIANT_TOOL_POSE", &pose);
}

static bool is_paused(const StreamRun *run)
{
    return run->row != NULL && strcmp(run->row->key, "start") == 0;
}

// A paused one never does, and counts as ended.
static bool has_ended(const StreamRun *run)
{
    if (is_paused(run))
        return true;
    siginfo_t info = {0};
    return waitid(P_PID, (id_t)run->daemon.pid, &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid != 0;
}

// Until every daemon has ended of itself: a minute at most, which daemon_wait then tells.
static void listen(StreamRun *run, int runs, KeyModel model)
{
    const double begin = client_now();
    double next = begin;
    int running = runs, sequence = 0;
    while (running > 0 && client_now() < begin + 60.0) {
        struct pollfd fd[RUNS];
        for (int i = 0; i < runs; i++)
            fd[i] = (struct pollfd){.fd = lcm_get_fileno(run[i].lcm), .events = POLLIN};
        poll(fd, (nfds_t)runs, 5);
        for (int i = 0; i < runs; i++)
            if (fd[i].revents & POLLIN)
                lcm_handle(run[i].lcm);
        if (client_now() < next)
            continue;
        next = client_now() + 0.01;
        sequence++;
        running = 0;
        for (int i = 0; i < runs; i++) {
            drive(&run[i], model, sequence);
            running += !has_ended(&run[i]);
        }
    }
}

int stream_faults(KeyModel model, const char *model_name)
{
    static StreamRun run[RUNS];
    int runs = 1, faults = 0;
    memset(run, 0, sizeof run);
    for (int i = 0; i < KEY_ROW_COUNT; i++)
        if (KEY_ROWS[i].evidence == STREAM && KEY_ROWS[i].models & 1 << model) {
            assert_true(runs < RUNS);
            run[runs++].row = &KEY_ROWS[i];
        }
    for (int i = 0; i < runs; i++)
        begin(&run[i], model, i);
    listen(run, runs, model);
    for (int i = 0; i < runs; i++) {
        if (is_paused(&run[i]))
            process_signal(&run[i].daemon, SIGTERM);
        process_wait(&run[i].daemon);
        if (run[i].daemon.code != 0)
            fail_msg("%s", run[i].daemon.err);
        lcm_destroy(run[i].lcm);
    }
    const Stream *base = &run[0].stream;
    for (int k = 0; k < KIND_COUNT; k++)
        print_message("%s%s %d", k > 0 ? ", " : "", KIND[k], base->count[k]);
    print_message(" messages of a %s body\n%s", model_name, base->touches ? "" : run[0].daemon.out);
    assert_true(base->count[0] > 0 && base->steps && base->touches); // it says something at all
    for (int i = 1; i < runs; i++)
        if (!differ(&run[i].stream, base)) {
            print_error("%s.%s of a %s body: the stream is the same\n", run[i].row->table->path,
                        run[i].row->key, model_name);
            faults++;
        }
    return faults;
}
