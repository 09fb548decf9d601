// A scene as text, read and built in a folder of its own. For one source file of a test: it brings
// the folder, which the test creates and destroys.
#ifndef PLIANT_TESTS_WORLD_RUN_H
#define PLIANT_TESTS_WORLD_RUN_H

#include "scratch.h"

#include "scene/build.h"

#include <string.h>

static Scratch scratch;

typedef struct Run {
    Scene scene;
    World world;
} Run;

static inline void run_create(Run *run, const char *text)
{
    char path[SCRATCH_PATH];
    Status status = {0};
    const BuildOptions options = {.isa = "auto", .may_load = true};
    scratch_write(&scratch, "x.cfg", text, strlen(text));
    bool ok = scene_read(scratch_path(&scratch, "x.cfg", path), &run->scene, &status) &&
              world_build(&run->world, &run->scene, &options, &status);
    if (!ok)
        print_error("%s\n", status.text);
    assert_true(ok);
}

static inline void run_destroy(Run *run)
{
    world_destroy(&run->world);
    scene_destroy(&run->scene);
}

static inline int run_begin(void **unused)
{
    (void)unused;
    return scratch_create(&scratch);
}

static inline int run_end(void **unused)
{
    (void)unused;
    scratch_destroy(&scratch);
    return 0;
}

#endif
