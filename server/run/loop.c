// SPDX-License-Identifier: MIT
#include "run/loop.h"
#include "run/requests.h"

#include "base/check.h"
#include "base/clock.h"
#include "base/team.h"
#include "run/realtime.h"
#include "run/files_thread.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <string.h>

const char *loop_state_name(RunState state)
{
    static const char *const names[] = {"running", "paused", "lockstep"};
    return names[state];
}

bool loop_due(int64_t step, double hz, double rate_hz)
{
    int64_t events = llround(hz * 1000.0);
    int64_t ticks = llround(rate_hz * 1000.0);
    if (events <= 0 || ticks <= 0)
        return false;
    if (events >= ticks)
        return true;
    // Split so that no product overflows, however long the daemon runs.
    int64_t inside = step % ticks;
    return inside == 0 || inside * events / ticks != (inside - 1) * events / ticks;
}

int64_t loop_ticks(double seconds, double rate_hz)
{
    int64_t ticks = llround(seconds * rate_hz);
    return seconds > 0.0 && ticks < 1 ? 1 : ticks;
}

// --- out ---

bool loop_is_over(const Loop *loop)
{
    return atomic_load_explicit(&loop->exchange->stop, memory_order_relaxed) ||
           (loop->duration_ticks > 0 && loop->ticks + loop->late_ticks >= loop->duration_ticks);
}

void loop_beat(Loop *loop)
{
    Exchange *exchange = loop->exchange;
    loop->beats++;
    atomic_store_explicit(&exchange->beat, loop->beats, memory_order_relaxed);
    atomic_store_explicit(&exchange->step, loop->ticks, memory_order_relaxed);
    atomic_store_explicit(&exchange->late, loop->late_ticks, memory_order_relaxed);
}

// Returns space for a recorded frame after handing over its meshes; NULL if none is due. Lockstep
// has no clock to keep, so it waits for space instead of dropping the frame.
static RecordFrame *find_record(Loop *loop, bool waits)
{
    Exchange *exchange = loop->exchange;
    // The file has each tick once.
    if (!exchange->records || sim_steps(loop->sim) == loop->recorded_step)
        return NULL;
    const struct timespec pause = {.tv_nsec = 1000000};
    // Offline-like runs wait for room; a real-time one counts what it loses.
    RecordFrame *frame = record_find_room(exchange, loop->sim);
    while (frame == NULL && waits && !loop_is_over(loop)) {
        loop_beat(loop); // the thread is alive while it waits
        nanosleep(&pause, NULL);
        frame = record_find_room(exchange, loop->sim);
    }
    if (frame == NULL)
        atomic_fetch_add_explicit(&exchange->recorded_lost, 1, memory_order_relaxed);
    return frame;
}

// Converts positions once, so that the bus and the recording get the same numbers.
static void push_frames(Loop *loop, bool at_once)
{
    Exchange *exchange = loop->exchange;
    RecordFrame *record = find_record(loop, at_once);
    RecordBody *recorded = record == NULL ? NULL : record_frame_begin(record, loop->sim);
    // The bus gets every body, and so does the recording if there is one.
    for (int i = 0; i < exchange->body_count; i++) {
        const float *position = exchange_push_frame(exchange, loop->sim, i, at_once);
        if (record != NULL)
            recorded = record_body(recorded, sim_body(loop->sim, i), position);
    }
    if (record != NULL) {
        ring_publish(&exchange->recorded);
        loop->recorded_step = sim_steps(loop->sim);
    }
    loop->handed_over = true;
}

