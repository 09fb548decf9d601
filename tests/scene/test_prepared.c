// SPDX-License-Identifier: MIT
// Prepared models: runs from them have the same bits, and files that are damaged, inconsistent or
// made for something else are refused.
#include "test.h"
#include "world_run.h"

#include "scene/build.h"
#include "scene/prepared.h"

#if defined(PLIANT_WITH_HDF5) && defined(PLIANT_WITH_SURFACE)
#include "recording_view.h"

static void prepare(const char *text, const char *name)
{
    const char *path = scratch_at(name);
    SCOPED(scene_destroy) Scene scene;
    Status status = {0};
    FILE *report = fopen("/dev/null", "w");
    assert_non_null(report);
    read_scene(text, &scene);
    unlink(path); // what was altered is not replaced
    bool ok = prepared_write(path, &scene, report, &status);
    assert_string_equal(status.text, "");
    assert_true(ok);
    fclose(report);
}

// Builds the scene, with a prepared file unless NULL; returns what was wrong, "" if nothing.
static const char *build(const char *text, const char *prepared, World *world)
{
    Scene scene;
    Status status = {0};
    BuildOptions options = {.isa = "auto", .publishes = true};
    if (prepared != NULL)
        options.prepared = scratch_at(prepared);
    read_scene(text, &scene);
    bool ok = world_build(world, &scene, &options, &status);
    assert_int_equal(ok, status.code == STATUS_OK);
    if (!ok)
        assert_int_equal(status.code, STATUS_INVALID);
    scene_destroy(&scene);
    return without_folder(&status);
}

static void expect_refusal(const char *text, const char *prepared, const char *said)
{
    World world;
    assert_string_equal(build(text, prepared, &world), said);
}

// --- the same bits -------------------------------------------------------------------------------

static void expect_same_world(const char *text)
{
    SCOPED(world_destroy) World made, read;
    prepare(text, "a.h5");
    assert_string_equal(build(text, NULL, &made), "");
    assert_string_equal(build(text, "a.h5", &read), "");
    for (int i = 0; i < 30; i++) {
        sim_step(made.sim);
        sim_step(read.sim);
    }
    assert_true(state_hash(&made.state) == state_hash(&read.state));
    assert_int_equal(made.mesh_count, read.mesh_count);
    for (int b = 0; b < made.mesh_count; b++) {
        const BodyMesh *one = &sim_body(made.sim, b)->mesh, *two = &sim_body(read.sim, b)->mesh;
        size_t nodes = (size_t)one->node_count;
        assert_int_equal(one->node_count, two->node_count);
        assert_int_equal(one->triangle_count, two->triangle_count);
        assert_memory_equal(one->triangle, two->triangle,
                            (size_t)one->triangle_count * sizeof *one->triangle);
        assert_memory_equal(one->id, two->id, nodes * sizeof *one->id);
        assert_memory_equal(one->origin, two->origin, nodes * sizeof *one->origin);
        assert_memory_equal(one->parent, two->parent, nodes * sizeof *one->parent);
        assert_memory_equal(one->level, two->level, nodes);
        const Body *a = sim_body(made.sim, b), *c = sim_body(read.sim, b);
        assert_int_equal(a->texture_count, c->texture_count);
        if (a->texture != NULL)
            assert_memory_equal(a->texture, c->texture,
                                (size_t)a->texture_count * sizeof *a->texture);
    }
}

#define BODY(mesh, more)  "{ name = \"a\"; mesh = { " mesh " }; shape = {}; " more " }"
#define SCENE(mesh, more) "gravity = [0, 0, -9.81]; bodies = (\n" BODY(mesh, more) " );\n"
#define STOMACH           "generator = \"stomach\"; nodes = 100;"

#define ORGAN_FACES "f 1 5 2\nf 1 3 6\nf 3 5 6\nf 5 1 6\nf 1 7 8\nf 1 8 9\nf 8 7 9\nf 7 1 9\n"

