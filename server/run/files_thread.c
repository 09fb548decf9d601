#include "run/files_thread.h"

#include "base/log.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <string.h>

// The step thread wakes nobody for a file (that would be a system call more in its tick).
enum { LOOK_EVERY_MS = 10 };

static void report(FilesThread *files, const Status *result, int64_t step)
{
    Exchange *exchange = files->exchange;
    EventOut event = {.step = step, .body = -1, .kind = "checkpoint"};
    if (result->code == STATUS_OK)
        snprintf(event.text, sizeof event.text, "step %lld written to %.150s", (long long)step,
                 files->checkpoint_path);
    else
        snprintf(event.text, sizeof event.text, "%.190s", result->text);

    for (int i = 0; i < exchange->asked_count; i++) {
        Answer answer = exchange->asked[i];
        answer.ok = result->code == STATUS_OK;
        answer.step = step;
        memcpy(answer.text, event.text, sizeof answer.text);
        if (!ring_push(&exchange->written, &answer))
            atomic_fetch_add_explicit(&exchange->lost, 1, memory_order_relaxed);
    }
    exchange->asked_count = 0;
    if (!ring_push(&exchange->files_event, &event))
        atomic_fetch_add_explicit(&exchange->lost, 1, memory_order_relaxed);
    exchange_wake(exchange->bus_fd);
}

static void write_checkpoint(FilesThread *files)
{
    Exchange *exchange = files->exchange;
    if (!exchange->checkpoints ||
        !atomic_load_explicit(&exchange->image_full, memory_order_acquire))
        return;
    Status result = {0};
    if (checkpoint_write(files->checkpoint_path, &exchange->image, files->world, files->scene,
                         &result))
        files->checkpoints++;
    else
        log_line(LOG_ERROR, "%s", result.text);
    files->status = result;
    report(files, &result, exchange->image.step);
    atomic_store_explicit(&exchange->image_full, false, memory_order_release);
}

static void write_inputs(FilesThread *files)
{
    if (files->log == NULL)
        return;
    const AppliedInput *applied;
    bool any = false;
    while ((applied = ring_peek(&files->exchange->applied)) != NULL) {
        input_log_write(files->log, applied);
        ring_pop(&files->exchange->applied);
        any = true;
    }
    if (any)
        input_log_flush(files->log);
}

static void *files_main(void *argument)
{
    FilesThread *files = argument;
    struct pollfd wake = {.fd = files->exchange->files_fd, .events = POLLIN};
    bool last = false;
    while (!last) {
        poll(&wake, 1, LOOK_EVERY_MS);
        exchange_clear(files->exchange->files_fd);
        last = atomic_load(&files->finish);
        write_inputs(files);
        write_checkpoint(files);
    }
    return NULL;
}

bool files_thread_start(FilesThread *files, Status *status)
{
    atomic_init(&files->finish, false);
    int error = pthread_create(&files->thread, NULL, files_main, files);
    if (error != 0)
        return status_fail(status, STATUS_FAILED, "cannot start the files thread: %s",
                           strerror(error));
    pthread_setname_np(files->thread, "pliant-files");
    files->running = true;
    return true;
}

bool files_thread_finish(FilesThread *files, int64_t step)
{
    atomic_store(&files->finish, true);
    exchange_wake(files->exchange->files_fd);
    pthread_join(files->thread, NULL);
    files->running = false;
    if (files->log != NULL) {
        int64_t lost = atomic_load(&files->exchange->applied_lost);
        if (lost > 0)
            log_line(LOG_WARNING, "the input log lacks %lld inputs: the disk was too slow",
                     (long long)lost);
        input_log_close(files->log, step, lost, &files->status);
        files->log = NULL;
    }
    return files->status.code == STATUS_OK;
}
