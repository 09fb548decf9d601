// SPDX-License-Identifier: MIT
// Steps of the finer wall towards its equilibrium: conjugate gradients with the blocks of the
// diagonal (error.h). Step thread.
#include "surface/error.h"

#include <math.h>

enum { FINER = 1 };
enum { BEFORE, AFTER };

static bool is_free(const SurfaceError *error, int i)
{
    return !error->node[i].fixed && !error->node[i].tied && error->tool[i] < 0;
}

void surface_error_prepare(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    if (first == 0) {
        error->product[BEFORE] = 0.0;
        error->iteration = 0;
    }
    for (int i = first; i < end; i++) {
        double determinant;
        const Sym3 of = sym3_adjugate(error->diagonal[i], &determinant);
        const bool moves = is_free(error, i) && determinant > 0.0;
        error->diagonal[i] = sym3_scale(moves ? 1.0 / determinant : 0.0, of);
        error->way[i] = sym3_times(error->diagonal[i], error->defect[i]);
        error->product[BEFORE] += vec3_dot(error->way[i], error->defect[i]);
    }
}

// Tied nodes go with their parents, which have lower numbers.
void surface_error_start(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    const double least = surface_error_floor(error);
    error->grows = error->curvature = error->product[AFTER] = 0.0;
    for (int i = first; i < end; i++) {
        const ErrorNode *node = &error->node[i];
        if (node->tied)
            error->way[i] =
                vec3_scale(0.5, vec3_add(error->way[node->parent[0]], error->way[node->parent[1]]));
        error->change[i] = vec3_scale(node->finer * least, error->way[i]);
    }
}

void surface_error_product_links(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int i = first; i < end; i++) {
        const ErrorLink *link = &error->net[FINER].link[i];
        const int a = link->node[0], b = link->node[1];
        const ErrorPull *pull = &error->pull[i];
        const Vec3 d = vec3_sub(error->way[a], error->way[b]);
        const double along = (pull->along_k - pull->k) * vec3_dot(pull->along, d);
        const Vec3 force = vec3_madd(vec3_scale(pull->k, d), along, pull->along);
        error->change[a] = vec3_add(error->change[a], force);
        error->change[b] = vec3_sub(error->change[b], force);
    }
}

void surface_error_product_hinges(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    const double scale = error->stiffness;
    for (int i = first; i < end; i++) {
        const ErrorHinge *hinge = &error->net[FINER].hinge[i];
        const Vec3 *slope = error->turn[i].slope, origin = error->way[hinge->node[0]];
        double turn = 0.0;
        for (int k = 0; k < 3; k++)
            turn += vec3_dot(slope[k], vec3_sub(error->way[hinge->node[k + 1]], origin));
        surface_error_turn_by(hinge, -scale * hinge->stiffness * turn, slope, error->change);
    }
}

// What is closed in resists a change of its volume.
void surface_error_grow(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int i = first; i < end; i++)
        error->grows += vec3_dot(error->swell[i], error->way[i]);
}

void surface_error_resist(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int i = first; i < end; i++)
        error->change[i] =
            vec3_madd(error->change[i], error->yield * error->grows, error->swell[i]);
}

void surface_error_pass(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int j = first; j < end; j++) {
        const int i = error->tied[j];
        for (int k = 0; k < 2; k++) {
            Vec3 *to = &error->change[error->node[i].parent[k]];
            *to = vec3_madd(*to, 0.5, error->change[i]);
        }
        error->change[i] = (Vec3){0.0, 0.0, 0.0};
    }
}

void surface_error_curvature(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int i = first; i < end; i++)
        error->curvature += vec3_dot(error->way[i], error->change[i]);
}

void surface_error_move(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    const double step = error->curvature > 0.0 ? error->product[BEFORE] / error->curvature : 0.0;
    for (int t = 0; t < error->tool_count && first == 0; t++)
        if (error->tool_kappa[t] > 0.0)
            error->tool_finer[t] = vec3_madd(error->tool_finer[t], step, error->tool_slope[t]);
    for (int i = first; i < end; i++) {
        error->moved[i] = vec3_madd(error->moved[i], step, error->way[i]);
        error->defect[i] = vec3_madd(error->defect[i], -step, error->change[i]);
        error->change[i] = sym3_times(error->diagonal[i], error->defect[i]);
        error->product[AFTER] += vec3_dot(error->change[i], error->defect[i]);
    }
}

void surface_error_turn(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    const double ratio =
        error->product[BEFORE] > 0.0 ? error->product[AFTER] / error->product[BEFORE] : 0.0;
    for (int i = first; i < end; i++)
        error->way[i] = vec3_madd(error->change[i], ratio, error->way[i]);
    if (end == error->node_count)
        error->product[BEFORE] = error->product[AFTER];
}
