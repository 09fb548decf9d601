// SPDX-License-Identifier: MIT
// The colours of nodes. Any thread; reads only what is constant.
#include "body/look.h"

#include <math.h>

LookGrid look_grid(const int count[3], Vec3 origin, const Vec3 step[3], const unsigned char *value)
{
    LookGrid grid = {.count = {count[0], count[1], count[2]}, .origin = origin, .value = value};
    for (int a = 0; a < 3; a++)
        grid.axis[a] = vec3_scale(1.0 / vec3_dot(step[a], step[a]), step[a]);
    return grid;
}

// Finds the coordinates of a point, at most a few voxels outside so that they fit an int.
static void find_place(const LookGrid *grid, const float rest[3], double place[3])
{
    const Vec3 from =
        vec3_sub(vec3((double)rest[0], (double)rest[1], (double)rest[2]), grid->origin);
    for (int a = 0; a < 3; a++)
        place[a] = fmin(fmax(vec3_dot(grid->axis[a], from), -4.0), grid->count[a] + 3.0);
}

static size_t index_of(const LookGrid *grid, int i, int j, int k)
{
    return ((size_t)k * (size_t)grid->count[1] + (size_t)j) * (size_t)grid->count[0] + (size_t)i;
}

// Returns the nearest label that is not void within `reach` voxels of a place, 0: there is none.
static int nearest_label(const LookGrid *grid, const double place[3], int reach)
{
    int low[3], high[3], label = 0;
    double least = HUGE_VAL;
    for (int a = 0; a < 3; a++) {
        const int middle = (int)lrint(place[a]);
        low[a] = middle - reach < 0 ? 0 : middle - reach;
        high[a] = middle + reach >= grid->count[a] ? grid->count[a] - 1 : middle + reach;
    }
    for (int k = low[2]; k <= high[2]; k++)
        for (int j = low[1]; j <= high[1]; j++)
            for (int i = low[0]; i <= high[0]; i++) {
                const int here = grid->value[index_of(grid, i, j, k)], at[3] = {i, j, k};
                double square = 0.0;
                for (int a = 0; a < 3; a++) {
                    const double apart = fmax(fabs(place[a] - at[a]) - 0.5, 0.0);
                    square += apart * apart;
                }
                if (here == 0 || square >= least)
                    continue;
                least = square;
                label = here;
            }
    return label;
}

static int label_at(const LookGrid *grid, const float rest[3])
{
    double place[3];
    int label = 0;
    find_place(grid, rest, place);
    // Most nodes lie in a voxel of the body, or beside one.
    for (int reach = 0; reach <= 2 && label == 0; reach++)
        label = nearest_label(grid, place, reach);
    return label;
}

static void image_at(const LookGrid *grid, const float rest[3], unsigned char colour[3])
{
    double place[3], share[3], sum[3] = {0.0, 0.0, 0.0};
    int low[3];
    find_place(grid, rest, place);
    // At its border an image goes on as it is there.
    for (int a = 0; a < 3; a++) {
        const double inside = fmin(fmax(place[a], 0.0), grid->count[a] - 1.0);
        low[a] = (int)inside;
        share[a] = inside - low[a];
    }
    for (int corner = 0; corner < 8; corner++) {
        int at[3];
        double weight = 1.0;
        for (int a = 0; a < 3; a++) {
            const int upper = corner >> a & 1;
            weight *= upper ? share[a] : 1.0 - share[a];
            at[a] = low[a] + upper < grid->count[a] ? low[a] + upper : low[a];
        }
        const unsigned char *value = &grid->value[3 * index_of(grid, at[0], at[1], at[2])];
        for (int c = 0; c < 3; c++)
            sum[c] += weight * value[c];
    }
    for (int c = 0; c < 3; c++)
        colour[c] = (unsigned char)lrint(sum[c]);
}

LookColours look_colours(const BodyLook *look, const float rest[3])
{
    LookColours colours = look->usual;
    if (look->labels.count[0] > 0) {
        const int label = label_at(&look->labels, rest);
        if (label > 0)
            colours = look->of_label[label];
    }
    if (look->image.count[0] > 0)
        image_at(&look->image, rest, colours.inside);
    return colours;
}
