// SPDX-License-Identifier: MIT
// Fades: a node stays where it was at the moment of a change, and goes from there to its place.
#include "voxel/cut/cut_fit_parts.h"

#include "voxel/cut/cut_parts.h"

#include <string.h>

#define SMALLEST_JUMP 1e-7 // [cells] less is no jump
#define VISIBLE_JUMP  2e-3 // [cells] of what merges move: less is not worth a fade

static Vec3 displacement(const CutFit *fit, const void *row, int vertex)
{
    return rows_vector(&fit->vertices->rows, cut_carry_rows(fit->faces->masses->carry, row, vertex),
                       vertex, 0);
}

// Returns the deformation of a cell, in the rows' axes.
static double (*gradient_of(CutFit *fit, const void *row, int cell))[3]
{
    double(*gradient)[3] = fit->gradient[cell];
    if (fit->known[cell] == fit->stamp)
        return gradient;
    fit->known[cell] = fit->stamp;
    memset(gradient, 0, sizeof *fit->gradient);
    const double quarter = 0.25 / fit->fitted.size;
    for (int k = 0; k < FIT_CORNERS; k++) {
        const Vec3 u = displacement(fit, row, cut_fit_corner(fit, cell, k));
        for (int axis = 0; axis < 3; axis++) {
            const double sign = k >> axis & 1 ? quarter : -quarter;
            gradient[axis][0] += sign * u.x;
            gradient[axis][1] += sign * u.y;
            gradient[axis][2] += sign * u.z;
        }
    }
    for (int axis = 0; axis < 3; axis++)
        gradient[axis][axis] += 1.0;
    return gradient;
}

static int root_of(const CutFit *fit, int vertex)
{
    while (fit->origin[vertex] >= 0)
        vertex = fit->origin[vertex];
    return vertex;
}

// F o of the cells around a point, in the rows' axes [m].
typedef struct Around {
    int vertex[8], root[8];      // by slot; -1: none
    double now[8][3], was[8][3]; // with the present offset, and that of before
} Around;

static void times(const double gradient[3][3], const float offset[3], double size, double out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = size * (gradient[0][c] * (double)offset[0] + gradient[1][c] * (double)offset[1] +
                         gradient[2][c] * (double)offset[2]);
}

static void find_around(CutFit *fit, const void *row, const CutMoved *at, Around *around)
{
    const double size = fit->fitted.size;
    for (int s = 0; s < 8; s++) {
        const int v = around->vertex[s] = cut_fit_vertex_of(fit, at, s);
        around->root[s] = v < 0 ? -1 : root_of(fit, v);
        if (v < 0)
            continue;
        double(*gradient)[3] = gradient_of(fit, row, at->leaf[s]);
        times((const double(*)[3])gradient, fit->point_offset[at->index], size, around->now[s]);
        times((const double(*)[3])gradient, at->before, size, around->was[s]);
    }
}

// Returns the number of entries that are `which`, and the mean of their values.
static int mean_of(const int entry[8], int which, const double value[8][3], double mean[3])
{
    int count = 0;
    mean[0] = mean[1] = mean[2] = 0.0;
    for (int s = 0; s < 8; s++) {
        if (entry[s] != which)
            continue;
        for (int c = 0; c < 3; c++)
            mean[c] += value[s][c];
        count++;
    }
    for (int c = 0; c < 3 && count > 0; c++)
        mean[c] /= count;
    return count;
}

void cut_fit_count_newest(CutFit *fit)
{
    int *newest = &fit->fitted.fit.fade_last;
    *newest = fit->newest_count = 0;
    for (int v = 0; v < fit->faces->vertex_count; v++) {
        const int step = fit->fade[v].step;
        fit->newest_count = step > *newest ? 1 : fit->newest_count + (step == *newest);
        *newest = step > *newest ? step : *newest;
    }
}

// Sets a fade. Nearly always it is as new as any, so that only the vertices with such ones are
// counted, not all looked at in each change.
static void set_fade(CutFit *fit, int vertex, const CutFade *fade)
{
    int *newest = &fit->fitted.fit.fade_last;
    fit->newest_count -= fit->fade[vertex].step == *newest;
    fit->fade[vertex] = *fade;
    if (fade->step > *newest) {
        *newest = fade->step;
        fit->newest_count = 0;
    }
    fit->newest_count += fade->step == *newest;
}