// Two tetrahedra that share vertex 1 (node 0 of the file, which is split), with vertex 3 a double
// of vertex 2, and vertex 4 of no face.
static void write_organ(const char *more)
{
    char text[512];
    snprintf(text, sizeof text,
             "v 0 0 0\nv 1 0 0\nv 1 0 0\nv 9 9 9\nv 0 1 0\nv 0 0 1\n"
             "v -1 0 0\nv 0 -1 0\nv 0 0 -1\n"
             "%s%s",
             strstr(more, "vt") != NULL ? "" : ORGAN_FACES, more);
    scratch_write_text("organ.obj", text);
}
#define ORGAN "file = \"organ.obj\"; scale = 0.01;"

static int begin(void **unused)
{
    (void)unused;
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return scratch_begin(unused);
}

AROUND_ALL(begin, scratch_end)

TEST(runs_from_a_prepared_model_have_the_same_bits)
{
    expect_same_world(SCENE(STOMACH, ""));
    expect_same_world(SCENE(STOMACH, "levels = 2; start_level = 1;"));
    expect_same_world(SCENE(STOMACH, "levels = 1; start_level = 1; adjust = \"choi2005\";"));
    expect_same_world(SCENE("generator = \"sheet\"; place = { translation = [1, 2, 3]; };",
                            "levels = 1; start_level = 1; fixed = ( { nodes = [0, 1, 2]; } );"));
    write_organ("");
    expect_same_world(SCENE(ORGAN, "levels = 2; start_level = 2; fixed = ( { nodes = [0]; } );"));
    expect_same_world(SCENE(ORGAN, ""));
}

// Of nodes that were split, welded and dropped, too.
TEST(textures_are_prepared_with_their_mesh)
{
    char text[512];
    SCOPED(world_destroy) World world;
    snprintf(text, sizeof text, "publish = { rest = true; }; %s", SCENE(ORGAN, "levels = 1;"));
    write_organ("vt 0.5 0.25\nvt 1 0\n"
                "f 1/1 5/2 2/2\nf 1/1 3/2 6/2\nf 3/2 5/2 6/1\nf 5/2 1/1 6/1\n"
                "f 1/2 7/2 8/1\nf 1/2 8/1 9/1\nf 8/1 7/2 9/1\nf 7/2 1/2 9/1\n");
    expect_same_world(text);
    prepare(text, "a.h5");
    assert_string_equal(build(text, "a.h5", &world), "");
    assert_non_null(sim_body(world.sim, 0)->texture);
}

TEST(each_body_finds_its_own)
{
    expect_same_world(
        "bodies = ( { name = \"b\"; mesh = { generator = \"uv_sphere\"; }; levels = 1; },\n" //
        BODY(STOMACH, "levels = 2; start_level = 2;") " );");
}

TEST(keys_beside_mesh_and_levels_may_change)
{
    SCOPED(world_destroy) World world;
    prepare(SCENE(STOMACH, "levels = 2;"), "a.h5");
    assert_string_equal(build(SCENE(STOMACH, "levels = 2; start_level = 2; material = { "
                                             "youngs_modulus_2d = 50; }; integrator = \"rk4\";"),
                              "a.h5", &world),
                        "");
}

TEST(scenes_name_their_prepared_model)
{
    SCOPED(world_destroy) World world;
    prepare(SCENE(STOMACH, "levels = 1;"), "a.h5");
    assert_string_equal(build("prepared = \"a.h5\";\n" SCENE(STOMACH, "levels = 1;"), NULL, &world),
                        "");
    expect_refusal("prepared = \"none.h5\";\n" SCENE(STOMACH, "levels = 1;"), NULL,
                   "none.h5: No such file or directory");
    // Preparing does not look at it.
    prepare("prepared = \"none.h5\";\n" SCENE(STOMACH, "levels = 1;"), "b.h5");
}

// --- files for something else --------------------------------------------------------------------

