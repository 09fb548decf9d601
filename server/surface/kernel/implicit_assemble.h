// SPDX-License-Identifier: MIT
// Builds the linear system of one implicit step from the spring tables and the rows (implicit.h).
// Step thread.
#ifndef PLIANT_SURFACE_KERNEL_IMPLICIT_ASSEMBLE_H
#define PLIANT_SURFACE_KERNEL_IMPLICIT_ASSEMBLE_H

#include "surface/implicit_quad.h"

#include "surface/bending.h"
#include "surface/detail/detail.h"

#include <math.h>
#include <string.h>

// Parameters that all springs share.
typedef struct Scales {
    double stiffness;    // of SET
    double damping_time; // k_d / k [s]
    double h, part;      // h and h_ [s]
} Scales;

static void add_square(Block *block, const Quad *g)
{
    for (int c = 0; c < 3; c++)
        block->column[c] += (*g)[c] * *g;
}

// Adds a spring between two numbers with the vector d from j to i [m] and the relative velocity u
// [m/s].
INLINE void add_spring(Implicit *system, const Scales *by, int i, int j, Quad d, Quad u, double k,
                       double rest_length)
{
    const double length2 = quad_dot(d, d);
    k *= by->stiffness;
    if (!(length2 > 1e-24)) // (1e-12 m)^2: no direction, and no force, as in the kernel
        return;
    const double length = sqrt(length2), stretch = 1.0 - rest_length / length;
    const double across = stretch > 0.0 ? k * stretch : 0.0, along = k - across;
    const double damping = by->damping_time * k;
    const Quad n = d / length;
    const double approach = quad_dot(n, u);
    // pull = -f + h_ K u of end i.
    const Quad pull = (k * stretch) * d + (damping * approach) * n +
                      by->part * (across * u + (along * approach) * n);
    system->residual[i] -= by->h * pull;
    system->residual[j] += by->h * pull;

    // Matrix: g g^T along the spring, a I across.
    Quad g = sqrt(by->part * (by->part * along + damping)) * n;
    const double a = by->part * by->part * across;
    for (int c = 0; c < 3; c++) {
        system->inverse[i].column[c][c] += a;
        system->inverse[j].column[c][c] += a;
    }
    add_square(&system->inverse[i], &g);
    add_square(&system->inverse[j], &g);
    g[3] = a;
    system->end[system->edge_count][0] = i;
    system->end[system->edge_count][1] = j;
    system->spring[system->edge_count++] = g;
}

// Returns the square of the speed at which two slots approach each other.
INLINE double approach2(const Implicit *system, int own, int other, Quad u)
{
    const Quad d = quad_row(system->rows, own, 0) - quad_row(system->rows, other, 0);
    const double along = quad_dot(d, u);
    return along * along / fmax(quad_dot(d, d), 1e-24);
}

// True if a spring of the chunk changes by more than its length in a step: the linear system then
// predicts little. A spring that turns by an angle a is stretched by a^2 / 2 of its length, because
// the step is straight. Where that is as much energy as the node's motion has, (h^2 k / m) a^2 / 4
// of it, the stretch creates motion from nothing. The stiff springs of such a state would oscillate
// for long, as the method hardly damps with theta little above 1/2; backward Euler brings it to
// rest.
INLINE bool is_violent(const SurfaceModel *model, int chunk)
{
    const Implicit *system = model->implicit;
    const SpringTable *table = &model->springs;
    const double *rest_length = table->rest_length, *stiffness = table->stiffness,
                 *inverse_mass = model->nodes.inverse_mass, h = system->h;
    const double scale = 0.25 * h * h * model->parameters->stiffness_scale;
    const int end = table->end[chunk];
    bool violent = false;
    for (int e = table->start[chunk]; e < end; e++)
        for (int lane = 0; lane < LANES; lane++) {
            const long at = (long)e * LANES + lane;
            int other = table->neighbour[at],
                own = model->lane == NULL ? chunk * LANES + lane : table->own[chunk * LANES + lane];
            // How far the two ends move against each other in this step.
            const Quad u = quad_row(system->rows, own, 4) - quad_row(system->rows, other, 4);
            const double turn = scale * stiffness[at] * inverse_mass[chunk * LANES + lane];
            const double change = h * h * quad_dot(u, u), most = rest_length[at] * rest_length[at];
            violent |= change > most ||
                       (turn * change > most &&
                        turn * (change - h * h * approach2(system, own, other, u)) > most);
        }
    return violent;
}

