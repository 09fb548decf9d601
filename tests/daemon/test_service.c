// SPDX-License-Identifier: MIT
// The daemon under a service manager, which the test plays: a datagram socket on which it hears
// that the daemon is ready, alive and ending, and a stream declared to be the journal's.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <poll.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>

// --- the manager ---

typedef struct Manager {
    int fd;
    int ready, stopping, extensions, pings, lines;
    char line[256]; // the newest STATUS
    int order;      // 1 after READY, 2 after STOPPING
} Manager;

// `name` as in NOTIFY_SOCKET. Watched with a limit of 0.4 s: the daemon looks every quarter of it.
static void manager_create(Manager *manager, const char *name)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    size_t length = strlen(name);
    assert_true(length < sizeof address.sun_path);
    memcpy(address.sun_path, name, length);
    if (name[0] == '@')
        address.sun_path[0] = '\0';
    *manager = (Manager){.fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
    assert_true(manager->fd >= 0);
    assert_int_equal(bind(manager->fd, (struct sockaddr *)&address,
                          (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length)),
                     0);
    setenv("NOTIFY_SOCKET", name, 1);
    setenv("WATCHDOG_USEC", "400000", 1);
    unsetenv("WATCHDOG_PID");
}

static void manager_destroy(Manager *manager)
{
    close(manager->fd);
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
}

// Each line of a message is an assignment.
static void take(Manager *manager, char *text)
{
    for (char *word = strtok(text, "\n"); word != NULL; word = strtok(NULL, "\n")) {
        if (strcmp(word, "READY=1") == 0) {
            manager->ready++;
            assert_int_equal(manager->order, 0);
            manager->order = 1;
        } else if (strcmp(word, "STOPPING=1") == 0) {
            manager->stopping++;
            assert_int_equal(manager->order, 1);
            manager->order = 2;
        } else if (strcmp(word, "WATCHDOG=1") == 0) {
            manager->pings++;
        } else if (strncmp(word, "EXTEND_TIMEOUT_USEC=", 20) == 0) {
            manager->extensions++;
            assert_int_equal(manager->order, 0);
        } else if (strncmp(word, "STATUS=", 7) == 0) {
            manager->lines++;
            snprintf(manager->line, sizeof manager->line, "%s", word + 7);
        } else {
            fail_msg("an unknown message: %s", word);
        }
    }
}

// At most so long for the next message; false: none came.
static bool listen_for(Manager *manager, int ms)
{
    char text[2048];
    struct pollfd wait = {.fd = manager->fd, .events = POLLIN};
    if (poll(&wait, 1, ms) <= 0)
        return false;
    ssize_t size = recv(manager->fd, text, sizeof text - 1, 0);
    assert_true(size > 0);
    text[size] = '\0';
    take(manager, text);
    return true;
}

