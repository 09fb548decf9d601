// SPDX-License-Identifier: MIT
// Recognises the format of a volume file by its content and checks its header before any voxel is
// read. Load time only; opens no other file than the one for voxels that a header names in its own
// folder.
#include "io/volume_import.h"

#include "base/check.h"
#include "geometry/mesh.h"
#include "io/volume_data.h"

#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Spacings [m] outside of these are no lengths; the limits of scenes are far within.
static const double LEAST_SPACING = 1e-12, MOST_SPACING = 1e12;
// Axes whose angle has a smaller cosine count as perpendicular; up to 2 degrees they are read so,
// as registrations and scanners tilt them.
static const double LEAST_SHEAR = 1e-3, MOST_SHEAR = 0.035;

void volume_note(LabelVolume *volume, const char *format, ...)
{
    const size_t used = strlen(volume->notes), left = sizeof volume->notes - used;
    char text[200];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    snprintf(volume->notes + used, left, "%s%s", used > 0 ? "; " : "", text);
}

void volume_destroy(LabelVolume *volume)
{
    free(volume->label);
    free(volume->segment);
    *volume = (LabelVolume){0};
}

// Replaces sheared axes by the nearest perpendicular ones, about the middle of the volume.
static void square_axes(LabelVolume *volume, double cosine)
{
    Vec3 unit[3], middle = volume->origin, move[3];
    double worst = 0.0;
    for (int a = 0; a < 3; a++) {
        unit[a] = vec3_unit(volume->axis[a]);
        middle = vec3_madd(middle, 0.5 * (volume->count[a] - 1), volume->axis[a]);
    }
    // The orthogonal factor of the polar decomposition by Newton's iteration (Higham 1986), which
    // doubles the digits in each of its steps.
    for (int step = 0; step < 6; step++) {
        const Vec3 cross[3] = {vec3_cross(unit[1], unit[2]), vec3_cross(unit[2], unit[0]),
                               vec3_cross(unit[0], unit[1])};
        const double inverse = 1.0 / vec3_dot(unit[0], cross[0]);
        for (int a = 0; a < 3; a++)
            unit[a] = vec3_scale(0.5, vec3_madd(unit[a], inverse, cross[a]));
    }
    volume->origin = middle;
    for (int a = 0; a < 3; a++) {
        const Vec3 axis = vec3_scale(vec3_dot(volume->axis[a], unit[a]), unit[a]);
        move[a] = vec3_scale(0.5 * volume->count[a], vec3_sub(volume->axis[a], axis));
        volume->axis[a] = axis;
        volume->origin = vec3_madd(volume->origin, -0.5 * (volume->count[a] - 1), axis);
    }
    // The corners move farthest.
    for (int k = 0; k < 4; k++) {
        const Vec3 side = vec3_madd(move[0], k & 1 ? 1.0 : -1.0, move[1]);
        worst = fmax(worst, vec3_length(vec3_madd(side, k & 2 ? 1.0 : -1.0, move[2])));
    }
    volume_note(volume,
                "its axes are up to %.2g degrees off right angles: with the nearest right angles "
                "its voxels are up to %.3g mm off",
                asin(cosine) * 180.0 / M_PI, 1e3 * worst);
}

static bool check_axes(const char *path, LabelVolume *volume, Status *status)
{
    Vec3 unit[3];
    double shear = 0.0;
    // Spacings that a body can have,
    for (int a = 0; a < 3; a++) {
        Vec3 axis = volume->axis[a];
        double length = vec3_length(axis);
        if (!(length >= LEAST_SPACING && length <= MOST_SPACING))
            return status_fail(status, STATUS_INVALID,
                               "%s: the spacing along axis %d is %g m, outside [%g, %g]", path, a,
                               fabs(length), LEAST_SPACING, MOST_SPACING);
        unit[a] = vec3_scale(1.0 / length, axis);
    }
    // at right angles,
    for (int a = 0; a < 3; a++) {
        int b = (a + 1) % 3, low = a < b ? a : b, high = a < b ? b : a;
        double cosine = vec3_dot(unit[low], unit[high]);
        shear = fmax(shear, fabs(cosine));
        if (fabs(cosine) > MOST_SHEAR)
            return status_fail(status, STATUS_INVALID,
                               "%s: axes %d and %d are not at right angles (cosine %.3g, at most "
                               "%g), so its voxels are no boxes; resample it, with nearest "
                               "neighbours (3D Slicer: Resample Scalar Volume)",
                               path, low, high, cosine, MOST_SHEAR);
    }
    // and not at the end of the world.
    double far = fmax(fabs(volume->origin.x), fmax(fabs(volume->origin.y), fabs(volume->origin.z)));
    if (vec3_finite(volume->origin) && far <= MOST_SPACING) {
        if (shear > LEAST_SHEAR)
            square_axes(volume, shear);
        return true;
    }
    return status_fail(status, STATUS_INVALID, "%s: the first voxel is at (%g, %g, %g) m", path,
                       volume->origin.x, volume->origin.y, volume->origin.z);
}

