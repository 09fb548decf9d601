// Eigenvalues of small symmetric matrices, accurate to rounding in every case (equal and zero
// eigenvalues included).
#ifndef PLIANT_VOXEL_JACOBI_H
#define PLIANT_VOXEL_JACOBI_H

enum { JACOBI_MAX = 4 };

// Diagonalises the leading n x n block, n <= JACOBI_MAX, by cyclic Jacobi sweeps. `a` becomes
// diagonal: the eigenvalues, unordered; the columns of `v` are the eigenvectors, orthonormal to
// rounding. Entries must be finite and their squares must neither overflow nor underflow; the
// result is then finite. Deterministic.
void jacobi_diagonalise(int n, double a[JACOBI_MAX][JACOBI_MAX], double v[JACOBI_MAX][JACOBI_MAX]);

#endif
