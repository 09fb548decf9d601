// SPDX-License-Identifier: MIT
// Builds the kernel's tables from the set of refined faces. Slots are packed window by window: the
// free nodes of a window, sorted by their number of springs, fill its first chunks, the hanging
// ones the next. So a change packs only the windows that it touches, and the result is a function
// of the set alone. Step thread, when the topology changes.
#include "surface/detail/detail.h"

#include "base/check.h"
#include "surface/cavity.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// A node

static double leaf_area(const Detail *detail, const Leaf *leaf)
{
    return level_rules_area(&detail->rules, leaf->level, leaf->face);
}

// Returns what a leaf adds to the spring at one of its edges [N/m]. Continuum: Van Gelder's E2D A /
// L^2 of this face alone, so that springs at the border of two levels include only their own side
// (README.md, "Properties that follow the level"). Uniform material: half of the scene's value, all
// of it at a border.
static double share_of_leaf(const SurfaceModel *model, const Leaf *leaf, int edge, int a, int b)
{
    const Detail *detail = model->detail;
    const LevelRules *rules = &detail->rules;
    if (rules->same_springs) {
        const int *sides = detail->set.levels.level[leaf->level].edge_face[edge];
        double k = rules->stiffness[leaf->level];
        return detail->set.constrained && sides[0] >= 0 && sides[1] >= 0 ? 0.5 * k : k;
    }
    const double *p = model->basis.rest[a], *q = model->basis.rest[b];
    double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
    return level_rules_face_stiffness(rules, leaf_area(detail, leaf), sqrt(x * x + y * y + z * z));
}

static void add_spring(NodeSprings *springs, int neighbour, double stiffness, bool sum)
{
    int at = springs->count;
    // Ascending order of neighbours.
    while (at > 0 && springs->neighbour[at - 1] > neighbour)
        at--;
    // Two leaves at an edge add to one spring.
    if (at > 0 && springs->neighbour[at - 1] == neighbour) {
        if (sum)
            springs->stiffness[at - 1] += stiffness;
        return;
    }
    for (int i = springs->count; i > at; i--) {
        springs->neighbour[i] = springs->neighbour[i - 1];
        springs->stiffness[i] = springs->stiffness[i - 1];
    }
    springs->neighbour[at] = neighbour;
    springs->stiffness[at] = stiffness;
    springs->count++;
}

// Brings the springs of a node into the order of the faces around it.
static void order_springs(int slot, int count, const int (*side)[2], NodeSprings *springs)
{
    int ring[3 * CAVITY_RING];
    double stiffness[3 * CAVITY_RING];
    const int length = cavity_ring(slot, count, side, ring);
    for (int i = 0; i < length; i++) {
        stiffness[i] = 0.0;
        for (int k = 0; k < springs->count; k++) {
            if (springs->neighbour[k] != ring[i])
                continue;
            // Once, also where the ring meets the same neighbour again.
            stiffness[i] = springs->stiffness[k];
            springs->stiffness[k] = 0.0;
        }
    }
    memcpy(springs->neighbour, ring, (size_t)length * sizeof *ring);
    memcpy(springs->stiffness, stiffness, (size_t)length * sizeof *stiffness);
    springs->count = length;
}

// What moves with a node: mass [kg], and twice the stiffness of its springs [N/m] for the bound on
// M^-1 K. Masters share those of a hanging node: a spring (h, x) with h = (a + b) / 2 adds to a row
// sum of a at most half of what it would add to one of h.
typedef struct Carried {
    double mass, stiffness;
} Carried;

