// SPDX-License-Identifier: MIT
// The smooth surface of the voxels of a body: their indicator on the volume's own grid, in the
// cells of the lattice that was made of them. Load time only.
#include "io/volume_import.h"

#include "base/check.h"

#include <math.h>
#include <stdlib.h>

// Axis a of the lattice is that of the volume, or its opposite (volume_lattice.c).
typedef struct Along {
    int first, end; // voxels, `end` not in it
    bool reversed;
    double low, spacing; // [cells] of the first voxel in the lattice's direction
} Along;

// Finds the voxels around the lattice along an axis.
static Along find_along(const LabelVolume *volume, const Lattice *lattice, int a)
{
    const double reach = 4.0; // cells
    const Vec3 unit = quat_rotate(lattice->turn, vec3(a == 0, a == 1, a == 2));
    const double step = vec3_dot(volume->axis[a], unit) / lattice->size;
    Along along = {.reversed = step < 0.0, .spacing = fabs(step)};
    // The middle of voxel 0, in cells along this axis.
    const double zero = vec3_dot(vec3_sub(volume->origin, lattice->origin), unit) / lattice->size;
    const double from = (-reach - zero) / step, to = (lattice->count[a] + reach - zero) / step;
    along.first = (int)fmax(floor(fmin(from, to)), 0.0);
    along.end = (int)fmin(ceil(fmax(from, to)) + 1.0, volume->count[a]);
    const int lowest = along.reversed ? along.end - 1 : along.first;
    along.low = zero + lowest * step - 0.5 * along.spacing;
    return along;
}

static bool is_one_of(int label, const int *list, int count)
{
    for (int m = 0; m < count; m++)
        if (list[m] == label)
            return true;
    return false;
}

void volume_field(const LabelVolume *volume, const int *label, int label_count,
                  const Lattice *lattice, SurfaceField *field)
{
    SolidBlocks blocks;
    Along along[3];
    size_t voxels = 1;
    for (int a = 0; a < 3; a++) {
        along[a] = find_along(volume, lattice, a);
        blocks.count[a] = along[a].end - along[a].first;
        blocks.low[a] = along[a].low;
        blocks.spacing[a] = along[a].spacing;
        voxels *= (size_t)blocks.count[a];
    }
    unsigned char *inside = malloc(voxels + 1), *to = inside;
    ASSERT(inside != NULL);
    int last = 0;
    bool is_inside = is_one_of(0, label, label_count);
    for (int k = 0; k < blocks.count[2]; k++)
        for (int j = 0; j < blocks.count[1]; j++)
            for (int i = 0; i < blocks.count[0]; i++) {
                const int at[3] = {i, j, k};
                int v[3];
                for (int a = 0; a < 3; a++)
                    v[a] = along[a].reversed ? along[a].end - 1 - at[a] : along[a].first + at[a];
                const int here = volume_label_at(volume, v[0], v[1], v[2]);
                if (here != last)
                    is_inside = is_one_of(last = here, label, label_count);
                *to++ = is_inside;
            }
    blocks.inside = inside;
    surface_field_of_blocks(field, lattice, &blocks);
    free(inside);
}
