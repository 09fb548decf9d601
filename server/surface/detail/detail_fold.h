// Angles between the faces at an edge, at rest. Private to the surface module.
#ifndef PLIANT_SURFACE_DETAIL_FOLD_H
#define PLIANT_SURFACE_DETAIL_FOLD_H

#include "base/memory.h"
#include "surface/detail/detail_set.h"

typedef struct DetailFolds {
    const LeafSet *set;
    double least_height[LEVELS_MAX + 1]; // smallest height of the faces of a level at rest [m]
    float (*rest_fold)[2]; // [edges of all levels] cosine and sine of the angle between the faces
} DetailFolds;

// Load time: measures all edges. Keeps `set` by reference.
void detail_folds_create(DetailFolds *folds, const LeafSet *set, const char *name, Arena *arena);
// Recomputes one edge, after rest positions have changed.
void detail_measure_fold(DetailFolds *folds, int level, int edge);

#endif
