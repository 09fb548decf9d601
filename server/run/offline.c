#include "run/offline.h"

#include "base/clock.h"
#include "base/log.h"
#include "run/grasp_text.h"
#include "run/loop.h"
#include "run/realtime.h"
#include "run/recorder.h"
#include "run/requests.h"

#include "pliant_command_t.h"

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
    Gate gate;
    bool lockstep; // poses hold at once
    bool stopped;  // by STOP or a signal
    bool ignored_pacing;
    int64_t first_step, end_step;
    // read ahead
    bool waiting;
    InputKind kind;
    int64_t waiting_step;
    CheckpointImage image;
    Recorder recorder;
    RecordFrame *frame; // to be recorded, or NULL
} Offline;

// What is an event in a live run, for the recording.
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

// --- the log ---

// A log that breaks off (its writer was killed) is used as far as it goes.
static void read_ahead(Offline *run)
{
    InputLogReader *input = run->options->input;
    Status broken = {0};
    run->waiting = input_log_next(input, run->scene->rate_hz, run->first_step, &run->kind,
                                  &run->waiting_step, &broken);
    if (broken.code != STATUS_OK)
        log_line(LOG_WARNING, "%s; going on without the rest", broken.text);
    if (!run->waiting && input->ended && input->end_step < run->end_step)
        run->end_step = input->end_step;
}

// What happened in the simulation itself.
static void record_sim_events(Offline *run)
{
    SimEvent event;
    while (sim_take_event(run->sim, &event))
        record_event(run, event.body, event.kind, event.text);
}

// Changes the scene, or says why not.
static void execute(Offline *run, const Input *input, const char *kind)
{
    Answer answer = {0};
    bool done = requests_execute(run->sim, input, &answer);
    bool on_body = input->kind == INPUT_LOAD || input->kind == INPUT_CUT;
    record_event(run, on_body ? input->index : -1, done ? kind : "refused", answer.text);
    record_sim_events(run);
    if (done)
        return;
    gate_count(&run->gate, REFUSED_NOT_POSSIBLE);
    log_line(LOG_WARNING, "step %lld: %s", (long long)sim_steps(run->sim), answer.text);
}

// Pacing means nothing off line; what STEP and RESUME say of poses does.
static void apply_command(Offline *run, const Input *input)
{
    switch (input->command.kind) {
    case PLIANT_COMMAND_T_STEP:
    case PLIANT_COMMAND_T_RESUME:
    case PLIANT_COMMAND_T_PAUSE:
        run->lockstep = input->command.kind == PLIANT_COMMAND_T_STEP;
        sim_set_lockstep(run->sim, run->lockstep);
        if (!run->options->input->exact && !run->ignored_pacing)
            log_line(LOG_WARNING, "%s: PAUSE, RESUME and STEP do not change the pace off line",
                     run->options->input->log.path);
        run->ignored_pacing = true;
        break;
    case PLIANT_COMMAND_T_STOP:
        run->stopped = true;
        break;
    case PLIANT_COMMAND_T_CHECKPOINT:
    case PLIANT_COMMAND_T_DESCRIBE:
        break;
    default:
        execute(run, input, input->command.kind == PLIANT_COMMAND_T_SET ? "set" : "reset");
    }
}

static void apply(Offline *run, const Input *input)
{
    run->result->applied++;
    if (input->kind == INPUT_POSE) {
        ToolPose pose = input_pose(input);
        sim_apply_pose(run->sim, input->index, &pose, run->lockstep);
    } else if (input->kind == INPUT_COMMAND) {
        apply_command(run, input);
    } else {
        execute(run, input, input->kind == INPUT_CUT ? "cut" : "load");
    }
}

// Messages of a plain log pass the same gate as live ones; those of an exact log have passed it.
static void apply_waiting(Offline *run)
{
    const LogEvent *event = &run->options->input->event;
    GateResult result = {.refusal = ACCEPTED};
    if (run->options->input->exact) {
        result.refusal =
            input_decode(run->kind, event->data, event->size, &result.input, result.why);
        if (result.refusal == ACCEPTED)
            result.refusal = input_validate(&result.input, run->sim, result.why);
        result.passage = result.refusal == ACCEPTED ? PASSAGE_OPEN : PASSAGE_REFUSED;
        if (result.refusal != ACCEPTED)
            gate_count(&run->gate, result.refusal);
    } else {
        gate_pass(&run->gate, run->kind, event->data, event->size, event->timestamp, &result);
    }
    if (result.passage == PASSAGE_OPEN) {
        apply(run, &result.input);
    } else if (result.passage == PASSAGE_REFUSED) {
        record_event(run, -1, "refused", result.why);
        log_line(LOG_WARNING, "step %lld: refused: %s", (long long)sim_steps(run->sim), result.why);
    }
}

// All inputs due at the start of the next tick.
static void apply_due(Offline *run)
{
    while (run->waiting && run->waiting_step <= sim_steps(run->sim) && !run->stopped) {
        apply_waiting(run);
        read_ahead(run);
    }
}

