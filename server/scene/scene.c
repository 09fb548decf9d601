// SPDX-License-Identifier: MIT
// Reads a scene file: the keys of the scene itself, then its bodies, tools and loads. Called once,
// at load time; builds nothing and opens no file but the scene's.
#include "scene/scene.h"

#include "base/check.h"
#include "scene/scene_parts.h"

#include <stdlib.h>
#include <string.h>

enum { CHANNEL_MAX = 63 }; // characters of a channel name that LCM accepts

typedef struct SceneGroup {
    Scene scene; // first: offsets of rows are the same in a Scene
    const char *name, *prefix, *input_prefix, *lcm_url, *prepared;
    int late;
    const config_setting_t *publish, *capacity, *bodies, *tools, *attachments, *touch, *loads,
        *score;
} SceneGroup;

enum { ONLY_WORD };

static const OptionWord PRECISION_WORDS[] = {
    {"single", PRECISION_SINGLE}, {"double", PRECISION_DOUBLE}, {NULL, 0}};
static const OptionWord LATE_WORDS[] = {{"skip", ONLY_WORD}, {NULL, 0}};
static const OptionWord START_WORDS[] = {
    {"running", START_RUNNING}, {"paused", START_PAUSED}, {NULL, 0}};
static const OptionWord POSITIONS_WORDS[] = {{"floats", POSITIONS_FLOATS},
                                             {"packets", POSITIONS_PACKETS},
                                             {"both", POSITIONS_BOTH},
                                             {NULL, 0}};
static const OptionWord NODES_WORDS[] = {{"surface", NODES_SURFACE}, {"all", NODES_ALL}, {NULL, 0}};

static bool has_stage(const OptionPlace *place, StageId stage)
{
    for (int i = 0; i < sim_stage_count(place->world->sim); i++)
        if (sim_stage(place->world->sim, i) == stage)
            return true;
    return false;
}

static bool has_estimate(const OptionPlace *place)
{
    return has_stage(place, STAGE_ESTIMATE);
}

static bool has_errors(const OptionPlace *place)
{
    return place->scene->publish.error_hz > 0.0; // its stage serves bodies that are driven, too
}

static bool has_contact(const OptionPlace *place)
{
    return !IDLE_MEETS_NO_TOOL.holds(place);
}

