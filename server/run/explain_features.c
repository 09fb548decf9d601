// The list of features that a scene can disable: whether each is enabled, and the key or option
// that enables it. A feature that a scene can do without must have a row here. The state is read
// from what was built wherever possible, not from the scene.
#include "run/explain_parts.h"

typedef struct Feature {
    bool on;
    const char *name;
    const char *key; // or option
} Feature;

#define PRINT(features, out)                                                                       \
    print_features(features, (int)(sizeof(features) / sizeof *(features)), out)

static void print_features(const Feature *features, int count, FILE *out)
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
    const Feature features[] = {
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
    const Feature features[] = {
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
    const Feature inner[] = {
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

static void print_surface(const SceneBody *described, const Body *body, bool touched, FILE *out)
{
    const SurfaceOptions *options = &described->surface;
    const Feature features[] = {
        {is_damped(&options->material), "damping of springs",
         "material.damping_time or spring_damping"},
        {options->material.node_damping > 0.0, "drag on nodes", "material.node_damping"},
        {options->shape.wanted, "shape springs", "shape = { ... }"},
        {options->shape.wanted && options->shape.frame == SHAPE_BODY,
         "shape springs that follow the body", "shape.frame = \"body\""},
        {options->shape.wanted && options->shape.direction == SHAPE_DAMPS_RADIAL,
         "shape springs damped along themselves", "shape.damping_direction = \"radial\""},
        {options->prestress > 0.0, "prestress", "prestress"},
        {body->integrator == INTEGRATOR_IMPLICIT, "implicit integration",
         "integrator = \"implicit\" or \"auto\""},
        {described->options.fixed_count > 0, "held nodes", "fixed = ( ... )"},
        {touched && body->tuning.friction > 0.0, "friction at tools",
         "contact.friction, with tools"},
        {options->body.levels > 0, "finer levels of detail", "levels"},
        {body->ops->adapt != NULL, "refinement at run time", "adapt = { ... }"},
        {body->ops->adapt != NULL, "time budget of the detail", "adapt = { ... }"},
        {body->ops->cut != NULL, "cuts", "cuttable = true"},
        {body->ops->tear != NULL, "tearing", "tear = { ... }"},
    };
    PRINT(features, out);
}

static void print_voxel(const SceneBody *described, const Body *body, bool touched, FILE *out)
{
    const VoxelOptions *options = &described->voxel;
    const Feature features[] = {
        {options->damping > 0.0, "damping of elements", "material.damping"},
        {described->options.fixed_count > 0, "held nodes", "fixed = ( ... )"},
        {touched && body->tuning.friction > 0.0, "friction at tools",
         "contact.friction, with tools"},
        {options->body.levels > 0, "larger elements inside", "levels"},
        {described->skin.file != NULL, "display surface", "skin = { mesh = ... }"},
        {body->ops->cut != NULL, "cuts", "cuttable = true"},
        {body->ops->tear != NULL, "tearing", "tear = { ... }"},
    };
    PRINT(features, out);
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
        if (described->model == MODEL_VOXEL)
            print_voxel(described, body, touched, out);
        else
            print_surface(described, body, touched, out);
    }
}
