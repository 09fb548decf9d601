// Springs and masses of a triangle mesh at rest, from the material of a surface body.
#ifndef PLIANT_SURFACE_NETWORK_H
#define PLIANT_SURFACE_NETWORK_H

#include "geometry/winged_edge.h"
#include "surface/surface.h"

// All arrays by edge or node of the mesh, owned; network_destroy frees them.
typedef struct SpringNetwork {
    double *rest_length;       // [edge_count] prestress included [m]
    double *stiffness;         // [edge_count] k_s [N/m]
    double *face_area;         // [face_count] [m2]
    double *node_area;         // [node_count] a third of the faces around [m2]
    double *mass;              // [node_count] [kg]
    double *shape_stiffness;   // [node_count] k'_s [N/m]; zero without shape springs
    double *shape_damping;     // [node_count] k'_d [N s/m]
    double *node_damping;      // [node_count] gamma of eq 1 [N s/m]
    bool *fixed;               // [node_count], up to the finest level if there are levels
    double damping_time;       // k_d / k_s, clamped [s]
    double asked_damping_time; // as the material specifies it [s]
    bool clamped;              // it was too long for the stiffness
    double lambda;             // bound of M^-1 K over free nodes [1/s2]
    double damping;            // bound of M^-1 C over free nodes [1/s]
    double finest_lambda, finest_damping; // the same at the finest level
    double contact_lambda;                // lambda of level 0
    double total_mass;                    // [kg]
    int free_count;
} SpringNetwork;

// Builds the network of the mesh, which is options->start_level of options->hierarchy if there are
// levels. False with `status` if a region fixes nodes that the mesh does not have.
bool network_create(SpringNetwork *network, const TriMesh *mesh, const WingedMesh *winged,
                    const SurfaceOptions *options, Status *status);
void network_destroy(SpringNetwork *network);

#endif
