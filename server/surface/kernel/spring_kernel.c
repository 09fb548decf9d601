// SPDX-License-Identifier: MIT
// Spring forces, shape-preserving springs, external forces and the integrator's update of one
// stage, in one pass over the nodes (Choi et al. 2005, eqs 1, 2 and 10; damping of eq 10 on the
// full velocity vector, or as printed).
//
// Compiled once per precision and level with KERNEL_NAME, KERNEL_LEVEL, KERNEL_SINGLE and
// KERNEL_WIDTH. A lane is a node: its neighbours' rows are loaded whole and transposed in
// registers, so that all arithmetic runs across nodes and each node adds its springs in the order
// of its entries at any width. Branch-free where data decides (select, not if):
// server/PERFORMANCE.md, "Masked loops that gcc 12 miscompiles".
#include "surface/kernel.h"

#include "base/vector.h"
#include "surface/kernel/bend.h"
#include "surface/kernel/law.h"

#include <string.h>

// Structure of vectors: the positions and velocities of WIDTH nodes.
typedef struct Nodes {
    Vector x, y, z, vx, vy, vz;
} Nodes;

INLINE void load_nodes(const Real *rows, const int *slot, bool velocities, Nodes *out)
{
    Vector p[3], v[3];
    vector_load_rows(rows, slot, velocities, p, v);
    out->x = p[0];
    out->y = p[1];
    out->z = p[2];
    if (velocities) {
        out->vx = v[0];
        out->vy = v[1];
        out->vz = v[2];
    }
}

// WIDTH consecutive slots.
INLINE void count_slots(int slots[WIDTH])
{
    for (int i = 0; i < WIDTH; i++)
        slots[i] = i;
}

// Loads the rows of WIDTH lanes from `lane` of the tables on; `scattered`: from anywhere in memory.
INLINE void load_own_nodes(const SpringPass *pass, const void *rows, long lane, bool scattered,
                           Nodes *out)
{
    int slots[WIDTH];
    count_slots(slots);
    if (scattered)
        load_nodes(rows, pass->springs->own + lane, true, out);
    else
        load_nodes((const Real *)rows + lane * ROW, slots, true, out);
}

INLINE void store_nodes(Real *rows, const int *slot, const Nodes *nodes)
{
    vector_store_rows(rows, slot, nodes->x, nodes->y, nodes->z);
    vector_store_rows(rows + 4, slot, nodes->vx, nodes->vy, nodes->vz);
}

// Adds a x (b - c).
INLINE void add_product(const Vector a[3], const Vector b[3], const Vector c[3], Vector sum[3])
{
    const Vector d[3] = {b[0] - c[0], b[1] - c[1], b[2] - c[2]};
    sum[0] += a[1] * d[2] - a[2] * d[1];
    sum[1] += a[2] * d[0] - a[0] * d[2];
    sum[2] += a[0] * d[1] - a[1] * d[0];
}

