// Cuts, as the pipeline asks for them and bodies answer: the blade's edge, what it sweeps in a tick
// or a command, the memory of a stroke. One idea carries both models (cutting.md): a cut is a set
// of broken links between neighbouring pieces of matter, a link breaks when it meets the edge while
// both move (cut_exact.h), and who shares which vertex is a pure function of the elements and the
// broken links. Step thread.
#ifndef PLIANT_DYNAMICS_CUT_H
#define PLIANT_DYNAMICS_CUT_H

#include "dynamics/cut_exact.h"

#include <stddef.h>

// The blade's edge at one time, world [m].
typedef struct BladeEdge {
    Vec3 end[2];
} BladeEdge;

typedef enum CutPhase {
    CUT_WHOLE,   // a command: one sweep through still tissue, complete in itself
    CUT_BEGINS,  // a stroke begins at `after`: the body remembers where its links are
    CUT_GOES_ON, // from `before`, where the last tick ended, to `after`; links have moved too
    CUT_ENDS,    // the blade was lifted: what the body had put off is done, and it forgets
} CutPhase;

// What the shifts of a stroke have come to; plain data, part of the state (sim's). A shift stays
// until the stroke ends: one that changes with the tick would let a cut change layer.
typedef struct CutStroke {
    int64_t under_way; // 0 or 1
    int64_t tries;     // of cut_shift, the one in use
    BladeEdge edge;    // where it was when the last tick ended
} CutStroke;

typedef struct CutSweep {
    CutPhase phase;
    BladeEdge before, after;
    int blade;         // [0, blades): whose memory of links; -1 of a command
    CutStroke *stroke; // NULL of a command
} CutSweep;

typedef enum CutVerdict {
    CUT_DONE,
    CUT_MET_NOTHING, // no link was met
    CUT_WAS_CUT,     // those that were met were broken before
    CUT_NO_NODES,    // `needed` places for nodes, `room` are free: nothing was changed
    CUT_NO_FACES,    // likewise for faces
    CUT_TOO_TWISTED, // would need more than CUT_SUBTICKS_MOST sub-ticks
    CUT_UNRESOLVED,  // degenerate after CUT_TRIES shifts: never seen
    CUT_TOO_LARGE,   // beyond CUT_REACH of the body
} CutVerdict;

typedef struct CutOutcome {
    CutVerdict verdict;
    int separated; // links that broke
    int nodes_added;
    int pieces;       // of the body now
    int small_pieces; // of them, of fewer than 4 cells, or of one face
    int needed, room; // of CUT_NO_NODES, CUT_NO_FACES
} CutOutcome;

enum { CUT_TRIES = 20, CUT_SUBTICKS_MOST = 64 };

// Whether a verdict says that a sweep could not be done, not just that it met nothing.
bool cut_refuses(CutVerdict verdict);
// One sentence on what became of a sweep through the body of this name.
void cut_describe(const CutOutcome *outcome, const char *body, char *text, size_t size);

// A point in units of q, from an origin that never changes; false: beyond CUT_REACH / 4.
bool cut_quantise(Vec3 point, Vec3 origin, double q, CutPoint *out);
// By how much to shift end `end` (0, 1) of an edge at the `try`-th attempt, in q: none at the
// first, a few after that, different for both; a fixed hash.
CutPoint cut_shift(int64_t attempt, int end);
// The smallest power of two of sub-ticks after which the two triangles of each sub-sweep differ
// from the twisted patch by at most `tolerance` [m]; 0: more than CUT_SUBTICKS_MOST.
int cut_subticks(const CutSweep *sweep, double tolerance);
// The path of a point in sub-tick k of m (a power of two): neighbouring sub-ticks share their ends.
CutPath cut_part(CutPath whole, int k, int m);

#endif