// Records the tools if they have a rate of their own, also in the ticks of a STEP, which waits for
// space.
static void record_tools(Loop *loop)
{
    const struct timespec pause = {.tv_nsec = 1000000};
    Ring *ring = &loop->exchange->recorded_tools;
    // In lockstep or a pause nothing is late, so a full ring is waited for.
    RecordFrame *row = ring_back(ring);
    while (row == NULL && loop->state != RUN_RUNNING && !loop_is_over(loop)) {
        loop_beat(loop); // the thread is alive while it waits
        nanosleep(&pause, NULL);
        row = ring_back(ring);
    }
    // A row that finds no room counts as lost.
    if (row == NULL) {
        atomic_fetch_add_explicit(&loop->exchange->lost, 1, memory_order_relaxed);
        return;
    }
    record_frame_begin(row, loop->sim);
    ring_publish(ring);
}

static void push_contacts(Loop *loop)
{
    Exchange *exchange = loop->exchange;
    // One time for all tools: they are of one tick.
    int64_t utime = exchange->tool_count > 0 ? clock_utime() : 0;
    for (int i = 0; i < exchange->tool_count; i++) {
        ContactOut contact = {.tool = i,
                              .utime = utime,
                              .step = sim_steps(loop->sim),
                              .time = sim_time(loop->sim),
                              .pose_utime = sim_tool_motion(loop->sim, i)->pose_utime,
                              .wrench = *sim_wrench(loop->sim, i)};
        if (!ring_push(&exchange->contact, &contact))
            atomic_fetch_add_explicit(&exchange->lost, 1, memory_order_relaxed);
        loop->handed_over = true;
    }
}

static void push_body(BodyOut *out, Sim *sim, int index, bool estimates)
{
    const Body *body = sim_body(sim, index);
    // What the body is now.
    *out = (BodyOut){
        .topology = body->mesh.topology,
        .nodes = mesh_changes(body) ? mesh_live_nodes(&body->mesh) : body->state_capacity,
        .springs = body->spring_count,
        .elements = body->element_count > 0 ? body->element_count : body->surface.face_count,
        .pieces = sim_pieces(sim, index),
        .finest_level = body->finest_level,
        .time_step = body->h,
        .mass = body->mass};
    // Energies, and the error of the steps in units of the motion.
    sim_measure(sim, index, &out->measure);
    if (estimates) {
        const double moved = fmax(out->measure.max_displacement, 1e-3 * body->surface.longest_edge);
        out->estimated_error = sim_figure(sim, sim_take_error(sim, index) / moved);
    }
}

// Sends timings since the last status, figures of the bodies and counters.
void loop_push_status(Loop *loop)
{
    Sim *sim = loop->sim;
    StatusOut *out = slot_back(&loop->exchange->status);
    int64_t now = clock_now_ns();
    int64_t steps = sim_steps(sim) - loop->window_start_step;
    *out = (StatusOut){.state = loop->state,
                       .step = sim_steps(sim),
                       .late_ticks = loop->late_ticks,
                       .resets = sim_resets(sim),
                       .governor_stage = loop->governor.reduction,
                       .governor_actions = loop->governor.actions,
                       .time = sim_time(sim)};
    // Averages since the last status: real-time factor, times per tick and per stage.
    if (now > loop->window_start_ns)
        out->real_time_factor =
            (double)steps * sim_tick(sim) * 1e9 / (double)(now - loop->window_start_ns);
    histogram_summarize(&loop->step_window, out->step_us);
    histogram_summarize(&loop->wake_window, out->wake_us);
    for (int s = 0; s < STAGE_COUNT; s++) {
        int64_t ns = sim_stage_ns(sim, (StageId)s);
        if (steps > 0)
            out->stage_us[s] = (double)(ns - loop->window_stage_ns[s]) * 1e-3 / (double)steps;
        loop->window_stage_ns[s] = ns;
    }
    for (int i = 0; i < loop->exchange->body_count; i++) {
        push_body(&out->body[i], sim, i, loop->estimates);
    }
    out->guard = *sim_guard_counts(sim); // includes the measured quantities
    // Start the next window.
    histogram_clear(&loop->step_window);
    histogram_clear(&loop->wake_window);
    loop->window_start_ns = now;
    loop->window_start_step = sim_steps(sim);
    slot_publish(&loop->exchange->status);
    loop->handed_over = true;
}

