// SPDX-License-Identifier: MIT
#include "voxel_bench.h"
#include "scoped.h"

#include "base/check.h"
#include "random.h"
#include "voxel_coarse.h"
#include "voxel/voxel.h"

#include <stdlib.h>
#include <string.h>

VoxelBenchOptions voxel_bench_options(int levels)
{
    return (VoxelBenchOptions){
        .levels = levels,
        .law = VOXEL_AFFINE,
        .youngs_modulus = 1e4,
        .density = 1000.0,
    };
}

// The stiffness at rest by central differences: with a step of 1e-5 H the third derivative leaves
// 1e-10 of it, and rounding 1e-11.
static void differentiate(VoxelBenchClass *class, double size)
{
    const Element *element = &class->element;
    int n = 3 * element->count;
    class->matrix = zeroed(n * n, sizeof *class->matrix);
    Vec3 position[NODE_COUNT];
    memcpy(position, element->rest, (size_t)element->count * sizeof *position);
    double step = 1e-5 * size;
    for (int side = 0; side < 2; side++) {
        for (int column = 0; column < n; column++) {
            Vec3 force[NODE_COUNT] = {{0.0, 0.0, 0.0}}, kept = position[column / 3];
            double move = side == 0 ? -step : step;
            Vec3 *x = &position[column / 3];
            *x = vec3_add(*x, vec3(column % 3 == 0 ? move : 0.0, column % 3 == 1 ? move : 0.0,
                                   column % 3 == 2 ? move : 0.0));
            Quat last = {1.0, 0.0, 0.0, 0.0};
            element_forces(element, &class->stiffness, position, NULL, &last, force);
            for (int i = 0; i < element->count; i++) {
                class->matrix[(3 * i + 0) * n + column] -= force[i].x / (2.0 * move);
                class->matrix[(3 * i + 1) * n + column] -= force[i].y / (2.0 * move);
                class->matrix[(3 * i + 2) * n + column] -= force[i].z / (2.0 * move);
            }
            *x = kept;
        }
    }
}

static void create_class(VoxelBench *bench, VoxelBenchClass *class, unsigned mask, int level,
                         const uint64_t *solid, const VoxelBenchOptions *options)
{
    if (options->coarse > 0 && level > 0)
        template_create_partial(&class->shape, mask, level, solid);
    else
        template_create(&class->shape, mask);
    memcpy(class->solid, solid, sizeof class->solid);
    class->level = level;
    double size = bench->size * (1 << level), spread = 0.0;
    bool paper = options->law == VOXEL_MIYAZAKI2004;
    for (int i = 0; i < class->shape.count; i++) {
        class->rest[i] = vec3_scale(size, class->shape.rest[i]);
        class->area[i] = vec3_scale(size * size, class->shape.area[i]);
        class->weight[i] = paper && options->unit_weights ? 1.0 : class->shape.weight[i];
        spread += class->weight[i] * vec3_dot(class->rest[i], class->rest[i]);
    }
    const double share = class->shape.share;
    class->element = (Element){class->shape.count, class->rest, class->weight, class->area,
                               share * size * size * size};
    double alpha = options->alpha > 0.0 ? options->alpha : (1.0 + options->poisson_ratio) / 3.0;
    double k = share * bench->mu * size;
    class->stiffness = (ElementStiffness){
        .law = options->law,
        .mu = bench->mu,
        .lambda = bench->lambda,
        .residual = !paper                  ? class->shape.softer * alpha * k
                    : options->unit_weights ? k * 6.0 * size * size / spread
                                            : k,
        .damping = options->damping * bench->critical_step * k,
    };
    differentiate(class, size);
}

static void find_classes(VoxelBench *bench, const VoxelBenchOptions *options)
{
    enum { MOST = 4096 };
    bench->class = zeroed(MOST, sizeof *bench->class);
    bench->class_of = zeroed(bench->element_count, sizeof *bench->class_of);
    for (int e = 0; e < bench->element_count; e++) {
        unsigned mask = template_mask_of(bench->mesh.vertex[e]);
        int level = bench->layout.leaf[e].level, c = 0;
        uint64_t solid[sizeof bench->class->solid / sizeof(uint64_t)] = {0};
        if (options->coarse > 0)
            voxel_coarse_solid(&bench->lattice, &bench->layout.leaf[e], solid);
        while (c < bench->class_count &&
               (bench->class[c].shape.mask != mask || bench->class[c].level != level ||
                memcmp(bench->class[c].solid, solid, sizeof solid) != 0))
            c++;
        ASSERT(c < MOST);
        if (c == bench->class_count)
            create_class(bench, &bench->class[bench->class_count++], mask, level, solid, options);
        bench->class_of[e] = c;
    }
}

