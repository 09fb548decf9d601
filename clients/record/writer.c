#include "writer.h"

#include "client.h"

#include <string.h>

enum { LOOK_EVERY_MS = 200 };

static void fail(Writer *writer, const Status *status)
{
    if (atomic_load(&writer->failed))
        return;
    writer->status = *status;
    atomic_store(&writer->failed, true);
}

// --- a file ---

static void begin(Writer *writer, Item *item)
{
    Status status = {0};
    writer->recording = recording_create(item->as.begin.path, &item->as.begin.options, &status);
    if (!writer->recording) {
        fail(writer, &status);
        item_destroy(item);
        return;
    }
    // A new file counts from 0.
    writer->begin = item;
    memset(writer->frames, 0, sizeof writer->frames);
    memset(writer->rows, 0, sizeof writer->rows);
    writer->events = writer->all_frames = 0;
    writer->first_time = writer->last_time = 0.0;
}

static void tell(const Writer *writer, const RecordingCounts *counts)
{
    const RecordingOptions *options = &writer->begin->as.begin.options;
    if (!writer->told)
        return;
    fprintf(writer->told, "recorded: %s, %.3f s\n", writer->begin->as.begin.path,
            writer->last_time - writer->first_time);
    // What is there of each body, and what is missing.
    for (int i = 0; i < options->body_count; i++) {
        const RecordingCounts none = {0}, *of = counts ? &counts[i] : &none;
        fprintf(writer->told,
                "body %s: frames %lld, lost %lld, dropped %lld, without mesh %lld, refused %lld\n",
                options->body[i].name, (long long)writer->frames[i], (long long)of->lost,
                (long long)of->dropped, (long long)of->without_mesh, (long long)of->refused);
    }
    for (int i = 0; i < options->tool_count; i++)
        fprintf(writer->told, "tool %d: rows %lld\n", options->tool[i], (long long)writer->rows[i]);
    fprintf(writer->told, "events: %lld\n", (long long)writer->events);
    fprintf(writer->told, "waited at most: %.1f MB\n", (double)writer->queue.most * 1e-6);
    fflush(writer->told);
}

static void end(Writer *writer, const RecordingCounts *counts)
{
    Status status = {0};
    if (!writer->recording)
        return;
    for (int i = 0; i < writer->begin->as.begin.options.body_count && counts; i++)
        recording_set_counts(writer->recording, i, &counts[i]);
    if (!recording_close(writer->recording, &status))
        fail(writer, &status);
    writer->recording = NULL;
    tell(writer, counts);
    item_destroy(writer->begin);
    writer->begin = NULL;
}

// --- items of a file ---

static void add_frame(Writer *writer, const Item *item)
{
    const RecordingFrame *frame = &item->as.frame;
    if (!recording_add_frame(writer->recording, item->index, frame))
        return;
    writer->frames[item->index]++;
    if (writer->all_frames++ == 0)
        writer->first_time = frame->time;
    writer->last_time = frame->time;
}

static void add(Writer *writer, const Item *item)
{
    Recording *recording = writer->recording;
    switch (item->kind) {
    case ITEM_TOPOLOGY:
        recording_add_topology(recording, item->index, &item->as.topology);
        break;
    case ITEM_FRAME:
        add_frame(writer, item);
        break;
    case ITEM_TOOL:
        writer->rows[item->index] +=
            recording_add_tool(recording, item->index, item->as.tool.time, &item->as.tool.sample);
        break;
    case ITEM_EVENT:
        writer->events += recording_add_event(recording, &item->as.event);
        break;
    default:
        break;
    }
}

static void take(Writer *writer, Item *item)
{
    bool failed = atomic_load(&writer->failed);
    if (item->kind == ITEM_BEGIN && !failed) {
        begin(writer, item);
        return;
    }
    if (item->kind == ITEM_END)
        end(writer, item->as.counts);
    else if (writer->recording && !failed)
        add(writer, item);
    item_destroy(item);
}

// --- the thread ---

static void *writer_main(void *user)
{
    Writer *writer = user;
    bool ended = false;
    while (!ended) {
        // Write what has come, and make it permanent once a second.
        Item *item = queue_take(&writer->queue, LOOK_EVERY_MS, &ended);
        if (item)
            take(writer, item);
        if (!writer->recording)
            continue;
        recording_flush_if_due(writer->recording, client_now_ns());
        const Status *said = recording_status(writer->recording);
        if (said->code != STATUS_OK)
            fail(writer, said);
    }
    end(writer, NULL);
    return NULL;
}

bool writer_start(Writer *writer, size_t limit, FILE *told, Status *status)
{
    *writer = (Writer){.told = told};
    queue_create(&writer->queue, limit);
    int error = pthread_create(&writer->thread, NULL, writer_main, writer);
    if (error == 0)
        return true;
    queue_destroy(&writer->queue);
    return status_fail(status, STATUS_FAILED, "cannot start the writing thread: %s",
                       strerror(error));
}

bool writer_failed(Writer *writer)
{
    return atomic_load(&writer->failed);
}

bool writer_finish(Writer *writer, Status *status)
{
    queue_close(&writer->queue);
    pthread_join(writer->thread, NULL);
    queue_destroy(&writer->queue);
    return !atomic_load(&writer->failed) ||
           status_fail(status, writer->status.code, "%s", writer->status.text);
}
