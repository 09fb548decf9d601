// SPDX-License-Identifier: MIT
// With weights k'_s the forces of the shape-preserving springs sum to zero, and so do their
// moments: f = -(w (x - c) - R w (X - C)) has no moment about c exactly when R maximises tr(R^T A)
// with A = sum w (x - c)(X - C)^T. Damping against v_c + omega x (x - c), the weighted rigid
// velocity, has neither force nor moment by construction.
#include "body/rows.h"

#include "base/sym3.h"

#include <string.h>

RigidFrame *rigid_frame_create(const char *name, Precision precision, bool displaced,
                               int slot_count, const double (*rest)[3], const double *weight,
                               Arena *arena, StateList *state)
{
    RigidFrame *frame = arena_allocate(arena, ARENA_STEP, 1, sizeof *frame, "%s/rigid frame", name);
    // All slots count, until a body with levels says which.
    frame->precision = precision;
    frame->displaced = displaced;
    frame->whole[0][1] = slot_count;
    frame->run = frame->whole;
    frame->run_count = 1;
    frame->rest = rest;
    frame->weight = weight;
    // The fit starts from the rotation of the last one, so it is state.
    frame->rotation =
        arena_allocate(arena, ARENA_STEP, 4, sizeof(double), "%s/frame rotation", name);
    frame->rotation[0] = 1.0;
    for (int c = 0; c < 3; c++)
        frame->pose.rotation[c][c] = 1.0;
    state_add(state, frame->rotation, 4 * sizeof(double), "%s/frame_rotation", name);

    rigid_frame_weigh(frame);
    return frame;
}

#define FOR_EACH_SLOT(frame, s)                                                                    \
    for (int run_ = 0; run_ < (frame)->run_count; run_++)                                          \
        for (int s = (frame)->run[run_][0]; s < (frame)->run[run_][1]; s++)

void rigid_frame_weigh(RigidFrame *frame)
{
    double total = 0.0, center[3] = {0.0, 0.0, 0.0};
    FOR_EACH_SLOT(frame, s)
    {
        total += frame->weight[s];
        for (int c = 0; c < 3; c++)
            center[c] += frame->weight[s] * frame->rest[s][c];
    }
    frame->total_weight = total;
    for (int c = 0; c < 3; c++)
        frame->pose.rest_center[c] = total > 0.0 ? center[c] / total : 0.0;
}

// Position and velocity of a slot, in the rows' coordinates.
static inline void read_row(const RigidFrame *frame, const void *rows, int slot, double x[3],
                            double v[3])
{
    if (frame->precision == PRECISION_DOUBLE) {
        const double *row = (const double *)rows + (long)slot * ROW;
        for (int c = 0; c < 3; c++) {
            x[c] = frame->displaced ? frame->rest[slot][c] + row[c] : row[c];
            v[c] = row[4 + c];
        }
        return;
    }
    const float *row = (const float *)rows + (long)slot * ROW;
    for (int c = 0; c < 3; c++) {
        x[c] = frame->rest[slot][c] + (double)row[c];
        v[c] = (double)row[4 + c];
    }
}

static void rotation_matrix(const double q[4], double r[3][3])
{
    double w = q[0], x = q[1], y = q[2], z = q[3];
    r[0][0] = 1.0 - 2.0 * (y * y + z * z);
    r[0][1] = 2.0 * (x * y - w * z);
    r[0][2] = 2.0 * (x * z + w * y);
    r[1][0] = 2.0 * (x * y + w * z);
    r[1][1] = 1.0 - 2.0 * (x * x + z * z);
    r[1][2] = 2.0 * (y * z - w * x);
    r[2][0] = 2.0 * (x * z - w * y);
    r[2][1] = 2.0 * (y * z + w * x);
    r[2][2] = 1.0 - 2.0 * (x * x + y * y);
}

