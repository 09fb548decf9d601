// From a blade's motion to the faces that it breaks.
#include "voxel/cut/cut_blade.h"

#include "base/check.h"
#include "voxel/cut/cut_centre.h"

#include <limits.h>
#include <math.h>
#include <string.h>

#define ALLOCATE(count, type, label)                                                               \
    (type *)arena_allocate(arena, ARENA_CONTACT, (size_t)(count), sizeof(type), "%s/%s", name,     \
                           label)

enum { PARTS_OF_CELL = 1024 }; // q is a cell's edge over this
#define TWIST_TOLERANCE 0.05   // of a sub-tick, in cells

// One sweep that is being looked at.
typedef struct Search {
    CutBlades *blades;
    BladeMemory *memory;
    bool whole;
    int now, was; // stamps of this tick and of the one before; -1: none
    CellCentres centres;
    int brick_count; // near the sweep
    double travel;   // see BladeStroke
    double margin;   // that is kept around the sweep [m]
    bool lost;       // a cell is beyond what can be told
    int stamp;       // of the codes
    bool met_broken;
    // --- the edge in this sub-tick ---
    CutPath edge[2];
    double low[3], high[3];        // its box, in q
    double at[2][3], normal[2][3]; // planes of its two triangles
    double normal_size[2][3];      // sizes of the products that add up to the normals
} Search;

// ---------------------------------------------------------------------------------------------
// Boxes of bricks

static void make_box(const CutBlades *blades, const CellCentres *centres, int brick, BladeBox *box)
{
    const CutLattice *lattice = blades->lattice;
    double low[3], high[3];
    for (int c = 0; c < 3; c++)
        low[c] = (double)INFINITY, high[c] = -(double)INFINITY;
    for (int cell = lattice->window[brick].first, leaf = -1; cell < lattice->window[brick].end;
         cell++) {
        const int own = cut_lattice_leaf_of(lattice, cell);
        if (own != leaf)
            cut_centres_grow(centres, cell, low, high);
        leaf = own;
        for (int axis = 0; axis < 3; axis++) { // links reach beyond the brick
            if (lattice->element[cell].cell[axis] % WINDOW_EDGE != WINDOW_EDGE - 1)
                continue;
            const int beyond = blades->beyond[cell][axis];
            if (beyond >= 0 && cut_lattice_leaf_of(lattice, beyond) != own)
                cut_centres_grow(centres, beyond, low, high);
        }
    }
    for (int r = 0; r < 3; r++) {
        double middle = centres->shift[r], half = 0.0;
        for (int c = 0; c < 3; c++) {
            middle += centres->turn[r][c] * 0.5 * (low[c] + high[c]);
            half += fabs(centres->turn[r][c]) * 0.5 * (high[c] - low[c]);
        }
        box->low[r] = middle - half, box->high[r] = middle + half;
    }
}

// The largest speed of a vertex [m/s], bounded from the largest component.
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

// Speeds at the ends of ticks tell what a tick's motion is but for a factor, which is taken as two.
static void note_motion(Search *search, double tick, const void *row)
{
    BladeStroke *stroke = search->memory->stroke;
    const double motion = 2.0 * tick * largest_speed(search->blades, row);
    stroke->travel += motion;
    search->travel = stroke->travel;
    // Cells are remembered before the blade can reach them, in the next tick too.
    search->margin = motion + 0.25 * search->blades->size;
}

// By how much a box may be too small.
static double growth(const Search *search, const BladeBox *box)
{
    return search->margin + search->travel - box->made;
}

static Vec3 place_of(const CutBlades *blades, CutPoint point)
{
    const Vec3 origin = blades->rows->rest_origin;
    return vec3(origin.x + blades->q * (double)point.x[0],
                origin.y + blades->q * (double)point.x[1],
                origin.z + blades->q * (double)point.x[2]);
}

// Shifts of the edge and rounding are of a few q.
static bool boxes_meet(const Search *search, const BladeBox *box, const double low[3],
                       const double high[3])
{
    const double grown = growth(search, box) + 64.0 * search->blades->q;
    bool apart = false;
    for (int c = 0; c < 3; c++)
        apart |= box->low[c] - grown > high[c] || box->high[c] + grown < low[c];
    return !apart;
}

