// Label volumes, that is images whose voxels name the tissue that they lie in, from NRRD and
// NIfTI-1 files, told apart by content, not by name.
#ifndef PLIANT_FILES_VOLUME_IMPORT_H
#define PLIANT_FILES_VOLUME_IMPORT_H

#include "base/status.h"
#include "base/vec.h"

enum { VOLUME_MOST_VOXELS = 1 << 28 };

// In the frame that DICOM calls LPS: x to the patient's left, y to the back, z to the head. Voxel
// (i, j, k) has its centre at origin + i axis[0] + j axis[1] + k axis[2].
typedef struct LabelVolume {
    const char *format; // "NRRD"
    int count[3];       // voxels along the axes of the file, those of one value left out
    Vec3 axis[3];       // [m] at right angles within 1e-3, of either handedness
    Vec3 origin;        // [m]
    int *label;         // [(k count[1] + j) count[0] + i], malloc'ed, owned
} LabelVolume;

// Reads a volume. What a file says of spacing, direction, origin and units is honoured: NRRD's
// spaces LPS, LAS and RAS, NIfTI's sform before its qform. Without units they are millimetres;
// without a direction (or in a space that is not the patient's) the axes are taken as LPS. Errors
// are one sentence that names the file. Nothing is allocated for what a file cannot hold.
bool volume_import(const char *path, LabelVolume *volume, Status *status);
// The file beside `path` that holds the voxels of a volume whose header stands alone, malloc'ed for
// the caller, or NULL: `path` has them. Reads the header only.
bool volume_find_data(const char *path, char **found, Status *status);
void volume_destroy(LabelVolume *volume);

#endif
