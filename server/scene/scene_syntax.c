// SPDX-License-Identifier: MIT
// Says what libconfig's parser does not: what is wrong in the text at which it stopped, and what is
// right. It follows the same grammar, but knows the mistakes that people make. Load time only.
#include "scene/scene_parts.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { NESTED = 64, SHOWN = 40 };

// WORD: a key, true or false; any other character is a token of its own, '\0' the end.
typedef enum TokenKind { TOKEN_MARK, TOKEN_WORD, TOKEN_NUMBER, TOKEN_STRING } TokenKind;
typedef struct Token {
    TokenKind kind;
    const char *at;
    int length, line;
} Token;

typedef struct Syntax {
    Token now, before, earlier; // the token and the two before it
    char open[NESTED];          // brackets that are open,
    int open_line[NESTED];      // and where they began
    int depth;
    char *cure;
    size_t size;
} Syntax;

static bool is_mark(const Token *token, const char *marks)
{
    return token->kind == TOKEN_MARK && *token->at != '\0' && strchr(marks, *token->at) != NULL;
}

static size_t blanks(const char *at, int *line)
{
    const char *start = at;
    for (;; at++) {
        if (*at == '#' || *at == '@' || (at[0] == '/' && at[1] == '/'))
            at += strcspn(at, "\n");
        const char *end = at[0] == '/' && at[1] == '*' ? strstr(at + 2, "*/") : NULL;
        for (; end != NULL && at < end + 1; at++)
            *line += *at == '\n';
        if (end == NULL && (*at == '\0' || !isspace((unsigned char)*at)))
            return (size_t)(at - start);
        *line += *at == '\n';
    }
}

// Finds the token after `token`.
static Token next_token(const Token *token)
{
    Token next = {.at = token->at + token->length, .line = token->line};
    next.at += blanks(next.at, &next.line);
    const char *at = next.at, *end = at + (*at != '\0');
    const bool sign = *at == '+' || *at == '-', point = at[sign] == '.';
    if (isdigit((unsigned char)at[sign + point])) {
        next.kind = TOKEN_NUMBER;
        for (end = at + sign; isalnum((unsigned char)*end) || *end == '.'; end++)
            if ((end[0] == 'e' || end[0] == 'E') && (end[1] == '-' || end[1] == '+'))
                end++;
    } else if (isalpha((unsigned char)*at) || *at == '*' || *at == '_') {
        next.kind = TOKEN_WORD;
        while (isalnum((unsigned char)*end) || (*end != '\0' && strchr("_-*", *end) != NULL))
            end++;
    } else if (*at == '"') {
        next.kind = TOKEN_STRING;
        while (*end != '\0' && *end != '"')
            end += *end == '\\' && end[1] != '\0' ? 2 : 1;
        end += *end == '"';
    }
    next.length = (int)(end - at);
    return next;
}

static bool is_word(const Token *token, const char *words)
{
    // `words` are separated and enclosed by blanks.
    char word[SHOWN];
    if (token->kind != TOKEN_WORD || token->length >= SHOWN - 2)
        return false;
    snprintf(word, sizeof word, " %.*s ", token->length, token->at);
    return strcasestr(words, word) != NULL;
}

static int shown(const Token *token)
{
    return token->length < SHOWN ? token->length : SHOWN;
}

#define NO_UNIT          "a number has no unit: %.*s without %.*s, in m, kg, s, N or Pa"
#define SAY(syntax, ...) (snprintf((syntax)->cure, (syntax)->size, __VA_ARGS__), true)

// A word where a value belongs.
static bool is_bare_word(Syntax *s)
{
    const Token next = next_token(&s->now);
    if (is_word(&s->now, " true false "))
        return false;
    if (is_mark(&next, "=:") && is_mark(&s->before, "=:"))
        return SAY(s, "%.*s has no value", shown(&s->earlier), s->earlier.at);
    if (is_mark(&next, "=:"))
        return SAY(s, "keys in a list stand in groups: ( { %.*s = ...; } )", shown(&s->now),
                   s->now.at);
    if (is_word(&s->now, " yes on no off "))
        return SAY(s, "%.*s is written %s", s->now.length, s->now.at,
                   is_word(&s->now, " yes on ") ? "true" : "false");
    if (is_word(&s->now, " nan inf infinity "))
        return SAY(s, "%.*s is no number of a scene", s->now.length, s->now.at);
    // File names have points and slashes.
    int length = (int)strcspn(s->now.at, ";,)]}\"\r\n");
    while (s->now.at[length - 1] == ' ')
        length--;
    return SAY(s, "a text has quotes: \"%.*s\"", length < SHOWN ? length : SHOWN, s->now.at);
}

// What stands where a value belongs, after = or in a list.
static bool is_wrong_value(Syntax *s)
{
    static const char *const marks[] = {"'",
                                        "`",
                                        "\xe2\x80\x9c",
                                        "\xe2\x80\x9d",
                                        "\xe2\x80\x9e",
                                        "\xe2\x80\x98",
                                        "\xe2\x80\x99",
                                        "\xc2\xab"};
    if (s->now.kind == TOKEN_WORD)
        return is_bare_word(s);
    for (size_t i = 0; i < sizeof marks / sizeof *marks; i++)
        if (strncmp(s->now.at, marks[i], strlen(marks[i])) == 0)
            return SAY(s, "the quotes of a text are \" and \"");
    if (is_mark(&s->now, ";},") && is_mark(&s->before, "=:"))
        return SAY(s, "%.*s has no value", shown(&s->earlier), s->earlier.at);
    return is_mark(&s->before, ",") && is_mark(&s->now, ",)]") &&
           SAY(s, "no value follows the last comma");
}

