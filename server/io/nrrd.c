// SPDX-License-Identifier: MIT
// NRRD headers (http://teem.sourceforge.net/nrrd/format.html). Teem interprets the fields. It gets
// only the relevant ones, in a fixed order, each once, as a string, so that it opens no file and
// allocates nothing that a file claims; fields on whose errors it would leak memory are checked
// before.
#include "io/volume_data.h"

#include "base/check.h"
#include "on_demand/teem.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
    HEADER_MOST = 1 << 20, // bytes of a header
    LINE_MOST = 2000,      // of a relevant line
};

// Passed to teem in this order: the number of axes comes before the fields per axis.
static const int FIELDS[] = {
    nrrdField_type,        nrrdField_dimension,        nrrdField_space,
    nrrdField_sizes,       nrrdField_space_dimension,  nrrdField_spacings,
    nrrdField_kinds,       nrrdField_space_directions, nrrdField_units,
    nrrdField_endian,      nrrdField_encoding,         nrrdField_space_units,
    nrrdField_space_origin};
enum { FIELD_COUNT = sizeof FIELDS / sizeof *FIELDS };

typedef struct Header {
    const VolumeFile *file;
    char *text;                        // the header, lines cut into strings
    size_t size;                       // of the header in the file, including the empty line
    bool ended;                        // by an empty line
    const char *value[nrrdField_last]; // by field, or NULL
    LabelVolume *volume;
    Status *status;
} Header;

static bool fail(const Header *header, const char *what)
{
    return status_fail(header->status, STATUS_INVALID, "%s: %s", header->file->path, what);
}

// --- lines ---

// Makes bytes of a file printable for an error text.
static const char *show(const char *text, char shown[41])
{
    snprintf(shown, 41, "%.40s", text);
    for (char *at = shown; *at != 0; at++)
        if (*at < 32 || *at > 126)
            *at = '?';
    return shown;
}

// Copies a name without what is not printable, cut before a character that does not fit.
static void copy_name(const char *from, char name[VOLUME_NAME])
{
    size_t length = 0;
    for (; *from != 0 && length < VOLUME_NAME - 1; from++) {
        // U+0080 to U+009F are commands, too.
        const bool second = length > 0 && (unsigned char)from[-1] == 0xc2;
        const unsigned char c = (unsigned char)*from;
        name[length++] = c < 32 || c == 127 || c == '"' || (second && c < 0xa0) ? '?' : *from;
    }
    // Bytes 10xxxxxx go on with a character, of which no part is kept.
    if (((unsigned char)*from & 0xc0) == 0x80) {
        while (length > 0 && ((unsigned char)name[length - 1] & 0xc0) == 0x80)
            length--;
        length -= length > 0;
    }
    name[length] = 0;
}

// Returns segment `number`, which it adds with those before it.
static VolumeSegment *find_segment(LabelVolume *volume, int number)
{
    if (volume->segment == NULL)
        volume->segment = calloc(VOLUME_MOST_LABELS, sizeof *volume->segment);
    ASSERT(volume->segment != NULL);
    // What 3D Slicer wrote before it had layers: one a segment, with the value 1.
    for (; volume->segment_count <= number; volume->segment_count++)
        volume->segment[volume->segment_count] =
            (VolumeSegment){.label = 1, .layer = volume->segment_count + 1, .colour = {-1.0F}};
    return &volume->segment[number];
}

// Reads 3D Slicer's "SegmentN_Name:=liver" and its like; whatever else is no concern of ours.
static void read_segment(LabelVolume *volume, const char *line)
{
    char key[16] = "";
    int number = -1, at = 0, whole;
    if (sscanf(line, "Segment%4d_%15[A-Za-z]:=%n", &number, key, &at) < 2 || at == 0 ||
        number < 0 || number >= VOLUME_MOST_LABELS)
        return;
    const char *value = line + at;
    if (strcmp(key, "Name") == 0)
        copy_name(value, find_segment(volume, number)->name);
    else if (strcmp(key, "LabelValue") == 0 && sscanf(value, "%9d", &whole) == 1)
        find_segment(volume, number)->label = whole;
    else if (strcmp(key, "Layer") == 0 && sscanf(value, "%6d", &whole) == 1 && whole >= 0)
        find_segment(volume, number)->layer = whole + 1;
    else if (strcmp(key, "Color") == 0) {
        float *colour = find_segment(volume, number)->colour;
        bool good = sscanf(value, "%f %f %f", &colour[0], &colour[1], &colour[2]) == 3;
        for (int k = 0; k < 3; k++)
            good = good && colour[k] >= 0.0F && colour[k] <= 1.0F;
        if (!good)
            colour[0] = -1.0F;
    }
}

