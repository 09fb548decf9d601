// SPDX-License-Identifier: MIT
// The meaning of the keys of scene files: defaults, what goes together and what does not, names,
// places, includes and syntax.
#include "test.h"
#include "scene_text.h"

#define IN_BODY(text)                                                                              \
    "bodies = ( { name = \"a\"; mesh = { generator = \"uv_sphere\"; };\n" text " } );\n"
#define MESH(text) "bodies = ( { name = \"a\";\nmesh = { " text " }; } );\n"

AROUND_ALL(scratch_begin, scratch_end)

TEST(a_bare_body_takes_all_defaults)
{
    const Scene *scene = read_valid(BODY);
    assert_string_equal(scene->name, "scene");
    assert_string_equal(scene->prefix, "PLIANT");
    assert_string_equal(scene->input_prefix, "PLIANT");
    assert_string_equal(scene->text, BODY);
    assert_null(scene->lcm_url);
    assert_int_equal(scene->start, START_RUNNING);
    assert_int_equal(scene->threads, 1);
    expect_near(scene->sim.rate_hz, 1000.0, 0.0);
    expect_near(vec3_length(scene->sim.gravity), 0.0, 0.0);
    expect_near(scene->sim.tool_timeout_s, 0.2, 0.0);
    expect_near(scene->settle_s, 0.0, 0.0);
    expect_near(scene->publish.nodes_hz, 60.0, 0.0);
    expect_near(scene->publish.mesh_hz, 1.0, 0.0);
    expect_near(scene->publish.contact_hz, 1000.0, 0.0);
    expect_near(scene->publish.status_hz, 2.0, 0.0);
    assert_int_equal(scene->tool_count + scene->load_count, 0);
    const SurfaceOptions *surface = &scene->body[0].surface;
    assert_false(surface->material.uniform);
    expect_near(surface->material.youngs_modulus_2d, 80.0, 0.0);
    expect_near(surface->material.areal_density, 4.2, 0.0);
    expect_near(surface->material.damping_time, 2e-4, 0.0);
    expect_near(surface->material.node_damping, 0.0, 0.0);
    assert_false(surface->shape.wanted);
    assert_int_equal(surface->body.integrator, INTEGRATOR_LEAPFROG);
    expect_near(surface->body.time_step, 0.0, 0.0);
    expect_near(surface->body.contact_ratio, 0.5, 0.0);
    expect_near(surface->body.contact_damping, 2e-4, 0.0);
    expect_near(surface->body.friction, 0.2, 0.0);
    expect_near(scene->body[0].mesh.scale, 1.0, 0.0);
    assert_int_equal(scene->body[0].mesh.rings, 8);
    assert_int_equal(scene->body[0].mesh.segments, 14);
}

TEST(names_are_read_back)
{
    const Scene *scene;
    char text[256];
    for (int kind = 0; kind < INTEGRATOR_COUNT; kind++) {
        snprintf(text, sizeof text, IN_BODY("integrator = \"%s\";"),
                 integrator_name((IntegratorKind)kind));
        scene = read_valid(text);
        assert_int_equal(scene->body[0].surface.body.integrator, kind);
    }
    static const char MUST[] = " must be one of \"leapfrog\", \"rk4\", \"symplectic_euler\", "
                               "\"implicit\", \"auto\"";
    snprintf(text, sizeof text, "x.cfg:2: integrator \"RK4\"%s", MUST);
    expect_error(IN_BODY("integrator = \"RK4\";"), text);
    snprintf(text, sizeof text, "x.cfg:2: integrator \"\"%s", MUST);
    expect_error(IN_BODY("integrator = \"\";"), text);
}

TEST(keys_are_accepted_at_their_defaults)
{
    read_valid(
        "precision = \"double\"; threads = 1; late = \"skip\";\n" IN_BODY("cuttable = false;"));
}

TEST(step_may_have_several_threads)
{
    const Scene *scene = read_valid("threads = 8;\n" BODY);
    assert_int_equal(scene->threads, 8);
}

