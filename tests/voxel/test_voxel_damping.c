// SPDX-License-Identifier: MIT
// Damping by a time (C = beta K) and drag (C = drag M): the forces, the decay of a beam's swing,
// what a free body keeps, the bound of the step.
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "extreme.h"
#include "random.h"
#include "voxel_world.h"

#include "voxel/template.h"

static const double PI = 3.14159265358979323846;

// ---------------------------------------------------------------------------------------------
// The element

typedef struct Shape {
    Element element;
    Template shape;
    ElementStiffness stiffness;
} Shape;

static void make_shape(Shape *out, unsigned mask, double nu)
{
    template_create(&out->shape, mask);
    out->element =
        (Element){out->shape.count, out->shape.rest, out->shape.weight, out->shape.area, 1.0};
    out->stiffness = (ElementStiffness){.law = VOXEL_AFFINE,
                                        .mu = 1.0,
                                        .lambda = 2.0 * nu / (1.0 - 2.0 * nu),
                                        .residual = (1.0 + nu) / 3.0};
}

// At rest the forces of velocities v are beta times those of small displacements v, for every rest
// shape.
TEST(damping_is_beta_times_the_stiffness)
{
    uint64_t random = 11;
    const double beta = 0.37, step = 1e-6;
    double worst = 0.0;
    for (int round = 0; round < EFFORT(200); round++) {
        Shape s;
        const unsigned mask =
            round == 0 ? 0 : (unsigned)random_bits(&random) & ((1u << (NODE_COUNT - 8)) - 1);
        make_shape(&s, mask, round % 3 * 0.2);
        Vec3 v[NODE_COUNT], x[NODE_COUNT], force[3][NODE_COUNT] = {{{0.0, 0.0, 0.0}}};
        for (int i = 0; i < s.element.count; i++)
            v[i] = random_vec3(&random);
        for (int side = 0; side < 2; side++) {
            Quat last = QUAT_NONE;
            for (int i = 0; i < s.element.count; i++)
                x[i] = vec3_madd(s.shape.rest[i], side == 0 ? step : -step, v[i]);
            element_forces(&s.element, &s.stiffness, x, NULL, &last, force[side]);
        }
        Quat last = QUAT_NONE;
        s.stiffness.damping_time = beta;
        element_forces(&s.element, &s.stiffness, s.shape.rest, v, &last, force[2]);
        for (int i = 0; i < s.element.count; i++) {
            Vec3 pull = vec3_scale(0.5 * beta / step, vec3_sub(force[0][i], force[1][i]));
            worst = fmax(worst, vec3_length(vec3_sub(pull, force[2][i])));
        }
    }
    print_message("damping over beta K: off by %.2g\n", worst);
    expect_at_most(worst, 1e-8); // differences at 1e-6
}

// ---------------------------------------------------------------------------------------------
// A beam

static const double LENGTH = 0.2, WIDTH = 0.05; // [m]

// The first mode of a cantilever, 1 at the free end.
static double mode(double x)
{
    const double k = 1.8751040687, s = 0.7340955138, z = k * x / LENGTH;
    return 0.5 * (cosh(z) - cos(z) - s * (sinh(z) - sin(z)));
}

typedef struct Beam {
    int n; // elements through the thickness
    double poisson_ratio, damping_time, drag;
    Precision precision;
    bool cuttable;
    int levels;
} Beam;

static void make_beam(VoxelWorld *world, const Beam *beam)
{
    static const FixedRegion end = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {-0.0999, 1.0, 1.0}};
    const int n = beam->n;
    VoxelWorldOptions options = voxel_world_block(4 * n, n, n, WIDTH / n);
    options.material = (SolidMaterial){
        .youngs_modulus = 1e5, .poisson_ratio = beam->poisson_ratio, .density = 1000.0};
    fix_within(&options.body.body, &end);
    options.body.body.levels = beam->levels;
    options.body.body.precision = beam->precision;
    options.body.body.cuttable = beam->cuttable;
    options.body.split_budget = 4;
    options.body.body.integrator = INTEGRATOR_LEAPFROG;
    options.body.damping = 0.0;
    options.body.damping_time = beam->damping_time;
    options.body.drag = beam->drag;
    voxel_world_create(world, &options);
}

