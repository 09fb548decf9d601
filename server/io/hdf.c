// SPDX-License-Identifier: MIT
// Whole HDF5 files: opening, saving, seals, the child that reads them, and tables that grow. Called
// at load time, by the files thread, and by clients that record; never by the step thread. HDF5
// prints nothing: its errors become a Status.

#include "io/hdf.h"

#ifdef PLIANT_WITH_HDF5
#include "base/check.h"
#include "base/fnv.h"
#include "base/output.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
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

bool hdf_load(const char *path, Status *status)
{
    return library_load(&hdf5_library, path, status);
}

void hdf_begin(void)
{
    H5dont_atexit();
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
}

static bool is_locked(const char *path)
{
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    const bool locked = fd >= 0 && flock(fd, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    if (fd >= 0)
        close(fd);
    return locked;
}

bool hdf_locks(hid_t access_list, int fd)
{
    if (fd < 0)
        return true;
    if (flock(fd, LOCK_SH | LOCK_NB) == 0)
        flock(fd, LOCK_UN);
    else if (errno == ENOLCK || errno == ENOSYS || errno == EOPNOTSUPP)
        return H5Pset_file_locking(access_list, false, true) < 0;
    return true; // if another program has locked it, HDF5 will fail
}

bool hdf_open_here(HdfFile *file, const char *path, Status *status)
{
    *file = (HdfFile){.id = -1, .path = path, .status = status};
    if (!hdf_load(path, status))
        return false;
    hdf_begin();
    // Say what is wrong where HDF5 would only say that it failed.
    if (!check_readable(path, status))
        return false;
    if (H5Fis_hdf5(path) <= 0)
        return status_fail(status, STATUS_INVALID, "%s: is not an HDF5 file", path);
    hid_t access_list = H5Pcreate(H5P_FILE_ACCESS);
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    hdf_locks(access_list, fd);
    if (fd >= 0)
        close(fd);
    file->id = H5Fopen(path, H5F_ACC_RDONLY, access_list);
    H5Pclose(access_list);
    if (file->id >= 0)
        return true;
    // A program that has it open for writing is no damage, and passes.
    if (is_locked(path))
        return status_fail(status, STATUS_FAILED,
                           "%s: another program is writing it (wait for its end)", path);
    return status_fail(status, STATUS_INVALID,
                       "%s: is truncated, damaged or being written; if its writer was killed, "
                       "h5clear -s FILE (package hdf5-tools) may open it",
                       path);
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
    // The child opens the file and says how that went.
    file->child = hdf_child_start(path, serve, (void *)(uintptr_t)path, status);
    if (file->child == NULL)
        return false;
    if (!hdf_child_receive(file->child->fd, &said, sizeof said)) {
        hdf_child_failed(file->child, path, status);
    } else if (said.code != STATUS_OK) {
        said.text[sizeof said.text - 1] = '\0';
        status_fail(status, said.code == STATUS_FAILED ? STATUS_FAILED : STATUS_INVALID, "%s",
                    said.text);
    } else {
        return true;
    }
    // It is gone, or it refused.
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
    *file = (HdfFile){.id = -1, .path = path, .status = status};
    if (!hdf_load(path, status))
        return false;
    hdf_begin();
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
    // Read the stated seal, then hash what follows it.
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
    // Two sentences: not ours at all, or ours and damaged.
    if (!sealed)
        return status_fail(status, STATUS_INVALID, "%s: is no file that Pliant wrote", path);
    snprintf(expected, sizeof expected, SEAL_FORMAT, size, hash);
    return (ours && memcmp(found, expected, SEAL_BYTES) == 0) ||
           status_fail(status, STATUS_INVALID,
                       "%s: is truncated or was altered: it differs from its seal; write it again",
                       path);
}

bool hdf_open_target(HdfFile *file, const char *path, const char *format, Status *status)
{
    struct stat info;
    char text[64];
    *file = (HdfFile){.id = -1, .path = path, .status = status};
    // A missing library refuses the run now, not what is saved at its end.
    if (!hdf_load(path, status))
        return false;
    // Only files of ours are replaced; an absent or empty one needs no look.
    if (!output_check(path, HDF_MARK, status))
        return false;
    if (lstat(path, &info) != 0 || !S_ISREG(info.st_mode) || info.st_size == 0)
        return true;
    // Open it: an intact file of this format may be replaced.
    Status why = {0};
    bool whole = hdf_open_sealed(file, path, &why);
    file->status = &why;
    whole = whole && hdf_read_text(file, "/", "format", text, sizeof text) &&
            (strcmp(text, format) == 0 ||
             hdf_fail(file, "/", "format \"%.40s\" is not \"%s\"", text, format));
    file->status = status;
    if (whole)
        return true;
    // Anything else stays as it is.
    hdf_close(file);
    return status_fail(status, why.code, "%.400s: it is not replaced", why.text);
}

// --- the child process ---------------------------------------------------------------------------

enum {
    CPU_SECONDS = 30,        // reading a gigabyte takes two
    MEMORY_MARGIN = 1 << 30, // [bytes], on top of our own at the start and four times the file
};

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1 // no address space limit is possible with shadow memory
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SANITIZED 1
#endif
#endif
#ifndef SANITIZED
#define SANITIZED 0
#endif

#if SANITIZED
// A fuzzer saves the input of a process that dies; here the child may die.
void __sanitizer_set_death_callback(void (*callback)(void)) __attribute__((weak));
#endif

// Returns the size of the address space as the kernel counts it for RLIMIT_AS.
static rlim_t address_space(void)
{
    unsigned long pages = 0;
    FILE *file = fopen("/proc/self/statm", "re");
    if (file == NULL || fscanf(file, "%lu", &pages) != 1)
        pages = 0;
    if (file != NULL)
        fclose(file);
    return (rlim_t)pages * (rlim_t)sysconf(_SC_PAGESIZE);
}

static void limit(int what, rlim_t most)
{
    struct rlimit bound;
    if (getrlimit(what, &bound) != 0 || (bound.rlim_max != RLIM_INFINITY && bound.rlim_max < most))
        return;
    bound.rlim_cur = bound.rlim_max = most;
    setrlimit(what, &bound);
}

void hdf_child_renew(void)
{
    struct rlimit bound;
    struct rusage used;
    if (getrlimit(RLIMIT_CPU, &bound) != 0 || getrusage(RUSAGE_SELF, &used) != 0)
        return;
    rlim_t most = (rlim_t)(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + CPU_SECONDS;
    bound.rlim_cur = most < bound.rlim_max ? most : bound.rlim_max;
    setrlimit(RLIMIT_CPU, &bound);
}

// Limits the child: default signal actions, no core file, bounded time and memory.
static void restrain(const char *path)
{
    struct stat facts;
    // Handlers and masks of the parent are not for the child.
    for (int number = 1; number < NSIG; number++)
        signal(number, SIG_DFL);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, NULL);
#if SANITIZED
    if (__sanitizer_set_death_callback != NULL)
        __sanitizer_set_death_callback(NULL);
#endif
    // It must not outlive us, leave a core or read for ever.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    limit(RLIMIT_CORE, 0);
    hdf_child_renew();
    // The memory of an honest file of this size.
    rlim_t used = address_space(), size = stat(path, &facts) == 0 ? (rlim_t)facts.st_size : 0;
    // A sparse file counts by the space that it occupies.
    rlim_t stored = stat(path, &facts) == 0 ? (rlim_t)facts.st_blocks * 512 : 0;
    if (!SANITIZED && used > 0)
        limit(RLIMIT_AS, used + 4 * (size < stored ? size : stored) + MEMORY_MARGIN);
}

// Closes the pipes, sockets and devices that the child has from us, but for `kept` and standard
// input, output and error: they are to end when we close them, not with the child. Files stay open:
// HDF5 may have one open that it reads again.
static void close_inherited(int kept)
{
    DIR *open_ones = opendir("/proc/self/fd");
    for (struct dirent *entry; open_ones != NULL && (entry = readdir(open_ones)) != NULL;) {
        struct stat info;
        int fd = atoi(entry->d_name);
        if (fd > STDERR_FILENO && fd != kept && fd != dirfd(open_ones) && fstat(fd, &info) == 0 &&
            !S_ISREG(info.st_mode))
            close(fd);
    }
    if (open_ones != NULL)
        closedir(open_ones);
}

HdfChild *hdf_child_start(const char *path, HdfServe *run, void *user, Status *status)
{
    int end[2];
    // Load the library before: in the child of several threads a lock of another one may be taken
    // for ever.
    if (!hdf_load(path, status))
        return NULL;
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, end) != 0) {
        status_fail(status, STATUS_FAILED, "%s: cannot be read: %s", path, strerror(errno));
        return NULL;
    }
    HdfChild *child = malloc(sizeof *child);
    ASSERT(child != NULL);
    // The child answers on its end until ours is closed.
    *child = (HdfChild){.pid = fork(), .fd = end[0]};
    if (child->pid == 0) {
        close(end[0]);
        close_inherited(end[1]);
        restrain(path);
        run(end[1], user);
        _exit(0);
    }
    // The parent keeps one end only.
    close(end[1]);
    if (child->pid > 0)
        return child;
    // There is no child.
    status_fail(status, STATUS_FAILED, "%s: no process to read it: %s", path, strerror(errno));
    close(end[0]);
    free(child);
    return NULL;
}

