// SPDX-License-Identifier: MIT
// Location and encoding of a volume's voxels in a file, and one function that reads them for all
// formats. Private to io/.
// The readers of Teem and niftilib are unsafe for files of unknown origin: that of ASCII numbers
// writes words of any length into a buffer of fixed size, that of gzip leaks its memory if the
// stream is damaged, and both allocate what a header claims. So the libraries interpret the header,
// and this module reads the voxels.
#ifndef PLIANT_IO_VOLUME_DATA_H
#define PLIANT_IO_VOLUME_DATA_H

#include "io/volume_import.h"

// A regular file, open for reading.
typedef struct VolumeFile {
    char *path;
    int descriptor;
    long long size; // [bytes], not 0
    bool gzipped;   // as a whole
} VolumeFile;

typedef enum VoxelType {
    VOXEL_INT8,
    VOXEL_UINT8,
    VOXEL_INT16,
    VOXEL_UINT16,
    VOXEL_INT32,
    VOXEL_UINT32,
    VOXEL_INT64,
    VOXEL_UINT64,
    VOXEL_FLOAT32,
    VOXEL_FLOAT64,
} VoxelType;

typedef enum VoxelEncoding {
    ENCODING_RAW,
    ENCODING_GZIP,
    ENCODING_TEXT,
    ENCODING_HEX
} VoxelEncoding;

typedef struct VolumeData {
    VolumeFile file;
    long long offset; // of the first byte in the file
    long long skip;   // bytes to skip after it, when unpacked
    VoxelEncoding encoding;
    VoxelType type;
    bool swapped;        // byte order differs from this machine's
    double slope, inter; // label = slope value + inter; slope 0: label = value
    long inner;          // values in a row of one layer, before those of the next
    bool picture;        // set before the header is read: several values a voxel are layers
} VolumeData;

// Opens a file. Returns false with a status that names it; call volume_file_close in any case.
bool volume_file_open(const char *path, VolumeFile *file, Status *status);
void volume_file_close(VolumeFile *file);
// Reads up to `size` first bytes, unpacked; returns how many.
int volume_file_head(const VolumeFile *file, void *bytes, int size);

int voxel_type_size(VoxelType type); // [bytes]

// Adds a sentence to the notes of a volume, as far as they have room.
void volume_note(LabelVolume *volume, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

// Takes slice k of a layer, count[0] x count[1] labels. False with a status ends reading.
typedef bool VolumeTake(void *user, int k, const int *label, Status *status);

// Passes the slices of volume->layer to `take`, in order, after checking that the file can hold all
// layers. Values within 1e-3 of a whole number are that; negative ones are 0, and counted.
bool volume_data_read(const VolumeData *data, LabelVolume *volume, VolumeTake *take, void *user,
                      Status *status);
// Takes `count` values of all layers as they are in the file, from number `first` on; may change
// them. False with a status ends reading.
typedef bool VolumeSink(void *user, const VolumeData *data, const LabelVolume *volume, long first,
                        double *value, size_t count, Status *status);
// Passes all values to `sink`, in order, after checking that the file can hold them.
bool volume_data_values(const VolumeData *data, const LabelVolume *volume, VolumeSink *sink,
                        void *user, Status *status);
// Reads a picture: its header, then its values to `sink`.
bool volume_read_picture(const char *path, LabelVolume *volume, VolumeSink *sink, void *user,
                         Status *status);
// Reads a layer of a file: `volume` without labels, and its slices to `take`.
bool volume_read(const char *path, int layer, LabelVolume *volume, VolumeTake *take, void *user,
                 Status *status);

// Lists the labels of the voxels that were read, without judging whether they are labels; false:
// there are too many.
bool volume_list(const LabelVolume *volume, VolumeLabels *list);
// Finds the box of some labels of a list. Returns false with a status that lists the others if one
// is missing.
bool volume_find_box(const VolumeLabels *list, const int *label, int label_count, int low[3],
                     int high[3], Status *status);

// Read the headers of the two formats: set everything of `volume` but the labels, and `data`, whose
// file is `file` or, for a detached header, the file of voxels that replaces it.
bool volume_read_nrrd(const VolumeFile *file, LabelVolume *volume, VolumeData *data,
                      Status *status);
bool volume_is_nifti(const unsigned char *head, int size);
bool volume_read_nifti(const VolumeFile *file, LabelVolume *volume, VolumeData *data,
                       Status *status);

#endif
