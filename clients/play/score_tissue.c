// What was severed of one body, from its meshes. A cut of a wall makes border edges on both of its
// sides, a cut of a solid makes walls on both: half of what was added is what was severed. Lengths,
// areas and places are those of the reference shape, the first frame, in which neither refinement
// nor motion changes them.
#include "score_parts.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

// --- nodes by their ids --------------------------------------------------------------------------

typedef struct Node {
    int id;
    int origin, parent[2]; // ids, as in RecordingBirth
    bool used, placed;
    int part;   // connected part of the first mesh; -1: neither it nor what it was made of was there
    Vec3 place; // in the reference shape [m], if placed
} Node;

struct ScoreTissue {
    const SceneScore *rules;
    char body[RECORDING_BODY_TEXT];
    int first_wall;
    Node *node; // [capacity], open addressing
    size_t count, capacity;
    bool any;      // the reference shape is known
    Severed total; // of the mesh before: half of all borders or walls
    int parts;     // connected parts of the first mesh
    double whole;  // their area or volume
    // the newest mesh
    int node_count, triangle_count;
    int *id;
    int (*triangle)[3];
    Vec3 *place;
};

static size_t slot_of(const ScoreTissue *tissue, int id)
{
    size_t at = ((uint32_t)id * 2654435761u) & (tissue->capacity - 1);
    while (tissue->node[at].used && tissue->node[at].id != id)
        at = (at + 1) & (tissue->capacity - 1);
    return at;
}

static void grow_nodes(ScoreTissue *tissue)
{
    Node *old = tissue->node;
    const size_t had = tissue->capacity;
    tissue->capacity = had == 0 ? 1024 : 2 * had;
    tissue->node = calloc(tissue->capacity, sizeof *tissue->node);
    ASSERT(tissue->node != NULL);
    for (size_t i = 0; i < had; i++)
        if (old[i].used)
            tissue->node[slot_of(tissue, old[i].id)] = old[i];
    free(old);
}

static Node *find_node(const ScoreTissue *tissue, int id)
{
    Node *node = tissue->capacity > 0 ? &tissue->node[slot_of(tissue, id)] : NULL;
    return node != NULL && node->used ? node : NULL;
}

static Node *add_node(ScoreTissue *tissue, int id)
{
    if (2 * (tissue->count + 1) > tissue->capacity)
        grow_nodes(tissue);
    Node *node = &tissue->node[slot_of(tissue, id)];
    if (!node->used) {
        *node = (Node){.id = id, .used = true, .origin = id, .parent = {id, id}, .part = -1};
        tissue->count++;
    }
    return node;
}

void score_tissue_births(ScoreTissue *tissue, int count, const RecordingBirth *birth)
{
    for (int i = 0; i < count; i++) {
        Node *node = add_node(tissue, birth[i].id);
        // After a reset an id may come again, for another node.
        if (node->origin != birth[i].origin || node->parent[0] != birth[i].parent[0] ||
            node->parent[1] != birth[i].parent[1])
            node->placed = false;
        node->origin = birth[i].origin;
        node->parent[0] = birth[i].parent[0];
        node->parent[1] = birth[i].parent[1];
    }
}

// --- the reference shape -------------------------------------------------------------------------

static bool is_born(const Node *node)
{
    return node->origin != node->id || node->parent[0] != node->parent[1];
}

// Finds the place of a copy or of a midpoint by that of what it was made of.
static bool place_by_birth(const ScoreTissue *tissue, Node *node, int depth)
{
    enum { DEPTH = 64 }; // far more than there are levels: births of a damaged file form circles
    if (node == NULL || node->placed || depth == DEPTH || !is_born(node))
        return node != NULL && node->placed;
    Node *from[2] = {find_node(tissue, node->parent[0]), find_node(tissue, node->parent[1])};
    if (node->origin != node->id)
        from[0] = from[1] = find_node(tissue, node->origin);
    if (place_by_birth(tissue, from[0], depth + 1) && place_by_birth(tissue, from[1], depth + 1)) {
        node->place = vec3_scale(0.5, vec3_add(from[0]->place, from[1]->place));
        node->placed = true;
        node->part = from[0]->part;
    }
    return node->placed;
}

