// SPDX-License-Identifier: MIT
// Recordings of the parts of a session on one timeline. One thread.
#include "timeline.h"

#include "base/check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BODIES = RECORDING_INFO_BODIES, TOOLS = RECORDING_INFO_TOOLS, GAP_SAMPLES = 512 };

// Frames are at least a tenth of a millisecond apart; a time that was summed differs by less.
static const double SAME_S = 1e-7;

typedef struct Part {
    RecordingReader *reader;
    double first, last; // of its frames, its own time [s]
    double offset;      // from its own time to the timeline's
    double begin;       // on the timeline; it lasts until the next part begins
    int body[BODIES];   // its index of the timeline's body; -1: it has none
    int tool[TOOLS];    // likewise
    double gap[TOOLS];  // a tool without a row for longer was withdrawn [s]
} Part;

// Where the lines of a ledger, or of errors, are.
typedef struct TimelineLedger {
    double time; // [s]
    int part, count;
    int64_t first;
} TimelineLedger;

typedef struct TimelineLines {
    TimelineLedger *at; // [count], times rise
    int count;
} TimelineLines;

// Most lines that belong together.
static const int LINES_MOST[RECORDING_LISTS] = {LEDGER_LINES, ERRORS_LINES};

struct Timeline {
    Part part[TIMELINE_PARTS];
    int parts;
    char body[BODIES][RECORDING_BODY_TEXT];
    int bodies;
    int tool[TOOLS]; // ids
    int tools;
    double end, frame_time;
    TimelineEvent *event;
    int events;
    int64_t left_out;
    TimelineLines lines[RECORDING_LISTS];
};

// --- opening -------------------------------------------------------------------------------------

static bool add_body(Timeline *timeline, const char *name, const char *path, Status *status)
{
    for (int i = 0; i < timeline->bodies; i++)
        if (strcmp(timeline->body[i], name) == 0)
            return true;
    // The name becomes a part of channels.
    if (*name == '\0' || strspn(name, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                      "0123456789_-") != strlen(name))
        return status_fail(status, STATUS_INVALID, "%s: a body has a name that no scene allows",
                           path);
    if (timeline->bodies == BODIES)
        return status_fail(status, STATUS_INVALID, "%s: with it there are more than %d bodies",
                           path, BODIES);
    memcpy(timeline->body[timeline->bodies++], name, RECORDING_BODY_TEXT);
    return true;
}

static bool add_tool(Timeline *timeline, const char *name, const char *path, Status *status)
{
    char *end;
    long id = strtol(name, &end, 10);
    if (*name == '\0' || *end != '\0' || id < 0 || id > INT32_MAX)
        return status_fail(status, STATUS_INVALID, "%s: tool \"%s\" is no number", path, name);
    for (int i = 0; i < timeline->tools; i++)
        if (timeline->tool[i] == (int)id)
            return true;
    if (timeline->tools == TOOLS)
        return status_fail(status, STATUS_INVALID, "%s: with it there are more than %d tools", path,
                           TOOLS);
    timeline->tool[timeline->tools++] = (int)id;
    return true;
}

// Finds the times of a part's frames; false if it has none.
static bool measure_part(Part *part)
{
    const RecordingInfo *info = recording_reader_info(part->reader);
    part->first = HUGE_VAL;
    part->last = -HUGE_VAL;
    for (int i = 0; i < info->body_count; i++) {
        int64_t frames = recording_reader_frames(part->reader, i);
        if (frames == 0)
            continue;
        part->first = fmin(part->first, recording_reader_frame(part->reader, i, 0).time);
        part->last = fmax(part->last, recording_reader_frame(part->reader, i, frames - 1).time);
    }
    return part->first <= part->last;
}