// Reads a line "field: value"; of pairs key:=value only those of segments.
static bool read_line(Header *header, char *line, int number)
{
    char shown[41];
    read_segment(header->volume, line);
    char *colon = strstr(line, ": ");
    bool keyed = strstr(line, ":=") != NULL;
    if (line[0] == '#' || (colon == NULL && keyed))
        return true;
    // What teem calls this field.
    int field = nrrdField_unknown;
    if (colon != NULL) {
        *colon = 0;
        field = airEnumVal(nrrdField, line);
    }
    // An unknown field is an error, since it may change the meaning of the voxels.
    if (field <= nrrdField_unknown || field >= nrrdField_last || field == nrrdField_keyvalue ||
        field == nrrdField_comment) {
        if (keyed)
            return true;
        return status_fail(header->status, STATUS_INVALID,
                           "%s:%d: '%s' is no field of an NRRD "
                           "header",
                           header->file->path, number, show(line, shown));
    }
    // Each field once, on a line of bounded length.
    if (header->value[field] != NULL)
        return status_fail(header->status, STATUS_INVALID, "%s:%d: a second field '%s'",
                           header->file->path, number, show(line, shown));
    if (strlen(colon + 2) > LINE_MOST)
        return status_fail(header->status, STATUS_INVALID, "%s:%d: more than %d characters",
                           header->file->path, number, LINE_MOST);
    // Includes carriage returns, which end a line for teem.
    for (const char *at = colon + 2; *at != 0; at++)
        if ((unsigned char)*at < 32 && *at != '\t')
            return status_fail(header->status, STATUS_INVALID,
                               "%s:%d: a byte that is no text in the NRRD header",
                               header->file->path, number);
    header->value[field] = colon + 2 + strspn(colon + 2, " \t");
    return true;
}

static bool read_lines(Header *header, size_t have)
{
    size_t at = 0;
    for (int number = 1; at < have; number++) {
        // Take one line; the text is changed in place.
        char *line = header->text + at, *end = memchr(line, '\n', have - at);
        if (end == NULL && have == HEADER_MOST)
            return fail(header, "has no end of its NRRD header in the first 1048576 bytes");
        size_t length = end != NULL ? (size_t)(end - line) : have - at;
        at += length + (end != NULL);
        line[length] = 0;
        if (memchr(line, 0, length) != NULL)
            return status_fail(header->status, STATUS_INVALID,
                               "%s:%d: a byte that is no text in the NRRD header",
                               header->file->path, number);
        // Blanks at its end, and carriage returns, do not count.
        while (length > 0 && (line[length - 1] == '\r' || line[length - 1] == ' '))
            line[--length] = 0;
        header->size = at;
        // An empty line ends the header.
        if (length == 0) {
            header->ended = true;
            return true;
        }
        // The first line is the magic word.
        if (number > 1 && !read_line(header, line, number))
            return false;
    }
    return true;
}

// Checks that quotes are closed: teem leaks memory otherwise.
static bool check_quotes(const Header *header, int field)
{
    bool open = false;
    for (const char *at = header->value[field]; at != NULL && *at != 0; at++) {
        if (at[0] == '\\' && at[1] == '"')
            at++;
        else if (*at == '"')
            open = !open;
    }
    return !open || fail(header, "a quotation mark in its units does not close");
}

static bool check_fields(const Header *header)
{
    static const int required[] = {nrrdField_type, nrrdField_dimension, nrrdField_sizes,
                                   nrrdField_encoding};
    for (int i = 0; i < 4; i++)
        if (header->value[required[i]] == NULL)
            return status_fail(header->status, STATUS_INVALID,
                               "%s: its NRRD header has no field '%s'", header->file->path,
                               airEnumStr(nrrdField, required[i]));
    return check_quotes(header, nrrdField_units) && check_quotes(header, nrrdField_space_units);
}

