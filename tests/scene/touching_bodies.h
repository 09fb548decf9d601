// Scenes of bodies that touch, and what is measured of them. For one source file of a test.
#ifndef PLIANT_TESTS_TOUCHING_BODIES_H
#define PLIANT_TESTS_TOUCHING_BODIES_H

#include "expect.h"
#include "random.h"
#include "world_run.h"

#include "dynamics/sim_data.h"
#include "dynamics/touch_data.h"

#include <stdlib.h>

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
#define TOUCH(more) "touch = ( { bodies = [\"one\", \"two\"]; " more " } );\n"

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
            end->body->ops->read_nodes(end->body->model, end->node, end->count, end->x, end->v);
        for (int i = 0; i < end->count; i++)
            end->v[i] = (Vec3){0, 0, 0};
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

#endif
