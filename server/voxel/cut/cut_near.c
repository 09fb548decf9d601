// SPDX-License-Identifier: MIT
// Offers the links near a sweep. What cannot be near is excluded: for strokes bricks of cells by
// stored boxes, for commands cells by the sides of the sweep on which their vertices are; then
// links by the sides of the sweep's box on which their ends are.
#include "voxel/cut/cut_near.h"

#include "geometry/distance.h"

#include <limits.h>
#include <math.h>
#include <string.h>

enum { SHIFTS = 64 }; // [q] more than all shifts and rounding

// ---------------------------------------------------------------------------------------------
// The sweep

void cut_near_set_edge(BladeSearch *search, const CutPath edge[2])
{
    // The box of its four ends.
    search->box = box_empty();
    for (int k = 0; k < 4; k++) {
        const int64_t *x = edge[k / 2].at[k % 2].x;
        box_add(&search->box, vec3((double)x[0], (double)x[1], (double)x[2]));
    }
    // The planes of its two triangles.
    const CutPoint *corner[2][3] = {{&edge[0].at[0], &edge[1].at[0], &edge[0].at[1]},
                                    {&edge[1].at[0], &edge[1].at[1], &edge[0].at[1]}};
    for (int t = 0; t < 2; t++) {
        double u[3], v[3];
        for (int c = 0; c < 3; c++) {
            search->at[t][c] = (double)corner[t][0]->x[c];
            u[c] = (double)(corner[t][1]->x[c] - corner[t][0]->x[c]);
            v[c] = (double)(corner[t][2]->x[c] - corner[t][0]->x[c]);
        }
        for (int c = 0; c < 3; c++) {
            const int a = (c + 1) % 3, b = (c + 2) % 3;
            search->normal[t][c] = u[a] * v[b] - u[b] * v[a];
        }
    }
    // A twisted patch lies off its two triangles by at most a quarter of the difference between the
    // ways of its ends, and the triangles of its sub-ticks off it by no more.
    double twist = 0.0;
    for (int c = 0; c < 3; c++) {
        const double way[2] = {(double)(edge[0].at[1].x[c] - edge[0].at[0].x[c]),
                               (double)(edge[1].at[1].x[c] - edge[1].at[0].x[c])};
        twist += (way[0] - way[1]) * (way[0] - way[1]);
    }
    search->slack = SHIFTS + 0.5 * sqrt(twist);
}

// ---------------------------------------------------------------------------------------------
// Boxes of bricks

// Returns the corners of a cell (one bit each) that are not corners of the next cell along one of
// these axes.
static unsigned corners_without(unsigned axes)
{
    unsigned corners = 0;
    for (unsigned c = 0; c < NODE_CORNERS; c++)
        corners |= (unsigned)((c & axes) == 0) << c;
    return corners;
}

// Computes the box around all centres of a brick's cells and of those to which its links lead.
// Where a face is not broken both cells have its corners: the next cell in the brick adds them.
static void make_box(const CutBlades *blades, const CellCentres *centres, int brick, BladeBox *box)
{
    const CutLattice *lattice = blades->lattice;
    unsigned without[8];
    for (unsigned axes = 0; axes < 8; axes++)
        without[axes] = corners_without(axes);
    Box rows = box_empty(); // in the rows' coordinates
    for (int cell = lattice->window[brick].first, leaf = -1; cell < lattice->window[brick].end;
         cell++) {
        const int own = cut_lattice_leaf_of(lattice, cell);
        // Vertices that the next cell has too are left to it.
        unsigned axes = 0; // along which the next cell is in the brick and connected
        for (int axis = 0; axis < 3; axis++) {
            const int beyond = cut_near_beyond(blades, cell, axis);
            if (beyond < 0 || (lattice->broken[cell] >> axis & 1))
                continue;
            if (lattice->element[cell].cell[axis] % WINDOW_EDGE != WINDOW_EDGE - 1)
                axes |= 1u << axis;
            else if (cut_lattice_leaf_of(lattice, beyond) != own)
                cut_centres_grow(centres, beyond, 0xff & ~without[1u << axis], &rows);
        }
        if (own != leaf)
            cut_centres_grow(centres, cell, without[axes], &rows);
        leaf = own;
    }
    // The box of the rotated box, in the world.
    for (int r = 0; r < 3; r++) {
        double middle = centres->shift[r], half = 0.0;
        for (int c = 0; c < 3; c++) {
            middle += centres->turn[r][c] * 0.5 * (rows.low[c] + rows.high[c]);
            half += fabs(centres->turn[r][c]) * 0.5 * (rows.high[c] - rows.low[c]);
        }
        box->world.low[r] = middle - half, box->world.high[r] = middle + half;
    }
}

