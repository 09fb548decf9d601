// SPDX-License-Identifier: MIT
// Decides whether cells are still connected. Two searches from both sides of a broken link, which
// stop when they meet, nearly always decide at the cost of the few cells around it. All cells that
// they have seen are connected, so that adjacent links, which broke with this one, are decided by a
// look-up. A search that runs out of cells has seen a whole piece.
#include "voxel/cut/cut_pieces.h"

#include "base/check.h"
#include "base/sets.h"

#include <string.h>

enum {
    LINKS = 1024,     // in one call, beyond which everything is numbered from scratch
    EFFORT = 20000,   // cells that the searches of one call may visit before that
    PLACES = 1 << 16, // places for cells that they see: about as many, and those around them
};
enum { GONE = 0 }; // ~number of a piece that a cell which is gone has

// Returns the cell across an unbroken face: -x, +x, -y, +y, -z, +z; -1: none.
static int joined_to(const CutLattice *lattice, int cell, int direction)
{
    const int axis = direction / 2;
    if (direction & 1)
        return lattice->broken[cell] >> axis & 1 ? -1 : cut_lattice_beyond(lattice, cell, axis);
    const short *at = lattice->element[cell].cell;
    int below =
        cut_lattice_cell(lattice, at[0] - (axis == 0), at[1] - (axis == 1), at[2] - (axis == 2));
    return below < 0 || (lattice->broken[below] >> axis & 1) ? -1 : below;
}

// ---------------------------------------------------------------------------------------------
// From scratch

static int is_small(int size)
{
    return size > 0 && size < PIECE_SMALL;
}

// Joins cells along the rows of the lattice: labels are smallest cells of pieces then.
static void join_cells(CutPieces *pieces)
{
    const CutLattice *lattice = pieces->lattice;
    const int *lut = lattice->lut[0], *count = lattice->count;
    const long step[3] = {1, count[0], (long)count[0] * count[1]};
    int *root = pieces->label;
    // Join cells across faces that are not broken.
    union_find_reset(root, pieces->cell_count);
    for (long at = 0, z = 0; z < count[2]; z++)
        for (int y = 0; y < count[1]; y++)
            for (int x = 0; x < count[0]; x++, at++) {
                const int cell = lut[at];
                if (cell < 0)
                    continue;
                const bool inside[3] = {x + 1 < count[0], y + 1 < count[1], z + 1 < count[2]};
                for (int axis = 0; axis < 3; axis++)
                    if (inside[axis] && lut[at + step[axis]] >= 0 &&
                        !(lattice->broken[cell] >> axis & 1))
                        union_find_join(root, cell, lut[at + step[axis]]);
            }
    for (int c = 0; c < pieces->cell_count; c++) // a root comes before its cells
        root[c] = root[root[c]];
}

// Labels the smallest cells of the pieces in `first`; false, and labels none: it has a cell that is
// not the smallest of its piece, or one twice.
static bool take_numbers(CutPieces *pieces)
{
    int *label = pieces->label, n = 0;
    pieces->gone_count = 0;
    bool good = *pieces->count >= 0 && *pieces->count <= pieces->most;
    for (; good && n < (int)*pieces->count; n++) {
        const int cell = pieces->first[n];
        if (cell == -1 && pieces->lattice->removable) {
            pieces->gone_count++;
            continue;
        }
        // Each number names the first cell of a piece, and no piece twice.
        good = cell >= 0 && cell < pieces->cell_count && label[cell] == cell &&
               !cut_lattice_is_gone(pieces->lattice, cell);
        if (!good)
            break;
        label[cell] = ~n;
    }
    if (good)
        return true;
    while (--n >= 0)
        if (pieces->first[n] >= 0)
            label[pieces->first[n]] = pieces->first[n];
    pieces->gone_count = 0;
    *pieces->count = 0;
    return false;
}

// Returns the number of a new piece.
static int number_new(CutPieces *pieces, int first)
{
    // Only numbers of a damaged file leave no room (cut_pieces_have_room).
    const int n = *pieces->count < pieces->most ? (int)(*pieces->count)++ : pieces->most - 1;
    pieces->first[n] = first;
    return n;
}

// Finds the pieces: those in `first` keep their numbers, the others get new ones. Returns how many
// came; -1: `first` was impossible, and all are numbered again.
static int find_pieces(CutPieces *pieces)
{
    join_cells(pieces);
    const bool good = take_numbers(pieces);
    int *label = pieces->label, *size = pieces->size, came = 0;
    memset(size, 0, (size_t)pieces->most * sizeof *size);
    for (int c = 0; c < pieces->cell_count; c++) {
        if (cut_lattice_is_gone(pieces->lattice, c)) {
            label[c] = GONE; // all its faces are broken
            continue;
        }
        if (label[c] == c) {
            label[c] = ~number_new(pieces, c);
            came++;
        } else if (label[c] >= 0) {
            label[c] = label[label[c]];
        }
        size[~label[c]]++;
    }
    pieces->small_count = 0;
    for (int n = 0; n < (int)*pieces->count; n++)
        pieces->small_count += is_small(size[n]);
    return good ? came : -1;
}

