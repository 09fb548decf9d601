// SPDX-License-Identifier: MIT
// --record: what is in the file is what was simulated and published, live, in lockstep and off
// line; what is left after kill -9 and on a full disk; and that nothing of it exists without it.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "recording_view.h"

#include "pliant_load_t.h"

#include <dirent.h>
#include <errno.h>

static const char HEAD[] = "publish = { nodes_hz = 60.0; contact_hz = 100.0; status_hz = 20.0; };";
static const char PAUSED[] =
    "start = \"paused\"; publish = { nodes_hz = 60.0; contact_hz = 100.0; status_hz = 20.0; };";
static const char LOADS[] = "loads = ( { body = \"sphere\"; center = [0.0, 0.0, 0.05];\n"
                            "  radius = 0.03; force = [0.1, 0.0, -0.2]; start = 0.05;\n"
                            "  duration = 0.6; } );";
static const double TOP[3] = {0.0, 0.0, 0.05}, DOWN[3] = {0.0, 0.02, -0.2};

// Reads the body of a recording; plain, or of a daemon that runs or was killed.
static void read_recording(const char *path, bool while_written, BodyView *view)
{
    SCOPED(view_close) hid_t file = view_open(path, while_written);
    if (file < 0)
        fail_msg("%s cannot be opened", path);
    view_body(view, file, "sphere");
}

// The frames that the sidecar lists; all of them are in `view`.
static int sidecar_frames(const char *path, const BodyView *view)
{
    int count;
    FREED SidecarFrame *frame = view_sidecar_of(path, &count);
    if (view != NULL)
        expect_sidecar_matches(frame, count, view, "sphere");
    return count;
}

// Listens until the recording of a running daemon has that many frames in its sidecar, which is
// written after each flush.
static void wait_for_frames(Client *client, const char *path, int frames)
{
    wait_until(client, sidecar_frames(path, NULL) >= frames);
}

static long long recorded_frames(const Process *daemon, long long *dropped)
{
    const char *line = strstr(daemon->out, "recorded frames: ");
    long long frames = -1;
    if (line == NULL || sscanf(line, "recorded frames: %lld, dropped %lld", &frames, dropped) != 2)
        fail_msg("no recorded frames in: %s%s", daemon->out, daemon->err);
    return frames;
}

TEST(every_published_frame_of_a_lockstep_run_is_recorded)
{
    enum { STEPS = 50 };
    const char *path = scratch("lockstep.h5");
    static float seen[STEPS][3 * SPHERE_NODES];
    int64_t step[STEPS];
    SCOPED_CLIENT Client *client = server_start(&pliantd, "--record %s %s", path,
                                                write_scene("lockstep.cfg", PAUSED, PROBE_TOOL));
    send_load(client, TOP, 0.03, DOWN, 1.0, "");
    for (int i = 0; i < STEPS; i++) {
        const Reply *reply = step_daemon(client, 1 + i % 4);
        wait_until(client, client->frames.step == reply->step);
        step[i] = client->frames.step;
        memcpy(seen[i], client->frames.position, sizeof seen[i]);
    }
    server_stop(client, &pliantd);
    long long dropped;
    assert_int_equal(recorded_frames(&pliantd, &dropped), STEPS + 1); // and the start
    assert_int_equal(dropped, 0);

    SCOPED(view_free) BodyView view;
    read_recording(path, false, &view);
    assert_int_equal(view.frames, STEPS + 1);
    assert_int_equal(view.step[0], 0);
    for (int i = 0; i < STEPS; i++) {
        assert_int_equal(view.step[i + 1], step[i]);
        expect_near(view.time[i + 1], 1e-3 * (double)step[i], 1e-12); // one rounding
        assert_memory_equal(view.position[view.first[i + 1]], seen[i], sizeof seen[i]);
    }
    // Moved by the load: the comparison above was not one of a body at rest.
    assert_true(memcmp(seen[0], seen[STEPS - 1], sizeof seen[0]) != 0);
    assert_int_equal(sidecar_frames(path, &view), STEPS + 1);
}

