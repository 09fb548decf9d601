// SPDX-License-Identifier: MIT
// Private to the plane body: plane bodies that are cut (Miyazaki et al. 2004, section 3).
//
// Two sets of bits define everything: which quarters are left to each square, and which edges
// between cells are broken. Quarters are only ever removed, and edges only ever break. Everything
// else (elements, vertices, masses, batches, outline, published mesh) is a pure function of them,
// except the rows of vertices: a vertex keeps its row, a new one takes the next. Plane bodies are
// small, so all of it is rebuilt after a change; nothing allocates.
#ifndef PLIANT_PLANE_CUT_H
#define PLIANT_PLANE_CUT_H

#include "plane/model.h"

enum { CENTER_BEGAN = 1, CENTER_KNOWN = 2 };

// The centre of a cell in a stroke.
typedef struct PlaneCenter {
    int64_t known; // 0; CENTER_BEGAN: no sweep has ended there yet; CENTER_KNOWN
    CutPoint point;
} PlaneCenter;

// The outline for tools and loads: the arrays of BodySurface.
typedef struct PlaneStrip {
    int (*face)[3], (*neighbor)[3];
    double *area, *finest_area, *node_area, *node_mass;
    int *start, *end, *list;
    int *edge_from; // [vertex_capacity] edge of the outline that starts there; -1: none
} PlaneStrip;

typedef struct PlaneCut {
    // --- constant ---
    PlaneLayout layout; // every aligned square is an element, with or without quarters of its own
    char name[BODY_NAME_MAX];
    int points;     // of the lattice
    int cell_count; // of layout.count
    PlaneRoom room;
    PlaneForms forms;
    bool *fixed_point; // [points]
    bool *is_solid;    // [cell_count]
    int vertex_capacity;
    double tear_force; // [N]; 0: no tearing
    int blades;

    // --- state ---
    unsigned char *quarters; // [layout.element_count] as layout.element's
    unsigned char *broken;   // [cell_count] PLANE_BROKEN_...
    int *id;                 // [vertex_capacity] id of a vertex; -1: does not exist yet
    int64_t *wants;          // 1: something broke or was carved since the last reconstruction
    PlaneCenter *center;     // [blades][cell_count]; NULL without blades
    double *felt; // [vertex_capacity] square of the largest external force in the last tick [N2];
                  // NULL without tear_force

    bool is_valid; // plane_cut_restore succeeded, or was not called

    // --- derived from the state ---
    PlaneMesh mesh; // with vertices in its own order
    PlaneStrip strip;
    int *row_of;                  // [mesh vertices] row
    int *row_of_id;               // [4 points] -1: none
    int (*vertex)[PLANE_PLACES];  // [element] rows by place; -1: not there
    int *origin_id, (*parent)[2]; // [vertex_capacity] of published nodes
    int *piece;                   // [vertex_capacity]
    signed char *level;           // [vertex_capacity]
    int (*triangle)[3];           // published

    // --- scratch ---
    int (*before)[PLANE_PLACES];    // [element] rows before the change
    unsigned char *quarters_before; // [element]
    double *mass_before;            // [vertex_capacity]
    NodeBirth *birth;               // [2 vertex_capacity]
    CutPath *path;                  // [cell_count] in the sweep in progress
    int *cells_of_piece;
    LinkFinder links; // by plane_cut_link; those met are to be broken
} PlaneCut;

// Returns the link across an edge of a cell, PLANE_BROKEN_...
static inline int plane_cut_link(int cell, int bit)
{
    return 2 * cell + (bit == PLANE_BROKEN_UP);
}

// cut_create.c. Load time: creates the tables of a cuttable body, whose first vertices have
// the rows of plane_mesh_create; `fixed` by these.
void plane_cut_create(PlaneModel *model, const PlaneOptions *options, const bool *fixed,
                      Arena *arena, StateList *state);

// cut.c. Builds the mesh of the current bits; false: it has more vertices than the capacity.
bool plane_cut_fill_mesh(PlaneCut *cut);
// Rebuilds everything that follows from the bits and rows.
void plane_cut_make(PlaneModel *model, Body *body);
// Fills in pieces and small_pieces.
void plane_cut_count_pieces(PlaneCut *cut, CutOutcome *outcome);
// Breaks links and rebuilds everything. False: `needed` more vertices do not fit into `room`;
// nothing is changed.
bool plane_cut_break(Body *body, const int *link, int count, CutOutcome *outcome,
                     TopologyChange *change);
// BodyOps.reconstruct: carves the quarters that must be: each element at most once.
bool plane_cut_reconstruct(Body *body, TopologyChange *change);

// cut_rows.c, after the mesh was filled: assigns rows to its vertices by their ids, new ones
// at the end; then elements, masses, and the momentum that the exchange of masses has changed.
void plane_cut_take_rows(PlaneModel *model, TopologyChange *change);
void plane_cut_assign_row(PlaneModel *model, int v, int row);
void plane_cut_make_masses(PlaneModel *model);
void plane_cut_keep_momentum(PlaneModel *model);

// cut_create.c. After the state was restored. False: it is impossible.
bool plane_cut_restore(Body *body);

// cut_blade.c: BodyOps.cut and reserve_blades.
bool plane_cut_along(Body *body, const CutSweep *sweep, CutOutcome *outcome,
                     TopologyChange *change);
void plane_cut_reserve_blades(void *model, int blades, Arena *arena, StateList *state);

// cut.c: the paper's threshold for tearing. Records the external forces before those of elements
// are added; BodyOps.tear.
void plane_cut_feel(PlaneModel *model);
bool plane_cut_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change);

// surface.c: the outline as a strip of nodes 2 v and 2 v + 1 of vertex v, and the
// published mesh.
void plane_cut_create_surface(PlaneModel *model, Body *body, const PlaneOptions *options,
                              Arena *arena);
void plane_cut_show(PlaneModel *model, Body *body);

#endif