// Returns the largest speed of a vertex relative to the base frame [m/s].
static double largest_speed(const CutBlades *blades, const void *row)
{
    const int count = cut_lattice_used(blades->lattice);
    if (blades->rows->precision == PRECISION_SINGLE) {
        const float *r = row;
        float most = 0.0F;
        for (int i = 0; i < count; i++, r += ROW) {
            const float square = r[4] * r[4] + r[5] * r[5] + r[6] * r[6];
            most = square > most ? square : most;
        }
        return sqrt((double)most);
    }
    const double *r = row;
    double most = 0.0;
    for (int i = 0; i < count; i++, r += ROW) {
        const double square = r[4] * r[4] + r[5] * r[5] + r[6] * r[6];
        most = square > most ? square : most;
    }
    return sqrt(most);
}

// Estimates the motion of a tick from the speeds at its ends, with a factor of two as a margin.
void cut_near_note_motion(BladeSearch *search, double tick, const void *row)
{
    BladeStroke *stroke = search->memory->stroke;
    const double frame = vec3_length(rows_velocity(search->blades->rows));
    const double motion = 2.0 * tick * (frame + largest_speed(search->blades, row));
    stroke->travel += motion;
    search->travel = stroke->travel;
    // Cells must be stored before the blade can reach them, in the next tick too.
    search->margin = motion + 0.25 * search->blades->size;
}

// Returns by how much a box may be too small.
static double growth(const BladeSearch *search, const BladeBox *box)
{
    return search->margin + search->travel - box->made;
}

static Vec3 place_of(const CutBlades *blades, CutPoint point)
{
    const Vec3 origin = blades->rows->rest_origin;
    return vec3(origin.x + blades->links.q * (double)point.x[0],
                origin.y + blades->links.q * (double)point.x[1],
                origin.z + blades->links.q * (double)point.x[2]);
}

// Shifts of the edge and rounding are a few q.
static bool boxes_meet(const BladeSearch *search, const BladeBox *box, const Box *edge)
{
    const double grown = growth(search, box) + SHIFTS * search->blades->links.q;
    bool apart = false;
    for (int c = 0; c < 3; c++)
        apart |=
            box->world.low[c] - grown > edge->high[c] || box->world.high[c] + grown < edge->low[c];
    return !apart;
}

// True if a brick is not farther from the edge than the edge has moved, and moves in the next tick.
static bool is_at_edge(const BladeSearch *search, const BladeBox *box, const CutPoint from[2],
                       const CutPoint to[2])
{
    const CutBlades *blades = search->blades;
    Vec3 end[2];
    double way = 0.0;
    for (int k = 0; k < 2; k++) {
        end[k] = place_of(blades, to[k]);
        way = fmax(way, vec3_length(vec3_sub(end[k], place_of(blades, from[k]))));
    }
    const double grown = growth(search, box) + SHIFTS * blades->links.q;
    const Vec3 half = vec3_add(vec3_scale(0.5, box_size(&box->world)), vec3(grown, grown, grown));
    return distance_point_segment(box_middle(&box->world), end[0], end[1]) <=
           vec3_length(half) + 2.0 * way;
}

// Finds the bricks whose box meets that of the four ends of the edge. Recomputes near boxes that
// have become too large. Where there is room for some cells alone, only of the bricks at the edge:
// the box of one that runs obliquely has most of the body in it.
void cut_near_find_bricks(BladeSearch *search, const CutPoint from[2], const CutPoint to[2])
{
    const CutBlades *blades = search->blades;
    Box edge = box_empty();
    for (int k = 0; k < 4; k++)
        box_add(&edge, place_of(blades, k < 2 ? from[k] : to[k - 2]));
    search->brick_count = 0;
    for (int b = 0; b < blades->brick_count; b++) {
        BladeBox *box = &search->memory->box[b];
        if (!(box->made >= 0.0) ||
            (boxes_meet(search, box, &edge) && search->travel - box->made > 0.5 * blades->size)) {
            make_box(blades, &search->centres, b, box);
            box->made = search->travel;
        }
        if (boxes_meet(search, box, &edge) &&
            (blades->place_at == NULL || is_at_edge(search, box, from, to)))
            blades->brick[search->brick_count++] = b;
    }
}

