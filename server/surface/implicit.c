// SPDX-License-Identifier: MIT
// One step of an implicit body, and its creation. Step thread, except implicit_create.
#include "surface/implicit_quad.h"

#include "base/isa.h"
#include "surface/bending.h"
#include "surface/detail/detail.h"

#include <math.h>
#include <string.h>

ISA_KERNELS_OF(ImplicitKernel, implicit_kernels_double);
// ---------------------------------------------------------------------------------------------
// Nodes are numbered for one step in the order of the kernel's lanes, and sorted into islands

static void add_node(SurfaceModel *model, int slot, int lane)
{
    Implicit *system = model->implicit;
    if (model->node[slot] < 0 || !(((const double *)model->nodes.inverse_mass)[lane] > 0.0))
        return;
    system->number[slot] = system->moving;
    system->slot[system->moving++] = slot;
}

static void number_nodes(SurfaceModel *model)
{
    Implicit *system = model->implicit;
    const Detail *detail = model->detail;
    memset(system->number, 0xff, (size_t)model->basis.count * sizeof *system->number);
    system->moving = system->hanging = 0;
    // Moving nodes in the order of the kernel's lanes.
    if (detail == NULL) {
        for (int s = 0; s < model->basis.count; s++)
            add_node(model, s, s);
    } else {
        for (int k = 0; k < detail->lists.free_chunk_count; k++)
            for (int lane = detail->lists.free_chunk[k] * LANES, i = 0; i < LANES; i++)
                add_node(model, model->springs.own[lane + i], lane + i);
        // Hanging nodes follow, finest level first.
        system->hanging = detail->lists.hanging_count;
        for (int i = 0; i < system->hanging; i++) {
            int number = system->moving + i;
            system->number[detail->lists.hanging[i]] = number;
            system->slot[number] = detail->lists.hanging[i];
        }
    }
    // All fixed nodes share the last number; unused slots are neighbours of none.
    const int fixed = system->moving + system->hanging;
    for (int s = 0; s < model->basis.count; s++)
        if (system->number[s] < 0)
            system->number[s] = fixed;
    for (int i = 0; i < system->hanging; i++)
        for (int k = 0; k < 2; k++)
            system->master[i][k] = system->number[detail->lists.master[i][k]];
}

// Sets the frames of pieces with motions of their own (detail_pieces.h): 0 is the body's frame.
static void number_frames(SurfaceModel *model)
{
    Implicit *system = model->implicit;
    const DetailFrames *frames = model->detail->frames;
    memset(system->frame, 0, (size_t)system->moving);
    for (int i = 0; i < frames->slot_count; i++)
        if (system->number[frames->slot[i]] < system->moving)
            system->frame[system->number[frames->slot[i]]] = frames->slot_frame[i];
}

// Returns the piece with which a node shares its momentum; with virtual nodes on one frame, the
// whole body.
static int piece_of(const SurfaceModel *model, int node)
{
    const Detail *detail = model->detail;
    if (detail != NULL)
        return detail->set.cut != NULL ? detail->set.cut->node_piece[node] : 0;
    return model->shape == SHAPE_FRAME_BODY ? 0 : model->piece[node];
}

static bool is_one_piece(const SurfaceModel *model)
{
    const Detail *detail = model->detail;
    if (detail != NULL)
        return detail->set.cut == NULL || detail->set.cut->piece_count <= 1;
    return model->shape == SHAPE_FRAME_BODY;
}

// Orders islands by their first node; marks those with a fixed node.
static void sort_islands(SurfaceModel *model)
{
    Implicit *system = model->implicit;
    const bool whole = is_one_piece(model);
    int *start = system->island_start;
    system->island_count = 0;
    // Count the members of each island; the stamp maps pieces to islands.
    for (int i = 0; i < system->moving; i++) {
        int *stamp = &system->stamp[whole ? 0 : piece_of(model, model->node[system->slot[i]])];
        if (*stamp == 0) {
            system->held[system->island_count] = false;
            start[system->island_count + 1] = 0;
            *stamp = ++system->island_count;
        }
        system->island[i] = *stamp - 1;
        start[*stamp]++;
    }
    // A fixed node of a piece anchors its island.
    for (int s = 0; s < model->basis.count; s++) {
        int node = model->node[s];
        if (node < 0 || system->number[s] < system->moving + system->hanging)
            continue;
        int island = system->stamp[whole ? 0 : piece_of(model, node)] - 1;
        if (island >= 0)
            system->held[island] = true;
    }
    // Counting sort of the nodes by island.
    start[0] = 0;
    for (int k = 0; k < system->island_count; k++)
        start[k + 1] += start[k];
    for (int i = system->moving - 1; i >= 0; i--)
        system->member[--start[system->island[i] + 1]] = i;
    // Each start has moved down to that of the island before: shift them back.
    memmove(start, start + 1, (size_t)system->island_count * sizeof *start);
    start[system->island_count] = system->moving;
    // Clear the stamps for the next step.
    for (int i = 0; i < system->moving; i++)
        system->stamp[whole ? 0 : piece_of(model, model->node[system->slot[i]])] = 0;
}

