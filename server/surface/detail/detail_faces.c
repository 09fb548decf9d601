// The faces that tools touch and clients draw: each leaf, divided so that it includes its
// neighbours' midpoints (the paper's four face types, Figure 4), hence a mesh without cracks or
// T-junctions. Places follow from the hierarchy: the quarters of a leaf begin where its children
// would. Step thread, when the topology changes.
#include "surface/detail/detail.h"

#include "base/check.h"

#include <string.h>

void detail_touch(Detail *detail, int level, int face)
{
    int number = detail->set.face_base[level] + face;
    if (detail->is_touched[number])
        return;
    detail->is_touched[number] = true;
    detail->touched[detail->touched_count++] = (Leaf){level, face, 0};
}

static bool in_use(const Detail *detail, int place)
{
    return detail->face[place][0] != detail->face[place][1];
}

// Returns the first place of a quarter of a face; a face of the finest level has only one.
static int quarter(const LeafSet *set, int level, int face, int k)
{
    return level < set->levels.finest ? detail_place(set, level + 1, 4 * face + k) : face;
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
    for (int k = 0; k < 3; k++) {
        middle[k] = detail_midpoint(set, level, at->face_edge[face][k]);
        count += middle[k] >= 0;
    }
    if (count == 0) {
        piece[0] = (Piece){{corner[0], corner[1], corner[2]}, 1.0};
        return 1;
    }
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
    piece[0] = (Piece){{a, m, c}, 0.5};
    if (count == 1) {
        piece[1] = (Piece){{m, b, c}, 0.5};
        return 2;
    }
    piece[1] = (Piece){{m, b, n}, 0.25};
    piece[2] = (Piece){{m, n, c}, 0.25};
    return 3;
}

static void mark_corners(Detail *detail, const int corner[3])
{
    for (int k = 0; k < 3; k++)
        if (!detail->is_redrawn[corner[k]]) {
            detail->is_redrawn[corner[k]] = true;
            detail->redrawn[detail->redrawn_count++] = corner[k];
        }
}

static void clear_leaf(Detail *detail, int level, int face)
{
    for (int k = 0; k < quarters(&detail->set, level); k++) {
        int place = quarter(&detail->set, level, face, k);
        if (!in_use(detail, place))
            continue;
        mark_corners(detail, detail->face[place]);
        memset(detail->face[place], 0, sizeof detail->face[place]);
        detail->was_used[place] = true;
        detail->cleared[detail->cleared_count++] = place;
    }
}

static void draw_leaf(Detail *detail, int level, int face)
{
    Piece piece[4];
    int count = divide_leaf(&detail->set, level, face, piece);
    double area = level_rules_area(&detail->rules, level, face);
    for (int k = 0; k < count; k++) {
        int place = quarter(&detail->set, level, face, k);
        memcpy(detail->face[place], piece[k].corner, sizeof piece[k].corner);
        detail->face_area[place] = piece[k].share * area;
        detail->drawn[detail->drawn_count++] = place;
        mark_corners(detail, detail->face[place]);
    }
}

// --- faces at a node, faces across an edge ---

static void add_face(Detail *detail, int node, int place)
{
    int at = detail->node_face_end[node]++;
    for (; at > detail->node_face_start[node] && detail->node_face[at - 1] > place; at--)
        detail->node_face[at] = detail->node_face[at - 1];
    detail->node_face[at] = place;
}

// Removes the faces that disappeared from the lists of the nodes and inserts the new ones,
// ascending.
static void list_faces(Detail *detail)
{
    for (int i = 0; i < detail->redrawn_count; i++) {
        int node = detail->redrawn[i], kept = detail->node_face_start[node];
        for (int k = kept; k < detail->node_face_end[node]; k++)
            if (!detail->was_used[detail->node_face[k]])
                detail->node_face[kept++] = detail->node_face[k];
        detail->node_face_end[node] = kept;
    }
    for (int i = 0; i < detail->drawn_count; i++)
        for (int k = 0; k < 3; k++)
            add_face(detail, detail->face[detail->drawn[i]][k], detail->drawn[i]);
}

static void meet_neighbours(Detail *detail, int place)
{
    const int *corner = detail->face[place];
    for (int k = 0; k < 3; k++) {
        int from = corner[k], to = corner[(k + 1) % 3];
        detail->face_neighbor[place][k] = -1;
        for (int i = detail->node_face_start[from]; i < detail->node_face_end[from]; i++) {
            int other = detail->node_face[i];
            const int *c = detail->face[other];
            for (int j = 0; j < 3; j++)
                if (c[j] == to && c[(j + 1) % 3] == from) {
                    detail->face_neighbor[place][k] = other;
                    detail->face_neighbor[other][j] = place;
                }
        }
    }
}

