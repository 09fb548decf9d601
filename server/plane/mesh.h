// The vertices that the elements of a plane body share, and its visible mesh: triangles and
// outline. A pure function of the elements and of the broken edges between cells (none until bodies
// are cut), so that it can be rebuilt from these alone.
#ifndef PLIANT_PLANE_MESH_H
#define PLIANT_PLANE_MESH_H

#include "base/check.h"
#include "base/memory.h"
#include "plane/layout.h"
#include "plane/shape.h"

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
