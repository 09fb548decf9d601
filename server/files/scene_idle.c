// Keys without effect because of another key's value: they do no harm, are accepted, and are
// reported once each. A key that can have no effect at all is refused where it is read.
#include "files/scene_parts.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

// Location of a group: the scene itself, a body, or a tool.
typedef struct Place {
    const Scene *scene;
    const SceneBody *body;         // or NULL
    const ToolOptions *tool;       // or NULL
    const config_setting_t *group; // of the body or the tool
} Place;

typedef struct IdleKey {
    const OptionTable *table;
    const char *key;
    bool (*idle)(const Place *);
    const char *why;
} IdleKey;

// --- the scene ---

static bool moves_no_tool(const Place *place)
{
    for (int i = 0; i < place->scene->tool_count; i++)
        if (place->scene->tool[i].kind != TOOL_STATIC)
            return false;
    return true;
}

static bool is_plane(const SceneBody *body)
{
    return body->model == MODEL_VOXEL && body->dimensions == 2;
}

// True if there are bodies with inner nodes, which are published only with "all".
static bool shows_all_anyhow(const Place *place)
{
    for (int i = 0; i < place->scene->body_count; i++)
        if (place->scene->body[i].model == MODEL_VOXEL && !is_plane(&place->scene->body[i]))
            return false;
    return place->scene->publish.all_nodes;
}

static bool has_only_planes(const Place *place)
{
    for (int i = 0; i < place->scene->body_count; i++)
        if (!is_plane(&place->scene->body[i]))
            return false;
    return true;
}

static bool publishes_contacts_of_none(const Place *place)
{
    return place->scene->tool_count == 0 && place->scene->publish.contact_hz > 0.0;
}

static bool publishes_no_nodes(const Place *place)
{
    return !(place->scene->publish.nodes_hz > 0.0);
}

static bool publishes_no_contacts(const Place *place)
{
    return !(place->scene->publish.contact_hz > 0.0);
}

// --- bodies ---

static bool is_explicit(const Place *place)
{
    const SurfaceOptions *surface = &place->body->surface;
    return !surface->automatic && surface->body.integrator != INTEGRATOR_IMPLICIT;
}

static bool has_one_level(const Place *place)
{
    return place->body->options.levels == 0;
}

static bool has_no_time_step(const Place *place)
{
    return !option_given(place->group, "time_step");
}

static bool is_whole(const Place *place)
{
    return !place->body->voxel.body.cuttable;
}

static bool has_only_cells(const Place *place)
{
    return place->body->voxel.body.levels == 0;
}

static bool touches(const ToolOptions *tool)
{
    return tool->capsule_count > 0 || tool->has_plane;
}

static bool meets_no_tool(const Place *place)
{
    for (int i = 0; i < place->scene->tool_count; i++)
        if (touches(&place->scene->tool[i]))
            return false;
    return true;
}

static bool tools_have_friction(const Place *place)
{
    for (int i = 0; i < place->scene->tool_count; i++)
        if (touches(&place->scene->tool[i]) && !place->scene->tool[i].has_friction)
            return false;
    return !meets_no_tool(place);
}

// True if each label has an entry in `materials` with its own value.
static bool labels_have(const Place *place, const char *key)
{
    const config_setting_t *list = option_find(place->group, "materials");
    int count = 0;
    for (int i = 0; i < option_length(list); i++)
        count += option_given(config_setting_get_elem(list, (unsigned)i), key);
    return count == place->body->voxels.label_count;
}

static bool labels_have_modulus(const Place *place)
{
    return labels_have(place, "youngs_modulus");
}

static bool labels_have_ratio(const Place *place)
{
    return labels_have(place, "poisson_ratio");
}

static bool labels_have_density(const Place *place)
{
    return labels_have(place, "density");
}

// --- tools ---

static bool touches_nothing(const Place *place)
{
    return !touches(place->tool);
}

