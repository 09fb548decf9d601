// What a scene does not need costs nothing: pairs of scenes that differ in one feature. Thread CPU
// time a step, interleaved; bytes a node of what steps and contacts use; and, with valgrind,
// instructions a step of the real pliantd (in whose AVX2 kernels valgrind can look).
#include "bench.h"
#include "daemon.h"

#include "base/clock.h"
#include "files/build.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { WITH, WITHOUT };
static const double RATE = 2000.0; // [Hz]: one step of 0.5 ms a tick

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
    {"prestress", {DAMPED, DAMPED}, {SHAPE " prestress = 0.05;", SHAPE}, {"", ""}},
    {"tool", {DAMPED, DAMPED}, {SHAPE, SHAPE}, {TOOL, ""}},
    {"load", {DAMPED, DAMPED}, {SHAPE, SHAPE}, {LOAD, ""}},
    {"levels", {DAMPED, DAMPED}, {SHAPE LEVELS, SHAPE}, {"", ""}},
};

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

// Instructions that valgrind counts over a run of so many ticks; 0 without a count.
static double count_instructions(const char *path, int ticks)
{
    char command[4608], line[256];
    double count = 0.0;
    snprintf(command, sizeof command,
             "valgrind --tool=callgrind --callgrind-out-file=/dev/null '%s' --log-level error "
             "--offline %.9g '%s' 2>&1",
             daemon_path(), ticks / RATE, path);
    FILE *out = popen(command, "r");
    while (out != NULL && fgets(line, sizeof line, out) != NULL) {
        const char *found = strstr(line, "Collected : ");
        if (found != NULL)
            count = strtod(found + strlen("Collected : "), NULL);
    }
    return out != NULL && pclose(out) == 0 ? count : 0.0;
}

// The difference of a longer and a shorter run is steps only.
static void row_instructions(Bench *bench, const char *name, const char *path, int nodes)
{
    enum { SHORT = 50, LONG = 150 };
    double few = count_instructions(path, SHORT), many = count_instructions(path, LONG);
    if (few > 0.0 && many > few)
        bench_row(bench, name, nodes, "instructions_per_step", (many - few) / (LONG - SHORT), "1");
    else
        bench_fail(bench, name, "valgrind gave no count");
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
        if (instructions)
            row_instructions(bench, name[k], path[k], nodes);
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
    if (any && !instructions)
        bench_skip(bench, "pair: instructions_per_step", "no valgrind here");
    if (bench_wants(bench, "bytes.rk4"))
        run_bytes(bench);
}
