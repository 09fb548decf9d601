// The real daemon at 1 kHz with a sphere of 2562 nodes, publishing as it does by default, in a
// private network: what it says of itself at the end.
#include "bench.h"

#include <libgen.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static const char NAME[] = "live.loop";
static const int NODES = 2562;
enum { SKIPPED = 77 };

static bool write_scene(const char *path)
{
    FILE *file = fopen(path, "w");
    if (file == NULL)
        return false;
    fprintf(file,
            "name = \"bench\";\nrate_hz = 1000.0;\n"
            "bodies = ( { name = \"ball\";\n"
            "    mesh = { generator = \"ico_sphere\";  nodes = %d;  radius = 0.2; };\n"
            "    shape = { angular_frequency = 50.0;  damping_ratio = 0.1; }; } );\n",
            NODES);
    return fclose(file) == 0;
}

// Starts pliantd in a network of its own; its summary can be read from the returned stream.
static FILE *start(const char *daemon, const char *scene, int seconds, pid_t *child)
{
    static const char script[] = "ip link set lo up && ip link set lo multicast on && "
                                 "ip route add 224.0.0.0/4 dev lo || exit 77; exec \"$@\"";
    char duration[16];
    int ends[2];
    snprintf(duration, sizeof duration, "%d", seconds);
    if (pipe(ends) != 0)
        return NULL;
    fflush(NULL);
    *child = fork();
    if (*child == 0) {
        dup2(ends[1], STDOUT_FILENO);
        close(ends[0]);
        close(ends[1]);
        execlp("unshare", "unshare", geteuid() == 0 ? "-n" : "-rn", "sh", "-c", script, "sh",
               daemon, "--duration", duration, "--log-level", "error", scene, (char *)NULL);
        _exit(SKIPPED);
    }
    close(ends[1]);
    if (*child < 0) {
        close(ends[0]);
        return NULL;
    }
    return fdopen(ends[0], "r");
}

// Rows for "step time: p50 53, p99 65, p99.9 89, max 140 us" and its like.
static int read_summary(const Bench *bench, FILE *summary)
{
    static const char *const parts[4] = {"p50", "p99", "p99.9", "max"};
    char line[256];
    int rows = 0;
    while (fgets(line, sizeof line, summary) != NULL) {
        double us[4], count;
        const char *kind = strncmp(line, "step time: ", 11) == 0 ? "step"
                           : strncmp(line, "wake-up: ", 9) == 0  ? "wake"
                                                                 : NULL;
        if (kind != NULL && sscanf(strchr(line, ':'), ": p50 %lf, p99 %lf, p99.9 %lf, max %lf us",
                                   &us[0], &us[1], &us[2], &us[3]) == 4) {
            for (int k = 0; k < 4; k++, rows++) {
                char metric[32];
                snprintf(metric, sizeof metric, "wall_us_%s_%s", kind, parts[k]);
                bench_row(bench, NAME, NODES, metric, us[k], "us");
            }
        } else if (sscanf(line, "late ticks: %lf", &count) == 1) {
            bench_row(bench, NAME, NODES, "late_ticks", count, "1");
            rows++;
        } else if (sscanf(line, "ticks: %lf", &count) == 1) {
            bench_row(bench, NAME, NODES, "ticks", count, "1");
            rows++;
        }
    }
    return rows;
}

void bench_live(Bench *bench)
{
    if (!bench_wants(bench, NAME))
        return;
    char own[PATH_MAX - 16] = "", daemon[PATH_MAX], scene[] = "/tmp/pliant-bench-XXXXXX";
    if (readlink("/proc/self/exe", own, sizeof own - 1) <= 0) {
        bench_skip(bench, NAME, "cannot tell where this program is");
        return;
    }
    snprintf(daemon, sizeof daemon, "%s/pliantd", dirname(own));
    if (access(daemon, X_OK) != 0) {
        bench_skip(bench, NAME, "there is no pliantd beside pliant-bench");
        return;
    }
    int made = mkstemp(scene);
    if (made >= 0)
        close(made);
    pid_t child = -1;
    FILE *summary =
        made >= 0 && write_scene(scene) ? start(daemon, scene, bench->quick ? 1 : 5, &child) : NULL;
    int status = 0, rows = 0;
    if (summary != NULL) {
        rows = read_summary(bench, summary);
        fclose(summary);
        waitpid(child, &status, 0);
    }
    unlink(scene);
    if (summary == NULL)
        bench_fail(bench, NAME, "cannot start pliantd");
    else if (rows == 0 && WIFEXITED(status) && WEXITSTATUS(status) != 2)
        bench_skip(bench, NAME, "a private network (unshare -n) is not permitted here");
    else if (rows != 10 || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
        bench_fail(bench, NAME, "pliantd did not end as it should");
}
