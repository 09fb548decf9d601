// SPDX-License-Identifier: MIT
// Lattices: creation, placement, number of pieces. Load time only; never on the step thread.
#include "geometry/lattice.h"

#include "base/check.h"
#include "base/sets.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool lattice_create(Lattice *lattice, const int count[3], double size, Status *status)
{
    *lattice = (Lattice){.turn = {1.0, 0.0, 0.0, 0.0}};
    // Refuse what has no cells, too many, or none of a size.
    if (count[0] < 1 || count[1] < 1 || count[2] < 1)
        return status_fail(status, STATUS_INVALID, "a lattice of %d x %d x %d cells has none",
                           count[0], count[1], count[2]);
    double cells = (double)count[0] * (double)count[1] * (double)count[2];
    if (cells > LATTICE_MOST_CELLS)
        return status_fail(status, STATUS_INVALID,
                           "a lattice of %d x %d x %d cells, void ones counted, has more than %d",
                           count[0], count[1], count[2], LATTICE_MOST_CELLS);
    if (!(size > 0.0) || !isfinite(size))
        return status_fail(status, STATUS_INVALID, "cells of %g m are not possible", size);
    // All void at first.
    lattice->label = calloc((size_t)cells, 1);
    if (lattice->label == NULL)
        return status_fail(status, STATUS_FAILED, "no memory for a lattice of %.0f cells", cells);
    for (int i = 0; i < 3; i++)
        lattice->count[i] = count[i];
    lattice->size = size;
    return true;
}

void lattice_destroy(Lattice *lattice)
{
    free(lattice->label);
    *lattice = (Lattice){0};
}

int lattice_label(const Lattice *lattice, int i, int j, int k)
{
    if (i < 0 || i >= lattice->count[0] || j < 0 || j >= lattice->count[1] || k < 0 ||
        k >= lattice->count[2])
        return 0;
    return lattice->label[lattice_index(lattice, i, j, k)];
}

// True if the lattice is rotated; without a rotation placement keeps all bits.
static bool is_turned(const Lattice *lattice)
{
    return lattice->turn.x != 0.0 || lattice->turn.y != 0.0 || lattice->turn.z != 0.0;
}

Vec3 lattice_point(const Lattice *lattice, double i, double j, double k)
{
    Vec3 offset = vec3_scale(lattice->size, vec3(i, j, k));
    if (is_turned(lattice))
        offset = quat_rotate(lattice->turn, offset);
    return vec3_add(lattice->origin, offset);
}

static size_t cell_count(const Lattice *lattice)
{
    return (size_t)lattice->count[0] * (size_t)lattice->count[1] * (size_t)lattice->count[2];
}

long lattice_solid(const Lattice *lattice)
{
    size_t cells = cell_count(lattice);
    long solid = 0;
    for (size_t i = 0; i < cells; i++)
        solid += lattice->label[i] != 0;
    return solid;
}

void lattice_place(Lattice *lattice, double scale, Vec3 rotation, Vec3 translation)
{
    ASSERT(scale > 0.0);
    lattice->size *= scale;
    lattice->origin = vec3_scale(scale, lattice->origin);
    if (rotation.x != 0.0 || rotation.y != 0.0 || rotation.z != 0.0) {
        Quat turn = quat_from_rotation(rotation);
        lattice->origin = quat_rotate(turn, lattice->origin);
        lattice->turn = quat_unit(quat_multiply(turn, lattice->turn));
    }
    lattice->origin = vec3_add(lattice->origin, translation);
}

bool lattice_shells_text(LatticeShells shells, char *text, size_t room)
{
    const char *const word = shells.filled ? "filled" : "cavities";
    size_t used = 0;
    text[0] = '\0';
    if (shells.inner > 0)
        used = (size_t)snprintf(text, room,
                                "closed parts within others, %d of %d: %s of %.3g cm3 (the "
                                "other by voxels.inner = \"%s\")",
                                shells.inner, shells.count, word, 1e6 * shells.volume,
                                shells.filled ? "cavity" : "filled");
    // Cells tell which share overlaps, better than how much: they are rounded alike.
    if (shells.overlap > 0 && used < room)
        snprintf(text + used, room - used,
                 "%sits parts overlap by about %.3g cm3, which count once", used > 0 ? "; " : "",
                 1e6 * shells.all * (double)shells.overlap / (double)shells.claimed);
    return text[0] != '\0';
}

// --- margins ---

