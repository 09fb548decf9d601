// SPDX-License-Identifier: MIT
// Breaks edges of a body that can be cut: first the bits, then the nodes. Step thread, when a blade
// or a tear has found what breaks; detail_cut_create at load.
#include "surface/detail/detail.h"

#include "base/check.h"

#include <string.h>

// Returns the capacity for copies. A cut of the whole body along all its edges would take five
// times as many; a 75 mm cut takes 1 %.
static int choose_copies(const SurfaceOptions *options, int nodes)
{
    int usual = nodes / 4 + 1000;
    return options->body.node_capacity - nodes > usual ? options->body.node_capacity - nodes
                                                       : usual;
}

// Measures at rest how far nodes of finer levels stick out beside the middle of their parents;
// doubled, because hanging nodes are elsewhere.
static double measure_bulge(const Levels *levels)
{
    double sum = 0.0;
    for (int l = 0; l < levels->finest; l++) {
        const Level *at = &levels->level[l];
        double most = 0.0;
        for (int e = 0; e < at->edge_count; e++) {
            const Vec3 *x = levels->position;
            Vec3 middle = vec3_scale(0.5, vec3_add(x[at->edge[e][0]], x[at->edge[e][1]]));
            most = fmax(most, vec3_length(vec3_sub(x[at->node_count + e], middle)));
        }
        sum += most;
    }
    return 2.0 * sum;
}

static double mean_edge(const Level *level, const Vec3 *x)
{
    double sum = 0.0;
    for (int e = 0; e < level->edge_count; e++)
        sum += vec3_length(vec3_sub(x[level->edge[e][0]], x[level->edge[e][1]]));
    return sum / level->edge_count;
}

// Creates what is needed to find the links that a blade meets.
static void create_look(LeafSet *set, const SurfaceOptions *options, Arena *arena)
{
    const char *name = options->body.name;
    DetailCut *cut = set->cut;
    const Level *finest = &set->levels.level[set->levels.finest];
    int nodes = cut->base_count + cut->copy_capacity;
    cut->bulge = measure_bulge(&set->levels);
    cut_find_create(&cut->finder, &cut->uncut, set->levels.position[0],
                    mean_edge(finest, set->levels.position), name, arena);
    cut->seen = ALLOCATE(ARENA_TOPOLOGY, nodes + 1, int64_t, "looks at cut nodes");
    cut->position = ALLOCATE(ARENA_TOPOLOGY, nodes + 1, Vec3, "places of cut nodes");
    cut->sides = ALLOCATE(ARENA_TOPOLOGY, nodes + 1, unsigned char, "sides of cut nodes");
    cut->is_near = ALLOCATE(ARENA_TOPOLOGY, finest->face_count + 1, unsigned char, "near marks");
    cut->near = ALLOCATE(ARENA_TOPOLOGY, finest->face_count + 1, int, "near faces");
}

