// Wavefront OBJ: v, vt and f lines; all other keywords are ignored. Load time only.
#include "io/mesh_formats.h"

#include <limits.h>
#include <math.h>

static bool read_vertex(Text *text, MeshDraft *draft, int line, Status *status)
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

// Parses the indices of a corner v, v/vt, v//vn or v/vt/vn; texture 0: none.
static bool parse_corner(Word word, int *vertex, int *texture)
{
    const char *at = word.at, *end = word.at + word.size;
    int normal;
    *texture = 0;
    if (!read_integer(&at, end, vertex))
        return false;
    if (at < end && *at == '/') {
        at++;
        bool textured = at < end && *at != '/';
        if (textured && !read_integer(&at, end, texture))
            return false;
        if (at < end && *at == '/') {
            at++;
            if (!read_integer(&at, end, &normal))
                return false;
        } else if (!textured) {
            return false;
        }
    }
    return at == end;
}

// Resolves an index: negative ones count back from the last of `count` elements so far; -1:
// invalid.
static int resolve(int index, int count)
{
    return index > 0 ? index - 1 : index < 0 && index >= -count ? count + index : -1;
}

static bool read_face(Text *text, MeshDraft *draft, int line, Status *status)
{
    for (Word word = text_word(text); word.size > 0; word = text_word(text)) {
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
    if (draft->polygon_count == 0)
        return status_fail(status, STATUS_INVALID,
                           "%s: no faces; expected an OBJ (v, f), STL, PLY or OFF file", path);
    return true;
}

bool obj_read(const FileBytes *file, MeshDraft *draft, Status *status)
{
    Text text = text_start(file);
    bool ok = true;
    draft->keeps_uv = true;
    while (ok && !draft->full && text.at < text.end) {
        Word word = text_word(&text);
        if (word_is(word, "v"))
            ok = read_vertex(&text, draft, word.line, status);
        else if (word_is(word, "vt"))
            ok = read_texture(&text, draft, status);
        else if (word_is(word, "f"))
            ok = read_face(&text, draft, word.line, status);
        // Other keywords may be continued over lines as well.
        while (ok && word.size > 0)
            word = text_word(&text);
        text_next_line(&text);
    }
    return ok && !draft->full && check_indices(file->path, draft, status);
}
