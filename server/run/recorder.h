// Recording of a running scene (--record): what the step thread copies for each frame, and how it
// gets into the file. record_frame_…: the step thread. The rest: load time, then the files
// thread, or whoever runs off line.
#ifndef PLIANT_RUN_RECORDER_H
#define PLIANT_RUN_RECORDER_H

#include "files/build.h"
#include "files/recording.h"
#include "run/exchange.h"

typedef struct RecordTool {
    int64_t active; // 0 or 1: withdrawn tools are not recorded
    RecordingTool sample;
} RecordTool;

// One frame of all bodies and tools.
struct RecordFrame {
    int64_t step;
    double time;       // [s]
    RecordTool tool[]; // [tool_count], then the float positions of every body
};

// Bytes of a frame of this scene.
size_t record_frame_bytes(Sim *sim);
// Between two ticks: copies all but the positions and returns where these belong, body after body,
// [node_count][3]. No allocation, no system call.
float *record_frame_begin(RecordFrame *frame, Sim *sim);
// The same with the positions.
void record_frame_take(RecordFrame *frame, Sim *sim);

typedef struct Recorder {
    Recording *recording;
    Sim *sim;       // only what is constant in it is read
    int64_t frames; // written
} Recorder;

// Creates the files (recording_create) and describes the bodies in them.
bool recorder_create(Recorder *recorder, const char *path, World *world, const Scene *scene,
                     Status *status);
// False from the first failure on; recording_status says which.
bool recorder_write_frame(Recorder *recorder, const RecordFrame *frame);
bool recorder_write_event(Recorder *recorder, const EventOut *event);
// recording_close; nothing to do without a recording.
bool recorder_close(Recorder *recorder, Status *status);

#endif
