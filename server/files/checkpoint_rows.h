// What anybody may read of a body in a checkpoint: all that moves of it, in ascending id. Private
// to files/.
#ifndef PLIANT_FILES_CHECKPOINT_ROWS_H
#define PLIANT_FILES_CHECKPOINT_ROWS_H

#include "dynamics/body.h"
#include "files/hdf.h"

#ifdef PLIANT_WITH_HDF5
typedef struct BodyRows {
    int count;
    int *id;
    Vec3 *position, *velocity; // [m], [m/s]
} BodyRows;

// From slots, of which some may be free (id -1). To be destroyed.
void checkpoint_rows_sort(BodyRows *rows, int slots, const int *id, const Vec3 *position,
                          const Vec3 *velocity);
void checkpoint_rows_destroy(BodyRows *rows);
// Whether the body's present state shows these rows, bit for bit.
bool checkpoint_rows_shown(const Body *body, const BodyRows *rows);

// /bodies/<name>/{id, position, velocity}.
bool checkpoint_rows_write(const HdfFile *file, const Body *body, const BodyRows *rows);
// Whether the file has as many nodes as the body, or may have.
bool checkpoint_rows_check_count(const HdfFile *file, const Body *body);
// After checkpoint_rows_check_count. Ids must be those of the body; of one whose mesh changes,
// ascending. To be destroyed also after a failure.
bool checkpoint_rows_read(const HdfFile *file, const Body *body, BodyRows *rows);
#endif

#endif
