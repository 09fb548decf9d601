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
// Rows of the mesh to rows of a level of it: midpoints lie beside their place at rest as their
// parents do, on average.
static Vec3 *spread_position(const Levels *levels, int level, Vec3 *position)
{
    int given = levels->level[0].node_count, nodes = levels->level[level].node_count;
    position = realloc(position, (size_t)nodes * sizeof *position);
    Vec3 *moved = malloc((size_t)nodes * sizeof *moved);
    ASSERT(position != NULL && moved != NULL);
    for (int i = 0; i < given; i++)
        moved[i] = vec3_sub(position[i], levels->position[i]);
    levels_spread(levels, level, moved);
    for (int i = given; i < nodes; i++)
        position[i] = vec3_add(levels->position[i], moved[i]);
    free(moved);
    return position;
}

static Vec3 *spread_velocity(const Levels *levels, int level, Vec3 *velocity)
{
    velocity = realloc(velocity, (size_t)levels->level[level].node_count * sizeof *velocity);
    ASSERT(velocity != NULL);
    levels_spread(levels, level, velocity);
    return velocity;
}

static bool check_capacity(const SurfaceOptions *surface, const TriMesh *mesh, Status *status)
{
    const char *key = NULL;
    int have = 0, room = 0;
    if (surface->node_capacity > 0 && mesh->node_count > surface->node_capacity)
        key = "nodes", have = mesh->node_count, room = surface->node_capacity;
    else if (surface->face_capacity > 0 && mesh->triangle_count > surface->face_capacity)
        key = "faces", have = mesh->triangle_count, room = surface->face_capacity;
    return key == NULL ||
           status_fail(status, STATUS_INVALID, "body %s has %d %s to start with, capacity.%s is %d",
                       surface->name, have, key, key, room);
}

// Makes the body of a mesh, which is that of level 0 and becomes that of start_level.
static bool create_surface(World *world, const SceneBody *described, SurfaceOptions *surface,
                           TriMesh *mesh, Status *status)
{
    Vec3 *position = NULL, *velocity = NULL;
    if (described->initial != NULL &&
        !initial_read(described->initial, mesh, &position, &velocity, status))
        return false;
    Levels levels;
    Arena arena = {0}; // a body that stays at its level needs the hierarchy no longer
    bool ok = true;
    if (surface->levels > 0) {
        Arena *keeper = surface->adaptive ? &world->arena : &arena;
        ok = levels_create(&levels, mesh, surface->levels, surface->name, keeper, status);
        surface->hierarchy = ok ? &levels : NULL;
    }
    if (surface->hierarchy != NULL && !surface->adaptive) {
        TriMesh coarse = *mesh;
        levels_mesh(&levels, surface->start_level, &coarse, mesh);
        mesh_destroy(&coarse);
        if (position != NULL) {
            position = spread_position(&levels, surface->start_level, position);
            velocity = spread_velocity(&levels, surface->start_level, velocity);
        }
    }
    surface->initial_position = position;
    surface->initial_velocity = velocity;
    Body body = {0};
    ok = ok && check_capacity(surface, mesh, status) &&
         surface_create(&body, mesh, surface, &world->arena, &world->state, status);
    if (ok)
        sim_add_body(world->sim, &body);
    free(position);
    free(velocity);
    arena_destroy(&arena);
    return ok;
}

static bool create_body(World *world, const Scene *scene, int index, const BuildOptions *options,
                        Status *status)
{
    const SceneBody *described = &scene->body[index];
    TriMesh *mesh = &world->mesh[index];
    SurfaceOptions surface = described->surface;
    surface.name = described->name;
    surface.fixed = described->fixed;
    surface.fixed_count = described->fixed_count;
    surface.gravity = scene->gravity;
    surface.precision = scene->precision;
    surface.isa = options->isa != NULL ? options->isa : "auto";
    surface.without_contacts = scene->tool_count == 0;
    surface.without_loads = scene->load_count == 0 && !options->may_load;
    return build_mesh(described, mesh, status) &&
           create_surface(world, described, &surface, mesh, status);
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
    for (int i = 0; i < world->mesh_count; i++)
        mesh_destroy(&world->mesh[i]);
    free(world->mesh);
    state_destroy(&world->state);
    arena_destroy(&world->arena);
    *world = (World){0};
}
