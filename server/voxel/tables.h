// Rest shapes in the precision of the kernels. Load time.
#ifndef PLIANT_VOXEL_TABLES_H
#define PLIANT_VOXEL_TABLES_H

#include "voxel/batch.h"

// Creates VoxelPass.tables: one table per template, then one per mixed batch; owned by the arena.
// For Miyazaki's law weights are 1, X is relative to the mean of the present vertices, and A = sum
// r_i X_i^T, scaled to a trace of 3 at rest, takes the role of F.
const RestTable *voxel_tables_create(const Batches *batches, VoxelLaw law, Precision precision,
                                     const char *name, Arena *arena);

// Writes the table of one template, not mixed: Real [TABLE_HEAD], then [shape->count][TABLE_ROW].
// Does not allocate: safe on the step thread.
void voxel_table_put(void *number, const Template *shape, VoxelLaw law, Precision precision);

#endif
