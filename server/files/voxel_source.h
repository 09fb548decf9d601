// Where the cells of a voxel body come from, as a scene says it.
#ifndef PLIANT_FILES_VOXEL_SOURCE_H
#define PLIANT_FILES_VOXEL_SOURCE_H

#include "base/vec.h"

typedef enum VoxelSourceKind {
    VOXELS_FILE, // label volume: NRRD or NIfTI
    VOXELS_MESH, // inside of a closed mesh file
    VOXELS_BOX,
    VOXELS_BALL,
    VOXELS_DISC, // the plane case
} VoxelSourceKind;

typedef struct VoxelSource {
    VoxelSourceKind kind;
    char *file;       // volume or mesh, resolved against the scene file's folder; owned
    int label_count;  // at most LATTICE_MATERIALS
    int *label;       // [label_count] of the volume, from 1, no two equal: label[m - 1] becomes
                      // material m of the lattice, all others are void; owned. { 1 } for all
                      // sources but volumes
    int count[3];     // box: cells
    double radius;    // ball, disc [m]
    double size;      // edge of a cell [m]: of generators before `scale`, else in the world;
                      // 0: the volume's own spacing
    double scale;     // of generators and volumes; metres a unit of a mesh file, which is scaled
                      // before it is filled
    Vec3 rotation;    // rotation vector [rad], applied after scale
    Vec3 translation; // [m], applied last
} VoxelSource;

#endif
