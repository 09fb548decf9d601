// SPDX-License-Identifier: MIT
// Worlds of voxel bodies built from scene files: what the keys make of them, initial states,
// prepared models, checkpoints of other scenes.
#include "test.h"
#include "world_run.h"
#include "kept_world.h"

#include "scene/prepared.h"

#ifdef PLIANT_WITH_HDF5
#include <hdf5.h>

#define BODY(voxels, more)                                                                         \
    "bodies = (\n{ name = \"a\"; model = \"voxel\"; voxels = { " voxels " }; " more " } );\n"
#define BOX "generator = \"box\"; count = [4, 5, 6]; size = 0.01; "

// Builds a scene; returns what was wrong, "" if nothing, without the folder's name.
static const char *build_text(const char *text, const char *prepared, World *world)
{
    BuildOptions options = {.isa = "auto", .may_load = true};
    if (prepared != NULL)
        options.prepared = scratch_at(prepared);
    return try_world(world, text, &options);
}

static void build_well(const char *text, World *world)
{
    assert_string_equal(build_text(text, NULL, world), "");
}

static void expect_refusal(const char *text, const char *said)
{
    World world;
    assert_string_equal(build_text(text, NULL, &world), said);
}

static int begin(void **unused)
{
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return scratch_begin(unused);
}

AROUND_ALL(begin, scratch_end)

TEST(bodies_have_the_elements_that_scenes_ask_for)
{
    static const struct {
        const char *text;
        int elements, vertices;
        double mass; // [kg]
    } cases[] = {
        // n^3 cells, (n + 1)^3 lattice points, density times volume.
        {BODY(BOX, "levels = 0;"), 120, 5 * 6 * 7, 0.12},
        {BODY(BOX, "levels = 0; material = { density = 500; };"), 120, 5 * 6 * 7, 0.06},
        {BODY(BOX "scale = 0.5;", "levels = 0;"), 120, 5 * 6 * 7, 0.015},
        // Two layers of cells around 6^3 blocks of 8: 16^3 - 12^3 + 6^3.
        {BODY("generator = \"box\"; size = 0.01;", "levels = 1;"), 2584, 0, 4.096},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        SCOPED(world_destroy) World world;
        build_well(cases[i].text, &world);
        const Body *body = sim_body(world.sim, 0);
        assert_string_equal(body->name, "a");
        assert_string_equal(body->ops->model, "voxel");
        assert_int_equal(body->element_count, cases[i].elements);
        if (cases[i].vertices > 0)
            assert_int_equal(body->state_capacity, cases[i].vertices);
        // Rounding of a sum over some thousand vertices.
        expect_near(body->mass, cases[i].mass, 1e-12);
        assert_int_equal(world.mesh[0].node_count, 0);
    }
}

TEST(lattices_stand_where_they_are_placed)
{
    // A quarter turn about z takes x to y.
    SCOPED(world_destroy) World world;
    assert_string_equal(build_text("precision = \"double\";\n" BODY(
                                       BOX "place = { rotation = [0, 0, 1.5707963267948966]; "
                                           "translation = [1, 2, 3]; };",
                                       "levels = 0;"),
                                   NULL, &world),
                        "");
    const Body *body = sim_body(world.sim, 0);
    Vec3 low = vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL), high = vec3_scale(-1.0, low);
    for (int i = 0; i < body->surface.node_count; i++) {
        Vec3 x;
        body->ops->read_nodes(body->model, &i, 1, &x, NULL);
        low = vec3(fmin(low.x, x.x), fmin(low.y, x.y), fmin(low.z, x.z));
        high = vec3(fmax(high.x, x.x), fmax(high.y, x.y), fmax(high.z, x.z));
    }
    // Rounding of coordinates of size 3.
    expect_near(low.x, 1.0 - 0.025, 1e-14);
    expect_near(high.x, 1.0 + 0.025, 1e-14);
    expect_near(low.y, 2.0 - 0.02, 1e-14);
    expect_near(high.z, 3.0 + 0.03, 1e-14);
}

TEST(inner_vertices_are_published_when_asked_for)
{
    SCOPED(world_destroy) World world;
    assert_string_equal(build_text(BODY(BOX, "levels = 0;"), NULL, &world), "");
    // All lattice points but the 3 x 4 x 5 inner ones.
    assert_int_equal(sim_body(world.sim, 0)->mesh.node_count, 5 * 6 * 7 - 3 * 4 * 5);
    world_destroy(&world);
    assert_string_equal(
        build_text("publish = { nodes = \"all\"; };\n" BODY(BOX, "levels = 0;"), NULL, &world), "");
    assert_int_equal(sim_body(world.sim, 0)->mesh.node_count, 5 * 6 * 7);
}

