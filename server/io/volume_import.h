// SPDX-License-Identifier: MIT
// Reads label volumes (images whose voxels name the tissue that they lie in) from NRRD and NIfTI-1
// files, recognised by content, not by name.
#ifndef PLIANT_IO_VOLUME_IMPORT_H
#define PLIANT_IO_VOLUME_IMPORT_H

#include "base/check.h"
#include "base/vec.h"
#include "geometry/surface_field.h"

enum {
    VOLUME_MOST_VOXELS = 1 << 28,
    VOLUME_MOST_LABELS = 1 << 12, // different ones; more are grey values
    VOLUME_MOST_LAYERS = 64,      // that are looked through for labels
    VOLUME_NAME = 64,             // bytes of a label's name
};

// What a file says of a label: 3D Slicer's SegmentN_Name, _LabelValue, _Layer and _Color.
typedef struct VolumeSegment {
    int label, layer;
    char name[VOLUME_NAME]; // printable, "": none
    float colour[3];        // red, green, blue, 0 to 1; the first is negative: none
} VolumeSegment;

// A volume in DICOM's frame LPS: x to the patient's left, y to the back, z to the head. Voxel (i,
// j, k) has its centre at origin + i axis[0] + j axis[1] + k axis[2].
typedef struct LabelVolume {
    const char *format;     // "NRRD"
    int count[3];           // voxels along the axes of the file, without axes of one value
    Vec3 axis[3];           // [m] perpendicular within 1e-3, of either handedness
    Vec3 origin;            // [m]
    int low[3], high[3];    // the voxels that were read, high not in it; the others count as empty
    int *label;             // of those, x fastest, 0: empty, malloc'ed, owned; volume_label_at
    int layers, layer;      // images in the file, and which of them this is, from 1
    int labels;             // that the layer has, if volume_import_labels read it
    long negative;          // voxels with negative values, which are empty
    VolumeSegment *segment; // [segment_count] of all layers, owned
    int segment_count;
    char notes[400]; // what was assumed where the file is not plain, as sentences; "": nothing
} LabelVolume;

// Returns the label of a voxel; 0 where none was read.
static inline int volume_label_at(const LabelVolume *volume, int i, int j, int k)
{
    const int *low = volume->low, *high = volume->high;
    if (i < low[0] || j < low[1] || k < low[2] || i >= high[0] || j >= high[1] || k >= high[2])
        return 0;
    return volume
        ->label[((long)(k - low[2]) * (high[1] - low[1]) + j - low[1]) * (high[0] - low[0]) + i -
                low[0]];
}

// A label that voxels have, or that the file names.
typedef struct VolumeLabel {
    int label, layer;
    char name[VOLUME_NAME];
    float colour[3];
    long voxels;
    int low[3], high[3]; // its box in voxels, high not in it
    int pieces;          // that no face joins; 0: too many to count
} VolumeLabel;

typedef struct VolumeLabels {
    VolumeLabel *label; // [count] from the largest to the smallest, owned
    int count;
} VolumeLabels;

// Reads a volume with its spacing, direction, origin and units: NRRD's spaces LPS, LAS and RAS,
// NIfTI's sform before its qform. The default unit is the millimetre; without a direction (or in a
// space that is not the patient's) the axes are taken as LPS. Errors are one sentence that names
// the file. Allocates nothing that the file cannot hold. `layer`: of a file with several images (a
// layered segmentation, frames) the one to read, from 1.
bool volume_import(const char *path, int layer, LabelVolume *volume, Status *status);
// The same of the box alone that has these labels. Fails also if a label is missing, or if it is an
// image of grey values.
bool volume_import_labels(const char *path, int layer, const int *label, int label_count,
                          LabelVolume *volume, Status *status);
// Reads all of a volume but its voxels.
bool volume_import_header(const char *path, LabelVolume *volume, Status *status);
// Returns the label of a name and its layer, which is searched alone if it is not 0. 0 with a
// status that lists the names: there is none, or there are several.
int volume_find_name(const LabelVolume *volume, const char *name, int *layer, Status *status);
// Lists the labels of a volume. Returns false with a status (which does not name the file) if it
// is an image of grey values.
bool volume_labels(const LabelVolume *volume, VolumeLabels *list, Status *status);
// Lists the labels of one layer of a file, or with 0 of all, without keeping its voxels. `volume`:
// what is said of the layer read last.
bool volume_survey(const char *path, int layer, LabelVolume *volume, VolumeLabels *list,
                   Status *status);
// Finds the layer that has the most voxels of these labels.
bool volume_find_layer(const char *path, const int *label, int label_count, int *layer,
                       Status *status);
void volume_labels_destroy(VolumeLabels *list);
// True if the content of a file is a volume, judged by its first bytes.
bool volume_is_one(const char *path);
// Finds the file beside `path` that holds the voxels of a detached header; the caller frees its
// name. NULL: `path` contains them. Reads the header only.
bool volume_find_data(const char *path, char **found, Status *status);
void volume_destroy(LabelVolume *volume);

// Converts label volumes to lattices.

// Makes cells of the voxels with these labels, cropped: material m is the m-th label of the list (1
// to LATTICE_MATERIALS of them, each once). `size` [m] of the cells; 0: the smallest spacing. With
// size 0, voxels that are cubes within 1e-3 become cells; else a cell takes the label of the voxel
// that contains its centre. The lattice's axes are those of the volume, with one reversed if they
// are left-handed. Returns false with a status (which does not name the file): a missing label, an
// empty result, too many cells, or an extent outside MESH_SMALLEST_EXTENT to MESH_LARGEST_EXTENT.
bool volume_lattice(const LabelVolume *volume, const int *label, int label_count, double size,
                    Lattice *lattice, Status *status);
// Makes the field of the smooth surface of the same voxels, for the lattice that volume_lattice
// made of them.
void volume_field(const LabelVolume *volume, const int *label, int label_count,
                  const Lattice *lattice, SurfaceField *field);

#endif
