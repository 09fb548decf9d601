// SPDX-License-Identifier: MIT
// Forces of plane elements (Miyazaki et al. 2004, section 2.2; the affine law of shape.h).
// Compiled once per precision and level with KERNEL_NAME, KERNEL_LEVEL, KERNEL_SINGLE and
// KERNEL_WIDTH. A lane is an element. In terms of displacements, with G = F - 1, the parts of a
// deformation are
//   p = 2 + G00 + G11, q = G10 - G01, n = |(p, q)|, R = (p, q) / n, tr D = n - 2,
//   F - R = (tr D / 2) R + B, B = [b0 b1; b1 -b0], 2 b0 = G00 - G11, 2 b1 = G10 + G01,
// so that P = R (2 mu D + lambda tr(D) 1) = (mu + lambda) tr D R + 2 mu B; and tr D itself is (g (4
// + g) + q^2) / (n + 2) with g = G00 + G11: nothing cancels near rest.
#include "plane/kernel.h"

#include "base/vector.h"

#include <string.h>

enum { LANES = PLANE_LANES };

// The vertices of a batch, WIDTH lanes at a time; forces of all lanes until they are added.
typedef struct Nodes {
    Vector x[PLANE_PLACES], y[PLANE_PLACES], vx[PLANE_PLACES], vy[PLANE_PLACES];
} Nodes;
typedef struct Forces {
    Real row[PLANE_PLACES][LANES * 4]; // as vector_spread_rows writes them, WIDTH lanes at a time
} Forces;

INLINE void load_nodes(const PlanePass *pass, const int *vertex, int count, bool damped, Nodes *out)
{
    for (int i = 0; i < count; i++) {
        Vector u[3], v[3];
        vector_load_rows(pass->rows, vertex + i * LANES, damped, u, v);
        out->x[i] = u[0], out->y[i] = u[1];
        if (damped)
            out->vx[i] = v[0], out->vy[i] = v[1];
    }
}

INLINE void keep_forces(Forces *forces, int i, int lane, Vector x, Vector y)
{
    vector_spread_rows(forces->row[i] + 4L * lane, x, y, vector_set(0.0));
}

// Adds vertex by vertex, in each the lanes in order: the same sums at any width.
INLINE void add_forces(const PlanePass *pass, const int *vertex, int count, const Forces *forces)
{
    Real *force = pass->force;
    for (int i = 0; i < count; i++)
        for (int lane = 0; lane < LANES; lane++) {
            Real *to = force + 4L * vertex[i * LANES + lane];
            Block sum, f;
            memcpy(&sum, to, sizeof sum);
            memcpy(&f, forces->row[i] + 4 * (lane / WIDTH * WIDTH) + vector_row_at(lane % WIDTH),
                   sizeof f);
            sum += f;
            memcpy(to, &sum, sizeof sum);
        }
}

// The rotation and tr D. Where every rotation fits equally (n = 0) it is none.
typedef struct Rotation {
    Vector c, s, n, inverse, trace;
} Rotation;

INLINE Rotation rotation_of(Vector g, Vector q)
{
    const Vector one = vector_set(1.0), two = vector_set(2.0), four = vector_set(4.0),
                 zero = vector_set(0.0), tiny = vector_set(1e-12);
    Vector p = two + g;
    Rotation r;
    r.n = vector_sqrt(p * p + q * q);
    r.inverse = one / vector_select_greater(r.n, tiny, r.n, one);
    r.c = vector_select_greater(r.n, tiny, p * r.inverse, one);
    r.s = vector_select_greater(r.n, tiny, q * r.inverse, zero);
    r.trace = (g * (four + g) + q * q) / (r.n + two);
    return r;
}

// P without the thickness: shear = mu, trace = mu + lambda.
typedef struct Stress {
    Vector xx, xy, yx, yy;
} Stress;

