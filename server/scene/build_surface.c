// SPDX-License-Identifier: MIT
// Makes the meshes of bodies, from generators and files, with their levels, and surface bodies of
// them. Called once per body, at load time.
#include "scene/build_parts.h"

#include "base/check.h"
#include "base/log.h"
#include "geometry/generator.h"
#include "io/checkpoint.h"
#include "io/mesh_import.h"

#include <stdlib.h>

// --- meshes --------------------------------------------------------------------------------------

bool body_mesh_check_extent(const char *file, double scale, const TriMesh *mesh, Status *status)
{
    double extent = mesh_extent(mesh);
    if (mesh_extent_fits(extent))
        return true;
    return status_fail(status, STATUS_INVALID,
                       "%s: measures %g m after scale %g, outside [%g, %g] m; scale is metres a "
                       "unit of the file, 0.001 for millimetres",
                       file, extent, scale, MESH_SMALLEST_EXTENT, MESH_LARGEST_EXTENT);
}

bool body_mesh_import(const char *file, double scale, Vec3 rotation, Vec3 translation,
                      TriMesh *mesh, Status *status)
{
    MeshImport import;
    char repairs[512];
    if (!mesh_import(file, mesh, &import, status))
        return false;
    // Repairs are no errors, but the user should know.
    mesh_repairs_text(&import.repairs, repairs, sizeof repairs);
    if (repairs[0] != '\0')
        log_line(LOG_INFO, "%s: %s", file, repairs);
    if (import.remarks[0] != '\0')
        log_line(LOG_WARNING, "%s: %s", file, import.remarks);
    mesh_place(mesh, scale, rotation, translation);
    return body_mesh_check_extent(file, scale, mesh, status);
}

