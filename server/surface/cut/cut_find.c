#include "surface/cut/cut_find.h"

#include "base/check.h"
#include "geometry/box.h"

#include <math.h>
#include <string.h>

// Bits of CutFinder.odd.
enum { MARK_ODD = 1, MARK_TOUCHED = 2 };

// Shifts are at most 7 units and rounding is half a unit: boxes and slabs grow by more.
#define GROW_UNITS 16.0

// The space that a quadrilateral occupies: a box, and a slab across its mean normal.
typedef struct Reach {
    Box box; // [m]
    Vec3 normal;
    double near, far; // [m]
} Reach;

// --- creation ---

void cut_find_create(CutFinder *finder, const Level *level, Vec3 origin, double h, const char *name,
                     Arena *arena)
{
    size_t faces = (size_t)level->face_count, edges = (size_t)level->edge_count;
    memset(finder, 0, sizeof *finder);
    finder->level = level;
    finder->origin = origin;
    finder->h = h;
    finder->q = h / CUT_FIND_UNITS;
    finder->edge = arena_allocate(arena, ARENA_TOPOLOGY, edges, sizeof(int), "%s/cut_edge", name);
    finder->met_edge =
        arena_allocate(arena, ARENA_TOPOLOGY, edges, sizeof(int), "%s/cut_met_edge", name);
    finder->odd = arena_allocate(arena, ARENA_TOPOLOGY, edges, 1, "%s/cut_odd", name);
    finder->near = arena_allocate(arena, ARENA_TOPOLOGY, faces, sizeof(int), "%s/cut_near", name);
    finder->listed = arena_allocate(arena, ARENA_TOPOLOGY, faces, 1, "%s/cut_listed", name);
    finder->path =
        arena_allocate(arena, ARENA_TOPOLOGY, faces, sizeof(CutFacePoints[2]), "%s/cut_path", name);
}

void cut_find_reserve_blades(CutFinder *finder, int blades, const char *name, Arena *arena,
                             StateList *state)
{
    ASSERT(finder->blades == 0);
    size_t faces = (size_t)finder->level->face_count;
    finder->blades = blades;
    finder->memory = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)blades, sizeof(CutMemory),
                                    "%s/cut_memory", name);
    for (int b = 0; b < blades; b++) {
        CutMemory *memory = &finder->memory[b];
        memory->clock = arena_allocate(arena, ARENA_TOPOLOGY, 2, sizeof *memory->clock,
                                       "%s/blade_%d_clock", name, b);
        memory->edge = arena_allocate(arena, ARENA_TOPOLOGY, 2, sizeof *memory->edge,
                                      "%s/blade_%d_edge", name, b);
        memory->tries = arena_allocate(arena, ARENA_TOPOLOGY, 1, sizeof *memory->tries,
                                       "%s/blade_%d_tries", name, b);
        memory->seen = arena_allocate(arena, ARENA_TOPOLOGY, faces, sizeof *memory->seen,
                                      "%s/blade_%d_seen", name, b);
        memory->points = arena_allocate(arena, ARENA_TOPOLOGY, faces, sizeof *memory->points,
                                        "%s/blade_%d_points", name, b);
        state_add(state, memory->clock, 2 * sizeof *memory->clock, "%s/blade_%d_clock", name, b);
        state_add(state, memory->edge, 2 * sizeof *memory->edge, "%s/blade_%d_edge", name, b);
        state_add(state, memory->tries, sizeof *memory->tries, "%s/blade_%d_tries", name, b);
        state_add(state, memory->seen, faces * sizeof *memory->seen, "%s/blade_%d_seen", name, b);
        state_add(state, memory->points, faces * sizeof *memory->points, "%s/blade_%d_points", name,
                  b);
    }
}

static bool point_in_reach(const CutPoint *point)
{
    for (int c = 0; c < 3; c++)
        if (point->x[c] < -CUT_REACH / 2 || point->x[c] > CUT_REACH / 2)
            return false;
    return true;
}

bool cut_find_check(const CutFinder *finder)
{
    for (int b = 0; b < finder->blades; b++) {
        const CutMemory *memory = &finder->memory[b];
        if (*memory->tries < 0 || *memory->tries > INT32_MAX)
            return false;
        if (!point_in_reach(&memory->edge[0]) || !point_in_reach(&memory->edge[1]))
            return false;
        for (int f = 0; f < finder->level->face_count; f++) {
            const CutFacePoints *points = &memory->points[f];
            bool ok = point_in_reach(&points->centroid);
            for (int k = 0; k < 3; k++)
                ok = ok && point_in_reach(&points->middle[k]);
            if (!ok)
                return false;
        }
    }
    return true;
}

