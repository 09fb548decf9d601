// SPDX-License-Identifier: MIT
// What a feature costs, and that leaving it out costs nothing (tests/pay_for_use proves that):
// pairs of scenes that differ in one feature, pairs of command lines, and a pair of builds. Thread
// CPU time a step, interleaved; bytes a node of what steps and contacts use; all bytes that pliantd
// --explain lists; and, with valgrind, instructions a step of the real pliantd (in whose AVX2
// kernels valgrind can look).
#include "bench.h"
#include "daemon.h"

#include "base/clock.h"
#include "scene/build.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { WITH, WITHOUT };
static const double RATE = 2000.0; // [Hz]: one step of 0.5 ms per tick

typedef struct Pair {
    const char *name;        // of the feature
    const char *material[2]; // of the body: with, without
    const char *shape[2];
    const char *scene[2]; // other groups of the scene
} Pair;

#define SHAPE  "shape = { angular_frequency = 50.0;  damping_ratio = 0.1; };"
#define FRAME  "shape = { angular_frequency = 50.0;  damping_ratio = 0.1;  frame = \"body\"; };"
#define DAMPED "material = { damping_time = 1.0e-4; };"
#define FREE   "material = { damping_time = 0.0; };"
// So thin that the step of 0.5 ms stays stable.
#define BENDS "material = { damping_time = 1.0e-4;  thickness = 1.0e-4; };"
// At rest nothing is refined: what is left is looking.
#define LEVELS " levels = 1;  adapt = {};"
#define TOOL                                                                                       \
    "tools = ( { id = 1;  kind = \"probe\";  max_force = 3.3;  capsules = ( "                      \
    "{ from = [0.0, 0.0, 0.0];  to = [0.0, 0.0, 0.1];  radius = 0.005; } ); } );"
#define LOAD                                                                                       \
    "loads = ( { start = 0.0;  duration = 1000.0;  center = [0.0, 0.0, 0.2];  radius = 0.05;  "    \
    "force = [0.0, 0.0, 0.1]; } );"

static const Pair pairs[] = {
    {"shape", {DAMPED, DAMPED}, {SHAPE, ""}, {"", ""}},
    {"frame", {DAMPED, DAMPED}, {FRAME, SHAPE}, {"", ""}},
    {"damping", {DAMPED, FREE}, {SHAPE, SHAPE}, {"", ""}},
    {"bending", {BENDS, DAMPED}, {SHAPE, SHAPE}, {"", ""}},
    {"prestress", {DAMPED, DAMPED}, {SHAPE " prestress = 0.05;", SHAPE}, {"", ""}},
    {"tool", {DAMPED, DAMPED}, {SHAPE, SHAPE}, {TOOL, ""}},
    {"load", {DAMPED, DAMPED}, {SHAPE, SHAPE}, {LOAD, ""}},
    {"levels", {DAMPED, DAMPED}, {SHAPE LEVELS, SHAPE}, {"", ""}},
    {"adapt", {DAMPED, DAMPED}, {SHAPE LEVELS, SHAPE " levels = 1;"}, {"", ""}},
    {"cuttable", {DAMPED, DAMPED}, {SHAPE " cuttable = true;", SHAPE}, {"", ""}},
};

// One scene, run in two ways.
static const Pair same = {"same", {DAMPED, DAMPED}, {SHAPE, SHAPE}, {"", ""}};

// A way to run a scene.
typedef struct Way {
    const char *pliantd;
    const char *path; // of the scene
    char record[64];  // file, or ""
} Way;

// Builds one scene of a pair. `path` receives its file, to be unlinked by the caller, or is NULL.
static bool build(const Pair *pair, int which, int nodes, double rate, const BuildOptions *options,
                  World *world, char path[64], Status *status)
{
    char text[1024], file[64];
    Scene scene = {0};
    snprintf(text, sizeof text,
             "name = \"pair\";\nrate_hz = %g;\n%s\n"
             "bodies = ( { name = \"ball\";  time_step = 0.0005;\n"
             "    mesh = { generator = \"ico_sphere\";  nodes = %d;  radius = 0.2; };\n"
             "    %s\n    %s } );\n",
             rate, pair->scene[which], nodes, pair->material[which], pair->shape[which]);
    if (!daemon_write_scene(text, file, sizeof file))
        return status_fail(status, STATUS_FAILED, "cannot write a scene");
    bool whole = scene_read(file, &scene, status) && world_build(world, &scene, options, status);
    scene_destroy(&scene);
    if (path != NULL && whole)
        memcpy(path, file, sizeof file);
    else
        unlink(file);
    return whole;
}

