// SPDX-License-Identifier: MIT
// Checkpoints of a world as files of the scratch folder.
#ifndef PLIANT_TESTS_KEPT_WORLD_H
#define PLIANT_TESTS_KEPT_WORLD_H

#include "test.h"
#include "scratch_folder.h"

#include "io/checkpoint.h"
#include "scene/build.h"

static inline void world_save(World *world, const char *name)
{
    Status status = {0};
    WorldImage image;
    world_image_reserve(&image, &world->arena, world);
    world_image_take(&image, world);
    expect_ok(checkpoint_write(scratch_at(name), &image, world, &status), status);
}

// Returns what was wrong, "" if nothing, without the folder's name.
static inline const char *world_load(World *world, const char *name)
{
    static char said[512];
    Status status = {0};
    const bool ok = checkpoint_read(scratch_at(name), world, &status);
    assert_int_equal(ok, status.code == STATUS_OK);
    snprintf(said, sizeof said, "%s", ok ? "" : status.text + strlen(scratch_space.folder) + 1);
    assert_null(strchr(said, '\n'));
    return said;
}

#endif
