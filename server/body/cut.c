// SPDX-License-Identifier: MIT
#include "body/cut.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

bool cut_quantise(Vec3 point, Vec3 origin, double q, CutPoint *out)
{
    const double x[3] = {point.x - origin.x, point.y - origin.y, point.z - origin.z};
    for (int c = 0; c < 3; c++) {
        double units = floor(x[c] / q + 0.5);
        if (!(fabs(units) < 0.25 * (double)CUT_REACH))
            return false;
        out->x[c] = (int64_t)units;
    }
    return true;
}

// Returns a few units, from the low bits of a mixed counter (the finaliser of SplitMix64, Steele et
// al. 2014).
CutPoint cut_shift(int64_t attempt, int end)
{
    CutPoint shift = {{0, 0, 0}};
    for (int c = 0; attempt > 0 && c < 3; c++) {
        uint64_t z = (uint64_t)(6 * attempt + 3 * end + c) * 0x9e3779b97f4a7c15u;
        z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
        z = (z ^ z >> 27) * 0x94d049bb133111ebu;
        z ^= z >> 31;
        shift.x[c] = (int64_t)(z % 15) - 7;
    }
    return shift;
}

bool cut_quantise_edge(const BladeEdge *edge, Vec3 origin, double q, CutPoint out[2])
{
    return cut_quantise(edge->end[0], origin, q, &out[0]) &&
           cut_quantise(edge->end[1], origin, q, &out[1]);
}

void cut_shift_edge(CutPoint edge[2], int64_t attempt)
{
    for (int end = 0; end < 2; end++) {
        const CutPoint shift = cut_shift(attempt, end);
        for (int c = 0; c < 3; c++)
            edge[end].x[c] += shift.x[c];
    }
}

int cut_subticks(const CutSweep *sweep, double tolerance)
{
    Vec3 a = vec3_sub(sweep->after.end[0], sweep->before.end[0]);
    Vec3 b = vec3_sub(sweep->after.end[1], sweep->before.end[1]);
    double twist = 0.25 * vec3_length(vec3_sub(a, b));
    int m = 1;
    while (m <= CUT_SUBTICKS_MOST && twist > tolerance * m)
        m *= 2;
    return m > CUT_SUBTICKS_MOST ? 0 : m;
}

CutPath cut_part(CutPath whole, int k, int m)
{
    CutPath part;
    for (int c = 0; c < 3; c++) {
        int64_t from = whole.at[0].x[c], way = whole.at[1].x[c] - from;
        part.at[0].x[c] = from + way * k / m;
        part.at[1].x[c] = from + way * (k + 1) / m;
    }
    return part;
}

// ---------------------------------------------------------------------------------------------
// The finder

void link_finder_create(LinkFinder *finder, int links, int most, const char *name, Arena *arena)
{
    finder->most = most;
    finder->met = ALLOCATE(ARENA_CONTACT, most, int, "links met");
    finder->mark =
        ALLOCATE(ARENA_CONTACT, links / LINKS_A_BYTE + 1, unsigned char, "marks of links");
}

// Removes the marks of all links that were met.
static void clear_marks(LinkFinder *finder)
{
    for (int i = 0; i < finder->met_count; i++) // of others beside it, too
        finder->mark[finder->met[i] / LINKS_A_BYTE] = 0;
}

CutVerdict link_finder_check(const LinkFinder *finder, const BladeEdge *edge, int edges)
{
    CutPoint point[2];
    for (int k = 0; k < edges; k++)
        if (!cut_quantise_edge(&edge[k], finder->origin, finder->q, point))
            return CUT_TOO_LARGE;
    for (int k = 0; k + 1 < edges; k++) {
        const CutSweep sweep = {.before = edge[k], .after = edge[k + 1]};
        if (cut_subticks(&sweep, finder->tolerance) == 0)
            return CUT_TOO_TWISTED;
    }
    return CUT_DONE;
}

void link_finder_add(LinkFinder *finder, int link, int count)
{
    if (!(link_finder_mark(finder, link) & LINK_LISTED)) {
        finder->full |= finder->met_count == finder->most;
        if (finder->met_count == finder->most)
            return;
        link_finder_flip(finder, link, LINK_LISTED);
        finder->met[finder->met_count++] = link;
    }
    link_finder_flip(finder, link, (unsigned)count & LINK_ODD);
}

void link_finder_mark_met(LinkFinder *finder)
{
    for (int i = 0; i < finder->met_count; i++)
        link_finder_flip(finder, finder->met[i], LINK_ODD | LINK_LISTED);
}

void link_finder_keep_odd(LinkFinder *finder)
{
    int kept = 0;
    for (int i = 0; i < finder->met_count; i++) {
        const int link = finder->met[i];
        const unsigned mark = link_finder_mark(finder, link);
        if (mark & LINK_ODD)
            finder->met[kept++] = link;
        link_finder_flip(finder, link, mark);
    }
    finder->met_count = kept;
}

// Returns how often a link meets the edge in all sub-ticks, or CUT_DEGENERATE.
static int count_link(const LinkFinder *finder, const CutPath path[2])
{
    const CutPath(*piece)[2] = finder->piece;
    if (finder->parts == 1)
        return cut_may_meet(piece[0], path) ? cut_count(piece[0], path) : 0;
    int sum = 0;
    for (int k = 0; k < finder->parts; k++) {
        if (cut_boxes_apart(piece[k], path)) // a part of the link lies in the box of the whole
            continue;
        const CutPath link[2] = {cut_part(path[0], k, finder->parts),
                                 cut_part(path[1], k, finder->parts)};
        const int count = cut_may_meet(piece[k], link) ? cut_count(piece[k], link) : 0;
        if (count == CUT_DEGENERATE)
            return CUT_DEGENERATE;
        sum += count;
    }
    return sum;
}

