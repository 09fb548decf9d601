// SPDX-License-Identifier: MIT
#include "run/loop.h"
#include "run/requests.h"

#include "base/clock.h"
#include "run/realtime.h"

#include "pliant_command_t.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const char RESET_DONE[] = "bodies returned to their start";

// --- effect of a request on the scene ---

static bool execute_cut(Sim *sim, const Input *input, Answer *answer)
{
    CutOptions cut = input_cut(input);
    CutOutcome outcome;
    answer->ok = sim_apply_cut(sim, &cut, &outcome, answer->text, sizeof answer->text);
    answer->separated = outcome.separated;
    answer->nodes_added = outcome.nodes_added;
    answer->pieces = outcome.pieces;
    return answer->ok;
}

static bool execute_load(Sim *sim, const Input *input, Answer *answer)
{
    LoadOptions load = input_load(input);
    if (!sim_apply_load(sim, &load, answer->text, sizeof answer->text))
        return false;
    snprintf(answer->text, sizeof answer->text, "load of (%g, %g, %g) N for %g s", load.force.x,
             load.force.y, load.force.z, load.duration);
    return true;
}

static bool execute_tie(Sim *sim, const Input *input, Answer *answer)
{
    const TieOptions tie = input_tie(input);
    return sim_apply_tie(sim, &tie, answer->text, sizeof answer->text);
}

// Tells what a SET would do, or what its key is now.
static bool try_set(Sim *sim, const Input *input, Answer *answer)
{
    const double *value = input->setting.value;
    char *text = answer->text;
    if (input->setting.count == 0)
        return sim_tell_setting(sim, input->text, text, INPUT_WHY_MAX);
    if (input->setting.count == 1)
        return sim_try_set(sim, input->text, value[0], &answer->longer, text, INPUT_WHY_MAX);
    return sim_try_gravity((Vec3){value[0], value[1], value[2]}, text, INPUT_WHY_MAX);
}

static bool execute_set(Sim *sim, const Input *input, Answer *answer)
{
    const double *value = input->setting.value;
    char *text = answer->text;
    bool vector = input->setting.count == 3;
    if (vector && strcmp(input->text, "gravity") != 0) {
        snprintf(text, INPUT_WHY_MAX, "%.80s wants one number", input->text);
        return false;
    }
    Vec3 gravity = {value[0], value[1], value[2]};
    if (input->setting.tries)
        return try_set(sim, input, answer);
    if (vector ? !sim_apply_gravity(sim, gravity, text, INPUT_WHY_MAX)
               : !sim_apply_set(sim, input->text, value[0], text, INPUT_WHY_MAX))
        return false;
    if (!vector)
        snprintf(text, INPUT_WHY_MAX, "%s = %g", input->text, value[0]);
    return true;
}

bool requests_change_scene(const Input *input)
{
    return input->kind != INPUT_COMMAND || input->command.kind == PLIANT_COMMAND_T_RESET ||
           (input->command.kind == PLIANT_COMMAND_T_SET && !input->setting.tries);
}

bool requests_execute(Sim *sim, const Input *input, Answer *answer)
{
    if (input->kind == INPUT_CUT)
        answer->ok = execute_cut(sim, input, answer);
    else if (input->kind == INPUT_LOAD)
        answer->ok = execute_load(sim, input, answer);
    else if (input->kind == INPUT_TIE)
        answer->ok = execute_tie(sim, input, answer);
    else if (input->command.kind == PLIANT_COMMAND_T_SET)
        answer->ok = execute_set(sim, input, answer);
    else if (input->command.kind == PLIANT_COMMAND_T_RESET) {
        sim_reset(sim);
        snprintf(answer->text, sizeof answer->text, "%s", RESET_DONE);
        answer->ok = true;
    } else {
        snprintf(answer->text, sizeof answer->text, "command %d does nothing to the scene",
                 input->command.kind);
        answer->ok = false;
    }
    return answer->ok;
}

// --- out ---

static void push_applied(Loop *loop, const AppliedInput *applied)
{
    Exchange *exchange = loop->exchange;
    if (exchange->logs_inputs && !ring_push(&exchange->applied, applied))
        atomic_fetch_add_explicit(&exchange->applied_lost, 1, memory_order_relaxed);
}

void requests_log(Loop *loop, const Input *input)
{
    world_count_input(loop->world);
    push_applied(loop, &(AppliedInput){.step = sim_steps(loop->sim), .input = *input});
}

void requests_log_stop(Loop *loop, double seconds)
{
    push_applied(loop, &(AppliedInput){.step = sim_steps(loop->sim), .stopped_s = seconds});
}

