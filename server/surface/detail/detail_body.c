// What levels add to the operations of a surface body. Step thread.
#include "surface/detail/detail.h"

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

void detail_evaluate(SurfaceModel *model, SpringPass *pass)
{
    Detail *detail = model->detail;
    const DetailLists *lists = &detail->lists;
    pass->handed = lists->handed;
    pass->carries = lists->carries;
    // Hanging nodes first: their masters need their forces.
    if (lists->hanging_count > 0) {
        pass->chunk = lists->hanging_chunk;
        pass->last_chunk = lists->hanging_chunk_count;
        run(model, model->kernels->sum[model->damped][model->prestressed], pass);
        detail_hand_over(lists, model->basis.precision);
    }
    // Then the free nodes, which move.
    pass->chunk = lists->free_chunk;
    pass->last_chunk = lists->free_chunk_count;
    bool pieces = detail->frames != NULL && detail_frames_add(model, pass);
    bool external = *model->loaded != 0 || model->touched_count > 0 || pieces;
    run(model, model->kernels->scattered[model->damped][model->shape][external][model->prestressed],
        pass);
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

bool detail_set(Detail *detail, BodyParameter parameter, double value)
{
    Sweep *sweep = detail->adapt.sweep;
    if (!detail->options.adaptive)
        return false;
    switch (parameter) {
    case BODY_ADAPT_FORCE:
    case BODY_ADAPT_SPEED:
    case BODY_ADAPT_CURVATURE:
        sweep->thresholds[parameter - BODY_ADAPT_FORCE] = value;
        return true;
    case BODY_ADAPT_SCALE:
        sweep->scale = value;
        return true;
    case BODY_ADAPT_LEVEL:
        sweep->level = (int64_t)fmin(fmax(value, 0.0), detail->set.levels.finest);
        return true;
    default:
        return false;
    }
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
