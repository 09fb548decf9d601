// SPDX-License-Identifier: MIT
// No key is decoration: every key of every table, on every model that takes it, changes the state
// of a run, what is published of it or its plan, or is refused with file and line. Keys are those
// of the tables that read scenes; one without a row in rows.c fails.
#include "test.h"
#include "stream.h"

#include "scene/build.h"
#include "base/fnv.h"
#include "scene/scene_parts.h"
#include "geometry/generator.h"
#include "run/modes.h"

static const char *const MODEL[KEY_MODELS] = {"surface", "voxel", "plane"};
enum { TICKS = 60 };

// What came of a scene.
typedef struct Outcome {
    bool accepted;
    char said[512];         // if not
    int warnings;           // of keys without effect
    char warned[PATH_TEXT]; // the first of them
    uint64_t state, shown, physics;
    char *plan;
} Outcome;

// A ball, or two of which the second lies within the first.
static void write_ball(const char *name, int subdivisions, int count)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    Status status = {0};
    assert_true(generate_ico_sphere(&mesh, subdivisions, 0.04, &status));
    FILE *file = fopen(scratch(name), "w");
    assert_non_null(file);
    for (int k = 0; k < count; k++) {
        const double scale = k == 0 ? 1.0 : 0.5;
        for (int i = 0; i < mesh.node_count; i++)
            fprintf(file, "v %.9g %.9g %.9g\n", scale * mesh.position[i].x,
                    scale * mesh.position[i].y, scale * mesh.position[i].z);
        for (int t = 0; t < mesh.triangle_count; t++)
            fprintf(file, "f %d %d %d\n", mesh.triangle[t][0] + 1 + k * mesh.node_count,
                    mesh.triangle[t][1] + 1 + k * mesh.node_count,
                    mesh.triangle[t][2] + 1 + k * mesh.node_count);
    }
    assert_int_equal(fclose(file), 0);
}

// A probe presses along `axis` and slides, a blade sweeps through along y, a grasper closes and
// pulls; all fall silent before the end.
static ToolPose pose_at(ToolKind kind, Vec3 axis, int tick)
{
    const double part = (double)tick / TICKS;
    ToolPose pose = {.utime = 1000 * tick, .orientation = QUAT_NONE, .active = true};
    if (kind == TOOL_PROBE)
        pose.position = vec3_add(vec3_scale(0.065 - 0.04 * part, axis), vec3(0.02 * part, 0, 0));
    else if (kind == TOOL_BLADE)
        pose.position = vec3(0.005, -0.1 + 0.3 * part, 0.0);
    else {
        pose.position = vec3_scale(0.045 + (tick > 10 ? 0.05 * part : 0.0), axis);
        pose.grip = tick > 5 ? 1.0 : 0.0;
    }
    return pose;
}

static void run_world(World *world, Vec3 axis)
{
    for (int tick = 0; tick < TICKS; tick++) {
        for (int i = 0; i < sim_tool_count(world->sim) && tick < TICKS - 20; i++)
            if (sim_tool(world->sim, i)->kind != TOOL_STATIC) {
                const ToolPose pose = pose_at(sim_tool(world->sim, i)->kind, axis, tick);
                sim_apply_pose(world->sim, i, &pose, false);
            }
        sim_step(world->sim);
    }
}

static uint64_t hash_shown(World *world)
{
    uint64_t hash = FNV_START;
    for (int b = 0; b < sim_body_count(world->sim); b++) {
        const Body *body = sim_body(world->sim, b);
        const BodyMesh *mesh = &body->mesh;
        FREED float *x = zeroed(3 * (size_t)mesh->node_capacity + 3, sizeof *x);
        body->ops->snapshot(body->model, x, NULL);
        hash = fnv_bytes(hash, x, 3 * (size_t)mesh->node_count * sizeof *x);
        hash =
            fnv_bytes(hash, mesh->triangle, (size_t)mesh->triangle_count * sizeof *mesh->triangle);
    }
    return hash;
}

static char *plan_of(World *world, const Scene *scene)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    explain_plan(world, scene, NULL, out);
    fclose(out);
    return text;
}