static bool read_header(const VolumeFile *file, LabelVolume *volume, VolumeData *data,
                        Status *status)
{
    unsigned char head[352] = {0};
    // The first bytes tell the format.
    int size = volume_file_head(file, head, sizeof head);
    bool nrrd = size >= 4 && memcmp(head, "NRRD", 4) == 0;
    if (nrrd && file->gzipped)
        return status_fail(status, STATUS_INVALID,
                           "%s: is a gzip file with an NRRD file in it; unpack it first",
                           file->path);
    if (nrrd)
        return volume_read_nrrd(file, volume, data, status);
    if (volume_is_nifti(head, size))
        return volume_read_nifti(file, volume, data, status);
    return status_fail(status, STATUS_INVALID,
                       "%s: is neither an NRRD nor a NIfTI-1 file (of a pair .hdr and .img, name "
                       "the .hdr); 3D Slicer saves others as NRRD",
                       file->path);
}

// Opens both files and reads everything of the volume but its labels. data->file is empty if the
// voxels are in `file`.
static bool open_volume(const char *path, bool picture, VolumeFile *file, LabelVolume *volume,
                        VolumeData *data, Status *status)
{
    *volume = (LabelVolume){.layers = 1, .layer = 1};
    *data = (VolumeData){.file.descriptor = -1, .inner = 1, .picture = picture};
    return volume_file_open(path, file, status) && read_header(file, volume, data, status) &&
           check_axes(path, volume, status);
}

// Reads the voxels: labels of a layer to `take`, or all values to `sink`.
static bool read_voxels(const char *path, int layer, LabelVolume *volume, VolumeTake *take,
                        VolumeSink *sink, void *user, Status *status)
{
    VolumeFile file;
    VolumeData data;
    bool ok = open_volume(path, sink != NULL, &file, volume, &data, status);
    if (ok && (layer < 1 || layer > volume->layers))
        ok = status_fail(status, STATUS_INVALID, "%s: layer %d outside [1, %d]", path, layer,
                         volume->layers);
    volume->layer = layer;
    // They are in a file of their own, or in this one.
    if (ok) {
        bool own = data.file.path != NULL;
        if (!own)
            data.file = file;
        ok = sink != NULL ? volume_data_values(&data, volume, sink, user, status)
                          : volume_data_read(&data, volume, take, user, status);
        if (!own)
            data.file = (VolumeFile){.descriptor = -1};
    }
    volume_file_close(&data.file);
    volume_file_close(&file);
    return ok;
}

bool volume_read_picture(const char *path, LabelVolume *volume, VolumeSink *sink, void *user,
                         Status *status)
{
    return read_voxels(path, 1, volume, NULL, sink, user, status);
}

bool volume_read(const char *path, int layer, LabelVolume *volume, VolumeTake *take, void *user,
                 Status *status)
{
    const bool ok = read_voxels(path, layer, volume, take, NULL, user, status);
    if (ok && volume->negative > 0)
        volume_note(volume, "%ld voxels with negative values are empty", volume->negative);
    if (!ok)
        volume_destroy(volume);
    return ok;
}

// What is kept of a volume.
typedef struct Store {
    const char *path;
    LabelVolume *volume;
    const int *low, *high; // NULL: all
} Store;

// Begins with the first slice, when the size of the file is known to be right.
static bool begin_store(const Store *store, Status *status)
{
    LabelVolume *volume = store->volume;
    size_t voxels = 1;
    for (int a = 0; a < 3; a++) {
        volume->low[a] = store->low != NULL ? store->low[a] : 0;
        volume->high[a] = store->high != NULL ? store->high[a] : volume->count[a];
        voxels *= (size_t)(volume->high[a] - volume->low[a]);
    }
    volume->label = malloc(voxels * sizeof *volume->label);
    return volume->label != NULL ||
           status_fail(status, STATUS_FAILED, "%s: no memory for %zu voxels", store->path, voxels);
}

