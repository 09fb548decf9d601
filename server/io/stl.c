// STL, ASCII and binary. Ignores normals: the order of corners defines the outside. Load time only.
#include "io/mesh_formats.h"

#include <stdint.h>
#include <string.h>

enum { HEADER_SIZE = 84, RECORD_SIZE = 50 };

// Requires the next word to be `name`; sets `line` to its line.
static bool expect_word(Text *text, const char *name, int *line, Status *status)
{
    Word word = text_word_anywhere(text);
    *line = word.line;
    if (word.size == 0)
        return status_fail(status, STATUS_INVALID, "%s:%d: file ends where '%s' is expected",
                           text->path, word.line, name);
    if (!word_is(word, name))
        return status_fail(status, STATUS_INVALID, "%s:%d: '%s' where '%s' is expected", text->path,
                           word.line, word_show(word).text, name);
    return true;
}

static bool read_vertex(Text *text, MeshDraft *draft, Status *status)
{
    int line;
    if (!expect_word(text, "vertex", &line, status))
        return false;
    double x[3];
    for (int k = 0; k < 3; k++) {
        Word word = text_word_anywhere(text);
        if (word.size == 0)
            return status_fail(status, STATUS_INVALID, "%s:%d: file ends inside a vertex",
                               text->path, word.line);
        if (!word_number(word, &x[k]))
            return status_fail(status, STATUS_INVALID, "%s:%d: coordinate '%s' is not a number",
                               text->path, word.line, word_show(word).text);
    }
    mesh_draft_add_node(draft, vec3(x[0], x[1], x[2]));
    return true;
}

// Reads a facet after the word 'facet'.
static bool read_facet(Text *text, MeshDraft *draft, Status *status)
{
    int line = text->line, unused;
    if (!expect_word(text, "normal", &unused, status))
        return false;
    for (int k = 0; k < 3; k++) // some writers give nan for thin triangles
        text_word_anywhere(text);
    if (!expect_word(text, "outer", &unused, status) || !expect_word(text, "loop", &unused, status))
        return false;
    for (int k = 0; k < 3; k++) {
        mesh_draft_add_corner(draft, draft->node_count, -1);
        if (!read_vertex(text, draft, status))
            return false;
    }
    if (!expect_word(text, "endloop", &unused, status) ||
        !expect_word(text, "endfacet", &unused, status))
        return false;
    mesh_draft_end_polygon(draft, line);
    return true;
}

// True for 'endsolid', or as some writers have it, 'end solid'.
static bool ends_solid(Text *text, Word word)
{
    if (!word_is(word, "end"))
        return word_is(word, "endsolid");
    return word_is(text_word(text), "solid");
}

// Reads any number of solids, each 'solid name', facets, 'endsolid name'.
static bool read_solids(Text *text, MeshDraft *draft, Status *status)
{
    int line;
    bool inside = false;
    for (Word word = text_word_anywhere(text); word.size > 0 && !draft->full;
         word = text_word_anywhere(text)) {
        if (inside && word_is(word, "facet")) {
            if (!read_facet(text, draft, status))
                return false;
        } else if (inside ? ends_solid(text, word) : word_is(word, "solid")) {
            inside = !inside;
            text_next_line(text); // a name may be any text
        } else {
            return status_fail(status, STATUS_INVALID, "%s:%d: '%s' where '%s' is expected",
                               text->path, word.line, word_show(word).text,
                               inside ? "facet' or 'endsolid" : "solid");
        }
    }
    return !inside || expect_word(text, "endsolid", &line, status);
}

bool stl_read_ascii(const FileBytes *file, MeshDraft *draft, Status *status)
{
    Text text = text_start(file);
    if (!read_solids(&text, draft, status))
        return false;
    return draft->polygon_count > 0 ||
           status_fail(status, STATUS_INVALID, "%s: no triangles", file->path);
}

static uint32_t little_endian(const char *bytes)
{
    uint32_t value = 0;
    for (int i = 3; i >= 0; i--)
        value = value << 8 | (unsigned char)bytes[i];
    return value;
}

size_t stl_binary_count(const FileBytes *file)
{
    return file->size < HEADER_SIZE ? 0 : little_endian(file->bytes + HEADER_SIZE - 4);
}

size_t stl_binary_size(size_t triangles)
{
    return HEADER_SIZE + RECORD_SIZE * triangles;
}

bool stl_read_binary(const FileBytes *file, MeshDraft *draft, Status *status)
{
    size_t count = stl_binary_count(file);
    if (count == 0)
        return status_fail(status, STATUS_INVALID, "%s: no triangles", file->path);
    for (size_t t = 0; t < count; t++) {
        // A record has a normal, three corners of three floats each, and two bytes of attributes.
        const char *record = file->bytes + stl_binary_size(t);
        for (int c = 1; c <= 3; c++) {
            float x[3];
            for (int k = 0; k < 3; k++) {
                uint32_t bits = little_endian(record + 12 * c + 4 * k);
                memcpy(&x[k], &bits, sizeof bits);
            }
            mesh_draft_add_corner(draft, draft->node_count, -1);
            mesh_draft_add_node(draft, vec3((double)x[0], (double)x[1], (double)x[2]));
        }
        mesh_draft_end_polygon(draft, 0);
    }
    return true;
}
