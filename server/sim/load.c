// SPDX-License-Identifier: MIT
#include "sim/load.h"

#include "base/bits.h"

#include <stdio.h>
#include <string.h>

void loads_create(LoadSet *set, const Body *bodies, int body_count, Arena *arena, StateList *state)
{
    int nodes = 0, most = 0; // of all bodies, and of the largest that changes
    bool adapts = false;
    for (int b = 0; b < body_count; b++) {
        int own = bodies[b].surface.node_count;
        // A solid that adapts has room for more nodes than most scenes need, and all of its surface
        // now: a load of all nodes fits always, two of all that there are now.
        const int now = bodies[b].surface.node_used;
        nodes += bodies[b].fine_elements == 0 ? own : now > own / 2 ? now : (own + 1) / 2;
        most = body_changes(&bodies[b]) && own > most ? own : most;
        // The faces of solids stay as they are.
        adapts |= bodies[b].ops->adapt != NULL && !bodies[b].surface.solid;
    }
    // Space for two loads that each take every node, or many small ones; with adaptive bodies for
    // eight, since a load also stores the surrounding nodes.
    set->pool_capacity = (adapts ? 8 : 2) * nodes;
    size_t capacity = (size_t)set->pool_capacity;
    // What is active, and the pool of its nodes.
    set->count = arena_allocate(arena, ARENA_STEP, 1, sizeof *set->count, "loads/count");
    set->used = arena_allocate(arena, ARENA_STEP, 1, sizeof *set->used, "loads/used");
    set->load = arena_allocate(arena, ARENA_STEP, LOAD_CAPACITY, sizeof *set->load, "loads/load");
    set->pool = arena_allocate(arena, ARENA_STEP, capacity, sizeof *set->pool, "loads/pool");
    set->record =
        arena_allocate(arena, ARENA_OUTPUT, LOAD_CAPACITY, sizeof *set->record, "loads/record");
    // All zero without bad ticks or senders.
    state_add_rare(state, set->record, LOAD_CAPACITY * sizeof *set->record, "loads/record");
    state_add(state, set->count, sizeof *set->count, "loads/count");
    state_add(state, set->used, sizeof *set->used, "loads/used");
    state_add(state, set->load, LOAD_CAPACITY * sizeof *set->load, "loads/load");
    state_add(state, set->pool, capacity * sizeof *set->pool, "loads/pool");
    // The rest is for bodies whose nodes change.
    if (most == 0)
        return;
    set->node = arena_allocate(arena, ARENA_STEP, capacity, sizeof *set->node, "loads/nodes");
    state_add(state, set->node, capacity * sizeof *set->node, "loads/nodes");
    set->given = arena_allocate(arena, ARENA_STEP, (size_t)most, sizeof *set->given,
                                "loads/nodes of a body");
    set->mark = arena_allocate(arena, ARENA_STEP, (size_t)bits_words(most), sizeof *set->mark,
                               "loads/marks of nodes");
}

// ---------------------------------------------------------------------------------------------
// The pool

// Moves `count` entries within the pool.
static void move_entries(LoadSet *set, int64_t to, int64_t from, int64_t count)
{
    memmove(&set->pool[to], &set->pool[from], (size_t)count * sizeof *set->pool);
    if (set->node != NULL)
        memmove(&set->node[to], &set->node[from], (size_t)count * sizeof *set->node);
}

static void clear_entries(LoadSet *set, int64_t first, int64_t count)
{
    memset(&set->pool[first], 0, (size_t)count * sizeof *set->pool);
    if (set->node != NULL)
        memset(&set->node[first], 0, (size_t)count * sizeof *set->node);
}

// Iterates over the nodes of a load in the pool, which are ordered by body.
typedef struct Walk {
    const Body *body;
    int first_node; // of that body
    int node;       // in that body
    double share;
} Walk;

static void walk_to(const LoadSet *set, Walk *walk, int64_t i)
{
    for (; set->pool[i] - walk->first_node >= walk->body->surface.node_count; walk->body++)
        walk->first_node += walk->body->surface.node_count;
    walk->node = set->pool[i] - walk->first_node;
    walk->share = set->node != NULL ? set->node[i].share : 1.0;
}