// Sums the spring forces on WIDTH nodes, before the stiffness scale. `law`: NULL for linear
// springs. `area`, of a wall that encloses a cavity: twice the vector area of the polygon of
// neighbours, six times the gradient of the volume.
INLINE void add_springs(const SpringPass *pass, const Nodes *own, int chunk, int lane,
                        SpringClass kind, const Law *law, bool scattered, Vector force[3],
                        Vector area[3])
{
    const bool damped = kind != SPRINGS_PLAIN, encloses = kind == SPRINGS_CAVITY;
    const SpringTable *table = pass->springs;
    const Real *present = pass->present, *rest_length = table->rest_length,
               *stiffness = table->stiffness;
    const Vector one = vector_set(1.0), tiny = vector_set(1e-24); // (1e-12 m)^2
    const Vector zero = vector_set(0.0), beta = vector_set(pass->damping_time);
    Vector fx = zero, fy = zero, fz = zero;
    const bool linear = law == NULL;
    // Of the neighbours: the first one, the last at an even number, and the one after that.
    Vector first[3] = {zero, zero, zero}, even[3] = {zero, zero, zero},
           between[3] = {zero, zero, zero};
    for (int c = 0; c < 3 && encloses; c++)
        area[c] = zero;
    const int end = scattered ? table->end[chunk] : table->start[chunk + 1];
    for (int entry = table->start[chunk]; entry < end; entry++) {
        long at = (long)entry * LANES + lane;
        Nodes other;
        load_nodes(present, table->neighbour + at, damped, &other);
        Vector dx = own->x - other.x, dy = own->y - other.y, dz = own->z - other.z;
        Vector r = vector_load(rest_length + at);
#if KERNEL_SINGLE
        const Real *e = (const Real *)table->rest_vector + (long)entry * 3 * LANES + lane;
        Vector ex = vector_load(e), ey = vector_load(e + LANES), ez = vector_load(e + 2 * LANES);
        Vector ux = dx, uy = dy, uz = dz;
        dx = ex + ux;
        dy = ey + uy;
        dz = ez + uz;
        Vector growth = (ex + dx) * ux + (ey + dy) * uy + (ez + dz) * uz; // of the squared length
        if (table->preload != NULL)
            growth += vector_load((const Real *)table->preload + at);
#endif
        // Neighbours come in the order of the faces around the node. Two products of three in a row
        // are one: a x b + b x c = b x (c - a).
        if (encloses) {
            const Vector d[3] = {dx, dy, dz};
            const int number = entry - table->start[chunk];
            if (number % 2 == 0) {
                if (number > 0)
                    add_product(between, d, even, area);
                for (int c = 0; c < 3; c++) {
                    even[c] = d[c];
                    first[c] = number == 0 ? d[c] : first[c];
                }
            } else {
                for (int c = 0; c < 3; c++)
                    between[c] = d[c];
            }
        }
        Vector length2 = dx * dx + dy * dy + dz * dz;
        Vector k = vector_load(stiffness + at);
#if KERNEL_SINGLE
        // A spring of zero length has no direction: adding (1e-12 m)^2, far below the rounding
        // error of any other spring, makes its force vanish without a test. One division serves
        // both growth / ((l + r) l) and beta approach / l^2.
        length2 += tiny;
        Vector length = vector_sqrt(length2), both = length + r;
        Vector pull = growth * length, drag = zero, share = one / (both * length2);
        if (damped) {
            Vector approach =
                (own->vx - other.vx) * dx + (own->vy - other.vy) * dy + (own->vz - other.vz) * dz;
            drag = (beta * both) * approach;
        }
        Vector factor;
        if (linear)
            factor = k * ((damped ? pull + drag : pull) * share);
        else // the extension is growth / (l + r)
            factor =
                k * (drag * share) + law_pull(law, entry, lane, growth * (length2 * share), r) *
                                         (k * ((both * length) * share));
#else
        // A spring of zero length has no direction: its force is 0 (the stiffness is masked).
        k = vector_select_greater(length2, tiny, k, zero);
        Vector length = vector_sqrt(vector_select_greater(length2, tiny, length2, one));
        Vector inverse = one / length, drag = zero;
        if (damped) {
            Vector approach =
                (own->vx - other.vx) * dx + (own->vy - other.vy) * dy + (own->vz - other.vz) * dz;
            drag = beta * (approach * (inverse * inverse));
        }
        Vector factor;
        if (linear)
            factor = k * (damped ? (one - r * inverse) + drag : one - r * inverse);
        else
            factor =
                k * drag + law_pull(law, entry, lane,
                                    vector_select_greater(length2, tiny, length, zero) - r, r) *
                               (k * inverse);
#endif
        fx -= factor * dx;
        fy -= factor * dy;
        fz -= factor * dz;
    }
    force[0] = fx;
    force[1] = fy;
    force[2] = fz;
    if (!encloses)
        return;
    // From the last neighbour back to the first.
    const Vector none[3] = {zero, zero, zero};
    if ((end - table->start[chunk]) % 2 == 0)
        add_product(between, first, even, area);
    else
        add_product(even, first, none, area);
}

// Adds the force of the pressure to the sum of WIDTH nodes, and returns the gradient of the volume
// [m2].
INLINE void add_pressure(const SpringPass *pass, const Vector area[3], Vector gradient[3],
                         Vector force[3])
{
    const Vector sixth = vector_set(1.0 / 6.0), pressure = vector_set(pass->cavity->pressure);
    for (int c = 0; c < 3; c++) {
        gradient[c] = sixth * area[c];
        force[c] += pressure * gradient[c];
    }
}

