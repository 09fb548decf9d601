// SPDX-License-Identifier: MIT
// Small scenes for a study. For one source file of a test: it brings the folder that they are
// written to, which the test creates and destroys.
#ifndef PLIANT_TESTS_STUDY_BENCH_H
#define PLIANT_TESTS_STUDY_BENCH_H

#include "scene_text.h"

#include "study/study.h"
#include "study/context.h"

// A sheet of 25 nodes whose border is held and whose middle is pressed across, weakly, by a shape
// spring's length of a hundredth: nearly a linear oscillator, without any damping. 200 ticks a
// second.
#define SHEET_BODY(more)                                                                           \
    "rate_hz = 200.0; precision = \"double\";\n"                                                   \
    "bodies = ( { name = \"sheet\";\n"                                                             \
    "  mesh = { generator = \"sheet\"; columns = 5; rows = 5; width = 0.1; height = 0.1; };\n"     \
    "  material = { youngs_modulus_2d = 80.0; areal_density = 4.2; damping_time = 0.0; };\n"       \
    "  shape = { angular_frequency = 50.0; damping_ratio = 0.0; };\n"                              \
    "  fixed = ( { box = ([-1.0, -1.0, -1.0], [-0.049, 1.0, 1.0]); } ); " more " } );\n"
#define SHEET                                                                                      \
    SHEET_BODY("")                                                                                 \
    "loads = ( { center = [0.0, 0.0, 0.0]; radius = 0.03; force = [0.0, 0.0, -0.02];"              \
    " duration = 10.0; } );\n"

typedef struct Bench {
    Scene scene;
    StudyContext context;
} Bench;

static inline void bench_create(Bench *bench, const char *text, const StudyOptions *options)
{
    Status status = {0};
    assert_string_equal(read_as_scene(text, &bench->scene), "");
    bool ok = study_prepare(&bench->context, &bench->scene, options, &status);
    if (!ok)
        print_error("%s\n", status.text);
    assert_true(ok);
}

static inline void bench_destroy(Bench *bench)
{
    study_destroy(&bench->context);
    scene_destroy(&bench->scene);
}

#endif