#define AT(member) offsetof(SceneGroup, member)
static const Option SCENE_OPTIONS[] = {
    {"name", OPTION_NAME, AT(name), "", .low = 1, .high = SCENE_WORD_MAX, .preset_text = "scene",
     .about = "Name of the scene in status messages and files."},
    {"rate_hz", OPTION_REAL, AT(scene.sim.rate_hz), "Hz", 1.0, 10000.0, .preset = 1000.0,
     .physics = true, .about = "Ticks per second: how often tools move and contacts are found."},
    {"gravity", OPTION_VECTOR, AT(scene.sim.gravity), "m/s2", 0.0, 1e4, .physics = true,
     .live = "gravity", .feature = {.name = "gravity"},
     .about = "Acceleration of every node, world frame."},
    {"threads", OPTION_INT, AT(scene.threads), "", 1.0, TEAM_THREADS_MOST, .preset = 1.0,
     .feature = {.name = "more threads for a step"},
     .about = "Threads that compute one step, each on its own processor: useful from a few "
              "thousand nodes on, and only if no other program needs these processors. Results are "
              "bit-identical for any number."},
    {"precision", OPTION_WORD, AT(scene.precision), "", .words = PRECISION_WORDS,
     .preset = PRECISION_SINGLE,
     .about = "Precision of the bodies' arithmetic: single is fast and computes displacements to "
              "about 1e-6 of the largest; double is the reference."},
    {"prefix", OPTION_NAME, AT(prefix), "", .low = 1, .high = SCENE_WORD_MAX,
     .preset_text = "PLIANT",
     .about = "First part of the name of every channel on which the daemon publishes."},
    {"input_prefix", OPTION_NAME, AT(input_prefix), "", .low = 1, .high = SCENE_WORD_MAX,
     .preset_text = "as prefix",
     .about = "First part of the name of every channel to which the daemon listens; several "
              "daemons may share it."},
    {"lcm_url", OPTION_STRING, AT(lcm_url), "", .low = 1, .high = 255, .preset_text = "LCM's own",
     .about = "LCM network, unless the command line names one. `&interface=eth1` (a name or an "
              "address) in it chooses the interface."},
    {"remote", OPTION_BOOL, AT(scene.remote), "",
     .about = "Whether messages from other hosts are accepted; otherwise only those of programs on "
              "this host are, and others are refused. Replies to other hosts require an `lcm_url` "
              "with `ttl=1`."},
    {"stop_command", OPTION_BOOL, AT(scene.stop_command), "", .preset = 1.0,
     .about = "Whether the command STOP ends the daemon; otherwise it is refused."},
    {"publish", OPTION_GROUP, AT(publish), "", .preset_text = "its defaults",
     .about = "What is published, and how often."},
    {"late", OPTION_WORD, AT(late), "", .words = LATE_WORDS,
     .about = "Deprecated, without effect: a tick that cannot begin in time is skipped and "
              "counted."},
    {"start", OPTION_WORD, AT(scene.start), "", .words = START_WORDS,
     .about = "Whether time runs at once or waits for a RESUME or STEP command."},
    {"estimate_error", OPTION_BOOL, AT(scene.sim.estimate_error), "",
     .feature = {.name = "error of the time steps in status", has_estimate},
     .about = "Whether a live run reports the error of its time steps (`body_status_t`): in the "
              "spare time of ticks, steps are tried whole and in two halves. The motion is "
              "bit-identical with and without it."},
    {"tool_timeout_s", OPTION_REAL, AT(scene.sim.tool_timeout_s), "s", 0.0, 3600.0, .open = true,
     .preset = 0.2, .physics = true, .idle = {&IDLE_MOVES_NO_TOOL},
     .about = "A tool whose newest pose is older is withdrawn."},
    {"settle_s", OPTION_REAL, AT(scene.settle_s), "s", 0.0, 3600.0,
     .feature = {.name = "settling before the first tick"},
     .about = "Time simulated before the first tick, so that the bodies are at rest under gravity "
              "and prestress."},
    {"capacity", OPTION_GROUP, AT(capacity), "", .preset_text = "from the meshes and levels",
     .about = "Largest number of nodes and faces that a body may have at a time."},
    {"prepared", OPTION_STRING, AT(prepared), "", .low = 1, .high = SCENE_FILE_MAX,
     .preset_text = "meshes and voxels are built at load",
     .about = "File that `pliant-prepare` made from this scene: meshes, their levels and voxels "
              "are read from it. Only `mesh` and `levels` of surface bodies and `voxels` of voxel "
              "bodies must be unchanged since."},
    {"bodies", OPTION_LIST, AT(bodies), "", .required = true,
     .about = "The soft bodies: 1 to 64 groups."},
    {"tools", OPTION_LIST, AT(tools), "", .feature = {.name = "contact", has_contact},
     .about = "The tools: up to 32 groups."},
    {"attachments", OPTION_LIST, AT(attachments), "", .feature = {.name = "attachments"},
     .about = "Springs that attach regions of bodies: up to 64 groups."},
    {"max_ties", OPTION_INT, AT(scene.sim.max_ties), "", 0.0, SIM_TIES, .physics = true,
     .feature = {.name = "ties by message"},
     .about = "Largest number of ties that messages may make at a time (`tie_t`, `pliant-tie`): "
              "pins to the world, ties between bodies, clips, and what tools carry. Their memory "
              "is reserved at load."},
    {"touch", OPTION_LIST, AT(touch), "", .feature = {.name = "contact between bodies"},
     .about =
         "Bodies that collide with each other or with themselves: up to 64 groups. Others pass "
         "through one another."},
    {"loads", OPTION_LIST, AT(loads), "", .feature = {.name = "loads of the scene"},
     .about = "Forces at given times: up to 64 groups."},
    {"score", OPTION_GROUP, AT(score), "", .preset_text = "none",
     .about = "What ledger and score sheet of a session judge by."},
};
#undef AT
const OptionTable SCENE_TABLE =
    GIVEN_TABLE("", "Keys at the top level of the file.", SCENE_OPTIONS, offsetof(Scene, given));

