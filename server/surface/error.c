// SPDX-License-Identifier: MIT
// The error of a wall's faces (error.h): the rounds, and what they need at load.
#include "surface/error.h"

#include "base/check.h"
#include "surface/bending.h"
#include "surface/cavity.h"
#include "surface/detail/detail.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COARSE, FINER };

// Steps of conjugate gradients in a round.
static int ITERATIONS = 12;
// Motions slower than this are those of a body at rest [s].
static double CALM = 0.5;
static const double SCALE = 1.0;

void surface_error_tune(int iterations, double calm);
void surface_error_tune(int iterations, double calm)
{
    ITERATIONS = iterations;
    CALM = calm;
}

// ---------------------------------------------------------------------------------------------
// Load time

// Where subdivision puts the midpoints of the finest edges.
static const Vec3 *divide_finest(const Levels *levels, const TriMesh *mesh, const char *name,
                                 Arena *arena)
{
    TriMesh finest;
    WingedMesh winged;
    levels_mesh(levels, levels->finest, mesh, &finest);
    winged_create(&winged, &finest);
    Vec3 *middle = ALLOCATE(ARENA_TOPOLOGY, winged.edge_count, Vec3, "middles of edges");
    butterfly_midpoints(&winged, (const int(*)[3])finest.triangle, finest.position, middle);
    winged_destroy(&winged);
    mesh_destroy(&finest);
    return middle;
}

static void create_rules(SurfaceError *error, const TriMesh *mesh, const char *name, Arena *arena)
{
    SurfaceOptions *options = &error->options;
    options->hierarchy = NULL;
    options->start_level = 0;
    level_rules_create(&error->own_rules, mesh, options);
    double *area = ALLOCATE(ARENA_TOPOLOGY, mesh->triangle_count, double, "areas");
    memcpy(area, error->own_rules.area, (size_t)mesh->triangle_count * sizeof *area);
    free(error->own_rules.area);
    error->own_rules.area = area;
    error->rules = &error->own_rules;
    Status status = {0};
    bool ok = levels_create(&error->own_levels, mesh, 0, name, arena, &status);
    ASSERT(ok);
    error->levels = &error->own_levels;
}

static void create_nets(SurfaceError *error, const char *name, Arena *arena)
{
    const int leaves = error->leaf_capacity, nodes = error->node_capacity;
    const int bends = error->bending > 0.0 ? leaves : 0;
    for (int k = 0; k < 2; k++) {
        const int links = k == COARSE ? 3 : 9, hinges = k == COARSE ? 3 : 6;
        error->net[k].link = ALLOCATE(ARENA_STEP, links * leaves, ErrorLink, "springs compared");
        error->net[k].hinge = ALLOCATE(ARENA_STEP, hinges * bends, ErrorHinge, "hinges compared");
    }
    error->pull = ALLOCATE(ARENA_STEP, 9 * leaves, ErrorPull, "tangents of springs");
    error->turn = ALLOCATE(ARENA_STEP, 6 * bends, ErrorTurn, "tangents of hinges");
    error->node = ALLOCATE(ARENA_STEP, nodes, ErrorNode, "nodes compared");
    error->inverse = ALLOCATE(ARENA_STEP, nodes, Sym3, "inverses");
    error->tool = ALLOCATE(ARENA_STEP, nodes, signed char, "held nodes");
    Vec3 **vector[] = {&error->coarse,     &error->x,   &error->moved,
                       &error->rest_force, &error->way, &error->change};
    for (size_t i = 0; i < sizeof vector / sizeof *vector; i++)
        *vector[i] = ALLOCATE(ARENA_STEP, nodes, Vec3, "errors of nodes");
}

