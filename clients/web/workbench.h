// SPDX-License-Identifier: MIT
// The workbench: starts the scenes of a folder, proposes scenes for meshes, and records, by running
// pliantd, pliant-prepare and pliant-record. The main thread, which is the LCM thread, does all of
// it; threads of pages only queue their requests.
#ifndef PLIANT_WEB_WORKBENCH_H
#define PLIANT_WEB_WORKBENCH_H

#include "board.h"
#include "child.h"
#include "folder.h"
#include "requests.h"

#include <pthread.h>

enum { WORKBENCH_QUEUE = 16, WORKBENCH_CFG_MAX = 8192 };

// Most bytes of one mesh, and of all files in the folder of uploads.
extern const int64_t WORKBENCH_MESH_BYTES, WORKBENCH_UPLOADS_BYTES;

typedef struct WorkbenchOptions {
    const char *scenes;               // folder
    const char *uploads, *recordings; // folders; NULL: "uploads" and "recordings" in `scenes`
    const char *pliantd;              // NULL: beside this program
    const char *url, *prefix, *input_prefix; // as this program's; NULL: the defaults
} WorkbenchOptions;

typedef struct WorkbenchAsk {
    int32_t sender;
    Ask ask;
} WorkbenchAsk;

typedef enum Program { PLIANTD, PLIANT_PLAY, PLIANT_PREPARE, PLIANT_RECORD, PROGRAMS } Program;

// What runs now, as the last message to pages has it.
typedef struct WorkbenchJob {
    Child child;
    char file[FOLDER_NAME_MAX]; // scene, recording or mesh
    AskFolder folder;           // of a scene or recording that runs
} WorkbenchJob;

typedef struct Workbench {
    // constant once it is open
    Folder folder[3]; // by AskFolder; those that could not be made are not open
    char program[PROGRAMS][FOLDER_PATH_MAX]; // "": not there
    char url[320], prefix[CLIENT_PREFIX_MAX], input_prefix[CLIENT_PREFIX_MAX];
    Board *board;
    // under the lock
    pthread_mutex_t lock;
    WorkbenchAsk queue[WORKBENCH_QUEUE];
    int waiting;
    // the main thread
    WorkbenchJob daemon, recorder, prepare;
    WorkbenchAsk next; // to be started when the daemon has ended; sender 0: nothing
    enum { EVEN, CHECK, PROPOSE } step; // which run of pliant-prepare it is
    Ask asked;
    char check[CHILD_TEXT_MAX + 1];     // what it said of the mesh
    char making[FOLDER_NAME_MAX];       // the mesh or scene that it writes, in uploads
    char scene[FOLDER_NAME_MAX];        // that it has proposed; "" while there is none
    char scene_text[WORKBENCH_CFG_MAX]; // its contents
    FolderFile last;                    // the last scene that was proposed, as it was written,
    char last_mesh[FOLDER_NAME_MAX];    // and its mesh
    bool foreign;                       // a daemon runs that was not started here, as pages know it
    int64_t looked_ns;     // when the folders were last looked at; 0: pages know nothing yet
    int64_t listed_ns;     // when they were last read
    int64_t changed_ns[3]; // and of each, how new it was
    FolderList scenes, uploaded, meshes, recordings;
} Workbench;

bool workbench_open(Workbench *workbench, const WorkbenchOptions *options, Board *board,
                    PliantError *error);
// Ends everything that it has started, and waits for it.
void workbench_close(Workbench *workbench);

// Queues a request of kind ASK_START to ASK_PROPOSE. Any thread. Returns false if too many wait.
bool workbench_ask(Workbench *workbench, int32_t sender, const Ask *ask);

// What the LCM thread knows of the daemon on the prefix, whoever has started it.
typedef struct WorkbenchHeard {
    bool linked;       // a status has come within two seconds
    int64_t status_ns; // when the newest came (CLOCK_MONOTONIC)
    const char *scene; // its name
} WorkbenchHeard;

// Does what is due. The main thread, every few ms.
void workbench_turn(Workbench *workbench, const WorkbenchHeard *heard, int64_t now_ns);

#endif