TEST(implicit_integration_has_its_keys)
{
    const Scene *scene = read_valid(IN_BODY("integrator = \"implicit\"; theta = 1.0; "
                                            "solver_tolerance = 1.0e-6; solver_iterations = 200;"));
    const SurfaceOptions *surface = &scene->body[0].surface;
    assert_int_equal(surface->body.integrator, INTEGRATOR_IMPLICIT);
    assert_false(surface->automatic);
    expect_near(surface->implicit.theta, 1.0, 0.0);
    expect_near(surface->implicit.tolerance, 1e-6, 0.0);
    assert_int_equal(surface->implicit.iterations, 200);

    scene = read_valid("rate_hz = 500;\n" IN_BODY("integrator = \"auto\";"));
    assert_true(scene->body[0].surface.automatic);
    expect_near(scene->body[0].surface.tick, 0.002, 0.0);
    expect_near(scene->body[0].surface.implicit.theta, 0.55, 0.0);
}

TEST(shape_springs_may_be_damped_along_themselves)
{
    const Scene *scene = read_valid(IN_BODY("shape = {};"));
    assert_int_equal(scene->body[0].surface.shape.direction, SHAPE_DAMPS_ALL);
    scene = read_valid(IN_BODY("shape = { damping_direction = \"radial\"; };"));
    assert_int_equal(scene->body[0].surface.shape.direction, SHAPE_DAMPS_RADIAL);
}

TEST(cuttable_body_may_tear_by_stretch)
{
    const Scene *scene = read_valid(IN_BODY("cuttable = true;"));
    assert_true(scene->body[0].surface.body.cuttable);
    expect_near(scene->body[0].surface.tear_stretch, 0.0, 0.0);
    scene = read_valid(IN_BODY("cuttable = true; tear = { stretch = 0.5; };"));
    expect_near(scene->body[0].surface.tear_stretch, 0.5, 0.0);
}

TEST(levels_are_read_as_written)
{
    const Scene *scene =
        read_valid("rate_hz = 500; capacity = { nodes = 9000; faces = 8000; };\n" IN_BODY(
            "levels = 3; start_level = 1; adjust = \"choi2005\"; "
            "adapt = { force = 0.01; speed = 2; curvature = 0.25; "
            "check_hz = 62.5; };"));
    const SurfaceOptions *surface = &scene->body[0].surface;
    assert_int_equal(surface->body.levels, 3);
    assert_int_equal(surface->start_level, 1);
    assert_int_equal(surface->adjust, ADJUST_CHOI2005);
    assert_true(surface->adaptive);
    expect_near(surface->adapt.force, 0.01, 0.0);
    expect_near(surface->adapt.speed, 2.0, 0.0);
    expect_near(surface->adapt.curvature, 0.25, 0.0);
    expect_near(surface->adapt.check_hz, 62.5, 0.0);
    assert_int_equal(surface->body.node_capacity, 9000);
    assert_int_equal(surface->body.face_capacity, 8000);

    scene = read_valid(IN_BODY("levels = 1; adapt = {};"));
    surface = &scene->body[0].surface;
    assert_int_equal(surface->start_level, 0);
    assert_int_equal(surface->adjust, ADJUST_CONTINUUM);
    expect_near(surface->adapt.force, 0.005, 0.0);
    expect_near(surface->adapt.speed, 0.3, 0.0);
    expect_near(surface->adapt.curvature, 1.6, 0.0);
    expect_near(surface->adapt.check_hz, 100.0, 0.0);
    assert_int_equal(surface->body.node_capacity, 0);

    scene = read_valid(IN_BODY("levels = 1;"));
    assert_false(scene->body[0].surface.adaptive);
}

TEST(checks_follow_a_lower_rate)
{
    SCOPED(scene_destroy) Scene scene;
    Status status = {0};
    assert_string_equal(read_as_scene("rate_hz = 50;\n" IN_BODY("levels = 1; adapt = {};"), &scene),
                        "");
    expect_near(scene.body[0].surface.adapt.check_hz, 50.0, 0.0);
    assert_true(scene_override(&scene, 20.0, NULL, &status));
    expect_near(scene.body[0].surface.adapt.check_hz, 20.0, 0.0);
}

