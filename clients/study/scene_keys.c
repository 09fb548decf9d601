// Converts cases to keys of a scene.
#include "study/scene_keys.h"

#include "study/field.h"
#include "study/world.h"

#include <math.h>
#include <string.h>

static SceneKey *add(SceneKeyList *list, const char *name)
{
    SceneKey *key = &list->key[list->count++];
    snprintf(key->name, sizeof key->name, "%s", name);
    key->value[0] = '\0';
    return key;
}

static void set_text(SceneKey *key, const char *text)
{
    snprintf(key->value, sizeof key->value, "\"%s\"", text);
}

// Formats a number so that it reads back as the same real.
static const char *real_text(double value, char *text)
{
    field_print_real(value, text);
    if (strpbrk(text, ".e") == NULL)
        strcat(text, ".0");
    return text;
}

static void set_real(SceneKey *key, double value)
{
    char text[FIELD_TEXT_MAX];
    snprintf(key->value, sizeof key->value, "%.60s", real_text(value, text));
}

// Lists the keys of a body that a case changes.
static void list_body(const SceneBody *body, SceneKeyList *list)
{
    static const char *const CHANGED[] = {"integrator", "time_step", "levels", "start_level",
                                          "adjust",     "adapt",     "law"};
    for (size_t i = 0; i < sizeof CHANGED / sizeof *CHANGED; i++) {
        SceneKey *key = add(list, CHANGED[i]);
        list->count -= !scene_key_text(body, CHANGED[i], key->value);
    }
}

bool scene_keys_of_case(const Scene *scene, const StudyCase *what, double rate_hz, SceneKeys *keys)
{
    StudyScene as_case;
    *keys = (SceneKeys){0};
    if (!study_copy_scene(scene, &as_case))
        return false;
    as_case.scene.rate_hz = rate_hz;
    study_change_scene(&as_case, what, 1.0 / rate_hz);
    set_real(add(&keys->top, "rate_hz"), as_case.scene.rate_hz);
    set_text(add(&keys->top, "precision"), study_precision_name(what->precision));
    for (int b = 0; b < scene->body_count && b < SCENE_KEYS_BODIES; b++) {
        const SceneBody *body = &as_case.body[b];
        snprintf(keys->name[b], sizeof keys->name[b], "%s", body->name);
        list_body(body, &keys->body[b]);
        keys->body_count = b + 1;
    }
    study_destroy_scene(&as_case);
    return true;
}

static void print_list(const SceneKeyList *list, const char *indent, FILE *out)
{
    for (int i = 0; i < list->count; i++)
        if (list->key[i].value[0] != '\0')
            fprintf(out, "%s%s = %s;\n", indent, list->key[i].name, list->key[i].value);
        else
            fprintf(out, "%s# no %s\n", indent, list->key[i].name);
}

void scene_keys_print(const SceneKeys *keys, FILE *out)
{
    print_list(&keys->top, "", out);
    for (int b = 0; b < keys->body_count; b++) {
        fprintf(out, "# in the body %s:\n", keys->name[b]);
        print_list(&keys->body[b], "    ", out);
    }
}
