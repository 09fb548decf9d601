// The list of features that a scene can disable: whether each is enabled, and the key or option
// that enables it. A feature that a scene can do without must be listed: one that a single key of a
// body enables by the row of that key, all others here, where the state is read from what was built
// wherever possible, not from the scene.
#include "run/explain_parts.h"

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
    const SceneFeature features[] = {
        {g.x != 0.0 || g.y != 0.0 || g.z != 0.0, "gravity", "gravity = [ ... ]"},
        {scene->settle_s > 0.0, "settling before the first tick", "settle_s"},
        {world->team != NULL, "more threads for a step", "threads"},
        {has_stage(sim, STAGE_FIND_CONTACTS), "contact", "tools = ( ... )"},
        {has_tool(sim, TOOL_BLADE), "blades", "kind = \"blade\" in tools"},
        {has_tool(sim, TOOL_GRASPER), "graspers", "kind = \"grasper\" in tools"},
        {scene->attachment_count > 0, "attachments", "attachments = ( ... )"},
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
    const SceneFeature inner[] = {
        {publish->all_nodes, "inner vertices in messages", "publish.nodes = \"all\""}};
    bool solid = false; // a body has inner vertices
    for (int i = 0; i < scene->body_count; i++)
        solid |= scene->body[i].model == MODEL_VOXEL;
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

void explain_features(World *world, const Scene *scene, const ExchangeOptions *asked, FILE *out)
{
    print_scene(world, scene, out);
    if (asked != NULL)
        print_live(world, scene, asked, out);
    const bool touched = has_stage(world->sim, STAGE_CONTACT);
    for (int i = 0; i < scene->body_count; i++) {
        const SceneBody *described = &scene->body[i];
        fprintf(out, "features of body %s, and what enables each:\n", described->name);
        const Body *body = sim_body(world->sim, i);
        print_keys(described, out);
        if (described->model == MODEL_VOXEL)
            print_voxel(described, out);
        else
            print_surface(&described->surface, body, out);
        print_shared(described, body, touched, out);
    }
}