static void measure_area(const LoadSet *set, const Body *bodies, Load *load)
{
    Walk walk = {.body = bodies};
    load->area = 0.0;
    for (int64_t i = load->first; i < load->first + load->count; i++) {
        walk_to(set, &walk, i);
        load->area += walk.share * walk.body->surface.node_area[walk.node];
    }
}

// Recomputes the forces in the order of the loads, so that they depend on the active loads alone
// and not on past ones.
static void apply_all(const LoadSet *set, Body *bodies, int body_count)
{
    for (int b = 0; b < body_count; b++)
        bodies[b].ops->clear_loads(bodies[b].model);
    for (int64_t k = 0; k < *set->count; k++) {
        const Load *load = &set->load[k];
        Walk walk = {.body = bodies};
        for (int64_t i = load->first; i < load->first + load->count && load->area > 0.0; i++) {
            walk_to(set, &walk, i);
            const Body *body = walk.body;
            double share = walk.share * body->surface.node_area[walk.node] / load->area;
            if (walk.share > 0.0)
                body->ops->add_load(body->model, walk.node, vec3_scale(share, load->force));
        }
    }
}

// ---------------------------------------------------------------------------------------------
// New and removed nodes

static void give(LoadSet *set, int node, const LoadNode *what)
{
    bits_add(set->mark, node);
    set->given[node] = *what;
}

// Writes the marked nodes from entry `at` on, ascending, at most `room` of them, and clears the
// marks. Returns how many.
static int64_t write_marked(LoadSet *set, int64_t at, int64_t room, int node_count, int first_node)
{
    int64_t count = 0;
    for (int word = 0; word < bits_words(node_count); word++) {
        for (uint64_t left = set->mark[word]; left != 0;) {
            const int node = bits_take(&left, word);
            if (count < room) {
                set->pool[at + count] = first_node + node;
                set->node[at + count++] = set->given[node];
            }
        }
        set->mark[word] = 0;
    }
    return count;
}

// Returns the data of a node whose position was `start` when the load began.
static LoadNode judge_node(const Load *load, Vec3 start)
{
    bool inside = vec3_length(vec3_sub(start, load->center)) <= load->radius;
    return (LoadNode){start, inside ? 1.0 : 0.0};
}

// Updates the marked nodes after a change. If none would be left inside, the parents of removed
// ones take over.
static void change_nodes(LoadSet *set, const Load *load, int64_t inside,
                         const TopologyChange *change)
{
    // How much of the load is left without the nodes that go.
    for (int i = 0; i < change->gone_count; i++)
        if (bits_has(set->mark, change->gone[i]))
            inside -= set->given[change->gone[i]].share > 0.0;
    // The last inside nodes that go hand their part to their parents.
    for (int i = 0; i < change->gone_count; i++) {
        int node = change->gone[i];
        if (!bits_has(set->mark, node))
            continue;
        bits_remove(set->mark, node);
        for (int k = 0; k < 2 && inside == 0 && set->given[node].share > 0.0; k++) {
            int parent = change->gone_parent[i][k];
            if (parent == NODE_NONE)
                break;
            LoadNode heir = {set->given[node].start, 1.0};
            if (bits_has(set->mark, parent))
                heir.start = set->given[parent].start;
            give(set, parent, &heir);
        }
    }
    // A new node between two known ones: inside if it would have been at the start.
    for (int i = 0; i < change->born_count; i++) {
        const NodeBirth *born = &change->born[i];
        const int *parent = born->parent;
        if (!bits_has(set->mark, parent[0]) || !bits_has(set->mark, parent[1]))
            continue;
        // A copy gets its original's part in the load: the two share one area.
        Vec3 sum = vec3_add(set->given[parent[0]].start, set->given[parent[1]].start);
        LoadNode child =
            parent[0] == parent[1] ? set->given[parent[0]] : judge_node(load, vec3_scale(0.5, sum));
        give(set, born->node, &child);
    }
}

