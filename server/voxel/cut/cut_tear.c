// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_tear.h"

#include "voxel/barrier.h"
#include "voxel/cut/cut_parts.h"
#include "voxel/point_parts.h"
#include "voxel/rotation.h"
#include "voxel/stiffening.h"

#include <math.h>
#include <string.h>

static const double AWAY_FROM_FRONT = 1.5;

// Stress of one element, in the base frame.
typedef struct TearStress {
    int64_t look; // the search for which it is valid
    int element;
    double stress[3][3];   // P [Pa]
    double rotation[3][3]; // R
} TearStress;

enum { NEAR = 1024 }; // a power of two

void cut_tear_create(CutTear *tear, const VoxelOptions *options, const CutWindows *windows,
                     const Vertices *vertices, Arena *arena, StateList *state)
{
    const char *name = options->body.name;
    const CutLattice *lattice = windows->lattice;
    *tear = (CutTear){.lattice = lattice,
                      .windows = windows,
                      .vertices = vertices,
                      .law = options->law,
                      .stress = options->tear_stress,
                      .force = options->tear_force};
    const int cells = lattice->level_first[1];
    // The face of a coarsest element consists of this many; all faces are more than any tick can
    // tear.
    tear->hit_capacity = TEAR_FACES << 2 * lattice->levels;
    tear->hit = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)tear->hit_capacity, sizeof *tear->hit,
                               "%s/torn faces", name);
    tear->hit_bits = ALLOCATE(ARENA_TOPOLOGY, cells, unsigned char, "torn bits");
    // Tearing by stress examines a part of the body in each tick.
    if (tear->stress > 0.0) {
        const int batches = batch_runs_capacity(&windows->runs);
        tear->high = ALLOCATE(ARENA_TOPOLOGY, batches, uint16_t, "stressed lanes");
        tear->stressed = ALLOCATE(ARENA_TOPOLOGY, cells, int, "stressed elements");
        tear->is_looked_at =
            ALLOCATE(ARENA_TOPOLOGY, lattice->element_count, bool, "elements looked at");
        tear->next = ALLOCATE(ARENA_TOPOLOGY, 1, int64_t, "next to be looked at");
        state_add(state, tear->next, sizeof *tear->next, "%s/tear_next", name);
        tear->near = ALLOCATE(ARENA_TOPOLOGY, NEAR, TearStress, "stresses");
    }
    // Tearing by force remembers what was felt.
    if (tear->force > 0.0) {
        const int vertices_most = lattice->vertex_capacity;
        tear->felt = ALLOCATE(ARENA_STEP, vertices_most, double, "felt forces");
        state_add(state, tear->felt, (size_t)vertices_most * sizeof *tear->felt, "%s/felt_forces",
                  name);
    }
}

// ---------------------------------------------------------------------------------------------
// Stresses

static double number_at(const CutTear *tear, const void *number, int at)
{
    return tear->windows->templates->precision == PRECISION_SINGLE
               ? (double)((const float *)number)[at]
               : ((const double *)number)[at];
}

static void add_vertex(const CutTear *tear, const void *number, int at, Vec3 u, StiffElement *to)
{
    double row[TABLE_ROW];
    for (int k = 0; k < TABLE_ROW; k++)
        row[k] = number_at(tear, number, at + k);
    to->u[to->count] = u;
    to->weight[to->count] = row[3];
    to->rest[to->count] = vec3(row[4], row[5], row[6]);
    to->lever[to->count++] = vec3(row[7], row[8], row[9]);
}

