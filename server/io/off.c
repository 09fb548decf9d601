// Geomview's OFF: counts, then one vertex per line, then one face per line. Ignores normals,
// colours and texture coordinates that follow on a line.
#include "io/mesh_formats.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

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

static bool read_vertex(Text *text, MeshDraft *draft, int index, int count, Status *status)
{
    Word word;
    double x[3];
    if (!next_line(text, "vertex", index, count, &word, status))
        return false;
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

static bool read_face(Text *text, MeshDraft *draft, int index, int count, Status *status)
{
    Word word;
    double corners, node;
    if (!next_line(text, "face", index, count, &word, status))
        return false;
    int line = word.line;
    if (!word_number(word, &corners) || !(corners >= 0.0 && corners <= INT_MAX) ||
        corners != floor(corners))
        return status_fail(status, STATUS_INVALID,
                           "%s:%d: face %d must begin with its number of corners, not '%s'",
                           text->path, line, index, word_show(word).text);
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
    if (!read_count(text, "vertices", &vertices, status) ||
        !read_count(text, "faces", &faces, status))
        return false;
    for (int i = 0; i < vertices && !draft->full; i++)
        if (!read_vertex(text, draft, i, vertices, status))
            return false;
    for (int i = 0; i < faces && !draft->full; i++)
        if (!read_face(text, draft, i, faces, status))
            return false;
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
    if (memchr(keyword, '4', size) != NULL || memchr(keyword, 'n', size) != NULL)
        return status_fail(status, STATUS_INVALID,
                           "%s:%d: OFF files of other than three dimensions are not read",
                           file->path, text.line);
    text.at = keyword + size;
    Text ahead = text;
    if (word_is(text_word(&ahead), "BINARY"))
        return status_fail(status, STATUS_INVALID, "%s:%d: binary OFF files are not read",
                           file->path, text.line);
    return read_body(&text, draft, status);
}

void off_write(const TriMesh *mesh, FILE *out)
{
    fprintf(out, "OFF\n%d %d 0\n", mesh->node_count, mesh->triangle_count);
    for (int i = 0; i < mesh->node_count; i++)
        fprintf(out, "%.17g %.17g %.17g\n", mesh->position[i].x, mesh->position[i].y,
                mesh->position[i].z);
    for (int t = 0; t < mesh->triangle_count; t++)
        fprintf(out, "3 %d %d %d\n", mesh->triangle[t][0], mesh->triangle[t][1],
                mesh->triangle[t][2]);
}
