// SPDX-License-Identifier: MIT
// A ball pressed deep into a solid, against finite elements that share nothing with the server:
// rings around the axis of a cylinder, the same law of the material, their own contact.
#include "test.h"
#include "sim_steps.h"
#include "voxel_world.h"

static const double PI = 3.14159265358979323846;
static const double YOUNG = 1e4, POISSON = 0.3, DENSITY = 1000.0; // [Pa], -, [kg/m3]
static const double HEIGHT = 0.05, RADIUS = 0.005; // of the solid, held at its bottom; ball [m]
enum { CELLS = 32 };                               // through the height, 3.2 in the ball's radius

// Depths of the ball [radii]. At 1.2 a cell beneath it has lost three quarters of its volume, from
// 1.4 on it is inside out, and from 1.5 on the force falls.
enum { DEPTHS = 4, SOUND = 3 };
static const double DEPTH[DEPTHS] = {0.5, 1.0, 1.2, 2.0};

// A cylinder as wide as a cube of HEIGHT in area, of RINGS x ROWS quadrilaterals of revolution,
// half as large near the ball as on the mean.
enum { RINGS = 24, ROWS = 44, NODES = (RINGS + 1) * (ROWS + 1) };

typedef struct Cylinder {
    double rest[NODES][2], x[NODES][2];  // distance from the axis, height [m]
    double v[NODES][2], force[NODES][2]; // of the whole ring of a node [m/s], [N]
    double mass[NODES];
} Cylinder;

static int ring_node(int i, int j)
{
    return j * (RINGS + 1) + i;
}

static double graded(int i, int count)
{
    const double s = (double)i / count;
    return 0.5 * s * (1.0 + s);
}

// One of the four Gauss points of an element: values and slopes of its shape functions, volume.
typedef struct Point {
    int node[4];
    double value[4], slope[4][2];
    double rest_radius, volume;
} Point;

