// SPDX-License-Identifier: MIT
// Scenes of bodies that touch, and what is measured of them. For one source file of a test.
#ifndef PLIANT_TESTS_TOUCHING_BODIES_H
#define PLIANT_TESTS_TOUCHING_BODIES_H

#include "expect.h"
#include "random.h"
#include "world_run.h"

#include "sim/sim_data.h"
#include "sim/touch/touch_data.h"

#define DOUBLE "precision = \"double\";\n"
// A cube of tissue of 4 cells along each edge, and a hollow ball; both free, of 40 mm.
#define CUBE(name, place, more)                                                                    \
    "{ name = \"" name "\"; model = \"voxel\";\n"                                                  \
    "  voxels = { generator = \"box\"; count = [4, 4, 4]; size = 0.01;\n"                          \
    "  place = { " place " }; };\n"                                                                \
    "  integrator = \"leapfrog\"; " more " }"
#define BALL(name, place, more)                                                                    \
    "{ name = \"" name "\"; mesh = { generator = \"sphere\"; nodes = 162; radius = 0.02;\n"        \
    "  place = { " place " }; };\n"                                                                \
    "  integrator = \"leapfrog\"; " more " }"
// A ball of tissue with a smooth surface.
#define LUMP(name, place, more)                                                                    \
    "{ name = \"" name "\"; model = \"voxel\"; surface = \"fitted\";\n"                            \
    "  voxels = { generator = \"ball\"; radius = 0.02; size = 0.005; place = { " place " }; };\n"  \
    "  integrator = \"leapfrog\"; " more " }"
#define TOUCH(more) "touch = ( { bodies = [\"one\", \"two\"]; " more " } );\n"

// Presses the second of two bodies onto the first.
#define PRESS                                                                                      \
    "loads = ( { body = \"two\"; center = [0, 0, 0.02]; radius = 0.1; force = [0, 0, -0.5];\n"     \
    "  duration = 1.0; } );\n"

static inline Touch *touch_of(Run *run)
{
    return run->world.sim->touch[0];
}

// Reads the ends of a touch as an evaluation does, with no speed.
static inline void read_still(Touch *touch)
{
    for (int e = 0; e < 2; e++) {
        TouchEnd *end = &touch->end[e];
        if (end->count > 0)
            carriers_read(&end->carriers, end->count, end->x, NULL);
        for (int i = 0; i < end->count; i++)
            end->v[i] = (Vec3){0, 0, 0};
    }
}

static inline double component(Vec3 *x, int axis)
{
    return axis == 0 ? x->x : axis == 1 ? x->y : x->z;
}

static inline void shift(Vec3 *x, int axis, double by)
{
    if (axis == 0)
        x->x += by;
    else if (axis == 1)
        x->y += by;
    else
        x->z += by;
}

// At rest in some overlap: each force against the difference of energies.
static inline void expect_gradient(Run *run)
{
    Touch *touch = touch_of(run);
    touch_begin_tick(touch, 0);
    read_still(touch);
    touch_evaluate(touch, 0.0);
    assert_true(touch->energy > 0.0);
    double largest = 0.0;
    for (int e = 0; e < 2; e++)
        for (int i = 0; i < touch->end[e].count; i++)
            largest = fmax(largest, vec3_length(touch->end[e].f[i]));
    const double step = 1e-4 * touch->depth;
    for (int e = 0; e < 2; e++)
        for (int i = 0; i < touch->end[e].count; i++) {
            Vec3 force;
            touch_evaluate(touch, 0.0);
            force = touch->end[e].f[i];
            for (int axis = 0; axis < 3; axis++) {
                double energy[2];
                for (int side = 0; side < 2; side++) {
                    const Vec3 kept = touch->end[e].x[i];
                    shift(&touch->end[e].x[i], axis, side == 0 ? -step : step);
                    touch_evaluate(touch, 0.0);
                    energy[side] = touch->energy;
                    touch->end[e].x[i] = kept;
                }
                const double slope = (energy[1] - energy[0]) / (2.0 * step);
                if (fabs(slope + component(&force, axis)) > 1e-6 * largest)
                    printf("end %d node %d axis %d: %g against %g of %g\n", e, i, axis, -slope,
                           component(&force, axis), largest);
                expect_at_most(fabs(slope + component(&force, axis)), 1e-6 * largest);
            }
        }
}

// Surfaces as they are, with an exact test of its own: which nodes of one body are inside of the
// other, and how deep.
typedef struct Shell {
    int nodes, faces;
    Vec3 *x;
    const int (*face)[3];
    bool *used;
} Shell;

