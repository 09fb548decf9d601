// SPDX-License-Identifier: MIT
// Elements of a body that adapts: which may be leaves, and how they merge again.
#include "voxel/cut/cut_carry.h"
#include "voxel/cut/cut_parts.h"

#include "base/bits.h"

#include "base/check.h"
#include "voxel/point_parts.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// Load time: elements that may be leaves

// What is known of a lattice point of the uncut body: bits.
enum { POINT_IN_PARTS = 1, POINT_HELD = 2, POINT_INNER = 4, POINT_SOLID = 8, POINT_EDGE = 16 };

typedef struct Allowing {
    CutLattice *lattice;
    const VoxelMaking *making;
    unsigned char *point;     // [point]
    unsigned char parts[256]; // number of parts by the set of solid slots
} Allowing;

static void count_parts(unsigned char parts[256])
{
    for (unsigned solid = 0; solid < 256; solid++) {
        int slot[8];
        for (int s = 0; s < 8; s++)
            slot[s] = solid >> s & 1 ? s : -1;
        parts[solid] = (unsigned char)__builtin_popcount(point_parts(slot, solid, 0).owns);
    }
}

static void find_parts(Allowing *allowing)
{
    const CutScratch *scratch = allowing->lattice->scratch;
    int p[3];
    for (p[2] = 0; p[2] < scratch->points[2]; p[2]++)
        for (p[1] = 0; p[1] < scratch->points[1]; p[1]++)
            for (p[0] = 0; p[0] < scratch->points[0]; p[0]++) {
                unsigned solid = 0;
                for (int s = 0; s < 8; s++)
                    solid |= (unsigned)(cut_parts_block(allowing->lattice, 0, p[0] - 1 + (s & 1),
                                                        p[1] - 1 + (s >> 1 & 1),
                                                        p[2] - 1 + (s >> 2)) >= 0)
                             << s;
                unsigned char *point = &allowing->point[cut_parts_index(scratch, p)];
                *point |= allowing->parts[solid] > 1 ? POINT_IN_PARTS : 0;
                *point |= solid == 0xff ? POINT_INNER : 0;
                *point |= solid != 0 ? POINT_SOLID : 0;
            }
}

static void hold_nodes(Allowing *allowing, const FixedRegion *region)
{
    const int *n = allowing->lattice->scratch->id_points, points = n[0] * n[1] * n[2];
    for (int k = 0; k < region->node_count; k++) {
        const int index = region->node[k] % points;
        const int p[3] = {index % n[0], index / n[0] % n[1], index / (n[0] * n[1])};
        allowing->point[cut_parts_index(allowing->lattice->scratch, p)] |= POINT_HELD;
    }
}

static void find_held(Allowing *allowing, const FixedRegion *region)
{
    const CutScratch *scratch = allowing->lattice->scratch;
    int p[3];
    for (p[2] = 0; p[2] < scratch->points[2]; p[2]++)
        for (p[1] = 0; p[1] < scratch->points[1]; p[1]++)
            for (p[0] = 0; p[0] < scratch->points[0]; p[0]++)
                if (fixed_contains(region, lattice_point(allowing->making->options->lattice, p[0],
                                                         p[1], p[2])))
                    allowing->point[cut_parts_index(scratch, p)] |= POINT_HELD;
}

// Finds the points of the surface that are held beside others that are not: strains are largest
// there, and large elements so stiff that the whole body moves less.
static void find_edges(Allowing *allowing)
{
    const CutScratch *scratch = allowing->lattice->scratch;
    const int *n = scratch->points;
    int p[3];
    for (p[2] = 0; p[2] < n[2]; p[2]++)
        for (p[1] = 0; p[1] < n[1]; p[1]++)
            for (p[0] = 0; p[0] < n[0]; p[0]++) {
                unsigned char *point = &allowing->point[cut_parts_index(scratch, p)];
                if ((*point & (POINT_HELD | POINT_INNER | POINT_SOLID)) !=
                    (POINT_HELD | POINT_SOLID))
                    continue;
                for (int side = 0; side < 6; side++) {
                    int q[3] = {p[0], p[1], p[2]};
                    q[side / 2] += 2 * (side % 2) - 1;
                    if (q[side / 2] < 0 || q[side / 2] >= n[side / 2])
                        continue;
                    const unsigned other = allowing->point[cut_parts_index(scratch, q)];
                    if ((other & (POINT_HELD | POINT_INNER | POINT_SOLID)) == POINT_SOLID)
                        *point |= POINT_EDGE;
                }
            }
}

