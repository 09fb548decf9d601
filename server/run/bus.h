// Messages in and out: the only files that use LCM's sockets (README.md, "What LCM does, and what
// we do about it"). The bus thread receives messages, checks them and hands them to the step
// thread. It encodes, chunks and paces what the step thread hands over. It never touches the
// simulation's state.
#ifndef PLIANT_RUN_BUS_H
#define PLIANT_RUN_BUS_H

#include "scene/scene.h"
#include "run/exchange.h"
#include "run/service.h"

typedef struct Bus Bus;

typedef struct BusCounts {
    int64_t received, published, refused, failed; // failed: publishing refused by the system
    int64_t reason[REFUSAL_COUNT];
} BusCounts;

// Allocates all memory of the bus from the world's arena. The arguments outlive the bus. Load time.
Bus *bus_reserve(World *world, const Scene *scene, Exchange *exchange);
// Connects, refuses an output prefix that another daemon uses, and subscribes. `describe` is the
// answer to DESCRIBE. Main thread. Returns false with `status` on failure.
bool bus_connect(Bus *bus, const char *describe, const char *lcm_url, Status *status);
// Starts the thread "pliant-bus", which reports the state of the run to `service`.
bool bus_start(Bus *bus, Service *service, Status *status);
// Publishes what the other threads have left and ends; call after they have ended.
void bus_stop(Bus *bus);
// True if the bus ended the run because another daemon has held the prefix for longer. Valid after
// bus_stop.
bool bus_yielded(const Bus *bus);
BusCounts bus_counts(const Bus *bus);
// Disconnects from the network; the arena frees the memory.
void bus_disconnect(Bus *bus);

#endif