// Stores what WIDTH nodes add to the volume once they have moved by `way`; at the end of a tick
// also by how much that changes it.
INLINE void store_volume(const SpringPass *pass, const Nodes *own, const Vector gradient[3],
                         const Vector way[3], int chunk, int lane)
{
    const CavityPass *cavity = pass->cavity;
    const long slot = (long)chunk * LANES + lane;
    Vector x[3] = {own->x, own->y, own->z}, volume = vector_set(0.0), change = vector_set(0.0);
    for (int c = 0; c < 3; c++) {
#if KERNEL_SINGLE
        x[c] += vector_load((const Real *)cavity->place + ((long)chunk * 3 + c) * LANES + lane);
#endif
        volume += gradient[c] * x[c];
        change += gradient[c] * way[c];
    }
    vector_store((Real *)cavity->volume + slot, vector_set(1.0 / 3.0) * volume);
    vector_store((Real *)cavity->change + slot, change);
}

// Adds virtual nodes in the world, damped only along the spring: eq 10 as printed. A node within
// 1e-12 m of its rest position has no such direction: it is not damped.
INLINE void add_radial_shape(const SpringPass *pass, const Nodes *own, int chunk, int lane,
                             Vector a[3])
{
    const NodeTable *nodes = pass->nodes;
    const long slot = (long)chunk * LANES + lane;
    Vector away[3] = {own->x, own->y, own->z};
#if !KERNEL_SINGLE
    const Real *rest = (const Real *)nodes->rest + (long)chunk * 3 * LANES + lane;
    for (int c = 0; c < 3; c++)
        away[c] -= vector_load(rest + c * LANES);
#endif
    Vector rate = vector_load((const Real *)nodes->shape_rate + slot);
    Vector shape_drag = vector_load((const Real *)nodes->shape_drag + slot);
    Vector drag = vector_load((const Real *)nodes->drag + slot);
    Vector v[3] = {own->vx, own->vy, own->vz};
    Vector along = away[0] * v[0] + away[1] * v[1] + away[2] * v[2];
    Vector length2 = away[0] * away[0] + away[1] * away[1] + away[2] * away[2];
    const Vector one = vector_set(1.0), tiny = vector_set(1e-24), zero = vector_set(0.0);
    shape_drag = vector_select_greater(length2, tiny, shape_drag, zero);
    Vector pull = rate + shape_drag * (along / vector_select_greater(length2, tiny, length2, one));
    for (int c = 0; c < 3; c++)
        a[c] -= pull * away[c] + drag * v[c];
}

// Adds the acceleration of the shape-preserving springs and of nodal damping.
INLINE void add_shape(const SpringPass *pass, const Nodes *own, int chunk, int lane,
                      ShapeVariant shape, bool scattered, Vector a[3])
{
    if (shape == SHAPE_FRAME_WORLD_RADIAL) {
        add_radial_shape(pass, own, chunk, lane, a);
        return;
    }
    const NodeTable *nodes = pass->nodes;
    long slot = (long)chunk * LANES + lane;
    const long at = (long)chunk * 3 * LANES + lane;
    const Real *rest = nodes->rest; // NULL for displacements in the world's frame
    Vector rate = vector_load((const Real *)nodes->shape_rate + slot);
    Vector drag = vector_load((const Real *)nodes->drag + slot);
    Vector x[3] = {own->x, own->y, own->z}, v[3] = {own->vx, own->vy, own->vz};
    if (shape == SHAPE_FRAME_WORLD) {
        for (int c = 0; c < 3; c++) {
#if KERNEL_SINGLE
            a[c] -= rate * x[c] + drag * v[c];
#else
            a[c] -= rate * (x[c] - vector_load(rest + at + c * LANES)) + drag * v[c];
#endif
        }
        return;
    }
    // The virtual node follows the body's rigid motion: x - c - R (X - C), v - v_c - w x (x - c).
    const FramePose *f = pass->frame;
    Vector shape_drag = vector_load((const Real *)nodes->shape_drag + slot);
    Vector arm[3], away[3], p[3]; // X - C; x - c - (X - C) or x - c; x - c
    for (int c = 0; c < 3; c++) {
        arm[c] = vector_load(rest + at + c * LANES);
#if KERNEL_SINGLE
        if (scattered)
            arm[c] -= vector_set(f->rest_center[c]);
        away[c] = x[c] - vector_set(f->center[c] - f->rest_center[c]);
        p[c] = arm[c] + away[c];
#else
        (void)scattered;
        arm[c] -= vector_set(f->rest_center[c]);
        away[c] = x[c] - vector_set(f->center[c]);
        p[c] = away[c];
#endif
    }
    Vector wx = vector_set(f->angular[0]), wy = vector_set(f->angular[1]),
           wz = vector_set(f->angular[2]);
    Vector spin[3] = {wy * p[2] - wz * p[1], wz * p[0] - wx * p[2], wx * p[1] - wy * p[0]};
    for (int c = 0; c < 3; c++) {
        double turn[3]; // row of R, or of R - I for displacements
        for (int k = 0; k < 3; k++)
            turn[k] = f->rotation[c][k] - (KERNEL_SINGLE && c == k ? 1.0 : 0.0);
        Vector target = vector_set(turn[0]) * arm[0] + vector_set(turn[1]) * arm[1] +
                        vector_set(turn[2]) * arm[2];
        Vector slip = v[c] - vector_set(f->velocity[c]) - spin[c];
        a[c] -= rate * (away[c] - target) + shape_drag * slip + drag * v[c];
    }
}

