// Vertices of elements by what lies around each lattice point. Load time only.
#include "voxel/lattice_mesh.h"

#include "base/check.h"
#include "voxel/lattice_faces.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

static void *sized(size_t count, size_t size)
{
    void *memory = malloc((count + 1) * size);
    ASSERT(memory != NULL);
    return memory;
}

// --- one lattice point ---

// The 12 faces in which the 8 cells around a lattice point (slots, x + 2 y + 4 z) meet: bit 4 d + i
// of a set of faces is the i-th one normal to axis d, between slots POINT_FACE and that + 2^d.
static const unsigned char POINT_FACE[12] = {0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3};

// Which of the leaves around a point hold together there.
typedef struct PointParts {
    signed char part[8]; // [slot] lowest slot of its part; -1: void
    unsigned owns;       // bit s: part s has a vertex
    unsigned outer;      // bit s: part s has a face there that leads to no other solid
} PointParts;

// Makes one part of those of two slots.
static void join(signed char part[8], int a, int b)
{
    signed char low = part[a] < part[b] ? part[a] : part[b];
    signed char high = part[a] < part[b] ? part[b] : part[a];
    for (int s = 0; s < 8; s++)
        if (part[s] == high)
            part[s] = low;
}

// Slots hold leaves (-1: void), `corners` the slots whose leaf has the point as a corner, `broken`
// the faces that do not join. Slots of one leaf hold together whatever is said of the faces between
// them; a part owns a vertex when the point is a corner of one of its leaves.
static PointParts parts_at_point(const int slot[8], unsigned corners, unsigned broken)
{
    PointParts parts = {.owns = 0};
    for (int s = 0; s < 8; s++)
        parts.part[s] = (signed char)(slot[s] < 0 ? -1 : s);
    unsigned open = 0; // slots with a face that leads nowhere
    for (int f = 0; f < 12; f++) {
        int low = POINT_FACE[f], high = low + (1 << f / 4);
        if (slot[low] >= 0 && slot[high] >= 0 && (slot[low] == slot[high] || !(broken >> f & 1)))
            join(parts.part, low, high);
        else
            open |= 1u << low | 1u << high;
    }
    for (int s = 0; s < 8; s++)
        if (parts.part[s] >= 0) {
            parts.owns |= (corners >> s & 1) << parts.part[s];
            parts.outer |= (open >> s & 1) << parts.part[s];
        }
    return parts;
}

// --- the sweep over all points ---

// Vertices are found in the order of their points and get their final numbers at the end.
typedef struct Sweep {
    const Layout *layout;
    LatticeMesh *mesh;
    int points[3];
    int capacity;
    bool *outer; // [found vertex]
    int *parent; // [element] towards the lowest element that holds together with it
} Sweep;

static int piece_root(int *parent, int element)
{
    while (parent[element] != element) {
        parent[element] = parent[parent[element]];
        element = parent[element];
    }
    return element;
}

static void join_pieces(int *parent, int a, int b)
{
    a = piece_root(parent, a);
    b = piece_root(parent, b);
    parent[a > b ? a : b] = a < b ? a : b;
}

static void reserve(Sweep *sweep)
{
    LatticeMesh *mesh = sweep->mesh;
    if (mesh->vertex_count < sweep->capacity)
        return;
    sweep->capacity = 2 * sweep->capacity + 64;
    size_t count = (size_t)sweep->capacity;
    mesh->point = realloc(mesh->point, count * sizeof *mesh->point);
    mesh->id = realloc(mesh->id, count * sizeof *mesh->id);
    sweep->outer = realloc(sweep->outer, count * sizeof *sweep->outer);
    ASSERT(mesh->point != NULL && mesh->id != NULL && sweep->outer != NULL);
}

static int add_vertex(Sweep *sweep, const int point[3], int further_slot, bool outer)
{
    reserve(sweep);
    LatticeMesh *mesh = sweep->mesh;
    int v = mesh->vertex_count++, points = sweep->points[0] * sweep->points[1] * sweep->points[2];
    memcpy(mesh->point[v], point, sizeof mesh->point[v]);
    mesh->id[v] = (point[2] * sweep->points[1] + point[1]) * sweep->points[0] + point[0] +
                  points * further_slot;
    sweep->outer[v] = outer;
    return v;
}

// Where a point lies on a leaf that touches it.
static int node_of_point(const Leaf *leaf, const int point[3])
{
    int offset[3];
    for (int d = 0; d < 3; d++) {
        int twice = 2 * (point[d] - leaf->cell[d]);
        offset[d] = twice >> leaf->level;
        ASSERT(offset[d] << leaf->level == twice);
    }
    return node_at_offset(offset[0], offset[1], offset[2]);
}