// Marks a vertex for the list of fades.
void cut_fit_list_fade(CutFit *fit, int vertex)
{
    if (fit->is_fading[vertex] || fit->fading_count == fit->fitted.fit.fade_capacity)
        return;
    fit->is_fading[vertex] = 1;
    fit->fading_vertex[fit->fading_count++] = vertex;
}

// Converts a direction of the rows' axes to the world's.
static void turn_out(const CutFit *fit, const double local[3], float to[3])
{
    const Rows *rows = &fit->vertices->rows;
    Vec3 world = vec3(local[0], local[1], local[2]);
    if (rows->turned)
        world = quat_rotate(rows->frame->turn, world);
    to[0] = (float)world.x, to[1] = (float)world.y, to[2] = (float)world.z;
}

// Finds where a vertex is shown at present if it was a node before the change, else where its point
// would be, in the rows' axes from the vertex [m]. Returns the number of its cells.
static int find_before(const CutFit *fit, const Around *around, int root, double out[3])
{
    const int slot = fit->faces->slot_of[root];
    const bool was_node = slot >= 0 && slot < fit->slots;
    const CutFade *fade = &fit->fade[root];
    const int had = mean_of(around->root, root,
                            (const double(*)[3])(was_node ? around->was : around->now), out);
    if (!was_node || fade->step <= 0)
        return had;
    const double left = (double)fit_left(fade->step, fit->fitted.fit.fade_steps, fit->step);
    const Vec3 from =
        rows_turn_in(&fit->vertices->rows,
                     vec3((double)fade->from[0], (double)fade->from[1], (double)fade->from[2]));
    out[0] = (1.0 - left) * out[0] + left * from.x;
    out[1] = (1.0 - left) * out[1] + left * from.y;
    out[2] = (1.0 - left) * out[2] + left * from.z;
    return had;
}

// Lets the nodes of a point start from where they, or what they were part of, are shown.
void cut_fit_start_fades(CutFit *fit, const void *row, const CutMoved *at)
{
    const CutScratch *scratch = fit->lattice->scratch;
    const double close = SMALLEST_JUMP * fit->fitted.size;
    int vertex[8], count = 0;
    CutFade begun[8];
    Around around;
    find_around(fit, row, at, &around);
    for (int v = cut_parts_first(scratch, at->index); v >= 0; v = scratch->next[v]) {
        double before[3], after[3], square = 0.0;
        if (!cut_fit_is_node(fit, v))
            continue;
        const int root = root_of(fit, v), had = find_before(fit, &around, root, before);
        const int has = mean_of(around.vertex, v, (const double(*)[3])around.now, after);
        if (v == root && had == has && !at->moved)
            continue;
        begun[count] = (CutFade){.step = (int)fit->step};
        turn_out(fit, before, begun[count].from);
        for (int c = 0; c < 3; c++)
            square += (after[c] - before[c]) * (after[c] - before[c]);
        if (!(square > close * close))
            begun[count] = (CutFade){.step = 0};
        vertex[count++] = v;
    }
    // Not before all are known: copies start from the fade of their original.
    for (int k = 0; k < count; k++) {
        set_fade(fit, vertex[k], &begun[k]);
        if (begun[k].step > 0)
            cut_fit_list_fade(fit, vertex[k]);
    }
}

// Returns how far a merge has moved a vertex [m].
static Vec3 move_of(const CutFit *fit, const void *row, int vertex)
{
    const CutCarry *carry = fit->faces->masses->carry;
    if (!cut_lattice_is_kept(fit->lattice, vertex) || carry->moved[vertex] == 0)
        return vec3(0.0, 0.0, 0.0);
    const double *from = carry->move[carry->moved[vertex] - 1].from;
    return vec3_sub(displacement(fit, row, vertex), vec3(from[0], from[1], from[2]));
}

// Adds what a cell's present gradient differs from that before a merge by, times an offset, to
// what is shown of a vertex now.
static void take_back(const CutFit *fit, const void *row, int cell, const float offset[3],
                      double share, double from[3])
{
    for (int k = 0; k < FIT_CORNERS; k++) {
        const Vec3 moved = move_of(fit, row, cut_fit_corner(fit, cell, k));
        double by = 0.0;
        for (int axis = 0; axis < 3; axis++)
            by += (k >> axis & 1 ? 0.25 : -0.25) * (double)offset[axis];
        from[0] -= share * by * moved.x;
        from[1] -= share * by * moved.y;
        from[2] -= share * by * moved.z;
    }
}

