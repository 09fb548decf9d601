// SPDX-License-Identifier: MIT
// What a scene leaves out is not there: none of its functions is called, none of its arrays is
// taken, switching it off in so many words changes nothing, and neither does a build without it.
// Instructions are counted by valgrind; they do not depend on the machine's load.
#include "test.h"
#include "scene_writer.h"
#include "profile.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PATTERNS = 10, TICKS = 20 };

// A feature, the scene that has it and nothing else, and what it brings.
typedef struct Feature {
    const char *name;
    const char *head, *material, *body, *tail, *arguments;
    const char *kernel;           // called in place of the plain one; NULL: none is
    const char *files[PATTERNS];  // that may be called, and the first of them must be
    const char *arrays[PATTERNS]; // parts of names; the first must be there
} Feature;

static const char *valgrind, *own_pliantd, *build_folder, *source_folder;

// ---------------------------------------------------------------------------------------------
// Scenes

#define BALL  "{ from = [0.0, 0.0, 0.1]; to = [0.0, 0.0, 0.1]; radius = 0.11; }"
#define FIXED "fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.05]); } );"
#define LOAD                                                                                       \
    "loads = ( { center = [0.0, 0.0, 0.1]; radius = 0.03; force = [0.0, 0.0, -0.5]; start = 0.0; " \
    "duration = 9.0; } );"
#define CONTACT_FILES "sim/contact/", "sim/tool.c", "geometry/distance.c"
#define OUTSIDE_FILES "surface/loads.c"
#define FOLLOW_FILES  "sim/follow.c", "sim/time_step.c", "body/integrator.c"

static const Feature PLAIN = {.name = "nothing"};

// Of both models. The body is a ball or a cube of 0.1 m about the origin.
static const Feature COMMON[] = {
    {.name = "static tools",
     .tail = "tools = ( { id = 1; kind = \"static\"; capsules = ( " BALL " ); } );",
     .files = {CONTACT_FILES, OUTSIDE_FILES},
     .arrays = {"contacts", "/tool0/"}},
    {.name = "graspers",
     .tail = "tools = ( { id = 1; kind = \"grasper\"; capsules = ( " BALL " ); } );",
     .files = {"sim/hold/attachment", CONTACT_FILES, OUTSIDE_FILES},
     .arrays = {"/grasp0", "contacts", "/tool0/", "attachments"}},
    {.name = "attachments",
     .tail = "attachments = ( { body = \"body\"; to = \"world\"; sphere = [0.0, 0.0, 0.1]; "
             "radius = 0.05; } );",
     .files = {"sim/hold/attachment", "sim/hold/grip.c", OUTSIDE_FILES},
     .arrays = {"/attachment0", "attachments"}},
    {.name = "loads",
     .tail = LOAD,
     .files = {"sim/load.c", "sim/inputs.c", OUTSIDE_FILES},
     .arrays = {"loads/", "sim/loads"}},
    // Bodies that are too small for it are not shared.
    {.name = "threads", .head = "threads = 2;", .arrays = {"threads of a step"}},
};

