// SPDX-License-Identifier: MIT
// The JSON messages of protocol.md, and the tools in the daemon's description. Any thread.
#include "texts.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// --- tools ---------------------------------------------------------------------------------------

enum { LINE_BYTES = 512 };

static bool all_finite(const double *number, int count)
{
    for (int k = 0; k < count; k++) {
        if (!isfinite(number[k]))
            return false;
    }
    return true;
}

// Reads "tool 1: probe, 1 capsules, max_force 5 N".
static bool read_tool(const char *line, DescribedTool *tool)
{
    *tool = (DescribedTool){0};
    if (sscanf(line, "tool %d: %15[a-z]", &tool->id, tool->kind) != 2)
        return false;
    sscanf(line, "tool %*d: remover, by %15[a-z]", tool->removes);
    const char *force = strstr(line, "max_force ");
    tool->has_force = force && sscanf(force, "max_force %lf N", &tool->max_force) == 1 &&
                      isfinite(tool->max_force);
    return true;
}

static bool read_capsule(const char *line, const char *name, DescribedCapsule *c)
{
    line += strspn(line, " ");
    const size_t length = strlen(name);
    return strncmp(line, name, length) == 0 &&
           sscanf(line + length, " [%lf, %lf, %lf] to [%lf, %lf, %lf], radius %lf m", &c->from[0],
                  &c->from[1], &c->from[2], &c->to[0], &c->to[1], &c->to[2], &c->radius) == 7 &&
           all_finite(c->from, 3) && all_finite(c->to, 3) && isfinite(c->radius);
}

// Reads an indented line below a tool's.
static void read_part(const char *line, DescribedTool *tool)
{
    DescribedCapsule c;
    if (read_capsule(line, "capsule", &c)) {
        if (tool->capsules < DESCRIBE_CAPSULES)
            tool->capsule[tool->capsules++] = c;
        return;
    }
    if (read_capsule(line, "mouth", &c)) {
        tool->mouth = c;
        tool->has_mouth = true;
    }
    // An edge, or a plane: at most one of the two matches.
    double n[6];
    if (sscanf(line, " edge [%lf, %lf, %lf] to [%lf, %lf, %lf] m", &n[0], &n[1], &n[2], &n[3],
               &n[4], &n[5]) == 6 &&
        all_finite(n, 6)) {
        memcpy(tool->edge, n, sizeof tool->edge);
        tool->has_edge = true;
    }
    if (sscanf(line, " plane [%lf, %lf, %lf] m, normal [%lf, %lf, %lf]", &n[0], &n[1], &n[2], &n[3],
               &n[4], &n[5]) == 6 &&
        all_finite(n, 6)) {
        memcpy(tool->point, n, sizeof tool->point);
        memcpy(tool->normal, n + 3, sizeof tool->normal);
        tool->has_plane = true;
    }
}

int describe_tools(const char *text, DescribedTool tool[DESCRIBE_TOOLS])
{
    int count = 0;
    bool within = false; // inside the lines of the newest tool
    // Line by line, cut to what a line of ours can have.
    while (*text) {
        size_t length = strcspn(text, "\n");
        char line[LINE_BYTES];
        size_t kept = length < sizeof line ? length : sizeof line - 1;
        memcpy(line, text, kept);
        line[kept] = '\0';
        text += length + (text[length] == '\n');
        // Indented lines describe the tool before them.
        if (line[0] == ' ') {
            if (within)
                read_part(line, &tool[count - 1]);
            continue;
        }
        within = count < DESCRIBE_TOOLS && read_tool(line, &tool[count]);
        count += within;
    }
    return count;
}

// --- messages ------------------------------------------------------------------------------------

// Makes text from the network a JSON string; invalid UTF-8 becomes '?'.
static json_t *string(const char *text)
{
    json_t *value = json_string(text);
    if (value)
        return value;
    char *plain = strdup(text);
    for (char *c = plain; c && *c; c++)
        *c = (unsigned char)*c < 0x80 ? *c : '?';
    value = json_string(plain ? plain : "");
    free(plain);
    return value;
}

static json_t *numbers(const double *number, int count)
{
    json_t *array = json_array();
    for (int k = 0; k < count; k++)
        json_array_append_new(array, json_real(number[k]));
    return array;
}

static void put(json_t *object, const char *name, json_t *value)
{
    json_object_set_new(object, name, value);
}

