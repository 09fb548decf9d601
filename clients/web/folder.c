// SPDX-License-Identifier: MIT
// The folders of the workbench.
#include "folder.h"

#include "base/arguments.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

const char *const FOLDER_SCENES[] = {".cfg", NULL};
// A volume is one file: data of a header (.raw) cannot be sent.
const char *const FOLDER_MESHES[] = {".obj", ".stl", ".ply",  ".off", ".vtk",    ".vtp",
                                     ".vtu", ".msh", ".nrrd", ".nii", ".nii.gz", NULL};
const char *const FOLDER_RECORDINGS[] = {".h5", ".lcmlog", NULL};
const char *const FOLDER_IMAGES[] = {".png", ".jpg", ".jpeg", NULL};

enum { NUMBERS_MAX = 999 };

bool folder_of_program(char path[FOLDER_PATH_MAX])
{
    ssize_t length = readlink("/proc/self/exe", path, FOLDER_PATH_MAX - 1);
    path[length > 0 ? length : 0] = '\0';
    char *slash = strrchr(path, '/');
    if (slash)
        *slash = '\0';
    return slash != NULL;
}

bool folder_open(Folder *folder, const char *path, bool make, PliantError *error)
{
    *folder = (Folder){.fd = -1};
    if (make && mkdir(path, 0777) != 0 && errno != EEXIST)
        return client_fail(error, "cannot make the folder %s: %s", path, strerror(errno));
    char *real = realpath(path, NULL);
    int fd = real ? open(real, O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;
    if (fd < 0 || strlen(real) >= sizeof folder->path) {
        client_fail(error, "%s: %s", path, fd < 0 ? strerror(errno) : "its path is too long");
        if (fd >= 0)
            close(fd);
        free(real);
        return false;
    }
    strcpy(folder->path, real);
    folder->fd = fd;
    free(real);
    return true;
}

void folder_close(Folder *folder)
{
    if (folder->fd >= 0)
        close(folder->fd);
    *folder = (Folder){.fd = -1};
}

// --- names ---

void folder_copy_name(char to[FOLDER_NAME_MAX], const char *name)
{
    snprintf(to, FOLDER_NAME_MAX, "%.*s", FOLDER_NAME_MAX - 1, name);
}

int folder_stem(const char *name, const char *const *endings)
{
    int stem = (int)strlen(name);
    for (int k = 0; endings[k]; k++) {
        int before = (int)strlen(name) - (int)strlen(endings[k]);
        if (before >= 0 && before < stem && strcasecmp(name + before, endings[k]) == 0)
            stem = before;
    }
    return stem;
}

bool folder_name_valid(const char *name, const char *const *endings)
{
    size_t length = strlen(name);
    if (length == 0 || length >= FOLDER_NAME_MAX || name[0] == '.' || name[0] == '-')
        return false;
    for (const char *c = name; *c; c++) {
        if (*c < ' ' || *c > '~' || strchr("/\\\"", *c))
            return false;
    }
    int stem = folder_stem(name, endings);
    return stem > 0 && stem < (int)length;
}

bool folder_name_clean(const char *text, const char *const *endings, char name[FOLDER_NAME_MAX],
                       PliantError *error)
{
    // The last part of a path, of either kind of system.
    for (const char *c = text; *c; c++) {
        if (*c == '/' || *c == '\\')
            text = c + 1;
    }
    int length = (int)strlen(text), stem = folder_stem(text, endings);
    if (stem == length)
        return client_fail(error,
                           "its name ends with none of .obj, .stl, .ply, .off, .vtk, .vtp, .vtu, "
                           ".msh, .nrrd, .nii and .nii.gz");
    // Other characters become '_'; a long name loses some before its ending.
    int ending = length - stem, most = FOLDER_NAME_MAX - 8 - ending; // with place for a number
    int kept = stem < most ? stem : most;
    for (int k = 0; k < kept; k++) {
        bool plain = is_name_character(text[k]) || text[k] == '.';
        name[k] = plain ? text[k] : '_';
    }
    memcpy(name + kept, text + stem, (size_t)ending + 1);
    if (kept == 0)
        return client_fail(error, "its name is nothing but '%s'", name);
    if (name[0] == '.' || name[0] == '-')
        name[0] = '_';
    return true;
}

bool folder_free_name(const Folder *folder, const char *name, const char *const *endings,
                      char free[FOLDER_NAME_MAX], PliantError *error)
{
    struct stat info;
    int stem = folder_stem(name, endings);
    folder_copy_name(free, name);
    // Whatever has the name keeps it, a link too.
    for (int number = 2; fstatat(folder->fd, free, &info, AT_SYMLINK_NOFOLLOW) == 0; number++) {
        if (number > NUMBERS_MAX || snprintf(free, FOLDER_NAME_MAX, "%.*s-%d%s", stem, name, number,
                                             name + stem) >= FOLDER_NAME_MAX)
            return client_fail(error, "%s has too many files named %s", folder->path, name);
    }
    return true;
}

// --- files that are there ---

bool folder_has(const Folder *folder, const char *name, const char *const *endings,
                FolderFile *file)
{
    struct stat info;
    if (folder->fd < 0 || !folder_name_valid(name, endings) ||
        fstatat(folder->fd, name, &info, AT_SYMLINK_NOFOLLOW) != 0 || !S_ISREG(info.st_mode))
        return false;
    if (!file)
        return true;
    folder_copy_name(file->name, name);
    file->about[0] = '\0';
    file->bytes = info.st_size;
    file->utime = (int64_t)info.st_mtim.tv_sec * 1000000 + info.st_mtim.tv_nsec / 1000;
    return true;
}

int folder_read(const Folder *folder, const char *name, const char *const *endings)
{
    if (!folder_has(folder, name, endings, NULL))
        return -1;
    return openat(folder->fd, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
}

// True if what follows a full stop is no small letter, number or bracket of the same comment.
static bool ends_sentence(const char *after)
{
    if (*after && *after != ' ' && *after != '\n')
        return false;
    after += strspn(after, " ");
    if (*after == '\n' && after[1] == '#')
        after += 2 + strspn(after + 2, " ");
    return !((*after >= 'a' && *after <= 'z') || (*after >= '0' && *after <= '9') || *after == '(');
}

// Reads the comment that a scene begins with, its lines joined, up to the end of a sentence.
static void read_about(const Folder *folder, const char *name, char about[FOLDER_ABOUT_MAX])
{
    char head[2 * FOLDER_ABOUT_MAX] = "";
    int fd = folder_read(folder, name, FOLDER_SCENES);
    ssize_t size = fd >= 0 ? read(fd, head, sizeof head - 1) : 0;
    if (fd >= 0)
        close(fd);
    head[size > 0 ? size : 0] = '\0';
    int length = 0;
    for (const char *line = head; *line == '#';) {
        line++;
        line += length == 0 && *line == ' ';
        while (*line && *line != '\n' && length < FOLDER_ABOUT_MAX - 1) {
            char c = *line++;
            about[length++] = c < ' ' || c > '~' ? ' ' : c;
            // It ends with its first sentence, but not within "Choi et al. (2005), Fig. 8".
            if ((c == '.' && ends_sentence(line)) ||
                (c == ':' && (*line == ' ' || *line == '\n' || !*line))) {
                about[c == ':' ? length - 1 : length] = '\0';
                return;
            }
        }
        line = strchr(line, '\n');
        if (line == NULL)
            break;
        line++;
    }
    about[length] = '\0';
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const FolderFile *)a)->name, ((const FolderFile *)b)->name);
}