// --- faces near the sweep ---

static Reach reach_of(const BladeEdge *before, const BladeEdge *after, double grow)
{
    const Vec3 p[4] = {before->end[0], before->end[1], after->end[0], after->end[1]};
    Reach reach = {.box = box_empty(), .near = HUGE_VAL, .far = -HUGE_VAL};
    // The cross product of the diagonals; zero, and so without effect, for a sweep without area.
    reach.normal = vec3_unit(vec3_cross(vec3_sub(p[3], p[0]), vec3_sub(p[2], p[1])));
    for (int i = 0; i < 4; i++) {
        double along = vec3_dot(reach.normal, p[i]);
        box_add(&reach.box, p[i]);
        reach.near = along < reach.near ? along : reach.near;
        reach.far = along > reach.far ? along : reach.far;
    }
    box_grow(&reach.box, grow);
    reach.near -= grow;
    reach.far += grow;
    return reach;
}

static double least(double a, double b, double c)
{
    double m = a < b ? a : b;
    return m < c ? m : c;
}

static double most(double a, double b, double c)
{
    double m = a > b ? a : b;
    return m > c ? m : c;
}

static bool triangle_in_reach(const Reach *reach, Vec3 a, Vec3 b, Vec3 c)
{
    if (least(a.x, b.x, c.x) > reach->box.high[0] || most(a.x, b.x, c.x) < reach->box.low[0] ||
        least(a.y, b.y, c.y) > reach->box.high[1] || most(a.y, b.y, c.y) < reach->box.low[1] ||
        least(a.z, b.z, c.z) > reach->box.high[2] || most(a.z, b.z, c.z) < reach->box.low[2])
        return false;
    double da = vec3_dot(reach->normal, a), db = vec3_dot(reach->normal, b),
           dc = vec3_dot(reach->normal, c);
    return least(da, db, dc) <= reach->far && most(da, db, dc) >= reach->near;
}

static void corners_of(const CutTissue *tissue, int face, Vec3 x[3])
{
    for (int k = 0; k < 3; k++)
        x[k] = tissue->position[tissue->corner[face][k]];
}

// Lists the faces that the reach of at least one quadrilateral meets: ascending, as tissue->face.
static void list_near(CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge, int edges,
                      double grow)
{
    finder->near_count = 0;
    for (int at = 0; at < tissue->face_count; at++)
        finder->listed[tissue->face[at]] = 1;
    // One quadrilateral, the usual case: compute its reach once.
    Reach only = reach_of(&edge[0], &edge[1], grow);
    for (int at = 0; at < tissue->face_count; at++) {
        Vec3 x[3];
        corners_of(tissue, tissue->face[at], x);
        bool near = triangle_in_reach(&only, x[0], x[1], x[2]);
        for (int k = 1; !near && k < edges - 1; k++) {
            Reach reach = reach_of(&edge[k], &edge[k + 1], grow);
            near = triangle_in_reach(&reach, x[0], x[1], x[2]);
        }
        if (near)
            finder->near[finder->near_count++] = tissue->face[at];
    }
}

static void forget_listed(CutFinder *finder, const CutTissue *tissue)
{
    for (int at = 0; at < tissue->face_count; at++)
        finder->listed[tissue->face[at]] = 0;
}

// --- points ---

// Computes the points of a face's half links. False: out of range, or not finite.
static bool points_of(const CutFinder *finder, const CutTissue *tissue, int face,
                      CutFacePoints *points)
{
    Vec3 x[3];
    corners_of(tissue, face, x);
    Vec3 centroid = vec3_scale(1.0 / 3.0, vec3_add(vec3_add(x[0], x[1]), x[2]));
    bool ok = cut_quantise(centroid, finder->origin, finder->q, &points->centroid);
    for (int k = 0; k < 3; k++) {
        // Addition commutes: the face across the edge gets the same bits.
        Vec3 middle = vec3_scale(0.5, vec3_add(x[k], x[(k + 1) % 3]));
        ok = ok && cut_quantise(middle, finder->origin, finder->q, &points->middle[k]);
    }
    return ok;
}

// --- links against one quadrilateral ---

