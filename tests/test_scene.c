// Reading of scene files: every key of every table refused with its line when wrong, the meaning of
// the keys when right, includes, and the scenes in config/.
#include "expect.h"
#include "scratch.h"

#include "files/scene_parts.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>

static Scratch scratch;

// libconfig 1.5 forgets the text of a string when the syntax is wrong right behind it.
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void)
{
    return "leak:strbuf_append";
}

// A valid scene, a line at a time. A line with a key belongs to `table`; one without opens it, and
// keys under test are put behind it.
typedef struct Line {
    const char *table, *key, *text;
} Line;

static const Line SCENE[] = {
    {"", NULL, "# a scene"},
    {"", "name", "name = \"base\";"},
    {"", "publish", "publish = {"},
    {"publish", NULL, ""},
    {"", "publish", "};"},
    {"", "capacity", "capacity = {"},
    {"capacity", NULL, ""},
    {"", "capacity", "};"},
    {"", "bodies", "bodies = ( {"},
    {"bodies", NULL, ""},
    {"bodies", "name", "name = \"sphere\";"},
    {"bodies", "mesh", "mesh = {"},
    {"bodies.mesh", NULL, ""},
    {"bodies.mesh", "generator", "generator = \"uv_sphere\";"},
    {"bodies.mesh", "place", "place = {"},
    {"bodies.mesh.place", NULL, ""},
    {"bodies.mesh", "place", "};"},
    {"bodies", "mesh", "};"},
    {"bodies", "levels", "levels = 8;"},
    {"bodies", "adapt", "adapt = {"},
    {"bodies.adapt", NULL, ""},
    {"bodies", "adapt", "};"},
    {"bodies", "material", "material = {"},
    {"bodies.material", NULL, ""},
    {"bodies", "material", "};"},
    {"bodies", "shape", "shape = {"},
    {"bodies.shape", NULL, ""},
    {"bodies", "shape", "};"},
    {"bodies", "contact", "contact = {"},
    {"bodies.contact", NULL, ""},
    {"bodies", "contact", "};"},
    {"bodies", "fixed", "fixed = ( {"},
    {"bodies.fixed", NULL, ""},
    {"bodies.fixed", "sphere", "sphere = [0, 0, -1];"},
    {"bodies.fixed", "radius", "radius = 0.5;"},
    {"bodies", "fixed", "} );"},
    {"", "bodies", "} );"},
    {"", "tools", "tools = ( {"},
    {"tools", NULL, ""},
    {"tools", "id", "id = 3;"},
    {"tools", "kind", "kind = \"static\";"},
    {"tools", "capsules", "capsules = ( {"},
    {"tools.capsules", NULL, ""},
    {"tools.capsules", "radius", "radius = 0.01;"},
    {"tools", "capsules", "} );"},
    {"tools", "plane", "plane = {"},
    {"tools.plane", NULL, ""},
    {"tools.plane", "normal", "normal = [0, 0, 2];"},
    {"tools", "plane", "};"},
    {"", "tools", "} );"},
    {"", "loads", "loads = ( {"},
    {"loads", NULL, ""},
    {"loads", "center", "center = [0, 0, 0.05];"},
    {"loads", "radius", "radius = 0.02;"},
    {"loads", "force", "force = [0, 0, -1];"},
    {"loads", "duration", "duration = 2;"},
    {"", "loads", "} );"},
};
enum { SCENE_LINES = sizeof SCENE / sizeof SCENE[0], SCENE_TEXT = 16384 };

static bool opens(const Line *line, const char *table)
{
    return line->key == NULL && strcmp(line->table, table) == 0;
}

// The scene with `added` in a table and its line `key` left out (with all inside, for a group);
// returns the number of the added line.
static int compose(char *text, const char *table, const char *key, const char *added)
{
    int number = 0, at = 0;
    size_t length = 0;
    bool inside = false; // of the group that is left out
    for (int i = 0; i < SCENE_LINES; i++) {
        const Line *line = &SCENE[i];
        bool own =
            line->key != NULL && strcmp(line->table, table) == 0 && strcmp(line->key, key) == 0;
        if (own && strchr(line->text, '{') != NULL)
            inside = true;
        else if (own && line->text[0] == '}')
            inside = false;
        if (own || inside)
            continue;
        length += (size_t)snprintf(text + length, SCENE_TEXT - length, "%s\n", line->text);
        number++;
        if (opens(line, table)) {
            length += (size_t)snprintf(text + length, SCENE_TEXT - length, "%s\n", added);
            at = ++number;
        }
    }
    assert_true(length < SCENE_TEXT);
    return at;
}

// Reads a text as scene file; returns what was wrong, "" if nothing, without the folder's name.
static const char *read_as_scene(const char *text, Scene *scene)
{
    static char said[512];
    char path[SCRATCH_PATH];
    Status status = {0};
    scratch_write(&scratch, "x.cfg", text, strlen(text));
    bool ok = scene_read(scratch_path(&scratch, "x.cfg", path), scene, &status);
    assert_int_equal(ok, status.code == STATUS_OK);
    if (!ok)
        assert_int_equal(status.code, STATUS_INVALID);
    size_t folder = strlen(scratch.folder) + 1;
    bool own = strncmp(status.text, scratch.folder, folder - 1) == 0;
    snprintf(said, sizeof said, "%s", status.text + (own ? folder : 0));
    assert_null(strchr(said, '\n'));
    return said;
}

