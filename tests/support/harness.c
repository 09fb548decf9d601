// SPDX-License-Identifier: MIT
#include "harness.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

Process pliantd;
static Scratch folder;
static char server[PATH_MAX];
static int started;
static pid_t running[16]; // processes that have not been waited for
static bool kept[16];     // those that the present test has not started

static void start_harness(void)
{
    if (test_argument(1)[0] == '\0') {
        fprintf(stderr, "the path of pliantd is missing\n");
        exit(2);
    }
    // Programs run in the scratch folder, so that relative paths lead nowhere.
    if (realpath(test_argument(1), server) == NULL || scratch_create(&folder) != 0) {
        perror(test_argument(1));
        exit(2);
    }
}

static void end_harness(void)
{
    scratch_destroy(&folder);
}

static int keep_running(void **state)
{
    (void)state;
    for (int i = 0; i < 16; i++)
        kept[i] = running[i] > 0;
    return 0;
}

__attribute__((constructor)) static void register_harness(void)
{
    test_around_program(start_harness, end_harness);
    test_around_claims(keep_running, harness_teardown);
}

const char *program_path(const char *name)
{
    static char paths[16][PATH_MAX];
    static int count;
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%.*s/%s", (int)(strrchr(server, '/') - server), server, name);
    for (int k = 0; k < count; k++) {
        if (strcmp(paths[k], path) == 0)
            return paths[k];
    }
    assert_true(count < 16);
    return strcpy(paths[count++], path);
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
        if (kept[i])
            continue;
        if (running[i] > 0) {
            kill(running[i], SIGKILL);
            waitpid(running[i], NULL, 0);
        }
        running[i] = 0;
    }
    return 0;
}

bool file_exists(const char *path)
{
    return access(path, F_OK) == 0;
}

const char *scratch(const char *name)
{
    static struct Path {
        struct Path *former;
        char text[SCRATCH_PATH];
    } * newest;
    char path[SCRATCH_PATH];
    scratch_path(&folder, name, path);
    for (const struct Path *known = newest; known != NULL; known = known->former) {
        if (strcmp(known->text, path) == 0)
            return known->text;
    }
    struct Path *made = malloc(sizeof *made);
    assert_non_null(made);
    made->former = newest;
    newest = made;
    return strcpy(made->text, path);
}

void write_text(const char *path, const char *text)
{
    file_write(path, text, strlen(text));
}

static const char *output_path(const Process *process, const char *kind)
{
    static char path[SCRATCH_PATH];
    char name[32];
    snprintf(name, sizeof name, "process-%d.%s", process->number, kind);
    return scratch_path(&folder, name, path);
}

const char *process_output(const Process *process)
{
    return output_path(process, "out");
}

const char *process_errors(const Process *process)
{
    return output_path(process, "err");
}

static void redirect(const char *path, int fd)
{
    int file = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (file < 0 || dup2(file, fd) < 0)
        _exit(126);
}

static bool is_assignment(const char *word)
{
    size_t length = strspn(word, "ABCDEFGHIJKLMNOPQRSTUVWXYZ_");
    return length > 0 && word[length] == '=';
}

// Splits the text, which is changed; returns the words, NULL behind the last one.
static void split(char *text, char *words[64])
{
    int count = 0;
    for (char *at = text + strspn(text, " "); *at != '\0'; at += strspn(at, " ")) {
        const char *ends = *at == '\'' ? "'" : " ";
        at += *at == '\'';
        assert_true(count < 63);
        words[count++] = at;
        at += strcspn(at, ends);
        if (*at != '\0')
            *at++ = '\0';
    }
    words[count] = NULL;
}

static void start(Process *process, const char *program, const char *format, va_list arguments)
{
    char text[4096], *words[65];
    assert_in_range(vsnprintf(text, sizeof text, format, arguments), 0, sizeof text - 1);
    split(text, words + 1);
    memset(process, 0, sizeof *process);
    process->number = started++;
    fflush(NULL);
    process->pid = fork();
    assert_true(process->pid >= 0);
    if (process->pid == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL); // it ends with a test that is killed, too
        redirect(output_path(process, "out"), 1);
        redirect(output_path(process, "err"), 2);
        char **argv = words;
        for (; argv[1] != NULL && is_assignment(argv[1]); argv++)
            putenv(argv[1]);
        argv[0] = (char *)(uintptr_t)(program != NULL ? program : server);
        if (chdir(folder.folder) == 0)
            execvp(argv[0], argv);
        _exit(127);
    }
    replace_running(0, process->pid);
}

