// SPDX-License-Identifier: MIT
// Springs with Maxwell branches, and springs that stiffen by Fung's law: forces against the energy,
// closed forms, the decay of swings, what a free body keeps, both ends of a spring, states, bits.
#include "effort.h"
#include "test.h"
#include "both_ends.h"
#include "sim_steps.h"
#include "fixture.h"
#include "geometry/generator.h"
#include "law_trial.h"
#include "random.h"

#include "surface/law.h"
#include "surface/model.h"

static const double PI = 3.14159265358979323846;
static const MaxwellBranch TWO[] = {{0.02, 0.25, false}, {0.2, 0.35, false}};

static void set_branches(SurfaceMaterial *material, int count, const MaxwellBranch *branch)
{
    material->branch_count = count;
    memcpy(material->branch, branch, (size_t)count * sizeof *branch);
}

static void write_nodes(void *fixture, const Vec3 *x, const Vec3 *v)
{
    fixture_write(fixture, x, v);
}

static void read_nodes(void *fixture)
{
    fixture_read(fixture);
}

// By a tick from rest, which must be too short to move anything.
static void read_forces(void *of, Vec3 *force)
{
    Fixture *fixture = of;
    fixture_run(fixture, 1);
    for (int i = 0; i < fixture->mesh.node_count; i++)
        force[i] =
            vec3_scale(fixture_model(fixture)->mass[i] / sim_tick(fixture->sim), fixture->v[i]);
}

static LawBody law_body(const char *name, Fixture *fixture, double length)
{
    fixture_read(fixture);
    return (LawBody){.name = name,
                     .sim = fixture->sim,
                     .body = fixture->body,
                     .length = length,
                     .count = fixture->mesh.node_count,
                     .mass = fixture_model(fixture)->mass,
                     .x = fixture->x,
                     .v = fixture->v,
                     .of = fixture,
                     .read = read_nodes,
                     .write = write_nodes,
                     .forces = read_forces};
}

static void scale_nodes(const LawBody *body, Vec3 by, double noise, uint64_t *random, Vec3 *x)
{
    for (int i = 0; i < body->count; i++) {
        const Vec3 at = body->x[i];
        x[i] = vec3_madd(vec3(by.x * at.x, by.y * at.y, by.z * at.z), noise, random_vec3(random));
    }
}

static void throw_body(Fixture *fixture, double speed)
{
    uint64_t random = 21;
    Vec3 v[256];
    fixture_read(fixture);
    for (int i = 0; i < fixture->mesh.node_count; i++)
        v[i] =
            vec3_madd(vec3_cross(vec3(2.0, -4.0, 8.0), fixture->x[i]), speed, random_vec3(&random));
    fixture_write(fixture, fixture->x, v);
    fixture_read(fixture);
}

static void shake(const SurfaceModel *model, long at, long back, void *with)
{
    double d[RELAXATION_NUMBERS];
    for (int k = 0; k < RELAXATION_NUMBERS; k++)
        d[k] = random_between(with, -3e-3, 3e-3);
    relaxation_put(model->relaxation, (int)at, d);
    relaxation_put(model->relaxation, (int)back, d);
}

// ---------------------------------------------------------------------------------------------
// Forces

// In any state and with any dashpots, from one kick that is too short to move anything; it takes
// branches h / 2 later.
TEST(forces_are_the_gradient_of_the_energy)
{
    uint64_t random = 3;
    for (int k = 0; k < EFFORT(12); k++) {
        const bool relaxes = k % 2 == 0;
        FixtureOptions options = {.material = fixture_material(0.0),
                                  .prestress = 0.05,
                                  .integrator = INTEGRATOR_SYMPLECTIC_EULER,
                                  .rate_hz = 1e9};
        if (relaxes)
            set_branches(&options.material, 2, TWO);
        else
            options.material.stiffening = (Stiffening){0.1 + 0.025 * k, 4.0 + 1.5 * k};
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_on(&fixture, fixture_organ, &options);
        const LawBody body = law_body(relaxes ? "relaxing" : "stiffening", &fixture, 0.2);
        Vec3 x[256];
        scale_nodes(&body, vec3(1.3, 0.9, 1.0), 3e-3, &random, x);
        if (relaxes)
            each_spring(fixture_model(&fixture), shake, &random);
        law_expect_gradient(&body, x, &random);
    }
}

