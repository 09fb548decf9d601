// SPDX-License-Identifier: MIT
// The files thread writes checkpoint images and recorded frames that the step thread has copied,
// and the log of applied inputs. It runs only if one of them is enabled, and never touches the
// simulation.
#ifndef PLIANT_RUN_FILES_THREAD_H
#define PLIANT_RUN_FILES_THREAD_H

#include "io/recording.h"
#include "run/exchange.h"
#include "run/input_log.h"
#include "run/ledger.h"
#include "scene/build.h"
#include "scene/scene.h"

#include <pthread.h>

// --- recordings ----------------------------------------------------------------------------------

// Recording of a running scene (--record): the copies that the step thread makes for each frame,
// and how they are written to the file. The step thread calls record_…; load time and then the
// files thread, or the thread of an offline run, call recorder_….

typedef struct RecordTool {
    int64_t active; // 0 or 1: withdrawn tools are not recorded
    RecordingTool sample;
} RecordTool;

// One frame of all bodies and tools.
struct RecordFrame {
    int64_t step;
    double time;       // [s]
    RecordTool tool[]; // [tool_count], then a RecordBody for every body
};

// The next body follows the positions.
typedef struct RecordBody {
    int topology, node_count; // slots
    int row_count;            // rows that nodes follow from (BodyMesh.fit)
    float position[];         // [3 row_count], m
} RecordBody;

// Returns the bytes of a frame without its bodies.
size_t record_tools_bytes(Sim *sim);
// Returns the bytes of the largest frame of this scene.
size_t record_frame_bytes(Sim *sim);
// Returns space for a frame, after it has handed over the meshes that changed since the last one.
// NULL: no space for the frame or for a mesh.
RecordFrame *record_find_room(Exchange *exchange, Sim *sim);
// Copies all but the bodies and returns where the first body belongs; call between two ticks. No
// allocation, no system call.
RecordBody *record_frame_begin(RecordFrame *frame, Sim *sim);
// Copies one body, whose positions are given; returns where the next one belongs.
RecordBody *record_body(RecordBody *to, const Body *body, const float *position);
// Copies a whole frame.
void record_frame_take(RecordFrame *frame, Sim *sim);

// The recorder's state of a body whose mesh changes.
typedef struct RecorderMesh {
    RecordingMesh mesh;
    float *position; // [3 node_capacity] of live nodes
    // Of a fitted mesh, else NULL:
    MeshCopy *copy; // if it changes
    float *node;    // [3 node_capacity] all nodes
    double *scratch;
    struct RecorderLook *look; // of a body with colours, else NULL
    bool has_map[RECORDING_MAPS];
    unsigned char *map; // of live slots; NULL: no map is recorded
} RecorderMesh;

// recorder_look.c: the colours of a body.
struct RecorderLook *recorder_look_reserve(const Body *body, Arena *arena);
// Returns the rows of a mesh that the file does not have.
RecordingLook recorder_look_take(struct RecorderLook *to, const Body *body, const BodyMesh *mesh,
                                 const RestCopy *rest);

typedef struct Recorder {
    Recording *recording;
    Sim *sim;           // only its constant members are read
    RecorderMesh *mesh; // [body_count]; zero where the mesh never changes
    int64_t frames;     // written
    // Set before recorder_create, which reads them.
    bool tools_apart;     // tools come by recorder_write_tools
    const char *describe; // the answer to DESCRIBE; NULL: the file has none
} Recorder;

// Allocates from the world's arena at load time. The recorder is zero before, except for the
// members that are set before.
void recorder_reserve(Recorder *recorder, World *world);
// The same for the maps that the exchange has rings for.
void recorder_reserve_maps(Recorder *recorder, const Exchange *exchange, World *world);
// Creates the files (recording_create) and describes the bodies in them. Calls recorder_reserve if
// that has not been done.
bool recorder_create(Recorder *recorder, const char *path, World *world, const Scene *scene,
                     Status *status);
// Writes the mesh of the frames that follow, if it changed. This and the next five functions return
// false from the first failure on; recording_status names it.
// `rest`: its rest positions where its colours follow from them; NULL: those of the body, which
// nobody steps meanwhile.
bool recorder_follow_mesh(Recorder *recorder, int body, const BodyMesh *mesh, const RestCopy *rest);
// Writes the meshes that were handed over before the frame.
bool recorder_take_meshes(Recorder *recorder, Exchange *exchange, const RecordFrame *frame);
// Writes the maps up to a step that are of the meshes of the newest frames. Others are dropped if
// `last`, else wait for their mesh.
bool recorder_take_maps(Recorder *recorder, Exchange *exchange, int64_t step, bool last);
bool recorder_write_frame(Recorder *recorder, const RecordFrame *frame);
// Writes a row for each active tool; the frame may have no bodies.
bool recorder_write_tools(Recorder *recorder, const RecordFrame *frame);
bool recorder_write_event(Recorder *recorder, const EventOut *event);
// Sets the number of dropped frames that the file reports.
void recorder_set_dropped(Recorder *recorder, int64_t frames);
// Calls recording_close; does nothing without a recording.
bool recorder_close(Recorder *recorder, Status *status);

// --- the thread ----------------------------------------------------------------------------------

typedef struct FilesThread {
    // constant while the thread runs
    const World *world;
    const Scene *scene;
    Exchange *exchange;
    InputLogWriter *log; // or NULL; destroyed by files_thread_finish
    Recorder *recorder;  // or NULL; closed by files_thread_close
    // used by the thread alone
    OutputClaim checkpoint; // claimed by the owner before the start and released after the end
    int look_ms;            // pause between two iterations [ms]
    int64_t step;           // of the newest frame
    bool recording_failed, log_failed;
    bool retries; // the last image was refused, and the next tick's is awaited
    int64_t lost_reported, lost_reported_ns, inputs_lacking;
    // results
    int64_t checkpoints;
    Status status; // of the newest checkpoint, or of the log
    pthread_t thread;
    atomic_bool finish;
    bool running;
} FilesThread;

// Starts the thread. Everything but `log` and `recorder` outlives it.
bool files_thread_start(FilesThread *files, Status *status);
// Writes what is left and ends the thread; call after the step thread has ended. `step`: ticks
// completed. Returns false with files->status if a file is incomplete.
bool files_thread_finish(FilesThread *files, int64_t step);
// Records the last events of the bus and closes the recording; call after the bus thread has ended
// too. Returns false with `status` if the recording is incomplete.
bool files_thread_close(FilesThread *files, Status *status);

#endif
