// SPDX-License-Identifier: MIT
// A scene as text, read and built in a folder of its own. For one source file of a test: it brings
// the folder, which the test creates and destroys.
#ifndef PLIANT_TESTS_WORLD_RUN_H
#define PLIANT_TESTS_WORLD_RUN_H

#include "scratch_folder.h"
#include "sim_steps.h"

#include "scene/build.h"

typedef struct Run {
    Scene scene;
    World world;
} Run;

// What a status says, without the folder's name.
static inline const char *without_folder(const Status *status)
{
    static char said[512];
    char *folder;
    snprintf(said, sizeof said, "%s", status->text);
    while ((folder = strstr(said, scratch_space.folder)) != NULL) {
        const size_t length = strlen(scratch_space.folder) + 1;
        memmove(folder, folder + length, strlen(folder + length) + 1);
    }
    assert_null(strchr(said, '\n'));
    return said;
}

// Reads a scene; fails the test where it is refused.
static inline void read_scene(const char *text, Scene *scene)
{
    char path[SCRATCH_PATH];
    Status status = {0};
    scratch_write(&scratch_space, "x.cfg", text, strlen(text));
    if (!scene_read(scratch_path(&scratch_space, "x.cfg", path), scene, &status))
        fail_msg("%s", status.text);
}

// Reads and builds a scene; returns what was wrong, without the folder's name, or "".
static inline const char *try_world(World *world, const char *text, const BuildOptions *options)
{
    char path[SCRATCH_PATH];
    Scene scene;
    Status status = {0};
    scratch_write(&scratch_space, "x.cfg", text, strlen(text));
    bool ok = scene_read(scratch_path(&scratch_space, "x.cfg", path), &scene, &status);
    if (ok) {
        ok = world_build(world, &scene, options, &status);
        scene_destroy(&scene);
    }
    assert_int_equal(ok, status.code == STATUS_OK);
    if (!ok)
        assert_int_equal(status.code, STATUS_INVALID);
    return without_folder(&status);
}

static inline void run_create_with(Run *run, const char *text, const BuildOptions *options)
{
    Status status = {0};
    read_scene(text, &run->scene);
    if (!world_build(&run->world, &run->scene, options, &status))
        fail_msg("%s", status.text);
}

static inline void run_create(Run *run, const char *text)
{
    run_create_with(run, text, &(BuildOptions){.isa = "auto", .may_load = true});
}

// The same of a scene as by printf.
__attribute__((format(printf, 2, 3))) static inline void run_format(Run *run, const char *format,
                                                                    ...)
{
    char text[8192];
    va_list list;
    va_start(list, format);
    const int length = vsnprintf(text, sizeof text, format, list);
    va_end(list);
    assert_in_range(length, 0, sizeof text - 1);
    run_create(run, text);
}

static inline void run_destroy(Run *run)
{
    world_destroy(&run->world);
    scene_destroy(&run->scene);
}

// A run of a scene that ends with its block.
#define START_RUN(run, text)                                                                       \
    SCOPED(run_destroy) Run run;                                                                   \
    run_create(&(run), text)

// Of bodies all whose vertices lie outside.
static inline Momentum run_momentum(Run *run)
{
    Momentum sum = {0};
    for (int b = 0; b < sim_body_count(run->world.sim); b++) {
        const Body *body = sim_body(run->world.sim, b);
        for (int i = 0; i < body->surface.node_count; i++) {
            Vec3 x, v;
            if (body->surface.node_face_end[i] <= body->surface.node_face_start[i])
                continue;
            body->ops->read_nodes(body->model, &i, 1, &x, &v);
            momentum_add(&sum, body->surface.node_mass[i], x, v);
        }
    }
    return sum;
}

// Returns where a body's outer nodes are in the mean, by mass [m].
static inline Vec3 middle_of(Run *run, int b)
{
    const Body *body = sim_body(run->world.sim, b);
    Vec3 sum = {0, 0, 0};
    double mass = 0.0;
    for (int i = 0; i < body->surface.node_count; i++) {
        Vec3 x;
        if (body->surface.node_face_end[i] <= body->surface.node_face_start[i])
            continue;
        body->ops->read_nodes(body->model, &i, 1, &x, NULL);
        sum = vec3_madd(sum, body->surface.node_mass[i], x);
        mass += body->surface.node_mass[i];
    }
    return vec3_scale(1.0 / mass, sum);
}

#endif
