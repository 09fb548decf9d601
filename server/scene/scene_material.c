// Reads the groups `material` and `shape` of a surface body: each is given in physical units or as
// the paper's values per spring and node, never in both.
#include "scene/scene_parts.h"

#include <string.h>

#define AT(member) offsetof(SurfaceMaterial, member)
static const Option MATERIAL_OPTIONS[] = {
    {"youngs_modulus_2d", OPTION_REAL, AT(youngs_modulus_2d), "N/m", 0.0, 1e9, .open = true,
     .preset = 80.0, .physics = true,
     .about = "Young's modulus times thickness; springs get k = E (A1 + A2) / L^2 (Van Gelder "
              "1998)."},
    {"areal_density", OPTION_REAL, AT(areal_density), "kg/m2", 0.0, 1e6, .open = true,
     .preset = 4.2, .physics = true,
     .about = "Mass per unit area; a node has a third of the mass of the faces around it."},
    {"damping_time", OPTION_REAL, AT(damping_time), "s", 0.0, 10.0, .preset = 2e-4, .physics = true,
     .about = "Damping of a spring over its stiffness. Reduced, with a warning, where it would "
              "shorten explicit steps; `implicit` uses at most one step of it."},
    {"spring_stiffness", OPTION_REAL, AT(spring_stiffness), "N/m", 0.0, 1e9, .open = true,
     .preset_text = "none", .physics = true, .about = "Uniform: stiffness of every spring."},
    {"spring_damping", OPTION_REAL, AT(spring_damping), "N s/m", 0.0, 1e6, .physics = true,
     .about = "Uniform: damping of every spring."},
    {"node_mass", OPTION_REAL, AT(node_mass), "kg", 0.0, 1e6, .open = true, .preset_text = "none",
     .physics = true, .about = "Uniform: mass of every node."},
    {"node_damping", OPTION_REAL, AT(node_damping), "N s/m", 0.0, 1e6, .physics = true,
     .feature = "drag on nodes", .about = "Both: drag on every node's velocity."},
};
#undef AT
const OptionTable MATERIAL_TABLE = TITLED_TABLE(
    "`bodies.material` of a surface body", "bodies.material",
    "Either physical (`youngs_modulus_2d`, `areal_density`, `damping_time`) or uniform "
    "(`spring_stiffness` and `node_mass`, and `spring_damping`); `node_damping` is permitted with "
    "both.",
    MATERIAL_OPTIONS);

enum { NO_KEYS = 4 };
static const char *const PHYSICAL_KEYS[NO_KEYS] = {"youngs_modulus_2d", "areal_density",
                                                   "damping_time"};
static const char *const UNIFORM_KEYS[NO_KEYS] = {"spring_stiffness", "spring_damping",
                                                  "node_mass"};
static const char *const FREQUENCY_KEYS[NO_KEYS] = {"angular_frequency", "damping_ratio"};
static const char *const NODE_KEYS[NO_KEYS] = {"stiffness", "damping"};

// Returns the first of `keys` that the group has, or NULL.
static const char *first_given(const config_setting_t *group, const char *const *keys)
{
    for (; *keys != NULL; keys++)
        if (option_given(group, *keys))
            return *keys;
    return NULL;
}

// True if the group uses `special` keys; returns false with a status if it mixes them with `usual`.
static bool choose(const SceneReader *reader, const config_setting_t *group,
                   const char *const *usual, const char *const *special, bool *chosen)
{
    const char *a = first_given(group, usual), *b = first_given(group, special);
    *chosen = b != NULL;
    if (a != NULL && b != NULL)
        return option_fail(&reader->source, option_find(group, b), "%s cannot be mixed with %s", b,
                           a);
    return true;
}

static bool require(const SceneReader *reader, const config_setting_t *group, const char *place,
                    const char *key, const char *because)
{
    if (option_given(group, key))
        return true;
    return option_fail(&reader->source, group, "%s.%s is missing: it goes with %s", place, key,
                       because);
}