static Vec3 position_of(const float *position, int i)
{
    return vec3(position[3 * i], position[3 * i + 1], position[3 * i + 2]);
}

// Finds places of nodes that come from the inside of a solid: as displaced as their neighbours in
// the mesh. Returns how many were found.
static int place_by_neighbors(ScoreTissue *tissue, const float *position, bool *known, Vec3 *moved,
                              int *neighbors)
{
    const int nodes = tissue->node_count;
    int found = 0;
    memset(neighbors, 0, (size_t)nodes * sizeof *neighbors);
    for (int t = 0; t < tissue->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            const int a = tissue->triangle[t][k], b = tissue->triangle[t][(k + 1) % 3];
            for (int side = 0; side < 2; side++) {
                const int to = side ? a : b, from = side ? b : a;
                if (known[to] || !known[from])
                    continue;
                const Vec3 by = vec3_sub(position_of(position, from), tissue->place[from]);
                moved[to] = neighbors[to]++ == 0 ? by : vec3_add(moved[to], by);
            }
        }
    for (int i = 0; i < nodes; i++)
        if (neighbors[i] > 0) {
            tissue->place[i] = vec3_madd(position_of(position, i), -1.0 / neighbors[i], moved[i]);
            known[i] = true;
            found++;
        }
    return found;
}

static void *allocate(int count, size_t size)
{
    void *memory = calloc((size_t)count + 1, size);
    ASSERT(memory != NULL);
    return memory;
}

static void place_nodes(ScoreTissue *tissue, const float *position)
{
    enum { PASSES = 64 }; // layers of new nodes
    const int nodes = tissue->node_count;
    int unknown = 0;
    bool *known = allocate(nodes, sizeof *known);
    for (int i = 0; i < nodes; i++) {
        Node *node = add_node(tissue, tissue->id[i]);
        if (!tissue->any && !is_born(node) && !node->placed) {
            node->place = position_of(position, i);
            node->placed = true;
        }
    }
    for (int i = 0; i < nodes; i++) {
        Node *node = find_node(tissue, tissue->id[i]);
        known[i] = place_by_birth(tissue, node, 0);
        tissue->place[i] = node->place;
        unknown += !known[i];
    }
    // The rest are new: as their neighbours, else as they are.
    if (unknown > 0) {
        Vec3 *moved = allocate(nodes, sizeof *moved);
        int *neighbors = allocate(nodes, sizeof *neighbors), found = 1;
        for (int pass = 0; pass < PASSES && found > 0; pass++)
            found = place_by_neighbors(tissue, position, known, moved, neighbors);
        free(moved);
        free(neighbors);
    }
    for (int i = 0; i < nodes; i++) {
        Node *node = find_node(tissue, tissue->id[i]);
        if (!node->placed)
            node->place = tissue->place[i] = known[i] ? tissue->place[i] : position_of(position, i);
        node->placed = true;
    }
    free(known);
}

// --- regions -------------------------------------------------------------------------------------

typedef struct Span {
    double from, to; // shares of a segment
} Span;

// Returns the part of a segment in a convex region; from >= to: none.
static Span clip(const FixedRegion *region, Vec3 a, Vec3 b)
{
    const Vec3 d = vec3_sub(b, a);
    Span span = {0.0, 1.0};
    if (region->kind == FIXED_SPHERE) {
        const Vec3 c = vec3_sub(a, region->center);
        const double p = vec3_dot(d, d), q = vec3_dot(d, c);
        const double root = q * q - p * (vec3_dot(c, c) - region->radius * region->radius);
        if (!(p > 0.0) || !(root > 0.0))
            return (Span){1.0, 0.0};
        return (Span){fmax(0.0, (-q - sqrt(root)) / p), fmin(1.0, (-q + sqrt(root)) / p)};
    }
    const double start[3] = {a.x, a.y, a.z}, along[3] = {d.x, d.y, d.z};
    const double low[3] = {region->low.x, region->low.y, region->low.z};
    const double high[3] = {region->high.x, region->high.y, region->high.z};
    for (int k = 0; k < 3; k++) {
        if (along[k] == 0.0) {
            if (start[k] < low[k] || start[k] > high[k])
                return (Span){1.0, 0.0};
            continue;
        }
        const double s = (low[k] - start[k]) / along[k], t = (high[k] - start[k]) / along[k];
        span.from = fmax(span.from, fmin(s, t));
        span.to = fmin(span.to, fmax(s, t));
    }
    return span;
}

