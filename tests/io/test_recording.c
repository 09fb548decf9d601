// SPDX-License-Identifier: MIT
// Recordings: the layout as HDF5's own functions see it, values that come back bit for bit, a
// sidecar that points at the right rows, and what is left when the writer is killed or the disk is
// full.
#include "test.h"
#include "io/recording.h"
#include "scratch_folder.h"

#ifdef PLIANT_WITH_HDF5
#include "random.h"
#include "recording_view.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>

// --- what is recorded ----------------------------------------------------------------------------

// A tetrahedron and, from `later` on, the same with a fifth node; and a strip of 300 nodes.
enum { TETRA, STRIP, BODIES, STRIP_NODES = 300, MOST_NODES = 512 };
static const int tetra[6][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 4}, {2, 3, 4}, {3, 1, 4}};
static const int tetra_id[5] = {0, 1, 2, 3, 70};
static int strip[STRIP_NODES - 2][3], strip_id[STRIP_NODES];
static const int tool_id[2] = {7, 2};

static const char SCENE[] = "name = \"two\"; # the text of a scene, \"quoted\"\n";

static RecordingTopology topology_of(int body, int number)
{
    if (body == TETRA)
        return (RecordingTopology){.number = number,
                                   .node_count = number == 0 ? 4 : 5,
                                   .triangle_count = number == 0 ? 3 : 6,
                                   .node_id = tetra_id,
                                   .triangle = tetra};
    return (RecordingTopology){.number = number,
                               .node_count = STRIP_NODES,
                               .triangle_count = STRIP_NODES - 2,
                               .node_id = strip_id,
                               .triangle = (const int(*)[3])strip};
}

// The same numbers whenever they are asked for: any frame can be checked on its own.
static void make_positions(int body, int64_t step, int nodes, float *position)
{
    uint64_t random = (uint64_t)(step * BODIES + body) * 77 + 12345;
    for (int i = 0; i < 3 * nodes; i++)
        position[i] = (float)random_between(&random, -1.0, 1.0);
}

static double still; // [m] of the next recording

static Recording *create(const char *name, Status *status)
{
    for (int i = 0; i < STRIP_NODES; i++) {
        strip_id[i] = 1000 + i;
        for (int k = 0; k < 3 && i < STRIP_NODES - 2; k++)
            strip[i][k] = i + k;
    }
    const RecordingBody body[BODIES] = {
        {.name = "tetra", .nodes = 4, .triangles = 3},
        {.name = "strip", .nodes = STRIP_NODES, .triangles = STRIP_NODES - 2}};
    const RecordingOptions options = {.scene = SCENE,
                                      .created_by = "test 1",
                                      .body_count = BODIES,
                                      .tool_count = 2,
                                      .body = body,
                                      .tool = tool_id,
                                      .still = still};
    return recording_create(scratch_at(name), &options, status);
}

static Recording *start(const char *name)
{
    Status status = {0};
    Recording *recording = create(name, &status);
    if (recording == NULL)
        fail_msg("%s", status.text);
    for (int b = 0; b < BODIES; b++) {
        RecordingTopology topology = topology_of(b, 0);
        assert_true(recording_add_topology(recording, b, &topology));
    }
    return recording;
}

static bool add_frame_of(Recording *recording, int body, int64_t step, int number)
{
    float position[3 * MOST_NODES];
    const RecordingTopology topology = topology_of(body, number);
    make_positions(body, step, topology.node_count, position);
    const RecordingFrame frame = {.step = step,
                                  .time = 1e-3 * (double)step,
                                  .topology = number,
                                  .node_count = topology.node_count,
                                  .position = position};
    return recording_add_frame(recording, body, &frame);
}

// Frames of both bodies at the steps first, first + 16, ...
static void add_frames(Recording *recording, int first, int count)
{
    for (int i = first; i < first + count; i++)
        for (int b = 0; b < BODIES; b++)
            assert_true(add_frame_of(recording, b, 16 * i, 0));
}

static void finish(Recording *recording)
{
    Status status = {0};
    expect_ok(recording_close(recording, &status), status);
}

static hid_t open_view(const char *name, bool while_written)
{
    hid_t file = view_open(scratch_at(name), while_written);
    if (file < 0)
        fail_msg("%s cannot be opened", name);
    return file;
}

