// SPDX-License-Identifier: MIT
// VTK's XML files with a surface (VTP) or with cells (VTU). A reader of our own for the tags that
// these have: an XML library would be one more to load and to trust, and cannot read the raw bytes
// behind the last tag, which are no XML. Knows no entities, name spaces or DTDs. Reads Points,
// Strips, Polys and Cells of every Piece, and the frame that 3D Slicer writes; skips all else.
#include "io/xml_array.h"

#include <math.h>
#include <string.h>

typedef enum Slot {
    POINTS,
    STRIPS, // connectivity, then offsets
    STRIP_OFFSETS,
    POLYS,
    POLY_OFFSETS,
    CELLS,
    CELL_OFFSETS,
    CELL_TYPES,
    SLOTS
} Slot;

// The parts of a Piece that are read, with their number of cells and their first slot.
static const struct {
    const char *name, *count;
    Slot first;
} PARTS[] = {
    {"Points", "NumberOfPoints", POINTS},
    {"Strips", "NumberOfStrips", STRIPS},
    {"Polys", "NumberOfPolys", POLYS},
    {"Cells", "NumberOfCells", CELLS},
};
enum { PART_COUNT = sizeof PARTS / sizeof *PARTS };

static const NumberType TYPES[] = {
    {"Float32", 4, true, true},  {"Float64", 8, true, true},  {"Int32", 4, false, true},
    {"Int64", 8, false, true},   {"UInt8", 1, false, false},  {"Int8", 1, false, true},
    {"Int16", 2, false, true},   {"UInt16", 2, false, false}, {"UInt32", 4, false, false},
    {"UInt64", 8, false, false}, {"String", 1, false, false}};

typedef struct Piece {
    double count[PART_COUNT];
    XmlArray array[SLOTS];
} Piece;

typedef struct VtkXml {
    Text text;
    XmlCoding coding;
    bool grid; // unstructured, not a surface
    MeshCells *cells;
    Status *status;
} VtkXml;

// --- tags --------------------------------------------------------------------------------------

// <NAME ATTRIBUTES>, </NAME> or <NAME ATTRIBUTES/>.
typedef struct Tag {
    Word name, attributes;
    bool closes, empty;
} Tag;

static bool xml_fail(const VtkXml *xml, int line, const char *what, Word word)
{
    return status_fail(xml->status, STATUS_INVALID, "%s:%d: %s '%s'", xml->text.path, line, what,
                       word_show(word).text);
}

// Moves to a place and counts the lines between.
static void move_to(Text *text, const char *to)
{
    const char *at = text->at;
    while ((at = memchr(at, '\n', (size_t)(to - at))) != NULL) {
        text->line++;
        at++;
    }
    text->at = to;
}

// Returns the end of a tag, which '>' in quotes does not end; NULL without.
static const char *tag_end(const Text *text)
{
    char quote = 0;
    for (const char *at = text->at; at < text->end; at++) {
        if (quote == 0 && *at == '>')
            return at;
        if (*at == quote)
            quote = 0;
        else if (quote == 0 && (*at == '"' || *at == '\''))
            quote = *at;
    }
    return NULL;
}

// Skips comments and declarations; false with `tag` empty where there is none more, or with the
// status set.
static bool next_tag(const VtkXml *xml, Text *text, Tag *tag)
{
    *tag = (Tag){0};
    for (;;) {
        const char *at = memchr(text->at, '<', (size_t)(text->end - text->at));
        move_to(text, at != NULL ? at : text->end);
        if (at == NULL)
            return false;
        const bool comment = text->end - at > 4 && memcmp(at, "<!--", 4) == 0;
        const char *end = comment ? memmem(at, (size_t)(text->end - at), "-->", 3) : tag_end(text);
        if (end == NULL)
            return status_fail(xml->status, STATUS_INVALID, "%s:%d: the file ends inside a tag",
                               xml->text.path, text->line);
        tag->name.line = text->line;
        move_to(text, comment ? end + 3 : end + 1);
        if (at[1] == '!' || at[1] == '?')
            continue;
        tag->closes = at[1] == '/';
        tag->empty = end[-1] == '/';
        tag->name.at = at + 1 + tag->closes;
        while (tag->name.at + tag->name.size < end &&
               strchr(" \t\r\n/>", tag->name.at[tag->name.size]) == NULL)
            tag->name.size++;
        tag->attributes = (Word){tag->name.at + tag->name.size, 0, tag->name.line};
        tag->attributes.size = (int)(end - tag->attributes.at);
        return true;
    }
}