static void expect_error(const char *text, const char *message)
{
    Scene scene;
    assert_string_equal(read_as_scene(text, &scene), message);
}

// `key = value` in its table must be refused at its line in a sentence that holds `part`.
static void expect_refused(const OptionTable *table, const char *key, const char *value,
                           const char *part)
{
    static char text[SCENE_TEXT], added[8192];
    char place[32];
    Scene scene;
    snprintf(added, sizeof added, "%s = %s;", key, value);
    int line = compose(text, table->path, key, added);
    assert_true(line > 0);
    const char *said = read_as_scene(text, &scene);
    snprintf(place, sizeof place, "x.cfg:%d: ", line);
    if (strncmp(said, place, strlen(place)) != 0 || strstr(said, key) == NULL ||
        strstr(said, part) == NULL) {
        print_error("%s %s = %.60s: \"%s\" must begin with \"%s\" and hold \"%s\"\n", table->path,
                    key, value, said, place, part);
        fail();
    }
}

// --- every key of every table ------------------------------------------------------------------

static void base_scene_is_valid(void **unused)
{
    (void)unused;
    static char text[SCENE_TEXT];
    Scene scene;
    compose(text, "", "no such key", "");
    assert_string_equal(read_as_scene(text, &scene), "");
    scene_destroy(&scene);
}

static void every_table_refuses_an_unknown_key(void **unused)
{
    (void)unused;
    for (int i = 0; i < SCENE_TABLE_COUNT; i++)
        expect_refused(scene_table(i), "zzz", "1", "unknown key");
}

static void every_key_refuses_a_wrong_type(void **unused)
{
    (void)unused;
    for (int i = 0; i < SCENE_TABLE_COUNT; i++) {
        const OptionTable *table = scene_table(i);
        for (int k = 0; k < table->count; k++) {
            const Option *option = &table->option[k];
            bool string = option->type == OPTION_WORD || option->type == OPTION_NAME ||
                          option->type == OPTION_STRING;
            if (option->type == OPTION_LATER)
                expect_refused(table, option->key, "1", option->later);
            else
                expect_refused(table, option->key, string ? "3" : "\"word\"", "must be");
            if (option->type == OPTION_INT)
                expect_refused(table, option->key, "1.0", "without a point");
            if (option->type == OPTION_WORD)
                expect_refused(table, option->key, "\"no such word\"", "must be");
            if (option->type == OPTION_VECTOR)
                expect_refused(table, option->key, "[1, 2]", "must be");
        }
    }
}

static void every_number_refuses_what_is_outside_its_range(void **unused)
{
    (void)unused;
    char value[64];
    for (int i = 0; i < SCENE_TABLE_COUNT; i++) {
        const OptionTable *table = scene_table(i);
        for (int k = 0; k < table->count; k++) {
            const Option *option = &table->option[k];
            switch (option->type) {
            case OPTION_INT:
                snprintf(value, sizeof value, "%.0fL", option->low - 1.0);
                expect_refused(table, option->key, value, "outside");
                snprintf(value, sizeof value, "%.0fL", option->high + 1.0);
                expect_refused(table, option->key, value, "outside");
                break;
            case OPTION_REAL:
                snprintf(value, sizeof value, "%.17e",
                         option->open ? option->low : nextafter(option->low, -1.0));
                expect_refused(table, option->key, value, "outside");
                snprintf(value, sizeof value, "%.17e", nextafter(option->high, HUGE_VAL));
                expect_refused(table, option->key, value, "outside");
                expect_refused(table, option->key, "1e999", "inf outside");
                break;
            case OPTION_VECTOR:
                snprintf(value, sizeof value, "[0.0, %.17e, 0.0]", option->high * 1.0001);
                expect_refused(table, option->key, value, "outside");
                expect_refused(table, option->key, "(0, -1e999, 0)", "inf outside");
                if (option->low > 0.0)
                    expect_refused(table, option->key, "(0, 0, 0)", "outside");
                break;
            default:
                break;
            }
        }
    }
}

static void every_string_refuses_what_is_too_long(void **unused)
{
    (void)unused;
    static char value[8192];
    for (int i = 0; i < SCENE_TABLE_COUNT; i++) {
        const OptionTable *table = scene_table(i);
        for (int k = 0; k < table->count; k++) {
            const Option *option = &table->option[k];
            if (option->type != OPTION_NAME && option->type != OPTION_STRING)
                continue;
            size_t length = (size_t)option->high + 1;
            assert_true(length + 3 < sizeof value);
            memset(value, 'a', length + 2);
            value[0] = value[length + 1] = '"';
            value[length + 2] = '\0';
            expect_refused(table, option->key, value, "characters, outside");
            expect_refused(table, option->key, "\"a\\x01\"", "must be");
            if (option->type == OPTION_NAME)
                expect_refused(table, option->key, "\"a/b\"", "must be made of letters");
        }
    }
}

static void every_later_feature_is_refused_by_name(void **unused)
{
    (void)unused;
    char value[64];
    for (int i = 0; i < SCENE_TABLE_COUNT; i++) {
        const OptionTable *table = scene_table(i);
        for (int k = 0; k < table->count; k++) {
            const Option *option = &table->option[k];
            for (const OptionWord *word = option->words; word != NULL && word->word != NULL;
                 word++) {
                snprintf(value, sizeof value, "\"%s\"", word->word);
                if (word->later != NULL)
                    expect_refused(table, option->key, value, word->later);
            }
            if (option->later == NULL || option->type == OPTION_LATER)
                continue;
            bool flag = option->type == OPTION_BOOL;
            snprintf(value, sizeof value, "%.0f", option->preset + 1.0);
            expect_refused(table, option->key, flag ? "true" : value, option->later);
        }
    }
}

