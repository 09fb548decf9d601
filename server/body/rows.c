// SPDX-License-Identifier: MIT
// Conversion between a body's rows and the world, and copies of all nodes. Step thread.
#include "body/rows_show.h"

#include <math.h>

enum {
    FOLLOW_TICKS = 16, // ticks between moves of the base frame
    FOLLOW_LEAST = 4,  // at least so many, even for fast bodies
};

// The numbers of a row: position or displacement, and velocity.
static inline __attribute__((always_inline)) void load(const void *row, bool single, int at,
                                                       Vec3 *x, Vec3 *v)
{
    // Kernels compute in one precision, the world in double.
    if (single) {
        const float *r = (const float *)row + (long)at * ROW;
        *x = (Vec3){(double)r[0], (double)r[1], (double)r[2]};
        *v = (Vec3){(double)r[4], (double)r[5], (double)r[6]};
    } else {
        const double *r = (const double *)row + (long)at * ROW;
        *x = (Vec3){r[0], r[1], r[2]};
        *v = (Vec3){r[4], r[5], r[6]};
    }
}

static inline Vec3 rest_of(const Rows *rows, int at)
{
    return (Vec3){rows->rest[at][0], rows->rest[at][1], rows->rest[at][2]};
}

void rows_read(const Rows *rows, const void *row, int at, Vec3 *position, Vec3 *velocity)
{
    Vec3 p, v;
    load(row, rows->precision == PRECISION_SINGLE, at, &p, &v);
    // From the base frame to the world.
    if (rows->displaced) {
        p = vec3_add(rest_of(rows, at), p);
        if (rows->turned) {
            p = quat_rotate(rows->frame->turn, p);
            if (velocity != NULL)
                v = quat_rotate(rows->frame->turn, v);
        }
        p = vec3_add(rows_origin(rows), p);
        // A falling frame has a velocity that its rows lack.
        if (rows->fall != NULL)
            v = vec3_add(rows_velocity(rows), v);
    }
    *position = p;
    if (velocity != NULL)
        *velocity = v;
}

// Find the largest |number| of each of four columns from `row` on, one accumulator for each, so
// that compilers vectorise.
enum { HALF = ROW / 2 };

static Vec3 largest_single(const float *row, int count)
{
    float most[HALF] = {0.0f};
    for (long i = 0; i < count; i++)
        for (int c = 0; c < HALF; c++) {
            const float size = fabsf(row[i * ROW + c]);
            most[c] = size > most[c] ? size : most[c];
        }
    return (Vec3){(double)most[0], (double)most[1], (double)most[2]};
}

static Vec3 largest_double(const double *row, int count)
{
    double most[HALF] = {0.0};
    for (long i = 0; i < count; i++)
        for (int c = 0; c < HALF; c++) {
            const double size = fabs(row[i * ROW + c]);
            most[c] = size > most[c] ? size : most[c];
        }
    return (Vec3){most[0], most[1], most[2]};
}

static double longest(const Rows *rows, const void *row, int from)
{
    return vec3_length(rows->precision == PRECISION_SINGLE
                           ? largest_single((const float *)row + from, rows->count)
                           : largest_double((const double *)row + from, rows->count));
}

void rows_bound_motion(const Rows *rows, const void *row, double *displacement, double *speed)
{
    *displacement = rows->displaced ? longest(rows, row, 0) : (double)INFINITY;
    *speed =
        longest(rows, row, HALF) + (rows->fall != NULL ? vec3_length(rows_velocity(rows)) : 0.0);
}

void rows_write(const Rows *rows, void *row, int at, Vec3 position, Vec3 velocity)
{
    Vec3 p = position, v = velocity;
    // From the world to the base frame, the reverse of rows_read.
    if (rows->displaced) {
        p = rows_turn_in(rows, vec3_sub(position, rows_origin(rows)));
        p = vec3_sub(p, rest_of(rows, at));
        v = rows_turn_in(rows, vec3_sub(velocity, rows_velocity(rows)));
    }
    const double value[ROW] = {p.x, p.y, p.z, 0.0, v.x, v.y, v.z, 0.0};
    for (int c = 0; c < ROW; c++)
        rows_put(rows, row, (long)at * ROW + c, value[c]);
}

Vec3 rows_turn_in(const Rows *rows, Vec3 direction)
{
    return rows->turned ? quat_rotate(quat_conjugate(rows->frame->turn), direction) : direction;
}