// Returns the bits that any and that all points of a closed block have.
static void gather_points(const Allowing *allowing, const CutElement *element, unsigned *any,
                          unsigned *all)
{
    const CutScratch *scratch = allowing->lattice->scratch;
    const short *at = element->cell;
    const int edge = 1 << element->level;
    *any = 0, *all = 0xff;
    for (int z = at[2]; z <= at[2] + edge; z++)
        for (int y = at[1]; y <= at[1] + edge; y++) {
            const unsigned char *row =
                &allowing->point[cut_parts_index(scratch, (const int[3]){at[0], y, z})];
            for (int x = 0; x <= edge; x++)
                *any |= row[x], *all &= row[x];
        }
}

// True if the children hold together through faces inside the element, and may be leaves.
static bool hangs_together(const CutLattice *lattice, int element)
{
    int child[8];
    unsigned seen = 0, all = cut_lattice_children(lattice, element);
    for (int c = 0; c < 8; c++) {
        child[c] = cut_lattice_child(lattice, element, c);
        if (child[c] >= 0 && !cut_parts_is_cell(lattice, child[c]) &&
            !lattice->element[child[c]].mergeable)
            return false;
    }
    seen = all & (0U - all); // from the lowest on, as far as faces lead
    for (int round = 0; round < 8; round++)
        for (int c = 0; c < 8; c++)
            for (int d = 0; d < 3 && (seen >> c & 1); d++)
                if (child[c ^ 1 << d] >= 0 &&
                    (cut_parts_is_cell(lattice, child[c]) ||
                     cut_parts_meets(lattice, child[c], 2 * d + (~c >> d & 1))))
                    seen |= 1u << (c ^ 1 << d);
    return seen == all;
}

static bool is_fine(const Allowing *allowing, const CutElement *element)
{
    const VoxelOptions *options = allowing->making->options;
    const double edge = 1 << element->level;
    for (int f = 0; f < options->fine_count; f++) {
        const FineRegion *fine = &options->fine[f];
        const Lattice *lattice = options->lattice;
        const Vec3 x =
            vec3_scale(1.0 / lattice->size, quat_rotate(quat_conjugate(lattice->turn),
                                                        vec3_sub(fine->centre, lattice->origin)));
        const double middle[3] = {x.x, x.y, x.z};
        double square = 0.0; // of the distance from the block, in cells
        for (int d = 0; d < 3; d++) {
            const double below = element->cell[d] - middle[d];
            const double out = below > 0.0 ? below : -below > edge ? -below - edge : 0.0;
            square += out * out;
        }
        if (square * lattice->size * lattice->size <= fine->radius * fine->radius)
            return true;
    }
    return false;
}

// Corners at the lower and the upper side of each axis.
static const unsigned SIDE[3][2] = {{0x55, 0xaa}, {0x33, 0xcc}, {0x0f, 0xf0}};

static bool is_held(const Allowing *allowing, const CutElement *element, const int off[3])
{
    const short *at = element->cell;
    const int p[3] = {at[0] + off[0], at[1] + off[1], at[2] + off[2]};
    return allowing->point[cut_parts_index(allowing->lattice->scratch, p)] & POINT_HELD;
}

// Returns the corners of an element that are held. `axes`: a bit each along which they are apart.
static unsigned held_corners(const Allowing *allowing, const CutElement *element, unsigned *axes)
{
    const int edge = 1 << element->level;
    unsigned held = 0;
    *axes = 0;
    for (int c = 0; c < NODE_CORNERS; c++)
        held |= (unsigned)is_held(allowing, element,
                                  (int[3]){(c & 1) * edge, (c >> 1 & 1) * edge, (c >> 2) * edge})
                << c;
    for (int d = 0; d < 3; d++)
        *axes |= (unsigned)((held & SIDE[d][0]) != 0 && (held & SIDE[d][1]) != 0) << d;
    return held;
}

