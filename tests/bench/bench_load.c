// SPDX-License-Identifier: MIT
// From nothing to the end of the first tick, in wall time: of a sheet of 99904 triangles, made by a
// generator in memory, and read from a scene with an OBJ file; of an evenly spread sphere with two
// finer levels, made and divided, and read from a prepared model. Then what `pliant-prepare
// --check` takes of a mesh and of a label volume.
#include "bench.h"
#include "daemon.h"
#include "world.h"

#include "base/clock.h"
#include "scene/build.h"
#include "scene/prepared.h"
#include "geometry/generator.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

static const char NAME[] = "load.start", LEVELS_NAME[] = "load.levels", MESH_NAME[] = "check.mesh",
                  LABELS_NAME[] = "check.labels";

// Returns the number of nodes, 0 after a failure.
static int start_in_memory(int columns, int rows, double *ms, Status *status)
{
    int64_t begin = clock_now_ns();
    TriMesh mesh;
    BenchWorld world = {0};
    BenchWorldOptions options = {
        .integrator = INTEGRATOR_LEAPFROG, .precision = PRECISION_SINGLE, .rate_hz = 1000.0};
    if (!generate_sheet(&mesh, columns, rows, 1.0, 1.0, status))
        return 0;
    bool whole = bench_world_create(&world, &mesh, &options, status);
    if (whole)
        sim_step(world.sim);
    *ms = (double)(clock_now_ns() - begin) * 1e-6;
    int nodes = whole ? mesh.node_count : 0;
    bench_world_destroy(&world);
    mesh_destroy(&mesh);
    return nodes;
}

static bool write_files(const char *folder, int columns, int rows, Status *status)
{
    char path[128];
    TriMesh mesh;
    if (!generate_sheet(&mesh, columns, rows, 1.0, 1.0, status))
        return false;
    snprintf(path, sizeof path, "%s/sheet.obj", folder);
    FILE *file = fopen(path, "w");
    bool whole = file != NULL;
    for (int i = 0; whole && i < mesh.node_count; i++) {
        Vec3 x = mesh.position[i];
        fprintf(file, "v %.9g %.9g %.9g\n", x.x, x.y, x.z);
    }
    for (int t = 0; whole && t < mesh.triangle_count; t++)
        fprintf(file, "f %d %d %d\n", mesh.triangle[t][0] + 1, mesh.triangle[t][1] + 1,
                mesh.triangle[t][2] + 1);
    mesh_destroy(&mesh);
    whole = whole && fclose(file) == 0;
    snprintf(path, sizeof path, "%s/sheet.cfg", folder);
    file = whole ? fopen(path, "w") : NULL;
    whole = file != NULL &&
            fputs("name = \"sheet\";\n"
                  "bodies = ( { name = \"sheet\";  mesh = { file = \"sheet.obj\"; };\n"
                  "    shape = { angular_frequency = 50.0;  damping_ratio = 0.1; }; } );\n",
                  file) >= 0 &&
            fclose(file) == 0;
    return whole ||
           status_fail(status, STATUS_FAILED, "cannot write %s: %s", path, strerror(errno));
}

// Nodes of the only body after the first tick, 0 after a failure.
static int start_scene(const char *folder, const char *name, const char *prepared, double *ms,
                       Status *status)
{
    char path[128], model[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    snprintf(model, sizeof model, "%s/%s", folder, prepared != NULL ? prepared : "");
    int64_t begin = clock_now_ns();
    Scene scene = {0};
    World world = {0};
    BuildOptions options = {.isa = "auto", .prepared = prepared != NULL ? model : NULL};
    int nodes = 0;
    if (scene_read(path, &scene, status) && world_build(&world, &scene, &options, status)) {
        sim_step(world.sim);
        *ms = (double)(clock_now_ns() - begin) * 1e-6;
        nodes = sim_body(world.sim, 0)->surface.node_count;
    }
    world_destroy(&world);
    scene_destroy(&scene);
    return nodes;
}

static void remove_files(const char *folder)
{
    static const char *const files[] = {"sheet.obj", "sheet.cfg", "levels.cfg", "levels.h5"};
    char path[128];
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, files[i]);
        unlink(path);
    }
    rmdir(folder);
}

