// SPDX-License-Identifier: MIT
// Builds the world of a scene: bodies of both models, tools, loads, and the hash of its physics.
// Called once, at load time, by the thread that starts the daemon; every pass over a mesh is linear
// in its size.
#include "scene/build_parts.h"

#include "base/check.h"
#include "base/fnv.h"
#include "scene/scene_parts.h"

#include <stdlib.h>
#include <string.h>

// Prefixes the location in the scene file to the error of a lower layer.
static bool fail_at(const Scene *scene, const SceneBody *body, const Status *said, Status *status)
{
    return status_fail(status, said->code, "%s:%d: %s", scene->path, body->line, said->text);
}

void build_complete(BodyOptions *body, const World *world, const Scene *scene,
                    const BuildOptions *options)
{
    body->gravity = scene->sim.gravity;
    body->precision = scene->precision;
    body->isa = options->isa != NULL ? options->isa : "auto";
    body->team = world->team;
    body->without_contacts = scene->tool_count == 0 && scene->attachment_count == 0 &&
                             scene->sim.max_ties == 0 && scene->touch_count == 0;
    body->estimate_error =
        (scene->publish.error_hz > 0.0 && options->publishes) || body->adapt_error > 0.0;
    body->without_loads = scene->load_count == 0 && !options->may_load;
    for (int t = 0; t < scene->tool_count; t++)
        body->removable |= scene->tool[t].kind == TOOL_REMOVER;
}