INLINE Stress stress_of(Vector gxx, Vector gxy, Vector gyx, Vector gyy, Vector shear, Vector trace)
{
    Rotation r = rotation_of(gxx + gyy, gyx - gxy);
    Vector even = trace * r.trace, c = even * r.c, s = even * r.s;
    Vector b0 = shear * (gxx - gyy), b1 = shear * (gyx + gxy);
    return (Stress){c + b0, b1 - s, b1 + s, c - b0};
}

// ---------------------------------------------------------------------------------------------
// Squares: mean, gradient and hourglass of the four corners by sums and differences

INLINE Vector number(const Real *class, PlaneSquareNumber which, double scale)
{
    return vector_set((double)class[which] * scale);
}

INLINE void damp_square(const PlanePass *pass, const Real *class, const Nodes *nodes, Vector fx[4],
                        Vector fy[4])
{
    const Vector quarter = vector_set(0.25), half = number(class, SQUARE_PLACE, 1.0);
    const Vector zero = vector_set(0.0);
    const Vector c = number(class, SQUARE_DAMPING, pass->stiffness_scale * pass->damping_scale);
    // Middle and mean velocity of the corners.
    Vector x = (nodes->x[0] + nodes->x[1]) + (nodes->x[2] + nodes->x[3]);
    Vector y = (nodes->y[0] + nodes->y[1]) + (nodes->y[2] + nodes->y[3]);
    Vector vx = (nodes->vx[0] + nodes->vx[1]) + (nodes->vx[2] + nodes->vx[3]);
    Vector vy = (nodes->vy[0] + nodes->vy[1]) + (nodes->vy[2] + nodes->vy[3]);
    x *= quarter, y *= quarter, vx *= quarter, vy *= quarter;
    // The rigid spin is not damped.
    Vector rx[4], ry[4], wx[4], wy[4], spin = zero, inertia = vector_set(1e-12) * half * half;
    for (int i = 0; i < 4; i++) {
        rx[i] = nodes->x[i] - x + (i & 1 ? half : -half);
        ry[i] = nodes->y[i] - y + (i & 2 ? half : -half);
        wx[i] = nodes->vx[i] - vx;
        wy[i] = nodes->vy[i] - vy;
        spin += rx[i] * wy[i] - ry[i] * wx[i];
        inertia += rx[i] * rx[i] + ry[i] * ry[i];
    }
    spin /= inertia;
    for (int i = 0; i < 4; i++) {
        fx[i] -= c * (wx[i] + spin * ry[i]);
        fy[i] -= c * (wy[i] - spin * rx[i]);
    }
}

INLINE void evaluate_squares(const PlanePass *pass, bool damped)
{
    const PlaneBatches *batches = pass->batches;
    for (int b = 0; b < batches->square_count; b++) {
        const int *vertex = batches->square + (long)b * 4 * LANES;
        const Real *class =
            (const Real *)batches->class + (long)batches->square_class[b] * SQUARE_NUMBERS;
        const double scale = pass->stiffness_scale;
        const Vector slope = number(class, SQUARE_GRADIENT, 1.0),
                     shear = number(class, SQUARE_SHEAR, scale),
                     trace = number(class, SQUARE_TRACE, scale),
                     residual = number(class, SQUARE_RESIDUAL, scale);
        Forces forces;
        for (int lane = 0; lane < LANES; lane += WIDTH) {
            // The displacement gradient and the hourglass mode from differences of the corners.
            Nodes n;
            load_nodes(pass, vertex + lane, 4, damped, &n);
            Vector left = n.x[2] - n.x[0], right = n.x[3] - n.x[1];
            Vector low = n.x[1] - n.x[0], high = n.x[3] - n.x[2];
            Vector hx = residual * (right - left);
            Vector gxx = slope * (low + high), gxy = slope * (left + right);
            left = n.y[2] - n.y[0], right = n.y[3] - n.y[1];
            low = n.y[1] - n.y[0], high = n.y[3] - n.y[2];
            Vector hy = residual * (right - left);
            Vector gyx = slope * (low + high), gyy = slope * (left + right);
            Stress p = stress_of(gxx, gxy, gyx, gyy, shear, trace);
            // Nodal forces of a constant stress, plus the residual on the hourglass mode.
            Vector sum = p.xx + p.xy, difference = p.xx - p.xy;
            Vector fx[4] = {sum - hx, hx - difference, difference + hx, -sum - hx}, fy[4];
            sum = p.yx + p.yy, difference = p.yx - p.yy;
            fy[0] = sum - hy, fy[1] = hy - difference;
            fy[2] = difference + hy, fy[3] = -sum - hy;
            if (damped)
                damp_square(pass, class, &n, fx, fy);
            for (int i = 0; i < 4; i++)
                keep_forces(&forces, i, lane, fx[i], fy[i]);
        }
        add_forces(pass, vertex, 4, &forces);
    }
}

