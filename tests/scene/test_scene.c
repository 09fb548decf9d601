// SPDX-License-Identifier: MIT
// Reading of scene files: every key of every table refused with its line when wrong, damaged files,
// and the scenes in config/.
#include "test.h"
#include "scene_text.h"

#include <dirent.h>

// A valid scene, a line at a time. A line with a key belongs to `table`; one without opens it, and
// keys under test are put behind it.
typedef struct Line {
    const char *table, *key, *text;
} Line;

#define VOXEL_MATERIAL "`bodies.material` of a voxel body" // its title: the path has two tables
#define VOXEL_ADAPT    "`bodies.adapt` of a voxel body"

// A group of nothing but what is under test.
#define GROUP(table, key, path)                                                                    \
    {table, key, key " = {"}, {path, NULL, ""},                                                    \
    {                                                                                              \
        table, key, "};"                                                                           \
    }

static const Line SCENE[] = {
    {"", NULL, "# a scene"},
    {"", "name", "name = \"base\";"},
    GROUP("", "publish", "publish"),
    GROUP("", "capacity", "capacity"),
    {"", "bodies", "bodies = ( {"},
    {"bodies", NULL, ""},
    {"bodies", "name", "name = \"sphere\";"},
    {"bodies", "mesh", "mesh = {"},
    {"bodies.mesh", NULL, ""},
    {"bodies.mesh", "generator", "generator = \"uv_sphere\";"},
    GROUP("bodies.mesh", "place", "bodies.mesh.place"),
    {"bodies", "mesh", "};"},
    {"bodies", "levels", "levels = 8;"},
    GROUP("bodies", "adapt", "bodies.adapt"),
    GROUP("bodies", "material", "bodies.material"),
    GROUP("bodies", "shape", "bodies.shape"),
    GROUP("bodies", "cavity", "bodies.cavity"),
    {"bodies", "cuttable", "cuttable = true;"},
    {"bodies", "tear", "tear = {"},
    {"bodies.tear", NULL, ""},
    {"bodies.tear", "stretch", "stretch = 0.5;"},
    {"bodies", "tear", "};"},
    GROUP("bodies", "contact", "bodies.contact"),
    {"bodies", "fixed", "fixed = ( {"},
    {"bodies.fixed", NULL, ""},
    {"bodies.fixed", "sphere", "sphere = [0, 0, -1];"},
    {"bodies.fixed", "radius", "radius = 0.5;"},
    {"bodies", "fixed", "} );"},
#ifdef PLIANT_WITH_VOXEL
    {"liver", "", "}, {"},
    {"liver", "", "name = \"liver\"; model = \"voxel\";"},
    {"liver", "", "voxels = {"},
    {"bodies.voxels", NULL, ""},
    {"bodies.voxels", "file", "file = \"liver.nrrd\";"},
    {"liver", "", "};"},
    {"liver", "", "material = {"},
    {VOXEL_MATERIAL, NULL, ""},
    {VOXEL_MATERIAL, "relaxation", "relaxation = ( {"},
    {"bodies.material.relaxation", NULL, ""},
    {"bodies.material.relaxation", "time", "time = 0.1;"},
    {"bodies.material.relaxation", "share", "share = 0.2;"},
    {VOXEL_MATERIAL, "relaxation", "} );"},
    {VOXEL_MATERIAL, "stiffening", "stiffening = {"},
    {"bodies.material.stiffening", NULL, ""},
    {"bodies.material.stiffening", "strain", "strain = 0.2;"},
    {"bodies.material.stiffening", "cap", "cap = 5.0;"},
    {VOXEL_MATERIAL, "stiffening", "};"},
    {"liver", "", "};"},
    {"liver", "", "weights = ( {"},
    {"bodies.weights", NULL, ""},
    {"bodies.weights", "sphere", "sphere = [0, 0, -1];"},
    {"bodies.weights", "radius", "radius = 0.5;"},
    {"bodies.weights", "mass", "mass = 0.5;"},
    {"liver", "", "} );"},
    {"liver", "", "materials = ( {"},
    {"bodies.materials", NULL, ""},
    {"bodies.materials", "label", "label = 1;"},
    {"liver", "", "} );"},
    {"liver", "", "skin = {"},
    {"bodies.skin", NULL, ""},
    {"bodies.skin", "mesh", "mesh = \"liver.stl\";"},
    {"liver", "", "};"},
    {"liver", "", "look = {"},
    {"bodies.look", NULL, ""},
    {"liver", "", "};"},
    {"liver", "", "}, {"},
    {"liver", "", "name = \"fine\"; model = \"voxel\"; voxels = { generator = \"box\"; };"},
    {"liver", "", "levels = {"},
    {"bodies.levels", NULL, ""},
    {"bodies.levels", "surface", "surface = 1;"},
    {"bodies.levels", "fine", "fine = ( {"},
    {"bodies.levels.fine", NULL, ""},
    {"bodies.levels.fine", "sphere", "sphere = [0, 0, -1];"},
    {"bodies.levels.fine", "radius", "radius = 0.5;"},
    {"bodies.levels", "fine", "} );"},
    {"liver", "", "};"},
    {"liver", "", "adapt = {"},
    {VOXEL_ADAPT, NULL, ""},
    {VOXEL_ADAPT, "error", "error = 0.1;"},
    {"liver", "", "};"},
#endif
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
    {"", "attachments", "attachments = ( {"},
    {"attachments", NULL, ""},
    {"attachments", "body", "body = \"sphere\";"},
    {"attachments", "sphere", "sphere = [0, 0, 1];"},
    {"attachments", "radius", "radius = 0.5;"},
    {"attachments", "to", "to = \"world\";"},
    {"", "attachments", "} );"},
#ifdef PLIANT_WITH_VOXEL
    {"", "touch", "touch = ( {"},
    {"touch", NULL, ""},
    {"touch", "bodies", "bodies = [\"sphere\", \"liver\"];"},
    {"", "touch", "} );"},
#endif
    {"", "loads", "loads = ( {"},
    {"loads", NULL, ""},
    {"loads", "center", "center = [0, 0, 0.05];"},
    {"loads", "radius", "radius = 0.02;"},
    {"loads", "force", "force = [0, 0, -1];"},
    {"loads", "duration", "duration = 2;"},
    {"", "loads", "} );"},
    {"", "score", "score = {"},
    {"score", NULL, ""},
    {"score", "regions", "regions = ( {"},
    {"score.regions", NULL, ""},
    {"score.regions", "sphere", "sphere = [0, 0, 1];"},
    {"score.regions", "radius", "radius = 0.5;"},
    {"score", "regions", "} );"},
    {"", "score", "};"},
};
enum { SCENE_LINES = sizeof SCENE / sizeof SCENE[0], SCENE_TEXT = 16384 };

