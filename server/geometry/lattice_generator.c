// Boxes, balls and discs of cells, for tests and demonstrations. Load time only.
#include "geometry/lattice.h"

#include <string.h>

static bool create_centered(Lattice *lattice, const int count[3], double size, Status *status)
{
    if (!lattice_create(lattice, count, size, status))
        return false;
    lattice->origin = vec3(-0.5 * size * count[0], -0.5 * size * count[1], -0.5 * size * count[2]);
    return true;
}

static bool check_solid(const Lattice *lattice, Status *status)
{
    long solid = lattice_solid(lattice);
    return solid <= LATTICE_MOST_SOLID ||
           status_fail(status, STATUS_INVALID, "%ld solid cells are more than %d", solid,
                       LATTICE_MOST_SOLID);
}

bool lattice_box(Lattice *lattice, const int count[3], double size, Status *status)
{
    if (!create_centered(lattice, count, size, status))
        return false;
    memset(lattice->label, 1, (size_t)count[0] * (size_t)count[1] * (size_t)count[2]);
    if (check_solid(lattice, status))
        return true;
    lattice_destroy(lattice);
    return false;
}

// Fills the cells whose centre lies within the radius; `flat`: one layer, distances in x and y
// only.
static bool make_round(Lattice *lattice, double radius, double size, bool flat, Status *status)
{
    *lattice = (Lattice){0};
    if (!(radius > 0.0) || !(size > 0.0) || !isfinite(radius) || !isfinite(size))
        return status_fail(status, STATUS_INVALID,
                           "a radius of %g m in cells of %g m is not possible", radius, size);
    // In half cells the centres are odd integers, and their squares exact.
    double limit = 2.0 * radius / size;
    if (limit > LATTICE_MOST_CELLS)
        return status_fail(status, STATUS_INVALID,
                           "a radius of %g m takes more than %d cells of %g m", radius,
                           LATTICE_MOST_CELLS, size);
    // The outermost centre is at most at `limit`: half = floor((limit + 1) / 2) cells to each side.
    int half = (int)(0.5 * (limit + 1.0));
    const int count[3] = {2 * half, 2 * half, flat ? 1 : 2 * half};
    if (half == 0)
        return status_fail(status, STATUS_INVALID, "no centre of a cell of %g m lies within %g m",
                           size, radius);
    if (!create_centered(lattice, count, size, status))
        return false;
    for (int k = 0; k < count[2]; k++)
        for (int j = 0; j < count[1]; j++)
            for (int i = 0; i < count[0]; i++) {
                double x = 2 * (i - half) + 1, y = 2 * (j - half) + 1;
                double z = flat ? 0.0 : 2 * (k - half) + 1;
                if (x * x + y * y + z * z <= limit * limit)
                    lattice->label[lattice_index(lattice, i, j, k)] = 1;
            }
    if (check_solid(lattice, status) && lattice_crop(lattice, status))
        return true;
    lattice_destroy(lattice);
    return false;
}

bool lattice_ball(Lattice *lattice, double radius, double size, Status *status)
{
    return make_round(lattice, radius, size, false, status);
}

bool lattice_disc(Lattice *lattice, double radius, double size, Status *status)
{
    return make_round(lattice, radius, size, true, status);
}
