// SPDX-License-Identifier: MIT
// The grid of cases.
#include "test.h"
#include "study_bench.h"

static StudyCase cases[STUDY_CASES];

#define VOXEL                                                                                      \
    "bodies = ( { name = \"b\"; model = \"voxel\"; voxels = { generator = \"box\"; count = [4, "   \
    "4, 4];"                                                                                       \
    " size = 0.01; }; levels = 1; material = { youngs_modulus = 1.0e4; density = 1000.0; }; } "    \
    ");\n"

static int make(const char *text, const StudyOptions *options, Scene *scene)
{
    assert_string_equal(read_as_scene(text, scene), "");
    return study_make_cases(scene, options, cases);
}

static void expect_sound(const Scene *scene, int count)
{
    assert_true(count > 1 && count <= STUDY_CASES);
    assert_true(cases[0].is_scene);
    StudyCase own = study_scene_case(scene);
    assert_memory_equal(cases[0].name, own.name, sizeof own.name);
    for (int i = 0; i < count; i++) {
        assert_true(cases[i].name[0] != '\0' && strlen(cases[i].name) < STUDY_NAME - 1);
        assert_int_equal(cases[i].is_scene, i == 0);
        for (int k = 0; k < i; k++)
            assert_string_not_equal(cases[i].name, cases[k].name);
    }
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(the_first_is_the_scene_and_names_are_unique)
{
    static const char *const texts[] = {
        SHEET, SHEET_BODY("levels = 2; adapt = {}; adjust = \"choi2005\";"),
        SHEET_BODY("levels = 2; start_level = 1; time_step = 0.0005; integrator = \"rk4\";"),
        VOXEL};
    for (size_t t = 0; t < sizeof texts / sizeof *texts; t++)
        for (int quick = 0; quick <= 1; quick++) {
            SCOPED(scene_destroy) Scene scene;
            int count = make(texts[t], &(StudyOptions){.quick = quick}, &scene);
            expect_sound(&scene, count);
        }
}

static int count_of(int count, IntegratorKind kind, StudyDetail detail, int level, double threshold)
{
    int found = 0;
    for (int i = 0; i < count; i++)
        found += cases[i].integrator == kind && cases[i].detail == detail &&
                 cases[i].level == level && cases[i].threshold == threshold;
    return found;
}

// What the curves need: every integrator with every step, and every detail with the default
// integrator and the paper's.
TEST(curves_have_their_points)
{
    SCOPED(scene_destroy) Scene scene;
    int count = make(SHEET_BODY("levels = 2; adapt = {};"), &(StudyOptions){0}, &scene);
    for (int k = 0; k < INTEGRATOR_COUNT; k++)
        assert_true(count_of(count, (IntegratorKind)k, DETAIL_SCENE, 2, 1.0) >= 8);
    static const IntegratorKind kinds[] = {INTEGRATOR_LEAPFROG, INTEGRATOR_RK4};
    for (int k = 0; k < 2; k++) {
        for (int level = 0; level <= 2; level++)
            assert_true(count_of(count, kinds[k], DETAIL_HELD, level, 0.0) >= 1);
        static const double times[] = {0.5, 2.0, 4.0};
        for (int t = 0; t < 3; t++)
            assert_true(count_of(count, kinds[k], DETAIL_ADAPTIVE, 2, times[t]) >= 1);
    }
    int doubling = 0, paper = 0;
    for (int i = 0; i < count; i++) {
        doubling += cases[i].step_doubling;
        paper += cases[i].paper_rule;
    }
    assert_true(doubling >= 4);
    assert_true(paper >= 4);
}

TEST(voxels_are_only_given_what_they_take)
{
    SCOPED(scene_destroy) Scene scene;
    int count = make(VOXEL, &(StudyOptions){0}, &scene), level[2] = {0, 0};
    for (int i = 0; i < count; i++) {
        assert_true(cases[i].integrator == INTEGRATOR_LEAPFROG ||
                    cases[i].integrator == INTEGRATOR_SYMPLECTIC_EULER);
        assert_false(cases[i].step_doubling);
        assert_in_range(cases[i].level, 0, 1);
        level[cases[i].level]++;
    }
    assert_true(level[0] > 0 && level[1] > 0);
}

TEST(solids_that_a_tool_presses_are_also_studied_with_elements_that_follow_it)
{
    SCOPED(scene_destroy) Scene scene;
    int count =
        make(VOXEL "tools = ( { id = 1; kind = \"probe\"; capsules = ( { radius = 0.01; } ); "
                   "} );\n",
             &(StudyOptions){0}, &scene);
    const IntegratorKind own = cases[0].integrator;
    expect_sound(&scene, count);
    assert_int_equal(count_of(count, own, DETAIL_ADAPTIVE, 1, UNSTEERED), 1);
    assert_int_equal(count_of(count, own, DETAIL_ADAPTIVE, 1, 0.02), 1);
    // Nothing follows where there is no tool.
    SCOPED(scene_destroy) Scene without;
    count = make(VOXEL, &(StudyOptions){0}, &without);
    assert_int_equal(count_of(count, own, DETAIL_ADAPTIVE, 1, UNSTEERED), 0);
}

TEST(only_keeps_the_scene_and_what_was_asked_for)
{
    SCOPED(scene_destroy) Scene scene;
    int count = make(SHEET, &(StudyOptions){.only = "symplectic_euler"}, &scene);
    assert_true(count > 2);
    for (int i = 1; i < count; i++)
        expect_in(cases[i].name, "symplectic_euler");
    assert_true(cases[0].is_scene);
    int fewer =
        study_make_cases(&scene, &(StudyOptions){.only = "symplectic_euler", .quick = true}, cases);
    assert_true(fewer < count);
}
