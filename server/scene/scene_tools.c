// SPDX-License-Identifier: MIT
// Reads one entry of `tools`.
#include "scene/scene_parts.h"

#include <limits.h>

typedef struct ToolGroup {
    ToolOptions tool; // first: offsets of rows are the same in ToolOptions
    const config_setting_t *capsules, *plane, *edge, *mouth;
} ToolGroup;

static const OptionWord KIND_WORDS[] = {{"probe", TOOL_PROBE},     {"static", TOOL_STATIC},
                                        {"blade", TOOL_BLADE},     {"grasper", TOOL_GRASPER},
                                        {"remover", TOOL_REMOVER}, {NULL, 0}};

static const OptionWord REMOVER_WORDS[] = {{"suction", REMOVER_SUCTION},
                                           {"drill", REMOVER_DRILL},
                                           {"diathermy", REMOVER_DIATHERMY},
                                           {NULL, 0}};

const char *scene_remover_name(RemoverKind kind)
{
    for (const OptionWord *word = REMOVER_WORDS; word->word != NULL; word++)
        if (word->value == (int)kind)
            return word->word;
    return "";
}

static bool has_kind(const Scene *scene, ToolKind kind)
{
    for (int i = 0; i < scene->tool_count; i++)
        if (scene->tool[i].kind == kind)
            return true;
    return false;
}

static bool has_grasper(const OptionPlace *place)
{
    return has_kind(place->scene, TOOL_GRASPER);
}

static bool has_blade(const OptionPlace *place)
{
    return has_kind(place->scene, TOOL_BLADE);
}

static bool has_remover(const OptionPlace *place)
{
    return has_kind(place->scene, TOOL_REMOVER);
}

#define AT(member) offsetof(ToolGroup, member)
static const Option TOOL_OPTIONS[] = {
    {"id", OPTION_INT, AT(tool.id), "", 0.0, INT_MAX, .required = true, .physics = true,
     .about = "Number that identifies the tool in messages; unique."},
    {"kind", OPTION_WORD, AT(tool.kind), "", .words = KIND_WORDS, .required = true, .physics = true,
     .about = "Probe: moved by messages. Static: fixed in the world. Blade: moved by messages, "
              "cuts along its edge. Grasper: moved by messages; when it closes, it grasps the "
              "nodes inside its capsules. Remover: moved by messages; takes tissue away at its "
              "mouth while its grip is closed, as by a pedal."},
    {"capsules", OPTION_LIST, AT(capsules), "",
     .about = "Its shape: up to 8 groups, at least one for a probe; for a blade the part that "
              "pushes, its back; for a remover its shaft, up to 7."},
    {"plane", OPTION_GROUP, AT(plane), "", .about = "A half space; static tools only."},
    {"max_force", OPTION_REAL, AT(tool.max_force), "N", 0.0, FORCE_LIMIT, .open = true,
     .preset = 3.3, .physics = true, .idle = {&IDLE_TOUCHES_NOTHING},
     .about = "Largest force on the bodies and on the tool: a tool that is pushed or pulled harder "
              "yields."},
    {"friction", OPTION_REAL, AT(tool.friction), "", 0.0, 10.0, .preset_text = "the body's",
     .physics = true, .idle = {&IDLE_TOUCHES_NOTHING},
     .about = "Friction coefficient between the tool and any body."},
    {"lag", OPTION_REAL, AT(tool.lag), "s", 0.0, 0.1, .preset = 0.005, .physics = true,
     .about = "Time by which the tool is behind a hand that moves evenly: a filter takes the noise "
              "and the gaps out of its poses; 0: none."},
    {"fastest", OPTION_REAL, AT(tool.fastest), "m/s", 0.0, 1e9, .preset = 10.0, .physics = true,
     .about = "Speed that no hand has: a pose so far from the one before waits until a second one "
              "confirms it; 0: none does."},
    {"grip_stiffness", OPTION_REAL, AT(tool.grip_stiffness), "", 0.0, 1e3, .open = true,
     .preset = 0.3, .physics = true,
     .feature = {.name = "graspers", has_grasper, "kind = \"grasper\" in tools"},
     .about = "Stiffness of a grasper's springs, as a share of 100 times the body's own stiffness; "
              "with rk4 and implicit of once that, and stiffer springs shorten the time step."},
    {"grip_damping_ratio", OPTION_REAL, AT(tool.grip_damping), "", 0.0, 1e3, .preset = 0.5,
     .physics = true,
     .about = "Damping ratio of a grasper's springs with the grasped masses: 1 is critical."},
    {"edge", OPTION_LIST, AT(edge), "m", .preset_text = "required of a blade",
     .feature = {.name = "blades", has_blade, "kind = \"blade\" in tools"},
     .about = "The two ends of a blade's edge, in its frame: ([x, y, z], [x, y, z])."},
    {"removes_by", OPTION_WORD, AT(tool.removes), "", .words = REMOVER_WORDS,
     .preset_text = "required of a remover", .physics = true, .idle = {&IDLE_CAN_TAKE_NOTHING},
     .feature = {.name = "removers", has_remover, "kind = \"remover\" in tools"},
     .about =
         "Suction: takes what is in its mouth, the nearest first, at a rate. Drill: takes what "
         "its burr touches, and pushes the rest. Diathermy: heats what its electrode touches, "
         "and takes what boils."},
    {"mouth", OPTION_GROUP, AT(mouth), "", .preset_text = "required of a remover",
     .about = "Where a remover takes tissue, as one of `capsules`: the mouth of a tube, a burr, an "
              "electrode."},
    {"rate_mm3_s", OPTION_REAL, AT(tool.rate_mm3_s), "mm3/s", 0.0, 1e6, .open = true,
     .preset = 100.0, .preset_text = "100 of suction, of a drill no limit", .physics = true,
     .about =
         "Volume that suction takes, or that a drill takes at most, of walls as if they were 1 mm "
         "thick: a hand that goes faster feels what is left."},
    {"power", OPTION_REAL, AT(tool.power), "W", 0.0, 1e3, .open = true, .preset = 30.0,
     .physics = true, .about = "Heat that diathermy gives to tissue."},
};
#undef AT
const OptionTable TOOL_TABLE = OPTION_TABLE("tools", "One tool.", TOOL_OPTIONS);

