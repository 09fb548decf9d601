// SPDX-License-Identifier: MIT
// Creates a surface body from a mesh: springs and masses, the order of nodes, the tables of the
// kernel, the faces that tools touch. Load time only.
#include "surface/surface.h"

#include "base/check.h"
#include "base/log.h"
#include "base/sets.h"
#include "body/integrator.h"
#include "geometry/edges.h"
#include "surface/bending.h"
#include "surface/cavity.h"
#include "surface/detail/detail.h"
#include "surface/error.h"
#include "surface/implicit.h"
#include "surface/law.h"
#include "surface/model.h"
#include "surface/network.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Least number of nodes for more than one thread: with fewer, calling a thread costs more than it
// saves.
enum { SHARED_LEAST = 1000 };

// Fills the springs by chunk and entry; a node's springs are in ascending order of the neighbour's
// slot. Returns the number of entries.
static size_t create_springs(SurfaceModel *model, const WingedMesh *winged,
                             const SpringNetwork *network, const char *name, Arena *arena)
{
    int chunk_count = model->basis.count / LANES;
    // A chunk has as many entries as its node with the most springs.
    int *start = ALLOCATE(ARENA_STEP, chunk_count + 1, int, "spring start");
    for (int c = 0; c < chunk_count; c++) {
        int most = 0;
        for (int lane = 0; lane < LANES; lane++) {
            int node = model->node[c * LANES + lane];
            if (node >= 0 && winged_valence(winged, node) > most)
                most = winged_valence(winged, node);
        }
        start[c + 1] = start[c] + most;
    }
    size_t entries = (size_t)start[chunk_count] * LANES;
    model->springs = (SpringTable){.chunk_count = chunk_count, .start = start, .end = start + 1};
    model_allocate_springs(model, entries, name, arena);
    int *neighbour = model->springs.neighbour;

    // Per node: its springs by the slot of the other end.
    int(*around)[2] = calloc((size_t)winged->edge_count + 1, sizeof *around); // slot, edge
    ASSERT(around != NULL);
    // Springs of padding lanes keep stiffness 0 and refer to the lane itself.
    for (int s = 0; s < model->basis.count; s++) {
        int node = model->node[s], count = 0;
        if (node >= 0)
            for (int k = winged->node_edge_start[node]; k < winged->node_edge_start[node + 1];
                 k++) {
                int edge = winged->node_edge[k];
                around[count][0] = model->slot[winged_other(winged, edge, node)];
                around[count++][1] = edge;
            }
        // Ascending slots, so that the sums have one order; around a cavity that of the faces.
        if (model->cavity == NULL)
            qsort(around, (size_t)count, sizeof *around, compare_ints);
        int chunk = s / LANES;
        for (int e = start[chunk], i = 0; e < start[chunk + 1]; e++, i++) {
            long at = (long)e * LANES + s % LANES;
            if (model->cavity != NULL && node >= 0)
                model_put_spring(model, at, s, around[0][0], network->rest_length[around[0][1]],
                                 0.0);
            else
                neighbour[at] = s;
            if (i < count)
                model_put_spring(model, at, s, around[i][0], network->rest_length[around[i][1]],
                                 network->stiffness[around[i][1]]);
        }
    }
    free(around);
    return entries;
}

