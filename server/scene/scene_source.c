// SPDX-License-Identifier: MIT
// Reads a scene file and its includes and refuses what libconfig 1.5 gets wrong: a folder or device
// as a file (its scanner ends the process), integers beyond 32 bits (it keeps their low bits), and
// files with more lines than its 16-bit line numbers can count.
#include "scene/scene_parts.h"

#include "base/check.h"

#include <ctype.h>
#include <errno.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

enum {
    BYTE_LIMIT = 16 << 20, // of all files, counted as often as they are included
    BYTES_A_FILE = 4096,   // count of an empty file, so that nested includes reach the limit
    LINE_LIMIT = 65535,
    DEPTH_LIMIT = 10, // libconfig's own
    LINE_SHOWN = 60,  // characters of an offending line
    WHY_MAX = 120,
};

// A file being checked.
typedef struct Scan {
    const char *folder; // of the scene file: all includes are relative to it; NULL: none allowed
    const char *shown;  // the file's name in errors
    int line;
    int depth;
    size_t *bytes; // of all files so far
    Status *status;
} Scan;

char *scene_source_folder(const char *path)
{
    const char *slash = strrchr(path, '/');
    char *folder = slash == NULL   ? strdup(".")
                   : slash == path ? strdup("/")
                                   : strndup(path, (size_t)(slash - path));
    ASSERT(folder != NULL);
    return folder;
}

char *scene_source_resolve(const char *folder, const char *name)
{
    bool plain = name[0] == '/' || strcmp(folder, ".") == 0;
    size_t size = strlen(folder) + strlen(name) + 2;
    char *path = malloc(size);
    ASSERT(path != NULL);
    snprintf(path, size, "%s%s%s", plain ? "" : folder, plain ? "" : "/", name);
    return path;
}

// Returns the text of a regular file, or NULL and the reason.
static char *read_text(const char *path, size_t *bytes, char why[WHY_MAX])
{
    // Only a regular file of bearable size: a folder or device would end the process in libconfig.
    struct stat info;
    if (stat(path, &info) != 0) {
        snprintf(why, WHY_MAX, ": %s", strerror(errno));
        return NULL;
    }
    snprintf(why, WHY_MAX, " is not a regular file");
    if (!S_ISREG(info.st_mode))
        return NULL;
    snprintf(why, WHY_MAX, " is too much: a scene and its includes hold at most 16 MiB");
    if (info.st_size > BYTE_LIMIT || *bytes + (size_t)info.st_size + BYTES_A_FILE > BYTE_LIMIT)
        return NULL;
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        snprintf(why, WHY_MAX, ": %s", strerror(errno));
        return NULL;
    }
    // Read all of it; a zero byte would hide the rest.
    char *text = malloc((size_t)info.st_size + 1);
    ASSERT(text != NULL);
    size_t length = fread(text, 1, (size_t)info.st_size, file);
    fclose(file);
    text[length] = '\0';
    *bytes += length + BYTES_A_FILE;
    if (strlen(text) == length)
        return text;
    snprintf(why, WHY_MAX, " holds a zero byte: it is not text, or not in UTF-8");
    free(text);
    return NULL;
}

static bool __attribute__((format(printf, 2, 3)))
scan_fail(const Scan *scan, const char *format, ...)
{
    char text[400];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return status_fail(scan->status, STATUS_INVALID, "%s:%d: %s", scan->shown, scan->line, text);
}

static bool scan_text(Scan *scan, char *text);

// At a line that begins with @include: checks the file that it names.
static bool scan_include(Scan *scan, const char *at)
{
    // Between the quotes is the name, relative to the scene's folder.
    const char *name = strchr(at, '"');
    const char *end = name != NULL ? strpbrk(name + 1, "\"\n") : NULL;
    if (end == NULL || *end != '"')
        return true; // libconfig reports the error
    if (scan->folder == NULL)
        return scan_fail(scan, "@include: the included file is not in here");
    char *file = strndup(name + 1, (size_t)(end - name - 1));
    ASSERT(file != NULL);
    char *path = scene_source_resolve(scan->folder, file);

    // What libconfig takes otherwise than one means is refused.
    char why[WHY_MAX] = "", *text = NULL;
    if (file[0] == '/' || strchr(file, '\\') != NULL)
        snprintf(why, sizeof why, " must be a path from the scene file's folder, written with /");
    else if (scan->depth == DEPTH_LIMIT)
        snprintf(why, sizeof why, " is nested deeper than %d files", DEPTH_LIMIT);
    else
        text = read_text(path, scan->bytes, why);
    bool ok = text != NULL;
    // The file is scanned like the one that names it.
    if (ok) {
        Scan inner = {scan->folder, file, 1, scan->depth + 1, scan->bytes, scan->status};
        ok = scan_text(&inner, text);
    } else {
        scan_fail(scan, "@include \"%.120s\"%s", file, why);
    }
    free(text);
    free(path);
    free(file);
    return ok;
}

