// Reads a mesh file into memory at once, recognises its format by its content and repairs it. Load
// time only; never writes, never opens other files that the mesh file names.
#include "io/mesh_import.h"

#include "io/mesh_formats.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

// Lines, nodes and triangles of a file up to this size all fit an int.
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
    // O_NONBLOCK: opening a pipe without a writer must not block.
    int descriptor = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat about;
    if (descriptor < 0)
        return status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    *file = (FileBytes){.path = path};
    bool ok = true;
    // Refuse what is no regular file of a readable size, before memory is allocated.
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

// Text starts after a byte order mark and blanks; 'solid' there means ASCII STL.
static bool starts_with_solid(const FileBytes *file)
{
    const char *at = file->bytes;
    at += strspn(at, " \t\r\n");
    return strncasecmp(at, "solid", 5) == 0 && (at[5] == 0 || strchr(" \t\r\n", at[5]) != NULL);
}

// Normalises text for the readers: no byte order mark, lines that end in a newline.
static void normalize_text(FileBytes *file)
{
    if (strncmp(file->bytes, "\xEF\xBB\xBF", 3) == 0)
        memset(file->bytes, ' ', 3);
    if (memchr(file->bytes, '\n', file->size) != NULL)
        return;
    for (char *at = file->bytes; (at = strchr(at, '\r')) != NULL;)
        *at = '\n';
}

// Some writers terminate a text as C does, or pad its last block with zeros. Text without lines is
// no text.
static void drop_final_zeros(FileBytes *file)
{
    size_t size = file->size;
    while (size > 0 && file->bytes[size - 1] == 0)
        size--;
    if (memchr(file->bytes, '\n', size) != NULL || memchr(file->bytes, '\r', size) != NULL)
        file->size = size;
}

static bool refuse_binary(const FileBytes *file, size_t triangles, Status *status)
{
    if (file->size < stl_binary_size(0))
        return status_fail(status, STATUS_INVALID,
                           "%s: neither text nor a binary STL, which has at least %zu bytes",
                           file->path, stl_binary_size(0));
    return status_fail(status, STATUS_INVALID,
                       "%s: neither text nor a binary STL: its %zu triangles take %zu bytes, "
                       "the file has %zu",
                       file->path, triangles, stl_binary_size(triangles), file->size);
}

static bool read_draft(FileBytes *file, MeshDraft *draft, const char **format, Status *status)
{
    if (ply_is(file))
        return ply_read(file, draft, format, status);
    // A binary STL may begin with 'solid' like a text, but no text has just this size, because four
    // characters read as a count announce more than 25 GB.
    size_t count = stl_binary_count(file);
    *format = "binary STL";
    if (file->size == stl_binary_size(count))
        return stl_read_binary(file, draft, status);
    const FileBytes whole = *file;
    drop_final_zeros(file);
    if (memchr(file->bytes, 0, file->size) != NULL)
        return refuse_binary(&whole, count, status);
    normalize_text(file);
    if (starts_with_solid(file)) {
        *format = "ASCII STL";
        return stl_read_ascii(file, draft, status);
    }
    if (off_is(file)) {
        *format = "OFF";
        return off_read(file, draft, status);
    }
    *format = "OBJ";
    return obj_read(file, draft, status);
}

static bool repair(const FileBytes *file, const MeshDraft *draft, TriMesh *mesh, MeshImport *import,
                   Status *status)
{
    MeshFault fault;
    import->node_count = draft->node_count;
    import->face_count = draft->polygon_count;
    if (mesh_repair(draft, mesh, &import->repairs, &fault))
        return true;
    int line = fault.triangle >= 0 ? draft->line[fault.triangle] : 0;
    if (line > 0)
        return status_fail(status, STATUS_INVALID, "%s:%d: %s", file->path, line, fault.text);
    return status_fail(status, STATUS_INVALID, "%s: %s", file->path, fault.text);
}

bool mesh_import(const char *path, TriMesh *mesh, MeshImport *import, Status *status)
{
    FileBytes file;
    *import = (MeshImport){0};
    if (!read_file(path, &file, status))
        return false;
    MeshDraft draft = {0};
    Status said = {0};
    bool ok = read_draft(&file, &draft, &import->format, &said);
    if (draft.full)
        ok = status_fail(status, STATUS_INVALID, "%s: more than %d nodes, corners or faces", path,
                         MESH_COUNT_MAX);
    else if (!ok)
        status_fail(status, said.code, "%s", said.text);
    ok = ok && repair(&file, &draft, mesh, import, status);
    mesh_draft_destroy(&draft);
    free(file.bytes);
    return ok;
}
