// SPDX-License-Identifier: MIT
// Shared by the client programs. One thread.
#include "program.h"

#include "receiver.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

bool program_fail(PliantError *error, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
    return false;
}

int64_t program_now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

// --- options ---

const ArgumentRow PROGRAM_WHERE[] = {
    {"lcm-url", 'l', ARGUMENT_TEXT, "URL", offsetof(PliantOptions, url),
     .help = "LCM network (default: LCM_DEFAULT_URL, else LCM's own default)"},
    {"prefix", 0, ARGUMENT_NAME, "NAME", offsetof(PliantOptions, prefix), .preset_text = "PLIANT",
     .help = "prefix of the channels"},
    {0}};

const ArgumentRow PROGRAM_INPUT_PREFIX[] = {
    {"input-prefix", 0, ARGUMENT_NAME, "NAME",
     .help = "prefix of tools and commands, if the scene has an input_prefix (default: as "
             "--prefix)"},
    {0}};

int program_read_numbers(const char *line, double *number, int most)
{
    int count = 0;
    for (const char *at = line;;) {
        // One number after the other, separated by blanks.
        while (isspace((unsigned char)*at))
            at++;
        if (!*at)
            return count;
        char *after;
        double value = strtod(at, &after);
        bool whole = after != at && (!*after || isspace((unsigned char)*after));
        if (!whole || !isfinite(value) || count == most)
            return -1;
        number[count++] = value;
        at = after;
    }
}

// --- signals ---

static volatile sig_atomic_t stop_signal;
static pid_t owner; // of the handler: not a child that has not yet become another program
static void (*volatile stop)(void *client);
static void *volatile stopped_client;

static void note_signal(int signal)
{
    void (*const end)(void *client) = stop;
    if (getpid() != owner) {
        struct sigaction usual = {.sa_handler = SIG_DFL};
        sigaction(signal, &usual, NULL);
        raise(signal);
        return;
    }
    stop_signal = signal;
    if (end)
        end(stopped_client);
}

void program_catch_signals(void)
{
    struct sigaction action = {.sa_handler = note_signal, .sa_flags = SA_RESTART};
    owner = getpid();
    for (int k = 0; k < 3; k++)
        sigaction((const int[]){SIGINT, SIGTERM, SIGHUP}[k], &action, NULL);
}

bool program_stopped(void)
{
    return stop_signal != 0;
}

bool program_stops(void (*end)(void *client), void *client)
{
    stop = NULL;
    stopped_client = client;
    stop = end;
    // A signal may have come before.
    if (end && program_stopped())
        end(client);
    return true;
}

bool program_await_network(const char *url, PliantError *error)
{
    Network network;
    char why[RECEIVER_WHY_MAX];
    if (!network_read(&network, url, why))
        return program_fail(error, "%s", why);
    for (bool said = false; !network_has_route(&network, why); said = true) {
        if (!said)
            fprintf(stderr, "waiting for a network: %s\n", why);
        // Not woken by a signal in between, it would sleep on.
        for (int k = 0; k < 10 && !program_stopped(); k++)
            nanosleep(&(struct timespec){.tv_nsec = 100000000}, NULL);
        if (program_stopped())
            return program_fail(error, "interrupted");
    }
    return true;
}

// --- printing ---

void program_print_text(FILE *out, const char *text, bool lines)
{
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        // C1 controls are c2 80 .. c2 9f in UTF-8; c2 is masked there.
        bool control = c < 0x20 || c == 0x7f || (c == 0xc2 && (unsigned char)text[1] < 0xa0);
        putc(control && !(lines && (c == '\n' || c == '\t')) ? '?' : c, out);
    }
}

void program_print_error(const char *program, const PliantError *error)
{
    fprintf(stderr, "%s: ", program);
    program_print_text(stderr, error->text, true); // it may quote the daemon
    fputc('\n', stderr);
}

// --- text files that a client writes -------------------------------------------------------------

enum { MARK_MOST = 128 };

static bool begins_with(int fd, const char *mark)
{
    char head[MARK_MOST];
    size_t length = strnlen(mark, sizeof head);
    return pread(fd, head, length, 0) == (ssize_t)length && memcmp(head, mark, length) == 0;
}

static bool check(const char *path, int fd, const struct stat *facts, const char *mark,
                  PliantError *error)
{
    return !S_ISREG(facts->st_mode) || facts->st_size == 0 || begins_with(fd, mark) ||
           program_fail(error, "%s: has other contents: it is not replaced", path);
}

bool program_may_write(const char *path, const char *mark, PliantError *error)
{
    struct stat facts;
    if (stat(path, &facts) != 0 || !S_ISREG(facts.st_mode))
        return true; // other faults show when it is written
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    bool ok = fd >= 0 ? check(path, fd, &facts, mark, error)
                      : program_fail(error, "%s: %s", path, strerror(errno));
    if (fd >= 0)
        close(fd);
    return ok;
}

FILE *program_open_output(const char *path, const char *mark, PliantError *error)
{
    struct stat facts;
    // Open a pipe normally: its reader may come later.
    bool regular = stat(path, &facts) != 0 || S_ISREG(facts.st_mode);
    int fd = open(path, (regular ? O_RDWR : O_WRONLY) | O_CREAT | O_CLOEXEC, 0666);
    bool ok = fd >= 0 && fstat(fd, &facts) == 0;
    if (!ok)
        program_fail(error, "%s: %s", path, strerror(errno));
    ok = ok && check(path, fd, &facts, mark, error);
    FILE *file = NULL;
    if (ok && ((S_ISREG(facts.st_mode) && ftruncate(fd, 0) != 0) || !(file = fdopen(fd, "w"))))
        program_fail(error, "%s: %s", path, strerror(errno));
    if (!file && fd >= 0)
        close(fd);
    return file;
}
