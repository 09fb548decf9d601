// SPDX-License-Identifier: MIT
// The meaning of the keys of voxel bodies in scene files: defaults, sources of voxels, materials by
// label, the plane case, and what is refused.
#include "test.h"
#include "scene_text.h"

#if defined(PLIANT_WITH_VOXEL) && defined(PLIANT_WITH_PLANE)

// The body opens in line 1 and has its voxels there; the keys under test are in line 2.
#define START         "bodies = ( { name = \"a\"; model = \"voxel\"; "
#define IN_BODY(text) START "voxels = { file = \"liver.nrrd\"; label = [3, 7]; };\n" text " } );\n"
#define VOXELS(text)  START "\nvoxels = { " text " }; } );\n"

AROUND_ALL(scratch_begin, scratch_end)

TEST(a_bare_voxel_body_takes_all_defaults)
{
    const Scene *scene = read_valid(START "voxels = { generator = \"box\"; }; } );");
    const SceneBody *body = &scene->body[0];
    assert_int_equal(body->model, MODEL_VOXEL);
    assert_string_equal(scene_model_name(body->model), "voxel");
    assert_string_equal(body->name, "a");
    const VoxelSource *voxels = &body->voxels;
    assert_int_equal(voxels->kind, VOXELS_BOX);
    assert_null(voxels->file);
    assert_int_equal(voxels->label_count, 1);
    assert_int_equal(voxels->label[0], 1);
    for (int k = 0; k < 3; k++)
        assert_int_equal(voxels->count[k], 16);
    expect_near(voxels->size, 0.003125, 0.0);
    expect_near(voxels->scale, 1.0, 0.0);
    expect_near(vec3_length(voxels->rotation) + vec3_length(voxels->translation), 0.0, 0.0);
    const VoxelOptions *voxel = &body->voxel;
    assert_int_equal(body->dimensions, 3);
    assert_int_equal(voxel->body.levels, 2);
    assert_int_equal(voxel->law, VOXEL_AFFINE);
    assert_int_equal(voxel->material_count, 1);
    expect_near(voxel->material[0].youngs_modulus, 1e4, 0.0);
    expect_near(voxel->material[0].poisson_ratio, 0.0, 0.0);
    expect_near(voxel->material[0].density, 1000.0, 0.0);
    expect_near(voxel->damping, 0.2, 0.0);
    expect_near(voxel->damping_time, 0.0, 0.0);
    expect_near(voxel->drag, 4.0, 0.0);
    assert_int_equal(voxel->body.integrator, INTEGRATOR_SYMPLECTIC_EULER);
    expect_near(voxel->body.time_step, 0.0, 0.0);
    assert_false(voxel->body.unsafe_time_step);
    expect_near(voxel->body.contact_ratio, 0.5, 0.0);
    expect_near(voxel->body.contact_damping, 2e-4, 0.0);
    expect_near(voxel->body.friction, 0.2, 0.0);
    assert_int_equal(voxel->body.fixed_count, 0);
    assert_null(body->skin.file);
    assert_null(body->initial);
}

TEST(keys_of_both_models_are_read_as_written)
{
    const Scene *scene = read_valid(
        IN_BODY("levels = 5; law = \"miyazaki2004\"; integrator = \"leapfrog\"; "
                "time_step = 0.0003; unsafe_time_step = true; initial = \"start.h5\"; "
                "contact = { stiffness = 2; damping_time = 0.001; friction = 0; }; "
                "cuttable = true; split_budget = 4; tear = { stress = 2000; }; "
                "fixed = ( { box = ([-1, -1, -1], [1, 1, 0]); }, { nodes = [4, 9]; } );"));
    const VoxelOptions *voxel = &scene->body[0].voxel;
    assert_int_equal(voxel->body.levels, 5);
    assert_int_equal(voxel->law, VOXEL_MIYAZAKI2004);
    assert_int_equal(voxel->body.integrator, INTEGRATOR_LEAPFROG);
    expect_near(voxel->body.time_step, 0.0003, 0.0);
    assert_true(voxel->body.cuttable);
    assert_int_equal(voxel->split_budget, 4);
    expect_near(voxel->tear_stress, 2000.0, 0.0);
    expect_near(voxel->tear_force, 0.0, 0.0);
    assert_true(voxel->body.unsafe_time_step);
    assert_string_equal(scene->body[0].initial, scratch_at("start.h5"));
    expect_near(voxel->body.contact_ratio, 2.0, 0.0);
    expect_near(voxel->body.contact_damping, 0.001, 0.0);
    expect_near(voxel->body.friction, 0.0, 0.0);
    assert_int_equal(voxel->body.fixed_count, 2);
    assert_ptr_equal(voxel->body.fixed, scene->body[0].options.fixed);
    assert_int_equal(voxel->body.fixed[1].kind, FIXED_NODES);
    assert_int_equal(voxel->body.fixed[1].node[1], 9);
    scene = read_valid(IN_BODY("levels = 0; integrator = \"symplectic_euler\";"));
    assert_int_equal(scene->body[0].voxel.body.levels, 0);
    assert_int_equal(scene->body[0].voxel.body.integrator, INTEGRATOR_SYMPLECTIC_EULER);
}

