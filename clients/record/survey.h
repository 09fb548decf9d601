// What a daemon has: its bodies and tools, its rate and its own description, gathered from its
// messages. A recording's data sets exist from the start, so this must be known before it begins.
// One thread.
#ifndef PLIANT_CLIENTS_RECORD_SURVEY_H
#define PLIANT_CLIENTS_RECORD_SURVEY_H

#include "item.h"

typedef struct SurveyBody {
    char name[RECORDING_BODY_TEXT];
    bool listed;          // in the last status
    bool seen;            // nodes of it came
    int nodes, triangles; // slots of its mesh; 0: not known yet
} SurveyBody;

typedef struct SurveyTool {
    int id;
    bool is_static; // never driven: always there
} SurveyTool;

typedef struct Survey {
    char (*wanted)[RECORDING_BODY_TEXT]; // [wanted_count] names; none: all bodies
    int wanted_count;
    SurveyBody body[ITEM_BODIES];
    int body_count; // only grows: an index stays with its body
    SurveyTool tool[ITEM_TOOLS];
    int tool_count;
    bool fixed; // the tools are those of a file: none is added any more
    bool status_come;
    double rate_hz;  // 0: not known
    char *described; // the daemon's text, or NULL
    int64_t refused; // messages
} Survey;

void survey_destroy(Survey *survey);
// Another daemon: all but the bodies' names is forgotten.
void survey_restart(Survey *survey);

// The index of a body, or -1. One that is wanted is added while there is room, but once a status
// has listed the bodies no others are believed in.
int survey_find_body(Survey *survey, const char *name);
// -1: not known.
int survey_find_tool(const Survey *survey, int id);

// Raw messages.
void survey_take_status(Survey *survey, const void *data, size_t size);
void survey_take_reply(Survey *survey, const void *data, size_t size);
void survey_take_mesh(Survey *survey, int body, const void *data, size_t size);
// A tool that is heard of; once the daemon has described itself no others are believed in.
int survey_add_tool(Survey *survey, int id);

// Whether all that was asked for is known. `patient`: a status or a description may still come.
bool survey_ready(const Survey *survey, bool patient);
// Whether a body is one to record.
bool survey_records(const Survey *survey, int body);
// A name that was asked for and that the daemon does not have, or NULL.
const char *survey_missing(const Survey *survey);

#endif