static void bench_sheet(Bench *bench)
{
    // 2 (columns - 1) (rows - 1) triangles.
    int columns = bench->quick ? 24 : 224, rows = bench->quick ? 25 : 225;
    int repeats = bench->quick ? 1 : 5;
    char folder[64] = "/tmp/pliant-bench-XXXXXX";
    Status status = {0};
    bool whole = mkdtemp(folder) != NULL && write_files(folder, columns, rows, &status);
    Samples memory = {0}, file = {0};
    int nodes = 0;
    for (int r = 0; whole && r < repeats; r++) {
        double ms = 0.0;
        nodes = start_in_memory(columns, rows, &ms, &status);
        samples_add(&memory, ms);
        whole = nodes > 0 && start_scene(folder, "sheet.cfg", NULL, &ms, &status) == nodes;
        samples_add(&file, ms);
    }
    remove_files(folder);
    if (!whole) {
        bench_fail(bench, NAME, status.code != STATUS_OK ? status.text : "another node count");
        return;
    }
    bench_row(bench, NAME, nodes, "wall_ms_generator", samples_min(&memory), "ms");
    bench_row(bench, NAME, nodes, "wall_ms_file", samples_min(&file), "ms");
}

#ifdef PLIANT_WITH_HDF5
// Writes the scene of a sphere that starts at `level`, and its prepared model.
static bool prepare_levels(const char *folder, int nodes, int level, Status *status)
{
    char path[128], model[128];
    snprintf(path, sizeof path, "%s/levels.cfg", folder);
    snprintf(model, sizeof model, "%s/levels.h5", folder);
    FILE *file = fopen(path, "w"), *report = fopen("/dev/null", "w");
    Scene scene = {0};
    bool whole =
        file != NULL && report != NULL &&
        fprintf(file,
                "bodies = ( { name = \"sphere\";  levels = 2;  start_level = %d;  shape = {};\n"
                "    material = { damping_time = 0.0; };\n"
                "    mesh = { generator = \"sphere\";  nodes = %d; }; } );\n",
                level, nodes) > 0;
    if (file != NULL)
        whole = fclose(file) == 0 && whole;
    whole = whole
                ? scene_read(path, &scene, status) && prepared_write(model, &scene, report, status)
                : status_fail(status, STATUS_FAILED, "cannot write %s: %s", path, strerror(errno));
    scene_destroy(&scene);
    if (report != NULL)
        fclose(report);
    return whole;
}

static void bench_start_levels(Bench *bench)
{
    int given = bench->quick ? 642 : 10242, repeats = bench->quick ? 1 : 5;
    for (int level = 0; level <= 2; level += 2) {
        char folder[64] = "/tmp/pliant-bench-XXXXXX";
        Status status = {0};
        bool whole = mkdtemp(folder) != NULL && prepare_levels(folder, given, level, &status);
        Samples made = {0}, read = {0};
        int nodes = 0;
        for (int r = 0; whole && r < repeats; r++) {
            double ms = 0.0;
            nodes = start_scene(folder, "levels.cfg", NULL, &ms, &status);
            samples_add(&made, ms);
            whole =
                nodes > 0 && start_scene(folder, "levels.cfg", "levels.h5", &ms, &status) == nodes;
            samples_add(&read, ms);
        }
        remove_files(folder);
        if (!whole) {
            bench_fail(bench, LEVELS_NAME,
                       status.code != STATUS_OK ? status.text : "another node count");
            return;
        }
        bench_row(bench, LEVELS_NAME, nodes, "wall_ms_made", samples_min(&made), "ms");
        bench_row(bench, LEVELS_NAME, nodes, "wall_ms_prepared", samples_min(&read), "ms");
    }
}
#else
static void bench_start_levels(Bench *bench)
{
    (void)bench; // prepared models are HDF5 files
}
#endif

// A closed surface of 2 `segments` (`segments` - 1) triangles in mm, as a binary STL file.
static bool write_ball(const char *path, int segments)
{
    TriMesh mesh;
    Status status = {0};
    FILE *file = fopen(path, "wb");
    if (file == NULL || !generate_uv_sphere(&mesh, segments, segments, 40.0, &status)) {
        if (file != NULL)
            fclose(file);
        return false;
    }
    const char head[80] = "a ball";
    const uint32_t count = (uint32_t)mesh.triangle_count;
    fwrite(head, sizeof head, 1, file);
    fwrite(&count, sizeof count, 1, file);
    for (int t = 0; t < mesh.triangle_count; t++) {
        float corners[12] = {0.0f}; // the normal first, which readers work out themselves
        for (int k = 0; k < 3; k++) {
            const Vec3 x = mesh.position[mesh.triangle[t][k]];
            corners[3 + 3 * k] = (float)x.x;
            corners[4 + 3 * k] = (float)x.y;
            corners[5 + 3 * k] = (float)x.z;
        }
        fwrite(corners, sizeof corners, 1, file);
        fwrite("\0", 2, 1, file);
    }
    mesh_destroy(&mesh);
    return fclose(file) == 0;
}

