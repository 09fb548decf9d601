// SPDX-License-Identifier: MIT
// Volume files written byte by byte, by none of the libraries that read them.
#ifndef PLIANT_TESTS_VOLUME_WRITER_H
#define PLIANT_TESTS_VOLUME_WRITER_H

#include "scratch_folder.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>

enum { BYTES_MOST = 1 << 16 };

typedef struct Bytes {
    unsigned char at[BYTES_MOST];
    size_t size;
} Bytes;

static inline void put_bytes(Bytes *bytes, const void *from, size_t size)
{
    if (bytes->size + size > BYTES_MOST)
        abort();
    memcpy(bytes->at + bytes->size, from, size);
    bytes->size += size;
}

__attribute__((format(printf, 2, 3))) static inline void put_text(Bytes *bytes, const char *format,
                                                                  ...)
{
    char text[4096];
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    put_bytes(bytes, text, (size_t)length);
}

// The lowest `size` bytes of a number in the order asked for.
static inline void put_number(Bytes *bytes, uint64_t bits, int size, bool big)
{
    for (int b = 0; b < size; b++) {
        unsigned char byte = (unsigned char)(bits >> 8 * (big ? size - 1 - b : b));
        put_bytes(bytes, &byte, 1);
    }
}

typedef struct Type {
    const char *nrrd; // its name
    int nifti;        // its code
    int size;         // [bytes]
    char kind;        // i, u or f
} Type;

static const Type TYPES[] = {{"signed char", 256, 1, 'i'}, {"uchar", 2, 1, 'u'},
                             {"short", 4, 2, 'i'},         {"unsigned short", 512, 2, 'u'},
                             {"int", 8, 4, 'i'},           {"uint32_t", 768, 4, 'u'},
                             {"longlong", 1024, 8, 'i'},   {"uint64", 1280, 8, 'u'},
                             {"float", 16, 4, 'f'},        {"double", 64, 8, 'f'}};
enum { TYPE_COUNT = 10 };

static inline void put_value(Bytes *bytes, const Type *type, double value, bool big)
{
    uint64_t bits = type->kind == 'f' ? 0 : (uint64_t)(int64_t)value; // which may be NaN
    float single = (float)value;
    uint32_t low;
    if (type->kind == 'f' && type->size == 4) {
        memcpy(&low, &single, 4);
        bits = low;
    } else if (type->kind == 'f') {
        memcpy(&bits, &value, 8);
    }
    put_number(bytes, bits, type->size, big);
}

// A gzip file whose blocks are stored, not packed (RFC 1951, 3.2.4; RFC 1952).
static inline void put_gzip(Bytes *bytes, const void *from, size_t size)
{
    static const unsigned char head[10] = {0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 3};
    const unsigned char *data = from;
    uint32_t crc = 0xffffffff;
    put_bytes(bytes, head, sizeof head);
    for (size_t at = 0; at < size || at == 0;) {
        size_t part = size - at < 1000 ? size - at : 1000;
        put_number(bytes, at + part == size, 1, false);
        put_number(bytes, part, 2, false);
        put_number(bytes, ~part, 2, false);
        put_bytes(bytes, data + at, part);
        at += part > 0 ? part : 1;
    }
    for (size_t i = 0; i < size; i++) {
        crc ^= data[i];
        for (int b = 0; b < 8; b++)
            crc = crc & 1 ? crc >> 1 ^ 0xedb88320 : crc >> 1;
    }
    put_number(bytes, ~crc, 4, false);
    put_number(bytes, size, 4, false);
}

// What a NIfTI-1 header says, at the places that the standard gives (nifti1.h of NIfTI).
typedef struct NiftiFields {
    int dim[8];
    int datatype;
    float pixdim[8];
    float vox_offset, slope, inter;
    int units, qform, sform;
    float quatern[3], qoffset[3], srow[3][4];
    const char *magic; // "n+1" or "ni1"
} NiftiFields;

static inline void put_nifti(Bytes *bytes, const NiftiFields *fields, bool big)
{
    Bytes *head = calloc(1, sizeof *head);
    if (head == NULL)
        abort();
#define AT(offset) head->size = (offset)
#define FLOAT(value)                                                                               \
    do {                                                                                           \
        float put_float = (value);                                                                 \
        uint32_t put_bits;                                                                         \
        memcpy(&put_bits, &put_float, 4);                                                          \
        put_number(head, put_bits, 4, big);                                                        \
    } while (0)
    put_number(head, 348, 4, big);
    AT(40);
    for (int d = 0; d < 8; d++)
        put_number(head, (uint64_t)fields->dim[d], 2, big);
    AT(70);
    put_number(head, (uint64_t)fields->datatype, 2, big);
    AT(76);
    for (int d = 0; d < 8; d++)
        FLOAT(fields->pixdim[d]);
    FLOAT(fields->vox_offset);
    FLOAT(fields->slope);
    FLOAT(fields->inter);
    AT(123);
    put_number(head, (uint64_t)fields->units, 1, big);
    AT(252);
    put_number(head, (uint64_t)fields->qform, 2, big);
    put_number(head, (uint64_t)fields->sform, 2, big);
    for (int d = 0; d < 3; d++)
        FLOAT(fields->quatern[d]);
    for (int d = 0; d < 3; d++)
        FLOAT(fields->qoffset[d]);
    for (int d = 0; d < 12; d++)
        FLOAT(fields->srow[d / 4][d % 4]);
    AT(344);
    put_bytes(head, fields->magic, 4);
#undef AT
#undef FLOAT
    put_bytes(bytes, head->at, 348);
    free(head);
}

#endif