static void create_nodes(SurfaceModel *model, const TriMesh *mesh, const SpringNetwork *network,
                         const SurfaceOptions *options, Arena *arena, StateList *state)
{
    const char *name = options->body.name;
    model_create_node_table(model, options, network->free_count == mesh->node_count, arena);
    const bool uses_drag = model->shape != SHAPE_FRAME_NONE;
    const bool body_frame = model->shape == SHAPE_FRAME_BODY;
    const bool drag_apart = shape_drag_is_apart(model->shape);
    const bool single = model->basis.precision == PRECISION_SINGLE;
    const size_t slots = (size_t)model->basis.count;
    NodeTable *nodes = &model->nodes;
    // Weights of the fit of a rigid frame: shape springs pull towards it, a floating body is its
    // mass.
    double *weight = NULL;
    if (body_frame || model->basis.floating)
        weight = model->rigid_weight = ALLOCATE(ARENA_STEP, slots, double, "frame weights");

    // Fixed nodes get zeros in all tables: their accelerations vanish without a test.
    for (int i = 0; i < mesh->node_count; i++) {
        int s = model->slot[i];
        double m = network->mass[i], share = network->fixed[i] ? 0.0 : 1.0 / m;
        model->mass[i] = m;
        model_put(model, nodes->inverse_mass, s, share);
        if (uses_drag) {
            double drag = network->node_damping[i];
            drag += drag_apart ? 0.0 : network->shape_damping[i];
            model_put(model, nodes->shape_rate, s, share * network->shape_stiffness[i]);
            model_put(model, nodes->drag, s, share * drag);
        }
        if (drag_apart)
            model_put(model, nodes->shape_drag, s, share * network->shape_damping[i]);
        // The weight of a node in that fit.
        if (weight != NULL)
            weight[s] = body_frame ? network->shape_stiffness[i] : m;
    }
    if (weight != NULL)
        model->basis.rigid = rigid_frame_create(
            name, model->basis.precision, model->basis.displaced, model->basis.count,
            (const double(*)[3])model->basis.rest, weight, arena, state);
    // Virtual nodes, relative to the frame's centre where the rows are.
    if (nodes->rest == NULL)
        return;
    for (int i = 0; i < mesh->node_count; i++)
        for (int c = 0; c < 3; c++) {
            int s = model->slot[i];
            double center = single ? model->basis.rigid->pose.rest_center[c] : 0.0;
            model_put(model, nodes->rest, model_lane(s) + c * LANES,
                      model->basis.rest[s][c] - center);
        }
}

// Creates a body of one level: one slot per node, all in use.
static void create_dense(Body *body, SurfaceModel *model, const TriMesh *mesh,
                         const WingedMesh *winged, const SpringNetwork *network,
                         const SurfaceOptions *options, Arena *arena, StateList *state)
{
    const char *name = options->body.name;
    model->node_count = mesh->node_count;
    model->edge_count = winged->edge_count;
    model->basis.count = (mesh->node_count + LANES - 1) / LANES * LANES;
    model->lane_count = model->basis.count;
    // All slots are in use.
    model->run = arena_allocate(arena, ARENA_STEP, 1, sizeof *model->run, "%s/run of slots", name);
    model->run[0][1] = model->basis.count;
    model->run_count = 1;
    // Slots in the order that keeps neighbours close.
    model->slot = ALLOCATE(ARENA_TOPOLOGY, mesh->node_count, int, "slot of node");
    model->node = ALLOCATE(ARENA_TOPOLOGY, model->basis.count, int, "node of slot");
    order_nodes(winged, model->slot);
    for (int s = 0; s < model->basis.count; s++)
        model->node[s] = -1;
    for (int i = 0; i < mesh->node_count; i++)
        model->node[model->slot[i]] = i;

    // Rest positions first: springs and nodes are measured from them.
    model_create_rest(model, mesh, name, arena, state);
    if (model->cavity != NULL)
        cavity_create_tables(model, name, arena);
    const size_t entries = create_springs(model, winged, network, name, arena);
    create_nodes(model, mesh, network, options, arena, state);
    model_create_rows(model, mesh, network->fixed, options, arena, state);
    law_create(model, &options->material, entries, name, arena, state);
    law_rest(model);
    model_create_surface(body, mesh, winged, network, name, arena);
    model_create_mesh(model, body, mesh, options, arena);
}

static double longest_edge(const TriMesh *mesh, const WingedMesh *winged)
{
    double longest = 0.0;
    for (int e = 0; e < winged->edge_count; e++)
        longest = fmax(longest, vec3_length(vec3_sub(mesh->position[winged->edge[e].node[0]],
                                                     mesh->position[winged->edge[e].node[1]])));
    return longest;
}

