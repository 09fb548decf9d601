// SPDX-License-Identifier: MIT
// The thread that writes files calls checkpoint_write; the rest is called once, at load time.

#include "io/checkpoint.h"

#include "base/check.h"
#include "base/fnv.h"
#include "base/log.h"
#include "base/sets.h"
#include "io/hdf.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define CHECKPOINT_FORMAT "pliant-checkpoint"
enum { CHECKPOINT_VERSION = 2, NAME_TEXT = 160, PATH_TEXT = 4096 };

#ifdef PLIANT_WITH_HDF5

// --- the readable part of a body: the state of its nodes, in ascending id ------------------------

typedef struct BodyRows {
    int count;
    int *id;
    Vec3 *position, *velocity; // [m], [m/s]
} BodyRows;

static void create_rows(BodyRows *rows, int count)
{
    size_t size = (size_t)count + 1;
    *rows = (BodyRows){.count = count,
                       .id = calloc(size, sizeof *rows->id),
                       .position = calloc(size, sizeof *rows->position),
                       .velocity = calloc(size, sizeof *rows->velocity)};
    ASSERT(rows->id != NULL && rows->position != NULL && rows->velocity != NULL);
}

static void destroy_rows(BodyRows *rows)
{
    free(rows->id);
    free(rows->position);
    free(rows->velocity);
}

typedef struct IdSlot {
    int id, slot; // id first, for compare_ints
} IdSlot;

// Sorts slots, some of which may be free (id -1), into rows. The caller destroys them.
static void sort_rows(BodyRows *rows, int slots, const int *id, const Vec3 *position,
                      const Vec3 *velocity)
{
    IdSlot *order = calloc((size_t)slots + 1, sizeof *order);
    ASSERT(order != NULL);
    // Live nodes only, in the order of their ids.
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
    sort_rows(rows, count, slots.id, slots.position, slots.velocity);
    destroy_rows(&slots);
}

// True if the body's current state has exactly these rows, bit for bit.
static bool rows_are_shown(const Body *body, const BodyRows *rows)
{
    BodyRows now;
    show(&now, body);
    bool same = same_rows(&now, rows);
    destroy_rows(&now);
    return same;
}

// True if these are the ids of a body whose ids never change.
static bool same_ids(const Body *body, const BodyRows *rows)
{
    BodyRows now;
    show(&now, body);
    bool same = now.count == rows->count &&
                memcmp(now.id, rows->id, (size_t)now.count * sizeof *now.id) == 0;
    destroy_rows(&now);
    return same;
}

// Writes /bodies/<name>/{id, position, velocity}.
static bool write_rows(const HdfFile *file, const Body *body, const BodyRows *rows)
{
    const RowNames names = name_rows(body);
    const hsize_t size[2] = {(hsize_t)rows->count, 3};
    return hdf_write(file, names.id, H5T_NATIVE_INT, 1, size, rows->id, "1") &&
           hdf_write(file, names.position, H5T_NATIVE_DOUBLE, 2, size, rows->position, "m") &&
           hdf_write(file, names.velocity, H5T_NATIVE_DOUBLE, 2, size, rows->velocity, "m/s");
}

// True if the number of nodes in the file is one that the body has or can have.
static bool check_row_count(const HdfFile *file, const Body *body)
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

// Reads the rows; call after check_row_count. Ids must be those of the body, or ascending if its
// mesh changes. The caller destroys the rows, also after a failure.
static bool read_rows(const HdfFile *file, const Body *body, BodyRows *rows)
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

// --- writing -------------------------------------------------------------------------------------

static const char *isa_of(const World *world)
{
    const Body *body = sim_body(world->sim, 0); // every scene has a body
    return body->ops->isa(body->model);
}

static bool write_head(const HdfFile *file, const WorldImage *image, const World *world)
{
    char physics[FNV_TEXT];
    fnv_text(physics, world->physics);
    // What the file is, of which physics, and how far the run had come.
    return hdf_write_text(file, "/", "format", CHECKPOINT_FORMAT) &&
           hdf_write_int(file, "/", "version", CHECKPOINT_VERSION) &&
           hdf_write_text(file, "/", "scene", world->scene_text) &&
           hdf_write_text(file, "/", "created_by", "pliantd " PLIANT_VERSION) &&
           hdf_write_text(file, "/", "physics", physics) &&
           hdf_write(file, "/time", H5T_NATIVE_DOUBLE, 0, NULL, &image->time, "s") &&
           hdf_write(file, "/step", H5T_NATIVE_INT64, 0, NULL, &image->step, "ticks") &&
           hdf_write(file, "/inputs", H5T_NATIVE_INT64, 0, NULL, &image->inputs, "1");
}

