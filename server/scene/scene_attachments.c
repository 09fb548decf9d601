// Reads one entry of `attachments` and chooses the integrator of joined bodies.
#include "scene/scene_parts.h"

#include <limits.h>

typedef struct AttachmentGroup {
    AttachmentOptions options; // first: offsets of rows are the same in AttachmentOptions
    const char *body, *to_body;
    int to, tool;
    RegionGroup region;
} AttachmentGroup;

static const OptionWord TO_WORDS[] = {{"world", ATTACH_WORLD}, {NULL, 0}};

#define AT(member) offsetof(AttachmentGroup, member)
static const Option ATTACHMENT_OPTIONS[] = {
    {"body", OPTION_NAME, AT(body), "", .high = SCENE_WORD_MAX, .preset_text = "none",
     .required = true, .about = "The body whose nodes are attached."},
    {"box", OPTION_LIST, AT(region.box), "m",
     .about = "Two opposite corners, `([x, y, z], [x, y, z])`, the lower one first; faces "
              "included."},
    {"sphere", OPTION_VECTOR, AT(region.sphere), "m", 0.0, POSITION_LIMIT, .preset_text = "none",
     .about = "Centre of a ball; requires `radius`."},
    {"radius", OPTION_REAL, AT(region.radius), "m", 0.0, POSITION_LIMIT, .open = true,
     .preset_text = "none", .about = "Radius of the ball."},
    {"nodes", OPTION_LIST, AT(region.nodes), "",
     .about = "Node numbers as in `bodies.fixed`, on the outer surface of the body."},
    {"to", OPTION_WORD, AT(to), "", .words = TO_WORDS, .preset_text = "none",
     .about = "To the world: the nodes are attached to their positions at the start."},
    {"tool", OPTION_INT, AT(tool), "", 0.0, INT_MAX, .preset_text = "none",
     .about = "To the tool with this id, while it is active: at their positions relative to it "
              "when it becomes active."},
    {"to_body", OPTION_NAME, AT(to_body), "", .high = SCENE_WORD_MAX, .preset_text = "none",
     .about = "To the nearest points of this other body."},
    {"stiffness", OPTION_REAL, AT(options.stiffness), "", 0.0, 1e3, .open = true, .preset = 0.3,
     .physics = true,
     .about = "Stiffness of the springs, as a share of the body's own stiffness; stiffer springs "
              "shorten the time step."},
    {"damping_ratio", OPTION_REAL, AT(options.damping_ratio), "", 0.0, 1e3, .preset = 0.5,
     .physics = true,
     .about = "Damping ratio of the springs with the attached masses: 1 is critical."},
};
#undef AT
const OptionTable ATTACHMENT_TABLE = OPTION_TABLE(
    "attachments",
    "Springs that attach the nodes of a region, one of `box`, `sphere` with `radius`, and `nodes`, "
    "to one of `to = \"world\"`, `tool = id` and `to_body = \"name\"`. Only nodes of the outer "
    "surface.",
    ATTACHMENT_OPTIONS);

static bool find_tool(const SceneReader *reader, const config_setting_t *at, int id, int *tool)
{
    const Scene *scene = reader->scene;
    for (*tool = 0; *tool < scene->tool_count; ++*tool)
        if (scene->tool[*tool].id == id)
            return true;
    return option_fail(&reader->source, at, "tool %d is not in the scene", id);
}

static bool is_automatic(const SceneBody *body)
{
    return body->model == MODEL_SURFACE && body->surface.automatic;
}

// Finds the two bodies of a joint; returns false for an attachment to anything else.
static bool find_joint(const Scene *scene, int index, SceneBody *both[2])
{
    const AttachmentOptions *options = &scene->attachment[index].options;
    if (options->to != ATTACH_BODY)
        return false;
    both[0] = &scene->body[options->body];
    both[1] = &scene->body[options->to_body];
    return true;
}

// True if a body without an integrator of its own takes that of a joined one: the one that the
// other was given, else the default of surface bodies, which voxel bodies support too.
static bool take_integrator(SceneBody *body, SceneBody *other)
{
    IntegratorKind *own = &body->options.integrator, kind = other->options.integrator;
    const bool has = body->model == MODEL_SURFACE || integrator_is_symplectic(kind);
    const bool takes = other->any_integrator ? *own != kind && kind == INTEGRATOR_LEAPFROG : has;
    if (!body->any_integrator || !takes)
        return false;
    *own = kind;
    body->any_integrator = other->any_integrator;
    return true;
}

static void share_integrators(const Scene *scene)
{
    SceneBody *both[2];
    for (bool again = true; again;) {
        again = false;
        for (int i = 0; i < scene->attachment_count; i++)
            if (find_joint(scene, i, both) &&
                (take_integrator(both[0], both[1]) || take_integrator(both[1], both[0])))
                again = true;
    }
}

bool scene_join_bodies(const SceneReader *reader, const config_setting_t *list)
{
    const Scene *scene = reader->scene;
    SceneBody *both[2];
    share_integrators(scene);
    for (int i = 0; i < scene->attachment_count; i++) {
        if (!find_joint(scene, i, both))
            continue;
        IntegratorKind kind[2] = {both[0]->options.integrator, both[1]->options.integrator};
        const bool chooses = is_automatic(both[0]) || is_automatic(both[1]);
        if (!chooses && kind[0] != kind[1]) // sim.c compares otherwise
            return option_fail(
                &reader->source, option_find(config_setting_get_elem(list, (unsigned)i), "to_body"),
                "to_body: bodies \"%s\" (%s) and \"%s\" (%s) must have one integrator",
                both[0]->name, integrator_name(kind[0]), both[1]->name, integrator_name(kind[1]));
    }
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
    *options = raw.options;
    options->tool = options->to_body = -1;
    attachment->line = (int)config_setting_source_line(group);
    options->body = scene_find_body(reader, option_find(group, "body"), raw.body);
    if (options->body < 0)
        return false;
    if (!scene_read_region(reader, group, &raw.region, "attachments", &options->region))
        return false;
    // Exactly one target: the world, a tool or another body.
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
    return options->to_body >= 0 &&
           (options->to_body != options->body ||
            option_fail(source, at, "to_body \"%s\" is the body itself", raw.to_body));
}
