// SPDX-License-Identifier: MIT
// Checkpoints of a body whose mesh changes: the nodes alive, in ascending id, for anyone to read;
// the same mesh, slot by slot, when they are read back; files that contradict themselves.
#include "test.h"
#include "scratch_folder.h"

#include "io/checkpoint.h"
#include "scene/build.h"
#include "mesh_check.h"
#include "mesh_toy.h"

#if defined(PLIANT_WITH_HDF5) && defined(PLIANT_WITH_SURFACE)
#include "recording_view.h"

// A scene whose body is a toy in the place of the one that was built.
typedef struct Run {
    Scene scene;
    World world;
    MeshToy toy;
} Run;

static void run_create(Run *run, uint64_t seed)
{
    static const char text[] =
        "bodies = ( { name = \"toy\"; mesh = { generator = \"uv_sphere\"; }; } );\n";
    Status status = {0};
    const BuildOptions options = {.isa = "auto", .may_load = false};
    memset(run, 0, sizeof *run);
    scratch_write_text("x.cfg", text);
    expect_ok(scene_read(scratch_at("x.cfg"), &run->scene, &status) &&
                  world_build(&run->world, &run->scene, &options, &status),
              status);
    mesh_toy_create(&run->toy, false, seed);
    *sim_body(run->world.sim, 0) = mesh_toy_body(&run->toy, "toy", true, &run->world.state);
}

static void run_destroy(Run *run)
{
    world_destroy(&run->world);
    scene_destroy(&run->scene);
    mesh_toy_destroy(&run->toy);
}

static void run_change(Run *run, int times)
{
    for (int i = 0; i < times; i++) {
        mesh_toy_change(&run->toy);
        run->toy.state.moves++;
    }
    sim_body(run->world.sim, 0)->mesh = mesh_toy_mesh(&run->toy);
}

static void save(Run *run, const char *name)
{
    Status status = {0};
    WorldImage image;
    world_image_reserve(&image, &run->world.arena, &run->world);
    world_image_take(&image, &run->world);
    run_change(run, 3); // the file is written later, while the body goes on
    expect_ok(checkpoint_write(scratch_at(name), &image, &run->world, &status), status);
}

static bool load(Run *run, const char *name, Status *status)
{
    *status = (Status){0};
    return checkpoint_read(scratch_at(name), &run->world, status);
}

// Rows of a data set, with its number of them.
static void read_set(hid_t file, const char *name, hid_t type, void *data, int *rows)
{
    hsize_t size[2] = {0, 0};
    hid_t set = H5Dopen2(file, name, H5P_DEFAULT), space = H5Dget_space(set);
    H5Sget_simple_extent_dims(space, size, NULL);
    assert_in_range(size[0], 1, TOY_NODES);
    assert_true(H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0);
    *rows = (int)size[0];
    H5Sclose(space);
    H5Dclose(set);
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(the_nodes_alive_are_written_in_ascending_id)
{
    SCOPED(run_destroy) Run run;
    run_create(&run, 21);
    run_change(&run, 40);
    const MeshToyState then = run.toy.state;
    Vec3 expected[TOY_NODES];
    mesh_toy_positions(&run.toy, expected);
    save(&run, "a.h5");

    hid_t file = H5Fopen(scratch_at("a.h5"), H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_true(file >= 0);
    int id[TOY_NODES], ids, positions, velocities, live = 0;
    Vec3 position[TOY_NODES], velocity[TOY_NODES];
    read_set(file, "/bodies/toy/id", H5T_NATIVE_INT, id, &ids);
    read_set(file, "/bodies/toy/position", H5T_NATIVE_DOUBLE, position, &positions);
    read_set(file, "/bodies/toy/velocity", H5T_NATIVE_DOUBLE, velocity, &velocities);
    H5Fclose(file);
    for (int i = 0; i < then.node_count; i++)
        live += then.id[i] >= 0;
    assert_true(live < then.node_count); // some slots are free: it is about them
    assert_int_equal(ids, live);
    assert_int_equal(positions, live);
    assert_int_equal(velocities, live);
    for (int k = 0; k < ids; k++) {
        assert_true(k == 0 || id[k] > id[k - 1]);
        int slot = 0;
        while (slot < then.node_count && then.id[slot] != id[k])
            slot++;
        assert_true(slot < then.node_count);
        assert_memory_equal(&position[k], &expected[slot], sizeof *position);
        expect_near(velocity[k].x, id[k], 0.0); // the toy's velocity tells the id
    }
}

TEST(a_mesh_comes_back_slot_by_slot)
{
    SCOPED(run_destroy) Run run;
    Status status;
    run_create(&run, 22);
    for (int n = 0; n < 20; n++) {
        run_change(&run, 7);
        const MeshToyState then = run.toy.state;
        save(&run, "a.h5");
        run_change(&run, 9);
        expect_ok(load(&run, "a.h5", &status), status);
        assert_memory_equal(&run.toy.state, &then, sizeof then);
        const Body *body = sim_body(run.world.sim, 0);
        assert_int_equal(body->mesh.node_count, then.node_count);
        expect_crack_free(&body->mesh, &run.toy.base, NULL);
    }
}

TEST(files_that_contradict_themselves_change_nothing)
{
    // Little-endian: byte 0 is the lowest of the first number, byte 3 its highest.
    const size_t slots = offsetof(MeshToyState, node_count);
    const struct {
        const char *set;
        size_t at;
        unsigned char bits;
        const char *said;
    } damage[] = {
        {"/bodies/toy/id", 0, 2, "does not match the state"},
        {"/bodies/toy/id", 4, 255, "differ from the nodes of the mesh"}, // no longer ascending
        {"/bodies/toy/id", 3, 128, "differ from the nodes of the mesh"}, // negative
        {"/bodies/toy/position", 5, 1, "does not match the state"},
        {"/bodies/toy/velocity", 5, 1, "does not match the state"},
        {"/state/toy/toy", offsetof(MeshToyState, id), 4, "does not match the state"},
        {"/state/toy/toy", slots, 16, "does not match the state"},
        {"/state/toy/toy", slots + 2, 64, "is beyond what can be simulated"},
        {"/state/toy/toy", slots + 3, 128, "is beyond what can be simulated"},
    };
    SCOPED(run_destroy) Run run;
    Status status;
    run_create(&run, 23);
    run_change(&run, 30);
    for (size_t i = 0; i < sizeof damage / sizeof *damage; i++) {
        save(&run, "a.h5");
        view_alter(scratch_at("a.h5"), damage[i].set, (long)damage[i].at, damage[i].bits);
        scratch_seal(&scratch_space, "a.h5");
        const MeshToyState before = run.toy.state;
        assert_false(load(&run, "a.h5", &status));
        if (strstr(status.text, damage[i].said) == NULL)
            fail_msg("damage %zu: %s", i, status.text);
        assert_memory_equal(&run.toy.state, &before, sizeof before);
        const Body *body = sim_body(run.world.sim, 0);
        assert_int_equal(body->mesh.node_count, before.node_count);
    }
}

#endif
