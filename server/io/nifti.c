// SPDX-License-Identifier: MIT
// NIfTI-1 headers (https://nifti.nimh.nih.gov/nifti-1): one file (.nii, packed or not) or a pair
// (.hdr and .img); those of NIfTI-2, whose members are wider, become NIfTI-1's. Niftilib turns
// header bytes into transforms. It prints to stderr and leaks memory on headers that it refuses, so
// this file refuses them first; it also requires file names by its own rules, so it gets none.
#include "io/volume_data.h"

#include "base/check.h"
#include "on_demand/nifti.h"

#include <limits.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { HEADER_SIZE = 348, NIFTI2_SIZE = 540 };

_Static_assert(sizeof(nifti_1_header) == HEADER_SIZE, "the header is read as it lies in the file");

typedef struct Nifti {
    const VolumeFile *file;
    nifti_1_header header; // in this machine's byte order
    int size;              // of the header in the file [bytes]
    bool swapped;          // the file has the other byte order
    bool paired;           // voxels are in a separate file
    Status *status;
} Nifti;

static bool fail(const Nifti *nifti, const char *what)
{
    return status_fail(nifti->status, STATUS_INVALID, "%s: %s", nifti->file->path, what);
}

static int header_size(const unsigned char *head, bool *swapped)
{
    int size;
    memcpy(&size, head, sizeof size);
    *swapped = size != HEADER_SIZE && size != NIFTI2_SIZE;
    return *swapped ? (int)__builtin_bswap32((unsigned)size) : size;
}

static bool has_magic(const unsigned char *head)
{
    return memcmp(head + 344, "n+1", 4) == 0 || memcmp(head + 344, "ni1", 4) == 0;
}

bool volume_is_nifti(const unsigned char *head, int size)
{
    bool swapped;
    if (size >= 4 && header_size(head, &swapped) == NIFTI2_SIZE)
        return true;
    return size >= HEADER_SIZE && has_magic(head);
}

// Returns an integer or a real number of a NIfTI-2 header.
static int64_t wide_integer(const Nifti *nifti, const unsigned char *at, int size)
{
    const bool big = nifti->swapped != (__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__);
    uint64_t bits = 0;
    for (int i = 0; i < size; i++)
        bits = bits << 8 | at[big ? i : size - 1 - i];
    return size == 8 ? (int64_t)bits : size == 4 ? (int32_t)bits : (int16_t)bits;
}

static float wide_real(const Nifti *nifti, const unsigned char *at)
{
    const int64_t bits = wide_integer(nifti, at, 8);
    double number;
    memcpy(&number, &bits, sizeof number);
    return (float)number;
}

static void wide_reals(const Nifti *nifti, const unsigned char *at, float *to, int count)
{
    for (int i = 0; i < count; i++)
        to[i] = wide_real(nifti, at + 8 * i);
}

// Converts the header of NIfTI-2 (https://nifti.nimh.nih.gov/nifti-2), as far as volumes need it.
// Its counts are limited before, its reals lose digits that no label needs.
static bool read_nifti2(Nifti *nifti)
{
    unsigned char head[NIFTI2_SIZE];
    nifti_1_header *to = &nifti->header;
    if (volume_file_head(nifti->file, head, NIFTI2_SIZE) < NIFTI2_SIZE)
        return fail(nifti, "ends within its NIfTI-2 header: copy or export it again");
    nifti->paired = memcmp(head + 4, "ni2", 4) == 0;
    if (!nifti->paired && memcmp(head + 4, "n+2", 4) != 0)
        return fail(nifti, "begins as a NIfTI-2 file, but its mark is neither n+2 nor ni2");
    for (int d = 0; d < 8; d++) {
        const int64_t count = wide_integer(nifti, head + 16 + 8 * d, 8);
        if (count > SHRT_MAX)
            return fail(nifti, "has more than 32767 voxels along an axis");
        to->dim[d] = (short)(count < 0 ? -1 : count);
    }
    // The offsets are the standard's.
    to->sizeof_hdr = HEADER_SIZE;
    memcpy(to->magic, nifti->paired ? "ni1" : "n+1", 4);
    to->datatype = (short)wide_integer(nifti, head + 12, 2);
    to->bitpix = (short)wide_integer(nifti, head + 14, 2);
    to->vox_offset = (float)wide_integer(nifti, head + 168, 8);
    to->qform_code = (short)wide_integer(nifti, head + 344, 4);
    to->sform_code = (short)wide_integer(nifti, head + 348, 4);
    wide_reals(nifti, head + 104, to->pixdim, 8);
    wide_reals(nifti, head + 176, &to->scl_slope, 1);
    wide_reals(nifti, head + 184, &to->scl_inter, 1);
    // From quatern_b to the end of srow_z both headers have the same members.
    for (int i = 0; i < 18; i++) {
        const float real = wide_real(nifti, head + 352 + 8 * i);
        memcpy((char *)to + offsetof(nifti_1_header, quatern_b) + 4 * i, &real, sizeof real);
    }
    to->xyzt_units = (char)wide_integer(nifti, head + 500, 4);
    return true;
}