// The frames in the file are the first ones that were recorded, bit for bit.
static void expect_values(const BodyView *view, int body)
{
    float position[3 * MOST_NODES];
    for (int i = 0; i < view->frames; i++) {
        assert_int_equal(view->step[i], 16 * i);
        assert_true(view->time[i] == 1e-3 * (16.0 * i));
        make_positions(body, view->step[i], view->count[i], position);
        assert_memory_equal(view->position[view->first[i]], position,
                            3 * sizeof(float) * (size_t)view->count[i]);
    }
}

// Reads all of a recording and its sidecar and compares them; returns the frames of the shorter
// body.
static int check_recording(const char *name, bool while_written, int *in_sidecar)
{
    static const char *const names[BODIES] = {"tetra", "strip"};
    char path[SCRATCH_PATH], xdmf[64];
    SCOPED(view_close) hid_t file = open_view(name, while_written);
    snprintf(xdmf, sizeof xdmf, "%s.xdmf", name);
    FREED SidecarFrame *frame = view_sidecar(scratch_path(&scratch_space, xdmf, path), in_sidecar);
    int frames = INT32_MAX;
    for (int b = 0; b < BODIES; b++) {
        SCOPED(view_free) BodyView view;
        view_body(&view, file, names[b]);
        expect_values(&view, b);
        expect_sidecar_matches(frame, *in_sidecar, &view, names[b]);
        frames = view.frames < frames ? view.frames : frames;
    }
    for (int i = 0; i < *in_sidecar; i++)
        assert_string_equal(frame[i].position.file, name);
    return frames;
}

// --- layout --------------------------------------------------------------------------------------

static void read_text(hid_t object, const char *name, char text[256])
{
    hid_t attribute = H5Aopen(object, name, H5P_DEFAULT);
    assert_true(attribute >= 0);
    hid_t type = H5Aget_type(attribute);
    assert_int_equal(H5Tget_class(type), H5T_STRING);
    assert_false(H5Tis_variable_str(type) > 0);
    assert_true(H5Tget_size(type) < 256);
    memset(text, 0, 256);
    assert_true(H5Aread(attribute, type, text) >= 0);
    H5Tclose(type);
    H5Aclose(attribute);
}

static void expect_text(hid_t object, const char *name, const char *expected)
{
    char text[256];
    read_text(object, name, text);
    assert_string_equal(text, expected);
}