// The part of the first mode in the displacements, up to a factor; `rest` [count].
static double amplitude(VoxelWorld *world, const Vec3 *rest)
{
    double sum = 0.0;
    voxel_world_read(world);
    for (int i = 0; i < world->count; i++)
        sum += world->mass[i] * mode(rest[i].x + 0.5 * LENGTH) * (world->x[i].z - rest[i].z);
    return sum;
}

// Plucks the beam; returns the damping ratio by the logarithmic decrement, and the frequency [Hz].
static double swing(const Beam *beam, double *frequency)
{
    SCOPED(voxel_world_destroy) VoxelWorld world;
    make_beam(&world, beam);
    FREED Vec3 *rest = malloc((size_t)world.count * sizeof *rest);
    memcpy(rest, world.x, (size_t)world.count * sizeof *rest);
    for (int i = 0; i < world.count; i++)
        world.v[i] = vec3(0.0, 0.0, 0.02 * mode(rest[i].x + 0.5 * LENGTH));
    voxel_world_write(&world, world.x, world.v);
    Extremes extremes = {0};
    bool more = true;
    for (int tick = 1; tick < 10000 && more; tick++) {
        sim_step(world.sim);
        more = add_sample(&extremes, amplitude(&world, rest));
    }
    assert_false(more);
    double decrement;
    const double half = half_swing(&extremes, &decrement);
    *frequency = 0.5 / (half * sim_tick(world.sim));
    return decrement / PI / sqrt(1.0 + decrement * decrement / (PI * PI));
}

static void expect_ratio(const Beam *beam)
{
    double f;
    const double ratio = swing(beam, &f);
    f /= sqrt(1.0 - ratio * ratio); // undamped
    const double expected = PI * f * beam->damping_time + beam->drag / (4.0 * PI * f);
    print_message("n %d, nu %.1f, levels %d, %s%s, damping_time %g s, drag %g /s: %.4g Hz, damping "
                  "ratio %.5f, %.5f by the formula\n",
                  beam->n, beam->poisson_ratio, beam->levels,
                  beam->precision == PRECISION_SINGLE ? "single" : "double",
                  beam->cuttable ? ", cuttable" : "", beam->damping_time, beam->drag, f, ratio,
                  expected);
    expect_near(ratio, expected, 0.05 * expected);
}

// Whatever the cells; the long form: the levels, the precision: it is a property of the material.
TEST(a_beam_swings_out_at_the_rate_of_the_formula)
{
    for (int n = 2; n <= (test_is_long() ? 4 : 2); n += 2) {
        expect_ratio(&(Beam){.n = n, .drag = 1.5, .precision = PRECISION_DOUBLE});
        expect_ratio(&(Beam){.n = n, .damping_time = 8e-3, .precision = PRECISION_DOUBLE});
    }
    expect_ratio(&(Beam){.n = 3, .drag = 0.5, .damping_time = 4e-3, .poisson_ratio = 0.3});
    if (!test_is_long())
        return;
    expect_ratio(&(Beam){.n = 6, .levels = 1, .damping_time = 8e-3, .precision = PRECISION_SINGLE});
    expect_ratio(&(Beam){.n = 3,
                         .cuttable = true,
                         .drag = 0.5,
                         .damping_time = 4e-3,
                         .poisson_ratio = 0.45,
                         .precision = PRECISION_DOUBLE});
}

// SET: both are scaled.
TEST(the_scale_is_one_of_drag_too)
{
    SCOPED(voxel_world_destroy) VoxelWorld world;
    char why[200];
    make_beam(&world, &(Beam){.n = 2, .drag = 3.0, .precision = PRECISION_DOUBLE});
    for (int i = 0; i < world.count; i++)
        world.v[i] = vec3(0.0, 0.0, 0.01 * mode(world.x[i].x + 0.5 * LENGTH));
    voxel_world_write(&world, world.x, world.v);
    BodyMeasure start, now;
    start = measure_of(world.body);
    apply_well(sim_apply_set, world.sim, "body.damping_scale", 0.0);
    voxel_world_run(&world, 0.5);
    now = measure_of(world.body);
    expect_at_least((now.kinetic + now.elastic) / start.kinetic, 0.97);
    apply_well(sim_apply_set, world.sim, "body.damping_scale", 2.0);
    voxel_world_run(&world, 0.5);
    now = measure_of(world.body);
    // e^(-6 t), more or less by where in the swing the time began and ended.
    expect_near(log((now.kinetic + now.elastic) / start.kinetic), -3.0, 0.5);
    assert_false(sim_apply_set(world.sim, "body.damping_scale", 1e6, why, sizeof why));
    assert_non_null(strstr(why, "time step"));
}