void surface_error_create(SurfaceModel *model, const TriMesh *mesh, const SpringNetwork *network,
                          const SurfaceOptions *options, Arena *arena)
{
    const char *name = options->body.name;
    SurfaceError *error = model->error = ALLOCATE(ARENA_STEP, 1, SurfaceError, "error of faces");
    error->options = *options;
    error->bending = bending_stiffness(&options->material);
    if (model->detail != NULL) {
        error->rules = &model->detail->rules;
        error->levels = &model->detail->set.levels;
        error->leaf_capacity = model->detail->faces.slots->face.capacity;
        error->node_capacity =
            model->detail->faces.slots->node.capacity + 2 * error->leaf_capacity + 64;
    } else {
        create_rules(error, mesh, name, arena);
        error->leaf_capacity = mesh->triangle_count;
        error->node_capacity = mesh->node_count + error->levels->level[0].edge_count;
    }
    error->middle = divide_finest(error->levels, mesh, name, arena);
    create_nets(error, name, arena);
    // Maps from the body.
    for (int l = 0; l <= error->levels->finest; l++)
        error->edge_base[l + 1] = error->edge_base[l] + error->levels->level[l].edge_count;
    const int edges = error->edge_base[error->levels->finest + 1];
    error->of_node = ALLOCATE(ARENA_STEP, model->node_count, int, "numbers of nodes");
    memset(error->of_node, -1, (size_t)model->node_count * sizeof(int));
    error->of_edge = ALLOCATE(ARENA_STEP, edges, int, "numbers of midpoints");
    error->of_lip = ALLOCATE(ARENA_STEP, error->levels->level[error->levels->finest].edge_count,
                             int, "numbers of lips");
    surface_error_forget(error);
    error->topology = -1;
    error->rows = arena_allocate(arena, ARENA_STEP, (size_t)model->basis.count * ROW,
                                 model_real_size(model), "%s/rows copied", name);
    error->size = ALLOCATE(ARENA_OUTPUT, model->node_count, float, "errors shown");
    // What resists all motion, by area.
    double area = 0.0, hold = 0.0;
    for (int f = 0; f < mesh->triangle_count; f++)
        area += network->face_area[f];
    for (int i = 0; i < mesh->node_count; i++)
        hold += network->shape_stiffness[i];
    error->hold = hold / area;
    error->inertia = network->total_mass / area;
}

// ---------------------------------------------------------------------------------------------
// Stages. Each does a part of its list.

// Returns the end of the part of a list that fits the budget, and takes it from that.
static int take(SurfaceError *error, int count, int cost, int *budget)
{
    int most = *budget / cost;
    most = most > 1 ? most : 1;
    const int end = count - error->next > most ? error->next + most : count;
    *budget -= cost * (end - error->next);
    return end;
}

// Goes on to a stage.
static void go_to(SurfaceError *error, ErrorStage stage)
{
    error->stage = stage;
    error->next = 0;
}

static int64_t topology_of(const SurfaceModel *model)
{
    return model->detail == NULL ? 0 : model->detail->adapt.sweep->topology;
}

// Lists the wall and the finer one, unless they are known.
static void gather(const SurfaceModel *model, int *budget)
{
    SurfaceError *error = model->error;
    const Levels *levels = error->levels;
    const int64_t topology = topology_of(model);
    if (error->topology != topology) {
        surface_error_forget(error);
        error->topology = topology;
        error->level = error->face = 0;
    }
    while (*budget > 0 && error->level <= levels->finest) {
        const Level *at = &levels->level[error->level];
        if (error->face == at->face_count) {
            error->level++, error->face = 0;
            if (error->level > levels->finest)
                memset(error->moved, 0, (size_t)error->node_count * sizeof *error->moved);
            continue;
        }
        const int before = error->net[FINER].link_count;
        surface_error_add_leaf(model, error->level, error->face++);
        *budget -= error->net[FINER].link_count > before ? 20 : 1;
    }
    if (error->level > levels->finest && !error->full)
        go_to(error, ERROR_COPY);
    else if (error->full)
        *budget = 0;
}

// Copies the rows in use at once: all that follows sees one state. Takes the question along.
static void copy_state(const SurfaceModel *model, const ErrorQuestion *question, int *budget)
{
    SurfaceError *error = model->error;
    if (error->topology != topology_of(model)) {
        go_to(error, ERROR_GATHER);
        return;
    }
    const size_t row = ROW * model_real_size(model);
    int count = 0;
    for (int r = 0; r < model->run_count; r++) {
        const size_t first = (size_t)model->run[r][0];
        const size_t rows = (size_t)model->run[r][1] - first;
        memcpy(error->rows + first * row, (const char *)model->rows[model->current] + first * row,
               rows * row);
        count += (int)rows;
    }
    *budget -= count / 4;
    // The tools in the coordinates of the rows.
    error->tool_count = 0;
    for (int t = 0; question != NULL && t < question->tool_count && t < ERROR_TOOLS; t++) {
        const Vec3 force = question->force[t];
        const double size = question->size[t], pushes = vec3_length(force);
        Vec3 at = question->tool[t];
        // The middle of a ball that touches there.
        if (pushes > 0.0)
            at = vec3_madd(at, size / pushes, force);
        if (model->basis.displaced)
            at = vec3_sub(at, rows_origin(&model->basis));
        error->tool_at[t] = model->basis.displaced ? rows_turn_in(&model->basis, at) : at;
        error->tool_force[t] = rows_turn_in(&model->basis, force);
        error->tool_size[t] = size;
        error->taken[t] = (Vec3){0.0, 0.0, 0.0};
        error->tool_count++;
    }
    go_to(error, ERROR_PLACE);
}