TEST(a_live_recording_is_read_while_it_runs_and_after_kill_9)
{
    const char *path = scratch("live.h5");
    SCOPED_CLIENT Client *client =
        server_start(&pliantd, "--record %s %s", path, write_scene("live.cfg", HEAD, LOADS));
    for (int round = 0; round < 2; round++) {
        wait_for_frames(client, path, 40 * (round + 1));
        int listed = sidecar_frames(path, NULL);
        SCOPED(view_free) BodyView view;
        read_recording(path, true, &view);
        expect_at_least(view.frames, listed);
    }
    client_listen(client, rand() % 300);
    int flushed = sidecar_frames(path, NULL);
    process_finish(&pliantd, SIGKILL);
    assert_int_equal(pliantd.code, 1000 + SIGKILL);

    SCOPED(view_free) BodyView view;
    read_recording(path, true, &view);
    expect_at_least(view.frames, flushed);
    expect_at_least(sidecar_frames(path, &view), flushed);
    for (int i = 0; i < view.rows; i++)
        for (int k = 0; k < 3; k++)
            assert_true(isfinite(view.position[i][k]));
    for (int i = 0; i < view.frames; i++) // nothing of a frame is missing: the sphere is there
        expect_at_least(
            (double)hypotf(view.position[view.first[i]][0], view.position[view.first[i]][2]), 0.01);
    // Plain readers open it once its flag is cleared.
    char clear[1200];
    snprintf(clear, sizeof clear, "h5clear -s %s", path);
    if (system("command -v h5clear >/dev/null") == 0) {
        assert_int_equal(system(clear), 0);
        SCOPED(view_free) BodyView cleared;
        read_recording(path, false, &cleared);
        assert_int_equal(cleared.frames, view.frames);
    }
}

TEST(tools_and_events_are_recorded)
{
    const char *path = scratch("tools.h5");
    SCOPED_CLIENT Client *client = server_start(&pliantd, "--record %s %s", path,
                                                write_scene("tools.cfg", PAUSED, PROBE_TOOL));
    command(client, PLIANT_COMMAND_T_SET, 0, "gravity_z=-2");
    command(client, PLIANT_COMMAND_T_STEP, 1, ""); // no pose yet: no row
    double force[5][3], place[5][3];
    for (int i = 0; i < 5; i++) {
        send_pose_at(client, (const double[]){0.0, 0.0, 0.053 - 1e-3 * i});
        const Reply *reply = command(client, PLIANT_COMMAND_T_STEP, 2, "");
        wait_until(client, client->contact.step == reply->step);
        memcpy(force[i], client->contact.force, sizeof force[i]);
        memcpy(place[i], client->contact.position, sizeof place[i]);
    }
    server_stop(client, &pliantd);

    SCOPED(view_close) hid_t file = view_open(path, false);
    int rows;
    double(*stored)[3] = view_rows(file, "/tools/1/force", H5T_NATIVE_DOUBLE, &rows);
    assert_int_equal(rows, 5);
    assert_memory_equal(stored, force, sizeof force);
    assert_true(force[0][2] > 0.0); // it did push
    free(stored);
    stored = view_rows(file, "/tools/1/position", H5T_NATIVE_DOUBLE, &rows);
    assert_memory_equal(stored, place, sizeof place);
    free(stored);

    typedef struct EventRow {
        char kind[16], text[192];
    } EventRow;
    hid_t kind = H5Tcopy(H5T_C_S1), text = H5Tcopy(H5T_C_S1);
    H5Tset_size(kind, 16);
    H5Tset_size(text, 192);
    H5Tset_cset(kind, H5T_CSET_UTF8);
    H5Tset_cset(text, H5T_CSET_UTF8);
    hid_t type = H5Tcreate(H5T_COMPOUND, sizeof(EventRow));
    H5Tinsert(type, "kind", 0, kind);
    H5Tinsert(type, "text", 16, text);
    FREED EventRow *event = view_rows(file, "/events", type, &rows);
    assert_int_equal(rows, 2);
    assert_string_equal(event[0].kind, "set");
    assert_string_equal(event[0].text, "gravity_z = -2");
    assert_string_equal(event[1].kind, "lockstep");
    H5Tclose(type);
    H5Tclose(text);
    H5Tclose(kind);
}

// All rows of a column of tool 1; the last force is what the last contact said.
static double (*tool_rows(const char *path, const char *column, int *rows))[3]
{
    SCOPED(view_close) hid_t file = view_open(path, false);
    double(*row)[3] = view_rows(file, column, H5T_NATIVE_DOUBLE, rows);
    return row;
}