static bool generate_mesh(const MeshSource *source, TriMesh *mesh, Status *status)
{
    switch (source->kind) {
    case MESH_FILE:
        break;
    case MESH_SPHERE:
        return generate_sphere(mesh, source->nodes, source->radius, status);
    case MESH_UV_SPHERE:
        return generate_uv_sphere(mesh, source->rings, source->segments, source->radius, status);
    case MESH_ICO_SPHERE: {
        // Each subdivision makes nearly four times as many nodes.
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
    return status_fail(status, STATUS_INVALID, "unknown generator of a mesh");
}

static bool place_mesh(const MeshSource *source, TriMesh *mesh, Status *status)
{
    // A file says what its mesh is like; a generated one gets its texture here.
    if (source->kind == MESH_FILE) {
        if (!body_mesh_import(source->file, source->scale, source->rotation, source->translation,
                              mesh, status))
            return false;
    } else {
        if (!generate_mesh(source, mesh, status))
            return false;
        generate_texture(mesh, source->kind != MESH_SHEET);
        mesh_place(mesh, source->scale, source->rotation, source->translation);
        if (!body_mesh_check_extent("mesh", source->scale, mesh, status))
            return false;
    }
    // In either case only what can be simulated.
    MeshFault fault;
    if (mesh_check(mesh, &fault))
        return true;
    return status_fail(status, STATUS_INVALID, "%s: %s",
                       source->kind == MESH_FILE ? source->file : "mesh", fault.text);
}

bool body_mesh_make(const SceneBody *body, TriMesh *mesh, Levels *levels, Arena *arena,
                    Status *status)
{
    int finest = body->options.levels;
    return memory_check_surface(body, memory_source_nodes(&body->mesh), status) &&
           place_mesh(&body->mesh, mesh, status) &&
           memory_check_surface(body, mesh->node_count, status) &&
           (finest == 0 || levels_create(levels, mesh, finest, body->name, arena, status));
}

bool body_skin_make(const SceneBody *body, TriMesh *mesh, Status *status)
{
    return place_mesh(&body->skin, mesh, status);
}

// --- surface bodies ------------------------------------------------------------------------------

#ifdef PLIANT_WITH_SURFACE
// Spreads rows of the mesh to rows of one of its levels: a midpoint is displaced from its rest
// position by the mean of its parents.
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
    const Levels *levels = surface->hierarchy;
    const Level *start = levels != NULL ? &levels->level[surface->start_level] : NULL;
    int nodes = start != NULL ? start->node_count : mesh->node_count;
    int faces = start != NULL ? start->face_count : mesh->triangle_count;
    // The scene's own capacities must hold what the body starts with.
    const char *key = NULL;
    int have = 0, room = 0;
    if (surface->body.node_capacity > 0 && nodes > surface->body.node_capacity)
        key = "nodes", have = nodes, room = surface->body.node_capacity;
    else if (surface->body.face_capacity > 0 && faces > surface->body.face_capacity)
        key = "faces", have = faces, room = surface->body.face_capacity;
    return key == NULL ||
           status_fail(
               status, STATUS_INVALID,
               "body %s has %d %s to start with, capacity.%s is %d: raise it, or leave it out",
               surface->body.name, have, key, key, room);
}

// Returns the initial rows of the mesh that the body is made from, owned by the caller; NULL if it
// starts at rest.
static bool read_initial(const SceneBody *described, const TriMesh *mesh, const Levels *levels,
                         Vec3 **position, Vec3 **velocity, Status *status)
{
    *position = *velocity = NULL;
    if (described->initial == NULL)
        return true;
    if (!initial_read(described->initial, mesh, position, velocity, status))
        return false;
    if (levels != NULL && !surface_changes(&described->surface)) {
        *position = spread_position(levels, described->surface.start_level, *position);
        *velocity = spread_velocity(levels, described->surface.start_level, *velocity);
    }
    return true;
}

// Makes a body from the mesh of level 0, which becomes that of its level if the level is fixed.
static bool create_surface(World *world, SurfaceOptions *surface, TriMesh *mesh, Texture texture,
                           const BodyLook *look, Status *status)
{
    // A body with a fixed level is made of that level's mesh alone.
    if (surface->hierarchy != NULL && !surface_changes(surface)) {
        TriMesh coarse = *mesh;
        levels_mesh(surface->hierarchy, surface->start_level, &coarse, mesh);
        mesh_destroy(&coarse);
    }
    Body body = {0};
    if (!check_capacity(surface, mesh, status) ||
        !surface_create(&body, mesh, surface, &world->arena, &world->state, status))
        return false;
    body.texture = texture.uv;
    body.texture_count = texture.count;
    body.look = look;
    sim_add_body(world->sim, &body);
    return true;
}

bool build_surface(World *world, const Scene *scene, int index, const Prepared *prepared,
                   const BuildOptions *options, Status *status)
{
    const SceneBody *described = &scene->body[index];
    TriMesh *mesh = &world->mesh[index];
    const BodyLook *look = NULL;
    Vec3 *position = NULL, *velocity = NULL;
    SurfaceOptions surface = described->surface;
    Arena arena = {0}; // a body with a fixed level needs the hierarchy only while it is built
    Arena *keeper = surface_changes(&surface) ? &world->arena : &arena;
    Levels levels;
    // The mesh with its levels, prepared or made from scratch.
    bool ok = prepared != NULL ? prepared_read(prepared, described, mesh, &levels, keeper, status)
                               : body_mesh_make(described, mesh, &levels, keeper, status);
    ok = ok && memory_check_surface(described, mesh->node_count, status);
    // A cuttable mesh without levels needs a hierarchy of one level.
    if (ok && surface.body.levels == 0 && surface.body.cuttable)
        ok = levels_create(&levels, mesh, 0, described->name, keeper, status);
    if (ok && (surface.body.levels > 0 || surface.body.cuttable))
        surface.hierarchy = &levels;
    // Where it starts, and what only the whole scene knows.
    ok = ok && read_initial(described, mesh, surface.hierarchy, &position, &velocity, status);
    build_complete(&surface.body, world, scene, options);
    surface.body.name = described->name;
    surface.heats = scene_heats(scene);
    surface.body.initial_position = position;
    surface.body.initial_velocity = velocity;
    ok = ok && build_look(world, described, NULL, false, &look, status);
    if (ok) {
        Texture texture =
            build_texture(world, scene, options, described->name, mesh, surface.hierarchy);
        ok = create_surface(world, &surface, mesh, texture, look, status);
    }
    free(position);
    free(velocity);
    arena_destroy(&arena);
    return ok;
}

#else
bool build_surface(World *world, const Scene *scene, int index, const Prepared *prepared,
                   const BuildOptions *options, Status *status)
{
    (void)world, (void)scene, (void)index, (void)prepared, (void)options;
    return status_fail(status, STATUS_INVALID,
                       "this pliantd was built without surface bodies (PLIANT_SURFACE)");
}
#endif
