// A stomach: the surface swept by a ball whose radius shrinks from the fundus to the pylorus while
// its centre follows a J in the x-z plane. Such a surface is smooth and round at both ends, and its
// signed distance is simple: the minimum over u of |x - c(u)| - r(u). Load time only.
#include "geometry/generator.h"

#include "base/check.h"
#include "geometry/hull.h"
#include "geometry/relax.h"

#include <math.h>
#include <stdlib.h>

static const double PI = 3.14159265358979323846;

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
        way += vec3_length(vec3_sub(center_at(u), center_at(last_u)));
        double axis = way - radius_at(u) * cos(angle), rho = radius_at(u) * sin(angle);
        area[i] =
            i == 0 ? 0.0
                   : area[i - 1] + PI * (rho + last_rho) * hypot(axis - last_axis, rho - last_rho);
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
    int step = 0;
    for (int i = 0; i < count; i++) {
        double wanted = area[STEPS] * (i + 0.5) / count;
        while (area[step + 1] < wanted)
            step++;
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
