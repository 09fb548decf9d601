// SPDX-License-Identifier: MIT
#include "run/modes.h"

#include "base/clock.h"
#include "base/log.h"
#include "run/files_thread.h"
#include "run/ledger.h"
#include "run/realtime.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

struct Live {
    World *world;
    const Scene *scene;
    const LiveOptions *options;
    Exchange exchange;
    Loop loop;
    Bus *bus;
    FilesThread files;
    Recorder recorder;
    Service service;
    int done_fd, signal_fd;
    char *describe;
    Quota quota;
};

static bool open_input_log(Live *live, Status *status)
{
    InputLogHeader header = {.rate_hz = live->scene->sim.rate_hz,
                             .step = sim_steps(live->world->sim),
                             .inputs = world_inputs(live->world)};
    snprintf(header.scene, sizeof header.scene, "%s", live->scene->name);
    snprintf(header.prefix, sizeof header.prefix, "%s", live->scene->input_prefix);
    snprintf(header.isa, sizeof header.isa, "%s", live->options->isa);
    live->files.log = input_log_create(live->options->input_log_path, &header, status);
    return live->files.log != NULL;
}

static bool open_recording(Live *live, Status *status)
{
    live->files.recorder = &live->recorder;
    live->recorder.tools_apart = live->options->loop.record_tools_hz > 0.0;
    live->recorder.describe = live->describe;
    return recorder_create(&live->recorder, live->options->record_path, live->world, live->scene,
                           status);
}

// Does everything that can fail for external reasons, before the first thread starts.
static bool prepare(Live *live, Status *status)
{
    const LiveOptions *options = live->options;
    // What the main thread waits for: the end of the loop, and signals.
    live->done_fd = eventfd(0, EFD_CLOEXEC);
    live->signal_fd = signalfd(-1, &options->signals, SFD_CLOEXEC);
    if (live->done_fd < 0 || live->signal_fd < 0)
        return status_fail(status, STATUS_FAILED, "cannot wait for signals: %s", strerror(errno));
    if (!exchange_open(&live->exchange, status))
        return false;
    // The files thread needs to know what it writes about.
    live->files.world = live->world;
    live->files.scene = live->scene;
    live->files.exchange = &live->exchange;

    loop_init(&live->loop, live->world, live->scene, &live->exchange, &options->loop,
              live->done_fd);
    // The answer to DESCRIBE is made once: it never changes.
    live->describe = explain_describe(live->world, live->scene);
    // Claim the files last, after the prefix, so that a daemon that fails to start touches none.
    const BusOptions bus = {.describe = live->describe,
                            .lcm_url = options->lcm_url,
                            .service = &live->service,
                            .signals = &options->signals};
    return bus_connect(live->bus, &bus, status) &&
           (!live->exchange.checkpoints ||
            checkpoint_claim(&live->files.checkpoint, options->checkpoint_path, live->world,
                             status)) &&
           (!live->exchange.records || recording_claim(options->record_path, false, status)) &&
           (!live->exchange.logs_inputs || open_input_log(live, status)) &&
           (!live->exchange.records || open_recording(live, status));
}

// Whether ticks are in time, looked at once a second.
typedef struct Pace {
    int64_t next_ns, ticks, late; // when to look again; counts at the last look
    int64_t looked_ns;
    int slow, calm;  // seconds in a row with and without late ticks
    int64_t held_us; // by the quota, in the slow ones
    bool warned;
} Pace;

// Names what made ticks late, in the log and to the clients.
static void warn_of_pace(const Pace *pace, Live *live, double ticks)
{
    Exchange *exchange = &live->exchange;
    char cure[160] = "fewer nodes, larger cells, threads, or a lower rate_hz (pliant-monitor shows "
                     "the stages)";
    // Less is in the noise, as in late_share.
    if ((double)pace->held_us > 0.05e6 * pace->slow)
        snprintf(cure, sizeof cure,
                 "the processor quota of its control group (cpu.max %s) stopped it for %.1f s: "
                 "raise it (CPUQuota=, --cpus)",
                 live->quota.limit, 1e-6 * (double)pace->held_us);
    if (!atomic_load(&exchange->pace_told)) {
        snprintf(exchange->pace, sizeof exchange->pace,
                 "slower than real time for %d s: %.3g of %.0f ticks a second; %.120s", pace->slow,
                 ticks, live->scene->sim.rate_hz, cure);
        log_line(LOG_WARNING, "%s", exchange->pace);
        atomic_store(&exchange->pace_told, true);
    }
}

