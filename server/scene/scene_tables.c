// SPDX-License-Identifier: MIT
// What the tables that read a scene file say of it otherwise: the groups of a body, the features
// that its keys enable, and the reference of all keys.
#include "scene/scene_parts.h"

#include "base/check.h"

#include <string.h>

const OptionTable *scene_table(int index)
{
    static const OptionTable *const TABLES[SCENE_TABLE_COUNT] = {
        &SCENE_TABLE,  &PUBLISH_TABLE,     &CAPACITY_TABLE,       &BODY_TABLE,
        &MESH_TABLE,   &PLACEMENT_TABLE,   &MATERIAL_TABLE,       &SHAPE_TABLE,
        &CAVITY_TABLE, &ADAPT_TABLE,       &VOXELS_TABLE,         &LEVELS_TABLE,
        &FINE_TABLE,   &VOXEL_ADAPT_TABLE, &VOXEL_MATERIAL_TABLE, &LABEL_MATERIAL_TABLE,
        &BRANCH_TABLE, &STIFFENING_TABLE,  &SKIN_TABLE,           &LOOK_TABLE,
        &TEAR_TABLE,   &CONTACT_TABLE,     &FIXED_TABLE,          &WEIGHT_TABLE,
        &TOOL_TABLE,   &CAPSULE_TABLE,     &PLANE_TABLE,          &ATTACHMENT_TABLE,
        &TOUCH_TABLE,  &LOAD_TABLE,        &SCORE_TABLE,          &SCORE_REGION_TABLE,
    };
    ASSERT(index >= 0 && index < SCENE_TABLE_COUNT);
    return TABLES[index];
}

int scene_list_groups(const SceneBody *body, KeyGroup group[KEY_GROUPS])
{
    const SurfaceOptions *surface = &body->surface;
    const Stiffening *stiffening =
        scene_has_cells(body) ? &body->voxel.stiffening : &surface->material.stiffening;
    int count = 0;
    // What all bodies have, then what belongs to the model.
    group[count++] = (KeyGroup){&BODY_TABLE, body, sizeof *body, false};
    group[count++] = (KeyGroup){&CONTACT_TABLE, body, sizeof *body, false};
    group[count++] = (KeyGroup){&TEAR_TABLE, body, sizeof *body, !body->options.cuttable};
    if (scene_has_cells(body)) {
        group[count++] = (KeyGroup){&VOXEL_MATERIAL_TABLE, body, sizeof *body, false};
        group[count++] =
            (KeyGroup){&LEVELS_TABLE, body, sizeof *body, body->voxel.surface_level == 0};
        group[count++] =
            (KeyGroup){&VOXEL_ADAPT_TABLE, body, sizeof *body, !(body->options.adapt_error > 0.0)};
    } else {
        group[count++] =
            (KeyGroup){&MATERIAL_TABLE, &surface->material, sizeof surface->material, false};
        group[count++] = (KeyGroup){&SHAPE_TABLE, &surface->shape, sizeof surface->shape,
                                    !surface->shape.wanted};
        group[count++] = (KeyGroup){&CAVITY_TABLE, &surface->cavity, sizeof surface->cavity,
                                    !surface->cavity.wanted};
        group[count++] =
            (KeyGroup){&ADAPT_TABLE, &surface->adapt, sizeof surface->adapt, !surface->adaptive};
    }
    group[count++] =
        (KeyGroup){&STIFFENING_TABLE, stiffening, sizeof *stiffening, !(stiffening->strain > 0.0)};
    return count;
}

// Returns the name of a group in its body; "" for the keys of the body itself.
static const char *group_name(const OptionTable *table)
{
    const char *dot = strchr(table->path, '.');
    return dot != NULL ? dot + 1 : strcmp(table->path, "bodies") == 0 ? "" : table->path;
}

// Writes the key with the name of its group, and the values that enable the feature.
static void name_key(char text[SCENE_VALUE_TEXT], const OptionTable *table, const Option *option)
{
    static const char *const FORMS[] = {[OPTION_BOOL] = " = true",
                                        [OPTION_VECTOR] = " = [ ... ]",
                                        [OPTION_GROUP] = " = { ... }",
                                        [OPTION_LIST] = " = ( ... )"};
    const char *group = group_name(table), *form = FORMS[option->type], *before = " =";
    size_t length =
        (size_t)snprintf(text, SCENE_VALUE_TEXT, "%s%s%s%s", group, *group != '\0' ? "." : "",
                         option->key, form != NULL ? form : "");
    // Every word but the default.
    for (int i = 0; option->type == OPTION_WORD && option->words[i].word != NULL; i++) {
        if (option->words[i].value == (int)option->preset)
            continue;
        length += (size_t)snprintf(text + length, SCENE_VALUE_TEXT - length, "%s \"%s\"", before,
                                   option->words[i].word);
        before = " or";
    }
}

