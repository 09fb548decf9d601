// SPDX-License-Identifier: MIT
// Reads a mesh file into memory at once, recognises its format by its content and repairs it. Load
// time only; never writes, never opens other files, but the second one of TetGen's pairs.
#include "io/mesh_import.h"

#include "io/mesh_formats.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

// Lines, nodes and triangles of a file up to this size all fit an int.
static const size_t LARGEST_FILE = INT_MAX;

// --- the first lines -----------------------------------------------------------------------------

enum { START = 1000 }; // [bytes] where a file states its frame and unit

// Reads the beginning of a file, as text.
static void read_start(const char *path, char text[START + 1])
{
    FILE *file = fopen(path, "rb");
    size_t size = file != NULL ? fread(text, 1, START, file) : 0;
    if (file != NULL)
        fclose(file);
    for (size_t i = 0; i < size; i++)
        text[i] = text[i] == '\0' ? ' ' : text[i];
    text[size] = '\0';
}

typedef enum MeshFrame { FRAME_UNSTATED, FRAME_LPS, FRAME_RAS } MeshFrame;

static MeshFrame frame_of(const char *start, size_t size)
{
    size = size < START ? size : START;
    if (memmem(start, size, "SPACE=RAS", 9) != NULL)
        return FRAME_RAS;
    return memmem(start, size, "SPACE=LPS", 9) != NULL ? FRAME_LPS : FRAME_UNSTATED;
}

// --- the file ------------------------------------------------------------------------------------

static bool read_bytes(int descriptor, FileBytes *file, Status *status)
{
    size_t have = 0;
    while (have < file->size) {
        // A read may give less than it was asked for.
        ssize_t got = read(descriptor, file->bytes + have, file->size - have);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return status_fail(status, STATUS_INVALID, "%s: %s", file->path, strerror(errno));
        if (got == 0)
            return status_fail(status, STATUS_INVALID, "%s: the file shrank while it was read",
                               file->path);
        have += (size_t)got;
    }
    file->bytes[file->size] = 0;
    return true;
}

bool mesh_file_read(const char *path, FileBytes *file, Status *status)
{
    // O_NONBLOCK: opening a pipe without a writer must not block.
    int descriptor = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat about;
    if (descriptor < 0)
        return status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    *file = (FileBytes){.path = path};
    bool ok = true;
    // Refuse what is no regular file of a readable size, before memory is allocated.
    if (fstat(descriptor, &about) != 0)
        ok = status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    else if (!S_ISREG(about.st_mode))
        ok = status_fail(status, STATUS_INVALID, "%s: %s", path,
                         S_ISDIR(about.st_mode) ? "is a folder, not a mesh file" : "is not a file");
    else if (about.st_size == 0)
        ok = status_fail(status, STATUS_INVALID, "%s: the file is empty; export it again", path);
    else if ((size_t)about.st_size > LARGEST_FILE)
        ok = status_fail(status, STATUS_INVALID,
                         "%s: %lld bytes, more than %zu; simplify the mesh first", path,
                         (long long)about.st_size, LARGEST_FILE);
    // Read it whole.
    if (ok) {
        file->size = (size_t)about.st_size;
        file->bytes = malloc(file->size + 1);
        ok = file->bytes != NULL ? read_bytes(descriptor, file, status)
                                 : status_fail(status, STATUS_INVALID,
                                               "%s: no memory for %zu bytes", path, file->size);
    }
    close(descriptor);
    if (!ok)
        free(file->bytes);
    return ok;
}

// Text starts after a byte order mark and blanks; 'solid' there means ASCII STL.
static bool starts_with_solid(const FileBytes *file)
{
    const char *at = file->bytes;
    at += strspn(at, " \t\r\n");
    return strncasecmp(at, "solid", 5) == 0 && (at[5] == 0 || strchr(" \t\r\n", at[5]) != NULL);
}

// Normalises text for the readers: no byte order mark, lines that end in a newline.
static void normalize_text(FileBytes *file)
{
    if (strncmp(file->bytes, "\xEF\xBB\xBF", 3) == 0)
        memset(file->bytes, ' ', 3);
    if (memchr(file->bytes, '\n', file->size) != NULL)
        return;
    for (char *at = file->bytes; (at = strchr(at, '\r')) != NULL;)
        *at = '\n';
}

