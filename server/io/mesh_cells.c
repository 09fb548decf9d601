// SPDX-License-Identifier: MIT
// Cells as VTK, Gmsh and TetGen have them: flat ones become faces of the draft, solid ones give the
// faces that belong to one of them. Load time only.
#include "io/mesh_formats.h"

#include "base/check.h"
#include "geometry/mesh.h"

#include <stdlib.h>
#include <string.h>

// Faces with their corners in the order that turns them outward, and -1 behind the last; a triangle
// has itself as a face. Wedges are turned as Gmsh has them: the repair turns all to one side.
typedef struct Shape {
    const char *name;
    int corners, faces;
    signed char face[6][5];
} Shape;

static const Shape SHAPES[CELL_SHAPES] = {
    [CELL_TRIANGLE] = {"triangle", 3, 1, {{0, 1, 2, -1}}},
    [CELL_QUAD] = {"quad", 4, 1, {{0, 1, 2, 3, -1}}},
    [CELL_PIXEL] = {"pixel", 4, 1, {{0, 1, 3, 2, -1}}},
    [CELL_TETRAHEDRON] = {"tetrahedron",
                          4,
                          4,
                          {{0, 2, 1, -1}, {0, 1, 3, -1}, {1, 2, 3, -1}, {2, 0, 3, -1}}},
    [CELL_VOXEL] = {"voxel",
                    8,
                    6,
                    {{0, 2, 3, 1, -1},
                     {4, 5, 7, 6, -1},
                     {0, 1, 5, 4, -1},
                     {1, 3, 7, 5, -1},
                     {3, 2, 6, 7, -1},
                     {2, 0, 4, 6, -1}}},
    [CELL_HEXAHEDRON] = {"hexahedron",
                         8,
                         6,
                         {{0, 3, 2, 1, -1},
                          {4, 5, 6, 7, -1},
                          {0, 1, 5, 4, -1},
                          {1, 2, 6, 5, -1},
                          {2, 3, 7, 6, -1},
                          {3, 0, 4, 7, -1}}},
    [CELL_WEDGE] =
        {"wedge",
         6,
         5,
         {{0, 2, 1, -1}, {3, 4, 5, -1}, {0, 1, 4, 3, -1}, {1, 2, 5, 4, -1}, {2, 0, 3, 5, -1}}},
    [CELL_PYRAMID] =
        {"pyramid",
         5,
         5,
         {{0, 3, 2, 1, -1}, {0, 1, 4, -1}, {1, 2, 4, -1}, {2, 3, 4, -1}, {3, 0, 4, -1}}},
};

// --- tags ---

typedef struct NodeTag {
    int64_t tag;
    int node;
} NodeTag;

void cells_tag_node(MeshCells *cells, double tag)
{
    cells->draft->full |= cells->tag_count == MESH_COUNT_MAX;
    if (cells->draft->full)
        return;
    if (cells->tag_count == cells->tag_capacity) {
        cells->tag_capacity = cells->tag_capacity == 0 ? 1024 : 2 * cells->tag_capacity;
        cells->tag = realloc(cells->tag, (size_t)cells->tag_capacity * sizeof *cells->tag);
        ASSERT(cells->tag != NULL);
    }
    cells->tag[cells->tag_count] = (NodeTag){(int64_t)tag, cells->tag_count};
    cells->tag_count++;
    cells->tags_sorted = false;
}

// Of equal tags the first node comes first.
static int compare_tags(const void *a, const void *b)
{
    const NodeTag *x = a, *y = b;
    return x->tag != y->tag ? (x->tag < y->tag ? -1 : 1)
                            : (x->node > y->node) - (x->node < y->node);
}

int cells_find_node(MeshCells *cells, double tag)
{
    if (cells->tag_count == 0)
        return -1;
    if (!cells->tags_sorted)
        qsort(cells->tag, (size_t)cells->tag_count, sizeof *cells->tag, compare_tags);
    cells->tags_sorted = true;
    // Most files count without gaps.
    const int64_t wanted = (int64_t)tag, place = wanted - cells->tag[0].tag;
    if (place >= 0 && place < cells->tag_count && cells->tag[place].tag == wanted)
        return cells->tag[place].node;
    int low = 0, high = cells->tag_count;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (cells->tag[middle].tag < wanted)
            low = middle + 1;
        else
            high = middle;
    }
    return low < cells->tag_count && cells->tag[low].tag == wanted ? cells->tag[low].node : -1;
}

// --- cells ---

void cells_corner(MeshCells *cells, int node)
{
    if (cells->count == cells->capacity) {
        cells->capacity = cells->capacity == 0 ? 64 : 2 * cells->capacity;
        cells->corner = realloc(cells->corner, (size_t)cells->capacity * sizeof *cells->corner);
        ASSERT(cells->corner != NULL);
    }
    cells->corner[cells->count++] = node;
}

// Adds the triangles of a strip, of which every second one runs the other way.
static void end_strip(MeshCells *cells, int line)
{
    for (int k = 2; k < cells->count; k++) {
        const int *c = &cells->corner[k - 2];
        for (int i = 0; i < 3; i++)
            mesh_draft_add_corner(cells->draft, i == 2 ? c[2] : c[(i + k) % 2], -1);
        mesh_draft_end_polygon(cells->draft, line);
    }
}

static void end_polygon(MeshCells *cells, int line)
{
    for (int k = 0; k < cells->count; k++)
        mesh_draft_add_corner(cells->draft, cells->corner[k], -1);
    mesh_draft_end_polygon(cells->draft, line);
}

