// Private to the faces of cut bodies: functions that their files share.
#ifndef PLIANT_VOXEL_CUT_CUT_FACES_PARTS_H
#define PLIANT_VOXEL_CUT_CUT_FACES_PARTS_H

#include "voxel/cut/cut_faces.h"

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