static inline Shell shell_of(Run *run, int b)
{
    const Body *body = sim_body(run->world.sim, b);
    const BodySurface *surface = &body->surface;
    Shell shell = {surface->node_count, surface->face_used, NULL, surface->face, NULL};
    shell.x = calloc((size_t)shell.nodes, sizeof *shell.x);
    shell.used = calloc((size_t)shell.nodes, sizeof *shell.used);
    for (int i = 0; i < shell.nodes; i++) {
        shell.used[i] = surface->node_face_end[i] > surface->node_face_start[i];
        if (shell.used[i])
            body->ops->read_nodes(body->model, &i, 1, &shell.x[i], NULL);
    }
    // What is felt of a smooth surface.
    Carriers *fit = run->world.sim->touch_count > 0
                        ? touch_of(run)->end[touch_of(run)->count == 1 ? 0 : b].fit
                        : NULL;
    if (fit != NULL)
        fit->search++;
    for (int i = 0; i < shell.nodes && fit != NULL; i++)
        if (shell.used[i])
            shell.x[i] = carriers_place(fit, i);
    return shell;
}

static inline void shell_free(Shell *shell)
{
    free(shell->x);
    free(shell->used);
}

static inline bool is_face(const Shell *shell, int f)
{
    return shell->face[f][0] != shell->face[f][1];
}

// The number of times that a closed surface winds around a point: by its solid angles (van Oosterom
// and Strackee 1983).
static inline double winding(const Shell *shell, Vec3 p)
{
    double sum = 0.0;
    for (int f = 0; f < shell->faces; f++) {
        if (!is_face(shell, f))
            continue;
        Vec3 a = vec3_sub(shell->x[shell->face[f][0]], p),
             b = vec3_sub(shell->x[shell->face[f][1]], p),
             c = vec3_sub(shell->x[shell->face[f][2]], p);
        const double la = vec3_length(a), lb = vec3_length(b), lc = vec3_length(c);
        const double triple = vec3_dot(a, vec3_cross(b, c));
        sum += 2.0 * atan2(triple, la * lb * lc + vec3_dot(a, b) * lc + vec3_dot(b, c) * la +
                                       vec3_dot(c, a) * lb);
    }
    return sum / (4.0 * acos(-1.0));
}

static inline double nearest_distance(const Shell *shell, Vec3 p, Vec3 *normal, Vec3 *away)
{
    double least = (double)INFINITY;
    for (int f = 0; f < shell->faces; f++) {
        Vec3 x[3];
        ClosestPair pair;
        if (!is_face(shell, f))
            continue;
        for (int k = 0; k < 3; k++)
            x[k] = shell->x[shell->face[f][k]];
        distance_point_triangle(p, x, &pair);
        if (pair.distance >= least)
            continue;
        least = pair.distance;
        *away = vec3_sub(p, pair.on_triangle);
        *normal = vec3_unit(vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0])));
    }
    return least;
}

// The deepest node of `points` inside of `closed` [m].
static inline double depth_inside(const Shell *points, const Shell *closed)
{
    double deepest = 0.0;
    Vec3 normal = {0, 0, 0}, away = normal;
    for (int i = 0; i < points->nodes; i++)
        if (points->used[i] && winding(closed, points->x[i]) > 0.5)
            deepest = fmax(deepest, nearest_distance(closed, points->x[i], &normal, &away));
    return deepest;
}

// The deepest node below a sheet that faces up [m].
static inline double depth_below(const Shell *points, const Shell *sheet)
{
    double deepest = 0.0;
    Vec3 normal = {0, 0, 0}, away = normal;
    for (int i = 0; i < points->nodes; i++)
        if (points->used[i]) {
            const double distance = nearest_distance(sheet, points->x[i], &normal, &away);
            if (vec3_dot(normal, away) < 0.0)
                deepest = fmax(deepest, distance);
        }
    return deepest;
}

static inline double volume_of(Vec3 a, Vec3 b, Vec3 c, Vec3 d)
{
    return vec3_dot(vec3_sub(a, d), vec3_cross(vec3_sub(b, d), vec3_sub(c, d)));
}

static inline bool edge_crosses(Vec3 p, Vec3 q, Vec3 a, Vec3 b, Vec3 c)
{
    const double u = volume_of(p, q, a, b), v = volume_of(p, q, b, c), w = volume_of(p, q, c, a);
    return volume_of(a, b, c, p) * volume_of(a, b, c, q) < 0.0 &&
           ((u > 0.0 && v > 0.0 && w > 0.0) || (u < 0.0 && v < 0.0 && w < 0.0));
}

// Returns how often an edge of a surface passes through a face of it.
static inline int crossings(const Shell *shell)
{
    int count = 0;
    for (int f = 0; f < shell->faces; f++)
        for (int g = 0; g < shell->faces && is_face(shell, f); g++)
            for (int k = 0; k < 3 && is_face(shell, g); k++) {
                const int *c = shell->face[f], a = shell->face[g][k],
                          b = shell->face[g][(k + 1) % 3];
                if (a < b && a != c[0] && a != c[1] && a != c[2] && b != c[0] && b != c[1] &&
                    b != c[2])
                    count += edge_crosses(shell->x[a], shell->x[b], shell->x[c[0]], shell->x[c[1]],
                                          shell->x[c[2]]);
            }
    return count;
}

#endif