TEST(models_of_other_scenes_are_refused)
{
    prepare(SCENE(STOMACH, "levels = 1;"), "a.h5");
    const char *other = "x.cfg:2: a.h5: /bodies/a was prepared from another mesh than this "
                        "scene's: prepare it again";
    expect_refusal(SCENE("generator = \"stomach\"; nodes = 101;", "levels = 1;"), "a.h5", other);
    expect_refusal(SCENE("generator = \"stomach\"; nodes = 100; length = 0.3;", "levels = 1;"),
                   "a.h5", other);
    expect_refusal(SCENE("generator = \"stomach\"; nodes = 100; scale = 2;", "levels = 1;"), "a.h5",
                   other);
    expect_refusal(SCENE(STOMACH " place = { rotation = [0, 0, 1]; };", "levels = 1;"), "a.h5",
                   other);
    expect_refusal(SCENE(STOMACH, "levels = 2;"), "a.h5",
                   "x.cfg:2: a.h5: /bodies/a was prepared with levels 1, the scene has 2");
    expect_refusal(SCENE(STOMACH, ""), "a.h5",
                   "x.cfg:2: a.h5: /bodies/a was prepared with levels 1, the scene has 0");
    expect_refusal("bodies = (\n{ name = \"b\"; mesh = { " STOMACH " }; levels = 1; } );", "a.h5",
                   "x.cfg:2: a.h5: /bodies/b is missing: the file was prepared for another scene "
                   "(pliant-prepare SCENE.cfg -o FILE)");
}

TEST(mesh_files_that_changed_are_noticed)
{
    write_organ("");
    prepare(SCENE(ORGAN, "levels = 1;"), "a.h5");
    write_organ("# one byte more is another file\n");
    expect_refusal(SCENE(ORGAN, "levels = 1;"), "a.h5",
                   "x.cfg:2: a.h5: /bodies/a was prepared from another mesh than this scene's: "
                   "prepare it again");
    unlink(scratch_at("organ.obj"));
    expect_refusal(SCENE(ORGAN, "levels = 1;"), "a.h5",
                   "x.cfg:2: organ.obj: No such file or directory");
}

TEST(other_formats_and_versions_are_refused)
{
    const char *scene = SCENE(STOMACH, "levels = 1;");
    prepare(scene, "a.h5");
    hid_t file = view_change(scratch_at("a.h5"));
    int version = 2;
    hid_t attribute = H5Aopen(file, "version", H5P_DEFAULT);
    assert_true(H5Awrite(attribute, H5T_NATIVE_INT, &version) >= 0);
    H5Aclose(attribute);
    H5Fclose(file);
    scratch_seal(&scratch_space, "a.h5");
    expect_refusal(scene, "a.h5", "a.h5: / version 2 must be 1");
    file = view_change(scratch_at("a.h5"));
    H5Adelete(file, "format");
    H5Fclose(file);
    scratch_seal(&scratch_space, "a.h5");
    expect_refusal(scene, "a.h5", "a.h5: / has no attribute format");
    scratch_write(&scratch_space, "a.h5", "no HDF5", 7);
    expect_refusal(scene, "a.h5", "a.h5: is no file that Pliant wrote");
}

// --- damage --------------------------------------------------------------------------------------

TEST(truncated_files_are_refused)
{
    const char *scene = SCENE(STOMACH, "levels = 1;");
    World world;
    size_t size = 0;
    prepare(scene, "a.h5");
    FREED unsigned char *data = scratch_read(&scratch_space, "a.h5", &size);
    for (size_t i = 0; i < 50; i++) {
        scratch_write(&scratch_space, "b.h5", data, size * i / 50);
        assert_string_not_equal(build(scene, "b.h5", &world), "");
    }
}

TEST(altered_files_are_refused_wherever_the_change_is)
{
    const char *scene = SCENE(STOMACH, "levels = 1;");
    World world;
    size_t size = 0;
    prepare(scene, "a.h5");
    FREED unsigned char *data = scratch_read(&scratch_space, "a.h5", &size);
    // An odd stride meets all parts of blocks of even size.
    for (size_t at = 0; at < size; at += size / 300 | 1) {
        data[at] ^= 0x55;
        scratch_write(&scratch_space, "b.h5", data, size);
        data[at] ^= 0x55;
        assert_string_not_equal(build(scene, "b.h5", &world), "");
    }
}

// Every data set of a file with its shape; `visit` sees them one by one.
typedef struct Names {
    char name[64][128];
    int count;
} Names;

static herr_t note_set(hid_t object, const char *name, const H5O_info_t *info, void *data)
{
    (void)object;
    Names *names = data;
    if (info->type == H5O_TYPE_DATASET) {
        assert_true(names->count < 64);
        snprintf(names->name[names->count++], sizeof names->name[0], "/%s", name);
    }
    return 0;
}

