#include "voxel/cut/cut_body.h"

// ---------------------------------------------------------------------------------------------
// Changes of topology

// Updates all data derived from elements and vertices, in the order of their dependencies.
static bool follow(VoxelCuts *cuts, Body *body, bool divided, bool pieces_came,
                   TopologyChange *change)
{
    cut_masses_follow(&cuts->masses, divided);
    cut_windows_update(&cuts->windows);
    bool shown = cut_faces_follow(&cuts->faces, pieces_came, body, change);
    body->element_count = cuts->lattice.leaf_count;
    cut_lattice_forget_changes(&cuts->lattice);
    return shown;
}

static bool has_room(VoxelCuts *cuts, CutOutcome *outcome, int faces)
{
    const CutLattice *lattice = &cuts->lattice;
    if (!cut_lattice_has_room(lattice, faces)) {
        outcome->verdict = CUT_NO_NODES;
        outcome->needed = 4 * faces;
        outcome->room = lattice->vertex_capacity - cut_lattice_used(lattice);
        return false;
    }
    if (!cut_faces_has_room(&cuts->faces, faces, &outcome->needed, &outcome->room)) {
        outcome->verdict = CUT_NO_FACES;
        return false;
    }
    return true;
}

// Breaks faces {cell, axis}, if the capacity is sufficient.
static bool break_faces(VoxelCuts *cuts, Body *body, const int (*face)[2], int count,
                        CutOutcome *outcome, TopologyChange *change)
{
    const int before = cut_lattice_used(&cuts->lattice);
    cut_lattice_break(&cuts->lattice, face, count);
    const bool pieces_came = cut_pieces_follow(&cuts->pieces, face, count);
    const bool changed = follow(cuts, body, false, pieces_came, change);
    outcome->verdict = CUT_DONE;
    outcome->separated = count;
    outcome->nodes_added = cut_lattice_used(&cuts->lattice) - before;
    outcome->pieces = (int)*cuts->pieces.count;
    outcome->small_pieces = cuts->pieces.small_count;
    return changed;
}

bool cut_body_cut(Body *body, const CutSweep *sweep, CutOutcome *outcome, TopologyChange *change)
{
    const VoxelModel *model = body->model;
    VoxelCuts *cuts = model->cuts;
    const void *row = vertices_row(&model->vertices);
    const double tick = body->h * body->substeps;
    if (!cut_blades_find(&cuts->blades, row, tick, sweep, outcome))
        return false;
    if (!has_room(cuts, outcome, cuts->blades.hit_count)) {
        outcome->separated = 0;
        cut_blades_refused(&cuts->blades, row, sweep);
        return false;
    }
    return break_faces(cuts, body, (const int(*)[2])cuts->blades.hit, cuts->blades.hit_count,
                       outcome, change);
}

bool cut_body_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change)
{
    (void)tick;
    const VoxelModel *model = body->model;
    VoxelCuts *cuts = model->cuts;
    const VoxelPass pass = voxel_pass(model, vertices_row(&model->vertices));
    *outcome = (CutOutcome){.verdict = CUT_MET_NOTHING};
    if (!cut_tear_find(&cuts->tear, &pass) || !has_room(cuts, outcome, cuts->tear.hit_count))
        return false;
    return break_faces(cuts, body, (const int(*)[2])cuts->tear.hit, cuts->tear.hit_count, outcome,
                       change);
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
    return follow(cuts, body, true, false, change);
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
    cut_windows_restored(&cuts->windows);
    const bool pieces = cut_pieces_derive(&cuts->pieces);
    const bool faces = cut_faces_derive(&cuts->faces, body);
    body->element_count = cuts->lattice.leaf_count;
    return pieces && faces;
}

void cut_body_restored(VoxelCuts *cuts, Body *body)
{
    cuts->sound = derive(cuts, body);
    cut_blades_restored(&cuts->blades);
}

void cut_body_restore(VoxelCuts *cuts, RestoreMode mode)
{
    if (cuts->tear.felt != NULL)
        cut_tear_forget(&cuts->tear);
    if (mode == RESTORE_SHAPE)
        cut_blades_forget(&cuts->blades);
}

// ---------------------------------------------------------------------------------------------

void cut_body_feel(VoxelCuts *cuts)
{
    if (cuts->tear.felt != NULL)
        cut_tear_feel(&cuts->tear);
}

void cut_body_explain(const VoxelCuts *cuts, FILE *out)
{
    fprintf(out, "    cuttable: room for %d vertices, %d triangles; %d divisions a tick\n",
            cuts->lattice.vertex_capacity, 2 * cuts->faces.square_capacity,
            cuts->lattice.split_budget);
    if (cuts->tear.stress > 0.0)
        fprintf(out, "    tears: where it is pulled with more than %g Pa\n", cuts->tear.stress);
    if (cuts->tear.force > 0.0)
        fprintf(out, "    tears: at vertices pushed or pulled with more than %g N\n",
                cuts->tear.force);
}
