// Creation steps that cuttable and other voxel bodies share; load time only.
#ifndef PLIANT_VOXEL_SETUP_H
#define PLIANT_VOXEL_SETUP_H

#include "voxel/vertices.h"

// Least number of elements for two threads: with fewer, calling a thread costs more than it saves.
enum { SETUP_HALVED_LEAST = 2000 };

// False with `status`: no kernels for options->isa, or an initial state with another number of
// vertices.
bool setup_check(const VoxelOptions *options, bool has_kernels, int vertices, Status *status);
// Returns the vertex that a scene fixes by its id; -1 with a status if the body has no such vertex.
int setup_held_vertex(const VertexId *by_id, int vertices, int id, Status *status);
// Marks the vertices that the options fix, in `fixed` [vertices]; `place` returns the rest position
// of a vertex of `mesh`. False with a status.
typedef Vec3 SetupPlace(const Lattice *lattice, const void *mesh, int vertex);
bool setup_fixed(const VoxelOptions *options, const VertexId *by_id, int vertices,
                 SetupPlace *place, const void *mesh, bool *fixed, Status *status);
// Creates the rows of a body in space, at rest, then calls vertices_create; requires
// vertices->count, capacity, kernels, mass and id. `point` [count] in cells; the number of
// `elements` decides whether the forces are halved.
void setup_vertices(Vertices *vertices, const VoxelOptions *options, const int (*point)[3],
                    const VertexId *by_id, const bool *fixed, int elements, int loadable_count,
                    Arena *arena, StateList *state);
// Creates the frame that follows a floating body in space, weighted by the current masses.
void setup_frame(Vertices *vertices, const char *name, Arena *arena, StateList *state);

#endif
