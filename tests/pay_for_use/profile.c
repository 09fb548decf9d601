// SPDX-License-Identifier: MIT
#include "profile.h"

#include "harness.h"

#include <stdlib.h>
#include <string.h>

enum { NAME = 120, SOURCES = 1000 };

typedef struct Symbol {
    char name[NAME];
    int source;
} Symbol;

static char source[SOURCES][NAME];
static int source_count;
static Symbol *symbol;
static int symbol_count, symbol_capacity;

// ---------------------------------------------------------------------------------------------
// Where functions stand

static void read_sources(const char *folder)
{
    char command[1200];
    snprintf(command, sizeof command, "cd '%s/server' && find * -name '*.c'", folder);
    FILE *found = popen(command, "r");
    while (found != NULL && source_count < SOURCES &&
           fscanf(found, "%119s", source[source_count]) == 1)
        source_count++;
    if (found != NULL)
        pclose(found);
}

// The source of an object in the library of a module.
static int find_source(const char *room, const char *file)
{
    size_t length = strlen(room);
    for (int i = 0; i < source_count; i++) {
        const char *name = strrchr(source[i], '/');
        if (name != NULL && strcmp(name + 1, file) == 0 && strncmp(source[i], room, length) == 0 &&
            source[i][length] == '/')
            return i;
    }
    return -1;
}

// ".../libpliant_surface.a:refine.c.o:0000000000000000 t name"
static void read_symbol(char *line)
{
    char *room = strstr(line, "libpliant_"), *kind;
    char *library_end = room != NULL ? strstr(room, ".a:") : NULL;
    char *object_end = library_end != NULL ? strstr(library_end, ".o:") : NULL;
    if (object_end == NULL || (kind = strchr(object_end, ' ')) == NULL ||
        strchr("tT", kind[1]) == NULL)
        return;
    *library_end = *object_end = '\0';
    int from = find_source(room + strlen("libpliant_"), library_end + 3);
    if (from < 0)
        return;
    if (symbol_count == symbol_capacity) {
        symbol_capacity = 2 * symbol_capacity + 4096;
        symbol = realloc(symbol, (size_t)symbol_capacity * sizeof *symbol);
        assert_non_null(symbol);
    }
    Symbol *next = &symbol[symbol_count++];
    next->source = from;
    snprintf(next->name, NAME, "%.*s", (int)strcspn(kind + 3, "\n"), kind + 3);
}

bool profile_read_symbols(const char *build, const char *sources)
{
    char command[1200], line[1200];
    read_sources(sources);
    snprintf(command, sizeof command, "nm -A --defined-only '%s'/server/libpliant_*.a 2>/dev/null",
             build);
    FILE *names = popen(command, "r");
    while (names != NULL && fgets(line, sizeof line, names) != NULL)
        read_symbol(line);
    if (names != NULL)
        pclose(names);
    return symbol_count > 0;
}

const char *profile_file(const char *function)
{
    for (int i = 0; i < symbol_count; i++)
        if (strcmp(symbol[i].name, function) == 0)
            return source[symbol[i].source];
    return "?";
}

bool profile_is_in(const char *function, const char *const *beginnings)
{
    for (int i = 0; i < symbol_count; i++)
        if (strcmp(symbol[i].name, function) == 0)
            for (int k = 0; beginnings[k] != NULL; k++)
                if (strncmp(source[symbol[i].source], beginnings[k], strlen(beginnings[k])) == 0)
                    return true;
    return false;
}

// ---------------------------------------------------------------------------------------------
// What was executed

static ProfileFunction *find(Profile *profile, const char *name, bool ours)
{
    for (int i = 0; i < profile->count; i++)
        if (profile->function[i].ours == ours && strcmp(profile->function[i].name, name) == 0)
            return &profile->function[i];
    assert_true(profile->count < PROFILE_FUNCTIONS);
    ProfileFunction *made = &profile->function[profile->count++];
    *made = (ProfileFunction){.ours = ours};
    snprintf(made->name, sizeof made->name, "%s", name);
    return made;
}

// Functions and, below each, its costs by line; the cost behind "calls=" is that of the call.
static void read_profile(Profile *profile, FILE *file)
{
    char line[4096], name[NAME] = "";
    bool ours = false, is_call = false;
    while (fgets(line, sizeof line, file) != NULL) {
        line[strcspn(line, "\n")] = '\0';
        if (strncmp(line, "ob=", 3) == 0) {
            const char *base = strrchr(line, '/');
            ours = base != NULL && strcmp(base, "/pliantd") == 0;
        } else if (strncmp(line, "fn=", 3) == 0) {
            // A function that calls itself is "name'2" the second time.
            snprintf(name, sizeof name, "%.*s", (int)strcspn(line + 3, "'"), line + 3);
        } else if (strncmp(line, "calls=", 6) == 0) {
            is_call = true;
        } else if (line[0] >= '0' && line[0] <= '9') {
            const char *cost = strchr(line, ' ');
            long long own = cost != NULL && !is_call ? strtoll(cost, NULL, 10) : 0;
            if (own > 0)
                find(profile, name, ours)->instructions += own;
            profile->instructions += own;
            is_call = false;
        }
    }
}

void profile_run(Profile *profile, const char *valgrind, const char *program, const char *function,
                 const char *arguments)
{
    const char *out = scratch("callgrind.out");
    Process daemon;
    memset(profile, 0, sizeof *profile);
    process_run(&daemon, valgrind,
                "--tool=callgrind --compress-strings=no --compress-pos=no --toggle-collect=%s "
                "--callgrind-out-file=%s %s --log-level error %s",
                function, out, program, arguments);
    FILE *file = daemon.code == 0 ? fopen(out, "r") : NULL;
    if (file == NULL)
        fail_msg("%s %s: exit %d: %s", program, arguments, daemon.code, daemon.err);
    read_profile(profile, file);
    fclose(file);
    if (profile->instructions == 0)
        fail_msg("%s %s: nothing was counted inside %s", program, arguments, function);
}