// Skips a number; refuses integers that libconfig would silently truncate to 32 bits.
static const char *scan_number(const Scan *scan, const char *at)
{
    // The digits, in either base.
    const char *end = at + (*at == '+' || *at == '-');
    bool hex = end[0] == '0' && (end[1] == 'x' || end[1] == 'X') && isxdigit((unsigned char)end[2]);
    if (hex)
        end += 2;
    while (hex ? isxdigit((unsigned char)*end) : isdigit((unsigned char)*end))
        end++;
    bool real = !hex && (*end == '.' || *end == 'e' || *end == 'E');
    bool wide = *end == 'L';
    int length = (int)(end - at);
    // The numbers of libconfig that are not whole are doubles: they need no check.
    if (real) {
        while (*end == '.' || isdigit((unsigned char)*end) ||
               ((*end == '+' || *end == '-') && (end[-1] == 'e' || end[-1] == 'E')) ||
               *end == 'e' || *end == 'E')
            end++;
        return end;
    }
    // A whole one must fit its type, or libconfig keeps its low bits.
    errno = 0;
    long long value = strtoll(at, NULL, hex ? 16 : 10);
    if (errno != ERANGE && (wide || (value >= INT_MIN && value <= INT_MAX)))
        return end;
    scan_fail(scan, "integer %.*s%s does not fit %s bits",
              length < LINE_SHOWN ? length : LINE_SHOWN, at, length < LINE_SHOWN ? "" : "...",
              wide ? "64" : "32");
    return NULL;
}

// Skips a string; returns NULL if it does not end (libconfig would leak it).
static const char *skip_string(const char *at)
{
    for (at++; *at != '\0' && *at != '"'; at++)
        if (*at == '\\' && at[1] != '\0')
            at++;
    return *at == '"' ? at + 1 : NULL;
}

// Skips a comment or a word that begins at `at`; returns NULL if there is none.
static const char *skip_opaque(const char *at)
{
    // Comments of both kinds, and words, have no strings or numbers in them.
    if (*at == '#' || (at[0] == '/' && at[1] == '/'))
        return at + strcspn(at, "\n");
    if (at[0] == '/' && at[1] == '*') {
        const char *end = strstr(at + 2, "*/");
        return end != NULL ? end + 2 : at + strlen(at);
    }
    if (isalpha((unsigned char)*at) || *at == '*') {
        while (isalnum((unsigned char)*at) || *at == '_' || *at == '-' || *at == '*')
            at++;
        return at;
    }
    return NULL;
}

// Checks a file. Turns [ ] into ( ), since libconfig allows integers and reals together only in the
// latter; the readers accept both.
static bool scan_text(Scan *scan, char *text)
{
    bool line_start = true;
    for (char *at = text; *at != '\0';) {
        // Find the end of the token at `at`, whatever it is.
        const char *end = skip_opaque(at);
        bool sign = (*at == '+' || *at == '-') && isdigit((unsigned char)at[1]);
        if (line_start && strncmp(at, "@include", 8) == 0) {
            if (!scan_include(scan, at))
                return false;
            end = at + strcspn(at, "\n");
        } else if (sign || isdigit((unsigned char)*at)) {
            end = scan_number(scan, at);
            if (end == NULL)
                return false;
        } else if (*at == '"') {
            end = skip_string(at);
            if (end == NULL)
                return scan_fail(scan, "a string begins here and does not end");
        } else if (end == NULL) {
            *at = *at == '[' ? '(' : *at == ']' ? ')' : *at;
            end = at + 1;
        }
        // Move past the token and count its lines.
        for (; at < end; at++) {
            line_start = *at == '\n' || (line_start && (*at == ' ' || *at == '\t'));
            scan->line += *at == '\n';
        }
        if (scan->line > LINE_LIMIT)
            return scan_fail(scan, "more than %d lines", LINE_LIMIT);
    }
    return true;
}

// Copies line `line` of the text, trimmed, or "".
static void find_line(const char *text, int line, char shown[LINE_SHOWN + 1])
{
    for (; line > 1 && *text != '\0'; text++)
        line -= *text == '\n';
    text += strspn(text, " \t");
    snprintf(shown, LINE_SHOWN + 1, "%.*s", (int)strcspn(text, "\r\n"), text);
}