bool cut_pieces_derive(CutPieces *pieces)
{
    return find_pieces(pieces) == 0;
}

// ---------------------------------------------------------------------------------------------
// After new broken faces

// A cell enters five others at most; a search begins with one.
enum { MOST_SEEN = PLACES - PLACES / 4 };

typedef enum Answer { JOINED, APART, TOO_LONG } Answer;

// Returns the place of a cell that searches of this call have seen, or a free one.
static SeenCell *place_of(const CutPieces *pieces, int cell)
{
    const unsigned mask = (unsigned)pieces->seen_mask, shift = (unsigned)pieces->seen_shift;
    unsigned at = shift == 0 ? (unsigned)cell : (unsigned)cell * 0x9e3779b1u >> shift;
    while (pieces->seen[at].label >= pieces->first_label && pieces->seen[at].cell != cell)
        at = (at + 1) & mask;
    return &pieces->seen[at];
}

// Returns the set of connected cells that a cell belongs to, by the label that was first seen; -1:
// none. Labels of earlier calls are below `first_label`.
static int set_of(CutPieces *pieces, int cell)
{
    const int label = place_of(pieces, cell)->label - pieces->first_label;
    return label < 0 ? -1 : union_find_root(pieces->set, label);
}

// A search from one side of a link: the cells found, of which those before `begin` are processed.
typedef struct Search {
    int *cell, begin, end;
    int label;
    bool open; // has not reached cells that were seen before
} Search;

static void enter(CutPieces *pieces, Search *search, int cell)
{
    *place_of(pieces, cell) = (SeenCell){cell, pieces->first_label + search->label};
    pieces->seen_count++;
    search->cell[search->end++] = cell;
}

static void begin_search(CutPieces *pieces, Search *search, int *queue, int cell)
{
    *search = (Search){.cell = queue, .open = set_of(pieces, cell) < 0};
    if (!search->open)
        return;
    search->label = pieces->labels++;
    pieces->set[search->label] = search->label;
    enter(pieces, search, cell);
}

// Processes one more cell, until that leads to another set.
static void go_on(CutPieces *pieces, Search *search)
{
    const int cell = search->cell[search->begin++];
    const int label = place_of(pieces, cell)->label - pieces->first_label;
    pieces->visited++;
    for (int d = 0; d < 6; d++) {
        const int next = joined_to(pieces->lattice, cell, d);
        if (next < 0)
            continue;
        const int own = union_find_root(pieces->set, label), other = set_of(pieces, next);
        // Not seen yet; or another search has been there, and both are one set.
        if (other < 0) {
            enter(pieces, search, next);
        } else if (other != own) {
            pieces->set[own] = other;
            search->open = false;
        }
    }
}

// Decides whether the two ends of a link are connected. APART: search[*side] has seen a whole
// piece.
static Answer search_between(CutPieces *pieces, int a, int b, Search search[2], int *side,
                             int *effort)
{
    begin_search(pieces, &search[0], pieces->queue[0], a);
    begin_search(pieces, &search[1], pieces->queue[1], b);
    for (*side = 0; *effort > 0 && pieces->seen_count <= MOST_SEEN; *side ^= 1) {
        if (set_of(pieces, a) == set_of(pieces, b))
            return JOINED;
        if (!search[0].open && !search[1].open)
            return TOO_LONG; // two sets from other searches
        Search *here = &search[*side];
        if (!here->open)
            continue;
        if (here->begin == here->end)
            return APART;
        (*effort)--;
        go_on(pieces, here);
    }
    return TOO_LONG;
}

// Separates a piece that was found completely from the one that it was part of, which `rest` on the
// other side of a link belongs to. False: there is no number for it.
static bool separate(CutPieces *pieces, const Search *piece, int rest)
{
    int *label = pieces->label, *size = pieces->size;
    const int old = cut_pieces_of(pieces, rest), before = size[old];
    const int new = (int)*pieces->count + pieces->came;
    if (new >= pieces->most)
        return false;
    pieces->came++;
    // A piece is named by its lowest cell.
    int lowest = piece->cell[0], own = new, first = -1;
    for (int i = 0; i < piece->end; i++)
        lowest = piece->cell[i] < lowest ? piece->cell[i] : lowest;
    if (lowest == pieces->first[old]) { // it keeps the number: the others need another
        own = old;
        for (int i = 0; i < piece->end; i++)
            label[piece->cell[i]] = GONE;
        for (int c = 0; c < pieces->cell_count; c++)
            if (label[c] == ~old) {
                first = first < 0 ? c : first;
                label[c] = ~new;
            }
    }
    for (int i = 0; i < piece->end; i++)
        label[piece->cell[i]] = ~own;
    pieces->first[new] = own == old ? first : lowest;
    // Both pieces have other sizes now.
    size[new] = own == old ? before - piece->end : piece->end;
    size[old] = before - size[new];
    pieces->small_count += is_small(size[old]) + is_small(size[new]) - is_small(before);
    // The last that a piece left counts.
    int k = 0;
    while (k < pieces->left_count && pieces->left[k] != own)
        k++;
    pieces->left_count += k == pieces->left_count;
    pieces->left[k] = own;
    pieces->rest[k] = rest;
    return true;
}

