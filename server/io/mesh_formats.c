// SPDX-License-Identifier: MIT
// Readers of OBJ, OFF and STL (PLY is in ply.c), and a writer of OFF. All
// ignore normals: the order of corners defines the outside. Load time only.
#include "io/mesh_formats.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

// --- Wavefront OBJ: v, vt and f lines; all other keywords are ignored ----------------------------

static bool read_obj_vertex(Text *text, MeshDraft *draft, int line, Status *status)
{
    double x[3];
    for (int k = 0; k < 3; k++) {
        Word word = text_word(text);
        if (word.size == 0)
            return status_fail(status, STATUS_INVALID, "%s:%d: vertex has %d coordinates, not 3",
                               text->path, line, k);
        if (!word_number(word, &x[k]))
            return status_fail(status, STATUS_INVALID, "%s:%d: coordinate '%s' is not a number",
                               text->path, word.line, word_show(word).text);
    }
    // A weight or a colour may follow; neither affects the shape.
    mesh_draft_add_node(draft, vec3(x[0], x[1], x[2]));
    return true;
}

// Reads one to three numbers, of which the first two are used.
static bool read_texture(Text *text, MeshDraft *draft, Status *status)
{
    double uv[2] = {0.0, 0.0};
    // u and perhaps v.
    for (int k = 0; k < 2; k++) {
        Word word = text_word(text);
        if (k == 1 && word.size == 0)
            break;
        if (!word_number(word, &uv[k]) || !isfinite(uv[k]))
            return status_fail(status, STATUS_INVALID,
                               "%s:%d: texture coordinate '%s' is not a finite number", text->path,
                               word.line, word_show(word).text);
    }
    mesh_draft_add_uv(draft, uv[0], uv[1]);
    return true;
}

// Parses a signed decimal integer at *at and advances past it; returns false if there is none or it
// does not fit an int.
static bool read_integer(const char **at, const char *end, int *value)
{
    bool negative = *at < end && **at == '-';
    *at += *at < end && (**at == '-' || **at == '+');
    const char *first = *at;
    long number = 0;
    while (*at < end && **at >= '0' && **at <= '9' && number < INT_MAX)
        number = 10 * number + (*(*at)++ - '0');
    if (*at == first || number >= INT_MAX)
        return false;
    *value = (int)(negative ? -number : number);
    return true;
}

// Parses the indices v/vt/vn of a corner. Fields but the first may be empty or absent, since some
// writers print the slashes of what they do not have; texture 0: none.
static bool parse_corner(Word word, int *vertex, int *texture)
{
    const char *at = word.at, *end = word.at + word.size;
    int field[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        const bool given = k == 0 || (at < end && *at != '/');
        if (given && !read_integer(&at, end, &field[k]))
            return false;
        if (k == 2 || at == end || *at != '/')
            break;
        at++;
    }
    *vertex = field[0];
    *texture = field[1];
    return at == end;
}

// Resolves an index: negative ones count back from the last of `count` elements so far; -1:
// invalid.
static int resolve(int index, int count)
{
    return index > 0 ? index - 1 : index < 0 && index >= -count ? count + index : -1;
}

static bool read_obj_face(Text *text, MeshDraft *draft, int line, Status *status)
{
    for (Word word = text_word(text); word.size > 0; word = text_word(text)) {
        // Indices count from 1, or backwards from the newest vertex.
        int vertex, texture;
        if (!parse_corner(word, &vertex, &texture))
            return status_fail(status, STATUS_INVALID,
                               "%s:%d: '%s' is not a corner v, v/vt or v/vt/vn", text->path,
                               word.line, word_show(word).text);
        if (vertex == 0)
            return status_fail(status, STATUS_INVALID, "%s:%d: vertex index 0; the first is 1",
                               text->path, word.line);
        if (vertex < -draft->node_count)
            return status_fail(status, STATUS_INVALID,
                               "%s:%d: vertex index %d with only %d vertices before it", text->path,
                               word.line, vertex, draft->node_count);
        // Indices beyond the vertices read so far are checked at the end.
        mesh_draft_add_corner(draft, resolve(vertex, draft->node_count),
                              resolve(texture, draft->uv_count));
    }
    mesh_draft_end_polygon(draft, line);
    return true;
}

