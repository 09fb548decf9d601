// Builds the world of a scene: meshes, initial states, bodies, tools, loads. Called once, at load,
// by the thread that starts the daemon; every pass over a mesh is linear in its size.
#include "files/build.h"

#include "base/check.h"
#include "base/log.h"
#include "files/checkpoint.h"
#include "files/mesh_import.h"
#include "geometry/generator.h"

#include <stdlib.h>

// Puts the place in the scene file in front of what a lower room has said.
static bool fail_at(const Scene *scene, const SceneBody *body, const Status *said, Status *status)
{
    return status_fail(status, said->code, "%s:%d: %s", scene->path, body->line, said->text);
}

// Imports a mesh and logs what had to be repaired.
static bool import_mesh(const char *path, TriMesh *mesh, Status *status)
{
    MeshImport import;
    char repairs[512];
    if (!mesh_import(path, mesh, &import, status))
        return false;
    mesh_repairs_text(&import.repairs, repairs, sizeof repairs);
    if (repairs[0] != '\0')
        log_line(LOG_INFO, "%s: %s", path, repairs);
    return true;
}

// What is not of the size of an organ, by orders of magnitude, was given in other units.
static bool check_extent(const MeshSource *source, const TriMesh *mesh, Status *status)
{
    double extent = mesh_extent(mesh);
    if (extent >= MESH_SMALLEST_EXTENT && extent <= MESH_LARGEST_EXTENT)
        return true;
    return status_fail(status, STATUS_INVALID,
                       "%s: measures %g m after scale %g, outside [%g, %g] m; scale is metres a "
                       "unit of the file, 0.001 for millimetres",
                       source->file, extent, source->scale, MESH_SMALLEST_EXTENT,
                       MESH_LARGEST_EXTENT);
}

static bool make_mesh(const MeshSource *source, TriMesh *mesh, Status *status)
{
    switch (source->kind) {
    case MESH_FILE:
        return import_mesh(source->file, mesh, status);
    case MESH_SPHERE:
        return generate_sphere(mesh, source->nodes, source->radius, status);
    case MESH_UV_SPHERE:
        return generate_uv_sphere(mesh, source->rings, source->segments, source->radius, status);
    case MESH_ICO_SPHERE: {
        int subdivisions = 0;
        for (int nodes = 12; nodes < source->nodes; nodes = 4 * nodes - 6)
            subdivisions++;
        return generate_ico_sphere(mesh, subdivisions, source->radius, status);
    }
    case MESH_SHEET:
        return generate_sheet(mesh, source->columns, source->rows, source->width, source->height,
                              status);
    case MESH_STOMACH:
        return generate_stomach(mesh, source->nodes, source->length, status);
    }
    return status_fail(status, STATUS_INVALID, "unknown source of a mesh");
}

// The mesh of a body where it stands in the world, fit for simulation.
static bool build_mesh(const SceneBody *body, TriMesh *mesh, Status *status)
{
    const MeshSource *source = &body->mesh;
    if (!make_mesh(source, mesh, status))
        return false;
    mesh_place(mesh, source->scale, source->rotation, source->translation);
    if (source->kind == MESH_FILE && !check_extent(source, mesh, status))
        return false;
    MeshFault fault;
    if (mesh_validate(mesh, &fault))
        return true;
    return status_fail(status, STATUS_INVALID, "%s: %s",
                       source->kind == MESH_FILE ? source->file : "mesh", fault.text);
}

#ifdef PLIANT_WITH_SURFACE
static bool create_body(World *world, const Scene *scene, int index, const BuildOptions *options,
                        Status *status)
{
    const SceneBody *described = &scene->body[index];
    TriMesh *mesh = &world->mesh[index];
    if (!build_mesh(described, mesh, status))
        return false;

    Vec3 *position = NULL, *velocity = NULL;
    if (described->initial != NULL &&
        !initial_read(described->initial, mesh, &position, &velocity, status))
        return false;
    SurfaceOptions surface = described->surface;
    surface.name = described->name;
    surface.fixed = described->fixed;
    surface.fixed_count = described->fixed_count;
    surface.gravity = scene->gravity;
    surface.precision = scene->precision;
    surface.isa = options->isa != NULL ? options->isa : "auto";
    surface.team = world->team;
    surface.without_contacts = scene->tool_count == 0;
    surface.without_loads = scene->load_count == 0 && !options->may_load;
    surface.initial_position = position;
    surface.initial_velocity = velocity;

    Body body = {0};
    bool ok = surface_create(&body, mesh, &surface, &world->arena, &world->state, status);
    free(position);
    free(velocity);
    if (ok)
        sim_add_body(world->sim, &body);
    return ok;
}

const char *const *build_isa_levels(void)
{
    return surface_isa_levels();
}
#else
static bool create_body(World *world, const Scene *scene, int index, const BuildOptions *options,
                        Status *status)
{
    (void)options;
    return build_mesh(&scene->body[index], &world->mesh[index], status) &&
           status_fail(status, STATUS_INVALID,
                       "this pliantd was built without surface bodies (PLIANT_SURFACE)");
}

const char *const *build_isa_levels(void)
{
    static const char *const none[] = {NULL};
    return none;
}
#endif

bool world_build(World *world, const Scene *scene, const BuildOptions *options, Status *status)
{
    *world = (World){0};
    world->mesh_count = scene->body_count;
    world->mesh = calloc((size_t)scene->body_count, sizeof *world->mesh);
    ASSERT(world->mesh != NULL);
    if (scene->threads > 1) {
        world->team = team_create(scene->threads);
        ASSERT(world->team != NULL);
    }
    SimOptions sim = {.rate_hz = scene->rate_hz,
                      .gravity = scene->gravity,
                      .tool_timeout_s = scene->tool_timeout_s,
                      .may_load = options->may_load};
    world->sim = sim_create(&sim, &world->arena, &world->state);

    bool ok = true;
    for (int i = 0; i < scene->body_count && ok; i++) {
        Status said = {0};
        ok = create_body(world, scene, i, options, &said) ||
             fail_at(scene, &scene->body[i], &said, status);
    }
    for (int i = 0; i < scene->tool_count && ok; i++)
        sim_add_tool(world->sim, &scene->tool[i]);
    for (int i = 0; i < scene->load_count && ok; i++)
        sim_add_load(world->sim, &scene->load[i].load);
    if (ok) {
        Status said = {0};
        ok = sim_seal(world->sim, scene->settle_s, &said) ||
             status_fail(status, said.code, "%s: %s", scene->path, said.text);
    }
    if (!ok)
        world_destroy(world);
    return ok;
}

void world_destroy(World *world)
{
    team_destroy(world->team);
    for (int i = 0; i < world->mesh_count; i++)
        mesh_destroy(&world->mesh[i]);
    free(world->mesh);
    state_destroy(&world->state);
    arena_destroy(&world->arena);
    *world = (World){0};
}
