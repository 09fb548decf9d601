// SPDX-License-Identifier: MIT
// What a voxel body that can be cut does besides others. Step thread.
#include "voxel/cut/cut_body.h"

#include "base/check.h"
#include "voxel/cut/cut_parts.h"
#include "voxel/error.h"
#include "voxel/model.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CLEAR_PASSES = 8 }; // at most, over what is in the way of a cut

// ---------------------------------------------------------------------------------------------
// Changes of topology

void cut_body_count_elements(const VoxelCuts *cuts, Body *body)
{
    body->element_count = cuts->lattice.leaf_count;
    body->element_changes++;
    if (cuts->adapt != NULL)
        body->finest_level = cut_adapt_finest(cuts->adapt);
}

// In the order of their dependencies.
bool cut_body_follow(VoxelCuts *cuts, Body *body, bool divided, bool pieces_came,
                     TopologyChange *change)
{
    cut_masses_follow(&cuts->masses, divided);
    if (cuts->release != NULL)
        cut_release_follow(cuts->release, cuts->adapt->free);
    if (cuts->carry != NULL)
        cut_carry_follow(cuts->carry);
    cut_windows_update(&cuts->windows);
    cut_blades_follow(&cuts->blades);
    bool shown = cut_faces_follow(&cuts->faces, pieces_came, body, change);
    if (cuts->fit != NULL)
        shown |= cut_fit_follow(cuts->fit, divided, body);
    if (cuts->tension != NULL)
        cut_tension_follow(cuts->tension);
    if (cuts->adapt != NULL)
        cut_adapt_follow(cuts->adapt);
    voxel_error_follow(body->model);
    cut_body_count_elements(cuts, body);
    cut_lattice_forget_changes(&cuts->lattice);
    return shown;
}

// True if as many faces can break. Faces: NULL, or those, which lie between leaves.
static bool has_room(VoxelCuts *cuts, CutOutcome *outcome, const int (*face)[2], int faces)
{
    CutLattice *lattice = &cuts->lattice;
    // Each broken face may need four vertices; those of a plane need about one, which is counted
    // where it matters.
    const int room = cut_parts_spare(lattice);
    outcome->needed = 4 * faces;
    if (!cut_lattice_has_room(lattice, faces) && face != NULL)
        outcome->needed = cut_lattice_births(lattice, face, faces);
    if (outcome->needed > room || !cut_pieces_have_room(&cuts->pieces, faces)) {
        outcome->verdict = CUT_NO_NODES;
        outcome->room = room;
        return false;
    }
    outcome->needed = 0;
    if (!cut_faces_has_room(&cuts->faces, faces, &outcome->needed, &outcome->room)) {
        outcome->verdict = CUT_NO_FACES;
        return false;
    }
    return true;
}

// Breaks faces {cell, axis}, met at the crossings (NULL: in the middle), if the capacity is
// sufficient.
static bool break_faces(VoxelCuts *cuts, Body *body, AccountCause cause, const int (*face)[2],
                        const CutCrossing *crossing, int count, CutOutcome *outcome,
                        TopologyChange *change)
{
    if (cuts->fit != NULL)
        cut_fit_keep(cuts->fit, face, crossing, count);
    cut_lattice_break(&cuts->lattice, face, count);
    const int added = cuts->lattice.changes.birth_count;
    const bool pieces_came = cut_pieces_follow(&cuts->pieces, face, count);
    if (pieces_came)
        cut_account_count(&cuts->account);
    cut_account_break(&cuts->account, cause, face, crossing, count);
    const bool changed = cut_body_follow(cuts, body, false, pieces_came, change);
    outcome->verdict = CUT_DONE;
    outcome->separated = count;
    outcome->nodes_added = added;
    outcome->pieces = cut_pieces_count(&cuts->pieces);
    outcome->small_pieces = cuts->pieces.small_count;
    return changed;
}

// What was divided or merged changed inside alone. Nodes that come and go are where nothing outside
// refers to them; only a mesh of all nodes shows them.
static void follow_inside(VoxelCuts *cuts, Body *body, TopologyChange *change)
{
    cut_body_follow(cuts, body, true, false, change);
    *change = (TopologyChange){.inside = true};
    if (cuts->faces.all)
        body->mesh.topology = topology_after(body->mesh.topology);
}

