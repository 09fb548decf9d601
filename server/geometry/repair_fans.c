// Splits nodes in which surfaces meet point to point, so that every node has one fan of triangles.
// A fan that has a node of its own in the source gets that node back; any other gets a copy,
// numbered after the nodes of the source.
#include "geometry/repair.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

typedef struct Fans {
    HalfEdges half;
    int *fan;     // [half-edge] the fan around its start
    int *member;  // [half-edge] the next of the same fan
    int *first;   // [fan] a half-edge
    int count;    // number of fans
    int *of_node; // [node] fans found so far
} Fans;

static void add_member(Fans *fans, int h)
{
    fans->fan[h] = fans->count;
    fans->member[h] = fans->first[fans->count];
    fans->first[fans->count] = h;
}

// Collects all half-edges that leave a node within the fan of h.
static void trace_fan(Fans *fans, int h)
{
    const int *twin = fans->half.twin;
    fans->first[fans->count] = -1;
    add_member(fans, h);
    int at = h;
    while ((at = twin[half_edge_previous(at)]) >= 0 && at != h)
        add_member(fans, at);
    for (int back = h; at != h && twin[back] >= 0;) {
        back = half_edge_next(twin[back]);
        add_member(fans, back);
    }
    fans->count++;
}

// Returns the node of the source for a fan: its own in the draft, unless that is the shared one.
static int own_node(const Repair *repair, const Fans *fans, int fan)
{
    int smallest = repair->draft->node_count;
    for (int h = fans->first[fan]; h >= 0; h = fans->member[h]) {
        int node = repair->draft->corner[repair->corner[h / 3][h % 3]];
        smallest = node < smallest ? node : smallest;
    }
    return smallest;
}

static int add_copy(Repair *repair, int node)
{
    TriMesh *mesh = &repair->mesh;
    int copies = mesh->copy_count++;
    // Grow whenever the number so far is a power of two.
    if ((copies & (copies - 1)) == 0) {
        size_t room = copies == 0 ? 1 : 2 * (size_t)copies;
        mesh->copy_of = realloc(mesh->copy_of, room * sizeof *mesh->copy_of);
        size_t nodes = (size_t)repair->draft->node_count + room;
        mesh->position = realloc(mesh->position, nodes * sizeof *mesh->position);
        ASSERT(mesh->copy_of != NULL && mesh->position != NULL);
    }
    mesh->copy_of[copies] = node;
    mesh->position[mesh->node_count] = mesh->position[node];
    return mesh->node_count++;
}

static void rename_fan(Repair *repair, const Fans *fans, int fan, int node)
{
    for (int h = fans->first[fan]; h >= 0; h = fans->member[h])
        repair->mesh.triangle[h / 3][h % 3] = node;
}

static void split_nodes(Repair *repair, Fans *fans)
{
    int nodes = repair->draft->node_count;
    bool *taken = calloc((size_t)nodes + 1, sizeof *taken); // [draft node]
    bool *stays = calloc((size_t)fans->count + 1, sizeof *stays);
    ASSERT(taken != NULL && stays != NULL);
    // The fan drawn with the node itself keeps it; else the first of its fans.
    for (int pass = 0; pass < 2; pass++)
        for (int fan = 0; fan < fans->count; fan++) {
            int node = half_edge_from(&repair->mesh, fans->first[fan]);
            if (node >= nodes || fans->of_node[node] < 2)
                continue;
            if (!taken[node] && (pass == 1 || own_node(repair, fans, fan) == node))
                taken[node] = stays[fan] = true;
        }
    // All other fans get their own node of the source if it is free, or a copy.
    for (int fan = 0; fan < fans->count; fan++) {
        int node = half_edge_from(&repair->mesh, fans->first[fan]);
        if (node >= nodes || fans->of_node[node] < 2 || stays[fan])
            continue;
        int own = own_node(repair, fans, fan);
        bool is_free = !taken[own] && own != node;
        repair->repairs->split_nodes++;
        if (is_free) {
            taken[own] = true;
            repair->kept[own] = own; // stands for itself again
        }
        rename_fan(repair, fans, fan, is_free ? own : add_copy(repair, node));
    }
    free(taken);
    free(stays);
}

void repair_fans(Repair *repair)
{
    const TriMesh *mesh = &repair->mesh;
    Fans fans = {0};
    half_edge_create(&fans.half, mesh);
    size_t count = (size_t)fans.half.count + 1;
    fans.fan = malloc(count * sizeof *fans.fan);
    fans.member = malloc(count * sizeof *fans.member);
    fans.first = malloc(count * sizeof *fans.first);
    fans.of_node = calloc((size_t)mesh->node_count + 1, sizeof *fans.of_node);
    ASSERT(fans.fan != NULL && fans.member != NULL && fans.first != NULL && fans.of_node != NULL);
    memset(fans.fan, 0xff, count * sizeof *fans.fan);
    bool shared = false;
    for (int h = 0; h < fans.half.count; h++) {
        if (fans.fan[h] >= 0)
            continue;
        shared = fans.of_node[half_edge_from(mesh, h)]++ > 0 || shared;
        trace_fan(&fans, h);
    }
    if (shared)
        split_nodes(repair, &fans);
    half_edge_destroy(&fans.half);
    free(fans.fan);
    free(fans.member);
    free(fans.first);
    free(fans.of_node);
}
