// SPDX-License-Identifier: MIT
// Recordings in libpliant-client: loads libpliant-recording when the first one is opened, and calls
// it.
#include "reader.h"

#include <dlfcn.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>

static const KitReader *_Atomic reader; // NULL: none was opened yet

// Loads it from the folder of this library or program, else from where the system has libraries.
static void *load(void)
{
    Dl_info self;
    char path[4096];
    const char *slash = dladdr(&reader, &self) ? strrchr(self.dli_fname, '/') : NULL;
    void *library = NULL;
    if (slash && snprintf(path, sizeof path, "%.*s/%s", (int)(slash - self.dli_fname),
                          self.dli_fname, KIT_READER_LIBRARY) < (int)sizeof path)
        library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    return library ? library : dlopen(KIT_READER_LIBRARY, RTLD_NOW | RTLD_LOCAL);
}

static const KitReader *find(PliantError *error)
{
    void *library = load();
    const KitReader *(*get)(void) = NULL;
    if (library)
        *(void **)&get = dlsym(library, KIT_READER_SYMBOL);
    const KitReader *found = get ? get() : NULL;
    if (found && strcmp(found->version, pliant_version()) == 0)
        return found;
    if (error && found)
        snprintf(error->text, sizeof error->text, "%s is of version %.32s, libpliant-client of %s",
                 KIT_READER_LIBRARY, found->version, pliant_version());
    else if (error)
        snprintf(error->text, sizeof error->text, "recordings need %s: %.800s", KIT_READER_LIBRARY,
                 dlerror());
    return NULL;
}

PliantRecording *pliant_recording_open(const char *path, PliantError *error)
{
    if (!reader)
        reader = find(error);
    return reader ? reader->open(path, error) : NULL;
}

// Whoever has a recording has opened one, and the library with it.

void pliant_recording_close(PliantRecording *recording)
{
    if (recording)
        reader->close(recording);
}

const char *pliant_recording_error(const PliantRecording *recording)
{
    return reader->error(recording);
}

int pliant_recording_body_count(const PliantRecording *recording)
{
    return reader->body_count(recording);
}

const char *pliant_recording_body_name(const PliantRecording *recording, int k)
{
    return reader->body_name(recording, k);
}

int64_t pliant_recording_frames(const PliantRecording *recording, const char *body)
{
    return reader->frames(recording, body);
}

int64_t pliant_recording_find(const PliantRecording *recording, const char *body, double time)
{
    return reader->find(recording, body, time);
}

const PliantBody *pliant_recording_frame(PliantRecording *recording, const char *body, int64_t k)
{
    return reader->frame(recording, body, k);
}

int64_t pliant_recording_tool_rows(const PliantRecording *recording, int32_t tool)
{
    return reader->tool_rows(recording, tool);
}

bool pliant_recording_tool(PliantRecording *recording, int32_t tool, int64_t first, int count,
                           PliantToolRow *row)
{
    return reader->tool(recording, tool, first, count, row);
}

int64_t pliant_recording_events(const PliantRecording *recording)
{
    return reader->events(recording);
}

const PliantEvent *pliant_recording_event(PliantRecording *recording, int64_t k)
{
    return reader->event(recording, k);
}