// The integrator's coefficients, multiplied by the substep.
typedef struct Coefficients {
    EvaluationRule rule;
    Vector h, weight, advance;
} Coefficients;

// Updates one component of the two sums of an RK4 stage other than the last: see EvaluationRule.
static inline Vector advance_rk4(const Coefficients *by, Vector base, Vector from, Vector slope,
                                 Real *sum)
{
    vector_store(sum, from + by->weight * slope);
    return base + by->advance * slope;
}

INLINE void advance(const SpringPass *pass, const Coefficients *by, const Nodes *own,
                    const Vector a[3], int chunk, int lane, bool scattered, Nodes *next)
{
    // Leapfrog and Euler: the kick, then a drift with the new velocities.
    if (by->rule == EVALUATION_KICK) {
        next->vx = own->vx + by->h * a[0];
        next->vy = own->vy + by->h * a[1];
        next->vz = own->vz + by->h * a[2];
        next->x = own->x + by->advance * next->vx;
        next->y = own->y + by->advance * next->vy;
        next->z = own->z + by->advance * next->vz;
        return;
    }
    Real *sum = (Real *)pass->sum + (long)chunk * 6 * LANES + lane;
    Real *sums[6];
    for (int c = 0; c < 6; c++)
        sums[c] = sum + c * LANES;
    // The last RK4 stage adds its slope to the sums, which are the result.
    if (by->rule == EVALUATION_RK4_LAST) {
        next->x = vector_load(sums[0]) + by->weight * own->vx;
        next->y = vector_load(sums[1]) + by->weight * own->vy;
        next->z = vector_load(sums[2]) + by->weight * own->vz;
        next->vx = vector_load(sums[3]) + by->weight * a[0];
        next->vy = vector_load(sums[4]) + by->weight * a[1];
        next->vz = vector_load(sums[5]) + by->weight * a[2];
        return;
    }
    // The other RK4 stages update the sums and form the rows of the next stage.
    Nodes base = *own, from = *own;
    if (by->rule == EVALUATION_RK4_MIDDLE) {
        load_own_nodes(pass, pass->base, (long)chunk * LANES + lane, scattered, &base);
        from = (Nodes){vector_load(sums[0]), vector_load(sums[1]), vector_load(sums[2]),
                       vector_load(sums[3]), vector_load(sums[4]), vector_load(sums[5])};
    }
    next->x = advance_rk4(by, base.x, from.x, own->vx, sums[0]);
    next->y = advance_rk4(by, base.y, from.y, own->vy, sums[1]);
    next->z = advance_rk4(by, base.z, from.z, own->vz, sums[2]);
    next->vx = advance_rk4(by, base.vx, from.vx, a[0], sums[3]);
    next->vy = advance_rk4(by, base.vy, from.vy, a[1], sums[4]);
    next->vz = advance_rk4(by, base.vz, from.vz, a[2], sums[5]);
}

