// SPDX-License-Identifier: MIT
// The faces that tools touch and clients draw: each leaf, divided so that it includes its
// neighbours' midpoints (the paper's four face types, Figure 4), hence a mesh without cracks or
// T-junctions. Places follow from the hierarchy: the quarters of a leaf begin where its children
// would. Step thread, when the topology changes; detail_faces_create at load.
#include "surface/detail/detail_faces.h"

#include "base/check.h"

#include <string.h>

static void create_report(DetailReport *report, int nodes, int slots, const char *name,
                          Arena *arena)
{
    report->face_change = ALLOCATE(ARENA_TOPOLOGY, 2 * slots, FaceChange, "face changes");
    report->born = ALLOCATE(ARENA_TOPOLOGY, nodes, NodeBirth, "births");
    report->gone = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "nodes gone");
    report->gone_parent =
        ALLOCATE(ARENA_TOPOLOGY, nodes, *report->gone_parent, "parents of nodes gone");
}

void detail_faces_create(DetailFaces *faces, DetailReport *report, const LeafSet *set,
                         const LevelRules *rules, const char *name, Arena *arena)
{
    const int nodes = set->node_count, slots = set->face_count;
    faces->set = set;
    faces->rules = rules;
    faces->face = ALLOCATE(ARENA_TOPOLOGY, slots, *faces->face, "faces");
    faces->face_neighbor =
        ALLOCATE(ARENA_TOPOLOGY, slots, *faces->face_neighbor, "face neighbours");
    faces->face_area = ALLOCATE(ARENA_TOPOLOGY, slots, double, "face areas");
    faces->finest_area = ALLOCATE(ARENA_TOPOLOGY, slots, double, "finest face areas");
    for (int f = 0; f < slots; f++)
        faces->finest_area[f] = level_rules_area(rules, set->levels.finest, f);
    faces->node_area = ALLOCATE(ARENA_TOPOLOGY, nodes, double, "node areas");
    faces->node_face_start = ALLOCATE(ARENA_TOPOLOGY, nodes + 1, int, "node face start");
    faces->node_face_end = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "node face end");
    // A leaf has at most two triangles at each of its nodes; a hanging node is in three more of the
    // whole face.
    for (int i = 0; i < nodes; i++)
        faces->node_face_start[i + 1] =
            faces->node_face_start[i] + 2 * detail_most_leaves(set, i) + 3;
    faces->node_face = ALLOCATE(ARENA_TOPOLOGY, faces->node_face_start[nodes], int, "node faces");

    // Lists of one change, for contacts and clients.
    create_report(report, nodes, slots, name, arena);
    const int all = set->face_base[set->levels.finest + 1];
    faces->touched = ALLOCATE(ARENA_TOPOLOGY, all, Leaf, "touched faces");
    faces->is_touched = ALLOCATE(ARENA_TOPOLOGY, all, bool, "touched marks");
    faces->cleared = ALLOCATE(ARENA_TOPOLOGY, slots, int, "cleared faces");
    faces->drawn = ALLOCATE(ARENA_TOPOLOGY, slots, int, "drawn faces");
    faces->was_used = ALLOCATE(ARENA_TOPOLOGY, slots, bool, "cleared marks");
    faces->redrawn = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "redrawn nodes");
    faces->is_redrawn = ALLOCATE(ARENA_TOPOLOGY, nodes, bool, "redrawn marks");
}

void detail_touch(DetailFaces *faces, int level, int face)
{
    int number = faces->set->face_base[level] + face;
    if (faces->is_touched[number])
        return;
    faces->is_touched[number] = true;
    faces->touched[faces->touched_count++] = (Leaf){level, face, 0};
}

static bool in_use(const DetailFaces *faces, int slot)
{
    return faces->face[slot][0] != faces->face[slot][1];
}

// Returns the first slot of a quarter of a face; a face of the finest level has only one.
static int quarter(const LeafSet *set, int level, int face, int k)
{
    return level < set->levels.finest ? detail_face_slot(set, level + 1, 4 * face + k) : face;
}

static int quarters(const LeafSet *set, int level)
{
    return level < set->levels.finest ? 4 : 1;
}

// --- triangles ---

typedef struct Piece {
    int corner[3];
    double share; // fraction of the leaf's area
} Piece;

