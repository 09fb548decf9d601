// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_tension.h"

#include "voxel/cut/cut_parts.h"
#include "voxel/lattice_faces.h"

#include <math.h>
#include <string.h>

// A fibre's pull falls where it is shorter than this share of its length at rest, so that it has a
// direction, and a bounded stiffness, down to the length 0.
static const double SOFT = 0.25;
// A fibre that only grazes the body is too short to pull [cells].
static const double SHORTEST = 0.5;

// ---------------------------------------------------------------------------------------------
// Fibres

// Where a fibre that is being traced is: lengths in cells.
typedef struct Trace {
    int leaf, cell[3];         // which it is about to leave
    double start[3], along[3]; // along: unit
    double way, next[3],
        step[3];   // from the start; to the next planes along each axis; between them
    int material;  // whose stress is
    double stress; // along the fibre [Pa]
    // The present segment and the one before it: since when, where, and stress times length.
    double since[2], from[2][3], pull[2];
    int points;
} Trace;

// Returns the stress of a material along a direction [Pa].
static double stress_along(const CutTension *tension, int material, const double along[3])
{
    const double *of = tension->direction[material - 1];
    const double part = of[0] * along[0] + of[1] * along[1] + of[2] * along[2];
    return tension->stress[material - 1] * (tension->all[material - 1] ? 1.0 : part * part);
}

// Sets out from a square into the tissue. Returns the area that the fibre stands for [m2]; 0: it
// runs along the square.
static double set_out(const CutTension *tension, int square, Trace *trace)
{
    const CutLattice *lattice = tension->faces->lattice;
    const int code = tension->faces->square[square], side = code % SQUARE_DIRECTIONS;
    const int axis = side / 2, up = side % 2;
    *trace = (Trace){.leaf = code / SQUARE_DIRECTIONS};
    const CutElement *element = &lattice->element[trace->leaf];
    const double *to = tension->direction[element->material - 1];
    const bool all = tension->all[element->material - 1];
    const double sign = up == (to[axis] > 0.0) ? -1.0 : 1.0;
    cut_lattice_place(lattice, trace->leaf, trace->cell);
    // The planes that it will cross.
    for (int k = 0; k < 3; k++) {
        trace->start[k] = trace->cell[k] + (k == axis ? up : 0.5);
        trace->along[k] = all ? (k == axis) * (up ? -1.0 : 1.0) : sign * to[k];
        const bool crosses = fabs(trace->along[k]) > 1e-9;
        trace->step[k] = crosses ? 1.0 / fabs(trace->along[k]) : (double)INFINITY;
        trace->next[k] = crosses ? trace->step[k] * (k == axis ? 1.0 : 0.5) : (double)INFINITY;
    }
    const double flux = fabs(trace->along[axis]);
    return flux < 0.01 ? 0.0 : flux * tension->size * tension->size;
}

// Puts a point where the fibre crosses a face of a finest cell at a position.
static void put_point(CutTension *tension, Trace *trace, int leaf, const int cell[3], int face)
{
    TensionPoint *to = &tension->point[tension->count++];
    const int *corner = SQUARE_CORNER[face];
    const int axis = face / 2;
    double share[3], *from = trace->from[0];
    // Where it is within the face, rounded so that weights are exact.
    for (int k = 0; k < 3; k++) {
        const double at = trace->start[k] + trace->way * trace->along[k] - cell[k];
        share[k] = k == axis ? face % 2 : rint(1024.0 * fmin(fmax(at, 0.0), 1.0)) / 1024.0;
        from[k] = cell[k] + share[k];
    }
    share[axis] = 1.0;
    for (int c = 0; c < 4; c++) {
        double weight = 1.0;
        for (int k = 0; k < 3; k++)
            weight *= k == axis || (corner[c] >> k & 1) ? share[k] : 1.0 - share[k];
        to->vertex[c] = cut_carry_corner(tension->faces->lattice, leaf, corner[c]);
        to->weight[c] = (float)weight;
    }
    to->pull = 0.0;
    trace->points++;
}

