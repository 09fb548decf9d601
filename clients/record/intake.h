// SPDX-License-Identifier: MIT
// Turns raw messages of a daemon into items of recordings: assembles frames, matches each with the
// mesh of its topology, bounds the memory of waiting frames, counts what is missing. One thread;
// uses neither network nor files.
#ifndef PLIANT_CLIENTS_RECORD_INTAKE_H
#define PLIANT_CLIENTS_RECORD_INTAKE_H

#include "frames.h"
#include "gather.h"
#include "writer.h"

enum {
    INTAKE_EVENTS_WAITING = 64, // until the file begins
    INTAKE_FILES = 100,         // a restarted daemon begins another
};

typedef struct IntakeBody {
    NodesFrame nodes;
    MeshFrame mesh;
    // the newest valid mesh, without its free slots, if `mapped`
    RecordingMesh map;
    RecordingTopology topology; // points into `map`
    int slots, triangle_slots, node_capacity, triangle_capacity;
    bool mapped;
    int told;       // the newest topology in the file; 0: none
    int file_index; // -1: not in the file
    bool any;       // a complete frame has arrived
    int32_t sequence;
    int64_t step; // of the newest complete frame
    double time;  // of the newest frame taken [s]
    bool taken;
    Waiting waiting; // for its mesh, or until the file begins
    LookFrame look;
    ErrorMapFrame error_map;
    ElementsFrame elements;
    int64_t map_step[RECORDING_MAPS]; // of the last ones in the file; -1: none
    unsigned char *map_room;          // RECORDING_MAP_ROOM for each slot
    RecordingColours colours;         // that the file has
    int colour_capacity;
    int64_t mesh_refused, refused_before; // invalid meshes; all of them before this file
    RecordingCounts counts;
} IntakeBody;

typedef struct IntakeOptions {
    const char *prefix, *input_prefix;
    const char *path;
    bool overwrite;
    double hz;    // frames per simulated second at most; 0: all
    double still; // [m] as in RecordingOptions
    QueueWhenFull when_full;
    bool survey_only; // only surveys the daemon, makes no items
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
    RecordingLedger ledger[LEDGER_LINES]; // the newest, which a file begins with
    int ledger_count;
    int64_t errors_step; // of the last ones in the file; -1: none
    bool open;           // a file has begun
    int files;           // begun so far
    int restarts;        // of the daemon
    int bodies;          // in the file
    char *path;          // of the newest file
    bool wants_mesh;     // a mesh was missed: DESCRIBE requests it
    int64_t mesh_chunks; // received: one may be in transit
    Status status;
} Intake;

// `intake` is large: not for the stack. The options' pointers must outlive it.
void intake_create(Intake *intake, const IntakeOptions *options, Queue *queue);
void intake_destroy(Intake *intake);

// Takes one message. Ignores channels that a recording does not use.
void intake_take(Intake *intake, const char *channel, const void *data, size_t size);
// Begins a file as soon as the daemon is known. `patient`: its status and description may still
// arrive. Returns false if recording cannot go on; `status` says why.
bool intake_begin(Intake *intake, bool patient);
// Ends the current file: frames that still wait for their mesh count as without one.
void intake_end(Intake *intake);

// Returns what is missing so far, over all bodies of the current file.
RecordingCounts intake_counts(const Intake *intake);
// Returns "NAME.2.h5" for the second file of "NAME.h5"; the caller frees it.
char *intake_path(const char *path, int number);

#endif
