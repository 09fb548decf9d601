// SPDX-License-Identifier: MIT
// Errors as a message and as lines of a recording, for all programs that publish or record them:
// the server, the recorder and the player. Numbers are copied as they are.
#ifndef PLIANT_LCMTYPES_ERROR_LINES_H
#define PLIANT_LCMTYPES_ERROR_LINES_H

#include "io/recording.h"

#include "pliant_error_t.h"

#include <math.h>
#include <string.h>

// What a message points to; lines beyond are not sent.
typedef struct ErrorParts {
    pliant_error_body_t body[ERRORS_BODIES];
    pliant_error_tool_t tool[ERRORS_TOOLS];
} ErrorParts;

// Returns a message without utime and sequence; it points into lines and parts.
static inline pliant_error_t error_message(const RecordingLedger *line, int count,
                                           ErrorParts *parts)
{
    pliant_error_t message = {.body = parts->body, .tool = parts->tool};
    for (int i = 0; i < count; i++, line++) {
        message.step = line->step;
        message.time = line->time;
        if (line->line == ERRORS_BODY && message.num_bodies < ERRORS_BODIES)
            parts->body[message.num_bodies++] = (pliant_error_body_t){
                .name = (char *)(uintptr_t)line->body,
                .space = line->value[ERRORS_SPACE],
                .steps = line->value[ERRORS_STEPS],
                .total = line->value[ERRORS_TOTAL],
                .relative = line->value[ERRORS_RELATIVE],
                .age = (int64_t)fmax(-1.0, fmin(9e15, line->value[ERRORS_AGE]))};
        else if (line->line == ERRORS_TOOL && message.num_tools < ERRORS_TOOLS)
            parts->tool[message.num_tools++] =
                (pliant_error_tool_t){.tool = line->flag,
                                      .force = line->value[ERRORS_FORCE],
                                      .error = line->value[ERRORS_ERROR],
                                      .share = line->value[ERRORS_SHARE]};
    }
    return message;
}

static inline RecordingLedger *error_add(RecordingLedger *line, int *count, ErrorLine kind,
                                         const pliant_error_t *message)
{
    RecordingLedger *to = &line[(*count)++];
    memset(to, 0, sizeof *to);
    to->time = message->time;
    to->step = message->step;
    to->line = (int32_t)kind;
    return to;
}

// Writes the lines of a message that was checked, at most ERRORS_LINES; returns their number.
static inline int error_lines(const pliant_error_t *message, RecordingLedger line[ERRORS_LINES])
{
    int count = 0;
    for (int i = 0; i < message->num_bodies && i < ERRORS_BODIES; i++) {
        const pliant_error_body_t *from = &message->body[i];
        RecordingLedger *to = error_add(line, &count, ERRORS_BODY, message);
        snprintf(to->body, sizeof to->body, "%s", from->name);
        to->value[ERRORS_SPACE] = from->space;
        to->value[ERRORS_STEPS] = from->steps;
        to->value[ERRORS_TOTAL] = from->total;
        to->value[ERRORS_RELATIVE] = from->relative;
        to->value[ERRORS_AGE] = (double)from->age;
    }
    for (int i = 0; i < message->num_tools && i < ERRORS_TOOLS; i++) {
        const pliant_error_tool_t *from = &message->tool[i];
        RecordingLedger *to = error_add(line, &count, ERRORS_TOOL, message);
        to->flag = from->tool;
        to->value[ERRORS_FORCE] = from->force;
        to->value[ERRORS_ERROR] = from->error;
        to->value[ERRORS_SHARE] = from->share;
    }
    return count;
}

#endif
