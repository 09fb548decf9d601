#include "cut_toy.h"

#include "base/check.h"
#include "geometry/generator.h"
#include "geometry/winged_edge.h"

#include <stdlib.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// What follows from the broken links

// The faces round a node that unbroken links join with `face`, within the node's own faces.
static void mark_joined(const CutToy *toy, int face, int node, bool *marked)
{
    marked[face] = true;
    for (int k = 0; k < 3; k++) {
        int link = toy->neighbor[face][k];
        if (link < 0 || toy->broken[link])
            continue;
        int other = toy->link[link][toy->link[link][0] == face];
        bool here = false;
        for (int c = 0; c < 3; c++)
            here |= toy->corner[other][c] == node;
        // The edge must end at the node, too.
        bool ends = toy->corner[face][k] == node || toy->corner[face][(k + 1) % 3] == node;
        if (here && ends && !marked[other])
            mark_joined(toy, other, node, marked);
    }
}

static void list_faces(CutToy *toy)
{
    memset(toy->face_end, 0, (size_t)toy->places * sizeof *toy->face_end);
    memset(toy->node_area, 0, (size_t)toy->places * sizeof *toy->node_area);
    for (int f = 0; f < toy->faces; f++)
        for (int k = 0; k < 3; k++)
            toy->face_end[toy->corner[f][k]]++;
    for (int i = 0, at = 0; i < toy->places; i++) {
        toy->face_start[i] = at;
        at += toy->face_end[i];
        toy->face_end[i] = toy->face_start[i];
    }
    for (int f = 0; f < toy->faces; f++)
        for (int k = 0; k < 3; k++) {
            int node = toy->corner[f][k], link = toy->neighbor[f][k];
            toy->around[toy->face_end[node]++] = f;
            toy->node_area[node] += toy->face_area[f] / 3.0;
            toy->face_neighbor[f][k] =
                link < 0 || toy->broken[link] ? -1 : toy->link[link][toy->link[link][0] == f];
        }
    for (int i = 0; i < toy->places; i++)
        toy->node_mass[i] = toy->node_area[i]; // 1 kg/m2
}

static void rebuild(Body *body)
{
    CutToy *toy = body->model;
    list_faces(toy);
    if (body->surface.node_used < *toy->used)
        body->surface.node_used = *toy->used;
}

// Gives the parts of each node that links no longer join nodes of their own, in index order.
static void part_nodes(Body *body, TopologyChange *change)
{
    CutToy *toy = body->model;
    bool *marked = calloc((size_t)toy->faces, sizeof *marked); // a toy may
    ASSERT(marked != NULL);
    for (int node = 0; node < *toy->used; node++) {
        memset(marked, 0, (size_t)toy->faces);
        bool first = true;
        for (int f = 0; f < toy->faces; f++)
            for (int k = 0; k < 3; k++) {
                if (toy->corner[f][k] != node || marked[f])
                    continue;
                if (first) {
                    mark_joined(toy, f, node, marked);
                    first = false;
                    continue;
                }
                bool *part = calloc((size_t)toy->faces, sizeof *part);
                ASSERT(part != NULL);
                mark_joined(toy, f, node, part);
                int copy = (*toy->used)++;
                for (int g = 0; g < toy->faces; g++)
                    for (int c = 0; c < 3 && part[g]; c++)
                        if (toy->corner[g][c] == node)
                            toy->corner[g][c] = copy;
                free(part);
                toy->position[copy] = toy->position[node];
                toy->born[change->born_count++] = (NodeBirth){copy, {node, node}};
            }
    }
    free(marked);
    change->born = toy->born;
    rebuild(body);
    toy->changes++;
}

int cut_toy_broken(const CutToy *toy)
{
    int count = 0;
    for (int i = 0; i < toy->links; i++)
        count += toy->broken[i];
    return count;
}

