// The files thread: writes checkpoint images and frames to be recorded that the step thread has
// taken, and the log of applied inputs. Started only when one of them is asked for. Never touches
// the simulation.
#ifndef PLIANT_RUN_FILES_THREAD_H
#define PLIANT_RUN_FILES_THREAD_H

#include "files/scene.h"
#include "run/exchange.h"
#include "run/input_log.h"
#include "run/recorder.h"

#include <pthread.h>

typedef struct FilesThread {
    // constant while the thread runs
    const char *checkpoint_path; // or NULL
    const World *world;
    const Scene *scene;
    Exchange *exchange;
    InputLogWriter *log; // or NULL; destroyed by files_thread_finish
    Recorder *recorder;  // or NULL; closed by files_thread_close
    // the thread's own
    int look_ms;  // how long it rests
    int64_t step; // of the newest frame
    bool recording_failed, log_failed;
    int64_t lost_told, lost_told_ns;
    // results
    int64_t checkpoints;
    Status status; // of the newest checkpoint, or of the log
    pthread_t thread;
    atomic_bool finish;
    bool running;
} FilesThread;

// Everything but `log` and `recorder` outlives the thread.
bool files_thread_start(FilesThread *files, Status *status);
// After the step thread has ended: writes what is left and ends. `step`: ticks completed. False
// with files->status if a file is not whole.
bool files_thread_finish(FilesThread *files, int64_t step);
// After the bus thread has ended too: records what it told last and closes the recording. False
// with `status` if it is not whole.
bool files_thread_close(FilesThread *files, Status *status);

#endif