// Returns the direction of an edge and the normal of the faces there, of unit length; false if
// there is none.
static bool frame_at(const SurfaceError *error, const ErrorNode *node, int which, Vec3 axis[3])
{
    const int a = node->parent[0];
    Vec3 x[4], normal = {0.0, 0.0, 0.0};
    const int at[4] = {a, node->parent[1], node->wing[0], node->wing[1]};
    for (int k = 0; k < 4 && at[k] >= 0; k++)
        x[k] = which == COARSE ? error->node[at[k]].rest[FINER] : error->x[at[k]];
    const Vec3 edge = vec3_sub(x[1], x[0]);
    if (node->wing[0] >= 0)
        normal = vec3_cross(edge, vec3_sub(x[2], x[0]));
    if (node->wing[0] >= 0 && node->wing[1] >= 0)
        normal = vec3_add(normal, vec3_cross(vec3_sub(x[3], x[0]), edge));
    const double size = vec3_length(edge) * vec3_length(normal);
    if (!(size > 0.0))
        return false;
    axis[0] = vec3_unit(edge);
    axis[1] = vec3_unit(normal);
    axis[2] = vec3_cross(axis[0], axis[1]);
    return true;
}

// Puts the nodes of the finer wall: what sticks out of a face turns with it.
static void place(const SurfaceModel *model, int *budget)
{
    SurfaceError *error = model->error;
    const int end = take(error, error->node_count, 3, budget);
    for (int i = error->next; i < end; i++) {
        const ErrorNode *node = &error->node[i];
        error->coarse[i] = error->rest_force[i] = (Vec3){0.0, 0.0, 0.0};
        error->inverse[i] = (Sym3){0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
        if (node->model >= 0 && !node->hangs) {
            error->x[i] = rows_local(&model->basis, error->rows, model->slot[node->model]);
            continue;
        }
        const int *at = node->parent;
        error->x[i] = vec3_scale(0.5, vec3_add(error->x[at[0]], error->x[at[1]]));
        Vec3 rest[3], now[3];
        const Vec3 out =
            vec3_sub(node->rest[FINER], vec3_scale(0.5, vec3_add(error->node[at[0]].rest[FINER],
                                                                 error->node[at[1]].rest[FINER])));
        if (node->tied || !frame_at(error, node, COARSE, rest) ||
            !frame_at(error, node, FINER, now))
            continue;
        for (int k = 0; k < 3; k++)
            error->x[i] = vec3_madd(error->x[i], vec3_dot(out, rest[k]), now[k]);
    }
    error->next = end;
    if (end == error->node_count)
        go_to(error, ERROR_COARSE_LINKS);
}

// Returns a node of the wall itself, where hanging ones lie between their parents.
static Vec3 coarse_place(const SurfaceModel *model, int i)
{
    const ErrorNode *node = &model->error->node[i];
    return rows_local(&model->basis, model->error->rows, model->slot[node->model]);
}

// Returns the pull of a spring, and its stiffness against being stretched [N/m].
static double pull_of(const SurfaceModel *model, const ErrorLink *link, double length,
                      double *tangent)
{
    const double x = length - link->length,
                 k = link->stiffness * model->parameters->stiffness_scale;
    *tangent = k;
    if (model->springs.inverse == NULL || x <= 0.0)
        return k * x;
    const double unit = model->stiffening.strain * link->length, q = x * x / (unit * unit);
    *tangent = k * stiffening_tangent(&model->stiffening.curve, q);
    return k * stiffening_factor(&model->stiffening.curve, q) * x;
}

static void coarse_links(const SurfaceModel *model, int *budget)
{
    SurfaceError *error = model->error;
    const ErrorNet *net = &error->net[COARSE];
    const int end = take(error, net->link_count, 2, budget);
    for (int i = error->next; i < end; i++) {
        const int a = net->link[i].node[0], b = net->link[i].node[1];
        const Vec3 d = vec3_sub(coarse_place(model, a), coarse_place(model, b));
        const double length = vec3_length(d);
        double tangent;
        const double pull = pull_of(model, &net->link[i], length, &tangent);
        const Vec3 force = vec3_scale(length > 1e-12 ? pull / length : 0.0, d);
        error->coarse[a] = vec3_sub(error->coarse[a], force);
        error->coarse[b] = vec3_add(error->coarse[b], force);
    }
    error->next = end;
    if (end == net->link_count)
        go_to(error, ERROR_COARSE_HINGES);
}

// Returns the moment of a hinge [N m], and how its angle changes with nodes 1 to 3.
static double bend(const SurfaceModel *model, const ErrorHinge *hinge, const Vec3 x[4],
                   Vec3 slope[3])
{
    const Vec3 edge = vec3_sub(x[1], x[0]), c = vec3_sub(x[2], x[0]), d = vec3_sub(x[3], x[0]);
    const Vec3 left = vec3_cross(edge, c), right = vec3_cross(d, edge);
    const double length2 = vec3_dot(edge, edge), length = sqrt(length2);
    const double square[2] = {vec3_dot(left, left), vec3_dot(right, right)};
    if (!(square[0] > 0.0 && square[1] > 0.0)) {
        slope[0] = slope[1] = slope[2] = (Vec3){0.0, 0.0, 0.0};
        return 0.0;
    }
    const double s = vec3_dot(c, edge) / length2, t = vec3_dot(d, edge) / length2;
    slope[1] = vec3_scale(-length / square[0], left);
    slope[2] = vec3_scale(-length / square[1], right);
    slope[0] = vec3_scale(-1.0, vec3_add(vec3_scale(s, slope[1]), vec3_scale(t, slope[2])));
    const double turn = remainder(
        atan2(-vec3_dot(left, d) * length, vec3_dot(left, right)) - hinge->angle, 2.0 * M_PI);
    return hinge->stiffness * model->parameters->stiffness_scale * turn;
}

// Adds the forces of a hinge.
static void push(const ErrorHinge *hinge, double moment, const Vec3 slope[3], Vec3 *force)
{
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; k++) {
        const int i = hinge->node[k + 1];
        force[i] = vec3_madd(force[i], -moment, slope[k]);
        sum = vec3_madd(sum, moment, slope[k]);
    }
    force[hinge->node[0]] = vec3_add(force[hinge->node[0]], sum);
}