// Divides the larger elements that a command may meet, level by level, so that it looks only at
// cells that are near it. Returns how many nodes it would take to divide those for which there is
// no room, about: three for each cell of a side.
static int clear_sweep(VoxelCuts *cuts, Body *body, const CutSweep *sweep, TopologyChange *change)
{
    const Vertices *vertices = &((const VoxelModel *)body->model)->vertices;
    const CutBlades *blades = &cuts->blades;
    CutLattice *lattice = &cuts->lattice;
    // Again, since elements of one level make room when they are divided into those of the next.
    for (int left = 0, pass = 0;; pass++, left = 0) {
        enum { EACH = 3 };
        int divided = 0;
        for (int level = lattice->levels; level > 0; level--) {
            const int count =
                cut_blades_find_larger(&cuts->blades, vertices_row(vertices), sweep, level);
            const int now = cut_lattice_divide(lattice, blades->larger, count);
            if (now > 0)
                follow_inside(cuts, body, change);
            divided += now;
            for (int k = 0; k < count; k++)
                left += lattice->divided[blades->larger[k]] ? 0 : EACH << 2 * level;
        }
        if (left == 0 || divided == 0 || pass == CLEAR_PASSES)
            return left;
    }
}

// Divides what is in the way of faces that are to break, so that they part the body at once.
// Returns how many faces there is no room for.
static int clear_faces(VoxelCuts *cuts, Body *body, const int (*face)[2], int count,
                       TopologyChange *change)
{
    for (int left, pass = 0;; pass++) {
        const int divided = cut_lattice_clear(&cuts->lattice, face, count, INT_MAX, &left);
        if (divided > 0)
            follow_inside(cuts, body, change);
        if (left == 0 || divided == 0 || pass == CLEAR_PASSES)
            return left;
    }
}

// Refuses a cut since what is in its way takes this many nodes more than there were, `room`. Its
// faces, of which not all are known, take a quarter of what their surroundings do.
static bool refuse_division(int room, int more, CutOutcome *outcome)
{
    outcome->verdict = CUT_NO_NODES;
    outcome->separated = 0;
    outcome->room = room;
    outcome->needed = room + more + (room + more) / 4;
    return false;
}

// Finds the faces that a sweep breaks, and divides what is in their way. False with the reason, or
// if there are none. All or nothing: a cut that does not fit breaks no face.
static bool prepare_cut(VoxelCuts *cuts, Body *body, const CutSweep *sweep, CutOutcome *outcome,
                        TopologyChange *change)
{
    const VoxelModel *model = body->model;
    CutBlades *blades = &cuts->blades;
    const double tick = body->h * body->substeps;
    const bool adapts = cuts->lattice.adapts;
    const int room = cut_parts_spare(&cuts->lattice);
    int more = adapts && sweep->phase == CUT_WHOLE ? clear_sweep(cuts, body, sweep, change) : 0;
    if (more > 0)
        return refuse_division(room, more, outcome);
    if (!cut_blades_find(blades, vertices_row(&model->vertices), tick, sweep, outcome))
        return false;
    const int(*hit)[2] = (const int(*)[2])blades->hit;
    const bool counted = adapts && blades->hit_count <= blades->hit_most;
    if (counted)
        more = NODE_CORNERS * clear_faces(cuts, body, hit, blades->hit_count, change);
    if (more > 0)
        return refuse_division(room, more, outcome);
    if (has_room(cuts, outcome, counted ? hit : NULL, blades->hit_count))
        return true;
    outcome->separated = 0;
    if (outcome->verdict == CUT_NO_NODES) {
        outcome->needed += room - outcome->room;
        outcome->room = room;
    }
    return false;
}

