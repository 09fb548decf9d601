// Creation steps that cuttable and other voxel bodies share; load time only.
#ifndef PLIANT_VOXEL_SETUP_H
#define PLIANT_VOXEL_SETUP_H

#include "dynamics/vertices.h"
#include "voxel/voxel.h"

// Least number of elements for two threads: with fewer, calling a thread costs more than it saves.
enum { SETUP_HALVED_LEAST = 2000 };

// Creates the rows of a body in space, at rest, then calls vertices_create; requires
// vertices->count, capacity, kernels, mass and id. `point` [count] in cells; the number of
// `elements` decides whether the forces are halved.
void setup_vertices(Vertices *vertices, const VoxelOptions *options, const int (*point)[3],
                    const VertexId *by_id, const bool *fixed, int elements, int loadable_count,
                    Arena *arena, StateList *state);
// Creates the frame that follows a floating body in space, weighted by the current masses.
void setup_frame(Vertices *vertices, const char *name, Arena *arena, StateList *state);

#endif
