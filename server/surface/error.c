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

// Steps of conjugate gradients in a round; faces that push tools, at most.
enum { ITERATIONS = 25, MOST_PUSHES = 4096 };
// Factor on what is found (tests/accuracy/errors.md).
static const double SCALE = 1.25;
// Of what the rounds to come may add: largest share of one in that of the one before, and the most
// over what is known.
static const double MOST_SHARE = 6.0 / 7.0, MOST_TO_COME = 3.0;
// An error that still grows by more than this part of it in a round is not known in the first ones.
static const double SETTLED = 0.2;

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
    error->diagonal = ALLOCATE(ARENA_STEP, nodes, Sym3, "diagonals");
    error->tied = ALLOCATE(ARENA_STEP, nodes, int, "tied nodes");
    error->face = ALLOCATE(ARENA_STEP, leaves, *error->face, "faces compared");
    error->push_capacity = 4 * leaves < MOST_PUSHES ? 4 * leaves : MOST_PUSHES;
    error->push = ALLOCATE(ARENA_STEP, error->push_capacity, ErrorPush, "pushes");
    error->tool = ALLOCATE(ARENA_STEP, nodes, signed char, "held nodes");
    Vec3 **vector[] = {&error->coarse, &error->density, &error->x,     &error->moved,
                       &error->defect, &error->way,     &error->change};
    for (size_t i = 0; i < sizeof vector / sizeof *vector; i++)
        *vector[i] = ALLOCATE(ARENA_STEP, nodes, Vec3, "errors of nodes");
}

// Returns the most midpoints of leaves' edges: each edge has one, a broken edge two. There are few
// more broken edges than copies of nodes.
static int most_middles(const SurfaceModel *model, const SurfaceError *error)
{
    const Level *finest = &error->levels->level[error->levels->finest];
    const struct DetailCut *cut = model->detail->set.cut;
    int border = 0;
    for (int e = 0; e < finest->edge_count; e++)
        border += finest->edge_face[e][0] < 0 || finest->edge_face[e][1] < 0;
    return (3 * error->leaf_capacity + border) / 2 +
           (cut != NULL ? 2 * cut->copy_capacity + 64 : 1);
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
        const MeshSlots *slots = model->detail->faces.slots;
        error->leaf_capacity = slots->face.capacity;
        error->node_capacity = slots->node.capacity + most_middles(model, error);
    } else {
        create_rules(error, mesh, name, arena);
        error->leaf_capacity = mesh->triangle_count;
        error->node_capacity = mesh->node_count + error->levels->level[0].edge_count;
    }
    error->middle = divide_finest(error->levels, mesh, name, arena);
    create_nets(error, name, arena);
    if (model->cavity != NULL)
        error->swell = ALLOCATE(ARENA_STEP, error->node_capacity, Vec3, "volume by nodes");
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
    error->keep_count = model->node_count + error->levels->level[error->levels->finest].edge_count;
    error->kept = ALLOCATE(ARENA_STEP, error->keep_count, Vec3, "errors kept");
    error->was = ALLOCATE(ARENA_STEP, model->node_count, Vec3, "displacements kept");
    for (int k = 0; k < 2; k++)
        error->size[k] = ALLOCATE(ARENA_OUTPUT, model->node_count, float, "errors shown");
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
// A round

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

