// SPDX-License-Identifier: MIT
#include "hdf_edit.h"

#include <hdf5.h>

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

enum { EDITS_MOST = 12, SEAL_BYTES = 512, SET_MOST = 1 << 22 };

static unsigned char *read_file(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    MUST(file != NULL && fseek(file, 0, SEEK_END) == 0);
    *size = (size_t)ftell(file);
    rewind(file);
    unsigned char *bytes = malloc(*size + 1);
    MUST(bytes != NULL && fread(bytes, 1, *size, file) == *size && fclose(file) == 0);
    return bytes;
}

static herr_t note_set(hid_t group, const char *name, const H5O_info_t *info, void *user)
{
    HdfBase *base = user;
    (void)group;
    if (info->type == H5O_TYPE_DATASET && base->set_count < HDF_SETS && strlen(name) < HDF_NAME)
        snprintf(base->set[base->set_count++], HDF_NAME, "%s", name);
    return 0;
}

void hdf_base_read(HdfBase *base, const char *path)
{
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    base->bytes = read_file(path, &base->size);
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    MUST(file >= 0 && H5Ovisit(file, H5_INDEX_NAME, H5_ITER_INC, note_set, base) >= 0);
    MUST(base->set_count > 0);
    H5Fclose(file);
}

// --- edits ---------------------------------------------------------------------------------------

// Whether it consists of many chunks of one number, as edit_shape makes them: HDF5 takes some
// hundred bytes of memory for each that is written.
static bool is_crumbs(hid_t set, size_t numbers)
{
    hsize_t chunk[8] = {0}, in_chunk = 1;
    hid_t layout = H5Dget_create_plist(set);
    int rank = H5Pget_layout(layout) == H5D_CHUNKED ? H5Pget_chunk(layout, 8, chunk) : 0;
    for (int d = 0; d < rank; d++)
        in_chunk *= chunk[d];
    H5Pclose(layout);
    return rank > 0 && numbers / in_chunk > 65536;
}

// Other bytes at some place of a data set.
static void edit_bytes(hid_t set, Feed *feed)
{
    static unsigned char data[SET_MOST];
    hid_t type = H5Dget_type(set), space = H5Dget_space(set);
    size_t numbers = (size_t)H5Sget_simple_extent_npoints(space);
    size_t size = H5Tget_size(type) * numbers;
    if (size > 0 && size <= SET_MOST && !is_crumbs(set, numbers) &&
        H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0) {
        size_t at = feed_word(feed, 3) % size;
        // Whole numbers more often than parts of them.
        if (feed_byte(feed) % 4 != 0)
            at -= at % H5Tget_size(type);
        Feed part = feed_part(feed, size - at);
        memcpy(data + at, part.at, part.left);
        H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
    }
    H5Sclose(space);
    H5Tclose(type);
}

// One number that means something.
static void edit_number(hid_t set, Feed *feed)
{
    static const int64_t strange[] = {
        0,         1,     -1,      2,         127,        128, 255, 256,        INT32_MAX,
        INT32_MIN, 65535, 1000000, INT64_MAX, 0x7fffffff, -2,  3,   UINT32_MAX, 63};
    hid_t type = H5Dget_type(set), space = H5Dget_space(set);
    hssize_t count = H5Sget_simple_extent_npoints(space);
    hssize_t at = count > 0 ? (hssize_t)(feed_word(feed, 3) % (uint64_t)count) : 0;
    hsize_t size[8] = {0}, place[8] = {0};
    int rank = H5Sget_simple_extent_dims(space, size, NULL);
    for (int d = rank - 1; d >= 0 && count > 0; d--) {
        place[d] = (hsize_t)at % size[d];
        at /= (hssize_t)size[d];
    }
    if (count > 0 && rank > 0)
        H5Sselect_elements(space, H5S_SELECT_SET, 1, place);
    hid_t one = H5Screate(H5S_SCALAR);
    if (count > 0 && H5Tget_class(type) == H5T_FLOAT) {
        double value = feed_number(feed, 0.1);
        H5Dwrite(set, H5T_NATIVE_DOUBLE, one, space, H5P_DEFAULT, &value);
    } else if (count > 0) {
        int64_t value = strange[feed_byte(feed) % (sizeof strange / sizeof *strange)];
        H5Dwrite(set, H5T_NATIVE_INT64, one, space, H5P_DEFAULT, &value);
    }
    H5Sclose(one);
    H5Sclose(space);
    H5Tclose(type);
}

