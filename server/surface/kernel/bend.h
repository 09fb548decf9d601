// SPDX-License-Identifier: MIT
// Part of the spring kernel: hinges between faces (surface/bending.h), a hinge to a lane. Their
// forces are added to rows one after another, so that sums have one order at any width.
#ifndef PLIANT_SURFACE_KERNEL_BEND_H
#define PLIANT_SURFACE_KERNEL_BEND_H

#include "base/vector.h"
#include "surface/kernel.h"

static const double PI = 3.14159265358979323846;

// Returns atan(t) for |t| <= tan(pi/8), with an error of a few units in the last place (the
// approximations of the Cephes library, Moshier 1989).
INLINE Vector atan_of(Vector t)
{
    Vector z = t * t;
#if KERNEL_SINGLE
    Vector p = ((vector_set(8.05374449538e-2) * z - vector_set(1.38776856032e-1)) * z +
                vector_set(1.99777106478e-1)) *
                   z -
               vector_set(3.33329491539e-1);
    return t + t * z * p;
#else
    static const double above[5] = {-8.750608600031904122785e-1, -1.615753718733365076637e1,
                                    -7.500855792314704667340e1, -1.228866684490136173410e2,
                                    -6.485021904942025371773e1},
                        below[5] = {2.485846490142306297962e1, 1.650270098316988542046e2,
                                    4.328810604912902668951e2, 4.853903996359136964868e2,
                                    1.945506571482613964425e2};
    Vector p = vector_set(above[0]), q = z + vector_set(below[0]);
    for (int i = 1; i < 5; i++) {
        p = p * z + vector_set(above[i]);
        q = q * z + vector_set(below[i]);
    }
    return t + t * z * (p / q);
#endif
}

// Returns the angle of (x, y) [rad]; any number if both are 0.
INLINE Vector angle_of(Vector y, Vector x)
{
    const Vector zero = vector_set(0.0), one = vector_set(1.0);
    Vector across = vector_select_greater(zero, y, -y, y),
           along = vector_select_greater(zero, x, -x, x);
    // To the first half of the first quadrant, then to its first half.
    Vector low = vector_select_greater(across, along, along, across),
           high = vector_select_greater(across, along, across, along);
    Vector turn = low - vector_set(0.41421356237309505) * high; // above 0: beyond pi/8
    Vector above = vector_select_greater(turn, zero, low - high, low);
    Vector below = vector_select_greater(turn, zero, low + high, high);
    below = vector_select_greater(below, zero, below, one);
    Vector angle =
        atan_of(above / below) + vector_select_greater(turn, zero, vector_set(0.25 * PI), zero);
    // And back.
    angle = vector_select_greater(across, along, vector_set(0.5 * PI) - angle, angle);
    angle = vector_select_greater(zero, x, vector_set(PI) - angle, angle);
    return vector_select_greater(zero, y, -angle, angle);
}