// Returns theta of this step.
static double choose_share(const SurfaceModel *model)
{
    const Detail *detail = model->detail;
    bool violent = false;
    for (int c = 0; detail == NULL && c < model->springs.chunk_count; c++)
        violent |= is_violent(model, c);
    for (int k = 0; detail != NULL && k < detail->lists.free_chunk_count; k++)
        violent |= is_violent(model, detail->lists.free_chunk[k]);
    model->implicit->violent = violent;
    return violent ? 1.0 : model->implicit->theta;
}

// Adds the springs of a chunk that lead to higher slots: each spring is in the table at both ends.
static void add_chunk(SurfaceModel *model, const Scales *by, int chunk)
{
    Implicit *system = model->implicit;
    const SpringTable *table = &model->springs;
    const double *stiffness = table->stiffness, *rest_length = table->rest_length;
    const int end = table->end[chunk];
    for (int e = table->start[chunk]; e < end; e++)
        for (int lane = 0; lane < LANES; lane++) {
            const long at = (long)e * LANES + lane;
            int other = table->neighbour[at],
                own = model->lane == NULL ? chunk * LANES + lane : table->own[chunk * LANES + lane];
            // A spring is stored at both ends: take it once.
            if (other <= own || !(stiffness[at] > 0.0))
                continue;
            const int i = system->number[own], j = system->number[other];
            const Quad d = quad_row(system->rows, own, 0) - quad_row(system->rows, other, 0);
            const Quad u = quad_row(system->rows, own, 4) - quad_row(system->rows, other, 4);
            add_spring(system, by, i, j, d, u, stiffness[at], rest_length[at]);
        }
}

static void add_springs(SurfaceModel *model, const Scales *by)
{
    const Detail *detail = model->detail;
    for (int c = 0; detail == NULL && c < model->springs.chunk_count; c++)
        add_chunk(model, by, c);
    for (int k = 0; detail != NULL && k < detail->lists.free_chunk_count; k++)
        add_chunk(model, by, detail->lists.free_chunk[k]);
    for (int k = 0; detail != NULL && k < detail->lists.hanging_chunk_count; k++)
        add_chunk(model, by, detail->lists.hanging_chunk[k]);
}

// Adds a hinge between four slots, `arm` from the first to the others: its angle has changed by
// `change` since rest [rad], the squares of twice the areas of its faces are `square` [m4].
INLINE void add_hinge(Implicit *system, const Scales *by, const int slot[4], const Quad arm[3],
                      double stiffness, double change, const double square[2])
{
    // How the angle changes with the nodes, as in kernel/bend.h.
    const Quad left = quad_cross(arm[0], arm[1]), right = quad_cross(arm[2], arm[0]);
    const double length2 = quad_dot(arm[0], arm[0]), length = sqrt(length2);
    const double s = quad_dot(arm[1], arm[0]) / length2, t = quad_dot(arm[2], arm[0]) / length2;
    Quad g[4];
    g[2] = (-length / square[0]) * left;
    g[3] = (-length / square[1]) * right;
    g[1] = -(s * g[2] + t * g[3]);
    g[0] = -(g[1] + g[2] + g[3]);
    double speed = 0.0;
    for (int k = 0; k < 4; k++)
        speed += quad_dot(g[k], quad_row(system->rows, slot[k], 4));
    // Its moment with what its stiffness adds during the step; then its part of the matrix.
    const double moment = stiffness * (change + (by->damping_time + by->part) * speed);
    const double root = sqrt(by->part * stiffness * (by->part + by->damping_time));
    const int h = system->hinge_count++;
    for (int k = 0; k < 4; k++) {
        const int number = system->number[slot[k]];
        system->residual[number] -= (by->h * moment) * g[k];
        g[k] = root * g[k];
        add_square(&system->inverse[number], &g[k]);
        system->hinge[h][k] = g[k];
        system->corner[h][k] = number;
    }
}

