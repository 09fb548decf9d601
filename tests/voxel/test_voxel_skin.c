// SPDX-License-Identifier: MIT
// A display surface carried by the elements: it moves rigidly and affinely as they do, has the ids
// of its file, and is refused where no element is near. And what is published without one.
#include "test.h"
#include "random.h"
#include "voxel_world.h"

#include "geometry/generator.h"
#include "voxel/model.h"

// A ball of 50 mm of cells of 10 mm under a sphere of 642 nodes, of 51 mm: outside some elements,
// inside others.
typedef struct Dressed {
    TriMesh skin;
    VoxelWorld world;
    float *x, *v;
} Dressed;

static void dress(Dressed *dressed, Precision precision, Vec3 at, Quat turn)
{
    assert_true(generate_ico_sphere(&dressed->skin, 3, 0.051, &(Status){0}));
    VoxelWorldOptions options = voxel_world_ball();
    lattice_place(&options.lattice, 1.0, quat_to_rotation(turn), at);
    mesh_place(&dressed->skin, 1.0, quat_to_rotation(turn), at);
    options.body.body.precision = precision;
    options.body.skin = &dressed->skin;
    voxel_world_create(&dressed->world, &options);
    const int nodes = dressed->skin.node_count;
    assert_int_equal(dressed->world.body->mesh.node_count, nodes);
    dressed->x = zeroed(3 * (size_t)nodes, sizeof *dressed->x);
    dressed->v = zeroed(3 * (size_t)nodes, sizeof *dressed->v);
}

static void undress(Dressed *dressed)
{
    mesh_destroy(&dressed->skin);
    voxel_world_destroy(&dressed->world);
    free(dressed->x);
    free(dressed->v);
}

static void take_snapshot(Dressed *dressed)
{
    const Body *body = dressed->world.body;
    body->ops->snapshot(body->model, dressed->x, dressed->v);
}

static Vec3 published(const float *from, int node)
{
    return vec3((double)from[3 * node], (double)from[3 * node + 1], (double)from[3 * node + 2]);
}

// x -> A (x - at) + to for places, B (x - at) for velocities; matrices by rows.
typedef struct Map {
    double a[9], b[9];
    Vec3 at, to;
} Map;

static Vec3 apply(const double m[9], Vec3 x)
{
    return vec3(m[0] * x.x + m[1] * x.y + m[2] * x.z, m[3] * x.x + m[4] * x.y + m[5] * x.z,
                m[6] * x.x + m[7] * x.y + m[8] * x.z);
}

static void expect_follows(Dressed *dressed, const Map *map)
{
    VoxelWorld *world = &dressed->world;
    for (int i = 0; i < world->count; i++) {
        Vec3 r = vec3_sub(world->x[i], map->at);
        world->x[i] = vec3_add(map->to, apply(map->a, r));
        world->v[i] = apply(map->b, r);
    }
    voxel_world_write(world, world->x, world->v);
    take_snapshot(dressed);
    double place = 0.0, speed = 0.0;
    for (int i = 0; i < dressed->skin.node_count; i++) {
        Vec3 r = vec3_sub(dressed->skin.position[i], map->at);
        Vec3 x = vec3_add(map->to, apply(map->a, r)), v = apply(map->b, r);
        place = fmax(place, vec3_length(vec3_sub(published(dressed->x, i), x)));
        speed = fmax(speed, vec3_length(vec3_sub(published(dressed->v, i), v)));
    }
    // Floats: of places and displacements up to 2 m, of speeds up to 1 m/s, each a few roundings of
    // 6e-8 (eight corners, whose weights sum to as much as 2 where it lies outside).
    print_message("off by %.2g m, %.2g m/s\n", place, speed);
    expect_near(place, 0.0, 1e-6);
    expect_near(speed, 0.0, 1e-6);
}

static const double NONE[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};

TEST(a_skin_at_rest_is_its_file)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++) {
        Dressed dressed;
        dress(&dressed, (Precision)precision, vec3(0.3, -0.2, 0.1),
              quat_from_rotation(vec3(0.4, 0.1, -1.0)));
        take_snapshot(&dressed);
        for (int i = 0; i < dressed.skin.node_count; i++) {
            // Half a unit of the last place of 0.3 m.
            Vec3 off = vec3_sub(published(dressed.x, i), dressed.skin.position[i]);
            expect_near(vec3_length(off), 0.0, 3e-8);
            expect_near(vec3_length(published(dressed.v, i)), 0.0, 0.0);
        }
        undress(&dressed);
    }
}

TEST(a_skin_follows_rigid_and_affine_motion)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++)
        for (int k = 0; k < 3; k++) {
            Dressed dressed;
            Map map = {.at = vec3(0.3, -0.2, 0.1), .to = vec3(-1.0, 0.5, 0.25)};
            dress(&dressed, (Precision)precision, map.at, quat_from_rotation(vec3(0.4, 0.1, -1.0)));
            memcpy(map.a, NONE, sizeof NONE);
            if (k == 1) // a turn
                for (int c = 0; c < 3; c++) {
                    Vec3 axis = quat_rotate(quat_from_rotation(vec3(1.0, -2.0, 0.5)),
                                            vec3(c == 0, c == 1, c == 2));
                    map.a[c] = axis.x, map.a[3 + c] = axis.y, map.a[6 + c] = axis.z;
                }
            uint64_t random = 6;
            for (int i = 0; i < 9; i++) { // any linear map
                map.a[i] += k == 2 ? random_between(&random, -0.3, 0.3) : 0.0;
                map.b[i] = random_between(&random, -10.0, 10.0);
            }
            expect_follows(&dressed, &map);
            undress(&dressed);
        }
}