// Fails the test after a minute.
#define manager_wait(manager, condition)                                                           \
    do {                                                                                           \
        double limit_ = client_now() + 60.0;                                                       \
        while (!(condition) && client_now() < limit_)                                              \
            listen_for(manager, 100);                                                              \
        if (!(condition))                                                                          \
            fail_msg("waited in vain for: %s (%s)", #condition, (manager)->line);                  \
    } while (0)

// --- alive ---

TEST(it_says_when_it_is_ready_alive_and_ending)
{
    char unnamed[64];
    snprintf(unnamed, sizeof unnamed, "@pliant-test-%d", (int)getpid());
    const char *const names[] = {scratch("notify"), unnamed};
    const char *scene = write_scene("service.cfg", "rate_hz = 100.0;", "");
    for (int k = 0; k < 2; k++) {
        SCOPED(manager_destroy) Manager manager;
        manager_create(&manager, names[k]);
        daemon_start(&pliantd, "%s", scene);
        manager_wait(&manager, manager.ready == 1);
        manager_wait(&manager, manager.pings >= 3);
        manager_wait(&manager, k > 0 || strstr(manager.line, "running: ") != NULL);
        assert_true(k > 0 || strstr(manager.line, " of 100 ticks a second, ") != NULL);
        process_end(&pliantd);
        while (listen_for(&manager, 0)) {
        }
        assert_int_equal(manager.stopping, 1);
        assert_int_equal(manager.ready, 1);
    }
}

// Neither restarted nor taken for one that hangs.
TEST(it_asks_for_time_while_it_waits_for_a_network)
{
    SCOPED(manager_destroy) Manager manager;
    manager_create(&manager, scratch("late"));
    assert_int_equal(system("ip route del 224.0.0.0/4 dev lo"), 0);
    daemon_start(&pliantd, "%s", write_scene("late.cfg", "rate_hz = 100.0;", ""));
    manager_wait(&manager, manager.extensions >= 2); // each second
    expect_in(manager.line, "waiting: no route for multicast");
    assert_int_equal(system("ip route add 224.0.0.0/4 dev lo"), 0);
    manager_wait(&manager, manager.ready == 1);
    process_end(&pliantd);
}

// It rests until something is asked of it, and still answers.
TEST(a_paused_daemon_is_alive)
{
    SCOPED(manager_destroy) Manager manager;
    manager_create(&manager, scratch("notify-paused"));
    daemon_start(&pliantd, "%s",
                 write_scene("paused.cfg",
                             "start = \"paused\"; publish = { status_hz = 0.0; contact_hz = 0.0; "
                             "nodes_hz = 0.0; mesh_hz = 0.0; };",
                             ""));
    manager_wait(&manager, manager.pings >= 6);
    manager_wait(&manager, strstr(manager.line, "paused") != NULL);
    process_end(&pliantd);
}

TEST(a_daemon_that_is_stopped_is_silent)
{
    SCOPED(manager_destroy) Manager manager;
    int status;
    manager_create(&manager, scratch("notify-stopped"));
    daemon_start(&pliantd, "%s", write_scene("stopped.cfg", "rate_hz = 100.0;", ""));
    manager_wait(&manager, manager.pings >= 2);
    process_signal(&pliantd, SIGSTOP);
    assert_int_equal(waitpid(pliantd.pid, &status, WUNTRACED), pliantd.pid);
    assert_true(WIFSTOPPED(status));
    while (listen_for(&manager, 0)) { // what it had sent
    }
    assert_false(listen_for(&manager, 500)); // nothing can come
    process_signal(&pliantd, SIGCONT);
    int pings = manager.pings;
    manager_wait(&manager, manager.pings >= pings + 2);
    process_end(&pliantd);
}

// The thread of that name, or 0.
static pid_t find_thread(pid_t pid, const char *name)
{
    char path[400], text[32];
    snprintf(path, sizeof path, "/proc/%d/task", (int)pid);
    DIR *tasks = opendir(path);
    assert_non_null(tasks);
    pid_t found = 0;
    for (struct dirent *task; found == 0 && (task = readdir(tasks)) != NULL;) {
        if (!isdigit((unsigned char)task->d_name[0]))
            continue;
        snprintf(path, sizeof path, "/proc/%d/task/%s/comm", (int)pid, task->d_name);
        FILE *file = fopen(path, "r");
        if (file == NULL)
            continue;
        if (fgets(text, sizeof text, file) != NULL && strncmp(text, name, strlen(name)) == 0)
            found = (pid_t)strtol(task->d_name, NULL, 10);
        fclose(file);
    }
    closedir(tasks);
    return found;
}

// All else goes on: the status line still comes, though not the pings.
TEST(a_daemon_whose_step_thread_is_stuck_is_not_alive)
{
    SCOPED(manager_destroy) Manager manager;
    int status;
    manager_create(&manager, scratch("notify-stuck"));
    daemon_start(&pliantd, "%s", write_scene("stuck.cfg", "rate_hz = 100.0;", ""));
    manager_wait(&manager, manager.pings >= 2);
    pid_t thread = find_thread(pliantd.pid, "pliant-step");
    assert_true(thread > 0);
    if (ptrace(PTRACE_SEIZE, thread, NULL, NULL) != 0) {
        print_message("no thread can be held here: %s\n", strerror(errno));
        process_end(&pliantd);
        manager_destroy(&manager);
        skip();
    }
    assert_int_equal(ptrace(PTRACE_INTERRUPT, thread, NULL, NULL), 0);
    assert_int_equal(waitpid(thread, &status, __WALL), thread);
    // One ping is owed to what was done before. A look pings first and then writes its line, and
    // lines are a second apart: with the second of them that ping has come.
    const double limit = client_now() + 60.0;
    int lines = manager.lines, pings = 0;
    while (manager.lines < lines + 3 && client_now() < limit) {
        listen_for(&manager, 100);
        if (manager.lines < lines + 2)
            pings = manager.pings;
    }
    // Before anything is asserted: a stopped thread cannot end.
    assert_int_equal(ptrace(PTRACE_DETACH, thread, NULL, NULL), 0);
    assert_true(manager.lines >= lines + 3);
    assert_int_equal(manager.pings, pings);
    expect_in(manager.line, "running: 0 of 100 ticks");
    manager_wait(&manager, manager.pings > pings + 1);
    process_end(&pliantd);
}

TEST(nobody_is_pinged_who_does_not_watch)
{
    const char *scene = write_scene("unwatched.cfg", "rate_hz = 100.0;", "");
    for (int k = 0; k < 2; k++) {
        char name[32];
        SCOPED(manager_destroy) Manager manager;
        snprintf(name, sizeof name, "notify-unwatched-%d", k);
        manager_create(&manager, scratch(name));
        if (k == 0)
            setenv("WATCHDOG_PID", "1", 1); // another process
        else
            setenv("WATCHDOG_USEC", "-5", 1);
        daemon_start(&pliantd, "%s", scene);
        manager_wait(&manager, manager.lines >= 2);
        process_end(&pliantd);
        while (listen_for(&manager, 0)) {
        }
        assert_int_equal(manager.pings, 0);
        assert_int_equal(strstr(pliantd.err, "WATCHDOG_USEC") != NULL, k == 1);
    }
    unsetenv("WATCHDOG_PID");
}

TEST(a_socket_that_cannot_be_reached_keeps_nothing_from_running)
{
    char long_name[200] = "/";
    memset(long_name + 1, 'x', sizeof long_name - 2);
    const char *const names[] = {scratch("nobody-listens"), "relative", "@", "vsock:2:1234",
                                 long_name};
    const char *scene = write_scene("unheard.cfg", "rate_hz = 100.0;", "");
    for (int k = 0; k < 5; k++) {
        setenv("NOTIFY_SOCKET", names[k], 1);
        run_daemon_well(&pliantd, "--duration 0.1 %s", scene);
        assert_int_equal(strstr(pliantd.err, "NOTIFY_SOCKET") != NULL, k > 0);
    }
    unsetenv("NOTIFY_SOCKET");
}

// --- the journal ---

// Runs the daemon with a pipe for its stderr, of which JOURNAL_STREAM says the inode, more `by`.
static void run_in_journal(const char *program, const char *const *arguments, unsigned long long by,
                           char said[4096])
{
    int ends[2];
    struct stat stream;
    char named[64];
    char *argv[8] = {(char *)(uintptr_t)program};
    for (int i = 0; arguments[i] != NULL; i++)
        argv[i + 1] = (char *)(uintptr_t)arguments[i];
    assert_int_equal(pipe(ends), 0);
    assert_int_equal(fstat(ends[1], &stream), 0);
    snprintf(named, sizeof named, "%llu:%llu", (unsigned long long)stream.st_dev,
             (unsigned long long)stream.st_ino + by);
    fflush(NULL);
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid == 0) {
        setenv("JOURNAL_STREAM", named, 1);
        if (dup2(ends[1], 2) < 0 || dup2(ends[1], 1) < 0)
            _exit(126);
        execv(program, argv);
        _exit(127);
    }
    close(ends[1]);
    size_t size = 0;
    ssize_t part;
    while ((part = read(ends[0], said + size, 4095 - size)) > 0)
        size += (size_t)part;
    said[size] = '\0';
    close(ends[0]);
    waitpid(pid, NULL, 0);
}

