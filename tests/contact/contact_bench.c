// SPDX-License-Identifier: MIT
#include "contact_bench.h"

#include "base/check.h"
#include "geometry/generator.h"
#include "sim_steps.h"

#ifdef __SSE2__
#include <xmmintrin.h>
#endif

static const double SEAT = -0.5 * BENCH_RADIUS;

static void need(bool good, const Status *status)
{
    if (!good) {
        fprintf(stderr, "%s\n", status->text);
        abort();
    }
}

BenchOptions bench_options(void)
{
    return (BenchOptions){
        .fixing = BENCH_SEATED,
        .youngs_modulus_2d = 80.0,
        .contact_ratio = 0.5,
        .contact_damping = 2e-4,
        .friction = 0.3,
        .shape_frequency = 50.0,
        .shape_damping = 0.3,
        .integrator = INTEGRATOR_LEAPFROG,
        .rate_hz = 1000.0,
        .tool_timeout_s = 0.2,
    };
}

BenchOptions bench_with_tool(TriMesh mesh, ToolOptions tool)
{
    BenchOptions options = bench_options();
    options.mesh = mesh;
    options.tool[options.tool_count++] = tool;
    return options;
}

// ---------------------------------------------------------------------------------------------
// Meshes and tools

TriMesh bench_ico_sphere(int subdivisions)
{
    TriMesh mesh;
    Status status = {0};
    need(generate_ico_sphere(&mesh, subdivisions, BENCH_RADIUS, &status), &status);
    return mesh;
}

TriMesh bench_uv_sphere(void)
{
    TriMesh mesh;
    Status status = {0};
    need(generate_uv_sphere(&mesh, 8, 14, BENCH_RADIUS, &status), &status);
    return mesh;
}

// A sheet of right-angled faces, sheared until they are equilateral, with its middle node moved to
// the origin.
TriMesh bench_sheet(double edge, int cells)
{
    TriMesh mesh;
    Status status = {0};
    need(generate_sheet(&mesh, cells + 1, cells + 1, cells, cells, &status), &status);
    // Which way the diagonals run decides the way to shear.
    const int *t = mesh.triangle[0];
    double lean = 0.0;
    for (int k = 0; k < 3; k++) {
        Vec3 side = vec3_sub(mesh.position[t[(k + 1) % 3]], mesh.position[t[k]]);
        if (fabs(side.x) > 0.5 && fabs(side.y) > 0.5)
            lean = side.x * side.y > 0.0 ? -0.5 : 0.5;
    }
    Vec3 middle = {HUGE_VAL, 0.0, 0.0};
    for (int i = 0; i < mesh.node_count; i++) {
        Vec3 *x = &mesh.position[i];
        *x = vec3(edge * (x->x + lean * x->y), edge * sqrt(0.75) * x->y, 0.0);
        if (vec3_length(*x) < vec3_length(middle))
            middle = *x;
    }
    for (int i = 0; i < mesh.node_count; i++)
        mesh.position[i] = vec3_sub(mesh.position[i], middle);
    return mesh;
}

int bench_node_towards(const TriMesh *mesh, Vec3 direction)
{
    int best = 0;
    for (int i = 1; i < mesh->node_count; i++)
        if (vec3_dot(mesh->position[i], direction) > vec3_dot(mesh->position[best], direction))
            best = i;
    return best;
}

Vec3 bench_face_center(const TriMesh *mesh, int face)
{
    const int *t = mesh->triangle[face];
    return vec3_scale(1.0 / 3.0, vec3_add(vec3_add(mesh->position[t[0]], mesh->position[t[1]]),
                                          mesh->position[t[2]]));
}

int bench_face_near(const TriMesh *mesh, Vec3 point)
{
    int best = 0;
    double least = HUGE_VAL;
    for (int f = 0; f < mesh->triangle_count; f++) {
        double distance = vec3_length(vec3_sub(bench_face_center(mesh, f), point));
        if (distance < least) {
            least = distance;
            best = f;
        }
    }
    return best;
}

ToolOptions bench_capsule(double length, double radius)
{
    return (ToolOptions){CAPSULE(length, radius, 3.3)};
}

ToolOptions bench_ball(double radius)
{
    return bench_capsule(0.0, radius);
}

ToolOptions bench_table(Vec3 point, Vec3 normal)
{
    return (ToolOptions){
        .id = 9, .kind = TOOL_STATIC, .has_plane = true, .plane = {point, vec3_unit(normal)}};
}

// ---------------------------------------------------------------------------------------------
// Scenes

