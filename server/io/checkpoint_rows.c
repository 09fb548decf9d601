#include "io/checkpoint_rows.h"

#include "base/check.h"
#include "base/compare.h"

#include <stdlib.h>
#include <string.h>

#ifdef PLIANT_WITH_HDF5
enum { NAME_TEXT = 160 };

static void create_rows(BodyRows *rows, int count)
{
    size_t size = (size_t)count + 1;
    *rows = (BodyRows){.count = count,
                       .id = calloc(size, sizeof *rows->id),
                       .position = calloc(size, sizeof *rows->position),
                       .velocity = calloc(size, sizeof *rows->velocity)};
    ASSERT(rows->id != NULL && rows->position != NULL && rows->velocity != NULL);
}

void checkpoint_rows_destroy(BodyRows *rows)
{
    free(rows->id);
    free(rows->position);
    free(rows->velocity);
}

typedef struct IdSlot {
    int id, slot; // id first, for compare_ints
} IdSlot;

void checkpoint_rows_sort(BodyRows *rows, int slots, const int *id, const Vec3 *position,
                          const Vec3 *velocity)
{
    IdSlot *order = calloc((size_t)slots + 1, sizeof *order);
    ASSERT(order != NULL);
    int count = 0;
    for (int i = 0; i < slots; i++)
        if (id[i] >= 0)
            order[count++] = (IdSlot){id[i], i};
    qsort(order, (size_t)count, sizeof *order, compare_ints);
    create_rows(rows, count);
    for (int i = 0; i < count; i++) {
        rows->id[i] = order[i].id;
        rows->position[i] = position[order[i].slot];
        rows->velocity[i] = velocity[order[i].slot];
    }
    free(order);
}

static bool same_rows(const BodyRows *a, const BodyRows *b)
{
    size_t count = (size_t)a->count;
    return a->count == b->count && memcmp(a->id, b->id, count * sizeof *a->id) == 0 &&
           memcmp(a->position, b->position, count * sizeof *a->position) == 0 &&
           memcmp(a->velocity, b->velocity, count * sizeof *a->velocity) == 0;
}

// Names of a body's data sets.
typedef struct RowNames {
    char id[NAME_TEXT], position[NAME_TEXT], velocity[NAME_TEXT];
} RowNames;

static RowNames name_rows(const Body *body)
{
    RowNames names;
    snprintf(names.id, NAME_TEXT, "/bodies/%s/id", body->name);
    snprintf(names.position, NAME_TEXT, "/bodies/%s/position", body->name);
    snprintf(names.velocity, NAME_TEXT, "/bodies/%s/velocity", body->name);
    return names;
}

// Takes the rows of the current state; the caller destroys them.
static void show(BodyRows *rows, const Body *body)
{
    BodyRows slots;
    create_rows(&slots, body->state_capacity);
    int count = body->ops->read_state(body->model, slots.id, slots.position, slots.velocity);
    checkpoint_rows_sort(rows, count, slots.id, slots.position, slots.velocity);
    checkpoint_rows_destroy(&slots);
}

bool checkpoint_rows_shown(const Body *body, const BodyRows *rows)
{
    BodyRows now;
    show(&now, body);
    bool same = same_rows(&now, rows);
    checkpoint_rows_destroy(&now);
    return same;
}

// True if these are the ids of a body whose ids never change.
static bool same_ids(const Body *body, const BodyRows *rows)
{
    BodyRows now;
    show(&now, body);
    bool same = now.count == rows->count &&
                memcmp(now.id, rows->id, (size_t)now.count * sizeof *now.id) == 0;
    checkpoint_rows_destroy(&now);
    return same;
}

bool checkpoint_rows_write(const HdfFile *file, const Body *body, const BodyRows *rows)
{
    const RowNames names = name_rows(body);
    const hsize_t size[2] = {(hsize_t)rows->count, 3};
    return hdf_write(file, names.id, H5T_NATIVE_INT, 1, size, rows->id, "1") &&
           hdf_write(file, names.position, H5T_NATIVE_DOUBLE, 2, size, rows->position, "m") &&
           hdf_write(file, names.velocity, H5T_NATIVE_DOUBLE, 2, size, rows->velocity, "m/s");
}

bool checkpoint_rows_check_count(const HdfFile *file, const Body *body)
{
    const RowNames names = name_rows(body);
    int64_t count = hdf_count_vectors(file, names.position);
    bool changes = body_changes(body);
    int most = body->state_capacity;
    if (count < 0)
        return false;
    return (count == most || (changes && count > 0 && count < most)) ||
           hdf_fail(file, names.position, "has %lld rows, the body %s%d nodes", (long long)count,
                    changes ? "at most " : "", most);
}

static bool ascend(const int *id, int count)
{
    for (int i = 0; i < count; i++)
        if (id[i] <= (i > 0 ? id[i - 1] : -1))
            return false;
    return true;
}

bool checkpoint_rows_read(const HdfFile *file, const Body *body, BodyRows *rows)
{
    const RowNames names = name_rows(body);
    int64_t count = hdf_count_vectors(file, names.position);
    if (count < 0)
        return false;
    create_rows(rows, (int)count);
    if (!hdf_read_numbers(file, names.id, H5T_NATIVE_INT, (size_t)count, rows->id))
        return false;
    // The state decides which nodes a changing mesh has.
    bool fits = body_changes(body) ? ascend(rows->id, rows->count) : same_ids(body, rows);
    return (fits || hdf_fail(file, names.id, "differ from the nodes of the mesh")) &&
           hdf_read_vectors(file, names.position, count, rows->position) &&
           hdf_read_vectors(file, names.velocity, count, rows->velocity);
}
#endif