static bool read_text(Header *header)
{
    size_t want = header->file->size < HEADER_MOST ? (size_t)header->file->size : HEADER_MOST;
    size_t have = 0;
    header->text = malloc(want + 1);
    ASSERT(header->text != NULL);
    // A read may give less than it was asked for.
    while (have < want) {
        ssize_t got =
            pread(header->file->descriptor, header->text + have, want - have, (off_t)have);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            return fail(header, got < 0 ? strerror(errno) : "the file shrank while it was read");
        have += (size_t)got;
    }
    return read_lines(header, have) && check_fields(header);
}

// --- interpretation ---

// Fails with biff's innermost message, without function names.
static bool fail_teem(const Header *header)
{
    char shown[161] = "it cannot be read";
    char *said = biffGetDone(NRRD);
    // Of teem's report the last line says what was wrong.
    if (said != NULL) {
        size_t length = strlen(said);
        while (length > 0 && said[length - 1] == '\n')
            said[--length] = 0;
        const char *line = strrchr(said, '\n');
        line = line != NULL ? line + 1 : said;
        const char *text = strstr(line, ": ");
        snprintf(shown, sizeof shown, "%.160s", text != NULL ? text + 2 : line);
        // It quotes the file: print what can be printed.
        for (char *at = shown; *at != 0; at++)
            if (*at < 32 || *at > 126)
                *at = '?';
        free(said);
    }
    return status_fail(header->status, STATUS_INVALID, "%s: bad NRRD header: %s",
                       header->file->path, shown);
}

// Does the work of nrrdStringRead without its last check, which leaks memory on contradicting
// fields; the relevant ones are checked below.
static bool parse(const Header *header, Nrrd *nrrd, NrrdIoState *state)
{
    // Write the checked fields as a header of our own,
    char *text = malloc(16 + (size_t)FIELD_COUNT * (LINE_MOST + 64));
    ASSERT(text != NULL);
    int at = 0;
    for (int i = 0; i < FIELD_COUNT; i++)
        if (header->value[FIELDS[i]] != NULL)
            at += sprintf(text + at, "%s: %s\n", airEnumStr(nrrdField, FIELDS[i]),
                          header->value[FIELDS[i]]);
    // and let teem interpret that.
    nrrdIoStateSet(state, nrrdIoStateSkipData, AIR_TRUE);
    state->format = nrrdFormatNRRD;
    state->line = airStrdup("NRRD0005"); // as if that line had been read
    state->lineLen = (unsigned)strlen(state->line) + 1;
    state->headerStringRead = text;
    bool ok = nrrdFormatNRRD->read(NULL, nrrd, state) == 0 || fail_teem(header);
    state->headerStringRead = NULL;
    free(text);
    return ok;
}

// Returns metres per unit; 0: unknown. The default is the millimetre.
static double unit_metres(const char *name)
{
    static const struct {
        const char *name;
        double metres;
    } units[] = {
        {"", 1e-3},           {"mm", 1e-3},          {"millimeter", 1e-3}, {"millimeters", 1e-3},
        {"millimetre", 1e-3}, {"millimetres", 1e-3}, {"m", 1.0},           {"meter", 1.0},
        {"meters", 1.0},      {"metre", 1.0},        {"metres", 1.0},      {"cm", 1e-2},
        {"um", 1e-6},         {"\xC2\xB5m", 1e-6},   {"\xCE\xBCm", 1e-6},  {"micron", 1e-6},
        {"microns", 1e-6},    {"micrometer", 1e-6},  {"micrometre", 1e-6}};
    // Without a unit millimetres are meant; 0 is none that we know.
    if (name == NULL)
        return 1e-3;
    for (size_t i = 0; i < sizeof units / sizeof *units; i++)
        if (strcmp(name, units[i].name) == 0)
            return units[i].metres;
    return 0.0;
}

static bool find_unit(const Header *header, const char *name, double *metres)
{
    char shown[41];
    *metres = unit_metres(name);
    return *metres > 0.0 || status_fail(header->status, STATUS_INVALID,
                                        "%s: unit '%s' is not known; mm, cm, m and um are",
                                        header->file->path, show(name, shown));
}

static bool is_kind_of_space(int kind)
{
    return kind == nrrdKindUnknown || kind == nrrdKindDomain || kind == nrrdKindSpace;
}

static bool has_directions(const Nrrd *nrrd)
{
    for (unsigned a = 0; a < nrrd->dim; a++)
        if (nrrd->spaceDim > 0 && AIR_EXISTS(nrrd->axis[a].spaceDirection[0]))
            return true;
    return false;
}

