// SPDX-License-Identifier: MIT
// The tables in config/README.md are those that scene files are read by; and what is not built in
// is refused.
#include "test.h"
#include "scene_text.h"

AROUND_ALL(scratch_begin, scratch_end)

WRITER(reference)
{
    scene_print_reference(stdout);
}

TEST(reference_in_config_is_the_printed_one)
{
    FREED char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    scene_print_reference(out);
    fclose(out);
    FREED char *stored = file_text("../config/README.md");
    if (strcmp(stored, text) != 0)
        fail_msg("config/README.md differs from the tables: from the top of the sources run\n"
                 "    build/release/bin/test_scene --reference > config/README.md");
}

#ifndef PLIANT_WITH_SURFACE
TEST(surface_bodies_that_are_not_built_in_are_refused)
{
    expect_error(BODY, "x.cfg:1: this pliantd was built without surface bodies (PLIANT_SURFACE)");
}
#endif