// Returns the value of an attribute, size 0 without.
static Word attribute(const Tag *tag, const char *name)
{
    const char *at = tag->attributes.at, *end = at + tag->attributes.size;
    while (at < end) {
        at += strspn(at, " \t\r\n");
        const char *equal = at < end ? memchr(at, '=', (size_t)(end - at)) : NULL;
        const char *open = equal == NULL ? NULL : equal + 1 + strspn(equal + 1, " \t\r\n");
        if (open == NULL || open >= end || (*open != '"' && *open != '\''))
            break;
        const char *close = memchr(open + 1, *open, (size_t)(end - open - 1));
        if (close == NULL)
            break;
        Word key = {at, 0, 0};
        while (at + key.size < equal && strchr(" \t\r\n", at[key.size]) == NULL)
            key.size++;
        if (word_is(key, name))
            return (Word){open + 1, (int)(close - open - 1), tag->name.line};
        at = close + 1;
    }
    return (Word){tag->attributes.at, 0, tag->name.line};
}

// Reads an attribute that is a count; without it, it is 0.
static bool read_count(const VtkXml *xml, const Tag *tag, const char *name, double *count)
{
    const Word word = attribute(tag, name);
    *count = 0.0;
    if (word.size == 0)
        return true;
    // strtod stops at the quote.
    if (!word_number(word, count) || !(*count >= 0.0 && *count <= 1e15) || *count != floor(*count))
        return xml_fail(xml, word.line, "no count:", word);
    return true;
}

// --- the header --------------------------------------------------------------------------------