void detail_cut_create(Detail *detail, const SurfaceOptions *options, Arena *arena,
                       StateList *state)
{
    const char *name = options->body.name;
    Level *finest = &detail->set.levels.level[detail->set.levels.finest];
    size_t faces = (size_t)finest->face_count;
    int coarse = detail->set.face_base[detail->set.levels.finest];
    DetailCut *cut = detail->set.cut = ALLOCATE(ARENA_TOPOLOGY, 1, DetailCut, "cut");
    cut->base_count = finest->node_count;
    cut->copy_capacity = choose_copies(options, finest->node_count);
    cut->uncut = *finest;
    cut->base = (const int(*)[3])finest->face;
    cut->node = ALLOCATE(ARENA_TOPOLOGY, faces + 1, *cut->node, "cut corners");
    // From here on the corners of the finest level are the current nodes.
    memcpy(cut->node, finest->face, faces * sizeof *cut->node);
    finest->face = cut->node;
    cut->broken = ALLOCATE(ARENA_TOPOLOGY, faces + 1, unsigned char, "broken edges");
    cut->copies = ALLOCATE(ARENA_TOPOLOGY, 1, int64_t, "copies");
    state_add(state, cut->broken, faces, "%s/broken", name);
    state_add(state, cut->node, faces * sizeof *cut->node, "%s/corners", name);
    state_add(state, cut->copies, sizeof *cut->copies, "%s/copies", name);
    detail_lips_create(detail, arena, state);
    create_look(&detail->set, options, arena);

    // Derived arrays and lists of a cut.
    cut->origin = ALLOCATE(ARENA_TOPOLOGY, cut->copy_capacity + 1, int, "originals");
    cut->locked = ALLOCATE(ARENA_TOPOLOGY, coarse + 1, unsigned char, "locked faces");
    cut->is_end = ALLOCATE(ARENA_TOPOLOGY, cut->base_count + 1, bool, "ends of broken edges");
    cut->piece = ALLOCATE(ARENA_TOPOLOGY, faces + 1, int, "face pieces");
    cut->node_piece =
        ALLOCATE(ARENA_TOPOLOGY, (cut->base_count + cut->copy_capacity) + 1, int, "node pieces");
    cut->vertex = ALLOCATE(ARENA_TOPOLOGY, cut->base_count + 1, int, "cut nodes");
    cut->wanted = ALLOCATE(ARENA_TOPOLOGY, coarse + 1, unsigned char, "wanted marks");
    cut->want = ALLOCATE(ARENA_TOPOLOGY, coarse + 1, Leaf, "wanted faces");
    cut->most_around = 6; // around a midpoint
    for (int i = 0; i < detail->set.levels.level[0].node_count; i++) {
        int count = detail->set.root_ring_start[i + 1] - detail->set.root_ring_start[i];
        cut->most_around = count > cut->most_around ? count : cut->most_around;
    }
    cut->ring = ALLOCATE(ARENA_TOPOLOGY, cut->most_around + 1, Leaf, "faces around a cut node");
    cut->part = ALLOCATE(ARENA_TOPOLOGY, cut->most_around + 1, int, "parts of a ring");
    cut->fresh = ALLOCATE(ARENA_TOPOLOGY, cut->most_around + 1, int, "new parts of a ring");
    detail_cut_rebuild(detail);
}

// --- queries of the bits ---

// Returns the face of the finest level at a corner of a face: child k keeps corner k.
static Leaf finest_at(const LeafSet *set, int level, int face, int corner)
{
    for (; level < set->levels.finest; level++)
        face = 4 * face + corner;
    return (Leaf){level, face, corner};
}

static int corner_of(const int corner[3], int node)
{
    return corner[0] == node ? 0 : corner[1] == node ? 1 : 2;
}

int detail_cut_ring(const LeafSet *set, int node, Leaf *ring)
{
    const Levels *levels = &set->levels;
    int count = 0, born = levels_of_node(levels, node);
    // A node of level 0 has the roots around it.
    if (born == 0) {
        for (int i = set->root_ring_start[node]; i < set->root_ring_start[node + 1]; i++) {
            int root = set->root_ring[i];
            ring[count++] = finest_at(set, 0, root, corner_of(detail_uncut(set, 0, root), node));
        }
        return count;
    }
    // A midpoint has three children of each face at its edge.
    const Level *above = &levels->level[born - 1];
    int edge = node - above->node_count;
    for (int side = 0; side < 2; side++) {
        int face = above->edge_face[edge][side];
        if (face < 0)
            continue;
        const int child[3] = {4 * face + corner_of(above->face_edge[face], edge),
                              4 * face + (corner_of(above->face_edge[face], edge) + 1) % 3,
                              4 * face + 3};
        for (int i = 0; i < 3; i++)
            ring[count++] =
                finest_at(set, born, child[i], corner_of(detail_uncut(set, born, child[i]), node));
    }
    return count;
}

