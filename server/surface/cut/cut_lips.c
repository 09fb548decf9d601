// SPDX-License-Identifier: MIT
#include "surface/cut/cut_lips.h"

#include "body/cut_meet.h"
#include "geometry/distance.h"

#include <math.h>
#include <string.h>

#define LEAST_SLOPE                                                                                \
    0.2 // sine between face and sheet: a blade in the surface has no direction there
#define BEYOND       1.0    // [h] the sheet of a command is continued so far
#define ALIKE        0.8    // cosine between normals of one sheet
#define EVENLY       0.25   // of the way to between the path's neighbours of a vertex
#define BORDER_MOST  0.6    // of an edge of the border that a vertex may go along it
#define BEHIND       0.08   // [h] of the base of a tooth behind the sheet
#define WEIGHT_LEAST (-2.0) // of a crossing in its face
#define SHARES_MOST  4.0    // of a face's edges; more only in slivers

// ---------------------------------------------------------------------------------------------
// Crossings

// Where a sheet crosses a face, in the present shape of the tissue.
typedef struct FacePoint {
    double weight[3]; // of the corners
    Vec3 normal;
} FacePoint;

static void corners_of(const CutTissue *tissue, int face, Vec3 x[3])
{
    for (int k = 0; k < 3; k++)
        x[k] = tissue->position[tissue->corner[face][k]];
}

static Vec3 normal_of(const Vec3 x[3])
{
    return vec3_unit(vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0])));
}

// Finds the components of a vector in the plane of a and b along them; false: these have no area.
static bool find_shares(Vec3 way, Vec3 a, Vec3 b, double share[2])
{
    const double aa = vec3_dot(a, a), ab = vec3_dot(a, b), bb = vec3_dot(b, b);
    const double wa = vec3_dot(way, a), wb = vec3_dot(way, b), det = aa * bb - ab * ab;
    if (!(det > 1e-12 * aa * bb))
        return false;
    share[0] = (wa * bb - wb * ab) / det;
    share[1] = (wb * aa - wa * ab) / det;
    return isfinite(share[0]) && isfinite(share[1]);
}

// Writes a crossing at rest: its point has the same weights, the line of the sheet in the face the
// same shares of the face's edges, and the sheet leans as much.
static void write_crossing(const CutFinder *finder, const CutTissue *tissue, const Vec3 *rest,
                           int edge, int face, const FacePoint *point, LipCrossing *crossing)
{
    const Level *level = finder->level;
    Vec3 x[3], r[3], at = vec3(0.0, 0.0, 0.0);
    corners_of(tissue, face, x);
    for (int k = 0; k < 3; k++) {
        r[k] = rest[cut_vertex_at(level, face, k)];
        at = vec3_madd(at, point->weight[k], r[k]);
    }
    const Vec3 up = normal_of(x), n = point->normal;
    const double lean = vec3_dot(n, up);
    const Vec3 a = vec3_sub(x[1], x[0]), b = vec3_sub(x[2], x[0]), line = vec3_cross(up, n);
    double share[2];
    if (!find_shares(line, a, b, share))
        return;
    const Vec3 rest_line = vec3_add(vec3_scale(share[0], vec3_sub(r[1], r[0])),
                                    vec3_scale(share[1], vec3_sub(r[2], r[0])));
    const Vec3 rest_up = normal_of(r), across = vec3_unit(vec3_cross(rest_line, rest_up));
    const Vec3 normal =
        vec3_unit(vec3_madd(vec3_scale(sqrt(fmax(0.0, 1.0 - lean * lean)), across), lean, rest_up));
    const double length = vec3_length(normal);
    const int *end = level->edge[edge];
    const Vec3 middle = vec3_scale(0.5, vec3_add(rest[end[0]], rest[end[1]]));
    if (!(vec3_length(vec3_sub(at, middle)) < LIP_CROSSING_MOST * finder->h) ||
        !(fabs(length - 1.0) < 1e-6))
        return;
    crossing[edge] = (LipCrossing){{(float)at.x, (float)at.y, (float)at.z},
                                   {(float)normal.x, (float)normal.y, (float)normal.z}};
}