int surface_auto_substeps(int springs, int nodes, int iterations)
{
    // Seconds, fitted to `pliant-bench --case implicit` (spheres of 114, 642 and 2562 nodes,
    // AVX-512, least of 20 presses each) within 12 %; only their ratios matter. A substep costs
    // 0.78, 2.99 and 11.0 us; an implicit tick 20.3, 120 and 524 us with 2, 3 and 4.6 iterations on
    // the soft wall, 27.3, 181 and 972 us with 9, 15 and 27 on the stiff one.
    static const double SUBSTEP = 3e-7, SPRING = 1.4e-9;
    static const double SOLVE_SPRING = 5.5e-8, ITERATION_SPRING = 2.7e-9;
    // What is stiff spreads over the whole mesh: iterations grow with its width in nodes.
    const double most = iterations > 0 ? iterations : IMPLICIT_ITERATIONS;
    const double solves = fmin(3.0 + 0.55 * sqrt((double)nodes), most);
    const double implicit = (double)springs * (SOLVE_SPRING + solves * ITERATION_SPRING);
    return (int)fmax(1.0, implicit / (SUBSTEP + (double)springs * SPRING));
}

// Chooses the integrator from the bounds of the springs, if the scene leaves the choice to the
// body: the one whose tick is cheaper. A body that changes is judged by its mesh at level 0 with
// the step of its finest faces.
static void choose_integrator(SurfaceOptions *options, const SpringNetwork *network, int most)
{
    if (options->automatic && !options->cavity.wanted) {
        double limit = stability_time_step(INTEGRATOR_LEAPFROG, network->finest_lambda,
                                           network->finest_damping);
        const bool fast = stability_substeps(options->tick, limit) <= most;
        options->body.integrator =
            fast || law_is_explicit(&options->material) ? INTEGRATOR_LEAPFROG : INTEGRATOR_IMPLICIT;
    }
    if (options->body.integrator == INTEGRATOR_IMPLICIT)
        options->body.precision = PRECISION_DOUBLE;
}

// False with `status`: a combination of options that the equations do not support.
static bool options_fit(const SurfaceOptions *options, Status *status)
{
    bool per_node = options->shape.wanted && options->shape.per_node;
    double frame_weight = per_node ? options->shape.stiffness : options->shape.angular_frequency;
    if (options->shape.wanted && options->shape.frame == SHAPE_BODY && !(frame_weight > 0.0))
        return status_fail(status, STATUS_INVALID,
                           "shape: frame \"body\" needs a stiffness above 0 to fit the frame with");
    if (options->shape.wanted && options->shape.direction == SHAPE_DAMPS_RADIAL &&
        (options->shape.frame == SHAPE_BODY || options->automatic ||
         options->body.integrator == INTEGRATOR_IMPLICIT))
        return status_fail(status, STATUS_INVALID,
                           "shape: damping_direction \"radial\" needs frame \"world\" and an "
                           "integrator with explicit steps");
    if (options->body.cuttable && options->body.levels > 0 && options->adjust == ADJUST_CHOI2005)
        return status_fail(status, STATUS_INVALID,
                           "cuttable needs adjust = \"continuum\", whose masses and springs belong "
                           "to faces: a cut then keeps their sums");
    if (bending_stiffness(&options->material) > 0.0 && options->body.levels > 0 &&
        options->adjust == ADJUST_CHOI2005)
        return status_fail(
            status, STATUS_INVALID,
            "material: bending needs adjust = \"continuum\", with hanging nodes in the "
            "middle of their edges; it does not go with \"choi2005\"");
    const char *key, *needs;
    return surface_law_fits(options, &key, &needs) ||
           status_fail(status, STATUS_INVALID, "material: %s needs %s, not \"%s\"", key, needs,
                       integrator_name(options->body.integrator));
}

