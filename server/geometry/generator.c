// SPDX-License-Identifier: MIT
// Spheres, sheets and a stomach. Load time only.
#include "geometry/generator.h"

#include "base/check.h"
#include "geometry/edges.h"
#include "geometry/even.h"

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
    // The hull of points on a sphere is their Delaunay triangulation; relaxation moves them.
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
    // The poles are the first and the last node.
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
            // Triangles at the north pole, at the south pole, and two for each cell between the
            // rings.
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
    // Midpoints are the new nodes of a mesh with four times as many triangles.
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
    // Three corner triangles, and one in the middle.
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
    // Row by row; each node but those of the last row and column begins a cell.
    for (int r = 0; r < rows; r++) {
        for (int c = 0; c < columns; c++) {
            int node = r * columns + c;
            mesh->position[node] = vec3(width * ((double)c / (columns - 1) - 0.5),
                                        height * ((double)r / (rows - 1) - 0.5), 0.0);
            if (r == rows - 1 || c == columns - 1)
                continue;
            // The cell's two triangles, with parallel diagonals.
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

// ---------------------------------------------------------------------------------------------
// Stomach: the surface swept by a ball whose radius shrinks from the fundus to the pylorus while
// its centre follows a J in the x-z plane. Such a surface is smooth and round at both ends, and its
// signed distance is simple: the minimum over u of |x - c(u)| - r(u). Load time only.

// Control points of the cubic centre curve, from fundus to pylorus, in lengths of the organ, and
// Bernstein coefficients of the ball's radius. The radius of curvature of the curve is everywhere
// more than 1.5 times the ball's, so that the inner side does not fold.
static const Vec3 CENTER[4] = {
    {0.0, 0.0, 0.45}, {-0.15, 0.0, -0.05}, {0.05, 0.0, -0.60}, {0.60, 0.0, -0.10}};
static const double RADIUS[3] = {0.18, 0.16, 0.08};

static Vec3 center_at(double u)
{
    double v = 1.0 - u;
    double w[4] = {v * v * v, 3.0 * u * v * v, 3.0 * u * u * v, u * u * u};
    Vec3 c = {0.0, 0.0, 0.0};
    for (int i = 0; i < 4; i++)
        c = vec3_madd(c, w[i], CENTER[i]);
    return c;
}

// dc/du.
static Vec3 center_slope(double u)
{
    double v = 1.0 - u;
    double w[3] = {3.0 * v * v, 6.0 * u * v, 3.0 * u * u};
    Vec3 c = {0.0, 0.0, 0.0};
    for (int i = 0; i < 3; i++)
        c = vec3_madd(c, w[i], vec3_sub(CENTER[i + 1], CENTER[i]));
    return c;
}

static double radius_at(double u)
{
    double v = 1.0 - u;
    return v * v * RADIUS[0] + 2.0 * u * v * RADIUS[1] + u * u * RADIUS[2];
}

static double radius_slope(double u)
{
    return 2.0 * ((1.0 - u) * (RADIUS[1] - RADIUS[0]) + u * (RADIUS[2] - RADIUS[1]));
}

// Returns the surface point nearest to x: from the centre of the ball whose surface is nearest,
// through x.
static Vec3 to_stomach(Vec3 x)
{
    enum { SAMPLES = 24, HALVINGS = 30 };
    // Bracket the minimum by sampling.
    double best = HUGE_VAL, u = 0.0;
    for (int i = 0; i <= SAMPLES; i++) {
        double at = (double)i / SAMPLES;
        double distance = vec3_length(vec3_sub(x, center_at(at))) - radius_at(at);
        if (distance < best) {
            best = distance;
            u = at;
        }
    }
    // Between the neighbouring samples the distance has one minimum: bisect on the sign of its
    // slope.
    double low = fmax(0.0, u - 1.0 / SAMPLES), high = fmin(1.0, u + 1.0 / SAMPLES);
    for (int i = 0; i < HALVINGS; i++) {
        u = 0.5 * (low + high);
        Vec3 away = vec3_unit(vec3_sub(x, center_at(u)));
        if (-vec3_dot(away, center_slope(u)) - radius_slope(u) > 0.0)
            high = u;
        else
            low = u;
    }
    Vec3 center = center_at(u);
    return vec3_madd(center, radius_at(u), vec3_unit(vec3_sub(x, center)));
}

// Finds a circle on the surface by a parameter w in [0, 3]: the round end of the fundus in [0, 1],
// the tube in [1, 2], the round end of the pylorus in [2, 3]. `angle` is between the surface normal
// and the curve's backward direction; on the tube its cosine is r' / |c'|, where neighbouring balls
// touch.
static void circle_at(double w, double *u, double *angle)
{
    *u = fmin(fmax(w - 1.0, 0.0), 1.0);
    *angle = acos(radius_slope(*u) / vec3_length(center_slope(*u)));
    if (w < 1.0)
        *angle *= w;
    else if (w > 2.0)
        *angle += (PI - *angle) * (w - 2.0);
}

static Vec3 place(double w, double longitude)
{
    double u, angle;
    circle_at(w, &u, &angle);
    Vec3 along = vec3_unit(center_slope(u));
    Vec3 normal = {-along.z, 0.0, along.x}; // normal, +y and -along are right-handed like x, y, z
    Vec3 direction = vec3_scale(sin(angle) * cos(longitude), normal);
    direction.y += sin(angle) * sin(longitude);
    direction = vec3_madd(direction, -cos(angle), along);
    return vec3_madd(center_at(u), radius_at(u), direction);
}

// Accumulates the area of the straightened organ from the fundus' tip to each of `steps` + 1
// circles.
static void accumulate_area(double *area, int steps)
{
    double way = 0.0, last_u = 0.0, last_axis = 0.0, last_rho = 0.0;
    for (int i = 0; i <= steps; i++) {
        double u, angle;
        circle_at(3.0 * i / steps, &u, &angle);
        // The axis is straight here: where the circle lies along it, and how wide it is.
        way += vec3_length(vec3_sub(center_at(u), center_at(last_u)));
        double axis = way - radius_at(u) * cos(angle), rho = radius_at(u) * sin(angle);
        const double along = axis - last_axis, wider = rho - last_rho;
        // The area of the cone between two circles.
        area[i] = i == 0
                      ? 0.0
                      : area[i - 1] + PI * (rho + last_rho) * sqrt(along * along + wider * wider);
        last_u = u;
        last_axis = axis;
        last_rho = rho;
    }
}

// Places circles of nodes with equal areas of the organ between them.
static void spread_circles(double *w, int count)
{
    enum { STEPS = 3000 };
    double area[STEPS + 1];
    accumulate_area(area, STEPS);
    // Walk along the areas once, since the wanted ones ascend.
    int step = 0;
    for (int i = 0; i < count; i++) {
        double wanted = area[STEPS] * (i + 0.5) / count;
        while (area[step + 1] < wanted)
            step++;
        // Interpolate between two steps.
        double part = (wanted - area[step]) / (area[step + 1] - area[step]);
        w[i] = 3.0 * (step + part) / STEPS;
    }
}

// Places nodes along a spiral of golden-angle steps with equal area between them: even on any
// surface of revolution, and still nearly so after bending. The triangles start as the hull of a
// sphere; while it is stretched to the organ's proportions in small stages, edges turn to stay well
// shaped.
static void make_spiral(TriMesh *mesh)
{
    enum { STAGES = 16 };
    const double slimness = 5.0; // length over width of the straightened organ
    const double golden_angle = PI * (3.0 - sqrt(5.0));
    int n = mesh->node_count;
    // Stretch the sphere in stages, so that edges can follow.
    for (int stage = 0; stage <= STAGES; stage++) {
        double width = pow(slimness, -(double)stage / STAGES);
        for (int i = 0; i < n; i++) {
            double z = 1.0 - (2.0 * i + 1.0) / n, rho = width * sqrt(1.0 - z * z);
            mesh->position[i] = vec3(rho * cos(golden_angle * i), rho * sin(golden_angle * i), z);
        }
        if (stage == 0) {
            bool convex = hull_triangulate(mesh->position, n, mesh->triangle);
            ASSERT(convex);
        }
        relax_mesh(mesh, NULL, 0);
    }
    // Only the positions change now: the triangles of the stretched sphere fit the organ.
    double *w = malloc((size_t)n * sizeof *w);
    ASSERT(w != NULL);
    spread_circles(w, n);
    for (int i = 0; i < n; i++)
        mesh->position[i] = place(w[i], golden_angle * i);
    free(w);
}

// Centres the bounding box and scales its largest side to `length`.
static void fit_box(TriMesh *mesh, double length)
{
    const Box box = mesh_box(mesh);
    const Vec3 middle = box_middle(&box);
    double scale = length / box_extent(&box);
    for (int i = 0; i < mesh->node_count; i++)
        mesh->position[i] = vec3_scale(scale, vec3_sub(mesh->position[i], middle));
}

bool generate_stomach(TriMesh *mesh, int nodes, double length, Status *status)
{
    if (nodes < 60 || nodes > 20000)
        return status_fail(status, STATUS_INVALID, "nodes %d outside [60, 20000]", nodes);
    if (!(length >= 1e-30 && length <= 1e30))
        return status_fail(status, STATUS_INVALID, "length %g outside [1e-30, 1e+30] m", length);
    mesh_create(mesh, nodes, 2 * nodes - 4);
    make_spiral(mesh);
    relax_mesh(mesh, to_stomach, relax_sweeps(nodes));
    fit_box(mesh, length);
    return true;
}
