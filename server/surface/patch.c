// SPDX-License-Identifier: MIT
// Local stiffness of a surface body, for haptics (body/patch.h): each spring with its stiffness
// along itself, and across itself with that of its tension. Step thread.
#include "surface/detail/detail.h"
#include "surface/law.h"

static Vec3 position_of(const SurfaceModel *model, int slot)
{
    Vec3 x;
    rows_read(&model->basis, model->rows[model->current], slot, &x, NULL);
    return x;
}

static bool hangs(const SurfaceModel *model, int node)
{
    const Detail *detail = model->detail;
    return detail != NULL && detail->set.constrained && detail->set.status[node] == NODE_HANGING;
}

// Adds the free nodes of the region; masses come from the kernel's tables, by lane.
static void add_nodes(const SurfaceModel *model, Patch *patch, int *budget)
{
    const NodeTable *nodes = &model->nodes;
    const double damping_scale = model->parameters->damping_scale;
    const RegionTest test = region_test(&patch->region);
    // Free nodes in the region, as many as the budget allows.
    for (; patch->next<model->basis.count && * budget> 0; patch->next++, --*budget) {
        int slot = (int)patch->next, node = model->node[slot];
        if (node < 0 || hangs(model, node) || !region_contains(&test, position_of(model, slot)))
            continue;
        // Fixed nodes do not move: they are no unknowns.
        int lane = model_lane_of(model, slot);
        double inverse = model_get(model, nodes->inverse_mass, lane);
        if (!(inverse > 0.0))
            continue;
        // Its own stiffness and damping: shape spring and drag.
        double mass = 1.0 / inverse, drag = 0.0, stiffness = 0.0;
        if (model->shape != SHAPE_FRAME_NONE) { // otherwise there is no drag either
            drag = model_get(model, nodes->drag, lane);
            stiffness = mass * model_get(model, nodes->shape_rate, lane);
        }
        if (shape_drag_is_apart(model->shape))
            drag += model_get(model, nodes->shape_drag, lane);
        if (!patch_add_node(patch, node, mass, mass * drag, stiffness))
            return;
    }
    // Not through yet: continue in the next tick.
    if (patch->next < model->basis.count)
        return;
    // The next pass adds springs.
    patch->relaxation = model->damped ? model->damping_time * damping_scale : 0.0;
    patch->pass++;
    patch->next = 0;
}

// Finds the free nodes that carry a node, with their weights; returns how many so far.
static int find_carriers(const LeafSet *set, int node, double share, int count, int *carrier,
                         double *shares)
{
    if (set->status[node] == NODE_HANGING) {
        int parent[2];
        levels_parents(&set->levels, node, parent);
        count = find_carriers(set, parent[0], 0.5 * share, count, carrier, shares);
        return find_carriers(set, parent[1], 0.5 * share, count, carrier, shares);
    }
    if (count < PATCH_CARRIERS) { // more: the others count as fixed
        carrier[count] = node;
        shares[count++] = share;
    }
    return count;
}

static void add_ties(const SurfaceModel *model, Patch *patch, int *budget)
{
    const Detail *detail = model->detail;
    const RegionTest test = region_test(&patch->region);
    int count = detail == NULL || !detail->set.constrained ? 0 : detail->lists.hanging_count;
    for (; patch->next<count && * budget> 0; patch->next++, --*budget) {
        int slot = detail->lists.hanging[patch->next], carrier[PATCH_CARRIERS];
        double share[PATCH_CARRIERS];
        if (!region_contains(&test, position_of(model, slot)))
            continue;
        // The free nodes that carry it, and their shares.
        int node = model->node[slot],
            found = find_carriers(&detail->set, node, 1.0, 0, carrier, share);
        if (!patch_add_tie(patch, node, found, carrier, share))
            return;
    }
    if (patch->next < count)
        return;
    patch->pass++;
    patch->next = 0;
}

// Adds k (n n^T + (1 - r / l) (1 - n n^T)) between two nodes: negative across a compressed spring.
static void add_spring(const SurfaceModel *model, Patch *patch, int node, int other, long entry)
{
    // The spring as it is now.
    Vec3 x = position_of(model, model->slot[node]), y = position_of(model, model->slot[other]);
    Vec3 n = vec3_unit(vec3_sub(x, y));
    double length = vec3_length(vec3_sub(x, y));
    double k =
        model->parameters->stiffness_scale * model_get(model, model->springs.stiffness, entry);
    double rest = model_get(model, model->springs.rest_length, entry);
    const LawSpring law = law_spring(model, entry, length - rest, patch->time);
    // Tension makes it stiff across itself; damping adds along it.
    double across =
        law.pull > 0.0 || (length > 0.0 && !patch->tensed) ? k * law.pull / length : 0.0;
    double along = k * (law.tangent + patch->relaxation / patch->time) - across;
    // The 3 x 3 block of the pair.
    const double v[3] = {n.x, n.y, n.z};
    double m[9], share[2 * PATCH_CARRIERS];
    short local[2 * PATCH_CARRIERS];
    for (int i = 0; i < 9; i++)
        m[i] = along * v[i / 3] * v[i % 3] + (i % 4 == 0 ? across : 0.0);
    // A hanging end passes its part to the nodes that carry it.
    int count = patch_carriers(patch, node, local, share);
    int more = patch_carriers(patch, other, local + count, share + count);
    for (int k2 = count; k2 < count + more; k2++)
        share[k2] = -share[k2];
    patch_add_form(patch, count + more, local, share, m);
}

// Springs are stored at both ends: one with both ends in the patch is added at the lower number.
static void add_springs(const SurfaceModel *model, Patch *patch, int node)
{
    const SpringTable *springs = &model->springs;
    int lane = model_lane_of(model, model->slot[node]), chunk = lane / LANES;
    int end = springs->end[chunk];
    for (int e = springs->start[chunk]; e < end; e++) {
        long entry = (long)e * LANES + lane % LANES;
        int other = model->node[springs->neighbour[entry]];
        // Skip padding and springs that are off.
        if (other < 0 || other == node || model_get(model, springs->stiffness, entry) == 0.0)
            continue;
        // A spring inside the patch is met at both ends: take it once.
        if (patch->local[other] == -1 || node < other)
            add_spring(model, patch, node, other, entry);
    }
}

bool model_gather_patch(const void *self, Patch *patch, int budget)
{
    const SurfaceModel *model = self;
    enum { SPRINGS = 32 }; // of the budget: a node with its springs
    if (patch->pass == 0)
        add_nodes(model, patch, &budget);
    if (patch->pass == 1)
        add_ties(model, patch, &budget);
    const int count = patch->node_count + patch->tie_count;
    for (; patch->pass == 2 && patch->next < count && budget > 0; patch->next++) {
        int i = (int)patch->next;
        add_springs(model, patch,
                    i < patch->node_count ? patch->node[i]
                                          : patch->tie[i - patch->node_count].node);
        budget -= SPRINGS;
    }
    return patch->full || (patch->pass == 2 && patch->next == count);
}
