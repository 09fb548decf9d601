// SPDX-License-Identifier: MIT
// Folders of results, and their pictures.
#include "fit/results.h"

#include "base/output.h"

#include <errno.h>
#include <spawn.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

enum { FILE_NAME = 32 };

const char *results_path(char path[RESULTS_PATH], const char *folder, const char *name)
{
    snprintf(path, RESULTS_PATH, "%.*s/%s", RESULTS_PATH - FILE_NAME - 1, folder, name);
    return path;
}

// Checks that only files of an earlier run are replaced: those next to its table, names[0].
static bool check_names(const ResultNames *names, const char *folder, Status *status)
{
    char path[RESULTS_PATH], table[RESULTS_PATH];
    struct stat facts;
    Status why = {0};
    // A folder with such a table is ours,
    bool ours = stat(results_path(table, folder, names->file[0]), &facts) == 0 && facts.st_size > 0;
    if (!output_check(table, names->mark, status))
        return false;
    // and in it only files of ours may be replaced; elsewhere none.
    for (int i = 0; names->file[i] != NULL; i++) {
        if (lstat(results_path(path, folder, names->file[i]), &facts) != 0)
            continue;
        if (!(ours && S_ISREG(facts.st_mode)) && !output_check(path, "", &why))
            return status_fail(status, STATUS_INVALID,
                               "%s: is not of a %s and would be replaced: name another folder "
                               "with --out",
                               path, names->kind);
    }
    return true;
}

bool results_make_folder(const ResultNames *names, const char *subject, const char *wanted,
                         char folder[RESULTS_PATH], Status *status)
{
    // The folder's name leaves room for those of the files.
    if (wanted != NULL && strlen(wanted) >= RESULTS_PATH - FILE_NAME)
        return status_fail(status, STATUS_INVALID, "pliant-%s: --out has more than %d letters",
                           names->kind, RESULTS_PATH - FILE_NAME);
    if (wanted != NULL)
        snprintf(folder, RESULTS_PATH, "%s", wanted);
    else
        snprintf(folder, RESULTS_PATH, "%s-%s", names->kind, subject);
    struct stat info;
    // A new folder, or one of ours.
    if (mkdir(folder, 0777) == 0 || (errno == EEXIST && stat(folder, &info) == 0 &&
                                     S_ISDIR(info.st_mode) && access(folder, W_OK) == 0))
        return check_names(names, folder, status);
    return status_fail(status, STATUS_FAILED, "%s: cannot be made or written to: %s", folder,
                       strerror(errno));
}

FILE *results_create(const char *folder, const char *name, char path[RESULTS_PATH], Status *status)
{
    FILE *out = fopen(results_path(path, folder, name), "w");
    if (out == NULL)
        status_fail(status, STATUS_FAILED, "%s: %s", path, strerror(errno));
    return out;
}

bool results_close(FILE *out, const char *path, Status *status)
{
    const bool bad = ferror(out) != 0;
    return (fclose(out) == 0 && !bad) ||
           status_fail(status, STATUS_FAILED, "%s: %s", path, strerror(errno));
}

DrawResult results_draw(const char *program, const char *folder, const char *script, Status *status)
{
    // Run in the folder, so that names in the script do not depend on the caller's.
    posix_spawn_file_actions_t actions;
    char first[RESULTS_PATH], name[RESULTS_PATH];
    snprintf(first, sizeof first, "%s", program);
    snprintf(name, sizeof name, "%s", script);
    char *const arguments[] = {first, name, NULL};
    pid_t pid;
    int exit_status = 0;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addchdir_np(&actions, folder);
    int error = posix_spawnp(&pid, program, &actions, NULL, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) {
        status_fail(status, STATUS_FAILED, "%s: %s", program, strerror(error));
        return error == ENOENT ? DRAW_NO_GNUPLOT : DRAW_FAILED;
    }
    // Wait for it, and say if it failed.
    while (waitpid(pid, &exit_status, 0) < 0 && errno == EINTR)
        ;
    if (WIFEXITED(exit_status) && WEXITSTATUS(exit_status) == 0)
        return DRAWN;
    status_fail(status, STATUS_FAILED, "%s could not draw %s/%s", program, folder, name);
    return DRAW_FAILED;
}
