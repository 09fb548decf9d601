// Which elements of a plane body share which vertex, and what is seen of it: triangles and outline.
// A pure function of the elements and of the broken edges between cells (none until bodies are
// cut), so that it can be made anew from these alone.
#ifndef PLIANT_VOXEL_PLANE_MESH_H
#define PLIANT_VOXEL_PLANE_MESH_H

#include "base/arena.h"
#include "base/status.h"
#include "voxel/plane/plane_layout.h"
#include "voxel/plane/plane_shape.h"

// Broken edges of a cell, as bits; those inside an element are dormant.
enum { PLANE_BROKEN_RIGHT = 1, PLANE_BROKEN_UP = 2 };

// Around a lattice point, the four cells as slots x + 2 y; void: element -1.
typedef struct PlanePoint {
    int element[4];   // over each slot
    int component[4]; // slots that edges join, or that one element covers: the lowest of them; -1
    bool vertex[4];   // [component] whether it has a vertex there: an element has a corner
} PlanePoint;

// `broken` [cell of layout->count, x fastest], or NULL: none.
void plane_point(const PlaneLayout *layout, const unsigned char *broken, int i, int j,
                 PlanePoint *point);
// What decides in section 3.3 of the paper (Fig. 7) whether a quarter is carved once edges break.
// Level 1: one of the three vertices that the quarter shares with neighbours of level 0 was
// released (does not join all the solid cells around it). Level 2 and up: one of the four elements
// two levels below that could lie along the quarter's outer edges is there.
bool plane_must_carve(const PlaneLayout *layout, const unsigned char *broken, int element,
                      int quarter);

// malloc'ed; plane_mesh_destroy.
typedef struct PlaneMesh {
    int element_count;
    int (*vertex)[PLANE_PLACES]; // [element] by place; -1: not there
    int vertex_count;
    int (*point)[2]; // [vertex] lattice point, in cells
    int *id;    // [vertex] stable: i + (lattice_count[0] + 1) j for the component with the lowest
                // solid slot; others: + points * their lowest slot, with all the lattice's
                // points. A part of a component that falls apart keeps the id if it holds
                // that slot
    int *piece; // [vertex] parts that no edge joins, numbered by their lowest vertex
    int triangle_count;
    int (*triangle)[3]; // counter-clockwise: facing +z; without T-junctions
    int edge_count;
    int (*edge)[2]; // outline: the body on the left from [0] to [1]
} PlaneMesh;

// Room for a mesh, whatever is carved and broken: the arrays of a PlaneMesh and some to work with.
typedef struct PlaneRoom {
    int elements, vertices, sides; // most of them
    struct PlaneSide *side;        // [sides]
    int *first_side;               // [vertices]
} PlaneRoom;

// Memory for the arrays of a mesh: calloc'ed, or of the arena unless that is NULL.
void plane_mesh_reserve(PlaneMesh *mesh, PlaneRoom *room, const PlaneLayout *layout,
                        const char *name, Arena *arena);
// Vertices are in the order of y, x of their point, then of their lowest slot. Allocates nothing.
void plane_mesh_fill(PlaneMesh *mesh, const PlaneRoom *room, const PlaneLayout *layout,
                     const unsigned char *broken);
// Both. False: more points than an id can tell.
bool plane_mesh_create(PlaneMesh *mesh, const PlaneLayout *layout, const unsigned char *broken,
                       Status *status);
void plane_mesh_destroy(PlaneMesh *mesh);
unsigned plane_mesh_present(const PlaneMesh *mesh, int element); // PlaneShape.present

#endif
