// SPDX-License-Identifier: MIT
// What several senders ask of a running scene in turn: poses, cuts, loads, ties and commands
// through the gate, applied as the daemon does, with ticks between them. Whatever is let in, the
// scene stays finite, and its state is one that a checkpoint may hold.
#include "fuzz.h"

#include "run/input.h"
#include "run/requests.h"
#include "world.h"

#include "pliant_command_t.h"

#include <stdio.h>

enum { TICKS_MOST = 48, MESSAGES_MOST = 64 };

typedef struct Session {
    FuzzWorld *world;
    Sim *sim;
    Gate gate;
    bool lockstep;
    int ticks, messages;
} Session;

// Names that mean something, and one that does not.
static void draw_text(Feed *feed, const char *const *names, int count, char *text)
{
    snprintf(text, INPUT_TEXT_MAX, "%s", names[feed_byte(feed) % count]);
}

static void draw_pose(Feed *feed, Input *input)
{
    input->pose.tool = feed_byte(feed) % 8;
    for (int c = 0; c < 3; c++)
        input->pose.position[c] = feed_number(feed, 0.2);
    double *q = input->pose.orientation;
    int turn = feed_byte(feed) % 6;
    q[0] = 1.0;
    if (turn == 1)
        q[0] = 0.0, q[1] = 1.0;
    else if (turn == 2)
        q[0] = q[1] = 0.70710678;
    else if (turn == 3)
        q[0] = 0.0, q[2] = 1.0;
    else if (turn == 4)
        q[0] = q[2] = 0.70710678;
    else if (turn == 5)
        q[3] = feed_number(feed, 1.0);
    uint8_t bits = feed_byte(feed);
    input->pose.active = (bits & 3) != 0;
    input->pose.twist_valid = (bits & 12) == 4;
    if (input->pose.twist_valid)
        for (int c = 0; c < 6; c++)
            input->pose.twist[c] = feed_number(feed, c < 3 ? 1.0 : 10.0);
    input->pose.grip = (bits & 16) != 0 ? 1.0 : (bits & 32) != 0 ? feed_number(feed, 1.0) : 0.0;
}

static void draw_command(Feed *feed, Input *input)
{
    static const char *const arguments[] = {"",
                                            "gravity=0 0 -9.81",
                                            "gravity_x=1000",
                                            "stiffness_scale=1.5",
                                            "stiffness_scale=0",
                                            "ball.stiffness_scale=0.5",
                                            "block.damping_scale=2",
                                            "damping_scale=0",
                                            "friction=1e300",
                                            "friction=0.5",
                                            "adapt_force=0.001",
                                            "adapt_level=0",
                                            "ball.adapt_scale=4",
                                            "adapt_curvature=1e-9",
                                            "ball.=1",
                                            "=",
                                            "gravity=1e5 0 0",
                                            "block.stiffness_scale=1e9",
                                            "try ball.stiffness_scale=2",
                                            "try damping_scale"};
    static const int kinds[] = {PLIANT_COMMAND_T_SET, PLIANT_COMMAND_T_RESET, PLIANT_COMMAND_T_STEP,
                                PLIANT_COMMAND_T_RESUME, PLIANT_COMMAND_T_SET};
    uint8_t kind = feed_byte(feed);
    input->command.kind = kind < 250 ? kinds[kind % 5] : kind;
    const double value = feed_number(feed, 100.0);
    input->command.value = fabs(value) < 1e18 ? (int64_t)value % 1000000 : 0;
    if (feed_byte(feed) < 200) {
        draw_text(feed, arguments, (int)(sizeof arguments / sizeof *arguments), input->text);
        return;
    }
    Feed part = feed_part(feed, INPUT_TEXT_MAX - 1);
    memcpy(input->text, part.at, part.left);
}

static void draw_tie(Feed *feed, Input *input)
{
    static const char *const bodies[] = {"", "ball", "block", "liver"};
    input->tie.action = feed_byte(feed) % 5;
    input->tie.tie = feed_byte(feed) % 6;
    input->tie.kind = feed_byte(feed) % 6;
    input->tie.tool = feed_byte(feed) % 6;
    // The sphere as a rule, else a few ids.
    const uint8_t ids = feed_byte(feed);
    input->tie.node_count = ids < 200 ? 0 : ids % 20;
    for (int i = 0; i < TIE_IDS && ids >= 200; i++)
        input->tie.node[i] = feed_byte(feed);
    for (int c = 0; c < 3; c++)
        input->tie.center[c] = feed_number(feed, 0.1);
    input->tie.radius = feed_number(feed, 0.1);
    input->tie.stiffness = feed_number(feed, 2.0);
    input->tie.damping_ratio = feed_number(feed, 1.0);
    input->tie.break_force = feed_number(feed, 1.0);
    snprintf((char *)input->tie.to_body, sizeof input->tie.to_body, "%s",
             bodies[feed_byte(feed) % 4]);
    draw_text(feed, bodies, 4, input->text);
}