// Finds the box of solid cells, low to high, high excluded. False if there are none.
static bool solid_box(const Lattice *lattice, int low[3], int high[3])
{
    // Begin with an empty box.
    for (int a = 0; a < 3; a++) {
        low[a] = lattice->count[a];
        high[a] = 0;
    }
    for (int k = 0; k < lattice->count[2]; k++)
        for (int j = 0; j < lattice->count[1]; j++) {
            // The first and the last solid cell of each row.
            const unsigned char *row = &lattice->label[lattice_index(lattice, 0, j, k)];
            int first = 0, end = lattice->count[0];
            while (first < end && row[first] == 0)
                first++;
            if (first == end)
                continue;
            while (row[end - 1] == 0)
                end--;
            // The box takes in this part of the row.
            const int from[3] = {first, j, k}, to[3] = {end, j + 1, k + 1};
            for (int a = 0; a < 3; a++) {
                low[a] = from[a] < low[a] ? from[a] : low[a];
                high[a] = to[a] > high[a] ? to[a] : high[a];
            }
        }
    return high[0] > 0;
}

bool lattice_crop(Lattice *lattice, Status *status)
{
    // What is left after cropping.
    int low[3], high[3], count[3];
    if (!solid_box(lattice, low, high))
        return status_fail(status, STATUS_INVALID, "no cell of the lattice is solid");
    for (int a = 0; a < 3; a++)
        count[a] = high[a] - low[a];
    // Rows move towards the start, so that none is overwritten before it has moved.
    unsigned char *to = lattice->label;
    for (int k = low[2]; k < high[2]; k++)
        for (int j = low[1]; j < high[1]; j++) {
            memmove(to, &lattice->label[lattice_index(lattice, low[0], j, k)], (size_t)count[0]);
            to += count[0];
        }
    // The box's low corner becomes cell 0.
    lattice->origin = lattice_point(lattice, low[0], low[1], low[2]);
    for (int a = 0; a < 3; a++)
        lattice->count[a] = count[a];
    // Return the memory of the margins.
    unsigned char *label = realloc(lattice->label, cell_count(lattice));
    ASSERT(label != NULL);
    lattice->label = label;
    return true;
}

// --- pieces ---

// Consecutive solid cells of one row.
typedef struct Run {
    int first, end;
} Run;

// Joins the runs of two adjacent rows; returns by how much the number of pieces falls.
static int join_rows(const Run *run, int *parent, int a, int a_end, int b, int b_end)
{
    int joined = 0;
    while (a < a_end && b < b_end) {
        if (run[a].first < run[b].end && run[b].first < run[a].end)
            joined += union_find_join(parent, a, b);
        if (run[a].end < run[b].end)
            a++;
        else
            b++;
    }
    return joined;
}

// Appends the runs of a row to `run` (NULL: only counts them); returns the new number of runs.
static int find_runs(const unsigned char *row, int count, Run *run, int run_count)
{
    for (int i = 0; i < count; i++) {
        if (row[i] == 0)
            continue;
        // From the first solid cell to the next void one.
        int first = i;
        while (i < count && row[i] != 0)
            i++;
        if (run != NULL)
            run[run_count] = (Run){first, i};
        run_count++;
    }
    return run_count;
}

int lattice_pieces(const Lattice *lattice)
{
    int width = lattice->count[0], height = lattice->count[1];
    size_t rows = (size_t)height * (size_t)lattice->count[2];
    // First pass: count the runs, to allocate them.
    int run_count = 0;
    for (size_t r = 0; r < rows; r++)
        run_count = find_runs(&lattice->label[r * (size_t)width], width, NULL, run_count);
    Run *run = malloc(((size_t)run_count + 1) * sizeof *run);
    int *start = malloc((rows + 1) * sizeof *start);                // [row] its first run
    int *parent = malloc(((size_t)run_count + 1) * sizeof *parent); // [run] sets.h
    ASSERT(run != NULL && start != NULL && parent != NULL);
    union_find_reset(parent, run_count);
    // Second pass: each run is a piece until it touches one of the row before or the layer below.
    int pieces = run_count;
    start[0] = 0;
    for (size_t r = 0; r < rows; r++) {
        start[r + 1] = find_runs(&lattice->label[r * (size_t)width], width, run, start[r]);
        if (r % (size_t)height > 0)
            pieces -= join_rows(run, parent, start[r - 1], start[r], start[r], start[r + 1]);
        if (r >= (size_t)height) {
            size_t below = r - (size_t)height;
            pieces -=
                join_rows(run, parent, start[below], start[below + 1], start[r], start[r + 1]);
        }
    }
    free(run);
    free(start);
    free(parent);
    return pieces;
}

// --- boxes, balls and discs of cells, for tests and demonstrations ---

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
    // What has no cell, and what would overflow below.
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
    // Label the cells whose centre is near enough.
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
