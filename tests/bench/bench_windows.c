// SPDX-License-Identifier: MIT
// What it costs that a voxel body can be cut: forces of a graded cube from the windows of a
// cuttable body against those from the batches of others, the same elements; then what dividing an
// element costs while a blade goes through the cube, the packing of the batches included.
#include "bench.h"

#include "base/check.h"
#include "base/clock.h"
#include "voxel/batch.h"
#include "voxel/cut/cut_windows.h"
#include "voxel/lattice_mesh.h"
#include "voxel/layout.h"
#include "voxel/template.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double SIZE = 3.125e-3;
enum { LEVELS = 2 };

typedef struct BatchBody {
    Arena arena;
    StateList state;
    Layout layout;
    LatticeMesh mesh;
    ElementClass classes[LEVELS + 1]; // by level
    Batches batches;
    CutLattice lattice;
    TemplateCache templates;
    CutWindows windows;
    const VoxelKernels *kernels;
    VoxelPass pass;
} BatchBody;

static bool create_elements(BatchBody *body, int cells, int levels, int budget, Status *status)
{
    Lattice lattice = {0};
    if (!lattice_box(&lattice, (int[3]){cells, cells, cells}, SIZE, status))
        return false;
    layout_create(&body->layout, &lattice, levels);
    lattice_destroy(&lattice);
    for (int level = 0; level <= LEVELS; level++) {
        const double size = SIZE * (1 << level), mu = 5e3;
        body->classes[level] =
            (ElementClass){size, mu, 0.0, mu * size / 3.0, 3e-4 * mu * size, 1.0};
    }
    if (!lattice_mesh_create(&body->mesh, &body->layout, status))
        return false;
    const VoxelOptions options = {.body = {.name = "bench"}, .split_budget = budget};
    const VoxelMaking making = {.options = &options,
                                .layout = body->layout,
                                .mesh = body->mesh,
                                .capacity = 4 * (cells + 1) * (cells + 1) * (cells + 1)};
    return cut_lattice_create(&body->lattice, &making, &body->arena, &body->state, status);
}

static void create_batches(BatchBody *body)
{
    const int count = body->layout.leaf_count;
    int *level = calloc((size_t)count, sizeof *level);
    ASSERT(level != NULL);
    for (int e = 0; e < count; e++)
        level[e] = body->layout.leaf[e].level;
    const BatchOptions options = {
        "bench", count,         (const int(*)[NODE_COUNT])body->mesh.vertex,
        level,   body->classes, body->mesh.vertex_count};
    batches_create(&body->batches, &options, &body->arena);
    free(level);
}

static void create_pass(BatchBody *body, Precision precision)
{
    const size_t rows = (size_t)body->lattice.vertex_capacity + 1,
                 real = precision == PRECISION_SINGLE ? sizeof(float) : sizeof(double);
    void *row = arena_allocate(&body->arena, ARENA_STEP, rows * ROW, real, "rows");
    const int batches = batches_total(&body->batches);
    double(*last)[LANES][4] =
        arena_allocate(&body->arena, ARENA_STEP, (size_t)batches, sizeof *last, "last rotations");
    for (int i = 0; i < batches * LANES; i++)
        last[i / LANES][i % LANES][0] = 1.0;
    for (int i = 0; i < body->mesh.vertex_count * ROW; i++) {
        const double value = i % 4 == 3 ? 0.0 : 0.05 * SIZE * sin(12.9 * i);
        if (precision == PRECISION_SINGLE)
            ((float *)row)[i] = (float)value;
        else
            ((double *)row)[i] = value;
    }
    body->pass = (VoxelPass){
        .plain = &body->batches.plain,
        .hanging = &body->batches.hanging,
        .tables =
            voxel_tables_create(&body->batches, VOXEL_AFFINE, precision, "bench", &body->arena),
        .classes = body->batches.classes,
        .damped = true,
        .rows = row,
        .force = arena_allocate(&body->arena, ARENA_STEP, rows * 4, real, "forces"),
        .last = last,
        .stiffness_scale = 1.0,
        .damping_scale = 1.0,
    };
}