static const Feature SURFACE[] = {
    {.name = "damping",
     .material = "damping_time = 1.0e-4;",
     .kernel = "evaluate_SPRINGS_DAMPED_SHAPE_FRAME_NONE"},
    {.name = "bending",
     .material = "damping_time = 0.0; thickness = 0.001;",
     .files = {"surface/bending", "kernel/bend"},
     .arrays = {"bending", "hinges"}},
    {.name = "shape springs",
     .body = "shape = {};",
     .kernel = "evaluate_SPRINGS_PLAIN_SHAPE_FRAME_WORLD",
     .arrays = {"/shape rate", "/drag"}},
    {.name = "shape springs that follow",
     .body = "shape = { frame = \"body\"; };",
     .kernel = "evaluate_SPRINGS_PLAIN_SHAPE_FRAME_BODY",
     .arrays = {"/shape rate", "/drag", "/rigid frame"}},
    {.name = "shape springs damped along themselves",
     .body = "shape = { damping_direction = \"radial\"; };",
     .kernel = "evaluate_SPRINGS_PLAIN_SHAPE_FRAME_WORLD_RADIAL",
     .arrays = {"/shape rate", "/shape drag", "/drag"}},
    {.name = "cavity",
     .body = "cavity = { gas = true; pressure = 10.0; };",
     .kernel = "evaluate_SPRINGS_CAVITY_SHAPE_FRAME_NONE",
     .files = {"surface/cavity"},
     .arrays = {"cavity", "of volume", "/places of nodes", "/outside forces"}},
    {.name = "relaxation",
     .material = "damping_time = 0.0; relaxation = ( { time = 0.1; share = 0.2; } );",
     .kernel = "evaluate_SPRINGS_LAW_SHAPE_FRAME_NONE",
     .files = {"body/relaxation.c"},
     .arrays = {"/dashpots", "/outside forces"}},
    {.name = "stiffening",
     .material = "damping_time = 0.0; stiffening = { strain = 0.2; cap = 5.0; };",
     .kernel = "evaluate_SPRINGS_LAW_SHAPE_FRAME_NONE",
     .arrays = {"/outside forces"}},
    {.name = "prestress", .body = "prestress = 0.05;"},
    {.name = "implicit integration",
     .body = "integrator = \"implicit\";",
     // Valgrind 3.19 does not know every instruction that the compiler chooses for AVX.
     .arguments = "--isa baseline",
     .kernel = "", // the springs are its own
     .files = {"surface/implicit"},
     .arrays = {"/implicit"}},
    {.name = "refinement",
     .body = "levels = 1; adapt = {};",
     .kernel = "scattered_SPRINGS_PLAIN_SHAPE_FRAME_NONE", // nodes in rows that come and go
     .files = {"surface/detail/", FOLLOW_FILES},
     .arrays = {"/detail", "/level 1 faces"}},
    {.name = "cuts",
     .body = "cuttable = true; tear = { stretch = 3.0; };",
     .kernel = "scattered_SPRINGS_PLAIN_SHAPE_FRAME_NONE",
     .files = {"sim/cutting.c", "body/cut.c", "surface/cut/", "surface/detail/", FOLLOW_FILES},
     .arrays = {"/cuts", "sim/cutting"}},
};

static const Feature VOXEL[] = {
    {.name = "damping", .material = "damping = 0.2;", .kernel = "plain_ELEMENT_LINEAR_DAMPED"},
    {.name = "damping by a time",
     .material = "damping_time = 1.0e-4;",
     .kernel = "plain_ELEMENT_LINEAR_VISCOUS"},
    {.name = "relaxation",
     .material = "damping = 0.0; relaxation = ( { time = 0.1; share = 0.2; } );",
     .kernel = "plain_ELEMENT_LAW_UNDAMPED",
     .files = {"body/relaxation.c"},
     .arrays = {"/dashpots"}},
    {.name = "stiffening",
     .material = "damping = 0.0; stiffening = { strain = 0.1; cap = 2.0; };",
     .kernel = "plain_ELEMENT_LAW_UNDAMPED", // and nothing else is called
     .arrays = {"/stiffening"}},
    {.name = "larger elements inside", .body = "levels = 1;", .arrays = {"/hanging vertices"}},
    {.name = "cuts",
     .body = "cuttable = true; tear = { stress = 1.0e6; };",
     .files = {"sim/cutting.c", "body/cut.c", "voxel/cut/", FOLLOW_FILES},
     .arrays = {"/cuts", "sim/cutting"}},
};

static const char *or_else(const char *text, const char *preset)
{
    return text != NULL ? text : preset;
}

static bool finer; // a ball of four times as many nodes