// Computes the area of a node: a third of the leaves around it.
static void measure_node(Detail *detail, int node)
{
    double area = 0.0;
    if (detail->set.status[node] != NODE_OFF) {
        Leaf *leaf = detail->set.ring[0];
        int count = detail_leaves_around(&detail->set, node, leaf);
        for (int i = 0; i < count; i++)
            area += level_rules_area(&detail->rules, leaf[i].level, leaf[i].face) / 3.0;
    }
    detail->node_area[node] = area;
}

// --- reports to contacts and clients ---

// Returns the place whose memory a place inherits: its own, or that of the nearest face around it
// that was drawn.
static int predecessor(const Detail *detail, int place)
{
    if (detail->was_used[place])
        return place;
    for (int level = detail->set.levels.finest - 1; level >= 0; level--) {
        int shift = 2 * (detail->set.levels.finest - level), first = place >> shift << shift;
        if (detail->was_used[first])
            return first;
    }
    return -1;
}

// Returns where the face is now that was drawn at a place which is free: the part of the leaf that
// contains its quarter, or the first.
static int successor(const Detail *detail, int place)
{
    const LeafSet *set = &detail->set;
    for (int level = set->levels.finest - 1; level >= 0; level--) {
        int shift = 2 * (set->levels.finest - level), face = place >> shift;
        if (!detail_is_leaf(set, level, face))
            continue;
        int part = quarter(set, level, face, place >> (shift - 2) & 3);
        return in_use(detail, part) ? part : face << shift;
    }
    ASSERT(false);
    return place;
}

static void list_changes(Detail *detail)
{
    TopologyChange *change = &detail->change;
    for (int i = 0; i < detail->cleared_count; i++) {
        int place = detail->cleared[i];
        if (in_use(detail, place))
            continue;
        detail->face_change[change->face_count++] = (FaceChange){place, -1};
        detail->face_change[change->face_count++] = (FaceChange){successor(detail, place), place};
        slots_free_face(detail->slots, place);
    }
    for (int i = 0; i < detail->drawn_count; i++) {
        int place = detail->drawn[i];
        detail->face_change[change->face_count++] = (FaceChange){place, predecessor(detail, place)};
        slots_put_face(detail->slots, place, detail->face[place]);
    }
}

void detail_draw(Detail *detail)
{
    detail->cleared_count = detail->drawn_count = detail->redrawn_count = 0;
    for (int i = 0; i < detail->touched_count; i++)
        clear_leaf(detail, detail->touched[i].level, detail->touched[i].face);
    for (int i = 0; i < detail->touched_count; i++) {
        const Leaf *leaf = &detail->touched[i];
        detail->is_touched[detail->set.face_base[leaf->level] + leaf->face] = false;
        if (detail_is_leaf(&detail->set, leaf->level, leaf->face))
            draw_leaf(detail, leaf->level, leaf->face);
    }
    detail->touched_count = 0;
    list_faces(detail);
    for (int i = 0; i < detail->drawn_count; i++)
        meet_neighbours(detail, detail->drawn[i]);
    for (int i = 0; i < detail->redrawn_count; i++) {
        measure_node(detail, detail->redrawn[i]);
        detail->is_redrawn[detail->redrawn[i]] = false;
    }
    list_changes(detail);
    for (int i = 0; i < detail->cleared_count; i++)
        detail->was_used[detail->cleared[i]] = false;
}

void detail_draw_all(Detail *detail)
{
    memset(detail->face, 0, (size_t)detail->set.place_count * sizeof *detail->face);
    for (int node = 0; node < detail->set.node_count; node++)
        detail->node_face_end[node] = detail->node_face_start[node];
    for (int level = 0; level <= detail->set.levels.finest; level++)
        for (int face = 0; face < detail->set.levels.level[level].face_count; face++)
            if (detail_is_leaf(&detail->set, level, face))
                detail_touch(detail, level, face);
    memset(detail->node_area, 0, (size_t)detail->set.node_count * sizeof *detail->node_area);
    detail->change =
        (TopologyChange){.face = detail->face_change, .born = detail->born, .gone = detail->gone};
    detail_draw(detail);
}