static void coarse_hinges(const SurfaceModel *model, int *budget)
{
    SurfaceError *error = model->error;
    const ErrorNet *net = &error->net[COARSE];
    const int end = take(error, net->hinge_count, 6, budget);
    for (int i = error->next; i < end; i++) {
        Vec3 x[4], slope[3];
        for (int k = 0; k < 4; k++)
            x[k] = coarse_place(model, net->hinge[i].node[k]);
        const double moment = bend(model, &net->hinge[i], x, slope);
        push(&net->hinge[i], moment, slope, error->coarse);
    }
    error->next = end;
    if (end == net->hinge_count)
        go_to(error, ERROR_SPREAD);
}

// Returns the tool in whose reach a point is, or -1.
static int find_tool(const SurfaceError *error, Vec3 x, double more)
{
    for (int t = 0; t < error->tool_count; t++)
        if (vec3_length(vec3_sub(x, error->tool_at[t])) < 1.02 * error->tool_size[t] + more)
            return t;
    return -1;
}

// What balances the wall's forces acts on the finer wall too, spread by area: gravity, loads,
// pressure, inertia. Where a tool is, the finer wall is held, and the wall's forces go to the tool.
static void spread(const SurfaceModel *model)
{
    SurfaceError *error = model->error;
    // Hanging nodes hand all to their parents, which have lower numbers.
    for (int i = error->node_count - 1; i >= 0; i--) {
        const ErrorNode *node = &error->node[i];
        error->way[i].x = error->way[i].x; // densities below
        if (!node->hangs)
            continue;
        for (int k = 0; k < 2; k++) {
            Vec3 *to = &error->coarse[node->parent[k]];
            *to = vec3_madd(*to, 0.5, error->coarse[i]);
        }
    }
    // change: area with that of hanging nodes.
    for (int i = 0; i < error->node_count; i++)
        error->change[i].x = error->node[i].area;
    for (int i = error->node_count - 1; i >= 0; i--)
        if (error->node[i].hangs)
            for (int k = 0; k < 2; k++)
                error->change[error->node[i].parent[k]].x += 0.5 * error->change[i].x;
    const double *g = model->parameters->gravity;
    const Vec3 weight =
        vec3_scale(-error->inertia, rows_gravity(&model->basis, (Vec3){g[0], g[1], g[2]}));
    Vec3 *density = error->way;
    for (int i = 0; i < error->node_count; i++) {
        const ErrorNode *node = &error->node[i];
        const int *at = node->parent;
        error->tool[i] = -1;
        if (node->model < 0 || node->hangs) {
            density[i] = vec3_scale(0.5, vec3_add(density[at[0]], density[at[1]]));
        } else {
            const double area = error->change[i].x;
            const double near = 1.1 * sqrt(node->area);
            const int touches = find_tool(error, error->x[i], near);
            density[i] = node->fixed || touches >= 0 || !(area > 0.0)
                             ? weight
                             : vec3_scale(1.0 / area, error->coarse[i]);
            if (touches >= 0 && !node->fixed)
                error->taken[touches] =
                    vec3_sub(error->taken[touches], vec3_madd(error->coarse[i], -area, weight));
        }
        // The finer wall as the last round left it.
        error->tool[i] = (signed char)find_tool(error, error->x[i], 0.0);
        if (error->tool[i] >= 0)
            error->moved[i] = (Vec3){0.0, 0.0, 0.0};
    }
    for (int i = 0; i < error->node_count; i++) {
        const ErrorNode *node = &error->node[i];
        if (node->tied) {
            error->x[i] =
                vec3_scale(0.5, vec3_add(error->x[node->parent[0]], error->x[node->parent[1]]));
        } else {
            error->x[i] = vec3_add(error->x[i], error->moved[i]);
        }
        error->rest_force[i] = vec3_scale(-node->finer, density[i]);
        error->rest_force[i] =
            vec3_madd(error->rest_force[i], -error->hold * node->finer, error->moved[i]);
        const double hold = node->finer * (error->hold + error->inertia / (CALM * CALM));
        error->inverse[i] = (Sym3){hold, hold, hold, 0.0, 0.0, 0.0};
    }
    go_to(error, ERROR_LINKS);
}