static const char *write_feature_scene(bool voxel, const Feature *what, const char *also)
{
    const char *body = or_else(what->body, "");
    char head[512], source[256], keys[1024];
    snprintf(head, sizeof head, "rate_hz = 2000.0; %s", or_else(what->head, ""));
    snprintf(source, sizeof source, "time_step = 0.0005; %s",
             voxel   ? "model = \"voxel\"; voxels = { generator = \"box\"; count = [12, 12, 12]; "
                       "size = 0.0166; };"
             : finer ? ICO_SPHERE(2562, 0.1)
                     : ICO_SPHERE(642, 0.1));
    snprintf(keys, sizeof keys, FIXED " %s %s %s",
             voxel && strstr(body, "levels") == NULL ? "levels = 0;" : "", body, also);
    return write_body_scene(
        "feature.cfg",
        &(SceneParts){.head = head,
                      .name = "body",
                      .source = source,
                      .material =
                          or_else(what->material, voxel ? "damping = 0.0;" : "damping_time = 0.0;"),
                      .body = keys,
                      .tail = what->tail});
}

// ---------------------------------------------------------------------------------------------
// What is called

static const char *const KERNELS[] = {"surface/kernel/", "voxel/kernel/", "body/kernel/", NULL};
// Of a body and its integration, and how the pipeline comes to it.
static const char *const PLAIN_FILES[] = {"surface/kernel/",
                                          "voxel/kernel/",
                                          "body/kernel/",
                                          "surface/model.c",
                                          "surface/surface.c",
                                          "voxel/voxel.c",
                                          "body/vertices.c",
                                          "voxel/batch.c",
                                          "voxel/rotation.c", // of elements that turn far in a step
                                          "voxel/barrier.c",  // of elements that are crushed
                                          "sim/guard/guard.c", // which no scene leaves out
                                          "sim/guard/guard_energy.c",
                                          "sim/step.c",
                                          "body/integrator",
                                          "body/rows.c",
                                          "body/rigid_frame.c",
                                          NULL};

static void count_steps(Profile *profile, const char *program, const char *scene, int ticks,
                        const char *arguments)
{
    char all[2048];
    snprintf(all, sizeof all, "--offline %g %s %s", ticks / 2000.0, or_else(arguments, ""), scene);
    profile_run(profile, valgrind, program, "sim_step", all);
}

// Of the plain scene, counted once: most of a run is valgrind's own start.
static const Profile *plain_profile(bool voxel)
{
    static Profile profile[2];
    if (profile[voxel].count == 0)
        count_steps(&profile[voxel], own_pliantd, write_feature_scene(voxel, &PLAIN, ""), TICKS,
                    NULL);
    return &profile[voxel];
}

static bool is_brought(const Feature *feature, const ProfileFunction *called)
{
    return feature->files[0] != NULL && profile_is_in(called->name, feature->files);
}

// Of springs or of whole elements the kernel ran and no other, none if it is ""; of elements with
// hanging vertices, beside it, the one of the same kind.
static void expect_kernel(const Profile *profile, const Feature *feature, const char *kernel)
{
    bool any = kernel[0] == '\0';
    const char *kind = strchr(kernel, '_');
    for (int i = 0; i < profile->count; i++) {
        const char *name = profile->function[i].name;
        const bool beside = strncmp(name, "hanging_", 8) == 0;
        if (!beside && strncmp(name, "evaluate_SPRINGS_", 17) != 0 &&
            strncmp(name, "scattered_SPRINGS_", 18) != 0 &&
            strncmp(name, "plain_ELEMENT_", 14) != 0)
            continue;
        const char *given = beside ? strchr(name, '_') : name, *wanted = beside ? kind : kernel;
        const size_t length = wanted != NULL ? strlen(wanted) : 0;
        // The compiler may append a word to the part that seldom runs.
        if (length == 0 || strncmp(given, wanted, length) != 0 ||
            (given[length] != '\0' && given[length] != '.'))
            fail_msg("with %s the kernel %s ran, not %s", feature->name, name, kernel);
        any |= !beside;
    }
    if (!any)
        fail_msg("with %s the kernel %s did not run", feature->name, kernel);
}

