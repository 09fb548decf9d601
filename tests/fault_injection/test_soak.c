// SPDX-License-Identifier: MIT
// A long run: presses, loads, cuts, resets, lockstep and checkpoints in an order that a seed
// decides, while memory, files, threads and counters of the daemon are watched. Two things must
// hold however long it takes: its memory stays as it is, and a released body returns to
// where it was.
//   test_fault_injection --group soak PLIANTD SECONDS [SCENE [TSV [SEED]]]
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "figure.h"
#include "shown.h"

#include "effort.h"

#include "pliant_status_t.h"

#include <dirent.h>

// Memory that may come after the warm-up: a page here and there of liblcm's queues and of the
// allocator. A leak of one message's size (0.2 kB or more) in each of a minute's thousands is far
// more.
static const double GROWTH_KB = 64.0, GROWTH_SHARE = 0.01;
// Of the body's size: positions come as floats (6e-8 of them), and of a press of a tenth of the
// size e^-20 is left after the time that settle() waits for with the slowest decay of our scenes (5
// /s).
static const double DRIFT = 2e-6;
static const double SETTLE_S = 4.0; // simulated

typedef struct Sample {
    long rss_kb, anonymous_kb;
    int files, threads;
} Sample;

typedef struct Soak {
    Client *client;
    Process daemon;
    Shown *shown;
    char body[64];
    double rate_hz, step_us[4];
    uint64_t random;
    FILE *table;
    double start, warm, next_sample; // [s]
    Sample first, last;              // the first: after the warm-up
    bool warmed;
    bool wanders; // the body comes back by a reset only
    // the body at rest
    float *rest;
    int32_t *rest_id;
    int rest_count, rest_live;
    double center[3], size;  // [m]
    double drift, drift_max; // [m]
    int cycles, presses, cuts, cuts_made, loads, resets, compared, finer;
} Soak;

static const char *scene_path, *table_path;
static double seconds = 10.0;
static uint64_t seed = 1;

// --- chance ---

static double draw(Soak *soak, double low, double high)
{
    soak->random += UINT64_C(0x9e3779b97f4a7c15);
    uint64_t z = soak->random;
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return low + (high - low) * (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

static void draw_direction(Soak *soak, double d[3])
{
    double length;
    do {
        for (int k = 0; k < 3; k++)
            d[k] = draw(soak, -1.0, 1.0);
        length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    } while (length > 1.0 || length < 0.1);
    for (int k = 0; k < 3; k++)
        d[k] /= length;
}

// --- what is watched ---

static int entries(const Soak *soak, const char *of)
{
    char path[64];
    snprintf(path, sizeof path, "/proc/%d/%s", (int)soak->daemon.pid, of);
    DIR *folder = opendir(path);
    assert_non_null(folder);
    int count = 0;
    while (readdir(folder) != NULL)
        count++;
    closedir(folder);
    return count - 2; // . and ..
}

static Sample take_sample(const Soak *soak)
{
    Sample sample = {.files = entries(soak, "fd"), .threads = entries(soak, "task")};
    char path[64], line[256];
    snprintf(path, sizeof path, "/proc/%d/status", (int)soak->daemon.pid);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file) != NULL) {
        sscanf(line, "VmRSS: %ld", &sample.rss_kb);
        sscanf(line, "RssAnon: %ld", &sample.anonymous_kb);
    }
    fclose(file);
    return sample;
}

// A checkpoint that is being written has files open: the fewest of a few looks.
static Sample take_calm_sample(const Soak *soak)
{
    Sample calm = take_sample(soak);
    for (int i = 0; i < 20; i++) {
        client_listen(soak->client, 10);
        const Sample other = take_sample(soak);
        calm.files = other.files < calm.files ? other.files : calm.files;
    }
    return calm;
}

static void watch(Soak *soak, bool now)
{
    double time = client_now() - soak->start;
    if (!now && time < soak->next_sample)
        return;
    soak->next_sample = time + (seconds > 120.0 ? 10.0 : 1.0);
    const StatusSeen *status = &soak->client->status;
    soak->last = now || !soak->warmed ? take_calm_sample(soak) : take_sample(soak);
    if (!soak->warmed && time >= soak->warm) {
        soak->first = soak->last;
        soak->warmed = true;
    }
    if (soak->table != NULL)
        fprintf(
            soak->table,
            "%.1f\t%ld\t%ld\t%d\t%d\t%lld\t%lld\t%lld\t%lld\t%.1f\t%.1f\t%.3g\t%d\t%d\t%d\t%d\n",
            time, soak->last.rss_kb, soak->last.anonymous_kb, soak->last.files, soak->last.threads,
            (long long)status->step, (long long)status->late_ticks, (long long)status->resets,
            (long long)status->rejected, soak->step_us[0], soak->step_us[1], soak->drift,
            soak->cycles, soak->presses, soak->cuts_made, soak->resets);
}