static bool read_bytes(Nifti *nifti)
{
    unsigned char head[HEADER_SIZE];
    // The header is of fixed size and begins with that size, which also tells the byte order.
    if (volume_file_head(nifti->file, head, HEADER_SIZE) < HEADER_SIZE)
        return fail(nifti, "ends within its NIfTI-1 header: copy or export it again");
    int size = header_size(head, &nifti->swapped);
    nifti->size = size;
    if (size == NIFTI2_SIZE)
        return read_nifti2(nifti);
    if (size != HEADER_SIZE)
        return fail(nifti, "its NIfTI-1 header does not begin with its size, 348");
    // Values in our byte order from here on.
    memcpy(&nifti->header, head, HEADER_SIZE);
    nifti->paired = memcmp(head + 344, "ni1", 4) == 0;
    if (nifti->swapped)
        swap_nifti_header(&nifti->header, 1);
    return true;
}

// --- checks ---

static bool check_dimensions(const Nifti *nifti, LabelVolume *volume, VolumeData *data)
{
    const short *dim = nifti->header.dim;
    if (dim[0] < 3 || dim[0] > 7)
        return status_fail(nifti->status, STATUS_INVALID,
                           "%s: has %d dimensions, not 3 as a volume", nifti->file->path, dim[0]);
    // Whatever is behind the third axis counts volumes.
    double layers = 1.0;
    for (int d = 1; d <= dim[0]; d++) {
        if (dim[d] < 1)
            return status_fail(nifti->status, STATUS_INVALID, "%s: has %d voxels along dim[%d]",
                               nifti->file->path, dim[d], d);
        layers *= d > 3 ? dim[d] : 1;
    }
    if (layers > VOLUME_MOST_VOXELS)
        return status_fail(nifti->status, STATUS_INVALID, "%s: holds %.4g volumes, more than %d",
                           nifti->file->path, layers, VOLUME_MOST_VOXELS);
    data->inner = (long)dim[1] * dim[2] * dim[3];
    volume->layers = (int)layers;
    return true;
}

static bool find_type(const Nifti *nifti, LabelVolume *volume, VolumeData *data)
{
    static const struct {
        int code;
        VoxelType type;
    } types[] = {{DT_INT8, VOXEL_INT8},      {DT_UINT8, VOXEL_UINT8},   {DT_INT16, VOXEL_INT16},
                 {DT_UINT16, VOXEL_UINT16},  {DT_INT32, VOXEL_INT32},   {DT_UINT32, VOXEL_UINT32},
                 {DT_INT64, VOXEL_INT64},    {DT_UINT64, VOXEL_UINT64}, {DT_FLOAT32, VOXEL_FLOAT32},
                 {DT_FLOAT64, VOXEL_FLOAT64}};
    const int colours = nifti->header.datatype == DT_RGB24    ? 3
                        : nifti->header.datatype == DT_RGBA32 ? 4
                                                              : 0;
    if (data->picture && colours > 0 && volume->layers == 1) {
        data->type = VOXEL_UINT8;
        data->inner = 1;
        volume->layers = colours;
        return true;
    }
    // Labels may be stored as any number that can hold an integer.
    for (size_t t = 0; t < sizeof types / sizeof *types; t++)
        if (types[t].code == nifti->header.datatype) {
            data->type = types[t].type;
            return true;
        }
    return status_fail(nifti->status, STATUS_INVALID,
                       "%s: its voxels are of datatype %d, not integers or floats of up to 64 "
                       "bits; export labels as integers",
                       nifti->file->path, nifti->header.datatype);
}