// ---------------------------------------------------------------------------------------------
// Any other shape

INLINE void evaluate_other(const PlanePass *pass, int batch, int lane, int count, bool paper,
                           bool damped, Forces *forces)
{
    const PlaneBatches *batches = pass->batches;
    const int first = batches->start[batch];
    const int numbers = paper ? NODE_PAPER_NUMBERS : NODE_NUMBERS;
    const Real *node = (const Real *)batches->node + (long)first * numbers * LANES + lane;
    const Real *whole = (const Real *)batches->whole + (long)batch * WHOLE_NUMBERS * LANES + lane;
#define NODE(i, which) vector_load(node + ((long)(i)*numbers + (which)) * LANES)
#define WHOLE(which)   vector_load(whole + (which)*LANES)
    const Vector zero = vector_set(0.0), scale = vector_set(pass->stiffness_scale);
    Nodes n;
    load_nodes(pass, batches->vertex + (long)first * LANES + lane, count, damped, &n);

    // Sums over the vertices: mean, gradient, best linear map, mean velocity.
    Vector cx = zero, cy = zero, vx = zero, vy = zero;
    Vector gxx = zero, gxy = zero, gyx = zero, gyy = zero;
    Vector lxx = zero, lxy = zero, lyx = zero, lyy = zero;
    for (int i = 0; i < count; i++) {
        Vector share = NODE(i, NODE_SHARE);
        Vector gx = NODE(i, NODE_GRADIENT_X), gy = NODE(i, NODE_GRADIENT_Y);
        cx += share * n.x[i], cy += share * n.y[i];
        gxx += n.x[i] * gx, gxy += n.x[i] * gy;
        gyx += n.y[i] * gx, gyy += n.y[i] * gy;
        if (damped)
            vx += share * n.vx[i], vy += share * n.vy[i];
        if (!paper) {
            Vector lx = NODE(i, NODE_LINEAR_X), ly = NODE(i, NODE_LINEAR_Y);
            lxx += n.x[i] * lx, lxy += n.x[i] * ly;
            lyx += n.y[i] * lx, lyy += n.y[i] * ly;
        }
    }

    Vector fx[PLANE_PLACES], fy[PLANE_PLACES];
    if (paper) { // f = k (R R0 - r), with R - 1 where it is small
        const Vector one = vector_set(1.0), two = vector_set(2.0);
        Vector p = two + gxx + gyy, q = gyx - gxy;
        Rotation r = rotation_of(gxx + gyy, q);
        Vector less = vector_select_greater(p, zero, -(q * q) * r.inverse / (r.n + p), r.c - one);
        for (int i = 0; i < count; i++) {
            Vector x = NODE(i, NODE_X), y = NODE(i, NODE_Y), k = scale * NODE(i, NODE_RESIDUAL);
            fx[i] = k * (less * x - r.s * y - (n.x[i] - cx));
            fy[i] = k * (r.s * x + less * y - (n.y[i] - cy));
        }
    } else {
        Stress p =
            stress_of(gxx, gxy, gyx, gyy, scale * WHOLE(WHOLE_SHEAR), scale * WHOLE(WHOLE_TRACE));
        for (int i = 0; i < count; i++) {
            Vector x = NODE(i, NODE_X), y = NODE(i, NODE_Y), k = scale * NODE(i, NODE_RESIDUAL);
            Vector ax = NODE(i, NODE_AREA_X), ay = NODE(i, NODE_AREA_Y);
            Vector ex = n.x[i] - cx - (lxx * x + lxy * y), ey = n.y[i] - cy - (lyx * x + lyy * y);
            fx[i] = -(p.xx * ax + p.xy * ay) - k * ex;
            fy[i] = -(p.yx * ax + p.yy * ay) - k * ey;
        }
    }
    if (damped) {
        Vector spin = zero, inertia = WHOLE(WHOLE_SPREAD);
        Vector damping =
            vector_set(pass->stiffness_scale * pass->damping_scale) * WHOLE(WHOLE_DAMPING);
        for (int i = 0; i < count; i++) {
            Vector share = NODE(i, NODE_SHARE);
            Vector x = NODE(i, NODE_X) + n.x[i] - cx, y = NODE(i, NODE_Y) + n.y[i] - cy;
            spin += share * (x * (n.vy[i] - vy) - y * (n.vx[i] - vx));
            inertia += share * (x * x + y * y);
        }
        spin /= inertia;
        for (int i = 0; i < count; i++) {
            Vector k = damping * NODE(i, NODE_SHARE);
            Vector x = NODE(i, NODE_X) + n.x[i] - cx, y = NODE(i, NODE_Y) + n.y[i] - cy;
            fx[i] -= k * (n.vx[i] - vx + spin * y);
            fy[i] -= k * (n.vy[i] - vy - spin * x);
        }
    }
#undef NODE
#undef WHOLE
    for (int i = 0; i < count; i++)
        keep_forces(forces, i, lane, fx[i], fy[i]);
}