Region rows_region(const Rows *rows, const Region *region)
{
    Region here = *region;
    if (!rows->displaced)
        return here;
    // Points move with the origin, the normal of a plane only turns.
    const Vec3 origin = rows_origin(rows);
    here.from = rows_turn_in(rows, vec3_sub(region->from, origin));
    here.to = region->kind == REGION_BELOW_PLANE ? rows_turn_in(rows, region->to)
                                                 : rows_turn_in(rows, vec3_sub(region->to, origin));
    return here;
}

Vec3 rows_rest_out(const Rows *rows, Vec3 rest)
{
    return vec3_add(rows->rest_origin, rows->turned ? quat_rotate(rows->rest_turn, rest) : rest);
}

Vec3 rows_rest(const Rows *rows, int at)
{
    return rows_rest_out(rows, rest_of(rows, at));
}

static bool is_within(Vec3 v, double limit)
{
    return fabs(v.x) <= limit && fabs(v.y) <= limit && fabs(v.z) <= limit;
}

// True if a frame is valid; one read from a file may be anything.
static bool frame_is_valid(const BaseFrame *frame)
{
    const Quat q = frame->turn;
    return vec3_finite(frame->origin) &&
           fabs(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - 1.0) < 1e-6;
}

bool rows_are_valid(const Rows *rows, const void *row, double limit)
{
    // The frame first: with it all rows would be bad.
    if (rows->displaced && !frame_is_valid(rows->frame))
        return false;
    if (!is_within(rows_velocity(rows), SPEED_LIMIT))
        return false;
    for (long i = 0; i < (long)rows->count * ROW; i++) {
        // The first half of a row is a place, the second a velocity.
        double most = i % ROW < 4 ? limit : SPEED_LIMIT;
        if (!(fabs(rows_get(rows, row, i)) <= most))
            return false;
    }
    return true;
}

// With the fit p = center + R (rest - rest_center) in the rows' coordinates, the new frame is the
// one in which the fitted body does not move: p' = R^T (p - center) + rest_center. Rows are
// transformed by R^T, and lose `speed`.
static inline __attribute__((always_inline)) void
move_rows(const Rows *rows, void *row, bool single, Quat back, Vec3 center, Vec3 rest, Vec3 speed)
{
    for (int s = 0; s < rows->count; s++) {
        if ((rows->owner != NULL && rows->owner[s] < 0) || rows_is_carried(rows, s))
            continue;
        Vec3 u, v;
        load(row, single, s, &u, &v);
        Vec3 arm = vec3_sub(rest_of(rows, s), rest);
        // R^T (arm + u - shift) - arm, the difference of rotations taken first: it is small.
        Vec3 away = vec3_sub(u, vec3_sub(center, rest));
        Vec3 moved = vec3_add(vec3_sub(quat_rotate(back, arm), arm), quat_rotate(back, away));
        v = quat_rotate(back, vec3_sub(v, speed));
        // Store in the precision of the rows.
        if (single) {
            float *to = (float *)row + (long)s * ROW;
            to[0] = (float)moved.x, to[1] = (float)moved.y, to[2] = (float)moved.z;
            to[4] = (float)v.x, to[5] = (float)v.y, to[6] = (float)v.z;
        } else {
            double *to = (double *)row + (long)s * ROW;
            to[0] = moved.x, to[1] = moved.y, to[2] = moved.z;
            to[4] = v.x, to[5] = v.y, to[6] = v.z;
        }
    }
}

static void move_frame(Rows *rows, void *row)
{
    BaseFrame *frame = rows->frame;
    RigidFrame *rigid = rows->rigid;
    // The rigid motion that the rows contain goes over to the frame.
    rigid_frame_fit(rigid, row);
    const FramePose *pose = &rigid->pose;
    Quat turn = {rigid->rotation[0], rigid->rotation[1], rigid->rotation[2], rigid->rotation[3]};
    Quat back = quat_conjugate(turn);
    Vec3 center = {pose->center[0], pose->center[1], pose->center[2]};
    Vec3 rest = {pose->rest_center[0], pose->rest_center[1], pose->rest_center[2]};
    // A falling frame takes their mean velocity, too.
    Vec3 speed = {0.0, 0.0, 0.0}; // taken over by the frame
    if (rows->fall != NULL)
        speed = (Vec3){pose->velocity[0], pose->velocity[1], pose->velocity[2]};
    // One loop for each precision.
    if (rows->precision == PRECISION_SINGLE)
        move_rows(rows, row, true, back, center, rest, speed);
    else
        move_rows(rows, row, false, back, center, rest, speed);
    if (rows->fall != NULL)
        rows->fall->velocity = vec3_add(rows->fall->velocity, quat_rotate(frame->turn, speed));

    // The frame moves by what the rows have lost.
    Vec3 shift = vec3_sub(center, quat_rotate(turn, rest));
    frame->origin = vec3_add(frame->origin, quat_rotate(frame->turn, shift));
    frame->turn = quat_unit(quat_multiply(frame->turn, turn));
    frame->ticks = 0;
    // The next fit starts from no rotation.
    rigid->rotation[0] = 1.0;
    rigid->rotation[1] = rigid->rotation[2] = rigid->rotation[3] = 0.0;
}