// Solves the symmetric system m s = b by Cramer's rule; returns false unless m is safely positive
// definite.
static bool solve_positive(const double m[3][3], const double b[3], double s[3])
{
    const Sym3 k = {m[0][0], m[1][1], m[2][2], m[1][2], m[0][2], m[0][1]};
    const double trace = sym3_trace(k);
    double determinant;
    const Sym3 adjugate = sym3_adjugate(k, &determinant);
    // Minors from the top left are positive for a positive definite matrix.
    if (!(k.xx > 0.0 && adjugate.zz > 0.0 && determinant > 1e-9 * trace * trace * trace))
        return false;
    const Vec3 all = sym3_times(adjugate, vec3(b[0], b[1], b[2]));
    s[0] = all.x / determinant, s[1] = all.y / determinant, s[2] = all.z / determinant;
    return true;
}

// Leaves a saddle: where the gradient vanishes at a rotation that is not the best one (half a turn
// off), adds a rotation of 0.5 rad about the axis of the most negative curvature to a step that is
// too short.
static void leave_saddle(const double hessian[3][3], double step[3])
{
    if (step[0] * step[0] + step[1] * step[1] + step[2] * step[2] > 0.01)
        return; // it moves by itself
    // The direction of the most negative curvature.
    double shift = 0.0, axis[3] = {0.8, 0.5, 0.3}, along[3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            shift += fabs(hessian[i][j]);
    double curvature = 0.0;
    for (int iteration = 0; iteration < 30; iteration++) { // power iteration of shift I - H
        curvature = 0.0;
        for (int i = 0; i < 3; i++) {
            along[i] = hessian[i][0] * axis[0] + hessian[i][1] * axis[1] + hessian[i][2] * axis[2];
            curvature += axis[i] * along[i];
        }
        for (int i = 0; i < 3; i++)
            along[i] = shift * axis[i] - along[i];
        double size = sqrt(along[0] * along[0] + along[1] * along[1] + along[2] * along[2]);
        if (!(size > 0.0))
            return;
        for (int i = 0; i < 3; i++)
            axis[i] = along[i] / size;
    }
    // A line or a point has no curvature about its axis: no saddle, and nothing to fit.
    if (!(curvature < -1e-6 * shift))
        return;
    // Step along it to the side that the gradient prefers.
    double slope = axis[0] * step[0] + axis[1] * step[1] + axis[2] * step[2];
    for (int i = 0; i < 3; i++)
        step[i] += (slope < 0.0 ? -0.5 : 0.5) * axis[i];
}

// Turns the rotation to the maximum of tr(R^T A). Newton's step where the maximum is near (there
// tr(S) I - S with S = sym(A R^T) is positive definite); elsewhere the damped step of
// Mueller et al. 2016, "A robust method to extract the rotational part of deformations", which
// leaves any state, inverted ones too.
static void fit_rotation(double q[4], const double a[3][3])
{
    for (int iteration = 0; iteration < 60; iteration++) {
        double r[3][3], m[3][3];
        // What remains to be turned at the present rotation.
        rotation_matrix(q, r);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                m[i][j] = a[i][0] * r[j][0] + a[i][1] * r[j][1] + a[i][2] * r[j][2]; // A R^T
        double trace = m[0][0] + m[1][1] + m[2][2];
        // Turning R by the small vector s adds s . g - s . (tr(S) I - S) s / 2 to the trace.
        double g[3] = {m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]};
        double hessian[3][3], step[3];
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                hessian[i][j] = (i == j ? trace : 0.0) - 0.5 * (m[i][j] + m[j][i]);
        // Newton's step near a maximum, else a careful one along the gradient.
        if (!solve_positive((const double(*)[3])hessian, g, step)) {
            double scale =
                1.0 / (fabs(trace) + 1e-9 * (fabs(g[0]) + fabs(g[1]) + fabs(g[2])) + 1e-300);
            for (int i = 0; i < 3; i++)
                step[i] = scale * g[i];
            leave_saddle((const double(*)[3])hessian, step);
        }
        // Turn by the step, and stop when it no longer matters.
        double size = sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
        if (!(size < 1e6))
            return; // no shape to fit: keep the rotation
        Quat turn = quat_from_rotation((Vec3){step[0], step[1], step[2]});
        Quat turned = quat_unit(quat_multiply(turn, (Quat){q[0], q[1], q[2], q[3]}));
        q[0] = turned.w;
        q[1] = turned.x;
        q[2] = turned.y;
        q[3] = turned.z;
        if (size < 1e-15)
            return;
    }
}