TEST(generators_take_their_own_keys_only)
{
    const Scene *scene = read_valid(MESH("generator = \"sphere\"; nodes = 60; radius = 1;"));
    assert_int_equal(scene->body[0].mesh.nodes, 60);
    scene = read_valid(MESH("generator = \"stomach\";"));
    assert_int_equal(scene->body[0].mesh.nodes, 188);
    expect_near(scene->body[0].mesh.length, 0.25, 0.0);
}

TEST(ico_sphere_counts_nodes_or_subdivisions)
{
    const Scene *scene = read_valid(MESH("generator = \"ico_sphere\"; nodes = 642;"));
    assert_int_equal(scene->body[0].mesh.nodes, 642);
    scene = read_valid(MESH("generator = \"ico_sphere\"; subdivisions = 8;"));
    assert_int_equal(scene->body[0].mesh.nodes, 655362);
}

TEST(mesh_files_are_seen_from_the_scenes_folder)
{
    const Scene *scene =
        read_valid(MESH("file = \"organ.stl\"; scale = 0.001; "
                        "place = { translation = (1, 2, 3.5); rotation = [0, 0, 1]; };"));
    const MeshSource *mesh = &scene->body[0].mesh;
    assert_int_equal(mesh->kind, MESH_FILE);
    assert_string_equal(mesh->file, scratch_at("organ.stl"));
    expect_near(mesh->scale, 0.001, 0.0);
    expect_near(mesh->translation.z, 3.5, 0.0);
    expect_near(mesh->rotation.z, 1.0, 0.0);
    scene = read_valid(IN_BODY("initial = \"/data/start.h5\";"));
    assert_string_equal(scene->body[0].initial, "/data/start.h5");
}

TEST(uniform_and_physical_material_do_not_mix)
{
    const Scene *scene = read_valid(IN_BODY("material = { spring_stiffness = 40; node_mass = "
                                            "0.001; node_damping = 0.5; };"));
    const SurfaceMaterial *material = &scene->body[0].surface.material;
    assert_true(material->uniform);
    expect_near(material->spring_stiffness, 40.0, 0.0);
    expect_near(material->spring_damping, 0.0, 0.0);
    expect_near(material->node_mass, 0.001, 0.0);
    expect_near(material->node_damping, 0.5, 0.0);
}

TEST(shape_is_a_frequency_or_a_stiffness_a_node)
{
    const Scene *scene = read_valid(IN_BODY("shape = { frame = \"body\"; };"));
    const SurfaceShape *shape = &scene->body[0].surface.shape;
    assert_true(shape->wanted && !shape->per_node);
    expect_near(shape->angular_frequency, 50.0, 0.0);
    expect_near(shape->damping_ratio, 0.1, 0.0);
    assert_int_equal(shape->frame, SHAPE_BODY);
    scene = read_valid(IN_BODY("shape = { stiffness = 3; damping = 0.5; };"));
    assert_true(scene->body[0].surface.shape.per_node);
    expect_near(scene->body[0].surface.shape.stiffness, 3.0, 0.0);
}

TEST(fixed_takes_boxes_spheres_and_nodes)
{
    const Scene *scene =
        read_valid(IN_BODY("fixed = ( { box = ([-1, -1, -1.5], [1, 1, 0]); },\n"
                           "{ sphere = (0, 0, 1); radius = 2; }, { nodes = [4, 2]; } );"));
    const FixedRegion *fixed = scene->body[0].options.fixed;
    assert_int_equal(scene->body[0].surface.body.fixed_count, 3);
    assert_ptr_equal(scene->body[0].surface.body.fixed, fixed);
    assert_int_equal(fixed[0].kind, FIXED_BOX);
    expect_near(fixed[0].low.z, -1.5, 0.0);
    expect_near(fixed[0].high.x, 1.0, 0.0);
    assert_int_equal(fixed[1].kind, FIXED_SPHERE);
    expect_near(fixed[1].center.z, 1.0, 0.0);
    expect_near(fixed[1].radius, 2.0, 0.0);
    assert_int_equal(fixed[2].kind, FIXED_NODES);
    assert_int_equal(fixed[2].node_count, 2);
    assert_int_equal(fixed[2].node[1], 2);
}

#define TOOL(text) BODY "tools = ( { id = 1; " text " } );"

