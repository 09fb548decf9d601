// SPDX-License-Identifier: MIT
// Blocks of labelled cubic cells, from which voxel bodies are made.
#ifndef PLIANT_GEOMETRY_LATTICE_H
#define PLIANT_GEOMETRY_LATTICE_H

#include "base/check.h"
#include "base/vec.h"
#include "geometry/mesh.h"

#include <stddef.h>

enum {
    LATTICE_MATERIALS = 255,      // most labels in one lattice
    LATTICE_MOST_CELLS = 1 << 28, // void ones included
    LATTICE_MOST_SOLID = 1 << 24, // solid cells
};

// Largest distance of a lattice from the world's origin [m]. A larger one is a reading error, and
// single precision could not resolve the cells there.
#define LATTICE_FARTHEST 1e12

// The closed parts of the mesh that a lattice was made of.
typedef struct LatticeShells {
    int count, inner; // all, and those within an odd number of others: holes, unless `filled`
    double volume;    // of those within others [m3]
    double all;       // sum of the parts' volumes, holes too [m3]
    long hollow;      // [cells] within holes
    long overlap;     // [cells] that several parts claim: their sum, less one for each cell
    long claimed;     // [cells] that sum
    bool filled;
} LatticeShells;

// A rigid grid of cubes. Cell (i, j, k) has its low corner at origin + turn ((i, j, k) size) and
// the label label[(k * count[1] + j) * count[0] + i].
typedef struct Lattice {
    int count[3];         // cells along the axes; count[2] is 1 in the plane case
    double size;          // edge of a cell [m]
    Vec3 origin;          // low corner of cell (0, 0, 0) [m]
    Quat turn;            // from the lattice's axes to the world's, unit
    LatticeShells shells; // all 0 but of a mesh
    unsigned char *label; // 0: void; m: the m-th material, from 1. malloc'ed, owned
} Lattice;

// Creates an all-void lattice. False with a status: no cells, too many, or a size that is not
// positive and finite.
bool lattice_create(Lattice *lattice, const int count[3], double size, Status *status);
void lattice_destroy(Lattice *lattice);

static inline long lattice_index(const Lattice *lattice, int i, int j, int k)
{
    return ((long)k * lattice->count[1] + j) * lattice->count[0] + i;
}

// Returns the label of a cell; 0 outside.
int lattice_label(const Lattice *lattice, int i, int j, int k);
// Returns the world position [m] of a point given in cells from the low corner.
Vec3 lattice_point(const Lattice *lattice, double i, double j, double k);
long lattice_solid(const Lattice *lattice); // number of solid cells
// Returns the number of parts of the solid that are not connected through cell faces.
int lattice_pieces(const Lattice *lattice);
// Crops void margins, so that the outermost cells on every side are solid; the origin follows.
// False with a status when nothing is solid.
bool lattice_crop(Lattice *lattice, Status *status);
// Applies x -> rotation (scale x) + translation [m], as mesh_place.
void lattice_place(Lattice *lattice, double scale, Vec3 rotation, Vec3 translation);

// Generators, all of material 1, centred on the world's origin. `count`: cells. Errors as for
// lattice_create.
bool lattice_box(Lattice *lattice, const int count[3], double size, Status *status);
// The cells whose centre lies within `radius` [m] of the middle, which is a lattice point.
bool lattice_ball(Lattice *lattice, double radius, double size, Status *status);
// The plane case: one layer of cells with the middle plane z = 0, by the same rule in x and y.
bool lattice_disc(Lattice *lattice, double radius, double size, Status *status);

// Conversion of closed triangle meshes to lattices.

// Fills a lattice with the cells of edge `size` [m] whose centre lies inside the closed mesh, by
// how often its parts wind around it. Void margins are cropped. The lattice axes are the world's;
// before cropping, the boxes of mesh and lattice have the same middle. Each part must be oriented,
// either way: parts that overlap, or one that crosses itself, are united; one that lies wholly
// within another is a hole, unless `filled`. Rows exactly through an edge or a corner are decided
// as if moved by an infinitesimal step in y and z, so that parts with common faces divide the cells
// between them without gap or overlap. False with a status: a mesh with borders, nothing inside, or
// too many cells (with the size that would fit).
bool voxelise(Lattice *lattice, const TriMesh *mesh, double size, bool filled, Status *status);

// Says which of the parts are cavities and by how much others overlap; false if there is nothing to
// say.
bool lattice_shells_text(LatticeShells shells, char *text, size_t room);

#endif
