// SPDX-License-Identifier: MIT
// The elements at the surface of a solid that adapts from the real daemon (elements_t).
#include "test.h"
#include "recorder.h"
#include "scene_writer.h"

#include "io/recording_read.h"
#include "pliant_elements_t.h"
#include "pliant_error_map_t.h"

#include <math.h>

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

static const char *write_cube(const char *head)
{
    return write_body_scene(
        "cube.cfg",
        &(SceneParts){.head = head,
                      .name = "cube",
                      .source = "model = \"voxel\"; voxels = { generator = \"box\"; "
                                "count = [16, 16, 16]; size = 0.00625; };",
                      .material = "youngs_modulus = 5000.0; poisson_ratio = 0.3; "
                                  "density = 1050.0;",
                      .body =
                          "cuttable = true; levels = { inside = 2; surface = 2; }; fixed = ( { box "
                          "= ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0499]); } );",
                      .tail = PROBE_TOOL});
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
    server_start_for(client, &pliantd, "%s", write_cube(LOCKSTEP_HEAD("elements_hz = 10.0;")));
    // At rest all are large.
    step_daemon(client, 20);
    wait_until(client, elements.count > 0);
    assert_int_equal(fine_squares(&elements), 0);
    assert_true(elements.at_level[0] == 0 && elements.at_level[2] == 4 * 4 * 4);
    assert_int_equal(elements.topology, 1);
    // Nothing changes: no more is told, until a client asks.
    const int count = elements.count;
    step_daemon(client, 50);
    assert_int_equal(elements.count, count);
    assert_true(command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "")->ok);
    wait_until(client, elements.count > count);
    // Under a tool they are small, while the mesh is the same.
    send_pose_at(client, PRESS);
    step_daemon(client, 60);
    wait_until(client, fine_squares(&elements) > 30);
    assert_true(fine_squares(&elements) < SQUARES / 2 && elements.at_level[0] > 60);
    assert_int_equal(elements.topology, 1);
    // And large again behind it.
    send_pose_at(client, AWAY);
    step_daemon(client, 400);
    wait_until(client, fine_squares(&elements) == 0);
    assert_int_equal(elements.at_level[2], 4 * 4 * 4);
    process_end(&pliantd);
}

TEST(unasked_no_elements_are_told)
{
    static Elements elements;
    SCOPED_CLIENT Client *client = client_create();
    listen_to(client, &elements);
    server_start_for(client, &pliantd, "%s", write_cube(LOCKSTEP_HEAD("")));
    step_daemon(client, 20);
    assert_true(command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "")->ok);
    step_daemon(client, 1); // behind all that DESCRIBE brings
    assert_int_equal(elements.count, 0);
    process_end(&pliantd);
    // Nor is there memory for it.
    run_daemon_well(&pliantd, "--explain %s", write_cube(LOCKSTEP_HEAD("")));
    assert_null(strstr(pliantd.out, "run/element"));
    run_daemon_well(&pliantd, "--explain %s", write_cube(LOCKSTEP_HEAD("elements_hz = 10.0;")));
    expect_in(pliantd.out, "run/element");
}

// --- recordings ---

// Maps as they came, by their kind and in their order.
enum { MAPS_MOST = 64, NODES_MOST = 4000 };
typedef struct Heard {
    int count[RECORDING_MAPS];
    int64_t step[RECORDING_MAPS][MAPS_MOST];
    int rows[RECORDING_MAPS][MAPS_MOST];
    unsigned char share[MAPS_MOST][NODES_MOST], level[MAPS_MOST][2 * SQUARES];
    int16_t tag[MAPS_MOST][2 * SQUARES];
} Heard;

// Returns where a map belongs that is not a repetition of the newest; -1: it is one.
static int place_of(Heard *heard, RecordingMapKind kind, int64_t step, int rows)
{
    int *count = &heard->count[kind];
    if (*count > 0 && heard->step[kind][*count - 1] == step)
        return -1;
    assert_true(*count < MAPS_MOST);
    heard->step[kind][*count] = step;
    heard->rows[kind][*count] = rows;
    return (*count)++;
}

HANDLER(on_map, pliant_error_map_t, message)
{
    Heard *heard = user;
    assert_int_equal(message->chunk_count, 1);
    const int at = place_of(heard, RECORDING_ERROR_MAP, message->step, message->node_count);
    assert_in_range(message->node_count, 1, NODES_MOST);
    if (at >= 0)
        memcpy(heard->share[at], message->share, (size_t)message->node_count);
}

HANDLER(on_tags, pliant_elements_t, message)
{
    Heard *heard = user;
    assert_int_equal(message->chunk_count, 1);
    assert_in_range(message->square_count, 1, 2 * SQUARES);
    const int at = place_of(heard, RECORDING_ELEMENTS, message->step, message->square_count);
    if (at < 0)
        return;
    memcpy(heard->level[at], message->level, (size_t)message->square_count);
    memcpy(heard->tag[at], message->tag, (size_t)message->square_count * sizeof(int16_t));
}

static void listen_to_maps(Client *client, Heard *heard)
{
    pliant_error_map_t_subscribe(client->lcm, "PLIANT_ERROR_MAP_cube", on_map, heard);
    pliant_elements_t_subscribe(client->lcm, "PLIANT_ELEMENTS_cube", on_tags, heard);
}

