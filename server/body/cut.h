// SPDX-License-Identifier: MIT
// Cuts, as the interface between pipeline and bodies: the blade's edge, its sweep in a tick or a
// command, the memory of a stroke, and the finder of the links that a sweep meets. All models share
// one principle (server/sim/README.md, "Cutting"): a cut is a set of broken links between
// neighbouring pieces of matter, a link breaks when it crosses the edge while both move
// (cut_exact.h), and the sharing of vertices is a pure function of the elements and the broken
// links. A model only offers the links that a sweep may meet. Step thread.
#ifndef PLIANT_BODY_CUT_H
#define PLIANT_BODY_CUT_H

#include "base/memory.h"
#include "body/cut_exact.h"

#include <stddef.h>

// The blade's edge at one time, world frame [m].
typedef struct BladeEdge {
    Vec3 end[2];
} BladeEdge;

typedef enum CutPhase {
    CUT_WHOLE,   // a command: one sweep through still tissue, complete in itself
    CUT_BEGINS,  // a stroke begins at `after`: the body stores the positions of its links
    CUT_GOES_ON, // from `before`, where the last tick ended, to `after`; links have moved too
    CUT_ENDS,    // the blade was lifted: the body does postponed work and forgets the stroke
} CutPhase;

// The shifts used in a stroke; plain data, part of the state (sim's). A shift stays until the
// stroke ends: one that changes with the tick would let a cut change layer.
typedef struct CutStroke {
    int64_t under_way; // 0 or 1
    int64_t tries;     // attempt of cut_shift in use
    BladeEdge edge;    // position when the last tick ended
} CutStroke;

typedef struct CutSweep {
    CutPhase phase;
    BladeEdge before, after;
    int blade;         // [0, blades): index of the memory of links; -1 for a command
    CutStroke *stroke; // NULL of a command
} CutSweep;

typedef enum CutVerdict {
    CUT_DONE,
    CUT_MET_NOTHING, // no link was crossed
    CUT_WAS_CUT,     // all crossed links were broken before
    CUT_NO_NODES,    // needs `needed` node slots, `room` are free: nothing was changed
    CUT_NO_FACES,    // likewise for faces
    CUT_TOO_TWISTED, // would need more than CUT_SUBTICKS_MOST sub-ticks
    CUT_UNRESOLVED,  // degenerate after CUT_TRIES shifts: never observed
    CUT_TOO_LARGE,   // beyond CUT_REACH of the body
} CutVerdict;

typedef struct CutOutcome {
    CutVerdict verdict;
    int separated; // broken links
    int nodes_added;
    int pieces;       // of the body after the cut
    int small_pieces; // those of fewer than 4 cells, or of one face
    int needed, room; // of CUT_NO_NODES, CUT_NO_FACES
} CutOutcome;

enum { CUT_TRIES = 20, CUT_SUBTICKS_MOST = 64 };

// True if a verdict says that a sweep could not be executed, rather than that it crossed nothing.
bool cut_refuses(CutVerdict verdict);
// Writes one sentence on the result of a sweep through the body of this name.
void cut_describe(const CutOutcome *outcome, const char *body, char *text, size_t size);

// Converts a point to units of q, from an origin that never changes; returns false beyond CUT_REACH
// / 4.
bool cut_quantise(Vec3 point, Vec3 origin, double q, CutPoint *out);
bool cut_quantise_edge(const BladeEdge *edge, Vec3 origin, double q, CutPoint out[2]);
// Returns the shift of end `end` (0, 1) of an edge at the `try`-th attempt, in q: none at the
// first, a few after that, different for both; a fixed hash.
CutPoint cut_shift(int64_t attempt, int end);
void cut_shift_edge(CutPoint edge[2], int64_t attempt); // adds both

// Returns the smallest power of two of sub-ticks with which the two triangles of each sub-sweep
// differ from the twisted patch by at most `tolerance` [m]; 0: more than CUT_SUBTICKS_MOST.
int cut_subticks(const CutSweep *sweep, double tolerance);
// Returns the path of a point in sub-tick k of m (a power of two): neighbouring sub-ticks share
// ends.
CutPath cut_part(CutPath whole, int k, int m);

