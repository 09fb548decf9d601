// Meshes in slots, as bodies keep them and messages carry them, turned into what a recording holds:
// a recording has no free slots, its nodes are the live ones in the order of their slots. Plain
// data and no memory of its own, so that the daemon and whoever receives its messages write the
// same.
#ifndef PLIANT_FILES_RECORDING_MESH_H
#define PLIANT_FILES_RECORDING_MESH_H

#include "files/recording.h"

// A free node slot has id -1, a free triangle has equal first corners.
typedef struct RecordingSlots {
    int topology;
    int node_count, triangle_count; // slots
    const int *id;                  // [node_count]
    const int (*triangle)[3];       // slots
} RecordingSlots;

// What is known of a body's newest mesh. The arrays are the caller's.
typedef struct RecordingMesh {
    int topology; // written last
    int live_count;
    int *live;          // [node_capacity] slots
    int *row;           // [node_capacity] of the file by slot; of live ones only
    int *id;            // [node_capacity] of live nodes
    int (*triangle)[3]; // [triangle_capacity] rows
} RecordingMesh;

// The mesh without its free slots. What is returned points into `to`.
RecordingTopology recording_mesh_take(RecordingMesh *to, const RecordingSlots *slots);

// The positions of live nodes, of those in all slots; `to`: [3 live_count].
void recording_mesh_positions(const RecordingMesh *mesh, const float *slots, float *to);

#endif
