// How masses, springs and shape springs follow from the material and the level of detail: the one
// place of these rules, for bodies of one level, held at a level, and adaptive. Load time; the pure
// functions of it whenever the topology changes.
//
// ADJUST_CONTINUUM (surface.md section 2) follows an elastic wall. A face of level l has a quarter
// of the area of its parent. It gives a third of its mass rho_A A to each of its nodes, and E2D A /
// L^2 to each of its edges, L being the rest length at that level (Van Gelder 1998). Uniform
// materials keep their stiffness at every level, and their mass, spread by area: rho_A = N m / A.
//
// ADJUST_CHOI2005 gives all nodes and springs of a level the same: m_l = m_0 N_0 / N_l (eq 6),
// where levels meet the mean over a node's active edges (eq 7), and k_l = 2^l k_0 m_l / m_0 (eq 8,
// as printed). m_0 and k_0 are those of a uniform material, else the mean over level 0 of what the
// continuum gives.
//
// In both, damping of springs keeps its ratio to stiffness (KD of eq 8), and shape springs and node
// damping follow the nodal mass; given a node, they are meant for the mean node of level 0.
#ifndef PLIANT_SURFACE_LEVEL_RULES_H
#define PLIANT_SURFACE_LEVEL_RULES_H

#include "surface/surface.h"

typedef struct LevelRules {
    const Levels *levels;          // NULL: one level
    const SurfaceOptions *options; // kept by reference
    bool same_springs, same_nodes; // every spring (node) of a level has the same stiffness (mass)
    double stiffness[LEVELS_MAX + 1]; // if same_springs [N/m]
    double mass[LEVELS_MAX + 1];      // if same_nodes [kg]
    double areal_density;             // if not [kg/m2]
    double
        mean_mass;  // of a node of level 0 [kg]; 0 with one level: values a node are meant as such
    double *area;   // [faces of level 0] at rest [m2]; owned
    int face_count; // of level 0
} LevelRules;

// For the mesh itself with levels = 0, else for options->hierarchy.
void level_rules_create(LevelRules *rules, const TriMesh *mesh, const SurfaceOptions *options);
void level_rules_destroy(LevelRules *rules);

// Rest area of a face of a level [m2].
double level_rules_area(const LevelRules *rules, int level, int face);
// What a face of that area adds to an edge of that rest length [N/m], unless same_springs.
double level_rules_face_stiffness(const LevelRules *rules, double area, double length);
// Mass of a node that has a third of its faces' areas [m2], in a mesh wholly of one level [kg].
double level_rules_node_mass(const LevelRules *rules, int level, double area);
// Eq 7: the mass of a node with edges[l] active edges of level l [kg], if same_nodes.
double level_rules_mixed_mass(const LevelRules *rules, const int *edges);
// Of a node of that mass: k'_s [N/m], k'_d [N s/m] and gamma of eq 1 [N s/m].
double level_rules_shape_stiffness(const LevelRules *rules, double mass);
double level_rules_shape_damping(const LevelRules *rules, double mass);
double level_rules_node_damping(const LevelRules *rules, double mass);

// Bounds of M^-1 K [1/s2] by its row sums, over the free nodes of the body wholly at a level:
// `springs` without shape springs. fixed [nodes of the level]; if all are, over all nodes.
typedef struct LevelBounds {
    double springs, lambda;
} LevelBounds;
LevelBounds level_rules_bounds(const LevelRules *rules, int level, const bool *fixed);

// Eq 9: with ADJUST_CHOI2005 the time step of level 0 is halved with each level that is in use.
// Raises the bounds of a body to those of such a step, where the stability bound asks for less.
void level_rules_raise_bounds(const LevelRules *rules, int level, double lambda_0, double damping_0,
                              double *lambda, double *damping);

// The damping time of springs [s] where the stiffest of them have the bound `springs`: a physical
// one is shortened to 0.8 / sqrt(springs), beyond which it would dictate the time step.
double level_rules_damping_time(const LevelRules *rules, double springs);

#endif