// The maps that a recording shares with what was heard, bit for bit, `least` of each kind at least.
// Nothing is free in this mesh, so that its slots are the rows of the file.
static void expect_maps(const char *path, const Heard *heard, int least)
{
    static unsigned char share[NODES_MOST], level[4 * SQUARES];
    static int16_t tag[4 * SQUARES];
    Status status = {0};
    RecordingReader *reader = recording_reader_open(path, &status);
    expect_ok(reader != NULL, status);
    void *const column[RECORDING_MAPS][RECORDING_MAP_COLUMNS] = {{share, NULL}, {tag, level}};
    for (int kind = 0; kind < RECORDING_MAPS; kind++) {
        int same = 0;
        for (int64_t m = 0; m < recording_reader_maps(reader, 0, kind); m++) {
            const RecordingMap map = recording_reader_map(reader, 0, kind, m);
            int h = 0;
            while (h < heard->count[kind] && heard->step[kind][h] != map.step)
                h++;
            if (h == heard->count[kind])
                continue;
            same++;
            assert_true(fabs(map.time - 0.01 * (double)map.step) < 1e-12);
            expect_ok(recording_reader_map_rows(reader, 0, kind, m, column[kind], &status), status);
            if (kind == RECORDING_ERROR_MAP) {
                assert_int_equal(map.count, heard->rows[kind][h]);
                assert_memory_equal(share, heard->share[h], (size_t)map.count);
                continue;
            }
            assert_int_equal(map.count, 2 * heard->rows[kind][h]);
            for (int t = 0; t < map.count; t++)
                assert_true(level[t] == heard->level[h][t / 2] && tag[t] == heard->tag[h][t / 2]);
        }
        expect_at_least(same, least);
    }
    recording_reader_close(reader);
}

TEST(maps_are_recorded_and_played_as_they_were_told)
{
    static Heard told, played;
    const char *own = scratch("own.h5"), *path = scratch("heard.h5");
    Process program;
    SCOPED_CLIENT Client *client = client_create();
    listen_to_maps(client, &told);
    server_start_for(
        client, &pliantd, "--record %s %s", own,
        write_cube(LOCKSTEP_HEAD("error_hz = 20.0; error_map = true; elements_hz = 10.0;")));
    record_start(&program, path, "");
    wait_until(client, has_sidecar(path));
    // A press, and a cut: another mesh, whose slots are all in use.
    for (int i = 0; i < 12; i++) {
        send_pose_at(client, i < 9 ? PRESS : AWAY);
        if (i == 6) {
            const pliant_cut_t cut = make_cut(client, 0.0, 0.08, "");
            assert_int_equal(pliant_cut_t_publish(client->lcm, "PLIANT_CUT", &cut), 0);
        }
        const int elements = told.count[RECORDING_ELEMENTS], maps = told.count[RECORDING_ERROR_MAP];
        command(client, PLIANT_COMMAND_T_STEP, 10, "");
        wait_until(client, told.count[RECORDING_ERROR_MAP] > maps &&
                               (i > 1 || told.count[RECORDING_ELEMENTS] > elements));
    }
    expect_at_least(told.count[RECORDING_ERROR_MAP], 6);
    expect_at_least(told.count[RECORDING_ELEMENTS], 3);
    server_stop(client, &pliantd);
    end(&program, SIGTERM, 0);
    expect_maps(own, &told, 3);
    expect_maps(path, &told, 3);
    // ParaView has those of the last frame, and of what it shows of others.
    int frames;
    FREED SidecarFrame *sidecar = view_sidecar_of(own, &frames);
    const SidecarFrame *last = &sidecar[frames - 1];
    assert_string_equal(last->error.set, "/bodies/cube/error_map/share");
    assert_string_equal(last->level.set, "/bodies/cube/elements/level");
    assert_int_equal(last->error.rows, last->node_id.rows);
    assert_int_equal(last->level.rows, last->triangles.rows);
    expect_at_least((int)last->level.first, 3);
    const RecordingInfo *info = info_of(path);
    assert_int_equal(info->body[0].counts.refused, 0);
    expect_at_least((int)info->body[0].topologies, 2);
    // Played, they come again, and once more where one seeks back.
    SCOPED_CLIENT Client *viewer = client_create();
    listen_to_maps(viewer, &played);
    process_start(&program, program_path("pliant-play"), "--paused %s", own);
    client_wait_for_daemon(viewer);
    for (int i = 0; i < 200 && command(viewer, PLIANT_COMMAND_T_STEP, 1, "")->ok; i++) {
    }
    expect_at_least(played.count[RECORDING_ELEMENTS], 3);
    expect_maps(own, &played, 3);
    // Also at the start, before the first: a viewer would keep those of the end.
    int count[RECORDING_MAPS];
    memcpy(count, played.count, sizeof count);
    assert_true(command(viewer, PLIANT_COMMAND_T_SET, 0.0, "seek=0")->ok);
    for (int kind = 0; kind < RECORDING_MAPS; kind++) {
        wait_until(viewer, played.count[kind] > count[kind]);
        assert_true(played.step[kind][count[kind]] == told.step[kind][0]);
    }
    server_stop(viewer, &program);
}
