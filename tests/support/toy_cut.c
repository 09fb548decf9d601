#include "base/check.h"
#include "geometry/edges.h"
#include "toy_parts.h"

#include <stdlib.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// Derived from the broken links

// The faces round a node that unbroken links join with `face`, within the node's own faces.
static void mark_joined(const Toy *toy, int face, int node, bool *marked)
{
    marked[face] = true;
    for (int k = 0; k < 3; k++) {
        int link = toy->cuts->across[face][k];
        if (link < 0 || toy->cuts->broken[link])
            continue;
        int other = toy->cuts->link[link][toy->cuts->link[link][0] == face];
        bool here = false;
        for (int c = 0; c < 3; c++)
            here |= toy->face[other][c] == node;
        // The edge must end at the node, too.
        bool ends = toy->face[face][k] == node || toy->face[face][(k + 1) % 3] == node;
        if (here && ends && !marked[other])
            mark_joined(toy, other, node, marked);
    }
}

void toy_cuts_rebuild(Body *body)
{
    Toy *toy = body->model;
    const ToyCuts *cuts = toy->cuts;
    toy_list_around(toy);
    for (int f = 0; f < toy->faces; f++)
        for (int k = 0; k < 3; k++) {
            int link = cuts->across[f][k];
            bool joined = link >= 0 && !cuts->broken[link];
            toy->neighbor[f][k] = joined ? cuts->link[link][cuts->link[link][0] == f] : -1;
        }
    if (body->surface.node_used < *cuts->used)
        body->surface.node_used = *cuts->used;
}

// Gives the parts of each node that links no longer join nodes of their own, in index order.
static void part_nodes(Body *body, TopologyChange *change)
{
    Toy *toy = body->model;
    bool *marked = calloc((size_t)toy->faces, sizeof *marked); // a toy may
    ASSERT(marked != NULL);
    for (int node = 0; node < *toy->cuts->used; node++) {
        memset(marked, 0, (size_t)toy->faces);
        bool first = true;
        for (int f = 0; f < toy->faces; f++)
            for (int k = 0; k < 3; k++) {
                if (toy->face[f][k] != node || marked[f])
                    continue;
                if (first) {
                    mark_joined(toy, f, node, marked);
                    first = false;
                    continue;
                }
                bool *part = calloc((size_t)toy->faces, sizeof *part);
                ASSERT(part != NULL);
                mark_joined(toy, f, node, part);
                int copy = (*toy->cuts->used)++;
                for (int g = 0; g < toy->faces; g++)
                    for (int c = 0; c < 3 && part[g]; c++)
                        if (toy->face[g][c] == node)
                            toy->face[g][c] = copy;
                free(part);
                toy->position[copy] = toy->position[node];
                toy->born[change->born_count++] = (NodeBirth){copy, {node, node}};
            }
    }
    free(marked);
    change->born = toy->born;
    toy_rebuild(body);
    toy->changes++;
}

int toy_broken(const Toy *toy)
{
    int count = 0;
    for (int i = 0; i < toy->cuts->links; i++)
        count += toy->cuts->broken[i];
    return count;
}

