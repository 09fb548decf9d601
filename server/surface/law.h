// SPDX-License-Identifier: MIT
// Laws of springs beside the linear one: Maxwell branches (README.md, "Relaxation") and stiffening
// (README.md, "Stiffening"). The kernel's part is kernel/law.h. Each end of a spring has dashpots
// of its own: both are computed from the same bits, and stay the same.
#ifndef PLIANT_SURFACE_LAW_H
#define PLIANT_SURFACE_LAW_H

#include "surface/model.h"

// Returns the largest stiffness of springs over that of the linear law: to fast strains, and as far
// as they stiffen.
double law_rigidity(const SurfaceMaterial *material);
// True if a body that chooses its integrator must take an explicit one.
bool law_is_explicit(const SurfaceMaterial *material);

// Load time: sets the model's law; then, once the springs have their tables, creates what it keeps
// of them.
void law_choose(SurfaceModel *model, const SurfaceOptions *options);
void law_create(SurfaceModel *model, const SurfaceMaterial *material, size_t entries,
                const char *name, Arena *arena, StateList *state);

// Relaxes all springs at the rest shape.
void law_rest(SurfaceModel *model);

// A spring as it is, by the linear law's stiffness. Step thread.
typedef struct LawSpring {
    double energy;  // [m2]
    double pull;    // [m]
    double tangent; // to strains of a duration
} LawSpring;
// By its entry and extension [m].
LawSpring law_spring(const SurfaceModel *model, long at, double extension, double duration);

#endif