// Returns how often the edge meets a half link in all sub-ticks, or CUT_DEGENERATE.
static int count_half(const CutPath piece[][2], const CutPath half[2], int parts)
{
    if (parts == 1)
        return cut_may_meet(piece[0], half) ? cut_count(piece[0], half) : 0;
    int sum = 0;
    for (int part = 0; part < parts; part++) {
        if (cut_boxes_apart(piece[part], half)) // a part of the link lies in the box of the whole
            continue;
        CutPath link[2] = {cut_part(half[0], part, parts), cut_part(half[1], part, parts)};
        int count = cut_may_meet(piece[part], link) ? cut_count(piece[part], link) : 0;
        if (count == CUT_DEGENERATE)
            return CUT_DEGENERATE;
        sum += count;
    }
    return sum;
}

static void divide(const CutPath edge[2], int parts, CutPath piece[][2])
{
    for (int part = 0; part < parts; part++)
        for (int end = 0; end < 2; end++)
            piece[part][end] = cut_part(edge[end], part, parts);
}

// Counts what the half links of near faces meet. False: degenerate.
static bool count_sweep(CutFinder *finder, const CutPath edge[2], int parts)
{
    const Level *level = finder->level;
    divide(edge, parts, finder->piece);
    finder->parts = parts;
    for (int at = 0; at < finder->near_count; at++) {
        int face = finder->near[at];
        const CutFacePoints *path = finder->path[at];
        CutPath half[2] = {{{path[0].centroid, path[1].centroid}}};
        for (int k = 0; k < 3; k++) {
            int e = level->face_edge[face][k], beyond = levels_beyond(level, e, face);
            if (beyond < 0 || !finder->listed[beyond])
                continue;
            half[1] = (CutPath){{path[0].middle[k], path[1].middle[k]}};
            int count = count_half((const CutPath(*)[2])finder->piece, half, parts);
            if (count == CUT_DEGENERATE)
                return false;
            if (count > 0 && !(finder->odd[e] & MARK_TOUCHED)) {
                finder->odd[e] |= MARK_TOUCHED;
                finder->met_edge[finder->met++] = e;
            }
            if (count % 2 != 0)
                finder->odd[e] ^= MARK_ODD;
        }
    }
    return true;
}

static void forget_counts(CutFinder *finder)
{
    for (int i = 0; i < finder->met; i++)
        finder->odd[finder->met_edge[i]] = 0;
    finder->met = 0;
}

CutVerdict cut_find_keep_odd(CutFinder *finder, const CutTissue *tissue)
{
    int touched = finder->met;
    finder->met = finder->count = 0;
    for (int i = 0; i < touched; i++) {
        int e = finder->met_edge[i];
        bool odd = finder->odd[e] & MARK_ODD;
        finder->odd[e] = 0;
        if (!odd)
            continue;
        finder->met_edge[finder->met++] = e;
        if (!cut_find_is_broken(finder->level, tissue, e))
            finder->edge[finder->count++] = e;
    }
    return finder->count > 0 ? CUT_DONE : finder->met > 0 ? CUT_WAS_CUT : CUT_MET_NOTHING;
}

// --- commands ---

// Quantises an edge of a command at try `attempt`. It is always shifted, so that the same command
// gets the same shift when the tissue that it cut has moved a little; by a hash of its position, so
// that quadrilaterals with a common edge (in a loop, or of successive commands) share the shift.
static void command_edge(const CutFinder *finder, const BladeEdge *edge, int attempt,
                         CutPoint out[2])
{
    cut_quantise_edge(edge, finder->origin, finder->q, out);
    uint64_t hash = (uint64_t)attempt + 1;
    for (int end = 0; end < 2; end++)
        for (int c = 0; c < 3; c++) { // FNV-1a, by words
            hash = (hash ^ (uint64_t)out[end].x[c]) * UINT64_C(0x100000001b3);
            hash ^= hash >> 29;
        }
    cut_shift_edge(out, 1 + (int64_t)(hash >> 8 & 0xffffffff));
}

static bool count_command(CutFinder *finder, const BladeEdge *edge, int edges, int attempt)
{
    CutPoint from[2], to[2];
    command_edge(finder, &edge[0], attempt, from);
    for (int k = 0; k + 1 < edges; k++) {
        command_edge(finder, &edge[k + 1], attempt, to);
        CutPath path[2] = {{{from[0], to[0]}}, {{from[1], to[1]}}};
        CutSweep sweep = {.before = edge[k], .after = edge[k + 1]};
        int parts = cut_subticks(&sweep, CUT_FIND_TOLERANCE * finder->h);
        if (!count_sweep(finder, path, parts))
            return false;
        from[0] = to[0];
        from[1] = to[1];
    }
    return true;
}

