// SPDX-License-Identifier: MIT
// Keys without effect because of another key's value: they do no harm, are accepted, and are
// reported once each. A key that can have no effect at all is refused where it is read.
#include "scene/scene_parts.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

// --- the scene ---

static bool moves_no_tool(const OptionPlace *place)
{
    for (int i = 0; i < place->scene->tool_count; i++)
        if (place->scene->tool[i].kind != TOOL_STATIC)
            return false;
    return true;
}

// True if there are bodies with inner nodes, which are published only with "all".
static bool shows_all_anyhow(const OptionPlace *place)
{
    for (int i = 0; i < place->scene->body_count; i++)
        if (place->scene->body[i].model == MODEL_VOXEL)
            return false;
    return place->scene->publish.nodes == NODES_ALL;
}

static bool has_only_planes(const OptionPlace *place)
{
    for (int i = 0; i < place->scene->body_count; i++)
        if (place->scene->body[i].model != MODEL_PLANE)
            return false;
    return true;
}

static bool publishes_contacts_of_none(const OptionPlace *place)
{
    return place->scene->tool_count == 0 && place->scene->publish.contact_hz > 0.0;
}

static bool publishes_no_nodes(const OptionPlace *place)
{
    return !(place->scene->publish.nodes_hz > 0.0);
}

static bool is_not_shown(const OptionPlace *place)
{
    return publishes_no_nodes(place) && place->scene->tool_count == 0 &&
           place->scene->touch_count == 0;
}

static bool publishes_all_nodes(const OptionPlace *place)
{
    return place->scene->publish.nodes == NODES_ALL;
}

static bool publishes_no_errors(const OptionPlace *place)
{
    return !(place->scene->publish.error_hz > 0.0);
}

static bool has_no_voxels(const OptionPlace *place)
{
    for (int i = 0; i < place->scene->body_count; i++)
        if (place->scene->body[i].model == MODEL_VOXEL)
            return false;
    return true;
}

static bool publishes_no_contacts(const OptionPlace *place)
{
    return !(place->scene->publish.contact_hz > 0.0);
}

// --- bodies ---

static bool is_explicit(const OptionPlace *place)
{
    const SurfaceOptions *surface = &place->body->surface;
    return !surface->automatic && surface->body.integrator != INTEGRATOR_IMPLICIT;
}

static bool holds_no_gas(const OptionPlace *place)
{
    return !place->body->surface.cavity.gas;
}

static bool holds_no_fluid(const OptionPlace *place)
{
    return !place->body->surface.cavity.fluid;
}

static bool has_one_level(const OptionPlace *place)
{
    return place->body->options.levels == 0;
}

static bool has_no_time_step(const OptionPlace *place)
{
    return !(place->body->options.time_step > 0.0);
}

static bool is_whole(const OptionPlace *place)
{
    return !place->body->options.cuttable;
}

static bool is_not_heated(const OptionPlace *place)
{
    return !scene_heats(place->scene);
}

static bool touches(const ToolOptions *tool)
{
    return tool->capsule_count > 0 || tool->has_plane;
}

static bool meets_no_tool(const OptionPlace *place)
{
    for (int i = 0; i < place->scene->tool_count; i++)
        if (touches(&place->scene->tool[i]))
            return false;
    return true;
}

static bool tools_have_friction(const OptionPlace *place)
{
    for (int i = 0; i < place->scene->tool_count; i++)
        if (touches(&place->scene->tool[i]) && !place->scene->tool[i].has_friction)
            return false;
    return !meets_no_tool(place);
}

// True if each label has an entry in `materials` with its own value.
static bool labels_have(const OptionPlace *place, const char *key)
{
    const config_setting_t *list = option_find(place->group, "materials");
    int count = 0;
    for (int i = 0; i < option_length(list); i++)
        count += option_given(config_setting_get_elem(list, (unsigned)i), key);
    return count == place->body->voxels.label_count;
}

static bool labels_have_modulus(const OptionPlace *place)
{
    return labels_have(place, "youngs_modulus");
}

static bool labels_have_ratio(const OptionPlace *place)
{
    return labels_have(place, "poisson_ratio");
}

static bool labels_have_density(const OptionPlace *place)
{
    return labels_have(place, "density");
}

static bool labels_have_prestress(const OptionPlace *place)
{
    return labels_have(place, "prestress");
}

static bool labels_have_axis(const OptionPlace *place)
{
    return labels_have(place, "prestress_axis");
}

static bool has_no_prestress(const OptionPlace *place)
{
    for (int i = 0; i < place->body->voxel.material_count; i++)
        if (place->body->material[i].prestress > 0.0)
            return false;
    return true;
}

// --- tools ---

static bool touches_nothing(const OptionPlace *place)
{
    return !touches(place->tool);
}

static bool can_take_nothing(const OptionPlace *place)
{
    for (int i = 0; i < place->scene->body_count; i++)
        if (place->scene->body[i].options.cuttable && place->scene->body[i].model != MODEL_PLANE)
            return false;
    return true;
}

const OptionIdle IDLE_MOVES_NO_TOOL = {moves_no_tool, "no tool is moved by messages"};
const OptionIdle IDLE_HAS_NO_INSIDE = {shows_all_anyhow, "no body has an inside"};
const OptionIdle IDLE_PUBLISHES_NO_NODES = {publishes_no_nodes, "nodes_hz is 0"};
const OptionIdle IDLE_IS_NOT_SHOWN = {is_not_shown,
                                      "nodes_hz is 0 and there is no tool and no touch"};