static Outcome try_scene(const KeyRow *row, KeyModel model, bool changed)
{
    Outcome outcome = {0};
    Scene scene;
    World world;
    Status status = {0};
    const BuildOptions options = {.isa = "auto", .may_load = true};
    char *text = key_scene(row, model, changed, "");
    const char *path = scratch("x.cfg");
    write_text(path, text);
    free(text);
    if (!scene_read(path, &scene, &status)) {
        snprintf(outcome.said, sizeof outcome.said, "%s", status.text);
        return outcome;
    }
    outcome.warnings = scene.idle_count;
    if (scene.idle_count > 0)
        snprintf(outcome.warned, sizeof outcome.warned, "%s", scene.idle[0]);
    outcome.accepted = world_build(&world, &scene, &options, &status);
    snprintf(outcome.said, sizeof outcome.said, "%s", status.text);
    if (outcome.accepted) {
        outcome.physics = physics_hash(&scene, &world);
        outcome.plan = plan_of(&world, &scene);
        run_world(&world, model == KEY_PLANE ? vec3(0, 1, 0) : vec3(0, 0, 1));
        outcome.state = state_hash(&world.state);
        outcome.shown = hash_shown(&world);
        world_destroy(&world);
    }
    scene_destroy(&scene);
    return outcome;
}

// A key is said to have no effect where it has none, with its line. It may stand in the state as a
// parameter that a command could change.
static const char *fault_of_idle(const KeyRow *row, const Outcome *base, const Outcome *changed)
{
    char says[64];
    snprintf(says, sizeof says, ": %s has no effect: ", row->key);
    if (base->shown != changed->shown)
        return "it is said to have no effect";
    if (base->warnings != 0 || changed->warnings != 1)
        return "it is not warned of once, and only it";
    return strstr(changed->warned, "x.cfg:") == NULL || strstr(changed->warned, says) == NULL ||
                   strstr(changed->warned, row->said) == NULL
               ? changed->warned
               : NULL;
}

// Why a row's evidence is not there, or NULL.
static const char *fault_of(const KeyRow *row, const Outcome *base, const Outcome *changed)
{
    if (!base->accepted)
        return "the scene without the change is refused";
    if (row->evidence == REFUSED)
        return changed->accepted                          ? "it is accepted"
               : strstr(changed->said, row->said) == NULL ? "it is refused for another reason"
               : strstr(changed->said, "x.cfg") == NULL && strstr(changed->said, "none.h5") == NULL
                   ? "the refusal names no file"
                   : NULL;
    if (!changed->accepted)
        return "the changed scene is refused";
    if (row->evidence == IDLE)
        return fault_of_idle(row, base, changed);
    if (base->warnings != 0 || changed->warnings != 0)
        return changed->warnings != 0 ? changed->warned : base->warned;
    if ((row->evidence == STATE) != (base->physics != changed->physics))
        return row->evidence == STATE ? "a checkpoint would fit both" : "no checkpoint would fit";
    const bool same = row->evidence == STATE || row->evidence == STATE_ALONE
                          ? base->state == changed->state
                      : row->evidence == SHOWN ? base->shown == changed->shown
                                               : strcmp(base->plan, changed->plan) == 0;
    return same ? "nothing changes" : NULL;
}

// Returns 1 if the change of a row does not show on this model.
static int try_row(const KeyRow *row, KeyModel model)
{
    Outcome base = try_scene(row, model, false), changed = try_scene(row, model, true);
    const char *fault = fault_of(row, &base, &changed);
    if (fault != NULL)
        print_error("%s.%s of a %s body: %s (\"%s\" -> \"%s\") %s %s\n", row->table->path, row->key,
                    MODEL[model], fault, row->base != NULL ? row->base : "preset", row->changed,
                    base.said, changed.said);
    free(base.plan);
    free(changed.plan);
    return fault != NULL;
}

// Returns the models on which rows.c shows what a key does, or (`idle`) that it has no effect.
static int models_with_a_row(const OptionTable *table, const char *key, bool idle)
{
    int models = 0;
    for (int i = 0; i < KEY_ROW_COUNT; i++)
        if (KEY_ROWS[i].table == table && strcmp(KEY_ROWS[i].key, key) == 0 &&
            (KEY_ROWS[i].evidence == IDLE) == idle)
            models |= KEY_ROWS[i].models;
    return models;
}

// Calls `visit` for each key of each table and each model that has no row.
static int visit_keys_without_a_row(int (*visit)(const OptionTable *, const Option *, KeyModel))
{
    int sum = 0;
    for (int t = 0; t < SCENE_TABLE_COUNT; t++) {
        const OptionTable *table = scene_table(t);
        for (int k = 0; k < table->count; k++) {
            const Option *option = &table->option[k];
            const int lacks = key_models(table) & ~models_with_a_row(table, option->key, false);
            for (int m = 0; m < KEY_MODELS; m++)
                if (lacks & 1 << m)
                    sum += visit(table, option, (KeyModel)m);
        }
    }
    return sum;
}

static int try_made_row(const OptionTable *table, const Option *option, KeyModel model)
{
    MadeRow made;
    return key_row_make(table, option, model, &made) && try_row(&made.row, model);
}

