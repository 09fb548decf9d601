// From nothing to the end of the first tick for a sheet of 99904 triangles: made by a generator in
// memory, and read from a scene with an OBJ file. Wall time.
#include "bench.h"
#include "world.h"

#include "base/clock.h"
#include "files/build.h"
#include "geometry/generator.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char NAME[] = "load.start";

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

static int start_from_file(const char *folder, double *ms, Status *status)
{
    char path[128];
    snprintf(path, sizeof path, "%s/sheet.cfg", folder);
    int64_t begin = clock_now_ns();
    Scene scene = {0};
    World world = {0};
    BuildOptions options = {.isa = "auto"};
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
    static const char *const files[] = {"sheet.obj", "sheet.cfg"};
    char path[128];
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, files[i]);
        unlink(path);
    }
    rmdir(folder);
}

void bench_load(Bench *bench)
{
    if (!bench_wants(bench, NAME))
        return;
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
        whole = nodes > 0 && start_from_file(folder, &ms, &status) == nodes;
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
