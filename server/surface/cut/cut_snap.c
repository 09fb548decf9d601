// SPDX-License-Identifier: MIT
#include "surface/cut/cut_snap.h"

#include "geometry/distance.h"

#include <math.h>

// A blade that lies in the surface has no direction there: below this sine a vertex does not move.
#define LEAST_SLOPE 0.2

// --- the faces around a vertex of the uncut mesh ---

// A face, and the corner of it that the vertex is.
typedef struct Turn {
    int face, corner;
} Turn;

// Returns corner k in the uncut mesh: a body may write copies into the level's table of corners,
// but edges keep their ends, and side k begins at corner k.
static int vertex_at(const Level *level, int face, int k)
{
    int e = level->face_edge[face][k];
    return level->edge[e][level->edge_face[e][0] != face];
}

static int corner_of(const Level *level, int face, int vertex)
{
    int k = 0;
    while (vertex_at(level, face, k) != vertex)
        k++;
    return k;
}

// Returns the next face counter-clockwise (way 1) or clockwise (way 0); face -1 beyond a border.
static Turn turn_from(const Level *level, Turn from, int way)
{
    int vertex = vertex_at(level, from.face, from.corner);
    int side = way ? (from.corner + 2) % 3 : from.corner;
    int next = levels_beyond(level, level->face_edge[from.face][side], from.face);
    return (Turn){next, next < 0 ? 0 : corner_of(level, next, vertex)};
}

// Returns the first face of the fan clockwise, or `from` if the fan is closed.
static Turn fan_start(const Level *level, Turn from, bool *closed)
{
    Turn at = from;
    for (;;) {
        Turn before = turn_from(level, at, 0);
        *closed = before.face == from.face;
        if (before.face < 0 || *closed)
            return *closed ? from : at;
        at = before;
    }
}

// --- the way to the blade ---

// Returns the nearest point of the sweep, and the normal of its triangle.
static Vec3 nearest_on_sweep(const BladeEdge *edge, int edges, Vec3 point, Vec3 *normal)
{
    double nearest = HUGE_VAL;
    Vec3 place = point;
    *normal = vec3(0.0, 0.0, 0.0);
    for (int k = 0; k + 1 < edges; k++) {
        const Vec3 *a = edge[k].end, *b = edge[k + 1].end;
        const Vec3 triangle[2][3] = {{a[0], a[1], b[0]}, {a[1], b[1], b[0]}};
        for (int i = 0; i < 2; i++) {
            const Vec3 *x = triangle[i];
            ClosestPair pair;
            distance_point_triangle(point, x, &pair);
            if (!(pair.distance < nearest))
                continue;
            nearest = pair.distance;
            place = pair.on_triangle;
            *normal = vec3_unit(vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0])));
        }
    }
    return place;
}

static Vec3 place_of(const CutTissue *tissue, Turn at, int ahead)
{
    return tissue->position[tissue->corner[at.face][(at.corner + ahead) % 3]];
}

// Computes how a vertex should move in the deformed surface: along the blade's normal projected
// into the surface; along the border at a border. False: it does not move.
static bool way_to_blade(const CutSnapInput *input, Turn start, bool closed, Vec3 *way)
{
    const Level *level = input->finder->level;
    const CutTissue *tissue = input->tissue;
    Vec3 x = place_of(tissue, start, 0), normal;
    Vec3 to = vec3_sub(nearest_on_sweep(input->edge, input->edges, x, &normal), x);
    double distance = vec3_dot(to, normal);
    // Beyond the end of the sweep the blade has no side.
    Vec3 beside = vec3_madd(to, -distance, normal);
    if (vec3_length(beside) > 0.25 * input->finder->h)
        return false;
    // The area vector of the fan is the surface normal; at a border, the chord of the fan its
    // direction.
    Vec3 area = vec3(0.0, 0.0, 0.0), first = place_of(tissue, start, 1), last = first;
    Turn at = start;
    do {
        Vec3 a = vec3_sub(place_of(tissue, at, 1), x), b = vec3_sub(place_of(tissue, at, 2), x);
        area = vec3_add(area, vec3_cross(a, b));
        last = place_of(tissue, at, 2);
        at = turn_from(level, at, 1);
    } while (at.face >= 0 && at.face != start.face);
    // Along the blade's normal, within the surface or along the border.
    Vec3 direction;
    if (closed) {
        Vec3 up = vec3_unit(area);
        direction = vec3_madd(normal, -vec3_dot(normal, up), up);
    } else {
        Vec3 along = vec3_unit(vec3_sub(last, first));
        direction = vec3_scale(vec3_dot(normal, along), along);
    }
    double slope = vec3_length(direction);
    if (!(slope > LEAST_SLOPE))
        return false;
    // `direction` is the normal without its component out of the surface: its square is the
    // approach per unit step along it.
    *way = vec3_scale(distance / (slope * slope), direction);
    return true;
}

