// SPDX-License-Identifier: MIT
// Springs with Maxwell branches: forces against the energy, the relaxation of a stretched sheet,
// the decay of swings at a loss factor, what a free body keeps, both ends of a spring, states.
#include "effort.h"
#include "test.h"
#include "extreme.h"
#include "fixture.h"
#include "geometry/generator.h"
#include "random.h"

#include "surface/law.h"
#include "surface/model.h"

#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;
static const MaxwellBranch TWO[] = {{0.02, 0.25, false}, {0.2, 0.35, false}};

static void set_branches(SurfaceMaterial *material, int count, const MaxwellBranch *branch)
{
    material->branch_count = count;
    memcpy(material->branch, branch, (size_t)count * sizeof *branch);
}

// The entry of a spring of `slot` that is the e-th; -1: there is none.
static long entry_of(const SurfaceModel *model, int slot, int e)
{
    const SpringTable *springs = &model->springs;
    const int chunk = slot / LANES;
    const long at = (long)(springs->start[chunk] + e) * LANES + slot % LANES;
    return springs->start[chunk] + e < springs->end[chunk] && springs->neighbour[at] != slot ? at
                                                                                             : -1;
}

// The entry at the other end.
static long other_entry(const SurfaceModel *model, int slot, long at)
{
    const int other = model->springs.neighbour[at];
    long back = 0;
    for (int e = 0; (back = entry_of(model, other, e)) >= 0; e++)
        if (model->springs.neighbour[back] == slot)
            return back;
    fail_msg("a spring has one end");
    return -1;
}

static void each_spring(const SurfaceModel *model,
                        void (*visit)(const SurfaceModel *, long at, long back, void *), void *with)
{
    for (int s = 0; s < model->basis.count; s++) {
        long at;
        for (int e = 0; model->node[s] >= 0 && (at = entry_of(model, s, e)) >= 0; e++)
            if (s < model->springs.neighbour[at])
                visit(model, at, other_entry(model, s, at), with);
    }
}

static void shake(const SurfaceModel *model, long at, long back, void *with)
{
    double d[RELAXATION_NUMBERS];
    for (int k = 0; k < RELAXATION_NUMBERS; k++)
        d[k] = random_between(with, -3e-3, 3e-3);
    relaxation_put(model->relaxation, (int)at, d);
    relaxation_put(model->relaxation, (int)back, d);
}

static void expect_alike(const SurfaceModel *model, long at, long back, void *with)
{
    (void)with;
    double d[2][RELAXATION_NUMBERS] = {{0.0}};
    relaxation_take(model->relaxation, (int)at, d[0]);
    relaxation_take(model->relaxation, (int)back, d[1]);
    assert_memory_equal(d[0], d[1], sizeof d[0]);
}

// ---------------------------------------------------------------------------------------------
// Forces

// In any state and with any dashpots, from one kick that is too short to move anything: forces are
// the slope of the energy, and have neither resultant nor moment.
TEST(forces_are_the_gradient_of_the_energy)
{
    const double h = 1e-9, step = 1e-7; // [s], [m]
    FixtureOptions options = {.material = fixture_material(0.0),
                              .prestress = 0.05,
                              .integrator = INTEGRATOR_SYMPLECTIC_EULER,
                              .rate_hz = 1.0 / h};
    set_branches(&options.material, 2, TWO);
    uint64_t random = 3;
    for (int round = 0; round < EFFORT(6); round++) {
        TriMesh mesh;
        fixture_organ(&mesh);
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create(&fixture, &mesh, &options);
        const int count = fixture.mesh.node_count;
        Vec3 x[256], d[256], moved[256], zero[256] = {{0.0, 0.0, 0.0}};
        fixture_read(&fixture);
        for (int i = 0; i < count; i++) {
            x[i] = vec3_madd(vec3(1.2 * fixture.x[i].x, 0.9 * fixture.x[i].y, fixture.x[i].z), 3e-3,
                             random_vec3(&random));
            d[i] = random_vec3(&random);
        }
        each_spring(fixture_model(&fixture), shake, &random);
        double energy[2];
        for (int side = 0; side < 2; side++) {
            for (int i = 0; i < count; i++)
                moved[i] = vec3_madd(x[i], side == 0 ? -step : step, d[i]);
            fixture_write(&fixture, moved, zero);
            energy[side] = fixture_measure(&fixture).elastic;
        }
        fixture_write(&fixture, x, zero);
        fixture_run(&fixture, 1);
        double slope = 0.0, size = 0.0;
        Vec3 sum = {0.0, 0.0, 0.0}, moment = {0.0, 0.0, 0.0};
        for (int i = 0; i < count; i++) {
            const Vec3 f = vec3_scale(fixture_model(&fixture)->mass[i] / h, fixture.v[i]);
            slope -= vec3_dot(f, d[i]);
            size += vec3_length(f);
            sum = vec3_add(sum, f);
            moment = vec3_add(moment, vec3_cross(x[i], f));
        }
        // Of differences 1e-7 m apart the error is 1e-10; the kick takes branches h / 2 later.
        expect_near((energy[1] - energy[0]) / (2.0 * step), slope, 1e-6 * size);
        expect_at_most(vec3_length(sum), 1e-12 * size);
        expect_at_most(vec3_length(moment), 1e-12 * size);
    }
}

