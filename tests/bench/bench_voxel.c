// SPDX-License-Identifier: MIT
// Voxel elements: the server's kernels in both precisions against the textbook's element, whole
// steps (forces, damping, semi-implicit Euler) of cubes of 16^3 and 32^3 elements that stand on
// their lowest layer. All begin in the same state, take turns, and must move alike. Then the
// elements with hanging vertices of a graded cube by themselves, and that cube's whole step.
#include "bench.h"
#include "voxel_textbook.h"

#include "base/check.h"
#include "base/clock.h"
#include "body/kernel.h"
#include "voxel/batch.h"
#include "voxel/lattice_mesh.h"
#include "voxel/layout.h"
#include "voxel/template.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double SIZE = 3.125e-3, YOUNGS_MODULUS = 1e4, DENSITY = 1000.0;
static const double GRAVITY[3] = {0.0, 0.0, -9.81};

// A cube's elements, and what stands at its vertices.
typedef struct Cube {
    int element_count, vertex_count;
    int (*vertex)[NODE_COUNT];
    ElementClass classes[VOXEL_LEVELS_MAX + 1]; // by level
    int *level;                                 // [element]
    double (*place)[3], (*velocity)[3], *mass;  // [vertex]
    bool *fixed;
    double h, beta; // [s]
} Cube;

// A cube in the hands of a kernel.
typedef struct Machine {
    const VoxelKernels *kernels;
    const VertexKernels *vertex_kernels;
    Arena arena;
    Batches batches;
    VoxelPass pass;
    AdvancePass advance;
} Machine;

static void *allocate(size_t count, size_t size)
{
    void *memory = calloc(count, size);
    ASSERT(memory != NULL);
    return memory;
}

static void cube_destroy(Cube *cube)
{
    free(cube->vertex);
    free(cube->level);
    free(cube->place);
    free(cube->velocity);
    free(cube->mass);
    free(cube->fixed);
}

static void set_vertices(Cube *cube, const LatticeMesh *mesh)
{
    size_t count = (size_t)mesh->vertex_count;
    cube->place = allocate(count, sizeof *cube->place);
    cube->velocity = allocate(count, sizeof *cube->velocity);
    cube->mass = allocate(count, sizeof *cube->mass);
    cube->fixed = allocate(count, sizeof *cube->fixed);
    for (int i = 0; i < mesh->vertex_count; i++) {
        cube->fixed[i] = mesh->point[i][2] == 0;
        for (int c = 0; c < 3; c++) {
            cube->place[i][c] = SIZE * mesh->point[i][c];
            // Neighbours move against each other by up to 10 mm/s, so that every element works.
            cube->velocity[i][c] =
                cube->fixed[i] ? 0.0 : 1e-2 * sin(12.9 * i + 78.2 * c + 3.1 * i * c);
        }
    }
    for (int e = 0; e < cube->element_count; e++) {
        Template t;
        const double size = SIZE * (1 << cube->level[e]);
        template_create(&t, template_mask_of(mesh->vertex[e]));
        for (int n = 0; n < t.count; n++)
            cube->mass[cube->vertex[e][t.node[n]]] +=
                DENSITY * size * size * size * t.weight[n] / 8.0;
    }
}

