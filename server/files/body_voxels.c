// Lattices from generators. Called once a body, at load.
#include "files/body_voxels.h"

static bool make_lattice(const VoxelSource *source, Lattice *lattice, Status *status)
{
    switch (source->kind) {
    case VOXELS_BOX:
        return lattice_box(lattice, source->count, source->size, status);
    case VOXELS_BALL:
        return lattice_ball(lattice, source->radius, source->size, status);
    case VOXELS_DISC:
        return lattice_disc(lattice, source->radius, source->size, status);
    case VOXELS_FILE:
    case VOXELS_MESH:
        break;
    }
    return status_fail(status, STATUS_INVALID, "%s: is not built into this version", source->file);
}

bool body_voxels_make(const VoxelSource *source, Lattice *lattice, Status *status)
{
    if (!make_lattice(source, lattice, status))
        return false;
    lattice_place(lattice, source->scale, source->rotation, source->translation);
    return true;
}
