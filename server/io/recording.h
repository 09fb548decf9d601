// SPDX-License-Identifier: MIT
// Recordings (README.md, "What HDF5 does"): the node positions of every body, frame by frame, in an
// HDF5 file that can be read while it grows and after its writer was killed, with an XDMF sidecar
// that ParaView opens. Called by the files thread or offline, by one thread at a time. Independent
// of threads, messages and the simulation, so that any receiver of frames can write them too.
#ifndef PLIANT_IO_RECORDING_H
#define PLIANT_IO_RECORDING_H

#include "base/check.h"
#include "base/mesh_columns.h"
#include "base/vec.h"

#include <stdint.h>
#include <stdio.h>

enum { RECORDING_BODY_TEXT = 32, RECORDING_KIND_TEXT = 16, RECORDING_EVENT_TEXT = 192 };
enum { RECORDING_LEDGER_NAME = 64, RECORDING_LEDGER_VALUES = 6 };

// Numbers at a body's mesh as of one step: the error around each node (lcmtypes/error_map_t.lcm),
// or the element at each triangle (lcmtypes/elements_t.lcm; both of a square have its element).
typedef enum RecordingMapKind {
    RECORDING_ERROR_MAP, // columns: share, uint8_t
    RECORDING_ELEMENTS,  // tag, int16_t, and level, uint8_t
    RECORDING_MAPS,
} RecordingMapKind;
enum { RECORDING_MAP_LEVELS = 8, RECORDING_MAP_COLUMNS = 2 };

typedef struct RecordingMap {
    double time;                            // simulated [s]
    int64_t step, first;                    // first: row of its columns in the file
    int32_t topology, count;                // rows: nodes or triangles of that mesh
    int32_t elements[RECORDING_MAP_LEVELS]; // of the body: how many are 1, 2, 4, ... cells wide
} RecordingMap;

typedef struct RecordingBody {
    const char *name;     // unique
    int nodes, triangles; // in its first topology: chunk size of HDF5
    int first_wall; // triangles of a mesh from this one on are walls of cuts; 0: none, or unknown
    bool coloured;  // recording_add_look may follow
    bool has_map[RECORDING_MAPS]; // recording_add_map may follow
} RecordingBody;

typedef struct RecordingOptions {
    const char *scene;      // its text
    const char *describe;   // the daemon's description of it, as DESCRIBE answers; NULL: none
    const char *created_by; // program and version
    int body_count, tool_count;
    const RecordingBody *body;
    const int *tool; // ids, unique
    bool overwrite;  // replaces an existing HDF5 file
    double still; // [m] a frame shares the body's last rows if no coordinate is farther from them
} RecordingOptions;

// Frames and messages of a body that are missing in the file, by cause.
typedef struct RecordingCounts {
    int64_t lost;         // frames that did not arrive whole
    int64_t dropped;      // frames dropped because the disk was too slow
    int64_t without_mesh; // frames whose mesh did not come in time
    int64_t refused;      // messages that no daemon of ours sends
} RecordingCounts;

