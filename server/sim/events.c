// SPDX-License-Identifier: MIT
// What happened in a tick or a cut, in a ring until it is taken. Step thread: no allocation, no
// lock.
#include "sim/events.h"

#include <stdarg.h>
#include <stdio.h>

// The newest are dropped if they are not taken.
void sim_report(Sim *sim, int body, const char *kind, const char *format, ...)
{
    EventRing *at = sim->events;
    if (at->count == SIM_EVENTS)
        return;
    SimEvent *event = &at->event[(at->first + at->count++) % SIM_EVENTS];
    *event = (SimEvent){.step = sim->clock->step, .body = body, .kind = kind};
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(event->text, sizeof event->text, format, arguments);
    va_end(arguments);
}

bool sim_take_event(Sim *sim, SimEvent *event)
{
    EventRing *at = sim->events;
    if (at->count == 0)
        return false;
    *event = at->event[at->first];
    at->first = (at->first + 1) % SIM_EVENTS;
    at->count--;
    return true;
}