// ---------------------------------------------------------------------------------------------
// Closed forms

// A sheet so heavy that nothing moves, stretched at once: the pull on its ends falls as that of the
// linear law times 1 + sum e exp(-t / time). Relaxed under its prestress at the start.
static void pull_of(Precision precision, IntegratorKind integrator, double prestress, int branches,
                    double *pull, int ticks)
{
    TriMesh mesh;
    assert_true(generate_sheet(&mesh, 9, 5, 0.2, 0.1, &(Status){0}));
    FixtureOptions options = {.material = fixture_material(0.0),
                              .precision = precision,
                              .prestress = prestress,
                              .integrator = integrator};
    options.material.areal_density = 1e4; // k / m is 1e-1 1/s2: 1.5e-4 m/s a tick
    set_branches(&options.material, branches, TWO);
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    const LawBody body = law_body("sheet", &fixture, 0.2);
    uint64_t unused = 1;
    Vec3 x[64], force[64], zero[64] = {{0.0, 0.0, 0.0}};
    scale_nodes(&body, vec3(1.1, 1.0, 1.0), 0.0, &unused, x);
    for (int tick = 0; tick < ticks; tick++) {
        fixture_write(&fixture, x, zero);
        read_forces(&fixture, force);
        pull[tick] = 0.0;
        for (int i = 0; i < body.count; i++)
            if (x[i].x > 0.109)
                pull[tick] -= force[i].x;
    }
    if (branches > 0)
        expect_both_ends_alike(fixture_model(&fixture));
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

enum { COLUMNS = 13, ROWS = 7, STRIP = COLUMNS * ROWS };
static const double EDGE = 0.01; // [m]

// Equilateral faces; its rows run along x.
static void make_strip(TriMesh *mesh)
{
    int faces = 0;
    mesh_create(mesh, STRIP, 2 * (COLUMNS - 1) * (ROWS - 1));
    for (int r = 0; r < ROWS; r++)
        for (int c = 0; c < COLUMNS; c++)
            mesh->position[r * COLUMNS + c] =
                vec3((c + 0.5 * (r % 2)) * EDGE, r * EDGE * sqrt(0.75), 0.0);
    for (int r = 0; r + 1 < ROWS; r++)
        for (int c = 0; c + 1 < COLUMNS; c++) {
            const int a = r * COLUMNS + c, above = a + COLUMNS, odd = r % 2;
            int *face = mesh->triangle[faces++];
            face[0] = a, face[1] = a + 1, face[2] = odd ? above + 1 : above;
            face = mesh->triangle[faces++];
            face[0] = odd ? a : a + 1, face[1] = above + 1, face[2] = above;
        }
}

// The stress along the strip [N/m], from one kick that is too short to move anything: pulled along
// its rows with free sides, the slanted springs of an equilateral lattice stay as long as they are.
static double stress_of(Stiffening law, Precision precision, double strain)
{
    TriMesh mesh;
    FixtureOptions options = {.material = fixture_material(0.0),
                              .precision = precision,
                              .integrator = INTEGRATOR_SYMPLECTIC_EULER,
                              .rate_hz = 1e9};
    options.material.stiffening = law;
    make_strip(&mesh);
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    Vec3 x[STRIP], force[STRIP], zero[STRIP] = {{0.0, 0.0, 0.0}};
    const double along = 1.0 + strain, half = 0.5 * along, tall = sqrt(1.0 - half * half);
    fixture_read(&fixture);
    for (int i = 0; i < STRIP; i++)
        x[i] = vec3(along * fixture.x[i].x, (i / COLUMNS) * EDGE * tall, 0.0);
    fixture_write(&fixture, x, zero);
    read_forces(&fixture, force);
    double pull = 0.0;
    for (int i = 0; i < STRIP; i++)
        if (i % COLUMNS > COLUMNS / 2)
            pull -= force[i].x;
    return pull / ((ROWS - 1) * EDGE * sqrt(0.75));
}

TEST(a_strip_follows_the_closed_form)
{
    static const Stiffening LAWS[] = {{0.15, 10.0}, {0.05, 100.0}, {0.3, 1.5}, {10.0, 2.0}};
    for (int precision = 0; precision < PRECISION_COUNT; precision++)
        for (int k = 0; k < 4; k++) {
            double most = 0.0;
            for (int i = -6; i <= 30; i++) {
                const double strain = 0.01 * i; // springs that are shortened do not stiffen
                const double expected = 80.0 * (i > 0 ? law_stress(LAWS[k], strain) : strain);
                if (i != 0)
                    most = fmax(
                        most,
                        fabs(stress_of(LAWS[k], (Precision)precision, strain) / expected - 1.0));
            }
            print_message("s %.2f, cap %3.0f, %s: stress off by at most %.2g of the closed form\n",
                          LAWS[k].strain, LAWS[k].cap,
                          precision == PRECISION_SINGLE ? "single" : "double", most);
            // A kernel in double is within rounding. In single precision strains of 0.01 are known
            // to 1e-5, as displacements of 0.1 m are to 1e-8 m; (e / s)^2 doubles that.
            expect_at_most(most, precision == PRECISION_SINGLE ? 3e-5 : 1e-12);
        }
}

// A sheet of 0.2 m by 0.1 m that is held at one end swings across in its plane, or a free ball
// swells and shrinks: at 3, 10 and 30 Hz, with moduli that bring them there.
TEST(swings_decay_at_the_loss_factor)
{
    static const double MODULI[2][3] = {{300.0, 3000.0, 27000.0}, {1.1, 11.0, 90.0}};
    static const FixedRegion end = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {-0.0999, 1.0, 1.0}};
    for (int loss = 1; loss <= 2; loss++)
        for (int k = 0; k < EFFORT(6); k++) {
            const bool ball = k % 2 == 1;
            const double modulus = MODULI[k % 2][k / 2];
            TriMesh mesh;
            assert_true(ball ? generate_ico_sphere(&mesh, 2, 0.05, &(Status){0})
                             : generate_sheet(&mesh, 17, 9, 0.2, 0.1, &(Status){0}));
            FixtureOptions options = {.material = fixture_material(0.0),
                                      .integrator = INTEGRATOR_LEAPFROG,
                                      .fixed = &end,
                                      .fixed_count = ball ? 0 : 1};
            options.material.youngs_modulus_2d = modulus;
            options.material.branch_count = MAXWELL_BRANCHES;
            assert_true(maxwell_of_loss(0.1 * loss, options.material.branch));
            SCOPED(fixture_destroy) Fixture fixture;
            fixture_create(&fixture, &mesh, &options);
            const LawBody body = law_body(ball ? "ball" : "sheet", &fixture, 0.2);
            Vec3 shape[256];
            for (int i = 0; i < body.count; i++)
                shape[i] = ball ? vec3_unit(body.x[i])
                                : vec3(0.0, sin(0.5 * PI * (body.x[i].x + 0.1) / 0.2), 0.0);
            law_expect_loss(&body, shape, 1e-3 * sqrt(modulus), 0.1 * loss); // strains of 1e-2
        }
}