static const IdleKey IDLE_KEYS[] = {
    {&SCENE_TABLE, "tool_timeout_s", moves_no_tool, "no tool is moved by messages"},
    {&PUBLISH_TABLE, "nodes", shows_all_anyhow, "no body has an inside"},
    {&PUBLISH_TABLE, "velocity", publishes_no_nodes, "nodes_hz is 0"},
    {&PUBLISH_TABLE, "contact_hz", publishes_contacts_of_none, "there is no tool"},
    {&PUBLISH_TABLE, "contact_stiffness", has_only_planes, "plane bodies report none"},
    {&PUBLISH_TABLE, "contact_stiffness", moves_no_tool, "no tool is moved by messages"},
    {&PUBLISH_TABLE, "contact_stiffness", publishes_no_contacts, "contact_hz is 0"},
    {&BODY_TABLE, "adjust", has_one_level, "levels is 0"},
    {&BODY_TABLE, "theta", is_explicit, "the integrator is not \"implicit\""},
    {&BODY_TABLE, "solver_tolerance", is_explicit, "the integrator is not \"implicit\""},
    {&BODY_TABLE, "solver_iterations", is_explicit, "the integrator is not \"implicit\""},
    {&BODY_TABLE, "unsafe_time_step", has_no_time_step, "there is no time_step"},
    {&BODY_TABLE, "split_budget", is_whole, "cuttable is false"},
    {&BODY_TABLE, "split_budget", has_only_cells, "levels is 0, and a cell is not divided"},
    {&CONTACT_TABLE, "stiffness", meets_no_tool, "no tool touches the body"},
    {&CONTACT_TABLE, "damping_time", meets_no_tool, "no tool touches the body"},
    {&CONTACT_TABLE, "friction", meets_no_tool, "no tool touches the body"},
    {&CONTACT_TABLE, "friction", tools_have_friction, "each tool has a friction of its own"},
    {&VOXEL_MATERIAL_TABLE, "youngs_modulus", labels_have_modulus,
     "materials give it for each label"},
    {&VOXEL_MATERIAL_TABLE, "poisson_ratio", labels_have_ratio, "materials give it for each label"},
    {&VOXEL_MATERIAL_TABLE, "density", labels_have_density, "materials give it for each label"},
    {&TOOL_TABLE, "max_force", touches_nothing, "it has no capsules"},
    {&TOOL_TABLE, "friction", touches_nothing, "it has no capsules"},
};

static void add(Scene *scene, const char *path, const config_setting_t *at, const IdleKey *row)
{
    Status said = {0};
    const OptionSource source = {path, &said};
    option_fail(&source, at, "%s has no effect: %s", row->key, row->why);
    const size_t count = (size_t)scene->idle_count + 1;
    scene->idle = realloc(scene->idle, count * sizeof *scene->idle);
    ASSERT(scene->idle != NULL);
    scene->idle[scene->idle_count] = strdup(said.text);
    ASSERT(scene->idle[scene->idle_count] != NULL);
    scene->idle_count++;
}

// Reports each key of a group at most once.
static void look(Scene *scene, const OptionTable *table, const config_setting_t *group,
                 const Place *place)
{
    const char *said = "";
    for (size_t i = 0; i < sizeof IDLE_KEYS / sizeof *IDLE_KEYS; i++) {
        const IdleKey *row = &IDLE_KEYS[i];
        if (row->table != table || !option_given(group, row->key) || strcmp(said, row->key) == 0 ||
            !row->idle(place))
            continue;
        add(scene, scene->path, option_find(group, row->key), row);
        said = row->key;
    }
}

void scene_find_idle(Scene *scene, const config_setting_t *root)
{
    Place place = {.scene = scene, .group = root};
    look(scene, &SCENE_TABLE, root, &place);
    look(scene, &PUBLISH_TABLE, option_find(root, "publish"), &place);
    for (int i = 0; i < scene->body_count; i++) {
        place.body = &scene->body[i];
        place.group = config_setting_get_elem(option_find(root, "bodies"), (unsigned)i);
        look(scene, &BODY_TABLE, place.group, &place);
        look(scene, &CONTACT_TABLE, option_find(place.group, "contact"), &place);
        if (place.body->model == MODEL_VOXEL)
            look(scene, &VOXEL_MATERIAL_TABLE, option_find(place.group, "material"), &place);
    }
    for (int i = 0; i < scene->tool_count; i++) {
        place.tool = &scene->tool[i];
        place.group = config_setting_get_elem(option_find(root, "tools"), (unsigned)i);
        look(scene, &TOOL_TABLE, place.group, &place);
    }
}