int cut_toy_pieces(const CutToy *toy)
{
    int *root = malloc((size_t)toy->faces * sizeof *root), count = toy->faces;
    ASSERT(root != NULL);
    for (int f = 0; f < toy->faces; f++)
        root[f] = f;
    for (bool changed = true; changed;) {
        changed = false;
        for (int i = 0; i < toy->links; i++) {
            int a = root[toy->link[i][0]], b = root[toy->link[i][1]];
            if (toy->broken[i] || a == b)
                continue;
            root[toy->link[i][0]] = root[toy->link[i][1]] = a < b ? a : b;
            changed = true;
        }
    }
    for (int f = 0; f < toy->faces; f++)
        count -= root[f] != f;
    free(root);
    return count;
}

// ---------------------------------------------------------------------------------------------
// Cuts

static CutPoint center_of(const CutToy *toy, int face)
{
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; k++)
        sum = vec3_add(sum, toy->position[toy->corner[face][k]]);
    CutPoint point;
    ASSERT(cut_quantise(vec3_scale(1.0 / 3.0, sum), vec3(0, 0, 0), toy->quantum, &point));
    return point;
}

static bool quantise_edge(const CutToy *toy, const BladeEdge *edge, int64_t tries, CutPoint out[2])
{
    for (int k = 0; k < 2; k++) {
        if (!cut_quantise(edge->end[k], vec3(0, 0, 0), toy->quantum, &out[k]))
            return false;
        CutPoint shift = cut_shift(tries, k);
        for (int c = 0; c < 3; c++)
            out[k].x[c] += shift.x[c];
    }
    return true;
}

// New bits in `hit`; false: degenerate.
static bool test_links(const CutToy *toy, const CutPath edge[2], const CutPoint *from,
                       const CutPoint *to, int parts, bool *hit, int *met)
{
    memset(hit, 0, (size_t)toy->links);
    *met = 0;
    for (int i = 0; i < toy->links; i++)
        for (int p = 0; p < parts; p++) {
            CutPath link[2], piece[2];
            for (int k = 0; k < 2; k++) {
                int face = toy->link[i][k];
                link[k] = cut_part((CutPath){{from[face], to[face]}}, p, parts);
                piece[k] = cut_part(edge[k], p, parts);
            }
            if (!cut_may_meet(piece, link))
                continue;
            int count = cut_count(piece, link);
            if (count == CUT_DEGENERATE)
                return false;
            *met += count % 2;
            hit[i] |= count % 2 == 1 && !toy->broken[i];
        }
    return true;
}

static void commit_bits(Body *body, const bool *hit, CutOutcome *outcome, TopologyChange *change)
{
    CutToy *toy = body->model;
    for (int i = 0; i < toy->links; i++) {
        outcome->separated += hit[i];
        toy->broken[i] |= hit[i];
    }
    part_nodes(body, change);
    outcome->verdict = CUT_DONE;
    outcome->nodes_added = change->born_count;
    outcome->pieces = cut_toy_pieces(toy);
}

// Sweeps from edge[0] to edge[1] and from[face] to to[face]. `fresh`: the start may be shifted too.
static bool sweep(Body *body, const CutSweep *asked, int64_t *tries, bool fresh, CutPoint before[2],
                  CutPoint after[2], const CutPoint *from, const CutPoint *to, CutOutcome *outcome,
                  TopologyChange *change)
{
    CutToy *toy = body->model;
    int parts = cut_subticks(asked, 0.05 * toy->size), met = 0, count = 0;
    if (parts == 0) {
        outcome->verdict = CUT_TOO_TWISTED;
        return false;
    }
    bool *hit = calloc((size_t)toy->links, sizeof *hit); // a toy may
    ASSERT(hit != NULL);
    for (int64_t last = *tries + CUT_TRIES;; (*tries)++) {
        bool fits = quantise_edge(toy, &asked->after, *tries, after) &&
                    (!fresh || quantise_edge(toy, &asked->before, *tries, before));
        const CutPath edge[2] = {{{before[0], after[0]}}, {{before[1], after[1]}}};
        if (!fits || *tries > last) {
            outcome->verdict = fits ? CUT_UNRESOLVED : CUT_TOO_LARGE;
            free(hit);
            return false;
        }
        if (test_links(toy, edge, from, to, parts, hit, &met))
            break;
    }
    for (int i = 0; i < toy->links; i++)
        count += hit[i];
    outcome->verdict = met == 0 ? CUT_MET_NOTHING : CUT_WAS_CUT;
    outcome->needed = 2 * count;
    outcome->room = toy->node_limit - *toy->used;
    bool fits = outcome->needed <= outcome->room;
    if (count > 0 && fits)
        commit_bits(body, hit, outcome, change);
    else if (count > 0)
        outcome->verdict = CUT_NO_NODES;
    free(hit);
    return count > 0 && fits;
}

