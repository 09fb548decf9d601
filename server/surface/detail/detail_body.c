// SPDX-License-Identifier: MIT
// What levels add to the operations of a surface body. Step thread, but for the check at load.
#include "surface/detail/detail.h"

#include "surface/bending.h"
#include "surface/cavity.h"

#include <limits.h>
#include <string.h>

bool detail_adapt(Body *body, int64_t step, double tick, TopologyChange *change)
{
    if (!detail_sweep(body, step, tick))
        return false;
    const Detail *detail = ((SurfaceModel *)body->model)->detail;
    *change = detail->report.change;
    change->again = detail->adapt.again;
    return true;
}

// Least number of chunks for more than one thread: with fewer, calling a thread costs more than it
// saves.
enum { SHARED_LEAST = 64 };

static void run(SurfaceModel *model, SpringKernel *kernel, const SpringPass *pass)
{
    if (pass->last_chunk < SHARED_LEAST)
        kernel(pass);
    else
        model_run_kernel(model, kernel, pass);
}

// Hinges add to the rows of all nodes.
static void clear_handed(const SurfaceModel *model)
{
    const size_t row = ROW * model_real_size(model);
    for (int r = 0; r < model->run_count; r++)
        memset((char *)model->bending->force + (size_t)model->run[r][0] * row, 0,
               (size_t)(model->run[r][1] - model->run[r][0]) * row);
}

void detail_evaluate(SurfaceModel *model, SpringPass *pass)
{
    Detail *detail = model->detail;
    const DetailLists *lists = &detail->lists;
    pass->handed = lists->handed;
    pass->carries = lists->carries;
    // Forces of hanging nodes and of hinges first: they go to other nodes.
    if (model->bending != NULL)
        clear_handed(model);
    else if (lists->hanging_count > 0)
        detail_clear_masters(lists, model->basis.precision);
    const SpringKernels *kernels = model->kernels;
    if (lists->hanging_count > 0) {
        pass->chunk = lists->hanging_chunk;
        pass->last_chunk = lists->hanging_chunk_count;
        // What hanging nodes pass on is scaled as springs are, and the pressure is not.
        CavityPass handed;
        const double scale = pass->stiffness_scale;
        if (model->cavity != NULL) {
            handed = *pass->cavity;
            handed.pressure = scale > 0.0 ? handed.pressure / scale : 0.0;
            pass->cavity = &handed;
        }
        run(model, kernels->sum[model->kind], pass);
        if (model->cavity != NULL)
            pass->cavity = &model->cavity->pass;
    }
    if (model->bending != NULL)
        bending_add(model, pass);
    if (lists->hanging_count > 0)
        detail_hand_over(lists, model->basis.precision);
    // Then the free nodes, which move.
    pass->chunk = lists->free_chunk;
    pass->last_chunk = lists->free_chunk_count;
    bool pieces = detail->frames != NULL && detail_frames_add(model, pass);
    if (*model->loaded == 0 && model->touched_count == 0 && !pieces)
        pass->external = NULL;
    run(model, kernels->scattered[model->kind][model->shape], pass);
    if (pieces)
        detail_frames_take_back(model);
    if (lists->hanging_count > 0)
        detail_hang(lists, model->basis.precision, pass->next);
    if (pass->next != model->rows[1 - model->current])
        *detail->adapt.felt_count = 0; // only contact forces of the last evaluation count
}

// A new load refines the body to its final level in as many sweeps as there are levels.
void detail_look(void *self)
{
    Detail *detail = ((SurfaceModel *)self)->detail;
    detail->adapt.sweep->urgent =
        (int64_t)detail->set.levels.finest * detail->set.levels.level[0].face_count;
}

// A restored mesh gets a new topology number: clients and recordings know a different mesh by the
// old one.
void detail_restored(Body *body)
{
    Detail *detail = ((SurfaceModel *)body->model)->detail;
    int64_t *topology = &detail->adapt.sweep->topology;
    detail->is_valid = detail_check(detail);
    if (!detail->is_valid) // the code that restored it calls check() and reverts it
        return;
    if (!topology_is_newer(detail_topology(detail), body->mesh.topology))
        *topology = body->mesh.topology;
    detail_rebuild(body);
}