// --- the same way at rest ---

static Vec3 rest_of(const CutSnapInput *input, const int *work, const CutSnap *moved, int vertex)
{
    Vec3 x = input->rest[vertex];
    return work[vertex] > 0 ? vec3_add(x, moved[work[vertex] - 1].rest) : x;
}

// Computes the components of `way` along the edges a and b of a triangle; false: it has no area.
static bool shares_of(Vec3 way, Vec3 a, Vec3 b, double share[2])
{
    double aa = vec3_dot(a, a), ab = vec3_dot(a, b), bb = vec3_dot(b, b);
    double wa = vec3_dot(way, a), wb = vec3_dot(way, b), det = aa * bb - ab * ab;
    if (!(det > 1e-12 * aa * bb))
        return false;
    share[0] = (wa * bb - wb * ab) / det;
    share[1] = (wb * aa - wa * ab) / det;
    return true;
}

// Uses the face into which the way leads, or the one nearest to it. The component out of the face
// is the same at rest. Both triangles are those before this command moved anything: without
// deformation the way at rest equals the way, and the vertex is at rest at its new position.
static bool map_to_rest(const CutSnapInput *input, Turn start, Vec3 way, Vec3 *out)
{
    const Level *level = input->finder->level;
    bool found = false;
    double best = 0.0;
    Vec3 x = place_of(input->tissue, start, 0);
    *out = vec3(0.0, 0.0, 0.0);
    Turn at = start;
    // Each face around, with the shares of the way along its two edges.
    do {
        const Vec3 *rest[3];
        for (int k = 0; k < 3; k++)
            rest[k] = &input->rest[vertex_at(level, at.face, (at.corner + k) % 3)];
        double share[2];
        Vec3 a = vec3_sub(place_of(input->tissue, at, 1), x);
        Vec3 b = vec3_sub(place_of(input->tissue, at, 2), x);
        if (shares_of(way, a, b, share)) {
            // The smaller share is largest in the face that contains the way, or comes nearest to
            // it.
            double inside = share[0] < share[1] ? share[0] : share[1];
            if (!found || inside > best) {
                found = true;
                best = inside;
                Vec3 ra = vec3_sub(*rest[1], *rest[0]), rb = vec3_sub(*rest[2], *rest[0]);
                double out_of_it = vec3_dot(way, vec3_unit(vec3_cross(a, b)));
                *out = vec3_scale(out_of_it, vec3_unit(vec3_cross(ra, rb)));
                *out = vec3_madd(vec3_madd(*out, share[0], ra), share[1], rb);
            }
        }
        at = turn_from(level, at, 1);
    } while (at.face >= 0 && at.face != start.face);
    return found;
}

// --- the guard ---

// Returns the smallest angle of a triangle [rad].
static double smallest_angle(const Vec3 x[3])
{
    double smallest = HUGE_VAL;
    for (int k = 0; k < 3; k++) {
        Vec3 a = vec3_sub(x[(k + 1) % 3], x[k]), b = vec3_sub(x[(k + 2) % 3], x[k]);
        double angle = atan2(vec3_length(vec3_cross(a, b)), vec3_dot(a, b));
        smallest = angle < smallest ? angle : smallest;
    }
    return smallest;
}

