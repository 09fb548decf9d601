// SPDX-License-Identifier: MIT
// Checkpoints: the layout as HDF5's own functions see it, runs that go on with
// the same bits, and files that are damaged or meant for something else.
#include "surface_state.h"
#include "test.h"
#include "world_run.h"
#include "kept_world.h"

#include "sim/sim_data.h"
#include "surface/surface.h"

#include <signal.h>
#include <sys/stat.h>

#if defined(PLIANT_WITH_HDF5) && defined(PLIANT_WITH_SURFACE)
#include "recording_view.h"

// A body that everything acts on: a table, a probe, gravity, friction and a load.
#define SCENE(integrator, more)                                                                    \
    "gravity = [0.0, 0.0, -9.81];\n"                                                               \
    "bodies = ( { name = \"ball\"; mesh = { generator = \"uv_sphere\"; place = { translation = "   \
    "[0.0, 0.0, 0.051]; }; }; shape = { frame = \"body\"; };\n"                                    \
    "integrator = \"" integrator "\"; " more " } );\n"                                             \
    "tools = ( { id = 1; kind = \"static\"; plane = { normal = [0.0, 0.0, 1.0]; }; },\n"           \
    "{ id = 2; kind = \"probe\"; capsules = ( { radius = 0.01; } ); } );\n"                        \
    "loads = ( { center = [0.05, 0.0, 0.05]; radius = 0.03; force = [0.0, 0.5, 0.0]; "             \
    "start = 0.02; duration = 0.05; } );\n"

// Ticks in which the probe is pushed down on the ball's top, a pose every fifth tick.
static void run_step(Run *run, int ticks)
{
    for (int i = 0; i < ticks; i++) {
        int64_t step = sim_steps(run->world.sim);
        if (step % 5 == 0 && sim_tool_count(run->world.sim) > 1) {
            ToolPose pose = {.utime = 1000 * (step + 1),
                             .position = {0.005, 0.0, 0.115 - 1e-4 * (double)(step % 200)},
                             .orientation = {1.0, 0.0, 0.0, 0.0},
                             .active = true};
            sim_apply_pose(run->world.sim, 1, &pose, false);
        }
        sim_step(run->world.sim);
    }
}

static void save(Run *run, const char *name)
{
    unlink(scratch_at(name)); // what was altered is not replaced
    world_save(&run->world, name);
}

static const char *load(Run *run, const char *name)
{
    return world_load(&run->world, name);
}

// --- layout --------------------------------------------------------------------------------------