void requests_event(Loop *loop, int body, const char *kind, const char *format, ...)
{
    EventOut event = {.step = sim_steps(loop->sim), .body = body};
    snprintf(event.kind, sizeof event.kind, "%s", kind);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(event.text, sizeof event.text, format, arguments);
    va_end(arguments);
    // Events are lost rather than waited for.
    if (!ring_push(&loop->exchange->event, &event))
        atomic_fetch_add_explicit(&loop->exchange->lost, 1, memory_order_relaxed);
    loop->handed_over = true;
}

void requests_report(Loop *loop)
{
    SimEvent event;
    while (sim_take_event(loop->sim, &event))
        requests_event(loop, event.body, event.kind, "%s", event.text);
}

static bool is_try(const Input *input)
{
    return input->kind == INPUT_COMMAND && input->command.kind == PLIANT_COMMAND_T_SET &&
           input->setting.tries;
}

static Answer answer_to(const Loop *loop, const Input *input)
{
    // The pieces of the body that was meant, or of all.
    int pieces = 0;
    for (int i = 0; i < sim_body_count(loop->sim); i++)
        if (input->index < 0 || i == input->index)
            pieces += sim_pieces(loop->sim, i);
    return (Answer){.kind = input->kind,
                    .command = input->kind == INPUT_COMMAND ? input->command.kind : 0,
                    .sender = input->sender,
                    .id = input->id,
                    .ok = true,
                    .tries = is_try(input),
                    .step = sim_steps(loop->sim),
                    .pieces = pieces};
}

// The ring of answers has a slot for every request that the bus queues.
static void push_answer(Loop *loop, const Answer *answer)
{
    if (!ring_push(&loop->exchange->answer, answer))
        atomic_fetch_add_explicit(&loop->exchange->lost, 1, memory_order_relaxed);
    loop->handed_over = true;
}

// --- the time budget ---

static void set(Loop *loop, const char *key, double value)
{
    Input input = {.kind = INPUT_COMMAND,
                   .index = -1,
                   .command = {.kind = PLIANT_COMMAND_T_SET},
                   .setting = {.value = {value}, .count = 1}};
    snprintf(input.text, sizeof input.text, "%s", key);
    // In the log like a client's, so that a replay repeats it.
    requests_log(loop, &input);
    loop->reset_step = -1;
    Answer answer = {0};
    if (!requests_execute(loop->sim, &input, &answer))
        requests_event(loop, -1, "governor", "%s", answer.text);
}

void requests_govern(Loop *loop, int64_t begin_ns, int64_t tick_ns)
{
    // The finest level decides what a reduction can still take away.
    int finest = 0;
    for (int i = 0; i < sim_body_count(loop->sim); i++) {
        const Body *body = sim_body(loop->sim, i);
        if (body->ops->adapt != NULL && body->finest_level > finest)
            finest = body->finest_level;
    }
    // Ask the governor; most ticks need nothing.
    Governor *governor = &loop->governor;
    GovernorSetting before = governor_setting(governor);
    GovernorAct act = governor_tick(governor, begin_ns, tick_ns, finest);
    if (act == GOVERNOR_RESTS)
        return;
    // Carry its decision out as a client's SET would.
    GovernorSetting after = governor_setting(governor);
    if (after.scale != before.scale)
        set(loop, "adapt_scale", after.scale);
    if (after.level != before.level)
        set(loop, "adapt_level", after.level);
    // And say so to the clients.
    char text[INPUT_WHY_MAX];
    governor_describe(governor, act, text, sizeof text);
    requests_event(loop, -1, "governor", "%s", text);
}

void requests_release(Loop *loop)
{
    governor_restart(&loop->governor);
    GovernorSetting all = governor_setting(&loop->governor);
    set(loop, "adapt_scale", all.scale);
    set(loop, "adapt_level", all.level);
}

// --- commands of the loop itself ---

static void enter(Loop *loop, RunState state, Answer *answer)
{
    static const char *const kinds[] = {"resumed", "paused", "lockstep"};
    if (loop->state != state)
        requests_event(loop, -1, kinds[state], "%s at step %lld", kinds[state],
                       (long long)answer->step);
    // The ticks of a STEP run without pause. At real-time priority they would occupy a core, and
    // block the threads that receive messages there.
    if (loop->state != state && state == RUN_RUNNING)
        realtime_resume();
    else if (loop->state != state && state == RUN_LOCKSTEP)
        realtime_pause();
    if (loop->state != RUN_LOCKSTEP && state == RUN_LOCKSTEP && loop->governor.reduction > 0)
        requests_release(loop);
    governor_forget(&loop->governor);
    loop->resumed |= loop->state != state && state == RUN_RUNNING;
    loop->state = state;
    sim_set_lockstep(loop->sim, state == RUN_LOCKSTEP);
    snprintf(answer->text, sizeof answer->text, "%s", kinds[state]);
}