// Gives the pieces that came their numbers, in the order of their lowest cells.
static void number_those_that_came(CutPieces *pieces)
{
    const int count = (int)*pieces->count, came = pieces->came;
    int *first = pieces->first + count, *size = pieces->size + count;
    int *rank = pieces->left, moved = 0; // by the numbers that they had: no longer needed
    for (int n = 0; n < came; n++) {
        rank[n] = 0;
        for (int k = 0; k < came; k++)
            rank[n] += first[k] < first[n];
        moved += rank[n] != n;
    }
    *pieces->count += came;
    if (moved == 0)
        return;
    for (int c = 0; c < pieces->cell_count; c++)
        if (cut_pieces_of(pieces, c) >= count)
            pieces->label[c] = ~(count + rank[cut_pieces_of(pieces, c) - count]);
    for (int n = 0; n < came;) { // each exchange brings one to its place
        const int to = rank[n], kept[3] = {first[to], size[to], rank[to]};
        if (to == n) {
            n++;
            continue;
        }
        first[to] = first[n], size[to] = size[n], rank[to] = to;
        first[n] = kept[0], size[n] = kept[1], rank[n] = kept[2];
    }
}

// Returns the cell of the remaining piece: what led to a piece that split off must lead to what it
// left.
static int what_is_left(const CutPieces *pieces, int cell)
{
    for (int i = 0; i < pieces->left_count;)
        if (pieces->left[i] == cut_pieces_of(pieces, cell)) {
            cell = pieces->rest[i];
            i = 0;
        } else {
            i++;
        }
    return cell;
}

static void begin_call(CutPieces *pieces)
{
    if (pieces->first_label > INT32_MAX - 4 * LINKS) {
        memset(pieces->seen, 0, ((size_t)pieces->seen_mask + 1) * sizeof *pieces->seen);
        pieces->first_label = 0;
        pieces->labels = 1; // 0: never seen
    }
    pieces->first_label += pieces->labels;
    pieces->labels = 0;
    pieces->left_count = pieces->came = pieces->seen_count = 0;
}

// Follows links that no longer connect: faces {cell, axis}, or pairs of cells.
static bool follow_links(CutPieces *pieces, const int (*link)[2], int count, bool faces)
{
    int effort = EFFORT, side = 0;
    bool told = count <= LINKS;
    begin_call(pieces);
    for (int f = 0; f < count && told; f++) {
        // Both sides of the face, if an earlier one has not told already.
        const int beyond =
            faces ? cut_lattice_beyond(pieces->lattice, link[f][0], link[f][1]) : link[f][1];
        const int end[2] = {what_is_left(pieces, link[f][0]), what_is_left(pieces, beyond)};
        if (end[0] == end[1])
            continue;
        // Search from both ends at once: the smaller piece ends the search.
        Search search[2];
        const Answer answer = search_between(pieces, end[0], end[1], search, &side, &effort);
        told =
            answer == JOINED || (answer == APART && separate(pieces, &search[side], end[side ^ 1]));
    }
    // Too many faces or too long a search: all of them again.
    if (!told)
        return find_pieces(pieces) > 0;
    number_those_that_came(pieces);
    return pieces->came > 0;
}

bool cut_pieces_follow(CutPieces *pieces, const int (*face)[2], int count)
{
    return follow_links(pieces, face, count, true);
}

// ---------------------------------------------------------------------------------------------
// Cells that go

// Chains what connected cells that go have around them: it may not be connected without them.
static void flood(CutPieces *pieces, int cell)
{
    enum { STAYS, GOES, SEEN };
    int *queue = pieces->queue[0], end = 0, last = -1;
    pieces->going[cell] = SEEN;
    queue[end++] = cell;
    for (int begin = 0; begin < end; begin++)
        for (int d = 0; d < 6; d++) {
            const int next = joined_to(pieces->lattice, queue[begin], d);
            if (next < 0 || pieces->going[next] == SEEN)
                continue;
            if (pieces->going[next] == GOES) {
                pieces->going[next] = SEEN;
                queue[end++] = next;
                continue;
            }
            if (last >= 0 && last != next) {
                int *link = pieces->link[pieces->link_count++];
                link[0] = last, link[1] = next;
            }
            last = next;
        }
}

