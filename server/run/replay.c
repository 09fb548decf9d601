// SPDX-License-Identifier: MIT
#include "run/input_log.h"

#include "base/log.h"
#include "run/requests.h"

#include "pliant_command_t.h"

#include <string.h>

static void tell(Replay *replay, int body, const char *kind, const char *text)
{
    if (replay->options.tell != NULL)
        replay->options.tell(replay->options.user, body, kind, text);
}

static bool speaks(const Replay *replay)
{
    return !replay->options.quiet;
}

// Uses a truncated log (its writer was killed) as far as it goes.
static void read_ahead(Replay *replay)
{
    InputLogReader *input = replay->options.input;
    Status broken = {0};
    // Look at the next input, and when it is due.
    replay->waiting = input_log_next(input, replay->rate_hz, replay->first_step, &replay->kind,
                                     &replay->waiting_step, &broken);
    // A log that was cut off is used as far as it goes.
    if (broken.code != STATUS_OK && speaks(replay))
        log_line(LOG_WARNING, "%s; continuing without the rest", broken.text);
    // The last input has been read: where does the run end?
    if (replay->waiting || (!input->ended && !replay->options.to_its_end))
        return;
    int64_t end = input->ended
                      ? input->end_step
                      // the tick that applies the last input is computed, too
                      : 1 + input_log_last_step(input, replay->rate_hz, replay->first_step);
    // At another rate the same time is another tick.
    if (input->ended && input->header.rate_hz != replay->rate_hz)
        end = llround((double)end / input->header.rate_hz * replay->rate_hz);
    if (end < replay->end_step)
        replay->end_step = end;
}

// Executes an input on the scene, or reports why it failed.
static void execute(Replay *replay, const Input *input)
{
    Answer answer = {0};
    bool done = requests_execute(replay->sim, input, &answer);
    tell(replay, input->index, done ? input_event(input) : "refused", answer.text);
    if (done)
        return;
    gate_count(&replay->gate, REFUSED_NOT_POSSIBLE);
    if (speaks(replay))
        log_line(LOG_WARNING, "step %lld: %s", (long long)sim_steps(replay->sim), answer.text);
}

// Offline runs ignore pacing, but STEP and RESUME also set when poses take effect.
static void apply_command(Replay *replay, const Input *input)
{
    const InputLogReader *log = replay->options.input;
    switch (input->command.kind) {
    // Offline there is no pace: only whether poses take effect at once matters.
    case PLIANT_COMMAND_T_STEP:
    case PLIANT_COMMAND_T_RESUME:
    case PLIANT_COMMAND_T_PAUSE:
        replay->lockstep = input->command.kind == PLIANT_COMMAND_T_STEP;
        sim_set_lockstep(replay->sim, replay->lockstep);
        if (!log->exact && !replay->ignored_pacing && speaks(replay))
            log_line(LOG_WARNING, "%s: PAUSE, RESUME and STEP do not change the pace offline",
                     log->log.path);
        replay->ignored_pacing = true;
        break;
    case PLIANT_COMMAND_T_STOP:
        replay->stopped = true;
        break;
    // The rest changes the scene as it did then.
    default:
        if (requests_change_scene(input))
            execute(replay, input);
    }
}

static void apply(Replay *replay, const Input *input)
{
    replay->applied++;
    // As the live run did it: poses to their tools, the rest through requests.
    if (input->kind == INPUT_POSE) {
        ToolPose pose = input_pose(input);
        sim_apply_pose(replay->sim, input->index, &pose, replay->lockstep);
    } else if (input->kind == INPUT_COMMAND) {
        apply_command(replay, input);
    } else {
        execute(replay, input);
    }
}

// The tools that were withdrawn then are inputs before it.
static void report_stop(Replay *replay)
{
    char text[64];
    snprintf(text, sizeof text, "for %.3f s", replay->options.input->stopped_s);
    tell(replay, -1, "stopped", text);
    if (speaks(replay))
        log_line(LOG_INFO, "step %lld: the logged run stood still %s",
                 (long long)sim_steps(replay->sim), text);
}

static void apply_waiting(Replay *replay)
{
    if (replay->kind == (InputKind)INPUT_LOG_STOPPED) {
        report_stop(replay);
        return;
    }
    const LogEvent *event = &replay->options.input->event;
    GateResult result = {.refusal = ACCEPTED};
    // An exact log holds what was accepted: check it again, but do not ask who owns what.
    if (replay->options.input->exact) {
        world_count_input(replay->world);
        result.refusal =
            input_decode(replay->kind, event->data, event->size, &result.input, result.why);
        if (result.refusal == ACCEPTED)
            result.refusal = input_check(&result.input, replay->sim, result.why);
        result.passage = result.refusal == ACCEPTED ? PASSAGE_OPEN : PASSAGE_REFUSED;
        if (result.refusal != ACCEPTED)
            gate_count(&replay->gate, result.refusal);
    } else {
        gate_pass(&replay->gate, replay->kind, event->data, event->size, event->timestamp, &result);
    }
    // Apply it, or say why not.
    if (result.passage == PASSAGE_OPEN) {
        apply(replay, &result.input);
        const Answer done = {
            .kind = result.input.kind, .sender = result.input.sender, .id = result.input.id};
        gate_answer(&replay->gate, &done);
    } else if (result.passage == PASSAGE_REFUSED) {
        tell(replay, -1, "refused", result.why);
        if (speaks(replay))
            log_line(LOG_WARNING, "step %lld: refused: %s", (long long)sim_steps(replay->sim),
                     result.why);
    }
}