INLINE Vector square(Vector x, Vector y, Vector z)
{
    return x * x + y * y + z * z;
}

INLINE void evaluate(const SpringPass *pass, SpringClass kind, ShapeVariant shape, bool scattered)
{
    const Vector zero = vector_set(0.0), scale = vector_set(pass->stiffness_scale),
                 position_limit = vector_set(pass->position_limit * pass->position_limit),
                 velocity_limit = vector_set(SPEED_LIMIT * SPEED_LIMIT);
    const Vector gravity[3] = {vector_set(pass->gravity[0]), vector_set(pass->gravity[1]),
                               vector_set(pass->gravity[2])};
    const Coefficients by = {.rule = pass->evaluation.rule,
                             .h = vector_set(pass->h),
                             .weight = vector_set(pass->evaluation.weight * pass->h),
                             .advance = vector_set(pass->evaluation.advance * pass->h)};
    // Bad numbers of a stage propagate into the sum, and so into the substep's result; numbers that
    // went bad earlier in the tick are still bad.
    const bool ends =
        pass->evaluation.last && (by.rule == EVALUATION_RK4_LAST || by.rule == EVALUATION_KICK);
    Mask good = zero == zero;
    Law numbers;
    const Law *law = law_of(pass, kind, &numbers);
    for (int k = pass->first_chunk; k < pass->last_chunk; k++) {
        const int chunk = scattered ? pass->chunk[k] : k;
        for (int lane = 0; lane < LANES; lane += WIDTH) {
            long slot = (long)chunk * LANES + lane; // in the tables
            Nodes own;
            load_own_nodes(pass, pass->present, slot, scattered, &own);

            Vector force[3], a[3], area[3], gradient[3];
            add_springs(pass, &own, chunk, lane, kind, law, scattered, force, area);
            // The forces that hanging nodes pass to their masters.
            if (scattered && pass->carries[chunk]) {
                Vector handed[3], unused[3];
                vector_load_rows(pass->handed, pass->springs->own + slot, false, handed, unused);
                for (int c = 0; c < 3; c++)
                    force[c] += handed[c];
            }
            Vector inverse_mass = vector_load((const Real *)pass->nodes->inverse_mass + slot);
            for (int c = 0; c < 3; c++) {
                force[c] *= scale;
                if (pass->external != NULL)
                    force[c] += vector_load((const Real *)pass->external +
                                            ((long)chunk * 3 + c) * LANES + lane);
            }
            if (kind == SPRINGS_CAVITY)
                add_pressure(pass, area, gradient, force);
            for (int c = 0; c < 3; c++)
                a[c] = force[c] * inverse_mass +
                       vector_select_greater(inverse_mass, zero, gravity[c], zero);
            if (shape != SHAPE_FRAME_NONE)
                add_shape(pass, &own, chunk, lane, shape, scattered, a);

            Nodes next;
            advance(pass, &by, &own, a, chunk, lane, scattered, &next);
            if (kind == SPRINGS_CAVITY && pass->cavity->volume != NULL) {
                const Vector way[3] = {next.x - own.x, next.y - own.y, next.z - own.z};
                store_volume(pass, &own, gradient, way, chunk, lane);
            }
            if (ends) // a sum of squares is NaN or infinite where one of them is
                good &= (square(next.x, next.y, next.z) <= position_limit) &
                        (square(next.vx, next.vy, next.vz) <= velocity_limit);
            int slots[WIDTH];
            count_slots(slots);
            if (scattered)
                store_nodes(pass->next, pass->springs->own + slot, &next);
            else
                store_nodes((Real *)pass->next + slot * ROW, slots, &next);
        }
    }
    if (vector_any((Vector)~good))
        *pass->bad = true;
}