static herr_t visit(hid_t root, const char *name, const H5O_info_t *info, void *user)
{
    char unit[256];
    if (info->type != H5O_TYPE_DATASET)
        return 0;
    hid_t set = H5Dopen2(root, name, H5P_DEFAULT);
    read_text(set, "unit", unit);
    assert_true(unit[0] != '\0');
    H5Dclose(set);
    ++*(int *)user;
    return 0;
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(the_layout_is_as_documented)
{
    Recording *recording = start("a.h5");
    add_frames(recording, 0, 5);
    finish(recording);
    SCOPED(view_close) hid_t file = open_view("a.h5", false);
    expect_text(file, "format", "pliant-recording");
    expect_text(file, "created_by", "test 1");
    expect_text(file, "scene", SCENE);
    expect_number(file, "version", 1);

    // Sixteen data sets a body, four a tool, the events, the ledger and the errors; each with a
    // unit.
    int sets = 0;
    assert_true(H5Ovisit(file, H5_INDEX_NAME, H5_ITER_NATIVE, visit, &sets) >= 0);
    assert_int_equal(sets, 2 * 16 + 2 * 4 + 3);

    // Single precision, and one frame a chunk.
    hid_t set = H5Dopen2(file, "/bodies/strip/position", H5P_DEFAULT);
    hid_t type = H5Dget_type(set), layout = H5Dget_create_plist(set);
    hsize_t chunk[2];
    assert_true(H5Tequal(type, H5T_IEEE_F32LE) > 0);
    expect_text(set, "unit", "m");
    assert_int_equal(H5Pget_chunk(layout, 2, chunk), 2);
    assert_true(chunk[0] == STRIP_NODES && chunk[1] == 3);
    H5Pclose(layout);
    H5Tclose(type);
    H5Dclose(set);
}

TEST(frames_come_back_bit_for_bit)
{
    int in_sidecar;
    Recording *recording = start("b.h5");
    add_frames(recording, 0, 40);
    assert_true(recording_flush(recording));
    add_frames(recording, 40, 37);
    finish(recording);
    assert_int_equal(check_recording("b.h5", false, &in_sidecar), 77);
    assert_int_equal(in_sidecar, 2 * 77);
}

TEST(a_new_topology_has_rows_of_its_own)
{
    Recording *recording = start("c.h5");
    const RecordingTopology grown = topology_of(TETRA, 1);
    assert_true(add_frame_of(recording, TETRA, 0, 0));
    assert_true(add_frame_of(recording, TETRA, 16, 0));
    assert_true(recording_add_topology(recording, TETRA, &grown));
    assert_true(add_frame_of(recording, TETRA, 32, 1));
    assert_true(add_frame_of(recording, TETRA, 48, 0));
    finish(recording);

    SCOPED(view_close) hid_t file = open_view("c.h5", false);
    SCOPED(view_free) BodyView view;
    view_body(&view, file, "tetra");
    expect_values(&view, TETRA);
    assert_int_equal(view.frames, 4);
    assert_int_equal(view.topologies, 2);
    assert_int_equal(view.count[2], 5);
    assert_memory_equal(view.triangle[view.first_triangle[1]], tetra, sizeof tetra);
    assert_memory_equal(view.node_id + view.first_node[1], tetra_id, sizeof tetra_id);
    int count;
    FREED SidecarFrame *frame = view_sidecar(scratch_at("c.h5.xdmf"), &count);
    assert_int_equal(count, 4);
    expect_sidecar_matches(frame, count, &view, "tetra");
}

// Adds a frame all of whose coordinates are `x`.
static void add_at(Recording *recording, int body, int frame, float x)
{
    float position[3 * MOST_NODES];
    const RecordingFrame at = {.step = 16 * frame,
                               .time = 1e-3 * (16.0 * frame),
                               .node_count = topology_of(body, 0).node_count,
                               .position = position};
    for (int i = 0; i < 3 * at.node_count; i++)
        position[i] = x;
    assert_true(recording_add_frame(recording, body, &at));
}

static void expect_at(const BodyView *view, const float *x, int frames, double within)
{
    assert_int_equal(view->frames, frames);
    for (int f = 0; f < frames; f++)
        for (int i = 0; i < 3 * view->count[f]; i++)
            expect_near((double)view->position[view->first[f] + i / 3][i % 3], (double)x[f],
                        within);
}

TEST(a_body_that_stands_still_is_stored_once_and_left_out_of_the_sidecar)
{
    // The strip moves when the tetrahedron stands, which comes back to where it was.
    static const float tetra_x[] = {0.0f, 0.0f, 0.0f, 1.0f, 1.0f, 0.0f, 0.0f, 0.0f};
    static const float strip_x[] = {0.0f, 0.0f, 0.0f, 0.0f, 2.0f, 2.0f, 2.0f, 2.0f};
    Recording *recording = start("still.h5");
    for (int f = 0; f < 8; f++) {
        add_at(recording, TETRA, f, tetra_x[f]);
        add_at(recording, STRIP, f, strip_x[f]);
    }
    finish(recording);
    SCOPED(view_close) hid_t file = open_view("still.h5", false);
    SCOPED(view_free) BodyView view, other;
    view_body(&view, file, "tetra");
    view_body(&other, file, "strip");
    expect_at(&view, tetra_x, 8, 0.0);
    expect_at(&other, strip_x, 8, 0.0);
    assert_int_equal(view.rows, 3 * 4);
    assert_int_equal(other.rows, 2 * STRIP_NODES);
    // Both list the first frame, the three at which one of them moved, and the end.
    int count;
    FREED SidecarFrame *frame = view_sidecar(scratch_at("still.h5.xdmf"), &count);
    assert_int_equal(count, 2 * 5);
    expect_sidecar_matches(frame, count, &view, "tetra");
    expect_sidecar_matches(frame, count, &other, "strip");
}

TEST(what_creeps_is_stored_again_before_it_is_off_by_more_than_still)
{
    enum { FRAMES = 40 };
    float x[FRAMES];
    still = 1e-6;
    Recording *recording = start("creep.h5");
    still = 0.0;
    for (int f = 0; f < FRAMES; f++) {
        x[f] = 4e-7f * (float)f;
        add_at(recording, TETRA, f, x[f]);
    }
    finish(recording);
    SCOPED(view_close) hid_t file = open_view("creep.h5", false);
    SCOPED(view_free) BodyView view;
    view_body(&view, file, "tetra");
    expect_at(&view, x, FRAMES, 1e-6);
    // Three frames lie within a micrometre: 0, 0.4 and 0.8.
    assert_int_equal(view.rows, 4 * ((FRAMES + 2) / 3));
}

TEST(tools_and_events_are_stored)
{
    Recording *recording = start("d.h5");
    const RecordingTool sample = {{1.0, 2.0, 3.0}, {0.5, 0.5, -0.5, 0.5}, {0.25, 0.0, -4.0}};
    const RecordingEvent event = {1.5, 1500, "tetra", "cut", "a text"};
    assert_true(recording_add_tool(recording, 1, 0.125, &sample));
    assert_true(recording_add_event(recording, &event));
    assert_true(recording_add_event(recording, &event));
    finish(recording);

    SCOPED(view_close) hid_t file = open_view("d.h5", false);
    int rows;
    double *row = view_rows(file, "/tools/2/position", H5T_NATIVE_DOUBLE, &rows);
    assert_int_equal(rows, 1);
    assert_memory_equal(row, &sample.position, sizeof sample.position);
    free(row);
    row = view_rows(file, "/tools/2/orientation", H5T_NATIVE_DOUBLE, &rows);
    assert_memory_equal(row, &sample.orientation, sizeof sample.orientation);
    free(row);
    row = view_rows(file, "/tools/2/force", H5T_NATIVE_DOUBLE, &rows);
    assert_memory_equal(row, &sample.force, sizeof sample.force);
    free(row);
    row = view_rows(file, "/tools/2/time", H5T_NATIVE_DOUBLE, &rows);
    assert_true(row[0] == 0.125);
    free(row);
    free(view_rows(file, "/tools/7/time", H5T_NATIVE_DOUBLE, &rows));
    assert_int_equal(rows, 0);

    hid_t set = H5Dopen2(file, "/events", H5P_DEFAULT), type = H5Dget_type(set);
    assert_int_equal(H5Tget_size(type), sizeof event);
    FREED RecordingEvent *stored = view_rows(file, "/events", type, &rows);
    assert_int_equal(rows, 2);
    assert_true(stored[1].time == 1.5 && stored[1].step == 1500);
    assert_string_equal(stored[1].body, "tetra");
    assert_string_equal(stored[1].kind, "cut");
    assert_string_equal(stored[1].text, "a text");
    H5Tclose(type);
    H5Dclose(set);
}

// --- the sidecar ---------------------------------------------------------------------------------

TEST(a_file_with_an_odd_name_is_found_by_its_sidecar)
{
    int in_sidecar;
    Recording *recording = start("a & \"b\" <c>.h5");
    add_frames(recording, 0, 2);
    finish(recording);
    assert_int_equal(check_recording("a & \"b\" <c>.h5", false, &in_sidecar), 2);
}

TEST(the_sidecar_lags_by_a_sixteenth_at_most)
{
    char path[SCRATCH_PATH];
    Recording *recording = start("lag.h5");
    int frames = 0, written = 0;
    SidecarFrame *frame = NULL;
    while (frames < 6000) {
        for (int i = 0; i < 100; i++)
            assert_true(add_frame_of(recording, TETRA, 16 * frames++, 0));
        assert_true(recording_flush(recording));
        free(frame);
        int before = written;
        frame = view_sidecar(scratch_path(&scratch_space, "lag.h5.xdmf", path), &written);
        expect_at_least(written, frames - frames / 16);
        assert_true(written == before || written == frames); // whole or left alone
    }
    free(frame);
    finish(recording);
    free(view_sidecar(path, &written));
    assert_int_equal(written, 6000);
}

// --- other readers, killed writers ---------------------------------------------------------------

// Runs `write` in a process of its own, which tells through the pipe how far it is and is killed by
// itself or by the caller. Returns its id.
static pid_t fork_writer(void (*write_frames)(int pipe), int *from)
{
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    fflush(NULL);
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid == 0) {
        close(ends[0]);
        write_frames(ends[1]);
        _exit(0);
    }
    close(ends[1]);
    *from = ends[0];
    return pid;
}