// Moves to the next face; returns its direction. `cell` then is beyond it.
static int advance(const CutTension *tension, Trace *trace)
{
    const CutLattice *lattice = tension->faces->lattice;
    const double *next = trace->next;
    const int axis =
        next[0] <= next[1] ? (next[0] <= next[2] ? 0 : 2) : (next[1] <= next[2] ? 1 : 2);
    const int up = trace->along[axis] > 0.0, material = lattice->element[trace->leaf].material;
    if (material != trace->material) {
        trace->material = material;
        trace->stress = stress_along(tension, material, trace->along);
    }
    trace->pull[0] += (next[axis] - trace->way) * trace->stress;
    trace->way = next[axis];
    trace->next[axis] += trace->step[axis];
    // One cell along the axis.
    trace->cell[axis] += up ? 1 : -1;
    return 2 * axis + up;
}

static bool is_fixed(const CutTension *tension, int leaf, int face)
{
    const int *vertex = cut_lattice_nodes(tension->faces->lattice, leaf),
              *corner = SQUARE_CORNER[face];
    const Vertices *vertices = tension->vertices;
    return vertices_is_fixed(vertices, vertex[corner[0]]) &&
           vertices_is_fixed(vertices, vertex[corner[1]]) &&
           vertices_is_fixed(vertices, vertex[corner[2]]) &&
           vertices_is_fixed(vertices, vertex[corner[3]]);
}

// Ends the present segment at the point put last.
static void end_segment(CutTension *tension, Trace *trace, const double from[3], double area)
{
    TensionPoint *begin = &tension->point[tension->count - 2];
    // Between the rounded points: a force off their line would have a moment.
    for (int k = 0; k < 3; k++)
        begin->along[k] = tension->size * (trace->from[0][k] - from[k]);
    begin->pull = area * trace->pull[0] / (trace->way - trace->since[0]);
}

// Follows a fibre from a square to its other end. False: no room.
static bool trace_fibre(CutTension *tension, int square, int spacing)
{
    const CutLattice *lattice = tension->faces->lattice;
    const int cells = lattice->level_first[1], first = tension->count;
    Trace trace;
    const double area = set_out(tension, square, &trace);
    if (area == 0.0)
        return true;
    if (tension->count + 2 > tension->capacity)
        return false;
    put_point(tension, &trace, trace.leaf, trace.cell,
              tension->faces->square[square] % SQUARE_DIRECTIONS);
    for (bool ended = false; !ended;) {
        int here[3];
        memcpy(here, trace.cell, sizeof here);
        const int face = advance(tension, &trace), leaf = trace.leaf;
        int next = cut_parts_leaf_at(lattice, trace.cell[0], trace.cell[1], trace.cell[2]);
        if (next >= cells &&
            cut_lattice_cell(lattice, trace.cell[0], trace.cell[1], trace.cell[2]) < 0)
            next = -1; // void in a partly filled leaf
        const bool near = leaf < cells, far = next >= 0 && next < cells;
        const bool open = near && far && (lattice->broken[face % 2 ? leaf : next] >> face / 2 & 1);
        ended = next < 0 || open || (near && is_fixed(tension, leaf, face));
        trace.leaf = next;
        // Outside of finest cells there is no face to hold a point, but for that to void.
        const double length = trace.way - trace.since[0];
        if (!(ended || length >= spacing) || !(near || far || ended))
            continue;
        if (tension->count == tension->capacity)
            return false;
        // The last segment is at least a cell long.
        const bool joins = ended && length < 1.0 && trace.points > 1;
        double from[3];
        memcpy(from, trace.from[joins], sizeof from);
        if (joins) {
            tension->count--;
            trace.pull[0] += trace.pull[1], trace.since[0] = trace.since[1];
        }
        memcpy(trace.from[1], from, sizeof from);
        if (near || far)
            put_point(tension, &trace, near ? leaf : next, near ? here : trace.cell,
                      near ? face : face ^ 1);
        else
            put_point(tension, &trace, cut_lattice_cell(lattice, here[0], here[1], here[2]), here,
                      face);
        end_segment(tension, &trace, from, area);
        trace.pull[1] = trace.pull[0], trace.since[1] = trace.since[0];
        trace.pull[0] = 0.0, trace.since[0] = trace.way;
        // Between two cuts the fibres of both sides take half of the tension each.
        for (int p = first; open && p < tension->count; p++)
            tension->point[p].pull *= 0.5;
    }
    if (trace.way < SHORTEST)
        tension->count = first;
    return true;
}

