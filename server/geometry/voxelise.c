// SPDX-License-Identifier: MIT
// Meshes to lattices. Nodes are first rounded to a fine integer grid, 2^-20 of a cell; all that
// follows is exact. A row of cell centres, a line in x, enters or leaves the solid where it passes
// through a triangle. Rows through edges, corners or along faces are decided as if shifted by an
// infinitesimal e in y, e^2 in z, and their centres e^3 in x (Edelsbrunner and Mücke 1990,
// simulation of simplicity). Then no row meets an edge, each crossing of a closed surface belongs
// to exactly one triangle, and the number of crossings of a row is even. Load time only.
#include "geometry/lattice.h"

#include "base/check.h"
#include "geometry/edges.h"

#include <stdint.h>
#include <stdlib.h>

// Grid steps in half a cell, and most cells along an axis. With both, coordinates are below 2^37,
// areas below 2^76 and six-fold volumes below 2^115: all fit.
#define HALF_CELL ((int64_t)1 << 19)
enum { MOST_ALONG = 1 << 16 };

__extension__ typedef __int128 Wide;

typedef int64_t Point[3]; // in grid steps

// The rows that a mesh is cut along.
typedef struct Raster {
    Lattice *lattice; // label: parity of the crossings before each cell, of this cell alone
    Vec3 low;         // low corner of the grid [m]
    Point *point;     // [node]
} Raster;

// --- is the mesh closed? ---

static bool check_closed(const TriMesh *mesh, Status *status)
{
    HalfEdges half;
    half_edge_create(&half, mesh);
    // Every edge must have an even number of triangles.
    int open = -1;
    for (int first = 0; first < half.count && open < 0;) {
        int end = half_edge_group_end(&half, mesh, first);
        if ((end - first) % 2 != 0)
            open = half.order[first];
        first = end;
    }
    half_edge_destroy(&half);
    if (open < 0)
        return true;
    // Name one edge of the gap.
    return status_fail(status, STATUS_INVALID,
                       "the mesh is not closed: no other triangle borders the one at the edge "
                       "between nodes %d and %d, so it has no inside",
                       mesh->file_index[half_edge_from(mesh, open)],
                       mesh->file_index[half_edge_to(mesh, open)]);
}

// --- the grid ---

// Returns a cell size at which the number of cells fits, with two digits. `share`: the factor that
// is needed.
static double coarser(double size, double share)
{
    double enough = size * share, digit = pow(10.0, floor(log10(enough)) - 1.0);
    return digit * ceil(enough / digit * (1.0 + 1e-9));
}

// Creates a grid around the box of the mesh, with the same middle. An excess below 1e-6 of a cell
// over a whole number of cells is rounding.
static bool create_grid(Raster *raster, const TriMesh *mesh, double size, Status *status)
{
    // `share` becomes the cube root of the number of cells over the limit.
    double low[3], cells = 1.0, most = 0.0, share = cbrt(1.0 / LATTICE_MOST_CELLS);
    int count[3] = {0};
    const Box box = mesh_box(mesh);
    // So many cells cover the box along each axis, and both have one middle.
    for (int a = 0; a < 3; a++) {
        double along = ceil((box.high[a] - box.low[a]) / size - 1e-6);
        along = along >= 1.0 ? along : 1.0;
        cells *= along;
        share *= cbrt(along); // a product of cube roots does not overflow
        most = fmax(most, along);
        low[a] = 0.5 * (box.low[a] + box.high[a]) - 0.5 * along * size;
        count[a] = along <= MOST_ALONG ? (int)along : 0;
    }
    // Too many: tell the size that would do.
    if (!(cells <= LATTICE_MOST_CELLS) || most > MOST_ALONG) {
        share = fmax(share, most / MOST_ALONG);
        return status_fail(status, STATUS_INVALID,
                           "cells of %g m fill the box of the mesh with %.3g, more than %d, or %d "
                           "along an axis; %.2g m would do",
                           size, cells, LATTICE_MOST_CELLS, MOST_ALONG, coarser(size, share));
    }
    if (!lattice_create(raster->lattice, count, size, status))
        return false;
    // The lattice begins where its grid does.
    raster->low = raster->lattice->origin = vec3(low[0], low[1], low[2]);
    return true;
}

