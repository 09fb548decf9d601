// SPDX-License-Identifier: MIT
// The HDF5 file of a recording. Every data set exists from the start and only grows, so that the
// file can be read while it is written (SWMR), and after `kill -9` up to its last flush.
#include "io/recording.h"

#include "base/check.h"
#include "base/log.h"
#include "io/recording_parts.h"

#include <stddef.h>
#include <string.h>

#ifdef PLIANT_WITH_HDF5
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#define RECORDING_FORMAT "pliant-recording"
enum {
    RECORDING_VERSION = 1,
    CHUNK_KEPT = 1 << 14,   // [bytes]
    SPACE_MARGIN = 1 << 18, // [bytes], more than HDF5 ever adds per append
    FRAME_ROWS = 512,       // of the short columns, stored together
    TOPOLOGY_ROWS = 16,
    EVENT_ROWS = 16,
    LOOK_ROWS = 1024,
    NAME_TEXT = 160,
    XDMF_LAG = 16,       // the sidecar is rewritten when this share of its frames is missing, ...
    XDMF_AT_ONCE = 4096, // ... or at every flush while it has less frames (4 MB)
};

static const int64_t FLUSH_EVERY_NS = 1000000000;

// --- creation ------------------------------------------------------------------------------------

static bool create_file(Recording *recording)
{
    if (!hdf_load(recording->path, &recording->status))
        return false;
    hdf_begin();
    hid_t access_list = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_libver_bounds(access_list, H5F_LIBVER_V110, H5F_LIBVER_V110);
    // One small chunk of each data set stays in memory until it is full or the file is flushed;
    // larger ones are written at once. The file's size then shows how much disk space it needs.
    H5Pset_cache(access_list, 0, 1, CHUNK_KEPT, 1.0);
    // Open the claimed file itself, whatever its name refers to by now.
    char claimed[64];
    snprintf(claimed, sizeof claimed, "/proc/self/fd/%d", recording->space.fd);
    const char *path = access(claimed, W_OK) == 0 ? claimed : recording->path;
    if (!hdf_locks(access_list, recording->space.fd))
        log_line(LOG_WARNING,
                 "%s: its file system has no locks: recorded without, so let nothing "
                 "else write there",
                 recording->path);
    errno = 0;
    recording->file.id = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, access_list);
    H5Pclose(access_list);
    return recording->file.id >= 0 ||
           status_fail(&recording->status, STATUS_INVALID, "%s: HDF5 cannot create it: %s",
                       recording->path,
                       errno != 0 ? strerror(errno) : "does the file system know locks?");
}

// Names and shapes of the data sets of a body and of a tool.
typedef struct TableForm {
    const char *name;
    enum { REAL, SINGLE, LONG, INTEGER, SHORT, BYTE, COLOUR, MAP } type;
    int columns, chunk; // chunk 0: the body's nodes, -1: its triangles
    const char *unit;
} TableForm;