static bool store_slice(void *user, int k, const int *label, Status *status)
{
    const Store *store = user;
    LabelVolume *volume = store->volume;
    if (k == 0 && !begin_store(store, status))
        return false;
    const int *low = volume->low, *high = volume->high;
    const size_t nx = (size_t)(high[0] - low[0]), ny = (size_t)(high[1] - low[1]);
    for (int j = low[1]; j < high[1] && k >= low[2] && k < high[2]; j++)
        memcpy(volume->label + ((size_t)(k - low[2]) * ny + (size_t)(j - low[1])) * nx,
               label + (size_t)j * (size_t)volume->count[0] + low[0], nx * sizeof *label);
    return true;
}

bool volume_import(const char *path, int layer, LabelVolume *volume, Status *status)
{
    Store store = {.path = path, .volume = volume};
    return volume_read(path, layer, volume, store_slice, &store, status);
}

bool volume_import_labels(const char *path, int layer, const int *label, int label_count,
                          LabelVolume *volume, Status *status)
{
    VolumeLabels list;
    Status said = {0};
    int low[3], high[3];
    if (!volume_survey(path, layer, volume, &list, status))
        return false;
    volume_destroy(volume);
    bool ok = volume_find_box(&list, label, label_count, low, high, &said) ||
              status_fail(status, said.code, "%s: %s", path, said.text);
    const int labels = list.count;
    volume_labels_destroy(&list);
    Store store = {.path = path, .volume = volume, .low = low, .high = high};
    ok = ok && volume_read(path, layer, volume, store_slice, &store, status);
    volume->labels = labels;
    return ok;
}

bool volume_import_header(const char *path, LabelVolume *volume, Status *status)
{
    VolumeFile file;
    VolumeData data;
    bool ok = open_volume(path, false, &file, volume, &data, status);
    volume_file_close(&data.file);
    volume_file_close(&file);
    if (!ok)
        volume_destroy(volume);
    return ok;
}

bool volume_is_one(const char *path)
{
    VolumeFile file;
    Status ignored = {0};
    unsigned char head[352] = {0};
    int size =
        volume_file_open(path, &file, &ignored) ? volume_file_head(&file, head, sizeof head) : 0;
    volume_file_close(&file);
    return volume_is_nifti(head, size) || (size >= 4 && memcmp(head, "NRRD", 4) == 0);
}

bool volume_find_data(const char *path, char **found, Status *status)
{
    VolumeFile file;
    VolumeData data;
    LabelVolume volume;
    bool ok = open_volume(path, false, &file, &volume, &data, status);
    *found = NULL;
    // The caller gets the name, and nothing else stays open.
    if (ok && data.file.path != NULL) {
        *found = data.file.path;
        data.file.path = NULL;
    }
    volume_file_close(&data.file);
    volume_file_close(&file);
    volume_destroy(&volume);
    return ok;
}

// --- lattices: the voxels of a body, covered with cells ------------------------------------------

static const double CUBE = 1e-3; // spacings with a smaller difference make cubes

// The selected part of a volume. Axis a of the frame is that of the volume, or its opposite.
typedef struct Part {
    const LabelVolume *volume;
    const int *label;
    int label_count;
    int low[3], high[3]; // its box in voxels, high not in it
    double spacing[3];   // [m]
    Vec3 unit[3];        // right-handed
    bool reversed[3];
    double size; // of the cells [m]
    bool copied; // one voxel per cell
    int count[3];
} Part;

static int material_of(const Part *part, int label)
{
    for (int m = 0; m < part->label_count; m++)
        if (part->label[m] == label)
            return m + 1;
    return 0;
}

// --- which voxels ---

static bool check_list(const Part *part, Status *status)
{
    if (part->label_count < 1 || part->label_count > LATTICE_MATERIALS)
        return status_fail(status, STATUS_INVALID, "%d labels, outside [1, %d]", part->label_count,
                           LATTICE_MATERIALS);
    for (int m = 0; m < part->label_count; m++)
        if (material_of(part, part->label[m]) != m + 1)
            return status_fail(status, STATUS_INVALID, "label %d is named twice", part->label[m]);
    return true;
}

