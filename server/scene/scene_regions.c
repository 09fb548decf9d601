// SPDX-License-Identifier: MIT
// Reads the lists that select nodes of bodies: what is fixed, attached or loaded, and chooses the
// integrator of joined bodies.
#include "scene/scene_parts.h"

#include "base/check.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

// --- `fixed` of a body: boxes, spheres and node numbers that do not move -------------------------

enum { FIXED_REGIONS = 1024 };

static const Option FIXED_OPTIONS[] = {
    {"box", OPTION_LIST, offsetof(RegionGroup, box), "m",
     .about = "Two opposite corners, `([x, y, z], [x, y, z])`, the lower one first; faces "
              "included."},
    {"sphere", OPTION_VECTOR, offsetof(RegionGroup, sphere), "m", 0.0, POSITION_LIMIT,
     .preset_text = "none", .about = "Centre of a ball; requires `radius`."},
    {"radius", OPTION_REAL, offsetof(RegionGroup, radius), "m", 0.0, POSITION_LIMIT, .open = true,
     .preset_text = "none", .about = "Radius of the ball."},
    {"nodes", OPTION_LIST, offsetof(RegionGroup, nodes), "",
     .about = "Node numbers of the mesh file or generator, from 0; for a voxel body, lattice "
              "points, as `id` in messages."},
};
const OptionTable FIXED_TABLE = OPTION_TABLE(
    "bodies.fixed",
    "Nodes that are inside a region at the start are fixed. Each entry is one "
    "of `{ box = ... }`, `{ sphere = ...; radius = ...; }` and `{ nodes = [ ... ]; }`.",
    FIXED_OPTIONS);

// Corners may be far outside of any mesh: "everything below".
static const Option CORNER = {.key = "box", .type = OPTION_VECTOR, .high = 1e12};
static const Option NODE = {.key = "nodes", .type = OPTION_INT, .high = 1 << 28};

static bool read_box(const SceneReader *reader, const config_setting_t *list, FixedRegion *region)
{
    const OptionSource *source = &reader->source;
    if (option_length(list) != 2)
        return option_fail(source, list, "box must be two corners ([x, y, z], [x, y, z])");
    region->kind = FIXED_BOX;
    // Two corners, the lower one first.
    if (!option_read_vector(config_setting_get_elem(list, 0), &CORNER, source, &region->low) ||
        !option_read_vector(config_setting_get_elem(list, 1), &CORNER, source, &region->high))
        return false;
    if (region->low.x > region->high.x || region->low.y > region->high.y ||
        region->low.z > region->high.z)
        return option_fail(source, list, "box is empty: its first corner must be the lower one");
    return true;
}

static bool read_nodes(const SceneReader *reader, const config_setting_t *list, FixedRegion *region)
{
    int count = option_length(list);
    if (count == 0)
        return option_fail(&reader->source, list, "nodes is empty");
    // The region owns the list, also after a failure.
    int *node = calloc((size_t)count, sizeof *node);
    ASSERT(node != NULL);
    region->kind = FIXED_NODES;
    region->node = node;
    region->node_count = count;
    for (int i = 0; i < count; i++)
        if (!option_read_int(config_setting_get_elem(list, (unsigned)i), &NODE, &reader->source,
                             &node[i]))
            return false;
    return true;
}

bool scene_read_region(const SceneReader *reader, const config_setting_t *group,
                       const RegionGroup *raw, const char *list, FixedRegion *region)
{
    const OptionSource *source = &reader->source;
    // An entry is of one kind alone.
    bool sphere = option_given(group, "sphere"), radius = option_given(group, "radius");
    if ((raw->box != NULL) + (raw->nodes != NULL) + (sphere || radius) != 1)
        return option_fail(source, group,
                           "%s entry must be one of { box }, { sphere; radius } and { nodes }",
                           list);
    if (raw->box != NULL)
        return read_box(reader, raw->box, region);
    if (raw->nodes != NULL)
        return read_nodes(reader, raw->nodes, region);
    // A ball needs both.
    if (!sphere || !radius)
        return option_fail(source, group, "%s %s is missing: a ball has a sphere and a radius",
                           list, sphere ? "radius" : "sphere");
    region->kind = FIXED_SPHERE;
    region->center = raw->sphere;
    region->radius = raw->radius;
    return true;
}