TEST(levels_are_a_number_or_a_group)
{
    const Scene *scene = read_valid(IN_BODY("levels = {};"));
    const VoxelOptions *voxel = &scene->body[0].voxel;
    assert_int_equal(voxel->body.levels, 2);
    assert_int_equal(voxel->surface_level, 0);
    assert_int_equal(voxel->fine_count, 0);
    scene = read_valid(IN_BODY("levels = { inside = 1; };"));
    assert_int_equal(scene->body[0].voxel.body.levels, 1);
    scene = read_valid(IN_BODY("levels = { inside = 3; surface = 2; fine = ( { sphere = [1, 2, 3]; "
                               "radius = 4; }, { sphere = [0, 0, 0]; radius = 0.5; } ); };"));
    voxel = &scene->body[0].voxel;
    assert_int_equal(voxel->body.levels, 3);
    assert_int_equal(voxel->surface_level, 2);
    assert_int_equal(voxel->fine_count, 2);
    expect_near(voxel->fine[0].centre.z, 3.0, 0.0);
    expect_near(voxel->fine[0].radius, 4.0, 0.0);
    expect_near(voxel->fine[1].radius, 0.5, 0.0);
    // As loaded, blades may cut such a body or not.
    assert_false(voxel->body.cuttable);
    scene = read_valid(IN_BODY("levels = { surface = 1; }; cuttable = true;"));
    assert_true(scene->body[0].voxel.body.cuttable);
}

TEST(volumes_have_labels_and_their_own_spacing)
{
    const Scene *scene = read_valid(VOXELS("file = \"liver.nrrd\";"));
    const VoxelSource *voxels = &scene->body[0].voxels;
    assert_int_equal(voxels->kind, VOXELS_FILE);
    assert_string_equal(voxels->file, scratch_at("liver.nrrd"));
    assert_int_equal(voxels->label_count, 1);
    assert_int_equal(voxels->label[0], 1);
    expect_near(voxels->size, 0.0, 0.0);

    scene = read_valid(
        VOXELS("file = \"/data/liver.nii\"; label = 1000000000; size = 0.004; "
               "scale = 2; place = { translation = (1, 2, 3); rotation = (0, 1, 0); };"));
    voxels = &scene->body[0].voxels;
    assert_string_equal(voxels->file, "/data/liver.nii");
    assert_int_equal(voxels->label[0], 1000000000);
    expect_near(voxels->size, 0.004, 0.0);
    expect_near(voxels->scale, 2.0, 0.0);
    expect_near(voxels->translation.z, 3.0, 0.0);
    expect_near(voxels->rotation.y, 1.0, 0.0);

    scene = read_valid(VOXELS("file = \"liver.nrrd\"; label = (9, 2, 4);"));
    voxels = &scene->body[0].voxels;
    assert_int_equal(voxels->label_count, 3);
    assert_int_equal(voxels->label[0], 9);
    assert_int_equal(voxels->label[2], 4);
    assert_int_equal(scene->body[0].voxel.material_count, 3);
}

