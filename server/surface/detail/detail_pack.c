// From the set of refined faces to the kernel's tables. Slots are packed window by window: the free
// nodes of a window, sorted by how many springs they have, fill its first chunks, the hanging ones
// the next; so a change packs only the windows that it touches, and what it gives is a function of
// the set alone. Step thread, when the topology changes.
#include "surface/detail/detail.h"

#include "base/check.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// A node

static double leaf_area(const Detail *detail, const Leaf *leaf)
{
    return level_rules_area(&detail->rules, leaf->level, leaf->face);
}

// What a leaf adds to the spring at one of its edges. Continuum: Van Gelder's E2D A / L^2 of this
// face alone, so that springs at the border of two levels have what lies on their own side
// (surface.md 2c). Uniform material: half of what the scene gives, all of it at a border.
static double share_of_leaf(const SurfaceModel *model, const Leaf *leaf, int edge, int a, int b)
{
    const Detail *detail = model->detail;
    const LevelRules *rules = &detail->rules;
    if (rules->same_springs) {
        const int *sides = detail->levels.level[leaf->level].edge_face[edge];
        double k = rules->stiffness[leaf->level];
        return detail->constrained && sides[0] >= 0 && sides[1] >= 0 ? 0.5 * k : k;
    }
    const double *p = model->place[a], *q = model->place[b];
    double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
    return level_rules_face_stiffness(rules, leaf_area(detail, leaf), sqrt(x * x + y * y + z * z));
}

