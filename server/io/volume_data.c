// SPDX-License-Identifier: MIT
// Converts voxels of every type and encoding to integer labels. Load time only; never writes.
#include "io/volume_data.h"

#include "base/check.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

enum {
    CHUNK = 1 << 15,      // voxels read at once
    DEFLATE_RATIO = 1032, // deflate compresses no better
    LONGEST_NUMBER = 63,  // characters of a number in text
};

// --- files ---

bool volume_file_open(const char *path, VolumeFile *file, Status *status)
{
    struct stat about;
    unsigned char magic[2] = {0};
    // O_NONBLOCK: opening a pipe without a writer must not block.
    *file = (VolumeFile){.descriptor = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
    if (file->descriptor < 0 || fstat(file->descriptor, &about) != 0)
        return status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    // A file with something in it.
    if (!S_ISREG(about.st_mode))
        return status_fail(status, STATUS_INVALID, "%s: %s", path,
                           S_ISDIR(about.st_mode) ? "is a folder, not a volume file"
                                                  : "is not a file");
    if (about.st_size == 0)
        return status_fail(status, STATUS_INVALID, "%s: the file is empty; export it again", path);
    // What is known of it before its format.
    file->path = strdup(path);
    ASSERT(file->path != NULL);
    file->size = (long long)about.st_size;
    file->gzipped =
        pread(file->descriptor, magic, 2, 0) == 2 && magic[0] == 0x1f && magic[1] == 0x8b;
    return true;
}

void volume_file_close(VolumeFile *file)
{
    if (file->descriptor >= 0)
        close(file->descriptor);
    free(file->path);
    *file = (VolumeFile){.descriptor = -1};
}

// --- bytes ---

// The bytes of the voxels, unpacked.
typedef struct Source {
    gzFile packed; // or
    FILE *plain;
} Source;

static bool source_open(Source *source, const VolumeFile *file, long long offset, bool packed)
{
    *source = (Source){0};
    // Duplicate the descriptor, because both ways of reading close it.
    int own = dup(file->descriptor);
    if (own < 0)
        return false;
    // From where the data begin, in either way of reading.
    if (lseek(own, (off_t)offset, SEEK_SET) >= 0) {
        if (packed)
            source->packed = gzdopen(own, "rb");
        else
            source->plain = fdopen(own, "rb");
    }
    if (source->packed == NULL && source->plain == NULL) {
        close(own);
        return false;
    }
    return true;
}

static void source_close(Source *source)
{
    if (source->packed != NULL)
        gzclose(source->packed);
    if (source->plain != NULL)
        fclose(source->plain);
}

// Reads up to `size` bytes; fewer at the end of the file or where it is damaged.
static size_t source_read(Source *source, void *bytes, size_t size)
{
    if (source->packed == NULL)
        return fread(bytes, 1, size, source->plain);
    int got = gzread(source->packed, bytes, (unsigned)size);
    return got > 0 ? (size_t)got : 0;
}

// Returns the fault of the packed data after the last byte read; NULL: none.
static const char *source_fault(Source *source)
{
    int code = Z_OK;
    unsigned char more;
    if (source->packed == NULL)
        return NULL;
    // The checksum at the end of the stream is checked when one more byte is read.
    int got = gzread(source->packed, &more, 1);
    gzerror(source->packed, &code);
    if (code == Z_BUF_ERROR)
        return "is cut off";
    return got < 0 || (code != Z_OK && code != Z_STREAM_END) ? "is damaged" : NULL;
}

int volume_file_head(const VolumeFile *file, void *bytes, int size)
{
    Source source;
    if (!source_open(&source, file, 0, file->gzipped))
        return 0;
    int got = (int)source_read(&source, bytes, (size_t)size);
    source_close(&source);
    return got;
}

// Reads `size` bytes of hexadecimal digit pairs, separated by blanks.
static size_t read_hex(Source *source, unsigned char *bytes, size_t size)
{
    size_t digits = 0;
    while (digits < 2 * size) {
        // Blanks may stand anywhere; anything else ends the data.
        int c = fgetc(source->plain);
        int lower = c | 0x20;
        int value = c >= '0' && c <= '9' ? c - '0' : lower >= 'a' && lower <= 'f' ? lower - 87 : -1;
        if (value < 0 && (c <= 0 || strchr(" \t\r\n\v\f", c) == NULL))
            break;
        if (value < 0)
            continue;
        // Two digits make a byte.
        unsigned char *byte = &bytes[digits / 2];
        *byte = (unsigned char)(digits % 2 == 0 ? value << 4 : *byte | value);
        digits++;
    }
    return digits / 2;
}

// Reads the next number of a text; returns false if there is none.
static bool read_number(Source *source, double *number, char word[LONGEST_NUMBER + 1])
{
    static const char *const blanks = " \t\r\n\v\f,";
    int length = 0, c;
    do
        c = fgetc(source->plain);
    while (c > 0 && strchr(blanks, c) != NULL);
    for (; c > 0 && strchr(blanks, c) == NULL && length < LONGEST_NUMBER; c = fgetc(source->plain))
        word[length++] = (char)(c >= 33 && c < 127 ? c : '?');
    word[length] = 0;
    char *end = word;
    *number = length > 0 ? strtod(word, &end) : 0.0;
    return length > 0 && length < LONGEST_NUMBER && *end == 0;
}

// --- values ---

int voxel_type_size(VoxelType type)
{
    static const int sizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return sizes[type];
}

static void swap_values(unsigned char *bytes, size_t count, size_t size)
{
    for (size_t v = 0; v < count; v++, bytes += size)
        for (size_t a = 0, b = size - 1; a < b; a++, b--) {
            unsigned char byte = bytes[a];
            bytes[a] = bytes[b];
            bytes[b] = byte;
        }
}

#define CONVERT(ctype)                                                                             \
    for (size_t v = 0; v < count; v++) {                                                           \
        ctype one;                                                                                 \
        memcpy(&one, bytes + v * sizeof one, sizeof one);                                          \
        value[v] = (double)one;                                                                    \
    }                                                                                              \
    break

// Integers beyond 2^53 lose digits, but labels are smaller anyway.
static void convert(const unsigned char *bytes, size_t count, VoxelType type, double *value)
{
    switch (type) {
    case VOXEL_INT8:
        CONVERT(int8_t);
    case VOXEL_UINT8:
        CONVERT(uint8_t);
    case VOXEL_INT16:
        CONVERT(int16_t);
    case VOXEL_UINT16:
        CONVERT(uint16_t);
    case VOXEL_INT32:
        CONVERT(int32_t);
    case VOXEL_UINT32:
        CONVERT(uint32_t);
    case VOXEL_INT64:
        CONVERT(int64_t);
    case VOXEL_UINT64:
        CONVERT(uint64_t);
    case VOXEL_FLOAT32:
        CONVERT(float);
    case VOXEL_FLOAT64:
        CONVERT(double);
    }
}

// Values that miss a whole number by less are that: single precision, scales and resampling lose so
// much, and no interpolation between two labels comes as close for more than a few voxels.
static const double SLACK = 1e-3;

// The slice that is being read.
typedef struct Slice {
    LabelVolume *volume;
    VolumeTake *take;
    void *user;
    int *label; // [area]
    long area, filled;
    int k;
} Slice;

static bool fail_label(const VolumeData *data, const Slice *slice, long v, double x, Status *status)
{
    const long at = slice->filled + v, nx = slice->volume->count[0];
    return status_fail(
        status, STATUS_INVALID,
        "%s: voxel (%ld, %ld, %d) is %.9g%s, not a label, which is a whole number up "
        "to %d%s",
        data->file.path, at % nx, at / nx, slice->k, x, data->slope != 0.0 ? " when scaled" : "",
        INT_MAX, fabs(x) < INT_MAX ? "; grey values or shares are segmented first" : "");
}

// Copies values that are labels as they are, as in most files; false: one is not.
static bool copy_labels(const double *value, size_t count, int *label)
{
    bool plain = true;
    for (size_t v = 0; v < count; v++) {
        const bool fits = value[v] >= 0.0 && value[v] <= INT_MAX;
        label[v] = fits ? (int)value[v] : 0;
        plain &= (double)label[v] == value[v];
    }
    return plain;
}

// Converts values to labels, which are integers that fit an int.
static bool round_labels(const VolumeData *data, const double *value, size_t count, Slice *slice,
                         Status *status)
{
    for (size_t v = 0; v < count; v++) {
        const double x = data->slope != 0.0 ? data->slope * value[v] + data->inter : value[v];
        const double whole = rint(x);
        if (!(fabs(x - whole) <= SLACK && fabs(whole) <= INT_MAX))
            return fail_label(data, slice, (long)v, x, status);
        slice->label[slice->filled + (long)v] = whole > 0.0 ? (int)whole : 0;
        slice->volume->negative += whole < 0.0;
    }
    return true;
}

// Passes on full slices.
static bool to_labels(const VolumeData *data, const double *value, size_t count, Slice *slice,
                      Status *status)
{
    while (count > 0) {
        const size_t left = (size_t)(slice->area - slice->filled),
                     part = count < left ? count : left;
        if ((data->slope != 0.0 || !copy_labels(value, part, slice->label + slice->filled)) &&
            !round_labels(data, value, part, slice, status))
            return false;
        slice->filled += (long)part;
        value += part;
        count -= part;
        if (slice->filled < slice->area)
            break;
        if (!slice->take(slice->user, slice->k++, slice->label, status))
            return false;
        slice->filled = 0;
    }
    return true;
}

// --- a whole volume ---

// Refuses by arithmetic what the file cannot hold, before memory is allocated.
static bool check_size(const VolumeData *data, double voxels, Status *status)
{
    const VolumeFile *file = &data->file;
    double bytes = voxels * voxel_type_size(data->type), have = (double)(file->size - data->offset);
    // Raw data have just their size,
    if (data->encoding == ENCODING_RAW && have < bytes)
        return status_fail(status, STATUS_INVALID,
                           "%s: %.0f voxels take %.0f bytes, the file has %.0f for them",
                           file->path, voxels, bytes, fmax(have, 0.0));
    // the others at least so much.
    double least = 0.0; // bytes that they occupy in the encoding
    if (data->encoding == ENCODING_GZIP)
        least = (bytes + (double)data->skip) / DEFLATE_RATIO;
    else if (data->encoding == ENCODING_TEXT)
        least = 2.0 * voxels - 1.0;
    else if (data->encoding == ENCODING_HEX)
        least = 2.0 * bytes;
    if (have >= least)
        return true;
    return status_fail(status, STATUS_INVALID,
                       "%s: %.0f voxels of %d bytes cannot be in the %.0f bytes that the file has "
                       "for them",
                       file->path, voxels, voxel_type_size(data->type), fmax(have, 0.0));
}

static bool ends_early(const VolumeData *data, Source *source, long voxel, Status *status)
{
    const char *fault = source_fault(source);
    if (fault != NULL)
        return status_fail(status, STATUS_INVALID, "%s: its packed data %s at or before voxel %ld",
                           data->file.path, fault, voxel);
    return status_fail(status, STATUS_INVALID, "%s: the data ends, or is damaged, at voxel %ld",
                       data->file.path, voxel);
}

static bool read_chunk(const VolumeData *data, Source *source, unsigned char *bytes, double *value,
                       size_t count, long first, Status *status)
{
    size_t size = (size_t)voxel_type_size(data->type), got;
    // Numbers as text are read one by one.
    if (data->encoding == ENCODING_TEXT) {
        char word[LONGEST_NUMBER + 1] = "";
        for (size_t v = 0; v < count; v++)
            if (!read_number(source, &value[v], word))
                return word[0] == 0 ? ends_early(data, source, first + (long)v, status)
                                    : status_fail(status, STATUS_INVALID,
                                                  "%s: voxel %ld is '%s', not a number",
                                                  data->file.path, first + (long)v, word);
        return true;
    }
    // Bytes are turned into numbers all at once.
    if (data->encoding == ENCODING_HEX)
        got = read_hex(source, bytes, count * size);
    else
        got = source_read(source, bytes, count * size);
    if (got < count * size)
        return ends_early(data, source, first + (long)(got / size), status);
    if (data->swapped)
        swap_values(bytes, count, size);
    convert(bytes, count, data->type, value);
    return true;
}

// Keeps the values of one layer, of those that begin at `first` in the file; returns how many.
static size_t keep_layer(const VolumeData *data, const LabelVolume *volume, long first,
                         size_t count, double *value)
{
    size_t kept = 0;
    if (volume->layers <= 1)
        return count;
    for (size_t v = 0; v < count; v++)
        if ((first + (long)v) / data->inner % volume->layers == volume->layer - 1)
            value[kept++] = value[v];
    return kept;
}

static bool read_values(const VolumeData *data, const LabelVolume *volume, Source *source,
                        VolumeSink *sink, void *user, Status *status)
{
    unsigned char *bytes = malloc((size_t)CHUNK * 8);
    double *value = malloc((size_t)CHUNK * sizeof *value);
    ASSERT(bytes != NULL && value != NULL);
    bool ok = true;
    // Read over what precedes the voxels.
    for (long long left = data->skip; ok && left > 0;) {
        size_t part = left < CHUNK ? (size_t)left : CHUNK;
        ok = source_read(source, bytes, part) == part || ends_early(data, source, 0, status);
        left -= (long long)part;
    }
    // Then a piece at a time, so that memory does not grow with the file.
    const long values =
        (long)volume->count[0] * volume->count[1] * volume->count[2] * volume->layers;
    for (long first = 0; ok && first < values; first += CHUNK) {
        size_t count = (size_t)(values - first < CHUNK ? values - first : CHUNK);
        ok = read_chunk(data, source, bytes, value, count, first, status) &&
             sink(user, data, volume, first, value, count, status);
    }
    free(bytes);
    free(value);
    return ok;
}

bool volume_data_values(const VolumeData *data, const LabelVolume *volume, VolumeSink *sink,
                        void *user, Status *status)
{
    double voxels = (double)volume->count[0] * (double)volume->count[1] * (double)volume->count[2];
    // The size must be one that can be, before memory is taken.
    if (voxels > VOLUME_MOST_VOXELS)
        return status_fail(status, STATUS_INVALID, "%s: %d x %d x %d voxels are more than %d",
                           data->file.path, volume->count[0], volume->count[1], volume->count[2],
                           VOLUME_MOST_VOXELS);
    if (!check_size(data, voxels * volume->layers, status))
        return false;
    // Read them; a damaged stream shows at its end.
    Source source;
    bool ok = source_open(&source, &data->file, data->offset, data->encoding == ENCODING_GZIP);
    if (!ok) {
        status_fail(status, STATUS_FAILED, "%s: %s", data->file.path, strerror(errno));
    } else {
        ok = read_values(data, volume, &source, sink, user, status);
        const char *fault = ok ? source_fault(&source) : NULL;
        if (fault != NULL)
            ok = status_fail(status, STATUS_INVALID, "%s: its packed data %s", data->file.path,
                             fault);
        source_close(&source);
    }
    return ok;
}

// Takes the values of one layer as labels.
static bool take_labels(void *user, const VolumeData *data, const LabelVolume *volume, long first,
                        double *value, size_t count, Status *status)
{
    Slice *slice = user;
    // Memory only once the size is known to be one that can be.
    if (slice->label == NULL) {
        slice->area = (long)volume->count[0] * volume->count[1];
        slice->label = malloc((size_t)slice->area * sizeof *slice->label);
        if (slice->label == NULL)
            return status_fail(status, STATUS_FAILED, "%s: no memory for %ld voxels",
                               data->file.path, slice->area);
    }
    return to_labels(data, value, keep_layer(data, volume, first, count, value), slice, status);
}

bool volume_data_read(const VolumeData *data, LabelVolume *volume, VolumeTake *take, void *user,
                      Status *status)
{
    Slice slice = {.volume = volume, .take = take, .user = user};
    const bool ok = volume_data_values(data, volume, take_labels, &slice, status);
    free(slice.label);
    return ok;
}