static void every_required_key_is_missed(void **unused)
{
    (void)unused;
    static char text[SCENE_TEXT];
    for (int i = 0; i < SCENE_TABLE_COUNT; i++) {
        const OptionTable *table = scene_table(i);
        for (int k = 0; k < table->count; k++) {
            const Option *option = &table->option[k];
            if (!option->required)
                continue;
            char part[64];
            Scene scene;
            compose(text, table->path, option->key, "");
            snprintf(part, sizeof part, "%s is missing", option->key);
            const char *said = read_as_scene(text, &scene);
            assert_non_null(strstr(said, part));
            assert_int_equal(strncmp(said, "x.cfg:", 6), 0);
        }
    }
}

// --- meaning -----------------------------------------------------------------------------------

#define BODY "bodies = ( { name = \"a\"; mesh = { generator = \"uv_sphere\"; }; } );\n"
#define IN_BODY(text)                                                                              \
    "bodies = ( { name = \"a\"; mesh = { generator = \"uv_sphere\"; };\n" text " } );\n"
#define MESH(text) "bodies = ( { name = \"a\";\nmesh = { " text " }; } );\n"

static void a_bare_body_takes_all_defaults(void **unused)
{
    (void)unused;
    Scene scene;
    assert_string_equal(read_as_scene(BODY, &scene), "");
    assert_string_equal(scene.name, "scene");
    assert_string_equal(scene.prefix, "PLIANT");
    assert_string_equal(scene.input_prefix, "PLIANT");
    assert_string_equal(scene.text, BODY);
    assert_null(scene.lcm_url);
    assert_false(scene.start_paused);
    assert_int_equal(scene.threads, 1);
    expect_near(scene.rate_hz, 1000.0, 0.0);
    expect_near(vec3_length(scene.gravity), 0.0, 0.0);
    expect_near(scene.tool_timeout_s, 0.2, 0.0);
    expect_near(scene.settle_s, 0.0, 0.0);
    expect_near(scene.publish.nodes_hz, 60.0, 0.0);
    expect_near(scene.publish.mesh_hz, 1.0, 0.0);
    expect_near(scene.publish.contact_hz, 1000.0, 0.0);
    expect_near(scene.publish.status_hz, 2.0, 0.0);
    assert_int_equal(scene.tool_count + scene.load_count, 0);
    const SurfaceOptions *surface = &scene.body[0].surface;
    assert_false(surface->material.uniform);
    expect_near(surface->material.youngs_modulus_2d, 80.0, 0.0);
    expect_near(surface->material.areal_density, 4.2, 0.0);
    expect_near(surface->material.damping_time, 2e-4, 0.0);
    expect_near(surface->material.node_damping, 0.0, 0.0);
    assert_false(surface->shape.wanted);
    assert_int_equal(surface->integrator, INTEGRATOR_LEAPFROG);
    expect_near(surface->time_step, 0.0, 0.0);
    expect_near(surface->contact_ratio, 0.5, 0.0);
    expect_near(surface->contact_damping, 2e-4, 0.0);
    expect_near(surface->friction, 0.2, 0.0);
    expect_near(scene.body[0].mesh.scale, 1.0, 0.0);
    assert_int_equal(scene.body[0].mesh.rings, 8);
    assert_int_equal(scene.body[0].mesh.segments, 14);
    scene_destroy(&scene);
}

static void known_words_of_later_features_are_accepted_at_their_defaults(void **unused)
{
    (void)unused;
    Scene scene;
    assert_string_equal(
        read_as_scene("precision = \"double\"; threads = 1; late = \"skip\";\n" IN_BODY(
                          "cuttable = false; split_budget = 0;"),
                      &scene),
        "");
    scene_destroy(&scene);
}

static void step_may_have_several_threads(void **unused)
{
    (void)unused;
    Scene scene;
    assert_string_equal(read_as_scene("threads = 8;\n" BODY, &scene), "");
    assert_int_equal(scene.threads, 8);
    scene_destroy(&scene);
    expect_error("threads = 9;\n" BODY, "x.cfg:1: threads 9 outside [1, 8]");
    expect_error("threads = 0;\n" BODY, "x.cfg:1: threads 0 outside [1, 8]");
}

static void later_features_read_as_in_the_manual(void **unused)
{
    (void)unused;
    expect_error(IN_BODY("cuttable = true;"),
                 "x.cfg:2: cuttable true: cutting is not built into this version; only false");
    expect_error("bodies = ( { name = \"liver\"; model = \"voxel\";\n"
                 "voxels = { file = \"liver.nrrd\"; label = 1; }; law = \"affine\"; } );",
                 "x.cfg:1: model \"voxel\": voxel bodies are not built into this version; only "
                 "\"surface\"");
}