bool rows_follow(Rows *rows, void *row)
{
    BaseFrame *frame = rows->frame;
    frame->ticks++;
    double moved = 0.0; // of one node, the first
    long first = 0;
    while (rows_is_carried(rows, (int)first))
        first++;
    for (int c = 0; c < 3; c++)
        moved += fabs(rows_get(rows, row, first * ROW + c));
    bool far = moved > 0.1 * rows->longest_edge && frame->ticks >= FOLLOW_LEAST;
    if (frame->ticks < FOLLOW_TICKS && !far)
        return false;
    move_frame(rows, row);
    return true;
}

bool rows_are_near(const Rows *rows, double limit)
{
    return is_within(vec3_sub(rows->frame->origin, rows->rest_origin), limit) &&
           is_within(rows_velocity(rows), SPEED_LIMIT);
}

static void stop_frame(Rows *rows)
{
    if (rows->fall != NULL)
        *rows->fall = (FrameFall){0};
}

void rows_stop(Rows *rows, void *row)
{
    stop_frame(rows);
    for (long s = 0; s < rows->count; s++)
        for (int c = 4; c < ROW; c++)
            rows_put(rows, row, s * ROW + c, 0.0);
}

void rows_return_to_rest(Rows *rows, void *row)
{
    // Place and velocity of the frame as at the start.
    stop_frame(rows);
    if (rows->displaced)
        *rows->frame = (BaseFrame){.origin = rows->rest_origin,
                                   .turn = rows->turned ? rows->rest_turn : QUAT_NONE};
    // Displaced rows rest at zero, others at their rest position.
    for (int s = 0; s < rows->count; s++)
        for (int c = 0; c < ROW; c++) {
            double value = !rows->displaced && c < 3 ? rows->rest[s][c] : 0.0;
            rows_put(rows, row, (long)s * ROW + c, value);
        }
}

// --- the fall of all rows ------------------------------------------------------------------------

// A base frame that gravity accelerates in place of its rows. Step thread, but for rows_let_fall.
//
// In single precision g h, added to a velocity in every substep, is rounded in every substep, in
// the same direction as long as the velocity is between the same powers of two, and not alike for
// all nodes: a body falls too fast and begins to spin. Gravity is the same for all nodes, and no
// force inside of the body changes with a velocity that all have: so the frame takes it, with the
// integrator's own stages in double precision, and rows_follow hands over what the rows gather of a
// common velocity by other forces.

void rows_let_fall(Rows *rows, const char *name, Arena *arena, StateList *state)
{
    rows->fall =
        arena_allocate(arena, ARENA_STEP, 1, sizeof *rows->fall, "%s/frame velocity", name);
    // Rare: files of builds without it hold velocities in the world, a frame's of 0.
    state_add_rare(state, &rows->fall->velocity, sizeof rows->fall->velocity, "%s/frame_velocity",
                   name);
}

void frame_drift(Rows *rows, double dt)
{
    FrameMotion *ahead = &rows->fall->ahead;
    ahead->shift = vec3_madd(ahead->shift, dt, rows_velocity(rows));
}

static FrameMotion motion_after(FrameMotion from, double dt, Vec3 velocity, Vec3 acceleration)
{
    return (FrameMotion){vec3_madd(from.shift, dt, velocity),
                         vec3_madd(from.velocity, dt, acceleration)};
}

// As the kernels do with a row (EvaluationRule in integrator.h).
void frame_advance(Rows *rows, const Evaluation *evaluation, double h, Vec3 gravity)
{
    FrameFall *fall = rows->fall;
    // Kicks: velocity first, then the way by the new one.
    if (evaluation->rule == EVALUATION_KICK) {
        fall->ahead.velocity = vec3_madd(fall->ahead.velocity, h, gravity);
        frame_drift(rows, evaluation->advance * h);
        return;
    }
    // RK4: the same sums as those of the rows.
    const Vec3 velocity = rows_velocity(rows);
    if (evaluation->rule == EVALUATION_RK4_FIRST)
        fall->begin = fall->sum = fall->ahead;
    fall->sum = motion_after(fall->sum, evaluation->weight * h, velocity, gravity);
    fall->ahead = evaluation->rule == EVALUATION_RK4_LAST
                      ? fall->sum
                      : motion_after(fall->begin, evaluation->advance * h, velocity, gravity);
}