static bool read_region(const SceneReader *reader, const config_setting_t *group,
                        FixedRegion *region)
{
    RegionGroup raw = {0};
    return option_read(&FIXED_TABLE, group, &reader->source, &raw) &&
           scene_read_region(reader, group, &raw, "fixed", region);
}

bool scene_read_fixed(const SceneReader *reader, const config_setting_t *list, SceneBody *body)
{
    int count = option_length(list);
    if (count == 0)
        return true;
    if (count > FIXED_REGIONS)
        return option_fail(&reader->source, list, "fixed has %d entries, at most %d", count,
                           FIXED_REGIONS);
    // The body owns what was read, also after a failure.
    FixedRegion *fixed = calloc((size_t)count, sizeof *fixed);
    ASSERT(fixed != NULL);
    body->options.fixed = fixed;
    body->options.fixed_count = count;
    for (int i = 0; i < count; i++) {
        const config_setting_t *group = option_group_at(list, i, &reader->source);
        if (group == NULL || !read_region(reader, group, &fixed[i]))
            return false;
    }
    return true;
}

// --- `weights` of a body -------------------------------------------------------------------------

typedef struct WeightGroup {
    RegionGroup region; // first: offsets of rows are the same in a RegionGroup
    double mass;
} WeightGroup;

static const Option WEIGHT_OPTIONS[] = {
    {"box", OPTION_LIST, offsetof(WeightGroup, region.box), "m",
     .about = "Two opposite corners, `([x, y, z], [x, y, z])`, the lower one first; faces "
              "included."},
    {"sphere", OPTION_VECTOR, offsetof(WeightGroup, region.sphere), "m", 0.0, POSITION_LIMIT,
     .preset_text = "none", .about = "Centre of a ball; requires `radius`."},
    {"radius", OPTION_REAL, offsetof(WeightGroup, region.radius), "m", 0.0, POSITION_LIMIT,
     .open = true, .preset_text = "none", .about = "Radius of the ball."},
    {"nodes", OPTION_LIST, offsetof(WeightGroup, region.nodes), "",
     .about = "Lattice points, as `id` in messages."},
    {"mass", OPTION_REAL, offsetof(WeightGroup, mass), "kg", 0.0, 1e6, .required = true,
     .about = "Shared equally by the vertices, which gravity then pulls by as much more."},
};
const OptionTable WEIGHT_TABLE = OPTION_TABLE(
    "bodies.weights",
    "A mass on the vertices that are inside a region at the start. Each entry is one of `{ box = "
    "...; mass = ...; }`, `{ sphere = ...; radius = ...; mass = ...; }` and `{ nodes = [ ... ]; "
    "mass = ...; }`.",
    WEIGHT_OPTIONS);

bool scene_read_weights(const SceneReader *reader, const config_setting_t *list, SceneBody *body)
{
    const OptionSource *source = &reader->source;
    const int count = option_length(list);
    if (count == 0)
        return true;
    if (body->model == MODEL_PLANE)
        return option_fail(source, list, "weights means nothing for a plane body");
    if (body->options.cuttable)
        return option_fail(source, list, "weights cannot be mixed with cuttable");
    if (count > FIXED_REGIONS)
        return option_fail(source, list, "weights has %d entries, at most %d", count,
                           FIXED_REGIONS);
    // The body owns what was read, also after a failure.
    body->weight = calloc((size_t)count, sizeof *body->weight);
    ASSERT(body->weight != NULL);
    body->voxel.weight = body->weight;
    body->voxel.weight_count = count;
    for (int i = 0; i < count; i++) {
        WeightGroup raw = {.mass = 0.0};
        const config_setting_t *group = option_group_at(list, i, source);
        if (group == NULL || !option_read(&WEIGHT_TABLE, group, source, &raw) ||
            !scene_read_region(reader, group, &raw.region, "weights", &body->weight[i].region))
            return false;
        body->weight[i].mass = raw.mass;
    }
    return true;
}