// Hands the ledger over if it changed; `now`: also if the last one is young.
static void push_ledger(Loop *loop, bool now)
{
    if (!ledger_is_due(&loop->ledger, loop->sim, now))
        return;
    ledger_draw(slot_back(&loop->exchange->ledger), loop->sim, loop->scene);
    slot_publish(&loop->exchange->ledger);
    loop->handed_over = true;
}

// Hands errors over when all are new, after one and a half periods anyway, or `now`; and maps as
// soon as a body has a new one, which takes some ticks.
static void push_errors(Loop *loop, bool now)
{
    if (loop->exchange->error.memory == NULL)
        return;
    const double period = loop->scene->sim.rate_hz / loop->scene->publish.error_hz;
    const int cycles = sim_error_cycles(loop->sim);
    const int64_t step = sim_steps(loop->sim), passed = step - loop->error_step;
    if (now || cycles != loop->error_cycles || passed < 0 || (double)passed >= 1.5 * period) {
        exchange_push_error(loop->exchange, loop->sim);
        loop->error_cycles = cycles;
        loop->error_step = step;
        loop->handed_over = true;
    }
    loop->handed_over |= exchange_push_error_maps(loop->exchange, loop->sim, now);
}

// Hands elements over that have changed, when they are due or `now`.
static void push_elements(Loop *loop, bool now)
{
    const double hz = loop->scene->publish.elements_hz;
    if (loop->exchange->elements == NULL)
        return;
    const bool due = now || loop_due(sim_steps(loop->sim), hz, loop->scene->sim.rate_hz);
    loop->handed_over |= exchange_push_elements(loop->exchange, loop->sim, due, now);
}

static void report_grasps(Loop *loop)
{
    GraspEvent event;
    while (sim_next_grasp(loop->sim, &event)) {
        char text[GRASP_TEXT];
        grasp_text(loop->sim, &event, text);
        requests_event(loop, event.body, grasp_kind(&event), "%s", text);
    }
}

static void wake_bus(Loop *loop)
{
    // Without contacts the bus polls by itself, so that a tick makes no system call for it.
    if (loop->handed_over && (loop->scene->publish.contact_hz > 0.0 || loop->state != RUN_RUNNING))
        exchange_wake(loop->exchange->bus_fd);
    loop->handed_over = false;
}

// --- one tick ---

static void apply_pose(Loop *loop, const Input *input)
{
    ToolPose pose = input_pose(input);
    sim_apply_pose(loop->sim, input->index, &pose, loop->state == RUN_LOCKSTEP);
    requests_log(loop, input);
}

// The step thread sees only the newest pose of a tick. If the blade was lifted in between, or
// another client took it over, it must not cut on its way from the old position; a tool that was
// withdrawn in between is released.
static void lift_blade(Loop *loop, const Input *input)
{
    int32_t *taken = loop->exchange->taken[input->index];
    bool passed = input->lifts != taken[0] || input->sender != taken[1];
    taken[0] = input->lifts;
    taken[1] = input->sender;
    bool cuts = sim_tool(loop->sim, input->index)->kind == TOOL_BLADE &&
                sim_tool_motion(loop->sim, input->index)->active;
    if (!passed || !input->pose.active || !(cuts || sim_tool_withdrawn(loop->sim, input->index)))
        return;
    Input lift = *input;
    lift.pose.active = false;
    apply_pose(loop, &lift);
}

// Notes a pause after which tools are released.
static void note_away(Loop *loop, int64_t pause_ns)
{
    if ((double)pause_ns > loop->scene->sim.tool_timeout_s * 1e9)
        loop->away_ns = pause_ns;
}

