// SPDX-License-Identifier: MIT
// A long trial of all that takes tissue apart, in one daemon: cuts by message and by blade,
// suction, drill and diathermy, tears, grasps and presses, drawn from a seed, on a solid of two
// tissues and on a wall, with RESETs and checkpoints between. A client in lockstep checks after
// each of them, from messages alone, what always holds: meshes, pieces, the ledger, masses. In the
// end a replay of the inputs, and one from the last checkpoint on, come to the same state.
// PLIANT_REMOVING_SEED is another seed, PLIANT_REMOVING_DEEDS another number of deeds.
#include "test.h"
#include "effort.h"
#include "frames.h"
#include "lcm_client.h"
#include "random.h"

#include "pliant_ledger_t.h"
#include "pliant_status_t.h"

#include <sys/wait.h>

enum { BODIES = 2, SIDE = 13, PIECES_MOST = 4096, TISSUES = 3 };
static const double CELL = 0.005;            // of the solid [m]
static const double AT[BODIES] = {0.0, 0.1}; // their centres, along x [m]
static const char *const NAME[BODIES] = {"organ", "wall"};
// A loose piece flies until the next RESET, as fast as the tools or loads that hit it: some 1 m/s
// for a few simulated seconds. Numbers that have got lost go farther.
static const double FARTHEST = 100.0; // [m]

static const char SCENE[] =
    "name = \"removing\"; start = \"paused\"; rate_hz = 1000.0;\n"
    "publish = { nodes_hz = 1.0; mesh_hz = 1.0; contact_hz = 0.0; status_hz = 1.0; };\n"
    "bodies = (\n"
    "  { name = \"organ\"; model = \"voxel\"; levels = 1; cuttable = true; split_budget = 16;\n"
    "    surface = \"fitted\";\n"
    "    voxels = { file = \"removing.nrrd\"; label = [1, 2];\n"
    "               place = { translation = [-0.03, -0.03, -0.03]; }; };\n"
    "    material = { youngs_modulus = 8.0e3; prestress = 500.0; };\n"
    "    materials = ( { label = 2; youngs_modulus = 1.6e4; density = 1100.0; } );\n"
    "    tear = { stress = 2500.0; };\n"
    "    fixed = ( { box = ([-1.0, -1.0, -1.0], [0.05, 1.0, -0.02]); } ); },\n"
    "  { name = \"wall\"; model = \"surface\"; levels = 1; cuttable = true; prestress = 0.1;\n"
    "    mesh = { generator = \"ico_sphere\"; nodes = 162; radius = 0.03;\n"
    "             place = { translation = [0.1, 0.0, 0.0]; }; };\n"
    "    material = { youngs_modulus_2d = 80.0; areal_density = 4.2; damping_time = 2.0e-4; };\n"
    "    shape = { angular_frequency = 50.0; damping_ratio = 0.3; };\n"
    "    tear = { stretch = 0.6; };\n"
    "    fixed = ( { box = ([0.05, -1.0, -1.0], [1.0, 1.0, -0.02]); } ); } );\n"
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

typedef enum Deed {
    CUT,
    STROKE,
    SUCTION,
    DRILL,
    DIATHERMY,
    TEAR,
    GRASP,
    PRESS,
    RESET,
    SAVE,
    DEEDS
} Deed;
static const char *const DEED[DEEDS] = {"cuts",
                                        "strokes",
                                        "presses of suction",
                                        "of the drill",
                                        "of diathermy",
                                        "loads that tear",
                                        "grasps",
                                        "presses of a probe",
                                        "resets",
                                        "checkpoints"};
// Of a hundred deeds; those of the other kinds are cuts.
static const int SHARE[DEEDS] = {
    [STROKE] = 15, [SUCTION] = 12, [DRILL] = 14, [DIATHERMY] = 6, [TEAR] = 12,
    [GRASP] = 5,   [PRESS] = 5,    [RESET] = 3,  [SAVE] = 1};

// What a front end keeps of a body.
typedef struct Follower {
    lcm_subscription_t *on[3];
    MeshFrame mesh, whole; // followed by deltas since the first whole one; the newest whole one
    NodesFrame nodes;
    int wholes, deltas, missed;
    double farthest; // node so far [m]
} Follower;

// One tissue of the ledger, [m3] or [m2].
typedef struct Tissue {
    bool there;
    double density, at_load, attached, cut_off, removed, coagulated;
} Tissue;

