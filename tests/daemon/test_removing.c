// SPDX-License-Identifier: MIT
// A long trial of all that takes tissue apart, in one daemon: cuts by message and by blade,
// suction, drill and diathermy, tears, grasps, presses and ties, some of which are cut or break,
// drawn from a seed, on a solid of two tissues and on a wall, with RESETs and checkpoints between.
// A client in lockstep checks after each of them, from messages alone, what always holds: meshes,
// pieces, the ledger, masses. In the end a replay of the inputs, and one from the last checkpoint
// on, come to the same state. PLIANT_REMOVING_SEED is another seed, PLIANT_REMOVING_DEEDS another
// number of deeds.
#include "test.h"
#include "effort.h"
#include "random.h"
#include "removing.h"

#include <sys/wait.h>

enum { SIDE = 13 };
static const double CELL = 0.005;             // of the solid [m]
static const double AT[BODIES] = {0.0, 0.07}; // their centres, along x [m]
static const char SCENE[] =                   // with the levels of the solid
    "name = \"removing\"; start = \"paused\"; rate_hz = 1000.0; max_ties = 4;\n"
    "publish = { nodes_hz = 1.0; mesh_hz = 1.0; contact_hz = 0.0; status_hz = 1.0; };\n"
    "bodies = (\n"
    "  { name = \"organ\"; model = \"voxel\"; levels = %s; cuttable = true; split_budget = 16;\n"
    "    surface = \"fitted\"; integrator = \"leapfrog\";\n"
    "    voxels = { file = \"removing.nrrd\"; label = [1, 2];\n"
    "               place = { translation = [-0.03, -0.03, -0.03]; }; };\n"
    "    material = { youngs_modulus = 8.0e3; prestress = 500.0; };\n"
    "    materials = ( { label = 2; youngs_modulus = 1.6e4; density = 1100.0; } );\n"
    "    tear = { stress = 2500.0; };\n"
    "    fixed = ( { box = ([-1.0, -1.0, -1.0], [0.05, 1.0, -0.02]); } ); },\n"
    "  { name = \"wall\"; model = \"surface\"; levels = 1; cuttable = true; prestress = 0.1;\n"
    "    mesh = { generator = \"ico_sphere\"; nodes = 162; radius = 0.03;\n"
    "             place = { translation = [0.07, 0.0, 0.0]; }; };\n"
    "    material = { youngs_modulus_2d = 80.0; areal_density = 4.2; damping_time = 2.0e-4; };\n"
    "    shape = { angular_frequency = 50.0; damping_ratio = 0.3; };\n"
    "    tear = { stretch = 0.6; };\n"
    "    fixed = ( { box = ([0.05, -1.0, -1.0], [1.0, 1.0, -0.02]); } ); } );\n"
    "attachments = ( { body = \"organ\"; to = \"world\"; sphere = [-0.03, 0.0, 0.0]; radius = "
    "0.01; } );\n"
    "tools = (\n"
    "  { id = 1; kind = \"probe\"; capsules = ( { radius = 0.005; } ); },\n"
    "  { id = 2; kind = \"blade\"; edge = ([0.0, 0.0, -0.03], [0.0, 0.0, 0.03]); },\n"
    "  { id = 3; kind = \"grasper\"; capsules = ( { radius = 0.008; } ); },\n"
    "  { id = 4; kind = \"remover\"; removes_by = \"suction\"; rate_mm3_s = 50000.0;\n"
    "    mouth = { to = [0.0, 0.0, 0.004]; radius = 0.006; };\n"
    "    capsules = ( { from = [0.0, 0.0, 0.02]; to = [0.0, 0.0, 0.05]; radius = 0.003; } ); },\n"
    "  { id = 5; kind = \"remover\"; removes_by = \"drill\"; mouth = { radius = 0.005; };\n"
    "    capsules = ( { from = [0.0, 0.0, 0.01]; to = [0.0, 0.0, 0.05]; radius = 0.002; } ); },\n"
    "  { id = 6; kind = \"remover\"; removes_by = \"diathermy\"; power = 1000.0;\n"
    "    mouth = { radius = 0.003; }; } );\n"
    "score = { regions = ( { label = 2; margin = 0.005; } ); };\n";