static void list_sets(const char *file_name, Names *names)
{
    names->count = 0;
    hid_t file = view_change(scratch_at(file_name));
    assert_true(H5Ovisit(file, H5_INDEX_NAME, H5_ITER_INC, note_set, names) >= 0);
    H5Fclose(file);
}

// a.h5, prepared from the organ: its bytes, owned by the caller, and its data sets.
static unsigned char *prepare_organ(const char *scene, Names *names, size_t *size)
{
    write_organ("");
    prepare(scene, "a.h5");
    list_sets("a.h5", names);
    return scratch_read(&scratch_space, "a.h5", size);
}

TEST(data_sets_that_are_missing_are_named)
{
    const char *scene = SCENE(ORGAN, "levels = 1;");
    Names names;
    World world;
    size_t size = 0;
    FREED unsigned char *whole = prepare_organ(scene, &names, &size);
    assert_int_equal(names.count, 5 + 2 * 3);
    for (int i = 0; i < names.count; i++) {
        scratch_write(&scratch_space, "a.h5", whole, size);
        hid_t file = view_change(scratch_at("a.h5"));
        assert_true(H5Ldelete(file, names.name[i], H5P_DEFAULT) >= 0);
        H5Fclose(file);
        scratch_seal(&scratch_space, "a.h5");
        const char *said = build(scene, "a.h5", &world);
        // Without file_node the nodes would be those of the file, which they are not.
        bool named =
            strstr(said, names.name[i]) != NULL || strstr(said, "numbers of nodes") != NULL;
        if (!named)
            fail_msg("\"%s\" does not name %s", said, names.name[i]);
    }
}

