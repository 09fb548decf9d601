// SPDX-License-Identifier: MIT
// Rows: the storage of node positions and velocities. A row is 8 numbers of type Real (float or
// double): x y z 0 vx vy vz 0.
// Rows contain positions in the world (surface bodies in double precision), or displacements u from
// the rest position in a base frame: x = origin + turn (rest + u), with velocities rotated alike.
// The base frame of bodies fixed to the world is constant; that of floating bodies follows them
// every few ticks, so that u stays as small as the deformation, and single precision keeps its
// accuracy far from the origin. In single precision a floating frame also has a velocity, to which
// those of its rows are relative: it falls in their place (rows_fall). Step thread: no
// allocation.
#ifndef PLIANT_BODY_ROWS_H
#define PLIANT_BODY_ROWS_H

#include "base/isa.h"
#include "base/memory.h"
#include "base/vec.h"
#include "body/integrator.h"
#include "body/region.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { ROW = 8 };

// A |component| of a velocity beyond this is a bad number: nothing is faster than light [m/s]. What
// grows without end is noticed there long before it overflows.
#define SPEED_LIMIT 3e8

// --- rigid_frame.c ---
// Best fit of the rest shape to the present shape, weighted by masses or by shape-preserving
// springs: the rigid motion that base frames follow, and the virtual nodes of surface bodies with
// frame = "body" (server/surface/README.md, "Virtual nodes on a rigid frame").

// A rigid motion: x = center + rotation (X - rest_center).
typedef struct FramePose {
    double rest_center[3]; // [m]
    double center[3];      // [m]
    double rotation[3][3];
    double velocity[3]; // of the center [m/s]
    double angular[3];  // [rad/s]
} FramePose;

typedef struct RigidFrame {
    int (*run)[2]; // [run_count] first slot and end of the slots that count; of a body without
    int run_count; // levels one run, all
    int whole[1][2];
    Precision precision;     // of the rows
    bool displaced;          // rows hold displacements from `rest`, else positions
    const double (*rest)[3]; // [slot_count] rest positions [m]
    const double *weight;    // [slot_count] any unit, k'_s [N/m] for the energy; 0 for padding
    double total_weight;
    double *rotation; // quaternion w x y z; part of the state (start of the next fit)
    FramePose pose;   // valid after rigid_frame_fit
} RigidFrame;

// Keeps positions and weights by reference; weights must sum to more than 0 (those of a body with
// levels may be set later: rigid_frame_weigh).
RigidFrame *rigid_frame_create(const char *name, Precision precision, bool displaced,
                               int slot_count, const double (*rest)[3], const double *weight,
                               Arena *arena, StateList *state);
// Recomputes the rest centre after rest positions, weights or runs have changed.
void rigid_frame_weigh(RigidFrame *frame);
// Fits position, rotation and velocities to rows (rows.h) [slot_count][ROW].
void rigid_frame_fit(RigidFrame *frame, const void *rows);

// Returns the energy of the shape-preserving springs in these rows [J]; changes nothing.
double rigid_frame_energy(const RigidFrame *frame, const void *rows);

// --- frames and rows ---

// Position of the displacement rows' coordinates in the world; plain data, part of the state.
typedef struct BaseFrame {
    Vec3 origin; // [m]
    Quat turn;
    int64_t ticks; // since it was last moved
} BaseFrame;

typedef struct FrameMotion {
    Vec3 shift, velocity; // in the world [m], [m/s]
} FrameMotion;

// A base frame that gravity accelerates in place of its rows.
typedef struct FrameFall {
    Vec3 velocity;     // at the end of a tick [m/s]; state
    FrameMotion ahead; // of that end, within a tick: how far, and how much faster; else zero
    FrameMotion begin; // of the substep, and its sum: RK4
    FrameMotion sum;
} FrameFall;

typedef struct Rows {
    Precision precision;
    bool displaced;   // rows hold u, else positions in the world; always in single precision
    bool floating;    // displaced only: nothing fixes the body, the frame follows it
    bool turned;      // displaced only: the rows' axes may not be the world's; floating implies it
    int count;        // rows
    const int *owner; // [count] negative: a free row, which stays unchanged; NULL: all are used
    // Of rows that others carry, which are zero and turned: where they are, when that is known.
    const bool *carried; // [carried_end]
    int carried_end;     // 0: there are none
    const void *carried_row;
    double (*rest)[3]; // [count] rest position, less rest_origin [m]
    Vec3 rest_origin;  // zero unless displaced
    Quat rest_turn;    // from the axes of `rest` to the world's; of turned rows
    BaseFrame *frame;  // displaced only; part of the state
    FrameFall *fall;   // NULL: the frame moves in rows_follow only
    RigidFrame *rigid; // the best fit of the rest shape: that of floating ones is what the frame
                       // follows
    double
        longest_edge; // at rest [m]: a frame that lags by more than a tenth of it is moved earlier
} Rows;

static inline size_t rows_real_size(const Rows *rows)
{
    return rows->precision == PRECISION_SINGLE ? sizeof(float) : sizeof(double);
}

// Returns an element of an array of Real.
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