// Returns the child's wait status; -1: unknown.
static int wait_for(HdfChild *child)
{
    int ended = -1;
    // The child sees the end of its input, even if a later child inherited our end.
    if (child->fd >= 0) {
        shutdown(child->fd, SHUT_RDWR);
        close(child->fd);
    }
    child->fd = -1;
    if (child->pid > 0)
        while (waitpid(child->pid, &ended, 0) < 0 && errno == EINTR)
            continue;
    child->pid = 0;
    return ended;
}

void hdf_child_end(HdfChild *child)
{
    if (child == NULL)
        return;
    wait_for(child);
    free(child);
}

bool hdf_child_failed(HdfChild *child, const char *path, Status *status)
{
    const int ended = wait_for(child);
    // Its time was up,
    if (WIFSIGNALED(ended) && (WTERMSIG(ended) == SIGXCPU || WTERMSIG(ended) == SIGKILL))
        return status_fail(status, STATUS_INVALID,
                           "%s: is damaged: HDF5 came to no end with it in %d s", path,
                           CPU_SECONDS);
    // or it crashed on the file.
    if (WIFSIGNALED(ended))
        return status_fail(status, STATUS_INVALID, "%s: is damaged: HDF5 fails on it (%s)", path,
                           strsignal(WTERMSIG(ended)));
    return status_fail(status, STATUS_INVALID, "%s: is damaged: HDF5 fails on it", path);
}

