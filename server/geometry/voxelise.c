// SPDX-License-Identifier: MIT
// Meshes to lattices. Nodes are first rounded to a fine integer grid, 2^-20 of a cell; all that
// follows is exact. A row of cell centres, a line in x, enters or leaves the solid where it passes
// through a triangle. Rows through edges, corners or along faces are decided as if shifted by an
// infinitesimal e in y, e^2 in z, and their centres e^3 in x (Edelsbrunner and Mücke 1990,
// simulation of simplicity). Then no row meets an edge, each crossing of a closed surface belongs
// to exactly one triangle, and a row leaves each shell as often as it enters it. What is inside
// follows from how often the shells wind around a cell, so that overlaps count once. Load time
// only.
#include "geometry/lattice.h"

#include "base/check.h"
#include "base/sets.h"
#include "geometry/edges.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

// Grid steps in half a cell, and most cells along an axis. With both, coordinates are below 2^37,
// areas below 2^76 and six-fold volumes below 2^115: all fit.
#define HALF_CELL ((int64_t)1 << 19)
enum { MOST_ALONG = 1 << 16, MOST_CROSSINGS = 1 << 26 };

__extension__ typedef __int128 Wide;

typedef int64_t Point[3]; // in grid steps

// Where a row passes through a triangle.
typedef struct Crossing {
    uint32_t row;
    int32_t cell;  // the first beyond it
    int32_t shell; // s + 1 where the row enters shell s by its normals, else -(s + 1)
    int32_t back;  // from the low side of that cell to the crossing [grid steps], rounded
} Crossing;

// A closed part of the mesh.
typedef struct Shell {
    double volume;  // in grid steps along all rows, by its normals
    int depth;      // shells around it, where it is around fewest
    int winds, way; // around the cell that is looked at; +1, or -1 for one that counts as a hole
} Shell;

