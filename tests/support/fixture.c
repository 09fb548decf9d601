// SPDX-License-Identifier: MIT
#include "fixture.h"

#include "base/check.h"
#include "geometry/generator.h"
#include "random.h"
#include "surface_state.h"
#include "expect.h"

SurfaceMaterial fixture_material(double damping_time)
{
    return (SurfaceMaterial){
        .youngs_modulus_2d = 80.0, .areal_density = 4.2, .damping_time = damping_time};
}

SurfaceShape fixture_shape(ShapeFrame frame)
{
    return (SurfaceShape){
        .wanted = true, .angular_frequency = 50.0, .damping_ratio = 0.1, .frame = frame};
}

// Makes the body and puts the mesh of its level in place of that of level 0.
static bool create_body(Fixture *fixture, SurfaceOptions *surface, Body *body, Status *status)
{
    Arena arena = {0};
    Levels levels;
    if (surface->body.levels > 0) {
        TriMesh coarse = fixture->mesh;
        if (!levels_create(&levels, &coarse, surface->body.levels, "body", &arena, status))
            return false;
        levels_mesh(&levels, surface->start_level, &coarse, &fixture->mesh);
        mesh_destroy(&coarse);
        surface->hierarchy = &levels;
    }
    bool ok =
        surface_create(body, &fixture->mesh, surface, &fixture->arena, &fixture->state, status);
    arena_destroy(&arena);
    size_t nodes = (size_t)fixture->mesh.node_count;
    fixture->x = calloc(nodes, sizeof *fixture->x);
    fixture->v = calloc(nodes, sizeof *fixture->v);
    return ok;
}

bool fixture_try(Fixture *fixture, TriMesh *mesh, const FixtureOptions *options, Status *status)
{
    *fixture = (Fixture){.mesh = *mesh};
    *mesh = (TriMesh){0};
    SurfaceOptions surface = {
        .body.name = "body",
        .material = options->material,
        .shape = options->shape,
        .cavity = options->cavity,
        .prestress = options->prestress,
        .body.levels = options->levels,
        .start_level = options->start_level,
        .adjust = options->adjust,
        .body.integrator = options->integrator,
        .implicit = options->implicit,
        .automatic = options->automatic,
        .tick = options->rate_hz > 0.0 ? 1.0 / options->rate_hz : 1e-3,
        .body.precision = options->precision,
        .body.time_step = options->time_step,
        .body.unsafe_time_step = options->unsafe_time_step,
        .body.fixed_count = options->fixed_count,
        .body.fixed = options->fixed,
        .body.initial_position = options->initial_position,
        .body.initial_velocity = options->initial_velocity,
        .body.gravity = options->gravity,
        .body.contact_ratio = 1.0,
        .body.isa = options->isa,
        .body.team = options->team,
    };
    SimOptions sim = {
        .rate_hz = options->rate_hz > 0.0 ? options->rate_hz : 1000.0,
        .gravity = options->gravity,
        .tool_timeout_s = 0.2,
        .may_load = options->may_load,
    };
    Body body;
    if (!create_body(fixture, &surface, &body, status))
        return false;
    fixture->sim = sim_create(&sim, &fixture->arena, &fixture->state);
    fixture->body = sim_add_body(fixture->sim, &body);
    for (int t = 0; t < options->tool_count; t++)
        sim_add_tool(fixture->sim, &options->tool[t]);
    for (int k = 0; k < options->load_count; k++)
        sim_add_load(fixture->sim, &options->load[k]);
    return sim_seal(fixture->sim, options->settle_s, status);
}

void fixture_create(Fixture *fixture, TriMesh *mesh, const FixtureOptions *options)
{
    Status status = {0};
    if (!fixture_try(fixture, mesh, options, &status)) {
        fprintf(stderr, "fixture: %s\n", status.text);
        ASSERT(status.code == STATUS_OK);
    }
}