// Numbers the moving and the hanging nodes, and assigns moving nodes to islands.
static void number_system(SurfaceModel *model)
{
    number_nodes(model);
    if (model->implicit->frame != NULL)
        number_frames(model);
    sort_islands(model);
}

// ---------------------------------------------------------------------------------------------
// A violent step is corrected: floating islands turn on a circle
//
// The step moves nodes in a straight line, x' = x + h v', so that a body that turns by an angle a
// grows by a^2 / 2, and sufficiently stiff springs then store more energy than the motion has. With
// c the middle, V and W the rigid part of v', u the rest of it, and R the rotation by h W, this
// correction uses
//
//     x' = c + h V + R (r + h u),    v' = V + R (v' - V) + D x r'
//
// where the spin D restores the angular momentum, which the straight step conserves exactly.

typedef struct Spin {
    double weight;        // [kg]
    double inertia[3][3]; // about the middle [kg m2]
    Quad middle, velocity;
    Quad momentum; // angular, about the middle [N s m]
} Spin;

// Solves inertia w = momentum; no spin about directions without inertia.
INLINE Quad angular_velocity(const Spin *spin, Quad momentum)
{
    double m[3][3];
    const double soft =
        1e-15 * (spin->inertia[0][0] + spin->inertia[1][1] + spin->inertia[2][2]) + 1e-300;
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            m[a][b] = spin->inertia[a][b] + (a == b ? soft : 0.0);
    return quad_solve_positive(m, momentum);
}

// Sums inertia and angular momentum of an island's members from rows, about the given middle and
// velocity.
static void add_spin(const Implicit *system, const int *member, int count, const double *rows,
                     Spin *spin)
{
    for (int k = 0; k < count; k++) {
        const int i = member[k], slot = system->slot[i];
        const double w = system->inertia[i];
        const Quad r = quad_row(rows, slot, 0) - spin->middle,
                   v = quad_row(rows, slot, 4) - spin->velocity;
        const double square = quad_dot(r, r);
        // About the middle, and relative to its motion.
        spin->momentum += w * quad_cross(r, v);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                spin->inertia[a][b] += w * ((a == b ? square : 0.0) - r[a] * r[b]);
    }
}

// Returns v turned by a rotation vector (Rodrigues).
INLINE Quad turned(Quad v, Quad rotation, double angle)
{
    const Quad n = rotation / angle, across = quad_cross(n, v);
    const double half = sin(0.5 * angle);
    return v + sin(angle) * across + (2.0 * half * half) * quad_cross(n, across);
}

INLINE void put(double *rows, int slot, Quad x, Quad v)
{
    for (int c = 0; c < 3; c++) {
        rows[(long)slot * ROW + c] = x[c];
        rows[(long)slot * ROW + c + 4] = v[c];
    }
}

static bool turn_island(const Implicit *system, int island, double *next)
{
    const int first = system->island_start[island], *member = system->member + first;
    const int count = system->island_start[island + 1] - first;
    const double h = system->h;
    Spin before = {0};
    // Undo the straight step; the velocities are already those at its end.
    for (int k = 0; k < count; k++) {
        const int i = member[k], slot = system->slot[i];
        const Quad v = quad_row(next, slot, 4);
        put(next, slot, quad_row(next, slot, 0) - h * v, v);
        before.weight += system->inertia[i];
        before.middle += system->inertia[i] * quad_row(next, slot, 0);
        before.velocity += system->inertia[i] * v;
    }
    before.middle /= before.weight;
    before.velocity /= before.weight;
    // The rigid rotation of the island during the step.
    add_spin(system, member, count, next, &before);
    const Quad spin = angular_velocity(&before, before.momentum), rotation = h * spin;
    const double angle = fmax(sqrt(quad_dot(rotation, rotation)), 1e-300);
    Spin after = {.middle = before.middle + h * before.velocity, .velocity = before.velocity};
    // Turn positions and velocities about the middle, which moves straight.
    for (int k = 0; k < count; k++) {
        const int slot = system->slot[member[k]];
        const Quad r = quad_row(next, slot, 0) - before.middle,
                   v = quad_row(next, slot, 4) - before.velocity;
        put(next, slot, after.middle + turned(r + h * (v - quad_cross(spin, r)), rotation, angle),
            after.velocity + turned(v, rotation, angle));
    }
    // Restore the angular momentum by a spin.
    add_spin(system, member, count, next, &after);
    const Quad more = angular_velocity(&after, before.momentum - after.momentum);
    for (int k = 0; k < count; k++) {
        const int slot = system->slot[member[k]];
        const Quad x = quad_row(next, slot, 0);
        put(next, slot, x, quad_row(next, slot, 4) + quad_cross(more, x - after.middle));
    }
    return isfinite(quad_dot(more, more));
}

