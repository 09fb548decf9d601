// SPDX-License-Identifier: MIT
// The grid in which a search of a touch finds faces (server/sim/README.md, "Contact between
// bodies"): over the faces in a box, each in all cells from which a point can reach it, so that a
// point asks one.
#include "sim/touch/touch_data.h"

#include <string.h>

static void add_face(TouchHalf *half, int face)
{
    const Vec3 *place = half->faces->place;
    const int *corner = half->faces->body->surface.face[face];
    const Vec3 a = place[corner[0]], b = place[corner[1]], c = place[corner[2]];
    TouchFace *at = &half->face[half->face_count++];
    at->face = face;
    at->center = vec3_scale(1.0 / 3.0, vec3_add(vec3_add(a, b), c));
    at->normal = vec3_unit(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)));
    const Vec3 arm[3] = {vec3_sub(a, at->center), vec3_sub(b, at->center), vec3_sub(c, at->center)};
    at->radius = sqrt(
        fmax(vec3_dot(arm[0], arm[0]), fmax(vec3_dot(arm[1], arm[1]), vec3_dot(arm[2], arm[2]))));
    // The guard deals with a body that has bad numbers.
    if (!isfinite(vec3_dot(at->center, at->center)) || !isfinite(at->radius))
        half->face_count--;
}

// Lists the faces around the nodes in a box that is wide enough for faces whose corners all lie
// outside of `box`.
static void list_faces(TouchHalf *half, const Box *box)
{
    const TouchEnd *end = half->faces;
    const BodySurface *surface = &end->body->surface;
    Box wide = *box;
    box_grow(&wide, 1.16 * surface->longest_edge); // as CONTACT_FACE_REACH
    half->search++;
    for (int i = 0; i < end->used_count; i++) {
        if (!box_has(&wide, end->packed_place[i]))
            continue;
        const int node = end->used[i];
        for (int k = surface->node_face_start[node]; k < surface->node_face_end[node]; k++) {
            const int face = surface->node_face[k];
            if (half->stamp[face] == half->search)
                continue;
            half->stamp[face] = half->search;
            add_face(half, face);
        }
    }
}

// Returns the cells that a face within reach of a point can be asked for in.
static TouchCells cells_of(const TouchHalf *half, const TouchFace *face, double reach)
{
    const double center[3] = {face->center.x - half->low.x, face->center.y - half->low.y,
                              face->center.z - half->low.z};
    const double around = face->radius + reach, inverse = 1.0 / half->cell;
    TouchCells range;
    for (int c = 0; c < 3; c++) {
        const double low = (center[c] - around) * inverse, high = (center[c] + around) * inverse;
        const int last = half->cells[c] - 1;
        // An empty range stays empty.
        range.low[c] = low < 0.0 ? 0 : low >= last + 1 ? last + 1 : (int)low;
        range.high[c] = high < 0.0 ? -1 : high > last ? last : (int)high;
    }
    return range;
}

static int cell_number(const TouchHalf *half, int i, int j, int k)
{
    return (k * half->cells[1] + j) * half->cells[0] + i;
}

// Counts the faces of each cell. Returns false if there are too many entries.
static bool count_cells(TouchHalf *half, double reach)
{
    const int cells = half->cells[0] * half->cells[1] * half->cells[2];
    memset(half->cell_start, 0, (size_t)(cells + 1) * sizeof *half->cell_start);
    int64_t entries = 0;
    for (int f = 0; f < half->face_count; f++) {
        const TouchCells r = half->in[f] = cells_of(half, &half->face[f], reach);
        for (int k = r.low[2]; k <= r.high[2]; k++)
            for (int j = r.low[1]; j <= r.high[1]; j++)
                for (int i = r.low[0]; i <= r.high[0]; i++, entries++)
                    half->cell_start[cell_number(half, i, j, k) + 1]++;
    }
    half->entries = entries <= half->entry_capacity ? (int)entries : 0;
    return entries <= half->entry_capacity;
}