#define AT(member) offsetof(ScenePublish, member)
static const Option PUBLISH_OPTIONS[] = {
    {"nodes_hz", OPTION_REAL, AT(nodes_hz), "Hz", 0.0, 10000.0, .follows = true, .preset = 60.0,
     .feature = {.name = "positions in messages"},
     .about = "Frames of node positions per second; 0: never."},
    {"mesh_hz", OPTION_REAL, AT(mesh_hz), "Hz", 0.0, 10000.0, .follows = true, .preset = 1.0,
     .feature = {.name = "meshes in messages"},
     .about = "Whole meshes per second, for clients that join late; 0: only on request."},
    {"contact_hz", OPTION_REAL, AT(contact_hz), "Hz", 0.0, 10000.0, .follows = true,
     .preset = 1000.0, .idle = {&IDLE_HAS_NO_TOOL}, .feature = {.name = "contacts in messages"},
     .about = "Contact messages per second and tool; 0: never."},
    {"status_hz", OPTION_REAL, AT(status_hz), "Hz", 0.0, 10000.0, .follows = true, .preset = 2.0,
     .feature = {.name = "status in messages"}, .about = "Status messages per second; 0: never."},
    {"error_hz", OPTION_REAL, AT(error_hz), "Hz", 0.0, 10000.0, .follows = true,
     .feature = {.name = "error of bodies in messages", has_errors},
     .about =
         "Messages per second, about, with the error of each body's discretisation, in space and "
         "time, and of the force of each tool (`error_t`); 0: never, and nothing is "
         "estimated. It takes up to 4 % of a tick; the motion is bit-identical with and "
         "without it."},
    {"error_map", OPTION_BOOL, AT(error_map), "",
     .idle = {&IDLE_PUBLISHES_NO_ERRORS, &IDLE_HAS_ONLY_PLANES},
     .feature = {.name = "error of nodes in messages"},
     .about = "Whether it is also published where on each body the error is, for viewers: a byte "
              "for each node (`error_map_t`)."},
    {"elements_hz", OPTION_REAL, AT(elements_hz), "Hz", 0.0, 10000.0, .follows = true,
     .idle = {&IDLE_HAS_NO_VOXELS}, .feature = {.name = "elements at surfaces in messages"},
     .about = "How often per second it is published which element is at each square of a voxel "
              "body's surface, at most and only after elements have changed, for viewers "
              "(`elements_t`); 0: never."},
    {"nodes", OPTION_WORD, AT(nodes), "", .words = NODES_WORDS, .idle = {&IDLE_HAS_NO_INSIDE},
     .feature = {.name = "inner vertices in messages"},
     .about = "Which nodes: those of the surface, or all, including those inside voxel bodies."},
    {"positions", OPTION_WORD, AT(positions), "", .words = POSITIONS_WORDS,
     .idle = {&IDLE_PUBLISHES_NO_NODES}, .feature = {.name = "positions in packets"},
     .about = "How positions are sent: as `floats` in chunks of up to 49 kB (`_NODES_`); as "
              "`packets` of at most 1400 bytes, rounded to 7.6 um (`_POINTS_`): about half of the "
              "bytes, and a link that loses packets keeps most nodes fresh; or as `both`."},
    {"velocity", OPTION_BOOL, AT(velocity), "", .idle = {&IDLE_PUBLISHES_NO_NODES},
     .feature = {.name = "velocities in messages"},
     .about = "Whether velocities are published too."},
    {"rest", OPTION_BOOL, AT(rest), "", .feature = {.name = "rest positions in messages"},
     .about = "Whether rest positions of the nodes and the texture coordinates of the mesh file "
              "are published with each whole mesh, for viewers."},
    {"contact_stiffness", OPTION_BOOL, AT(contact_stiffness), "", .preset = 1.0,
     .idle = {&IDLE_HAS_ONLY_PLANES, &IDLE_MOVES_NO_TOOL, &IDLE_PUBLISHES_NO_CONTACTS},
     .feature = {.name = "stiffness in contacts"},
     .about = "Whether contact messages report the body's stiffness at the contact, which haptic "
              "devices behind a network need; it takes up to 4 % of a tick while a probe touches. "
              "Not for plane bodies."},
};
#undef AT
const OptionTable PUBLISH_TABLE = OPTION_TABLE(
    "publish",
    "Rates of the outgoing messages. None may exceed `rate_hz`; a default that does is "
    "lowered to it.",
    PUBLISH_OPTIONS);