static void row_bytes(Bench *bench, const char *name, int nodes, const World *world)
{
    size_t bytes =
        arena_bytes_of(&world->arena, ARENA_STEP) + arena_bytes_of(&world->arena, ARENA_CONTACT);
    bench_row(bench, name, nodes, "bytes_per_node", (double)bytes / nodes, "B");
}

static double time_steps(Sim *sim, int steps)
{
    int64_t begin = clock_thread_ns();
    for (int i = 0; i < steps; i++)
        sim_step(sim);
    return (double)(clock_thread_ns() - begin) * 1e-3 / steps;
}

static void unlink_recording(const Way *way)
{
    char beside[80];
    if (way->record[0] == '\0')
        return;
    snprintf(beside, sizeof beside, "%s.xdmf", way->record);
    unlink(way->record);
    unlink(beside);
}

// The number behind `word` in what a command prints; 0 without one, or when it fails.
static double printed_number(const char *command, const char *word)
{
    char line[256];
    double number = 0.0;
    FILE *out = popen(command, "r");
    while (out != NULL && fgets(line, sizeof line, out) != NULL) {
        const char *found = strstr(line, word);
        if (found != NULL)
            number = strtod(found + strlen(word), NULL);
    }
    return out != NULL && pclose(out) == 0 ? number : 0.0;
}

// Instructions that valgrind counts over a run of so many ticks; 0 without a count.
static double count_instructions(const Way *way, int ticks)
{
    char command[9216];
    snprintf(command, sizeof command,
             "valgrind --tool=callgrind --callgrind-out-file=/dev/null '%s' --log-level error "
             "--offline %.9g %s %s '%s' 2>&1",
             way->pliantd, ticks / RATE, way->record[0] != '\0' ? "--record" : "", way->record,
             way->path);
    unlink_recording(way);
    double count = printed_number(command, "Collected : ");
    unlink_recording(way);
    return count;
}

// The difference of a longer and a shorter run is steps only.
static void row_instructions(Bench *bench, const char *name, const Way *way, int nodes)
{
    enum { SHORT = 50, LONG = 150 };
    double few = count_instructions(way, SHORT), many = count_instructions(way, LONG);
    if (few > 0.0 && many > few)
        bench_row(bench, name, nodes, "instructions_per_step", (many - few) / (LONG - SHORT), "1");
    else
        bench_fail(bench, name, "valgrind gave no count");
}

// Of a live run, its threads' part too.
static void row_all_bytes(Bench *bench, const char *name, const Way *way, int nodes)
{
    char command[9216];
    snprintf(command, sizeof command, "'%s' --log-level error --explain %s %s '%s' 2>&1",
             way->pliantd, way->record[0] != '\0' ? "--record" : "", way->record, way->path);
    double bytes = printed_number(command, "total: ");
    if (bytes > 0.0)
        bench_row(bench, name, nodes, "bytes_live", bytes, "B");
    else
        bench_fail(bench, name, "pliantd --explain gave no total");
}

// The same scene in two ways.
static void run_ways(Bench *bench, const char *feature, Way way[2], int nodes, bool instructions)
{
    char path[64] = "", name[48];
    World world = {0};
    Status status = {0};
    const BuildOptions options = {.isa = bench->isa};
    bool whole = build(&same, WITH, nodes, RATE, &options, &world, path, &status);
    world_destroy(&world);
    if (!whole)
        bench_fail(bench, feature, status.text);
    for (int k = WITH; k <= WITHOUT && whole; k++) {
        way[k].path = path;
        snprintf(name, sizeof name, "pair.%s.%s", feature, k == WITH ? "with" : "without");
        row_all_bytes(bench, name, &way[k], nodes);
        if (instructions)
            row_instructions(bench, name, &way[k], nodes);
    }
    if (path[0] != '\0')
        unlink(path);
}

static void run_recording(Bench *bench, int nodes, bool instructions)
{
#ifdef PLIANT_WITH_HDF5
    Way way[2] = {{.pliantd = daemon_path()}, {.pliantd = daemon_path()}};
    snprintf(way[WITH].record, sizeof way[WITH].record, "/tmp/pliant-bench-%d.h5", (int)getpid());
    run_ways(bench, "recording", way, nodes, instructions);
#else
    (void)nodes;
    (void)instructions;
    bench_skip(bench, "pair.recording", "built without HDF5");
#endif
}