static bool opens(const Line *line, const char *table)
{
    return line->key == NULL && strcmp(line->table, table) == 0;
}

// What tells a table from others in the lines above.
static const char *table_name(const OptionTable *table)
{
    const bool twice = table == &VOXEL_MATERIAL_TABLE || table == &VOXEL_ADAPT_TABLE;
    return twice ? table->title : table->path;
}

#ifdef PLIANT_WITH_VOXEL
static const bool with_voxel = true;
#else
static const bool with_voxel = false;
#endif
#ifdef PLIANT_WITH_PLANE
static const bool with_plane = true;
#else
static const bool with_plane = false;
#endif

// Without voxel bodies there is no place for what is theirs, nor a second body to touch.
static bool table_is_built(const OptionTable *table)
{
    return with_voxel ||
           (table != &VOXELS_TABLE && table != &VOXEL_MATERIAL_TABLE &&
            table != &LABEL_MATERIAL_TABLE && table != &SKIN_TABLE && table != &TOUCH_TABLE &&
            table != &BRANCH_TABLE && table != &STIFFENING_TABLE && table != &WEIGHT_TABLE &&
            table != &LEVELS_TABLE && table != &FINE_TABLE && table != &VOXEL_ADAPT_TABLE &&
            table != &LOOK_TABLE);
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

// `key = value` in its table must be refused at its line in a sentence that holds `part`.
static void expect_refused(const OptionTable *table, const char *key, const char *value,
                           const char *part)
{
    static char text[SCENE_TEXT], added[8192];
    char place[32];
    Scene scene;
    if (!table_is_built(table))
        return;
    snprintf(added, sizeof added, "%s = %s;", key, value);
    int line = compose(text, table_name(table), key, added);
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

AROUND_ALL(scratch_begin, scratch_end)

TEST(base_scene_is_valid)
{
    static char text[SCENE_TEXT];
    SCOPED(scene_destroy) Scene scene;
    compose(text, "", "no such key", "");
    assert_string_equal(read_as_scene(text, &scene), "");
}

TEST(every_table_refuses_an_unknown_key)
{
    for (int i = 0; i < SCENE_TABLE_COUNT; i++)
        expect_refused(scene_table(i), "zzz", "1", "unknown key");
}

TEST(every_key_refuses_a_wrong_type)
{
    for (int i = 0; i < SCENE_TABLE_COUNT; i++) {
        const OptionTable *table = scene_table(i);
        for (int k = 0; k < table->count; k++) {
            const Option *option = &table->option[k];
            bool string = option->type == OPTION_WORD || option->type == OPTION_NAME ||
                          option->type == OPTION_STRING;
            expect_refused(table, option->key,
                           string          ? "3"
                           : option->names ? "true"
                                           : "\"word\"",
                           "must be");
            if (option->type == OPTION_INT || option->type == OPTION_INTS)
                expect_refused(table, option->key, "1.0", "without a point");
            if (option->type == OPTION_INTS) {
                expect_refused(table, option->key, option->names ? "(1, true)" : "[1, 2, \"word\"]",
                               "must be");
                expect_refused(table, option->key, "[]", "is empty");
            }
            if (option->type == OPTION_WORD)
                expect_refused(table, option->key, "\"no such word\"", "must be");
            if (option->type == OPTION_VECTOR)
                expect_refused(table, option->key, "[1, 2]", "must be");
        }
    }
}

TEST(every_number_refuses_what_is_outside_its_range)
{
    char value[64];
    for (int i = 0; i < SCENE_TABLE_COUNT; i++) {
        const OptionTable *table = scene_table(i);
        for (int k = 0; k < table->count; k++) {
            const Option *option = &table->option[k];
            switch (option->type) {
            case OPTION_INT:
            case OPTION_INTS:
                snprintf(value, sizeof value, "%.0fL", option->low - 1.0);
                expect_refused(table, option->key, value, "outside");
                snprintf(value, sizeof value, "%.0fL", option->high + 1.0);
                expect_refused(table, option->key, value, "outside");
                break;
            case OPTION_REAL:
                snprintf(value, sizeof value, "%.17e",
                         option->open ? option->low : nextafter(option->low, -HUGE_VAL));
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

TEST(every_string_refuses_what_is_too_long)
{
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

TEST(every_required_key_is_missed)
{
    static char text[SCENE_TEXT];
    for (int i = 0; i < SCENE_TABLE_COUNT; i++) {
        const OptionTable *table = scene_table(i);
        for (int k = 0; k < table->count; k++) {
            const Option *option = &table->option[k];
            if (!option->required || !table_is_built(table))
                continue;
            char part[64];
            Scene scene;
            compose(text, table_name(table), option->key, "");
            snprintf(part, sizeof part, "%s is missing", option->key);
            const char *said = read_as_scene(text, &scene);
            expect_in(said, part);
            assert_int_equal(strncmp(said, "x.cfg:", 6), 0);
        }
    }
}

TEST(damaged_scenes_are_read_or_refused_in_one_line)
{
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

TEST(every_scene_in_config_is_valid)
{
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
        count++;
        if (!scene_read(path, &scene, &status) &&
            ((!with_voxel && strstr(status.text, "built without voxel bodies") != NULL) ||
             (!with_plane && strstr(status.text, "built without plane bodies") != NULL)))
            continue;
        if (status.code != STATUS_OK)
            print_error("%s\n", status.text);
        assert_int_equal(status.code, STATUS_OK);
        scene_destroy(&scene);
    }
    closedir(folder);
    assert_true(count >= 11);
}
