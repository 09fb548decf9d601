// SPDX-License-Identifier: MIT
#include "survey.h"

#include "base/arguments.h"

#include "frames.h"
#include "wire.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pliant_mesh_t.h"
#include "pliant_reply_t.h"
#include "pliant_status_t.h"

void survey_destroy(Survey *survey)
{
    free(survey->described);
    survey->described = NULL;
}

void survey_restart(Survey *survey)
{
    // Names keep their indices; all else is another daemon's.
    for (int i = 0; i < survey->body_count; i++) {
        SurveyBody *body = &survey->body[i];
        body->listed = body->seen = false;
        body->nodes = body->triangles = 0;
    }
    survey_destroy(survey);
    survey->tool_count = 0;
    survey->status_come = survey->fixed = false;
    survey->rate_hz = 0.0;
}

// --- bodies and tools ---

static bool is_wanted(const Survey *survey, const char *name)
{
    for (int i = 0; i < survey->wanted_count; i++) {
        if (strcmp(survey->wanted[i], name) == 0)
            return true;
    }
    return survey->wanted_count == 0;
}

static int find_body(Survey *survey, const char *name, bool may_add)
{
    for (int i = 0; i < survey->body_count; i++) {
        if (strcmp(survey->body[i].name, name) == 0)
            return i;
    }
    // New names are taken only where they may be, and can be.
    if (!may_add || survey->body_count == ITEM_BODIES || !is_wanted(survey, name) ||
        !argument_is_name(name, RECORDING_BODY_TEXT - 1))
        return -1;
    SurveyBody *body = &survey->body[survey->body_count];
    *body = (SurveyBody){0};
    snprintf(body->name, sizeof body->name, "%s", name);
    return survey->body_count++;
}

int survey_find_body(Survey *survey, const char *name)
{
    return find_body(survey, name, !survey->status_come);
}

int survey_find_tool(const Survey *survey, int id)
{
    for (int i = 0; i < survey->tool_count; i++) {
        if (survey->tool[i].id == id)
            return i;
    }
    return -1;
}

static int add_tool(Survey *survey, int id)
{
    int at = survey_find_tool(survey, id);
    if (at >= 0 || survey->fixed || survey->tool_count == ITEM_TOOLS)
        return at;
    survey->tool[survey->tool_count] = (SurveyTool){.id = id};
    return survey->tool_count++;
}

int survey_add_tool(Survey *survey, int id)
{
    return survey->described ? survey_find_tool(survey, id) : add_tool(survey, id);
}

// --- messages ---

void survey_take_status(Survey *survey, const void *data, size_t size)
{
    pliant_status_t status;
    if (!wire_check(&WIRE_STATUS, data, size) ||
        pliant_status_t_decode(data, 0, (int)size, &status) < 0) {
        survey->refused++;
        return;
    }
    // Only what the newest status lists is there.
    for (int i = 0; i < survey->body_count; i++)
        survey->body[i].listed = false;
    survey->listed[0] = '\0';
    for (int i = 0; i < status.num_bodies; i++) {
        const size_t used = strlen(survey->listed);
        snprintf(survey->listed + used, sizeof survey->listed - used, "%s%s", i > 0 ? ", " : "",
                 status.body[i].name);
        int body = find_body(survey, status.body[i].name, true);
        if (body >= 0)
            survey->body[body].listed = true;
    }
    survey->status_come = true;
    survey->rate_hz = status.rate_hz > 0.0 ? status.rate_hz : 0.0;
    pliant_status_t_decode_cleanup(&status);
}

// Takes the lines "tool 4: static, ..." of a description.
static void take_description(Survey *survey, const char *text)
{
    if (!survey->fixed)
        survey->tool_count = 0;
    // The lines of tools, among all others.
    for (const char *line = text; line; line = strchr(line, '\n')) {
        char kind[16] = "";
        int id;
        line += *line == '\n';
        if (sscanf(line, "tool %d: %15[a-z]", &id, kind) != 2)
            continue;
        int at = add_tool(survey, id);
        if (at >= 0)
            survey->tool[at].is_static = strcmp(kind, "static") == 0;
    }
    // The text goes into the file.
    free(survey->described);
    survey->described = strdup(text);
    if (!survey->described)
        abort();
}

void survey_take_reply(Survey *survey, const void *data, size_t size)
{
    pliant_reply_t reply;
    if (!wire_check(&WIRE_REPLY, data, size) ||
        pliant_reply_t_decode(data, 0, (int)size, &reply) < 0) {
        survey->refused++;
        return;
    }
    // Any client may have requested it: the daemon's answer counts.
    if (reply.ok && !survey->described && strncmp(reply.text, "scene ", 6) == 0 &&
        strstr(reply.text, "\nunits: "))
        take_description(survey, reply.text);
    pliant_reply_t_decode_cleanup(&reply);
}

void survey_take_mesh(Survey *survey, int body, const void *data, size_t size)
{
    pliant_mesh_t mesh;
    SurveyBody *to = &survey->body[body];
    if (to->nodes > 0 || !wire_check(&WIRE_MESH, data, size) ||
        pliant_mesh_t_decode(data, 0, (int)size, &mesh) < 0)
        return;
    // Sizes that a mesh of ours can have.
    if (mesh.node_count >= 1 && mesh.node_count <= FRAMES_NODES_MAX && mesh.triangle_count >= 0 &&
        mesh.triangle_count <= FRAMES_TRIANGLES_MAX) {
        to->nodes = mesh.node_count;
        to->triangles = mesh.triangle_count > 0 ? mesh.triangle_count : 1;
    }
    pliant_mesh_t_decode_cleanup(&mesh);
}

// --- state ---

bool survey_records(const Survey *survey, int body)
{
    const SurveyBody *of = &survey->body[body];
    return (of->listed || (!survey->status_come && of->seen)) && of->nodes > 0;
}

bool survey_ready(const Survey *survey, bool patient)
{
    int ready = 0;
    for (int i = 0; i < survey->body_count; i++) {
        const SurveyBody *body = &survey->body[i];
        // A body without a mesh cannot begin.
        bool there = body->listed || (!survey->status_come && body->seen);
        if (there && body->nodes == 0)
            return false;
        ready += there;
    }
    bool all = survey->wanted_count == 0 ? ready > 0 : ready == survey->wanted_count;
    return all && (!patient || (survey->status_come && survey->described));
}

const char *survey_missing(const Survey *survey)
{
    for (int i = 0; i < survey->wanted_count && survey->status_come; i++) {
        // Only a status tells which bodies there are.
        bool listed = false;
        for (int k = 0; k < survey->body_count; k++)
            listed |=
                survey->body[k].listed && strcmp(survey->body[k].name, survey->wanted[i]) == 0;
        if (!listed)
            return survey->wanted[i];
    }
    return NULL;
}
