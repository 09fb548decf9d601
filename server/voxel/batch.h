// Groups elements into the batches that the kernels process (kernel.h). Load time. A pure function
// of its input: the same elements give the same batches.
#ifndef PLIANT_VOXEL_BATCH_H
#define PLIANT_VOXEL_BATCH_H

#include "base/memory.h"
#include "voxel/kernel.h"
#include "voxel/template.h"

typedef struct BatchOptions {
    const char *name; // of the body, for the arena
    int element_count;
    const int (
        *vertex)[NODE_COUNT];    // [element] vertices by node; -1: absent. All corners are present.
    const int *element_class;    // [element] index into `classes`
    const ElementClass *classes; // duplicates and unused ones are allowed
    int vertex_count;            // also the row of the spare vertex, for lanes without an element
} BatchOptions;

// The arena owns all arrays.
typedef struct Batches {
    PlainBatches plain; // by class, then in the order of the elements
    // By template, then in the order of the elements. Where the last batch of a template would be
    // less than three quarters full, its elements go to the mixed batches: sorted by their number
    // of vertices, template, and order.
    HangingBatches hanging;
    int template_count;    // of hanging elements
    Template *templates;   // [template_count] ascending masks
    int (*mixture)[LANES]; // [mixed batch] templates of its lanes; -1: no element
    int class_count;
    ElementClass *classes; // [class_count] classes in use, each once, in the order of the options
    int element_count;
    // [element] batch * LANES + lane, hanging batches numbered after the plain ones, as in
    // VoxelPass.last.
    int *place;
} Batches;

void batches_create(Batches *out, const BatchOptions *options, Arena *arena);
static inline int batches_total(const Batches *batches)
{
    return batches->plain.batch_count + batches->hanging.batch_count;
}

#endif