// Checks positive indices at the end of the file, since they may name vertices that follow.
static bool check_indices(const char *path, const MeshDraft *draft, Status *status)
{
    for (int p = 0; p < draft->polygon_count; p++)
        for (int c = mesh_draft_start(draft, p); c < draft->end[p]; c++)
            if (draft->corner[c] >= draft->node_count)
                return status_fail(status, STATUS_INVALID, "%s:%d: vertex index %d outside [1, %d]",
                                   path, draft->line[p], draft->corner[c] + 1, draft->node_count);
    if (draft->polygon_count == 0 && draft->node_count == 0)
        return status_fail(status, STATUS_INVALID, "%s: no faces; " MESH_FORMATS, path);
    return true;
}

bool obj_read(const FileBytes *file, MeshDraft *draft, Status *status)
{
    Text text = text_start(file);
    bool ok = true;
    // One keyword a line; only these three matter.
    draft->keeps_uv = true;
    while (ok && !draft->full && text.at < text.end) {
        Word word = text_word(&text);
        if (word_is(word, "v"))
            ok = read_obj_vertex(&text, draft, word.line, status);
        else if (word_is(word, "vt"))
            ok = read_texture(&text, draft, status);
        else if (word_is(word, "f"))
            ok = read_obj_face(&text, draft, word.line, status);
        // Other keywords may be continued over lines as well.
        while (ok && word.size > 0)
            word = text_word(&text);
        text_next_line(&text);
    }
    return ok && !draft->full && check_indices(file->path, draft, status);
}

// --- Geomview's OFF: counts, one vertex a line, one face a line; ignores what follows on a line --

// Letters that may precede OFF: texture, colour, normal; and those of other dimensions.
static const char PREFIX[] = "STCN4n";

// Returns the length of the keyword at `at`, 0 if none. Some writers put the counts on the same
// line.
static size_t keyword_size(const char *at)
{
    size_t prefix = strspn(at, PREFIX);
    if (prefix > 5 || strncmp(at + prefix, "OFF", 3) != 0)
        return 0;
    char after = at[prefix + 3];
    return after == 0 || strchr(" \t\r\n#0123456789", after) != NULL ? prefix + 3 : 0;
}

bool off_is(const FileBytes *file)
{
    Text text = text_start(file);
    return keyword_size(text_word_anywhere(&text).at) > 0;
}

static bool read_count(Text *text, const char *what, int *count, Status *status)
{
    double number;
    Word word = text_word_anywhere(text);
    if (word.size == 0)
        return status_fail(status, STATUS_INVALID, "%s:%d: file ends where the number of %s stands",
                           text->path, word.line, what);
    if (!word_number(word, &number) || !(number >= 0.0 && number <= INT_MAX) ||
        number != floor(number))
        return status_fail(status, STATUS_INVALID,
                           "%s:%d: number of %s must be an integer from 0, not '%s'", text->path,
                           word.line, what, word_show(word).text);
    *count = (int)number;
    return true;
}

// Reads the first word of the next line that is not empty.
static bool next_line(Text *text, const char *what, int index, int count, Word *word,
                      Status *status)
{
    text_next_line(text);
    *word = text_word_anywhere(text);
    return word->size > 0 ||
           status_fail(status, STATUS_INVALID, "%s:%d: %s %d of %d: the file ends", text->path,
                       word->line, what, index, count);
}

