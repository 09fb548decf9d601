// SPDX-License-Identifier: MIT
#include "study/parts.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum {
    NAME = 64,
    MOST_STARTS = 3,       // a part that ends its process this often is lost
    AGAIN_US = 200 * 1000, // between two looks at what other processes do
};

#define COMPLETE "complete"

static void path_of(const Parts *parts, const char *name, const char *ending,
                    char path[RESULTS_PATH])
{
    snprintf(path, RESULTS_PATH, "%.*s/%.*s%s", RESULTS_PATH - 2 * NAME, parts->folder, NAME, name,
             ending);
}

static void name_of(const char *kind, int task, char name[NAME])
{
    snprintf(name, NAME, "%.40s-%03d", kind, task);
}

static bool lock(int file, short type, bool wait)
{
    struct flock whole = {.l_type = type, .l_whence = SEEK_SET};
    int result;
    do
        result = fcntl(file, wait ? F_OFD_SETLKW : F_OFD_SETLK, &whole);
    while (result != 0 && errno == EINTR);
    return result == 0;
}

void parts_wait(void)
{
    usleep(AGAIN_US);
}

// --- the study -----------------------------------------------------------------------------------

static bool fail(const Parts *parts, Status *status)
{
    return status_fail(status, STATUS_FAILED, "%s: %s", parts->folder, strerror(errno));
}

static void clear(const Parts *parts)
{
    static const char *const OURS[] = {".lock", ".part", ".new"};
    char path[RESULTS_PATH];
    DIR *folder = opendir(parts->folder);
    for (struct dirent *entry; folder != NULL && (entry = readdir(folder)) != NULL;)
        for (size_t i = 0; i < sizeof OURS / sizeof OURS[0]; i++) {
            const size_t length = strlen(entry->d_name), end = strlen(OURS[i]);
            if (length < end || length >= NAME ||
                strcmp(entry->d_name + length - end, OURS[i]) != 0)
                continue;
            path_of(parts, entry->d_name, "", path);
            unlink(path);
        }
    if (folder != NULL)
        closedir(folder);
}

// Writes the key into an empty file that no other process has opened; else it is read.
static bool agree_on_key(Parts *parts, const char *key, Status *status)
{
    char text[NAME] = "";
    for (int tries = 0; tries < 50; tries++) {
        // A reader's lock to take part, a writer's to say which study it is.
        if (!lock(parts->study, F_RDLCK, true))
            return fail(parts, status);
        const ssize_t got = pread(parts->study, text, sizeof text - 1, 0);
        if (got > 0)
            return strcmp(text, key) == 0 ||
                   status_fail(status, STATUS_INVALID,
                               "%s: of another scene, options or program: begin again without "
                               "--continue, or name another folder with --out",
                               parts->folder);
        if (lock(parts->study, F_WRLCK, false))
            return (pwrite(parts->study, key, strlen(key), 0) == (ssize_t)strlen(key) &&
                    lock(parts->study, F_RDLCK, false)) ||
                   fail(parts, status);
        lock(parts->study, F_UNLCK, false);
        parts_wait();
    }
    errno = EAGAIN;
    return fail(parts, status);
}

static bool open_study(Parts *parts, const char *key, bool fresh, Status *status)
{
    char path[RESULTS_PATH];
    path_of(parts, "study", "", path);
    if (mkdir(parts->folder, 0777) != 0 && errno != EEXIST)
        return fail(parts, status);
    parts->study = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (parts->study < 0)
        return fail(parts, status);
    if (fresh) {
        if (!lock(parts->study, F_WRLCK, false))
            return status_fail(status, STATUS_INVALID,
                               "%s: another process runs this study: take part with --continue",
                               parts->folder);
        clear(parts);
        path_of(parts, COMPLETE, "", path);
        unlink(path);
        if (ftruncate(parts->study, 0) != 0)
            return fail(parts, status);
    }
    return agree_on_key(parts, key, status);
}

bool parts_open(Parts *parts, const char *folder, uint64_t key, bool fresh, Status *status)
{
    char text[NAME];
    *parts = (Parts){.study = -1};
    results_path(parts->folder, folder, "parts");
    snprintf(text, sizeof text, "pliant-study %016" PRIx64 "\n", key);
    if (open_study(parts, text, fresh, status))
        return true;
    parts_close(parts);
    return false;
}

void parts_close(Parts *parts)
{
    if (parts->study >= 0)
        close(parts->study);
    parts->study = -1;
}

bool parts_complete(const Parts *parts)
{
    char path[RESULTS_PATH];
    path_of(parts, COMPLETE, "", path);
    return access(path, F_OK) == 0;
}