static void levels_are_read_as_written(void **unused)
{
    (void)unused;
    Scene scene;
    assert_string_equal(
        read_as_scene("rate_hz = 500; capacity = { nodes = 9000; faces = 8000; };\n" IN_BODY(
                          "levels = 3; start_level = 1; adjust = \"choi2005\"; "
                          "adapt = { force = 0.01; speed = 2; curvature = 0.25; "
                          "check_hz = 62.5; };"),
                      &scene),
        "");
    const SurfaceOptions *surface = &scene.body[0].surface;
    assert_int_equal(surface->levels, 3);
    assert_int_equal(surface->start_level, 1);
    assert_int_equal(surface->adjust, ADJUST_CHOI2005);
    assert_true(surface->adaptive);
    expect_near(surface->adapt.force, 0.01, 0.0);
    expect_near(surface->adapt.speed, 2.0, 0.0);
    expect_near(surface->adapt.curvature, 0.25, 0.0);
    expect_near(surface->adapt.check_hz, 62.5, 0.0);
    assert_int_equal(surface->node_capacity, 9000);
    assert_int_equal(surface->face_capacity, 8000);
    scene_destroy(&scene);

    assert_string_equal(read_as_scene(IN_BODY("levels = 1; adapt = {};"), &scene), "");
    surface = &scene.body[0].surface;
    assert_int_equal(surface->start_level, 0);
    assert_int_equal(surface->adjust, ADJUST_CONTINUUM);
    expect_near(surface->adapt.force, 0.005, 0.0);
    expect_near(surface->adapt.speed, 0.3, 0.0);
    expect_near(surface->adapt.curvature, 0.4, 0.0);
    expect_near(surface->adapt.check_hz, 100.0, 0.0);
    assert_int_equal(surface->node_capacity, 0);
    scene_destroy(&scene);

    assert_string_equal(read_as_scene(IN_BODY("levels = 1;"), &scene), "");
    assert_false(scene.body[0].surface.adaptive);
    scene_destroy(&scene);
}

static void levels_that_do_not_go_together_are_refused(void **unused)
{
    (void)unused;
    expect_error(IN_BODY("levels = 9;"), "x.cfg:2: levels 9 outside [0, 8]");
    expect_error(IN_BODY("start_level = 1;"), "x.cfg:2: start_level 1 exceeds levels 0");
    expect_error(IN_BODY("levels = 2;\nstart_level = 3;"),
                 "x.cfg:3: start_level 3 exceeds levels 2");
    expect_error(IN_BODY("adapt = {};"),
                 "x.cfg:2: adapt needs levels, the finest level of detail: set it to 1 or more");
    expect_error(IN_BODY("levels = 1; adapt = { force = 0; };"),
                 "x.cfg:2: force 0 outside (0, 1e+09]");
    expect_error("rate_hz = 50;\n" IN_BODY("levels = 1; adapt = { check_hz = 60; };"),
                 "x.cfg:3: check_hz 60 exceeds rate_hz 50");
    expect_error(IN_BODY("levels = 1; adjust = \"choi\";"),
                 "x.cfg:2: adjust \"choi\" must be one of \"continuum\", \"choi2005\"");
}

static void checks_follow_a_lower_rate(void **unused)
{
    (void)unused;
    Scene scene;
    Status status = {0};
    assert_string_equal(read_as_scene("rate_hz = 50;\n" IN_BODY("levels = 1; adapt = {};"), &scene),
                        "");
    expect_near(scene.body[0].surface.adapt.check_hz, 50.0, 0.0);
    assert_true(scene_override(&scene, 20.0, NULL, &status));
    expect_near(scene.body[0].surface.adapt.check_hz, 20.0, 0.0);
    scene_destroy(&scene);
}

static void generators_take_their_own_keys_only(void **unused)
{
    (void)unused;
    Scene scene;
    assert_string_equal(
        read_as_scene(MESH("generator = \"sphere\"; nodes = 60; radius = 1;"), &scene), "");
    assert_int_equal(scene.body[0].mesh.nodes, 60);
    scene_destroy(&scene);
    assert_string_equal(read_as_scene(MESH("generator = \"stomach\";"), &scene), "");
    assert_int_equal(scene.body[0].mesh.nodes, 188);
    expect_near(scene.body[0].mesh.length, 0.25, 0.0);
    scene_destroy(&scene);
    expect_error(MESH("generator = \"sphere\"; rings = 3;"),
                 "x.cfg:2: rings means nothing for a mesh from sphere");
    expect_error(MESH("file = \"a.stl\"; nodes = 30;"),
                 "x.cfg:2: nodes means nothing for a mesh from a file");
    expect_error(MESH("generator = \"sphere\"; nodes = 20001;"),
                 "x.cfg:2: nodes 20001 outside [4, 20000]");
    expect_error(MESH("generator = \"stomach\"; nodes = 59;"),
                 "x.cfg:2: nodes 59 outside [60, 20000]");
    expect_error(MESH("scale = 1;"), "x.cfg:2: mesh needs a file or generator");
    expect_error(MESH("generator = \"sphere\"; file = \"a.stl\";"),
                 "x.cfg:2: mesh needs only one of file or generator");
}

static void ico_sphere_counts_nodes_or_subdivisions(void **unused)
{
    (void)unused;
    Scene scene;
    assert_string_equal(read_as_scene(MESH("generator = \"ico_sphere\"; nodes = 642;"), &scene),
                        "");
    assert_int_equal(scene.body[0].mesh.nodes, 642);
    scene_destroy(&scene);
    assert_string_equal(
        read_as_scene(MESH("generator = \"ico_sphere\"; subdivisions = 8;"), &scene), "");
    assert_int_equal(scene.body[0].mesh.nodes, 655362);
    scene_destroy(&scene);
    expect_error(MESH("generator = \"ico_sphere\"; nodes = 100;"),
                 "x.cfg:2: nodes 100 is no ico_sphere: 10 * 4^s + 2, as 12, 42, 162, 642, 2562");
    expect_error(MESH("generator = \"ico_sphere\"; nodes = 42; subdivisions = 1;"),
                 "x.cfg:2: nodes and subdivisions are two ways to say the same");
}