typedef struct Trial {
    Client *client;
    Follower follower[BODIES];
    pliant_status_t_subscription_t *on_status;
    pliant_ledger_t_subscription_t *on_ledger;
    // the newest status
    int64_t step;
    int pieces[BODIES], topology[BODIES];
    double mass[BODIES];
    // the newest ledger, and what it must not fall below
    Tissue tissue[TISSUES], before[TISSUES];
    double sections;
    int ledgers;
    // what is done
    uint64_t random;
    int deed; // its number
    Deed now;
    int64_t done[DEEDS], made[DEEDS], events[4]; // made: of cuts, those that cut something
} Trial;

#define expect_of(trial, condition)                                                                \
    do {                                                                                           \
        if (!(condition))                                                                          \
            fail_msg("deed %d (%s), step %lld: not %s", (trial)->deed, DEED[(trial)->now],         \
                     (long long)(trial)->step, #condition);                                        \
    } while (0)

// --- what came ---

RAW_HANDLER(on_mesh)
{
    Follower *follower = user;
    const bool whole =
        mesh_frame_add(&follower->whole, buffer->data, buffer->data_size) == FRAMES_WHOLE;
    // A client that has lost a delta begins again with the next whole mesh.
    if (follower->wholes == 0 || follower->missed > 0)
        if (mesh_frame_add(&follower->mesh, buffer->data, buffer->data_size) == FRAMES_WHOLE)
            follower->missed = 0;
    follower->wholes += whole;
}

RAW_HANDLER(on_delta)
{
    Follower *follower = user;
    const FramesResult result =
        mesh_frame_add_delta(&follower->mesh, buffer->data, buffer->data_size);
    follower->deltas += result == FRAMES_WHOLE;
    follower->missed += result == FRAMES_MISSED;
}

RAW_HANDLER(on_nodes)
{
    nodes_frame_add(&((Follower *)user)->nodes, buffer->data, buffer->data_size);
}

HANDLER(on_status, pliant_status_t, status)
{
    Trial *trial = user;
    assert_int_equal(status->num_bodies, BODIES);
    trial->step = status->step;
    for (int b = 0; b < BODIES; b++) {
        assert_string_equal(status->body[b].name, NAME[b]);
        trial->pieces[b] = status->body[b].pieces;
        trial->topology[b] = status->body[b].topology;
        trial->mass[b] = status->body[b].mass;
    }
}

// Always: nothing is lost, nothing comes back but by RESET, only a remover takes anything.
static void check_ledger(Trial *trial)
{
    for (int t = 0; t < TISSUES; t++) {
        const Tissue *now = &trial->tissue[t], *before = &trial->before[t];
        const double present = now->attached + now->cut_off;
        // Counts of cells, or sums of some hundred areas: a few roundings.
        const double rounding = 1e-12 * now->at_load;
        expect_of(trial, now->at_load > 0.0 && now->attached >= 0.0 && now->cut_off >= 0.0);
        expect_of(trial, fabs(present + now->removed - now->at_load) <= rounding);
        expect_of(trial, now->coagulated >= 0.0 && now->coagulated <= present + rounding);
        if (before->there && trial->now != RESET)
            expect_of(trial, now->removed >= before->removed - rounding);
        if (before->there && (trial->now < SUCTION || trial->now > DIATHERMY) &&
            trial->now != RESET)
            expect_of(trial, now->removed <= before->removed + rounding);
        if (before->there)
            expect_of(trial, fabs(now->at_load - before->at_load) <= rounding);
    }
}

HANDLER(on_ledger, pliant_ledger_t, ledger)
{
    Trial *trial = user;
    assert_int_equal(ledger->num_tissues, TISSUES);
    assert_int_equal(ledger->num_bodies, BODIES);
    for (int t = 0; t < TISSUES; t++) {
        const pliant_ledger_tissue_t *of = &ledger->tissue[t];
        assert_string_equal(of->body, NAME[t / 2]);
        trial->before[t] = trial->tissue[t];
        trial->tissue[t] = (Tissue){.there = true,
                                    .density = of->density,
                                    .at_load = of->at_load,
                                    .attached = of->attached,
                                    .cut_off = of->cut_off,
                                    .removed = of->removed,
                                    .coagulated = of->coagulated};
    }
    check_ledger(trial);
    const double sections = ledger->body[0].cut + ledger->body[0].torn;
    // Sums in the order of cuts.
    expect_of(trial, trial->now == RESET || sections >= trial->sections * (1.0 - 1e-9));
    trial->sections = sections;
    const pliant_ledger_region_t *region = &ledger->region[0];
    expect_of(trial, region->touched ? region->distance == 0.0 : region->distance >= -1.0);
    trial->ledgers++;
}

static void follow(Trial *trial)
{
    lcm_t *lcm = trial->client->lcm;
    char channel[64];
    for (int b = 0; b < BODIES; b++) {
        Follower *follower = &trial->follower[b];
        static const struct {
            const char *kind;
            lcm_msg_handler_t handler;
        } heard[3] = {{"MESH", on_mesh}, {"MESH_DELTA", on_delta}, {"NODES", on_nodes}};
        for (int k = 0; k < 3; k++) {
            snprintf(channel, sizeof channel, "PLIANT_%s_%s", heard[k].kind, NAME[b]);
            follower->on[k] = lcm_subscribe(lcm, channel, heard[k].handler, follower);
            lcm_subscription_set_queue_capacity(follower->on[k], 4096);
        }
    }
    trial->on_status = pliant_status_t_subscribe(lcm, "PLIANT_STATUS", on_status, trial);
    trial->on_ledger = pliant_ledger_t_subscribe(lcm, "PLIANT_LEDGER", on_ledger, trial);
    pliant_ledger_t_subscription_set_queue_capacity(trial->on_ledger, 4096);
}

static void unfollow(Trial *trial)
{
    for (int b = 0; b < BODIES; b++) {
        Follower *follower = &trial->follower[b];
        for (int k = 0; k < 3; k++)
            lcm_unsubscribe(trial->client->lcm, follower->on[k]);
        mesh_frame_destroy(&follower->mesh);
        mesh_frame_destroy(&follower->whole);
        nodes_frame_destroy(&follower->nodes);
    }
    pliant_status_t_unsubscribe(trial->client->lcm, trial->on_status);
    pliant_ledger_t_unsubscribe(trial->client->lcm, trial->on_ledger);
}

// --- what holds of a mesh ---

static int root(int *of, int i)
{
    while (of[i] != i)
        i = of[i] = of[of[i]];
    return i;
}

static int compare_ints(const void *a, const void *b)
{
    const int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

// Every live node has an id of its own and a finite position.
static void check_nodes(Trial *trial, Follower *follower)
{
    const MeshFrame *mesh = &follower->mesh;
    FREED int *id = zeroed((size_t)mesh->node_count + 1, sizeof *id);
    int live = 0;
    for (int i = 0; i < mesh->node_count; i++) {
        if (mesh->id[i] < 0)
            continue;
        id[live++] = mesh->id[i];
        double distance = 0.0;
        for (int c = 0; c < 3; c++)
            distance = fmax(distance, fabs((double)follower->nodes.position[3 * i + c]));
        expect_of(trial, distance < FARTHEST); // false if it is not finite
        follower->farthest = fmax(follower->farthest, distance);
    }
    qsort(id, (size_t)live, sizeof *id, compare_ints);
    for (int k = 1; k < live; k++)
        expect_of(trial, id[k] != id[k - 1]);
}

// Triangles name live nodes of one piece, and there are as many pieces as the status has. A wall's
// piece is what hangs together by nodes; a solid's may have several surfaces.
static void check_pieces(Trial *trial, int body)
{
    const MeshFrame *mesh = &trial->follower[body].mesh;
    FREED int *of = zeroed((size_t)mesh->node_count + 1, sizeof *of);
    FREED bool *used = zeroed((size_t)mesh->node_count + 1, sizeof *used);
    static bool seen[PIECES_MOST];
    memset(seen, 0, sizeof seen);
    for (int i = 0; i < mesh->node_count; i++)
        of[i] = i;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int32_t *n = mesh->triangle + 3L * t;
        if (n[0] == 0 && n[1] == 0 && n[2] == 0)
            continue;
        for (int k = 0; k < 3; k++) {
            const int a = n[k], b = n[(k + 1) % 3];
            expect_of(trial, a >= 0 && a < mesh->node_count && a != b);
            expect_of(trial, mesh->id[a] >= 0);
            expect_of(trial, mesh->piece[a] == mesh->piece[n[0]]);
            used[a] = true;
        }
        of[root(of, n[1])] = root(of, n[0]);
        of[root(of, n[2])] = root(of, n[0]);
    }
    int parts = 0, pieces = 0;
    for (int i = 0; i < mesh->node_count; i++) {
        if (!used[i])
            continue;
        parts += root(of, i) == i;
        expect_of(trial, mesh->piece[i] >= 0 && mesh->piece[i] < PIECES_MOST);
        pieces += !seen[mesh->piece[i]];
        seen[mesh->piece[i]] = true;
    }
    expect_of(trial, pieces == trial->pieces[body]);
    expect_of(trial, body == 1 ? parts == pieces : parts >= pieces);
}

// A solid's surface is closed: each edge is passed as often in one direction as in the other.
static int compare_edges(const void *a, const void *b)
{
    return memcmp(a, b, 2 * sizeof(int));
}

static void check_closed(Trial *trial, int body)
{
    const MeshFrame *mesh = &trial->follower[body].mesh;
    const int most = 3 * mesh->triangle_count;
    FREED int *ahead = zeroed(2 * (size_t)most + 2, sizeof *ahead);
    FREED int *back = zeroed(2 * (size_t)most + 2, sizeof *back);
    size_t edges = 0;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            const int a = mesh->triangle[3 * t + k], b = mesh->triangle[3 * t + (k + 1) % 3];
            if (a == b)
                continue;
            ahead[2 * edges] = back[2 * edges + 1] = a;
            ahead[2 * edges + 1] = back[2 * edges] = b;
            edges++;
        }
    qsort(ahead, edges, 2 * sizeof *ahead, compare_edges);
    qsort(back, edges, 2 * sizeof *back, compare_edges);
    expect_of(trial, memcmp(ahead, back, 2 * edges * sizeof *ahead) == 0);
}