TEST(skins_are_published_in_place_of_the_cells)
{
    // A tetrahedron within the box, in millimetres.
    static const char SKIN[] = "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 0 0 10\n"
                               "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    SCOPED(world_destroy) World world;
    scratch_write(&scratch_space, "skin.obj", SKIN, sizeof SKIN - 1);
    assert_string_equal(
        build_text(BODY(BOX, "skin = { mesh = \"skin.obj\"; scale = 0.001; };"), NULL, &world), "");
    const Body *body = sim_body(world.sim, 0);
    assert_int_equal(body->mesh.node_count, 4);
    assert_int_equal(body->mesh.triangle_count, 4);
    float position[4][3];
    body->ops->snapshot(body->model, &position[0][0], NULL);
    // In single precision.
    expect_near((double)position[1][0], 0.01, 1e-8);
    // Tools meet the cells.
    assert_int_equal(body->surface.face_count, 2 * 2 * (4 * 5 + 5 * 6 + 6 * 4));
    World none;
    const char *said = build_text(BODY(BOX, "skin = { mesh = \"none.obj\"; };"), NULL, &none);
    assert_string_equal(said, "x.cfg:2: none.obj: No such file or directory");
}

TEST(faults_of_bodies_name_the_scenes_line)
{
    World world;
    expect_refusal(BODY("file = \"none.nrrd\";", ""),
                   "x.cfg:2: none.nrrd: No such file or directory");
    expect_refusal(BODY("mesh = \"none.stl\"; size = 0.01;", ""),
                   "x.cfg:2: none.stl: No such file or directory");
    const char *said =
        build_text(BODY("generator = \"ball\"; radius = 0.001; size = 1;", ""), NULL, &world);
    assert_int_equal(strncmp(said, "x.cfg:2: ", 9), 0);
    said = build_text(BODY(BOX, "fixed = ( { nodes = [3, 210]; } );"), NULL, &world);
    assert_int_equal(strncmp(said, "x.cfg:2: ", 9), 0);
    expect_in(said, "210");
    expect_refusal("capacity = { nodes = 149; };\n" BODY(BOX, "levels = 0;"),
                   "x.cfg:3: body a has 150 nodes to start with, capacity.nodes is 149: raise it, "
                   "or leave it out");
    expect_refusal("capacity = { faces = 295; };\n" BODY(BOX, "levels = 0;"),
                   "x.cfg:3: body a has 296 faces to start with, capacity.faces is 295: raise it, "
                   "or leave it out");
    expect_refusal("capacity = { nodes = 8; };\n" BODY(
                       "generator = \"box\"; count = [2, 2]; size = 0.01; dimensions = 2;",
                       "levels = 0; cuttable = true;"),
                   "x.cfg:3: body a has 9 vertices to start with, capacity.nodes is 8: raise it, "
                   "or leave it out");
}

// --- initial states ------------------------------------------------------------------------------

static void write_rows(const char *name, const char *set_name, int rows, const Vec3 *row)
{
    char path[SCRATCH_PATH];
    const hsize_t size[2] = {(hsize_t)rows, 3};
    bool first = strcmp(set_name, "/position") == 0;
    scratch_path(&scratch_space, name, path);
    hid_t file = first ? H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)
                       : H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
    hid_t space = H5Screate_simple(2, size, NULL);
    hid_t set =
        H5Dcreate2(file, set_name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    assert_true(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, row) >= 0);
    H5Dclose(set);
    H5Sclose(space);
    H5Fclose(file);
}

TEST(initial_states_go_by_ascending_lattice_point)
{
    enum { NX = 5, NY = 6, NZ = 7, COUNT = NX * NY * NZ };
    static Vec3 row[COUNT + 1], speed[COUNT + 1], x[COUNT], v[COUNT];
    static int id[COUNT];
    // All lattice points, x fastest, moved by 1 m; every one has its own speed.
    for (int i = 0; i < COUNT; i++) {
        row[i] = vec3(0.01 * (i % NX) - 0.02 + 1.0, 0.01 * (i / NX % NY) - 0.025,
                      0.01 * (i / (NX * NY)) - 0.03);
        speed[i] = vec3(1e-3 * i, 0.0, 0.0);
    }
    write_rows("start.h5", "/position", COUNT, row);
    write_rows("start.h5", "/velocity", COUNT, speed);
    World world;
    const char *scene =
        "precision = \"double\";\n" BODY(BOX, "levels = 0; initial = \"start.h5\";");
    build_well(scene, &world);
    const Body *body = sim_body(world.sim, 0);
    assert_int_equal(body->state_capacity, COUNT);
    assert_int_equal(body->ops->read_state(body->model, id, x, v), COUNT);
    for (int i = 0; i < COUNT; i++) {
        assert_in_range(id[i], 0, COUNT - 1);
        // Displacements of 1 m are stored: rounding.
        expect_near(vec3_length(vec3_sub(x[i], row[id[i]])), 0.0, 1e-14);
        expect_near(vec3_length(vec3_sub(v[i], speed[id[i]])), 0.0, 1e-14);
    }
    world_destroy(&world);

    write_rows("start.h5", "/position", COUNT - 1, row);
    const char *said = build_text(scene, NULL, &world);
    assert_int_equal(strncmp(said, "x.cfg:3: ", 9), 0);
    expect_in(said, "209");
    expect_in(said, "210");
}

