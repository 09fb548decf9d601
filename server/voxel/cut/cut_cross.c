// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_cross.h"

#include "body/cut_meet.h"

#include <math.h>
#include <string.h>

static const double (*gradient_of(const CellCentres *centres, CrossGradients *gradients,
                                  int leaf))[3]
{
    const int at = leaf % CROSS_GRADIENTS;
    double(*column)[3] = gradients->column[at];
    if (gradients->leaf[at] == leaf + 1)
        return (const double(*)[3])column;
    gradients->leaf[at] = leaf + 1;
    memset(column, 0, sizeof *gradients->column);
    const int *node = cut_lattice_nodes(centres->lattice, leaf);
    const double part = 1.0 / (double)(1 << centres->lattice->element[leaf].level);
    for (int k = 0; k < NODE_CORNERS; k++) {
        const Vec3 x = rows_local(centres->rows, centres->row, node[k]);
        for (int axis = 0; axis < 3; axis++) {
            const double sign = k >> axis & 1 ? part : -part;
            column[axis][0] += sign * x.x;
            column[axis][1] += sign * x.y;
            column[axis][2] += sign * x.z;
        }
    }
    return (const double(*)[3])column;
}

// Adds F^T n of the leaf that covers a cell, up to a factor; n in the rows' axes.
static void add_normal(const CellCentres *centres, CrossGradients *gradients, int cell, Vec3 n,
                       double sum[3])
{
    const int leaf = cut_lattice_leaf_of(centres->lattice, cell);
    const double(*column)[3] = gradient_of(centres, gradients, leaf);
    for (int axis = 0; axis < 3; axis++)
        sum[axis] += column[axis][0] * n.x + column[axis][1] * n.y + column[axis][2] * n.z;
}

static CutCrossing crossing_of(double along, const double normal[3], int axis)
{
    CutCrossing crossing = cut_crossing_middle(axis);
    const double length =
        sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    crossing.along = (uint16_t)fmin(fmax(along * CROSSING_ALONG, 0.0), CROSSING_ALONG - 1.0);
    for (int c = 0; c < 3 && length > 0.0 && isfinite(length); c++)
        crossing.normal[c] = (int16_t)lrint(normal[c] / length * CROSSING_UNIT);
    return crossing;
}

CutCrossing cut_crossing_middle(int axis)
{
    CutCrossing crossing = {.along = CROSSING_ALONG / 2};
    crossing.normal[axis] = CROSSING_UNIT;
    return crossing;
}

CutCrossing cut_crossing_find(const CellCentres *centres, CrossGradients *gradients,
                              const CutPath edge[2], const CutPath link[2], int cell, int axis)
{
    const CutMeeting meeting = cut_meet(edge, link);
    return cut_crossing_at(centres, gradients, meeting.along, meeting.normal, cell, axis);
}

CutCrossing cut_crossing_at(const CellCentres *centres, CrossGradients *gradients, double along,
                            Vec3 n, int cell, int axis)
{
    double normal[3] = {0.0};
    const double(*m)[3] = centres->turn;
    const Vec3 local = vec3(m[0][0] * n.x + m[1][0] * n.y + m[2][0] * n.z,
                            m[0][1] * n.x + m[1][1] * n.y + m[2][1] * n.z,
                            m[0][2] * n.x + m[1][2] * n.y + m[2][2] * n.z);
    add_normal(centres, gradients, cell, local, normal);
    add_normal(centres, gradients, cut_lattice_beyond(centres->lattice, cell, axis), local, normal);
    return crossing_of(along, normal, axis);
}
