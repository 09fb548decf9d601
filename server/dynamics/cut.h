// Cuts, as the interface between pipeline and bodies: the blade's edge, its sweep in a tick or a
// command, the memory of a stroke. Both models share one principle (README.md, "Cutting"): a cut is
// a set of broken links between neighbouring pieces of matter, a link breaks when it crosses the
// edge while both move (cut_exact.h), and the sharing of vertices is a pure function of the
// elements and the broken links. Step thread.
#ifndef PLIANT_DYNAMICS_CUT_H
#define PLIANT_DYNAMICS_CUT_H

#include "dynamics/cut_exact.h"

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

#endif
