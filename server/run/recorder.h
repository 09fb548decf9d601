// Recording of a running scene (--record): what the step thread copies for each frame, and how it
// gets into the file. record_…: the step thread. recorder_…: load time, then the files thread, or
// whoever runs off line.
#ifndef PLIANT_RUN_RECORDER_H
#define PLIANT_RUN_RECORDER_H

#include "files/build.h"
#include "files/recording_mesh.h"
#include "run/exchange.h"

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
    float position[];         // [3 node_count], m
} RecordBody;

// Most bytes of a frame of this scene.
size_t record_frame_bytes(Sim *sim);
// Room for a frame, after the meshes that changed since the last one were handed over; NULL: no
// room for it or for a mesh.
RecordFrame *record_find_room(Exchange *exchange, Sim *sim);
// Between two ticks: copies all but the bodies and returns where the first of them belongs. No
// allocation, no system call.
RecordBody *record_frame_begin(RecordFrame *frame, Sim *sim);
// Copies one body, whose positions are given; returns where the next one belongs.
RecordBody *record_body(RecordBody *to, const Body *body, const float *position);
// All of a frame.
void record_frame_take(RecordFrame *frame, Sim *sim);

// What a recorder knows of a body whose mesh changes.
typedef struct RecorderMesh {
    RecordingMesh mesh;
    float *position; // [3 node_capacity] of live nodes
} RecorderMesh;

typedef struct Recorder {
    Recording *recording;
    Sim *sim;           // only what is constant in it is read
    RecorderMesh *mesh; // [body_count]; zero where the mesh never changes
    int64_t frames;     // written
} Recorder;

// Load time: memory from the world's arena.
void recorder_reserve(Recorder *recorder, World *world);
// Creates the files (recording_create) and describes the bodies in them; reserves first, if nobody
// has.
bool recorder_create(Recorder *recorder, const char *path, World *world, const Scene *scene,
                     Status *status);
// Writes the mesh of the frames that follow, if it is another than before. Each returns false from
// the first failure on; recording_status says which.
bool recorder_follow_mesh(Recorder *recorder, int body, const BodyMesh *mesh);
// The meshes that were handed over before the frame.
bool recorder_take_meshes(Recorder *recorder, Exchange *exchange, const RecordFrame *frame);
bool recorder_write_frame(Recorder *recorder, const RecordFrame *frame);
bool recorder_write_event(Recorder *recorder, const EventOut *event);
// Frames that the file will say it lacks.
void recorder_set_dropped(Recorder *recorder, int64_t frames);
// recording_close; nothing to do without a recording.
bool recorder_close(Recorder *recorder, Status *status);

#endif
