// SPDX-License-Identifier: MIT
// Texts read as scene files, and what is said of them. For one source file of a test: it brings the
// folder that they are written to, which the test creates and destroys.
#ifndef PLIANT_TESTS_SCENE_TEXT_H
#define PLIANT_TESTS_SCENE_TEXT_H

#include "scratch.h"

#include "scene/scene_parts.h"

#include <string.h>

#define BODY "bodies = ( { name = \"a\"; mesh = { generator = \"uv_sphere\"; }; } );\n"

static Scratch scratch;

// Reads a text as scene file; returns what was wrong, "" if nothing, without the folder's name.
static inline const char *read_as_scene(const char *text, Scene *scene)
{
    static char said[512];
    char path[SCRATCH_PATH];
    Status status = {0};
    scratch_write(&scratch, "x.cfg", text, strlen(text));
    bool ok = scene_read(scratch_path(&scratch, "x.cfg", path), scene, &status);
    assert_int_equal(ok, status.code == STATUS_OK);
    if (!ok)
        assert_int_equal(status.code, STATUS_INVALID);
    size_t folder = strlen(scratch.folder) + 1;
    bool own = strncmp(status.text, scratch.folder, folder - 1) == 0;
    snprintf(said, sizeof said, "%s", status.text + (own ? folder : 0));
    assert_null(strchr(said, '\n'));
    return said;
}

static inline void expect_error(const char *text, const char *message)
{
    Scene scene;
    assert_string_equal(read_as_scene(text, &scene), message);
}

static inline int scene_text_begin(void **unused)
{
    (void)unused;
    return scratch_create(&scratch);
}

static inline int scene_text_end(void **unused)
{
    (void)unused;
    scratch_destroy(&scratch);
    return 0;
}

#endif
