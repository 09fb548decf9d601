// SPDX-License-Identifier: MIT
// Converts cases to keys of a scene.
#include "study/scene_keys.h"

#include "base/check.h"
#include "study/report.h"
#include "study/context.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

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
    // The keys are those that make the scene into the case.
    as_case.scene.sim.rate_hz = rate_hz;
    study_change_scene(&as_case, what, 1.0 / rate_hz);
    set_real(add(&keys->top, "rate_hz"), as_case.scene.sim.rate_hz);
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

// --- the text of a scene -------------------------------------------------------------------------

// Sets keys in the text of a scene file and leaves the rest unchanged: one pass that copies, and
// stops where a key is or belongs. Knows enough of libconfig's grammar to tell names from values;
// scene_read checks the meaning.

enum { DEPTH_MAX = 64, NAME_MAX_LENGTH = 64 };

// Location of a group of settings.
typedef enum Scope { SCOPE_TOP, SCOPE_BODY_LIST, SCOPE_BODY, SCOPE_OTHER } Scope;

typedef struct Editor {
    const char *path, *text;
    size_t at;     // next character to read
    size_t copied; // first character that is not in `out` yet
    FILE *out;
    const SceneKeys *keys;
    char *folder; // absolute, of `path`
    int body;     // bodies behind
    bool muted;   // inside a value that is replaced anyway
    Status *status;
} Editor;

static bool fail(Editor *e, const char *what)
{
    int line = 1;
    for (size_t i = 0; i < e->at && e->text[i] != '\0'; i++)
        line += e->text[i] == '\n';
    return status_fail(e->status, STATUS_INVALID, "%s:%d: %s", e->path, line, what);
}

static void copy_until(Editor *e, size_t end)
{
    if (!e->muted && end > e->copied) {
        fwrite(e->text + e->copied, 1, end - e->copied, e->out);
        e->copied = end;
    }
}

// Replaces [begin, end) by `text`.
static void replace(Editor *e, size_t begin, size_t end, const char *text)
{
    if (e->muted)
        return;
    copy_until(e, begin);
    fputs(text, e->out);
    e->copied = end;
}

// --- tokens --------------------------------------------------------------------------------------

static const char *here(const Editor *e)
{
    return e->text + e->at;
}

static void skip_line(Editor *e)
{
    e->at += strcspn(here(e), "\n");
}

// Skips a string that begins here; its content is between the quotes.
static bool skip_string(Editor *e)
{
    for (e->at++; *here(e) != '\0' && *here(e) != '"'; e->at++)
        if (*here(e) == '\\' && here(e)[1] != '\0')
            e->at++;
    if (*here(e) == '\0')
        return fail(e, "a text has no end");
    e->at++;
    return true;
}

static bool skip_space(Editor *e)
{
    for (;;) {
        const char *c = here(e);
        if (isspace((unsigned char)*c)) {
            e->at++;
        } else if (*c == '#' || strncmp(c, "//", 2) == 0) {
            skip_line(e);
        } else if (strncmp(c, "/*", 2) == 0) {
            const char *end = strstr(c + 2, "*/");
            if (end == NULL)
                return fail(e, "a comment has no end");
            e->at = (size_t)(end - e->text) + 2;
        } else if (strncmp(c, "@include", 8) == 0) {
            return fail(e,
                        "a scene with @include, seen from its own folder, has no copy elsewhere");
        } else {
            return true;
        }
    }
}

// --- files ---------------------------------------------------------------------------------------

// Makes the file name in the string [begin, end), quotes included, absolute.
static void absolute_path(Editor *e, size_t begin, size_t end)
{
    if (e->text[begin + 1] == '/' || end - begin <= 2)
        return;
    copy_until(e, begin + 1);
    if (!e->muted)
        fprintf(e->out, "%s/", e->folder);
}

static bool names_a_file(const char *name)
{
    return strcmp(name, "file") == 0 || strcmp(name, "mesh") == 0 || strcmp(name, "initial") == 0 ||
           strcmp(name, "prepared") == 0;
}

// --- settings ------------------------------------------------------------------------------------

// Returns the keys to set in a group at `scope`, or NULL.
static const SceneKeyList *wanted(const Editor *e, Scope scope)
{
    if (scope == SCOPE_TOP)
        return &e->keys->top;
    return scope == SCOPE_BODY && e->body < e->keys->body_count ? &e->keys->body[e->body] : NULL;
}

static bool edit_settings(Editor *e, Scope scope, char end, int depth);

// Copies a list or an array: values up to `end`, separated by commas.
static bool edit_list(Editor *e, Scope scope, char end, int depth);

static bool edit_value(Editor *e, Scope scope, int depth)
{
    if (depth > DEPTH_MAX)
        return fail(e, "groups lie too deep in each other");
    switch (*here(e)) {
    case '{':
        e->at++;
        return edit_settings(e, scope == SCOPE_BODY_LIST ? SCOPE_BODY : SCOPE_OTHER, '}',
                             depth + 1);
    case '(':
        e->at++;
        return edit_list(e, scope, ')', depth + 1);
    case '[':
        e->at++;
        return edit_list(e, SCOPE_OTHER, ']', depth + 1);
    case '"':
        // Adjacent strings are one.
        while (*here(e) == '"')
            if (!skip_string(e) || !skip_space(e))
                return false;
        return true;
    default: {
        size_t length = strcspn(here(e), " \t\r\n;,:={}()[]\"#");
        e->at += length;
        return length > 0 || fail(e, "a value is missing");
    }
    }
}

