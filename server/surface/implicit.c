// One step of an implicit body, and its creation. Step thread, except implicit_create.
#include "surface/implicit_quad.h"

#include "base/isa.h"
#include "surface/detail/detail.h"

extern const ImplicitKernel implicit_kernels_double_base;
#if defined(__x86_64__)
extern const ImplicitKernel implicit_kernels_double_v3, implicit_kernels_double_v4;
#endif

// Before the tick: computes the positions at which external forces are evaluated. Also sets the
// base of the first substep.
void implicit_drift(void *self, double dt)
{
    SurfaceModel *model = self;
    model->base = model->rows[model->current];
    surface_drift(model, model->implicit->theta * dt);
}

// Computes the rows after the step, and, unless NULL, those at which the next step's external
// forces are evaluated.
static void advance(SurfaceModel *model, double *next, double *ahead)
{
    const Implicit *system = model->implicit;
    const double h = system->h, part = system->share * h, further = system->theta * h;
    bool good = true;
    for (int i = 0; i < system->moving; i++) {
        const int slot = system->slot[i];
        const Quad dv = system->change[i], v = quad_row(system->rows, slot, 4),
                   x = quad_row(system->rows, slot, 0) + h * v + part * dv, fast = v + dv;
        for (int c = 0; c < 3; c++) {
            const long at = (long)slot * ROW + c;
            good &= fabs(x[c]) <= model->position_limit && fabs(fast[c]) <= SPEED_LIMIT;
            next[at] = x[c];
            next[at + 4] = fast[c];
            if (ahead != NULL) {
                ahead[at] = x[c] + further * fast[c];
                ahead[at + 4] = fast[c];
            }
        }
    }
    model->bad |= !good;
}

// Computes the same positions for rows that were changed after advance.
static void look_ahead(const Implicit *system, const double *next, double *ahead)
{
    const double further = system->theta * system->h;
    for (int i = 0; i < system->moving && ahead != NULL; i++)
        for (int c = 0; c < 3; c++) {
            const long at = (long)system->slot[i] * ROW + c;
            ahead[at] = next[at] + further * next[at + 4];
            ahead[at + 4] = next[at + 4];
        }
}

// Copies the rows of fixed nodes and of unused slots unchanged.
static void keep(const SurfaceModel *model, double *next)
{
    const Implicit *system = model->implicit;
    const int fixed = system->moving + system->hanging;
    if (next == system->rows)
        return;
    for (int s = 0; s < model->basis.count; s++)
        if (system->number[s] == fixed && model->node[s] >= 0)
            for (int c = 0; c < ROW; c++)
                next[(long)s * ROW + c] = system->rows[(long)s * ROW + c];
}

void implicit_evaluate(void *self, const Stage *stage, double h)
{
    SurfaceModel *model = self;
    Implicit *system = model->implicit;
    Detail *detail = model->detail;
    double *next = stage->last ? model->rows[1 - model->current] : model->stage[1];
    double *ahead = stage->last ? NULL : model->stage[0];
    // Build and solve the system at the current state, then correct the momentum.
    system->h = h;
    system->rows = model->base;
    implicit_number(model);
    system->kernel->assemble(model);
    model->bad |= !system->kernel->solve(system);
    system->kernel->restore_momentum(system);
    keep(model, next);
    // A violent step of a floating body is turned on a circle, after which the look-ahead is
    // repeated.
    advance(model, next, system->violent && !system->anchored ? NULL : ahead);
    if (system->violent && !system->anchored) {
        model->bad |= !implicit_turn(system, next);
        look_ahead(system, next, ahead);
    }
    // Hanging rows are not unknowns: they follow their masters.
    if (detail != NULL) {
        detail_hang(&model->detail->lists, model->basis.precision, next);
        if (ahead != NULL) {
            detail_hang(&model->detail->lists, model->basis.precision, ahead);
            *detail->adapt.felt_count = 0; // only contact forces of the last evaluation count
        }
    }
    if (model->touched_count > 0)
        model_clear_touched(model);
    model->base = next;
    model->present = ahead != NULL ? ahead : next;
}