static bool write_body(const HdfFile *file, const WorldImage *image, const Body *body, int index)
{
    BodyRows rows;
    sort_rows(&rows, image->node_count[index], image->id[index], image->position[index],
              image->velocity[index]);
    bool ok = write_rows(file, body, &rows);
    destroy_rows(&rows);
    return ok;
}

static bool write_state(const HdfFile *file, const WorldImage *image, const World *world)
{
    const unsigned char *from = image->block;
    // Each array of the state under its own name.
    for (int i = 0; i < world->state.count; i++) {
        const StateArray *array = &world->state.array[i];
        const hsize_t size[1] = {array->bytes};
        char name[NAME_TEXT];
        snprintf(name, sizeof name, "/state/%s", array->name);
        if (!hdf_write(file, name, H5T_NATIVE_UINT8, 1, size, from, "bytes"))
            return false;
        from += array->bytes;
    }
    return hdf_write_text(file, "/state", "isa", isa_of(world));
}

// Refuses an image with numbers that are not finite. The guard excludes such states, but if memory
// was overwritten since, a good file must not be replaced.
static bool is_finite(const char *path, const WorldImage *image, const World *world, Status *status)
{
    for (int i = 0; i < sim_body_count(world->sim); i++)
        for (int k = 0; k < image->node_count[i]; k++)
            if (!vec3_finite(image->position[i][k]) || !vec3_finite(image->velocity[i][k]))
                return status_fail(status, STATUS_FAILED,
                                   "%s: not written: row %d of body %s is not finite", path, k,
                                   sim_body(world->sim, i)->name);
    return true;
}

// Refuses an image that no run could start from, by the same checks as apply_image.
static bool can_start(const char *path, const WorldImage *image, Status *status)
{
    return image->fault == NULL ||
           status_fail(
               status, STATUS_FAILED, "%s: step %lld not written: %s%s no run could continue from",
               path, (long long)image->step, image->fault[0] != '\0' ? "body " : "",
               image->fault[0] != '\0' ? image->fault
                                       : "it holds tools, loads, strokes or attachments that");
}

static bool write_file(const char *path, OutputClaim *claim, const WorldImage *image,
                       const World *world, Status *status)
{
    HdfFile file;
    // A state that is not sound must not replace a good one.
    if (!can_start(path, image, status) || !is_finite(path, image, world, status) ||
        !hdf_create(&file, path, status))
        return false;
    file.claim = claim;
    // The readable part, then the state itself.
    bool ok = write_head(&file, image, world);
    for (int i = 0; i < sim_body_count(world->sim) && ok; i++)
        ok = write_body(&file, image, sim_body(world->sim, i), i);
    ok = ok && write_state(&file, image, world) && hdf_save(&file);
    hdf_close(&file);
    return ok;
}

bool checkpoint_write(const char *path, const WorldImage *image, const World *world, Status *status)
{
    return write_file(path, NULL, image, world, status);
}

bool checkpoint_write_claimed(OutputClaim *claim, const WorldImage *image, const World *world,
                              Status *status)
{
    return write_file(claim->path, claim, image, world, status);
}

bool checkpoint_check_target(const char *path, const World *world, Status *status)
{
    HdfFile file;
    int64_t there = 0;
    const int64_t step = sim_steps(world->sim);
    char physics[FNV_TEXT], text[64];
    // A file of ours, or none: nothing else is replaced.
    if (!hdf_open_target(&file, path, CHECKPOINT_FORMAT, status))
        return false;
    if (file.child == NULL)
        return true;
    // Of the same physics, a later state may be all that is left of a run.
    fnv_text(physics, world->physics);
    bool ok = hdf_read_text(&file, "/", "physics", text, sizeof text) &&
              hdf_read_numbers(&file, "/step", H5T_NATIVE_INT64, 0, &there) &&
              (strcmp(text, physics) != 0 || there <= step ||
               status_fail(status, STATUS_INVALID,
                           "%s: holds step %lld, and a run from step %lld would replace it: go on "
                           "from it (--continue), remove it, or name another file",
                           path, (long long)there, (long long)step));
    hdf_close(&file);
    return ok;
}