static void expect_rows(hid_t file, const char *name, const Vec3 *row, int count, const char *unit)
{
    hid_t set = H5Dopen2(file, name, H5P_DEFAULT), space = H5Dget_space(set);
    hid_t type = H5Dget_type(set);
    hsize_t size[2] = {0, 0};
    assert_true(H5Tequal(type, H5T_IEEE_F64LE) > 0);
    assert_int_equal(H5Sget_simple_extent_dims(space, size, NULL), 2);
    assert_int_equal(size[0], count);
    assert_int_equal(size[1], 3);
    FREED Vec3 *stored = calloc((size_t)count, sizeof *stored);
    view_get(file, name, H5T_NATIVE_DOUBLE, stored);
    assert_memory_equal(stored, row, (size_t)count * sizeof *row);
    expect_attribute(set, "unit", unit);
    H5Tclose(type);
    H5Sclose(space);
    H5Dclose(set);
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(checkpoint_has_the_documented_layout)
{
    START_RUN(run, SCENE("leapfrog", ""));
    run_step(&run, 40);
    save(&run, "a.h5");
    hid_t file = view_open(scratch_at("a.h5"), false);
    expect_attribute(file, "format", "pliant-checkpoint");
    expect_attribute(file, "created_by", "pliantd " PLIANT_VERSION);
    expect_attribute(file, "scene", run.scene.text);
    expect_number(file, "version", 2);

    Vec3 position[114], velocity[114];
    surface_read_state(sim_body(run.world.sim, 0), position, velocity);
    expect_rows(file, "/bodies/ball/position", position, 114, "m");
    expect_rows(file, "/bodies/ball/velocity", velocity, 114, "m/s");

    int id[114];
    double time = 0.0;
    int64_t step = 0;
    view_get(file, "/bodies/ball/id", H5T_NATIVE_INT, id);
    for (int i = 0; i < 114; i++)
        assert_int_equal(id[i], i);
    view_get(file, "/time", H5T_NATIVE_DOUBLE, &time);
    expect_near(time, 0.04, 1e-15); // 40 / 1000, rounded once
    hid_t set = H5Dopen2(file, "/time", H5P_DEFAULT);
    expect_attribute(set, "unit", "s");
    H5Dclose(set);
    view_get(file, "/step", H5T_NATIVE_INT64, &step);
    assert_int_equal(step, 40);
    for (int i = 0; i < run.world.state.count; i++) {
        char name[128];
        snprintf(name, sizeof name, "/state/%s", run.world.state.array[i].name);
        set = H5Dopen2(file, name, H5P_DEFAULT);
        assert_true(set >= 0);
        expect_attribute(set, "unit", "bytes");
        H5Dclose(set);
    }
    hid_t state = H5Gopen2(file, "/state", H5P_DEFAULT);
    const Body *body = sim_body(run.world.sim, 0);
    expect_attribute(state, "isa", body->ops->isa(body->model));
    H5Gclose(state);
    H5Fclose(file);
}

TEST(scenes_longer_than_64_kilobytes_are_stored_whole)
{
    enum { LONG = 200000 };
    static char text[LONG + 2000];
    memset(text, '#', LONG);
    text[LONG] = '\n';
    strcpy(text + LONG + 1, SCENE("leapfrog", ""));
    START_RUN(run, text);
    save(&run, "a.h5");
    hid_t file = view_open(scratch_at("a.h5"), false);
    expect_attribute(file, "scene", text);
    H5Fclose(file);
    assert_string_equal(load(&run, "a.h5"), "");
}

// --- the run goes on -----------------------------------------------------------------------------

static void expect_same_run(const char *text)
{
    SCOPED(run_destroy) Run whole, resumed;
    run_create(&whole, text);
    run_step(&whole, 60);
    save(&whole, "a.h5");
    run_step(&whole, 100);
    run_create(&resumed, text);
    run_step(&resumed, 7); // whatever came before is replaced
    assert_string_equal(load(&resumed, "a.h5"), "");
    assert_int_equal(sim_steps(resumed.world.sim), 60);
    run_step(&resumed, 100);
    assert_true(state_hash(&whole.world.state) == state_hash(&resumed.world.state));
    assert_int_equal(sim_resets(resumed.world.sim), 0);
    // And once more from the same file: reading it twice gives the same.
    assert_string_equal(load(&resumed, "a.h5"), "");
    run_step(&resumed, 100);
    assert_true(state_hash(&whole.world.state) == state_hash(&resumed.world.state));
}

TEST(restored_run_matches_uninterrupted_run)
{
    expect_same_run(SCENE("leapfrog", ""));
    expect_same_run(SCENE("rk4", ""));
    expect_same_run(SCENE("symplectic_euler", "prestress = 0.05; cuttable = false;"));
    expect_same_run(SCENE("leapfrog", "levels = 2; start_level = 1;"));
}

TEST(restored_state_survives_a_change_of_what_is_published)
{
    START_RUN(run, SCENE("leapfrog", ""));
    run_step(&run, 30);
    uint64_t hash = state_hash(&run.world.state);
    save(&run, "a.h5");
    run_destroy(&run);
    run_create(&run, "publish = { nodes_hz = 5; }; prefix = \"OTHER\";\n" SCENE("leapfrog", ""));
    assert_string_equal(load(&run, "a.h5"), "");
    assert_true(state_hash(&run.world.state) == hash);
}

// --- files that do not fit -----------------------------------------------------------------------

TEST(other_physics_are_refused)
{
    static const char *const others[] = {
        SCENE("rk4", ""),
        SCENE("leapfrog", "prestress = 0.01;"),
        SCENE("leapfrog", "material = { youngs_modulus_2d = 81.0; };"),
        SCENE("leapfrog", "contact = { friction = 0.3; };"),
        SCENE("leapfrog", "fixed = ( { nodes = [0]; } );"),
        SCENE("leapfrog", "levels = 1;"),
        "rate_hz = 500;\n" SCENE("leapfrog", ""),
        "tool_timeout_s = 0.1;\n" SCENE("leapfrog", ""),
    };
    Run run;
    run_create(&run, SCENE("leapfrog", ""));
    save(&run, "a.h5");
    run_destroy(&run);
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        run_create(&run, others[i]);
        uint64_t before = state_hash(&run.world.state);
        expect_in(load(&run, "a.h5"), "a.h5: / was written for other physics");
        assert_true(state_hash(&run.world.state) == before);
        run_destroy(&run);
    }
}

