// SPDX-License-Identifier: MIT
// Pairs of triangles that pass through each other. Sweeps along the longest side of the mesh, and
// gives up in time: for meshes as people have them a triangle has few others beside it.
#include "base/check.h"
#include "geometry/mesh.h"

#include <stdlib.h>

// Most comparisons of boxes, about a second, and how many of them one of triangles counts for.
static const long MOST_LOOKS = 300000000, TRIANGLES = 20;

typedef struct Swept {
    float low[3], high[3]; // box, the swept axis first; rounding makes pairs, never takes any
    int triangle;
} Swept;

static int compare_low(const void *a, const void *b)
{
    const Swept *p = a, *q = b;
    return (p->low[0] > q->low[0]) - (p->low[0] < q->low[0]);
}

// Returns six times the volume of the tetrahedron a b c d.
static double volume_of(Vec3 a, Vec3 b, Vec3 c, Vec3 d)
{
    return vec3_dot(vec3_sub(b, a), vec3_cross(vec3_sub(c, a), vec3_sub(d, a)));
}

// True if the line from p to q passes through the inside of a triangle; one that touches does not.
static bool pierces(Vec3 p, Vec3 q, const Vec3 x[3])
{
    if (!(volume_of(x[0], x[1], x[2], p) * volume_of(x[0], x[1], x[2], q) < 0.0))
        return false;
    const double a = volume_of(p, q, x[0], x[1]), b = volume_of(p, q, x[1], x[2]);
    const double c = volume_of(p, q, x[2], x[0]);
    return (a > 0.0 && b > 0.0 && c > 0.0) || (a < 0.0 && b < 0.0 && c < 0.0);
}

// True if a triangle lies on one side of the plane of another.
static bool beside(const Vec3 x[3], const Vec3 y[3])
{
    int sides = 0;
    for (int i = 0; i < 3; i++) {
        const double volume = volume_of(x[0], x[1], x[2], y[i]);
        sides += (volume > 0.0) - (volume < 0.0);
    }
    return abs(sides) == 3;
}

static bool cross(const TriMesh *mesh, int t, int u)
{
    Vec3 x[3], y[3];
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            if (mesh->triangle[t][i] == mesh->triangle[u][k])
                return false;
        x[i] = mesh->position[mesh->triangle[t][i]];
        y[i] = mesh->position[mesh->triangle[u][i]];
    }
    if (beside(x, y) || beside(y, x))
        return false;
    for (int i = 0; i < 3; i++)
        if (pierces(x[i], x[(i + 1) % 3], y) || pierces(y[i], y[(i + 1) % 3], x))
            return true;
    return false;
}

// Boxes of all triangles in units of the mesh's extent, sorted by their low sides.
static Swept *sweep(const TriMesh *mesh)
{
    const Box all = mesh_box(mesh);
    const Vec3 size = box_size(&all);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const double scale = 1.0 / fmax(size.x, fmax(size.y, size.z));
    Swept *swept = malloc(((size_t)mesh->triangle_count + 1) * sizeof *swept);
    ASSERT(swept != NULL);
    for (int t = 0; t < mesh->triangle_count; t++) {
        Box box = box_empty();
        for (int k = 0; k < 3; k++)
            box_add(&box, mesh->position[mesh->triangle[t][k]]);
        swept[t].triangle = t;
        for (int a = 0; a < 3; a++) {
            const int from = (axis + a) % 3;
            swept[t].low[a] = (float)((box.low[from] - all.low[from]) * scale - 1e-6);
            swept[t].high[a] = (float)((box.high[from] - all.low[from]) * scale + 1e-6);
        }
    }
    qsort(swept, (size_t)mesh->triangle_count, sizeof *swept, compare_low);
    return swept;
}

MeshCrossings mesh_find_crossings(const TriMesh *mesh)
{
    MeshCrossings found = {.first = -1, .second = -1, .all = true};
    Swept *swept = sweep(mesh);
    long looks = 0;
    for (int i = 0; i < mesh->triangle_count && found.all; i++)
        for (int k = i + 1; k < mesh->triangle_count && swept[k].low[0] <= swept[i].high[0]; k++) {
            const Swept *p = &swept[i], *q = &swept[k];
            if (++looks > MOST_LOOKS) {
                found.all = false;
                break;
            }
            if (p->low[1] > q->high[1] || q->low[1] > p->high[1] || p->low[2] > q->high[2] ||
                q->low[2] > p->high[2])
                continue;
            looks += TRIANGLES;
            if (!cross(mesh, p->triangle, q->triangle))
                continue;
            if (found.pairs++ == 0) {
                found.first = p->triangle;
                found.second = q->triangle;
            }
        }
    free(swept);
    return found;
}