// ---------------------------------------------------------------------------------------------
// Previous and current centres of cells

// Returns where the place of a cell is, or the free slot for it.
static int *slot_of(const CutBlades *blades, int cell)
{
    const unsigned mask = (1u << blades->place_bits) - 1;
    unsigned at = (unsigned)cell * 0x9e3779b1u >> (32 - blades->place_bits);
    while (blades->place_at[at] >= 0 && blades->cell_at[blades->place_at[at]] != cell)
        at = (at + 1) & mask;
    return &blades->place_at[at];
}

// Returns the place of a cell in scratch, if it was looked at.
static int place_in(const CutBlades *blades, int cell)
{
    return blades->place_at == NULL ? cell : *slot_of(blades, cell);
}

void cut_near_forget_places(CutBlades *blades)
{
    const unsigned mask = (1u << blades->place_bits) - 1;
    if (blades->place_at == NULL)
        return;
    // A cell's slot is not beyond the first free one behind its own.
    for (int p = 0; p < blades->place_count; p++)
        for (unsigned at = (unsigned)blades->cell_at[p] * 0x9e3779b1u >> (32 - blades->place_bits);
             blades->place_at[at] >= 0; at = (at + 1) & mask)
            blades->place_at[at] = -1;
    blades->place_count = 0;
}

// Returns where a cell is in the memory of the search: a stroke's is by cell.
static int memory_of(const BladeSearch *search, int cell)
{
    return search->whole ? place_in(search->blades, cell) : cell;
}

// Gives a cell a place in scratch. False: there is none.
static bool take_place(CutBlades *blades, int cell)
{
    if (blades->place_at == NULL)
        return true;
    int *place = slot_of(blades, cell);
    if (*place >= 0)
        return true;
    if (blades->place_count == blades->place_most)
        return false;
    *place = blades->place_count;
    blades->whole.stamp[blades->place_count] = blades->code_stamp[blades->place_count] = 0;
    blades->cell_at[blades->place_count++] = cell;
    return true;
}

static void look_at(BladeSearch *search, int cell)
{
    CutBlades *blades = search->blades;
    BladeMemory *memory = search->memory;
    if (!take_place(blades, cell)) {
        search->lost = true;
        return;
    }
    const int own = memory_of(search, cell), place = place_in(blades, cell);
    if (memory->stamp[own] == search->now)
        return;
    const Vec3 x = cut_centre(&search->centres, cell), origin = blades->rows->rest_origin;
    const double part[3] = {x.x - origin.x, x.y - origin.y, x.z - origin.z};
    const bool known = memory->stamp[own] == search->was;
    for (int c = 0; c < 3; c++) {
        double units = floor(part[c] / blades->links.q + 0.5);
        if (!(fabs(units) < 0x1p30)) {
            search->lost = true;
            units = 0.0;
        }
        const int now = (int)units;
        blades->before[place][c] = known ? memory->centre[own][c] : now;
        memory->centre[own][c] = now;
    }
    memory->stamp[own] = search->now;
}

void cut_near_look_at_brick(BladeSearch *search, int brick)
{
    const CutLattice *lattice = search->blades->lattice;
    const CutWindow *window = &lattice->window[brick];
    for (int cell = window->first; cell < window->end; cell++) {
        if (cut_lattice_is_gone(lattice, cell))
            continue;
        look_at(search, cell);
        for (int axis = 0; axis < 3; axis++) {
            if (lattice->element[cell].cell[axis] % WINDOW_EDGE != WINDOW_EDGE - 1)
                continue;
            const int beyond = cut_near_beyond(search->blades, cell, axis);
            if (beyond >= 0 && !cut_lattice_is_gone(lattice, beyond))
                look_at(search, beyond);
        }
    }
}

