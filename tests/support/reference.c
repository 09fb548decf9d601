// SPDX-License-Identifier: MIT
#include "reference.h"
#include "scoped.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double c[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static double distance(const double a[3], const double b[3])
{
    double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return sqrt(dot(d, d));
}

// ---------------------------------------------------------------------------------------------
// Building

// The spring between two nodes, made when there is none yet.
static ReferenceSpring *spring_between(Reference *reference, int a, int b)
{
    int low = a < b ? a : b, high = a < b ? b : a;
    for (int s = 0; s < reference->spring_count; s++)
        if (reference->spring[s].a == low && reference->spring[s].b == high)
            return &reference->spring[s];
    ReferenceSpring *spring = &reference->spring[reference->spring_count++];
    *spring = (ReferenceSpring){.a = low, .b = high};
    return spring;
}

void reference_create(Reference *reference, int node_count, const double (*position)[3],
                      int triangle_count, const int (*triangle)[3], const ReferenceOptions *options)
{
    *reference = (Reference){.node_count = node_count, .options = *options};
    reference->spring = zeroed(3 * triangle_count, sizeof *reference->spring);
    reference->area = zeroed(node_count, sizeof(double));
    reference->mass = zeroed(node_count, sizeof(double));
    reference->shape_stiffness = zeroed(node_count, sizeof(double));
    reference->shape_damping = zeroed(node_count, sizeof(double));
    reference->fixed = zeroed(node_count, sizeof(bool));
    reference->load = zeroed(node_count, sizeof *reference->load);
    reference->rest = zeroed(node_count, sizeof *reference->rest);
    reference->x = zeroed(node_count, sizeof *reference->x);
    reference->v = zeroed(node_count, sizeof *reference->v);
    memcpy(reference->rest, position, (size_t)node_count * sizeof *position);
    memcpy(reference->x, position, (size_t)node_count * sizeof *position);

    for (int t = 0; t < triangle_count; t++) {
        const int *n = triangle[t];
        // Heron's formula: another way to the area than the server's cross product.
        double p = distance(position[n[0]], position[n[1]]);
        double q = distance(position[n[1]], position[n[2]]);
        double r = distance(position[n[2]], position[n[0]]);
        double s = 0.5 * (p + q + r), area = sqrt(s * (s - p) * (s - q) * (s - r));
        for (int k = 0; k < 3; k++) {
            reference->area[n[k]] += area / 3.0;
            ReferenceSpring *spring = spring_between(reference, n[k], n[(k + 1) % 3]);
            double length = distance(position[spring->a], position[spring->b]);
            spring->rest_length = (1.0 - options->prestress) * length;
            if (options->uniform) {
                spring->stiffness = options->spring_stiffness;
                spring->damping = options->spring_damping;
            } else { // Van Gelder 1998: every face adds E A / L^2
                spring->stiffness += options->youngs_modulus_2d * area / (length * length);
                spring->damping = options->damping_time * spring->stiffness;
            }
        }
    }
    for (int i = 0; i < node_count; i++) {
        double m =
            options->uniform ? options->node_mass : options->areal_density * reference->area[i];
        double w = options->angular_frequency;
        reference->mass[i] = m;
        if (options->shape == REFERENCE_NO_SHAPE)
            continue;
        reference->shape_stiffness[i] = options->per_node ? options->shape_stiffness : m * w * w;
        reference->shape_damping[i] =
            options->per_node ? options->shape_damping : 2.0 * options->damping_ratio * w * m;
    }
}

void reference_destroy(Reference *reference)
{
    free(reference->spring);
    free(reference->area);
    free(reference->mass);
    free(reference->shape_stiffness);
    free(reference->shape_damping);
    free(reference->fixed);
    free(reference->load);
    free(reference->rest);
    free(reference->x);
    free(reference->v);
    *reference = (Reference){0};
}

// ---------------------------------------------------------------------------------------------
// Best fit