int cut_find_half(const CutFinder *finder, const BladeEdge *edge, int edges, Vec3 centroid,
                  Vec3 middle)
{
    CutPoint from[2], to[2], point[2];
    if (!cut_quantise(centroid, finder->origin, finder->q, &point[0]) ||
        !cut_quantise(middle, finder->origin, finder->q, &point[1]))
        return CUT_DEGENERATE;
    const CutPath half[2] = {{{point[0], point[0]}}, {{point[1], point[1]}}};
    if (edges == 2) // unchanged since the command
        return count_half((const CutPath(*)[2])finder->piece, half, finder->parts);
    int sum = 0;
    command_edge(finder, &edge[0], finder->tries, from);
    for (int k = 0; k + 1 < edges; k++) {
        command_edge(finder, &edge[k + 1], finder->tries, to);
        CutPath path[2] = {{{from[0], to[0]}}, {{from[1], to[1]}}};
        if (!cut_boxes_apart(path, half)) {
            CutPath piece[CUT_SUBTICKS_MOST][2];
            CutSweep sweep = {.before = edge[k], .after = edge[k + 1]};
            int parts = cut_subticks(&sweep, CUT_FIND_TOLERANCE * finder->h);
            divide(path, parts, piece);
            int count = count_half((const CutPath(*)[2])piece, half, parts);
            if (count == CUT_DEGENERATE)
                return CUT_DEGENERATE;
            sum += count;
        }
        from[0] = to[0];
        from[1] = to[1];
    }
    return sum;
}

// Returns CUT_DONE if the command can be evaluated, else the reason.
static CutVerdict look_at_command(const CutFinder *finder, const BladeEdge *edge, int edges)
{
    for (int k = 0; k < edges; k++) {
        CutPoint point[2];
        if (!cut_quantise_edge(&edge[k], finder->origin, finder->q, point))
            return CUT_TOO_LARGE;
        CutSweep sweep = {.before = edge[k > 0 ? k - 1 : 0], .after = edge[k]};
        if (cut_subticks(&sweep, CUT_FIND_TOLERANCE * finder->h) == 0)
            return CUT_TOO_TWISTED;
    }
    return CUT_DONE;
}

CutVerdict cut_find_whole(CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge,
                          int edges)
{
    ASSERT(edges >= 2);
    finder->count = finder->met = finder->tries = 0;
    CutVerdict verdict = look_at_command(finder, edge, edges);
    if (verdict != CUT_DONE)
        return verdict;
    list_near(finder, tissue, edge, edges, GROW_UNITS * finder->q);
    int kept = 0;
    // Drop faces whose points cannot be represented; before and after coincide, as the tissue is
    // still.
    for (int at = 0; at < finder->near_count; at++) {
        CutFacePoints *path = finder->path[kept];
        finder->near[kept] = finder->near[at];
        if (!points_of(finder, tissue, finder->near[at], &path[0]))
            continue;
        path[1] = path[0];
        kept++;
    }
    finder->near_count = kept;
    // A degenerate case is resolved by another shift.
    bool resolved = false;
    while (!resolved && finder->tries <= CUT_TRIES) {
        resolved = count_command(finder, edge, edges, finder->tries);
        if (!resolved) {
            forget_counts(finder);
            finder->tries++;
        }
    }
    forget_listed(finder, tissue);
    return resolved ? cut_find_keep_odd(finder, tissue) : CUT_UNRESOLVED;
}

// --- strokes ---

static int side_of(const Level *level, int face, int edge)
{
    int k = 0;
    while (level->face_edge[face][k] != edge)
        k++;
    return k;
}

// Fills a face's points at the last call; if unknown, the tissue counts as at rest. The stored
// middle of a side holds for both of its faces: their links must continue from the same point.
static void take_before(const CutFinder *finder, const CutMemory *memory, int face,
                        const CutFacePoints *now, CutFacePoints *before)
{
    const Level *level = finder->level;
    uint64_t clock = memory->clock[0];
    if (memory->seen[face] == clock) {
        *before = memory->points[face];
        return;
    }
    *before = *now;
    for (int k = 0; k < 3; k++) {
        int e = level->face_edge[face][k], beyond = levels_beyond(level, e, face);
        if (beyond >= 0 && memory->seen[beyond] == clock)
            before->middle[k] = memory->points[beyond].middle[side_of(level, beyond, e)];
    }
}

