// SPDX-License-Identifier: MIT
// The potential of a tool and a solid: its forces are its slope for all nodes and the tool, they do
// not jump, and on a body that does not yield they are those of an integral over a flat wall and
// give no work around closed loops.
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "random.h"
#include "voxel_world.h"

#include "sim/contact/contact_data.h"

static const double PI = 3.14159265358979323846, TOP = 0.05;

// A cube of 0.1 m, wholly held, with a probe of one capsule along x.
static void create_wall(VoxelWorld *world, int cells, double length, double radius)
{
    static const FixedRegion all = {.kind = FIXED_BOX, .low = {-1, -1, -1}, .high = {1, 1, 1}};
    VoxelWorldOptions options = voxel_world_cube(cells);
    options.body.body.levels = 0;
    fix_within(&options.body.body, &all);
    options.body.body.friction = 0.0;
    options.body.body.contact_damping = 0.0;
    options.tool[options.tool_count++] = (ToolOptions){CAPSULE(length, radius, 1e6)};
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

// A contact whose nodes are moved about as if the body had deformed, without a body in motion.
typedef struct Crumpled {
    VoxelWorld world;
    Contact *contact;
    ToolPlacement at;
    Vec3 *smooth; // [local_count] positions of the nodes
} Crumpled;

// A cube of 8 cells of 12.5 mm, its nodes displaced by up to a fifth of a cell, and a tool that is
// `deep` radii inside of one of its faces, an edge or a corner. Returns false where the tool's axis
// is not outside.
static bool crumple(Crumpled *crumpled, uint64_t *random, double deep)
{
    Contact *contact = crumpled->contact;
    const double cell = 0.0125, radius = contact->largest_radius;
    Vec3 towards = random_vec3(random);
    towards =
        vec3_scale(TOP / fmax(fabs(towards.x), fmax(fabs(towards.y), fabs(towards.z))), towards);
    const Vec3 out = vec3_unit(towards);
    crumpled->at = (ToolPlacement){
        .position = vec3_madd(towards, (1.0 - deep) * radius, out),
        .orientation = quat_from_rotation(random_vec3(random)),
    };
    contact_find_candidates(contact, &crumpled->at, radius);
    if (contact->local_count == 0)
        return false;
    for (int i = 0; i < contact->local_count; i++)
        contact->x[i] = vec3_madd(contact->x[i], 0.2 * cell, random_vec3(random));
    contact->yielded = 0.0;
    Vec3 way;
    if (contact_look(contact, &crumpled->at, false, &way))
        return false;
    crumpled->smooth = realloc(crumpled->smooth, (size_t)contact->local_count * sizeof(Vec3));
    assert_non_null(crumpled->smooth);
    memcpy(crumpled->smooth, contact->x, (size_t)contact->local_count * sizeof(Vec3));
    return true;
}

// Evaluates with the nodes moved by `size` times `way` [local_count], the tool by size times
// `move`.
static void evaluate_moved(Crumpled *crumpled, double size, const Vec3 *way, Vec3 move)
{
    Contact *contact = crumpled->contact;
    ToolPlacement at = crumpled->at;
    at.position = vec3_madd(at.position, size, move);
    for (int i = 0; i < contact->local_count; i++)
        contact->x[i] = vec3_madd(crumpled->smooth[i], size, way[i]);
    contact->yielded = 2.0 * fabs(size);
    contact_evaluate(contact, &at, 0.0);
}

static Vec3 force_on_tool(const Contact *contact)
{
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int i = 0; i < contact->local_count; i++)
        sum = vec3_sub(sum, contact->f[i]);
    return sum;
}

static void random_ways(const Contact *contact, uint64_t *random, Vec3 *way)
{
    for (int i = 0; i < contact->local_count; i++)
        way[i] = random_vec3(random);
}

static const double LENGTHS[] = {0.0, 0.02}, CELLS[] = {0.5, 1.0, 3.0};

// For every position of the nodes and of the tool, the forces on the nodes and on the tool are the
// slope of one energy, and the lumped stiffness is about how fast they fall.
TEST(forces_are_the_gradient_of_one_potential)
{
    uint64_t random = 7;
    int tried = 0;
    for (int k = 0; k < 6; k++) {
        Crumpled crumpled = {0};
        create_wall(&crumpled.world, 8, LENGTHS[k % 2], CELLS[k / 2] * 0.0125);
        Contact *contact = crumpled.contact = crumpled.world.sim->contact[0];
        FREED Vec3 *way = calloc((size_t)contact->node_capacity, sizeof *way);
        double worst = 0.0, steepest = 0.0;
        for (int trial = 0; trial < EFFORT(300); trial++) {
            if (!crumple(&crumpled, &random, random_between(&random, 0.05, 0.95)))
                continue;
            const Vec3 move = random_vec3(&random);
            random_ways(contact, &random, way);
            const double step = 1e-7 * contact->largest_radius;
            double energy[2], scale = 0.0, slope, fall = 0.0, bound = 0.0;
            for (int side = 0; side < 2; side++) {
                evaluate_moved(&crumpled, side == 0 ? -step : step, way, move);
                energy[side] = contact->forces.energy;
                for (int i = 0; i < contact->local_count; i++)
                    fall += (side == 0 ? 0.5 : -0.5) / step *
                            vec3_dot(contact->f[i], vec3_sub(way[i], move));
            }
            evaluate_moved(&crumpled, 0.0, way, move);
            slope = vec3_dot(force_on_tool(contact), move);
            for (int i = 0; i < contact->local_count; i++) {
                const Vec3 d = vec3_sub(way[i], move);
                slope += vec3_dot(contact->f[i], way[i]);
                scale += vec3_length(contact->f[i]);
                bound += sym3_along(contact->lumped[i], d);
            }
            if (scale == 0.0)
                continue;
            tried++;
            const double error = fabs((energy[1] - energy[0]) / (2.0 * step) + slope) / scale;
            worst = fmax(worst, error);
            // Differences of an energy of `scale` times the radius: rounding 1e-16 / 1e-7.
            expect_at_most(error, 1e-6);
            steepest = fmax(steepest, fall / bound);
        }
        // The implicit step is stable to twice the bound (server/sim/README.md).
        expect_at_most(steepest, 1.8);
        print_message("%g cells, %s: off by %.2g at most, steepness %.3f of the bound\n",
                      CELLS[k / 2], k % 2 == 0 ? "ball" : "capsule", worst, steepest);
        free(crumpled.smooth);
        voxel_world_destroy(&crumpled.world);
    }
    expect_at_least(tried, EFFORT(600));
}