// After a violent step: turns the rows `next` of floating islands instead of moving them in a
// straight line. False: the numbers are not finite.
static bool turn_step(const Implicit *system, double *next)
{
    bool good = true;
    for (int k = 0; k < system->island_count; k++)
        if (!system->held[k])
            good &= turn_island(system, k, next);
    return good;
}

// ---------------------------------------------------------------------------------------------
// A step

// Before the tick: computes the positions at which external forces are evaluated. Also sets the
// base of the first substep.
void implicit_drift(void *self, double dt)
{
    SurfaceModel *model = self;
    model->base = model->rows[model->current];
    model_drift(model, model->implicit->theta * dt);
}

// Computes the rows after the step, and, unless NULL, those at which the next step's external
// forces are evaluated.
static void advance(SurfaceModel *model, double *next, double *ahead)
{
    const Implicit *system = model->implicit;
    const double h = system->h, part = system->share * h, further = system->theta * h;
    bool good = true;
    // x += h (v + theta dv), v += dv.
    for (int i = 0; i < system->moving; i++) {
        const int slot = system->slot[i];
        const Quad dv = system->change[i], v = quad_row(system->rows, slot, 4),
                   x = quad_row(system->rows, slot, 0) + h * v + part * dv, fast = v + dv;
        for (int c = 0; c < 3; c++) {
            const long at = (long)slot * ROW + c;
            good &= fabs(x[c]) <= model->position_limit && fabs(fast[c]) <= SPEED_LIMIT;
            next[at] = x[c];
            next[at + 4] = fast[c];
            // Where the next step's external forces are evaluated.
            if (ahead != NULL) {
                ahead[at] = x[c] + further * fast[c];
                ahead[at + 4] = fast[c];
            }
        }
    }
    model->bad |= !good;
}

// Computes the same positions for rows that were changed after advance.
static void look_ahead(const Implicit *system, const double *next, double *ahead)
{
    const double further = system->theta * system->h;
    for (int i = 0; i < system->moving && ahead != NULL; i++)
        for (int c = 0; c < 3; c++) {
            const long at = (long)system->slot[i] * ROW + c;
            ahead[at] = next[at] + further * next[at + 4];
            ahead[at + 4] = next[at + 4];
        }
}

// Copies the rows of fixed nodes and of unused slots unchanged.
static void keep(const SurfaceModel *model, double *next)
{
    const Implicit *system = model->implicit;
    const int fixed = system->moving + system->hanging;
    if (next == system->rows)
        return;
    for (int s = 0; s < model->basis.count; s++)
        if (system->number[s] == fixed && model->node[s] >= 0)
            for (int c = 0; c < ROW; c++)
                next[(long)s * ROW + c] = system->rows[(long)s * ROW + c];
}

void implicit_evaluate(void *self, const Evaluation *evaluation, double h)
{
    SurfaceModel *model = self;
    Implicit *system = model->implicit;
    Detail *detail = model->detail;
    double *next = evaluation->last ? model->rows[1 - model->current] : model->stage[1];
    double *ahead = evaluation->last ? NULL : model->stage[0];
    // Build and solve the system at the current state, then correct the momentum.
    system->h = h;
    system->rows = model->base;
    number_system(model);
    system->kernel->assemble(model);
    model->bad |= !system->kernel->solve(system);
    system->kernel->restore_momentum(system);
    keep(model, next);
    // A violent step of a floating body is turned on a circle, after which the look-ahead is
    // repeated.
    advance(model, next, system->violent && !system->anchored ? NULL : ahead);
    if (system->violent && !system->anchored) {
        model->bad |= !turn_step(system, next);
        look_ahead(system, next, ahead);
    }
    // Hanging rows are not unknowns: they follow their masters.
    if (detail != NULL) {
        detail_hang(&model->detail->lists, model->basis.precision, next);
        if (ahead != NULL) {
            detail_hang(&model->detail->lists, model->basis.precision, ahead);
            *detail->adapt.felt_count = 0; // only contact forces of the last evaluation count
        }
    }
    if (model->touched_count > 0)
        model_clear_touched(model);
    model->base = next;
    model->present = ahead != NULL ? ahead : next;
}