// Warns of a scene that has been slower than real time for two seconds, and again only when it has
// been in time for ten.
static void look_at_pace(Pace *pace, Live *live)
{
    enum { SLOW_SECONDS = 2, CALM_SECONDS = 10, AWAY_SECONDS = 2 };
    const double late_share = 0.05; // fewer are the machine's
    const int64_t now = clock_now_ns(), away = now - pace->looked_ns;
    pace->looked_ns = now;
    if (now < pace->next_ns)
        return;
    const int64_t ticks = atomic_load_explicit(&live->exchange.step, memory_order_relaxed),
                  late = atomic_load_explicit(&live->exchange.late, memory_order_relaxed);
    const int64_t done = ticks - pace->ticks, missed = late - pace->late, due = done + missed;
    // Nothing came due: a pause, lockstep, or a tick that takes longer than this.
    if (pace->next_ns > 0 && due == 0)
        return;
    // Not even this thread ran: what came due while the machine was suspended is not slow.
    if (away > AWAY_SECONDS * INT64_C(1000000000))
        pace->next_ns = 0;
    const double rate = live->scene->sim.rate_hz;
    const int seconds = (int)fmax(1.0, round((double)due / rate));
    const bool slow = pace->next_ns > 0 && (double)missed > late_share * (double)due;
    const int64_t held_us = quota_look(&live->quota);
    pace->slow = slow ? pace->slow + seconds : 0;
    pace->held_us = slow ? pace->held_us + held_us : 0;
    pace->calm = slow ? 0 : pace->calm + seconds;
    pace->warned &= pace->calm < CALM_SECONDS;
    if (pace->slow >= SLOW_SECONDS && !pace->warned) {
        pace->warned = true;
        warn_of_pace(pace, live, (double)done / seconds);
    }
    pace->ticks = ticks;
    pace->late = late;
    pace->next_ns = now + 1000000000;
}

// Waits until the loop ends by itself or by a signal.
static void wait_for_end(Live *live)
{
    Pace pace = {0};
    quota_find(&live->quota);
    struct pollfd fds[2] = {{.fd = live->done_fd, .events = POLLIN},
                            {.fd = live->signal_fd, .events = POLLIN}};
    while ((fds[0].revents & POLLIN) == 0) {
        look_at_pace(&pace, live);
        // Either the loop has ended, or there is a signal, or a second has gone.
        if (poll(fds, 2, 1000) <= 0 || (fds[1].revents & POLLIN) == 0)
            continue;
        struct signalfd_siginfo signal;
        if (read(live->signal_fd, &signal, sizeof signal) != sizeof signal)
            continue;
        // The step thread acts on it between two ticks.
        if (signal.ssi_signo != SIGUSR1)
            atomic_store(&live->exchange.stop, true);
        else if (live->options->checkpoint_path != NULL)
            atomic_store(&live->exchange.checkpoint_wanted, true);
        else
            log_line(LOG_WARNING, "SIGUSR1 without --checkpoint does nothing");
        exchange_wake(live->exchange.step_fd);
    }
}

static void collect(Live *live, LiveResult *result)
{
    const Exchange *exchange = &live->exchange;
    // The threads have ended: their counters are final.
    quota_look(&live->quota);
    *result = (LiveResult){.ticks = live->loop.ticks,
                           .late_ticks = live->loop.late_ticks,
                           .quota = live->quota,
                           .resets = sim_resets(live->world->sim),
                           .governor_actions = live->loop.governor.actions,
                           .governor_stage = live->loop.governor.reduction,
                           .step = live->loop.step_total,
                           .wake = live->loop.wake_total,
                           .bus = bus_counts(live->bus),
                           .requests_high = exchange->request.high_water,
                           .contacts_high = exchange->contact.high_water,
                           .events_high = exchange->event.high_water,
                           .answers_high = exchange->answer.high_water,
                           .applied_high = exchange->applied.high_water,
                           .lost = atomic_load(&exchange->lost),
                           .checkpoints = live->files.checkpoints,
                           .recorded = live->recorder.frames,
                           .recorded_lost = atomic_load(&exchange->recorded_lost),
                           .recorded_high = exchange->recorded.high_water};
}