static void add_spring(NodeSprings *springs, int neighbour, double stiffness, bool sum)
{
    int at = springs->count;
    while (at > 0 && springs->neighbour[at - 1] > neighbour)
        at--;
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

// The springs of a node, by ascending slot of the other end.
static void gather_springs(const SurfaceModel *model, int node, int depth, NodeSprings *springs)
{
    const Detail *detail = model->detail;
    Leaf *leaf = detail->ring[depth];
    int count = detail_leaves_around(detail, node, leaf), slot = model->slot[node];
    springs->count = 0;
    for (int i = 0; i < count; i++) {
        const Level *level = &detail->levels.level[leaf[i].level];
        const int *corner = level->face[leaf[i].face];
        const int *edges = level->face_edge[leaf[i].face];
        const int k = leaf[i].corner, side[2] = {k, (k + 2) % 3};
        const int other[2] = {corner[(k + 1) % 3], corner[(k + 2) % 3]};
        for (int s = 0; s < 2; s++) {
            int edge = edges[side[s]], neighbour = model->slot[other[s]];
            // The paper's rule: an edge that its other side has divided carries no force.
            if (!detail->constrained && detail_midpoint(detail, leaf[i].level, edge) >= 0)
                continue;
            add_spring(springs, neighbour, share_of_leaf(model, &leaf[i], edge, slot, neighbour),
                       detail->constrained);
        }
    }
}

// What moves with a node: mass, and twice the stiffness of its springs for the bound on M^-1 K. A
// hanging node's are shared by its masters, and a spring (h, x) with h = (a + b) / 2 adds to a row
// sum of a at most half of what it would add to one of h.
typedef struct Carried {
    double mass, stiffness;
} Carried;

static Carried carried_by(const SurfaceModel *model, int node, int depth)
{
    const Detail *detail = model->detail;
    Leaf *leaf = detail->ring[depth];
    ASSERT(depth < LEVELS_MAX + 3);
    int count = detail_leaves_around(detail, node, leaf), ends[LEVELS_MAX + 1] = {0};
    Carried sum = {0.0, 0.0};
    for (int i = 0; i < count; i++) {
        const Level *level = &detail->levels.level[leaf[i].level];
        const int *corner = level->face[leaf[i].face];
        const int *edges = level->face_edge[leaf[i].face];
        const int k = leaf[i].corner, side[2] = {k, (k + 2) % 3};
        const int other[2] = {corner[(k + 1) % 3], corner[(k + 2) % 3]};
        if (detail->constrained)
            sum.mass += detail->rules.areal_density * leaf_area(detail, &leaf[i]) / 3.0;
        for (int s = 0; s < 2; s++) {
            int edge = edges[side[s]];
            int middle = detail_midpoint(detail, leaf[i].level, edge);
            if (!detail->constrained) {
                if (middle >= 0)
                    continue;
                // A spring between two leaves is seen from both: half of it each time.
                const int *faces = level->edge_face[edge];
                bool both = faces[0] >= 0 && faces[1] >= 0 &&
                            detail_is_leaf(detail, leaf[i].level, faces[0]) &&
                            detail_is_leaf(detail, leaf[i].level, faces[1]);
                double stiffness = detail->rules.stiffness[leaf[i].level];
                sum.stiffness += both ? stiffness : 2.0 * stiffness;
                ends[leaf[i].level] += both ? 1 : 2;
                continue;
            }
            sum.stiffness += 2.0 * share_of_leaf(model, &leaf[i], edge, model->slot[node],
                                                 model->slot[other[s]]);
            if (middle >= 0) {
                Carried half = carried_by(model, middle, depth + 1);
                sum.mass += 0.5 * half.mass;
                sum.stiffness += 0.5 * half.stiffness;
            }
        }
    }
    if (!detail->constrained)
        sum.mass = level_rules_mixed_mass(&detail->rules, ends);
    return sum;
}

double detail_mass(const SurfaceModel *model, int node)
{
    return carried_by(model, node, 0).mass;
}

// ---------------------------------------------------------------------------------------------
// A window

// Fills one lane of the spring table.
static void pack_springs(SurfaceModel *model, int lane, int slot, int entries,
                         const NodeSprings *springs)
{
    SpringTable *table = &model->springs;
    int chunk = lane / LANES;
    table->own[lane] = slot;
    for (int i = 0; i < entries; i++) {
        long at = (long)(table->start[chunk] + i) * LANES + lane % LANES;
        bool real = i < springs->count;
        int other = real ? springs->neighbour[i] : slot;
        double length = 0.0;
        for (int c = 0; c < 3; c++) {
            double e = model->place[slot][c] - model->place[other][c];
            length += e * e;
        }
        length = sqrt(length) * (1.0 - model->detail->options.prestress);
        model_put_spring(model, at, slot, other, length, real ? springs->stiffness[i] : 0.0);
    }
}

// Fills one lane of what the kernel knows of nodes; slot -1 or a hanging node: nothing moves there.
static void pack_node(SurfaceModel *model, int lane, int node, double mass)
{
    const Detail *detail = model->detail;
    const NodeTable *nodes = &model->nodes;
    bool moves = node >= 0 && !detail->fixed[node] && mass > 0.0;
    model_put(model, nodes->inverse_mass, lane, moves ? 1.0 / mass : 0.0);
    if (nodes->shape_rate != NULL) {
        bool body = model->shape == SHAPE_FRAME_BODY;
        model_put(model, nodes->shape_rate, lane, moves ? detail->shape_rate : 0.0);
        double drag = detail->node_drag + (body ? 0.0 : detail->shape_drag);
        model_put(model, nodes->drag, lane, moves ? drag : 0.0);
        if (body)
            model_put(model, nodes->shape_drag, lane, moves ? detail->shape_drag : 0.0);
    }
    if (nodes->rest != NULL)
        for (int c = 0; c < 3; c++)
            model_put(model, nodes->rest, model_lane(lane) + c * LANES,
                      node >= 0 ? model->place[model->slot[node]][c] : 0.0);
}

// Nodes of one status, packed from `first_chunk` on, those with fewest springs first (stable);
// returns the chunks used.
static int pack_nodes(SurfaceModel *model, int w, NodeStatus status, int first_chunk)
{
    Detail *detail = model->detail;
    Window *window = &detail->window[w];
    int found[WINDOW], count = 0;
    for (int s = w * WINDOW; s < (w + 1) * WINDOW; s++) {
        int node = detail->of_slot[s];
        if (node < 0 || detail->status[node] != status)
            continue;
        gather_springs(model, node, 0, &detail->springs[count]);
        window->spring_ends += detail->springs[count].count;
        int at = count++;
        // `found` lists indices into springs[], sorted by their count.
        while (at > 0 && detail->springs[found[at - 1]].count > detail->springs[count - 1].count) {
            found[at] = found[at - 1];
            at--;
        }
        found[at] = count - 1;
        detail->packed[count - 1] = node;
    }
    int chunks = (count + LANES - 1) / LANES;
    for (int i = 0; i < chunks * LANES; i++) {
        int chunk = w * WINDOW_CHUNKS + first_chunk + i / LANES, lane = chunk * LANES + i % LANES;
        int last = i / LANES * LANES + LANES - 1;
        int entries = detail->springs[found[last < count ? last : count - 1]].count;
        model->springs.end[chunk] = model->springs.start[chunk] + entries;
        const NodeSprings none = {0};
        int node = i < count ? detail->packed[found[i]] : -1;
        int slot = node >= 0 ? model->slot[node] : detail->spare_slot + w;
        pack_springs(model, lane, slot, entries, node >= 0 ? &detail->springs[found[i]] : &none);
        Carried carried = {0.0, 0.0};
        if (node >= 0)
            model->lane[slot] = lane;
        if (node >= 0 && status == NODE_FREE) {
            carried = carried_by(model, node, 0);
            window->mass += carried.mass;
            if (!detail->fixed[node]) {
                double springs = carried.stiffness / carried.mass;
                window->lambda = fmax(window->lambda, springs + detail->shape_rate);
                window->damping = fmax(window->damping, model->damping_time * springs +
                                                            detail->shape_drag + detail->node_drag);
            }
        }
        if (node >= 0)
            model->mass[node] = carried.mass;
        if (model->rigid_weight != NULL && node >= 0)
            model->rigid_weight[slot] =
                model->shape == SHAPE_FRAME_BODY ? carried.mass * detail->shape_rate : carried.mass;
        pack_node(model, lane, status == NODE_FREE ? node : -1, carried.mass);
    }
    if (status == NODE_FREE)
        window->free_count = count;
    else
        window->hanging_count = count;
    return chunks;
}

static void pack_window(SurfaceModel *model, int w)
{
    Detail *detail = model->detail;
    Window *window = &detail->window[w];
    *window = (Window){0};
    for (int s = w * WINDOW; s < (w + 1) * WINDOW; s++) {
        model->lane[s] = -1;
        int node = detail->of_slot[s];
        if (node < 0 || detail->status[node] != NODE_OFF)
            continue;
        model->mass[node] = 0.0;
        if (model->rigid_weight != NULL)
            model->rigid_weight[s] = 0.0;
    }
    window->free_chunks = pack_nodes(model, w, NODE_FREE, 0);
    pack_nodes(model, w, NODE_HANGING, window->free_chunks);
}

// ---------------------------------------------------------------------------------------------
// All windows

static void list_hanging(SurfaceModel *model)
{
    Detail *detail = model->detail;
    detail->hanging_count = 0;
    for (int w = detail->window_count - 1; w >= 0; w--) {
        const Window *window = &detail->window[w];
        for (int s = w * WINDOW, left = window->hanging_count; left > 0; s++) {
            int node = detail->of_slot[s], parent[2];
            if (node < 0 || detail->status[node] != NODE_HANGING)
                continue;
            levels_parents(&detail->levels, node, parent);
            detail->hanging[detail->hanging_count] = s;
            detail->master[detail->hanging_count][0] = model->slot[parent[0]];
            detail->master[detail->hanging_count++][1] = model->slot[parent[1]];
            left--;
        }
    }
}

static void list_chunks(SurfaceModel *model)
{
    Detail *detail = model->detail;
    detail->free_chunk_count = detail->hanging_chunk_count = detail->run_count = 0;
    detail->spring_ends = 0;
    detail->on_count = 0;
    detail->mass = detail->lambda = detail->damping = 0.0;
    for (int w = 0; w < detail->window_count; w++) {
        const Window *window = &detail->window[w];
        if (window->free_count + window->hanging_count == 0)
            continue;
        int chunk = w * WINDOW_CHUNKS;
        for (int k = 0; k < window->free_chunks; k++)
            detail->free_chunk[detail->free_chunk_count++] = chunk++;
        for (int k = 0; k < window->hanging_count; k += LANES)
            detail->hanging_chunk[detail->hanging_chunk_count++] = chunk++;
        int first = w * WINDOW;
        if (detail->run_count == 0 || detail->run[detail->run_count - 1][1] != first)
            detail->run[detail->run_count++][0] = first;
        detail->run[detail->run_count - 1][1] = first + WINDOW;
        detail->mass += window->mass;
        detail->lambda = fmax(detail->lambda, window->lambda);
        detail->damping = fmax(detail->damping, window->damping);
        detail->spring_ends += window->spring_ends;
        detail->on_count += window->free_count + window->hanging_count;
    }
}

void detail_pack(SurfaceModel *model)
{
    Detail *detail = model->detail;
    for (int w = 0; w < detail->window_count; w++) {
        if (!detail->stale_window[w])
            continue;
        detail->stale_window[w] = false;
        pack_window(model, w);
    }
    list_chunks(model);
    if (detail->constrained)
        list_hanging(model);
    if (model->rigid != NULL) {
        model->rigid->run = detail->run;
        model->rigid->run_count = detail->run_count;
        rigid_frame_weigh(model->rigid);
    }
}
