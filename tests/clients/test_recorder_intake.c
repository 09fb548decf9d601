// SPDX-License-Identifier: MIT
// What pliant-record makes of messages: which frames it hands to its writer, with which mesh, what
// it counts as missing, and when it begins another file.
#include "test.h"
#include "intake.h"
#include "mesh_message.h"

#include "pliant_contact_t.h"
#include "pliant_event_t.h"
#include "pliant_nodes_t.h"
#include "pliant_points_t.h"
#include "pliant_reply_t.h"
#include "pliant_status_t.h"
#include "pliant_tool_pose_t.h"

enum { SLOTS = 5 }; // the last but one is free

typedef struct Rig {
    Intake *intake;
    Queue queue;
    int mesh_sequence;
    int64_t utime;
} Rig;

static void rig_create(Rig *rig, size_t limit)
{
    const IntakeOptions options = {.prefix = "P", .input_prefix = "P", .path = "run.h5"};
    *rig = (Rig){.intake = malloc(sizeof *rig->intake), .utime = 1000};
    assert_non_null(rig->intake);
    queue_create(&rig->queue, limit);
    intake_create(rig->intake, &options, &rig->queue);
}

static void rig_destroy(Rig *rig)
{
    intake_destroy(rig->intake);
    queue_destroy(&rig->queue);
    free(rig->intake);
}

// The next item of the queue; NULL: there is none.
static Item *next(Rig *rig)
{
    bool ended;
    return queue_take(&rig->queue, 0, &ended);
}

static void close_item(Item **item)
{
    item_destroy(*item);
}
#define SCOPED_ITEM SCOPED(close_item)

// The next one, which is there and of this kind.
static Item *next_of(Rig *rig, ItemKind kind)
{
    Item *item = next(rig);
    assert_non_null(item);
    assert_int_equal(item->kind, kind);
    return item;
}

static void expect_next(Rig *rig, ItemKind kind)
{
    item_destroy(next_of(rig, kind));
}

// --- Messages ---

