// Eigenvalues of small symmetric matrices, to rounding in every case (equal ones and zeros too).
#ifndef PLIANT_VOXEL_JACOBI_H
#define PLIANT_VOXEL_JACOBI_H

enum { JACOBI_MAX = 4 };

// Cyclic Jacobi sweeps over the leading n x n block, n <= JACOBI_MAX. `a` becomes diagonal: the
// eigenvalues, in no order; the columns of `v` are the eigenvectors, orthonormal to rounding.
// Entries must be finite and of a size whose squares are neither too large nor too small; the
// result is then finite. The same input gives the same bits.
void jacobi_diagonalise(int n, double a[JACOBI_MAX][JACOBI_MAX], double v[JACOBI_MAX][JACOBI_MAX]);

#endif