// True if the points of a closed block that are held are those between held corners of it, and no
// others: then its motion leaves them where they are. Some of its cells must hold it as its corners
// do, which may lie in void.
static bool holds_by_corners(const Allowing *allowing, int number)
{
    const CutLattice *lattice = allowing->lattice;
    const CutElement *element = &lattice->element[number];
    const int edge = 1 << element->level;
    unsigned axes;
    const unsigned held = held_corners(allowing, element, &axes);
    int p[3];
    for (p[2] = 0; p[2] <= edge; p[2]++)
        for (p[1] = 0; p[1] <= edge; p[1]++)
            for (p[0] = 0; p[0] <= edge; p[0]++) {
                unsigned between = 0xff;
                for (int d = 0; d < 3; d++)
                    between &= p[d] == 0 ? SIDE[d][0] : p[d] == edge ? SIDE[d][1] : 0xffu;
                if (is_held(allowing, element, p) != ((between & ~held) == 0))
                    return false;
            }
    // Its children hold as their cells do.
    const int first = cut_lattice_first_child(lattice, number);
    for (int k = 0; k < __builtin_popcount(cut_lattice_children(lattice, number)); k++) {
        unsigned own;
        if (held_corners(allowing, &lattice->element[first + k], &own) != 0 && own == axes)
            return true;
    }
    return false;
}

// True if the solid is thick enough for an element.
static bool is_thick(const Allowing *allowing, const CutElement *element)
{
    const VoxelOptions *options = allowing->making->options;
    const Lattice *lattice = options->lattice;
    const short *at = element->cell;
    const int edge = 1 << element->level;
    if (options->coarsest == NULL)
        return true;
    // Any solid cell of it tells.
    for (int c = 0; c < edge * edge * edge; c++) {
        const int x = at[0] + c % edge, y = at[1] + c / edge % edge, z = at[2] + c / edge / edge;
        if (lattice_label(lattice, x, y, z) != 0)
            return options->coarsest[lattice_index(lattice, x, y, z)] >= element->level;
    }
    return false;
}

static bool may_be_leaf(const Allowing *allowing, int number)
{
    const CutElement *element = &allowing->lattice->element[number];
    const VoxelOptions *options = allowing->making->options;
    unsigned any, all;
    if (element->material == 0 || !hangs_together(allowing->lattice, number))
        return false;
    gather_points(allowing, element, &any, &all);
    const int coarsest = all & POINT_INNER ? options->body.levels : options->surface_level;
    return element->level <= coarsest && !(any & (POINT_IN_PARTS | POINT_EDGE)) &&
           ((any & POINT_HELD) == 0 || holds_by_corners(allowing, number)) &&
           !is_fine(allowing, element) && ((all & POINT_INNER) || is_thick(allowing, element));
}

void cut_merge_allow(CutLattice *lattice, const VoxelMaking *making)
{
    const BodyOptions *body = &making->options->body;
    const int *n = lattice->scratch->points;
    Allowing allowing = {.lattice = lattice, .making = making};
    allowing.point = calloc((size_t)n[0] * (size_t)n[1] * (size_t)n[2], 1);
    ASSERT(allowing.point != NULL);
    count_parts(allowing.parts);
    find_parts(&allowing);
    for (int r = 0; r < body->fixed_count; r++)
        if (body->fixed[r].kind == FIXED_NODES)
            hold_nodes(&allowing, &body->fixed[r]);
        else
            find_held(&allowing, &body->fixed[r]);
    if (body->adapt_error > 0.0)
        find_edges(&allowing);
    // Children come before their parents.
    for (int e = lattice->level_first[1]; e < lattice->element_count; e++)
        lattice->element[e].mergeable = may_be_leaf(&allowing, e);
    free(allowing.point);
}

// ---------------------------------------------------------------------------------------------
// Merging. Step thread

// True if a block of the size of an element's children, beside it, is divided.
static bool is_finer_around(const CutLattice *lattice, int element)
{
    const CutElement *middle = &lattice->element[element];
    const int level = middle->level - 1;
    for (int n = 0; n < 64 && level > 0; n++) { // of cells a bit says that they are gone
        const int x = n & 3, y = n >> 2 & 3, z = n >> 4;
        const bool own = (x == 1 || x == 2) && (y == 1 || y == 2) && (z == 1 || z == 2);
        const int around = own ? -1
                               : cut_parts_block(lattice, level, (middle->cell[0] >> level) - 1 + x,
                                                 (middle->cell[1] >> level) - 1 + y,
                                                 (middle->cell[2] >> level) - 1 + z);
        if (around >= 0 && lattice->divided[around])
            return true;
    }
    return false;
}

