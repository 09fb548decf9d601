// Rest shapes of elements that are created while a body is cut, by the mask of their nodes. A shape
// is a function of the mask alone, so that the set of cached shapes has no influence on results: a
// bounded hash table in which a new entry replaces an old one when it is full. Step thread; does
// not allocate after creation.
#ifndef PLIANT_VOXEL_CUT_TEMPLATE_CACHE_H
#define PLIANT_VOXEL_CUT_TEMPLATE_CACHE_H

#include "base/memory.h"
#include "voxel/tables.h"

typedef struct TemplateCache {
    VoxelLaw law;
    Precision precision;
    unsigned *mask;  // [slot] + 1; 0: free
    Template *shape; // [slot]
    void *number;    // Real [slot][TEMPLATE_NUMBERS]
    long made;       // cache misses
} TemplateCache;

// Space for the numbers of any shape; a multiple of cache lines.
enum { TEMPLATE_NUMBERS = (TABLE_HEAD + NODE_COUNT * TABLE_ROW + 15) / 16 * 16 };

void template_cache_create(TemplateCache *cache, const char *name, VoxelLaw law,
                           Precision precision, Arena *arena);
// Both results are valid until the next call of either function.
const Template *template_cache_shape(TemplateCache *cache, unsigned mask);
// Returns the shape's table in the form of the kernels (kernel.h, RestTable), not mixed. For
// Miyazaki's law the weights are not 1 but 6 / sum |X_i|^2, with X_i from the mean of the vertices,
// which is 1 for a plain cube. Forces and damping are proportional to the weights, and nothing else
// depends on a common factor of them. So an element of any mask uses the class of the plain cube of
// its level and material, and its stiffness still gives it that cube's energy under the same
// uniform stretch, averaged over the axes.
const void *template_cache_numbers(TemplateCache *cache, unsigned mask);

#endif