// Finds the nearest point of a sweep, and the normal of its triangle there.
static Vec3 nearest_on_sweep(const BladeEdge *edge, int edges, Vec3 point, Vec3 *normal)
{
    double nearest = HUGE_VAL;
    Vec3 place = point;
    *normal = vec3(0.0, 0.0, 0.0);
    for (int k = 0; k + 1 < edges; k++) {
        const Vec3 *a = edge[k].end, *b = edge[k + 1].end;
        const Vec3 triangle[2][3] = {{a[0], a[1], b[0]}, {a[1], b[1], b[0]}};
        for (int i = 0; i < 2; i++) {
            ClosestPair pair;
            distance_point_triangle(point, triangle[i], &pair);
            if (!(pair.distance < nearest))
                continue;
            nearest = pair.distance;
            place = pair.on_triangle;
            *normal = normal_of(triangle[i]);
        }
    }
    return place;
}

// Goes from the middle of an edge to the sheet within one of its faces. False: there is no way.
static bool go_to_sheet(const CutTissue *tissue, int face, Vec3 middle, double distance, Vec3 n,
                        FacePoint *point)
{
    Vec3 x[3];
    corners_of(tissue, face, x);
    const Vec3 up = normal_of(x), along = vec3_madd(n, -vec3_dot(n, up), up);
    const double slope = vec3_dot(along, along);
    if (!(slope > LEAST_SLOPE * LEAST_SLOPE))
        return false;
    const Vec3 place = vec3_madd(middle, distance / slope, along);
    double share[2];
    if (!find_shares(vec3_sub(place, x[0]), vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0]), share))
        return false;
    *point = (FacePoint){{1.0 - share[0] - share[1], share[0], share[1]}, n};
    return true;
}

static double least_weight(const FacePoint *point)
{
    return fmin(point->weight[0], fmin(point->weight[1], point->weight[2]));
}

static Vec3 middle_of(const Level *level, const CutTissue *tissue, int edge)
{
    const int face = level->edge_face[edge][0], k = cut_side_of(level, face, edge);
    const int *corner = tissue->corner[face];
    return vec3_scale(0.5,
                      vec3_add(tissue->position[corner[k]], tissue->position[corner[(k + 1) % 3]]));
}

// Writes the crossing of an edge with a sheet at this distance from its middle along its normal: in
// the face that contains it, or nearly does.
static void cross_beside(const CutFinder *finder, const CutTissue *tissue, const Vec3 *rest,
                         int edge, double distance, Vec3 n, LipCrossing *crossing)
{
    const int *face = finder->level->edge_face[edge];
    const Vec3 middle = middle_of(finder->level, tissue, edge);
    FacePoint best, point;
    int in = -1;
    for (int s = 0; s < 2; s++)
        if (go_to_sheet(tissue, face[s], middle, distance, n, &point) &&
            (in < 0 || least_weight(&point) > least_weight(&best))) {
            best = point;
            in = face[s];
        }
    if (in >= 0 && least_weight(&best) > WEIGHT_LEAST)
        write_crossing(finder, tissue, rest, edge, in, &best, crossing);
}

void cut_lips_around(const CutFinder *finder, const CutTissue *tissue, int edge,
                     const Region *mouth, const Vec3 *rest, LipCrossing *crossing)
{
    const Vec3 middle = middle_of(finder->level, tissue, edge);
    double along, unused;
    distance_segment_segment(mouth->from, mouth->to, middle, middle, &along, &unused);
    const Vec3 axis = vec3_sub(mouth->to, mouth->from);
    const Vec3 out = vec3_sub(middle, vec3_madd(mouth->from, along, axis));
    const double distance = mouth->radius - vec3_length(out);
    if (!(fabs(distance) <= BEYOND * finder->h))
        return;
    cross_beside(finder, tissue, rest, edge, distance, vec3_unit(out), crossing);
}