TEST(a_skin_has_the_triangles_and_ids_of_its_file)
{
    Dressed dressed;
    dress(&dressed, PRECISION_SINGLE, vec3(0.0, 0.0, 0.0), QUAT_NONE);
    const BodyMesh *mesh = &dressed.world.body->mesh;
    const TriMesh *skin = &dressed.skin;
    assert_int_equal(mesh->triangle_count, skin->triangle_count);
    assert_memory_equal(mesh->triangle, skin->triangle,
                        (size_t)skin->triangle_count * sizeof *skin->triangle);
    for (int i = 0; i < skin->node_count; i++) {
        assert_int_equal(mesh->id[i], skin->file_index[i]);
        assert_int_equal(mesh->origin[i], skin->file_index[i]);
        assert_int_equal(mesh->parent[i][0], skin->file_index[i]);
        assert_int_equal(mesh->piece[i], 0);
        assert_int_equal(mesh->level[i], 0);
    }
    // Tools and loads still meet the elements.
    const VoxelModel *model = dressed.world.body->model;
    assert_int_equal(dressed.world.body->surface.node_count, model->surface_count);
    undress(&dressed);
}

static bool is_refused(Vec3 move, double scale, char *why, size_t size)
{
    Status status = {0};
    SCOPED(mesh_destroy) TriMesh skin;
    assert_true(generate_ico_sphere(&skin, 2, 0.05 * scale, &status));
    mesh_place(&skin, 1.0, vec3(0.0, 0.0, 0.0), move);
    VoxelWorldOptions options = voxel_world_ball();
    options.body.skin = &skin;
    options.body.lattice = &options.lattice;
    options.body.material = VOXEL_WORLD_MATERIALS;
    options.body.material_count = 1;
    SCOPED(arena_destroy) Arena arena = {0};
    SCOPED(state_destroy) StateList state = {0};
    Body body = {0};
    bool made = voxel_create(&body, &options.body, &arena, &state, &status);
    snprintf(why, size, "%s", status.text);
    lattice_destroy(&options.lattice);
    return !made;
}

TEST(a_skin_elsewhere_is_refused)
{
    char why[512];
    assert_false(is_refused(vec3(0.0, 0.0, 0.0), 1.0, why, sizeof why));
    assert_false(is_refused(vec3(0.0, 0.03, 0.0), 1.0, why, sizeof why)); // within four cells
    assert_true(is_refused(vec3(0.0, 0.08, 0.0), 1.0, why, sizeof why));
    assert_non_null(strstr(why, "skin"));
    assert_non_null(strstr(why, "0.04 m"));                                // the reach
    assert_true(is_refused(vec3(0.0, 0.0, 0.0), 1000.0, why, sizeof why)); // millimetres
    assert_true(is_refused(vec3(1e30, 0.0, 0.0), 1.0, why, sizeof why));
}

// Without a skin: the outer vertices, or all; their places and velocities as floats.
TEST(without_a_skin_vertices_are_published)
{
    for (int all = 0; all < 2; all++)
        for (int precision = 0; precision < PRECISION_COUNT; precision++) {
            VoxelWorldOptions options = voxel_world_cube(8);
            options.body.publish_all = all == 1;
            options.body.body.precision = (Precision)precision;
            SCOPED(voxel_world_destroy) VoxelWorld world;
            voxel_world_create(&world, &options);
            const BodyMesh *mesh = &world.body->mesh;
            const VoxelModel *model = world.body->model;
            // 9^3 - 7^3 points lie on the cube's faces.
            assert_int_equal(model->surface_count, 9 * 9 * 9 - 7 * 7 * 7);
            assert_int_equal(mesh->node_count, all == 1 ? world.count : model->surface_count);
            assert_int_equal(mesh->triangle_count, 6 * 8 * 8 * 2);
            uint64_t random = 8;
            for (int i = 0; i < world.count; i++) {
                world.x[i] = vec3_madd(world.x[i], 0.001, random_vec3(&random));
                world.v[i] = random_vec3(&random);
            }
            voxel_world_write(&world, world.x, world.v);
            FREED float(*x)[3] = calloc((size_t)mesh->node_count, sizeof *x);
            FREED float(*v)[3] = calloc((size_t)mesh->node_count, sizeof *v);
            assert_true(x != NULL && v != NULL);
            world.body->ops->snapshot(model, x[0], v[0]);
            for (int i = 0; i < mesh->node_count; i++) {
                Vec3 at = vec3((double)x[i][0], (double)x[i][1], (double)x[i][2]);
                Vec3 speed = vec3((double)v[i][0], (double)v[i][1], (double)v[i][2]);
                assert_int_equal(mesh->id[i], world.id[i]);
                // Floats of 0.05 m and of 1 m/s.
                expect_near(vec3_length(vec3_sub(at, world.x[i])), 0.0, 2e-8);
                expect_near(vec3_length(vec3_sub(speed, world.v[i])), 0.0, 3e-7);
            }
            FREED float *again = calloc(3 * (size_t)mesh->node_count, sizeof *again);
            world.body->ops->snapshot(model, again, NULL);
            assert_memory_equal(again, x, (size_t)mesh->node_count * sizeof *x);
        }
}