// ---------------------------------------------------------------------------------------------
// Relaxation

// A sheet so heavy that nothing moves, stretched at once: the pull on its ends falls as that of the
// linear law times 1 + sum e exp(-t / time). Relaxed under its prestress at the start.
static void pull_of(Precision precision, IntegratorKind integrator, double prestress, int branches,
                    double *pull, int ticks)
{
    TriMesh mesh;
    Status status = {0};
    assert_true(generate_sheet(&mesh, 9, 5, 0.2, 0.1, &status));
    FixtureOptions options = {.material = fixture_material(0.0),
                              .precision = precision,
                              .prestress = prestress,
                              .integrator = integrator};
    options.material.areal_density = 1e4; // k / m is 1e-1 1/s2: 1.5e-4 m/s a tick
    set_branches(&options.material, branches, TWO);
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    fixture_read(&fixture);
    const int count = fixture.mesh.node_count;
    Vec3 x[64], zero[64] = {{0.0, 0.0, 0.0}};
    for (int i = 0; i < count; i++)
        x[i] = vec3(1.1 * fixture.x[i].x, fixture.x[i].y, fixture.x[i].z);
    for (int tick = 0; tick < ticks; tick++) {
        fixture_write(&fixture, x, zero);
        fixture_run(&fixture, 1);
        pull[tick] = 0.0;
        for (int i = 0; i < count; i++)
            if (x[i].x > 0.109)
                pull[tick] -= fixture_model(&fixture)->mass[i] * fixture.v[i].x / 1e-3;
    }
    if (branches > 0)
        each_spring(fixture_model(&fixture), expect_alike, NULL);
}

TEST(stress_relaxes_as_the_closed_form)
{
    enum { TICKS = 1000 };
    static const IntegratorKind KICKS[] = {INTEGRATOR_LEAPFROG, INTEGRATOR_SYMPLECTIC_EULER};
    static double pull[TICKS], linear[TICKS], resting[TICKS];
    for (int trial = 0; trial < 8; trial++) {
        const Precision precision = (Precision)(trial & 1);
        const double prestress = trial & 2 ? 0.1 : 0.0;
        const IntegratorKind integrator = KICKS[trial >> 2];
        double off = 0.0;
        pull_of(precision, integrator, prestress, 0, linear, 1);
        pull_of(precision, integrator, 0.0, 0, resting, 1);
        pull_of(precision, integrator, prestress, 2, pull, TICKS);
        for (int tick = 0; tick < TICKS; tick++) {
            // In the middle of the tick; branches are without a part of the prestress.
            const double t = (tick + 0.5) * 1e-3,
                         e = (0.25 * exp(-t / 0.02) + 0.35 * exp(-t / 0.2)) / 0.4;
            off = fmax(off, fabs(pull[tick] / (linear[0] + e * resting[0]) - 1.0));
        }
        print_message("%s%s: pull off by %.2g of the closed form\n",
                      precision == PRECISION_SINGLE ? "single" : "double",
                      prestress > 0.0 ? ", prestress" : "", off);
        // Nothing moves by more than 1e-6 of a stretch in the first half of a tick; single
        // precision has 1e-7 of each number.
        expect_at_most(off, precision == PRECISION_SINGLE ? 2e-5 : 1e-5);
    }
}