// What follows a number that is no number of libconfig, or a key without =.
static bool is_wrong_key(Syntax *s)
{
    const Token next = next_token(&s->now);
    const bool same_line = s->before.line == s->now.line;
    if (s->now.kind == TOKEN_NUMBER && is_mark(&s->before, ",") &&
        s->earlier.kind == TOKEN_NUMBER && same_line)
        return SAY(s, "a decimal has a point: %.*s.%.*s", shown(&s->earlier), s->earlier.at,
                   shown(&s->now), s->now.at);
    if (s->now.kind == TOKEN_STRING && is_mark(&next, ":="))
        return SAY(s, "a key has no quotes");
    if (s->now.kind != TOKEN_WORD || is_mark(&next, "=:"))
        return false;
    if (s->before.kind == TOKEN_NUMBER && same_line)
        return SAY(s, NO_UNIT, shown(&s->before), s->before.at, shown(&s->now), s->now.at);
    return SAY(s, "%.*s is followed by neither = nor a value, as in %.*s = ...;", shown(&s->now),
               s->now.at, shown(&s->now), s->now.at);
}

static bool is_wrong_bracket(Syntax *s)
{
    const char open = s->depth > 0 ? s->open[s->depth - 1] : '\0';
    if (*s->now.at == '\0' && s->now.kind == TOKEN_MARK)
        return open != '\0' &&
               SAY(s, "%c of line %d is not closed", open, s->open_line[s->depth - 1]);
    if (!is_mark(&s->now, ")]}") || (*s->now.at == '}') == (open == '{'))
        return false;
    if (open == '\0')
        return SAY(s, "%c closes nothing", *s->now.at);
    return SAY(s, "%c is here before %c of line %d is closed", *s->now.at, open,
               s->open_line[s->depth - 1]);
}

// Numbers with a unit behind them, or with points between thousands.
static bool is_wrong_number(Syntax *s)
{
    char *end;
    if (s->now.kind != TOKEN_NUMBER)
        return false;
    strtod(s->now.at, &end);
    end += strspn(end, "L");
    const int left = s->now.length - (int)(end - s->now.at);
    if (left <= 0)
        return false;
    if (*end == '.')
        return SAY(s, "%.*s has more than one point", shown(&s->now), s->now.at);
    return SAY(s, NO_UNIT, (int)(end - s->now.at), s->now.at, left < SHOWN ? left : SHOWN, end);
}

// What follows a value in a list.
static bool is_wrong_in_list(Syntax *s)
{
    const bool joined = s->before.kind == TOKEN_STRING && s->now.kind == TOKEN_STRING;
    if (is_mark(&s->now, ",)]}") || joined || *s->now.at == '\0')
        return is_wrong_bracket(s);
    if (s->before.kind == TOKEN_NUMBER && s->now.kind == TOKEN_WORD)
        return SAY(s, NO_UNIT, shown(&s->before), s->before.at, shown(&s->now), s->now.at);
    if (is_mark(&s->now, ";"))
        return SAY(s, "entries of a list are separated by commas");
    return SAY(s, "a comma is missing before %.*s", shown(&s->now), s->now.at);
}

// Characters that mean nothing in a scene.
static bool is_stray(Syntax *s)
{
    if (s->now.kind != TOKEN_MARK || *s->now.at == '\0' || strchr("=:;,()[]{}", *s->now.at) != NULL)
        return false;
    if ((*s->now.at & 0x80) != 0)
        return SAY(s, "only texts in quotes and comments hold other characters than ASCII");
    return SAY(s, "%c means nothing here", *s->now.at);
}

// True if the token is one that cannot be there.
static bool is_wrong(Syntax *s)
{
    const char open = s->depth > 0 ? s->open[s->depth - 1] : '\0';
    const bool in_list = open == '(' || open == '[';
    if (is_mark(&s->before, "=:([") || (in_list && is_mark(&s->before, ",")))
        return is_wrong_number(s) || is_wrong_value(s) || is_wrong_bracket(s) || is_stray(s);
    if (in_list)
        return is_wrong_in_list(s);
    return is_wrong_bracket(s) || is_wrong_key(s) || is_stray(s);
}

void scene_syntax_cure(const char *text, int line, char *cure, size_t size)
{
    const Token start = {.kind = TOKEN_MARK, .at = ";", .line = 1};
    Syntax s = {.before = start, .earlier = start, .cure = cure, .size = size};
    s.now = (Token){.kind = TOKEN_MARK, .at = text, .line = 1};
    cure[0] = '\0';
    for (;;) {
        s.now = next_token(&s.now);
        if (s.now.line > line || is_wrong(&s) || *s.now.at == '\0')
            return;
        // Brackets that are open, as far as they are counted.
        if (is_mark(&s.now, "([{") && s.depth < NESTED) {
            s.open[s.depth] = *s.now.at;
            s.open_line[s.depth++] = s.now.line;
        }
        s.depth -= is_mark(&s.now, ")]}") && s.depth > 0;
        s.earlier = s.before;
        s.before = s.now;
    }
}