static void put_numbers(json_t *object, const char *name, const double *number, int count)
{
    put(object, name, numbers(number, count));
}

static json_t *message(const char *type)
{
    json_t *object = json_object();
    put(object, "type", json_string(type));
    return object;
}

static Parcel *finish(json_t *object)
{
    // Twelve digits: positions to a picometre, in half the bytes of seventeen.
    char *text = json_dumps(object, JSON_COMPACT | JSON_REAL_PRECISION(12));
    if (!text)
        abort(); // out of memory
    Parcel *parcel = parcel_text(text);
    free(text);
    json_decref(object);
    return parcel;
}

Parcel *text_hello(const HelloText *hello)
{
    json_t *object = message("hello"), *names = json_array();
    put(object, "version", json_integer(1));
    put(object, "prefix", string(hello->prefix));
    put(object, "read_only", json_boolean(hello->read_only));
    put(object, "rate_hz", json_real(hello->rate_hz));
    for (int k = 0; k < hello->textures; k++)
        json_array_append_new(names, string(hello->texture[k]));
    put(object, "textures", names);
    return finish(object);
}

static json_t *capsule_object(const DescribedCapsule *capsule)
{
    json_t *object = json_object();
    put_numbers(object, "from", capsule->from, 3);
    put_numbers(object, "to", capsule->to, 3);
    put(object, "radius", json_real(capsule->radius));
    return object;
}

static json_t *tool_object(const DescribedTool *tool)
{
    // Who it is,
    json_t *object = json_object();
    put(object, "id", json_integer(tool->id));
    put(object, "kind", json_string(tool->kind));
    if (tool->has_force)
        put(object, "max_force", json_real(tool->max_force));
    // its shape, in the form of a scene,
    if (tool->capsules) {
        json_t *capsules = json_array();
        for (int k = 0; k < tool->capsules; k++)
            json_array_append_new(capsules, capsule_object(&tool->capsule[k]));
        put(object, "capsules", capsules);
    }
    // and what only some tools have.
    if (tool->has_edge) {
        json_t *edge = json_array();
        json_array_append_new(edge, numbers(tool->edge[0], 3));
        json_array_append_new(edge, numbers(tool->edge[1], 3));
        put(object, "edge", edge);
    }
    if (tool->removes[0])
        put(object, "removes_by", json_string(tool->removes));
    if (tool->has_mouth)
        put(object, "mouth", capsule_object(&tool->mouth));
    if (tool->has_plane) {
        json_t *plane = json_object();
        put_numbers(plane, "point", tool->point, 3);
        put_numbers(plane, "normal", tool->normal, 3);
        put(object, "plane", plane);
    }
    return object;
}

Parcel *text_scene(const pliant_status_t *status, const char *describe)
{
    json_t *object = message("scene"), *bodies = json_array(), *tools = json_array();
    DescribedTool tool[DESCRIBE_TOOLS];
    put(object, "name", string(status->scene));
    // What bodies there are, before their data arrive.
    for (int k = 0; k < status->num_bodies; k++) {
        json_t *body = json_object();
        put(body, "name", string(status->body[k].name));
        put(body, "model", string(status->body[k].model));
        json_array_append_new(bodies, body);
    }
    put(object, "bodies", bodies);
    // Tools as the daemon describes them.
    for (int k = 0, count = describe_tools(describe, tool); k < count; k++)
        json_array_append_new(tools, tool_object(&tool[k]));
    put(object, "tools", tools);
    put(object, "describe", string(describe));
    return finish(object);
}

Parcel *text_link(bool daemon, double age_s)
{
    json_t *object = message("link");
    put(object, "daemon", json_boolean(daemon));
    put(object, "age", json_real(age_s));
    return finish(object);
}

static json_t *body_status(const pliant_body_status_t *body)
{
    json_t *object = json_object();
    put(object, "name", string(body->name));
    put(object, "model", string(body->model));
    put(object, "integrator", string(body->integrator));
    put(object, "topology", json_integer(body->topology));
    put(object, "nodes", json_integer(body->nodes));
    put(object, "springs", json_integer(body->springs));
    put(object, "elements", json_integer(body->elements));
    put(object, "pieces", json_integer(body->pieces));
    put(object, "finest_level", json_integer(body->finest_level));
    put(object, "time_step", json_real(body->time_step));
    put(object, "kinetic", json_real(body->kinetic));
    put(object, "elastic", json_real(body->elastic));
    put(object, "mass", json_real(body->mass));
    put(object, "max_displacement", json_real(body->max_displacement));
    put(object, "estimated_error", json_real(body->estimated_error));
    return object;
}