// The same name with another shape or type; its contents, if any, are zero.
static void edit_shape(hid_t file, const char *name, hid_t set, Feed *feed)
{
    static const hsize_t strange[] = {0, 1, 2, 3, 4, 7, 8, 9, 1000, 1 << 20, 1 << 28, 1ULL << 40};
    hid_t types[] = {H5T_IEEE_F64LE, H5T_IEEE_F32LE, H5T_STD_I32LE, H5T_STD_U8LE,
                     H5T_STD_I64BE,  H5T_STD_U64LE,  H5T_C_S1};
    hid_t space = H5Dget_space(set), type = H5Dget_type(set);
    hsize_t size[8] = {0};
    int rank = H5Sget_simple_extent_dims(space, size, NULL);
    uint8_t what = feed_byte(feed);
    if (what & 1)
        rank = feed_byte(feed) % 4;
    for (int d = 0; d < rank; d++)
        if (what & 2 << d)
            size[d] = strange[feed_byte(feed) % (sizeof strange / sizeof *strange)];
    hid_t chosen = what & 16 ? types[feed_byte(feed) % 7] : type;
    H5Sclose(space);
    H5Ldelete(file, name, H5P_DEFAULT);
    space = rank == 0 ? H5Screate(H5S_SCALAR) : H5Screate_simple(rank, size, NULL);
    hid_t layout = H5Pcreate(H5P_DATASET_CREATE);
    if (what & 32 && rank > 0) {
        // Nothing of it is stored, however large it says it is.
        const hsize_t chunk[3] = {1, 1, 1};
        H5Pset_chunk(layout, rank, chunk);
        H5Pset_deflate(layout, 1);
    }
    hid_t made = H5Dcreate2(file, name, chosen, space, H5P_DEFAULT, layout, H5P_DEFAULT);
    if (made >= 0)
        H5Dclose(made);
    H5Pclose(layout);
    H5Sclose(space);
    H5Tclose(type);
}

// Replaces, changes or deletes an attribute.
static void edit_attribute(hid_t file, const char *name, Feed *feed)
{
    hid_t object = H5Oopen(file, name, H5P_DEFAULT);
    hsize_t count = object >= 0 ? (hsize_t)H5Aget_num_attrs(object) : 0;
    if (object < 0 || count == 0 || count > 64) {
        if (object >= 0)
            H5Oclose(object);
        return;
    }
    char text[64];
    hsize_t index = feed_byte(feed) % count;
    hid_t attribute =
        H5Aopen_by_idx(file, name, H5_INDEX_NAME, H5_ITER_INC, index, H5P_DEFAULT, H5P_DEFAULT);
    H5Aget_name(attribute, sizeof text, text);
    uint8_t what = feed_byte(feed) % 4;
    if (what == 0) {
        int value = (int)feed_number(feed, 10.0) % 1000;
        H5Awrite(attribute, H5T_NATIVE_INT, &value);
        H5Aclose(attribute);
    } else {
        H5Aclose(attribute);
        H5Adelete(object, text);
        if (what > 1) {
            Feed part = feed_part(feed, 300);
            char value[301] = {0};
            memcpy(value, part.at, part.left);
            hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
            H5Tset_size(type, what == 2 ? sizeof value : part.left + 1);
            attribute = H5Acreate2(object, text, type, space, H5P_DEFAULT, H5P_DEFAULT);
            if (attribute >= 0) {
                H5Awrite(attribute, type, value);
                H5Aclose(attribute);
            }
            H5Sclose(space);
            H5Tclose(type);
        }
    }
    H5Oclose(object);
}

static void edit(const HdfBase *base, hid_t file, Feed *feed)
{
    uint8_t what = feed_byte(feed) % 8;
    const char *name = base->set[feed_word(feed, 2) % (uint64_t)base->set_count];
    if (what == 7) {
        // Of the set, of its group, of the root.
        char object[HDF_NAME];
        snprintf(object, sizeof object, "%s", name);
        for (int up = feed_byte(feed) % 3; up > 0; up--) {
            char *slash = strrchr(object, '/');
            snprintf(slash != NULL ? slash : object, 2, "%s", slash != NULL ? "" : "/");
        }
        edit_attribute(file, object, feed);
        return;
    }
    hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
    if (set < 0)
        return;
    if (what < 3)
        edit_bytes(set, feed);
    else if (what < 5)
        edit_number(set, feed);
    else if (what == 5)
        edit_shape(file, name, set, feed);
    else
        H5Ldelete(file, name, H5P_DEFAULT);
    H5Dclose(set);
}

static void seal(const char *name, const char *path)
{
    size_t size;
    unsigned char *bytes = read_file(path, &size);
    uint64_t hash = 14695981039346656037u;
    for (size_t i = SEAL_BYTES; i < size; i++)
        hash = (hash ^ bytes[i]) * 1099511628211u;
    memset(bytes, 0, SEAL_BYTES);
    snprintf((char *)bytes, SEAL_BYTES, "pliant: %zu bytes follow, fnv1a %016" PRIx64 "\n",
             size - SEAL_BYTES, hash);
    fuzz_write(name, bytes, size);
    free(bytes);
}

const char *hdf_base_edit(const HdfBase *base, const char *name, Feed *feed, bool sealed)
{
    const char *path = fuzz_write(name, base->bytes, base->size);
    hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
    MUST(file >= 0);
    for (int i = 0; i < EDITS_MOST && feed->left > 0; i++)
        edit(base, file, feed);
    H5Fclose(file);
    if (sealed)
        seal(name, path);
    return fuzz_path(name);
}
