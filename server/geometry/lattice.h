// Blocks of cubic cells with labels: what voxel bodies are made from.
#ifndef PLIANT_GEOMETRY_LATTICE_H
#define PLIANT_GEOMETRY_LATTICE_H

#include "base/status.h"
#include "base/vec.h"

enum {
    LATTICE_MATERIALS = 255,      // most labels in one lattice
    LATTICE_MOST_CELLS = 1 << 28, // void ones too
    LATTICE_MOST_SOLID = 1 << 24, // cells of a body
};

// How far from the world's origin a lattice may begin [m]: beyond, something else than a place was
// read, and single precision has no numbers left for it.
#define LATTICE_FARTHEST 1e12

// A rigid grid of cubes. Cell (i, j, k) has the corner origin + turn (i, j, k) size; its label is
// label[(k * count[1] + j) * count[0] + i].
typedef struct Lattice {
    int count[3];         // cells along its axes; count[2] is 1 in the plane case
    double size;          // edge of a cell [m]
    Vec3 origin;          // low corner of cell (0, 0, 0) [m]
    Quat turn;            // from the lattice's axes to the world's, unit
    unsigned char *label; // 0: void; m: the m-th material, from 1. malloc'ed, owned
} Lattice;

// All void. False with a status: no cells, too many, a size that is not positive and finite.
bool lattice_create(Lattice *lattice, const int count[3], double size, Status *status);
void lattice_destroy(Lattice *lattice);

static inline long lattice_index(const Lattice *lattice, int i, int j, int k)
{
    return ((long)k * lattice->count[1] + j) * lattice->count[0] + i;
}

// The label of a cell; 0 outside.
int lattice_label(const Lattice *lattice, int i, int j, int k);
// A point given in cells from the low corner, in the world [m].
Vec3 lattice_point(const Lattice *lattice, double i, double j, double k);
long lattice_solid(const Lattice *lattice); // cells that are not void
// Parts of the solid that no face joins: their number.
int lattice_pieces(const Lattice *lattice);
// Cuts void margins away, so that the outermost cells on every side are solid; the origin follows.
// False with a status when nothing is solid.
bool lattice_crop(Lattice *lattice, Status *status);
// x -> rotation (scale x) + translation, as mesh_place.
void lattice_place(Lattice *lattice, double scale, Vec3 rotation, Vec3 translation);

// Generators, all material 1, centred on the origin of the world. `count`: cells.
bool lattice_box(Lattice *lattice, const int count[3], double size, Status *status);
// Cells whose centre lies within `radius` [m] of the middle, which is a lattice point.
bool lattice_ball(Lattice *lattice, double radius, double size, Status *status);
// The plane case: one layer of cells with the middle plane z = 0, by the same rule in x and y.
bool lattice_disc(Lattice *lattice, double radius, double size, Status *status);

#endif
