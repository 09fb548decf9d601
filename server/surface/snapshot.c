// What the bus and the recording take of all nodes between two ticks: model_read_row without its
// questions for each node, since every microsecond here is one of the tick's. Step thread.
#include "surface/model.h"

#include <string.h>

// Nodes ahead to prefetch: in slots they lie scattered, and the tick's tables have driven their
// places out of the near cache.
enum { AHEAD = 32 };

// Four numbers at a time, as rows hold them; the fourth is of no use. Passed by address: by value
// they would need AVX.
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

// `whole` also writes the number behind the three, which is cheaper.
static inline void store(float *to, const Four *v, bool whole)
{
    FourSingle single = __builtin_convertvector(*v, FourSingle);
    memcpy(to, &single, whole ? sizeof single : 3 * sizeof *to);
}

static inline void turn(const Four column[3], Four *v)
{
    *v = column[0] * (*v)[0] + column[1] * (*v)[1] + column[2] * (*v)[2];
}

// Nodes first to last - 1 of the present rows, in mesh order. `single` and `floating` as in the
// model, `whole` as in store.
static inline __attribute__((always_inline)) void take(const SurfaceModel *model, bool single,
                                                       bool floating, bool whole, int first,
                                                       int last, float *position, float *velocity)
{
    const void *rows = model->rows[model->current];
    const int *slots = model->slot;
    const size_t real = single ? sizeof(float) : sizeof(double);
    Four origin = {0.0}, column[3] = {{0.0}};
    if (single) {
        const BaseFrame *frame = model->frame;
        origin = (Four){frame->origin.x, frame->origin.y, frame->origin.z};
        for (int c = 0; c < 3 && floating; c++) {
            Vec3 axis = quat_rotate(frame->turn, (Vec3){c == 0, c == 1, c == 2});
            column[c] = (Four){axis.x, axis.y, axis.z};
        }
    }
    for (long i = first; i < last; i++) {
        const long slot = slots[i], soon = slots[i + AHEAD < last ? i + AHEAD : i];
        __builtin_prefetch((const char *)rows + soon * (long)(ROW * real));
        if (single)
            __builtin_prefetch(model->place[soon]);
        const void *row = (const char *)rows + slot * (long)(ROW * real);
        Four x, v;
        load(row, single, 0, &x);
        if (single) {
            const double *place = model->place[slot];
            x += (Four){place[0], place[1], place[2]};
            if (floating)
                turn(column, &x);
            x += origin;
        }
        store(position + 3 * i, &x, whole);
        if (velocity == NULL)
            continue;
        load(row, single, 4, &v);
        if (floating)
            turn(column, &v);
        store(velocity + 3 * i, &v, whole);
    }
}

// All nodes: the last alone, because nothing may be written behind it.
static inline __attribute__((always_inline)) void
take_all(const SurfaceModel *model, bool single, bool floating, float *position, float *velocity)
{
    const int last = model->node_count - 1;
    take(model, single, floating, true, 0, last, position, velocity);
    take(model, single, floating, false, last, last + 1, position, velocity);
}

static inline __attribute__((always_inline)) void take_of(const SurfaceModel *model,
                                                          float *position, float *velocity)
{
    if (model->precision == PRECISION_DOUBLE)
        take_all(model, false, false, position, velocity);
    else if (model->floating)
        take_all(model, true, true, position, velocity);
    else
        take_all(model, true, false, position, velocity);
}

void model_snapshot(const SurfaceModel *model, float *position, float *velocity)
{
    if (velocity != NULL)
        take_of(model, position, velocity);
    else
        take_of(model, position, NULL);
}