static double mass_of(const Trial *trial, int body)
{
    double mass = 0.0;
    for (int t = 0; t < TISSUES; t++)
        if (t / 2 == body)
            mass +=
                trial->tissue[t].density * (trial->tissue[t].attached + trial->tissue[t].cut_off);
    return mass;
}

// Messages of one moment leave one after the other: waits until those of `step` are there.
static bool is_whole(const Trial *trial, int64_t step)
{
    for (int b = 0; b < BODIES; b++) {
        const Follower *follower = &trial->follower[b];
        if (!follower->nodes.whole || follower->nodes.step != step || !follower->mesh.whole ||
            follower->nodes.topology != follower->mesh.topology ||
            follower->mesh.topology != trial->topology[b] ||
            follower->mesh.node_count != follower->nodes.node_count)
            return false;
        // The body's mass is that of its ledger: sums of some thousand cells or faces.
        if (fabs(mass_of(trial, b) - trial->mass[b]) > 1e-9 * trial->mass[b])
            return false;
    }
    return trial->step == step && trial->ledgers > 0;
}

static int64_t step_on(Trial *trial, int ticks);

static void say_what_is_missing(const Trial *trial, int64_t step)
{
    for (int b = 0; b < BODIES; b++) {
        const Follower *follower = &trial->follower[b];
        print_error(
            "%s: frame of step %lld, topology %d; mesh %d, status %d; mass %.15g, by ledger "
            "%.15g\n",
            NAME[b], (long long)follower->nodes.step, follower->nodes.topology,
            follower->mesh.topology, trial->topology[b], trial->mass[b], mass_of(trial, b));
    }
    fail_msg("deed %d (%s): messages of step %lld (status %lld) do not agree", trial->deed,
             DEED[trial->now], (long long)step, (long long)trial->step);
}