static const Option CAPACITY_OPTIONS[] = {
    {"nodes", OPTION_INT, offsetof(Scene, node_capacity), "", 0.0, 1e8,
     .about = "Largest number of nodes of a body; 0: as many as its mesh and levels can have."},
    {"faces", OPTION_INT, offsetof(Scene, face_capacity), "", 0.0, 1e8,
     .about = "Largest number of faces of a body; 0: as many as its mesh and levels can have."},
};
const OptionTable CAPACITY_TABLE = OPTION_TABLE(
    "capacity",
    "A body that does not fit at load is an error; what does not fit later is refused and counted.",
    CAPACITY_OPTIONS);

// Allocates zeroed groups of a list; returns NULL for none or, with a status, for too many.
static void *allocate_groups(const SceneReader *reader, const config_setting_t *list, int limit,
                             size_t size)
{
    int count = option_length(list);
    if (count > limit)
        option_fail(&reader->source, list, "%s has %d entries, at most %d",
                    config_setting_name(list), count, limit);
    if (count > limit || count == 0)
        return NULL;
    void *memory = calloc((size_t)count, size);
    ASSERT(memory != NULL);
    return memory;
}

// Of all channels of a body; LCM refuses longer names.
static size_t longest_channel(const char *prefix, const char *body)
{
    return strlen(prefix) + strlen("_MESH_DELTA_") + strlen(body);
}

static bool read_bodies(const SceneReader *reader, const config_setting_t *list)
{
    Scene *scene = reader->scene;
    if (option_length(list) == 0)
        return option_fail(&reader->source, list, "bodies is empty: at least one body");
    // Each entry is checked against those before it.
    scene->body = allocate_groups(reader, list, SCENE_BODIES, sizeof *scene->body);
    if (scene->body == NULL)
        return false;
    for (int i = 0; i < option_length(list); i++) {
        const config_setting_t *group = option_group_at(list, i, &reader->source);
        SceneBody *body = &scene->body[scene->body_count++];
        if (group == NULL || !scene_read_body(reader, group, body))
            return false;
        // Names are unique, and short enough for every channel that is made of them.
        for (int k = 0; k < i; k++)
            if (strcmp(scene->body[k].name, body->name) == 0)
                return option_fail(&reader->source, option_find(group, "name"),
                                   "name \"%s\" is taken by the body at line %d", body->name,
                                   scene->body[k].line);
        if (longest_channel(scene->prefix, body->name) > CHANNEL_MAX)
            return option_fail(
                &reader->source, option_find(group, "name"),
                "name \"%s\" makes channel %s_MESH_DELTA_%s longer than %d characters", body->name,
                scene->prefix, body->name, CHANNEL_MAX);
    }
    return true;
}