// Computes F = 1 + sum (u_i - u_0) a_i^T / H; for Miyazaki's law the moment about the mean takes
// its place. `stiff`: NULL, or gets what stiffening needs.
static void deformation_of(const CutTear *tear, const void *rows, int element, double size,
                           double f[3][3], StiffElement *stiff)
{
    const Rows *basis = &tear->vertices->rows;
    const int *node = cut_lattice_nodes(tear->lattice, element);
    // The rest shape, in the numbers of the kernel.
    const TemplateKey shape = cut_shape_key(tear->lattice, element);
    unsigned mask = template_key_mask(shape);
    const void *number = template_cache_numbers(tear->windows->templates, shape);
    static const int rest[3][3] = {{2, 7, 6}, {7, 3, 5}, {6, 5, 4}};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            f[i][k] = (i == k ? 1.0 : 0.0) +
                      (tear->law == VOXEL_MIYAZAKI2004 ? number_at(tear, number, rest[i][k]) : 0.0);
    // Displacements relative to one corner: a common part would only add rounding.
    const Vec3 origin = rows_vector(basis, rows, node[0], 0);
    for (int i = 0, at = TABLE_HEAD; i < NODE_CORNERS || mask != 0; i++, at += TABLE_ROW) {
        int n = i;
        if (i >= NODE_CORNERS) {
            n = NODE_CORNERS + __builtin_ctz(mask);
            mask &= mask - 1;
        }
        const Vec3 d =
            vec3_scale(1.0 / size, vec3_sub(rows_vector(basis, rows, node[n], 0), origin));
        const double u[3] = {d.x, d.y, d.z};
        for (int c = 0; c < 9; c++)
            f[c / 3][c % 3] += u[c / 3] * number_at(tear, number, at + c % 3);
        if (stiff != NULL)
            add_vertex(tear, number, at, d, stiff);
    }
}

static const TearStress *stress_of(CutTear *tear, const VoxelPass *pass, int element)
{
    TearStress *out = &tear->near[element % NEAR];
    // Neighbours share a face: most stresses are asked for several times.
    if (out->look == tear->look && out->element == element)
        return out;
    *out = (TearStress){.look = tear->look, .element = element};
    const CutWindows *windows = tear->windows;
    const ElementClass *c = &windows->runs.classes[cut_windows_class(windows, element)];
    // The paper's law as an element with lambda = 0.
    const bool paper = tear->law == VOXEL_MIYAZAKI2004;
    const double scale = pass->stiffness_scale / c->share;
    const double mu = scale * (paper ? c->residual / c->size : c->mu);
    const double lambda = paper ? 0.0 : scale * c->lambda;
    enum { STEPS = 6 };
    const double barrier = paper ? 0.0 : barrier_stiffness(mu, lambda);
    double f[3][3], gap[3][3], trace, factor = 1.0;
    StiffElement stiff = {.count = 0};
    deformation_of(tear, pass->rows, element, c->size, f, pass->stiffening != NULL ? &stiff : NULL);
    // The fast rotation, or the exact one for flat and inverted elements.
    if (!rotation_foam((const double(*)[3])f, STEPS, out->rotation, &trace)) {
        const int lane = cut_windows_lane(windows, element);
        const double *q = windows->runs.last[lane / LANES][lane % LANES];
        Quat last = {q[0], q[1], q[2], q[3]};
        rotation_fit((const double(*)[3])f, out->rotation, &last);
    }
    if (pass->stiffening != NULL) {
        factor =
            stiffening_factor(&pass->stiffening->curve,
                              stiff_q(pass->stiffening, c, (const double(*)[3])f,
                                      (const double(*)[3])out->rotation, stiff_residual(&stiff)));
    }
    // P = 2 mu (F - R) + lambda tr(R^T F - 1) R, stiffened, and the barrier.
    barrier_gap((const double(*)[3])f, (const double(*)[3])out->rotation, gap);
    trace = -3.0;
    for (int k = 0; k < 9; k++)
        trace += out->rotation[k / 3][k % 3] * f[k / 3][k % 3];
    for (int k = 0; k < 9; k++)
        out->stress[k / 3][k % 3] =
            factor * (2.0 * mu * (f[k / 3][k % 3] - out->rotation[k / 3][k % 3]) +
                      lambda * trace * out->rotation[k / 3][k % 3]) +
            barrier * gap[k / 3][k % 3];
    if (tear->tension != NULL)
        cut_tension_add_stress(tear->tension, tear->lattice->element[element].material,
                               pass->stiffness_scale, (const double(*)[3])out->rotation,
                               out->stress);
    return out;
}

