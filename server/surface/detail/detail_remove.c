// SPDX-License-Identifier: MIT
// Removes faces of the finest level for good: their edges break as those of a cut, then they are no
// leaves any more, and nodes without faces are switched off (server/surface/cut/README.md,
// "Removing"). All follows from one more bit of each face. Step thread.
#include "surface/detail/detail.h"

#include "geometry/distance.h"

#include <string.h>

enum { REMOVED_MOST = 32 }; // faces in one call

// Faces to be removed, the nearest first.
typedef struct Taken {
    CutTissue tissue; // around the mouth
    int count, face[REMOVED_MOST];
    double distance[REMOVED_MOST];          // of their centroids from the axis [m]
    int edge_count, edge[3 * REMOVED_MOST]; // of theirs that are not broken yet
    int node_count, node[3 * REMOVED_MOST]; // of theirs that may have lost their last face
} Taken;

// --- what is removed ---

static double face_area(const Detail *detail, int face)
{
    return level_rules_area(&detail->rules, detail->set.levels.finest, face);
}

// Inserts a face into the list of the nearest; the lowest first of those as near.
static void insert(Taken *taken, int face, double distance)
{
    if (taken->count == REMOVED_MOST && !(distance < taken->distance[REMOVED_MOST - 1]))
        return;
    int at = taken->count < REMOVED_MOST ? taken->count++ : REMOVED_MOST - 1;
    for (; at > 0 && taken->distance[at - 1] > distance; at--) {
        taken->face[at] = taken->face[at - 1];
        taken->distance[at] = taken->distance[at - 1];
    }
    taken->face[at] = face;
    taken->distance[at] = distance;
}

static double distance_to_face(const Region *mouth, const Vec3 x[3])
{
    ClosestPair pair[DISTANCE_PAIRS];
    double along, weight[3], least = (double)INFINITY;
    if (distance_segment_crosses(mouth->from, mouth->to, x, &along, weight))
        return 0.0;
    distance_segment_triangle_pairs(mouth->from, mouth->to, x, pair);
    for (int i = 0; i < DISTANCE_PAIRS; i++)
        least = fmin(least, pair[i].distance);
    return least;
}

// Lists the nearest faces within reach, also those that do not exist yet: whose centroids are in
// the mouth; or what a burr or an electrode touches, as it may push away what it does not take.
static void find_within(SurfaceModel *model, const Removal *removal, Taken *taken)
{
    const Region *mouth = &removal->mouth;
    const BladeEdge axis = {{mouth->from, mouth->to}};
    detail_cut_look(model, &axis, 1, mouth->radius, &taken->tissue);
    const CutTissue tissue = taken->tissue;
    taken->count = 0;
    for (int i = 0; i < tissue.face_count; i++) {
        Vec3 x[3];
        for (int k = 0; k < 3; k++)
            x[k] = tissue.position[tissue.corner[tissue.face[i]][k]];
        const Vec3 middle = vec3_scale(1.0 / 3.0, vec3_add(x[0], vec3_add(x[1], x[2])));
        const double distance = removal->kind == REMOVER_SUCTION
                                    ? distance_point_segment(middle, mouth->from, mouth->to)
                                    : distance_to_face(mouth, x);
        if (distance <= mouth->radius)
            insert(taken, tissue.face[i], distance);
    }
}

// Keeps no more of them than the amount.
static void keep_amount(const Detail *detail, double amount, Taken *taken)
{
    int kept = 0;
    while (kept < taken->count && (amount -= face_area(detail, taken->face[kept])) >= 0.0)
        kept++;
    taken->count = kept;
}

// Heats them, and keeps those that boil away.
static void keep_boiled(Detail *detail, int64_t step, const Removal *removal, Taken *taken,
                        RemovalOutcome *outcome)
{
    int kept = 0;
    outcome->heat = detail_heat_give(detail, step, removal, taken->face, taken->count);
    for (int i = 0; i < taken->count; i++)
        if (detail_heat_boils_away(detail, taken->face[i]))
            taken->face[kept++] = taken->face[i];
    taken->count = kept;
}

// --- their edges, nodes and what leaves with them ---

static void mark_gone(DetailCut *cut, const Taken *taken, bool gone)
{
    for (int i = 0; i < taken->count; i++) {
        unsigned char *bits = &cut->broken[taken->face[i]];
        *bits = (unsigned char)(gone ? *bits | CUT_GONE : *bits & ~CUT_GONE);
    }
}

