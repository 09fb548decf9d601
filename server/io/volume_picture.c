// SPDX-License-Identifier: MIT
// Grey values and colours of the voxels around a body. Load time only.
#include "io/volume_picture.h"

#include "io/volume_data.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>

typedef struct Reading {
    const char *path;
    const Lattice *lattice;
    PicturePlace place;
    VolumePicture *picture;
    int low[3], high[3]; // voxels around the body, high not in it
    int channels;        // 1 or 3
    float *value;        // [voxels][channels]; NULL: not begun
    bool bytes;          // they are 0 to 255
} Reading;

static Vec3 in_world(const PicturePlace *place, Vec3 direction)
{
    return quat_rotate(quat_from_rotation(place->rotation), vec3_scale(place->scale, direction));
}

static size_t voxels_of(const Reading *reading)
{
    size_t voxels = 1;
    for (int a = 0; a < 3; a++)
        voxels *= (size_t)(reading->high[a] - reading->low[a]);
    return voxels;
}

// Finds the box of voxels around all solid cells.
static bool find_box(Reading *reading, const LabelVolume *volume, const Vec3 axis[3], Vec3 origin,
                     Status *status)
{
    const Lattice *lattice = reading->lattice;
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (int k = 0; k < lattice->count[2]; k++)
        for (int j = 0; j < lattice->count[1]; j++)
            for (int i = 0; i < lattice->count[0]; i++) {
                if (lattice_label(lattice, i, j, k) == 0)
                    continue;
                const Vec3 from =
                    vec3_sub(lattice_point(lattice, i + 0.5, j + 0.5, k + 0.5), origin);
                for (int a = 0; a < 3; a++) {
                    const double at = vec3_dot(axis[a], from) / vec3_dot(axis[a], axis[a]);
                    low[a] = fmin(low[a], at);
                    high[a] = fmax(high[a], at);
                }
            }
    for (int a = 0; a < 3; a++) {
        // A voxel reaches half a step from its middle; one more is forgiven.
        if (!(low[a] >= -1.5 && high[a] <= volume->count[a] + 0.5))
            return status_fail(status, STATUS_INVALID,
                               "%s: does not cover the labels: along axis %d these are at its "
                               "voxels %.1f to %.1f, and it has %d; labels and image must be of "
                               "one scan",
                               reading->path, a, low[a], high[a], volume->count[a]);
        // A cell and what a linear mean needs.
        const double reach = lattice->size / sqrt(vec3_dot(axis[a], axis[a])) + 2.0;
        reading->low[a] = (int)fmax(floor(low[a] - reach), 0.0);
        reading->high[a] = (int)fmin(ceil(high[a] + reach) + 1.0, volume->count[a]);
    }
    return true;
}

// Takes memory for the part around the body, once the size of the file is known to be right.
static bool begin(Reading *reading, const LabelVolume *volume, Status *status)
{
    VolumePicture *picture = reading->picture;
    const int layers = volume->layers;
    if (layers != 1 && layers != 3 && layers != 4)
        return status_fail(status, STATUS_INVALID,
                           "%s: has %d values a voxel: an image has one, or three of red, green "
                           "and blue",
                           reading->path, layers);
    reading->channels = layers == 1 ? 1 : 3;
    Vec3 axis[3];
    for (int a = 0; a < 3; a++)
        axis[a] = in_world(&reading->place, volume->axis[a]);
    picture->origin =
        vec3_add(in_world(&reading->place, volume->origin), reading->place.translation);
    if (!find_box(reading, volume, axis, picture->origin, status))
        return false;
    for (int a = 0; a < 3; a++) {
        picture->axis[a] = axis[a];
        picture->count[a] = reading->high[a] - reading->low[a];
        picture->origin = vec3_madd(picture->origin, reading->low[a], axis[a]);
    }
    const size_t values = voxels_of(reading) * (size_t)reading->channels;
    if (values > PICTURE_MOST_VALUES)
        return status_fail(status, STATUS_INVALID,
                           "%s: %zu values are around the body, more than %d: resample it to "
                           "larger voxels",
                           reading->path, values, PICTURE_MOST_VALUES);
    reading->value = malloc(values * sizeof *reading->value);
    picture->colour = malloc(3 * voxels_of(reading));
    ASSERT(reading->value != NULL && picture->colour != NULL);
    return true;
}