bool cut_body_cut(Body *body, const CutSweep *sweep, CutOutcome *outcome, TopologyChange *change)
{
    VoxelCuts *cuts = ((const VoxelModel *)body->model)->cuts;
    const CutBlades *blades = &cuts->blades;
    const bool command = cuts->lattice.adapts && sweep->phase == CUT_WHOLE;
    if (command)
        cut_lattice_note(&cuts->lattice);
    if (prepare_cut(cuts, body, sweep, outcome, change))
        return break_faces(cuts, body, ACCOUNT_CUT, (const int(*)[2])blades->hit, blades->crossing,
                           blades->hit_count, outcome, change);
    // What was divided for it would stay as costly as what it did not cut.
    while (command && cut_lattice_undivide(&cuts->lattice) > 0)
        follow_inside(cuts, body, change);
    return false;
}

// Divides what is in the way of faces that are to tear, as many as the budget allows, and leaves in
// the list those that nothing is in the way of: the others tear in a later tick, if they still do.
static void clear_torn(VoxelCuts *cuts, Body *body, TopologyChange *change)
{
    CutTear *tear = &cuts->tear;
    CutLattice *lattice = &cuts->lattice;
    int divided = 0, kept = 0;
    for (int k = 0; k < tear->hit_count; k++) {
        int left;
        divided += cut_lattice_clear(lattice, (const int(*)[2])tear->hit + k, 1,
                                     lattice->split_budget - divided, &left);
        if (left > 0)
            continue;
        tear->hit[kept][0] = tear->hit[k][0];
        tear->hit[kept++][1] = tear->hit[k][1];
    }
    tear->hit_count = kept;
    if (divided > 0)
        follow_inside(cuts, body, change);
}

bool cut_body_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change)
{
    (void)tick;
    const VoxelModel *model = body->model;
    VoxelCuts *cuts = model->cuts;
    CutTear *tear = &cuts->tear;
    const VoxelPass pass = voxel_pass(model, vertices_row(&model->vertices));
    const bool adapts = cuts->lattice.adapts;
    *outcome = (CutOutcome){.verdict = CUT_MET_NOTHING};
    if (!cut_tear_find(tear, &pass))
        return false;
    if (adapts)
        clear_torn(cuts, body, change);
    const int(*hit)[2] = (const int(*)[2])tear->hit;
    if (tear->hit_count == 0 || !has_room(cuts, outcome, adapts ? hit : NULL, tear->hit_count))
        return false;
    return break_faces(cuts, body, ACCOUNT_TEAR, hit, NULL, tear->hit_count, outcome, change);
}

bool cut_body_reconstruct(Body *body, TopologyChange *change)
{
    VoxelCuts *cuts = ((VoxelModel *)body->model)->cuts;
    if (cuts->lattice.wanted_count == 0)
        return false;
    if (cut_lattice_reconstruct(&cuts->lattice) == 0) {
        cuts->refused++;
        return false;
    }
    return cut_body_follow(cuts, body, true, false, change);
}

void cut_body_approach(void *self, const Approach *approach, int count)
{
    cut_adapt_approach(((VoxelModel *)self)->cuts->adapt, approach, count);
}

bool cut_body_adapt(Body *body, int64_t step, double tick, TopologyChange *change)
{
    (void)step;
    const VoxelModel *model = body->model;
    VoxelCuts *cuts = model->cuts;
    const int64_t refused = cuts->adapt->refused;
    bool merged;
    cut_release_begin(cuts->release, tick);
    cuts->adapt->stressed = cuts->tear.stressed;
    cuts->adapt->stressed_count = cuts->tear.stressed_count;
    cuts->tear.stressed_count = 0;
    const int changed = cut_adapt_step(cuts->adapt, vertices_row(&model->vertices), &merged);
    cuts->refused += cuts->adapt->refused > refused;
    if (changed > 0)
        follow_inside(cuts, body, change);
    cuts->adapt->free = false;
    cut_release_note(cuts->release, cuts->adapt->approach_count > 0);
    return false;
}

// Sets the bounds of the step: coagulated elements are stiffer, and damped as elements that
// stiffen.
static void set_bounds(const VoxelCuts *cuts, Body *body)
{
    const bool stiffer = cuts->heat->cooked_count > 0;
    body->lambda = cuts->lambda * (stiffer ? cuts->heat->stiffer : 1.0);
    body->damping = cuts->damping * (stiffer ? sqrt(cuts->heat->stiffer) : 1.0);
}

