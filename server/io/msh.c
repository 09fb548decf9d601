// SPDX-License-Identifier: MIT
// Gmsh's MSH files, versions 1, 2 and 4.1, ASCII and binary. Reads $Nodes and $Elements; skips
// other parts. Nodes have tags, any numbers, by which elements name them. Allocates nothing that
// the file only announces.
#include "io/mesh_formats.h"

#include <math.h>
#include <string.h>

// By Gmsh's numbers; without nodes: not read.
static const struct {
    int nodes;
    CellKind kind;
} KINDS[] = {
    [1] = {2, {CELL_SKIPPED, false}},      [2] = {3, {CELL_TRIANGLE, false}},
    [3] = {4, {CELL_QUAD, false}},         [4] = {4, {CELL_TETRAHEDRON, false}},
    [5] = {8, {CELL_HEXAHEDRON, false}},   [6] = {6, {CELL_WEDGE, false}},
    [7] = {5, {CELL_PYRAMID, false}},      [8] = {3, {CELL_SKIPPED, true}},
    [9] = {6, {CELL_TRIANGLE, true}},      [10] = {9, {CELL_QUAD, true}},
    [11] = {10, {CELL_TETRAHEDRON, true}}, [12] = {27, {CELL_HEXAHEDRON, true}},
    [13] = {18, {CELL_WEDGE, true}},       [14] = {14, {CELL_PYRAMID, true}},
    [15] = {1, {CELL_SKIPPED, false}},     [16] = {8, {CELL_QUAD, true}},
    [17] = {20, {CELL_HEXAHEDRON, true}},  [18] = {15, {CELL_WEDGE, true}},
    [19] = {13, {CELL_PYRAMID, true}},     [20] = {9, {CELL_TRIANGLE, true}},
    [21] = {10, {CELL_TRIANGLE, true}},    [22] = {12, {CELL_TRIANGLE, true}},
    [23] = {15, {CELL_TRIANGLE, true}},    [24] = {15, {CELL_TRIANGLE, true}},
    [25] = {21, {CELL_TRIANGLE, true}},    [26] = {4, {CELL_SKIPPED, true}},
    [27] = {5, {CELL_SKIPPED, true}},      [28] = {6, {CELL_SKIPPED, true}},
    [29] = {20, {CELL_TETRAHEDRON, true}}, [30] = {35, {CELL_TETRAHEDRON, true}},
    [31] = {56, {CELL_TETRAHEDRON, true}},
};
enum { KIND_COUNT = sizeof KINDS / sizeof *KINDS };

static const NumberType INT = {"int", 4, false, true}, REAL = {"double", 8, true, true};

typedef struct Msh {
    Text text;
    const char *start;
    bool binary, big_endian;
    bool first;       // version 1: no header, parts of other names
    bool fourth;      // version 4: blocks of nodes and elements
    NumberType count; // of version 4
    MeshCells *cells;
    Status *status;
} Msh;

bool msh_is(const FileBytes *file)
{
    return strncmp(file->bytes, "$MeshFormat", 11) == 0 || strncmp(file->bytes, "$NOD", 4) == 0;
}

// Says what is wrong and where: in binary files lines mean nothing.
static bool msh_fail(const Msh *msh, const char *what)
{
    if (msh->binary)
        return status_fail(msh->status, STATUS_INVALID, "%s: byte %td: %s", msh->text.path,
                           msh->text.at - msh->start, what);
    return status_fail(msh->status, STATUS_INVALID, "%s:%d: %s", msh->text.path, msh->text.line,
                       what);
}

// --- numbers ---

static bool read_number(Msh *msh, NumberType type, double *number)
{
    if (!msh->binary) {
        const Word word = text_word_anywhere(&msh->text);
        return word_number(word, number) ||
               msh_fail(msh, word.size == 0 ? "the file ends where a number stands"
                                            : "a word where a number stands");
    }
    if (msh->text.end - msh->text.at < type.size)
        return msh_fail(msh, "the file ends where a number stands");
    *number = number_decode(msh->text.at, type, msh->big_endian);
    msh->text.at += type.size;
    return true;
}

// Reads a count, a tag or the number of a kind.
static bool read_count(Msh *msh, NumberType type, double *count)
{
    return read_number(msh, type, count) &&
           ((*count >= 0.0 && *count <= 1e15 && *count == floor(*count)) ||
            msh_fail(msh, "a count or tag that is no integer from 0"));
}

