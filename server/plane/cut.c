// SPDX-License-Identifier: MIT
// Breaks edges, carves quarters, tears, and rebuilds a plane body. Step thread.
#include "plane/cut.h"

#include "base/check.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// A change

static void begin(PlaneModel *model, TopologyChange *change)
{
    PlaneCut *cut = model->cut;
    const size_t elements = (size_t)cut->layout.element_count;
    memcpy(cut->before, cut->vertex, elements * sizeof *cut->before);
    memcpy(cut->quarters_before, cut->quarters, elements);
    memset(cut->mass_before, 0, (size_t)cut->vertex_capacity * sizeof *cut->mass_before);
    memcpy(cut->mass_before, model->vertices.mass,
           (size_t)model->vertices.count * sizeof *cut->mass_before);
    *change = (TopologyChange){.born = cut->birth};
}

// Builds the mesh of the current bits; false: it has more vertices than the capacity.
bool plane_cut_fill_mesh(PlaneCut *cut)
{
    plane_mesh_fill(&cut->mesh, &cut->room, &cut->layout, cut->broken);
    return cut->mesh.vertex_count <= cut->vertex_capacity;
}

// Rebuilds everything that follows from the mesh, except velocities.
static void rebuild(PlaneModel *model, Body *body, TopologyChange *change)
{
    plane_cut_take_rows(model, change);
    plane_forms_fill(&model->cut->forms, model, &model->cut->layout,
                     (const int(*)[PLANE_PLACES])model->cut->vertex);
    plane_cut_make_masses(model);
    plane_fill_batches(model);
    model->vertices.present = model->vertices.row[model->vertices.current];
    body->element_count = model->element_count;
    plane_cut_show(model, body);
}

void plane_cut_make(PlaneModel *model, Body *body)
{
    plane_cut_fill_mesh(model->cut);
    TopologyChange none = {.born = model->cut->birth};
    rebuild(model, body, &none);
}

void plane_cut_count_pieces(PlaneCut *cut, CutOutcome *outcome)
{
    // Pieces are numbered: the highest number tells how many.
    int pieces = 0;
    for (int v = 0; v < cut->mesh.vertex_count; v++)
        pieces = cut->mesh.piece[v] >= pieces ? cut->mesh.piece[v] + 1 : pieces;
    // Cells of each: a cell belongs to the piece of any vertex of its element.
    int *cells = cut->cells_of_piece;
    memset(cells, 0, (size_t)pieces * sizeof *cells);
    for (int cell = 0; cell < cut->cell_count; cell++) {
        if (!cut->is_solid[cell])
            continue;
        int e =
            plane_layout_at(&cut->layout, cell % cut->layout.count[0], cell / cut->layout.count[0]);
        int p = 0;
        while (cut->mesh.vertex[e][p] < 0)
            p++;
        cells[cut->mesh.piece[cut->mesh.vertex[e][p]]]++;
    }
    // Fewer than four cells are a small piece.
    outcome->pieces = pieces;
    outcome->small_pieces = 0;
    for (int k = 0; k < pieces; k++)
        outcome->small_pieces += cells[k] < 4;
}

static void set_broken(PlaneCut *cut, const int *link, int count, bool broken)
{
    for (int k = 0; k < count; k++) {
        unsigned char *bits = &cut->broken[link[k] / 2];
        const int bit = 1 << link[k] % 2;
        *bits = (unsigned char)(broken ? *bits | bit : *bits & ~bit);
    }
}

bool plane_cut_break(Body *body, const int *link, int count, CutOutcome *outcome,
                     TopologyChange *change)
{
    PlaneModel *model = body->model;
    PlaneCut *cut = model->cut;
    const int before = model->vertices.count;
    begin(model, change);
    // Try it: only the new mesh tells whether the vertices fit.
    set_broken(cut, link, count, true);
    if (!plane_cut_fill_mesh(cut)) {
        outcome->verdict = CUT_NO_NODES;
        outcome->needed = cut->mesh.vertex_count - before;
        outcome->room = cut->vertex_capacity - before;
        set_broken(cut, link, count, false);
        plane_cut_fill_mesh(cut);
        return false;
    }
    rebuild(model, body, change);
    plane_cut_keep_momentum(model);
    *cut->wants = 1;
    outcome->separated += count;
    outcome->nodes_added += model->vertices.count - before;
    return true;
}