void cut_pieces_expect(CutPieces *pieces, const int *cell, int count)
{
    ASSERT(count <= CUT_REMOVE_MOST);
    pieces->link_count = 0;
    for (int k = 0; k < count; k++)
        pieces->going[cell[k]] = 1;
    for (int k = 0; k < count; k++)
        if (pieces->going[cell[k]] == 1)
            flood(pieces, cell[k]);
    for (int k = 0; k < count; k++)
        pieces->going[cell[k]] = 0;
}

// Names a piece whose smallest cell went by the smallest that is left.
static void rename_piece(CutPieces *pieces, int number)
{
    int c = pieces->first[number] + 1;
    if (pieces->size[number] == 0) {
        pieces->first[number] = -1;
        pieces->gone_count++;
        return;
    }
    while (cut_pieces_of(pieces, c) != number)
        c++;
    pieces->first[number] = c;
}

bool cut_pieces_remove(CutPieces *pieces, const int *cell, int count)
{
    int *size = pieces->size, of[CUT_REMOVE_MOST];
    for (int k = 0; k < count; k++) {
        of[k] = cut_pieces_of(pieces, cell[k]);
        const int before = size[of[k]]--;
        pieces->small_count += is_small(size[of[k]]) - is_small(before);
        pieces->label[cell[k]] = GONE;
    }
    for (int k = 0; k < count; k++)
        if (pieces->first[of[k]] == cell[k])
            rename_piece(pieces, of[k]);
    return follow_links(pieces, (const int(*)[2])pieces->link, pieces->link_count, false);
}

// ---------------------------------------------------------------------------------------------

// Numbers pieces as the mesh does, from any cell of a vertex's elements: all are of one piece.
static void number_as_mesh(CutPieces *pieces, const LatticeMesh *mesh, const Layout *layout)
{
    *pieces->count = mesh->piece_count;
    for (int e = 0; e < mesh->element_count; e++) {
        const Leaf *leaf = &layout->leaf[e];
        int cell = cut_lattice_cell(pieces->lattice, leaf->cell[0], leaf->cell[1], leaf->cell[2]);
        pieces->first[mesh->piece[mesh->vertex[e][0]]] = pieces->label[cell];
    }
}

void cut_pieces_create(CutPieces *pieces, const CutLattice *lattice, const VoxelMaking *making,
                       Arena *arena, StateList *state)
{
    const char *name = making->options->body.name;
    const int cells = lattice->level_first[1];
    const int most =
        lattice->adapts && lattice->vertex_capacity < cells ? lattice->vertex_capacity : cells;
    *pieces = (CutPieces){.lattice = lattice, .cell_count = cells, .most = most};
    // State: the names of pieces in the order in which they came.
    pieces->first = ALLOCATE(ARENA_TOPOLOGY, most, int, "first cells of pieces");
    pieces->count = ALLOCATE(ARENA_TOPOLOGY, 1, int64_t, "piece count");
    state_add(state, pieces->first, (size_t)most * sizeof *pieces->first, "%s/pieces", name);
    state_add(state, pieces->count, sizeof *pieces->count, "%s/piece_count", name);
    // Derived from it, and scratch of searches.
    const int seen = cells < PLACES ? cells : PLACES;
    pieces->label = ALLOCATE(ARENA_TOPOLOGY, cells, int, "pieces of cells");
    pieces->size = ALLOCATE(ARENA_TOPOLOGY, most, int, "sizes of pieces");
    pieces->seen = ALLOCATE(ARENA_TOPOLOGY, seen, SeenCell, "searches");
    pieces->seen_mask = seen - 1;
    pieces->seen_shift = cells > PLACES ? 16 : 0;
    pieces->set = ALLOCATE(ARENA_TOPOLOGY, 2 * LINKS, int, "sets of searches");
    pieces->rest = ALLOCATE(ARENA_TOPOLOGY, LINKS, int, "what pieces left");
    pieces->left = ALLOCATE(ARENA_TOPOLOGY, LINKS, int, "pieces that left");
    pieces->labels = 1;
    if (lattice->removable) {
        pieces->going = ALLOCATE(ARENA_TOPOLOGY, cells, unsigned char, "cells that go");
        pieces->link = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)6 * CUT_REMOVE_MOST,
                                      sizeof *pieces->link, "%s/%s", name, "links that go");
    }
    for (int side = 0; side < 2; side++)
        pieces->queue[side] = ALLOCATE(ARENA_TOPOLOGY, seen, int, "search queue");
    // The uncut body has the numbers of its mesh.
    join_cells(pieces);
    number_as_mesh(pieces, &making->mesh, &making->layout);
    bool good = cut_pieces_derive(pieces);
    ASSERT(good);
}