static void check(Trial *trial, int64_t step)
{
    for (int tries = 0; tries < 5 && !is_whole(trial, step); tries++) {
        const double limit = client_now() + 2.0;
        while (!is_whole(trial, step) && client_now() < limit)
            client_listen(trial->client, 20);
        if (is_whole(trial, step))
            break;
        // A datagram was lost.
        command(trial->client, PLIANT_COMMAND_T_DESCRIBE, 0, "");
        if (tries > 0)
            step = step_on(trial, 1);
    }
    if (!is_whole(trial, step))
        say_what_is_missing(trial, step);
    for (int b = 0; b < BODIES; b++) {
        assert_int_equal(trial->follower[b].mesh.refused + trial->follower[b].nodes.refused, 0);
        check_nodes(trial, &trial->follower[b]);
        check_pieces(trial, b);
    }
    check_closed(trial, 0);
}

// The mesh of a client that came now is that of one that has followed since the start.
static void check_followed(Trial *trial)
{
    Client *client = trial->client;
    int before[BODIES];
    for (int b = 0; b < BODIES; b++)
        before[b] = trial->follower[b].wholes;
    command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "");
    for (int b = 0; b < BODIES; b++) {
        const Follower *follower = &trial->follower[b];
        const MeshFrame *a = &follower->mesh, *whole = &follower->whole;
        wait_until(client, follower->wholes > before[b] && a->topology == whole->topology);
        expect_of(trial, a->node_count == whole->node_count);
        expect_of(trial, a->triangle_count == whole->triangle_count);
        const size_t nodes = (size_t)a->node_count, corners = 3 * (size_t)a->triangle_count;
        expect_of(trial, memcmp(a->triangle, whole->triangle, corners * sizeof *a->triangle) == 0);
        expect_of(trial, memcmp(a->id, whole->id, nodes * sizeof *a->id) == 0);
        expect_of(trial, memcmp(a->origin, whole->origin, nodes * sizeof *a->origin) == 0);
        expect_of(trial, memcmp(a->piece, whole->piece, nodes * sizeof *a->piece) == 0);
    }
}

