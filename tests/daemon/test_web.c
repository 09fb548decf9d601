// SPDX-License-Identifier: MIT
// pliant-web between a real daemon and pages: what they see, what they may do, who may come in, and
// what happens when daemon or page goes.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "page_client.h"

#include "pliant_claim_t.h"
#include "pliant_reply_t.h"
#include "pliant_status_t.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char SCENE[] =
    "name = \"pages\"; rate_hz = 200.0; tool_timeout_s = 20.0;\n"
    "publish = { status_hz = 10.0; nodes_hz = 30.0; contact_hz = 200.0; rest = true; };\n"
    "bodies = (\n"
    "  { name = \"ball\"; model = \"surface\"; cuttable = true; shape = {};\n"
    "    mesh = { generator = \"ico_sphere\"; nodes = 162; radius = 0.03; }; },\n"
    "  { name = \"hard\"; model = \"surface\"; shape = {};\n"
    "    mesh = { generator = \"ico_sphere\"; nodes = 42; radius = 0.03;\n"
    "             place = { translation = [0.4, 0.0, 0.0]; }; }; } );\n"
    "tools = ( { id = 1; kind = \"probe\"; max_force = 5.0;\n"
    "            capsules = ( { from = [0.0, 0.0, 0.0]; radius = 0.005; } ); },\n"
    "          { id = 2; kind = \"blade\"; edge = ([0.0, 0.0, 0.0], [0.0, 0.0, 0.06]); } );\n";

enum { ANSWER = 8192 };

// --- the two programs ---

static void start_daemon(Process *daemon, const char *scene)
{
    daemon_start(daemon, "%s", scene);
}

static const char *scene_path(void)
{
    const char *path = scratch("pages.cfg");
    write_text(path, SCENE);
    return path;
}

typedef struct Rig {
    Process daemon, server;
    int port;
} Rig;

static Rig rig;

static void begin(const char *arguments)
{
    char line[512];
    start_daemon(&rig.daemon, scene_path());
    rig.port = web_start(&rig.server, program_path("pliant-web"), arguments, line);
}

static void end(void)
{
    process_end(&rig.server);
    process_end(&rig.daemon);
}

static PageClient *open_page(void)
{
    char why[256] = "";
    PageClient *page = page_connect(rig.port, "/live", NULL, why);
    if (page == NULL)
        fail_msg("not connected: %s", why);
    return page;
}

static void send_tool(PageClient *page, double z, bool active)
{
    page_send(page,
              "{\"type\":\"tool\",\"tool\":1,\"position\":[0,0,%.4f],\"orientation\":[1,0,0,0],"
              "\"grip\":0,\"active\":%s}",
              z, active ? "true" : "false");
}

// --- what a page sees ---

AROUND_EACH(NULL, harness_teardown)

TEST(a_page_learns_the_scene_and_follows_every_body)
{
    begin("--port 0");
    PageClient *page = open_page();
    page_wait(page_body(page, 0).frames > 3 && page_body(page, 1).frames > 3);
    page_wait(page_body(page, 0).rests > 0 && page_count(page, "status") > 1);
    page_wait(page_count(page, "contact") > 0 && page_count(page, "link") > 0);
    assert_string_equal(page->first, "hello");
    assert_true(page_says(page, "hello", "\"prefix\":\"PLIANT\",\"read_only\":false"));
    assert_true(page_says(page, "scene", "{\"name\":\"ball\",\"model\":\"surface\"}"));
    assert_true(page_says(page, "scene",
                          "{\"id\":1,\"kind\":\"probe\",\"max_force\":5.0,\"capsules\":[{\"from\":"
                          "[0.0,0.0,0.0],\"to\":[0.0,0.0,0.0],\"radius\":0.005}]}"));
    assert_true(page_says(page, "scene", "\"edge\":[[0.0,0.0,0.0],[0.0,0.0,0.06]]"));
    assert_true(page_says(page, "status", "\"state\":\"running\""));
    PageBody ball = page_body(page, 0), hard = page_body(page, 1);
    assert_int_equal(ball.nodes, 162);
    assert_int_equal(ball.triangles, 320);
    assert_int_equal(hard.nodes, 42);
    assert_true(ball.matched && hard.matched);
    // The daemon repeats its meshes every second; what has not changed is not sent again.
    int status = page_count(page, "status");
    page_wait(page_count(page, "status") > status + 15);
    assert_int_equal(page_body(page, 0).meshes, 1);
    page_disconnect(page);
    end();
}