// --- prepared models and checkpoints -------------------------------------------------------------

TEST(runs_from_a_prepared_model_have_the_same_bits)
{
    const char *scenes[] = {
        "gravity = [0, 0, -9.81];\n" BODY("generator = \"ball\"; radius = 0.03; size = 0.005; "
                                          "place = { rotation = [0.3, 0.2, 0.1]; };",
                                          "fixed = ( { box = ([-1, -1, -1], [1, 1, -0.02]); } );"),
        "gravity = [0, -9.81, 0];\n" BODY("generator = \"disc\"; radius = 0.03; size = 0.005;",
                                          "law = \"miyazaki2004\"; "
                                          "fixed = ( { box = ([-1, -1, -1], [1, -0.02, 1]); } );"),
    };
    FILE *report = fopen("/dev/null", "w");
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
        SCOPED(world_destroy) World made, read;
        SCOPED(scene_destroy) Scene scene;
        Status status = {0};
        read_scene(scenes[i], &scene);
        assert_true(prepared_write(scratch_at("a.h5"), &scene, report, &status));
        build_well(scenes[i], &made);
        assert_string_equal(build_text(scenes[i], "a.h5", &read), "");
        uint64_t start = state_hash(&made.state);
        for (int t = 0; t < 30; t++) {
            sim_step(made.sim);
            sim_step(read.sim);
        }
        assert_true(state_hash(&made.state) == state_hash(&read.state));
        assert_true(state_hash(&made.state) != start);
    }
    fclose(report);
}

#define FALLING(voxels, more) "gravity = [0, 0, -9.81];\n" BODY(voxels, more)
#define HELD                  "fixed = ( { box = ([-1, -1, -1], [1, 1, -0.0299]); } );"

TEST(resumed_run_matches_the_uninterrupted_one)
{
    SCOPED(run_destroy) Run whole, before, after;
    run_create(&whole, FALLING(BOX, HELD));
    run_create(&before, FALLING(BOX, HELD));
    run_create(&after, FALLING(BOX, HELD));
    sim_ticks(whole.world.sim, 60);
    sim_ticks(before.world.sim, 30);
    world_save(&before.world, "a.h5");
    assert_string_equal(world_load(&after.world, "a.h5"), "");
    sim_ticks(after.world.sim, 30);
    assert_true(state_hash(&whole.world.state) == state_hash(&after.world.state));
}

// Every key that changes motion changes the hash of the physics, others do not.
TEST(checkpoints_belong_to_their_physics)
{
    static const char *const OTHERS[] = {
        FALLING(BOX, HELD "levels = 1;"),
        FALLING(BOX, HELD "law = \"miyazaki2004\";"),
        FALLING(BOX, HELD "material = { youngs_modulus = 9000; };"),
        FALLING(BOX, HELD "material = { poisson_ratio = 0.1; };"),
        FALLING(BOX, HELD "material = { density = 900; };"),
        FALLING(BOX, HELD "material = { damping = 0.3; };"),
        FALLING(BOX, HELD "integrator = \"leapfrog\";"),
        FALLING(BOX, HELD "time_step = 0.0001;"),
        FALLING(BOX, HELD "contact = { friction = 0.1; };"),
        FALLING(BOX, HELD "contact = { stiffness = 0.1; };"),
        FALLING(BOX, HELD "contact = { damping_time = 0.1; };"),
        FALLING(BOX, "fixed = ( { box = ([-1, -1, -1], [1, 1, -0.0298]); } );"),
        FALLING(BOX "place = { translation = [0, 0.01, 0]; };", HELD),
    };
    static const char *const SAME[] = {
        FALLING(BOX, HELD),
        "publish = { nodes_hz = 10; };\n" FALLING(BOX, HELD),
        FALLING("generator = \"box\"; count = [4, 5, 6]; size = 0.005; scale = 2;", HELD),
    };
    Run run;
    run_create(&run, FALLING(BOX, HELD));
    sim_step(run.world.sim);
    world_save(&run.world, "a.h5");
    run_destroy(&run);
    for (size_t i = 0; i < sizeof OTHERS / sizeof *OTHERS; i++) {
        run_create(&run, OTHERS[i]);
        if (strstr(world_load(&run.world, "a.h5"), "a.h5: ") == NULL)
            fail_msg("taken by %s", OTHERS[i]);
        run_destroy(&run);
    }
    for (size_t i = 0; i < sizeof SAME / sizeof *SAME; i++) {
        run_create(&run, SAME[i]);
        assert_string_equal(world_load(&run.world, "a.h5"), "");
        run_destroy(&run);
    }
}

#endif