// Goes on from what complete rounds have found; a midpoint of which nothing is known is between its
// parents, which have lower numbers.
static void resume(SurfaceError *error)
{
    for (int i = 0; i < error->node_count; i++) {
        const ErrorNode *node = &error->node[i];
        const int *at = node->parent;
        error->moved[i] = error->kept[node->keep];
        if (node->model < 0 && vec3_dot(error->moved[i], error->moved[i]) == 0.0)
            error->moved[i] = vec3_scale(0.5, vec3_add(error->moved[at[0]], error->moved[at[1]]));
    }
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
        error->level = error->at = 0;
    }
    while (*budget > 0 && error->level <= levels->finest) {
        const Level *at = &levels->level[error->level];
        if (error->at == at->face_count) {
            error->level++, error->at = 0;
            if (error->level > levels->finest)
                resume(error);
            continue;
        }
        const int before = error->net[FINER].link_count;
        surface_error_add_leaf(model, error->level, error->at++);
        *budget -= error->net[FINER].link_count > before ? 20 : 1;
    }
    if (error->level > levels->finest && !error->full)
        go_to(error, ERROR_COPY);
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
    error->stiffness = model->parameters->stiffness_scale;
    // The tools in the coordinates of the rows.
    error->tool_count = error->push_count = 0;
    error->barrier = question == NULL ? 0.0 : question->barrier;
    memset(error->sums, 0, sizeof error->sums);
    error->largest[1 - error->shown] = 0.0F;
    for (int t = 0; question != NULL && t < question->tool_count && t < ERROR_TOOLS; t++) {
        const bool pushes = question->kappa != NULL && question->kappa[t] > 0.0;
        Vec3 at = pushes ? question->axis[t] : question->tool[t];
        if (model->basis.displaced)
            at = vec3_sub(at, rows_origin(&model->basis));
        error->tool_at[t] = model->basis.displaced ? rows_turn_in(&model->basis, at) : at;
        error->tool_force[t] = rows_turn_in(&model->basis, question->force[t]);
        error->tool_size[t] = question->size[t];
        error->tool_kappa[t] = pushes ? question->kappa[t] : 0.0;
        error->tool_coarse[t] = error->tool_finer[t] = (Vec3){0.0, 0.0, 0.0};
        error->tool_pushes[t] = 0.0;
        error->tool_count++;
    }
    go_to(error, ERROR_PLACE);
}

// Adds what the round has found of some nodes.
static void sum_up(const SurfaceModel *model, int first, int end)
{
    SurfaceError *error = model->error;
    for (int i = first; i < end; i++) {
        const ErrorNode *node = &error->node[i];
        const int tool = error->tool[i];
        if (tool >= 0)
            error->tool_finer[tool] = vec3_add(error->tool_finer[tool], error->defect[i]);
        error->kept[node->keep] = error->moved[i];
        if (node->model < 0)
            continue;
        const Vec3 u = vec3_sub(surface_error_coarse_place(model, i), node->rest[COARSE]);
        error->sums[0] += node->area;
        error->sums[1] += node->area * vec3_dot(error->moved[i], error->moved[i]);
        error->sums[2] += node->area * vec3_dot(u, u);
        const Vec3 since = vec3_sub(u, error->was[node->model]);
        error->sums[3] += node->area * vec3_dot(since, since);
        error->was[node->model] = u;
        const float size = (float)vec3_length(error->moved[i]);
        float *largest = &error->largest[1 - error->shown];
        error->size[1 - error->shown][node->model] = size;
        *largest = fmaxf(*largest, size);
    }
}

// Returns the factor on the size of an error for what rounds to come will find: each adds a share
// of what the one before has added.
static double yet_to_come(const SurfaceError *error, double size, double growth)
{
    if (!(growth > 0.0 && error->growth > 0.0 && size > 0.0))
        return 1.0;
    const double share = fmin(MOST_SHARE, growth / error->growth);
    return 1.0 + fmin(MOST_TO_COME, growth * share / (1.0 - share) / size);
}

