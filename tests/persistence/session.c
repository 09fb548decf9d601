// SPDX-License-Identifier: MIT
#include "session.h"

#include "random.h"

#include "pliant_command_t.h"
#include "pliant_cut_t.h"
#include "pliant_load_t.h"
#include "pliant_tool_pose_t.h"

#include <sys/stat.h>

const SessionScene session_scenes[SESSION_SCENES] = {
    {"levels", 1, {{"ball", {0.0, 0.0, 0.0}, 0.05}}, false, true, false, 0},
    {"cuts",
     2,
     {{"block", {0.0, 0.0, 0.0}, 0.02}, {"ball", {0.1, 0.0, 0.0}, 0.03}},
     true,
     true,
     false,
     2},
    {"disc", 1, {{"disc", {0.0, 0.0, 0.0}, 0.05}}, true, false, true, 0},
    {"graded", 1, {{"organ", {0.0, 0.0, 0.0}, 0.03}}, true, true, false, 0},
    {"steps",
     3,
     {{"stiff", {0.0, 0.0, 0.0}, 0.03},
      {"organ", {0.1, 0.0, 0.0}, 0.03},
      {"solid", {0.0, 0.0, 0.0}, 0.025}},
     false,
     true,
     false,
     0},
    {"choi2005", 1, {{"ball", {0.0, 0.0, 0.0}, 0.05}}, false, true, false, 0},
    {"damped",
     2,
     {{"organ", {0.0, 0.0, 0.0}, 0.03}, {"free", {0.1, 0.0, 0.0}, 0.02}},
     true,
     true,
     false,
     0},
    {"fitted", 1, {{"organ", {0.0, 0.0, 0.0}, 0.03}}, true, true, false, 2},
    {"touching",
     2,
     {{"bed", {0.0, 0.0, 0.0}, 0.02}, {"gall", {0.0, 0.0, 0.027}, 0.015}},
     true,
     true,
     false,
     0},
    {"balloon",
     2,
     {{"gas", {0.0, 0.0, 0.0}, 0.03}, {"fluid", {0.1, 0.0, 0.0}, 0.03}},
     true,
     true,
     false,
     0},
    {"removed", 1, {{"organ", {0.0, 0.0, 0.0}, 0.03}}, true, true, false, 2},
};

const char *session_scene(const SessionScene *scene, const char *precision, int threads)
{
    char name[PATH_TEXT], text[8192];
    snprintf(name, sizeof name, SESSION_SCENES_FOLDER "/%s.cfg", scene->name);
    FREED char *from = file_text(name);
    int size = snprintf(text, sizeof text, "precision = \"%s\";  threads = %d;\n%s", precision,
                        threads, from);
    assert_true(size < (int)sizeof text);
    snprintf(name, sizeof name, "%s-%s-%d.cfg", scene->name, precision, threads);
    const char *path = scratch(name);
    write_text(path, text);
    return path;
}

// --- drawing what is done ---

// What one tool is about: from `from` to `to` in `ticks`, then something else.
typedef struct Hand {
    int tool, begin, ticks;
    Vec3 from, to;
    double grip;
    bool active;
} Hand;

typedef struct Draw {
    Session *session;
    const SessionScene *scene;
    uint64_t random;
    int32_t sender, id, sequence;
    int running_again; // tick of the RESUME after a STEP or PAUSE; 0: none
} Draw;

static Message *add(Draw *draw, int tick, const char *channel)
{
    Session *session = draw->session;
    if (session->count == session->capacity) {
        session->capacity = 2 * session->capacity + 256;
        session->message =
            realloc(session->message, (size_t)session->capacity * sizeof *session->message);
        assert_non_null(session->message);
    }
    Message *message = &session->message[session->count++];
    *message = (Message){.tick = tick, .channel = channel};
    return message;
}

static bool chance(Draw *draw, int one_in)
{
    return random_below(&draw->random, one_in) == 0;
}

static const Target *any_target(Draw *draw)
{
    return &draw->scene->target[random_below(&draw->random, draw->scene->targets)];
}

static Vec3 at(const Target *target, Vec3 direction, double radii)
{
    const Vec3 center = {target->center[0], target->center[1], target->center[2]};
    return vec3_add(center, vec3_scale(radii * target->radius, direction));
}

// A unit vector; no function of libm but the square root, which is exact everywhere.
static Vec3 any_direction(Draw *draw)
{
    for (;;) {
        Vec3 v = random_vec3(&draw->random);
        if (draw->scene->flat)
            v.z = 0.0;
        double length = vec3_length(v);
        if (length > 0.1 && length < 1.0)
            return vec3_scale(1.0 / length, v);
    }
}

