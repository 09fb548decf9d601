// SPDX-License-Identifier: MIT
// Scenes that take more memory than there is: refused by a sentence before they are made.
#include "test.h"
#include "world_run.h"

#include "scene/build_parts.h"

static const char *refusal_of(const char *text)
{
    World world;
    return try_world(&world, text, &(BuildOptions){.isa = "auto"});
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(a_body_that_no_machine_holds_is_refused_before_it_is_made)
{
    const char *said = refusal_of("bodies = ( { name = \"a\"; mesh = { generator = \"sheet\"; "
                                  "columns = 4000; rows = 4000; }; levels = 8; adapt = { }; } );");
    assert_ptr_equal(strstr(said, "x.cfg:1: 1048576000000 nodes at the finest level need at least "
                                  "2e+06 GB of memory, and "),
                     said);
}

// More than a machine has that runs tests, less than would be refused for other reasons.
TEST(room_that_a_scene_asks_for_counts)
{
    SceneBody body = {.model = MODEL_SURFACE,
                      .surface = {.body.cuttable = true, .body.node_capacity = 100000000}};
    Status status = {0};
    bool fits = memory_free() >= 1e8 * 100.0;
    assert_int_equal(memory_check_surface(&body, 100.0, &status), fits);
    assert_int_equal(status.code, fits ? STATUS_OK : STATUS_INVALID);
}

TEST(what_is_free_is_a_number)
{
    assert_true(memory_free() > 0.0);
    SceneBody body = {.model = MODEL_SURFACE};
    Status status = {0};
    assert_true(memory_check_surface(&body, 1.0, &status));
    assert_int_equal(status.code, STATUS_OK);
}

TEST(generators_say_how_many_nodes_they_make)
{
    const MeshSource sheet = {.kind = MESH_SHEET, .columns = 3, .rows = 5};
    const MeshSource uv = {.kind = MESH_UV_SPHERE, .rings = 4, .segments = 6};
    const MeshSource file = {.kind = MESH_FILE};
    assert_int_equal((int)memory_source_nodes(&sheet), 15);
    assert_int_equal((int)memory_source_nodes(&uv), 26);
    assert_int_equal((int)memory_source_nodes(&file), 0);
}