static void mesh_files_are_seen_from_the_scenes_folder(void **unused)
{
    (void)unused;
    char expected[SCRATCH_PATH];
    Scene scene;
    assert_string_equal(
        read_as_scene(MESH("file = \"organ.stl\"; scale = 0.001; "
                           "place = { translation = (1, 2, 3.5); rotation = [0, 0, 1]; };"),
                      &scene),
        "");
    const MeshSource *mesh = &scene.body[0].mesh;
    assert_int_equal(mesh->kind, MESH_FILE);
    assert_string_equal(mesh->file, scratch_path(&scratch, "organ.stl", expected));
    expect_near(mesh->scale, 0.001, 0.0);
    expect_near(mesh->translation.z, 3.5, 0.0);
    expect_near(mesh->rotation.z, 1.0, 0.0);
    scene_destroy(&scene);
    assert_string_equal(read_as_scene(IN_BODY("initial = \"/data/start.h5\";"), &scene), "");
    assert_string_equal(scene.body[0].initial, "/data/start.h5");
    scene_destroy(&scene);
}

static void uniform_and_physical_material_do_not_mix(void **unused)
{
    (void)unused;
    Scene scene;
    assert_string_equal(read_as_scene(IN_BODY("material = { spring_stiffness = 40; node_mass = "
                                              "0.001; node_damping = 0.5; };"),
                                      &scene),
                        "");
    const SurfaceMaterial *material = &scene.body[0].surface.material;
    assert_true(material->uniform);
    expect_near(material->spring_stiffness, 40.0, 0.0);
    expect_near(material->spring_damping, 0.0, 0.0);
    expect_near(material->node_mass, 0.001, 0.0);
    expect_near(material->node_damping, 0.5, 0.0);
    scene_destroy(&scene);
    expect_error(
        IN_BODY("material = { spring_stiffness = 40; node_mass = 1; areal_density = 1; };"),
        "x.cfg:2: spring_stiffness cannot be mixed with areal_density");
    expect_error(IN_BODY("material = { spring_damping = 1; node_mass = 1; };"),
                 "x.cfg:2: bodies.material.spring_stiffness is missing: it goes with "
                 "spring_damping");
    expect_error(IN_BODY("material = { spring_stiffness = 1; };"),
                 "x.cfg:2: bodies.material.node_mass is missing: it goes with spring_stiffness");
}

static void shape_is_a_frequency_or_a_stiffness_a_node(void **unused)
{
    (void)unused;
    Scene scene;
    assert_string_equal(read_as_scene(IN_BODY("shape = { frame = \"body\"; };"), &scene), "");
    const SurfaceShape *shape = &scene.body[0].surface.shape;
    assert_true(shape->wanted && !shape->per_node);
    expect_near(shape->angular_frequency, 50.0, 0.0);
    expect_near(shape->damping_ratio, 0.1, 0.0);
    assert_int_equal(shape->frame, SHAPE_BODY);
    scene_destroy(&scene);
    assert_string_equal(
        read_as_scene(IN_BODY("shape = { stiffness = 3; damping = 0.5; };"), &scene), "");
    assert_true(scene.body[0].surface.shape.per_node);
    expect_near(scene.body[0].surface.shape.stiffness, 3.0, 0.0);
    scene_destroy(&scene);
    expect_error(IN_BODY("shape = { damping_ratio = 1; damping = 1; };"),
                 "x.cfg:2: damping cannot be mixed with damping_ratio");
    expect_error(IN_BODY("shape = { damping = 1; };"),
                 "x.cfg:2: bodies.shape.stiffness is missing: it goes with damping");
}

static void fixed_takes_boxes_spheres_and_nodes(void **unused)
{
    (void)unused;
    Scene scene;
    assert_string_equal(
        read_as_scene(IN_BODY("fixed = ( { box = ([-1, -1, -1.5], [1, 1, 0]); },\n"
                              "{ sphere = (0, 0, 1); radius = 2; }, { nodes = [4, 2]; } );"),
                      &scene),
        "");
    const FixedRegion *fixed = scene.body[0].fixed;
    assert_int_equal(scene.body[0].surface.fixed_count, 3);
    assert_ptr_equal(scene.body[0].surface.fixed, fixed);
    assert_int_equal(fixed[0].kind, FIXED_BOX);
    expect_near(fixed[0].low.z, -1.5, 0.0);
    expect_near(fixed[0].high.x, 1.0, 0.0);
    assert_int_equal(fixed[1].kind, FIXED_SPHERE);
    expect_near(fixed[1].center.z, 1.0, 0.0);
    expect_near(fixed[1].radius, 2.0, 0.0);
    assert_int_equal(fixed[2].kind, FIXED_NODES);
    assert_int_equal(fixed[2].node_count, 2);
    assert_int_equal(fixed[2].node[1], 2);
    scene_destroy(&scene);
    expect_error(IN_BODY("fixed = ( { } );"),
                 "x.cfg:2: fixed entry must be one of { box }, { sphere; radius } and { nodes }");
    expect_error(IN_BODY("fixed = ( { sphere = (0, 0, 0); } );"),
                 "x.cfg:2: fixed radius is missing: a ball has a sphere and a radius");
    expect_error(IN_BODY("fixed = ( { box = ([0, 0, 1], [1, 1, 0]); } );"),
                 "x.cfg:2: box is empty: its first corner must be the lower one");
    expect_error(IN_BODY("fixed = ( { nodes = [1, -2]; } );"),
                 "x.cfg:2: nodes -2 outside [0, 268435456]");
    expect_error(IN_BODY("fixed = ( 3 );"), "x.cfg:2: fixed entry 3 must be a group { ... }");
}