static void tell(int pipe, int number)
{
    if (write(pipe, &number, sizeof number) != sizeof number)
        _exit(1);
}

// The newest number that came; -1 at the end.
static int hear(int from)
{
    int number = -1;
    return read(from, &number, sizeof number) == sizeof number ? number : -1;
}

static void write_and_be_killed(int pipe)
{
    Recording *recording = start("killed.h5");
    add_frames(recording, 0, 30);
    recording_flush(recording);
    tell(pipe, 30);
    add_frames(recording, 30, 25);
    kill(getpid(), SIGKILL);
}

TEST(what_was_flushed_survives_a_kill)
{
    int from, in_sidecar;
    pid_t pid = fork_writer(write_and_be_killed, &from);
    assert_int_equal(hear(from), 30);
    int status;
    assert_int_equal(waitpid(pid, &status, 0), pid);
    assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);
    close(from);
    int frames = check_recording("killed.h5", true, &in_sidecar);
    assert_int_equal(frames, 30);
    assert_int_equal(in_sidecar, 2 * 30);
}

static void write_without_end(int pipe)
{
    Recording *recording = start("random.h5");
    for (int i = 0;; i++) {
        add_frames(recording, i, 1);
        if (i % 5 == 4) {
            recording_flush(recording);
            tell(pipe, i + 1);
        }
    }
}