// Positions come as packets, here without any floats.
TEST(a_page_follows_positions_in_packets)
{
    static char text[sizeof SCENE + 64];
    const char *publish = strstr(SCENE, "publish = {"), *path = scratch("packets.cfg");
    snprintf(text, sizeof text, "%.*spublish = { positions = \"packets\";%s",
             (int)(publish - SCENE), SCENE, publish + strlen("publish = {"));
    write_text(path, text);
    start_daemon(&rig.daemon, path);
    char line[512];
    rig.port = web_start(&rig.server, program_path("pliant-web"), "--port 0", line);
    PageClient *page = open_page();
    page_wait(page_body(page, 0).frames > 3 && page_body(page, 1).frames > 3);
    assert_int_equal(page_body(page, 0).nodes, 162);
    assert_true(page_body(page, 0).matched && page_body(page, 1).matched);
    page_disconnect(page);
    end();
}

TEST(a_page_that_stalls_holds_up_nobody_and_then_gets_the_newest)
{
    begin("--port 0");
    PageClient *stalled = open_page(), *other = open_page();
    page_wait(page_body(stalled, 0).frames > 0 && page_body(other, 0).frames > 0);
    pthread_mutex_lock(&stalled->lock);
    stalled->answers = false;
    int had = stalled->rounds;
    pthread_mutex_unlock(&stalled->lock);
    int rounds = page_rounds(other);
    page_wait(page_rounds(other) > rounds + 25);
    int stopped_at = page_rounds(stalled);
    expect_at_most(stopped_at, had + 1); // one answer may have been under way
    double newest = page_body(other, 0).step;
    page_answer(stalled);
    page_wait(page_rounds(stalled) > stopped_at);
    // The first round after is of now, not of then.
    expect_at_least(page_body(stalled, 0).step, newest);
    page_disconnect(stalled);
    page_disconnect(other);
    end();
}

// --- what it does ---

typedef struct PoseSeen {
    int count;
    pliant_tool_pose_t pose;
} PoseSeen;

static void on_pose(const lcm_recv_buf_t *buffer, const char *channel,
                    const pliant_tool_pose_t *pose, void *user)
{
    (void)buffer;
    (void)channel;
    PoseSeen *seen = user;
    seen->count++;
    seen->pose = *pose;
}

TEST(a_pose_presses_the_body_and_is_withdrawn_with_the_page)
{
    begin("--port 0");
    Client *client = client_create();
    PoseSeen seen = {0};
    pliant_tool_pose_t_subscription_t *poses =
        pliant_tool_pose_t_subscribe(client->lcm, "PLIANT_TOOL_POSE", on_pose, &seen);
    client_wait_for_daemon(client);
    PageClient *page = open_page(), *other = open_page();
    page_wait(page_count(page, "scene") > 0);
    for (double z = 0.045; z > 0.03; z -= 0.0005) {
        send_tool(page, z, true);
        client_listen(client, 20);
    }
    wait_until(client, client->contacts > 0 && client->contact.contact);
    expect_at_least(client->contact.force[2], 1e-4); // on the tool, away from the ball
    page_wait(page_says(page, "contact", "\"contact\":true"));
    page_wait(page_says(page, "pose", "\"active\":true,\"ours\":true"));
    page_wait(page_says(other, "pose", "\"active\":true,\"ours\":false"));
    assert_true(seen.pose.active);
    int32_t sender = seen.pose.sender;
    page_disconnect(page);
    wait_until(client, !seen.pose.active);
    assert_int_equal(seen.pose.sender, sender);
    assert_int_equal(seen.pose.tool, 1);
    wait_until(client, !client->contact.contact);
    page_wait(page_says(other, "pose", "\"active\":false"));
    page_disconnect(other);
    pliant_tool_pose_t_unsubscribe(client->lcm, poses);
    client_destroy(client);
    end();
}

