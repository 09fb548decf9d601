// SPDX-License-Identifier: MIT
// Legacy VTK files with a surface (DATASET POLYDATA), ASCII and binary (big-endian), with cells as
// before and since version 5.1. Reads POINTS, POLYGONS and TRIANGLE_STRIPS; skips lines, points and
// metadata; ends where data of points and cells begin. Allocates nothing that the file only
// announces.
#include "io/mesh_formats.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

static const char FIRST[] = "# vtk DataFile Version";

// A kind of number; in texts all are words.
typedef struct VtkType {
    const char *name;
    int size; // [bytes]
    bool real, sign;
} VtkType;

static const VtkType TYPES[] = {
    {"float", 4, true, true},          {"double", 8, true, true},
    {"int", 4, false, true},           {"vtktypeint64", 8, false, true},
    {"vtkIdType", 4, false, true},     {"unsigned_char", 1, false, false},
    {"char", 1, false, true},          {"short", 2, false, true},
    {"long", 8, false, true},          {"unsigned_short", 2, false, false},
    {"unsigned_int", 4, false, false}, {"unsigned_long", 8, false, false},
    {"vtktypeuint64", 8, false, false}};
static const VtkType CELL_INT = {"int", 4, false, true};

typedef struct Vtk {
    Text text;
    bool binary;
    MeshDraft *draft;
    Status *status;
} Vtk;

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

static double number_at(const char *at, VtkType type)
{
    uint64_t bits = 0;
    for (int i = 0; i < type.size; i++)
        bits = bits << 8 | (unsigned char)at[i];
    const uint32_t low = (uint32_t)bits;
    float single;
    double number;
    memcpy(&single, &low, sizeof single);
    memcpy(&number, &bits, sizeof number);
    if (type.real)
        return type.size == 4 ? (double)single : number;
    const int unused = 64 - 8 * type.size;
    return type.sign ? (double)((int64_t)(bits << unused) >> unused) : (double)bits;
}

// Reads the next number at a cursor of the file.
static bool read_at(const Vtk *vtk, Text *text, VtkType type, double *number)
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
    *number = number_at(text->at, type);
    text->at += type.size;
    return true;
}

// Reads an index or count of cells, which fits an int.
static bool read_index(const Vtk *vtk, Text *text, VtkType type, int *index)
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

static bool skip_numbers(Vtk *vtk, VtkType type, double count)
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
static bool read_type(Vtk *vtk, VtkType *type)
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
    VtkType type = CELL_INT;
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

// Adds a polygon, or the triangles of a strip, of the next `size` points.
static bool add_cell(Vtk *vtk, Text *text, VtkType type, int size, bool strip)
{
    MeshDraft *draft = vtk->draft;
    int corner[3] = {0, 0, 0};
    for (int k = 0; k < size && !draft->full; k++) {
        if (!read_index(vtk, text, type, &corner[2]))
            return false;
        if (!strip)
            mesh_draft_add_corner(draft, corner[2], -1);
        // Every second triangle of a strip runs the other way.
        for (int i = 0; strip && k >= 2 && i < 3; i++)
            mesh_draft_add_corner(draft, corner[i == 2 ? 2 : (i + k) % 2], -1);
        if (strip && k >= 2)
            mesh_draft_end_polygon(draft, vtk->binary ? 0 : text->line);
        corner[0] = corner[1];
        corner[1] = corner[2];
    }
    if (!strip)
        mesh_draft_end_polygon(draft, vtk->binary ? 0 : text->line);
    return true;
}

// Since version 5.1: where each cell begins among the points, then those of all.
static bool read_offset_cells(Vtk *vtk, int offsets, int points, bool keep, bool strip)
{
    VtkType type = CELL_INT;
    text_word_anywhere(&vtk->text); // OFFSETS
    if (!read_type(vtk, &type))
        return false;
    Text offset = vtk->text;
    const VtkType offset_type = type;
    if (!skip_numbers(vtk, type, offsets))
        return false;
    const Word word = text_word_anywhere(&vtk->text);
    if (!word_is(word, "CONNECTIVITY"))
        return vtk_fail(vtk, "CONNECTIVITY expected, not", word);
    if (!read_type(vtk, &type))
        return false;
    if (!keep)
        return skip_numbers(vtk, type, points);
    int before = 0, end = 0;
    for (int i = 0; i < offsets && !vtk->draft->full; i++, before = end) {
        if (!read_index(vtk, &offset, offset_type, &end))
            return false;
        if (end < before || end > points)
            return status_fail(vtk->status, STATUS_INVALID, "%s: offset %d of %d is %d, after %d",
                               vtk->text.path, i, offsets, end, before);
        if (i > 0 && !add_cell(vtk, &vtk->text, type, end - before, strip))
            return false;
    }
    return true;
}

// Reads or skips the cells of a keyword.
static bool read_cells(Vtk *vtk, bool keep, bool strip)
{
    int count = 0, total = 0;
    if (!read_count(vtk, &count) || !read_count(vtk, &total))
        return false;
    text_next_line(&vtk->text);
    Text ahead = vtk->text;
    if (word_is(text_word_anywhere(&ahead), "OFFSETS"))
        return read_offset_cells(vtk, count, total, keep, strip);
    if (!keep)
        return skip_numbers(vtk, CELL_INT, total);
    for (int i = 0; i < count && !vtk->draft->full; i++) {
        int size = 0;
        if (!read_index(vtk, &vtk->text, CELL_INT, &size) ||
            !add_cell(vtk, &vtk->text, CELL_INT, size, strip))
            return false;
    }
    return true;
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
        VtkType type = CELL_INT;
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
        return read_cells(vtk, true, false);
    if (word_is(word, "TRIANGLE_STRIPS"))
        return read_cells(vtk, true, true);
    if (word_is(word, "VERTICES") || word_is(word, "LINES"))
        return read_cells(vtk, false, false);
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
    if (!word_is(set, "POLYDATA"))
        return vtk_fail(vtk,
                        "of VTK's data sets only POLYDATA is a surface: in ParaView Extract "
                        "Surface makes it of",
                        set);
    vtk->binary = binary;
    return true;
}

bool vtk_read(const FileBytes *file, MeshDraft *draft, const char **format, Status *status)
{
    Vtk vtk = {.text = text_start(file), .draft = draft, .status = status};
    bool ended = false, ok = read_header(&vtk);
    *format = vtk.binary ? "binary VTK" : "ASCII VTK";
    while (ok && !ended && !draft->full)
        ok = read_part(&vtk, text_word_anywhere(&vtk.text), &ended);
    return ok;
}
