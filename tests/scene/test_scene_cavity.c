// SPDX-License-Identifier: MIT
// What a wall encloses, in scenes: gas and fluid, levels, cuts that let it out, SET.
#include "effort.h"
#include "test.h"
#include "random.h"
#include "world_run.h"

#include "base/sets.h"
#include "sim/sim_data.h"
#include "surface/cavity.h"

#define BALL(more)                                                                                 \
    "name = \"ball\"; gravity = [0, 0, 0];\n"                                                      \
    "bodies = ( { name = \"ball\"; integrator = \"leapfrog\";\n"                                   \
    "  mesh = { generator = \"ico_sphere\"; subdivisions = 3; radius = 0.05; };\n" more " } );\n"
#define SOFT  "material = { youngs_modulus_2d = 80.0; damping_time = 0.0; };\n"
#define EXACT "precision = \"double\";\n"
#define SUCK                                                                                       \
    "tools = ( { id = 1; kind = \"remover\"; removes_by = \"suction\"; rate_mm3_s = 1e6;\n"        \
    "  mouth = { radius = 0.006; }; } );"
// Refines where it moves, from the start.
#define LEVELS "levels = 2; adapt = { speed = 0.02; check_hz = 500.0; };\n"

static const SurfaceModel *model_of(const Run *run)
{
    return sim_body(run->world.sim, 0)->model;
}

static const Cavity *cavity_of(const Run *run)
{
    return model_of(run)->cavity;
}

static void step(Run *run, int ticks)
{
    sim_ticks(run->world.sim, ticks);
}

// Where the node is; lips of cuts are shown elsewhere, and the cavity does not follow those.
static Vec3 place(const Body *body, int node)
{
    const SurfaceModel *model = body->model;
    Vec3 x;
    rows_read(&model->basis, model->rows[model->current], model->slot[node], &x, NULL);
    return x;
}

// The volume by the divergence theorem over the faces that tools touch. `opening`, of a body cut in
// two by a level plane: the area of both borders; cones from their middles close the volume.
static double volume_of(const Run *run, double *opening)
{
    const Body *body = sim_body(run->world.sim, 0);
    const BodySurface *surface = &body->surface;
    double six = 0.0;
    Vec3 area[2] = {{0, 0, 0}, {0, 0, 0}}, sum[2] = {{0, 0, 0}, {0, 0, 0}};
    int count[2] = {0, 0}, *piece = calloc((size_t)surface->node_count, sizeof *piece);
    assert_non_null(piece);
    // The two halves are what faces connect.
    union_find_reset(piece, surface->node_count);
    for (int i = 0; i < surface->node_count; i++)
        for (int k = surface->node_face_start[i]; k < surface->node_face_end[i]; k++)
            for (int c = 0; c < 3; c++)
                union_find_join(piece, i, surface->face[surface->node_face[k]][c]);
    for (int i = 0; i < surface->node_count; i++)
        for (int k = surface->node_face_start[i]; k < surface->node_face_end[i]; k++) {
            const int f = surface->node_face[k], *n = surface->face[f];
            Vec3 x[3];
            if (n[0] != i)
                continue;
            for (int c = 0; c < 3; c++)
                x[c] = place(body, n[c]);
            six += vec3_dot(x[0], vec3_cross(x[1], x[2]));
            const int half = union_find_root(piece, i) != 0;
            for (int c = 0; c < 3; c++) {
                if (surface->face_neighbor[f][c] >= 0)
                    continue;
                area[half] = vec3_madd(area[half], 0.5, vec3_cross(x[c], x[(c + 1) % 3]));
                sum[half] = vec3_add(sum[half], x[c]);
                count[half]++;
            }
        }
    for (int half = 0; half < 2 && opening != NULL; half++)
        if (count[half] > 0)
            six -= 2.0 / count[half] * vec3_dot(sum[half], area[half]);
    if (opening != NULL)
        *opening = vec3_length(area[0]) + vec3_length(area[1]);
    free(piece);
    return six / 6.0;
}

