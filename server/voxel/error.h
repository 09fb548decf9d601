// SPDX-License-Identifier: MIT
// The error of a voxel body's elements, estimated while it runs: how far their strains are from
// those that the elements around a vertex have on average (README.md, "Error of the elements").
// Step thread, except for the creation; does not allocate after that.
#ifndef PLIANT_VOXEL_ERROR_H
#define PLIANT_VOXEL_ERROR_H

#include "base/memory.h"
#include "body/error.h"

#include <stdbool.h>

// Load time; for bodies with BodyOptions.estimate_error. `capacity`: vertices. `state`: that of a
// driven body, or NULL.
struct VoxelError *voxel_error_create(int capacity, const char *name, Arena *arena,
                                      StateList *state);
// Call it after vertices were born (cut_lattice.h): what their rows have of others before them
// goes.
void voxel_error_follow(const void *self);
// True if the round under way is one that the body can have, after its state was restored.
bool voxel_error_check(const void *self);

// BodyOps.estimate and BodyOps.snapshot_error; false, and zeros, of a body without.
bool voxel_estimate(void *self, const ErrorQuestion *question, int budget, BodyError *out);
void voxel_snapshot_error(const void *self, int first, int end, unsigned char *share);

#endif