// Elements that become stiff change no vertex: only their batches follow.
bool cut_body_conduct(Body *body, double tick, bool *shown)
{
    VoxelCuts *cuts = ((VoxelModel *)body->model)->cuts;
    CutHeat *heat = cuts->heat;
    const bool stiffer = cut_heat_spread(heat, tick);
    *shown = cut_heat_shows(heat, tick);
    if (!stiffer)
        return false;
    for (int k = 0; k < heat->changed_count; k++)
        cut_parts_list_element(&cuts->lattice, heat->changed[k]);
    cut_windows_update(&cuts->windows);
    cut_lattice_forget_changes(&cuts->lattice);
    set_bounds(cuts, body);
    return true;
}

void cut_body_reserve_blades(void *self, int blades, Arena *arena, StateList *state)
{
    VoxelCuts *cuts = ((VoxelModel *)self)->cuts;
    cut_blades_reserve(&cuts->blades, cuts->name, blades, arena, state);
}

// ---------------------------------------------------------------------------------------------
// Restored states

// False: an impossible state.
static bool derive(VoxelCuts *cuts, Body *body)
{
    if (!cut_lattice_derive(&cuts->lattice))
        return false;
    cut_masses_derive(&cuts->masses);
    if (cuts->carry != NULL)
        cut_carry_derive(cuts->carry);
    const bool heat = cuts->heat == NULL || cut_heat_derive(cuts->heat);
    if (cuts->heat != NULL)
        set_bounds(cuts, body);
    cut_windows_restored(&cuts->windows);
    const bool pieces = cut_pieces_derive(&cuts->pieces);
    cut_account_derive(&cuts->account);
    const bool faces = cut_faces_derive(&cuts->faces, body);
    if (cuts->fit != NULL)
        cut_fit_derive(cuts->fit, body);
    if (cuts->tension != NULL && faces)
        cut_tension_follow(cuts->tension);
    const bool adapt =
        cuts->adapt == NULL || (cut_adapt_derive(cuts->adapt) && cut_release_check(cuts->release));
    cut_body_count_elements(cuts, body);
    if (cuts->reach != NULL)
        cut_body_count_gone(cuts, body);
    return pieces && faces && heat && adapt && (cuts->reach == NULL || cuts->present > 0);
}

void cut_body_restored(VoxelCuts *cuts, Body *body)
{
    cuts->sound = derive(cuts, body);
    cut_blades_restored(&cuts->blades);
    if (cuts->reach != NULL)
        cut_reach_restored(cuts->reach);
}

void cut_body_restore(VoxelCuts *cuts, RestoreMode mode)
{
    if (cuts->carry != NULL)
        cut_carry_forget(cuts->carry);
    if (cuts->tear.felt != NULL)
        cut_tear_forget(&cuts->tear);
    if (cuts->release != NULL)
        cut_release_forget(cuts->release, true);
    if (mode == RESTORE_SHAPE)
        cut_blades_forget(&cuts->blades);
}

// ---------------------------------------------------------------------------------------------
// Ticks, and what others read

void cut_body_committed(VoxelCuts *cuts)
{
    const CutMasses *masses = &cuts->masses;
    for (int k = 0; k < masses->retired_count; k++)
        vertices_retire(masses->vertices, masses->retired[k]);
    if (cuts->carry != NULL && masses->vertices->drags != NULL)
        cut_masses_clear_free(masses);
}

void cut_body_read(const VoxelModel *model, const int *vertex, int count, Vec3 *position,
                   Vec3 *velocity)
{
    const Vertices *vertices = &model->vertices;
    CutCarry *carry = model->cuts->carry;
    FitWeight weight[NODE_COUNT];
    const bool within = vertices->present != vertices_row(vertices); // a tick
    for (int i = 0; i < count; i++) {
        if (!within || !cut_lattice_is_carried(carry->lattice, vertex[i])) {
            const void *row =
                within ? vertices->present : cut_carry_rows(carry, vertices->present, vertex[i]);
            rows_read(&vertices->rows, row, vertex[i], &position[i],
                      velocity == NULL ? NULL : &velocity[i]);
            continue;
        }
        const int carriers = cut_carry_weights(carry, vertex[i], weight);
        Vec3 x = {0.0, 0.0, 0.0}, v = {0.0, 0.0, 0.0};
        for (int w = 0; w < carriers; w++) {
            Vec3 at, speed;
            rows_read(&vertices->rows, vertices->present, weight[w].vertex, &at, &speed);
            x = vec3_madd(x, weight[w].weight, at);
            v = vec3_madd(v, weight[w].weight, speed);
        }
        position[i] = x;
        if (velocity != NULL)
            velocity[i] = v;
    }
}

