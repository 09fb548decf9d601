// SPDX-License-Identifier: MIT
#include "base/output.h"

#include "base/check.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MARK_MOST = 256 };

// --- which files may be replaced ---

static bool refuse(const char *path, const char *why, Status *status)
{
    return status_fail(status, STATUS_INVALID, "%s: %s", path, why);
}

// True if the file is empty or begins with `mark`.
static bool is_ours(int fd, const struct stat *facts, const char *mark)
{
    char head[MARK_MOST];
    size_t length = strlen(mark);
    ASSERT(length <= sizeof head);
    if (facts->st_size == 0)
        return true;
    // A file whose writing was cut short begins with a part of the mark.
    size_t size = (size_t)facts->st_size < length ? (size_t)facts->st_size : length;
    return length > 0 && pread(fd, head, size, 0) == (ssize_t)size && memcmp(head, mark, size) == 0;
}

static bool check_content(const char *path, const char *mark, Status *status)
{
    // Read what is there, without following a link or waiting for a pipe.
    struct stat facts;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW);
    bool known = fd >= 0 && fstat(fd, &facts) == 0;
    bool ours = known && is_ours(fd, &facts, mark);
    if (fd >= 0)
        close(fd);
    // Say which of both it is: unreadable, or not ours.
    if (!known)
        return refuse(path, strerror(errno), status);
    return ours ||
           refuse(path, "is not empty and no file of this kind: it is not replaced", status);
}

static bool check(const char *path, const char *mark, struct stat *facts, Status *status)
{
    if (lstat(path, facts) != 0) {
        *facts = (struct stat){0};
        // A missing folder is reported, with its reason, when the file is opened for writing.
        return errno == ENOENT || refuse(path, strerror(errno), status);
    }
    if (S_ISLNK(facts->st_mode))
        return refuse(path, "is a symbolic link, which is not replaced: name the file itself",
                      status);
    if (S_ISCHR(facts->st_mode))
        return true;
    if (!S_ISREG(facts->st_mode))
        return refuse(path, "is not a regular file", status);
    return facts->st_size == 0 || check_content(path, mark, status);
}

bool output_check(const char *path, const char *mark, Status *status)
{
    struct stat facts;
    return check(path, mark, &facts, status);
}

// --- numbered names ---

char *output_former(const char *path)
{
    const size_t size = strlen(path) + sizeof ".1";
    char *former = malloc(size);
    ASSERT(former != NULL);
    snprintf(former, size, "%s.1", path);
    return former;
}

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash == NULL ? path : slash + 1;
}

static char *folder_of(const char *path)
{
    const char *base = base_name(path);
    char *folder = base == path ? strdup(".") : strndup(path, (size_t)(base - path));
    ASSERT(folder != NULL);
    return folder;
}

// Returns the length of a name without its extension; ".log" has none.
static size_t stem_length(const char *base)
{
    const char *dot = strrchr(base, '.');
    return dot == NULL || dot == base ? strlen(base) : (size_t)(dot - base);
}

// Returns N of "stem-N.extension"; 0 for any other name.
static long number_of(const char *name, const char *base)
{
    const size_t stem = stem_length(base);
    if (strncmp(name, base, stem) != 0 || name[stem] != '-' || name[stem + 1] < '1' ||
        name[stem + 1] > '9')
        return 0;
    char *end;
    // Nothing may follow the number but the extension.
    errno = 0;
    long number = strtol(name + stem + 1, &end, 10);
    return errno == 0 && number >= 2 && number < 1000000000 && strcmp(end, base + stem) == 0
               ? number
               : 0;
}

static long highest_number(const char *path)
{
    // Look at all files beside it.
    char *folder = folder_of(path);
    DIR *all = opendir(folder);
    free(folder);
    long highest = 0;
    for (const struct dirent *entry; all != NULL && (entry = readdir(all)) != NULL;) {
        long number = number_of(entry->d_name, base_name(path));
        highest = number > highest ? number : highest;
    }
    if (all != NULL)
        closedir(all);
    return highest;
}

char *output_next(const char *path)
{
    struct stat facts;
    bool there = lstat(path, &facts) == 0;
    bool one = there && (S_ISCHR(facts.st_mode) || S_ISFIFO(facts.st_mode));
    // A device or pipe has one name; a name without content is free unless a numbered one exists.
    bool taken = there && !(S_ISREG(facts.st_mode) && facts.st_size == 0);
    long highest = highest_number(path);
    char *name = NULL;
    if (one || (!taken && highest == 0)) {
        name = strdup(path);
    } else {
        // The number goes before the extension, and the first copy is number 2.
        const char *base = base_name(path);
        const size_t stem = (size_t)(base - path) + stem_length(base);
        const size_t size = strlen(path) + 24;
        name = malloc(size);
        ASSERT(name != NULL);
        snprintf(name, size, "%.*s-%ld%s", (int)stem, path, highest < 2 ? 2 : highest + 1,
                 path + stem);
    }
    ASSERT(name != NULL);
    return name;
}

