// SPDX-License-Identifier: MIT
// Springs and masses of a surface body. LevelRules: how masses, springs and shape springs follow
// from the material and the level of detail: the only place of these rules, for bodies of one
// level, bodies kept at a level, and adaptive bodies. SpringNetwork: their values in a mesh. Load
// time; the pure functions of the rules also whenever the topology changes.
//
// Derived in README.md, "Springs and masses from the material" and, for levels, in
// detail/README.md, "Properties that follow the level".
//
// ADJUST_CONTINUUM models an elastic wall. A face of level l has a quarter of the area of its
// parent. It gives a third of its mass rho_A A to each of its nodes, and E2D A / L^2 to each of its
// edges, with L the rest length at that level (Van Gelder 1998). Uniform materials keep their
// stiffness at every level; their mass is distributed by area: rho_A = N m / A.
//
// ADJUST_CHOI2005 gives all nodes and springs of a level the same values: m_l = m_0 N_0 / N_l (eq
// 6), the mean over a node's active edges where levels meet (eq 7), and k_l = 2^l k_0 m_l / m_0 (eq
// 8, as printed). m_0 and k_0 are those of a uniform material, else the mean over level 0 of the
// continuum rule.
//
// In both, damping of springs keeps its ratio to stiffness (KD of eq 8), and shape springs and node
// damping are proportional to the nodal mass; values given per node refer to the mean node of level
// 0.
#ifndef PLIANT_SURFACE_NETWORK_H
#define PLIANT_SURFACE_NETWORK_H

#include "geometry/edges.h"
#include "surface/surface.h"

typedef struct LevelRules {
    const Levels *levels;          // NULL: one level
    const SurfaceOptions *options; // kept by reference
    bool same_springs, same_nodes; // the same stiffness (mass) for every spring (node) of a level
    double stiffness[LEVELS_MAX + 1]; // if same_springs [N/m]
    double mass[LEVELS_MAX + 1];      // if same_nodes [kg]
    double areal_density;             // otherwise [kg/m2]
    double mean_mass; // mean of a node of level 0 [kg]; 0 with one level: values per node apply as
                      // given
    double *area;     // [faces of level 0] at rest [m2]; owned
    int face_count;   // of level 0
} LevelRules;

// Prepares the rules for the mesh itself with levels = 0, else for options->hierarchy. `rules` owns
// its arrays and keeps the options by reference.
void level_rules_create(LevelRules *rules, const TriMesh *mesh, const SurfaceOptions *options);
void level_rules_destroy(LevelRules *rules);

// Returns the rest area of a face of a level [m2].
double level_rules_area(const LevelRules *rules, int level, int face);
// Returns what a face of that area adds to an edge of that rest length [N/m]; not if same_springs.
double level_rules_face_stiffness(const LevelRules *rules, double area, double length);
// Returns the mass [kg] of a node with a third of its faces' areas [m2], in a mesh of one level.
double level_rules_node_mass(const LevelRules *rules, int level, double area);
// Returns the mass of a node with edges[l] active edges of level l [kg], if same_nodes (eq 7).
double level_rules_mixed_mass(const LevelRules *rules, const int *edges);
// Return k'_s [N/m], k'_d [N s/m] and gamma of eq 1 [N s/m] of a node of that mass [kg].
double level_rules_shape_stiffness(const LevelRules *rules, double mass);
double level_rules_shape_damping(const LevelRules *rules, double mass);
double level_rules_node_damping(const LevelRules *rules, double mass);

// Bounds of M^-1 K [1/s2] by its row sums, over the free nodes of a body that is entirely at one
// level; `springs` without shape springs, by the linear law; `linear` with them. fixed [nodes of
// the level]; if all are fixed, over all nodes.
typedef struct LevelBounds {
    double springs, linear, lambda;
} LevelBounds;
LevelBounds level_rules_bounds(const LevelRules *rules, int level, const bool *fixed);

// Raises the bounds of a body to those of the time step of eq 9, where the stability bound alone
// allows a longer one: with ADJUST_CHOI2005 the step of level 0 is halved for each level in use.
void level_rules_raise_bounds(const LevelRules *rules, int level, double lambda_0, double damping_0,
                              double *lambda, double *damping);

// Returns the damping time of springs [s] whose stiffest have the bound `springs`: a physical one
// is shortened to 0.8 / sqrt(springs), beyond which it would dictate the time step.
double level_rules_damping_time(const LevelRules *rules, double springs);

// Springs and masses of a triangle mesh at rest, by these rules. All arrays by edge or node of the
// mesh, owned; network_destroy frees them.
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
    double finest_linear;                 // finest_lambda by the linear law
    double contact_lambda;                // lambda of level 0, by the linear law
    double total_mass;                    // [kg]
    int free_count;
} SpringNetwork;

// Builds the network of the mesh, which is options->start_level of options->hierarchy if there are
// levels. False with `status` if a region fixes nodes that the mesh does not have.
bool network_create(SpringNetwork *network, const TriMesh *mesh, const WingedMesh *winged,
                    const SurfaceOptions *options, Status *status);
void network_destroy(SpringNetwork *network);

// Marks the nodes that the scene fixes: sets fixed[] (zeroed; one entry per node of `mesh`, or of
// the finest level of options->hierarchy). Regions select nodes of level 0; a midpoint is fixed
// when both its parents are. False with `status` if a region names nodes that the mesh does not
// have.
bool fixed_mark(const TriMesh *mesh, const SurfaceOptions *options, bool *fixed, Status *status);

#endif
