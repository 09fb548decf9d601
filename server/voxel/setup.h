// What voxel bodies are made with alike, whether they can be cut or not; load time only.
#ifndef PLIANT_VOXEL_SETUP_H
#define PLIANT_VOXEL_SETUP_H

#include "voxel/vertices.h"

// Elements: with fewer, calling another thread costs more than it saves.
enum { SETUP_HALVED_LEAST = 2000 };

// False: no kernels for options->isa, or an initial state of another number of vertices.
bool setup_check(const VoxelOptions *options, bool has_kernels, int vertices, Status *status);
// The vertex that a scene holds by its id; -1 with a status: it is none of the body's.
int setup_held_vertex(const VertexId *by_id, int vertices, int id, Status *status);
// A body with what the options say of it; the rest is zero.
Body setup_body(const VoxelOptions *options, const BodyOps *ops, void *model);
// Rows of a body in space, at rest, then vertices_create: after vertices->count, capacity, kernels,
// mass and id. `point` [count] in cells; `elements` decide whether the forces are halved.
void setup_vertices(Vertices *vertices, const VoxelOptions *options, const int (*point)[3],
                    const VertexId *by_id, const bool *fixed, int elements, int loadable_count,
                    Arena *arena, StateList *state);
// The frame that a floating body in space is followed by, weighted by the masses as they are now.
void setup_frame(Vertices *vertices, const char *name, Arena *arena, StateList *state);

#endif
