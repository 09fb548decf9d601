// HDF5 files as wholes: opening, saving, seals. Called at load, by the files thread, and by clients
// that record; never by the step thread. HDF5 prints nothing: what it would say is turned into a
// Status.
#include "files/hdf.h"

#ifdef PLIANT_WITH_HDF5
#include "base/check.h"
#include "files/fnv.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { CORE_INCREMENT = 1 << 20, SEAL_BYTES = 512, PIECE_BYTES = 1 << 16 };

#define SEAL_FORMAT "pliant: %zu bytes follow, fnv1a %016" PRIx64 "\n"

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

bool hdf_open(HdfFile *file, const char *path, Status *status)
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

bool hdf_create(HdfFile *file, const char *path, Status *status)
{
    // In memory first: a full disk then fails in our own write, which can be undone, and not inside
    // the library, which cannot close such a file.
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
    file->id = -1;
}

static bool write_all(int fd, const unsigned char *data, size_t size)
{
    while (size > 0) {
        ssize_t written = write(fd, data, size);
        if (written < 0 && errno == EINTR)
            continue;
        if (written <= 0)
            return false;
        data += written;
        size -= (size_t)written;
    }
    return true;
}

// A rename is safe once the folder is on the disk too.
static void flush_folder(const char *path)
{
    const char *slash = strrchr(path, '/');
    char *folder = slash == NULL ? strdup(".") : strndup(path, (size_t)(slash - path) + 1);
    ASSERT(folder != NULL);
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        fsync(fd);
        close(fd);
    }
    free(folder);
}

// The temporary file, empty and ours alone until it is closed: two programs that save under one
// name would else write into each other's. One that a killed program has left behind is used again.
// -1 with errno.
static int open_temporary(const char *path)
{
    for (;;) {
        int fd = open(path, O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
        if (fd < 0)
            return -1;
        struct stat ours, named;
        bool held = flock(fd, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
        bool there = held && fstat(fd, &ours) == 0 && stat(path, &named) == 0;
        // Another program may have renamed it between our two calls: it is a finished file then.
        if (there && ours.st_ino == named.st_ino && ftruncate(fd, 0) == 0)
            return fd;
        int error = held ? errno : EBUSY;
        close(fd);
        errno = error;
        if (!held || (there && ours.st_ino == named.st_ino))
            return -1;
    }
}

// The whole content of a file on the disk, under its name, or errno set.
static bool write_sealed(const char *path, const char *temporary, const unsigned char *image,
                         size_t size)
{
    unsigned char seal[SEAL_BYTES] = {0};
    snprintf((char *)seal, sizeof seal, SEAL_FORMAT, size, fnv_bytes(FNV_START, image, size));
    int fd = open_temporary(temporary);
    if (fd < 0)
        return false;
    bool ok = write_all(fd, seal, sizeof seal) && write_all(fd, image, size) && fsync(fd) == 0 &&
              rename(temporary, path) == 0;
    int error = errno;
    if (!ok)
        unlink(temporary);
    close(fd);
    errno = error;
    return ok;
}

bool hdf_save(HdfFile *file)
{
    ssize_t size =
        H5Fflush(file->id, H5F_SCOPE_GLOBAL) >= 0 ? H5Fget_file_image(file->id, NULL, 0) : -1;
    unsigned char *image = size > 0 ? malloc((size_t)size) : NULL;
    if (image == NULL || H5Fget_file_image(file->id, image, (size_t)size) != size) {
        free(image);
        return status_fail(file->status, STATUS_FAILED, "%s: no memory to write it", file->path);
    }
    size_t length = strlen(file->path) + sizeof ".tmp";
    char *temporary = malloc(length);
    ASSERT(temporary != NULL);
    snprintf(temporary, length, "%s.tmp", file->path);
    bool ok = write_sealed(file->path, temporary, image, (size_t)size);
    int error = errno;
    if (ok)
        flush_folder(file->path);
    free(temporary);
    free(image);
    return ok || status_fail(file->status, STATUS_FAILED, "%s: %s", file->path, strerror(error));
}

bool hdf_check_seal(const char *path, Status *status)
{
    if (!check_readable(path, status))
        return false;
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    unsigned char piece[PIECE_BYTES];
    char found[SEAL_BYTES] = "", expected[SEAL_BYTES] = "";
    size_t size = 0, count = fread(found, 1, sizeof found, file);
    bool sealed = count == sizeof found && strncmp(found, "pliant: ", 8) == 0;
    uint64_t hash = FNV_START;
    while (sealed && (count = fread(piece, 1, sizeof piece, file)) > 0) {
        hash = fnv_bytes(hash, piece, count);
        size += count;
    }
    fclose(file);
    if (!sealed)
        return status_fail(status, STATUS_INVALID, "%s: is no file that Pliant wrote", path);
    snprintf(expected, sizeof expected, SEAL_FORMAT, size, hash);
    return memcmp(found, expected, sizeof found) == 0 ||
           status_fail(status, STATUS_INVALID,
                       "%s: is truncated or was altered: it differs from its seal", path);
}
#endif