bool hdf_child_send(int fd, const void *data, size_t size)
{
    const char *from = data;
    while (size > 0) {
        // An interrupted call is tried again.
        ssize_t sent = send(fd, from, size, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR)
            continue;
        if (sent <= 0)
            return false;
        from += sent;
        size -= (size_t)sent;
    }
    return true;
}

bool hdf_child_receive(int fd, void *data, size_t size)
{
    char *to = data;
    while (size > 0) {
        // An interrupted call is tried again.
        ssize_t got = recv(fd, to, size, 0);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            return false;
        to += got;
        size -= (size_t)got;
    }
    return true;
}

// --- tables --------------------------------------------------------------------------------------

// Fails with the last system error: HDF5 reports what failed but not why.
static bool fail_table(const HdfFile *file, const char *what)
{
    const char *reason = errno != 0 ? strerror(errno) : "HDF5 refuses";
    return status_fail(file->status, STATUS_FAILED, "%s: cannot be %s: %s", file->path, what,
                       reason);
}

static void begin_table(void)
{
    hdf_begin();
    errno = 0;
}

static int rank_of(const HdfTable *table)
{
    return table->columns > 0 ? 2 : 1;
}

bool hdf_table_create(const HdfFile *file, const char *name, hid_t type, int columns, hsize_t chunk,
                      const char *unit, HdfTable *table)
{
    begin_table();
    *table = (HdfTable){.set = -1, .type = type, .columns = columns};
    // Empty, without limit, and stored in chunks.
    const hsize_t size[2] = {0, (hsize_t)columns}, most[2] = {H5S_UNLIMITED, (hsize_t)columns};
    const hsize_t chunks[2] = {chunk > 0 ? chunk : 1, (hsize_t)columns};
    // Groups above it are made on the way.
    hid_t groups = H5Pcreate(H5P_LINK_CREATE), layout = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_create_intermediate_group(groups, 1);
    H5Pset_chunk(layout, rank_of(table), chunks);
    hid_t space = H5Screate_simple(rank_of(table), size, most);
    table->set = H5Dcreate2(file->id, name, type, space, groups, layout, H5P_DEFAULT);
    H5Sclose(space);
    H5Pclose(layout);
    H5Pclose(groups);
    return (table->set >= 0 || fail_table(file, "created")) &&
           hdf_write_text(file, name, "unit", unit);
}

// Selects rows [first, first + rows) of the data set, in the file and in memory.
static void select_rows(const HdfTable *table, hsize_t first, hsize_t rows, hid_t *in_file,
                        hid_t *in_memory)
{
    const hsize_t start[2] = {first, 0}, count[2] = {rows, (hsize_t)table->columns};
    *in_file = H5Dget_space(table->set);
    H5Sselect_hyperslab(*in_file, H5S_SELECT_SET, start, NULL, count, NULL);
    *in_memory = H5Screate_simple(rank_of(table), count, NULL);
}

bool hdf_table_append(const HdfFile *file, HdfTable *table, hsize_t rows, const void *data)
{
    if (rows == 0)
        return true;
    begin_table();
    // Make it longer, then write behind what is there.
    const hsize_t size[2] = {table->count + rows, (hsize_t)table->columns};
    if (H5Dset_extent(table->set, size) < 0)
        return fail_table(file, "written");
    hid_t in_file, in_memory;
    select_rows(table, table->count, rows, &in_file, &in_memory);
    bool ok = H5Dwrite(table->set, table->type, in_memory, in_file, H5P_DEFAULT, data) >= 0 ||
              fail_table(file, "written");
    H5Sclose(in_memory);
    H5Sclose(in_file);
    // Rows that failed are not counted, though the file is longer.
    if (ok)
        table->count += rows;
    return ok;
}

bool hdf_table_read(const HdfFile *file, const HdfTable *table, hsize_t first, hsize_t rows,
                    void *to)
{
    begin_table();
    hid_t in_file, in_memory;
    select_rows(table, first, rows, &in_file, &in_memory);
    bool ok = H5Dread(table->set, table->type, in_memory, in_file, H5P_DEFAULT, to) >= 0 ||
              fail_table(file, "read back");
    H5Sclose(in_memory);
    H5Sclose(in_file);
    return ok;
}

void hdf_table_close(HdfTable *table)
{
    if (table->set > 0)
        H5Dclose(table->set);
    table->set = 0;
}
#endif
