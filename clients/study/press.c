#include "study/press.h"

#include "dynamics/body.h"
#include "geometry/box.h"

#include <math.h>

static const double DEPTH = 0.1;  // as a fraction of the body's thickness
static const double CLEAR = 0.05; // as a fraction of it, before the tool starts

static const double FLAT = 0.05; // as a fraction of the extent: no thickness

static bool has_faces(const Body *body, int node)
{
    return body->surface.node_face_end[node] > body->surface.node_face_start[node];
}

static Vec3 position_of(const Body *body, int node)
{
    Vec3 x;
    body->ops->read_nodes(body->model, &node, 1, &x, NULL);
    return x;
}

double press_extent(const Body *body, double *thickness)
{
    Box box = box_empty();
    for (int i = 0; i < body->surface.node_used; i++)
        if (has_faces(body, i))
            box_add(&box, position_of(body, i));
    const double extent = fmax(0.0, box_extent(&box));
    *thickness = extent;
    for (int k = 0; k < 3; k++)
        if (box.high[k] - box.low[k] > FLAT * extent) // a sheet is as thick as it is long
            *thickness = fmin(*thickness, box.high[k] - box.low[k]);
    return extent;
}

// Finds the mean positions of all nodes and of the fixed ones.
static int find_middles(const Body *body, Vec3 *middle, Vec3 *held)
{
    int count = 0, held_count = 0;
    *middle = *held = (Vec3){0.0, 0.0, 0.0};
    for (int i = 0; i < body->surface.node_used; i++) {
        if (!has_faces(body, i))
            continue;
        Vec3 x = position_of(body, i);
        *middle = vec3_add(*middle, x);
        count++;
        if (!body->ops->is_fixed(body->model, i))
            continue;
        *held = vec3_add(*held, x);
        held_count++;
    }
    *middle = vec3_scale(1.0 / fmax(count, 1), *middle);
    *held = vec3_scale(1.0 / fmax(held_count, 1), *held);
    return held_count;
}

// Returns the mean outward normal of the faces around a node.
static Vec3 normal_at(const Body *body, int node)
{
    const BodySurface *surface = &body->surface;
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int k = surface->node_face_start[node]; k < surface->node_face_end[node]; k++) {
        const int *corner = surface->face[surface->node_face[k]];
        Vec3 x[3];
        body->ops->read_nodes(body->model, corner, 3, x, NULL);
        sum = vec3_add(sum, vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0])));
    }
    return vec3_unit(sum);
}

bool press_find_site(const Body *body, bool plane, PressSite *site)
{
    Vec3 middle, held;
    int node = -1;
    double extent = press_extent(body, &site->thickness);
    int held_count = find_middles(body, &middle, &held);
    Vec3 away = vec3_sub(middle, held);
    if (plane)
        away.z = 0.0;
    // Fixed all around, or not at all: press from above.
    if (held_count == 0 || vec3_length(away) < 0.01 * extent)
        away = plane ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0);
    away = vec3_unit(away);
    double best = -HUGE_VAL;
    for (int i = 0; i < body->surface.node_used; i++) {
        if (!has_faces(body, i) || body->ops->is_fixed(body->model, i))
            continue;
        Vec3 arm = vec3_sub(position_of(body, i), middle);
        double along = vec3_dot(arm, away);
        double beside = vec3_length(vec3_sub(arm, vec3_scale(along, away)));
        if (along - beside <= best)
            continue;
        best = along - beside;
        node = i;
    }
    if (node < 0)
        return false;
    site->point = position_of(body, node);
    if (plane) { // faces of a plane body have no usable normal
        site->inward = vec3_sub(middle, site->point);
        site->inward.z = site->point.z = 0.0;
        site->inward = vec3_unit(site->inward);
    } else { // along the normal, so that the tool does not slip off
        site->inward = vec3_scale(-1.0, normal_at(body, node));
    }
    site->edge = body->surface.longest_edge;
    return true;
}

double press_depth(const PressSite *site)
{
    return DEPTH * site->thickness;
}

// Returns the shortest rotation from one unit vector to another.
static Quat turn_to(Vec3 from, Vec3 to)
{
    Vec3 axis = vec3_cross(from, to);
    double sine = vec3_length(axis), angle = atan2(sine, vec3_dot(from, to));
    if (sine < 1e-9) { // equal or opposite: rotate about any perpendicular axis
        Vec3 across = fabs(from.x) < 0.7 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
        axis = vec3_cross(from, across);
        sine = vec3_length(axis);
    }
    return quat_from_rotation(vec3_scale(angle / sine, axis));
}

void press_plan(StudyPress *press, int tool, const ToolOptions *options, const PressSite *site,
                bool plane)
{
    const Capsule *tip = &options->capsule[0];
    Vec3 shaft = vec3_sub(tip->to, tip->from), at = tip->from;
    press->tool = tool;
    press->orientation = (Quat){1.0, 0.0, 0.0, 0.0};
    press->inward = site->inward;
    if (!plane && vec3_length(shaft) > 0.0)
        press->orientation = turn_to(vec3_unit(shaft), vec3_scale(-1.0, site->inward));
    if (plane && tip->from.z * tip->to.z < 0.0) // the point where its axis intersects the plane
        at = vec3_madd(tip->from, -tip->from.z / shaft.z, shaft);
    double clear = CLEAR * site->thickness;
    Vec3 tip_at = vec3_madd(site->point, -(tip->radius + clear), site->inward);
    press->start = vec3_sub(tip_at, quat_rotate(press->orientation, at));
    press->way = clear + press_depth(site);
    press->down_s = 0.2;
    press->hold_s = 0.2;
    press->back_s = 0.2;
}

static double smooth_way(const StudyPress *press, double time)
{
    const double pi = 3.14159265358979323846;
    double back = time - press->down_s - press->hold_s;
    double s = fmin(fmax(time / press->down_s, 0.0), 1.0);
    if (back > 0.0)
        s = 1.0 - fmin(back / press->back_s, 1.0);
    return press->way * 0.5 * (1.0 - cos(pi * s));
}

double press_way_at(const StudyPress *press, double time, double knot_s)
{
    // Tolerate rounding: a tick that ends at a knot must not use the next segment.
    double knot = floor(time / knot_s + 1e-9);
    double from = smooth_way(press, knot * knot_s), to = smooth_way(press, (knot + 1.0) * knot_s);
    return from + (to - from) * fmax(time / knot_s - knot, 0.0);
}
