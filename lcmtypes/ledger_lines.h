// SPDX-License-Identifier: MIT
// The ledger as a message and as lines of a recording, for all programs that publish or record one:
// the server, the recorder and the player. Numbers are copied as they are.
#ifndef PLIANT_LCMTYPES_LEDGER_LINES_H
#define PLIANT_LCMTYPES_LEDGER_LINES_H

#include "io/recording.h"

#include "pliant_ledger_t.h"

#include <string.h>

// What a message points to; lines beyond are not sent.
typedef struct LedgerParts {
    pliant_ledger_body_t body[LEDGER_BODIES];
    pliant_ledger_tissue_t tissue[LEDGER_TISSUES];
    pliant_ledger_region_t region[LEDGER_REGIONS];
} LedgerParts;

static inline char *ledger_text(const char *text)
{
    return (char *)(uintptr_t)text;
}

static inline void ledger_send_tissue(pliant_ledger_tissue_t *to, const RecordingLedger *line)
{
    *to = (pliant_ledger_tissue_t){.body = ledger_text(line->body),
                                   .name = ledger_text(line->name),
                                   .density = line->value[LEDGER_DENSITY],
                                   .at_load = line->value[LEDGER_AT_LOAD],
                                   .attached = line->value[LEDGER_ATTACHED],
                                   .cut_off = line->value[LEDGER_CUT_OFF],
                                   .removed = line->value[LEDGER_REMOVED],
                                   .coagulated = line->value[LEDGER_COAGULATED]};
}

static inline void ledger_send_region(pliant_ledger_region_t *to, const RecordingLedger *line)
{
    *to = (pliant_ledger_region_t){.name = ledger_text(line->name),
                                   .keep = (line->flag & LEDGER_KEEP) != 0,
                                   .touched = (line->flag & LEDGER_TOUCHED) != 0,
                                   .margin = line->value[LEDGER_MARGIN],
                                   .distance = line->value[LEDGER_DISTANCE],
                                   .time = line->value[LEDGER_TIME],
                                   .body = ledger_text(line->body),
                                   .by = ledger_text(line->by)};
}

// Returns a message without utime and sequence; it points into lines and parts.
static inline pliant_ledger_t ledger_message(const RecordingLedger *line, int count,
                                             LedgerParts *parts)
{
    pliant_ledger_t message = {
        .body = parts->body, .tissue = parts->tissue, .region = parts->region};
    for (int i = 0; i < count; i++, line++) {
        message.step = line->step;
        message.time = line->time;
        if (line->line == LEDGER_BODY && message.num_bodies < LEDGER_BODIES)
            parts->body[message.num_bodies++] =
                (pliant_ledger_body_t){.name = ledger_text(line->body),
                                       .solid = (line->flag & LEDGER_SOLID) != 0,
                                       .cut = line->value[LEDGER_CUT],
                                       .torn = line->value[LEDGER_TORN]};
        else if (line->line == LEDGER_TISSUE && message.num_tissues < LEDGER_TISSUES)
            ledger_send_tissue(&parts->tissue[message.num_tissues++], line);
        else if (line->line == LEDGER_REGION && message.num_regions < LEDGER_REGIONS)
            ledger_send_region(&parts->region[message.num_regions++], line);
    }
    return message;
}

static inline RecordingLedger *ledger_add(RecordingLedger *line, int *count, LedgerLine kind,
                                          const pliant_ledger_t *message, const char *body,
                                          const char *name)
{
    RecordingLedger *to = &line[(*count)++];
    memset(to, 0, sizeof *to); // also between its members: lines are compared
    to->time = message->time;
    to->step = message->step;
    to->line = (int32_t)kind;
    snprintf(to->body, sizeof to->body, "%s", body);
    snprintf(to->name, sizeof to->name, "%s", name);
    return to;
}

// Writes the lines of a message that was checked, at most LEDGER_LINES; returns their number.
static inline int ledger_lines(const pliant_ledger_t *message, RecordingLedger line[LEDGER_LINES])
{
    int count = 0;
    for (int i = 0; i < message->num_bodies && i < LEDGER_BODIES; i++) {
        const pliant_ledger_body_t *from = &message->body[i];
        RecordingLedger *to = ledger_add(line, &count, LEDGER_BODY, message, from->name, "");
        to->flag = from->solid ? LEDGER_SOLID : 0;
        to->value[LEDGER_CUT] = from->cut;
        to->value[LEDGER_TORN] = from->torn;
    }
    for (int i = 0; i < message->num_tissues && i < LEDGER_TISSUES; i++) {
        const pliant_ledger_tissue_t *from = &message->tissue[i];
        RecordingLedger *to =
            ledger_add(line, &count, LEDGER_TISSUE, message, from->body, from->name);
        to->value[LEDGER_DENSITY] = from->density;
        to->value[LEDGER_AT_LOAD] = from->at_load;
        to->value[LEDGER_ATTACHED] = from->attached;
        to->value[LEDGER_CUT_OFF] = from->cut_off;
        to->value[LEDGER_REMOVED] = from->removed;
        to->value[LEDGER_COAGULATED] = from->coagulated;
    }
    for (int i = 0; i < message->num_regions && i < LEDGER_REGIONS; i++) {
        const pliant_ledger_region_t *from = &message->region[i];
        RecordingLedger *to =
            ledger_add(line, &count, LEDGER_REGION, message, from->body, from->name);
        to->flag = (from->keep ? LEDGER_KEEP : 0) | (from->touched ? LEDGER_TOUCHED : 0);
        snprintf(to->by, sizeof to->by, "%s", from->by);
        to->value[LEDGER_MARGIN] = from->margin;
        to->value[LEDGER_DISTANCE] = from->distance;
        to->value[LEDGER_TIME] = from->time;
    }
    return count;
}

#endif
