// SPDX-License-Identifier: MIT
// Rest shapes of cubes with hanging vertices: area vectors and weights, in numbers for the kernels,
// and cached.
#include "voxel/template.h"

#include "voxel/batch.h"

#include <math.h>

// ---------------------------------------------------------------------------------------------
// Templates. Load time

const signed char NODE_OFFSET[NODE_COUNT][3] = {
    // corners
    {0, 0, 0},
    {2, 0, 0},
    {0, 2, 0},
    {2, 2, 0},
    {0, 0, 2},
    {2, 0, 2},
    {0, 2, 2},
    {2, 2, 2},
    // middles of edges along x, y, z
    {1, 0, 0},
    {1, 2, 0},
    {1, 0, 2},
    {1, 2, 2},
    {0, 1, 0},
    {2, 1, 0},
    {0, 1, 2},
    {2, 1, 2},
    {0, 0, 1},
    {2, 0, 1},
    {0, 2, 1},
    {2, 2, 1},
    // middles of the faces -x, +x, -y, +y, -z, +z
    {0, 1, 1},
    {2, 1, 1},
    {1, 0, 1},
    {1, 2, 1},
    {1, 1, 0},
    {1, 1, 2},
};

int node_at_offset(int x, int y, int z)
{
    // x fastest
    static const signed char node[27] = {0,  8,  1,  12, 24, 13, 2, 9,  3,  16, 22, 17, 20, -1,
                                         21, 18, 23, 19, 4,  10, 5, 14, 25, 15, 6,  11, 7};
    const bool inside = x >= 0 && x <= 2 && y >= 0 && y <= 2 && z >= 0 && z <= 2;
    return inside ? node[x + 3 * y + 9 * z] : -1;
}

static Vec3 rest_of(int node)
{
    const signed char *o = NODE_OFFSET[node];
    return vec3(0.5 * (o[0] - 1), 0.5 * (o[1] - 1), 0.5 * (o[2] - 1));
}

// Returns a node's area vector with all 26 present: the surface is 24 squares of edge 1/2, and each
// of a square's four corners gets a quarter of its area vector, exact for fields bilinear on it. On
// a face a corner of the cube meets one square, a mid-edge two, a mid-face four.
static Vec3 full_area(int node)
{
    const signed char *o = NODE_OFFSET[node];
    double area[3];
    for (int d = 0; d < 3; d++) {
        int middles = (o[(d + 1) % 3] == 1) + (o[(d + 2) % 3] == 1);
        area[d] = (o[d] - 1) * (1 << middles) / 16.0;
    }
    return vec3(area[0], area[1], area[2]);
}

// The middle of the cube, beside the nodes: it is never a vertex.
enum { MIDDLE = NODE_COUNT };

// Lists the nodes in whose mean a node without a vertex moves, and returns their number: the nodes
// around it, one step coarser; for the middle of the cube its corners.
static int heirs_of(int node, int heir[8])
{
    int count = 0;
    for (; node == MIDDLE && count < NODE_CORNERS; count++)
        heir[count] = count;
    for (int d = 0; node != MIDDLE && d < 3; d++) {
        const signed char *o = NODE_OFFSET[node];
        for (int end = 0; end <= 2 && o[d] == 1; end += 2) {
            int at[3] = {o[0], o[1], o[2]};
            at[d] = end;
            heir[count++] = node_at_offset(at[0], at[1], at[2]);
        }
    }
    return count;
}

// Distributes the area vector of an absent node, and its weight if there are weights: what it moves
// with gets equal parts.
static void hand_on(Vec3 *area, double *weight, int node)
{
    int heir[8];
    const int count = heirs_of(node, heir);
    for (int i = 0; i < count; i++) {
        area[heir[i]] = vec3_madd(area[heir[i]], 1.0 / count, area[node]);
        if (weight != NULL)
            weight[heir[i]] += weight[node] / count;
    }
}

static bool is_present(unsigned mask, int node)
{
    return node < NODE_CORNERS || (mask >> (node - NODE_CORNERS) & 1);
}

// Hands on what absent nodes have. Faces first: they may distribute to mid-edges that are absent
// too.
static void hand_on_absent(Vec3 *area, double *weight, unsigned mask)
{
    for (int node = NODE_COUNT - 1; node >= NODE_CORNERS; node--)
        if (!is_present(mask, node))
            hand_on(area, weight, node);
}

