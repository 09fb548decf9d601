// Whether cells still hold together. Two searches from both sides of a broken link, which stop when
// they meet, tell nearly always at the cost of the few cells around it; only when one of them runs
// dry everything is numbered anew.
#include "voxel/cut/cut_pieces.h"

#include "base/check.h"

#include <string.h>

#define ALLOCATE(count, type, label)                                                               \
    (type *)arena_allocate(arena, ARENA_TOPOLOGY, (size_t)(count), sizeof(type), "%s/%s", name,    \
                           label)

enum {
    SEARCHES = 128, // links in one call beyond which everything is numbered anew
    EFFORT = 8000,  // cells that the searches of one call may visit before that
    LOOK_BACK = 40, // links of the same call that are tried first
};

// The cell across a face that is not broken: -x, +x, -y, +y, -z, +z; -1: none.
static int joined_to(const CutLattice *lattice, int cell, int direction)
{
    const int axis = direction / 2;
    if (direction & 1)
        return lattice->broken[cell] >> axis & 1 ? -1 : cut_lattice_beyond(lattice, cell, axis);
    const int *at = lattice->element[cell].cell;
    int below =
        cut_lattice_cell(lattice, at[0] - (axis == 0), at[1] - (axis == 1), at[2] - (axis == 2));
    return below < 0 || (lattice->broken[below] >> axis & 1) ? -1 : below;
}

// ---------------------------------------------------------------------------------------------
// From scratch

static int find_root(int *root, int cell)
{
    while (root[cell] != cell) {
        root[cell] = root[root[cell]];
        cell = root[cell];
    }
    return cell;
}

static void join(int *root, int a, int b)
{
    a = find_root(root, a);
    b = find_root(root, b);
    root[a > b ? a : b] = a < b ? a : b;
}

// Joins cells along the rows of the lattice; counts small pieces.
static void find_pieces(CutPieces *pieces)
{
    const CutLattice *lattice = pieces->lattice;
    const int *lut = lattice->lut[0], *count = lattice->count;
    const long step[3] = {1, count[0], (long)count[0] * count[1]};
    int *root = pieces->root;
    for (int c = 0; c < pieces->cell_count; c++)
        root[c] = c;
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
                        join(root, cell, lut[at + step[axis]]);
            }
    int *size = pieces->queue[0];
    memset(size, 0, (size_t)pieces->cell_count * sizeof *size);
    pieces->small_count = 0;
    for (int c = 0; c < pieces->cell_count; c++) { // a root comes before its cells
        root[c] = root[root[c]];
        size[root[c]]++;
    }
    for (int c = 0; c < pieces->cell_count; c++)
        pieces->small_count += root[c] == c && size[c] < PIECE_SMALL;
}

// Gives numbers by `first`; false: it names a cell that is not the smallest of its piece, or one
// twice.
static bool take_numbers(CutPieces *pieces)
{
    memset(pieces->number, -1, (size_t)pieces->cell_count * sizeof *pieces->number);
    if (*pieces->count < 0 || *pieces->count > pieces->cell_count)
        return false;
    for (int n = 0; n < (int)*pieces->count; n++) {
        const int cell = pieces->first[n];
        if (cell < 0 || cell >= pieces->cell_count || pieces->root[cell] != cell ||
            pieces->number[cell] >= 0)
            return false;
        pieces->number[cell] = n;
    }
    return true;
}

// Pieces without a number get the next ones. Returns how many.
static int number_new(CutPieces *pieces)
{
    int came = 0;
    for (int c = 0; c < pieces->cell_count; c++)
        if (pieces->root[c] == c && pieces->number[c] < 0) {
            const int n = (int)(*pieces->count)++;
            pieces->first[n] = c;
            pieces->number[c] = n;
            came++;
        }
    return came;
}

bool cut_pieces_derive(CutPieces *pieces)
{
    find_pieces(pieces);
    bool good = take_numbers(pieces);
    if (!good) {
        *pieces->count = 0;
        memset(pieces->number, -1, (size_t)pieces->cell_count * sizeof *pieces->number);
    }
    return number_new(pieces) == 0 && good;
}

// ---------------------------------------------------------------------------------------------
// After new broken faces

typedef enum Answer { JOINED, APART, TOO_LONG } Answer;

// Marks are 2 search + side.
static void enter(CutPieces *pieces, int cell, int side, int *end)
{
    pieces->seen[cell] = 2 * pieces->search + side;
    pieces->queue[side][(*end)++] = cell;
}

