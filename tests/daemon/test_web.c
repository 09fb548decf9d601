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
    start_daemon(&rig.daemon, scene_path());
    rig.port = web_start(&rig.server, "%s", arguments);
}

// Without a daemon.
static void end_web(void)
{
    page_disconnect_all();
    process_end(&rig.server);
}

static void end(void)
{
    end_web();
    process_end(&rig.daemon);
}

static void send_tool(PageClient *page, double z, bool active)
{
    page_send(page,
              "{\"type\":\"tool\",\"tool\":1,\"position\":[0,0,%.4f],\"orientation\":[1,0,0,0],"
              "\"grip\":0,\"active\":%s}",
              z, active ? "true" : "false");
}

// --- what a page sees ---

TEST(a_page_learns_the_scene_and_follows_every_body)
{
    begin("--port 0");
    PageClient *page = page_open(rig.port);
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
    rig.port = web_start(&rig.server, "--port 0");
    PageClient *page = page_open(rig.port);
    page_wait(page_body(page, 0).frames > 3 && page_body(page, 1).frames > 3);
    assert_int_equal(page_body(page, 0).nodes, 162);
    assert_true(page_body(page, 0).matched && page_body(page, 1).matched);
    end();
}

TEST(a_page_that_stalls_holds_up_nobody_and_then_gets_the_newest)
{
    begin("--port 0");
    PageClient *stalled = page_open(rig.port), *other = page_open(rig.port);
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
    end();
}

// --- what it does ---

typedef struct PoseSeen {
    int count;
    pliant_tool_pose_t pose;
} PoseSeen;

HANDLER(on_pose, pliant_tool_pose_t, pose)
{
    PoseSeen *seen = user;
    seen->count++;
    seen->pose = *pose;
}

TEST(a_pose_presses_the_body_and_is_withdrawn_with_the_page)
{
    begin("--port 0");
    SCOPED_CLIENT Client *client = client_create();
    PoseSeen seen = {0};
    pliant_tool_pose_t_subscription_t *poses =
        pliant_tool_pose_t_subscribe(client->lcm, "PLIANT_TOOL_POSE", on_pose, &seen);
    client_wait_for_daemon(client);
    PageClient *page = page_open(rig.port), *other = page_open(rig.port);
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
    pliant_tool_pose_t_unsubscribe(client->lcm, poses);
    end();
}

TEST(a_cut_changes_the_mesh_and_is_answered_to_whom_asked)
{
    begin("--port 0");
    PageClient *page = page_open(rig.port), *other = page_open(rig.port);
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
    page_exchange(page,
                  "{\"type\":\"command\",\"id\":13,\"kind\":\"set\",\"argument\":\"nothing=1\"}",
                  "reply", "\"id\":13,\"ok\":false");
    page_exchange(page, "{\"type\":\"command\",\"id\":14,\"kind\":\"set\",\"argument\":7}", "error",
                  "argument: expected a text");
    page_exchange(page, "{\"type\":\"command\",\"id\":15,\"kind\":\"pause\"}", "status",
                  "\"state\":\"paused\"");
    // A client that comes late to a paused daemon sees it all the same.
    PageClient *late = page_open(rig.port);
    page_wait(page_body(late, 0).frames > 0 && page_body(late, 1).frames > 0);
    assert_int_equal(page_count(other, "reply"), 0);
    end();
}

TEST(a_read_only_server_shows_and_does_nothing)
{
    begin("--port 0 --read-only");
    SCOPED_CLIENT Client *client = client_create();
    PoseSeen seen = {0};
    pliant_tool_pose_t_subscription_t *poses =
        pliant_tool_pose_t_subscribe(client->lcm, "PLIANT_TOOL_POSE", on_pose, &seen);
    PageClient *page = page_open(rig.port);
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
    pliant_tool_pose_t_unsubscribe(client->lcm, poses);
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
    int port = web_start(&rig.server, "--port 0");
    assert_int_equal(upgrade(port, "127.0.0.1:8080", ""), 101);
    assert_int_equal(upgrade(port, "127.0.0.1:8080", "Origin: http://127.0.0.1:8080\r\n"), 101);
    assert_int_equal(upgrade(port, "127.0.0.1:8080", "Origin: http://evil.example\r\n"), 403);
    assert_int_equal(upgrade(port, "127.0.0.1:8080", "Origin: null\r\n"), 403);
    // Its own name, pointed here: origin and host agree, and are not ours.
    assert_int_equal(upgrade(port, "evil.example:8080", "Origin: http://evil.example:8080\r\n"),
                     403);
    char why[256];
    assert_null(page_connect(port, "/live", "http://evil.example", why));
    end_web();
}