void template_create(Template *out, unsigned mask)
{
    *out = (Template){.mask = mask, .share = 1.0, .softer = 1.0};
    Vec3 area[NODE_COUNT];
    for (int node = 0; node < NODE_COUNT; node++)
        area[node] = full_area(node);
    hand_on_absent(area, NULL, mask);

    double spread[3] = {0.0, 0.0, 0.0};
    for (int node = 0; node < NODE_COUNT; node++) {
        if (!is_present(mask, node))
            continue;
        int i = out->count++;
        Vec3 rest = rest_of(node);
        out->node[i] = node;
        out->rest[i] = rest;
        out->area[i] = area[node];
        // Eight times the volume of the cone from the middle over the node's part of the surface:
        // sums of powers of two except for the last division.
        double weight = 8.0 * vec3_dot(area[node], rest) / 3.0;
        out->weight[i] = weight;
        spread[0] += weight * rest.x * rest.x;
        spread[1] += weight * rest.y * rest.y;
        spread[2] += weight * rest.z * rest.z;
    }
    for (int d = 0; d < 3; d++)
        out->spread[d] = spread[d];
}

// ---------------------------------------------------------------------------------------------
// Partly filled elements. A point of the cube moves by the trilinear function of the 8 corners of
// its octant, these by the nodes. So a solid cell of volume v gives the corner c of its octant,
// with the function N_c of the cell's middle, as the means over a cell's corners and faces are
// values and slopes there,
//   a_c = v grad N_c,    w_c = 8 / cells N_c,
// and what the corners have that are no vertices is handed on.

enum { PLANES_MOST = 1 << 5 }; // cells along an edge, VOXEL_LEVELS_MAX

// What the solid cells have by node, and how they are spread out.
typedef struct Fill {
    Vec3 area[NODE_COUNT + 1];
    double weight[NODE_COUNT + 1]; // sum 8, once divided by the number of cells
    int cells;
    int plane[3][PLANES_MOST]; // solid cells in each plane across an axis
} Fill;

// Sums the functions of the corners of an octant over its solid cells. Everything but the last
// division is exact: dyadic numbers of few digits.
static void sum_octant(Fill *fill, int level, const uint64_t *solid, int octant, double sum[8])
{
    const int edge = 1 << level, half = edge / 2;
    const int low[3] = {(octant & 1) * half, (octant >> 1 & 1) * half, (octant >> 2) * half};
    const uint64_t row = half < 64 ? ((uint64_t)1 << half) - 1 : ~(uint64_t)0;
    for (int k = 0; k < 8; k++)
        sum[k] = 0.0;
    // Sums of the products of the coordinates in the octant: index 1 of x, 3 of x y and so on.
    for (int z = 0; z < half; z++)
        for (int y = 0; y < half; y++) {
            const int at = ((low[2] + z) * edge + low[1] + y) * edge + low[0];
            int count = 0, places = 0;
            for (uint64_t bits = solid[at / 64] >> at % 64 & row; bits != 0; bits &= bits - 1) {
                const int x = __builtin_ctzll(bits);
                count++;
                places += 2 * x + 1;
                fill->plane[0][low[0] + x]++;
            }
            fill->plane[1][low[1] + y] += count;
            fill->plane[2][low[2] + z] += count;
            fill->cells += count;
            const double v = (y + 0.5) / half, w = (z + 0.5) / half;
            const double first[2] = {count, 0.5 * places / half};
            for (int k = 0; k < 8; k++)
                sum[k] += first[k & 1] * ((k & 2) != 0 ? v : 1.0) * ((k & 4) != 0 ? w : 1.0);
        }
    // A corner's function is the product of x or 1 - x, y or 1 - y, z or 1 - z.
    for (int bit = 1; bit < 8; bit *= 2)
        for (int k = 0; k < 8; k++)
            if ((k & bit) == 0)
                sum[k] -= sum[k | bit];
}

static void sum_cells(Fill *fill, int level, const uint64_t *solid)
{
    const double volume = 1.0 / (double)(1 << 3 * level);
    *fill = (Fill){.cells = 0};
    for (int octant = 0; octant < 8; octant++) {
        double sum[8];
        sum_octant(fill, level, solid, octant, sum);
        for (int c = 0; c < 8; c++) {
            int at = node_at_offset((octant & 1) + (c & 1), (octant >> 1 & 1) + (c >> 1 & 1),
                                    (octant >> 2) + (c >> 2));
            at = at < 0 ? MIDDLE : at;
            // The slope of a corner's function along an axis is that of the edge through it.
            double slope[3];
            for (int d = 0; d < 3; d++)
                slope[d] = ((c >> d & 1) != 0 ? 2.0 : -2.0) * (sum[c] + sum[c ^ 1 << d]);
            fill->area[at] = vec3_madd(fill->area[at], volume, vec3(slope[0], slope[1], slope[2]));
            fill->weight[at] += 8.0 * sum[c];
        }
    }
    for (int node = 0; node <= MIDDLE; node++)
        fill->weight[node] /= fill->cells;
}

