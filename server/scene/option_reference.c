// Prints an option table as Markdown. Called by programs and tests, never while a scene runs.
#include "scene/option_table.h"

static const char *type_text(const Option *option)
{
    switch (option->type) {
    case OPTION_REAL:
        return "real";
    case OPTION_INT:
        return "integer";
    case OPTION_INTS:
        return "integers";
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
        fprintf(out, " |\n");
    }
}