// Returns the share of a segment that is in any region.
static double share_inside(const SceneScore *rules, Vec3 a, Vec3 b)
{
    Span span[SCENE_SCORE_REGIONS];
    double share = 0.0, end = 0.0;
    for (int i = 0; i < rules->region_count; i++)
        span[i] = clip(&rules->region[i].region, a, b);
    // Of spans that overlap, the next one that reaches further.
    for (int n = 0; n < rules->region_count; n++) {
        int next = -1;
        for (int i = 0; i < rules->region_count; i++)
            if (span[i].from < span[i].to && span[i].to > end &&
                (next < 0 || span[i].from < span[next].from))
                next = i;
        if (next < 0)
            break;
        share += span[next].to - fmax(span[next].from, end);
        end = span[next].to;
    }
    return share;
}

static bool is_inside(const SceneScore *rules, Vec3 x)
{
    for (int i = 0; i < rules->region_count; i++)
        if (fixed_contains(&rules->region[i].region, x))
            return true;
    return false;
}

// Returns the share of a triangle that is in any region, to a sixty-fourth.
static double share_of_triangle(const SceneScore *rules, const Vec3 corner[3])
{
    enum { ROWS = 8 };
    int inside = 0;
    if (rules->region_count == 0)
        return 0.0;
    const Vec3 u = vec3_scale(1.0 / ROWS, vec3_sub(corner[1], corner[0]));
    const Vec3 v = vec3_scale(1.0 / ROWS, vec3_sub(corner[2], corner[0]));
    for (int i = 0; i < ROWS; i++)
        for (int k = 0; k < ROWS - i; k++)
            for (int down = 0; down < (k < ROWS - i - 1 ? 2 : 1); down++) {
                const double at = (down + 1) / 3.0;
                inside += is_inside(rules, vec3_madd(vec3_madd(corner[0], i + at, u), k + at, v));
            }
    return (double)inside / (ROWS * ROWS);
}

// --- borders and walls ---------------------------------------------------------------------------