TEST(other_bodies_are_refused_by_name_and_size)
{
    START_RUN(run, SCENE("leapfrog", ""));
    save(&run, "a.h5");
    run_destroy(&run);
    run_create(&run, "bodies = ( { name = \"ball\"; mesh = { generator = \"stomach\"; }; } );");
    assert_string_equal(load(&run, "a.h5"),
                        "a.h5: /bodies/ball/position has 114 rows, the body 188 nodes");
    run_destroy(&run);
    run_create(&run, "bodies = ( { name = \"egg\"; mesh = { generator = \"uv_sphere\"; }; } );");
    assert_string_equal(load(&run, "a.h5"), "a.h5: /bodies/egg/position is missing or no data set");
}

TEST(other_formats_and_versions_are_refused)
{
    START_RUN(run, SCENE("leapfrog", ""));
    save(&run, "a.h5");
    hid_t file = view_change(scratch_at("a.h5"));
    int version = 1;
    hid_t attribute = H5Aopen(file, "version", H5P_DEFAULT);
    assert_true(H5Awrite(attribute, H5T_NATIVE_INT, &version) >= 0);
    H5Aclose(attribute);
    H5Fclose(file);
    scratch_seal(&scratch_space, "a.h5");
    assert_string_equal(load(&run, "a.h5"), "a.h5: / version 1 must be 2");
    file = view_change(scratch_at("a.h5"));
    H5Adelete(file, "format");
    H5Fclose(file);
    scratch_seal(&scratch_space, "a.h5");
    assert_string_equal(load(&run, "a.h5"), "a.h5: / has no attribute format");
    scratch_write(&scratch_space, "a.h5", "no HDF5", 7);
    assert_string_equal(load(&run, "a.h5"), "a.h5: is no file that Pliant wrote");
    assert_string_equal(load(&run, "none.h5"), "none.h5: No such file or directory");
    assert_string_equal(load(&run, "../"), "../: is not a regular file");
}

typedef struct Forged {
    const char *set;
    long at;
    unsigned char bits; // 0: nothing is altered, and the file is taken
} Forged;

static void expect_forged_refused(const Forged *forged, size_t count)
{
    START_RUN(run, SCENE("leapfrog", ""));
    run_step(&run, 30); // its load acts, and the probe moves
    uint64_t before = state_hash(&run.world.state);
    for (size_t i = 0; i < count; i++) {
        save(&run, "a.h5");
        view_alter(scratch_at("a.h5"), forged[i].set, forged[i].at, forged[i].bits);
        scratch_seal(&scratch_space, "a.h5");
        const char *said = load(&run, "a.h5"),
                   *wanted = forged[i].bits == 0 ? ""
                                                 : "a.h5: /state holds tools, loads, strokes, "
                                                   "attachments or settings that cannot be";
        if (strcmp(said, wanted) != 0)
            fail_msg("%s at %ld: '%s'", forged[i].set, forged[i].at, said);
        assert_true(state_hash(&run.world.state) == before);
    }
}

// Numbers of loads are indices: a forged file must not reach beyond the nodes.
TEST(loads_that_cannot_be_are_refused)
{
    static const Forged forged[] = {
        {"/state/loads/pool", 2, 0x40}, {"/state/loads/pool", 3, 0x80},
        {"/state/loads/count", 1, 1},   {"/state/loads/used", 3, 1},
        {"/state/loads/load", -1, 0},   {"/state/sim/clock", 20, 0x80},
    };
    expect_forged_refused(forged, sizeof forged / sizeof *forged);
}

// What SET changes has the ranges of SET, and the body computes with it.
TEST(settings_that_cannot_be_are_refused)
{
#define TUNING(member, byte) "/state/ball/tuning", (long)(offsetof(BodyTuning, member) + (byte))
    static const Forged forged[] = {
        {TUNING(friction, 7), 0x7f},
        {TUNING(stiffness_scale, 7), 0x80},
        {TUNING(stiffness_scale, 7), 0x40},
        {TUNING(stiffness_scale, 6), 0x01},
        {TUNING(damping_scale, 7), 0x80},
        {TUNING(damping_scale, 7), 0x40},
        {TUNING(bad_in_a_row, 7), 0x80},
        {TUNING(bad_in_a_row, 4), 0x01},
        {"/state/ball/tuning", (long)sizeof(BodyTuning) - 1, 0},
    };
    expect_forged_refused(forged, sizeof forged / sizeof *forged);
}

