// Takes raw messages of a daemon and makes the items of recordings of them: assembles frames, gives
// each the mesh of its topology, bounds what waits, counts what is missing. One thread; knows
// neither network nor file.
#ifndef PLIANT_CLIENTS_RECORD_INTAKE_H
#define PLIANT_CLIENTS_RECORD_INTAKE_H

#include "frames.h"
#include "gather.h"
#include "queue.h"
#include "waiting.h"

enum {
    INTAKE_EVENTS_WAITING = 64, // for the file to begin
    INTAKE_FILES = 100,         // a daemon that starts anew begins another
};

typedef struct IntakeBody {
    NodesFrame nodes;
    MeshFrame mesh;
    // the newest sound mesh, without its free slots, if `mapped`
    RecordingMesh map;
    RecordingTopology topology; // points into `map`
    int slots, triangle_slots, node_capacity, triangle_capacity;
    bool mapped;
    int told;       // the newest topology that is in the file; 0: none
    int file_index; // -1: not in the file
    bool any;       // a whole frame has come
    int32_t sequence;
    int64_t step; // of the newest whole frame
    double time;  // of the newest frame taken [s]
    bool taken;
    Waiting waiting;                      // for its mesh, or for the file to begin
    int64_t mesh_refused, refused_before; // meshes that are not sound; all before this file
    RecordingCounts counts;
} IntakeBody;

typedef struct IntakeOptions {
    const char *prefix, *input_prefix;
    const char *path;
    bool overwrite;
    double hz; // at most so many frames a simulated second; 0: all
    QueueWhenFull when_full;
    bool survey_only; // makes nothing of it, finds out only what there is
} IntakeOptions;

typedef struct Intake {
    IntakeOptions options;
    Queue *queue;
    Survey survey;
    IntakeBody body[ITEM_BODIES];
    GatherTool tool[ITEM_TOOLS]; // as in the survey
    int tool_index[ITEM_TOOLS];  // in the file; -1: not in it
    RecordingEvent event[INTAKE_EVENTS_WAITING];
    int events_waiting;
    int64_t events_lost;
    bool open;           // a file has begun
    int files;           // begun so far
    int restarts;        // of the daemon
    int bodies;          // in the file
    char *path;          // of the newest file
    bool wants_mesh;     // one was missed: DESCRIBE would bring it
    int64_t mesh_chunks; // that came: one may be under way
    Status status;
} Intake;

// `intake` is large: not for the stack. What the options point to must outlive it.
void intake_create(Intake *intake, const IntakeOptions *options, Queue *queue);
void intake_destroy(Intake *intake);

// One message. Channels that mean nothing to a recording are left alone.
void intake_take(Intake *intake, const char *channel, const void *data, size_t size);
// Begins a file as soon as the daemon is known. `patient`: its status and description may still
// come. False once recording cannot go on; `status` says why.
bool intake_begin(Intake *intake, bool patient);
// Ends the file under way: what still waits for its mesh counts as without one.
void intake_end(Intake *intake);

// What is missing so far, of all bodies of the file under way.
RecordingCounts intake_counts(const Intake *intake);
// "NAME.2.h5" for the second file of "NAME.h5"; malloc'ed.
char *intake_path(const char *path, int number);

#endif