TEST(a_cut_changes_the_mesh_and_is_answered_to_whom_asked)
{
    begin("--port 0");
    PageClient *page = open_page(), *other = open_page();
    page_wait(page_body(page, 0).frames > 0 && page_body(other, 0).frames > 0);
    page_send(page, "{\"type\":\"cut\",\"id\":12,\"body\":\"ball\","
                    "\"before\":[[0.0051,-0.05,-0.05],[0.0051,-0.05,0.05]],"
                    "\"after\":[[0.0051,0.05,-0.05],[0.0051,0.05,0.05]]}");
    page_wait(page_count(page, "reply") > 0);
    assert_true(page_says(page, "reply", "\"id\":12,\"ok\":true"));
    assert_true(page_says(page, "reply", "\"pieces\":2"));
    page_wait(page_body(page, 0).meshes > 1 && page_body(other, 0).meshes > 1);
    page_wait(page_body(page, 0).frame_topology == page_body(page, 0).topology);
    assert_true(page_body(page, 0).matched);
    page_wait(page_count(other, "event") > 0);
    // A command that the daemon refuses, and one that the server does.
    page_send(page, "{\"type\":\"command\",\"id\":13,\"kind\":\"set\",\"argument\":\"nothing=1\"}");
    page_wait(page_says(page, "reply", "\"id\":13,\"ok\":false"));
    page_send(page, "{\"type\":\"command\",\"id\":14,\"kind\":\"set\",\"argument\":7}");
    page_wait(page_says(page, "error", "argument: expected a text"));
    page_send(page, "{\"type\":\"command\",\"id\":15,\"kind\":\"pause\"}");
    page_wait(page_says(page, "status", "\"state\":\"paused\""));
    // A client that comes late to a paused daemon sees it all the same.
    PageClient *late = open_page();
    page_wait(page_body(late, 0).frames > 0 && page_body(late, 1).frames > 0);
    assert_int_equal(page_count(other, "reply"), 0);
    page_disconnect(late);
    page_disconnect(page);
    page_disconnect(other);
    end();
}

TEST(a_read_only_server_shows_and_does_nothing)
{
    begin("--port 0 --read-only");
    Client *client = client_create();
    PoseSeen seen = {0};
    pliant_tool_pose_t_subscription_t *poses =
        pliant_tool_pose_t_subscribe(client->lcm, "PLIANT_TOOL_POSE", on_pose, &seen);
    PageClient *page = open_page();
    page_wait(page_body(page, 0).frames > 0);
    assert_true(page_says(page, "hello", "\"read_only\":true"));
    send_tool(page, 0.045, true);
    page_wait(page_count(page, "error") > 0);
    page_send(page, "{\"type\":\"command\",\"id\":1,\"kind\":\"stop\"}");
    page_wait(page_count(page, "error") > 1);
    assert_true(page_says(page, "error", "this server only shows"));
    client_fresh_status(client); // by now a pose would have come
    assert_int_equal(seen.count, 0);
    assert_int_equal(page_count(page, "reply"), 0);
    page_disconnect(page);
    pliant_tool_pose_t_unsubscribe(client->lcm, poses);
    client_destroy(client);
    end(); // the daemon has not been stopped
}

// --- who may come in ---

