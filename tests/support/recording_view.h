// SPDX-License-Identifier: MIT
// Recordings as any reader sees them: the HDF5 file through the library's own functions, the
// sidecar through a small XML parser that knows nothing of how it was written.
#ifndef PLIANT_TESTS_RECORDING_VIEW_H
#define PLIANT_TESTS_RECORDING_VIEW_H

#include "expect.h"

#include <hdf5.h>

// An attribute that is a text.
void expect_attribute(hid_t object, const char *name, const char *expected);
// One that is a whole number.
void expect_number(hid_t object, const char *name, int expected);
// All numbers of a set, as `type`; their memory is the caller's.
void view_get(hid_t file, const char *set, hid_t type, void *numbers);
void view_put(hid_t file, const char *set, hid_t type, const void *numbers);
// Flips bits of one byte of a set, counted from its start; from its middle when -1.
void view_alter(const char *path, const char *set, long at, unsigned char bits);

// Writes one row of a set, of `columns` numbers, or 0: one number.
void view_put_row(const char *path, const char *set, hid_t type, int row, int columns,
                  const void *numbers);

// What a reader may trust of one body: the frames that every column has.
typedef struct BodyView {
    int frames;
    double *time;
    int64_t *step, *first;
    int32_t *topology, *count;
    int rows; // of position
    float (*position)[3];
    int topologies;
    int32_t *number, *triangle_count, *node_count;
    int64_t *first_triangle, *first_node;
    int triangles, nodes; // of all topologies
    int32_t (*triangle)[3], *node_id;
} BodyView;

// Plain, or as a file that is being written or whose writer was killed. Negative: cannot be opened.
hid_t view_open(const char *path, bool while_written);
// Plain, to be changed; fails the test when it cannot be opened.
hid_t view_change(const char *path);
void view_close(hid_t *file); // for SCOPED
// Reads all of a body and checks that every index points at something that is there.
void view_body(BodyView *view, hid_t file, const char *body);
void view_free(BodyView *view);
// The same of a file that is plain.
void view_read(BodyView *view, const char *path, const char *body);
// Rows of a data set, converted to `type`; malloc'ed.
void *view_rows(hid_t file, const char *name, hid_t type, int *rows);

typedef struct SidecarRows {
    long first, rows; // what the hyperslab selects
    long of;          // rows that the data set has, as the sidecar knows it
    int columns;
    char file[64], set[128];
} SidecarRows;

typedef struct SidecarFrame {
    char collection[64]; // the body
    double time;
    SidecarRows triangles, position, node_id;
    SidecarRows error, level; // where maps are recorded
} SidecarFrame;

// The frames of a sidecar in their order, malloc'ed; fails the test when it is not well-formed XML
// or not of the shape that XDMF 2 requires.
SidecarFrame *view_sidecar(const char *path, int *count);
// That of a recording.
SidecarFrame *view_sidecar_of(const char *recording, int *count);
// Whether a body's frames in the sidecar are the first frames of the file.
void expect_sidecar_matches(const SidecarFrame *frame, int count, const BodyView *view,
                            const char *body);

#endif
