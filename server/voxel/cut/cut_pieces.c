// Whether cells still hold together. Two searches from both sides of a broken link, which stop when
// they meet, tell nearly always at the cost of the few cells around it. What they have seen holds
// together, so the links beside it, which broke with it, are told by looking. When one of them runs
// dry it has seen a piece of its own.
#include "voxel/cut/cut_pieces.h"

#include "base/check.h"

#include <string.h>

#define ALLOCATE(count, type, label)                                                               \
    (type *)arena_allocate(arena, ARENA_TOPOLOGY, (size_t)(count), sizeof(type), "%s/%s", name,    \
                           label)

enum {
    LINKS = 1024,   // in one call, beyond which everything is numbered anew
    EFFORT = 20000, // cells that the searches of one call may visit before that
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
    int *size = pieces->size;
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

// A set of cells that is known to hold together, by the label of what was seen first; -1: none.
// Labels of earlier calls are below `first_label`.
static int set_of(CutPieces *pieces, int cell)
{
    int *set = pieces->set, label = pieces->seen[cell] - pieces->first_label;
    if (label < 0)
        return -1;
    while (set[label] != label) {
        set[label] = set[set[label]];
        label = set[label];
    }
    return label;
}

// A search from one side of a link: the cells that it has found, those before `begin` looked at.
typedef struct Search {
    int *cell, begin, end;
    int label;
    bool open; // has not come to cells that were seen before
} Search;

static void enter(CutPieces *pieces, Search *search, int cell)
{
    pieces->seen[cell] = pieces->first_label + search->label;
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

// Looks at one more cell, as long as that leads to no other set.
static void go_on(CutPieces *pieces, Search *search)
{
    const int cell = search->cell[search->begin++];
    pieces->visited++;
    for (int d = 0; d < 6; d++) {
        const int next = joined_to(pieces->lattice, cell, d);
        if (next < 0)
            continue;
        const int own = set_of(pieces, cell), other = set_of(pieces, next);
        if (other < 0) {
            enter(pieces, search, next);
        } else if (other != own) {
            pieces->set[own] = other;
            search->open = false;
        }
    }
}

// Whether the two ends of a link hold together. APART: search[*side] has seen a whole piece.
static Answer search_between(CutPieces *pieces, int a, int b, Search search[2], int *side,
                             int *effort)
{
    begin_search(pieces, &search[0], pieces->queue[0], a);
    begin_search(pieces, &search[1], pieces->queue[1], b);
    for (*side = 0; *effort > 0; *side ^= 1) {
        if (set_of(pieces, a) == set_of(pieces, b))
            return JOINED;
        if (!search[0].open && !search[1].open)
            return TOO_LONG; // two sets from elsewhere
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

static int is_small(int size)
{
    return size > 0 && size < PIECE_SMALL;
}

// A piece that was found whole leaves the one it was part of, on the other side of a link from
// `rest`.
static void separate(CutPieces *pieces, const Search *piece, int rest)
{
    int *root = pieces->root, *size = pieces->size;
    const int old = root[rest], old_size = size[old];
    int lowest = piece->cell[0], name = old;
    for (int i = 0; i < piece->end; i++)
        lowest = piece->cell[i] < lowest ? piece->cell[i] : lowest;
    for (int i = 0; i < piece->end; i++)
        root[piece->cell[i]] = -1;
    if (lowest == old) { // it keeps the name: the others need another
        name = -1;
        for (int c = 0; c < pieces->cell_count; c++)
            if (root[c] == old) {
                name = name < 0 ? c : name;
                root[c] = name;
            }
    }
    for (int i = 0; i < piece->end; i++)
        root[piece->cell[i]] = lowest;
    size[lowest] = piece->end;
    size[name] = old_size - piece->end;
    pieces->small_count += is_small(size[lowest]) + is_small(size[name]) - is_small(old_size);
    pieces->rest[lowest] = rest;
    pieces->left[pieces->left_count++] = lowest;
}

// Whatever leads to a piece that has left must lead to what it has left.
static int what_is_left(const CutPieces *pieces, int cell)
{
    while (pieces->rest[pieces->root[cell]] >= 0)
        cell = pieces->rest[pieces->root[cell]];
    return cell;
}

static void begin_call(CutPieces *pieces)
{
    if (pieces->first_label > INT32_MAX - 4 * LINKS) {
        memset(pieces->seen, 0, (size_t)pieces->cell_count * sizeof *pieces->seen);
        pieces->first_label = 0;
        pieces->labels = 1; // 0: never seen
    }
    pieces->first_label += pieces->labels;
    pieces->labels = 0;
}

bool cut_pieces_follow(CutPieces *pieces, const int (*face)[2], int count)
{
    int effort = EFFORT, side = 0;
    bool told = count <= LINKS;
    begin_call(pieces);
    for (int f = 0; f < count && told; f++) {
        const int beyond = cut_lattice_beyond(pieces->lattice, face[f][0], face[f][1]);
        const int end[2] = {what_is_left(pieces, face[f][0]), what_is_left(pieces, beyond)};
        if (end[0] == end[1])
            continue;
        Search search[2];
        const Answer answer = search_between(pieces, end[0], end[1], search, &side, &effort);
        told = answer != TOO_LONG;
        if (answer == APART)
            separate(pieces, &search[side], end[side ^ 1]);
    }
    const bool came = pieces->left_count > 0 || !told;
    for (int i = 0; i < pieces->left_count; i++)
        pieces->rest[pieces->left[i]] = -1;
    pieces->left_count = 0;
    if (!told)
        find_pieces(pieces);
    return came && number_new(pieces) > 0;
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
    pieces->set = ALLOCATE(2 * LINKS, int, "sets of searches");
    pieces->size = ALLOCATE(cells, int, "sizes of pieces");
    pieces->rest = ALLOCATE(cells, int, "what pieces left");
    memset(pieces->rest, -1, (size_t)cells * sizeof *pieces->rest);
    pieces->left = ALLOCATE(LINKS, int, "pieces that left");
    pieces->labels = 1;
    for (int side = 0; side < 2; side++)
        pieces->queue[side] = ALLOCATE(cells, int, "search queue");
    find_pieces(pieces);
    number_as_mesh(pieces, mesh, layout);
    bool good = cut_pieces_derive(pieces);
    ASSERT(good);
}