// ---------------------------------------------------------------------------------------------
// Energy, momentum, bits

TEST(a_free_body_keeps_its_momentum)
{
    static const struct {
        const char *name;
        bool relaxes, shape;
        double left;
    } BODIES[] = {{"relaxing", true, false, 0.9},
                  {"relaxing on shape springs", true, true, 0.9},
                  {"stiffening", false, false, HUGE_VAL}}; // nothing damps it
    for (int k = 0; k < 3 * PRECISION_COUNT; k++) {
        const Precision precision = (Precision)(k / 3);
        const bool relaxes = BODIES[k % 3].relaxes;
        FixtureOptions options = {.material = fixture_material(relaxes ? 2e-4 : 0.0),
                                  .precision = precision,
                                  .integrator = INTEGRATOR_LEAPFROG};
        if (BODIES[k % 3].shape)
            options.shape = fixture_shape(SHAPE_BODY);
        if (relaxes)
            set_branches(&options.material, 2, TWO);
        else
            options.material.stiffening = (Stiffening){0.05, 10.0};
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        throw_body(&fixture, 0.2);
        const LawBody body = law_body(BODIES[k % 3].name, &fixture, 0.05);
        law_expect_momentum(&body, EFFORT(500), precision, 1e-3, BODIES[k % 3].left);
        if (relaxes)
            expect_both_ends_alike(fixture_model(&fixture));
    }
}