TEST(tools_have_the_shapes_of_their_kind)
{
    const Scene *scene =
        read_valid(TOOL("kind = \"probe\"; capsules = ( { from = (0, 0, 1); radius = 0.1; } ); "));
    assert_int_equal(scene->tool[0].capsule_count, 1);
    // Without `to` the capsule is a ball.
    expect_near(scene->tool[0].capsule[0].to.z, 1.0, 0.0);
    expect_near(scene->tool[0].max_force, 3.3, 0.0);
    scene = read_valid(TOOL("kind = \"static\"; plane = { normal = (0, 0, 5); }; "));
    assert_true(scene->tool[0].has_plane);
    expect_near(scene->tool[0].plane.normal.z, 1.0, 0.0);
}

TEST(blades_have_an_edge_and_may_have_a_back)
{
    const Scene *scene =
        read_valid(TOOL("kind = \"blade\"; edge = ( [0, 0, 0], [0.0, 0.0, 0.02] ); "));
    assert_int_equal(scene->tool[0].kind, TOOL_BLADE);
    assert_int_equal(scene->tool[0].capsule_count, 0);
    expect_near(scene->tool[0].edge[0].z, 0.0, 0.0);
    expect_near(scene->tool[0].edge[1].z, 0.02, 0.0);
    expect_near(scene->tool[0].max_force, 3.3, 0.0);
    scene = read_valid(TOOL("kind = \"blade\"; edge = ( (0, 0, 0), (0, 0, 1) ); max_force = 1; "
                            "capsules = ( { from = (0, 1, 0); radius = 0.1; } ); "));
    assert_int_equal(scene->tool[0].capsule_count, 1);
}

TEST(loads_find_their_body)
{
#define LOAD(body)                                                                                 \
    "bodies = ( { name = \"one\"; mesh = { generator = \"sheet\"; }; },\n"                         \
    " { name = \"two\"; mesh = { generator = \"sheet\"; }; } );\n"                                 \
    "loads = ( { " body "center = (0, 0, 0); radius = 1; force = (0, 0, -1); duration = 2; } );"
    const Scene *scene = read_valid(LOAD("body = \"two\"; "));
    assert_int_equal(scene->load[0].load.body, 1);
    expect_near(scene->load[0].load.force.z, -1.0, 0.0);
    expect_near(scene->load[0].load.start, 0.0, 0.0);
    expect_near(scene->load[0].load.duration, 2.0, 0.0);
    scene = read_valid(LOAD("body = \"\"; "));
    assert_int_equal(scene->load[0].load.body, -1);
    scene = read_valid(LOAD(""));
    assert_int_equal(scene->load[0].load.body, -1);
}

TEST(publish_rates_do_not_exceed_the_tick_rate)
{
    const Scene *scene = read_valid("rate_hz = 30;\n" BODY);
    expect_near(scene->publish.nodes_hz, 30.0, 0.0);
    expect_near(scene->publish.contact_hz, 30.0, 0.0);
    expect_near(scene->publish.mesh_hz, 1.0, 0.0);
}

TEST(counts_are_limited)
{
    static char text[65536];
    size_t length = (size_t)snprintf(text, sizeof text, "%sloads = (", BODY);
    for (int i = 0; i < SIM_LOADS + 1; i++)
        length += (size_t)snprintf(
            text + length, sizeof text - length,
            "%s{ center = (0, 0, 0); radius = 1; force = (0, 0, 1); duration = 1; }",
            i > 0 ? "," : "");
    snprintf(text + length, sizeof text - length, ");");
    expect_error(text, "x.cfg:2: loads has 65 entries, at most 64");
}

