#include "voxel/batch_runs.h"

#include "voxel/template.h"

#include <math.h>
#include <string.h>

void batch_runs_create(BatchRuns *runs, int most, const char *name, Arena *arena, StateList *state)
{
    const size_t batches = (size_t)batch_runs_capacity(runs);
    // Ending a kind may split a run.
    runs->run = arena_allocate(arena, ARENA_STEP, (size_t)most + BATCH_KINDS, sizeof *runs->run,
                               "%s/runs of batches", name);
    runs->last =
        arena_allocate(arena, ARENA_STEP, batches, sizeof *runs->last, "%s/rotations", name);
    state_add(state, runs->last, batches * sizeof *runs->last, "%s/rotations", name);
    batch_runs_forget_rotations(runs);
}

// ---------------------------------------------------------------------------------------------
// Which batches are in use

static int kind_begin(const BatchRuns *runs, int kind)
{
    return kind == BATCH_PLAIN ? 0 : runs->run_end[kind - 1][1];
}

void batch_runs_begin(BatchRuns *runs, int kind)
{
    runs->run_end[kind][1] = kind_begin(runs, kind);
}

void batch_runs_add(BatchRuns *runs, int kind, BatchRun more)
{
    int *end = &runs->run_end[kind][1];
    if (more.count == 0)
        return;
    BatchRun *last = *end > kind_begin(runs, kind) ? &runs->run[*end - 1] : NULL;
    if (last != NULL && last->first + last->count == more.first && last->mixed == more.mixed)
        last->count += more.count;
    else
        runs->run[(*end)++] = more;
}

int batch_runs_count(const BatchRuns *runs, int kind)
{
    int total = 0;
    for (int k = kind_begin(runs, kind); k < runs->run_end[kind][1]; k++)
        total += runs->run[k].count;
    return total;
}

// Splits the run that contains the end of the first half of the batches.
void batch_runs_end(BatchRuns *runs, int kind)
{
    int *end = &runs->run_end[kind][1], k = kind_begin(runs, kind);
    int left = batch_runs_count(runs, kind) / 2;
    for (; k < *end && left >= runs->run[k].count; k++)
        left -= runs->run[k].count;
    if (k < *end && left > 0) {
        BatchRun *run = &runs->run[k++];
        memmove(run + 1, run, (size_t)(*end - (k - 1)) * sizeof *run);
        (*end)++;
        run[0].count = left;
        run[1].first += left;
        run[1].count -= left;
    }
    runs->run_end[kind][0] = k;
}

// ---------------------------------------------------------------------------------------------
// Rotations

void batch_runs_forget_rotations(BatchRuns *runs)
{
    for (int b = 0; b < batch_runs_capacity(runs); b++)
        for (int lane = 0; lane < LANES; lane++)
            memcpy(runs->last[b][lane], (const double[4]){1.0, 0.0, 0.0, 0.0},
                   sizeof runs->last[b][lane]);
}

bool batch_runs_check(const BatchRuns *runs)
{
    for (int b = 0; b < batch_runs_capacity(runs); b++)
        for (int lane = 0; lane < LANES; lane++) {
            const double *q = runs->last[b][lane];
            if (!(fabs(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1.0) < 1e-3))
                return false;
        }
    return true;
}

// ---------------------------------------------------------------------------------------------
// Kernels

// A run in the form of the kernels.
typedef struct RunView {
    VoxelPass pass;
    PlainBatches plain;
    HangingBatches hanging;
} RunView;

static void view_run(const BatchRuns *runs, int kind, BatchRun run, RunView *view)
{
    view->plain = (PlainBatches){.batch_count = 0};
    view->hanging = (HangingBatches){.batch_count = 0};
    if (kind == BATCH_HANGING)
        view->hanging = (HangingBatches){
            .batch_count = run.count,
            .mixed_count = run.mixed ? run.count : 0,
            .start = runs->hanging.start + run.first,
            .vertex = runs->hanging.vertex,
            .table = runs->hanging.table + run.first,
            .element_class = runs->hanging.element_class + run.first,
        };
    else
        view->plain = (PlainBatches){
            .batch_count = run.count,
            .vertex = runs->plain.vertex + (long)run.first * NODE_CORNERS * LANES,
            .element_class = runs->plain.element_class + run.first,
        };
    view->pass.last =
        runs->last + (kind == BATCH_HANGING ? runs->plain.batch_count : 0) + run.first;
}

static void begin_view(const BatchRuns *runs, const VoxelPass *given, RunView *view)
{
    view->pass = *given;
    view->pass.plain = &view->plain;
    view->pass.hanging = &view->hanging;
    view->pass.tables = runs->tables;
    view->pass.classes = runs->classes;
}

// Return the range of runs of a half, or of both.
static int half_begin(const BatchRuns *runs, int kind, int half)
{
    return half == 1 ? runs->run_end[kind][0] : kind_begin(runs, kind);
}

static int half_end(const BatchRuns *runs, int kind, int half)
{
    return runs->run_end[kind][half == 0 ? 0 : 1];
}

void batch_runs_evaluate(const BatchRuns *runs, const VoxelPass *pass, int half)
{
    RunView view;
    begin_view(runs, pass, &view);
    for (int kind = 0; kind < BATCH_KINDS; kind++)
        for (int k = half_begin(runs, kind, half); k < half_end(runs, kind, half); k++) {
            view_run(runs, kind, runs->run[k], &view);
            runs->kernels->evaluate(&view.pass);
        }
}

double batch_runs_energy(const BatchRuns *runs, const VoxelPass *pass)
{
    RunView view;
    begin_view(runs, pass, &view);
    double total = 0.0;
    for (int kind = 0; kind < BATCH_KINDS; kind++)
        for (int k = kind_begin(runs, kind); k < runs->run_end[kind][1]; k++) {
            view_run(runs, kind, runs->run[k], &view);
            total += runs->kernels->energy(&view.pass);
        }
    return total;
}

void batch_runs_stress(const BatchRuns *runs, const VoxelPass *pass, double limit, int half,
                       uint16_t *high)
{
    RunView view;
    begin_view(runs, pass, &view);
    for (int kind = 0; kind < BATCH_KINDS; kind++)
        for (int k = half_begin(runs, kind, half); k < half_end(runs, kind, half); k++) {
            const BatchRun run = runs->run[k];
            view_run(runs, kind, run, &view);
            runs->kernels->stress(&view.pass, limit,
                                  high + run.first +
                                      (kind == BATCH_PLAIN ? 0 : runs->plain.batch_count));
        }
}