TEST(data_sets_of_other_sizes_are_refused)
{
    const char *scene = SCENE(ORGAN, "levels = 1;");
    Names names;
    World world;
    size_t size = 0;
    FREED unsigned char *whole = prepare_organ(scene, &names, &size);
    static const hsize_t shapes[][2] = {{0, 3}, {1, 3}, {7, 2}, {1 << 20, 1}, {1 << 27, 3}};
    for (int i = 0; i < names.count; i++)
        for (size_t k = 0; k < sizeof shapes / sizeof *shapes; k++) {
            // Never written: the sizes are there, the numbers are not.
            scratch_write(&scratch_space, "a.h5", whole, size);
            hid_t file = view_change(scratch_at("a.h5"));
            hid_t old = H5Dopen2(file, names.name[i], H5P_DEFAULT), type = H5Dget_type(old);
            H5Dclose(old);
            H5Ldelete(file, names.name[i], H5P_DEFAULT);
            hid_t space = H5Screate_simple(shapes[k][1] == 1 ? 1 : 2, shapes[k], NULL);
            hid_t set =
                H5Dcreate2(file, names.name[i], type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
            assert_true(set >= 0);
            H5Dclose(set);
            H5Sclose(space);
            H5Tclose(type);
            H5Fclose(file);
            scratch_seal(&scratch_space, "a.h5");
            const char *said = build(scene, "a.h5", &world);
            if (strstr(said, "a.h5: /bodies/a") == NULL)
                fail_msg("%s: \"%s\"", names.name[i], said);
        }
}

TEST(numbers_that_do_not_fit_are_refused_behind_a_right_seal)
{
    const char *scene = SCENE(ORGAN, "levels = 1;");
    Names names;
    World world;
    size_t size = 0;
    FREED unsigned char *whole = prepare_organ(scene, &names, &size);
    static const int others[] = {-2, -1, 0, 1, 1000, 1 << 30, INT32_MIN};
    int tried = 0;
    for (int i = 0; i < names.count; i++) {
        if (strstr(names.name[i], "position") != NULL)
            continue;
        hid_t file = view_change(scratch_at("a.h5"));
        hid_t set = H5Dopen2(file, names.name[i], H5P_DEFAULT);
        int count = (int)(H5Dget_storage_size(set) / sizeof(int)), data[512];
        assert_true(count > 0 && count <= 512);
        H5Dread(set, H5T_NATIVE_INT, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
        H5Dclose(set);
        H5Fclose(file);
        for (int at = 0; at<count; at += count> 40 ? 5 : 1)
            for (size_t k = 0; k < sizeof others / sizeof *others; k++) {
                int right = data[at];
                if (others[k] == right)
                    continue;
                data[at] = others[k];
                scratch_write(&scratch_space, "b.h5", whole, size);
                file = view_change(scratch_at("b.h5"));
                view_put(file, names.name[i], H5T_NATIVE_INT, data);
                H5Fclose(file);
                data[at] = right;
                scratch_seal(&scratch_space, "b.h5");
                const char *said = build(scene, "b.h5", &world);
                // A node of the file that is no node of the mesh may stand for any, and a copy may
                // be one of any node.
                bool free_choice = (strstr(names.name[i], "file_node") != NULL ||
                                    strstr(names.name[i], "copy_of") != NULL) &&
                                   others[k] >= -1 && others[k] <= 1;
                if (said[0] == '\0' && !free_choice)
                    fail_msg("%s[%d] = %d was taken", names.name[i], at, others[k]);
                if (said[0] == '\0')
                    world_destroy(&world);
                tried++;
            }
    }
    assert_true(tried > 500);
}

TEST(positions_that_do_not_fit_are_refused)
{
    const char *scene = SCENE(STOMACH, "levels = 1;");
    static const double others[] = {(double)NAN, HUGE_VAL, 1e308};
    enum { NODES = 100 + 294 };
    size_t size = 0;
    prepare(scene, "a.h5");
    FREED unsigned char *whole = scratch_read(&scratch_space, "a.h5", &size);
    for (int at = 0; at < 3 * NODES; at += 291)
        for (int k = 0; k < 3; k++) {
            double data[NODES][3];
            World world;
            scratch_write(&scratch_space, "a.h5", whole, size);
            hid_t file = view_change(scratch_at("a.h5")),
                  set = H5Dopen2(file, "/bodies/a/position", H5P_DEFAULT);
            assert_int_equal(H5Dget_storage_size(set), sizeof data);
            H5Dclose(set);
            view_get(file, "/bodies/a/position", H5T_NATIVE_DOUBLE, data);
            data[at / 3][at % 3] = others[k];
            view_put(file, "/bodies/a/position", H5T_NATIVE_DOUBLE, data);
            H5Fclose(file);
            scratch_seal(&scratch_space, "a.h5");
            assert_string_not_equal(build(scene, "a.h5", &world), "");
        }
}

TEST(files_that_cannot_be_written_are_named)
{
    SCOPED(scene_destroy) Scene scene;
    Status status = {0};
    read_scene(SCENE(STOMACH, ""), &scene);
    assert_false(prepared_write(scratch_at("no/a.h5"), &scene, stdout, &status));
    assert_int_equal(status.code, STATUS_FAILED);
    assert_string_equal(without_folder(&status), "no/a.h5: No such file or directory");
    scene_destroy(&scene);
    status = (Status){0};
    read_scene(SCENE("file = \"none.stl\";", ""), &scene);
    assert_false(prepared_write(scratch_at("b.h5"), &scene, stdout, &status));
    assert_string_equal(without_folder(&status), "x.cfg:2: none.stl: No such file or directory");
}

TEST(layout_is_as_documented)
{
    Names names;
    write_organ("");
    prepare(SCENE(ORGAN, "levels = 1;"), "a.h5");
    list_sets("a.h5", &names);
    hid_t file = view_change(scratch_at("a.h5"));
    for (int i = 0; i < names.count; i++) {
        char unit[8] = "";
        hid_t attribute = H5Aopen_by_name(file, names.name[i], "unit", H5P_DEFAULT, H5P_DEFAULT);
        hid_t type = H5Aget_type(attribute);
        assert_true(H5Tget_size(type) <= sizeof unit);
        assert_true(H5Aread(attribute, type, unit) >= 0);
        assert_string_equal(unit, strstr(names.name[i], "position") != NULL ? "m" : "1");
        H5Tclose(type);
        H5Aclose(attribute);
    }
    static const char *const texts[] = {"format", "scene", "created_by"};
    for (int i = 0; i < 3; i++)
        assert_true(H5Aexists(file, texts[i]) > 0);
    H5Fclose(file);
}

#endif
