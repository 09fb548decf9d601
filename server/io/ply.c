// SPDX-License-Identifier: MIT
// Stanford PLY. The header lists elements and their properties; the data follow in that order, one
// element per line in ASCII files. Reads x, y and z of vertices and the list vertex_indices (or
// vertex_index) of faces, or of triangle strips; skips all else by its type. Allocates nothing that
// the header only announces: data that ends too early is an error at its end.
#include "io/mesh_formats.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ELEMENTS = 32, PROPERTIES = 256 };

// Each under its two names.
static const NumberType TYPES[] = {
    {"char", 1, false, true},    {"int8", 1, false, true},    {"uchar", 1, false, false},
    {"uint8", 1, false, false},  {"short", 2, false, true},   {"int16", 2, false, true},
    {"ushort", 2, false, false}, {"uint16", 2, false, false}, {"int", 4, false, true},
    {"int32", 4, false, true},   {"uint", 4, false, false},   {"uint32", 4, false, false},
    {"float", 4, true, true},    {"float32", 4, true, true},  {"double", 8, true, true},
    {"float64", 8, true, true},
};

typedef enum PlyRole { ROLE_NONE, ROLE_X, ROLE_Y, ROLE_Z, ROLE_CORNERS, ROLE_STRIPS } PlyRole;

typedef struct PlyProperty {
    NumberType type;
    NumberType count_type; // of a list
    bool is_list;
    PlyRole role;
} PlyProperty;

typedef struct PlyElement {
    Shown name;
    long count;
    int first_property, property_count;
} PlyElement;

typedef enum PlyFormat { PLY_ASCII, PLY_LITTLE, PLY_BIG } PlyFormat;

typedef struct Ply {
    Text text;      // the header; then, in ASCII files, the data
    const char *at; // in binary files
    PlyFormat format;
    PlyElement element[ELEMENTS];
    PlyProperty property[PROPERTIES];
    int element_count, property_count;
    const PlyElement *now; // element being read
    long index;            // index of that element
    MeshDraft *draft;
    Status *status;
} Ply;

bool ply_is(const FileBytes *file)
{
    if (strncmp(file->bytes, "ply", 3) != 0)
        return false;
    const char *at = file->bytes + 3 + strspn(file->bytes + 3, " \t");
    return *at == '\n' || *at == '\r';
}

// --- header ---

static bool header_fail(Ply *ply, int line, const char *what, Word word)
{
    return status_fail(ply->status, STATUS_INVALID, "%s:%d: %s '%s'", ply->text.path, line, what,
                       word_show(word).text);
}

static bool read_type(Ply *ply, NumberType *type)
{
    Word word = text_word(&ply->text);
    for (size_t i = 0; i < sizeof TYPES / sizeof *TYPES; i++)
        if (word_is(word, TYPES[i].name)) {
            *type = TYPES[i];
            return true;
        }
    return header_fail(ply, word.line, "unknown type", word);
}

static bool read_format(Ply *ply)
{
    static const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    Word word = text_word(&ply->text);
    for (int i = 0; i < 3; i++)
        if (word_is(word, names[i])) {
            ply->format = (PlyFormat)i;
            return true;
        }
    return header_fail(ply, word.line, "unknown format", word);
}

static bool read_element(Ply *ply)
{
    Word name = text_word(&ply->text), count = text_word(&ply->text);
    double number;
    if (ply->element_count == ELEMENTS)
        return header_fail(ply, name.line, "too many elements, at", name);
    // The count says how many of them follow the header.
    if (!word_number(count, &number) || !(number >= 0.0 && number <= UINT32_MAX) ||
        number != floor(number))
        return header_fail(ply, name.line, "element count must be a number from 0, not", count);
    PlyElement *element = &ply->element[ply->element_count++];
    *element = (PlyElement){
        .name = word_show(name), .count = (long)number, .first_property = ply->property_count};
    return true;
}