// Returns the second moment of the solid cells about their centre along an axis, over their volume.
static double cell_spread(const Fill *fill, int level, int axis)
{
    const double edge = 1.0 / (double)(1 << level);
    double first = 0.0, second = 0.0;
    for (int k = 0; k < 1 << level; k++) {
        const double place = (k + 0.5) * edge;
        first += place * fill->plane[axis][k];
        second += place * place * fill->plane[axis][k];
    }
    first /= fill->cells;
    return second / fill->cells - first * first + edge * edge / 12.0;
}

void template_create_partial(Template *out, unsigned mask, int level, const uint64_t *solid)
{
    Fill fill;
    sum_cells(&fill, level, solid);
    if (fill.cells == 1 << 3 * level) {
        template_create(out, mask);
        return;
    }
    *out = (Template){.mask = mask, .share = fill.cells / (double)(1 << 3 * level), .softer = 1.0};
    hand_on(fill.area, fill.weight, MIDDLE);
    hand_on_absent(fill.area, fill.weight, mask);
    // The centre of mass.
    Vec3 centre = {0.0, 0.0, 0.0};
    for (int node = 0; node < NODE_COUNT; node++)
        if (is_present(mask, node))
            centre = vec3_madd(centre, fill.weight[node] / 8.0, rest_of(node));
    Sym3 spread = {0};
    for (int node = 0; node < NODE_COUNT; node++) {
        if (!is_present(mask, node))
            continue;
        const int i = out->count++;
        out->node[i] = node;
        out->rest[i] = vec3_sub(rest_of(node), centre);
        out->area[i] = fill.area[node];
        out->weight[i] = fill.weight[node];
        spread = sym3_madd(spread, out->weight[i], sym3_outer(1.0, out->rest[i]));
    }
    // Weights at the nodes spread farther than the cells do: so much stiffer would be the residual.
    const double diagonal[3] = {spread.xx, spread.yy, spread.zz};
    for (int d = 0; d < 3; d++) {
        out->spread[d] = diagonal[d];
        out->softer = fmin(out->softer, 24.0 * cell_spread(&fill, level, d) / diagonal[d]);
    }
    double determinant;
    const Sym3 adjugate = sym3_adjugate(spread, &determinant);
    out->inverse = sym3_scale(1.0 / determinant, adjugate);
}

ElementClass template_class(const Template *shape, const ElementClass *whole)
{
    return (ElementClass){.size = whole->size,
                          .mu = shape->share * whole->mu,
                          .lambda = shape->share * whole->lambda,
                          .residual = shape->share * shape->softer * whole->residual,
                          .damping = shape->share * whole->damping,
                          .share = shape->share * whole->share};
}

double template_spread(const Template *shape)
{
    Vec3 mean = {0.0, 0.0, 0.0};
    for (int i = 0; i < shape->count; i++)
        mean = vec3_madd(mean, 1.0 / shape->count, shape->rest[i]);
    double spread = 0.0;
    for (int i = 0; i < shape->count; i++) {
        Vec3 r = vec3_sub(shape->rest[i], mean);
        spread += vec3_dot(r, r);
    }
    return spread;
}

// ---------------------------------------------------------------------------------------------
// Tables of the kernels. Load time, but for voxel_table_put

// One template's table in double precision.
typedef struct Numbers {
    double head[TABLE_HEAD];
    double row[NODE_COUNT][TABLE_ROW];
} Numbers;

static void put(double to[3], Vec3 a)
{
    to[0] = a.x, to[1] = a.y, to[2] = a.z;
}

static void affine_numbers(const Template *template, Numbers *out)
{
    for (int i = 0; i < template->count; i++) {
        const Vec3 rest = template->rest[i];
        const double w = template->weight[i], *m = template->spread;
        const bool whole = template->share == 1.0;
        put(out->row[i], vec3_scale(1.0 / template->share, template->area[i]));
        out->row[i][3] = w;
        put(out->row[i] + 4, rest);
        put(out->row[i] + 7, whole ? vec3(w * rest.x / m[0], w * rest.y / m[1], w * rest.z / m[2])
                                   : vec3_scale(w, sym3_times(template->inverse, rest)));
        out->head[0] += w;
    }
    out->head[1] = 1.0 / out->head[0];
}

