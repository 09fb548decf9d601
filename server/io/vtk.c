// SPDX-License-Identifier: MIT
// Legacy VTK files with a surface or with cells (DATASET POLYDATA or UNSTRUCTURED_GRID), ASCII and
// binary (big-endian), with cells as before and since version 5.1. Reads POINTS, POLYGONS,
// TRIANGLE_STRIPS, CELLS and CELL_TYPES; skips lines, points and metadata; ends where data of
// points and cells begin. Allocates nothing that the file only announces.
#include "io/mesh_formats.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

static const char FIRST[] = "# vtk DataFile Version";

// In texts all are words.
static const NumberType TYPES[] = {
    {"float", 4, true, true},          {"double", 8, true, true},
    {"int", 4, false, true},           {"vtktypeint64", 8, false, true},
    {"vtkIdType", 4, false, true},     {"unsigned_char", 1, false, false},
    {"char", 1, false, true},          {"short", 2, false, true},
    {"long", 8, false, true},          {"unsigned_short", 2, false, false},
    {"unsigned_int", 4, false, false}, {"unsigned_long", 8, false, false},
    {"vtktypeuint64", 8, false, false}};
static const NumberType CELL_INT = {"int", 4, false, true};

typedef struct Vtk {
    Text text;
    bool binary;
    MeshCells *to;
    MeshDraft *draft;
    Text cells; // where CELLS began, which are read with their types; without them NULL
    Status *status;
} Vtk;

// The cells of a keyword: all of one kind, or of the types at a cursor.
typedef struct Kinds {
    CellKind all;
    Text *types;
} Kinds;

// The kinds by VTK's numbers; what is missing is unknown.
static const CellKind KINDS[] = {
    [0] = {CELL_SKIPPED, false},      [1] = {CELL_SKIPPED, false},
    [2] = {CELL_SKIPPED, false},      [3] = {CELL_SKIPPED, false},
    [4] = {CELL_SKIPPED, false},      [5] = {CELL_TRIANGLE, false},
    [6] = {CELL_STRIP, false},        [7] = {CELL_POLYGON, false},
    [8] = {CELL_PIXEL, false},        [9] = {CELL_QUAD, false},
    [10] = {CELL_TETRAHEDRON, false}, [11] = {CELL_VOXEL, false},
    [12] = {CELL_HEXAHEDRON, false},  [13] = {CELL_WEDGE, false},
    [14] = {CELL_PYRAMID, false},     [21] = {CELL_SKIPPED, true},
    [22] = {CELL_TRIANGLE, true},     [23] = {CELL_QUAD, true},
    [24] = {CELL_TETRAHEDRON, true},  [25] = {CELL_HEXAHEDRON, true},
    [26] = {CELL_WEDGE, true},        [27] = {CELL_PYRAMID, true},
    [28] = {CELL_QUAD, true},         [29] = {CELL_HEXAHEDRON, true},
    [30] = {CELL_QUAD, true},         [31] = {CELL_WEDGE, true},
    [32] = {CELL_WEDGE, true},        [33] = {CELL_HEXAHEDRON, true},
    [34] = {CELL_TRIANGLE, true},     [35] = {CELL_SKIPPED, true},
    [37] = {CELL_PYRAMID, true},      [68] = {CELL_SKIPPED, true},
    [69] = {CELL_TRIANGLE, true},     [70] = {CELL_QUAD, true},
    [71] = {CELL_TETRAHEDRON, true},  [72] = {CELL_HEXAHEDRON, true},
    [73] = {CELL_WEDGE, true},        [74] = {CELL_PYRAMID, true},
    [75] = {CELL_SKIPPED, true},      [76] = {CELL_TRIANGLE, true},
    [77] = {CELL_QUAD, true},         [78] = {CELL_TETRAHEDRON, true},
    [79] = {CELL_HEXAHEDRON, true},   [80] = {CELL_WEDGE, true},
    [81] = {CELL_PYRAMID, true},
};
enum { KIND_COUNT = sizeof KINDS / sizeof *KINDS };
static const Kinds POLYGONS = {{CELL_POLYGON, false}, NULL}, STRIPS = {{CELL_STRIP, false}, NULL};

CellKind vtk_kind(double type)
{
    return type >= 0.0 && type < KIND_COUNT ? KINDS[(int)type] : (CellKind){CELL_UNKNOWN, false};
}

bool vtk_is(const FileBytes *file)
{
    return strncmp(file->bytes, FIRST, strlen(FIRST)) == 0;
}

static bool vtk_fail(const Vtk *vtk, const char *what, Word word)
{
    // In binary files lines mean nothing.
    if (vtk->binary)
        return status_fail(vtk->status, STATUS_INVALID, "%s: %s '%s'", vtk->text.path, what,
                           word_show(word).text);
    return status_fail(vtk->status, STATUS_INVALID, "%s:%d: %s '%s'", vtk->text.path, word.line,
                       what, word_show(word).text);
}

// --- numbers ---