// The rows that a mesh is cut along.
typedef struct Raster {
    Lattice *lattice;
    Vec3 low;      // low corner of the grid [m]
    Point *point;  // [node]
    int *shell_of; // [node]
    Shell *shell;  // [shell_count]
    int shell_count;
    Crossing *crossing; // [count]
    size_t count, capacity;
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
    return status_fail(
        status, STATUS_INVALID,
        "the mesh is not closed: no other triangle borders the one at the edge "
        "between nodes %d and %d, so it has no inside; MeshLab's Close Holes gives it one",
        mesh->file_index[half_edge_from(mesh, open)], mesh->file_index[half_edge_to(mesh, open)]);
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

static void add_crossing(Raster *raster, Crossing crossing)
{
    if (raster->count == raster->capacity) {
        raster->capacity = raster->capacity == 0 ? 1024 : 2 * raster->capacity;
        raster->crossing = realloc(raster->crossing, raster->capacity * sizeof *raster->crossing);
        ASSERT(raster->crossing != NULL);
    }
    raster->crossing[raster->count++] = crossing;
}

// `shell`: of the triangle p, negative if it was turned to run counter-clockwise here.
static void cross_row(Raster *raster, const int64_t *const p[3], int shell, int j, int k)
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
    const int most = raster->lattice->count[0];
    int64_t cell = first_beyond(p, w);
    cell = cell < 0 ? 0 : cell > most ? most : cell;
    const Wide sum = w[0] + w[1] + w[2];
    const int64_t at = floor_divide(w[0] * p[0][0] + w[1] * p[1][0] + w[2] * p[2][0], sum);
    // Counter-clockwise in y and z, the normal points along x: the row leaves.
    add_crossing(raster,
                 (Crossing){.row = (uint32_t)k * (uint32_t)raster->lattice->count[1] + (uint32_t)j,
                            .cell = (int32_t)cell,
                            .shell = -shell,
                            .back = (int32_t)(2 * HALF_CELL * cell - at)});
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
    int shell = raster->shell_of[corner[0]] + 1;
    const int64_t *p[3];
    for (int c = 0; c < 3; c++)
        p[c] = raster->point[corner[c]];
    // Orient the triangle; edge-on it has no inside that a row could cross.
    Wide area = edge_area(p[0], p[1], p[2][1], p[2][2]);
    if (area == 0)
        return;
    if (area < 0) {
        shell = -shell;
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
    for (int k = from > 0 ? from : 0; k <= to && k < layers && raster->count < MOST_CROSSINGS;
         k++) {
        int first, end;
        find_rows(p, (2 * k + 1) * HALF_CELL, raster->lattice->count[1], &first, &end);
        for (int j = first; j < end; j++)
            cross_row(raster, p, shell, j, k);
    }
}

// --- shells --------------------------------------------------------------------------------------

// Numbers the parts that share no node.
static void find_shells(Raster *raster, const TriMesh *mesh)
{
    raster->shell_of = malloc(((size_t)mesh->node_count + 1) * sizeof *raster->shell_of);
    ASSERT(raster->shell_of != NULL);
    for (int n = 0; n < mesh->node_count; n++)
        raster->shell_of[n] = n;
    for (int h = 0; h < 3 * mesh->triangle_count; h++)
        union_find_join(raster->shell_of, half_edge_from(mesh, h), half_edge_to(mesh, h));
    raster->shell_count = union_find_number(raster->shell_of, mesh->node_count);
    raster->shell = calloc((size_t)raster->shell_count + 1, sizeof *raster->shell);
    ASSERT(raster->shell != NULL);
    for (int s = 0; s < raster->shell_count; s++)
        raster->shell[s].depth = raster->shell_count;
}

static int compare_crossings(const void *a, const void *b)
{
    const Crossing *p = a, *q = b;
    if (p->row != q->row)
        return p->row < q->row ? -1 : 1;
    if (p->cell != q->cell)
        return p->cell < q->cell ? -1 : 1;
    // Farther back comes first.
    return p->back != q->back ? (p->back > q->back ? -1 : 1)
                              : (p->shell > q->shell) - (p->shell < q->shell);
}

static Shell *shell_at(const Raster *raster, size_t crossing, int *turn)
{
    const int named = raster->crossing[crossing].shell;
    *turn = named > 0 ? 1 : -1;
    return &raster->shell[abs(named) - 1];
}

static bool is_tied(const Raster *raster, size_t a, size_t b)
{
    const Crossing *p = &raster->crossing[a], *q = &raster->crossing[b];
    return p->row == q->row && p->cell == q->cell && p->back == q->back;
}

// Notes how many others are around the shells that pass in [first, end).
static void note_depth(Raster *raster, size_t first, size_t end, int around)
{
    int turn;
    for (size_t i = first; i < end; i++) {
        Shell *shell = shell_at(raster, i, &turn);
        const int others = around - (shell->winds != 0);
        shell->depth = others < shell->depth ? others : shell->depth;
    }
}

// Finds for each shell its volume and its depth: the number of shells that are around it wherever a
// row passes through it. One that crosses or touches another is not within it.
static void measure_shells(Raster *raster)
{
    int around = 0, turn;
    for (size_t first = 0, end; first < raster->count; first = end) {
        for (end = first; end < raster->count && is_tied(raster, first, end);)
            end++;
        // Those that pass at one place are neither in nor out of each other.
        note_depth(raster, first, end, around);
        for (size_t i = first; i < end; i++) {
            const Crossing *crossing = &raster->crossing[i];
            Shell *shell = shell_at(raster, i, &turn);
            around -= shell->winds != 0;
            shell->winds += turn;
            around += shell->winds != 0;
            shell->volume -= turn * (2.0 * (double)HALF_CELL * crossing->cell - crossing->back);
        }
        note_depth(raster, first, end, around);
    }
    // All face outward, but those within an odd number of others are holes.
    for (int s = 0; s < raster->shell_count; s++) {
        Shell *shell = &raster->shell[s];
        const bool met = shell->depth < raster->shell_count, inner = met && shell->depth % 2 != 0;
        shell->way = (shell->volume < 0.0 ? -1 : 1) * (inner ? -1 : 1);
        raster->lattice->shells.inner += inner;
    }
    raster->lattice->shells.count = raster->shell_count;
}

// Adds up the volumes of the shells, and of those that are holes.
static void measure_volumes(const Raster *raster, const TriMesh *mesh)
{
    LatticeShells *shells = &raster->lattice->shells;
    double *volume = calloc((size_t)raster->shell_count + 1, sizeof *volume);
    ASSERT(volume != NULL);
    shells->volume = shells->all = 0.0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        Vec3 x[3];
        for (int c = 0; c < 3; c++)
            x[c] = vec3_sub(mesh->position[mesh->triangle[t][c]], raster->low);
        volume[raster->shell_of[mesh->triangle[t][0]]] +=
            vec3_dot(x[0], vec3_cross(x[1], x[2])) / 6.0;
    }
    for (int s = 0; s < raster->shell_count; s++) {
        const bool met = raster->shell[s].depth < raster->shell_count;
        shells->all += fabs(volume[s]);
        shells->volume += met && raster->shell[s].depth % 2 != 0 ? fabs(volume[s]) : 0.0;
    }
    free(volume);
}