static bool find_unit(const Nifti *nifti, double *metres)
{
    switch (XYZT_TO_SPACE(nifti->header.xyzt_units)) {
    case NIFTI_UNITS_UNKNOWN:
    case NIFTI_UNITS_MM:
        *metres = 1e-3;
        return true;
    case NIFTI_UNITS_METER:
        *metres = 1.0;
        return true;
    case NIFTI_UNITS_MICRON:
        *metres = 1e-6;
        return true;
    default:
        return status_fail(nifti->status, STATUS_INVALID,
                           "%s: its unit of length has the code %d, which NIfTI-1 does not know",
                           nifti->file->path, XYZT_TO_SPACE(nifti->header.xyzt_units));
    }
}

// Checks spacings and quaternion: niftilib replaces invalid spacings by 1 and uses invalid
// quaternions.
static bool check_spacing(const Nifti *nifti)
{
    const nifti_1_header *header = &nifti->header;
    // With an sform the spacing is not used.
    if (header->sform_code > 0)
        return true;
    // Spacings must be lengths.
    for (int d = 1; d <= 3; d++)
        if (!(header->pixdim[d] > 0.0f) || !isfinite(header->pixdim[d]))
            return status_fail(nifti->status, STATUS_INVALID,
                               "%s: the spacing along axis %d is %g (pixdim[%d])",
                               nifti->file->path, d - 1, (double)header->pixdim[d], d);
    // And the quaternion, whose first part is implied, must have room for it.
    if (header->qform_code <= 0)
        return true;
    double b = (double)header->quatern_b, c = (double)header->quatern_c;
    double d = (double)header->quatern_d, square = b * b + c * c + d * d;
    if (square <= 1.001)
        return true;
    return status_fail(nifti->status, STATUS_INVALID,
                       "%s: (%g, %g, %g) is no part of a unit quaternion (quatern_b, c, d)",
                       nifti->file->path, b, c, d);
}

// --- location of the volume and its voxels ---

// Converts from NIfTI's world, which is RAS.
static Vec3 from_ras(double x, double y, double z, double metres)
{
    return vec3(-x * metres, -y * metres, z * metres);
}

// Notes by how much the sform, which is taken, differs from spacings and qform.
static void note_differences(const nifti_image *image, const float pixdim[8], double metres,
                             LabelVolume *volume)
{
    const double share = 0.01; // of a voxel: more than single precision loses
    const mat44 *s = &image->sto_xyz, *q = &image->qto_xyz;
    double length[3], least = HUGE_VAL, far = 0.0;
    bool differ = false;
    for (int a = 0; a < 3; a++) {
        length[a] = vec3_length(vec3((double)s->m[0][a], (double)s->m[1][a], (double)s->m[2][a]));
        least = fmin(least, length[a]);
        differ |= fabs((double)pixdim[a + 1] - length[a]) > share * length[a];
    }
    if (differ)
        volume_note(volume,
                    "its sform was taken, with voxels of %.4g x %.4g x %.4g mm; pixdim says %.4g x "
                    "%.4g x %.4g",
                    1e3 * metres * length[0], 1e3 * metres * length[1], 1e3 * metres * length[2],
                    1e3 * metres * (double)pixdim[1], 1e3 * metres * (double)pixdim[2],
                    1e3 * metres * (double)pixdim[3]);
    // The corners differ most.
    for (int k = 0; k < 8 && image->qform_code > 0; k++) {
        double square = 0.0;
        for (int r = 0; r < 3; r++) {
            double d = (double)s->m[r][3] - (double)q->m[r][3];
            for (int a = 0; a < 3; a++)
                if (k >> a & 1)
                    d += (volume->count[a] - 1) * ((double)s->m[r][a] - (double)q->m[r][a]);
            square += d * d;
        }
        far = fmax(far, sqrt(square));
    }
    if (far > share * least)
        volume_note(volume,
                    "its sform was taken; by its qform voxels would be up to %.3g mm elsewhere",
                    1e3 * metres * far);
}

