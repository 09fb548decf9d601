// SPDX-License-Identifier: MIT
// HDF5 files for the fuzzers: a whole one whose data sets and attributes are changed as an input
// says, so that the changes reach our own checks and not only those of the library.
#ifndef PLIANT_TESTS_FUZZ_HDF_EDIT_H
#define PLIANT_TESTS_FUZZ_HDF_EDIT_H

#include "fuzz.h"

enum { HDF_SETS = 256, HDF_NAME = 128 };

typedef struct HdfBase {
    unsigned char *bytes;
    size_t size;
    char set[HDF_SETS][HDF_NAME]; // names of all data sets
    int set_count;
} HdfBase;

// Keeps a file in memory; it stays for the rest of the program.
void hdf_base_read(HdfBase *base, const char *path);
// Writes a copy changed by what the feed says; with `sealed` the seal of our own files is made
// right again. Returns its path.
const char *hdf_base_edit(const HdfBase *base, const char *name, Feed *feed, bool sealed);

#endif