void cut_lips_whole(const CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge,
                    int edges, const Vec3 *rest, LipCrossing *crossing)
{
    const Level *level = finder->level;
    for (int i = 0; i < finder->count; i++) {
        const int e = finder->edge[i];
        const Vec3 middle = middle_of(level, tissue, e);
        // Beyond its border the sheet continues in its plane, a little.
        Vec3 n;
        const Vec3 to = vec3_sub(nearest_on_sweep(edge, edges, middle, &n), middle);
        const double distance = vec3_dot(to, n);
        if (!(vec3_length(vec3_madd(to, -distance, n)) <= BEYOND * finder->h))
            continue;
        cross_beside(finder, tissue, rest, e, distance, n, crossing);
    }
}

void cut_lips_tick(CutFinder *finder, const CutTissue *tissue, const Vec3 *rest,
                   LipCrossing *crossing)
{
    const Level *level = finder->level;
    LinkFinder *links = &finder->links;
    for (int i = 0; i < finder->count; i++)
        link_finder_flip(links, finder->edge[i], LINK_ODD);
    // Of each link one of its halves was met, or both at different times: then any.
    for (int at = 0; at < finder->near_count; at++) {
        const int face = finder->near[at];
        const CutFacePoints *path = finder->path[at];
        for (int k = 0; k < 3; k++) {
            const int e = level->face_edge[face][k];
            if (!link_finder_is_odd(links, e))
                continue;
            const CutPath half[2] = {{{path[0].centroid, path[1].centroid}},
                                     {{path[0].middle[k], path[1].middle[k]}}};
            const int count = link_finder_again(links, half);
            if (count <= 0 || count % 2 == 0)
                continue;
            const CutMeeting meeting = cut_meet(links->edge, half);
            const double out = fmin(fmax(meeting.along, 0.0), 1.0), centre = (1.0 - out) / 3.0;
            FacePoint point = {{centre, centre, centre}, meeting.normal};
            point.weight[k] += 0.5 * out;
            point.weight[(k + 1) % 3] += 0.5 * out;
            write_crossing(finder, tissue, rest, e, face, &point, crossing);
        }
    }
    for (int i = 0; i < finder->count; i++)
        link_finder_flip(links, finder->edge[i], LINK_ODD);
}

void cut_lips_forget(const CutFinder *finder, LipCrossing *crossing)
{
    for (int i = 0; i < finder->count; i++)
        memset(&crossing[finder->edge[i]], 0, sizeof *crossing);
}

// ---------------------------------------------------------------------------------------------
// The faces around a vertex of the uncut mesh

typedef struct Turn {
    int face, corner; // the corner of the face that the vertex is
    bool broken;      // the edge to the next face is
} Turn;

typedef struct Ring {
    Turn turn[LIPS_RING]; // counter-clockwise
    int count;
    bool closed; // else it begins and ends at the border
} Ring;

// Returns the next face counter-clockwise (way 1) or clockwise (way 0); face -1 beyond a border.
static Turn turn_from(const LipMesh *mesh, Turn from, int way)
{
    const Level *level = mesh->level;
    const int side = way ? (from.corner + 2) % 3 : from.corner;
    const int e = level->face_edge[from.face][side], next = levels_beyond(level, e, from.face);
    const int vertex = cut_vertex_at(level, from.face, from.corner);
    Turn turn = {next, 0, false};
    while (next >= 0 && cut_vertex_at(level, next, turn.corner) != vertex)
        turn.corner++;
    return turn;
}

static bool is_broken(const LipMesh *mesh, Turn turn)
{
    return mesh->broken[turn.face] >> (turn.corner + 2) % 3 & 1;
}