static void list_edges(const LeafSet *set, Taken *taken)
{
    const Level *finest = &set->levels.level[set->levels.finest];
    taken->edge_count = 0;
    for (int i = 0; i < taken->count; i++)
        for (int k = 0; k < 3; k++) {
            const int face = taken->face[i], edge = finest->face_edge[face][k],
                      across = levels_beyond(finest, edge, face);
            // An edge between two of them once.
            if (across >= 0 && (set->cut->broken[face] >> k & 1) == 0 &&
                !(across < face && detail_cut_is_gone(set->cut, across)))
                taken->edge[taken->edge_count++] = edge;
        }
}

// Lets the rim go along the mouth.
static void round_off(const LeafSet *set, const Region *mouth, const Taken *taken)
{
    DetailCut *cut = set->cut;
    for (int i = 0; i < taken->edge_count; i++) {
        const int edge = taken->edge[i], *face = cut->uncut.edge_face[edge];
        if (detail_cut_is_gone(cut, face[0]) != detail_cut_is_gone(cut, face[1]))
            cut_lips_around(&cut->finder, &taken->tissue, edge, mouth, set->levels.position,
                            cut->crossing);
    }
}

// Takes a face from its nodes.
static void take_face(SurfaceModel *model, int face, Taken *taken, RemovalOutcome *outcome)
{
    Detail *detail = model->detail;
    DetailCut *cut = detail->set.cut;
    const double area = face_area(detail, face), mass = detail->rules.areal_density * area;
    for (int k = 0; k < 3; k++) {
        const int node = cut->node[face][k];
        Vec3 x, v;
        rows_read(&model->basis, model->rows[model->current], model->slot[node], &x, &v);
        outcome->momentum = vec3_madd(outcome->momentum, mass / 3.0, v);
        detail_mark(model, node);
        taken->node[taken->node_count++] = node;
    }
    memcpy(cut->node[face], cut->base[face], sizeof cut->node[face]);
    if (cut->heat != NULL)
        cut->heat->energy[face] = 0.0;
    // Those across its edges are drawn again, too: they have a neighbour less.
    const int level = detail->set.levels.finest;
    const Level *finest = &detail->set.levels.level[level];
    detail_touch(&detail->faces, level, face);
    for (int k = 0; k < 3; k++) {
        const int across = levels_beyond(finest, finest->face_edge[face][k], face);
        if (across >= 0)
            detail_touch(&detail->faces, level, across);
    }
    detail->set.leaf_count[level]--;
    outcome->area += area;
    outcome->mass += mass;
}

// Switches off the nodes that have lost their last face.
static void drop_nodes(SurfaceModel *model, const Taken *taken)
{
    Detail *detail = model->detail;
    DetailReport *report = &detail->report;
    TopologyChange *change = &report->change;
    LeafSet *set = &detail->set;
    bool *is_dropped = detail->faces.is_redrawn; // false between changes
    const int first = change->gone_count;
    for (int i = 0; i < taken->node_count; i++) {
        const int node = taken->node[i];
        if (set->status[node] == NODE_OFF || detail_leaves_around(set, node, set->ring[0]) > 0)
            continue;
        set->status[node] = NODE_OFF;
        detail->pack.stale_window[model->slot[node] / detail->pack.width] = true;
        detail_switch_off(model, node);
        detail_lips_forget(&set->cut->lips, node);
        slots_free_node(detail->faces.slots, node);
        is_dropped[node] = true;
        report->gone_parent[change->gone_count][0] = report->gone_parent[change->gone_count][1] =
            NODE_NONE;
        report->gone[change->gone_count++] = node;
    }
    // One that this very change has made was never there.
    int born = 0, gone = first;
    for (int i = 0; i < change->born_count; i++) {
        if (!is_dropped[report->born[i].node])
            report->born[born++] = report->born[i];
        is_dropped[report->born[i].node] = false;
    }
    for (int i = first; i < change->gone_count; i++) {
        if (is_dropped[report->gone[i]])
            report->gone[gone++] = report->gone[i];
        is_dropped[report->gone[i]] = false;
    }
    change->born_count = born;
    change->gone_count = gone;
}