static void draw_input(Feed *feed, InputKind kind, Input *input)
{
    static const char *const bodies[] = {"", "ball", "block", "liver"};
    *input = (Input){.kind = kind, .sender = 1 + feed_byte(feed) % 3, .id = feed_byte(feed)};
    switch (kind) {
    case INPUT_POSE:
        draw_pose(feed, input);
        break;
    case INPUT_CUT:
        for (int c = 0; c < 6; c++) {
            (&input->cut.before[0][0])[c] = feed_number(feed, 0.2);
            (&input->cut.after[0][0])[c] = feed_number(feed, 0.2);
        }
        draw_text(feed, bodies, 4, input->text);
        break;
    case INPUT_LOAD:
        for (int c = 0; c < 3; c++) {
            input->load.center[c] = feed_number(feed, 0.1);
            input->load.force[c] = feed_number(feed, feed_byte(feed) < 200 ? 1.0 : 1e6);
        }
        input->load.radius = feed_number(feed, 0.1);
        input->load.duration = feed_number(feed, 0.1);
        draw_text(feed, bodies, 4, input->text);
        break;
    case INPUT_TIE:
        draw_tie(feed, input);
        break;
    default:
        draw_command(feed, input);
    }
}

// As replay.c and the loop do it.
static void apply(Session *session, const Input *input)
{
    if (input->kind == INPUT_POSE) {
        ToolPose pose = input_pose(input);
        sim_apply_pose(session->sim, input->index, &pose, session->lockstep);
        return;
    }
    Answer answer = {.kind = input->kind, .sender = input->sender, .id = input->id, .ok = true};
    int command = input->kind == INPUT_COMMAND ? input->command.kind : 0;
    if (command == PLIANT_COMMAND_T_STEP || command == PLIANT_COMMAND_T_RESUME) {
        session->lockstep = command == PLIANT_COMMAND_T_STEP;
        sim_set_lockstep(session->sim, session->lockstep);
    } else if (command == 0 || command == PLIANT_COMMAND_T_SET ||
               command == PLIANT_COMMAND_T_RESET) {
        bool done = requests_execute(session->sim, input, &answer);
        fuzz_print(answer.text);
        MUST(done == answer.ok);
        MUST(memchr(answer.text, 0, sizeof answer.text) != NULL && answer.text[0] != '\0');
    }
    gate_answer(&session->gate, &answer);
}

static void pass(Session *session, InputKind kind, const void *data, size_t size)
{
    GateResult result;
    if (session->messages++ >= MESSAGES_MOST)
        return;
    gate_pass(&session->gate, kind, data, size, 2000 * sim_steps(session->sim), &result);
    fuzz_print(result.why[0] != '\0' ? result.why : "let in");
    MUST((result.passage == PASSAGE_REFUSED) == (result.why[0] != '\0'));
    if (result.passage == PASSAGE_OPEN)
        apply(session, &result.input);
}

// Encodes what may well be refused: input_encode is for accepted ones, but writes any numbers.
static void send(Session *session, Feed *feed, InputKind kind)
{
    unsigned char wire[INPUT_WIRE_MAX];
    Input input;
    draw_input(feed, kind, &input);
    if (kind != INPUT_COMMAND || input.command.kind != PLIANT_COMMAND_T_SET) {
        pass(session, kind, wire, input_encode(&input, wire));
        return;
    }
    // The text of a SET as a client writes it.
    pliant_command_t message = {.sender = input.sender,
                                .id = input.id,
                                .kind = input.command.kind,
                                .value = input.command.value,
                                .argument = input.text};
    int size = pliant_command_t_encode(wire, 0, sizeof wire, &message);
    MUST(size > 0);
    pass(session, kind, wire, (size_t)size);
}

static void tick(Session *session, int count)
{
    for (int i = 0; i < count && session->ticks < TICKS_MOST; i++, session->ticks++) {
        SimEvent event;
        GraspEvent grasp;
        sim_step(session->sim);
        while (sim_take_event(session->sim, &event))
            MUST(memchr(event.text, 0, sizeof event.text) != NULL);
        while (sim_next_grasp(session->sim, &grasp))
            continue;
        fuzz_world_check(session->world);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Session session;
    static Arena arena; // of the gate
    Feed feed = {data, size};
    session = (Session){.world = fuzz_world()};
    session.sim = session.world->world.sim;
    gate_init(&session.gate, session.sim, 0.05, &arena);
    while (feed.left > 0 && session.messages < MESSAGES_MOST && session.ticks < TICKS_MOST) {
        uint8_t op = feed_byte(&feed) % 8;
        if (op < INPUT_KINDS)
            send(&session, &feed, (InputKind)op);
        else if (op < 7)
            tick(&session, op == 6 ? 8 : 1);
        else {
            Feed raw = feed_part(&feed, 1024);
            InputKind kind = (InputKind)(feed_byte(&raw) % INPUT_KINDS);
            pass(&session, kind, raw.at, raw.left);
        }
    }
    tick(&session, 2);
    arena_destroy(&arena);
    return 0;
}