// The next thing that the hand does: a probe presses and comes back, a blade sweeps through, a
// grasper grasps one side and pulls. Now and then it rests, longer than tools stay valid.
static void choose(Draw *draw, Hand *hand, int tick)
{
    const Target *target = any_target(draw);
    const Vec3 to = any_direction(draw);
    bool was_pull = hand->tool == 3 && hand->grip > 0.5;
    hand->begin = tick;
    hand->ticks = 40 + random_below(&draw->random, 60);
    hand->active = !chance(draw, 6);
    hand->grip = 0.0;
    if (hand->tool == 1) {
        bool in = vec3_length(vec3_sub(hand->from, hand->to)) == 0.0 || chance(draw, 2);
        hand->from = in ? at(target, to, 1.5) : hand->to;
        hand->to = at(target, to, in ? 0.8 : 1.5);
    } else if (hand->tool == 2) {
        const Vec3 aside = vec3_scale(0.3, any_direction(draw));
        hand->from = at(target, vec3_sub(aside, to), 1.4);
        hand->to = at(target, vec3_add(aside, to), 1.4);
    } else if (was_pull) {
        hand->from = hand->to; // releases where it is
    } else {
        hand->from = at(target, to, 1.0);
        hand->to = at(target, to, 1.4);
        hand->grip = 1.0;
    }
}

static void pose_hand(Draw *draw, Hand *hand, int tick)
{
    if (tick >= hand->begin + hand->ticks)
        choose(draw, hand, tick);
    double part = (double)(tick - hand->begin) / hand->ticks;
    const Vec3 way = vec3_sub(hand->to, hand->from);
    const Vec3 p = vec3_add(hand->from, vec3_scale(part, way));
    const double speed = (double)SESSION_RATE / hand->ticks;
    pliant_tool_pose_t pose = {.utime = 1000000 + (int64_t)tick * 1000,
                               .sender = draw->sender,
                               .sequence = ++draw->sequence,
                               .tool = hand->tool,
                               .position = {p.x, p.y, p.z},
                               // not quite unit: made so in the same way again
                               .orientation = {0.99999, 0.0, 0.0, 0.0},
                               .twist = {way.x * speed, way.y * speed, way.z * speed},
                               .twist_valid = hand->tool == 1 && tick % 3 == 0,
                               .grip = hand->grip,
                               .active = hand->active};
    Message *message = add(draw, tick, "TOOL_POSE");
    message->size = pliant_tool_pose_t_encode(message->data, 0, MESSAGE_BYTES, &pose);
}

static void cut(Draw *draw, int tick)
{
    const Target *target = any_target(draw);
    const Vec3 u = any_direction(draw);
    Vec3 v = {0.0, 0.0, 1.0};
    if (!draw->scene->flat)
        v = vec3_cross(u, any_direction(draw)); // the blade may be short
    const Vec3 aside = vec3_scale(0.3, any_direction(draw));
    pliant_cut_t m = {.utime = tick,
                      .sender = draw->sender,
                      .id = ++draw->id,
                      .body = (char *)(uintptr_t)(chance(draw, 3) ? "" : target->body)};
    for (int end = 0; end < 2; end++) {
        const Vec3 along = vec3_add(aside, vec3_scale(end == 0 ? -1.3 : 1.3, v));
        const Vec3 before = at(target, vec3_sub(along, vec3_scale(1.3, u)), 1.0);
        const Vec3 after = at(target, vec3_add(along, vec3_scale(0.6, u)), 1.0);
        memcpy(m.before[end], &before, sizeof m.before[end]);
        memcpy(m.after[end], &after, sizeof m.after[end]);
    }
    Message *message = add(draw, tick, "CUT");
    message->size = pliant_cut_t_encode(message->data, 0, MESSAGE_BYTES, &m);
}

static void load(Draw *draw, int tick)
{
    const Target *target = any_target(draw);
    const Vec3 side = any_direction(draw), center = at(target, side, 0.9),
               force = vec3_scale(draw->scene->flat ? 0.01 : 0.2, any_direction(draw));
    pliant_load_t m = {.utime = tick,
                       .sender = draw->sender,
                       .id = ++draw->id,
                       .center = {center.x, center.y, center.z},
                       .radius = 0.5 * target->radius,
                       .force = {force.x, force.y, force.z},
                       .duration = random_between(&draw->random, 0.01, 0.3),
                       .body = (char *)(uintptr_t)target->body};
    Message *message = add(draw, tick, "LOAD");
    message->size = pliant_load_t_encode(message->data, 0, MESSAGE_BYTES, &m);
}

static void command(Draw *draw, int tick, int kind, int64_t value, const char *argument)
{
    pliant_command_t m = {.utime = tick,
                          .sender = draw->sender,
                          .id = ++draw->id,
                          .kind = kind,
                          .value = value,
                          .argument = (char *)(uintptr_t)argument};
    Message *message = add(draw, tick, "COMMAND");
    message->size = pliant_command_t_encode(message->data, 0, MESSAGE_BYTES, &m);
}