// The mesh of all frames with its number.
typedef struct RecordingTopology {
    int number;
    int node_count, triangle_count;
    const int *node_id; // by slot; stays with a node for its life
    // As in mesh_t, node_origin, node_parent and node_level; NULL, in all topologies of a recording
    // or in none: not known.
#define RECORDING_LATER_ROWS(name, type, width, of, empty, sent, recorded)                         \
    MESH_IF_LATER(recorded, MESH_ROWS_##width(const type, node_##name);)
    MESH_COLUMNS(RECORDING_LATER_ROWS)
    const int (*triangle)[3];
} RecordingTopology;

// Colours of nodes by their ids: red, green and blue of the outside, then of walls of cuts, 0 to
// 255 of sRGB. A row holds from its topology on, until another one of the id.
enum { RECORDING_COLOURS = 6, RECORDING_OF_BODY = -1 };
typedef struct RecordingLook {
    int topology, count;
    const int *id; // RECORDING_OF_BODY: of all nodes without a row
    const unsigned char (*colour)[RECORDING_COLOURS];
} RecordingLook;

typedef struct RecordingFrame {
    int64_t step;
    double time; // simulated [s]
    int topology;
    int node_count;
    const float *position; // [3 node_count], m
} RecordingFrame;

typedef struct RecordingTool {
    Vec3 position; // [m]
    Quat orientation;
    Vec3 force; // on the tool [N]
} RecordingTool;

typedef struct RecordingEvent {
    double time; // simulated [s]
    int64_t step;
    char body[RECORDING_BODY_TEXT]; // "": none in particular
    char kind[RECORDING_KIND_TEXT];
    char text[RECORDING_EVENT_TEXT];
} RecordingEvent;

// A line of the ledger (lcmtypes/ledger_t.lcm): of a body, of one of its tissues or of a region.
// Lines of one step are one ledger; a later one replaces it.
typedef enum LedgerLine { LEDGER_BODY, LEDGER_TISSUE, LEDGER_REGION } LedgerLine;

typedef struct RecordingLedger {
    double time; // simulated [s]
    int64_t step;
    int32_t line; // LedgerLine
    int32_t flag; // of a region: LEDGER_KEEP, LEDGER_TOUCHED; of a body LEDGER_SOLID
    char body[RECORDING_BODY_TEXT];   // of a region the one that came nearest; "": none
    char name[RECORDING_LEDGER_NAME]; // of the tissue or region
    char by[RECORDING_KIND_TEXT];     // of a region: what came nearest
    double value[RECORDING_LEDGER_VALUES];
} RecordingLedger;

// Most of each, so that a ledger fits a datagram.
enum { LEDGER_BODIES = 64, LEDGER_TISSUES = 200, LEDGER_REGIONS = 16 };
enum { LEDGER_LINES = LEDGER_BODIES + LEDGER_TISSUES + LEDGER_REGIONS };
enum { LEDGER_KEEP = 1, LEDGER_TOUCHED = 2, LEDGER_SOLID = 4 };
// Their values: areas [m2] of a body; of a tissue [kg/m3 or kg/m2], [m3 or m2]; of a region [m].
enum { LEDGER_CUT, LEDGER_TORN };
enum {
    LEDGER_DENSITY,
    LEDGER_AT_LOAD,
    LEDGER_ATTACHED,
    LEDGER_CUT_OFF,
    LEDGER_REMOVED,
    LEDGER_COAGULATED,
};
// Distance -1: nothing was cut or removed; time [s].
enum { LEDGER_MARGIN, LEDGER_DISTANCE, LEDGER_TIME };

// Lines of errors (lcmtypes/error_t.lcm) have the form of those of the ledger: of a body, or of a
// tool, whose number is the flag. Those of one step belong together.
typedef enum ErrorLine { ERRORS_BODY, ERRORS_TOOL } ErrorLine;
enum { ERRORS_BODIES = 64, ERRORS_TOOLS = 32, ERRORS_LINES = ERRORS_BODIES + ERRORS_TOOLS };
// Their values: of a body [m], [m], [m], share, [ticks]; of a tool [N], [N], share. -1: unknown.
enum { ERRORS_SPACE, ERRORS_STEPS, ERRORS_TOTAL, ERRORS_RELATIVE, ERRORS_AGE };
enum { ERRORS_FORCE, ERRORS_ERROR, ERRORS_SHARE };

// The lists of such lines. Those of one ledger, or of the errors of one step, are behind each
// other, bodies first.
typedef enum RecordingList { RECORDING_LEDGERS, RECORDING_ERRORS, RECORDING_LISTS } RecordingList;

typedef struct Recording Recording;

// Checks that FILE can be recorded to, before there is data: creates it if it does not exist and
// else leaves it unchanged. Returns false with `status` (STATUS_INVALID).
bool recording_claim(const char *path, bool overwrite, Status *status);

// Creates FILE with every data set, and FILE.xdmf. Refuses an existing file unless it is empty or
// may be overwritten; replaces a sidecar. Returns NULL with `status` (STATUS_INVALID), and leaves
// no file, on failure.
Recording *recording_create(const char *path, const RecordingOptions *options, Status *status);

// Each appends; bodies and tools by their index in the options. Returns false from the first
// failure on. A full disk leaves the file complete; any other failure leaves it as of its last
// flush.
bool recording_add_topology(Recording *recording, int body, const RecordingTopology *topology);
// Of a body that is `coloured`.
bool recording_add_look(Recording *recording, int body, const RecordingLook *look);
// Of a body that has maps of the kind; the map's topology must have been added, times must not
// fall. `column`: as many as the kind has, of `count` rows; `first` is ignored.
bool recording_add_map(Recording *recording, int body, RecordingMapKind kind,
                       const RecordingMap *map, const void *const column[]);
// The frame's topology must have been added. A body that stands still is stored once: its frames
// have the same `first`.
bool recording_add_frame(Recording *recording, int body, const RecordingFrame *frame);
bool recording_add_tool(Recording *recording, int tool, double time, const RecordingTool *sample);
bool recording_add_event(Recording *recording, const RecordingEvent *event);
bool recording_add_lines(Recording *recording, RecordingList list, const RecordingLedger *line,
                         int count);

// Sets the counts that the file reports for a body once it is closed.
void recording_set_counts(Recording *recording, int body, const RecordingCounts *counts);

// Hands everything to the operating system: from now on it survives the end of this program. The
// sidecar follows immediately in the first minutes; later it lags by a sixteenth of the frames at
// most, because it must be rewritten as a whole.
bool recording_flush(Recording *recording);
// Flushes if the last flush was a second ago or more; now_ns: of any monotonic clock.
bool recording_flush_if_due(Recording *recording, int64_t now_ns);
// Returns the first failure, or STATUS_OK.
const Status *recording_status(const Recording *recording);

// Flushes, updates the sidecar, marks the file as ended, closes and frees. Returns false with
// `status` if not everything was written.
bool recording_close(Recording *recording, Status *status);

// --- the contents of a file ----------------------------------------------------------------------

// Describes a recording, from the file as it is: ended, being written, or left by a
// writer that was killed. Checks every index and reports only data that exists.

typedef struct RecordingBodyInfo {
    char name[RECORDING_BODY_TEXT];
    int64_t frames; // complete frames
    int64_t broken; // begun but incomplete
    int64_t first_step, last_step;
    double first_time, last_time; // [s]
    int64_t topologies;
    int least_nodes, most_nodes;  // of a frame
    int64_t maps[RECORDING_MAPS]; // complete ones; older files have none
    RecordingCounts counts;       // of a file that was ended
} RecordingBodyInfo;

typedef struct RecordingToolInfo {
    char name[16]; // its id
    int64_t rows;
} RecordingToolInfo;

typedef struct RecordingKindInfo {
    char kind[RECORDING_KIND_TEXT];
    int64_t events;
} RecordingKindInfo;

enum { RECORDING_INFO_BODIES = 64, RECORDING_INFO_TOOLS = 32, RECORDING_INFO_KINDS = 64 };

typedef struct RecordingInfo {
    char created_by[64];
    bool ended; // cleanly; false: being written, or its writer was killed
    int body_count, tool_count, kind_count;
    RecordingBodyInfo body[RECORDING_INFO_BODIES];
    RecordingToolInfo tool[RECORDING_INFO_TOOLS];
    RecordingKindInfo kind[RECORDING_INFO_KINDS];
    int64_t events;
    int64_t lines[RECORDING_LISTS]; // older files have none
} RecordingInfo;

// Returns false with `status` (STATUS_INVALID) if it is not a recording, or which part is damaged.
bool recording_info_read(const char *path, RecordingInfo *info, Status *status);

void recording_info_print(const RecordingInfo *info, FILE *out);

// --- meshes --------------------------------------------------------------------------------------

// Meshes in slots, as in bodies and messages, in the form of a recording, which has no free slots:
// its nodes are the live ones in the order of their slots. Plain data that allocates nothing, so
// that the daemon and any receiver of its messages write the same.

// A free node slot has id -1, a free triangle has equal first corners.
typedef struct RecordingSlots {
    int topology;
    int node_count, triangle_count; // slots
    MESH_COLUMNS(MESH_READ_ROWS)
} RecordingSlots;

// A body's newest mesh. The caller owns the arrays.
typedef struct RecordingMesh {
    int topology; // written last
    int live_count, live_triangles;
    int *live;          // [node_capacity] slots; NULL: all are live
    int *live_triangle; // [triangle_capacity] slots
    int *row;           // [node_capacity] row in the file by slot; live slots only
    // Columns that are recorded, of live nodes and triangles, whose corners are rows.
#define RECORDING_ROWS(name, type, width, of, empty, sent, recorded)                               \
    MESH_IF_RECORDED(recorded, MESH_ROWS_##width(type, name);)
    MESH_COLUMNS(RECORDING_ROWS)
} RecordingMesh;

// Returns the mesh without its free slots; the result points into `to`.
RecordingTopology recording_mesh_take(RecordingMesh *to, const RecordingSlots *slots);

// The colours of a body that a file has, by slot; the arrays belong to the caller and have room for
// all slots, and one more row.
typedef struct RecordingColours {
    int slots;     // known
    int *known_id; // -1: none
    unsigned char (*known)[RECORDING_COLOURS];
    bool begun; // has the body's own
    // rows for the file
    int *id;
    unsigned char (*colour)[RECORDING_COLOURS];
} RecordingColours;

// Returns the rows that a look adds to what the file has; they are in `to`. `own`: the colours of
// the body; `outside`, `inside`: of its slots, whose ids are `id`; node_count 0: none has any.
RecordingLook recording_colours_take(RecordingColours *to, int topology,
                                     const unsigned char own[RECORDING_COLOURS], int node_count,
                                     const int *id, const unsigned char (*outside)[3],
                                     const unsigned char (*inside)[3]);

// Copies the positions of live nodes out of those of all slots; `to`: [3 live_count].
void recording_mesh_positions(const RecordingMesh *mesh, const float *slots, float *to);

// Turns columns of all nodes or squares, `map->count`, into those of the live nodes or triangles;
// they point into `to`, of RECORDING_MAP_ROOM bytes for each slot of a node or triangle.
enum { RECORDING_MAP_ROOM = 4 };
void recording_mesh_map(const RecordingMesh *mesh, RecordingMapKind kind, RecordingMap *map,
                        const void *column[RECORDING_MAP_COLUMNS], unsigned char *to);

#endif
