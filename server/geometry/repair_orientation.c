// Gives each component one orientation: turns faces until neighbours run through their common edge
// in opposite directions, then a closed component outward, an open one as most of its faces were.
#include "geometry/repair.h"

#include "base/check.h"

#include <stdlib.h>

// A closed component whose volume is below this fraction of the absolute volumes that it sums up
// has no definite inside: rounding must not decide which side is out.
static const double LEAST_VOLUME = 1e-9;

typedef struct Walk {
    HalfEdges half;
    int *queue;     // triangles of the component, in the order of discovery
    int count;      // of triangles in the queue
    bool *reached;  // [triangle]
    bool *opposite; // [triangle] opposite to the component's first triangle
    bool closed;
} Walk;

// Walks the component of a triangle; false with the fault set if it is one-sided.
static bool walk_component(Repair *repair, Walk *walk, int start)
{
    const TriMesh *mesh = &repair->mesh;
    walk->queue[0] = start;
    walk->count = 1;
    walk->closed = true;
    walk->reached[start] = true;
    for (int i = 0; i < walk->count; i++)
        for (int k = 0; k < 3; k++) {
            int h = 3 * walk->queue[i] + k, twin = walk->half.twin[h];
            if (twin < 0) {
                walk->closed = false;
                continue;
            }
            int other = twin / 3;
            // Neighbours with one orientation run through the edge in opposite directions.
            bool agrees = half_edge_from(mesh, h) == half_edge_to(mesh, twin);
            bool opposite = walk->opposite[h / 3] != !agrees;
            if (!walk->reached[other]) {
                walk->reached[other] = true;
                walk->opposite[other] = opposite;
                walk->queue[walk->count++] = other;
            } else if (walk->opposite[other] != opposite) {
                return repair_fail(repair, half_edge_from(mesh, h), other,
                                   "surface has one side only, like a Moebius strip: faces %d and "
                                   "%d cannot agree on the edge between nodes %d and %d",
                                   repair->polygon[h / 3], repair->polygon[other],
                                   half_edge_from(mesh, h), half_edge_to(mesh, h));
            }
        }
    return true;
}

static bool most_are_opposite(const Walk *walk)
{
    int opposite = 0;
    for (int i = 0; i < walk->count; i++)
        opposite += walk->opposite[walk->queue[i]];
    return 2 * opposite > walk->count;
}

static bool looks_inward(const Repair *repair, const Walk *walk, double extent)
{
    const TriMesh *mesh = &repair->mesh;
    Vec3 origin = mesh->position[mesh->triangle[walk->queue[0]][0]];
    double sum = 0.0, size = 0.0;
    for (int i = 0; i < walk->count; i++) {
        Vec3 x[3];
        for (int k = 0; k < 3; k++) {
            int node = mesh->triangle[walk->queue[i]][k];
            x[k] = vec3_scale(1.0 / extent, vec3_sub(mesh->position[node], origin));
        }
        double volume = vec3_dot(x[0], vec3_cross(x[1], x[2]));
        sum += walk->opposite[walk->queue[i]] ? -volume : volume;
        size += fabs(volume);
    }
    return fabs(sum) > LEAST_VOLUME * size ? sum < 0.0 : most_are_opposite(walk);
}

static double extent_of(const TriMesh *mesh)
{
    double extent = 0.0;
    Vec3 origin = mesh->position[mesh->triangle[0][0]];
    for (int h = 0; h < 3 * mesh->triangle_count; h++) {
        Vec3 d = vec3_sub(mesh->position[half_edge_from(mesh, h)], origin);
        extent = fmax(extent, fmax(fabs(d.x), fmax(fabs(d.y), fabs(d.z))));
    }
    return extent;
}

static void turn_faces(Repair *repair, const Walk *walk)
{
    TriMesh *mesh = &repair->mesh;
    int last = -1;
    for (int t = 0; t < mesh->triangle_count; t++) {
        if (!walk->opposite[t])
            continue;
        int *const pair[2] = {mesh->triangle[t], repair->corner[t]};
        for (int k = 0; k < 2; k++) {
            int swap = pair[k][1];
            pair[k][1] = pair[k][2];
            pair[k][2] = swap;
        }
        repair->repairs->turned_faces += repair->polygon[t] != last;
        last = repair->polygon[t];
    }
}

bool repair_orientation(Repair *repair)
{
    const TriMesh *mesh = &repair->mesh;
    size_t count = (size_t)mesh->triangle_count;
    Walk walk = {.queue = malloc((count + 1) * sizeof *walk.queue),
                 .reached = calloc(count + 1, sizeof *walk.reached),
                 .opposite = calloc(count + 1, sizeof *walk.opposite)};
    ASSERT(walk.queue != NULL && walk.reached != NULL && walk.opposite != NULL);
    half_edge_create(&walk.half, mesh);
    double extent = extent_of(mesh);
    bool ok = true;
    for (int t = 0; ok && t < mesh->triangle_count; t++) {
        if (walk.reached[t])
            continue;
        repair->repairs->components++;
        ok = walk_component(repair, &walk, t);
        // The whole component flips if it faces inward, or if most of its faces disagree with the
        // first.
        bool turn =
            ok && (walk.closed ? looks_inward(repair, &walk, extent) : most_are_opposite(&walk));
        for (int i = 0; turn && i < walk.count; i++)
            walk.opposite[walk.queue[i]] = !walk.opposite[walk.queue[i]];
    }
    if (ok)
        turn_faces(repair, &walk);
    half_edge_destroy(&walk.half);
    free(walk.queue);
    free(walk.reached);
    free(walk.opposite);
    return ok;
}