// A ball of labels that fills most of n^3 voxels of 0.5 mm, as an NRRD file.
static bool write_labels(const char *path, int n)
{
    FILE *file = fopen(path, "wb");
    unsigned char *row = calloc(1, (size_t)n);
    if (file == NULL || row == NULL) {
        free(row);
        if (file != NULL)
            fclose(file);
        return false;
    }
    fprintf(file,
            "NRRD0005\ntype: uint8\ndimension: 3\nsizes: %d %d %d\nspace: left-posterior-superior\n"
            "space directions: (0.5,0,0) (0,0.5,0) (0,0,0.5)\nencoding: raw\n\n",
            n, n, n);
    const int middle = n / 2, radius = 2 * n / 5;
    for (int z = -middle; z < n - middle; z++)
        for (int y = -middle; y < n - middle; y++) {
            for (int x = 0; x < n; x++)
                row[x] = (x - middle) * (x - middle) + y * y + z * z < radius * radius ? 1 : 0;
            fwrite(row, 1, (size_t)n, file);
        }
    free(row);
    return fclose(file) == 0;
}

// Runs `pliant-prepare --check` beside this program. Its highest memory is not read where this
// program's own is higher, which a child begins with.
static bool run_check(const char *path, struct rusage *used)
{
    char program[4096];
    const char *daemon = daemon_path();
    if (daemon == NULL)
        return false;
    snprintf(program, sizeof program, "%.*s/pliant-prepare", (int)(strrchr(daemon, '/') - daemon),
             daemon);
    const pid_t child = fork();
    if (child == 0) {
        const int null = open("/dev/null", O_WRONLY);
        dup2(null, STDOUT_FILENO);
        dup2(null, STDERR_FILENO);
        execl(program, program, "--check", path, (char *)NULL);
        _exit(127);
    }
    int how = 0;
    return child > 0 && wait4(child, &how, 0, used) == child && how == 0;
}

static double cpu_ms(const struct rusage *used)
{
    return 1e3 * (double)(used->ru_utime.tv_sec + used->ru_stime.tv_sec) +
           1e-3 * (double)(used->ru_utime.tv_usec + used->ru_stime.tv_usec);
}

// `size`: triangles or voxels.
static void bench_check(Bench *bench, const char *name, const char *path, bool written, int size)
{
    Samples ms = {0};
    struct rusage own, used = {0};
    bool whole = written;
    for (int r = 0; whole && r < (bench->quick ? 1 : 3); r++) {
        whole = run_check(path, &used);
        samples_add(&ms, cpu_ms(&used));
    }
    unlink(path);
    if (!whole) {
        bench_fail(bench, name, "pliant-prepare --check did not find the file usable");
        return;
    }
    bench_row(bench, name, size, "ms_cpu", samples_min(&ms), "ms");
    getrusage(RUSAGE_SELF, &own);
    if (used.ru_maxrss > own.ru_maxrss)
        bench_row(bench, name, size, "mb_at_most", (double)used.ru_maxrss / 1024.0, "MB");
}

static void bench_checks(Bench *bench)
{
    char path[64];
    const int segments = bench->quick ? 24 : 317, n = bench->quick ? 20 : 200;
    if (bench_wants(bench, MESH_NAME)) {
        snprintf(path, sizeof path, "/tmp/pliant-bench-%d.stl", (int)getpid());
        bench_check(bench, MESH_NAME, path, write_ball(path, segments),
                    2 * segments * (segments - 1));
    }
#ifdef PLIANT_WITH_VOXEL
    if (bench_wants(bench, LABELS_NAME)) {
        snprintf(path, sizeof path, "/tmp/pliant-bench-%d.nrrd", (int)getpid());
        bench_check(bench, LABELS_NAME, path, write_labels(path, n), n * n * n);
    }
#else
    (void)n;
#endif
}

void bench_load(Bench *bench)
{
    if (bench_wants(bench, NAME))
        bench_sheet(bench);
    if (bench_wants(bench, LEVELS_NAME))
        bench_start_levels(bench);
    bench_checks(bench);
}
