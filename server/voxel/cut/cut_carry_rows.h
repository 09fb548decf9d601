// SPDX-License-Identifier: MIT
// Updates the rows of the carried vertices of one element: part of cut_carry.c, which includes it
// once for each precision with REAL, NUMBERS (a vector of the ROW numbers of a row), FILL, MIX and
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

// Interpolates between the points of a site, from its own low corner or that above.
static inline void MIX(const NUMBERS *low, const CarrySite *site, NUMBERS *value)
{
    const REAL by = (REAL)1.0 / (CARRY_SHARES * CARRY_SHARES);
    const REAL a = (REAL)site->share[0], b = (REAL)site->share[1], all = (REAL)CARRY_SHARES;
    // No branch: sites differ more than they repeat.
    const NUMBERS *along = low + site->step[0], *beyond = low + site->step[1];
    *value = by * ((all - b) * ((all - a) * low[0] + a * along[0]) +
                   b * ((all - a) * beyond[0] + a * beyond[site->step[0]]));
}

static void UPDATE(const CutCarry *carry, int leaf, REAL *row)
{
    NUMBERS point[POINTS] = {{0}};
    const int at = leaf - carry->lattice->level_first[1];
    FILL(cut_lattice_nodes(carry->lattice, leaf), row, carry->need[at], point);
    for (int k = carry->first[at]; k < carry->end[at]; k++) {
        const int v = carry->vertex[k];
        if (carry->leaf_of[v] < 0)
            continue;
        const CarrySite *site = &carry->site[k];
        NUMBERS value;
        MIX(&point[site->low], site, &value);
        if (site->third > 0) { // inside of an octant
            NUMBERS above;
            MIX(&point[site->low + site->above], site, &above);
            value += (REAL)site->third / (REAL)CARRY_SHARES * (above - value);
        }
        memcpy(row + (long)v * ROW, &value, sizeof value);
    }
}

#undef REAL
#undef NUMBERS
#undef FILL
#undef MIX
#undef UPDATE