// The eigenvector of the largest eigenvalue of a symmetric 4x4 matrix, by Jacobi's rotations.
static void largest_eigenvector(double m[4][4], double q[4])
{
    double vectors[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
    for (int sweep = 0; sweep < 60; sweep++) {
        for (int i = 0; i < 3; i++) {
            for (int j = i + 1; j < 4; j++) {
                if (m[i][j] == 0.0)
                    continue;
                double theta = 0.5 * atan2(2.0 * m[i][j], m[i][i] - m[j][j]);
                double c = cos(theta), s = sin(theta);
                for (int k = 0; k < 4; k++) {
                    double a = m[k][i], b = m[k][j];
                    m[k][i] = c * a + s * b;
                    m[k][j] = c * b - s * a;
                    a = vectors[k][i], b = vectors[k][j];
                    vectors[k][i] = c * a + s * b;
                    vectors[k][j] = c * b - s * a;
                }
                for (int k = 0; k < 4; k++) {
                    double a = m[i][k], b = m[j][k];
                    m[i][k] = c * a + s * b;
                    m[j][k] = c * b - s * a;
                }
            }
        }
    }
    int best = 0;
    for (int k = 1; k < 4; k++)
        if (m[k][k] > m[best][best])
            best = k;
    for (int k = 0; k < 4; k++)
        q[k] = vectors[k][best];
}

// Gaussian elimination with pivoting.
static void solve3(double m[3][3], double b[3], double x[3])
{
    for (int c = 0; c < 3; c++) {
        int pivot = c;
        for (int r = c + 1; r < 3; r++)
            if (fabs(m[r][c]) > fabs(m[pivot][c]))
                pivot = r;
        for (int k = 0; k < 3; k++) {
            double swap = m[c][k];
            m[c][k] = m[pivot][k];
            m[pivot][k] = swap;
        }
        double swap = b[c];
        b[c] = b[pivot];
        b[pivot] = swap;
        for (int r = c + 1; r < 3; r++) {
            double factor = m[r][c] / m[c][c];
            for (int k = c; k < 3; k++)
                m[r][k] -= factor * m[c][k];
            b[r] -= factor * b[c];
        }
    }
    for (int c = 2; c >= 0; c--) {
        x[c] = b[c];
        for (int k = c + 1; k < 3; k++)
            x[c] -= m[c][k] * x[k];
        x[c] /= m[c][c];
    }
}

void reference_fit(const Reference *reference, const double (*x)[3], const double (*v)[3],
                   ReferenceFrame *frame)
{
    const double *w = reference->shape_stiffness;
    double total = 0.0;
    *frame = (ReferenceFrame){0};
    for (int i = 0; i < reference->node_count; i++) {
        total += w[i];
        for (int c = 0; c < 3; c++) {
            frame->center[c] += w[i] * x[i][c];
            frame->rest_center[c] += w[i] * reference->rest[i][c];
            frame->velocity[c] += w[i] * v[i][c];
        }
    }
    for (int c = 0; c < 3; c++) {
        frame->center[c] /= total;
        frame->rest_center[c] /= total;
        frame->velocity[c] /= total;
    }

    // Horn 1987: S_ab = sum w r_a l_b with r at rest (left system) and l now.
    double s[3][3] = {{0.0}}, inertia[3][3] = {{0.0}}, momentum[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < reference->node_count; i++) {
        double r[3], l[3], u[3], moment[3];
        for (int c = 0; c < 3; c++) {
            r[c] = reference->rest[i][c] - frame->rest_center[c];
            l[c] = x[i][c] - frame->center[c];
            u[c] = v[i][c] - frame->velocity[c];
        }
        cross(l, u, moment);
        for (int a = 0; a < 3; a++) {
            momentum[a] += w[i] * moment[a];
            for (int b = 0; b < 3; b++) {
                s[a][b] += w[i] * r[a] * l[b];
                inertia[a][b] += w[i] * ((a == b ? dot(l, l) : 0.0) - l[a] * l[b]);
            }
        }
    }
    double n[4][4] = {
        {s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]},
        {0, s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]},
        {0, 0, -s[0][0] + s[1][1] - s[2][2], s[1][2] + s[2][1]},
        {0, 0, 0, -s[0][0] - s[1][1] + s[2][2]}};
    for (int a = 1; a < 4; a++)
        for (int b = 0; b < a; b++)
            n[a][b] = n[b][a];
    double q[4];
    largest_eigenvector(n, q);
    // Columns: the images of the axes, q e q*.
    double u[3] = {q[1], q[2], q[3]};
    for (int c = 0; c < 3; c++) {
        double e[3] = {c == 0, c == 1, c == 2}, turned[3];
        cross(u, e, turned);
        for (int k = 0; k < 3; k++)
            frame->rotation[k][c] =
                (q[0] * q[0] - dot(u, u)) * e[k] + 2.0 * dot(u, e) * u[k] + 2.0 * q[0] * turned[k];
    }
    solve3(inertia, momentum, frame->angular);
}

// ---------------------------------------------------------------------------------------------
// Forces