// Finds the box around all voxels that have one of the labels.
static bool find_box(Part *part, Status *status)
{
    VolumeLabels list;
    bool ok = volume_list(part->volume, &list);
    if (!ok)
        status_fail(status, STATUS_INVALID, "has more than %d labels", VOLUME_MOST_LABELS);
    ok =
        ok && volume_find_box(&list, part->label, part->label_count, part->low, part->high, status);
    volume_labels_destroy(&list);
    return ok;
}

// --- the frame ---

static double component(Vec3 v, int a)
{
    return a == 0 ? v.x : a == 1 ? v.y : v.z;
}

// Finds the frame. For a mirrored volume it reverses the axis that points most against the world
// axis of the same number, so that a volume whose axes are the world's but for signs is not
// rotated.
static void find_frame(Part *part)
{
    Vec3 *unit = part->unit;
    // Lengths and directions of the axes.
    for (int a = 0; a < 3; a++) {
        part->spacing[a] = vec3_length(part->volume->axis[a]);
        unit[a] = vec3_scale(1.0 / part->spacing[a], part->volume->axis[a]);
    }
    // Left-handed axes become right-handed by reversing one.
    if (vec3_dot(vec3_cross(unit[0], unit[1]), unit[2]) < 0.0) {
        int least = 0;
        for (int a = 1; a < 3; a++)
            if (component(unit[a], a) < component(unit[least], least))
                least = a;
        part->reversed[least] = true;
        unit[least] = vec3_scale(-1.0, unit[least]);
    }
    // Make the axes exactly perpendicular; the first stays.
    unit[1] = vec3_unit(vec3_madd(unit[1], -vec3_dot(unit[0], unit[1]), unit[0]));
    unit[2] = vec3_cross(unit[0], unit[1]);
}

// Returns the rotation that takes x, y, z to three axes (Shepperd 1978: by the largest component).
static Quat quat_from_axes(const Vec3 u[3])
{
    double xx = u[0].x, yy = u[1].y, zz = u[2].z, trace = xx + yy + zz;
    Quat q;
    if (trace >= xx && trace >= yy && trace >= zz)
        q = (Quat){1.0 + trace, u[1].z - u[2].y, u[2].x - u[0].z, u[0].y - u[1].x};
    else if (xx >= yy && xx >= zz)
        q = (Quat){u[1].z - u[2].y, 1.0 + xx - yy - zz, u[1].x + u[0].y, u[2].x + u[0].z};
    else if (yy >= zz)
        q = (Quat){u[2].x - u[0].z, u[1].x + u[0].y, 1.0 - xx + yy - zz, u[2].y + u[1].z};
    else
        q = (Quat){u[0].y - u[1].x, u[2].x + u[0].z, u[2].y + u[1].z, 1.0 - xx - yy + zz};
    // Adding zero turns -0 into 0, so that the identity has one representation.
    return quat_unit((Quat){q.w + 0.0, q.x + 0.0, q.y + 0.0, q.z + 0.0});
}

// --- the cells ---

// Fails because there are too many cells; suggests a size that fits, with two digits and a margin.
static bool fail_cells(double size, double cells, int most, const char *what, Status *status)
{
    double enough = 1.02 * size * cbrt(cells / most);
    double digit = pow(10.0, floor(log10(enough)) - 1.0);
    return status_fail(status, STATUS_INVALID,
                       "cells of %g m make %.4g%s, more than %d; a size of %.2g m would do", size,
                       cells, what, most, digit * ceil(enough / digit));
}

static bool find_cells(Part *part, double size, Status *status)
{
    const double *s = part->spacing;
    double least = fmin(s[0], fmin(s[1], s[2])), most = fmax(s[0], fmax(s[1], s[2]));
    double extent = 0.0, cells = 1.0, along[3];
    // Cubes are copied; other voxels are sampled by cells of the size.
    part->copied = size == 0.0 && most <= least * (1.0 + CUBE);
    part->size = size > 0.0 ? size : part->copied ? cbrt(s[0] * s[1] * s[2]) : least;
    for (int a = 0; a < 3; a++) {
        int voxels = part->high[a] - part->low[a];
        extent = fmax(extent, voxels * s[a]);
        // An excess below 1e-6 of a cell over a whole number of cells is rounding.
        along[a] = part->copied ? voxels : fmax(ceil(voxels * s[a] / part->size - 1e-6), 1.0);
        cells *= along[a];
    }
    // A body of no organ's size is a mistake of units or scale.
    if (!mesh_extent_fits(extent))
        return status_fail(status, STATUS_INVALID,
                           "measures %g m, outside [%g, %g] m: its spacing is in other units than "
                           "it says, or scale is wrong",
                           extent, MESH_SMALLEST_EXTENT, MESH_LARGEST_EXTENT);
    if (!(cells <= LATTICE_MOST_CELLS))
        return fail_cells(part->size, cells, LATTICE_MOST_CELLS, ", void ones counted", status);
    for (int a = 0; a < 3; a++)
        part->count[a] = (int)along[a];
    return true;
}

