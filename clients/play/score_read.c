// SPDX-License-Identifier: MIT
// From the recordings of a session to its score.
#include "score_parts.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

static const double SAME_S = 1e-7; // times that differ by less are the same

void *score_allocate(int64_t count, size_t size)
{
    void *memory = calloc((size_t)count + 1, size);
    ASSERT(memory != NULL);
    return memory;
}

static bool is_in(const TimelinePart *part, double time)
{
    return time >= part->begin && time < part->end;
}

// --- tools ---------------------------------------------------------------------------------------

typedef struct Rows {
    ScoreRow *row;
    int64_t count, capacity;
} Rows;

static bool add_rows(Rows *rows, const TimelinePart *part, int tool, Status *status)
{
    enum { BLOCK = 1024 };
    RecordingTool block[BLOCK];
    const int64_t all = recording_reader_tool_rows(part->reader, tool);
    for (int64_t first = 0; first < all; first += BLOCK) {
        const int count = (int)(all - first < BLOCK ? all - first : BLOCK);
        if (!recording_reader_tool(part->reader, tool, first, count, block, status))
            return false;
        if (rows->count + count > rows->capacity) {
            rows->capacity = 2 * (rows->count + count);
            rows->row = realloc(rows->row, (size_t)rows->capacity * sizeof *rows->row);
            ASSERT(rows->row != NULL);
        }
        for (int i = 0; i < count; i++) {
            const double time =
                recording_reader_tool_time(part->reader, tool, first + i) + part->offset;
            // Times rise; a row that is not known counts as a missing one.
            if (is_in(part, time) && vec3_finite(block[i].position) &&
                vec3_finite(block[i].force) &&
                (rows->count == 0 || time > rows->row[rows->count - 1].time))
                rows->row[rows->count++] = (ScoreRow){
                    .time = time, .position = block[i].position, .force = block[i].force};
        }
        if (rows->count > SCORE_TOOL_ROWS)
            return status_fail(status, STATUS_INVALID,
                               "tool %s has more than %d rows: score a part of the session",
                               recording_reader_info(part->reader)->tool[tool].name,
                               SCORE_TOOL_ROWS);
    }
    return true;
}

static bool read_tools(const Timeline *timeline, Score *score, Status *status)
{
    bool ok = true;
    score->tool_count = timeline_tools(timeline);
    score->tool = score_allocate(score->tool_count, sizeof *score->tool);
    for (int t = 0; t < score->tool_count && ok; t++) {
        Rows rows = {NULL, 0, 0};
        score->tool[t].id = timeline_tool_id(timeline, t);
        for (int p = 0; p < timeline_parts(timeline) && ok; p++) {
            const TimelinePart part = timeline_part(timeline, p);
            const int tool = recording_reader_find_tool(part.reader, score->tool[t].id);
            ok = tool < 0 || add_rows(&rows, &part, tool, status);
        }
        if (ok)
            score_tool(rows.row, rows.count, score->rules.scene.force_limit, score->first_s,
                       score->last_s, &score->tool[t]);
        free(rows.row);
    }
    return ok;
}

// --- bodies --------------------------------------------------------------------------------------

// One body as its meshes are read.
typedef struct Follow {
    const Timeline *timeline;
    const char *name;
    ScoreTissue *tissue;
    ScoreCut *cut; // [cut_count + 1] its cuts and tears by time; the last: what no event tells
    int cut_count;
    double before; // time of the last frame read [s]
    // memory for the largest mesh
    MeshColumns column;
    float *position;
} Follow;

// Finds the event of what was severed after the frame before: the one at its very time, if nothing
// is known of that yet, else the next.
static ScoreCut *find_cut(const Follow *follow)
{
    for (int i = 0; i < follow->cut_count; i++) {
        ScoreCut *cut = &follow->cut[i];
        const bool at = fabs(cut->time_s - follow->before) <= SAME_S;
        if (cut->time_s > follow->before + SAME_S || (at && cut->inside + cut->outside == 0.0))
            return cut;
    }
    return &follow->cut[follow->cut_count];
}

static bool take_mesh(Follow *follow, const TimelinePart *part, int body, int64_t frame,
                      Status *status)
{
    const RecordingFrame about = recording_reader_frame(part->reader, body, frame);
    RecordingTopology mesh;
    bool known;
    if (!recording_reader_mesh(part->reader, body, frame, follow->column.id,
                               follow->column.triangle, &mesh, status) ||
        !recording_reader_nodes(part->reader, body, frame, &follow->column, &known, status) ||
        !recording_reader_positions(part->reader, body, frame, follow->position, status))
        return false;
    if (known) {
        mesh.node_origin = follow->column.origin;
        mesh.node_parent = (const int(*)[2])follow->column.parent;
    }
    const Severed severed = score_tissue_mesh(follow->tissue, &mesh, follow->position);
    ScoreCut *cut = find_cut(follow);
    cut->inside += severed.inside;
    cut->outside += severed.outside;
    if (cut == &follow->cut[follow->cut_count] && severed.inside + severed.outside > 0.0)
        cut->time_s = about.time + part->offset;
    return true;
}