void cut_tension_follow(CutTension *tension)
{
    const CutFaces *faces = tension->faces;
    // Where there is no room for all points, fewer on each; two always fit.
    bool fits = false;
    for (int spacing = tension->spacing; !fits; spacing *= 2) {
        tension->count = 0;
        fits = true;
        for (int s = faces->outer_squares; s < *faces->shown && fits; s++)
            fits = faces->square[s] < 0 || trace_fibre(tension, s, spacing); // free, or its fibre
    }
    tension->carried_count = 0;
    for (int p = 0; p < tension->count && tension->carry != NULL; p++)
        for (int c = 0; c < 4; c++)
            if (cut_lattice_is_carried(faces->lattice, tension->point[p].vertex[c]))
                tension->carried[tension->carried_count++] = tension->point[p].vertex[c];
    if (tension->carry != NULL)
        tension->leaf_count =
            cut_carry_list(tension->carry, tension->carried, tension->carried_count, tension->leaf);
}

// ---------------------------------------------------------------------------------------------
// Forces

// Returns the displacement of a point [m].
static inline Vec3 shift_of(const CutTension *tension, const TensionPoint *point, const void *row,
                            bool single)
{
    double u[3] = {0.0, 0.0, 0.0};
    for (int c = 0; c < 4; c++) {
        const void *rows = rows_of(&tension->vertices->rows, row, point->vertex[c]);
        for (int k = 0; k < 3; k++) {
            const long at = (long)point->vertex[c] * ROW + k;
            u[k] += (double)point->weight[c] *
                    (single ? (double)((const float *)rows)[at] : ((const double *)rows)[at]);
        }
    }
    return vec3(u[0], u[1], u[2]);
}

static inline void add_force(const TensionPoint *point, void *force, Vec3 f, bool single)
{
    const double part[3] = {f.x, f.y, f.z};
    for (int c = 0; c < 4; c++)
        for (int k = 0; k < 3; k++) {
            const long at = 4L * point->vertex[c] + k;
            if (single)
                ((float *)force)[at] += (float)((double)point->weight[c] * part[k]);
            else
                ((double *)force)[at] += (double)point->weight[c] * part[k];
        }
}

// A segment with s between its points and s0 at rest has the potential
// pull sqrt(1 + SOFT^2) (sqrt(s^2 + (SOFT s0)^2) - sqrt(s0^2 + (SOFT s0)^2)), whose slope at rest
// is the pull.
static inline double segment(const TensionPoint *point, Vec3 shift, Vec3 *force)
{
    const Vec3 rest = {point->along[0], point->along[1], point->along[2]};
    const Vec3 s = vec3_add(rest, shift);
    const double square = vec3_dot(rest, rest), soft = SOFT * SOFT * square;
    const double now = sqrt(vec3_dot(s, s) + soft), pull = sqrt(1.0 + SOFT * SOFT) * point->pull;
    *force = vec3_scale(pull / now, s);
    return pull * (now - sqrt(square + soft));
}

static inline void add_forces(const CutTension *tension, const void *rows, void *force,
                              double scale, bool single)
{
    Vec3 before = {0.0, 0.0, 0.0}, here = {0.0, 0.0, 0.0};
    for (int p = 0; p < tension->count; p++) {
        const TensionPoint *point = &tension->point[p];
        Vec3 pull = {0.0, 0.0, 0.0}, next = {0.0, 0.0, 0.0};
        if (p == 0)
            here = shift_of(tension, point, rows, single);
        if (p + 1 < tension->count)
            next = shift_of(tension, point + 1, rows, single);
        if (point->pull > 0.0)
            segment(point, vec3_sub(next, here), &pull);
        pull = vec3_scale(scale, pull);
        add_force(point, force, vec3_sub(pull, before), single);
        before = pull, here = next;
    }
}

void cut_tension_add_forces(const CutTension *tension, const void *rows, void *force, double scale)
{
    if (tension->carry != NULL)
        cut_carry_update_some(tension->carry, rows, tension->leaf, tension->leaf_count);
    if (tension->vertices->rows.precision == PRECISION_SINGLE)
        add_forces(tension, rows, force, scale, true);
    else
        add_forces(tension, rows, force, scale, false);
    if (tension->carry != NULL)
        cut_carry_spread(tension->carry, force, tension->carried, tension->carried_count);
}

