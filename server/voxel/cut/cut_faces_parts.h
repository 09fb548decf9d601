// Private to the faces of cut bodies: what their files share.
#ifndef PLIANT_VOXEL_CUT_CUT_FACES_PARTS_H
#define PLIANT_VOXEL_CUT_CUT_FACES_PARTS_H

#include "voxel/cut/cut_faces.h"

// Whether a side of a cell is a square.
bool cut_faces_is_shown(const CutLattice *lattice, int cell, int direction);
// A vertex that is new: it has no faces and no slot.
void cut_faces_enter_vertex(CutFaces *faces, int vertex);
// Gives a vertex the next slot, unless it has one.
void cut_faces_add_slot(CutFaces *faces, int vertex);
void cut_faces_describe_slot(CutFaces *faces, int slot);
// The triangles of a square whose place is taken; their vertices are touched.
void cut_faces_enter_square(CutFaces *faces, int square);
// Its neighbours, and it as theirs; when all squares around are there.
void cut_faces_join_square(CutFaces *faces, int square);
// Its area and firmness, and those of the faces around it, are to be found anew.
void cut_faces_touch(CutFaces *faces, int vertex);
// The mass per area that has firmness 1, by the present state.
void cut_faces_find_least(CutFaces *faces);
// Areas and firmness of touched vertices and of the faces around them.
void cut_faces_settle_touched(CutFaces *faces);
// Counts of the body's surface and mesh.
void cut_faces_tell(const CutFaces *faces, Body *body);

#endif
