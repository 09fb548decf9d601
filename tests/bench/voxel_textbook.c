// SPDX-License-Identifier: MIT
#include "voxel_textbook.h"

#include "base/check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void place_corner(VoxelTextbookElement *element, int corner, double size)
{
    for (int c = 0; c < 3; c++)
        element->rest[corner][c] = ((corner >> c & 1) - 0.5) * size;
}

void voxel_textbook_create(VoxelTextbook *textbook, int vertex_count, const double (*position)[3],
                           const double (*velocity)[3], int element_count, const int (*element)[8],
                           double size, double youngs_modulus, double nu, double density,
                           double beta)
{
    *textbook = (VoxelTextbook){
        .vertex_count = vertex_count,
        .element_count = element_count,
        .vertex = calloc((size_t)vertex_count, sizeof *textbook->vertex),
        .element = calloc((size_t)element_count, sizeof *textbook->element),
    };
    ASSERT(textbook->vertex != NULL && textbook->element != NULL);
    for (int i = 0; i < vertex_count; i++) {
        memcpy(textbook->vertex[i].x, position[i], sizeof textbook->vertex[i].x);
        if (velocity != NULL)
            memcpy(textbook->vertex[i].v, velocity[i], sizeof textbook->vertex[i].v);
    }
    double mu = youngs_modulus / (2.0 * (1.0 + nu));
    for (int e = 0; e < element_count; e++) {
        VoxelTextbookElement *out = &textbook->element[e];
        out->mu = mu;
        out->lambda = youngs_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
        out->residual = (1.0 + nu) / 3.0 * mu * size;
        out->damping = beta * mu * size;
        out->size = size;
        for (int i = 0; i < 8; i++) {
            out->vertex[i] = element[e][i];
            place_corner(out, i, size);
            textbook->vertex[element[e][i]].mass += density * size * size * size / 8.0;
        }
        for (int i = 0; i < 3; i++)
            out->rotation[i][i] = 1.0;
    }
}

void voxel_textbook_destroy(VoxelTextbook *textbook)
{
    free(textbook->vertex);
    free(textbook->element);
    *textbook = (VoxelTextbook){0};
}

// From the rotation before towards f's columns, until the turn is below 1e-10 (Mueller et al. 2016,
// "A robust method to extract the rotational part of deformations"). Converges slowly, but whatever
// f is.
static void turn_towards(const double f[3][3], double r[3][3])
{
    for (int step = 0; step < 100; step++) {
        double axis[3] = {0.0, 0.0, 0.0}, trace = 0.0;
        for (int k = 0; k < 3; k++) {
            axis[0] += r[1][k] * f[2][k] - r[2][k] * f[1][k];
            axis[1] += r[2][k] * f[0][k] - r[0][k] * f[2][k];
            axis[2] += r[0][k] * f[1][k] - r[1][k] * f[0][k];
            for (int c = 0; c < 3; c++)
                trace += r[c][k] * f[c][k];
        }
        double scale = 1.0 / (fabs(trace) + 1e-9);
        double angle = 0.0;
        for (int c = 0; c < 3; c++) {
            axis[c] *= scale;
            angle += axis[c] * axis[c];
        }
        angle = sqrt(angle);
        if (angle < 1e-10)
            break;
        // Rodrigues: each column turned about the axis.
        double s = sin(angle) / angle, t = (1.0 - cos(angle)) / (angle * angle), co = cos(angle);
        for (int k = 0; k < 3; k++) {
            double v[3] = {r[0][k], r[1][k], r[2][k]};
            double along = t * (axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2]);
            r[0][k] = co * v[0] + s * (axis[1] * v[2] - axis[2] * v[1]) + along * axis[0];
            r[1][k] = co * v[1] + s * (axis[2] * v[0] - axis[0] * v[2]) + along * axis[1];
            r[2][k] = co * v[2] + s * (axis[0] * v[1] - axis[1] * v[0]) + along * axis[2];
        }
    }
    // Rounding of many turns: make the rows orthonormal again.
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < i; j++) {
            double d = r[i][0] * r[j][0] + r[i][1] * r[j][1] + r[i][2] * r[j][2];
            for (int c = 0; c < 3; c++)
                r[i][c] -= d * r[j][c];
        }
        double n = 1.0 / sqrt(r[i][0] * r[i][0] + r[i][1] * r[i][1] + r[i][2] * r[i][2]);
        for (int c = 0; c < 3; c++)
            r[i][c] *= n;
    }
}

// The rotation nearest to f: Newton's iteration R <- (R + R^-T) / 2 (Higham 1986), which squares
// the error in each step. It would end at a reflection where f turns the element inside out.
static void extract_rotation(const double f[3][3], double rotation[3][3])
{
    double r[3][3], cofactor[3][3];
    memcpy(r, f, sizeof r);
    for (int step = 0; step < 20; step++) {
        for (int i = 0; i < 3; i++) {
            int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
            for (int j = 0; j < 3; j++) {
                int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
                cofactor[i][j] = r[i1][j1] * r[i2][j2] - r[i1][j2] * r[i2][j1];
            }
        }
        double det = r[0][0] * cofactor[0][0] + r[0][1] * cofactor[0][1] + r[0][2] * cofactor[0][2];
        if (det < 1e-3)
            break;
        double change = 0.0;
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) {
                double next = 0.5 * (r[i][j] + cofactor[i][j] / det);
                change = fmax(change, fabs(next - r[i][j]));
                r[i][j] = next;
            }
        }
        if (change < 1e-6) { // squared: 1e-12
            memcpy(rotation, r, sizeof r);
            return;
        }
    }
    turn_towards(f, rotation);
}