static bool toy_cut(Body *body, const CutSweep *asked, CutOutcome *outcome, TopologyChange *change)
{
    CutToy *toy = body->model;
    if (toy->calls < CUT_TOY_CALLS)
        toy->call[toy->calls] =
            (CutCall){*asked, asked->stroke != NULL ? asked->stroke->under_way : -1};
    toy->calls++;
    if (asked->phase == CUT_ENDS)
        return false;
    CutPoint *now = calloc((size_t)toy->faces, sizeof *now), before[2], after[2];
    ASSERT(now != NULL);
    for (int f = 0; f < toy->faces; f++)
        now[f] = center_of(toy, f);
    bool changed = false;
    if (asked->phase == CUT_WHOLE) {
        int64_t tries = 0;
        changed = sweep(body, asked, &tries, true, before, after, now, now, outcome, change);
    } else {
        CutPoint *then = &toy->center[asked->blade * toy->faces];
        CutPoint *edge = &toy->edge[2 * asked->blade];
        bool begins = asked->phase == CUT_BEGINS;
        memcpy(before, edge, sizeof before);
        bool known = true;
        if (begins) {
            known = quantise_edge(toy, &asked->after, asked->stroke->tries, after);
            if (!known)
                outcome->verdict = CUT_TOO_LARGE;
        } else {
            changed = sweep(body, asked, &asked->stroke->tries, toy->begun[asked->blade] == 1,
                            before, after, then, now, outcome, change);
        }
        if (known && !cut_refuses(outcome->verdict)) {
            toy->begun[asked->blade] = begins;
            memcpy(then, now, (size_t)toy->faces * sizeof *now);
            memcpy(edge, after, sizeof after);
        }
    }
    free(now);
    return changed;
}

static bool toy_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change)
{
    (void)tick;
    CutToy *toy = body->model;
    bool *hit = calloc((size_t)toy->links, sizeof *hit), any = false; // a toy may
    ASSERT(hit != NULL);
    for (int i = 0; i < toy->tear_next; i++)
        any |= hit[i] = !toy->broken[i];
    if (any)
        commit_bits(body, hit, outcome, change);
    free(hit);
    return any;
}

static bool toy_reconstruct(Body *body, TopologyChange *change)
{
    (void)change;
    ((CutToy *)body->model)->reconstructions++;
    return false;
}

static void toy_reserve_blades(void *self, int blades, Arena *arena, StateList *state)
{
    CutToy *toy = self;
    size_t points = (size_t)(blades * toy->faces);
    toy->center = arena_allocate(arena, ARENA_STEP, points, sizeof *toy->center, "toy/centers");
    toy->edge =
        arena_allocate(arena, ARENA_STEP, 2 * (size_t)blades, sizeof *toy->edge, "toy/edges");
    toy->begun = arena_allocate(arena, ARENA_STEP, (size_t)blades, sizeof *toy->begun, "toy/begun");
    state_add(state, toy->center, points * sizeof *toy->center, "toy/centers");
    state_add(state, toy->edge, 2 * (size_t)blades * sizeof *toy->edge, "toy/edges");
    state_add(state, toy->begun, (size_t)blades * sizeof *toy->begun, "toy/begun");
}

// ---------------------------------------------------------------------------------------------
// Nothing moves of itself

static void toy_drift(void *self, double dt)
{
    (void)self, (void)dt;
}

static void toy_evaluate(void *self, const Stage *stage, double h)
{
    (void)self, (void)stage, (void)h;
}

static bool toy_commit(void *self)
{
    CutToy *toy = self;
    bool good = !toy->bad;
    toy->bad = false;
    return good;
}

