#include "harness.h"

#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

const char *const PROBE_TOOL =
    "tools = ( { id = 1; kind = \"probe\"; max_force = 5.0;\n"
    "  capsules = ( { from = [0.0, 0.0, 0.0]; to = [0.0, 0.0, 0.0]; radius = 0.005; } ); } );\n";

static char folder[PATH_TEXT];
static const char *program, *daemon_path;
static const char *environment;
static int started;
static pid_t running[16]; // daemons that have not been waited for

void harness_start(int argc, char **argv)
{
    if (argc < 2) {
        fprintf(stderr, "usage: %s PLIANTD\n", argv[0]);
        exit(2);
    }
    program = daemon_path = argv[1];
    const char *base = getenv("TMPDIR");
    snprintf(folder, sizeof folder, "%s/pliant-daemon-XXXXXX", base != NULL ? base : "/tmp");
    if (mkdtemp(folder) == NULL) {
        perror(folder);
        exit(2);
    }
}

static void replace_running(pid_t from, pid_t to)
{
    for (int i = 0; i < 16; i++) {
        if (running[i] == from) {
            running[i] = to;
            return;
        }
    }
}

int harness_teardown(void **state)
{
    (void)state;
    for (int i = 0; i < 16; i++) {
        if (running[i] > 0) {
            kill(running[i], SIGKILL);
            waitpid(running[i], NULL, 0);
        }
        running[i] = 0;
    }
    return 0;
}

static int remove_entry(const char *path, const struct stat *facts, int flag, struct FTW *where)
{
    (void)facts;
    (void)flag;
    (void)where;
    return remove(path);
}

int harness_end(int result)
{
    nftw(folder, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
    return result;
}

const char *scratch(const char *name)
{
    static char paths[32][PATH_TEXT * 2];
    static int next;
    char *path = paths[next++ % 32];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

const char *write_scene(const char *name, const char *head, const char *tail)
{
    char text[8192];
    snprintf(text, sizeof text,
             "name = \"test\";\n%s\n"
             "bodies = ( { name = \"sphere\"; model = \"surface\";\n"
             "  mesh = { generator = \"ico_sphere\"; nodes = %d; radius = 0.05; };\n"
             "  material = { youngs_modulus_2d = 80.0; areal_density = 4.2;\n"
             "               damping_time = 2.0e-4; };\n"
             "  shape = { angular_frequency = 50.0; damping_ratio = 0.1; };\n"
             "  fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.02]); } ); } );\n%s\n",
             head, SPHERE_NODES, tail);
    const char *path = scratch(name);
    write_text(path, text);
    return path;
}

void daemon_program(const char *path)
{
    program = path != NULL ? path : daemon_path;
}

void daemon_environment(const char *assignment)
{
    environment = assignment;
}

static void output_path(int number, const char *kind, char path[PATH_TEXT * 2])
{
    snprintf(path, PATH_TEXT * 2, "%s/daemon-%d.%s", folder, number, kind);
}

static void redirect(int number, const char *kind, int fd)
{
    char path[PATH_TEXT * 2];
    output_path(number, kind, path);
    int file = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (file < 0 || dup2(file, fd) < 0)
        _exit(126);
}

static void start(Daemon *daemon, const char *arguments)
{
    char words[4096];
    char *argv[64] = {(char *)(uintptr_t)program};
    int argc = 1;
    snprintf(words, sizeof words, "%s", arguments);
    for (char *word = strtok(words, " "); word != NULL && argc < 63; word = strtok(NULL, " "))
        argv[argc++] = word;
    memset(daemon, 0, sizeof *daemon);
    daemon->number = started++;
    fflush(NULL);
    daemon->pid = fork();
    assert_true(daemon->pid >= 0);
    if (daemon->pid == 0) {
        redirect(daemon->number, "out", 1);
        redirect(daemon->number, "err", 2);
        if (environment != NULL)
            putenv((char *)(uintptr_t)environment);
        execv(program, argv);
        _exit(127);
    }
    replace_running(0, daemon->pid);
}

void daemon_start(Daemon *daemon, const char *format, ...)
{
    char arguments[4096];
    va_list list;
    va_start(list, format);
    vsnprintf(arguments, sizeof arguments, format, list);
    va_end(list);
    start(daemon, arguments);
}

void daemon_end(Daemon *daemon)
{
    daemon_signal(daemon, SIGTERM);
    daemon_wait(daemon);
    if (daemon->code != 0)
        fail_msg("exit %d: %s", daemon->code, daemon->err);
}

void run_daemon(Daemon *daemon, const char *format, ...)
{
    char arguments[4096];
    va_list list;
    va_start(list, format);
    vsnprintf(arguments, sizeof arguments, format, list);
    va_end(list);
    start(daemon, arguments);
    daemon_wait(daemon);
}

void daemon_signal(const Daemon *daemon, int number)
{
    assert_int_equal(kill(daemon->pid, number), 0);
}

static void read_output(const Daemon *daemon, const char *kind, char text[OUTPUT_MAX])
{
    char path[PATH_TEXT * 2];
    output_path(daemon->number, kind, path);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    size_t size = fread(text, 1, OUTPUT_MAX - 1, file);
    text[size] = '\0';
    fclose(file);
}

void daemon_wait(Daemon *daemon)
{
    const struct timespec pause = {.tv_nsec = 5000000};
    int status = 0;
    pid_t ended = 0;
    for (int i = 0; i < 12000 && ended == 0; i++) {
        ended = waitpid(daemon->pid, &status, WNOHANG);
        if (ended == 0)
            nanosleep(&pause, NULL);
    }
    if (ended == 0) {
        kill(daemon->pid, SIGKILL);
        waitpid(daemon->pid, &status, 0);
    }
    replace_running(daemon->pid, 0);
    read_output(daemon, "out", daemon->out);
    read_output(daemon, "err", daemon->err);
    daemon->code = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
    if (ended == 0)
        fail_msg("the daemon did not end within a minute; it said: %s", daemon->err);
}

static const char *find_printed(const Daemon *daemon, const char *name)
{
    size_t length = strlen(name);
    for (const char *line = daemon->out; line != NULL; line = strchr(line, '\n')) {
        line += *line == '\n';
        if (strncmp(line, name, length) == 0 && strncmp(line + length, ": ", 2) == 0)
            return line + length + 2;
    }
    fail_msg("no '%s: ' (exit %d) in: %s%s", name, daemon->code, daemon->out, daemon->err);
    return "";
}

long long printed(const Daemon *daemon, const char *name)
{
    return strtoll(find_printed(daemon, name), NULL, 10);
}

void printed_state(const Daemon *daemon, char state[32])
{
    snprintf(state, 17, "%s", find_printed(daemon, "state"));
    assert_int_equal(strlen(state), 16);
}
