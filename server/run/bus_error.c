// SPDX-License-Identifier: MIT
// The error of bodies and of forces on tools out, and where on each body it is.
#include "run/bus_parts.h"

#include "base/clock.h"

#include "error_lines.h"

#include "pliant_error_map_t.h"

enum { NODES_IN_MAP_CHUNK = 16384 }; // 16 kB

static void send_error(Bus *bus, bool is_new)
{
    pliant_error_tool_t tool[ERROR_TOOLS];
    const ErrorOut *from = bus->error;
    pliant_error_t message = {.utime = clock_utime(),
                              .sequence = (int32_t)++bus->channel[OUT_ERROR]->sequence,
                              .step = from->step,
                              .time = from->time,
                              .num_bodies = bus->exchange->body_count,
                              .body = bus->body_error,
                              .tool = tool};
    for (int i = 0; i < message.num_bodies; i++) {
        const SimError *error = &from->body[i];
        bus->body_error[i] = (pliant_error_body_t){.name = sim_body(bus->sim, i)->name,
                                                   .space = error->space,
                                                   .steps = error->steps,
                                                   .total = error->total,
                                                   .relative = error->relative,
                                                   .age = error->age};
    }
    // Tools without force are not listed.
    for (int i = 0; i < bus->exchange->tool_count; i++) {
        const SimToolError *error = &from->tool[i];
        if (error->force > 0.0)
            tool[message.num_tools++] = (pliant_error_tool_t){
                .tool = sim_tool(bus->sim, i)->id,
                .force = error->force,
                .error = error->error,
                .share = error->error < 0.0 ? -1.0 : error->error / error->force};
    }
    bus_publish(bus, OUT_ERROR, 0, &message);
    if (!is_new || !bus->exchange->records)
        return;
    // A recording has it, too.
    Ledger *lines = ring_back(&bus->exchange->told_errors);
    if (lines == NULL) {
        atomic_fetch_add_explicit(&bus->exchange->lost, 1, memory_order_relaxed);
        return;
    }
    lines->count = error_lines(&message, lines->line);
    ring_publish(&bus->exchange->told_errors);
}

static void send_map_chunk(Bus *bus, int index)
{
    BodyStream *stream = &bus->body[index];
    const ErrorMap *map = stream->map;
    Pace *pace = &stream->map_pace;
    const int first = chunk_begin(map->node_count, pace->next, pace->count),
              end = chunk_begin(map->node_count, pace->next + 1, pace->count);
    const pliant_error_map_t message = {.utime = clock_utime(),
                                        .sequence =
                                            (int32_t)bus->channel[OUT_ERROR_MAP][index].sequence,
                                        .step = map->step,
                                        .topology = map->topology,
                                        .node_count = map->node_count,
                                        .chunk = pace->next,
                                        .chunk_count = pace->count,
                                        .first = first,
                                        .num_values = end - first,
                                        .share = (uint8_t *)(uintptr_t)(map->share + first)};
    bus_publish(bus, OUT_ERROR_MAP, index, &message);
    pace->next++;
}

// Takes the newest map of a body when the last one has left, and sends the chunks that are due.
static void send_map(Bus *bus, int index, int64_t now_ns)
{
    BodyStream *stream = &bus->body[index];
    if (!pace_is_under_way(&stream->map_pace)) {
        const ErrorMap *newest = slot_take(&bus->exchange->error_map[index]);
        stream->map = newest != NULL ? newest : stream->map;
        if (newest != NULL)
            bus_record_map(bus, RECORDING_ERROR_MAP, index, newest,
                           sizeof *newest + (size_t)newest->node_count);
        if (stream->map == NULL || (newest == NULL && !stream->map_wanted))
            return;
        stream->map_wanted = false;
        bus->channel[OUT_ERROR_MAP][index].sequence++;
        pace_start(&stream->map_pace, chunks_of(stream->map->node_count, NODES_IN_MAP_CHUNK),
                   bus->scene->publish.error_hz, now_ns);
    }
    while (pace_is_due(&stream->map_pace, now_ns))
        send_map_chunk(bus, index);
}

void bus_create_errors(Bus *bus, Arena *arena)
{
    if (bus->exchange->error.memory != NULL)
        bus->body_error = arena_allocate(arena, ARENA_OUTPUT, (size_t)bus->exchange->body_count,
                                         sizeof *bus->body_error, "run/errors");
}

void bus_send_errors(Bus *bus, int64_t now_ns)
{
    if (bus->body_error == NULL)
        return;
    const ErrorOut *newest = slot_take(&bus->exchange->error);
    bus->error = newest != NULL ? newest : bus->error;
    // A request is answered ten times a second at most.
    const bool asked = bus->error_wanted && now_ns >= bus->error_ns + BUS_AGAIN_NS;
    if (bus->error != NULL && (newest != NULL || asked)) {
        send_error(bus, newest != NULL);
        bus->error_ns = now_ns;
        bus->error_wanted = false;
    }
    for (int i = 0; i < bus->exchange->body_count && bus->exchange->error_map != NULL; i++)
        if (bus->exchange->error_map[i].memory != NULL)
            send_map(bus, i, now_ns);
}

void bus_restart_errors(Bus *bus)
{
    bus->error_wanted = true;
    for (int i = 0; i < bus->exchange->body_count; i++)
        bus->body[i].map_wanted = true;
}