// Sums what a node carries, and lists its springs unless NULL, by ascending slot of the other end.
// `depth`: recursion through hanging nodes.
static Carried survey(const SurfaceModel *model, int node, int depth, NodeSprings *springs)
{
    const Detail *detail = model->detail;
    const LeafSet *set = &detail->set;
    const LevelRules *rules = &detail->rules;
    ASSERT(depth < LEVELS_MAX + 3);
    Leaf *leaf = set->ring[depth];
    int count = detail_leaves_around(set, node, leaf), slot = model->slot[node];
    int ends[LEVELS_MAX + 1] = {
        0}; // number of springs by level; one between two leaves is seen twice
    Carried sum = {0.0, 0.0};
    int sides[CAVITY_RING][2];
    ASSERT(model->cavity == NULL || count <= CAVITY_RING);
    if (springs != NULL)
        springs->count = 0;
    // Each leaf contributes a third of its mass and its part of the two springs at the node.
    for (int i = 0; i < count; i++) {
        const Level *level = &set->levels.level[leaf[i].level];
        const int *corner = level->face[leaf[i].face];
        const int *edges = level->face_edge[leaf[i].face];
        const int k = leaf[i].corner, side[2] = {k, (k + 2) % 3};
        const int other[2] = {corner[(k + 1) % 3], corner[(k + 2) % 3]};
        sum.mass += rules->areal_density * leaf_area(detail, &leaf[i]) / 3.0;
        if (model->cavity != NULL)
            for (int s = 0; s < 2; s++)
                sides[i][s] = model->slot[other[s]];
        for (int s = 0; s < 2; s++) {
            // The spring along one of the leaf's two edges at the node.
            int edge = edges[side[s]], neighbour = model->slot[other[s]];
            int middle = detail_midpoint(set, leaf[i].level, edge);
            if (set->constrained) {
                double stiffness = share_of_leaf(model, &leaf[i], edge, slot, neighbour);
                sum.stiffness += 2.0 * stiffness;
                if (springs != NULL)
                    add_spring(springs, neighbour, stiffness, true);
                if (middle >= 0) {
                    // A hanging midpoint hands half of what it carries to this node.
                    Carried half = survey(model, middle, depth + 1, NULL);
                    sum.mass += 0.5 * half.mass;
                    sum.stiffness += 0.5 * half.stiffness;
                }
            } else if (middle < 0) { // the paper: an edge that its other side has divided is off
                const int *faces = level->edge_face[edge];
                bool both = faces[0] >= 0 && faces[1] >= 0 &&
                            detail_is_leaf(set, leaf[i].level, faces[0]) &&
                            detail_is_leaf(set, leaf[i].level, faces[1]);
                double stiffness = rules->stiffness[leaf[i].level];
                sum.stiffness += both ? stiffness : 2.0 * stiffness;
                ends[leaf[i].level] += both ? 1 : 2;
                if (springs != NULL)
                    add_spring(springs, neighbour, stiffness, false);
            }
        }
    }
    if (model->cavity != NULL && springs != NULL)
        order_springs(slot, count, (const int(*)[2])sides, springs);
    // The paper's mass is the mean over active edges.
    if (!set->constrained)
        sum.mass = level_rules_mixed_mass(rules, ends);
    return sum;
}

double detail_mass(const SurfaceModel *model, int node)
{
    return survey(model, node, 0, NULL).mass;
}

// ---------------------------------------------------------------------------------------------
// A window

// A list of slots.
typedef struct PackList {
    int count;
    int slot[WINDOW_MOST];
} PackList;

// Fills one lane of the spring table.
static void pack_springs(SurfaceModel *model, int lane, int slot, int entries,
                         const NodeSprings *springs)
{
    SpringTable *table = &model->springs;
    int chunk = lane / LANES;
    // Padding has no stiffness and leads to the node itself, unless it closes a ring.
    const int padding =
        model->cavity == NULL ? slot : cavity_padding(slot, springs->count, springs->neighbour);
    table->own[lane] = slot;
    if (model->cavity != NULL)
        cavity_put_place(model, lane, slot);
    for (int i = 0; i < entries; i++) {
        long at = (long)(table->start[chunk] + i) * LANES + lane % LANES;
        bool real = i < springs->count;
        int other = real ? springs->neighbour[i] : padding;
        double length = 0.0;
        // Rest lengths follow from rest positions.
        for (int c = 0; c < 3; c++) {
            double e = model->basis.rest[slot][c] - model->basis.rest[other][c];
            length += e * e;
        }
        length = sqrt(length) * (1.0 - model->detail->options.prestress);
        model_put_spring(model, at, slot, other, length, real ? springs->stiffness[i] : 0.0);
    }
}