// Of a hundred deeds; of the others one is a RESET each 5, 10, 20, ... 320, by chance, the rest are
// cuts.
static const int SHARE[DEEDS] = {
    [STROKE] = 15, [SUCTION] = 12, [DRILL] = 14, [DIATHERMY] = 6, [TEAR] = 12,
    [GRASP] = 5,   [PRESS] = 5,    [TIE] = 10,   [SAVE] = 1};

// --- deeds ---

static Vec3 direction(Trial *trial)
{
    for (;;) {
        const Vec3 v = random_vec3(&trial->random);
        const double length = vec3_length(v);
        if (length > 0.1 && length < 1.0)
            return vec3_scale(1.0 / length, v);
    }
}

static int any_body(Trial *trial)
{
    return random_below(&trial->random, BODIES);
}

static Vec3 center_of(int body)
{
    return vec3(AT[body], 0.0, 0.0);
}

// A node of the body, wherever it is now; one near the body's place, if there is any.
static Vec3 any_node(Trial *trial, int body)
{
    const Follower *follower = &trial->follower[body];
    for (int tries = 0; tries < 50; tries++) {
        const int i = random_below(&trial->random, follower->mesh.node_count);
        if (follower->mesh.id[i] < 0)
            continue;
        const float *x = follower->nodes.position + 3L * i;
        const Vec3 p = {(double)x[0], (double)x[1], (double)x[2]};
        if (vec3_length(vec3_sub(p, center_of(body))) < 0.06)
            return p;
    }
    return center_of(body);
}

static void pose(Trial *trial, int tool, Vec3 p, const double turn[4], double grip, bool active)
{
    const double position[3] = {p.x, p.y, p.z};
    pliant_tool_pose_t message = make_pose(trial->client, position);
    message.tool = tool;
    message.grip = grip;
    message.active = active;
    memcpy(message.orientation, turn, sizeof message.orientation);
    send_pose(trial->client, &message);
}

static void any_turn(Trial *trial, double turn[4])
{
    const Vec3 axis = direction(trial);
    const double half = random_between(&trial->random, 0.0, 1.5);
    turn[0] = cos(half);
    turn[1] = sin(half) * axis.x;
    turn[2] = sin(half) * axis.y;
    turn[3] = sin(half) * axis.z;
}

// Lifts a tool. A pose that waited in a stalled daemon is refused as stale: a pedal would stay
// down.
static int64_t lift(Trial *trial, int tool, Vec3 at, const double turn[4])
{
    Client *client = trial->client;
    for (;;) {
        const int64_t refusals = refused(client, "stale");
        pose(trial, tool, at, turn, 0.0, false);
        const int64_t step = removing_step(trial, 1);
        wait_until(client, client->status.step == step);
        if (refused(client, "stale") == refusals)
            return step;
    }
}

// A tool goes from one place to another in `poses` STEPs, with its pedal or jaws as they are, and
// is lifted; returns the step.
static int64_t move(Trial *trial, int tool, Vec3 from, Vec3 to, int poses, int ticks, double grip)
{
    double turn[4];
    any_turn(trial, turn);
    for (int k = 0; k <= poses; k++) {
        const Vec3 way = vec3_scale((double)k / poses, vec3_sub(to, from));
        // A tool works from its second pose on, so that what it does begins where it is.
        pose(trial, tool, vec3_add(from, way), turn, k > 0 ? grip : 0.0, true);
        const int64_t step = removing_step(trial, ticks);
        if (random_below(&trial->random, 8) == 0)
            removing_check(trial, step);
    }
    return lift(trial, tool, to, turn);
}

static void publish_cut(Client *client, const void *message)
{
    assert_int_equal(pliant_cut_t_publish(client->lcm, "PLIANT_CUT", message), 0);
}

