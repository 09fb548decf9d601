// SPDX-License-Identifier: MIT
// Scenes that ask for steps that they cannot stand are refused with the bound and the nearest value
// that is safe: taken at its word, the scene is accepted.
#include "test.h"
#include "sim_steps.h"
#include "fixture.h"

static double number_after(const char *text, const char *words)
{
    const char *at = strstr(text, words);
    if (at == NULL)
        fail_msg("'%s' is not in: %s", words, text);
    return strtod(at + strlen(words), NULL);
}

static const ToolOptions probe = {PROBE(0.01, 5.0)};

typedef struct Asked {
    IntegratorKind integrator;
    double time_step, stiffness, damping_time, contact_ratio, contact_damping, rate_hz;
} Asked;

static bool is_accepted(const Asked *asked, char refusal[512])
{
    SCOPED(arena_destroy) Arena arena = {0};
    SCOPED(state_destroy) StateList list = {0};
    Status status = {0};
    SCOPED(mesh_destroy) TriMesh mesh;
    fixture_sphere(&mesh);
    const SimOptions sim_options = {.rate_hz = asked->rate_hz};
    Sim *sim = sim_create(&sim_options, &arena, &list);
    SurfaceOptions options = {.body.name = "body",
                              .material = fixture_material(asked->damping_time),
                              .shape = fixture_shape(SHAPE_WORLD),
                              .body.integrator = asked->integrator,
                              .body.time_step = asked->time_step,
                              .body.contact_ratio = asked->contact_ratio,
                              .body.contact_damping = asked->contact_damping};
    options.material.youngs_modulus_2d *= asked->stiffness;
    Body body;
    assert_true(surface_create(&body, &mesh, &options, &arena, &list, &status));
    sim_add_body(sim, &body);
    sim_add_tool(sim, &probe);
    bool accepted = sim_seal(sim, 0.0, &status);
    snprintf(refusal, 512, "%s", status.text);
    return accepted;
}

static const Asked usual = {.time_step = 1e-3,
                            .stiffness = 1.0,
                            .damping_time = 2e-4,
                            .contact_ratio = 1.0,
                            .contact_damping = 2e-4,
                            .rate_hz = 1000.0};

// Takes the advice "<words> <number>" for a value, and a hundredth more.
static void expect_advice(const Asked *asked, const char *words, size_t member, double times)
{
    char refusal[512], text[512];
    assert_false(is_accepted(asked, refusal));
    const double value = number_after(refusal, words) * times;
    Asked other = *asked;
    *(double *)((char *)&other + member) = value;
    if (!is_accepted(&other, text))
        fail_msg("%g, as '%s' asks for, gives: %s", value, refusal, text);
    *(double *)((char *)&other + member) = 1.02 * value; // three digits, rounded down
    if (is_accepted(&other, text))
        fail_msg("%g is not the most that '%s' could have asked for", value, refusal);
}

TEST(a_time_step_above_the_bound_is_refused_with_the_nearest_safe_one)
{
    for (int kind = 0; kind <= INTEGRATOR_RK4; kind++)
        for (double stiffness = 1e2; stiffness < 1e6; stiffness *= 7.3) {
            Asked asked = usual;
            asked.integrator = (IntegratorKind)kind;
            asked.stiffness = stiffness;
            char refusal[512], text[512];
            if (is_accepted(&asked, refusal))
                continue;
            const double bound = number_after(refusal, "stability bound ");
            asked.time_step = number_after(refusal, "take at most that, ");
            expect_at_most(asked.time_step, bound * (1.0 + 1e-5)); // six digits
            if (!is_accepted(&asked, text))
                fail_msg("%s, then: %s", refusal, text);
            // A step fewer a tick is too few.
            const int substeps = (int)lround(1e-3 / asked.time_step);
            asked.time_step = 1e-3 / (substeps - 1);
            assert_false(is_accepted(&asked, text));
        }
}

TEST(the_key_that_is_to_blame_is_named_with_the_most_that_is_safe)
{
    Asked asked = usual;
    asked.contact_damping = 0.5;
    expect_advice(&asked, "contact.damping_time of at most ", offsetof(Asked, contact_damping),
                  1.0);
    asked = usual;
    asked.contact_ratio = 90.0;
    asked.contact_damping = 0.0;
    asked.damping_time = 0.0;
    expect_advice(&asked, "contact.stiffness of at most ", offsetof(Asked, contact_ratio), 1.0);
    asked = usual;
    asked.stiffness = 1e5;
    asked.damping_time = asked.contact_damping = 0.0;
    expect_advice(&asked, "a stiffness (material, shape) of at most ", offsetof(Asked, stiffness),
                  1e5);
}

TEST(more_substeps_than_can_be_are_refused_with_a_way_out)
{
    char refusal[512], text[512];
    Asked asked = usual;
    asked.time_step = 1e-12; // of one's own will
    assert_false(is_accepted(&asked, refusal));
    asked.time_step = number_after(refusal, "take a time_step of at least ");
    assert_true(is_accepted(&asked, text));
    asked = usual;
    asked.time_step = 0.0;
    asked.stiffness = 1e12;
    asked.damping_time = asked.contact_damping = 0.0;
    asked.rate_hz = 1.0;
    assert_false(is_accepted(&asked, refusal));
    Asked faster = asked;
    faster.rate_hz = number_after(refusal, "take a rate_hz of at least ");
    assert_true(is_accepted(&faster, text));
    expect_advice(&asked, "a stiffness (material, shape) of at most ", offsetof(Asked, stiffness),
                  1e12);
    // What has no bound names none.
    asked.integrator = INTEGRATOR_IMPLICIT;
    asked.time_step = 1e-12;
    assert_false(is_accepted(&asked, refusal));
    assert_null(strstr(refusal, "inf"));
    asked.integrator = usual.integrator;
    asked.time_step = 0.0;
    // Beyond all rates that a scene may have, and beyond all numbers.
    for (asked.stiffness = 1e20; asked.stiffness < 1e301; asked.stiffness *= 1e100) {
        assert_false(is_accepted(&asked, refusal));
        assert_null(strstr(refusal, "rate_hz"));
        assert_null(strstr(refusal, "inf"));
        assert_non_null(strstr(refusal, "take less stiffness or more mass"));
    }
}

TEST(a_scale_that_is_refused_is_refused_with_the_most_that_is_not)
{
    FixtureOptions options = fixture_loadable();
    options.time_step = 1e-3;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    char why[256];
    assert_false(sim_apply_set(fixture.sim, "stiffness_scale", 1e5, why, sizeof why));
    const double most = number_after(why, "take at most ");
    assert_false(sim_apply_set(fixture.sim, "stiffness_scale", 1.01 * most, why, sizeof why));
    apply_well(sim_apply_set, fixture.sim, "stiffness_scale", most);
}
