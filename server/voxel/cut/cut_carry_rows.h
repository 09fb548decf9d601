// SPDX-License-Identifier: MIT
// Finds where the carried vertices of one element are: part of cut_carry.c, which includes it
// once for each precision with REAL, PART (a vector of 16 bytes of it: wider ones pass through
// memory where there are none), FILL, PUT, UPDATE and SHOW, names of its
// own. `parts` of a row are wanted: all, or the half that is a place.

#define PARTS       (ROW * sizeof(REAL) / sizeof(PART))
#define JOIN_(a, b) a##b
#define JOIN(a, b)  JOIN_(a, b)
#define SHOW_PARTS  JOIN(SHOW, _parts)

// Reads the rows of an element's vertices, and fills in absent points that are needed.
static inline __attribute__((always_inline)) void
FILL(const int *node, const REAL *row, unsigned need, size_t parts, PART (*point)[PARTS])
{
    for (int n = 0; n < NODE_COUNT; n++)
        if (node[n] >= 0)
            memcpy(point[n < NODE_CORNERS ? CORNER_AT[n] : MIDDLE[n - NODE_CORNERS].at],
                   row + (long)node[n] * ROW, sizeof *point);
    // Edges before faces.
    for (unsigned left = need & ((1u << MIDDLES) - 1); left != 0; left &= left - 1) {
        const int m = __builtin_ctz(left);
        PART(*to)[PARTS] = &point[MIDDLE[m].at];
        const int a = STEP[MIDDLE[m].a], b = STEP[MIDDLE[m].b];
        if (node[NODE_CORNERS + m] >= 0)
            continue;
        for (size_t k = 0; k < parts && m < EDGES; k++)
            to[0][k] = (REAL)0.5 * (to[-a][k] + to[a][k]);
        for (size_t k = 0; k < parts && m >= EDGES; k++)
            to[0][k] = (REAL)0.25 * ((to[-a][k] + to[a][k]) + (to[-b][k] + to[b][k]));
    }
    for (size_t k = 0; k < parts && (need >> MIDDLES & 1); k++)
        point[CENTRE][k] =
            (REAL)0.125 * (((point[0][k] + point[2][k]) + (point[6][k] + point[8][k])) +
                           ((point[18][k] + point[20][k]) + (point[24][k] + point[26][k])));
}

// Interpolates between the points of a site, without a branch: sites differ more than they repeat.
// Inside of an octant once more, with the points above.
static inline __attribute__((always_inline)) void PUT(PART (*point)[PARTS], const CarrySite *site,
                                                      size_t parts, REAL *to)
{
    const REAL by = (REAL)1.0 / CARRY_SHARES;
    const REAL a = by * (REAL)site->share[0], b = by * (REAL)site->share[1];
    const REAL w[4] = {((REAL)1.0 - a) * ((REAL)1.0 - b), a * ((REAL)1.0 - b), ((REAL)1.0 - a) * b,
                       a * b};
    PART(*low)[PARTS] = &point[site->low];
    const int x = site->step[0], y = site->step[1], z = site->above;
    for (size_t k = 0; k < parts; k++) {
        PART value =
            (w[0] * low[0][k] + w[1] * low[x][k]) + (w[2] * low[y][k] + w[3] * low[x + y][k]);
        if (__builtin_expect(site->third > 0, 0)) {
            const PART above = (w[0] * low[z][k] + w[1] * low[x + z][k]) +
                               (w[2] * low[y + z][k] + w[3] * low[x + y + z][k]);
            value += by * (REAL)site->third * (above - value);
        }
        memcpy((PART *)to + k, &value, sizeof value);
    }
}

static void UPDATE(const CutCarry *carry, int leaf, const REAL *row)
{
    REAL *to = carry->row;
    PART point[POINTS][PARTS] = {{{0}}};
    const int at = leaf - carry->lattice->level_first[1];
    FILL(cut_lattice_nodes(carry->lattice, leaf), row, carry->need[at], PARTS, point);
    for (int k = carry->first[at]; k < carry->end[at]; k++)
        if (carry->site[k].low >= 0)
            PUT(point, &carry->site[k], PARTS, to + (long)carry->vertex[k] * ROW);
}

static inline __attribute__((always_inline)) void
SHOW_PARTS(const CutCarry *carry, const int *to, size_t parts, float *position, float *velocity)
{
    const CutLattice *lattice = carry->lattice;
    const Rows *rows = &carry->vertices->rows;
    const REAL *row = vertices_row(carry->vertices);
    REAL own[TOGETHER][ROW];
    int vertex[TOGETHER], place[TOGETHER], count = 0;
    for (int n = 0; n < carry->leaf_count; n++) {
        const int leaf = carry->leaf[n], at = leaf - lattice->level_first[1];
        PART point[POINTS][PARTS] = {{{0}}};
        FILL(cut_lattice_nodes(lattice, leaf), row, carry->need[at], parts, point);
        for (int k = carry->first[at]; k < carry->end[at]; k++) {
            // All is scattered but the sites: fetch ahead.
            __builtin_prefetch(&to[carry->vertex[k + AHEAD < carry->vertex_count ? k + AHEAD : k]]);
            if (carry->site[k].low < 0)
                continue;
            if (count == TOGETHER) {
                rows_snapshot_some(rows, own, vertex, place, count, position, velocity);
                count = 0;
            }
            vertex[count] = carry->vertex[k];
            place[count] = to[vertex[count]];
            __builtin_prefetch(rows->rest[vertex[count]]);
            __builtin_prefetch(position + 3L * place[count], 1);
            PUT(point, &carry->site[k], parts, own[count++]);
        }
    }
    rows_snapshot_some(rows, own, vertex, place, count, position, velocity);
}

static void SHOW(const CutCarry *carry, const int *to, float *position, float *velocity)
{
    if (velocity == NULL)
        SHOW_PARTS(carry, to, PARTS / 2, position, NULL);
    else
        SHOW_PARTS(carry, to, PARTS, position, velocity);
}

#undef PARTS
#undef JOIN
#undef JOIN_
#undef REAL
#undef PART
#undef FILL
#undef PUT
#undef UPDATE
#undef SHOW
#undef SHOW_PARTS