static bool read_off_vertex(Text *text, MeshDraft *draft, int index, int count, Status *status)
{
    Word word;
    double x[3];
    if (!next_line(text, "vertex", index, count, &word, status))
        return false;
    // Three coordinates; what follows on the line is not read.
    for (int k = 0; k < 3; k++, word = text_word(text)) {
        if (word.size == 0)
            return status_fail(status, STATUS_INVALID, "%s:%d: vertex %d has %d coordinates, not 3",
                               text->path, word.line, index, k);
        if (!word_number(word, &x[k]))
            return status_fail(status, STATUS_INVALID, "%s:%d: coordinate '%s' is not a number",
                               text->path, word.line, word_show(word).text);
    }
    mesh_draft_add_node(draft, vec3(x[0], x[1], x[2]));
    return true;
}

static bool read_off_face(Text *text, MeshDraft *draft, int index, int count, Status *status)
{
    Word word;
    double corners, node;
    if (!next_line(text, "face", index, count, &word, status))
        return false;
    // The number of corners comes first.
    int line = word.line;
    if (!word_number(word, &corners) || !(corners >= 0.0 && corners <= INT_MAX) ||
        corners != floor(corners))
        return status_fail(status, STATUS_INVALID,
                           "%s:%d: face %d must begin with its number of corners, not '%s'",
                           text->path, line, index, word_show(word).text);
    // Then so many vertices, which must have been read.
    for (int k = 0; k < (int)corners; k++) {
        word = text_word(text);
        if (word.size == 0)
            return status_fail(status, STATUS_INVALID, "%s:%d: face %d has %d corners, not %.0f",
                               text->path, line, index, k, corners);
        if (!word_number(word, &node) || node != floor(node) ||
            !(node >= 0.0 && node < draft->node_count))
            return status_fail(status, STATUS_INVALID,
                               "%s:%d: face %d names vertex '%s' outside [0, %d]", text->path, line,
                               index, word_show(word).text, draft->node_count - 1);
        mesh_draft_add_corner(draft, (int)node, -1);
    }
    mesh_draft_end_polygon(draft, line);
    return true;
}

static bool read_body(Text *text, MeshDraft *draft, Status *status)
{
    int vertices, faces;
    // Both counts announce what must follow.
    if (!read_count(text, "vertices", &vertices, status) ||
        !read_count(text, "faces", &faces, status))
        return false;
    // Vertices first, since faces refer to them.
    for (int i = 0; i < vertices && !draft->full; i++)
        if (!read_off_vertex(text, draft, i, vertices, status))
            return false;
    for (int i = 0; i < faces && !draft->full; i++)
        if (!read_off_face(text, draft, i, faces, status))
            return false;
    // Nothing may follow but comments.
    text_next_line(text);
    Word rest = text_word_anywhere(text);
    return rest.size == 0 || status_fail(status, STATUS_INVALID,
                                         "%s:%d: '%s' follows the %d faces that are announced",
                                         text->path, rest.line, word_show(rest).text, faces);
}

bool off_read(const FileBytes *file, MeshDraft *draft, Status *status)
{
    Text text = text_start(file);
    const char *keyword = text_word_anywhere(&text).at;
    size_t size = keyword_size(keyword);
    // The keyword says what a vertex has.
    if (memchr(keyword, '4', size) != NULL || memchr(keyword, 'n', size) != NULL)
        return status_fail(
            status, STATUS_INVALID,
            "%s:%d: OFF files of other than three dimensions are not read; export it as PLY or STL",
            file->path, text.line);
    text.at = keyword + size;
    // A binary file says so behind it.
    Text ahead = text;
    if (word_is(text_word(&ahead), "BINARY"))
        return status_fail(
            status, STATUS_INVALID,
            "%s:%d: binary OFF files are not read; export it as text, or as PLY or STL", file->path,
            text.line);
    return read_body(&text, draft, status);
}