static bool read_tools(const SceneReader *reader, const config_setting_t *list)
{
    Scene *scene = reader->scene;
    scene->tool = allocate_groups(reader, list, SCENE_TOOLS, sizeof *scene->tool);
    if (scene->tool == NULL)
        return option_length(list) == 0;
    // Lines are kept for warnings that come later.
    scene->tool_line = calloc((size_t)option_length(list), sizeof *scene->tool_line);
    ASSERT(scene->tool_line != NULL);
    for (int i = 0; i < option_length(list); i++) {
        const config_setting_t *group = option_group_at(list, i, &reader->source);
        ToolOptions *tool = &scene->tool[scene->tool_count++];
        if (group == NULL || !scene_read_tool(reader, group, tool))
            return false;
        scene->tool_line[i] = (int)config_setting_source_line(group);
        // Messages name a tool by its id.
        for (int k = 0; k < i; k++)
            if (scene->tool[k].id == tool->id)
                return option_fail(&reader->source, option_find(group, "id"),
                                   "id %d is taken by another tool", tool->id);
    }
    return true;
}

static bool read_attachments(const SceneReader *reader, const config_setting_t *list)
{
    Scene *scene = reader->scene;
    scene->attachment = allocate_groups(reader, list, SCENE_ATTACHMENTS, sizeof *scene->attachment);
    if (scene->attachment == NULL)
        return option_length(list) == 0;
    for (int i = 0; i < option_length(list); i++) {
        const config_setting_t *group = option_group_at(list, i, &reader->source);
        if (group == NULL ||
            !scene_read_attachment(reader, group, &scene->attachment[scene->attachment_count++]))
            return false;
    }
    return true;
}

static bool read_touches(const SceneReader *reader, const config_setting_t *list)
{
    Scene *scene = reader->scene;
    scene->touch = allocate_groups(reader, list, SCENE_TOUCHES, sizeof *scene->touch);
    if (scene->touch == NULL)
        return option_length(list) == 0;
    for (int i = 0; i < option_length(list); i++) {
        const config_setting_t *group = option_group_at(list, i, &reader->source);
        if (group == NULL || !scene_read_touch(reader, group, &scene->touch[scene->touch_count++]))
            return false;
    }
    return true;
}

static bool read_loads(const SceneReader *reader, const config_setting_t *list)
{
    Scene *scene = reader->scene;
    scene->load = allocate_groups(reader, list, SIM_LOADS, sizeof *scene->load);
    if (scene->load == NULL)
        return option_length(list) == 0;
    for (int i = 0; i < option_length(list); i++) {
        const config_setting_t *group = option_group_at(list, i, &reader->source);
        SceneLoad *load = &scene->load[scene->load_count++];
        if (group == NULL || !scene_read_load(reader, group, &load->load))
            return false;
        load->line = (int)config_setting_source_line(group);
    }
    return true;
}

// Returns the line of a key of the root; 0: not given.
static int line_of(const config_setting_t *root, const char *key)
{
    return option_given(root, key) ? (int)config_setting_source_line(option_find(root, key)) : 0;
}

static bool read_root(SceneReader *reader, const config_setting_t *root)
{
    Scene *scene = reader->scene;
    SceneGroup raw = {.scene = *scene};
    if (!option_read(&SCENE_TABLE, root, &reader->source, &raw))
        return false;
    // Other rates follow that of the ticks.
    reader->source.most = raw.scene.sim.rate_hz;
    reader->source.most_key = "rate_hz";
    // What rows could not store directly.
    *scene = raw.scene;
    scene->rate_line = line_of(root, "rate_hz");
    scene->gravity_line = line_of(root, "gravity");
    // Inputs use the output prefix unless the scene gives them their own.
    const char *input = option_given(root, "input_prefix") ? raw.input_prefix : raw.prefix;
    snprintf(scene->name, sizeof scene->name, "%s", raw.name);
    snprintf(scene->prefix, sizeof scene->prefix, "%s", raw.prefix);
    snprintf(scene->input_prefix, sizeof scene->input_prefix, "%s", input);
    // Texts are copied, as those of the table are libconfig's.
    if (option_given(root, "lcm_url")) {
        scene->lcm_url = strdup(raw.lcm_url);
        ASSERT(scene->lcm_url != NULL);
    }
    if (option_given(root, "prepared"))
        scene->prepared = scene_source_resolve(reader->folder, raw.prepared);
    // Groups and lists; bodies before tools and loads, which refer to them by name.
    if (!option_read(&PUBLISH_TABLE, raw.publish, &reader->source, &scene->publish) ||
        !option_read(&CAPACITY_TABLE, raw.capacity, &reader->source, scene))
        return false;
    return read_bodies(reader, raw.bodies) && read_tools(reader, raw.tools) &&
           read_attachments(reader, raw.attachments) && read_touches(reader, raw.touch) &&
           scene_join_bodies(reader, raw.attachments, raw.touch) && read_loads(reader, raw.loads) &&
           scene_read_score_group(reader, raw.score, &scene->score) &&
           scene_check_score(reader, raw.score, &scene->score);
}