static bool cube_create(Cube *cube, int cells, int levels, Status *status)
{
    *cube = (Cube){0};
    Lattice lattice = {0};
    Layout layout;
    LatticeMesh mesh;
    if (!lattice_box(&lattice, (int[3]){cells, cells, cells}, SIZE, status))
        return false;
    layout_create(&layout, &lattice, levels);
    bool whole = lattice_mesh_create(&mesh, &layout, status);
    if (whole) {
        cube->element_count = mesh.element_count;
        cube->vertex_count = mesh.vertex_count;
        cube->vertex = allocate((size_t)cube->element_count, sizeof *cube->vertex);
        cube->level = allocate((size_t)cube->element_count, sizeof *cube->level);
        memcpy(cube->vertex, mesh.vertex, (size_t)cube->element_count * sizeof *cube->vertex);
        for (int e = 0; e < cube->element_count; e++)
            cube->level[e] = layout.leaf[e].level;
        set_vertices(cube, &mesh);
        const double dt0 = SIZE * sqrt(DENSITY / YOUNGS_MODULUS);
        cube->h = 0.6 * dt0;
        cube->beta = 0.2 * dt0;
        for (int level = 0; level <= VOXEL_LEVELS_MAX; level++) {
            const double size = SIZE * (1 << level), mu = 0.5 * YOUNGS_MODULUS;
            cube->classes[level] =
                (ElementClass){size, mu, 0.0, mu * size / 3.0, cube->beta * mu * size, 1.0};
        }
        lattice_mesh_destroy(&mesh);
    }
    layout_destroy(&layout);
    lattice_destroy(&lattice);
    return whole;
}

static void put(const Machine *m, void *to, long at, double value)
{
    if (m->kernels->precision == PRECISION_SINGLE)
        ((float *)to)[at] = (float)value;
    else
        ((double *)to)[at] = value;
}

static double get(const Machine *m, const void *from, long at)
{
    return m->kernels->precision == PRECISION_SINGLE ? (double)((const float *)from)[at]
                                                     : ((const double *)from)[at];
}

static void machine_create(Machine *m, const Cube *cube, Precision precision, const char *isa,
                           bool hanging_only)
{
    *m = (Machine){.kernels = voxel_kernels_find(precision, isa),
                   .vertex_kernels = vertex_kernels_find(precision, isa)};
    int(*vertex)[NODE_COUNT] = allocate((size_t)cube->element_count, sizeof *vertex), count = 0;
    int *level = allocate((size_t)cube->element_count, sizeof *level);
    for (int e = 0; e < cube->element_count; e++) {
        bool hanging = false;
        for (int n = NODE_CORNERS; n < NODE_COUNT; n++)
            hanging |= cube->vertex[e][n] >= 0;
        if (hanging_only && !hanging)
            continue;
        memcpy(vertex[count], cube->vertex[e], sizeof vertex[count]);
        level[count++] = cube->level[e];
    }
    const BatchOptions options = {"bench", count,         (const int(*)[NODE_COUNT])vertex,
                                  level,   cube->classes, cube->vertex_count};
    batches_create(&m->batches, &options, &m->arena);
    free(vertex);
    free(level);

    const size_t rows = (size_t)cube->vertex_count + 1,
                 real = precision == PRECISION_SINGLE ? sizeof(float) : sizeof(double);
    void *row = arena_allocate(&m->arena, ARENA_STEP, rows * ROW, real, "rows"),
         *force = arena_allocate(&m->arena, ARENA_STEP, rows * 4, real, "forces"),
         *share = arena_allocate(&m->arena, ARENA_STEP, rows, real, "inverse masses");
    for (int i = 0; i < cube->vertex_count; i++) {
        put(m, share, i, cube->fixed[i] ? 0.0 : 1.0 / cube->mass[i]);
        for (int c = 0; c < 3; c++)
            put(m, row, (long)i * ROW + 4 + c, cube->velocity[i][c]);
    }
    const int batches = batches_total(&m->batches);
    double(*last)[LANES][4] =
        arena_allocate(&m->arena, ARENA_STEP, (size_t)batches, sizeof *last, "last rotations");
    for (int i = 0; i < batches * LANES; i++)
        last[i / LANES][i % LANES][0] = 1.0;
    m->pass = (VoxelPass){
        .plain = &m->batches.plain,
        .hanging = &m->batches.hanging,
        .tables = voxel_tables_create(&m->batches, VOXEL_AFFINE, precision, "bench", &m->arena),
        .classes = m->batches.classes,
        .damped = true,
        .rows = row,
        .force = force,
        .last = last,
        .stiffness_scale = 1.0,
        .damping_scale = 1.0,
    };
    m->advance = (AdvancePass){
        .present = row,
        .next = row,
        .force = force,
        .inverse_mass = share,
        .vertex_count = cube->vertex_count + 1,
        .h = cube->h,
        .advance = 1.0,
        .gravity = {GRAVITY[0], GRAVITY[1], GRAVITY[2]},
        .position_limit = 1e3,
        .check = true,
    };
}