// Adds the hinges of a group.
static void add_group(SurfaceModel *model, const Scales *by, int group)
{
    const double whole = 2.0 * 3.14159265358979323846;
    Implicit *system = model->implicit;
    const HingeTable *table = &model->bending->hinges;
    const int *slots = table->slot + (long)group * 4 * LANES;
    const double *value = (const double *)table->value + (long)group * table->values * LANES;
    // Angles in the arithmetic that measured them at rest.
    double vectors[HINGE_VECTORS * LANES], angle[LANES], square[2 * LANES];
    Quad arm[LANES][3];
    for (int lane = 0; lane < LANES; lane++)
        for (int k = 0; k < 3; k++) {
            arm[lane][k] = quad_row(system->rows, slots[(k + 1) * LANES + lane], 0) -
                           quad_row(system->rows, slots[lane], 0);
            for (int c = 0; c < 3; c++)
                vectors[(3 * k + c) * LANES + lane] = arm[lane][k][c];
        }
    model->kernels->bend_measure(vectors, angle, square);
    for (int lane = 0; lane < LANES; lane++) {
        const double now[2] = {square[lane], square[LANES + lane]};
        double stiffness = by->stiffness * value[HINGE_STIFFNESS * LANES + lane], share = 1.0;
        if (!(stiffness > 0.0 && now[0] > 0.0 && now[1] > 0.0))
            continue;
        double change = angle[lane] - value[HINGE_ANGLE * LANES + lane];
        if (fabs(change) > 0.5 * whole)
            change -= copysign(whole, change);
        for (int side = 0; side < 2; side++)
            share = fmin(share, now[side] * value[(HINGE_FADE + side) * LANES + lane]);
        int slot[4];
        for (int k = 0; k < 4; k++)
            slot[k] = slots[k * LANES + lane];
        add_hinge(system, by, slot, arm[lane], stiffness * share, change, now);
    }
}

static void add_hinges(SurfaceModel *model, const Scales *by)
{
    for (int i = 0; i < model->bending->group_count; i++)
        add_group(model, by, model->bending->group[i]);
}

// Gives half of a hanging node's force to each master, and a quarter of its block, which drops the
// coupling of the masters and keeps the sum positive.
static void hand_over(Implicit *system)
{
    for (int i = 0; i < system->hanging; i++)
        for (int k = 0; k < 2; k++) {
            const int from = system->moving + i, to = system->master[i][k];
            system->residual[to] += 0.5 * system->residual[from];
            for (int c = 0; c < 3; c++)
                system->inverse[to].column[c] += 0.25 * system->inverse[from].column[c];
        }
}

// Computes the distance of a node from its virtual node, which follows a motion, and its relative
// velocity.
INLINE void follow(const FramePose *pose, const double *rest, Quad x, Quad v, Quad *away,
                   Quad *slip)
{
    Quad p = x, target = {0};
    double arm[3];
    // Arms from the frame's centre, now and at rest.
    for (int c = 0; c < 3; c++) {
        p[c] -= pose->center[c];
        arm[c] = rest[(long)c * LANES] - pose->rest_center[c];
    }
    for (int c = 0; c < 3; c++)
        target[c] = pose->rotation[c][0] * arm[0] + pose->rotation[c][1] * arm[1] +
                    pose->rotation[c][2] * arm[2];
    // Velocity of the virtual node.
    const double *w = pose->angular, *b = pose->velocity;
    const Quad moves = {b[0] + w[1] * p[2] - w[2] * p[1], b[1] + w[2] * p[0] - w[0] * p[2],
                        b[2] + w[0] * p[1] - w[1] * p[0], 0.0};
    *away = p - target;
    *slip = v - moves;
}

// Returns the motion that a node's virtual node follows; NULL: it has no shape spring.
static const FramePose *pose_of(const SurfaceModel *model, int i)
{
    const Implicit *system = model->implicit;
    const int frame = system->frame != NULL ? system->frame[i] : 0;
    if (frame == FRAME_LOOSE)
        return NULL;
    return frame > 0 ? &model->detail->frames->frame[frame - 1].pose : &model->basis.rigid->pose;
}

