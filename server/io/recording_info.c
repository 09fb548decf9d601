// SPDX-License-Identifier: MIT
#include "io/recording.h"

#include "io/recording_parts.h"
#include "io/recording_read.h"

#include <string.h>

enum { NAME_TEXT = 128 };

#ifdef PLIANT_WITH_HDF5
#include "base/check.h"
#include "io/hdf.h"

#include <math.h>
#include <stdlib.h>
#include <sys/stat.h>

enum { BLOCK = 4096, GROUP_TEXT = 64, TOPOLOGY_LIMIT = 1 << 24 };

// --- data sets -----------------------------------------------------------------------------------

// Returns the largest number of rows that the file can hold, whatever the data set claims: rows
// that were never written cost a file nothing, and reading them would not end. (The storage size of
// the data set is no better bound: HDF5 counts missing chunks too.) A file may be sparse; file
// systems that compress, or that do not count unwritten data, get a margin.
static hsize_t most_rows(const HdfFile *file, hid_t set, hid_t type, int columns)
{
    enum { PACKED_MOST = 1100, UNCOUNTED = 1 << 26 }; // factor: deflate compresses no better
    struct stat about;
    hid_t layout = H5Dget_create_plist(set);
    bool packed = H5Pget_nfilters(layout) != 0, known = stat(file->path, &about) == 0;
    hsize_t row = H5Tget_size(type) * (columns > 0 ? (hsize_t)columns : 1);
    hsize_t bytes = known ? (hsize_t)about.st_size : 0;
    hsize_t stored = known ? (hsize_t)about.st_blocks * 512 * PACKED_MOST + UNCOUNTED : 0;
    H5Pclose(layout);
    return (bytes < stored ? bytes : stored) / row * (packed ? PACKED_MOST : 1);
}

// Returns the rows of a data set of numbers with so many columns (0: one dimension), or -1 with a
// status.
static int64_t count_rows(const HdfFile *file, const char *name, H5T_class_t class, int columns)
{
    // Open it and look at its shape and type.
    hid_t set = H5Dopen2(file->id, name, H5P_DEFAULT);
    if (set < 0) {
        hdf_fail(file, name, "is missing or no data set");
        return -1;
    }
    hid_t space = H5Dget_space(set), type = H5Dget_type(set);
    hsize_t size[2] = {0, 0};
    int rank = H5Sget_simple_extent_ndims(space);
    bool ok = rank == (columns > 0 ? 2 : 1) && H5Tget_class(type) == class &&
              H5Sget_simple_extent_dims(space, size, NULL) == rank &&
              (columns == 0 || size[1] == (hsize_t)columns) && size[0] <= INT64_MAX;
    // A damaged header may state more rows than the file can hold.
    hsize_t most = ok ? most_rows(file, set, type, columns) : 0;
    H5Tclose(type);
    H5Sclose(space);
    H5Dclose(set);
    if (!ok)
        hdf_fail(file, name, "has not the shape or the type that a recording gives it");
    return !ok ? -1 : (int64_t)(size[0] < most ? size[0] : most);
}

bool recording_read_rows(const HdfFile *file, const char *name, hid_t type, int columns,
                         int64_t first, int rows, void *to)
{
    const hsize_t start[2] = {(hsize_t)first, 0}, count[2] = {(hsize_t)rows, (hsize_t)columns};
    const int rank = columns > 0 ? 2 : 1;
    hid_t set = H5Dopen2(file->id, name, H5P_DEFAULT);
    hid_t in_file = H5Dget_space(set), in_memory = H5Screate_simple(rank, count, NULL);
    bool ok = H5Sget_simple_extent_ndims(in_file) == rank &&
              H5Sselect_hyperslab(in_file, H5S_SELECT_SET, start, NULL, count, NULL) >= 0 &&
              H5Dread(set, type, in_memory, in_file, H5P_DEFAULT, to) >= 0;
    H5Sclose(in_memory);
    H5Sclose(in_file);
    H5Dclose(set);
    return ok || hdf_fail(file, name, "cannot be read: the file is damaged");
}

// Finds the shortest of some columns: the number of complete rows. -1 with a status.
typedef struct Column {
    const char *name;
    H5T_class_t class;
} Column;

