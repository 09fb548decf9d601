// SPDX-License-Identifier: MIT
// How copies of many nodes are made for the bus and recordings between two ticks: rows_read without
// its decisions per node, since every microsecond here is one of the tick's. For rows.c and
// voxel/cut/cut_carry.c. Step thread.
#ifndef PLIANT_BODY_ROWS_SHOW_H
#define PLIANT_BODY_ROWS_SHOW_H

#include "body/rows.h"

#include <string.h>

// Four numbers at a time, as in rows; the fourth is unused. Passed by address: by value they would
// need AVX.
typedef double Four __attribute__((vector_size(4 * sizeof(double))));
typedef float FourSingle __attribute__((vector_size(4 * sizeof(float))));

// The motion of the rows' frame, once for all nodes: zero unless displaced.
typedef struct RowsView {
    Four origin, speed, column[3];
} RowsView;

static inline void rows_view(const Rows *rows, RowsView *view)
{
    *view = (RowsView){.origin = {0.0}};
    if (!rows->displaced)
        return;
    const BaseFrame *frame = rows->frame;
    const Vec3 v = rows_velocity(rows);
    view->origin = (Four){frame->origin.x, frame->origin.y, frame->origin.z};
    view->speed = (Four){v.x, v.y, v.z};
    for (int c = 0; c < 3 && rows->turned; c++) {
        const Vec3 axis = quat_rotate(frame->turn, (Vec3){c == 0, c == 1, c == 2});
        view->column[c] = (Four){axis.x, axis.y, axis.z};
    }
}

static inline void rows_show_turn(const RowsView *view, Four *v)
{
    *v = view->column[0] * (*v)[0] + view->column[1] * (*v)[1] + view->column[2] * (*v)[2];
}

// `whole` also writes the number after the three, which is cheaper.
static inline void rows_show_store(float *to, const Four *v, bool whole)
{
    const FourSingle single = __builtin_convertvector(*v, FourSingle);
    memcpy(to, &single, whole ? sizeof single : 2 * sizeof *to);
    if (!whole)
        to[2] = single[2];
}

// Shows what a row holds of a place; `rest`: if it is displaced.
static inline __attribute__((always_inline)) void rows_show_place(const RowsView *view,
                                                                  bool displaced, bool turned,
                                                                  const double rest[3], Four *x,
                                                                  float *to, bool whole)
{
    // Rest position, displacement, turn and origin: the position in the world.
    if (displaced) {
        *x += (Four){rest[0], rest[1], rest[2]};
        if (turned)
            rows_show_turn(view, x);
        *x += view->origin;
    }
    rows_show_store(to, x, whole);
}

static inline __attribute__((always_inline)) void
rows_show_velocity(const RowsView *view, bool turned, Four *v, float *to, bool whole)
{
    if (turned) {
        rows_show_turn(view, v);
        *v += view->speed;
    }
    rows_show_store(to, v, whole);
}

#endif