TEST(labels_are_limited_to_what_a_lattice_holds)
{
    static char text[8192];
    Scene scene;
    for (int count = LATTICE_MATERIALS; count <= LATTICE_MATERIALS + 1; count++) {
        size_t length =
            (size_t)snprintf(text, sizeof text, START "\nvoxels = { file = \"a.nrrd\"; label = [");
        for (int i = 1; i <= count; i++)
            length +=
                (size_t)snprintf(text + length, sizeof text - length, "%s%d", i > 1 ? "," : "", i);
        snprintf(text + length, sizeof text - length, "]; }; } );");
        assert_string_equal(
            read_as_scene(text, &scene),
            count <= LATTICE_MATERIALS ? "" : "x.cfg:2: label has 256 entries, at most 255");
        if (count <= LATTICE_MATERIALS)
            scene_destroy(&scene);
    }
}

TEST(meshes_are_filled_with_cells_of_a_size)
{
    const Scene *scene = read_valid(VOXELS("mesh = \"liver.stl\"; size = 0.004; scale = 0.001;"));
    const VoxelSource *voxels = &scene->body[0].voxels;
    assert_int_equal(voxels->kind, VOXELS_MESH);
    assert_string_equal(voxels->file, scratch_at("liver.stl"));
    expect_near(voxels->size, 0.004, 0.0);
    expect_near(voxels->scale, 0.001, 0.0);
    assert_int_equal(voxels->label_count, 1);
}

TEST(voxel_generators_take_their_own_keys_only)
{
    const Scene *scene = read_valid(VOXELS("generator = \"box\"; count = [8, 4, 2]; size = 0.01;"));
    const VoxelSource *voxels = &scene->body[0].voxels;
    assert_int_equal(voxels->count[0], 8);
    assert_int_equal(voxels->count[1], 4);
    assert_int_equal(voxels->count[2], 2);
    expect_near(voxels->size, 0.01, 0.0);
    scene = read_valid(VOXELS("generator = \"box\"; count = 32;"));
    for (int k = 0; k < 3; k++)
        assert_int_equal(scene->body[0].voxels.count[k], 32);
    scene = read_valid(VOXELS("generator = \"ball\"; radius = 0.02;"));
    assert_int_equal(scene->body[0].voxels.kind, VOXELS_BALL);
    expect_near(scene->body[0].voxels.radius, 0.02, 0.0);
    scene = read_valid(VOXELS("generator = \"ball\";"));
    expect_near(scene->body[0].voxels.radius, 0.05, 0.0);
}

TEST(plane_bodies_are_boxes_and_discs_in_their_plane)
{
    const Scene *scene = read_valid(VOXELS("generator = \"disc\"; radius = 0.05;"));
    assert_int_equal(scene->body[0].dimensions, 2);
    assert_int_equal(scene->body[0].model, MODEL_PLANE);
    scene = read_valid(VOXELS("generator = \"disc\"; dimensions = 2;"));
    assert_int_equal(scene->body[0].dimensions, 2);
    scene = read_valid(START "dimensions = 2;\nvoxels = { generator = \"box\"; count = [32, 8]; "
                             "dimensions = 2; place = { translation = (1, 2, 0); "
                             "rotation = (0, 0, 0.5); }; }; } );");
    assert_int_equal(scene->body[0].dimensions, 2);
    assert_int_equal(scene->body[0].voxels.count[1], 8);
    assert_int_equal(scene->body[0].voxels.count[2], 1);
    scene = read_valid(VOXELS("generator = \"box\"; count = 32; dimensions = 2;"));
    assert_int_equal(scene->body[0].voxels.count[1], 32);
    assert_int_equal(scene->body[0].voxels.count[2], 1);
    // A single layer of cells is a thin solid as long as nobody says otherwise.
    scene = read_valid(VOXELS("generator = \"box\"; count = [32, 32, 1];"));
    assert_int_equal(scene->body[0].dimensions, 3);
}

TEST(plane_bodies_tear_by_force_and_divide_nothing)
{
    const Scene *scene;
    static const char DISC[] = "voxels = { generator = \"disc\"; }; cuttable = true;\n";
    char text[512];
    snprintf(text, sizeof text, START "%s tear = { force = 2; }; } );", DISC);
    scene = read_valid(text);
    expect_near(scene->body[0].voxel.tear_force, 2.0, 0.0);
    snprintf(text, sizeof text, START "%s tear = { stress = 2000; }; } );", DISC);
    expect_error(text, "x.cfg:2: tear.stress means nothing for a plane body, only force");
    snprintf(text, sizeof text, START "%s split_budget = 3; } );", DISC);
    expect_error(text, "x.cfg:2: split_budget means nothing for a plane body: a cut divides none "
                       "of its elements");
}