static void round_nodes(Raster *raster, const TriMesh *mesh)
{
    double step = (double)(2 * HALF_CELL) / raster->lattice->size;
    raster->point = malloc(((size_t)mesh->node_count + 1) * sizeof *raster->point);
    ASSERT(raster->point != NULL);
    for (int n = 0; n < mesh->node_count; n++) {
        Vec3 x = vec3_sub(mesh->position[n], raster->low);
        raster->point[n][0] = llrint(x.x * step);
        raster->point[n][1] = llrint(x.y * step);
        raster->point[n][2] = llrint(x.z * step);
    }
}

// --- one triangle ---

// Returns twice the area in the y-z plane of the row and the edge from `a` to `b`.
static Wide edge_area(const Point a, const Point b, int64_t y, int64_t z)
{
    return (Wide)(a[1] - y) * (b[2] - z) - (Wide)(b[1] - y) * (a[2] - z);
}

// True if the row, shifted infinitesimally, is to the left of the edge. Where edge_area is zero,
// its derivatives by y and z decide.
static bool is_left(Wide area, const Point a, const Point b)
{
    if (area != 0)
        return area > 0;
    if (a[2] != b[2])
        return a[2] > b[2];
    return b[1] > a[1];
}

static int64_t floor_divide(Wide n, Wide d) // d > 0
{
    Wide q = n / d;
    return (int64_t)(q - (q * d > n));
}

// Returns the first cell of the row whose shifted centre is beyond the plane of the triangle p.
// `w`: the areas opposite to the corners, sum > 0. The crossing is at x = sum w p.x / sum w.
static int64_t first_beyond(const int64_t *const p[3], const Wide w[3])
{
    Wide sum = w[0] + w[1] + w[2];
    Wide excess = w[0] * p[0][0] + w[1] * p[1][0] + w[2] * p[2][0] - sum * HALF_CELL;
    // The centre of cell i is beyond when i 2 HALF_CELL sum >= excess, on the plane for '='.
    Wide cell = sum * 2 * HALF_CELL;
    int64_t before = floor_divide(excess, cell);
    if (before * cell != excess)
        return before + 1;
    // Derivatives of `excess` by y, then z; those of `sum` are zero.
    Wide by_y = 0, by_z = 0;
    for (int c = 0; c < 3; c++) {
        const int64_t *a = p[(c + 1) % 3], *b = p[(c + 2) % 3];
        by_y += (Wide)(a[2] - b[2]) * p[c][0];
        by_z += (Wide)(b[1] - a[1]) * p[c][0];
    }
    bool beyond = by_y != 0 ? by_y < 0 : by_z != 0 ? by_z < 0 : true;
    return beyond ? before : before + 1;
}

static void cross_row(Raster *raster, const int64_t *const p[3], int j, int k)
{
    int64_t y = (2 * j + 1) * HALF_CELL, z = (2 * k + 1) * HALF_CELL;
    // The row passes through the triangle if it lies left of all sides.
    Wide w[3];
    for (int c = 0; c < 3; c++) {
        const int64_t *a = p[(c + 1) % 3], *b = p[(c + 2) % 3];
        w[c] = edge_area(a, b, y, z);
        if (!is_left(w[c], a, b))
            return;
    }
    // From the next cell on, the row is on the other side of the surface.
    int64_t cell = first_beyond(p, w);
    if (cell < raster->lattice->count[0])
        raster->lattice->label[lattice_index(raster->lattice, cell < 0 ? 0 : (int)cell, j, k)] ^= 1;
}

