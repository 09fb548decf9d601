// SPDX-License-Identifier: MIT
#include "run/bus.h"

#include "base/log.h"
#include "run/loop.h"

#include <errno.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
    LINE_SECONDS = 1,
    LOOKS_A_WATCHDOG = 4, // pings per watchdog period
};

static bool read_address(Service *service, const char *name)
{
    size_t length = strlen(name);
    struct sockaddr_un *address = &service->address;
    address->sun_family = AF_UNIX;
    if ((name[0] != '/' && name[0] != '@') || length < 2 || length >= sizeof address->sun_path) {
        log_line(LOG_WARNING, "NOTIFY_SOCKET '%s' is no path and no @name below %zu characters",
                 name, sizeof address->sun_path);
        return false;
    }
    memcpy(address->sun_path, name, length);
    if (name[0] == '@') // abstract socket: a leading zero byte instead of '@', no terminator
        address->sun_path[0] = '\0';
    service->address_size =
        (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length + (name[0] == '/' ? 1 : 0));
    return true;
}

// Returns the watchdog period; 0: none, or for another process.
static int64_t read_watchdog(void)
{
    const char *text = getenv("WATCHDOG_USEC"), *pid = getenv("WATCHDOG_PID");
    if (text == NULL || (pid != NULL && strtoll(pid, NULL, 10) != (long long)getpid()))
        return 0;
    char *end;
    errno = 0;
    long long us = strtoll(text, &end, 10);
    if (errno != 0 || end == text || *end != '\0' || us <= 0 || us > INT64_MAX / 1000) {
        log_line(LOG_WARNING, "WATCHDOG_USEC '%s' is no time in us", text);
        return 0;
    }
    return us * 1000;
}

void service_open(Service *service)
{
    *service = (Service){.fd = -1};
    const char *name = getenv("NOTIFY_SOCKET");
    // Nobody listens, or at an address that cannot be used.
    if (name == NULL || !read_address(service, name))
        return;
    service->fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (service->fd < 0) {
        log_line(LOG_WARNING, "cannot tell the service manager: %s", strerror(errno));
        return;
    }
    service->told = true;
    service->watchdog_ns = read_watchdog();
}

void service_close(Service *service)
{
    if (service->told)
        close(service->fd);
    service->told = false;
}

void service_notify(const Service *service, const char *format, ...)
{
    if (!service->told)
        return;
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (length >= (int)sizeof text)
        length = (int)sizeof text - 1;
    // Do not wait for a manager that does not read: it could not act anyway.
    if (length > 0)
        sendto(service->fd, text, (size_t)length, MSG_NOSIGNAL,
               (const struct sockaddr *)&service->address, service->address_size);
}

// --- while it runs ---

// Reports "running: 1000 of 1000 ticks a second, 3 late since start".
static void report_line(const Service *service, const Exchange *exchange, const StatusOut *status,
                        double rate_hz, int64_t now_ns)
{
    const int64_t step = atomic_load_explicit(&exchange->step, memory_order_relaxed);
    const int64_t late = atomic_load_explicit(&exchange->late, memory_order_relaxed);
    const double seconds = 1e-9 * (double)(now_ns - service->line_ns);
    if (status->state != RUN_RUNNING)
        service_notify(service, "STATUS=%s after %lld ticks", loop_state_name(status->state),
                       (long long)step);
    else
        service_notify(service,
                       "STATUS=running: %.0f of %.0f ticks a second, %lld late since start",
                       (double)(step - service->line_step) / seconds, rate_hz, (long long)late);
}

// Wakes an idle step thread, which sleeps until a request comes; it goes back to sleep. A running
// one does not notice.
static void ping(Service *service, const Exchange *exchange)
{
    const int64_t beat = atomic_load_explicit(&exchange->beat, memory_order_relaxed);
    if (beat != service->beat || atomic_load(&exchange->step_ended))
        service_notify(service, "WATCHDOG=1");
    else
        exchange_wake(exchange->step_fd);
    service->beat = beat;
}

void service_look(Service *service, Exchange *exchange, const StatusOut *status, double rate_hz,
                  int64_t now_ns)
{
    if (!service->told || now_ns < service_due_ns(service))
        return;
    if (service->watchdog_ns > 0 && now_ns >= service->next_look_ns) {
        ping(service, exchange);
        service->next_look_ns = now_ns + service->watchdog_ns / LOOKS_A_WATCHDOG;
    }
    if (now_ns >= service->next_line_ns) {
        if (service->line_ns != 0 && status != NULL) // the first call starts the count
            report_line(service, exchange, status, rate_hz, now_ns);
        service->line_step = atomic_load_explicit(&exchange->step, memory_order_relaxed);
        service->line_ns = now_ns;
        service->next_line_ns = now_ns + LINE_SECONDS * INT64_C(1000000000);
    }
}

int64_t service_due_ns(const Service *service)
{
    if (!service->told)
        return INT64_MAX;
    return service->watchdog_ns > 0 && service->next_look_ns < service->next_line_ns
               ? service->next_look_ns
               : service->next_line_ns;
}
