// SPDX-License-Identifier: MIT
// Squares of a cut body: where they are, their neighbours, and the nodes that have them. Step
// thread.
#include "voxel/cut/cut_faces.h"

#include "base/check.h"
#include "voxel/lattice_faces.h"

#include <math.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// Positions of squares

// Returns the cell that is connected to a cell across a face; -1: none.
static int joined_to(const void *cells, int cell, int direction)
{
    const CutLattice *lattice = cells;
    const int axis = direction / 2;
    if (direction & 1)
        return cut_lattice_is_open(lattice, cell, axis) ? -1
                                                        : cut_lattice_beyond(lattice, cell, axis);
    const int *at = lattice->element[cell].cell;
    const int below =
        cut_lattice_cell(lattice, at[0] - (axis == 0), at[1] - (axis == 1), at[2] - (axis == 2));
    return below < 0 || cut_lattice_is_open(lattice, below, axis) ? -1 : below;
}

bool cut_faces_is_shown(const CutLattice *lattice, int cell, int direction)
{
    return cut_lattice_is_leaf(lattice, cell) && joined_to(lattice, cell, direction) < 0;
}

void cut_faces_join_square(CutFaces *faces, int square)
{
    const int code = faces->square[square];
    for (int k = 0; k < 4; k++) {
        const SquareEdge to =
            square_across(joined_to, faces->lattice, (SquareEdge){code / 6, code % 6, k});
        const int other = faces->square_of[to.cell][to.direction];
        if (other < 0)
            continue; // only in an impossible state
        const int here = square_triangle(square, k), there = square_triangle(other, to.k);
        faces->neighbor[here][square_edge(k)] = there;
        faces->neighbor[there][square_edge(to.k)] = here;
    }
}

// ---------------------------------------------------------------------------------------------
// Corners

void cut_faces_touch(CutFaces *faces, int vertex)
{
    if (faces->is_touched[vertex])
        return;
    faces->is_touched[vertex] = 1;
    faces->touched[faces->touched_count++] = vertex;
}

// Inserts a face into a node's list, which stays ascending.
static void add_to_node(CutFaces *faces, int vertex, int face)
{
    const int start = faces->start[vertex];
    int at = faces->end[vertex];
    ASSERT(at - start < CUT_NODE_FACES);
    for (; at > start && faces->list[at - 1] > face; at--)
        faces->list[at] = faces->list[at - 1];
    faces->list[at] = face;
    faces->end[vertex]++;
}

static void take_from_node(CutFaces *faces, int vertex, int face)
{
    int at = faces->start[vertex];
    while (faces->list[at] != face)
        at++;
    for (faces->end[vertex]--; at < faces->end[vertex]; at++)
        faces->list[at] = faces->list[at + 1];
}

void cut_faces_add_slot(CutFaces *faces, int vertex)
{
    if (faces->slot_of[vertex] >= 0)
        return;
    const int slot = (int)(*faces->slot_count)++;
    faces->slot_vertex[slot] = vertex;
    cut_faces_describe_slot(faces, slot);
}

void cut_faces_describe_slot(CutFaces *faces, int slot)
{
    const int vertex = faces->slot_vertex[slot], from = faces->copied_from[vertex];
    const int id = faces->lattice->vertex_id[vertex];
    faces->slot_of[vertex] = slot;
    faces->id[slot] = faces->parent[slot][0] = faces->parent[slot][1] = id;
    faces->origin[slot] = from < 0 ? id : faces->lattice->vertex_id[from];
    faces->piece[slot] = cut_pieces_of(faces->pieces, faces->cell_of[vertex]);
}

static void set_corner(CutFaces *faces, int face, int corner, int vertex)
{
    faces->face[face][corner] = vertex;
    add_to_node(faces, vertex, face);
    cut_faces_touch(faces, vertex);
    cut_faces_add_slot(faces, vertex);
    faces->triangle[face][corner] = faces->slot_of[vertex];
}

// Returns the vertex of a corner of a triangle: of the square's corners 0 1 2 and 0 2 3.
static int corner_vertex(const CutFaces *faces, int face, int corner)
{
    const int code = faces->square[face / 2];
    const int k = corner == 0 ? 0 : corner + face % 2;
    return faces->lattice->corner[code / 6][SQUARE_CORNER[code % 6][k]];
}

void cut_faces_enter_square(CutFaces *faces, int square)
{
    const int code = faces->square[square];
    faces->square_of[code / 6][code % 6] = square;
    for (int face = 2 * square; face < 2 * square + 2; face++)
        for (int c = 0; c < 3; c++)
            set_corner(faces, face, c, corner_vertex(faces, face, c));
    faces->neighbor[2 * square][NEAR_DIAGONAL] = 2 * square + 1;
    faces->neighbor[2 * square + 1][FAR_DIAGONAL] = 2 * square;
}

static bool follow_corners(CutFaces *faces, int square)
{
    bool changed = false;
    for (int face = 2 * square; face < 2 * square + 2; face++)
        for (int c = 0; c < 3; c++) {
            const int before = faces->face[face][c], now = corner_vertex(faces, face, c);
            if (before == now)
                continue;
            // The corner has got a vertex of its own.
            take_from_node(faces, before, face);
            cut_faces_touch(faces, before);
            set_corner(faces, face, c, now);
            changed = true;
        }
    return changed;
}