void implicit_explain(const Implicit *system, FILE *out)
{
    fprintf(out,
            "    implicit: theta %.6g, conjugate gradients to %.3g of the residual, at most %d "
            "iterations a step; rows in double precision, one thread\n",
            system->theta, system->tolerance, system->iterations);
}

// Returns the most springs that can be active: each is in the table at both ends.
static int most_edges(const SurfaceModel *model)
{
    return model->springs.start[model->springs.chunk_count] * LANES / 2 + 1;
}

double implicit_theta(const SurfaceOptions *options)
{
    return options->implicit.theta > 0.0 ? options->implicit.theta : IMPLICIT_THETA;
}

// Finds the kernel for the level of the spring kernels.
static const ImplicitKernel *find_kernel(const char *level)
{
#if defined(__x86_64__)
    const ImplicitKernel *const kernel[ISA_COUNT] = {
        &implicit_kernels_double_base, &implicit_kernels_double_v3, &implicit_kernels_double_v4};
    return kernel[isa_find(level)];
#else
    (void)level;
    return &implicit_kernels_double_base;
#endif
}

void implicit_create(SurfaceModel *model, const SurfaceOptions *options, Arena *arena)
{
    const char *name = options->body.name;
    Implicit *system = model->implicit = ALLOCATE(ARENA_STEP, 1, Implicit, "implicit system");
    const SurfaceImplicit *asked = &options->implicit;
    system->kernel = find_kernel(model->kernels->level);
    system->theta = implicit_theta(options);
    system->anchored = options->shape.wanted && options->shape.frame == SHAPE_WORLD;
    system->tolerance = asked->tolerance > 0.0 ? asked->tolerance : IMPLICIT_TOLERANCE;
    system->iterations = asked->iterations > 0 ? asked->iterations : IMPLICIT_ITERATIONS;
    const int numbers = model->node_count + 1;
    system->number = ALLOCATE(ARENA_STEP, model->basis.count, int, "implicit numbers");
    system->slot = ALLOCATE(ARENA_STEP, numbers, int, "implicit slots");
    if (model->detail != NULL)
        system->master = ALLOCATE(ARENA_STEP, numbers, *system->master, "implicit masters");
    if (model->detail != NULL && model->detail->frames != NULL)
        system->frame = ALLOCATE(ARENA_STEP, numbers, unsigned char, "implicit frames");
    system->edge_capacity = most_edges(model);
    system->spring = ALLOCATE(ARENA_STEP, system->edge_capacity, Quad, "implicit springs");
    system->end = ALLOCATE(ARENA_STEP, system->edge_capacity, *system->end, "implicit ends");
    system->inertia = ALLOCATE(ARENA_STEP, numbers, double, "implicit inertia");
    system->weight = ALLOCATE(ARENA_STEP, numbers, double, "implicit weights");
    system->inverse = ALLOCATE(ARENA_STEP, numbers, Block, "implicit blocks");
    Quad **const by_number[] = {&system->outer, &system->change,  &system->residual,
                                &system->step,  &system->product, &system->search};
    for (size_t k = 0; k < sizeof by_number / sizeof *by_number; k++)
        *by_number[k] = ALLOCATE(ARENA_STEP, numbers, Quad, "implicit vectors");
    system->island = ALLOCATE(ARENA_STEP, numbers, int, "implicit islands");
    system->member = ALLOCATE(ARENA_STEP, numbers, int, "implicit members");
    system->island_start = ALLOCATE(ARENA_STEP, numbers + 1, int, "implicit island starts");
    system->held = ALLOCATE(ARENA_STEP, numbers, bool, "implicit held islands");
    if (system->anchored)
        system->resistance = ALLOCATE(ARENA_STEP, numbers, Block, "implicit resistance");
    const int pieces = model->detail != NULL ? model->detail->set.place_count : model->node_count;
    system->stamp = ALLOCATE(ARENA_STEP, pieces, int, "implicit pieces");
}