// Labels a run of cells that shells wind around `net` times, holes counted against, and `all` times
// without.
static void label_run(Lattice *lattice, long first, int cells, int net, int all)
{
    LatticeShells *shells = &lattice->shells;
    if (cells <= 0 || (net == 0 && all == 0))
        return;
    const bool inside = net != 0 || shells->filled;
    shells->claimed += (long)abs(all) * cells;
    shells->hollow += net == 0 ? cells : 0;
    shells->overlap += abs(net) > 1 ? (long)(abs(net) - 1) * cells : 0;
    memset(&lattice->label[first], inside, (size_t)cells);
}

// Turns crossings into inside and outside; returns the number of solid cells.
static long fill_rows(Raster *raster)
{
    Lattice *lattice = raster->lattice;
    const long along = lattice->count[0];
    // `hole`: what the shells that are holes wind by themselves.
    int net = 0, hole = 0, turn;
    for (size_t i = 0; i < raster->count; i++) {
        const Crossing *crossing = &raster->crossing[i];
        const bool last = i + 1 == raster->count || crossing[1].row != crossing->row;
        Shell *shell = shell_at(raster, i, &turn);
        net += turn * shell->way;
        if (shell->depth % 2 != 0)
            hole += turn * shell->way;
        const int next = last ? (int)along : crossing[1].cell;
        label_run(lattice, crossing->row * along + crossing->cell, next - crossing->cell, net,
                  net - 2 * hole);
        if (last)
            net = hole = 0;
    }
    return lattice_solid(lattice);
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

static bool cut_rows(Raster *raster, const TriMesh *mesh, Status *status)
{
    // From here on all is exact: nodes are integers.
    round_nodes(raster, mesh);
    find_shells(raster, mesh);
    for (int t = 0; t < mesh->triangle_count && raster->count < MOST_CROSSINGS; t++)
        cross_triangle(raster, mesh->triangle[t]);
    if (raster->count >= MOST_CROSSINGS)
        return status_fail(status, STATUS_INVALID,
                           "the mesh crosses the rows of cells more than %d times; larger cells "
                           "would do",
                           MOST_CROSSINGS);
    if (raster->count > 0)
        qsort(raster->crossing, raster->count, sizeof *raster->crossing, compare_crossings);
    measure_shells(raster);
    measure_volumes(raster, mesh);
    return true;
}

bool voxelise(Lattice *lattice, const TriMesh *mesh, double size, bool filled, Status *status)
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
    lattice->shells.filled = filled;
    // Void margins go last.
    const bool ok = cut_rows(&raster, mesh, status) &&
                    check_solid(fill_rows(&raster), size, status) && lattice_crop(lattice, status);
    free(raster.point);
    free(raster.shell_of);
    free(raster.shell);
    free(raster.crossing);
    if (!ok)
        lattice_destroy(lattice);
    return ok;
}
