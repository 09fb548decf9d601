// SPDX-License-Identifier: MIT
#include "run/modes.h"

#include "base/clock.h"
#include "base/log.h"
#include "run/loop.h"
#include "run/realtime.h"
#include "run/files_thread.h"
#include "run/input_log.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct Offline {
    World *world;
    Sim *sim;
    const Scene *scene;
    const OfflineOptions *options;
    OfflineResult *result;
    Status *status;
    Replay replay;
    bool stopped; // by a signal
    WorldImage image;
    OutputClaim checkpoint;
    Recorder recorder;
    RecordFrame *frame; // to be recorded, or NULL
    LedgerClock clock;
    Ledger *ledger; // likewise
} Offline;

// Records an event that a live run would publish.
static void record_event(Offline *run, int body, const char *kind, const char *text)
{
    if (run->frame == NULL)
        return;
    EventOut event = {.step = sim_steps(run->sim), .body = body};
    snprintf(event.kind, sizeof event.kind, "%s", kind);
    snprintf(event.text, sizeof event.text, "%s", text);
    recorder_write_event(&run->recorder, &event);
}

static void record_grasps(Offline *run)
{
    GraspEvent event;
    while (sim_next_grasp(run->sim, &event)) {
        char text[GRASP_TEXT];
        grasp_text(run->sim, &event, text);
        record_event(run, event.body, grasp_kind(&event), text);
    }
}

// Records the events of the simulation itself.
static void record_sim_events(Offline *run)
{
    SimEvent event;
    while (sim_take_event(run->sim, &event))
        record_event(run, event.body, event.kind, event.text);
}

// Records an input of the log and its result.
static void record_input(void *user, int body, const char *kind, const char *text)
{
    Offline *run = user;
    record_event(run, body, kind, text);
    record_sim_events(run);
}

// --- the run ---

static bool write_checkpoint(Offline *run)
{
    world_image_take(&run->image, run->world);
    return checkpoint_write_claimed(&run->checkpoint, &run->image, run->world, run->status);
}

static bool claim_checkpoint(Offline *run)
{
    const char *path = run->options->checkpoint_path;
    return path == NULL || checkpoint_claim(&run->checkpoint, path, run->world, run->status);
}

static bool record_ledger(Offline *run, bool now)
{
    if (run->ledger == NULL || !ledger_is_due(&run->clock, run->sim, now))
        return true;
    ledger_draw(run->ledger, run->sim, run->scene);
    if (recording_add_lines(run->recorder.recording, RECORDING_LEDGERS, run->ledger->line,
                            run->ledger->count))
        return true;
    const Status *said = recording_status(run->recorder.recording);
    return status_fail(run->status, said->code, "%s", said->text);
}

static bool open_recording(Offline *run)
{
    if (run->options->record_path == NULL)
        return true;
    run->frame = malloc(record_frame_bytes(run->sim));
    run->recorder.tools_apart = run->options->record_tools_hz > 0.0;
    if (run->frame == NULL)
        return status_fail(run->status, STATUS_FAILED, "out of memory");
    char *describe = explain_describe(run->world, run->scene);
    run->recorder.describe = describe;
    const bool ok = recorder_create(&run->recorder, run->options->record_path, run->world,
                                    run->scene, run->status);
    free(describe);
    run->recorder.describe = NULL;
    run->clock = ledger_clock(run->sim);
    if (ok && run->clock.on)
        run->ledger = malloc(ledger_bytes(run->sim, run->scene));
    return ok && record_ledger(run, true);
}

// Records the tools if they have a rate of their own.
static bool record_tools(Offline *run)
{
    if (run->frame == NULL || !run->recorder.tools_apart)
        return true;
    record_frame_begin(run->frame, run->sim);
    if (recorder_write_tools(&run->recorder, run->frame))
        return true;
    const Status *said = recording_status(run->recorder.recording);
    return status_fail(run->status, said->code, "%s", said->text);
}

// An offline run waits for the file; a file that accepts no more data ends the run.
static bool record(Offline *run)
{
    if (run->frame == NULL)
        return true;
    record_frame_take(run->frame, run->sim);
    bool ok = true;
    for (int i = 0; i < sim_body_count(run->sim) && ok; i++)
        ok = recorder_follow_mesh(&run->recorder, i, &sim_body(run->sim, i)->mesh, NULL);
    if (ok && recorder_write_frame(&run->recorder, run->frame) &&
        recording_flush_if_due(run->recorder.recording, clock_now_ns()))
        return true;
    const Status *said = recording_status(run->recorder.recording);
    return status_fail(run->status, said->code, "%s", said->text);
}

