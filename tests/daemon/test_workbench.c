// SPDX-License-Identifier: MIT
// The workbench of pliant-web with the real programs: what pages may start and send, what is
// refused, and that nothing is left of it.
#include "test.h"
#include "effort.h"
#include "page_client.h"

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { ANSWER = 8192 };

static Process server;
static int port;
static PageClient *page;

static const char SCENE[] =
    "name = \"bench\"; rate_hz = 200.0; publish = { status_hz = 20.0; };\n"
    "bodies = ( { name = \"ball\"; model = \"surface\"; shape = {};\n"
    "    mesh = { generator = \"ico_sphere\"; nodes = 42; radius = 0.03; }; } );\n";

static const char STL[] = "solid t\n"
                          "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 30 0\n"
                          "vertex 40 0 0\nendloop\nendfacet\n"
                          "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 40 0 0\n"
                          "vertex 0 0 50\nendloop\nendfacet\n"
                          "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 50\n"
                          "vertex 0 30 0\nendloop\nendfacet\n"
                          "facet normal 0 0 0\nouter loop\nvertex 40 0 0\nvertex 0 30 0\n"
                          "vertex 0 0 50\nendloop\nendfacet\nendsolid t\n";

static void begin(const char *options)
{
    char remove[PATH_TEXT + 16];
    snprintf(remove, sizeof remove, "rm -rf '%s'", scratch("scenes"));
    assert_int_equal(system(remove), 0);
    assert_int_equal(mkdir(scratch("scenes"), 0700), 0);
    write_text(scratch("scenes/good.cfg"), SCENE);
    write_text(scratch("scenes/wrong.cfg"), "name = \"wrong\";\nbodies = 7;\n");
    write_text(scratch("outside.cfg"), SCENE);
    assert_int_equal(symlink("../outside.cfg", scratch("scenes/away.cfg")), 0);
    port = web_start(&server, "--port 0 %s", options);
    page = page_open(port);
}

static void begin_workbench(void)
{
    char all[PATH_TEXT * 2];
    snprintf(all, sizeof all, "--scenes %s", scratch("scenes"));
    begin(all);
    page_wait(page_says(page, "workbench", "\"name\":\"good.cfg\""));
}

static void end(void)
{
    page_disconnect_all();
    process_end(&server);
}

static void start(const char *name)
{
    page_send(page, "{\"type\":\"start\",\"id\":1,\"folder\":\"scenes\",\"name\":\"%s\"}", name);
}

// Whether the daemon is in that state: none, running, ending, ended or failed.
static bool daemon_is(const char *state)
{
    char part[64];
    snprintf(part, sizeof part, "\"daemon\":{\"state\":\"%s\"", state);
    return page_says(page, "workbench", part);
}

// The processes that pliant-web has started: returns their number, and the first ones.
static int children(pid_t pid[4])
{
    char path[64];
    snprintf(path, sizeof path, "/proc/%d/task/%d/children", (int)server.pid, (int)server.pid);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    int count = 0, one;
    while (fscanf(file, "%d", &one) == 1) {
        if (count < 4)
            pid[count] = one;
        count++;
    }
    fclose(file);
    return count;
}

static int open_files(void)
{
    char path[64];
    snprintf(path, sizeof path, "/proc/%d/fd", (int)server.pid);
    DIR *files = opendir(path);
    assert_non_null(files);
    int count = 0;
    while (readdir(files) != NULL)
        count++;
    closedir(files);
    return count;
}

// --- scenes ---

TEST(a_scene_of_the_folder_runs_until_it_is_ended)
{
    pid_t pid[4];
    begin_workbench();
    start("good.cfg");
    page_wait(page_body(page, 0).frames > 3);
    assert_true(daemon_is("running"));
    assert_int_equal(children(pid), 1);
    page_send(page, "{\"type\":\"end\",\"id\":2}");
    page_wait(daemon_is("ended"));
    assert_int_equal(children(pid), 0);
    page_exchange(page, "{\"type\":\"end\",\"id\":3}", "error",
                  "nothing runs that was started here");
    end();
}

