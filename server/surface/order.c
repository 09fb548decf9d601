#include "surface/order.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

enum {
    WINDOW = 256,     // sorting by valence moves a node at most this far: 16 kB of rows
    MAX_VALENCE = 32, // larger valences are sorted as one
};

// Orders breadth first from the lowest node of each component, neighbours counter-clockwise: the
// oriented Cuthill-McKee order, whose fronts run around the body.
static void breadth_first(const WingedMesh *winged, int *order)
{
    bool *seen = calloc((size_t)winged->node_count + 1, sizeof *seen);
    ASSERT(seen != NULL);
    int read = 0, written = 0;
    for (int seed = 0; seed < winged->node_count; seed++) {
        if (seen[seed])
            continue;
        seen[seed] = true;
        order[written++] = seed;
        for (; read < written; read++) {
            int node = order[read];
            for (int k = winged->node_edge_start[node]; k < winged->node_edge_start[node + 1];
                 k++) {
                int other = winged_other(winged, winged->node_edge[k], node);
                if (!seen[other]) {
                    seen[other] = true;
                    order[written++] = other;
                }
            }
        }
    }
    free(seen);
}

void order_nodes(const WingedMesh *winged, int *slot)
{
    int *order = calloc((size_t)winged->node_count + 1, sizeof *order);
    ASSERT(order != NULL);
    breadth_first(winged, order);
    for (int first = 0; first < winged->node_count; first += WINDOW) {
        int end = first + WINDOW < winged->node_count ? first + WINDOW : winged->node_count;
        int next = first;
        for (int valence = 0; valence <= MAX_VALENCE; valence++) // a stable counting sort
            for (int k = first; k < end; k++) {
                int v = winged_valence(winged, order[k]);
                if ((v < MAX_VALENCE ? v : MAX_VALENCE) == valence)
                    slot[order[k]] = next++;
            }
    }
    free(order);
}