static bool open_part(Timeline *timeline, const char *path, Status *status)
{
    Part *part = &timeline->part[timeline->parts];
    *part = (Part){.reader = recording_reader_open(path, status)};
    if (part->reader == NULL)
        return false;
    timeline->parts++;
    if (!measure_part(part))
        return status_fail(status, STATUS_INVALID, "%s: has no frames", path);
    // Its bodies and tools join those of the other parts.
    const RecordingInfo *info = recording_reader_info(part->reader);
    bool ok = true;
    for (int i = 0; i < info->body_count && ok; i++)
        ok = recording_reader_frames(part->reader, i) == 0 ||
             add_body(timeline, info->body[i].name, path, status);
    for (int i = 0; i < info->tool_count && ok; i++)
        ok = add_tool(timeline, info->tool[i].name, path, status);
    return ok;
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Returns the time after which a tool without a row was withdrawn: while it is active, rows come
// regularly.
static double find_gap(const RecordingReader *reader, int tool)
{
    double between[GAP_SAMPLES];
    const int64_t rows = recording_reader_tool_rows(reader, tool);
    int count = 0;
    const int64_t stride = rows / GAP_SAMPLES + 1;
    for (int64_t i = 1; i < rows && count < GAP_SAMPLES; i += stride)
        between[count++] = recording_reader_tool_time(reader, tool, i) -
                           recording_reader_tool_time(reader, tool, i - 1);
    if (count == 0)
        return 0.1;
    qsort(between, (size_t)count, sizeof *between, by_value);
    return 2.5 * between[count / 2] + SAME_S;
}

// Places a part behind the one before it.
static void place_part(Timeline *timeline, int index)
{
    Part *part = &timeline->part[index];
    if (index > 0) {
        const Part *before = part - 1;
        const bool continues = part->first > before->first;
        part->offset = continues
                           ? before->offset
                           : before->last + before->offset + timeline->frame_time - part->first;
    }
    part->begin = part->first + part->offset;
    for (int b = 0; b < timeline->bodies; b++)
        part->body[b] = recording_reader_find_body(part->reader, timeline->body[b]);
    for (int t = 0; t < timeline->tools; t++) {
        part->tool[t] = recording_reader_find_tool(part->reader, timeline->tool[t]);
        part->gap[t] = part->tool[t] >= 0 ? find_gap(part->reader, part->tool[t]) : 0.0;
    }
}

static double mean_frame_time(const Timeline *timeline)
{
    double shortest = HUGE_VAL;
    for (int p = 0; p < timeline->parts; p++) {
        const RecordingReader *reader = timeline->part[p].reader;
        for (int i = 0; i < recording_reader_info(reader)->body_count; i++) {
            const int64_t frames = recording_reader_frames(reader, i);
            if (frames < 2)
                continue;
            const double time = recording_reader_frame(reader, i, frames - 1).time -
                                recording_reader_frame(reader, i, 0).time;
            shortest = fmin(shortest, time / (double)(frames - 1));
        }
    }
    return isfinite(shortest) && shortest > 0.0 ? shortest : 1.0 / 60.0;
}

// Time on the timeline until which a part is shown.
static double part_end(const Timeline *timeline, int part)
{
    return part + 1 < timeline->parts ? timeline->part[part + 1].begin : HUGE_VAL;
}

static int by_time(const void *a, const void *b)
{
    const TimelineEvent *x = a, *y = b;
    return (x->time > y->time) - (x->time < y->time);
}

static bool read_events(Timeline *timeline, Status *status)
{
    enum { BLOCK = 256 };
    RecordingEvent block[BLOCK];
    timeline->event = calloc(TIMELINE_EVENTS, sizeof *timeline->event);
    ASSERT(timeline->event != NULL);
    for (int p = 0; p < timeline->parts; p++) {
        const Part *part = &timeline->part[p];
        const int64_t count = recording_reader_info(part->reader)->events;
        for (int64_t first = 0; first < count; first += BLOCK) {
            int rows = (int)(count - first < BLOCK ? count - first : BLOCK);
            if (timeline->events == TIMELINE_EVENTS) {
                timeline->left_out += rows;
                continue;
            }
            if (!recording_reader_events(part->reader, first, rows, block, status))
                return false;
            // What another part replaces did not happen in this session.
            for (int i = 0; i < rows; i++) {
                const double time = block[i].time + part->offset;
                if (time >= part_end(timeline, p))
                    continue;
                if (timeline->events == TIMELINE_EVENTS)
                    timeline->left_out++;
                else
                    timeline->event[timeline->events++] = (TimelineEvent){time, block[i]};
            }
        }
    }
    qsort(timeline->event, (size_t)timeline->events, sizeof *timeline->event, by_time);
    return true;
}

// Adds line `row` of a part; `before`: the one before it. A ledger begins with its bodies, as
// errors do; those of another step are others.
static void add_line(Timeline *timeline, int list, int p, int64_t row, const RecordingLedger *line,
                     const RecordingLedger *before)
{
    const double time = line->time + timeline->part[p].offset;
    TimelineLines *lines = &timeline->lines[list];
    TimelineLedger *last = lines->count > 0 ? &lines->at[lines->count - 1] : NULL;
    if (line->line != LEDGER_BODY || (before->line == LEDGER_BODY && before->step == line->step)) {
        if (last != NULL && last->part == p && last->first + last->count == row)
            last->count += last->count < LINES_MOST[list];
        return;
    }
    if (lines->count == TIMELINE_LEDGERS || !(time < part_end(timeline, p)) ||
        (last != NULL && time < last->time))
        return;
    lines->at[lines->count++] = (TimelineLedger){.time = time, .part = p, .count = 1, .first = row};
}

static int64_t lines_of(const Timeline *timeline, int list, int p)
{
    return recording_reader_info(timeline->part[p].reader)->lines[list];
}

static bool read_lines(Timeline *timeline, int list, Status *status)
{
    enum { BLOCK = 256 };
    RecordingLedger block[BLOCK];
    int64_t most = 0;
    for (int p = 0; p < timeline->parts; p++)
        most += lines_of(timeline, list, p);
    most = most < TIMELINE_LEDGERS ? most : TIMELINE_LEDGERS;
    timeline->lines[list].at = calloc((size_t)most + 1, sizeof *timeline->lines[list].at);
    ASSERT(timeline->lines[list].at != NULL);
    for (int p = 0; p < timeline->parts; p++) {
        const int64_t count = lines_of(timeline, list, p);
        RecordingLedger before = {.line = LEDGER_REGION};
        for (int64_t first = 0; first < count; first += BLOCK) {
            const int rows = (int)(count - first < BLOCK ? count - first : BLOCK);
            if (!recording_reader_lines(timeline->part[p].reader, list, first, rows, block, status))
                return false;
            for (int i = 0; i < rows; i++) {
                add_line(timeline, list, p, first + i, &block[i], &before);
                before = block[i];
            }
        }
    }
    return true;
}

Timeline *timeline_open(char *const *path, int count, Status *status)
{
    Timeline *timeline = calloc(1, sizeof *timeline);
    ASSERT(timeline != NULL);
    bool ok =
        count <= TIMELINE_PARTS ||
        status_fail(status, STATUS_INVALID, "%d recordings: at most %d", count, TIMELINE_PARTS);
    for (int i = 0; i < count && ok; i++)
        ok = open_part(timeline, path[i], status);
    if (ok) {
        timeline->frame_time = mean_frame_time(timeline);
        for (int i = 0; i < timeline->parts; i++)
            place_part(timeline, i);
        // The end is that of the part that is shown last.
        const Part *last = &timeline->part[timeline->parts - 1];
        timeline->end = last->last + last->offset;
        ok = read_events(timeline, status);
        for (int list = 0; list < RECORDING_LISTS && ok; list++)
            ok = read_lines(timeline, list, status);
    }
    if (ok)
        return timeline;
    timeline_close(timeline);
    return NULL;
}

void timeline_close(Timeline *timeline)
{
    if (timeline == NULL)
        return;
    for (int i = 0; i < timeline->parts; i++)
        recording_reader_close(timeline->part[i].reader);
    free(timeline->event);
    for (int list = 0; list < RECORDING_LISTS; list++)
        free(timeline->lines[list].at);
    free(timeline);
}

double timeline_start(const Timeline *timeline)
{
    return timeline->part[0].begin;
}

double timeline_end(const Timeline *timeline)
{
    return timeline->end;
}

double timeline_frame_time(const Timeline *timeline)
{
    return timeline->frame_time;
}

int timeline_parts(const Timeline *timeline)
{
    return timeline->parts;
}

const char *timeline_describe(const Timeline *timeline)
{
    return recording_reader_describe(timeline->part[0].reader);
}

TimelinePart timeline_part(const Timeline *timeline, int part)
{
    ASSERT(part >= 0 && part < timeline->parts);
    const Part *of = &timeline->part[part];
    return (TimelinePart){.reader = of->reader,
                          .offset = of->offset,
                          .begin = of->begin,
                          .end = part_end(timeline, part)};
}

int timeline_bodies(const Timeline *timeline)
{
    return timeline->bodies;
}

const char *timeline_body(const Timeline *timeline, int body)
{
    return timeline->body[body];
}

void timeline_most(const Timeline *timeline, int body, int *nodes, int *triangles)
{
    *nodes = *triangles = 0;
    for (int p = 0; p < timeline->parts; p++) {
        const Part *part = &timeline->part[p];
        int n = 0, t = 0;
        if (part->body[body] >= 0)
            recording_reader_most(part->reader, part->body[body], &n, &t);
        *nodes = n > *nodes ? n : *nodes;
        *triangles = t > *triangles ? t : *triangles;
    }
}

// --- frames --------------------------------------------------------------------------------------

// The part that is shown at a time.
static int part_at(const Timeline *timeline, double time)
{
    int part = timeline->parts - 1;
    while (part > 0 && timeline->part[part].begin > time + SAME_S)
        part--;
    return part;
}

TimelineFrame timeline_find(const Timeline *timeline, int body, double time)
{
    // A body that this part does not have yet is as the part before left it.
    for (int p = part_at(timeline, time); p >= 0; p--) {
        const Part *part = &timeline->part[p];
        const double until = fmin(time, part_end(timeline, p) - 2.0 * SAME_S);
        const int index = part->body[body];
        const int64_t frame =
            index < 0
                ? -1
                : recording_reader_find_frame(part->reader, index, until + SAME_S - part->offset);
        if (frame >= 0)
            return (TimelineFrame){p, frame};
    }
    return (TimelineFrame){0, -1};
}

static double time_of(const Timeline *timeline, int part, int body, int64_t frame)
{
    const Part *of = &timeline->part[part];
    return recording_reader_frame(of->reader, of->body[body], frame).time + of->offset;
}

bool timeline_next(const Timeline *timeline, double time, double *next)
{
    *next = HUGE_VAL;
    for (int b = 0; b < timeline->bodies; b++) {
        // In this part the frame after that, else the first one of the next part.
        for (int p = part_at(timeline, time); p < timeline->parts; p++) {
            const Part *part = &timeline->part[p];
            if (part->body[b] < 0)
                continue;
            const int64_t after = 1 + recording_reader_find_frame(part->reader, part->body[b],
                                                                  time + SAME_S - part->offset);
            if (after >= recording_reader_frames(part->reader, part->body[b]))
                continue;
            const double found = time_of(timeline, p, b, after);
            if (found >= part_end(timeline, p) - SAME_S)
                continue;
            *next = fmin(*next, found);
            break;
        }
    }
    return isfinite(*next);
}

// The time of the newest frame of any body at or before a time; -HUGE_VAL: none.
static double newest(const Timeline *timeline, double time)
{
    double found = -HUGE_VAL;
    for (int b = 0; b < timeline->bodies; b++) {
        const TimelineFrame at = timeline_find(timeline, b, time);
        if (at.frame >= 0)
            found = fmax(found, time_of(timeline, at.part, b, at.frame));
    }
    return found;
}

bool timeline_previous(const Timeline *timeline, double time, double *previous)
{
    const double shown = newest(timeline, time);
    *previous = isfinite(shown) ? newest(timeline, shown - 2.0 * SAME_S) : shown;
    return isfinite(*previous);
}

// Each part has its own numbers of topologies: they are interleaved, so that all differ, and those
// of a single recording stay as they were.
static int topology_number(const Timeline *timeline, int part, int number)
{
    return timeline->parts == 1
               ? number
               : (int)((uint32_t)number * (uint32_t)timeline->parts + (uint32_t)part);
}

RecordingFrame timeline_frame(const Timeline *timeline, const TimelineFrame *at, int body)
{
    const Part *part = &timeline->part[at->part];
    RecordingFrame frame = recording_reader_frame(part->reader, part->body[body], at->frame);
    frame.topology = topology_number(timeline, at->part, frame.topology);
    return frame;
}

bool timeline_positions(Timeline *timeline, const TimelineFrame *at, int body, float *position,
                        Status *status)
{
    const Part *part = &timeline->part[at->part];
    return recording_reader_positions(part->reader, part->body[body], at->frame, position, status);
}

bool timeline_mesh(Timeline *timeline, const TimelineFrame *at, int body, int *node_id,
                   int (*triangle)[3], RecordingTopology *topology, Status *status)
{
    const Part *part = &timeline->part[at->part];
    if (!recording_reader_mesh(part->reader, part->body[body], at->frame, node_id, triangle,
                               topology, status))
        return false;
    topology->number = topology_number(timeline, at->part, topology->number);
    return true;
}

bool timeline_nodes(Timeline *timeline, const TimelineFrame *at, int body, const MeshColumns *to,
                    bool *known, Status *status)
{
    const Part *part = &timeline->part[at->part];
    return recording_reader_nodes(part->reader, part->body[body], at->frame, to, known, status);
}

int timeline_first_wall(const Timeline *timeline, const TimelineFrame *at, int body)
{
    const Part *part = &timeline->part[at->part];
    return recording_reader_first_wall(part->reader, part->body[body]);
}

int64_t timeline_look_rows(const Timeline *timeline, const TimelineFrame *at, int body)
{
    const Part *part = &timeline->part[at->part];
    return recording_reader_look_rows(part->reader, part->body[body]);
}

bool timeline_look(Timeline *timeline, const TimelineFrame *at, int body, int64_t first, int rows,
                   int *topology, int *id, unsigned char (*colour)[RECORDING_COLOURS],
                   Status *status)
{
    const Part *part = &timeline->part[at->part];
    return recording_reader_look(part->reader, part->body[body], first, rows, topology, id, colour,
                                 status);
}

int64_t timeline_find_map(const Timeline *timeline, const TimelineFrame *at, int body,
                          RecordingMapKind kind, RecordingMap *map)
{
    const Part *part = &timeline->part[at->part];
    const int index = part->body[body];
    const RecordingFrame frame = recording_reader_frame(part->reader, index, at->frame);
    int64_t found = recording_reader_find_map(part->reader, index, kind, frame.time + SAME_S);
    const int64_t next = found + 1;
    if ((found < 0 ||
         recording_reader_map(part->reader, index, kind, found).topology != frame.topology) &&
        next < recording_reader_maps(part->reader, index, kind) &&
        recording_reader_map(part->reader, index, kind, next).topology == frame.topology)
        found = next;
    if (found < 0)
        return -1;
    *map = recording_reader_map(part->reader, index, kind, found);
    map->topology = topology_number(timeline, at->part, map->topology);
    return found;
}

bool timeline_map_rows(Timeline *timeline, const TimelineFrame *at, int body, RecordingMapKind kind,
                       int64_t map, void *const column[], Status *status)
{
    const Part *part = &timeline->part[at->part];
    return recording_reader_map_rows(part->reader, part->body[body], kind, map, column, status);
}

// --- tools and events ----------------------------------------------------------------------------

int timeline_tools(const Timeline *timeline)
{
    return timeline->tools;
}

int timeline_tool_id(const Timeline *timeline, int tool)
{
    return timeline->tool[tool];
}

static bool is_known(const double *value, int count)
{
    for (int i = 0; i < count; i++)
        if (!isfinite(value[i]))
            return false;
    return true;
}

// Replaces what was not recorded, and what no tool can be.
static void tidy_sample(RecordingTool *sample)
{
    const Quat q = sample->orientation;
    const double length = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    if (!is_known(&sample->force.x, 3))
        sample->force = (Vec3){0.0, 0.0, 0.0};
    if (!(fabs(length - 1.0) < 1e-3))
        sample->orientation = QUAT_NONE;
}

bool timeline_tool(Timeline *timeline, int tool, double time, RecordingTool *sample, bool *active,
                   Status *status)
{
    const int p = part_at(timeline, time);
    const Part *part = &timeline->part[p];
    *active = false;
    if (part->tool[tool] < 0)
        return true;
    const double own = time + SAME_S - part->offset;
    const int64_t row = recording_reader_find_tool_row(part->reader, part->tool[tool], own);
    if (row < 0 || own - recording_reader_tool_time(part->reader, part->tool[tool], row) >
                       part->gap[tool] + SAME_S)
        return true;
    if (!recording_reader_tool(part->reader, part->tool[tool], row, 1, sample, status))
        return false;
    tidy_sample(sample);
    *active = is_known(&sample->position.x, 3);
    return true;
}

bool timeline_forces(Timeline *timeline, int tool, int parts, float *force, Status *status)
{
    RecordingTool *sample = calloc(RECORDING_ROWS_MOST, sizeof *sample);
    ASSERT(sample != NULL);
    const double start = timeline_start(timeline);
    const double scale = parts / fmax(timeline->end - start, SAME_S);
    bool ok = true;
    memset(force, 0, (size_t)parts * sizeof *force);
    for (int p = 0; p < timeline->parts && ok; p++) {
        const Part *part = &timeline->part[p];
        const int index = part->tool[tool];
        const int64_t rows = index < 0 ? 0 : recording_reader_tool_rows(part->reader, index);
        for (int64_t first = 0; first < rows && ok; first += RECORDING_ROWS_MOST) {
            const int count =
                (int)(rows - first < RECORDING_ROWS_MOST ? rows - first : RECORDING_ROWS_MOST);
            ok = recording_reader_tool(part->reader, index, first, count, sample, status);
            for (int i = 0; i < count && ok; i++) {
                const double time =
                    recording_reader_tool_time(part->reader, index, first + i) + part->offset;
                const Vec3 f = sample[i].force;
                const float size = (float)sqrt(f.x * f.x + f.y * f.y + f.z * f.z);
                if (!isfinite(size) || time < part->begin || time >= part_end(timeline, p))
                    continue;
                const double at = (time - start) * scale;
                const int bucket = at < parts ? (int)at : parts - 1;
                force[bucket] = fmaxf(force[bucket], size);
            }
        }
    }
    free(sample);
    return ok;
}

const TimelineEvent *timeline_events(const Timeline *timeline, int *count, int64_t *left_out)
{
    *count = timeline->events;
    *left_out = timeline->left_out;
    return timeline->event;
}

int timeline_find_lines(const Timeline *timeline, RecordingList list, double time)
{
    const TimelineLines *lines = &timeline->lines[list];
    int below = -1, above = lines->count;
    while (above - below > 1) {
        const int middle = below + (above - below) / 2;
        if (lines->at[middle].time <= time + SAME_S)
            below = middle;
        else
            above = middle;
    }
    return below + 1;
}

bool timeline_lines(Timeline *timeline, RecordingList list, int number, RecordingLedger *line,
                    int *count, Status *status)
{
    const TimelineLines *lines = &timeline->lines[list];
    ASSERT(number > 0 && number <= lines->count);
    const TimelineLedger *at = &lines->at[number - 1];
    *count = at->count;
    return recording_reader_lines(timeline->part[at->part].reader, list, at->first, at->count, line,
                                  status);
}