void implicit_explain(const Implicit *system, FILE *out)
{
    fprintf(out,
            "    implicit: theta %.6g, conjugate gradients to %.3g of the residual, at most %d "
            "iterations a step; rows in double precision, one thread\n",
            system->theta, system->tolerance, system->iterations);
}

// Returns the most springs that can be active: each is in the table at both ends.
static int most_edges(const SurfaceModel *model)
{
    return model->springs.start[model->springs.chunk_count] * LANES / 2 + 1;
}

double implicit_theta(const SurfaceOptions *options)
{
    return options->implicit.theta > 0.0 ? options->implicit.theta : IMPLICIT_THETA;
}

void implicit_create(SurfaceModel *model, const SurfaceOptions *options, Arena *arena)
{
    const char *name = options->body.name;
    Implicit *system = model->implicit = ALLOCATE(ARENA_STEP, 1, Implicit, "implicit system");
    const SurfaceImplicit *asked = &options->implicit;
    // What the scene chose, or the defaults.
    system->kernel = implicit_kernels_double[isa_find(model->kernels->level)];
    system->theta = implicit_theta(options);
    system->anchored = options->shape.wanted && options->shape.frame == SHAPE_WORLD;
    system->tolerance = asked->tolerance > 0.0 ? asked->tolerance : IMPLICIT_TOLERANCE;
    system->iterations = asked->iterations > 0 ? asked->iterations : IMPLICIT_ITERATIONS;
    // Numbers of nodes: one more than nodes, for all fixed ones.
    const int numbers = model->node_count + 1;
    system->number = ALLOCATE(ARENA_STEP, model->basis.count, int, "implicit numbers");
    system->slot = ALLOCATE(ARENA_STEP, numbers, int, "implicit slots");
    if (model->detail != NULL)
        system->master = ALLOCATE(ARENA_STEP, numbers, *system->master, "implicit masters");
    if (model->detail != NULL && model->detail->frames != NULL)
        system->frame = ALLOCATE(ARENA_STEP, numbers, unsigned char, "implicit frames");
    // The matrix: springs, and blocks of the diagonal.
    system->edge_capacity = most_edges(model);
    system->spring = ALLOCATE(ARENA_STEP, system->edge_capacity, Quad, "implicit springs");
    system->end = ALLOCATE(ARENA_STEP, system->edge_capacity, *system->end, "implicit ends");
    if (model->bending != NULL) {
        const int hinges = model->bending->capacity;
        system->hinge = ALLOCATE(ARENA_STEP, hinges, *system->hinge, "implicit hinges");
        system->corner = ALLOCATE(ARENA_STEP, hinges, *system->corner, "implicit corners");
    }
    system->inertia = ALLOCATE(ARENA_STEP, numbers, double, "implicit inertia");
    system->weight = ALLOCATE(ARENA_STEP, numbers, double, "implicit weights");
    system->inverse = ALLOCATE(ARENA_STEP, numbers, Block, "implicit blocks");
    Quad **const by_number[] = {&system->outer, &system->change,  &system->residual,
                                &system->step,  &system->product, &system->search};
    for (size_t k = 0; k < sizeof by_number / sizeof *by_number; k++)
        *by_number[k] = ALLOCATE(ARENA_STEP, numbers, Quad, "implicit vectors");
    // Islands, and what holds them.
    system->island = ALLOCATE(ARENA_STEP, numbers, int, "implicit islands");
    system->member = ALLOCATE(ARENA_STEP, numbers, int, "implicit members");
    system->island_start = ALLOCATE(ARENA_STEP, numbers + 1, int, "implicit island starts");
    system->held = ALLOCATE(ARENA_STEP, numbers, bool, "implicit held islands");
    if (system->anchored)
        system->resistance = ALLOCATE(ARENA_STEP, numbers, Block, "implicit resistance");
    const int pieces = model->detail != NULL ? model->detail->set.face_count : model->node_count;
    system->stamp = ALLOCATE(ARENA_STEP, pieces, int, "implicit pieces");
}