// Concludes a round; false if too little of the error is known.
static bool answer(const SurfaceModel *model, BodyError *out)
{
    SurfaceError *error = model->error;
    const double *sum = error->sums, size = sqrt(sum[1] / sum[0]);
    const double grown = size - error->size_of_last;
    // What has moved since the last round has changed its error, in proportion at most: that is no
    // part of the growth that goes on.
    const double growth = grown - (sum[2] > 0.0 ? sqrt(sum[3] / sum[2]) * size : 0.0);
    const double more = yet_to_come(error, size, growth);
    // The first rounds of large walls find a small part of it.
    const bool is_known = error->rounds + 1 >= ERROR_FIRST || grown <= SETTLED * size;
    error->shown = 1 - error->shown;
    error->size_of_last = size;
    error->growth = growth;
    error->rounds = error->rounds < ERROR_FIRST ? error->rounds + 1 : ERROR_FIRST;
    // After a bad number all begins again.
    if (!isfinite(sum[1])) {
        error->topology = -1;
        error->rounds = 0;
        error->largest[error->shown] = 0.0F;
        error->size_of_last = error->growth = 0.0;
        memset(error->kept, 0, (size_t)error->keep_count * sizeof *error->kept);
        memset(error->was, 0, (size_t)model->node_count * sizeof *error->was);
    }
    const double scale = SCALE * error->order / sum[0];
    out->displacement = more * scale * size;
    out->relative = sum[2] > 0.0 ? more * scale * sqrt(sum[1] / sum[2]) : 0.0;
    for (int t = 0; t < error->tool_count; t++) {
        const Vec3 force = error->tool_force[t],
                   off = vec3_sub(error->tool_finer[t], error->tool_coarse[t]);
        // Friction and damping grow with the pushes.
        const double square = vec3_dot(force, force),
                     own = error->tool_kappa[t] > 0.0
                               ? fmax(0.5 * square, vec3_dot(force, error->tool_coarse[t]))
                               : square;
        out->force[t] = own > 0.0 ? scale * fabs(vec3_dot(off, force)) / own : 0.0;
    }
    return is_known;
}

// The parts of a stage: what it does to an element of its list, and how much work that is.
typedef enum ErrorList { NODES, TIED, FACES, PUSHES, LINKS, HINGES } ErrorList;
typedef struct ErrorRule {
    ErrorPart *part;
    ErrorList list;
    int which, cost;
} ErrorRule;

static const ErrorRule RULES[ERROR_STAGES] = {
    [ERROR_PLACE] = {surface_error_place, NODES, 0, 16},
    [ERROR_COARSE_LINKS] = {surface_error_coarse_links, LINKS, COARSE, 12},
    [ERROR_COARSE_HINGES] = {surface_error_coarse_hinges, HINGES, COARSE, 30},
    [ERROR_COARSE_PRESSURE] = {surface_error_coarse_pressure, FACES, 0, 6},
    [ERROR_COARSE_TOUCH] = {surface_error_coarse_touch, FACES, 0, 20},
    [ERROR_COARSE_PUSH] = {surface_error_coarse_push, PUSHES, 0, 6},
    [ERROR_COARSE_HOLD] = {surface_error_coarse_hold, NODES, 0, 3},
    [ERROR_REACH] = {surface_error_reach, NODES, 0, 2},
    [ERROR_SPREAD] = {surface_error_spread, NODES, 0, 6},
    [ERROR_BEGIN] = {surface_error_begin, NODES, 0, 4},
    [ERROR_PRESSURE] = {surface_error_pressure, FACES, 0, 16},
    [ERROR_SWELL] = {surface_error_swell, NODES, 0, 1},
    [ERROR_LINKS] = {surface_error_links, LINKS, FINER, 6},
    [ERROR_HINGES] = {surface_error_hinges, HINGES, FINER, 28},
    [ERROR_TOUCH] = {surface_error_touch, FACES, 0, 20},
    [ERROR_PUSH] = {surface_error_push, PUSHES, 0, 12},
    [ERROR_HAND] = {surface_error_hand, TIED, 0, 1},
    [ERROR_PREPARE] = {surface_error_prepare, NODES, 0, 4},
    [ERROR_START] = {surface_error_start, NODES, 0, 2},
    [ERROR_PRODUCT_LINKS] = {surface_error_product_links, LINKS, FINER, 2},
    [ERROR_PRODUCT_HINGES] = {surface_error_product_hinges, HINGES, FINER, 3},
    [ERROR_PRODUCT_PUSHES] = {surface_error_product_pushes, PUSHES, 0, 6},
    [ERROR_GROW] = {surface_error_grow, NODES, 0, 1},
    [ERROR_RESIST] = {surface_error_resist, NODES, 0, 1},
    [ERROR_PASS] = {surface_error_pass, TIED, 0, 1},
    [ERROR_CURVATURE] = {surface_error_curvature, NODES, 0, 1},
    [ERROR_MOVE] = {surface_error_move, NODES, 0, 3},
    [ERROR_TURN] = {surface_error_turn, NODES, 0, 1},
    [ERROR_SUM] = {sum_up, NODES, 0, 6},
};

