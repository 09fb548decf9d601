// How the faces of a solid push a tool that is thick against them: on a body that does not yield,
// against a plain sum over a flat wall, and around closed loops.
#include "effort.h"
#include "expect.h"
#include "voxel_world.h"

static const double PI = 3.14159265358979323846, TOP = 0.05;

// A cube of 20 cells of 5 mm, wholly held, with a probe of one capsule along x.
static void create_wall(VoxelWorld *world, double length, double radius)
{
    static const FixedRegion all = {.kind = FIXED_BOX, .low = {-1, -1, -1}, .high = {1, 1, 1}};
    VoxelWorldOptions options = voxel_world_cube(20);
    options.body.body.levels = 0;
    options.body.body.fixed = &all;
    options.body.body.fixed_count = 1;
    options.body.body.friction = 0.0;
    options.body.body.contact_damping = 0.0;
    options.tool_count = 1;
    options.tool[0] = (ToolOptions){.id = 1,
                                    .kind = TOOL_PROBE,
                                    .capsule_count = 1,
                                    .capsule = {{.from = {-0.5 * length, 0.0, 0.0},
                                                 .to = {0.5 * length, 0.0, 0.0},
                                                 .radius = radius}},
                                    .max_force = 1e6};
    voxel_world_create(world, &options);
    sim_set_lockstep(world->sim, true);
}

// The force and torque at a place, once the proxy is there.
static ToolWrench feel(VoxelWorld *world, Vec3 position, Quat orientation)
{
    ToolPose pose = {.position = position, .orientation = orientation, .active = true};
    sim_apply_pose(world->sim, 0, &pose, true);
    for (int i = 0; i < 40; i++) {
        sim_step(world->sim);
        Vec3 left = vec3_sub(sim_wrench(world->sim, 0)->position, position);
        if (i > 1 && vec3_length(left) < 1e-12)
            break;
    }
    return *sim_wrench(world->sim, 0);
}

// How far the point (x, y) lies beside a face, by sampling it.
static double beside(const Vec3 corner[3], double x, double y)
{
    enum { PARTS = 40 };
    double least = (double)INFINITY;
    for (int i = 0; i <= PARTS; i++)
        for (int k = 0; k <= PARTS - i; k++) {
            double a = (double)i / PARTS, b = (double)k / PARTS, c = 1.0 - a - b;
            double dx = a * corner[0].x + b * corner[1].x + c * corner[2].x - x;
            double dy = a * corner[0].y + b * corner[1].y + c * corner[2].y - y;
            least = fmin(least, sqrt(dx * dx + dy * dy));
        }
    return least;
}

// The push upwards on a ball at height z r above the top's middle: sum k (r - phi) over its faces,
// phi = z r + r q(s) with q of the ball up to 45 degrees, then of a cone.
static double wall_force(const VoxelWorld *world, double z, double r)
{
    const BodySurface *surface = &world->body->surface;
    double force = 0.0;
    for (int f = 0; f < surface->face_count; f++) {
        Vec3 x[3];
        world->body->ops->read_nodes(world->body->model, surface->face[f], 3, x, NULL);
        if (fmin(x[0].z, fmin(x[1].z, x[2].z)) < TOP - 1e-6)
            continue;
        double s = beside(x, 0.0, 0.0) / r;
        double q = s < sqrt(0.5) ? 1.0 - sqrt(1.0 - s * s) : 1.0 - sqrt(2.0) + s;
        double firmness = surface->face_firmness == NULL ? 1.0 : surface->face_firmness[f];
        force += world->body->contact_kappa * firmness * surface->face_area[f] * r *
                 fmax(0.0, 1.0 - z - q);
    }
    return force;
}

static void force_rises_as_the_ball_comes_nearer(void **state)
{
    (void)state;
    const double r = 0.02; // four faces
    VoxelWorld world;
    create_wall(&world, 0.0, r);
    double last = 0.0;
    for (double z = 0.9; z > 0.34; z -= 0.05) {
        double force = feel(&world, vec3(0.0, 0.0, TOP + z * r), QUAT_NONE).force.z;
        double expected = wall_force(&world, z, r);
        printf("at %.2f r: %.4f N, by samples %.4f N\n", z, force, expected);
        assert_true(force > last);
        // Samples lie an eighth of a millimetre apart: of 20 mm.
        expect_near(force, expected, 0.01 * expected);
        last = force;
    }
    voxel_world_destroy(&world);
}

// Work around closed curves at changing depths, as a share of the work to press and release.
static double loop_work(VoxelWorld *world, double height, double across, double turn, int points)
{
    double work = 0.0, most = 0.0;
    Vec3 before = {0.0, 0.0, 0.0}, force = before;
    for (int i = 0; i <= points; i++) {
        double a = 2.0 * PI * i / points;
        Vec3 at = {across * cos(a) + 0.0011, across * sin(a) + 0.0007,
                   TOP + height + 0.3 * height * sin(2.0 * a + 0.4)};
        ToolWrench wrench = feel(world, at, quat_from_rotation(vec3(0.0, turn, 0.0)));
        if (i > 0)
            work += 0.5 * vec3_dot(vec3_add(force, wrench.force), vec3_sub(at, before));
        most = fmax(most, vec3_length(wrench.force));
        before = at;
        force = wrench.force;
    }
    return work / (most * 0.6 * height);
}

static void closed_loops_give_no_work(void **state)
{
    (void)state;
    VoxelWorld world;
    create_wall(&world, 0.0, 0.012);
    double ball = loop_work(&world, 0.008, 0.01, 0.0, EFFORT(600));
    voxel_world_destroy(&world);
    create_wall(&world, 0.03, 0.012);
    double flat = loop_work(&world, 0.008, 0.01, 0.0, EFFORT(600));
    double tilted = loop_work(&world, 0.009, 0.01, 0.1, EFFORT(600));
    voxel_world_destroy(&world);
    printf("ball %.2e, capsule %.2e, tilted %.2e of pressing and releasing\n", ball, flat, tilted);
    // The sums' own error, which falls with the square of the steps; a capsule's nearest pair is
    // that by distance.
    expect_near(ball, 0.0, EFFORT(600) < 600 ? 0.02 : 2e-3);
    expect_near(flat, 0.0, EFFORT(600) < 600 ? 0.02 : 2e-3);
    expect_near(tilted, 0.0, 0.02);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(force_rises_as_the_ball_comes_nearer),
        cmocka_unit_test(closed_loops_give_no_work),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