static int64_t shortest(const HdfFile *file, const char *group, const Column *column, int count)
{
    int64_t least = INT64_MAX;
    char name[NAME_TEXT];
    // A frame counts when all of its columns have it.
    for (int i = 0; i < count; i++) {
        snprintf(name, sizeof name, "%s/%s", group, column[i].name);
        int64_t rows = count_rows(file, name, column[i].class, 0);
        if (rows < 0)
            return -1;
        least = rows < least ? rows : least;
    }
    return least;
}

// --- topologies ----------------------------------------------------------------------------------

// Rows that a topology may refer to.
typedef struct Extents {
    int64_t triangles, ids; // rows of the flat data sets
} Extents;

static bool is_whole(int64_t first, int count, int64_t rows)
{
    return first >= 0 && count >= 0 && first <= rows && count <= rows - first;
}

static void *allocate(int count, size_t size)
{
    void *memory = calloc((size_t)count + 1, size);
    ASSERT(memory != NULL);
    return memory;
}

static bool read_column(const HdfFile *file, const char *group, const char *column, hid_t type,
                        int64_t first, int rows, void *to)
{
    char name[NAME_TEXT];
    snprintf(name, sizeof name, "%s/%s", group, column);
    return rows == 0 || recording_read_rows(file, name, type, 0, first, rows, to);
}

