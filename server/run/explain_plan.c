// What a scene costs and enables, for --explain. A feature that a scene can do without must be
// listed: one that a single key of a body enables by the row of that key, all others here, where
// the state is read from what was built wherever possible, not from the scene.
#include "run/modes.h"

#include <string.h>

// --- the bytes of every array --------------------------------------------------------------------

static const struct {
    ArenaUse use;
    const char *name;
} USES[] = {{ARENA_STEP, "every step"},
            {ARENA_CONTACT, "while a tool is near"},
            {ARENA_TOPOLOGY, "meshes and connectivity"},
            {ARENA_OUTPUT, "messages and files"}};

static bool is_same(const ArenaBlock *a, const ArenaBlock *b)
{
    return a->use == b->use && strcmp(a->name, b->name) == 0;
}

// Prints all arrays of this one's name, unless an earlier one has printed them.
static void print_block(const Arena *arena, int index, FILE *out)
{
    const ArenaBlock *block = &arena->block[index];
    size_t bytes = 0;
    int count = 0;
    // A block of the same name that came earlier has printed all of them.
    for (int i = 0; i < arena->count; i++) {
        if (!is_same(&arena->block[i], block))
            continue;
        if (i < index)
            return;
        bytes += arena->block[i].bytes;
        count++;
    }
    // One line, with their number where there are several.
    fprintf(out, "  %-47s %12zu", block->name, bytes);
    if (count > 1)
        fprintf(out, " in %d", count);
    fprintf(out, "\n");
}

static size_t mesh_bytes(const TriMesh *mesh)
{
    size_t nodes = (size_t)mesh->node_count;
    return nodes * (sizeof *mesh->position + sizeof *mesh->file_index) +
           (size_t)mesh->triangle_count * sizeof *mesh->triangle +
           (mesh->file_node != NULL ? (size_t)mesh->file_node_count : 0) * sizeof *mesh->file_node +
           (size_t)mesh->copy_count * sizeof *mesh->copy_of +
           (mesh->uv != NULL ? nodes : 0) * sizeof *mesh->uv;
}

// Prints memory that belongs to no array of the running scene but stays allocated with it.
static size_t print_kept(World *world, FILE *out)
{
    // What loading leaves, though no step needs it.
    size_t meshes = 0;
    for (int i = 0; i < world->mesh_count; i++)
        meshes += sizeof world->mesh[i] + sizeof world->cells[i] + mesh_bytes(&world->mesh[i]);
    const size_t arrays = (size_t)world->arena.capacity * sizeof *world->arena.block;
    const size_t state = (size_t)world->state.capacity * sizeof *world->state.array;
    const size_t team = world->team != NULL ? team_bytes() : 0;
    fprintf(out, "kept from loading: %zu bytes\n", meshes + arrays + state + team);
    fprintf(out, "  %-47s %12zu\n  %-47s %12zu\n  %-47s %12zu\n", "meshes as they were read",
            meshes, "list of these arrays", arrays, "list of the state", state);
    if (team > 0)
        fprintf(out, "  %-47s %12zu\n", "threads of a step", team);
    return meshes + arrays + state + team;
}

// Prints the arrays and their bytes; `nodes`: the sum over all bodies.
static void print_arrays(World *world, int nodes, FILE *out)
{
    const Arena *arena = &world->arena;
    // By use, so that it shows what a step reads and writes.
    for (size_t u = 0; u < sizeof USES / sizeof *USES; u++) {
        fprintf(out, "arrays, %s: %zu bytes\n", USES[u].name, arena_bytes_of(arena, USES[u].use));
        for (int i = 0; i < arena->count; i++)
            if (arena->block[i].use == USES[u].use)
                print_block(arena, i, out);
    }
    // The sum, also by node: the figure to compare scenes by.
    const size_t total = arena_bytes(arena) + print_kept(world, out);
    fprintf(out,
            "total: %zu bytes, %.1f a node, of which %.1f read or written by every step and %.1f "
            "while a tool is near\n",
            total, (double)total / nodes, (double)arena_bytes_of(arena, ARENA_STEP) / nodes,
            (double)arena_bytes_of(arena, ARENA_CONTACT) / nodes);
    fprintf(out, "not counted: stacks, and what the libraries of LCM and HDF5 take\n");
}