// A plane quadrilateral about a node, up to as large as the body; in one of ten cuts a screwed one.
static int64_t cut_at(Trial *trial, int body, Vec3 at)
{
    const Vec3 u = direction(trial);
    const Vec3 v = vec3_cross(u, direction(trial));
    const double reach = random_between(&trial->random, 0.005, 0.06);
    const bool all = random_below(&trial->random, 8) == 0,
               screwed = random_below(&trial->random, 10) == 0;
    pliant_cut_t message = {.sender = trial->client->sender,
                            .id = ++trial->client->next_id,
                            .body = (char *)(uintptr_t)(all ? "" : removing_body[body])};
    for (int end = 0; end < 2; end++) {
        const Vec3 along = vec3_scale(end == 0 ? -reach : reach, v);
        const Vec3 w = screwed ? direction(trial) : u;
        const Vec3 before = vec3_add(at, vec3_sub(along, vec3_scale(reach, w))),
                   after = vec3_add(at, vec3_add(along, vec3_scale(reach, w)));
        memcpy(message.before[end], &before, sizeof message.before[end]);
        memcpy(message.after[end], &after, sizeof message.after[end]);
    }
    const Reply *reply = answer_to(trial->client, message.id, publish_cut, &message);
    trial->made[CUT] += reply->ok;
    return removing_step(trial, 1);
}

static int64_t cut(Trial *trial)
{
    const int body = any_body(trial);
    return cut_at(trial, body, any_node(trial, body));
}

// Makes a tie of any kind at a node, changes one or releases one. Some are cut through at once,
// others break when they are pulled.
static int64_t tie(Trial *trial)
{
    enum { MOST = 4 };
    const int body = any_body(trial), kind = 1 + random_below(&trial->random, 4);
    const Vec3 at = any_node(trial, body);
    const double center[3] = {at.x, at.y, at.z};
    const int action = random_below(&trial->random, 5);
    pliant_tie_t message =
        make_tie(trial->client, kind, center, random_between(&trial->random, 0.004, 0.02),
                 removing_body[body]);
    message.action = action == 0   ? PLIANT_TIE_T_RELEASE
                     : action == 1 ? PLIANT_TIE_T_CHANGE
                                   : PLIANT_TIE_T_MAKE;
    message.tie = message.action == PLIANT_TIE_T_MAKE ? 0 : 1 + random_below(&trial->random, MOST);
    message.stiffness = random_between(&trial->random, 0.05, 1.0);
    message.tool = 3;
    if (random_below(&trial->random, 2) == 0)
        message.break_force = random_between(&trial->random, 0.001, 0.1);
    if (kind == PLIANT_TIE_T_TIE || (kind == PLIANT_TIE_T_CLIP && body == 1))
        strcpy((char *)message.to_body, removing_body[1 - body]);
    if (kind == PLIANT_TIE_T_CARRY) {
        pose(trial, 3, at, (double[4]){1.0, 0.0, 0.0, 0.0}, 0.0, true);
        removing_step(trial, 2);
    }
    const Reply *reply = apply_tie(trial->client, &message);
    trial->made[TIE] += reply->ok;
    removing_step(trial, 5);
    if (kind == PLIANT_TIE_T_CARRY)
        return move(trial, 3, at, vec3_add(at, vec3_scale(0.02, direction(trial))), 6, 4, 0.0);
    return random_below(&trial->random, 2) == 0 ? cut_at(trial, body, at)
                                                : removing_step(trial, 20);
}

static int64_t stroke(Trial *trial)
{
    const Vec3 at = any_node(trial, any_body(trial));
    const Vec3 way = vec3_scale(random_between(&trial->random, 0.005, 0.05), direction(trial));
    return move(trial, 2, vec3_sub(at, way), vec3_add(at, way), 8, 2, 0.0);
}

// From outside to a node and a little farther, through the tissue or along it.
static int64_t remove_at(Trial *trial, int tool)
{
    const int body = any_body(trial);
    const Vec3 at = any_node(trial, body);
    const Vec3 from = vec3_add(at, vec3_scale(0.01, direction(trial)));
    const Vec3 to = vec3_add(at, vec3_scale(0.006, direction(trial)));
    return move(trial, tool, from, to, 6, tool == 6 ? 20 : 3, 1.0);
}

static int64_t tear(Trial *trial)
{
    const int body = any_body(trial);
    const Vec3 at = any_node(trial, body), way = direction(trial);
    const double force = random_between(&trial->random, 0.0, body == 0 ? LOAD : 0.25 * LOAD);
    const double center[3] = {at.x, at.y, at.z},
                 newton[3] = {force * way.x, force * way.y, force * way.z};
    const Reply *reply =
        apply_load(trial->client, center, 0.012, newton, 1e-3 * LOAD_TICKS, removing_body[body]);
    trial->made[TEAR] += reply->ok;
    return removing_step(trial, LOAD_TICKS + 5);
}

