// SPDX-License-Identifier: MIT
// Rows for keys whose tables tell how to change them.
#include "rows.h"

#include "scene/scene_parts.h"

#include <math.h>
#include <string.h>

// Returns a number that is not the default, inside the range.
static double other_number(const Option *option)
{
    const double preset = fmax(option->preset, option->low);
    if (option->type == OPTION_INT)
        return preset < option->high ? preset + 1.0 : preset - 1.0;
    if (0.9 * preset > option->low)
        return 0.9 * preset;
    return preset + fmin(0.01, 0.1 * (option->high - preset));
}

// Writes another value than the default.
static void write_other(const Option *option, char *text, size_t size)
{
    const OptionWord *word = option->words;
    switch (option->type) {
    case OPTION_REAL:
    case OPTION_INT:
        snprintf(text, size, "%g", other_number(option));
        break;
    case OPTION_BOOL:
        snprintf(text, size, "%s", option->preset > 0.0 ? "false" : "true");
        break;
    case OPTION_WORD:
        snprintf(text, size, "\"%s\"", word[word->value == (int)option->preset].word);
        break;
    default:
        snprintf(text, size, "%s", option->type == OPTION_LIST ? "()" : "{}");
    }
}

bool key_row_make(const OptionTable *table, const Option *option, KeyModel model, MadeRow *made)
{
    const SceneModel scene_model = model == KEY_SURFACE ? MODEL_SURFACE : MODEL_VOXEL;
    const char *group = strncmp(table->path, "bodies.", 7) == 0 ? table->path + 7 : NULL;
    const bool used = option_is_used(option, (int)scene_model);
    const bool refused = table == &BODY_TABLE && !used;
    const bool number = option->type == OPTION_REAL || option->type == OPTION_INT ||
                        option->type == OPTION_BOOL || option->type == OPTION_WORD;
    if ((table != &BODY_TABLE && group == NULL) || (!refused && (!number || !used)))
        return false;
    char value[64];
    write_other(option, value, sizeof value);
    snprintf(made->base, sizeof made->base, group != NULL ? "%s = {};" : "%s",
             group != NULL ? group : "");
    snprintf(made->changed, sizeof made->changed,
             group != NULL ? "%s = { %s = %s; };" : "%s%s = %s;", group != NULL ? group : "",
             option->key, value);
    snprintf(made->said, sizeof made->said, "%s means nothing for a ", option->key);
    made->row = (KeyRow){.table = table,
                         .key = option->key,
                         .models = 1 << model,
                         .evidence = refused           ? REFUSED
                                     : option->physics ? STATE
                                                       : PLAN,
                         .part = BODY,
                         .base = made->base,
                         .changed = made->changed,
                         .said = made->said};
    return true;
}
