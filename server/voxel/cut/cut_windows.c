#include "voxel/cut/cut_windows.h"

#include "voxel/cut/cut_pack.h"

#include <math.h>
#include <string.h>

#define ALLOCATE(use, count, type, label)                                                          \
    (type *)arena_allocate(arena, (use), (size_t)(count), sizeof(type), "%s/%s", name, label)

// ---------------------------------------------------------------------------------------------
// Load time

// The most batches that plain leaves of a window can fill, and those with hanging vertices.
static void measure_window(const CutLattice *lattice, int window, int *plain, int *hanging)
{
    const CutWindow *own = &lattice->window[window];
    int count[256] = {0}; // of each material
    *plain = 0;
    for (int e = own->first; e < own->end; e++)
        *plain += count[lattice->element[e].material]++ % LANES == 0;
    *hanging = own->level == 0 ? 0 : (own->end - own->first + LANES - 1) / LANES;
}

static void create_ranges(CutWindows *windows, const char *name, Arena *arena)
{
    const CutLattice *lattice = windows->lattice;
    const int count = lattice->window_count;
    windows->first_plain = ALLOCATE(ARENA_STEP, count + 1, int, "windows");
    windows->first_hanging = ALLOCATE(ARENA_STEP, count + 1, int, "windows, hanging");
    for (int w = 0; w < count; w++) {
        int plain, hanging;
        measure_window(lattice, w, &plain, &hanging);
        windows->first_plain[w + 1] = windows->first_plain[w] + plain;
        windows->first_hanging[w + 1] = windows->first_hanging[w] + hanging;
    }
    windows->plain_capacity = windows->first_plain[count];
    windows->hanging_capacity = windows->first_hanging[count];
    windows->plain_used = ALLOCATE(ARENA_STEP, count, unsigned char, "batches in use");
    windows->hanging_used = ALLOCATE(ARENA_STEP, count, unsigned char, "batches in use, hanging");
    windows->run = ALLOCATE(ARENA_STEP, 2 * count + 2, BatchRun, "runs of batches");
    windows->changed = ALLOCATE(ARENA_TOPOLOGY, count, int, "changed windows");
    windows->is_changed = ALLOCATE(ARENA_TOPOLOGY, count, unsigned char, "windows that changed");
}

static void create_plain(CutWindows *windows, const char *name, Arena *arena)
{
    const int count = windows->plain_capacity;
    windows->plain_vertex = arena_allocate(
        arena, ARENA_STEP, (size_t)count, sizeof *windows->plain_vertex, "%s/plain vertices", name);
    windows->plain_class = ALLOCATE(ARENA_STEP, count, int, "plain classes");
}

// All lanes hold the numbers of a plain cube.
static void create_tables(CutWindows *windows, const char *name, Arena *arena)
{
    const bool single = windows->templates->precision == PRECISION_SINGLE;
    const size_t real = single ? sizeof(float) : sizeof(double);
    const size_t each = (size_t)TEMPLATE_NUMBERS * LANES;
    const int count = windows->hanging_capacity;
    char *number =
        arena_allocate(arena, ARENA_STEP, (size_t)count * each, real, "%s/rest shapes", name);
    windows->tables = ALLOCATE(ARENA_STEP, count, RestTable, "rest tables");
    const void *from = template_cache_numbers(windows->templates, 0);
    for (int b = 0; b < count; b++, number += each * real) {
        windows->tables[b] = (RestTable){NODE_CORNERS, number};
        for (int i = 0; i < TABLE_HEAD + NODE_CORNERS * TABLE_ROW; i++)
            for (int lane = 0; lane < LANES; lane++)
                if (single)
                    ((float *)number)[i * LANES + lane] = ((const float *)from)[i];
                else
                    ((double *)number)[i * LANES + lane] = ((const double *)from)[i];
    }
}

