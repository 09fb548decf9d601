// SPDX-License-Identifier: MIT
#include "surface/cut/cut_find.h"

#include "base/check.h"
#include "geometry/box.h"

#include <math.h>
#include <string.h>

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
    *finder = (CutFinder){.level = level,
                          .h = h,
                          .links = {.origin = origin,
                                    .q = h / CUT_FIND_UNITS,
                                    .tolerance = CUT_FIND_TOLERANCE * h,
                                    .hashed = true}};
    link_finder_create(&finder->links, level->edge_count, level->edge_count, name, arena);
    finder->edge = arena_allocate(arena, ARENA_TOPOLOGY, edges, sizeof(int), "%s/cut_edge", name);
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
        // All of it is part of the state.
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
    bool ok = cut_quantise(centroid, finder->links.origin, finder->links.q, &points->centroid);
    for (int k = 0; k < 3; k++) {
        // Addition commutes: the face across the edge gets the same bits.
        Vec3 middle = vec3_scale(0.5, vec3_add(x[k], x[(k + 1) % 3]));
        ok = ok && cut_quantise(middle, finder->links.origin, finder->links.q, &points->middle[k]);
    }
    return ok;
}

// --- links ---

// Offers the half links of near faces (LinkOffer).
static bool offer_halves(LinkFinder *links, void *model)
{
    const CutFinder *finder = model;
    const Level *level = finder->level;
    for (int at = 0; at < finder->near_count; at++) {
        int face = finder->near[at];
        const CutFacePoints *path = finder->path[at];
        CutPath half[2] = {{{path[0].centroid, path[1].centroid}}};
        for (int k = 0; k < 3; k++) {
            int e = level->face_edge[face][k], beyond = levels_beyond(level, e, face);
            if (beyond < 0 || !finder->listed[beyond])
                continue;
            half[1] = (CutPath){{path[0].middle[k], path[1].middle[k]}};
            if (!link_finder_meet(links, e, half))
                return false;
        }
    }
    return true;
}

CutVerdict cut_find_unbroken(CutFinder *finder, const CutTissue *tissue)
{
    const LinkFinder *links = &finder->links;
    finder->count = 0;
    for (int i = 0; i < links->met_count; i++)
        if (!cut_find_is_broken(finder->level, tissue, links->met[i]))
            finder->edge[finder->count++] = links->met[i];
    return finder->count > 0 ? CUT_DONE : links->met_count > 0 ? CUT_WAS_CUT : CUT_MET_NOTHING;
}

// Lists the links near that the sweeps break.
static CutVerdict find(CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge, int edges,
                       CutTrail *trail)
{
    CutVerdict verdict =
        link_finder_sweep(&finder->links, edge, edges, trail, offer_halves, finder);
    return verdict == CUT_DONE ? cut_find_unbroken(finder, tissue) : verdict;
}

// --- commands ---

CutVerdict cut_find_whole(CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge,
                          int edges)
{
    ASSERT(edges >= 2);
    finder->count = finder->links.met_count = 0;
    CutVerdict verdict = link_finder_check(&finder->links, edge, edges);
    if (verdict != CUT_DONE)
        return verdict;
    list_near(finder, tissue, edge, edges, GROW_UNITS * finder->links.q);
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
    verdict = find(finder, tissue, edge, edges, NULL);
    forget_listed(finder, tissue);
    return verdict;
}

// --- strokes ---

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
            before->middle[k] = memory->points[beyond].middle[cut_side_of(level, beyond, e)];
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

CutVerdict cut_find_tick(CutFinder *finder, const CutTissue *tissue, const CutSweep *sweep)
{
    ASSERT(sweep->blade >= 0 && sweep->blade < finder->blades);
    CutMemory *memory = &finder->memory[sweep->blade];
    const bool begins = sweep->phase == CUT_BEGINS;
    finder->count = finder->links.met_count = 0;
    if (sweep->phase != CUT_GOES_ON)
        forget(memory);
    if (sweep->phase == CUT_ENDS)
        return CUT_MET_NOTHING;
    const BladeEdge edge[2] = {begins ? sweep->after : sweep->before, sweep->after};
    CutVerdict verdict = link_finder_check(&finder->links, edge, 2);
    if (verdict != CUT_DONE) {
        forget(memory); // the blade jumped: a new stroke
        return verdict;
    }
    // Where links were and are: of all faces that the blade may reach in this tick or the next.
    list_near(finder, tissue, edge, 2, CUT_FIND_MARGIN * finder->h);
    take_points(finder, tissue, memory);
    // Without a previous edge a stroke starts where the sweep says.
    CutTrail trail = {{memory->edge[0], memory->edge[1]}, *memory->tries, memory->clock[1] == 1};
    if (memory->clock[1] == 0) {
        cut_quantise_edge(&edge[0], finder->links.origin, finder->links.q, trail.edge);
        memory->clock[1] = !begins;
        trail.fresh = true;
    }
    // A stroke that begins only stores them.
    verdict = begins ? CUT_MET_NOTHING : find(finder, tissue, edge, 2, &trail);
    *memory->tries = trail.tries;
    remember(finder, memory, trail.edge);
    forget_listed(finder, tissue);
    return verdict;
}
