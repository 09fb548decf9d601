// Spring forces, shape-preserving springs, outside forces and the integrator's algebra of one
// stage, in one pass over the nodes (Choi et al. 2005, eq 1, 2 and 10; damping of eq 10 on the full
// vector).
//
// Compiled once a level with KERNEL_NAME, KERNEL_LEVEL and KERNEL_WIDTH (doubles in a vector). A
// lane is a node: its neighbours' rows are loaded whole and transposed in registers, so that all
// arithmetic runs across nodes and each node adds its springs in the order of its entries, whatever
// the width. Branch-free where data decides (select, not if): gcc 12 miscompiles masked conditional
// loops.
#include "surface/kernel.h"

#include "kernel/vector.h"

#include <string.h>

// Structure of vectors: the position and velocity of WIDTH nodes.
typedef struct Nodes {
    Vector x, y, z, vx, vy, vz;
} Nodes;

static inline void load_nodes(const double *rows, const int *slot, bool velocities, Nodes *out)
{
    const double *row[WIDTH];
    for (int i = 0; i < WIDTH; i++)
        row[i] = rows + (long)slot[i] * ROW;
    vector_load_transposed(row, 0, &out->x, &out->y, &out->z);
    if (velocities)
        vector_load_transposed(row, 4, &out->vx, &out->vy, &out->vz);
}

static inline void store_nodes(double *rows, const Nodes *nodes)
{
    vector_store_transposed(rows, nodes->x, nodes->y, nodes->z);
    vector_store_transposed(rows + 4, nodes->vx, nodes->vy, nodes->vz);
}

// Sum of the spring forces on WIDTH nodes, before the stiffness scale.
static inline void add_springs(const SpringPass *pass, const Nodes *own, int chunk, int lane,
                               bool damped, Vector force[3])
{
    const SpringTable *table = pass->springs;
    const Vector one = vector_set(1.0), tiny = vector_set(1e-24); // (1e-12 m)^2
    const Vector beta = vector_set(pass->damping_time);
    Vector fx = vector_set(0.0), fy = fx, fz = fx;
    for (int entry = table->start[chunk]; entry < table->start[chunk + 1]; entry++) {
        long at = (long)entry * LANES + lane;
        Nodes other;
        load_nodes(pass->present, table->neighbour + at, damped, &other);
        Vector dx = own->x - other.x, dy = own->y - other.y, dz = own->z - other.z;
        Vector length2 = dx * dx + dy * dy + dz * dz;
        // A spring without length has no direction: force 0 (its stiffness is masked away).
        Vector usable = vector_select_greater(length2, tiny, length2, one);
        Vector k = vector_select_greater(length2, tiny, vector_load(table->stiffness + at),
                                         vector_set(0.0));
        Vector inverse = one / vector_sqrt(usable);
        Vector pull = one - vector_load(table->rest_length + at) * inverse;
        if (damped) {
            Vector approach =
                (own->vx - other.vx) * dx + (own->vy - other.vy) * dy + (own->vz - other.vz) * dz;
            pull += beta * (approach * (inverse * inverse));
        }
        Vector factor = k * pull;
        fx -= factor * dx;
        fy -= factor * dy;
        fz -= factor * dz;
    }
    force[0] = fx;
    force[1] = fy;
    force[2] = fz;
}

// Adds the acceleration of the shape-preserving springs and of nodal damping.
static inline void add_shape(const SpringPass *pass, const Nodes *own, int chunk, int lane,
                             ShapeVariant shape, Vector a[3])
{
    long slot = (long)chunk * LANES + lane;
    const double *rest = pass->nodes->rest + (long)chunk * 3 * LANES + lane;
    Vector rate = vector_load(pass->nodes->shape_rate + slot);
    Vector drag = vector_load(pass->nodes->drag + slot);
    Vector X = vector_load(rest), Y = vector_load(rest + LANES), Z = vector_load(rest + 2 * LANES);
    if (shape == SHAPE_FRAME_WORLD) {
        a[0] -= rate * (own->x - X) + drag * own->vx;
        a[1] -= rate * (own->y - Y) + drag * own->vy;
        a[2] -= rate * (own->z - Z) + drag * own->vz;
        return;
    }
    // The virtual node moves with the body's rigid motion: x - c - R (X - C), v - v_c - w x (x -
    // c).
    const FramePose *f = pass->frame;
    Vector shape_drag = vector_load(pass->nodes->shape_drag + slot);
    Vector qx = X - vector_set(f->rest_center[0]), qy = Y - vector_set(f->rest_center[1]),
           qz = Z - vector_set(f->rest_center[2]);
    Vector px = own->x - vector_set(f->center[0]), py = own->y - vector_set(f->center[1]),
           pz = own->z - vector_set(f->center[2]);
    Vector wx = vector_set(f->angular[0]), wy = vector_set(f->angular[1]),
           wz = vector_set(f->angular[2]);
    Vector p[3] = {px, py, pz}, v[3] = {own->vx, own->vy, own->vz};
    Vector spin[3] = {wy * pz - wz * py, wz * px - wx * pz, wx * py - wy * px};
    for (int c = 0; c < 3; c++) {
        Vector target = vector_set(f->rotation[c][0]) * qx + vector_set(f->rotation[c][1]) * qy +
                        vector_set(f->rotation[c][2]) * qz;
        Vector slip = v[c] - vector_set(f->velocity[c]) - spin[c];
        a[c] -= rate * (p[c] - target) + shape_drag * slip + drag * v[c];
    }
}