static bool body_create(BatchBody *body, int cells, int levels, int budget, Precision precision,
                        const char *isa, Status *status)
{
    *body = (BatchBody){.kernels = voxel_kernels_find(precision, isa)};
    if (!create_elements(body, cells, levels, budget, status))
        return false;
    create_batches(body);
    template_cache_create(&body->templates, "bench", VOXEL_AFFINE, precision, &body->arena);
    const WindowOptions options = {.name = "bench",
                                   .kernels = body->kernels,
                                   .lattice = &body->lattice,
                                   .templates = &body->templates,
                                   .material_count = 1,
                                   .classes = body->classes};
    cut_windows_create(&body->windows, &options, &body->arena, &body->state);
    create_pass(body, precision);
    return true;
}

static void body_destroy(BatchBody *body)
{
    arena_destroy(&body->arena);
    state_destroy(&body->state);
    lattice_mesh_destroy(&body->mesh);
    layout_destroy(&body->layout);
}

static void run_forces(Bench *bench, const char *name, int cells, int levels, Precision precision)
{
    BatchBody body;
    Status status = {0};
    if (!body_create(&body, cells, levels, 16, precision, bench->isa, &status)) {
        bench_fail(bench, name, status.text);
        return;
    }
    const int repeats = bench->quick ? 3 : 40, steps = 100000 / body.layout.leaf_count + 1;
    Samples dense = {0}, windows = {0};
    for (int r = -1; r < repeats; r++) {
        int64_t begin = clock_thread_ns();
        for (int i = 0; i < steps; i++)
            body.kernels->evaluate(&body.pass);
        int64_t middle = clock_thread_ns();
        for (int i = 0; i < steps; i++)
            batch_runs_evaluate(&body.windows.runs, &body.pass, BATCHES_ALL);
        int64_t end = clock_thread_ns();
        if (r < 0)
            continue;
        samples_add(&dense, (double)(middle - begin) * 1e-3 / steps);
        samples_add(&windows, (double)(end - middle) * 1e-3 / steps);
    }
    const double least = samples_min(&windows);
    bench_row(bench, name, body.mesh.vertex_count, "us_per_evaluation", least, "us");
    bench_row(bench, name, body.mesh.vertex_count, "ratio_to_uncuttable",
              least / samples_min(&dense), "1");
    body_destroy(&body);
}

// What a tick pays for looking whether anything tears, with nothing near it.
static void run_tearing(Bench *bench, int cells, Precision precision)
{
    static const char *const name[2] = {
        [PRECISION_DOUBLE] = "voxel.tear.double", [PRECISION_SINGLE] = "voxel.tear.single"};
    BatchBody body;
    Status status = {0};
    if (!bench_wants(bench, name[precision]))
        return;
    if (!body_create(&body, cells, LEVELS, 16, precision, bench->isa, &status)) {
        bench_fail(bench, name[precision], status.text);
        return;
    }
    const CutWindows *windows = &body.windows;
    const int batches = batch_runs_capacity(&windows->runs);
    int *element = calloc((size_t)body.lattice.element_count, sizeof *element);
    uint16_t *high = calloc((size_t)batches, sizeof *high);
    ASSERT(element != NULL && high != NULL);
    Samples samples = {0};
    for (int r = -1; r < (bench->quick ? 3 : 40); r++) {
        int64_t begin = clock_thread_ns();
        batch_runs_stress(&windows->runs, &body.pass, 1e6, BATCHES_ALL, high);
        int found = cut_windows_stressed(windows, high, element);
        int64_t end = clock_thread_ns();
        if (found > 0)
            bench_fail(bench, name[precision], "a strain of 0.2 gives no such stress");
        if (r >= 0)
            samples_add(&samples, (double)(end - begin) * 1e-3);
    }
    const double least = samples_min(&samples);
    bench_row(bench, name[precision], body.mesh.vertex_count, "us_per_tick", least, "us");
    bench_row(bench, name[precision], body.mesh.vertex_count, "ns_per_element",
              1e3 * least / body.layout.leaf_count, "ns");
    free(element);
    free(high);
    body_destroy(&body);
}