// --- temporary and rename ---

// True if `fd` is the file of that name.
static bool is_named(int fd, const char *path)
{
    struct stat held, named;
    return fstat(fd, &held) == 0 && lstat(path, &named) == 0 && held.st_ino == named.st_ino &&
           held.st_dev == named.st_dev;
}

// Opens an existing temporary: reused if a killed program of ours left it, otherwise not touched.
// GONE: it disappeared meanwhile; -1 with errno.
enum { GONE = -2 };
static int open_left_behind(const char *temporary, const char *mark)
{
    struct stat facts;
    int fd = open(temporary, O_RDWR | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW);
    if (fd < 0)
        return errno == ENOENT ? GONE : -1;
    // Ours is a plain file with our mark that nobody else has locked; it is emptied.
    int error = 0;
    if (fstat(fd, &facts) != 0)
        error = errno;
    else if (flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
        error = EBUSY;
    else if (!is_named(fd, temporary)) // its writer has finished and renamed it
        error = ENOENT;
    else if (!S_ISREG(facts.st_mode) || facts.st_nlink != 1 || !is_ours(fd, &facts, mark))
        error = EEXIST;
    else if (ftruncate(fd, 0) != 0)
        error = errno;
    // The error survives close.
    if (error == 0)
        return fd;
    close(fd);
    errno = error;
    return error == ENOENT ? GONE : -1;
}

// Opens the temporary with a lock, so that two programs that save under one name do not write into
// the same file.
static int open_temporary(const char *temporary, const char *mark)
{
    enum { TRIES = 100 }; // each fails only if another program created or renamed it just then
    // Create it, or take over what a killed program left.
    for (int i = 0; i < TRIES; i++) {
        int fd = open(temporary, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0666);
        bool made = fd >= 0;
        if (!made && errno != EEXIST)
            return -1;
        if (!made)
            fd = open_left_behind(temporary, mark);
        if (!made && fd != GONE)
            return fd;
        // A file system without locks reports another error; then the file is used unlocked.
        if (made && (flock(fd, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) &&
            is_named(fd, temporary))
            return fd;
        if (made)
            close(fd);
    }
    errno = EBUSY;
    return -1;
}

static const char *temporary_error(int error)
{
    switch (error) {
    case ELOOP:
        return "is a symbolic link, which is not followed: remove it";
    case EEXIST:
    case EISDIR:
    case ENXIO:
        return "is in the way and not ours: remove it";
    default:
        return strerror(error);
    }
}

static char *temporary_of(const char *path)
{
    const size_t size = strlen(path) + sizeof ".tmp";
    char *temporary = malloc(size);
    ASSERT(temporary != NULL);
    snprintf(temporary, size, "%s.tmp", path);
    return temporary;
}

bool output_begin(Output *output, const char *path, const char *mark, Status *status)
{
    struct stat facts;
    // Only names that may be replaced.
    *output = (Output){.fd = -1};
    if (!check(path, mark, &facts, status))
        return false;
    output->path = strdup(path);
    ASSERT(output->path != NULL);
    output->temporary = temporary_of(path);
    output->device = S_ISCHR(facts.st_mode);
    // A device is written in place.
    output->fd = output->device ? open(path, O_WRONLY | O_CLOEXEC | O_NOFOLLOW)
                                : open_temporary(output->temporary, mark);
    if (output->fd >= 0)
        return true;
    // The message names the file that could not be opened.
    int error = errno;
    bool of_temporary =
        !output->device && (error == ELOOP || error == EEXIST || error == EISDIR || error == ENXIO);
    status_fail(status, STATUS_FAILED, "%s: %s", of_temporary ? output->temporary : path,
                temporary_error(error));
    output_abandon(output);
    errno = error;
    return false;
}

bool output_write(const Output *output, const void *data, size_t size)
{
    const char *from = data;
    while (size > 0) {
        ssize_t written = write(output->fd, from, size);
        if (written < 0 && errno == EINTR) // interrupted
            continue;
        if (written <= 0)
            return false;
        from += written;
        size -= (size_t)written;
    }
    return true;
}

// Flushes the folder: a rename survives a crash only once the folder is on the disk too.
static void flush_folder(const char *path)
{
    char *folder = folder_of(path);
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        fsync(fd);
        close(fd);
    }
    free(folder);
}

static void destroy(Output *output)
{
    if (output->fd >= 0)
        close(output->fd);
    free(output->path);
    free(output->temporary);
    *output = (Output){.fd = -1};
}

bool output_lock(int fd, int set, int get)
{
    // Some file systems without locks report EAGAIN, too: then nobody is found to hold one, and not
    // because it was released just then, which the second try would take.
    for (int tries = 0; tries < 2; tries++) {
        struct flock lock = {.l_type = F_WRLCK, .l_whence = SEEK_SET}, holder = lock;
        if (fcntl(fd, set, &lock) == 0 || (errno != EAGAIN && errno != EACCES))
            return true;
        if (fcntl(fd, get, &holder) == 0 && holder.l_type != F_UNLCK)
            return false;
    }
    return true;
}

// Locks by fcntl, because HDF5 uses flock and every reader of a checkpoint takes that lock. Without
// locks, or of a read-only file, the claim succeeds without one.
static bool lock_claimed(int fd)
{
    return output_lock(fd, F_OFD_SETLK, F_OFD_GETLK);
}

// Moves the claim from the former file to the one that was just written.
static void keep_claimed(Output *output, bool waits)
{
    OutputClaim *claim = output->claim;
    if (claim->fd >= 0)
        close(claim->fd);
    claim->fd = output->fd;
    claim->waits = waits;
    if (!waits)
        flock(output->fd, LOCK_UN);
    output->fd = -1;
}

// Gives the file that is about to be replaced a second name. There is always a file at PATH; on a
// file system without links it has no second name.
static void keep_former(const Output *output)
{
    char *former = output_former(output->path);
    struct stat facts;
    Status status = {0};
    if (lstat(output->path, &facts) == 0 && S_ISREG(facts.st_mode) && facts.st_size > 0 &&
        output_check(former, output->claim->mark, &status) &&
        (unlink(former) == 0 || errno == ENOENT))
        (void)!link(output->path, former);
    free(former);
}

bool output_commit(Output *output, bool durable, Status *status)
{
    // Lock before the rename, so that no other program can claim the name in between.
    if (output->claim != NULL && !output->device)
        lock_claimed(output->fd);
    if (output->claim != NULL && !output->device && output->claim->keeps)
        keep_former(output);
    bool ok = output->device || ((!durable || fsync(output->fd) == 0) &&
                                 rename(output->temporary, output->path) == 0);
    if (!ok) {
        status_fail(status, STATUS_FAILED, "%s: %s", output->path, strerror(errno));
        output_abandon(output);
        return false;
    }
    // A durable file also has its name on the disk.
    if (durable && !output->device)
        flush_folder(output->path);
    // The claim moves on to the new file.
    if (output->claim != NULL && !output->device)
        keep_claimed(output, false);
    destroy(output);
    return true;
}

void output_abandon(Output *output)
{
    // While the claimed file does not exist yet, the claim's lock stays with the temporary.
    if (output->fd >= 0 && output->claim != NULL && output->claim->fd < 0 && !output->device &&
        ftruncate(output->fd, 0) == 0 && lseek(output->fd, 0, SEEK_SET) == 0)
        keep_claimed(output, true);
    else if (output->fd >= 0 && !output->device)
        unlink(output->temporary);
    destroy(output);
}

// --- claims ---

static bool refuse_claimed(const char *path, Status *status)
{
    return refuse(path, "another program that runs writes there: name another file", status);
}

// Locks the temporary while there is no file. Returns GONE if the file appeared meanwhile.
static int lock_temporary(const OutputClaim *claim, Status *status)
{
    Output first;
    struct stat facts;
    Status why = {0};
    // Take the temporary's name as any writer would.
    if (!output_begin(&first, claim->path, claim->mark, &why)) {
        if (why.code == STATUS_FAILED && errno == EBUSY)
            refuse_claimed(claim->path, status);
        else
            status_fail(status, why.code, "%s", why.text);
        return -1;
    }
    // Another program has written the file meanwhile: claim that one.
    if (lstat(claim->path, &facts) == 0) {
        output_abandon(&first);
        return GONE;
    }
    // Keep the lock, and nothing else of the output.
    int fd = first.fd;
    first.fd = -1;
    destroy(&first);
    return fd;
}

// Locks the file itself. Returns GONE if it disappeared meanwhile.
static int lock_file(const OutputClaim *claim, Status *status)
{
    int fd = open(claim->path, O_RDWR | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW);
    if (fd < 0 && errno == EACCES) // only its name is replaced: reading access is enough
        fd = open(claim->path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW);
    if (fd < 0 && errno == ENOENT)
        return GONE;
    if (fd < 0) {
        refuse(claim->path, strerror(errno), status);
        return -1;
    }
    // The lock counts only while the file still has the name.
    bool locked = lock_claimed(fd);
    if (locked && is_named(fd, claim->path))
        return fd;
    close(fd);
    if (locked)
        return GONE;
    refuse_claimed(claim->path, status);
    return -1;
}

static bool lock(OutputClaim *claim, Status *status)
{
    enum { TRIES = 100 }; // each fails only if another program created or replaced it just then
    for (int i = 0; i < TRIES; i++) {
        struct stat facts;
        // Each try looks anew at what the name stands for.
        if (!check(claim->path, claim->mark, &facts, status))
            return false;
        claim->device = S_ISCHR(facts.st_mode);
        claim->waits = facts.st_mode == 0;
        if (claim->device)
            return true;
        // Without a file the lock is on its temporary.
        claim->fd = claim->waits ? lock_temporary(claim, status) : lock_file(claim, status);
        if (claim->fd != GONE)
            return claim->fd >= 0;
    }
    claim->fd = -1;
    return refuse_claimed(claim->path, status);
}

// True if the locked file still has its name, and no file has appeared where there was none.
static bool is_locked(const OutputClaim *claim)
{
    struct stat facts;
    // A device is never locked.
    if (claim->device || claim->fd < 0)
        return claim->device;
    if (!claim->waits)
        return is_named(claim->fd, claim->path);
    // Nothing was written yet: the temporary must have its name, and nobody else the path.
    char *temporary = temporary_of(claim->path);
    bool locked = is_named(claim->fd, temporary) && lstat(claim->path, &facts) != 0;
    free(temporary);
    return locked;
}

static void unlock(OutputClaim *claim)
{
    if (claim->fd < 0)
        return;
    char *temporary = temporary_of(claim->path);
    if (claim->waits && is_named(claim->fd, temporary))
        unlink(temporary);
    free(temporary);
    close(claim->fd);
    claim->fd = -1;
}

bool output_claim(OutputClaim *claim, const char *path, const char *mark, Status *status)
{
    *claim = (OutputClaim){.path = path, .mark = mark, .fd = -1};
    return lock(claim, status);
}

void output_release(OutputClaim *claim)
{
    if (claim->path != NULL)
        unlock(claim);
    *claim = (OutputClaim){.fd = -1};
}

bool output_begin_claimed(Output *output, OutputClaim *claim, Status *status)
{
    // The locked file was removed or replaced by another program: claim the name again.
    *output = (Output){.fd = -1};
    if (!is_locked(claim)) {
        unlock(claim);
        if (!lock(claim, status))
            return false;
    }
    if (!claim->waits && !output_begin(output, claim->path, claim->mark, status))
        return false;
    // The first output of a claim is the temporary that the claim has locked.
    if (claim->waits) {
        *output = (Output){
            .fd = claim->fd, .path = strdup(claim->path), .temporary = temporary_of(claim->path)};
        ASSERT(output->path != NULL);
        claim->fd = -1;
    }
    output->claim = claim;
    return true;
}

FILE *output_begin_text(Output *output, const char *path, const char *mark, Status *status)
{
    if (!output_begin(output, path, mark, status))
        return NULL;
    int fd = fcntl(output->fd, F_DUPFD_CLOEXEC, 0); // the lock belongs to both
    FILE *text = fd >= 0 ? fdopen(fd, "w") : NULL;
    if (text != NULL)
        return text;
    status_fail(status, STATUS_FAILED, "%s: %s", path, strerror(errno));
    if (fd >= 0)
        close(fd);
    output_abandon(output);
    return NULL;
}

bool output_end_text(Output *output, FILE *text, bool whole, bool durable, Status *status)
{
    // Report the reason of the first failure, whichever call had it.
    int error = errno;
    bool written = fflush(text) == 0 && !ferror(text);
    if (whole && !written)
        error = errno;
    whole = fclose(text) == 0 && written && whole;
    if (whole)
        return output_commit(output, durable, status);
    status_fail(status, STATUS_FAILED, "%s: cannot be written: %s", output->path, strerror(error));
    output_abandon(output);
    return false;
}