// False with `status`: a wall thicker than its body is long. Its hinges outweigh its springs so far
// that energy grows (README.md, "Limits of the model").
static bool thickness_fits(const TriMesh *mesh, const SurfaceOptions *options, Status *status)
{
    const double extent = mesh_extent(mesh);
    if (options->material.thickness <= extent)
        return true;
    return status_fail(
        status, STATUS_INVALID,
        "material: a thickness of %g m is more than the body's largest extent, %g m; "
        "what is that thick is no wall: use a voxel body",
        options->material.thickness, extent);
}

// Adds the bending part to the bounds of a network, lambda at its own level and at the finest. The
// damping of hinges is that of springs, and must not dictate the time step either.
static void add_bending(SpringNetwork *network, const SurfaceMaterial *material, double lambda,
                        double finest)
{
    const double before = network->damping_time, both = network->finest_linear + finest;
    if (!material->uniform)
        network->damping_time = fmin(before, 0.8 / sqrt(both));
    network->clamped |= network->damping_time < before;
    network->lambda += lambda;
    network->finest_lambda += finest;
    network->damping += network->damping_time * lambda;
    network->finest_damping += network->damping_time * finest;
}

static void bound_bending(SpringNetwork *network, const TriMesh *mesh, const WingedMesh *winged,
                          const SurfaceOptions *options, double stiffness)
{
    double here = bending_bound(mesh, winged, stiffness, network->mass, network->fixed);
    double finest = here;
    if (options->hierarchy != NULL && surface_changes(options)) {
        LevelRules rules;
        level_rules_create(&rules, mesh, options);
        finest = bending_level_bound(&rules, options->hierarchy->finest, stiffness, network->fixed);
        level_rules_destroy(&rules);
    }
    add_bending(network, &options->material, here, fmax(here, finest));
}

// The fields that bodies with levels and without share.
static void start_model(SurfaceModel *model, const SurfaceOptions *options,
                        const SpringNetwork *network, int nodes)
{
    const bool implicit = options->body.integrator == INTEGRATOR_IMPLICIT;
    model->basis.precision = options->body.precision;
    model->basis.displaced = options->body.precision == PRECISION_SINGLE;
    model->prestress = options->prestress;
    model->prestressed = options->prestress > 0.0;
    model->team = nodes < SHARED_LEAST && !surface_changes(options) ? NULL : options->body.team;
    model->damping_time = implicit ? network->asked_damping_time : network->damping_time;
    model->damped = model->damping_time > 0.0;
    law_choose(model, options);
}

// Returns the pressure that a ball of the body's wall and size bears (server/surface/README.md).
static double burst_pressure(const SurfaceOptions *options, const TriMesh *mesh)
{
    const SurfaceMaterial *wall = &options->material;
    if (options->shape.wanted || wall->uniform)
        return (double)INFINITY;
    Box box = box_empty();
    for (int i = 0; i < mesh->node_count; i++)
        box_add(&box, mesh->position[i]);
    return 1.5 * wall->youngs_modulus_2d * stiffening_cap(&wall->stiffening) / box_extent(&box);
}

static Body start_body(SurfaceModel *model, const SurfaceOptions *options,
                       const SpringNetwork *network)
{
    Body body = body_of_options(&options->body, surface_ops(options), model);
    body.mass = network->total_mass;
    body.finest_level = options->start_level;
    body.lambda = network->lambda;
    body.damping = network->damping;
    body.contact_lambda = network->contact_lambda;
    body.theta = options->body.integrator == INTEGRATOR_IMPLICIT ? implicit_theta(options) : 0.0;
    return body;
}

ISA_KERNELS(SpringKernels, spring);

const SpringKernels *kernels_find(Precision precision, const char *name)
{
    IsaLevel level = isa_find(name);
    return level == ISA_COUNT ? NULL : spring_kernels[precision][level];
}

