// SPDX-License-Identifier: MIT
// The rotation that fits a deformation best: argmax of tr(R^T A) over rotations, in every state;
// and the eigenvalues of small symmetric matrices, which it needs.
#ifndef PLIANT_VOXEL_ROTATION_H
#define PLIANT_VOXEL_ROTATION_H

#include "base/vec.h"

#include <stdbool.h>

// Fits one element in double precision: for elements that the kernels' fast path cannot handle, and
// as the reference. A by rows, of any magnitude. `last` (any quaternion) is the rotation of the
// step before and decides where A alone does not (a line, a point, a mirror image): the nearest of
// all best rotations is chosen. The result replaces it. Method: FOAM (Markley 1993) with 12 Newton
// steps where zeta > 0.01 lambda^3; otherwise the eigenvector of Davenport's 4 x 4 matrix by
// Jacobi's method, which is exact in every state (tried and rejected: Mueller et al. 2016, whose
// iteration stops short of the best rotation in nearly flat and inverted states and then leaves a
// moment). For any A, the result is a rotation to rounding and A R^T symmetric to rounding. An A
// that is not finite counts as zero.
void rotation_fit(const double a[3][3], double rotation[3][3], Quat *last);

// FOAM alone, as in the kernels, with the given number of Newton steps; also gives tr(R^T A).
// Entries of A must have fourth powers that neither overflow nor underflow. False when zeta < 0.1
// lambda^3: too near to a flat or inverted state to be exact.
bool rotation_foam(const double a[3][3], int steps, double rotation[3][3], double *trace);

enum { JACOBI_MAX = 4 };

// Diagonalises the leading n x n block, n <= JACOBI_MAX, by cyclic Jacobi sweeps, accurate to
// rounding in every case (equal and zero eigenvalues included). `a` becomes
// diagonal: the eigenvalues, unordered; the columns of `v` are the eigenvectors, orthonormal to
// rounding. Entries must be finite and their squares must neither overflow nor underflow; the
// result is then finite. Deterministic.
void jacobi_diagonalise(int n, double a[JACOBI_MAX][JACOBI_MAX], double v[JACOBI_MAX][JACOBI_MAX]);

#endif
