// SPDX-License-Identifier: MIT
// How libpliant-client calls libpliant-recording, which has HDF5: it is loaded when a recording is
// opened, so that a program that opens none needs neither.
#ifndef PLIANT_CLIENTS_KIT_READER_H
#define PLIANT_CLIENTS_KIT_READER_H

#include "pliant/client.h"

#define KIT_READER_LIBRARY "libpliant-recording.so.0"
#define KIT_READER_SYMBOL  "pliant_recording_reader"

// The functions pliant_recording_...
typedef struct KitReader {
    const char *version; // of the library: the two share the layout of frames
    PliantRecording *(*open)(const char *path, PliantError *error);
    void (*close)(PliantRecording *recording);
    const char *(*error)(const PliantRecording *recording);
    int (*body_count)(const PliantRecording *recording);
    const char *(*body_name)(const PliantRecording *recording, int k);
    int64_t (*frames)(const PliantRecording *recording, const char *body);
    int64_t (*find)(const PliantRecording *recording, const char *body, double time);
    const PliantBody *(*frame)(PliantRecording *recording, const char *body, int64_t k);
    int64_t (*tool_rows)(const PliantRecording *recording, int32_t tool);
    bool (*tool)(PliantRecording *recording, int32_t tool, int64_t first, int count,
                 PliantToolRow *row);
    int64_t (*events)(const PliantRecording *recording);
    const PliantEvent *(*event)(PliantRecording *recording, int64_t k);
} KitReader;

PLIANT_API const KitReader *pliant_recording_reader(void);

#endif