static void create_hanging(CutWindows *windows, const char *name, Arena *arena)
{
    const int count = windows->hanging_capacity;
    windows->hanging_vertex =
        arena_allocate(arena, ARENA_STEP, (size_t)count, sizeof *windows->hanging_vertex,
                       "%s/hanging vertices", name);
    windows->hanging_class =
        arena_allocate(arena, ARENA_STEP, (size_t)count, sizeof *windows->hanging_class,
                       "%s/hanging classes", name);
    windows->hanging_mask = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)count,
                                           sizeof *windows->hanging_mask, "%s/hanging masks", name);
    windows->start = ALLOCATE(ARENA_STEP, count + 1, int, "hanging start");
    windows->table = ALLOCATE(ARENA_STEP, count, int, "hanging tables");
    for (int b = 0; b < count; b++) {
        windows->start[b + 1] = (b + 1) * NODE_COUNT;
        windows->table[b] = b;
    }
    create_tables(windows, name, arena);
}

// ---------------------------------------------------------------------------------------------
// Which batches are in use

// Adds the batches [first, first + count) to the runs from `begin` on; returns the end.
static int add_run(CutWindows *windows, int begin, int end, int first, int count)
{
    BatchRun *run = windows->run;
    if (count == 0)
        return end;
    if (end > begin && run[end - 1].first + run[end - 1].count == first) {
        run[end - 1].count += count;
        return end;
    }
    run[end] = (BatchRun){first, count};
    return end + 1;
}

// The first half ends with the window that fills it.
static void list_runs(CutWindows *windows)
{
    const int count = windows->lattice->window_count;
    int end = 0;
    for (int hanging = 0; hanging < 2; hanging++) {
        const unsigned char *used = hanging ? windows->hanging_used : windows->plain_used;
        const int *first = hanging ? windows->first_hanging : windows->first_plain;
        int total = cut_windows_count(windows, hanging != 0), so_far = 0, w = 0;
        for (int half = 0; half < 2; half++) {
            const int begin = end;
            for (; w < count && (half == 1 || 2 * so_far < total); w++) {
                end = add_run(windows, begin, end, first[w], used[w]);
                so_far += used[w];
            }
            windows->run_end[hanging][half] = end;
        }
    }
}

int cut_windows_count(const CutWindows *windows, bool hanging)
{
    const unsigned char *used = hanging ? windows->hanging_used : windows->plain_used;
    int total = 0;
    for (int w = 0; w < windows->lattice->window_count; w++)
        total += used[w];
    return total;
}

static void pack_all(CutWindows *windows, bool turns)
{
    for (int w = 0; w < windows->lattice->window_count; w++)
        cut_pack(windows, w, turns);
    list_runs(windows);
}

void cut_windows_create(CutWindows *windows, const WindowOptions *options, Arena *arena,
                        StateList *state)
{
    const char *name = options->name;
    *windows = (CutWindows){.lattice = options->lattice,
                            .templates = options->templates,
                            .material_count = options->material_count,
                            .classes = options->classes};
    create_ranges(windows, name, arena);
    create_plain(windows, name, arena);
    create_hanging(windows, name, arena);
    const size_t batches = (size_t)(windows->plain_capacity + windows->hanging_capacity);
    windows->last =
        arena_allocate(arena, ARENA_STEP, batches, sizeof *windows->last, "%s/rotations", name);
    state_add(state, windows->last, batches * sizeof *windows->last, "%s/rotations", name);
    windows->place = ALLOCATE(ARENA_STEP, windows->lattice->element_count, int, "element places");
    cut_windows_forget_rotations(windows);
    pack_all(windows, false);
}

// ---------------------------------------------------------------------------------------------
// Step thread

static void mark(CutWindows *windows, int window, int *count)
{
    if (windows->is_changed[window])
        return;
    windows->is_changed[window] = 1;
    int k = (*count)++;
    for (; k > 0 && windows->changed[k - 1] > window; k--)
        windows->changed[k] = windows->changed[k - 1];
    windows->changed[k] = window;
}