TEST(labels_without_an_entry_take_the_bodys_material)
{
    const Scene *scene = read_valid(
        IN_BODY("material = { youngs_modulus = 5000; poisson_ratio = 0.3; density = 1060; "
                "damping = 0.4; }; materials = ( { label = 7; youngs_modulus = 2e4; } );"));
    const VoxelOptions *voxel = &scene->body[0].voxel;
    assert_int_equal(voxel->material_count, 2);
    assert_ptr_equal(voxel->material, scene->body[0].material);
    expect_near(voxel->damping, 0.4, 0.0);
    expect_near(voxel->material[0].youngs_modulus, 5000.0, 0.0);
    expect_near(voxel->material[1].youngs_modulus, 2e4, 0.0);
    for (int i = 0; i < 2; i++) {
        expect_near(voxel->material[i].poisson_ratio, 0.3, 0.0);
        expect_near(voxel->material[i].density, 1060.0, 0.0);
    }
    scene = read_valid(IN_BODY("materials = ( { label = 3; poisson_ratio = 0.49; }, "
                               "{ label = 7; density = 2000; } );"));
    voxel = &scene->body[0].voxel;
    expect_near(voxel->material[0].poisson_ratio, 0.49, 0.0);
    expect_near(voxel->material[0].density, 1000.0, 0.0);
    expect_near(voxel->material[1].density, 2000.0, 0.0);
    expect_near(voxel->material[1].youngs_modulus, 1e4, 0.0);
}

TEST(materials_must_be_of_labels_that_are_chosen)
{
    const Scene *scene;
    // Cells that no volume labelled have label 1.
    scene = read_valid(START "voxels = { generator = \"box\"; };\n"
                             "materials = ( { label = 1; density = 900; } ); } );");
    expect_near(scene->body[0].material[0].density, 900.0, 0.0);
}

TEST(paper_law_has_no_poisson_ratio)
{
    read_valid(IN_BODY("law = \"miyazaki2004\"; material = { poisson_ratio = 0; };"));
}

TEST(skin_is_a_mesh_placed_like_others)
{
    const Scene *scene = read_valid(IN_BODY("skin = { mesh = \"liver.stl\"; };"));
    assert_string_equal(scene->body[0].skin.file, scratch_at("liver.stl"));
    assert_int_equal(scene->body[0].skin.kind, MESH_FILE);
    expect_near(scene->body[0].skin.scale, 1.0, 0.0);
    scene = read_valid(IN_BODY("skin = { mesh = \"liver.stl\"; scale = 0.001; "
                               "place = { translation = (1, 2, 3); rotation = (0, 0, 1); }; };"));
    expect_near(scene->body[0].skin.scale, 0.001, 0.0);
    expect_near(scene->body[0].skin.translation.y, 2.0, 0.0);
    expect_near(scene->body[0].skin.rotation.z, 1.0, 0.0);
}

TEST(keys_of_a_surface_body_are_refused)
{
    static const char *const KEYS[][2] = {{"mesh", "{ file = \"a.stl\"; }"},
                                          {"start_level", "0"},
                                          {"adjust", "\"continuum\""},
                                          {"shape", "{ }"},
                                          {"prestress", "0"}};
    char text[256], expected[128];
    for (size_t i = 0; i < sizeof KEYS / sizeof KEYS[0]; i++) {
        snprintf(text, sizeof text, START "\n%s = %s; voxels = { }; } );", KEYS[i][0], KEYS[i][1]);
        snprintf(expected, sizeof expected, "x.cfg:2: %s means nothing for a voxel body",
                 KEYS[i][0]);
        expect_error(text, expected);
    }
}