#define TOOL(text) BODY "tools = ( { id = 1; " text " } );"

static void tools_have_the_shapes_of_their_kind(void **unused)
{
    (void)unused;
    Scene scene;
    assert_string_equal(
        read_as_scene(
            TOOL("kind = \"probe\"; capsules = ( { from = (0, 0, 1); radius = 0.1; } ); "), &scene),
        "");
    assert_int_equal(scene.tool[0].capsule_count, 1);
    // Without `to` the capsule is a ball.
    expect_near(scene.tool[0].capsule[0].to.z, 1.0, 0.0);
    expect_near(scene.tool[0].max_force, 3.3, 0.0);
    scene_destroy(&scene);
    assert_string_equal(
        read_as_scene(TOOL("kind = \"static\"; plane = { normal = (0, 0, 5); }; "), &scene), "");
    assert_true(scene.tool[0].has_plane);
    expect_near(scene.tool[0].plane.normal.z, 1.0, 0.0);
    scene_destroy(&scene);
    expect_error(TOOL("kind = \"probe\"; "), "x.cfg:2: tool 1 has no shape: give it capsules");
    expect_error(TOOL("kind = \"static\"; "),
                 "x.cfg:2: tool 1 has no shape: give it capsules or a plane");
    expect_error(TOOL("kind = \"probe\"; plane = { normal = (0, 0, 1); }; "),
                 "x.cfg:2: plane means nothing for a probe, only for kind static");
    expect_error(TOOL("kind = \"static\"; max_force = 2; plane = { normal = (0, 0, 1); }; "),
                 "x.cfg:2: max_force means nothing for a static tool: it never yields");
    expect_error(TOOL("kind = \"blade\"; edge = ( (0, 0, 0), (0, 0, 1) ); "),
                 "x.cfg:2: kind \"blade\": cutting is not built into this version; only \"probe\", "
                 "\"static\"");
}

static void loads_find_their_body(void **unused)
{
    (void)unused;
#define LOAD(body)                                                                                 \
    "bodies = ( { name = \"one\"; mesh = { generator = \"sheet\"; }; },\n"                         \
    " { name = \"two\"; mesh = { generator = \"sheet\"; }; } );\n"                                 \
    "loads = ( { " body "center = (0, 0, 0); radius = 1; force = (0, 0, -1); duration = 2; } );"
    Scene scene;
    assert_string_equal(read_as_scene(LOAD("body = \"two\"; "), &scene), "");
    assert_int_equal(scene.load[0].load.body, 1);
    expect_near(scene.load[0].load.force.z, -1.0, 0.0);
    expect_near(scene.load[0].load.start, 0.0, 0.0);
    expect_near(scene.load[0].load.duration, 2.0, 0.0);
    scene_destroy(&scene);
    assert_string_equal(read_as_scene(LOAD("body = \"\"; "), &scene), "");
    assert_int_equal(scene.load[0].load.body, -1);
    scene_destroy(&scene);
    assert_string_equal(read_as_scene(LOAD(""), &scene), "");
    assert_int_equal(scene.load[0].load.body, -1);
    scene_destroy(&scene);
    expect_error(LOAD("body = \"tow\"; "), "x.cfg:3: body \"tow\" is not in the scene");
    expect_error(LOAD("body = \"twoo\"; "),
                 "x.cfg:3: body \"twoo\" is not in the scene: did you mean \"two\"?");
}

static void names_and_ids_are_unique_and_fit_a_channel(void **unused)
{
    (void)unused;
    expect_error("bodies = ( { name = \"a\"; mesh = { generator = \"sheet\"; }; },\n"
                 " { name = \"a\"; mesh = { generator = \"sheet\"; }; } );\n",
                 "x.cfg:2: name \"a\" is taken by the body at line 1");
    expect_error(BODY "tools = ( { id = 1; kind = \"probe\"; capsules = ( { radius = 1; } ); },\n"
                      "{ id = 1; kind = \"probe\"; capsules = ( { radius = 1; } ); } );",
                 "x.cfg:3: id 1 is taken by another tool");
    // 31 + 12 + 21 = 64 characters, one more than LCM carries.
    expect_error(
        "prefix = \"abcdefghijabcdefghijabcdefghij1\";\n"
        "bodies = ( { name = \"abcdefghijabcdefghij1\"; mesh = { generator = \"sheet\"; }; } );",
        "x.cfg:2: name \"abcdefghijabcdefghij1\" makes channel "
        "abcdefghijabcdefghijabcdefghij1_MESH_DELTA_abcdefghijabcdefghij1 longer than 63 "
        "characters");
}