// Reads numbers that are not needed.
static bool skip_numbers(Msh *msh, NumberType type, int count)
{
    double number = 0.0;
    for (; count > 0; count--)
        if (!read_number(msh, type, &number))
            return false;
    return true;
}

// --- nodes ---

static bool read_position(Msh *msh)
{
    double x[3];
    for (int k = 0; k < 3; k++)
        if (!read_number(msh, REAL, &x[k]))
            return false;
    mesh_draft_add_node(msh->cells->draft, vec3(x[0], x[1], x[2]));
    return true;
}

// Of versions 1 and 2: each node with its tag in front.
static bool read_nodes(Msh *msh, double count)
{
    double tag;
    for (double i = 0.0; i < count && !msh->cells->draft->full; i++) {
        if (!read_count(msh, INT, &tag) || !read_position(msh))
            return false;
        cells_tag_node(msh->cells, tag);
    }
    return true;
}

// Of version 4: the tags of a block, then its positions, with those on their curve or surface.
static bool read_node_block(Msh *msh)
{
    double dimension, count, parametric, tag;
    if (!read_count(msh, INT, &dimension) || !skip_numbers(msh, INT, 1) ||
        !read_count(msh, INT, &parametric) || !read_count(msh, msh->count, &count))
        return false;
    for (double i = 0.0; i < count && !msh->cells->draft->full; i++) {
        if (!read_count(msh, msh->count, &tag))
            return false;
        cells_tag_node(msh->cells, tag);
    }
    const int more = parametric > 0.0 && dimension <= 3.0 ? (int)dimension : 0;
    for (double i = 0.0; i < count && !msh->cells->draft->full; i++)
        if (!read_position(msh) || !skip_numbers(msh, REAL, more))
            return false;
    return true;
}

// --- elements ---

static bool read_kind(Msh *msh, int *kind)
{
    double number;
    if (!read_count(msh, INT, &number))
        return false;
    *kind = number < KIND_COUNT ? (int)number : 0;
    return KINDS[*kind].nodes > 0 || msh_fail(msh, "an element of a kind that is not read");
}

// Reads the nodes of an element.
static bool read_element(Msh *msh, int kind, NumberType type)
{
    double tag;
    for (int k = 0; k < KINDS[kind].nodes; k++) {
        if (!read_count(msh, type, &tag))
            return false;
        const int node = cells_find_node(msh->cells, tag);
        if (node < 0)
            return msh_fail(msh, "an element names a node that is not there");
        cells_corner(msh->cells, node);
    }
    return cells_end_cell(msh->cells, KINDS[kind].kind, msh->binary ? 0 : msh->text.line);
}

// Of version 2: kind, number of tags, tags and nodes of each, in binary files with one kind and
// number of tags for several.
static bool read_elements(Msh *msh, double count)
{
    double tags, block = 1.0;
    int kind;
    for (double i = 0.0; i < count && !msh->cells->draft->full;) {
        if ((!msh->binary && !skip_numbers(msh, INT, 1)) || !read_kind(msh, &kind) ||
            (msh->binary && !read_count(msh, INT, &block)) || !read_count(msh, INT, &tags))
            return false;
        if (tags > 1000.0 || block == 0.0)
            return msh_fail(msh, "a block of no elements, or of more than 1000 tags");
        for (double k = 0.0; k < block && !msh->cells->draft->full; k++, i++)
            if (!skip_numbers(msh, INT, (int)tags + msh->binary) || !read_element(msh, kind, INT))
                return false;
    }
    return true;
}

// Of version 1: number, kind, two tags, and how many nodes follow.
static bool read_first_elements(Msh *msh, double count)
{
    double nodes;
    int kind;
    for (double i = 0.0; i < count && !msh->cells->draft->full; i++) {
        if (!skip_numbers(msh, INT, 1) || !read_kind(msh, &kind) || !skip_numbers(msh, INT, 2) ||
            !read_count(msh, INT, &nodes))
            return false;
        if (nodes != KINDS[kind].nodes)
            return msh_fail(msh, "an element with another number of nodes than its kind has");
        if (!read_element(msh, kind, INT))
            return false;
    }
    return true;
}

// Of version 4: one kind, and the tag and nodes of each.
static bool read_element_block(Msh *msh)
{
    double count;
    int kind;
    if (!skip_numbers(msh, INT, 2) || !read_kind(msh, &kind) ||
        !read_count(msh, msh->count, &count))
        return false;
    for (double i = 0.0; i < count && !msh->cells->draft->full; i++)
        if (!skip_numbers(msh, msh->count, 1) || !read_element(msh, kind, msh->count))
            return false;
    return true;
}

