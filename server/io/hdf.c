// Whole HDF5 files: opening, saving, seals. Called at load time, by the files thread, and by
// clients that record; never by the step thread. HDF5 prints nothing: its errors become a Status.
#include "io/hdf.h"

#ifdef PLIANT_WITH_HDF5
#include "base/output.h"
#include "base/fnv.h"
#include "io/hdf_child.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { CORE_INCREMENT = 1 << 20, SEAL_BYTES = 512, PIECE_BYTES = 1 << 16 };
static const size_t LARGEST_BYTES = (size_t)1 << 34;

#define SEAL_FORMAT HDF_MARK "%zu bytes follow, fnv1a %016" PRIx64 "\n"

bool hdf_fail(const HdfFile *file, const char *object, const char *format, ...)
{
    char text[300];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return status_fail(file->status, STATUS_INVALID, "%s: %s %s", file->path, object, text);
}

static bool check_readable(const char *path, Status *status)
{
    struct stat info;
    if (stat(path, &info) != 0)
        return status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    if (!S_ISREG(info.st_mode))
        return status_fail(status, STATUS_INVALID, "%s: is not a regular file", path);
    return access(path, R_OK) == 0 ||
           status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
}

void hdf_begin(void)
{
    H5dont_atexit();
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
}

bool hdf_open_here(HdfFile *file, const char *path, Status *status)
{
    hdf_begin();
    *file = (HdfFile){.id = -1, .path = path, .status = status};
    if (!check_readable(path, status))
        return false;
    if (H5Fis_hdf5(path) <= 0)
        return status_fail(status, STATUS_INVALID, "%s: is not an HDF5 file", path);
    file->id = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    return file->id >= 0 ||
           status_fail(status, STATUS_INVALID, "%s: is truncated, damaged or being written", path);
}

// Answers first whether the file could be opened.
static void serve(int fd, void *path)
{
    HdfFile file;
    Status said = {0};
    bool ok = hdf_open_here(&file, path, &said);
    if (hdf_child_send(fd, &said, sizeof said) && ok)
        hdf_serve(&file, fd);
}

bool hdf_open(HdfFile *file, const char *path, Status *status)
{
    Status said;
    *file = (HdfFile){.id = -1, .path = path, .status = status};
    if (!check_readable(path, status))
        return false;
    file->child = hdf_child_start(path, serve, (void *)(uintptr_t)path, status);
    if (file->child == NULL)
        return false;
    if (!hdf_child_receive(file->child->fd, &said, sizeof said)) {
        hdf_child_failed(file->child, path, status);
    } else if (said.code != STATUS_OK) {
        said.text[sizeof said.text - 1] = '\0';
        status_fail(status, STATUS_INVALID, "%s", said.text);
    } else {
        return true;
    }
    hdf_close(file);
    return false;
}

bool hdf_open_sealed(HdfFile *file, const char *path, Status *status)
{
    *file = (HdfFile){.id = -1, .path = path, .status = status};
    return hdf_check_seal(path, status) && hdf_open(file, path, status);
}

bool hdf_create(HdfFile *file, const char *path, Status *status)
{
    // Write to memory first: a full disk then fails in our own write, which can be undone, and not
    // in the library, which cannot close such a file.
    hdf_begin();
    *file = (HdfFile){.id = -1, .path = path, .status = status};
    hid_t access_list = H5Pcreate(H5P_FILE_ACCESS);
    if (H5Pset_fapl_core(access_list, CORE_INCREMENT, 0) >= 0)
        file->id = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, access_list);
    H5Pclose(access_list);
    return file->id >= 0 || status_fail(status, STATUS_FAILED, "%s: cannot be created", path);
}

void hdf_close(HdfFile *file)
{
    if (file->id >= 0)
        H5Fclose(file->id);
    hdf_child_end(file->child);
    file->id = -1;
    file->child = NULL;
}