// False: there are too many. A closed ring begins after a broken edge, if there is one.
static bool walk_ring(const LipMesh *mesh, Turn from, Ring *ring)
{
    Turn first = from;
    ring->closed = false;
    for (int i = 0; i <= LIPS_RING && !ring->closed; i++) {
        const Turn before = turn_from(mesh, first, 0);
        if (before.face < 0)
            break;
        first = before;
        ring->closed = first.face == from.face;
    }
    ring->count = 0;
    for (Turn at = first; at.face >= 0; at = turn_from(mesh, at, 1)) {
        if (ring->count > 0 && at.face == first.face)
            break;
        if (ring->count == LIPS_RING)
            return false;
        at.broken = is_broken(mesh, at);
        ring->turn[ring->count++] = at;
    }
    for (int turns = 0; ring->closed && !ring->turn[ring->count - 1].broken && turns < ring->count;
         turns++) {
        const Turn last = ring->turn[ring->count - 1];
        memmove(&ring->turn[1], &ring->turn[0], (size_t)(ring->count - 1) * sizeof *ring->turn);
        ring->turn[0] = last;
    }
    return true;
}

// ---------------------------------------------------------------------------------------------
// The sheets through a vertex

// Planes, from the vertex at rest.
typedef struct Sheets {
    int count;
    Vec3 normal[2];
    double away[2]; // [m] along the normal
    Vec3
        even; // within a single sheet, to where the vertex is evenly spaced among those of the path
} Sheets;

typedef struct SheetSum {
    int count;
    Vec3 at, normal, first, last; // from the vertex
    Vec3 ends;                    // of the edges, likewise
} SheetSum;

static void add_crossing(SheetSum *sum, Vec3 at, Vec3 normal, Vec3 end)
{
    const double sign = vec3_dot(normal, sum->normal) < 0.0 ? -1.0 : 1.0; // a sheet has two sides
    if (sum->count == 0)
        sum->first = at;
    sum->last = at;
    sum->at = vec3_add(sum->at, at);
    sum->normal = vec3_madd(sum->normal, sign, normal);
    sum->ends = vec3_add(sum->ends, end);
    sum->count++;
}

// Finds up to two sheets from the crossings of the broken edges around.
static Sheets find_sheets(const LipMesh *mesh, const Ring *ring, Vec3 x)
{
    SheetSum sum[2] = {{0}};
    Sheets sheets = {0};
    for (int i = 0; i < ring->count; i++) {
        const Turn turn = ring->turn[i];
        if (!turn.broken)
            continue;
        const int side = (turn.corner + 2) % 3;
        const LipCrossing *c = &mesh->crossing[mesh->level->face_edge[turn.face][side]];
        const Vec3 end = mesh->rest[cut_vertex_at(mesh->level, turn.face, side)];
        const Vec3 n = {(double)c->normal[0], (double)c->normal[1], (double)c->normal[2]};
        const Vec3 at = {(double)c->at[0], (double)c->at[1], (double)c->at[2]};
        if (!(vec3_dot(n, n) > 0.0))
            continue;
        for (int s = 0; s < 2; s++)
            if (sum[s].count == 0 || fabs(vec3_dot(n, vec3_unit(sum[s].normal))) > ALIKE) {
                add_crossing(&sum[s], vec3_sub(at, x), n, vec3_sub(end, x));
                break;
            }
    }
    for (int s = 0; s < 2 && sum[s].count > 0; s++) {
        const Vec3 at = vec3_scale(1.0 / sum[s].count, sum[s].at);
        Vec3 n = vec3_unit(sum[s].normal), chord = vec3_sub(sum[s].last, sum[s].first);
        // The line between two crossings is surer than a normal.
        const double length = vec3_length(chord);
        if (sum[s].count == 2 && length > 0.2 * mesh->h)
            n = vec3_unit(vec3_madd(n, -vec3_dot(n, chord) / (length * length), chord));
        sheets.normal[sheets.count] = n;
        sheets.away[sheets.count++] = vec3_dot(n, at);
    }
    // A path that crosses the sheet along an edge would have both ends of it in one place.
    if (sheets.count == 1 && sum[0].count == 2 && ring->closed)
        sheets.even = vec3_scale(EVENLY, sum[0].ends);
    return sheets;
}