// --- one entry of `attachments` ------------------------------------------------------------------

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
    return option_fail(&reader->source, at,
                       "tool %d is not in the scene: tools = ( { id = %d; ... } )", id, id);
}

static bool is_automatic(const SceneBody *body)
{
    return body->model == MODEL_SURFACE && body->surface.automatic;
}

// Finds the two bodies of a joint, or past the attachments those that touch; returns false for an
// attachment to anything else.
static bool find_joint(const Scene *scene, int index, SceneBody *both[2])
{
    if (index >= scene->attachment_count) {
        const TouchOptions *touch = &scene->touch[index - scene->attachment_count].options;
        both[0] = &scene->body[touch->body[0]];
        both[1] = &scene->body[touch->body[1]];
        return true;
    }
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
        for (int i = 0; i < scene->attachment_count + scene->touch_count; i++)
            if (find_joint(scene, i, both) &&
                (take_integrator(both[0], both[1]) || take_integrator(both[1], both[0])))
                again = true;
    }
}

bool scene_join_bodies(const SceneReader *reader, const config_setting_t *attachments,
                       const config_setting_t *touch)
{
    const Scene *scene = reader->scene;
    SceneBody *both[2];
    // Bodies that choose take the integrator of those that do not.
    share_integrators(scene);
    // What is left must agree: joined bodies are stepped together.
    for (int i = 0; i < scene->attachment_count + scene->touch_count; i++) {
        const int of_touch = i - scene->attachment_count;
        if (!find_joint(scene, i, both))
            continue;
        IntegratorKind kind[2] = {both[0]->options.integrator, both[1]->options.integrator};
        const bool chooses = is_automatic(both[0]) || is_automatic(both[1]);
        if (chooses || kind[0] == kind[1]) // sim.c compares otherwise
            continue;
        const config_setting_t *at =
            of_touch < 0
                ? option_find(config_setting_get_elem(attachments, (unsigned)i), "to_body")
                : option_find(config_setting_get_elem(touch, (unsigned)of_touch), "bodies");
        return option_fail(&reader->source, at,
                           "%s: bodies \"%s\" (%s) and \"%s\" (%s) must have one integrator",
                           of_touch < 0 ? "to_body" : "bodies", both[0]->name,
                           integrator_name(kind[0]), both[1]->name, integrator_name(kind[1]));
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
    // Which nodes of which body.
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
    // Find it by its name.
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

// --- one entry of `touch` ------------------------------------------------------------------------

typedef struct TouchGroup {
    TouchOptions options; // first: offsets of rows are the same in TouchOptions
    const config_setting_t *bodies;
} TouchGroup;

#define AT(member) offsetof(TouchGroup, member)
static const Option TOUCH_OPTIONS[] = {
    {"bodies", OPTION_LIST, AT(bodies), "", .preset_text = "none", .required = true,
     .about = "The names of two bodies, `[\"a\", \"b\"]`, or of one, `[\"a\"]`, that then touches "
              "itself: the pieces that it is cut into, its folds and flaps, and a solid's lips of "
              "cuts."},
    {"stiffness", OPTION_REAL, AT(options.stiffness), "", 0.0, 1e3, .open = true, .preset = 2.0,
     .physics = true,
     .about = "Stiffness of the contact, as a share of the softer body's own stiffness; stiffer "
              "contact shortens the time step."},
    {"friction", OPTION_REAL, AT(options.friction), "", 0.0, 10.0, .physics = true,
     .about = "Coefficient of friction between the surfaces."},
    {"thickness", OPTION_REAL, AT(options.thickness), "m", 0.0, POSITION_LIMIT, .preset = -1.0,
     .preset_text = "0; of a hollow body with itself a tenth of its longest edge", .physics = true,
     .about =
         "Distance at which the surfaces rest on each other: walls as thick as that, at most as "
         "the longest edge. In the folds of a hollow body each node is at most half as thick as "
         "the faces around it are wide."},
};
#undef AT
const OptionTable TOUCH_TABLE = OPTION_TABLE("touch",
                                             "Contact between two bodies, which are then stepped "
                                             "together, with one integrator, or of a body "
                                             "with itself. Not for plane bodies.",
                                             TOUCH_OPTIONS);

// Finds the body that entry `index` of `bodies` names; -1 with a status.
static int find_touched(const SceneReader *reader, const config_setting_t *list, int index)
{
    const config_setting_t *at = config_setting_get_elem(list, (unsigned)index);
    const char *name = config_setting_get_string(at);
    if (name == NULL) {
        option_fail(&reader->source, at, "bodies is no list of names");
        return -1;
    }
    const int body = scene_find_body(reader, at, name);
    if (body >= 0 && reader->scene->body[body].model == MODEL_PLANE) {
        option_fail(&reader->source, at, "bodies: \"%s\" is a plane body, which touches nothing",
                    name);
        return -1;
    }
    return body;
}

bool scene_read_touch(const SceneReader *reader, const config_setting_t *group, SceneTouch *touch)
{
    TouchGroup raw = {0};
    const OptionSource *source = &reader->source;
    const Scene *scene = reader->scene;
    if (!option_read(&TOUCH_TABLE, group, source, &raw))
        return false;
    touch->options = raw.options;
    touch->line = (int)config_setting_source_line(group);
    const int count = option_length(raw.bodies);
    if (count != 1 && count != 2)
        return option_fail(source, raw.bodies, "bodies has %d names: it must have one or two",
                           count);
    int *body = touch->options.body;
    for (int i = 0; i < count; i++)
        if ((body[i] = find_touched(reader, raw.bodies, i)) < 0)
            return false;
    if (count == 1)
        body[1] = body[0];
    else if (body[0] == body[1])
        return option_fail(source, raw.bodies,
                           "bodies: \"%s\" is named twice: [\"%s\"] alone lets it touch itself",
                           scene->body[body[0]].name, scene->body[body[0]].name);
    // Each pair once: twice would be twice as stiff.
    for (const SceneTouch *other = scene->touch; other < touch; other++)
        if ((other->options.body[0] == body[0] && other->options.body[1] == body[1]) ||
            (other->options.body[0] == body[1] && other->options.body[1] == body[0]))
            return option_fail(source, raw.bodies, "bodies: these touch already, by line %d",
                               other->line);
    return true;
}

// --- one entry of `loads` ------------------------------------------------------------------------

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
    // The one that is meant, or a name near it for the error.
    for (int i = 0; i < scene->body_count; i++) {
        if (strcmp(scene->body[i].name, name) == 0)
            return i;
        if (option_is_near(name, scene->body[i].name))
            nearest = scene->body[i].name;
    }
    // Where none is near, all of them, as far as there is room.
    char names[200] = "";
    size_t used = 0;
    for (int i = 0; nearest == NULL && i < scene->body_count && used < sizeof names; i++)
        used += (size_t)snprintf(names + used, sizeof names - used, "%s%s", i > 0 ? ", " : "",
                                 scene->body[i].name);
    option_fail(&reader->source, at, "body \"%s\" is not in the scene: %s%s%s", name,
                nearest != NULL ? "did you mean \"" : "its bodies are ",
                nearest != NULL ? nearest : names, nearest != NULL ? "\"?" : "");
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
    // Without a name the load acts on all bodies.
    if (name == NULL || raw.body[0] == '\0')
        return true;
    load->body = scene_find_body(reader, name, raw.body);
    return load->body >= 0;
}
