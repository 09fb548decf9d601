// SPDX-License-Identifier: MIT
#include "plane/mesh.h"

#include "base/check.h"
#include "base/sets.h"

#include <limits.h>
#include <stdlib.h>

// ---------------------------------------------------------------------------------------------
// One lattice point

static bool is_broken(const PlaneLayout *layout, const unsigned char *broken, int i, int j, int bit)
{
    bool inside = i >= 0 && j >= 0 && i < layout->count[0] && j < layout->count[1];
    return broken != NULL && inside &&
           broken[(size_t)j * (size_t)layout->count[0] + (size_t)i] & bit;
}

static void join(PlanePoint *point, int a, int b)
{
    int from = point->component[a], to = point->component[b];
    if (point->element[a] < 0 || point->element[b] < 0 || from == to)
        return;
    int low = from < to ? from : to;
    for (int s = 0; s < 4; s++)
        if (point->component[s] == from || point->component[s] == to)
            point->component[s] = low;
}

void plane_point(const PlaneLayout *layout, const unsigned char *broken, int i, int j,
                 PlanePoint *point)
{
    // Each slot is a component of its own at first.
    for (int s = 0; s < 4; s++) {
        point->element[s] = plane_layout_at(layout, i - 1 + (s & 1), j - 1 + (s >> 1));
        point->component[s] = point->element[s] < 0 ? -1 : s;
        point->vertex[s] = false;
    }
    // Slots of one element are connected, and slots whose common edge is not broken.
    for (int a = 0; a < 4; a++)
        for (int b = a + 1; b < 4; b++)
            if (point->element[a] == point->element[b])
                join(point, a, b);
    for (int k = 0; k < 2; k++) {
        if (!is_broken(layout, broken, i - 1, j - 1 + k, PLANE_BROKEN_RIGHT))
            join(point, 2 * k, 2 * k + 1);
        if (!is_broken(layout, broken, i - 1 + k, j - 1, PLANE_BROKEN_UP))
            join(point, k, k + 2);
    }
    // With one or three cells around a point the element's outline turns there.
    for (int s = 0; s < 4; s++) {
        int cells = 0;
        for (int other = 0; other < 4; other++)
            cells += point->element[other] == point->element[s];
        if (point->element[s] >= 0 && (cells == 1 || cells == 3))
            point->vertex[point->component[s]] = true;
    }
}

// True if not all solid cells around a point are still connected there.
static bool is_released(const PlaneLayout *layout, const unsigned char *broken, int i, int j)
{
    PlanePoint point;
    plane_point(layout, broken, i, j, &point);
    int first = -1;
    for (int s = 0; s < 4; s++) {
        if (point.component[s] < 0)
            continue;
        // Two components around one point: the point joins them no longer.
        if (first >= 0 && point.component[s] != first)
            return true;
        first = point.component[s];
    }
    return false;
}

bool plane_must_carve(const PlaneLayout *layout, const unsigned char *broken, int element,
                      int quarter)
{
    const PlaneElement *own = &layout->element[element];
    if (own->level == 0)
        return false;
    const int half = 1 << (own->level - 1), x = quarter & 1, y = quarter >> 1;
    const int i = own->cell[0] + x * half, j = own->cell[1] + y * half;
    if (own->level == 1) // the corner of the square, and its two neighbours on the edges
        return is_released(layout, broken, i + x, j + y) ||
               is_released(layout, broken, i + 1 - x, j + y) ||
               is_released(layout, broken, i + x, j + 1 - y);
    // Larger squares: whether what is beside them has become too small.
    const int beside[2] = {x ? i + half : i - 1, y ? j + half : j - 1};
    for (int k = 0; k < 2; k++) {
        int along = k == 0 ? 0 : half / 2;
        int right = plane_layout_at(layout, beside[0], j + along);
        int above = plane_layout_at(layout, i + along, beside[1]);
        if ((right >= 0 && layout->element[right].level == own->level - 2) ||
            (above >= 0 && layout->element[above].level == own->level - 2))
            return true;
    }
    return false;
}

// ---------------------------------------------------------------------------------------------
// Vertices

// Returns the place of a lattice point in an element; -1: none.
static int place_of(const PlaneElement *element, int i, int j)
{
    int size = 1 << element->level, x = 2 * (i - element->cell[0]), y = 2 * (j - element->cell[1]);
    return x % size != 0 || y % size != 0 ? -1 : x / size + 3 * (y / size);
}

