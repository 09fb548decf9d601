// Rest shapes of elements that come while a body is cut, by the mask of their nodes. A shape is a
// function of the mask alone, so it does not matter for any bit which of them are kept: a bounded
// hash table, where a new one takes the place of an old one when there is no room. Step thread; no
// allocation after creation.
#ifndef PLIANT_VOXEL_CUT_TEMPLATE_CACHE_H
#define PLIANT_VOXEL_CUT_TEMPLATE_CACHE_H

#include "base/arena.h"
#include "voxel/tables.h"

typedef struct TemplateCache {
    VoxelLaw law;
    Precision precision;
    unsigned *mask;  // [slot] + 1; 0: free
    Template *shape; // [slot]
    void *number;    // Real [slot][TEMPLATE_NUMBERS]
    long made;       // shapes that were not there when asked for
} TemplateCache;

// Room for the numbers of any of them; a multiple of cache lines.
enum { TEMPLATE_NUMBERS = (TABLE_HEAD + NODE_COUNT * TABLE_ROW + 15) / 16 * 16 };

void template_cache_create(TemplateCache *cache, const char *name, VoxelLaw law,
                           Precision precision, Arena *arena);
// Both valid until the next call of either.
const Template *template_cache_shape(TemplateCache *cache, unsigned mask);
// Its table as the kernels want it (kernel.h, RestTable), not mixed. For Miyazaki's law the weights
// are not 1 but 6 / sum |X_i|^2, X_i from the mean of the vertices, which is 1 for a plain cube: as
// forces and damping are proportional to the weights, and everything else does not depend on a
// common factor of them, an element of any mask then has the class of the plain cube of its level
// and material and still the stiffness that gives it that cube's energy under the same uniform
// stretch, on average over the axes.
const void *template_cache_numbers(TemplateCache *cache, unsigned mask);

static inline unsigned template_mask_of(const int node[NODE_COUNT])
{
    unsigned mask = 0;
    for (int n = NODE_CORNERS; n < NODE_COUNT; n++)
        mask |= (unsigned)(node[n] >= 0) << (n - NODE_CORNERS);
    return mask;
}

#endif