// Fills one lane of the node constants; -1: a hanging node, or none: nothing moves.
static void pack_node(SurfaceModel *model, int lane, int node)
{
    const Detail *detail = model->detail;
    const DetailPack *pack = &detail->pack;
    const NodeTable *nodes = &model->nodes;
    bool moves = node >= 0 && !detail->fixed[node];
    // Zeros hold a node that does not move.
    model_put(model, nodes->inverse_mass, lane, moves ? 1.0 / model->mass[node] : 0.0);
    if (nodes->shape_rate != NULL) {
        bool apart = shape_drag_is_apart(model->shape);
        model_put(model, nodes->shape_rate, lane, moves ? pack->shape_rate : 0.0);
        double drag = pack->node_drag + (apart ? 0.0 : pack->shape_drag);
        model_put(model, nodes->drag, lane, moves ? drag : 0.0);
        if (apart)
            model_put(model, nodes->shape_drag, lane, moves ? pack->shape_drag : 0.0);
    }
    // Its virtual node.
    if (nodes->rest != NULL)
        for (int c = 0; c < 3; c++)
            model_put(model, nodes->rest, model_lane(lane) + c * LANES,
                      node >= 0 ? model->basis.rest[model->slot[node]][c] : 0.0);
}

// Reads the springs of an unchanged node back from its lane, which is cheaper than a survey.
static void recall(const SurfaceModel *model, int slot, NodeSprings *springs)
{
    const SpringTable *table = &model->springs;
    int lane = model->lane[slot], chunk = lane / LANES;
    springs->count = 0;
    for (int e = table->start[chunk]; e < table->end[chunk]; e++) {
        long at = (long)e * LANES + lane % LANES;
        const int other = table->neighbour[at];
        if (model->cavity == NULL && other == slot)
            break; // padding
        springs->neighbour[springs->count] = other;
        springs->stiffness[springs->count++] = model_get(model, table->stiffness, at);
    }
    // Padding of rings: one that is closed ends before its first neighbour comes again, another
    // after its last gap.
    const int *other = springs->neighbour;
    while (model->cavity != NULL && springs->count > 1 &&
           (other[springs->count - 1] == other[0] ||
            (other[springs->count - 1] == slot && other[springs->count - 2] == slot)))
        springs->count--;
}

// Lists the nodes of a window with a given status, and their springs; those with fewest springs
// first, else by slot: a stable counting sort.
static void list_nodes(SurfaceModel *model, int w, NodeStatus status, PackList *list)
{
    enum { MOST = 32 }; // more springs count as this many
    Detail *detail = model->detail;
    DetailPack *pack = &detail->pack;
    int found[WINDOW_MOST], count = 0, next[MOST + 1] = {0};
    // Changed nodes are surveyed, others recalled from the table.
    for (int s = w * pack->width; s < (w + 1) * pack->width; s++) {
        int node = pack->of_slot[s];
        if (node < 0 || detail->set.status[node] != status)
            continue;
        NodeSprings *springs = &pack->springs[s % pack->width];
        if (pack->is_dirty[node]) {
            Carried carried = survey(model, node, 0, springs);
            model->mass[node] = status == NODE_FREE ? carried.mass : 0.0;
            pack->bound[node] = carried.stiffness;
        } else {
            recall(model, s, springs);
        }
        // Counted by the number of springs, for the sort.
        found[count++] = s;
        next[springs->count < MOST ? springs->count : MOST]++;
    }
    // Counting sort by the number of springs.
    for (int k = 0, first = 0; k <= MOST; k++) {
        int here = next[k];
        next[k] = first;
        first += here;
    }
    for (int i = 0; i < count; i++) {
        int springs = pack->springs[found[i] % pack->width].count;
        list->slot[next[springs < MOST ? springs : MOST]++] = found[i];
    }
    list->count = count;
}

// Adds a free node to the sums and bounds of its window.
static void count_node(const SurfaceModel *model, int node, Window *window)
{
    const Detail *detail = model->detail;
    const DetailPack *pack = &detail->pack;
    window->mass += model->mass[node];
    if (detail->fixed[node])
        return;
    double springs = pack->bound[node] / model->mass[node];
    window->lambda = fmax(window->lambda, pack->rigidity * springs + pack->shape_rate);
    window->damping =
        fmax(window->damping, model->damping_time * springs + pack->shape_drag + pack->node_drag);
}