static void toy_restore(void *self, RestoreMode mode)
{
    (void)self, (void)mode;
}

static void toy_read_nodes(const void *self, const int *node, int count, Vec3 *position,
                           Vec3 *velocity)
{
    const CutToy *toy = self;
    for (int i = 0; i < count; i++) {
        ASSERT(node[i] < *toy->used);
        position[i] = toy->position[node[i]];
        if (velocity != NULL)
            velocity[i] = vec3(0, 0, 0);
    }
}

static bool toy_is_fixed(const void *self, int node)
{
    (void)self, (void)node;
    return false;
}

static void toy_add_forces(void *self, const int *node, int count, const Vec3 *force)
{
    (void)self, (void)node, (void)count, (void)force;
}

static int toy_find_nodes(const void *self, const Region *region, int *node, int capacity)
{
    const CutToy *toy = self;
    int found = 0;
    for (int i = 0; i < *toy->used; i++)
        if (vec3_length(vec3_sub(toy->position[i], region->from)) <= region->radius &&
            found++ < capacity)
            node[found - 1] = i;
    return found;
}

static void toy_add_load(void *self, int node, Vec3 force)
{
    CutToy *toy = self;
    ASSERT(node < *toy->used);
    toy->load[node] = vec3_add(toy->load[node], force);
}

static void toy_clear_loads(void *self)
{
    CutToy *toy = self;
    memset(toy->load, 0, (size_t)toy->places * sizeof *toy->load);
}

static bool toy_set(void *self, BodyParameter parameter, double value)
{
    (void)self, (void)parameter, (void)value;
    return true;
}

// Its energy is of no interest: none, at any time.
static void toy_measure(const void *self, BodyMeasure *measure)
{
    (void)self;
    *measure = (BodyMeasure){0};
}

static const BodyOps toy_ops = {
    .model = "cut toy",
    .cut = toy_cut,
    .reconstruct = toy_reconstruct,
    .drift = toy_drift,
    .evaluate = toy_evaluate,
    .commit = toy_commit,
    .restore = toy_restore,
    .read_nodes = toy_read_nodes,
    .measure = toy_measure,
    .is_fixed = toy_is_fixed,
    .add_forces = toy_add_forces,
    .find_nodes = toy_find_nodes,
    .add_load = toy_add_load,
    .clear_loads = toy_clear_loads,
    .set = toy_set,
    .restored = rebuild,
    .reserve_blades = toy_reserve_blades,
};

// ---------------------------------------------------------------------------------------------
// Creation

