// SPDX-License-Identifier: MIT
// Lattices from volumes, meshes and generators. Called once per body, at load time.
#include "scene/build_parts.h"

#include "base/log.h"
#include "io/volume_import.h"
#include "geometry/lattice.h"

// Prefixes the file name to the error of a function that does not know it.
static bool fail_file(const VoxelSource *source, const Status *said, Status *status)
{
    return status_fail(status, said->code, "%s: %s", source->file, said->text);
}

// Finds the layer of the file that was chosen, or that has most of the labels.
static bool choose_layer(const VoxelSource *source, int *layer, Status *status)
{
    LabelVolume header;
    *layer = source->layer;
    if (*layer > 0)
        return true;
    if (!volume_import_header(source->file, &header, status))
        return false;
    const int layers = header.layers;
    volume_destroy(&header);
    *layer = 1;
    if (layers == 1)
        return true;
    if (!volume_find_layer(source->file, source->label, source->label_count, layer, status))
        return false;
    log_line(LOG_WARNING, "%s: layer %d of %d was taken, which has most of the labels",
             source->file, *layer, layers);
    return true;
}

// Scales the volume before it becomes cells, so that their size is that in the world.
static bool make_from_volume(const VoxelSource *source, Lattice *lattice, SurfaceField *field,
                             Status *status)
{
    LabelVolume volume;
    Status said = {0};
    int layer;
    if (!choose_layer(source, &layer, status) ||
        !volume_import_labels(source->file, layer, source->label, source->label_count, &volume,
                              status))
        return false;
    if (source->any_label && volume.labels > 1)
        log_line(
            LOG_WARNING,
            "%s: label 1 of %d was taken, as none is given (pliant-prepare --check lists them)",
            source->file, volume.labels);
    if (volume.notes[0] != '\0')
        log_line(LOG_WARNING, "%s: %s", source->file, volume.notes);
    // Scaled before it becomes cells, so that their size is that in the world.
    for (int a = 0; a < 3; a++)
        volume.axis[a] = vec3_scale(source->scale, volume.axis[a]);
    volume.origin = vec3_scale(source->scale, volume.origin);
    bool ok =
        volume_lattice(&volume, source->label, source->label_count, source->size, lattice, &said) ||
        fail_file(source, &said, status);
    if (ok && field != NULL)
        volume_field(&volume, source->label, source->label_count, lattice, field);
    volume_destroy(&volume);
    // Its frame is the file's: only the scene's placement is left to do.
    if (ok)
        lattice_place(lattice, 1.0, source->rotation, source->translation);
    return ok;
}

// Places the mesh before it becomes cells, so that their axes are those of the world.
static bool make_from_mesh(const VoxelSource *source, Lattice *lattice, SurfaceField *field,
                           Status *status)
{
    TriMesh mesh = {0};
    Status said = {0};
    bool ok = body_mesh_import(source->file, source->scale, source->rotation, source->translation,
                               &mesh, status) &&
              (voxelise(lattice, &mesh, source->size, source->inner == INNER_FILLED, &said) ||
               fail_file(source, &said, status));
    char text[256];
    if (ok && lattice_shells_text(lattice->shells, text, sizeof text))
        log_line(LOG_INFO, "%s: %s", source->file, text);
    if (ok && field != NULL)
        surface_field_of_mesh(field, lattice, &mesh);
    mesh_destroy(&mesh);
    return ok;
}

static bool make(const VoxelSource *source, Lattice *lattice, SurfaceField *field, Status *status)
{
    bool ok = false;
    // From a file the cells stand where they belong; generated ones are placed below.
    switch (source->kind) {
    case VOXELS_FILE:
        return make_from_volume(source, lattice, field, status);
    case VOXELS_MESH:
        return make_from_mesh(source, lattice, field, status);
    case VOXELS_BOX:
        ok = lattice_box(lattice, source->count, source->size, status);
        break;
    case VOXELS_BALL:
        ok = lattice_ball(lattice, source->radius, source->size, status);
        break;
    case VOXELS_DISC:
        ok = lattice_disc(lattice, source->radius, source->size, status);
        break;
    }
    if (ok && field != NULL)
        surface_field_of_cells(field, lattice);
    if (ok)
        lattice_place(lattice, source->scale, source->rotation, source->translation);
    return ok;
}

static const char *name_of(const VoxelSource *source)
{
    return source->file != NULL ? source->file : "voxels";
}

bool body_voxels_fit(const VoxelSource *source, Lattice *lattice, SurfaceField *field,
                     Status *status)
{
    *lattice = (Lattice){0};
    // Written so that NaN fails too.
    if (!(source->scale > 0.0) || !isfinite(source->scale))
        return status_fail(status, STATUS_INVALID, "%s: scale %g is not positive", name_of(source),
                           source->scale);
    if (!make(source, lattice, field, status))
        return false;
    int pieces = lattice_pieces(lattice);
    if (pieces > 1)
        log_line(LOG_WARNING, "%s: its cells are %d pieces that no face joins; all are kept",
                 name_of(source), pieces);
    return true;
}

bool body_voxels_make(const VoxelSource *source, Lattice *lattice, Status *status)
{
    return body_voxels_fit(source, lattice, NULL, status);
}