// By the claims of which they are the other side.
static const WrongScene WRONG[] = {
    // step may have several threads
    {"threads = 9;\n" BODY, "1: threads 9 outside [1, 8]"},
    {"threads = 0;\n" BODY, "1: threads 0 outside [1, 8]"},
    // implicit integration has its keys
    {IN_BODY("theta = 0.4;"), "2: theta 0.4 outside [0.5, 1]"},
    // shape springs may be damped along themselves
    {IN_BODY("shape = { frame = \"body\";\ndamping_direction = \"radial\"; };"),
     "3: damping_direction \"radial\" needs frame \"world\""},
    {IN_BODY("integrator = \"implicit\"; shape = { damping_direction = \"radial\"; };"),
     "2: damping_direction \"radial\" needs an explicit integrator, not \"implicit\""},
    {IN_BODY("integrator = \"auto\"; shape = { damping_direction = \"radial\"; };"),
     "2: damping_direction \"radial\" needs an explicit integrator, not \"auto\""},
    // cuttable body may tear by stretch
    {IN_BODY("tear = { stretch = 0.5; };"), "2: tear needs cuttable = true"},
    {IN_BODY("cuttable = true; tear = {};"), "2: tear is empty: give it stretch"},
    {IN_BODY("cuttable = true; tear = { stress = 2000; };"),
     "2: tear.stress means nothing for a surface body, only stretch"},
    {IN_BODY("cuttable = true; tear = { force = 2; };"),
     "2: tear.force means nothing for a surface body, only stretch"},
    {IN_BODY("cuttable = true; tear = { stretch = 0; };"), "2: tear.stretch 0 outside (0, 100]"},
    {IN_BODY("split_budget = 16;"), "2: split_budget means nothing for a surface body"},
    // surface body needs a mesh and no key of a voxel body
    {"bodies = (\n{ name = \"a\"; } );", "2: bodies.mesh is missing (Source of its triangles.)"},
    {IN_BODY("voxels = {};"), "2: voxels means nothing for a surface body"},
    {IN_BODY("law = \"affine\";"), "2: law means nothing for a surface body"},
    {IN_BODY("dimensions = 3;"), "2: dimensions means nothing for a surface body"},
    {IN_BODY("materials = ();"), "2: materials means nothing for a surface body"},
    {IN_BODY("skin = {};"), "2: skin means nothing for a surface body"},
    {IN_BODY("material = { youngs_modulus = 1e4; };"),
     "2: unknown key youngs_modulus in bodies.material: did you mean youngs_modulus_2d "
     "(N/m: Young's modulus times thickness)?"},
    // levels that do not go together are refused
    {IN_BODY("levels = 9;"), "2: levels 9 outside [0, 8]"},
    {IN_BODY("start_level = 1;"), "2: start_level 1 exceeds levels 0"},
    {IN_BODY("levels = 2;\nstart_level = 3;"), "3: start_level 3 exceeds levels 2"},
    {IN_BODY("levels = 2; adapt = { coarsest = 3; };"), "2: coarsest 3 exceeds levels 2"},
    {IN_BODY("levels = 2;\nstart_level = 0; adapt = { coarsest = 1; };"),
     "3: start_level 0 is below adapt.coarsest 1"},
    {IN_BODY("adapt = {};"),
     "2: adapt needs levels, the finest level of detail: set it to 1 or more"},
    {IN_BODY("levels = 1; adapt = { force = 0; };"), "2: adapt.force 0 outside (0, 1e+09]"},
    {"rate_hz = 50;\n" IN_BODY("levels = 1; adapt = { check_hz = 60; };"),
     "3: check_hz 60 exceeds rate_hz 50"},
    {IN_BODY("levels = 1; adjust = \"choi\";"),
     "2: adjust \"choi\" must be one of \"continuum\", \"choi2005\""},
    // generators take their own keys only
    {MESH("generator = \"sphere\"; rings = 3;"), "2: rings means nothing for a mesh from sphere"},
    {MESH("file = \"a.stl\"; nodes = 30;"), "2: nodes means nothing for a mesh from a file"},
    {MESH("generator = \"sphere\"; nodes = 20001;"), "2: nodes 20001 outside [4, 20000]"},
    {MESH("generator = \"stomach\"; nodes = 59;"), "2: nodes 59 outside [60, 20000]"},
    {MESH("scale = 1;"), "2: mesh needs a file or generator"},
    {MESH("generator = \"sphere\"; file = \"a.stl\";"),
     "2: mesh needs only one of file or generator"},
    // ico sphere counts nodes or subdivisions
    {MESH("generator = \"ico_sphere\"; nodes = 100;"),
     "2: nodes 100 is no ico_sphere: 10 * 4^s + 2, as 12, 42, 162, 642, 2562"},
    {MESH("generator = \"ico_sphere\"; nodes = 42; subdivisions = 1;"),
     "2: nodes and subdivisions are two ways to say the same"},
    // uniform and physical material do not mix
    {IN_BODY("material = { spring_stiffness = 40; node_mass = 1; areal_density = 1; };"),
     "2: spring_stiffness cannot be mixed with areal_density"},
    {IN_BODY("material = { spring_damping = 1; node_mass = 1; };"),
     "2: bodies.material.spring_stiffness is missing: it goes with spring_damping"},
    {IN_BODY("material = { spring_stiffness = 1; };"),
     "2: bodies.material.node_mass is missing: it goes with spring_stiffness"},
    // shape is a frequency or a stiffness a node
    {IN_BODY("shape = { damping_ratio = 1; damping = 1; };"),
     "2: damping cannot be mixed with damping_ratio"},
    {IN_BODY("shape = { damping = 1; };"),
     "2: bodies.shape.stiffness is missing: it goes with damping"},
    // fixed takes boxes spheres and nodes
    {IN_BODY("fixed = ( { } );"),
     "2: fixed entry must be one of { box }, { sphere; radius } and { nodes }"},
    {IN_BODY("fixed = ( { sphere = (0, 0, 0); } );"),
     "2: fixed radius is missing: a ball has a sphere and a radius"},
    {IN_BODY("fixed = ( { box = ([0, 0, 1], [1, 1, 0]); } );"),
     "2: box is empty: its first corner must be the lower one"},
    {IN_BODY("fixed = ( { nodes = [1, -2]; } );"), "2: nodes -2 outside [0, 268435456]"},
    {IN_BODY("fixed = ( 3 );"), "2: fixed entry 3 must be a group { ... }"},
    // tools have the shapes of their kind
    {TOOL("kind = \"probe\"; "), "2: tool 1 has no shape: give it capsules"},
    {TOOL("kind = \"static\"; "), "2: tool 1 has no shape: give it capsules or a plane"},
    {TOOL("kind = \"probe\"; plane = { normal = (0, 0, 1); }; "),
     "2: plane means nothing for a probe, only for kind static"},
    {TOOL("kind = \"static\"; max_force = 2; plane = { normal = (0, 0, 1); }; "),
     "2: max_force means nothing for a static tool: it never yields"},
    {TOOL("kind = \"probe\"; edge = ( (0, 0, 0), (0, 0, 1) ); "
          "capsules = ( { from = (0, 0, 1); radius = 0.1; } ); "),
     "2: edge means nothing for this tool, only for kind blade"},
    // blades have an edge and may have a back
    {TOOL("kind = \"blade\"; "), "2: blade 1 has no edge: ([x, y, z], [x, y, z])"},
    {TOOL("kind = \"blade\"; edge = ( (0, 0, 0) ); "),
     "2: edge must be two ends ([x, y, z], [x, y, z])"},
    {TOOL("kind = \"blade\"; edge = ( (1, 0, 0), (1, 0, 0) ); "),
     "2: edge has no length: its two ends are the same"},
    {TOOL("kind = \"blade\"; edge = ( (0, 0, 0), (0, 0, 1) ); "
          "plane = { normal = (0, 0, 1); }; "),
     "2: plane means nothing for a blade, only for kind static"},
    // loads find their body
    {LOAD("body = \"tow\"; "), "3: body \"tow\" is not in the scene: its bodies are one, two"},
    {LOAD("body = \"twoo\"; "), "3: body \"twoo\" is not in the scene: did you mean \"two\"?"},
    // names and ids are unique and fit a channel
    {"bodies = ( { name = \"a\"; mesh = { generator = \"sheet\"; }; },\n"
     " { name = \"a\"; mesh = { generator = \"sheet\"; }; } );\n",
     "2: name \"a\" is taken by the body at line 1"},
    {BODY "tools = ( { id = 1; kind = \"probe\"; capsules = ( { radius = 1; } ); },\n"
          "{ id = 1; kind = \"probe\"; capsules = ( { radius = 1; } ); } );",
     "3: id 1 is taken by another tool"},
    // 31 + 12 + 21 = 64 characters, one more than LCM carries.
    {"prefix = \"abcdefghijabcdefghijabcdefghij1\";\n"
     "bodies = ( { name = \"abcdefghijabcdefghij1\"; mesh = { generator = \"sheet\"; }; } );",
     "2: name \"abcdefghijabcdefghij1\" makes channel "
     "abcdefghijabcdefghijabcdefghij1_MESH_DELTA_abcdefghijabcdefghij1 longer than 63 characters"},
    // publish rates do not exceed the tick rate
    {"rate_hz = 30;\npublish = {\n nodes_hz = 60; };" BODY, "3: nodes_hz 60 exceeds rate_hz 30"},
    // counts are limited
    {"bodies = ( );", "1: bodies is empty: at least one body"},
    {"", " bodies is missing (The soft bodies: 1 to 64 groups.)"},
    // duplicate keys and syntax errors show their line
    {"rate_hz = 5;\nrate_hz = 6;\n" BODY,
     "2: duplicate setting name: it is given above, remove one of both: rate_hz = 6;"},
    {"rate_hz = ;\n", "1: syntax error: rate_hz has no value: rate_hz = ;"},
    {"\nname = \"x;\n", "2: a string begins here and does not end"},
    {"gravity = [nan, 0.0, 0.0];\n",
     "1: syntax error: nan is no number of a scene: gravity = [nan, 0.0, 0.0];"},
    // and say what is wrong in it and what is right
    {"name = ball;\n", "1: syntax error: a text has quotes: \"ball\": name = ball;"},
    {"name = my organ.stl ;\n",
     "1: syntax error: a text has quotes: \"my organ.stl\": name = my organ.stl ;"},
    {"name = 'ball';\n", "1: syntax error: the quotes of a text are \" and \": name = 'ball';"},
    {"\"name\": \"ball\"\n", "1: syntax error: a key has no quotes: \"name\": \"ball\""},
    {"remote = yes;\n", "1: syntax error: yes is written true: remote = yes;"},
    {"remote = off\n", "1: syntax error: off is written false: remote = off"},
    {"rate_hz = 0,5;\n", "1: syntax error: a decimal has a point: 0.5: rate_hz = 0,5;"},
    {"gravity = [0,0, 0,0, -9,81];\n",
     "1: gravity has 6 entries and must be three numbers [x, y, z], with points in decimals, not "
     "commas"},
    {"rate_hz = 1.000.0;\n",
     "1: syntax error: 1.000.0 has more than one point: rate_hz = 1.000.0;"},
    {"rate_hz = 1 kHz;\n", "1: syntax error: a number has no unit: 1 without kHz, in m, kg, s, N "
                           "or Pa: rate_hz = 1 kHz;"},
    {"rate_hz = 5mm;\n",
     "1: syntax error: a number has no unit: 5 without mm, in m, kg, s, N or Pa: rate_hz = 5mm;"},
    {"rate_hz = 50%;\n", "1: syntax error: % means nothing here: rate_hz = 50%;"},
    {"rate_hz 50;\n",
     "1: syntax error: rate_hz is followed by neither = nor a value, as in rate_hz = ...;: rate_hz "
     "50;"},
    {"rate_hz =\nname = \"a\";\n", "2: syntax error: rate_hz has no value: name = \"a\";"},
    {"gravity = [0 0 1];\n", "1: syntax error: a comma is missing before 0: gravity = [0 0 1];"},
    {"gravity = [0; 0];\n",
     "1: syntax error: entries of a list are separated by commas: gravity = [0; 0];"},
    {"tools = (\nid = 1 );\n",
     "2: syntax error: keys in a list stand in groups: ( { id = ...; } ): id = 1 );"},
    {"tools = (\n{ id = 1; );\n",
     "2: syntax error: ) is here before { of line 2 is closed: { id = 1; );"},
    {"publish = {\n# }\n/* }\n */", "4: syntax error: { of line 1 is not closed: */"},
    {"/* yes\n = 0,5 */ # 'x'\nname = \"yes = 0,5\" \"}\"; remote = True;\n};\n",
     "4: syntax error: } closes nothing: };"},
    // keys of other groups are sent there, and unknown ones shown what there is
    {BODY "tool = ();\n", "2: unknown key tool in the scene: did you mean tools?"},
    {"body = ();\n", "1: unknown key body in the scene: did you mean bodies?"},
    {"Bodies = ();\n", "1: unknown key Bodies in the scene: did you mean bodies?"},
    {"time_step = 1e-3;\n", "1: unknown key time_step in the scene: it is a key of bodies"},
    {IN_BODY("material = { density = 1050.0; };"),
     "2: unknown key density in bodies.material: did you mean areal_density (kg/m2: Mass per unit "
     "area)?"},
    {MESH("zzz = 1;"), "2: unknown key zzz in bodies.mesh, whose keys are file, generator, nodes, "
                       "subdivisions, rings, "
                       "segments, columns, rows, radius, width, height, length, scale, place"},
    // integers beyond 32 bits are refused not cut
    // libconfig would read 4294968296 as 1000, a valid rate.
    {"# 4294968296\nrate_hz = 4294968296;\n" BODY, "2: integer 4294968296 does not fit 32 bits"},
    {"rate_hz = 0x1000003e8;\n" BODY, "1: integer 0x1000003e8 does not fit 32 bits"},
    // includes that cannot be read are named
    {"\n@include \"none.inc\"\n", "2: @include \"none.inc\": No such file or directory"},
    // libconfig's scanner would end the process.
    {"@include \".\"\n", "1: @include \".\" is not a regular file"},
    {"@include \"/dev/zero\"\n",
     "1: @include \"/dev/zero\" must be a path from the scene file's folder, written with /"},
};