// Relaxing: from crumpled, flat, stretched and inverted states, with damping and steps that are
// short enough for leapfrog to keep its energy. Stiffening: stretched far beyond the knee, at the
// step of the bound without damping, or with damping and shorter steps.
typedef struct Release {
    const char *name;
    Vec3 by; // rest positions are scaled
    double cap, damping, time_step;
    int ticks;
    double most, growth, left; // of the energy at most
} Release;

#define RELAXING_FROM(name, x, y, z) name, {x, y, z}, 0.0, 5e-4, 5e-5, EFFORT(400), 2.0, 1e-9, 0.5
// Leapfrog near its bound lets the energy of the fastest modes swing by 5 (body/integrator.h);
// little of it is in those.
#define UNDAMPED(cap) "stiffening", {1.6, 1.0, 0.8}, cap, 0.0, 0.0, 300, 1.5, 2.0, 2.0
#define DAMPED(cap)   "stiffening, damped", {1.6, 1.0, 0.8}, cap, 5e-4, 2e-5, 300, 1.0, 1e-6, 0.2

TEST(energy_never_grows)
{
    // Laws in turn: the first few rows, which sanitizers try, have both.
    static const Release RELEASES[] = {{RELAXING_FROM("crumpled", 0.05, 0.05, 0.05)},
                                       {UNDAMPED(1.0)},
                                       {RELAXING_FROM("flat", 1.0, 1.0, 0.0)},
                                       {DAMPED(10.0)},
                                       {RELAXING_FROM("inverted", 1.0, 1.0, -1.0)},
                                       {UNDAMPED(100.0)},
                                       {RELAXING_FROM("stretched", 3.0, 1.0, 1.0)},
                                       {DAMPED(1.0)},
                                       {RELAXING_FROM("shrunk", 0.3, 0.3, 0.3)},
                                       {UNDAMPED(10.0)},
                                       {DAMPED(100.0)}};
    uint64_t random = 4;
    for (int k = 0; k < 3 * EFFORT(11); k++) {
        const Release *release = &RELEASES[k / 3];
        const bool relaxes = release->cap == 0.0, rk4 = k % 3 == 2;
        if (relaxes && rk4)
            continue; // refused
        FixtureOptions options = {.material = fixture_material(release->damping),
                                  .precision = k % 3 == 0 ? PRECISION_DOUBLE : PRECISION_SINGLE,
                                  .shape = fixture_shape(SHAPE_WORLD),
                                  .time_step = release->time_step,
                                  .integrator = rk4 ? INTEGRATOR_RK4 : INTEGRATOR_LEAPFROG};
        if (relaxes)
            set_branches(&options.material, 2, TWO);
        else
            options.material.stiffening = (Stiffening){0.1, release->cap};
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        const LawBody body = law_body(release->name, &fixture, 0.05);
        Vec3 x[128], zero[128] = {{0.0, 0.0, 0.0}};
        scale_nodes(&body, release->by, 1e-3, &random, x);
        const LawFall fall = law_fall(&body, x, zero, release->ticks);
        print_message("%s, cap %.0f, %s, %s: energy at most %.3f of the first, grows by %.2g in a "
                      "tick, %.2g left\n",
                      release->name, release->cap, k % 3 == 0 ? "double" : "single",
                      integrator_name(options.integrator), fall.most, fall.growth, fall.left);
        expect_at_most(fall.most, release->most);
        // Rounding of an energy, in single precision of its positions.
        expect_at_most(fall.growth, release->growth);
        expect_at_most(fall.left, release->left);
    }
}