static void step(Machine *m)
{
    m->kernels->evaluate(&m->pass);
    m->vertex_kernels->advance(&m->advance);
}

// Largest distance to the textbook over the largest displacement.
static double disagreement(const Machine *m, const Cube *cube, const VoxelTextbook *textbook)
{
    double worst = 0.0, farthest = 0.0;
    for (int i = 0; i < cube->vertex_count; i++)
        for (int c = 0; c < 3; c++) {
            double u = textbook->vertex[i].x[c] - cube->place[i][c];
            worst = fmax(worst, fabs(u - get(m, m->pass.rows, (long)i * ROW + c)));
            farthest = fmax(farthest, fabs(u));
        }
    return worst / farthest;
}

static void create_textbook(VoxelTextbook *textbook, const Cube *cube)
{
    int(*corner)[8] = allocate((size_t)cube->element_count, sizeof *corner);
    for (int e = 0; e < cube->element_count; e++)
        memcpy(corner[e], cube->vertex[e], sizeof corner[e]);
    voxel_textbook_create(textbook, cube->vertex_count, (const double(*)[3])cube->place,
                          (const double(*)[3])cube->velocity, cube->element_count,
                          (const int(*)[8])corner, SIZE, YOUNGS_MODULUS, 0.0, DENSITY, cube->beta);
    memcpy(textbook->gravity, GRAVITY, sizeof GRAVITY);
    for (int i = 0; i < cube->vertex_count; i++)
        textbook->vertex[i].fixed = cube->fixed[i];
    free(corner);
}

enum { TEXTBOOK, DOUBLE, SINGLE, CONTENDERS };
static const char *const NAMES[CONTENDERS] = {"voxel.textbook", "voxel.double", "voxel.single"};

static void run_cube(Bench *bench, int cells)
{
    Cube cube;
    Status status = {0};
    if (!cube_create(&cube, cells, 0, &status)) {
        bench_fail(bench, "voxel", status.text);
        return;
    }
    VoxelTextbook textbook;
    Machine machine[CONTENDERS];
    create_textbook(&textbook, &cube);
    machine_create(&machine[DOUBLE], &cube, PRECISION_DOUBLE, bench->isa, false);
    machine_create(&machine[SINGLE], &cube, PRECISION_SINGLE, bench->isa, false);

    // About 20 ms a sample of the textbook. The first rounds go step by step and must agree.
    const int most = 100000 / cube.element_count + 1;
    int repeats = bench->quick ? 3 : 30;
    Samples samples[CONTENDERS] = {0};
    for (int r = -2; r < repeats; r++) {
        for (int k = 0; k < CONTENDERS; k++) {
            const int steps = r < 0 ? 3 : k == TEXTBOOK ? most / 4 + 1 : 2 * most;
            int64_t begin = 0;
            for (int i = r < 0 ? 0 : -1; i < steps; i++) { // one to come back into the caches
                if (i <= 0)
                    begin = clock_thread_ns();
                if (k == TEXTBOOK)
                    voxel_textbook_step(&textbook, cube.h);
                else
                    step(&machine[k]);
            }
            if (r >= 0)
                samples_add(&samples[k], (double)(clock_thread_ns() - begin) * 1e-3 / steps);
        }
        // The textbook's rotations and spins are exact to 1e-10 and 1e-9; single precision rounds
        // displacements, over a few steps.
        if (r < 0 && (!(disagreement(&machine[DOUBLE], &cube, &textbook) < 1e-6) ||
                      !(disagreement(&machine[SINGLE], &cube, &textbook) < 1e-5)))
            bench_fail(bench, "voxel", "textbook and server moved differently");
    }
    for (int k = 0; k < CONTENDERS; k++) {
        if (!bench_wants(bench, NAMES[k]))
            continue;
        const double least = samples_min(&samples[k]);
        bench_row(bench, NAMES[k], cube.vertex_count, "us_per_step", least, "us");
        bench_row(bench, NAMES[k], cube.vertex_count, "us_per_step_median",
                  samples_median(&samples[k]), "us");
        bench_row(bench, NAMES[k], cube.vertex_count, "ns_per_element",
                  1e3 * least / cube.element_count, "ns");
        if (k != TEXTBOOK)
            bench_row(bench, NAMES[k], cube.vertex_count, "ratio_to_textbook",
                      samples_min(&samples[TEXTBOOK]) / least, "1");
    }
    arena_destroy(&machine[DOUBLE].arena);
    arena_destroy(&machine[SINGLE].arena);
    voxel_textbook_destroy(&textbook);
    cube_destroy(&cube);
}

