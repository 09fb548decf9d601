// Breaking edges, carving quarters, and making all of a plane body anew. Step thread, but for
// plane_cut_create.
#include "voxel/plane/plane_cut.h"

#include "base/check.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// Load time

#define ALLOCATE(use, count, type, label)                                                          \
    (type *)arena_allocate(arena, (use), (size_t)(count), sizeof(type), "%s/%s", name, label)
#define ALLOCATE_ROWS(count, row, label)                                                           \
    arena_allocate(arena, ARENA_TOPOLOGY, (size_t)(count), sizeof *(row), "%s/%s", name, label)

// The layout with an element for every square, so that those that come have their number already.
static void take_layout(PlaneCut *cut, const VoxelOptions *options, Arena *arena)
{
    const char *name = options->name;
    PlaneLayout made, *layout = &cut->layout;
    plane_layout_create(&made, options->lattice, options->levels);
    *layout = (PlaneLayout){.levels = made.levels};
    memcpy(layout->lattice_count, made.lattice_count, sizeof made.lattice_count);
    memcpy(layout->count, made.count, sizeof made.count);
    cut->cell_count = made.count[0] * made.count[1];
    cut->is_solid = ALLOCATE(ARENA_TOPOLOGY, cut->cell_count, bool, "solid cells");
    for (int level = 0; level <= made.levels; level++)
        layout->element_count += cut->cell_count >> 2 * level;
    layout->element = ALLOCATE(ARENA_TOPOLOGY, layout->element_count, PlaneElement, "elements");
    int e = 0;
    for (int level = 0; level <= made.levels; level++) {
        const int size = 1 << level, squares = cut->cell_count >> 2 * level;
        layout->lut[level] = ALLOCATE(ARENA_TOPOLOGY, squares, int, "look-up table");
        for (int at = 0; at < squares; at++, e++) {
            const int wide = made.count[0] / size, i = at % wide * size, j = at / wide * size;
            PlaneElement *element = &layout->element[e];
            element->cell[0] = i;
            element->cell[1] = j;
            element->level = (unsigned char)level;
            element->material = (unsigned char)lattice_label(options->lattice, i, j, 0);
            if (level == 0)
                cut->is_solid[at] = element->material != 0;
            if (made.lut[level][at] >= 0) {
                element->quarters = made.element[made.lut[level][at]].quarters;
                element->material = made.element[made.lut[level][at]].material;
            }
            layout->lut[level][at] = e;
        }
    }
    plane_layout_destroy(&made);
}

// A point is held when its place is, or the vertex that was there at the start.
static void take_fixed_points(PlaneCut *cut, const VoxelOptions *options, const bool *fixed,
                              Arena *arena)
{
    const int wide = cut->layout.lattice_count[0] + 1;
    cut->fixed_point = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)cut->points, sizeof(bool),
                                      "%s/fixed points", options->name);
    for (int r = 0; r < options->fixed_count; r++)
        for (int p = 0; p < cut->points && options->fixed[r].kind != FIXED_NODES; p++)
            cut->fixed_point[p] |= fixed_contains(
                &options->fixed[r], lattice_point(options->lattice, p % wide, p / wide, 0.5));
    for (int v = 0; v < cut->mesh.vertex_count; v++)
        cut->fixed_point[cut->mesh.id[v] % cut->points] |= fixed[v];
}