void reference_spring_forces(const Reference *reference, const double (*x)[3], const double (*v)[3],
                             double (*force)[3], double *scale)
{
    memset(force, 0, (size_t)reference->node_count * sizeof *force);
    double sizes = 0.0;
    for (int s = 0; s < reference->spring_count; s++) {
        const ReferenceSpring *spring = &reference->spring[s];
        double d[3], u[3];
        for (int c = 0; c < 3; c++) {
            d[c] = x[spring->a][c] - x[spring->b][c];
            u[c] = v[spring->a][c] - v[spring->b][c];
        }
        double length = sqrt(dot(d, d));
        if (length < 1e-12) // no direction, no force
            continue;
        double pull = spring->stiffness * (length - spring->rest_length) +
                      spring->damping * dot(u, d) / length;
        sizes += spring->stiffness * length;
        for (int c = 0; c < 3; c++) {
            force[spring->a][c] -= pull * d[c] / length;
            force[spring->b][c] += pull * d[c] / length;
        }
    }
    if (scale != NULL)
        *scale = sizes;
}

// Where the virtual node is and how fast it moves.
static void virtual_node(const Reference *reference, const ReferenceFrame *frame, int i,
                         const double x[3], double position[3], double velocity[3])
{
    if (reference->options.shape == REFERENCE_WORLD) {
        memcpy(position, reference->rest[i], 3 * sizeof *position);
        velocity[0] = velocity[1] = velocity[2] = 0.0;
        return;
    }
    double arm[3], r[3], spin[3];
    for (int c = 0; c < 3; c++) {
        arm[c] = reference->rest[i][c] - frame->rest_center[c];
        r[c] = x[c] - frame->center[c];
    }
    cross(frame->angular, r, spin);
    for (int c = 0; c < 3; c++) {
        position[c] = frame->center[c] + dot(frame->rotation[c], arm);
        velocity[c] = frame->velocity[c] + spin[c];
    }
}

// Makes what is carried along all of the velocity but its part along the spring.
static void leave_radial(const double x[3], const double v[3], const double target[3],
                         double carried[3])
{
    const double d[3] = {x[0] - target[0], x[1] - target[1], x[2] - target[2]};
    const double square = dot(d, d);
    for (int c = 0; c < 3; c++)
        carried[c] = v[c] - (square > 0.0 ? dot(v, d) * d[c] / square : 0.0);
}

void reference_accelerations(const Reference *reference, const double (*x)[3], const double (*v)[3],
                             double (*acceleration)[3])
{
    const ReferenceOptions *options = &reference->options;
    double(*force)[3] = acceleration;
    reference_spring_forces(reference, x, v, force, NULL);
    ReferenceFrame frame = {0};
    if (options->shape == REFERENCE_BODY)
        reference_fit(reference, x, v, &frame);
    for (int i = 0; i < reference->node_count; i++) {
        double target[3] = {0.0, 0.0, 0.0}, carried[3] = {0.0, 0.0, 0.0};
        if (options->shape != REFERENCE_NO_SHAPE)
            virtual_node(reference, &frame, i, x[i], target, carried);
        if (options->radial)
            leave_radial(x[i], v[i], target, carried);
        for (int c = 0; c < 3; c++) {
            force[i][c] += reference->load[i][c];
            force[i][c] -= options->node_damping * v[i][c];
            if (options->shape != REFERENCE_NO_SHAPE)
                force[i][c] -= reference->shape_stiffness[i] * (x[i][c] - target[c]) +
                               reference->shape_damping[i] * (v[i][c] - carried[c]);
            acceleration[i][c] = force[i][c] / reference->mass[i] + options->gravity[c];
            if (reference->fixed[i])
                acceleration[i][c] = 0.0;
        }
    }
}

double reference_elastic_energy(const Reference *reference, const double (*x)[3])
{
    double energy = 0.0;
    for (int s = 0; s < reference->spring_count; s++) {
        const ReferenceSpring *spring = &reference->spring[s];
        double stretch = distance(x[spring->a], x[spring->b]) - spring->rest_length;
        energy += 0.5 * spring->stiffness * stretch * stretch;
    }
    if (reference->options.shape == REFERENCE_NO_SHAPE)
        return energy;
    ReferenceFrame frame = {0};
    if (reference->options.shape == REFERENCE_BODY)
        reference_fit(reference, x, (const double(*)[3])reference->v, &frame);
    for (int i = 0; i < reference->node_count; i++) {
        double target[3], velocity[3];
        virtual_node(reference, &frame, i, x[i], target, velocity);
        double away = distance(x[i], target);
        energy += 0.5 * reference->shape_stiffness[i] * away * away;
    }
    return energy;
}

double reference_kinetic_energy(const Reference *reference)
{
    double energy = 0.0;
    for (int i = 0; i < reference->node_count; i++)
        energy += 0.5 * reference->mass[i] * dot(reference->v[i], reference->v[i]);
    return energy;
}

// ---------------------------------------------------------------------------------------------
// Time