static void take_points(CutFinder *finder, const CutTissue *tissue, CutMemory *memory)
{
    int kept = 0;
    for (int at = 0; at < finder->near_count; at++) {
        int face = finder->near[at];
        CutFacePoints *path = finder->path[kept];
        if (!points_of(finder, tissue, face, &path[1]))
            continue;
        take_before(finder, memory, face, &path[1], &path[0]);
        finder->near[kept++] = face;
    }
    finder->near_count = kept;
}

static void remember(CutFinder *finder, CutMemory *memory, const CutPoint edge[2])
{
    memory->clock[0]++;
    memory->clock[1]++;
    for (int at = 0; at < finder->near_count; at++) {
        int face = finder->near[at];
        memory->seen[face] = memory->clock[0];
        memory->points[face] = finder->path[at][1];
    }
    memory->edge[0] = edge[0];
    memory->edge[1] = edge[1];
}

static void forget(CutMemory *memory)
{
    memory->clock[0] += 2; // by 2, so that nothing counts as seen in the last call
    memory->clock[1] = 0;
    *memory->tries = 0;
}

static bool count_tick(CutFinder *finder, const CutPoint before[2], const BladeEdge *after,
                       int64_t attempt, bool both, int parts, CutPoint to[2])
{
    CutPoint from[2] = {before[0], before[1]};
    cut_quantise_edge(after, finder->origin, finder->q, to);
    cut_shift_edge(to, attempt);
    if (both)
        cut_shift_edge(from, attempt + CUT_TRIES);
    CutPath path[2] = {{{from[0], to[0]}}, {{from[1], to[1]}}};
    return count_sweep(finder, path, parts);
}

static CutVerdict go_on(CutFinder *finder, const CutTissue *tissue, CutMemory *memory,
                        const CutSweep *sweep, int parts)
{
    CutPoint to[2];
    bool first = memory->clock[1] == 1, resolved = false;
    // A shift stays until the stroke ends: if it changed every tick, a cut through centroids could
    // change sides.
    int64_t attempt = *memory->tries;
    while (!resolved && finder->tries <= CUT_TRIES) {
        bool both = finder->tries > (first ? 0 : CUT_TRIES / 2);
        resolved = count_tick(finder, memory->edge, &sweep->after, attempt, both, parts, to);
        if (!resolved) {
            forget_counts(finder);
            finder->tries++;
            attempt++;
        }
    }
    *memory->tries = attempt;
    remember(finder, memory, to);
    return resolved ? cut_find_keep_odd(finder, tissue) : CUT_UNRESOLVED;
}

CutVerdict cut_find_tick(CutFinder *finder, const CutTissue *tissue, const CutSweep *sweep)
{
    ASSERT(sweep->blade >= 0 && sweep->blade < finder->blades);
    CutMemory *memory = &finder->memory[sweep->blade];
    finder->count = finder->met = finder->tries = 0;
    if (sweep->phase == CUT_ENDS) {
        forget(memory);
        return CUT_MET_NOTHING;
    }
    CutPoint begin[2], end[2];
    CutSweep way = *sweep;
    bool begins = sweep->phase == CUT_BEGINS;
    // Without a previous edge a stroke starts where the sweep says.
    if (begins)
        forget(memory);
    bool fresh = memory->clock[1] == 0;
    if (fresh && begins)
        way.before = way.after;
    int parts = cut_subticks(&way, CUT_FIND_TOLERANCE * finder->h);
    if (!cut_quantise_edge(&way.before, finder->origin, finder->q, begin) ||
        !cut_quantise_edge(&way.after, finder->origin, finder->q, end) || parts == 0) {
        forget(memory); // the blade jumped: a new stroke
        return parts == 0 ? CUT_TOO_TWISTED : CUT_TOO_LARGE;
    }
    const BladeEdge edge[2] = {way.before, way.after};
    list_near(finder, tissue, edge, 2, CUT_FIND_MARGIN * finder->h);
    take_points(finder, tissue, memory);
    CutVerdict verdict = CUT_MET_NOTHING;
    if (begins) {
        remember(finder, memory, end);
    } else {
        if (fresh) {
            memory->edge[0] = begin[0];
            memory->edge[1] = begin[1];
            memory->clock[1] = 1;
        }
        verdict = go_on(finder, tissue, memory, sweep, parts);
    }
    forget_listed(finder, tissue);
    return verdict;
}