static bool ask_for_checkpoint(Loop *loop, Answer *answer)
{
    if (!loop->exchange->checkpoints) {
        snprintf(answer->text, sizeof answer->text,
                 "no checkpoint file: the daemon was started without --checkpoint");
        return false;
    }
    if (loop->asked_count == EXCHANGE_CHECKPOINTS) {
        snprintf(answer->text, sizeof answer->text, "%d requests wait for a checkpoint already",
                 EXCHANGE_CHECKPOINTS);
        return false;
    }
    loop->asked[loop->asked_count++] = *answer;
    atomic_store_explicit(&loop->exchange->checkpoint_wanted, true, memory_order_relaxed);
    return true;
}

// Reports the ties by message that there are, as when they were made: for clients that come later.
static void list_ties(Loop *loop)
{
    char text[128];
    for (int slot = 0; slot < sim_tie_capacity(loop->sim); slot++)
        if (sim_describe_tie(loop->sim, slot, text, sizeof text))
            requests_event(loop, -1, "tie", "%s", text);
}

// Adds to the answer to a try what a tick would take, from what the last ones have taken.
static void tell_time(const Loop *loop, Answer *answer)
{
    const bool recent = loop->step_window.count > 0;
    double us[4];
    histogram_summarize(recent ? &loop->step_window : &loop->step_total, us);
    const size_t length = strlen(answer->text);
    if (us[0] > 0.0 && answer->longer > 0.0)
        snprintf(answer->text + length, sizeof answer->text - length,
                 ", about %.3g ms of %.3g ms a tick", 1e-3 * us[0] * answer->longer,
                 1e3 / loop->scene->sim.rate_hz);
}

// Executes a command of the loop. False: the answer follows once the checkpoint's file is complete.
static bool command(Loop *loop, const Input *input, Answer *answer)
{
    // Commands of the loop itself.
    switch (input->command.kind) {
    case PLIANT_COMMAND_T_PAUSE:
        atomic_fetch_sub_explicit(&loop->exchange->interrupts, 1, memory_order_relaxed);
        enter(loop, RUN_PAUSED, answer);
        return true;
    case PLIANT_COMMAND_T_RESUME:
        enter(loop, RUN_RUNNING, answer);
        return true;
    case PLIANT_COMMAND_T_STOP:
        atomic_fetch_sub_explicit(&loop->exchange->interrupts, 1, memory_order_relaxed);
        atomic_store_explicit(&loop->exchange->stop, true, memory_order_relaxed);
        snprintf(answer->text, sizeof answer->text, "stopping");
        return true;
    case PLIANT_COMMAND_T_CHECKPOINT:
        answer->ok = ask_for_checkpoint(loop, answer);
        return !answer->ok;
    case PLIANT_COMMAND_T_DESCRIBE:
        list_ties(loop);
        return true; // the bus has the text
    // The rest changes the scene.
    default:
        requests_execute(loop->sim, input, answer);
        if (answer->tries) {
            if (answer->ok)
                tell_time(loop, answer);
            return true;
        }
        if (answer->ok && input->command.kind == PLIANT_COMMAND_T_RESET)
            governor_restart(&loop->governor);
        if (answer->ok)
            requests_event(loop, -1, input_event(input), "%s", answer->text);
        return true;
    }
}

// --- the share of a tick ---

enum {
    MOST_AT_ONCE = 64,   // requests between two ticks, however cheap
    TURNS_A_REQUEST = 2, // ticks get at least as much of the clock as requests
};

// Requests must not delay the ticks: a client that sends faster than they are executed first fills
// the ring, then is refused. While ticks have a rate to keep, requests get up to half of a tick's
// time, and a longer one delays those that follow. In lockstep and pause they have no limit.
static bool is_their_turn(Loop *loop, int taken)
{
    if (taken == MOST_AT_ONCE || loop_is_over(loop))
        return false;
    if (loop->state != RUN_RUNNING)
        return true;
    const int64_t now_ns = clock_now_ns(), tick_ns = (int64_t)(1e9 / loop->scene->sim.rate_hz);
    if (loop->requests_due_ns < now_ns - tick_ns)
        loop->requests_due_ns = now_ns - tick_ns;
    return loop->requests_due_ns <= now_ns;
}

// True for a RESET of a state that no tick and no request has touched since the last RESET. It
// changes nothing: it is answered, but neither executed nor logged again.
static bool repeats_a_reset(const Loop *loop, const Input *input)
{
    return input->kind == INPUT_COMMAND && input->command.kind == PLIANT_COMMAND_T_RESET &&
           loop->reset_step == sim_steps(loop->sim);
}

// True for a STEP or RESUME that came before a PAUSE or STOP which has overtaken it: it must not
// undo that.
static bool is_overtaken(const Loop *loop, const Input *input)
{
    return input->kind == INPUT_COMMAND && input->arrival < loop->pause_arrival &&
           (input->command.kind == PLIANT_COMMAND_T_STEP ||
            input->command.kind == PLIANT_COMMAND_T_RESUME);
}