void voxel_bench_create(VoxelBench *bench, Lattice *lattice, const VoxelBenchOptions *options)
{
    *bench = (VoxelBench){.lattice = *lattice, .size = lattice->size};
    *lattice = (Lattice){0};
    if (options->coarse > 0) {
        voxel_coarse_create(&bench->lattice, options->coarse, options->may_be_coarse,
                            &bench->layout, &bench->mesh);
    } else {
        layout_create(&bench->layout, &bench->lattice, options->levels);
        bool made = lattice_mesh_create(&bench->mesh, &bench->layout, &(Status){0});
        ASSERT(made);
    }
    int n = bench->vertex_count = bench->mesh.vertex_count;
    int m = bench->element_count = bench->mesh.element_count;
    double nu = options->poisson_ratio, modulus = options->youngs_modulus;
    bench->mu = modulus / (2.0 * (1.0 + nu));
    bench->lambda = modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
    SolidMaterial material = {
        .youngs_modulus = modulus, .poisson_ratio = nu, .density = options->density};
    bench->critical_step = voxel_critical_step(&material, bench->size);
    find_classes(bench, options);
    bench->rest = zeroed(n, sizeof *bench->rest);
    bench->position = zeroed(n, sizeof *bench->position);
    bench->velocity = zeroed(n, sizeof *bench->velocity);
    bench->force = zeroed(n, sizeof *bench->force);
    bench->mass = zeroed(n, sizeof *bench->mass);
    bench->last = zeroed(m, sizeof *bench->last);
    for (int i = 0; i < n; i++) {
        const int *p = bench->mesh.point[i];
        bench->rest[i] = bench->position[i] = lattice_point(&bench->lattice, p[0], p[1], p[2]);
    }
    for (int e = 0; e < m; e++) {
        const VoxelBenchClass *class = &bench->class[bench->class_of[e]];
        bench->last[e] = (Quat){1.0, 0.0, 0.0, 0.0};
        for (int i = 0; i < class->shape.count; i++) {
            int v = bench->mesh.vertex[e][class->shape.node[i]];
            bench->mass[v] +=
                options->density * class->element.volume * class->shape.weight[i] / 8.0;
        }
    }
}

void voxel_bench_box(VoxelBench *bench, int x, int y, int z, double size,
                     const VoxelBenchOptions *options)
{
    Lattice lattice;
    bool made = lattice_box(&lattice, (const int[3]){x, y, z}, size, &(Status){0});
    ASSERT(made);
    voxel_bench_create(bench, &lattice, options);
}

void voxel_bench_blob(VoxelBench *bench, int n, double size, uint64_t *random,
                      const VoxelBenchOptions *options)
{
    Lattice lattice;
    bool made = lattice_create(&lattice, (const int[3]){n, n, n}, size, &(Status){0});
    ASSERT(made);
    // All contain the middle, so that they are joined.
    for (int part = 0; part < 5; part++) {
        int low[3], high[3], radius = 2 + random_below(random, n / 2 - 2);
        bool round = random_below(random, 2) == 0;
        for (int d = 0; d < 3; d++) {
            low[d] = random_below(random, n / 2);
            high[d] = n / 2 + random_below(random, n / 2);
        }
        for (int c = 0; c < n * n * n; c++) {
            int at[3] = {c % n, c / n % n, c / n / n}, square = 0;
            bool inside = true;
            for (int d = 0; d < 3; d++) {
                inside = inside && at[d] >= low[d] && at[d] <= high[d];
                square += (at[d] - n / 2) * (at[d] - n / 2);
            }
            if (round ? square <= radius * radius : inside)
                lattice.label[c] = 1;
        }
    }
    voxel_bench_create(bench, &lattice, options);
}