// ---------------------------------------------------------------------------------------------
// What acts on vertices that others carry

void cut_body_add_forces(VoxelModel *model, const int *vertex, int count, const Vec3 *force)
{
    vertices_add_forces(&model->vertices, vertex, count, force);
    cut_carry_spread(model->cuts->carry, model->vertices.force, vertex, count);
}

void cut_body_carry_loads(VoxelModel *model)
{
    const Vertices *vertices = &model->vertices;
    cut_carry_spread(model->cuts->carry, vertices->force, vertices->loaded, vertices->loaded_count);
}

void cut_body_kick(VoxelModel *model, int vertex, Vec3 impulse, double drift)
{
    const CutCarry *carry = model->cuts->carry;
    FitWeight weight[NODE_COUNT];
    if (!cut_lattice_is_carried(carry->lattice, vertex)) {
        vertices_kick(&model->vertices, vertex, impulse, drift);
        return;
    }
    const int carriers = cut_carry_weights(carry, vertex, weight);
    for (int w = 0; w < carriers; w++)
        vertices_kick(&model->vertices, weight[w].vertex, vec3_scale(weight[w].weight, impulse),
                      drift);
}

void cut_body_feel(VoxelCuts *cuts)
{
    if (cuts->tear.felt != NULL)
        cut_tear_feel(&cuts->tear);
}

void cut_body_feel_kick(VoxelCuts *cuts, const int *vertex, int count, const Vec3 *impulse,
                        double h)
{
    double *felt = cuts->tear.felt;
    for (int i = 0; i < count && felt != NULL; i++)
        felt[vertex[i]] = fmax(felt[vertex[i]], vec3_dot(impulse[i], impulse[i]) / (h * h));
}

int cut_body_account(const void *self, TissueAccount *account, int capacity)
{
    return cut_account_tissues(&((const VoxelModel *)self)->cuts->account, account, capacity);
}

const BodySections *cut_body_sections(const void *self)
{
    return cut_account_sections(&((const VoxelModel *)self)->cuts->account);
}

void cut_body_visit(void *self, Vec3 place)
{
    VoxelModel *model = self;
    const Vertices *vertices = &model->vertices;
    cut_account_visit(&model->cuts->account, &vertices->rows, vertices_row(vertices), place);
}

void cut_body_explain(const VoxelCuts *cuts, FILE *out)
{
    fprintf(out, "    cuttable: memory for %d vertices, %d triangles; %d divisions a tick\n",
            cuts->lattice.vertex_capacity, 2 * cuts->faces.square_capacity,
            cuts->lattice.split_budget);
    if (cuts->lattice.leaf_row != NULL)
        fprintf(out, "    adapts: memory for %d of %d cells and %d of %d larger elements\n",
                cuts->lattice.most_cells, cuts->lattice.level_first[1], cuts->lattice.most_larger,
                cuts->lattice.element_count - cuts->lattice.level_first[1]);
    if (cuts->heat != NULL)
        fprintf(out, "    heat: %d cells, of which %d pass heat on in a tick\n",
                cuts->heat->cell_count, HEAT_VISITS);
    if (cuts->tear.stress > 0.0)
        fprintf(out, "    tears: where it is pulled with more than %g Pa\n", cuts->tear.stress);
    if (cuts->tension != NULL)
        fprintf(out, "    tension at rest: opens cuts, up to %g Pa\n", cuts->tension->most);
    if (cuts->tear.force > 0.0)
        fprintf(out, "    tears: at vertices pushed or pulled with more than %g N\n",
                cuts->tear.force);
}