static double run_energy(const Run *run, bool whole)
{
    BodyMeasure measure;
    const Body *body = sim_body(run->world.sim, 0);
    body->ops->measure(body->model, &measure);
    return measure.kinetic + measure.elastic + (whole ? measure.outer : 0.0);
}

// Gives all nodes a random velocity, and the body a spin.
static void stir(Run *run, double speed)
{
    SurfaceModel *model = sim_body(run->world.sim, 0)->model;
    uint64_t random = 11;
    for (int s = 0; s < model->basis.count; s++) {
        if (model->node[s] < 0)
            continue;
        Vec3 x;
        rows_read(&model->basis, model->rows[model->current], s, &x, NULL);
        const Vec3 v = vec3_add(vec3_cross((Vec3){1.0, 2.0, -1.5}, x),
                                vec3_scale(speed, random_vec3(&random)));
        rows_write(&model->basis, model->rows[model->current], s, x, v);
    }
    cavity_forget(model->cavity);
}

static void momenta(const Run *run, Vec3 *linear, Vec3 *angular)
{
    const SurfaceModel *model = model_of(run);
    *linear = *angular = (Vec3){0, 0, 0};
    for (int s = 0; s < model->basis.count; s++) {
        if (model->node[s] < 0 || !(model->mass[model->node[s]] > 0.0))
            continue;
        Vec3 x, v;
        rows_read(&model->basis, model->rows[model->current], s, &x, &v);
        *linear = vec3_madd(*linear, model->mass[model->node[s]], v);
        *angular = vec3_madd(*angular, model->mass[model->node[s]], vec3_cross(x, v));
    }
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(a_gas_keeps_pressure_times_volume)
{
    static const char *const CASES[] = {
        EXACT BALL(SOFT "cavity = { gas = true; ambient = 0.0; pressure = 150.0; };"),
        EXACT BALL(SOFT "cavity = { gas = true; pressure = 300.0; };"),
        BALL(SOFT "cavity = { gas = true; pressure = 300.0; };"),
        EXACT BALL(SOFT LEVELS "cavity = { gas = true; pressure = 300.0; };"),
        BALL(SOFT LEVELS "cavity = { gas = true; pressure = 300.0; };"),
    };
    for (size_t k = 0; k < sizeof CASES / sizeof *CASES; k++) {
        START_RUN(run, CASES[k]);
        stir(&run, 0.2);
        double worst = 0.0, least = 1.0, most = 0.0;
        const Cavity *cavity = cavity_of(&run);
        const double content = cavity->state->content;
        for (int i = 0; i < 300; i++) {
            step(&run, 1);
            const double volume = volume_of(&run, NULL),
                         held = (cavity_pressure(cavity) + cavity->options.ambient) * volume;
            worst = fmax(worst, fabs(held - content) / content);
            least = fmin(least, volume / cavity->rest_volume);
            most = fmax(most, volume / cavity->rest_volume);
        }
        print_message("case %zu: volume %.6f to %.6f of that at rest, p V off by %.1e\n", k, least,
                      most, worst);
        // It breathes where nothing is outside; a gas of 1 bar hardly gives way.
        assert_true(most - least > (k == 0 ? 1e-2 : 1e-5));
        // The volume that the pressure follows from is that of the evaluation before, moved on, in
        // an error of third order: (h v / R)^3. Each change of levels begins with one of second
        // order, 1e-5 here.
        expect_at_most(worst, k < 3 ? 1e-6 : 1e-5);
    }
}

// A step that is tried and undone leaves nothing behind, also where it was the first to measure the
// volume after the rows have changed.
TEST(a_tried_step_leaves_nothing)
{
    uint64_t hash[2];
    for (int tried = 0; tried < 2; tried++) {
        START_RUN(run, BALL(SOFT LEVELS "cavity = { gas = true; pressure = 300.0; };"));
        stir(&run, 0.2);
        for (int i = 0; i < 40; i++) {
            const Body *body = sim_body(run.world.sim, 0);
            const Evaluation kick = {EVALUATION_KICK, 0.5, 1.0, 0.5, true};
            if (i == 20)
                cavity_forget(((SurfaceModel *)body->model)->cavity);
            if (tried && i % 4 == 0) {
                body->ops->drift(body->model, 0.5 * body->h);
                body->ops->evaluate(body->model, &kick, body->h);
                body->ops->abandon(body->model);
            }
            step(&run, 1);
        }
        hash[tried] = state_hash(&run.world.state);
    }
    assert_true(hash[0] == hash[1]);
}

TEST(a_fluid_keeps_its_volume)
{
    START_RUN(
        run,
        EXACT BALL(SOFT
                   "cavity = { fluid = true; };") "loads = ( { body = \"ball\"; center = [0, 0, "
                                                  "0.05]; radius = 0.02;\n"
                                                  "  force = [0, 0, -0.5]; duration = 1.0; },\n"
                                                  "  { body = \"ball\"; center = [0, 0, -0.05]; "
                                                  "radius = 0.02;\n"
                                                  "  force = [0, 0, 0.5]; duration = 1.0; } );\n");
    const double rest = cavity_of(&run)->rest_volume;
    double worst = 0.0;
    for (int i = 0; i < 300; i++) {
        step(&run, 1);
        worst = fmax(worst, fabs(volume_of(&run, NULL) / rest - 1.0));
    }
    const Body *body = sim_body(run.world.sim, 0);
    BodyMeasure measure;
    body->ops->measure(body->model, &measure);
    // Pinched by a quarter of its radius it gives way by pressure over bulk modulus: about 1e-3.
    print_message("moved by %.4f m, volume off by %.1e\n", measure.max_displacement, worst);
    assert_true(measure.max_displacement > 0.01);
    expect_at_most(worst, 5e-3);
}

// Nothing holds it, nothing damps it.
TEST(a_free_balloon_keeps_momentum_and_energy)
{
    static const char *const CASES[] = {
        EXACT BALL(SOFT "cavity = { pressure = 300.0; };"),
        EXACT BALL(SOFT "cavity = { gas = true; ambient = 0.0; pressure = 300.0; };"),
        EXACT BALL(SOFT "cavity = { gas = true; pressure = 300.0; };"),
        EXACT BALL(SOFT "cavity = { fluid = true; pressure = 300.0; };"),
        EXACT BALL(SOFT LEVELS "cavity = { gas = true; pressure = 300.0; };"),
        EXACT BALL(LEVELS "material = { youngs_modulus_2d = 80.0; damping_time = 0.0;\n"
                          "  relaxation = ( { time = 0.02; share = 0.3; } ); };\n"
                          "cavity = { pressure = 300.0; };"),
    };
    for (size_t k = 0; k < sizeof CASES / sizeof *CASES; k++) {
        START_RUN(run, CASES[k]);
        stir(&run, 0.1);
        Vec3 linear[2], angular[2];
        momenta(&run, &linear[0], &angular[0]);
        const double before = run_energy(&run, true), moved = run_energy(&run, false);
        double worst = 0.0;
        for (int i = 0; i < 400; i++) {
            step(&run, 5);
            worst = fmax(worst, fabs(run_energy(&run, true) - before) / moved);
        }
        momenta(&run, &linear[1], &angular[1]);
        const double spin = vec3_length(angular[0]),
                     turned = vec3_length(vec3_sub(angular[1], angular[0])) / spin,
                     pushed = vec3_length(vec3_sub(linear[1], linear[0])) * 0.05 / spin;
        print_message("case %zu: energy within %.1e of what moves, momentum %.1e, angular %.1e\n",
                      k, worst, pushed, turned);
        // Asked of every law. Levels change the angular momentum where new nodes are born.
        expect_at_most(pushed, 1e-10);
        if (k < 4)
            expect_at_most(turned, 1e-10);
        assert_int_equal(run.world.sim->resets, 0);
        // Leapfrog near its bound lets energy swing, and random motion puts much of it into the
        // fastest modes: 6 % without growing in 2 s. Refining adds energy
        // (server/surface/detail/README.md).
        if (k < 5)
            expect_at_most(worst, k < 4 ? 0.1 : 0.4);
    }
}

static void cut(Run *run, Vec3 a, Vec3 b, Vec3 way)
{
    const CutOptions blade = {
        .body = 0, .before = {{a, b}}, .after = {{vec3_add(a, way), vec3_add(b, way)}}};
    CutOutcome sum = {0};
    apply_well(sim_apply_cut, run->world.sim, &blade, &sum);
}

#define CUTTABLE                                                                                   \
    "cuttable = true; shape = {};\n"                                                               \
    "material = { youngs_modulus_2d = 80.0; node_damping = 1.0e-3; };\n"

// Cut in two halves, whose openings are known at every tick.
TEST(what_is_inside_leaves_by_the_law_of_a_jet)
{
    static const struct {
        const char *text;
        double density;
    } CASES[] = {
        {"settle_s = 0.5; " EXACT BALL(CUTTABLE "cavity = { pressure = 300.0; };"), 1000.0},
        {"settle_s = 0.5; " EXACT BALL(CUTTABLE "cavity = { fluid = true; pressure = 300.0; };"),
         1000.0},
        {"settle_s = 0.5; " EXACT BALL(
             CUTTABLE "cavity = { gas = true; pressure = 300.0; density = 50.0; };"),
         50.0},
    };
    for (int k = 0; k < 3; k++) {
        START_RUN(run, CASES[k].text);
        step(&run, 100);
        const Cavity *cavity = cavity_of(&run);
        const SurfaceCavity *options = &cavity->options;
        const double closed = cavity_pressure(cavity), whole = volume_of(&run, NULL);
        assert_true(closed > 50.0 && cavity->state->opening == 0.0);
        cut(&run, (Vec3){-0.08, -0.08, 1e-3}, (Vec3){-0.08, 0.08, 1e-3}, (Vec3){0.16, 0, 0});
        double content = cavity->state->content, opening, pressure = closed, held = closed;
        int ticks = 0;
        for (; ticks < 2000 && pressure > 0.02 * closed; ticks++) {
            step(&run, 1);
            // The law, from what the test measures itself at the end of the tick.
            const double volume = volume_of(&run, &opening);
            pressure = options->gas     ? content / volume - options->ambient
                       : options->fluid ? cavity->bulk_modulus * (1.0 - volume / content)
                                        : content;
            // No more than lets out within the tick what is too much.
            const double more =
                             options->gas ? content / options->ambient - volume : content - volume,
                         speed = more / (0.62 * opening * 1e-3);
            // And no more than there was.
            if (options->gas || options->fluid)
                pressure =
                    fmin(fmax(0.0, fmin(pressure, held)), 0.5 * CASES[k].density * speed * speed);
            const double out =
                0.62 * opening * sqrt(2.0 * fmax(pressure, 0.0) / CASES[k].density) * 1e-3;
            double expected = options->gas     ? content - (pressure + options->ambient) * out
                              : options->fluid ? content - out
                                               : content * exp(-out / volume);
            if (options->gas)
                expected = fmax(expected, fmin(content, options->ambient * volume));
            if (options->fluid)
                expected = fmax(expected, fmin(content, volume));
            if (ticks == 0) {
                print_message("case %d: opening %.4g m2, %.3g m3/s\n", k, opening, out / 1e-3);
                // Two discs as wide as the sphere, less a millimetre beside its middle, more what
                // they grow as the halves part.
                const double disc = M_PI * pow(0.75 * whole / M_PI, 2.0 / 3.0);
                expect_near(opening, 2.0 * disc, 0.05 * disc);
            }
            // Volumes follow the steps to 1e-6, and a fluid's pressure is 500 times stiffer.
            if (pressure > 0.0) {
                expect_near(cavity->state->content, expected, 1e-5 * content);
                assert_true(cavity->state->content <= content);
            }
            content = cavity->state->content;
            expect_at_most(cavity->state->held, held);
            held = cavity->state->held;
        }
        print_message("case %d: empty after %d ms\n", k, ticks);
        assert_true(ticks < 2000);
    }
}

// The top of a ball is sucked away: no node is copied, and yet there is an opening.
TEST(what_is_inside_leaves_through_a_hole)
{
    START_RUN(run, "settle_s = 0.5; " EXACT BALL(CUTTABLE "levels = 1; start_level = 1;\n"
                                                          "cavity = { gas = true; pressure = 20.0; "
                                                          "density = 50.0; };") SUCK);
    const Cavity *cavity = cavity_of(&run);
    step(&run, 100);
    const double closed = cavity_pressure(cavity), volume = cavity_volume(model_of(&run));
    const ToolPose pose = {.position = place(sim_body(run.world.sim, 0), 0),
                           .orientation = {1.0, 0.0, 0.0, 0.0},
                           .active = true,
                           .grip = 1.0};
    assert_true(closed > 10.0 && cavity->state->opening == 0.0);
    sim_apply_pose(run.world.sim, 0, &pose, true);
    step(&run, 1);
    TissueAccount account;
    sim_body(run.world.sim, 0)->ops->account(model_of(&run), &account, 1);
    assert_true(account.removed > 0.0 && account.cut_off == 0.0);
    const BodyMesh *mesh = &sim_body(run.world.sim, 0)->mesh;
    for (int i = 0; i < mesh->node_count; i++)
        assert_true(mesh->id[i] < 0 || mesh->origin[i] == mesh->id[i]);
    // The wall's area at rest has grown with the ball, and lies flat in the opening: of a cap of
    // radius r all but (r / 2 R)^2, half a percent. In a tick the tension, 0.5 N/m, moves its
    // rim by 0.04 mm of 6.
    const double stretch = pow(volume / cavity->rest_volume, 2.0 / 3.0);
    expect_near(cavity->state->opening / (stretch * account.removed), 1.0, 0.05);
    expect_near(cavity_volume(model_of(&run)), volume, 0.01 * volume);
    step(&run, 1000);
    expect_at_most(cavity_pressure(cavity), 0.02 * closed);
    assert_int_equal(sim_resets(run.world.sim), 0);
}

// The upper part of a full bladder falls off, and far: what it encloses by itself does not change
// with where it is, and the pressure is gone.
TEST(a_piece_that_falls_off_is_left_alone)
{
#define HUNG                                                                                       \
    "cuttable = true; fixed = ( { box = ([-1, -1, -1], [1, 1, -0.04]); } );\n"                     \
    "material = { youngs_modulus_2d = 120.0; areal_density = 2.0; node_damping = 1.0e-3;\n"        \
    "  thickness = 0.002; };\n"
    static const char *const CASES[] = {
        "settle_s = 0.5; " BALL(HUNG "cavity = { fluid = true; pressure = 800.0; };"),
        "settle_s = 0.5; " EXACT BALL(HUNG "cavity = { fluid = true; pressure = 800.0; };"),
        "settle_s = 0.5; " BALL(HUNG "cavity = { gas = true; pressure = 800.0; };"),
    };
    for (size_t k = 0; k < sizeof CASES / sizeof *CASES; k++) {
        START_RUN(run, CASES[k]);
        cut(&run, (Vec3){-0.08, -0.08, 0.02}, (Vec3){0.08, -0.08, 0.03}, (Vec3){0, 0.16, 0});
        apply_well(sim_apply_gravity, run.world.sim, (Vec3){0, 0, -9.81});
        double most = 0.0;
        for (int i = 0; i < 1500; i++) {
            step(&run, 1);
            if (i > 300)
                most = fmax(most, fabs(cavity_pressure(cavity_of(&run))));
        }
        assert_int_equal(run.world.sim->resets, 0);
        // A thousandth of what was in it.
        expect_at_most(most, 0.8);
    }
}

// Resumed in the middle of its emptying, and on two threads: the same bits.
TEST(a_cut_balloon_repeats_bit_for_bit)
{
    static const char *const CASES[] = {
        BALL(CUTTABLE "cavity = { pressure = 300.0; };"),
        BALL(CUTTABLE LEVELS "cavity = { gas = true; pressure = 300.0; };"),
        EXACT BALL(CUTTABLE LEVELS "cavity = { fluid = true; pressure = 300.0; };"),
        // With springs that relax and stiffen.
        BALL(LEVELS "cuttable = true; cavity = { gas = true; pressure = 300.0; };\n"
                    "material = { youngs_modulus_2d = 80.0;\n"
                    "  stiffening = { strain = 0.15; cap = 5.0; };\n"
                    "  relaxation = ( { time = 0.02; share = 0.3; } ); };"),
    };
    for (size_t k = 0; k < sizeof CASES / sizeof *CASES; k++) {
        uint64_t end[3] = {0};
        Run run;
        void *image = NULL;
        run_create(&run, CASES[k]);
        step(&run, 50);
        cut(&run, (Vec3){-0.08, -0.08, 0.035}, (Vec3){0.08, -0.08, 0.035}, (Vec3){0, 0.16, 0});
        step(&run, 20);
        StateList *state = &run.world.state;
        image = malloc(state_bytes(state));
        assert_non_null(image);
        state_copy_out(state, image);
        step(&run, 60);
        end[0] = state_hash(&run.world.state);
        for (int again = 1; again < 3; again++) {
            START_RUN(other, CASES[k]);
            Run *to = again == 1 ? &run : &other; // itself, and another process
            state_copy_in(&to->world.state, image);
            sim_restored(to->world.sim);
            step(to, 60);
            end[again] = state_hash(&to->world.state);
            assert_true(end[again] == end[0]);
        }
        free(image);
        run_destroy(&run);
        // Nor do the kernels of other instruction sets change a bit.
        const char *const *isa = isa_available();
        for (int level = 0; isa[level] != NULL; level++) {
            run_create_with(&run, CASES[k], &(BuildOptions){.isa = isa[level], .may_load = true});
            step(&run, 50);
            cut(&run, (Vec3){-0.08, -0.08, 0.035}, (Vec3){0.08, -0.08, 0.035}, (Vec3){0, 0.16, 0});
            step(&run, 80);
            assert_true(state_hash(&run.world.state) == end[0]);
            run_destroy(&run);
        }
    }
}

TEST(set_changes_pressure_and_volume)
{
    SCOPED(run_destroy) Run run;
    char why[256];
    run_create(&run, EXACT BALL(SOFT "cavity = { pressure = 100.0; };"));
    Sim *sim = run.world.sim;
    // It comes within 50 ms, but for 1/e.
    apply_well(sim_apply_set, sim, "ball.pressure", 150.0);
    step(&run, 50);
    // 50 steps of the exponential to third order, of 0.02 each.
    expect_near(cavity_pressure(cavity_of(&run)), 150.0 - 50.0 * exp(-1.0), 0.01);
    apply_well(sim_apply_set, sim, "pressure", 200.0);
    step(&run, 1000);
    expect_near(cavity_pressure(cavity_of(&run)), 200.0, 1e-5);
    assert_false(sim_apply_set(sim, "ball.pressure", 1e6, why, sizeof why));
    expect_in(why, "time step");
    assert_false(sim_apply_set(sim, "ball.volume", 1e-4, why, sizeof why));
    expect_in(why, "with a gas or fluid");
    step(&run, 100);
    expect_near(cavity_pressure(cavity_of(&run)), 200.0, 1e-5);
    run_destroy(&run);

    run_create(&run, EXACT BALL(SOFT "cavity = { fluid = true; };"));
    sim = run.world.sim;
    const double rest = cavity_of(&run)->rest_volume;
    apply_well(sim_apply_set, sim, "ball.volume", 1.2 * rest);
    step(&run, 1000);
    // It takes the volume that it was given, but for what its pressure squeezes out.
    expect_near(volume_of(&run, NULL), 1.2 * rest, 0.01 * rest);
    assert_false(sim_apply_set(sim, "ball.volume", 1.0, why, sizeof why));
    assert_false(sim_apply_set(sim, "ball.volume", 0.0, why, sizeof why));
    run_destroy(&run);

    run_create(&run, BALL(SOFT));
    assert_false(sim_apply_set(run.world.sim, "ball.pressure", 1.0, why, sizeof why));
    expect_in(why, "no closed cavity");
}

// What is accepted is borne: by a SET before the first tick, the largest, a fluid that hardly gives
// way, a wall that is put back to its rest shape, or one that cannot move.
TEST(what_is_accepted_is_borne)
{
#define DAMPED                                                                                     \
    "material = { youngs_modulus_2d = 80.0; damping_time = 1e-3; node_damping = 1e-3; };\n"
    static const struct {
        const char *text, *key;
        double value; // of the rest volume, if it is a volume
        bool restore;
    } CASES[] = {
        {EXACT BALL(DAMPED "cavity = { fluid = true; };"), "ball.pressure", 200.0, false},
        {EXACT BALL(DAMPED "cavity = { gas = true; };"), "ball.pressure", 200.0, false},
        {EXACT BALL(DAMPED "cavity = { fluid = true; };"), "ball.volume", 2.99, false},
        {BALL(DAMPED "cavity = { gas = true; };"), "ball.volume", 1.5, false},
        {"settle_s = 0.5; " EXACT BALL(
             DAMPED "cavity = { fluid = true; pressure = 500.0; bulk_modulus = 3.0e6; };"),
         "ball.pressure", 500.0, false},
        {"settle_s = 0.5; " EXACT BALL(DAMPED "cavity = { fluid = true; pressure = 500.0; };"),
         "ball.volume", 1.2, true},
        {"settle_s = 0.5; " BALL(DAMPED "cavity = { gas = true; pressure = 500.0; };"),
         "ball.pressure", 500.0, true},
        // Beyond what linear springs bear.
        {"settle_s = 0.5; " BALL("material = { youngs_modulus_2d = 80.0; node_damping = 2e-2;\n"
                                 "  stiffening = { strain = 0.2; cap = 14.0; };\n"
                                 "  relaxation = ( { time = 0.05; share = 0.3; } ); };\n"
                                 "cavity = { pressure = 2000.0; };"),
         "ball.pressure", 2200.0, false},
        {EXACT BALL(DAMPED "cavity = { fluid = true; pressure = 500.0; };\n"
                           "fixed = ( { sphere = [0, 0, 0]; radius = 1.0; } );"),
         "ball.volume", 1.1, false},
    };
    for (size_t k = 0; k < sizeof CASES / sizeof *CASES; k++) {
        char why[256];
        START_RUN(run, CASES[k].text);
        Sim *sim = run.world.sim;
        const bool volume = strstr(CASES[k].key, "volume") != NULL;
        if (CASES[k].restore) {
            const Body *body = sim_body(sim, 0);
            body->ops->restore(body->model, RESTORE_SHAPE);
            step(&run, 100);
        }
        if (!sim_apply_set(sim, CASES[k].key,
                           CASES[k].value * (volume ? cavity_of(&run)->rest_volume : 1.0), why,
                           sizeof why))
            fail_msg("case %zu: %s", k, why);
        step(&run, 1000);
        if (sim->resets != 0)
            fail_msg("case %zu: %d resets", k, (int)sim->resets);
        const double has =
            volume ? cavity_of(&run)->state->content : cavity_pressure(cavity_of(&run));
        // After twenty times the 50 ms in which it comes; of a gas its content is an energy.
        if (volume && cavity_of(&run)->options.fluid)
            expect_near(has, CASES[k].value * cavity_of(&run)->rest_volume,
                        1e-6 * cavity_of(&run)->rest_volume);
        else if (!volume)
            expect_near(has, CASES[k].value, 1e-3);
    }
}

// One of two bodies refuses: neither changes.
TEST(a_set_of_all_is_of_all_or_none)
{
    Run run;
    char why[256];
#define ONE(name, place, more)                                                                     \
    "{ name = \"" name "\"; integrator = \"leapfrog\"; " SOFT                                      \
    "  mesh = { generator = \"ico_sphere\"; nodes = 162; radius = 0.05;\n"                         \
    "  place = { translation = [" place ", 0, 0]; }; };\n" more " }"
    run_create(&run, "bodies = ( " ONE("a", "0", "cavity = { pressure = 100.0; };") ", " ONE(
                         "b", "1", "cavity = { gas = true; ambient = 100.0; };") " );\n");
    Sim *sim = run.world.sim;
    assert_false(sim_apply_set(sim, "pressure", -150.0, why, sizeof why));
    step(&run, 200);
    const SurfaceModel *first = sim_body(sim, 0)->model;
    expect_near(cavity_pressure(first->cavity), 100.0, 0.0);
    apply_well(sim_apply_set, sim, "pressure", 50.0);
    apply_well(sim_apply_set, sim, "volume", 5e-4); // of the one that has any
    run_destroy(&run);
}

TEST(bad_cavities_are_refused)
{
    static const char *const CASES[][2] = {
        {BALL("cavity = { gas = true; fluid = true; };"),
         "x.cfg:4: fluid cannot be mixed with gas"},
        {BALL("cavity = { gas = true; pressure = -2.0e5; };"), "ambient + pressure above 0"},
        {BALL("cavity = { pressure = 1.0e9; };"), "pressure"},
        {BALL("cavity = { presure = 1.0; };"), "unknown key presure"},
        {BALL("cavity = { fluid = true; pressure = 60.0; bulk_modulus = 100.0; };"),
         "half of the bulk_modulus"},
    };
    for (size_t k = 0; k < sizeof CASES / sizeof *CASES; k++) {
        World world;
        const char *said = try_world(&world, CASES[k][0], &(BuildOptions){.isa = "auto"});
        if (strstr(said, CASES[k][1]) == NULL)
            fail_msg("%s", said);
    }
}

// A wall of springs to the world bears what its fluid cannot: a scene may ask for that.
TEST(a_fluid_pressed_beyond_its_modulus_is_still_there)
{
    SCOPED(run_destroy) Run run;
    run_create(&run, "bodies = ( { name = \"ball\"; mesh = { generator = \"sphere\"; nodes = 162;\n"
                     "  radius = 0.0087; }; shape = {};\n"
                     "  cavity = { fluid = true; pressure = 1.0e6; }; } );\n");
    const Cavity *cavity = cavity_of(&run);
    assert_true(cavity->bulk_modulus < 1e6);
    step(&run, 1);
    assert_true(cavity->state->content > 0.0);
    assert_null(world_fault(&run.world));
}

// Three thousand newtons on a node throw a wall inside out, with numbers that are all finite.
TEST(a_volume_that_no_checkpoint_may_hold_is_a_bad_tick)
{
    SCOPED(run_destroy) Run run;
    run_create(&run, "name = \"cav\"; rate_hz = 500.0; tool_timeout_s = 0.05;\n"
                     "gravity = [0, 0, -1]; settle_s = 0.01; max_ties = 3;\n"
                     "bodies = ( { name = \"ball\"; levels = 1; start_level = 0; prestress = 0.1;\n"
                     "  cuttable = true; cavity = { fluid = true; pressure = 200.0; };\n"
                     "  mesh = { generator = \"ico_sphere\"; nodes = 42; radius = 0.05; };\n"
                     "  contact = { stiffness = 1.0; };\n"
                     "  adapt = { force = 0.005; speed = 0.3; curvature = 0.4; check_hz = 100; };\n"
                     "  material = { youngs_modulus_2d = 80.0; areal_density = 4.2;\n"
                     "    damping_time = 2.0e-4; };\n"
                     "  shape = { angular_frequency = 50.0; damping_ratio = 0.3; };\n"
                     "  fixed = ( { box = ([-1, -1, -1], [1, 1, -0.03]); } ); } );\n");
    const LoadOptions blow = {.center = {0.0, 0.0, 0.05},
                              .radius = 0.01,
                              .force = {-3000.0, 0.0, 0.0},
                              .duration = 0.0055};
    char why[SIM_EVENT_TEXT];
    step(&run, 5);
    assert_true(sim_apply_load(run.world.sim, &blow, why, sizeof why));
    for (int tick = 0; tick < 60; tick++) {
        step(&run, 1);
        if (world_fault(&run.world) != NULL)
            fail_msg("tick %d ends with a flow of %.3g m3", tick,
                     cavity_of(&run)->state->flow.volume);
    }
    assert_true(sim_body(run.world.sim, 0)->resets > 0);
    // Its own doing, cleared with it: the rest shape holds what it did.
    cavity_of(&run)->state->flow.volume = 1e9;
    sim_body(run.world.sim, 0)->ops->restore(sim_body(run.world.sim, 0)->model, RESTORE_SHAPE);
    assert_null(world_fault(&run.world));
}
