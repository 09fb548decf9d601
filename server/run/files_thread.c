// SPDX-License-Identifier: MIT
#include "run/files_thread.h"

#include "base/clock.h"
#include "base/log.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <string.h>

// The step thread does not wake this one, which would cost a system call per tick.
enum { LOOK_EVERY_MS = 10 };

static void tell(FilesThread *files, const EventOut *event)
{
    Exchange *exchange = files->exchange;
    if (!ring_push(&exchange->files_event, event))
        atomic_fetch_add_explicit(&exchange->lost, 1, memory_order_relaxed);
    exchange_wake(exchange->bus_fd);
}

// --- checkpoints and inputs ---

static void report(FilesThread *files, const Status *result, int64_t step)
{
    Exchange *exchange = files->exchange;
    EventOut event = {.step = step, .body = -1, .kind = "checkpoint"};
    // One sentence for the event and for all who asked.
    if (result->code == STATUS_OK)
        snprintf(event.text, sizeof event.text, "step %lld written to %.150s", (long long)step,
                 files->checkpoint.path);
    else
        snprintf(event.text, sizeof event.text, "%.190s", result->text);

    // Answer every request that this file serves.
    for (int i = 0; i < exchange->asked_count; i++) {
        Answer answer = exchange->asked[i];
        answer.ok = result->code == STATUS_OK;
        answer.step = step;
        memcpy(answer.text, event.text, sizeof answer.text);
        if (!ring_push(&exchange->written, &answer))
            atomic_fetch_add_explicit(&exchange->lost, 1, memory_order_relaxed);
    }
    exchange->asked_count = 0;
    tell(files, &event);
}

// Ends the log at the first failure; the run goes on.
static void check_log(FilesThread *files, int64_t step)
{
    Status said = {0};
    if (files->log_failed || input_log_whole(files->log, &said))
        return;
    files->log_failed = true;
    log_line(LOG_ERROR, "%s; the log ends", said.text);
    EventOut event = {.step = step, .body = -1, .kind = "inputs"};
    snprintf(event.text, sizeof event.text, "%.180s; ends", said.text);
    tell(files, &event);
}

// Says at once, in the log as well, that inputs found no room: it repeats the run no longer.
static bool mark_lack(FilesThread *files, int64_t step)
{
    const int64_t lost = atomic_load_explicit(&files->exchange->applied_lost, memory_order_relaxed);
    if (lost == files->inputs_lacking)
        return false;
    EventOut event = {.step = step, .body = -1, .kind = "inputs"};
    snprintf(
        event.text, sizeof event.text,
        "the log lacks %lld inputs so far, so it does not repeat the run: the disk is too slow",
        (long long)lost);
    if (files->inputs_lacking == 0)
        log_line(LOG_WARNING, "%s", event.text);
    files->inputs_lacking = lost;
    input_log_lacks(files->log, step, lost);
    tell(files, &event);
    return true;
}

static void write_inputs(FilesThread *files)
{
    if (files->log == NULL)
        return;
    const AppliedInput *applied;
    int64_t step = 0;
    bool any = false;
    // All that have been applied so far.
    while ((applied = ring_peek(&files->exchange->applied)) != NULL) {
        input_log_write(files->log, applied);
        step = applied->step;
        ring_pop(&files->exchange->applied);
        any = true;
    }
    // Make them permanent as far as the system can, once for all.
    any |= mark_lack(files, step);
    if (any) {
        input_log_flush(files->log);
        check_log(files, step);
    }
}

static void write_checkpoint(FilesThread *files)
{
    Exchange *exchange = files->exchange;
    if (!exchange->checkpoints ||
        !atomic_load_explicit(&exchange->image_full, memory_order_acquire))
        return;
    // Write the inputs before the image: the log of every checkpoint on disk then reaches it.
    write_inputs(files);
    if (files->log != NULL)
        input_log_sync(files->log);
    // The result goes to whoever asked; the image is free for the next one.
    Status result = {0};
    const bool faulty = exchange->image.fault != NULL, again = faulty && files->retries;
    if (checkpoint_write_claimed(&files->checkpoint, &exchange->image, files->world, &result))
        files->checkpoints++;
    else if (!again)
        log_line(LOG_ERROR, "%s; the checkpoint before it is kept", result.text);
    files->status = result;
    if (!again || exchange->asked_count > 0)
        report(files, &result, exchange->image.step);
    // A state that no run could start from: the next tick may end in a better one.
    files->retries = faulty;
    if (faulty)
        atomic_store_explicit(&exchange->checkpoint_wanted, true, memory_order_relaxed);
    atomic_store_explicit(&exchange->image_full, false, memory_order_release);
}

// --- recording ---