Parcel *text_status(const pliant_status_t *status)
{
    json_t *object = message("status");
    json_t *bodies = json_array(), *reasons = json_object(), *stages = json_object();
    // Figures of the run,
    put(object, "utime", json_integer(status->utime));
    put(object, "sequence", json_integer(status->sequence));
    put(object, "scene", string(status->scene));
    put(object, "state", string(status->state));
    put(object, "step", json_integer(status->step));
    put(object, "time", json_real(status->time));
    put(object, "rate_hz", json_real(status->rate_hz));
    put(object, "real_time_factor", json_real(status->real_time_factor));
    put(object, "late_ticks", json_integer(status->late_ticks));
    put(object, "resets", json_integer(status->resets));
    put(object, "rejected", json_integer(status->rejected));
    put_numbers(object, "step_us", status->step_us, 4);
    put_numbers(object, "wake_us", status->wake_us, 4);
    // of each body, and by name.
    for (int k = 0; k < status->num_bodies; k++)
        json_array_append_new(bodies, body_status(&status->body[k]));
    put(object, "body", bodies);
    // jansson refuses names that are not UTF-8; they are omitted.
    for (int k = 0; k < status->num_reasons; k++)
        put(reasons, status->reason[k], json_integer(status->count[k]));
    put(object, "reasons", reasons);
    for (int k = 0; k < status->num_stages; k++)
        put(stages, status->stage[k], json_real(status->stage_us[k]));
    put(object, "stages", stages);
    return finish(object);
}

static json_t *ledger_body(const pliant_ledger_body_t *body)
{
    json_t *object = json_object();
    put(object, "name", string(body->name));
    put(object, "solid", json_boolean(body->solid));
    put(object, "cut", json_real(body->cut));
    put(object, "torn", json_real(body->torn));
    return object;
}

static json_t *ledger_tissue(const pliant_ledger_tissue_t *tissue)
{
    json_t *object = json_object();
    put(object, "body", string(tissue->body));
    put(object, "name", string(tissue->name));
    put(object, "density", json_real(tissue->density));
    put(object, "at_load", json_real(tissue->at_load));
    put(object, "attached", json_real(tissue->attached));
    put(object, "cut_off", json_real(tissue->cut_off));
    put(object, "removed", json_real(tissue->removed));
    put(object, "coagulated", json_real(tissue->coagulated));
    return object;
}

static json_t *ledger_region(const pliant_ledger_region_t *region)
{
    json_t *object = json_object();
    put(object, "name", string(region->name));
    put(object, "keep", json_boolean(region->keep));
    put(object, "touched", json_boolean(region->touched));
    put(object, "margin", json_real(region->margin));
    put(object, "distance", json_real(region->distance));
    put(object, "time", json_real(region->time));
    put(object, "body", string(region->body));
    put(object, "by", string(region->by));
    return object;
}

// Without utime and sequence, so that a repeat is the same text.
Parcel *text_ledger(const pliant_ledger_t *ledger)
{
    json_t *object = message("ledger");
    json_t *bodies = json_array(), *tissues = json_array(), *regions = json_array();
    put(object, "step", json_integer(ledger->step));
    put(object, "time", json_real(ledger->time));
    for (int k = 0; k < ledger->num_bodies; k++)
        json_array_append_new(bodies, ledger_body(&ledger->body[k]));
    for (int k = 0; k < ledger->num_tissues; k++)
        json_array_append_new(tissues, ledger_tissue(&ledger->tissue[k]));
    for (int k = 0; k < ledger->num_regions; k++)
        json_array_append_new(regions, ledger_region(&ledger->region[k]));
    put(object, "body", bodies);
    put(object, "tissue", tissues);
    put(object, "region", regions);
    return finish(object);
}

static json_t *error_body(const pliant_error_body_t *body)
{
    json_t *object = json_object();
    put(object, "name", string(body->name));
    put(object, "space", json_real(body->space));
    put(object, "steps", json_real(body->steps));
    put(object, "total", json_real(body->total));
    put(object, "relative", json_real(body->relative));
    put(object, "age", json_integer(body->age));
    return object;
}

