// Checkpoints: one copy of everything that changes, taken between two ticks and written at leisure.
// checkpoint_take is called by the step thread and only copies; checkpoint_write by the thread that
// writes files; the rest once, at load.
#include "files/checkpoint.h"

#include "base/check.h"
#include "base/log.h"
#include "files/fnv.h"
#include "files/hdf.h"
#include "files/physics_hash.h"

#include <stdlib.h>
#include <string.h>

#define CHECKPOINT_FORMAT "pliant-checkpoint"
enum { CHECKPOINT_VERSION = 1, NAME_TEXT = 160 };

static void read_body(const World *world, int index, Vec3 *position, Vec3 *velocity)
{
    const Body *body = sim_body(world->sim, index);
    body->ops->read_state(body->model, position, velocity);
}

static void reserve(CheckpointImage *image, Arena *arena, const World *world)
{
    size_t bodies = (size_t)world->mesh_count;
    *image = (CheckpointImage){0};
    image->block =
        arena_allocate(arena, ARENA_OUTPUT, state_bytes(&world->state), 1, "checkpoint/state");
    image->position = arena_allocate(arena, ARENA_OUTPUT, bodies, sizeof *image->position,
                                     "checkpoint/positions");
    image->velocity = arena_allocate(arena, ARENA_OUTPUT, bodies, sizeof *image->velocity,
                                     "checkpoint/velocities");
    for (int i = 0; i < world->mesh_count; i++) {
        const char *name = sim_body(world->sim, i)->name;
        size_t nodes = (size_t)world->mesh[i].node_count;
        image->position[i] = arena_allocate(arena, ARENA_OUTPUT, nodes, sizeof(Vec3),
                                            "checkpoint/%s/position", name);
        image->velocity[i] = arena_allocate(arena, ARENA_OUTPUT, nodes, sizeof(Vec3),
                                            "checkpoint/%s/velocity", name);
    }
}

void checkpoint_reserve(CheckpointImage *image, World *world)
{
    reserve(image, &world->arena, world);
}

void checkpoint_take(CheckpointImage *image, const World *world)
{
    state_copy_out(&world->state, image->block);
    for (int i = 0; i < world->mesh_count; i++)
        read_body(world, i, image->position[i], image->velocity[i]);
    image->time = sim_time(world->sim);
    image->step = sim_steps(world->sim);
}

#ifdef PLIANT_WITH_HDF5

static const char *isa_of(const World *world)
{
    const Body *body = sim_body(world->sim, 0); // every scene has a body
    return body->ops->isa(body->model);
}

static bool write_head(const HdfFile *file, const CheckpointImage *image, const World *world,
                       const Scene *scene)
{
    char physics[FNV_TEXT];
    fnv_text(physics, physics_hash(scene, world));
    return hdf_write_text(file, "/", "format", CHECKPOINT_FORMAT) &&
           hdf_write_int(file, "/", "version", CHECKPOINT_VERSION) &&
           hdf_write_text(file, "/", "scene", scene->text) &&
           hdf_write_text(file, "/", "created_by", "pliantd " PLIANT_VERSION) &&
           hdf_write_text(file, "/", "physics", physics) &&
           hdf_write(file, "/time", H5T_NATIVE_DOUBLE, 0, NULL, &image->time, "s") &&
           hdf_write(file, "/step", H5T_NATIVE_INT64, 0, NULL, &image->step, "ticks");
}

static bool write_body(const HdfFile *file, const CheckpointImage *image, const World *world,
                       int index)
{
    const TriMesh *mesh = &world->mesh[index];
    const char *name = sim_body(world->sim, index)->name;
    const hsize_t size[2] = {(hsize_t)mesh->node_count, 3};
    char id[NAME_TEXT], position[NAME_TEXT], velocity[NAME_TEXT];
    snprintf(id, sizeof id, "/bodies/%s/id", name);
    snprintf(position, sizeof position, "/bodies/%s/position", name);
    snprintf(velocity, sizeof velocity, "/bodies/%s/velocity", name);
    return hdf_write(file, id, H5T_NATIVE_INT, 1, size, mesh->file_index, "1") &&
           hdf_write(file, position, H5T_NATIVE_DOUBLE, 2, size, image->position[index], "m") &&
           hdf_write(file, velocity, H5T_NATIVE_DOUBLE, 2, size, image->velocity[index], "m/s");
}