// Where tools are goes out to clients as it is: it must be numbers, of a time that has been.
TEST(tools_that_cannot_be_are_refused)
{
#define MOTION(member, byte)                                                                       \
    "/state/tools/motion", (long)(sizeof(ToolMotion) + offsetof(ToolMotion, member) + (byte))
    static const Forged forged[] = {
        {MOTION(active, 0), 2},
        {MOTION(pose_step, 6), 1},
        {MOTION(pose_step, 7), 0x80},
        {MOTION(period, 7), 0x80},
        {MOTION(to_grip, 7), 0x40},
        {MOTION(from_position, 7), 0x40},
        {MOTION(to_position, 2 * sizeof(double) + 7), 0x40},
        {MOTION(to_orientation, 7), 0x40},
        {"/state/tools/motion", (long)sizeof(ToolMotion), 0},
    };
    expect_forged_refused(forged, sizeof forged / sizeof *forged);
}

TEST(changed_numbers_are_refused)
{
    static const char *const names[] = {"/bodies/ball/position", "/bodies/ball/velocity",
                                        "/state/ball/rows"};
    SCOPED(run_destroy) Run run;
    // In double, where a bit of a row is a bit of a position.
    run_create(&run, "precision = \"double\";\n" SCENE("leapfrog", ""));
    for (int i = 0; i < 3; i++) {
        save(&run, "a.h5");
        view_alter(scratch_at("a.h5"), names[i], -1, 1);
        uint64_t before = state_hash(&run.world.state);
        assert_string_equal(
            load(&run, "a.h5"),
            "a.h5: is truncated or was altered: it differs from its seal; write it again");
        // With a seal made anew the rows for everyone still contradict those of the run.
        scratch_seal(&scratch_space, "a.h5");
        assert_string_equal(load(&run, "a.h5"), "a.h5: /bodies/ball does not match the state");
        assert_true(state_hash(&run.world.state) == before);
    }
}

TEST(truncated_files_are_refused)
{
    size_t size = 0;
    START_RUN(run, SCENE("leapfrog", ""));
    run_step(&run, 10);
    save(&run, "a.h5");
    FREED unsigned char *data = scratch_read(&scratch_space, "a.h5", &size);
    uint64_t before = state_hash(&run.world.state);
    for (int i = 0; i < 50; i++) {
        scratch_write(&scratch_space, "b.h5", data, size * (size_t)i / 50);
        assert_string_not_equal(load(&run, "b.h5"), "");
        assert_true(state_hash(&run.world.state) == before);
    }
}

TEST(altered_files_are_refused_wherever_the_change_is)
{
    size_t size = 0;
    START_RUN(run, SCENE("leapfrog", ""));
    run_step(&run, 10);
    save(&run, "a.h5");
    FREED unsigned char *data = scratch_read(&scratch_space, "a.h5", &size);
    uint64_t before = state_hash(&run.world.state);
    // An odd stride meets all parts of blocks of even size.
    for (size_t at = 0; at < size; at += size / 200 | 1) {
        data[at] ^= 0x55;
        scratch_write(&scratch_space, "b.h5", data, size);
        data[at] ^= 0x55;
        assert_string_not_equal(load(&run, "b.h5"), "");
        assert_true(state_hash(&run.world.state) == before);
    }
}

static bool refuse(const void *model)
{
    (void)model;
    return false;
}

// --- writing -------------------------------------------------------------------------------------

TEST(files_that_cannot_be_written_are_named)
{
    Status status = {0};
    WorldImage image;
    START_RUN(run, SCENE("leapfrog", ""));
    world_image_reserve(&image, &run.world.arena, &run.world);
    world_image_take(&image, &run.world);
    const char *path = scratch_at("none/a.h5");
    assert_false(checkpoint_write(path, &image, &run.world, &status));
    assert_int_equal(status.code, STATUS_FAILED);
    expect_in(status.text, "none/a.h5: No such file or directory");
}