// Ends the recording at the first failure; the run goes on.
static void check_recording(FilesThread *files)
{
    const Status *said = recording_status(files->recorder->recording);
    if (files->recording_failed || said->code == STATUS_OK)
        return;
    files->recording_failed = true;
    log_line(LOG_ERROR, "%s; recording ends", said->text);
    EventOut event = {.step = files->step, .body = -1, .kind = "recording"};
    snprintf(event.text, sizeof event.text, "%.180s; ends", said->text);
    tell(files, &event);
}

// Reports dropped frames at most once per second.
static void report_lost(FilesThread *files, int64_t now_ns)
{
    int64_t lost = atomic_load_explicit(&files->exchange->recorded_lost, memory_order_relaxed);
    if (lost == files->lost_reported || files->recording_failed ||
        (files->lost_reported > 0 && now_ns - files->lost_reported_ns < 1000000000))
        return;
    files->lost_reported = lost;
    files->lost_reported_ns = now_ns;
    EventOut event = {.step = files->step, .body = -1, .kind = "recording"};
    snprintf(event.text, sizeof event.text, "%lld frames dropped so far: the disk is too slow",
             (long long)lost);
    tell(files, &event);
}

static void write_events(FilesThread *files)
{
    Ring *ring = &files->exchange->told;
    const EventOut *event;
    while ((event = ring_peek(ring)) != NULL) {
        recorder_write_event(files->recorder, event);
        ring_pop(ring);
    }
    Ring *const told[RECORDING_LISTS] = {[RECORDING_LEDGERS] = &files->exchange->told_ledger,
                                         [RECORDING_ERRORS] = &files->exchange->told_errors};
    for (int list = 0; list < RECORDING_LISTS; list++) {
        const Ledger *lines;
        while (told[list]->memory != NULL && (lines = ring_peek(told[list])) != NULL) {
            recording_add_lines(files->recorder->recording, list, lines->line, lines->count);
            ring_pop(told[list]);
        }
    }
}

// Writes tool samples with a rate of their own; else they come with the frames.
static void write_tools(FilesThread *files)
{
    Ring *ring = &files->exchange->recorded_tools;
    const RecordFrame *row;
    while (files->recorder->tools_apart && (row = ring_peek(ring)) != NULL) {
        recorder_write_tools(files->recorder, row);
        ring_pop(ring);
    }
}

static void write_frames(FilesThread *files)
{
    if (files->recorder == NULL)
        return;
    Exchange *exchange = files->exchange;
    // Write each frame with the meshes it needs; one that fails counts as lost.
    const RecordFrame *frame;
    while ((frame = ring_peek(&exchange->recorded)) != NULL) {
        files->step = frame->step;
        recorder_take_maps(files->recorder, exchange, frame->step, false);
        if (!recorder_take_meshes(files->recorder, exchange, frame) ||
            !recorder_write_frame(files->recorder, frame))
            atomic_fetch_add_explicit(&exchange->recorded_lost, 1, memory_order_relaxed);
        ring_pop(&exchange->recorded);
    }
    recorder_take_maps(files->recorder, exchange, files->step, true);
    // The other streams, then a flush once a second, and word of what went wrong.
    write_tools(files);
    write_events(files);
    int64_t now_ns = clock_now_ns();
    recording_flush_if_due(files->recorder->recording, now_ns);
    check_recording(files);
    report_lost(files, now_ns);
}

// --- the thread ---

static void *files_main(void *argument)
{
    FilesThread *files = argument;
    struct pollfd wake = {.fd = files->exchange->files_fd, .events = POLLIN};
    bool last = false;
    while (!last) {
        // Look once more after the end, for what came last.
        poll(&wake, 1, files->look_ms);
        exchange_clear(files->exchange->files_fd);
        last = atomic_load(&files->finish);
        write_inputs(files);
        write_frames(files);
        write_checkpoint(files);
    }
    return NULL;
}

bool files_thread_start(FilesThread *files, Status *status)
{
    atomic_init(&files->finish, false);
    files->look_ms = LOOK_EVERY_MS;
    // Look again before half of the waiting frames' ring is full.
    if (files->recorder != NULL) {
        double half_ms =
            500.0 * files->exchange->recorded.capacity / files->scene->publish.nodes_hz;
        if (half_ms < LOOK_EVERY_MS)
            files->look_ms = half_ms < 1.0 ? 1 : (int)half_ms;
    }
    // Frames that nobody takes would be dropped.
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
    // The thread writes what is left before it ends.
    atomic_store(&files->finish, true);
    exchange_wake(files->exchange->files_fd);
    pthread_join(files->thread, NULL);
    files->running = false;
    // A log that lacks inputs says so in its end mark.
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

bool files_thread_close(FilesThread *files, Status *status)
{
    if (files->recorder == NULL)
        return true;
    write_events(files);
    recorder_set_dropped(files->recorder, atomic_load(&files->exchange->recorded_lost));
    Status result = {0};
    bool whole = recorder_close(files->recorder, &result);
    return whole || status_fail(status, result.code, "%s", result.text);
}