static void links(const SurfaceModel *model, int *budget)
{
    SurfaceError *error = model->error;
    const ErrorNet *net = &error->net[FINER];
    const int end = take(error, net->link_count, 4, budget);
    for (int i = error->next; i < end; i++) {
        const int a = net->link[i].node[0], b = net->link[i].node[1];
        const Vec3 d = vec3_sub(error->x[a], error->x[b]);
        const double length = fmax(vec3_length(d), 1e-12);
        ErrorPull *pull = &error->pull[i];
        const double force = pull_of(model, &net->link[i], length, &pull->along_k);
        pull->along = vec3_scale(1.0 / length, d);
        // A pushed spring does not give way sideways: the tangent stays positive.
        pull->k = fmax(force, 0.0) / length;
        error->rest_force[a] = vec3_madd(error->rest_force[a], -force, pull->along);
        error->rest_force[b] = vec3_madd(error->rest_force[b], force, pull->along);
        Sym3 block = sym3_outer(pull->along_k - pull->k, pull->along);
        block.xx += pull->k, block.yy += pull->k, block.zz += pull->k;
        for (int k = 0; k < 2; k++)
            error->inverse[net->link[i].node[k]] =
                sym3_madd(error->inverse[net->link[i].node[k]], 1.0, block);
    }
    error->next = end;
    if (end == net->link_count)
        go_to(error, ERROR_HINGES);
}