// Reports the error of libconfig's parser with its cure and the text of its line.
static bool fail_parse(const char *path, const char *folder, const char *text,
                       const config_t *config, Status *status)
{
    const char *file = config_error_file(config), *said = config_error_text(config);
    const int line = config_error_line(config);
    char shown[LINE_SHOWN + 1] = "", cure[2 * WHY_MAX] = "", why[WHY_MAX], *included = NULL;
    // An included file is read again.
    if (file != NULL) {
        char *found = scene_source_resolve(folder, file);
        included = read_text(found, &(size_t){0}, why);
        text = included;
        free(found);
    }
    if (text != NULL) {
        find_line(text, line, shown);
        scene_syntax_cure(text, line, cure, sizeof cure);
    }
    if (said != NULL && strstr(said, "mismatched element type") != NULL)
        snprintf(cure, sizeof cure, "in [ ] write 0.0 for 0, or use ( )");
    if (said != NULL && strstr(said, "duplicate setting") != NULL)
        snprintf(cure, sizeof cure, "it is given above, remove one of both");
    free(included);
    return status_fail(status, STATUS_INVALID, "%s:%d: %s%s%s%s%s", file != NULL ? file : path,
                       line, said != NULL ? said : "cannot be read", cure[0] != '\0' ? ": " : "",
                       cure, shown[0] != '\0' ? ": " : "", shown);
}

static bool ends_in(const char *path, const char *end)
{
    const size_t length = strlen(path), part = strlen(end);
    return length > part && strcasecmp(path + length - part, end) == 0;
}

// True with a status that says what to type, if a file that cannot be read as a scene has the name
// of something else that people have.
static bool is_other_file(const char *path, Status *status)
{
    static const char *const meshes[] = {".stl", ".obj",  ".ply",  ".off", ".vtk", ".vtu",  ".vtp",
                                         ".msh", ".mesh", ".node", ".ele", ".glb", ".gltf", ".fbx",
                                         ".3mf", ".dae",  ".step", ".stp", ".wrl", ".gii"};
    static const char *const volumes[] = {".nrrd", ".nhdr", ".nii", ".nii.gz", ".mha",
                                          ".mhd",  ".mgz",  ".mgh", ".dcm"};
    const char *what = NULL, *slash = strrchr(path, '/'), *base = slash != NULL ? slash + 1 : path;
    if (access(path, R_OK) != 0)
        return false;
    for (size_t i = 0; i < sizeof meshes / sizeof *meshes; i++)
        what = ends_in(path, meshes[i]) ? "a mesh" : what;
    for (size_t i = 0; i < sizeof volumes / sizeof *volumes; i++)
        what = ends_in(path, volumes[i]) ? "a volume" : what;
    if (what != NULL)
        status_fail(
            status, STATUS_INVALID,
            "%s: is %s, not a scene; pliant-prepare --propose %s -o %.*s.cfg writes a scene "
            "for it",
            path, what, path, (int)strcspn(base, "."), base);
    else if (ends_in(path, ".h5"))
        status_fail(status, STATUS_INVALID,
                    "%s: is no scene; a prepared file or a checkpoint goes with one: --prepared or "
                    "--resume %s SCENE.cfg",
                    path, path);
    return what != NULL || ends_in(path, ".h5");
}

char *scene_source_read(const char *path, config_t *config, Status *status)
{
    size_t bytes = 0;
    char why[WHY_MAX] = "";
    char *text = read_text(path, &bytes, why);
    if (text == NULL) {
        if (!is_other_file(path, status))
            status_fail(status, STATUS_INVALID, "%s%s", path, why);
        return NULL;
    }
    // Some editors begin a text with a byte order mark.
    if (strncmp(text, "\xEF\xBB\xBF", 3) == 0)
        memset(text, ' ', 3);
    // The scan changes brackets in a copy; the text itself is kept for files that we write.
    char *folder = scene_source_folder(path), *parsed = strdup(text);
    ASSERT(parsed != NULL);
    Status why_not = {0};
    Scan scan = {folder, path, 1, 0, &bytes, &why_not};
    bool ok = scan_text(&scan, parsed);
    if (ok) {
        config_set_include_dir(config, folder);
        ok = config_read_string(config, parsed) == CONFIG_TRUE ||
             fail_parse(path, folder, text, config, &why_not);
    }
    // What is no scene at all is named as what it is.
    if (!ok && !is_other_file(path, status))
        status_fail(status, why_not.code, "%s", why_not.text);
    free(parsed);
    free(folder);
    if (ok)
        return text;
    free(text);
    return NULL;
}

bool scene_source_parse(const char *name, const char *text, config_t *config, Status *status)
{
    size_t bytes = strlen(text);
    char *parsed = strdup(text);
    ASSERT(parsed != NULL);
    Scan scan = {NULL, name, 1, 0, &bytes, status};
    if (bytes > BYTE_LIMIT)
        status_fail(status, STATUS_INVALID, "%s is too much: a scene has at most 16 MiB", name);
    bool ok = bytes <= BYTE_LIMIT && scan_text(&scan, parsed);
    if (ok)
        ok = config_read_string(config, parsed) == CONFIG_TRUE ||
             fail_parse(name, ".", text, config, status);
    free(parsed);
    return ok;
}
