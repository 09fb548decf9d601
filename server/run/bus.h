// Messages in and out: the only files that know LCM's sockets. The bus thread takes what arrives,
// checks it and hands it to the step thread; encodes, chunks and paces what the step thread hands
// out. It never touches the simulation's state.
#ifndef PLIANT_RUN_BUS_H
#define PLIANT_RUN_BUS_H

#include "files/scene.h"
#include "run/exchange.h"
#include "run/service.h"

typedef struct Bus Bus;

typedef struct BusCounts {
    int64_t received, published, rejected, failed; // failed: publishing that the system refused
    int64_t reason[REFUSAL_COUNT];
} BusCounts;

// Load time: all memory of the bus, from the world's arena. Everything outlives the bus.
Bus *bus_reserve(World *world, const Scene *scene, Exchange *exchange);
// Main thread: connects, refuses an output prefix that another daemon uses, subscribes. `describe`
// is the answer to DESCRIBE. False with `status`.
bool bus_connect(Bus *bus, const char *describe, const char *lcm_url, Status *status);
// The thread "pliant-bus". It tells `service` how the run does.
bool bus_start(Bus *bus, Service *service, Status *status);
// After the other threads have ended: publishes what they left and ends.
void bus_stop(Bus *bus);
// After bus_stop: whether the bus ended the run, because another daemon has held the prefix for
// longer.
bool bus_yielded(const Bus *bus);
BusCounts bus_counts(const Bus *bus);
// Leaves the network; the memory goes with the arena.
void bus_disconnect(Bus *bus);

#endif