static int count_foreign(bool voxel, const Feature *feature)
{
    static Profile with;
    const Profile *profile = &with;
    if (feature == &PLAIN)
        profile = plain_profile(voxel);
    else
        count_steps(&with, own_pliantd, write_feature_scene(voxel, feature, ""), TICKS,
                    feature->arguments);
    const char *const first[] = {feature->files[0], NULL};
    bool brought = feature->files[0] == NULL;
    int foreign = 0;
    for (int i = 0; i < profile->count; i++) {
        const ProfileFunction *called = &profile->function[i];
        brought |= called->ours && !brought && profile_is_in(called->name, first);
        // What stands in none of our files is the compiler's own.
        if (!called->ours || strcmp(profile_file(called->name), "?") == 0 ||
            profile_is_in(called->name, PLAIN_FILES) || is_brought(feature, called))
            continue;
        foreign++;
        printf("%s: a %s with %s calls %s (%lld instructions)\n", profile_file(called->name),
               voxel ? "cube" : "ball", feature->name, called->name, called->instructions);
    }
    if (!brought)
        fail_msg("with %s nothing of %s is called", feature->name, feature->files[0]);
    expect_kernel(profile, feature,
                  or_else(feature->kernel, voxel ? "plain_ELEMENT_LINEAR_UNDAMPED"
                                                 : "evaluate_SPRINGS_PLAIN_SHAPE_FRAME_NONE"));
    return foreign;
}

// PLIANTD VALGRIND BUILD SOURCES
static int find_tools(void **state)
{
    (void)state;
    own_pliantd = program_path("pliantd");
    valgrind = test_argument(2);
    build_folder = test_argument(3);
    source_folder = test_argument(4);
    if (access(valgrind, X_OK) != 0)
        test_skip_program("no valgrind here");
    if (!profile_read_symbols(build_folder, source_folder))
        test_skip_program("no nm here, or no libraries in the build's server/");
    return 0;
}

AROUND_ALL(find_tools, NULL)

TEST(only_functions_of_what_a_scene_has_are_called)
{
    int foreign = 0;
    for (int voxel = !WITH_SURFACE; voxel <= WITH_VOXEL; voxel++) {
        foreign += count_foreign(voxel, &PLAIN);
        // The pipeline is the same for both models: of a cube its contacts alone.
        for (size_t i = 0; i < (voxel && WITH_SURFACE ? 1 : sizeof COMMON / sizeof *COMMON); i++)
            foreign += count_foreign(voxel, &COMMON[i]);
        const Feature *own = voxel ? VOXEL : SURFACE;
        size_t count = voxel ? sizeof VOXEL / sizeof *VOXEL : sizeof SURFACE / sizeof *SURFACE;
        for (size_t i = 0; i < count; i++)
            foreign += count_foreign(voxel, &own[i]);
    }
    assert_int_equal(foreign, 0);
}

// Whatever asks during a tick whether a feature is on stands outside of the kernels, which are
// chosen at load.
TEST(all_that_is_no_kernel_takes_less_than_1_percent)
{
    for (int voxel = !WITH_SURFACE; voxel <= WITH_VOXEL; voxel++) {
        // A fixed body: its frame does not follow it, which would be part of the body.
        static Profile counted;
        const Profile *profile = &counted;
        finer = true; // what is outside is the same for any size
        count_steps(&counted, own_pliantd, write_feature_scene(voxel, &PLAIN, ""), TICKS, NULL);
        finer = false;
        long long outside = 0;
        for (int i = 0; i < profile->count; i++)
            if (!profile->function[i].ours || !profile_is_in(profile->function[i].name, KERNELS))
                outside += profile->function[i].instructions;
        double share = (double)outside / (double)profile->instructions;
        printf("%s: %.2f %% of a tick's instructions outside of the kernels\n",
               voxel ? "cube" : "ball", 100.0 * share);
        assert_true(share < 0.01);
    }
}