// Sums spring forces only, before the stiffness scale, for nodes that do not move by themselves.
INLINE void add_up(const SpringPass *pass, SpringClass kind)
{
    Law numbers;
    const Law *law = law_of(pass, kind, &numbers);
    const Vector way = vector_set(pass->evaluation.advance * pass->h);
    for (int k = pass->first_chunk; k < pass->last_chunk; k++)
        for (int lane = 0; lane < LANES; lane += WIDTH) {
            const int chunk = pass->chunk[k];
            const int *slot = pass->springs->own + (long)chunk * LANES + lane;
            Nodes own;
            load_own_nodes(pass, pass->present, (long)chunk * LANES + lane, true, &own);
            Vector force[3], area[3], gradient[3];
            add_springs(pass, &own, chunk, lane, kind, law, true, force, area);
            // They move with their masters; here by the velocity before the kick.
            if (kind == SPRINGS_CAVITY) {
                const Vector by[3] = {way * own.vx, way * own.vy, way * own.vz};
                add_pressure(pass, area, gradient, force);
                if (pass->cavity->volume != NULL)
                    store_volume(pass, &own, gradient, by, chunk, lane);
            }
            vector_store_rows(pass->handed, slot, force[0], force[1], force[2]);
        }
}

static void drift(const void *present, void *next, int slot_count, double dt)
{
    const Real *from = present;
    Real *to = next;
    const Real step = REAL(dt);
    // In groups of four: otherwise gcc 12 shuffles several rows together and takes twice as long.
    for (long i = 0; i < (long)slot_count * ROW; i += ROW) {
        Block position, velocity;
        memcpy(&position, from + i, sizeof position);
        memcpy(&velocity, from + i + 4, sizeof velocity);
        position += step * velocity;
        memcpy(to + i, &position, sizeof position);
        memcpy(to + i + 4, &velocity, sizeof velocity);
    }
}

// The kernels: one for each class of springs, frame of virtual nodes and layout.
#define EACH_SHAPE(X, kind)                                                                        \
    X(kind, SHAPE_FRAME_NONE)                                                                      \
    X(kind, SHAPE_FRAME_WORLD)                                                                     \
    X(kind, SHAPE_FRAME_BODY)                                                                      \
    X(kind, SHAPE_FRAME_WORLD_RADIAL)
#define EACH_KERNEL(X)                                                                             \
    EACH_SHAPE(X, SPRINGS_PLAIN)                                                                   \
    EACH_SHAPE(X, SPRINGS_DAMPED)                                                                  \
    EACH_SHAPE(X, SPRINGS_LAW)                                                                     \
    EACH_SHAPE(X, SPRINGS_CAVITY)
#define EACH_CLASS(X) X(SPRINGS_PLAIN) X(SPRINGS_DAMPED) X(SPRINGS_LAW) X(SPRINGS_CAVITY)

#define DEFINE_KERNELS(kind, shape)                                                                \
    static void evaluate_##kind##_##shape(const SpringPass *pass)                                  \
    {                                                                                              \
        evaluate(pass, kind, shape, false);                                                        \
    }                                                                                              \
    static void scattered_##kind##_##shape(const SpringPass *pass)                                 \
    {                                                                                              \
        evaluate(pass, kind, shape, true);                                                         \
    }
#define DEFINE_SUM(kind)                                                                           \
    static void sum_##kind(const SpringPass *pass)                                                 \
    {                                                                                              \
        add_up(pass, kind);                                                                        \
    }
EACH_KERNEL(DEFINE_KERNELS)
EACH_CLASS(DEFINE_SUM)

#define NAME_EVALUATE(kind, shape)  [kind][shape] = evaluate_##kind##_##shape,
#define NAME_SCATTERED(kind, shape) [kind][shape] = scattered_##kind##_##shape,
#define NAME_SUM(kind)              [kind] = sum_##kind,

extern const SpringKernels KERNEL_NAME;
const SpringKernels KERNEL_NAME = {
    .level = KERNEL_LEVEL,
    .precision = KERNEL_SINGLE ? PRECISION_SINGLE : PRECISION_DOUBLE,
    .evaluate = {EACH_KERNEL(NAME_EVALUATE)},
    .scattered = {EACH_KERNEL(NAME_SCATTERED)},
    .sum = {EACH_CLASS(NAME_SUM)},
    .law_root = STIFFENING_ROOT,
    .bend = {bend_plain, bend_damped},
    .bend_measure = bend_measure,
    .bend_gather = bend_gather,
    .drift = drift,
};