HANDLER(on_status, pliant_status_t, m)
{
    Soak *soak = user;
    soak->rate_hz = m->rate_hz;
    memcpy(soak->step_us, m->step_us, sizeof soak->step_us);
    if (soak->body[0] == '\0' && m->num_bodies > 0)
        snprintf(soak->body, sizeof soak->body, "%s", m->body[0].name);
}

// --- what is done ---

// Returns the step after which it was done.
static int64_t request(Soak *soak, int kind, int64_t value, const char *argument)
{
    insist(soak->client, NULL, kind, value, argument);
    const int64_t step = find_reply(soak->client, soak->client->next_id)->step;
    soak->client->replies = soak->client->events = 0;
    return step;
}

static void send_at(Soak *soak, const double position[3], bool active)
{
    pliant_tool_pose_t pose = make_pose(soak->client, position);
    pose.active = active;
    send_pose(soak->client, &pose);
}

// From outside to a tenth of the size below the surface and back, from anywhere.
static void press(Soak *soak)
{
    enum { POSES = 60 };
    double d[3], reach = 0.0, position[3];
    draw_direction(soak, d);
    for (int i = 0; i < soak->rest_count; i++) {
        double along = 0.0;
        for (int k = 0; k < 3; k++)
            along += d[k] * ((double)soak->rest[3 * i + k] - soak->center[k]);
        reach = along > reach ? along : reach;
    }
    for (int i = 0; i <= POSES; i++) {
        double in = 0.5 - 0.5 * cos(6.283185 * i / POSES);
        double at = reach + soak->size * (0.15 - 0.25 * in);
        for (int k = 0; k < 3; k++)
            position[k] = soak->center[k] + at * d[k];
        send_at(soak, position, i < POSES);
        client_listen(soak->client, 5);
    }
    send_at(soak, position, false);
    soak->presses++;
}

static void load(Soak *soak)
{
    double d[3], force[3], center[3];
    draw_direction(soak, d);
    for (int k = 0; k < 3; k++) {
        center[k] = soak->center[k] + 0.3 * soak->size * d[k];
        force[k] = 0.05 * d[k];
    }
    send_load(soak->client, center, 0.3 * soak->size, force, 0.05, "");
    soak->loads++;
}

static void publish_cut(Client *client, const void *message)
{
    pliant_cut_t_publish(client->lcm, "PLIANT_CUT", message);
}

// A blade as long as the body, through its middle or near it.
static void cut(Soak *soak)
{
    double u[3], v[3], at[3];
    char all[] = "";
    draw_direction(soak, u);
    draw_direction(soak, v);
    pliant_cut_t message = {
        .sender = soak->client->sender, .id = ++soak->client->next_id, .body = all};
    for (int k = 0; k < 3; k++) {
        at[k] = soak->center[k] + draw(soak, -0.2, 0.2) * soak->size;
        message.before[0][k] = at[k] - soak->size * (u[k] + v[k]);
        message.before[1][k] = at[k] - soak->size * (u[k] - v[k]);
        message.after[0][k] = at[k] + soak->size * (u[k] - v[k]);
        message.after[1][k] = at[k] + soak->size * (u[k] + v[k]);
    }
    soak->cuts_made += answer_to(soak->client, message.id, publish_cut, &message)->ok;
    soak->cuts++;
}

// Lockstep: simulated time that takes no longer than it must.
static void settle(Soak *soak)
{
    enum { AT_ONCE = 200 };
    for (int64_t left = (int64_t)(SETTLE_S * soak->rate_hz); left > 0; left -= AT_ONCE)
        request(soak, PLIANT_COMMAND_T_STEP, left < AT_ONCE ? left : AT_ONCE, "");
}

// --- rest ---

// Whether what is shown is of this step or later.
static bool is_shown(const Shown *shown, int64_t step)
{
    return shown->nodes.head.whole && shown->mesh.whole &&
           shown->nodes.head.topology == shown->mesh.topology && shown->nodes.step >= step;
}

// The newest frame with the mesh that it belongs to. On a busy machine messages get lost: another
// step brings another frame, and DESCRIBE the mesh.
static void wait_for_frame(Soak *soak)
{
    for (int tries = 0; tries < 30; tries++) {
        const int64_t step = request(soak, PLIANT_COMMAND_T_STEP, 1, "");
        request(soak, PLIANT_COMMAND_T_DESCRIBE, 0, "");
        for (double limit = client_now() + 2.0; client_now() < limit;) {
            if (is_shown(soak->shown, step))
                return;
            client_listen(soak->client, 10);
        }
    }
    fail_msg("no frame came in a minute");
}

