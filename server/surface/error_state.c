// SPDX-License-Identifier: MIT
// What of the estimate of a wall's error (error.h) belongs to the state of a body that steers its
// detail by it: the lists of the wall as it was when the round began, and the arrays of the round.
// Not so the tangents, which follow from the arrays, and lists that are not complete, which are
// those of the present topology.
#include "surface/error.h"

#include "surface/detail/detail.h"

#include <string.h>

static int64_t topology_of(const SurfaceModel *model)
{
    return model->detail->adapt.sweep->topology;
}

static int links_of(const SurfaceError *error, int which)
{
    return (which == 0 ? 3 : 9) * error->leaf_capacity;
}

static int hinges_of(const SurfaceError *error, int which)
{
    return error->bending > 0.0 ? (which == 0 ? 3 : 6) * error->leaf_capacity : 0;
}

// Not by names of the body's own arrays: tries of its steps (sim/estimate.c) change none of them.
#define LIST(member, count, label)                                                                 \
    state_add(state, (member), (size_t)(count) * sizeof *(member), "error of %s/" label, name)

static void list_net(SurfaceError *error, int which, const char *name, const char *label,
                     StateList *state)
{
    ErrorNet *net = &error->net[which];
    state_add(state, net->link, (size_t)links_of(error, which) * sizeof *net->link,
              "error of %s/%s links", name, label);
    state_add(state, &net->link_count, sizeof net->link_count, "error of %s/%s link_count", name,
              label);
    state_add(state, &net->hinge_count, sizeof net->hinge_count, "error of %s/%s hinge_count", name,
              label);
    if (error->bending > 0.0)
        state_add(state, net->hinge, (size_t)hinges_of(error, which) * sizeof *net->hinge,
                  "error of %s/%s hinges", name, label);
}

void surface_error_list(SurfaceModel *model, const char *name, StateList *state)
{
    SurfaceError *error = model->error;
    const int nodes = error->node_capacity;
    error->driven = true;
    // Progress.
    LIST(&error->topology, 1, "topology");
    LIST(&error->level, 1, "level");
    LIST(&error->at, 1, "at");
    LIST(&error->stage, 1, "stage");
    LIST(&error->next, 1, "next");
    LIST(&error->iteration, 1, "iteration");
    // What is compared.
    LIST(&error->order, 1, "order");
    LIST(&error->node_count, 1, "node_count");
    LIST(error->node, nodes, "node");
    LIST(&error->tied_count, 1, "tied_count");
    LIST(error->tied, nodes, "tied");
    LIST(&error->full, 1, "full");
    list_net(error, 0, name, "own", state);
    list_net(error, 1, name, "finer", state);
    LIST(&error->rest_volume, 1, "rest_volume");
    LIST(&error->face_count, 1, "face_count");
    LIST(error->face, error->leaf_capacity, "face");
    // By nodes.
    state_add(state, error->rows, (size_t)model->basis.count * ROW * model_real_size(model),
              "error of %s/rows", name);
    LIST(error->coarse, nodes, "coarse");
    LIST(error->density, nodes, "density");
    LIST(error->x, nodes, "x");
    LIST(error->moved, nodes, "moved");
    LIST(error->defect, nodes, "defect");
    LIST(error->way, nodes, "way");
    LIST(error->change, nodes, "change");
    LIST(error->diagonal, nodes, "diagonal");
    LIST(error->tool, nodes, "tool");
    if (error->swell != NULL)
        LIST(error->swell, nodes, "swell");
    // Numbers.
    LIST(&error->stiffness, 1, "stiffness");
    LIST(&error->volume, 1, "volume");
    LIST(&error->pressure, 1, "pressure");
    LIST(&error->yield, 1, "yield");
    LIST(&error->grows, 1, "grows");
    LIST(&error->product, 1, "product");
    LIST(&error->curvature, 1, "curvature");
    LIST(&error->tool_count, 1, "tool_count");
    LIST(&error->tool_at, 1, "tool_at");
    LIST(&error->tool_force, 1, "tool_force");
    LIST(&error->tool_size, 1, "tool_size");
    LIST(&error->tool_reach, 1, "tool_reach");
    LIST(&error->tool_coarse, 1, "tool_coarse");
    LIST(&error->tool_finer, 1, "tool_finer");
    LIST(&error->tool_kappa, 1, "tool_kappa");
    LIST(&error->tool_rest, 1, "tool_rest");
    LIST(&error->tool_pushes, 1, "tool_pushes");
    LIST(&error->tool_slope, 1, "tool_slope");
    LIST(&error->barrier, 1, "barrier");
    LIST(&error->sums, 1, "sums");
    // Of complete rounds.
    LIST(error->kept, error->keep_count, "kept");
    LIST(error->was, model->node_count, "was");
    LIST(&error->size_of_last, 1, "size_of_last");
    LIST(&error->growth, 1, "growth");
    LIST(&error->rounds, 1, "rounds");
}

