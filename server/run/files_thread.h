// The files thread writes checkpoint images and recorded frames that the step thread has copied,
// and the log of applied inputs. It runs only if one of them is enabled, and never touches the
// simulation.
#ifndef PLIANT_RUN_FILES_THREAD_H
#define PLIANT_RUN_FILES_THREAD_H

#include "scene/scene.h"
#include "run/exchange.h"
#include "run/input_log.h"
#include "run/recorder.h"

#include <pthread.h>

typedef struct FilesThread {
    // constant while the thread runs
    const World *world;
    const Scene *scene;
    Exchange *exchange;
    InputLogWriter *log; // or NULL; destroyed by files_thread_finish
    Recorder *recorder;  // or NULL; closed by files_thread_close
    // used by the thread alone
    OutputClaim checkpoint; // claimed by the owner before the start and released after the end
    int look_ms;            // pause between two iterations [ms]
    int64_t step;           // of the newest frame
    bool recording_failed, log_failed;
    int64_t lost_reported, lost_reported_ns;
    // results
    int64_t checkpoints;
    Status status; // of the newest checkpoint, or of the log
    pthread_t thread;
    atomic_bool finish;
    bool running;
} FilesThread;

// Starts the thread. Everything but `log` and `recorder` outlives it.
bool files_thread_start(FilesThread *files, Status *status);
// Writes what is left and ends the thread; call after the step thread has ended. `step`: ticks
// completed. Returns false with files->status if a file is incomplete.
bool files_thread_finish(FilesThread *files, int64_t step);
// Records the last events of the bus and closes the recording; call after the bus thread has ended
// too. Returns false with `status` if the recording is incomplete.
bool files_thread_close(FilesThread *files, Status *status);

#endif
