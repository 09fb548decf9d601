// SPDX-License-Identifier: MIT
// The ledger out, from the lines that a recording gets, too.
#include "run/bus_parts.h"

#include "base/clock.h"

#include "ledger_lines.h"

enum { AGAIN_NS = 1000000000 };

static void send_ledger(Bus *bus)
{
    LedgerParts parts;
    pliant_ledger_t message = ledger_message(bus->ledger->line, bus->ledger->count, &parts);
    message.utime = clock_utime();
    message.sequence = (int32_t)++bus->channel[OUT_LEDGER]->sequence;
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