// True if the body has no need of a stage.
static bool is_idle(const SurfaceError *error, ErrorStage stage)
{
    if (stage == ERROR_REACH || stage == ERROR_COARSE_TOUCH || stage == ERROR_COARSE_PUSH ||
        stage == ERROR_TOUCH || stage == ERROR_PUSH || stage == ERROR_PRODUCT_PUSHES)
        return error->tool_count == 0;
    if (stage == ERROR_COARSE_PRESSURE || stage == ERROR_PRESSURE || stage == ERROR_SWELL)
        return error->swell == NULL;
    return (stage == ERROR_GROW || stage == ERROR_RESIST) && !(error->yield > 0.0);
}

static int length_of(const SurfaceError *error, const ErrorRule *rule)
{
    switch (rule->list) {
    case NODES:
        return error->node_count;
    case TIED:
        return error->tied_count;
    case FACES:
        return error->face_count;
    case PUSHES:
        return error->push_count;
    case LINKS:
        return error->net[rule->which].link_count;
    default:
        return error->net[rule->which].hinge_count;
    }
}

// Does as much of the present stage as fits the budget; true once it is complete.
static bool work(const SurfaceModel *model, int *budget)
{
    SurfaceError *error = model->error;
    const ErrorRule *rule = &RULES[error->stage];
    if (is_idle(error, error->stage))
        return true;
    const int count = length_of(error, rule), most = *budget / rule->cost + 1;
    const int end = count - error->next > most ? error->next + most : count;
    if (end > error->next)
        rule->part(model, error->next, end);
    *budget -= rule->cost * (end - error->next);
    error->next = end;
    return end == count;
}

bool surface_estimate(void *self, const ErrorQuestion *question, int budget, BodyError *out)
{
    SurfaceModel *model = self;
    SurfaceError *error = model->error;
    while (budget > 0) {
        if (error->stage == ERROR_GATHER) {
            gather(model, &budget);
            if (error->full) { // unknown, until the topology changes
                *out = (BodyError){.displacement = (double)NAN, .relative = (double)NAN};
                return true;
            }
        } else if (error->stage == ERROR_COPY) {
            copy_state(model, question, &budget);
        } else if (work(model, &budget)) {
            const ErrorStage done = error->stage;
            const bool on = ++error->iteration < ITERATIONS && error->product[0] > 0.0;
            error->iteration -= done != ERROR_TURN;
            go_to(error, done == ERROR_TURN && on ? ERROR_START
                         : done == ERROR_SUM      ? ERROR_GATHER
                                                  : (ErrorStage)(done + 1));
            if (done == ERROR_SUM && answer(model, out))
                return true;
        }
    }
    return false;
}

void surface_snapshot_error(const void *self, int first, int end, unsigned char *share)
{
    const SurfaceModel *model = self;
    const SurfaceError *error = model->error;
    const float largest = error->largest[error->shown];
    memset(share, 0, (size_t)(end - first));
    for (int s = first; largest > 0.0F && s < end; s++) {
        const int node = model->shown.id[s] >= 0 ? model->node[model->shown.row[s]] : -1;
        const float part = node >= 0 ? error->size[error->shown][node] / largest : 0.0F;
        share[s - first] = (unsigned char)(255.0F * fminf(part, 1.0F) + 0.5F);
    }
}
