// Graspers: what they take hold of, how stiff the grip is, what it gives the body and the tool
// feels, and that letting go leaves nothing behind.
#include "contact_bench.h"
#include "effort.h"
#include "expect.h"
#include "random.h"

#include "dynamics/sim_data.h"

static ToolOptions jaws(double radius)
{
    ToolOptions tool = bench_ball(radius);
    tool.kind = TOOL_GRASPER;
    tool.grip_stiffness = 0.3;
    tool.grip_damping = 0.5;
    tool.max_force = 100.0;
    return tool;
}

static void hold_at(Bench *bench, Vec3 position, Quat orientation, double grip)
{
    ToolPose pose = {
        .position = position, .orientation = orientation, .active = true, .grip = grip};
    sim_apply_pose(bench->sim, 0, &pose, true);
    sim_step(bench->sim);
}

static int held(const Bench *bench, bool *points)
{
    return attachment_held(bench->sim->attachment[0], points);
}

// ---------------------------------------------------------------------------------------------
// How stiff

typedef struct Pull {
    int nodes;
    double stretch, force; // [m], [N]
} Pull;

// The pole of a sphere with a held seat, gripped, pulled 20 mm at 50 mm/s and held for a second.
static Pull pull_pole(int subdivisions, double stiffness)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(subdivisions), jaws(0.009));
    options.tool[0].grip_stiffness = stiffness;
    Bench bench;
    bench_create(&bench, &options);
    int pole = bench_node_towards(&bench.mesh, vec3(0, 0, 1));
    const Vec3 at = bench.mesh.position[pole], out = vec3_unit(at);
    const Quat straight = {1.0, 0.0, 0.0, 0.0};
    hold_at(&bench, at, straight, 1.0);
    bool points;
    Pull pull = {.nodes = held(&bench, &points)};
    assert_false(points);
    for (int i = 1; i <= 1400; i++)
        hold_at(&bench, vec3_madd(at, fmin(0.02, 5e-5 * i), out), straight, 1.0);
    bench_read(&bench);
    const Attachment *grip = bench.sim->attachment[0];
    (void)grip;
    for (int i = 0; i < bench.mesh.node_count; i++)
        if (vec3_length(vec3_sub(bench.mesh.position[i], at)) <= 0.009)
            printf("%g ", 1e3*vec3_length(vec3_sub(vec3_madd(bench.mesh.position[i],0.02,out),bench.x[i]))),
            pull.stretch += (0.02 - vec3_dot(vec3_sub(bench.x[i], bench.mesh.position[i]), out)) /
                            pull.nodes;
    pull.force = -vec3_dot(sim_wrench(bench.sim, 0)->force, out);
    bench_destroy(&bench);
    return pull;
}

int main(void)
{
    for (double g = 0.001; g < 5; g *= 3.16) {
        Pull p = pull_pole(3, g);
        printf("%g: %d %g %g\n", g, p.nodes, p.stretch * 1e3, p.force);
    }
    Pull p = pull_pole(3, 0.3);
        printf("%g: %d %g %g\n", 0.3, p.nodes, p.stretch * 1e3, p.force);
    return 0;
}