static const Option CAPSULE_OPTIONS[] = {
    {"from", OPTION_VECTOR, offsetof(Capsule, from), "m", 0.0, POSITION_LIMIT, .physics = true,
     .about = "One end of the axis, in the tool's frame (for a static tool: the world frame)."},
    {"to", OPTION_VECTOR, offsetof(Capsule, to), "m", 0.0, POSITION_LIMIT,
     .preset_text = "as `from`", .physics = true,
     .about = "The other end; equal ends make a ball."},
    {"radius", OPTION_REAL, offsetof(Capsule, radius), "m", 0.0, 10.0, .open = true,
     .required = true, .physics = true, .about = "Radius around the axis."},
};
const OptionTable CAPSULE_TABLE =
    OPTION_TABLE("tools.capsules", "A cylinder with round ends.", CAPSULE_OPTIONS);

static const Option PLANE_OPTIONS[] = {
    {"point", OPTION_VECTOR, offsetof(Plane, point), "m", 0.0, POSITION_LIMIT, .physics = true,
     .about = "Any point of the plane, world frame."},
    {"normal", OPTION_VECTOR, offsetof(Plane, normal), "", 1e-6, 1e6, .required = true,
     .physics = true, .about = "Towards the free side; any length."},
};
const OptionTable PLANE_TABLE =
    OPTION_TABLE("tools.plane", "A half space, such as a table.", PLANE_OPTIONS);

static bool read_capsules(const SceneReader *reader, const config_setting_t *list,
                          ToolOptions *tool)
{
    int count = option_length(list);
    if (count > TOOL_SHAPES)
        return option_fail(&reader->source, list, "capsules has %d entries, at most %d", count,
                           TOOL_SHAPES);
    for (int i = 0; i < count; i++) {
        const config_setting_t *group = option_group_at(list, i, &reader->source);
        Capsule *capsule = &tool->capsule[tool->capsule_count++];
        if (group == NULL || !option_read(&CAPSULE_TABLE, group, &reader->source, capsule))
            return false;
        // A capsule with one end is a ball.
        if (!option_given(group, "to"))
            capsule->to = capsule->from;
    }
    return true;
}

static bool read_edge(const SceneReader *reader, const config_setting_t *group,
                      const config_setting_t *list, ToolOptions *tool)
{
    static const Option END = {"edge", OPTION_VECTOR, 0, "m", 0.0, POSITION_LIMIT, .about = ""};
    const OptionSource *source = &reader->source;
    // A blade needs an edge, and nothing else has one.
    if (tool->kind != TOOL_BLADE)
        return list == NULL ||
               option_fail(source, list, "edge means nothing for this tool, only for kind blade");
    if (list == NULL)
        return option_fail(source, group, "blade %d has no edge: ([x, y, z], [x, y, z])", tool->id);
    // Two ends that differ.
    if (option_length(list) != 2)
        return option_fail(source, list, "edge must be two ends ([x, y, z], [x, y, z])");
    for (int k = 0; k < 2; k++)
        if (!option_read_vector(config_setting_get_elem(list, (unsigned)k), &END, source,
                                &tool->edge[k]))
            return false;
    return vec3_length(vec3_sub(tool->edge[1], tool->edge[0])) > 1e-9 ||
           option_fail(source, list, "edge has no length: its two ends are the same");
}