static const TableForm body_form[BODY_TABLES] = {
    [FRAME_TIME] = {"frames/time", REAL, 0, FRAME_ROWS, "s"},
    [FRAME_STEP] = {"frames/step", LONG, 0, FRAME_ROWS, "ticks"},
    [FRAME_TOPOLOGY] = {"frames/topology", INTEGER, 0, FRAME_ROWS, "1"},
    [FRAME_FIRST] = {"frames/first", LONG, 0, FRAME_ROWS, "row of position"},
    [FRAME_COUNT] = {"frames/count", INTEGER, 0, FRAME_ROWS, "rows of position"},
    [POSITION] = {"position", SINGLE, 3, 0, "m"},
    [TOPOLOGY_NUMBER] = {"topology/number", INTEGER, 0, TOPOLOGY_ROWS, "1"},
    [TOPOLOGY_FIRST] = {"topology/first", LONG, 0, TOPOLOGY_ROWS, "row of triangles"},
    [TOPOLOGY_COUNT] = {"topology/count", INTEGER, 0, TOPOLOGY_ROWS, "rows of triangles"},
    [TOPOLOGY_NODE_FIRST] = {"topology/node_first", LONG, 0, TOPOLOGY_ROWS, "row of node_id"},
    [TOPOLOGY_NODE_COUNT] = {"topology/node_count", INTEGER, 0, TOPOLOGY_ROWS, "rows of node_id"},
    [TRIANGLES] = {"triangles", INTEGER, 3, -1, "nodes of a frame"},
    [NODE_ID] = {"node_id", INTEGER, 0, 0, "1"},
#define UNIT_IDS     "node_id"
#define UNIT_NUMBERS "1"
#define NODE_FORM(name, type, width, of, empty, sent, recorded)                                    \
    MESH_IF_LATER(recorded,                                                                        \
                  [NODE_##name] = {"node_" #name, sizeof(type) > 1 ? INTEGER : BYTE,               \
                                   (width) > 1 ? (width) : 0, 0, UNIT_##recorded}, )
    MESH_COLUMNS(NODE_FORM)[LOOK_TOPOLOGY] = {"look/topology", INTEGER, 0, LOOK_ROWS, "1"},
    [LOOK_ID] = {"look/id", INTEGER, 0, LOOK_ROWS, "node_id, -1: others"},
    [LOOK_COLOUR] = {"look/colour", COLOUR, RECORDING_COLOURS, LOOK_ROWS, "sRGB, 1/255"},
    [ERROR_MAP] = {"error_map/map", MAP, 0, EVENT_ROWS, "time s, step ticks, rows of share"},
    [ERROR_SHARE] = {"error_map/share", COLOUR, 0, 0, "1/255 of the largest"},
    [ELEMENTS] = {"elements/map", MAP, 0, EVENT_ROWS, "time s, step ticks, rows of level and tag"},
    [ELEMENTS_TAG] = {"elements/tag", SHORT, 0, -1, "1"},
    [ELEMENTS_LEVEL] = {"elements/level", COLOUR, 0, -1, "elements are 2^level cells wide"}};

// Of each kind of map; its columns follow.
static const BodyTable map_head[RECORDING_MAPS] = {
    [RECORDING_ERROR_MAP] = ERROR_MAP, [RECORDING_ELEMENTS] = ELEMENTS};

static const TableForm tool_form[TOOL_TABLES] = {
    [TOOL_TIME] = {"time", REAL, 0, FRAME_ROWS, "s"},
    [TOOL_POSITION] = {"position", REAL, 3, FRAME_ROWS, "m"},
    [TOOL_ORIENTATION] = {"orientation", REAL, 4, FRAME_ROWS, "unit quaternion, w x y z"},
    [TOOL_FORCE] = {"force", REAL, 3, FRAME_ROWS, "N"},
};

static bool create_table(Recording *recording, const char *group, const TableForm *form, int chunk,
                         HdfTable *table)
{
    const hid_t type[] = {
        [REAL] = H5T_NATIVE_DOUBLE,   [SINGLE] = H5T_NATIVE_FLOAT, [LONG] = H5T_NATIVE_INT64,
        [INTEGER] = H5T_NATIVE_INT32, [SHORT] = H5T_NATIVE_INT16,  [BYTE] = H5T_NATIVE_INT8,
        [COLOUR] = H5T_NATIVE_UINT8,  [MAP] = recording->map_type};
    char name[NAME_TEXT];
    snprintf(name, sizeof name, "%s/%s", group, form->name);
    return hdf_table_create(&recording->file, name, type[form->type], form->columns, (hsize_t)chunk,
                            form->unit, table);
}

#define COUNT_FORM(name)                                                                           \
    {                                                                                              \
#name, offsetof(RecordingCounts, name)                                                     \
    }

const RecordingCountForm recording_count_form[RECORDING_COUNTS] = {
    COUNT_FORM(lost), COUNT_FORM(dropped), COUNT_FORM(without_mesh), COUNT_FORM(refused)};

// True if the body has this data set.
static bool has_table(const RecordingBody *body, int table)
{
    for (int kind = 0; kind < RECORDING_MAPS; kind++) {
        const int head = (int)map_head[kind];
        if (table >= head && table <= head + recording_map_form[kind].columns)
            return body->has_map[kind];
    }
    return body->coloured || table < LOOK_TOPOLOGY;
}

static bool create_body(Recording *recording, int index, const RecordingBody *described)
{
    RecordedBody *body = &recording->body[index];
    snprintf(body->name, sizeof body->name, "%s", described->name);
    char group[64];
    snprintf(group, sizeof group, "/bodies/%s", body->name);
    // Flat data are stored in pieces of a whole frame or mesh.
    for (int t = 0; t < BODY_TABLES; t++) {
        int chunk = body_form[t].chunk;
        if (!has_table(described, t))
            continue;
        chunk = chunk == 0 ? described->nodes : chunk < 0 ? described->triangles : chunk;
        if (!create_table(recording, group, &body_form[t], chunk, &body->table[t]))
            return false;
    }
    if (!hdf_write_long(&recording->file, group, "first_wall", described->first_wall))
        return false;
    // Counts are there from the start, to be set at the end.
    for (int i = 0; i < RECORDING_COUNTS; i++)
        if (!hdf_write_long(&recording->file, group, recording_count_form[i].name, 0))
            return false;
    return true;
}

static bool create_tool(Recording *recording, int index, int id)
{
    RecordedTool *tool = &recording->tool[index];
    char group[64];
    snprintf(group, sizeof group, "/tools/%d", id);
    for (int t = 0; t < TOOL_TABLES; t++)
        if (!create_table(recording, group, &tool_form[t], tool_form[t].chunk, &tool->table[t]))
            return false;
    return true;
}

static void insert_text(hid_t type, const char *name, size_t offset, size_t size)
{
    hid_t text = H5Tcopy(H5T_C_S1);
    H5Tset_size(text, size);
    H5Tset_cset(text, H5T_CSET_UTF8);
    H5Tinsert(type, name, offset, text);
    H5Tclose(text);
}

static void insert_numbers(hid_t type, const char *name, size_t offset, hid_t of, hsize_t count)
{
    hid_t numbers = H5Tarray_create2(of, 1, &count);
    H5Tinsert(type, name, offset, numbers);
    H5Tclose(numbers);
}

hid_t recording_event_type(void)
{
    hid_t type = H5Tcreate(H5T_COMPOUND, sizeof(RecordingEvent));
    // Texts of fixed length, so that rows have one size.
    H5Tinsert(type, "time", offsetof(RecordingEvent, time), H5T_NATIVE_DOUBLE);
    H5Tinsert(type, "step", offsetof(RecordingEvent, step), H5T_NATIVE_INT64);
    insert_text(type, "body", offsetof(RecordingEvent, body), RECORDING_BODY_TEXT);
    insert_text(type, "kind", offsetof(RecordingEvent, kind), RECORDING_KIND_TEXT);
    insert_text(type, "text", offsetof(RecordingEvent, text), RECORDING_EVENT_TEXT);
    return type;
}

hid_t recording_ledger_type(void)
{
    hid_t type = H5Tcreate(H5T_COMPOUND, sizeof(RecordingLedger));
    H5Tinsert(type, "time", offsetof(RecordingLedger, time), H5T_NATIVE_DOUBLE);
    H5Tinsert(type, "step", offsetof(RecordingLedger, step), H5T_NATIVE_INT64);
    H5Tinsert(type, "line", offsetof(RecordingLedger, line), H5T_NATIVE_INT32);
    H5Tinsert(type, "flag", offsetof(RecordingLedger, flag), H5T_NATIVE_INT32);
    insert_text(type, "body", offsetof(RecordingLedger, body), RECORDING_BODY_TEXT);
    insert_text(type, "name", offsetof(RecordingLedger, name), RECORDING_LEDGER_NAME);
    insert_text(type, "by", offsetof(RecordingLedger, by), RECORDING_KIND_TEXT);
    insert_numbers(type, "value", offsetof(RecordingLedger, value), H5T_NATIVE_DOUBLE,
                   RECORDING_LEDGER_VALUES);
    return type;
}

hid_t recording_map_type(void)
{
    hid_t type = H5Tcreate(H5T_COMPOUND, sizeof(RecordingMap));
    H5Tinsert(type, "time", offsetof(RecordingMap, time), H5T_NATIVE_DOUBLE);
    H5Tinsert(type, "step", offsetof(RecordingMap, step), H5T_NATIVE_INT64);
    H5Tinsert(type, "first", offsetof(RecordingMap, first), H5T_NATIVE_INT64);
    H5Tinsert(type, "topology", offsetof(RecordingMap, topology), H5T_NATIVE_INT32);
    H5Tinsert(type, "count", offsetof(RecordingMap, count), H5T_NATIVE_INT32);
    insert_numbers(type, "elements", offsetof(RecordingMap, elements), H5T_NATIVE_INT32,
                   RECORDING_MAP_LEVELS);
    return type;
}

const char *const recording_list_name[RECORDING_LISTS] = {
    [RECORDING_LEDGERS] = "/ledger", [RECORDING_ERRORS] = "/errors"};

static bool create_events(Recording *recording)
{
    bool ok = hdf_table_create(&recording->file, "/events", recording->event_type, 0, EVENT_ROWS,
                               "time s, step ticks", &recording->event);
    for (int list = 0; list < RECORDING_LISTS && ok; list++)
        ok = hdf_table_create(&recording->file, recording_list_name[list], recording->ledger_type,
                              0, EVENT_ROWS, "time s, step ticks, value in SI units",
                              &recording->list[list]);
    return ok;
}

static bool write_head(Recording *recording, const RecordingOptions *options)
{
    const HdfFile *file = &recording->file;
    return hdf_write_text(file, "/", "format", RECORDING_FORMAT) &&
           hdf_write_int(file, "/", "version", RECORDING_VERSION) &&
           hdf_write_long(file, "/", RECORDING_ENDED, 0) &&
           hdf_write_text(file, "/", "scene", options->scene) &&
           (options->describe == NULL ||
            hdf_write_text(file, "/", "describe", options->describe)) &&
           hdf_write_text(file, "/", "created_by", options->created_by);
}

// Reserves disk space for `bytes` more and for the metadata of HDF5.
static bool reserve(Recording *recording, size_t bytes)
{
    hsize_t size = 0;
    size_t margin = SPACE_MARGIN + (size_t)recording->table_count * CHUNK_KEPT;
    if (H5Fget_filesize(recording->file.id, &size) < 0 ||
        disk_space_reserve(&recording->space, (int64_t)(size + bytes + margin)))
        return true;
    return status_fail(&recording->status, STATUS_FAILED, "%s: cannot be written: %s",
                       recording->path, strerror(errno));
}

static bool create_all(Recording *recording, const RecordingOptions *options)
{
    const size_t text =
        strlen(options->scene) + (options->describe != NULL ? strlen(options->describe) : 0);
    // Everything exists before readers are let in.
    if (!create_file(recording) || !reserve(recording, text) || !write_head(recording, options))
        return false;
    recording->event_type = recording_event_type();
    recording->ledger_type = recording_ledger_type();
    recording->map_type = recording_map_type();
    for (int i = 0; i < options->body_count; i++)
        if (!create_body(recording, i, &options->body[i]))
            return false;
    for (int i = 0; i < options->tool_count; i++)
        if (!create_tool(recording, i, options->tool[i]))
            return false;
    if (!create_events(recording))
        return false;
    // From now on only rows are added.
    return H5Fstart_swmr_write(recording->file.id) >= 0 ||
           status_fail(&recording->status, STATUS_FAILED,
                       "%s: HDF5 cannot open it to readers while it is written", recording->path);
}

// --- appending -----------------------------------------------------------------------------------

// Call before each addition, which then succeeds as a whole. Returns false after any failure.
// `rows` of the long table that is added to; those of short ones fit the margin.
static bool begin(Recording *recording, const HdfTable *table, int rows)
{
    size_t columns = table->columns > 0 ? (size_t)table->columns : 1;
    return recording->status.code == STATUS_OK &&
           reserve(recording, (size_t)rows * H5Tget_size(table->type) * columns);
}

static bool append(Recording *recording, HdfTable *table, int rows, const void *data)
{
    recording->table_count += rows > 0 && table->count == 0;
    recording->broken = !hdf_table_append(&recording->file, table, (hsize_t)rows, data);
    return !recording->broken;
}

static void remember_topology(RecordedBody *body, const TopologyRows *rows)
{
    if (body->topology_count == body->topology_capacity) {
        body->topology_capacity = body->topology_capacity == 0 ? 4 : 2 * body->topology_capacity;
        body->topology =
            realloc(body->topology, (size_t)body->topology_capacity * sizeof *body->topology);
        ASSERT(body->topology != NULL);
    }
    body->topology[body->topology_count++] = *rows;
}

bool recording_add_topology(Recording *recording, int index, const RecordingTopology *topology)
{
    ASSERT(index >= 0 && index < recording->body_count);
    RecordedBody *body = &recording->body[index];
    HdfTable *table = body->table;
    // Rows of the flat arrays that this topology takes.
    const TopologyRows rows = {.number = topology->number,
                               .triangle_count = topology->triangle_count,
                               .node_count = topology->node_count,
                               .first_triangle = (int64_t)table[TRIANGLES].count,
                               .first_node = (int64_t)table[NODE_ID].count};
    bool known = true;
    size_t bytes = 0; // of a node
#define IS_KNOWN(name, type, width, of, empty, sent, recorded)                                     \
    MESH_IF_LATER(recorded, known = known && topology->node_##name != NULL;                        \
                  bytes += (width) * sizeof(type);)
    MESH_COLUMNS(IS_KNOWN)
    const int told = known ? rows.node_count : 0;
    // Its number comes last: a reader takes a topology for complete once that is there.
    const size_t triangle_bytes = 3 * sizeof(int);
    const int more = (int)((bytes + triangle_bytes - 1) / triangle_bytes) * told;
    bool ok = begin(recording, &table[TRIANGLES], rows.triangle_count + rows.node_count + more) &&
              append(recording, &table[TRIANGLES], rows.triangle_count, topology->triangle) &&
              append(recording, &table[NODE_ID], rows.node_count, topology->node_id) &&
#define APPEND_NODES(name, type, width, of, empty, sent, recorded)                                 \
    MESH_IF_LATER(recorded, append(recording, &table[NODE_##name], told, topology->node_##name) &&)
              MESH_COLUMNS(APPEND_NODES)
                  append(recording, &table[TOPOLOGY_FIRST], 1, &rows.first_triangle) &&
              append(recording, &table[TOPOLOGY_COUNT], 1, &rows.triangle_count) &&
              append(recording, &table[TOPOLOGY_NODE_FIRST], 1, &rows.first_node) &&
              append(recording, &table[TOPOLOGY_NODE_COUNT], 1, &rows.node_count) &&
              append(recording, &table[TOPOLOGY_NUMBER], 1, &rows.number);
    if (ok)
        remember_topology(body, &rows);
    return ok;
}

bool recording_add_look(Recording *recording, int index, const RecordingLook *look)
{
    ASSERT(index >= 0 && index < recording->body_count);
    HdfTable *table = recording->body[index].table;
    if (look->count == 0)
        return recording->status.code == STATUS_OK;
    ASSERT(table[LOOK_ID].set > 0);
    int *topology = malloc((size_t)look->count * sizeof *topology);
    ASSERT(topology != NULL);
    for (int i = 0; i < look->count; i++)
        topology[i] = look->topology;
    // The ids come last, and there are 14 bytes to a row.
    const bool ok = begin(recording, &table[LOOK_ID], 4 * look->count) &&
                    append(recording, &table[LOOK_TOPOLOGY], look->count, topology) &&
                    append(recording, &table[LOOK_COLOUR], look->count, look->colour) &&
                    append(recording, &table[LOOK_ID], look->count, look->id);
    free(topology);
    return ok;
}

bool recording_add_map(Recording *recording, int index, RecordingMapKind kind,
                       const RecordingMap *map, const void *const column[])
{
    ASSERT(index >= 0 && index < recording->body_count);
    const RecordingMapForm *form = &recording_map_form[kind];
    HdfTable *head = &recording->body[index].table[map_head[kind]];
    RecordingMap row = *map;
    ASSERT(head->set > 0);
    row.first = (int64_t)head[1].count;
    // The head comes last; no column has wider rows than the first one.
    bool ok = begin(recording, head + 1, form->columns * map->count);
    for (int k = 0; k < form->columns && ok; k++)
        ok = append(recording, head + 1 + k, map->count, column[k]);
    return ok && append(recording, head, 1, &row);
}

// True if the newest rows of the file will do for the frame. They are compared themselves, so
// errors do not add up.
static bool is_stored(const RecordedBody *body, double still, const RecordingFrame *frame)
{
    const size_t numbers = 3 * (size_t)frame->node_count;
    if (body->stored == NULL || frame->topology != body->stored_topology ||
        frame->node_count != body->stored_count)
        return false;
    if (still == 0.0)
        return memcmp(frame->position, body->stored, numbers * sizeof(float)) == 0;
    for (size_t k = 0; k < numbers; k++)
        if (!(fabs((double)frame->position[k] - (double)body->stored[k]) <= still))
            return false;
    return true;
}

static void remember_positions(RecordedBody *body, const RecordingFrame *frame, int64_t first)
{
    const size_t bytes = 3 * (size_t)frame->node_count * sizeof(float);
    if (body->stored == NULL || frame->node_count != body->stored_count)
        body->stored = realloc(body->stored, bytes + 1);
    ASSERT(body->stored != NULL);
    memcpy(body->stored, frame->position, bytes);
    body->stored_count = frame->node_count;
    body->stored_topology = frame->topology;
    body->stored_first = first;
}

bool recording_add_frame(Recording *recording, int index, const RecordingFrame *frame)
{
    ASSERT(index >= 0 && index < recording->body_count);
    RecordedBody *body = &recording->body[index];
    HdfTable *table = body->table;
    const bool shared = is_stored(body, recording->still, frame);
    const int64_t first = shared ? body->stored_first : (int64_t)table[POSITION].count;
    // The time comes last: a reader takes a frame for complete once that is there.
    bool ok = begin(recording, &table[POSITION], shared ? 0 : frame->node_count) &&
              (shared || append(recording, &table[POSITION], frame->node_count, frame->position)) &&
              append(recording, &table[FRAME_FIRST], 1, &first) &&
              append(recording, &table[FRAME_COUNT], 1, &frame->node_count) &&
              append(recording, &table[FRAME_TOPOLOGY], 1, &frame->topology) &&
              append(recording, &table[FRAME_STEP], 1, &frame->step) &&
              append(recording, &table[FRAME_TIME], 1, &frame->time);
    if (ok && !shared)
        remember_positions(body, frame, first);
    recording->frames += ok;
    return ok;
}

bool recording_add_tool(Recording *recording, int index, double time, const RecordingTool *sample)
{
    ASSERT(index >= 0 && index < recording->tool_count);
    HdfTable *table = recording->tool[index].table;
    return begin(recording, &table[TOOL_POSITION], 1) &&
           append(recording, &table[TOOL_POSITION], 1, &sample->position) &&
           append(recording, &table[TOOL_ORIENTATION], 1, &sample->orientation) &&
           append(recording, &table[TOOL_FORCE], 1, &sample->force) &&
           append(recording, &table[TOOL_TIME], 1, &time);
}

bool recording_add_event(Recording *recording, const RecordingEvent *event)
{
    return begin(recording, &recording->event, 1) && append(recording, &recording->event, 1, event);
}

bool recording_add_lines(Recording *recording, RecordingList list, const RecordingLedger *line,
                         int count)
{
    return begin(recording, &recording->list[list], count) &&
           append(recording, &recording->list[list], count, line);
}

void recording_set_counts(Recording *recording, int body, const RecordingCounts *counts)
{
    ASSERT(body >= 0 && body < recording->body_count);
    recording->body[body].counts = *counts;
}

// --- flushing ------------------------------------------------------------------------------------

// Rewriting a long sidecar at each flush would cost more than the recording.
static bool sidecar_is_due(const Recording *recording)
{
    int64_t missing = recording->frames - recording->frames_in_sidecar;
    return missing > 0 &&
           (recording->frames <= XDMF_AT_ONCE || missing > recording->frames / XDMF_LAG);
}

// A recording without a sidecar is still useful: tries again later and reports the failure at the
// end.
static bool write_sidecar(Recording *recording)
{
    recording->sidecar = (Status){0};
    if (!recording_write_xdmf(recording, &recording->sidecar))
        return false;
    recording->frames_in_sidecar = recording->frames;
    return true;
}

static bool flush_file(Recording *recording)
{
    if (recording->broken)
        return false;
    hdf_begin();
    errno = 0;
    recording->broken = H5Fflush(recording->file.id, H5F_SCOPE_GLOBAL) < 0;
    return !recording->broken ||
           status_fail(&recording->status, STATUS_FAILED, "%s: cannot be flushed: %s",
                       recording->path, errno != 0 ? strerror(errno) : "HDF5 refuses");
}

bool recording_flush(Recording *recording)
{
    if (!flush_file(recording))
        return false;
    if (sidecar_is_due(recording))
        write_sidecar(recording);
    return true;
}

bool recording_flush_if_due(Recording *recording, int64_t now_ns)
{
    if (recording->flushed_ns != 0 && now_ns - recording->flushed_ns < FLUSH_EVERY_NS)
        return recording->status.code == STATUS_OK;
    recording->flushed_ns = now_ns;
    return recording_flush(recording);
}

const Status *recording_status(const Recording *recording)
{
    return &recording->status;
}

// --- the end -------------------------------------------------------------------------------------

static void close_file(Recording *recording)
{
    hdf_begin();
    for (int i = 0; i < recording->body_count; i++)
        for (int t = 0; t < BODY_TABLES; t++)
            hdf_table_close(&recording->body[i].table[t]);
    for (int i = 0; i < recording->tool_count; i++)
        for (int t = 0; t < TOOL_TABLES; t++)
            hdf_table_close(&recording->tool[i].table[t]);
    hdf_table_close(&recording->event);
    for (int list = 0; list < RECORDING_LISTS; list++)
        hdf_table_close(&recording->list[list]);
    const hid_t type[] = {recording->event_type, recording->ledger_type, recording->map_type};
    for (size_t i = 0; i < sizeof type / sizeof *type; i++)
        if (type[i] >= 0)
            H5Tclose(type[i]);
    hdf_close(&recording->file);
}

// Writes what is known only now, into existing attributes of fixed size: none can be added while
// others read the file, and changing them needs no disk space.
static bool write_end(Recording *recording)
{
    const HdfFile *file = &recording->file;
    char group[64];
    bool ok = !recording->broken;
    hdf_begin();
    // What each body lacks.
    for (int i = 0; i < recording->body_count && ok; i++) {
        const char *counts = (const char *)&recording->body[i].counts;
        snprintf(group, sizeof group, "/bodies/%s", recording->body[i].name);
        for (int k = 0; k < RECORDING_COUNTS && ok; k++) {
            int64_t count;
            memcpy(&count, counts + recording_count_form[k].offset, sizeof count);
            ok = hdf_set_long(file, group, recording_count_form[k].name, count);
        }
    }
    return ok && hdf_set_long(file, "/", RECORDING_ENDED, 1);
}

static void destroy(Recording *recording)
{
    for (int i = 0; i < recording->body_count; i++) {
        free(recording->body[i].topology);
        free(recording->body[i].stored);
    }
    close(recording->space.fd);
    free(recording->body);
    free(recording->tool);
    free(recording->path);
    free(recording);
}

Recording *recording_create(const char *path, const RecordingOptions *options, Status *status)
{
    // Claim the file before anything is made.
    int fd = recording_open_target(path, options->overwrite, status);
    if (fd < 0)
        return NULL;
    // All members first, so that a failure anywhere can be undone.
    Recording *recording = calloc(1, sizeof *recording);
    ASSERT(recording != NULL);
    recording->space.fd = fd;
    recording->path = strdup(path);
    recording->still = options->still;
    recording->body_count = options->body_count;
    recording->tool_count = options->tool_count;
    recording->body = calloc((size_t)options->body_count + 1, sizeof *recording->body);
    recording->tool = calloc((size_t)options->tool_count + 1, sizeof *recording->tool);
    ASSERT(recording->path != NULL && recording->body != NULL && recording->tool != NULL);
    recording->file = (HdfFile){.id = -1, .path = recording->path, .status = &recording->status};
    recording->event_type = recording->ledger_type = recording->map_type = -1;
    // Data sets, a first flush and a sidecar: from now on there is a valid file.
    if (create_all(recording, options) && flush_file(recording) && write_sidecar(recording))
        return recording;
    // Leave no file that is none.
    const Status *said =
        recording->status.code != STATUS_OK ? &recording->status : &recording->sidecar;
    status_fail(status, STATUS_INVALID, "%s", said->text);
    close_file(recording);
    unlink(path);
    destroy(recording);
    return NULL;
}

bool recording_close(Recording *recording, Status *status)
{
    write_end(recording);
    bool flushed = flush_file(recording);
    disk_space_release(&recording->space);
    if (flushed && !write_sidecar(recording))
        status_fail(&recording->status, STATUS_FAILED, "%s", recording->sidecar.text);
    // HDF5 cannot close a file that it cannot write; leave it as after a kill.
    if (flushed)
        close_file(recording);
    bool ok = recording->status.code == STATUS_OK ||
              status_fail(status, STATUS_FAILED, "%s", recording->status.text);
    destroy(recording);
    return ok;
}

#else

bool recording_claim(const char *path, bool overwrite, Status *status)
{
    (void)overwrite;
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

Recording *recording_create(const char *path, const RecordingOptions *options, Status *status)
{
    (void)options;
    status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
    return NULL;
}

// Never called: without HDF5 there is no recording.
bool recording_add_topology(Recording *recording, int body, const RecordingTopology *topology)
{
    (void)recording, (void)body, (void)topology;
    return false;
}

bool recording_add_look(Recording *recording, int body, const RecordingLook *look)
{
    (void)recording, (void)body, (void)look;
    return false;
}

bool recording_add_map(Recording *recording, int body, RecordingMapKind kind,
                       const RecordingMap *map, const void *const column[])
{
    (void)recording, (void)body, (void)kind, (void)map, (void)column;
    return false;
}

bool recording_add_frame(Recording *recording, int body, const RecordingFrame *frame)
{
    (void)recording, (void)body, (void)frame;
    return false;
}

bool recording_add_tool(Recording *recording, int tool, double time, const RecordingTool *sample)
{
    (void)recording, (void)tool, (void)time, (void)sample;
    return false;
}

bool recording_add_event(Recording *recording, const RecordingEvent *event)
{
    (void)recording, (void)event;
    return false;
}

bool recording_add_lines(Recording *recording, RecordingList list, const RecordingLedger *line,
                         int count)
{
    (void)recording, (void)list, (void)line, (void)count;
    return false;
}

void recording_set_counts(Recording *recording, int body, const RecordingCounts *counts)
{
    (void)recording, (void)body, (void)counts;
}

bool recording_flush(Recording *recording)
{
    (void)recording;
    return false;
}

bool recording_flush_if_due(Recording *recording, int64_t now_ns)
{
    (void)recording, (void)now_ns;
    return false;
}

const Status *recording_status(const Recording *recording)
{
    (void)recording;
    return NULL;
}

bool recording_close(Recording *recording, Status *status)
{
    (void)recording, (void)status;
    return false;
}

#endif
