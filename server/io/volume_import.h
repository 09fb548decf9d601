// SPDX-License-Identifier: MIT
// Reads label volumes (images whose voxels name the tissue that they lie in) from NRRD and NIfTI-1
// files, recognised by content, not by name.
#ifndef PLIANT_IO_VOLUME_IMPORT_H
#define PLIANT_IO_VOLUME_IMPORT_H

#include "base/check.h"
#include "base/vec.h"
#include "geometry/surface_field.h"

enum { VOLUME_MOST_VOXELS = 1 << 28 };

// A volume in DICOM's frame LPS: x to the patient's left, y to the back, z to the head. Voxel (i,
// j, k) has its centre at origin + i axis[0] + j axis[1] + k axis[2].
typedef struct LabelVolume {
    const char *format; // "NRRD"
    int count[3];       // voxels along the axes of the file, without axes of one value
    Vec3 axis[3];       // [m] perpendicular within 1e-3, of either handedness
    Vec3 origin;        // [m]
    int *label;         // [(k count[1] + j) count[0] + i], malloc'ed, owned
} LabelVolume;

// Reads a volume with its spacing, direction, origin and units: NRRD's spaces LPS, LAS and RAS,
// NIfTI's sform before its qform. The default unit is the millimetre; without a direction (or in a
// space that is not the patient's) the axes are taken as LPS. Errors are one sentence that names
// the file. Allocates nothing that the file cannot hold.
bool volume_import(const char *path, LabelVolume *volume, Status *status);
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