// ---------------------------------------------------------------------------------------------
// A free body

typedef struct Free {
    Precision precision;
    double damping_time, drag;
    bool falls, cut;
} Free;

static void make_free(VoxelWorld *world, const Free *free_body)
{
    VoxelWorldOptions options = voxel_world_cube(8);
    options.body.body.precision = free_body->precision;
    options.body.damping = 0.0;
    options.body.damping_time = free_body->damping_time;
    options.body.drag = free_body->drag;
    options.body.body.cuttable = free_body->cut;
    options.body.split_budget = 4;
    options.material.poisson_ratio = 0.3;
    if (free_body->falls)
        options.body.body.gravity = vec3(0.0, 0.0, -9.81);
    voxel_world_create(world, &options);
    uint64_t random = 21;
    for (int i = 0; i < world->count; i++) {
        world->v[i] = vec3_cross(vec3(0.5, -1.0, 2.0), world->x[i]);
        world->v[i] = vec3_madd(world->v[i], 0.05, random_vec3(&random));
        world->v[i] = vec3_add(world->v[i], vec3(0.3, -0.1, 0.2));
    }
    voxel_world_write(world, world->x, world->v);
    voxel_world_read(world);
}

// Of the motion relative to the rigid one only: what is left turns and flies as before.
TEST(a_free_body_keeps_its_momentum)
{
    static const Free BODIES[] = {
        {PRECISION_DOUBLE, 0.0, 4.0, false, false},  {PRECISION_SINGLE, 0.0, 4.0, false, false},
        {PRECISION_DOUBLE, 5e-3, 0.0, false, false}, {PRECISION_SINGLE, 5e-3, 0.0, false, false},
        {PRECISION_DOUBLE, 1e-3, 4.0, false, true},
    };
    for (size_t k = 0; k < sizeof BODIES / sizeof *BODIES; k++) {
        SCOPED(voxel_world_destroy) VoxelWorld world;
        make_free(&world, &BODIES[k]);
        Vec3 linear[2], angular[2];
        voxel_world_momentum(&world, &linear[0], &angular[0]);
        double before = energy_of(world.body), most = 0.0;
        for (int i = 0; i < TRIALS(10, 40); i++) {
            voxel_world_run(&world, 0.05);
            const double now = energy_of(world.body);
            most = fmax(most, now / before);
            before = now;
        }
        voxel_world_read(&world);
        voxel_world_momentum(&world, &linear[1], &angular[1]);
        const double p = vec3_length(vec3_sub(linear[1], linear[0])) / vec3_length(linear[0]),
                     l = vec3_length(vec3_sub(angular[1], angular[0])) / vec3_length(angular[0]);
        const bool single = BODIES[k].precision == PRECISION_SINGLE;
        print_message("%s, damping_time %g s, drag %g /s: momentum off by %.2g, angular by %.2g, "
                      "energy at most %.6f of that before\n",
                      single ? "single" : "double", BODIES[k].damping_time, BODIES[k].drag, p, l,
                      most);
        expect_at_most(p, single ? 1e-5 : 1e-11);
        expect_at_most(l, single ? 1e-4 : 1e-10);
        expect_at_most(most, 1.0 + (single ? 1e-5 : 1e-3)); // leapfrogging elastic energy
    }
}

TEST(drag_lets_a_free_body_fall)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++) {
        SCOPED(voxel_world_destroy) VoxelWorld world;
        make_free(&world, &(Free){(Precision)precision, 0.0, 50.0, true, false});
        Vec3 linear[2], angular;
        double mass = 0.0;
        for (int i = 0; i < world.count; i++)
            mass += world.mass[i];
        voxel_world_momentum(&world, &linear[0], &angular);
        voxel_world_run(&world, 0.5);
        voxel_world_read(&world);
        voxel_world_momentum(&world, &linear[1], &angular);
        expect_near((linear[1].z - linear[0].z) / mass, -9.81 * 0.5, 1e-5);
        expect_near((linear[1].x - linear[0].x) / mass, 0.0, 1e-5);
    }
}

