// What the kernels need of each template's rest shape, as numbers of their precision. Load time.
#ifndef PLIANT_VOXEL_TABLES_H
#define PLIANT_VOXEL_TABLES_H

#include "base/arena.h"
#include "voxel/kernel.h"
#include "voxel/template.h"

// [count], in the order of `templates`; owned by the arena. Miyazaki's law has unit weights, X from
// the mean of the vertices that are present, and its A = sum r_i X_i^T scaled such that A at rest
// has the trace 3, in the place of F.
const TemplateTable *voxel_tables_create(const Template *templates, int count, VoxelLaw law,
                                         Precision precision, const char *name, Arena *arena);

#endif