// ---------------------------------------------------------------------------------------------
// Swings

// A sheet of 0.2 m by 0.1 m that is held at one end swings across in its plane, or a free ball
// swells and shrinks.
typedef struct Swing {
    double modulus, loss;
    bool ball;
} Swing;

static Vec3 shape_of(const Swing *swing, Vec3 rest)
{
    return swing->ball ? vec3_unit(rest) : vec3(0.0, sin(0.5 * PI * (rest.x + 0.1) / 0.2), 0.0);
}

static double loss_of(const Swing *swing, double *frequency, double *growth)
{
    static const FixedRegion end = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {-0.0999, 1.0, 1.0}};
    TriMesh mesh;
    Status status = {0};
    assert_true(swing->ball ? generate_ico_sphere(&mesh, 2, 0.05, &status)
                            : generate_sheet(&mesh, 17, 9, 0.2, 0.1, &status));
    FixtureOptions options = {.material = fixture_material(0.0),
                              .integrator = INTEGRATOR_LEAPFROG,
                              .fixed = &end,
                              .fixed_count = swing->ball ? 0 : 1};
    options.material.youngs_modulus_2d = swing->modulus;
    options.material.branch_count = MAXWELL_BRANCHES;
    assert_true(maxwell_of_loss(swing->loss, options.material.branch));
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    fixture_read(&fixture);
    const int count = fixture.mesh.node_count;
    Vec3 rest[256], shape[256], v[256];
    for (int i = 0; i < count; i++) {
        rest[i] = fixture.x[i];
        shape[i] = shape_of(swing, rest[i]);
        v[i] = vec3_scale(1e-3 * sqrt(swing->modulus), shape[i]); // a strain of 1e-2 at most
    }
    fixture_write(&fixture, rest, v);
    Extremes extremes = {0};
    double before = fixture_energy(&fixture);
    bool more = true;
    *growth = 0.0;
    for (int tick = 1; tick < 20000 && more; tick++) {
        double part = 0.0;
        fixture_run(&fixture, 1);
        for (int i = 0; i < count; i++)
            part += fixture_model(&fixture)->mass[i] *
                    vec3_dot(shape[i], vec3_sub(fixture.x[i], rest[i]));
        more = add_sample(&extremes, part);
        const double now = fixture_energy(&fixture);
        *growth = fmax(*growth, now / before);
        before = now;
    }
    assert_false(more);
    double decrement;
    *frequency = 0.5 / (half_swing(&extremes, &decrement) * sim_tick(fixture.sim));
    // Half a swing: a decrement of pi times the damping ratio, half of the loss factor.
    return 2.0 * decrement / PI;
}

// At 3, 10 and 30 Hz, with moduli that bring them there.
TEST(swings_decay_at_the_loss_factor)
{
    static const double MODULI[2][3] = {{300.0, 3000.0, 27000.0}, {1.1, 11.0, 90.0}};
    for (int loss = 0; loss < 2; loss++)
        for (int k = 0; k < EFFORT(6); k++) {
            const Swing swing = {MODULI[k % 2][k / 2], loss == 0 ? 0.1 : 0.2, k % 2 == 1};
            double f, growth;
            const double got = loss_of(&swing, &f, &growth);
            print_message("%s at %.3g Hz: loss factor %.4f, asked %.2f; energy at most %.6f of "
                          "that a tick before\n",
                          swing.ball ? "ball" : "sheet", f, got, swing.loss, growth);
            expect_near(got, swing.loss, 0.2 * swing.loss);
            expect_at_most(growth, 1.0 + 1e-3); // leapfrog's elastic energy oscillates in a step
        }
}

// ---------------------------------------------------------------------------------------------
// Energy, momentum, bits

static const double SPIN[3] = {2.0, -4.0, 8.0};