// ---------------------------------------------------------------------------------------------
// The bound

// Largest kinetic energy over the start's elastic one, in steps of so much of the bound.
static double growth(double share, double nu, double times, double drag, IntegratorKind integrator,
                     int substeps)
{
    uint64_t random = 72;
    VoxelWorldOptions options = voxel_world_cube(8);
    options.material =
        (SolidMaterial){.youngs_modulus = 1e7, .poisson_ratio = nu, .density = 1000.0};
    const double critical = voxel_critical_step(&options.material, options.lattice.size);
    const double lambda = 4.0 / (critical * critical), c = times * critical * lambda + drag;
    const double bound = (sqrt(c * c + 4.0 * lambda) - c) / lambda;
    options.body.damping = 0.0;
    options.body.damping_time = times * critical;
    options.body.drag = drag;
    options.body.body.integrator = integrator;
    options.body.body.levels = 0;
    options.body.body.unsafe_time_step = true;
    options.body.body.time_step = share * bound;
    options.rate_hz = 1.0 / (substeps * options.body.body.time_step);
    const double size = options.lattice.size;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    expect_near(world.body->time_step_limit, 0.9 * bound, 1e-9 * bound);
    for (int i = 0; i < world.count; i++)
        world.x[i] = vec3_madd(world.x[i], 0.02 * size, random_vec3(&random));
    voxel_world_write(&world, world.x, world.v);
    BodyMeasure now = measure_of(world.body);
    const double start = now.elastic;
    double worst = 0.0;
    for (int n = 0; n * substeps < EFFORT(4000) && worst < 100.0; n++) {
        sim_step(world.sim);
        if (n % 10 != 9)
            continue;
        now = measure_of(world.body);
        worst = fmax(worst, sim_resets(world.sim) == 0 ? now.kinetic / start : 1e300);
    }
    print_message("%.2f of the bound %.3g s, nu %.2f, beta %g dt0, drag %g /s: up to %.3g\n", share,
                  bound, nu, times, drag, worst);
    return worst;
}

TEST(the_bound_is_safe_and_sharp)
{
    static const double TIMES[] = {0.2, 2.0, 20.0};
    for (int k = 0; k < 3; k++) {
        const IntegratorKind kind = k == 1 ? INTEGRATOR_LEAPFROG : INTEGRATOR_SYMPLECTIC_EULER;
        expect_at_most(growth(0.99, 0.0, TIMES[k], 0.0, kind, 1), 5.0);
        expect_at_least(growth(1.10, 0.0, TIMES[k], 0.0, kind, 1), 100.0);
        expect_at_most(growth(0.99, 0.45, TIMES[k], 10.0, kind, 1), 5.0);
    }
    expect_at_most(growth(0.99, 0.0, 0.0, 4.0, INTEGRATOR_SYMPLECTIC_EULER, 1), 5.0);
    expect_at_most(growth(0.99, 0.0, 0.0, 1e4, INTEGRATOR_SYMPLECTIC_EULER, 1), 5.0);
    expect_at_least(growth(1.10, 0.0, 0.0, 4.0, INTEGRATOR_SYMPLECTIC_EULER, 1), 100.0);
}

// A free body is slowed down once a tick if beta >= drag h^2, which is just so here: a rhythm of
// its own, that could drive a motion of its frequency.
TEST(drag_once_a_tick_drives_nothing)
{
    const double critical = 0.0125 * sqrt(1000.0 / 1e7), drag = 100.0;
    for (int substeps = 2; substeps <= 7; substeps += test_is_long() ? 1 : 3) {
        expect_at_most(
            growth(0.99, 0.0, 1.01 * drag * critical, drag, INTEGRATOR_SYMPLECTIC_EULER, substeps),
            5.0);
        expect_at_most(
            growth(0.99, 0.0, 0.5 * drag * critical, drag, INTEGRATOR_SYMPLECTIC_EULER, substeps),
            5.0);
    }
}
