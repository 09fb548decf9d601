// SPDX-License-Identifier: MIT
// Event logs of lcm-logger as recordings.
#include "log.h"

#include "base/check.h"
#include "live.h"

#include <errno.h>
#include <ftw.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PATH = 512, QUEUE_BYTES = 64000000 };

// The word with which every event of a log begins, and therefore the log.
static const unsigned char SYNC[4] = {0xed, 0xa1, 0xda, 0x01};

bool log_is_one(const char *path)
{
    unsigned char head[sizeof SYNC];
    FILE *file = fopen(path, "rbe");
    const bool is = file != NULL && fread(head, 1, sizeof head, file) == sizeof head &&
                    memcmp(head, SYNC, sizeof head) == 0;
    if (file != NULL)
        fclose(file);
    return is;
}

// The recordings that a conversion has made: one more for each restart of the daemon.
typedef struct Made {
    char folder[PATH];
    char *path[TIMELINE_PARTS];
    int count;
    bool damaged; // a log
} Made;

static bool add_made(Made *made, const char *path, Status *status)
{
    if (access(path, R_OK) != 0)
        return true;
    if (made->count == TIMELINE_PARTS)
        return status_fail(status, STATUS_INVALID, "more than %d recordings in the logs",
                           TIMELINE_PARTS);
    made->path[made->count++] = strdup(path);
    ASSERT(made->path[made->count - 1] != NULL);
    return true;
}

static bool convert(Made *made, const char *log, int number, const PliantOptions *client,
                    Status *status)
{
    char path[2 * PATH];
    PliantError error = {0};
    snprintf(path, sizeof path, "%s/%d.h5", made->folder, number);
    const LiveOptions options = {
        .client = *client,
        .queue_bytes = QUEUE_BYTES,
        .intake = {.path = path, .prefix = client->prefix, .input_prefix = client->prefix}};
    if (!convert_log(log, &options, &error)) {
        if (access(path, R_OK) != 0)
            return status_fail(status, STATUS_INVALID, "%s", error.text);
        fprintf(stderr, "pliant-play: %s: used as far as it goes\n", error.text);
        made->damaged = true;
    }
    bool ok = add_made(made, path, status);
    for (int k = 2; k <= INTAKE_FILES && ok; k++) {
        snprintf(path, sizeof path, "%s/%d.%d.h5", made->folder, number, k);
        if (access(path, R_OK) != 0)
            break;
        ok = add_made(made, path, status);
    }
    return ok;
}

static int remove_one(const char *path, const struct stat *facts, int type, struct FTW *where)
{
    (void)facts, (void)type, (void)where;
    remove(path);
    return 0;
}

Timeline *log_open(char *const *path, int count, const PliantOptions *client, bool *whole,
                   Status *status)
{
    const char *parent = getenv("TMPDIR");
    Made made = {0};
    snprintf(made.folder, sizeof made.folder, "%.400s/pliant-play-XXXXXX",
             parent != NULL ? parent : "/tmp");
    if (mkdtemp(made.folder) == NULL) {
        status_fail(status, STATUS_FAILED, "%s: %s", made.folder, strerror(errno));
        return NULL;
    }
    const int64_t begun = client_now_ns();
    bool ok = true;
    for (int i = 0; i < count && ok; i++)
        ok = convert(&made, path[i], i, client, status);
    Timeline *timeline = ok ? timeline_open(made.path, made.count, status) : NULL;
    if (timeline != NULL)
        printf("converted in %.1f s\n", (double)(client_now_ns() - begun) * 1e-9);
    *whole = !made.damaged;
    // The children have the files open.
    nftw(made.folder, remove_one, 8, FTW_DEPTH | FTW_PHYS);
    for (int i = 0; i < made.count; i++)
        free(made.path[i]);
    return timeline;
}
