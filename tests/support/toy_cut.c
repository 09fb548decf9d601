// SPDX-License-Identifier: MIT
#include "base/check.h"
#include "geometry/edges.h"
#include "toy_parts.h"
#include "scoped.h"

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
    FREED bool *marked = zeroed((size_t)toy->faces, sizeof *marked); // a toy may
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
                FREED bool *part = zeroed((size_t)toy->faces, sizeof *part);
                mark_joined(toy, f, node, part);
                int copy = (*toy->cuts->used)++;
                for (int g = 0; g < toy->faces; g++)
                    for (int c = 0; c < 3 && part[g]; c++)
                        if (toy->face[g][c] == node)
                            toy->face[g][c] = copy;
                toy->position[copy] = toy->position[node];
                toy->born[change->born_count++] = (NodeBirth){copy, {node, node}};
            }
    }
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
    int *root = zeroed((size_t)toy->faces, sizeof *root), count = toy->faces;
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
    ASSERT(cut_quantise(vec3_scale(1.0 / 3.0, sum), vec3(0, 0, 0), toy->cuts->finder.q, &point));
    return point;
}

// Where the links of a toy were and are.
typedef struct Offered {
    const Toy *toy;
    const CutPoint *from, *to; // [faces]
} Offered;

// LinkOffer; the model is an Offered.
static bool offer_links(LinkFinder *finder, void *model)
{
    const Offered *offered = model;
    for (int i = 0; i < offered->toy->cuts->links; i++) {
        const int *face = offered->toy->cuts->link[i];
        const CutPath path[2] = {{{offered->from[face[0]], offered->to[face[0]]}},
                                 {{offered->from[face[1]], offered->to[face[1]]}}};
        if (!link_finder_meet(finder, i, path))
            return false;
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

// Sweeps while links move from from[face] to to[face]; a command has no trail.
static bool sweep(Body *body, const CutSweep *asked, CutTrail *trail, const CutPoint *from,
                  const CutPoint *to, CutOutcome *outcome, TopologyChange *change)
{
    Toy *toy = body->model;
    LinkFinder *finder = &toy->cuts->finder;
    const BladeEdge edge[2] = {asked->before, asked->after};
    Offered offered = {toy, from, to};
    int count = 0;
    outcome->verdict = link_finder_check(finder, edge, 2);
    if (outcome->verdict == CUT_DONE)
        outcome->verdict = link_finder_sweep(finder, edge, 2, trail, offer_links, &offered);
    if (outcome->verdict != CUT_DONE)
        return false;
    FREED bool *hit = zeroed((size_t)toy->cuts->links, sizeof *hit); // a toy may
    for (int i = 0; i < finder->met_count; i++)
        count += hit[finder->met[i]] = !toy->cuts->broken[finder->met[i]];
    outcome->verdict = finder->met_count == 0 ? CUT_MET_NOTHING : CUT_WAS_CUT;
    outcome->needed = 2 * count;
    outcome->room = toy->cuts->node_limit - *toy->cuts->used;
    bool fits = outcome->needed <= outcome->room;
    if (count > 0 && fits)
        commit_bits(body, hit, outcome, change);
    else if (count > 0)
        outcome->verdict = CUT_NO_NODES;
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
    FREED CutPoint *now = zeroed((size_t)toy->faces, sizeof *now);
    for (int f = 0; f < toy->faces; f++)
        now[f] = center_of(toy, f);
    bool changed = false;
    if (asked->phase == CUT_WHOLE) {
        changed = sweep(body, asked, NULL, now, now, outcome, change);
    } else {
        const LinkFinder *finder = &toy->cuts->finder;
        CutPoint *then = &toy->cuts->center[asked->blade * toy->faces];
        CutPoint *edge = &toy->cuts->edge[2 * asked->blade];
        bool begins = asked->phase == CUT_BEGINS;
        CutTrail trail = {
            {edge[0], edge[1]}, asked->stroke->tries, begins || toy->cuts->begun[asked->blade]};
        if (!begins)
            changed = sweep(body, asked, &trail, then, now, outcome, change);
        else if (!cut_quantise_edge(&asked->after, finder->origin, finder->q, trail.edge))
            outcome->verdict = CUT_TOO_LARGE;
        asked->stroke->tries = trail.tries;
        if (!cut_refuses(outcome->verdict)) {
            toy->cuts->begun[asked->blade] = trail.fresh;
            memcpy(then, now, (size_t)toy->faces * sizeof *now);
            memcpy(edge, trail.edge, sizeof trail.edge);
        }
    }
    return changed;
}

bool toy_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change)
{
    (void)tick;
    Toy *toy = body->model;
    bool *hit = zeroed((size_t)toy->cuts->links, sizeof *hit), any = false; // a toy may
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
    SCOPED(winged_destroy) WingedMesh winged;
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
}

void toy_cuts_create(Toy *toy, const char *name, const TriMesh *mesh, const ToyOptions *options,
                     Arena *arena, StateList *state)
{
    ToyCuts *cuts = TOY_ARRAY(1, toy->cuts);
    cuts->finder = (LinkFinder){.q = options->quantum, .tolerance = 0.05 * options->size};
    toy->faces = toy->base_faces;
    toy->nodes = cuts->node_limit = 3 * toy->faces;
    take_links(toy, name, mesh, arena);
    link_finder_create(&cuts->finder, cuts->links, cuts->links, name, arena);
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