// next = y0 + advance h k, sum = (y0 or sum) + weight h k, for one component.
static inline Vector advance_rk4(const SpringPass *pass, Vector base, Vector slope, double *sum)
{
    Vector step = vector_set(pass->h) * slope;
    Vector weighted = vector_set(pass->stage.weight) * step;
    switch (pass->stage.rule) {
    case STAGE_RK4_FIRST:
        vector_store(sum, base + weighted);
        break;
    case STAGE_RK4_MIDDLE:
        vector_store(sum, vector_load(sum) + weighted);
        break;
    default:
        return vector_load(sum) + weighted;
    }
    return base + vector_set(pass->stage.advance) * step;
}

static inline void advance(const SpringPass *pass, const Nodes *own, const Vector a[3], int chunk,
                           int lane, Nodes *next)
{
    if (pass->stage.rule == STAGE_KICK) {
        Vector h = vector_set(pass->h), drift = vector_set(pass->stage.advance * pass->h);
        next->vx = own->vx + h * a[0];
        next->vy = own->vy + h * a[1];
        next->vz = own->vz + h * a[2];
        next->x = own->x + drift * next->vx;
        next->y = own->y + drift * next->vy;
        next->z = own->z + drift * next->vz;
        return;
    }
    int slots[WIDTH];
    for (int i = 0; i < WIDTH; i++)
        slots[i] = chunk * LANES + lane + i;
    Nodes base;
    load_nodes(pass->base, slots, true, &base);
    double *sum = pass->sum + (long)chunk * 6 * LANES + lane;
    next->x = advance_rk4(pass, base.x, own->vx, sum);
    next->y = advance_rk4(pass, base.y, own->vy, sum + LANES);
    next->z = advance_rk4(pass, base.z, own->vz, sum + 2 * LANES);
    next->vx = advance_rk4(pass, base.vx, a[0], sum + 3 * LANES);
    next->vy = advance_rk4(pass, base.vy, a[1], sum + 4 * LANES);
    next->vz = advance_rk4(pass, base.vz, a[2], sum + 5 * LANES);
}

static inline __attribute__((always_inline)) void evaluate(const SpringPass *pass, bool damped,
                                                           ShapeVariant shape, bool external)
{
    const Vector zero = vector_set(0.0), position_limit = vector_set(pass->position_limit),
                 velocity_limit = vector_set(SPEED_LIMIT),
                 scale = vector_set(pass->stiffness_scale);
    Vector bad = zero;
    for (int chunk = 0; chunk < pass->springs->chunk_count; chunk++) {
        for (int lane = 0; lane < LANES; lane += WIDTH) {
            long slot = (long)chunk * LANES + lane;
            int slots[WIDTH];
            for (int i = 0; i < WIDTH; i++)
                slots[i] = (int)slot + i;
            Nodes own;
            load_nodes(pass->present, slots, true, &own);

            Vector force[3], a[3];
            add_springs(pass, &own, chunk, lane, damped, force);
            Vector inverse_mass = vector_load(pass->nodes->inverse_mass + slot);
            for (int c = 0; c < 3; c++) {
                force[c] *= scale;
                if (external)
                    force[c] += vector_load(pass->external + ((long)chunk * 3 + c) * LANES + lane);
                Vector gravity = vector_set(pass->gravity[c]);
                a[c] = force[c] * inverse_mass +
                       vector_select_greater(inverse_mass, zero, gravity, zero);
            }
            if (shape != SHAPE_FRAME_NONE)
                add_shape(pass, &own, chunk, lane, shape, a);

            Nodes next;
            advance(pass, &own, a, chunk, lane, &next);
            bad = vector_or(bad, vector_not_within(next.x, position_limit));
            bad = vector_or(bad, vector_not_within(next.y, position_limit));
            bad = vector_or(bad, vector_not_within(next.z, position_limit));
            bad = vector_or(bad, vector_not_within(next.vx, velocity_limit));
            bad = vector_or(bad, vector_not_within(next.vy, velocity_limit));
            bad = vector_or(bad, vector_not_within(next.vz, velocity_limit));
            store_nodes(pass->next + slot * ROW, &next);
        }
    }
    if (vector_any(bad))
        *pass->bad = true;
}

#define VARIANT(name, damped, shape, external)                                                     \
    static void name(const SpringPass *pass)                                                       \
    {                                                                                              \
        evaluate(pass, damped, shape, external);                                                   \
    }
VARIANT(plain_none, false, SHAPE_FRAME_NONE, false)
VARIANT(plain_none_external, false, SHAPE_FRAME_NONE, true)
VARIANT(plain_world, false, SHAPE_FRAME_WORLD, false)
VARIANT(plain_world_external, false, SHAPE_FRAME_WORLD, true)
VARIANT(plain_body, false, SHAPE_FRAME_BODY, false)
VARIANT(plain_body_external, false, SHAPE_FRAME_BODY, true)
VARIANT(damped_none, true, SHAPE_FRAME_NONE, false)
VARIANT(damped_none_external, true, SHAPE_FRAME_NONE, true)
VARIANT(damped_world, true, SHAPE_FRAME_WORLD, false)
VARIANT(damped_world_external, true, SHAPE_FRAME_WORLD, true)
VARIANT(damped_body, true, SHAPE_FRAME_BODY, false)
VARIANT(damped_body_external, true, SHAPE_FRAME_BODY, true)

extern const SpringKernels KERNEL_NAME;
const SpringKernels KERNEL_NAME = {
    .level = KERNEL_LEVEL,
    .evaluate = {{{plain_none, plain_none_external},
                  {plain_world, plain_world_external},
                  {plain_body, plain_body_external}},
                 {{damped_none, damped_none_external},
                  {damped_world, damped_world_external},
                  {damped_body, damped_body_external}}},
};