void parts_finish(const Parts *parts)
{
    char path[RESULTS_PATH];
    // First: whoever finds a part or a claim gone looks for this.
    path_of(parts, COMPLETE, "", path);
    const int file = open(path, O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
    if (file < 0)
        return; // the parts still say it
    close(file);
    clear(parts);
}

// --- one part ------------------------------------------------------------------------------------

int parts_claim(const Parts *parts, const char *name)
{
    char path[RESULTS_PATH];
    path_of(parts, name, ".lock", path);
    const int file = open(path, O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (file < 0 || lock(file, F_WRLCK, false))
        return file;
    close(file);
    return -1;
}

void parts_release(int claim)
{
    close(claim);
}

bool parts_load(const Parts *parts, const char *kind, int task, void *result, size_t bytes)
{
    char name[NAME], path[RESULTS_PATH];
    name_of(kind, task, name);
    path_of(parts, name, ".part", path);
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return false;
    // A file is whole, since it was renamed; another size would be of a disk that was full.
    const bool whole = fread(result, 1, bytes, file) == bytes && fgetc(file) == EOF;
    fclose(file);
    return whole;
}

static bool save(const Parts *parts, const char *name, const void *result, size_t bytes)
{
    char path[RESULTS_PATH], temporary[RESULTS_PATH];
    path_of(parts, name, ".part", path);
    path_of(parts, name, ".new", temporary);
    FILE *file = fopen(temporary, "wb");
    if (file == NULL)
        return false;
    bool ok = fwrite(result, 1, bytes, file) == bytes;
    ok = fclose(file) == 0 && ok;
    if (ok && rename(temporary, path) == 0)
        return true;
    unlink(temporary);
    return false;
}

// --- the tasks of a pool -------------------------------------------------------------------------

// What a child returns before the result.
typedef enum PartState {
    PART_BUSY,  // another process has claimed it
    PART_ENDED, // the result follows
} PartState;

typedef struct Envelope {
    _Alignas(max_align_t) PartState state;
} Envelope;

typedef struct Share {
    const Parts *parts;
    const char *kind;
    const Pool *pool;
    PartsLose *lose;
    int *task; // [count] tasks that have not ended
    int count, left;
} Share;

// Counts the starts of a part in the file of its claim; returns those before.
static int64_t note_start(int claim)
{
    struct stat facts;
    const int64_t before = fstat(claim, &facts) == 0 ? facts.st_size : 0;
    return write(claim, ".", 1) == 1 ? before : 0;
}

static void run_part(void *user, int index, void *envelope)
{
    const Share *share = user;
    const Pool *pool = share->pool;
    const int task = share->task[index];
    void *result = (Envelope *)envelope + 1;
    char name[NAME];
    name_of(share->kind, task, name);
    const int claim = parts_claim(share->parts, name);
    ((Envelope *)envelope)->state = PART_BUSY;
    if (claim < 0)
        return;
    // It may have ended before the claim.
    if (!parts_load(share->parts, share->kind, task, result, pool->result_bytes)) {
        memset(result, 0, pool->result_bytes);
        if (parts_complete(share->parts)) {
            parts_release(claim);
            return;
        }
        if (note_start(claim) >= MOST_STARTS)
            share->lose(pool->user, task, result, "its process died, each time that it was run");
        else
            pool->run(pool->user, task, result);
        save(share->parts, name, result, pool->result_bytes);
    }
    ((Envelope *)envelope)->state = PART_ENDED;
    parts_release(claim);
}

static void part_done(void *user, int index, const void *envelope, const char *why)
{
    Share *share = user;
    const Pool *pool = share->pool;
    const int task = share->task[index];
    if (envelope == NULL) {
        // The process of a child died: lost, unless another has claimed it.
        char name[NAME];
        name_of(share->kind, task, name);
        void *result = calloc(1, pool->result_bytes + 1);
        const int claim = parts_claim(share->parts, name);
        if (claim >= 0 && result != NULL) {
            share->lose(pool->user, task, result, why);
            save(share->parts, name, result, pool->result_bytes);
            pool->done(pool->user, task, result, NULL);
            share->task[index] = -1;
        }
        if (claim >= 0)
            parts_release(claim);
        free(result);
    } else if (((const Envelope *)envelope)->state == PART_ENDED) {
        pool->done(pool->user, task, (const Envelope *)envelope + 1, NULL);
        share->task[index] = -1;
    }
}

bool parts_run(const Parts *parts, const char *kind, const Pool *pool, PartsLose *lose,
               Status *status)
{
    if (parts == NULL)
        return pool_run(pool, status);
    Share share = {.parts = parts, .kind = kind, .pool = pool, .lose = lose};
    share.task = calloc((size_t)pool->task_count + 1, sizeof *share.task);
    if (share.task == NULL)
        return status_fail(status, STATUS_FAILED, "out of memory");
    for (int i = 0; i < pool->task_count; i++)
        share.task[share.left++] = i;
    Pool own = *pool;
    own.user = &share;
    own.result_bytes = sizeof(Envelope) + pool->result_bytes;
    own.run = run_part;
    own.done = part_done;
    bool ok = true;
    // All that is free; then look again at what others have claimed, until that has ended, too.
    while (ok && share.left > 0 && !parts_complete(parts)) {
        const int before = own.task_count = share.left;
        ok = pool_run(&own, status);
        share.left = 0;
        for (int i = 0; i < before; i++)
            if (share.task[i] >= 0)
                share.task[share.left++] = share.task[i];
        if (share.left == before)
            parts_wait();
    }
    free(share.task);
    return ok;
}