// --- features ------------------------------------------------------------------------------------

enum { FEATURES_MOST = 32 }; // of the keys of a body

#define PRINT(features, out)                                                                       \
    print_features(features, (int)(sizeof(features) / sizeof *(features)), out)

static void print_features(const SceneFeature *features, int count, FILE *out)
{
    for (int i = 0; i < count; i++)
        fprintf(out, "  %-3s  %-38s %s\n", features[i].on ? "on" : "off", features[i].name,
                features[i].key);
}

static bool has_stage(const Sim *sim, StageId stage)
{
    for (int i = 0; i < sim_stage_count(sim); i++)
        if (sim_stage(sim, i) == stage)
            return true;
    return false;
}

static bool has_tool(const Sim *sim, ToolKind kind)
{
    for (int i = 0; i < sim_tool_count(sim); i++)
        if (sim_tool(sim, i)->kind == kind)
            return true;
    return false;
}

static void print_scene(World *world, const Scene *scene, FILE *out)
{
    const Sim *sim = world->sim;
    const Vec3 g = scene->gravity;
    // What only a scene as a whole can do without.
    const SceneFeature features[] = {
        {g.x != 0.0 || g.y != 0.0 || g.z != 0.0, "gravity", "gravity = [ ... ]"},
        {scene->settle_s > 0.0, "settling before the first tick", "settle_s"},
        {world->team != NULL, "more threads for a step", "threads"},
        {has_stage(sim, STAGE_FIND_CONTACTS), "contact", "tools = ( ... )"},
        {has_tool(sim, TOOL_BLADE), "blades", "kind = \"blade\" in tools"},
        {has_tool(sim, TOOL_GRASPER), "graspers", "kind = \"grasper\" in tools"},
        {scene->attachment_count > 0, "attachments", "attachments = ( ... )"},
        {sim_tie_capacity(sim) > 0, "ties by message", "max_ties"},
        {scene->touch_count > 0, "contact between bodies", "touch = ( ... )"},
        {scene->load_count > 0, "loads of the scene", "loads = ( ... )"},
    };
    fprintf(out, "features of the scene, and what enables each:\n");
    PRINT(features, out);
}

// Prints the features that only a live run has.
static void print_live(World *world, const Scene *scene, const ExchangeOptions *asked, FILE *out)
{
    const Sim *sim = world->sim;
    const ScenePublish *publish = &scene->publish;
    const bool contacts = sim_tool_count(sim) > 0 && publish->contact_hz > 0.0;
    const SceneFeature features[] = {
        {publish->nodes_hz > 0.0, "positions in messages", "publish.nodes_hz"},
        {publish->nodes_hz > 0.0 && publish->positions != POSITIONS_FLOATS, "positions in packets",
         "publish.positions = \"packets\" or \"both\""},
        {publish->nodes_hz > 0.0 && asked->velocity, "velocities in messages",
         "publish.velocity = true"},
        {publish->mesh_hz > 0.0, "meshes in messages", "publish.mesh_hz"},
        {publish->rest, "rest positions in messages", "publish.rest = true"},
        {publish->status_hz > 0.0, "status in messages", "publish.status_hz"},
        {contacts, "contacts in messages", "publish.contact_hz, with tools"},
        {has_stage(sim, STAGE_STIFFNESS), "stiffness in contacts",
         "publish.contact_stiffness, with contacts"},
        {has_stage(sim, STAGE_ESTIMATE), "error of the time steps in status",
         "estimate_error = true"},
        {asked->records, "recording", "option --record FILE"},
        {asked->checkpoints, "checkpoints", "option --checkpoint FILE"},
        {asked->logs_inputs, "log of applied inputs", "option --log-inputs FILE"},
        {asked->checkpoints || asked->logs_inputs || asked->records, "files thread",
         "any of these three"},
    };
    PRINT(features, out);
    // Inner vertices concern solids only.
    const SceneFeature inner[] = {
        {publish->all_nodes, "inner vertices in messages", "publish.nodes = \"all\""}};
    bool solid = false; // a body has inner vertices
    for (int i = 0; i < scene->body_count; i++)
        solid |= scene_has_cells(&scene->body[i]);
    if (solid)
        PRINT(inner, out);
}