TEST(a_scene_that_is_refused_says_where)
{
    begin_workbench();
    start("wrong.cfg");
    page_wait(daemon_is("failed"));
    assert_true(page_says(page, "workbench", "\"how\":\"exit status 2\",\"text\":\"wrong.cfg:2: "));
    end();
}

TEST(nothing_but_files_of_the_list_is_started)
{
    static const char *const names[] = {
        "away.cfg",        "../outside.cfg",       "none.cfg",      "--help", "/etc/passwd",
        "scenes/good.cfg", "good.cfg/../good.cfg", "uploads/x.cfg", "-l.cfg", "good.cfg "};
    pid_t pid[4];
    begin_workbench();
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        char says[128];
        start(names[k]);
        snprintf(says, sizeof says, "'%s' is no scene of the list", names[k]);
        page_wait(page_says(page, "error", says));
        assert_int_equal(children(pid), 0);
    }
    end();
}

TEST(a_daemon_that_others_started_is_neither_replaced_nor_ended)
{
    begin_workbench();
    write_text(scratch("own.cfg"), SCENE);
    daemon_start(&pliantd, "%s", scratch("own.cfg"));
    page_wait(page_says(page, "workbench", "\"foreign\":true"));
    start("good.cfg");
    page_wait(page_says(page, "error", "was not started here runs on PLIANT"));
    page_send(page, "{\"type\":\"end\",\"id\":3}");
    page_wait(page_count(page, "error") == 2);
    assert_true(page_says(page, "error", "end it where it was started"));
    process_end(&pliantd); // with exit status 0: it was left alone
    end();
}

TEST(starting_and_ending_often_leaves_nothing)
{
    pid_t pid[4];
    begin_workbench();
    int files = open_files();
    for (int k = 0; k < EFFORT(8); k++) {
        start("good.cfg");
        page_wait(daemon_is("running"));
        page_send(page, "{\"type\":\"end\",\"id\":2}");
        page_wait(daemon_is("ended"));
    }
    // Without waiting, as a page that has gone mad.
    for (int k = 0; k < EFFORT(15); k++) {
        start("good.cfg");
        page_send(page, "{\"type\":\"end\",\"id\":2}");
        page_send(page, "{\"type\":\"record\",\"id\":3,\"on\":%s}", k % 2 ? "true" : "false");
    }
    page_send(page, "{\"type\":\"end\",\"id\":2}");
    page_wait(children(pid) == 0);
    page_wait(open_files() <= files);
    end();
}

TEST(programs_end_with_a_server_that_is_killed)
{
    pid_t pid[4];
    assert_int_equal(prctl(PR_SET_CHILD_SUBREAPER, 1), 0); // orphans become ours
    begin_workbench();
    start("good.cfg");
    page_wait(page_body(page, 0).frames > 0);
    page_exchange(page, "{\"type\":\"record\",\"id\":3,\"on\":true}", "workbench",
                  "\"recorder\":{\"state\":\"running\"");
    page_wait(children(pid) == 2);
    process_finish(&server, SIGKILL);
    for (int k = 0; k < 2; k++) // ctest's limit ends a failure
        assert_int_equal(waitpid(pid[k], NULL, 0), pid[k]);
    page_disconnect(page);
    prctl(PR_SET_CHILD_SUBREAPER, 0);
}