// Joins the faces of a ring across unbroken edges at its middle: part[i] is the lowest face of i's
// component, as an index into the ring.
static void find_parts(const LeafSet *set, const Leaf *ring, int count, int *part)
{
    const Level *finest = &set->levels.level[set->levels.finest];
    for (int i = 0; i < count; i++)
        part[i] = i;
    for (int i = 0; i < count; i++) {
        const int side[2] = {ring[i].corner, (ring[i].corner + 2) % 3};
        for (int s = 0; s < 2; s++) {
            int face = ring[i].face;
            int across = levels_beyond(finest, finest->face_edge[face][side[s]], face);
            if (across < face || (set->cut->broken[face] >> side[s] & 1) != 0)
                continue;
            int j = 0;
            while (ring[j].face != across)
                j++;
            int a = part[i], b = part[j];
            int low = ring[a].face < ring[b].face ? a : b, high = low == a ? b : a;
            for (int k = 0; k < count && a != b; k++)
                part[k] = part[k] == high ? low : part[k];
        }
    }
}

// True if component i keeps the node: of the components that have one node now, the one with the
// lowest face does.
static bool keeps_node(const DetailCut *cut, const Leaf *ring, int count, const int *part, int i)
{
    int node = cut->node[ring[i].face][ring[i].corner];
    for (int k = 0; k < count; k++)
        if (part[k] == k && ring[k].face < ring[i].face &&
            cut->node[ring[k].face][ring[k].corner] == node &&
            !detail_cut_is_gone(cut, ring[k].face))
            return false;
    return true;
}

// Lists the components of the ring of a node of the uncut mesh that need a copy: cut->fresh, by
// their lowest face, ascending. Also leaves the ring and its parts.
static int find_new_parts(const LeafSet *set, int vertex, int *ring_count)
{
    DetailCut *cut = set->cut;
    int count = *ring_count = detail_cut_ring(set, vertex, cut->ring), found = 0;
    find_parts(set, cut->ring, count, cut->part);
    for (int i = 0; i < count; i++) {
        if (cut->part[i] != i || detail_cut_is_gone(cut, cut->ring[i].face) ||
            keeps_node(cut, cut->ring, count, cut->part, i))
            continue;
        int at = found++;
        for (; at > 0 && cut->ring[cut->fresh[at - 1]].face > cut->ring[i].face; at--)
            cut->fresh[at] = cut->fresh[at - 1];
        cut->fresh[at] = i;
    }
    return found;
}

bool detail_cut_parts_match(const LeafSet *set)
{
    const DetailCut *cut = set->cut;
    for (int node = 0; node < cut->base_count; node++) {
        int count = detail_cut_ring(set, node, cut->ring), lowest = 0;
        bool whole = true;
        find_parts(set, cut->ring, count, cut->part);
        for (int i = 0; i < count; i++) {
            int here = cut->node[cut->ring[i].face][cut->ring[i].corner];
            lowest = cut->ring[i].face < cut->ring[lowest].face ? i : lowest;
            whole &= !detail_cut_is_gone(cut, cut->ring[i].face);
            for (int k = 0; k < i && !detail_cut_is_gone(cut, cut->ring[i].face); k++)
                if (!detail_cut_is_gone(cut, cut->ring[k].face) &&
                    (cut->part[i] == cut->part[k]) !=
                        (here == cut->node[cut->ring[k].face][cut->ring[k].corner]))
                    return false;
        }
        // Where faces are removed, that which had the node may be among them.
        if (whole && cut->node[cut->ring[lowest].face][cut->ring[lowest].corner] != node)
            return false;
    }
    return true;
}

static void set_bits(LeafSet *set, const int *edge, int count, bool broken)
{
    const Level *finest = &set->levels.level[set->levels.finest];
    for (int i = 0; i < count; i++)
        for (int side = 0; side < 2; side++) {
            int face = finest->edge_face[edge[i]][side];
            unsigned char bit = (unsigned char)(1 << corner_of(finest->face_edge[face], edge[i]));
            unsigned char *bits = &set->cut->broken[face];
            *bits = broken ? *bits | bit : *bits & (unsigned char)~bit;
        }
}

// --- derived from the state ---