// ---------------------------------------------------------------------------------------------
// From a vertex to its sheets

typedef struct Corner {
    Vec3 a, b, up; // edges of a face from the vertex, and its normal, at rest
} Corner;

static Corner corner_at(const LipMesh *mesh, Turn turn)
{
    Vec3 x[3];
    for (int k = 0; k < 3; k++)
        x[k] = mesh->rest[cut_vertex_at(mesh->level, turn.face, (turn.corner + k) % 3)];
    return (Corner){vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0]), normal_of(x)};
}

// Moves a vector within a face by the shortest way onto the sheets. False: the face lies in one.
static bool go_to_sheets(const Sheets *sheets, Vec3 up, Vec3 *way)
{
    Vec3 d[2];
    double g[2][2], r[2];
    for (int s = 0; s < sheets->count; s++) {
        d[s] = vec3_madd(sheets->normal[s], -vec3_dot(sheets->normal[s], up), up);
        r[s] = sheets->away[s] - vec3_dot(sheets->normal[s], *way);
    }
    g[0][0] = vec3_dot(d[0], d[0]);
    if (!(g[0][0] > LEAST_SLOPE * LEAST_SLOPE))
        return false;
    if (sheets->count == 2) {
        g[0][1] = vec3_dot(d[0], d[1]), g[1][1] = vec3_dot(d[1], d[1]);
        const double det = g[0][0] * g[1][1] - g[0][1] * g[0][1];
        if (det > 0.1 * g[0][0] * g[1][1]) { // at more than 18 degrees
            *way = vec3_madd(*way, (r[0] * g[1][1] - r[1] * g[0][1]) / det, d[0]);
            *way = vec3_madd(*way, (r[1] * g[0][0] - r[0] * g[0][1]) / det, d[1]);
            return true;
        }
    }
    *way = vec3_madd(*way, r[0] / g[0][0], d[0]);
    return true;
}

// A vertex of the border stays on it, unless the sheet is far along it.
static bool go_along_border(const LipMesh *mesh, const Ring *ring, const Sheets *sheets, Vec3 *way)
{
    const Corner first = corner_at(mesh, ring->turn[0]),
                 last = corner_at(mesh, ring->turn[ring->count - 1]);
    const Vec3 border[2] = {first.a, last.b};
    bool found = false;
    double best = 0.0;
    for (int s = 0; s < 2; s++) {
        const double slope = vec3_dot(sheets->normal[0], border[s]);
        const double share = sheets->away[0] / slope;
        if (!(fabs(share) <= BORDER_MOST))
            continue;
        if (!(fabs(slope) > LEAST_SLOPE * vec3_length(border[s])) || (found && share <= best))
            continue;
        found = true;
        best = share;
        *way = vec3_scale(share, border[s]);
    }
    return found;
}

// Finds the way of the vertex, for all of its lips: into the face that contains it.
static bool find_way(const LipMesh *mesh, const Ring *ring, const Sheets *sheets, Vec3 *way)
{
    bool found = false;
    double best = 0.0;
    if (!ring->closed && go_along_border(mesh, ring, sheets, way))
        return true;
    for (int i = 0; i < ring->count; i++) {
        const Corner corner = corner_at(mesh, ring->turn[i]);
        Vec3 here = vec3_madd(sheets->even, -vec3_dot(sheets->even, corner.up), corner.up);
        double share[2];
        if (!go_to_sheets(sheets, corner.up, &here) ||
            !find_shares(here, corner.a, corner.b, share))
            continue;
        const double inside = fmin(share[0], share[1]);
        if (found && inside <= best)
            continue;
        found = true;
        best = inside;
        *way = here;
    }
    return found;
}