bool cells_end_cell(MeshCells *cells, CellKind kind, int line)
{
    const Shape *shape = &SHAPES[kind.shape];
    if (kind.shape == CELL_POLYGON)
        end_polygon(cells, line);
    if (kind.shape == CELL_STRIP)
        end_strip(cells, line);
    const bool whole = cells->count >= shape->corners;
    MeshDraft *to = shape->faces > 1 ? &cells->faces : cells->draft;
    for (int f = 0; whole && f < shape->faces; f++) {
        for (const signed char *k = shape->face[f]; *k >= 0; k++)
            mesh_draft_add_corner(to, cells->corner[(int)*k], -1);
        mesh_draft_end_polygon(to, line);
    }
    cells->solid += shape->faces > 1;
    cells->curved += kind.curved && shape->faces > 0;
    cells->unknown += kind.shape == CELL_UNKNOWN;
    cells->count = 0;
    cells->draft->full |= cells->faces.full;
    return whole;
}

// --- the border ---

// A face by its nodes in rising order, those at one place being one.
typedef struct SortedFace {
    int node[4], index;
} SortedFace;

static int compare_faces(const void *a, const void *b)
{
    const SortedFace *x = a, *y = b;
    for (int k = 0; k < 4; k++)
        if (x->node[k] != y->node[k])
            return x->node[k] < y->node[k] ? -1 : 1;
    return 0;
}

static SortedFace sort_nodes(const MeshDraft *faces, int f, const int *equal)
{
    SortedFace sorted = {{-1, -1, -1, -1}, f};
    int count = 0;
    for (int c = mesh_draft_start(faces, f); c < faces->end[f]; c++) {
        int k = count++;
        for (; k > 0 && sorted.node[k - 1] > equal[faces->corner[c]]; k--)
            sorted.node[k] = sorted.node[k - 1];
        sorted.node[k] = equal[faces->corner[c]];
    }
    return sorted;
}

// Marks the faces that belong to one cell. Cells of some solvers have nodes of their own each, so
// nodes at one place count as one.
static void find_border(const MeshCells *cells, bool *border)
{
    const MeshDraft *draft = cells->draft, *faces = &cells->faces;
    const int count = faces->polygon_count;
    int *equal = malloc((size_t)draft->node_count * sizeof *equal);
    SortedFace *sorted = malloc((size_t)count * sizeof *sorted);
    ASSERT(equal != NULL && sorted != NULL);
    mesh_find_equal(draft->position, draft->node_count, equal);
    for (int f = 0; f < count; f++)
        sorted[f] = sort_nodes(faces, f, equal);
    qsort(sorted, (size_t)count, sizeof *sorted, compare_faces);
    for (int i = 0; i < count; i++)
        border[sorted[i].index] =
            (i == 0 || compare_faces(&sorted[i - 1], &sorted[i]) != 0) &&
            (i + 1 == count || compare_faces(&sorted[i], &sorted[i + 1]) != 0);
    free(equal);
    free(sorted);
}

// Replaces the faces of the draft by the border of the solid cells, in the order of the file.
static void take_border(MeshCells *cells)
{
    MeshDraft *draft = cells->draft;
    const MeshDraft *faces = &cells->faces;
    bool *border = calloc((size_t)faces->polygon_count, sizeof *border);
    ASSERT(border != NULL);
    find_border(cells, border);
    cells->beside = draft->polygon_count;
    draft->polygon_count = draft->corner_count = 0;
    for (int f = 0; f < faces->polygon_count; f++) {
        for (int c = mesh_draft_start(faces, f); border[f] && c < faces->end[f]; c++)
            mesh_draft_add_corner(draft, faces->corner[c], -1);
        if (border[f])
            mesh_draft_end_polygon(draft, faces->line[f]);
    }
    free(border);
}

bool cells_finish(MeshCells *cells, const char *path, Status *status)
{
    const MeshDraft *draft = cells->draft, *faces = &cells->faces;
    if (draft->full)
        return false;
    if (cells->unknown > 0)
        return status_fail(status, STATUS_INVALID,
                           "%s: %d cells are of a kind that is not read, as polyhedra are; "
                           "in ParaView Extract Surface makes faces of them",
                           path, cells->unknown);
    if (faces->polygon_count + draft->polygon_count == 0)
        return status_fail(status, STATUS_INVALID,
                           "%s: no faces and no solid cells, of which a mesh is made", path);
    for (int c = 0; c < faces->corner_count; c++)
        if (faces->corner[c] < 0 || faces->corner[c] >= draft->node_count)
            return status_fail(status, STATUS_INVALID, "%s: a cell names point %d of %d", path,
                               faces->corner[c], draft->node_count);
    if (cells->solid > 0)
        take_border(cells);
    return true;
}

void cells_destroy(MeshCells *cells)
{
    mesh_draft_destroy(&cells->faces);
    free(cells->corner);
    free(cells->tag);
}

// --- binary numbers ---

double number_decode(const char *at, NumberType type, bool big)
{
    uint64_t bits = 0;
    for (int i = 0; i < type.size; i++)
        bits = bits << 8 | (unsigned char)at[big ? i : type.size - 1 - i];
    const uint32_t low = (uint32_t)bits;
    float single;
    double number;
    memcpy(&single, &low, sizeof single);
    memcpy(&number, &bits, sizeof number);
    if (type.real)
        return type.size == 4 ? (double)single : number;
    const int unused = 64 - 8 * type.size;
    return type.sign ? (double)((int64_t)(bits << unused) >> unused) : (double)bits;
}