// True of an axis along which there may be one label image beside the other, not values of one.
static bool is_layered(const NrrdAxisInfo *axis)
{
    return axis->kind == nrrdKindUnknown || axis->kind == nrrdKindList ||
           axis->kind == nrrdKindTime || axis->kind == nrrdKindDomain;
}

// Marks the three axes of space.
static bool mark_axes(const Header *header, const Nrrd *nrrd, bool is_space[NRRD_DIM_MAX])
{
    bool directed = has_directions(nrrd);
    int spatial = 0;
    // Axes of space have a direction, or a kind that says so.
    for (unsigned a = 0; a < nrrd->dim; a++) {
        is_space[a] = directed ? AIR_EXISTS(nrrd->axis[a].spaceDirection[0])
                               : is_kind_of_space(nrrd->axis[a].kind);
        spatial += is_space[a];
    }
    // More than three axes by their kind: those of one sample are no axes of space.
    for (int a = (int)nrrd->dim - 1; a >= 0 && spatial > 3; a--)
        if (is_space[a] && nrrd->axis[a].size == 1 && !directed) {
            is_space[a] = false;
            spatial--;
        }
    return spatial == 3 ||
           status_fail(header->status, STATUS_INVALID,
                       "%s: has %d axes of space, not 3 as a volume", header->file->path, spatial);
}

// Finds the three spatial axes; the others have one sample each, but one that counts layers.
static bool find_axes(const Header *header, const Nrrd *nrrd, int axis[3], LabelVolume *volume,
                      VolumeData *data)
{
    bool is_space[NRRD_DIM_MAX] = {false};
    if (!mark_axes(header, nrrd, is_space))
        return false;
    // Of every other axis but one of layers there is one sample: a label per voxel.
    int spatial = 0;
    double inner = 1.0;
    for (unsigned a = 0; a < nrrd->dim; inner *= (double)nrrd->axis[a++].size) {
        size_t size = nrrd->axis[a].size;
        if ((data->picture || is_layered(&nrrd->axis[a])) && !is_space[a] && size > 1 &&
            volume->layers == 1 && size <= VOLUME_MOST_VOXELS) {
            // More voxels than this are refused later.
            data->inner = (long)fmin(inner, VOLUME_MOST_VOXELS);
            volume->layers = (int)size;
            continue;
        }
        if (!is_space[a] && size != 1)
            return status_fail(header->status, STATUS_INVALID,
                               "%s: has %zu values a voxel, along axis %u, not one label",
                               header->file->path, size, a);
        if (size < 1 || size > VOLUME_MOST_VOXELS)
            return status_fail(header->status, STATUS_INVALID,
                               "%s: has %zu voxels along axis %u, outside [1, %d]",
                               header->file->path, size, a, VOLUME_MOST_VOXELS);
        if (!is_space[a])
            continue;
        // The remaining axes are those of the volume, in their order.
        volume->count[spatial] = (int)size;
        axis[spatial++] = (int)a;
    }
    return true;
}

// Sets the signs of x and y that turn a space into LPS.
static bool find_frame(const Header *header, const Nrrd *nrrd, double *x, double *y)
{
    // Of the axes only x and y have two conventions; z points to the head in all.
    *x = *y = 1.0;
    switch (nrrd->space) {
    case nrrdSpaceRightAnteriorSuperior:
        *x = *y = -1.0;
        return true;
    case nrrdSpaceLeftAnteriorSuperior:
        *y = -1.0;
        return true;
    case nrrdSpaceUnknown:
    case nrrdSpaceLeftPosteriorSuperior:
    case nrrdSpaceScannerXYZ:
    case nrrdSpace3DRightHanded:
        return true;
    default:
        return status_fail(header->status, STATUS_INVALID,
                           "%s: its space, %s, is not read; left-posterior-superior and "
                           "right-anterior-superior are",
                           header->file->path, airEnumStr(nrrdSpace, nrrd->space));
    }
}

