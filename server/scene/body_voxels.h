// The lattice of a voxel body as the scene describes it, and its placement in the world.
#ifndef PLIANT_SCENE_BODY_VOXELS_H
#define PLIANT_SCENE_BODY_VOXELS_H

#include "base/status.h"
#include "base/vec.h"
#include "geometry/lattice.h"

// The source of a voxel body's cells, as in a scene.
typedef enum VoxelSourceKind {
    VOXELS_FILE, // a label volume
    VOXELS_MESH, // the inside of a closed mesh
    VOXELS_BOX,
    VOXELS_BALL,
    VOXELS_DISC, // one layer of cells in z = 0: the plane case
} VoxelSourceKind;

typedef struct VoxelSource {
    VoxelSourceKind kind;
    char *file;                   // of a volume or a mesh, resolved; owned by the scene
    int label_count;              // of a volume: at least one
    int label[LATTICE_MATERIALS]; // material m is the m-th
    double size;   // edge of a cell [m] after scale, except of a generator, which is scaled too; 0
                   // (volumes only): the smallest spacing
    int count[3];  // box: cells
    double radius; // ball, disc [m]
    double scale;  // file coordinates to metres; for a volume a factor on its units
    Vec3 rotation; // rotation vector [rad], applied after scale
    Vec3 translation; // [m], applied last
} VoxelSource;

// Imports a volume or a mesh, or generates the lattice, and places it. Keeps cells that share no
// face with the others, with a warning. Returns false with a `status` that names the file and the
// fault; if true, the lattice belongs to the caller.
bool body_voxels_make(const VoxelSource *source, Lattice *lattice, Status *status);

#endif