// While the process or the machine was stopped, the hands moved on, and their positions are
// unknown. A tool that moved there within a tick would tear at what it grasps. Tools are released,
// as stale ones are, and earlier poses are discarded, also those that the bus hands over later.
static void release_tools(Loop *loop)
{
    Exchange *exchange = loop->exchange;
    // Withdraw each moved tool as its own client would, so that the log of inputs has it too.
    for (int i = 0; i < exchange->tool_count; i++) {
        const ToolMotion *motion = sim_tool_motion(loop->sim, i);
        const ToolOptions *tool = sim_tool(loop->sim, i);
        slot_take(&exchange->pose[i]);
        if (!motion->active || tool->kind == TOOL_STATIC)
            continue;
        const Input lift = {.kind = INPUT_POSE,
                            .index = i,
                            .pose = {.utime = motion->pose_utime,
                                     .sender = exchange->taken[i][1],
                                     .tool = tool->id,
                                     .orientation = {1.0, 0.0, 0.0, 0.0}}};
        apply_pose(loop, &lift);
    }
    // Clients hear that the run stood still.
    requests_event(loop, -1, "stopped", "for %.3f s: these ticks are skipped, all tools withdrawn",
                   (double)loop->away_ns * 1e-9);
    requests_log_stop(loop, (double)loop->away_ns * 1e-9);
    loop->away_ns = 0;
    loop->back_ns = clock_now_ns();
}

static void take_poses(Loop *loop, int64_t begin_ns)
{
    Exchange *exchange = loop->exchange;
    for (int i = 0; i < exchange->tool_count; i++) {
        const Input *input = slot_take(&exchange->pose[i]);
        if (input == NULL || input->arrival < loop->back_ns)
            continue;
        // Stopped since the tick began: what came meanwhile is not a motion of one tick.
        if (loop->state == RUN_RUNNING)
            note_away(loop, clock_now_ns() - begin_ns);
        if (loop->away_ns > 0) {
            release_tools(loop);
            return;
        }
        lift_blade(loop, input);
        apply_pose(loop, input);
    }
}

static void tick(Loop *loop, int64_t begin_ns)
{
    Sim *sim = loop->sim;
    // Workers wake up while inputs are taken and contacts are sought.
    team_wake(loop->world->team);
    // Inputs, then the step.
    if (loop->away_ns > 0)
        release_tools(loop);
    take_poses(loop, begin_ns);
    int64_t taken_ns = clock_now_ns();
    sim_add_stage_ns(sim, STAGE_INPUTS, taken_ns - begin_ns);
    sim_step(sim);
    loop->ticks++;
    requests_report(loop);

    // In lockstep only the last tick of a STEP is published, before its reply.
    int64_t stepped_ns = clock_now_ns();
    int64_t step = sim_steps(sim);
    const ScenePublish *publish = &loop->scene->publish;
    double rate = loop->scene->sim.rate_hz;
    if (loop->state == RUN_RUNNING) {
        if (loop_due(step, publish->contact_hz, rate))
            push_contacts(loop);
        if (loop_due(step, publish->nodes_hz, rate))
            push_frames(loop, false);
    }
    // Tool samples, grasp events and periodic checkpoints, in every state.
    const double tools_hz = loop->options.record_tools_hz;
    if (tools_hz > 0.0 && loop_due(step, tools_hz, rate))
        record_tools(loop);
    report_grasps(loop);
    push_ledger(loop, false);
    push_errors(loop, false);
    push_elements(loop, false);
    if (loop->checkpoint_ticks > 0 && step % loop->checkpoint_ticks == 0)
        atomic_store_explicit(&loop->exchange->checkpoint_wanted, true, memory_order_relaxed);
    // Timings come last: they include the copying above.
    int64_t end_ns = clock_now_ns();
    sim_add_stage_ns(sim, STAGE_SNAPSHOT, end_ns - stepped_ns);
    histogram_add(&loop->step_total, end_ns - begin_ns);
    histogram_add(&loop->step_window, end_ns - begin_ns);
    if (loop->governs && loop->state == RUN_RUNNING)
        requests_govern(loop, begin_ns, end_ns - begin_ns);
    if (loop_due(step, publish->status_hz, rate))
        loop_push_status(loop);
}

