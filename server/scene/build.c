// Builds the world of a scene: bodies of both models, tools, loads. Called once, at load time, by
// the thread that starts the daemon; every pass over a mesh is linear in its size.
#include "scene/build_parts.h"

#include "base/check.h"
#include "scene/build.h"

#include <stdlib.h>

// Prefixes the location in the scene file to the error of a lower layer.
static bool fail_at(const Scene *scene, const SceneBody *body, const Status *said, Status *status)
{
    return status_fail(status, said->code, "%s:%d: %s", scene->path, body->line, said->text);
}

void build_complete(BodyOptions *body, const World *world, const Scene *scene,
                    const BuildOptions *options)
{
    body->gravity = scene->gravity;
    body->precision = scene->precision;
    body->isa = options->isa != NULL ? options->isa : "auto";
    body->team = world->team;
    body->without_contacts = scene->tool_count == 0 && scene->attachment_count == 0;
    body->without_loads = scene->load_count == 0 && !options->may_load;
}

bool world_build(World *world, const Scene *scene, const BuildOptions *options, Status *status)
{
    *world = (World){.scene_path = scene->path, .scene_text = scene->text};
    world->mesh_count = scene->body_count;
    world->mesh = calloc((size_t)scene->body_count, sizeof *world->mesh);
    world->cells = calloc((size_t)scene->body_count, sizeof *world->cells);
    ASSERT(world->mesh != NULL && world->cells != NULL);
    if (scene->threads > 1) {
        world->team = team_create(scene->threads);
        ASSERT(world->team != NULL);
    }
    // Options of the sim follow from the scene; without a listener the costly extras are disabled.
    SimOptions sim = {.rate_hz = scene->rate_hz,
                      .gravity = scene->gravity,
                      .tool_timeout_s = scene->tool_timeout_s,
                      .may_load = options->may_load,
                      .estimate_error = options->publishes && scene->estimate_error,
                      .contact_stiffness = options->publishes && scene->publish.contact_hz > 0.0 &&
                                           scene->publish.contact_stiffness,
                      .counts = {scene->body_count, scene->tool_count, scene->load_count,
                                 scene->attachment_count}};
    world->sim = sim_create(&sim, &world->arena, &world->state);

    // Bodies first: loads and attachments refer to them.
    const char *path = options->prepared != NULL ? options->prepared : scene->prepared;
    Prepared *prepared = NULL;
    bool ok = path == NULL || prepared_open(&prepared, path, status);
    for (int i = 0; i < scene->body_count && ok; i++) {
        Status said = {0};
        bool voxel = scene->body[i].model == MODEL_VOXEL;
        ok = (voxel ? build_voxel : build_surface)(world, scene, i, prepared, options, &said) ||
             fail_at(scene, &scene->body[i], &said, status);
    }
    prepared_close(prepared);
    for (int i = 0; i < scene->tool_count && ok; i++)
        sim_add_tool(world->sim, &scene->tool[i]);
    for (int i = 0; i < scene->load_count && ok; i++)
        sim_add_load(world->sim, &scene->load[i].load);
    for (int i = 0; i < scene->attachment_count && ok; i++) {
        const SceneAttachment *attachment = &scene->attachment[i];
        Status said = {0};
        ok = sim_add_attachment(world->sim, &attachment->options, &said) ||
             status_fail(status, said.code, "%s:%d: attachments: %s", scene->path, attachment->line,
                         said.text);
    }
    // Seal checks the complete scene and lets the bodies settle.
    if (ok) {
        Status said = {0};
        ok = sim_seal(world->sim, scene->settle_s, &said) ||
             status_fail(status, said.code, "%s: %s", scene->path, said.text);
    }
    if (ok)
        world->physics = physics_hash(scene, world);
    else
        world_destroy(world);
    return ok;
}

// --- texture coordinates -------------------------------------------------------------------------

// Texture coordinates of a body's published mesh, for scenes with publish.rest. Load time only.

// Returns the published id of node i of the mesh or its levels.
static int id_of(const TriMesh *mesh, int i)
{
    if (i < mesh->node_count)
        return mesh->file_index[i];
    return mesh->file_node_count + mesh->copy_count + i - mesh->node_count;
}

Texture build_texture(World *world, const Scene *scene, const BuildOptions *options,
                      const char *name, TriMesh *mesh, const Levels *levels)
{
    Texture texture = {0};
    if (mesh->uv != NULL && scene->publish.rest && options->publishes) {
        const int roots = mesh->node_count;
        const int nodes = levels != NULL ? levels->level[levels->finest].node_count : roots;
        texture.count = mesh->file_node_count + mesh->copy_count + nodes - roots;
        float(*uv)[2] = arena_allocate(&world->arena, ARENA_OUTPUT, (size_t)texture.count,
                                       sizeof *uv, "%s/texture", name);
        for (int i = 0; i < roots; i++)
            for (int c = 0; c < 2; c++)
                uv[id_of(mesh, i)][c] = (float)mesh->uv[i][c];
        for (int i = roots; i < nodes; i++) { // parents come before their children
            int parent[2];
            levels_parents(levels, i, parent);
            const float *a = uv[id_of(mesh, parent[0])], *b = uv[id_of(mesh, parent[1])];
            for (int c = 0; c < 2; c++)
                uv[id_of(mesh, i)][c] = 0.5F * (a[c] + b[c]);
        }
        texture.uv = (const float(*)[2])uv;
    }
    free(mesh->uv); // no other code uses them
    mesh->uv = NULL;
    return texture;
}