static PlyRole role_of(const PlyElement *element, const PlyProperty *property, Word name)
{
    // Coordinates belong to vertices,
    if (strcmp(element->name.text, "vertex") == 0 && !property->is_list) {
        if (word_is(name, "x"))
            return ROLE_X;
        if (word_is(name, "y"))
            return ROLE_Y;
        if (word_is(name, "z"))
            return ROLE_Z;
    }
    // corners to faces and strips, under either of the two usual names.
    if (!property->is_list || !(word_is(name, "vertex_indices") || word_is(name, "vertex_index")))
        return ROLE_NONE;
    return strcmp(element->name.text, "face") == 0        ? ROLE_CORNERS
           : strcmp(element->name.text, "tristrips") == 0 ? ROLE_STRIPS
                                                          : ROLE_NONE;
}

static bool read_property(Ply *ply, int line)
{
    PlyProperty property = {0};
    Text before = ply->text;
    Word word = text_word(&ply->text);
    // A property belongs to the element before it.
    if (ply->element_count == 0)
        return header_fail(ply, line, "property before any element:", word);
    if (ply->property_count == PROPERTIES)
        return header_fail(ply, line, "too many properties, at", word);
    // A list has two types: of its count and of its members.
    property.is_list = word_is(word, "list");
    if (property.is_list) {
        if (!read_type(ply, &property.count_type))
            return false;
        if (property.count_type.real)
            return header_fail(ply, line, "the count of a list must be an integer:", word);
    } else {
        ply->text = before;
    }
    if (!read_type(ply, &property.type))
        return false;
    // Its name says whether we need it.
    PlyElement *element = &ply->element[ply->element_count - 1];
    property.role = role_of(element, &property, text_word(&ply->text));
    ply->property[ply->property_count++] = property;
    element->property_count++;
    return true;
}

// True if the element has a property of each role from `first` to `last`.
static bool has_roles(const Ply *ply, const PlyElement *element, PlyRole first, PlyRole last)
{
    for (PlyRole role = first; role <= last; role++) {
        int found = 0;
        for (int i = 0; i < element->property_count; i++)
            found += ply->property[element->first_property + i].role == role;
        if (found != 1)
            return false;
    }
    return true;
}

static bool check_header(Ply *ply)
{
    // Each element must have what a mesh needs of it, once.
    int vertices = 0, faces = 0, strips = 0;
    for (int i = 0; i < ply->element_count; i++) {
        const PlyElement *element = &ply->element[i];
        bool vertex = strcmp(element->name.text, "vertex") == 0;
        bool face = strcmp(element->name.text, "face") == 0;
        if (vertex && !has_roles(ply, element, ROLE_X, ROLE_Z))
            return status_fail(ply->status, STATUS_INVALID,
                               "%s: element vertex must have the numbers x, y and z once each",
                               ply->text.path);
        if (face && !has_roles(ply, element, ROLE_CORNERS, ROLE_CORNERS))
            return status_fail(ply->status, STATUS_INVALID,
                               "%s: element face must have one list vertex_indices",
                               ply->text.path);
        vertices += vertex;
        faces += face;
        strips += has_roles(ply, element, ROLE_STRIPS, ROLE_STRIPS);
    }
    // One list of vertices, and triangles of either kind.
    if (vertices == 1 && faces <= 1 && faces + strips > 0)
        return true;
    if (vertices == 1 && faces == 0)
        return status_fail(ply->status, STATUS_INVALID, "%s: " MESH_OF_POINTS, ply->text.path);
    return status_fail(ply->status, STATUS_INVALID,
                       "%s: a PLY mesh has one element vertex and one element face, not %d and %d",
                       ply->text.path, vertices, faces);
}

