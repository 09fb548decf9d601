// SPDX-License-Identifier: MIT
// The ledger out, from the lines that a recording gets, too.
#include "run/bus_parts.h"

#include "base/clock.h"

#include "pliant_ledger_t.h"

#include <string.h>

enum { AGAIN_NS = 1000000000 };

typedef struct Parts {
    pliant_ledger_body_t body[SCENE_BODIES];
    pliant_ledger_tissue_t tissue[LEDGER_TISSUES];
    pliant_ledger_region_t region[SCENE_SCORE_REGIONS];
} Parts;

static char *text(const char *from)
{
    return (char *)(uintptr_t)from;
}

static pliant_ledger_tissue_t tissue_of(const RecordingLedger *line)
{
    return (pliant_ledger_tissue_t){.body = text(line->body),
                                    .name = text(line->name),
                                    .density = line->value[LEDGER_DENSITY],
                                    .at_load = line->value[LEDGER_AT_LOAD],
                                    .attached = line->value[LEDGER_ATTACHED],
                                    .cut_off = line->value[LEDGER_CUT_OFF],
                                    .removed = line->value[LEDGER_REMOVED],
                                    .coagulated = line->value[LEDGER_COAGULATED]};
}

static pliant_ledger_region_t region_of(const RecordingLedger *line)
{
    return (pliant_ledger_region_t){.name = text(line->name),
                                    .keep = (line->flag & LEDGER_KEEP) != 0,
                                    .touched = (line->flag & LEDGER_TOUCHED) != 0,
                                    .margin = line->value[LEDGER_MARGIN],
                                    .distance = line->value[LEDGER_DISTANCE],
                                    .body = text(line->body),
                                    .by = text(line->by)};
}

static void send_ledger(Bus *bus)
{
    const Ledger *ledger = bus->ledger;
    Parts parts;
    pliant_ledger_t message = {.utime = clock_utime(),
                               .sequence = (int32_t)++bus->channel[OUT_LEDGER]->sequence,
                               .body = parts.body,
                               .tissue = parts.tissue,
                               .region = parts.region};
    for (int i = 0; i < ledger->count; i++) {
        const RecordingLedger *line = &ledger->line[i];
        message.step = line->step;
        message.time = line->time;
        if (line->line == LEDGER_BODY)
            parts.body[message.num_bodies++] =
                (pliant_ledger_body_t){.name = text(line->body),
                                       .solid = (line->flag & LEDGER_SOLID) != 0,
                                       .cut = line->value[LEDGER_CUT],
                                       .torn = line->value[LEDGER_TORN]};
        else if (line->line == LEDGER_TISSUE)
            parts.tissue[message.num_tissues++] = tissue_of(line);
        else
            parts.region[message.num_regions++] = region_of(line);
    }
    bus_publish(bus, OUT_LEDGER, 0, &message);
}

void bus_report_ledger(Bus *bus, int64_t now_ns)
{
    if (bus->exchange->ledger.memory == NULL)
        return;
    const Ledger *newest = slot_take(&bus->exchange->ledger);
    if (newest != NULL)
        bus->ledger = newest;
    // A request is answered ten times a second at most.
    const bool asked = bus->ledger_wanted && now_ns >= bus->ledger_ns + BUS_AGAIN_NS;
    if (bus->ledger == NULL || (newest == NULL && !asked && now_ns < bus->ledger_ns + AGAIN_NS))
        return;
    send_ledger(bus);
    bus->ledger_ns = now_ns;
    bus->ledger_wanted = false;
    // A recording has it, too.
    if (newest == NULL || !bus->exchange->records)
        return;
    Ledger *copy = ring_back(&bus->exchange->told_ledger);
    if (copy == NULL) {
        atomic_fetch_add_explicit(&bus->exchange->lost, 1, memory_order_relaxed);
        return;
    }
    memcpy(copy, newest, sizeof *newest + (size_t)newest->count * sizeof *newest->line);
    ring_publish(&bus->exchange->told_ledger);
}