// Runs the ticks of a STEP without pacing; a PAUSE or STOP that arrives meanwhile ends them early.
static void run_steps(Loop *loop)
{
    while (loop->stepped < loop->stepping.command.value && !loop_is_over(loop) &&
           atomic_load_explicit(&loop->exchange->interrupts, memory_order_relaxed) == 0) {
        tick(loop, clock_now_ns());
        loop_beat(loop);
        loop->stepped++;
        requests_checkpoint(loop);
    }
    push_contacts(loop);
    push_frames(loop, true);
    push_ledger(loop, true);
    push_errors(loop, true);
    push_elements(loop, true);
    loop_push_status(loop);
    requests_finish_step(loop);
    wake_bus(loop);
}

// --- time ---

static int64_t deadline(const Loop *loop, int64_t slot)
{
    return loop->epoch_ns + (int64_t)((double)slot * 1e9 / loop->scene->sim.rate_hz);
}

static void start_clock(Loop *loop)
{
    loop->epoch_ns = clock_now_ns();
    loop->slot = 1;
}

// Skips the deadlines that have passed by the clock, for whatever reason. A longer pause releases
// the tools.
static void skip_missed(Loop *loop, int64_t now)
{
    const int64_t first = loop->slot, missed = now - deadline(loop, first);
    note_away(loop, missed);
    // Near at once, since a suspended machine may have missed days of them.
    const double passed = (double)(now - loop->epoch_ns) * loop->scene->sim.rate_hz * 1e-9;
    if (missed > 0 && (int64_t)passed - 1 > first)
        loop->slot = (int64_t)passed - 1;
    while (deadline(loop, loop->slot) < now)
        loop->slot++;
    loop->late_ticks += loop->slot - first;
}

// Sleeps until the next future deadline; those that have passed are counted as late.
static void wait_for_deadline(Loop *loop)
{
    skip_missed(loop, clock_now_ns());
    int64_t until = deadline(loop, loop->slot++);
    struct timespec time = {.tv_sec = until / 1000000000, .tv_nsec = until % 1000000000};
    while (clock_nanosleep(CLOCK_RUN, TIMER_ABSTIME, &time, NULL) == EINTR) {
    }
    int64_t now = clock_now_ns(), lateness = now - until;
    // After a sleep through many deadlines the tools are released before the tick, not after it.
    skip_missed(loop, now);
    histogram_add(&loop->wake_total, lateness);
    histogram_add(&loop->wake_window, lateness);
}

// Uses the time left after a tick to try a step of one body after the other, rarely enough to cost
// next to nothing. Until the duration of a try is known, half a period must be left.
static void try_step(Loop *loop)
{
    enum { EVERY = 16 }; // ticks
    const int64_t step = sim_steps(loop->sim), period = (int64_t)(1e9 / loop->scene->sim.rate_hz);
    if (step % EVERY != 0)
        return;
    const int64_t begin_ns = clock_now_ns(), left = deadline(loop, loop->slot) - begin_ns;
    if (left < (loop->try_ns > 0 ? loop->try_ns + period / 10 : period / 2))
        return;
    sim_try_step(loop->sim, (int)(step / EVERY % loop->exchange->body_count));
    const int64_t taken = clock_now_ns() - begin_ns;
    sim_add_stage_ns(loop->sim, STAGE_ESTIMATE, taken);
    // After an interrupted try the known duration decays slowly.
    loop->try_ns = taken > loop->try_ns ? taken : loop->try_ns - (loop->try_ns - taken) / 8;
}

static void wait_for_request(Loop *loop)
{
    struct pollfd wake = {.fd = loop->exchange->step_fd, .events = POLLIN};
    while (poll(&wake, 1, -1) < 0 && errno == EINTR) {
    }
    exchange_clear(loop->exchange->step_fd);
}