// Follows a body through a part. `ends`: only its first and last frame.
static bool follow_part(Follow *follow, const TimelinePart *part, bool ends, Status *status)
{
    const int body = recording_reader_find_body(part->reader, follow->name);
    const int64_t frames = body < 0 ? 0 : recording_reader_frames(part->reader, body);
    int topology = -1;
    bool any = false;
    for (int64_t f = 0; f < frames; f++) {
        const RecordingFrame about = recording_reader_frame(part->reader, body, f);
        const double time = about.time + part->offset;
        if (!is_in(part, time))
            continue;
        const bool last =
            f + 1 == frames ||
            !is_in(part, recording_reader_frame(part->reader, body, f + 1).time + part->offset);
        if (!any || (about.topology != topology && (!ends || last))) {
            if (!take_mesh(follow, part, body, f, status))
                return false;
            topology = about.topology;
        }
        any = true;
        follow->before = time;
    }
    return true;
}

static bool is_severing(const RecordingEvent *event, const char *body)
{
    return (strcmp(event->kind, "cut") == 0 || strcmp(event->kind, "tear") == 0) &&
           (event->body[0] == '\0' || strcmp(event->body, body) == 0);
}

static void list_cuts(const Timeline *timeline, Follow *follow)
{
    int count;
    int64_t left_out;
    const TimelineEvent *event = timeline_events(timeline, &count, &left_out);
    follow->cut = score_allocate(count + 1, sizeof *follow->cut);
    for (int i = 0; i < count; i++)
        if (is_severing(&event[i].event, follow->name)) {
            ScoreCut *cut = &follow->cut[follow->cut_count++];
            cut->time_s = event[i].time;
            memcpy(cut->kind, event[i].event.kind, sizeof cut->kind);
        }
}

static bool follow_body(Follow *follow, const ScoreRules *rules, int first_wall, bool ends,
                        Status *status)
{
    follow->tissue = score_tissue_create(rules, follow->name, first_wall);
    follow->before = -HUGE_VAL;
    bool ok = true;
    for (int p = 0; p < timeline_parts(follow->timeline) && ok; p++) {
        const TimelinePart part = timeline_part(follow->timeline, p);
        ok = follow_part(follow, &part, ends, status);
    }
    return ok;
}

// Sums the cuts of a body and appends those that severed something to the session's.
static void add_cuts(const Follow *follow, Score *score, ScoreBody *body)
{
    const double whole = 0.999; // of a cut that counts as inside or outside
    for (int i = 0; i <= follow->cut_count; i++) {
        ScoreCut *cut = &follow->cut[i];
        const double all = cut->inside + cut->outside;
        if (!(all > 0.0))
            continue;
        body->inside += cut->inside;
        body->outside += cut->outside;
        body->cuts_inside += cut->inside >= whole * all;
        body->cuts_outside += cut->outside >= whole * all;
        body->cuts_both += cut->inside < whole * all && cut->outside < whole * all;
        cut->solid = body->solid;
        memcpy(cut->body, body->name, sizeof cut->body);
        if (score->cut_count < SCORE_CUTS)
            score->cut[score->cut_count++] = *cut;
    }
}

static int64_t count_refused(const Timeline *timeline, const char *body)
{
    int count;
    int64_t left_out, refused = 0;
    const TimelineEvent *event = timeline_events(timeline, &count, &left_out);
    for (int i = 0; i < count; i++)
        refused += strcmp(event[i].event.kind, "cut_refused") == 0 &&
                   (event[i].event.body[0] == '\0' || strcmp(event[i].event.body, body) == 0);
    return refused;
}

static int find_first_wall(const Timeline *timeline, const char *body)
{
    for (int p = 0; p < timeline_parts(timeline); p++) {
        RecordingReader *reader = timeline_part(timeline, p).reader;
        const int at = recording_reader_find_body(reader, body);
        if (at >= 0 && recording_reader_first_wall(reader, at) > 0)
            return recording_reader_first_wall(reader, at);
    }
    return 0;
}

