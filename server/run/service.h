// What a service manager is told (the protocol of sd_notify: one datagram a message to the socket
// named in NOTIFY_SOCKET): that the daemon is ready, how it does, that it is alive and that it
// ends. Alive means that the step thread makes progress: the bus thread sees it in the exchange's
// beat, and says nothing when it does not. Never the step thread.
#ifndef PLIANT_RUN_SERVICE_H
#define PLIANT_RUN_SERVICE_H

#include "run/exchange.h"

#include <sys/socket.h>
#include <sys/un.h>

typedef struct Service {
    bool told; // somebody wants to be told; all else only then
    int fd;
    struct sockaddr_un address;
    socklen_t address_size;
    // The bus thread's own from here on.
    int64_t watchdog_ns; // we are taken for dead after so long without a ping; 0: never
    int64_t beat;        // of the step thread, at the last ping
    int64_t next_look_ns, next_line_ns;
    int64_t line_step, line_ns; // of the last status line
} Service;

// Main thread, once: from NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID. An address that cannot be
// used is warned of, and nobody is told.
void service_open(Service *service);
void service_close(Service *service);

// Main thread: sends "READY=1", "STATUS=...".
void service_tell(const Service *service, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

// Bus thread, as often as it likes: pings when the step thread has moved on since, and wakes one
// that rests, so that it can. Tells the state of the run every second; `status` may be NULL.
void service_look(Service *service, Exchange *exchange, const StatusOut *status, double rate_hz,
                  int64_t now_ns);
// When it wants to look again [ns]; INT64_MAX: never.
int64_t service_due_ns(const Service *service);

#endif