static void take_tables(PlaneCut *cut, const char *name, Arena *arena)
{
    const int most = cut->vertex_capacity, elements = cut->layout.element_count;
    cut->path = ALLOCATE_ROWS(cut->cell_count, cut->path, "paths of cells");
    cut->cells_of_piece = ALLOCATE(ARENA_TOPOLOGY, cut->room.vertices, int, "cells of pieces");
    cut->row_of = ALLOCATE(ARENA_TOPOLOGY, cut->room.vertices, int, "rows of vertices");
    cut->row_of_id = ALLOCATE(ARENA_TOPOLOGY, 4 * cut->points, int, "rows of ids");
    cut->vertex = ALLOCATE_ROWS(elements, cut->vertex, "rows of elements");
    cut->before = ALLOCATE_ROWS(elements, cut->before, "rows of elements before");
    cut->quarters_before = ALLOCATE(ARENA_TOPOLOGY, elements, unsigned char, "quarters before");
    cut->mass_before = ALLOCATE(ARENA_TOPOLOGY, most, double, "masses before");
    cut->birth = ALLOCATE(ARENA_TOPOLOGY, 2 * most, NodeBirth, "births");
    cut->edge = ALLOCATE_ROWS(2 * cut->cell_count, cut->edge, "edges to break");
    cut->marked = ALLOCATE(ARENA_TOPOLOGY, cut->cell_count, unsigned char, "marked edges");
    cut->origin_id = ALLOCATE(ARENA_TOPOLOGY, most, int, "vertex origins");
    cut->parent = ALLOCATE_ROWS(most, cut->parent, "vertex parents");
    cut->piece = ALLOCATE(ARENA_TOPOLOGY, most, int, "vertex pieces");
    cut->level = ALLOCATE(ARENA_TOPOLOGY, most, signed char, "vertex levels");
}

static void take_state(PlaneCut *cut, const char *name, Arena *arena, StateList *state)
{
    const size_t elements = (size_t)cut->layout.element_count, cells = (size_t)cut->cell_count;
    cut->quarters = ALLOCATE(ARENA_TOPOLOGY, elements, unsigned char, "quarters");
    cut->broken = ALLOCATE(ARENA_TOPOLOGY, cells, unsigned char, "broken edges");
    cut->wants = ALLOCATE(ARENA_TOPOLOGY, 1, int64_t, "wants");
    for (size_t e = 0; e < elements; e++)
        cut->quarters[e] = cut->layout.element[e].quarters;
    state_add(state, cut->quarters, elements, "%s/quarters", name);
    state_add(state, cut->broken, cells, "%s/broken_edges", name);
    state_add(state, cut->id, (size_t)cut->vertex_capacity * sizeof *cut->id, "%s/vertex_ids",
              name);
    state_add(state, cut->origin_id, (size_t)cut->vertex_capacity * sizeof *cut->origin_id,
              "%s/vertex_origins", name);
    state_add(state, cut->wants, sizeof *cut->wants, "%s/wants", name);
    if (cut->tear_force <= 0.0)
        return;
    cut->felt = ALLOCATE(ARENA_STEP, cut->vertex_capacity, double, "felt forces");
    state_add(state, cut->felt, (size_t)cut->vertex_capacity * sizeof *cut->felt, "%s/felt_forces",
              name);
}

void plane_cut_create(PlaneModel *model, const VoxelOptions *options, const bool *fixed,
                      Arena *arena, StateList *state)
{
    const char *name = options->name;
    PlaneCut *cut = ALLOCATE(ARENA_TOPOLOGY, 1, PlaneCut, "cuts");
    model->cut = cut;
    snprintf(cut->name, sizeof cut->name, "%s", name);
    cut->is_sound = true;
    take_layout(cut, options, arena);
    cut->points = (cut->layout.lattice_count[0] + 1) * (cut->layout.lattice_count[1] + 1);
    cut->tear_force = options->tear_force;
    cut->quantum = options->lattice->size / 1024.0;
    cut->origin = lattice_point(options->lattice, 0.0, 0.0, 0.5);
    plane_mesh_reserve(&cut->mesh, &cut->room, &cut->layout, name, arena);
    plane_mesh_fill(&cut->mesh, &cut->room, &cut->layout, NULL);
    take_fixed_points(cut, options, fixed, arena);
    // A body that is cut to its last edge has four vertices a cell.
    cut->vertex_capacity =
        options->vertex_capacity > 0 ? options->vertex_capacity : cut->room.vertices;
    if (cut->vertex_capacity < cut->mesh.vertex_count)
        cut->vertex_capacity = cut->mesh.vertex_count;
    plane_forms_create(&cut->forms, options, &cut->layout, &cut->mesh, true, arena);
    cut->id = ALLOCATE(ARENA_TOPOLOGY, cut->vertex_capacity, int, "vertex ids");
    take_tables(cut, name, arena);
    take_state(cut, name, arena, state);
    for (int k = 0; k < 4 * cut->points; k++)
        cut->row_of_id[k] = -1;
    for (int v = 0; v < cut->vertex_capacity; v++) {
        cut->id[v] = v < cut->mesh.vertex_count ? cut->mesh.id[v] : -1;
        if (cut->id[v] >= 0)
            cut->row_of_id[cut->id[v]] = v;
    }
    memcpy(cut->origin_id, cut->id, (size_t)cut->vertex_capacity * sizeof *cut->id);
}

