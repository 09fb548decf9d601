// SPDX-License-Identifier: MIT
// Squares of a cut body: where they are, their neighbours, and the nodes that have them. Step
// thread.
#include "voxel/cut/cut_faces.h"

#include "base/bits.h"
#include "base/check.h"
#include "geometry/box.h"
#include "voxel/cut/cut_carry.h"
#include "voxel/cut/cut_parts.h"
#include "voxel/lattice_faces.h"

#include <math.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// Squares by their places

// Returns where a square is in the table, or where it would be.
static int find_in_table(const CutFaces *faces, int code)
{
    const unsigned mask = (unsigned)faces->table_size - 1;
    unsigned at = (unsigned)code * 2654435761u >> 7 & mask;
    while (faces->table[at] >= 0 && faces->square[faces->table[at]] != code)
        at = (at + 1) & mask;
    return (int)at;
}

int cut_faces_square(const CutFaces *faces, int cell, int direction)
{
    return faces->square_of != NULL ? faces->square_of[cell][direction]
                                    : faces->table[find_in_table(faces, 6 * cell + direction)];
}

void cut_faces_put_square(CutFaces *faces, int square)
{
    const int code = faces->square[square];
    if (faces->square_of != NULL)
        faces->square_of[code / 6][code % 6] = square;
    else
        faces->table[find_in_table(faces, code)] = square;
}

// Squares behind a removed one are entered again, so that none is behind a gap.
void cut_faces_drop_square(CutFaces *faces, int square)
{
    const int code = faces->square[square];
    if (faces->square_of != NULL) {
        faces->square_of[code / 6][code % 6] = -1;
        return;
    }
    const int mask = faces->table_size - 1;
    int at = find_in_table(faces, code);
    faces->table[at] = -1;
    for (at = (at + 1) & mask; faces->table[at] >= 0; at = (at + 1) & mask) {
        const int moved = faces->table[at];
        faces->table[at] = -1;
        cut_faces_put_square(faces, moved);
    }
}

void cut_faces_drop_all(CutFaces *faces)
{
    if (faces->square_of != NULL)
        memset(faces->square_of, -1, (size_t)faces->cell_count * sizeof *faces->square_of);
    else
        memset(faces->table, -1, (size_t)faces->table_size * sizeof *faces->table);
}

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
    const short *at = lattice->element[cell].cell;
    const int below =
        cut_lattice_cell(lattice, at[0] - (axis == 0), at[1] - (axis == 1), at[2] - (axis == 2));
    return below < 0 || cut_lattice_is_open(lattice, below, axis) ? -1 : below;
}

bool cut_faces_is_shown(const CutLattice *lattice, int cell, int direction)
{
    return !cut_lattice_is_gone(lattice, cell) && joined_to(lattice, cell, direction) < 0;
}