// Returns numbers `from` to from + 2 of row `at`: 0 its position or displacement, 4 its velocity.
static inline Vec3 rows_vector(const Rows *rows, const void *row, int at, int from)
{
    long first = (long)at * ROW + from;
    return (Vec3){rows_get(rows, row, first), rows_get(rows, row, first + 1),
                  rows_get(rows, row, first + 2)};
}

static inline bool rows_is_carried(const Rows *rows, int at)
{
    return at < rows->carried_end && rows->carried[at];
}

// Returns the rows that tell where row `at` is, if that is known.
static inline const void *rows_of(const Rows *rows, const void *row, int at)
{
    return rows_is_carried(rows, at) ? rows->carried_row : row;
}

// Reads position [m] and velocity [m/s] of row `at` in the world; velocity may be NULL.
void rows_read(const Rows *rows, const void *row, int at, Vec3 *position, Vec3 *velocity);
void rows_write(const Rows *rows, void *row, int at, Vec3 position, Vec3 velocity);
// Converts a direction of the world to the rows' coordinates.
Vec3 rows_turn_in(const Rows *rows, Vec3 direction);
// Converts a region of the world to the rows' coordinates, which rows_local uses.
Region rows_region(const Rows *rows, const Region *region);
static inline Vec3 rows_local(const Rows *rows, const void *row, int at)
{
    const Vec3 u = rows_vector(rows, row, at, 0);
    if (!rows->displaced)
        return u;
    const double *rest = rows->rest[at];
    return vec3_add((Vec3){rest[0], rest[1], rest[2]}, u);
}
// Converts a rest position in the axes of `rest`, less rest_origin, to the world [m].
Vec3 rows_rest_out(const Rows *rows, Vec3 rest);
// Returns the rest position of a row in the world [m].
Vec3 rows_rest(const Rows *rows, int at);
// Bounds in one pass over all rows the speed of any in the world [m/s] and, of displaced ones, the
// distance from its rest position in the base frame [m], else infinity. Ignores bad numbers.
void rows_bound_motion(const Rows *rows, const void *row, double *displacement, double *speed);
// True if all numbers, the frame's included, are finite, coordinates within `limit` [m] and
// velocities within SPEED_LIMIT.
bool rows_are_valid(const Rows *rows, const void *row, double limit);
// Moves the base frame of a floating body, and `row` with it, if it is due; after a tick. Returns
// true if it moved: forces in the rows' coordinates must be rotated again.
bool rows_follow(Rows *rows, void *row);
// True if the base frame was within `limit` [m] of the scene's placement when the tick began and is
// no faster than SPEED_LIMIT. Stopping a body does not bring it back within the limit; it then
// returns to its rest shape.
bool rows_are_near(const Rows *rows, double limit);
// Sets all velocities to zero, the frame's included.
void rows_stop(Rows *rows, void *row);
// Restores the rest shape at the scene's placement, with zero velocity, and the frame's initial
// pose.
void rows_return_to_rest(Rows *rows, void *row);

// --- a frame that falls; for other rows these do nothing ---
// Makes the frame of these floating rows fall from now on. Load time. No force on them may depend
// on their velocity in the world.
void rows_let_fall(Rows *rows, const char *name, Arena *arena, StateList *state);
// Of a frame that falls: see rows_drift, rows_advance and rows_end_tick.
void frame_drift(Rows *rows, double dt);
void frame_advance(Rows *rows, const Evaluation *evaluation, double h, Vec3 gravity);
void frame_end_tick(Rows *rows, bool stays);
// Returns the part of gravity [m/s2] that the kernel applies to its rows, in their coordinates: all
// or zero.
static inline Vec3 rows_gravity(const Rows *rows, Vec3 gravity)
{
    return rows->fall != NULL ? (Vec3){0.0, 0.0, 0.0} : rows_turn_in(rows, gravity);
}
// Apply the body's drift and stages to the frame, in double precision.
static inline void rows_drift(Rows *rows, double dt)
{
    if (rows->fall != NULL)
        frame_drift(rows, dt);
}
static inline void rows_advance(Rows *rows, const Evaluation *evaluation, double h, Vec3 gravity)
{
    if (rows->fall != NULL)
        frame_advance(rows, evaluation, h, gravity);
}
// Keeps the frame's position after the stages, or restores that before the tick.
static inline void rows_end_tick(Rows *rows, bool stays)
{
    if (rows->fall != NULL)
        frame_end_tick(rows, stays);
}
// Return the frame's current origin [m] and velocity [m/s].
static inline Vec3 rows_origin(const Rows *rows)
{
    const Vec3 origin = rows->frame->origin;
    return rows->fall == NULL ? origin : vec3_add(origin, rows->fall->ahead.shift);
}
static inline Vec3 rows_velocity(const Rows *rows)
{
    const FrameFall *fall = rows->fall;
    return fall == NULL ? (Vec3){0.0, 0.0, 0.0} : vec3_add(fall->velocity, fall->ahead.velocity);
}

// Writes positions [m] and, unless NULL, velocities of the rows slot[0 .. count), as [count][3]
// floats. Those that others carry are left out.
void rows_snapshot(const Rows *rows, const void *row, const int *slot, int count, float *position,
                   float *velocity);
// Writes the rest positions of the same rows in the world.
void rows_snapshot_rest(const Rows *rows, const int *slot, int count, float *position);

#endif