static int live_nodes(const MeshFrame *mesh)
{
    int live = 0;
    for (int i = 0; i < mesh->node_count; i++)
        live += mesh->id[i] >= 0;
    return live;
}

static void remember_rest(Soak *soak)
{
    double low[3] = {1e9, 1e9, 1e9}, high[3] = {-1e9, -1e9, -1e9};
    // Without the loads that a scene begins with, which a reset ends.
    request(soak, PLIANT_COMMAND_T_RESET, 0, "");
    settle(soak);
    wait_for_frame(soak);
    const NodesFrame *nodes = &soak->shown->nodes;
    soak->rest_count = nodes->head.count;
    soak->rest_live = live_nodes(&soak->shown->mesh);
    soak->rest = calloc((size_t)soak->rest_count, 3 * sizeof *soak->rest);
    soak->rest_id = calloc((size_t)soak->rest_count, sizeof *soak->rest_id);
    memcpy(soak->rest, nodes->position, 3 * sizeof(float) * (size_t)soak->rest_count);
    memcpy(soak->rest_id, soak->shown->mesh.id, sizeof(int32_t) * (size_t)soak->rest_count);
    for (int i = 0; i < 3 * soak->rest_count; i++) {
        double x = (double)soak->rest[i];
        if (soak->rest_id[i / 3] < 0)
            continue;
        low[i % 3] = x < low[i % 3] ? x : low[i % 3];
        high[i % 3] = x > high[i % 3] ? x : high[i % 3];
    }
    for (int k = 0; k < 3; k++) {
        soak->center[k] = 0.5 * (low[k] + high[k]);
        soak->size = high[k] - low[k] > soak->size ? high[k] - low[k] : soak->size;
    }
}

// How far the nodes that were there at first are from where they were. Slots keep their place.
static void compare_with_rest(Soak *soak)
{
    wait_for_frame(soak);
    const Shown *shown = soak->shown;
    double worst = 0.0;
    int same = 0;
    // Where faces stay fine at rest (a criterion between its two thresholds) another mesh is at
    // rest, and not quite in the same place.
    if (live_nodes(&shown->mesh) != soak->rest_live) {
        soak->finer++;
        return;
    }
    for (int i = 0; i < soak->rest_count && i < shown->nodes.head.count; i++) {
        if (soak->rest_id[i] < 0 || shown->mesh.id[i] != soak->rest_id[i])
            continue;
        same++;
        double square = 0.0;
        for (int k = 0; k < 3; k++) {
            double off = (double)shown->nodes.position[3 * i + k] - (double)soak->rest[3 * i + k];
            square += off * off;
        }
        worst = square > worst ? square : worst;
    }
    expect_at_least(same, 1.0);
    soak->drift = sqrt(worst);
    if (soak->drift > DRIFT * soak->size && soak->compared == 0 && !soak->wanders) {
        puts("the body does not come back by itself (nothing holds it, or it tears): it is reset "
             "before each comparison");
        soak->wanders = true;
        return;
    }
    soak->drift_max = soak->drift > soak->drift_max ? soak->drift : soak->drift_max;
    soak->compared++;
    if (soak->drift > DRIFT * soak->size)
        fail_msg(
            "after %d cycles the body is %.3g m off its rest shape, more than %.3g m (%d nodes "
            "now, %d at first)",
            soak->cycles, soak->drift, DRIFT * soak->size, live_nodes(&shown->mesh),
            soak->rest_live);
}

// Presses and loads, then back to rest; every now and then cuts, which a reset heals.
static void cycle(Soak *soak)
{
    bool cuts = draw(soak, 0.0, 1.0) < 0.3;
    request(soak, PLIANT_COMMAND_T_RESUME, 0, "");
    for (int n = (int)draw(soak, 1.0, 4.0); n > 0; n--) {
        press(soak);
        if (draw(soak, 0.0, 1.0) < 0.3)
            load(soak);
        if (cuts)
            cut(soak);
        watch(soak, false);
    }
    if (WITH_HDF5 && draw(soak, 0.0, 1.0) < 0.2)
        request(soak, PLIANT_COMMAND_T_CHECKPOINT, 0, "");
    if (scene_path == NULL && draw(soak, 0.0, 1.0) < 0.3) { // of ours we know what it was
        request(soak, PLIANT_COMMAND_T_SET, 0, "gravity=0.5 0 -1");
        client_listen(soak->client, 50);
        request(soak, PLIANT_COMMAND_T_SET, 0, "gravity=0 0 0");
    }
    if (cuts || draw(soak, 0.0, 1.0) < 0.1 || soak->wanders) {
        request(soak, PLIANT_COMMAND_T_RESET, 0, "");
        soak->resets++;
    }
    settle(soak);
    compare_with_rest(soak);
    // One page of history is enough for the comparison of frames, which no page requests here.
    memset(soak->shown->hash, 0, SHOWN_MOST * sizeof *soak->shown->hash);
    soak->cycles++;
    watch(soak, false);
}