// y += s d for all nodes.
static void add_scaled(int count, double (*y)[3], double s, const double (*d)[3])
{
    for (int i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            y[i][c] += s * d[i][c];
}

typedef const double (*Rows)[3];

static void step_rk4(Reference *reference, double h)
{
    static const double at[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    int n = reference->node_count;
    size_t bytes = (size_t)n * sizeof *reference->x;
    double(*x)[3] = zeroed(n, sizeof *x), (*v)[3] = zeroed(n, sizeof *v);
    double(*a)[3] = zeroed(n, sizeof *a), (*kx)[3] = zeroed(n, sizeof *kx);
    double(*dx)[3] = zeroed(n, sizeof *dx), (*dv)[3] = zeroed(n, sizeof *dv);
    for (int stage = 0; stage < 4; stage++) {
        // The state of this stage from the last one's slopes (kx, a).
        memcpy(x, reference->x, bytes);
        memcpy(v, reference->v, bytes);
        add_scaled(n, x, at[stage] * h, (Rows)kx);
        add_scaled(n, v, at[stage] * h, (Rows)a);
        memcpy(kx, v, bytes);
        reference_accelerations(reference, (Rows)x, (Rows)v, a);
        add_scaled(n, dx, weight[stage] * h / 6.0, (Rows)kx);
        add_scaled(n, dv, weight[stage] * h / 6.0, (Rows)a);
    }
    add_scaled(n, reference->x, 1.0, (Rows)dx);
    add_scaled(n, reference->v, 1.0, (Rows)dv);
    free(x);
    free(v);
    free(a);
    free(kx);
    free(dx);
    free(dv);
}

void reference_step(Reference *reference, ReferenceScheme scheme, double h)
{
    if (scheme == REFERENCE_RK4) {
        step_rk4(reference, h);
        return;
    }
    int n = reference->node_count;
    double before = scheme == REFERENCE_LEAPFROG ? 0.5 * h : 0.0;
    FREED double(*a)[3] = zeroed(n, sizeof *a);
    add_scaled(n, reference->x, before, (Rows)reference->v);
    reference_accelerations(reference, (Rows)reference->x, (Rows)reference->v, a);
    add_scaled(n, reference->v, h, (Rows)a);
    add_scaled(n, reference->x, h - before, (Rows)reference->v);
}

// ---------------------------------------------------------------------------------------------
// Vibrations

double reference_largest_eigenvalue(const Reference *reference, int iterations, double (*mode)[3])
{
    int n = reference->node_count;
    double(*u)[3] = zeroed(n, sizeof *u), (*ku)[3] = zeroed(n, sizeof *ku);
    for (int i = 0; i < n; i++)
        for (int c = 0; c < 3; c++)
            u[i][c] = reference->fixed[i] ? 0.0 : sin(1.0 + 7.0 * i + 2.3 * c);
    double lambda = 0.0;
    for (int iteration = 0; iteration < iterations; iteration++) {
        memset(ku, 0, (size_t)n * sizeof *ku);
        for (int s = 0; s < reference->spring_count; s++) {
            const ReferenceSpring *spring = &reference->spring[s];
            double d[3];
            double length = distance(reference->rest[spring->a], reference->rest[spring->b]);
            for (int c = 0; c < 3; c++)
                d[c] = (reference->rest[spring->a][c] - reference->rest[spring->b][c]) / length;
            double across = 1.0 - spring->rest_length / length; // of a stretched spring
            double relative[3];
            for (int c = 0; c < 3; c++)
                relative[c] = u[spring->a][c] - u[spring->b][c];
            double along = dot(relative, d);
            for (int c = 0; c < 3; c++) {
                double f =
                    spring->stiffness * (across * relative[c] + (1.0 - across) * along * d[c]);
                ku[spring->a][c] += f;
                ku[spring->b][c] -= f;
            }
        }
        // Rayleigh's quotient u K u / u M u, then u := M^-1 K u, scaled.
        double above = 0.0, below = 0.0, largest = 0.0;
        for (int i = 0; i < n; i++)
            for (int c = 0; c < 3; c++) {
                ku[i][c] += reference->shape_stiffness[i] * u[i][c];
                above += u[i][c] * ku[i][c];
                below += reference->mass[i] * u[i][c] * u[i][c];
                ku[i][c] = reference->fixed[i] ? 0.0 : ku[i][c] / reference->mass[i];
                largest = fmax(largest, fabs(ku[i][c]));
            }
        lambda = above / below;
        for (int i = 0; i < n; i++)
            for (int c = 0; c < 3; c++)
                u[i][c] = ku[i][c] / largest;
    }
    if (mode != NULL)
        memcpy(mode, u, (size_t)n * sizeof *u);
    free(u);
    free(ku);
    return lambda;
}
