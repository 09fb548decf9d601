// SPDX-License-Identifier: MIT
// The elements of a plane body, by Miyazaki et al. 2004, sections 2.3 and 3.1 (Fig. 4 and 5):
// squares of one cell along the outline; a larger square keeps what was not carved out of it as one
// element, so that elements are whole squares or unions of a square's quarters. A pure function of
// the lattice's labels.
//
// Then the vertices that they share, and the visible mesh: triangles and outline. A pure function
// of the elements and of the broken edges between cells (none until bodies are cut), so that it can
// be rebuilt from these alone.
#ifndef PLIANT_PLANE_MESH_H
#define PLIANT_PLANE_MESH_H

#include "base/check.h"
#include "base/memory.h"
#include "geometry/lattice.h"
#include "plane/shape.h"

// --- layout.c: elements ---

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

// --- mesh.c: vertices and the visible mesh ---

// Broken edges of a cell, as bits; those inside an element are dormant.
enum { PLANE_BROKEN_RIGHT = 1, PLANE_BROKEN_UP = 2 };

// The four cells around a lattice point as slots x + 2 y; void: element -1.
typedef struct PlanePoint {
    int element[4];   // element that covers each slot
    int component[4]; // lowest slot that is connected by edges, or covered by the same element; -1
    bool vertex[4];   // [component] true if it has a vertex there: an element has a corner
} PlanePoint;

// Computes the parts around a point. `broken` [cell of layout->count, x fastest], or NULL: none.
void plane_point(const PlaneLayout *layout, const unsigned char *broken, int i, int j,
                 PlanePoint *point);
// Decides by section 3.3 of the paper (Fig. 7) whether a quarter is carved once edges break. Level
// 1: one of the three vertices that the quarter shares with neighbours of level 0 was released
// (does not join all solid cells around it). Level 2 and up: one of the four elements two levels
// below that could be along the quarter's outer edges exists.
bool plane_must_carve(const PlaneLayout *layout, const unsigned char *broken, int element,
                      int quarter);

// malloc'ed; free with plane_mesh_destroy.
typedef struct PlaneMesh {
    int element_count;
    int (*vertex)[PLANE_PLACES]; // [element] vertices by place; -1: absent
    int vertex_count;
    int (*point)[2]; // [vertex] lattice point, in cells
    int *id; // [vertex] stable: i + (lattice_count[0] + 1) j for the component with the lowest
             // solid slot; others: + points * their lowest slot, with all the lattice's points. A
             // part of a component that splits keeps the id if it holds that slot
    int *piece; // [vertex] parts that are not connected by edges, numbered by their lowest vertex
    int triangle_count;
    int (*triangle)[3]; // counter-clockwise: facing +z; without T-junctions
    int edge_count;
    int (*edge)[2]; // outline: the body is on the left from [0] to [1]
} PlaneMesh;

// Capacity for any mesh, however carved and broken: the sizes of the arrays of a PlaneMesh, and
// scratch memory.
typedef struct PlaneRoom {
    int elements, vertices, sides; // upper bounds
    struct PlaneSide *side;        // [sides]
    int *first_side;               // [vertices]
} PlaneRoom;

// Allocates the arrays of a mesh: calloc'ed, or from the arena unless that is NULL.
void plane_mesh_reserve(PlaneMesh *mesh, PlaneRoom *room, const PlaneLayout *layout,
                        const char *name, Arena *arena);
// Fills the mesh: vertices in the order of y, x of their point, then of their lowest slot. Does not
// allocate.
void plane_mesh_fill(PlaneMesh *mesh, const PlaneRoom *room, const PlaneLayout *layout,
                     const unsigned char *broken);
// Reserves and fills. False with `status`: more points than an id can express.
bool plane_mesh_create(PlaneMesh *mesh, const PlaneLayout *layout, const unsigned char *broken,
                       Status *status);
void plane_mesh_destroy(PlaneMesh *mesh);
unsigned plane_mesh_present(const PlaneMesh *mesh, int element); // PlaneShape.present

#endif