// True unless a brick is clear of the edge's box or of both planes.
static bool brick_may_meet(const BladeSearch *search, int brick)
{
    const CutBlades *blades = search->blades;
    const BladeBox *box = &search->memory->box[brick];
    const Vec3 o = blades->rows->rest_origin;
    const double origin[3] = {o.x, o.y, o.z};
    const double grown = growth(search, box) / blades->links.q + search->slack;
    // The box in units of q, and whether it is clear of that of the edge.
    double middle[3], half[3];
    for (int c = 0; c < 3; c++) {
        middle[c] = (0.5 * (box->world.low[c] + box->world.high[c]) - origin[c]) / blades->links.q;
        half[c] = 0.5 * (box->world.high[c] - box->world.low[c]) / blades->links.q + grown;
        if (middle[c] + half[c] < search->box.low[c] || middle[c] - half[c] > search->box.high[c])
            return false;
    }
    // Beyond both planes of the sweep's triangles nothing can be met.
    int clear = 0;
    for (int t = 0; t < 2; t++) {
        double sum = 0.0, reach = 0.0;
        for (int c = 0; c < 3; c++) {
            sum += search->normal[t][c] * (middle[c] - search->at[t][c]);
            reach += fabs(search->normal[t][c]) * half[c];
        }
        clear += fabs(sum) > reach * (1.0 + 1e-9);
    }
    return clear < 2;
}

// ---------------------------------------------------------------------------------------------
// Codes: a bit for each side of the box (low, high by axis) and of the two planes on which a point
// certainly is, for any shift of the edge. Bits that all vertices of an element share hold for its
// cells' centres too.

static unsigned code_of_place(const BladeSearch *search, const double at[3])
{
    unsigned code = 0;
    for (int c = 0; c < 3; c++) {
        code |= (unsigned)(at[c] < search->box.low[c] - search->slack) << 2 * c;
        code |= (unsigned)(at[c] > search->box.high[c] + search->slack) << (2 * c + 1);
    }
    for (int t = 0; t < 2; t++) {
        double sum = 0.0, size = 0.0;
        for (int c = 0; c < 3; c++) {
            sum += search->normal[t][c] * (at[c] - search->at[t][c]);
            size += fabs(search->normal[t][c]);
        }
        code |= (unsigned)(sum > search->slack * size) << (6 + 2 * t);
        code |= (unsigned)(sum < -search->slack * size) << (7 + 2 * t);
    }
    return code;
}

static void find_vertex_codes(BladeSearch *search)
{
    CutBlades *blades = search->blades;
    const Vec3 o = blades->rows->rest_origin;
    const int count = cut_lattice_used(blades->lattice);
    for (int v = 0; v < count; v++) {
        const Vec3 x = vec3_sub(cut_centres_vertex(&search->centres, v), o);
        const double at[3] = {x.x / blades->links.q, x.y / blades->links.q, x.z / blades->links.q};
        blades->vertex_code[v] = (unsigned short)code_of_place(search, at);
    }
}

// Returns the bits that all vertices of a leaf share.
static unsigned code_of_leaf(const CutBlades *blades, int leaf)
{
    const CutLattice *lattice = blades->lattice;
    const int *node = cut_lattice_nodes(lattice, leaf);
    const int count = lattice->element[leaf].level == 0 ? NODE_CORNERS : NODE_COUNT;
    unsigned code = 0x3ff;
    for (int n = 0; n < count; n++)
        code &= node[n] < 0 ? 0x3ffu : blades->vertex_code[node[n]];
    return code;
}

// True if what is on these sides cannot be met: beyond the box, or beyond both planes.
static bool is_clear(unsigned code)
{
    return (code & 0x3f) != 0 || ((code & 0xc0) != 0 && (code & 0x300) != 0);
}

void cut_near_find_codes(BladeSearch *search)
{
    CutBlades *blades = search->blades;
    find_vertex_codes(search);
    unsigned code = 0;
    for (int cell = 0, before = -1; cell < blades->cell_count && blades->near_code != NULL;
         cell++) {
        const int leaf = cut_lattice_leaf_of(blades->lattice, cell);
        if (leaf != before)
            code = code_of_leaf(blades, leaf);
        before = leaf;
        blades->near_code[cell] = (unsigned short)code;
    }
}

int cut_near_find_larger(BladeSearch *search, int level, int *leaf)
{
    const CutLattice *lattice = search->blades->lattice;
    int count = 0;
    find_vertex_codes(search);
    for (int e = lattice->level_first[level]; e < lattice->level_first[level + 1]; e++)
        if (cut_lattice_is_leaf(lattice, e) && !is_clear(code_of_leaf(search->blades, e)))
            leaf[count++] = e;
    return count;
}

// ---------------------------------------------------------------------------------------------
// Links: like cut_boxes_apart, but the sides of the edge's box are computed once per cell for all
// its links. One bit of a code per side (low, high by axis).