static void hinges(const SurfaceModel *model, int *budget)
{
    SurfaceError *error = model->error;
    const ErrorNet *net = &error->net[FINER];
    const double scale = model->parameters->stiffness_scale;
    const int end = take(error, net->hinge_count, 12, budget);
    for (int i = error->next; i < end; i++) {
        Vec3 x[4];
        const ErrorHinge *hinge = &net->hinge[i];
        Vec3 *slope = error->turn[i].slope;
        for (int k = 0; k < 4; k++)
            x[k] = error->x[hinge->node[k]];
        const double moment = bend(model, hinge, x, slope);
        push(hinge, moment, slope, error->rest_force);
        Vec3 sum = {0.0, 0.0, 0.0};
        const double k = scale * hinge->stiffness;
        for (int j = 0; j < 3; j++) {
            const int n = hinge->node[j + 1];
            error->inverse[n] = sym3_madd(error->inverse[n], 1.0, sym3_outer(k, slope[j]));
            sum = vec3_add(sum, slope[j]);
        }
        error->inverse[hinge->node[0]] =
            sym3_madd(error->inverse[hinge->node[0]], 1.0, sym3_outer(k, sum));
    }
    error->next = end;
    if (end == net->hinge_count)
        go_to(error, ERROR_PREPARE);
}

static bool is_free(const SurfaceError *error, int i)
{
    return !error->node[i].fixed && !error->node[i].tied && error->tool[i] < 0;
}

// Tied nodes hand their forces to their parents.
static void hand_over(SurfaceError *error, Vec3 *force)
{
    for (int i = error->node_count - 1; i >= 0; i--) {
        if (!error->node[i].tied)
            continue;
        for (int k = 0; k < 2; k++) {
            Vec3 *to = &force[error->node[i].parent[k]];
            *to = vec3_madd(*to, 0.5, force[i]);
        }
        force[i] = (Vec3){0.0, 0.0, 0.0};
    }
}