void bench_create(Bench *bench, const BenchOptions *options)
{
    memset(bench, 0, sizeof *bench);
    bench->mesh = options->mesh;
#ifdef __SSE2__
    _mm_setcsr(_mm_getcsr() | 0x8040); // flush to zero, denormals are zero
#endif
    bool frozen = options->fixing == BENCH_FROZEN; // nothing moves: one substep will do
    double top = frozen ? 1.0 : SEAT;
    double time_step = frozen ? 1.0 / options->rate_hz : options->time_step;
    FixedRegion seat = {.kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, top}};
    SurfaceOptions surface = {
        .body.name = "body",
        .material = {.youngs_modulus_2d = options->youngs_modulus_2d,
                     .areal_density = 4.2,
                     .damping_time = 2e-4},
        .shape = {.wanted = options->shape_frequency > 0.0,
                  .angular_frequency = options->shape_frequency,
                  .damping_ratio = options->shape_damping,
                  .frame = options->body_frame ? SHAPE_BODY : SHAPE_WORLD},
        .body.integrator = options->integrator,
        .implicit.theta = options->theta,
        .body.time_step = time_step,
        .body.unsafe_time_step = time_step > 0.0,
        .body.fixed_count = options->fixing == BENCH_FREE ? 0 : 1,
        .body.fixed = &seat,
        .body.initial_position = options->initial_position,
        .body.gravity = options->gravity,
        .body.contact_ratio = options->contact_ratio,
        .body.contact_damping = options->contact_damping,
        .body.friction = options->friction,
        .body.estimate_error = options->error_hz > 0.0,
    };
    SimOptions sim = {.rate_hz = options->rate_hz,
                      .gravity = options->gravity,
                      .tool_timeout_s = options->tool_timeout_s,
                      .contact_stiffness = options->contact_stiffness,
                      .error_hz = options->error_hz};
    Status status = {0};
    Body body;
    bench->sim = sim_create(&sim, &bench->arena, &bench->state);
    need(surface_create(&body, &bench->mesh, &surface, &bench->arena, &bench->state, &status),
         &status);
    bench->body = sim_add_body(bench->sim, &body);
    if (options->has_twin) {
        mesh_place(&bench->mesh, 1.0, vec3(0, 0, 0), options->twin_at);
        surface.body.name = "twin";
        need(surface_create(&body, &bench->mesh, &surface, &bench->arena, &bench->state, &status),
             &status);
        sim_add_body(bench->sim, &body);
        mesh_place(&bench->mesh, 1.0, vec3(0, 0, 0), vec3_scale(-1.0, options->twin_at));
    }
    for (int t = 0; t < options->tool_count; t++)
        sim_add_tool(bench->sim, &options->tool[t]);
    need(sim_seal(bench->sim, 0.0, &status), &status);
    sim_set_lockstep(bench->sim, true); // a held tool does not become stale
    bench->x = zeroed((size_t)bench->mesh.node_count, sizeof *bench->x);
    bench->v = zeroed((size_t)bench->mesh.node_count, sizeof *bench->v);
    bench_read(bench);
}

void bench_destroy(Bench *bench)
{
    mesh_destroy(&bench->mesh);
    state_destroy(&bench->state);
    arena_destroy(&bench->arena);
    free(bench->x);
    free(bench->v);
}

void bench_place(Bench *bench, int tool, Vec3 position, Quat orientation)
{
    ToolPose pose = {.position = position, .orientation = orientation, .active = true};
    sim_apply_pose(bench->sim, tool, &pose, true);
}

void bench_move(Bench *bench, int tool, Vec3 position)
{
    bench_place(bench, tool, position, (Quat){1.0, 0.0, 0.0, 0.0});
}

void bench_withdraw(Bench *bench, int tool)
{
    withdraw_tool(bench->sim, tool);
}

void bench_run(Bench *bench, double seconds)
{
    long ticks = lround(seconds / sim_tick(bench->sim));
    for (long i = 0; i < ticks; i++)
        sim_step(bench->sim);
}

Vec3 bench_touch(Bench *bench, int tool, Vec3 position)
{
    bench_move(bench, tool, position);
    sim_step(bench->sim);
    return sim_wrench(bench->sim, tool)->force;
}

void bench_travel(Bench *bench, int tool, Vec3 from, Vec3 to, double speed)
{
    double length = vec3_length(vec3_sub(to, from)), step = speed * sim_tick(bench->sim);
    for (double way = step; way < length; way += step)
        bench_touch(bench, tool, vec3_madd(from, way / length, vec3_sub(to, from)));
    bench_touch(bench, tool, to);
}

// ---------------------------------------------------------------------------------------------
// What came of it

void bench_read(Bench *bench)
{
    bench->body->ops->read_state(bench->body->model, NULL, bench->x, bench->v);
}

Momentum bench_momentum(Bench *bench)
{
    bench_read(bench);
    return momentum_of(bench->mesh.node_count, bench->body->surface.node_mass, bench->x, bench->v);
}
