// Reports to a service manager that the daemon is ready, how it runs, that it is alive and that it
// ends, by the protocol of sd_notify: one datagram per message to the socket in NOTIFY_SOCKET.
// Alive means that the step thread makes progress: the bus thread watches the exchange's beat and
// stays silent if it stops. The step thread never calls this.
#ifndef PLIANT_RUN_SERVICE_H
#define PLIANT_RUN_SERVICE_H

#include "run/exchange.h"

#include <sys/socket.h>
#include <sys/un.h>

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

#endif