static void paper_numbers(const Template *template, Numbers *out)
{
    const int count = template->count;
    // Positions are relative to the mean of the vertices present.
    Vec3 mean = {0.0, 0.0, 0.0};
    // Scaled so that A has a trace of 3 at rest, as F has.
    for (int i = 0; i < count; i++)
        mean = vec3_madd(mean, 1.0 / count, template->rest[i]);
    // Unit weights; sums of products.
    double trace = 0.0, rest[6] = {0.0};
    for (int i = 0; i < count; i++) {
        const Vec3 r = vec3_sub(template->rest[i], mean);
        out->row[i][3] = 1.0;
        put(out->row[i] + 4, r);
        trace += vec3_dot(r, r);
        const double product[6] = {r.x * r.x, r.y * r.y, r.z * r.z,
                                   r.y * r.z, r.z * r.x, r.x * r.y};
        for (int k = 0; k < 6; k++)
            rest[k] += product[k];
    }
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            out->row[i][k] = 3.0 / trace * out->row[i][4 + k];
    out->head[0] = count;
    out->head[1] = 1.0 / count;
    for (int k = 0; k < 6; k++)
        out->head[2 + k] = 3.0 / trace * rest[k] - (k < 3 ? 1.0 : 0.0);
}

static void put_number(void *to, int at, double value, bool single)
{
    if (single)
        ((float *)to)[at] = (float)value;
    else
        ((double *)to)[at] = value;
}

static Numbers numbers_of(const Template *template, VoxelLaw law)
{
    Numbers numbers = {0};
    if (law == VOXEL_AFFINE)
        affine_numbers(template, &numbers);
    else
        paper_numbers(template, &numbers);
    return numbers;
}

// Writes every `stride`-th number, of `count` vertices.
static void put_numbers(void *to, int stride, int at, int count, const Numbers *numbers,
                        bool single)
{
    for (int i = 0; i < TABLE_HEAD; i++, at += stride)
        put_number(to, at, numbers->head[i], single);
    for (int i = 0; i < count * TABLE_ROW; i++, at += stride)
        put_number(to, at, numbers->row[i / TABLE_ROW][i % TABLE_ROW], single);
}

void voxel_table_put(void *number, const Template *shape, VoxelLaw law, Precision precision)
{
    const Numbers numbers = numbers_of(shape, law);
    put_numbers(number, 1, 0, shape->count, &numbers, precision == PRECISION_SINGLE);
}

static size_t numbers_in(const RestTable *table)
{
    return (size_t)(TABLE_HEAD + table->count * TABLE_ROW) * LANES;
}

const RestTable *voxel_tables_create(const Batches *batches, VoxelLaw law, Precision precision,
                                     const char *name, Arena *arena)
{
    const bool single = precision == PRECISION_SINGLE;
    const size_t real = single ? sizeof(float) : sizeof(double);
    const HangingBatches *hanging = &batches->hanging;
    const int count = batches->template_count + batches->mixed_count;
    RestTable *tables =
        arena_allocate(arena, ARENA_STEP, (size_t)count, sizeof *tables, "%s/rest tables", name);
    // Vertices per table: of one template, or of the longest in a mixed batch. Templates of mixed
    // batches alone have no table.
    for (int b = 0; b < hanging->batch_count; b++)
        tables[hanging->table[b]] =
            (RestTable){.count = hanging->start[b + 1] - hanging->start[b], .stride = LANES};
    size_t total = 0;
    for (int k = 0; k < count; k++)
        total += tables[k].count > 0 ? numbers_in(&tables[k]) : 0;
    // Then their numbers, one table behind the other.
    char *out = arena_allocate(arena, ARENA_STEP, total, real, "%s/rest shapes", name);
    for (int k = 0; k < count; k++) {
        const int mixed = k - batches->template_count;
        if (tables[k].count == 0)
            continue;
        for (int lane = 0; lane < LANES; lane++) {
            // A lane without an element gets a shape that never deforms.
            const int t = mixed < 0 ? k : batches->mixture[mixed][lane];
            const Numbers numbers = numbers_of(&batches->templates[t < 0 ? 0 : t], law);
            put_numbers(out, LANES, lane, tables[k].count, &numbers, single);
        }
        tables[k].number = out;
        out += numbers_in(&tables[k]) * real;
    }
    return tables;
}

// ---------------------------------------------------------------------------------------------
// The cache of bodies that are cut. Step thread