TEST(tools_may_be_recorded_at_a_rate_of_their_own)
{
    enum { TICKS = 100, ROWS = TICKS / 2 };
    const char *scene = write_scene("rate.cfg", PAUSED, PROBE_TOOL);
    const char *live = scratch("rate.h5");
    const char *again = scratch("rate-again.h5");
    const char *log = scratch("rate.log");
    const double position[3] = {0.0, 0.0, 0.05};
    SCOPED_CLIENT Client *client = server_start(
        &pliantd, "--record %s --record-tools-hz 500 --log-inputs %s %s", live, log, scene);
    send_pose_at(client, position);
    const Reply *reply = command(client, PLIANT_COMMAND_T_STEP, TICKS, "");
    wait_until(client, client->contact.step == reply->step);
    server_stop(client, &pliantd);

    int rows, rows_again;
    double(*force)[3] = tool_rows(live, "/tools/1/force", &rows);
    assert_int_equal(rows, ROWS);
    assert_memory_equal(force[ROWS - 1], client->contact.force, sizeof force[0]);
    assert_true(force[0][2] > 0.0);
    assert_true(force[1][2] != force[0][2]); // not one number over and over
    FREED double *time = (double *)tool_rows(live, "/tools/1/time", &rows);
    assert_int_equal(rows, ROWS);
    for (int i = 0; i < ROWS; i++) // to the rounding of a sum of ticks
        expect_near(time[i], 0.002 * (i + 1), 1e-12);

    // And offline the same, while the frames have theirs.
    run_daemon_well(&pliantd, "--input %s --record %s --record-tools-hz 500 %s", log, again, scene);
    double(*force_again)[3] = tool_rows(again, "/tools/1/force", &rows_again);
    assert_int_equal(rows_again, ROWS);
    assert_memory_equal(force_again, force, ROWS * sizeof *force);
    assert_in_range(printed(&pliantd, "recorded frames"), 1, ROWS / 2);
    free(force);
    free(force_again);
}

TEST(offline_records_every_due_frame_with_the_exact_state)
{
    const char *scene = write_scene("offline.cfg", HEAD, LOADS);
    const char *path = scratch("offline.h5"), *checkpoint = scratch("end.h5");
    run_daemon_well(&pliantd, "--offline 2 --record %s --checkpoint %s --checkpoint-every 0.25 %s",
                    path, checkpoint, scene);
    long long dropped;
    assert_int_equal(recorded_frames(&pliantd, &dropped), 121); // 60 a second and the start
    assert_int_equal(dropped, 0);
    char recorded[32], plain[32];
    printed_state(&pliantd, recorded);

    SCOPED(view_free) BodyView view;
    read_recording(path, false, &view);
    assert_int_equal(view.frames, 121);
    for (int i = 0; i < 121; i++) // the first tick at or after i / 60 s
        assert_int_equal(view.step[i], (1000 * i + 59) / 60);
    // All but those at the end, when the sphere is at rest: 118.
    assert_in_range(sidecar_frames(path, &view), 60, 121);

    // The last frame is the state of the last checkpoint, in single precision.
    hid_t file = view_open(checkpoint, false);
    int rows;
    double(*exact)[3] = view_rows(file, "/bodies/sphere/position", H5T_NATIVE_DOUBLE, &rows);
    assert_int_equal(rows, SPHERE_NODES);
    for (int i = 0; i < SPHERE_NODES; i++)
        for (int k = 0; k < 3; k++)
            assert_true(view.position[view.first[120] + i][k] == (float)exact[i][k]);
    free(exact);
    H5Fclose(file);

    // And recording changes nothing of what is simulated.
    run_daemon(&pliantd, "--offline 2 %s", scene);
    printed_state(&pliantd, plain);
    assert_string_equal(recorded, plain);
}

TEST(a_recording_and_checkpoints_share_the_files_thread)
{
    const char *path = scratch("shared.h5"), *checkpoint = scratch("shared-end.h5");
    const char *scene = write_scene("shared.cfg", HEAD, LOADS);
    run_daemon_well(&pliantd, "--duration 1 --record %s --checkpoint %s --checkpoint-every 0.05 %s",
                    path, checkpoint, scene);
    expect_at_least((double)printed(&pliantd, "checkpoints"), 2.0);
    long long dropped, frames = recorded_frames(&pliantd, &dropped),
                       step = printed(&pliantd, "step");
    SCOPED(view_free) BodyView view;
    read_recording(path, false, &view);
    assert_int_equal(view.frames, frames);
    // Due frames of the ticks that were run, and the start; each was recorded or counted.
    assert_int_equal(frames + dropped, 1 + step * 60 / 1000);
    run_daemon(&pliantd, "--offline 0 --resume %s %s", checkpoint, scene);
    assert_int_equal(printed(&pliantd, "step"), step);
}

TEST(a_full_disk_ends_the_recording_and_not_the_run)
{
    const char *path = scratch("full.h5");
    SCOPED_CLIENT Client *client = client_create();
    const rlim_t before = limit_files(600000);
    // It falls: what stands still takes no room.
    daemon_start(&pliantd, "--record %s %s", path,
                 write_scene("full.cfg",
                             "gravity = [0.0, 0.0, -1.0];"
                             "publish = { nodes_hz = 500.0; status_hz = 20.0; };",
                             ""));
    limit_files(before);
    client_wait_for_daemon(client);
    wait_until(client, saw_event(client, "recording"));
    int64_t step = client->status.step;
    wait_until(client, client->status.step > step + 200); // the loop goes on
    wait_until(client, refused(client, "frames_not_recorded") > 0);
    process_signal(&pliantd, SIGTERM);
    process_wait_for(&pliantd, 1);
    expect_in(pliantd.err, "full.h5");
    expect_in(pliantd.err, strerror(EFBIG));
    long long dropped, frames = recorded_frames(&pliantd, &dropped);
    expect_at_least((double)dropped, 1.0);
    SCOPED(view_free) BodyView view;
    read_recording(path, false, &view);
    assert_int_equal(view.frames, frames);
}