// Removes the faces; false with what is missing if the cuts around them do not fit.
static bool take(Body *body, const Region *mouth, Taken *taken, RemovalOutcome *outcome)
{
    SurfaceModel *model = body->model;
    Detail *detail = model->detail;
    DetailCut *cut = detail->set.cut;
    CutOutcome around = {.verdict = CUT_DONE};
    const int pieces = cut->piece_count;
    // The bits first: a removed face needs no nodes of its own.
    mark_gone(cut, taken, true);
    list_edges(&detail->set, taken);
    round_off(&detail->set, mouth, taken);
    if (!detail_cut_break(model, taken->edge, taken->edge_count, &around)) {
        mark_gone(cut, taken, false);
        for (int i = 0; i < taken->edge_count; i++)
            cut->crossing[taken->edge[i]] = (LipCrossing){{0.0f}, {0.0f}};
        outcome->verdict = around.verdict;
        outcome->needed = around.needed;
        outcome->room = around.room;
        return false;
    }
    taken->node_count = 0;
    for (int i = 0; i < taken->count; i++)
        take_face(model, taken->face[i], taken, outcome);
    drop_nodes(model, taken);
    if (cut->piece_count != pieces)
        detail_frames_start(detail);
    detail_end_cut(body);
    outcome->removed = taken->count;
    outcome->nodes_added = around.nodes_added;
    return true;
}

static double coagulated_area(const Detail *detail)
{
    const unsigned char *broken = detail->set.cut->broken;
    double area = 0.0;
    for (int f = 0; f < detail->set.face_count; f++)
        if ((broken[f] & (CUT_COAGULATED | CUT_GONE)) == CUT_COAGULATED)
            area += face_area(detail, f);
    return area;
}

bool detail_remove(Body *body, const Removal *removal, RemovalOutcome *outcome,
                   TopologyChange *change)
{
    SurfaceModel *model = body->model;
    Detail *detail = model->detail;
    const DetailCut *cut = detail->set.cut;
    *outcome = (RemovalOutcome){.verdict = CUT_MET_NOTHING};
    Taken taken;
    const FrameStart start = detail_cut_begin(model);
    find_within(model, removal, &taken);
    // Never the last face: a body is somewhere.
    const int most = detail->set.face_count - cut->gone_count - 1;
    taken.count = taken.count < most ? taken.count : most;
    if (taken.count > 0)
        outcome->verdict = CUT_DONE;
    if (removal->kind == REMOVER_DIATHERMY)
        keep_boiled(detail, body->step, removal, &taken, outcome);
    else
        keep_amount(detail, removal->volume / REMOVED_THICKNESS, &taken);
    const bool done = taken.count > 0 && take(body, &removal->mouth, &taken, outcome);
    if (done)
        *change = detail->report.change;
    else
        detail_cut_take_back(model, &start);
    if (removal->kind == REMOVER_DIATHERMY)
        outcome->coagulated = REMOVED_THICKNESS * coagulated_area(detail);
    outcome->pieces = cut->piece_count;
    outcome->small_pieces = cut->small_count;
    return done;
}

// --- the account ---

// Finds the piece with the most fixed corners, else with the most faces; -1: nothing is fixed.
static int find_main(const Detail *detail, bool by_fixed)
{
    const DetailCut *cut = detail->set.cut;
    int *size = cut->near, best = -1; // by the piece's number
    memset(size, 0, (size_t)detail->set.face_count * sizeof *size);
    for (int f = 0; f < detail->set.face_count; f++) {
        const int *corner = cut->base[f];
        const int fixed =
            detail->fixed[corner[0]] + detail->fixed[corner[1]] + detail->fixed[corner[2]];
        size[cut->piece[f]] += detail_cut_is_gone(cut, f) ? 0 : by_fixed ? fixed : 1;
    }
    for (int f = 0; f < detail->set.face_count; f++)
        if (size[f] > (best < 0 ? 0 : size[best]))
            best = f;
    return best;
}

int detail_account(const void *self, TissueAccount *account, int capacity)
{
    const Detail *detail = ((const SurfaceModel *)self)->detail;
    const DetailCut *cut = detail->set.cut;
    const LeafSet *set = &detail->set;
    if (capacity < 1)
        return 1;
    const int held = find_main(detail, true), attached = held < 0 ? find_main(detail, false) : held;
    *account = (TissueAccount){.name = detail->options.body.name,
                               .density = detail->rules.areal_density,
                               .coagulated = coagulated_area(detail)};
    for (int f = 0; f < set->face_count; f++) {
        const double area = face_area(detail, f);
        double *to = detail_cut_is_gone(cut, f)  ? &account->removed
                     : cut->piece[f] == attached ? &account->attached
                                                 : &account->cut_off;
        *to += area;
        account->at_load += area;
    }
    return 1;
}