TEST(a_kill_at_any_moment_leaves_a_readable_file)
{
    uint64_t random = 4711;
    for (int round = 0; round < 12; round++) {
        unlink(scratch_at("random.h5"));
        int from, in_sidecar, flushed = 0, number = 0;
        pid_t pid = fork_writer(write_without_end, &from);
        const struct timespec moment = {.tv_nsec = 20000000 + random_below(&random, 60000000)};
        nanosleep(&moment, NULL);
        kill(pid, SIGKILL);
        while ((number = hear(from)) >= 0)
            flushed = number;
        close(from);
        assert_int_equal(waitpid(pid, NULL, 0), pid);
        if (flushed == 0)
            continue; // not even started on this machine
        int frames = check_recording("random.h5", true, &in_sidecar);
        // A kill may come between a flush and its report.
        expect_at_least(frames, flushed);
        expect_at_most(frames, flushed + 5);
        expect_at_least(in_sidecar, 2 * (flushed - 5));
    }
}

static void write_step_by_step(int pipe)
{
    Recording *recording = start("live.h5");
    for (int i = 0; i < 4; i++) {
        add_frames(recording, 10 * i, 10);
        recording_flush(recording);
        tell(pipe, 10 * (i + 1));
        const struct timespec pause = {.tv_nsec = 30000000};
        nanosleep(&pause, NULL);
    }
    for (;;)
        pause();
}

TEST(a_reader_follows_the_file_while_it_grows)
{
    int from, in_sidecar, frames = 0;
    pid_t pid = fork_writer(write_step_by_step, &from);
    for (int i = 0; i < 4; i++) {
        int written = hear(from);
        frames = check_recording("live.h5", true, &in_sidecar);
        expect_at_least(frames, written);
    }
    kill(pid, SIGKILL);
    assert_int_equal(waitpid(pid, NULL, 0), pid);
    close(from);
    assert_int_equal(frames, 40);
}

// --- files that cannot be ------------------------------------------------------------------------

static void expect_refusal(const char *name, const char *why)
{
    Status status = {0};
    assert_null(create(name, &status));
    assert_int_equal(status.code, STATUS_INVALID);
    if (strstr(status.text, name) == NULL || strstr(status.text, why) == NULL)
        fail_msg("'%s' and '%s' expected in: %s", name, why, status.text);
    assert_null(strchr(status.text, '\n'));
}

TEST(a_file_that_exists_is_kept)
{
    scratch_write(&scratch_space, "kept.h5", "precious", 8);
    expect_refusal("kept.h5", "exists already");
    struct stat facts;
    assert_int_equal(stat(scratch_at("kept.h5"), &facts), 0);
    assert_int_equal(facts.st_size, 8);
    // An empty one (mktemp makes such) holds nothing to lose.
    int in_sidecar;
    scratch_write(&scratch_space, "empty.h5", "", 0);
    Recording *recording = start("empty.h5");
    add_frames(recording, 0, 1);
    finish(recording);
    assert_int_equal(check_recording("empty.h5", false, &in_sidecar), 1);
}