static bool place_directed(const Header *header, const Nrrd *nrrd, const int axis[3],
                           LabelVolume *volume)
{
    double x, y, metres, other;
    // All directions must be of one space and one unit.
    if (nrrd->spaceDim != 3)
        return status_fail(header->status, STATUS_INVALID,
                           "%s: lies in a space of %u dimensions, not 3", header->file->path,
                           nrrd->spaceDim);
    if (!find_frame(header, nrrd, &x, &y) || !find_unit(header, nrrd->spaceUnits[0], &metres))
        return false;
    for (int d = 1; d < 3; d++)
        if (!find_unit(header, nrrd->spaceUnits[d], &other))
            return false;
        else if (other != metres)
            return fail(header, "has another unit along each direction of space");
    // From the file's frame to LPS in metres.
    for (int a = 0; a < 3; a++) {
        const double *step = nrrd->axis[axis[a]].spaceDirection;
        volume->axis[a] = vec3(x * step[0] * metres, y * step[1] * metres, step[2] * metres);
    }
    const double *at = nrrd->spaceOrigin;
    if (AIR_EXISTS(at[0]))
        volume->origin = vec3(x * at[0] * metres, y * at[1] * metres, at[2] * metres);
    return true;
}

// Without directions the axes are those of the world.
static bool place_spaced(const Header *header, const Nrrd *nrrd, const int axis[3],
                         LabelVolume *volume)
{
    // Without directions only the spacing is known: the axes are those of the frame.
    double step[3];
    for (int a = 0; a < 3; a++) {
        const NrrdAxisInfo *info = &nrrd->axis[axis[a]];
        double metres;
        if (!find_unit(header, info->units, &metres))
            return false;
        step[a] = info->spacing * metres;
        if (!isfinite(step[a]))
            return status_fail(header->status, STATUS_INVALID,
                               "%s: says nothing of the spacing along axis %d; add spacings or "
                               "space directions to its "
                               "header",
                               header->file->path, axis[a]);
    }
    volume->axis[0] = vec3(step[0], 0.0, 0.0);
    volume->axis[1] = vec3(0.0, step[1], 0.0);
    volume->axis[2] = vec3(0.0, 0.0, step[2]);
    return true;
}

// --- location of the voxels ---

static bool find_encoding(const Header *header, const Nrrd *nrrd, const NrrdIoState *state,
                          VolumeData *data)
{
    static const struct {
        int nrrd;
        VoxelType type;
    } types[] = {{nrrdTypeChar, VOXEL_INT8},     {nrrdTypeUChar, VOXEL_UINT8},
                 {nrrdTypeShort, VOXEL_INT16},   {nrrdTypeUShort, VOXEL_UINT16},
                 {nrrdTypeInt, VOXEL_INT32},     {nrrdTypeUInt, VOXEL_UINT32},
                 {nrrdTypeLLong, VOXEL_INT64},   {nrrdTypeULLong, VOXEL_UINT64},
                 {nrrdTypeFloat, VOXEL_FLOAT32}, {nrrdTypeDouble, VOXEL_FLOAT64}};
    const size_t count = sizeof types / sizeof *types;
    // The type of a voxel, and its byte order.
    size_t t = 0;
    while (t < count && types[t].nrrd != nrrd->type)
        t++;
    if (t == count)
        return fail(header, "its voxels are blocks of bytes, not numbers");
    data->type = types[t].type;
    data->swapped = state->endian != airEndianUnknown && state->endian != airMyEndian();
    // The encoding.
    if (state->encoding == nrrdEncodingRaw)
        data->encoding = ENCODING_RAW;
    else if (state->encoding == nrrdEncodingGzip)
        data->encoding = ENCODING_GZIP;
    else if (state->encoding == nrrdEncodingAscii)
        data->encoding = ENCODING_TEXT;
    else if (state->encoding == nrrdEncodingHex)
        data->encoding = ENCODING_HEX;
    else
        return status_fail(header->status, STATUS_INVALID,
                           "%s: encoding %s is not read; raw, gzip, ascii and hex are: save it "
                           "again from 3D Slicer, or unu save -e gzip",
                           header->file->path, state->encoding->name);
    return true;
}

// Reads an integer of the header, 0 if the field is missing.
static bool find_number(const Header *header, int field, long least, long *number)
{
    const char *value = header->value[field];
    char *end, shown[41];
    *number = 0;
    if (value == NULL)
        return true;
    errno = 0;
    *number = strtol(value, &end, 10);
    if (end > value && *end == 0 && errno == 0 && *number >= least)
        return true;
    return status_fail(header->status, STATUS_INVALID, "%s: %s is '%s', not a number from %ld",
                       header->file->path, airEnumStr(nrrdField, field), show(value, shown), least);
}