void scene_print_feature(bool on, const char *name, const char *how, FILE *out)
{
    fprintf(out, "  %-3s  %-38s %s\n", on ? "on" : "off", name, how);
}

static bool can_have(const Option *option, const SceneBody *body)
{
    const unsigned only = option->feature.only;
    return body == NULL || (option_is_used(option, (int)body->model) &&
                            (only == 0 || (only & 1u << body->model) != 0));
}

// Prints the features of the rows of a group; `target` is what their offsets count from.
static void print_features(const OptionTable *table, const void *target, bool absent,
                           const OptionPlace *place, FILE *out)
{
    for (int i = 0; i < table->count; i++) {
        const Option *option = &table->option[i];
        const OptionFeature *feature = &option->feature;
        if (feature->name == NULL || !can_have(option, place->body))
            continue;
        char how[SCENE_VALUE_TEXT];
        name_key(how, table, option);
        const bool on = feature->on != NULL ? feature->on(place)
                                            : option_enables(table, i, target) &&
                                                  option_idle(option, place) == NULL;
        scene_print_feature(on && !absent, feature->name, feature->how != NULL ? feature->how : how,
                            out);
    }
}

void scene_print_features(const World *world, const Scene *scene, FILE *out)
{
    const OptionPlace place = {.scene = scene, .world = world};
    print_features(&SCENE_TABLE, scene, false, &place, out);
    print_features(&TOOL_TABLE, NULL, false, &place, out);
}

void scene_print_published(const World *world, const Scene *scene, FILE *out)
{
    const OptionPlace place = {.scene = scene, .world = world};
    print_features(&PUBLISH_TABLE, &scene->publish, false, &place, out);
}

void scene_print_body_features(const World *world, const Scene *scene, int body, FILE *out)
{
    const SceneBody *described = &scene->body[body];
    const OptionPlace place = {
        .scene = scene, .body = described, .world = world, .made = sim_body(world->sim, body)};
    KeyGroup group[KEY_GROUPS];
    for (int g = 0, groups = scene_list_groups(described, group); g < groups; g++)
        print_features(group[g].table, group[g].keys, group[g].absent, &place, out);
}

// Writes all keys of a group, but those that are not set and have no value then.
static void group_text(const KeyGroup *group, char text[SCENE_VALUE_TEXT])
{
    size_t length = (size_t)snprintf(text, SCENE_VALUE_TEXT, "{");
    const char *between = " ";
    for (int i = 0; i < group->table->count && length < SCENE_VALUE_TEXT; i++) {
        const Option *option = &group->table->option[i];
        char value[OPTION_NUMBER_TEXT];
        if (option->type == OPTION_LIST)
            continue;
        option_value_text(option, (const char *)group->keys + option->offset, value, sizeof value);
        if (value[0] == '\0')
            continue;
        length += (size_t)snprintf(text + length, SCENE_VALUE_TEXT - length, "%s%s = %s;", between,
                                   option->key, value);
        between = "  ";
    }
    ASSERT(length + 2 < SCENE_VALUE_TEXT);
    strcat(text, " }");
}

static const Option *find_key(const OptionTable *table, const char *key)
{
    for (int i = 0; i < table->count; i++)
        if (strcmp(table->option[i].key, key) == 0)
            return &table->option[i];
    return NULL;
}

bool scene_key_text(const SceneBody *body, const char *key, char text[SCENE_VALUE_TEXT])
{
    KeyGroup group[KEY_GROUPS];
    const Option *option = find_key(&BODY_TABLE, key);
    text[0] = '\0';
    if (option == NULL || !option_is_used(option, (int)body->model))
        return false;
    // A group with all of its keys but lists, or a key of its own.
    for (int g = 0, groups = scene_list_groups(body, group); g < groups; g++)
        if (strcmp(group_name(group[g].table), key) == 0 && !group[g].absent)
            group_text(&group[g], text);
    if (option->type != OPTION_GROUP && text[0] == '\0')
        option_value_text(option, (const char *)body + option->offset, text, SCENE_VALUE_TEXT);
    return true;
}