static bool is_allowed(const CutSnapInput *input, const int *work, const CutSnap *moved, Turn start,
                       Vec3 move)
{
    const Level *level = input->finder->level;
    const double quarter = 0.78539816339744831; // 45 degrees
    Turn at = start;
    // Each face around, as built and with the vertex moved.
    do {
        Vec3 built[3], now[3];
        for (int k = 0; k < 3; k++) {
            int vertex = vertex_at(level, at.face, k);
            built[k] = input->built[vertex];
            now[k] = rest_of(input, work, moved, vertex);
        }
        now[at.corner] = vec3_add(now[at.corner], move);
        // No angle may become too small.
        double before = smallest_angle(built);
        double least = CUT_SNAP_GUARD * (before < quarter ? before : quarter);
        least = least > CUT_SNAP_FLOOR * before ? least : CUT_SNAP_FLOOR * before;
        // The face must not turn over either.
        Vec3 up = vec3_cross(vec3_sub(built[1], built[0]), vec3_sub(built[2], built[0]));
        Vec3 area = vec3_cross(vec3_sub(now[1], now[0]), vec3_sub(now[2], now[0]));
        if (smallest_angle(now) < least || !(vec3_dot(up, area) > 0.0))
            return false;
        at = turn_from(level, at, 1);
    } while (at.face >= 0 && at.face != start.face);
    return true;
}

// --- met links stay met ---

// The planes of a flat sweep's two triangles, to decide quickly for points clear of both on one
// side.
typedef struct Sides {
    bool known;
    Vec3 normal[2];
    double offset[2], margin; // [m]
} Sides;

static Sides sides_of(const CutSnapInput *input)
{
    const CutFinder *finder = input->finder;
    // Corners are shifted by up to 7 units in each direction and rounded, as all points between
    // them.
    Sides sides = {.known = input->edges == 2 && finder->links.parts == 1,
                   .margin = 32.0 * finder->links.q};
    const Vec3 *a = input->edge[0].end, *b = input->edge[1].end;
    const Vec3 corner[2][3] = {{a[0], a[1], b[0]}, {a[1], b[1], b[0]}};
    for (int i = 0; i < 2; i++) {
        Vec3 u = vec3_sub(corner[i][1], corner[i][0]), v = vec3_sub(corner[i][2], corner[i][0]);
        Vec3 across = vec3_cross(u, v);
        // Not for a sliver, whose normal is rounding error.
        sides.known &= vec3_length(across) > 1e-6 * vec3_length(u) * vec3_length(v);
        sides.normal[i] = vec3_unit(across);
        sides.offset[i] = vec3_dot(sides.normal[i], corner[i][0]);
    }
    return sides;
}

static bool on_one_side(double a, double b, double margin)
{
    return (a > margin && b > margin) || (a < -margin && b < -margin);
}

// Counts how often the command meets the half links of a face with these corners; bit k of `odd`:
// an odd number. False: undecided.
static bool count_halves(const CutSnapInput *input, const Sides *sides, const Vec3 x[3], int *odd)
{
    double d[2][3];
    Vec3 centroid = vec3_scale(1.0 / 3.0, vec3_add(vec3_add(x[0], x[1]), x[2]));
    for (int i = 0; sides->known && i < 2; i++)
        for (int k = 0; k < 3; k++)
            d[i][k] = vec3_dot(sides->normal[i], x[k]) - sides->offset[i];
    *odd = 0;
    for (int k = 0; k < 3; k++) {
        int next = (k + 1) % 3;
        bool clear = sides->known;
        for (int i = 0; clear && i < 2; i++)
            clear = on_one_side((d[i][0] + d[i][1] + d[i][2]) / 3.0, 0.5 * (d[i][k] + d[i][next]),
                                sides->margin);
        if (clear)
            continue;
        Vec3 middle = vec3_scale(0.5, vec3_add(x[k], x[next]));
        int count = cut_find_half(input->finder, input->edge, input->edges, centroid, middle);
        if (count == CUT_DEGENERATE)
            return false;
        *odd |= count % 2 << k;
    }
    return true;
}

// Finds the half links of a face, bit k, that are met an odd number of times either before or after
// the move; false: undecided.
static bool halves_that_change(const CutSnapInput *input, const Sides *sides, const int *work,
                               const CutSnap *moved, Turn at, Vec3 move, int *changes)
{
    const Level *level = input->finder->level;
    Vec3 x[3];
    for (int k = 0; k < 3; k++) {
        int mark = work[vertex_at(level, at.face, k)];
        x[k] = input->tissue->position[input->tissue->corner[at.face][k]];
        if (mark > 0)
            x[k] = vec3_add(x[k], moved[mark - 1].move);
    }
    int before, after;
    bool known = count_halves(input, sides, x, &before);
    x[at.corner] = vec3_add(x[at.corner], move);
    known = known && count_halves(input, sides, x, &after);
    *changes = known ? before ^ after : 0;
    return known;
}