// Finds the voxel of each layer of cells along an axis, -1 outside the box. Lattice and box share
// their middles. Centres on the border of two voxels take the upper one.
static int *find_layers(const Part *part, int a)
{
    int count = part->count[a], voxels = part->high[a] - part->low[a];
    int *layer = malloc((size_t)count * sizeof *layer);
    ASSERT(layer != NULL);
    for (int i = 0; i < count; i++) {
        double from_middle = (i + 0.5 - 0.5 * count) * part->size / part->spacing[a];
        int v = part->copied ? i : (int)floor(from_middle + 0.5 * voxels + 1e-9);
        if (part->reversed[a])
            v = voxels - 1 - v;
        layer[i] = v >= 0 && v < voxels ? part->low[a] + v : -1;
    }
    return layer;
}

static void fill(const Part *part, int *const layer[3], Lattice *lattice)
{
    int last = 0, material = material_of(part, 0);
    unsigned char *to = lattice->label;
    // Outside of the volume a cell is empty; along a row labels mostly repeat.
    for (int k = 0; k < part->count[2]; k++)
        for (int j = 0; j < part->count[1]; j++)
            for (int i = 0; i < part->count[0]; i++, to++) {
                if (layer[0][i] < 0 || layer[1][j] < 0 || layer[2][k] < 0)
                    continue;
                int label = volume_label_at(part->volume, layer[0][i], layer[1][j], layer[2][k]);
                if (label != last)
                    material = material_of(part, last = label);
                *to = (unsigned char)material;
            }
}

static void place(const Part *part, Lattice *lattice)
{
    Vec3 middle = part->volume->origin, corner;
    for (int a = 0; a < 3; a++)
        middle = vec3_madd(middle, 0.5 * (part->low[a] + part->high[a] - 1), part->volume->axis[a]);
    corner = middle;
    for (int a = 0; a < 3; a++)
        corner = vec3_madd(corner, -0.5 * part->count[a] * part->size, part->unit[a]);
    lattice->origin = corner;
    lattice->turn = quat_from_axes(part->unit);
}

static bool check_result(const Part *part, Lattice *lattice, Status *status)
{
    long solid = lattice_solid(lattice);
    // Neither nothing nor more than can be computed.
    if (solid == 0)
        return status_fail(status, STATUS_INVALID,
                           "no centre of a cell of %g m lies in a voxel with its labels; smaller "
                           "cells would",
                           part->size);
    if (solid > LATTICE_MOST_SOLID)
        return fail_cells(part->size, (double)solid, LATTICE_MOST_SOLID, "", status);
    return lattice_crop(lattice, status);
}

bool volume_lattice(const LabelVolume *volume, const int *label, int label_count, double size,
                    Lattice *lattice, Status *status)
{
    Part part = {.volume = volume, .label = label, .label_count = label_count};
    *lattice = (Lattice){0};
    // What is wanted of which voxels.
    if (!(size >= 0.0) || !isfinite(size))
        return status_fail(status, STATUS_INVALID, "cells of %g m are not possible", size);
    if (!check_list(&part, status) || !find_box(&part, status))
        return false;
    // Where the cells lie, how many they are, and what each is made of.
    find_frame(&part);
    if (!find_cells(&part, size, status) || !lattice_create(lattice, part.count, part.size, status))
        return false;
    int *layer[3];
    for (int a = 0; a < 3; a++)
        layer[a] = find_layers(&part, a);
    fill(&part, layer, lattice);
    for (int a = 0; a < 3; a++)
        free(layer[a]);
    // The lattice stands as the volume does.
    place(&part, lattice);
    if (check_result(&part, lattice, status))
        return true;
    lattice_destroy(lattice);
    return false;
}