// --- the file ---

static bool read_blocks(Msh *msh, bool (*read)(Msh *msh))
{
    double blocks;
    if (!read_count(msh, msh->count, &blocks) || !skip_numbers(msh, msh->count, 3))
        return false;
    for (double i = 0.0; i < blocks && !msh->cells->draft->full; i++)
        if (!read(msh))
            return false;
    return true;
}

// Reads the number in a line of text, in binary files, too.
static bool read_line_count(Msh *msh, double *count)
{
    const bool binary = msh->binary;
    msh->binary = false;
    const bool ok = read_count(msh, INT, count);
    msh->binary = binary;
    text_next_line(&msh->text);
    return ok;
}

static bool read_header(Msh *msh)
{
    double version, binary, size, one;
    text_next_line(&msh->text);
    if (!read_number(msh, REAL, &version) || !read_count(msh, INT, &binary) ||
        !read_count(msh, INT, &size))
        return false;
    msh->fourth = version >= 4.1 && version < 5.0;
    if (!msh->fourth && !(version >= 2.0 && version < 3.0))
        return status_fail(
            msh->status, STATUS_INVALID,
            "%s: of Gmsh's MSH versions 1, 2 and 4.1 are read, not %.9g; gmsh FILE -save "
            "-o NEW.msh -format msh41 converts it",
            msh->text.path, version);
    if (size != 8.0 && size != 4.0)
        return msh_fail(msh, "numbers of neither 4 nor 8 bytes");
    msh->count = (NumberType){.size = (int)size};
    msh->binary = binary == 1.0;
    text_next_line(&msh->text);
    // Behind it a 1 tells the order of bytes.
    if (!msh->binary)
        return true;
    if (msh->text.at == msh->text.end)
        return msh_fail(msh, "the file ends in its header");
    msh->big_endian = *msh->text.at == 0;
    return read_number(msh, INT, &one) && (one == 1.0 || msh_fail(msh, "no order of bytes"));
}

// Reads a part up to its end, or skips one that is not needed.
static bool read_part(Msh *msh, Word name)
{
    double count = 0.0;
    char end[64];
    snprintf(end, sizeof end, msh->first ? "$END%.*s" : "$End%.*s",
             name.size < 50 ? name.size - 1 : 49, name.at + 1);
    text_next_line(&msh->text);
    const bool nodes = word_is(name, msh->first ? "$NOD" : "$Nodes"),
               elements = word_is(name, msh->first ? "$ELM" : "$Elements");
    if (!nodes && !elements) {
        const char *at =
            memmem(msh->text.at, (size_t)(msh->text.end - msh->text.at), end, strlen(end));
        for (; at != NULL && msh->text.at < at;)
            text_next_line(&msh->text);
        return at != NULL || msh_fail(msh, "a part without its end");
    }
    // Each would sort all tags again.
    if (nodes && msh->cells->tags_sorted)
        return msh_fail(msh, "$Nodes behind $Elements");
    if (msh->fourth
            ? !read_blocks(msh, nodes ? read_node_block : read_element_block)
            : !read_line_count(msh, &count) || !(nodes        ? read_nodes(msh, count)
                                                 : msh->first ? read_first_elements(msh, count)
                                                              : read_elements(msh, count)))
        return false;
    if (msh->cells->draft->full)
        return true;
    return word_is(text_word_anywhere(&msh->text), end) ||
           msh_fail(msh,
                    nodes ? "$EndNodes or $ENDNOD expected" : "$EndElements or $ENDELM expected");
}

bool msh_read(const FileBytes *file, MeshCells *cells, const char **format, Status *status)
{
    Msh msh = {.text = text_start(file), .start = file->bytes, .cells = cells, .status = status};
    msh.first = strncmp(file->bytes, "$NOD", 4) == 0;
    bool ok = msh.first || read_header(&msh), more = true;
    *format = msh.binary ? "binary MSH" : "ASCII MSH";
    while (ok && more && !cells->draft->full) {
        const Word name = text_word_anywhere(&msh.text);
        more = name.size > 0;
        if (more && (name.size < 2 || *name.at != '$'))
            ok = msh_fail(&msh, "a part, $Nodes or another, expected");
        // Its end is all that is left of the header and of skipped parts.
        else if (more && strncmp(name.at, "$End", 4) != 0)
            ok = read_part(&msh, name);
        text_next_line(&msh.text);
    }
    return ok;
}