// Finds the rows with this z that the triangle can meet, with one row more on either side.
static void find_rows(const int64_t *const p[3], int64_t z, int count, int *first, int *end)
{
    // The range of y in which the triangle's sides meet the plane z.
    double low = (double)INFINITY, high = -(double)INFINITY;
    for (int c = 0; c < 3; c++) {
        const int64_t *a = p[c], *b = p[(c + 1) % 3];
        if ((a[2] < z && b[2] < z) || (a[2] > z && b[2] > z))
            continue;
        // Where the side crosses; a side in the plane counts with both ends.
        double at[2] = {(double)a[1], (double)b[1]};
        if (a[2] != b[2])
            at[0] = at[1] = at[0] + (at[1] - at[0]) * ((double)(z - a[2]) / (double)(b[2] - a[2]));
        low = fmin(low, fmin(at[0], at[1]));
        high = fmax(high, fmax(at[0], at[1]));
    }
    // Rows within that range, one more on both sides for rounding.
    const double cell = 2.0 * (double)HALF_CELL;
    *first = *end = 0;
    if (!(low <= high))
        return;
    *first = (int)fmax(floor(low / cell) - 1.0, 0.0);
    *end = (int)fmin(ceil(high / cell) + 1.0, count);
}

static void cross_triangle(Raster *raster, const int corner[3])
{
    const int64_t *p[3];
    for (int c = 0; c < 3; c++)
        p[c] = raster->point[corner[c]];
    // Orient the triangle; edge-on it has no inside that a row could cross.
    Wide area = edge_area(p[0], p[1], p[2][1], p[2][2]);
    if (area == 0)
        return;
    if (area < 0) {
        const int64_t *other = p[1];
        p[1] = p[2];
        p[2] = other;
    }
    // The layers of rows between its lowest and highest corner.
    int64_t low = p[0][2], high = p[0][2];
    for (int c = 1; c < 3; c++) {
        low = p[c][2] < low ? p[c][2] : low;
        high = p[c][2] > high ? p[c][2] : high;
    }
    int from = (int)floor_divide(low - HALF_CELL + 2 * HALF_CELL - 1, 2 * HALF_CELL);
    int to = (int)floor_divide(high - HALF_CELL, 2 * HALF_CELL);
    int layers = raster->lattice->count[2];
    // Each row that the triangle may cross.
    for (int k = from > 0 ? from : 0; k <= to && k < layers; k++) {
        int first, end;
        find_rows(p, (2 * k + 1) * HALF_CELL, raster->lattice->count[1], &first, &end);
        for (int j = first; j < end; j++)
            cross_row(raster, p, j, k);
    }
}

// Turns crossings into inside and outside; returns the number of solid cells.
static long fill_rows(const Lattice *lattice)
{
    long solid = 0, rows = (long)lattice->count[1] * lattice->count[2];
    for (long r = 0; r < rows; r++) {
        unsigned char *row = &lattice->label[r * lattice->count[0]], inside = 0;
        for (int i = 0; i < lattice->count[0]; i++)
            solid += row[i] = inside ^= row[i];
    }
    return solid;
}

static bool check_solid(long solid, double size, Status *status)
{
    if (solid == 0)
        return status_fail(status, STATUS_INVALID,
                           "no centre of a cell of %g m is inside the mesh; smaller cells would be",
                           size);
    if (solid <= LATTICE_MOST_SOLID)
        return true;
    double share = cbrt((double)solid / LATTICE_MOST_SOLID);
    return status_fail(status, STATUS_INVALID,
                       "cells of %g m make %ld, more than %d; %.2g m would do", size, solid,
                       LATTICE_MOST_SOLID, coarser(size, share * 1.01));
}

bool voxelise(Lattice *lattice, const TriMesh *mesh, double size, Status *status)
{
    *lattice = (Lattice){0};
    // Refuse what has no cells or no inside.
    if (!(size > 0.0) || !isfinite(size))
        return status_fail(status, STATUS_INVALID, "cells of %g m are not possible", size);
    if (mesh->triangle_count == 0)
        return status_fail(status, STATUS_INVALID, "the mesh has no triangles");
    Raster raster = {.lattice = lattice};
    if (!check_closed(mesh, status) || !create_grid(&raster, mesh, size, status))
        return false;
    // From here on all is exact: nodes are integers.
    round_nodes(&raster, mesh);
    for (int t = 0; t < mesh->triangle_count; t++)
        cross_triangle(&raster, mesh->triangle[t]);
    free(raster.point);
    // Void margins go last.
    if (check_solid(fill_rows(lattice), size, status) && lattice_crop(lattice, status))
        return true;
    lattice_destroy(lattice);
    return false;
}