TEST(a_session_is_recorded_listed_and_given_out)
{
    char answer[ANSWER], request[512];
    begin_workbench();
    page_exchange(page, "{\"type\":\"record\",\"id\":3,\"on\":true}", "error", "nothing to record");
    start("good.cfg");
    page_wait(page_body(page, 0).frames > 0);
    page_exchange(page, "{\"type\":\"record\",\"id\":4,\"on\":true}", "workbench",
                  "\"recordings\":[{\"name\":\"bench-");
    page_exchange(page, "{\"type\":\"record\",\"id\":5,\"on\":true}", "error",
                  "is being recorded already");
    page_exchange(page, "{\"type\":\"record\",\"id\":6,\"on\":false}", "workbench",
                  "\"recorder\":{\"state\":\"ended\"");
    assert_true(page_says(page, "workbench", "body ball: frames "));
    // The file itself, and no other.
    char name[128] = "";
    DIR *folder = opendir(scratch("scenes/recordings"));
    assert_non_null(folder);
    for (struct dirent *entry = readdir(folder); entry != NULL; entry = readdir(folder)) {
        size_t length = strlen(entry->d_name);
        if (length > 3 && strcmp(entry->d_name + length - 3, ".h5") == 0)
            snprintf(name, sizeof name, "%.127s", entry->d_name);
    }
    closedir(folder);
    assert_true(name[0] != '\0');
    assert_int_equal(symlink("/etc/passwd", scratch("scenes/recordings/away.h5")), 0);
    static const char *const missing[] = {"away.h5", "../good.cfg", "%2e%2e%2fgood.cfg", "none.h5",
                                          ""};
    for (size_t k = 0; k < sizeof missing / sizeof *missing; k++) {
        snprintf(request, sizeof request, "GET /recordings/%s HTTP/1.1\r\nHost: localhost\r\n\r\n",
                 missing[k]);
        assert_int_equal(http_request(port, request, answer, sizeof answer), 404);
    }
    snprintf(request, sizeof request, "GET /recordings/%s HTTP/1.1\r\nHost: localhost\r\n\r\n",
             name);
    assert_int_equal(http_request(port, request, answer, sizeof answer), 200);
    expect_in(answer, "Content-Disposition: attachment");
    end();
}

// --- meshes ---

static int post(const char *path, const char *headers, const char *body, char *answer)
{
    char request[4096];
    snprintf(request, sizeof request, "POST %s HTTP/1.1\r\nHost: localhost:%d\r\n%s\r\n%s", path,
             port, headers, body);
    return http_request(port, request, answer, ANSWER);
}

static int post_mesh(const char *name, const char *body, char *answer)
{
    char path[256], headers[256];
    snprintf(path, sizeof path, "/mesh?name=%s", name);
    snprintf(headers, sizeof headers,
             "Content-Type: application/octet-stream\r\nContent-Length: %zu\r\n", strlen(body));
    return post(path, headers, body, answer);
}

TEST(a_mesh_that_is_sent_becomes_a_scene_that_runs)
{
    char answer[ANSWER];
    begin_workbench();
    assert_int_equal(post_mesh("..%2F..%2Fmy%20mesh.stl", STL, answer), 201);
    expect_in(answer, "\r\n\r\nmy_mesh.stl\n");
    page_exchange(page, "{\"type\":\"propose\",\"id\":2,\"name\":\"my_mesh.stl\",\"units\":\"mm\"}",
                  "workbench", "\"scene\":\"my_mesh.cfg\"");
    assert_true(page_says(page, "workbench", "as a wall: yes"));
    assert_true(page_says(page, "workbench", "scale = 0.001"));
    page_send(page,
              "{\"type\":\"start\",\"id\":3,\"folder\":\"uploads\",\"name\":\"my_mesh.cfg\"}");
    page_wait(page_body(page, 0).frames > 0);
    // Again, in other units: in the place of the first.
    page_exchange(page, "{\"type\":\"propose\",\"id\":4,\"name\":\"my_mesh.stl\",\"units\":\"cm\"}",
                  "workbench", "scale = 0.01;");
    assert_true(page_says(page, "workbench", "\"scene\":\"my_mesh.cfg\""));
    assert_false(page_says(page, "workbench", "my_mesh-2.cfg"));
    // A mesh that is none: the reason. Nothing is started for what is not in the list.
    assert_int_equal(post_mesh("bad.stl", "solid nothing", answer), 201);
    page_exchange(page, "{\"type\":\"propose\",\"id\":5,\"name\":\"bad.stl\"}", "workbench",
                  "\"prepare\":{\"state\":\"failed\",\"file\":\"bad.stl\"");
    assert_true(page_says(page, "workbench", "\"text\":\"bad.stl"));
    page_exchange(page, "{\"type\":\"propose\",\"id\":6,\"name\":\"../good.cfg\"}", "error",
                  "is no mesh of the list");
    end();
}

static bool has_text(const char *name, const char *text)
{
    FREED char *read = access(scratch(name), F_OK) == 0 ? file_text(scratch(name)) : NULL;
    return read != NULL && strstr(read, text) != NULL;
}