// Returns the next request and its ring: urgent ones first, whatever time the others have used.
static const Input *next_request(Loop *loop, int taken, Ring **ring)
{
    *ring = &loop->exchange->urgent;
    const Input *input = ring_peek(*ring);
    if (input != NULL && taken < MOST_AT_ONCE && !loop_is_over(loop)) {
        loop->pause_arrival = input->arrival;
        return input;
    }
    *ring = &loop->exchange->request;
    return is_their_turn(loop, taken) ? ring_peek(*ring) : NULL;
}

// Executes a request. False: the answer follows later.
static bool take(Loop *loop, const Input *input, Answer *answer)
{
    if (is_overtaken(loop, input)) {
        answer->ok = false;
        if (input->command.kind == PLIANT_COMMAND_T_STEP)
            snprintf(answer->text, sizeof answer->text, "ended early after 0 of %lld ticks",
                     (long long)input->command.value);
        else
            snprintf(answer->text, sizeof answer->text, "a later PAUSE or STOP came first");
        return true;
    }
    // A RESET of a scene that is as it was is answered at once.
    if (repeats_a_reset(loop, input)) {
        snprintf(answer->text, sizeof answer->text, "%s", RESET_DONE);
        return true;
    }
    // Log it before it is executed, so that a replay repeats it; a try leaves no trace.
    if (!answer->tries)
        requests_log(loop, input);
    if (requests_change_scene(input))
        loop->reset_step = -1;
    if (input->kind == INPUT_COMMAND) {
        const bool answered = command(loop, input, answer);
        if (input->command.kind == PLIANT_COMMAND_T_RESET)
            loop->reset_step = sim_steps(loop->sim);
        return answered;
    }
    // Cuts, loads and ties; then what they caused.
    if (requests_execute(loop->sim, input, answer))
        requests_event(loop, input->index, input_event(input), "%s", answer->text);
    requests_report(loop);
    return true;
}

bool requests_take(Loop *loop)
{
    Ring *ring;
    const Input *input;
    for (int taken = 0; (input = next_request(loop, taken, &ring)) != NULL; taken++) {
        const int64_t begin_ns = clock_now_ns();
        Answer answer = answer_to(loop, input);
        // STEP ends the round: its ticks come first, and its answer after them.
        if (input->kind == INPUT_COMMAND && input->command.kind == PLIANT_COMMAND_T_STEP &&
            !is_overtaken(loop, input)) {
            requests_log(loop, input);
            loop->stepping = *input;
            loop->stepped = 0;
            enter(loop, RUN_LOCKSTEP, &answer);
            ring_pop(ring);
            return true;
        }
        // Execute and answer it; a new state is published at once.
        RunState before = loop->state;
        const bool answered = take(loop, input, &answer);
        if (loop->state != before)
            loop_push_status(loop);
        if (answered)
            push_answer(loop, &answer);
        ring_pop(ring);
        // Time that requests took is time that they must let pass.
        loop->requests_due_ns += TURNS_A_REQUEST * (clock_now_ns() - begin_ns);
        loop_beat(loop);
    }
    return false;
}

void requests_finish_step(Loop *loop)
{
    Answer answer = answer_to(loop, &loop->stepping);
    int64_t wanted = loop->stepping.command.value;
    answer.ok = loop->stepped == wanted;
    answer.after_frame = true;
    snprintf(answer.text, sizeof answer.text,
             answer.ok ? "%lld of %lld ticks" : "ended early after %lld of %lld ticks",
             (long long)loop->stepped, (long long)wanted);
    push_answer(loop, &answer);
}

// --- checkpoints ---

static void take_image(Loop *loop)
{
    Exchange *exchange = loop->exchange;
    world_image_take(&exchange->image, loop->world);
    memcpy(exchange->asked, loop->asked, sizeof loop->asked);
    exchange->asked_count = loop->asked_count;
    loop->asked_count = 0;
    atomic_store_explicit(&exchange->image_full, true, memory_order_release);
}

void requests_checkpoint(Loop *loop)
{
    Exchange *exchange = loop->exchange;
    if (!exchange->checkpoints ||
        !atomic_load_explicit(&exchange->checkpoint_wanted, memory_order_relaxed) ||
        atomic_load_explicit(&exchange->image_full, memory_order_acquire))
        return;
    atomic_store_explicit(&exchange->checkpoint_wanted, false, memory_order_relaxed);
    take_image(loop);
}

void requests_last_checkpoint(Loop *loop)
{
    Exchange *exchange = loop->exchange;
    if (!exchange->checkpoints)
        return;
    const struct timespec pause = {.tv_nsec = 2000000};
    while (atomic_load_explicit(&exchange->image_full, memory_order_acquire))
        nanosleep(&pause, NULL);
    take_image(loop);
}
