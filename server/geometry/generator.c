// Spheres and sheets; generator_stomach.c makes the organ. Load time only.
#include "geometry/generator.h"

#include "base/check.h"
#include "geometry/edges.h"
#include "geometry/hull.h"
#include "geometry/relax.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

static bool check_count(const char *name, int value, int low, int high, Status *status)
{
    if (value >= low && value <= high)
        return true;
    return status_fail(status, STATUS_INVALID, "%s %d outside [%d, %d]", name, value, low, high);
}

static bool check_length(const char *name, double value, Status *status)
{
    // Keeps squares and cubes of lengths far from the limits of double.
    if (value >= 1e-30 && value <= 1e30)
        return true;
    return status_fail(status, STATUS_INVALID, "%s %g outside [1e-30, 1e+30] m", name, value);
}

static Vec3 to_unit_sphere(Vec3 x)
{
    return vec3_unit(x);
}

// Scales unit directions to `radius`. Dividing by the length again puts every node on the sphere to
// the last bits, whatever rounding error the direction carries.
static void inflate(TriMesh *mesh, double radius)
{
    for (int i = 0; i < mesh->node_count; i++)
        mesh->position[i] = vec3_scale(radius, vec3_unit(mesh->position[i]));
}

bool generate_sphere(TriMesh *mesh, int nodes, double radius, Status *status)
{
    if (!check_count("nodes", nodes, 4, 20000, status) || !check_length("radius", radius, status))
        return false;
    mesh_create(mesh, nodes, 2 * nodes - 4);
    // A spiral of golden-angle steps with equal steps in z: even everywhere but at the poles.
    double golden_angle = PI * (3.0 - sqrt(5.0));
    for (int i = 0; i < nodes; i++) {
        double z = 1.0 - (2.0 * i + 1.0) / nodes, rho = sqrt(1.0 - z * z);
        mesh->position[i] = vec3(rho * cos(golden_angle * i), rho * sin(golden_angle * i), z);
    }
    bool convex = hull_triangulate(mesh->position, nodes, mesh->triangle);
    ASSERT(convex);
    relax_mesh(mesh, to_unit_sphere, relax_sweeps(nodes));
    convex = hull_triangulate(mesh->position, nodes, mesh->triangle);
    ASSERT(convex);
    inflate(mesh, radius);
    return true;
}

bool generate_uv_sphere(TriMesh *mesh, int rings, int segments, double radius, Status *status)
{
    if (!check_count("rings", rings, 1, 2000, status) ||
        !check_count("segments", segments, 3, 4000, status) ||
        !check_length("radius", radius, status))
        return false;
    mesh_create(mesh, rings * segments + 2, 2 * rings * segments);
    int last = mesh->node_count - 1;
    mesh->position[0] = vec3(0.0, 0.0, radius);
    mesh->position[last] = vec3(0.0, 0.0, -radius);
    int(*triangle)[3] = mesh->triangle;
    for (int r = 0; r < rings; r++) {
        double latitude = PI * (r + 1) / (rings + 1); // from the north pole
        int ring = 1 + r * segments;
        for (int s = 0; s < segments; s++) {
            double longitude = 2.0 * PI * s / segments;
            int next = (s + 1) % segments;
            mesh->position[ring + s] =
                vec3(radius * sin(latitude) * cos(longitude),
                     radius * sin(latitude) * sin(longitude), radius * cos(latitude));
            if (r == 0)
                memcpy(triangle++, (int[3]){0, ring + s, ring + next}, sizeof *triangle);
            if (r == rings - 1) {
                memcpy(triangle++, (int[3]){last, ring + next, ring + s}, sizeof *triangle);
                continue;
            }
            int below = ring + segments;
            memcpy(triangle++, (int[3]){ring + s, below + s, below + next}, sizeof *triangle);
            memcpy(triangle++, (int[3]){ring + s, below + next, ring + next}, sizeof *triangle);
        }
    }
    ASSERT(triangle == mesh->triangle + mesh->triangle_count);
    return true;
}

