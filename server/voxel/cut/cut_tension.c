// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_tension.h"

#include "voxel/lattice_faces.h"

#include <math.h>
#include <string.h>

// Cells between two points of a fibre. A fibre without points between its ends is a string: it
// bends a slender flap like a bow (Euler: at 12 (stress/E) (length/thickness)^2 > pi^2). With
// points at most 2 cells apart that takes a stress of 0.2 E even in a flap of one cell.
enum { SPACING = 1 };
// A fibre's pull falls where it is shorter than this share of its length at rest, so that it has a
// direction, and a bounded stiffness, down to the length 0.
static const double SOFT = 0.25;

// ---------------------------------------------------------------------------------------------
// Fibres

// A fibre that is being traced, in cells.
typedef struct Trace {
    int cell[3], id;
    double at[3], direction[3];
    double length, pull;           // of the present segment; pull: stress [Pa] times length
    double last_length, last_pull; // of the one before it
    int points;
} Trace;

// Returns the stress of a material along a direction [Pa].
static double stress_along(const CutTension *tension, int material, const double direction[3])
{
    const Vec3 *of = &tension->direction[material - 1];
    const double along = of->x * direction[0] + of->y * direction[1] + of->z * direction[2];
    const bool all = of->x == 0.0 && of->y == 0.0 && of->z == 0.0;
    return tension->stress[material - 1] * (all ? 1.0 : along * along);
}

// Puts a point on the face of a cell, a leaf, where the trace is.
static void put_point(CutTension *tension, Trace *trace, int cell, int direction)
{
    TensionPoint *to = &tension->point[tension->count++];
    const CutLattice *lattice = tension->faces->lattice;
    const int *low = lattice->element[cell].cell, *corner = SQUARE_CORNER[direction];
    double share[3] = {0.0, 0.0, 0.0};
    // Where it is within the face, rounded so that weights are exact.
    for (int k = 0; k < 3; k++)
        share[k] = rint(1024.0 * fmin(fmax(trace->at[k] - low[k], 0.0), 1.0)) / 1024.0;
    for (int c = 0; c < 4; c++) {
        double weight = 1.0;
        for (int k = 0; k < 3; k++)
            if (k != direction / 2)
                weight *= corner[c] >> k & 1 ? share[k] : 1.0 - share[k];
        to->vertex[c] = lattice->corner[cell][corner[c]];
        to->weight[c] = (float)weight;
    }
    to->pull = 0.0;
    trace->points++;
}

// Ends a segment at the last point.
static void end_segment(CutTension *tension, Trace *trace, double area)
{
    TensionPoint *from = &tension->point[tension->count - 2];
    const double(*rest)[3] = (const double(*)[3])tension->vertices->rows.rest;
    // Between the rounded points: a force off their line would have a moment.
    for (int k = 0; k < 3; k++) {
        from->along[k] = 0.0;
        for (int c = 0; c < 4; c++)
            from->along[k] += (double)from[1].weight[c] * rest[from[1].vertex[c]][k] -
                              (double)from->weight[c] * rest[from->vertex[c]][k];
    }
    from->pull = area * trace->pull / trace->length;
    trace->last_length = trace->length, trace->last_pull = trace->pull;
    trace->length = trace->pull = 0.0;
}

// Moves to the next face; returns its direction.
static int advance(const CutTension *tension, Trace *trace)
{
    double nearest = (double)INFINITY;
    int axis = 0;
    for (int k = 0; k < 3; k++) {
        const double d = trace->direction[k];
        if (d == 0.0)
            continue;
        const double way = fmax(0.0, (trace->cell[k] + (d > 0.0) - trace->at[k]) / d);
        if (way < nearest)
            nearest = way, axis = k;
    }
    const bool up = trace->direction[axis] > 0.0;
    for (int k = 0; k < 3; k++)
        trace->at[k] += nearest * trace->direction[k];
    trace->at[axis] = trace->cell[axis] + up;
    trace->length += nearest;
    const int material = tension->faces->lattice->element[trace->id].material;
    trace->pull += nearest * stress_along(tension, material, trace->direction);
    return 2 * axis + up;
}

