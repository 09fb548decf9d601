// SPDX-License-Identifier: MIT
#include "geometry/surface_field.h"

#include "base/check.h"
#include "geometry/box.h"
#include "geometry/distance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void *sized(size_t count, size_t size)
{
    void *memory = calloc(count + 1, size);
    ASSERT(memory != NULL);
    return memory;
}

static void create(SurfaceField *field, const Lattice *lattice)
{
    size_t samples = 1;
    *field = (SurfaceField){0};
    for (int a = 0; a < 3; a++) {
        field->count[a] = FIELD_PARTS * (lattice->count[a] + 2 * FIELD_MARGIN) + 1;
        field->low[a] = -FIELD_MARGIN;
        samples *= (size_t)field->count[a];
    }
    field->value = sized(samples, sizeof *field->value);
}

void surface_field_destroy(SurfaceField *field)
{
    free(field->value);
    *field = (SurfaceField){0};
}

// Returns the place of a sample along an axis [cells].
static double place_of(int sample)
{
    return (double)sample / FIELD_PARTS - FIELD_MARGIN;
}

double surface_field_at(const SurfaceField *field, const double at[3], double gradient[3])
{
    int low[3];
    double part[3];
    for (int a = 0; a < 3; a++) {
        const double sample = (at[a] - field->low[a]) * FIELD_PARTS;
        const double within = fmin(fmax(sample, 0.0), field->count[a] - 1.001);
        low[a] = (int)within;
        part[a] = within - low[a];
    }
    const long nx = field->count[0], ny = field->count[1];
    const float *first = field->value + ((long)low[2] * ny + low[1]) * nx + low[0];
    double sum = 0.0, slope[3] = {0.0};
    for (int k = 0; k < 8; k++) {
        const double value = (double)first[((long)(k >> 2) * ny + (k >> 1 & 1)) * nx + (k & 1)];
        double weight[3];
        for (int a = 0; a < 3; a++)
            weight[a] = k >> a & 1 ? part[a] : 1.0 - part[a];
        sum += weight[0] * weight[1] * weight[2] * value;
        for (int a = 0; a < 3; a++)
            slope[a] += (k >> a & 1 ? FIELD_PARTS : -FIELD_PARTS) * weight[(a + 1) % 3] *
                        weight[(a + 2) % 3] * value;
    }
    memcpy(gradient, slope, sizeof slope);
    return sum;
}

// ---------------------------------------------------------------------------------------------
// Labels: the indicator of the voxels, smoothed along one axis after the other

// Weights of the voxels from `first` on for one sample.
typedef struct Taps {
    int first, count;
    float *weight;
} Taps;

// The standard deviation [cells] for voxels of a spacing [cells]: half a cell; wider where voxels
// are as large as cells, since their steps would show.
static double width_for(double spacing)
{
    return fmax(0.5, 0.8 * spacing);
}

// Returns the share of a Gaussian below x.
static double share_below(double x)
{
    return 0.5 * erfc(-x * M_SQRT1_2);
}

static Taps *find_taps(const SolidBlocks *blocks, int axis, int samples, float *room, int most)
{
    const double step = blocks->spacing[axis], sigma = width_for(step);
    Taps *taps = sized((size_t)samples, sizeof *taps);
    for (int s = 0; s < samples; s++) {
        const double at = place_of(s) - blocks->low[axis];
        int first = (int)floor((at - 4.0 * sigma) / step),
            end = (int)ceil((at + 4.0 * sigma) / step);
        first = first < 0 ? 0 : first;
        end = end > blocks->count[axis] ? blocks->count[axis] : end;
        taps[s] = (Taps){first, end > first ? end - first : 0, room + (size_t)s * (size_t)most};
        for (int v = 0; v < taps[s].count; v++)
            taps[s].weight[v] = (float)(share_below(((first + v + 1) * step - at) / sigma) -
                                        share_below(((first + v) * step - at) / sigma));
    }
    return taps;
}

// Smooths along one axis: [outer][count of the axis][inner] to [outer][samples][inner].
static float *smooth(const float *from, const SolidBlocks *blocks, int axis, size_t outer,
                     size_t inner, int samples)
{
    const int most = (int)ceil(8.0 * width_for(blocks->spacing[axis]) / blocks->spacing[axis]) + 2;
    float *room = sized((size_t)samples * (size_t)most, sizeof *room);
    Taps *taps = find_taps(blocks, axis, samples, room, most);
    float *to = sized(outer * (size_t)samples * inner, sizeof *to);
    const size_t count = (size_t)blocks->count[axis];
    for (size_t o = 0; o < outer; o++)
        for (int s = 0; s < samples; s++) {
            float *out = to + (o * (size_t)samples + (size_t)s) * inner;
            for (int v = 0; v < taps[s].count; v++) {
                const float weight = taps[s].weight[v];
                const float *in = from + (o * count + (size_t)(taps[s].first + v)) * inner;
                for (size_t i = 0; i < inner; i++)
                    out[i] += weight * in[i];
            }
        }
    free(taps);
    free(room);
    return to;
}