// A log that does not belong to this run is refused before the first tick.
static bool check_log(Offline *run)
{
    InputLogReader *input = run->options->input;
    const InputLogHeader *header = &input->header;
    if (!input->exact) {
        snprintf(input->prefix, sizeof input->prefix, "%s", run->scene->input_prefix);
        return true;
    }
    if (header->rate_hz != run->scene->rate_hz)
        return status_fail(run->status, STATUS_INVALID, "%s: made at rate_hz %.17g, not %.17g",
                           input->log.path, header->rate_hz, run->scene->rate_hz);
    if (header->step != run->first_step)
        return status_fail(run->status, STATUS_INVALID,
                           "%s: begins at step %lld, the run at %lld (--resume?)", input->log.path,
                           (long long)header->step, (long long)run->first_step);
    if (strcmp(header->scene, run->scene->name) != 0)
        log_line(LOG_WARNING, "%s: made with the scene '%s', not '%s'", input->log.path,
                 header->scene, run->scene->name);
    return true;
}

// --- the run ---

static bool write_checkpoint(Offline *run)
{
    checkpoint_take(&run->image, run->world);
    return checkpoint_write(run->options->checkpoint_path, &run->image, run->world, run->scene,
                            run->status);
}

static bool open_recording(Offline *run)
{
    if (run->options->record_path == NULL)
        return true;
    run->frame = malloc(record_frame_bytes(run->sim));
    return run->frame == NULL ? status_fail(run->status, STATUS_FAILED, "out of memory")
                              : recorder_create(&run->recorder, run->options->record_path,
                                                run->world, run->scene, run->status);
}

// Nobody waits for a tick here, so the file may take its time; one that takes no more ends the run.
static bool record(Offline *run)
{
    if (run->frame == NULL)
        return true;
    record_frame_take(run->frame, run->sim);
    bool ok = true;
    for (int i = 0; i < sim_body_count(run->sim) && ok; i++)
        ok = recorder_follow_mesh(&run->recorder, i, &sim_body(run->sim, i)->mesh);
    if (ok && recorder_write_frame(&run->recorder, run->frame) &&
        recording_flush_if_due(run->recorder.recording, clock_now_ns()))
        return true;
    const Status *said = recording_status(run->recorder.recording);
    return status_fail(run->status, said->code, "%s", said->text);
}

static bool close_recording(Offline *run)
{
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
    double rate = run->scene->rate_hz;
    int64_t checkpoint_ticks = loop_ticks(run->options->checkpoint_s, rate);
    for (;;) {
        apply_due(run);
        if (run->stopped || sim_steps(run->sim) >= run->end_step)
            return true;
        int64_t begin_ns = clock_now_ns();
        sim_step(run->sim);
        record_sim_events(run);
        histogram_add(&run->result->step, clock_now_ns() - begin_ns);
        record_grasps(run);
        run->result->ticks++;
        if (loop_due(sim_steps(run->sim), run->scene->publish.nodes_hz, rate) && !record(run))
            return false;
        if (checkpoint_ticks > 0 && sim_steps(run->sim) % checkpoint_ticks == 0 &&
            !write_checkpoint(run))
            return false;
        if (run->result->ticks % LOOK_FOR_SIGNALS_EVERY == 0 && !take_signals(run))
            return false;
    }
}

static void report_log(const Offline *run)
{
    const InputLogReader *input = run->options->input;
    if (input->used == 0)
        log_line(LOG_WARNING,
                 "%s: none of its %lld messages is on %s_TOOL_POSE, _CUT, _LOAD or "
                 "_COMMAND",
                 input->log.path, (long long)input->skipped, input->prefix);
    if (input->lost > 0)
        log_line(LOG_WARNING, "%s: lacks %lld inputs, so the run is not the same", input->log.path,
                 (long long)input->lost);
    if (run->waiting)
        log_line(LOG_INFO, "%s: the run ended before the log", input->log.path);
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
    run->first_step = sim_steps(world->sim);
    run->end_step = run->first_step + llround(options->seconds * scene->rate_hz);
    gate_init(&run->gate, world->sim, scene->tool_timeout_s, &world->arena);
    sim_set_lockstep(world->sim, false);
    if (options->checkpoint_path != NULL)
        checkpoint_reserve(&run->image, world);

    bool whole = (options->input == NULL || check_log(run)) && open_recording(run) &&
                 realtime_start_team(world->team, false, status);
    realtime_pin_step(world->team, pthread_self());
    if (whole && options->input != NULL)
        read_ahead(run);
    whole = whole && record(run) && run_ticks(run) &&
            (options->checkpoint_path == NULL || write_checkpoint(run));
    whole = close_recording(run) && whole;
    if (whole && options->input != NULL)
        report_log(run);
    result->rejected = gate_refused(&run->gate);
    free(run);
    return whole;
}