const OptionIdle IDLE_PUBLISHES_ALL_NODES = {publishes_all_nodes, "publish.nodes is \"all\""};
const OptionIdle IDLE_HAS_NO_TOOL = {publishes_contacts_of_none, "there is no tool"};
const OptionIdle IDLE_HAS_ONLY_PLANES = {has_only_planes, "plane bodies report none"};
const OptionIdle IDLE_PUBLISHES_NO_ERRORS = {publishes_no_errors, "error_hz is 0"};
const OptionIdle IDLE_HAS_NO_VOXELS = {has_no_voxels, "there is no voxel body"};
const OptionIdle IDLE_PUBLISHES_NO_CONTACTS = {publishes_no_contacts, "contact_hz is 0"};
const OptionIdle IDLE_HAS_ONE_LEVEL = {has_one_level, "levels is 0"};
const OptionIdle IDLE_IS_EXPLICIT = {is_explicit, "the integrator is not \"implicit\""};
const OptionIdle IDLE_HAS_NO_TIME_STEP = {has_no_time_step, "there is no time_step"};
const OptionIdle IDLE_HOLDS_NO_GAS = {holds_no_gas, "gas is false"};
const OptionIdle IDLE_HOLDS_NO_FLUID = {holds_no_fluid, "fluid is false"};
const OptionIdle IDLE_IS_WHOLE = {is_whole, "cuttable is false"};
const OptionIdle IDLE_IS_NOT_HEATED = {is_not_heated, "no remover heats by diathermy"};
const OptionIdle IDLE_HAS_ONLY_CELLS = {has_one_level, "levels is 0, and a cell is not divided"};
const OptionIdle IDLE_MEETS_NO_TOOL = {meets_no_tool, "no tool touches the body"};
const OptionIdle IDLE_TOOLS_HAVE_FRICTION = {tools_have_friction,
                                             "each tool has a friction of its own"};
const OptionIdle IDLE_LABELS_HAVE_MODULUS = {labels_have_modulus,
                                             "materials give it for each label"};
const OptionIdle IDLE_LABELS_HAVE_RATIO = {labels_have_ratio, "materials give it for each label"};
const OptionIdle IDLE_LABELS_HAVE_DENSITY = {labels_have_density,
                                             "materials give it for each label"};
const OptionIdle IDLE_LABELS_HAVE_PRESTRESS = {labels_have_prestress,
                                               "materials give it for each label"};
const OptionIdle IDLE_LABELS_HAVE_AXIS = {labels_have_axis, "materials give it for each label"};
const OptionIdle IDLE_HAS_NO_PRESTRESS = {has_no_prestress, "prestress is 0"};
const OptionIdle IDLE_CAN_TAKE_NOTHING = {can_take_nothing, "no body is cuttable"};
const OptionIdle IDLE_TOUCHES_NOTHING = {touches_nothing, "it has no capsules"};

static void add(Scene *scene, const config_setting_t *at, const char *key, const char *why)
{
    Status said = {0};
    const OptionSource source = {.path = scene->path, .status = &said};
    // In the form of an error, with file and line, but as a remark.
    option_fail(&source, at, "%s has no effect: %s", key, why);
    const size_t count = (size_t)scene->idle_count + 1;
    scene->idle = realloc(scene->idle, count * sizeof *scene->idle);
    ASSERT(scene->idle != NULL);
    scene->idle[scene->idle_count] = strdup(said.text);
    ASSERT(scene->idle[scene->idle_count] != NULL);
    scene->idle_count++;
}

static void look(Scene *scene, const OptionTable *table, const config_setting_t *group,
                 const OptionPlace *place)
{
    for (int i = 0; i < table->count; i++) {
        const Option *option = &table->option[i];
        const config_setting_t *at = option_find(group, option->key);
        const char *why = at != NULL ? option_idle(option, place) : NULL;
        if (why != NULL)
            add(scene, at, option->key, why);
    }
}

void scene_find_idle(Scene *scene, const config_setting_t *root)
{
    // The scene itself, then each body with its groups, then each tool.
    OptionPlace place = {.scene = scene, .group = root};
    look(scene, &SCENE_TABLE, root, &place);
    look(scene, &PUBLISH_TABLE, option_find(root, "publish"), &place);
    for (int i = 0; i < scene->body_count; i++) {
        place.body = &scene->body[i];
        place.group = config_setting_get_elem(option_find(root, "bodies"), (unsigned)i);
        look(scene, &BODY_TABLE, place.group, &place);
        look(scene, &CONTACT_TABLE, option_find(place.group, "contact"), &place);
        const config_setting_t *labels = option_find(place.group, "materials");
        if (scene_has_cells(place.body))
            look(scene, &VOXEL_MATERIAL_TABLE, option_find(place.group, "material"), &place);
        for (int m = 0; m < option_length(labels); m++)
            look(scene, &LABEL_MATERIAL_TABLE, config_setting_get_elem(labels, (unsigned)m),
                 &place);
        look(scene, &CAVITY_TABLE, option_find(place.group, "cavity"), &place);
    }
    for (int i = 0; i < scene->tool_count; i++) {
        place.tool = &scene->tool[i];
        place.group = config_setting_get_elem(option_find(root, "tools"), (unsigned)i);
        look(scene, &TOOL_TABLE, place.group, &place);
    }
}
