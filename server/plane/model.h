// Private to the plane body: its arrays. Constant after creation unless noted.
#ifndef PLIANT_PLANE_MODEL_H
#define PLIANT_PLANE_MODEL_H

#include "dynamics/vertices.h"
#include "plane/plane.h"
#include "plane/kernel.h"
#include "plane/mesh.h"

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
    struct PlanePlace *place[4];     // [elements] each
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

// batches.c. Load time: allocates the batches for this many elements, and classes of squares;
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
