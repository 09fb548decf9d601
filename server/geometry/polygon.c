// Ear clipping in the plane of the polygon. An ear is a corner whose triangle contains no other
// corner; cutting it off leaves a polygon with one corner less. The best shaped ear goes first, and
// ears that would leave a corner almost on their own long edge go last: the remaining sliver would
// dictate the time step. The quality of every corner is stored and only the two beside a cut are
// updated, so that the work is quadratic in the corners.
#include "geometry/polygon.h"

#include "geometry/mesh.h"

#include <string.h>

// Smallest allowed distance of another corner from an ear, as a fraction of the ear.
static const double COMFORT = 1e-2;

enum { EAR_NONE, EAR_TIGHT, EAR_GOOD };

typedef struct Point {
    double x, y;
} Point;

typedef struct Ears {
    int count;
    Vec3 corner[POLYGON_CORNERS]; // relative to the first, divided by the extent
    Point point[POLYGON_CORNERS]; // in the plane, turning counter-clockwise
    int key[POLYGON_CORNERS];
    int next[POLYGON_CORNERS], previous[POLYGON_CORNERS];
    int standing[POLYGON_CORNERS];
    double quality[POLYGON_CORNERS]; // relative height of the ear
} Ears;

static double component(Vec3 v, int axis)
{
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

// Returns twice the area vector of the polygon (Newell).
static Vec3 area_vector(const Vec3 *x, int count)
{
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int i = 1; i + 1 < count; i++)
        sum = vec3_add(sum, vec3_cross(vec3_sub(x[i], x[0]), vec3_sub(x[i + 1], x[0])));
    return sum;
}

// Drops the coordinate in which the polygon is thinnest; containment and convexity are invariant
// under such a projection.
static Point project(Vec3 x, Vec3 normal)
{
    Vec3 size = {fabs(normal.x), fabs(normal.y), fabs(normal.z)};
    int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    double u = component(x, (axis + 1) % 3), v = component(x, (axis + 2) % 3);
    return component(normal, axis) > 0.0 ? (Point){u, v} : (Point){v, u};
}

// Returns twice the signed area of a triangle in the plane.
static double turn(Point a, Point b, Point c)
{
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// True if p lies in the triangle, widened by the fraction `margin` of its area over each edge.
static bool holds(Point a, Point b, Point c, double margin, Point p)
{
    double least = -margin * turn(a, b, c);
    return turn(a, b, p) >= least && turn(b, c, p) >= least && turn(c, a, p) >= least;
}

static void judge(Ears *ears, int i)
{
    int a = ears->previous[i], c = ears->next[i];
    const int corner[3] = {a, i, c};
    Point x = ears->point[a], y = ears->point[i], z = ears->point[c];
    ears->standing[i] = EAR_NONE;
    ears->quality[i] = mesh_relative_height(ears->corner, corner);
    if (!(turn(x, y, z) > 0.0) || !(ears->quality[i] > MESH_SMALLEST_HEIGHT))
        return;
    ears->standing[i] = EAR_GOOD;
    for (int k = ears->next[c]; k != a; k = ears->next[k]) {
        int key = ears->key[k];
        if (key == ears->key[a] || key == ears->key[i] || key == ears->key[c] ||
            !holds(x, y, z, COMFORT, ears->point[k]))
            continue;
        ears->standing[i] = EAR_TIGHT;
        if (holds(x, y, z, 0.0, ears->point[k])) {
            ears->standing[i] = EAR_NONE;
            return;
        }
    }
}

// Returns the best of the remaining ears, or -1.
static int find_ear(const Ears *ears, int first)
{
    int best = -1, i = first;
    do {
        if (ears->standing[i] != EAR_NONE &&
            (best < 0 || ears->standing[i] > ears->standing[best] ||
             (ears->standing[i] == ears->standing[best] && ears->quality[i] > ears->quality[best])))
            best = i;
        i = ears->next[i];
    } while (i != first);
    return best;
}

// True if only a line remains: then every corner counts as an ear.
static bool is_flat(const Ears *ears, int first)
{
    for (int i = ears->next[first]; ears->next[i] != first; i = ears->next[i]) {
        const int corner[3] = {first, i, ears->next[i]};
        if (mesh_relative_height(ears->corner, corner) > MESH_SMALLEST_HEIGHT)
            return false;
    }
    return true;
}

static bool clip(Ears *ears, int (*triangle)[3])
{
    for (int i = 0; i < ears->count; i++)
        judge(ears, i);
    int first = 0;
    for (int t = 0; t < ears->count - 2; t++) {
        int ear = find_ear(ears, first);
        if (ear < 0) {
            if (!is_flat(ears, first))
                return false;
            ear = ears->next[first];
        }
        int a = ears->previous[ear], c = ears->next[ear];
        triangle[t][0] = a;
        triangle[t][1] = ear;
        triangle[t][2] = c;
        ears->next[a] = c;
        ears->previous[c] = a;
        first = a < c ? a : c;
        judge(ears, a);
        judge(ears, c);
    }
    return true;
}

// Chooses where the list of corners begins and its direction, so that equal polygons are cut alike:
// at the smallest key, towards its smaller neighbour. Returns the step, +1 or -1.
static int canonical_order(const int *key, int count, int *first)
{
    *first = 0;
    for (int i = 1; i < count; i++)
        if (key[i] < key[*first])
            *first = i;
    return key[(*first + 1) % count] <= key[(*first + count - 1) % count] ? 1 : -1;
}

// Makes triangles from one corner to all edges, if that is a valid way to cut the polygon.
static bool fan(const Vec3 *x, int count, int first, int (*triangle)[3])
{
    Vec3 normal = area_vector(x, count);
    for (int i = 1; i + 1 < count; i++) {
        const int corner[3] = {first, (first + i) % count, (first + i + 1) % count};
        if (turn(project(x[corner[0]], normal), project(x[corner[1]], normal),
                 project(x[corner[2]], normal)) < 0.0)
            return false;
        memcpy(triangle[i - 1], corner, sizeof corner);
    }
    return true;
}

bool polygon_triangulate(const Vec3 *corner, const int *key, int count, int (*triangle)[3])
{
    int first, step = canonical_order(key, count, &first);
    if (count > POLYGON_CORNERS)
        return fan(corner, count, first, triangle);
    static _Thread_local Ears ears; // too large for every stack
    // Scale by the extent: the thresholds are relative.
    double extent = 0.0;
    for (int i = 0; i < count; i++) {
        Vec3 d = vec3_sub(corner[i], corner[first]);
        extent = fmax(extent, fmax(fabs(d.x), fmax(fabs(d.y), fabs(d.z))));
    }
    ears.count = count;
    for (int i = 0; i < count; i++) {
        int from = (first + step * i + count) % count;
        ears.corner[i] = vec3_scale(1.0 / extent, vec3_sub(corner[from], corner[first]));
        ears.key[i] = key[from];
        ears.next[i] = (i + 1) % count;
        ears.previous[i] = (i + count - 1) % count;
    }
    Vec3 normal = area_vector(ears.corner, count);
    for (int i = 0; i < count; i++)
        ears.point[i] = project(ears.corner[i], normal);
    if (!clip(&ears, triangle))
        return false;
    // Return to the caller's order of corners.
    for (int t = 0; t < count - 2; t++) {
        for (int k = 0; k < 3; k++)
            triangle[t][k] = (first + step * triangle[t][k] + count) % count;
        if (step < 0) {
            int swap = triangle[t][1];
            triangle[t][1] = triangle[t][2];
            triangle[t][2] = swap;
        }
    }
    return true;
}
