// SPDX-License-Identifier: MIT
// Offsets of the outer points: from the corners of cubes to the zero level of a field, evenly
// spread along it.
#include "voxel/fitted.h"

#include "base/check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 25, LAST_STEPS = 6, LEVEL_TRIES = 6, REPAIRS = 20 };
#define LEVEL_MOST   0.2  // of the field's range of 1
#define VOLUME_CLOSE 5e-4 // of the volume
#define STEP_MOST    0.5  // [cells]

const int FITTED_TRIANGLES[2][2][3] = {{{0, 1, 2}, {0, 2, 3}}, {{0, 1, 3}, {1, 2, 3}}};

// The outer points of one body, by the first of their vertices.
typedef struct Fitting {
    const LatticeMesh *mesh;
    const SurfaceField *field;
    double level;
    int *first;          // [vertex] the first vertex of its point
    double (*offset)[3]; // [vertex] of first ones; [cells]
    double (*limit)[3];
    double (*mean)[3]; // of the neighbours
    int *neighbors;
} Fitting;

static void *sized(int count, size_t size)
{
    void *memory = calloc((size_t)count + 1, size);
    ASSERT(memory != NULL);
    return memory;
}

// ---------------------------------------------------------------------------------------------
// Squares

// Returns the squared sine of the least angle of a triangle: the least angle lies between the two
// longest edges.
static double least_sine(const double *a, const double *b, const double *c)
{
    const double *x[3] = {a, b, c};
    double edge[3];
    Vec3 way[3];
    for (int k = 0; k < 3; k++) {
        const double *p = x[k], *q = x[(k + 1) % 3];
        way[k] = vec3(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
        edge[k] = vec3_dot(way[k], way[k]);
    }
    const Vec3 normal = vec3_cross(way[0], way[1]);
    const double most = fmax(edge[0] * edge[1], fmax(edge[1] * edge[2], edge[2] * edge[0]));
    return most > 0.0 ? vec3_dot(normal, normal) / most : 0.0;
}

bool fitted_turns_diagonal(const double corner[4][3], bool reversed)
{
    // The same order of the same points from both sides.
    const double *x[4] = {corner[0], corner[reversed ? 3 : 1], corner[2], corner[reversed ? 1 : 3]};
    const double usual = fmin(least_sine(x[0], x[1], x[2]), least_sine(x[0], x[2], x[3]));
    const double turned = fmin(least_sine(x[0], x[1], x[3]), least_sine(x[1], x[2], x[3]));
    return turned > usual + 1e-9;
}

static void place_of(const Fitting *fit, int vertex, double at[3])
{
    for (int c = 0; c < 3; c++)
        at[c] = fit->mesh->point[vertex][c] + fit->offset[fit->first[vertex]][c];
}

static void places_of(const Fitting *fit, int square, double at[4][3])
{
    int corner[4];
    lattice_mesh_corners(fit->mesh, square, corner);
    for (int k = 0; k < 4; k++)
        place_of(fit, corner[k], at[k]);
}

// ---------------------------------------------------------------------------------------------
// One round

static void clip(double offset[3], const double limit[3])
{
    for (int c = 0; c < 3; c++)
        offset[c] = fmin(fmax(offset[c], -limit[c]), limit[c]);
}

void fitted_step(const SurfaceField *field, double level, const double point[3], double offset[3],
                 const double limit[3])
{
    const double at[3] = {point[0] + offset[0], point[1] + offset[1], point[2] + offset[2]};
    double slope[3], square = 1e-6;
    const double value = surface_field_at(field, at, slope) - level;
    for (int c = 0; c < 3; c++)
        square += slope[c] * slope[c];
    const double length = fabs(value) / sqrt(square);
    const double factor = value / square * fmin(1.0, STEP_MOST / fmax(length, 1e-12));
    for (int c = 0; c < 3; c++)
        offset[c] -= factor * slope[c];
    clip(offset, limit);
}

static void find_means(Fitting *fit)
{
    const LatticeMesh *mesh = fit->mesh;
    memset(fit->mean, 0, (size_t)mesh->surface_count * sizeof *fit->mean);
    for (int q = 0; q < mesh->face_count / 2; q++) {
        int corner[4];
        double at[4][3];
        lattice_mesh_corners(mesh, q, corner);
        places_of(fit, q, at);
        for (int k = 0; k < 4; k++)
            for (int side = 1; side < 4; side += 2)
                for (int c = 0; c < 3; c++)
                    fit->mean[fit->first[corner[k]]][c] += at[(k + side) % 4][c];
    }
}

// Half of the way to the mean of the neighbours, without its part across the surface.
static void relax(Fitting *fit, int v)
{
    double at[3], slope[3], way[3], square = 1e-12, along = 0.0;
    place_of(fit, v, at);
    (void)surface_field_at(fit->field, at, slope);
    for (int c = 0; c < 3; c++) {
        way[c] = fit->mean[v][c] / fit->neighbors[v] - at[c];
        square += slope[c] * slope[c];
        along += way[c] * slope[c];
    }
    for (int c = 0; c < 3; c++)
        fit->offset[v][c] += 0.5 * (way[c] - along / square * slope[c]);
    clip(fit->offset[v], fit->limit[v]);
}

static void run_rounds(Fitting *fit)
{
    for (int round = 0; round < ROUNDS; round++) {
        find_means(fit);
        for (int v = 0; v < fit->mesh->surface_count; v++) {
            if (fit->first[v] != v)
                continue;
            const int *at = fit->mesh->point[v];
            const double point[3] = {at[0], at[1], at[2]};
            relax(fit, v);
            for (int step = 0; step < (round < ROUNDS - 1 ? 1 : LAST_STEPS); step++)
                fitted_step(fit->field, fit->level, point, fit->offset[v], fit->limit[v]);
        }
    }
}

// ---------------------------------------------------------------------------------------------
// The level that keeps the volume

// Returns the enclosed volume and the area [cells].
static double measure(const Fitting *fit, double *area)
{
    double volume = 0.0;
    *area = 0.0;
    for (int q = 0; q < fit->mesh->face_count / 2; q++) {
        double at[4][3];
        places_of(fit, q, at);
        for (int half = 0; half < 2; half++) {
            const int *k = FITTED_TRIANGLES[0][half];
            const Vec3 a = vec3(at[k[0]][0], at[k[0]][1], at[k[0]][2]);
            const Vec3 b = vec3(at[k[1]][0], at[k[1]][1], at[k[1]][2]);
            const Vec3 c = vec3(at[k[2]][0], at[k[2]][1], at[k[2]][2]);
            const Vec3 normal = vec3_cross(vec3_sub(b, a), vec3_sub(c, a));
            volume += vec3_dot(a, vec3_cross(b, c)) / 6.0;
            *area += 0.5 * vec3_length(normal);
        }
    }
    return volume;
}

static double mean_slope(const Fitting *fit)
{
    double sum = 0.0;
    int count = 0;
    for (int v = 0; v < fit->mesh->surface_count; v++) {
        double at[3], slope[3];
        if (fit->first[v] != v)
            continue;
        place_of(fit, v, at);
        (void)surface_field_at(fit->field, at, slope);
        sum += sqrt(slope[0] * slope[0] + slope[1] * slope[1] + slope[2] * slope[2]);
        count++;
    }
    return sum / fmax(count, 1.0);
}

static void find_level(Fitting *fit)
{
    for (int k = 0; k < LEVEL_TRIES; k++) {
        double area;
        const double excess = measure(fit, &area) - fit->field->volume;
        if (!(fabs(excess) > VOLUME_CLOSE * fit->field->volume) || !(area > 0.0))
            return;
        const double level = fit->level + excess / area * mean_slope(fit);
        fit->level = fmin(fmax(level, -LEVEL_MOST), LEVEL_MOST);
        run_rounds(fit);
    }
}

// ---------------------------------------------------------------------------------------------
// Triangles that are turned over or have hardly an area: their points go back a little

static bool is_poor(const double at[4][3], const int corner[3], Vec3 cube)
{
    const double *a = at[corner[0]], *b = at[corner[1]], *c = at[corner[2]];
    const Vec3 u = vec3(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    const Vec3 v = vec3(c[0] - a[0], c[1] - a[1], c[2] - a[2]);
    const Vec3 normal = vec3_scale(0.5, vec3_cross(u, v));
    return vec3_dot(normal, cube) < -0.125 || vec3_length(normal) < 0.02;
}

static Vec3 normal_of_cube(const LatticeMesh *mesh, const int corner[4])
{
    Vec3 x[3];
    for (int k = 0; k < 3; k++) {
        const int *p = mesh->point[corner[k]];
        x[k] = vec3(p[0], p[1], p[2]);
    }
    return vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0]));
}

