// Blocks of cells: memory and the plain generators.
#include "geometry/lattice.h"

#include <stdlib.h>

bool lattice_create(Lattice *lattice, const int count[3], double size, Status *status)
{
    *lattice = (Lattice){.size = size, .turn = {1.0, 0.0, 0.0, 0.0}};
    for (int d = 0; d < 3; d++)
        lattice->count[d] = count[d];
    lattice->label = calloc((size_t)count[0] * (size_t)count[1] * (size_t)count[2], 1);
    return lattice->label != NULL || status_fail(status, STATUS_FAILED, "no memory");
}

void lattice_destroy(Lattice *lattice)
{
    free(lattice->label);
    *lattice = (Lattice){0};
}

int lattice_label(const Lattice *lattice, int i, int j, int k)
{
    if (i < 0 || j < 0 || k < 0 || i >= lattice->count[0] || j >= lattice->count[1] ||
        k >= lattice->count[2])
        return 0;
    return lattice->label[lattice_index(lattice, i, j, k)];
}

bool lattice_box(Lattice *lattice, const int count[3], double size, Status *status)
{
    if (!lattice_create(lattice, count, size, status))
        return false;
    for (long c = 0; c < (long)count[0] * count[1] * count[2]; c++)
        lattice->label[c] = 1;
    return true;
}

static bool round_lattice(Lattice *lattice, int n, int layers, double radius, double size,
                          Status *status)
{
    const int count[3] = {n, n, layers};
    if (!lattice_create(lattice, count, size, status))
        return false;
    for (int k = 0; k < layers; k++)
        for (int j = 0; j < n; j++)
            for (int i = 0; i < n; i++) {
                double x = i + 0.5 - 0.5 * n, y = j + 0.5 - 0.5 * n;
                double z = k + 0.5 - 0.5 * layers, r = radius / size;
                lattice->label[lattice_index(lattice, i, j, k)] = x * x + y * y + z * z <= r * r;
            }
    return true;
}

bool lattice_ball(Lattice *lattice, double radius, double size, Status *status)
{
    int n = 2 * (int)ceil(radius / size - 1e-9);
    return round_lattice(lattice, n, n, radius, size, status);
}

bool lattice_disc(Lattice *lattice, double radius, double size, Status *status)
{
    return round_lattice(lattice, 2 * (int)ceil(radius / size - 1e-9), 1, radius, size, status);
}