TEST(lines_have_levels_in_the_journal_only)
{
    char said[4096];
    // Damped more than the step allows: a warning. A file that is not there: an error.
    const char *scene = write_scene("warned.cfg", "", "");
    write_text(scratch("warned.cfg"),
               "name = \"warned\"; bodies = ( { name = \"a\"; shape = {}; mesh = { generator = "
               "\"ico_sphere\"; nodes = 42; }; material = { damping_time = 0.05; }; } );\n");
    const char *const warned[] = {"--check", scene, NULL};
    const char *const missing[] = {"--check", "missing.cfg", NULL};
    run_in_journal(program_path("pliantd"), warned, 0, said);
    assert_int_equal(strncmp(said, "<4>pliantd: warning: ", 21), 0);
    run_in_journal(program_path("pliantd"), missing, 0, said);
    assert_int_equal(strncmp(said, "<3>missing.cfg", 14), 0);
    run_in_journal(program_path("pliantd"), warned, 1, said);
    assert_int_equal(strncmp(said, "pliantd: warning: ", 18), 0);
}

// --- levels ---

TEST(lines_above_the_level_asked_for_are_left_out)
{
    write_text(scratch("levels.cfg"),
               "name = \"levels\"; start = \"running\"; bodies = ( { name = \"a\"; shape = {};\n"
               "mesh = { file = \"a.obj\"; }; material = { damping_time = 0.05; }; } );\n");
    write_text(scratch("a.obj"), "v 9 9 9\nv 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\n"
                                 "f 2 4 3\nf 2 3 5\nf 3 4 5\nf 2 5 4\n");
    static const char *const levels[] = {"error", "warning", "info", "debug"};
    for (int k = 0; k < 4; k++) {
        run_daemon_well(&pliantd, "--check --log-level %s %s", levels[k], scratch("levels.cfg"));
        assert_int_equal(strstr(pliantd.err, "shortened to") != NULL, k >= 1);
        assert_int_equal(strstr(pliantd.err, "dropped 1 unused node") != NULL, k >= 2);
    }
    // An event: known to the log at the last level only.
    for (int k = 2; k < 4; k++) {
        Client *client =
            server_start(&pliantd, "--log-level %s %s", levels[k], scratch("levels.cfg"));
        assert_true(command(client, PLIANT_COMMAND_T_PAUSE, 0, "")->ok);
        assert_true(command(client, PLIANT_COMMAND_T_RESET, 0, "")->ok);
        wait_until(client, client->events > 0);
        process_end(&pliantd);
        client_destroy(client);
        assert_int_equal(strstr(pliantd.err, "pliantd: debug: ") != NULL, k == 3);
    }
}
