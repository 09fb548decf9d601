#include "dynamics/cut.h"

#include <math.h>
#include <stdio.h>

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