static bool is_damped(const SurfaceMaterial *material)
{
    return (material->uniform ? material->spring_damping : material->damping_time) > 0.0;
}

static void print_surface(const SurfaceOptions *options, const Body *body, FILE *out)
{
    const SceneFeature features[] = {
        {is_damped(&options->material), "damping of springs",
         "material.damping_time or spring_damping"},
        {options->material.thickness > 0.0 || options->material.bending_stiffness > 0.0,
         "bending of the wall", "material.thickness or bending_stiffness"},
        {options->shape.wanted, "shape springs", "shape = { ... }"},
        {body->integrator == INTEGRATOR_IMPLICIT, "implicit integration",
         "integrator = \"implicit\" or \"auto\""},
        {options->body.levels > 0, "finer levels of detail", "levels"},
        {body->ops->adapt != NULL, "refinement at run time", "adapt = { ... }"},
        {body->ops->adapt != NULL, "time budget of the detail", "adapt = { ... }"},
    };
    PRINT(features, out);
}

static void print_voxel(const SceneBody *described, FILE *out)
{
    const SceneFeature features[] = {
        {described->options.levels > 0, "larger elements inside", "levels"},
        {described->skin.file != NULL, "display surface", "skin = { mesh = ... }"},
    };
    PRINT(features, out);
}

// Prints the features of bodies of all models.
static void print_shared(const SceneBody *described, const Body *body, bool touched, FILE *out)
{
    const SceneFeature features[] = {
        {described->options.fixed_count > 0, "held nodes", "fixed = ( ... )"},
        {touched && body->tuning.friction > 0.0, "friction at tools",
         "contact.friction, with tools"},
        {body->ops->cut != NULL, "cuts", "cuttable = true"},
        {body->ops->tear != NULL, "tearing", "tear = { ... }"},
    };
    PRINT(features, out);
}

// Prints the features that rows of the tables name.
static void print_keys(const SceneBody *described, FILE *out)
{
    SceneFeature feature[FEATURES_MOST];
    print_features(feature, scene_list_features(described, feature, FEATURES_MOST), out);
}

static void print_all_features(World *world, const Scene *scene, const ExchangeOptions *asked,
                               FILE *out)
{
    print_scene(world, scene, out);
    if (asked != NULL)
        print_live(world, scene, asked, out);
    // Bodies one by one: keys, then what the model adds, then what all share.
    const bool touched = has_stage(world->sim, STAGE_CONTACT);
    for (int i = 0; i < scene->body_count; i++) {
        const SceneBody *described = &scene->body[i];
        fprintf(out, "features of body %s, and what enables each:\n", described->name);
        const Body *body = sim_body(world->sim, i);
        print_keys(described, out);
        if (scene_has_cells(described))
            print_voxel(described, out);
        else
            print_surface(&described->surface, body, out);
        print_shared(described, body, touched, out);
    }
}

// --- all of it -----------------------------------------------------------------------------------

void explain_plan(World *world, const Scene *scene, const ExchangeOptions *asked, FILE *out)
{
    explain_summary(world, scene, out);
    Sim *sim = world->sim;
    // Which stages run, and which kernels.
    fprintf(out, "stages:");
    for (int i = 0; i < sim_stage_count(sim); i++)
        fprintf(out, " %s", stage_name(sim_stage(sim, i)));
    fprintf(out, "\n");
    for (int i = 0; i < sim_body_count(sim); i++) {
        const Body *body = sim_body(sim, i);
        fprintf(out, "kernel of body %s:\n", body->name);
        body->ops->explain(body->model, out);
    }
    print_arrays(world, explain_nodes(world), out);
    print_all_features(world, scene, asked, out);
}
