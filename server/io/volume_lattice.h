// Converts label volumes to lattices.
#ifndef PLIANT_IO_VOLUME_LATTICE_H
#define PLIANT_IO_VOLUME_LATTICE_H

#include "io/volume_import.h"
#include "geometry/lattice.h"

// Makes cells of the voxels with these labels, cropped: material m is the m-th label of the list (1
// to LATTICE_MATERIALS of them, each once). `size` [m] of the cells; 0: the smallest spacing. With
// size 0, voxels that are cubes within 1e-3 become cells; else a cell takes the label of the voxel
// that contains its centre. The lattice's axes are those of the volume, with one reversed if they
// are left-handed. Returns false with a status (which does not name the file): a missing label, an
// empty result, too many cells, or an extent outside MESH_SMALLEST_EXTENT to MESH_LARGEST_EXTENT.
bool volume_lattice(const LabelVolume *volume, const int *label, int label_count, double size,
                    Lattice *lattice, Status *status);

#endif
