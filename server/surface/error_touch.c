// SPDX-License-Identifier: MIT
// Tools that push faces of the wall itself and of the finer one, by the law of contact (error.h;
// body/press.h). What pushes of the wall itself do not tell of the force that a tool has felt,
// friction and damping, grows with them. Step thread.
#include "surface/error.h"

#include "body/press.h"
#include "geometry/distance.h"

#include <math.h>
#include <string.h>

enum { COARSE, FINER };

static Vec3 place_of(const SurfaceModel *model, int which, int node)
{
    return which == COARSE ? surface_error_coarse_place(model, node) : model->error->x[node];
}

// Lists the push of a face on a tool, if there is one.
static void touch(SurfaceError *error, int t, int which, const int node[3], const Vec3 x[3])
{
    const double size = error->tool_size[t];
    const Vec3 at = error->tool_at[t];
    const double far = fmax(vec3_length(vec3_sub(x[1], x[0])), vec3_length(vec3_sub(x[2], x[0])));
    if (vec3_length(vec3_sub(at, x[0])) > size + far || error->push_count == error->push_capacity)
        return;
    ClosestPair pair;
    distance_point_triangle(at, x, &pair);
    // A face behind the tool is beyond the wall.
    const Vec3 normal = vec3_unit(vec3_sub(at, pair.on_triangle));
    if (!(pair.distance < size) || !(vec3_dot(normal, error->tool_force[t]) > 0.0))
        return;
    Vec3 rest[3];
    for (int k = 0; k < 3; k++)
        rest[k] = error->node[node[k]].rest[which];
    const double area =
        0.5 * vec3_length(vec3_cross(vec3_sub(rest[1], rest[0]), vec3_sub(rest[2], rest[0])));
    const FacePress press = face_press(size - pair.distance, size, error->barrier);
    ErrorPush *push = &error->push[error->push_count++];
    *push = (ErrorPush){.tool = t, .normal = normal};
    memcpy(push->node, node, sizeof push->node);
    memcpy(push->weight, pair.weight, sizeof push->weight);
    push->force = error->tool_kappa[t] * area * press.depth;
    push->k = error->tool_kappa[t] * area * press.slope;
}

void surface_error_touches(const SurfaceModel *model, int which, int first, int end)
{
    SurfaceError *error = model->error;
    if (first == 0)
        error->push_count = 0;
    for (int f = first; f < end; f++)
        for (int k = 0; k < (which == COARSE ? 1 : 4); k++) {
            int node[3];
            Vec3 x[3];
            if (which == COARSE)
                memcpy(node, error->face[f], sizeof node);
            else
                surface_error_child(error->face[f], k, node);
            for (int j = 0; j < 3; j++)
                x[j] = place_of(model, which, node[j]);
            for (int t = 0; t < error->tool_count; t++)
                if (error->tool_kappa[t] > 0.0)
                    touch(error, t, which, node, x);
        }
}

// Sums the pushes for each tool. One that no face of the wall itself pushes holds what it touches.
static void sum_pushes(SurfaceError *error, int which)
{
    Vec3 *sum = which == COARSE ? error->tool_coarse : error->tool_finer;
    for (int i = 0; i < error->push_count; i++) {
        const ErrorPush *push = &error->push[i];
        sum[push->tool] = vec3_madd(sum[push->tool], push->force, push->normal);
        error->tool_pushes[push->tool] += which == COARSE ? push->force : 0.0;
    }
    for (int t = 0; t < error->tool_count && which == COARSE; t++) {
        if (!(error->tool_pushes[t] > 0.0)) {
            error->tool_kappa[t] = 0.0;
            continue;
        }
        // More than the pushes themselves is of another moment, of a tool that grazes.
        const Vec3 rest = vec3_sub(error->tool_force[t], sum[t]);
        error->tool_rest[t] =
            vec3_scale(1.0 / fmax(error->tool_pushes[t], vec3_length(rest)), rest);
    }
}

void surface_error_coarse_touch(const SurfaceModel *model, int first, int end)
{
    surface_error_touches(model, COARSE, first, end);
    if (end == model->error->face_count)
        sum_pushes(model->error, COARSE);
}

void surface_error_touch(const SurfaceModel *model, int first, int end)
{
    surface_error_touches(model, FINER, first, end);
    if (end == model->error->face_count)
        sum_pushes(model->error, FINER);
}

// Adds pushes and their shares of the rest to the forces on nodes.
static void push(SurfaceError *error, int which, int first, int end)
{
    Vec3 *force = which == COARSE ? error->coarse : error->defect;
    for (int i = first; i < end; i++) {
        const ErrorPush *by = &error->push[i];
        const Vec3 on_tool =
            vec3_scale(by->force, vec3_add(by->normal, error->tool_rest[by->tool]));
        for (int k = 0; k < 3; k++) {
            const double w = by->weight[k];
            force[by->node[k]] = vec3_madd(force[by->node[k]], -w, on_tool);
            Sym3 *to = &error->diagonal[by->node[k]];
            if (which == FINER)
                *to = sym3_madd(*to, 1.0, sym3_outer(w * w * by->k, by->normal));
        }
    }
}

void surface_error_coarse_push(const SurfaceModel *model, int first, int end)
{
    push(model->error, COARSE, first, end);
}

void surface_error_push(const SurfaceModel *model, int first, int end)
{
    push(model->error, FINER, first, end);
}

void surface_error_product_pushes(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    if (first == 0)
        memset(error->tool_slope, 0, sizeof error->tool_slope);
    for (int i = first; i < end; i++) {
        const ErrorPush *by = &error->push[i];
        double deeper = 0.0;
        for (int k = 0; k < 3; k++)
            deeper += by->weight[k] * vec3_dot(by->normal, error->way[by->node[k]]);
        Vec3 *slope = &error->tool_slope[by->tool];
        *slope = vec3_madd(*slope, by->k * deeper, by->normal);
        for (int k = 0; k < 3; k++) {
            Vec3 *to = &error->change[by->node[k]];
            *to = vec3_madd(*to, by->weight[k] * by->k * deeper, by->normal);
        }
    }
}
