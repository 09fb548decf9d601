// Plane elements as numbers: shapes that occur, each made once, and the stiffness, mass and bound
// of an element of a shape. Nothing here allocates after plane_forms_create.
#ifndef PLIANT_VOXEL_PLANE_PLANE_FORMS_H
#define PLIANT_VOXEL_PLANE_PLANE_FORMS_H

#include "voxel/plane/plane_model.h"

typedef struct PlaneForms {
    const VoxelMaterial *material; // [material_count] a copy
    int material_count;
    VoxelLaw law;
    double size;       // of a cell, and thickness of the sheet [m]
    double beta;       // damping in terms of the stiffness [s]
    short *find;       // [keys] where in `shape`, from 1; 0: not yet made
    PlaneShape *shape; // [capacity]
    double *unit;      // [material_count][capacity] largest eigenvalue over E thickness; 0: unknown
    int count, capacity;
    double lambda;         // largest so far of an element: bound of M^-1 K [1/s2]
    double damping_lambda; // of M^-1 C, a second of beta [1/s2]
} PlaneForms;

// `all`: makes every shape that can ever be, and the bounds of them all on squares of two cells and
// of one: for bodies that are cut. Then sets beta from the options' damping.
void plane_forms_create(PlaneForms *forms, const VoxelOptions *options, const PlaneLayout *layout,
                        const PlaneMesh *mesh, bool all, Arena *arena);
// `vertex` [PLANE_PLACES] by place, -1: not there.
void plane_form_set(PlaneForms *forms, PlaneForm *form, const PlaneElement *element,
                    const int vertex[PLANE_PLACES]);
double plane_form_mass(const PlaneForms *forms, const PlaneForm *form); // [kg]

#endif
