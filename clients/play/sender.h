// SPDX-License-Identifier: MIT
// Publishes frames, meshes and tools of a timeline as the server does: in chunks below one
// datagram, spread over time, and a mesh before the first frame of its topology. One thread.
#ifndef PLIANT_PLAY_SENDER_H
#define PLIANT_PLAY_SENDER_H

#include "client.h"
#include "colours.h"
#include "timeline.h"

// The newest map of a kind that is of the mesh shown.
typedef struct SenderMap {
    char channel[CLIENT_CHANNEL_MAX];
    int part;       // of the timeline
    int64_t number; // in the part; -1: none
    RecordingMap map;
    unsigned char *row; // [RECORDING_MAP_ROOM nodes and triangles]
    int next, chunks;   // under way
    uint32_t sequence;
} SenderMap;

typedef struct SenderBody {
    char nodes_channel[CLIENT_CHANNEL_MAX], mesh_channel[CLIENT_CHANNEL_MAX];
    char walls_channel[CLIENT_CHANNEL_MAX], look_channel[CLIENT_CHANNEL_MAX];
    // the frame shown
    TimelineFrame at; // frame -1: none
    RecordingFrame frame;
    float *position; // [3 nodes], m
    // its mesh
    bool has_mesh;
    RecordingTopology mesh;
    int first_wall, pieces;
    MeshColumns column; // where it was not recorded: the ids themselves, level 0
    Colours colours;
    unsigned char *outside, *inside; // [3 nodes] of the mesh, if they vary
    SenderMap map[RECORDING_MAPS];
    // chunks under way: those of the look and the mesh first; next == chunks: none
    int look_chunks, mesh_next, mesh_chunks, nodes_next, nodes_chunks;
    bool repeats; // the mesh under way came before: nodes need not wait for it
    uint32_t mesh_sequence, nodes_sequence;
} SenderBody;

typedef struct Sender {
    Client *client;
    Timeline *timeline;
    SenderBody *body; // [timeline_bodies]
    int bodies;
    uint32_t pose_sequence, contact_sequence;
    char pose_channel[CLIENT_CHANNEL_MAX], contact_channel[CLIENT_CHANNEL_MAX];
    bool active[RECORDING_INFO_TOOLS]; // tools as last published
    int64_t due_ns;                    // of the next chunk
    int64_t frames, failed;            // frames shown; messages that LCM did not take
} Sender;

void sender_create(Sender *sender, Client *client, Timeline *timeline);
void sender_destroy(Sender *sender);

// Makes the frames at a time those that are shown; does nothing for bodies that have theirs.
// Returns false with `status` if the recording cannot be read.
bool sender_show(Sender *sender, double time, Status *status);
// Publishes meshes, or also frames, again for clients that join.
void sender_repeat(Sender *sender, bool frames);
// Publishes poses and forces of all tools at a time; tools that were withdrawn, once.
bool sender_tools(Sender *sender, double time, Status *status);

// Sends the chunk that is due; the next one is due after `interval_ns`.
void sender_send(Sender *sender, int64_t now_ns, int64_t interval_ns);
// Returns the chunks under way, of all bodies: of frames and their meshes, or with those of
// repeats.
int sender_waiting(const Sender *sender, bool with_repeats);
// Returns the ticks completed, and the time as recorded [s], of the newest frame shown.
int64_t sender_step(const Sender *sender, double *time);

#endif