// ---------------------------------------------------------------------------------------------
// Reconstruction

// True if an edge is broken inside a square or on its outline.
static bool is_cut(const PlaneCut *cut, int i, int j, int size)
{
    const int wide = cut->layout.count[0];
    for (int y = j - 1; y < j + size; y++)
        for (int x = i - 1; x < i + size; x++) {
            if (x < 0 || y < 0)
                continue;
            unsigned bits = cut->broken[y * wide + x];
            if ((y >= j && bits & PLANE_BROKEN_RIGHT) || (x >= i && bits & PLANE_BROKEN_UP))
                return true;
        }
    return false;
}

// True if an element two levels below borders on a quarter's edges towards the rest of its square:
// where another quarter was carved, and then that one. Fig. 7 (b) has the four along the outer
// edges only; without this rule adjacent elements could differ by two levels.
static bool is_finer_inside(const PlaneCut *cut, const PlaneElement *own, int quarter)
{
    const int half = 1 << (own->level - 1), x = quarter & 1, y = quarter >> 1;
    const int i = own->cell[0] + x * half, j = own->cell[1] + y * half;
    for (int k = 0; k < 2 && own->level >= 2; k++) {
        const int along = k == 0 ? 0 : half / 2;
        // The elements inside of the square along the quarter's inner edges.
        const int beside[2] = {plane_layout_at(&cut->layout, x ? i - 1 : i + half, j + along),
                               plane_layout_at(&cut->layout, i + along, y ? j - 1 : j + half)};
        for (int d = 0; d < 2; d++)
            if (beside[d] >= 0 && cut->layout.element[beside[d]].level + 2 <= own->level)
                return true;
    }
    return false;
}

// Decides by Fig. 7 of the paper, and for squares that a blade has cut through, which the paper
// does not have: its edges break between elements only.
static bool must_carve(const PlaneCut *cut, int element, int quarter)
{
    const PlaneElement *own = &cut->layout.element[element];
    const int half = 1 << (own->level - 1);
    const int i = own->cell[0] + (quarter & 1) * half, j = own->cell[1] + (quarter >> 1) * half;
    return plane_must_carve(&cut->layout, cut->broken, element, quarter) ||
           is_finer_inside(cut, own, quarter) || is_cut(cut, i, j, half);
}

static unsigned to_be_carved(const PlaneCut *cut, int element)
{
    const unsigned quarters = cut->layout.element[element].quarters;
    unsigned carved = 0;
    for (int q = 0; q < 4; q++)
        if (quarters >> q & 1 && must_carve(cut, element, q))
            carved |= 1u << q;
    const unsigned left = quarters & ~carved;
    return left == 6 || left == 9 ? quarters : carved; // they meet in a corner
}

static void carve(PlaneCut *cut, int element, unsigned carved)
{
    PlaneElement *own = &cut->layout.element[element];
    const int level = own->level - 1, half = 1 << level, wide = cut->layout.count[0] >> level;
    for (int q = 0; q < 4; q++) {
        if (!(carved >> q & 1))
            continue;
        // The quarter becomes an element of its own, which was there without quarters.
        int e = cut->layout.lut[level][((own->cell[1] >> level) + (q >> 1)) * wide +
                                       (own->cell[0] >> level) + (q & 1)];
        ASSERT(cut->layout.element[e].cell[0] == own->cell[0] + (q & 1) * half);
        cut->quarters[e] = cut->layout.element[e].quarters = PLANE_WHOLE;
    }
    // What is left of the square.
    own->quarters &= (unsigned char)~carved;
    cut->quarters[element] = own->quarters;
}

