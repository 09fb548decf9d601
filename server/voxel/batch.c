// SPDX-License-Identifier: MIT
// Groups elements into batches at load, and lists and evaluates them as runs.
#include "voxel/batch.h"

#include "base/check.h"
#include "voxel/template.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// Groups. Load time

// Sort keys of an element.
typedef struct Key {
    int mixed_count; // number of vertices in mixed batches; 0 in others
    unsigned mask;
    int element_class; // 0 with hanging vertices: their batches may mix classes
    int element;
} Key;

static int compare_keys(const void *a, const void *b)
{
    const Key *x = a, *y = b;
    if (x->mixed_count != y->mixed_count)
        return x->mixed_count < y->mixed_count ? -1 : 1;
    if (x->mask != y->mask)
        return x->mask < y->mask ? -1 : 1;
    if (x->element_class != y->element_class)
        return x->element_class < y->element_class ? -1 : 1;
    return (x->element > y->element) - (x->element < y->element);
}

static bool same_class(const ElementClass *a, const ElementClass *b)
{
    return a->size == b->size && a->mu == b->mu && a->lambda == b->lambda &&
           a->residual == b->residual && a->damping == b->damping && a->share == b->share;
}

// Collects the classes in use, each once; returns the new index of each of the options' classes
// (malloc'ed).
static int *unite_classes(Batches *out, const BatchOptions *options, Arena *arena)
{
    const char *name = options->name;
    int given = 0;
    for (int e = 0; e < options->element_count; e++)
        if (options->element_class[e] >= given)
            given = options->element_class[e] + 1;
    // Which classes are in use.
    int *become = calloc((size_t)given + 1, sizeof *become);
    bool *used = calloc((size_t)given + 1, sizeof *used);
    ASSERT(become != NULL && used != NULL);
    for (int e = 0; e < options->element_count; e++)
        used[options->element_class[e]] = true;
    ElementClass *classes = calloc((size_t)given + 1, sizeof *classes);
    ASSERT(classes != NULL);
    // Equal ones become one, in the order of the options.
    for (int c = 0; c < given; c++) {
        if (!used[c])
            continue;
        int k = 0;
        while (k < out->class_count && !same_class(&classes[k], &options->classes[c]))
            k++;
        if (k == out->class_count)
            classes[out->class_count++] = options->classes[c];
        become[c] = k;
    }
    out->classes = ALLOCATE(ARENA_STEP, out->class_count, ElementClass, "element classes");
    memcpy(out->classes, classes, (size_t)out->class_count * sizeof *classes);
    free(classes);
    free(used);
    return become;
}

// Sorts ascending; returns how many elements have no hanging vertex.
static int sort_elements(const BatchOptions *options, const int *become, Key *key)
{
    int plain = 0;
    for (int e = 0; e < options->element_count; e++) {
        key[e] = (Key){.element = e, .mask = template_mask_of(options->vertex[e])};
        if (key[e].mask == 0)
            key[e].element_class = become[options->element_class[e]];
        plain += key[e].mask == 0;
    }
    qsort(key, (size_t)options->element_count, sizeof *key, compare_keys);
    return plain;
}

// Returns the end of the batch that begins at `first`.
static int batch_end(const Key *key, int first, int count)
{
    int end = first + 1;
    while (end < count && end < first + LANES &&
           (key[first].mixed_count > 0 ||
            (key[end].mixed_count == 0 && key[end].mask == key[first].mask &&
             key[end].element_class == key[first].element_class)))
        end++;
    return end;
}

static int count_batches(const Key *key, int count)
{
    int batches = 0;
    for (int first = 0; first < count; first = batch_end(key, first, count))
        batches++;
    return batches;
}

// Writes a lane's vertices by the nodes of its rest shape; the spare vertex without an element.
// Shorter lists are padded with the spare vertex, too.
static void put_vertices(const BatchOptions *options, int element, const int *node, int node_count,
                         int row_count, int *row, int lane)
{
    for (int n = 0; n < row_count; n++)
        row[n * LANES + lane] = element >= 0 && n < node_count ? options->vertex[element][node[n]]
                                                               : options->vertex_count;
}

static void put_lanes(Batches *out, const Key *key, int count, int batch)
{
    for (int lane = 0; lane < count; lane++)
        out->lane[key[lane].element] = batch * LANES + lane;
}

