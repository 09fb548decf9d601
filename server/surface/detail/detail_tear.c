// SPDX-License-Identifier: MIT
// A body that tears where it is stretched too far (server/surface/cut/README.md, "Tearing"): edges
// break one after the other at the front of a crack, as a blade would break them. Step thread.
#include "surface/detail/detail.h"

#include <math.h>
#include <string.h>

#define SMOOTHING   (1.0 / 3.0) // of the stretch, per tick: the wave of an impact must not tear
#define WITHOUT_TIP 1.5         // times the stretch at which a crack continues: for it to begin

enum { TEARS_MOST = 64, DIVIDED_MOST = 64 }; // edges and faces per tick

void detail_tear_create(Detail *detail, const SurfaceOptions *options, Arena *arena,
                        StateList *state)
{
    DetailCut *cut = detail->set.cut;
    size_t edges = (size_t)detail->set.levels.level[detail->set.levels.finest].edge_count;
    cut->stretch = arena_allocate(arena, ARENA_TOPOLOGY, edges, sizeof *cut->stretch,
                                  "%s/stretch of edges", options->body.name);
    cut->torn = arena_allocate(arena, ARENA_TOPOLOGY, edges, sizeof *cut->torn, "%s/torn edges",
                               options->body.name);
    cut->is_tip = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)detail->set.node_count,
                                 sizeof *cut->is_tip, "%s/tips", options->body.name);
    state_add(state, cut->stretch, edges * sizeof *cut->stretch, "%s/stretch", options->body.name);
}

bool detail_tear_check(const LeafSet *set)
{
    const float *stretch = set->cut->stretch;
    for (int e = 0; stretch != NULL && e < set->levels.level[set->levels.finest].edge_count; e++)
        if (!(fabsf(stretch[e]) < 1e30f))
            return false;
    return true;
}

void detail_tear_forget(LeafSet *set)
{
    DetailCut *cut = set->cut;
    if (cut->stretch != NULL)
        memset(cut->stretch, 0,
               (size_t)set->levels.level[set->levels.finest].edge_count * sizeof *cut->stretch);
}

static int side_of(const Level *level, int face, int edge)
{
    const int *edges = level->face_edge[face];
    return edges[0] == edge ? 0 : edges[1] == edge ? 1 : 2;
}

static Vec3 position_of(SurfaceModel *model, int node)
{
    DetailCut *cut = model->detail->set.cut;
    if (cut->seen[node] != cut->looks) {
        cut->seen[node] = cut->looks;
        rows_read(&model->basis, model->rows[model->current], model->slot[node],
                  &cut->position[node], NULL);
    }
    return cut->position[node];
}

// Returns the height of two faces over their common edge together, from its ends and the opposite
// corners [m]: the width of tissue that would gape if the edge broke.
static double width_of(const Vec3 end[2], const Vec3 apex[2])
{
    Vec3 edge = vec3_sub(end[1], end[0]);
    double length = vec3_length(edge), area = 0.0;
    for (int side = 0; side < 2; side++)
        area += vec3_length(vec3_cross(edge, vec3_sub(apex[side], end[0])));
    return length > 0.0 ? area / length : 0.0;
}

// Returns the relative widening of the two leaves across their edge since rest. (Not the distance
// of the opposite corners: for right-angled faces pulled along a side it hardly distinguishes edges
// across the pull from diagonals.)
static double stretch_of(SurfaceModel *model, const Level *level, int edge)
{
    Vec3 now[2][2], rest[2][2]; // ends, opposite corners
    for (int side = 0; side < 2; side++) {
        int face = level->edge_face[edge][side], k = side_of(level, face, edge);
        const int node[2] = {level->face[face][k], level->face[face][(k + 2) % 3]};
        for (int i = 0; i < 2; i++) {
            now[i][side] = position_of(model, node[i]);
            rest[i][side] = model_rest(model, model->slot[node[i]]);
        }
    }
    double before = width_of(rest[0], rest[1]);
    return before > 0.0 ? width_of(now[0], now[1]) / before - 1.0 : 0.0;
}

// Marks nodes where a crack can continue: at a border or a broken edge of their own faces.
static void mark_tips(LeafSet *set)
{
    DetailCut *cut = set->cut;
    const Level *finest = &set->levels.level[set->levels.finest];
    memset(cut->is_tip, 0, (size_t)set->node_count * sizeof *cut->is_tip);
    for (int f = 0; f < finest->face_count; f++)
        for (int k = 0; k < 3 && !detail_cut_is_gone(cut, f); k++)
            if ((cut->broken[f] >> k & 1) != 0 ||
                levels_beyond(finest, finest->face_edge[f][k], f) < 0)
                cut->is_tip[cut->node[f][k]] = cut->is_tip[cut->node[f][(k + 1) % 3]] = true;
}

