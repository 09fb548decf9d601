// The elements of a plane body, by Miyazaki et al. 2004, sections 2.3 and 3.1 (Fig. 4 and 5):
// squares of one cell along the outline; a larger square keeps what was not carved out of it as one
// element, so that elements are whole squares or unions of a square's quarters. A pure function of
// the lattice's labels.
#ifndef PLIANT_PLANE_LAYOUT_H
#define PLIANT_PLANE_LAYOUT_H

#include "geometry/lattice.h"

enum { PLANE_LEVELS_MAX = 5 };
enum { PLANE_WHOLE = 15 }; // all four quarters

// The remainder of an aligned square of 2^level cells a side: an edge-connected union of quarters.
typedef struct PlaneElement {
    int cell[2]; // the square's lowest cell
    unsigned char level;
    unsigned char quarters; // bit x + 2 y: that quarter belongs to it; PLANE_WHOLE at level 0
    unsigned char material; // of all its cells, from 1
} PlaneElement;

// The layered element look-up table.
typedef struct PlaneLayout {
    int levels;           // coarsest level allowed
    int lattice_count[2]; // cells of the lattice
    int count[2];         // the same rounded up to multiples of 2^levels
    int element_count;
    PlaneElement *element;          // by level, then along y and x
    int *lut[PLANE_LEVELS_MAX + 1]; // [level][square of 2^level cells, x fastest]: element or -1;
                                    // it covers the quarters that belong to it
} PlaneLayout;

// Creates the layout. A quarter is carved out of its square as an element of its own when one of
// its edge neighbours is void or of another material (squares of two cells), or when it is not
// whole itself or an edge neighbour is of a level below its own (larger squares): so elements that
// share a part of an edge differ by at most one level. Two quarters that meet only in a corner are
// carved too: they must not share a rotation. O(cells) per level. malloc'ed; free with
// plane_layout_destroy.
void plane_layout_create(PlaneLayout *layout, const Lattice *lattice, int levels);
void plane_layout_destroy(PlaneLayout *layout);
// Returns the element that covers a cell; -1: void or outside.
int plane_layout_at(const PlaneLayout *layout, int i, int j);

#endif