// What does not fit a scene (adaptation of a body that does not adapt) is refused, then as now.
static void set(Draw *draw, int tick)
{
    static const char *const settings[] = {
        "gravity=0.5 0 -4", "stiffness_scale=0.9", "damping_scale=1.1",
        "adapt_level=1",    "adapt_level=2",       "adapt_scale=0.5",
        "gravity=0 0 0",    "adapt_scale=1",       "friction=0.2"};
    command(draw, tick, PLIANT_COMMAND_T_SET, 0,
            settings[random_below(&draw->random, (int)(sizeof settings / sizeof *settings))]);
}

// A pause, or lockstep for as many ticks as it runs; its end is reported at its tick.
static void change_pace(Draw *draw, int tick)
{
    int ticks = 5 + random_below(&draw->random, 20);
    if (chance(draw, 2))
        command(draw, tick, PLIANT_COMMAND_T_PAUSE, 0, "");
    else
        command(draw, tick, PLIANT_COMMAND_T_STEP, ticks, "");
    draw->running_again = tick + ticks;
}

long long kept_step(const char *checkpoint, const char *scene)
{
    Process daemon;
    struct stat facts;
    if (stat(checkpoint, &facts) != 0 || facts.st_size == 0)
        return -1;
    run_daemon_well(&daemon, "--offline 0 --resume %s %s", checkpoint, scene);
    return printed(&daemon, "step");
}

Session session_create(const SessionScene *scene, uint64_t seed, int ticks)
{
    Session session = {.ticks = ticks};
    Draw draw = {.session = &session,
                 .scene = scene,
                 .random = (seed + scene->more) * UINT64_C(0x9E3779B97F4A7C15) + 1,
                 .sender = (int32_t)(seed % 1000000) + 1000000};
    Hand hand[3] = {{.tool = 1}, {.tool = 2}, {.tool = 3}};
    const bool has[3] = {true, scene->blade, scene->grasper};
    int reset_at = 100 + random_below(&draw.random, 2 * ticks); // in every other session
    for (int tick = 1; tick < ticks; tick++) {
        for (int k = 0; k < 3; k++)
            if (has[k] && !chance(&draw, 8)) // poses come when they come
                pose_hand(&draw, &hand[k], tick);
        if (chance(&draw, 120))
            cut(&draw, tick);
        if (chance(&draw, 60))
            load(&draw, tick);
        if (chance(&draw, 150))
            set(&draw, tick);
        if (tick == reset_at)
            command(&draw, tick, PLIANT_COMMAND_T_RESET, 0, "");
        if (draw.running_again == 0 && chance(&draw, 250))
            change_pace(&draw, tick);
        if (tick == draw.running_again) {
            command(&draw, tick, PLIANT_COMMAND_T_RESUME, 0, "");
            draw.running_again = 0;
        }
    }
    return session;
}

void session_destroy(Session *session)
{
    free(session->message);
    *session = (Session){0};
}

// --- where it goes ---

static void write_event(lcm_eventlog_t *log, const char *channel, int tick, const void *data,
                        int size)
{
    lcm_eventlog_event_t event = {.timestamp = (int64_t)tick * (1000000 / SESSION_RATE),
                                  .channellen = (int32_t)strlen(channel),
                                  .datalen = size,
                                  .channel = (char *)(uintptr_t)channel,
                                  .data = (void *)(uintptr_t)data};
    assert_int_equal(lcm_eventlog_write_event(log, &event), 0);
}

void session_write_log(const Session *session, const SessionScene *scene, const char *path)
{
    char text[256], channel[64];
    lcm_eventlog_t *log = lcm_eventlog_create(path, "w");
    assert_non_null(log);
    int size = snprintf(text, sizeof text,
                        "format = pliant-input-log\nversion = 1\nscene = %s\nprefix = PLIANT\n"
                        "isa = baseline\nrate_hz = %d\nstep = 0\n",
                        scene->name, SESSION_RATE);
    write_event(log, "PLIANT_INPUT_LOG", 0, text, size);
    for (int i = 0; i < session->count; i++) {
        const Message *message = &session->message[i];
        snprintf(channel, sizeof channel, "PLIANT_%s", message->channel);
        write_event(log, channel, message->tick, message->data, message->size);
    }
    size = snprintf(text, sizeof text, "end\nstep = %d\nlost = 0\n", session->ticks);
    write_event(log, "PLIANT_INPUT_LOG", session->ticks, text, size);
    lcm_eventlog_destroy(log);
}

void session_send(const Session *session, int tick, int *next, lcm_t *lcm)
{
    for (; *next < session->count && session->message[*next].tick <= tick; ++*next) {
        const Message *message = &session->message[*next];
        char channel[64];
        snprintf(channel, sizeof channel, "PLIANT_%s", message->channel);
        assert_int_equal(lcm_publish(lcm, channel, message->data, (unsigned)message->size), 0);
    }
}