// Returns |T| where the face between two elements is in tension [Pa]; else 0.
static double pull_on(CutTear *tear, const VoxelPass *pass, int a, int b, int axis)
{
    const TearStress one = *stress_of(tear, pass, a), *other = stress_of(tear, pass, b);
    double along = 0.0, square = 0.0;
    for (int i = 0; i < 3; i++) {
        const double t = 0.5 * (one.stress[i][axis] + other->stress[i][axis]);
        along += t * (one.rotation[i][axis] + other->rotation[i][axis]);
        square += t * t;
    }
    return along > 0.0 ? sqrt(square) : 0.0;
}

// ---------------------------------------------------------------------------------------------
// Faces

// A face of the smaller of two elements; `low`: the low corner of its cells on the lower side.
typedef struct TearFace {
    int low[3], axis, edge; // edge: cells a side
    double pull;            // [Pa]
} TearFace;

// The faces under the greatest stress, descending.
typedef struct TearList {
    int count;
    TearFace face[TEAR_FACES];
} TearList;

static void list_face(TearList *list, const TearFace *face)
{
    if (list->count == TEAR_FACES && !(face->pull > list->face[TEAR_FACES - 1].pull))
        return;
    int k = list->count < TEAR_FACES ? list->count++ : TEAR_FACES - 1;
    for (; k > 0 && list->face[k - 1].pull < face->pull; k--)
        list->face[k] = list->face[k - 1];
    list->face[k] = *face;
}

static int cell_at(const CutLattice *lattice, const int at[3])
{
    return cut_lattice_cell(lattice, at[0], at[1], at[2]);
}

// Void cells of partly filled leaves have nothing to break.
static bool is_broken(const CutLattice *lattice, int cell, int axis)
{
    return cell < 0 || cut_lattice_beyond(lattice, cell, axis) < 0 ||
           (lattice->broken[cell] >> axis & 1);
}

// True if nothing is connected across the face of a cell towards +axis.
static bool is_free(const CutLattice *lattice, const int at[3], int axis)
{
    return is_broken(lattice, cell_at(lattice, at), axis);
}

static bool is_front(const CutLattice *lattice, const TearFace *face)
{
    for (int side = 0; side < 4; side++) {
        const int across = (face->axis + 1 + side / 2) % 3, along = 3 - face->axis - across;
        for (int k = 0; k < face->edge; k++) {
            int at[3] = {face->low[0], face->low[1], face->low[2]};
            at[across] += side % 2 == 0 ? -1 : face->edge;
            at[along] += k;
            if (is_free(lattice, at, face->axis))
                return true;
        }
    }
    return false;
}

static bool is_whole(const CutLattice *lattice, const TearFace *face)
{
    for (int k = 0; k < face->edge * face->edge; k++) {
        int at[3] = {face->low[0], face->low[1], face->low[2]};
        at[(face->axis + 1) % 3] += k % face->edge;
        at[(face->axis + 2) % 3] += k / face->edge;
        if (!is_broken(lattice, cell_at(lattice, at), face->axis))
            return true;
    }
    return false;
}

// Tests the face of leaf `small` towards `side` (2 axis + 1: upwards), beyond which `large` is.
static void test_face(CutTear *tear, const VoxelPass *pass, int small, int side, int large,
                      TearList *list)
{
    const CutElement *e = &tear->lattice->element[small];
    TearFace face = {
        .low = {e->cell[0], e->cell[1], e->cell[2]}, .axis = side / 2, .edge = 1 << e->level};
    face.low[face.axis] += side % 2 == 0 ? -1 : face.edge - 1;
    face.pull = pull_on(tear, pass, small, large, face.axis);
    if (face.pull > tear->stress && is_whole(tear->lattice, &face) &&
        (face.pull > AWAY_FROM_FRONT * tear->stress || is_front(tear->lattice, &face)))
        list_face(list, &face);
}