int toy_pieces(const Toy *toy)
{
    int *root = malloc((size_t)toy->faces * sizeof *root), count = toy->faces;
    ASSERT(root != NULL);
    for (int f = 0; f < toy->faces; f++)
        root[f] = f;
    for (bool changed = true; changed;) {
        changed = false;
        for (int i = 0; i < toy->cuts->links; i++) {
            int a = root[toy->cuts->link[i][0]], b = root[toy->cuts->link[i][1]];
            if (toy->cuts->broken[i] || a == b)
                continue;
            root[toy->cuts->link[i][0]] = root[toy->cuts->link[i][1]] = a < b ? a : b;
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

static CutPoint center_of(const Toy *toy, int face)
{
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; k++)
        sum = vec3_add(sum, toy->position[toy->face[face][k]]);
    CutPoint point;
    ASSERT(cut_quantise(vec3_scale(1.0 / 3.0, sum), vec3(0, 0, 0), toy->cuts->quantum, &point));
    return point;
}

static bool quantise_edge(const Toy *toy, const BladeEdge *edge, int64_t tries, CutPoint out[2])
{
    for (int k = 0; k < 2; k++) {
        if (!cut_quantise(edge->end[k], vec3(0, 0, 0), toy->cuts->quantum, &out[k]))
            return false;
        CutPoint shift = cut_shift(tries, k);
        for (int c = 0; c < 3; c++)
            out[k].x[c] += shift.x[c];
    }
    return true;
}

// New bits in `hit`; false: degenerate.
static bool test_links(const Toy *toy, const CutPath edge[2], const CutPoint *from,
                       const CutPoint *to, int parts, bool *hit, int *met)
{
    memset(hit, 0, (size_t)toy->cuts->links);
    *met = 0;
    for (int i = 0; i < toy->cuts->links; i++)
        for (int p = 0; p < parts; p++) {
            CutPath link[2], piece[2];
            for (int k = 0; k < 2; k++) {
                int face = toy->cuts->link[i][k];
                link[k] = cut_part((CutPath){{from[face], to[face]}}, p, parts);
                piece[k] = cut_part(edge[k], p, parts);
            }
            if (!cut_may_meet(piece, link))
                continue;
            int count = cut_count(piece, link);
            if (count == CUT_DEGENERATE)
                return false;
            *met += count % 2;
            hit[i] |= count % 2 == 1 && !toy->cuts->broken[i];
        }
    return true;
}

static void commit_bits(Body *body, const bool *hit, CutOutcome *outcome, TopologyChange *change)
{
    Toy *toy = body->model;
    for (int i = 0; i < toy->cuts->links; i++) {
        outcome->separated += hit[i];
        toy->cuts->broken[i] |= hit[i];
    }
    part_nodes(body, change);
    outcome->verdict = CUT_DONE;
    outcome->nodes_added = change->born_count;
    outcome->pieces = toy_pieces(toy);
}

// Sweeps from edge[0] to edge[1] and from[face] to to[face]. `fresh`: the start may be shifted too.
static bool sweep(Body *body, const CutSweep *asked, int64_t *tries, bool fresh, CutPoint before[2],
                  CutPoint after[2], const CutPoint *from, const CutPoint *to, CutOutcome *outcome,
                  TopologyChange *change)
{
    Toy *toy = body->model;
    int parts = cut_subticks(asked, 0.05 * toy->cuts->size), met = 0, count = 0;
    if (parts == 0) {
        outcome->verdict = CUT_TOO_TWISTED;
        return false;
    }
    bool *hit = calloc((size_t)toy->cuts->links, sizeof *hit); // a toy may
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
    for (int i = 0; i < toy->cuts->links; i++)
        count += hit[i];
    outcome->verdict = met == 0 ? CUT_MET_NOTHING : CUT_WAS_CUT;
    outcome->needed = 2 * count;
    outcome->room = toy->cuts->node_limit - *toy->cuts->used;
    bool fits = outcome->needed <= outcome->room;
    if (count > 0 && fits)
        commit_bits(body, hit, outcome, change);
    else if (count > 0)
        outcome->verdict = CUT_NO_NODES;
    free(hit);
    return count > 0 && fits;
}

bool toy_cut(Body *body, const CutSweep *asked, CutOutcome *outcome, TopologyChange *change)
{
    Toy *toy = body->model;
    if (toy->cuts->calls < TOY_CALLS)
        toy->cuts->call[toy->cuts->calls] =
            (ToyCall){*asked, asked->stroke != NULL ? asked->stroke->under_way : -1};
    toy->cuts->calls++;
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
        CutPoint *then = &toy->cuts->center[asked->blade * toy->faces];
        CutPoint *edge = &toy->cuts->edge[2 * asked->blade];
        bool begins = asked->phase == CUT_BEGINS;
        memcpy(before, edge, sizeof before);
        bool known = true;
        if (begins) {
            known = quantise_edge(toy, &asked->after, asked->stroke->tries, after);
            if (!known)
                outcome->verdict = CUT_TOO_LARGE;
        } else {
            changed = sweep(body, asked, &asked->stroke->tries, toy->cuts->begun[asked->blade] == 1,
                            before, after, then, now, outcome, change);
        }
        if (known && !cut_refuses(outcome->verdict)) {
            toy->cuts->begun[asked->blade] = begins;
            memcpy(then, now, (size_t)toy->faces * sizeof *now);
            memcpy(edge, after, sizeof after);
        }
    }
    free(now);
    return changed;
}

bool toy_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change)
{
    (void)tick;
    Toy *toy = body->model;
    bool *hit = calloc((size_t)toy->cuts->links, sizeof *hit), any = false; // a toy may
    ASSERT(hit != NULL);
    for (int i = 0; i < toy->cuts->tear_next; i++)
        any |= hit[i] = !toy->cuts->broken[i];
    if (any)
        commit_bits(body, hit, outcome, change);
    free(hit);
    return any;
}