// ---------------------------------------------------------------------------------------------
// Vertices that come

// Where an element's place was before the change: the rows whose mean it is.
typedef struct PlaneSource {
    int count;
    int row[4];
} PlaneSource;

static PlaneSource source_of(const PlaneCut *cut, int element, int place)
{
    const int *before = cut->before[element];
    const unsigned quarters = cut->quarters_before[element];
    if (before[place] >= 0)
        return (PlaneSource){1, {before[place]}};
    if (plane_passing(quarters, place) == PLANE_ABSENT) // the middle of a whole square
        return (PlaneSource){4, {before[0], before[2], before[6], before[8]}};
    int outline[PLANE_PLACES], count = plane_outline(quarters, outline), end[2] = {-1, -1};
    for (int k = 0; k < count; k++)
        if (outline[k] == place) {
            end[0] = before[outline[(k + count - 1) % count]];
            end[1] = before[outline[(k + 1) % count]];
        }
    // The neighbours on the outline may be absent middles too, along two quarters in a row; but a
    // place between two that turn has these as ends.
    ASSERT(end[0] >= 0 && end[1] >= 0);
    return (PlaneSource){2, {end[0], end[1]}};
}

// The place of an element's corner in the square around, which had the element as a quarter before.
static PlaneSource inherited(const PlaneCut *cut, int element, int place)
{
    if (cut->quarters_before[element] != 0)
        return source_of(cut, element, place);
    const PlaneElement *own = &cut->layout.element[element];
    const int level = own->level + 1, size = 1 << level;
    ASSERT(level <= cut->layout.levels);
    const int wide = cut->layout.count[0] / size;
    const int around = cut->layout.lut[level][own->cell[1] / size * wide + own->cell[0] / size];
    const int x = (own->cell[0] & (size - 1)) != 0, y = (own->cell[1] & (size - 1)) != 0;
    return source_of(cut, around, x + place % 3 / 2 + 3 * (y + place / 3 / 2));
}

static bool is_corner_place(int place)
{
    return place % 2 == 0 && place != PLANE_CENTER;
}

static PlaneSource source_of_vertex(const PlaneCut *cut, const int *element, const int *place,
                                    int count)
{
    // An element that had a vertex there before tells best; else one of which it is a corner.
    for (int k = 0; k < count; k++)
        if (cut->quarters_before[element[k]] != 0 && cut->before[element[k]][place[k]] >= 0)
            return (PlaneSource){1, {cut->before[element[k]][place[k]]}};
    for (int k = 0; k < count; k++)
        if (is_corner_place(place[k]) || cut->quarters_before[element[k]] != 0)
            return inherited(cut, element[k], place[k]);
    ASSERT(false);
    return (PlaneSource){0};
}

// The elements around a vertex of the mesh, and which of their places it is.
static int around_vertex(const PlaneCut *cut, int v, int element[4], int place[4])
{
    int count = 0;
    for (int s = 0; s < 4; s++) {
        int e = plane_layout_at(&cut->layout, cut->mesh.point[v][0] - 1 + (s & 1),
                                cut->mesh.point[v][1] - 1 + (s >> 1));
        bool again = false;
        for (int k = 0; k < count; k++)
            again |= element[k] == e;
        for (int p = 0; e >= 0 && !again && p < PLANE_PLACES; p++)
            if (cut->mesh.vertex[e][p] == v) {
                element[count] = e;
                place[count++] = p;
            }
    }
    return count;
}