// Replaces the entries of one body, whose first node is `first_node`, in one load.
static void follow_load(LoadSet *set, int k, int first_node, const BodySurface *surface,
                        const TopologyChange *change)
{
    // The part of the load's nodes that belongs to this body.
    int node_count = surface->node_count, node_used = surface->node_used;
    Load *load = &set->load[k];
    int64_t begin = load->first, load_end = load->first + load->count;
    while (begin < load_end && set->pool[begin] < first_node)
        begin++;
    int64_t end = begin, inside = 0;
    // Spread it over the nodes, to find parents at once.
    for (; end < load_end && set->pool[end] < first_node + node_count; end++) {
        give(set, set->pool[end] - first_node, &set->node[end]);
        inside += set->node[end].share > 0.0;
    }
    if (begin == end)
        return;

    change_nodes(set, load, inside, change);
    // The list grows or shrinks: move what follows, and drop what does not fit.
    int64_t room = set->pool_capacity - *set->used + (end - begin);
    int64_t marked = bits_count(set->mark, node_used);
    int64_t more = (marked < room ? marked : room) - (end - begin);
    move_entries(set, end + more, end, *set->used - end);
    if (more < 0)
        clear_entries(set, *set->used + more, -more);
    // Write it back, ascending.
    write_marked(set, begin, end - begin + more, node_used, first_node);
    *set->used += more;
    load->count += more;
    // Loads behind it begin elsewhere now.
    for (int64_t later = k + 1; later < *set->count; later++)
        set->load[later].first += more;
}

void loads_follow(LoadSet *set, Body *bodies, int body_count, int changed,
                  const TopologyChange *change)
{
    if (set->count == NULL || *set->count == 0)
        return; // a scene without loads, or without active ones
    int first_node = 0;
    for (int b = 0; b < changed; b++)
        first_node += bodies[b].surface.node_count;
    for (int k = 0; k < *set->count; k++) {
        follow_load(set, k, first_node, &bodies[changed].surface, change);
        measure_area(set, bodies, &set->load[k]);
    }
    apply_all(set, bodies, body_count);
}

// ---------------------------------------------------------------------------------------------
// Start and end

// Appends the nodes of a body within a region to the last load in the pool. Returns their number,
// including those beyond the capacity, which are not written.
static int64_t take_nodes(LoadSet *set, const Load *load, const Body *body, int first_node,
                          bool *any_free, bool *any)
{
    // On a body that changes, include the surrounding nodes: a new node is between two of these.
    bool changes = body_changes(body);
    Region region = {.kind = REGION_CAPSULE, .from = load->center, .to = load->center};
    region.radius = load->radius + (changes ? 2.0 * body->surface.longest_edge : 0.0);
    // The pool's free end takes what is found.
    int64_t at = load->first + load->count;
    int *found = &set->pool[at];
    int room = set->pool_capacity - (int)at;
    int count = body->ops->find_nodes(body->model, &region, found, room);
    int written = count < room ? count : room;
    // Judge each by the place at which it is now.
    for (int i = 0; i < written; i++) {
        LoadNode node = {.share = 1.0};
        if (changes) {
            Vec3 start;
            body->ops->read_nodes(body->model, &found[i], 1, &start, NULL);
            node = judge_node(load, start);
            give(set, found[i], &node);
        }
        *any |= node.share > 0.0;
        *any_free |= node.share > 0.0 && !body->ops->is_fixed(body->model, found[i]);
        found[i] += first_node;
        if (set->node != NULL)
            set->node[at + i] = node;
    }
    // On changing bodies the list must ascend.
    if (changes)
        write_marked(set, at, written, body->surface.node_used, first_node);
    return count;
}