static void make_icosahedron(TriMesh *mesh)
{
    // The corners of three golden rectangles.
    const double g = 0.5 * (1.0 + sqrt(5.0));
    const Vec3 corner[12] = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                             {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                             {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    static const int face[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    mesh_create(mesh, 12, 20);
    for (int i = 0; i < 12; i++)
        mesh->position[i] = vec3_unit(corner[i]);
    memcpy(mesh->triangle, face, sizeof face);
}

// Replaces a closed mesh by one with a node in the middle of every edge, on the unit sphere.
static void split_in_four(TriMesh *mesh)
{
    HalfEdges half;
    half_edge_create(&half, mesh);
    TriMesh fine;
    mesh_create(&fine, mesh->node_count + half.count / 2, 4 * mesh->triangle_count);
    memcpy(fine.position, mesh->position, (size_t)mesh->node_count * sizeof *fine.position);
    int *middle = malloc((size_t)half.count * sizeof *middle); // node in the middle of a half-edge
    ASSERT(middle != NULL);
    // One new node per edge: both half-edges share it.
    for (int i = 0, node = mesh->node_count; i < half.count; i += 2, node++) {
        int h = half.order[i];
        middle[h] = middle[half.twin[h]] = node;
        fine.position[node] = vec3_unit(vec3_add(mesh->position[half_edge_from(mesh, h)],
                                                 mesh->position[half_edge_to(mesh, h)]));
    }
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *corner = mesh->triangle[t], *mid = &middle[3 * t];
        const int parts[4][3] = {{corner[0], mid[0], mid[2]},
                                 {mid[0], corner[1], mid[1]},
                                 {mid[2], mid[1], corner[2]},
                                 {mid[0], mid[1], mid[2]}};
        memcpy(fine.triangle[4 * t], parts, sizeof parts);
    }
    free(middle);
    half_edge_destroy(&half);
    mesh_destroy(mesh);
    *mesh = fine;
}

bool generate_ico_sphere(TriMesh *mesh, int subdivisions, double radius, Status *status)
{
    if (!check_count("subdivisions", subdivisions, 0, 8, status) ||
        !check_length("radius", radius, status))
        return false;
    make_icosahedron(mesh);
    for (int i = 0; i < subdivisions; i++)
        split_in_four(mesh);
    inflate(mesh, radius);
    return true;
}

bool generate_sheet(TriMesh *mesh, int columns, int rows, double width, double height,
                    Status *status)
{
    if (!check_count("columns", columns, 2, 4000, status) ||
        !check_count("rows", rows, 2, 4000, status) || !check_length("width", width, status) ||
        !check_length("height", height, status))
        return false;
    mesh_create(mesh, columns * rows, 2 * (columns - 1) * (rows - 1));
    int(*triangle)[3] = mesh->triangle;
    for (int r = 0; r < rows; r++) {
        for (int c = 0; c < columns; c++) {
            int node = r * columns + c;
            mesh->position[node] = vec3(width * ((double)c / (columns - 1) - 0.5),
                                        height * ((double)r / (rows - 1) - 0.5), 0.0);
            if (r == rows - 1 || c == columns - 1)
                continue;
            int above = node + columns;
            memcpy(triangle++, (int[3]){node, node + 1, above + 1}, sizeof *triangle);
            memcpy(triangle++, (int[3]){node, above + 1, above}, sizeof *triangle);
        }
    }
    return true;
}

// Texture coordinates for generated meshes, so that images can be displayed on them.
void generate_texture(TriMesh *mesh, bool closed)
{
    mesh->uv = calloc((size_t)mesh->node_count + 1, sizeof *mesh->uv);
    ASSERT(mesh->uv != NULL);
    const Box box = mesh_box(mesh);
    Vec3 low = box_low(&box), size = box_size(&box), middle = box_middle(&box);
    for (int i = 0; i < mesh->node_count; i++) {
        Vec3 x = vec3_sub(mesh->position[i], low), from = vec3_sub(mesh->position[i], middle);
        mesh->uv[i][0] = closed ? fabs(atan2(from.y, from.x)) / PI : x.x / size.x;
        mesh->uv[i][1] = closed ? x.z / size.z : x.y / size.y;
    }
}
