// SPDX-License-Identifier: MIT
// The step thread allocates nothing, locks nothing and asks nothing of the kernel but the clock,
// the sleep and, while contacts are published, one eventfd write a tick.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

static long counted(const char *path, const char *name)
{
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    char key[32];
    long value = -1, found = -1;
    while (fscanf(file, "%31s %ld", key, &value) == 2)
        if (strcmp(key, name) == 0)
            found = value;
    fclose(file);
    assert_true(found >= 0);
    return found;
}

static Client *start_watched(const char *counts, const char *options, const char *scene,
                             Process *daemon)
{
    Client *client = client_create();
    server_start_for(client, daemon, "PLIANT_COUNT_CALLS=%s LD_PRELOAD=%s %s %s", counts,
                     test_argument(2), options, scene);
    return client;
}

// Returns the sleeps, that is the daemon's ticks.
static long end_watched(const char *counts, Client *client, Process *daemon)
{
    process_end(daemon);
    client_destroy(client);
    long sleeps = counted(counts, "sleep");
    // The end may fall between a sleep and its tick.
    assert_in_range(sleeps - printed(daemon, "ticks"), 0, 1);
    return sleeps;
}

// Runs the daemon with poses and loads for about a second.
static long run_watched(const char *counts, double contact_hz, const char *options, Process *daemon)
{
    char head[256];
    snprintf(head, sizeof head,
             "publish = { nodes_hz = 60.0; contact_hz = %.1f; status_hz = 20.0; };", contact_hz);
    Client *client =
        start_watched(counts, options, write_scene("silence.cfg", head, PROBE_TOOL), daemon);
    const double top[3] = {0.0, 0.0, 0.05}, down[3] = {0.0, 0.0, -0.1};
    send_load(client, top, 0.03, down, 0.2, "");
    send_command(client, PLIANT_COMMAND_T_SET, 0, "gravity_z=-1");
    for (int i = 0; i < 500; i++) {
        send_pose_at(client, (const double[]){0.0, 0.0, 0.06 - 2e-5 * i});
        client_listen(client, 2);
    }
    return end_watched(counts, client, daemon);
}

static void expect_silence(const char *counts)
{
    assert_int_equal(counted(counts, "allocate"), 0);
    assert_int_equal(counted(counts, "free"), 0);
    assert_int_equal(counted(counts, "lock"), 0);
    assert_int_equal(counted(counts, "read"), 0);
    assert_int_equal(counted(counts, "poll"), 0);
    assert_int_equal(counted(counts, "syscall"), 0);
}

TEST(with_contacts_a_tick_writes_one_eventfd)
{
    const char *counts = scratch("contacts.txt");
    long ticks = run_watched(counts, 1000.0, "", &pliantd);
    expect_silence(counts);
    expect_at_most((double)counted(counts, "write"), (double)ticks);
    expect_at_least((double)counted(counts, "write"), 1.0); // the counting works
}

TEST(without_contacts_a_tick_writes_nothing)
{
    const char *counts = scratch("quiet.txt");
    run_watched(counts, 0.0, "", &pliantd);
    expect_silence(counts);
    assert_int_equal(counted(counts, "write"), 0);
}

TEST(files_add_nothing_to_a_tick)
{
    if (!WITH_HDF5)
        skip();
    const char *counts = scratch("files.txt");
    char options[2500];
    snprintf(options, sizeof options,
             "--record %s --checkpoint %s --checkpoint-every 0.1 --log-inputs %s",
             scratch("silence.h5"), scratch("checkpoint.h5"), scratch("inputs.log"));
    run_watched(counts, 0.0, options, &pliantd);
    expect_silence(counts);
    assert_int_equal(counted(counts, "write"), 0);
    expect_in(pliantd.out, "recorded frames: ");
}

#if WITH_SURFACE && WITH_VOXEL
// Messages, strokes, tears, presses and a RESET, on both kinds of bodies.
TEST(cuts_add_nothing_to_a_tick)
{
    static const char scene[] =
        "name = \"cuts\"; publish = { status_hz = 20.0; contact_hz = 0.0; };\n"
        "bodies = ( { name = \"box\"; model = \"voxel\"; levels = 1; cuttable = true;\n"
        "    voxels = { generator = \"box\"; count = [8, 8, 8]; size = 0.005; };\n"
        "    tear = { stress = 200.0; }; },\n"
        "  { name = \"ball\"; model = \"surface\"; levels = 1; cuttable = true; shape = {};\n"
        "    mesh = { generator = \"ico_sphere\"; nodes = 162; radius = 0.03; };\n"
        "    tear = { stretch = 0.2; }; } );\n"
        "tools = ( { id = 1; kind = \"probe\"; max_force = 5.0;\n"
        "            capsules = ( { from = [0.0, 0.0, 0.0]; radius = 0.005; } ); },\n"
        "          { id = 2; kind = \"blade\"; edge = ([0.0, 0.0, 0.0], [0.0, 0.0, 0.08]); } );\n";
    const char *counts = scratch("cuts.txt"), *path = scratch("cuts.cfg");
    write_text(path, scene);
    Client *client = start_watched(counts, "", path, &pliantd);
    char all[] = "";
    int last = 0;
    for (int i = 0; i < 400; i++) {
        double y = 1e-3 * (i % 100 - 50);
        const double top[3] = {0.0, 0.0, 0.03 - 5e-5 * i}, tip[3] = {0.0031, y, -0.04};
        pliant_tool_pose_t probe = make_pose(client, top), blade = make_pose(client, tip);
        blade.tool = 2;
        blade.active = i % 100 != 99;
        send_pose(client, &probe);
        send_pose(client, &blade);
        if (i % 20 == 10) {
            double x = -0.03 + 1.6e-4 * i;
            pliant_cut_t cut = {.sender = client->sender,
                                .id = last = ++client->next_id,
                                .before = {{x, -0.05, -0.05}, {x, -0.05, 0.05}},
                                .after = {{x, 0.05, -0.05}, {x, 0.05, 0.05}},
                                .body = all};
            pliant_cut_t_publish(client->lcm, "PLIANT_CUT", &cut);
        }
        if (i == 250)
            command(client, PLIANT_COMMAND_T_RESET, 0, "");
        client_listen(client, 2);
    }
    wait_until(client, find_reply(client, last) != NULL);
    assert_true(saw_event(client, "cut"));
    assert_true(saw_event(client, "piece"));
    end_watched(counts, client, &pliantd);
    expect_silence(counts);
}
#endif
