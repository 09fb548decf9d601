// SPDX-License-Identifier: MIT
#include "daemon.h"

#include <libgen.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

const char *daemon_path(void)
{
    static char path[PATH_MAX];
    char own[PATH_MAX - 16] = "";
    if (path[0] == '\0' && readlink("/proc/self/exe", own, sizeof own - 1) > 0)
        snprintf(path, sizeof path, "%s/pliantd", dirname(own));
    return path[0] != '\0' && access(path, X_OK) == 0 ? path : NULL;
}

bool daemon_write_scene(const char *text, char *path, size_t size)
{
    snprintf(path, size, "/tmp/pliant-bench-XXXXXX");
    int made = mkstemp(path);
    FILE *file = made >= 0 ? fdopen(made, "w") : NULL;
    if (file == NULL) {
        if (made >= 0) {
            close(made);
            unlink(path);
        }
        return false;
    }
    bool whole = fputs(text, file) >= 0;
    if (fclose(file) == 0 && whole)
        return true;
    unlink(path);
    return false;
}

// Starts pliantd in a network of its own; its summary can be read from the returned stream.
static FILE *start(const char *daemon, const char *scene, int seconds, const char *beside,
                   pid_t *child)
{
    static const char script[] = "ip link set lo up && ip link set lo multicast on && "
                                 "ip route add 224.0.0.0/4 dev lo || exit 1; "
                                 "if [ -n \"$BESIDE\" ]; then BIN=$(dirname \"$1\"); "
                                 "(sleep 0.5; eval \"$BESIDE\") >/dev/null 2>&1 & fi; "
                                 "exec \"$@\"";
    char duration[16];
    int ends[2];
    snprintf(duration, sizeof duration, "%d", seconds);
    if (pipe(ends) != 0)
        return NULL;
    fflush(NULL);
    *child = fork();
    if (*child == 0) {
        setenv("BESIDE", beside, 1);
        dup2(ends[1], STDOUT_FILENO);
        close(ends[0]);
        close(ends[1]);
        execlp("unshare", "unshare", geteuid() == 0 ? "-n" : "-rn", "sh", "-c", script, "sh",
               daemon, "--duration", duration, "--log-level", "error", scene, (char *)NULL);
        _exit(127);
    }
    close(ends[1]);
    if (*child < 0) {
        close(ends[0]);
        return NULL;
    }
    return fdopen(ends[0], "r");
}

// Reads "step time: p50 53, p99 65, p99.9 89, max 140 us" and its like; how many of the four lines
// came.
static int read_summary(FILE *summary, DaemonRun *run)
{
    static const char *const times[2] = {"step time: ", "wake-up: "};
    char line[256];
    int lines = 0;
    while (fgets(line, sizeof line, summary) != NULL) {
        for (int k = 0; k < 2; k++) {
            double *us = k == 0 ? run->step : run->wake;
            if (strncmp(line, times[k], strlen(times[k])) == 0)
                lines += sscanf(line + strlen(times[k]), "p50 %lf, p99 %lf, p99.9 %lf, max %lf us",
                                &us[0], &us[1], &us[2], &us[3]) == DAEMON_PARTS;
        }
        lines += sscanf(line, "late ticks: %lf", &run->late_ticks) == 1;
        lines += sscanf(line, "ticks: %lf", &run->ticks) == 1;
    }
    return lines;
}

DaemonEnd daemon_run(const char *scene, int seconds, DaemonRun *run, const char **why)
{
    return daemon_run_beside(scene, seconds, "", run, why);
}

DaemonEnd daemon_run_beside(const char *scene, int seconds, const char *beside, DaemonRun *run,
                            const char **why)
{
    char path[64];
    const char *daemon = daemon_path();
    *run = (DaemonRun){0};
    if (daemon == NULL) {
        *why = "there is no pliantd beside pliant-bench";
        return DAEMON_SKIPPED;
    }
    if (system(geteuid() == 0 ? "unshare -n true 2>/dev/null" : "unshare -rn true 2>/dev/null") !=
        0) {
        *why = "a private network (unshare -n) is not permitted here";
        return DAEMON_SKIPPED;
    }
    *why = "cannot start pliantd";
    if (!daemon_write_scene(scene, path, sizeof path))
        return DAEMON_FAILED;
    pid_t child = -1;
    FILE *summary = start(daemon, path, seconds, beside, &child);
    int status = 0, lines = 0;
    if (summary != NULL) {
        lines = read_summary(summary, run);
        fclose(summary);
    }
    if (child > 0)
        waitpid(child, &status, 0);
    unlink(path);
    if (summary == NULL)
        return DAEMON_FAILED;
    *why = "pliantd did not end as it should";
    return lines == 4 && WIFEXITED(status) && WEXITSTATUS(status) == 0 ? DAEMON_DONE
                                                                       : DAEMON_FAILED;
}
