// Recognises the format of a volume file by its content and checks its header before any voxel is
// read. Load time only; opens no other file than the one for voxels that a header names in its own
// folder.
#include "io/volume_import.h"

#include "io/volume_data.h"

#include <stdlib.h>
#include <string.h>

// Spacings [m] outside of these are no lengths; the limits of scenes are far within.
static const double LEAST_SPACING = 1e-12, MOST_SPACING = 1e12;
// Axes whose angle has a smaller cosine count as perpendicular.
static const double MOST_SHEAR = 1e-3;

void volume_destroy(LabelVolume *volume)
{
    free(volume->label);
    *volume = (LabelVolume){0};
}

static bool check_axes(const char *path, const LabelVolume *volume, Status *status)
{
    Vec3 unit[3];
    for (int a = 0; a < 3; a++) {
        Vec3 axis = volume->axis[a];
        double length = vec3_length(axis);
        if (!(length >= LEAST_SPACING && length <= MOST_SPACING))
            return status_fail(status, STATUS_INVALID,
                               "%s: the spacing along axis %d is %g m, outside [%g, %g]", path, a,
                               fabs(length), LEAST_SPACING, MOST_SPACING);
        unit[a] = vec3_scale(1.0 / length, axis);
    }
    for (int a = 0; a < 3; a++) {
        int b = (a + 1) % 3, low = a < b ? a : b, high = a < b ? b : a;
        double cosine = vec3_dot(unit[low], unit[high]);
        if (fabs(cosine) > MOST_SHEAR)
            return status_fail(status, STATUS_INVALID,
                               "%s: axes %d and %d are not at right angles (cosine %.3g, at most "
                               "%g), so its voxels are no boxes",
                               path, low, high, cosine, MOST_SHEAR);
    }
    double far = fmax(fabs(volume->origin.x), fmax(fabs(volume->origin.y), fabs(volume->origin.z)));
    if (vec3_finite(volume->origin) && far <= MOST_SPACING)
        return true;
    return status_fail(status, STATUS_INVALID, "%s: the first voxel is at (%g, %g, %g) m", path,
                       volume->origin.x, volume->origin.y, volume->origin.z);
}

static bool read_header(const VolumeFile *file, LabelVolume *volume, VolumeData *data,
                        Status *status)
{
    unsigned char head[352] = {0};
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
                       "the .hdr)",
                       file->path);
}

// Opens both files and reads everything of the volume but its labels. data->file is empty if the
// voxels are in `file`.
static bool open_volume(const char *path, VolumeFile *file, LabelVolume *volume, VolumeData *data,
                        Status *status)
{
    *volume = (LabelVolume){0};
    *data = (VolumeData){.file.descriptor = -1};
    return volume_file_open(path, file, status) && read_header(file, volume, data, status) &&
           check_axes(path, volume, status);
}

bool volume_import(const char *path, LabelVolume *volume, Status *status)
{
    VolumeFile file;
    VolumeData data;
    bool ok = open_volume(path, &file, volume, &data, status);
    if (ok) {
        bool own = data.file.path != NULL;
        if (!own)
            data.file = file;
        ok = volume_data_read(&data, volume, status);
        if (!own)
            data.file = (VolumeFile){.descriptor = -1};
    }
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
    bool ok = open_volume(path, &file, &volume, &data, status);
    *found = NULL;
    if (ok && data.file.path != NULL) {
        *found = data.file.path;
        data.file.path = NULL;
    }
    volume_file_close(&data.file);
    volume_file_close(&file);
    return ok;
}
