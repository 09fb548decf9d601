// SPDX-License-Identifier: MIT
#include "removing.h"

enum { PIECES_MOST = 4096 };
static const double FASTEST = LOAD * (1e-3 * LOAD_TICKS) / 1.25e-4; // [m/s]

const char *const removing_body[BODIES] = {"organ", "wall"};
const char *const removing_deed[DEEDS] = {"cuts",
                                          "strokes",
                                          "presses of suction",
                                          "of the drill",
                                          "of diathermy",
                                          "loads that tear",
                                          "grasps",
                                          "presses of a probe",
                                          "ties",
                                          "resets",
                                          "checkpoints"};
const char *const removing_event[EVENTS] = {"cut",         "tear",           "piece", "remove",
                                            "cut_refused", "remove_refused", "tie",   "tie_broken"};
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
        assert_string_equal(status->body[b].name, removing_body[b]);
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
        assert_string_equal(of->body, removing_body[t / 2]);
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
    const bool was_near = trial->ledgers > 0 && trial->distance >= 0.0 && trial->now != RESET;
    expect_of(trial, region->touched ? region->distance == 0.0 : region->distance >= -1.0);
    expect_of(trial, !was_near || (region->distance >= 0.0 && region->distance <= trial->distance));
    trial->distance = region->distance;
    trial->ledgers++;
}

HANDLER(on_event, pliant_event_t, event)
{
    for (int k = 0; k < EVENTS; k++)
        ((Trial *)user)->events[k] += strcmp(event->kind, removing_event[k]) == 0;
}

void removing_follow(Trial *trial)
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
            snprintf(channel, sizeof channel, "PLIANT_%s_%s", heard[k].kind, removing_body[b]);
            follower->on[k] = lcm_subscribe(lcm, channel, heard[k].handler, follower);
            lcm_subscription_set_queue_capacity(follower->on[k], 4096);
        }
    }
    trial->on_status = pliant_status_t_subscribe(lcm, "PLIANT_STATUS", on_status, trial);
    trial->on_event = pliant_event_t_subscribe(lcm, "PLIANT_EVENT", on_event, trial);
    trial->on_ledger = pliant_ledger_t_subscribe(lcm, "PLIANT_LEDGER", on_ledger, trial);
    pliant_ledger_t_subscription_set_queue_capacity(trial->on_ledger, 4096);
}

void removing_unfollow(Trial *trial)
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
    pliant_event_t_unsubscribe(trial->client->lcm, trial->on_event);
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
        // False if it is not finite.
        expect_of(trial, distance < 0.2 + FASTEST * 1e-3 * (double)(trial->step - trial->reset_at));
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

// Messages of one moment leave one after the other.
bool removing_is_whole(const Trial *trial, int64_t step)
{
    for (int b = 0; b < BODIES; b++) {
        const Follower *follower = &trial->follower[b];
        if (!follower->nodes.head.whole || follower->nodes.step != step || !follower->mesh.whole ||
            follower->nodes.head.topology != follower->mesh.topology ||
            follower->mesh.topology != trial->topology[b] ||
            follower->mesh.node_count != follower->nodes.head.count)
            return false;
        // The body's mass is that of its ledger: sums of some thousand cells or faces.
        if (fabs(mass_of(trial, b) - trial->mass[b]) > 1e-9 * trial->mass[b])
            return false;
    }
    return trial->step == step && trial->ledgers > 0;
}

int64_t removing_step(Trial *trial, int ticks)
{
    const int64_t step = step_daemon(trial->client, ticks)->step;
    trial->client->replies = trial->client->events = 0;
    return step;
}

static void say_what_is_missing(const Trial *trial, int64_t step)
{
    for (int b = 0; b < BODIES; b++) {
        const Follower *follower = &trial->follower[b];
        print_error(
            "%s: frame of step %lld, topology %d; mesh %d, status %d; mass %.15g, by ledger "
            "%.15g\n",
            removing_body[b], (long long)follower->nodes.step, follower->nodes.head.topology,
            follower->mesh.topology, trial->topology[b], trial->mass[b], mass_of(trial, b));
    }
    fail_msg("deed %d (%s): messages of step %lld (status %lld) do not agree", trial->deed,
             removing_deed[trial->now], (long long)step, (long long)trial->step);
}

void removing_check(Trial *trial, int64_t step)
{
    for (int tries = 0; tries < 5 && !removing_is_whole(trial, step); tries++) {
        const double limit = client_now() + 2.0;
        while (!removing_is_whole(trial, step) && client_now() < limit)
            client_listen(trial->client, 20);
        if (removing_is_whole(trial, step))
            break;
        // A datagram was lost.
        command(trial->client, PLIANT_COMMAND_T_DESCRIBE, 0, "");
        if (tries > 0)
            step = removing_step(trial, 1);
    }
    if (!removing_is_whole(trial, step))
        say_what_is_missing(trial, step);
    for (int b = 0; b < BODIES; b++) {
        assert_int_equal(trial->follower[b].mesh.refused + trial->follower[b].nodes.head.refused,
                         0);
        check_nodes(trial, &trial->follower[b]);
        check_pieces(trial, b);
    }
    check_closed(trial, 0);
}

void removing_check_followed(Trial *trial)
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