// --- deeds ---

static int64_t step_on(Trial *trial, int ticks)
{
    const Reply *reply = command(trial->client, PLIANT_COMMAND_T_STEP, ticks, "");
    assert_true(reply->ok);
    const int64_t step = reply->step;
    trial->client->replies = trial->client->events = 0;
    return step;
}

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
        step_on(trial, ticks);
    }
    pose(trial, tool, to, turn, 0.0, false);
    return step_on(trial, 1);
}

static void publish_cut(Client *client, const void *message)
{
    assert_int_equal(pliant_cut_t_publish(client->lcm, "PLIANT_CUT", message), 0);
}

// A plane quadrilateral about a node, up to as large as the body; in one of ten cuts a screwed one.
static int64_t cut(Trial *trial)
{
    const int body = any_body(trial);
    const Vec3 at = any_node(trial, body), u = direction(trial);
    const Vec3 v = vec3_cross(u, direction(trial));
    const double reach = random_between(&trial->random, 0.005, 0.06);
    const bool all = random_below(&trial->random, 8) == 0,
               screwed = random_below(&trial->random, 10) == 0;
    pliant_cut_t message = {.sender = trial->client->sender,
                            .id = ++trial->client->next_id,
                            .body = (char *)(uintptr_t)(all ? "" : NAME[body])};
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
    return step_on(trial, 2);
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
    // A solid of 25 cm2 tears at 2500 Pa: a few newtons on a part of it do.
    const double most = body == 0 ? 4.0 : 1.0, force = random_between(&trial->random, 0.0, most);
    const double center[3] = {at.x, at.y, at.z},
                 newton[3] = {force * way.x, force * way.y, force * way.z};
    const Reply *reply = apply_load(trial->client, center, 0.012, newton, 0.02, NAME[body]);
    trial->made[TEAR] += reply->ok;
    return step_on(trial, 25);
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
    const int64_t step = step_on(trial, 1);
    // All tissue is back, in one piece.
    wait_until(trial->client, is_whole(trial, step));
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
    return step_on(trial, 1);
}

static Deed draw_deed(Trial *trial)
{
    int number = random_below(&trial->random, 100);
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
        print_message(" %lld %s,", (long long)trial->done[deed], DEED[deed]);
    print_message("\n%lld cuts cut; %lld loads taken; deltas %d and %d; farthest node %.2f and "
                  "%.2f m\n",
                  (long long)trial->made[CUT], (long long)trial->made[TEAR],
                  trial->follower[0].deltas, trial->follower[1].deltas, trial->follower[0].farthest,
                  trial->follower[1].farthest);
    const StatusSeen *status = &trial->client->status;
    for (int i = 0; i < status->reasons; i++)
        print_message("  %s %lld\n", status->reason[i], (long long)status->reason_count[i]);
}

TEST(whatever_takes_tissue_apart_keeps_meshes_pieces_masses_and_the_ledger)
{
    const long deeds = number_from("PLIANT_REMOVING_DEEDS", TRIALS(120, 10000));
    Trial trial = {
        .random =
            (uint64_t)number_from("PLIANT_REMOVING_SEED", 1) * UINT64_C(0x9E3779B97F4A7C15) + 1};
    const char *scene = scratch("removing.cfg"), *log = scratch("removing.log");
    write_volume("removing.nrrd");
    write_text(scene, SCENE);
    trial.client = client_create();
    follow(&trial);
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
    check(&trial, step_on(&trial, 1));
    while (trial.deed < deeds) {
        check(&trial, do_next(&trial));
        if (trial.deed % 10 == 0)
            check_followed(&trial);
    }
    report(&trial, client_now() - begin);
    // The guard has restored nothing without a tool or load that explains it.
    static const char *const never[] = {"restored_unknown", "restored_energy", "restored_time_step",
                                        "restored_set", "frozen_bodies"};
    for (size_t k = 0; k < sizeof never / sizeof *never; k++)
        if (refused(trial.client, never[k]) > 0)
            fail_msg("%s", never[k]);
    server_stop(trial.client, &pliantd);
    unfollow(&trial);
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
#endif
}
