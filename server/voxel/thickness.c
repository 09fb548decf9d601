// SPDX-License-Identifier: MIT
#include "voxel/thickness.h"

#include "base/check.h"
#include "geometry/nearest.h"

#include <stdlib.h>
#include <string.h>

// The cells with a layer of void around.
typedef struct Padded {
    int count[3];
    long cells;
    bool *marked; // [cells]
    int *nearest; // [cells] marked cell
} Padded;

static void create(Padded *padded, const Lattice *lattice)
{
    padded->cells = 1;
    for (int d = 0; d < 3; d++) {
        padded->count[d] = lattice->count[d] + 2;
        padded->cells *= padded->count[d];
    }
    padded->marked = malloc((size_t)padded->cells * sizeof *padded->marked);
    padded->nearest = malloc((size_t)padded->cells * sizeof *padded->nearest);
    ASSERT(padded->marked != NULL && padded->nearest != NULL);
}

// Returns the number of cell (i, j, k) of the lattice.
static long index_of(const Padded *padded, int i, int j, int k)
{
    return ((k + 1L) * padded->count[1] + j + 1L) * padded->count[0] + i + 1L;
}

// Returns the square of the distance between the centres of two cells.
static long apart(const Padded *padded, long a, long b)
{
    long sum = 0;
    for (int d = 0; d < 3; d++) {
        const long off = a % padded->count[d] - b % padded->count[d];
        sum += off * off;
        a /= padded->count[d];
        b /= padded->count[d];
    }
    return sum;
}

// Calls for each solid cell, with its number in the lattice and among the padded ones.
typedef void Visit(const Padded *padded, long cell, long at, void *context);

static void visit_solid(const Padded *padded, const Lattice *lattice, Visit *visit, void *context)
{
    long cell = 0;
    for (int k = 0; k < lattice->count[2]; k++)
        for (int j = 0; j < lattice->count[1]; j++)
            for (int i = 0; i < lattice->count[0]; i++, cell++)
                if (lattice->label[cell] != 0)
                    visit(padded, cell, index_of(padded, i, j, k), context);
}

static void clear(const Padded *padded, long cell, long at, void *context)
{
    (void)cell, (void)context;
    padded->marked[at] = false;
}

// Square of the distance from void, of each cell of the lattice.
static void note_depth(const Padded *padded, long cell, long at, void *context)
{
    ((long *)context)[cell] = apart(padded, at, padded->nearest[at]);
}

// A level whose balls are looked for.
typedef struct Opening {
    const long *depth; // [cells of the lattice]
    long square;       // of the radius of its ball [cells],
    long reach;        // and of that with an element's edge
    unsigned char value, *level;
} Opening;

static void mark_middle(const Padded *padded, long cell, long at, void *context)
{
    const Opening *opening = context;
    padded->marked[at] = opening->depth[cell] >= opening->square;
}

static void note_covered(const Padded *padded, long cell, long at, void *context)
{
    const Opening *opening = context;
    const int middle = padded->nearest[at];
    if (middle >= 0 && apart(padded, at, middle) < opening->reach)
        opening->level[cell] = opening->value;
}

// Gives all solid cells of an element's block the level if one of them has it: elements reach into
// edges and corners, which no ball does.
static void fill_blocks(const Lattice *lattice, int l, unsigned char *level)
{
    const int edge = 1 << l, *n = lattice->count;
    for (int z = 0; z < n[2]; z += edge)
        for (int y = 0; y < n[1]; y += edge)
            for (int x = 0; x < n[0]; x += edge) {
                bool any = false;
                for (int pass = 0; pass < 2; pass++)
                    for (int k = z; k < z + edge && k < n[2]; k++)
                        for (int j = y; j < y + edge && j < n[1]; j++)
                            for (int i = x; i < x + edge && i < n[0]; i++) {
                                const long cell = lattice_index(lattice, i, j, k);
                                if (pass == 0)
                                    any |= level[cell] == l;
                                else if (any && lattice->label[cell] != 0)
                                    level[cell] = (unsigned char)l;
                            }
            }
}

void thickness_levels(const Lattice *lattice, int levels, unsigned char *level)
{
    const size_t cells =
        (size_t)lattice->count[0] * (size_t)lattice->count[1] * (size_t)lattice->count[2];
    Padded padded;
    create(&padded, lattice);
    long *depth = calloc(cells, sizeof *depth);
    ASSERT(depth != NULL);
    // How deep each cell is.
    memset(padded.marked, 1, (size_t)padded.cells * sizeof *padded.marked);
    visit_solid(&padded, lattice, clear, NULL);
    nearest_marked(padded.count, padded.marked, padded.nearest);
    visit_solid(&padded, lattice, note_depth, depth);
    // From level to level larger balls, with their middles where these fit.
    memset(level, 0, cells);
    for (int l = 1; l <= levels; l++) {
        const long radius = THICKNESS_ELEMENTS / 2L << l, reach = radius + (1L << l);
        Opening opening = {depth, radius * radius, reach * reach, (unsigned char)l, level};
        memset(padded.marked, 0, (size_t)padded.cells * sizeof *padded.marked);
        visit_solid(&padded, lattice, mark_middle, &opening);
        nearest_marked(padded.count, padded.marked, padded.nearest);
        visit_solid(&padded, lattice, note_covered, &opening);
        fill_blocks(lattice, l, level);
    }
    free(padded.marked);
    free(padded.nearest);
    free(depth);
}