bool cut_lattice_can_merge(const CutLattice *lattice, int element)
{
    const CutElement *parent = &lattice->element[element];
    if (!lattice->adapts || parent->level == 0 || !parent->mergeable || !lattice->divided[element])
        return false;
    const int first = cut_lattice_first_child(lattice, element);
    for (int c = first; c < first + __builtin_popcount(cut_lattice_children(lattice, element)); c++)
        if (lattice->divided[c] || lattice->mark[c] & CUT_MERGED)
            return false;
    // Where a child must be divided the element must be, too. It has at most one vertex more at
    // each of its corners in void.
    return !cut_split_must(lattice, element) && !is_finer_around(lattice, element) &&
           (parent->whole || cut_parts_room(lattice) >= NODE_CORNERS) &&
           cut_parts_allow(lattice, parent->level, 1);
}

// Gives an element the vertices that its children had at its nodes: of each the first.
static void hand_up(CutLattice *lattice, int element)
{
    const CutScratch *scratch = lattice->scratch;
    cut_parts_take_row(lattice, element);
    int *nodes = cut_parts_nodes(lattice, element);
    for (int n = 0; n < NODE_COUNT; n++)
        nodes[n] = -1;
    for (int c = 0; c < 8; c++) {
        const int child = cut_lattice_child(lattice, element, c);
        if (child < 0)
            continue;
        const int *old = cut_lattice_nodes(lattice, child);
        for (int k = 0; k < NODE_CORNERS; k++) {
            const int node =
                scratch->node_at[(c & 1) + (k & 1) + 3 * ((c >> 1 & 1) + (k >> 1 & 1)) +
                                 9 * ((c >> 2) + (k >> 2))];
            if (node >= 0 && nodes[node] < 0)
                nodes[node] = old[k];
        }
        cut_parts_clear_row(lattice, child);
    }
}

void cut_lattice_merge(CutLattice *lattice, int element)
{
    const CutElement *parent = &lattice->element[element];
    const int children = __builtin_popcount(cut_lattice_children(lattice, element));
    ASSERT(cut_lattice_can_merge(lattice, element));
    if (lattice->carry != NULL)
        cut_carry_before(lattice->carry, element);
    // The bit and the counts.
    lattice->divided[element] = 0;
    lattice->mark[element] |= CUT_LEAF;
    const int first = cut_lattice_first_child(lattice, element);
    for (int c = first; c < first + children; c++)
        lattice->mark[c] &= (unsigned char)~CUT_LEAF;
    lattice->leaf_count -= children - 1;
    lattice->leaf_at_level[parent->level]++;
    lattice->leaf_at_level[parent->level - 1] -= children;
    lattice->scratch->left_larger += parent->level > 1 ? children : 0;
    // Its vertices start with those that its children share with it.
    hand_up(lattice, element);
    cut_parts_enter_leaf(lattice, element);
    cut_parts_list_element(lattice, element);
    for (int c = first; c < first + children; c++)
        cut_parts_list_element(lattice, c);
    lattice->changes.merged[lattice->changes.merged_count++] = element;
    lattice->mark[element] |= CUT_MERGED;
    // Vertices between the children end, and corners in void come.
    cut_split_visit(lattice, element);
}

void cut_lattice_note(CutLattice *lattice)
{
    const int first = lattice->level_first[1];
    for (int e = first; e < lattice->element_count; e++)
        if (lattice->divided[e])
            bits_add(lattice->scratch->noted, e - first);
        else
            bits_remove(lattice->scratch->noted, e - first);
}

int cut_lattice_undivide(CutLattice *lattice)
{
    const int first = lattice->level_first[1];
    int merged = 0;
    for (int e = first; e < lattice->element_count; e++)
        if (lattice->divided[e] && !bits_has(lattice->scratch->noted, e - first) &&
            cut_lattice_can_merge(lattice, e)) {
            cut_lattice_merge(lattice, e);
            merged++;
        }
    return merged;
}

void cut_lattice_coarsen(CutLattice *lattice)
{
    cut_lattice_forget_changes(lattice);
    // What a level needs around it is known once the level below is as coarse as it can be. Again,
    // since merging makes room for corners in void, and for what must be divided.
    for (bool changed = true; changed;) {
        changed = false;
        for (int e = lattice->level_first[1]; e < lattice->element_count; e++)
            if (cut_lattice_can_merge(lattice, e)) {
                cut_lattice_merge(lattice, e);
                cut_lattice_forget_changes(lattice);
                changed = true;
            }
        changed |= cut_split_divide_others(lattice) > 0;
        cut_lattice_forget_changes(lattice);
    }
}
