// SPDX-License-Identifier: MIT
// A triangle surface without physics that can be cut: what the finder, smoothing and lips need,
// and the rule by which vertices split, written the plain way.
#ifndef PLIANT_TESTS_CUT_MODEL_H
#define PLIANT_TESTS_CUT_MODEL_H

#include "geometry/levels.h"
#include "surface/cut/cut_lips.h"
#include "surface/cut/cut_smooth.h"
#include "wall_check.h"

// Finest levels: 1280 faces, closed; 2048, flat, one border; 2688, a bent tube with two borders and
// edges of 1 : 2.
typedef enum CutShape {
    CUT_SPHERE,
    CUT_SHEET,
    CUT_TUBE,
    CUT_SHAPES,
    // The meshes of config/stomach.cfg, at level 2, and of config/gallbladder.cfg, without levels.
    CUT_STOMACH = CUT_SHAPES,
    CUT_GALLBLADDER,
    CUT_ORGANS,
} CutShape;

extern const char *const CUT_SHAPE_NAME[CUT_ORGANS];

typedef enum CutCare { CUT_PLAIN, CUT_SMOOTHED } CutCare;

typedef struct CutModel {
    CutShape shape;
    TriMesh mesh; // level 0
    Arena arena;
    StateList state;
    Levels levels;
    const Level *level; // finest
    CutFinder finder;
    double h; // mean edge [m]
    int faces, vertices;
    int *ring_start, *ring; // faces around each vertex, ascending
    int *all;               // 0, 1, ...
    unsigned char *broken;  // [faces]
    int (*corner)[3];       // [faces]
    int node_count;
    int *origin;           // [3 faces] of a node
    Vec3 *x;               // [3 faces] of a node
    LipCrossing *crossing; // [edges]
    Vec3 *shown;           // [3 faces] where the nodes are shown: after cut_model_show
    // scratch of the rule and the checks
    int (*old_corner)[3];
    Vec3 *old_x;
    int *root, *id, *piece;
} CutModel;

// Prints the shape's name, for the report.
void cut_model_create(CutModel *model, CutShape shape);
void cut_model_destroy(CutModel *model);
// Whole again, bent from the rest shape by so much (0: not at all).
void cut_model_reset(CutModel *model, double bend);
// Bends, stretches and ripples the surface as it rests, by up to a quarter of its size.
void cut_model_deform(CutModel *model, double amount);
Vec3 cut_model_deformed(const CutModel *model, Vec3 rest, double amount);

CutTissue cut_model_tissue(const CutModel *model);
// Finds, smooths, keeps the crossings and breaks.
CutVerdict cut_model_cut(CutModel *model, const BladeEdge *edge, int edges, CutCare care);
// One tick of a stroke: finds, keeps the crossings and breaks. Returns how many links broke.
int cut_model_stroke(CutModel *model, const CutSweep *sweep);
// Breaks what the finder found, and splits vertices.
void cut_model_break(CutModel *model);
// Fills model->shown.
void cut_model_show(CutModel *model);
// Nodes in excess of vertices.
int cut_model_copies(const CutModel *model);
// Fails the test unless every invariant of wall_check.h holds, of pieces by unbroken links, and
// faces are where they were.
WallShape cut_model_expect_sound(CutModel *model);

#endif
