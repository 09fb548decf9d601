// Describes the contents of a recording, from the file as it is: ended, being written, or left by a
// writer that was killed. Checks every index and reports only data that exists.
#ifndef PLIANT_IO_RECORDING_INFO_H
#define PLIANT_IO_RECORDING_INFO_H

#include "io/recording.h"

#include <stdio.h>

typedef struct RecordingBodyInfo {
    char name[RECORDING_BODY_TEXT];
    int64_t frames; // complete frames
    int64_t broken; // begun but incomplete
    int64_t first_step, last_step;
    double first_time, last_time; // [s]
    int64_t topologies;
    int least_nodes, most_nodes; // of a frame
    RecordingCounts counts;      // of a file that was ended
} RecordingBodyInfo;

typedef struct RecordingToolInfo {
    char name[16]; // its id
    int64_t rows;
} RecordingToolInfo;

typedef struct RecordingKindInfo {
    char kind[RECORDING_KIND_TEXT];
    int64_t events;
} RecordingKindInfo;

enum { RECORDING_INFO_BODIES = 64, RECORDING_INFO_TOOLS = 32, RECORDING_INFO_KINDS = 64 };

typedef struct RecordingInfo {
    char created_by[64];
    bool ended; // cleanly; false: being written, or its writer was killed
    int body_count, tool_count, kind_count;
    RecordingBodyInfo body[RECORDING_INFO_BODIES];
    RecordingToolInfo tool[RECORDING_INFO_TOOLS];
    RecordingKindInfo kind[RECORDING_INFO_KINDS];
    int64_t events;
} RecordingInfo;

// Returns false with `status` (STATUS_INVALID) if it is not a recording, or which part is damaged.
bool recording_info_read(const char *path, RecordingInfo *info, Status *status);

void recording_info_print(const RecordingInfo *info, FILE *out);

#endif
