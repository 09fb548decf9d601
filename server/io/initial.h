// Initial states of bodies, in HDF5. Load time only.
#ifndef PLIANT_IO_INITIAL_H
#define PLIANT_IO_INITIAL_H

#include "base/status.h"
#include "geometry/mesh.h"

// Reads /position [m] and /velocity [m/s], [n][3] float64, of an `initial` file. n must be
// mesh->node_count, or mesh->file_node_count (each node then takes its row of the file). The caller
// frees the arrays.
bool initial_read(const char *path, const TriMesh *mesh, Vec3 **position, Vec3 **velocity,
                  Status *status);
// Reads the same for a body whose nodes are not known yet: all rows of the file, at most `most`.
bool initial_read_rows(const char *path, int most, int *count, Vec3 **position, Vec3 **velocity,
                       Status *status);

#endif