bool scene_read_material(const SceneReader *reader, const config_setting_t *group,
                         SurfaceMaterial *material)
{
    if (!option_read(&MATERIAL_TABLE, group, &reader->source, material) ||
        !choose(reader, group, PHYSICAL_KEYS, UNIFORM_KEYS, &material->uniform))
        return false;
    if (!material->uniform)
        return true;
    const char *because = first_given(group, UNIFORM_KEYS);
    return require(reader, group, MATERIAL_TABLE.path, "spring_stiffness", because) &&
           require(reader, group, MATERIAL_TABLE.path, "node_mass", because);
}

static const OptionWord FRAME_WORDS[] = {{"world", SHAPE_WORLD}, {"body", SHAPE_BODY}, {NULL, 0}};
static const OptionWord DIRECTION_WORDS[] = {
    {"all", SHAPE_DAMPS_ALL}, {"radial", SHAPE_DAMPS_RADIAL}, {NULL, 0}};

#define AT(member) offsetof(SurfaceShape, member)
static const Option SHAPE_OPTIONS[] = {
    {"angular_frequency", OPTION_REAL, AT(angular_frequency), "rad/s", 0.0, 1e6, .preset = 50.0,
     .physics = true, .about = "Angular frequency of a node on its shape spring: k = m w^2."},
    {"damping_ratio", OPTION_REAL, AT(damping_ratio), "", 0.0, 100.0, .preset = 0.1,
     .physics = true, .about = "Share of critical damping of that oscillation."},
    {"stiffness", OPTION_REAL, AT(stiffness), "N/m", 0.0, 1e9, .preset_text = "none",
     .physics = true, .about = "Instead: stiffness of every node's shape spring."},
    {"damping", OPTION_REAL, AT(damping), "N s/m", 0.0, 1e6, .physics = true,
     .about = "With `stiffness`: damping of every node's shape spring."},
    {"frame", OPTION_WORD, AT(frame), "", .words = FRAME_WORDS, .preset = SHAPE_WORLD,
     .physics = true, .feature = "shape springs that follow the body",
     .about = "Whether the rest shape is fixed in the world or follows the body's rigid motion."},
    {"damping_direction", OPTION_WORD, AT(direction), "", .words = DIRECTION_WORDS,
     .preset = SHAPE_DAMPS_ALL, .physics = true, .feature = "shape springs damped along themselves",
     .about = "Which part of a node's velocity is damped: all of it, or only the part along the "
              "spring (`radial`: eq 10 as printed, with which a node keeps circling about its rest "
              "position; only with frame `world` and explicit steps)."},
};
#undef AT
const OptionTable SHAPE_TABLE =
    OPTION_TABLE("bodies.shape",
                 "Shape-preserving springs (Choi et al. 2005, eq 10). Either `angular_frequency` "
                 "and `damping_ratio`, or `stiffness` and `damping` per node.",
                 SHAPE_OPTIONS);

bool scene_read_shape(const SceneReader *reader, const config_setting_t *group, SurfaceShape *shape)
{
    shape->wanted = group != NULL;
    if (group == NULL)
        return true;
    if (!option_read(&SHAPE_TABLE, group, &reader->source, shape) ||
        !choose(reader, group, FREQUENCY_KEYS, NODE_KEYS, &shape->per_node))
        return false;
    if (shape->direction == SHAPE_DAMPS_RADIAL && shape->frame == SHAPE_BODY)
        return option_fail(&reader->source, option_find(group, "damping_direction"),
                           "damping_direction \"radial\" needs frame \"world\"");
    return !shape->per_node ||
           require(reader, group, SHAPE_TABLE.path, "stiffness", first_given(group, NODE_KEYS));
}

void scene_preset_surface(SurfaceOptions *surface)
{
    Status status = {0};
    const OptionSource nowhere = {.path = "", .status = &status};
    // Defaults cannot fail.
    option_read(&MATERIAL_TABLE, NULL, &nowhere, &surface->material);
    option_read(&SHAPE_TABLE, NULL, &nowhere, &surface->shape);
    option_read(&ADAPT_TABLE, NULL, &nowhere, &surface->adapt);
    surface->shape.wanted = true;
}