static int upgrade(int port, const char *host, const char *more)
{
    char request[1024], answer[ANSWER];
    snprintf(request, sizeof request,
             "GET /live HTTP/1.1\r\nHost: %s\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
             "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n%s\r\n",
             host, more);
    return http_request(port, request, answer, sizeof answer);
}

static int get(int port, const char *method, const char *path, const char *more, char *answer)
{
    char request[1024];
    snprintf(request, sizeof request, "%s %s HTTP/1.1\r\nHost: localhost:%d\r\n%s\r\n", method,
             path, port, more);
    return http_request(port, request, answer, ANSWER);
}

TEST(pages_of_other_sites_stay_outside)
{
    char line[512];
    Process server;
    int port = web_start(&server, program_path("pliant-web"), "--port 0", line);
    assert_int_equal(upgrade(port, "127.0.0.1:8080", ""), 101);
    assert_int_equal(upgrade(port, "127.0.0.1:8080", "Origin: http://127.0.0.1:8080\r\n"), 101);
    assert_int_equal(upgrade(port, "127.0.0.1:8080", "Origin: http://evil.example\r\n"), 403);
    assert_int_equal(upgrade(port, "127.0.0.1:8080", "Origin: null\r\n"), 403);
    // Its own name, pointed here: origin and host agree, and are not ours.
    assert_int_equal(upgrade(port, "evil.example:8080", "Origin: http://evil.example:8080\r\n"),
                     403);
    char why[256];
    assert_null(page_connect(port, "/live", "http://evil.example", why));
    process_end(&server);
}

TEST(only_files_of_the_page_are_served)
{
    char line[512], answer[ANSWER], arguments[PATH_TEXT * 4];
    write_text(scratch("index.html"), "the page itself");
    write_text(scratch(".hidden"), "hidden");
    write_text(scratch("tissue.png"), "\x89PNG\r\n\x1a\nand so on");
    assert_int_equal(symlink("/etc/passwd", scratch("link.txt")), 0);
    Process server;
    snprintf(arguments, sizeof arguments, "--port 0 --page %s --texture ball=%s", scratch(""),
             scratch("tissue.png"));
    int port = web_start(&server, program_path("pliant-web"), arguments, line);
    assert_int_equal(get(port, "GET", "/", "", answer), 200);
    assert_non_null(strstr(answer, "the page itself"));
    static const char *const headers[] = {"Content-Security-Policy: default-src 'none'",
                                          "X-Content-Type-Options: nosniff",
                                          "X-Frame-Options: DENY", "Content-Type: text/html"};
    for (size_t k = 0; k < sizeof headers / sizeof *headers; k++) {
        if (strstr(answer, headers[k]) == NULL)
            fail_msg("no '%s' in: %s", headers[k], answer);
    }
    static const char *const missing[] = {"/no.html",
                                          "/.hidden",
                                          "/link.txt",
                                          "/../../../../etc/passwd",
                                          "/%2e%2e/%2e%2e/etc/passwd",
                                          "//etc/passwd",
                                          "/sub/../../etc/passwd",
                                          "/index.html%00.png",
                                          "/texture/hard",
                                          "/texture/../index.html"};
    for (size_t k = 0; k < sizeof missing / sizeof *missing; k++) {
        int code = get(port, "GET", missing[k], "", answer);
        if (code != 404 && code != 400 && strstr(answer, "the page itself") == NULL)
            fail_msg("%s: %d %s", missing[k], code, answer);
        assert_null(strstr(answer, "root:"));
        assert_null(strstr(answer, "hidden"));
    }
    assert_int_equal(get(port, "GET", "/texture/ball", "", answer), 200);
    assert_non_null(strstr(answer, "Content-Type: image/png"));
    static const char *const methods[] = {"POST", "PUT", "DELETE", "OPTIONS", "HEAD", "PROPFIND"};
    for (size_t k = 0; k < sizeof methods / sizeof *methods; k++)
        assert_int_equal(get(port, methods[k], "/", "Content-Length: 0\r\n", answer), 405);
    assert_int_equal(get(port, "GET", "/live", "", answer), 426);
    process_end(&server);
}

