// SPDX-License-Identifier: MIT
// The forces that the finer wall does not balance (error.h). Step thread.
#include "surface/error.h"

#include "surface/cavity.h"
#include "surface/detail/detail.h"

#include <math.h>
#include <string.h>

enum { COARSE, FINER };

// How far a tool that holds something reaches, over its radius: it yields a little.
static const double REACH = 1.05;
// Motions slower than this are those of a body at rest [s].
static const double CALM = 0.5;

double surface_error_floor(const SurfaceError *error)
{
    return error->hold + error->inertia / (CALM * CALM);
}

Vec3 surface_error_coarse_place(const SurfaceModel *model, int node)
{
    const ErrorNode *at = &model->error->node[node];
    const Vec3 u = rows_vector(&model->basis, model->error->rows, model->slot[at->model], 0);
    // What hangs now has another rest position than it had.
    return model->basis.displaced ? vec3_add(at->rest[COARSE], u) : u;
}

// ---------------------------------------------------------------------------------------------
// Where the nodes of the finer wall are put

// Finds the directions along an edge, out of the wall and across, in the wall itself; false if
// there are none.
static bool frame_at(const SurfaceModel *model, const ErrorNode *node, bool rest, Vec3 axis[3])
{
    const SurfaceError *error = model->error;
    const int at[4] = {node->parent[0], node->parent[1], node->wing[0], node->wing[1]};
    Vec3 x[4], normal = {0.0, 0.0, 0.0};
    for (int k = 0; k < 4 && at[k] >= 0; k++)
        x[k] = rest ? error->node[at[k]].rest[COARSE] : surface_error_coarse_place(model, at[k]);
    const Vec3 edge = vec3_sub(x[1], x[0]);
    if (node->wing[0] >= 0)
        normal = vec3_cross(edge, vec3_sub(x[2], x[0]));
    if (node->wing[0] >= 0 && node->wing[1] >= 0)
        normal = vec3_add(normal, vec3_cross(vec3_sub(x[3], x[0]), edge));
    if (!(vec3_length(edge) * vec3_length(normal) > 0.0))
        return false;
    axis[0] = vec3_unit(edge);
    axis[1] = vec3_unit(normal);
    axis[2] = vec3_cross(axis[0], axis[1]);
    return true;
}

// What sticks out of a face at rest turns with it.
void surface_error_place(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int i = first; i < end; i++) {
        const ErrorNode *node = &error->node[i];
        const int *at = node->parent;
        error->coarse[i] = (Vec3){0.0, 0.0, 0.0};
        if (node->model >= 0 && !node->hangs) {
            error->x[i] = surface_error_coarse_place(model, i);
            continue;
        }
        Vec3 rest[3], now[3];
        const Vec3 between = vec3_scale(
            0.5, vec3_add(error->node[at[0]].rest[FINER], error->node[at[1]].rest[FINER]));
        const Vec3 out = vec3_sub(node->rest[FINER], between);
        error->x[i] = vec3_scale(0.5, vec3_add(error->x[at[0]], error->x[at[1]]));
        if (node->tied || !frame_at(model, node, true, rest) || !frame_at(model, node, false, now))
            continue;
        for (int k = 0; k < 3; k++)
            error->x[i] = vec3_madd(error->x[i], vec3_dot(out, rest[k]), now[k]);
    }
}

// ---------------------------------------------------------------------------------------------
// Forces of springs, hinges and pressure

// Returns the pull of a spring [N], and its stiffness against being stretched [N/m].
static double pull_of(const SurfaceModel *model, const ErrorLink *link, double length,
                      double *tangent)
{
    const double x = length - link->length;
    const double k = link->stiffness * model->error->stiffness;
    *tangent = k;
    if (model->springs.inverse == NULL || x <= 0.0)
        return k * x;
    const double unit = model->stiffening.strain * link->length, q = x * x / (unit * unit);
    *tangent = k * stiffening_tangent(&model->stiffening.curve, q);
    return k * stiffening_factor(&model->stiffening.curve, q) * x;
}

void surface_error_coarse_links(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int i = first; i < end; i++) {
        const ErrorLink *link = &error->net[COARSE].link[i];
        const int a = link->node[0], b = link->node[1];
        const Vec3 d =
            vec3_sub(surface_error_coarse_place(model, a), surface_error_coarse_place(model, b));
        const double length = vec3_length(d);
        double tangent;
        const double pull = pull_of(model, link, length, &tangent);
        const Vec3 force = vec3_scale(length > 1e-12 ? pull / length : 0.0, d);
        error->coarse[a] = vec3_sub(error->coarse[a], force);
        error->coarse[b] = vec3_add(error->coarse[b], force);
    }
}