// Reads the next number at a cursor of the file.
static bool read_at(const Vtk *vtk, Text *text, NumberType type, double *number)
{
    if (!vtk->binary) {
        const Word word = text_word_anywhere(text);
        return word_number(word, number) ||
               vtk_fail(vtk, word.size == 0 ? "the file ends where a number stands" : "no number:",
                        word);
    }
    if (text->end - text->at < type.size)
        return status_fail(vtk->status, STATUS_INVALID, "%s: the file ends inside its %s",
                           vtk->text.path, type.real ? "points" : "cells");
    *number = number_decode(text->at, type, true);
    text->at += type.size;
    return true;
}

// Reads an index or count of cells, which fits an int.
static bool read_index(const Vtk *vtk, Text *text, NumberType type, int *index)
{
    double number;
    if (!read_at(vtk, text, type, &number))
        return false;
    if (!(number >= 0.0 && number <= INT_MAX) || number != floor(number))
        return status_fail(vtk->status, STATUS_INVALID, "%s: %g is no index of a point",
                           vtk->text.path, number);
    *index = (int)number;
    return true;
}

static bool skip_numbers(Vtk *vtk, NumberType type, double count)
{
    double number;
    if (vtk->binary && (double)(vtk->text.end - vtk->text.at) >= count * type.size) {
        vtk->text.at += (size_t)count * (size_t)type.size;
        return true;
    }
    while (count-- > 0.0)
        if (!read_at(vtk, &vtk->text, type, &number))
            return false;
    return true;
}

// Reads a count on the line of a keyword.
static bool read_count(Vtk *vtk, int *count)
{
    double number;
    const Word word = text_word(&vtk->text);
    if (!word_number(word, &number) || !(number >= 0.0 && number <= INT_MAX) ||
        number != floor(number))
        return vtk_fail(vtk, "no count:", word);
    *count = (int)number;
    return true;
}

// Reads the name of a type, and goes to the line behind, where its numbers begin.
static bool read_type(Vtk *vtk, NumberType *type)
{
    const Word word = text_word(&vtk->text);
    for (size_t i = 0; i < sizeof TYPES / sizeof *TYPES; i++)
        if (word_is(word, TYPES[i].name)) {
            *type = TYPES[i];
            text_next_line(&vtk->text);
            return true;
        }
    return vtk_fail(vtk, "unknown type", word);
}

// --- points and cells ---

static bool read_points(Vtk *vtk)
{
    int count = 0;
    NumberType type = CELL_INT;
    if (!read_count(vtk, &count) || !read_type(vtk, &type))
        return false;
    for (int i = 0; i < count && !vtk->draft->full; i++) {
        double x[3];
        for (int k = 0; k < 3; k++)
            if (!read_at(vtk, &vtk->text, type, &x[k]))
                return false;
        mesh_draft_add_node(vtk->draft, vec3(x[0], x[1], x[2]));
    }
    return true;
}

// Adds a cell of the next `size` points.
static bool add_cell(const Vtk *vtk, Text *text, NumberType type, int size, Kinds kinds)
{
    CellKind kind = kinds.all;
    double number;
    int corner = 0;
    if (kinds.types != NULL) {
        if (!read_at(vtk, kinds.types, CELL_INT, &number))
            return false;
        kind = vtk_kind(number);
    }
    for (int k = 0; k < size; k++) {
        if (!read_index(vtk, text, type, &corner))
            return false;
        cells_corner(vtk->to, corner);
    }
    return cells_end_cell(vtk->to, kind, vtk->binary ? 0 : text->line) ||
           status_fail(vtk->status, STATUS_INVALID, "%s: a cell of %d points has more corners",
                       vtk->text.path, size);
}

// Since version 5.1: where each cell begins among the points, then those of all.
static bool read_offset_cells(Vtk *vtk, int offsets, int points, const Kinds *kinds)
{
    NumberType type = CELL_INT;
    text_word_anywhere(&vtk->text); // OFFSETS
    if (!read_type(vtk, &type))
        return false;
    Text offset = vtk->text;
    const NumberType offset_type = type;
    if (!skip_numbers(vtk, type, offsets))
        return false;
    const Word word = text_word_anywhere(&vtk->text);
    if (!word_is(word, "CONNECTIVITY"))
        return vtk_fail(vtk, "CONNECTIVITY expected, not", word);
    if (!read_type(vtk, &type))
        return false;
    if (kinds == NULL)
        return skip_numbers(vtk, type, points);
    int before = 0, end = 0;
    for (int i = 0; i < offsets && !vtk->draft->full; i++, before = end) {
        if (!read_index(vtk, &offset, offset_type, &end))
            return false;
        if (end < before || end > points)
            return status_fail(vtk->status, STATUS_INVALID, "%s: offset %d of %d is %d, after %d",
                               vtk->text.path, i, offsets, end, before);
        if (i > 0 && !add_cell(vtk, &vtk->text, type, end - before, *kinds))
            return false;
    }
    return true;
}