void rigid_frame_fit(RigidFrame *frame, const void *rows)
{
    FramePose *pose = &frame->pose;
    const double *w = frame->weight;
    // Weighted means of positions and velocities.
    double sum[6] = {0.0};
    FOR_EACH_SLOT(frame, s)
    {
        double x[3], v[3];
        read_row(frame, rows, s, x, v);
        for (int c = 0; c < 3; c++) {
            sum[c] += w[s] * x[c];
            sum[3 + c] += w[s] * v[c];
        }
    }
    for (int c = 0; c < 3; c++) {
        pose->center[c] = sum[c] / frame->total_weight;
        pose->velocity[c] = sum[3 + c] / frame->total_weight;
    }

    // A, the weighted inertia and the weighted angular momentum about the center.
    double a[3][3] = {{0.0}}, xx = 0.0, yy = 0.0, zz = 0.0, xy = 0.0, xz = 0.0, yz = 0.0;
    double momentum[3] = {0.0, 0.0, 0.0};
    FOR_EACH_SLOT(frame, s)
    {
        double p[3], q[3];
        read_row(frame, rows, s, p, q);
        // Relative to the centre, position and velocity.
        double x = p[0] - pose->center[0], y = p[1] - pose->center[1], z = p[2] - pose->center[2];
        double vx = q[0] - pose->velocity[0], vy = q[1] - pose->velocity[1],
               vz = q[2] - pose->velocity[2];
        // A: how the present shape goes with the shape at rest.
        for (int j = 0; j < 3; j++) {
            double arm = w[s] * (frame->rest[s][j] - pose->rest_center[j]);
            a[0][j] += x * arm;
            a[1][j] += y * arm;
            a[2][j] += z * arm;
        }
        // Moments of inertia, and the momentum about the centre.
        xx += w[s] * x * x;
        yy += w[s] * y * y;
        zz += w[s] * z * z;
        xy += w[s] * x * y;
        xz += w[s] * x * z;
        yz += w[s] * y * z;
        momentum[0] += w[s] * (y * vz - z * vy);
        momentum[1] += w[s] * (z * vx - x * vz);
        momentum[2] += w[s] * (x * vy - y * vx);
    }
    fit_rotation(frame->rotation, (const double(*)[3])a);
    rotation_matrix(frame->rotation, pose->rotation);

    // omega = I^-1 L. A body collapsed to a line or point has directions without inertia: a trace
    // of isotropic inertia keeps omega finite there and changes nothing elsewhere.
    double trace = xx + yy + zz;
    double soft = 1e-15 * trace + 1e-300;
    double inertia[3][3] = {
        {yy + zz + soft, -xy, -xz}, {-xy, xx + zz + soft, -yz}, {-xz, -yz, xx + yy + soft}};
    if (!solve_positive((const double(*)[3])inertia, momentum, pose->angular))
        pose->angular[0] = pose->angular[1] = pose->angular[2] = 0.0;
}

double rigid_frame_energy(const RigidFrame *frame, const void *rows)
{
    RigidFrame fit = *frame; // a copy, so that the query does not change the next step's bits
    double rotation[4];
    memcpy(rotation, frame->rotation, sizeof rotation);
    fit.rotation = rotation;
    rigid_frame_fit(&fit, rows);
    const FramePose *pose = &fit.pose;
    double energy = 0.0;
    // Each spring pulls from the place that the rigid motion gives its slot.
    FOR_EACH_SLOT(frame, s)
    {
        double x[3], v[3], arm[3];
        read_row(frame, rows, s, x, v);
        for (int c = 0; c < 3; c++)
            arm[c] = frame->rest[s][c] - pose->rest_center[c];
        for (int c = 0; c < 3; c++) {
            const double *r = pose->rotation[c];
            double u = x[c] - pose->center[c] - (r[0] * arm[0] + r[1] * arm[1] + r[2] * arm[2]);
            energy += 0.5 * frame->weight[s] * u * u;
        }
    }
    return energy;
}