// Returns the most springs in the chunk that begins with entry `first` of a list.
static int most_springs(const DetailPack *pack, const PackList *list, int first)
{
    int most = 0;
    for (int i = first; i < first + LANES && i < list->count; i++) {
        int springs = pack->springs[list->slot[i] % pack->width].count;
        most = springs > most ? springs : most;
    }
    return most;
}

// Returns how many springs a node has; a gap in a ring is none.
static int count_springs(int slot, const NodeSprings *springs)
{
    int count = 0;
    for (int i = 0; i < springs->count; i++)
        count += springs->neighbour[i] != slot;
    return count;
}

// Fills the chunks from `chunk` on with the nodes of a list; returns how many it takes.
static int pack_nodes(SurfaceModel *model, int w, NodeStatus status, int chunk,
                      const PackList *list)
{
    static const NodeSprings none = {0};
    Detail *detail = model->detail;
    DetailPack *pack = &detail->pack;
    int chunks = (list->count + LANES - 1) / LANES, entries = 0;
    // A chunk has as many entries as its node with the most springs.
    for (int i = 0; i < chunks * LANES; i++) {
        int lane = chunk * LANES + i, at = lane / LANES;
        if (i % LANES == 0) {
            entries = most_springs(pack, list, i);
            // Without gaps: memory is read ahead.
            if (at % pack->window_chunks != 0)
                model->springs.start[at] = model->springs.end[at - 1];
            model->springs.end[at] = model->springs.start[at] + entries;
        }
        // Lanes without a node read the window's spare row.
        if (i >= list->count) {
            pack_springs(model, lane, pack->spare_slot + w, entries, &none);
            pack_node(model, lane, -1);
            continue;
        }
        // The node's springs and constants.
        int slot = list->slot[i], node = pack->of_slot[slot];
        const NodeSprings *springs = &pack->springs[slot % pack->width];
        pack_springs(model, lane, slot, entries, springs);
        pack_node(model, lane, status == NODE_FREE ? node : -1);
        // Forces of hanging nodes start at zero.
        for (int c = 0; c < 4; c++)
            model_put(model, detail->lists.handed, (long)slot * ROW + c, 0.0);
        // The node is up to date; its share of the window's sums.
        model->lane[slot] = lane;
        pack->is_dirty[node] = false;
        pack->window[w].spring_ends += count_springs(slot, springs);
        if (status == NODE_FREE)
            count_node(model, node, &pack->window[w]);
        if (model->rigid_weight != NULL)
            model->rigid_weight[slot] =
                model->mass[node] * (model->shape == SHAPE_FRAME_BODY ? pack->shape_rate : 1.0);
    }
    return chunks;
}

static void pack_window(SurfaceModel *model, int w)
{
    Detail *detail = model->detail;
    DetailPack *pack = &detail->pack;
    PackList free_nodes, hanging;
    list_nodes(model, w, NODE_FREE,
               &free_nodes); // recall reads lanes: list all before any lane is written
    list_nodes(model, w, NODE_HANGING, &hanging);
    // Nodes that are off have no lane, mass or bound.
    uint32_t used = 0;
    for (int s = w * pack->width; s < (w + 1) * pack->width; s++) {
        int node = pack->of_slot[s];
        model->lane[s] = -1;
        if (node < 0)
            continue;
        if (detail->set.status[node] != NODE_OFF) {
            used |= UINT32_C(1) << (s % pack->width / BLOCK);
            continue;
        }
        model->mass[node] = pack->bound[node] = 0.0;
        if (model->rigid_weight != NULL)
            model->rigid_weight[s] = 0.0;
    }
    // Free nodes fill the first chunks of the window, hanging ones the next.
    int first = w * pack->window_chunks;
    if (model->bending != NULL)
        detail_bend_pack(model, w);
    pack->window[w] =
        (Window){.free_count = free_nodes.count, .hanging_count = hanging.count, .used = used};
    pack->window[w].free_chunks = pack_nodes(model, w, NODE_FREE, first, &free_nodes);
    pack_nodes(model, w, NODE_HANGING, first + pack->window[w].free_chunks, &hanging);
}