// Whoever says how elements are damped, says all: no drag comes on top of it.
TEST(drag_is_for_bodies_that_say_nothing_of_damping)
{
    static const struct {
        const char *text;
        double damping, damping_time, drag;
    } CASES[] = {
        {"", 0.2, 0.0, 4.0},
        {"material = { youngs_modulus = 1e3; };", 0.2, 0.0, 4.0},
        {"material = { damping = 0.2; };", 0.2, 0.0, 0.0},
        {"material = { damping = 0.0; };", 0.0, 0.0, 0.0},
        {"material = { damping_time = 1e-3; };", 0.0, 1e-3, 0.0},
        {"material = { damping_time = 0.0; };", 0.0, 0.0, 0.0},
        {"material = { drag = 2.0; };", 0.2, 0.0, 2.0},
        {"material = { damping = 0.1; drag = 2.0; };", 0.1, 0.0, 2.0},
        {"material = { damping_time = 1e-3; drag = 2.0; };", 0.0, 1e-3, 2.0},
    };
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        const Scene *scene;
        char text[512];
        snprintf(text, sizeof text, START "voxels = { generator = \"box\"; }; %s } );",
                 CASES[i].text);
        scene = read_valid(text);
        expect_near(scene->body[0].voxel.damping, CASES[i].damping, 0.0);
        expect_near(scene->body[0].voxel.damping_time, CASES[i].damping_time, 0.0);
        expect_near(scene->body[0].voxel.drag, CASES[i].drag, 0.0);
    }
    const Scene *scene = read_valid(START "voxels = { generator = \"disc\"; }; } );");
    expect_near(scene->body[0].voxel.damping, 0.2, 0.0);
    expect_near(scene->body[0].voxel.drag, 0.0, 0.0);
}

// Two layers of two voxels; "tumour" and "liver" have the same number, in different ones.
static void write_segments(void)
{
    static const char text[] =
        "NRRD0005\ntype: uchar\ndimension: 4\nsizes: 2 2 1 1\nkinds: list domain domain domain\n"
        "space: LPS\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\nencoding: ascii\n"
        "Segment0_Name:=liver\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n"
        "Segment1_Name:=vein\nSegment1_LabelValue:=5\nSegment1_Layer:=1\n"
        "Segment2_Name:=tumour\nSegment2_LabelValue:=1\nSegment2_Layer:=1\n\n1 5 0 1\n";
    scratch_write(&scratch_space, "segments.nrrd", text, sizeof text - 1);
}

TEST(labels_are_chosen_by_their_names)
{
    write_segments();
    const Scene *scene = read_valid(VOXELS("file = \"segments.nrrd\"; label = \"tumour\";"));
    assert_int_equal(scene->body[0].voxels.label[0], 1);
    assert_int_equal(scene->body[0].voxels.layer, 2);
    scene = read_valid(START "voxels = { file = \"segments.nrrd\"; label = (\"tumour\", \"vein\"); "
                             "};\n materials = ( { label = \"vein\"; density = 900.0; } ); } );");
    const SceneBody *body = &scene->body[0];
    assert_int_equal(body->voxels.label_count, 2);
    assert_int_equal(body->voxels.label[1], 5);
    expect_near(body->material[0].density, 1000.0, 0.0);
    expect_near(body->material[1].density, 900.0, 0.0);
    // A number and a key for the layer.
    scene = read_valid(VOXELS("file = \"segments.nrrd\"; label = 1; layer = 2;"));
    assert_int_equal(scene->body[0].voxels.layer, 2);
    // Names that are in no common layer, or in none.
    static Scene none;
    expect_in(
        read_as_scene(VOXELS("file = \"segments.nrrd\"; label = (\"liver\", \"vein\");"), &none),
        "segments.nrrd: no label of that layer has the name 'vein'; the names are liver, vein, "
        "tumour");
    expect_in(read_as_scene(VOXELS("file = \"segments.nrrd\"; label = \"livr\";"), &none),
              "segments.nrrd: no label has the name 'livr'; the names are liver, vein, tumour");
    expect_in(read_as_scene(VOXELS("file = \"missing.nrrd\"; label = \"liver\";"), &none),
              "missing.nrrd: No such file");
}