TEST(every_key_changes_something_or_is_refused)
{
    int faults = 0;
    write_ball("ball.obj", 1, 1);
    write_ball("finer.obj", 2, 1);
    write_ball("nested.obj", 1, 2);
    for (int i = 0; i < KEY_ROW_COUNT; i++)
        for (int m = 0; m < KEY_MODELS; m++)
            if ((KEY_ROWS[i].models & 1 << m) != 0 && KEY_ROWS[i].evidence != STREAM)
                faults += try_row(&KEY_ROWS[i], (KeyModel)m);
    faults += visit_keys_without_a_row(try_made_row);
    assert_int_equal(faults, 0);
}

// Otherwise any change would show.
TEST(same_scene_gives_the_same_hashes)
{
    const KeyRow nothing = {.part = HEAD};
    for (int m = 0; m < KEY_MODELS; m++) {
        Outcome first = try_scene(&nothing, (KeyModel)m, false);
        Outcome again = try_scene(&nothing, (KeyModel)m, true);
        assert_true(first.accepted && again.accepted);
        assert_true(first.state == again.state && first.shown == again.shown);
        assert_string_equal(first.plan, again.plan);
        free(first.plan);
        free(again.plan);
    }
}

// --- what checkpoints know scenes apart by -------------------------------------------------------

// The tables whose rows a scene keeps as they are read.
enum { TARGETS_MOST = 16 };

static int list_targets(const Scene *scene, KeyGroup target[TARGETS_MOST])
{
    const ToolOptions *tool = &scene->tool[0];
    const KeyGroup others[] = {
        {&SCENE_TABLE, scene, sizeof *scene, false},
        {&CAPACITY_TABLE, scene, sizeof *scene, false},
        {&TOOL_TABLE, tool, sizeof *tool, false},
        {&CAPSULE_TABLE, &tool->capsule[0], sizeof(Capsule), false},
        {&PLANE_TABLE, &tool->plane, sizeof(Plane), false},
        {&LOAD_TABLE, &scene->load[0].load, sizeof(LoadOptions), false},
        {&ATTACHMENT_TABLE, &scene->attachment[0].options, sizeof(AttachmentOptions), false},
        {&TOUCH_TABLE, &scene->touch[0].options, sizeof(TouchOptions), false},
    };
    int count = scene_list_groups(&scene->body[0], target);
    memcpy(&target[count], others, sizeof others);
    count += (int)(sizeof others / sizeof *others);
    if (scene_has_cells(&scene->body[0]))
        target[count++] = (KeyGroup){&LABEL_MATERIAL_TABLE, &scene->body[0].material[0],
                                     sizeof(SolidMaterial), false};
    return count;
}

// Adds to the value of a row; false for texts, groups and lists, which a scene keeps otherwise.
static bool add_to(const Option *option, void *member, int more)
{
    switch (option->type) {
    case OPTION_REAL:
        *(double *)member += more;
        return true;
    case OPTION_INT:
    case OPTION_WORD:
        *(int *)member += more;
        return true;
    case OPTION_BOOL:
        *(bool *)member = !*(bool *)member;
        return true;
    case OPTION_VECTOR:
        ((Vec3 *)member)->y += more;
        return true;
    default:
        return false;
    }
}

// Returns how many rows change the hash though they do not count, or count and do not change it.
static int count_wrong_rows(const Scene *scene, const World *world, const KeyGroup *target)
{
    const SceneModel model = scene->body[0].model;
    int wrong = 0;
    for (int i = 0; i < target->table->count; i++) {
        const Option *option = &target->table->option[i];
        void *member = (char *)target->keys + option->offset;
        if (option->offset >= target->size || member == &scene->body[0].model ||
            (target->table->variant != 0 && !option_is_used(option, (int)model)))
            continue;
        const uint64_t before = physics_hash(scene, world);
        if (!add_to(option, member, 1)) // a text, a group or a list
            continue;
        const bool counts = physics_hash(scene, world) != before;
        add_to(option, member, -1);
        if (counts == option->physics)
            continue;
        print_error("%s.%s of a %s body %s\n", target->table->path, option->key, MODEL[model],
                    counts ? "counts" : "does not count");
        wrong++;
    }
    return wrong;
}

