// Triangles without area, taken out without a crack. Such a triangle is a line: the middle node
// lies on the edge between the other two. Dropped alone it would leave that edge without a face
// beside the two shorter ones (a T-junction), so
//   - at a border it is dropped: the two shorter edges become the border;
//   - else its longest edge is turned: the neighbour across is cut in two at the middle node;
//   - where that gives no better triangles because two nodes all but coincide, those are merged;
// and what fits none of these is refused. Triangles without area may touch each other: edits that
// meet in a node wait for the next round.
#include "geometry/repair.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 64 };

// Nodes nearer to each other than this fraction of the triangle's longest edge may be merged: no
// more than rounding of single-precision coordinates.
static const double NEAR = 1e-6;

typedef enum EditKind { EDIT_DROP, EDIT_TURN, EDIT_MERGE } EditKind;
typedef struct Edit {
    EditKind kind;
    int half_edge; // of the flat triangle: its longest edge; to merge: the edge that vanishes
} Edit;

typedef struct Round {
    Repair *repair;
    HalfEdges half;
    bool *locked; // [node] belongs to an edit of this round
    Edit *edit;   // [edit_count], at most one a triangle
    int edit_count;
} Round;

static bool is_flat(const TriMesh *mesh, int a, int b, int c)
{
    return !(mesh_relative_height(mesh->position, (const int[3]){a, b, c}) > MESH_SMALLEST_HEIGHT);
}

static double length(const TriMesh *mesh, int a, int b)
{
    return vec3_length(vec3_sub(mesh->position[a], mesh->position[b]));
}

// The node across from half-edge h in its triangle.
static int apex(const TriMesh *mesh, int h)
{
    return half_edge_from(mesh, half_edge_previous(h));
}

// Half-edges are sorted by their nodes: halving finds whether two nodes share an edge.
static bool share_an_edge(const Round *round, int a, int b)
{
    const TriMesh *mesh = &round->repair->mesh;
    int low = 0, high = round->half.count - 1, smaller = a < b ? a : b, larger = a < b ? b : a;
    while (low <= high) {
        int middle = low + (high - low) / 2, h = round->half.order[middle];
        int from = half_edge_from(mesh, h), to = half_edge_to(mesh, h);
        int x = from < to ? from : to, y = from < to ? to : from;
        if (x == smaller && y == larger)
            return true;
        if (x < smaller || (x == smaller && y < larger))
            low = middle + 1;
        else
            high = middle - 1;
    }
    return false;
}

// Turning the edge of a flat triangle (a, b, c) with neighbour (b, a, d) gives (a, d, c), (d, b,
// c).
static bool can_turn(const Round *round, int h)
{
    const TriMesh *mesh = &round->repair->mesh;
    int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h), c = apex(mesh, h);
    int d = apex(mesh, round->half.twin[h]);
    if (c == d || share_an_edge(round, c, d))
        return false;
    if (!is_flat(mesh, a, d, c) && !is_flat(mesh, d, b, c))
        return true;
    // Two flat triangles back to back both get shorter: their time comes in a later round.
    return is_flat(mesh, b, a, d) && length(mesh, c, d) < length(mesh, a, b);
}

static int longest_edge(const TriMesh *mesh, int triangle)
{
    int longest = 3 * triangle;
    for (int h = longest + 1; h < 3 * triangle + 3; h++)
        if (length(mesh, half_edge_from(mesh, h), half_edge_to(mesh, h)) >
            length(mesh, half_edge_from(mesh, longest), half_edge_to(mesh, longest)))
            longest = h;
    return longest;
}

static bool choose_edit(const Round *round, int longest, Edit *edit)
{
    const TriMesh *mesh = &round->repair->mesh;
    *edit = (Edit){EDIT_DROP, longest};
    if (round->half.twin[longest] < 0)
        return true;
    edit->kind = EDIT_TURN;
    if (can_turn(round, longest))
        return true;
    int next = half_edge_next(longest), previous = half_edge_previous(longest);
    double next_length = length(mesh, half_edge_from(mesh, next), half_edge_to(mesh, next));
    double previous_length =
        length(mesh, half_edge_from(mesh, previous), half_edge_to(mesh, previous));
    *edit = (Edit){EDIT_MERGE, next_length < previous_length ? next : previous};
    return fmin(next_length, previous_length) <=
           NEAR * length(mesh, half_edge_from(mesh, longest), half_edge_to(mesh, longest));
}

