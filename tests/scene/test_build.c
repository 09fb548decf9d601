// SPDX-License-Identifier: MIT
// Worlds built from scene files: the meshes asked for, and refusals that name the scene's line.
#include "surface_state.h"
#include "test.h"
#include "world_run.h"

#include "scene/build.h"
#include "scene/build_parts.h"
#include "surface/surface.h"

#ifdef PLIANT_WITH_SURFACE
// Builds a scene text; returns what was wrong, "" if nothing.
static const char *build_text(const char *text, World *world)
{
    return try_world(world, text, &(BuildOptions){.isa = "auto", .may_load = true});
}

static void build_well(const char *text, World *world)
{
    assert_string_equal(build_text(text, world), "");
}

static void expect_part(const char *text, const char *start, const char *part)
{
    World world;
    const char *said = build_text(text, &world);
    if (strncmp(said, start, strlen(start)) != 0 || strstr(said, part) == NULL) {
        print_error("\"%s\" must begin with \"%s\" and hold \"%s\"\n", said, start, part);
        fail();
    }
}

#define MESH(text) "bodies = (\n{ name = \"a\"; mesh = { " text " }; } );\n"

AROUND_ALL(scratch_begin, scratch_end)

TEST(generators_give_the_meshes_that_scenes_ask_for)
{
    // Counts from the generators' formulas: edges are springs.
    static const struct {
        const char *text;
        int nodes, springs;
    } cases[] = {
        {MESH("generator = \"uv_sphere\"; rings = 8; segments = 14;"), 114, 336},
        {MESH("generator = \"sphere\"; nodes = 100;"), 100, 294},
        {MESH("generator = \"ico_sphere\"; nodes = 162;"), 162, 480},
        {MESH("generator = \"ico_sphere\"; subdivisions = 1;"), 42, 120},
        {MESH("generator = \"stomach\";"), 188, 558},
        {MESH("generator = \"sheet\"; columns = 4; rows = 3;"), 12, 23},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        SCOPED(world_destroy) World world;
        build_well(cases[i].text, &world);
        const Body *body = sim_body(world.sim, 0);
        assert_string_equal(body->name, "a");
        assert_int_equal(body->surface.node_count, cases[i].nodes);
        assert_int_equal(body->spring_count, cases[i].springs);
        assert_int_equal(world.mesh[0].node_count, cases[i].nodes);
    }
}

TEST(meshes_are_scaled_turned_and_moved)
{
    // A quarter turn about x takes +z to -y.
    SCOPED(world_destroy) World world;
    assert_string_equal(build_text(MESH("generator = \"uv_sphere\"; radius = 2; scale = 0.01; "
                                        "place = { rotation = [1.5707963267948966, 0, 0]; "
                                        "translation = [1, 2, 3]; };"),
                                   &world),
                        "");
    const TriMesh *mesh = &world.mesh[0];
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int i = 0; i < mesh->node_count; i++) {
        low = fmin(low, mesh->position[i].y);
        high = fmax(high, mesh->position[i].y);
    }
    // Rounding of coordinates of size 3.
    expect_near(low, 1.98, 1e-14);
    expect_near(high, 2.02, 1e-14);
}

