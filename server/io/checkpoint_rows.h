// The readable part of a body in a checkpoint: the state of all its nodes, in ascending id. Private
// to io/.
#ifndef PLIANT_IO_CHECKPOINT_ROWS_H
#define PLIANT_IO_CHECKPOINT_ROWS_H

#include "dynamics/body.h"
#include "io/hdf.h"

#ifdef PLIANT_WITH_HDF5
typedef struct BodyRows {
    int count;
    int *id;
    Vec3 *position, *velocity; // [m], [m/s]
} BodyRows;

// Sorts slots, some of which may be free (id -1), into rows. The caller destroys them.
void checkpoint_rows_sort(BodyRows *rows, int slots, const int *id, const Vec3 *position,
                          const Vec3 *velocity);
void checkpoint_rows_destroy(BodyRows *rows);
// True if the body's current state has exactly these rows, bit for bit.
bool checkpoint_rows_shown(const Body *body, const BodyRows *rows);

// Writes /bodies/<name>/{id, position, velocity}.
bool checkpoint_rows_write(const HdfFile *file, const Body *body, const BodyRows *rows);
// True if the number of nodes in the file is one that the body has or can have.
bool checkpoint_rows_check_count(const HdfFile *file, const Body *body);
// Reads the rows; call after checkpoint_rows_check_count. Ids must be those of the body, or
// ascending if its mesh changes. The caller destroys the rows, also after a failure.
bool checkpoint_rows_read(const HdfFile *file, const Body *body, BodyRows *rows);
#endif

#endif