// True if all corners of a face of a leaf are fixed.
static bool is_fixed(const CutTension *tension, int cell, int direction)
{
    bool fixed = true;
    for (int c = 0; c < 4; c++)
        fixed &= vertices_is_fixed(
            tension->vertices, tension->faces->lattice->corner[cell][SQUARE_CORNER[direction][c]]);
    return fixed;
}

// Sets out from a square. Returns the area that the fibre stands for [m2], 0: there is none.
static double set_out(const CutTension *tension, int square, Trace *trace)
{
    const CutLattice *lattice = tension->faces->lattice;
    const int code = tension->faces->square[square], side = code % SQUARE_DIRECTIONS;
    const int axis = side / 2, up = side % 2;
    *trace = (Trace){.id = code / SQUARE_DIRECTIONS};
    const CutElement *element = &lattice->element[trace->id];
    const Vec3 *along = &tension->direction[element->material - 1];
    const double to[3] = {along->x, along->y, along->z};
    const double sign = (up ? -1.0 : 1.0) * (to[axis] < 0.0 ? -1.0 : 1.0);
    const bool all = to[0] == 0.0 && to[1] == 0.0 && to[2] == 0.0;
    for (int k = 0; k < 3; k++) {
        trace->cell[k] = element->cell[k];
        trace->at[k] = element->cell[k] + (k == axis ? up : 0.5);
        trace->direction[k] = all ? sign * (k == axis) : sign * to[k];
    }
    // Fibres along the face do not cross it.
    const double flux = fabs(trace->direction[axis]);
    return flux < 0.01 ? 0.0 : flux * tension->size * tension->size;
}

// Follows a fibre from a square to its other end. False: no room.
static bool trace_fibre(CutTension *tension, int square, int spacing)
{
    const CutLattice *lattice = tension->faces->lattice;
    Trace trace;
    const int first = tension->count;
    const double area = set_out(tension, square, &trace);
    double whole = 0.0;
    if (area == 0.0)
        return true;
    if (tension->count + 2 > tension->capacity)
        return false;
    put_point(tension, &trace, trace.id, tension->faces->square[square] % SQUARE_DIRECTIONS);
    for (bool ended = false; !ended;) {
        const int face = advance(tension, &trace), axis = face / 2, up = face % 2;
        trace.cell[axis] += up ? 1 : -1;
        const int next = cut_lattice_cell(lattice, trace.cell[0], trace.cell[1], trace.cell[2]);
        const bool leaf = cut_lattice_is_leaf(lattice, trace.id);
        const bool open = next >= 0 && cut_lattice_is_open(lattice, up ? trace.id : next, axis);
        ended = next < 0 || open || (leaf && is_fixed(tension, trace.id, face));
        const bool beyond = next >= 0 && cut_lattice_is_leaf(lattice, next);
        // Outside of finest cells there is no face to hold a point.
        if ((ended || trace.length >= spacing) && (leaf || beyond)) {
            if (tension->count == tension->capacity)
                return false;
            whole += trace.length;
            // The last segment is at least a cell long.
            if (ended && trace.length < 1.0 && trace.points > 1) {
                tension->count--, trace.points--;
                trace.length += trace.last_length, trace.pull += trace.last_pull;
            }
            put_point(tension, &trace, leaf ? trace.id : next, leaf ? face : face ^ 1);
            end_segment(tension, &trace, area);
            // Between two cuts the fibres of both sides take half of the tension each.
            if (open)
                for (int p = first; p < tension->count; p++)
                    tension->point[p].pull *= 0.5;
        }
        trace.id = next;
    }
    // One that only grazes the body is too short to pull.
    if (whole < 0.5)
        tension->count = first;
    return true;
}