TEST(what_cannot_be_written_is_refused_at_the_start)
{
    expect_refusal("no/folder.h5", strerror(ENOENT));
    scratch_write(&scratch_space, "file", "x", 1);
    expect_refusal("file/folder.h5", strerror(ENOTDIR));
    expect_refusal(".", strerror(EISDIR));
    assert_int_equal(mkfifo(scratch_at("pipe.h5"), 0600), 0);
    expect_refusal("pipe.h5", strerror(ENXIO));
    // A sidecar that cannot be written: nothing is left behind.
    assert_int_equal(mkdir(scratch_at("side.h5.xdmf"), 0700), 0);
    expect_refusal("side.h5", "side.h5.xdmf");
    assert_int_equal(access(scratch_at("side.h5"), F_OK), -1);
    assert_int_equal(access(scratch_at("side.h5.xdmf.tmp"), F_OK), -1);
}

TEST(a_full_disk_leaves_a_whole_file)
{
    Recording *recording = start("full.h5");
    const rlim_t limit = 2000000; // 500 frames of 3.6 kB
    const rlim_t before = limit_files(limit);
    int frames = 0;
    while (frames < 1000 && add_frame_of(recording, TETRA, 16 * frames, 0) &&
           add_frame_of(recording, STRIP, 16 * frames, 0))
        frames++;
    expect_at_least(frames, 100);
    expect_at_most(frames, 555);
    assert_int_equal(recording_status(recording)->code, STATUS_FAILED);
    expect_in(recording_status(recording)->text, strerror(EFBIG));
    expect_in(recording_status(recording)->text, "full.h5");
    assert_false(add_frame_of(recording, TETRA, 16 * frames + 16, 0)); // it is over
    Status status = {0};
    assert_false(recording_close(recording, &status));
    limit_files(before);
    assert_int_equal(status.code, STATUS_FAILED);
    int in_sidecar;
    assert_int_equal(check_recording("full.h5", false, &in_sidecar), frames);
    hid_t file = open_view("full.h5", false);
    SCOPED(view_free) BodyView view;
    view_body(&view, file, "strip");
    assert_int_equal(view.rows, frames * STRIP_NODES); // no part of a frame
    H5Fclose(file);
    expect_at_least(in_sidecar, 2 * frames);
}

// Here the space that was taken in advance is refused after all: HDF5 itself meets the limit.
static void write_beyond_what_hdf5_survives(int pipe)
{
    signal(SIGXFSZ, SIG_IGN);
    Recording *recording = start("broken.h5");
    add_frames(recording, 0, 20);
    if (!recording_flush(recording))
        _exit(2);
    limit_files(130000);
    int frames = 20;
    while (frames < 1000 && add_frame_of(recording, TETRA, 16 * frames, 0) &&
           add_frame_of(recording, STRIP, 16 * frames, 0))
        frames++;
    Status status = {0};
    if (recording_close(recording, &status) || strstr(status.text, "broken.h5") == NULL)
        _exit(3);
    tell(pipe, frames);
    exit(0); // HDF5's own end must not touch the file, nor crash
}

TEST(a_failure_inside_hdf5_leaves_what_was_flushed)
{
    int from, in_sidecar, status;
    pid_t pid = fork_writer(write_beyond_what_hdf5_survives, &from);
    assert_int_equal(waitpid(pid, &status, 0), pid);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
    int frames = hear(from);
    expect_at_least(frames, 20);
    expect_at_most(frames, 50);
    close(from);
    assert_int_equal(check_recording("broken.h5", true, &in_sidecar), 20);
    assert_int_equal(in_sidecar, 40);
}

TEST(space_taken_in_advance_is_given_back)
{
    Recording *recording = start("space.h5");
    add_frames(recording, 0, 3);
    finish(recording);
    struct stat facts;
    assert_int_equal(stat(scratch_at("space.h5"), &facts), 0);
    // Whole blocks of the file system: at most 64 kB beyond the end.
    expect_at_most((double)facts.st_blocks * 512.0, (double)facts.st_size + 65536.0);
}

#else

TEST(what_is_not_built_in_is_refused)
{
    Status status = {0};
    assert_null(recording_create("a.h5", &(RecordingOptions){0}, &status));
    assert_string_equal(status.text, "a.h5: built without HDF5 (PLIANT_HDF5)");
}

#endif