// Returns the rows that all optional data sets of nodes have; 0: one is missing; -1 with a status.
static int64_t count_told(const HdfFile *file, const char *group)
{
    static const struct {
        const char *name;
        int columns;
    } set[] = {
#define NODE_SET(name, type, width, of, empty, sent, recorded)                                     \
    MESH_IF_LATER(recorded, {"node_" #name, (width) > 1 ? (width) : 0}, )
        MESH_COLUMNS(NODE_SET)};
    int64_t least = INT64_MAX;
    for (size_t i = 0; i < sizeof set / sizeof *set && least > 0; i++) {
        char name[NAME_TEXT];
        snprintf(name, sizeof name, "%s/%s", group, set[i].name);
        int64_t rows =
            hdf_exists(file, name) ? count_rows(file, name, H5T_INTEGER, set[i].columns) : 0;
        least = rows < least ? rows : least;
    }
    return least;
}

// Returns the rows of colours that all their data sets have; 0: none; -1 with a status.
static int64_t count_look(const HdfFile *file, const char *group)
{
    static const struct {
        const char *name;
        int columns;
    } set[] = {{"topology", 0}, {"id", 0}, {"colour", RECORDING_COLOURS}};
    int64_t least = RECORDING_LOOKS_MOST;
    for (int i = 0; i < 3 && least > 0; i++) {
        char name[NAME_TEXT];
        snprintf(name, sizeof name, "%s/look/%s", group, set[i].name);
        int64_t rows =
            hdf_exists(file, name) ? count_rows(file, name, H5T_INTEGER, set[i].columns) : 0;
        least = rows < least ? rows : least;
    }
    return least;
}

// The complete topologies of a body; the caller frees them.
static bool read_topologies(const HdfFile *file, const char *group, const Extents *extents,
                            int rows, TopologyRows **all, int *whole)
{
    // All columns of the topologies.
    int64_t *first = allocate(rows, sizeof *first), *node_first = allocate(rows, sizeof *first);
    int *count = allocate(rows, sizeof *count), *number = allocate(rows, sizeof *number);
    int *nodes = allocate(rows, sizeof *nodes);
    *all = allocate(rows, sizeof **all);
    bool ok =
        read_column(file, group, "topology/number", H5T_NATIVE_INT, 0, rows, number) &&
        read_column(file, group, "topology/first", H5T_NATIVE_INT64, 0, rows, first) &&
        read_column(file, group, "topology/count", H5T_NATIVE_INT, 0, rows, count) &&
        read_column(file, group, "topology/node_first", H5T_NATIVE_INT64, 0, rows, node_first) &&
        read_column(file, group, "topology/node_count", H5T_NATIVE_INT, 0, rows, nodes);
    // A topology that was being added when the writer was killed is incomplete, and so are its
    // frames.
    for (int i = 0; i < rows && ok; i++)
        if (is_whole(first[i], count[i], extents->triangles) &&
            is_whole(node_first[i], nodes[i], extents->ids))
            (*all)[(*whole)++] = (TopologyRows){.number = number[i],
                                                .triangle_count = count[i],
                                                .node_count = nodes[i],
                                                .first_triangle = first[i],
                                                .first_node = node_first[i]};
    free(first);
    free(node_first);
    free(count);
    free(number);
    free(nodes);
    return ok;
}

// Finds the topology of a number, from `at` on: most frames have that of the frame before. Returns
// -1 if there is none.
static int find_topology(const TopologyRows *topology, int count, int number, int at)
{
    for (int i = 0; i < count; i++) {
        int index = (at + i) % count;
        if (topology[index].number == number)
            return index;
    }
    return -1;
}

// --- frames --------------------------------------------------------------------------------------

typedef struct Block {
    double time[BLOCK];
    int64_t step[BLOCK], first[BLOCK];
    int topology[BLOCK], count[BLOCK];
} Block;

static void add_frame(RecordingBodyInfo *info, const Block *block, int i)
{
    // The first frame begins the range,
    if (info->frames++ == 0) {
        info->first_step = block->step[i];
        info->first_time = block->time[i];
        info->least_nodes = info->most_nodes = block->count[i];
    }
    // every one extends it.
    info->last_step = block->step[i];
    info->last_time = block->time[i];
    if (block->count[i] < info->least_nodes)
        info->least_nodes = block->count[i];
    if (block->count[i] > info->most_nodes)
        info->most_nodes = block->count[i];
}

// Adds a frame to those that a reader finds by their time, which therefore must rise.
static void index_frame(RecordingIndex *index, const Block *block, int i, int topology)
{
    if (index->frame_count == RECORDING_FRAMES_MOST ||
        (index->frame_count > 0 && block->time[i] <= index->frame[index->frame_count - 1].time))
        return;
    if (index->frame_count == index->frame_capacity) {
        index->frame_capacity = index->frame_capacity == 0 ? BLOCK : 2 * index->frame_capacity;
        index->frame = realloc(index->frame, (size_t)index->frame_capacity * sizeof *index->frame);
        ASSERT(index->frame != NULL);
    }
    index->frame[index->frame_count++] = (FrameRow){.time = block->time[i],
                                                    .step = block->step[i],
                                                    .first = block->first[i],
                                                    .count = block->count[i],
                                                    .topology = topology};
}

static bool read_frames(const HdfFile *file, const char *group, RecordingIndex *index,
                        int64_t frames, int64_t positions, RecordingBodyInfo *info)
{
    Block *block = malloc(sizeof *block);
    ASSERT(block != NULL);
    bool ok = true;
    int at = 0;
    // A block of rows at a time, whatever the length of the recording.
    for (int64_t first = 0; first < frames && ok; first += BLOCK) {
        int rows = (int)(frames - first < BLOCK ? frames - first : BLOCK);
        ok =
            read_column(file, group, "frames/time", H5T_NATIVE_DOUBLE, first, rows, block->time) &&
            read_column(file, group, "frames/step", H5T_NATIVE_INT64, first, rows, block->step) &&
            read_column(file, group, "frames/first", H5T_NATIVE_INT64, first, rows, block->first) &&
            read_column(file, group, "frames/count", H5T_NATIVE_INT, first, rows, block->count) &&
            read_column(file, group, "frames/topology", H5T_NATIVE_INT, first, rows,
                        block->topology);
        // A frame counts if its rows are there and its mesh has as many nodes.
        for (int i = 0; i < rows && ok; i++) {
            int found =
                find_topology(index->topology, index->topology_count, block->topology[i], at);
            at = found >= 0 ? found : at;
            if (!is_whole(block->first[i], block->count[i], positions) || found < 0 ||
                index->topology[found].node_count != block->count[i] || !isfinite(block->time[i])) {
                info->broken++;
                continue;
            }
            add_frame(info, block, i);
            if (index->frames_wanted)
                index_frame(index, block, i, found);
        }
    }
    free(block);
    return ok;
}

// --- maps ----------------------------------------------------------------------------------------

// Indexes the complete maps of a kind: their mesh is there and has as many nodes or triangles, and
// their times do not fall. Others are left out, as frames are.
static void index_maps(const RecordingMapForm *form, int64_t heads, int64_t rows,
                       const RecordingIndex *index, RecordingMap *map, int64_t *count)
{
    int at = 0;
    for (int64_t i = 0; i < heads; i++) {
        const int found =
            find_topology(index->topology, index->topology_count, map[i].topology, at);
        if (found < 0 || !is_whole(map[i].first, map[i].count, rows) || !isfinite(map[i].time) ||
            (*count > 0 && map[i].time < map[*count - 1].time))
            continue;
        at = found;
        const TopologyRows *of = &index->topology[found];
        if (map[i].count == (form->of_triangles ? of->triangle_count : of->node_count))
            map[(*count)++] = map[i];
    }
}

static bool read_maps(const HdfFile *file, const char *group, RecordingMapKind kind,
                      RecordingIndex *index)
{
    const RecordingMapForm *form = &recording_map_form[kind];
    char name[NAME_TEXT];
    snprintf(name, sizeof name, "%s/%s/map", group, form->group);
    if (!hdf_exists(file, name))
        return true;
    int64_t heads = count_rows(file, name, H5T_COMPOUND, 0), rows = INT64_MAX;
    for (int k = 0; k < form->columns && rows >= 0; k++) {
        snprintf(name, sizeof name, "%s/%s/%s", group, form->group, form->column[k]);
        const int64_t some = count_rows(file, name, H5T_INTEGER, 0);
        rows = some < rows ? some : rows;
    }
    if (heads <= 0 || rows < 0)
        return heads == 0 && rows >= 0;
    heads = heads < RECORDING_MAPS_MOST ? heads : RECORDING_MAPS_MOST;
    index->map[kind] = allocate((int)heads, sizeof *index->map[kind]);
    snprintf(name, sizeof name, "%s/%s/map", group, form->group);
    hid_t type = recording_map_type();
    const bool ok = recording_read_rows(file, name, type, 0, 0, (int)heads, index->map[kind]);
    H5Tclose(type);
    if (ok)
        index_maps(form, heads, rows, index, index->map[kind], &index->map_count[kind]);
    return ok;
}

// --- bodies --------------------------------------------------------------------------------------

// Reads an attribute that older recordings may lack.
static bool read_attribute(const HdfFile *file, const char *object, const char *name,
                           int64_t *value)
{
    *value = 0;
    return H5Aexists_by_name(file->id, object, name, H5P_DEFAULT) <= 0 ||
           hdf_read_long(file, object, name, value);
}

static bool read_counts(const HdfFile *file, const char *group, RecordingCounts *counts)
{
    bool ok = true;
    for (int i = 0; i < RECORDING_COUNTS && ok; i++) {
        int64_t count = 0;
        ok = read_attribute(file, group, recording_count_form[i].name, &count);
        memcpy((char *)counts + recording_count_form[i].offset, &count, sizeof count);
    }
    return ok;
}

static bool read_body(const HdfFile *file, RecordingBodyInfo *info, RecordingIndex *index)
{
    static const Column frame_columns[] = {{"frames/time", H5T_FLOAT},
                                           {"frames/step", H5T_INTEGER},
                                           {"frames/topology", H5T_INTEGER},
                                           {"frames/first", H5T_INTEGER},
                                           {"frames/count", H5T_INTEGER}};
    static const Column topology_columns[] = {{"topology/number", H5T_INTEGER},
                                              {"topology/first", H5T_INTEGER},
                                              {"topology/count", H5T_INTEGER},
                                              {"topology/node_first", H5T_INTEGER},
                                              {"topology/node_count", H5T_INTEGER}};
    char group[GROUP_TEXT], name[NAME_TEXT];
    // Rows of the flat data sets, then of the columns that point into them; -1 passes an error on.
    snprintf(group, sizeof group, "/bodies/%s", info->name);
    snprintf(name, sizeof name, "%s/position", group);
    const int64_t positions = count_rows(file, name, H5T_FLOAT, 3);
    snprintf(name, sizeof name, "%s/triangles", group);
    const int64_t triangles = positions < 0 ? -1 : count_rows(file, name, H5T_INTEGER, 3);
    snprintf(name, sizeof name, "%s/node_id", group);
    const int64_t ids = triangles < 0 ? -1 : count_rows(file, name, H5T_INTEGER, 0);
    const int64_t frames = ids < 0 ? -1 : shortest(file, group, frame_columns, 5);
    const int64_t topologies = frames < 0 ? -1 : shortest(file, group, topology_columns, 5);
    // Something is missing, or there is more than any recording has.
    if (topologies < 0)
        return false;
    if (topologies > TOPOLOGY_LIMIT)
        return hdf_fail(file, group, "has %lld topologies, at most %d", (long long)topologies,
                        TOPOLOGY_LIMIT);
    // Topologies first, since frames are checked against them.
    const Extents extents = {triangles, ids};
    index->nodes_told = count_told(file, group);
    index->look_rows = index->nodes_told < 0 ? -1 : count_look(file, group);
    if (index->look_rows < 0)
        return false;
    bool ok = read_topologies(file, group, &extents, (int)topologies, &index->topology,
                              &index->topology_count) &&
              read_frames(file, group, index, frames, positions, info) &&
              read_counts(file, group, &info->counts) &&
              read_attribute(file, group, "first_wall", &index->first_wall);
    info->topologies = index->topology_count;
    for (int kind = 0; kind < RECORDING_MAPS && ok; kind++) {
        ok = read_maps(file, group, kind, index);
        info->maps[kind] = index->map_count[kind];
    }
    return ok;
}

// --- the rest ------------------------------------------------------------------------------------

// Lists the names in a group, at most `most`; returns how many, or -1 with a status. `size` of each
// name's slot.
static int list(const HdfFile *file, const char *group, int most, size_t stride, size_t size,
                char *name)
{
    H5G_info_t info;
    if (!hdf_exists(file, group))
        return 0;
    // A group has at most so many members,
    if (H5Gget_info_by_name(file->id, group, &info, H5P_DEFAULT) < 0 ||
        info.nlinks > (hsize_t)most) {
        hdf_fail(file, group, "is no group of at most %d", most);
        return -1;
    }
    // and each has a name that fits.
    for (hsize_t i = 0; i < info.nlinks; i++) {
        ssize_t length = H5Lget_name_by_idx(file->id, group, H5_INDEX_NAME, H5_ITER_INC, i,
                                            name + i * stride, size, H5P_DEFAULT);
        if (length < 0 || (size_t)length >= size) {
            hdf_fail(file, group, "holds something that no recording has");
            return -1;
        }
    }
    return (int)info.nlinks;
}

static bool read_tool(const HdfFile *file, RecordingToolInfo *info)
{
    char name[NAME_TEXT];
    static const struct {
        const char *name;
        int columns;
    } column[] = {{"time", 0}, {"position", 3}, {"orientation", 4}, {"force", 3}};
    // A row counts when all of its columns have it.
    info->rows = INT64_MAX;
    for (int i = 0; i < 4; i++) {
        snprintf(name, sizeof name, "/tools/%s/%s", info->name, column[i].name);
        int64_t rows = count_rows(file, name, H5T_FLOAT, column[i].columns);
        if (rows < 0)
            return false;
        info->rows = rows < info->rows ? rows : info->rows;
    }
    return true;
}

static void add_kind(RecordingInfo *info, const char kind[RECORDING_KIND_TEXT])
{
    int at = 0;
    // A kind that was met before, or a new one while there is room.
    while (at < info->kind_count && strcmp(info->kind[at].kind, kind) != 0)
        at++;
    if (at == RECORDING_INFO_KINDS)
        return;
    if (at == info->kind_count) {
        memcpy(info->kind[at].kind, kind, sizeof info->kind[at].kind);
        info->kind_count++;
    }
    info->kind[at].events++;
}

static bool read_events(const HdfFile *file, RecordingInfo *info)
{
    enum { EVENTS = 256 };
    char kind[EVENTS][RECORDING_KIND_TEXT];
    info->events = count_rows(file, "/events", H5T_COMPOUND, 0);
    if (info->events < 0)
        return false;
    // Read only this member of each event.
    hid_t text = H5Tcopy(H5T_C_S1), type = H5Tcreate(H5T_COMPOUND, RECORDING_KIND_TEXT);
    H5Tset_size(text, RECORDING_KIND_TEXT);
    H5Tset_cset(text, H5T_CSET_UTF8);
    H5Tinsert(type, "kind", 0, text);
    bool ok = true;
    // A block of events at a time.
    for (int64_t first = 0; first < info->events && ok; first += EVENTS) {
        int rows = (int)(info->events - first < EVENTS ? info->events - first : EVENTS);
        ok = recording_read_rows(file, "/events", type, 0, first, rows, kind);
        for (int i = 0; i < rows && ok; i++) {
            kind[i][RECORDING_KIND_TEXT - 1] = '\0';
            add_kind(info, kind[i]);
        }
    }
    H5Tclose(type);
    H5Tclose(text);
    return ok;
}

static bool read_lists(const HdfFile *file, RecordingInfo *info)
{
    bool ok = true;
    for (int list = 0; list < RECORDING_LISTS && ok; list++) {
        if (hdf_exists(file, recording_list_name[list]))
            info->lines[list] = count_rows(file, recording_list_name[list], H5T_COMPOUND, 0);
        ok = info->lines[list] >= 0;
    }
    return ok;
}

// Opens a file that is being written. A block with a wrong checksum may be half written and is read
// again, after sleeps that double from a nanosecond on. HDF5 would try a hundred times, which never
// ends; twenty take a millisecond.
static hid_t open_growing(const char *path)
{
    enum { ATTEMPTS = 20 };
    hid_t how = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_metadata_read_attempts(how, ATTEMPTS);
    hid_t id = H5Fopen(path, H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, how);
    H5Pclose(how);
    return id;
}

bool recording_open_any(HdfFile *file, const char *path, Status *status)
{
    Status why = {0};
    if (hdf_open_here(file, path, &why))
        file->status = status;
    else if (H5Fis_hdf5(path) > 0)
        *file = (HdfFile){.id = open_growing(path), .path = path, .status = status};
    return file->id >= 0 || status_fail(status, why.code, "%s", why.text);
}

void recording_index_free(RecordingIndex *index)
{
    free(index->topology);
    free(index->frame);
    for (int kind = 0; kind < RECORDING_MAPS; kind++)
        free(index->map[kind]);
    *index = (RecordingIndex){0};
}

bool recording_read_contents(const HdfFile *file, RecordingInfo *info, RecordingIndex *index)
{
    char format[32];
    int64_t ended = 0;
    Status why = {0}; // no other error has more detail
    // Is it a recording at all?
    const HdfFile quiet = {.id = file->id, .path = file->path, .status = &why};
    if (!hdf_read_text(&quiet, "/", "format", format, sizeof format) ||
        strcmp(format, "pliant-recording") != 0)
        return status_fail(file->status, STATUS_INVALID, "%s: is no recording", file->path);
    // Who made it, and whether it was ended.
    bool ok = hdf_read_text(file, "/", "created_by", info->created_by, sizeof info->created_by) &&
              read_attribute(file, "/", RECORDING_ENDED, &ended);
    info->ended = ended == 1;
    // Every body with its frames,
    info->body_count = !ok ? -1
                           : list(file, "/bodies", RECORDING_INFO_BODIES, sizeof *info->body,
                                  sizeof info->body->name, info->body->name);
    for (int i = 0; i < info->body_count && ok; i++) {
        RecordingIndex one = {0}, *to = index != NULL ? &index[i] : &one;
        ok = read_body(file, &info->body[i], to);
        recording_index_free(&one);
    }
    // and every tool with its rows.
    info->tool_count = !ok ? -1
                           : list(file, "/tools", RECORDING_INFO_TOOLS, sizeof *info->tool,
                                  sizeof info->tool->name, info->tool->name);
    for (int i = 0; i < info->tool_count && ok; i++)
        ok = read_tool(file, &info->tool[i]);
    return ok && info->body_count >= 0 && info->tool_count >= 0 && read_events(file, info) &&
           read_lists(file, info);
}

// The child's result.
typedef struct Findings {
    Status status;
    RecordingInfo info;
} Findings;

static void serve(int fd, void *path)
{
    Findings *found = calloc(1, sizeof *found);
    ASSERT(found != NULL);
    HdfFile file;
    if (recording_open_any(&file, path, &found->status))
        recording_read_contents(&file, &found->info, NULL);
    hdf_child_send(fd, found, sizeof *found);
}

// Checks data from a process that HDF5 may have corrupted: every index stays inside the arrays.
void recording_info_tidy(RecordingInfo *info)
{
    const int most[] = {RECORDING_INFO_BODIES, RECORDING_INFO_TOOLS, RECORDING_INFO_KINDS};
    // What comes from the child is checked like a file.
    int *const count[] = {&info->body_count, &info->tool_count, &info->kind_count};
    for (int i = 0; i < 3; i++)
        if (*count[i] < 0 || *count[i] > most[i])
            *count[i] = 0;
    // And every text ends.
    info->created_by[sizeof info->created_by - 1] = '\0';
    for (int i = 0; i < info->body_count; i++)
        info->body[i].name[sizeof info->body[i].name - 1] = '\0';
    for (int i = 0; i < info->tool_count; i++)
        info->tool[i].name[sizeof info->tool[i].name - 1] = '\0';
    for (int i = 0; i < info->kind_count; i++)
        info->kind[i].kind[sizeof info->kind[i].kind - 1] = '\0';
}

bool recording_info_read(const char *path, RecordingInfo *info, Status *status)
{
    *info = (RecordingInfo){0};
    // A child reads it; a damaged file ends that one alone.
    HdfChild *child = hdf_child_start(path, serve, (void *)(uintptr_t)path, status);
    if (child == NULL)
        return false;
    Findings *found = calloc(1, sizeof *found);
    ASSERT(found != NULL);
    bool ok =
        hdf_child_receive(child->fd, found, sizeof *found) || hdf_child_failed(child, path, status);
    // Its answer is checked like a file.
    if (ok) {
        found->status.text[sizeof found->status.text - 1] = '\0';
        *info = found->info;
        recording_info_tidy(info);
        ok = found->status.code == STATUS_OK ||
             status_fail(status, found->status.code, "%s", found->status.text);
    }
    hdf_child_end(child);
    free(found);
    return ok;
}

#else

bool recording_info_read(const char *path, RecordingInfo *info, Status *status)
{
    *info = (RecordingInfo){0};
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

#endif

// Copies a text of the file; what would command the terminal becomes '?'.
static const char *plain(const char *text, char copy[NAME_TEXT])
{
    int length = 0;
    for (; text[length] != '\0' && length < NAME_TEXT - 1; length++) {
        const unsigned char c = (unsigned char)text[length];
        // Also in two bytes: U+0080 to U+009F command some terminals.
        const bool second = length > 0 && (unsigned char)text[length - 1] == 0xc2;
        copy[length] = (char)(c < ' ' || c == 127 || (second && c < 0xa0) ? '?' : c);
    }
    copy[length] = '\0';
    return copy;
}

static void print_body(const RecordingBodyInfo *body, bool ended, FILE *out)
{
    char name[NAME_TEXT];
    // What there is,
    fprintf(out, "body %s: %lld frames", plain(body->name, name), (long long)body->frames);
    if (body->frames > 0)
        fprintf(out, ", %.6g s (time %.6g to %.6g s, step %lld to %lld), %d to %d nodes",
                body->last_time - body->first_time, body->first_time, body->last_time,
                (long long)body->first_step, (long long)body->last_step, body->least_nodes,
                body->most_nodes);
    fprintf(out, ", topologies: %lld\n", (long long)body->topologies);
    if (body->maps[RECORDING_ERROR_MAP] > 0 || body->maps[RECORDING_ELEMENTS] > 0)
        fprintf(out, "  maps of its error: %lld, of its elements: %lld\n",
                (long long)body->maps[RECORDING_ERROR_MAP],
                (long long)body->maps[RECORDING_ELEMENTS]);
    // what was left half written,
    if (body->broken > 0)
        fprintf(out, "  frames of which not all is there: %lld\n", (long long)body->broken);
    // and what never came, which only an ended file knows.
    if (ended)
        fprintf(out,
                "  missing: lost on the way %lld, dropped by a slow disk %lld, without their mesh "
                "%lld; messages refused: %lld\n",
                (long long)body->counts.lost, (long long)body->counts.dropped,
                (long long)body->counts.without_mesh, (long long)body->counts.refused);
}

void recording_info_print(const RecordingInfo *info, FILE *out)
{
    char text[NAME_TEXT];
    fprintf(out, "made by %s\n", plain(info->created_by, text));
    fprintf(out, "%s\n",
            info->ended ? "ended cleanly"
                        : "not ended: it is being written, or its writer was killed; plain readers "
                          "open it after h5clear -s FILE; what is missing was not counted");
    for (int i = 0; i < info->body_count; i++)
        print_body(&info->body[i], info->ended, out);
    for (int i = 0; i < info->tool_count; i++)
        fprintf(out, "tool %s: %lld rows\n", plain(info->tool[i].name, text),
                (long long)info->tool[i].rows);
    fprintf(out, "events: %lld\n", (long long)info->events);
    for (int i = 0; i < info->kind_count; i++)
        fprintf(out, "  %s: %lld\n", plain(info->kind[i].kind, text),
                (long long)info->kind[i].events);
}
