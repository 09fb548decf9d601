// The operations of a body with levels: those of surface.c where they apply, and those that handle
// nodes that hang, are created or removed. Step thread.
#include "surface/detail/detail.h"

#include "base/check.h"
#include "surface/implicit.h"

#include <string.h>

static Detail *detail_of(const void *self)
{
    return ((const SurfaceModel *)self)->detail;
}

static bool detail_adapt(Body *body, int64_t step, double tick, TopologyChange *change)
{
    if (!detail_sweep(body, step, tick))
        return false;
    *change = detail_of(body->model)->report.change;
    change->again = detail_of(body->model)->adapt.again;
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

static void evaluate(void *self, const Stage *stage, double h)
{
    SurfaceModel *model = self;
    Detail *detail = model->detail;
    const DetailLists *lists = &detail->lists;
    SpringPass pass;
    model_fill_pass(model, stage, h, &pass);
    pass.handed = lists->handed;
    pass.carries = lists->carries;
    // Hanging nodes first: their masters need their forces.
    if (lists->hanging_count > 0) {
        pass.chunk = lists->hanging_chunk;
        pass.last_chunk = lists->hanging_chunk_count;
        run(model, model->kernels->sum[model->damped][model->prestressed], &pass);
        detail_hand_over(lists, model->basis.precision);
    }
    // Then the free nodes, which move.
    pass.chunk = lists->free_chunk;
    pass.last_chunk = lists->free_chunk_count;
    bool pieces = detail->frames != NULL && detail_frames_add(model, &pass);
    bool external = *model->loaded != 0 || model->touched_count > 0 || pieces;
    run(model, model->kernels->scattered[model->damped][model->shape][external][model->prestressed],
        &pass);
    if (pieces)
        detail_frames_take_back(model);
    if (lists->hanging_count > 0)
        detail_hang(lists, model->basis.precision, pass.next);
    if (pass.next != model->rows[1 - model->current])
        *detail->adapt.felt_count = 0; // only contact forces of the last evaluation count
    model_end_pass(model, &pass);
}

// Distributes a force in the world frame over the free nodes that carry a node.
static void spread(SurfaceModel *model, int node, Vec3 force,
                   void (*add)(SurfaceModel *model, int slot, Vec3 force))
{
    const LeafSet *set = &model->detail->set;
    if (set->status[node] == NODE_HANGING) {
        int parent[2];
        levels_parents(&set->levels, node, parent);
        spread(model, parent[0], vec3_scale(0.5, force), add);
        spread(model, parent[1], vec3_scale(0.5, force), add);
        return;
    }
    if (set->status[node] == NODE_FREE)
        add(model, model->slot[node], force);
}

static void add_touching(SurfaceModel *model, int slot, Vec3 force)
{
    model_touch(model, model->lane[slot]);
    model_add_external(model, slot, force);
}

static void add_forces(void *self, const int *node, int count, const Vec3 *force)
{
    SurfaceModel *model = self;
    DetailAdapt *adapt = &model->detail->adapt;
    for (int i = 0; i < count; i++) {
        spread(model, node[i], force[i], add_touching);
        if (*adapt->felt_count < adapt->felt_capacity)
            adapt->felt[(*adapt->felt_count)++] = (Felt){node[i], force[i]};
    }
}

static void reserve_forces(void *self, const char *name, int count, Arena *arena)
{
    Detail *detail = detail_of(self);
    DetailAdapt *adapt = &detail->adapt;
    model_reserve_touched(self, name, count, arena);
    adapt->felt_capacity = count;
    adapt->felt = arena_allocate(arena, ARENA_CONTACT, (size_t)count, sizeof *adapt->felt,
                                 "%s/felt forces", name);
    state_add(detail->state, adapt->felt, (size_t)count * sizeof *adapt->felt, "%s/felt", name);
}

static void add_load(void *self, int node, Vec3 force)
{
    spread(self, node, force, model_add_load);
}

// A new load refines the body to its final level in as many sweeps as there are levels.
static void look(void *self)
{
    Detail *detail = detail_of(self);
    detail->adapt.sweep->urgent =
        (int64_t)detail->set.levels.finest * detail->set.levels.level[0].face_count;
}

// A restored mesh gets a new topology number: clients and recordings know a different mesh by the
// old one.
static void restored(Body *body)
{
    Detail *detail = detail_of(body->model);
    int64_t *topology = &detail->adapt.sweep->topology;
    detail->is_sound = detail_check(detail);
    if (!detail->is_sound) // the code that restored it calls check() and reverts it
        return;
    if (!topology_is_newer(detail_topology(detail), body->mesh.topology))
        *topology = body->mesh.topology;
    detail_rebuild(body);
}

// Clears what refers to the past: after a return to the rest shape nothing has been stretched, and
// forces of a tick that is undone must not divide faces.
static void restore(void *self, RestoreMode mode)
{
    surface_restore(self, mode);
    *detail_of(self)->adapt.felt_count = 0;
    if (mode == RESTORE_SHAPE && detail_of(self)->set.cut != NULL)
        detail_tear_forget(&detail_of(self)->set);
}

static bool check(const void *self)
{
    return detail_of(self)->is_sound && surface_check(self);
}

static void measure(const void *self, BodyMeasure *measure)
{
    SurfaceModel *model = (SurfaceModel *)self; // for its scratch memory
    surface_measure(self, measure);
    if (detail_of(self)->frames != NULL)
        measure->elastic += detail_frames_energy(model, model->rows[model->current]);
    measure->refused = detail_of(self)->adapt.sweep->refused;
}

static bool is_fixed(const void *self, int node)
{
    return detail_of(self)->fixed[node];
}

static bool set(void *self, BodyParameter parameter, double value)
{
    Detail *detail = detail_of(self);
    Sweep *sweep = detail->adapt.sweep;
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
        return surface_set(self, parameter, value);
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

// Operations of every body with levels, and what depends on the scene.
#define LEVELS                                                                                     \
    SURFACE_OPERATIONS, .restored = restored, .check = check, .restore = restore,                  \
                        .reserve_forces = reserve_forces, .add_forces = add_forces,                \
                        .add_load = add_load, .measure = measure, .is_fixed = is_fixed
#define STAYS          .set = surface_set
#define ADAPTS         .adapt = detail_adapt, .look = look, .set = set
#define CUTS           .cut = detail_blade_cut, .reserve_blades = detail_blade_reserve
#define TEARS          CUTS, .tear = detail_tear
#define EXPLICIT_STEPS .drift = surface_drift, .evaluate = evaluate

const BodyOps *detail_ops(const SurfaceOptions *options)
{
    enum { WHOLE, CUT, TORN, KINDS };
    static const BodyOps table[2][KINDS][2] = {
        {
            [CUT] = {{LEVELS, STAYS, CUTS, EXPLICIT_STEPS}, {LEVELS, STAYS, CUTS, IMPLICIT_STEPS}},
            [TORN] = {{LEVELS, STAYS, TEARS, EXPLICIT_STEPS},
                      {LEVELS, STAYS, TEARS, IMPLICIT_STEPS}},
        },
        {
            [WHOLE] = {{LEVELS, ADAPTS, EXPLICIT_STEPS}, {LEVELS, ADAPTS, IMPLICIT_STEPS}},
            [CUT] = {{LEVELS, ADAPTS, CUTS, EXPLICIT_STEPS},
                     {LEVELS, ADAPTS, CUTS, IMPLICIT_STEPS}},
            [TORN] = {{LEVELS, ADAPTS, TEARS, EXPLICIT_STEPS},
                      {LEVELS, ADAPTS, TEARS, IMPLICIT_STEPS}},
        },
    };
    const int kind = !options->body.cuttable ? WHOLE : options->tear_stretch > 0.0 ? TORN : CUT;
    return &table[options->adaptive][kind][options->body.integrator == INTEGRATOR_IMPLICIT];
}