bool toy_reconstruct(Body *body, TopologyChange *change)
{
    (void)change;
    ((Toy *)body->model)->cuts->reconstructions++;
    return false;
}

void toy_reserve_blades(void *self, int blades, Arena *arena, StateList *state)
{
    const Toy *toy = self;
    ToyCuts *cuts = toy->cuts;
    const char *name = "toy/blades";
    const size_t points = (size_t)(blades * toy->faces), number = (size_t)blades;
    TOY_ARRAY(points, cuts->center);
    TOY_ARRAY(2 * number, cuts->edge);
    TOY_ARRAY(number, cuts->begun);
    state_add(state, cuts->center, points * sizeof *cuts->center, "toy/centers");
    state_add(state, cuts->edge, 2 * number * sizeof *cuts->edge, "toy/edges");
    state_add(state, cuts->begun, number * sizeof *cuts->begun, "toy/begun");
}

// ---------------------------------------------------------------------------------------------
// Creation

static void take_links(Toy *toy, const char *name, const TriMesh *mesh, Arena *arena)
{
    ToyCuts *cuts = toy->cuts;
    WingedMesh winged;
    winged_create(&winged, mesh);
    TOY_ARRAY(winged.edge_count, cuts->link);
    TOY_ARRAY(toy->faces, cuts->across);
    for (int e = 0; e < winged.edge_count; e++) {
        const int *face = winged.edge[e].face;
        int number = face[0] < 0 || face[1] < 0 ? -1 : cuts->links++;
        for (int side = 0; side < 2; side++)
            for (int k = 0; k < 3 && face[side] >= 0; k++)
                if (winged.face_edge[face[side]][k] == e)
                    cuts->across[face[side]][k] = number;
        if (number >= 0) {
            cuts->link[number][0] = face[0] < face[1] ? face[0] : face[1];
            cuts->link[number][1] = face[0] < face[1] ? face[1] : face[0];
        }
    }
    winged_destroy(&winged);
}

void toy_cuts_create(Toy *toy, const char *name, const TriMesh *mesh, const ToyOptions *options,
                     Arena *arena, StateList *state)
{
    ToyCuts *cuts = TOY_ARRAY(1, toy->cuts);
    cuts->size = options->size;
    cuts->quantum = options->quantum;
    toy->faces = toy->base_faces;
    toy->nodes = cuts->node_limit = 3 * toy->faces;
    take_links(toy, name, mesh, arena);
    TOY_ARRAY(cuts->links, cuts->broken);
    TOY_ARRAY(1, cuts->used);
    TOY_ARRAY(toy->faces, toy->face);
    *cuts->used = toy->base_nodes;
    memcpy(toy->face, mesh->triangle, (size_t)toy->faces * sizeof *toy->face);
    state_add(state, cuts->broken, (size_t)cuts->links, "%s/broken", name);
    state_add(state, cuts->used, sizeof *cuts->used, "%s/used", name);
    state_add(state, toy->face, (size_t)toy->faces * sizeof *toy->face, "%s/face", name);
    TOY_ARRAY(TOY_CALLS, cuts->call);
    TOY_ARRAY(toy->nodes, toy->born);
    TOY_ARRAY(toy->faces, toy->face_area);
    toy->finest_area = toy->face_area;
    for (int f = 0; f < toy->faces; f++)
        toy->face_area[f] = toy_area(mesh->position, mesh->triangle[f]);
}