void replay_due(Replay *replay)
{
    while (replay->waiting && replay->waiting_step <= sim_steps(replay->sim) && !replay->stopped) {
        apply_waiting(replay);
        read_ahead(replay);
    }
}

// Refuses a log that does not belong to this run, before the first tick.
static bool check_log(Replay *replay, const Scene *scene, Status *status)
{
    InputLogReader *input = replay->options.input;
    const InputLogHeader *header = &input->header;
    // A plain log has no header; its channels are those of the scene.
    if (!input->exact) {
        snprintf(input->prefix, sizeof input->prefix, "%s", scene->input_prefix);
        return true;
    }
    // The log must belong to this rate and begin where the run does.
    if (header->rate_hz != scene->sim.rate_hz && !replay->options.any_rate)
        return status_fail(status, STATUS_INVALID,
                           "%s: made at rate_hz %.17g, not %.17g: set it by --rate",
                           input->log.path, header->rate_hz, scene->sim.rate_hz);
    if (header->step > replay->first_step)
        return status_fail(status, STATUS_INVALID,
                           "%s: begins at step %lld, the run at %lld (--resume?)", input->log.path,
                           (long long)header->step, (long long)replay->first_step);
    if (header->step == replay->first_step && header->inputs > world_inputs(replay->world))
        return status_fail(status, STATUS_INVALID,
                           "%s: begins at step %lld after %lld inputs, the run after %lld of them",
                           input->log.path, (long long)header->step, (long long)header->inputs,
                           (long long)world_inputs(replay->world));
    // Another scene of the same physics may be meant.
    if (strcmp(header->scene, scene->name) != 0 && speaks(replay))
        log_line(LOG_WARNING, "%s: made with the scene '%s', not '%s'", input->log.path,
                 header->scene, scene->name);
    return true;
}

// Skips an input that the state already contains, except for its effect on lockstep.
static void pass_over(Replay *replay)
{
    const LogEvent *event = &replay->options.input->event;
    Input input;
    char why[INPUT_WHY_MAX];
    if (input_decode(replay->kind, event->data, event->size, &input, why) != ACCEPTED ||
        input.kind != INPUT_COMMAND)
        return;
    if (input.command.kind == PLIANT_COMMAND_T_STEP)
        replay->lockstep = true;
    if (input.command.kind == PLIANT_COMMAND_T_RESUME ||
        input.command.kind == PLIANT_COMMAND_T_PAUSE)
        replay->lockstep = false;
}

// Moves to the world's step, which may be inside the log when a run continues from a checkpoint.
static bool find_start(Replay *replay, Status *status)
{
    const InputLogReader *input = replay->options.input;
    int64_t done = world_inputs(replay->world);
    // Inputs of the first tick that the checkpoint has already.
    if (input->header.step == replay->first_step)
        done -= input->header.inputs;
    read_ahead(replay);
    // Pass over what the world has seen before.
    while (input->exact && replay->waiting &&
           (replay->waiting_step < replay->first_step ||
            (replay->waiting_step == replay->first_step && done > 0))) {
        if (replay->kind != (InputKind)INPUT_LOG_STOPPED) {
            done -= replay->waiting_step == replay->first_step;
            pass_over(replay);
        }
        read_ahead(replay);
    }
    // The log may begin in lockstep.
    sim_set_lockstep(replay->sim, replay->lockstep);
    return !input->ended || input->end_step >= replay->first_step || replay->options.any_rate ||
           status_fail(status, STATUS_INVALID, "%s: ends at step %lld, the run begins at %lld",
                       input->log.path, (long long)input->end_step, (long long)replay->first_step);
}

bool replay_begin(Replay *replay, World *world, const Scene *scene, int64_t end_step,
                  const ReplayOptions *options, Status *status)
{
    memset(replay, 0, sizeof *replay);
    replay->world = world;
    replay->sim = world->sim;
    replay->rate_hz = scene->sim.rate_hz;
    replay->options = *options;
    replay->first_step = sim_steps(world->sim);
    replay->end_step = end_step;
    // The gate holds for plain logs alone; exact ones have passed it.
    gate_init(&replay->gate, world->sim, scene->sim.tool_timeout_s, &world->arena);
    sim_set_lockstep(world->sim, false);
    if (options->input == NULL)
        return true;
    return check_log(replay, scene, status) && find_start(replay, status);
}

void replay_report(const Replay *replay)
{
    const InputLogReader *input = replay->options.input;
    if (input == NULL)
        return;
    // A log of other channels is likely a mistake.
    if (input->used == 0)
        log_line(LOG_WARNING,
                 "%s: none of its %lld messages is on %s_TOOL_POSE, _CUT, _LOAD, "
                 "_COMMAND or _TIE",
                 input->log.path, (long long)input->skipped, input->prefix);
    if (input->jumps > 0)
        log_line(LOG_WARNING,
                 "%s: its clock has %lld gaps or steps, the first of %.1f s after %.1f s: the run "
                 "waits through gaps, and what a step back repeats comes at once",
                 input->log.path, (long long)input->jumps, 1e-6 * (double)input->jump_us,
                 1e-6 * (double)input->jumped_us);
    if (input->lost > 0)
        log_line(LOG_WARNING, "%s: lacks %lld inputs, so the run is not the same", input->log.path,
                 (long long)input->lost);
    if (replay->waiting)
        log_line(LOG_INFO, "%s: the run ended before the log", input->log.path);
}