// Tests all faces of a leaf except those already tested from another one. Beyond a side there is
// one leaf, as large or larger, or up to four of half its size.
static void test_leaf(CutTear *tear, const VoxelPass *pass, int leaf, TearList *list)
{
    const CutLattice *lattice = tear->lattice;
    const CutElement *e = &lattice->element[leaf];
    const int edge = 1 << e->level, half = edge > 1 ? edge / 2 : 1;
    // Each face, in quarters where smaller leaves lie beyond.
    for (int side = 0; side < 6; side++) {
        const int axis = side / 2;
        for (int quarter = 0; quarter < (edge > 1 ? 4 : 1); quarter++) {
            int at[3] = {e->cell[0], e->cell[1], e->cell[2]};
            at[axis] += side % 2 == 0 ? -1 : edge;
            at[(axis + 1) % 3] += (quarter & 1) * half;
            at[(axis + 2) % 3] += (quarter >> 1) * half;
            const int other = cut_parts_leaf_at(lattice, at[0], at[1], at[2]);
            if (other < 0)
                continue;
            // A face is tested once, from the side of the smaller leaf.
            const bool smaller = lattice->element[other].level < e->level;
            if (!tear->is_looked_at[other])
                test_face(tear, pass, smaller ? other : leaf, smaller ? side ^ 1 : side,
                          smaller ? leaf : other, list);
            if (!smaller)
                break;
        }
    }
}

// ---------------------------------------------------------------------------------------------

static void hit(CutTear *tear, int cell, int axis)
{
    if (tear->hit_count == tear->hit_capacity || is_broken(tear->lattice, cell, axis) ||
        (tear->hit_bits[cell] >> axis & 1))
        return;
    tear->hit_bits[cell] |= (unsigned char)(1 << axis);
    tear->hit[tear->hit_count][0] = cell;
    tear->hit[tear->hit_count++][1] = axis;
}

typedef struct SharedLook {
    const CutTear *tear;
    const VoxelPass *pass;
    double limit;
} SharedLook;

static void look_at_half(void *context, int first, int last)
{
    const SharedLook *shared = context;
    const CutTear *tear = shared->tear;
    for (int half = first; half < last; half++)
        batch_runs_stress(&tear->windows->runs, shared->pass, shared->limit, half, tear->high);
}

// Elements of a body that adapts are divided from this share of the strength on: larger ones
// underestimate peaks.
static const double STRESSED = 0.5;

// Marks the elements under this share of the strength, in `high`.
static void mark_stressed(CutTear *tear, const VoxelPass *pass, double share)
{
    // Slightly lower, because the kernels round, in single precision to 1e-7 of the stiffness.
    // What is there at rest comes on top of what they see.
    const double rest = tear->tension != NULL ? pass->stiffness_scale * tear->tension->most : 0.0;
    SharedLook shared = {tear, pass, fmax(0.0, (1.0 - 1e-3) * share * tear->stress - rest)};
    if (tear->vertices->team != NULL && tear->vertices->halved)
        team_run(tear->vertices->team, look_at_half, &shared, 2);
    else
        look_at_half(&shared, 0, 2);
}

static bool is_marked(const CutTear *tear, int leaf)
{
    const int lane = cut_windows_lane(tear->windows, leaf);
    return tear->high[lane / LANES] >> lane % LANES & 1;
}

// Chooses the marked elements of a tick, among those under stress from where the last tick ended
// on, cyclically. Returns their number.
static int choose(CutTear *tear, int leaf[TEAR_LOOKS])
{
    int first = 0, chosen = 0;
    if (tear->stressed_count <= TEAR_LOOKS)
        *tear->next = 0;
    while (first < tear->stressed_count && tear->stressed[first] < *tear->next)
        first++;
    *tear->next = 0;
    for (int k = 0; k < tear->stressed_count; k++) {
        const int stressed = tear->stressed[(first + k) % tear->stressed_count];
        if (!is_marked(tear, stressed))
            continue;
        if (chosen == TEAR_LOOKS) {
            *tear->next = stressed;
            break;
        }
        leaf[chosen++] = stressed;
    }
    return chosen;
}

