// From elements to the batches that the kernels work through (kernel.h). Load time. A pure function
// of what it is given: the same elements, the same batches.
#ifndef PLIANT_VOXEL_BATCH_H
#define PLIANT_VOXEL_BATCH_H

#include "base/arena.h"
#include "voxel/kernel.h"
#include "voxel/template.h"

typedef struct BatchOptions {
    const char *name; // of the body, for the arena
    int element_count;
    const int (*vertex)[NODE_COUNT]; // [element] by node; -1: absent. All corners are present.
    const int *element_class;        // [element] index into `classes`
    const ElementClass *classes;     // may hold equal ones and unused ones
    int vertex_count;                // its row is the spare one, for lanes without an element
} BatchOptions;

// All arrays belong to the arena.
typedef struct Batches {
    PlainBatches plain; // by class, then in the elements' order
    // By template, then in the elements' order. Where the last batch of a template would be less
    // than three quarters full its elements go to the mixed ones: by the number of their vertices,
    // template, and the elements' order.
    HangingBatches hanging;
    int template_count;    // of hanging elements
    Template *templates;   // [template_count] ascending masks
    int (*mixture)[LANES]; // [mixed batch] templates of its lanes; -1: no element
    int class_count;
    ElementClass *classes; // [class_count] those in use, each once, in the order of the options'
    int element_count;
    // [element] batch * LANES + lane, hanging batches counted on from the plain ones: as
    // VoxelPass.last.
    int *place;
} Batches;

void batches_create(Batches *out, const BatchOptions *options, Arena *arena);
static inline int batches_total(const Batches *batches)
{
    return batches->plain.batch_count + batches->hanging.batch_count;
}

#endif