static void bear(PlaneModel *model, int v, int row, TopologyChange *change)
{
    PlaneCut *cut = model->cut;
    Vertices *vertices = &model->vertices;
    Rows *rows = &vertices->rows;
    int element[4], place[4], count = around_vertex(cut, v, element, place);
    const PlaneSource source = source_of_vertex(cut, element, place, count);
    void *present = vertices->row[vertices->current];
    for (int k = 0; k < ROW; k++) {
        double sum = 0.0;
        for (int i = 0; i < source.count; i++)
            sum += rows_get(rows, present, (long)source.row[i] * ROW + k);
        rows_put(rows, present, (long)row * ROW + k, sum / source.count);
    }
    const int a = source.row[0], b = source.row[source.count - 1];
    cut->origin_id[row] = source.count == 1 ? cut->origin_id[a] : cut->mesh.id[v];
    for (int n = 0; n < 2; n++)
        cut->birth[change->born_count++] = (NodeBirth){2 * row + n, {2 * a + n, 2 * b + n}};
}

static void place_row(PlaneModel *model, int v, int row)
{
    const PlaneCut *cut = model->cut;
    for (int d = 0; d < 2; d++)
        model->vertices.rows.place[row][d] =
            cut->forms.size * (cut->mesh.point[v][d] - 0.5 * cut->layout.lattice_count[d]);
}

// Rows of all vertices of the mesh by their ids; new ones at the end.
static void take_rows(PlaneModel *model, TopologyChange *change)
{
    PlaneCut *cut = model->cut;
    Vertices *vertices = &model->vertices;
    int used = vertices->count;
    for (int v = 0; v < cut->mesh.vertex_count; v++) {
        int *row = &cut->row_of_id[cut->mesh.id[v]];
        if (*row < 0) {
            ASSERT(used < cut->vertex_capacity);
            *row = used++;
            cut->id[*row] = cut->mesh.id[v];
            place_row(model, v, *row);
            bear(model, v, *row, change);
        }
        cut->row_of[v] = *row;
        cut->piece[*row] = cut->mesh.piece[v];
    }
    vertices_set_count(vertices, used);
    for (int e = 0; e < cut->layout.element_count; e++)
        for (int p = 0; p < PLANE_PLACES; p++)
            cut->vertex[e][p] =
                cut->mesh.vertex[e][p] < 0 ? -1 : cut->row_of[cut->mesh.vertex[e][p]];
}

// ---------------------------------------------------------------------------------------------
// Masses and momentum

static void make_forms(PlaneModel *model)
{
    PlaneCut *cut = model->cut;
    model->element_count = 0;
    memset(model->element_at_level, 0, sizeof model->element_at_level);
    for (int e = 0; e < cut->layout.element_count; e++) {
        const PlaneElement *element = &cut->layout.element[e];
        if (element->quarters == 0)
            continue;
        model->element_at_level[element->level]++;
        plane_form_set(&cut->forms, &model->form[model->element_count++], element, cut->vertex[e]);
    }
}

static void make_masses(PlaneModel *model)
{
    PlaneCut *cut = model->cut;
    Vertices *vertices = &model->vertices;
    for (int v = 0; v < vertices->count; v++)
        vertices->mass[v] = 0.0;
    for (int k = 0; k < model->element_count; k++) {
        const PlaneForm *form = &model->form[k];
        const double mass = plane_form_mass(&cut->forms, form);
        for (int i = 0; i < form->shape->count; i++)
            vertices->mass[form->vertex[i]] += form->shape->share[i] * mass;
    }
    for (int v = 0; v < vertices->count; v++)
        vertices_put_mass(vertices, v, vertices->mass[v],
                          cut->fixed_point[cut->id[v] % cut->points]);
}