// `count` is known to the compiler, which unrolls the loops.
INLINE void evaluate_batch(const PlanePass *pass, int batch, int count, bool paper, bool damped)
{
    const PlaneBatches *batches = pass->batches;
    Forces forces;
    for (int lane = 0; lane < LANES; lane += WIDTH)
        evaluate_other(pass, batch, lane, count, paper, damped, &forces);
    add_forces(pass, batches->vertex + (long)batches->start[batch] * LANES, count, &forces);
}

INLINE void evaluate_others(const PlanePass *pass, bool paper, bool damped)
{
    const PlaneBatches *batches = pass->batches;
    for (int b = 0; b < batches->other_count; b++) {
        switch (batches->start[b + 1] - batches->start[b]) {
        case 4:
            evaluate_batch(pass, b, 4, paper, damped);
            break;
        case 5:
            evaluate_batch(pass, b, 5, paper, damped);
            break;
        case 6:
            evaluate_batch(pass, b, 6, paper, damped);
            break;
        case 7:
            evaluate_batch(pass, b, 7, paper, damped);
            break;
        default:
            evaluate_batch(pass, b, 8, paper, damped);
        }
    }
}

static void evaluate(const PlanePass *pass)
{
    bool paper = pass->law == PLANE_MIYAZAKI2004;
    if (pass->damped) {
        evaluate_squares(pass, true);
        if (paper)
            evaluate_others(pass, true, true);
        else
            evaluate_others(pass, false, true);
    } else {
        evaluate_squares(pass, false);
        if (paper)
            evaluate_others(pass, true, false);
        else
            evaluate_others(pass, false, false);
    }
}

extern const PlaneKernels KERNEL_NAME;
const PlaneKernels KERNEL_NAME = {
    .level = KERNEL_LEVEL,
    .precision = KERNEL_SINGLE ? PRECISION_SINGLE : PRECISION_DOUBLE,
    .evaluate = evaluate,
};