#define SEND(rig, type, channel, message)                                                          \
    do {                                                                                           \
        int size_ = pliant_##type##_encoded_size(message);                                         \
        void *data_ = malloc((size_t)size_);                                                       \
        assert_int_equal(pliant_##type##_encode(data_, 0, size_, message), size_);                 \
        intake_take((rig)->intake, channel, data_, (size_t)size_);                                 \
        free(data_);                                                                               \
    } while (0)

static void send_status(Rig *rig)
{
    char name[] = "ball", other[] = "x";
    pliant_body_status_t body = {.name = name, .model = other, .integrator = other};
    const pliant_status_t status = {
        .scene = other, .state = other, .rate_hz = 1000.0, .num_bodies = 1, .body = &body};
    SEND(rig, status_t, "P_STATUS", &status);
}

static void send_description(Rig *rig)
{
    char text[] = "scene x: 1000 Hz\ntool 7: static, 1 capsules\ntool 2: probe, 1 capsules, "
                  "max_force 5 N\nunits: m\n",
         channel[] = "P_COMMAND";
    const pliant_reply_t reply = {.ok = 1, .channel = channel, .text = text};
    SEND(rig, reply_t, "P_REPLY", &reply);
}

// A strip of triangles; slot 3 is free, and so is the second triangle.
static void send_mesh(Rig *rig, int topology)
{
    int32_t id[SLOTS] = {10, 11, 12, -1, 14}, triangle[9] = {0, 1, 2, 0, 0, 0, 1, 2, 4};
    int32_t none[2 * SLOTS] = {0};
    int8_t level[SLOTS] = {0};
    const pliant_mesh_t mesh = mesh_message(++rig->mesh_sequence, ++rig->utime, topology, SLOTS, id,
                                            none, level, 3, triangle);
    SEND(rig, mesh_t, "P_MESH_ball", &mesh);
}

// Slot i is at (step, i, 0).
static void send_nodes(Rig *rig, int sequence, int64_t step, int topology)
{
    float position[3 * SLOTS] = {0};
    for (int i = 0; i < SLOTS; i++) {
        position[3 * i] = (float)step;
        position[3 * i + 1] = (float)i;
    }
    const pliant_nodes_t nodes = {.utime = ++rig->utime,
                                  .sequence = sequence,
                                  .step = step,
                                  .time = 1e-3 * (double)step,
                                  .topology = topology,
                                  .node_count = SLOTS,
                                  .chunk_count = 1,
                                  .num_values = 3 * SLOTS,
                                  .position = position};
    SEND(rig, nodes_t, "P_NODES_ball", &nodes);
}

// The same as a packet: on a grid of a metre each y is one more than the one before.
static void send_points(Rig *rig, int sequence, int64_t step, int topology)
{
    // Widths 0 2 0, then 0 and four times 2, which stands for +1.
    uint8_t bits[4] = {0x00, 0x80, 0x55, 0x00};
    const pliant_points_t points = {.utime = ++rig->utime,
                                    .sequence = sequence,
                                    .step = step,
                                    .time = 1e-3 * (double)step,
                                    .topology = topology,
                                    .node_count = SLOTS,
                                    .count = SLOTS,
                                    .grid = 1.0f,
                                    .origin = {(int32_t)step, 0, 0},
                                    .num_bytes = sizeof bits,
                                    .data = bits};
    SEND(rig, points_t, "P_POINTS_ball", &points);
}

static void send_contact(Rig *rig, int tool, int64_t step, int64_t pose_utime)
{
    const pliant_contact_t contact = {.tool = tool,
                                      .step = step,
                                      .time = 1e-3 * (double)step,
                                      .pose_utime = pose_utime,
                                      .position = {(double)step, 0.0, 0.0},
                                      .force = {0.0, 0.0, (double)step}};
    SEND(rig, contact_t, "P_CONTACT", &contact);
}

static void send_pose(Rig *rig, int tool, int64_t utime, double x)
{
    const pliant_tool_pose_t pose = {
        .utime = utime, .tool = tool, .orientation = {sqrt(1.0 - x * x), x, 0.0, 0.0}, .active = 1};
    SEND(rig, tool_pose_t, "P_TOOL_POSE", &pose);
}

// A recording that has begun: body "ball" with mesh 1, tools 7 (static) and 2.
static void begin(Rig *rig, size_t limit)
{
    rig_create(rig, limit);
    send_status(rig);
    send_description(rig);
    send_mesh(rig, 1);
    assert_true(intake_begin(rig->intake, true));
    assert_true(rig->intake->open);
    SCOPED_ITEM Item *item = next_of(rig, ITEM_BEGIN);
    assert_string_equal(item->as.begin.path, "run.h5");
    const RecordingOptions *options = &item->as.begin.options;
    assert_int_equal(options->body_count, 1);
    assert_string_equal(options->body[0].name, "ball");
    assert_int_equal(options->tool_count, 2);
    assert_int_equal(options->tool[0], 7);
    assert_int_equal(options->tool[1], 2);
    assert_int_equal(strncmp(options->scene, "scene x", 7), 0);
}

#define BEGIN(rig)                                                                                 \
    SCOPED(rig_destroy) Rig rig;                                                                   \
    begin(&(rig), 1 << 20)

static void expect_frame(Rig *rig, int64_t step, int topology)
{
    static const int slot[4] = {0, 1, 2, 4};
    SCOPED_ITEM Item *item = next_of(rig, ITEM_FRAME);
    const RecordingFrame *frame = &item->as.frame;
    assert_int_equal(frame->step, step);
    assert_int_equal(frame->topology, topology);
    assert_int_equal(frame->node_count, 4);
    for (int i = 0; i < 4; i++) { // small integers: exact
        assert_true(frame->position[3 * i] == (float)step);
        assert_true(frame->position[3 * i + 1] == (float)slot[i]);
    }
}

static void expect_topology(Rig *rig, int number)
{
    static const int id[4] = {10, 11, 12, 14}, triangle[2][3] = {{0, 1, 2}, {1, 2, 3}};
    SCOPED_ITEM Item *item = next_of(rig, ITEM_TOPOLOGY);
    const RecordingTopology *topology = &item->as.topology;
    assert_int_equal(topology->number, number);
    assert_int_equal(topology->node_count, 4);
    assert_int_equal(topology->triangle_count, 2);
    assert_memory_equal(topology->node_id, id, sizeof id);
    assert_memory_equal(topology->triangle, triangle, sizeof triangle);
}

// --- Frames ---

TEST(a_frame_goes_without_free_slots_after_its_mesh)
{
    BEGIN(rig);
    send_nodes(&rig, 1, 10, 1);
    expect_topology(&rig, 1);
    expect_frame(&rig, 10, 1);
    send_nodes(&rig, 2, 20, 1); // the mesh is known
    send_mesh(&rig, 1);         // and said again
    expect_frame(&rig, 20, 1);
    assert_null(next(&rig));
}

TEST(positions_in_packets_are_recorded_once)
{
    BEGIN(rig);
    send_points(&rig, 1, 10, 1);
    expect_topology(&rig, 1);
    expect_frame(&rig, 10, 1);
    send_nodes(&rig, 2, 20, 1); // a scene that sends both
    send_points(&rig, 2, 20, 1);
    expect_frame(&rig, 20, 1);
    assert_null(next(&rig));
}

TEST(frames_wait_for_their_mesh_and_what_lost_its_own_is_counted)
{
    BEGIN(rig);
    rig.intake->wants_mesh = false;
    send_nodes(&rig, 1, 10, 2);
    send_nodes(&rig, 2, 20, 3);
    send_nodes(&rig, 3, 30, 3);
    assert_null(next(&rig));
    assert_true(rig.intake->wants_mesh);
    send_mesh(&rig, 3);
    expect_topology(&rig, 3);
    expect_frame(&rig, 20, 3);
    expect_frame(&rig, 30, 3);
    assert_int_equal(intake_counts(rig.intake).without_mesh, 1);
    // Bounded: the oldest are given up.
    for (int i = 0; i < WAITING_FRAMES + 3; i++)
        send_nodes(&rig, 4 + i, 40 + i, 9);
    assert_null(next(&rig));
    assert_int_equal(intake_counts(rig.intake).without_mesh, 4);
    assert_int_equal(rig.intake->body[0].waiting.count, WAITING_FRAMES);
    intake_end(rig.intake);
    SCOPED_ITEM Item *item = next_of(&rig, ITEM_END);
    assert_int_equal(item->as.counts[0].without_mesh, 4 + WAITING_FRAMES);
}

TEST(frames_that_did_not_come_are_counted_by_their_numbers)
{
    BEGIN(rig);
    send_nodes(&rig, 5, 10, 1);
    send_nodes(&rig, 6, 20, 1);
    send_nodes(&rig, 10, 60, 1);
    send_nodes(&rig, 11, 60, 1); // of a tick that was told already
    expect_topology(&rig, 1);
    expect_frame(&rig, 10, 1);
    expect_frame(&rig, 20, 1);
    expect_frame(&rig, 60, 1);
    assert_null(next(&rig));
    assert_int_equal(intake_counts(rig.intake).lost, 3);
}

TEST(what_does_not_fit_into_the_queue_is_dropped_and_counted)
{
    SCOPED(rig_destroy) Rig rig;
    begin(&rig, 1000); // a few items
    for (int i = 1; i <= 20; i++)
        send_nodes(&rig, i, 10 * i, 1);
    expect_topology(&rig, 1);
    int frames = 0;
    for (Item *item; (item = next(&rig)) != NULL; frames++) {
        assert_int_equal(item->as.frame.step, 10 * (frames + 1));
        item_destroy(item);
    }
    assert_in_range(frames, 1, 10);
    assert_int_equal(intake_counts(rig.intake).dropped, 20 - frames);
    // Room again.
    send_nodes(&rig, 21, 210, 1);
    expect_frame(&rig, 210, 1);
}

TEST(what_came_before_the_file_begins_is_recorded_too)
{
    SCOPED(rig_destroy) Rig rig;
    rig_create(&rig, 1 << 20);
    send_nodes(&rig, 3, 30, 1);
    send_status(&rig);
    char text[] = "cut", none[] = "";
    const pliant_event_t event = {.step = 35, .body = none, .kind = text, .text = text};
    SEND(&rig, event_t, "P_EVENT", &event);
    assert_true(intake_begin(rig.intake, true));
    assert_false(rig.intake->open); // no mesh, no description
    send_mesh(&rig, 1);
    send_nodes(&rig, 4, 40, 1);
    assert_true(intake_begin(rig.intake, true));
    assert_false(rig.intake->open);
    assert_true(intake_begin(rig.intake, false)); // long enough: it does not describe itself
    assert_true(rig.intake->open);
    expect_next(&rig, ITEM_BEGIN);
    SCOPED_ITEM Item *item = next_of(&rig, ITEM_EVENT);
    expect_near(item->as.event.time, 0.035, 1e-12); // one rounding
    expect_topology(&rig, 1);
    expect_frame(&rig, 30, 1);
    expect_frame(&rig, 40, 1);
}

TEST(another_run_of_the_daemon_begins_another_file)
{
    BEGIN(rig);
    send_nodes(&rig, 100, 1000, 1);
    expect_topology(&rig, 1);
    expect_frame(&rig, 1000, 1);
    send_nodes(&rig, 1, 10, 1); // its numbers begin again
    expect_next(&rig, ITEM_END);
    assert_int_equal(rig.intake->restarts, 1);
    assert_true(intake_begin(rig.intake, false));
    assert_false(rig.intake->open); // what the other one said means nothing now
    rig.mesh_sequence = 0;
    send_mesh(&rig, 1);
    send_status(&rig);
    send_description(&rig);
    assert_true(intake_begin(rig.intake, true));
    SCOPED_ITEM Item *item = next_of(&rig, ITEM_BEGIN);
    assert_string_equal(item->as.begin.path, "run.2.h5");
    expect_topology(&rig, 1);
    expect_frame(&rig, 10, 1);
    assert_int_equal(intake_counts(rig.intake).lost, 0);
}

TEST(bodies_that_no_status_lists_are_not_recorded)
{
    SCOPED(rig_destroy) Rig rig;
    rig_create(&rig, 1 << 20);
    send_status(&rig);
    for (int i = 0; i < 2 * ITEM_BODIES; i++) {
        char channel[32];
        snprintf(channel, sizeof channel, "P_NODES_other%d", i);
        intake_take(rig.intake, channel, channel, sizeof channel);
    }
    assert_int_equal(rig.intake->survey.body_count, 1);
    send_description(&rig);
    send_mesh(&rig, 1);
    assert_true(intake_begin(rig.intake, true));
    assert_int_equal(rig.intake->bodies, 1);
}

TEST(files_are_numbered_before_their_ending)
{
    static const char *const cases[][2] = {{"run.h5", "run.2.h5"},
                                           {"a.b/run", "a.b/run.2"},
                                           {"a.b/run.x.h5", "a.b/run.x.2.h5"},
                                           {"a/.hidden", "a/.hidden.2"},
                                           {".hidden", ".hidden.2"}};
    for (int k = 0; k < 5; k++) {
        FREED char *first = intake_path(cases[k][0], 1), *second = intake_path(cases[k][0], 2);
        assert_string_equal(first, cases[k][0]);
        assert_string_equal(second, cases[k][1]);
    }
}

// --- Tools ---

static void expect_row(Rig *rig, int index, double step, double turn)
{
    SCOPED_ITEM Item *item = next_of(rig, ITEM_TOOL);
    assert_int_equal(item->index, index);
    const RecordingTool *sample = &item->as.tool.sample;
    expect_near(item->as.tool.time, 1e-3 * step, 1e-12); // one rounding
    expect_near(sample->position.x, step, 0.0);
    expect_near(sample->force.z, step, 0.0);
    if (isnan(turn))
        assert_true(isnan(sample->orientation.x));
    else
        expect_near(sample->orientation.x, turn, 0.0);
}

TEST(tools_have_a_row_at_the_tick_of_each_frame)
{
    enum { STATIC, PROBE };
    BEGIN(rig);
    send_pose(&rig, 2, 500, 0.25);
    send_pose(&rig, 2, 501, 0.5);
    for (int step = 1; step <= 10; step++) {
        send_contact(&rig, 7, step, 0);
        send_contact(&rig, 2, step, step < 10 ? 0 : 500); // driven from there on
        send_contact(&rig, 99, step, 500);                // not one of the scene
    }
    send_nodes(&rig, 1, 5, 1);
    expect_topology(&rig, 1);
    expect_next(&rig, ITEM_FRAME);
    expect_row(&rig, STATIC, 5, 0.0);
    assert_null(next(&rig));
    send_nodes(&rig, 2, 10, 1);
    expect_next(&rig, ITEM_FRAME);
    expect_row(&rig, STATIC, 10, 0.0);
    expect_row(&rig, PROBE, 10, 0.25);
    // A frame that comes before the contact of its tick.
    send_nodes(&rig, 3, 15, 1);
    expect_next(&rig, ITEM_FRAME);
    assert_null(next(&rig));
    send_contact(&rig, 2, 14, 501);
    assert_null(next(&rig));
    send_contact(&rig, 2, 16, 501); // that of 15 is lost: the one before it
    expect_row(&rig, PROBE, 14, 0.5);
    assert_null(next(&rig));
}

TEST(a_turn_that_nobody_told_is_not_a_number)
{
    BEGIN(rig);
    send_contact(&rig, 2, 10, 600);
    send_nodes(&rig, 1, 10, 1);
    expect_topology(&rig, 1);
    expect_next(&rig, ITEM_FRAME);
    expect_row(&rig, 1, 10, (double)NAN);
}

// --- The queue ---

// Counts the items that come in their order.
static void *take_all(void *user)
{
    Queue *queue = user;
    int64_t *taken = calloc(1, sizeof *taken);
    bool ended = false;
    while (!ended) {
        Item *item = queue_take(queue, 1000, &ended);
        if (item == NULL)
            continue;
        *taken += item->as.tool.time == (double)*taken;
        item_destroy(item);
    }
    return taken;
}

TEST(a_queue_that_waits_loses_nothing_and_keeps_the_order)
{
    enum { ITEMS = 5000 };
    Queue queue;
    pthread_t thread;
    const RecordingTool sample = {0};
    queue_create(&queue, 2000);
    assert_int_equal(pthread_create(&thread, NULL, take_all, &queue), 0);
    for (int i = 0; i < ITEMS; i++)
        assert_true(queue_push(&queue, item_tool(0, i, &sample), QUEUE_WAIT));
    queue_close(&queue);
    void *taken;
    pthread_join(thread, &taken);
    assert_int_equal(*(int64_t *)taken, ITEMS);
    assert_in_range(queue.most, 1, 2000);
    free(taken);
    queue_destroy(&queue);
}