static void plan_edit(Round *round, int triangle)
{
    const TriMesh *mesh = &round->repair->mesh;
    int h = longest_edge(mesh, triangle), twin = round->half.twin[h];
    const int node[4] = {half_edge_from(mesh, h), half_edge_to(mesh, h), apex(mesh, h),
                         twin >= 0 ? apex(mesh, twin) : half_edge_from(mesh, h)};
    if (round->locked[node[0]] || round->locked[node[1]] || round->locked[node[2]] ||
        round->locked[node[3]] || !choose_edit(round, h, &round->edit[round->edit_count]))
        return;
    round->edit_count++;
    for (int k = 0; k < 4; k++)
        round->locked[node[k]] = true;
}

static void set_corner(Repair *repair, int h, int node, int corner)
{
    repair->mesh.triangle[h / 3][h % 3] = node;
    repair->corner[h / 3][h % 3] = corner;
}

static void turn_edge(Repair *repair, int h, int twin)
{
    TriMesh *mesh = &repair->mesh;
    int c = apex(mesh, h), d = apex(mesh, twin);
    int corner_c = repair->corner[h / 3][half_edge_previous(h) % 3];
    int corner_d = repair->corner[twin / 3][half_edge_previous(twin) % 3];
    // (a, b, c), (b, a, d) become (a, d, c), (b, c, d).
    set_corner(repair, half_edge_next(h), d, corner_d);
    set_corner(repair, half_edge_next(twin), c, corner_c);
}

static void apply_edits(Round *round)
{
    Repair *repair = round->repair;
    TriMesh *mesh = &repair->mesh;
    bool merged = false;
    for (int i = 0; i < round->edit_count; i++) {
        int h = round->edit[i].half_edge;
        int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h);
        switch (round->edit[i].kind) {
        case EDIT_DROP:
            repair->polygon[h / 3] = -1;
            break;
        case EDIT_TURN:
            turn_edge(repair, h, round->half.twin[h]);
            break;
        case EDIT_MERGE:
            repair->kept[a > b ? a : b] = a > b ? b : a;
            repair->repairs->merged_nodes++;
            merged = true;
            break;
        }
    }
    for (int t = 0; merged && t < mesh->triangle_count; t++) {
        int *node = mesh->triangle[t];
        for (int k = 0; k < 3; k++)
            node[k] = repair_node(repair, node[k]);
        if (node[0] == node[1] || node[1] == node[2] || node[2] == node[0])
            repair->polygon[t] = -1;
    }
    repair_compact(repair);
}

static int count_flat(const TriMesh *mesh)
{
    int count = 0;
    for (int t = 0; t < mesh->triangle_count; t++)
        count += is_flat(mesh, mesh->triangle[t][0], mesh->triangle[t][1], mesh->triangle[t][2]);
    return count;
}

// One round of edits that do not meet; `flat` triangles are there. False when none can be made.
static bool run_round(Round *round, int flat)
{
    const TriMesh *mesh = &round->repair->mesh;
    memset(round->locked, 0, (size_t)mesh->node_count * sizeof *round->locked);
    round->edit = malloc(((size_t)flat + 1) * sizeof *round->edit);
    ASSERT(round->edit != NULL);
    round->edit_count = 0;
    half_edge_create(&round->half, mesh);
    for (int t = 0; t < mesh->triangle_count; t++)
        if (is_flat(mesh, mesh->triangle[t][0], mesh->triangle[t][1], mesh->triangle[t][2]))
            plan_edit(round, t);
    bool ok = round->edit_count > 0;
    if (ok)
        apply_edits(round);
    half_edge_destroy(&round->half);
    free(round->edit);
    return ok;
}

bool repair_flat_faces(Repair *repair)
{
    TriMesh *mesh = &repair->mesh;
    int flat = count_flat(mesh);
    if (flat == 0)
        return true;
    repair->repairs->flat_faces += flat;
    Round round = {.repair = repair};
    round.locked = malloc((size_t)mesh->node_count + 1);
    ASSERT(round.locked != NULL);
    for (int i = 0; i < ROUNDS && flat > 0 && run_round(&round, flat); i++)
        flat = count_flat(mesh);
    free(round.locked);
    if (mesh->triangle_count == 0)
        return repair_fail(repair, -1, -1, "the mesh has no face with an area");
    for (int t = 0; flat > 0 && t < mesh->triangle_count; t++) {
        const int *node = mesh->triangle[t];
        if (is_flat(mesh, node[0], node[1], node[2]))
            return repair_fail(repair, -1, t,
                               "face %d (nodes %d, %d, %d) has no area and cannot be taken out "
                               "without a crack",
                               repair->polygon[t], node[0], node[1], node[2]);
    }
    return true;
}