static bool read_header(Ply *ply)
{
    bool ended = false, formatted = false;
    text_next_line(&ply->text); // "ply"
    while (!ended) {
        Word word = text_word(&ply->text);
        bool ok = true;
        if (word.size == 0 && ply->text.at == ply->text.end)
            return status_fail(ply->status, STATUS_INVALID, "%s:%d: file ends inside its header",
                               ply->text.path, ply->text.line);
        // One keyword per line; unknown ones are errors, comments are not.
        if (word_is(word, "format"))
            ok = formatted = read_format(ply);
        else if (word_is(word, "element"))
            ok = read_element(ply);
        else if (word_is(word, "property"))
            ok = read_property(ply, word.line);
        else if (word_is(word, "end_header"))
            ended = true;
        else if (word.size > 0 && !word_is(word, "comment") && !word_is(word, "obj_info"))
            ok = header_fail(ply, word.line, "unknown word in the header:", word);
        if (!ok)
            return false;
        text_next_line(&ply->text);
    }
    if (!formatted)
        return status_fail(ply->status, STATUS_INVALID, "%s: the header names no format",
                           ply->text.path);
    ply->at = ply->text.at;
    return check_header(ply);
}

// --- data ---

static bool element_fail(Ply *ply, const char *what)
{
    if (ply->format == PLY_ASCII)
        return status_fail(ply->status, STATUS_INVALID, "%s:%d: %s %ld %s", ply->text.path,
                           ply->text.line, ply->now->name.text, ply->index, what);
    return status_fail(ply->status, STATUS_INVALID, "%s: %s %ld %s", ply->text.path,
                       ply->now->name.text, ply->index, what);
}

static bool ends_early(Ply *ply)
{
    char what[64];
    snprintf(what, sizeof what, "of %ld: the file ends", ply->now->count);
    return element_fail(ply, what);
}

// Reads the next number of the element.
static bool read_number(Ply *ply, NumberType type, double *number)
{
    // Binary numbers follow one another without separation.
    if (ply->format != PLY_ASCII) {
        if (ply->text.end - ply->at < type.size)
            return ends_early(ply);
        *number = number_decode(ply->at, type, ply->format == PLY_BIG);
        ply->at += type.size;
        return true;
    }
    // In a text they are words of one line.
    Word word = text_word(&ply->text);
    char what[96];
    if (word.size == 0)
        return element_fail(ply, "has too few numbers on its line");
    if (word_number(word, number))
        return true;
    snprintf(what, sizeof what, "has '%s' where a number is expected", word_show(word).text);
    return element_fail(ply, what);
}

// Adds the next vertex of a strip, whose last two are `last` (-1: none yet) and of which `length`
// came before; every second triangle is turned around, and those of two equal vertices join parts.
static void add_to_strip(Ply *ply, int vertex, int last[2], long length)
{
    if (length >= 2 && last[0] != last[1] && last[0] != vertex && last[1] != vertex) {
        mesh_draft_add_corner(ply->draft, last[length % 2], -1);
        mesh_draft_add_corner(ply->draft, last[1 - length % 2], -1);
        mesh_draft_add_corner(ply->draft, vertex, -1);
        mesh_draft_end_polygon(ply->draft, ply->format == PLY_ASCII ? ply->text.line : 0);
    }
    last[0] = last[1];
    last[1] = vertex;
}

// Reads the number of a vertex; a strip ends with -1.
static bool read_vertex(Ply *ply, const PlyProperty *property, int *vertex)
{
    double number;
    if (!read_number(ply, property->type, &number))
        return false;
    const double least = property->role == ROLE_CORNERS ? 0.0 : -1.0;
    if (property->role != ROLE_NONE &&
        (!(number >= least && number <= INT_MAX) || number != floor(number))) {
        char what[64];
        snprintf(what, sizeof what, "names vertex %g", number);
        return element_fail(ply, what);
    }
    *vertex = property->role != ROLE_NONE ? (int)number : 0;
    return true;
}