INLINE Vector dot(const Vector a[3], const Vector b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

INLINE void cross(const Vector a[3], const Vector b[3], Vector out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

// Two faces at an edge.
typedef struct BendFold {
    Vector left[3], right[3]; // their normals, as long as twice their areas [m2]
    Vector square[2];         // of those lengths [m4]
    Vector length2, length;   // of the edge [m2], [m]
    Vector angle;             // [rad]
} BendFold;

// The vectors lead from the first end of the edge to the second and to both third nodes.
INLINE void fold_at(const Vector edge[3], const Vector c[3], const Vector d[3], BendFold *fold)
{
    cross(edge, c, fold->left);
    cross(d, edge, fold->right);
    fold->square[0] = dot(fold->left, fold->left);
    fold->square[1] = dot(fold->right, fold->right);
    fold->length2 = dot(edge, edge);
    fold->length = vector_sqrt(fold->length2);
    // (left x right) . edge = -(left . d) |edge|^2.
    fold->angle = angle_of(-(dot(fold->left, d) * fold->length), dot(fold->left, fold->right));
}

INLINE void load_three(const Real *from, Vector out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = vector_load(from + c * LANES);
}

INLINE void add_row(Real *to, const Real *from)
{
    Block sum, add;
    memcpy(&sum, to, sizeof sum);
    memcpy(&add, from, sizeof add);
    sum += add;
    memcpy(to, &sum, sizeof sum);
}

INLINE void bend(const BendPass *pass, bool damped)
{
    const HingeTable *table = pass->hinges;
    const Vector zero = vector_set(0.0), one = vector_set(1.0), whole = vector_set(2.0 * PI),
                 half = vector_set(PI), beta = vector_set(pass->damping_time);
    Real *force = pass->force;
    for (int g = 0; g < pass->group_count; g++)
        for (int lane = 0; lane < LANES; lane += WIDTH) {
            const int *slot = table->slot + ((long)pass->group[g] * 4) * LANES + lane;
            const Real *value =
                (const Real *)table->value + (long)pass->group[g] * table->values * LANES + lane;
            // Vectors from the first node, and velocities relative to it.
            Vector origin[3], slow[3], arm[3][3], speed[3][3];
            vector_load_rows(pass->present, slot, damped, origin, slow);
            for (int k = 0; k < 3; k++) {
                vector_load_rows(pass->present, slot + (k + 1) * LANES, damped, arm[k], speed[k]);
                for (int c = 0; c < 3; c++) {
                    arm[k][c] -= origin[c];
                    if (damped)
                        speed[k][c] -= slow[c];
                }
#if KERNEL_SINGLE
                Vector rest[3];
                load_three(value + (HINGE_REST + 3 * k) * LANES, rest);
                for (int c = 0; c < 3; c++)
                    arm[k][c] += rest[c];
#endif
            }
            BendFold fold;
            fold_at(arm[0], arm[1], arm[2], &fold);
            // A face without area has no direction, and its hinge no moment.
            Vector least = vector_select_greater(fold.square[0], fold.square[1], fold.square[1],
                                                 fold.square[0]);
            Vector stiffness = vector_select_greater(
                least, zero, vector_load(value + HINGE_STIFFNESS * LANES), zero);
            Vector safe[2];
            for (int side = 0; side < 2; side++)
                safe[side] = one / vector_select_greater(least, zero, fold.square[side], one);
            Vector inverse = one / vector_select_greater(least, zero, fold.length2, one);
            // How the angle changes with the nodes: turning a face about the edge moves its third
            // node by its height, and the ends of the edge balance forces and moments.
            Vector by_left = fold.length * safe[0], by_right = fold.length * safe[1];
            Vector s = dot(arm[1], arm[0]) * inverse, t = dot(arm[2], arm[0]) * inverse;
            Vector second[3], third[3], fourth[3];
            for (int c = 0; c < 3; c++) {
                third[c] = -(by_left * fold.left[c]);
                fourth[c] = -(by_right * fold.right[c]);
                second[c] = -(s * third[c] + t * fourth[c]);
            }
            Vector change = fold.angle - vector_load(value + HINGE_ANGLE * LANES);
            change = vector_select_greater(change, half, change - whole, change);
            change = vector_select_greater(-half, change, change + whole, change);
            if (damped)
                change +=
                    beta * (dot(second, speed[0]) + dot(third, speed[1]) + dot(fourth, speed[2]));
            // The moment fades with the area of the smaller face.
            Vector share = one;
            for (int side = 0; side < 2; side++) {
                Vector kept = fold.square[side] * vector_load(value + (HINGE_FADE + side) * LANES);
                share = vector_select_greater(share, kept, kept, share);
            }
            Vector moment = -(stiffness * share * change);
            // Forces, which sum to zero, added to the rows hinge by hinge.
            Real row[4][4 * WIDTH];
            Vector first[3];
            for (int c = 0; c < 3; c++) {
                second[c] *= moment;
                third[c] *= moment;
                fourth[c] *= moment;
                first[c] = -(second[c] + third[c] + fourth[c]);
            }
            vector_spread_rows(row[0], first[0], first[1], first[2]);
            vector_spread_rows(row[1], second[0], second[1], second[2]);
            vector_spread_rows(row[2], third[0], third[1], third[2]);
            vector_spread_rows(row[3], fourth[0], fourth[1], fourth[2]);
            enum { PART = WIDTH < 4 ? WIDTH : 4 };
            for (int i = 0; i < WIDTH; i += PART)
                for (int j = 0; j < PART; j++)
                    for (int k = 0; k < 4; k++)
                        add_row(force + (long)slot[k * LANES + i + j] * ROW,
                                row[k] + vector_row_at(j) + i);
        }
}

static void bend_plain(const BendPass *pass)
{
    bend(pass, false);
}

static void bend_damped(const BendPass *pass)
{
    bend(pass, true);
}

static void bend_measure(const void *vectors, void *angle, void *squares)
{
    for (int lane = 0; lane < LANES; lane += WIDTH) {
        Vector arm[3][3];
        for (int k = 0; k < 3; k++)
            load_three((const Real *)vectors + 3 * k * LANES + lane, arm[k]);
        BendFold fold;
        fold_at(arm[0], arm[1], arm[2], &fold);
        vector_store((Real *)angle + lane, fold.angle);
        vector_store((Real *)squares + lane, fold.square[0]);
        vector_store((Real *)squares + LANES + lane, fold.square[1]);
    }
}

static void bend_gather(const void *force, double scale, const void *external, int chunk_count,
                        void *to)
{
    const Vector by = vector_set(scale);
    int slots[WIDTH];
    for (int i = 0; i < WIDTH; i++)
        slots[i] = i;
    for (long lane = 0; lane < (long)chunk_count * LANES; lane += WIDTH) {
        Vector sum[3], unused[3];
        vector_load_rows((const Real *)force + lane * ROW, slots, false, sum, unused);
        const long at = lane / LANES * 3 * LANES + lane % LANES;
        for (int c = 0; c < 3; c++) {
            Vector outer = external == NULL ? vector_set(0.0)
                                            : vector_load((const Real *)external + at + c * LANES);
            vector_store((Real *)to + at + c * LANES, outer + by * sum[c]);
        }
    }
}

#endif