// A ball has about a hundred shapes, a body that is cut everywhere a few hundred. Partly filled
// elements each have their own: some hundred are near a tool.
enum { SLOT_BITS = 9, SLOT_BITS_PARTIAL = 11, TRIES = 8 };
// Cells of the largest elements (VOXEL_LEVELS_MAX).
enum { SOLID_WORDS_MOST = 1 << (3 * 5 - 6) };

static size_t real_size(const TemplateCache *cache)
{
    return cache->precision == PRECISION_SINGLE ? sizeof(float) : sizeof(double);
}

static void *numbers_at(const TemplateCache *cache, int slot)
{
    return (char *)cache->number + (size_t)slot * TEMPLATE_NUMBERS * real_size(cache);
}

static void create_slots(TemplateCache *cache, const char *name, Arena *arena)
{
    const size_t slots = (size_t)1 << cache->slot_bits;
    cache->key = arena_allocate(arena, ARENA_TOPOLOGY, slots, sizeof *cache->key,
                                "%s/keys of templates", name);
    cache->shape =
        arena_allocate(arena, ARENA_TOPOLOGY, slots, sizeof *cache->shape, "%s/templates", name);
    cache->number =
        arena_allocate(arena, ARENA_TOPOLOGY, slots, TEMPLATE_NUMBERS * real_size(cache),
                       "%s/tables of templates", name);
}

void template_cache_create(TemplateCache *cache, const char *name, VoxelLaw law,
                           Precision precision, Arena *arena)
{
    *cache = (TemplateCache){.law = law, .precision = precision, .slot_bits = SLOT_BITS};
    create_slots(cache, name, arena);
}

void template_cache_create_partial(TemplateCache *cache, const char *name, Precision precision,
                                   TemplateSolid *solid, const void *of, int parts, Arena *arena)
{
    int bits = SLOT_BITS;
    while (bits < SLOT_BITS_PARTIAL && 1 << bits < parts + (1 << SLOT_BITS))
        bits++;
    *cache = (TemplateCache){.law = VOXEL_AFFINE,
                             .precision = precision,
                             .solid = solid,
                             .solid_of = of,
                             .slot_bits = bits};
    create_slots(cache, name, arena);
}

static double number_of(const TemplateCache *cache, const void *number, int at)
{
    return cache->precision == PRECISION_SINGLE ? (double)((const float *)number)[at]
                                                : ((const double *)number)[at];
}

static void scale(const TemplateCache *cache, void *number, int at, double by)
{
    const double value = by * number_of(cache, number, at);
    if (cache->precision == PRECISION_SINGLE)
        ((float *)number)[at] = (float)value;
    else
        ((double *)number)[at] = value;
}

static void create_shape(const TemplateCache *cache, TemplateKey key, Template *shape)
{
    const unsigned mask = template_key_mask(key);
    if (key == mask) {
        template_create(shape, mask);
        return;
    }
    uint64_t solid[SOLID_WORDS_MOST];
    const int element = (int)(key >> (NODE_COUNT - NODE_CORNERS)) - 1;
    const int level = cache->solid(cache->solid_of, element, solid);
    template_create_partial(shape, mask, level, solid);
}

static void fill(TemplateCache *cache, int slot, TemplateKey key)
{
    Template *shape = &cache->shape[slot];
    void *number = numbers_at(cache, slot);
    create_shape(cache, key, shape);
    voxel_table_put(number, shape, cache->law, cache->precision);
    if (cache->law == VOXEL_MIYAZAKI2004) {
        const double weight = 6.0 / template_spread(shape);
        scale(cache, number, 0, weight);
        scale(cache, number, 1, 1.0 / weight);
        for (int i = 0; i < shape->count; i++)
            scale(cache, number, TABLE_HEAD + i * TABLE_ROW + 3, weight);
    }
    cache->key[slot] = key + 1;
    cache->made++;
}

static int slot_of(TemplateCache *cache, TemplateKey key)
{
    const unsigned home =
        (unsigned)(key * UINT64_C(11400714819323198485) >> (64 - cache->slot_bits)); // Fibonacci
    for (unsigned i = 0; i < TRIES; i++) {
        const unsigned slot = (home + i) & ((1u << cache->slot_bits) - 1);
        if (cache->key[slot] == key + 1)
            return (int)slot;
        if (cache->key[slot] == 0) {
            fill(cache, (int)slot, key);
            return (int)slot;
        }
    }
    fill(cache, (int)home, key);
    return (int)home;
}

const Template *template_cache_shape(TemplateCache *cache, TemplateKey key)
{
    return &cache->shape[slot_of(cache, key)];
}

const void *template_cache_numbers(TemplateCache *cache, TemplateKey key)
{
    return numbers_at(cache, slot_of(cache, key));
}