TEST(where_others_can_listen_a_token_is_needed)
{
    char line[512], answer[ANSWER], arguments[PATH_TEXT * 4], why[256], path[128];
    write_text(scratch("token"), "0123456789abcdefXYZ\n");
    Process server;
    snprintf(arguments, sizeof arguments, "--listen 127.0.0.1:0 --token %s", scratch("token"));
    int port = web_start(&server, program_path("pliant-web"), arguments, line);
    assert_non_null(strstr(line, "/?token=0123456789abcdefXYZ"));
    assert_int_equal(get(port, "GET", "/", "", answer), 403);
    assert_int_equal(get(port, "GET", "/?token=0123456789abcdefXYz", "", answer), 403);
    assert_int_equal(upgrade(port, "127.0.0.1", ""), 403);
    assert_null(page_connect(port, "/live", NULL, why));
    assert_null(page_connect(port, "/live?token=1", NULL, why));
    // The address with the token gives a cookie, and with that all the rest opens.
    assert_int_equal(get(port, "GET", "/?token=0123456789abcdefXYZ", "", answer), 303);
    assert_non_null(strstr(answer, "Location: /\r\n"));
    assert_non_null(strstr(answer, "HttpOnly; SameSite=Strict"));
    snprintf(path, sizeof path, "Set-Cookie: pliant_token_%d=0123456789abcdefXYZ;", port);
    assert_non_null(strstr(answer, path));
    snprintf(path, sizeof path, "Cookie: pliant_token_%d=0123456789abcdefXYZ\r\n", port);
    assert_int_equal(get(port, "GET", "/", path, answer), 200);
    assert_int_equal(upgrade(port, "127.0.0.1", path), 101);
    PageClient *page = page_connect(port, "/live?token=0123456789abcdefXYZ", NULL, why);
    assert_non_null(page);
    page_wait(page_count(page, "hello") > 0);
    page_disconnect(page);
    process_end(&server);
}

TEST(there_is_an_end_to_connections)
{
    char line[512], why[256];
    Process server;
    int port = web_start(&server, program_path("pliant-web"), "--port 0", line);
    PageClient *page[16];
    for (int k = 0; k < 16; k++) {
        page[k] = page_connect(port, "/live", NULL, why);
        assert_non_null(page[k]);
        page_wait(page_count(page[k], "hello") > 0);
    }
    assert_int_equal(upgrade(port, "127.0.0.1", ""), 503);
    page_disconnect(page[7]);
    page_wait(upgrade(port, "127.0.0.1", "") == 101);
    for (int k = 0; k < 16; k++) {
        if (k != 7)
            page_disconnect(page[k]);
    }
    process_end(&server);
}

TEST(hostile_frames_close_their_connection_only)
{
    char line[512];
    Process server;
    rig.port = web_start(&server, program_path("pliant-web"), "--port 0", line);
    PageClient *good = open_page(), *bad = open_page(), *big = open_page();
    page_send_frame(bad, 0x82, "\x01\x02", 2);
    page_wait(page_closed(bad));
    char *much = malloc(100000);
    assert_non_null(much);
    memset(much, 'x', 100000);
    page_send_frame(big, 0x81, much, 100000);
    free(much);
    page_wait(page_closed(big));
    page_send(good, "{\"type\":\"tool\"");
    page_wait(page_says(good, "error", "not JSON"));
    page_disconnect(good);
    page_disconnect(bad);
    page_disconnect(big);
    process_end(&server);
}

// --- comings and goings of daemons ---

typedef struct CommandsSeen {
    int count;
    bool same; // all by one sender with one number
    pliant_command_t first;
} CommandsSeen;

