// Where the voxels of a volume lie in a file and how they are written; read by one function for all
// formats. Private to files/.
//
// Teem and niftilib have readers of their own, which are not for files of unknown origin: that of
// ASCII numbers writes words of any length into a buffer of fixed size, that of gzip keeps its
// memory when the stream is damaged, both allocate what a header asks for. So the libraries say
// what a header means, and this reads the voxels.
#ifndef PLIANT_FILES_VOLUME_DATA_H
#define PLIANT_FILES_VOLUME_DATA_H

#include "files/volume_import.h"

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
    long long skip;   // bytes to leave out behind it, when unpacked
    VoxelEncoding encoding;
    VoxelType type;
    bool swapped;        // bytes in the order that is not this machine's
    double slope, inter; // label = slope value + inter; slope 0: label = value
} VolumeData;

// False with a status that names the file; volume_file_close in any case.
bool volume_file_open(const char *path, VolumeFile *file, Status *status);
void volume_file_close(VolumeFile *file);
// The first bytes, unpacked: up to `size`, returns how many.
int volume_file_head(const VolumeFile *file, void *bytes, int size);

int voxel_type_size(VoxelType type); // [bytes]

// Reads volume->count labels into volume->label, which it allocates when the file can hold them.
bool volume_data_read(const VolumeData *data, LabelVolume *volume, Status *status);

// The headers of the two formats: fill everything of `volume` but the labels, and `data`, whose
// file is `file` or takes its place (a header's own file of voxels).
bool volume_read_nrrd(const VolumeFile *file, LabelVolume *volume, VolumeData *data,
                      Status *status);
bool volume_is_nifti(const unsigned char *head, int size);
bool volume_read_nifti(const VolumeFile *file, LabelVolume *volume, VolumeData *data,
                       Status *status);

#endif
