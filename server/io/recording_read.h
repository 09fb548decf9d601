// SPDX-License-Identifier: MIT
// Reads recordings at any time: a frame, the mesh of its topology, rows of tools, events. For
// programs that play or judge a session; never while the simulation runs. A child process reads the
// file (hdf.h), so a damaged one cannot crash the caller. One thread per reader; readers are opened
// before the program starts threads. Without PLIANT_WITH_HDF5 none of these functions exist.
#ifndef PLIANT_IO_RECORDING_READ_H
#define PLIANT_IO_RECORDING_READ_H

#include "io/recording.h"

typedef struct RecordingReader RecordingReader;

enum {
    RECORDING_NODES_MOST = 1 << 22, // of a frame; larger ones are not read
    RECORDING_TRIANGLES_MOST = 1 << 23,
    RECORDING_ROWS_MOST = 4096,     // of a tool, of colours and of the events in one call
    RECORDING_LOOKS_MOST = 1 << 24, // rows of colours; later ones are not read
};

// Opens a recording as it is now: ended, being written, or left by a writer that was killed; rows
// that are added later are not seen. Keeps 32 bytes of each frame and 8 of each row of a tool in
// memory, and its maps' heads. Returns NULL with `status` (STATUS_INVALID).
RecordingReader *recording_reader_open(const char *path, Status *status);
// Accepts NULL.
void recording_reader_close(RecordingReader *reader);

// The contents; bodies and tools have their indices there. Valid until the reader is closed.
const RecordingInfo *recording_reader_info(const RecordingReader *reader);
// The scene's text, and the daemon's description of it, as DESCRIBE answers: bodies and the shapes
// of tools. "" if the file has none: `pliant-record` writes the description alone, and files of
// pliantd before 2026-12 the scene alone.
const char *recording_reader_scene(const RecordingReader *reader);
const char *recording_reader_describe(const RecordingReader *reader);
// Finds a body by its name, or a tool by its id; -1: there is none.
int recording_reader_find_body(const RecordingReader *reader, const char *name);
int recording_reader_find_tool(const RecordingReader *reader, int id);

// --- frames --------------------------------------------------------------------------------------

// Complete frames of a body whose times rise: frames of a damaged file that go back in time are not
// among them.
int64_t recording_reader_frames(const RecordingReader *reader, int body);
// Returns the last frame at or before a time [s], by binary search; -1: none.
int64_t recording_reader_find_frame(const RecordingReader *reader, int body, double time);
// Returns everything of a frame but its positions (NULL), without reading the file.
RecordingFrame recording_reader_frame(const RecordingReader *reader, int body, int64_t frame);
// Reads the positions, the recorded bits: [3 node_count], m. Returns false with `status`, also if
// one of them is not finite.
bool recording_reader_positions(RecordingReader *reader, int body, int64_t frame, float *position,
                                Status *status);

// --- meshes --------------------------------------------------------------------------------------

// Largest mesh of all frames of a body.
void recording_reader_most(const RecordingReader *reader, int body, int *nodes, int *triangles);
// Triangles from this one on are walls of cuts; 0: none, or not known.
int recording_reader_first_wall(const RecordingReader *reader, int body);
// Reads the mesh of a frame into the caller's arrays, [node_count] and [triangle_count], sizes as
// in recording_reader_most. Corners are nodes of the frame. Returns false with `status`, also if a
// corner is none.
bool recording_reader_mesh(RecordingReader *reader, int body, int64_t frame, int *node_id,
                           int (*triangle)[3], RecordingTopology *topology, Status *status);

// Reads what else is known of the nodes of a frame's mesh, the columns of node_<name>,
// [node_count]. Ids may be any number. `known` false: the file does not say. Returns false with
// `status` if it cannot be read.
bool recording_reader_nodes(RecordingReader *reader, int body, int64_t frame, const MeshColumns *to,
                            bool *known, Status *status);

// Rows of colours, in the order of the file (RecordingLook); 0: the body has none.
int64_t recording_reader_look_rows(const RecordingReader *reader, int body);
// Reads `rows` rows, at most RECORDING_ROWS_MOST, from `first` on. Ids may be any number.
bool recording_reader_look(RecordingReader *reader, int body, int64_t first, int rows,
                           int *topology, int *id, unsigned char (*colour)[RECORDING_COLOURS],
                           Status *status);

// Maps of a body, in the order of their times; 0: it has none of the kind.
int64_t recording_reader_maps(const RecordingReader *reader, int body, RecordingMapKind kind);
// Returns the last one at or before a time [s]; -1: none.
int64_t recording_reader_find_map(const RecordingReader *reader, int body, RecordingMapKind kind,
                                  double time);
RecordingMap recording_reader_map(const RecordingReader *reader, int body, RecordingMapKind kind,
                                  int64_t map);
// Reads its columns, `count` rows each. Levels and tags may be any number.
bool recording_reader_map_rows(RecordingReader *reader, int body, RecordingMapKind kind,
                               int64_t map, void *const column[], Status *status);

// --- tools and events ----------------------------------------------------------------------------

// Rows of a tool whose times do not fall; a tool has no rows while it is inactive.
int64_t recording_reader_tool_rows(const RecordingReader *reader, int tool);
double recording_reader_tool_time(const RecordingReader *reader, int tool, int64_t row); // [s]
// Returns the last row at or before a time [s]; -1: none.
int64_t recording_reader_find_tool_row(const RecordingReader *reader, int tool, double time);
// Reads `rows` rows, at most RECORDING_ROWS_MOST, from `first` on. Values that are not finite are
// not known: `pliant-record` writes NaN for an orientation that no message told.
bool recording_reader_tool(RecordingReader *reader, int tool, int64_t first, int rows,
                           RecordingTool *sample, Status *status);

// Reads events as above; there are recording_reader_info()->events. Texts end; a time that is not
// finite is 0.
bool recording_reader_events(RecordingReader *reader, int64_t first, int rows,
                             RecordingEvent *event, Status *status);
// The same of a list's lines; there are recording_reader_info()->lines[list]. Numbers are finite.
bool recording_reader_lines(RecordingReader *reader, RecordingList list, int64_t first, int rows,
                            RecordingLedger *line, Status *status);

#endif
