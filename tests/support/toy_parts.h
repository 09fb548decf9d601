// SPDX-License-Identifier: MIT
// The two topologies of a toy body, as toy_body.c uses them.
#ifndef PLIANT_TESTS_TOY_PARTS_H
#define PLIANT_TESTS_TOY_PARTS_H

#include "toy_body.h"

// An array of the body, which belongs to the arena.
#define TOY_ARRAY(count, pointer)                                                                  \
    ((pointer) = arena_allocate(arena, ARENA_STEP, (size_t)(count), sizeof *(pointer), "%s", name))

double toy_area(const Vec3 *position, const int corner[3]); // of a triangle
bool toy_is_active(const Toy *toy, int node);
// Lists faces around nodes, areas and masses of nodes from `face` and `face_area`, 0 in unused
// ones.
void toy_list_around(Toy *toy);
// Derives everything from the topology again.
void toy_rebuild(Body *body);

// toy_split.c
void toy_splits_create(Toy *toy, const char *name, const TriMesh *mesh, Arena *arena,
                       StateList *state);
void toy_splits_rebuild(Body *body);
bool toy_adapt(Body *body, int64_t step, double tick, TopologyChange *change);

// toy_cut.c
void toy_cuts_create(Toy *toy, const char *name, const TriMesh *mesh, const ToyOptions *options,
                     Arena *arena, StateList *state);
void toy_cuts_rebuild(Body *body);
bool toy_cut(Body *body, const CutSweep *asked, CutOutcome *outcome, TopologyChange *change);
bool toy_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change);
bool toy_reconstruct(Body *body, TopologyChange *change);
void toy_reserve_blades(void *self, int blades, Arena *arena, StateList *state);

#endif
