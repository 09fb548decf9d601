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

// The voxels around a place: the lowest corner, and how much of the way to the next one it is.
typedef struct Around {
    int low[3];
    double share[3];
} Around;

static double corner_of(const Around *around, int corner, int at[3])
{
    double weight = 1.0;
    for (int a = 0; a < 3; a++) {
        const int upper = corner >> a & 1;
        weight *= upper ? around->share[a] : 1.0 - around->share[a];
        at[a] = around->low[a] + upper;
    }
    return weight;
}

// Mixes the labels around a place. False if all is void there.
static bool mix_labels(const BodyLook *look, const double place[3], LookColours *colours)
{
    const LookGrid *grid = &look->labels;
    Around around;
    double all = 0.0, sum[6] = {0.0};
    for (int a = 0; a < 3; a++) {
        around.low[a] = (int)floor(place[a]);
        around.share[a] = place[a] - around.low[a];
    }
    for (int corner = 0; corner < 8; corner++) {
        int at[3];
        const double weight = corner_of(&around, corner, at);
        bool inside = weight > 0.0;
        for (int a = 0; a < 3; a++)
            inside = inside && at[a] >= 0 && at[a] < grid->count[a];
        const int label = inside ? grid->value[index_of(grid, at[0], at[1], at[2])] : 0;
        if (label == 0)
            continue;
        all += weight;
        for (int c = 0; c < 3; c++) {
            sum[c] += weight * look->of_label[label].outside[c];
            sum[3 + c] += weight * look->of_label[label].inside[c];
        }
    }
    for (int c = 0; c < 3 && all > 0.0; c++) {
        colours->outside[c] = (unsigned char)lrint(sum[c] / all);
        colours->inside[c] = (unsigned char)lrint(sum[3 + c] / all);
    }
    return all > 0.0;
}

static void labels_at(const BodyLook *look, const float rest[3], LookColours *colours)
{
    double place[3];
    int label = 0;
    find_place(&look->labels, rest, place);
    if (mix_labels(look, place, colours))
        return;
    for (int reach = 1; reach <= 2 && label == 0; reach++)
        label = nearest_label(&look->labels, place, reach);
    if (label > 0)
        *colours = look->of_label[label];
}

static void image_at(const LookGrid *grid, const float rest[3], unsigned char colour[3])
{
    double place[3], sum[3] = {0.0};
    Around around;
    find_place(grid, rest, place);
    // At its border an image goes on as it is there.
    for (int a = 0; a < 3; a++) {
        const double inside = fmin(fmax(place[a], 0.0), grid->count[a] - 1.0);
        around.low[a] = (int)inside;
        around.share[a] = inside - around.low[a];
    }
    for (int corner = 0; corner < 8; corner++) {
        int at[3];
        const double weight = corner_of(&around, corner, at);
        for (int a = 0; a < 3; a++)
            at[a] = at[a] < grid->count[a] ? at[a] : grid->count[a] - 1;
        const unsigned char *value = &grid->value[3 * index_of(grid, at[0], at[1], at[2])];
        for (int c = 0; c < 3; c++)
            sum[c] += weight * value[c];
    }
    for (int c = 0; c < 3; c++)
        colour[c] = (unsigned char)lrint(sum[c]);
}

void look_coagulate(LookColours *colours, int share)
{
    static const unsigned char PALE[3] = {214, 199, 172}; // cooked meat
    for (int c = 0; c < 3; c++) {
        colours->outside[c] += (PALE[c] - colours->outside[c]) * share / 255;
        colours->inside[c] += (PALE[c] - colours->inside[c]) * share / 255;
    }
}

LookColours look_colours(const BodyLook *look, const float rest[3])
{
    LookColours colours = look->usual;
    if (look->labels.count[0] > 0)
        labels_at(look, rest, &colours);
    if (look->image.count[0] > 0)
        image_at(&look->image, rest, colours.inside);
    return colours;
}