bool surface_error_is_current(const SurfaceModel *model)
{
    return model->error != NULL && model->error->driven &&
           model->error->topology == topology_of(model);
}

static bool is_count(int count, int most)
{
    return count >= 0 && count <= most;
}

static bool is_complete(const SurfaceError *error)
{
    return error->level > error->levels->finest;
}

static bool is_progress(const SurfaceModel *model)
{
    const SurfaceError *error = model->error;
    const Levels *levels = error->levels;
    const bool gathered = is_complete(error);
    return error->topology <= topology_of(model) && error->level >= 0 &&
           error->level <= levels->finest + 1 && error->at >= 0 &&
           error->at <= (gathered ? 0 : levels->level[error->level].face_count) &&
           (int)error->stage >= ERROR_GATHER && error->stage < ERROR_STAGES &&
           (error->stage == ERROR_GATHER || gathered) && error->next >= 0 &&
           error->next <= 9 * error->leaf_capacity + error->node_capacity && // of any list
           error->iteration >= 0 && error->iteration <= SURFACE_ERROR_MOST &&
           error->tool_count >= 0 && error->tool_count <= ERROR_TOOLS;
}

// True if the first `count` of `corners` nodes each are nodes; of the body, if `own`.
static bool are_nodes(const SurfaceError *error, const int *node, int count, bool own)
{
    bool sound = true;
    for (int k = 0; k < count && sound; k++)
        sound = node[k] >= 0 && node[k] < error->node_count &&
                (!own || error->node[node[k]].model >= 0);
    return sound;
}

// True if what hangs or is between others has parents of lower numbers, all in the body.
static bool check_node(const SurfaceModel *model, int i)
{
    const SurfaceError *error = model->error;
    const ErrorNode *node = &error->node[i];
    const bool has = node->parent[0] >= 0;
    bool sound = node->model >= -1 && node->model < model->node_count && node->keep >= 0 &&
                 node->keep < error->keep_count &&
                 (has || (node->model >= 0 && !node->hangs && !node->tied));
    for (int k = 0; k < 2 && sound && has; k++)
        sound = node->parent[k] < i && are_nodes(error, &node->parent[k], 1, true) &&
                (node->wing[k] == -1 || are_nodes(error, &node->wing[k], 1, true));
    return sound;
}

// True if the complete lists are those of some wall.
static bool check_lists(const SurfaceModel *model)
{
    const SurfaceError *error = model->error;
    bool sound = is_count(error->node_count, error->node_capacity) &&
                 is_count(error->tied_count, error->node_capacity) &&
                 is_count(error->face_count, error->leaf_capacity);
    for (int i = 0; sound && i < error->node_count; i++)
        sound = check_node(model, i);
    for (int i = 0; sound && i < error->tied_count; i++)
        sound = are_nodes(error, &error->tied[i], 1, false) && error->node[error->tied[i]].tied;
    for (int i = 0; sound && i < error->face_count; i++)
        sound = are_nodes(error, error->face[i], 3, true) &&
                are_nodes(error, error->face[i] + 3, 3, false);
    for (int k = 0; sound && k < 2; k++) {
        const ErrorNet *net = &error->net[k];
        sound = is_count(net->link_count, links_of(error, k)) &&
                is_count(net->hinge_count, hinges_of(error, k));
        for (int i = 0; sound && i < net->link_count; i++)
            sound = are_nodes(error, net->link[i].node, 2, k == 0);
        for (int i = 0; sound && i < net->hinge_count; i++)
            sound = are_nodes(error, net->hinge[i].node, 4, k == 0);
    }
    return sound;
}

bool surface_error_check(const SurfaceModel *model)
{
    const SurfaceError *error = model->error;
    if (error == NULL || !error->driven)
        return true;
    bool sound = is_progress(model) && (!is_complete(error) || check_lists(model));
    for (int i = 0; i < error->node_capacity && sound; i++)
        sound = error->tool[i] >= -1 && error->tool[i] < ERROR_TOOLS;
    return sound;
}

void surface_error_restored(SurfaceModel *model, bool is_current)
{
    SurfaceError *error = model->error;
    if (error == NULL || !error->driven || !is_progress(model))
        return;
    const int64_t topology = topology_of(model);
    if (!is_current && error->topology == topology)
        error->topology = -1;
    if (is_current)
        error->topology = topology;
    // The numbers of what was compared before.
    memset(error->of_node, -1, (size_t)model->node_count * sizeof *error->of_node);
    surface_error_forget_edges(error);
    if (is_complete(error)) {
        if (check_lists(model))
            surface_error_tangents(model);
        return;
    }
    const int level = error->level, at = error->at;
    error->node_count = 0;
    surface_error_forget(error);
    if (!is_current) { // the next call begins again
        error->level = level;
        error->at = at;
        return;
    }
    while (error->level < level || error->at < at) {
        if (error->at < error->levels->level[error->level].face_count)
            surface_error_add_leaf(model, error->level, error->at++);
        else
            error->level++, error->at = 0;
    }
}
