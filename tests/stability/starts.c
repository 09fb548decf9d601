// SPDX-License-Identifier: MIT
// Files: odd meshes, a volume of two materials, states that no run would make.
#include "trial.h"

#include "base/check.h"
#include "geometry/generator.h"
#include "random.h"
#include "scoped.h"

#include <float.h>
#include <hdf5.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static FILE *create(const char *folder, const char *name)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    ASSERT(file != NULL);
    return file;
}

static void write_off(const char *folder, const char *name, const TriMesh *mesh)
{
    CLOSED FILE *file = create(folder, name);
    fprintf(file, "OFF\n%d %d 0\n", mesh->node_count, mesh->triangle_count);
    for (int i = 0; i < mesh->node_count; i++)
        fprintf(file, "%.17g %.17g %.17g\n", mesh->position[i].x, mesh->position[i].y,
                mesh->position[i].z);
    for (int f = 0; f < mesh->triangle_count; f++)
        fprintf(file, "3 %d %d %d\n", mesh->triangle[f][0], mesh->triangle[f][1],
                mesh->triangle[f][2]);
}

// A sphere whose rings draw together towards the upper pole, by one factor from each to the next:
// faces there have `ratio` of the edge length of those at the equator, all of about one shape.
static void write_graded(const char *folder, const char *name, double ratio)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    const int segments = 6;
    const double factor = 2.4; // near 2 pi / segments + 1: faces as high as wide
    const int rings = 2 + (int)ceil(log(1.0 / ratio) / log(factor));
    bool made = generate_uv_sphere(&mesh, rings, segments, 0.05, &(Status){0});
    ASSERT(made);
    for (int i = 0; i < mesh.node_count; i++) {
        Vec3 *p = &mesh.position[i];
        const double polar = acos(fmax(-1.0, fmin(1.0, p->z / 0.05)));
        const double ring = polar / M_PI * (rings + 1); // 0 and rings + 1: the poles
        if (ring < 0.5 || ring > rings + 0.5)
            continue;
        const double angle = 0.75 * M_PI * pow(factor, ring - rings);
        const double round = atan2(p->y, p->x);
        *p = (Vec3){0.05 * sin(angle) * cos(round), 0.05 * sin(angle) * sin(round),
                    0.05 * cos(angle)};
    }
    write_off(folder, name, &mesh);
}

// A sphere one of whose nodes lies beside another; apart 0: in the same place.
static void write_near(const char *folder, const char *name, double apart)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    bool made = generate_ico_sphere(&mesh, 1, 0.05, &(Status){0});
    ASSERT(made);
    const int *face = mesh.triangle[0];
    mesh.position[face[1]] =
        vec3_add(mesh.position[face[0]], (Vec3){0.6 * apart, 0.8 * apart, 0.0});
    write_off(folder, name, &mesh);
}

// 4 x 4 x 4 cells of 12.5 mm about the origin; label 2 is the upper quarter.
static void write_labels(const char *folder)
{
    CLOSED FILE *file = create(folder, "labels.nrrd");
    fprintf(file, "NRRD0004\ntype: uchar\ndimension: 3\nspace: left-posterior-superior\n"
                  "sizes: 4 4 4\nspace directions: (12.5,0,0) (0,12.5,0) (0,0,12.5)\n"
                  "space origin: (-18.75,-18.75,-18.75)\nencoding: raw\n\n");
    for (int i = 0; i < 64; i++)
        fputc(i / 16 == 3 ? 2 : 1, file);
}

void trial_write_files(const char *folder)
{
    // The masses of nodes go with the squares of the edges.
    write_graded(folder, "graded3.off", 1.0 / sqrt(1e3));
    write_graded(folder, "graded6.off", 1e-3);
    write_near(folder, "twins.off", 0.0);
    write_near(folder, "near.off", 1e-9);
    write_labels(folder);
    FILE *file = create(folder, "triangle.off");
    fprintf(file, "OFF\n3 1 0\n-0.05 0 0\n0.05 0 0\n0 0 0.05\n3 0 1 2\n");
    fclose(file);
    file = create(folder, "nothing.off");
    fprintf(file, "OFF\n0 0 0\n");
    fclose(file);
}