static Point gauss_point(const Cylinder *cylinder, int i, int j, int which)
{
    const double s = (which & 1 ? 1.0 : -1.0) / sqrt(3.0), t = (which & 2 ? 1.0 : -1.0) / sqrt(3.0);
    static const int CORNER[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    const double *low = cylinder->rest[ring_node(i, j)];
    const double *high = cylinder->rest[ring_node(i + 1, j + 1)];
    const double width = high[0] - low[0], height = high[1] - low[1];
    Point out = {.volume = 0.0};
    for (int k = 0; k < 4; k++) {
        const int cs = CORNER[k][0], ct = CORNER[k][1];
        out.node[k] = ring_node(i + (cs + 1) / 2, j + (ct + 1) / 2);
        out.value[k] = 0.25 * (1.0 + cs * s) * (1.0 + ct * t);
        out.slope[k][0] = 0.5 * cs * (1.0 + ct * t) / width;
        out.slope[k][1] = 0.5 * ct * (1.0 + cs * s) / height;
        out.rest_radius += out.value[k] * cylinder->rest[out.node[k]][0];
    }
    out.volume = 2.0 * PI * out.rest_radius * 0.25 * width * height;
    return out;
}

static Cylinder *cylinder_create(void)
{
    Cylinder *out = zeroed(1, sizeof *out);
    for (int j = 0; j <= ROWS; j++)
        for (int i = 0; i <= RINGS; i++) {
            const int n = ring_node(i, j);
            out->x[n][0] = out->rest[n][0] = HEIGHT / sqrt(PI) * graded(i, RINGS);
            out->x[n][1] = out->rest[n][1] = HEIGHT * (1.0 - graded(ROWS - j, ROWS));
        }
    for (int j = 0; j < ROWS; j++)
        for (int i = 0; i < RINGS; i++)
            for (int q = 0; q < 4; q++) {
                const Point p = gauss_point(out, i, j, q);
                for (int k = 0; k < 4; k++)
                    out->mass[p.node[k]] += DENSITY * p.value[k] * p.volume;
            }
    return out;
}

// The corotated law, P = 2 mu (F - R) + lambda tr(R^T F - 1) R. Around an axis R turns in the plane
// of r and z alone, and the third stretch is r over that at rest.
static void add_stress(Cylinder *cylinder, const Point *p)
{
    const double mu = 0.5 * YOUNG / (1.0 + POISSON);
    const double lambda = 2.0 * mu * POISSON / (1.0 - 2.0 * POISSON);
    double f[2][2] = {{0.0}}, hoop = 0.0;
    for (int k = 0; k < 4; k++) {
        const double *x = cylinder->x[p->node[k]];
        hoop += p->value[k] * x[0] / p->rest_radius;
        for (int a = 0; a < 2; a++)
            for (int b = 0; b < 2; b++)
                f[a][b] += x[a] * p->slope[k][b];
    }
    const double cosine = f[0][0] + f[1][1], sine = f[1][0] - f[0][1];
    const double both = hypot(cosine, sine); // tr(R^T F) in the plane
    const double r[2][2] = {{cosine / both, -sine / both}, {sine / both, cosine / both}};
    const double pressure = lambda * (both + hoop - 3.0);
    for (int k = 0; k < 4; k++) {
        double *force = cylinder->force[p->node[k]];
        for (int a = 0; a < 2; a++)
            for (int b = 0; b < 2; b++)
                force[a] -= p->volume * p->slope[k][b] *
                            (2.0 * mu * (f[a][b] - r[a][b]) + pressure * r[a][b]);
        force[0] -= p->volume * (2.0 * mu * (hoop - 1.0) + pressure) * p->value[k] / p->rest_radius;
    }
}

// Springs of STIFFNESS per area at four points of each ring on top. Returns the ball's force.
static const double STIFFNESS = 3.2e8; // [N/m3]: E gives way by 0.03 mm
static double add_contact(Cylinder *cylinder, double ball)
{
    enum { PARTS = 4 };
    double sum = 0.0;
    for (int i = 0; i < RINGS; i++)
        for (int q = 0; q < PARTS; q++) {
            const int n = ring_node(i, ROWS), m = n + 1;
            const double share = (q + 0.5) / PARTS, inner = cylinder->rest[n][0];
            const double width = cylinder->rest[m][0] - inner;
            const double area = 2.0 * PI * (inner + share * width) * width / PARTS;
            double way[2];
            for (int a = 0; a < 2; a++)
                way[a] = (1.0 - share) * cylinder->x[n][a] + share * cylinder->x[m][a];
            way[1] -= ball;
            const double away = hypot(way[0], way[1]);
            if (away >= RADIUS)
                continue;
            for (int a = 0; a < 2; a++) {
                const double push = STIFFNESS * area * (RADIUS - away) * way[a] / away;
                cylinder->force[n][a] += (1.0 - share) * push;
                cylinder->force[m][a] += share * push;
                sum -= a == 1 ? push : 0.0;
            }
        }
    return sum;
}

// One explicit step, its velocities damped; the bottom is held, the axis stays on itself.
static double cylinder_step(Cylinder *cylinder, double ball, double h)
{
    const double drag = 60.0; // [1/s]
    for (int n = 0; n < NODES; n++)
        cylinder->force[n][0] = cylinder->force[n][1] = 0.0;
    for (int j = 0; j < ROWS; j++)
        for (int i = 0; i < RINGS; i++)
            for (int q = 0; q < 4; q++) {
                const Point p = gauss_point(cylinder, i, j, q);
                add_stress(cylinder, &p);
            }
    const double sum = add_contact(cylinder, ball);
    for (int n = RINGS + 1; n < NODES; n++)
        for (int a = n % (RINGS + 1) == 0 ? 1 : 0; a < 2; a++) {
            double *v = &cylinder->v[n][a];
            *v = (*v + h * cylinder->force[n][a] / cylinder->mass[n]) / (1.0 + drag * h);
            cylinder->x[n][a] += h * *v;
        }
    return sum;
}

// Presses at 4 radii a second from depth to depth and rests for 0.1 s at each: the means of the
// last half of it.
static const double SPEED = 4.0 * 0.005, REST = 0.1; // [m/s], [s]

static void press_cylinder(int depths, double force[DEPTHS])
{
    const double h = 4e-5; // the same force to 1e-3 with three quarters of it
    FREED Cylinder *cylinder = cylinder_create();
    double depth = 0.0;
    for (int k = 0; k < depths; k++) {
        for (; depth < DEPTH[k] * RADIUS; depth += SPEED * h)
            cylinder_step(cylinder, HEIGHT + RADIUS - depth, h);
        const long steps = lround(REST / h);
        force[k] = 0.0;
        for (long i = 0; i < steps; i++) {
            const double now = cylinder_step(cylinder, HEIGHT + RADIUS - depth, h);
            force[k] += i < steps / 2 ? 0.0 : now / (double)(steps - steps / 2);
        }
    }
}

static double tick_at(VoxelWorld *world, double depth)
{
    // Not above a vertex, nor above the middle of a face.
    put_tool(world->sim, 0, (Vec3){0.001, 0.0007, 0.5 * HEIGHT + RADIUS - depth});
    sim_step(world->sim);
    return sim_wrench(world->sim, 0)->force.z;
}

static void press_cube(int depths, double force[DEPTHS])
{
    static const FixedRegion bottom = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.0249}};
    VoxelWorldOptions options = voxel_world_block(CELLS, CELLS, CELLS, HEIGHT / CELLS);
    options.body.body.levels = 2;
    options.material.poisson_ratio = POISSON;
    options.body.body.precision = PRECISION_SINGLE;
    fix_within(&options.body.body, &bottom);
    options.body.body.friction = 0.0;
    options.tool[options.tool_count++] = (ToolOptions){PROBE(RADIUS, 100.0)}; // does not give way
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    sim_set_lockstep(world.sim, true);
    const double tick = sim_tick(world.sim);
    double depth = 0.0;
    for (int k = 0; k < depths; k++) {
        for (; depth < DEPTH[k] * RADIUS; depth += SPEED * tick)
            tick_at(&world, depth);
        const int ticks = (int)lround(REST / tick);
        force[k] = 0.0;
        for (int i = 0; i < ticks; i++) {
            const double now = tick_at(&world, depth);
            force[k] += i < ticks / 2 ? 0.0 : now / (ticks - ticks / 2);
        }
    }
    assert_int_equal(world.body->resets, 0);
}

TEST(deep_presses_follow_finite_elements_of_the_same_law)
{
    const int depths = test_is_long() ? DEPTHS : 2;
    double finite[DEPTHS], server[DEPTHS];
    press_cylinder(depths, finite);
    press_cube(depths, server);
    for (int k = 0; k < depths; k++)
        print_message("%.1f radii: %.4f N, finite elements %.4f N (%+.1f %%)\n", DEPTH[k],
                      server[k], finite[k], 100.0 * (server[k] / finite[k] - 1.0));
    // Elements of 0.7 or 1.3 times the size change the reference by 1.4 %, a contact 2.5 times as
    // stiff by 0.7 %; the server's cells are coarser than its elements near the ball, by which it
    // was 3 to 4 % too low.
    for (int k = 0; k < SOUND && k < depths; k++)
        expect_near(server[k], finite[k], 0.06 * finite[k]);
    if (depths <= SOUND)
        return;
    // Not a fault of cells or contact: the law itself gives way.
    expect_at_most(finite[SOUND], 0.8 * finite[SOUND - 1]);
    expect_at_most(server[SOUND], 0.8 * server[SOUND - 1]);
}