static void create_plain(Batches *out, const BatchOptions *options, const Key *key, int count,
                         Arena *arena)
{
    const char *name = options->name;
    const int batch_count = count_batches(key, count);
    int *vertex =
        ALLOCATE(ARENA_STEP, (long)batch_count * NODE_CORNERS * LANES, int, "plain vertices");
    int *element_class = ALLOCATE(ARENA_STEP, batch_count, int, "plain classes");
    static const int corner[NODE_CORNERS] = {0, 1, 2, 3, 4, 5, 6, 7};
    // Batches of one class each; the last one of a class may have free lanes.
    for (int first = 0, batch = 0, end; first < count; first = end, batch++) {
        end = batch_end(key, first, count);
        for (int lane = 0; lane < LANES; lane++)
            put_vertices(options, first + lane < end ? key[first + lane].element : -1, corner,
                         NODE_CORNERS, NODE_CORNERS, vertex + (long)batch * NODE_CORNERS * LANES,
                         lane);
        put_lanes(out, key + first, end - first, batch);
        element_class[batch] = key[first].element_class;
    }
    out->plain = (PlainBatches){batch_count, vertex, element_class};
}

static void create_templates(Batches *out, const BatchOptions *options, const Key *key, int count,
                             Arena *arena)
{
    const char *name = options->name;
    for (int k = 0; k < count; k++)
        out->template_count += k == 0 || key[k].mask != key[k - 1].mask;
    out->templates = ALLOCATE(ARENA_TOPOLOGY, out->template_count, Template, "templates");
    for (int k = 0, t = 0; k < count; k++)
        if (k == 0 || key[k].mask != key[k - 1].mask)
            template_create(&out->templates[t++], key[k].mask);
}

static int template_at(const Batches *batches, unsigned mask)
{
    int t = 0;
    while (batches->templates[t].mask != mask)
        t++;
    return t;
}

// Moves elements that would leave a batch too empty behind all others. Ascending masks before,
// ascending numbers of vertices after.
static void choose_mixed(const Batches *batches, Key *key, int count)
{
    for (int first = 0, end; first < count; first = end) {
        end = batch_end(key, first, count);
        if (end - first < LANES * 3 / 4)
            for (int k = first; k < end; k++)
                key[k].mixed_count = batches->templates[template_at(batches, key[k].mask)].count;
    }
    qsort(key, (size_t)count, sizeof *key, compare_keys);
}

static void create_hanging(Batches *out, const BatchOptions *options, const int *become, Key *key,
                           int count, Arena *arena)
{
    const char *name = options->name;
    create_templates(out, options, key, count, arena);
    choose_mixed(out, key, count);
    const int batch_count = count_batches(key, count);
    int *start = ALLOCATE(ARENA_STEP, batch_count + 1, int, "hanging start");
    int *table = ALLOCATE(ARENA_STEP, batch_count, int, "hanging tables");
    int(*element_class)[LANES] =
        arena_allocate(arena, ARENA_STEP, (size_t)batch_count, sizeof *element_class,
                       "%s/hanging classes", options->name);
    // Elements of templates that do not fill a batch go to the mixed ones.
    int pure = 0, mixed = 0;
    // Count the batches and the rows of each: a mixed batch needs those of its largest template.
    for (int first = 0, end, batch = 0; first < count; first = end, batch++) {
        end = batch_end(key, first, count);
        const bool mixes = key[first].mixed_count > 0;
        const int last = template_at(out, key[end - 1].mask); // the one with the most vertices
        table[batch] = mixes ? out->template_count + mixed : last;
        start[batch + 1] = start[batch] + out->templates[last].count;
        pure += !mixes;
        mixed += mixes;
    }
    // Vertices of all lanes, row by row.
    int *vertex = ALLOCATE(ARENA_STEP, (long)start[batch_count] * LANES, int, "hanging vertices");
    out->mixture = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)mixed, sizeof *out->mixture,
                                  "%s/mixed templates", options->name);
    // Fill the lanes; unused ones repeat the class of the first.
    for (int first = 0, end, batch = 0; first < count; first = end, batch++) {
        end = batch_end(key, first, count);
        for (int lane = 0; lane < LANES; lane++) {
            const bool used = first + lane < end;
            const Key *own = &key[used ? first + lane : first];
            const int t = template_at(out, own->mask);
            put_vertices(options, used ? own->element : -1, out->templates[t].node,
                         out->templates[t].count, start[batch + 1] - start[batch],
                         vertex + (long)start[batch] * LANES, lane);
            element_class[batch][lane] = become[options->element_class[own->element]];
            if (batch >= pure)
                out->mixture[batch - pure][lane] = used ? t : -1;
        }
        put_lanes(out, key + first, end - first, out->plain.batch_count + batch);
    }
    out->mixed_count = mixed;
    out->hanging =
        (HangingBatches){batch_count, start, vertex, table, (const int(*)[LANES])element_class};
}