// Reads the cells of a keyword; without kinds skips them.
static bool read_cells(Vtk *vtk, const Kinds *kinds)
{
    int count = 0, total = 0;
    if (!read_count(vtk, &count) || !read_count(vtk, &total))
        return false;
    text_next_line(&vtk->text);
    Text ahead = vtk->text;
    if (word_is(text_word_anywhere(&ahead), "OFFSETS"))
        return read_offset_cells(vtk, count, total, kinds);
    if (kinds == NULL)
        return skip_numbers(vtk, CELL_INT, total);
    for (int i = 0; i < count && !vtk->draft->full; i++) {
        int size = 0;
        if (!read_index(vtk, &vtk->text, CELL_INT, &size) ||
            !add_cell(vtk, &vtk->text, CELL_INT, size, *kinds))
            return false;
    }
    return true;
}

// Reads CELLS with the types that follow them.
static bool read_typed_cells(Vtk *vtk)
{
    int count = 0;
    if (vtk->cells.at == NULL || !read_count(vtk, &count))
        return status_fail(vtk->status, STATUS_INVALID, "%s: CELL_TYPES before CELLS",
                           vtk->text.path);
    text_next_line(&vtk->text);
    Text types = vtk->text;
    if (!skip_numbers(vtk, CELL_INT, count))
        return false;
    const Text behind = vtk->text;
    // No more cells than have types.
    types.end = behind.at;
    vtk->text = vtk->cells;
    const bool ok = read_cells(vtk, &(Kinds){.types = &types});
    vtk->text = behind;
    vtk->cells.at = NULL; // or many CELL_TYPES would read them as often
    return ok;
}

// --- the file ---

// Skips the arrays of a field, which are about the whole data set.
static bool skip_field(Vtk *vtk)
{
    int arrays = 0, components = 0, tuples = 0;
    text_word(&vtk->text); // its name
    if (!read_count(vtk, &arrays))
        return false;
    for (int i = 0; i < arrays; i++) {
        NumberType type = CELL_INT;
        text_word_anywhere(&vtk->text); // name
        if (!read_count(vtk, &components) || !read_count(vtk, &tuples) || !read_type(vtk, &type) ||
            !skip_numbers(vtk, type, (double)components * tuples))
            return false;
    }
    return true;
}

// Reads what a keyword announces; `ended`: nothing behind is needed.
static bool read_part(Vtk *vtk, Word word, bool *ended)
{
    if (word_is(word, "POINTS"))
        return read_points(vtk);
    if (word_is(word, "POLYGONS"))
        return read_cells(vtk, &POLYGONS);
    if (word_is(word, "TRIANGLE_STRIPS"))
        return read_cells(vtk, &STRIPS);
    if (word_is(word, "VERTICES") || word_is(word, "LINES"))
        return read_cells(vtk, NULL);
    if (word_is(word, "CELLS")) {
        vtk->cells = vtk->text;
        return read_cells(vtk, NULL);
    }
    if (word_is(word, "CELL_TYPES"))
        return read_typed_cells(vtk);
    if (word_is(word, "FIELD"))
        return skip_field(vtk);
    *ended = word.size == 0 || word_is(word, "POINT_DATA") || word_is(word, "CELL_DATA");
    if (*ended)
        return true;
    if (!word_is(word, "METADATA"))
        return vtk_fail(vtk, "unknown part", word);
    // Up to an empty line.
    do
        text_next_line(&vtk->text);
    while (text_word(&vtk->text).size > 0);
    return true;
}

static bool read_header(Vtk *vtk)
{
    text_next_line(&vtk->text);
    text_next_line(&vtk->text); // a title
    const Word format = text_word_anywhere(&vtk->text);
    if (!word_is(format, "ASCII") && !word_is(format, "BINARY"))
        return vtk_fail(vtk, "neither ASCII nor BINARY:", format);
    const bool binary = word_is(format, "BINARY");
    if (!word_is(text_word_anywhere(&vtk->text), "DATASET"))
        return vtk_fail(vtk, "DATASET expected behind", format);
    const Word set = text_word(&vtk->text);
    if (!word_is(set, "POLYDATA") && !word_is(set, "UNSTRUCTURED_GRID"))
        return vtk_fail(vtk,
                        "of VTK's data sets POLYDATA and UNSTRUCTURED_GRID are read: in ParaView "
                        "Extract Surface makes the first of",
                        set);
    vtk->binary = binary;
    return true;
}

bool vtk_read(const FileBytes *file, MeshCells *cells, const char **format, Status *status)
{
    MeshDraft *draft = cells->draft;
    Vtk vtk = {.text = text_start(file), .to = cells, .draft = draft, .status = status};
    bool ended = false, ok = read_header(&vtk);
    *format = vtk.binary ? "binary VTK" : "ASCII VTK";
    while (ok && !ended && !draft->full)
        ok = read_part(&vtk, text_word_anywhere(&vtk.text), &ended);
    return ok;
}