static void publish_rates_do_not_exceed_the_tick_rate(void **unused)
{
    (void)unused;
    Scene scene;
    assert_string_equal(read_as_scene("rate_hz = 30;\n" BODY, &scene), "");
    expect_near(scene.publish.nodes_hz, 30.0, 0.0);
    expect_near(scene.publish.contact_hz, 30.0, 0.0);
    expect_near(scene.publish.mesh_hz, 1.0, 0.0);
    scene_destroy(&scene);
    expect_error("rate_hz = 30;\npublish = {\n nodes_hz = 60; };" BODY,
                 "x.cfg:3: nodes_hz 60 exceeds rate_hz 30");
}

static void counts_are_limited(void **unused)
{
    (void)unused;
    static char text[65536];
    size_t length = (size_t)snprintf(text, sizeof text, "%sloads = (", BODY);
    for (int i = 0; i < SIM_LOADS + 1; i++)
        length += (size_t)snprintf(
            text + length, sizeof text - length,
            "%s{ center = (0, 0, 0); radius = 1; force = (0, 0, 1); duration = 1; }",
            i > 0 ? "," : "");
    snprintf(text + length, sizeof text - length, ");");
    expect_error(text, "x.cfg:2: loads has 65 entries, at most 64");
    expect_error("bodies = ( );", "x.cfg:1: bodies is empty: at least one body");
    expect_error("", "x.cfg: bodies is missing (The soft bodies: 1 to 64 groups.)");
}

// --- files -------------------------------------------------------------------------------------

static void duplicate_keys_and_syntax_errors_show_their_line(void **unused)
{
    (void)unused;
    expect_error("rate_hz = 5;\nrate_hz = 6;\n" BODY,
                 "x.cfg:2: duplicate setting name: rate_hz = 6;");
    expect_error("rate_hz = ;\n", "x.cfg:1: syntax error: rate_hz = ;");
    expect_error("\nname = \"x;\n", "x.cfg:2: a string begins here and does not end");
    expect_error("gravity = [nan, 0.0, 0.0];\n",
                 "x.cfg:1: syntax error: gravity = [nan, 0.0, 0.0];");
}

static void integers_beyond_32_bits_are_refused_not_cut(void **unused)
{
    (void)unused;
    // libconfig would read 4294968296 as 1000, a valid rate.
    expect_error("# 4294968296\nrate_hz = 4294968296;\n" BODY,
                 "x.cfg:2: integer 4294968296 does not fit 32 bits");
    expect_error("rate_hz = 0x1000003e8;\n" BODY,
                 "x.cfg:1: integer 0x1000003e8 does not fit 32 bits");
    Scene scene;
    assert_string_equal(
        read_as_scene("rate_hz = 0x3e8; # 4294968296\n/* 4294968296 */\n" BODY, &scene), "");
    expect_near(scene.rate_hz, 1000.0, 0.0);
    scene_destroy(&scene);
}

static void errors_in_included_files_name_the_included_file(void **unused)
{
    (void)unused;
    Scene scene;
    const char *include = "\n@include \"part.inc\"\n" BODY;
    scratch_write(&scratch, "part.inc", "rate_hz = 500;\n", 15);
    assert_string_equal(read_as_scene(include, &scene), "");
    expect_near(scene.rate_hz, 500.0, 0.0);
    assert_string_equal(scene.text, include);
    scene_destroy(&scene);
    scratch_write(&scratch, "part.inc", "\nrate_hz = 0;\n", 14);
    expect_error(include, "part.inc:2: rate_hz 0 outside [1, 10000]");
    scratch_write(&scratch, "part.inc", "rate_hz = 99999999999;\n", 23);
    expect_error(include, "part.inc:1: integer 99999999999 does not fit 32 bits");
    scratch_write(&scratch, "part.inc", "\n\ngravity = [0, 1.0, 0];\n", 25);
    expect_error(include, "part.inc:3: mismatched element type in array [ ]: write 0.0 for 0, or "
                          "use ( )");
}

static void includes_that_cannot_be_read_are_named(void **unused)
{
    (void)unused;
    expect_error("\n@include \"none.inc\"\n", "x.cfg:2: @include \"none.inc\": No such file or "
                                              "directory");
    // libconfig's scanner would end the process.
    expect_error("@include \".\"\n", "x.cfg:1: @include \".\" is not a regular file");
    expect_error("@include \"/dev/zero\"\n", "x.cfg:1: @include \"/dev/zero\" must be a path from "
                                             "the scene file's folder, written with /");
    Scene scene;
    assert_non_null(strstr(read_as_scene("@include \"x.cfg\"\n", &scene),
                           "x.cfg:1: @include \"x.cfg\" is nested deeper than 10 files"));
}

static void scene_files_that_cannot_be_read_are_named(void **unused)
{
    (void)unused;
    Scene scene;
    Status status = {0};
    assert_false(scene_read("no-such-scene.cfg", &scene, &status));
    assert_string_equal(status.text, "no-such-scene.cfg: No such file or directory");
    status = (Status){0};
    assert_false(scene_read("/", &scene, &status));
    assert_string_equal(status.text, "/ is not a regular file");
    char path[SCRATCH_PATH];
    scratch_write(&scratch, "zero.cfg", "a = 1;\0b", 8);
    status = (Status){0};
    assert_false(scene_read(scratch_path(&scratch, "zero.cfg", path), &scene, &status));
    assert_non_null(strstr(status.text, "holds a zero byte: it is not text"));
}

