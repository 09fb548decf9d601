// SPDX-License-Identifier: MIT
// Where the lips of a cut are (README.md, "Lips"). Each broken edge keeps where the blade's sheet
// crossed the tissue beside it, and the sheet's normal, both at rest. From these follows where the
// vertices of the path are shown and touched: on the sheet, while springs, masses and rest
// positions stay as built. A place is carried by the vertex and the edges of one face at it, so
// that it deforms with the tissue, and forces go back to three nodes. Pure functions. Step thread.
#ifndef PLIANT_SURFACE_CUT_CUT_LIPS_H
#define PLIANT_SURFACE_CUT_CUT_LIPS_H

#include "body/region.h"
#include "surface/cut/cut_find.h"

#define LIP_CROSSING_MOST 3.0 // [h] of a crossing from the middle of its edge at rest
#define LIP_MOST          0.8 // [h] no vertex is shown farther from where it is at rest

enum { LIPS_RING = 32 }; // a vertex with more faces around it has no lips

// Of one broken edge; plain data, part of the state.
typedef struct LipCrossing {
    float at[3];     // on the sheet, beside the middle of the edge; rest shape [m]
    float normal[3]; // of the sheet there, unit; zero: none is known, as after a tear
} LipCrossing;

// What the place of a lip follows from.
typedef struct LipMesh {
    const Level *level;          // finest
    const Vec3 *rest;            // [vertices of the finest level] of the uncut mesh [m]
    const unsigned char *broken; // as in CutTissue
    const LipCrossing *crossing; // [edges of the finest level] read of broken ones
    double h;                    // mean edge at rest [m]
} LipMesh;

// A node is shown at x + share[0] (a - x) + share[1] (b - x), with a and b the corners of a face
// that follow its own.
typedef struct Lip {
    int face, corner;
    double share[2];
} Lip;

// Finds the crossings of the edges that break, finder->edge, and writes them by edge; others stay.
// Call it before links are broken, with the tissue of the finder's call. `rest` as in LipMesh. Of a
// command, after smoothing:
void cut_lips_whole(const CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge,
                    int edges, const Vec3 *rest, LipCrossing *crossing);
// Of one tick of a stroke:
void cut_lips_tick(CutFinder *finder, const CutTissue *tissue, const Vec3 *rest,
                   LipCrossing *crossing);
// Of an edge beside what a remover takes: on its mouth. Both faces are listed.
void cut_lips_around(const CutFinder *finder, const CutTissue *tissue, int edge,
                     const Region *mouth, const Vec3 *rest, LipCrossing *crossing);
// Forgets the crossings of the edges that were to break.
void cut_lips_forget(const CutFinder *finder, LipCrossing *crossing);

// Finds the lips of a vertex, which is this corner of this face in the uncut mesh: one for each
// part into which broken edges divide the faces around it. Returns their number; 0: it is shown
// where it is.
int cut_lips_place(const LipMesh *mesh, int face, int corner, Lip lip[LIPS_RING]);

#endif
