// What a body of any model is created from; the options of each model begin with these.
#ifndef PLIANT_DYNAMICS_BODY_OPTIONS_H
#define PLIANT_DYNAMICS_BODY_OPTIONS_H

#include "base/isa.h"
#include "base/team.h"
#include "dynamics/body.h"
#include "dynamics/region.h"

#include <stdio.h>

typedef struct BodyOptions {
    const char *name;
    int levels;    // surface: finest level of detail; voxel: coarsest level of elements; from 0
    bool cuttable; // blades can cut it
    IntegratorKind integrator;
    double time_step; // [s]; 0: from the stability bound
    bool unsafe_time_step;
    double contact_ratio, contact_damping, friction; // see dynamics/body.h
    int node_capacity, face_capacity; // most in use at the same time; 0: enough for all levels. Of
                                      // a voxel body that can be cut: vertices and outer triangles
    int fixed_count;
    const FixedRegion *fixed;
    // Initial state [m], [m/s], or NULL: at rest; [initial_count] in mesh order, of a voxel body by
    // ascending vertex id. A surface body has one for each node of its mesh.
    int initial_count;
    const Vec3 *initial_position, *initial_velocity;
    Vec3 gravity;
    Precision precision;   // of the kernels: single is faster, double is the reference
    bool without_contacts; // nothing can touch or attach to it: no arrays for such forces
    bool without_loads;    // no loads can act on it: no array for external forces
    const char *isa;       // "auto" or a name of isa.h
    Team *team;            // shares the work of large bodies; NULL: one thread; outlives the body
} BodyOptions;

// An isotropic elastic material, of bodies that are made of elements.
typedef struct SolidMaterial {
    double youngs_modulus; // E [Pa]
    double poisson_ratio;  // nu, [0, 0.49]; 0 with the law of Miyazaki et al. 2004
    double density;        // rho [kg/m3]
} SolidMaterial;

// Returns a body with the fields that follow from the options; the model sets the others.
static inline Body body_of_options(const BodyOptions *options, const BodyOps *ops, void *model)
{
    Body body = {
        .ops = ops,
        .model = model,
        .integrator = options->integrator,
        .contact_share = 1.0,
        .contact_ratio = options->contact_ratio,
        .contact_damping = options->contact_damping,
        .tuning = {.friction = options->friction, .stiffness_scale = 1.0, .damping_scale = 1.0},
        .time_step_wanted = options->time_step,
        .unsafe_time_step = options->unsafe_time_step,
    };
    snprintf(body.name, sizeof body.name, "%s", options->name);
    return body;
}

#endif
