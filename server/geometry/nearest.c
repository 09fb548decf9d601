// SPDX-License-Identifier: MIT
#include "geometry/nearest.h"

#include "base/check.h"

#include <math.h>
#include <stdlib.h>

// A line of cells along one axis: the lower envelope of parabolas, one for each cell that knows a
// marked one in the axes before.
typedef struct Line {
    int *place;     // [length] of the parabolas of the envelope
    double *from;   // [length] where each begins to be the lowest
    double *offset; // [length] squared distance in the axes before; INFINITY: none
    int *feature;   // [length] marked cell
} Line;

// Returns where the parabola of cell b, to the right, becomes lower than that of a.
static double meet(const Line *line, int a, int b)
{
    return 0.5 * ((line->offset[b] + (double)b * b) - (line->offset[a] + (double)a * a)) /
           (double)(b - a);
}

static void transform(Line *line, int length, long stride, int *nearest)
{
    int count = 0;
    for (int q = 0; q < length; q++) {
        if (line->offset[q] == HUGE_VAL)
            continue;
        // Parabolas that are nowhere the lowest any more go.
        while (count > 0 && meet(line, line->place[count - 1], q) <= line->from[count - 1])
            count--;
        line->place[count] = q;
        line->from[count] = count > 0 ? meet(line, line->place[count - 1], q) : -HUGE_VAL;
        count++;
    }
    for (int q = 0, k = 0; q < length; q++) {
        while (k + 1 < count && line->from[k + 1] < q)
            k++;
        nearest[q * stride] = count > 0 ? line->feature[line->place[k]] : -1;
    }
}

static double squared_before(const int count[3], int axes, int cell, int feature)
{
    double sum = 0.0;
    for (int a = 0; a < axes; a++) {
        const double d = cell % count[a] - feature % count[a];
        sum += d * d;
        cell /= count[a];
        feature /= count[a];
    }
    return sum;
}

static void along(const int count[3], int axis, Line *line, int *nearest)
{
    const int length = count[axis];
    long stride = 1, cells = (long)count[0] * count[1] * count[2];
    for (int a = 0; a < axis; a++)
        stride *= count[a];
    for (long first = 0; first < cells; first++) {
        if (first / stride % length != 0)
            continue;
        for (int q = 0; q < length; q++) {
            const int cell = (int)(first + q * stride), feature = nearest[cell];
            line->feature[q] = feature;
            line->offset[q] = feature < 0 ? HUGE_VAL : squared_before(count, axis, cell, feature);
        }
        transform(line, length, stride, nearest + first);
    }
}

void nearest_marked(const int count[3], const bool *marked, int *nearest)
{
    int longest = 1;
    const long cells = (long)count[0] * count[1] * count[2];
    for (int a = 0; a < 3; a++)
        longest = count[a] > longest ? count[a] : longest;
    for (long c = 0; c < cells; c++)
        nearest[c] = marked[c] ? (int)c : -1;
    Line line = {.place = malloc((size_t)longest * sizeof *line.place),
                 .from = malloc((size_t)longest * sizeof *line.from),
                 .offset = malloc((size_t)longest * sizeof *line.offset),
                 .feature = malloc((size_t)longest * sizeof *line.feature)};
    ASSERT(line.place != NULL && line.from != NULL && line.offset != NULL && line.feature != NULL);
    for (int axis = 0; axis < 3; axis++)
        along(count, axis, &line, nearest);
    free(line.place);
    free(line.from);
    free(line.offset);
    free(line.feature);
}