void surface_field_of_blocks(SurfaceField *field, const Lattice *lattice, const SolidBlocks *blocks)
{
    create(field, lattice);
    const size_t nx = (size_t)blocks->count[0], ny = (size_t)blocks->count[1];
    const size_t nz = (size_t)blocks->count[2], mx = (size_t)field->count[0];
    const size_t my = (size_t)field->count[1], mz = (size_t)field->count[2];
    const double voxel = blocks->spacing[0] * blocks->spacing[1] * blocks->spacing[2];
    long solid = 0;
    float *inside = sized(nx * ny * nz, sizeof *inside);
    for (size_t v = 0; v < nx * ny * nz; v++) {
        inside[v] = blocks->inside[v] != 0 ? 1.0F : 0.0F;
        solid += blocks->inside[v] != 0;
    }
    float *x = smooth(inside, blocks, 0, nz * ny, 1, field->count[0]);
    free(inside);
    float *xy = smooth(x, blocks, 1, nz, mx, field->count[1]);
    free(x);
    float *all = smooth(xy, blocks, 2, 1, mx * my, field->count[2]);
    free(xy);
    for (size_t s = 0; s < mx * my * mz; s++)
        field->value[s] = all[s] - 0.5F;
    free(all);
    field->volume = (double)solid * voxel;
}

void surface_field_of_cells(SurfaceField *field, const Lattice *lattice)
{
    const SolidBlocks blocks = {.count = {lattice->count[0], lattice->count[1], lattice->count[2]},
                                .spacing = {1.0, 1.0, 1.0},
                                .inside = lattice->label};
    surface_field_of_blocks(field, lattice, &blocks);
}

// ---------------------------------------------------------------------------------------------
// A mesh: the distance to its triangles, with the sign of the cells of half the size

#define FIELD_NEAR  1.25 // distances are exact up to here [cells]
#define VOLUME_SURE 0.05 // difference between cells and mesh, of their volume

// A triangle [samples] with what bounds the distance to it from below: its plane, the line along
// its longest side, and a ball. Exact distances cost ten times as much, and large meshes have
// thousands of triangles near a sample.
typedef struct Entered {
    const Vec3 *x;
    Vec3 normal, start, along, middle;
    double height, radius; // of its corners, from the line and from the middle
} Entered;

#define ROUNDED 1e-6 // more than a bound may be off [samples]

static Entered bound_triangle(const Vec3 x[3])
{
    Entered e = {.x = x,
                 .normal = vec3_unit(vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0])))};
    double longest = 0.0;
    for (int c = 0; c < 3; c++) {
        const Vec3 side = vec3_sub(x[(c + 1) % 3], x[c]);
        const double length = vec3_length(side);
        if (length < longest)
            continue;
        longest = length;
        e.start = x[c];
        e.along = length > 0.0 ? vec3_scale(1.0 / length, side) : vec3(1.0, 0.0, 0.0);
        e.middle = vec3_madd(x[c], 0.5, side);
    }
    for (int c = 0; c < 3; c++) {
        e.height = fmax(e.height, vec3_length(vec3_cross(vec3_sub(x[c], e.start), e.along)));
        e.radius = fmax(e.radius, vec3_length(vec3_sub(x[c], e.middle)));
    }
    e.height += ROUNDED;
    e.radius += ROUNDED;
    return e;
}

// Leaves of a row of samples those that are within reach of the line along the longest side.
static void clip_row(const Entered *e, int j, int k, double reach, int *first, int *end)
{
    // The squared distance is square X^2 - 2 cross X + rest, X from the line's start.
    const Vec3 d = vec3(0.0, j - e->start.y, k - e->start.z);
    const double part = vec3_dot(e->along, d), square = 1.0 - e->along.x * e->along.x;
    const double most = reach + e->height, rest = vec3_dot(d, d) - part * part - most * most;
    if (square < ROUNDED) // along the row
        return;
    const double middle = e->along.x * part / square, wide = middle * middle - rest / square;
    const double half = wide > 0.0 ? sqrt(wide) + ROUNDED : -1.0;
    *first = (int)fmax(*first, ceil(e->start.x + middle - half));
    *end = half < 0.0 ? *first : (int)fmin(*end, floor(e->start.x + middle + half) + 1.0);
}