static void throw_body(Fixture *fixture, double speed)
{
    uint64_t random = 21;
    Vec3 v[256];
    fixture_read(fixture);
    for (int i = 0; i < fixture->mesh.node_count; i++)
        v[i] = vec3_madd(vec3_cross(vec3(SPIN[0], SPIN[1], SPIN[2]), fixture->x[i]), speed,
                         random_vec3(&random));
    fixture_write(fixture, fixture->x, v);
    fixture_read(fixture);
}

static void sum_up(const Fixture *fixture, Vec3 *linear, Vec3 *angular)
{
    *linear = *angular = vec3(0.0, 0.0, 0.0);
    for (int i = 0; i < fixture->mesh.node_count; i++) {
        const Vec3 p = vec3_scale(fixture_model(fixture)->mass[i], fixture->v[i]);
        *linear = vec3_add(*linear, p);
        *angular = vec3_add(*angular, vec3_cross(fixture->x[i], p));
    }
}

TEST(a_free_body_keeps_its_momentum)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++)
        for (int shape = 0; shape < 2; shape++) {
            FixtureOptions options = {.material = fixture_material(2e-4),
                                      .precision = (Precision)precision,
                                      .integrator = INTEGRATOR_LEAPFROG};
            if (shape == 1)
                options.shape = fixture_shape(SHAPE_BODY);
            set_branches(&options.material, 2, TWO);
            SCOPED(fixture_destroy) Fixture fixture;
            fixture_create_sphere(&fixture, &options);
            throw_body(&fixture, 0.2);
            Vec3 linear[2], angular[2];
            sum_up(&fixture, &linear[0], &angular[0]);
            const double before = fixture_energy(&fixture);
            fixture_run(&fixture, EFFORT(500));
            sum_up(&fixture, &linear[1], &angular[1]);
            const double scale = vec3_length(angular[0]),
                         p = vec3_length(vec3_sub(linear[1], linear[0])) * 0.05 / scale,
                         l = vec3_length(vec3_sub(angular[1], angular[0])) / scale;
            const bool single = precision == PRECISION_SINGLE;
            print_message("%s: momentum off by %.2g, angular by %.2g, %.3f of the energy left\n",
                          single ? "single" : "double", p, l, fixture_energy(&fixture) / before);
            // Rounding; in single precision of each of 500 kicks.
            expect_at_most(p, single ? 1e-5 : 1e-11);
            expect_at_most(l, single ? 1e-3 : 1e-10);
            assert_true(fixture_energy(&fixture) < 0.9 * before);
            each_spring(fixture_model(&fixture), expect_alike, NULL);
        }
}

// From crumpled, flat, stretched and inverted states, with damping and steps that are short enough
// for leapfrog to keep its energy: it grows in no tick.
TEST(energy_never_grows)
{
    static const Vec3 STARTS[] = {
        {0.05, 0.05, 0.05}, {0.3, 0.3, 0.3}, {1.0, 1.0, 0.0}, {3.0, 1.0, 1.0}, {1.0, 1.0, -1.0}};
    uint64_t random = 4;
    double most = 0.0;
    for (int start = 0; start < EFFORT(5); start++)
        for (int precision = 0; precision < PRECISION_COUNT; precision++) {
            FixtureOptions options = {.material = fixture_material(5e-4),
                                      .precision = (Precision)precision,
                                      .shape = fixture_shape(SHAPE_WORLD),
                                      .time_step = 5e-5,
                                      .integrator = INTEGRATOR_LEAPFROG};
            set_branches(&options.material, 2, TWO);
            SCOPED(fixture_destroy) Fixture fixture;
            fixture_create_sphere(&fixture, &options);
            fixture_read(&fixture);
            Vec3 x[128], zero[128] = {{0.0, 0.0, 0.0}};
            for (int i = 0; i < fixture.mesh.node_count; i++) {
                const Vec3 at = fixture.x[i], by = STARTS[start];
                x[i] = vec3_madd(vec3(by.x * at.x, by.y * at.y, by.z * at.z), 1e-3,
                                 random_vec3(&random));
            }
            fixture_write(&fixture, x, zero);
            double before = fixture_energy(&fixture);
            const double first = before;
            for (int tick = 0; tick < EFFORT(400); tick++) {
                fixture_run(&fixture, 1);
                const double now = fixture_energy(&fixture);
                most = fmax(most, (now - before) / first);
                before = now;
            }
            assert_true(before < 0.5 * first);
        }
    print_message("energy grows by at most %.2g of the first in a tick\n", most);
    expect_at_most(most, 1e-9); // rounding of an energy, in single precision of its positions
}