bool surface_create(Body *body, const TriMesh *mesh, const SurfaceOptions *asked, Arena *arena,
                    StateList *state, Status *status)
{
    SurfaceOptions chosen = *asked;
    const SurfaceOptions *options = &chosen;
    const char *name = options->body.name;
    // Refuse what cannot be built before anything is allocated.
    const SpringKernels *kernels = kernels_find(
        options->body.precision, options->body.isa == NULL ? "auto" : options->body.isa);
    if (kernels == NULL)
        return status_fail(status, STATUS_INVALID,
                           "isa %s is not a level that this machine can run", options->body.isa);
    if (!options_fit(options, status) || !thickness_fits(mesh, options, status))
        return false;

    // Springs and masses, of level 0 if faces come and go.
    WingedMesh winged;
    winged_create(&winged, mesh);
    if (options->cavity.wanted && !cavity_fits(options, mesh, &winged, status)) {
        winged_destroy(&winged);
        return false;
    }
    SpringNetwork network;
    const bool changes = surface_changes(options);
    SurfaceOptions coarse = *options; // options for a body that changes, which starts from level 0
    coarse.start_level = changes ? 0 : options->start_level;
    coarse.adjust = options->body.levels > 0 ? options->adjust : ADJUST_CONTINUUM;
    if (!network_create(&network, mesh, &winged, &coarse, status)) {
        winged_destroy(&winged);
        return false;
    }
    const double bending = bending_stiffness(&options->material);
    if (bending > 0.0)
        bound_bending(&network, mesh, &winged, &coarse, bending);
    Cavity cavity;
    if (options->cavity.wanted) {
        cavity_start(&cavity, &coarse, mesh, &network);
        network.lambda += cavity.lambda;
        network.finest_lambda += cavity.lambda;
    }
    // The bounds of the springs are known now, and with them the integrator.
    const int most =
        surface_auto_substeps(winged.edge_count, mesh->node_count, options->implicit.iterations);
    choose_integrator(&chosen, &network, most);
    const bool implicit = options->body.integrator == INTEGRATOR_IMPLICIT;
    if (network.clamped && !implicit)
        log_line(LOG_WARNING,
                 "body %s: damping_time %g s shortened to %g s: longer, it would dictate "
                 "the time step",
                 name, options->material.damping_time, network.damping_time);

    // What all surface bodies have, then what depends on whether faces change.
    SurfaceModel *model = arena_allocate(arena, ARENA_STEP, 1, sizeof *model, "%s/model", name);
    model->kernels = implicit ? kernels_find(PRECISION_DOUBLE, kernels->level) : kernels;
    start_model(model, options, &network, mesh->node_count);
    model->basis.longest_edge = longest_edge(mesh, &winged);
    if (options->cavity.wanted)
        model->cavity = cavity_create(&cavity, name, arena, state);
    *body = start_body(model, options, &network);
    body->bears = burst_pressure(options, mesh);
    body->spring_count = winged.edge_count;
    body->auto_substeps = options->automatic ? most : 0;
    body->element_count = mesh->triangle_count;
    if (changes)
        detail_create(body, model, mesh, &winged, &network, options, arena, state);
    else
        create_dense(body, model, mesh, &winged, &network, options, arena, state);
    if (bending > 0.0 && !changes)
        bending_create(model, mesh, &winged, bending, name, arena);
    // What follows from either.
    body->surface.node_mass =
        options->body.cuttable ? model->detail->set.cut->lips.mass : model->mass;
    body->surface.longest_edge = model->basis.longest_edge;
    if (implicit)
        implicit_create(model, options, arena);
    if (options->body.estimate_error)
        surface_error_create(model, mesh, &network, options, arena);
    if (options->body.adapt_error > 0.0 && model->detail != NULL)
        surface_error_list(model, options->body.name, state);
    network_destroy(&network);
    winged_destroy(&winged);
    return true;
}