// The graded cube: its whole step, and the forces of its hanging elements by themselves.
static void run_graded(Bench *bench, int cells)
{
    Cube cube;
    Status status = {0};
    if (!cube_create(&cube, cells, 2, &status)) {
        bench_fail(bench, "voxel", status.text);
        return;
    }
    Machine whole, hanging;
    machine_create(&whole, &cube, PRECISION_SINGLE, bench->isa, false);
    machine_create(&hanging, &cube, PRECISION_SINGLE, bench->isa, true);
    long incidences = 0;
    for (int e = 0; e < cube.element_count; e++) {
        int count = 0;
        for (int n = 0; n < NODE_COUNT; n++)
            count += cube.vertex[e][n] >= 0;
        incidences += count > NODE_CORNERS ? count : 0;
    }
    int repeats = bench->quick ? 3 : 30, steps = 200000 / cube.element_count + 1;
    Samples all = {0}, some = {0};
    for (int r = -1; r < repeats; r++) {
        int64_t begin = clock_thread_ns();
        for (int i = 0; i < steps; i++)
            step(&whole);
        int64_t middle = clock_thread_ns();
        for (int i = 0; i < steps; i++)
            hanging.kernels->evaluate(&hanging.pass);
        int64_t end = clock_thread_ns();
        step(&hanging); // clears the forces
        if (r < 0)
            continue;
        samples_add(&all, (double)(middle - begin) * 1e-3 / steps);
        samples_add(&some, (double)(end - middle) * 1e-3 / steps);
    }
    if (bench_wants(bench, "voxel.graded.single"))
        bench_row(bench, "voxel.graded.single", cube.vertex_count, "us_per_step", samples_min(&all),
                  "us");
    if (bench_wants(bench, "voxel.hanging.single"))
        bench_row(bench, "voxel.hanging.single", cube.vertex_count, "ns_per_incidence",
                  1e3 * samples_min(&some) / (double)incidences, "ns");
    arena_destroy(&whole.arena);
    arena_destroy(&hanging.arena);
    cube_destroy(&cube);
}

// Times element passes of machines in turn, the first of which is what the others are compared
// with; destroys them.
static void compare_passes(Bench *bench, const char *name, const Cube *cube, int cases,
                           Machine *machine, const char *const *suffix)
{
    enum { MOST = 3 };
    Samples samples[MOST] = {0};
    const int repeats = bench->quick ? 3 : 30, steps = 200000 / cube->element_count + 1;
    for (int r = -1; r < repeats; r++)
        for (int k = 0; k < cases; k++) {
            const int64_t begin = clock_thread_ns();
            for (int i = 0; i < steps; i++)
                machine[k].kernels->evaluate(&machine[k].pass);
            if (r >= 0)
                samples_add(&samples[k], (double)(clock_thread_ns() - begin) * 1e-3 / steps);
            step(&machine[k]); // clears the forces
        }
    for (int k = 0; k < cases; k++) {
        char row[48];
        snprintf(row, sizeof row, "%s.%s", name, suffix[k]);
        bench_row(bench, row, cube->vertex_count, "us_per_pass", samples_min(&samples[k]), "us");
        bench_row(bench, row, cube->vertex_count, "ratio",
                  samples_min(&samples[k]) / samples_min(&samples[0]), "1");
        arena_destroy(&machine[k].arena);
    }
}