static void on_command(const lcm_recv_buf_t *buffer, const char *channel,
                       const pliant_command_t *command, void *user)
{
    (void)buffer;
    (void)channel;
    CommandsSeen *seen = user;
    if (command->kind != PLIANT_COMMAND_T_PAUSE)
        return;
    if (seen->count++ == 0)
        seen->first = *command;
    seen->same = command->sender == seen->first.sender && command->id == 3 && seen->first.id == 3;
}

// A daemon that says that it is there, and no more.
static void on_claim(const lcm_recv_buf_t *buffer, const char *channel, const pliant_claim_t *claim,
                     void *user)
{
    (void)buffer;
    const pliant_claim_t answer = {.daemon = 5, .answers = claim->question};
    if (claim->question != 0)
        pliant_claim_t_publish(user, channel, &answer);
}

static void on_describe(const lcm_recv_buf_t *buffer, const char *channel,
                        const pliant_command_t *command, void *user)
{
    (void)channel;
    const pliant_reply_t reply = {.sender = command->sender,
                                  .id = command->id,
                                  .ok = 1,
                                  .channel = (char[]){""},
                                  .text = (char[]){""}};
    if (command->kind != PLIANT_COMMAND_T_DESCRIBE)
        return;
    (*(int *)user)++;
    pliant_reply_t_publish(buffer->lcm, "PLIANT_REPLY", &reply);
}

// Of a scene without bodies.
static void publish_status(Client *client)
{
    static int sequence;
    sequence++;
    const pliant_status_t status = {.sequence = sequence,
                                    .step = sequence,
                                    .scene = (char[]){"empty"},
                                    .state = (char[]){"running"},
                                    .rate_hz = 1000.0};
    pliant_status_t_publish(client->lcm, "PLIANT_STATUS", &status);
}

// Else the page shows a daemon as running whose first command is refused: "no daemon ran".
TEST(a_scene_is_shown_once_it_is_known_whose_it_is)
{
    char line[512];
    Process server;
    CommandsSeen seen = {0};
    int described = 0;
    rig.port = web_start(&server, program_path("pliant-web"), "--port 0", line);
    Client *client = client_create();
    pliant_command_t_subscription_t *describes =
        pliant_command_t_subscribe(client->lcm, "PLIANT_COMMAND", on_describe, &described);
    PageClient *page = open_page();
    // Its answers to questions come late: a busy machine.
    wait_until(client, (publish_status(client), described >= 5));
    page_wait(page_count(page, "status") > 0);
    assert_int_equal(page_count(page, "scene"), 0);
    pliant_command_t_subscription_t *commands =
        pliant_command_t_subscribe(client->lcm, "PLIANT_COMMAND", on_command, &seen);
    pliant_claim_t_subscription_t *claims =
        pliant_claim_t_subscribe(client->lcm, "PLIANT_CLAIM", on_claim, client->lcm);
    wait_until(client, (publish_status(client), page_count(page, "scene") > 0));
    page_send(page, "{\"type\":\"command\",\"id\":3,\"kind\":\"pause\"}");
    wait_until(client, seen.count > 0);
    page_disconnect(page);
    pliant_command_t_unsubscribe(client->lcm, describes);
    pliant_command_t_unsubscribe(client->lcm, commands);
    pliant_claim_t_unsubscribe(client->lcm, claims);
    client_destroy(client);
    process_end(&server);
}