TEST(a_proposed_scene_is_replaced_by_a_better_one_only_while_nobody_has_changed_it)
{
    char answer[ANSWER];
    begin_workbench();
    assert_int_equal(post_mesh("a.stl", STL, answer), 201);
    page_exchange(page, "{\"type\":\"propose\",\"id\":1,\"name\":\"a.stl\",\"units\":\"mm\"}",
                  "workbench", "\"scene\":\"a.cfg\"");
    // Of what is no mesh any more there is no scene: the one that there is stays.
    write_text(scratch("scenes/uploads/a.stl"), "solid nothing");
    page_exchange(page, "{\"type\":\"propose\",\"id\":2,\"name\":\"a.stl\"}", "workbench",
                  "\"prepare\":{\"state\":\"failed\"");
    assert_true(page_says(page, "workbench", "\"scene\":\"\""));
    assert_true(has_text("scenes/uploads/a.cfg", "scale = 0.001;"));
    // The user's own work stays, too.
    write_text(scratch("scenes/uploads/a.stl"), STL);
    write_text(scratch("scenes/uploads/a.cfg"), "# mine\n");
    page_exchange(page, "{\"type\":\"propose\",\"id\":3,\"name\":\"a.stl\",\"units\":\"cm\"}",
                  "workbench", "\"scene\":\"a-2.cfg\"");
    assert_true(has_text("scenes/uploads/a.cfg", "# mine"));
    assert_true(has_text("scenes/uploads/a-2.cfg", "scale = 0.01;"));
    end();
}

TEST(an_even_skin_is_made_of_a_mesh_and_proposed)
{
    char answer[ANSWER];
    begin_workbench();
    assert_int_equal(post_mesh("a.stl", STL, answer), 201);
    page_exchange(page,
                  "{\"type\":\"propose\",\"id\":1,\"name\":\"a.stl\",\"units\":\"mm\","
                  "\"model\":\"surface\",\"even\":true}",
                  "workbench", "\"scene\":\"a-even.cfg\"");
    assert_true(page_says(page, "workbench", "\"file\":\"a-even.off\""));
    assert_true(has_text("scenes/uploads/a-even.cfg", "file = \"a-even.off\";  scale = 1;"));
    // Of what is no mesh there is none, and no scene.
    assert_int_equal(post_mesh("bad.stl", "solid nothing", answer), 201);
    page_exchange(page, "{\"type\":\"propose\",\"id\":2,\"name\":\"bad.stl\",\"even\":true}",
                  "workbench", "\"text\":\"bad.stl");
    assert_false(has_text("scenes/uploads/bad-even.off", ""));
    assert_true(page_says(page, "workbench", "\"scene\":\"\""));
    end();
}