// Windows are numbered by level: the finer ones are packed first.
void cut_windows_update(CutWindows *windows)
{
    const CutChanges *changes = &windows->lattice->changes;
    int count = 0;
    for (int k = 0; k < changes->element_count; k++)
        mark(windows, windows->lattice->window_of[changes->element[k]], &count);
    for (int k = 0; k < count; k++) {
        cut_pack(windows, windows->changed[k], true);
        windows->is_changed[windows->changed[k]] = 0;
    }
    if (count > 0)
        list_runs(windows);
}

void cut_windows_restored(CutWindows *windows)
{
    pack_all(windows, false);
}

static int batch_capacity(const CutWindows *windows)
{
    return windows->plain_capacity + windows->hanging_capacity;
}

void cut_windows_forget_rotations(CutWindows *windows)
{
    for (int b = 0; b < batch_capacity(windows); b++)
        for (int lane = 0; lane < LANES; lane++)
            memcpy(windows->last[b][lane], (const double[4]){1.0, 0.0, 0.0, 0.0},
                   sizeof windows->last[b][lane]);
}

bool cut_windows_check(const CutWindows *windows)
{
    for (int b = 0; b < batch_capacity(windows); b++)
        for (int lane = 0; lane < LANES; lane++) {
            const double *q = windows->last[b][lane];
            if (!(fabs(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1.0) < 1e-3))
                return false;
        }
    return true;
}

// ---------------------------------------------------------------------------------------------
// Forces

// The batches of one run as kernels take them.
typedef struct RunView {
    PlainBatches plain;
    HangingBatches hanging;
} RunView;

static void view_run(const CutWindows *windows, bool hanging, BatchRun run, VoxelPass *pass,
                     RunView *view)
{
    *view = (RunView){.plain = {.batch_count = 0}};
    if (hanging)
        view->hanging = (HangingBatches){
            .batch_count = run.count,
            .mixed_count = run.count,
            .start = windows->start + run.first,
            .vertex = windows->hanging_vertex[0][0],
            .table = windows->table + run.first,
            .element_class = (const int(*)[LANES])windows->hanging_class + run.first,
        };
    else
        view->plain = (PlainBatches){
            .batch_count = run.count,
            .vertex = windows->plain_vertex[run.first][0],
            .element_class = windows->plain_class + run.first,
        };
    pass->plain = &view->plain;
    pass->hanging = &view->hanging;
    pass->last = windows->last + (hanging ? windows->plain_capacity : 0) + run.first;
}

static VoxelPass complete_pass(const CutWindows *windows, const VoxelPass *given)
{
    VoxelPass pass = *given;
    pass.tables = windows->tables;
    pass.classes = windows->classes;
    return pass;
}

// Where the runs of a half, or of both, begin and end.
static void find_runs(const CutWindows *windows, bool hanging, int half, int *begin, int *end)
{
    const int *ends = windows->run_end[hanging];
    *begin = half == 1 ? ends[0] : hanging ? windows->run_end[0][1] : 0;
    *end = half == 0 ? ends[0] : ends[1];
}

void cut_windows_evaluate(const CutWindows *windows, const VoxelKernels *kernels,
                          const VoxelPass *given, int half)
{
    VoxelPass pass = complete_pass(windows, given);
    for (int hanging = 0; hanging < 2; hanging++) {
        int run, end;
        find_runs(windows, hanging != 0, half, &run, &end);
        for (; run < end; run++) {
            RunView view;
            view_run(windows, hanging != 0, windows->run[run], &pass, &view);
            kernels->evaluate(&pass);
        }
    }
}

double cut_windows_energy(const CutWindows *windows, const VoxelKernels *kernels,
                          const VoxelPass *given)
{
    VoxelPass pass = complete_pass(windows, given);
    double total = 0.0;
    for (int hanging = 0; hanging < 2; hanging++) {
        int run, end;
        find_runs(windows, hanging != 0, WINDOWS_ALL, &run, &end);
        for (; run < end; run++) {
            RunView view;
            view_run(windows, hanging != 0, windows->run[run], &pass, &view);
            total += kernels->energy(&pass);
        }
    }
    return total;
}
