// Shared by the files of the score sheet alone.
#ifndef PLIANT_PLAY_SCORE_PARTS_H
#define PLIANT_PLAY_SCORE_PARTS_H

#include "score.h"

#include <math.h>

#define SCORE_UNKNOWN ((double)NAN)

enum { SCORE_SPEED_HZ = 60 }; // of the speeds that movements are found in

// A figure of the sheet, as all three files have it.
typedef struct ScoreMeasure {
    const char *name; // with its unit: "path_m"
    const char *title, *unit;
    double factor; // from the value to what the page shows
    size_t offset; // of a double in ScoreTool
} ScoreMeasure;

enum { SCORE_TOOL_MEASURES = 14 };
extern const ScoreMeasure score_tool_measure[SCORE_TOOL_MEASURES];

#endif