void fixture_destroy(Fixture *fixture)
{
    mesh_destroy(&fixture->mesh);
    state_destroy(&fixture->state);
    arena_destroy(&fixture->arena);
    free(fixture->x);
    free(fixture->v);
}

void fixture_read(Fixture *fixture)
{
    surface_read_state(fixture->body, fixture->x, fixture->v);
}

void fixture_run(Fixture *fixture, int ticks)
{
    for (int i = 0; i < ticks; i++)
        sim_step(fixture->sim);
    fixture_read(fixture);
}

SurfaceModel *fixture_model(const Fixture *fixture)
{
    return fixture->body->model;
}

void fixture_write(Fixture *fixture, const Vec3 *x, const Vec3 *v)
{
    SurfaceModel *model = fixture_model(fixture);
    for (int i = 0; i < fixture->mesh.node_count; i++)
        rows_write(&model->basis, model->rows[model->current], model->slot[i], x[i], v[i]);
}

void fixture_forces(TriMesh *mesh, const FixtureOptions *like, const Vec3 *x, Vec3 *force)
{
    FixtureOptions options = *like;
    options.integrator = INTEGRATOR_SYMPLECTIC_EULER;
    options.rate_hz = 1e9;
    options.initial_position = x;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create(&fixture, mesh, &options);
    fixture_run(&fixture, 1);
    for (int i = 0; i < fixture.mesh.node_count; i++)
        force[i] =
            vec3_scale(fixture.body->surface.node_mass[i] / sim_tick(fixture.sim), fixture.v[i]);
}

const LoadOptions fixture_everywhere = {
    .body = 0, .radius = 1.0, .force = {0.3, -0.2, 0.1}, .duration = 0.01};

FixtureOptions fixture_loadable(void)
{
    return (FixtureOptions){.material = fixture_material(2e-4),
                            .shape = fixture_shape(SHAPE_WORLD),
                            .integrator = INTEGRATOR_SYMPLECTIC_EULER,
                            .may_load = true};
}

FixtureOptions fixture_hinged(double modulus)
{
    FixtureOptions options = {.material = fixture_material(0.0), .integrator = INTEGRATOR_LEAPFROG};
    options.material.youngs_modulus_2d = modulus;
    options.material.bending_stiffness = 1e-4;
    return options;
}

void fixture_create_on(Fixture *fixture, void (*make)(TriMesh *), const FixtureOptions *options)
{
    TriMesh mesh;
    make(&mesh);
    fixture_create(fixture, &mesh, options);
}

void fixture_create_sphere(Fixture *fixture, const FixtureOptions *options)
{
    fixture_create_on(fixture, fixture_sphere, options);
}

void fixture_expect_refusal(const FixtureOptions *options, const char *says)
{
    TriMesh mesh;
    Status status = {0};
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_sphere(&mesh);
    assert_false(fixture_try(&fixture, &mesh, options, &status));
    assert_int_equal(status.code, STATUS_INVALID);
    if (strstr(status.text, says) == NULL)
        fail_msg("'%s' is not in: %s", says, status.text);
}

Momentum fixture_momentum(const Fixture *fixture)
{
    return momentum_of(fixture->mesh.node_count, fixture->body->surface.node_mass, fixture->x,
                       fixture->v);
}

bool fixture_is_finite(const Fixture *fixture)
{
    for (int i = 0; i < fixture->mesh.node_count; i++)
        if (!vec3_finite(fixture->x[i]) || !vec3_finite(fixture->v[i]))
            return false;
    return true;
}