// True if every link around the vertex is met as before. A face whose centroid changed sides would
// be cut off when the command is repeated.
static bool keeps_links(const CutSnapInput *input, const Sides *sides, const int *work,
                        const CutSnap *moved, Turn start, bool closed, Vec3 move)
{
    Turn at = start;
    int carried = 0, first = 0;
    do {
        int changes;
        if (!halves_that_change(input, sides, work, moved, at, move, &changes))
            return false;
        int here = changes >> at.corner & 1;
        if (changes >> (at.corner + 1) % 3 & 1)
            return false;
        if (at.face == start.face)
            first = here;
        else if (here != carried)
            return false;
        carried = changes >> (at.corner + 2) % 3 & 1;
        at = turn_from(input->finder->level, at, 1);
    } while (at.face >= 0 && at.face != start.face);
    return !closed || carried == first;
}

// --- all vertices ---

// True if all faces around are leaves with intact links.
static bool is_fresh(const CutSnapInput *input, Turn start)
{
    Turn at = start;
    do {
        if (!input->finder->listed[at.face])
            return false;
        int side = at.corner, before = (at.corner + 2) % 3;
        if (input->tissue->broken[at.face] & (1 << side | 1 << before))
            return false;
        at = turn_from(input->finder->level, at, 1);
    } while (at.face >= 0 && at.face != start.face);
    return true;
}

// Computes the move of one vertex. False: it does not move.
static bool snap_vertex(const CutSnapInput *input, const Sides *sides, const int *work,
                        const CutSnap *moved, Turn somewhere, CutSnap *snap)
{
    bool closed;
    Turn start = fan_start(input->finder->level, somewhere, &closed);
    Vec3 way, rest;
    if (!is_fresh(input, start) || !way_to_blade(input, start, closed, &way) ||
        !map_to_rest(input, start, way, &rest))
        return false;
    double length = vec3_length(rest), most = CUT_SNAP_MOST * input->finder->h;
    if (!(length > 0.0) || !isfinite(length))
        return false;
    // Halve the move until the guard and the links allow it.
    double share = length > most ? most / length : 1.0;
    for (int halved = 0; halved <= 2; halved++, share *= 0.5) {
        if (!is_allowed(input, work, moved, start, vec3_scale(share, rest)) ||
            !keeps_links(input, sides, work, moved, start, closed, vec3_scale(share, way)))
            continue;
        snap->rest = vec3_scale(share, rest);
        snap->move = vec3_scale(share, way);
        return true;
    }
    return false;
}

int cut_snap(const CutSnapInput *input, int *work, CutSnap *moved)
{
    CutFinder *finder = input->finder;
    const Level *level = finder->level;
    const Sides sides = sides_of(input);
    int count = 0;
    for (int i = 0; i < input->tissue->face_count; i++)
        finder->listed[input->tissue->face[i]] = 1;
    // Both ends of each broken edge, once each; work[] marks the visited ones and the index of
    // their move.
    for (int i = 0; i < finder->count; i++) {
        int e = finder->edge[i], face = level->edge_face[e][0];
        for (int end = 0; end < 2; end++) {
            int vertex = level->edge[e][end];
            if (work[vertex] != 0 || (input->fixed && input->fixed[vertex]))
                continue;
            Turn at = {face, corner_of(level, face, vertex)};
            CutSnap snap = {.vertex = vertex};
            work[vertex] = -1;
            if (!snap_vertex(input, &sides, work, moved, at, &snap))
                continue;
            moved[count++] = snap;
            work[vertex] = count;
        }
    }
    // Clear the scratch marks for the next call.
    for (int i = 0; i < finder->count; i++)
        for (int end = 0; end < 2; end++)
            work[level->edge[finder->edge[i]][end]] = 0;
    for (int i = 0; i < input->tissue->face_count; i++)
        finder->listed[input->tissue->face[i]] = 0;
    return count;
}