// Inverts the diagonal and takes the first direction.
static void prepare(SurfaceError *error)
{
    hand_over(error, error->rest_force);
    error->product = 0.0;
    for (int i = 0; i < error->node_count; i++) {
        double determinant;
        const Sym3 of = sym3_adjugate(error->inverse[i], &determinant);
        error->inverse[i] = determinant > 0.0 && is_free(error, i)
                                ? sym3_scale(1.0 / determinant, of)
                                : (Sym3){0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
        error->way[i] = sym3_times(error->inverse[i], error->rest_force[i]);
        error->product += vec3_dot(error->way[i], error->rest_force[i]);
    }
    error->iteration = 0;
    go_to(error, ERROR_PRODUCT_LINKS);
}

static void product_links(SurfaceError *error, int *budget)
{
    const ErrorNet *net = &error->net[FINER];
    if (error->next == 0) {
        for (int i = 0; i < error->node_count; i++) {
            const ErrorNode *node = &error->node[i];
            if (node->tied)
                error->way[i] = vec3_scale(
                    0.5, vec3_add(error->way[node->parent[0]], error->way[node->parent[1]]));
            error->change[i] = vec3_scale(
                node->finer * (error->hold + error->inertia / (CALM * CALM)), error->way[i]);
        }
    }
    const int end = take(error, net->link_count, 1, budget);
    for (int i = error->next; i < end; i++) {
        const int a = net->link[i].node[0], b = net->link[i].node[1];
        const ErrorPull *pull = &error->pull[i];
        const Vec3 d = vec3_sub(error->way[a], error->way[b]);
        Vec3 f = vec3_scale(pull->k, d);
        f = vec3_madd(f, (pull->along_k - pull->k) * vec3_dot(pull->along, d), pull->along);
        error->change[a] = vec3_add(error->change[a], f);
        error->change[b] = vec3_sub(error->change[b], f);
    }
    error->next = end;
    if (end == net->link_count)
        go_to(error, ERROR_PRODUCT_HINGES);
}

static void product_hinges(const SurfaceModel *model, int *budget)
{
    SurfaceError *error = model->error;
    const ErrorNet *net = &error->net[FINER];
    const int end = take(error, net->hinge_count, 2, budget);
    for (int i = error->next; i < end; i++) {
        const ErrorHinge *hinge = &net->hinge[i];
        const Vec3 *slope = error->turn[i].slope;
        double turn = 0.0;
        for (int k = 0; k < 3; k++)
            turn += vec3_dot(slope[k],
                             vec3_sub(error->way[hinge->node[k + 1]], error->way[hinge->node[0]]));
        push(hinge, -hinge->stiffness * model->parameters->stiffness_scale * turn, slope,
             error->change);
    }
    error->next = end;
    if (end == net->hinge_count)
        go_to(error, ERROR_CURVATURE);
}

// One step along the direction, and the next direction.
static void advance(SurfaceError *error)
{
    hand_over(error, error->change);
    double curvature = 0.0, product = 0.0;
    for (int i = 0; i < error->node_count; i++)
        curvature += vec3_dot(error->way[i], error->change[i]);
    const double step = curvature > 0.0 ? error->product / curvature : 0.0;
    for (int i = 0; i < error->node_count; i++) {
        error->moved[i] = vec3_madd(error->moved[i], step, error->way[i]);
        error->rest_force[i] = vec3_madd(error->rest_force[i], -step, error->change[i]);
        const Vec3 z = sym3_times(error->inverse[i], error->rest_force[i]);
        product += vec3_dot(z, error->rest_force[i]);
        error->change[i] = z;
    }
    const double ratio = error->product > 0.0 ? product / error->product : 0.0;
    for (int i = 0; i < error->node_count; i++)
        error->way[i] = vec3_madd(error->change[i], ratio, error->way[i]);
    error->product = product;
    error->iteration++;
    go_to(error, error->iteration < ITERATIONS && product > 0.0 ? ERROR_PRODUCT_LINKS : ERROR_SUM);
}

// Sums what the round has found.
static void sum_up(const SurfaceModel *model, BodyError *out)
{
    SurfaceError *error = model->error;
    double wrong = 0.0, moved = 0.0, area = 0.0;
    error->largest = 0.0F;
    memset(error->size, 0, (size_t)model->node_count * sizeof *error->size);
    for (int i = 0; i < error->node_count; i++) {
        const ErrorNode *node = &error->node[i];
        if (error->tool[i] >= 0)
            error->taken[error->tool[i]] = vec3_madd(error->taken[error->tool[i]], -1.0,
                                                     vec3_scale(-1.0, error->rest_force[i]));
        if (node->model < 0)
            continue;
        const Vec3 u = vec3_sub(coarse_place(model, i), node->rest[COARSE]);
        wrong += node->area * vec3_dot(error->moved[i], error->moved[i]);
        moved += node->area * vec3_dot(u, u);
        area += node->area;
        const float size = (float)(SCALE * vec3_length(error->moved[i]));
        error->size[node->model] = size;
        error->largest = fmaxf(error->largest, size);
    }
    out->displacement = SCALE * sqrt(wrong / area);
    out->relative = moved > 0.0 ? SCALE * sqrt(wrong / moved) : 0.0;
    for (int t = 0; t < error->tool_count; t++) {
        const double force = vec3_length(error->tool_force[t]);
        out->force[t] = force > 0.0 ? vec3_length(error->taken[t]) / force : 0.0;
    }
    go_to(error, ERROR_GATHER);
}

bool surface_estimate(void *self, const ErrorQuestion *question, int budget, BodyError *out)
{
    SurfaceModel *model = self;
    SurfaceError *error = model->error;
    while (budget > 0) {
        switch (error->stage) {
        case ERROR_GATHER:
            gather(model, &budget);
            break;
        case ERROR_COPY:
            copy_state(model, question, &budget);
            break;
        case ERROR_PLACE:
            place(model, &budget);
            break;
        case ERROR_COARSE_LINKS:
            coarse_links(model, &budget);
            break;
        case ERROR_COARSE_HINGES:
            coarse_hinges(model, &budget);
            break;
        case ERROR_SPREAD:
            spread(model);
            budget -= 6 * error->node_count;
            break;
        case ERROR_LINKS:
            links(model, &budget);
            break;
        case ERROR_HINGES:
            hinges(model, &budget);
            break;
        case ERROR_PREPARE:
            prepare(error);
            budget -= 3 * error->node_count;
            break;
        case ERROR_PRODUCT_LINKS:
            product_links(error, &budget);
            break;
        case ERROR_PRODUCT_HINGES:
            product_hinges(model, &budget);
            break;
        case ERROR_CURVATURE:
            advance(error);
            budget -= 2 * error->node_count;
            break;
        default:
            sum_up(model, out);
            return true;
        }
    }
    return false;
}

void surface_snapshot_error(const void *self, unsigned char *share)
{
    const SurfaceModel *model = self;
    const SurfaceError *error = model->error;
    const float scale = error->largest > 0.0F ? 255.0F / error->largest : 0.0F;
    for (int s = 0; s < model->shown.count; s++) {
        const int node = model->shown.id[s] >= 0 ? model->node[model->shown.row[s]] : -1;
        share[s] = node >= 0 ? (unsigned char)(scale * error->size[node] + 0.5F) : 0;
    }
}