// Solves m x = b for a symmetric positive matrix by Cramer's rule.
static void solve3(const double m[3][3], const double b[3], double x[3])
{
    double c[3][3];
    for (int i = 0; i < 3; i++) {
        int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
        for (int j = 0; j < 3; j++) {
            int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            c[i][j] = m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1];
        }
    }
    double inverse = 1.0 / (m[0][0] * c[0][0] + m[0][1] * c[0][1] + m[0][2] * c[0][2]);
    for (int i = 0; i < 3; i++)
        x[i] = inverse * (c[0][i] * b[0] + c[1][i] * b[1] + c[2][i] * b[2]);
}

// Against the motion that is not one of a rigid body: -damping (v - v_mean - omega x r).
static void add_damping(const VoxelTextbookElement *element, const VoxelTextbookVertex *vertex,
                        const double r[8][3], double force[8][3])
{
    double mean[3] = {0.0, 0.0, 0.0}, spin[3] = {0.0, 0.0, 0.0}, inertia[3][3] = {{0.0}};
    for (int i = 0; i < 8; i++) {
        const double *v = vertex[element->vertex[i]].v;
        double square = r[i][0] * r[i][0] + r[i][1] * r[i][1] + r[i][2] * r[i][2];
        for (int c = 0; c < 3; c++) {
            int d = (c + 1) % 3, e = (c + 2) % 3;
            mean[c] += v[c] / 8.0;
            spin[c] += r[i][d] * v[e] - r[i][e] * v[d];
            inertia[c][c] += square;
            for (int k = 0; k < 3; k++)
                inertia[c][k] -= r[i][c] * r[i][k];
        }
    }
    double small = 1e-9 * (inertia[0][0] + inertia[1][1] + inertia[2][2]), omega[3];
    for (int c = 0; c < 3; c++)
        inertia[c][c] += small;
    solve3((const double(*)[3])inertia, spin, omega);
    for (int i = 0; i < 8; i++) {
        const double *v = vertex[element->vertex[i]].v;
        for (int c = 0; c < 3; c++) {
            int d = (c + 1) % 3, e = (c + 2) % 3;
            double rigid = mean[c] + omega[d] * r[i][e] - omega[e] * r[i][d];
            force[i][c] -= element->damping * (v[c] - rigid);
        }
    }
}

static void add_element(VoxelTextbookElement *element, VoxelTextbookVertex *vertex)
{
    double centre[3] = {0.0, 0.0, 0.0}, r[8][3], force[8][3] = {{0.0}};
    for (int i = 0; i < 8; i++) {
        for (int c = 0; c < 3; c++)
            centre[c] += vertex[element->vertex[i]].x[c] / 8.0;
    }
    for (int i = 0; i < 8; i++) {
        for (int c = 0; c < 3; c++)
            r[i][c] = vertex[element->vertex[i]].x[c] - centre[c];
    }
    // F = sum r_i X_i^T / (2 H^2): both the mean gradient and the best affine map.
    double f[3][3] = {{0.0}}, scale = 1.0 / (2.0 * element->size * element->size);
    for (int i = 0; i < 8; i++) {
        for (int a = 0; a < 3; a++) {
            for (int b = 0; b < 3; b++)
                f[a][b] += scale * r[i][a] * element->rest[i][b];
        }
    }
    extract_rotation((const double(*)[3])f, element->rotation);
    // P = 2 mu (F - R) + lambda tr(R^T F - 1) R
    double(*rotation)[3] = element->rotation, stress[3][3], trace = -3.0;
    for (int a = 0; a < 3; a++) {
        for (int b = 0; b < 3; b++)
            trace += rotation[a][b] * f[a][b];
    }
    for (int a = 0; a < 3; a++) {
        for (int b = 0; b < 3; b++)
            stress[a][b] = 2.0 * element->mu * (f[a][b] - rotation[a][b]) +
                           element->lambda * trace * rotation[a][b];
    }
    // Area vectors a_i = H X_i / 2.
    for (int i = 0; i < 8; i++) {
        for (int a = 0; a < 3; a++) {
            double affine = 0.0;
            for (int b = 0; b < 3; b++) {
                force[i][a] -= 0.5 * element->size * stress[a][b] * element->rest[i][b];
                affine += f[a][b] * element->rest[i][b];
            }
            force[i][a] -= element->residual * (r[i][a] - affine);
        }
    }
    if (element->damping > 0.0)
        add_damping(element, vertex, (const double(*)[3])r, force);
    for (int i = 0; i < 8; i++) {
        for (int c = 0; c < 3; c++)
            vertex[element->vertex[i]].f[c] += force[i][c];
    }
}

void voxel_textbook_forces(VoxelTextbook *textbook)
{
    for (int i = 0; i < textbook->vertex_count; i++) {
        VoxelTextbookVertex *n = &textbook->vertex[i];
        for (int c = 0; c < 3; c++)
            n->f[c] = n->mass * textbook->gravity[c];
    }
    for (int e = 0; e < textbook->element_count; e++)
        add_element(&textbook->element[e], textbook->vertex);
}

void voxel_textbook_step(VoxelTextbook *textbook, double dt)
{
    voxel_textbook_forces(textbook);
    for (int i = 0; i < textbook->vertex_count; i++) {
        VoxelTextbookVertex *n = &textbook->vertex[i];
        if (n->fixed)
            continue;
        double scale = dt / n->mass;
        for (int c = 0; c < 3; c++) {
            n->v[c] += scale * n->f[c];
            n->x[c] += dt * n->v[c];
        }
    }
}
