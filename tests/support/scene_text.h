// SPDX-License-Identifier: MIT
// Texts read as scene files, and what is said of them. For one source file of a test: it brings the
// folder that they are written to, which the test creates and destroys.
#ifndef PLIANT_TESTS_SCENE_TEXT_H
#define PLIANT_TESTS_SCENE_TEXT_H

#include "scratch_folder.h"

#include "scene/scene_parts.h"

#define BODY "bodies = ( { name = \"a\"; mesh = { generator = \"uv_sphere\"; }; } );\n"

// Reads a text as scene file; returns what was wrong, "" if nothing, without the folder's name.
static inline const char *read_as_scene(const char *text, Scene *scene)
{
    static char said[512];
    char path[SCRATCH_PATH];
    Status status = {0};
    scratch_write(&scratch_space, "x.cfg", text, strlen(text));
    bool ok = scene_read(scratch_path(&scratch_space, "x.cfg", path), scene, &status);
    assert_int_equal(ok, status.code == STATUS_OK);
    if (!ok)
        assert_int_equal(status.code, STATUS_INVALID);
    size_t folder = strlen(scratch_space.folder) + 1;
    bool own = strncmp(status.text, scratch_space.folder, folder - 1) == 0;
    snprintf(said, sizeof said, "%s", status.text + (own ? folder : 0));
    assert_null(strchr(said, '\n'));
    return said;
}

static inline void expect_error(const char *text, const char *message)
{
    Scene scene;
    assert_string_equal(read_as_scene(text, &scene), message);
}

// A scene that is wrong, and what is said of it behind the file's name and a colon.
typedef struct WrongScene {
    const char *text, *error;
} WrongScene;

// A row that fails is printed with its text.
static inline void expect_errors(const WrongScene *row, size_t count)
{
    int wrong = 0;
    for (size_t i = 0; i < count; i++) {
        Scene scene;
        const char *said = read_as_scene(row[i].text, &scene);
        if (strncmp(said, "x.cfg:", 6) == 0 && strcmp(said + 6, row[i].error) == 0)
            continue;
        print_error("%s\n  says '%s', expected 'x.cfg:%s'\n", row[i].text, said, row[i].error);
        wrong++;
    }
    assert_int_equal(wrong, 0);
}

// Returns the scene of a text that is right, until the next one is read or the file's tests end.
static inline Scene *read_valid(const char *text)
{
    static Scene scene;
    scene_destroy(&scene);
    scene = (Scene){0};
    assert_string_equal(read_as_scene(text, &scene), "");
    return &scene;
}

// The same for as long as its world lives, which names it: until so many others are read.
static inline Scene *read_kept(const char *text)
{
    enum { KEPT = 8 };
    static Scene scene[KEPT];
    static int next;
    Scene *kept = &scene[next++ % KEPT];
    scene_destroy(kept);
    assert_string_equal(read_as_scene(text, kept), "");
    return kept;
}

#endif