void process_start(Process *process, const char *program, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    start(process, program, format, list);
    va_end(list);
}

void process_run(Process *process, const char *program, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    start(process, program, format, list);
    va_end(list);
    process_wait(process);
}

void process_finish(Process *process, int number)
{
    process_signal(process, number);
    process_wait(process);
}

void expect_code(const Process *process, int code)
{
    if (process->code != code)
        fail_msg("exit %d, expected %d: %s%s", process->code, code, process->out, process->err);
}

void expect_ended(const Process *process, int code, const char *text)
{
    expect_code(process, code);
    expect_in(code == 0 ? process->out : process->err, text);
}

void expect_usage(const char *program, const Usage *row, size_t count)
{
    static Process run;
    for (size_t k = 0; k < count; k++) {
        process_run(&run, program, "%s", row[k].arguments);
        if (run.code != row[k].code || strstr(run.err, row[k].says) == NULL)
            fail_msg("'%s': exit %d, not %d, '%s' does not say '%s'", row[k].arguments, run.code,
                     row[k].code, run.err, row[k].says);
    }
}

void process_wait_for(Process *process, int code)
{
    process_wait(process);
    expect_code(process, code);
}

void process_end(Process *process)
{
    process_signal(process, SIGTERM);
    process_wait(process);
    if (process->code != 0)
        fail_msg("exit %d: %s", process->code, process->err);
}

void process_signal(const Process *process, int number)
{
    assert_int_equal(kill(process->pid, number), 0);
}

static void read_output(const Process *process, const char *kind, char text[OUTPUT_MAX])
{
    FILE *file = fopen(output_path(process, kind), "r");
    assert_non_null(file);
    size_t size = fread(text, 1, OUTPUT_MAX - 1, file);
    text[size] = '\0';
    fclose(file);
}

void process_wait(Process *process)
{
    enum { WAIT_S = 120, PAUSES_PER_S = 200 };
    const struct timespec pause = {.tv_nsec = 1000000000 / PAUSES_PER_S};
    int status = 0;
    pid_t ended = 0;
    for (int i = 0; i < WAIT_S * PAUSES_PER_S && ended == 0; i++) {
        ended = waitpid(process->pid, &status, WNOHANG);
        if (ended == 0)
            nanosleep(&pause, NULL);
    }
    if (ended == 0) {
        kill(process->pid, SIGKILL);
        waitpid(process->pid, &status, 0);
    }
    replace_running(process->pid, 0);
    read_output(process, "out", process->out);
    read_output(process, "err", process->err);
    process->code = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
    if (ended == 0)
        fail_msg("the process did not end within %d s; it said: %s", WAIT_S, process->err);
}

void expect_refusal(const Process *process, int code, const char *text)
{
    const char *end = strchr(process->err, '\n');
    if (process->code != code || strstr(process->err, text) == NULL || end == NULL ||
        end[1] != '\0')
        fail_msg("exit %d, expected %d with '%s' in one line: %s", process->code, code, text,
                 process->err);
}

void expect_printed(const Process *process, const char *text)
{
    if (strstr(process->out, text) == NULL)
        fail_msg("'%s' is not in: %s%s", text, process->out, process->err);
}

static const char *find_printed(const Process *process, const char *name)
{
    size_t length = strlen(name);
    for (const char *line = process->out; line != NULL; line = strchr(line, '\n')) {
        line += *line == '\n';
        if (strncmp(line, name, length) == 0 && strncmp(line + length, ": ", 2) == 0)
            return line + length + 2;
    }
    fail_msg("no '%s: ' (exit %d) in: %s%s", name, process->code, process->out, process->err);
    return "";
}

long long printed(const Process *process, const char *name)
{
    return strtoll(find_printed(process, name), NULL, 10);
}

void printed_state(const Process *process, char state[32])
{
    snprintf(state, 17, "%s", find_printed(process, "state"));
    assert_int_equal(strlen(state), 16);
}