static const char INTRODUCTION[] =
    "# Scene files\n"
    "\n"
    "This page is generated from the tables that read scene files; a test keeps it up to\n"
    "date. The annotated scenes in this folder show every group in use: start from\n"
    "`minimal.cfg`.\n"
    "\n"
    "A scene is a [libconfig](https://hyperrealm.github.io/libconfig/) file:\n"
    "`key = value;`, groups `{ }`, lists `( )`, arrays `[ ]`, comments `#`, `//` and\n"
    "`/* */`, and `@include \"file\"` on a line of its own. Units are SI: metres, seconds,\n"
    "kilograms, newtons, radians.\n"
    "\n"
    "- A real may be written as an integer; an integer may not be written with a point.\n"
    "- A vector is three numbers in `[ ]` or `( )`, without a comma after the last. In\n"
    "  included files an array `[ ]` has numbers of one kind: write\n"
    "  `[0.0, 0.0, -9.81]` or `(0, 0, -9.81)` there.\n"
    "- A name consists of letters, digits, `_` and `-`.\n"
    "- File names are relative to the folder of the scene file; so are includes.\n"
    "- In ranges, `(` excludes its bound and `[` includes it. The range of a vector is\n"
    "  that of its length.\n"
    "- Integers are one number or a list of them.\n"
    "- *SET* is the command that changes the value while the scene runs.\n"
    "- Unknown keys, wrong types and values out of range are errors that name file and\n"
    "  line. A key that has no effect because of another one (`theta` with `leapfrog`) is "
    "accepted,\n"
    "  with a warning that says why.\n";

void scene_print_reference(FILE *out)
{
    fputs(INTRODUCTION, out);
    for (int i = 0; i < SCENE_TABLE_COUNT; i++)
        option_print_reference(scene_table(i), out);
}

// --- a table as Markdown; called by programs and tests, never while a scene runs -----------------

static const char *type_text(const Option *option)
{
    switch (option->type) {
    case OPTION_REAL:
        return "real";
    case OPTION_INT:
        return option->grouped ? "integer or group" : "integer";
    case OPTION_INTS:
        return option->names ? "integers or names" : "integers";
    case OPTION_BOOL:
        return "boolean";
    case OPTION_WORD:
        return "word";
    case OPTION_NAME:
        return "name";
    case OPTION_STRING:
        return "string";
    case OPTION_VECTOR:
        return "vector";
    case OPTION_GROUP:
        return "group";
    case OPTION_LIST:
        return "list";
    }
    return "";
}

static void print_range(const Option *option, FILE *out)
{
    char low[OPTION_NUMBER_TEXT], high[OPTION_NUMBER_TEXT];
    switch (option->type) {
    case OPTION_REAL:
    case OPTION_INT:
    case OPTION_INTS:
    case OPTION_VECTOR:
        fprintf(out, "%s%c%s, %s]", option->type == OPTION_VECTOR ? "length " : "",
                option->open ? '(' : '[', option_number_text(low, option->low),
                option_number_text(high, option->high));
        break;
    case OPTION_NAME:
    case OPTION_STRING:
        fprintf(out, "%.0f to %.0f characters", option->low, option->high);
        break;
    case OPTION_WORD:
        for (const OptionWord *word = option->words; word->word != NULL; word++)
            fprintf(out, "%s`\"%s\"`", word == option->words ? "" : ", ", word->word);
        break;
    default:
        break;
    }
}

static void print_default(const Option *option, FILE *out)
{
    char text[OPTION_NUMBER_TEXT];
    if (option->required) {
        fprintf(out, "required");
    } else if (option->preset_text != NULL) {
        fprintf(out, "%s", option->preset_text);
    } else if (option->type == OPTION_BOOL) {
        fprintf(out, "%s", option->preset > 0.0 ? "true" : "false");
    } else if (option->type == OPTION_REAL || option->type == OPTION_INT) {
        fprintf(out, "%s", option_number_text(text, option->preset));
    } else if (option->type == OPTION_VECTOR) {
        fprintf(out, "0 0 0");
    } else if (option->type == OPTION_WORD) {
        for (const OptionWord *word = option->words; word->word != NULL; word++)
            if (word->value == (int)option->preset)
                fprintf(out, "%s", word->word);
    } else {
        fprintf(out, "none");
    }
}

void option_print_reference(const OptionTable *table, FILE *out)
{
    // A heading, then a row a key.
    if (table->title != NULL)
        fprintf(out, "\n## %s\n\n%s\n\n", table->title, table->about);
    else if (table->path[0] != '\0')
        fprintf(out, "\n## `%s`\n\n%s\n\n", table->path, table->about);
    else
        fprintf(out, "\n## The scene itself\n\n%s\n\n", table->about);
    fprintf(out, "| key | type | unit | range | default | meaning |\n|---|---|---|---|---|---|\n");
    for (int i = 0; i < table->count; i++) {
        const Option *option = &table->option[i];
        fprintf(out, "| `%s` | %s | %s | ", option->key, type_text(option), option->unit);
        print_range(option, out);
        fprintf(out, " | ");
        print_default(option, out);
        fprintf(out, " | %s", option->about);
        if (option->live != NULL)
            fprintf(out, " SET: `%s`.", option->live);
        fprintf(out, " |\n");
    }
}
