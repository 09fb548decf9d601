// The grid in which a search of a touch finds faces (README.md, "Contact between bodies"): over the
// faces in a box, each in all cells from which a point can reach it, so that a point asks one.
#include "dynamics/touch_data.h"

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

typedef struct CellRange {
    int low[3], high[3];
} CellRange;

// Returns the cells that a face within reach of a point can be asked for in.
static CellRange cells_of(const TouchHalf *half, const TouchFace *face, double reach)
{
    const double center[3] = {face->center.x - half->low.x, face->center.y - half->low.y,
                              face->center.z - half->low.z};
    const double around = face->radius + reach;
    CellRange range;
    for (int c = 0; c < 3; c++) {
        const double last = half->cells[c] - 1, inverse = 1.0 / half->cell;
        const double low = floor((center[c] - around) * inverse),
                     high = floor((center[c] + around) * inverse);
        // An empty range stays empty.
        range.low[c] = (int)fmin(fmax(low, 0.0), last + 1.0);
        range.high[c] = (int)fmax(fmin(high, last), -1.0);
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
        const CellRange r = cells_of(half, &half->face[f], reach);
        for (int k = r.low[2]; k <= r.high[2]; k++)
            for (int j = r.low[1]; j <= r.high[1]; j++)
                for (int i = r.low[0]; i <= r.high[0]; i++, entries++)
                    half->cell_start[cell_number(half, i, j, k) + 1]++;
    }
    half->entries = entries <= half->entry_capacity ? (int)entries : 0;
    return entries <= half->entry_capacity;
}

// Sorts the faces into cells, each face into all from which a point can reach it: a point asks one.
static void fill_cells(TouchHalf *half, double reach)
{
    const int cells = half->cells[0] * half->cells[1] * half->cells[2];
    for (int c = 0; c < cells; c++)
        half->cell_start[c + 1] += half->cell_start[c];
    // Backwards, so that starts become those of the cells and faces ascend.
    for (int f = half->face_count - 1; f >= 0; f--) {
        const CellRange r = cells_of(half, &half->face[f], reach);
        for (int k = r.low[2]; k <= r.high[2]; k++)
            for (int j = r.low[1]; j <= r.high[1]; j++)
                for (int i = r.low[0]; i <= r.high[0]; i++)
                    half->cell_face[--half->cell_start[cell_number(half, i, j, k) + 1]] = f;
    }
}

void touch_grid_build(TouchHalf *half, const Box *box, double reach)
{
    double widest = 0.0;
    half->face_count = 0;
    if (!box_is_empty(box))
        list_faces(half, box);
    if (half->face_count == 0)
        return;
    for (int f = 0; f < half->face_count; f++)
        widest = fmax(widest, half->face[f].radius);
    half->low = box_low(box);
    const Vec3 size = box_size(box);
    const double side[3] = {size.x, size.y, size.z};
    // Larger cells until their number and that of the entries fit: one cell always does.
    for (half->cell = reach + widest;; half->cell *= 2.0) {
        double cells = 1.0;
        for (int c = 0; c < 3; c++) {
            const double along = floor(side[c] / half->cell) + 1.0;
            cells *= along;
            half->cells[c] = (int)fmin(along, 1e6);
        }
        if (cells <= half->cell_capacity && count_cells(half, reach))
            break;
    }
    fill_cells(half, reach);
}

int touch_grid_at(const TouchHalf *half, Vec3 x, const int **near)
{
    if (half->face_count == 0)
        return 0;
    const double at[3] = {x.x - half->low.x, x.y - half->low.y, x.z - half->low.z};
    int cell[3];
    for (int c = 0; c < 3; c++)
        cell[c] = (int)fmin(floor(at[c] / half->cell), half->cells[c] - 1);
    // The start of cell c is kept one place later by fill_cells.
    const int number = cell_number(half, cell[0], cell[1], cell[2]),
              last = half->cells[0] * half->cells[1] * half->cells[2] - 1,
              first = half->cell_start[number + 1],
              end = number < last ? half->cell_start[number + 2] : half->entries;
    *near = &half->cell_face[first];
    return end - first;
}