static void copy_vec3(Vec3 from, double to[3])
{
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

static bool is_inside(const FixedRegion *region, Vec3 x, int node)
{
    switch (region->kind) {
    case FIXED_BOX:
        return fabs(x.x - 0.5 * (region->low.x + region->high.x)) <=
                   0.5 * (region->high.x - region->low.x) &&
               fabs(x.y - 0.5 * (region->low.y + region->high.y)) <=
                   0.5 * (region->high.y - region->low.y) &&
               fabs(x.z - 0.5 * (region->low.z + region->high.z)) <=
                   0.5 * (region->high.z - region->low.z);
    case FIXED_SPHERE:
        return vec3_length(vec3_sub(x, region->center)) <= region->radius;
    default:
        for (int k = 0; k < region->node_count; k++)
            if (region->node[k] == node)
                return true;
        return false;
    }
}

void fixture_reference(const Fixture *fixture, const FixtureOptions *options, Reference *reference)
{
    const TriMesh *mesh = &fixture->mesh;
    const SurfaceMaterial *material = &options->material;
    const SurfaceShape *shape = &options->shape;
    ReferenceOptions twin = {
        .uniform = material->uniform,
        .youngs_modulus_2d = material->youngs_modulus_2d,
        .areal_density = material->areal_density,
        .damping_time = material->damping_time,
        .spring_stiffness = material->spring_stiffness,
        .spring_damping = material->spring_damping,
        .node_mass = material->node_mass,
        .node_damping = material->node_damping,
        .shape = !shape->wanted                ? REFERENCE_NO_SHAPE
                 : shape->frame == SHAPE_WORLD ? REFERENCE_WORLD
                                               : REFERENCE_BODY,
        .radial = shape->wanted && shape->direction == SHAPE_DAMPS_RADIAL,
        .angular_frequency = shape->angular_frequency,
        .damping_ratio = shape->damping_ratio,
        .per_node = shape->per_node,
        .shape_stiffness = shape->stiffness,
        .shape_damping = shape->damping,
        .prestress = options->prestress,
    };
    copy_vec3(options->gravity, twin.gravity);
    int n = mesh->node_count;
    double(*position)[3] = calloc((size_t)n, sizeof *position);
    for (int i = 0; i < n; i++)
        copy_vec3(mesh->position[i], position[i]);
    reference_create(reference, n, (const double(*)[3])position, mesh->triangle_count,
                     (const int(*)[3])mesh->triangle, &twin);
    free(position);
    for (int i = 0; i < n; i++) {
        for (int r = 0; r < options->fixed_count; r++)
            reference->fixed[i] |= is_inside(&options->fixed[r], mesh->position[i], i);
        if (options->initial_position != NULL)
            copy_vec3(options->initial_position[i], reference->x[i]);
        if (options->initial_velocity != NULL && !reference->fixed[i])
            copy_vec3(options->initial_velocity[i], reference->v[i]);
    }
}

ReferenceScheme fixture_scheme(IntegratorKind kind)
{
    return kind == INTEGRATOR_RK4        ? REFERENCE_RK4
           : kind == INTEGRATOR_LEAPFROG ? REFERENCE_LEAPFROG
                                         : REFERENCE_SYMPLECTIC_EULER;
}

void fixture_organ(TriMesh *mesh)
{
    static TriMesh organ; // made once: it takes longer than most tests
    if (organ.node_count == 0)
        ASSERT(generate_stomach(&organ, 188, 0.2, &(Status){0}));
    mesh_create(mesh, organ.node_count, organ.triangle_count);
    memcpy(mesh->position, organ.position, (size_t)organ.node_count * sizeof *organ.position);
    memcpy(mesh->triangle, organ.triangle, (size_t)organ.triangle_count * sizeof *organ.triangle);
}

void fixture_sphere(TriMesh *mesh)
{
    ASSERT(generate_sphere(mesh, 114, 0.05, &(Status){0}));
}

void fixture_sheet(TriMesh *mesh)
{
    ASSERT(generate_sheet(mesh, 7, 9, 0.12, 0.16, &(Status){0}));
    uint64_t random = 11;
    // Up to a sixth of the grid's 0.02 m: no triangle turns over.
    for (int i = 0; i < mesh->node_count; i++) {
        Vec3 *x = &mesh->position[i];
        Vec3 shift = vec3_scale(0.0033, random_vec3(&random));
        if (fabs(x->x) < 0.0599 && fabs(x->y) < 0.0799)
            *x = vec3_add(*x, shift);
    }
}