static void damaged_scenes_are_read_or_refused_in_one_line(void **unused)
{
    (void)unused;
    static char text[SCENE_TEXT], damaged[SCENE_TEXT];
    Scene scene;
    compose(text, "", "no such key", "");
    int length = (int)strlen(text);
    uint64_t random = 1;
    for (int i = 0; i < 600; i++) {
        strcpy(damaged, text);
        // Cut at every second place, and three characters changed at random.
        if (i < length / 2 && i % 2 == 0)
            damaged[i * 2] = '\0';
        for (int k = 0; k < 3; k++) {
            random = random * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
            damaged[(random >> 33) % (unsigned)length] = (char)(1 + (random >> 20) % 126);
        }
        if (read_as_scene(damaged, &scene)[0] == '\0')
            scene_destroy(&scene);
    }
}

// --- config/ -----------------------------------------------------------------------------------

static void every_scene_in_config_is_valid(void **unused)
{
    (void)unused;
    DIR *folder = opendir("../config");
    assert_non_null(folder);
    int count = 0;
    for (struct dirent *entry = readdir(folder); entry != NULL; entry = readdir(folder)) {
        const char *dot = strrchr(entry->d_name, '.');
        if (dot == NULL || strcmp(dot, ".cfg") != 0)
            continue;
        char path[512];
        Scene scene;
        Status status = {0};
        snprintf(path, sizeof path, "../config/%s", entry->d_name);
        if (!scene_read(path, &scene, &status))
            print_error("%s\n", status.text);
        assert_int_equal(status.code, STATUS_OK);
        scene_destroy(&scene);
        count++;
    }
    closedir(folder);
    assert_true(count >= 7);
}

static void reference_in_config_is_the_printed_one(void **unused)
{
    (void)unused;
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    scene_print_reference(out);
    fclose(out);
    FILE *file = fopen("../config/README.md", "rb");
    assert_non_null(file);
    char *stored = calloc(size + 2, 1);
    size_t length = fread(stored, 1, size + 1, file);
    fclose(file);
    // `test_scene --reference > config/README.md` brings it up to date.
    assert_string_equal(stored, text);
    assert_int_equal(length, size);
    free(stored);
    free(text);
}

// --- without surface bodies ---------------------------------------------------------------------

#ifdef PLIANT_WITH_SURFACE
static const bool with_surface = true;
#else
static const bool with_surface = false;
#endif

static void surface_bodies_that_are_not_built_in_are_refused(void **unused)
{
    (void)unused;
    expect_error(BODY, "x.cfg:1: this pliantd was built without surface bodies (PLIANT_SURFACE)");
}

static int begin(void **unused)
{
    (void)unused;
    return scratch_create(&scratch);
}

static int end(void **unused)
{
    (void)unused;
    scratch_destroy(&scratch);
    return 0;
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--reference") == 0) {
        scene_print_reference(stdout);
        return 0;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(base_scene_is_valid),
        cmocka_unit_test(every_table_refuses_an_unknown_key),
        cmocka_unit_test(every_key_refuses_a_wrong_type),
        cmocka_unit_test(every_number_refuses_what_is_outside_its_range),
        cmocka_unit_test(every_string_refuses_what_is_too_long),
        cmocka_unit_test(every_later_feature_is_refused_by_name),
        cmocka_unit_test(every_required_key_is_missed),
        cmocka_unit_test(a_bare_body_takes_all_defaults),
        cmocka_unit_test(known_words_of_later_features_are_accepted_at_their_defaults),
        cmocka_unit_test(step_may_have_several_threads),
        cmocka_unit_test(later_features_read_as_in_the_manual),
        cmocka_unit_test(levels_are_read_as_written),
        cmocka_unit_test(levels_that_do_not_go_together_are_refused),
        cmocka_unit_test(checks_follow_a_lower_rate),
        cmocka_unit_test(generators_take_their_own_keys_only),
        cmocka_unit_test(ico_sphere_counts_nodes_or_subdivisions),
        cmocka_unit_test(mesh_files_are_seen_from_the_scenes_folder),
        cmocka_unit_test(uniform_and_physical_material_do_not_mix),
        cmocka_unit_test(shape_is_a_frequency_or_a_stiffness_a_node),
        cmocka_unit_test(fixed_takes_boxes_spheres_and_nodes),
        cmocka_unit_test(tools_have_the_shapes_of_their_kind),
        cmocka_unit_test(loads_find_their_body),
        cmocka_unit_test(names_and_ids_are_unique_and_fit_a_channel),
        cmocka_unit_test(publish_rates_do_not_exceed_the_tick_rate),
        cmocka_unit_test(counts_are_limited),
        cmocka_unit_test(duplicate_keys_and_syntax_errors_show_their_line),
        cmocka_unit_test(integers_beyond_32_bits_are_refused_not_cut),
        cmocka_unit_test(errors_in_included_files_name_the_included_file),
        cmocka_unit_test(includes_that_cannot_be_read_are_named),
        cmocka_unit_test(scene_files_that_cannot_be_read_are_named),
        cmocka_unit_test(damaged_scenes_are_read_or_refused_in_one_line),
        cmocka_unit_test(every_scene_in_config_is_valid),
        cmocka_unit_test(reference_in_config_is_the_printed_one),
    };
    const struct CMUnitTest tests_without[] = {
        cmocka_unit_test(surface_bodies_that_are_not_built_in_are_refused),
        cmocka_unit_test(reference_in_config_is_the_printed_one),
    };
    return with_surface ? cmocka_run_group_tests(tests, begin, end)
                        : cmocka_run_group_tests(tests_without, begin, end);
}