static void enter_sample(const Entered *e, Vec3 at, float *value)
{
    const Vec3 d = vec3_sub(at, e->middle), r = vec3_sub(at, e->start);
    const double part = vec3_dot(e->along, r);
    const double ball = (double)*value + e->radius, tube = (double)*value + e->height;
    if (vec3_dot(d, d) > ball * ball || vec3_dot(r, r) - part * part > tube * tube ||
        fabs(vec3_dot(e->normal, vec3_sub(at, e->x[0]))) >= (double)*value)
        return;
    ClosestPair pair;
    distance_point_triangle(at, e->x, &pair);
    *value = fminf(*value, (float)pair.distance);
}

// Enters the distances of the samples around a triangle, in samples. `x`: its corners in samples.
static void enter_triangle(SurfaceField *field, const Vec3 x[3])
{
    const double reach = FIELD_NEAR * FIELD_PARTS;
    const Entered entered = bound_triangle(x);
    Box box = box_empty();
    int first[3], end[3];
    for (int c = 0; c < 3; c++)
        box_add(&box, x[c]);
    for (int a = 0; a < 3; a++) {
        first[a] = (int)fmax(ceil(box.low[a] - reach), 0.0);
        end[a] = (int)fmin(floor(box.high[a] + reach) + 1.0, field->count[a]);
    }
    for (int k = first[2]; k < end[2]; k++)
        for (int j = first[1]; j < end[1]; j++) {
            float *row = &field->value[((long)k * field->count[1] + j) * field->count[0]];
            int from = first[0], to = end[0];
            clip_row(&entered, j, k, reach, &from, &to);
            for (int i = from; i < to; i++)
                enter_sample(&entered, vec3(i, j, k), &row[i]);
        }
}

// Gives distances [samples] their sign, in cells.
static void sign_distances(SurfaceField *field, const Lattice *fine)
{
    enum { MARGIN = FIELD_PARTS * FIELD_MARGIN };
    float *value = field->value;
    for (int k = 0; k < field->count[2]; k++)
        for (int j = 0; j < field->count[1]; j++)
            for (int i = 0; i < field->count[0]; i++, value++) {
                const bool inside = lattice_label(fine, i - MARGIN, j - MARGIN, k - MARGIN) != 0;
                *value *= inside ? 1.0F / FIELD_PARTS : -1.0F / FIELD_PARTS;
            }
}

// Makes samples in the middles of fine cells, and some around, with the largest distance.
static void create_around(SurfaceField *field, const Lattice *lattice, const Lattice *fine)
{
    const double offset[3] = {fine->origin.x - lattice->origin.x,
                              fine->origin.y - lattice->origin.y,
                              fine->origin.z - lattice->origin.z};
    size_t samples = 1;
    *field = (SurfaceField){0};
    for (int a = 0; a < 3; a++) {
        field->count[a] = fine->count[a] + 2 * FIELD_PARTS * FIELD_MARGIN;
        field->low[a] = offset[a] / lattice->size + 0.5 / FIELD_PARTS - FIELD_MARGIN;
        samples *= (size_t)field->count[a];
    }
    field->value = sized(samples, sizeof *field->value);
    for (size_t s = 0; s < samples; s++)
        field->value[s] = (float)(FIELD_NEAR * FIELD_PARTS);
}

void surface_field_of_mesh(SurfaceField *field, const Lattice *lattice, const TriMesh *mesh)
{
    Lattice fine;
    Status said = {0};
    if (!voxelise(&fine, mesh, lattice->size / FIELD_PARTS, lattice->shells.filled, &said)) {
        surface_field_of_cells(field, lattice);
        return;
    }
    create_around(field, lattice, &fine);
    const double scale = FIELD_PARTS / lattice->size;
    const Vec3 low =
        vec3(FIELD_PARTS * field->low[0], FIELD_PARTS * field->low[1], FIELD_PARTS * field->low[2]);
    // Every 64th triangle first, so that those between them find distances that are almost right:
    // in the order of the file each would come a little nearer than the one before it.
    enum { STRIDE = 64 };
    for (int first = 0; first < STRIDE; first++)
        for (int t = first; t < mesh->triangle_count; t += STRIDE) {
            Vec3 x[3];
            for (int c = 0; c < 3; c++) {
                const Vec3 at = vec3_sub(mesh->position[mesh->triangle[t][c]], lattice->origin);
                x[c] = vec3_sub(vec3_scale(scale, at), low);
            }
            enter_triangle(field, x);
        }
    sign_distances(field, &fine);
    const double cube = lattice->size * lattice->size * lattice->size;
    const double volume = mesh_volume(mesh) / cube, cells = (double)lattice_solid(lattice);
    if (fabs(volume - cells) < VOLUME_SURE * cells) // else its parts overlap, or face each other
        field->volume = volume;
    lattice_destroy(&fine);
}
