// Rest shapes as numbers of the kernels' precision. Load time.
#ifndef PLIANT_VOXEL_TABLES_H
#define PLIANT_VOXEL_TABLES_H

#include "voxel/batch.h"

// What VoxelPass.tables wants: of each template, then of each mixed batch; owned by the arena.
// Miyazaki's law has unit weights, X from the mean of the vertices that are present, and its
// A = sum r_i X_i^T scaled such that A at rest has the trace 3, in the place of F.
const RestTable *voxel_tables_create(const Batches *batches, VoxelLaw law, Precision precision,
                                     const char *name, Arena *arena);

// The table of one template, not mixed: Real [TABLE_HEAD], then [shape->count][TABLE_ROW]. No
// allocation: fit for the step thread.
void voxel_table_put(void *number, const Template *shape, VoxelLaw law, Precision precision);

#endif
