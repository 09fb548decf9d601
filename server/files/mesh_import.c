// Reads a mesh file into memory at once, tells its format by its content, and welds what it holds.
// Load time only; never writes, never follows other files that the mesh file names.
#include "files/mesh_import.h"

#include "files/obj.h"
#include "files/stl.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

// Lines, nodes and triangles of a file of this size all count in an int.
static const size_t LARGEST_FILE = INT_MAX;

static bool read_bytes(int descriptor, FileBytes *file, Status *status)
{
    size_t have = 0;
    while (have < file->size) {
        ssize_t got = read(descriptor, file->bytes + have, file->size - have);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return status_fail(status, STATUS_INVALID, "%s: %s", file->path, strerror(errno));
        if (got == 0)
            return status_fail(status, STATUS_INVALID, "%s: the file shrank while it was read",
                               file->path);
        have += (size_t)got;
    }
    file->bytes[file->size] = 0;
    return true;
}

static bool read_file(const char *path, FileBytes *file, Status *status)
{
    // O_NONBLOCK: opening a pipe that nobody writes to must not wait.
    int descriptor = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat about;
    if (descriptor < 0)
        return status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    *file = (FileBytes){.path = path};
    bool ok = true;
    if (fstat(descriptor, &about) != 0)
        ok = status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    else if (!S_ISREG(about.st_mode))
        ok = status_fail(status, STATUS_INVALID, "%s: %s", path,
                         S_ISDIR(about.st_mode) ? "is a folder, not a mesh file" : "is not a file");
    else if (about.st_size == 0)
        ok = status_fail(status, STATUS_INVALID, "%s: the file is empty", path);
    else if ((size_t)about.st_size > LARGEST_FILE)
        ok = status_fail(status, STATUS_INVALID, "%s: %lld bytes, more than %zu", path,
                         (long long)about.st_size, LARGEST_FILE);
    if (ok) {
        file->size = (size_t)about.st_size;
        file->bytes = malloc(file->size + 1);
        ok = file->bytes != NULL ? read_bytes(descriptor, file, status)
                                 : status_fail(status, STATUS_INVALID,
                                               "%s: no memory for %zu bytes", path, file->size);
    }
    close(descriptor);
    if (!ok)
        free(file->bytes);
    return ok;
}

// Text starts behind a byte order mark and blanks; 'solid' there is ASCII STL.
static bool starts_with_solid(const FileBytes *file)
{
    const char *at = file->bytes;
    at += strspn(at, " \t\r\n");
    return strncasecmp(at, "solid", 5) == 0 && (at[5] == 0 || strchr(" \t\r\n", at[5]) != NULL);
}

static bool read_format(FileBytes *file, TriMesh *mesh, Status *status)
{
    // Binary first: its header may begin with 'solid', but no text has just this size, because four
    // characters read as a count announce more than 25 GB.
    size_t count = stl_binary_count(file);
    if (file->size == stl_binary_size(count))
        return stl_read_binary(file, mesh, status);
    if (memchr(file->bytes, 0, file->size) != NULL) {
        if (file->size < stl_binary_size(0))
            return status_fail(status, STATUS_INVALID,
                               "%s: neither text nor a binary STL, which has at least %zu bytes",
                               file->path, stl_binary_size(0));
        return status_fail(status, STATUS_INVALID,
                           "%s: neither text nor a binary STL: its %zu triangles take %zu bytes, "
                           "the file has %zu",
                           file->path, count, stl_binary_size(count), file->size);
    }
    if (strncmp(file->bytes, "\xEF\xBB\xBF", 3) == 0)
        memset(file->bytes, ' ', 3);
    return starts_with_solid(file) ? stl_read_ascii(file, mesh, status)
                                   : obj_read(file, mesh, status);
}

bool mesh_import(const char *path, TriMesh *mesh, Status *status)
{
    FileBytes file;
    if (!read_file(path, &file, status))
        return false;
    bool ok = read_format(&file, mesh, status);
    free(file.bytes);
    if (ok)
        mesh_weld(mesh);
    return ok;
}
