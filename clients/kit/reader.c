// SPDX-License-Identifier: MIT
// libpliant-recording: the server's reader of recordings, and frames as a client has them. What
// pliant/client.h says of each function of pliant_recording_... holds of the one of its name here.
#include "reader.h"

#include "io/recording_read.h"

#include "kit.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

// The last mesh of a body, for the frames that share it.
typedef struct Body {
    KitMesh *mesh;
    int64_t count;
} Body;

struct PliantRecording {
    RecordingReader *reader;
    PliantError error;
    Body body[RECORDING_INFO_BODIES];
    const PliantBody *newest; // handed out last; one use is ours
    RecordingEvent event;
    PliantEvent event_read;
};

static bool say(PliantRecording *recording, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static bool say(PliantRecording *recording, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(recording->error.text, sizeof recording->error.text, format, arguments);
    va_end(arguments);
    return false;
}

static bool fail(PliantRecording *recording, const Status *status)
{
    return say(recording, "%s", status->text);
}

static void *allocate(size_t count, size_t size)
{
    void *memory = calloc(count > 0 ? count : 1, size);
    if (!memory)
        abort(); // the sizes are bounded: the machine itself is out of memory
    return memory;
}

static PliantRecording *reader_open(const char *path, PliantError *error)
{
    Status status = {0};
    RecordingReader *reader = recording_reader_open(path, &status);
    if (!reader) {
        if (error)
            snprintf(error->text, sizeof error->text, "%s", status.text);
        return NULL;
    }
    return kit_copy(&(const PliantRecording){.reader = reader}, sizeof(PliantRecording));
}

static void reader_close(PliantRecording *recording)
{
    if (!recording)
        return;
    pliant_body_release(recording->newest);
    for (int i = 0; i < RECORDING_INFO_BODIES; i++)
        kit_mesh_release(recording->body[i].mesh);
    recording_reader_close(recording->reader);
    free(recording);
}

static const char *reader_error(const PliantRecording *recording)
{
    return recording->error.text;
}

static int find_body(const PliantRecording *recording, const char *name)
{
    return name ? recording_reader_find_body(recording->reader, name) : -1;
}

// --- bodies --------------------------------------------------------------------------------------

static int reader_body_count(const PliantRecording *recording)
{
    return recording_reader_info(recording->reader)->body_count;
}

static const char *reader_body_name(const PliantRecording *recording, int k)
{
    const RecordingInfo *info = recording_reader_info(recording->reader);
    return k >= 0 && k < info->body_count ? info->body[k].name : NULL;
}

static int64_t reader_frames(const PliantRecording *recording, const char *body)
{
    const int at = find_body(recording, body);
    return at >= 0 ? recording_reader_frames(recording->reader, at) : -1;
}

static int64_t reader_find(const PliantRecording *recording, const char *body, double time)
{
    const int at = find_body(recording, body);
    return at >= 0 ? recording_reader_find_frame(recording->reader, at, time) : -1;
}

// Reads the mesh of a frame, unless it is that of the frame before.
static bool read_mesh(PliantRecording *recording, int at, int64_t k, const RecordingFrame *frame)
{
    Body *body = &recording->body[at];
    if (body->mesh && body->mesh->topology == frame->topology &&
        body->mesh->node_count == frame->node_count)
        return true;
    int nodes, triangles;
    recording_reader_most(recording->reader, at, &nodes, &triangles);
    int *id = allocate((size_t)nodes, sizeof *id);
    int(*triangle)[3] = allocate((size_t)triangles, sizeof *triangle);
    Status status = {0};
    RecordingTopology topology;
    if (!recording_reader_mesh(recording->reader, at, k, id, triangle, &topology, &status)) {
        free(id);
        free(triangle);
        return fail(recording, &status);
    }
    kit_mesh_release(body->mesh);
    body->mesh = kit_mesh_create(&(const KitMesh){.topology = topology.number,
                                                  .node_count = topology.node_count,
                                                  .triangle_count = topology.triangle_count,
                                                  .triangle = (int32_t *)triangle,
                                                  .id = id});
    return true;
}

static const PliantBody *reader_frame(PliantRecording *recording, const char *body, int64_t k)
{
    const int at = find_body(recording, body);
    if (at < 0 || k < 0 || k >= recording_reader_frames(recording->reader, at)) {
        say(recording, "body '%.63s' has no frame %lld", body ? body : "", (long long)k);
        return NULL;
    }
    const RecordingFrame frame = recording_reader_frame(recording->reader, at, k);
    if (!read_mesh(recording, at, k, &frame))
        return NULL;
    Status status = {0};
    float *position = allocate(3 * (size_t)frame.node_count, sizeof *position);
    if (!recording_reader_positions(recording->reader, at, k, position, &status)) {
        free(position);
        fail(recording, &status);
        return NULL;
    }
    Body *of = &recording->body[at];
    pliant_body_release(recording->newest);
    recording->newest = kit_frame_create(
        &(const PliantBody){.name = recording_reader_info(recording->reader)->body[at].name,
                            .count = ++of->count,
                            .step = frame.step,
                            .time = frame.time,
                            .position = position,
                            .first_wall = recording_reader_first_wall(recording->reader, at)},
        of->mesh);
    return recording->newest;
}

// --- tools and events ----------------------------------------------------------------------------

static int64_t reader_tool_rows(const PliantRecording *recording, int32_t tool)
{
    const int at = recording_reader_find_tool(recording->reader, tool);
    return at >= 0 ? recording_reader_tool_rows(recording->reader, at) : -1;
}

static bool reader_tool(PliantRecording *recording, int32_t tool, int64_t first, int count,
                        PliantToolRow *row)
{
    const int at = recording_reader_find_tool(recording->reader, tool);
    const int64_t rows = at >= 0 ? recording_reader_tool_rows(recording->reader, at) : 0;
    if (first < 0 || count < 0 || count > RECORDING_ROWS_MOST || first > rows - count)
        return say(recording,
                   "tool %d has %lld rows, not %d from %lld on, and at most %d at a time", tool,
                   (long long)rows, count, (long long)first, (int)RECORDING_ROWS_MOST);
    if (count == 0)
        return true;
    RecordingTool *sample = allocate((size_t)count, sizeof *sample);
    Status status = {0};
    const bool ok = recording_reader_tool(recording->reader, at, first, count, sample, &status);
    for (int k = 0; ok && k < count; k++) {
        row[k].time = recording_reader_tool_time(recording->reader, at, first + k);
        memcpy(row[k].position, &sample[k].position, sizeof row[k].position);
        memcpy(row[k].orientation, &sample[k].orientation, sizeof row[k].orientation);
        memcpy(row[k].force, &sample[k].force, sizeof row[k].force);
    }
    free(sample);
    return ok || fail(recording, &status);
}

static int64_t reader_events(const PliantRecording *recording)
{
    return recording_reader_info(recording->reader)->events;
}

static const PliantEvent *reader_event(PliantRecording *recording, int64_t k)
{
    Status status = {0};
    if (k < 0 || k >= reader_events(recording)) {
        say(recording, "there is no event %lld", (long long)k);
        return NULL;
    }
    RecordingEvent *event = &recording->event;
    if (!recording_reader_events(recording->reader, k, 1, event, &status)) {
        fail(recording, &status);
        return NULL;
    }
    recording->event_read = (PliantEvent){
        .step = event->step, .body = event->body, .kind = event->kind, .text = event->text};
    return &recording->event_read;
}

const KitReader *pliant_recording_reader(void)
{
    static const KitReader READER = {
        .version = PLIANT_VERSION,
        .open = reader_open,
        .close = reader_close,
        .error = reader_error,
        .body_count = reader_body_count,
        .body_name = reader_body_name,
        .frames = reader_frames,
        .find = reader_find,
        .frame = reader_frame,
        .tool_rows = reader_tool_rows,
        .tool = reader_tool,
        .events = reader_events,
        .event = reader_event,
    };
    return &READER;
}