TEST(only_a_page_of_this_server_sends_meshes_within_the_limits)
{
    char answer[ANSWER];
    static const struct {
        const char *path, *headers;
        int code;
    } cases[] = {
        {"/mesh?name=a.stl", "Content-Length: 1\r\n", 415},
        {"/mesh?name=a.stl", "Content-Type: text/plain\r\nContent-Length: 1\r\n", 415},
        {"/mesh?name=a.stl", "Content-Type: multipart/form-data\r\nContent-Length: 1\r\n", 415},
        {"/mesh?name=a.stl",
         "Content-Type: application/octet-stream\r\nTransfer-Encoding: chunked\r\n", 411},
        {"/mesh?name=a.stl",
         "Content-Type: application/octet-stream\r\nContent-Length: 268435457\r\n", 413},
        {"/mesh?name=a.stl",
         "Content-Type: application/octet-stream\r\nContent-Length: 1\r\n"
         "Origin: http://evil.example\r\n",
         403},
        {"/mesh?name=a.stl",
         "Content-Type: application/octet-stream\r\nContent-Length: 1\r\nOrigin: null\r\n", 403},
        {"/mesh?name=a.sh", "Content-Type: application/octet-stream\r\nContent-Length: 1\r\n", 422},
        {"/mesh?name=a.cfg", "Content-Type: application/octet-stream\r\nContent-Length: 1\r\n",
         422},
        {"/mesh", "Content-Type: application/octet-stream\r\nContent-Length: 1\r\n", 422},
        {"/mesh?name=a.stl", "Content-Type: application/octet-stream\r\nContent-Length: 0\r\n",
         422},
        {"/", "Content-Type: application/octet-stream\r\nContent-Length: 1\r\n", 405},
        {"/recordings/a.h5", "Content-Type: application/octet-stream\r\nContent-Length: 1\r\n",
         405},
    };
    begin_workbench();
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        int code = post(cases[k].path, cases[k].headers, "x", answer);
        if (code != cases[k].code)
            fail_msg("%s %s: %d, not %d: %s", cases[k].path, cases[k].headers, code, cases[k].code,
                     answer);
    }
    assert_int_equal(
        http_request(port, "GET /mesh HTTP/1.1\r\nHost: localhost\r\n\r\n", answer, sizeof answer),
        405);
    assert_int_equal(http_request(port,
                                  "OPTIONS /mesh HTTP/1.1\r\nHost: localhost\r\n"
                                  "Origin: http://evil.example\r\n\r\n",
                                  answer, sizeof answer),
                     405);
    assert_int_equal(http_request(port,
                                  "POST /mesh?name=a.stl HTTP/1.1\r\nHost: evil.example\r\n"
                                  "Content-Type: application/octet-stream\r\n"
                                  "Content-Length: 1\r\n\r\nx",
                                  answer, sizeof answer),
                     403);
    assert_int_equal(access(scratch("scenes/uploads/a.stl"), F_OK), -1);
    end();
}

static bool has_hidden(void)
{
    char name[64];
    snprintf(name, sizeof name, "scenes/uploads/.upload-%d", (int)server.pid);
    return access(scratch(name), F_OK) == 0;
}

// Begins to send a mesh, and is taken.
static int begin_half(void)
{
    static const char half[] = "POST /mesh?name=half.stl HTTP/1.1\r\nHost: localhost\r\n"
                               "Content-Type: application/octet-stream\r\n"
                               "Content-Length: 1000000\r\n\r\nsolid";
    int fd = http_connect(port, "127.0.0.1");
    assert_int_equal(send(fd, half, strlen(half), MSG_NOSIGNAL), strlen(half));
    page_wait(has_hidden());
    return fd;
}

TEST(a_mesh_that_breaks_off_leaves_nothing_and_holds_up_nobody)
{
    char answer[ANSWER];
    begin_workbench();
    int fd = begin_half();
    assert_int_equal(post_mesh("other.stl", STL, answer), 503); // one at a time
    close(fd);
    page_wait(!has_hidden());
    assert_int_equal(post_mesh("other.stl", STL, answer), 201);
    assert_int_equal(access(scratch("scenes/uploads/half.stl"), F_OK), -1);
    end();
}

// Who sends next to nothing has the place for five seconds, not for ten minutes.
TEST(a_mesh_that_comes_by_drops_makes_place_for_another)
{
    char answer[ANSWER];
    begin_workbench();
    int fd = begin_half();
    page_wait(post_mesh("other.stl", STL, answer) == 201);
    assert_int_equal(access(scratch("scenes/uploads/half.stl"), F_OK), -1);
    close(fd);
    end();
}

TEST(no_more_meshes_are_taken_than_are_listed)
{
    enum { LISTED = 200 }; // FOLDER_FILES_MAX
    char answer[ANSWER], name[64];
    begin_workbench();
    for (int k = 0; k < LISTED; k++) {
        snprintf(name, sizeof name, "scenes/uploads/%03d.stl", k);
        close(open(scratch(name), O_WRONLY | O_CREAT | O_CLOEXEC, 0666));
    }
    assert_int_equal(post_mesh("other.stl", STL, answer), 422);
    expect_in(answer, "the folder of meshes is full");
    end();
}

