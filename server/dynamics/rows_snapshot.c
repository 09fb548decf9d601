// Copies all nodes for the bus and the recording between two ticks: rows_read without its decisions
// per node, since every microsecond here is one of the tick's. Step thread.
#include "dynamics/rows.h"

#include <string.h>

// Nodes to prefetch ahead: slots are scattered, and the tick's tables have displaced them from the
// near cache.
enum { AHEAD = 32 };

// Four numbers at a time, as in rows; the fourth is unused. Passed by address: by value they would
// need AVX.
typedef double Four __attribute__((vector_size(4 * sizeof(double))));
typedef float FourSingle __attribute__((vector_size(4 * sizeof(float))));

static inline void load(const void *row, bool single, int at, Four *out)
{
    FourSingle v;
    if (single) {
        memcpy(&v, (const float *)row + at, sizeof v);
        *out = __builtin_convertvector(v, Four);
    } else {
        memcpy(out, (const double *)row + at, sizeof *out);
    }
}

// `whole` also writes the number after the three, which is cheaper.
static inline void store(float *to, const Four *v, bool whole)
{
    FourSingle single = __builtin_convertvector(*v, FourSingle);
    memcpy(to, &single, whole ? sizeof single : 3 * sizeof *to);
}

static inline void turn(const Four column[3], Four *v)
{
    *v = column[0] * (*v)[0] + column[1] * (*v)[1] + column[2] * (*v)[2];
}

// Decisions of the loop below, made once.
typedef struct Kind {
    bool single, displaced, turned; // as in the rows
    bool whole;                     // as in store
} Kind;

// Rows slot[first .. last).
static inline __attribute__((always_inline)) void take(const Rows *rows, Kind kind, const void *row,
                                                       const int *slots, int first, int last,
                                                       float *position, float *velocity)
{
    const size_t real = kind.single ? sizeof(float) : sizeof(double);
    Four origin = {0.0}, speed = {0.0}, column[3] = {{0.0}};
    // The frame's motion, once for all nodes.
    if (kind.displaced) {
        const BaseFrame *frame = rows->frame;
        const Vec3 v = rows_velocity(rows);
        origin = (Four){frame->origin.x, frame->origin.y, frame->origin.z};
        speed = (Four){v.x, v.y, v.z};
        for (int c = 0; c < 3 && kind.turned; c++) {
            Vec3 axis = quat_rotate(frame->turn, (Vec3){c == 0, c == 1, c == 2});
            column[c] = (Four){axis.x, axis.y, axis.z};
        }
    }
    for (long i = first; i < last; i++) {
        const long slot = slots[i], soon = slots[i + AHEAD < last ? i + AHEAD : i];
        // Slots are scattered: fetch ahead.
        __builtin_prefetch((const char *)row + soon * (long)(ROW * real));
        if (kind.displaced)
            __builtin_prefetch(rows->rest[soon]);
        const void *own = (const char *)row + slot * (long)(ROW * real);
        Four x, v;
        load(own, kind.single, 0, &x);
        if (kind.displaced) {
            const double *rest = rows->rest[slot];
            x += (Four){rest[0], rest[1], rest[2]};
            if (kind.turned)
                turn(column, &x);
            x += origin;
        }
        store(position + 3 * i, &x, kind.whole);
        if (velocity == NULL)
            continue;
        load(own, kind.single, 4, &v);
        if (kind.turned) {
            turn(column, &v);
            v += speed;
        }
        store(velocity + 3 * i, &v, kind.whole);
    }
}

// All nodes: the last one separately, because nothing may be written after it.
static inline __attribute__((always_inline)) void take_all(const Rows *rows, Kind kind,
                                                           const void *row, const int *slot,
                                                           int count, float *position,
                                                           float *velocity)
{
    const int last = count - 1;
    kind.whole = true;
    take(rows, kind, row, slot, 0, last, position, velocity);
    kind.whole = false;
    take(rows, kind, row, slot, last, last + 1, position, velocity);
}

static inline __attribute__((always_inline)) void take_of(const Rows *rows, const void *row,
                                                          const int *slot, int count,
                                                          float *position, float *velocity)
{
    const bool single = rows->precision == PRECISION_SINGLE;
    if (!rows->displaced)
        take_all(rows, (Kind){0}, row, slot, count, position, velocity);
    else if (single && rows->turned)
        take_all(rows, (Kind){.single = true, .displaced = true, .turned = true}, row, slot, count,
                 position, velocity);
    else if (single)
        take_all(rows, (Kind){.single = true, .displaced = true}, row, slot, count, position,
                 velocity);
    else if (rows->turned)
        take_all(rows, (Kind){.displaced = true, .turned = true}, row, slot, count, position,
                 velocity);
    else
        take_all(rows, (Kind){.displaced = true}, row, slot, count, position, velocity);
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