// This build, which has the other model, HDF5, clients and tests, and the smallest one.
static void run_models(Bench *bench, int nodes, bool instructions)
{
    char smallest[4352];
    const char *own = daemon_path(), *bin = strstr(own, "/build/");
    snprintf(smallest, sizeof smallest, "%.*s/build/smallest-surface/bin/pliantd",
             bin != NULL ? (int)(bin - own) : 0, own);
    if (access(smallest, X_OK) != 0) {
        bench_skip(bench, "pair.models",
                   "no smallest build: tests/pay_for_use/smallest.sh makes it");
        return;
    }
    Way way[2] = {{.pliantd = own}, {.pliantd = smallest}};
    run_ways(bench, "models", way, nodes, instructions);
}

static void run_pair(Bench *bench, const Pair *pair, int nodes, bool instructions)
{
    char path[2][64] = {"", ""}, name[2][48];
    World world[2] = {0};
    Samples samples[2] = {0};
    Status status = {0};
    const BuildOptions options = {.isa = bench->isa};
    bool whole = true;
    for (int k = WITH; k <= WITHOUT && whole; k++)
        whole = build(pair, k, nodes, RATE, &options, &world[k], path[k], &status);
    if (!whole)
        bench_fail(bench, pair->name, status.text);
    for (int r = -1; r < (bench->quick ? 3 : 25) && whole; r++) // the first round warms up
        for (int k = WITH; k <= WITHOUT; k++) {
            double us = time_steps(world[k].sim, 40000 / nodes + 1);
            if (r >= 0)
                samples_add(&samples[k], us);
        }
    for (int k = WITH; k <= WITHOUT && whole; k++) {
        snprintf(name[k], sizeof name[k], "pair.%s.%s", pair->name, k == WITH ? "with" : "without");
        bench_row(bench, name[k], nodes, "us_per_step", samples_min(&samples[k]), "us");
        row_bytes(bench, name[k], nodes, &world[k]);
        const Way way = {.pliantd = daemon_path(), .path = path[k]};
        if (way.pliantd != NULL)
            row_all_bytes(bench, name[k], &way, nodes);
        if (instructions)
            row_instructions(bench, name[k], &way, nodes);
    }
    for (int k = WITH; k <= WITHOUT; k++) {
        world_destroy(&world[k]);
        if (path[k][0] != '\0')
            unlink(path[k]);
    }
}

// Step and contact arrays of the body for which a limit is set: 10242 nodes by RK4 in single
// precision, one probe, loads by message.
static void run_bytes(Bench *bench)
{
    static const Pair rk4 = {
        "rk4", {DAMPED, NULL}, {SHAPE " integrator = \"rk4\";", NULL}, {TOOL, NULL}};
    const int nodes = 10242;
    World world = {0};
    Status status = {0};
    const BuildOptions options = {.isa = bench->isa, .may_load = true};
    if (build(&rk4, WITH, nodes, 1000.0, &options, &world, NULL, &status))
        row_bytes(bench, "bytes.rk4", nodes, &world);
    else
        bench_fail(bench, "bytes.rk4", status.text);
    world_destroy(&world);
}

void bench_pairs(Bench *bench)
{
    bool instructions = daemon_path() != NULL && system("valgrind --version >/dev/null 2>&1") == 0;
    bool any = false;
    for (size_t k = 0; k < sizeof pairs / sizeof *pairs; k++) {
        char name[48];
        snprintf(name, sizeof name, "pair.%s", pairs[k].name);
        if (!bench_wants(bench, name))
            continue;
        any = true;
        // Few nodes where valgrind looks: it takes a hundred times as long.
        run_pair(bench, &pairs[k], bench->quick ? 642 : 2562, instructions && !bench->quick);
    }
    const int nodes = bench->quick ? 642 : 2562;
    const bool counts = instructions && !bench->quick;
    if (daemon_path() != NULL && bench_wants(bench, "pair.recording")) {
        any = true;
        run_recording(bench, nodes, counts);
    }
    if (daemon_path() != NULL && bench_wants(bench, "pair.models")) {
        any = true;
        run_models(bench, nodes, counts);
    }
    if (any && !instructions)
        bench_skip(bench, "pair: instructions_per_step", "no valgrind here");
    if (bench_wants(bench, "bytes.rk4"))
        run_bytes(bench);
}