// Adds shape-spring and external forces of a moving node, and their part of its diagonal.
static void add_node(SurfaceModel *model, const Scales *by, const Quad *gravity, bool external,
                     int i)
{
    Implicit *system = model->implicit;
    const NodeTable *nodes = &model->nodes;
    const int slot = system->slot[i], lane = model_lane_of(model, slot);
    const Quad v = quad_row(system->rows, slot, 4);
    const double mass = 1.0 / ((const double *)nodes->inverse_mass)[lane];
    double inertia = mass, weight = mass;
    Quad outer = mass * *gravity, inner = {0};
    // Forces from outside.
    if (external) {
        const double *force = (const double *)model->external + model_lane(lane);
        outer += (Quad){force[0], force[LANES], force[2 * LANES], 0.0};
    }
    // The shape spring, of which the matrix has the diagonal.
    if (model->shape != SHAPE_FRAME_NONE) {
        const double rate = mass * ((const double *)nodes->shape_rate)[lane];
        const double drag = mass * ((const double *)nodes->drag)[lane];
        const double *rest = (const double *)nodes->rest + model_lane(lane);
        outer -= drag * v;
        inertia += system->theta * by->h * drag; // theta also of a violent step
        weight = inertia;
        if (model->shape == SHAPE_FRAME_WORLD) {
            const Quad still = {rest[0], rest[LANES], rest[2 * LANES], 0.0};
            inner -= rate * (quad_row(system->rows, slot, 0) - still + by->part * v);
            weight += by->part * by->part * rate;
        } else if (pose_of(model, i) != NULL) {
            const double shape_drag = mass * ((const double *)nodes->shape_drag)[lane];
            Quad away, slip;
            follow(pose_of(model, i), rest, quad_row(system->rows, slot, 0), v, &away, &slip);
            inner -= rate * away + (shape_drag + by->part * rate) * slip;
            weight += by->part * (shape_drag + by->part * rate);
        }
    }
    system->outer[i] = outer;
    system->inertia[i] = inertia;
    system->weight[i] = weight;
    system->residual[i] += by->h * (outer + inner);
    for (int c = 0; c < 3; c++)
        system->inverse[i].column[c][c] += weight;
}

// Inverts a block by its factors L D L^T: it may be stiff along the wall and nearly free across it.
static void invert(Block *block)
{
    const Quad *m = block->column;
    const double d0 = m[0][0], l1 = m[0][1] / d0, l2 = m[0][2] / d0;
    const double d1 = m[1][1] - l1 * m[0][1], l3 = (m[1][2] - l2 * m[0][1]) / d1;
    const double d2 = m[2][2] - l2 * m[0][2] - l3 * l3 * d1;
    const double k = l1 * l3 - l2; // of L^-1
    const double xx = 1.0 / d0 + l1 * l1 / d1 + k * k / d2, xy = -l1 / d1 - k * l3 / d2,
                 xz = k / d2, yy = 1.0 / d1 + l3 * l3 / d2, yz = -l3 / d2, zz = 1.0 / d2;
    block->column[0] = (Quad){xx, xy, xz, 0.0};
    block->column[1] = (Quad){xy, yy, yz, 0.0};
    block->column[2] = (Quad){xz, yz, zz, 0.0};
}

static void assemble(SurfaceModel *model)
{
    Implicit *system = model->implicit;
    const BodyParameters *p = model->parameters;
    system->share = choose_share(model);
    const Scales by = {
        .stiffness = p->stiffness_scale,
        .damping_time = fmin(model->damping_time * p->damping_scale, IMPLICIT_DAMPING * system->h),
        .h = system->h,
        .part = system->share * system->h};
    // An empty system.
    const size_t numbers = (size_t)(system->moving + system->hanging) + 1;
    memset(system->residual, 0, numbers * sizeof *system->residual);
    memset(system->inverse, 0, numbers * sizeof *system->inverse);
    system->edge_count = system->hinge_count = 0;
    // Virtual nodes follow the rigid motion at the start of the step.
    if (model->shape == SHAPE_FRAME_BODY) {
        rigid_frame_fit(model->basis.rigid, system->rows);
        if (system->frame != NULL)
            detail_frames_fit(model, system->rows);
    }
    // Springs; hanging nodes hand theirs on; then all that is diagonal.
    add_springs(model, &by);
    if (model->bending != NULL)
        add_hinges(model, &by);
    hand_over(system);
    const Quad gravity = {p->gravity[0], p->gravity[1], p->gravity[2], 0.0};
    const bool external = *model->loaded != 0 || model->touched_count > 0;
    for (int i = 0; i < system->moving; i++) {
        add_node(model, &by, &gravity, external, i);
        invert(&system->inverse[i]);
    }
}

#endif