static bool read_body(const Timeline *timeline, int index, Score *score, Status *status)
{
    ScoreBody *body = &score->body[index];
    int nodes, triangles;
    snprintf(body->name, sizeof body->name, "%s", timeline_body(timeline, index));
    Follow follow = {.timeline = timeline, .name = body->name};
    const int first_wall = find_first_wall(timeline, body->name);
    timeline_most(timeline, index, &nodes, &triangles);
#define ALLOCATE_ROWS(name, type, width, of, ...)                                                  \
    follow.column.name =                                                                           \
        score_allocate(MESH_SLOTS_##of(nodes, triangles), sizeof *follow.column.name);
    MESH_COLUMNS(ALLOCATE_ROWS)
    follow.position = score_allocate(3 * (int64_t)nodes, sizeof *follow.position);
    list_cuts(timeline, &follow);
    // A body that no event says was cut is followed closely only if its ends differ.
    const bool quick = follow.cut_count == 0;
    bool ok = follow_body(&follow, &score->rules, first_wall, quick, status);
    ScoreCut *untold = &follow.cut[follow.cut_count];
    if (ok && quick && untold->inside + untold->outside > 0.0) {
        *untold = (ScoreCut){0};
        score_tissue_destroy(follow.tissue);
        ok = follow_body(&follow, &score->rules, first_wall, false, status);
    }
    if (ok) {
        score_tissue_pieces(follow.tissue, body);
        add_cuts(&follow, score, body);
        body->refused = count_refused(timeline, body->name);
    }
    score_tissue_destroy(follow.tissue);
    free(follow.cut);
#define FREE_ROWS(name, ...) free(follow.column.name);
    MESH_COLUMNS(FREE_ROWS)
    free(follow.position);
    return ok;
}

static int by_time(const void *a, const void *b)
{
    const ScoreCut *x = a, *y = b;
    return (x->time_s > y->time_s) - (x->time_s < y->time_s);
}

static bool read_bodies(const Timeline *timeline, Score *score, Status *status)
{
    bool ok = true;
    score->body_count = timeline_bodies(timeline);
    score->body = score_allocate(score->body_count, sizeof *score->body);
    score->cut = score_allocate(SCORE_CUTS, sizeof *score->cut);
    for (int i = 0; i < score->body_count && ok; i++)
        ok = read_body(timeline, i, score, status);
    qsort(score->cut, (size_t)score->cut_count, sizeof *score->cut, by_time);
    return ok;
}

// --- the session ---------------------------------------------------------------------------------

// Reads the name of a part's scene; "": not known.
static void scene_of(const Timeline *timeline, int part, char name[64])
{
    name[0] = '\0';
    sscanf(recording_reader_describe(timeline_part(timeline, part).reader),
           "scene %63[A-Za-z0-9_-]", name);
}

static bool read_rules(const Timeline *timeline, const char *scene, Score *score, Status *status)
{
    const char *text = recording_reader_scene(timeline_part(timeline, 0).reader);
    const char *described = timeline_describe(timeline);
    scene_of(timeline, 0, score->scene);
    // One sheet is of one scene: its limit, regions and fixed nodes hold for all parts.
    for (int p = 1; p < timeline_parts(timeline); p++) {
        char name[64];
        scene_of(timeline, p, name);
        if (strcmp(name, score->scene) != 0)
            return status_fail(status, STATUS_INVALID,
                               "part %d is of the scene '%s', part 1 of '%s': score them alone",
                               p + 1, name, score->scene);
    }
    if (scene != NULL) {
        score->fixed_known = true;
        return score_rules_load(scene, &score->rules, status);
    }
    score->fixed_known = text[0] != '\0';
    if (score_rules_read(score->fixed_known ? text : described, "the recorded scene", &score->rules,
                         status))
        return true;
    const Status why = *status;
    *status = (Status){0};
    return status_fail(status, why.code, "%.400s: name the scene by --score-scene", why.text);
}

static void read_parts(const Timeline *timeline, Score *score)
{
    score->part_count = timeline_parts(timeline);
    score->first_s = timeline_start(timeline);
    score->last_s = timeline_end(timeline);
    score->ended = true;
    for (int p = 0; p < score->part_count; p++) {
        const RecordingInfo *info = recording_reader_info(timeline_part(timeline, p).reader);
        if (p == 0)
            snprintf(score->created_by, sizeof score->created_by, "%s", info->created_by);
        score->ended = score->ended && info->ended;
        score->events += info->events;
        for (int b = 0; b < info->body_count; b++)
            score->missing += info->body[b].counts.lost + info->body[b].counts.dropped +
                              info->body[b].counts.without_mesh + info->body[b].broken;
    }
}

bool score_read(Timeline *timeline, const char *scene, Score *score, Status *status)
{
    *score = (Score){.part_count = 0};
    read_parts(timeline, score);
    if (read_rules(timeline, scene, score, status) && read_tools(timeline, score, status) &&
        read_bodies(timeline, score, status) && score_read_ledger(timeline, score, status))
        return true;
    score_destroy(score);
    return false;
}

void score_destroy(Score *score)
{
    score_rules_destroy(&score->rules);
    free(score->tool);
    free(score->body);
    free(score->cut);
    free(score->ledger);
    *score = (Score){.part_count = 0};
}
