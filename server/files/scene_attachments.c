// Reads one entry of `attachments`.
#include "files/scene_parts.h"

#include <limits.h>

typedef struct AttachmentGroup {
    const char *body, *to_body;
    int to, tool;
    RegionGroup region;
    double stiffness, damping_ratio;
} AttachmentGroup;

static const OptionWord TO_WORDS[] = {{"world", ATTACH_WORLD, NULL}, {NULL, 0, NULL}};

#define AT(member) offsetof(AttachmentGroup, member)
static const Option ATTACHMENT_OPTIONS[] = {
    {"body", OPTION_NAME, AT(body), "", .high = SCENE_WORD_MAX, .preset_text = "none",
     .required = true, .about = "The body whose nodes are held."},
    {"box", OPTION_LIST, AT(region.box), "m",
     .about = "Two opposite corners, `([x, y, z], [x, y, z])`, the lower one first; faces "
              "included."},
    {"sphere", OPTION_VECTOR, AT(region.sphere), "m", 0.0, POSITION_LIMIT, .preset_text = "none",
     .about = "Centre of a ball; goes with `radius`."},
    {"radius", OPTION_REAL, AT(region.radius), "m", 0.0, POSITION_LIMIT, .open = true,
     .preset_text = "none", .about = "Radius of the ball."},
    {"nodes", OPTION_LIST, AT(region.nodes), "",
     .about = "Node numbers as in `bodies.fixed`, on the outside of the body."},
    {"to", OPTION_WORD, AT(to), "", .words = TO_WORDS, .preset_text = "none",
     .about = "To the world: the nodes are held where they are at the start."},
    {"tool", OPTION_INT, AT(tool), "", 0.0, INT_MAX, .preset_text = "none",
     .about = "To the tool of this id, held while it is active, where they are when it becomes "
              "so."},
    {"to_body", OPTION_NAME, AT(to_body), "", .high = SCENE_WORD_MAX, .preset_text = "none",
     .about = "To the nearest points of this other body."},
    {"stiffness", OPTION_REAL, AT(stiffness), "", 0.0, 1e3, .open = true, .preset = 0.3,
     .about = "Of the springs, as a share of the body's own stiffness; the time step gets shorter "
              "with it."},
    {"damping_ratio", OPTION_REAL, AT(damping_ratio), "", 0.0, 1e3, .preset = 0.5,
     .about = "Of the springs and the masses that they hold: 1 is critical."},
};
#undef AT
const OptionTable ATTACHMENT_TABLE = OPTION_TABLE(
    "attachments",
    "Springs that hold the nodes of a region, one of `box`, `sphere` with `radius`, and `nodes`, "
    "to one of `to = \"world\"`, `tool = id` and `to_body = \"name\"`. Nodes of the outside only.",
    ATTACHMENT_OPTIONS);

static bool find_tool(const SceneReader *reader, const config_setting_t *at, int id, int *tool)
{
    const Scene *scene = reader->scene;
    for (*tool = 0; *tool < scene->tool_count; ++*tool)
        if (scene->tool[*tool].id == id)
            return true;
    return option_fail(&reader->source, at, "tool %d is not in the scene", id);
}

// Bodies that are joined are stepped together.
static bool check_joint(const SceneReader *reader, const config_setting_t *at,
                        const AttachmentOptions *options)
{
    const SceneBody *body = &reader->scene->body[options->body];
    const SceneBody *other = &reader->scene->body[options->to_body];
    if (options->body == options->to_body)
        return option_fail(&reader->source, at, "to_body \"%s\" is the body itself", body->name);
    IntegratorKind kind[2];
    const SceneBody *both[2] = {body, other};
    for (int i = 0; i < 2; i++)
        kind[i] =
            both[i]->model == MODEL_VOXEL ? both[i]->voxel.integrator : both[i]->surface.integrator;
    const bool chooses = body->surface.automatic || other->surface.automatic; // sim.c compares then
    if (!chooses && kind[0] != kind[1])
        return option_fail(&reader->source, at,
                           "to_body: bodies \"%s\" (%s) and \"%s\" (%s) must have one integrator",
                           body->name, integrator_name(kind[0]), other->name,
                           integrator_name(kind[1]));
    return true;
}

bool scene_read_attachment(const SceneReader *reader, const config_setting_t *group,
                           SceneAttachment *attachment)
{
    AttachmentGroup raw = {0};
    const OptionSource *source = &reader->source;
    AttachmentOptions *options = &attachment->options;
    if (!option_read(&ATTACHMENT_TABLE, group, source, &raw))
        return false;
    *options = (AttachmentOptions){
        .tool = -1, .to_body = -1, .stiffness = raw.stiffness, .damping_ratio = raw.damping_ratio};
    attachment->line = (int)config_setting_source_line(group);
    options->body = scene_find_body(reader, option_find(group, "body"), raw.body);
    if (options->body < 0)
        return false;
    if (!scene_read_region(reader, group, &raw.region, "attachments", &options->region))
        return false;
    bool to = option_given(group, "to"), tool = option_given(group, "tool"),
         to_body = option_given(group, "to_body");
    if (to + tool + to_body != 1)
        return option_fail(
            source, group,
            "attachments entry must hold to one of to = \"world\", tool = id and to_body = name");
    options->to = to ? ATTACH_WORLD : tool ? ATTACH_TOOL : ATTACH_BODY;
    if (tool)
        return find_tool(reader, option_find(group, "tool"), raw.tool, &options->tool);
    if (to)
        return true;
    const config_setting_t *at = option_find(group, "to_body");
    options->to_body = scene_find_body(reader, at, raw.to_body);
    return options->to_body >= 0 && check_joint(reader, at, options);
}