bool world_build(World *world, const Scene *scene, const BuildOptions *options, Status *status)
{
    *world = (World){.scene_path = scene->path, .scene_text = scene->text};
    // What every body leaves for the hash: its mesh, and a summary of its cells.
    world->mesh_count = scene->body_count;
    world->mesh = calloc((size_t)scene->body_count, sizeof *world->mesh);
    world->cells = calloc((size_t)scene->body_count, sizeof *world->cells);
    ASSERT(world->mesh != NULL && world->cells != NULL);
    // More threads share the step from the start, so that settling has them, too.
    if (scene->threads > 1) {
        world->team = team_create(scene->threads);
        ASSERT(world->team != NULL);
    }
    // What of the simulation follows; without a listener the costly extras are disabled.
    SimOptions sim = scene->sim;
    sim.may_load = options->may_load;
    sim.estimate_error &= options->publishes;
    sim.error_hz = options->publishes ? scene->publish.error_hz : 0.0;
    sim.contact_stiffness =
        options->publishes && scene->publish.contact_hz > 0.0 && scene->publish.contact_stiffness;
    sim.counts = (SimCounts){scene->body_count, scene->tool_count, scene->load_count,
                             scene->attachment_count, scene->touch_count};
    world->sim = sim_create(&sim, &world->arena, &world->state);

    // Bodies first: loads and attachments refer to them.
    const char *path = options->prepared != NULL ? options->prepared : scene->prepared;
    Prepared *prepared = NULL;
    bool ok = path == NULL || prepared_open(&prepared, path, status);
    for (int i = 0; i < scene->body_count && ok; i++) {
        Status said = {0};
        bool voxel = scene_has_cells(&scene->body[i]);
        ok = (voxel ? build_voxel : build_surface)(world, scene, i, prepared, options, &said) ||
             fail_at(scene, &scene->body[i], &said, status);
    }
    prepared_close(prepared);
    // What acts on the bodies.
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
    for (int i = 0; i < scene->touch_count && ok; i++) {
        Status said = {0};
        ok = sim_add_touch(world->sim, &scene->touch[i].options, &said) ||
             status_fail(status, said.code, "%s:%d: touch: %s", scene->path, scene->touch[i].line,
                         said.text);
    }
    // Seal checks the complete scene and lets the bodies settle.
    if (ok) {
        Status said = {0};
        ok = sim_seal(world->sim, scene->settle_s, &said) ||
             status_fail(status, said.code, "%s: %s", scene->path, said.text);
    }
    // The hash of what was built, by which checkpoints know their scene.
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
    // Only where somebody receives them.
    if (mesh->uv != NULL && scene->publish.rest && options->publishes) {
        const int roots = mesh->node_count;
        const int nodes = levels != NULL ? levels->level[levels->finest].node_count : roots;
        texture.count = mesh->file_node_count + mesh->copy_count + nodes - roots;
        float(*uv)[2] = arena_allocate(&world->arena, ARENA_OUTPUT, (size_t)texture.count,
                                       sizeof *uv, "%s/texture", name);
        // Nodes of the file have their own.
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

// --- the hash of the physics: the rows of the tables say which keys count ------------------------

static void add_text(uint64_t *hash, const char *text)
{
    *hash = fnv_bytes(*hash, text, strlen(text) + 1);
}

static void add_value(uint64_t *hash, OptionType type, const void *member)
{
    switch (type) {
    case OPTION_REAL:
        fnv_real(hash, *(const double *)member);
        break;
    case OPTION_INT:
    case OPTION_WORD:
        fnv_int(hash, *(const int *)member);
        break;
    case OPTION_BOOL:
        fnv_int(hash, *(const bool *)member);
        break;
    case OPTION_VECTOR:
        fnv_vector(hash, *(const Vec3 *)member);
        break;
    default:
        ASSERT(false); // no row of a text, group or list counts
    }
}

// Adds the keys of a group on which the motion depends. One that has its default is skipped: a key
// that a later version adds leaves the hashes of older scenes as they are.
static void add_keys(uint64_t *hash, const OptionTable *table, const void *group)
{
    const int *variant = (const int *)((const char *)group + table->variant);
    add_text(hash, table->path);
    for (int i = 0; i < table->count; i++) {
        const Option *option = &table->option[i];
        const void *member = (const char *)group + option->offset;
        if (!option->physics || (table->variant != 0 && !option_is_used(option, *variant)) ||
            option_is_default(option, member))
            continue;
        add_text(hash, option->key);
        add_value(hash, option->type, member);
    }
}

static void add_region(uint64_t *hash, const FixedRegion *region)
{
    fnv_int(hash, region->kind);
    fnv_vector(hash, region->low);
    fnv_vector(hash, region->high);
    fnv_vector(hash, region->center);
    fnv_real(hash, region->radius);
    fnv_int(hash, region->node_count);
    for (int i = 0; i < region->node_count; i++)
        fnv_int(hash, region->node[i]);
}

// True if faces or elements are created at run time, of which the scene may limit the number.
static bool grows(const SceneBody *body)
{
    return body->model == MODEL_SURFACE ? surface_changes(&body->surface)
                                        : body->options.cuttable || body->voxel.surface_level > 0;
}

static void add_groups(uint64_t *hash, const SceneBody *body)
{
    KeyGroup group[KEY_GROUPS];
    for (int g = 0, groups = scene_list_groups(body, group); g < groups; g++)
        if (!group[g].absent)
            add_keys(hash, group[g].table, group[g].keys);
}

static void add_surface(uint64_t *hash, const SurfaceOptions *surface, const TriMesh *mesh)
{
    fnv_int(hash, surface->automatic);
    fnv_int(hash, surface->shape.per_node);
    fnv_int(hash, mesh->node_count);
    fnv_int(hash, mesh->triangle_count);
    for (int i = 0; i < surface->material.branch_count; i++)
        add_keys(hash, &BRANCH_TABLE, &surface->material.branch[i]);
    *hash = fnv_bytes(*hash, mesh->position, (size_t)mesh->node_count * sizeof *mesh->position);
    *hash = fnv_bytes(*hash, mesh->triangle, (size_t)mesh->triangle_count * sizeof *mesh->triangle);
}

// `cells`: hash of the cells.
static void add_voxel(uint64_t *hash, const VoxelOptions *voxel, uint64_t cells)
{
    for (int i = 0; i < voxel->material_count; i++)
        add_keys(hash, &LABEL_MATERIAL_TABLE, &voxel->material[i]);
    for (int i = 0; i < voxel->branch_count; i++)
        add_keys(hash, &BRANCH_TABLE, &voxel->branch[i]);
    for (int i = 0; i < voxel->weight_count; i++) {
        add_region(hash, &voxel->weight[i].region);
        *hash = fnv_bytes(*hash, &voxel->weight[i].mass, sizeof voxel->weight[i].mass);
    }
    for (int i = 0; i < voxel->fine_count; i++)
        add_keys(hash, &FINE_TABLE, &voxel->fine[i]);
    *hash = fnv_bytes(*hash, &cells, sizeof cells);
}

static void add_body(uint64_t *hash, const SceneBody *body, const TriMesh *mesh, uint64_t cells)
{
    const BodyOptions *options = &body->options;
    // Who it is, and its keys,
    add_text(hash, body->name);
    add_text(hash, scene_model_name(body->model));
    add_groups(hash, body);
    // what bounds its growth, where it can grow,
    if (grows(body)) {
        fnv_int(hash, options->node_capacity);
        fnv_int(hash, options->face_capacity);
    }
    // what is fixed,
    fnv_int(hash, options->fixed_count);
    for (int i = 0; i < options->fixed_count; i++)
        add_region(hash, &options->fixed[i]);
    // and the mesh or cells that it was made of.
    if (scene_has_cells(body))
        add_voxel(hash, &body->voxel, cells);
    else
        add_surface(hash, &body->surface, mesh);
}

static void add_tool(uint64_t *hash, const ToolOptions *tool)
{
    add_keys(hash, &TOOL_TABLE, tool);
    fnv_int(hash, tool->has_friction);
    fnv_int(hash, tool->capsule_count);
    // The shape, in all its parts.
    for (int i = 0; i < tool->capsule_count; i++)
        add_keys(hash, &CAPSULE_TABLE, &tool->capsule[i]);
    if (tool->has_plane)
        add_keys(hash, &PLANE_TABLE, &tool->plane);
    for (int i = 0; i < 2 && tool->kind == TOOL_BLADE; i++)
        fnv_vector(hash, tool->edge[i]);
    if (tool->kind == TOOL_REMOVER)
        add_keys(hash, &CAPSULE_TABLE, &tool->mouth);
}

static void add_attachment(uint64_t *hash, const AttachmentOptions *attachment)
{
    fnv_int(hash, attachment->body);
    fnv_int(hash, attachment->to);
    fnv_int(hash, attachment->tool);
    fnv_int(hash, attachment->to_body);
    add_keys(hash, &ATTACHMENT_TABLE, attachment);
    add_region(hash, &attachment->region);
}

bool build_is_fitted(const Scene *scene, const SceneBody *body)
{
    const bool known = body->voxels.kind == VOXELS_FILE || body->voxels.kind == VOXELS_MESH;
    const ScenePublish *publish = &scene->publish;
    return body->model == MODEL_VOXEL && body->skin.file == NULL && publish->nodes != NODES_ALL &&
           (publish->nodes_hz > 0.0 || scene->tool_count > 0 || scene->touch_count > 0) &&
           (body->shown == SHOWN_FITTED || (body->shown == SHOWN_AUTO && known));
}

uint64_t physics_hash(const Scene *scene, const World *world)
{
    uint64_t hash = FNV_START;
    // The scene's own keys, then each of its lists with its length.
    add_keys(&hash, &SCENE_TABLE, scene);
    fnv_int(&hash, scene->body_count);
    for (int i = 0; i < scene->body_count; i++) {
        add_body(&hash, &scene->body[i], &world->mesh[i], world->cells[i].hash);
        // What tools and other bodies feel: `publish.nodes` and the cells decide too.
        if (scene->tool_count + scene->touch_count > 0 && build_is_fitted(scene, &scene->body[i]))
            add_text(&hash, "fitted");
    }
    // Tools and attachments have no names that matter.
    fnv_int(&hash, scene->tool_count);
    for (int i = 0; i < scene->tool_count; i++)
        add_tool(&hash, &scene->tool[i]);
    for (int i = 0; i < scene->attachment_count; i++)
        add_attachment(&hash, &scene->attachment[i].options);
    for (int i = 0; i < scene->touch_count; i++) {
        fnv_int(&hash, scene->touch[i].options.body[0]);
        fnv_int(&hash, scene->touch[i].options.body[1]);
        add_keys(&hash, &TOUCH_TABLE, &scene->touch[i].options);
    }
    fnv_int(&hash, scene->load_count);
    for (int i = 0; i < scene->load_count; i++) {
        fnv_int(&hash, scene->load[i].load.body);
        add_keys(&hash, &LOAD_TABLE, &scene->load[i].load);
    }
    return hash;
}