// A mesh of 32 MB, more than the sockets hold: its sender reads the answer only after sending it.
static int post_large(const char *type, char *answer)
{
    enum { BODY = 32 << 20 };
    FREED char *request = malloc(BODY + 256);
    assert_non_null(request);
    int head = snprintf(request, 256,
                        "POST /mesh?name=large.stl HTTP/1.1\r\nHost: localhost\r\n"
                        "Content-Type: %s\r\nContent-Length: %d\r\n\r\n",
                        type, (int)BODY);
    memset(request + head, 'x', BODY);
    request[head + BODY] = '\0';
    int code = http_request(port, request, answer, ANSWER);
    return code;
}

TEST(a_large_mesh_that_is_refused_is_told_why)
{
    char answer[ANSWER];
    begin_workbench();
    assert_int_equal(post_large("text/plain", answer), 415);
    expect_in(answer, "send application/octet-stream");
    int fd = begin_half();
    assert_int_equal(post_large("application/octet-stream", answer), 503);
    expect_in(answer, "another mesh is being received");
    close(fd);
    end();
}

// --- who may ---

TEST(a_read_only_server_starts_takes_and_lists_nothing)
{
    char answer[ANSWER], arguments[PATH_TEXT * 2];
    pid_t pid[4];
    snprintf(arguments, sizeof arguments, "--read-only --scenes %s", scratch("scenes"));
    begin(arguments);
    static const char *const asks[] = {
        "{\"type\":\"start\",\"id\":1,\"folder\":\"scenes\",\"name\":\"good.cfg\"}",
        "{\"type\":\"end\",\"id\":1}", "{\"type\":\"record\",\"id\":1,\"on\":true}",
        "{\"type\":\"propose\",\"id\":1,\"name\":\"a.stl\"}"};
    for (int k = 0; k < 4; k++) {
        page_send(page, "%s", asks[k]);
        page_wait(page_count(page, "error") == k + 1);
        assert_true(page_says(page, "error", "this server only shows"));
    }
    assert_int_equal(children(pid), 0);
    assert_int_equal(page_count(page, "workbench"), 0);
    assert_int_equal(post_mesh("readonly.stl", STL, answer), 403);
    // Recordings stay with the operator; no folder is made for them either.
    assert_int_equal(mkdir(scratch("scenes/recordings"), 0700), 0);
    write_text(scratch("scenes/recordings/patient.h5"), "secret");
    assert_int_equal(http_request(port,
                                  "GET /recordings/patient.h5 HTTP/1.1\r\n"
                                  "Host: localhost\r\n\r\n",
                                  answer, sizeof answer),
                     404);
    end();
}

TEST(a_server_without_a_folder_starts_nothing)
{
    char answer[ANSWER];
    begin("");
    start("good.cfg");
    page_wait(page_says(page, "error", "this server starts no programs (--scenes)"));
    assert_int_equal(page_count(page, "workbench"), 0);
    assert_int_equal(post_mesh("a.stl", STL, answer), 404);
    end();
}

TEST(with_a_token_meshes_need_it_too)
{
    char answer[ANSWER], headers[256];
    write_text(scratch("token"), "0123456789abcdefXYZ\n");
    port = web_start(&server, "--listen 127.0.0.1:0 --token %s --scenes %s", scratch("token"),
                     scratch("scenes"));
    assert_int_equal(post_mesh("token.stl", STL, answer), 403);
    snprintf(headers, sizeof headers,
             "Content-Type: application/octet-stream\r\nContent-Length: %zu\r\n"
             "Cookie: pliant_token_%d=0123456789abcdefXYZ\r\n",
             strlen(STL), port);
    assert_int_equal(post("/mesh?name=token.stl", headers, STL, answer), 201);
    process_end(&server);
}

TEST(what_is_wrong_with_the_folders_is_told)
{
    Process run;
    process_run(&run, program_path("pliant-web"), "--port 0 --scenes /nowhere");
    expect_ended(&run, 1, "--scenes /nowhere: No such file");
    process_run(&run, program_path("pliant-web"), "--port 0 --uploads /tmp");
    expect_ended(&run, 2, "go with --scenes DIR");
    process_run(&run, program_path("pliant-web"), "--port 0 --scenes %s --pliantd /nowhere",
                scratch("scenes"));
    expect_ended(&run, 1, "--pliantd /nowhere: No such file");
}