#define ALLOCATE(count, member)                                                                    \
    toy->member =                                                                                  \
        arena_allocate(arena, ARENA_STEP, (size_t)(count), sizeof *toy->member, "toy/" #member)

static void take_mesh(CutToy *toy, const TriMesh *mesh, Arena *arena)
{
    WingedMesh winged;
    winged_create(&winged, mesh);
    toy->faces = mesh->triangle_count;
    toy->base_nodes = mesh->node_count;
    toy->places = 3 * toy->faces;
    toy->node_limit = toy->places;
    ALLOCATE(winged.edge_count, link);
    ALLOCATE(toy->faces, neighbor);
    for (int e = 0; e < winged.edge_count; e++) {
        const int *face = winged.edge[e].face;
        int number = face[0] < 0 || face[1] < 0 ? -1 : toy->links++;
        for (int side = 0; side < 2; side++)
            for (int k = 0; k < 3 && face[side] >= 0; k++)
                if (winged.face_edge[face[side]][k] == e)
                    toy->neighbor[face[side]][k] = number;
        if (number >= 0) {
            toy->link[number][0] = face[0] < face[1] ? face[0] : face[1];
            toy->link[number][1] = face[0] < face[1] ? face[1] : face[0];
        }
    }
    winged_destroy(&winged);
    ALLOCATE(toy->faces, face_area);
    for (int f = 0; f < toy->faces; f++) {
        const int *c = mesh->triangle[f];
        Vec3 a = mesh->position[c[0]];
        toy->face_area[f] = 0.5 * vec3_length(vec3_cross(vec3_sub(mesh->position[c[1]], a),
                                                         vec3_sub(mesh->position[c[2]], a)));
    }
}

static CutToy *create_toy(const TriMesh *mesh, double cell, Arena *arena, StateList *state)
{
    CutToy *toy = arena_allocate(arena, ARENA_STEP, 1, sizeof *toy, "toy");
    toy->size = cell;
    toy->quantum = cell / 1024.0;
    take_mesh(toy, mesh, arena);
    ALLOCATE(toy->links, broken);
    ALLOCATE(toy->faces, corner);
    ALLOCATE(1, used);
    ALLOCATE(toy->places, position);
    memcpy(toy->corner, mesh->triangle, (size_t)toy->faces * sizeof *toy->corner);
    memcpy(toy->position, mesh->position, (size_t)toy->base_nodes * sizeof *toy->position);
    *toy->used = toy->base_nodes;
    state_add(state, toy->broken, (size_t)toy->links, "toy/broken");
    state_add(state, toy->corner, (size_t)toy->faces * sizeof *toy->corner, "toy/corner");
    state_add(state, toy->used, sizeof *toy->used, "toy/used");
    state_add(state, toy->position, (size_t)toy->places * sizeof *toy->position, "toy/position");
    ALLOCATE(toy->places, face_start);
    ALLOCATE(toy->places, face_end);
    ALLOCATE(3 * toy->faces, around);
    ALLOCATE(toy->places, node_area);
    ALLOCATE(toy->places, node_mass);
    ALLOCATE(toy->faces, face_neighbor);
    ALLOCATE(toy->places, born);
    ALLOCATE(CUT_TOY_CALLS, call);
    ALLOCATE(toy->places, load);
    state_add(state, toy->load, (size_t)toy->places * sizeof *toy->load, "toy/load");
    return toy;
}

void cut_scene_create(CutScene *scene, const CutSceneOptions *options)
{
    static BodyOps tearing;
    tearing = toy_ops;
    tearing.tear = toy_tear;
    *scene = (CutScene){0};
    Status status = {0};
    double side = options->cells * options->cell;
    ASSERT(
        generate_sheet(&scene->mesh, options->cells + 1, options->cells + 1, side, side, &status));
    SimOptions sim = {.rate_hz = options->rate_hz, .tool_timeout_s = 0.2, .may_load = true};
    scene->sim = sim_create(&sim, &scene->arena, &scene->state);
    CutToy *toy = create_toy(&scene->mesh, options->cell, &scene->arena, &scene->state);
    Body body = {
        .name = "wall",
        .ops = options->tears ? &tearing : &toy_ops,
        .model = toy,
        .surface = {.node_count = toy->places,
                    .face_count = toy->faces,
                    .face_used = toy->faces,
                    .face = (const int(*)[3])toy->corner,
                    .face_area = toy->face_area,
                    .finest_area = toy->face_area,
                    .face_neighbor = (const int(*)[3])toy->face_neighbor,
                    .node_face_start = toy->face_start,
                    .node_face_end = toy->face_end,
                    .node_face = toy->around,
                    .node_area = toy->node_area,
                    .node_mass = toy->node_mass,
                    .longest_edge = 1.5 * options->cell},
        .integrator = INTEGRATOR_SYMPLECTIC_EULER,
        .lambda = 1e5,
        .contact_lambda = 1e5,
        .damping = 20.0,
        .contact_ratio = 0.5,
        .tuning = {.stiffness_scale = 1.0, .damping_scale = 1.0},
    };
    rebuild(&body);
    scene->toy = toy;
    scene->body = sim_add_body(scene->sim, &body);
    for (int t = 0; t < options->tool_count; t++)
        sim_add_tool(scene->sim, &options->tool[t]);
    bool good = sim_seal(scene->sim, 0.0, &status);
    ASSERT(good);
}

void cut_scene_destroy(CutScene *scene)
{
    mesh_destroy(&scene->mesh);
    state_destroy(&scene->state);
    arena_destroy(&scene->arena);
}

void cut_toy_move(CutToy *toy, Vec3 by)
{
    for (int i = 0; i < *toy->used; i++)
        toy->position[i] = vec3_add(toy->position[i], by);
}
