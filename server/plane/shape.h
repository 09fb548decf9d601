// SPDX-License-Identifier: MIT
// The rest shape of a plane element of edge 1 and its elastic behaviour. A square, or a union of
// its quarters, has up to nine places for vertices: those of a 3 x 3 grid, numbered x + 3 y. The
// corners of its outline are always present; places inside an edge are when a neighbour has a
// corner there ("hanging" vertices, true vertices of the element); others are not. Load time only.
#ifndef PLIANT_PLANE_SHAPE_H
#define PLIANT_PLANE_SHAPE_H

typedef enum PlaneLaw {
    PLANE_AFFINE,       // area vectors for the uniform part, weighted residual for the rest
    PLANE_MIYAZAKI2004, // the paper's force k (R R0_i - r_i)
} PlaneLaw;

enum { PLANE_PLACES = 9, PLANE_CENTER = 4 };

// For an edge of 1; with edge H, rest and area scale by H, extent by H^2.
typedef struct PlaneShape {
    unsigned quarters, present;   // bits x + 2 y of quarters, x + 3 y of places with a vertex
    int count;                    // vertices
    int at[PLANE_PLACES];         // [count] places of the vertices, ascending
    double rest[PLANE_PLACES][2]; // [count] X_i relative to the mean by `share`; sum share X = 0
    double area[PLANE_PLACES][2]; // [count] a_i; sum 0, sum X_i a_i^T = extent * 1
    double share[PLANE_PLACES];   // [count] fraction of the element's mass and residual; > 0, sum 1
    double mean[2];               // origin of `rest`, from the square's middle
    double extent;                // area of the element: quarters / 4
} PlaneShape;

// How the outline of a union of quarters passes a place: it turns there, runs straight through it,
// or does not pass it.
typedef enum PlanePassing { PLANE_ABSENT, PLANE_STRAIGHT, PLANE_CORNER } PlanePassing;
PlanePassing plane_passing(unsigned quarters, int place);

// Lists the places on the outline, counter-clockwise; returns their number, at most 8.
int plane_outline(unsigned quarters, int place[PLANE_PLACES]);

// Creates a shape. PLANE_AFFINE: each quarter has the area vectors of a square (half the two sides
// that meet at a corner), in which shared sides cancel; an absent place inside an edge gives half
// of its vector to each end, as the displacement there is their mean. Weights are cone areas a_i .
// X_i of the whole square, or those of its quarters. PLANE_MIYAZAKI2004: equal shares for all
// vertices: the centre of gravity is their mean (section 2.2 of the paper). `present` must contain
// every corner and nothing off the outline.
void plane_shape_create(PlaneShape *shape, PlaneLaw law, unsigned quarters, unsigned present);

// A sheet of this material, free at its faces (plane stress), so that E is the Young's modulus of a
// strip in tension: mu = E / (2 (1 + nu)), lambda = E nu / (1 - nu^2).
typedef struct PlaneStiffness {
    PlaneLaw law;
    double mu, lambda; // times thickness [N/m] (PLANE_AFFINE)
    double residual;   // total [N/m]: distributed by share
    double damping;    // total [N s/m], likewise; 0: none
} PlaneStiffness;

// Computes the stiffness of a shape. PLANE_AFFINE: the residual of a square is alpha k at each of
// four vertices with k = 2 mu and alpha = (1 + nu) / 3: the energy of pure bending is then exact (8
// mu alpha q^2 = 4/3 E q^2 for corners displaced by +-q). PLANE_MIYAZAKI2004: k = 2 E extent / sum
// |X_i|^2 per vertex, k = E for a square: the energy of an isotropic strain, k e^2 sum |X_i|^2 / 2,
// is that of the continuum with nu = 0, E e^2 extent. `beta` [s]: damping per stiffness 2 mu of a
// square, or per k.
void plane_stiffness(PlaneStiffness *stiffness, const PlaneShape *shape, double youngs_modulus,
                     double poisson_ratio, double thickness, double beta);

// Adds forces [N] of an element of edge `size` [m] to `force` [count]; returns the energy [J].
// Positions [m] and, unless NULL, velocities [m/s] of its vertices in their order. The best
// rotation has a closed form and needs no start; where all rotations fit equally it is none. The
// reference for the kernels.
double plane_shape_forces(const PlaneShape *shape, const PlaneStiffness *stiffness, double size,
                          const double (*position)[2], const double (*velocity)[2],
                          double (*force)[2]);

// Returns the largest eigenvalue of the stiffness of the element at rest relative to its shares
// [N/m]; for a mass m that of M^-1 K is this over m. By Jacobi's method.
double plane_shape_eigenvalue(const PlaneShape *shape, const PlaneStiffness *stiffness);

#endif