// In the plane, of the vertices whose mass has changed; masses before or now.
typedef struct PlaneMotion {
    double mass, at[2], momentum[2], spin, inertia;
} PlaneMotion;

static PlaneMotion motion_of(const PlaneModel *model, const double *mass, const double about[2])
{
    const Vertices *vertices = &model->vertices;
    const void *present = vertices_row(vertices);
    PlaneMotion sum = {.mass = 0.0};
    for (int v = 0; v < vertices->count; v++) {
        if (vertices->mass[v] == model->cut->mass_before[v] || vertices_is_fixed(vertices, v))
            continue;
        double x[2], u[2];
        for (int d = 0; d < 2; d++) {
            x[d] = vertices->rows.place[v][d] +
                   rows_get(&vertices->rows, present, (long)v * ROW + d) - about[d];
            u[d] = rows_get(&vertices->rows, present, (long)v * ROW + 4 + d);
        }
        sum.mass += mass[v];
        for (int d = 0; d < 2; d++) {
            sum.at[d] += mass[v] * x[d];
            sum.momentum[d] += mass[v] * u[d];
        }
        sum.spin += mass[v] * (x[0] * u[1] - x[1] * u[0]);
        sum.inertia += mass[v] * (x[0] * x[0] + x[1] * x[1]);
    }
    return sum;
}

// Masses have changed hands: a rigid motion of those concerned gives back what momentum that cost.
static void keep_momentum(PlaneModel *model)
{
    PlaneCut *cut = model->cut;
    Vertices *vertices = &model->vertices;
    const double origin[2] = {0.0, 0.0};
    PlaneMotion now = motion_of(model, vertices->mass, origin);
    if (!(now.mass > 0.0))
        return;
    const double about[2] = {now.at[0] / now.mass, now.at[1] / now.mass};
    const PlaneMotion before = motion_of(model, cut->mass_before, about);
    now = motion_of(model, vertices->mass, about);
    const double dv[2] = {(before.momentum[0] - now.momentum[0]) / now.mass,
                          (before.momentum[1] - now.momentum[1]) / now.mass};
    const double turn = now.inertia > 0.0 ? (before.spin - now.spin) / now.inertia : 0.0;
    void *present = vertices->row[vertices->current];
    for (int v = 0; v < vertices->count; v++) {
        if (vertices->mass[v] == cut->mass_before[v] || vertices_is_fixed(vertices, v))
            continue;
        double x[2];
        for (int d = 0; d < 2; d++)
            x[d] = vertices->rows.place[v][d] +
                   rows_get(&vertices->rows, present, (long)v * ROW + d) - about[d];
        const double add[2] = {dv[0] - turn * x[1], dv[1] + turn * x[0]};
        for (int d = 0; d < 2; d++) {
            long at = (long)v * ROW + 4 + d;
            rows_put(&vertices->rows, present, at, rows_get(&vertices->rows, present, at) + add[d]);
        }
    }
}

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

// The mesh of the bits as they are now; false: it has more vertices than there is room for.
static bool fill_mesh(PlaneCut *cut)
{
    plane_mesh_fill(&cut->mesh, &cut->room, &cut->layout, cut->broken);
    return cut->mesh.vertex_count <= cut->vertex_capacity;
}

// Everything that follows from the mesh, without what moves.
static void make_anew(PlaneModel *model, Body *body, TopologyChange *change)
{
    take_rows(model, change);
    make_forms(model);
    make_masses(model);
    plane_fill_batches(model);
    model->vertices.present = model->vertices.row[model->vertices.current];
    body->element_count = model->element_count;
    plane_cut_show(model, body);
}

void plane_cut_make(PlaneModel *model, Body *body)
{
    fill_mesh(model->cut);
    TopologyChange none = {.born = model->cut->birth};
    make_anew(model, body, &none);
}