// Bricks whose box meets that of the four ends of the edge. Boxes near by are made anew once they
// have become too large.
static void find_bricks(Search *search, const CutPoint from[2], const CutPoint to[2])
{
    const CutBlades *blades = search->blades;
    double low[3], high[3];
    for (int c = 0; c < 3; c++)
        low[c] = (double)INFINITY, high[c] = -(double)INFINITY;
    for (int k = 0; k < 4; k++) {
        const Vec3 x = place_of(blades, k < 2 ? from[k] : to[k - 2]);
        const double at[3] = {x.x, x.y, x.z};
        for (int c = 0; c < 3; c++) {
            low[c] = at[c] < low[c] ? at[c] : low[c];
            high[c] = at[c] > high[c] ? at[c] : high[c];
        }
    }
    search->brick_count = 0;
    for (int b = 0; b < blades->brick_count; b++) {
        BladeBox *box = &search->memory->box[b];
        if (!(box->made >= 0.0) || (boxes_meet(search, box, low, high) &&
                                    search->travel - box->made > 0.5 * blades->size)) {
            make_box(blades, &search->centres, b, box);
            box->made = search->travel;
        }
        if (boxes_meet(search, box, low, high))
            blades->brick[search->brick_count++] = b;
    }
}

// ---------------------------------------------------------------------------------------------
// Where cells were and are

static void look_at(Search *search, int cell)
{
    CutBlades *blades = search->blades;
    BladeMemory *memory = search->memory;
    if (memory->stamp[cell] == search->now)
        return;
    const Vec3 x = cut_centre(&search->centres, cell), origin = blades->rows->rest_origin;
    const double part[3] = {x.x - origin.x, x.y - origin.y, x.z - origin.z};
    const bool known = memory->stamp[cell] == search->was;
    for (int c = 0; c < 3; c++) {
        double units = floor(part[c] / blades->q + 0.5);
        if (!(fabs(units) < 0x1p30)) {
            search->lost = true;
            units = 0.0;
        }
        const int now = (int)units;
        blades->before[cell][c] = known ? memory->centre[cell][c] : now;
        memory->centre[cell][c] = now;
    }
    memory->stamp[cell] = search->now;
}

static void look_at_cells(Search *search)
{
    const CutLattice *lattice = search->blades->lattice;
    for (int k = 0; k < search->brick_count; k++) {
        const CutWindow *brick = &lattice->window[search->blades->brick[k]];
        for (int cell = brick->first; cell < brick->end; cell++) {
            look_at(search, cell);
            for (int axis = 0; axis < 3; axis++) {
                if (lattice->element[cell].cell[axis] % WINDOW_EDGE != WINDOW_EDGE - 1)
                    continue;
                const int beyond = search->blades->beyond[cell][axis];
                if (beyond >= 0)
                    look_at(search, beyond);
            }
        }
    }
}

static CutPath path_of(const Search *search, int cell, int part, int parts)
{
    CutPath path;
    for (int c = 0; c < 3; c++) {
        path.at[0].x[c] = search->blades->before[cell][c];
        path.at[1].x[c] = search->memory->centre[cell][c];
    }
    return parts == 1 ? path : cut_part(path, part, parts);
}

// ---------------------------------------------------------------------------------------------
// Which links an edge may meet: as cut_may_meet, but on which sides of the edge's box a cell is is
// found once for all its links. A bit of a code for each side (low, high by axis).

static void set_edge(Search *search, const CutPath edge[2])
{
    memcpy(search->edge, edge, sizeof search->edge);
    for (int c = 0; c < 3; c++) {
        search->low[c] = (double)INFINITY, search->high[c] = -(double)INFINITY;
        for (int k = 0; k < 4; k++) {
            const double x = (double)edge[k / 2].at[k % 2].x[c];
            search->low[c] = x < search->low[c] ? x : search->low[c];
            search->high[c] = x > search->high[c] ? x : search->high[c];
        }
    }
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
            search->normal_size[t][c] = fabs(u[a] * v[b]) + fabs(u[b] * v[a]);
        }
    }
}

// On which side of a plane a point certainly is: 1, 2, or 0.
static unsigned side_of(const Search *search, int plane, const CutPoint *point)
{
    double sum = 0.0, size = 0.0;
    for (int c = 0; c < 3; c++) {
        const double away = (double)point->x[c] - search->at[plane][c];
        sum += search->normal[plane][c] * away;
        size += search->normal_size[plane][c] * fabs(away);
    }
    const double rounding = 8.9e-16 * size; // of a 3 x 3 determinant, see cut_exact.c
    return sum > rounding ? 1u : sum < -rounding ? 2u : 0u;
}