TEST(wrong_keys_are_refused_in_these_words)
{
    expect_errors(WRONG, sizeof WRONG / sizeof *WRONG);
}

// --- files -------------------------------------------------------------------------------------

TEST(integers_beyond_32_bits_are_refused_not_cut)
{
    const Scene *scene = read_valid("rate_hz = 0x3e8; # 4294968296\n/* 4294968296 */\n" BODY);
    expect_near(scene->sim.rate_hz, 1000.0, 0.0);
}

TEST(errors_in_included_files_name_the_included_file)
{
    const Scene *scene;
    const char *include = "\n@include \"part.inc\"\n" BODY;
    scratch_write(&scratch_space, "part.inc", "rate_hz = 500;\n", 15);
    scene = read_valid(include);
    expect_near(scene->sim.rate_hz, 500.0, 0.0);
    assert_string_equal(scene->text, include);
    scratch_write(&scratch_space, "part.inc", "\nrate_hz = 0;\n", 14);
    expect_error(include, "part.inc:2: rate_hz 0 outside [1, 10000]");
    scratch_write(&scratch_space, "part.inc", "rate_hz = 99999999999;\n", 23);
    expect_error(include, "part.inc:1: integer 99999999999 does not fit 32 bits");
    scratch_write(&scratch_space, "part.inc", "\n\ngravity = [0, 1.0, 0];\n", 25);
    expect_error(include,
                 "part.inc:3: mismatched element type in array: in [ ] write 0.0 for 0, or "
                 "use ( ): gravity = [0, 1.0, 0];");
}

TEST(includes_that_cannot_be_read_are_named)
{
    Scene scene;
    expect_in(read_as_scene("@include \"x.cfg\"\n", &scene),
              "x.cfg:1: @include \"x.cfg\" is nested deeper than 10 files");
}

TEST(scene_files_that_cannot_be_read_are_named)
{
    Scene scene;
    Status status = {0};
    assert_false(scene_read("no-such-scene.cfg", &scene, &status));
    assert_string_equal(status.text, "no-such-scene.cfg: No such file or directory");
    status = (Status){0};
    assert_false(scene_read("/", &scene, &status));
    assert_string_equal(status.text, "/ is not a regular file");
    scratch_write(&scratch_space, "zero.cfg", "a = 1;\0b", 8);
    status = (Status){0};
    assert_false(scene_read(scratch_at("zero.cfg"), &scene, &status));
    expect_in(status.text, "holds a zero byte: it is not text");
}