void voxel_bench_destroy(VoxelBench *bench)
{
    for (int c = 0; c < bench->class_count; c++)
        free(bench->class[c].matrix);
    free(bench->class);
    free(bench->class_of);
    free(bench->rest);
    free(bench->position);
    free(bench->velocity);
    free(bench->force);
    free(bench->mass);
    free(bench->last);
    lattice_mesh_destroy(&bench->mesh);
    layout_destroy(&bench->layout);
    lattice_destroy(&bench->lattice);
}

int voxel_bench_gather(const VoxelBench *bench, int element, const Vec3 *from, Vec3 *out)
{
    const Template *shape = &bench->class[bench->class_of[element]].shape;
    for (int i = 0; i < shape->count; i++)
        out[i] = from[bench->mesh.vertex[element][shape->node[i]]];
    return shape->count;
}

static void scatter(const VoxelBench *bench, int element, const Vec3 *from, Vec3 *out)
{
    const Template *shape = &bench->class[bench->class_of[element]].shape;
    for (int i = 0; i < shape->count; i++) {
        int v = bench->mesh.vertex[element][shape->node[i]];
        out[v] = vec3_add(out[v], from[i]);
    }
}

double voxel_bench_forces(VoxelBench *bench)
{
    double energy = 0.0;
    memset(bench->force, 0, (size_t)bench->vertex_count * sizeof *bench->force);
    for (int e = 0; e < bench->element_count; e++) {
        const VoxelBenchClass *class = &bench->class[bench->class_of[e]];
        Vec3 position[NODE_COUNT], velocity[NODE_COUNT], force[NODE_COUNT] = {{0.0, 0.0, 0.0}};
        voxel_bench_gather(bench, e, bench->position, position);
        voxel_bench_gather(bench, e, bench->velocity, velocity);
        energy += element_forces(&class->element, &class->stiffness, position, velocity,
                                 &bench->last[e], force);
        scatter(bench, e, force, bench->force);
    }
    return energy;
}

void voxel_bench_step(VoxelBench *bench, double dt)
{
    voxel_bench_forces(bench);
    for (int i = 0; i < bench->vertex_count; i++) {
        Vec3 *v = &bench->velocity[i];
        *v = vec3_madd(*v, dt / bench->mass[i], bench->force[i]);
        bench->position[i] = vec3_madd(bench->position[i], dt, *v);
    }
}

double voxel_bench_kinetic(const VoxelBench *bench)
{
    double sum = 0.0;
    for (int i = 0; i < bench->vertex_count; i++)
        sum += 0.5 * bench->mass[i] * vec3_dot(bench->velocity[i], bench->velocity[i]);
    return sum;
}

void voxel_bench_momentum(const VoxelBench *bench, Vec3 *linear, Vec3 *angular)
{
    *linear = *angular = vec3(0.0, 0.0, 0.0);
    for (int i = 0; i < bench->vertex_count; i++) {
        Vec3 p = vec3_scale(bench->mass[i], bench->velocity[i]);
        *linear = vec3_add(*linear, p);
        *angular = vec3_add(*angular, vec3_cross(bench->position[i], p));
    }
}

int voxel_bench_inverted(const VoxelBench *bench)
{
    int count = 0;
    for (int e = 0; e < bench->element_count; e++) {
        const VoxelBenchClass *class = &bench->class[bench->class_of[e]];
        Vec3 x[NODE_COUNT], column[3] = {{0.0, 0.0, 0.0}};
        int n = voxel_bench_gather(bench, e, bench->position, x);
        for (int i = 0; i < n; i++) {
            column[0] = vec3_madd(column[0], class->area[i].x, vec3_sub(x[i], x[0]));
            column[1] = vec3_madd(column[1], class->area[i].y, vec3_sub(x[i], x[0]));
            column[2] = vec3_madd(column[2], class->area[i].z, vec3_sub(x[i], x[0]));
        }
        count += !(vec3_dot(column[0], vec3_cross(column[1], column[2])) > 0.0);
    }
    return count;
}