// Some writers terminate a text as C does, or pad its last block with zeros. Text without lines is
// no text.
static void drop_final_zeros(FileBytes *file)
{
    size_t size = file->size;
    while (size > 0 && file->bytes[size - 1] == 0)
        size--;
    if (memchr(file->bytes, '\n', size) != NULL || memchr(file->bytes, '\r', size) != NULL)
        file->size = size;
}

static bool refuse_binary(const FileBytes *file, size_t triangles, Status *status)
{
    if (file->size < stl_binary_size(0))
        return status_fail(
            status, STATUS_INVALID,
            "%s: neither text nor a binary STL, which has at least %zu bytes; " MESH_FORMATS,
            file->path, stl_binary_size(0));
    // What no file can hold is no number of triangles.
    if (stl_binary_size(triangles) > LARGEST_FILE || triangles == 0)
        return status_fail(status, STATUS_INVALID,
                           "%s: is of no format that is known; " MESH_FORMATS, file->path);
    return status_fail(status, STATUS_INVALID,
                       "%s: neither text nor a binary STL: its %zu triangles take %zu bytes, "
                       "the file has %zu; " MESH_FORMATS,
                       file->path, triangles, stl_binary_size(triangles), file->size);
}

// Other formats that people have, by their first bytes, and what to do with them.
#define BY_ASSIMP    "convert it with assimp export FILE NEW.stl (Debian: assimp-utils)"
#define BY_SLICER    "labels are read as NRRD, which 3D Slicer saves"
#define BY_GMSH      "mesh its surface with gmsh FILE -2 -o NEW.stl"
#define BY_GMSH_SAVE "convert its triangles with gmsh FILE -save -o NEW.stl"
static const struct {
    size_t at;
    const char *magic, *name, *cure;
} OTHERS[] = {
    {0, "MeshVersionFormatted", "Medit MESH", BY_GMSH_SAVE},
    {0, "ISO-10303-21", "STEP", BY_GMSH},
    {0, "DBRep_DrawableShape", "OpenCASCADE BREP", BY_GMSH},
    {0, "Kaydara FBX", "FBX", BY_ASSIMP},
    {0, "; FBX", "FBX", BY_ASSIMP},
    {0, "glTF", "binary glTF", BY_ASSIMP},
    {0, "PK\3\4", "a ZIP archive or 3MF", "unpack it, or " BY_ASSIMP},
    {0, "#VRML", "VRML", BY_ASSIMP},
    {0, "#X3D", "X3D", BY_ASSIMP},
    {0, "BLENDER", "Blender's own format", "export it from Blender as STL"},
    {0, "\xff\xff\xfe", "FreeSurfer's surface", "convert it with mris_convert FILE NEW.stl"},
    {0, "\x1f\x8b", "compressed by gzip", "unpack it with gunzip FILE"},
    {0, "NRRD000", "a label volume (NRRD)", "it is for voxels = { file = ...; }"},
    {344, "n+1", "a volume (NIfTI)", "it is for voxels = { file = ...; }"},
    {4, "n+2", "a volume (NIfTI)", "it is for voxels = { file = ...; }"},
    {128, "DICM", "a DICOM image", "segment it, in 3D Slicer for one"},
    {0, "\x89HDF", "HDF5", "a prepared file is for prepared = ...;"},
    {0, "version https://git-lfs", "a pointer of Git LFS to a file", "fetch it with git lfs pull"},
    {0, "\xfe\xff", "text in UTF-16", "convert it with iconv -f UTF-16 -t UTF-8 FILE > NEW"},
    {0, "\xff\xfe", "text in UTF-16", "convert it with iconv -f UTF-16 -t UTF-8 FILE > NEW"},
};
// Those that begin as other texts do, by what their first lines hold.
static const struct {
    const char *first, *word, *name, *cure;
} TEXTS[] = {
    {"<", "<COLLADA", "COLLADA", BY_ASSIMP},
    {"<", "<X3D", "X3D", BY_ASSIMP},
    {"<", "<GIFTI", "GIFTI", "convert it with mris_convert FILE NEW.stl"},
    {"<", "html", "a page of the web, not the file that it leads to", "download that"},
    {"{", "\"asset\"", "glTF", BY_ASSIMP},
    {"*", "*NODE", "Abaqus", BY_GMSH_SAVE},
    {"O", "ObjectType = Image", "a volume (MetaImage)", BY_SLICER},
    {"N", "NDims = ", "a volume (MetaImage)", BY_SLICER},
};

