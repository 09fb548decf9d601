// What a cuttable voxel body shows of itself: a square, two triangles, for each side of a finest
// cell (a leaf of level 0) beyond which there is nothing, or a broken face. Squares only ever come:
// each keeps its place, new ones take the next, so that whoever remembers something by face or node
// keeps it. When vertices are doubled the corners of squares follow.
//
// Nodes of BodySurface are the vertices, whether they lie on the surface or not. Those of BodyMesh
// have slots: first the vertices of the outer faces, then others as they come to the surface (or
// all vertices, in their order).
//
// Step thread, but for cut_faces_create.
#ifndef PLIANT_VOXEL_CUT_CUT_FACES_H
#define PLIANT_VOXEL_CUT_CUT_FACES_H

#include "dynamics/body.h"
#include "voxel/cut/cut_pieces.h"
#include "voxel/vertices.h"

// Most triangles around a vertex: a part of n of the 8 cells around a point has at most n + 2
// squares there, of at most two triangles each.
enum { CUT_NODE_FACES = 24 };

typedef struct CutFaces {
    const CutLattice *lattice;
    const CutPieces *pieces;
    const Vertices *vertices; // masses, and what is fixed
    double half;              // area of a triangle at rest [m2]
    double least_firm;        // mass per area that has firmness 1 [kg/m2]; constant
    int cell_count;           // elements of level 0
    int square_capacity, outer_squares;
    bool all; // slots are vertices

    // --- part of the state ---
    int *square;         // [square_capacity] 6 * cell + direction (-x, +x, -y, +y, -z, +z)
    int64_t *shown;      // squares
    int *slot_vertex;    // [vertex_capacity] of a published node
    int64_t *slot_count; // of them
    int *copied_from;    // [vertex_capacity] vertex; -1: of nothing

    // --- follows from it ---
    unsigned char *counted;   // [cell] broken faces that are in broken_count
    int64_t broken_count;     // faces
    int (*square_of)[6];      // [cell][direction] or -1
    int (*face)[3];           // [2 * square_capacity] vertices
    int (*neighbor)[3];       // [2 * square_capacity]
    double *area;             // [2 * square_capacity]
    int *start, *end;         // [vertex_capacity]
    int *list;                // [vertex_capacity * CUT_NODE_FACES]
    double *node_area;        // [vertex_capacity]
    double *face_firmness;    // [2 * square_capacity] NULL: no contacts
    double *node_firmness;    // [vertex_capacity]
    int *cell_of;             // [vertex_capacity] a cell of its part: the lowest
    int vertex_count;         // that have been seen
    int *slot_of;             // [vertex] -1: not published
    int (*triangle)[3];       // [2 * square_capacity] slots; `face` when slots are vertices
    int *id, *origin, *piece; // [slot]
    int (*parent)[2];
    signed char *level;

    // --- scratch ---
    NodeBirth *born; // [vertex_capacity]
    int *touched;    // vertices
    unsigned char *is_touched;
    int touched_count;
} CutFaces;

// Load time. Fills body->surface and body->mesh; an uncut body shows what voxel_create_surface and
// voxel_create_mesh give for `mesh`, in their order. `vertices` has its masses, and is_fixed can be
// asked; `face_capacity`: most triangles, 0: ten times the outer ones, or all that there can be.
// False with a status: the outer faces do not fit.
bool cut_faces_create(CutFaces *faces, const char *name, const CutLattice *lattice,
                      const CutPieces *pieces, const Vertices *vertices, const LatticeMesh *mesh,
                      const Layout *layout, double size, int face_capacity, bool publish_all,
                      bool without_contacts, Body *body, Arena *arena, StateList *state,
                      Status *status);
// Whether two squares for each of so many new broken faces are sure to fit; else how many squares'
// triangles are needed and free.
bool cut_faces_has_room(const CutFaces *faces, int broken, int *needed, int *room);
// After changes of the lattice, with the masses and pieces up to date and before
// cut_lattice_forget_changes: follows them, and tells what contacts and loads need. True when
// anything that is shown changed. `pieces_came`: of cut_pieces_follow.
bool cut_faces_follow(CutFaces *faces, bool pieces_came, Body *body, TopologyChange *change);
// All that follows from the state, from scratch. False: squares or slots that cannot be (a
// checkpoint's); then they are chosen anew.
bool cut_faces_derive(CutFaces *faces, Body *body);
// As BodyOps.find_nodes: of the vertices on the surface now.
int cut_faces_find_nodes(const CutFaces *faces, const Region *region, int *node, int capacity);

#endif