static void *loop_main(void *argument)
{
    Loop *loop = argument;
    realtime_flush_denormals();
    // Publish the initial state, so that clients see it before the first tick.
    loop->window_start_ns = clock_now_ns();
    push_frames(loop, false);
    push_ledger(loop, true);
    loop_push_status(loop);
    exchange_wake(loop->exchange->bus_fd);
    if (loop->governs && sim_steps(loop->sim) > 0)
        requests_release(loop); // detail that the checkpoint of a governed run holds back
    start_clock(loop);

    while (!loop_is_over(loop)) {
        // One iteration: wait for the deadline or a request, execute requests, run a tick, wake the
        // bus.
        RunState before = loop->state;
        if (before == RUN_RUNNING)
            wait_for_deadline(loop);
        else if (ring_peek(&loop->exchange->request) == NULL &&
                 ring_peek(&loop->exchange->urgent) == NULL)
            wait_for_request(loop);
        int64_t begin_ns = clock_now_ns();
        loop->resumed = before != RUN_RUNNING;
        while (requests_take(loop))
            run_steps(loop);
        if (loop->resumed)
            start_clock(loop); // requests of a pause, which have no limit, are no part of a tick
        else if (loop->state == RUN_RUNNING && !loop_is_over(loop))
            tick(loop, begin_ns);
        if (loop->state != RUN_RUNNING)
            push_ledger(loop, true);
        requests_checkpoint(loop);
        wake_bus(loop);
        loop_beat(loop);
        if (loop->estimates && loop->state == RUN_RUNNING && !loop->resumed)
            try_step(loop);
    }
    // Leave counters, checkpoint and status final before the other threads are told.
    if (loop->state == RUN_RUNNING)
        skip_missed(loop, clock_now_ns());
    requests_last_checkpoint(loop);
    loop->state = loop->state == RUN_RUNNING ? RUN_PAUSED : loop->state;
    push_ledger(loop, true);
    loop_push_status(loop);
    exchange_wake(loop->exchange->bus_fd);
    exchange_wake(loop->done_fd);
    return NULL;
}

void loop_init(Loop *loop, World *world, const Scene *scene, Exchange *exchange,
               const LoopOptions *options, int done_fd)
{
    memset(loop, 0, sizeof *loop);
    loop->options = *options;
    loop->scene = scene;
    loop->world = world;
    loop->sim = world->sim;
    loop->exchange = exchange;
    loop->done_fd = done_fd;
    // The state at the start, and times in ticks.
    loop->state = scene->start == START_PAUSED ? RUN_PAUSED : RUN_RUNNING;
    loop->duration_ticks = loop_ticks(options->duration_s, scene->sim.rate_hz);
    loop->checkpoint_ticks = loop_ticks(options->checkpoint_s, scene->sim.rate_hz);
    loop->window_start_step = sim_steps(loop->sim);
    loop->recorded_step = loop->reset_step = -1;
    if (exchange->ledger.memory != NULL)
        loop->ledger = ledger_clock(loop->sim);
    // The governor has work only where a body adapts.
    for (int i = 0; i < sim_body_count(loop->sim); i++) {
        loop->governs |= sim_body(loop->sim, i)->ops->adapt != NULL;
    }
    loop->estimates = scene->sim.estimate_error || exchange->error.memory != NULL;
    governor_init(&loop->governor, scene->sim.rate_hz);
    sim_set_lockstep(loop->sim, false);
}

bool loop_start(Loop *loop, Status *status)
{
    Team *team = loop->world->team;
    // Workers first: the step needs them from its first tick.
    if (!realtime_start_team(team, true, status))
        return false;
    int error = pthread_create(&loop->thread, NULL, loop_main, loop);
    if (error != 0)
        return status_fail(status, STATUS_FAILED, "cannot start the step thread: %s",
                           strerror(error));
    pthread_setname_np(loop->thread, "pliant-step");
    // Rights and processors are wishes; the run goes on without them.
    realtime_request(loop->thread);
    realtime_pin_step(team, loop->thread);
    return true;
}

void loop_join(Loop *loop)
{
    pthread_join(loop->thread, NULL);
}