CutPath cut_near_path(const BladeSearch *search, int cell)
{
    const int place = place_in(search->blades, cell), own = memory_of(search, cell);
    CutPath path;
    for (int c = 0; c < 3; c++) {
        path.at[0].x[c] = search->blades->before[place][c];
        path.at[1].x[c] = search->memory->centre[own][c];
    }
    return path;
}

static unsigned code_of(BladeSearch *search, int cell)
{
    CutBlades *blades = search->blades;
    const int place = place_in(blades, cell);
    if (blades->code_stamp[place] == search->stamp)
        return blades->code[place];
    const CutPath path = cut_near_path(search, cell);
    unsigned code = 0;
    for (int c = 0; c < 3; c++) {
        const double a = (double)path.at[0].x[c], b = (double)path.at[1].x[c];
        code |= (unsigned)((a < search->box.low[c]) & (b < search->box.low[c])) << 2 * c;
        code |= (unsigned)((a > search->box.high[c]) & (b > search->box.high[c])) << (2 * c + 1);
    }
    blades->code_stamp[place] = search->stamp;
    blades->code[place] = (unsigned char)code;
    return code;
}

static void next_codes(BladeSearch *search)
{
    CutBlades *blades = search->blades;
    if (blades->last_code == INT_MAX) {
        memset(blades->code_stamp, 0, (size_t)blades->place_most * sizeof *blades->code_stamp);
        blades->last_code = 0;
    }
    search->stamp = ++blades->last_code;
}

// Returns the sides that the leaf of a cell is outside of.
static unsigned near_code_of(const CutBlades *blades, int cell)
{
    return blades->near_code != NULL
               ? blades->near_code[cell]
               : code_of_leaf(blades, cut_lattice_leaf_of(blades->lattice, cell));
}

// Offers the links of one cell. `clear`: level of its leaf, if that cannot be met; else 0. False:
// one is undecided.
static bool offer_cell(BladeSearch *search, LinkFinder *links, int cell, int clear)
{
    CutBlades *blades = search->blades;
    for (int axis = 0; axis < 3; axis++) {
        // Links within such a leaf.
        if (clear > 0 && (blades->lattice->element[cell].cell[axis] + 1) % (1 << clear) != 0)
            continue;
        const int beyond = cut_near_beyond(blades, cell, axis);
        const bool broken = blades->lattice->broken[cell] >> axis & 1;
        // Skip links to void, and broken ones unless their meeting must be reported.
        if (beyond < 0 || (broken && !search->whole) ||
            (broken && (cut_lattice_is_gone(blades->lattice, cell) ||
                        cut_lattice_is_gone(blades->lattice, beyond))))
            continue;
        if (search->whole) {
            if (is_clear(near_code_of(blades, cell) & near_code_of(blades, beyond)))
                continue;
            look_at(search, cell);
            look_at(search, beyond);
            if (search->lost) // as the caller finds
                return true;
        }
        if ((code_of(search, cell) & code_of(search, beyond)) != 0)
            continue;
        // The lower cell first, so that neighbours agree.
        const bool ordered = cell < beyond;
        const CutPath link[2] = {cut_near_path(search, ordered ? cell : beyond),
                                 cut_near_path(search, ordered ? beyond : cell)};
        if (!link_finder_meet(links, 3 * cell + axis, link))
            return false;
    }
    return true;
}

bool cut_near_offer(LinkFinder *links, void *model)
{
    BladeSearch *search = model;
    CutBlades *blades = search->blades;
    cut_near_set_edge(search, links->edge);
    next_codes(search);
    // Commands: of all cells. Strokes: of the bricks near.
    for (int cell = 0, clear = 0, leaf = -1; search->whole && cell < blades->cell_count; cell++) {
        const int before = leaf;
        if (blades->near_code == NULL)
            leaf = cut_lattice_leaf_of(blades->lattice, cell);
        if (leaf != before)
            clear = is_clear(near_code_of(blades, cell)) ? blades->lattice->element[leaf].level : 0;
        if (!offer_cell(search, links, cell, clear))
            return false;
    }
    for (int k = 0; k < search->brick_count; k++) {
        if (!brick_may_meet(search, blades->brick[k]))
            continue;
        const CutWindow *brick = &blades->lattice->window[blades->brick[k]];
        for (int cell = brick->first; cell < brick->end; cell++)
            if (!offer_cell(search, links, cell, 0))
                return false;
    }
    return true;
}