static bool write_state(const HdfFile *file, const CheckpointImage *image, const World *world)
{
    const unsigned char *from = image->block;
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

bool checkpoint_write(const char *path, const CheckpointImage *image, const World *world,
                      const Scene *scene, Status *status)
{
    HdfFile file;
    if (!hdf_create(&file, path, status))
        return false;
    bool ok = write_head(&file, image, world, scene);
    for (int i = 0; i < world->mesh_count && ok; i++)
        ok = write_body(&file, image, world, i);
    ok = ok && write_state(&file, image, world) && hdf_save(&file);
    hdf_close(&file);
    return ok;
}

// Format, version and scene: what a file must be before any of its numbers is looked at.
static bool check_head(const HdfFile *file, const World *world, const Scene *scene)
{
    char text[64], physics[FNV_TEXT];
    int version = 0;
    if (!hdf_read_text(file, "/", "format", text, sizeof text))
        return false;
    if (strcmp(text, CHECKPOINT_FORMAT) != 0)
        return hdf_fail(file, "/", "format \"%.40s\" must be \"%s\"", text, CHECKPOINT_FORMAT);
    if (!hdf_read_int(file, "/", "version", &version))
        return false;
    if (version != CHECKPOINT_VERSION)
        return hdf_fail(file, "/", "version %d must be %d", version, CHECKPOINT_VERSION);
    for (int i = 0; i < world->mesh_count; i++) {
        char name[NAME_TEXT];
        snprintf(name, sizeof name, "/bodies/%s/position", sim_body(world->sim, i)->name);
        int64_t count = hdf_count_vectors(file, name);
        if (count < 0)
            return false;
        if (count != world->mesh[i].node_count)
            return hdf_fail(file, name, "has %lld rows, the body %d nodes", (long long)count,
                            world->mesh[i].node_count);
    }
    fnv_text(physics, physics_hash(scene, world));
    if (!hdf_read_text(file, "/", "physics", text, sizeof text))
        return false;
    return strcmp(text, physics) == 0 ||
           hdf_fail(file, "/",
                    "was written for other physics than those of %s (rate, gravity, "
                    "meshes, materials, tools or loads differ)",
                    scene->path);
}

static bool read_body_rows(const HdfFile *file, const CheckpointImage *image, const World *world,
                           int index)
{
    const TriMesh *mesh = &world->mesh[index];
    const char *name = sim_body(world->sim, index)->name;
    size_t nodes = (size_t)mesh->node_count;
    char id[NAME_TEXT], position[NAME_TEXT], velocity[NAME_TEXT];
    snprintf(id, sizeof id, "/bodies/%s/id", name);
    snprintf(position, sizeof position, "/bodies/%s/position", name);
    snprintf(velocity, sizeof velocity, "/bodies/%s/velocity", name);
    int *ids = calloc(nodes + 1, sizeof *ids);
    ASSERT(ids != NULL);
    bool ok = hdf_read_numbers(file, id, H5T_NATIVE_INT, nodes, ids) &&
              (memcmp(ids, mesh->file_index, nodes * sizeof *ids) == 0 ||
               hdf_fail(file, id, "differ from the nodes of the mesh")) &&
              hdf_read_vectors(file, position, mesh->node_count, image->position[index]) &&
              hdf_read_vectors(file, velocity, mesh->node_count, image->velocity[index]);
    free(ids);
    return ok;
}

static bool read_image(const HdfFile *file, CheckpointImage *image, const World *world)
{
    unsigned char *to = image->block;
    for (int i = 0; i < world->mesh_count; i++)
        if (!read_body_rows(file, image, world, i))
            return false;
    for (int i = 0; i < world->state.count; i++) {
        const StateArray *array = &world->state.array[i];
        char name[NAME_TEXT];
        snprintf(name, sizeof name, "/state/%s", array->name);
        if (!hdf_read_bytes(file, name, array->bytes, to))
            return false;
        to += array->bytes;
    }
    return hdf_read_numbers(file, "/time", H5T_NATIVE_DOUBLE, 0, &image->time) &&
           hdf_read_numbers(file, "/step", H5T_NATIVE_INT64, 0, &image->step);
}

// Whether the state now in force is the one that the file shows, and one that can be stepped on.
static bool check_state(const HdfFile *file, const CheckpointImage *image, const World *world)
{
    if (sim_steps(world->sim) != image->step)
        return hdf_fail(file, "/step", "%lld does not match the state", (long long)image->step);
    bool ok = true;
    for (int i = 0; i < world->mesh_count && ok; i++) {
        Body *body = sim_body(world->sim, i);
        size_t nodes = (size_t)world->mesh[i].node_count, bytes = nodes * sizeof(Vec3);
        Vec3 *row = calloc(2 * nodes + 1, sizeof *row);
        ASSERT(row != NULL);
        read_body(world, i, row, row + nodes);
        char name[NAME_TEXT];
        snprintf(name, sizeof name, "/bodies/%s", body->name);
        if (memcmp(row, image->position[i], bytes) != 0 ||
            memcmp(row + nodes, image->velocity[i], bytes) != 0)
            ok = hdf_fail(file, name, "does not match the state");
        else if (body->ops->check != NULL && !body->ops->check(body->model))
            ok = hdf_fail(file, name, "is beyond what can be simulated");
        free(row);
    }
    return ok;
}

// Replaces the world's state, or leaves it as it was.
static bool apply_image(const HdfFile *file, const CheckpointImage *image, World *world)
{
    void *before = malloc(state_bytes(&world->state) + 1);
    ASSERT(before != NULL);
    state_copy_out(&world->state, before);
    state_copy_in(&world->state, image->block);
    bool ok = check_state(file, image, world);
    if (!ok)
        state_copy_in(&world->state, before);
    free(before);
    return ok;
}

bool checkpoint_read(const char *path, World *world, const Scene *scene, Status *status)
{
    HdfFile file;
    if (!hdf_check_seal(path, status) || !hdf_open(&file, path, status))
        return false;
    Arena arena = {0};
    CheckpointImage image;
    reserve(&image, &arena, world);
    char isa[64];
    bool ok = check_head(&file, world, scene) && read_image(&file, &image, world) &&
              hdf_read_text(&file, "/state", "isa", isa, sizeof isa) &&
              apply_image(&file, &image, world);
    if (ok && strcmp(isa, isa_of(world)) != 0)
        log_line(LOG_INFO, "%s: was written with %.32s kernels, the run goes on with %s", path, isa,
                 isa_of(world));
    arena_destroy(&arena);
    hdf_close(&file);
    return ok;
}

#else

bool checkpoint_write(const char *path, const CheckpointImage *image, const World *world,
                      const Scene *scene, Status *status)
{
    (void)image, (void)world, (void)scene;
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

bool checkpoint_read(const char *path, World *world, const Scene *scene, Status *status)
{
    (void)world, (void)scene;
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

#endif
