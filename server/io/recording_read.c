// SPDX-License-Identifier: MIT
// Reading recordings at any time. The child opens the file, checks its index and then reads rows on
// request; this side keeps the index and checks what the child answers like a file.
#include "io/recording_read.h"

#include "io/recording_parts.h"

#include <stdlib.h>
#include <string.h>

#ifdef PLIANT_WITH_HDF5
#include "base/check.h"
#include "io/hdf.h"

#include <math.h>

enum { TEXT_MOST = 1 << 24, TOPOLOGIES_MOST = 1 << 24, NAME_TEXT = 128 };

struct RecordingReader {
    HdfChild *child;
    char *path, *scene, *describe;
    RecordingInfo info;
    RecordingIndex body[RECORDING_INFO_BODIES];
    double *tool_time[RECORDING_INFO_TOOLS];
    int64_t tool_rows[RECORDING_INFO_TOOLS];
};

// --- the child -----------------------------------------------------------------------------------

// The data sets that a reader asks for.
typedef enum RowSet {
    ROWS_POSITION,
    ROWS_TRIANGLES,
    ROWS_NODE_ID,
#define NODE_SET(name, type, width, of, empty, sent, recorded)                                     \
    MESH_IF_LATER(recorded, ROWS_NODE_##name, )
    MESH_COLUMNS(NODE_SET) ROWS_LOOK_TOPOLOGY,
    ROWS_LOOK_ID,
    ROWS_LOOK_COLOUR,
    ROWS_ERROR_SHARE,
    ROWS_ELEMENTS_TAG,
    ROWS_ELEMENTS_LEVEL,
    ROWS_TOOL_TIME,
    ROWS_TOOL_POSITION,
    ROWS_TOOL_ORIENTATION,
    ROWS_TOOL_FORCE,
    ROWS_EVENTS,
    ROWS_LEDGER,
    ROWS_ERRORS,
    ROW_SETS,
} RowSet;

typedef struct RowForm {
    const char *group, *name;
    int columns;
    size_t bytes; // of a row in memory
} RowForm;

static const RowForm row_form[ROW_SETS] = {
    [ROWS_POSITION] = {"/bodies", "/position", 3, 3 * sizeof(float)},
    [ROWS_TRIANGLES] = {"/bodies", "/triangles", 3, 3 * sizeof(int)},
    [ROWS_NODE_ID] = {"/bodies", "/node_id", 0, sizeof(int)},
#define NODE_ROW_FORM(name, type, width, of, empty, sent, recorded)                                \
    MESH_IF_LATER(recorded,                                                                        \
                  [ROWS_NODE_##name] = {"/bodies", "/node_" #name, (width) > 1 ? (width) : 0,      \
                                        (width) * sizeof(type)}, )
    MESH_COLUMNS(NODE_ROW_FORM)[ROWS_LOOK_TOPOLOGY] = {"/bodies", "/look/topology", 0, sizeof(int)},
    [ROWS_LOOK_ID] = {"/bodies", "/look/id", 0, sizeof(int)},
    [ROWS_LOOK_COLOUR] = {"/bodies", "/look/colour", RECORDING_COLOURS, RECORDING_COLOURS},
    [ROWS_ERROR_SHARE] = {"/bodies", "/error_map/share", 0, 1},
    [ROWS_ELEMENTS_LEVEL] = {"/bodies", "/elements/level", 0, 1},
    [ROWS_ELEMENTS_TAG] = {"/bodies", "/elements/tag", 0, sizeof(int16_t)},
    [ROWS_TOOL_TIME] = {"/tools", "/time", 0, sizeof(double)},
    [ROWS_TOOL_POSITION] = {"/tools", "/position", 3, 3 * sizeof(double)},
    [ROWS_TOOL_ORIENTATION] = {"/tools", "/orientation", 4, 4 * sizeof(double)},
    [ROWS_TOOL_FORCE] = {"/tools", "/force", 3, 3 * sizeof(double)},
    [ROWS_EVENTS] = {"/events", "", 0, sizeof(RecordingEvent)},
    [ROWS_LEDGER] = {"/ledger", "", 0, sizeof(RecordingLedger)},
    [ROWS_ERRORS] = {"/errors", "", 0, sizeof(RecordingLedger)},
};

typedef struct Request {
    RowSet set;
    char name[RECORDING_BODY_TEXT]; // of the body or the tool
    int64_t first;
    int rows;
} Request;

static bool read_request(const HdfFile *file, const Request *request, hid_t event, hid_t ledger,
                         void *to)
{
#define NODE_TYPE(name, type, width, of, empty, sent, recorded)                                    \
    MESH_IF_LATER(recorded,                                                                        \
                  [ROWS_NODE_##name] = sizeof(type) > 1 ? H5T_NATIVE_INT : H5T_NATIVE_INT8, )
    const hid_t type[ROW_SETS] = {[ROWS_POSITION] = H5T_NATIVE_FLOAT,
                                  [ROWS_TRIANGLES] = H5T_NATIVE_INT,
                                  [ROWS_NODE_ID] = H5T_NATIVE_INT,
                                  MESH_COLUMNS(NODE_TYPE)[ROWS_LOOK_TOPOLOGY] = H5T_NATIVE_INT,
                                  [ROWS_LOOK_ID] = H5T_NATIVE_INT,
                                  [ROWS_LOOK_COLOUR] = H5T_NATIVE_UINT8,
                                  [ROWS_ERROR_SHARE] = H5T_NATIVE_UINT8,
                                  [ROWS_ELEMENTS_LEVEL] = H5T_NATIVE_UINT8,
                                  [ROWS_ELEMENTS_TAG] = H5T_NATIVE_INT16,
                                  [ROWS_TOOL_TIME] = H5T_NATIVE_DOUBLE,
                                  [ROWS_TOOL_POSITION] = H5T_NATIVE_DOUBLE,
                                  [ROWS_TOOL_ORIENTATION] = H5T_NATIVE_DOUBLE,
                                  [ROWS_TOOL_FORCE] = H5T_NATIVE_DOUBLE,
                                  [ROWS_EVENTS] = event,
                                  [ROWS_LEDGER] = ledger,
                                  [ROWS_ERRORS] = ledger};
    const RowForm *form = &row_form[request->set];
    char name[NAME_TEXT];
    snprintf(name, sizeof name, "%s%s%s%s", form->group, *request->name ? "/" : "", request->name,
             form->name);
    return recording_read_rows(file, name, type[request->set], form->columns, request->first,
                               request->rows, to);
}

static void answer_requests(const HdfFile *file, int fd)
{
    const hid_t event = recording_event_type(), ledger = recording_ledger_type();
    Request request;
    // What is asked for was checked against the index.
    while (hdf_child_receive(fd, &request, sizeof request)) {
        hdf_child_renew();
        Status said = {0};
        const HdfFile here = {.id = file->id, .path = file->path, .status = &said};
        size_t bytes = (size_t)request.rows * row_form[request.set].bytes;
        void *to = calloc(bytes + 1, 1);
        ASSERT(to != NULL);
        bool ok = read_request(&here, &request, event, ledger, to);
        if (hdf_child_send(fd, &said, sizeof said) && ok)
            hdf_child_send(fd, to, bytes);
        free(to);
    }
    H5Tclose(event);
    H5Tclose(ledger);
}

// Returns a text of the file, "" if there is none.
static char *read_text(const HdfFile *file, const char *name)
{
    char *text = NULL;
    hid_t attribute = H5Aopen_by_name(file->id, "/", name, H5P_DEFAULT, H5P_DEFAULT);
    if (attribute < 0)
        return calloc(1, 1);
    hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute);
    const bool is_text =
        H5Tget_class(type) == H5T_STRING && H5Sget_simple_extent_npoints(space) == 1;
    const size_t size = H5Tget_size(type);
    // A long text is stored with variable length (hdf_write_text).
    if (is_text && H5Tis_variable_str(type) > 0) {
        char *stored = NULL;
        if (H5Aread(attribute, type, (void *)&stored) >= 0 && stored != NULL)
            text = strndup(stored, TEXT_MOST);
        H5free_memory(stored);
    } else if (is_text && size <= TEXT_MOST) {
        text = calloc(size + 1, 1);
        if (text != NULL && H5Aread(attribute, type, text) < 0)
            *text = '\0';
    }
    H5Sclose(space);
    H5Tclose(type);
    H5Aclose(attribute);
    return text != NULL ? text : calloc(1, 1);
}

// What the child finds before it reads data.
typedef struct Findings {
    Status status;
    RecordingInfo info;
    size_t scene_bytes, describe_bytes;
} Findings;

static bool send_index(int fd, const RecordingIndex *index)
{
    RecordingIndex plain = {.topology_count = index->topology_count,
                            .frame_count = index->frame_count,
                            .nodes_told = index->nodes_told,
                            .look_rows = index->look_rows,
                            .first_wall = index->first_wall};
    memcpy(plain.map_count, index->map_count, sizeof plain.map_count);
    bool ok = hdf_child_send(fd, &plain, sizeof plain) &&
              hdf_child_send(fd, index->topology,
                             (size_t)index->topology_count * sizeof *index->topology) &&
              hdf_child_send(fd, index->frame, (size_t)index->frame_count * sizeof *index->frame);
    for (int kind = 0; kind < RECORDING_MAPS && ok; kind++)
        ok = hdf_child_send(fd, index->map[kind],
                            (size_t)index->map_count[kind] * sizeof *index->map[kind]);
    return ok;
}

static void serve(int fd, void *path)
{
    RecordingIndex *index = calloc(RECORDING_INFO_BODIES, sizeof *index);
    Findings *found = calloc(1, sizeof *found);
    ASSERT(index != NULL && found != NULL);
    HdfFile file;
    for (int i = 0; i < RECORDING_INFO_BODIES; i++)
        index[i].frames_wanted = true;
    // First what there is, or what is wrong,
    bool ok = recording_open_any(&file, path, &found->status) &&
              recording_read_contents(&file, &found->info, index);
    char *scene = ok ? read_text(&file, "scene") : NULL;
    char *describe = ok ? read_text(&file, "describe") : NULL;
    found->scene_bytes = scene != NULL ? strlen(scene) : 0;
    found->describe_bytes = describe != NULL ? strlen(describe) : 0;
    ok = hdf_child_send(fd, found, sizeof *found) && ok &&
         hdf_child_send(fd, scene, found->scene_bytes) &&
         hdf_child_send(fd, describe, found->describe_bytes);
    for (int i = 0; i < found->info.body_count && ok; i++) {
        ok = send_index(fd, &index[i]);
        recording_index_free(&index[i]);
    }
    free(scene);
    free(describe);
    free(found);
    // then the data.
    if (ok)
        answer_requests(&file, fd);
}

// --- the index -----------------------------------------------------------------------------------

static bool damaged(const RecordingReader *reader, Status *status, const char *what)
{
    return status_fail(status, STATUS_INVALID, "%s: is damaged: %s", reader->path, what);
}

// Checks the index of a body, which came from a process that HDF5 may have corrupted.
static bool check_index(const RecordingReader *reader, int body, Status *status)
{
    const RecordingIndex *index = &reader->body[body];
    for (int i = 0; i < index->topology_count; i++) {
        const TopologyRows *t = &index->topology[i];
        if (t->node_count < 0 || t->node_count > RECORDING_NODES_MOST || t->triangle_count < 0 ||
            t->triangle_count > RECORDING_TRIANGLES_MOST || t->first_node < 0 ||
            t->first_triangle < 0)
            return damaged(reader, status, "a mesh is larger than any of ours");
    }
    double before = -HUGE_VAL;
    for (int64_t f = 0; f < index->frame_count; f++) {
        const FrameRow *frame = &index->frame[f];
        if (frame->topology < 0 || frame->topology >= index->topology_count || frame->first < 0 ||
            frame->count != index->topology[frame->topology].node_count || !isfinite(frame->time) ||
            frame->time <= before)
            return damaged(reader, status, "a frame is not what its index says");
        before = frame->time;
    }
    for (int kind = 0; kind < RECORDING_MAPS; kind++) {
        before = -HUGE_VAL;
        for (int64_t i = 0; i < index->map_count[kind]; i++) {
            const RecordingMap *map = &index->map[kind][i];
            if (map->first < 0 || map->count < 0 || map->count > RECORDING_TRIANGLES_MOST ||
                !isfinite(map->time) || map->time < before)
                return damaged(reader, status, "a map is not what its index says");
            before = map->time;
        }
    }
    return true;
}

// Receives the heads of a body's maps.
static bool receive_maps(RecordingReader *reader, RecordingIndex *index, const int64_t *count,
                         Status *status)
{
    for (int kind = 0; kind < RECORDING_MAPS; kind++) {
        if (count[kind] < 0 || count[kind] > RECORDING_MAPS_MOST)
            return damaged(reader, status, "its index has no sense");
        index->map[kind] = calloc((size_t)count[kind] + 1, sizeof *index->map[kind]);
        ASSERT(index->map[kind] != NULL);
        if (!hdf_child_receive(reader->child->fd, index->map[kind],
                               (size_t)count[kind] * sizeof *index->map[kind]))
            return hdf_child_failed(reader->child, reader->path, status);
        index->map_count[kind] = count[kind];
    }
    return true;
}

static bool receive_index(RecordingReader *reader, int body, Status *status)
{
    RecordingIndex *index = &reader->body[body], plain;
    const int fd = reader->child->fd;
    if (!hdf_child_receive(fd, &plain, sizeof plain))
        return hdf_child_failed(reader->child, reader->path, status);
    if (plain.topology_count < 0 || plain.topology_count > TOPOLOGIES_MOST ||
        plain.frame_count < 0 || plain.frame_count > RECORDING_FRAMES_MOST)
        return damaged(reader, status, "its index has no sense");
    index->topology_count = plain.topology_count;
    index->frame_count = plain.frame_count;
    index->nodes_told = plain.nodes_told;
    index->look_rows =
        plain.look_rows >= 0 && plain.look_rows <= RECORDING_LOOKS_MOST ? plain.look_rows : 0;
    index->first_wall =
        plain.first_wall > 0 && plain.first_wall <= RECORDING_TRIANGLES_MOST ? plain.first_wall : 0;
    index->topology = calloc((size_t)plain.topology_count + 1, sizeof *index->topology);
    index->frame = calloc((size_t)plain.frame_count + 1, sizeof *index->frame);
    ASSERT(index->topology != NULL && index->frame != NULL);
    if (!hdf_child_receive(fd, index->topology,
                           (size_t)plain.topology_count * sizeof *index->topology) ||
        !hdf_child_receive(fd, index->frame, (size_t)plain.frame_count * sizeof *index->frame))
        return hdf_child_failed(reader->child, reader->path, status);
    return receive_maps(reader, index, plain.map_count, status) &&
           check_index(reader, body, status);
}

// --- rows ----------------------------------------------------------------------------------------

static bool ask(RecordingReader *reader, RowSet set, const char *name, int64_t first, int rows,
                void *to, Status *status)
{
    Request request = {.set = set, .first = first, .rows = rows};
    Status said;
    const int fd = reader->child->fd;
    snprintf(request.name, sizeof request.name, "%s", name);
    // The child is gone once it has failed.
    if (fd < 0)
        return damaged(reader, status, "HDF5 failed on it");
    if (!hdf_child_send(fd, &request, sizeof request) || !hdf_child_receive(fd, &said, sizeof said))
        return hdf_child_failed(reader->child, reader->path, status);
    said.text[sizeof said.text - 1] = '\0';
    if (said.code != STATUS_OK)
        return status_fail(status, STATUS_INVALID, "%s", said.text);
    return hdf_child_receive(fd, to, (size_t)rows * row_form[set].bytes) ||
           hdf_child_failed(reader->child, reader->path, status);
}

// Reads the times of a tool; rows from the first one on that is not finite, or earlier than the one
// before, do not count.
static bool read_tool_times(RecordingReader *reader, int tool, Status *status)
{
    int64_t rows = reader->info.tool[tool].rows, good = 0;
    rows = rows < 0 ? 0 : rows < RECORDING_FRAMES_MOST ? rows : RECORDING_FRAMES_MOST;
    double *time = calloc((size_t)rows + 1, sizeof *time);
    ASSERT(time != NULL);
    reader->tool_time[tool] = time;
    for (int64_t first = 0; first < rows; first += RECORDING_ROWS_MOST) {
        int count = (int)(rows - first < RECORDING_ROWS_MOST ? rows - first : RECORDING_ROWS_MOST);
        if (!ask(reader, ROWS_TOOL_TIME, reader->info.tool[tool].name, first, count, time + first,
                 status))
            return false;
    }
    while (good < rows && isfinite(time[good]) && (good == 0 || time[good] >= time[good - 1]))
        good++;
    reader->tool_rows[tool] = good;
    return true;
}

static bool receive_text(RecordingReader *reader, size_t bytes, char **text, Status *status)
{
    if (bytes > TEXT_MOST)
        return damaged(reader, status, "its scene is longer than any of ours");
    *text = calloc(bytes + 1, 1);
    ASSERT(*text != NULL);
    return hdf_child_receive(reader->child->fd, *text, bytes) ||
           hdf_child_failed(reader->child, reader->path, status);
}

static bool receive_contents(RecordingReader *reader, Status *status)
{
    Findings *found = calloc(1, sizeof *found);
    ASSERT(found != NULL);
    bool ok = hdf_child_receive(reader->child->fd, found, sizeof *found) ||
              hdf_child_failed(reader->child, reader->path, status);
    // What it says is checked like a file.
    found->status.text[sizeof found->status.text - 1] = '\0';
    if (ok && found->status.code != STATUS_OK)
        ok = status_fail(status, found->status.code, "%s", found->status.text);
    reader->info = found->info;
    recording_info_tidy(&reader->info);
    ok = ok && receive_text(reader, found->scene_bytes, &reader->scene, status) &&
         receive_text(reader, found->describe_bytes, &reader->describe, status);
    if (ok && reader->describe[0] == '\0' && strncmp(reader->scene, "scene ", 6) == 0) {
        // pliant-record knows the description only.
        char *none = reader->describe;
        reader->describe = reader->scene;
        reader->scene = none;
    }
    free(found);
    for (int i = 0; i < reader->info.body_count && ok; i++)
        ok = receive_index(reader, i, status);
    for (int i = 0; i < reader->info.tool_count && ok; i++)
        ok = read_tool_times(reader, i, status);
    return ok;
}

// --- opening -------------------------------------------------------------------------------------

RecordingReader *recording_reader_open(const char *path, Status *status)
{
    HdfChild *child = hdf_child_start(path, serve, (void *)(uintptr_t)path, status);
    if (child == NULL)
        return NULL;
    RecordingReader *reader = calloc(1, sizeof *reader);
    ASSERT(reader != NULL);
    reader->child = child;
    reader->path = strdup(path);
    ASSERT(reader->path != NULL);
    if (receive_contents(reader, status))
        return reader;
    recording_reader_close(reader);
    return NULL;
}

void recording_reader_close(RecordingReader *reader)
{
    if (reader == NULL)
        return;
    hdf_child_end(reader->child);
    for (int i = 0; i < RECORDING_INFO_BODIES; i++)
        recording_index_free(&reader->body[i]);
    for (int i = 0; i < RECORDING_INFO_TOOLS; i++)
        free(reader->tool_time[i]);
    free(reader->scene);
    free(reader->describe);
    free(reader->path);
    free(reader);
}

const RecordingInfo *recording_reader_info(const RecordingReader *reader)
{
    return &reader->info;
}

const char *recording_reader_scene(const RecordingReader *reader)
{
    return reader->scene;
}

const char *recording_reader_describe(const RecordingReader *reader)
{
    return reader->describe;
}

int recording_reader_find_body(const RecordingReader *reader, const char *name)
{
    for (int i = 0; i < reader->info.body_count; i++)
        if (strcmp(reader->info.body[i].name, name) == 0)
            return i;
    return -1;
}

int recording_reader_find_tool(const RecordingReader *reader, int id)
{
    char name[sizeof reader->info.tool->name];
    snprintf(name, sizeof name, "%d", id);
    for (int i = 0; i < reader->info.tool_count; i++)
        if (strcmp(reader->info.tool[i].name, name) == 0)
            return i;
    return -1;
}

// --- frames --------------------------------------------------------------------------------------

static const RecordingIndex *index_of(const RecordingReader *reader, int body)
{
    ASSERT(body >= 0 && body < reader->info.body_count);
    return &reader->body[body];
}

static const FrameRow *frame_of(const RecordingReader *reader, int body, int64_t frame)
{
    const RecordingIndex *index = index_of(reader, body);
    ASSERT(frame >= 0 && frame < index->frame_count);
    return &index->frame[frame];
}

int64_t recording_reader_frames(const RecordingReader *reader, int body)
{
    return index_of(reader, body)->frame_count;
}

// Returns the last of `count` times, `stride` bytes apart, at or before a time; -1: none.
static int64_t find_last(const double *first, size_t stride, int64_t count, double time)
{
    int64_t below = -1, above = count; // at or before `time`, and after it
    while (above - below > 1) {
        const int64_t middle = below + (above - below) / 2;
        double at;
        memcpy(&at, (const char *)first + stride * (size_t)middle, sizeof at);
        if (at <= time)
            below = middle;
        else
            above = middle;
    }
    return below;
}

int64_t recording_reader_find_frame(const RecordingReader *reader, int body, double time)
{
    const RecordingIndex *index = index_of(reader, body);
    return find_last(&index->frame->time, sizeof *index->frame, index->frame_count, time);
}

RecordingFrame recording_reader_frame(const RecordingReader *reader, int body, int64_t frame)
{
    const FrameRow *row = frame_of(reader, body, frame);
    return (RecordingFrame){.step = row->step,
                            .time = row->time,
                            .topology = reader->body[body].topology[row->topology].number,
                            .node_count = row->count};
}

bool recording_reader_positions(RecordingReader *reader, int body, int64_t frame, float *position,
                                Status *status)
{
    const FrameRow *row = frame_of(reader, body, frame);
    if (row->count > 0 && !ask(reader, ROWS_POSITION, reader->info.body[body].name, row->first,
                               row->count, position, status))
        return false;
    for (int64_t i = 0; i < 3 * (int64_t)row->count; i++)
        if (!isfinite(position[i]))
            return status_fail(status, STATUS_INVALID,
                               "%s: body %s, step %lld: a position is not finite", reader->path,
                               reader->info.body[body].name, (long long)row->step);
    return true;
}

// --- meshes --------------------------------------------------------------------------------------

void recording_reader_most(const RecordingReader *reader, int body, int *nodes, int *triangles)
{
    const RecordingIndex *index = index_of(reader, body);
    *nodes = *triangles = 0;
    for (int i = 0; i < index->topology_count; i++) {
        const TopologyRows *t = &index->topology[i];
        *nodes = t->node_count > *nodes ? t->node_count : *nodes;
        *triangles = t->triangle_count > *triangles ? t->triangle_count : *triangles;
    }
}

int recording_reader_first_wall(const RecordingReader *reader, int body)
{
    return (int)index_of(reader, body)->first_wall;
}

bool recording_reader_mesh(RecordingReader *reader, int body, int64_t frame, int *node_id,
                           int (*triangle)[3], RecordingTopology *topology, Status *status)
{
    const TopologyRows *rows =
        &reader->body[body].topology[frame_of(reader, body, frame)->topology];
    const char *name = reader->info.body[body].name;
    if ((rows->node_count > 0 &&
         !ask(reader, ROWS_NODE_ID, name, rows->first_node, rows->node_count, node_id, status)) ||
        (rows->triangle_count > 0 && !ask(reader, ROWS_TRIANGLES, name, rows->first_triangle,
                                          rows->triangle_count, triangle, status)))
        return false;
    // Corners index the nodes of the frame.
    for (int t = 0; t < rows->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            if (triangle[t][k] < 0 || triangle[t][k] >= rows->node_count)
                return status_fail(status, STATUS_INVALID,
                                   "%s: body %s, topology %d: triangle %d has node %d of %d",
                                   reader->path, name, rows->number, t, triangle[t][k],
                                   rows->node_count);
    *topology = (RecordingTopology){.number = rows->number,
                                    .node_count = rows->node_count,
                                    .triangle_count = rows->triangle_count,
                                    .node_id = node_id,
                                    .triangle = (const int(*)[3])triangle};
    return true;
}

bool recording_reader_nodes(RecordingReader *reader, int body, int64_t frame, const MeshColumns *to,
                            bool *known, Status *status)
{
    const RecordingIndex *index = &reader->body[body];
    const TopologyRows *rows = &index->topology[frame_of(reader, body, frame)->topology];
    const char *body_name = reader->info.body[body].name;
    *known = rows->node_count > 0 && rows->first_node <= index->nodes_told &&
             rows->node_count <= index->nodes_told - rows->first_node;
    bool ok = true;
#define ASK_NODES(name, type, width, of, empty, sent, recorded)                                    \
    MESH_IF_LATER(recorded, ok = ok && ask(reader, ROWS_NODE_##name, body_name, rows->first_node,  \
                                           rows->node_count, to->name, status);)
    if (*known) {
        MESH_COLUMNS(ASK_NODES)
    }
    return ok;
}

int64_t recording_reader_maps(const RecordingReader *reader, int body, RecordingMapKind kind)
{
    return index_of(reader, body)->map_count[kind];
}

int64_t recording_reader_find_map(const RecordingReader *reader, int body, RecordingMapKind kind,
                                  double time)
{
    const RecordingIndex *index = index_of(reader, body);
    return find_last(&index->map[kind]->time, sizeof *index->map[kind], index->map_count[kind],
                     time);
}

RecordingMap recording_reader_map(const RecordingReader *reader, int body, RecordingMapKind kind,
                                  int64_t map)
{
    ASSERT(map >= 0 && map < recording_reader_maps(reader, body, kind));
    return reader->body[body].map[kind][map];
}

bool recording_reader_map_rows(RecordingReader *reader, int body, RecordingMapKind kind,
                               int64_t number, void *const column[], Status *status)
{
    static const RowSet first_set[RECORDING_MAPS] = {ROWS_ERROR_SHARE, ROWS_ELEMENTS_TAG};
    const RecordingMap map = recording_reader_map(reader, body, kind, number);
    for (int k = 0; k < recording_map_form[kind].columns && map.count > 0; k++)
        if (!ask(reader, first_set[kind] + (RowSet)k, reader->info.body[body].name, map.first,
                 map.count, column[k], status))
            return false;
    return true;
}

int64_t recording_reader_look_rows(const RecordingReader *reader, int body)
{
    return index_of(reader, body)->look_rows;
}

bool recording_reader_look(RecordingReader *reader, int body, int64_t first, int rows,
                           int *topology, int *id, unsigned char (*colour)[RECORDING_COLOURS],
                           Status *status)
{
    ASSERT(rows > 0 && rows <= RECORDING_ROWS_MOST && first >= 0 &&
           first + rows <= recording_reader_look_rows(reader, body));
    const char *name = reader->info.body[body].name;
    return ask(reader, ROWS_LOOK_TOPOLOGY, name, first, rows, topology, status) &&
           ask(reader, ROWS_LOOK_ID, name, first, rows, id, status) &&
           ask(reader, ROWS_LOOK_COLOUR, name, first, rows, colour, status);
}

// --- tools and events ----------------------------------------------------------------------------

int64_t recording_reader_tool_rows(const RecordingReader *reader, int tool)
{
    ASSERT(tool >= 0 && tool < reader->info.tool_count);
    return reader->tool_rows[tool];
}

double recording_reader_tool_time(const RecordingReader *reader, int tool, int64_t row)
{
    ASSERT(row >= 0 && row < recording_reader_tool_rows(reader, tool));
    return reader->tool_time[tool][row];
}

int64_t recording_reader_find_tool_row(const RecordingReader *reader, int tool, double time)
{
    return find_last(reader->tool_time[tool], sizeof *reader->tool_time[tool],
                     recording_reader_tool_rows(reader, tool), time);
}

bool recording_reader_tool(RecordingReader *reader, int tool, int64_t first, int rows,
                           RecordingTool *sample, Status *status)
{
    ASSERT(rows > 0 && rows <= RECORDING_ROWS_MOST && first >= 0 &&
           first + rows <= recording_reader_tool_rows(reader, tool));
    double(*value)[4] = calloc((size_t)rows, sizeof *value);
    ASSERT(value != NULL);
    const char *name = reader->info.tool[tool].name;
    bool ok = ask(reader, ROWS_TOOL_POSITION, name, first, rows, value, status);
    const double(*three)[3] = (const double(*)[3])value;
    for (int i = 0; i < rows && ok; i++)
        sample[i].position = (Vec3){three[i][0], three[i][1], three[i][2]};
    ok = ok && ask(reader, ROWS_TOOL_FORCE, name, first, rows, value, status);
    for (int i = 0; i < rows && ok; i++)
        sample[i].force = (Vec3){three[i][0], three[i][1], three[i][2]};
    ok = ok && ask(reader, ROWS_TOOL_ORIENTATION, name, first, rows, value, status);
    for (int i = 0; i < rows && ok; i++)
        sample[i].orientation = (Quat){value[i][0], value[i][1], value[i][2], value[i][3]};
    free(value);
    return ok;
}

bool recording_reader_events(RecordingReader *reader, int64_t first, int rows,
                             RecordingEvent *event, Status *status)
{
    ASSERT(rows > 0 && rows <= RECORDING_ROWS_MOST && first >= 0 &&
           first + rows <= reader->info.events);
    if (!ask(reader, ROWS_EVENTS, "", first, rows, event, status))
        return false;
    for (int i = 0; i < rows; i++) {
        event[i].body[sizeof event[i].body - 1] = '\0';
        event[i].kind[sizeof event[i].kind - 1] = '\0';
        event[i].text[sizeof event[i].text - 1] = '\0';
        event[i].time = isfinite(event[i].time) ? event[i].time : 0.0;
    }
    return true;
}

bool recording_reader_lines(RecordingReader *reader, RecordingList list, int64_t first, int rows,
                            RecordingLedger *line, Status *status)
{
    static const RowSet set[RECORDING_LISTS] = {ROWS_LEDGER, ROWS_ERRORS};
    ASSERT(rows > 0 && rows <= RECORDING_ROWS_MOST && first >= 0 &&
           first + rows <= reader->info.lines[list]);
    if (!ask(reader, set[list], "", first, rows, line, status))
        return false;
    for (int i = 0; i < rows; i++) {
        line[i].body[sizeof line[i].body - 1] = '\0';
        line[i].name[sizeof line[i].name - 1] = '\0';
        line[i].by[sizeof line[i].by - 1] = '\0';
        line[i].time = isfinite(line[i].time) ? line[i].time : 0.0;
        for (int k = 0; k < RECORDING_LEDGER_VALUES; k++)
            line[i].value[k] = isfinite(line[i].value[k]) ? line[i].value[k] : 0.0;
    }
    return true;
}

#endif