// Checks the target again after claiming it: another run may have written there until then.
bool checkpoint_claim(OutputClaim *claim, const char *path, const World *world, Status *status)
{
    char *former = output_former(path);
    // The one before is kept, in a place that must be ours as well.
    bool ok = output_claim(claim, path, HDF_MARK, status) &&
              checkpoint_check_target(path, world, status) &&
              output_check(former, HDF_MARK, status);
    claim->keeps = true;
    free(former);
    return ok;
}

bool checkpoint_is_there(const char *path)
{
    struct stat info;
    return lstat(path, &info) == 0 && !S_ISCHR(info.st_mode) &&
           !(S_ISREG(info.st_mode) && info.st_size == 0);
}

// --- reading -------------------------------------------------------------------------------------

// Checks format, version and scene before any number is read.
static bool check_head(const HdfFile *file, const World *world)
{
    char text[64], physics[FNV_TEXT];
    int version = 0;
    // Format and version first: they decide what the rest means.
    if (!hdf_read_text(file, "/", "format", text, sizeof text))
        return false;
    if (strcmp(text, CHECKPOINT_FORMAT) != 0)
        return hdf_fail(file, "/", "format \"%.40s\" must be \"%s\"", text, CHECKPOINT_FORMAT);
    if (!hdf_read_int(file, "/", "version", &version))
        return false;
    if (version != CHECKPOINT_VERSION)
        return hdf_fail(file, "/", "version %d must be %d", version, CHECKPOINT_VERSION);
    // Sizes next, so that what is read fits, then whether it is the same scene.
    for (int i = 0; i < sim_body_count(world->sim); i++)
        if (!check_row_count(file, sim_body(world->sim, i)))
            return false;
    fnv_text(physics, world->physics);
    if (!hdf_read_text(file, "/", "physics", text, sizeof text))
        return false;
    return strcmp(text, physics) == 0 ||
           hdf_fail(file, "/",
                    "was written for other physics than those of %s (rate, gravity, "
                    "meshes, materials, tools, attachments or loads differ): resume it with the "
                    "scene that it is of",
                    world->scene_path);
}

// Reads the count of inputs. Checkpoints of older builds lack it: it is zero, unless the checkpoint
// was taken in a pause.
static bool read_inputs(const HdfFile *file, WorldImage *image)
{
    image->inputs = 0;
    if (!hdf_exists(file, "/inputs"))
        return true;
    return hdf_read_numbers(file, "/inputs", H5T_NATIVE_INT64, 0, &image->inputs) &&
           (image->inputs >= 0 ||
            hdf_fail(file, "/inputs", "%lld is no number of inputs", (long long)image->inputs));
}

// Reads everything into an image; the caller destroys `rows` [body_count], also after a failure.
static bool read_image(const HdfFile *file, WorldImage *image, BodyRows *rows, const World *world)
{
    // The readable rows of each body, to be compared with its state,
    unsigned char *to = image->block;
    for (int i = 0; i < sim_body_count(world->sim); i++)
        if (!read_rows(file, sim_body(world->sim, i), &rows[i]))
            return false;
    // then the state itself, array by array.
    for (int i = 0; i < world->state.count; i++) {
        const StateArray *array = &world->state.array[i];
        char name[NAME_TEXT];
        snprintf(name, sizeof name, "/state/%s", array->name);
        // Checkpoints of older builds may not have it.
        if (array->rare && !hdf_exists(file, name))
            memset(to, 0, array->bytes);
        else if (!hdf_read_bytes(file, name, array->bytes, to))
            return false;
        to += array->bytes;
    }
    return hdf_read_numbers(file, "/time", H5T_NATIVE_DOUBLE, 0, &image->time) &&
           hdf_read_numbers(file, "/step", H5T_NATIVE_INT64, 0, &image->step) &&
           read_inputs(file, image);
}

