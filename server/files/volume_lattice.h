// From label volumes to lattices.
#ifndef PLIANT_FILES_VOLUME_LATTICE_H
#define PLIANT_FILES_VOLUME_LATTICE_H

#include "files/volume_import.h"
#include "geometry/lattice.h"

// The cells with these labels, cropped: material m is the m-th label of the list (1 to
// LATTICE_MATERIALS of them, each once). `size` [m] of the cells; 0: the smallest spacing. Voxels
// that are cubes within 1e-3 become cells when size is 0; else cells take the label of the voxel
// that their centre lies in. The lattice's axes are those of the volume, one of them turned round
// when these are left-handed. False with a status (which does not name the file): a label that is
// not there, nothing left, too many cells, an extent outside MESH_SMALLEST_EXTENT to
// MESH_LARGEST_EXTENT.
bool volume_lattice(const LabelVolume *volume, const int *label, int label_count, double size,
                    Lattice *lattice, Status *status);

#endif