TEST(only_files_of_the_page_are_served)
{
    char answer[ANSWER];
    write_text(scratch("index.html"), "the page itself");
    write_text(scratch(".hidden"), "hidden");
    write_text(scratch("tissue.png"), "\x89PNG\r\n\x1a\nand so on");
    assert_int_equal(symlink("/etc/passwd", scratch("link.txt")), 0);
    int port = web_start(&rig.server, "--port 0 --page %s --texture ball=%s", scratch(""),
                         scratch("tissue.png"));
    assert_int_equal(get(port, "GET", "/", "", answer), 200);
    expect_in(answer, "the page itself");
    static const char *const headers[] = {"Content-Security-Policy: default-src 'none'",
                                          "X-Content-Type-Options: nosniff",
                                          "X-Frame-Options: DENY", "Content-Type: text/html"};
    for (size_t k = 0; k < sizeof headers / sizeof *headers; k++) {
        expect_in(answer, headers[k]);
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
    expect_in(answer, "Content-Type: image/png");
    static const char *const methods[] = {"POST", "PUT", "DELETE", "OPTIONS", "HEAD", "PROPFIND"};
    for (size_t k = 0; k < sizeof methods / sizeof *methods; k++)
        assert_int_equal(get(port, methods[k], "/", "Content-Length: 0\r\n", answer), 405);
    assert_int_equal(get(port, "GET", "/live", "", answer), 426);
    end_web();
}

TEST(where_others_can_listen_a_token_is_needed)
{
    char answer[ANSWER], why[256], path[128];
    write_text(scratch("token"), "0123456789abcdefXYZ\n");
    int port = web_start(&rig.server, "--listen 127.0.0.1:0 --token %s", scratch("token"));
    expect_in(web_line, "/?token=0123456789abcdefXYZ");
    assert_int_equal(get(port, "GET", "/", "", answer), 403);
    assert_int_equal(get(port, "GET", "/?token=0123456789abcdefXYz", "", answer), 403);
    assert_int_equal(upgrade(port, "127.0.0.1", ""), 403);
    assert_null(page_connect(port, "/live", NULL, why));
    assert_null(page_connect(port, "/live?token=1", NULL, why));
    // The address with the token gives a cookie, and with that all the rest opens.
    assert_int_equal(get(port, "GET", "/?token=0123456789abcdefXYZ", "", answer), 303);
    expect_in(answer, "Location: /\r\n");
    expect_in(answer, "HttpOnly; SameSite=Strict");
    snprintf(path, sizeof path, "Set-Cookie: pliant_token_%d=0123456789abcdefXYZ;", port);
    expect_in(answer, path);
    snprintf(path, sizeof path, "Cookie: pliant_token_%d=0123456789abcdefXYZ\r\n", port);
    assert_int_equal(get(port, "GET", "/", path, answer), 200);
    assert_int_equal(upgrade(port, "127.0.0.1", path), 101);
    PageClient *page = page_connect(port, "/live?token=0123456789abcdefXYZ", NULL, why);
    assert_non_null(page);
    page_wait(page_count(page, "hello") > 0);
    end_web();
}

TEST(there_is_an_end_to_connections)
{
    char why[256];
    int port = web_start(&rig.server, "--port 0");
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
    end_web();
}

TEST(hostile_frames_close_their_connection_only)
{
    rig.port = web_start(&rig.server, "--port 0");
    PageClient *good = page_open(rig.port), *bad = page_open(rig.port), *big = page_open(rig.port);
    page_send_frame(bad, 0x82, "\x01\x02", 2);
    page_wait(page_closed(bad));
    FREED char *much = malloc(100000);
    assert_non_null(much);
    memset(much, 'x', 100000);
    page_send_frame(big, 0x81, much, 100000);
    page_wait(page_closed(big));
    page_exchange(good, "{\"type\":\"tool\"", "error", "not JSON");
    end_web();
}

// --- comings and goings of daemons ---

typedef struct CommandsSeen {
    int count;
    bool same; // all by one sender with one number
    pliant_command_t first;
} CommandsSeen;

HANDLER(on_command, pliant_command_t, command)
{
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
    CommandsSeen seen = {0};
    int described = 0;
    rig.port = web_start(&rig.server, "--port 0");
    SCOPED_CLIENT Client *client = client_create();
    pliant_command_t_subscription_t *describes =
        pliant_command_t_subscribe(client->lcm, "PLIANT_COMMAND", on_describe, &described);
    PageClient *page = page_open(rig.port);
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
    pliant_command_t_unsubscribe(client->lcm, describes);
    pliant_command_t_unsubscribe(client->lcm, commands);
    pliant_claim_t_unsubscribe(client->lcm, claims);
    end_web();
}

TEST(what_is_not_answered_is_asked_again_and_then_given_up)
{
    CommandsSeen seen = {0};
    rig.port = web_start(&rig.server, "--port 0");
    SCOPED_CLIENT Client *client = client_create();
    pliant_command_t_subscription_t *commands =
        pliant_command_t_subscribe(client->lcm, "PLIANT_COMMAND", on_command, &seen);
    pliant_claim_t_subscription_t *claims =
        pliant_claim_t_subscribe(client->lcm, "PLIANT_CLAIM", on_claim, client->lcm);
    PageClient *page = page_open(rig.port);
    // One that is made before the daemon is known is not sent.
    for (int tries = 0; tries < 20 && seen.count == 0; tries++) {
        page_send(page, "{\"type\":\"command\",\"id\":3,\"kind\":\"pause\"}");
        for (int i = 0; i < 15; i++)
            client_listen(client, 20);
    }
    wait_until(client, seen.count >= 3);
    assert_true(seen.same);
    wait_until(client, page_says(page, "error", "no daemon answers command 3"));
    pliant_command_t_unsubscribe(client->lcm, commands);
    pliant_claim_t_unsubscribe(client->lcm, claims);
    end_web();
}

TEST(daemons_may_come_late_go_and_come_again)
{
    rig.port = web_start(&rig.server, "--port 0");
    PageClient *page = page_open(rig.port);
    page_wait(page_says(page, "link", "\"daemon\":false"));
    start_daemon(&pliantd, scene_path());
    page_wait(page_body(page, 0).frames > 3);
    page_wait(page_says(page, "link", "\"daemon\":true"));
    assert_int_equal(page_count(page, "scene"), 1);
    // The same once more: it begins again, and the page is informed.
    process_end(&pliantd);
    page_wait(page_says(page, "link", "\"daemon\":false"));
    start_daemon(&pliantd, scene_path());
    page_wait(page_count(page, "scene") > 1);
    int frames = page_body(page, 0).frames;
    page_wait(page_body(page, 0).frames > frames + 3);
    assert_true(page_body(page, 0).matched);
    process_finish(&pliantd, SIGKILL);
    // Another scene whose body has another's name, tools and size.
    start_daemon(&pliantd,
                 write_scene("other.cfg", "publish = { status_hz = 10.0; };", PROBE_TOOL));
    page_wait(page_says(page, "scene", "\"name\":\"test\""));
    page_wait(page_body(page, 0).nodes == SPHERE_NODES &&
              page_body(page, 0).frame_nodes == SPHERE_NODES);
    assert_true(page_body(page, 0).matched);
    process_end(&pliantd);
    end_web();
}

// What was asked of a daemon that is gone is not done by the next one, of the same scene or
// another.
TEST(requests_die_with_the_daemon_that_they_are_for)
{
    rig.port = web_start(&rig.server, "--port 0");
    PageClient *page = page_open(rig.port);
    const char *const scenes[] = {
        write_scene("again.cfg", "publish = { status_hz = 10.0; };", PROBE_TOOL),
        write_scene("again2.cfg", "rate_hz = 500.0; publish = { status_hz = 10.0; };", "")};
    start_daemon(&pliantd, scenes[0]);
    page_wait(page_says(page, "scene", "\"name\":\"test\""));
    page_exchange(page, "{\"type\":\"command\",\"id\":1,\"kind\":\"reset\"}", "reply", "\"id\":1");
    for (int round = 0; round < 2; round++) {
        process_finish(&pliantd, SIGKILL);
        const int errors = page_count(page, "error"), scenes_seen = page_count(page, "scene");
        page_send(page, "{\"type\":\"command\",\"id\":10,\"kind\":\"pause\"}");
        page_send(page, "{\"type\":\"command\",\"id\":11,\"kind\":\"reset\"}");
        for (int k = 0; k < 10; k++)
            page_send(page,
                      "{\"type\":\"cut\",\"id\":%d,\"body\":\"\",\"before\":"
                      "[[-1,0,-1],[-1,0,1]],\"after\":[[1,0,-1],[1,0,1]]}",
                      20 + k);
        SCOPED_CLIENT Client *client = client_create();
        start_daemon(&pliantd, scenes[1 - round]);
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
    }
    process_end(&pliantd);
    end_web();
}

TEST(a_scene_may_listen_on_another_prefix)
{
    start_daemon(&rig.daemon, write_scene("inputs.cfg", "input_prefix = \"HANDS\";", PROBE_TOOL));
    rig.port = web_start(&rig.server, "--port 0 --input-prefix HANDS");
    PageClient *page = page_open(rig.port);
    page_wait(page_body(page, 0).frames > 0); // so it has been described
    page_exchange(page, "{\"type\":\"command\",\"id\":1,\"kind\":\"pause\"}", "reply",
                  "\"id\":1,\"ok\":true");
    send_tool(page, 0.3, true);
    page_wait(page_says(page, "pose", "\"ours\":true"));
    end();
}

// --- usage ---

TEST(what_is_wrong_is_told_in_one_line)
{
    char arguments[128];
    Process run;
    int port = web_start(&rig.server, "--port 0");
    process_run(&run, program_path("pliant-web"), "--port %d", port);
    assert_int_equal(run.code, 1);
    snprintf(arguments, sizeof arguments, "port %d of 127.0.0.1 is in use: choose another", port);
    expect_in(run.err, arguments);
    static const Usage cases[] = {
        {"--port 70000", 2, "--port '70000' is not an integer in [0, 65535]"},
        {"--listen localhost:80", 2, "--listen 'localhost:80' is not ADDRESS:PORT"},
        {"--listen 127.0.0.1", 2, "is not ADDRESS:PORT"},
        {"--listen 127.0.0.1:80 --port 80", 2, "give either"},
        {"--rate nan", 2, "--rate 'nan'"},
        {"--input-prefix a.b", 2, "--input-prefix 'a.b' is not 1 to 31 letters"},
        {"--host a:b", 2, "--host 'a:b' is not a name"},
        {"--texture ball", 2, "--texture 'ball' is not BODY=IMAGE"},
        {"--texture ball=/etc/passwd", 2, "ball=/etc/passwd' is not a PNG or JPEG"},
        {"what", 2, "'what' is not an option"},
        {"--page /nowhere", 1, "--page /nowhere: no index.html there"},
        {"--token /nowhere", 1, "--token /nowhere: No such file"},
        {"--listen 192.0.2.1:0", 1, "cannot listen on port 0 of 192.0.2.1"},
    };
    expect_usage(program_path("pliant-web"), cases, sizeof cases / sizeof *cases);
    process_run_well(&run, program_path("pliant-web"), "--help");
    expect_in(run.out, "--read-only");
    end_web();
}