void cut_faces_join_square(CutFaces *faces, int square)
{
    const int code = faces->square[square];
    for (int k = 0; k < 4; k++) {
        const SquareEdge to =
            square_across(joined_to, faces->lattice, (SquareEdge){code / 6, code % 6, k});
        const int other = cut_faces_square(faces, to.cell, to.direction);
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

// Returns the units of a run for this many faces.
static int units_for(int count)
{
    return count > 0 ? (count + FACE_UNIT) / FACE_UNIT : 0;
}

// Moves all runs together.
static void compact(CutFaces *faces)
{
    int *list = faces->list, to = 0;
    for (int from = 0, units; from < faces->list_top; from += units) {
        const int head = list[FACE_UNIT * from], by = FACE_UNIT * (from - to);
        units = head < 0 ? -head : head % 8;
        if (head < 0)
            continue;
        memmove(&list[FACE_UNIT * to], &list[FACE_UNIT * from],
                (size_t)(FACE_UNIT * units) * sizeof *list);
        faces->start[head / 8] -= by, faces->end[head / 8] -= by;
        to += units;
    }
    faces->list_top = to;
    memset(faces->free_run, -1, sizeof faces->free_run);
}

static int take_run(CutFaces *faces, int units)
{
    const int free = faces->free_run[units];
    if (free >= 0) {
        faces->free_run[units] = faces->list[FACE_UNIT * free + 1];
        return free;
    }
    if (faces->list_top + units > faces->list_units)
        compact(faces);
    ASSERT(faces->list_top + units <= faces->list_units); // there are for all triangles
    faces->list_top += units;
    return faces->list_top - units;
}

static void give_run(CutFaces *faces, int run, int units)
{
    if (units == 0)
        return;
    faces->list[FACE_UNIT * run] = -units;
    faces->list[FACE_UNIT * run + 1] = faces->free_run[units];
    faces->free_run[units] = run;
}

// Gives a node room for one face more.
static void grow(CutFaces *faces, int vertex)
{
    const int count = faces->end[vertex] - faces->start[vertex], units = units_for(count);
    const int more = units_for(count + 1);
    if (more == units)
        return;
    const int run = take_run(faces, more), from = faces->start[vertex];
    int *to = &faces->list[FACE_UNIT * run];
    *to = 8 * vertex + more;
    memcpy(to + 1, &faces->list[from], (size_t)count * sizeof *to);
    give_run(faces, from / FACE_UNIT, units);
    faces->start[vertex] = FACE_UNIT * run + 1;
    faces->end[vertex] = faces->start[vertex] + count;
}

// Takes what a node that has lost a face no longer needs.
static void shrink(CutFaces *faces, int vertex)
{
    const int count = faces->end[vertex] - faces->start[vertex], units = units_for(count);
    const int before = units_for(count + 1), run = faces->start[vertex] / FACE_UNIT;
    if (before == units)
        return;
    give_run(faces, run + units, before - units);
    if (units > 0)
        faces->list[FACE_UNIT * run] = 8 * vertex + units;
    else
        faces->start[vertex] = faces->end[vertex] = 0;
}

// Inserts a face into a node's list, which stays ascending.
static void add_to_node(CutFaces *faces, int vertex, int face)
{
    grow(faces, vertex);
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
    shrink(faces, vertex);
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
    const bool gone = faces->cell_of[vertex] < 0;
    const int id = gone ? -1 : faces->lattice->vertex_id[vertex];
    faces->slot_of[vertex] = slot;
    faces->id[slot] = faces->parent[slot][0] = faces->parent[slot][1] = id;
    faces->origin[slot] = from < 0 ? id : faces->lattice->vertex_id[from];
    faces->piece[slot] = gone ? -1 : cut_pieces_of(faces->pieces, faces->cell_of[vertex]);
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
    return cut_carry_corner(faces->lattice, code / 6, SQUARE_CORNER[code % 6][k]);
}

void cut_faces_enter_square(CutFaces *faces, int square)
{
    cut_faces_put_square(faces, square);
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
    return faces->masses->node_mass[vertex] / (3.0 * faces->node_area[vertex]);
}

// Sets the firmness as contact_set_stiffness does, but relative to a constant mass per area, so
// that unchanged nodes keep their firmness.
static void set_node_firmness(CutFaces *faces, int vertex)
{
    double firmness = 1.0;
    if (faces->node_area[vertex] > 0.0) {
        firmness = mass_per_area(faces, vertex) / faces->least_firm;
        if (cut_masses_is_fixed(faces->masses, vertex))
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
        if (!cut_masses_is_fixed(faces->masses, vertex))
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
        any_free |= faces->node_area[i] > 0.0 && !cut_masses_is_fixed(faces->masses, i);
    for (int i = 0; i < faces->vertex_count; i++)
        if (faces->node_area[i] > 0.0 && (!any_free || !cut_masses_is_fixed(faces->masses, i)))
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
        for (int k = faces->start[vertex]; k < faces->end[vertex]; k++) {
            // Once: with the last of its corners.
            const int *corner = faces->face[faces->list[k]];
            if (!(faces->is_touched[corner[0]] | faces->is_touched[corner[1]] |
                  faces->is_touched[corner[2]]))
                set_face_firmness(faces, faces->list[k]);
        }
    }
    faces->touched_count = 0;
}

// ---------------------------------------------------------------------------------------------
// After changes of the lattice

// Returns the lowest cell of a vertex's part; -1: it has no element.
static int cell_of_vertex(const CutLattice *lattice, int vertex)
{
    const int slot = lattice->anchor[vertex];
    int point[3];
    cut_lattice_point(lattice, vertex, point);
    return slot < 0 || slot >= 8
               ? -1
               : cut_lattice_cell(lattice, point[0] - 1 + (slot & 1),
                                  point[1] - 1 + (slot >> 1 & 1), point[2] - 1 + (slot >> 2));
}

void cut_faces_enter_vertex(CutFaces *faces, int vertex)
{
    faces->cell_of[vertex] = cell_of_vertex(faces->lattice, vertex);
    faces->start[vertex] = faces->end[vertex] = 0;
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
        if (birth->carried) // it was there
            continue;
        faces->copied_from[birth->vertex] = cut_birth_origin(birth);
        cut_faces_enter_vertex(faces, birth->vertex);
        if (faces->all && birth->vertex < *faces->slot_count) // a row that was free
            cut_faces_describe_slot(faces, birth->vertex);
        else if (faces->all)
            cut_faces_add_slot(faces, birth->vertex);
        if (birth->parent_count == 0) // in void
            continue;
        // Whoever holds a node follows it to its parents.
        const int last = birth->parent[birth->parent_count - 1];
        faces->born[change->born_count++] = (NodeBirth){birth->vertex, {birth->parent[0], last}};
    }
    faces->vertex_count = cut_lattice_used(faces->lattice);
    change->born = faces->born;
}

// Forgets freed vertices. They were inside, and had no faces. True if what is published changed.
static bool follow_ends(CutFaces *faces)
{
    const CutLattice *lattice = faces->lattice;
    const CutChanges *changes = &lattice->changes;
    bool changed = false;
    for (int i = 0; i < changes->ended_count; i++) {
        const int vertex = changes->ended[i].vertex;
        if (cut_lattice_is_kept(lattice, vertex))
            continue;
        ASSERT(faces->start[vertex] == faces->end[vertex]);
        // Its copies have its original.
        const CutScratch *scratch = lattice->scratch;
        int point[3];
        cut_lattice_point(lattice, vertex, point);
        for (int v = cut_parts_first(scratch, cut_parts_index(scratch, point)); v >= 0;
             v = scratch->next[v]) {
            if (faces->copied_from[v] != vertex)
                continue;
            faces->copied_from[v] = faces->copied_from[vertex];
            changed |= faces->slot_of[v] >= 0;
            if (faces->slot_of[v] >= 0)
                cut_faces_describe_slot(faces, faces->slot_of[v]);
        }
        faces->copied_from[vertex] = faces->cell_of[vertex] = -1;
        changed |= faces->slot_of[vertex] >= 0;
        if (faces->slot_of[vertex] >= 0)
            cut_faces_describe_slot(faces, faces->slot_of[vertex]);
    }
    return changed;
}

// Returns the lowest free square, else the next.
static int take_place(CutFaces *faces)
{
    if (faces->free_count == 0) {
        ASSERT(*faces->shown < faces->square_capacity);
        return (int)(*faces->shown)++;
    }
    while (faces->square[faces->free_low] >= 0)
        faces->free_low++;
    faces->free_count--;
    return faces->free_low++;
}

static bool add_square(CutFaces *faces, int cell, int direction)
{
    if (cut_faces_square(faces, cell, direction) >= 0 ||
        !cut_faces_is_shown(faces->lattice, cell, direction))
        return false;
    const int square = take_place(faces);
    faces->square[square] = 6 * cell + direction;
    cut_faces_enter_square(faces, square);
    return true;
}

// Returns the side of a face {cell, axis} below or above it; its edge is 0.
static SquareEdge side_of_face(const CutLattice *lattice, const int face[2], int side)
{
    const int up = 2 * face[1] + 1;
    return side == 0 ? (SquareEdge){face[0], up, 0}
                     : (SquareEdge){cut_lattice_across(lattice, face[0], up), up - 1, 0};
}

// Frees the square of a cell that went. Outer places stay free: walls come after them.
static void end_square(CutFaces *faces, int square, TopologyChange *change)
{
    for (int face = 2 * square; face < 2 * square + 2; face++) {
        for (int c = 0; c < 3; c++) {
            take_from_node(faces, faces->face[face][c], face);
            cut_faces_touch(faces, faces->face[face][c]);
            faces->face[face][c] = faces->triangle[face][c] = 0;
            faces->neighbor[face][c] = -1;
        }
        faces->ended[change->face_count++] = (FaceChange){face, -1};
    }
    faces->square[square] = -1;
    if (square < faces->outer_squares)
        return;
    faces->free_count++;
    faces->free_low = square < faces->free_low ? square : faces->free_low;
}

// Ends what showed cells that went, and the vertices that had no other element.
static void follow_removal(CutFaces *faces, TopologyChange *change)
{
    const CutLattice *lattice = faces->lattice;
    const CutChanges *changes = &lattice->changes;
    for (int i = 0; i < changes->element_count && changes->lost_count > 0; i++) {
        const int cell = changes->element[i];
        if (cell >= faces->cell_count || !cut_lattice_is_gone(lattice, cell))
            continue;
        for (int d = 0; d < SQUARE_DIRECTIONS; d++) {
            const int square = cut_faces_square(faces, cell, d);
            faces->wall_count -= cut_lattice_across(lattice, cell, d) >= 0;
            if (square < 0)
                continue;
            cut_faces_drop_square(faces, square);
            end_square(faces, square, change);
        }
    }
    for (int i = 0; i < changes->lost_count; i++) {
        const int vertex = changes->lost[i];
        faces->cell_of[vertex] = cell_of_vertex(lattice, vertex);
        // Around a broken face that is not open yet its next cell may be of another piece.
        if (faces->slot_of[vertex] >= 0)
            cut_faces_describe_slot(faces, faces->slot_of[vertex]);
        if (lattice->anchor[vertex] < 0)
            faces->gone[change->gone_count++] = vertex;
    }
    change->face = faces->ended;
    change->gone = faces->gone;
    change->gone_parent = (const int(*)[2])faces->none;
}

// Updates the squares of cells in larger leaves around a point at which a vertex was copied.
static bool follow_copy(CutFaces *faces, int vertex)
{
    const CutLattice *lattice = faces->lattice;
    bool changed = false;
    int point[3], cell[8];
    cut_lattice_point(lattice, vertex, point);
    cut_lattice_cells(lattice, point, cell);
    for (int s = 0; s < 8; s++) {
        if (cell[s] < 0 || cut_lattice_is_leaf(lattice, cell[s]))
            continue;
        for (int d = 0; d < SQUARE_DIRECTIONS; d++)
            if (cut_faces_square(faces, cell[s], d) >= 0)
                changed |= follow_corners(faces, cut_faces_square(faces, cell[s], d));
    }
    return changed;
}

// Adds new squares in the order in which their faces opened; then updates existing ones whose
// corners were duplicated.
static bool follow_squares(CutFaces *faces)
{
    const CutLattice *lattice = faces->lattice;
    const CutChanges *changes = &lattice->changes;
    bool changed = false;
    // An open face shows a square on either side where there is a cell.
    for (int f = 0; f < changes->face_count; f++)
        for (int side = 0; side < 2; side++) {
            const SquareEdge at = side_of_face(lattice, changes->face[f], side);
            changed |= add_square(faces, at.cell, at.direction);
        }
    // Corners follow the vertices of changed elements.
    for (int i = 0; i < changes->element_count; i++) {
        const int element = changes->element[i];
        if (element >= faces->cell_count || !cut_lattice_is_leaf(lattice, element))
            continue;
        for (int d = 0; d < 6; d++)
            if (cut_faces_square(faces, element, d) >= 0)
                changed |= follow_corners(faces, cut_faces_square(faces, element, d));
    }
    for (int b = 0; b < changes->birth_count && lattice->adapts; b++)
        if (changes->birth[b].parent_count == 1)
            changed |= follow_copy(faces, changes->birth[b].vertex);
    // Neighbours last: all squares exist now.
    for (int f = 0; f < changes->face_count; f++)
        for (int side = 0; side < 2; side++) {
            const SquareEdge at = side_of_face(lattice, changes->face[f], side);
            if (cut_faces_square(faces, at.cell, at.direction) >= 0)
                cut_faces_join_square(faces, cut_faces_square(faces, at.cell, at.direction));
        }
    return changed;
}

// Masses have changed at all vertices of changed elements; of finest cells only where faces open.
static void touch_masses(CutFaces *faces)
{
    const CutLattice *lattice = faces->lattice;
    const CutChanges *changes = &lattice->changes;
    if (lattice->adapts && changes->face_count == 0)
        return;
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
    for (int i = 0; i < changes->lost_count && faces->node_firmness != NULL; i++)
        cut_faces_touch(faces, changes->lost[i]);
}

void cut_faces_report(const CutFaces *faces, Body *body)
{
    body->surface.node_used = faces->vertex_count;
    body->surface.face_used = 2 * (int)*faces->shown;
    body->mesh.node_count = (int)*faces->slot_count;
    body->mesh.triangle_count = 2 * (int)*faces->shown;
}

// Counts the two sides of a face that broke, unless it is listed again.
static void count_face(CutFaces *faces, const int face[2])
{
    const unsigned bit = 1u << face[1];
    if (faces->counted != NULL && (faces->counted[face[0]] & bit))
        return;
    faces->wall_count += 2;
    if (faces->counted != NULL)
        faces->counted[face[0]] |= (unsigned char)bit;
}

bool cut_faces_follow(CutFaces *faces, bool pieces_came, Body *body, TopologyChange *change)
{
    const CutChanges *changes = &faces->lattice->changes;
    *change = (TopologyChange){.again = false};
    follow_births(faces, change);
    const bool renamed = follow_ends(faces);
    for (int f = 0; f < changes->face_count; f++)
        count_face(faces, changes->face[f]);
    const bool ended = changes->lost_count > 0;
    if (ended)
        follow_removal(faces, change);
    bool changed = follow_squares(faces) || ended || renamed || change->born_count > 0;
    touch_masses(faces);
    cut_faces_settle_touched(faces);
    for (int slot = 0; slot < *faces->slot_count && pieces_came; slot++)
        cut_faces_describe_slot(faces, slot);
    cut_faces_report(faces, body);
    return changed || pieces_came;
}

bool cut_faces_has_room(const CutFaces *faces, int broken, int *needed, int *room)
{
    // Faces that are broken but not open yet get their squares later.
    *needed = 4 * broken;
    *room = 2 * (faces->square_capacity - faces->outer_squares - (int)faces->wall_count);
    return *needed <= *room;
}

bool cut_faces_has_room_to_remove(const CutFaces *faces, int cells, int *needed, int *room)
{
    return cut_faces_has_room(faces, 3 * cells, needed, room);
}

// Notes the slot of a vertex with faces that is within a region.
static void note_within(const CutFaces *faces, const RegionTest *test, int vertex)
{
    const Vertices *vertices = faces->vertices;
    const int slot = faces->slot_of[vertex];
    if (slot >= 0 && faces->start[vertex] != faces->end[vertex] &&
        region_contains(test, rows_local(&vertices->rows,
                                         cut_carry_rows(faces->carry, vertices->present, vertex),
                                         vertex)))
        bits_add(faces->found, slot);
}

// A box at rest, in the rows' coordinates, outside of which no displacement brings a vertex into a
// region. It is found at one go, and most elements and vertices are outside.
typedef struct AtRest {
    double middle[3], halfway[3];
} AtRest;

// Four numbers of a row at a time, so that compilers vectorise.
static void bound_single(const float *row, long count, float low[4], float high[4])
{
    for (long i = 0; i < count; i++)
        for (int c = 0; c < 4; c++) {
            const float u = row[i * ROW + c];
            low[c] = u < low[c] ? u : low[c];
            high[c] = u > high[c] ? u : high[c];
        }
}

static void bound_double(const double *row, long count, float low[4], float high[4])
{
    for (long i = 0; i < count; i++)
        for (int c = 0; c < 4; c++) {
            const float u = (float)row[i * ROW + c];
            low[c] = u < low[c] ? u : low[c];
            high[c] = u > high[c] ? u : high[c];
        }
}

static AtRest at_rest(const CutFaces *faces, const RegionTest *test)
{
    const Vertices *vertices = faces->vertices;
    const void *row = vertices->present;
    float low[4] = {INFINITY, INFINITY, INFINITY, INFINITY};
    float high[4] = {-INFINITY, -INFINITY, -INFINITY, -INFINITY};
    for (int r = 0; r < vertices->run_count; r++) {
        const long first = vertices->run[r][0], count = vertices->run[r][1] - first;
        if (vertices->rows.precision == PRECISION_SINGLE)
            bound_single((const float *)row + first * ROW, count, low, high);
        else
            bound_double((const double *)row + first * ROW, count, low, high);
    }
    const double middle[3] = {test->middle.x, test->middle.y, test->middle.z};
    const double halfway[3] = {test->halfway.x, test->halfway.y, test->halfway.z};
    AtRest rest;
    for (int c = 0; c < 3; c++) {
        const double least = (double)low[c], most = (double)high[c];
        rest.middle[c] = middle[c] - 0.5 * (least + most);
        // By more than rounding.
        const double grown =
            faces->masses->size + halfway[c] + fabs(middle[c]) + fmax(most, -least);
        rest.halfway[c] = halfway[c] + 0.5 * (most - least) + 1e-6 * grown;
    }
    return rest;
}

// True for a cube around a point that is not outside.
static bool may_reach(const AtRest *rest, const double middle[3], double halfway)
{
    bool in = true;
    for (int c = 0; c < 3; c++)
        in &= fabs(middle[c] - rest->middle[c]) <= rest->halfway[c] + halfway;
    return in;
}

static bool element_may_reach(const CutFaces *faces, const AtRest *rest, int element)
{
    const CutElement *of = &faces->lattice->element[element];
    const CutMasses *masses = faces->masses;
    const double half = 0.5 * (double)(1 << of->level);
    double middle[3];
    for (int c = 0; c < 3; c++)
        middle[c] = masses->size * (of->cell[c] + half - masses->middle[c]);
    return may_reach(rest, middle, masses->size * half);
}

// True if a region may reach into the box of an element's vertices.
static bool region_meets(const CutFaces *faces, const RegionTest *test, int element)
{
    const Vertices *vertices = faces->vertices;
    const int *node = cut_lattice_nodes(faces->lattice, element);
    Box box = box_empty();
    for (int n = 0; n < NODE_COUNT; n++)
        if (node[n] >= 0)
            box_add(&box, rows_local(&vertices->rows, vertices->present, node[n]));
    const Vec3 off = vec3_sub(box_middle(&box), test->middle), size = box_size(&box);
    // Larger by more than rounding: what is carried is between the vertices.
    const double grown = 0.5 + 1e-6;
    return fabs(off.x) <= test->halfway.x + grown * size.x &&
           fabs(off.y) <= test->halfway.y + grown * size.y &&
           fabs(off.z) <= test->halfway.z + grown * size.z;
}

// Of a body most of whose vertices others carry: looks at those that move by themselves, and at
// those of elements that the region meets.
static int find_with_carried(const CutFaces *faces, const RegionTest *test, int *node, int capacity)
{
    const Vertices *vertices = faces->vertices;
    const CutCarry *carry = faces->carry;
    const int words = bits_words((int)*faces->slot_count), cells = faces->lattice->level_first[1];
    const AtRest rest = at_rest(faces, test);
    for (int r = 0; r < vertices->run_count; r++)
        for (int v = vertices->run[r][0]; v < vertices->run[r][1]; v++)
            if (may_reach(&rest, vertices->rows.rest[v], 0.0) &&
                !rows_is_carried(&vertices->rows, v))
                note_within(faces, test, v);
    for (int k = 0; k < carry->leaf_count; k++) {
        const int at = carry->leaf[k] - cells;
        if (!element_may_reach(faces, &rest, carry->leaf[k]) ||
            !region_meets(faces, test, carry->leaf[k]))
            continue;
        for (int i = carry->first[at]; i < carry->end[at]; i++)
            note_within(faces, test, carry->vertex[i]);
    }
    int found = 0;
    for (int word = 0; word < words; word++) {
        for (uint64_t left = faces->found[word]; left != 0; found++) {
            const int slot = bits_take(&left, word);
            if (found < capacity)
                node[found] = faces->slot_vertex[slot];
        }
        faces->found[word] = 0;
    }
    return found;
}

const CutElement *cut_faces_element(const CutFaces *faces, int square)
{
    const CutLattice *lattice = faces->lattice;
    const int code = faces->square[square];
    return code < 0 ? NULL : &lattice->element[cut_parts_leaf(lattice, code / 6)];
}

int cut_faces_find_nodes(const CutFaces *faces, const Region *region, int *node, int capacity)
{
    const Vertices *vertices = faces->vertices;
    const Region here = rows_region(&vertices->rows, region);
    const RegionTest test = region_test(&here);
    if (faces->carry != NULL)
        return find_with_carried(faces, &test, node, capacity);
    int found = 0;
    for (int slot = 0; slot < *faces->slot_count; slot++) {
        const int i = faces->slot_vertex[slot];
        // Vertices inside of the body have no faces, nor have those without an element.
        if (faces->start[i] == faces->end[i] ||
            !region_contains(&test, rows_local(&vertices->rows, vertices->present, i)))
            continue;
        if (found < capacity)
            node[found] = i;
        found++;
    }
    return found;
}