static void repair(Fitting *fit)
{
    const LatticeMesh *mesh = fit->mesh;
    bool *poor = sized(mesh->surface_count, sizeof *poor), any = true;
    for (int pass = 0; pass < REPAIRS && any; pass++) {
        any = false;
        memset(poor, 0, (size_t)mesh->surface_count * sizeof *poor);
        for (int q = 0; q < mesh->face_count / 2; q++) {
            int corner[4];
            double at[4][3];
            lattice_mesh_corners(mesh, q, corner);
            places_of(fit, q, at);
            const bool turned = fitted_turns_diagonal((const double(*)[3])at, false);
            const Vec3 cube = normal_of_cube(mesh, corner);
            for (int half = 0; half < 2; half++)
                if (is_poor((const double(*)[3])at, FITTED_TRIANGLES[turned][half], cube))
                    for (int c = 0; c < 3; c++)
                        any = poor[fit->first[corner[FITTED_TRIANGLES[turned][half][c]]]] = true;
        }
        for (int v = 0; v < mesh->surface_count; v++)
            for (int c = 0; c < 3 && poor[v]; c++)
                fit->offset[v][c] *= 0.8;
    }
    free(poor);
}

// ---------------------------------------------------------------------------------------------

// Sets the limits of a point by the cells around it.
static void find_limit(const Layout *layout, const int point[3], double limit[3])
{
    for (int axis = 0; axis < 3; axis++)
        limit[axis] = FITTED_LIMIT;
    for (int s = 0; s < 8; s++) {
        const int cell[3] = {point[0] - 1 + (s & 1), point[1] - 1 + (s >> 1 & 1),
                             point[2] - 1 + (s >> 2)};
        if (layout_leaf_at(layout, cell[0], cell[1], cell[2]) < 0)
            continue;
        for (int axis = 0; axis < 3; axis++) {
            const int dx = axis == 0, dy = axis == 1, dz = axis == 2;
            if (layout_leaf_at(layout, cell[0] - dx, cell[1] - dy, cell[2] - dz) < 0 &&
                layout_leaf_at(layout, cell[0] + dx, cell[1] + dy, cell[2] + dz) < 0)
                limit[axis] = FITTED_LIMIT_THIN;
        }
    }
}