// Processes squares by ascending size, so that all smaller ones are done before (section 3.2, phase
// 1); new elements are examined in the next tick.
bool plane_cut_reconstruct(Body *body, TopologyChange *change)
{
    PlaneModel *model = body->model;
    PlaneCut *cut = model->cut;
    // Nothing has changed since the last time.
    if (*cut->wants == 0)
        return false;
    *cut->wants = 0;
    begin(model, change);
    // Carve all quarters that must be, as the body was before this call.
    int done = 0;
    for (int e = 0; e < cut->layout.element_count; e++) {
        if (cut->layout.element[e].level == 0 || cut->quarters_before[e] == 0)
            continue;
        unsigned carved = to_be_carved(cut, e);
        if (carved == 0)
            continue;
        carve(cut, e, carved);
        done++;
    }
    if (done == 0)
        return false;
    if (!plane_cut_fill_mesh(
            cut)) { // none is carved: half of them would leave levels too far apart
        for (int e = 0; e < cut->layout.element_count; e++)
            cut->layout.element[e].quarters = cut->quarters[e] = cut->quarters_before[e];
        plane_cut_fill_mesh(cut);
        return false;
    }
    rebuild(model, body, change);
    plane_cut_keep_momentum(model);
    // An element across the crack held both sides together until now.
    CutOutcome outcome;
    plane_cut_count_pieces(cut, &outcome);
    change->pieces = outcome.pieces;
    // What was carved may need more: once more in the next tick.
    *cut->wants = 1;
    return true;
}

// ---------------------------------------------------------------------------------------------
// Tearing by the threshold of Miyazaki et al. 2004, section 3.2: a larger external force on a
// vertex releases it, so that the elements around no longer share it. An object that pushes further
// in releases the vertices that then come to the outline, and a crack grows

void plane_cut_feel(PlaneModel *model)
{
    const Vertices *vertices = &model->vertices;
    double *felt = model->cut->felt;
    for (long v = 0; v < vertices->count; v++) {
        const double fx = rows_get(&vertices->rows, vertices->force, 4 * v);
        const double fy = rows_get(&vertices->rows, vertices->force, 4 * v + 1);
        const double square = fx * fx + fy * fy;
        felt[v] = square > felt[v] ? square : felt[v];
    }
}

static void list_link(PlaneCut *cut, int i, int j, int bit)
{
    if (i < 0 || j < 0 || i >= cut->layout.count[0] || j >= cut->layout.count[1])
        return;
    const int cell = j * cut->layout.count[0] + i;
    const int beyond = plane_layout_at(&cut->layout, i + (bit == PLANE_BROKEN_RIGHT),
                                       j + (bit == PLANE_BROKEN_UP));
    const int own = plane_layout_at(&cut->layout, i, j);
    const int link = plane_cut_link(cell, bit);
    if (own >= 0 && beyond >= 0 && own != beyond && !(cut->broken[cell] & bit) &&
        !link_finder_is_odd(&cut->links, link))
        link_finder_add(&cut->links, link, 1);
}

bool plane_cut_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change)
{
    (void)tick;
    PlaneModel *model = body->model;
    PlaneCut *cut = model->cut;
    const double most = cut->tear_force * cut->tear_force;
    const int wide = cut->layout.lattice_count[0] + 1;
    cut->links.met_count = 0;
    // Release the vertices that felt more than the threshold.
    for (int v = 0; v < model->vertices.count; v++) {
        const bool releases = cut->felt[v] > most;
        cut->felt[v] = 0.0;
        if (!releases)
            continue;
        const int point = cut->id[v] % cut->points, i = point % wide, j = point / wide;
        for (int k = 0; k < 2; k++) { // the four edges between cells that meet at the point
            list_link(cut, i - 1, j - 1 + k, PLANE_BROKEN_RIGHT);
            list_link(cut, i - 1 + k, j - 1, PLANE_BROKEN_UP);
        }
    }
    link_finder_keep_odd(&cut->links);
    *outcome = (CutOutcome){.verdict = CUT_MET_NOTHING};
    if (cut->links.met_count == 0 ||
        !plane_cut_break(body, cut->links.met, cut->links.met_count, outcome, change))
        return false;
    outcome->verdict = CUT_DONE;
    plane_cut_count_pieces(cut, outcome);
    return true;
}