void detail_forget(Detail *detail, RestoreMode mode)
{
    *detail->adapt.felt_count = 0;
    if (mode == RESTORE_SHAPE && detail->set.cut != NULL)
        detail_tear_forget(&detail->set);
}

// Returns where a threshold of refinement, or their common factor, is; NULL: another parameter.
static double *find_threshold(const DetailAdapt *adapt, BodyParameter parameter)
{
    Sweep *sweep = adapt->sweep;
    switch (parameter) {
    case BODY_ADAPT_FORCE:
    case BODY_ADAPT_SPEED:
    case BODY_ADAPT_CURVATURE:
        return &sweep->thresholds[parameter - BODY_ADAPT_FORCE];
    case BODY_ADAPT_SCALE:
        return &sweep->scale;
    case BODY_ADAPT_ERROR:
        return adapt->drive->error > 0.0 ? &adapt->drive->error : NULL;
    case BODY_ADAPT_FINENESS:
        return &adapt->drive->fineness;
    default:
        return NULL;
    }
}

bool detail_set(Detail *detail, BodyParameter parameter, double value)
{
    Sweep *sweep = detail->adapt.sweep;
    if (!detail->options.adaptive)
        return false;
    double *threshold = find_threshold(&detail->adapt, parameter);
    if (threshold != NULL)
        *threshold = value;
    else if (parameter == BODY_ADAPT_LEVEL)
        sweep->level = (int64_t)fmin(fmax(value, 0.0), detail->set.levels.finest);
    return threshold != NULL || parameter == BODY_ADAPT_LEVEL;
}

bool detail_get(const Detail *detail, BodyParameter parameter, double *value)
{
    Sweep *sweep = detail->adapt.sweep;
    if (!detail->options.adaptive)
        return false;
    const double *threshold = find_threshold(&detail->adapt, parameter);
    if (threshold != NULL)
        *value = *threshold;
    else if (parameter == BODY_ADAPT_LEVEL)
        *value = (double)sweep->level;
    return threshold != NULL || parameter == BODY_ADAPT_LEVEL;
}

void detail_explain(const Detail *detail, FILE *out)
{
    const LeafSet *set = &detail->set;
    fprintf(out, "    levels: 0 to %d, %s; at most %d nodes, %d faces; ", set->levels.finest,
            set->constrained ? "continuum rule, hanging nodes held by their masters"
                             : "the paper's rule, hanging nodes free",
            detail->faces.slots->node.capacity, detail->faces.slots->face.capacity);
    if (detail->options.adaptive)
        fprintf(out, "faces checked %g times a second\n", detail->options.adapt.check_hz);
    else
        fprintf(out, "refined by cuts alone\n");
    if (set->cut != NULL)
        fprintf(out, "    cuttable: at most %d more nodes by cuts\n", set->cut->copy_capacity);
}

// ---------------------------------------------------------------------------------------------
// The check that a state from outside (a checkpoint) is one that a body with levels can have,
// before anything is derived from it: its numbers are indices

static bool is_within(int64_t number, int64_t low, int64_t high)
{
    return number >= low && number <= high;
}

static bool is_number(double number)
{
    return number >= 0.0 && number <= 1e300;
}

// True if the bits belong to existing faces, with neighbours at most one level apart.
static bool check_bits(const Detail *detail)
{
    // Numbers in range, and only of faces that exist.
    for (int l = 0; l < detail->set.levels.finest; l++) {
        const Level *at = &detail->set.levels.level[l];
        for (int f = 0; f < at->face_count; f++) {
            int number = detail->set.face_base[l] + f;
            if (detail->set.refined[number] > 1 || detail->adapt.calm_since[number] < 0)
                return false;
            if (detail->set.refined[number] == 0)
                continue;
            if (!detail_exists(&detail->set, l, f))
                return false;
            // Neighbours differ by one level at most.
            for (int k = 0; k < 3; k++) {
                int across = levels_beyond(at, at->face_edge[f][k], f);
                if (across >= 0 && !detail_exists(&detail->set, l, across))
                    return false;
            }
        }
    }
    return true;
}

