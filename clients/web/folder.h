// SPDX-License-Identifier: MIT
// The folders of the workbench: which of their files may be named, the list of them, and new ones.
// Names from pages are never followed out of the folder: they have no '/', and links are no files.
// Any thread; no function prints.
#ifndef PLIANT_WEB_FOLDER_H
#define PLIANT_WEB_FOLDER_H

#include "client.h"

#include <stdbool.h>
#include <stdint.h>

enum {
    FOLDER_NAME_MAX = 96, // of a file, with the terminating zero
    FOLDER_PATH_MAX = 4096,
    FOLDER_FILES_MAX = 200, // listed, and meshes that pages may send
    FOLDER_ENTRIES_MAX = 20000,
    FOLDER_ABOUT_MAX = 200,
};

typedef struct Folder {
    char path[FOLDER_PATH_MAX]; // without links; "" if it is not open
    int fd;                     // -1: not open
} Folder;

// The endings of a kind of file: NULL-terminated, in lower case.
extern const char *const FOLDER_SCENES[], *const FOLDER_MESHES[], *const FOLDER_RECORDINGS[],
                                                                      *const FOLDER_IMAGES[];

typedef struct FolderFile {
    char name[FOLDER_NAME_MAX];
    char about[FOLDER_ABOUT_MAX]; // the comment that it begins with, if asked for; or ""
    int64_t bytes;
    int64_t utime; // last change, CLOCK_REALTIME [us]
} FolderFile;

typedef struct FolderList {
    FolderFile file[FOLDER_FILES_MAX]; // in the order of their names
    int count, more;                   // `more`: files left out
} FolderList;

// The folder of the running program; false if the kernel does not say it.
bool folder_of_program(char path[FOLDER_PATH_MAX]);
// Opens a folder; `make`: makes it if there is none. On failure folder->fd is -1.
bool folder_open(Folder *folder, const char *path, bool make, PliantError *error);
void folder_close(Folder *folder);

// True for 1 to FOLDER_NAME_MAX - 1 printable ASCII characters without '/', '\' and '"', which
// begin with neither '.' nor '-' and end with more than nothing before one of the endings.
bool folder_name_valid(const char *name, const char *const *endings);
// Makes any text a valid name with one of the endings: keeps what follows the last '/' or '\', and
// letters, digits and "._-" of it. Returns false with a sentence if no ending fits.
bool folder_name_clean(const char *text, const char *const *endings, char name[FOLDER_NAME_MAX],
                       PliantError *error);
// Copies a name, cut to what fits.
void folder_copy_name(char to[FOLDER_NAME_MAX], const char *name);
// The length of a name before its ending.
int folder_stem(const char *name, const char *const *endings);

// True if the folder has a regular file (no link) of that valid name. `file`, which may be NULL, is
// then set; it says nothing about its comment.
bool folder_has(const Folder *folder, const char *name, const char *const *endings,
                FolderFile *file);
// Opens such a file for reading; -1: there is none.
int folder_read(const Folder *folder, const char *name, const char *const *endings);
// Lists such files; `about`: with their first comments.
void folder_list(const Folder *folder, const char *const *endings, bool about, FolderList *list);
// The bytes of all regular files; `files`: how many of them have one of the endings. Of a folder
// with more entries than FOLDER_ENTRIES_MAX it looks at so many.
int64_t folder_bytes(const Folder *folder, const char *const *endings, int *files);
// When a file was last added, renamed or removed [ns], CLOCK_REALTIME; 0: unknown.
int64_t folder_changed_ns(const Folder *folder);
// Sets `free` to NAME or, if that exists, to NAME-2, NAME-3 ... before the ending.
bool folder_free_name(const Folder *folder, const char *name, const char *const *endings,
                      char free[FOLDER_NAME_MAX], PliantError *error);

// --- a file that comes in pieces -----------------------------------------------------------------

// A hidden file until it is complete, then one under a name that was free.
typedef struct Upload {
    const Folder *folder;
    int fd; // -1: none
    char name[FOLDER_NAME_MAX];
    int64_t bytes, most;
} Upload;

// Removes what servers that were killed have left unfinished.
void upload_sweep(const Folder *folder);
// Begins a mesh; `text` is the name as the page has it, `most` the bytes that it may have.
bool upload_begin(Upload *upload, const Folder *folder, const char *text, int64_t most,
                  PliantError *error);
bool upload_add(Upload *upload, const void *data, size_t size, PliantError *error);
// Gives it its name, which upload->name then holds.
bool upload_finish(Upload *upload, PliantError *error);
// Forgets an unfinished one; without effect on others.
void upload_drop(Upload *upload);

#endif