static bool read_list(Ply *ply, const PlyProperty *property)
{
    double count;
    // The count first; it must be one.
    if (!read_number(ply, property->count_type, &count))
        return false;
    if (!(count >= 0.0 && count <= INT_MAX) || count != floor(count))
        return element_fail(ply, "has a list whose count is no number from 0");
    // Members that nothing needs are read and dropped.
    int last[2] = {-1, -1}, vertex = 0;
    long length = 0;
    for (long i = 0; i < (long)count && !ply->draft->full; i++) {
        if (!read_vertex(ply, property, &vertex))
            return false;
        if (property->role == ROLE_CORNERS)
            mesh_draft_add_corner(ply->draft, vertex, -1);
        if (property->role == ROLE_STRIPS && vertex >= 0)
            add_to_strip(ply, vertex, last, length);
        length = vertex >= 0 ? length + 1 : 0;
    }
    // A face is done.
    if (property->role == ROLE_CORNERS)
        mesh_draft_end_polygon(ply->draft, ply->format == PLY_ASCII ? ply->text.line : 0);
    return true;
}

static bool read_one(Ply *ply)
{
    const PlyElement *element = ply->now;
    double xyz[3] = {0.0, 0.0, 0.0};
    // In a text an element is a line.
    if (ply->format == PLY_ASCII) {
        Text before = ply->text;
        while (text_word(&ply->text).size == 0 && ply->text.at < ply->text.end) {
            text_next_line(&ply->text); // blank lines
            before = ply->text;
        }
        ply->text = before;
        if (text_word(&before).size == 0)
            return ends_early(ply);
    }
    // All its properties in order; coordinates are kept.
    for (int i = 0; i < element->property_count; i++) {
        const PlyProperty *property = &ply->property[element->first_property + i];
        double number;
        if (property->is_list ? !read_list(ply, property)
                              : !read_number(ply, property->type, &number))
            return false;
        if (property->role >= ROLE_X && property->role <= ROLE_Z)
            xyz[property->role - ROLE_X] = number;
    }
    // Whether it was a vertex is known by its element.
    if (strcmp(element->name.text, "vertex") == 0)
        mesh_draft_add_node(ply->draft, vec3(xyz[0], xyz[1], xyz[2]));
    if (ply->format == PLY_ASCII)
        text_next_line(&ply->text);
    return true;
}

// Only blanks may follow: more faces than announced would be lost without an error.
static bool check_rest(Ply *ply)
{
    Text rest = ply->text;
    if (ply->format != PLY_ASCII)
        rest.at = ply->at;
    while (rest.at < rest.end && (*rest.at == 0 || strchr(" \t\r\n", *rest.at) != NULL))
        rest.at++;
    if (rest.at == rest.end)
        return true;
    return status_fail(
        ply->status, STATUS_INVALID,
        "%s: %td bytes follow the elements that the header announces: write it again from "
        "the program that made it",
        ply->text.path, rest.end - rest.at);
}

static bool read_elements(Ply *ply)
{
    for (int i = 0; i < ply->element_count; i++) {
        ply->now = &ply->element[i];
        // Elements without properties occupy no space, however many are announced.
        long count = ply->now->property_count > 0 ? ply->now->count : 0;
        for (ply->index = 0; ply->index < count && !ply->draft->full; ply->index++)
            if (!read_one(ply))
                return false;
    }
    return check_rest(ply);
}

bool ply_read(const FileBytes *file, MeshDraft *draft, const char **format, Status *status)
{
    static const char *const names[] = {"ASCII PLY", "binary little-endian PLY",
                                        "binary big-endian PLY"};
    Ply *ply = calloc(1, sizeof *ply);
    if (ply == NULL)
        return status_fail(status, STATUS_FAILED, "%s: no memory", file->path);
    // Both passes use one state.
    ply->text = text_start(file);
    ply->draft = draft;
    ply->status = status;
    bool ok = read_header(ply) && read_elements(ply);
    *format = names[ply->format];
    free(ply);
    return ok;
}