// ---------------------------------------------------------------------------------------------
// Areas and firmness

static double mass_per_area(const CutFaces *faces, int vertex)
{
    return faces->vertices->mass[vertex] / (3.0 * faces->node_area[vertex]);
}

// Sets the firmness as contact_set_stiffness does, but relative to a constant mass per area, so
// that unchanged nodes keep their firmness.
static void set_node_firmness(CutFaces *faces, int vertex)
{
    double firmness = 1.0;
    if (faces->node_area[vertex] > 0.0) {
        firmness = mass_per_area(faces, vertex) / faces->least_firm;
        if (vertices_is_fixed(faces->vertices, vertex))
            firmness = fmax(1.0, firmness);
    }
    faces->node_firmness[vertex] = firmness;
}

static void set_face_firmness(CutFaces *faces, int face)
{
    double of_free = (double)INFINITY, of_all = (double)INFINITY;
    for (int c = 0; c < 3; c++) {
        const int vertex = faces->face[face][c];
        of_all = fmin(of_all, faces->node_firmness[vertex]);
        if (!vertices_is_fixed(faces->vertices, vertex))
            of_free = fmin(of_free, faces->node_firmness[vertex]);
    }
    faces->face_firmness[face] = of_free < (double)INFINITY ? of_free : of_all;
}

// Sums one by one, in the order of bodies that are not cut.
static void set_node_area(CutFaces *faces, int vertex)
{
    faces->node_area[vertex] = 0.0;
    for (int k = faces->start[vertex]; k < faces->end[vertex]; k++)
        faces->node_area[vertex] += faces->half / 3.0;
}

void cut_faces_find_least(CutFaces *faces)
{
    bool any_free = false;
    double least = (double)INFINITY;
    for (int i = 0; i < faces->vertex_count; i++)
        any_free |= faces->node_area[i] > 0.0 && !vertices_is_fixed(faces->vertices, i);
    for (int i = 0; i < faces->vertex_count; i++)
        if (faces->node_area[i] > 0.0 && (!any_free || !vertices_is_fixed(faces->vertices, i)))
            least = fmin(least, mass_per_area(faces, i));
    faces->least_firm = least;
}

void cut_faces_settle_touched(CutFaces *faces)
{
    // Nodes first: the firmness of a face is that of its corners.
    for (int t = 0; t < faces->touched_count; t++) {
        const int vertex = faces->touched[t];
        set_node_area(faces, vertex);
        if (faces->node_firmness != NULL && faces->least_firm > 0.0)
            set_node_firmness(faces, vertex);
    }
    for (int t = 0; t < faces->touched_count; t++) {
        const int vertex = faces->touched[t];
        faces->is_touched[vertex] = 0;
        if (faces->face_firmness == NULL || !(faces->least_firm > 0.0))
            continue;
        for (int k = faces->start[vertex]; k < faces->end[vertex]; k++)
            set_face_firmness(faces, faces->list[k]);
    }
    faces->touched_count = 0;
}

// ---------------------------------------------------------------------------------------------
// After changes of the lattice

// Returns the lowest cell of a vertex's part, from its id.
static int cell_of_vertex(const CutLattice *lattice, int vertex)
{
    int point[3], leaf[8];
    cut_lattice_point(lattice, vertex, point);
    const long points = (long)(lattice->lattice_count[0] + 1) * (lattice->lattice_count[1] + 1) *
                        (lattice->lattice_count[2] + 1);
    // The id tells the lowest slot of the part, or that it is the lowest solid one.
    int slot = (int)(lattice->vertex_id[vertex] / points);
    cut_lattice_around(lattice, point, leaf);
    while (slot < 8 && leaf[slot] < 0)
        slot++;
    ASSERT(slot < 8);
    return cut_lattice_cell(lattice, point[0] - 1 + (slot & 1), point[1] - 1 + (slot >> 1 & 1),
                            point[2] - 1 + (slot >> 2));
}

void cut_faces_enter_vertex(CutFaces *faces, int vertex)
{
    faces->cell_of[vertex] = cell_of_vertex(faces->lattice, vertex);
    faces->start[vertex] = faces->end[vertex] = CUT_NODE_FACES * vertex;
    faces->node_area[vertex] = 0.0;
    faces->slot_of[vertex] = -1;
    if (faces->node_firmness != NULL)
        faces->node_firmness[vertex] = 1.0;
}

static void follow_births(CutFaces *faces, TopologyChange *change)
{
    const CutChanges *changes = &faces->lattice->changes;
    for (int b = 0; b < changes->birth_count; b++) {
        const CutBirth *birth = &changes->birth[b];
        const int last = birth->parent[birth->parent_count - 1];
        // Whoever holds a node follows it to its parents.
        faces->born[b] = (NodeBirth){birth->vertex, {birth->parent[0], last}};
        faces->copied_from[birth->vertex] = birth->origin;
        cut_faces_enter_vertex(faces, birth->vertex);
        if (faces->all)
            cut_faces_add_slot(faces, birth->vertex);
    }
    faces->vertex_count = cut_lattice_used(faces->lattice);
    change->born_count = changes->birth_count;
    change->born = faces->born;
}