// Writes seal and content under the file's name and syncs it to the disk.
static bool write_sealed(const HdfFile *file, const unsigned char *image, size_t size)
{
    unsigned char seal[SEAL_BYTES] = {0};
    Output output;
    snprintf((char *)seal, sizeof seal, SEAL_FORMAT, size, fnv_bytes(FNV_START, image, size));
    if (file->claim != NULL ? !output_begin_claimed(&output, file->claim, file->status)
                            : !output_begin(&output, file->path, HDF_MARK, file->status))
        return false;
    if (output_write(&output, seal, sizeof seal) && output_write(&output, image, size))
        return output_commit(&output, true, file->status);
    status_fail(file->status, STATUS_FAILED, "%s: %s", file->path, strerror(errno));
    output_abandon(&output);
    return false;
}

bool hdf_save(HdfFile *file)
{
    ssize_t size =
        H5Fflush(file->id, H5F_SCOPE_GLOBAL) >= 0 ? H5Fget_file_image(file->id, NULL, 0) : -1;
    unsigned char *image = size > 0 ? malloc((size_t)size) : NULL;
    bool ok = (image != NULL && H5Fget_file_image(file->id, image, (size_t)size) == size) ||
              status_fail(file->status, STATUS_FAILED, "%s: no memory to write it", file->path);
    ok = ok && write_sealed(file, image, (size_t)size);
    free(image);
    return ok;
}

// Checks that the length in the seal is the file's, and at most that of any of our files: a sparse
// file can be too long to read.
static bool check_length(FILE *file, const char *seal)
{
    struct stat info;
    size_t size = 0;
    return sscanf(seal, HDF_MARK "%zu", &size) == 1 && fstat(fileno(file), &info) == 0 &&
           info.st_size >= SEAL_BYTES && size == (size_t)info.st_size - SEAL_BYTES &&
           size <= LARGEST_BYTES;
}

bool hdf_check_seal(const char *path, Status *status)
{
    if (!check_readable(path, status))
        return false;
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    unsigned char piece[PIECE_BYTES];
    char found[SEAL_BYTES + 1] = "", expected[SEAL_BYTES] = "";
    size_t size = 0, count = fread(found, 1, SEAL_BYTES, file);
    bool sealed = count == SEAL_BYTES && strncmp(found, HDF_MARK, strlen(HDF_MARK)) == 0;
    bool ours = sealed && check_length(file, found);
    uint64_t hash = FNV_START;
    while (ours && (count = fread(piece, 1, sizeof piece, file)) > 0) {
        hash = fnv_bytes(hash, piece, count);
        size += count;
    }
    fclose(file);
    if (!sealed)
        return status_fail(status, STATUS_INVALID, "%s: is no file that Pliant wrote", path);
    snprintf(expected, sizeof expected, SEAL_FORMAT, size, hash);
    return (ours && memcmp(found, expected, SEAL_BYTES) == 0) ||
           status_fail(status, STATUS_INVALID,
                       "%s: is truncated or was altered: it differs from its seal", path);
}

bool hdf_open_target(HdfFile *file, const char *path, const char *format, Status *status)
{
    struct stat info;
    char text[64];
    *file = (HdfFile){.id = -1, .path = path, .status = status};
    if (!output_check(path, HDF_MARK, status))
        return false;
    if (lstat(path, &info) != 0 || !S_ISREG(info.st_mode) || info.st_size == 0)
        return true;
    Status why = {0};
    bool whole = hdf_open_sealed(file, path, &why);
    file->status = &why;
    whole = whole && hdf_read_text(file, "/", "format", text, sizeof text) &&
            (strcmp(text, format) == 0 ||
             hdf_fail(file, "/", "format \"%.40s\" is not \"%s\"", text, format));
    file->status = status;
    if (whole)
        return true;
    hdf_close(file);
    return status_fail(status, STATUS_INVALID, "%.400s: it is not replaced", why.text);
}
#endif