static unsigned code_of(Search *search, int cell, int part, int parts)
{
    CutBlades *blades = search->blades;
    if (blades->code_stamp[cell] == search->stamp)
        return blades->code[cell];
    const CutPath path = path_of(search, cell, part, parts);
    unsigned code = 0;
    for (int c = 0; c < 3; c++) {
        const double a = (double)path.at[0].x[c], b = (double)path.at[1].x[c];
        code |= (unsigned)((a < search->low[c]) & (b < search->low[c])) << 2 * c;
        code |= (unsigned)((a > search->high[c]) & (b > search->high[c])) << (2 * c + 1);
    }
    blades->code_stamp[cell] = search->stamp;
    blades->code[cell] = (unsigned char)code;
    return code;
}

// Whether all points of a link are certainly on one side of both planes.
static bool is_clear(const Search *search, const CutPath link[2])
{
    for (int t = 0; t < 2; t++) {
        unsigned side = 3;
        for (int k = 0; k < 4; k++)
            side &= side_of(search, t, &link[k / 2].at[k % 2]);
        if (side == 0)
            return false;
    }
    return true;
}

// The same of a whole brick, box and planes.
static bool brick_may_meet(const Search *search, int brick)
{
    const CutBlades *blades = search->blades;
    const BladeBox *box = &search->memory->box[brick];
    const Vec3 o = blades->rows->rest_origin;
    const double origin[3] = {o.x, o.y, o.z};
    const double grown = growth(search, box) / blades->q + 64.0;
    double middle[3], half[3];
    for (int c = 0; c < 3; c++) {
        middle[c] = (0.5 * (box->low[c] + box->high[c]) - origin[c]) / blades->q;
        half[c] = 0.5 * (box->high[c] - box->low[c]) / blades->q + grown;
        if (middle[c] + half[c] < search->low[c] || middle[c] - half[c] > search->high[c])
            return false;
    }
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
// Sub-ticks

static void forget_hits(CutBlades *blades, int from)
{
    for (int h = from; h < blades->hit_count; h++)
        blades->hit_bits[blades->hit[h][0]] &= (unsigned char)~(1u << blades->hit[h][1]);
    blades->hit_count = from;
}

static void next_codes(Search *search)
{
    CutBlades *blades = search->blades;
    if (blades->last_code == INT_MAX) {
        memset(blades->code_stamp, 0, (size_t)blades->cell_count * sizeof *blades->code_stamp);
        blades->last_code = 0;
    }
    search->stamp = ++blades->last_code;
}

// One link: 1 when it was met an odd number of times, 0, or CUT_DEGENERATE.
static int test_link(Search *search, int cell, int beyond, int part, int parts)
{
    search->blades->looked_at++;
    if ((code_of(search, cell, part, parts) & code_of(search, beyond, part, parts)) != 0)
        return 0;
    const bool ordered = cell < beyond;
    const CutPath link[2] = {path_of(search, ordered ? cell : beyond, part, parts),
                             path_of(search, ordered ? beyond : cell, part, parts)};
    const int count = is_clear(search, link) ? 0 : cut_count(search->edge, link);
    return count == CUT_DEGENERATE ? CUT_DEGENERATE : count % 2;
}

// All links of the bricks near, in the order of cells and axes. False: degenerate.
static bool test_links(Search *search, int part, int parts)
{
    CutBlades *blades = search->blades;
    const CutLattice *lattice = blades->lattice;
    next_codes(search);
    for (int k = 0; k < search->brick_count; k++) {
        if (!brick_may_meet(search, blades->brick[k]))
            continue;
        const CutWindow *brick = &lattice->window[blades->brick[k]];
        for (int cell = brick->first; cell < brick->end; cell++)
            for (int axis = 0; axis < 3; axis++) {
                const bool broken = lattice->broken[cell] >> axis & 1;
                if ((broken && (!search->whole || search->met_broken)) ||
                    (blades->hit_bits[cell] >> axis & 1))
                    continue;
                const int beyond = blades->beyond[cell][axis];
                if (beyond < 0)
                    continue;
                const int odd = test_link(search, cell, beyond, part, parts);
                if (broken) {
                    search->met_broken |= odd == 1;
                    continue;
                }
                if (odd == CUT_DEGENERATE)
                    return false;
                if (odd == 0)
                    continue;
                blades->hit_bits[cell] |= (unsigned char)(1u << axis);
                int *hit = blades->hit[blades->hit_count++];
                hit[0] = cell, hit[1] = axis;
            }
    }
    return true;
}

static CutPoint shifted(CutPoint point, int64_t tries, int end)
{
    const CutPoint shift = cut_shift(tries, end);
    for (int c = 0; c < 3; c++)
        point.x[c] += shift.x[c];
    return point;
}

// The edge's way through a tick, in sub-ticks. `used`: its ends where the tick before left them;
// `base`: the way without shifts. Where it stands on an answer that hangs on nothing but rounding
// its end is shifted, in the first sub-tick of a stroke its start as well, and the sub-tick is done
// again. False: unresolved.
static bool sweep_parts(Search *search, const CutPath base[2], CutPoint used[2], bool fresh,
                        int64_t *tries, int parts)
{
    for (int part = 0; part < parts; part++) {
        const int before = search->blades->hit_count;
        bool done = false;
        while (!done) {
            CutPath edge[2];
            for (int e = 0; e < 2; e++) {
                const CutPath way = cut_part(base[e], part, parts);
                edge[e].at[0] = fresh && part == 0 ? shifted(way.at[0], *tries, e) : used[e];
                edge[e].at[1] = shifted(way.at[1], *tries, e);
            }
            set_edge(search, edge);
            done = test_links(search, part, parts);
            if (done) {
                used[0] = edge[0].at[1], used[1] = edge[1].at[1];
                break;
            }
            forget_hits(search->blades, before);
            if (++*tries > CUT_TRIES)
                return false;
        }
    }
    return true;
}

// ---------------------------------------------------------------------------------------------
// Sweeps

static bool quantise_edge(const CutBlades *blades, const BladeEdge *edge, CutPoint out[2])
{
    for (int e = 0; e < 2; e++)
        if (!cut_quantise(edge->end[e], blades->rows->rest_origin, blades->q, &out[e]))
            return false;
    return true;
}

// Afterwards the marks are clear, the list stays.
static void clear_marks(CutBlades *blades)
{
    for (int h = 0; h < blades->hit_count; h++)
        blades->hit_bits[blades->hit[h][0]] = 0;
}

static bool answer(CutBlades *blades, CutVerdict verdict, CutOutcome *outcome)
{
    clear_marks(blades);
    if (verdict != CUT_DONE)
        blades->hit_count = 0;
    outcome->verdict = verdict;
    outcome->separated = blades->hit_count;
    return verdict == CUT_DONE;
}

static void forget_boxes(const CutBlades *blades, BladeMemory *memory)
{
    for (int b = 0; b < blades->brick_count; b++)
        memory->box[b].made = -1.0;
}

static bool sweep_whole(CutBlades *blades, const void *row, const CutSweep *sweep,
                        CutOutcome *outcome)
{
    Search search = {.blades = blades, .memory = &blades->whole, .whole = true};
    const int parts = cut_subticks(sweep, TWIST_TOLERANCE * blades->size);
    CutPoint from[2], to[2];
    if (!quantise_edge(blades, &sweep->before, from) || !quantise_edge(blades, &sweep->after, to))
        return answer(blades, CUT_TOO_LARGE, outcome);
    if (parts == 0)
        return answer(blades, CUT_TOO_TWISTED, outcome);
    memset(blades->whole.stamp, 0, (size_t)blades->cell_count * sizeof *blades->whole.stamp);
    search.now = 1, search.was = -1;
    cut_centres_begin(&search.centres, blades->lattice, blades->rows, row);
    forget_boxes(blades, &blades->whole);
    find_bricks(&search, from, to);
    look_at_cells(&search);
    if (search.lost)
        return answer(blades, CUT_TOO_LARGE, outcome);
    const CutPath base[2] = {{{from[0], to[0]}}, {{from[1], to[1]}}};
    int64_t tries = 0;
    if (!sweep_parts(&search, base, from, true, &tries, parts))
        return answer(blades, CUT_UNRESOLVED, outcome);
    const bool any = blades->hit_count > 0;
    return answer(blades,
                  any                 ? CUT_DONE
                  : search.met_broken ? CUT_WAS_CUT
                                      : CUT_MET_NOTHING,
                  outcome);
}

// The stroke begins where the edge is now. False: the edge or a cell is beyond reach.
static bool begin_stroke(CutBlades *blades, const void *row, BladeMemory *memory,
                         const BladeEdge *edge)
{
    BladeStroke *stroke = memory->stroke;
    *stroke = (BladeStroke){.under_way = 0};
    if (!quantise_edge(blades, edge, stroke->edge))
        return false;
    memset(memory->stamp, 0, (size_t)blades->cell_count * sizeof *memory->stamp);
    stroke->under_way = stroke->fresh = stroke->now = 1;
    Search search = {.blades = blades, .memory = memory, .now = 1, .was = -1};
    cut_centres_begin(&search.centres, blades->lattice, blades->rows, row);
    forget_boxes(blades, memory);
    note_motion(&search, 0.0, row);
    find_bricks(&search, stroke->edge, stroke->edge);
    look_at_cells(&search);
    if (search.lost)
        *stroke = (BladeStroke){.under_way = 0};
    return !search.lost;
}

static bool go_on(CutBlades *blades, const void *row, double tick, const CutSweep *sweep,
                  BladeMemory *memory, CutOutcome *outcome)
{
    BladeStroke *stroke = memory->stroke;
    const int parts = cut_subticks(sweep, TWIST_TOLERANCE * blades->size);
    CutPoint to[2];
    CutVerdict verdict = CUT_MET_NOTHING;
    if (parts == 0)
        verdict = CUT_TOO_TWISTED;
    else if (!quantise_edge(blades, &sweep->after, to))
        verdict = CUT_TOO_LARGE;
    if (verdict == CUT_MET_NOTHING) {
        Search search = {.blades = blades, .memory = memory};
        search.was = (int)stroke->now;
        search.now = (int)++stroke->now;
        cut_centres_begin(&search.centres, blades->lattice, blades->rows, row);
        note_motion(&search, tick, row);
        find_bricks(&search, stroke->edge, to);
        look_at_cells(&search);
        int64_t *tries = &sweep->stroke->tries;
        CutPath base[2];
        for (int e = 0; e < 2; e++) {
            const CutPoint shift = cut_shift(*tries, e);
            base[e] = (CutPath){{stroke->edge[e], to[e]}};
            for (int c = 0; c < 3 && !stroke->fresh; c++)
                base[e].at[0].x[c] -= shift.x[c];
        }
        if (search.lost)
            verdict = CUT_TOO_LARGE;
        else if (!sweep_parts(&search, base, stroke->edge, stroke->fresh != 0, tries, parts))
            verdict = CUT_UNRESOLVED;
        else if (blades->hit_count > 0)
            verdict = CUT_DONE;
        stroke->fresh = 0;
    }
    if (verdict != CUT_DONE && verdict != CUT_MET_NOTHING)
        begin_stroke(blades, row, memory, &sweep->after);
    return answer(blades, verdict, outcome);
}

bool cut_blades_find(CutBlades *blades, const void *row, double tick, const CutSweep *sweep,
                     CutOutcome *outcome)
{
    blades->hit_count = 0;
    if (sweep->phase == CUT_WHOLE)
        return sweep_whole(blades, row, sweep, outcome);
    ASSERT(sweep->blade >= 0 && sweep->blade < blades->blade_count);
    BladeMemory *memory = &blades->blade[sweep->blade];
    bool within = true;
    if (sweep->phase == CUT_ENDS)
        *memory->stroke = (BladeStroke){.under_way = 0};
    else if (sweep->phase == CUT_BEGINS)
        within = begin_stroke(blades, row, memory, &sweep->after);
    else if (memory->stroke->under_way || begin_stroke(blades, row, memory, &sweep->before))
        return go_on(blades, row, tick, sweep, memory, outcome);
    else
        within = false;
    return answer(blades, within ? CUT_MET_NOTHING : CUT_TOO_LARGE, outcome);
}

void cut_blades_refused(CutBlades *blades, const void *row, const CutSweep *sweep)
{
    blades->hit_count = 0;
    if (sweep->phase == CUT_GOES_ON)
        begin_stroke(blades, row, &blades->blade[sweep->blade], &sweep->after);
}

// ---------------------------------------------------------------------------------------------
// Load time

void cut_blades_create(CutBlades *blades, const char *name, const CutLattice *lattice,
                       const Rows *rows, double size, Arena *arena)
{
    const int cells = lattice->level_first[1];
    *blades = (CutBlades){.lattice = lattice, .rows = rows, .size = size, .cell_count = cells};
    blades->q = size / PARTS_OF_CELL;
    while (blades->brick_count < lattice->window_count &&
           lattice->window[blades->brick_count].level == 0)
        blades->brick_count++;
    blades->hit = arena_allocate(arena, ARENA_CONTACT, 3 * (size_t)cells, sizeof *blades->hit,
                                 "%s/hits", name);
    blades->beyond = arena_allocate(arena, ARENA_CONTACT, (size_t)cells, sizeof *blades->beyond,
                                    "%s/cells beyond", name);
    for (int cell = 0; cell < cells; cell++)
        for (int axis = 0; axis < 3; axis++)
            blades->beyond[cell][axis] = cut_lattice_beyond(lattice, cell, axis);
    blades->hit_bits = ALLOCATE(cells, unsigned char, "hit faces");
    blades->whole.centre = arena_allocate(arena, ARENA_CONTACT, (size_t)cells,
                                          sizeof *blades->whole.centre, "%s/centres", name);
    blades->whole.stamp = ALLOCATE(cells, int, "stamps of centres");
    blades->whole.box = ALLOCATE(blades->brick_count, BladeBox, "boxes of bricks");
    blades->before = arena_allocate(arena, ARENA_CONTACT, (size_t)cells, sizeof *blades->before,
                                    "%s/centres before", name);
    blades->code_stamp = ALLOCATE(cells, int, "stamps of codes");
    blades->code = ALLOCATE(cells, unsigned char, "codes");
    blades->brick = ALLOCATE(blades->brick_count, int, "bricks near");
}

void cut_blades_reserve(CutBlades *blades, const char *name, int count, Arena *arena,
                        StateList *state)
{
    const size_t cells = (size_t)blades->cell_count, bricks = (size_t)blades->brick_count;
    blades->blade_count = count;
    blades->blade = ALLOCATE(count, BladeMemory, "blades");
    for (int k = 0; k < count; k++) {
        BladeMemory *memory = &blades->blade[k];
        memory->stroke = ALLOCATE(1, BladeStroke, "stroke");
        memory->centre = arena_allocate(arena, ARENA_CONTACT, cells, sizeof *memory->centre,
                                        "%s/centres by blade", name);
        memory->stamp = ALLOCATE(cells, int, "stamps by blade");
        memory->box = ALLOCATE(bricks, BladeBox, "boxes by blade");
        state_add(state, memory->stroke, sizeof *memory->stroke, "%s/blade%d/stroke", name, k);
        state_add(state, memory->centre, cells * sizeof *memory->centre, "%s/blade%d/centres", name,
                  k);
        state_add(state, memory->stamp, cells * sizeof *memory->stamp, "%s/blade%d/stamps", name,
                  k);
        state_add(state, memory->box, bricks * sizeof *memory->box, "%s/blade%d/boxes", name, k);
    }
}

void cut_blades_forget(CutBlades *blades)
{
    for (int k = 0; k < blades->blade_count; k++)
        *blades->blade[k].stroke = (BladeStroke){.under_way = 0};
}

void cut_blades_restored(CutBlades *blades)
{
    for (int k = 0; k < blades->blade_count; k++) {
        BladeStroke *stroke = blades->blade[k].stroke;
        bool good = stroke->under_way == 1 && stroke->now > 0 && stroke->now < INT_MAX / 2 &&
                    (stroke->fresh == 0 || stroke->fresh == 1);
        for (int i = 0; i < 6; i++) {
            const int64_t x = stroke->edge[i / 3].x[i % 3];
            good &= x < CUT_REACH / 2 && x > -CUT_REACH / 2;
        }
        if (!good)
            *stroke = (BladeStroke){.under_way = 0};
        for (int c = 0; c < blades->cell_count; c++)
            for (int d = 0; d < 3; d++) {
                int *x = &blades->blade[k].centre[c][d];
                *x = *x > 1 << 30 ? 1 << 30 : *x < -(1 << 30) ? -(1 << 30) : *x;
            }
    }
}