bool link_finder_meet(LinkFinder *finder, int link, const CutPath path[2])
{
    const int count = count_link(finder, path);
    if (count > 0)
        link_finder_add(finder, link, count);
    return count != CUT_DEGENERATE;
}

// Quantises and shifts an edge. One of a command that is hashed has the same shift in all sweeps
// that it belongs to: of a loop, or of successive commands.
static void place_edge(const LinkFinder *finder, const BladeEdge *edge, bool command,
                       int64_t attempt, CutPoint out[2])
{
    cut_quantise_edge(edge, finder->origin, finder->q, out);
    if (command && finder->hashed) {
        uint64_t hash = (uint64_t)attempt + 1;
        for (int end = 0; end < 2; end++)
            for (int c = 0; c < 3; c++) { // FNV-1a, by words
                hash = (hash ^ (uint64_t)out[end].x[c]) * UINT64_C(0x100000001b3);
                hash ^= hash >> 29;
            }
        attempt = 1 + (int64_t)(hash >> 8 & 0xffffffff);
    }
    cut_shift_edge(out, attempt);
}

// Offers all sweeps at one attempt; `to`: where the last one ends. False: undecided.
static bool try_shift(LinkFinder *finder, const BladeEdge *edge, int edges, const CutTrail *trail,
                      CutPoint to[2], LinkOffer *offer, void *model)
{
    // A stroke goes on from where it is, which already has its shift unless it is fresh.
    CutPoint from[2];
    if (trail == NULL) {
        place_edge(finder, &edge[0], true, finder->attempt, from);
    } else {
        memcpy(from, trail->edge, sizeof from);
        if (trail->fresh)
            cut_shift_edge(from, finder->attempt);
    }
    for (int k = 1; k < edges; k++) {
        place_edge(finder, &edge[k], trail == NULL, finder->attempt, to);
        // Divide the sweep from edge to edge, and have its links tested.
        const CutSweep sweep = {.before = edge[k - 1], .after = edge[k]};
        finder->parts = cut_subticks(&sweep, finder->tolerance);
        for (int end = 0; end < 2; end++) {
            finder->edge[end] = (CutPath){{from[end], to[end]}};
            for (int part = 0; part < finder->parts; part++)
                finder->piece[part][end] = cut_part(finder->edge[end], part, finder->parts);
        }
        if (!offer(finder, model))
            return false;
        memcpy(from, to, sizeof from);
    }
    return true;
}

CutVerdict link_finder_sweep(LinkFinder *finder, const BladeEdge *edge, int edges, CutTrail *trail,
                             LinkOffer *offer, void *model)
{
    const int64_t first = trail != NULL ? trail->tries : 0;
    finder->met_count = 0;
    finder->full = false;
    for (finder->attempt = first; finder->attempt <= first + CUT_TRIES; finder->attempt++) {
        CutPoint to[2];
        if (try_shift(finder, edge, edges, trail, to, offer, model)) {
            if (trail != NULL)
                *trail = (CutTrail){{to[0], to[1]}, finder->attempt, false};
            link_finder_keep_odd(finder);
            return CUT_DONE;
        }
        // Forget what this attempt has met.
        clear_marks(finder);
        finder->met_count = 0;
    }
    return CUT_UNRESOLVED;
}

int link_finder_again(const LinkFinder *finder, const CutPath path[2])
{
    return count_link(finder, path); // its sub-ticks are still there
}

// ---------------------------------------------------------------------------------------------
// Sentences

bool cut_refuses(CutVerdict verdict)
{
    return verdict != CUT_DONE && verdict != CUT_MET_NOTHING && verdict != CUT_WAS_CUT;
}

static const char *plural(int count)
{
    return count == 1 ? "" : "s";
}

void cut_describe(const CutOutcome *outcome, const char *body, char *text, size_t size)
{
    switch (outcome->verdict) {
    case CUT_DONE: {
        char small[48] = "";
        if (outcome->small_pieces > 0)
            snprintf(small, sizeof small, ", %d of them tiny", outcome->small_pieces);
        snprintf(text, size, "body '%s': %d link%s severed, %d node%s added, %d piece%s%s", body,
                 outcome->separated, plural(outcome->separated), outcome->nodes_added,
                 plural(outcome->nodes_added), outcome->pieces, plural(outcome->pieces), small);
        return;
    }
    case CUT_MET_NOTHING:
        snprintf(text, size, "the blade met no tissue of body '%s'", body);
        return;
    case CUT_WAS_CUT:
        snprintf(text, size, "what the blade met of body '%s' was cut already", body);
        return;
    case CUT_NO_NODES:
    case CUT_NO_FACES: {
        const char *what = outcome->verdict == CUT_NO_NODES ? "nodes" : "faces";
        snprintf(text, size,
                 "body '%s' may need %d more %s and has space for %d: raise capacity.%s", body,
                 outcome->needed, what, outcome->room, what);
        return;
    }
    case CUT_TOO_TWISTED:
        snprintf(
            text, size,
            "the sweep is too twisted for body '%s' (more than %d parts): cut in shorter steps",
            body, CUT_SUBTICKS_MOST);
        return;
    case CUT_UNRESOLVED:
        snprintf(text, size,
                 "body '%s': the side of a link could not be determined after %d shifts", body,
                 CUT_TRIES);
        return;
    case CUT_TOO_LARGE:
        snprintf(text, size, "the sweep reaches too far away from body '%s'", body);
        return;
    }
}