// All faces of the plane x = cells / 2 with y below `row`, of a half of the cube's height.
static void break_row(BatchBody *body, int cells, int row)
{
    int face[64][2], count = 0;
    for (int z = 0; z < cells; z++) {
        face[count][0] = cut_lattice_cell(&body->lattice, cells / 2 - 1, row, z);
        face[count++][1] = 0;
    }
    cut_lattice_break(&body->lattice, (const int(*)[2])face, count);
}

// A row of faces at a time, with what has to be divided for it within the budget.
static void run_divisions(Bench *bench, int cells, int budget)
{
    static const char name[] = "voxel.windows.divide";
    Samples mean = {0}, packing = {0}, worst = {0};
    int vertices = 0;
    for (int r = bench->quick ? -1 : -2; r < (bench->quick ? 1 : 10); r++) {
        BatchBody body;
        Status status = {0};
        if (!body_create(&body, cells, LEVELS, budget, PRECISION_SINGLE, bench->isa, &status)) {
            bench_fail(bench, name, status.text);
            return;
        }
        vertices = body.mesh.vertex_count;
        int64_t total = 0, packed = 0, most = 0;
        int divided = 0;
        for (int row = 0; row < cells / 2; row++) {
            cut_lattice_forget_changes(&body.lattice);
            break_row(&body, cells, row);
            cut_windows_update(&body.windows);
            for (int count = 1; count > 0; divided += count) {
                cut_lattice_forget_changes(&body.lattice);
                int64_t begin = clock_thread_ns();
                count = cut_lattice_reconstruct(&body.lattice);
                int64_t middle = clock_thread_ns();
                cut_windows_update(&body.windows);
                int64_t end = clock_thread_ns();
                total += end - begin;
                packed += end - middle;
                if (end - begin > most * (count > 1 ? count : 1))
                    most = (end - begin) / (count > 1 ? count : 1);
            }
        }
        body_destroy(&body);
        if (r < 0 || divided == 0)
            continue;
        samples_add(&mean, (double)total * 1e-3 / divided);
        samples_add(&packing, (double)packed * 1e-3 / divided);
        samples_add(&worst, (double)most * 1e-3);
    }
    char metric[64];
    snprintf(metric, sizeof metric, "us_per_division_%d_a_tick", budget);
    bench_row(bench, name, vertices, metric, samples_min(&mean), "us");
    snprintf(metric, sizeof metric, "us_of_packing_%d_a_tick", budget);
    bench_row(bench, name, vertices, metric, samples_min(&packing), "us");
    snprintf(metric, sizeof metric, "worst_tick_us_per_division_%d_a_tick", budget);
    bench_row(bench, name, vertices, metric, samples_min(&worst), "us");
}

void bench_windows(Bench *bench)
{
    static const char *const name[2][2] = {
        [PRECISION_DOUBLE] = {"voxel.windows.double.level0", "voxel.windows.double"},
        [PRECISION_SINGLE] = {"voxel.windows.single.level0", "voxel.windows.single"}};
    const int most = bench->quick ? 16 : 32;
    for (int precision = 0; precision < 2; precision++)
        for (int graded = 0; graded < 2; graded++)
            for (int cells = 16; cells <= most; cells *= 2)
                if (bench_wants(bench, name[precision][graded]))
                    run_forces(bench, name[precision][graded], cells, graded ? LEVELS : 0,
                               (Precision)precision);
    for (int precision = 0; precision < 2; precision++)
        run_tearing(bench, most, (Precision)precision);
    if (bench_wants(bench, "voxel.windows.divide"))
        for (int budget = 1; budget <= 16; budget *= 16)
            run_divisions(bench, most, budget);
}
