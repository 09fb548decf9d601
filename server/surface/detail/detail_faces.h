// SPDX-License-Identifier: MIT
// The triangles that tools touch and clients draw, and what a change reports of them. They follow
// from the set of refined faces; a change draws those that it has touched. Private to the surface
// module.
#ifndef PLIANT_SURFACE_DETAIL_FACES_H
#define PLIANT_SURFACE_DETAIL_FACES_H

#include "body/body.h"
#include "surface/detail/detail_set.h"
#include "surface/detail/detail_slots.h"
#include "surface/network.h"

// The change in progress, as contacts and loads follow it.
typedef struct DetailReport {
    TopologyChange change;
    FaceChange *face_change; // [2 face_count]
    NodeBirth *born;         // [node_count]
    int *gone;               // [node_count]
    int (*gone_parent)[2];   // [node_count]
} DetailReport;

typedef struct DetailFaces {
    // --- constant; what it reads ---
    const LeafSet *set;
    const LevelRules *rules;

    // --- by slot (BodySurface) ---
    int (*face)[3];
    int (*face_neighbor)[3];
    double *face_area, *finest_area;
    int *node_face_start, *node_face_end, *node_face;
    double *node_area;
    MeshSlots *slots;

    // --- of the change in progress ---
    Leaf *touched; // [faces of all levels] to be drawn again
    bool *is_touched;
    int *cleared, *drawn; // [face_count] slots
    bool *was_used;       // [face_count]
    int *redrawn;         // [node_count]
    bool *is_redrawn;
    int touched_count, cleared_count, drawn_count, redrawn_count;
} DetailFaces;

// Load time: allocates both from the arena, and keeps `set` and `rules` by reference. The caller
// creates the slots.
void detail_faces_create(DetailFaces *faces, DetailReport *report, const LeafSet *set,
                         const LevelRules *rules, const char *name, Arena *arena);
// Marks a face, to be drawn again at the end of the change.
void detail_touch(DetailFaces *faces, int level, int face);
// Draws what was touched, and reports it.
void detail_draw(DetailFaces *faces, DetailReport *report);
// Draws everything from scratch.
void detail_draw_all(DetailFaces *faces, DetailReport *report);

#endif