static void expect_refused(const char *arguments, const char *scene, const char *needle)
{
    Process daemon;
    run_daemon(&daemon, "%s %s", arguments, scene);
    if (daemon.code != 2 || strstr(daemon.err, needle) == NULL)
        fail_msg("exit %d, expected 2, with '%s' in: %s", daemon.code, needle, daemon.err);
    const char *end = strchr(strstr(daemon.err, needle), '\n');
    assert_true(end != NULL && end[1] == '\0'); // one line, the last
}

TEST(what_cannot_be_recorded_is_refused_at_the_start)
{
    const char *scene = write_scene("refused.cfg", HEAD, "");
    const char *still = write_scene("still.cfg", "publish = { nodes_hz = 0.0; };", "");
    const char *kept = scratch("kept.h5");
    write_text(kept, "precious");
    char line[1200];
    static const char *const modes[] = {"--offline 1", "--duration 1"};
    for (int i = 0; i < 2; i++) {
        snprintf(line, sizeof line, "%s --record %s", modes[i], kept);
        expect_refused(line, scene, "exists already");
        snprintf(line, sizeof line, "%s --record %s", modes[i], scratch("no/folder.h5"));
        expect_refused(line, scene, "folder.h5");
        snprintf(line, sizeof line, "%s --record /dev/full", modes[i]);
        expect_refused(line, scene, "regular file");
        snprintf(line, sizeof line, "%s --record %s", modes[i], scratch("still.h5"));
        expect_refused(line, still, "nodes_hz");
    }
    assert_int_equal(access(scratch("still.h5"), F_OK), -1);
    snprintf(line, sizeof line, "--record %s --checkpoint %s", scratch("x.h5"), scratch("x.h5"));
    expect_refused(line, scene, "a file of its own");
    expect_refused("--record", "", "--record");
}

// Whether a directory of /proc/PID has an entry that `holds` finds.
static bool in_proc(pid_t pid, const char *folder, bool (*holds)(const char *path))
{
    char path[600];
    snprintf(path, sizeof path, "/proc/%d/%s", (int)pid, folder);
    DIR *directory = opendir(path);
    assert_non_null(directory);
    bool found = false;
    for (struct dirent *entry; (entry = readdir(directory)) != NULL;) {
        snprintf(path, sizeof path, "/proc/%d/%s/%.255s", (int)pid, folder, entry->d_name);
        found |= holds(path);
    }
    closedir(directory);
    return found;
}

static bool is_files_thread(const char *path)
{
    char name[700], text[64] = "";
    snprintf(name, sizeof name, "%s/comm", path);
    FILE *file = fopen(name, "r");
    if (file == NULL)
        return false;
    bool read = fgets(text, sizeof text, file) != NULL;
    fclose(file);
    return read && strcmp(text, "pliant-files\n") == 0;
}

static bool is_recording(const char *path)
{
    char target[600];
    ssize_t length = readlink(path, target, sizeof target - 1);
    target[length > 0 ? length : 0] = '\0';
    return strstr(target, ".h5") != NULL;
}

TEST(nothing_of_it_exists_in_a_scene_that_does_not_record)
{
    const char *scene = write_scene("none.cfg", HEAD, "");
    run_daemon(&pliantd, "--explain %s", scene);
    expect_in(pliantd.out, "  off  recording ");
    assert_null(strstr(pliantd.out, "run/recorded"));
    run_daemon(&pliantd, "--explain --record %s %s", scratch("none.h5"), scene);
    expect_in(pliantd.out, "  on   recording ");
    expect_in(pliantd.out, "run/recorded");
    assert_int_equal(access(scratch("none.h5"), F_OK), -1); // explained, not begun

    for (int records = 0; records < 2; records++) {
        SCOPED_CLIENT Client *client = server_start(&pliantd, "%s%s %s", records ? "--record " : "",
                                                    records ? scratch("some.h5") : "", scene);
        assert_int_equal(in_proc(pliantd.pid, "task", is_files_thread), records);
        assert_int_equal(in_proc(pliantd.pid, "fd", is_recording), records);
        process_end(&pliantd);
        assert_int_equal(strstr(pliantd.out, "recorded frames") != NULL, records);
    }
}
