// SPDX-License-Identifier: MIT
// The visible faces of a cuttable voxel body: a square, two triangles, for each side of a finest
// cell beyond which there is void or an open face; in a body that adapts also where a larger leaf
// covers the cell: the corners are carried then (cut_carry.h). Each keeps its
// place, so that data stored by face or node stays valid; new ones take the lowest place that the
// walls of cells that are gone have left, else the next. When vertices are duplicated the corners
// of squares follow.
//
// The nodes of BodySurface are the vertices, whether or not they are on the surface. Those of
// BodyMesh have slots: first the vertices of the outer faces, then others as they appear on the
// surface (or all vertices, in their order).
//
// Step thread, except cut_faces_create.
#ifndef PLIANT_VOXEL_CUT_CUT_FACES_H
#define PLIANT_VOXEL_CUT_CUT_FACES_H

#include "body/body.h"
#include "body/vertices.h"
#include "voxel/cut/cut_masses.h"
#include "voxel/cut/cut_pieces.h"

// Most triangles around a vertex: a part of n of the 8 cells around a point has at most n + 2
// squares there, each with at most two triangles at the vertex.
enum { CUT_NODE_FACES = 24 };
// The faces of a node are in a run of units of this many numbers; the first number is the node's
// times 8, plus the units. Of a free run it is minus the units, and the second the next free run.
enum { FACE_UNIT = 4, FACE_UNITS_MOST = (CUT_NODE_FACES + FACE_UNIT) / FACE_UNIT };

typedef struct CutFaces {
    const CutLattice *lattice;
    const CutPieces *pieces;
    const Vertices *vertices;
    const CutMasses *masses; // for masses and fixed vertices
    double half;             // area of a triangle at rest [m2]
    double least_firm;       // mass per area with firmness 1 [kg/m2]; constant
    int cell_count;          // elements of level 0
    int square_capacity, outer_squares;
    bool all; // slots are vertices

    // --- part of the state ---
    int *square;         // [square_capacity] 6 * cell + direction (-x, +x, -y, +y, -z, +z); -1:
                         // free
    int64_t *shown;      // number of squares, free ones included
    int *slot_vertex;    // [vertex_capacity] vertex of a published node
    int64_t *slot_count; // number of slots
    int *copied_from;    // [vertex_capacity] vertex from which it was copied; -1: none

    // --- derived from the state ---
    unsigned char *counted;   // [cell] broken faces that are included in wall_count; NULL: all, in
                              // a body that adapts, where a change lists none again
    int64_t wall_count;       // sides of broken faces: each is a square, or will be
    int free_count, free_low; // free squares of walls; none is lower
    int (*square_of)[6];      // [cell][direction] or -1; NULL in a body that adapts, which has few:
    int *table;               // [table_size] squares by a hash of their place, or -1
    int table_size;           // a power of two
    int (*face)[3];           // [2 * square_capacity] vertices
    int (*neighbor)[3];       // [2 * square_capacity]
    int *start, *end;         // [vertex_capacity]
    int *list;                // [FACE_UNIT * list_units] runs of units: an owner, its faces
    int list_units, list_top; // units, those from `list_top` on not used yet
    int free_run[FACE_UNITS_MOST + 1]; // first unit of a free run of as many units; -1: none
    double *node_area;                 // [vertex_capacity]
    double *face_firmness;             // [2 * square_capacity] NULL: no contacts
    double *node_firmness;             // [vertex_capacity]
    int *cell_of;                      // [vertex_capacity] the lowest cell of its part
    int vertex_count;                  // number of vertices that have been processed
    int *slot_of;                      // [vertex] -1: not published
    int (*triangle)[3];       // [2 * square_capacity] slots; `face` when slots are vertices
    int *id, *origin, *piece; // [slot]
    int (*parent)[2];
    signed char *level;

    // --- of a body that adapts and does not publish all vertices, else NULL ---
    struct CutCarry *carry; // what carries vertices; set by the body
    uint64_t *found;        // a bit for each slot; empty between calls

    // --- scratch ---
    NodeBirth *born; // for all vertices but those that are there for ever
    int *touched;    // vertices
    unsigned char *is_touched;
    int touched_count;
    FaceChange *ended;     // [6 * CUT_REMOVE_MOST] faces of cells that went; NULL: none can
    int *gone, (*none)[2]; // [8 * CUT_REMOVE_MOST] vertices without an element; {-1, -1} of each
} CutFaces;

// Load time. Fills body->surface and body->mesh; an uncut body has the faces of
// voxel_create_surface and voxel_create_mesh, in their order. `vertices` must have its masses and
// fixed vertices; face_capacity of the options: most triangles, 0: ten times the outer ones, or all
// that can exist. False with a status: the outer faces exceed the capacity.
bool cut_faces_create(CutFaces *faces, const CutPieces *pieces, const CutMasses *masses,
                      const VoxelMaking *making, Body *body, Arena *arena, StateList *state,
                      Status *status);
// True if two squares for each of this many new broken faces are certain to fit; otherwise reports
// how many squares' triangles are needed and available.
bool cut_faces_has_room(const CutFaces *faces, int broken, int *needed, int *room);
// The same for the squares around cells that go.
bool cut_faces_has_room_to_remove(const CutFaces *faces, int cells, int *needed, int *room);
// Updates the faces after changes of the lattice, with the masses and pieces up to date and before
// cut_lattice_forget_changes, and reports what contacts and loads need. True if anything visible
// changed. `pieces_came`: result of cut_pieces_follow.
bool cut_faces_follow(CutFaces *faces, bool pieces_came, Body *body, TopologyChange *change);
// Derives everything that follows from the state. False: impossible squares or slots (from a
// checkpoint); these are then chosen again.
bool cut_faces_derive(CutFaces *faces, Body *body);
// BodyOps.find_nodes: among the vertices that are on the surface now.
int cut_faces_find_nodes(const CutFaces *faces, const Region *region, int *node, int capacity);
// Returns the leaf behind a square; NULL: the square is free.
const CutElement *cut_faces_element(const CutFaces *faces, int square);

// --- shared by cut_faces.c and cut_faces_create.c ---

// Returns the square of a cell in a direction; -1: none.
int cut_faces_square(const CutFaces *faces, int cell, int direction);
// Enters a square by its place, which has none; removes it, before its place is forgotten.
void cut_faces_put_square(CutFaces *faces, int square);
void cut_faces_drop_square(CutFaces *faces, int square);
void cut_faces_drop_all(CutFaces *faces);

// True if a side of a cell is a square.
bool cut_faces_is_shown(const CutLattice *lattice, int cell, int direction);
// Adds a new vertex, without faces and slot.
void cut_faces_enter_vertex(CutFaces *faces, int vertex);
// Gives a vertex the next slot, unless it has one.
void cut_faces_add_slot(CutFaces *faces, int vertex);
void cut_faces_describe_slot(CutFaces *faces, int slot);
// Creates the triangles of a square whose place is set; touches their vertices.
void cut_faces_enter_square(CutFaces *faces, int square);
// Connects a square with its neighbours; all squares around must exist.
void cut_faces_join_square(CutFaces *faces, int square);
// Marks a vertex: its area and firmness, and those of the faces around it, must be recomputed.
void cut_faces_touch(CutFaces *faces, int vertex);
// Computes the mass per area with firmness 1 from the current state.
void cut_faces_find_least(CutFaces *faces);
// Recomputes areas and firmness of touched vertices and of the faces around them.
void cut_faces_settle_touched(CutFaces *faces);
// Publishes the counts of the body's surface and mesh.
void cut_faces_report(const CutFaces *faces, Body *body);

#endif