static bool take(void *user, const VolumeData *data, const LabelVolume *volume, long first,
                 double *value, size_t count, Status *status)
{
    Reading *reading = user;
    if (reading->value == NULL && !begin(reading, volume, status))
        return false;
    const int *low = reading->low, *high = reading->high;
    const long nx = volume->count[0], ny = volume->count[1];
    for (size_t v = 0; v < count; v++) {
        // Rows of `inner` values of one layer follow one another.
        const long number = first + (long)v, block = data->inner * volume->layers;
        const int channel = (int)(number / data->inner % volume->layers);
        const long voxel = number / block * data->inner + number % data->inner;
        const int at[3] = {(int)(voxel % nx), (int)(voxel / nx % ny), (int)(voxel / nx / ny)};
        const double x = data->slope != 0.0 ? data->slope * value[v] + data->inter : value[v];
        if (!(fabs(x) <= 1e30))
            return status_fail(status, STATUS_INVALID,
                               "%s: voxel (%d, %d, %d) is %g, not a grey value", reading->path,
                               at[0], at[1], at[2], x);
        if (channel >= reading->channels || at[0] < low[0] || at[1] < low[1] || at[2] < low[2] ||
            at[0] >= high[0] || at[1] >= high[1] || at[2] >= high[2])
            continue;
        const size_t to =
            ((size_t)(at[2] - low[2]) * (size_t)(high[1] - low[1]) + (size_t)(at[1] - low[1])) *
                (size_t)(high[0] - low[0]) +
            (size_t)(at[0] - low[0]);
        reading->value[to * (size_t)reading->channels + (size_t)channel] = (float)x;
    }
    // Bytes are taken as they are, where the caller gives no limits.
    reading->bytes = data->type == VOXEL_UINT8 && data->slope == 0.0;
    return true;
}

static int compare(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

// Finds the values at 1 % and 99 %, from a sample: scans have a few voxels of metal.
static void find_limits(const float *value, size_t count, double *black, double *white)
{
    enum { SAMPLE = 1 << 16 };
    const size_t step = count / SAMPLE + 1;
    float *some = malloc((count / step + 1) * sizeof *some);
    ASSERT(some != NULL);
    size_t n = 0;
    for (size_t v = 0; v < count; v += step)
        some[n++] = value[v];
    qsort(some, n, sizeof *some, compare);
    *black = (double)some[n / 100];
    *white = (double)some[n - 1 - n / 100];
    free(some);
}

static void fill(const Reading *reading, double black, double white)
{
    const size_t voxels = voxels_of(reading), channels = (size_t)reading->channels;
    if (black == white && reading->bytes)
        black = 0.0, white = 255.0;
    else if (black == white)
        find_limits(reading->value, voxels * channels, &black, &white);
    // All voxels alike: the middle.
    const double scale = white != black ? 255.0 / (white - black) : 0.0;
    const double zero = white != black ? 0.0 : 127.5;
    for (size_t v = 0; v < voxels; v++)
        for (size_t c = 0; c < 3; c++) {
            const double x = (double)reading->value[v * channels + (channels == 3 ? c : 0)];
            reading->picture->colour[3 * v + c] =
                (unsigned char)lrint(fmin(fmax(zero + scale * (x - black), 0.0), 255.0));
        }
}

bool volume_import_picture(const char *path, const Lattice *lattice, const PicturePlace *place,
                           double black, double white, VolumePicture *picture, Status *status)
{
    LabelVolume volume = {0};
    *picture = (VolumePicture){0};
    Reading reading = {.path = path, .lattice = lattice, .place = *place, .picture = picture};
    const bool ok = volume_read_picture(path, &volume, take, &reading, status);
    if (ok)
        fill(&reading, black, white);
    else
        volume_picture_destroy(picture);
    free(reading.value);
    volume_destroy(&volume);
    return ok;
}

void volume_picture_destroy(VolumePicture *picture)
{
    free(picture->colour);
    *picture = (VolumePicture){0};
}
