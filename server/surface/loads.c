// SPDX-License-Identifier: MIT
// External forces in the tables of the kernel, in the coordinates of the rows: of contacts for one
// evaluation, of loads until they are cleared. Step thread.
#include "surface/detail/detail.h"

#include "base/check.h"

#include <string.h>

// Adds a force in the world frame [N] to a slot's entry in `external`.
static void add_external(SurfaceModel *model, int slot, Vec3 force)
{
    Vec3 f = rows_turn_in(&model->basis, force);
    const double part[3] = {f.x, f.y, f.z};
    for (int c = 0; c < 3; c++) {
        long at = model_lane(model_lane_of(model, slot)) + c * LANES;
        model_put(model, model->external, at, model_get(model, model->external, at) + part[c]);
    }
}

// Distributes a force in the world frame over the free nodes that carry a node: itself, unless it
// hangs. `is_shown`: one that acts where the node is shown.
static void spread(SurfaceModel *model, int node, Vec3 force, bool is_shown,
                   void (*add)(SurfaceModel *model, int slot, Vec3 force, double drift),
                   double drift)
{
    int carrier[3];
    double share[3];
    if (is_shown && detail_lips_carriers(model, node, carrier, share)) {
        for (int k = 0; k < 3; k++)
            spread(model, carrier[k], vec3_scale(share[k], force), false, add, drift);
        return;
    }
    const NodeStatus status =
        model->detail == NULL ? NODE_FREE : (NodeStatus)model->detail->set.status[node];
    // Masters receive half each, and may hang themselves.
    if (status == NODE_HANGING) {
        int parent[2];
        levels_parents(&model->detail->set.levels, node, parent);
        spread(model, parent[0], vec3_scale(0.5, force), false, add, drift);
        spread(model, parent[1], vec3_scale(0.5, force), false, add, drift);
        return;
    }
    if (status == NODE_FREE)
        add(model, model->slot[node], force, drift);
}

// --- contact forces ---

// Saves what a lane of `external` holds, until the next evaluation ends.
static void touch(SurfaceModel *model, int lane)
{
    if (model->is_touched[lane])
        return;
    model->is_touched[lane] = true;
    int k = model->touched_count++;
    ASSERT(k < model->touched_capacity);
    model->touched[k] = lane;
    for (int c = 0; c < 3; c++)
        model_put(model, model->untouched, 3L * k + c,
                  model_get(model, model->external, model_lane(lane) + c * LANES));
}

static void add_once(SurfaceModel *model, int slot, Vec3 force, double drift)
{
    (void)drift;
    touch(model, model_lane_of(model, slot));
    add_external(model, slot, force);
}

void surface_add_forces(void *self, const int *node, int count, const Vec3 *force)
{
    SurfaceModel *model = self;
    if (model->detail == NULL) // as spread would, but in one loop: most forces take this path
        for (int i = 0; i < count; i++)
            add_once(model, model->slot[node[i]], force[i], 0.0);
    else
        for (int i = 0; i < count; i++) {
            spread(model, node[i], force[i], true, add_once, 0.0);
            detail_feel(&model->detail->adapt, node[i], force[i]);
        }
}

// Changes the row that the evaluation has written.
static void kick(SurfaceModel *model, int slot, Vec3 impulse, double drift)
{
    const double by_mass = model_get(model, model->nodes.inverse_mass, model_lane_of(model, slot));
    const Vec3 dv = vec3_scale(by_mass, rows_turn_in(&model->basis, impulse));
    const double part[3] = {dv.x, dv.y, dv.z};
    void *rows = (void *)model->present;
    for (int c = 0; c < 3; c++) {
        const long at = (long)slot * ROW + c;
        model_put(model, rows, at, model_get(model, rows, at) + drift * part[c]);
        model_put(model, rows, at + 4, model_get(model, rows, at + 4) + part[c]);
    }
    model->bad |= !(vec3_length(dv) <= SPEED_LIMIT);
}

void surface_kick_nodes(void *self, const int *node, int count, const Vec3 *impulse, double h,
                        double drift)
{
    SurfaceModel *model = self;
    const bool last = model->present == model->rows[1 - model->current];
    for (int i = 0; i < count; i++) {
        spread(model, node[i], impulse[i], true, kick, drift);
        // As with forces, levels follow those of the tick's last evaluation alone.
        if (model->detail != NULL && last)
            detail_feel(&model->detail->adapt, node[i], vec3_scale(1.0 / h, impulse[i]));
    }
    if (model->detail != NULL && model->detail->lists.hanging_count > 0)
        detail_hang(&model->detail->lists, model->basis.precision, (void *)model->present);
}

void surface_reserve_forces(void *self, const char *name, int count, Arena *arena)
{
    SurfaceModel *model = self;
    // As many lanes as nodes that one evaluation can touch.
    if (model->detail != NULL && model->detail->set.cut != NULL)
        count = count < model->lane_count / 3 ? 3 * count : model->lane_count; // of lips
    size_t lanes = (size_t)(count < model->lane_count ? count : model->lane_count);
    model->touched_capacity = (int)lanes;
    model->touched = arena_allocate(arena, ARENA_CONTACT, lanes, sizeof *model->touched,
                                    "%s/touched slots", name);
    model->untouched = arena_allocate(arena, ARENA_CONTACT, 3 * lanes, model_real_size(model),
                                      "%s/touched loads", name);
    model->is_touched = arena_allocate(arena, ARENA_CONTACT, (size_t)model->lane_count,
                                       sizeof *model->is_touched, "%s/touched marks", name);
    if (model->detail != NULL)
        detail_reserve_felt(&model->detail->adapt, name, count, arena, model->detail->state);
}

// --- constant loads ---

static void add_constant(SurfaceModel *model, int slot, Vec3 force, double drift)
{
    (void)drift;
    if (model->world_load != NULL) {
        model->world_load[slot][0] += force.x;
        model->world_load[slot][1] += force.y;
        model->world_load[slot][2] += force.z;
    }
    add_external(model, slot, force);
    *model->loaded = 1;
}

void surface_add_load(void *self, int node, Vec3 force)
{
    spread(self, node, force, false, add_constant, 0.0);
}

void surface_clear_loads(void *self)
{
    SurfaceModel *model = self;
    if (*model->loaded != 0) {
        memset(model->external, 0, (size_t)model->lane_count * 3 * model_real_size(model));
        if (model->world_load != NULL)
            memset(model->world_load, 0, (size_t)model->basis.count * sizeof *model->world_load);
    }
    *model->loaded = 0;
}

void model_turn_loads(SurfaceModel *model)
{
    if (*model->loaded == 0)
        return;
    for (int s = 0; s < model->basis.count; s++) {
        if (model->node[s] < 0)
            continue;
        // From the world frame to that of the rows.
        const double *load = model->world_load[s];
        Vec3 f = rows_turn_in(&model->basis, (Vec3){load[0], load[1], load[2]});
        const double part[3] = {f.x, f.y, f.z};
        for (int c = 0; c < 3; c++)
            model_put(model, model->external, model_lane(model_lane_of(model, s)) + c * LANES,
                      part[c]);
    }
}