// ---------------------------------------------------------------------------------------------
// All windows

static void list_hanging(SurfaceModel *model)
{
    Detail *detail = model->detail;
    DetailLists *lists = &detail->lists;
    DetailPack *pack = &detail->pack;
    const LeafSet *set = &detail->set;
    lists->hanging_count = lists->carrier_count = 0;
    // No chunk carries anything yet.
    for (int k = 0; k < lists->free_chunk_count; k++)
        lists->carries[lists->free_chunk[k]] = 0;
    for (int w = pack->window_count - 1; w >= 0; w--) {
        const Window *window = &pack->window[w];
        // Slots are ordered by level: backwards the finest level comes first.
        for (int s = (w + 1) * pack->width - 1, left = window->hanging_count; left > 0; s--) {
            int node = pack->of_slot[s], parent[2];
            if (node < 0 || set->status[node] != NODE_HANGING)
                continue;
            // The node and its masters; free masters receive its force.
            levels_parents(&set->levels, node, parent);
            lists->hanging[lists->hanging_count] = s;
            int *master = lists->master[lists->hanging_count++];
            for (int k = 0; k < 2; k++) {
                master[k] = model->slot[parent[k]];
                if (set->status[parent[k]] == NODE_FREE) {
                    lists->carrier[lists->carrier_count++] = master[k];
                    lists->carries[model->lane[master[k]] / LANES] = 1;
                }
            }
            left--;
        }
    }
}

static void list_chunks(SurfaceModel *model)
{
    Detail *detail = model->detail;
    DetailPack *pack = &detail->pack;
    DetailLists *lists = &detail->lists;
    lists->free_chunk_count = lists->hanging_chunk_count = model->run_count = 0;
    pack->spring_ends = 0;
    pack->on_count = 0;
    pack->mass = pack->lambda = pack->damping = 0.0;
    // Windows in ascending order: sums have one order.
    for (int w = 0; w < pack->window_count; w++) {
        const Window *window = &pack->window[w];
        if (window->free_count + window->hanging_count == 0)
            continue;
        // Chunks in use: of free nodes, then of hanging ones.
        int chunk = w * pack->window_chunks;
        for (int k = 0; k < window->free_chunks; k++)
            lists->free_chunk[lists->free_chunk_count++] = chunk++;
        for (int k = 0; k < window->hanging_count; k += LANES)
            lists->hanging_chunk[lists->hanging_chunk_count++] = chunk++;
        // Adjacent blocks form one run of slots.
        for (uint32_t left = window->used; left != 0; left &= left - 1) {
            int first = w * pack->width + __builtin_ctz(left) * BLOCK;
            if (model->run_count == 0 || model->run[model->run_count - 1][1] != first)
                model->run[model->run_count++][0] = first;
            model->run[model->run_count - 1][1] = first + BLOCK;
        }
        // Sums and maxima over windows.
        pack->mass += window->mass;
        pack->lambda = fmax(pack->lambda, window->lambda);
        pack->damping = fmax(pack->damping, window->damping);
        pack->spring_ends += window->spring_ends;
        pack->on_count += window->free_count + window->hanging_count;
    }
}

void detail_pack(SurfaceModel *model, bool changed)
{
    Detail *detail = model->detail;
    DetailPack *pack = &detail->pack;
    const bool moves = changed && detail->law != NULL;
    if (moves)
        detail_law_save(model);
    // Only windows in which something changed.
    for (int w = 0; w < pack->window_count; w++) {
        if (!pack->stale_window[w])
            continue;
        pack->stale_window[w] = false;
        pack_window(model, w);
    }
    if (moves)
        detail_law_move(model);
    // What each evaluation visits now.
    list_chunks(model);
    if (detail->set.constrained)
        list_hanging(model);
    if (model->bending != NULL)
        detail_bend_list(model);
    if (detail->frames != NULL)
        detail_frames_sort(model);
    // The fit of the rigid frame has other nodes and weights.
    if (model->basis.rigid != NULL) {
        model->basis.rigid->run = model->run;
        model->basis.rigid->run_count = model->run_count;
        rigid_frame_weigh(model->basis.rigid);
    }
}
