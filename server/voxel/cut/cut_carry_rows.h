// SPDX-License-Identifier: MIT
// Finds where the carried vertices of one element are: part of cut_carry.c, which includes it
// once for each precision with REAL, PART (a vector of 16 bytes of it: wider ones pass through
// memory where there are none), FILL, PUT, UPDATE and SHOW, names of its
// own. `parts` of a row are wanted: all, or the half that is a place.

#define PARTS       (ROW * sizeof(REAL) / sizeof(PART))
#define JOIN_(a, b) a##b
#define JOIN(a, b)  JOIN_(a, b)
#define SHOW_PARTS  JOIN(SHOW, _parts)
#define SHOW_ALL    JOIN(SHOW, _all)
#define FOUR        JOIN(SHOW, _four)

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
static inline __attribute__((always_inline)) void
PUT(PART (*point)[PARTS], const CarrySite *site, const float (*weight)[4], size_t parts, REAL *to)
{
    const float *of = weight[site->shares];
    const REAL w[4] = {(REAL)of[0], (REAL)of[1], (REAL)of[2], (REAL)of[3]};
    PART(*a)[PARTS] = &point[site->at[0]], (*b)[PARTS] = &point[site->at[1]];
    PART(*c)[PARTS] = &point[site->at[2]], (*d)[PARTS] = &point[site->at[3]];
    for (size_t k = 0; k < parts; k++) {
        PART value = (w[0] * a[0][k] + w[1] * b[0][k]) + (w[2] * c[0][k] + w[3] * d[0][k]);
        if (__builtin_expect(site->third > 0, 0)) {
            const int z = site->above;
            const PART above =
                (w[0] * a[z][k] + w[1] * b[z][k]) + (w[2] * c[z][k] + w[3] * d[z][k]);
            value += (REAL)1.0 / CARRY_SHARES * (REAL)site->third * (above - value);
        }
        memcpy((PART *)to + k, &value, sizeof value);
    }
}

static void UPDATE(const CutCarry *carry, int leaf, const REAL *row)
{
    REAL *to = carry->row;
    PART point[POINTS][PARTS] = {{{0}}};
    const int at = leaf - carry->lattice->level_first[1];
    const unsigned need = carry->need[cut_lattice_row(carry->lattice, leaf)];
    FILL(cut_lattice_nodes(carry->lattice, leaf), row, need, PARTS, point);
    const float(*weight)[4] = (const float(*)[4])carry->weight;
    for (int k = carry->first[at]; k < carry->end[at]; k++)
        if (carry->site[k].at[0] >= 0)
            PUT(point, &carry->site[k], weight, PARTS, to + (long)carry->vertex[k] * ROW);
}

static inline __attribute__((always_inline)) void FOUR(const REAL *from, Four *to)
{
    REAL part __attribute__((vector_size(4 * sizeof(REAL))));
    memcpy(&part, from, sizeof part);
    *to = __builtin_convertvector(part, Four);
}

static inline __attribute__((always_inline)) void SHOW_PARTS(const CutCarry *carry, size_t parts,
                                                             bool displaced, bool turned,
                                                             const int *to, float *position,
                                                             float *velocity)
{
    const CutLattice *lattice = carry->lattice;
    const REAL *row = vertices_row(carry->vertices);
    PART point[POINTS][PARTS] = {{{0}}}; // points that an element lacks have no weight
    double at_rest[3][EDGE_POINTS];
    RowsView view;
    rows_view(&carry->vertices->rows, &view);
    // By themselves, since what is written could be them.
    const CarrySite *sites = carry->site;
    const int *vertices = carry->vertex;
    const float(*weight)[4] = (const float(*)[4])carry->weight;
    for (int n = 0; n < carry->leaf_count; n++) {
        const int leaf = carry->leaf[n], at = leaf - lattice->level_first[1], end = carry->end[at];
        const unsigned need = carry->need[cut_lattice_row(lattice, leaf)];
        FILL(cut_lattice_nodes(lattice, leaf), row, need, parts, point);
        find_rest(carry, leaf, at_rest);
        for (int k = carry->first[at]; k < end; k++) {
            // What is written is scattered: fetch ahead.
            __builtin_prefetch(&to[vertices[k + 2 * AHEAD]]);
            __builtin_prefetch(position + 3L * to[vertices[k + AHEAD]], 1);
            const CarrySite *site = &sites[k];
            if (site->at[0] < 0)
                continue;
            const double rest[3] = {at_rest[0][site->cell[0]], at_rest[1][site->cell[1]],
                                    at_rest[2][site->cell[2]]};
            const long place = 3L * to[vertices[k]];
            REAL own[ROW];
            Four x, v;
            PUT(point, site, weight, parts, own);
            FOUR(own, &x);
            rows_show_place(&view, displaced, turned, rest, &x, position + place, false);
            if (velocity == NULL)
                continue;
            FOUR(own + ROW / 2, &v);
            rows_show_velocity(&view, turned, &v, velocity + place, false);
        }
    }
}

static inline __attribute__((always_inline)) void SHOW_ALL(const CutCarry *carry, bool displaced,
                                                           bool turned, const int *to,
                                                           float *position, float *velocity)
{
    if (velocity == NULL)
        SHOW_PARTS(carry, PARTS / 2, displaced, turned, to, position, NULL);
    else
        SHOW_PARTS(carry, PARTS, displaced, turned, to, position, velocity);
}

static void SHOW(const CutCarry *carry, const int *to, float *position, float *velocity)
{
    const Rows *rows = &carry->vertices->rows;
    if (rows->turned)
        SHOW_ALL(carry, true, true, to, position, velocity);
    else if (rows->displaced)
        SHOW_ALL(carry, true, false, to, position, velocity);
    else
        SHOW_ALL(carry, false, false, to, position, velocity);
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
#undef SHOW_ALL
#undef FOUR