// Opens the entries of a folder from the first; NULL: not open, or no memory.
static DIR *open_entries(const Folder *folder)
{
    int fd = folder->fd < 0 ? -1 : openat(folder->fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *entries = fd < 0 ? NULL : fdopendir(fd);
    if (!entries && fd >= 0)
        close(fd);
    return entries;
}

void folder_list(const Folder *folder, const char *const *endings, bool about, FolderList *list)
{
    list->count = list->more = 0;
    DIR *entries = open_entries(folder);
    struct dirent *entry;
    for (int k = 0; entries && k < FOLDER_ENTRIES_MAX && (entry = readdir(entries)); k++) {
        FolderFile *file = list->count < FOLDER_FILES_MAX ? &list->file[list->count] : NULL;
        if (!folder_has(folder, entry->d_name, endings, file))
            continue;
        if (!file) {
            list->more++;
            continue;
        }
        list->count++;
        if (about)
            read_about(folder, file->name, file->about);
    }
    if (entries)
        closedir(entries);
    qsort(list->file, (size_t)list->count, sizeof *list->file, by_name);
}

int64_t folder_bytes(const Folder *folder, const char *const *endings, int *files)
{
    int64_t bytes = 0;
    *files = 0;
    DIR *entries = open_entries(folder);
    struct dirent *entry;
    for (int k = 0; entries && k < FOLDER_ENTRIES_MAX && (entry = readdir(entries)); k++) {
        struct stat info;
        if (fstatat(folder->fd, entry->d_name, &info, AT_SYMLINK_NOFOLLOW) != 0 ||
            !S_ISREG(info.st_mode))
            continue;
        bytes += info.st_size;
        *files += folder_name_valid(entry->d_name, endings);
    }
    if (entries)
        closedir(entries);
    return bytes;
}

int64_t folder_changed_ns(const Folder *folder)
{
    struct stat info;
    return folder->fd < 0 || fstat(folder->fd, &info) != 0
               ? 0
               : (int64_t)info.st_mtim.tv_sec * 1000000000 + info.st_mtim.tv_nsec;
}

// --- a file that comes in pieces ---

// The hidden name: one upload at a time and server.
#define HIDDEN ".upload-"
static const char *hidden_name(char name[32])
{
    snprintf(name, 32, HIDDEN "%d", (int)getpid());
    return name;
}

void upload_sweep(const Folder *folder)
{
    DIR *entries = open_entries(folder);
    struct dirent *entry;
    for (int k = 0; entries && k < FOLDER_ENTRIES_MAX && (entry = readdir(entries)); k++) {
        long long server;
        if (strncmp(entry->d_name, HIDDEN, strlen(HIDDEN)) == 0 &&
            argument_read_integer(entry->d_name + strlen(HIDDEN), 1, INT32_MAX, &server) &&
            kill((pid_t)server, 0) != 0 && errno == ESRCH)
            unlinkat(folder->fd, entry->d_name, 0);
    }
    if (entries)
        closedir(entries);
}

bool upload_begin(Upload *upload, const Folder *folder, const char *text, int64_t most,
                  PliantError *error)
{
    char hidden[32];
    *upload = (Upload){.folder = folder, .fd = -1, .most = most};
    if (folder->fd < 0)
        return client_fail(error, "there is no folder for meshes");
    if (!folder_name_clean(text, FOLDER_MESHES, upload->name, error))
        return false;
    unlinkat(folder->fd, hidden_name(hidden), 0); // of a killed server that had our number
    upload->fd = openat(folder->fd, hidden, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    return upload->fd >= 0 ||
           client_fail(error, "cannot write to %s: %s", folder->path, strerror(errno));
}

bool upload_add(Upload *upload, const void *data, size_t size, PliantError *error)
{
    if ((int64_t)size > upload->most - upload->bytes)
        return client_fail(error, "larger than %lld bytes", (long long)upload->most);
    for (const char *at = data; size > 0;) {
        ssize_t written = write(upload->fd, at, size);
        if (written < 0 && errno == EINTR)
            continue;
        if (written <= 0)
            return client_fail(error, "cannot be written: %s", strerror(errno));
        at += written;
        size -= (size_t)written;
        upload->bytes += written;
    }
    return true;
}

bool upload_finish(Upload *upload, PliantError *error)
{
    char hidden[32], wanted[FOLDER_NAME_MAX];
    int folder = upload->folder->fd, linked = -1;
    strcpy(wanted, upload->name);
    if (upload->bytes == 0)
        return client_fail(error, "empty");
    // A link fails where the name has been taken meanwhile: then the next.
    for (int tries = 0; tries < 10 && linked != 0; tries++) {
        if (!folder_free_name(upload->folder, wanted, FOLDER_MESHES, upload->name, error))
            return false;
        linked = linkat(folder, hidden_name(hidden), folder, upload->name, 0);
        if (linked != 0 && errno != EEXIST)
            break;
    }
    if (linked != 0)
        return client_fail(error, "cannot be named %s: %s", upload->name, strerror(errno));
    upload_drop(upload);
    return true;
}

void upload_drop(Upload *upload)
{
    char hidden[32];
    if (upload->fd < 0)
        return;
    close(upload->fd);
    unlinkat(upload->folder->fd, hidden_name(hidden), 0);
    upload->fd = -1;
}
