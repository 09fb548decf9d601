// SPDX-License-Identifier: MIT
#include "body/fit.h"

#include <string.h>

int fit_weights(const FitNode *node, int vertex, int *mark, FitWeight weight[FIT_WEIGHTS])
{
    int count = 1, kept = 0;
    double share[FIT_CORNERS]; // of a corner, alike in all cells
    for (int k = 0; k < FIT_CORNERS; k++) {
        share[k] = 0.0;
        for (int axis = 0; axis < 3; axis++)
            share[k] += (k >> axis & 1 ? 0.25 : -0.25) * node->offset[axis];
    }
    weight[0] = (FitWeight){vertex, 1.0};
    mark[vertex] = 0;
    for (int c = 0; c < node->cell_count; c++)
        for (int k = 0; k < FIT_CORNERS; k++) {
            int *at = &mark[node->corner[c][k]];
            if (*at < 0) {
                *at = count++;
                weight[*at] = (FitWeight){node->corner[c][k], 0.0};
            }
            weight[*at].weight += share[k] / node->cell_count;
        }
    for (int w = 0; w < count; w++) {
        mark[weight[w].vertex] = -1;
        if (weight[w].weight != 0.0)
            weight[kept++] = weight[w];
    }
    return kept;
}

// Adds F o of one cell to the sum of each of its corners.
static void add_cell(const BodyFit *fit, const int corner[FIT_CORNERS], const float *row,
                     double (*sum)[FIT_SCRATCH])
{
    float gradient[3][3] = {{0.0F}}; // by axis at rest: its column
    for (int k = 0; k < FIT_CORNERS; k++) {
        const float *x = row + 3L * corner[k];
        for (int axis = 0; axis < 3; axis++)
            for (int c = 0; c < 3; c++)
                gradient[axis][c] += k >> axis & 1 ? x[c] : -x[c];
    }
    for (int k = 0; k < FIT_CORNERS; k++) {
        const float *o = fit->offset[corner[k]];
        double *to = sum[corner[k]];
        for (int c = 0; c < 3; c++) { // exact, so that the order of cells does not matter, where
                                      // parts are within 2^26 of each other
            const float part =
                gradient[0][c] * o[0] + gradient[1][c] * o[1] + gradient[2][c] * o[2];
            to[c] += (double)(0.25F * part);
        }
        to[3] += 1.0;
    }
}

void fit_nodes(const BodyFit *fit, int node_count, const float *row, double *scratch, float *out)
{
    double(*sum)[FIT_SCRATCH] = (double(*)[FIT_SCRATCH])scratch;
    memset(sum, 0, (size_t)fit->row_count * sizeof *sum);
    for (int c = 0; c < fit->cell_count; c++)
        add_cell(fit, fit->cell[c], row, sum);
    for (int i = 0; i < node_count; i++) {
        const int r = fit->row[i];
        const double cells = sum[r][3] > 0.0 ? sum[r][3] : 1.0;
        for (int c = 0; c < 3; c++)
            out[3L * i + c] = (float)((double)row[3L * r + c] + sum[r][c] / cells);
    }
}

void fit_fade(const BodyFit *fit, int64_t step, const float *row, float *out)
{
    for (int k = 0; k < fit->fade_count; k++) {
        const FitFade *fade = &fit->fade[k];
        const float left = fit_left(fade->step, fit->fade_steps, step);
        const float *x = row + 3L * fit->row[fade->node];
        float *y = out + 3L * fade->node;
        for (int c = 0; c < 3; c++)
            y[c] = (1.0F - left) * y[c] + left * (x[c] + fade->from[c]);
    }
}