// out = K p of the free ones.
static void multiply(const VoxelBench *bench, const bool *fixed, const Vec3 *p, Vec3 *out)
{
    memset(out, 0, (size_t)bench->vertex_count * sizeof *out);
    for (int e = 0; e < bench->element_count; e++) {
        const VoxelBenchClass *class = &bench->class[bench->class_of[e]];
        Vec3 own[NODE_COUNT], product[NODE_COUNT];
        int count = voxel_bench_gather(bench, e, p, own), n = 3 * count;
        for (int i = 0; i < count; i++)
            own[i] = quat_rotate(quat_conjugate(bench->last[e]), own[i]);
        for (int i = 0; i < count; i++) {
            double sum[3] = {0.0, 0.0, 0.0};
            for (int c = 0; c < 3; c++) {
                const double *row = class->matrix + (3 * i + c) * n;
                for (int k = 0; k < count; k++)
                    sum[c] += row[3 * k] * own[k].x + row[3 * k + 1] * own[k].y +
                              row[3 * k + 2] * own[k].z;
            }
            product[i] = quat_rotate(bench->last[e], vec3(sum[0], sum[1], sum[2]));
        }
        scatter(bench, e, product, out);
    }
    double *value = &out[0].x;
    for (int i = 0; i < 3 * bench->vertex_count; i++) {
        if (fixed[i])
            value[i] = 0.0;
    }
}

static double inner(const VoxelBench *bench, const Vec3 *a, const Vec3 *b)
{
    double sum = 0.0;
    for (int i = 0; i < bench->vertex_count; i++)
        sum += vec3_dot(a[i], b[i]);
    return sum;
}

// K x = b by conjugate gradients, scaled by the vertices' masses (the stiffness of an element
// grows as its size does, its mass as the cube: close enough). b becomes the residual.
static void conjugate_gradients(const VoxelBench *bench, const bool *fixed, Vec3 *b,
                                double tolerance, Vec3 *x)
{
    int n = bench->vertex_count;
    Vec3 *p = zeroed(n, sizeof *p), *product = zeroed(n, sizeof *product);
    FREED Vec3 *z = zeroed(n, sizeof *z);
    double first = 0.0, rho = 0.0;
    memset(x, 0, (size_t)n * sizeof *x);
    for (int step = 0; step < 20 * n + 100; step++) {
        for (int i = 0; i < n; i++)
            z[i] = vec3_scale(1.0 / cbrt(bench->mass[i]), b[i]);
        double next = inner(bench, b, z);
        if (step == 0)
            first = next;
        if (!(next > tolerance * tolerance * first))
            break;
        for (int i = 0; i < n; i++)
            p[i] = step == 0 ? z[i] : vec3_madd(z[i], next / rho, p[i]);
        rho = next;
        multiply(bench, fixed, p, product);
        double length = rho / inner(bench, p, product);
        for (int i = 0; i < n; i++) {
            x[i] = vec3_madd(x[i], length, p[i]);
            b[i] = vec3_madd(b[i], -length, product[i]);
        }
    }
    free(p);
    free(product);
}

void voxel_bench_solve_linear(VoxelBench *bench, const bool *fixed, const double *load,
                              Vec3 *displacement)
{
    FREED Vec3 *b = zeroed(bench->vertex_count, sizeof *b);
    for (int i = 0; i < bench->element_count; i++)
        bench->last[i] = (Quat){1.0, 0.0, 0.0, 0.0};
    double *value = &b[0].x;
    for (int i = 0; i < 3 * bench->vertex_count; i++)
        value[i] = fixed[i] ? 0.0 : load[i];
    conjugate_gradients(bench, fixed, b, 1e-12, displacement);
}

bool voxel_bench_solve(VoxelBench *bench, const bool *fixed, const double *load, double tolerance)
{
    int n = bench->vertex_count;
    Vec3 *b = zeroed(n, sizeof *b), *move = zeroed(n, sizeof *move);
    bool solved = false;
    for (int step = 0; step < 100 && !solved; step++) {
        voxel_bench_forces(bench);
        double *value = &b[0].x, worst = 0.0;
        const double *force = &bench->force[0].x;
        for (int i = 0; i < 3 * n; i++) {
            value[i] = fixed[i] ? 0.0 : force[i] + (load != NULL ? load[i] : 0.0);
            worst = fmax(worst, fabs(value[i]));
        }
        solved = worst <= tolerance;
        if (solved)
            break;
        conjugate_gradients(bench, fixed, b, 1e-2, move);
        for (int i = 0; i < n; i++)
            bench->position[i] = vec3_add(bench->position[i], move[i]);
    }
    free(b);
    free(move);
    return solved;
}
