// SPDX-License-Identifier: MIT
// Messages in and out: the only files that use LCM's sockets (README.md, "What LCM does, and what
// we do about it"). The bus thread receives messages, checks them and hands them to the step
// thread. It encodes, chunks and paces what the step thread hands over. It never touches the
// simulation's state.
#ifndef PLIANT_RUN_BUS_H
#define PLIANT_RUN_BUS_H

#include "run/exchange.h"
#include "scene/scene.h"

#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>

// --- a service manager ---------------------------------------------------------------------------

// Reports to a service manager that the daemon is ready, how it runs, that it is alive and that it
// ends, by the protocol of sd_notify: one datagram per message to the socket in NOTIFY_SOCKET.
// Alive means that the step thread makes progress: the bus thread watches the exchange's beat and
// stays silent if it stops. The step thread never calls this.

typedef struct Service {
    bool told; // a service manager listens; the other members are valid only then
    int fd;
    struct sockaddr_un address;
    socklen_t address_size;
    // The members below are used by the bus thread alone.
    int64_t watchdog_ns; // the manager assumes that the daemon is dead after so long without a
                         // ping; 0: never
    int64_t beat;        // of the step thread, at the last ping
    int64_t next_look_ns, next_line_ns;
    int64_t line_step, line_ns; // of the last status line
} Service;

// Opens the socket from NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID; main thread, once. Warns of
// an unusable address, and then reports nothing.
void service_open(Service *service);
void service_close(Service *service);

// Sends "READY=1", "STATUS=..."; main thread.
void service_notify(const Service *service, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

// Pings if the step thread has progressed since the last ping, and wakes a sleeping one so that it
// can. Reports the state of the run every second; `status` may be NULL. Bus thread, at any rate.
void service_look(Service *service, Exchange *exchange, const StatusOut *status, double rate_hz,
                  int64_t now_ns);
// Returns the time of the next call that it needs [ns]; INT64_MAX: never.
int64_t service_due_ns(const Service *service);

// --- the bus -------------------------------------------------------------------------------------

typedef struct Bus Bus;

typedef struct BusCounts {
    int64_t received, published, refused, failed; // failed: publishing refused by the system
    int64_t reason[REFUSAL_COUNT];
} BusCounts;

// Allocates all memory of the bus from the world's arena. The arguments outlive the bus. Load time.
Bus *bus_reserve(World *world, const Scene *scene, Exchange *exchange);
typedef struct BusOptions {
    const char *describe, *lcm_url; // the answer to DESCRIBE; NULL: the scene's URL
    Service *service;               // hears the state of the run
    const sigset_t *signals;        // unblocked while there is no network
} BusOptions;

// Waits for a network, connects, refuses an output prefix that another daemon uses, and subscribes.
// Main thread. Returns false with `status` on failure.
bool bus_connect(Bus *bus, const BusOptions *options, Status *status);
// Starts the thread "pliant-bus".
bool bus_start(Bus *bus, Status *status);
// Publishes what the other threads have left and ends; call after they have ended.
void bus_stop(Bus *bus);
// True if the bus ended the run because another daemon has held the prefix for longer. Valid after
// bus_stop.
bool bus_yielded(const Bus *bus);
BusCounts bus_counts(const Bus *bus);
// Disconnects from the network; the arena frees the memory.
void bus_disconnect(Bus *bus);

#endif