// Closes everything; the arena keeps the memory.
static void finish(Live *live)
{
    if (live->files.log != NULL)
        input_log_close(live->files.log, sim_steps(live->world->sim), 0, &(Status){0});
    recorder_close(&live->recorder, &(Status){0});
    output_release(&live->files.checkpoint);
    bus_disconnect(live->bus);
    free(live->describe);
    exchange_close(&live->exchange);
    if (live->done_fd > 0)
        close(live->done_fd);
    if (live->signal_fd > 0)
        close(live->signal_fd);
}

// The bus stops last, so that the final messages of the other threads go out.
static bool run(Live *live, Status *status)
{
    bool with_files = live->options->checkpoint_path != NULL || live->files.log != NULL ||
                      live->files.recorder != NULL;
    // The bus first, so that the step thread's results have a receiver.
    if (!bus_start(live->bus, status))
        return false;
    bool whole = !with_files || files_thread_start(&live->files, status);
    if (whole && loop_start(&live->loop, status)) {
        // A service manager may now let others start.
        service_notify(&live->service, "READY=1\nSTATUS=started");
        wait_for_end(live);
        service_notify(&live->service, "STOPPING=1\nSTATUS=ending");
        loop_join(&live->loop);
    } else {
        whole = false;
    }
    // End in the order of the data: step, files, bus, and the recording that still gets its events.
    atomic_store(&live->exchange.step_ended, true);
    if (live->files.running && !files_thread_finish(&live->files, sim_steps(live->world->sim)))
        whole = status_fail(status, live->files.status.code, "%s", live->files.status.text);
    bus_stop(live->bus);
    // The daemon of the prefix that yielded reports it as a failure.
    if (whole && bus_yielded(live->bus))
        whole = status_fail(status, STATUS_FAILED,
                            "another daemon has held the prefix %s for longer: this one ended",
                            live->scene->prefix);
    return files_thread_close(&live->files, status) && whole;
}

ExchangeOptions live_exchange(const Scene *scene, const LiveOptions *options)
{
    return (ExchangeOptions){.velocity = scene->publish.velocity,
                             .rest = scene->publish.rest,
                             .errors = scene->publish.error_hz > 0.0,
                             .error_maps = scene->publish.error_map,
                             .elements = scene->publish.elements_hz > 0.0,
                             .checkpoints = options->checkpoint_path != NULL,
                             .logs_inputs = options->input_log_path != NULL,
                             .records = options->record_path != NULL,
                             .nodes_hz = scene->publish.nodes_hz,
                             .tools_hz = options->loop.record_tools_hz};
}

Live *live_reserve(World *world, const Scene *scene, const LiveOptions *options)
{
    Live *live = arena_allocate(&world->arena, ARENA_OUTPUT, 1, sizeof *live, "run/live");
    live->world = world;
    live->scene = scene;
    live->options = options;
    ExchangeOptions exchange = live_exchange(scene, options);
    exchange.ledger = ledger_bytes(world->sim, scene);
    // All memory that threads share, then what each needs for itself.
    exchange_create(&live->exchange, world, &exchange);
    live->bus = bus_reserve(world, scene, &live->exchange);
    if (exchange.records) {
        recorder_reserve(&live->recorder, world);
        recorder_reserve_maps(&live->recorder, &live->exchange, world);
    }
    return live;
}

bool live_run(Live *live, LiveResult *result, Status *status)
{
    service_open(&live->service);
    bool whole = prepare(live, status) && run(live, status);
    if (!whole)
        service_notify(&live->service, "STATUS=%s", status->text);
    service_close(&live->service);
    collect(live, result);
    finish(live);
    return whole;
}