// Locks the ancestors of each face at an end of a broken edge, or at a corner of a removed face.
void detail_cut_lock(const LeafSet *set)
{
    DetailCut *cut = set->cut;
    const Level *finest = &set->levels.level[set->levels.finest];
    memset(cut->locked, 0, (size_t)set->face_base[set->levels.finest]);
    memset(cut->is_end, 0, (size_t)cut->base_count * sizeof *cut->is_end);
    cut->gone_count = 0;
    for (int f = 0; f < finest->face_count; f++) {
        const bool gone = detail_cut_is_gone(cut, f);
        cut->gone_count += gone;
        for (int k = 0; k < 3 && cut->broken[f] != 0; k++)
            if (gone || (cut->broken[f] >> k & 1) != 0)
                cut->is_end[cut->base[f][k]] = cut->is_end[cut->base[f][(k + 1) % 3]] = true;
    }
    if (set->levels.finest == 0)
        return;
    unsigned char *locked = &cut->locked[set->face_base[set->levels.finest - 1]];
    for (int f = 0; f < finest->face_count; f++)
        locked[f / 4] |= cut->is_end[cut->base[f][0]] | cut->is_end[cut->base[f][1]] |
                         cut->is_end[cut->base[f][2]];
    for (int l = set->levels.finest - 2; l >= 0; l--)
        for (int f = 0; f < set->levels.level[l + 1].face_count; f++)
            cut->locked[set->face_base[l] + f / 4] |= cut->locked[set->face_base[l + 1] + f];
}

void detail_cut_rebuild(Detail *detail)
{
    DetailCut *cut = detail->set.cut;
    for (int f = 0; f < detail->set.face_count; f++)
        for (int k = 0; k < 3; k++)
            if (cut->node[f][k] >= cut->base_count)
                cut->origin[cut->node[f][k] - cut->base_count] = cut->base[f][k];
    for (int c = 0; detail->fixed != NULL && c < *cut->copies; c++)
        detail->fixed[cut->base_count + c] = detail->fixed[cut->origin[c]];
    detail_cut_lock(&detail->set);
    detail_lips_rebuild(detail);
    detail_pieces_label(&detail->set);
}

// --- capacity ---

static void want(LeafSet *set, int level, int face)
{
    DetailCut *cut = set->cut;
    if (level < 0 || detail_is_refined(set, level, face) ||
        cut->wanted[set->face_base[level] + face] != 0)
        return;
    cut->wanted[set->face_base[level] + face] = 1;
    cut->want[cut->want_count++] = (Leaf){level, face, 0};
    want(set, level - 1, face / 4);
    const Level *at = &set->levels.level[level];
    for (int k = 0; k < 3 && level > 0; k++) { // 2:1 across edges
        int across = levels_beyond(at, at->face_edge[face][k], face);
        if (across >= 0)
            want(set, level - 1, across / 4);
    }
}

// Lists the faces that must be refined so that all faces around the vertices are leaves of the
// finest level.
static void list_wanted(LeafSet *set)
{
    DetailCut *cut = set->cut;
    cut->want_count = 0;
    for (int v = 0; v < cut->vertex_count; v++) {
        int count = detail_cut_ring(set, cut->vertex[v], cut->ring);
        for (int i = 0; i < count; i++)
            want(set, set->levels.finest - 1, cut->ring[i].face / 4);
    }
    for (int i = 0; i < cut->want_count; i++)
        cut->wanted[set->face_base[cut->want[i].level] + cut->want[i].face] = 0;
}

static bool lacks(CutOutcome *outcome, CutVerdict verdict, int needed, int room)
{
    if (needed <= room)
        return false;
    outcome->verdict = verdict;
    outcome->needed = needed;
    outcome->room = room;
    return true;
}

// True if the cut fits; the bits are already set. Refining takes up to 3 nodes and 6 faces per
// face; beyond that the slots refuse it.
static bool has_room(Detail *detail, CutOutcome *outcome)
{
    const DetailCut *cut = detail->set.cut;
    const SlotTable *nodes = &detail->faces.slots->node, *faces = &detail->faces.slots->face;
    int copies = 0, count;
    for (int v = 0; v < cut->vertex_count; v++)
        copies += find_new_parts(&detail->set, cut->vertex[v], &count);
    list_wanted(&detail->set);
    bool all_fits = nodes->capacity == nodes->thing_count && faces->capacity == faces->thing_count;
    return !lacks(outcome, CUT_NO_NODES, copies, cut->copy_capacity - (int)*cut->copies) &&
           (all_fits ||
            (!lacks(outcome, CUT_NO_NODES, copies + 3 * cut->want_count,
                    nodes->capacity - nodes->used) &&
             !lacks(outcome, CUT_NO_FACES, 6 * cut->want_count,
                    faces->capacity - faces->used - detail->faces.slots->face_reserve)));
}