// Along a million short ways of all nodes and of the tool, over edges, corners and the rims of what
// acts, no force jumps: it changes by at most what its stiffness allows.
TEST(no_force_jumps_on_short_ways)
{
    uint64_t random = 11;
    const int trials = EFFORT(1000000) / 6 / 100;
    for (int k = 0; k < 6; k++) {
        Crumpled crumpled = {0};
        create_wall(&crumpled.world, 8, LENGTHS[k % 2], CELLS[k / 2] * 0.0125);
        Contact *contact = crumpled.contact = crumpled.world.sim->contact[0];
        FREED Vec3 *way = calloc((size_t)contact->node_capacity, sizeof *way);
        double worst = 0.0;
        for (int trial = 0; trial < trials; trial++) {
            if (!crumple(&crumpled, &random, random_between(&random, 0.0, 0.9)))
                continue;
            const Vec3 move = random_vec3(&random);
            random_ways(contact, &random, way);
            // A hundred steps, each a five-thousandth of the radius at most: the barrier's
            // stiffness doubles within a hundredth where it begins.
            const double step = 2e-4 * contact->largest_radius / sqrt(3.0);
            Vec3 before = {0.0, 0.0, 0.0};
            double before_bound = 0.0;
            for (int i = 0; i <= 100; i++) {
                evaluate_moved(&crumpled, i * step, way, move);
                if (contact->forces.floor < 0.02 * contact->largest_radius)
                    break; // the barrier grows without end
                const Vec3 force = force_on_tool(contact);
                // A spring k over a distance d, pressed by f, changes by k + f / d a length.
                double bound = contact->forces.weight /
                               fmin(contact->forces.floor, 0.85 * contact->largest_radius);
                for (int n = 0; n < contact->local_count; n++)
                    bound += sym3_trace(contact->lumped[n]);
                const double change = vec3_length(vec3_sub(force, before));
                // Nodes and tool part by up to 2 sqrt(3) steps. The bound itself changes on the
                // way.
                const double most = 2.0 * sqrt(3.0) * step * fmax(bound, before_bound);
                if (i > 0 && change > 0.0) {
                    worst = fmax(worst, change / most);
                    expect_at_most(change, 1.5 * most);
                }
                before = force;
                before_bound = bound;
            }
        }
        print_message("%g cells, %s: %.2f of the bound at most\n", CELLS[k / 2],
                      k % 2 == 0 ? "ball" : "capsule", worst);
        free(crumpled.smooth);
        voxel_world_destroy(&crumpled.world);
    }
}

// On a flat wall that does not yield, a ball of four cells: the sum over the points of the faces is
// the integral over the wall of kappa (r - d), pi kappa (r - z)^2 (2 r + z) / 3, plus the
// barrier's.
TEST(a_flat_wall_pushes_as_the_integral_over_it)
{
    const double r = 0.02;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    create_wall(&world, 20, 0.0, r);
    double last = 0.0;
    for (double z = 0.95; z > 0.04; z -= 0.05) {
        const double force = feel(&world, vec3(0.0, 0.0, TOP + z * r), QUAT_NONE).force.z;
        const BodySurface *surface = &world.body->surface;
        // Vertices inside a flat wall; firmness is that of the weakest face.
        double kappa = 9.0 * world.body->contact_kappa; // 4 and 0.5, in place of 0.5
        for (int f = 0; f < surface->face_count && surface->face_firmness != NULL; f++) {
            Vec3 x[3];
            world.body->ops->read_nodes(world.body->model, surface->face[f], 3, x, NULL);
            if (fabs(x[0].x) + fabs(x[0].y) < 0.012 && x[0].z > TOP - 1e-9 && x[1].z > TOP - 1e-9 &&
                x[2].z > TOP - 1e-9)
                kappa = 9.0 * world.body->contact_kappa * surface->face_firmness[f];
        }
        // Force on the tool along z: the integral of kappa (r - d) z / d over the disc.
        const double h = z * r;
        const double expected = 2.0 * PI * kappa * h * (r * (r - h) - 0.5 * (r * r - h * h));
        print_message("at %.2f r: %.4f N, integral %.4f N\n", z, force, expected);
        assert_true(force > last); // up to the axis
        // One point for each eighth of a cell: 6 % of a circle of two cells. Nearer than 0.85 r the
        // barrier adds to it.
        if (z < 0.81 && z > 0.71)
            expect_at_least(force, 0.94 * expected);
        else if (z > 0.86 && z < 0.91)
            expect_near(force, expected, 0.06 * expected);
        last = force;
    }
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

TEST(closed_loops_give_no_work)
{
    VoxelWorld world;
    create_wall(&world, 20, 0.0, 0.012);
    double ball = loop_work(&world, 0.008, 0.01, 0.0, EFFORT(600));
    voxel_world_destroy(&world);
    create_wall(&world, 20, 0.03, 0.012);
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