// Updates the smoothed stretch of the edges between leaves of the finest level; lists those that
// tear, the most stretched first.
static int list_torn(SurfaceModel *model)
{
    Detail *detail = model->detail;
    const LeafSet *set = &detail->set;
    DetailCut *cut = set->cut;
    const Level *finest = &set->levels.level[set->levels.finest];
    const double least = detail->options.tear_stretch;
    int count = 0;
    for (int e = 0; e < finest->edge_count; e++) {
        const int *face = finest->edge_face[e];
        if (face[0] < 0 || face[1] < 0 || !detail_exists(set, set->levels.finest, face[0]) ||
            !detail_exists(set, set->levels.finest, face[1]) ||
            detail_is_broken(set, set->levels.finest, face[0], side_of(finest, face[0], e))) {
            cut->stretch[e] = 0.0f;
            continue;
        }
        double s = (double)cut->stretch[e];
        s += SMOOTHING * (stretch_of(model, finest, e) - s);
        cut->stretch[e] = (float)s;
        if (!(s > least))
            continue;
        // A crack continues at a lower stretch than it begins.
        const int *corner = cut->node[face[0]];
        int k = side_of(finest, face[0], e);
        bool goes_on = cut->is_tip[corner[k]] || cut->is_tip[corner[(k + 1) % 3]];
        if (!goes_on && !(s > WITHOUT_TIP * least))
            continue;
        // Insert into the sorted list of the most stretched.
        if (count == TEARS_MOST && cut->stretch[cut->torn[count - 1]] >= cut->stretch[e])
            continue;
        int at = count < TEARS_MOST ? count++ : count - 1;
        for (; at > 0 && cut->stretch[cut->torn[at - 1]] < cut->stretch[e]; at--)
            cut->torn[at] = cut->torn[at - 1];
        cut->torn[at] = e;
    }
    return count;
}

// Keeps only the first of those at one node: its tear relieves the others.
static int keep_one_a_tip(Detail *detail, int count)
{
    DetailCut *cut = detail->set.cut;
    const Level *finest = &detail->set.levels.level[detail->set.levels.finest];
    bool *is_taken = detail->faces.is_redrawn; // false between changes
    int kept = 0, ends[2 * TEARS_MOST];
    for (int i = 0; i < count; i++) {
        int edge = cut->torn[i], face = finest->edge_face[edge][0];
        int k = side_of(finest, face, edge);
        int a = cut->node[face][k], b = cut->node[face][(k + 1) % 3];
        // An end that tears here tears nowhere else in this tick.
        if (is_taken[a] || is_taken[b])
            continue;
        is_taken[a] = is_taken[b] = true;
        ends[2 * kept] = a;
        ends[2 * kept + 1] = b;
        cut->torn[kept++] = edge;
    }
    for (int i = 0; i < 2 * kept; i++)
        is_taken[ends[i]] = false;
    return kept;
}

// Only the finest level tears: coarser leaves with that stretch are divided.
static void refine_stretched(SurfaceModel *model)
{
    Detail *detail = model->detail;
    const LeafSet *set = &detail->set;
    const int64_t most = detail->adapt.sweep->refined + DIVIDED_MOST;
    for (int l = 0; l < set->levels.finest; l++) {
        const Level *at = &set->levels.level[l];
        for (int e = 0; e < at->edge_count && set->leaf_count[l] > 0; e++) {
            const int *face = at->edge_face[e];
            if (detail->adapt.sweep->refined >= most)
                return;
            // Edges between two leaves of this level that are stretched too far.
            if (face[0] < 0 || face[1] < 0 || !detail_is_leaf(set, l, face[0]) ||
                !detail_is_leaf(set, l, face[1]) ||
                !(stretch_of(model, at, e) > detail->options.tear_stretch))
                continue;
            detail_refine(model, l, face[0]);
            detail_refine(model, l, face[1]);
        }
    }
}

bool detail_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change)
{
    (void)tick;
    SurfaceModel *model = body->model;
    Detail *detail = model->detail;
    DetailCut *cut = detail->set.cut;
    *outcome = (CutOutcome){.verdict = CUT_MET_NOTHING};
    cut->looks++;
    mark_tips(&detail->set);
    // What is to tear, before anything is refined.
    int count = keep_one_a_tip(detail, list_torn(model));
    detail_begin_change(model);
    refine_stretched(model);
    if (count > 0 && detail_cut_break(model, cut->torn, count, outcome))
        outcome->verdict = CUT_DONE;
    // What has become of the body.
    outcome->pieces = cut->piece_count;
    outcome->small_pieces = cut->small_count;
    if (outcome->verdict == CUT_DONE)
        detail_end_cut(body);
    else if (!detail_end_change(body))
        return false;
    *change = detail->report.change;
    return true;
}
