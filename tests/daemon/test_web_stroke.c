// SPDX-License-Identifier: MIT
// A blade that a page moves through a real pliant-web and daemon, while the browser stalls: one
// stroke and one slit, along the whole way.
#include "test.h"
#include "lcm_client.h"
#include "page_client.h"
#include "random.h"
#include "scene_writer.h"

#include <math.h>

// A free slab of 10 x 10 x 2 cells of 10 mm; tools are withdrawn after 0.2 s, as by default.
static const char SCENE[] =
    "name = \"stroke\"; rate_hz = 500.0; publish = { nodes_hz = 10.0; };\n"
    "bodies = ( { name = \"slab\"; model = \"voxel\"; cuttable = true;\n"
    "             material = { youngs_modulus = 1.0e4; density = 1000.0; };\n"
    "             voxels = { generator = \"box\"; count = [10, 10, 2]; size = 0.01; }; } );\n"
    "tools = ( { id = 2; kind = \"blade\"; edge = ([0.0, 0.0, -0.05], [0.0, 0.0, 0.05]); } );\n";

// The hand goes 7 cm into the slab, midway between two columns of cells, and 7 cm out sideways,
// midway between two rows: 5 x 2 links are on the first leg and 5 x 2 on the second.
static const double SPEED = 0.07; // [m/s]
enum { SEVERED = 20 };

static void send_blade(PageClient *page, double time, bool active)
{
    page_send(page,
              "{\"type\":\"tool\",\"tool\":2,\"position\":[%.6f,%.6f,0],\"orientation\":[1,0,0,0],"
              "\"grip\":0,\"time\":%.4f,\"active\":%s}",
              SPEED * fmax(time - 1.0, 0.0), SPEED * (fmin(time, 1.0) - 1.0), 50.0 + time,
              active ? "true" : "false");
}

static int count_events(const Client *client, const char *kind)
{
    int count = 0;
    for (int k = 0; k < client->events; k++)
        count += strcmp(client->event[k].kind, kind) == 0;
    return count;
}

typedef struct Rig {
    Process daemon, server;
    Client *client;
    PageClient *page;
} Rig;

static void begin(Rig *rig)
{
    const char *path = scratch("stroke.cfg");
    write_text(path, SCENE);
    daemon_start(&rig->daemon, "%s", path);
    const int port = web_start(&rig->server, "--port 0");
    rig->client = client_create();
    client_wait_for_daemon(rig->client);
    rig->page = page_open(port);
    page_wait(page_count(rig->page, "scene") > 0);
    rig->client->events = 0;
}

static void end(Rig *rig)
{
    page_disconnect_all();
    client_destroy(rig->client);
    process_end(&rig->server);
    process_end(&rig->daemon);
}

static void expect_cut(const Client *client, const char *part)
{
    for (int k = 0; k < client->events; k++)
        if (strcmp(client->event[k].kind, "cut") == 0)
            expect_in(client->event[k].text, part);
}

TEST(a_blade_of_a_page_that_stalls_makes_one_slit_along_its_whole_way)
{
    Rig rig;
    begin(&rig);
    uint64_t chance = 37;
    // Gaps of 50 to 600 ms, then what the pointer did meanwhile, in a burst.
    const double began = client_now();
    double sent = 0.0;
    send_blade(rig.page, 0.0, true);
    while (sent < 2.0) {
        const double until = client_now() + random_between(&chance, 0.05, 0.6);
        while (client_now() < until)
            client_listen(rig.client, 10);
        for (double moved = client_now() - began; sent < 2.0 && sent + 0.016 < moved;) {
            sent = fmin(sent + 0.016, 2.0);
            send_blade(rig.page, sent, true);
        }
    }
    send_blade(rig.page, 2.0, false);
    wait_until(rig.client, saw_event(rig.client, "cut"));
    client_listen(rig.client, 300);
    assert_int_equal(count_events(rig.client, "cut"), 1);
    char text[80];
    snprintf(text, sizeof text, "tool 2, stroke ended: body 'slab': %d links severed", SEVERED);
    expect_cut(rig.client, text);
    expect_cut(rig.client, "2 pieces");
    end(&rig);
}

TEST(a_blade_of_a_page_that_falls_silent_is_withdrawn)
{
    Rig rig;
    begin(&rig);
    const double began = client_now();
    for (double sent = 0.0; sent < 0.9; sent = client_now() - began) {
        send_blade(rig.page, sent, true);
        client_listen(rig.client, 20);
    }
    // Its connection stays: only what it says is missing.
    const double silent = client_now();
    wait_until(rig.client, saw_event(rig.client, "cut"));
    // A second of repeats and tool_timeout_s; clocks of several processes meet here.
    expect_at_least(client_now() - silent, 1.1);
    expect_cut(rig.client, "1 piece");
    assert_false(page_closed(rig.page));
    end(&rig);
}
