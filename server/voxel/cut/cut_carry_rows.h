// SPDX-License-Identifier: MIT
// Updates the rows of the carried vertices of one element: part of cut_carry.c, which includes it
// once for each precision with REAL, NUMBERS (a vector of the ROW numbers of a row), FILL, PUT and
// UPDATE, names of its own.

// Reads the rows of an element's vertices, and fills in absent points that are needed.
static inline void FILL(const int *node, const REAL *row, unsigned need, NUMBERS point[POINTS])
{
    for (int n = 0; n < NODE_COUNT; n++)
        if (node[n] >= 0)
            memcpy(&point[n < NODE_CORNERS ? CORNER_AT[n] : MIDDLE[n - NODE_CORNERS].at],
                   row + (long)node[n] * ROW, sizeof *point);
    // Edges before faces.
    for (unsigned left = need & ((1u << MIDDLES) - 1); left != 0; left &= left - 1) {
        const int m = __builtin_ctz(left);
        NUMBERS *to = &point[MIDDLE[m].at];
        const int a = STEP[MIDDLE[m].a], b = STEP[MIDDLE[m].b];
        if (node[NODE_CORNERS + m] >= 0)
            continue;
        if (m < EDGES)
            *to = (REAL)0.5 * (to[-a] + to[a]);
        else
            *to = (REAL)0.25 * ((to[-a] + to[a]) + (to[-b] + to[b]));
    }
    if (need >> MIDDLES & 1)
        point[CENTRE] = (REAL)0.125 * (((point[0] + point[2]) + (point[6] + point[8])) +
                                       ((point[18] + point[20]) + (point[24] + point[26])));
}

// Interpolates along the axes on which a site is between points.
static inline void PUT(const NUMBERS *low, const unsigned char share[3], REAL *to)
{
    const REAL by = (REAL)1.0 / CARRY_SHARES;
    const REAL x = by * (REAL)share[0], y = by * (REAL)share[1], z = by * (REAL)share[2];
    NUMBERS value = low[0];
    if (share[0] > 0)
        value += x * (low[1] - value);
    if (share[1] > 0) {
        NUMBERS other = low[3];
        if (share[0] > 0)
            other += x * (low[4] - other);
        value += y * (other - value);
    }
    if (share[2] > 0) {
        NUMBERS other = low[9];
        if (share[0] > 0)
            other += x * (low[10] - other);
        if (share[1] > 0) {
            NUMBERS last = low[12];
            if (share[0] > 0)
                last += x * (low[13] - last);
            other += y * (last - other);
        }
        value += z * (other - value);
    }
    memcpy(to, &value, sizeof value);
}

static void UPDATE(const CutCarry *carry, int leaf, REAL *row)
{
    NUMBERS point[POINTS];
    const int at = leaf - carry->lattice->level_first[1];
    FILL(cut_lattice_nodes(carry->lattice, leaf), row, carry->need[at], point);
    for (int v = carry->first[at]; v >= 0; v = carry->next[v])
        PUT(&point[carry->site[v].low], carry->site[v].share, row + (long)v * ROW);
}

#undef REAL
#undef NUMBERS
#undef FILL
#undef PUT
#undef UPDATE
