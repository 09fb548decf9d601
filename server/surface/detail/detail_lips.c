// SPDX-License-Identifier: MIT
// The lips of the cuts of a body: where nodes are shown and touched that a cut has parted
// (surface/cut/cut_lips.h). All of it follows from the broken bits and the crossings. Step thread.
#include "surface/detail/detail.h"

#include <string.h>

void detail_lips_create(Detail *detail, Arena *arena, StateList *state)
{
    const char *name = detail->options.body.name;
    DetailCut *cut = detail->set.cut;
    const size_t edges = (size_t)cut->uncut.edge_count;
    const int nodes = cut->base_count + cut->copy_capacity;
    cut->crossing = ALLOCATE(ARENA_TOPOLOGY, edges + 1, LipCrossing, "crossings");
    state_add(state, cut->crossing, edges * sizeof *cut->crossing, "%s/crossings", name);
    cut->lips.node = ALLOCATE(ARENA_TOPOLOGY, nodes + 1, int, "lips");
    cut->lips.index = ALLOCATE(ARENA_TOPOLOGY, nodes + 1, int, "lips of nodes");
    cut->lips.lip = ALLOCATE(ARENA_TOPOLOGY, nodes + 1, Lip, "places of lips");
    cut->lips.mass = ALLOCATE(ARENA_TOPOLOGY, nodes + 1, double, "masses of lips");
    for (int i = 0; i < nodes; i++)
        cut->lips.index[i] = -1;
}

void detail_lips_forget(DetailLips *lips, int node)
{
    const int at = lips->index[node];
    if (at < 0)
        return;
    const int last = --lips->count;
    lips->node[at] = lips->node[last];
    lips->lip[at] = lips->lip[last];
    lips->index[lips->node[at]] = at;
    lips->index[node] = -1;
}

static void place(Detail *detail, int vertex)
{
    const LeafSet *set = &detail->set;
    DetailCut *cut = set->cut;
    DetailLips *lips = &cut->lips;
    const LipMesh mesh = {.level = &cut->uncut,
                          .rest = set->levels.position,
                          .broken = cut->broken,
                          .crossing = cut->crossing,
                          .h = cut->finder.h};
    Lip lip[LIPS_RING];
    const int around = detail_cut_ring(set, vertex, cut->ring);
    for (int i = 0; i < around; i++)
        detail_lips_forget(lips, cut->node[cut->ring[i].face][cut->ring[i].corner]);
    const int count = cut_lips_place(&mesh, cut->ring[0].face, cut->ring[0].corner, lip);
    for (int i = 0; i < count; i++) {
        const int node = cut->node[lip[i].face][lip[i].corner];
        if (detail_cut_is_gone(cut, lip[i].face))
            continue; // it has no node of its own
        lips->index[node] = lips->count;
        lips->node[lips->count] = node;
        lips->lip[lips->count++] = lip[i];
    }
}

void detail_lips_follow(Detail *detail, const int *edge, int count)
{
    const DetailCut *cut = detail->set.cut;
    bool *is_placed = detail->faces.is_redrawn; // false between changes
    // The corners of the faces beside: a lip depends on its own edges and on those opposite to it.
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < 2 * count; i++) {
            const int face = cut->uncut.edge_face[edge[i / 2]][i % 2];
            for (int k = 0; k < 3; k++) {
                const int vertex = cut->base[face][k];
                if (pass == 0 && !is_placed[vertex])
                    place(detail, vertex);
                is_placed[vertex] = pass == 0;
            }
        }
}

void detail_lips_rebuild(Detail *detail)
{
    DetailCut *cut = detail->set.cut;
    for (int i = 0; i < cut->lips.count; i++)
        cut->lips.index[cut->lips.node[i]] = -1;
    cut->lips.count = 0;
    for (int v = 0; v < cut->base_count; v++)
        if (cut->is_end[v])
            place(detail, v);
}

