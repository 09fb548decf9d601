// The files thread: writes checkpoint images that the step thread has taken, and the log of applied
// inputs. Started only when one of them is asked for. Never touches the simulation.
#ifndef PLIANT_RUN_FILES_THREAD_H
#define PLIANT_RUN_FILES_THREAD_H

#include "files/scene.h"
#include "run/exchange.h"
#include "run/input_log.h"

#include <pthread.h>

typedef struct FilesThread {
    // constant while the thread runs
    const char *checkpoint_path; // or NULL
    const World *world;
    const Scene *scene;
    Exchange *exchange;
    InputLogWriter *log; // or NULL; destroyed by files_thread_finish
    // results
    int64_t checkpoints;
    Status status; // of the newest checkpoint, or of the log
    pthread_t thread;
    atomic_bool finish;
    bool running;
} FilesThread;

// Everything but `log` outlives the thread.
bool files_thread_start(FilesThread *files, Status *status);
// After the step thread has ended: writes what is left and ends. `step`: ticks completed. False
// with files->status if a file is not whole.
bool files_thread_finish(FilesThread *files, int64_t step);

#endif
