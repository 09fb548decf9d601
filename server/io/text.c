#include "io/text.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

Text text_start(const FileBytes *file)
{
    return (Text){
        .path = file->path, .at = file->bytes, .end = file->bytes + file->size, .line = 1};
}

// Returns the length of a backslash and the line end that it hides, or 0.
static int continuation(const Text *text)
{
    if (text->at[0] != '\\')
        return 0;
    if (text->at[1] == '\n')
        return 2;
    return text->at[1] == '\r' && text->at[2] == '\n' ? 3 : 0;
}

Word text_word(Text *text)
{
    for (;;) {
        int skip = continuation(text);
        if (skip > 0)
            text->line++;
        else if (text->at < text->end && is_blank(*text->at))
            skip = 1;
        else
            break;
        text->at += skip;
    }
    Word word = {.at = text->at, .line = text->line};
    if (text->at == text->end || *text->at == '\n' || *text->at == '#')
        return word;
    while (text->at < text->end && !is_blank(*text->at) && *text->at != '\n' &&
           continuation(text) == 0)
        text->at++;
    word.size = (int)(text->at - word.at);
    return word;
}

void text_next_line(Text *text)
{
    const char *newline = memchr(text->at, '\n', (size_t)(text->end - text->at));
    text->at = newline == NULL ? text->end : newline + 1;
    text->line += newline != NULL;
}

Word text_word_anywhere(Text *text)
{
    Word word = text_word(text);
    while (word.size == 0 && text->at < text->end) {
        text_next_line(text);
        word = text_word(text);
    }
    return word;
}

bool word_is(Word word, const char *name)
{
    return strlen(name) == (size_t)word.size && strncasecmp(word.at, name, (size_t)word.size) == 0;
}

bool word_number(Word word, double *value)
{
    // strtod stops at the blank, line end or final 0 after every word.
    char *end;
    if (word.size == 0)
        return false;
    *value = strtod(word.at, &end);
    return end == word.at + word.size;
}

Shown word_show(Word word)
{
    Shown shown;
    int size = word.size < 30 ? word.size : 30;
    for (int i = 0; i < size; i++)
        shown.text[i] = word.at[i] >= ' ' && word.at[i] <= '~' ? word.at[i] : '?';
    strcpy(shown.text + size, word.size > size ? "..." : "");
    return shown;
}
