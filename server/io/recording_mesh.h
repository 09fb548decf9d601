// Converts meshes in slots, as in bodies and messages, to the form of a recording, which has no
// free slots: its nodes are the live ones in the order of their slots. Plain data that allocates
// nothing, so that the daemon and any receiver of its messages write the same.
#ifndef PLIANT_IO_RECORDING_MESH_H
#define PLIANT_IO_RECORDING_MESH_H

#include "io/recording.h"

// A free node slot has id -1, a free triangle has equal first corners.
typedef struct RecordingSlots {
    int topology;
    int node_count, triangle_count; // slots
    const int *id;                  // [node_count]
    const int (*triangle)[3];       // slots
} RecordingSlots;

// A body's newest mesh. The caller owns the arrays.
typedef struct RecordingMesh {
    int topology; // written last
    int live_count;
    int *live;          // [node_capacity] slots
    int *row;           // [node_capacity] row in the file by slot; live slots only
    int *id;            // [node_capacity] of live nodes
    int (*triangle)[3]; // [triangle_capacity] rows
} RecordingMesh;

// Returns the mesh without its free slots; the result points into `to`.
RecordingTopology recording_mesh_take(RecordingMesh *to, const RecordingSlots *slots);

// Copies the positions of live nodes out of those of all slots; `to`: [3 live_count].
void recording_mesh_positions(const RecordingMesh *mesh, const float *slots, float *to);

#endif