static bool edit_list(Editor *e, Scope scope, char end, int depth)
{
    for (;;) {
        // Values, with commas between them.
        if (!skip_space(e))
            return false;
        if (*here(e) == end) {
            e->at++;
            return true;
        }
        if (*here(e) == ',')
            e->at++;
        else if (!edit_value(e, scope, depth))
            return false;
    }
}

static bool read_name(Editor *e, char name[NAME_MAX_LENGTH])
{
    size_t length = 0;
    while (isalnum((unsigned char)here(e)[length]) ||
           (here(e)[length] != '\0' && strchr("*_-", here(e)[length]) != NULL))
        length++;
    if (length == 0 || length >= NAME_MAX_LENGTH)
        return fail(e, "this is no scene: a key is missing or too long");
    memcpy(name, here(e), length);
    name[length] = '\0';
    e->at += length;
    return true;
}

// Copies one setting with its terminator. `key`: its new value, or NULL.
static bool edit_setting(Editor *e, Scope scope, const char *name, const SceneKey *key,
                         size_t name_begin, int depth)
{
    // Between the name and its value.
    if (!skip_space(e))
        return false;
    if (*here(e) != '=' && *here(e) != ':')
        return fail(e, "this is no scene: a key without a value");
    e->at++;
    if (!skip_space(e))
        return false;
    size_t begin = e->at;
    bool was_muted = e->muted;
    Scope inside =
        scope == SCOPE_TOP && strcmp(name, "bodies") == 0 ? SCOPE_BODY_LIST : SCOPE_OTHER;
    // Relative names would be wrong in another folder.
    if (*here(e) == '"' && names_a_file(name))
        absolute_path(e, begin, begin + 2 + strcspn(here(e) + 1, "\""));
    // Within a value that is replaced nothing else is edited.
    e->muted = was_muted || key != NULL;
    bool ok = edit_value(e, inside, depth);
    e->muted = was_muted;
    size_t end = e->at;
    while (end > begin && isspace((unsigned char)e->text[end - 1])) // blanks after a string
        end--;
    if (!ok || !skip_space(e))
        return false;
    // Replace the value, or remove the whole setting.
    bool terminated = *here(e) == ';' || *here(e) == ',';
    e->at += terminated;
    if (key != NULL && key->value[0] != '\0')
        replace(e, begin, end, key->value);
    else if (key != NULL)
        replace(e, name_begin, terminated ? e->at : end, "");
    return true;
}

// Adds the keys that a group lacks at its end.
static void add_missing(Editor *e, const SceneKeyList *list, const bool *found)
{
    copy_until(e, e->at);
    for (int i = 0; i < list->count; i++)
        if (!found[i] && list->key[i].value[0] != '\0')
            fprintf(e->out, "  %s = %s;\n", list->key[i].name, list->key[i].value);
}

static bool edit_settings(Editor *e, Scope scope, char end, int depth)
{
    static const SceneKeyList none = {0};
    const SceneKeyList *list = wanted(e, scope) != NULL ? wanted(e, scope) : &none;
    bool found[SCENE_KEYS] = {false};
    for (;;) {
        // A name, or the end of the group.
        char name[NAME_MAX_LENGTH];
        if (!skip_space(e))
            return false;
        if (*here(e) == end)
            break;
        size_t begin = e->at;
        if (!read_name(e, name))
            return false;
        // Is it one of those that are wanted?
        const SceneKey *key = NULL;
        for (int i = 0; i < list->count; i++)
            if (strcmp(list->key[i].name, name) == 0) {
                key = &list->key[i];
                found[i] = true;
            }
        if (!edit_setting(e, scope, name, key, begin, depth))
            return false;
    }
    // Keys that were not there are added at the end.
    add_missing(e, list, found);
    e->body += scope == SCOPE_BODY;
    e->at += end != '\0';
    return true;
}

// --- whole files ---------------------------------------------------------------------------------

static char *read_text(const char *path, Status *status)
{
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    long size = -1;
    // The whole file.
    if (file != NULL && fseek(file, 0, SEEK_END) == 0 && (size = ftell(file)) >= 0) {
        rewind(file);
        text = calloc((size_t)size + 1, 1);
        ASSERT(text != NULL);
        if (fread(text, 1, (size_t)size, file) != (size_t)size) {
            free(text);
            text = NULL;
        }
    }
    if (text == NULL)
        status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    if (file != NULL)
        fclose(file);
    return text;
}

static char *folder_of(const char *path)
{
    char *whole = realpath(path, NULL);
    ASSERT(whole != NULL); // it was read a moment ago
    *strrchr(whole, '/') = '\0';
    return whole;
}

bool scene_keys_set(const SceneKeys *keys, const char *from, const char *to, Status *status)
{
    char *text = read_text(from, status);
    if (text == NULL)
        return false;
    // Write the copy while the text is read.
    FILE *out = fopen(to, "w");
    if (out == NULL) {
        free(text);
        return status_fail(status, STATUS_FAILED, "%s: %s", to, strerror(errno));
    }
    Editor editor = {.path = from,
                     .text = text,
                     .out = out,
                     .keys = keys,
                     .folder = folder_of(from),
                     .status = status};
    bool ok = edit_settings(&editor, SCOPE_TOP, '\0', 0);
    ok = fclose(out) == 0 && ok;
    free(editor.folder);
    free(text);
    if (ok)
        return true;
    // A copy that is not whole is worse than none.
    int error = errno;
    unlink(to);
    return status_fail(status, STATUS_FAILED, "%s: %s", to, strerror(error));
}