// Checks that the current state is the one that the file shows, and that it can be stepped.
static bool check_state(const HdfFile *file, const WorldImage *image, const BodyRows *rows,
                        const World *world)
{
    // Tick, tools and loads, then each body.
    if (sim_steps(world->sim) != image->step)
        return hdf_fail(file, "/step", "%lld does not match the state", (long long)image->step);
    if (!sim_check(world->sim))
        return hdf_fail(file, "/state",
                        "holds tools, loads, strokes, attachments or settings that cannot be");
    for (int i = 0; i < sim_body_count(world->sim); i++) {
        Body *body = sim_body(world->sim, i);
        bool sound = body->ops->check == NULL || body->ops->check(body->model);
        char name[NAME_TEXT];
        snprintf(name, sizeof name, "/bodies/%s", body->name);
        // For a mesh that changes check the state first: only a sound one has nodes to compare.
        if ((sound || !body_changes(body)) && !rows_are_shown(body, &rows[i]))
            return hdf_fail(file, name, "does not match the state");
        if (!sound)
            return hdf_fail(file, name, "is beyond what can be simulated");
    }
    return true;
}

// Replaces the world's state, or leaves it unchanged on failure.
static bool apply_image(const HdfFile *file, const WorldImage *image, const BodyRows *rows,
                        World *world)
{
    void *before = malloc(state_bytes(&world->state) + 1);
    ASSERT(before != NULL);
    // Keep the present state until the new one has passed all checks.
    state_copy_out(&world->state, before);
    state_copy_in(&world->state, image->block);
    sim_restored(world->sim);
    bool ok = check_state(file, image, rows, world);
    // Otherwise go back to it.
    if (!ok) {
        state_copy_in(&world->state, before);
        sim_restored(world->sim);
    }
    if (ok) {
        world->inputs_step = image->step;
        world->inputs = image->inputs;
    }
    free(before);
    return ok;
}

bool checkpoint_read(const char *path, World *world, Status *status)
{
    HdfFile file;
    if (!hdf_open_sealed(&file, path, status))
        return false;
    Arena arena = {0};
    // Everything is read before anything of the world changes.
    WorldImage image;
    world_image_reserve(&image, &arena, world);
    BodyRows *rows = calloc((size_t)sim_body_count(world->sim) + 1, sizeof *rows);
    ASSERT(rows != NULL);
    char isa[64];
    bool ok = check_head(&file, world) && read_image(&file, &image, rows, world) &&
              hdf_read_text(&file, "/state", "isa", isa, sizeof isa) && hdf_alive(&file) &&
              apply_image(&file, &image, rows, world);
    for (int i = 0; i < sim_body_count(world->sim); i++)
        destroy_rows(&rows[i]);
    free(rows);
    // Other kernels may round otherwise: the run is no longer bit-identical.
    if (ok && strcmp(isa, isa_of(world)) != 0)
        log_line(LOG_INFO, "%s: was written with %.32s kernels, the run goes on with %s", path, isa,
                 isa_of(world));
    arena_destroy(&arena);
    hdf_close(&file);
    return ok;
}

bool checkpoint_fall_back(const char *path, World *world, Status *status)
{
    char *former = output_former(path), aside[PATH_TEXT];
    OutputClaim claim;
    Status other = {0};
    snprintf(aside, sizeof aside, "%s.refused", path);
    // Only what no other run writes, and nothing that is not ours, is moved out of the way.
    bool ok = strlen(path) < sizeof aside - sizeof ".refused" && checkpoint_is_there(former) &&
              output_check(aside, HDF_MARK, &other) && output_claim(&claim, path, HDF_MARK, &other);
    if (ok) {
        ok = checkpoint_read(former, world, &other) && rename(path, aside) == 0;
        output_release(&claim);
    }
    if (ok) {
        log_line(LOG_ERROR,
                 "%s; it is %s now, and the run goes on from the checkpoint before it, %s",
                 status->text, aside, former);
        *status = (Status){0};
    }
    free(former);
    return ok;
}

#else

bool checkpoint_fall_back(const char *path, World *world, Status *status)
{
    (void)path, (void)world, (void)status;
    return false;
}

bool checkpoint_check_target(const char *path, const World *world, Status *status)
{
    (void)world;
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

bool checkpoint_claim(OutputClaim *claim, const char *path, const World *world, Status *status)
{
    *claim = (OutputClaim){.fd = -1};
    return checkpoint_check_target(path, world, status);
}

bool checkpoint_write_claimed(OutputClaim *claim, const WorldImage *image, const World *world,
                              Status *status)
{
    return checkpoint_write(claim->path, image, world, status);
}

bool checkpoint_is_there(const char *path)
{
    (void)path;
    return false;
}

bool checkpoint_write(const char *path, const WorldImage *image, const World *world, Status *status)
{
    (void)image, (void)world;
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

bool checkpoint_read(const char *path, World *world, Status *status)
{
    (void)world;
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

#endif