// Divides a leaf into triangles. A compensating edge joins a hanging node with the opposite corner,
// or two hanging nodes with each other; of two, the median that halves the face starts at the
// first.
static int divide_leaf(const LeafSet *set, int level, int face, Piece piece[4])
{
    const Level *at = &set->levels.level[level];
    const int *corner = at->face[face];
    int middle[3], count = 0, first = 0;
    // Which edges have a midpoint that is on.
    for (int k = 0; k < 3; k++) {
        middle[k] = detail_midpoint(set, level, at->face_edge[face][k]);
        count += middle[k] >= 0;
    }
    // None: the leaf is one triangle.
    if (count == 0) {
        piece[0] = (Piece){{corner[0], corner[1], corner[2]}, 1.0};
        return 1;
    }
    // All: three corners and the middle.
    if (count == 3) {
        for (int k = 0; k < 3; k++)
            piece[k] = (Piece){{corner[k], middle[k], middle[(k + 2) % 3]}, 0.25};
        piece[3] = (Piece){{middle[0], middle[1], middle[2]}, 0.25};
        return 4;
    }
    // Rotate so that edge `first` has a midpoint, and of two the next edge has the other.
    while (middle[first] < 0 || (count == 2 && middle[(first + 1) % 3] < 0))
        first++;
    int a = corner[first], b = corner[(first + 1) % 3], c = corner[(first + 2) % 3];
    int m = middle[first], n = middle[(first + 1) % 3];
    // One: two halves.
    piece[0] = (Piece){{a, m, c}, 0.5};
    if (count == 1) {
        piece[1] = (Piece){{m, b, c}, 0.5};
        return 2;
    }
    // Two: a half, and two quarters beside the second midpoint.
    piece[1] = (Piece){{m, b, n}, 0.25};
    piece[2] = (Piece){{m, n, c}, 0.25};
    return 3;
}

static void mark_corners(DetailFaces *faces, const int corner[3])
{
    for (int k = 0; k < 3; k++)
        if (!faces->is_redrawn[corner[k]]) {
            faces->is_redrawn[corner[k]] = true;
            faces->redrawn[faces->redrawn_count++] = corner[k];
        }
}

static void clear_leaf(DetailFaces *faces, int level, int face)
{
    for (int k = 0; k < quarters(faces->set, level); k++) {
        int slot = quarter(faces->set, level, face, k);
        if (!in_use(faces, slot))
            continue;
        mark_corners(faces, faces->face[slot]);
        memset(faces->face[slot], 0, sizeof faces->face[slot]);
        faces->was_used[slot] = true;
        faces->cleared[faces->cleared_count++] = slot;
    }
}

static void draw_leaf(DetailFaces *faces, int level, int face)
{
    Piece piece[4];
    int count = divide_leaf(faces->set, level, face, piece);
    double area = level_rules_area(faces->rules, level, face);
    for (int k = 0; k < count; k++) {
        int slot = quarter(faces->set, level, face, k);
        memcpy(faces->face[slot], piece[k].corner, sizeof piece[k].corner);
        faces->face_area[slot] = piece[k].share * area;
        faces->drawn[faces->drawn_count++] = slot;
        mark_corners(faces, faces->face[slot]);
    }
}

// --- faces at a node, faces across an edge ---

static void add_face(DetailFaces *faces, int node, int slot)
{
    int at = faces->node_face_end[node]++;
    for (; at > faces->node_face_start[node] && faces->node_face[at - 1] > slot; at--)
        faces->node_face[at] = faces->node_face[at - 1];
    faces->node_face[at] = slot;
}

// Removes the faces that disappeared from the lists of the nodes and inserts the new ones,
// ascending.
static void list_faces(DetailFaces *faces)
{
    for (int i = 0; i < faces->redrawn_count; i++) {
        int node = faces->redrawn[i], kept = faces->node_face_start[node];
        for (int k = kept; k < faces->node_face_end[node]; k++)
            if (!faces->was_used[faces->node_face[k]])
                faces->node_face[kept++] = faces->node_face[k];
        faces->node_face_end[node] = kept;
    }
    for (int i = 0; i < faces->drawn_count; i++)
        for (int k = 0; k < 3; k++)
            add_face(faces, faces->face[faces->drawn[i]][k], faces->drawn[i]);
}

static void meet_neighbours(DetailFaces *faces, int slot)
{
    const int *corner = faces->face[slot];
    for (int k = 0; k < 3; k++) {
        int from = corner[k], to = corner[(k + 1) % 3];
        faces->face_neighbor[slot][k] = -1;
        for (int i = faces->node_face_start[from]; i < faces->node_face_end[from]; i++) {
            // The face with the same edge the other way round.
            int other = faces->node_face[i];
            const int *c = faces->face[other];
            for (int j = 0; j < 3; j++)
                if (c[j] == to && c[(j + 1) % 3] == from) {
                    faces->face_neighbor[slot][k] = other;
                    faces->face_neighbor[other][j] = slot;
                }
        }
    }
}