// True with the status set if the file is of a format that is known and not read.
static bool is_other(const FileBytes *file, Status *status)
{
    const char *name = NULL, *cure = NULL, *start = file->bytes;
    for (size_t i = 0; name == NULL && i < sizeof OTHERS / sizeof *OTHERS; i++) {
        const size_t length = strlen(OTHERS[i].magic);
        if (file->size >= OTHERS[i].at + length &&
            memcmp(start + OTHERS[i].at, OTHERS[i].magic, length) == 0)
            name = OTHERS[i].name, cure = OTHERS[i].cure;
    }
    const size_t size = file->size < START ? file->size : START;
    start += strncmp(start, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    start += strspn(start, " \t\r\n");
    for (size_t i = 0; name == NULL && i < sizeof TEXTS / sizeof *TEXTS; i++)
        if (*start == *TEXTS[i].first &&
            memmem(file->bytes, size, TEXTS[i].word, strlen(TEXTS[i].word)) != NULL)
            name = TEXTS[i].name, cure = TEXTS[i].cure;
    if (name != NULL)
        status_fail(status, STATUS_INVALID, "%s: is %s, which is not read as a mesh; %s",
                    file->path, name, cure);
    return name != NULL;
}

static void add_remark(MeshImport *import, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void add_remark(MeshImport *import, const char *format, ...)
{
    const size_t size = sizeof import->remarks, used = strlen(import->remarks);
    va_list list;
    va_start(list, format);
    // What does not fit is cut off: the first remarks matter most.
    int more = used > 0 ? snprintf(import->remarks + used, size - used, "; ") : 0;
    if (used + (size_t)more < size)
        vsnprintf(import->remarks + used + more, size - used - (size_t)more, format, list);
    va_end(list);
}

// Reads what is no text: a binary STL with bytes behind its triangles, or with a count that cannot
// be right. Nothing says which of both numbers is wrong, so only a user may choose.
static bool read_miscounted(const FileBytes *file, bool mends, MeshDraft *draft, MeshImport *import,
                            Status *status)
{
    const size_t count = stl_binary_count(file), held = stl_binary_held(file);
    // A count beyond any file is no count, but all bits are what writers leave that never return.
    const bool counts = stl_binary_size(count) <= LARGEST_FILE || count == UINT32_MAX;
    if (!counts || !stl_binary_likely(file, 0))
        return refuse_binary(file, count, status);
    if (count > 0 && count <= held && !stl_binary_likely(file, count)) {
        add_remark(import, "%zu bytes behind the %zu triangles of the STL are not read",
                   file->size - stl_binary_size(count), count);
        return stl_read_binary(file, count, draft, status);
    }
    if (!mends)
        return status_fail(status, STATUS_INVALID,
                           "%s: binary STL whose header announces %zu triangles, while its %zu "
                           "bytes hold %zu; pliant-prepare --repair FILE -o NEW.off takes those "
                           "that it holds",
                           file->path, count, file->size, held);
    add_remark(import, "%zu triangles are taken, as the file holds, not %zu, as its header says",
               held, count);
    return stl_read_binary(file, held, draft, status);
}

// Reads the formats that have cells; false if the file is of another.
static bool read_cells(const FileBytes *file, MeshCells *cells, MeshImport *import, bool *ok,
                       Status *status)
{
    static const struct {
        bool (*is)(const FileBytes *file);
        bool (*read)(const FileBytes *file, MeshCells *cells, const char **format, Status *status);
    } readers[] = {{vtk_is, vtk_read},
                   {vtk_xml_is, vtk_xml_read},
                   {msh_is, msh_read},
                   {tetgen_is, tetgen_read}};
    size_t i = 0;
    while (i < sizeof readers / sizeof *readers && !readers[i].is(file))
        i++;
    if (i == sizeof readers / sizeof *readers)
        return false;
    *ok = readers[i].read(file, cells, &import->format, status) &&
          cells_finish(cells, file->path, status);
    return true;
}

// Says what a user may not expect of a file with cells.
static void remark_cells(const MeshCells *cells, MeshImport *import)
{
    if (cells->solid > 0)
        add_remark(import, "its %d solid cells are taken by their border, %d faces", cells->solid,
                   cells->draft->polygon_count);
    if (cells->beside > 0)
        add_remark(import, "%d faces beside them are not read", cells->beside);
    if (cells->curved > 0)
        add_remark(import, "%d curved cells are taken with straight edges", cells->curved);
}

static bool read_draft(FileBytes *file, const MeshMending *mending, MeshCells *cells,
                       MeshImport *import, Status *status)
{
    MeshDraft *draft = cells->draft;
    const char **format = &import->format;
    bool ok;
    // By content: PLY and formats of cells have magic words, a binary STL the right size.
    if (ply_is(file))
        return ply_read(file, draft, format, status);
    if (read_cells(file, cells, import, &ok, status))
        return ok;
    // A binary STL may begin with 'solid' like a text, but no text has just this size, because four
    // characters read as a count announce more than 25 GB.
    size_t count = stl_binary_count(file);
    *format = "binary STL";
    if (file->size == stl_binary_size(count))
        return stl_read_binary(file, count, draft, status);
    if (is_other(file, status))
        return false;
    // What is left are texts, whose last bytes some programs fill with zeros.
    const FileBytes whole = *file;
    drop_final_zeros(file);
    if (memchr(file->bytes, 0, file->size) != NULL)
        return read_miscounted(&whole, mending->miscounted, draft, import, status);
    normalize_text(file);
    // Of the texts STL and OFF begin with a word; anything else must be OBJ.
    if (starts_with_solid(file)) {
        *format = "ASCII STL";
        return stl_read_ascii(file, draft, status);
    }
    if (off_is(file)) {
        *format = "OFF";
        return off_read(file, draft, status);
    }
    *format = "OBJ";
    return obj_read(file, draft, status);
}

// Turns by 180 degrees about z, which changes no digit.
static void turn_to_lps(MeshDraft *draft, const char *states, MeshImport *import)
{
    for (int i = 0; i < draft->node_count; i++) {
        draft->position[i].x = -draft->position[i].x;
        draft->position[i].y = -draft->position[i].y;
    }
    add_remark(import,
               "its %s SPACE=RAS: turned to LPS, the frame of label volumes, "
               "by 180 degrees about z",
               states);
}

// The frame that a file states in its first lines, or that its field data do, as VTK's XML has it.
static MeshFrame stated_frame(const FileBytes *file, const MeshCells *cells)
{
    const MeshFrame first = frame_of(file->bytes, file->size);
    return first != FRAME_UNSTATED ? first
           : cells->ras            ? FRAME_RAS
           : cells->lps            ? FRAME_LPS
                                   : FRAME_UNSTATED;
}

const char *mesh_frame(const char *path)
{
    static const char *const says[] = {"states no frame", "states LPS",
                                       "states RAS and was turned to LPS"};
    FileBytes file;
    if (!mesh_file_read(path, &file, &(Status){0}))
        return says[FRAME_UNSTATED];
    MeshDraft draft = {0};
    MeshCells cells = {.draft = &draft};
    if (vtk_xml_is(&file))
        vtk_xml_read(&file, &cells, &(const char *){NULL}, &(Status){0});
    const MeshFrame frame = stated_frame(&file, &cells);
    cells_destroy(&cells);
    mesh_draft_destroy(&draft);
    free(file.bytes);
    return says[frame];
}

static bool repair(const FileBytes *file, const MeshDraft *draft, TriMesh *mesh, MeshImport *import,
                   Status *status)
{
    MeshFault fault;
    if (draft->polygon_count == 0 && draft->node_count > 0)
        return status_fail(status, STATUS_INVALID, "%s: " MESH_OF_POINTS, file->path);
    import->node_count = draft->node_count;
    import->face_count = draft->polygon_count;
    if (mesh_repair(draft, mesh, &import->repairs, &fault)) {
        const MeshRepairs *repairs = &import->repairs;
        if (repairs->near_edges > 0)
            add_remark(import,
                       "%d border edges lie side by side, at most %.2g units of the file apart; "
                       "pliant-prepare --repair FILE --weld %.2g -o NEW.off joins them",
                       repairs->near_edges, repairs->near_apart, 1.05 * repairs->near_apart);
        return true;
    }
    // The line of the faulty face, where the format has lines.
    int line = fault.triangle >= 0 ? draft->line[fault.triangle] : 0;
    if (line > 0)
        return status_fail(status, STATUS_INVALID, "%s:%d: %s", file->path, line, fault.text);
    return status_fail(status, STATUS_INVALID, "%s: %s", file->path, fault.text);
}

bool mesh_import(const char *path, TriMesh *mesh, MeshImport *import, Status *status)
{
    return mesh_import_mending(path, &(MeshMending){0}, mesh, import, status);
}

bool mesh_import_mending(const char *path, const MeshMending *mending, TriMesh *mesh,
                         MeshImport *import, Status *status)
{
    FileBytes file;
    *import = (MeshImport){0};
    if (!mesh_file_read(path, &file, status))
        return false;
    // Everything into a draft first, which the repairs turn into a mesh.
    MeshDraft draft = {.weld = mending->weld};
    MeshCells cells = {.draft = &draft};
    Status said = {0};
    bool ok = read_draft(&file, mending, &cells, import, &said);
    // A draft that is full has refused the rest in silence.
    if (draft.full)
        ok = status_fail(status, STATUS_INVALID, "%s: more than %d nodes, corners or faces", path,
                         MESH_COUNT_MAX);
    else if (!ok)
        status_fail(status, said.code, "%s", said.text);
    if (ok)
        remark_cells(&cells, import);
    if (ok && stated_frame(&file, &cells) == FRAME_RAS)
        turn_to_lps(&draft, cells.ras ? "field data state" : "first lines state", import);
    ok = ok && repair(&file, &draft, mesh, import, status);
    cells_destroy(&cells);
    mesh_draft_destroy(&draft);
    free(file.bytes);
    return ok;
}

// --- units ---------------------------------------------------------------------------------------

static const struct {
    const char *name, *word; // `word`: first letters of the long name
    double scale;
} UNITS[] = {{"m", "met", 1.0},
             {"dm", "deci", 0.1},
             {"cm", "centi", 0.01},
             {"mm", "milli", 0.001},
             {"um", "micro", 1e-6}};
enum { UNIT_COUNT = sizeof UNITS / sizeof *UNITS };

// By extent in file units: the unit that makes it 5 to 50 cm, the size of organs. In doubt if a
// more common unit makes it 5 mm to 5 m.
static const struct {
    double below; // upper limit of the extent
    int unit;
    bool doubt;
    const char *why;
} GUESSES[] = {
    {0.005, 0, true, "no unit makes it as large as an organ"},
    {0.05, 0, false, "other units would make it smaller still"},
    {0.5, 0, false, "that is the size of an organ"},
    {5.0, 1, true, "that is the size of an organ, but files in decimetres are rare"},
    {50.0, 2, true, "that is the size of an organ, but most files are in mm"},
    {500.0, 3, false, "that is the size of an organ"},
    {5e3, 3, true, "that is large for an organ"},
    {2e4, 4, true, "that is small for an organ, but in mm it would be larger than any"},
    {5e5, 4, false, "that is the size of an organ"},
    {HUGE_VAL, 4, true, "no unit makes it as small as an organ"},
};

enum { GUESS_COUNT = sizeof GUESSES / sizeof *GUESSES };

bool units_parse(const char *name, double *scale)
{
    for (int i = 0; i < UNIT_COUNT; i++)
        if (strcmp(name, UNITS[i].name) == 0) {
            *scale = UNITS[i].scale;
            return true;
        }
    return false;
}

void units_length(double metres, char text[UNITS_LENGTH])
{
    const double length = fabs(metres);
    const int unit = length >= 1.0 ? 0 : length >= 1e-3 ? 3 : 4;
    snprintf(text, UNITS_LENGTH, "%.3g %s", metres / UNITS[unit].scale, UNITS[unit].name);
}

// Returns the unit that a word names; -1: none. It ends at the first character that is no letter.
static int unit_of_word(const char *at)
{
    size_t length = 0;
    while (isalpha((unsigned char)at[length]))
        length++;
    for (int i = 0; i < UNIT_COUNT; i++)
        if ((length == strlen(UNITS[i].name) && strncasecmp(at, UNITS[i].name, length) == 0) ||
            (length > 4 && strncasecmp(at, UNITS[i].word, strlen(UNITS[i].word)) == 0))
            return i;
    return -1;
}

// Searches the beginning of the file: "units: mm", "UNITS=mm", or a frame of 3D Slicer, which
// exports in millimetres. -1: nothing found.
static int unit_in_file(const char *path, const char **says)
{
    char text[START + 1];
    read_start(path, text);
    // A comment of 3D Slicer, or a word behind "unit".
    *says = "its first lines come from 3D Slicer, which writes mm";
    if (frame_of(text, strlen(text)) != FRAME_UNSTATED)
        return 3;
    *says = "its first lines say so";
    for (const char *at = text; (at = strcasestr(at, "unit")) != NULL; at++) {
        const char *word = at + 4;
        word += *word == 's' || *word == 'S';
        size_t between = strspn(word, " \t:=");
        int unit = between > 0 && between < 8 ? unit_of_word(word + between) : -1;
        if (unit >= 0)
            return unit;
    }
    return -1;
}

Units units_guess(const char *path, double extent)
{
    const char *says;
    char size[UNITS_LENGTH];
    Units units = {0};
    // What the file says itself beats the guess.
    int unit = unit_in_file(path, &says);
    if (unit < 0) {
        int row = 0;
        while (row < GUESS_COUNT - 1 && extent >= GUESSES[row].below)
            row++;
        unit = GUESSES[row].unit;
        units.doubt = GUESSES[row].doubt;
        says = GUESSES[row].why;
    }
    // And the sentence that says which it was.
    units.scale = UNITS[unit].scale;
    units.name = UNITS[unit].name;
    units_length(extent * units.scale, size);
    snprintf(units.reason, sizeof units.reason, "taken as %s: %.4g of them are %s, %s", units.name,
             extent, size, says);
    return units;
}

// --- the words of text formats -------------------------------------------------------------------

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

Text text_start(const FileBytes *file)
{
    return (Text){
        .path = file->path, .at = file->bytes, .end = file->bytes + file->size, .line = 1};
}

// Returns the length of a backslash and the line end that it hides, or 0.
static int continuation(const Text *text)
{
    if (text->at[0] != '\\')
        return 0;
    if (text->at[1] == '\n')
        return 2;
    return text->at[1] == '\r' && text->at[2] == '\n' ? 3 : 0;
}

Word text_word(Text *text)
{
    for (;;) {
        int skip = continuation(text);
        if (skip > 0)
            text->line++;
        else if (text->at < text->end && is_blank(*text->at))
            skip = 1;
        else
            break;
        text->at += skip;
    }
    // A word ends at a blank, at a comment or with its line.
    Word word = {.at = text->at, .line = text->line};
    if (text->at == text->end || *text->at == '\n' || *text->at == '#')
        return word;
    while (text->at < text->end && !is_blank(*text->at) && *text->at != '\n' &&
           continuation(text) == 0)
        text->at++;
    word.size = (int)(text->at - word.at);
    return word;
}

void text_next_line(Text *text)
{
    const char *newline = memchr(text->at, '\n', (size_t)(text->end - text->at));
    text->at = newline == NULL ? text->end : newline + 1;
    text->line += newline != NULL;
}

Word text_word_anywhere(Text *text)
{
    Word word = text_word(text);
    while (word.size == 0 && text->at < text->end) {
        text_next_line(text);
        word = text_word(text);
    }
    return word;
}

bool word_is(Word word, const char *name)
{
    return strlen(name) == (size_t)word.size && strncasecmp(word.at, name, (size_t)word.size) == 0;
}

bool word_number(Word word, double *value)
{
    // strtod stops at the blank, line end or final 0 after every word.
    char *end;
    if (word.size == 0)
        return false;
    *value = strtod(word.at, &end);
    return end == word.at + word.size;
}

Shown word_show(Word word)
{
    Shown shown;
    int size = word.size < 30 ? word.size : 30;
    for (int i = 0; i < size; i++)
        shown.text[i] = word.at[i] >= ' ' && word.at[i] <= '~' ? word.at[i] : '?';
    strcpy(shown.text + size, word.size > size ? "..." : "");
    return shown;
}