// Gives the vertices at a point to the elements around it.
static void place_point(PlaneMesh *mesh, const PlaneLayout *layout, const unsigned char *broken,
                        int i, int j)
{
    PlanePoint point;
    plane_point(layout, broken, i, j, &point);
    const int points = (layout->lattice_count[0] + 1) * (layout->lattice_count[1] + 1);
    bool first = true;
    for (int c = 0; c < 4; c++) {
        if (point.component[c] != c)
            continue;
        // The lowest component keeps the number of the point.
        const int id = i + (layout->lattice_count[0] + 1) * j + (first ? 0 : points * c);
        first = false;
        if (!point.vertex[c])
            continue;
        // A vertex where an element has a corner.
        int vertex = mesh->vertex_count++;
        mesh->point[vertex][0] = i;
        mesh->point[vertex][1] = j;
        mesh->id[vertex] = id;
        // All elements of the component share it.
        for (int s = 0; s < 4; s++) {
            if (point.component[s] != c)
                continue;
            const PlaneElement *element = &layout->element[point.element[s]];
            int place = place_of(element, i, j);
            ASSERT(place >= 0); // levels differ by at most one along edges
            mesh->vertex[point.element[s]][place] = vertex;
        }
    }
}

static void place_all(PlaneMesh *mesh, const PlaneLayout *layout, const unsigned char *broken)
{
    mesh->vertex_count = 0;
    for (int j = 0; j <= layout->lattice_count[1]; j++)
        for (int i = 0; i <= layout->lattice_count[0]; i++)
            place_point(mesh, layout, broken, i, j);
}

// ---------------------------------------------------------------------------------------------
// Triangles: ears are cut off each element's outline

typedef struct Outline {
    int count;
    int place[PLANE_PLACES];
} Outline;

static int turn(int a, int b, int c)
{
    return (b % 3 - a % 3) * (c / 3 - a / 3) - (b / 3 - a / 3) * (c % 3 - a % 3);
}

// True if corner k can be cut off: convex, and no other vertex is in or on its triangle, so that
// none remains on a straight line.
static bool is_ear(const Outline *outline, int k)
{
    const int n = outline->count;
    int a = outline->place[(k + n - 1) % n], b = outline->place[k], c = outline->place[(k + 1) % n];
    // It must be convex, and no other corner inside.
    if (turn(a, b, c) <= 0)
        return false;
    for (int i = 0; i < n; i++) {
        int p = outline->place[i];
        if (p != a && p != b && p != c && turn(a, b, p) >= 0 && turn(b, c, p) >= 0 &&
            turn(c, a, p) >= 0)
            return false;
    }
    return true;
}

static void cut_ears(PlaneMesh *mesh, int element, Outline *outline)
{
    while (outline->count >= 3) {
        int k = 0, n = outline->count;
        // Every outline has an ear; it becomes a triangle.
        while (k < n && !is_ear(outline, k))
            k++;
        ASSERT(k < n);
        const int corner[3] = {outline->place[(k + n - 1) % n], outline->place[k],
                               outline->place[(k + 1) % n]};
        for (int c = 0; c < 3; c++)
            mesh->triangle[mesh->triangle_count][c] = mesh->vertex[element][corner[c]];
        mesh->triangle_count++;
        outline->count--;
        for (; k < outline->count; k++)
            outline->place[k] = outline->place[k + 1];
    }
}

// A directed edge of an element's outline, in the list of the lower of its ends.
typedef struct PlaneSide {
    int high;
    bool forward; // from low to high
    bool inner;   // another element has it in the opposite direction
    int next;     // in the list, by ascending high; -1: end
} PlaneSide;

static void add_side(const PlaneRoom *room, int index, int from, int to)
{
    const int low = from < to ? from : to, high = from < to ? to : from;
    PlaneSide *side = room->side;
    int *link = &room->first_side[low];
    // Sides are listed by their lower vertex, ascending by the other.
    while (*link >= 0 && side[*link].high < high)
        link = &side[*link].next;
    // Two elements have it, in opposite directions: it is inside.
    if (*link >= 0 && side[*link].high == high) {
        ASSERT(side[*link].forward != (from < to) && !side[*link].inner);
        side[*link].inner = true;
        return;
    }
    side[index] = (PlaneSide){.high = high, .forward = from < to, .next = *link};
    *link = index;
}

// Sides without an opposite one form the body's outline.
static void list_outline(PlaneMesh *mesh, const PlaneRoom *room)
{
    for (int low = 0; low < mesh->vertex_count; low++)
        for (int s = room->first_side[low]; s >= 0; s = room->side[s].next) {
            if (room->side[s].inner)
                continue;
            int *edge = mesh->edge[mesh->edge_count++];
            edge[0] = room->side[s].forward ? low : room->side[s].high;
            edge[1] = room->side[s].forward ? room->side[s].high : low;
        }
}

static void make_faces(PlaneMesh *mesh, const PlaneRoom *room, const PlaneLayout *layout)
{
    mesh->triangle_count = mesh->edge_count = 0;
    for (int v = 0; v < mesh->vertex_count; v++)
        room->first_side[v] = -1;
    int sides = 0;
    for (int e = 0; e < mesh->element_count; e++) {
        if (layout->element[e].quarters == 0)
            continue;
        // The corners and hanging vertices of the element, in order.
        Outline outline = {0};
        int place[PLANE_PLACES], count = plane_outline(layout->element[e].quarters, place);
        for (int k = 0; k < count; k++)
            if (mesh->vertex[e][place[k]] >= 0)
                outline.place[outline.count++] = place[k];
        // Sides that no other element has are the body's outline.
        for (int k = 0; k < outline.count; k++)
            add_side(room, sides++, mesh->vertex[e][outline.place[k]],
                     mesh->vertex[e][outline.place[(k + 1) % outline.count]]);
        cut_ears(mesh, e, &outline);
    }
    list_outline(mesh, room);
}