// Computes the area of a node: a third of the leaves around it.
static void measure_node(DetailFaces *faces, int node)
{
    double area = 0.0;
    if (faces->set->status[node] != NODE_OFF) {
        Leaf *leaf = faces->set->ring[0];
        int count = detail_leaves_around(faces->set, node, leaf);
        for (int i = 0; i < count; i++)
            area += level_rules_area(faces->rules, leaf[i].level, leaf[i].face) / 3.0;
    }
    faces->node_area[node] = area;
}

// --- reports to contacts and clients ---

// Returns the slot whose memory a slot inherits: its own, or that of the nearest face around it
// that was drawn.
static int predecessor(const DetailFaces *faces, int slot)
{
    if (faces->was_used[slot])
        return slot;
    for (int level = faces->set->levels.finest - 1; level >= 0; level--) {
        int shift = 2 * (faces->set->levels.finest - level), first = slot >> shift << shift;
        if (faces->was_used[first])
            return first;
    }
    return -1;
}

// Returns where the face is now that was drawn at a slot which is free: the part of the leaf that
// contains its quarter, or the first; -1: it is removed.
static int successor(const DetailFaces *faces, int slot)
{
    const LeafSet *set = faces->set;
    for (int level = set->levels.finest - 1; level >= 0; level--) {
        int shift = 2 * (set->levels.finest - level), face = slot >> shift;
        if (!detail_is_leaf(set, level, face))
            continue;
        int part = quarter(set, level, face, slot >> (shift - 2) & 3);
        return in_use(faces, part) ? part : face << shift;
    }
    ASSERT(detail_is_gone(set, set->levels.finest, slot));
    return -1;
}

static void list_changes(DetailFaces *faces, DetailReport *report)
{
    TopologyChange *change = &report->change;
    for (int i = 0; i < faces->cleared_count; i++) {
        int slot = faces->cleared[i];
        if (in_use(faces, slot))
            continue;
        // A face that is gone, and where it continues.
        report->face_change[change->face_count++] = (FaceChange){slot, -1};
        const int next = successor(faces, slot);
        if (next >= 0)
            report->face_change[change->face_count++] = (FaceChange){next, slot};
        slots_free_face(faces->slots, slot);
    }
    for (int i = 0; i < faces->drawn_count; i++) {
        // A new face, and what it continues.
        int slot = faces->drawn[i];
        report->face_change[change->face_count++] = (FaceChange){slot, predecessor(faces, slot)};
        slots_put_face(faces->slots, slot, faces->face[slot]);
    }
}

void detail_draw(DetailFaces *faces, DetailReport *report)
{
    faces->cleared_count = faces->drawn_count = faces->redrawn_count = 0;
    // All old triangles go before new ones come: their slots are used again.
    for (int i = 0; i < faces->touched_count; i++)
        clear_leaf(faces, faces->touched[i].level, faces->touched[i].face);
    for (int i = 0; i < faces->touched_count; i++) {
        const Leaf *leaf = &faces->touched[i];
        faces->is_touched[faces->set->face_base[leaf->level] + leaf->face] = false;
        if (detail_is_leaf(faces->set, leaf->level, leaf->face))
            draw_leaf(faces, leaf->level, leaf->face);
    }
    // Then what refers to them: lists by node, neighbours, areas.
    faces->touched_count = 0;
    list_faces(faces);
    for (int i = 0; i < faces->drawn_count; i++)
        meet_neighbours(faces, faces->drawn[i]);
    for (int i = 0; i < faces->redrawn_count; i++) {
        measure_node(faces, faces->redrawn[i]);
        faces->is_redrawn[faces->redrawn[i]] = false;
    }
    // The difference goes to contacts and clients.
    list_changes(faces, report);
    for (int i = 0; i < faces->cleared_count; i++)
        faces->was_used[faces->cleared[i]] = false;
}

void detail_draw_all(DetailFaces *faces, DetailReport *report)
{
    memset(faces->face, 0, (size_t)faces->set->face_count * sizeof *faces->face);
    for (int node = 0; node < faces->set->node_count; node++)
        faces->node_face_end[node] = faces->node_face_start[node];
    for (int level = 0; level <= faces->set->levels.finest; level++)
        for (int face = 0; face < faces->set->levels.level[level].face_count; face++)
            if (detail_is_leaf(faces->set, level, face))
                detail_touch(faces, level, face);
    memset(faces->node_area, 0, (size_t)faces->set->node_count * sizeof *faces->node_area);
    report->change =
        (TopologyChange){.face = report->face_change, .born = report->born, .gone = report->gone};
    detail_draw(faces, report);
}