static void add_square(CutFaces *faces, int cell, int direction)
{
    if (faces->square_of[cell][direction] >= 0)
        return;
    ASSERT(*faces->shown < faces->square_capacity);
    const int square = (int)(*faces->shown)++;
    faces->square[square] = 6 * cell + direction;
    cut_faces_enter_square(faces, square);
}

// Adds new squares in the order in which their faces opened; then updates existing ones whose
// corners were duplicated.
static bool follow_squares(CutFaces *faces)
{
    const CutLattice *lattice = faces->lattice;
    const CutChanges *changes = &lattice->changes;
    const int before = (int)*faces->shown;
    // An open face shows a square on either side.
    for (int f = 0; f < changes->face_count; f++) {
        const int cell = changes->face[f][0], axis = changes->face[f][1];
        if (!cut_lattice_is_open(lattice, cell, axis))
            continue;
        add_square(faces, cell, 2 * axis + 1);
        add_square(faces, cut_lattice_beyond(lattice, cell, axis), 2 * axis);
    }
    bool changed = *faces->shown > before;
    // Corners follow the vertices of changed elements.
    for (int i = 0; i < changes->element_count; i++) {
        const int element = changes->element[i];
        if (element >= faces->cell_count || !cut_lattice_is_leaf(lattice, element))
            continue;
        for (int d = 0; d < 6; d++)
            if (faces->square_of[element][d] >= 0)
                changed |= follow_corners(faces, faces->square_of[element][d]);
    }
    // Neighbours last: all squares exist now.
    for (int square = before; square < *faces->shown; square++)
        cut_faces_join_square(faces, square);
    return changed;
}

// Masses have changed at all vertices of changed elements.
static void touch_masses(CutFaces *faces)
{
    const CutLattice *lattice = faces->lattice;
    const CutChanges *changes = &lattice->changes;
    for (int i = 0; i < changes->element_count && faces->node_firmness != NULL; i++) {
        const int element = changes->element[i];
        if (!cut_lattice_is_leaf(lattice, element))
            continue;
        // Firmness follows the masses of the vertices on the surface.
        const int *node = cut_lattice_nodes(lattice, element);
        const int count = element < faces->cell_count ? NODE_CORNERS : NODE_COUNT;
        for (int n = 0; n < count; n++)
            if (node[n] >= 0 && faces->start[node[n]] < faces->end[node[n]])
                cut_faces_touch(faces, node[n]);
    }
}

void cut_faces_report(const CutFaces *faces, Body *body)
{
    body->surface.node_used = faces->vertex_count;
    body->surface.face_used = 2 * (int)*faces->shown;
    body->mesh.node_count = (int)*faces->slot_count;
    body->mesh.triangle_count = 2 * (int)*faces->shown;
}

bool cut_faces_follow(CutFaces *faces, bool pieces_came, Body *body, TopologyChange *change)
{
    const CutChanges *changes = &faces->lattice->changes;
    *change = (TopologyChange){.again = false};
    follow_births(faces, change);
    for (int f = 0; f < changes->face_count; f++) // the bit of faces listed again is not new
        faces->broken_count +=
            faces->counted[changes->face[f][0]] >> changes->face[f][1] & 1 ? 0 : 1;
    for (int f = 0; f < changes->face_count; f++)
        faces->counted[changes->face[f][0]] |= (unsigned char)(1 << changes->face[f][1]);
    bool changed = follow_squares(faces) || change->born_count > 0;
    touch_masses(faces);
    cut_faces_settle_touched(faces);
    for (int slot = 0; slot < *faces->slot_count && pieces_came; slot++)
        faces->piece[slot] = cut_pieces_of(faces->pieces, faces->cell_of[faces->slot_vertex[slot]]);
    cut_faces_report(faces, body);
    return changed || pieces_came;
}

bool cut_faces_has_room(const CutFaces *faces, int broken, int *needed, int *room)
{
    // Faces that are broken but not open yet get their squares later.
    const long squares = faces->outer_squares + 2 * ((long)faces->broken_count + broken);
    *needed = 4 * broken;
    *room = 2 * (faces->square_capacity - faces->outer_squares) - 4 * (int)faces->broken_count;
    return squares <= faces->square_capacity;
}

int cut_faces_find_nodes(const CutFaces *faces, const Region *region, int *node, int capacity)
{
    const Vertices *vertices = faces->vertices;
    const Region here = rows_region(&vertices->rows, region);
    const RegionTest test = region_test(&here);
    int found = 0;
    for (int slot = 0; slot < *faces->slot_count; slot++) {
        const int i = faces->slot_vertex[slot];
        // Vertices inside of the body have no faces.
        if ((faces->all && faces->start[i] == faces->end[i]) ||
            !region_contains(&test, rows_local(&vertices->rows, vertices->present, i)))
            continue;
        if (found < capacity)
            node[found] = i;
        found++;
    }
    return found;
}
