// SPDX-License-Identifier: MIT
// Recordings of the parts of a session on one timeline: which frame, mesh and tools belong to a
// time, and what happened when. A part that begins within the one before continues it and takes
// over there (a session continued from a checkpoint repeats what came after it); one that begins no
// later than the one before, as a restarted server does, follows it. One thread.
#ifndef PLIANT_PLAY_TIMELINE_H
#define PLIANT_PLAY_TIMELINE_H

#include "io/recording_read.h"

enum {
    TIMELINE_PARTS = 32,
    TIMELINE_EVENTS = 1 << 16,  // kept of all parts; others are counted
    TIMELINE_LEDGERS = 1 << 18, // kept of all parts
};

typedef struct Timeline Timeline;

// An event at its time on the timeline [s].
typedef struct TimelineEvent {
    double time;
    RecordingEvent event;
} TimelineEvent;

// A frame of a body: of a part of the session. frame -1: there is none yet.
typedef struct TimelineFrame {
    int part;
    int64_t frame;
} TimelineFrame;

// Opens the recordings in their order. Returns NULL with `status`, also if no frame is in them or
// if their bodies or tools are more than a scene has.
Timeline *timeline_open(char *const *path, int count, Status *status);
// Accepts NULL.
void timeline_close(Timeline *timeline);

double timeline_start(const Timeline *timeline); // [s]
double timeline_end(const Timeline *timeline);
double timeline_frame_time(const Timeline *timeline); // mean time between frames [s], positive
int timeline_parts(const Timeline *timeline);
// The first part's description of its scene; "" if it has none.
const char *timeline_describe(const Timeline *timeline);

// A part for programs that read all of it: of its own times those count that are, plus `offset`, in
// [begin, end). The reader stays the timeline's.
typedef struct TimelinePart {
    RecordingReader *reader;
    double offset, begin, end; // [s]; of the last part `end` is infinite
} TimelinePart;
TimelinePart timeline_part(const Timeline *timeline, int part);

int timeline_bodies(const Timeline *timeline);
const char *timeline_body(const Timeline *timeline, int body);
// The largest mesh of a body, and the first triangle on a wall of a cut (0: none, or not known).
void timeline_most(const Timeline *timeline, int body, int *nodes, int *triangles);
int timeline_first_wall(const Timeline *timeline, const TimelineFrame *at, int body);
// The colours in the file that the frame is in, as recording_reader_look.
int64_t timeline_look_rows(const Timeline *timeline, const TimelineFrame *at, int body);
bool timeline_look(Timeline *timeline, const TimelineFrame *at, int body, int64_t first, int rows,
                   int *topology, int *id, unsigned char (*colour)[RECORDING_COLOURS],
                   Status *status);

// Finds the newest map of a body at or before the time of a frame, in the file that the frame is
// in; its topology is numbered as that of the frame. Where none of the frame's mesh has been yet,
// the next one, if that is of it: after a seek back a viewer would keep one of later. -1: there is
// none.
int64_t timeline_find_map(const Timeline *timeline, const TimelineFrame *at, int body,
                          RecordingMapKind kind, RecordingMap *map);
bool timeline_map_rows(Timeline *timeline, const TimelineFrame *at, int body, RecordingMapKind kind,
                       int64_t map, void *const column[], Status *status);

// The last frame of a body at or before a time.
TimelineFrame timeline_find(const Timeline *timeline, int body, double time);
// The nearest time after a time at which any body has a frame, or the one before the frame that is
// shown at that time; false: there is none.
bool timeline_next(const Timeline *timeline, double time, double *next);
bool timeline_previous(const Timeline *timeline, double time, double *previous);
// As recorded, but for the number of the topology, which is unique among all parts.
RecordingFrame timeline_frame(const Timeline *timeline, const TimelineFrame *at, int body);
bool timeline_positions(Timeline *timeline, const TimelineFrame *at, int body, float *position,
                        Status *status);
bool timeline_mesh(Timeline *timeline, const TimelineFrame *at, int body, int *node_id,
                   int (*triangle)[3], RecordingTopology *topology, Status *status);

// As recording_reader_nodes.
bool timeline_nodes(Timeline *timeline, const TimelineFrame *at, int body, const MeshColumns *to,
                    bool *known, Status *status);

int timeline_tools(const Timeline *timeline);
int timeline_tool_id(const Timeline *timeline, int tool);
// Reads where a tool was; `active` false: it was withdrawn, and nothing else is set. Values that
// were not recorded are zero, an orientation is then none.
bool timeline_tool(Timeline *timeline, int tool, double time, RecordingTool *sample, bool *active,
                   Status *status);
// Writes the largest force of a tool [N] in each of `parts` equal parts of the timeline. Reads all
// rows of the tool.
bool timeline_forces(Timeline *timeline, int tool, int parts, float *force, Status *status);

// All events in the order of their times, and how many were too many.
const TimelineEvent *timeline_events(const Timeline *timeline, int *count, int64_t *left_out);

// Returns the number of the last ledger, or of the last errors, at or before a time, from 1; 0:
// there is none. Reads its lines, at most LEDGER_LINES or ERRORS_LINES.
int timeline_find_lines(const Timeline *timeline, RecordingList list, double time);
bool timeline_lines(Timeline *timeline, RecordingList list, int number, RecordingLedger *line,
                    int *count, Status *status);

#endif