// Returns the moment of a hinge [N m], and how its angle changes with nodes 1 to 3.
static double bend(const SurfaceModel *model, const ErrorHinge *hinge, const Vec3 x[4],
                   Vec3 slope[3])
{
    const Vec3 edge = vec3_sub(x[1], x[0]), c = vec3_sub(x[2], x[0]), d = vec3_sub(x[3], x[0]);
    const Vec3 left = vec3_cross(edge, c), right = vec3_cross(d, edge);
    const double square[2] = {vec3_dot(left, left), vec3_dot(right, right)};
    if (!(square[0] > 0.0 && square[1] > 0.0)) {
        slope[0] = slope[1] = slope[2] = (Vec3){0.0, 0.0, 0.0};
        return 0.0;
    }
    const double length2 = vec3_dot(edge, edge), length = sqrt(length2);
    const double s = vec3_dot(c, edge) / length2, t = vec3_dot(d, edge) / length2;
    slope[1] = vec3_scale(-length / square[0], left);
    slope[2] = vec3_scale(-length / square[1], right);
    slope[0] = vec3_scale(-1.0, vec3_add(vec3_scale(s, slope[1]), vec3_scale(t, slope[2])));
    const double angle = atan2(-vec3_dot(left, d) * length, vec3_dot(left, right));
    return hinge->stiffness * model->error->stiffness *
           remainder(angle - hinge->angle, 2.0 * acos(-1.0));
}

void surface_error_turn_by(const ErrorHinge *hinge, double moment, const Vec3 slope[3], Vec3 *force)
{
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; k++) {
        Vec3 *to = &force[hinge->node[k + 1]];
        *to = vec3_madd(*to, -moment, slope[k]);
        sum = vec3_add(sum, slope[k]);
    }
    force[hinge->node[0]] = vec3_madd(force[hinge->node[0]], moment, sum);
}

void surface_error_coarse_hinges(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int i = first; i < end; i++) {
        const ErrorHinge *hinge = &error->net[COARSE].hinge[i];
        Vec3 x[4], slope[3];
        for (int k = 0; k < 4; k++)
            x[k] = surface_error_coarse_place(model, hinge->node[k]);
        surface_error_turn_by(hinge, bend(model, hinge, x, slope), slope, error->coarse);
    }
}

// Adds a pressure on a triangle to the forces at its corners; returns the volume between it and
// the origin [m3].
static double press(double pressure, const int node[3], const Vec3 x[3], Vec3 *force)
{
    const Vec3 third =
        vec3_scale(pressure / 6.0, vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0])));
    for (int k = 0; k < 3; k++)
        force[node[k]] = vec3_add(force[node[k]], third);
    return surface_error_volume(x[0], x[1], x[2]);
}

void surface_error_coarse_pressure(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    const Cavity *cavity = model->cavity;
    if (first == 0) {
        error->pressure = cavity_pressure(cavity);
        error->volume[COARSE] = error->volume[FINER] = 0.0;
    }
    for (int f = first; f < end; f++) {
        const int *node = error->face[f];
        Vec3 x[3];
        for (int k = 0; k < 3; k++)
            x[k] = surface_error_coarse_place(model, node[k]);
        error->volume[COARSE] += press(error->pressure, node, x, error->coarse);
    }
    if (end < error->face_count)
        return;
    // - dp/dV of what is closed in.
    const bool closed = cavity->state->supplied == 0 && cavity->edge_count == 0;
    const double modulus = cavity->options.gas     ? cavity->options.ambient + error->pressure
                           : cavity->options.fluid ? cavity->bulk_modulus
                                                   : 0.0;
    error->yield = closed && error->volume[COARSE] > 0.0 ? modulus / error->volume[COARSE] : 0.0;
}

// ---------------------------------------------------------------------------------------------
// What balances these forces

// Returns where the virtual node of a place at rest is.
static Vec3 virtual_place(const SurfaceModel *model, const ErrorNode *node, Vec3 rest)
{
    const FramePose *pose = NULL;
    if (model->shape == SHAPE_FRAME_BODY) {
        // The piece of a node that is gone since is not known.
        const bool is_there = model->detail != NULL && node->model >= 0 &&
                              model->detail->set.status[node->model] != NODE_OFF;
        pose = is_there ? detail_frames_pose(model, node->model) : &model->basis.rigid->pose;
    }
    if (pose == NULL)
        return rest;
    const Vec3 arm = {rest.x - pose->rest_center[0], rest.y - pose->rest_center[1],
                      rest.z - pose->rest_center[2]};
    double y[3];
    for (int c = 0; c < 3; c++) {
        const double *r = pose->rotation[c];
        y[c] = pose->center[c] + r[0] * arm.x + r[1] * arm.y + r[2] * arm.z;
    }
    return (Vec3){y[0], y[1], y[2]};
}

