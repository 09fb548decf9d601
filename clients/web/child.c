// SPDX-License-Identifier: MIT
// A program that this one runs and watches.
#include "child.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static const double PATIENCE_S = 5.0; // from SIGTERM to SIGKILL
static const int TURN_READS = 8;

// --- in the child ---

// Sets a limit, or leaves it lower.
static void limit(int what, rlim_t most)
{
    struct rlimit now;
    if (getrlimit(what, &now) != 0)
        return;
    rlim_t value = now.rlim_max != RLIM_INFINITY && now.rlim_max < most ? now.rlim_max : most;
    setrlimit(what, &(struct rlimit){value, value});
}

static void say(const char *text)
{
    ssize_t written = write(STDERR_FILENO, text, strlen(text));
    (void)written; // there is nobody else to tell
}

// Becomes the program. Only calls that are safe after a fork of a program with threads.
static _Noreturn void become(const char *const argv[], const ChildOptions *options, pid_t parent,
                             int out)
{
    // It ends with us: asked first, as by an operator.
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent)
        _exit(127);
    int nothing = open("/dev/null", O_RDONLY);
    if (nothing < 0 || dup2(nothing, STDIN_FILENO) < 0 || dup2(out, STDOUT_FILENO) < 0 ||
        dup2(out, STDERR_FILENO) < 0 || close_range(3, ~0U, 0) != 0)
        _exit(127);
    // Handlers of ours would take a signal meant for the program; one that has come meanwhile acts
    // as soon as it is no longer blocked.
    for (int number = 1; number < NSIG; number++)
        signal(number, SIG_DFL);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, NULL);
    if (options->memory_bytes > 0)
        limit(RLIMIT_AS, (rlim_t)options->memory_bytes);
    if (options->seconds > 0.0)
        limit(RLIMIT_CPU, (rlim_t)options->seconds + 1);
    if (options->gentle)
        setpriority(PRIO_PROCESS, 0, 10);
    if (options->folder && chdir(options->folder) != 0) {
        say("the folder is gone\n");
        _exit(127);
    }
    execv(argv[0], (char *const *)(uintptr_t)argv);
    say(argv[0]);
    say(errno == ENOENT ? ": there is no such program\n" : ": cannot be run\n");
    _exit(127);
}

// --- in this program ---

bool child_start(Child *child, const char *const argv[], const ChildOptions *options,
                 PliantError *error)
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0)
        return client_fail(error, "%s: no pipe: %s", argv[0], strerror(errno));
    // The child's end waits as an ordinary output does.
    fcntl(ends[1], F_SETFL, fcntl(ends[1], F_GETFL) & ~O_NONBLOCK);
    pid_t parent = getpid(), pid = fork();
    if (pid == 0)
        become(argv, options, parent, ends[1]);
    int why = errno;
    close(ends[1]);
    if (pid < 0) {
        close(ends[0]);
        return client_fail(error, "%s: no process: %s", argv[0], strerror(why));
    }
    double patience_s = options->patience_s > 0.0 ? options->patience_s : PATIENCE_S;
    *child = (Child){.pid = pid, .fd = ends[0], .patience_ns = (int64_t)(patience_s * 1e9)};
    if (options->seconds > 0.0)
        child->kill_ns = client_now_ns() + (int64_t)(options->seconds * 1e9);
    return true;
}

// Keeps the last CHILD_TEXT_MAX bytes.
static void keep(Child *child, const char *text, size_t size)
{
    size_t over = child->size + size > CHILD_TEXT_MAX ? child->size + size - CHILD_TEXT_MAX : 0;
    if (over > 0) {
        child->cut = true;
        memmove(child->text, child->text + over, child->size - over);
        child->size -= over;
    }
    memcpy(child->text + child->size, text, size);
    child->size += size;
    child->text[child->size] = '\0';
}

static void read_text(Child *child)
{
    char piece[CHILD_TEXT_MAX / 2];
    for (int k = 0; k < TURN_READS; k++) {
        ssize_t size = read(child->fd, piece, sizeof piece);
        if (size <= 0)
            break;
        keep(child, piece, (size_t)size);
    }
}

bool child_turn(Child *child, int64_t now_ns)
{
    if (child->pid == 0)
        return false;
    read_text(child);
    if (child->kill_ns && now_ns > child->kill_ns)
        kill(child->pid, SIGKILL);
    if (waitpid(child->pid, &child->status, WNOHANG) != child->pid)
        return false;
    read_text(child); // its last words
    close(child->fd);
    child->pid = 0;
    child->over = true;
    child->ended_ns = now_ns;
    return true;
}

void child_stop(Child *child, int64_t now_ns)
{
    if (child->pid == 0 || child->asked)
        return;
    child->asked = true;
    child->kill_ns = now_ns + child->patience_ns;
    kill(child->pid, SIGTERM);
}

void child_end(Child *child)
{
    child_stop(child, client_now_ns());
    while (child->pid != 0 && !child_turn(child, client_now_ns()))
        nanosleep(&(struct timespec){.tv_nsec = 2000000}, NULL);
}

void child_how(const Child *child, char how[CHILD_HOW_MAX])
{
    how[0] = '\0';
    if (!child->over)
        return;
    if (WIFSIGNALED(child->status))
        snprintf(how, CHILD_HOW_MAX, "signal %d (%s)", WTERMSIG(child->status),
                 strsignal(WTERMSIG(child->status)));
    else
        snprintf(how, CHILD_HOW_MAX, "exit status %d", WEXITSTATUS(child->status));
}