void cut_tension_follow(CutTension *tension)
{
    const CutFaces *faces = tension->faces;
    // Where there is no room for all points, fewer on each; two always fit.
    bool fits = false;
    for (int spacing = SPACING; !fits; spacing *= 2) {
        tension->count = 0;
        fits = true;
        for (int s = faces->outer_squares; s < *faces->shown && fits; s++)
            fits = trace_fibre(tension, s, spacing);
    }
}

// ---------------------------------------------------------------------------------------------
// Forces

// Returns the displacement of a point [m].
static inline Vec3 shift_of(const TensionPoint *point, const void *rows, bool single)
{
    double u[3] = {0.0, 0.0, 0.0};
    for (int c = 0; c < 4; c++)
        for (int k = 0; k < 3; k++) {
            const long at = (long)point->vertex[c] * ROW + k;
            u[k] += (double)point->weight[c] *
                    (single ? (double)((const float *)rows)[at] : ((const double *)rows)[at]);
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
            here = shift_of(point, rows, single);
        if (p + 1 < tension->count)
            next = shift_of(point + 1, rows, single);
        if (point->pull > 0.0)
            segment(point, vec3_sub(next, here), &pull);
        pull = vec3_scale(scale, pull);
        add_force(point, force, vec3_sub(pull, before), single);
        before = pull, here = next;
    }
}

void cut_tension_add_forces(const CutTension *tension, const void *rows, void *force, double scale)
{
    if (tension->vertices->rows.precision == PRECISION_SINGLE)
        add_forces(tension, rows, force, scale, true);
    else
        add_forces(tension, rows, force, scale, false);
}

double cut_tension_energy(const CutTension *tension, const void *rows, double scale)
{
    const bool single = tension->vertices->rows.precision == PRECISION_SINGLE;
    double energy = 0.0;
    for (int p = 0; p < tension->count; p++) {
        const TensionPoint *point = &tension->point[p];
        Vec3 force;
        if (point->pull > 0.0)
            energy += segment(
                point, vec3_sub(shift_of(point + 1, rows, single), shift_of(point, rows, single)),
                &force);
    }
    return scale * energy;
}

void cut_tension_add_stress(const CutTension *tension, int material, double scale,
                            const double (*rotation)[3], double (*stress)[3])
{
    const Vec3 *of = &tension->direction[material - 1];
    const double p = scale * tension->stress[material - 1], a[3] = {of->x, of->y, of->z};
    const bool all = a[0] == 0.0 && a[1] == 0.0 && a[2] == 0.0;
    for (int i = 0; i < 3; i++) {
        const double along = rotation[i][0] * a[0] + rotation[i][1] * a[1] + rotation[i][2] * a[2];
        for (int k = 0; k < 3; k++)
            stress[i][k] += p * (all ? rotation[i][k] : along * a[k]);
    }
}

// ---------------------------------------------------------------------------------------------

CutTension *cut_tension_create(const CutFaces *faces, const VoxelMaking *making, Arena *arena)
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
    Vec3 *direction = ALLOCATE(ARENA_STEP, materials, Vec3, "directions of tension");
    for (int m = 0; m < materials; m++) {
        const Vec3 axis = options->material[m].prestress_axis;
        const double length = vec3_length(axis);
        stress[m] = options->material[m].prestress;
        if (length > 0.0)
            direction[m] =
                quat_rotate(quat_conjugate(options->lattice->turn), vec3_scale(1.0 / length, axis));
    }
    // Ends of all fibres, and points between them.
    const int squares = faces->square_capacity - faces->outer_squares;
    *tension = (CutTension){.faces = faces,
                            .vertices = faces->vertices,
                            .size = options->lattice->size,
                            .material_count = materials,
                            .stress = stress,
                            .direction = direction,
                            .most = most,
                            .capacity = 2 * squares + faces->cell_count};
    tension->point = ALLOCATE(ARENA_STEP, tension->capacity, TensionPoint, "fibres under tension");
    return tension;
}