// ---------------------------------------------------------------------------------------------

typedef struct Row {
    int id;
    Vec3 position;
} Row;

static int compare(const void *a, const void *b)
{
    const Row *left = a, *right = b;
    return (left->id > right->id) - (left->id < right->id);
}

// The body's nodes in ascending id; of a surface body those of its mesh, which come first.
static int read_rows(const Body *body, const Model *model, Row **row)
{
    const int most = body->state_capacity;
    int *id = malloc((size_t)most * sizeof *id), count = 0;
    FREED Vec3 *x = malloc((size_t)most * sizeof *x), *v = malloc((size_t)most * sizeof *v);
    *row = malloc((size_t)most * sizeof **row);
    ASSERT(id != NULL && x != NULL && v != NULL && *row != NULL);
    const int read = body->ops->read_state(body->model, id, x, v);
    for (int i = 0; i < read; i++)
        if (id[i] >= 0)
            (*row)[count++] = (Row){id[i], x[i]};
    qsort(*row, (size_t)count, sizeof **row, compare);
    free(id);
    enum { SPHERE_NODES = 42 };
    return model->kind == KIND_SURFACE && count > SPHERE_NODES ? SPHERE_NODES : count;
}

static void box_of(const Row *row, int count, Vec3 *low, Vec3 *high)
{
    *low = (Vec3){DBL_MAX, DBL_MAX, DBL_MAX};
    *high = vec3_scale(-1.0, *low);
    for (int i = 0; i < count; i++) {
        const Vec3 x = row[i].position;
        *low = (Vec3){fmin(low->x, x.x), fmin(low->y, x.y), fmin(low->z, x.z)};
        *high = (Vec3){fmax(high->x, x.x), fmax(high->y, x.y), fmax(high->z, x.z)};
    }
}

double trial_size(const Body *body)
{
    Row *row;
    Vec3 low, high;
    const Model any = {.kind = KIND_VOXEL};
    const int count = read_rows(body, &any, &row);
    box_of(row, count, &low, &high);
    free(row);
    return vec3_length(vec3_sub(high, low));
}

static Vec3 moved(Vec3 x, const Model *model, Start start, uint64_t *random)
{
    const double half = model->kind == KIND_SURFACE ? 0.25 : 0.05;
    switch (start) {
    case START_FLAT:
        if (model->kind == KIND_PLANE)
            x.y = 0.0;
        else
            x.z = 0.0;
        return x;
    case START_MIRRORED:
        x.x = -x.x;
        return x;
    case START_POINT:
        return (Vec3){0.0, 0.0, 0.0};
    case START_RANDOM:
        x = vec3_scale(half, random_vec3(random));
        if (model->kind == KIND_PLANE)
            x.z = 0.0;
        return x;
    default:
        return x;
    }
}

static void write_vectors(const char *path, const double *value, int count)
{
    const hsize_t size[2] = {(hsize_t)count, 3};
    hid_t file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    hid_t space = H5Screate_simple(2, size, NULL);
    hid_t set = H5Dcreate2(file, "/position", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT,
                           H5P_DEFAULT);
    bool written = H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0;
    ASSERT(written);
    H5Dclose(set);
    H5Sclose(space);
    H5Fclose(file);
}

void trial_write_start(const char *path, const Body *body, const Model *model, Start start)
{
    Row *row;
    Vec3 low, high;
    const int count = read_rows(body, model, &row);
    box_of(row, count, &low, &high);
    FREED double *value = zeroed(3 * (size_t)count, sizeof *value);
    uint64_t random = 20;
    for (int i = 0; i < count; i++) {
        Vec3 x = row[i].position;
        // What is held stays: the bottom of the models that have elements.
        const bool held = (model->kind == KIND_VOXEL && x.z < low.z + 1e-4) ||
                          (model->kind == KIND_PLANE && x.y < -0.036);
        x = held ? x : moved(x, model, start, &random);
        value[3 * i] = x.x;
        value[3 * i + 1] = x.y;
        value[3 * i + 2] = x.z;
    }
    write_vectors(path, value, count);
    free(row);
}