// The threshold of curvature is so high that a sphere at rest is coarse.
static const char *write_scene_of_ours(void)
{
    return write_body_scene(
        "soak.cfg",
        &(SceneParts){.head = "rate_hz = 1000.0; publish = { nodes_hz = 60.0; mesh_hz = 1.0; "
                              "contact_hz = 500.0; status_hz = 5.0; };",
                      .name = "ball",
                      .source = ICO_SPHERE(162, 0.05),
                      .body = "levels = 2; cuttable = true;\n"
                              "adapt = { force = 0.005; speed = 0.3; curvature = 1.0; check_hz = "
                              "100.0; };\n" SMALL_SHAPE LOWER_FIXED,
                      .tail =
                          "tools = ( { id = 1; kind = \"probe\"; max_force = 5.0;\n"
                          "  capsules = ( { from = [0.0, 0.0, 0.0]; radius = 0.006; } ); } );\n"});
}

static void begin(Soak *soak)
{
    soak->random = seed;
    soak->client = client_create();
    pliant_status_t_subscription_t *on =
        pliant_status_t_subscribe(soak->client->lcm, "PLIANT_STATUS", on_status, soak);
    assert_non_null(on);
    const char *scene = scene_path != NULL ? scene_path : write_scene_of_ours();
    daemon_start(&soak->daemon, WITH_HDF5 ? "--checkpoint %s --checkpoint-every 5 %s" : "%.0s%s",
                 scratch("soak.h5"), scene);
    wait_until(soak->client, soak->body[0] != '\0');
    soak->shown = shown_create(soak->client->lcm, soak->body);
    if (table_path != NULL) {
        soak->table = fopen(table_path, "w");
        assert_non_null(soak->table);
        setvbuf(soak->table, NULL, _IOLBF, 0); // to be watched
        fputs("time_s\trss_kb\tanonymous_kb\tfiles\tthreads\tstep\tlate_ticks\tresets\trejected\t"
              "step_p50_us\tstep_p99_us\tdrift_m\tcycles\tpresses\tcuts\tresets_asked\n",
              soak->table);
    }
    soak->start = client_now();
    soak->warm = 0.25 * seconds < 120.0 ? 0.25 * seconds : 120.0;
    remember_rest(soak);
}

static int read_arguments(void **state)
{
    (void)state;
    seconds = strtod(test_argument(2), NULL);
    scene_path = test_argument(3)[0] != '\0' ? test_argument(3) : NULL;
    table_path = test_argument(4)[0] != '\0' ? test_argument(4) : NULL;
    seed = test_argument(5)[0] != '\0' ? strtoull(test_argument(5), NULL, 10) : 1;
    return 0;
}

AROUND_ALL(read_arguments, NULL)

TEST(a_long_run_keeps_its_memory_and_its_rest_shape)
{
    static Soak soak;
    begin(&soak);
    while (client_now() - soak.start < seconds)
        cycle(&soak);
    // On a busy machine a checkpoint may take seconds; what leaks stays.
    const double patience = client_now() + 15.0;
    do
        watch(&soak, true);
    while (soak.last.files > soak.first.files && client_now() < patience);
    client_fresh_status(soak.client);
    const StatusSeen status = soak.client->status;
    process_end(&soak.daemon);
    double grown = (double)(soak.last.rss_kb - soak.first.rss_kb);
    double allowed = GROWTH_SHARE * (double)soak.first.rss_kb;
    allowed = allowed > GROWTH_KB ? allowed : GROWTH_KB;
    figure("soak of %.0f s, %d cycles: %d presses, %d loads, %d cuts (%d made), %d resets asked; "
           "memory %ld kB %+.0f kB after the first %.0f s, files %d, threads %d; %lld ticks, %lld "
           "late, %lld refused, %lld states restored; rest shape off by at most %.2g m of %.2g m "
           "(%d times compared, %d times finer than at first)",
           client_now() - soak.start, soak.cycles, soak.presses, soak.loads, soak.cuts,
           soak.cuts_made, soak.resets, soak.first.rss_kb, grown, soak.warm, soak.last.files,
           soak.last.threads, (long long)status.step, (long long)status.late_ticks,
           (long long)status.rejected, (long long)status.resets, soak.drift_max, soak.size,
           soak.compared, soak.finer);
    assert_true(soak.warmed && soak.compared > 0);
    if (EFFORT(6) == 6) // sanitizers keep what is freed
        expect_at_most(grown, allowed);
    assert_true(soak.last.files <= soak.first.files);
    assert_int_equal(soak.last.threads, soak.first.threads);
    if (soak.table != NULL)
        fclose(soak.table);
}