static void create(Fitting *fit, const Layout *layout)
{
    const LatticeMesh *mesh = fit->mesh;
    const int count = mesh->surface_count;
    fit->first = sized(count, sizeof *fit->first);
    fit->offset = sized(count, sizeof *fit->offset);
    fit->limit = sized(count, sizeof *fit->limit);
    fit->mean = sized(count, sizeof *fit->mean);
    fit->neighbors = sized(count, sizeof *fit->neighbors);
    for (int v = 0; v < count; v++) {
        // Vertices of one point follow each other.
        const bool again =
            v > 0 && memcmp(mesh->point[v], mesh->point[v - 1], sizeof *mesh->point) == 0;
        fit->first[v] = again ? fit->first[v - 1] : v;
        find_limit(layout, mesh->point[v], fit->limit[v]);
    }
    for (int q = 0; q < mesh->face_count / 2; q++) {
        int corner[4];
        lattice_mesh_corners(mesh, q, corner);
        for (int k = 0; k < 4; k++)
            fit->neighbors[fit->first[corner[k]]] += 2;
    }
}

float (*fitted_offsets(const LatticeMesh *mesh, const Layout *layout, const SurfaceField *field,
                       double *level))[3]
{
    Fitting fit = {.mesh = mesh, .field = field};
    create(&fit, layout);
    run_rounds(&fit);
    if (field->volume > 0.0)
        find_level(&fit);
    repair(&fit);
    float(*offset)[3] = sized(mesh->surface_count, sizeof *offset);
    for (int v = 0; v < mesh->surface_count; v++)
        for (int c = 0; c < 3; c++)
            offset[v][c] = (float)fit.offset[fit.first[v]][c];
    free(fit.first);
    free(fit.offset);
    free(fit.limit);
    free(fit.mean);
    free(fit.neighbors);
    *level = fit.level;
    return offset;
}