static int64_t grasp(Trial *trial)
{
    const Vec3 at = any_node(trial, any_body(trial));
    const Vec3 to = vec3_add(at, vec3_scale(0.03, direction(trial)));
    return move(trial, 3, at, to, 6, 4, 1.0);
}

static int64_t press(Trial *trial)
{
    const Vec3 at = any_node(trial, any_body(trial));
    const Vec3 way = vec3_scale(0.012, direction(trial));
    return move(trial, 1, vec3_add(at, way), vec3_sub(at, way), 6, 4, 0.0);
}

static int64_t reset(Trial *trial)
{
    assert_true(command(trial->client, PLIANT_COMMAND_T_RESET, 0, "")->ok);
    const int64_t step = removing_step(trial, 1);
    trial->reset_at = step - 1;
    trial->next_reset = trial->deed + (5 << random_below(&trial->random, 7));
    // All tissue is back, in one piece.
    wait_until(trial->client, removing_is_whole(trial, step));
    for (int t = 0; t < TISSUES; t++) {
        expect_of(trial, trial->tissue[t].attached == trial->tissue[t].at_load);
        expect_of(trial, trial->tissue[t].coagulated == 0.0);
    }
    expect_of(trial, trial->pieces[0] == 1 && trial->pieces[1] == 1);
    return step;
}

static int64_t save(Trial *trial)
{
#if WITH_HDF5
    assert_true(command(trial->client, PLIANT_COMMAND_T_CHECKPOINT, 0, "")->ok);
#endif
    return removing_step(trial, 1);
}

static Deed draw_deed(Trial *trial)
{
    int number = random_below(&trial->random, 100);
    if (trial->deed >= trial->next_reset)
        return RESET;
    for (int deed = 1; deed < DEEDS; deed++)
        if ((number -= SHARE[deed]) < 0)
            return (Deed)deed;
    return CUT;
}

static int64_t do_next(Trial *trial)
{
    trial->deed++;
    trial->now = draw_deed(trial);
    trial->done[trial->now]++;
    switch (trial->now) {
    case STROKE:
        return stroke(trial);
    case SUCTION:
        return remove_at(trial, 4);
    case DRILL:
        return remove_at(trial, 5);
    case DIATHERMY:
        return remove_at(trial, 6);
    case TEAR:
        return tear(trial);
    case GRASP:
        return grasp(trial);
    case PRESS:
        return press(trial);
    case TIE:
        return tie(trial);
    case RESET:
        return reset(trial);
    case SAVE:
        return save(trial);
    default:
        return cut(trial);
    }
}

// --- the trial ---

static void write_volume(const char *name)
{
    FILE *file = fopen(scratch(name), "wb");
    assert_non_null(file);
    fprintf(file,
            "NRRD0004\ntype: uchar\ndimension: 3\nsizes: %d %d %d\nspacings: 5 5 5\nencoding: "
            "raw\n\n",
            SIDE, SIDE, SIDE);
    // A ball of 3 cm and one of 1.2 cm inside, out of the middle.
    for (int at = 0; at < SIDE * SIDE * SIDE; at++) {
        const double x = CELL * (at % SIDE - 6), y = CELL * (at / SIDE % SIDE - 6),
                     z = CELL * (at / SIDE / SIDE - 6);
        const double inner = (x - 0.008) * (x - 0.008) + y * y + (z - 0.008) * (z - 0.008);
        fputc(inner < 0.012 * 0.012 ? 2 : x * x + y * y + z * z < 0.03 * 0.03 ? 1 : 0, file);
    }
    assert_int_equal(fclose(file), 0);
}

static long number_from(const char *variable, long otherwise)
{
    const char *text = getenv(variable);
    return text != NULL ? strtol(text, NULL, 10) : otherwise;
}

// Waits for a process that may take longer than those of other tests.
static void finish_long(Process *process)
{
    siginfo_t info = {0};
    const double limit = client_now() + 3600.0;
    while (info.si_pid == 0 && client_now() < limit) {
        assert_int_equal(waitid(P_PID, (id_t)process->pid, &info, WEXITED | WNOHANG | WNOWAIT), 0);
        usleep(10000);
    }
    process_wait_for(process, 0);
}