TEST(what_is_not_answered_is_asked_again_and_then_given_up)
{
    char line[512];
    Process server;
    CommandsSeen seen = {0};
    rig.port = web_start(&server, program_path("pliant-web"), "--port 0", line);
    Client *client = client_create();
    pliant_command_t_subscription_t *commands =
        pliant_command_t_subscribe(client->lcm, "PLIANT_COMMAND", on_command, &seen);
    pliant_claim_t_subscription_t *claims =
        pliant_claim_t_subscribe(client->lcm, "PLIANT_CLAIM", on_claim, client->lcm);
    PageClient *page = open_page();
    // One that is made before the daemon is known is not sent.
    for (int tries = 0; tries < 20 && seen.count == 0; tries++) {
        page_send(page, "{\"type\":\"command\",\"id\":3,\"kind\":\"pause\"}");
        for (int i = 0; i < 15; i++)
            client_listen(client, 20);
    }
    wait_until(client, seen.count >= 3);
    assert_true(seen.same);
    wait_until(client, page_says(page, "error", "no daemon answers command 3"));
    page_disconnect(page);
    pliant_command_t_unsubscribe(client->lcm, commands);
    pliant_claim_t_unsubscribe(client->lcm, claims);
    client_destroy(client);
    process_end(&server);
}

TEST(daemons_may_come_late_go_and_come_again)
{
    char line[512];
    Process server;
    rig.port = web_start(&server, program_path("pliant-web"), "--port 0", line);
    PageClient *page = open_page();
    page_wait(page_says(page, "link", "\"daemon\":false"));
    Process daemon;
    start_daemon(&daemon, scene_path());
    page_wait(page_body(page, 0).frames > 3);
    page_wait(page_says(page, "link", "\"daemon\":true"));
    assert_int_equal(page_count(page, "scene"), 1);
    // The same once more: it begins again, and the page is informed.
    process_end(&daemon);
    page_wait(page_says(page, "link", "\"daemon\":false"));
    start_daemon(&daemon, scene_path());
    page_wait(page_count(page, "scene") > 1);
    int frames = page_body(page, 0).frames;
    page_wait(page_body(page, 0).frames > frames + 3);
    assert_true(page_body(page, 0).matched);
    process_signal(&daemon, SIGKILL);
    process_wait(&daemon);
    // Another scene whose body has another's name, tools and size.
    start_daemon(&daemon, write_scene("other.cfg", "publish = { status_hz = 10.0; };", PROBE_TOOL));
    page_wait(page_says(page, "scene", "\"name\":\"test\""));
    page_wait(page_body(page, 0).nodes == SPHERE_NODES &&
              page_body(page, 0).frame_nodes == SPHERE_NODES);
    assert_true(page_body(page, 0).matched);
    page_disconnect(page);
    process_end(&daemon);
    process_end(&server);
}

// What was asked of a daemon that is gone is not done by the next one, of the same scene or
// another.
TEST(requests_die_with_the_daemon_that_they_are_for)
{
    char line[512];
    static Process server, daemon;
    rig.port = web_start(&server, program_path("pliant-web"), "--port 0", line);
    PageClient *page = open_page();
    const char *const scenes[] = {
        write_scene("again.cfg", "publish = { status_hz = 10.0; };", PROBE_TOOL),
        write_scene("again2.cfg", "rate_hz = 500.0; publish = { status_hz = 10.0; };", "")};
    start_daemon(&daemon, scenes[0]);
    page_wait(page_says(page, "scene", "\"name\":\"test\""));
    page_send(page, "{\"type\":\"command\",\"id\":1,\"kind\":\"reset\"}");
    page_wait(page_says(page, "reply", "\"id\":1"));
    for (int round = 0; round < 2; round++) {
        process_signal(&daemon, SIGKILL);
        process_wait(&daemon);
        const int errors = page_count(page, "error"), scenes_seen = page_count(page, "scene");
        page_send(page, "{\"type\":\"command\",\"id\":10,\"kind\":\"pause\"}");
        page_send(page, "{\"type\":\"command\",\"id\":11,\"kind\":\"reset\"}");
        for (int k = 0; k < 10; k++)
            page_send(page,
                      "{\"type\":\"cut\",\"id\":%d,\"body\":\"\",\"before\":"
                      "[[-1,0,-1],[-1,0,1]],\"after\":[[1,0,-1],[1,0,1]]}",
                      20 + k);
        Client *client = client_create();
        start_daemon(&daemon, scenes[1 - round]);
        client_wait_for_daemon(client);
        page_wait(page_count(page, "error") >= errors + 12);
        assert_true(page_says(page, "error", "the daemon that this was sent to is gone"));
        page_wait(page_count(page, "scene") > scenes_seen);
        // The next request is for the new one, which has heard of no other.
        page_send(page, "{\"type\":\"command\",\"id\":%d,\"kind\":\"describe\"}", 40 + round);
        char id[32];
        snprintf(id, sizeof id, "\"id\":%d", 40 + round);
        wait_until(client, page_says(page, "reply", id));
        client_fresh_status(client);
        assert_string_equal(client->status.state, "running");
        assert_false(saw_event(client, "paused") || saw_event(client, "reset"));
        for (int i = 0; i < client->replies; i++)
            assert_string_not_equal(client->reply[i].channel, "PLIANT_CUT");
        client_destroy(client);
    }
    page_disconnect(page);
    process_end(&daemon);
    process_end(&server);
}