bool loads_start(LoadSet *set, Body *bodies, int body_count, int body, Vec3 center, double radius,
                 Vec3 force, int64_t end_step, char *why, size_t why_size)
{
    // A load needs a slot.
    if (*set->count == LOAD_CAPACITY) {
        snprintf(why, why_size, "%d loads are in force, no room for more", LOAD_CAPACITY);
        return false;
    }
    Load load = {.end_step = end_step,
                 .force = force,
                 .center = center,
                 .radius = radius,
                 .first = *set->used};
    bool any = false;
    bool any_free = false; // fixed nodes take their share of the area, and the scene carries it
    bool fits = true;
    int first_node = 0;
    // Take the nodes; without a free one, or without space, give the entries back.
    for (int b = 0; b < body_count && fits; first_node += bodies[b++].surface.node_count) {
        if (body >= 0 && b != body)
            continue;
        int64_t room = set->pool_capacity - (load.first + load.count);
        int64_t count = take_nodes(set, &load, &bodies[b], first_node, &any_free, &any);
        fits = count <= room;
        load.count += fits ? count : room;
    }
    // Nothing has been changed when it is refused.
    if (!fits || !any_free)
        clear_entries(set, load.first, load.count);
    if (!fits) {
        snprintf(why, why_size, "the active loads act on too many nodes (space for %d)",
                 set->pool_capacity);
        return false;
    }
    if (!any) {
        snprintf(why, why_size, "no node within %g m of (%g, %g, %g)", radius, center.x, center.y,
                 center.z);
        return false;
    }
    if (!any_free) {
        snprintf(why, why_size, "no free node within %g m of (%g, %g, %g): all %lld are fixed",
                 radius, center.x, center.y, center.z, (long long)load.count);
        return false;
    }
    // The load is valid: activate it and check the criteria of adaptation there.
    measure_area(set, bodies, &load);
    // Entries and record become the load's.
    *set->used += load.count;
    set->record[*set->count] = (LoadRecord){0};
    set->load[(*set->count)++] = load;
    apply_all(set, bodies, body_count);
    for (int b = 0; b < body_count; b++)
        if ((body < 0 || b == body) && bodies[b].ops->look != NULL)
            bodies[b].ops->look(bodies[b].model);
    return true;
}

bool loads_act_on(const LoadSet *set, int64_t load, int first_node, int node_count)
{
    const Load *at = &set->load[load];
    for (int64_t i = at->first; i < at->first + at->count; i++)
        if (set->pool[i] >= first_node && set->pool[i] < first_node + node_count &&
            (set->node == NULL || set->node[i].share > 0.0))
            return true;
    return false;
}

void loads_add_places(const LoadSet *set, int64_t load, int first_node, Places *places)
{
    const Load *at = &set->load[load];
    const int end = first_node + places->body->surface.node_count;
    for (int64_t i = at->first; i < at->first + at->count; i++)
        if (set->pool[i] >= first_node && set->pool[i] < end &&
            (set->node == NULL || set->node[i].share > 0.0))
            places_add(places, set->pool[i] - first_node);
}

void loads_expire(LoadSet *set, Body *bodies, int body_count, int64_t step)
{
    bool ended = false;
    int64_t kept = 0, used = 0;
    // Loads that go on move together.
    for (int64_t k = 0; k < *set->count; k++) {
        Load load = set->load[k];
        if (load.end_step <= step) {
            ended = true;
            continue;
        }
        move_entries(set, used, load.first, load.count);
        load.first = used;
        used += load.count;
        set->record[kept] = set->record[k];
        set->load[kept++] = load;
    }
    // The state is zero beyond what is in use.
    memset(&set->record[kept], 0, (size_t)(*set->count - kept) * sizeof *set->record);
    clear_entries(set, used, *set->used - used);
    *set->count = kept;
    *set->used = used;
    // The remaining forces are summed anew.
    if (ended)
        apply_all(set, bodies, body_count);
}

// True if a slot, counted over all bodies, has ever had a node.
static bool is_place(const Body *bodies, int body_count, int node)
{
    for (int b = 0; b < body_count && node >= 0; b++) {
        if (node < bodies[b].surface.node_count)
            return node < bodies[b].surface.node_used;
        node -= bodies[b].surface.node_count;
    }
    return false;
}

bool loads_check(const LoadSet *set, const Body *bodies, int body_count)
{
    // Scenes without loads have none to check.
    if (set->count == NULL)
        return true;
    int64_t used = 0;
    if (*set->count < 0 || *set->count > LOAD_CAPACITY || *set->used < 0 ||
        *set->used > set->pool_capacity)
        return false;
    // Loads follow one another in the pool, without gaps.
    for (int64_t k = 0; k < *set->count; k++) {
        const Load *load = &set->load[k];
        if (load->first != used || load->count < 0 || load->count > *set->used - used ||
            !vec3_finite(load->force) || !(load->area >= 0.0 && load->area < 1e300))
            return false;
        used += load->count;
    }
    // All nodes exist, with shares that a load can have.
    for (int64_t i = 0; i < used; i++) {
        if (!is_place(bodies, body_count, set->pool[i]))
            return false;
        if (set->node != NULL && !(set->node[i].share >= 0.0 && set->node[i].share <= 1.0 &&
                                   vec3_finite(set->node[i].start)))
            return false;
    }
    return used == *set->used; // nothing beyond the last
}
