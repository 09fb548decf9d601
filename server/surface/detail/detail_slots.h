// SPDX-License-Identifier: MIT
// Slots of a changing mesh in messages (lcmtypes/mesh_t.lcm): a node or triangle keeps its slot for
// its life, a new one takes the lowest free slot. Private to the surface module.
#ifndef PLIANT_SURFACE_DETAIL_SLOTS_H
#define PLIANT_SURFACE_DETAIL_SLOTS_H

#include "base/memory.h"
#include "body/body.h"
#include "geometry/levels.h"

// The slots of nodes, or those of faces.
typedef struct SlotTable {
    int capacity, thing_count;
    int *thing;     // [capacity] node or face of a slot, -1: free; part of the state
    int *slot;      // [thing_count] slot of a node or face, -1: none
    int used, high; // slots in use; one past the highest slot in use
    int lowest;     // all slots below it are in use
} SlotTable;

typedef struct MeshSlots {
    SlotTable node, face;
    int face_reserve; // triangles that the change in progress may still need
    const Levels *levels;
    const int *row_of_node;                        // slot of a node's row
    const int *root_id, *root_origin, *root_piece; // of the nodes of level 0
    int first_id;                                  // of the first midpoint
    const struct DetailCut *cut;                   // NULL: there are no copies
    // by slot
    int *row; // of the node's row; 0 if free
    int (*triangle)[3];
    int *id, *origin, (*parent)[2], *piece;
    signed char *level;
} MeshSlots;

// Allocates from the arena. `capacity`: most nodes and faces, 0: as many as the finest level has.
// Keeps the arrays of nodes by reference, and `cut`, which is NULL for a body that cannot be cut.
MeshSlots *slots_create(const char *name, const Levels *levels, const int capacity[2],
                        const int *row_of_node, const int *root_id, const int *root_origin,
                        const int *root_piece, int first_id, const struct DetailCut *cut,
                        Arena *arena, StateList *state);
// True if one more face can be divided in this change; reserves what it takes.
bool slots_reserve(MeshSlots *slots);
void slots_take_node(MeshSlots *slots, int node);
void slots_free_node(MeshSlots *slots, int node);
// Draws a face in its slot, or in a new one.
void slots_put_face(MeshSlots *slots, int face, const int corner[3]);
void slots_free_face(MeshSlots *slots, int face);
// After a cut: updates the pieces of all nodes.
void slots_label(MeshSlots *slots);
// After the state was restored: restores everything but the triangles, which are put again.
void slots_restore(MeshSlots *slots);
void slots_describe(const MeshSlots *slots, int topology, BodyMesh *mesh);

#endif