static int by_number(const void *a, const void *b)
{
    const int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

static void add_border(const ScoreTissue *tissue, int a, int b, Severed *sum)
{
    const Vec3 x = tissue->place[a], y = tissue->place[b];
    const double length = 0.5 * vec3_length(vec3_sub(y, x));
    const double inside = length * share_inside(tissue->rules, x, y);
    sum->inside += inside;
    sum->outside += length - inside;
}

// Half the length of all edges of one triangle alone.
static Severed measure_borders(const ScoreTissue *tissue)
{
    Severed sum = {0.0, 0.0};
    const int nodes = tissue->node_count;
    // The other ends of edges by their lower end.
    int *start = allocate(nodes + 1, sizeof *start);
    int *other = allocate(3 * tissue->triangle_count, sizeof *other);
    for (int round = 0; round < 2; round++) {
        for (int t = 0; t < tissue->triangle_count; t++)
            for (int k = 0; k < 3; k++) {
                const int a = tissue->triangle[t][k], b = tissue->triangle[t][(k + 1) % 3];
                const int low = a < b ? a : b, high = a < b ? b : a;
                if (round == 0)
                    start[low + 1]++;
                else
                    other[start[low]++] = high;
            }
        for (int i = 0; i < nodes && round == 0; i++)
            start[i + 1] += start[i];
    }
    // Filling has moved each start to its end.
    for (int i = 0; i < nodes; i++) {
        const int first = i > 0 ? start[i - 1] : 0, end = start[i];
        qsort(other + first, (size_t)(end - first), sizeof *other, by_number);
        for (int k = first, same; k < end; k = same) {
            for (same = k + 1; same < end && other[same] == other[k];)
                same++;
            if (same == k + 1 && other[k] != i)
                add_border(tissue, i, other[k], &sum);
        }
    }
    free(start);
    free(other);
    return sum;
}

static void corners_of(const ScoreTissue *tissue, int t, Vec3 corner[3])
{
    for (int k = 0; k < 3; k++)
        corner[k] = tissue->place[tissue->triangle[t][k]];
}

static double area_of(const Vec3 corner[3])
{
    return 0.5 *
           vec3_length(vec3_cross(vec3_sub(corner[1], corner[0]), vec3_sub(corner[2], corner[0])));
}

// Half the area of all walls.
static Severed measure_walls(const ScoreTissue *tissue)
{
    Severed sum = {0.0, 0.0};
    for (int t = tissue->first_wall; t < tissue->triangle_count; t++) {
        Vec3 corner[3];
        corners_of(tissue, t, corner);
        const double area = 0.5 * area_of(corner);
        const double inside = area * share_of_triangle(tissue->rules, corner);
        sum.inside += inside;
        sum.outside += area - inside;
    }
    return sum;
}

// --- pieces --------------------------------------------------------------------------------------

static int root_of(int *parent, int i)
{
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

// Numbers the connected parts of the mesh: part[node]. Returns how many; a node without triangles
// is one.
static int find_parts(const ScoreTissue *tissue, int *part)
{
    int count = 0;
    int *parent = allocate(tissue->node_count, sizeof *parent);
    for (int i = 0; i < tissue->node_count; i++)
        parent[i] = i;
    for (int t = 0; t < tissue->triangle_count; t++)
        for (int k = 0; k < 2; k++) {
            const int a = root_of(parent, tissue->triangle[t][k]);
            const int b = root_of(parent, tissue->triangle[t][k + 1]);
            parent[a > b ? a : b] = a > b ? b : a; // the root is the lowest node
        }
    for (int i = 0; i < tissue->node_count; i++)
        part[i] = parent[i] == i ? count++ : part[root_of(parent, i)];
    free(parent);
    return count;
}

typedef struct Part {
    double size;  // area [m2], of a solid the volume [m3]: negative around a hole in it
    int of;       // part of the first mesh that it was in; 0 if that is not known
    bool fixed;   // has nodes that the scene fixes
    bool removed; // neither that nor the largest of its part
} Part;

static bool is_fixed(const ScoreTissue *tissue, int id, Vec3 place)
{
    const SceneScore *rules = tissue->rules;
    for (int b = 0; b < rules->fixed_count; b++)
        for (int k = 0; k < rules->fixed[b].count; k++) {
            const FixedRegion *region = &rules->fixed[b].region[k];
            if (strcmp(rules->fixed[b].body, tissue->body) != 0)
                break;
            if (region->kind != FIXED_NODES && fixed_contains(region, place))
                return true;
            for (int n = 0; region->kind == FIXED_NODES && n < region->node_count; n++)
                if (region->node[n] == id)
                    return true;
        }
    return false;
}

// Measures the connected parts of the newest mesh; the caller frees them.
static Part *measure_parts(const ScoreTissue *tissue, int *number, int *count)
{
    *count = find_parts(tissue, number);
    Part *part = allocate(*count, sizeof *part);
    Vec3 *from = allocate(*count, sizeof *from); // a node of each
    for (int i = 0; i < tissue->node_count; i++) {
        Part *of = &part[number[i]];
        const Node *node = find_node(tissue, tissue->id[i]);
        from[number[i]] = tissue->place[i];
        of->of = node->part > of->of ? node->part : of->of;
        of->fixed = of->fixed || is_fixed(tissue, tissue->id[i], tissue->place[i]);
    }
    for (int t = 0; t < tissue->triangle_count; t++) {
        const int at = number[tissue->triangle[t][0]];
        Vec3 x[3];
        corners_of(tissue, t, x);
        const Vec3 a = vec3_sub(x[0], from[at]), b = vec3_sub(x[1], from[at]),
                   c = vec3_sub(x[2], from[at]);
        part[at].size += tissue->first_wall > 0 ? vec3_dot(a, vec3_cross(b, c)) / 6.0 : area_of(x);
    }
    free(from);
    return part;
}

// Notes where the body's connected parts are before any cut.
static void note_parts(ScoreTissue *tissue)
{
    int *number = allocate(tissue->node_count, sizeof *number), count;
    Part *part = measure_parts(tissue, number, &count);
    for (int i = 0; i < count; i++) {
        tissue->parts += part[i].size > 0.0;
        tissue->whole += part[i].size;
    }
    for (int i = 0; i < tissue->node_count; i++)
        find_node(tissue, tissue->id[i])->part = number[i];
    free(part);
    free(number);
}

static int by_falling_size(const void *a, const void *b)
{
    const ScorePiece *x = a, *y = b;
    return (x->size < y->size) - (x->size > y->size);
}

// Marks what was removed: of each part of the first mesh all but its largest piece and what is
// fixed.
static void mark_removed(Part *part, int count, int parts)
{
    int *largest = allocate(parts, sizeof *largest);
    for (int i = 0; i < parts; i++)
        largest[i] = -1;
    for (int i = 0; i < count; i++) {
        int *of = &largest[part[i].of];
        if (part[i].size > 0.0 && (*of < 0 || part[i].size > part[*of].size))
            *of = i;
    }
    for (int i = 0; i < count; i++)
        part[i].removed = part[i].size > 0.0 && !part[i].fixed;
    for (int i = 0; i < parts; i++)
        if (largest[i] >= 0)
            part[largest[i]].removed = false;
    free(largest);
}

void score_tissue_pieces(const ScoreTissue *tissue, ScoreBody *body)
{
    int *number = allocate(tissue->node_count, sizeof *number), count, most = 0;
    Part *part = measure_parts(tissue, number, &count);
    for (int i = 0; i < count; i++)
        most = part[i].of > most ? part[i].of : most;
    mark_removed(part, count, most + 1);
    body->solid = tissue->first_wall > 0;
    body->pieces_first = tissue->parts;
    body->whole_size = tissue->whole;
    ScorePiece *piece = allocate(count, sizeof *piece);
    for (int i = 0; i < count; i++) {
        body->pieces_last += part[i].size > 0.0;
        if (!part[i].removed)
            continue;
        piece[body->removed++].size = part[i].size;
        body->removed_size += part[i].size;
    }
    qsort(piece, (size_t)body->removed, sizeof *piece, by_falling_size);
    for (int i = 0; i < body->removed && i < SCORE_PIECES; i++)
        body->piece[i] = piece[i];
    free(piece);
    free(part);
    free(number);
}

// --- meshes --------------------------------------------------------------------------------------

ScoreTissue *score_tissue_create(const SceneScore *rules, const char *body, int first_wall)
{
    ScoreTissue *tissue = calloc(1, sizeof *tissue);
    ASSERT(tissue != NULL);
    tissue->rules = rules;
    tissue->first_wall = first_wall;
    snprintf(tissue->body, sizeof tissue->body, "%s", body);
    return tissue;
}

void score_tissue_destroy(ScoreTissue *tissue)
{
    free(tissue->node);
    free(tissue->id);
    free(tissue->triangle);
    free(tissue->place);
    free(tissue);
}

static void copy_mesh(ScoreTissue *tissue, const RecordingTopology *mesh)
{
    free(tissue->id);
    free(tissue->triangle);
    free(tissue->place);
    tissue->node_count = mesh->node_count;
    tissue->triangle_count = mesh->triangle_count;
    tissue->id = allocate(mesh->node_count, sizeof *tissue->id);
    tissue->triangle = allocate(mesh->triangle_count, sizeof *tissue->triangle);
    tissue->place = allocate(mesh->node_count, sizeof *tissue->place);
    memcpy(tissue->id, mesh->node_id, (size_t)mesh->node_count * sizeof *tissue->id);
    memcpy(tissue->triangle, mesh->triangle,
           (size_t)mesh->triangle_count * sizeof *tissue->triangle);
}

Severed score_tissue_mesh(ScoreTissue *tissue, const RecordingTopology *mesh, const float *position)
{
    const double same = 1e-9; // of the whole: sums in another order
    copy_mesh(tissue, mesh);
    place_nodes(tissue, position);
    const Severed total = tissue->first_wall > 0 ? measure_walls(tissue) : measure_borders(tissue);
    const Severed before = tissue->any ? tissue->total : total;
    const double all = total.inside + total.outside;
    const double added = all - before.inside - before.outside;
    tissue->total = total;
    if (!tissue->any)
        note_parts(tissue);
    tissue->any = true;
    if (!(added > same * all))
        return (Severed){0.0, 0.0};
    return (Severed){.inside = fmax(0.0, total.inside - before.inside),
                     .outside = fmax(0.0, total.outside - before.outside)};
}