static void visit_point(Sweep *sweep, const int point[3], const int slot[8])
{
    unsigned corners = 0;
    int all = point[0] | point[1] | point[2];
    for (int s = 0; s < 8; s++)
        if (slot[s] >= 0 && (all & ((1 << sweep->layout->leaf[slot[s]].level) - 1)) == 0)
            corners |= 1u << s;
    PointParts parts = parts_at_point(slot, corners, 0);

    int vertex[8];
    bool first = true;
    for (int s = 0; s < 8; s++) {
        if (!(parts.owns >> s & 1))
            continue;
        vertex[s] = add_vertex(sweep, point, first ? 0 : s, parts.outer >> s & 1);
        first = false;
    }
    for (int s = 0; s < 8; s++) {
        int part = parts.part[s];
        if (part < 0)
            continue;
        join_pieces(sweep->parent, slot[s], slot[part]);
        if (parts.owns >> part & 1)
            sweep->mesh->vertex[slot[s]][node_of_point(&sweep->layout->leaf[slot[s]], point)] =
                vertex[part];
    }
}

static bool same_leaf(const int slot[8])
{
    for (int s = 1; s < 8; s++)
        if (slot[s] != slot[0])
            return false;
    return true;
}

static void visit_row(Sweep *sweep, int y, int z)
{
    int slot[8];
    for (int s = 0; s < 8; s++)
        slot[s] = -1;
    for (int x = 0; x < sweep->points[0]; x++) {
        for (int s = 0; s < 8; s += 2) {
            slot[s] = slot[s + 1];
            slot[s + 1] = layout_leaf_at(sweep->layout, x, y - 1 + (s >> 1 & 1), z - 1 + (s >> 2));
        }
        if (!same_leaf(slot))
            visit_point(sweep, (int[3]){x, y, z}, slot);
    }
}

// --- final numbers ---

// Those on the outer faces first, otherwise in the order found.
static void number_vertices(Sweep *sweep)
{
    LatticeMesh *mesh = sweep->mesh;
    size_t count = (size_t)mesh->vertex_count;
    int *number = sized(count, sizeof *number);
    int next = 0;
    for (int outer = 1; outer >= 0; outer--) {
        for (int v = 0; v < mesh->vertex_count; v++)
            if (sweep->outer[v] == outer)
                number[v] = next++;
        if (outer)
            mesh->surface_count = next;
    }
    int(*point)[3] = sized(count, sizeof *point);
    int *id = sized(count, sizeof *id);
    for (int v = 0; v < mesh->vertex_count; v++) {
        memcpy(point[number[v]], mesh->point[v], sizeof point[0]);
        id[number[v]] = mesh->id[v];
    }
    free(mesh->point);
    free(mesh->id);
    mesh->point = point;
    mesh->id = id;
    for (int e = 0; e < mesh->element_count; e++)
        for (int n = 0; n < NODE_COUNT; n++)
            if (mesh->vertex[e][n] >= 0)
                mesh->vertex[e][n] = number[mesh->vertex[e][n]];
    free(number);
}

static void number_pieces(Sweep *sweep)
{
    LatticeMesh *mesh = sweep->mesh;
    int *number = sized((size_t)mesh->element_count, sizeof *number); // [element]
    mesh->piece = sized((size_t)mesh->vertex_count, sizeof *mesh->piece);
    for (int e = 0; e < mesh->element_count; e++) {
        int root = piece_root(sweep->parent, e);
        number[e] = root == e ? mesh->piece_count++ : number[root];
        for (int n = 0; n < NODE_COUNT; n++)
            if (mesh->vertex[e][n] >= 0)
                mesh->piece[mesh->vertex[e][n]] = number[e];
    }
    free(number);
}

bool lattice_mesh_create(LatticeMesh *mesh, const Layout *layout, Status *status)
{
    *mesh = (LatticeMesh){.element_count = layout->leaf_count};
    Sweep sweep = {.layout = layout, .mesh = mesh};
    double ids = 8.0;
    for (int d = 0; d < 3; d++) {
        sweep.points[d] = layout->lattice_count[d] + 1;
        ids *= sweep.points[d];
    }
    if (ids > INT_MAX)
        return status_fail(status, STATUS_INVALID, "%d x %d x %d cells are more than %d points",
                           layout->lattice_count[0], layout->lattice_count[1],
                           layout->lattice_count[2], INT_MAX / 8);

    size_t elements = (size_t)mesh->element_count;
    mesh->vertex = sized(elements, sizeof *mesh->vertex);
    memset(mesh->vertex, -1, elements * sizeof *mesh->vertex);
    sweep.parent = sized(elements, sizeof *sweep.parent);
    for (int e = 0; e < mesh->element_count; e++)
        sweep.parent[e] = e;
    reserve(&sweep);
    for (int z = 0; z < sweep.points[2]; z++)
        for (int y = 0; y < sweep.points[1]; y++)
            visit_row(&sweep, y, z);

    number_vertices(&sweep);
    number_pieces(&sweep);
    free(sweep.outer);
    free(sweep.parent);
    lattice_faces_create(mesh, layout);
    return true;
}

void lattice_mesh_destroy(LatticeMesh *mesh)
{
    free(mesh->vertex);
    free(mesh->point);
    free(mesh->id);
    free(mesh->piece);
    free(mesh->face);
    free(mesh->face_neighbor);
    free(mesh->face_element);
    *mesh = (LatticeMesh){0};
}

unsigned lattice_mesh_mask(const LatticeMesh *mesh, int element)
{
    unsigned mask = 0;
    for (int n = NODE_CORNERS; n < NODE_COUNT; n++)
        mask |= (unsigned)(mesh->vertex[element][n] >= 0) << (n - NODE_CORNERS);
    return mask;
}