void plane_cut_count_pieces(PlaneCut *cut, CutOutcome *outcome)
{
    int pieces = 0;
    for (int v = 0; v < cut->mesh.vertex_count; v++)
        pieces = cut->mesh.piece[v] >= pieces ? cut->mesh.piece[v] + 1 : pieces;
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
    outcome->pieces = pieces;
    outcome->small_pieces = 0;
    for (int k = 0; k < pieces; k++)
        outcome->small_pieces += cells[k] < 4;
}

bool plane_cut_break(Body *body, const int (*edge)[2], int count, CutOutcome *outcome,
                     TopologyChange *change)
{
    PlaneModel *model = body->model;
    PlaneCut *cut = model->cut;
    const int before = model->vertices.count;
    begin(model, change);
    for (int k = 0; k < count; k++)
        cut->broken[edge[k][0]] |= (unsigned char)edge[k][1];
    if (!fill_mesh(cut)) {
        outcome->verdict = CUT_NO_NODES;
        outcome->needed = cut->mesh.vertex_count - before;
        outcome->room = cut->vertex_capacity - before;
        for (int k = 0; k < count; k++)
            cut->broken[edge[k][0]] &= (unsigned char)~edge[k][1];
        fill_mesh(cut);
        return false;
    }
    make_anew(model, body, change);
    keep_momentum(model);
    *cut->wants = 1;
    outcome->separated += count;
    outcome->nodes_added += model->vertices.count - before;
    return true;
}

// ---------------------------------------------------------------------------------------------
// Reconstruction

// Whether an edge is broken inside a square or on its outline.
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

// Whether an element two levels below lies along a quarter's edges towards the rest of its square:
// where another quarter was carved, and then that. Fig. 7 (b) has the four along the outer edges;
// without these four elements beside each other would differ by two levels.
static bool is_finer_inside(const PlaneCut *cut, const PlaneElement *own, int quarter)
{
    const int half = 1 << (own->level - 1), x = quarter & 1, y = quarter >> 1;
    const int i = own->cell[0] + x * half, j = own->cell[1] + y * half;
    for (int k = 0; k < 2 && own->level >= 2; k++) {
        const int along = k == 0 ? 0 : half / 2;
        const int beside[2] = {plane_layout_at(&cut->layout, x ? i - 1 : i + half, j + along),
                               plane_layout_at(&cut->layout, i + along, y ? j - 1 : j + half)};
        for (int d = 0; d < 2; d++)
            if (beside[d] >= 0 && cut->layout.element[beside[d]].level + 2 <= own->level)
                return true;
    }
    return false;
}

// Fig. 7 of the paper; and what a blade has cut through, which the paper has not: its edges break
// between elements only.
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
        int e = cut->layout.lut[level][((own->cell[1] >> level) + (q >> 1)) * wide +
                                       (own->cell[0] >> level) + (q & 1)];
        ASSERT(cut->layout.element[e].cell[0] == own->cell[0] + (q & 1) * half);
        cut->quarters[e] = cut->layout.element[e].quarters = PLANE_WHOLE;
    }
    own->quarters &= (unsigned char)~carved;
    cut->quarters[element] = own->quarters;
}

// Squares by ascending size, so that all below are done before (section 3.2, phase 1); what comes
// is looked at again in the next tick.
bool plane_cut_reconstruct(Body *body, TopologyChange *change)
{
    PlaneModel *model = body->model;
    PlaneCut *cut = model->cut;
    if (*cut->wants == 0)
        return false;
    *cut->wants = 0;
    begin(model, change);
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
    if (!fill_mesh(cut)) { // they stay coarse, all: half of them would be levels apart
        for (int e = 0; e < cut->layout.element_count; e++)
            cut->layout.element[e].quarters = cut->quarters[e] = cut->quarters_before[e];
        fill_mesh(cut);
        return false;
    }
    make_anew(model, body, change);
    keep_momentum(model);
    *cut->wants = 1;
    return true;
}

