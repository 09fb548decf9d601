// SPDX-License-Identifier: MIT
// Shared by the files of the score sheet alone.
#ifndef PLIANT_PLAY_SCORE_PARTS_H
#define PLIANT_PLAY_SCORE_PARTS_H

#include "score.h"

#include <math.h>

#define SCORE_UNKNOWN ((double)NAN)

#define SCORE_GAP 2.5 // median distances of rows that make a gap

enum { SCORE_SPEED_HZ = 60 }; // of the speeds that movements are found in

// A figure of a tool, as all three files have it.
typedef struct ScoreMeasure {
    const char *name;         // with its unit: "path_m"
    const char *title, *unit; // on the page
    double factor;            // from the value to the page's
    size_t offset;            // in ScoreTool
    bool whole;               // an int64_t, else a double
} ScoreMeasure;

// The page begins so.
#define SCORE_PAGE_MARK "<!DOCTYPE html><!-- pliant-score -->"

enum { SCORE_MEASURES = 17 };
extern const ScoreMeasure score_measure[SCORE_MEASURES];

double score_value(const ScoreTool *tool, const ScoreMeasure *measure);

// Figures of a body have their unit by its kind: "m" and "m2" of a wall, "m2" and "m3" of a solid.
const char *score_cut_unit(bool solid);
const char *score_size_unit(bool solid);

// Write a text in quotation marks for JSON, and one for HTML.
void score_put_text(const char *text, FILE *out);
void score_put_html(const char *text, FILE *out);

// score_ledger.c. Reads the last ledger of the session, if it has one; writes it to the files: of
// JSON a member, of CSV rows, of the page a chapter; prints it.
bool score_read_ledger(Timeline *timeline, Score *score, Status *status);
void score_ledger_json(const Score *score, FILE *out);
void score_ledger_csv(const Score *score, FILE *out);
void score_ledger_page(const Score *score, FILE *out);
void score_ledger_print(const Score *score, FILE *out);

// Returns zeroed memory, of one more than `count`; aborts without it.
void *score_allocate(int64_t count, size_t size);

#endif