static json_t *error_tool(const pliant_error_tool_t *tool)
{
    json_t *object = json_object();
    put(object, "tool", json_integer(tool->tool));
    put(object, "force", json_real(tool->force));
    put(object, "error", json_real(tool->error));
    put(object, "share", json_real(tool->share));
    return object;
}

// "error" says why a page's message was refused.
Parcel *text_errors(const pliant_error_t *error)
{
    json_t *object = message("errors");
    json_t *bodies = json_array(), *tools = json_array();
    put(object, "step", json_integer(error->step));
    put(object, "time", json_real(error->time));
    for (int k = 0; k < error->num_bodies; k++)
        json_array_append_new(bodies, error_body(&error->body[k]));
    for (int k = 0; k < error->num_tools; k++)
        json_array_append_new(tools, error_tool(&error->tool[k]));
    put(object, "body", bodies);
    put(object, "tool", tools);
    return finish(object);
}

Parcel *text_contacts(const pliant_contact_t *contact, int count)
{
    json_t *object = message("contact"), *tools = json_array();
    for (int k = 0; k < count; k++) {
        json_t *tool = json_object();
        put(tool, "tool", json_integer(contact[k].tool));
        put(tool, "contact", json_boolean(contact[k].contact));
        put_numbers(tool, "position", contact[k].position, 3);
        put_numbers(tool, "force", contact[k].force, 3);
        put_numbers(tool, "torque", contact[k].torque, 3);
        put_numbers(tool, "point", contact[k].point, 3);
        put_numbers(tool, "normal", contact[k].normal, 3);
        put(tool, "depth", json_real(contact[k].depth));
        put(tool, "pose_utime", json_integer(contact[k].pose_utime));
        put(tool, "utime", json_integer(contact[k].utime));
        json_array_append_new(tools, tool);
    }
    put(object, "tools", tools);
    return finish(object);
}

Parcel *text_poses(const pliant_tool_pose_t *pose, int count, int32_t ours)
{
    json_t *object = message("pose"), *tools = json_array();
    for (int k = 0; k < count; k++) {
        json_t *tool = json_object();
        put(tool, "tool", json_integer(pose[k].tool));
        put_numbers(tool, "position", pose[k].position, 3);
        put_numbers(tool, "orientation", pose[k].orientation, 4);
        put(tool, "grip", json_real(pose[k].grip));
        put(tool, "active", json_boolean(pose[k].active));
        put(tool, "ours", json_boolean(pose[k].sender == ours));
        json_array_append_new(tools, tool);
    }
    put(object, "tools", tools);
    return finish(object);
}

Parcel *text_event(const pliant_event_t *event)
{
    json_t *object = message("event");
    put(object, "body", string(event->body));
    put(object, "kind", string(event->kind));
    put(object, "text", string(event->text));
    put(object, "step", json_integer(event->step));
    put(object, "utime", json_integer(event->utime));
    return finish(object);
}

// The curve of one tool, in its own form.
static json_t *force_curve(const pliant_playback_t *playback, int tool)
{
    const int parts = playback->num_forces / playback->num_tools;
    json_t *object = json_object(), *force = json_array();
    put(object, "tool", json_integer(playback->tool[tool]));
    for (int k = 0; k < parts; k++)
        json_array_append_new(force, json_real((double)playback->force[tool * parts + k]));
    put(object, "force", force);
    return object;
}

Parcel *text_recording(const pliant_playback_t *playback)
{
    json_t *object = message("recording"), *marks = json_array(), *tools = json_array();
    put(object, "parts", json_integer(playback->parts));
    put(object, "start", json_real(playback->start));
    put(object, "end", json_real(playback->end));
    put(object, "frame_time", json_real(playback->frame_time));
    // What happened, and how hard each tool was pressed.
    for (int k = 0; k < playback->num_marks; k++) {
        json_t *mark = json_object();
        put(mark, "time", json_real(playback->mark_time[k]));
        put(mark, "kind", string(playback->mark_kind[k]));
        put(mark, "text", string(playback->mark_text[k]));
        json_array_append_new(marks, mark);
    }
    for (int k = 0; k < playback->num_tools; k++)
        json_array_append_new(tools, force_curve(playback, k));
    put(object, "marks", marks);
    put(object, "left_out", json_integer(playback->left_out));
    put(object, "tools", tools);
    return finish(object);
}