// Sorts the faces into cells, each face into all from which a point can reach it: a point asks one.
static void fill_cells(TouchHalf *half)
{
    const int cells = half->cells[0] * half->cells[1] * half->cells[2];
    for (int c = 0; c < cells; c++)
        half->cell_start[c + 1] += half->cell_start[c];
    // Backwards, so that starts become those of the cells and faces ascend.
    for (int f = half->face_count - 1; f >= 0; f--) {
        const TouchCells r = half->in[f];
        for (int k = r.low[2]; k <= r.high[2]; k++)
            for (int j = r.low[1]; j <= r.high[1]; j++)
                for (int i = r.low[0]; i <= r.high[0]; i++)
                    half->cell_face[--half->cell_start[cell_number(half, i, j, k) + 1]] = f;
    }
}

// True if all faces of a cell are of one piece and within a cone, so that no two face each other.
static bool is_smooth(const TouchHalf *half, const int *near, int count)
{
    const int *piece = half->faces->piece;
    const int(*corner)[3] = half->faces->body->surface.face;
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int i = 0; i < count; i++)
        sum = vec3_add(sum, half->face[near[i]].normal);
    // Within twice the angle to the axis.
    const double least = sqrt(0.5 * (1.0 + TOUCH_ALIGNED)) * vec3_length(sum);
    for (int i = 0; i < count; i++)
        if (!(vec3_dot(sum, half->face[near[i]].normal) > least) ||
            piece[corner[half->face[near[i]].face][0]] !=
                piece[corner[half->face[near[0]].face][0]])
            return false;
    return true;
}

static int faces_of_cell(const TouchHalf *half, int cell, const int **near)
{
    // The start of cell c is kept one place later by fill_cells.
    const int last = half->cells[0] * half->cells[1] * half->cells[2] - 1,
              first = half->cell_start[cell + 1],
              end = cell < last ? half->cell_start[cell + 2] : half->entries;
    *near = &half->cell_face[first];
    return end - first;
}

// Marks cells in which nothing can touch.
static void find_smooth(TouchHalf *half)
{
    const int cells = half->cells[0] * half->cells[1] * half->cells[2];
    for (int c = 0; c < cells; c++) {
        const int *near;
        const int count = faces_of_cell(half, c, &near);
        half->cell_smooth[c] = is_smooth(half, near, count);
    }
}

void touch_grid_build(TouchHalf *half, const Box *box, double reach)
{
    enum { ROUNDS = 100 };
    double width = 0.0;
    half->face_count = 0;
    if (!box_is_empty(box))
        list_faces(half, box);
    if (half->face_count == 0)
        return;
    for (int f = 0; f < half->face_count; f++)
        width += half->face[f].radius / half->face_count;
    half->low = box_low(box);
    const Vec3 size = box_size(box);
    const double side[3] = {size.x, size.y, size.z};
    // Larger cells until their number and that of the entries fit: one cell always does.
    bool fits = false;
    half->cell = 2.0 * (reach + width);
    for (int round = 0; round < ROUNDS && !fits; round++) {
        double cells = 1.0;
        half->cell *= round > 0 ? 1.5 : 1.0;
        for (int c = 0; c < 3; c++) {
            const double along = floor(side[c] / half->cell) + 1.0;
            cells *= along;
            half->cells[c] = (int)fmin(along, 1e6);
        }
        fits = cells <= half->cell_capacity && count_cells(half, reach);
    }
    if (!fits) { // a body without bounds
        half->face_count = 0;
        return;
    }
    fill_cells(half);
    if (half->cell_smooth != NULL)
        find_smooth(half);
}

int touch_grid_at(const TouchHalf *half, Vec3 x, const int **near)
{
    if (half->face_count == 0)
        return 0;
    const double at[3] = {x.x - half->low.x, x.y - half->low.y, x.z - half->low.z};
    int cell[3];
    for (int c = 0; c < 3; c++)
        cell[c] = (int)fmin(floor(at[c] / half->cell), half->cells[c] - 1);
    const int number = cell_number(half, cell[0], cell[1], cell[2]);
    if (half->cell_smooth != NULL && half->cell_smooth[number])
        return 0;
    return faces_of_cell(half, number, near);
}
