// SPDX-License-Identifier: MIT
// The elements at the surfaces of bodies out.
#include "run/bus_parts.h"

#include "base/clock.h"

#include <string.h>

#include "pliant_elements_t.h"

static void send_chunk(Bus *bus, int index)
{
    BodyStream *stream = &bus->body[index];
    const ElementsOut *from = stream->elements;
    Pace *pace = &stream->elements_pace;
    const int first = chunk_begin(from->square_count, pace->next, pace->count),
              end = chunk_begin(from->square_count, pace->next + 1, pace->count);
    const pliant_elements_t message = {.utime = clock_utime(),
                                       .sequence =
                                           (int32_t)bus->channel[OUT_ELEMENTS][index].sequence,
                                       .step = from->step,
                                       .topology = from->topology,
                                       .square_count = from->square_count,
                                       .chunk = pace->next,
                                       .chunk_count = pace->count,
                                       .first = first,
                                       .num_levels = from->levels,
                                       .num_squares = end - first,
                                       .elements = (int32_t *)(uintptr_t)from->at_level,
                                       .level = elements_levels(from) + first,
                                       .tag = (int16_t *)(uintptr_t)(from->tag + first)};
    bus_publish(bus, OUT_ELEMENTS, index, &message);
    pace->next++;
}

void bus_record_map(Bus *bus, RecordingMapKind kind, int body, const void *map, size_t bytes)
{
    if (!bus->exchange->records)
        return;
    void *copy = ring_back(&bus->exchange->told_map[kind][body]);
    if (copy == NULL) {
        atomic_fetch_add_explicit(&bus->exchange->lost, 1, memory_order_relaxed);
        return;
    }
    memcpy(copy, map, bytes);
    ring_publish(&bus->exchange->told_map[kind][body]);
}

// Takes the newest of a body when the last ones have left, and sends the chunks that are due.
static void send_elements(Bus *bus, int index, int64_t now_ns)
{
    BodyStream *stream = &bus->body[index];
    if (!pace_is_under_way(&stream->elements_pace)) {
        const ElementsOut *newest = slot_take(&bus->exchange->elements[index]);
        stream->elements = newest != NULL ? newest : stream->elements;
        if (newest != NULL)
            bus_record_map(bus, RECORDING_ELEMENTS, index, newest,
                           sizeof *newest +
                               (size_t)newest->square_count * (sizeof *newest->tag + 1));
        if (stream->elements == NULL || (newest == NULL && !stream->elements_wanted))
            return;
        stream->elements_wanted = false;
        bus->channel[OUT_ELEMENTS][index].sequence++;
        pace_start(&stream->elements_pace,
                   chunks_of(stream->elements->square_count, ROWS_IN_MAP_CHUNK),
                   bus->scene->publish.elements_hz, now_ns);
    }
    while (pace_is_due(&stream->elements_pace, now_ns))
        send_chunk(bus, index);
}

void bus_send_elements(Bus *bus, int64_t now_ns)
{
    for (int i = 0; i < bus->exchange->body_count && bus->exchange->elements != NULL; i++)
        if (bus->exchange->elements[i].memory != NULL)
            send_elements(bus, i, now_ns);
}

void bus_restart_elements(Bus *bus)
{
    for (int i = 0; i < bus->exchange->body_count; i++)
        bus->body[i].elements_wanted = true;
}