void off_write(const TriMesh *mesh, const char *remark, FILE *out)
{
    fprintf(out, "OFF\n%s%d %d 0\n", remark, mesh->node_count, mesh->triangle_count);
    for (int i = 0; i < mesh->node_count; i++)
        fprintf(out, "%.17g %.17g %.17g\n", mesh->position[i].x, mesh->position[i].y,
                mesh->position[i].z);
    for (int t = 0; t < mesh->triangle_count; t++)
        fprintf(out, "3 %d %d %d\n", mesh->triangle[t][0], mesh->triangle[t][1],
                mesh->triangle[t][2]);
}

// --- STL, ASCII and binary -----------------------------------------------------------------------

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

static bool read_stl_vertex(Text *text, MeshDraft *draft, Status *status)
{
    int line;
    if (!expect_word(text, "vertex", &line, status))
        return false;
    double x[3];
    // Numbers may be spread over lines.
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
    // The normal is there but unused.
    if (!expect_word(text, "normal", &unused, status))
        return false;
    for (int k = 0; k < 3; k++) // some writers give nan for thin triangles
        text_word_anywhere(text);
    if (!expect_word(text, "outer", &unused, status) || !expect_word(text, "loop", &unused, status))
        return false;
    // Three corners, each a node of its own: joining them is the repair's work.
    for (int k = 0; k < 3; k++) {
        mesh_draft_add_corner(draft, draft->node_count, -1);
        if (!read_stl_vertex(text, draft, status))
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
    // A file may hold several solids; outside of them only their beginning is allowed.
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
           status_fail(status, STATUS_INVALID,
                       "%s: no triangles, so it is no surface; export it again", file->path);
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

size_t stl_binary_held(const FileBytes *file)
{
    return file->size < HEADER_SIZE ? 0 : (file->size - HEADER_SIZE) / RECORD_SIZE;
}

// Returns a vector of record t, which has a normal, three corners of three floats each, and two
// bytes of attributes; 0: the normal.
static Vec3 stl_vector(const FileBytes *file, size_t t, int which)
{
    const char *at = file->bytes + stl_binary_size(t) + 12 * which;
    float x[3];
    for (int k = 0; k < 3; k++) {
        uint32_t bits = little_endian(at + 4 * k);
        memcpy(&x[k], &bits, sizeof bits);
    }
    return vec3((double)x[0], (double)x[1], (double)x[2]);
}

// True for a record with an area whose normal is 0 or of length 1, to a hundredth: single precision
// is better, and other bytes hardly ever are. That it is at right angles to the edges says less:
// numbers of very different sizes often are.
static bool is_likely(const FileBytes *file, size_t t)
{
    const Vec3 x = stl_vector(file, t, 1), n = stl_vector(file, t, 0);
    const Vec3 a = vec3_sub(stl_vector(file, t, 2), x), b = vec3_sub(stl_vector(file, t, 3), x);
    const double length = vec3_length(n);
    if (!(vec3_length(vec3_cross(a, b)) > 0.0) || !vec3_finite(vec3_cross(a, b)))
        return false;
    return length == 0.0 || fabs(length - 1.0) < 0.01;
}

bool stl_binary_likely(const FileBytes *file, size_t first)
{
    // A few suffice, and some may be degenerate.
    const size_t held = stl_binary_held(file), end = held - first > 8 ? first + 8 : held;
    size_t likely = 0;
    for (size_t t = first; t < end; t++)
        likely += is_likely(file, t);
    return first < held && 2 * likely >= end - first;
}

bool stl_read_binary(const FileBytes *file, size_t count, MeshDraft *draft, Status *status)
{
    if (count == 0)
        return status_fail(status, STATUS_INVALID,
                           "%s: no triangles, so it is no surface; export it again", file->path);
    // Three nodes a triangle: joining them is the repair's work.
    for (size_t t = 0; t < count; t++) {
        for (int c = 1; c <= 3; c++) {
            mesh_draft_add_corner(draft, draft->node_count, -1);
            mesh_draft_add_node(draft, stl_vector(file, t, c));
        }
        mesh_draft_end_polygon(draft, 0);
    }
    return true;
}
