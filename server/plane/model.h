// SPDX-License-Identifier: MIT
// Private to the plane body: its arrays. Constant after creation unless noted.
#ifndef PLIANT_PLANE_MODEL_H
#define PLIANT_PLANE_MODEL_H

#include "body/vertices.h"
#include "plane/kernel.h"
#include "plane/mesh.h"
#include "plane/plane.h"

// An element in the form that the kernels and the energy use.
typedef struct PlaneForm {
    const PlaneShape *shape;
    PlaneStiffness stiffness;
    double size;              // [m]
    int material;             // from 1
    int vertex[PLANE_PLACES]; // [shape->count]
} PlaneForm;

// Scratch memory for filling the batches.
typedef struct PlaneSorting {
    int class_capacity;
    double (*class)[SQUARE_NUMBERS]; // [class_capacity]
    struct PlaneEntry *entry[4];     // [elements] each
} PlaneSorting;

typedef struct PlaneModel {
    Vertices vertices; // first, for their operations; z = 0
    int *vertex;       // [vertex_count] all of them in order: the published nodes

    int element_count;
    int element_at_level[PLANE_LEVELS_MAX + 1];
    PlaneForm *form; // [element_count]
    PlaneBatches batches;
    PlaneSorting sorting;
    int spare; // row of lanes without an element
    PlaneLaw law;
    const PlaneKernels *kernels;

    // --- nodes of the strip: 2 k below and 2 k + 1 above the k-th vertex of the outline; of a
    // cuttable body, for every vertex that can ever exist: those inside have no faces ---
    int node_count;
    int *node_vertex;                           // [node_count]
    const int *node_face_start, *node_face_end; // [node_count] as in BodySurface
    double half;                                // half the thickness [m]

    struct PlaneCut *cut; // of cuttable bodies, else NULL
} PlaneModel;

// plane.c: of a body without and with cuts, and with the paper's threshold too.
extern const BodyOps plane_ops, plane_ops_cuttable, plane_ops_tearing;

// --- forms.c: elements in the form of the kernels ---

// Parameters of plane elements: shapes that occur, each created once, and the stiffness, mass and
// bound of an element of a shape. Does not allocate after plane_forms_create.
typedef struct PlaneForms {
    const SolidMaterial *material; // [material_count] a copy
    int material_count;
    PlaneLaw law;
    double size;       // of a cell, and thickness of the sheet [m]
    double beta;       // damping per stiffness [s]
    short *find;       // [keys] index in `shape`, from 1; 0: not yet created
    PlaneShape *shape; // [capacity]
    double *unit;      // [material_count][capacity] largest eigenvalue over E thickness; 0: unknown
    int count, capacity;
    double lambda;         // largest of an element so far: bound of M^-1 K [1/s2]
    double damping_lambda; // of M^-1 C, per second of beta [1/s2]
} PlaneForms;

// `all`, for bodies that are cut: creates every possible shape, and their bounds for squares of two
// cells and of one. Then sets beta from the options' damping.
void plane_forms_create(PlaneForms *forms, const PlaneOptions *options, const PlaneLayout *layout,
                        const PlaneMesh *mesh, bool all, Arena *arena);
// Fills model->form, and counts the elements: those of the layout that have quarters. `vertex`
// [element] rows by place, -1: absent.
void plane_forms_fill(PlaneForms *forms, PlaneModel *model, const PlaneLayout *layout,
                      const int (*vertex)[PLANE_PLACES]);
// Adds the masses of the elements to those of their vertices; returns their sum [kg].
double plane_forms_add_masses(const PlaneForms *forms, PlaneModel *model);

// Load time: allocates the batches for this many elements, and classes of squares;
// then fills them from model->form.
void plane_reserve_batches(PlaneModel *model, int elements, int classes, const char *name,
                           Arena *arena);
void plane_fill_batches(PlaneModel *model);
// surface.c. Load time: creates what tools and loads act on, and the published mesh.
void plane_create_surface(PlaneModel *model, Body *body, const PlaneMesh *mesh,
                          const PlaneOptions *options, Arena *arena);
// After the surface: what contacts need of it.
void plane_create_firmness(Body *body, const BodyOptions *options, Arena *arena);
void plane_create_mesh(PlaneModel *model, Body *body, const PlaneMesh *mesh, const char *name,
                       Arena *arena);

#endif