// Shape springs; hanging nodes hand all to their parents, which have lower numbers.
void surface_error_coarse_hold(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int j = first; j < end; j++) {
        const int i = error->node_count - 1 - j;
        const ErrorNode *node = &error->node[i];
        if (node->model < 0)
            continue;
        const Vec3 away = vec3_sub(surface_error_coarse_place(model, i),
                                   virtual_place(model, node, node->rest[COARSE]));
        error->coarse[i] = vec3_madd(error->coarse[i], -error->hold * node->area, away);
        for (int k = 0; node->hangs && k < 2; k++) {
            Vec3 *to = &error->coarse[node->parent[k]];
            *to = vec3_madd(*to, 0.5, error->coarse[i]);
        }
    }
}

// A tool that holds something holds at least the nearest node.
void surface_error_reach(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int t = 0; t < error->tool_count; t++) {
        double *reach = &error->tool_reach[t];
        if (first == 0)
            *reach = (double)INFINITY;
        for (int i = first; i < end; i++)
            *reach = fmin(*reach, vec3_length(vec3_sub(error->x[i], error->tool_at[t])));
        if (end == error->node_count)
            *reach = fmax(REACH * error->tool_size[t], 1.03 * *reach);
    }
}

// Returns the tool that holds what is in its reach and `more` around it, or -1.
static int find_tool(const SurfaceError *error, Vec3 x, double more)
{
    for (int t = 0; t < error->tool_count; t++)
        if (error->tool_kappa[t] == 0.0 &&
            vec3_length(vec3_sub(x, error->tool_at[t])) < error->tool_reach[t] + more)
            return t;
    return -1;
}

// Gravity, loads and inertia act on the finer wall by area as they do on the wall itself. Where a
// tool holds it, they are those of gravity, and the rest is the tool's.
void surface_error_spread(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    const double *g = model->parameters->gravity;
    const Vec3 weight =
        vec3_scale(-error->inertia, rows_gravity(&model->basis, (Vec3){g[0], g[1], g[2]}));
    for (int i = first; i < end; i++) {
        const ErrorNode *node = &error->node[i];
        error->tool[i] = (signed char)find_tool(error, error->x[i], 0.0);
        if (error->tool[i] >= 0)
            error->moved[i] = (Vec3){0.0, 0.0, 0.0};
        if (node->model < 0 || node->hangs) {
            error->density[i] = vec3_scale(
                0.5, vec3_add(error->density[node->parent[0]], error->density[node->parent[1]]));
            continue;
        }
        const int held = find_tool(error, error->x[i], 1.1 * sqrt(node->area));
        error->density[i] = weight;
        if (held >= 0 && !node->fixed)
            error->tool_coarse[held] = vec3_add(
                error->tool_coarse[held], vec3_madd(error->coarse[i], -node->carried, weight));
        else if (!node->fixed && node->carried > 0.0)
            error->density[i] = vec3_scale(1.0 / node->carried, error->coarse[i]);
    }
}

// ---------------------------------------------------------------------------------------------
// The finer wall, where the last round has left it

void surface_error_begin(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    const double least = surface_error_floor(error), most = model->basis.longest_edge;
    for (int i = first; i < end; i++) {
        const ErrorNode *node = &error->node[i];
        const int *at = node->parent;
        // An error of more than an edge is beyond what the tangents tell.
        const double moved = vec3_length(error->moved[i]);
        if (moved > most)
            error->moved[i] = vec3_scale(most / moved, error->moved[i]);
        error->x[i] = node->tied ? vec3_scale(0.5, vec3_add(error->x[at[0]], error->x[at[1]]))
                                 : vec3_add(error->x[i], error->moved[i]);
        const Vec3 away = vec3_sub(error->x[i], virtual_place(model, node, node->rest[FINER]));
        error->defect[i] =
            vec3_scale(-node->finer, vec3_madd(error->density[i], error->hold, away));
        error->diagonal[i] =
            (Sym3){.xx = node->finer * least, .yy = node->finer * least, .zz = node->finer * least};
        if (error->swell != NULL)
            error->swell[i] = (Vec3){0.0, 0.0, 0.0};
    }
}