// ---------------------------------------------------------------------------------------------
// What is taken

static void explain(Process *daemon, const char *program, const char *scene)
{
    process_run(daemon, program, "--explain --offline 1 %s", scene);
    if (daemon->code != 0)
        fail_msg("%s --explain: %s", program, daemon->err);
    // What follows are features, not arrays.
    char *features = strstr(daemon->out, "\nfeatures of ");
    assert_non_null(features);
    *features = '\0';
}

// Bytes of the arrays whose names hold this.
static long long array_bytes(const Process *daemon, const char *part)
{
    long long bytes = 0;
    for (const char *at = strstr(daemon->out, part); at != NULL; at = strstr(at + 1, part)) {
        const char *line = at;
        while (line > daemon->out && line[-1] != '\n')
            line--;
        if (strncmp(line, "  ", 2) == 0) // a name of up to 47 characters, then the bytes
            bytes += strtoll(line + 2 + 47, NULL, 10);
    }
    return bytes;
}

static void expect_arrays(bool voxel, const Feature *feature, const Process *plain)
{
    Process with;
    explain(&with, own_pliantd, write_feature_scene(voxel, feature, ""));
    for (int k = 0; k < PATTERNS && feature->arrays[k] != NULL; k++) {
        const char *name = feature->arrays[k];
        if (array_bytes(plain, name) > 0)
            fail_msg("without %s there are %lld bytes of %s", feature->name,
                     array_bytes(plain, name), name);
        if (array_bytes(&with, name) == 0)
            fail_msg("with %s there are no bytes of %s", feature->name, name);
    }
}

TEST(only_arrays_of_what_a_scene_has_are_taken)
{
    for (int voxel = !WITH_SURFACE; voxel <= WITH_VOXEL; voxel++) {
        Process plain;
        explain(&plain, own_pliantd, write_feature_scene(voxel, &PLAIN, ""));
        for (size_t i = 0; i < sizeof COMMON / sizeof *COMMON; i++)
            expect_arrays(voxel, &COMMON[i], &plain);
        const Feature *own = voxel ? VOXEL : SURFACE;
        size_t count = voxel ? sizeof VOXEL / sizeof *VOXEL : sizeof SURFACE / sizeof *SURFACE;
        for (size_t i = 0; i < count; i++)
            expect_arrays(voxel, &own[i], &plain);
    }
}

// ---------------------------------------------------------------------------------------------
// Two ways to be without

static long long total_bytes(const char *program, const char *scene)
{
    Process daemon;
    explain(&daemon, program, scene);
    const char *at = strstr(daemon.out, "\ntotal: ");
    assert_non_null(at);
    return strtoll(at + 8, NULL, 10);
}

static void expect_within_1_percent(const char *what, long long a, long long b)
{
    if (llabs(a - b) * 100 > (a < b ? a : b))
        fail_msg("%s: %lld and %lld", what, a, b);
    printf("%s: %lld and %lld\n", what, a, b);
}

TEST(switched_off_by_its_key_is_as_left_out)
{
    static const char *const OFF[2] = {
        "levels = 0; start_level = 0; prestress = 0.0; cuttable = false; unsafe_time_step = false; "
        "cavity = { pressure = 0.0; };",
        "cuttable = false; split_budget = 100; unsafe_time_step = false;"};
    const Feature off = {.name = "everything switched off",
                         .head = "gravity = [0.0, 0.0, 0.0]; threads = 1; settle_s = 0.0; "
                                 "publish = { contact_hz = 0.0; contact_stiffness = false; "
                                 "velocity = false; };",
                         .tail = "tools = (); loads = (); attachments = (); touch = ();"};
    for (int voxel = !WITH_SURFACE; voxel <= WITH_VOXEL; voxel++) {
        static Profile without;
        const Profile *plain = plain_profile(voxel);
        const char *scene = write_feature_scene(voxel, &PLAIN, "");
        long long bytes = total_bytes(own_pliantd, scene);
        scene = write_feature_scene(voxel, &off, OFF[voxel]);
        count_steps(&without, own_pliantd, scene, TICKS, NULL);
        expect_within_1_percent("instructions", plain->instructions, without.instructions);
        expect_within_1_percent("bytes", bytes, total_bytes(own_pliantd, scene));
    }
}

