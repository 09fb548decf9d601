// Wavefront OBJ: v and f lines; every other keyword is passed over. Load time only.
#include "files/obj.h"

#include "files/mesh_draft.h"

#include <limits.h>

static bool read_vertex(Text *text, MeshDraft *draft, int line, Status *status)
{
    double x[3];
    for (int k = 0; k < 3; k++) {
        Word word = text_word(text);
        if (word.size == 0)
            return status_fail(status, STATUS_INVALID, "%s:%d: vertex has %d coordinates, not 3",
                               text->path, line, k);
        if (!word_number(word, &x[k]))
            return status_fail(status, STATUS_INVALID,
                               "%s:%d: coordinate '%s' is not a finite number", text->path,
                               word.line, word_show(word).text);
    }
    // A weight or a colour may follow; neither says anything about shape.
    mesh_draft_add_node(draft, vec3(x[0], x[1], x[2]));
    return true;
}

// A decimal integer with a sign at *at, moved behind it; false if there is none or it is out of
// int.
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

// The vertex of a corner written v, v/vt, v//vn or v/vt/vn.
static bool parse_corner(Word word, int *vertex)
{
    const char *at = word.at, *end = word.at + word.size;
    int unused;
    if (!read_integer(&at, end, vertex))
        return false;
    if (at < end && *at == '/') {
        at++;
        bool texture = at < end && *at != '/';
        if (texture && !read_integer(&at, end, &unused))
            return false;
        if (at < end && *at == '/') {
            at++;
            if (!read_integer(&at, end, &unused))
                return false;
        } else if (!texture) {
            return false;
        }
    }
    return at == end;
}

static bool read_face(Text *text, MeshDraft *draft, int line, Status *status)
{
    int corner[3], count = 0;
    for (Word word = text_word(text); word.size > 0; word = text_word(text), count++) {
        int vertex;
        if (!parse_corner(word, &vertex))
            return status_fail(status, STATUS_INVALID,
                               "%s:%d: '%s' is not a corner v, v/vt or v/vt/vn", text->path,
                               word.line, word_show(word).text);
        // Negative ones count back from the last vertex so far. Positive ones may name vertices
        // that follow: they are checked at the end.
        if (vertex == 0)
            return status_fail(status, STATUS_INVALID, "%s:%d: vertex index 0; the first is 1",
                               text->path, word.line);
        if (vertex < -draft->node_count)
            return status_fail(status, STATUS_INVALID,
                               "%s:%d: vertex index %d with only %d vertices before it", text->path,
                               word.line, vertex, draft->node_count);
        if (count < 3)
            corner[count] = vertex < 0 ? draft->node_count + vertex : vertex - 1;
    }
    if (count != 3)
        return status_fail(status, STATUS_INVALID,
                           "%s:%d: face has %d corners; only triangles are read", text->path, line,
                           count);
    mesh_draft_add_triangle(draft, corner, line);
    return true;
}

static bool check_indices(const char *path, const MeshDraft *draft, Status *status)
{
    for (int t = 0; t < draft->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            if (draft->triangle[t][k] >= draft->node_count)
                return status_fail(status, STATUS_INVALID, "%s:%d: vertex index %d outside [1, %d]",
                                   path, draft->line[t], draft->triangle[t][k] + 1,
                                   draft->node_count);
    if (draft->triangle_count == 0)
        return status_fail(status, STATUS_INVALID,
                           "%s: no triangles; expected an OBJ file (v, f) or an STL file", path);
    return true;
}

bool obj_read(const FileBytes *file, TriMesh *mesh, Status *status)
{
    Text text = text_start(file);
    MeshDraft draft = {0};
    bool ok = true;
    while (ok && text.at < text.end) {
        Word word = text_word(&text);
        if (word.size == 1 && word.at[0] == 'v')
            ok = read_vertex(&text, &draft, word.line, status);
        else if (word.size == 1 && word.at[0] == 'f')
            ok = read_face(&text, &draft, word.line, status);
        // Other keywords may be continued over lines as well.
        while (ok && word.size > 0)
            word = text_word(&text);
        text_next_line(&text);
    }
    ok = ok && check_indices(file->path, &draft, status);
    if (ok)
        mesh_draft_finish(&draft, mesh);
    mesh_draft_destroy(&draft);
    return ok;
}
