// SPDX-License-Identifier: MIT
// The bodies and tools of a daemon, its rate and its description, collected from its messages. A
// recording's data sets exist from the start, so all this must be known before it begins. One
// thread.
#ifndef PLIANT_CLIENTS_RECORD_SURVEY_H
#define PLIANT_CLIENTS_RECORD_SURVEY_H

#include "client.h"
#include "writer.h"

typedef struct SurveyBody {
    char name[RECORDING_BODY_TEXT];
    bool listed;          // in the last status
    bool seen;            // nodes of it arrived
    int nodes, triangles; // slots of its mesh; 0: unknown
    int first_wall;       // triangles from this slot on are walls of cuts; 0: none, or unknown
} SurveyBody;

typedef struct SurveyTool {
    int id;
    bool is_static; // not driven by poses: always present
} SurveyTool;

typedef struct Survey {
    char (*wanted)[RECORDING_BODY_TEXT]; // [wanted_count] names; none: all bodies
    int wanted_count;
    SurveyBody body[ITEM_BODIES];
    int body_count; // only grows: the index of a body never changes
    SurveyTool tool[ITEM_TOOLS];
    int tool_count;
    bool fixed; // the tools are those of a file: no more are added
    bool status_come;
    char listed[900]; // names of its bodies, by the newest status: "liver, stomach"
    double rate_hz;   // 0: not known
    char *described;  // the daemon's text, or NULL
    int64_t refused;  // messages
} Survey;

void survey_destroy(Survey *survey);
// Forgets all but the names of bodies, for another daemon.
void survey_restart(Survey *survey);

// Returns the index of a body, or -1. Adds a wanted body while there are free slots; after a status
// has listed the bodies, only those.
int survey_find_body(Survey *survey, const char *name);
// Returns the index of a tool; -1: unknown.
int survey_find_tool(const Survey *survey, int id);

// Take raw messages.
void survey_take_status(Survey *survey, const void *data, size_t size);
void survey_take_reply(Survey *survey, const void *data, size_t size);
void survey_take_mesh(Survey *survey, int body, const void *data, size_t size);
// Adds a tool that appears in a message; after the daemon's description, only those in it.
int survey_add_tool(Survey *survey, int id);

// True if everything needed is known. `patient`: a status or a description may still arrive.
bool survey_ready(const Survey *survey, bool patient);
// True if the body is to be recorded.
bool survey_records(const Survey *survey, int body);
// Returns a requested name that the daemon does not have, or NULL.
const char *survey_missing(const Survey *survey);

#endif