// --- the finder ---

// Where a stroke has come to.
typedef struct CutTrail {
    CutPoint edge[2]; // where the last sweep left it, with its shift
    int64_t tries;    // shift in use; it stays until the stroke ends
    bool fresh;       // no sweep has left it here: it may still be shifted
} CutTrail;

// Marks of links, LINK_BITS for each: met an odd number of times so far; in `met`.
enum { LINK_ODD = 1, LINK_LISTED = 2, LINK_BITS = 2, LINKS_A_BYTE = 8 / LINK_BITS };

// Finds the links that a sweep meets an odd number of times. The sweep is one batch: when a link
// cannot be decided, all of it is tried again with the next shift.
typedef struct LinkFinder {
    // --- constant ---
    Vec3 origin;      // of the integer points [m]
    double q;         // their unit [m]
    double tolerance; // by which the triangles of a sub-tick may differ from the twisted patch [m]
    bool hashed; // commands are always shifted, by a hash of where their edges lie: alike when they
                 // are repeated after the tissue has moved a little
    // --- result of the last sweep ---
    int *met, met_count; // [most] in the order found
    int most;
    bool full;       // more were met
    int64_t attempt; // with which it was decided
    // --- the sweep under way ---
    CutPath edge[2];
    int parts;                           // sub-ticks,
    CutPath piece[CUT_SUBTICKS_MOST][2]; // and the edge in each
    unsigned char *mark;                 // [links / LINKS_A_BYTE] zero between calls
} LinkFinder;

// Passes the links that finder->edge may meet to link_finder_meet, each once or, if it is bent, in
// pieces. False as soon as that returns false.
typedef bool LinkOffer(LinkFinder *finder, void *model);

// Load time: allocates for this many links, of which a sweep meets `most` at most. The arena owns
// the arrays.
void link_finder_create(LinkFinder *finder, int links, int most, const char *name, Arena *arena);
// Returns CUT_DONE if a path of edges can be tested, else CUT_TOO_LARGE or CUT_TOO_TWISTED.
CutVerdict link_finder_check(const LinkFinder *finder, const BladeEdge *edge, int edges);
// Tests what the model offers against the sweeps from edge[0] over all others to edge[edges - 1].
// CUT_DONE, or CUT_UNRESOLVED; then nothing is met. With a trail edge[0] is where that is, and the
// trail moves on.
CutVerdict link_finder_sweep(LinkFinder *finder, const BladeEdge *edge, int edges, CutTrail *trail,
                             LinkOffer *offer, void *model);
// Returns how often a link meets the last sweep of the last call, given again; CUT_DEGENERATE:
// undecided.
int link_finder_again(const LinkFinder *finder, const CutPath path[2]);
// Tests a link, or a piece of one, by its whole path in the tick. False: undecided.
bool link_finder_meet(LinkFinder *finder, int link, const CutPath path[2]);

// To change `met` after a sweep: link_finder_mark_met, link_finder_add for each time that a link is
// met or no longer is, link_finder_keep_odd.
void link_finder_mark_met(LinkFinder *finder);
void link_finder_add(LinkFinder *finder, int link, int count);
void link_finder_keep_odd(LinkFinder *finder);
static inline unsigned link_finder_mark(const LinkFinder *finder, int link)
{
    return (unsigned)finder->mark[link / LINKS_A_BYTE] >> LINK_BITS * (link % LINKS_A_BYTE) &
           (LINK_ODD | LINK_LISTED);
}
// Changes bits of a link's mark.
static inline void link_finder_flip(LinkFinder *finder, int link, unsigned bits)
{
    finder->mark[link / LINKS_A_BYTE] ^= (unsigned char)(bits << LINK_BITS * (link % LINKS_A_BYTE));
}
static inline bool link_finder_is_odd(const LinkFinder *finder, int link)
{
    return link_finder_mark(finder, link) & LINK_ODD;
}

#endif
