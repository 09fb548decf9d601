// Reads one entry of `loads`.
#include "scene/scene_parts.h"

#include <string.h>

typedef struct LoadGroup {
    LoadOptions load; // first: offsets of rows are the same in LoadOptions
    const char *body;
} LoadGroup;

#define AT(member) offsetof(LoadGroup, load.member)
static const Option LOAD_OPTIONS[] = {
    {"body", OPTION_NAME, offsetof(LoadGroup, body), "", .high = SCENE_WORD_MAX,
     .preset_text = "all bodies", .about = "The body on which it acts."},
    {"center", OPTION_VECTOR, AT(center), "m", 0.0, POSITION_LIMIT, .required = true,
     .physics = true, .about = "Centre of the sphere whose nodes carry the load, world frame."},
    {"radius", OPTION_REAL, AT(radius), "m", 0.0, POSITION_LIMIT, .open = true, .required = true,
     .physics = true,
     .about = "Radius of that sphere; the nodes inside are selected when the load starts."},
    {"force", OPTION_VECTOR, AT(force), "N", 0.0, FORCE_LIMIT, .required = true, .physics = true,
     .about = "Total force, shared by the nodes in proportion to their areas, world frame."},
    {"start", OPTION_REAL, AT(start), "s", 0.0, TIME_LIMIT, .physics = true,
     .about = "Simulated time at which it starts."},
    {"duration", OPTION_REAL, AT(duration), "s", 0.0, TIME_LIMIT, .open = true, .required = true,
     .physics = true, .about = "Simulated time for which it lasts."},
};
#undef AT
const OptionTable LOAD_TABLE =
    OPTION_TABLE("loads", "A force on the nodes inside a sphere, for a while.", LOAD_OPTIONS);

int scene_find_body(const SceneReader *reader, const config_setting_t *at, const char *name)
{
    const Scene *scene = reader->scene;
    const char *nearest = NULL;
    for (int i = 0; i < scene->body_count; i++) {
        if (strcmp(scene->body[i].name, name) == 0)
            return i;
        if (option_is_near(name, scene->body[i].name))
            nearest = scene->body[i].name;
    }
    option_fail(&reader->source, at, "body \"%s\" is not in the scene%s%s%s", name,
                nearest != NULL ? ": did you mean \"" : "", nearest != NULL ? nearest : "",
                nearest != NULL ? "\"?" : "");
    return -1;
}

bool scene_read_load(const SceneReader *reader, const config_setting_t *group, LoadOptions *load)
{
    LoadGroup raw = {0};
    const config_setting_t *name = option_find(group, "body");
    if (!option_read(&LOAD_TABLE, group, &reader->source, &raw))
        return false;
    *load = raw.load;
    load->body = -1;
    if (name == NULL || raw.body[0] == '\0')
        return true;
    load->body = scene_find_body(reader, name, raw.body);
    return load->body >= 0;
}