TEST(numbers_that_are_none_are_not_written)
{
    WorldImage image;
    START_RUN(run, SCENE("leapfrog", ""));
    save(&run, "whole.h5");
    world_image_reserve(&image, &run.world.arena, &run.world);
    const char *path = scratch_at("whole.h5");
    for (int k = 0; k < 2; k++) {
        Status status = {0};
        world_image_take(&image, &run.world);
        Vec3 *row = k == 0 ? image.position[0] : image.velocity[0];
        row[3].y = (double)NAN;
        assert_false(checkpoint_write(path, &image, &run.world, &status));
        expect_in(status.text, "whole.h5: not written: row 3 of body ");
        assert_string_equal(load(&run, "whole.h5"), ""); // the good one is still there
    }
}

// What a resume would refuse is refused before it replaces anything.
TEST(a_state_that_no_run_could_go_on_from_is_not_written)
{
    WorldImage image;
    START_RUN(run, SCENE("leapfrog", ""));
    save(&run, "sound.h5");
    world_image_reserve(&image, &run.world.arena, &run.world);
    const char *path = scratch_at("sound.h5");
    for (int k = 0; k < 2; k++) {
        Status status = {0};
        Body *body = sim_body(run.world.sim, 0);
        const BodyOps *honest = body->ops;
        BodyOps spoilt = *honest;
        spoilt.check = refuse;
        if (k == 0)
            body->ops = &spoilt;
        else
            run.world.sim->clock->next_load = 1000;
        world_image_take(&image, &run.world);
        body->ops = honest;
        assert_false(checkpoint_write(path, &image, &run.world, &status));
        assert_int_equal(status.code, STATUS_FAILED);
        expect_in(status.text, k == 0 ? "not written: body ball no run could continue from"
                                      : "not written: it holds tools");
        assert_string_equal(load(&run, "sound.h5"), ""); // the good one is still there
    }
}

#ifdef PLIANT_WITH_VOXEL
// Its friction, which is a part of its speed over its radius, both of which are zero.
TEST(a_tool_of_no_size_leaves_a_state_to_go_on_from)
{
    START_RUN(run,
              "bodies = ( { name = \"block\"; model = \"voxel\"; contact = { friction = 0.3; };\n"
              "  voxels = { generator = \"box\"; count = 4; size = 0.01; }; } );\n"
              "tools = ( { id = 1; kind = \"static\"; capsules = (\n"
              "  { from = [0, 0, 9]; radius = 1.0e-300; },\n"
              "  { from = [0, 0, 0.025]; radius = 0.01; } ); } );\n");
    for (int tick = 0; tick < 5; tick++)
        sim_step(run.world.sim);
    assert_true(vec3_length(sim_wrench(run.world.sim, 0)->force) > 0.0);
    assert_null(world_fault(&run.world));
}
#endif

TEST(a_full_disk_leaves_the_previous_file_whole)
{
    Status status = {0};
    WorldImage image;
    START_RUN(run, SCENE("leapfrog", ""));
    save(&run, "a.h5");
    run_step(&run, 5);
    world_image_reserve(&image, &run.world.arena, &run.world);
    world_image_take(&image, &run.world);

    signal(SIGXFSZ, SIG_IGN);
    const rlim_t before = limit_files(4096);
    const char *path = scratch_at("a.h5");
    bool ok = checkpoint_write(path, &image, &run.world, &status);
    limit_files(before);
    assert_false(ok);
    assert_int_equal(status.code, STATUS_FAILED);
    expect_in(status.text, "a.h5: File too large");

    struct stat info;
    assert_int_not_equal(stat(scratch_at("a.h5.tmp"), &info), 0);
    assert_string_equal(load(&run, "a.h5"), "");
    assert_int_equal(sim_steps(run.world.sim), 0);
}

#else

AROUND_ALL(scratch_begin, scratch_end)

// Without HDF5 or without bodies: the files are refused in words, nothing else is there to test.
TEST(what_is_not_built_in_is_refused)
{
#ifndef PLIANT_WITH_HDF5
    Status status = {0};
    Vec3 *position, *velocity;
    TriMesh mesh = {0};
    assert_false(initial_read("start.h5", &mesh, &position, &velocity, &status));
    assert_string_equal(status.text, "start.h5: built without HDF5 (PLIANT_HDF5)");
    status = (Status){0};
    assert_false(checkpoint_read("a.h5", NULL, &status));
    assert_string_equal(status.text, "a.h5: built without HDF5 (PLIANT_HDF5)");
    status = (Status){0};
    assert_false(checkpoint_write("a.h5", NULL, NULL, &status));
    assert_string_equal(status.text, "a.h5: built without HDF5 (PLIANT_HDF5)");
#else
    skip();
#endif
}

#endif