// Opens the file of voxels that a header names: a single one, in the same folder.
static bool open_detached(const Header *header, VolumeData *data)
{
    const char *name = header->value[nrrdField_data_file], *path = header->file->path;
    char shown[41];
    // One file beside the header, nothing else.
    while (strncmp(name, "./", 2) == 0)
        name += 2;
    if (strncmp(name, "LIST", 4) == 0 || strchr(name, '%') != NULL)
        return fail(header, "its voxels are in several files; write them into one");
    if (name[0] == 0 || strchr(name, '/') != NULL || strcmp(name, "-") == 0)
        return status_fail(header->status, STATUS_INVALID,
                           "%s: its data file '%s' is not one in the same folder", path,
                           show(name, shown));
    // Names are relative to the header's folder.
    const char *slash = strrchr(path, '/');
    size_t folder = slash != NULL ? (size_t)(slash - path) + 1 : 0;
    char *beside = malloc(folder + strlen(name) + 1);
    ASSERT(beside != NULL);
    memcpy(beside, path, folder);
    strcpy(beside + folder, name);
    bool ok = volume_file_open(beside, &data->file, header->status);
    free(beside);
    return ok;
}

// Advances data->offset by `lines` lines.
static bool skip_lines(const Header *header, const VolumeFile *file, long lines, VolumeData *data)
{
    char buffer[4096];
    while (lines > 0) {
        ssize_t got = pread(file->descriptor, buffer, sizeof buffer, (off_t)data->offset);
        if (got <= 0)
            return fail(header, "its data ends within the lines to skip");
        ssize_t at = 0;
        while (at < got && lines > 0)
            lines -= buffer[at++] == '\n';
        data->offset += at;
    }
    return true;
}

static bool find_data(const Header *header, const LabelVolume *volume, VolumeData *data)
{
    // The voxels follow the header, or are in a file of their own.
    long lines, bytes;
    if (header->value[nrrdField_data_file] != NULL) {
        if (!open_detached(header, data))
            return false;
    } else if (!header->ended) {
        return fail(header, "ends within its NRRD header, or has no voxels behind it");
    } else {
        data->offset = (long long)header->size;
    }
    // Lines and bytes to skip before them.
    const VolumeFile *file = data->file.path != NULL ? &data->file : header->file;
    if (!find_number(header, nrrdField_line_skip, 0, &lines) ||
        !find_number(header, nrrdField_byte_skip, -1, &bytes) ||
        !skip_lines(header, file, lines, data))
        return false;
    if (bytes == -1 && data->encoding != ENCODING_RAW)
        return fail(header, "byte skip is -1, which only raw voxels can have");
    // -1: the voxels are the last bytes of the file.
    double voxels = (double)volume->count[0] * (double)volume->count[1] * (double)volume->count[2];
    double total = voxels * volume->layers * voxel_type_size(data->type);
    if (bytes == -1 && total <= (double)(file->size - data->offset))
        data->offset = file->size - (long long)total;
    else if (data->encoding == ENCODING_GZIP)
        data->skip = bytes;
    else if (bytes > 0)
        data->offset += bytes < file->size ? bytes : file->size;
    return true;
}

static bool read_all(Header *header, Nrrd *nrrd, NrrdIoState *state, LabelVolume *volume,
                     VolumeData *data)
{
    int axis[3];
    if (!read_text(header) || !parse(header, nrrd, state) ||
        !find_axes(header, nrrd, axis, volume, data) || !find_encoding(header, nrrd, state, data))
        return false;
    // Where there is one image, all segments are of it; some writers do not say so.
    for (int s = 0; s < volume->segment_count && volume->layers == 1; s++)
        volume->segment[s].layer = 1;
    bool ok = has_directions(nrrd) ? place_directed(header, nrrd, axis, volume)
                                   : place_spaced(header, nrrd, axis, volume);
    return ok && find_data(header, volume, data);
}

bool volume_read_nrrd(const VolumeFile *file, LabelVolume *volume, VolumeData *data, Status *status)
{
    if (!library_load(&teem_library, file->path, status))
        return false;
    Header header = {.file = file, .volume = volume, .status = status};
    Nrrd *nrrd = nrrdNew();
    NrrdIoState *state = nrrdIoStateNew();
    ASSERT(nrrd != NULL && state != NULL);
    volume->format = "NRRD";
    bool ok = read_all(&header, nrrd, state, volume, data);
    free(header.text);
    nrrdIoStateNix(state);
    nrrdNuke(nrrd);
    return ok;
}
