// Private to the kernels: the elastic energy of all elements (element.c has the formula), for
// status and tests. Changes nothing.
#ifndef PLIANT_VOXEL_KERNEL_ENERGY_H
#define PLIANT_VOXEL_KERNEL_ENERGY_H

#include "voxel/kernel/hanging.h"
#include "voxel/kernel/plain.h"

// The rotations of WIDTH deformations, on a copy of `last`.
INLINE void energy_fit(const Deformation *deformation, const double (*last)[4], Polar *polar)
{
    Motion motion;
    Vector spin[3];
    Root root;
    polar_root(deformation, &root);
    Vector unfit = polar_fit(deformation, &root, polar);
    if (__builtin_expect(vector_any(unfit), 0)) {
        double scratch[WIDTH][4];
        memcpy(scratch, last, sizeof scratch);
        repair(deformation, &motion, unfit, false, scratch, polar, spin);
    }
}

// mu |F - R|^2 + lambda / 2 tr(D)^2 [Pa].
INLINE Vector energy_uniform(const Deformation *deformation, const Polar *polar, Real mu,
                             Real lambda)
{
    Vector sum = vector_set(0.0);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            Vector d = deformation->g[i][k] - polar->turn[i][k] * polar->inverse;
            sum += d * d;
        }
    return mu * sum + REAL(0.5) * lambda * (polar->stretch * polar->stretch);
}

// Lane by lane, so that sums have one order at every width.
static void add_lanes(Vector v, double *sum)
{
    for (int i = 0; i < WIDTH; i++)
        *sum += (double)v[i];
}

// In units of H^3 Pa.
INLINE Vector plain_energy(const VoxelPass *pass, const ElementClass *c, const int *vertex,
                           const double (*last)[4])
{
    const bool paper = pass->law == VOXEL_MIYAZAKI2004;
    const Real gradient = (Real)(0.25 / c->size);
    Vector u[3][MODES];
    for (int corner = 0; corner < NODE_CORNERS; corner++) {
        Vector first[3], second[3];
        vector_load_rows(pass->rows, vertex + corner * LANES, false, first, second);
        for (int k = 0; k < 3; k++)
            u[k][corner] = first[k];
    }
    Deformation deformation;
    Polar polar;
    Vector bent = vector_set(0.0);
    for (int i = 0; i < 3; i++) {
        butterfly(u[i]);
        for (int k = 0; k < 3; k++)
            deformation.g[i][k] = u[i][AXIS_MODE[k]] * gradient;
        for (int m = 0; m < 4; m++) {
            Vector b = u[i][BENT_MODE[m]] * gradient;
            bent += b * b;
        }
    }
    deformation_complete(&deformation);
    energy_fit(&deformation, last, &polar);
    // A mode's displacement is H / 2 times its `bent` at each of 8 corners.
    const double mu = paper ? c->residual / c->size : c->mu;
    return energy_uniform(&deformation, &polar, (Real)mu, (Real)(paper ? 0.0 : c->lambda)) +
           (Real)(c->residual / c->size) * bent;
}

INLINE Vector hanging_energy(const VoxelPass *pass, const ElementClass *c,
                             const TemplateTable *table, const int *vertex, bool paper,
                             const double (*last)[4])
{
    Hanging h;
    Polar polar;
    gather_hanging(pass, table, vertex, (Real)(1.0 / c->size), paper, false, &h);
    deformation_complete(&h.deformation);
    energy_fit(&h.deformation, last, &polar);
    Vector energy = vector_set(0.0), residual = energy;
    if (!paper)
        energy = energy_uniform(&h.deformation, &polar, (Real)c->mu, (Real)c->lambda);
    const Real *row = (const Real *)table->number + TABLE_HEAD;
    for (int p = 0; p < table->count; p++, row += TABLE_ROW)
        for (int i = 0; i < 3; i++) {
            Vector d = h.u[p][i] - h.middle[i];
            for (int k = 0; k < 3; k++)
                d -= (paper ? polar.turn[i][k] * polar.inverse : h.slope[i][k]) * row[4 + k];
            residual += row[3] * (d * d);
        }
    return energy + (Real)(0.5 * c->residual / c->size) * residual;
}

static double energy(const VoxelPass *pass)
{
    const PlainBatches *plain = pass->plain;
    const HangingBatches *hanging = pass->hanging;
    const bool paper = pass->law == VOXEL_MIYAZAKI2004;
    double total = 0.0;
    for (int b = 0; b < plain->batch_count; b++) {
        const ElementClass *c = &pass->classes[plain->element_class[b]];
        const int *vertex = plain->vertex + (long)b * NODE_CORNERS * LANES;
        const double(*last)[4] = (const double(*)[4])pass->last[b];
        double sum = 0.0;
        for (int lane = 0; lane < LANES; lane += WIDTH)
            add_lanes(plain_energy(pass, c, vertex + lane, last + lane), &sum);
        total += c->size * c->size * c->size * sum;
    }
    for (int b = 0; b < hanging->batch_count; b++) {
        const ElementClass *c = &pass->classes[hanging->element_class[b]];
        const TemplateTable *table = &pass->tables[hanging->template_index[b]];
        const int *vertex = hanging->vertex + (long)hanging->start[b] * LANES;
        const double(*last)[4] = (const double(*)[4])pass->last[plain->batch_count + b];
        double sum = 0.0;
        for (int lane = 0; lane < LANES; lane += WIDTH)
            add_lanes(paper ? hanging_energy(pass, c, table, vertex + lane, true, last + lane)
                            : hanging_energy(pass, c, table, vertex + lane, false, last + lane),
                      &sum);
        total += c->size * c->size * c->size * sum;
    }
    return pass->stiffness_scale * total;
}

#endif