void frame_end_tick(Rows *rows, bool stays)
{
    FrameFall *fall = rows->fall;
    if (stays) {
        rows->frame->origin = rows_origin(rows);
        fall->velocity = rows_velocity(rows);
    }
    *fall = (FrameFall){.velocity = fall->velocity};
}

// --- copies of all nodes ---

// Nodes to prefetch ahead: slots are scattered, and the tick's tables have displaced them from the
// near cache.
enum { AHEAD = 32 };

static inline __attribute__((always_inline)) void load_four(const void *row, bool single, int at,
                                                            Four *out)
{
    FourSingle v;
    if (single) {
        memcpy(&v, (const float *)row + at, sizeof v);
        *out = __builtin_convertvector(v, Four);
    } else {
        memcpy(out, (const double *)row + at, sizeof *out);
    }
}

// Decisions of the loop below, made once.
typedef struct Kind {
    bool single, displaced, turned; // as in the rows
    bool carried;                   // some are: left out
    bool whole;                     // as in rows_show_store
} Kind;

// Rows slot[first .. last).
static inline __attribute__((always_inline)) void take(const Rows *rows, Kind kind,
                                                       const RowsView *view, const void *row,
                                                       const int *slots, int first, int last,
                                                       float *position, float *velocity)
{
    const size_t real = kind.single ? sizeof(float) : sizeof(double);
    for (long i = first; i < last; i++) {
        const long slot = slots[i], soon = slots[i + AHEAD < last ? i + AHEAD : i];
        // Slots are scattered: fetch ahead.
        if (!(kind.carried && rows_is_carried(rows, (int)soon))) {
            __builtin_prefetch((const char *)row + soon * (long)(ROW * real));
            if (kind.displaced)
                __builtin_prefetch(rows->rest[soon]);
        }
        if (kind.carried && rows_is_carried(rows, (int)slot))
            continue;
        const void *own = (const char *)row + slot * (long)(ROW * real);
        Four x, v;
        load_four(own, kind.single, 0, &x);
        rows_show_place(view, kind.displaced, kind.turned, rows->rest[slot], &x, position + 3 * i,
                        kind.whole);
        // Velocities only where they are asked for.
        if (velocity == NULL)
            continue;
        load_four(own, kind.single, 4, &v);
        rows_show_velocity(view, kind.turned, &v, velocity + 3 * i, kind.whole);
    }
}

// All nodes: the last one separately, because nothing may be written after it.
static inline __attribute__((always_inline)) void take_all(const Rows *rows, Kind kind,
                                                           const void *row, const int *slot,
                                                           int count, float *position,
                                                           float *velocity)
{
    RowsView view;
    rows_view(rows, &view);
    kind.whole = true;
    take(rows, kind, &view, row, slot, 0, count - 1, position, velocity);
    kind.whole = false;
    take(rows, kind, &view, row, slot, count - 1, count, position, velocity);
}

static inline __attribute__((always_inline)) void take_of(const Rows *rows, const void *row,
                                                          const int *slot, int count,
                                                          float *position, float *velocity)
{
    // One copy of the loop for each kind of rows: no decision per node.
    const bool single = rows->precision == PRECISION_SINGLE, carried = rows->carried_end > 0;
#define TAKE(...) take_all(rows, (Kind){__VA_ARGS__}, row, slot, count, position, velocity)
    if (!rows->displaced)
        TAKE(.displaced = false);
    else if (single && rows->turned && carried)
        TAKE(.single = true, .displaced = true, .turned = true, .carried = true);
    else if (single && rows->turned)
        TAKE(.single = true, .displaced = true, .turned = true);
    else if (single)
        TAKE(.single = true, .displaced = true);
    else if (rows->turned && carried)
        TAKE(.displaced = true, .turned = true, .carried = true);
    else if (rows->turned)
        TAKE(.displaced = true, .turned = true);
    else
        TAKE(.displaced = true);
#undef TAKE
}

void rows_snapshot(const Rows *rows, const void *row, const int *slot, int count, float *position,
                   float *velocity)
{
    if (count == 0)
        return;
    if (velocity != NULL)
        take_of(rows, row, slot, count, position, velocity);
    else
        take_of(rows, row, slot, count, position, NULL);
}

void rows_snapshot_rest(const Rows *rows, const int *slot, int count, float *position)
{
    for (long i = 0; i < count; i++) {
        Vec3 x = rows_rest(rows, slot[i]);
        position[3 * i] = (float)x.x;
        position[3 * i + 1] = (float)x.y;
        position[3 * i + 2] = (float)x.z;
    }
}