// Threads and instruction sets compute the same bits, and a state continues with the same bits.
TEST(states_repeat)
{
    const char *const *isa = isa_available();
    for (int precision = 0; precision < PRECISION_COUNT; precision++) {
        uint64_t hash = 0;
        for (int k = 0; isa[k] != NULL || k == 0; k++)
            for (int threads = 1; threads <= 2; threads++) {
                FixtureOptions options = {.material = fixture_material(2e-4),
                                          .precision = (Precision)precision,
                                          .integrator = INTEGRATOR_LEAPFROG,
                                          .prestress = 0.1,
                                          .isa = isa[k]};
                set_branches(&options.material, 2, TWO);
                options.team = threads > 1 ? team_create(threads) : NULL;
                TriMesh mesh;
                Status status = {0};
                assert_true(generate_ico_sphere(&mesh, 4, 0.05, &status)); // 2562: shared
                SCOPED(fixture_destroy) Fixture fixture;
                fixture_create(&fixture, &mesh, &options);
                fixture_run(&fixture, 10);
                FREED void *middle = malloc(state_bytes(&fixture.state));
                state_copy_out(&fixture.state, middle);
                fixture_run(&fixture, 10);
                const uint64_t end = state_hash(&fixture.state);
                state_copy_in(&fixture.state, middle);
                fixture.body->ops->restore(fixture.body->model, RESTORE_MOTION);
                fixture_run(&fixture, 10);
                assert_true(state_hash(&fixture.state) == end);
                assert_true(hash == 0 || hash == end);
                hash = end;
                if (options.team != NULL)
                    team_destroy(options.team);
            }
    }
}

// A tick that is abandoned leaves the dashpots as they were, a return to rest relaxes them, and
// numbers that are none are found.
TEST(restores_dashpots)
{
    FixtureOptions options = {.material = fixture_material(0.0), .integrator = INTEGRATOR_LEAPFROG};
    set_branches(&options.material, 2, TWO);
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    SurfaceModel *model = fixture_model(&fixture);
    const BodyOps *ops = fixture.body->ops;
    throw_body(&fixture, 0.2);
    fixture_run(&fixture, 20);
    const uint64_t before = state_hash(&fixture.state);
    const Evaluation kick = integrator_evaluation(integrator_get(INTEGRATOR_LEAPFROG), 0, true);
    ops->drift(model, 5e-4);
    ops->evaluate(model, &kick, 1e-3);
    ops->abandon(model);
    assert_true(state_hash(&fixture.state) == before);
    ops->restore(model, RESTORE_SHAPE);
    expect_near(fixture_measure(&fixture).elastic, 0.0, 1e-20);
    assert_true(ops->check(model));
    ((double *)model->relaxation->strain[model->relaxation->current])[7] = (double)NAN;
    assert_false(ops->check(model));
}

// What cannot advance dashpots is refused by name; "auto" takes leapfrog.
TEST(only_kicks_relax)
{
    static const IntegratorKind KINDS[] = {INTEGRATOR_RK4, INTEGRATOR_IMPLICIT};
    for (int k = 0; k < 3; k++) {
        FixtureOptions options = {.material = fixture_material(0.0), .automatic = k == 2};
        options.integrator = k < 2 ? KINDS[k] : INTEGRATOR_LEAPFROG;
        options.material.youngs_modulus_2d = 1e7; // far beyond what "auto" takes leapfrog for
        set_branches(&options.material, 2, TWO);
        TriMesh mesh;
        Status status = {0};
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_sphere(&mesh);
        assert_int_equal(fixture_try(&fixture, &mesh, &options, &status), k == 2);
        if (k < 2)
            assert_non_null(strstr(status.text, integrator_name(KINDS[k])));
        else
            assert_int_equal(fixture.body->integrator, INTEGRATOR_LEAPFROG);
    }
}
