// Meshes made by formula, for tests, demos and scenes. Every one is valid (mesh_validate), centred
// at the origin unless said, outward oriented, and the same bits on every call.
#ifndef PLIANT_GEOMETRY_GENERATOR_H
#define PLIANT_GEOMETRY_GENERATOR_H

#include "base/status.h"
#include "geometry/mesh.h"

// All functions create `mesh` (owned by the caller) and return false with `status` for a parameter
// outside its range, creating nothing.

// `nodes` points spread evenly over a sphere and their convex hull: 3 nodes - 6 edges. nodes in
// [4, 20000], radius > 0 [m].
bool generate_sphere(TriMesh *mesh, int nodes, double radius, Status *status);
// Two poles (0, 0, +-radius) and `rings` rings of `segments` nodes at equal latitude steps:
// rings * segments + 2 nodes. rings in [1, 2000], segments in [3, 4000]. 8 x 14 is the sphere of
// Choi et al. 2005, Fig. 8: 114 nodes, 336 edges.
bool generate_uv_sphere(TriMesh *mesh, int rings, int segments, double radius, Status *status);
// Icosahedron whose triangles are split in four `subdivisions` times, on the sphere:
// 10 * 4^s + 2 nodes. subdivisions in [0, 8].
bool generate_ico_sphere(TriMesh *mesh, int subdivisions, double radius, Status *status);
// Flat sheet in z = 0 with normal +z: columns x rows nodes over width (x) times height (y) [m],
// uniform diagonals (valence 6 inside). columns, rows in [2, 4000].
bool generate_sheet(TriMesh *mesh, int columns, int rows, double width, double height,
                    Status *status);
// A closed stomach-like organ: a bent tube (a J in the x-z plane) of varying radius, both ends
// closed; `length` is the largest extent [m]. nodes = 188 gives exactly 188 nodes and 558 edges
// (Choi et al. 2005, Table 1). nodes in [60, 20000].
bool generate_stomach(TriMesh *mesh, int nodes, double length, Status *status);

// Texture coordinates in [0, 1]: of a closed mesh the angle around the z axis through its middle,
// there and back so that no seam is left, and the height; of a sheet in z = 0 its x and y.
void generate_texture(TriMesh *mesh, bool closed);

#endif
