// SPDX-License-Identifier: MIT
#include "voxel_world.h"

#include "random.h"
#include "sim_steps.h"

#include "base/check.h"
#include "voxel/model.h"

#ifdef __SSE2__
#include <xmmintrin.h>
#endif

static void need(bool good, const Status *status)
{
    if (!good) {
        fprintf(stderr, "%s\n", status->text);
        abort();
    }
}

VoxelWorldOptions voxel_world_cube(int n)
{
    VoxelWorldOptions options = {
        .body = {.body.name = "body",
                 .body.levels = n >= 8 ? 2 : 0,
                 .damping = 0.2,
                 .body.integrator = INTEGRATOR_SYMPLECTIC_EULER,
                 .body.precision = PRECISION_DOUBLE,
                 .body.contact_ratio = 0.5,
                 .body.contact_damping = 2e-4,
                 .body.friction = 0.2},
        .material = {.youngs_modulus = 1e4, .density = 1000.0},
        .rate_hz = 1000.0,
    };
    Status status = {0};
    need(lattice_box(&options.lattice, (int[3]){n, n, n}, 0.1 / n, &status), &status);
    return options;
}

VoxelWorldOptions voxel_world_block(int x, int y, int z, double size)
{
    VoxelWorldOptions options = voxel_world_cube(4);
    Status status = {0};
    lattice_destroy(&options.lattice);
    need(lattice_box(&options.lattice, (int[3]){x, y, z}, size, &status), &status);
    return options;
}

VoxelWorldOptions voxel_world_ball(void)
{
    VoxelWorldOptions options = voxel_world_cube(8);
    lattice_destroy(&options.lattice);
    Status status = {0};
    need(lattice_ball(&options.lattice, 0.05, 0.01, &status), &status);
    return options;
}

const SolidMaterial VOXEL_WORLD_MATERIALS[3] = {
    {.youngs_modulus = 1e4, .density = 1000.0},
    {.youngs_modulus = 4e4, .poisson_ratio = 0.3, .density = 1100.0},
    {.youngs_modulus = 2e3, .poisson_ratio = 0.45, .density = 900.0},
};

VoxelWorldOptions voxel_world_corner(void)
{
    VoxelWorldOptions options = voxel_world_cube(8);
    lattice_destroy(&options.lattice);
    Status status = {0};
    need(lattice_create(&options.lattice, (int[3]){12, 6, 12}, 0.008, &status), &status);
    Lattice *lattice = &options.lattice;
    for (int k = 0; k < 12; k++)
        for (int j = 0; j < 6; j++)
            for (int i = 0; i < 12; i++)
                if (i < 6 || k < 6) // the corner, then an arm each
                    lattice->label[lattice_index(lattice, i, j, k)] = (unsigned char)(i >= 6   ? 2
                                                                                      : k >= 7 ? 3
                                                                                               : 1);
    options.body.material = VOXEL_WORLD_MATERIALS;
    options.body.material_count = 3;
    return options;
}

void voxel_world_create(VoxelWorld *world, VoxelWorldOptions *options)
{
#ifdef __SSE2__
    _mm_setcsr(_mm_getcsr() | 0x8040); // flush to zero, denormals are zero
#endif
    *world = (VoxelWorld){.lattice = options->lattice};
    for (int i = 0; i < LATTICE_MATERIALS; i++)
        world->material[i] = options->material;
    options->body.lattice = &world->lattice;
    if (options->body.material_count == 0) {
        options->body.material = world->material;
        options->body.material_count = LATTICE_MATERIALS;
    }
    SimOptions sim = {.rate_hz = options->rate_hz,
                      .gravity = options->body.body.gravity,
                      .tool_timeout_s = 0.2,
                      .may_load = true,
                      .contact_stiffness = options->contact_stiffness};
    world->sim = sim_create(&sim, &world->arena, &world->state);
    Body body = {0};
    Status status = {0};
    need(voxel_create(&body, &options->body, &world->arena, &world->state, &status), &status);
    world->body = sim_add_body(world->sim, &body);
    for (int t = 0; t < options->tool_count; t++)
        sim_add_tool(world->sim, &options->tool[t]);
    need(sim_seal(world->sim, 0.0, &status), &status);

    const VoxelModel *model = world->body->model;
    world->count = model->vertices.count;
    size_t count = (size_t)world->count;
    world->id = zeroed(count, sizeof *world->id);
    world->x = zeroed(count, sizeof *world->x);
    world->v = zeroed(count, sizeof *world->v);
    world->mass = zeroed(count, sizeof *world->mass);
    for (size_t i = 0; i < count; i++)
        world->mass[i] = model->vertices.mass[i];
    voxel_world_read(world);
}

void voxel_world_destroy(VoxelWorld *world)
{
    lattice_destroy(&world->lattice);
    state_destroy(&world->state);
    arena_destroy(&world->arena);
    free(world->id);
    free(world->x);
    free(world->v);
    free(world->mass);
}

void voxel_world_run(VoxelWorld *world, double seconds)
{
    long ticks = lround(seconds / sim_tick(world->sim));
    for (long i = 0; i < ticks; i++)
        sim_step(world->sim);
}

void voxel_world_read(VoxelWorld *world)
{
    world->body->ops->read_state(world->body->model, world->id, world->x, world->v);
}

void voxel_world_write(VoxelWorld *world, const Vec3 *x, const Vec3 *v)
{
    VoxelModel *model = world->body->model;
    for (int i = 0; i < world->count; i++)
        rows_write(&model->vertices.rows, model->vertices.row[model->vertices.current], i, x[i],
                   v[i]);
}

void voxel_world_throw(VoxelWorld *world)
{
    voxel_world_read(world);
    uint64_t random = 21;
    for (int i = 0; i < world->count; i++) {
        world->v[i] = vec3_cross(vec3(2.0, -4.0, 8.0), world->x[i]);
        world->v[i] = vec3_madd(world->v[i], 0.5, random_vec3(&random));
    }
    voxel_world_write(world, world->x, world->v);
    voxel_world_read(world);
}

void voxel_world_momentum(const VoxelWorld *world, Vec3 *linear, Vec3 *angular)
{
    const Momentum sum = momentum_of(world->count, world->mass, world->x, world->v);
    *linear = sum.linear;
    *angular = sum.angular;
}

bool voxel_world_is_outside(const VoxelWorld *world, Vec3 point)
{
    const BodySurface *surface = &world->body->surface;
    double solid_angle = 0.0;
    for (int f = 0; f < surface->face_used; f++) {
        Vec3 x[3];
        world->body->ops->read_nodes(world->body->model, surface->face[f], 3, x, NULL);
        for (int k = 0; k < 3; k++)
            x[k] = vec3_sub(x[k], point);
        // Van Oosterom and Strackee 1983, eq. 8.
        double a = vec3_length(x[0]), b = vec3_length(x[1]), c = vec3_length(x[2]);
        double over = vec3_dot(x[0], vec3_cross(x[1], x[2]));
        double under = a * b * c + vec3_dot(x[0], x[1]) * c + vec3_dot(x[1], x[2]) * a +
                       vec3_dot(x[2], x[0]) * b;
        solid_angle += 2.0 * atan2(over, under);
    }
    return fabs(solid_angle) < 6.28; // 4 pi inside, 0 outside
}