static void find_by_stress(CutTear *tear, const VoxelPass *pass)
{
    int looked[TEAR_LOOKS];
    const bool adapts = tear->lattice->adapts;
    mark_stressed(tear, pass, adapts ? STRESSED : 1.0);
    tear->stressed_count = cut_windows_stressed(tear->windows, tear->high, tear->stressed);
    // Elements that may tear do not wait for those that are to be divided alone.
    if (adapts && tear->stressed_count > TEAR_LOOKS)
        mark_stressed(tear, pass, 1.0);
    // Of the stressed elements, as many as a tick has time for.
    const int count = choose(tear, looked);
    TearList list = {.count = 0};
    tear->look++;
    // Their faces with more traction than the strength.
    for (int k = 0; k < count; k++) {
        test_leaf(tear, pass, looked[k], &list);
        tear->is_looked_at[looked[k]] = true;
    }
    for (int k = 0; k < count; k++)
        tear->is_looked_at[looked[k]] = false;
    // All finest faces of each.
    for (int k = 0; k < list.count; k++) {
        const TearFace *face = &list.face[k];
        for (int i = 0; i < face->edge * face->edge; i++) {
            int at[3] = {face->low[0], face->low[1], face->low[2]};
            at[(face->axis + 1) % 3] += i % face->edge;
            at[(face->axis + 2) % 3] += i / face->edge;
            hit(tear, cell_at(tear->lattice, at), face->axis);
        }
    }
}

static void release_vertex(CutTear *tear, int vertex)
{
    const CutLattice *lattice = tear->lattice;
    int point[3], cell[8];
    cut_lattice_point(lattice, vertex, point);
    cut_lattice_cells(lattice, point, cell);
    for (int f = 0; f < 12; f++) {
        const int low = cell[POINT_FACE[f]], high = cell[POINT_FACE[f] + (1 << f / 4)];
        if (low >= 0 && high >= 0 &&
            cut_lattice_leaf_of(lattice, low) != cut_lattice_leaf_of(lattice, high))
            hit(tear, low, f / 4);
    }
}

static void find_by_force(CutTear *tear)
{
    const double most = tear->force * tear->force;
    for (int v = 0; v < tear->vertices->count; v++)
        if (tear->felt[v] > most)
            release_vertex(tear, v);
    cut_tear_forget(tear);
}

bool cut_tear_find(CutTear *tear, const VoxelPass *pass)
{
    tear->hit_count = 0;
    if (tear->force > 0.0)
        find_by_force(tear);
    if (tear->stress > 0.0)
        find_by_stress(tear, pass);
    for (int k = 0; k < tear->hit_count; k++)
        tear->hit_bits[tear->hit[k][0]] = 0;
    return tear->hit_count > 0;
}

void cut_tear_feel(CutTear *tear)
{
    const Vertices *vertices = tear->vertices;
    double *felt = tear->felt;
    if (vertices->rows.precision == PRECISION_SINGLE)
        for (long v = 0; v < vertices->count; v++) {
            const float *f = (const float *)vertices->force + 4 * v;
            const double square = (double)(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
            felt[v] = square > felt[v] ? square : felt[v];
        }
    else
        for (long v = 0; v < vertices->count; v++) {
            const double *f = (const double *)vertices->force + 4 * v;
            const double square = f[0] * f[0] + f[1] * f[1] + f[2] * f[2];
            felt[v] = square > felt[v] ? square : felt[v];
        }
}

void cut_tear_forget(CutTear *tear)
{
    memset(tear->felt, 0, (size_t)tear->lattice->vertex_capacity * sizeof *tear->felt);
}