static bool read_mouth(const SceneReader *reader, const config_setting_t *group,
                       const config_setting_t *mouth, ToolOptions *tool)
{
    enum { SUCTION = 1 << REMOVER_SUCTION, DRILL = 1 << REMOVER_DRILL };
    enum { DIATHERMY = 1 << REMOVER_DIATHERMY, EACH = SUCTION | DRILL | DIATHERMY };
    static const struct {
        const char *key;
        unsigned of;
    } KEYS[] = {{"removes_by", EACH},
                {"mouth", EACH},
                {"rate_mm3_s", SUCTION | DRILL},
                {"power", DIATHERMY}};
    const OptionSource *source = &reader->source;
    const bool removes = tool->kind == TOOL_REMOVER;
    // Keys of other kinds of tools, and of other removers.
    for (size_t i = 0; i < sizeof KEYS / sizeof *KEYS; i++) {
        const config_setting_t *at = option_find(group, KEYS[i].key);
        if (at != NULL && !removes)
            return option_fail(source, at, "%s means something for a remover only", KEYS[i].key);
        if (at != NULL && tool->removes != REMOVER_NONE && !(KEYS[i].of >> tool->removes & 1))
            return option_fail(source, at, "%s means nothing for a remover by %s", KEYS[i].key,
                               scene_remover_name(tool->removes));
    }
    if (!removes)
        return true;
    if (tool->removes == REMOVER_NONE)
        return option_fail(source, group,
                           "remover %d does not say how it removes tissue: removes_by = "
                           "\"suction\", \"drill\" or \"diathermy\"",
                           tool->id);
    if (mouth == NULL)
        return option_fail(source, group, "remover %d has no mouth: { radius = ...; }", tool->id);
    if (!option_read(&CAPSULE_TABLE, mouth, source, &tool->mouth))
        return false;
    if (!option_given(mouth, "to"))
        tool->mouth.to = tool->mouth.from;
    if (tool->removes != REMOVER_SUCTION && !option_given(group, "rate_mm3_s"))
        tool->rate_mm3_s = 0.0; // no limit
    if (tool->removes != REMOVER_DRILL)
        return true;
    // A burr pushes, too.
    if (tool->capsule_count == TOOL_SHAPES)
        return option_fail(source, option_find(group, "capsules"),
                           "capsules has %d entries, at most %d of a drill: its burr is one more",
                           TOOL_SHAPES, TOOL_SHAPES - 1);
    tool->capsule[tool->capsule_count++] = tool->mouth;
    return true;
}

bool scene_read_tool(const SceneReader *reader, const config_setting_t *group, ToolOptions *tool)
{
    ToolGroup raw = {0};
    const OptionSource *source = &reader->source;
    if (!option_read(&TOOL_TABLE, group, source, &raw))
        return false;
    *tool = raw.tool;
    // Its shape.
    if (!read_capsules(reader, raw.capsules, tool))
        return false;
    tool->has_friction = option_given(group, "friction");
    tool->has_plane = raw.plane != NULL;
    if (raw.plane != NULL) {
        if (!option_read(&PLANE_TABLE, raw.plane, source, &tool->plane))
            return false;
        tool->plane.normal = vec3_unit(tool->plane.normal);
    }
    // Refuse keys that have no effect for this kind of tool.
    const char *kind = KIND_WORDS[tool->kind].word;
    bool moved = tool->kind != TOOL_STATIC;
    if (moved && tool->has_plane)
        return option_fail(source, raw.plane, "plane means nothing for a %s, only for kind static",
                           kind);
    static const char *const GRIP[] = {"grip_stiffness", "grip_damping_ratio"};
    for (int i = 0; i < 2; i++)
        if (tool->kind != TOOL_GRASPER && option_given(group, GRIP[i]))
            return option_fail(source, option_find(group, GRIP[i]),
                               "%s means something for a grasper only", GRIP[i]);
    static const char *const MOVED[] = {"max_force", "lag", "fastest"};
    for (int i = 0; i < 3; i++)
        if (!moved && option_given(group, MOVED[i]))
            return option_fail(source, option_find(group, MOVED[i]),
                               "%s means nothing for a static tool: it never %s", MOVED[i],
                               i == 0 ? "yields" : "moves");
    if (!read_edge(reader, group, raw.edge, tool))
        return false;
    if (!read_mouth(reader, group, raw.mouth, tool))
        return false;
    // Every tool but blades and removers needs a shape to collide with.
    if (tool->kind != TOOL_BLADE && tool->kind != TOOL_REMOVER && tool->capsule_count == 0 &&
        !tool->has_plane)
        return option_fail(source, group, "tool %d has no shape: give it capsules%s", tool->id,
                           moved ? "" : " or a plane");
    return true;
}