bool vtk_xml_is(const FileBytes *file)
{
    const size_t size = file->size < 1000 ? file->size : 1000;
    const char *at = file->bytes + (strncmp(file->bytes, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0);
    return at[strspn(at, " \t\r\n")] == '<' && memmem(file->bytes, size, "<VTKFile", 8) != NULL;
}

static bool read_header(VtkXml *xml, const Tag *tag)
{
    const Word type = attribute(tag, "type"), packing = attribute(tag, "compressor");
    XmlCoding *coding = &xml->coding;
    xml->grid = word_is(type, "UnstructuredGrid");
    if (!xml->grid && !word_is(type, "PolyData"))
        return xml_fail(xml, tag->name.line,
                        "of VTK's XML the types PolyData and UnstructuredGrid are read as a mesh; "
                        "ParaView's Extract Surface makes the first of",
                        type);
    coding->big_endian = word_is(attribute(tag, "byte_order"), "BigEndian");
    coding->word = word_is(attribute(tag, "header_type"), "UInt64") ? 8 : 4;
    coding->packed = word_is(packing, "vtkZLibDataCompressor");
    if (packing.size > 0 && !coding->packed)
        return xml_fail(
            xml, tag->name.line,
            "of VTK's compressors ZLib is read; ParaView can save without this one:", packing);
    return true;
}

// Reads the header, and finds the part behind all tags, before which the arrays in it cannot be
// read. Leaves the cursor behind the header.
static bool find_appended(VtkXml *xml)
{
    Tag tag;
    do {
        if (!next_tag(xml, &xml->text, &tag))
            return xml->status->code != STATUS_OK
                       ? false
                       : xml_fail(xml, xml->text.line, "no tag VTKFile", tag.name);
    } while (!word_is(tag.name, "VTKFile"));
    if (!read_header(xml, &tag))
        return false;
    Text text = xml->text;
    while (next_tag(xml, &text, &tag) && !word_is(tag.name, "VTKFile")) {
        if (!word_is(tag.name, "AppendedData") || tag.closes)
            continue;
        const char *start = memchr(text.at, '_', (size_t)(text.end - text.at));
        if (start == NULL)
            return xml_fail(xml, tag.name.line, "no '_' begins the data of", tag.name);
        xml->coding.appended = start + 1;
        xml->coding.appended_base64 = word_is(attribute(&tag, "encoding"), "base64");
        xml->text.end = tag.name.at - 1;
        return true;
    }
    // A file that is cut off would lose its last pieces in silence.
    return word_is(tag.name, "VTKFile") ||
           status_fail(xml->status, STATUS_INVALID, "%s:%d: the file ends before </VTKFile>",
                       xml->text.path, text.line);
}

// --- pieces ------------------------------------------------------------------------------------

// Reads what an element says of its array; the cursor is behind its tag.
static bool read_array(VtkXml *xml, const Tag *tag, XmlArray *array)
{
    const Word type = attribute(tag, "type"), format = attribute(tag, "format");
    size_t t = 0;
    while (t < sizeof TYPES / sizeof *TYPES && !word_is(type, TYPES[t].name))
        t++;
    if (t == sizeof TYPES / sizeof *TYPES)
        return xml_fail(xml, tag->name.line, "unknown type", type);
    *array = (XmlArray){.given = true, .type = TYPES[t]};
    array->appended = word_is(format, "appended");
    array->ascii = !array->appended && !word_is(format, "binary");
    // Words about the array may follow the numbers, as elements of their own.
    const Text *text = &xml->text;
    const char *end = memchr(text->at, '<', (size_t)(text->end - text->at));
    array->content = *text;
    array->content.end = end != NULL && !tag->empty ? end : text->at;
    return read_count(xml, tag, "offset", &array->offset);
}

// Finds the slot of an array in a part: by its name, points by being there.
static Slot find_slot(int part, const Tag *tag)
{
    static const char *const names[] = {"connectivity", "offsets", "types"};
    const Slot first = PARTS[part].first;
    if (first == POINTS)
        return POINTS;
    for (int i = 0; i < (first == CELLS ? 3 : 2); i++)
        if (word_is(attribute(tag, "Name"), names[i]))
            return (Slot)(first + i);
    return SLOTS;
}

static bool read_points(VtkXml *xml, const Piece *piece)
{
    Numbers numbers;
    const double count = piece->count[0];
    bool ok = numbers_open(&xml->coding, &piece->array[POINTS], "Points", 3.0 * count, &numbers,
                           xml->status);
    for (double i = 0.0; ok && i < count && !xml->cells->draft->full; i++) {
        double x[3];
        for (int k = 0; ok && k < 3; k++)
            ok = numbers_next(&numbers, &x[k], xml->status);
        if (ok)
            mesh_draft_add_node(xml->cells->draft, vec3(x[0], x[1], x[2]));
    }
    numbers_close(&numbers);
    return ok;
}

typedef struct CellArrays {
    Numbers corners, offsets, types;
    int part, first; // node of the piece
    double points;
} CellArrays;

static bool read_cell(const VtkXml *xml, CellArrays *arrays, double *before)
{
    CellKind kind = {arrays->part == 1 ? CELL_STRIP : CELL_POLYGON, false};
    double end, corner, type;
    if (!numbers_next(&arrays->offsets, &end, xml->status) ||
        (arrays->part == 3 && !numbers_next(&arrays->types, &type, xml->status)))
        return false;
    if (arrays->part == 3)
        kind = vtk_kind(type);
    if (!(end >= *before))
        return status_fail(xml->status, STATUS_INVALID, "%s: %s: offset %.17g after %.17g",
                           xml->text.path, PARTS[arrays->part].name, end, *before);
    for (; *before < end; (*before)++) {
        if (!numbers_next(&arrays->corners, &corner, xml->status))
            return false;
        if (!(corner >= 0.0 && corner < arrays->points) || corner != floor(corner))
            return status_fail(xml->status, STATUS_INVALID,
                               "%s: %s: a cell names point %.17g of %.0f", xml->text.path,
                               PARTS[arrays->part].name, corner, arrays->points);
        cells_corner(xml->cells, arrays->first + (int)corner);
    }
    return cells_end_cell(xml->cells, kind, 0) ||
           status_fail(xml->status, STATUS_INVALID, "%s: a cell has less corners than its kind",
                       xml->text.path);
}

// The last offset is the number of all corners; -1 with the status set.
static double count_corners(const VtkXml *xml, const XmlArray *array, double count)
{
    Numbers offsets;
    double last = 0.0;
    bool ok = numbers_open(&xml->coding, array, "offsets", count, &offsets, xml->status);
    if (ok && !array->ascii)
        offsets.at = count - 1.0;
    for (double i = array->ascii ? 0.0 : count - 1.0; ok && i < count; i++)
        ok = numbers_next(&offsets, &last, xml->status);
    numbers_close(&offsets);
    return ok && last >= 0.0 && last <= 1e15 ? last : ok ? 0.0 : -1.0;
}

static bool read_cells(VtkXml *xml, const Piece *piece, int part, int first)
{
    const Slot slot = PARTS[part].first;
    const XmlArray *array = &piece->array[slot];
    const double count = piece->count[part];
    Status *status = xml->status;
    CellArrays arrays = {.part = part, .first = first, .points = piece->count[0]};
    if (count == 0.0)
        return true;
    const double corners = count_corners(xml, &array[1], count);
    bool ok =
        corners >= 0.0 &&
        numbers_open(&xml->coding, &array[1], "offsets", count, &arrays.offsets, status) &&
        numbers_open(&xml->coding, &array[0], "connectivity", corners, &arrays.corners, status);
    if (ok && part == 3)
        ok = numbers_open(&xml->coding, &array[2], "types", count, &arrays.types, status);
    double before = 0.0;
    for (double i = 0.0; ok && i < count && !xml->cells->draft->full; i++)
        ok = read_cell(xml, &arrays, &before);
    numbers_close(&arrays.offsets);
    numbers_close(&arrays.corners);
    numbers_close(&arrays.types);
    return ok;
}

static bool read_piece(VtkXml *xml, const Piece *piece)
{
    const int first = xml->cells->draft->node_count;
    if (piece->count[0] > 0.0 && !read_points(xml, piece))
        return false;
    bool ok = true;
    for (int part = 1; ok && part < PART_COUNT; part++)
        if (xml->grid == (part == 3))
            ok = read_cells(xml, piece, part, first);
    return ok;
}

// --- the file ----------------------------------------------------------------------------------

// What a cursor in the tags is within.
typedef struct Place {
    int part; // of PARTS, -1 in others
    bool field;
    Piece piece;
} Place;

static bool open_piece(const VtkXml *xml, const Tag *tag, Piece *piece)
{
    *piece = (Piece){0};
    for (int part = 0; part < PART_COUNT; part++)
        if (!read_count(xml, tag, PARTS[part].count, &piece->count[part]))
            return false;
    return true;
}

static bool read_tag(VtkXml *xml, const Tag *tag, Place *place)
{
    XmlArray array;
    if (word_is(tag->name, "Piece"))
        return tag->closes ? read_piece(xml, &place->piece) : open_piece(xml, tag, &place->piece);
    if (word_is(tag->name, "FieldData"))
        place->field = !tag->closes;
    for (int part = 0; part < PART_COUNT; part++)
        if (word_is(tag->name, PARTS[part].name))
            place->part = tag->closes || tag->empty ? -1 : part;
    // 3D Slicer's frame, a text of one word.
    if (place->field && word_is(tag->name, "Array") && !tag->closes &&
        word_is(attribute(tag, "Name"), "SPACE")) {
        char frame[64];
        if (!read_array(xml, tag, &array))
            return false;
        const size_t size = xml_array_bytes(&xml->coding, &array, frame, sizeof frame);
        xml->cells->ras |= memmem(frame, size, "RAS", 3) != NULL;
        xml->cells->lps |= memmem(frame, size, "LPS", 3) != NULL;
    }
    if (place->part < 0 || tag->closes || !word_is(tag->name, "DataArray"))
        return true;
    const Slot slot = find_slot(place->part, tag);
    return slot == SLOTS || read_array(xml, tag, &place->piece.array[slot]);
}

bool vtk_xml_read(const FileBytes *file, MeshCells *cells, const char **format, Status *status)
{
    VtkXml xml = {.text = text_start(file), .cells = cells, .status = status};
    xml.coding = (XmlCoding){.path = file->path, .end = file->bytes + file->size};
    Tag tag;
    Place place = {.part = -1};
    bool ok = find_appended(&xml);
    *format = xml.grid ? "VTU" : "VTP";
    while (ok && !cells->draft->full && next_tag(&xml, &xml.text, &tag))
        ok = read_tag(&xml, &tag, &place);
    return ok && status->code == STATUS_OK;
}