static void expect_repeated(const char *state, const char *format, const char *log,
                            const char *scene)
{
    char arguments[2048], again[32];
    snprintf(arguments, sizeof arguments, format, log, scene);
    daemon_start(&pliantd, "%s", arguments);
    finish_long(&pliantd);
    printed_state(&pliantd, again);
    assert_string_equal(again, state);
}

static void report(const Trial *trial, double seconds)
{
    print_message("%d deeds in %.1f s, %lld ticks:", trial->deed, seconds, (long long)trial->step);
    for (int deed = 0; deed < DEEDS; deed++)
        print_message(" %lld %s,", (long long)trial->done[deed], removing_deed[deed]);
    print_message("\n%lld cuts cut; %lld loads taken; %lld ties tied; deltas %d and %d; farthest "
                  "node %.2f and "
                  "%.2f m\n",
                  (long long)trial->made[CUT], (long long)trial->made[TEAR],
                  (long long)trial->made[TIE], trial->follower[0].deltas, trial->follower[1].deltas,
                  trial->follower[0].farthest, trial->follower[1].farthest);
    for (int k = 0; k < EVENTS; k++)
        print_message("%lld events %s%s", (long long)trial->events[k], removing_event[k],
                      k + 1 < EVENTS ? ", " : "\n");
    const StatusSeen *status = &trial->client->status;
    for (int i = 0; i < status->reasons; i++)
        print_message("  %s %lld\n", status->reason[i], (long long)status->reason_count[i]);
}

static void take_apart(const char *levels)
{
    const long deeds = number_from("PLIANT_REMOVING_DEEDS", TRIALS(60, 10000));
    char text[sizeof SCENE + 100];
    Trial trial = {
        .random =
            (uint64_t)number_from("PLIANT_REMOVING_SEED", 1) * UINT64_C(0x9E3779B97F4A7C15) + 1};
    const char *scene = scratch("removing.cfg"), *log = scratch("removing.log");
    write_volume("removing.nrrd");
    snprintf(text, sizeof text, SCENE, levels);
    write_text(scene, text);
    trial.client = client_create();
    removing_follow(&trial);
#if WITH_HDF5
    const char *kept = scratch("removing.h5");
    daemon_start(&pliantd, "--checkpoint %s --log-inputs %s %s", kept, log, scene);
#else
    daemon_start(&pliantd, "--log-inputs %s %s", log, scene);
#endif
    client_wait_for_daemon(trial.client);
    for (int b = 0; b < BODIES; b++)
        wait_until(trial.client, trial.follower[b].wholes > 0);
    const double begin = client_now();
    trial.now = RESET; // nothing was before
    removing_check(&trial, removing_step(&trial, 1));
    while (trial.deed < deeds) {
        removing_check(&trial, do_next(&trial));
        if (trial.deed % 10 == 0)
            removing_check_followed(&trial);
    }
    report(&trial, client_now() - begin);
    // The guard has restored nothing without a tool or load that explains it.
    static const char *const never[] = {"restored_unknown", "restored_energy", "restored_time_step",
                                        "restored_set", "frozen_bodies"};
    for (size_t k = 0; k < sizeof never / sizeof *never; k++)
        if (refused(trial.client, never[k]) > 0)
            fail_msg("%s", never[k]);
    server_stop(trial.client, &pliantd);
    removing_unfollow(&trial);
    client_destroy(trial.client);
    char state[32];
    printed_state(&pliantd, state);
    expect_repeated(state, "--offline 100000 --input %s %s", log, scene);
#if WITH_HDF5
    // The last checkpoint is that of the end: the one before is that of some deed, if there was
    // any.
    const char *former = scratch("removing.h5.1");
    if (trial.done[SAVE] > 0) {
        char format[PATH_TEXT];
        snprintf(format, sizeof format, "--offline 100000 --resume %s --input %%s %%s", former);
        expect_repeated(state, format, log, scene);
    }
    unlink(former);
    unlink(kept);
#endif
    unlink(log);
}

TEST(whatever_takes_tissue_apart_keeps_meshes_pieces_masses_and_the_ledger)
{
    take_apart("1");
}

TEST(so_does_it_where_elements_follow_the_tools)
{
    take_apart("{ inside = 2; surface = 2; }");
}
