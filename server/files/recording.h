// Recordings (design: files): where the nodes of every body were, frame by frame, in an HDF5 file
// that can be read while it grows and after its writer was killed, with an XDMF sidecar beside it
// that ParaView opens. Called by the files thread or off line, one thread at a time; knows no
// thread, no message and no simulation, so that whoever receives frames can write them too.
#ifndef PLIANT_FILES_RECORDING_H
#define PLIANT_FILES_RECORDING_H

#include "base/status.h"
#include "base/vec.h"

#include <stdint.h>

enum { RECORDING_BODY_TEXT = 32, RECORDING_KIND_TEXT = 16, RECORDING_EVENT_TEXT = 192 };

typedef struct RecordingBody {
    const char *name;     // unique
    int nodes, triangles; // of its first topology: what HDF5 keeps together
} RecordingBody;

typedef struct RecordingOptions {
    const char *scene;      // its text
    const char *created_by; // program and version
    int body_count, tool_count;
    const RecordingBody *body;
    const int *tool; // ids, unique
    bool overwrite;  // replaces an HDF5 file that is there
} RecordingOptions;

// Frames and messages of a body that are not in the file, and why.
typedef struct RecordingCounts {
    int64_t lost;         // frames that did not arrive whole
    int64_t dropped;      // frames, the disk was too slow
    int64_t without_mesh; // frames whose mesh did not come in time
    int64_t refused;      // messages that no daemon of ours sends
} RecordingCounts;

// The mesh of all frames that carry its number.
typedef struct RecordingTopology {
    int number;
    int node_count, triangle_count;
    const int *node_id; // by slot; stays with a node for its life
    const int (*triangle)[3];
} RecordingTopology;

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

typedef struct Recording Recording;

// Whether FILE can be recorded to, before there is anything to record: it is made if it is not
// there, and stays as it is otherwise. False with `status` (STATUS_INVALID).
bool recording_claim(const char *path, bool overwrite, Status *status);

// Creates FILE with every data set, and FILE.xdmf. A file that is there already is refused unless
// it is empty or may be overwritten; a sidecar is replaced. NULL with `status` (STATUS_INVALID),
// and no file.
Recording *recording_create(const char *path, const RecordingOptions *options, Status *status);

// Each appends; bodies and tools by their index in the options. False from the first failure on: a
// full disk leaves the file whole, whatever else goes wrong leaves it as its last flush made it.
bool recording_add_topology(Recording *recording, int body, const RecordingTopology *topology);
// The frame's topology must have been added.
bool recording_add_frame(Recording *recording, int body, const RecordingFrame *frame);
bool recording_add_tool(Recording *recording, int tool, double time, const RecordingTool *sample);
bool recording_add_event(Recording *recording, const RecordingEvent *event);

// What the file will say of a body once it is closed.
void recording_set_counts(Recording *recording, int body, const RecordingCounts *counts);

// Hands everything to the operating system: it survives the end of this program from now on. The
// sidecar follows at once in the first minutes; later it lags behind by a sixteenth of the frames
// at most, because it can only be written as a whole.
bool recording_flush(Recording *recording);
// The same when the last flush was a second ago or more; now_ns: of any monotonic clock.
bool recording_flush_if_due(Recording *recording, int64_t now_ns);
// The first failure, or STATUS_OK.
const Status *recording_status(const Recording *recording);

// Flushes, brings the sidecar up to date, marks the file as ended, closes and frees. False with
// `status` if not everything was written.
bool recording_close(Recording *recording, Status *status);

#endif
