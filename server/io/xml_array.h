// SPDX-License-Identifier: MIT
// Arrays of numbers in VTK's XML files: ASCII, base64 or raw, where they stand or in the part
// behind, also as blocks of zlib. Load time only; private to io.
#ifndef PLIANT_IO_XML_ARRAY_H
#define PLIANT_IO_XML_ARRAY_H

#include "io/mesh_formats.h"

// How a file encodes its arrays.
typedef struct XmlCoding {
    const char *path;
    bool big_endian;
    int word;                   // [bytes] of the lengths in front of an array
    bool packed;                // by zlib
    const char *appended, *end; // the part behind, NULL without; the end of the file
    bool appended_base64;
} XmlCoding;

typedef struct XmlArray {
    bool given, ascii, appended;
    NumberType type;
    double offset; // [bytes] in the part behind
    Text content;  // what stands in the element; its line is of the element
} XmlArray;

// Numbers of an array, one after the other.
typedef struct Numbers {
    const XmlArray *array;
    const char *what; // for error texts
    bool big_endian;
    Text text;
    char *bytes; // [count] numbers, unless ASCII
    double count, at;
} Numbers;

// Finds an element's array of `count` numbers and decodes it, or fails with file and line. Takes
// memory for no more than the file can hold. numbers_close frees it in either case.
bool numbers_open(const XmlCoding *coding, const XmlArray *array, const char *what, double count,
                  Numbers *numbers, Status *status);
// The next number of at most `count`.
bool numbers_next(Numbers *numbers, double *number, Status *status);
void numbers_close(Numbers *numbers);

// Decodes the bytes of a short array whose length is not known, as of a text; returns how many, at
// most `most`.
size_t xml_array_bytes(const XmlCoding *coding, const XmlArray *array, char *bytes, size_t most);

#endif