// --- nodes ---

// Gives the faces of a component a node of their own, at the position of the shared one.
static void copy_node(SurfaceModel *model, int vertex, int part, int ring_count)
{
    Detail *detail = model->detail;
    DetailCut *cut = detail->set.cut;
    int old = cut->node[cut->ring[part].face][cut->ring[part].corner];
    int copy = cut->base_count + (int)(*cut->copies)++;
    cut->origin[copy - cut->base_count] = vertex;
    detail->fixed[copy] = detail->fixed[vertex];
    detail->set.status[copy] = NODE_FREE;
    for (int i = 0; i < ring_count; i++)
        if (cut->part[i] == part)
            cut->node[cut->ring[i].face][cut->ring[i].corner] = copy;
    detail_set_rest(model, copy);
    detail_copy_row(model, copy, old);
    slots_take_node(detail->faces.slots, copy);
    detail->report.born[detail->report.change.born_count++] = (NodeBirth){copy, {old, old}};
}

static void split_vertex(SurfaceModel *model, int vertex)
{
    Detail *detail = model->detail;
    const LeafSet *set = &detail->set;
    DetailCut *cut = set->cut;
    int count, found = find_new_parts(set, vertex, &count);
    // Where the node stays one, only the hinge at the edge goes.
    if (found == 0 && model->bending == NULL)
        return;
    for (int i = 0; i < found; i++)
        copy_node(model, vertex, cut->fresh[i], count);
    for (int i = 0; i < count; i++) {
        if (found > 0)
            detail_touch(&detail->faces, set->levels.finest, cut->ring[i].face);
        for (int k = 0; k < 3; k++)
            detail_mark(model, cut->node[cut->ring[i].face][k]);
    }
}

static void list_vertices(Detail *detail, const int *edge, int count)
{
    DetailCut *cut = detail->set.cut;
    const Level *finest = &detail->set.levels.level[detail->set.levels.finest];
    bool *is_listed = detail->faces.is_redrawn; // false between changes
    cut->vertex_count = 0;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 2; k++) {
            int node = finest->edge[edge[i]][k];
            if (is_listed[node])
                continue;
            is_listed[node] = true;
            int at = cut->vertex_count++;
            for (; at > 0 && cut->vertex[at - 1] > node; at--)
                cut->vertex[at] = cut->vertex[at - 1];
            cut->vertex[at] = node;
        }
    for (int v = 0; v < cut->vertex_count; v++)
        is_listed[cut->vertex[v]] = false;
}

bool detail_cut_break(SurfaceModel *model, const int *edge, int edge_count, CutOutcome *outcome)
{
    Detail *detail = model->detail;
    LeafSet *set = &detail->set;
    DetailCut *cut = set->cut;
    list_vertices(detail, edge, edge_count);
    // Set the bits tentatively: the capacity needed follows from them.
    set_bits(set, edge, edge_count, true);
    if (!has_room(detail, outcome)) {
        set_bits(set, edge, edge_count, false);
        return false;
    }
    for (int i = 0; i < cut->want_count;
         i++) { // refinements that balance requires are made first by detail_refine itself
        bool fits = detail_refine(model, cut->want[i].level, cut->want[i].face);
        ASSERT(fits);
    }
    int64_t copies = *cut->copies;
    int pieces = cut->piece_count;
    // Now every face around the vertices is a leaf: split the nodes.
    for (int v = 0; v < cut->vertex_count; v++)
        split_vertex(model, cut->vertex[v]);
    detail_lips_follow(detail, edge, edge_count);
    detail_cut_lock(set);
    detail_pieces_label(set);
    slots_label(detail->faces.slots);
    // New pieces get frames of their own.
    if (cut->piece_count > pieces)
        detail_frames_start(detail);
    outcome->separated = edge_count;
    outcome->nodes_added = (int)(*cut->copies - copies);
    return true;
}
