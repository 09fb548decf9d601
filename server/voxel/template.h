// The rest shape of an element: its nodes, area vectors and weights (README.md, "Rest shape of an
// element"). A cube has 8 corners and may have, as true vertices, the middles of edges and faces
// where a finer element has a corner ("hanging" vertices). The 26 positions are numbered: corners
// (x fastest: node = x + 2 y + 4 z), then the 12 mid-edges, then the 6 mid-faces (in the order of
// NODE_OFFSET). Load time only.
#ifndef PLIANT_VOXEL_TEMPLATE_H
#define PLIANT_VOXEL_TEMPLATE_H

#include "base/vec.h"

#include <stdbool.h>

enum { NODE_CORNERS = 8, NODE_COUNT = 26 };
// Position in half edges from the low corner, each 0, 1 or 2.
extern const signed char NODE_OFFSET[NODE_COUNT][3];
// Returns the node at an offset, -1 for the centre (1, 1, 1).
int node_at_offset(int x, int y, int z);

// For an element of edge 1; with edge H, place scales by H, area by H^2.
typedef struct Template {
    unsigned mask;             // bit b: node 8 + b is present
    int count;                 // nodes present
    int node[NODE_COUNT];      // [count] their numbers, ascending
    Vec3 place[NODE_COUNT];    // [count] X_i, from the middle of the cube
    Vec3 area[NODE_COUNT];     // [count] a_i; sum 0, sum X_i a_i^T = 1
    double weight[NODE_COUNT]; // [count] w_i; sum 8, sum w_i X_i = 0
    double spread[3];          // diagonal of M = sum w_i X_i X_i^T, whose other entries are 0
} Template;

void template_create(Template *out, unsigned mask);
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

#endif