TEST(rows_that_count_change_the_hash_and_no_others)
{
    static const char *const BODIES[] = {
        "mesh = { generator = \"sphere\"; }; levels = 1; adapt = {}; shape = {};\n"
        "cavity = { gas = true; }; cuttable = true; tear = { stretch = 1.0; };\n"
        "material = { stiffening = { strain = 0.1; cap = 5.0; }; };",
        "model = \"voxel\"; voxels = { generator = \"box\"; count = 4; };\n"
        "cuttable = true; tear = { force = 1.0; };\n"
        "material = { stiffening = { strain = 0.1; cap = 5.0; }; };"};
    const char *path = scratch("x.cfg");
    for (int model = 0; model < 2; model++) {
        char text[1024];
        SCOPED(scene_destroy) Scene scene;
        Status status = {0};
        KeyGroup target[TARGETS_MOST];
        TriMesh mesh[2] = {{0}};
        WorldCells cells[2] = {{0}};
        const World world = {.mesh = mesh, .cells = cells};
        snprintf(
            text, sizeof text,
            "bodies = ( { name = \"a\"; %s }, { name = \"b\"; mesh = { generator = \"sphere\"; }; "
            "} "
            ");\ntools = ( { id = 1; kind = \"static\"; capsules = ( { radius = 0.1; } );\n"
            "    plane = { normal = [0.0, 0.0, 1.0]; }; } );\n"
            "loads = ( { center = [0, 0, 0]; radius = 1; force = [0, 0, 1]; duration = 1; } );\n"
            "attachments = ( { body = \"a\"; nodes = [0]; to = \"world\"; } );\n"
            "touch = ( { bodies = [\"a\", \"b\"]; } );\n",
            BODIES[model]);
        write_text(path, text);
        assert_true(scene_read(path, &scene, &status));
        int wrong = 0;
        for (int t = list_targets(&scene, target); t-- > 0;)
            wrong += count_wrong_rows(&scene, &world, &target[t]);
        assert_int_equal(wrong, 0);
    }
}

// --- keys that SET changes -----------------------------------------------------------------------

TEST(what_a_row_calls_live_is_a_key_of_set_in_the_same_range)
{
    SCOPED(world_destroy) World world = {0};
    SCOPED(scene_destroy) Scene scene;
    Status status = {0};
    const char *path = scratch("live.cfg");
    write_text(path,
               "bodies = ( { name = \"a\"; mesh = { generator = \"ico_sphere\"; }; levels = 1; "
               "adapt = { error = 0.05; }; cavity = { gas = true; }; } );\n");
    assert_true(scene_read(path, &scene, &status));
    if (!world_build(&world, &scene, &(BuildOptions){.isa = "auto"}, &status))
        fail_msg("%s", status.text);
    int live = 0;
    for (int t = 0; t < SCENE_TABLE_COUNT; t++)
        for (int i = 0; i < scene_table(t)->count; i++) {
            const Option *option = &scene_table(t)->option[i];
            char key[64], why[256];
            double longer;
            if (option->live == NULL)
                continue;
            live++;
            // Between its bounds other limits may hold, those of the time step.
            snprintf(key, sizeof key, "a.%s", option->live);
            if (option->type == OPTION_VECTOR) {
                assert_true(sim_tell_setting(world.sim, option->live, why, sizeof why));
                assert_true(sim_try_gravity(vec3(0.0, option->high, 0.0), why, sizeof why));
                assert_false(sim_try_gravity(vec3(0.0, 2.0 * option->high, 0.0), why, sizeof why));
                continue;
            }
            if (!sim_tell_setting(world.sim, key, why, sizeof why))
                fail_msg("%s: %s", key, why);
            assert_false(sim_try_set(world.sim, key, 2.0 * option->high, &longer, why, sizeof why));
            expect_in(why, " outside [");
            if (!sim_try_set(world.sim, key, option->high, &longer, why, sizeof why))
                expect_in(why, " is outside ("); // of the body's step
        }
    assert_true(live >= 6);
}

// --- every key of every table --------------------------------------------------------------------

static int miss_row(const OptionTable *table, const Option *option, KeyModel model)
{
    MadeRow made;
    if (key_row_make(table, option, model, &made) ||
        (models_with_a_row(table, option->key, true) & 1 << model) != 0)
        return 0;
    print_error("%s.%s has no row in rows.c for a %s body\n", table->path, option->key,
                MODEL[model]);
    return 1;
}

TEST(every_key_of_every_table_has_a_row_for_every_model)
{
    for (int i = 0; i < KEY_ROW_COUNT; i++) { // nor is there a row of a key that is none
        bool known = false;
        for (int k = 0; k < KEY_ROWS[i].table->count; k++)
            known |= strcmp(KEY_ROWS[i].table->option[k].key, KEY_ROWS[i].key) == 0;
        assert_true(known);
    }
    assert_int_equal(visit_keys_without_a_row(miss_row), 0);
}

TEST(every_published_key_changes_the_stream)
{
    // Live programs on a busy machine may have no time for what a key is about (the stiffness of a
    // contact): a key that does something shows it in one of six runs, a decoration in none.
    enum { RUNS_MOST = 6 };
    for (int m = 0; m < KEY_MODELS; m++) {
        int runs = 1;
        while (stream_faults((KeyModel)m, MODEL[m]) > 0)
            assert_true(runs++ < RUNS_MOST);
    }
}

// PLIANTD
