// Parameters of plane elements: shapes that occur, each created once, and the stiffness, mass and
// bound of an element of a shape. Does not allocate after plane_forms_create.
#ifndef PLIANT_PLANE_FORMS_H
#define PLIANT_PLANE_FORMS_H

#include "plane/model.h"

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

#endif
