#include "dynamics/load.h"

#include <stdio.h>
#include <string.h>

void loads_create(LoadSet *set, int node_count, Arena *arena, StateList *state)
{
    // Room for two loads that each take every node, or many small ones.
    set->pool_capacity = 2 * node_count;
    size_t capacity = (size_t)set->pool_capacity;
    set->count = arena_allocate(arena, ARENA_STEP, 1, sizeof *set->count, "loads/count");
    set->used = arena_allocate(arena, ARENA_STEP, 1, sizeof *set->used, "loads/used");
    set->load = arena_allocate(arena, ARENA_STEP, LOAD_CAPACITY, sizeof *set->load, "loads/load");
    set->pool = arena_allocate(arena, ARENA_STEP, capacity, sizeof *set->pool, "loads/pool");
    state_add(state, set->count, sizeof *set->count, "loads/count");
    state_add(state, set->used, sizeof *set->used, "loads/used");
    state_add(state, set->load, LOAD_CAPACITY * sizeof *set->load, "loads/load");
    state_add(state, set->pool, capacity * sizeof *set->pool, "loads/pool");
}

// Sums the forces anew in the order of the loads, so that they depend on the loads in force alone
// and not on those that came and went.
static void apply_all(const LoadSet *set, Body *bodies, int body_count)
{
    for (int b = 0; b < body_count; b++)
        bodies[b].ops->clear_loads(bodies[b].model);
    for (int64_t k = 0; k < *set->count; k++) {
        const Load *load = &set->load[k];
        Body *body = bodies; // a load's nodes are in the order of the bodies
        int first_node = 0;  // of that body
        for (int64_t i = load->first; i < load->first + load->count; i++) {
            for (; set->pool[i] - first_node >= body->surface.node_count; body++)
                first_node += body->surface.node_count;
            int node = set->pool[i] - first_node;
            double share = body->surface.node_area[node] / load->area;
            body->ops->add_load(body->model, node, vec3_scale(share, load->force));
        }
    }
}

bool loads_start(LoadSet *set, Body *bodies, int body_count, int body, Vec3 center, double radius,
                 Vec3 force, int64_t end_step, char *why, size_t why_size)
{
    if (*set->count == LOAD_CAPACITY) {
        snprintf(why, why_size, "%d loads are in force, no room for more", LOAD_CAPACITY);
        return false;
    }
    Load load = {.end_step = end_step, .force = force, .first = *set->used};
    Region region = {.kind = REGION_CAPSULE, .from = center, .to = center, .radius = radius};
    bool any_free = false; // held nodes take their share of the area, and the scene holds them
    bool fits = true;
    int first_node = 0;
    for (int b = 0; b < body_count && fits; first_node += bodies[b++].surface.node_count) {
        if (body >= 0 && b != body)
            continue;
        const Body *at = &bodies[b];
        int *found = &set->pool[load.first + load.count];
        int room = set->pool_capacity - (int)(load.first + load.count);
        int count = at->ops->find_nodes(at->model, &region, found, room);
        fits = count <= room;
        count = fits ? count : room;
        for (int i = 0; i < count; i++) {
            load.area += at->surface.node_area[found[i]];
            any_free |= !at->ops->is_fixed(at->model, found[i]);
            found[i] += first_node;
        }
        load.count += count;
    }
    if (!fits || !any_free)
        memset(&set->pool[load.first], 0, (size_t)load.count * sizeof *set->pool);
    if (!fits) {
        snprintf(why, why_size, "the loads in force hold too many nodes (room for %d)",
                 set->pool_capacity);
        return false;
    }
    if (load.count == 0) {
        snprintf(why, why_size, "no node within %g m of (%g, %g, %g)", radius, center.x, center.y,
                 center.z);
        return false;
    }
    if (!any_free) {
        snprintf(why, why_size, "no free node within %g m of (%g, %g, %g): all %lld are held",
                 radius, center.x, center.y, center.z, (long long)load.count);
        return false;
    }
    *set->used += load.count;
    set->load[(*set->count)++] = load;
    apply_all(set, bodies, body_count);
    return true;
}

void loads_expire(LoadSet *set, Body *bodies, int body_count, int64_t step)
{
    bool ended = false;
    int64_t kept = 0, used = 0;
    for (int64_t k = 0; k < *set->count; k++) {
        Load load = set->load[k];
        if (load.end_step <= step) {
            ended = true;
            continue;
        }
        memmove(&set->pool[used], &set->pool[load.first], (size_t)load.count * sizeof *set->pool);
        load.first = used;
        used += load.count;
        set->load[kept++] = load;
    }
    memset(&set->pool[used], 0, (size_t)(*set->used - used) * sizeof *set->pool);
    *set->count = kept;
    *set->used = used;
    if (ended)
        apply_all(set, bodies, body_count);
}

void loads_clear(LoadSet *set, Body *bodies, int body_count)
{
    memset(set->pool, 0, (size_t)*set->used * sizeof *set->pool);
    *set->count = *set->used = 0;
    apply_all(set, bodies, body_count);
}