void batches_create(Batches *out, const BatchOptions *options, Arena *arena)
{
    const char *name = options->name;
    const int count = options->element_count;
    *out = (Batches){.element_count = count};
    Key *key = calloc((size_t)count + 1, sizeof *key);
    ASSERT(key != NULL);
    // Plain elements come first in the order of keys.
    int *become = unite_classes(out, options, arena);
    int plain = sort_elements(options, become, key);
    out->lane = ALLOCATE(ARENA_STEP, count, int, "places of elements");
    create_plain(out, options, key, plain, arena);
    create_hanging(out, options, become, key + plain, count - plain, arena);
    free(become);
    free(key);
}

// ---------------------------------------------------------------------------------------------
// Runs. Step thread, but for batch_runs_create

void batch_runs_create(BatchRuns *runs, int most, const char *name, Arena *arena, StateList *state)
{
    const size_t batches = (size_t)batch_runs_capacity(runs);
    // Ending a kind may split a run.
    runs->run = arena_allocate(arena, ARENA_STEP, (size_t)most + BATCH_KINDS, sizeof *runs->run,
                               "%s/runs of batches", name);
    runs->last =
        arena_allocate(arena, ARENA_STEP, batches, sizeof *runs->last, "%s/rotations", name);
    state_add(state, runs->last, batches * sizeof *runs->last, "%s/rotations", name);
    batch_runs_forget(runs);
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
    if (last != NULL && last->first + last->count == more.first)
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

int batch_runs_next(const BatchRuns *runs, int next, int *end)
{
    int found = -1;
    for (int k = 0; k < runs->run_end[BATCH_HANGING][1]; k++) {
        const BatchRun run = runs->run[k];
        const int before = k >= runs->run_end[BATCH_PLAIN][1] ? runs->plain.batch_count : 0;
        const int first = before + run.first, last = first + run.count;
        const int from = first > next ? first : next;
        if (from < last && (found < 0 || from < found)) {
            found = from;
            *end = last;
        }
    }
    return found;
}

// Splits the run that contains the end of the first half of the batches.
void batch_runs_end(BatchRuns *runs, int kind)
{
    int *end = &runs->run_end[kind][1], k = kind_begin(runs, kind);
    // Find the run in which the first half ends.
    int left = batch_runs_count(runs, kind) / 2;
    for (; k < *end && left >= runs->run[k].count; k++)
        left -= runs->run[k].count;
    // Split it there.
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

void batch_runs_forget(BatchRuns *runs)
{
    for (int b = 0; b < batch_runs_capacity(runs); b++)
        for (int lane = 0; lane < LANES; lane++)
            memcpy(runs->last[b][lane], (const double[4]){1.0, 0.0, 0.0, 0.0},
                   sizeof runs->last[b][lane]);
    if (runs->relaxation != NULL)
        relaxation_forget(runs->relaxation);
}

void batch_runs_relax(BatchRuns *runs, int count, const MaxwellBranch *branch, Precision precision,
                      const char *name, Arena *arena, StateList *state)
{
    enum { SYMMETRIC = 6 }; // numbers of a strain
    const RelaxationLayout layout = {batch_runs_capacity(runs), LANES, SYMMETRIC, precision};
    runs->relaxation = relaxation_create(count, branch, &layout, name, arena, state);
}

bool batch_runs_check(const BatchRuns *runs)
{
    for (int b = 0; b < batch_runs_capacity(runs); b++)
        for (int lane = 0; lane < LANES; lane++) {
            const double *q = runs->last[b][lane];
            if (!(fabs(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1.0) < 1e-3))
                return false;
        }
    return runs->relaxation == NULL || relaxation_check(runs->relaxation);
}

// ---------------------------------------------------------------------------------------------
// Kernels

// A run in the form of the kernels.
typedef struct RunView {
    VoxelPass pass;
    PlainBatches plain;
    HangingBatches hanging;
} RunView;

static void view_run(const BatchRuns *runs, const VoxelPass *given, int kind, BatchRun run,
                     RunView *view)
{
    const int first = (kind == BATCH_HANGING ? runs->plain.batch_count : 0) + run.first;
    view->plain = (PlainBatches){.batch_count = 0};
    view->hanging = (HangingBatches){.batch_count = 0};
    // The kernel sees the run as if there were no other batches.
    if (kind == BATCH_HANGING)
        view->hanging = (HangingBatches){
            .batch_count = run.count,
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
    // Rotations and dashpots of the run's elements.
    view->pass.last = runs->last + first;
    if (given->relaxation.count > 0)
        relaxation_skip(runs->relaxation, first, &given->relaxation, &view->pass.relaxation);
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
            view_run(runs, pass, kind, runs->run[k], &view);
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
            view_run(runs, pass, kind, runs->run[k], &view);
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
            view_run(runs, pass, kind, run, &view);
            runs->kernels->stress(&view.pass, limit,
                                  high + run.first +
                                      (kind == BATCH_PLAIN ? 0 : runs->plain.batch_count));
        }
}