bool scene_read(const char *path, Scene *scene, Status *status)
{
    *scene = (Scene){0};
    config_t config;
    config_init(&config);
    scene->path = strdup(path);
    // The text is checked before libconfig sees it.
    scene->text = scene_source_read(path, &config, status);
    char *folder = scene_source_folder(path);
    SceneReader reader = {.source = {.path = path,
                                     .status = status,
                                     .table = scene_table,
                                     .table_count = SCENE_TABLE_COUNT},
                          .folder = folder,
                          .scene = scene};
    bool ok = scene->text != NULL && read_root(&reader, config_root_setting(&config));
    // Keys without effect are known only when all keys are.
    if (ok)
        scene_find_idle(scene, config_root_setting(&config));
    free(folder);
    config_destroy(&config);
    if (!ok)
        scene_destroy(scene);
    return ok;
}

void scene_destroy(Scene *scene)
{
    // Bodies own lists and file names.
    for (int i = 0; i < scene->body_count; i++) {
        SceneBody *body = &scene->body[i];
        for (int k = 0; k < body->options.fixed_count; k++)
            free((void *)body->options.fixed[k].node);
        free((void *)body->options.fixed);
        for (int k = 0; body->weight != NULL && k < body->voxel.weight_count; k++)
            free((void *)body->weight[k].region.node);
        free(body->weight);
        free(body->fine);
        free(body->initial);
        free(body->mesh.file);
        free(body->voxels.file);
        free(body->material);
        free(body->skin.file);
        free(body->look.label);
        free(body->look.image);
        free(body->look.texture);
    }
    // So do attachments; the rest are plain arrays and texts.
    free(scene->body);
    free(scene->tool);
    free(scene->tool_line);
    for (int i = 0; i < scene->attachment_count; i++)
        free((void *)scene->attachment[i].options.region.node);
    free(scene->attachment);
    free(scene->touch);
    free(scene->load);
    for (int i = 0; i < scene->idle_count; i++)
        free(scene->idle[i]);
    free(scene->idle);
    free(scene->prepared);
    free(scene->lcm_url);
    free(scene->text);
    free(scene->path);
    *scene = (Scene){0};
}

bool scene_override(Scene *scene, double rate_hz, const char *prefix, Status *status)
{
    // Rates that follow from the tick's.
    if (rate_hz > 0.0) {
        scene->sim.rate_hz = rate_hz;
        option_lower(&PUBLISH_TABLE, &scene->publish, rate_hz);
        for (int i = 0; i < scene->body_count; i++)
            if (scene->body[i].model == MODEL_SURFACE)
                option_lower(&ADAPT_TABLE, &scene->body[i].surface.adapt, rate_hz);
    }
    if (prefix == NULL)
        return true;
    // Every channel must still have a name that LCM takes.
    for (int i = 0; i < scene->body_count; i++)
        if (longest_channel(prefix, scene->body[i].name) > CHANNEL_MAX)
            return status_fail(status, STATUS_INVALID,
                               "prefix %s makes channel %s_MESH_DELTA_%s longer than %d characters",
                               prefix, prefix, scene->body[i].name, CHANNEL_MAX);
    // Inputs follow the prefix unless they have one of their own.
    if (strcmp(scene->input_prefix, scene->prefix) == 0)
        snprintf(scene->input_prefix, sizeof scene->input_prefix, "%s", prefix);
    snprintf(scene->prefix, sizeof scene->prefix, "%s", prefix);
    return true;
}