double cut_tension_energy(const CutTension *tension, const void *rows, double scale)
{
    const bool single = tension->vertices->rows.precision == PRECISION_SINGLE;
    double energy = 0.0;
    if (tension->carry != NULL)
        cut_carry_update_some(tension->carry, rows, tension->leaf, tension->leaf_count);
    for (int p = 0; p < tension->count; p++) {
        const TensionPoint *point = &tension->point[p];
        Vec3 force;
        if (point->pull > 0.0)
            energy += segment(point,
                              vec3_sub(shift_of(tension, point + 1, rows, single),
                                       shift_of(tension, point, rows, single)),
                              &force);
    }
    return scale * energy;
}

void cut_tension_add_stress(const CutTension *tension, int material, double scale,
                            const double (*rotation)[3], double (*stress)[3])
{
    const double *a = tension->direction[material - 1];
    const double p = scale * tension->stress[material - 1];
    const bool all = tension->all[material - 1];
    for (int i = 0; i < 3; i++) {
        const double along = rotation[i][0] * a[0] + rotation[i][1] * a[1] + rotation[i][2] * a[2];
        for (int k = 0; k < 3; k++)
            stress[i][k] += p * (all ? rotation[i][k] : along * a[k]);
    }
}

// ---------------------------------------------------------------------------------------------

// Returns the most cells between two points of a fibre. One without points between its ends is a
// string, which bends a slender flap like a bow: a flap of one cell buckles between points s cells
// apart at stress / E = q / (1 + 2 q), q = pi^2 / (12 s^2) (Euler, with the flexibility in shear by
// Engesser). Half as much again for certainty.
static int choose_spacing(double strain)
{
    int spacing = 4;
    for (double q; spacing > 1; spacing--) {
        q = 9.8696 / (12.0 * spacing * spacing);
        if (q / (1.0 + 2.0 * q) >= 1.5 * strain)
            break;
    }
    return spacing;
}

CutTension *cut_tension_create(const CutFaces *faces, CutCarry *carry, const VoxelMaking *making,
                               Arena *arena)
{
    const VoxelOptions *options = making->options;
    const char *name = options->body.name;
    const int materials = options->material_count;
    double most = 0.0;
    for (int m = 0; m < materials; m++)
        most = fmax(most, options->material[m].prestress);
    if (most == 0.0)
        return NULL;
    CutTension *tension = ALLOCATE(ARENA_STEP, 1, CutTension, "tension");
    double *stress = ALLOCATE(ARENA_STEP, materials, double, "tensions");
    double(*direction)[3] = arena_allocate(arena, ARENA_STEP, (size_t)materials, sizeof *direction,
                                           "%s/directions of tension", name);
    bool *all = ALLOCATE(ARENA_STEP, materials, bool, "tensions without direction");
    double strain = 0.0;
    for (int m = 0; m < materials; m++) {
        const SolidMaterial *material = &options->material[m];
        const double length = vec3_length(material->prestress_axis);
        stress[m] = material->prestress;
        strain = fmax(strain, stress[m] / material->youngs_modulus);
        all[m] = !(length > 0.0);
        if (all[m])
            continue;
        const Vec3 unit = quat_rotate(quat_conjugate(options->lattice->turn),
                                      vec3_scale(1.0 / length, material->prestress_axis));
        direction[m][0] = unit.x, direction[m][1] = unit.y, direction[m][2] = unit.z;
    }
    // Room for the ends of all fibres and points between them; a step reads those there are.
    const int squares = faces->square_capacity - faces->outer_squares;
    *tension = (CutTension){.faces = faces,
                            .vertices = faces->vertices,
                            .carry = carry,
                            .size = options->lattice->size,
                            .spacing = choose_spacing(strain),
                            .stress = stress,
                            .direction = (const double(*)[3])direction,
                            .all = all,
                            .most = most,
                            .capacity = 2 * squares + faces->cell_count};
    tension->point =
        ALLOCATE(ARENA_TOPOLOGY, tension->capacity, TensionPoint, "fibres under tension");
    if (carry == NULL)
        return tension;
    tension->carried =
        ALLOCATE(ARENA_TOPOLOGY, 4L * tension->capacity, int, "carried ends of fibres");
    tension->leaf =
        ALLOCATE(ARENA_TOPOLOGY, 4L * tension->capacity, int, "elements of ends of fibres");
    return tension;
}