// Expresses the way by one of the faces of a part, that which comes nearest to containing it.
static bool carry(const LipMesh *mesh, const Turn *turn, int count, const Sheets *sheets, Vec3 way,
                  Lip *lip)
{
    bool found = false;
    double best = 0.0;
    for (int i = 0; i < count; i++) {
        const Corner corner = corner_at(mesh, turn[i]);
        Vec3 here = vec3_madd(way, -vec3_dot(way, corner.up), corner.up);
        double share[2];
        if (!go_to_sheets(sheets, corner.up, &here) ||
            !find_shares(here, corner.a, corner.b, share))
            continue;
        const double inside = fmin(share[0], share[1]);
        if ((found && inside <= best) || fabs(share[0]) + fabs(share[1]) > SHARES_MOST)
            continue;
        found = true;
        best = inside;
        *lip = (Lip){turn[i].face, turn[i].corner, {share[0], share[1]}};
    }
    return found;
}

// What keeps the faces of a part from lying flat along the sheet, with all corners on it. A tooth
// of the path, a face with two broken sides, has its tip on the sheet and the others behind it; a
// chip, with three, keeps a tenth of its size.
typedef enum Room { ROOM_NONE, ROOM_BEHIND, ROOM_CHIP } Room;

static Room room_of(const LipMesh *mesh, const Turn *turn, int count)
{
    for (int i = 0; i < count; i++) {
        const unsigned broken = mesh->broken[turn[i].face], k = (unsigned)turn[i].corner;
        if ((broken & 7) == 7) // whatever else is known of the face
            return ROOM_CHIP;
        if ((broken >> (k + 1) % 3 & 1) != 0) // the side opposite to the vertex
            return ROOM_BEHIND;
    }
    return ROOM_NONE;
}

// Moves the sheets of a part so that it has room.
static Sheets make_room(const LipMesh *mesh, const Turn *turn, int count, const Sheets *all)
{
    Sheets sheets = *all;
    const Room room = room_of(mesh, turn, count);
    Vec3 middle = {0.0, 0.0, 0.0};
    for (int i = 0; i < count; i++) {
        const Corner corner = corner_at(mesh, turn[i]);
        middle = vec3_madd(middle, 1.0 / (3.0 * count), vec3_add(corner.a, corner.b));
    }
    for (int s = 0; s < sheets.count && room != ROOM_NONE; s++) {
        const double side = vec3_dot(sheets.normal[s], middle) > sheets.away[s] ? 1.0 : -1.0;
        if (room == ROOM_CHIP)
            sheets.away[s] *= 0.9;
        else
            sheets.away[s] += side * BEHIND * mesh->h;
    }
    return sheets;
}

int cut_lips_place(const LipMesh *mesh, int face, int corner, Lip lip[LIPS_RING])
{
    Ring ring;
    Vec3 way;
    if (!walk_ring(mesh, (Turn){face, corner, false}, &ring))
        return 0;
    Sheets sheets = find_sheets(mesh, &ring, mesh->rest[cut_vertex_at(mesh->level, face, corner)]);
    if (sheets.count == 0 || !find_way(mesh, &ring, &sheets, &way))
        return 0;
    // Not too far: then to planes through where it goes.
    const double length = vec3_length(way), most = LIP_MOST * mesh->h;
    if (!(length <= most)) {
        way = vec3_scale(most / length, way);
        for (int s = 0; s < sheets.count; s++)
            sheets.away[s] = vec3_dot(sheets.normal[s], way);
    }
    int count = 0;
    for (int i = 0, end; i < ring.count; i = end) {
        for (end = i + 1; end < ring.count && !ring.turn[end - 1].broken; end++)
            continue;
        const Sheets own = make_room(mesh, &ring.turn[i], end - i, &sheets);
        count += carry(mesh, &ring.turn[i], end - i, &own, way, &lip[count]);
    }
    return count;
}