TEST(a_scene_may_listen_on_another_prefix)
{
    char line[512];
    start_daemon(&rig.daemon, write_scene("inputs.cfg", "input_prefix = \"HANDS\";", PROBE_TOOL));
    rig.port =
        web_start(&rig.server, program_path("pliant-web"), "--port 0 --input-prefix HANDS", line);
    PageClient *page = open_page();
    page_wait(page_body(page, 0).frames > 0); // so it has been described
    page_send(page, "{\"type\":\"command\",\"id\":1,\"kind\":\"pause\"}");
    page_wait(page_says(page, "reply", "\"id\":1,\"ok\":true"));
    send_tool(page, 0.3, true);
    page_wait(page_says(page, "pose", "\"ours\":true"));
    page_disconnect(page);
    end();
}

// --- usage ---

TEST(what_is_wrong_is_told_in_one_line)
{
    char line[512], arguments[128];
    Process server, run;
    int port = web_start(&server, program_path("pliant-web"), "--port 0", line);
    process_run(&run, program_path("pliant-web"), "--port %d", port);
    assert_int_equal(run.code, 1);
    snprintf(arguments, sizeof arguments, "port %d of 127.0.0.1 is in use: choose another", port);
    assert_non_null(strstr(run.err, arguments));
    static const struct {
        const char *arguments, *says;
        int code;
    } cases[] = {
        {"--port 70000", "--port '70000' is not an integer in [0, 65535]", 2},
        {"--listen localhost:80", "--listen 'localhost:80' is not ADDRESS:PORT", 2},
        {"--listen 127.0.0.1", "is not ADDRESS:PORT", 2},
        {"--listen 127.0.0.1:80 --port 80", "give either", 2},
        {"--rate nan", "--rate 'nan'", 2},
        {"--input-prefix a.b", "--input-prefix 'a.b' is not 1 to 31 letters", 2},
        {"--host a:b", "--host 'a:b' is not a name", 2},
        {"--texture ball", "--texture 'ball' is not BODY=IMAGE", 2},
        {"--texture ball=/etc/passwd", "ball=/etc/passwd' is not a PNG or JPEG", 2},
        {"what", "'what' is not an option", 2},
        {"--page /nowhere", "--page /nowhere: no index.html there", 1},
        {"--token /nowhere", "--token /nowhere: No such file", 1},
        {"--listen 192.0.2.1:0", "cannot listen on port 0 of 192.0.2.1", 1},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        process_run(&run, program_path("pliant-web"), "%s", cases[k].arguments);
        if (run.code != cases[k].code || strstr(run.err, cases[k].says) == NULL)
            fail_msg("'%s': exit %d, '%s' does not say '%s'", cases[k].arguments, run.code, run.err,
                     cases[k].says);
    }
    process_run(&run, program_path("pliant-web"), "--help");
    assert_int_equal(run.code, 0);
    assert_non_null(strstr(run.out, "--read-only"));
    process_end(&server);
}
