// SPDX-License-Identifier: MIT
// Initial states of bodies: rows of nodes or of the mesh file, midpoints, files that do not fit.
#include "test.h"
#include "random.h"
#include "surface_state.h"
#include "world_run.h"

#include "io/checkpoint.h"
#include "geometry/mesh_repair.h"
#include "surface/surface.h"

#include <hdf5.h>

// A file with one data set, or two when `velocity` is not NULL.
static void write_initial(const char *name, hid_t type, hsize_t rows, hsize_t columns,
                          const void *position, const void *velocity)
{
    const hsize_t size[2] = {rows, columns};
    hid_t file = H5Fcreate(scratch_at(name), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    hid_t space = H5Screate_simple(2, size, NULL);
    const void *const data[2] = {position, velocity};
    static const char *const names[2] = {"/position", "/velocity"};
    for (int i = 0; i < 2; i++) {
        if (data[i] == NULL)
            continue;
        hid_t set = H5Dcreate2(file, names[i], type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        assert_true(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data[i]) >= 0);
        H5Dclose(set);
    }
    H5Sclose(space);
    H5Fclose(file);
}

// Two triangles as a file of six corners, of which two pairs are the same.
static void square(TriMesh *mesh)
{
    static const Vec3 corner[6] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0},
                                   {0, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    SCOPED(mesh_draft_destroy) MeshDraft draft = {0};
    MeshRepairs repairs;
    MeshFault fault;
    for (int i = 0; i < 6; i++) {
        mesh_draft_add_node(&draft, corner[i]);
        mesh_draft_add_corner(&draft, i, -1);
        if (i % 3 == 2)
            mesh_draft_end_polygon(&draft, 0);
    }
    assert_true(mesh_repair(&draft, mesh, &repairs, &fault));
    assert_int_equal(mesh->node_count, 4);
}

static const char *read_initial(const char *name, const TriMesh *mesh, Vec3 **position,
                                Vec3 **velocity)
{
    static char said[512];
    Status status = {0};
    bool ok = initial_read(scratch_at(name), mesh, position, velocity, &status);
    assert_int_equal(ok, status.code == STATUS_OK);
    snprintf(said, sizeof said, "%s", ok ? "" : status.text + strlen(scratch_space.folder) + 1);
    return said;
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(initial_state_takes_rows_of_nodes_or_of_the_file)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    Vec3 *position, *velocity;
    square(&mesh);
    double rows[6][3], speeds[6][3];
    for (int i = 0; i < 18; i++) {
        rows[i / 3][i % 3] = i;
        speeds[i / 3][i % 3] = -i;
    }
    write_initial("i.h5", H5T_NATIVE_DOUBLE, 4, 3, rows, speeds);
    assert_string_equal(read_initial("i.h5", &mesh, &position, &velocity), "");
    for (int i = 0; i < 4; i++) {
        expect_near(position[i].y, 3 * i + 1, 0.0);
        expect_near(velocity[i].z, -(3 * i + 2), 0.0);
    }
    free(position);
    free(velocity);

    // Rows of the file: those of the corners 0, 1, 2 and 5, which welding has kept.
    static const int kept[4] = {0, 1, 2, 5};
    write_initial("i.h5", H5T_NATIVE_DOUBLE, 6, 3, rows, NULL);
    assert_string_equal(read_initial("i.h5", &mesh, &position, &velocity), "");
    for (int i = 0; i < 4; i++) {
        expect_near(position[i].x, 3 * kept[i], 0.0);
        expect_near(vec3_length(velocity[i]), 0.0, 0.0);
    }
    free(position);
    free(velocity);
}

TEST(initial_rows_of_the_file_reach_nodes_that_were_split)
{
    // Two triangles that touch in node 1 of the file; its copy is the last node and has its row.
    static const Vec3 x[6] = {{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
    static const int corner[6] = {1, 2, 3, 1, 4, 5}, row_of[6] = {1, 2, 3, 4, 5, 1};
    SCOPED(mesh_draft_destroy) MeshDraft draft = {0};
    MeshRepairs repairs;
    MeshFault fault;
    SCOPED(mesh_destroy) TriMesh mesh;
    Vec3 *position, *velocity;
    double rows[6][3];
    for (int i = 0; i < 6; i++) {
        mesh_draft_add_node(&draft, x[i]);
        mesh_draft_add_corner(&draft, corner[i], -1);
        if (i % 3 == 2)
            mesh_draft_end_polygon(&draft, 0);
        rows[i][0] = rows[i][1] = rows[i][2] = i;
    }
    assert_true(mesh_repair(&draft, &mesh, &repairs, &fault));
    assert_int_equal(mesh.node_count, 6);
    write_initial("i.h5", H5T_NATIVE_DOUBLE, 6, 3, rows, NULL);
    assert_string_equal(read_initial("i.h5", &mesh, &position, &velocity), "");
    for (int i = 0; i < 6; i++)
        expect_near(position[i].x, row_of[i], 0.0);
    free(position);
    free(velocity);
}

TEST(initial_state_is_converted_from_single_precision)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    Vec3 *position, *velocity;
    square(&mesh);
    float rows[4][3] = {{0.1f, 0.2f, 0.3f}};
    write_initial("i.h5", H5T_NATIVE_FLOAT, 4, 3, rows, NULL);
    assert_string_equal(read_initial("i.h5", &mesh, &position, &velocity), "");
    expect_near(position[0].y, (double)0.2f, 0.0);
    free(position);
    free(velocity);
}

TEST(initial_files_that_do_not_fit_are_refused)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    Vec3 *position, *velocity;
    square(&mesh);
    double rows[6][3] = {{0.0}};
    int whole[4][3] = {{0}};
    write_initial("i.h5", H5T_NATIVE_DOUBLE, 5, 3, rows, NULL);
    assert_string_equal(read_initial("i.h5", &mesh, &position, &velocity),
                        "i.h5: /position has 5 rows, the mesh file 6 nodes (4 after repairs)");
    write_initial("i.h5", H5T_NATIVE_DOUBLE, 4, 2, rows, NULL);
    assert_string_equal(read_initial("i.h5", &mesh, &position, &velocity),
                        "i.h5: /position must have the shape [n][3]");
    write_initial("i.h5", H5T_NATIVE_INT, 4, 3, whole, NULL);
    assert_string_equal(read_initial("i.h5", &mesh, &position, &velocity),
                        "i.h5: /position must hold floating-point numbers");
    write_initial("i.h5", H5T_NATIVE_DOUBLE, 4, 3, NULL, rows);
    assert_string_equal(read_initial("i.h5", &mesh, &position, &velocity),
                        "i.h5: /position is missing or no data set");
    rows[2][1] = (double)NAN;
    write_initial("i.h5", H5T_NATIVE_DOUBLE, 4, 3, rows, NULL);
    assert_string_equal(read_initial("i.h5", &mesh, &position, &velocity),
                        "i.h5: /position row 2 is not finite");
    double good[4][3] = {{0.0}};
    write_initial("i.h5", H5T_NATIVE_DOUBLE, 4, 3, good, rows);
    assert_string_equal(read_initial("i.h5", &mesh, &position, &velocity),
                        "i.h5: /velocity row 2 is not finite");
    assert_null(position);
    assert_null(velocity);
}

TEST(bodies_start_from_their_initial_state)
{
    static double rows[114][3], speeds[114][3];
    for (int i = 0; i < 114 * 3; i++) {
        rows[i / 3][i % 3] = 0.001 * i;
        speeds[i / 3][i % 3] = -0.5 * i;
    }
    write_initial("i.h5", H5T_NATIVE_DOUBLE, 114, 3, rows, speeds);
    START_RUN(run, "precision = \"double\"; bodies = ( { name = \"a\"; mesh = { generator = "
                   "\"uv_sphere\"; }; initial = \"i.h5\"; } );");
    Vec3 position[114], velocity[114];
    surface_read_state(sim_body(run.world.sim, 0), position, velocity);
    assert_memory_equal(position, rows, sizeof rows);
    assert_memory_equal(velocity, speeds, sizeof speeds);
}

TEST(midpoints_start_as_their_parents_do)
{
    SCOPED(run_destroy) Run run;
    const char *text =
        "precision = \"double\"; bodies = ( { name = \"a\"; levels = 2; start_level = 2; "
        "mesh = { generator = \"uv_sphere\"; }; %s } );";
    char scene[512];
    run_format(&run, text, "");
    enum { NODES = 1794, GIVEN = 114 };
    static Vec3 rest[NODES], position[NODES], velocity[NODES];
    static double rows[GIVEN][3], speeds[GIVEN][3];
    const Body *body = sim_body(run.world.sim, 0);
    assert_int_equal(body->mesh.node_count, NODES);
    surface_read_state(body, rest, velocity);
    uint64_t seed = 5;
    for (int i = 0; i < GIVEN; i++) {
        Vec3 x = vec3_madd(rest[i], 0.01, random_vec3(&seed)), v = random_vec3(&seed);
        memcpy(rows[i], &x, sizeof rows[i]);
        memcpy(speeds[i], &v, sizeof speeds[i]);
    }
    run_destroy(&run);

    write_initial("i.h5", H5T_NATIVE_DOUBLE, GIVEN, 3, rows, speeds);
    snprintf(scene, sizeof scene, text, "initial = \"i.h5\";");
    run_create(&run, scene);
    body = sim_body(run.world.sim, 0);
    surface_read_state(body, position, velocity);
    assert_memory_equal(position, rows, sizeof rows);
    assert_memory_equal(velocity, speeds, sizeof speeds);
    for (int i = GIVEN; i < NODES; i++) { // ids are node numbers here
        const int *parent = body->mesh.parent[i];
        Vec3 a = vec3_sub(position[parent[0]], rest[parent[0]]);
        Vec3 b = vec3_sub(position[parent[1]], rest[parent[1]]);
        Vec3 own = vec3_sub(position[i], rest[i]);
        Vec3 mean = vec3_scale(0.5, vec3_add(velocity[parent[0]], velocity[parent[1]]));
        // Differences of coordinates of the order of 0.1.
        expect_near(vec3_length(vec3_sub(own, vec3_scale(0.5, vec3_add(a, b)))), 0.0, 1e-16);
        expect_near(vec3_length(vec3_sub(velocity[i], mean)), 0.0, 0.0);
    }
}

// A voxel body's vertices are not known before its file is read: the file says how many rows.
static const char *read_any(const char *name, int most, int *count, Vec3 **position,
                            Vec3 **velocity)
{
    static char said[512];
    Status status = {0};
    bool ok = initial_read_rows(scratch_at(name), most, count, position, velocity, &status);
    assert_int_equal(ok, status.code == STATUS_OK);
    assert_int_equal(ok, *position != NULL && *velocity != NULL);
    snprintf(said, sizeof said, "%s", ok ? "" : status.text + strlen(scratch_space.folder) + 1);
    return said;
}

TEST(rows_of_an_unknown_body_are_as_many_as_the_file_has)
{
    const double row[3][3] = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
    const double wrong[3][3] = {{0, 0, 0}, {0, (double)NAN, 0}, {0, 0, 0}};
    Vec3 *position, *velocity;
    int count = 0;
    write_initial("a.h5", H5T_NATIVE_DOUBLE, 3, 3, row, row);
    assert_string_equal(read_any("a.h5", 3, &count, &position, &velocity), "");
    assert_int_equal(count, 3);
    expect_near(position[1].y, 5.0, 0.0);
    expect_near(velocity[2].z, 9.0, 0.0);
    free(position);
    free(velocity);
    write_initial("a.h5", H5T_NATIVE_DOUBLE, 3, 3, row, NULL);
    assert_string_equal(read_any("a.h5", 100, &count, &position, &velocity), "");
    for (int i = 0; i < 3; i++)
        expect_near(vec3_length(velocity[i]), 0.0, 0.0);
    free(position);
    free(velocity);
    assert_string_equal(read_any("a.h5", 2, &count, &position, &velocity),
                        "a.h5: /position has 3 rows, the body at most 2 vertices");
    write_initial("a.h5", H5T_NATIVE_DOUBLE, 3, 3, row, wrong);
    assert_string_equal(read_any("a.h5", 3, &count, &position, &velocity),
                        "a.h5: /velocity row 1 is not finite");
    write_initial("a.h5", H5T_NATIVE_DOUBLE, 3, 2, row, NULL);
    assert_string_equal(read_any("a.h5", 3, &count, &position, &velocity),
                        "a.h5: /position must have the shape [n][3]");
    write_initial("a.h5", H5T_NATIVE_DOUBLE, 3, 3, NULL, row);
    assert_string_equal(read_any("a.h5", 3, &count, &position, &velocity),
                        "a.h5: /position is missing or no data set");
}