// ---------------------------------------------------------------------------------------------
// Out of a checkpoint

// A quarter belongs to one element over each solid cell, and no other.
static bool covers_each_cell_once(const PlaneCut *cut)
{
    for (int j = 0; j < cut->layout.count[1]; j++)
        for (int i = 0; i < cut->layout.count[0]; i++) {
            int over = 0;
            for (int level = 0; level <= cut->layout.levels; level++) {
                int e =
                    cut->layout
                        .lut[level][(j >> level) * (cut->layout.count[0] >> level) + (i >> level)];
                int q = level == 0 ? 0 : (i >> (level - 1) & 1) + 2 * (j >> (level - 1) & 1);
                over += cut->quarters[e] >> q & 1;
            }
            if (over != cut->is_solid[j * cut->layout.count[0] + i])
                return false;
        }
    return true;
}

static bool quarters_can_be(const PlaneCut *cut)
{
    for (int e = 0; e < cut->layout.element_count; e++) {
        const unsigned quarters = cut->quarters[e], level = cut->layout.element[e].level;
        if (quarters > PLANE_WHOLE || quarters == 6 || quarters == 9 ||
            (level == 0 && quarters != 0 && quarters != PLANE_WHOLE))
            return false;
    }
    return true;
}

static bool levels_can_be(const PlaneCut *cut)
{
    for (int j = 0; j < cut->layout.count[1]; j++)
        for (int i = 0; i < cut->layout.count[0]; i++) {
            const int own = plane_layout_at(&cut->layout, i, j);
            const int beside[2] = {plane_layout_at(&cut->layout, i + 1, j),
                                   plane_layout_at(&cut->layout, i, j + 1)};
            for (int k = 0; k < 2 && own >= 0; k++) {
                if (beside[k] < 0)
                    continue;
                int a = cut->layout.element[own].level, b = cut->layout.element[beside[k]].level;
                if (a - b > 1 || b - a > 1)
                    return false;
            }
        }
    return true;
}

static bool ids_can_be(const PlaneModel *model)
{
    const PlaneCut *cut = model->cut;
    int count = 0;
    for (int k = 0; k < 4 * cut->points; k++)
        cut->row_of_id[k] = -1;
    for (int v = 0; v < cut->vertex_capacity; v++) {
        int id = cut->id[v];
        if (id < -1 || id >= 4 * cut->points || (id >= 0 && v != count))
            return false;
        if (id < 0)
            continue;
        if (cut->row_of_id[id] >= 0 || cut->origin_id[v] < 0 ||
            cut->origin_id[v] >= 4 * cut->points)
            return false;
        cut->row_of_id[id] = count++;
    }
    return true;
}

// Whether the vertices that follow from the bits are those of the ids, all of them.
static bool vertices_are_there(const PlaneCut *cut)
{
    int count = 0;
    for (int v = 0; v < cut->vertex_capacity; v++)
        count += cut->id[v] >= 0;
    for (int v = 0; v < cut->mesh.vertex_count; v++)
        if (cut->row_of_id[cut->mesh.id[v]] < 0)
            return false;
    return count == cut->mesh.vertex_count;
}

bool plane_cut_restore(Body *body)
{
    PlaneModel *model = body->model;
    PlaneCut *cut = model->cut;
    if (!quarters_can_be(cut) || !covers_each_cell_once(cut) || !ids_can_be(model))
        return false;
    for (int e = 0; e < cut->layout.element_count; e++)
        cut->layout.element[e].quarters = cut->quarters[e];
    if (!levels_can_be(cut))
        return false;
    if (!fill_mesh(cut) || !vertices_are_there(cut))
        return false;
    int count = 0;
    while (count < cut->vertex_capacity && cut->id[count] >= 0)
        count++;
    vertices_set_count(&model->vertices, count);
    for (int v = 0; v < cut->mesh.vertex_count; v++)
        place_row(model, v, cut->row_of_id[cut->mesh.id[v]]);
    plane_cut_make(model, body);
    return true;
}
