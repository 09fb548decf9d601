// Laws of springs beside the linear one: Maxwell branches (README.md, "Relaxation"). The kernel's
// part is kernel/law.h. Each end of a spring has dashpots of its own: both are computed from the
// same bits, and stay the same.
#ifndef PLIANT_SURFACE_LAW_H
#define PLIANT_SURFACE_LAW_H

#include "surface/model.h"

// Returns the largest stiffness of springs to fast strains over that of the linear law.
double law_rigidity(const SurfaceMaterial *material);
// False with `status`: a law that the integrator does not know.
bool law_fits(const SurfaceOptions *options, Status *status);

// Load time: sets the model's law; then, once the springs have their tables, creates what it keeps
// of them.
void law_choose(SurfaceModel *model, const SurfaceMaterial *material);
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