bool detail_lips_check(const LeafSet *set)
{
    static const LipCrossing none;
    const DetailCut *cut = set->cut;
    const double most = 1.001 * LIP_CROSSING_MOST * cut->finder.h; // with rounding
    for (int e = 0; e < cut->uncut.edge_count; e++) {
        const LipCrossing *c = &cut->crossing[e];
        if (memcmp(c, &none, sizeof none) == 0)
            continue;
        const int face = cut->uncut.edge_face[e][0];
        if (face < 0 || !(cut->broken[face] >> cut_side_of(&cut->uncut, face, e) & 1))
            return false;
        const Vec3 *x = set->levels.position,
                   at = vec3((double)c->at[0], (double)c->at[1], (double)c->at[2]);
        const Vec3 n = vec3((double)c->normal[0], (double)c->normal[1], (double)c->normal[2]);
        const Vec3 middle =
            vec3_scale(0.5, vec3_add(x[cut->uncut.edge[e][0]], x[cut->uncut.edge[e][1]]));
        if (!(vec3_length(vec3_sub(at, middle)) <= most) || !(fabs(vec3_length(n) - 1.0) <= 1e-3))
            return false;
    }
    return true;
}

bool detail_lips_carriers(const SurfaceModel *model, int node, int carrier[3], double share[3])
{
    const DetailCut *cut = model->detail != NULL ? model->detail->set.cut : NULL;
    if (cut == NULL || cut->lips.count == 0 || cut->lips.index[node] < 0)
        return false;
    const Lip *lip = &cut->lips.lip[cut->lips.index[node]];
    for (int k = 0; k < 3; k++)
        carrier[k] = cut->node[lip->face][(lip->corner + k) % 3];
    share[0] = 1.0 - lip->share[0] - lip->share[1];
    share[1] = lip->share[0];
    share[2] = lip->share[1];
    return true;
}

void detail_lips_read(const SurfaceModel *model, const void *rows, int node, Vec3 *position,
                      Vec3 *velocity)
{
    int carrier[3];
    double share[3];
    if (!detail_lips_carriers(model, node, carrier, share))
        return;
    const Vec3 x = *position, v = velocity != NULL ? *velocity : x;
    for (int k = 1; k < 3; k++) {
        Vec3 other, speed;
        rows_read(&model->basis, rows, model->slot[carrier[k]], &other, &speed);
        *position = vec3_madd(*position, share[k], vec3_sub(other, x));
        if (velocity != NULL)
            *velocity = vec3_madd(*velocity, share[k], vec3_sub(speed, v));
    }
}

// A force on a lip moves it by the sum of share^2 / mass of its carriers. A hanging node has no
// mass of its own: its masters have half of it each, and two of them as much as the node would
// have.
void detail_lips_weigh(SurfaceModel *model)
{
    const Detail *detail = model->detail;
    DetailLips *lips = &detail->set.cut->lips;
    memcpy(lips->mass, model->mass, (size_t)detail->set.node_count * sizeof *lips->mass);
    for (int i = 0; i < lips->count; i++) {
        const double own = model->mass[lips->node[i]];
        int carrier[3];
        double share[3], yields = 0.0;
        detail_lips_carriers(model, lips->node[i], carrier, share);
        for (int k = 0; k < 3; k++) {
            const double mass = model->mass[carrier[k]];
            if (!detail->fixed[carrier[k]])
                yields += share[k] * share[k] / (mass > 0.0 ? mass : own);
        }
        if (own > 0.0 && yields > 0.0)
            lips->mass[lips->node[i]] = 1.0 / yields;
    }
}

static void write(float *to, int slot, Vec3 v)
{
    to[3L * slot] = (float)v.x;
    to[3L * slot + 1] = (float)v.y;
    to[3L * slot + 2] = (float)v.z;
}

void detail_lips_show(const SurfaceModel *model, const void *rows, float *position, float *velocity)
{
    const DetailLips *lips = &model->detail->set.cut->lips;
    const int *slot = model->detail->faces.slots->node.slot;
    for (int i = 0; i < lips->count; i++) {
        const int node = lips->node[i];
        Vec3 x, v;
        rows_read(&model->basis, rows, model->slot[node], &x, &v);
        detail_lips_read(model, rows, node, &x, &v);
        write(position, slot[node], x);
        if (velocity != NULL)
            write(velocity, slot[node], v);
    }
}

void detail_lips_show_rest(const SurfaceModel *model, float *position)
{
    const LeafSet *set = &model->detail->set;
    const int *slot = model->detail->faces.slots->node.slot;
    for (int i = 0; i < set->cut->lips.count; i++) {
        const int node = set->cut->lips.node[i];
        int carrier[3];
        double share[3];
        Vec3 x = {0.0, 0.0, 0.0};
        detail_lips_carriers(model, node, carrier, share);
        for (int k = 0; k < 3; k++)
            x = vec3_madd(x, share[k], rows_rest(&model->basis, model->slot[carrier[k]]));
        write(position, slot[node], x);
    }
}