// Built by the same compiler since the last change.
static bool is_comparable(const char *folder)
{
    char command[8192];
    snprintf(command, sizeof command,
             "compiler() { sed -n 's/^CMAKE_C_COMPILER:[A-Z]*=//p' \"$1/CMakeCache.txt\"; }; "
             "cd '%s' && [ -x '%s/bin/pliantd' ] && [ -e '%s/built' ] && "
             "[ -z \"$(find server lcmtypes CMakeLists.txt -newer '%s/built')\" ] && "
             "[ \"$(compiler '%s')\" = \"$(compiler '%s')\" ]",
             source_folder, folder, folder, folder, folder, build_folder);
    return system(command) == 0;
}

// The smallest builds (tests/pay_for_use/smallest.sh) lack the other model, HDF5, clients and
// tests.
TEST(a_build_without_it_is_as_one_that_does_not_use_it)
{
    static const Feature RICH = {.name = "tools and loads",
                                 .head = "gravity = [0.0, 0.0, -1.0];",
                                 .tail = LOAD "tools = ( { id = 1; kind = \"static\"; "
                                              "capsules = ( " BALL " ); } );"};
    static const char *const ALSO[2] = {"shape = {}; levels = 1; adapt = {}; cuttable = true;",
                                        "cuttable = true;"};
    bool any = false;
    for (int voxel = !WITH_SURFACE; voxel <= WITH_VOXEL; voxel++) {
        char folder[1024], small_pliantd[1200];
        snprintf(folder, sizeof folder, "%s/build/smallest-%s", source_folder,
                 voxel ? "voxel" : "surface");
        snprintf(small_pliantd, sizeof small_pliantd, "%s/bin/pliantd", folder);
        if (!is_comparable(folder))
            continue;
        any = true;
        for (int rich = 0; rich < 2; rich++) {
            static Profile large, small;
            const char *scene =
                write_feature_scene(voxel, rich ? &RICH : &PLAIN, rich ? ALSO[voxel] : "");
            if (rich)
                count_steps(&large, own_pliantd, scene, TICKS, NULL);
            else
                large = *plain_profile(voxel);
            count_steps(&small, small_pliantd, scene, TICKS, NULL);
            expect_within_1_percent("instructions", large.instructions, small.instructions);
            expect_within_1_percent("bytes", total_bytes(own_pliantd, scene),
                                    total_bytes(small_pliantd, scene));
        }
    }
    if (!any) {
        printf("no smallest build of this compiler that is up to date: "
               "tests/pay_for_use/smallest.sh makes it\n");
        skip();
    }
}

#if WITH_HDF5
// The recording is taken between two ticks, so that what it adds shows around them.
TEST(without_a_recording_none_of_its_functions_is_called)
{
    static const char *const FILES[] = {"io/recording", "io/hdf", "io/checkpoint", NULL};
    static Profile profile;
    const char *record = scratch("record.h5");
    const char *scene = write_feature_scene(!WITH_SURFACE, &PLAIN, "");
    for (int with = 0; with < 2; with++) {
        char arguments[2048];
        snprintf(arguments, sizeof arguments, "--offline 0.02 %s %s %s", with ? "--record" : "",
                 with ? record : "", scene);
        profile_run(&profile, valgrind, own_pliantd, "offline_run", arguments);
        int called = 0;
        for (int i = 0; i < profile.count; i++)
            called += profile.function[i].ours && profile_is_in(profile.function[i].name, FILES);
        assert_int_equal(called > 0, with);
    }
}
#endif