// By the claims of which they are the other side.
static const WrongScene WRONG[] = {
    // volumes have labels and their own spacing
    {VOXELS("file = \"a.nrrd\"; label = 0;"), "2: voxels.label 0 outside [1, 1e+09]"},
    {VOXELS("file = \"a.nrrd\"; label = [2, 0];"), "2: voxels.label 0 outside [1, 1e+09]"},
    {VOXELS("file = \"a.nrrd\"; label = [2, 3, 2];"), "2: label 2 is chosen twice"},
    {VOXELS("file = \"a.nrrd\"; label = [];"), "2: label is empty"},
    {VOXELS("file = \"a.nrrd\"; label = true;"),
     "2: voxels.label true must be a whole number, a name or a list of them"},
    // meshes are filled with cells of a size
    {VOXELS("mesh = \"liver.stl\";"), "2: bodies.voxels.size is missing (Edge length of a cell; "
                                      "for generators before `scale`, otherwise in the world.)"},
    {VOXELS("mesh = \"liver.stl\"; size = 0.004; label = 1;"),
     "2: label means nothing for voxels from a mesh"},
    // voxel generators take their own keys only
    {VOXELS("generator = \"box\"; radius = 1;"), "2: radius means nothing for voxels from box"},
    {VOXELS("generator = \"ball\"; count = 8;"), "2: count means nothing for voxels from ball"},
    {VOXELS("generator = \"disc\"; label = 1;"), "2: label means nothing for voxels from disc"},
    {VOXELS("file = \"a.nrrd\"; count = 8;"), "2: count means nothing for voxels from a file"},
    {VOXELS("generator = \"box\"; count = [8, 8];"),
     "2: count has 2 entries and must be one or three numbers, two only with dimensions 2"},
    {VOXELS("generator = \"box\"; count = [8, 8, 8, 8];"),
     "2: count has 4 entries and must be one or three numbers, two only with dimensions 2"},
    {VOXELS("generator = \"box\"; count = [8, 8, 0];"), "2: voxels.count 0 outside [1, 4096]"},
    {VOXELS("generator = \"cube\";"),
     "2: voxels.generator \"cube\" must be one of \"box\", \"ball\", \"disc\""},
    {VOXELS("generator = \"box\"; size = 0;"), "2: voxels.size 0 outside (0, 1000]"},
    {VOXELS(""), "2: voxels needs a file, mesh or generator"},
    {VOXELS("file = \"a.nrrd\"; generator = \"box\";"),
     "2: voxels needs only one of file, mesh or generator"},
    {VOXELS("file = \"a.nrrd\"; mesh = \"a.stl\"; size = 1;"),
     "2: voxels needs only one of file, mesh or generator"},
    {VOXELS("generator = \"box\"; place = { scale = 2; };"),
     "2: unknown key scale in bodies.voxels.place: it is a key of bodies.mesh and bodies.voxels "
     "and bodies.skin"},
    // plane bodies are boxes and discs in their plane
    {VOXELS("generator = \"disc\"; dimensions = 3;"),
     "2: dimensions 3 means nothing for voxels from disc, a plane body"},
    {START "dimensions = 3;\nvoxels = { generator = \"disc\"; }; } );",
     "2: dimensions 3 means nothing for voxels from disc, a plane body"},
    {START "dimensions = 3;\nvoxels = { generator = \"box\"; dimensions = 2; }; } );",
     "2: dimensions 2 contradicts dimensions 3 of the body"},
    {VOXELS("file = \"a.nrrd\"; dimensions = 2;"),
     "2: dimensions 2 means nothing for voxels from a file, only for box and disc"},
    {START "dimensions = 2;\nvoxels = { generator = \"ball\"; }; } );",
     "2: dimensions 2 means nothing for voxels from ball, only for box and disc"},
    {VOXELS("generator = \"box\"; count = [8, 8, 2]; dimensions = 2;"),
     "2: count 2 along z: a plane body has one layer of cells"},
    {VOXELS("generator = \"disc\"; place = { translation = (0, 0, 1); };"),
     "2: place takes a plane body out of z = 0: it can move along x and y, and turn about z"},
    {VOXELS("generator = \"disc\"; place = { rotation = (1, 0, 0); };"),
     "2: place takes a plane body out of z = 0: it can move along x and y, and turn about z"},
    {START "voxels = { generator = \"disc\"; };\nskin = { mesh = \"a.stl\"; }; } );",
     "2: skin means nothing for a plane body"},
    {VOXELS("generator = \"disc\"; dimensions = 4;"), "2: voxels.dimensions 4 outside [2, 3]"},
    // materials must be of labels that are chosen
    {IN_BODY("materials = (\n{ label = 4; } );"), "3: label 4 is not among those of voxels"},
    {IN_BODY("materials = ( { label = 3; },\n{ label = 3; } );"),
     "3: label 3 has a material already"},
    {IN_BODY("materials = ( { density = 3; } );"),
     "2: bodies.materials.label is missing (Label in the volume, one of `voxels.label`.)"},
    {IN_BODY("materials = ( { label = 3; damping = 0.1; } );"),
     "2: unknown key damping in bodies.materials: it is a key of bodies.shape and bodies.material"},
    {IN_BODY("materials = ( 3 );"), "2: materials entry 3 must be a group { ... }"},
    {START "voxels = { generator = \"box\"; };\nmaterials = ( { label = 2; } ); } );",
     "2: label 2 is not among those of voxels"},
    // numbers of materials have their ranges
    {IN_BODY("material = { youngs_modulus = 0; };"),
     "2: material.youngs_modulus 0 outside (0, 1e+12]"},
    {IN_BODY("material = { poisson_ratio = 0.5; };"),
     "2: material.poisson_ratio 0.5 outside [0, 0.49]"},
    {IN_BODY("material = { density = 0; };"), "2: material.density 0 outside (0, 1e+06]"},
    {IN_BODY("material = { damping = -0.1; };"), "2: material.damping -0.1 outside [0, 10]"},
    {IN_BODY("material = { youngs_modulus_2d = 80; };"),
     "2: unknown key youngs_modulus_2d in bodies.material: did you mean youngs_modulus (Pa: "
     "Young's modulus)?"},
    // paper law has no poisson ratio
    {IN_BODY("law = \"miyazaki2004\";\nmaterial = { poisson_ratio = 0.3; };"),
     "3: poisson_ratio 0.3 needs law \"affine\": law \"miyazaki2004\" knows only 0"},
    {IN_BODY("law = \"miyazaki2004\";\nmaterials = ( { label = 3;\n"
             "poisson_ratio = 0.1; } );"),
     "4: poisson_ratio 0.1 needs law \"affine\": law \"miyazaki2004\" knows only 0"},
    {IN_BODY("law = \"spring\";"), "2: law \"spring\" must be one of \"affine\", \"miyazaki2004\""},
    // skin is a mesh placed like others
    {IN_BODY("skin = { };"),
     "2: bodies.skin.mesh is missing (OBJ, STL, PLY, OFF, VTK, MSH or TetGen file, "
     "relative to the scene's folder.)"},
    {IN_BODY("skin = { mesh = \"a.stl\"; place = { zzz = 1; }; };"),
     "2: unknown key zzz in bodies.skin.place, whose keys are translation, rotation"},
    // bad damping is refused
    {IN_BODY("material = { damping = 0.2;\n damping_time = 1e-3; };"),
     "3: damping_time cannot be mixed with damping"},
    {IN_BODY("material = { damping_time = -1e-3; };"),
     "2: material.damping_time -0.001 outside [0, 10]"},
    {IN_BODY("material = { damping_time = 11; };"), "2: material.damping_time 11 outside [0, 10]"},
    {IN_BODY("material = { drag = -1; };"), "2: material.drag -1 outside [0, 10000]"},
    {IN_BODY("material = { drag = \"4\"; };"), "2: material.drag \"4\" must be a number"},
    {VOXELS("generator = \"disc\"; }; material = { damping_time = 1e-3;"),
     "2: damping_time means nothing for a plane body"},
    // what a voxel body cannot do is refused
    {"bodies = (\n{ name = \"a\"; model = \"voxel\"; } );",
     "2: bodies.voxels is missing (Source of its cells.)"},
    {IN_BODY("levels = 6;"), "2: levels 6 outside [0, 5] of a voxel body"},
    {IN_BODY("levels = \"fine\";"), "2: levels \"fine\" must be a whole number or a group"},
    {IN_BODY("levels = {\ninside = 6; };"), "3: levels.inside 6 outside [0, 5]"},
    {IN_BODY("levels = {\nsurface = -1; };"), "3: levels.surface -1 outside [0, 5]"},
    {IN_BODY("levels = {\nsurfaces = 1; };"),
     "3: unknown key surfaces in bodies.levels: did you mean surface?"},
    {IN_BODY("levels = { inside = 1;\nsurface = 2; };"),
     "3: levels.surface 2 exceeds levels.inside 1"},
    {IN_BODY("law = \"miyazaki2004\"; levels = {\nsurface = 1; };"),
     "3: levels.surface needs law \"affine\""},
    {IN_BODY("skin = { mesh = \"a.stl\"; }; levels = {\nsurface = 1; };"),
     "3: levels.surface cannot be mixed with skin"},
    {IN_BODY("initial = \"a.h5\"; levels = {\nsurface = 1; };"),
     "3: levels.surface cannot be mixed with initial"},
    {IN_BODY("weights = ( { nodes = [1]; mass = 0.1; } ); levels = {\nsurface = 1; };"),
     "3: levels.surface cannot be mixed with weights"},
    {"publish = { nodes = \"all\"; };\n" IN_BODY("levels = {\nsurface = 1; };"),
     "4: levels.surface cannot be mixed with publish.nodes = \"all\""},
    {IN_BODY("levels = {\nfine = ( { sphere = [0, 0, 0]; radius = 0.1; } ); };"),
     "3: fine means nothing without levels.surface: all elements at the surface are single cells"},
    {IN_BODY("levels = { surface = 1; fine = (\n{ sphere = [0, 0, 0]; } ); };"),
     "3: bodies.levels.fine.radius is missing (Radius of the ball.)"},
    {IN_BODY("levels = { surface = 1; fine = (\n{ sphere = [0, 0, 0]; radius = 0; } ); };"),
     "3: radius 0 outside (0, 1e+06]"},
    {START "levels = {\nsurface = 1; }; voxels = { generator = \"disc\"; }; } );",
     "1: levels of a plane body must be a whole number"},
    {IN_BODY("integrator = \"rk4\";"), "2: integrator \"rk4\" means nothing for a voxel body; only "
                                       "\"symplectic_euler\", \"leapfrog\", \"auto\""},
    {IN_BODY("integrator = \"implicit\";"),
     "2: integrator \"implicit\" means nothing for a voxel body; only \"symplectic_euler\", "
     "\"leapfrog\", \"auto\""},
    {IN_BODY("theta = 0.6;"), "2: theta means nothing for a voxel body"},
    {IN_BODY("split_budget = 0;"), "2: split_budget 0 outside [1, 1e+06]"},
    {IN_BODY("tear = { stress = 2000; };"), "2: tear needs cuttable = true"},
    {IN_BODY("cuttable = true; tear = { stress = 2000; force = 1; };"),
     "2: tear has both stress and force: one of them"},
    {IN_BODY("cuttable = true; tear = { stretch = 0.5; };"),
     "2: tear.stretch means nothing for a voxel body, only stress or force"},
    {IN_BODY("cuttable = true; tear = { };"), "2: tear is empty: give it stress or force"},
    {"bodies = ( { name = \"a\"; model = \"solid\"; } );",
     "1: model \"solid\" must be one of \"surface\", \"voxel\""},
};

TEST(wrong_keys_of_voxels_are_refused_in_these_words)
{
    expect_errors(WRONG, sizeof WRONG / sizeof *WRONG);
}

#else

TEST(voxel_bodies_that_are_not_built_in_are_refused)
{
#ifndef PLIANT_WITH_VOXEL
    expect_error("bodies = (\n{ name = \"a\"; model = \"voxel\"; "
                 "voxels = { generator = \"box\"; }; } );",
                 "x.cfg:2: this pliantd was built without voxel bodies (PLIANT_VOXEL)");
#endif
#ifndef PLIANT_WITH_PLANE
    expect_error("bodies = (\n{ name = \"a\"; model = \"voxel\"; "
                 "voxels = { generator = \"disc\"; }; } );",
                 "x.cfg:2: this pliantd was built without plane bodies (PLIANT_PLANE)");
#endif
}

#endif
