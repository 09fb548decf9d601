// Rows: how bodies hold the positions and velocities of their nodes. A row is 8 numbers of type
// Real (float or double): x y z 0 vx vy vz 0.
//
// Rows hold positions in the world (double precision of surface bodies), or displacements u from
// the rest place in a base frame: x = origin + turn (place + u), velocities turned alike. The base
// frame is still for bodies that the world holds; for floating ones it is moved along with them
// every few ticks, so that u stays as small as the deformation, and single precision keeps its
// accuracy far from the origin. Step thread: no allocation.
#ifndef PLIANT_DYNAMICS_ROWS_H
#define PLIANT_DYNAMICS_ROWS_H

#include "base/precision.h"
#include "base/vec.h"
#include "dynamics/region.h"
#include "dynamics/rigid_frame.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { ROW = 8 };

// A |component| of a velocity beyond this is a bad number: nothing is faster than light [m/s]. What
// grows without end is noticed there long before it overflows.
#define SPEED_LIMIT 3e8

// Where the coordinates of displacement rows lie in the world; plain data, part of the state.
typedef struct BaseFrame {
    Vec3 origin; // [m]
    Quat turn;
    int64_t ticks; // since it was last moved
} BaseFrame;

typedef struct Rows {
    Precision precision;
    bool displaced;   // rows hold u, else positions in the world; always in single precision
    bool floating;    // displaced only: nothing holds the body, the frame follows it
    bool turned;      // displaced only: the rows' axes may not be the world's; floating implies it
    int count;        // rows
    const int *owner; // [count] negative: nobody's row, which stays as it is; NULL: all are used
    double (*place)[3];  // [count] rest position, less rest_origin [m]
    Vec3 rest_origin;    // zero unless displaced
    Quat rest_turn;      // from the axes of `place` to the world's; of turned rows
    BaseFrame *frame;    // displaced only; part of the state
    RigidFrame *rigid;   // the best fit of the rest shape: that of floating ones is what the frame
                         // follows
    double longest_edge; // at rest [m]: a frame that lags by more than a tenth of it is moved early
} Rows;

static inline size_t rows_real_size(const Rows *rows)
{
    return rows->precision == PRECISION_SINGLE ? sizeof(float) : sizeof(double);
}

// An element of an array of Real.
static inline double rows_get(const Rows *rows, const void *array, long index)
{
    return rows->precision == PRECISION_SINGLE ? (double)((const float *)array)[index]
                                               : ((const double *)array)[index];
}

static inline void rows_put(const Rows *rows, void *array, long index, double value)
{
    if (rows->precision == PRECISION_SINGLE)
        ((float *)array)[index] = (float)value;
    else
        ((double *)array)[index] = value;
}

// Numbers `from` to from + 2 of row `at`: 0 its place or displacement, 4 its velocity.
static inline Vec3 rows_vector(const Rows *rows, const void *row, int at, int from)
{
    long first = (long)at * ROW + from;
    return (Vec3){rows_get(rows, row, first), rows_get(rows, row, first + 1),
                  rows_get(rows, row, first + 2)};
}

// Position [m] and velocity [m/s] in the world of row `at` of `row`; velocity may be NULL.
void rows_read(const Rows *rows, const void *row, int at, Vec3 *position, Vec3 *velocity);
void rows_write(const Rows *rows, void *row, int at, Vec3 position, Vec3 velocity);
// A direction of the world in the rows' coordinates.
Vec3 rows_turn_in(const Rows *rows, Vec3 direction);
// A region of the world in the rows' coordinates, in which rows_local says where a row is.
Region rows_region(const Rows *rows, const Region *region);
Vec3 rows_local(const Rows *rows, const void *row, int at);
// Where a row is at rest, in the world [m].
Vec3 rows_rest(const Rows *rows, int at);
// Whether all numbers, the frame's too, are finite, coordinates within `limit` [m] and velocities
// within SPEED_LIMIT.
bool rows_are_sound(const Rows *rows, const void *row, double limit);
// After a tick of a floating body: moves the base frame along when it is time, and `row` with it.
// True when it was moved: forces held in the rows' coordinates have to be turned anew.
bool rows_follow(Rows *rows, void *row);
// Whether the base frame is no farther than `limit` from where the scene placed it [m].
bool rows_are_near(const Rows *rows, double limit);
// To the rest shape where the scene placed it, at rest, and the frame back to where it was.
void rows_return_to_rest(Rows *rows, void *row);
// Positions [m] and, unless NULL, velocities of the rows slot[0 .. count), as [count][3] floats.
void rows_snapshot(const Rows *rows, const void *row, const int *slot, int count, float *position,
                   float *velocity);
// Where the same rows are at rest, in the world.
void rows_snapshot_rest(const Rows *rows, const int *slot, int count, float *position);

#endif