TEST(every_instruction_set_gives_the_same_bits)
{
    const char *const *isa = isa_available();
    static const ShapeFrame FRAMES[] = {SHAPE_WORLD, SHAPE_BODY};
    for (int trial = 0; trial < 16; trial++) {
        uint64_t hash = 0;
        for (int k = 0; isa[k] != NULL; k++) {
            FixtureOptions options = {.material = fixture_material(2e-4),
                                      .precision = (Precision)(trial & 1),
                                      .prestress = 0.1,
                                      .isa = isa[k]};
            options.integrator = trial & 2 ? INTEGRATOR_LEAPFROG : INTEGRATOR_RK4;
            options.material.stiffening = (Stiffening){0.05, 10.0};
            if (trial & 2) // both laws
                set_branches(&options.material, 1, &(MaxwellBranch){0.1, 0.3, false});
            if (trial & 4)
                options.shape = fixture_shape(FRAMES[trial >> 3]);
            SCOPED(fixture_destroy) Fixture fixture;
            fixture_create_sphere(&fixture, &options);
            fixture_run(&fixture, 20);
            const uint64_t end = state_hash(&fixture.state);
            assert_true(hash == 0 || hash == end);
            hash = end;
        }
    }
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
                SCOPED(team_end) Team *team = threads > 1 ? team_create(threads) : NULL;
                options.team = team;
                TriMesh mesh;
                assert_true(generate_ico_sphere(&mesh, 4, 0.05, &(Status){0})); // 2562: shared
                SCOPED(fixture_destroy) Fixture fixture;
                fixture_create(&fixture, &mesh, &options);
                fixture_run(&fixture, 10);
                FREED void *middle = copy_state(&fixture.state);
                fixture_run(&fixture, 10);
                const uint64_t end = state_hash(&fixture.state);
                state_copy_in(&fixture.state, middle);
                fixture.body->ops->restore(fixture.body->model, RESTORE_MOTION);
                fixture_run(&fixture, 10);
                assert_true(state_hash(&fixture.state) == end);
                assert_true(hash == 0 || hash == end);
                hash = end;
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
    expect_near(measure_of(fixture.body).elastic, 0.0, 1e-20);
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

// The bound of the time step is that of springs cap times as stiff, and haptic clients are told the
// tangent; implicit steps are refused by name.
TEST(the_bound_follows_the_cap)
{
    double lambda[2];
    for (int k = 0; k < 2; k++) {
        FixtureOptions options = {.material = fixture_material(0.0),
                                  .integrator = INTEGRATOR_LEAPFROG};
        if (k == 1)
            options.material.stiffening = (Stiffening){0.1, 10.0};
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        lambda[k] = fixture.body->lambda;
        if (k == 1) {
            const double r =
                model_get(fixture_model(&fixture), fixture_model(&fixture)->springs.rest_length, 0);
            expect_near(law_spring(fixture_model(&fixture), 0, 0.05 * r, 0.0).tangent,
                        1.5 * exp(0.25), 1e-12);
            expect_near(law_spring(fixture_model(&fixture), 0, r, 0.0).tangent, 10.0, 1e-12);
            expect_near(law_spring(fixture_model(&fixture), 0, -0.5 * r, 0.0).tangent, 1.0, 1e-12);
        }
    }
    expect_near(lambda[1] / lambda[0], 10.0, 1e-12);
    FixtureOptions options = {.material = fixture_material(0.0), .integrator = INTEGRATOR_IMPLICIT};
    options.material.stiffening = (Stiffening){0.1, 10.0};
    fixture_expect_refusal(&options, "stiffening needs an explicit integrator");
}