// A node goes on from where it was shown.
void cut_fit_fade_moves(CutFit *fit, const void *row)
{
    CutCarry *carry = fit->faces->masses->carry;
    const double seen = VISIBLE_JUMP * fit->fitted.size;
    for (int k = 0; k < carry->move_count; k++) {
        const CarryMove *move = &carry->move[k];
        const Vec3 moved = move_of(fit, row, move->vertex);
        if (!(vec3_length(moved) > seen) || !cut_fit_is_node(fit, move->vertex))
            continue;
        double from[3];
        Around around;
        CutMoved at;
        cut_lattice_point(fit->lattice, move->vertex, at.point);
        at.index = cut_parts_index(fit->lattice->scratch, at.point);
        memcpy(at.before, fit->point_offset[at.index], sizeof at.before);
        cut_fit_around(fit, &at);
        find_around(fit, row, &at, &around);
        const int cells = find_before(fit, &around, move->vertex, from);
        from[0] -= moved.x, from[1] -= moved.y, from[2] -= moved.z;
        // What a fade has left of the offset.
        const CutFade *fade = &fit->fade[move->vertex];
        const double left =
            fade->step > 0 ? (double)fit_left(fade->step, fit->fitted.fit.fade_steps, fit->step)
                           : 0.0;
        for (int s = 0; s < 8; s++)
            if (around.vertex[s] == move->vertex)
                take_back(fit, row, at.leaf[s], at.before, (1.0 - left) / cells, from);
        CutFade begun = {.step = (int)fit->step};
        turn_out(fit, from, begun.from);
        set_fade(fit, move->vertex, &begun);
        cut_fit_list_fade(fit, move->vertex);
    }
    cut_carry_forget_moves(carry);
}

void cut_fit_node(const CutFit *fit, int vertex, int64_t step, FitNode *out)
{
    const CutFade *fade = &fit->fade[vertex];
    const float left =
        fade->step > 0 ? fit_left(fade->step, fit->fitted.fit.fade_steps, step) : 0.0F;
    int point[3];
    cut_lattice_point(fit->lattice, vertex, point);
    const float *offset = fit->point_offset[cut_parts_index(fit->lattice->scratch, point)];
    const double *rest = fit->vertices->rows.rest[vertex];
    *out = (FitNode){.shift = vec3((double)(left * fade->from[0]), (double)(left * fade->from[1]),
                                   (double)(left * fade->from[2]))};
    for (int c = 0; c < 3; c++) {
        out->offset[c] = (double)(1.0F - left) * (double)offset[c];
        out->rest[c] = rest[c] + fit->fitted.size * (double)offset[c];
    }
    // The cells that clients have of it.
    for (int s = 0; s < 8; s++) {
        const int cell = cut_lattice_cell(fit->lattice, point[0] - 1 + (s & 1),
                                          point[1] - 1 + (s >> 1 & 1), point[2] - 1 + (s >> 2));
        const int at = cell < 0 ? -1 : fit->cell_at[cell];
        if (at < 0 || fit->vertex[fit->cell[at][7 - s]] != vertex)
            continue;
        for (int k = 0; k < FIT_CORNERS; k++)
            out->corner[out->cell_count][k] = fit->vertex[fit->cell[at][k]];
        out->cell_count++;
    }
}

// Drops fades that have ended, and writes the others for clients.
void cut_fit_write_fades(CutFit *fit)
{
    BodyFit *out = &fit->fitted.fit;
    int kept = 0;
    for (int k = 0; k < fit->fading_count; k++) {
        const int v = fit->fading_vertex[k];
        const CutFade *fade = &fit->fade[v];
        if (fade->step <= 0 || fit->step - fade->step >= out->fade_steps) {
            fit->is_fading[v] = 0;
            continue;
        }
        fit->fading[kept] = (FitFade){.node = fit->faces->slot_of[v],
                                      .step = fade->step,
                                      .from = {fade->from[0], fade->from[1], fade->from[2]}};
        fit->fading_vertex[kept++] = v;
    }
    fit->fading_count = out->fade_count = kept;
    if (fit->newest_count == 0)
        cut_fit_count_newest(fit);
}