static bool place(const Nifti *nifti, LabelVolume *volume, VolumeData *data)
{
    double metres = 0.0;
    if (!find_unit(nifti, &metres))
        return false;
    // Niftilib computes the transforms; the sform takes precedence over the qform.
    nifti_set_debug_level(0);
    nifti_image *image = nifti_convert_nhdr2nim(nifti->header, NULL);
    if (image == NULL)
        return fail(
            nifti,
            "has a NIfTI-1 header that niftilib refuses: export it again, from 3D Slicer for one");
    const int count[3] = {image->nx, image->ny, image->nz};
    const float step[3] = {image->dx, image->dy, image->dz};
    bool turned = image->sform_code > 0 || image->qform_code > 0;
    mat44 m = image->sform_code > 0 ? image->sto_xyz : image->qto_xyz;
    for (int a = 0; a < 3; a++) {
        volume->count[a] = count[a];
        if (turned)
            volume->axis[a] =
                from_ras((double)m.m[0][a], (double)m.m[1][a], (double)m.m[2][a], metres);
        else
            volume->axis[a] = vec3_scale((double)step[a] * metres, vec3(a == 0, a == 1, a == 2));
    }
    if (turned)
        volume->origin = from_ras((double)m.m[0][3], (double)m.m[1][3], (double)m.m[2][3], metres);
    if (image->sform_code > 0)
        note_differences(image, nifti->header.pixdim, metres, volume);
    // A scale other than identity applies to the labels.
    double slope = (double)image->scl_slope, inter = (double)image->scl_inter;
    if (slope != 1.0 || inter != 0.0) {
        data->slope = slope;
        data->inter = inter;
    }
    nifti_image_free(image);
    return true;
}

// Opens the file of voxels of a pair: the name of the header with another ending.
static bool open_pair(const Nifti *nifti, VolumeData *data)
{
    // The voxels of a pair are in a file of the same name, packed or not.
    static const char *const ends[] = {".img", ".img.gz"};
    const char *path = nifti->file->path;
    size_t stem = strlen(path);
    if (stem > 7 && strcmp(path + stem - 7, ".hdr.gz") == 0)
        stem -= 7;
    else if (stem > 4 && strcmp(path + stem - 4, ".hdr") == 0)
        stem -= 4;
    else
        return fail(nifti, "is the header of a NIfTI-1 pair, but its name does not end in .hdr, "
                           "so that of its voxels is not known");
    // The error of the first try is the one that is told.
    char *name = malloc(stem + 8);
    ASSERT(name != NULL);
    bool ok = false;
    Status first = {0};
    for (int i = 0; i < 2 && !ok; i++) {
        memcpy(name, path, stem);
        strcpy(name + stem, ends[i]);
        Status other = {0};
        ok = volume_file_open(name, &data->file, i == 0 ? &first : &other);
        if (!ok)
            volume_file_close(&data->file);
    }
    free(name);
    return ok || status_fail(nifti->status, STATUS_INVALID, "%s", first.text);
}

static bool find_data(const Nifti *nifti, VolumeData *data)
{
    double offset = (double)nifti->header.vox_offset;
    data->swapped = nifti->swapped;
    // Where the voxels begin: never inside the header.
    if (!nifti->paired && offset == 0.0)
        offset = nifti->size + 4.0; // the only possible meaning
    double least = nifti->paired ? 0.0 : nifti->size;
    if (!(offset >= least && offset <= 1e9) || offset != floor(offset))
        return status_fail(nifti->status, STATUS_INVALID,
                           "%s: its voxels begin at byte %g (vox_offset)", nifti->file->path,
                           offset);
    if (nifti->paired && !open_pair(nifti, data))
        return false;
    // In a packed file the offset counts unpacked bytes.
    const VolumeFile *file = nifti->paired ? &data->file : nifti->file;
    data->encoding = file->gzipped ? ENCODING_GZIP : ENCODING_RAW;
    if (file->gzipped)
        data->skip = (long long)offset;
    else
        data->offset = (long long)offset;
    return true;
}

bool volume_read_nifti(const VolumeFile *file, LabelVolume *volume, VolumeData *data,
                       Status *status)
{
    Nifti nifti = {.file = file, .status = status};
    if (!library_load(&nifti_library, file->path, status) || !read_bytes(&nifti))
        return false;
    volume->format = nifti.size == NIFTI2_SIZE ? "NIfTI-2" : "NIfTI-1";
    return check_dimensions(&nifti, volume, data) && find_type(&nifti, volume, data) &&
           check_spacing(&nifti) && place(&nifti, volume, data) && find_data(&nifti, data);
}