// An element pass with Maxwell branches over one without, of plain cubes or of a graded cube.
static void run_relaxing(Bench *bench, const char *name, int cells, int levels)
{
    enum { NONE, ONE, THREE, CASES };
    static const int BRANCHES[CASES] = {0, 1, 3};
    static const char *const SUFFIX[CASES] = {"0", "1", "3"};
    Cube cube;
    Status status = {0};
    if (!cube_create(&cube, cells, levels, &status)) {
        bench_fail(bench, name, status.text);
        return;
    }
    Machine machine[CASES];
    for (int k = 0; k < CASES; k++) {
        Machine *m = &machine[k];
        machine_create(m, &cube, PRECISION_SINGLE, bench->isa, false);
        const size_t numbers = (size_t)batches_total(&m->batches) * (size_t)BRANCHES[k] * 6 * LANES;
        m->pass.relaxation.count = BRANCHES[k];
        for (int n = 0; n < BRANCHES[k]; n++)
            m->pass.relaxation.branch[n] = (RelaxationBranch){.stiffness = 0.2, .half = 0.99};
        // As in the server: read from one array in the first substep, then in place.
        m->pass.relaxation.from = m->pass.relaxation.to =
            arena_allocate(&m->arena, ARENA_STEP, numbers + 1, sizeof(float), "dashpots");
    }
    compare_passes(bench, name, &cube, CASES, machine, SUFFIX);
    cube_destroy(&cube);
}

// The same with stiffening.
static void run_stiffening(Bench *bench, const char *name, int cells, int levels,
                           Precision precision)
{
    static const char *const SUFFIX[] = {"linear", "stiffening"};
    const VoxelStiffening stiffening = {0.15, stiffening_curve(10.0)};
    Cube cube;
    Status status = {0};
    if (!cube_create(&cube, cells, levels, &status)) {
        bench_fail(bench, name, status.text);
        return;
    }
    Machine machine[2];
    for (int k = 0; k < 2; k++)
        machine_create(&machine[k], &cube, precision, bench->isa, false);
    machine[1].pass.stiffening = &stiffening;
    compare_passes(bench, name, &cube, 2, machine, SUFFIX);
    cube_destroy(&cube);
}

void bench_voxels(Bench *bench)
{
    bool wanted = false, graded = false;
    for (int k = 0; k < CONTENDERS; k++)
        wanted |= bench_wants(bench, NAMES[k]);
    graded =
        bench_wants(bench, "voxel.graded.single") || bench_wants(bench, "voxel.hanging.single");
    for (int cells = 16; cells <= (bench->quick ? 16 : 32); cells *= 2) {
        if (wanted)
            run_cube(bench, cells);
        if (graded)
            run_graded(bench, cells);
    }
    if (bench_wants(bench, "voxel.relaxing.plain"))
        run_relaxing(bench, "voxel.relaxing.plain", 16, 0);
    if (bench_wants(bench, "voxel.relaxing.graded"))
        run_relaxing(bench, "voxel.relaxing.graded", 16, 2);
    static const char *const STIFFENING[PRECISION_COUNT][2] = {
        [PRECISION_SINGLE] = {"voxel.stiffening.single.plain", "voxel.stiffening.single.graded"},
        [PRECISION_DOUBLE] = {"voxel.stiffening.double.plain", "voxel.stiffening.double.graded"}};
    for (int p = 0; p < PRECISION_COUNT; p++)
        for (int graded_too = 0; graded_too < 2; graded_too++)
            if (bench_wants(bench, STIFFENING[p][graded_too]))
                run_stiffening(bench, STIFFENING[p][graded_too], 16, 2 * graded_too, (Precision)p);
}