static bool check_sweep(const Detail *detail)
{
    const Sweep *sweep = detail->adapt.sweep;
    int roots = detail->set.levels.level[0].face_count;
    // Progress of the sweep.
    bool ok = is_within(sweep->root, 0, roots - 1) &&
              is_within(sweep->urgent, 0, (int64_t)detail->set.levels.finest * roots) &&
              is_number(sweep->credit) && is_number(sweep->scale) &&
              is_within(sweep->level, 0, detail->set.levels.finest) &&
              is_within(sweep->topology, 0, INT64_MAX / 2) && sweep->count >= 0 &&
              sweep->refined >= 0 && sweep->coarsened >= 0 && sweep->refused >= 0;
    for (int k = 0; k < 3; k++)
        ok = ok && is_number(sweep->thresholds[k]);
    const SweepDrive *drive = detail->adapt.drive;
    ok = ok && is_number(drive->error) && drive->fineness > 1e-3 && drive->fineness < 1e3;
    // What it has found so far.
    ok = ok && is_within(*detail->adapt.felt_count, 0, detail->adapt.felt_capacity);
    for (int f = 0; ok && f < roots; f++)
        ok = detail->adapt.skip[f] <= SKIP_MOST;
    for (int64_t i = 0; ok && i < *detail->adapt.felt_count; i++)
        ok = is_within(detail->adapt.felt[i].node, 0, detail->set.node_count - 1);
    return ok;
}

// Fills table->slot, which is derived from table->thing; false when something has two slots or does
// not exist. Returns the number of slots in `used`.
static bool find_slots(const SlotTable *table, int *used)
{
    *used = 0;
    for (int i = 0; i < table->thing_count; i++)
        table->slot[i] = -1;
    for (int s = 0; s < table->capacity; s++) {
        int thing = table->thing[s];
        if (thing == -1)
            continue;
        // A node or face has one slot at most.
        if (!is_within(thing, 0, table->thing_count - 1) || table->slot[thing] >= 0)
            return false;
        table->slot[thing] = s;
        ++*used;
    }
    return true;
}

static bool is_on(const LeafSet *set, int node)
{
    if (set->cut != NULL && node - set->cut->base_count >= *set->cut->copies)
        return false;
    return detail_status(set, node) != NODE_OFF;
}

// True if exactly the nodes that are on have slots.
static bool check_node_slots(const Detail *detail)
{
    const SlotTable *table = &detail->faces.slots->node;
    int used;
    if (!find_slots(table, &used))
        return false;
    for (int i = 0; i < detail->set.node_count; i++)
        if ((table->slot[i] >= 0) != is_on(&detail->set, i))
            return false;
    return true;
}

// True if exactly the faces that are drawn have slots in messages; a leaf is one triangle more than
// it has midpoints.
static bool check_face_slots(const Detail *detail)
{
    const SlotTable *table = &detail->faces.slots->face;
    int used, drawn = 0;
    if (!find_slots(table, &used))
        return false;
    // Each leaf must have as many slots as it is drawn with triangles.
    for (int l = 0; l <= detail->set.levels.finest; l++) {
        const Level *at = &detail->set.levels.level[l];
        for (int f = 0; f < at->face_count; f++) {
            if (!detail_is_leaf(&detail->set, l, f))
                continue;
            // One triangle, and one more per midpoint on its edges.
            int pieces = 1;
            for (int k = 0; k < 3 && l < detail->set.levels.finest; k++)
                pieces +=
                    detail_status_of_midpoint(&detail->set, l, at->face_edge[f][k]) != NODE_OFF;
            for (int k = 0; k < pieces; k++)
                if (table->slot[l < detail->set.levels.finest
                                    ? detail_face_slot(&detail->set, l + 1, 4 * f + k)
                                    : f] < 0)
                    return false;
            drawn += pieces;
        }
    }
    return drawn == used;
}

bool detail_check(const Detail *detail)
{
    return check_bits(detail) && check_sweep(detail) &&
           (detail->set.cut == NULL || detail_cut_check(detail)) && check_node_slots(detail) &&
           check_face_slots(detail);
}
