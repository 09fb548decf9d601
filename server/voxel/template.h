// SPDX-License-Identifier: MIT
// The rest shape of an element: its nodes, area vectors and weights (README.md, "Rest shape of an
// element"). A cube has 8 corners and may have, as true vertices, the middles of edges and faces
// where a finer element has a corner ("hanging" vertices). The 26 positions are numbered: corners
// (x fastest: node = x + 2 y + 4 z), then the 12 mid-edges, then the 6 mid-faces (in the order of
// NODE_OFFSET).
#ifndef PLIANT_VOXEL_TEMPLATE_H
#define PLIANT_VOXEL_TEMPLATE_H

#include "base/memory.h"
#include "base/sym3.h"
#include "base/vec.h"
#include "voxel/kernel.h"

#include <stdbool.h>

enum { NODE_CORNERS = 8, NODE_COUNT = 26 };
// Position in half edges from the low corner, each 0, 1 or 2.
extern const signed char NODE_OFFSET[NODE_COUNT][3];
// Returns the node at an offset, -1 for the centre (1, 1, 1).
int node_at_offset(int x, int y, int z);

// For an element of edge 1; with edge H, rest scales by H, area by H^2. M = sum w_i X_i X_i^T.
typedef struct Template {
    unsigned mask;             // bit b: node 8 + b is present
    int count;                 // nodes present
    int node[NODE_COUNT];      // [count] their numbers, ascending
    Vec3 rest[NODE_COUNT];     // [count] X_i, from the centre of mass: the middle of a whole cube
    Vec3 area[NODE_COUNT];     // [count] a_i; sum 0, sum X_i a_i^T = share
    double weight[NODE_COUNT]; // [count] w_i; sum 8, sum w_i X_i = 0
    double share;              // phi: how much of the cube is solid; 1: a whole one
    double softer;             // alpha' / alpha: 1 in a whole cube, at most 1 in others
    double spread[3];          // diagonal of M; of a whole cube the other entries are 0
    Sym3 inverse;              // M^-1; set in partly filled ones
} Template;

void template_create(Template *out, unsigned mask);

// Words for the cells of an element of 2^level cells a side, x fastest, one bit each.
static inline int template_solid_words(int level)
{
    return level < 2 ? 1 : 1 << (3 * level - 6);
}
// Creates the rest shape of an element of which only the cells in `solid` are there, at least one
// (README.md, "Partly filled elements"); that of template_create if all are. Level 1 or more.
// Does not allocate; the time is bounded by the number of cells.
void template_create_partial(Template *out, unsigned mask, int level, const uint64_t *solid);
// Returns the parameters of an element of this shape, from those of a whole cube of its size.
ElementClass template_class(const Template *shape, const ElementClass *whole);
// Returns the mask of an element from its vertices by node; -1: absent.
static inline unsigned template_mask_of(const int node[NODE_COUNT])
{
    unsigned mask = 0;
    for (int n = NODE_CORNERS; n < NODE_COUNT; n++)
        mask |= (unsigned)(node[n] >= 0) << (n - NODE_CORNERS);
    return mask;
}
// Returns sum |X_i|^2 of the present nodes about their mean; 6 with 8 corners.
double template_spread(const Template *shape);

// --- rest shapes in the precision of the kernels ---

struct Batches; // batch.h

// Load time. Creates VoxelPass.tables: a table for each template of whole batches, then for
// each mixed batch, with numbers for each lane; owned by the arena. For Miyazaki's law weights are
// 1, X is relative to the mean of the present vertices, and A = sum r_i X_i^T, scaled to a trace of
// 3 at rest, takes the role of F.
const RestTable *voxel_tables_create(const struct Batches *batches, VoxelLaw law,
                                     Precision precision, const char *name, Arena *arena);

// Writes the table of one template, once for all lanes: Real [TABLE_HEAD], then
// [shape->count][TABLE_ROW]. Does not allocate: safe on the step thread.
void voxel_table_put(void *number, const Template *shape, VoxelLaw law, Precision precision);

// --- a cache ---

// What a rest shape is a function of: the mask of its nodes, and of a partly filled element also
// which one it is, as its solid cells never change. A whole cube's key is its mask.
typedef uint64_t TemplateKey;
static inline TemplateKey template_key_of_part(unsigned mask, int element)
{
    return ((uint64_t)element + 1) << (NODE_COUNT - NODE_CORNERS) | mask;
}
static inline unsigned template_key_mask(TemplateKey key)
{
    return (unsigned)key & ((1u << (NODE_COUNT - NODE_CORNERS)) - 1);
}
// Writes which cells of an element are solid, for template_create_partial; returns its level.
typedef int TemplateSolid(const void *of, int element, uint64_t *solid);

// Rest shapes of elements that are created while a body is cut. A shape is a function of its key
// alone, so that the set of cached shapes has no influence on results: a bounded hash table in
// which a new entry replaces an old one when it is full. Step thread; does not allocate after
// creation.
typedef struct TemplateCache {
    VoxelLaw law;
    Precision precision;
    TemplateSolid *solid; // of partly filled elements; NULL: there are none
    const void *solid_of; // its argument
    int slot_bits;        // 2^slot_bits slots
    TemplateKey *key;     // [slot] + 1; 0: free
    Template *shape;      // [slot]
    void *number;         // Real [slot][TEMPLATE_NUMBERS]
    long made;            // cache misses
} TemplateCache;

// Space for the numbers of any shape; a multiple of cache lines.
enum { TEMPLATE_NUMBERS = (TABLE_HEAD + NODE_COUNT * TABLE_ROW + 15) / 16 * 16 };

void template_cache_create(TemplateCache *cache, const char *name, VoxelLaw law,
                           Precision precision, Arena *arena);
// The same for a body with `parts` partly filled elements (affine law), of which `solid` says how,
// with `of` as its argument.
void template_cache_create_partial(TemplateCache *cache, const char *name, Precision precision,
                                   TemplateSolid *solid, const void *of, int parts, Arena *arena);
// Both results are valid until the next call of either function. A miss takes 0.3 us for a whole
// cube; for a partly filled one 0.8, 0.8 and 1.1 us at levels 1, 2 and 3.
const Template *template_cache_shape(TemplateCache *cache, TemplateKey key);
// Returns the shape's table in the form of the kernels (kernel.h, RestTable), once for all lanes.
// For Miyazaki's law the weights are not 1 but 6 / sum |X_i|^2, with X_i from the mean of the
// vertices, which is 1 for a plain cube. Forces and damping are proportional to the weights, and
// nothing else depends on a common factor of them. So an element of any mask uses the class of the
// plain cube of its level and material, and its stiffness still gives it that cube's energy under
// the same uniform stretch, averaged over the axes.
const void *template_cache_numbers(TemplateCache *cache, TemplateKey key);

#endif