Parcel *text_playback(const pliant_playback_t *playback)
{
    json_t *object = message("playback");
    put(object, "playing", json_boolean(playback->playing));
    put(object, "loop", json_boolean(playback->loop));
    put(object, "from", json_real(playback->first));
    put(object, "to", json_real(playback->last));
    put(object, "time", json_real(playback->time));
    put(object, "speed", json_real(playback->speed));
    put(object, "step", json_integer(playback->step));
    return finish(object);
}

Parcel *text_reply(const pliant_reply_t *reply)
{
    json_t *object = message("reply");
    put(object, "id", json_integer(reply->id));
    put(object, "ok", json_boolean(reply->ok));
    put(object, "text", string(reply->text));
    put(object, "separated", json_integer(reply->separated));
    put(object, "nodes_added", json_integer(reply->nodes_added));
    put(object, "pieces", json_integer(reply->pieces));
    put(object, "step", json_integer(reply->step));
    return finish(object);
}

Parcel *text_error(int32_t id, const char *text)
{
    json_t *object = message("error");
    if (id > 0)
        put(object, "id", json_integer(id));
    put(object, "text", string(text));
    return finish(object);
}

Parcel *text_round(int64_t round)
{
    json_t *object = message("round");
    put(object, "round", json_integer(round));
    return finish(object);
}

static json_t *files(const FolderList *list)
{
    json_t *array = json_array();
    for (int k = 0; k < list->count; k++) {
        json_t *file = json_object();
        put(file, "name", string(list->file[k].name));
        put(file, "bytes", json_integer(list->file[k].bytes));
        if (list->file[k].about[0])
            put(file, "about", string(list->file[k].about));
        json_array_append_new(array, file);
    }
    return array;
}

static json_t *program(const WorkbenchRun *run)
{
    json_t *object = json_object();
    const char *state = run->runs && run->asked ? "ending"
                        : run->runs             ? "running"
                        : !run->over            ? "none"
                        : run->failed           ? "failed"
                                                : "ended";
    put(object, "state", json_string(state));
    put(object, "file", string(run->file));
    put(object, "how", string(run->how));
    // What it prints while it runs well belongs to its log.
    put(object, "text", string(run->over ? run->text : ""));
    return object;
}

// Puts what pliant-prepare has found out about a mesh, and its report; where there is none, all
// that it said.
static void put_found(json_t *prepare, const char *check)
{
    // Its object is a line, perhaps behind one about the time that it takes.
    json_t *text = string(check); // valid UTF-8
    const char *line = json_string_value(text);
    while (line && *line && *line != '{')
        line = strchr(line, '\n') ? strchr(line, '\n') + 1 : "";
    json_t *found = line ? json_loads(line, JSON_DISABLE_EOF_CHECK, NULL) : NULL;
    json_t *report = json_object_get(found, "report");
    put(prepare, "check", json_incref(report ? report : text));
    json_object_del(found, "report");
    put(prepare, "found", found ? found : json_null());
    json_decref(text);
}

Parcel *text_workbench(const WorkbenchText *workbench)
{
    static const char *const folders[] = {"scenes", "uploads", "recordings"};
    const FolderList *lists[] = {workbench->scenes, workbench->uploaded, workbench->meshes,
                                 workbench->recordings};
    json_t *object = message("workbench"), *daemon = program(&workbench->daemon);
    json_t *prepare = program(&workbench->prepare);
    int more = 0;
    for (size_t k = 0; k < sizeof lists / sizeof *lists; k++)
        more += lists[k]->more;
    // The files,
    put(object, "scenes", files(workbench->scenes));
    put(object, "uploads", files(workbench->uploaded));
    put(object, "meshes", files(workbench->meshes));
    put(object, "recordings", files(workbench->recordings));
    put(object, "more", json_integer(more));
    put(object, "plays", json_boolean(workbench->plays));
    put(object, "foreign", json_boolean(workbench->foreign));
    put(object, "upload_bytes", json_integer(workbench->upload_bytes));
    // and what runs with them.
    put(daemon, "folder", json_string(folders[workbench->folder]));
    put(object, "daemon", daemon);
    put(object, "recorder", program(&workbench->recorder));
    put_found(prepare, workbench->check);
    put(prepare, "scene", string(workbench->scene));
    put(prepare, "scene_text", string(workbench->scene_text));
    put(object, "prepare", prepare);
    return finish(object);
}