static Answer search_between(CutPieces *pieces, int a, int b, int *effort)
{
    if (++pieces->search > INT32_MAX / 2 - 1) {
        memset(pieces->seen, 0, (size_t)pieces->cell_count * sizeof *pieces->seen);
        pieces->search = 1;
    }
    int begin[2] = {0, 0}, end[2] = {0, 0};
    enter(pieces, a, 0, &end[0]);
    enter(pieces, b, 1, &end[1]);
    for (int side = 0; *effort > 0; side ^= 1) {
        if (begin[side] == end[side])
            return APART;
        const int cell = pieces->queue[side][begin[side]++];
        (*effort)--;
        pieces->visited++;
        for (int d = 0; d < 6; d++) {
            const int next = joined_to(pieces->lattice, cell, d);
            if (next < 0 || pieces->seen[next] == 2 * pieces->search + side)
                continue;
            if (pieces->seen[next] == 2 * pieces->search + (side ^ 1))
                return JOINED;
            enter(pieces, next, side, &end[side]);
        }
    }
    return TOO_LONG;
}

static bool are_beside(const CutLattice *lattice, int a, int b)
{
    for (int d = 0; d < 6; d++)
        if (joined_to(lattice, a, d) == b)
            return true;
    return a == b;
}

// Whether the ends of a link hold to those of one of the links before it, whose ends are known to
// hold together.
static bool is_beside_known(const CutLattice *lattice, const int (*face)[2], int f)
{
    const int beyond = cut_lattice_beyond(lattice, face[f][0], face[f][1]);
    for (int g = f - 1; g >= 0 && g >= f - LOOK_BACK; g--)
        if (face[g][1] == face[f][1] && are_beside(lattice, face[f][0], face[g][0]) &&
            are_beside(lattice, beyond, cut_lattice_beyond(lattice, face[g][0], face[g][1])))
            return true;
    return false;
}

bool cut_pieces_follow(CutPieces *pieces, const int (*face)[2], int count)
{
    int effort = EFFORT;
    bool whole = count <= SEARCHES;
    for (int f = 0; f < count && whole; f++) {
        if (is_beside_known(pieces->lattice, face, f))
            continue;
        const int beyond = cut_lattice_beyond(pieces->lattice, face[f][0], face[f][1]);
        whole = search_between(pieces, face[f][0], beyond, &effort) == JOINED;
    }
    if (whole)
        return false;
    find_pieces(pieces);
    return number_new(pieces) > 0;
}

// ---------------------------------------------------------------------------------------------

// A cell of a vertex's elements on the outer side: any, they are all of one piece.
static void number_as_mesh(CutPieces *pieces, const LatticeMesh *mesh, const Layout *layout)
{
    *pieces->count = mesh->piece_count;
    for (int e = 0; e < mesh->element_count; e++) {
        const Leaf *leaf = &layout->leaf[e];
        int cell = cut_lattice_cell(pieces->lattice, leaf->cell[0], leaf->cell[1], leaf->cell[2]);
        pieces->first[mesh->piece[mesh->vertex[e][0]]] = pieces->root[cell];
    }
}

void cut_pieces_create(CutPieces *pieces, const char *name, const CutLattice *lattice,
                       const LatticeMesh *mesh, const Layout *layout, Arena *arena,
                       StateList *state)
{
    const int cells = lattice->level_first[1];
    *pieces = (CutPieces){.lattice = lattice, .cell_count = cells};
    pieces->first = ALLOCATE(cells, int, "first cells of pieces");
    pieces->count = ALLOCATE(1, int64_t, "piece count");
    state_add(state, pieces->first, (size_t)cells * sizeof *pieces->first, "%s/pieces", name);
    state_add(state, pieces->count, sizeof *pieces->count, "%s/piece_count", name);
    pieces->root = ALLOCATE(cells, int, "roots of pieces");
    pieces->number = ALLOCATE(cells, int, "piece numbers");
    pieces->seen = ALLOCATE(cells, int, "searches");
    for (int side = 0; side < 2; side++)
        pieces->queue[side] = ALLOCATE(cells, int, "search queue");
    find_pieces(pieces);
    number_as_mesh(pieces, mesh, layout);
    bool good = cut_pieces_derive(pieces);
    ASSERT(good);
}