void surface_error_pressure(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int f = first; f < end; f++)
        for (int k = 0; k < 4; k++) {
            int child[3];
            Vec3 x[3];
            surface_error_child(error->face[f], k, child);
            for (int j = 0; j < 3; j++)
                x[j] = error->x[child[j]];
            error->volume[FINER] += press(1.0, child, x, error->swell);
        }
}

// The pressure is another where the finer wall holds another share of its volume at rest.
void surface_error_swell(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    const double *rest = error->rest_volume;
    const double more = error->volume[FINER] / rest[FINER] * rest[COARSE] - error->volume[COARSE];
    const double pressure = error->pressure - error->yield * more;
    for (int i = first; i < end; i++)
        error->defect[i] = vec3_madd(error->defect[i], pressure, error->swell[i]);
}

// Finds the tangents of a link; returns its force [N].
static double pull_on(const SurfaceModel *model, int i)
{
    SurfaceError *error = model->error;
    const ErrorLink *link = &error->net[FINER].link[i];
    const Vec3 d = vec3_sub(error->x[link->node[0]], error->x[link->node[1]]);
    const double length = fmax(vec3_length(d), 1e-12);
    ErrorPull *pull = &error->pull[i];
    const double force = pull_of(model, link, length, &pull->along_k);
    pull->along = vec3_scale(1.0 / length, d);
    // A spring that is pushed does not give way sideways: the stiffness stays positive.
    pull->k = fmax(force, 0.0) / length;
    return force;
}

void surface_error_links(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int i = first; i < end; i++) {
        const ErrorPull *pull = &error->pull[i];
        const int *node = error->net[FINER].link[i].node, a = node[0], b = node[1];
        const double force = pull_on(model, i);
        error->defect[a] = vec3_madd(error->defect[a], -force, pull->along);
        error->defect[b] = vec3_madd(error->defect[b], force, pull->along);
        Sym3 block = sym3_outer(pull->along_k - pull->k, pull->along);
        block.xx += pull->k, block.yy += pull->k, block.zz += pull->k;
        error->diagonal[a] = sym3_madd(error->diagonal[a], 1.0, block);
        error->diagonal[b] = sym3_madd(error->diagonal[b], 1.0, block);
    }
}

// Finds the tangents of a hinge; returns its moment [N m].
static double turn_of(const SurfaceModel *model, int i)
{
    SurfaceError *error = model->error;
    const ErrorHinge *hinge = &error->net[FINER].hinge[i];
    Vec3 x[4];
    for (int j = 0; j < 4; j++)
        x[j] = error->x[hinge->node[j]];
    return bend(model, hinge, x, error->turn[i].slope);
}

// The stiffness of a hinge leaves out how its slope turns.
void surface_error_hinges(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int i = first; i < end; i++) {
        const ErrorHinge *hinge = &error->net[FINER].hinge[i];
        const double k = hinge->stiffness * error->stiffness;
        Vec3 sum = {0.0, 0.0, 0.0};
        const Vec3 *slope = error->turn[i].slope;
        surface_error_turn_by(hinge, turn_of(model, i), slope, error->defect);
        for (int j = 0; j < 3; j++) {
            Sym3 *to = &error->diagonal[hinge->node[j + 1]];
            *to = sym3_madd(*to, 1.0, sym3_outer(k, slope[j]));
            sum = vec3_add(sum, slope[j]);
        }
        Sym3 *to = &error->diagonal[hinge->node[0]];
        *to = sym3_madd(*to, 1.0, sym3_outer(k, sum));
    }
}

void surface_error_tangents(const SurfaceModel *model)
{
    for (int i = 0; i < model->error->net[FINER].link_count; i++)
        pull_on(model, i);
    for (int i = 0; i < model->error->net[FINER].hinge_count; i++)
        turn_of(model, i);
    // The pushes that are listed by now.
    const SurfaceError *error = model->error;
    const bool coarse = error->stage < ERROR_TOUCH;
    const ErrorStage lists = coarse ? ERROR_COARSE_TOUCH : ERROR_TOUCH;
    const int count = error->next < error->face_count ? error->next : error->face_count;
    if (error->stage >= lists)
        surface_error_touches(model, coarse ? COARSE : FINER, 0,
                              error->stage == lists ? count : error->face_count);
}

// Tied nodes hand their forces to their parents, which are not tied.
void surface_error_hand(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int j = first; j < end; j++) {
        const int i = error->tied[j];
        for (int k = 0; k < 2; k++) {
            Vec3 *to = &error->defect[error->node[i].parent[k]];
            *to = vec3_madd(*to, 0.5, error->defect[i]);
        }
        error->defect[i] = (Vec3){0.0, 0.0, 0.0};
    }
}