TEST(mesh_files_are_read_and_their_faults_named)
{
    World world;
    const char *scene = MESH("file = \"organ.obj\"; scale = 0.1;");
    expect_part(scene, "x.cfg:2: ", "organ.obj: ");

    scratch_write_text("organ.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                                    "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
    build_well(scene, &world);
    assert_int_equal(world.mesh[0].node_count, 4);
    expect_near(world.mesh[0].position[1].x, 0.1, 0.0);
    world_destroy(&world);

    scratch_write_text("organ.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2\n");
    expect_part(scene, "x.cfg:2: ", "organ.obj");
    // Finite in the file, not in the world.
    scratch_write_text("organ.obj", "v 0 0 0\nv 1e308 0 0\nv 0 1e308 0\nf 1 2 3\n");
    expect_part(MESH("file = \"organ.obj\"; scale = 1e6;"), "x.cfg:2: ", "organ.obj: ");
}

TEST(meshes_of_absurd_size_are_refused_with_a_hint)
{
    SCOPED(world_destroy) World world;
    scratch_write_text("organ.obj", "v 0 0 0\nv 250 0 0\nv 0 120 0\nv 0 0 90\n"
                                    "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
    assert_string_equal(build_text(MESH("file = \"organ.obj\"; scale = 0.001;"), &world), "");
    expect_part(MESH("file = \"organ.obj\"; scale = 1000.0;"), "x.cfg:2: ",
                "organ.obj: measures 250000 m after scale 1000, outside [1e-06, 10000] m; scale is "
                "metres a unit of the file, 0.001 for millimetres");
    expect_part(MESH("file = \"organ.obj\"; scale = 1.0e-9;"),
                "x.cfg:2: ", "organ.obj: measures 2.5e-07 m after scale 1e-09, outside");
    // Generated ones too: squares of such lengths are no numbers.
    expect_part(MESH("generator = \"uv_sphere\"; scale = 1.0e-300;"),
                "x.cfg:2: ", "mesh: measures 1e-301 m after scale 1e-300, outside");
}

TEST(fixed_nodes_are_those_of_the_file_whatever_was_repaired)
{
    // Two tetrahedra that share vertex 1 (node 0 of the file, which is split), with vertex 3 a
    // double of vertex 2, and vertex 4 of no face.
    World world;
    scratch_write_text("organ.obj", "v 0 0 0\nv 1 0 0\nv 1 0 0\nv 9 9 9\nv 0 1 0\nv 0 0 1\n"
                                    "v -1 0 0\nv 0 -1 0\nv 0 0 -1\n"
                                    "f 1 5 2\nf 1 3 6\nf 3 5 6\nf 5 1 6\n"
                                    "f 1 7 8\nf 1 8 9\nf 8 7 9\nf 7 1 9\n");
#define FIXED(nodes)                                                                               \
    "bodies = (\n{ name = \"a\"; mesh = { file = \"organ.obj\"; };\n"                              \
    "fixed = ( { nodes = " nodes "; } ); } );"
    build_well(FIXED("[0, 2]"), &world);
    const Body *body = sim_body(world.sim, 0);
    const int ids[8] = {0, 1, 4, 5, 6, 7, 8, 9};
    const int origins[8] = {0, 1, 4, 5, 6, 7, 8, 0}; // the last is what was split off node 0
    const bool fixed[8] = {true, true, false, false, false, false, false, true};
    assert_int_equal(body->mesh.node_count, 8);
    for (int i = 0; i < 8; i++) {
        assert_int_equal(body->mesh.id[i], ids[i]);
        assert_int_equal(body->mesh.origin[i], origins[i]);
        assert_int_equal(body->ops->is_fixed(body->model, i), fixed[i]);
    }
    world_destroy(&world);
    expect_part(FIXED("[3]"), "x.cfg:2: ", "node 3 is not a node of the mesh (9 in its file)");
    expect_part(FIXED("[9]"), "x.cfg:2: ", "node 9 is not a node of the mesh (9 in its file)");
}

#define LEVELLED(more)                                                                             \
    "bodies = (\n{ name = \"a\"; mesh = { generator = \"stomach\"; }; " more " } );\n"

TEST(bodies_stay_at_the_level_where_they_start)
{
    static const struct {
        const char *text;
        int nodes, springs, faces;
    } cases[] = {
        // Choi et al. 2005, Table 1.
        {LEVELLED("levels = 2;"), 188, 558, 372},
        {LEVELLED("levels = 2; start_level = 1;"), 746, 2232, 1488},
        {LEVELLED("levels = 2; start_level = 2; adjust = \"choi2005\";"), 2978, 8928, 5952},
    };
    for (int i = 0; i < 3; i++) {
        SCOPED(world_destroy) World world;
        build_well(cases[i].text, &world);
        const Body *body = sim_body(world.sim, 0);
        assert_int_equal(body->mesh.node_count, cases[i].nodes);
        assert_int_equal(world.mesh[0].node_count, cases[i].nodes);
        assert_int_equal(body->spring_count, cases[i].springs);
        assert_int_equal(body->surface.face_count, cases[i].faces);
        assert_int_equal(body->finest_level, i);
        sim_ticks(world.sim, 100);
        assert_int_equal(sim_resets(world.sim), 0);
    }
}

TEST(a_body_at_its_level_keeps_no_hierarchy)
{
    SCOPED(world_destroy) World plain, levelled;
    build_well(LEVELLED(""), &plain);
    assert_string_equal(build_text(LEVELLED("levels = 3;"), &levelled), "");
    assert_int_equal(arena_bytes(&plain.arena), arena_bytes(&levelled.arena));
    assert_int_equal(plain.arena.count, levelled.arena.count);
}

TEST(midpoints_are_named_after_all_nodes_of_the_file)
{
    // Two tetrahedra that share vertex 1, which is split: 9 vertices, of which 2 are not used.
    SCOPED(world_destroy) World world;
    scratch_write_text("organ.obj", "v 0 0 0\nv 1 0 0\nv 9 9 9\nv 9 9 8\nv 0 1 0\nv 0 0 1\n"
                                    "v -1 0 0\nv 0 -1 0\nv 0 0 -1\n"
                                    "f 1 5 2\nf 1 2 6\nf 2 5 6\nf 5 1 6\n"
                                    "f 1 7 8\nf 1 8 9\nf 8 7 9\nf 7 1 9\n");
    assert_string_equal(
        build_text("bodies = (\n{ name = \"a\"; mesh = { file = \"organ.obj\"; };\n"
                   "levels = 1; start_level = 1; fixed = ( { nodes = [0, 1]; } ); } );",
                   &world),
        "");
    const Body *body = sim_body(world.sim, 0);
    const BodyMesh *mesh = &body->mesh;
    const int ids[8] = {0, 1, 4, 5, 6, 7, 8, 9};
    assert_int_equal(mesh->node_count, 8 + 12);
    int held = 0;
    for (int i = 0; i < 20; i++) {
        assert_int_equal(mesh->id[i], i < 8 ? ids[i] : 9 + 1 + i - 8);
        assert_int_equal(mesh->origin[i], i == 7 ? 0 : mesh->id[i]);
        assert_int_equal(mesh->level[i], i >= 8);
        bool between = i >= 8 && mesh->parent[i][0] == 0 && mesh->parent[i][1] == 1;
        bool fixed = body->ops->is_fixed(body->model, i);
        assert_int_equal(fixed, i == 0 || i == 1 || i == 7 || between);
        held += fixed;
        if (i >= 8)
            assert_true(mesh->parent[i][0] < mesh->parent[i][1]);
        else
            assert_true(mesh->parent[i][0] == ids[i] && mesh->parent[i][1] == ids[i]);
    }
    assert_int_equal(held, 4); // nodes 0 and 1, what was split off 0, the middle of 0 and 1
}

TEST(bodies_that_do_not_fit_are_refused)
{
    SCOPED(world_destroy) World world;
    assert_string_equal(
        build_text("capacity = { nodes = 188; faces = 372; };" LEVELLED(""), &world), "");
    expect_part(
        "capacity = { nodes = 745; };" LEVELLED("levels = 1; start_level = 1;"), "x.cfg:2: ",
        "body a has 746 nodes to start with, capacity.nodes is 745: raise it, or leave it out");
    expect_part(
        "capacity = { faces = 371; };" LEVELLED("levels = 1;"), "x.cfg:2: ",
        "body a has 372 faces to start with, capacity.faces is 371: raise it, or leave it out");
    // 46 GB of levels: where they would fit, there are too many nodes to be counted.
    expect_part(
        "bodies = (\n{ name = \"a\"; mesh = { generator = \"sphere\"; nodes = 5000; };\n"
        "levels = 8; } );",
        "x.cfg:2: ", memory_free() < 45e9 ? "nodes at the finest level need" : "level 8 has");
}

TEST(fixed_nodes_must_exist)
{
    expect_part("bodies = (\n{ name = \"a\"; mesh = { generator = \"uv_sphere\"; };\n"
                "fixed = ( { nodes = [3, 114]; } ); } );",
                "x.cfg:2: ", "114");
}

TEST(time_steps_beyond_the_bound_are_refused_unless_wanted)
{
    World world;
#define STEP(text)                                                                                 \
    "rate_hz = 10;\nbodies = ( { name = \"a\"; mesh = { generator = \"uv_sphere\"; };\n"           \
    "time_step = 0.1; " text " } );"
    expect_part(STEP(""), "x.cfg: ", "time_step");
    assert_string_equal(build_text(STEP("unsafe_time_step = true;"), &world), "");
    assert_int_equal(sim_body(world.sim, 0)->substeps, 1);
    world_destroy(&world);
}

TEST(settling_ends_before_the_first_tick)
{
    // Free fall for 0.1 s: drift-kick-drift is exact for a constant acceleration.
    SCOPED(world_destroy) World world;
    assert_string_equal(
        build_text("precision = \"double\"; settle_s = 0.1; gravity = [0, 0, -10];\n"
                   "bodies = ( { name = \"a\"; mesh = { generator = "
                   "\"uv_sphere\"; radius = 0.05; }; } );",
                   &world),
        "");
    assert_int_equal(sim_steps(world.sim), 0);
    BodyMeasure measure;
    const Body *body = sim_body(world.sim, 0);
    body->ops->measure(body->model, &measure);
    // 1/2 g t^2; the springs stay at rest but for rounding.
    expect_near(measure.max_displacement, 0.05, 1e-9);
}

TEST(tools_and_loads_reach_the_simulation)
{
    SCOPED(world_destroy) World world;
    assert_string_equal(
        build_text("precision = \"double\";\n" MESH("generator = \"uv_sphere\";") //
                   "tools = ( { id = 7; kind = \"probe\"; capsules = ( { radius = 0.01; } ); } );\n"
                   "loads = ( { center = [0, 0, 0.05]; radius = 0.02; force = [0, 0, 2]; duration "
                   "= 1; } );",
                   &world),
        "");
    assert_int_equal(sim_tool_count(world.sim), 1);
    assert_int_equal(sim_tool(world.sim, 0)->id, 7);
    sim_ticks(world.sim, 10);
    // Nothing else acts on the free body: its momentum is force times time.
    const Body *body = sim_body(world.sim, 0);
    int count = body->surface.node_count;
    Vec3 position[200], velocity[200];
    surface_read_state(body, position, velocity);
    double momentum = 0.0;
    for (int i = 0; i < count; i++)
        momentum += body->surface.node_mass[i] * velocity[i].z;
    // 2 N for 10 ms; rounding over ten ticks.
    expect_near(momentum, 0.02, 1e-12);
}

#endif
