// SPDX-License-Identifier: MIT
// Shared by the recording's files: recording.c (the HDF5 file), recording_claim.c (its place),
// recording_xdmf.c (the sidecar), recording_info.c (what a file contains), recording_read.c (its
// frames, meshes, tools and events, at any time).
// Private to io/.
#ifndef PLIANT_IO_RECORDING_PARTS_H
#define PLIANT_IO_RECORDING_PARTS_H

#include "io/hdf.h"
#include "io/recording.h"

#include <stdbool.h>
#include <stdint.h>

// Disk space reserved in advance. HDF5 does not survive a disk that fills up in the middle of a
// write. Any thread but the step thread.
typedef struct DiskSpace {
    int fd;           // of the file, open for writing
    int64_t reserved; // [bytes] from the start of the file
} DiskSpace;

// Ensures that the file can grow to `end` bytes, without changing its size. Returns false with
// errno if it cannot (full disk, quota, limit of the process). A file system that cannot reserve
// space always succeeds.
bool disk_space_reserve(DiskSpace *space, int64_t end);
// Releases the space after the file's end.
void disk_space_release(DiskSpace *space);

// The data sets of each kind of map in its group: "map" with the heads, and these columns.
typedef struct RecordingMapForm {
    const char *group;
    int columns;
    const char *column[RECORDING_MAP_COLUMNS];
    size_t bytes[RECORDING_MAP_COLUMNS]; // of a row of each
    bool of_triangles;
} RecordingMapForm;
extern const RecordingMapForm recording_map_form[RECORDING_MAPS];

#ifdef PLIANT_WITH_HDF5

// The data sets of a body: columns of its frames and topologies, and the flat arrays that `first`
// and `count` index.
typedef enum BodyTable {
    FRAME_TIME,
    FRAME_STEP,
    FRAME_TOPOLOGY,
    FRAME_FIRST,
    FRAME_COUNT,
    POSITION,
    TOPOLOGY_NUMBER,
    TOPOLOGY_FIRST,
    TOPOLOGY_COUNT,
    TOPOLOGY_NODE_FIRST,
    TOPOLOGY_NODE_COUNT,
    TRIANGLES,
    NODE_ID,
#define RECORDING_NODE_TABLE(name, type, width, of, empty, sent, recorded)                         \
    MESH_IF_LATER(recorded, NODE_##name, )
    MESH_COLUMNS(RECORDING_NODE_TABLE) LOOK_TOPOLOGY, // of bodies with colours: these and the next
    LOOK_ID,
    LOOK_COLOUR,
    ERROR_MAP, // maps: their heads, and behind each its columns
    ERROR_SHARE,
    ELEMENTS,
    ELEMENTS_TAG,
    ELEMENTS_LEVEL,
    BODY_TABLES,
} BodyTable;

typedef enum ToolTable {
    TOOL_TIME,
    TOOL_POSITION,
    TOOL_ORIENTATION,
    TOOL_FORCE,
    TOOL_TABLES
} ToolTable;

// Rows of a topology in triangles and node_id.
typedef struct TopologyRows {
    int number, triangle_count, node_count;
    int64_t first_triangle, first_node;
} TopologyRows;

// Attributes: of a body, 0 until the file is closed; of the file, 1 once it is closed.
#define RECORDING_ENDED "ended"
typedef struct RecordingCountForm {
    const char *name;
    size_t offset; // in RecordingCounts
} RecordingCountForm;
enum { RECORDING_COUNTS = 4 };
extern const RecordingCountForm recording_count_form[RECORDING_COUNTS];

typedef struct RecordedBody {
    char name[RECORDING_BODY_TEXT];
    RecordingCounts counts;
    HdfTable table[BODY_TABLES];
    TopologyRows *topology; // [topology_count], the same as in the file
    int topology_count, topology_capacity;
    // Its newest positions in the file; NULL: none yet.
    float *stored; // [3 stored_count]
    int stored_count, stored_topology;
    int64_t stored_first; // row
} RecordedBody;

typedef struct RecordedTool {
    HdfTable table[TOOL_TABLES];
} RecordedTool;

struct Recording {
    HdfFile file;
    char *path;
    DiskSpace space; // reserved in advance
    bool broken;     // HDF5 has failed to write and must not touch the file any more
    Status status;   // the first failure
    Status sidecar;  // of its newest writing
    double still;    // [m]
    int body_count, tool_count;
    int table_count; // data sets that have rows
    RecordedBody *body;
    RecordedTool *tool;
    HdfTable event, list[RECORDING_LISTS];
    hid_t event_type, ledger_type, map_type;
    int64_t flushed_ns;
    int64_t frames, frames_in_sidecar; // of all bodies
};

extern const char *const recording_list_name[RECORDING_LISTS];

// Opens the file of a new recording. Never replaces data that may still be needed, and gives
// reasons where HDF5 only reports a failure. Returns a descriptor, or -1 with `status`.
int recording_open_target(const char *path, bool overwrite, Status *status);

// Writes FILE.xdmf for all frames so far, which must have been flushed. Writes a temporary file and
// renames it, so that there is always a complete one.
bool recording_write_xdmf(const Recording *recording, Status *status);

// Returns the type of a RecordingEvent; the caller closes it.
hid_t recording_event_type(void);
// The same of a RecordingLedger, and of a RecordingMap.
hid_t recording_ledger_type(void);
hid_t recording_map_type(void);

// --- reading, in the child that may crash --------------------------------------------------------

enum {
    RECORDING_FRAMES_MOST = 1 << 23, // of a body: 38 hours at 60 Hz
    RECORDING_MAPS_MOST = 1 << 18,   // of a body and kind: 7 hours at 10 Hz
};

// Rows of a complete frame.
typedef struct FrameRow {
    double time; // [s]
    int64_t step, first;
    int count, topology; // index in RecordingIndex
} FrameRow;

// Where the data of one body are: only rows that exist.
typedef struct RecordingIndex {
    bool frames_wanted;     // else `frame` stays empty
    TopologyRows *topology; // [topology_count]
    int topology_count;
    FrameRow *frame; // [frame_count], times rise; others are not indexed
    int64_t frame_count, frame_capacity;
    RecordingMap *map[RECORDING_MAPS]; // [map_count] each, times do not fall
    int64_t map_count[RECORDING_MAPS];
    int64_t nodes_told; // rows of node_origin, node_parent and node_level, which older files lack
    int64_t look_rows;  // of colours; 0: none
    int64_t first_wall; // slot of the first triangle on a wall of cuts; 0: none, or not known
} RecordingIndex;

void recording_index_free(RecordingIndex *index);

// Opens a file of a killed writer, or one that still grows, as its readers do.
bool recording_open_any(HdfFile *file, const char *path, Status *status);
// Reads and checks everything but the data; index: [RECORDING_INFO_BODIES], or NULL.
bool recording_read_contents(const HdfFile *file, RecordingInfo *info, RecordingIndex *index);
// Reads rows of a data set of so many columns (0: one dimension).
bool recording_read_rows(const HdfFile *file, const char *name, hid_t type, int columns,
                         int64_t first, int rows, void *to);
// Checks what came from the child: counts are inside the arrays, texts end.
void recording_info_tidy(RecordingInfo *info);
#endif

#endif