// ---------------------------------------------------------------------------------------------
// Pieces

static void number_pieces(PlaneMesh *mesh)
{
    union_find_reset(mesh->piece, mesh->vertex_count);
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int c = 1; c < 3; c++)
            union_find_join(mesh->piece, mesh->triangle[t][0], mesh->triangle[t][c]);
    union_find_number(mesh->piece, mesh->vertex_count);
}

static void *take(Arena *arena, const char *name, const char *label, size_t count, size_t size)
{
    if (arena != NULL)
        return arena_allocate(arena, ARENA_TOPOLOGY, count, size, "%s/%s", name, label);
    void *memory = calloc(count + 1, size);
    ASSERT(memory != NULL);
    return memory;
}

// Computes upper bounds. Elements do not overlap, and each covers at least one solid cell. A vertex
// is a component of the cells around a point: at most one for each of their corners.
static void most_of(PlaneRoom *room, const PlaneLayout *layout)
{
    int cells = 0;
    long points = (layout->lattice_count[0] + 1L) * (layout->lattice_count[1] + 1L);
    // The cells that elements cover.
    for (int e = 0; e < layout->element_count; e++) {
        const PlaneElement *element = &layout->element[e];
        for (int q = 0; q < 4; q++)
            if (element->quarters >> q & 1)
                cells += element->level == 0 ? (q == 0) : 1 << 2 * (element->level - 1);
    }
    *room = (PlaneRoom){.elements = layout->element_count,
                        .vertices = 4 * (int)(points < cells ? points : cells),
                        .sides = 8 * cells};
}

void plane_mesh_reserve(PlaneMesh *mesh, PlaneRoom *room, const PlaneLayout *layout,
                        const char *name, Arena *arena)
{
    most_of(room, layout);
    const size_t vertices = (size_t)room->vertices, sides = (size_t)room->sides;
    *mesh = (PlaneMesh){.element_count = layout->element_count};
    mesh->vertex =
        take(arena, name, "vertices of elements", (size_t)room->elements, sizeof *mesh->vertex);
    mesh->point = take(arena, name, "points of vertices", vertices, sizeof *mesh->point);
    mesh->id = take(arena, name, "ids of vertices", vertices, sizeof *mesh->id);
    mesh->piece = take(arena, name, "pieces of vertices", vertices, sizeof *mesh->piece);
    mesh->triangle = take(arena, name, "triangles of elements", sides, sizeof *mesh->triangle);
    mesh->edge = take(arena, name, "outline", sides, sizeof *mesh->edge);
    room->side = take(arena, name, "sides of elements", sides, sizeof *room->side);
    room->first_side = take(arena, name, "sides of vertices", vertices, sizeof *room->first_side);
}

void plane_mesh_fill(PlaneMesh *mesh, const PlaneRoom *room, const PlaneLayout *layout,
                     const unsigned char *broken)
{
    for (int e = 0; e < mesh->element_count; e++)
        for (int p = 0; p < PLANE_PLACES; p++)
            mesh->vertex[e][p] = -1;
    place_all(mesh, layout, broken);
    make_faces(mesh, room, layout);
    number_pieces(mesh);
}

bool plane_mesh_create(PlaneMesh *mesh, const PlaneLayout *layout, const unsigned char *broken,
                       Status *status)
{
    double points = (layout->lattice_count[0] + 1.0) * (layout->lattice_count[1] + 1.0);
    *mesh = (PlaneMesh){0};
    // An id counts points up to four times.
    if (4.0 * points > INT_MAX)
        return status_fail(status, STATUS_INVALID,
                           "a plane lattice with %.0f points has more than an id can tell", points);
    PlaneRoom room;
    plane_mesh_reserve(mesh, &room, layout, "", NULL);
    plane_mesh_fill(mesh, &room, layout, broken);
    free(room.side);
    free(room.first_side);
    return true;
}

void plane_mesh_destroy(PlaneMesh *mesh)
{
    free(mesh->vertex);
    free(mesh->point);
    free(mesh->id);
    free(mesh->piece);
    free(mesh->triangle);
    free(mesh->edge);
    *mesh = (PlaneMesh){0};
}

unsigned plane_mesh_present(const PlaneMesh *mesh, int element)
{
    unsigned present = 0;
    for (int p = 0; p < PLANE_PLACES; p++)
        present |= mesh->vertex[element][p] >= 0 ? 1u << p : 0u;
    return present;
}