static bool close_recording(Offline *run)
{
    if (run->recorder.recording != NULL)
        record_ledger(run, true);
    free(run->ledger);
    run->result->recorded = run->recorder.frames;
    free(run->frame);
    Status result = {0};
    return recorder_close(&run->recorder, &result) ||
           status_fail(run->status, result.code, "%s", result.text);
}

static bool take_signals(Offline *run)
{
    const struct timespec at_once = {0};
    int number;
    // Take all that have come, without waiting.
    while ((number = sigtimedwait(&run->options->signals, NULL, &at_once)) > 0) {
        if (number != SIGUSR1)
            run->stopped = true;
        else if (run->options->checkpoint_path == NULL)
            log_line(LOG_WARNING, "SIGUSR1 without --checkpoint does nothing");
        else if (!write_checkpoint(run))
            return false;
    }
    return true;
}

static bool run_ticks(Offline *run)
{
    enum { LOOK_FOR_SIGNALS_EVERY = 16 };
    double rate = run->scene->sim.rate_hz;
    int64_t checkpoint_ticks = loop_ticks(run->options->checkpoint_s, rate);
    for (;;) {
        // Inputs of this tick first; they may end the run.
        replay_due(&run->replay);
        if (run->stopped || run->replay.stopped || sim_steps(run->sim) >= run->replay.end_step)
            return true;
        // The tick itself.
        int64_t begin_ns = clock_now_ns();
        sim_step(run->sim);
        record_sim_events(run);
        histogram_add(&run->result->step, clock_now_ns() - begin_ns);
        record_grasps(run);
        if (!record_ledger(run, false))
            return false;
        run->result->ticks++;
        // Then the files, each at its own rate.
        if (loop_due(sim_steps(run->sim), run->scene->publish.nodes_hz, rate) && !record(run))
            return false;
        if (loop_due(sim_steps(run->sim), run->options->record_tools_hz, rate) &&
            !record_tools(run))
            return false;
        if (checkpoint_ticks > 0 && sim_steps(run->sim) % checkpoint_ticks == 0 &&
            !write_checkpoint(run))
            return false;
        // Signals need not be looked for at every tick.
        if (run->result->ticks % LOOK_FOR_SIGNALS_EVERY == 0 && !take_signals(run))
            return false;
    }
}

bool offline_run(World *world, const Scene *scene, const OfflineOptions *options,
                 OfflineResult *result, Status *status)
{
    Offline *run = calloc(1, sizeof *run);
    if (run == NULL)
        return status_fail(status, STATUS_FAILED, "out of memory");
    *result = (OfflineResult){0};
    run->world = world;
    run->sim = world->sim;
    run->scene = scene;
    run->options = options;
    run->result = result;
    run->status = status;
    // The log decides on the end, or a number of ticks does.
    const ReplayOptions replay = {.input = options->input,
                                  .to_its_end = options->to_log_end,
                                  .tell = record_input,
                                  .user = run};
    int64_t end_step = options->to_log_end
                           ? INT64_MAX
                           : sim_steps(world->sim) + llround(options->seconds * scene->sim.rate_hz);
    if (options->checkpoint_path != NULL)
        world_image_reserve(&run->image, &world->arena, world);

    // Refuse a log, target or file that does not fit before the first tick.
    bool whole = replay_begin(&run->replay, world, scene, end_step, &replay, status) &&
                 claim_checkpoint(run) && open_recording(run) &&
                 realtime_start_team(world->team, false, status);
    realtime_pin_step(world->team, pthread_self());
    whole = whole && record(run) && run_ticks(run) &&
            (options->checkpoint_path == NULL || write_checkpoint(run));
    // Close what was begun, also after a failure.
    whole = close_recording(run) && whole;
    output_release(&run->checkpoint);
    if (whole)
        replay_report(&run->replay);
    result->applied = run->replay.applied;
    result->log_ended = options->input != NULL && !run->replay.waiting && !run->stopped;
    result->refused = gate_refused(&run->replay.gate);
    free(run);
    return whole;
}
