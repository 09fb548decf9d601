// SPDX-License-Identifier: MIT
// What of the estimate of a wall's error (error.h) belongs to the state of a body that steers its
// detail by it: the arrays of the round under way. The lists of both walls follow from the
// topology, for which a driven body begins its round again whenever that changes.
#include "surface/error.h"

#include "surface/detail/detail.h"

static int64_t topology_of(const SurfaceModel *model)
{
    return model->detail->adapt.sweep->topology;
}

// Not by names of the body's own arrays: tries of its steps (sim/estimate.c) change none of them.
#define LIST(member, count, label)                                                                 \
    state_add(state, (member), (size_t)(count) * sizeof *(member), "error of %s/" label, name)

void surface_error_list(SurfaceModel *model, const char *name, StateList *state)
{
    SurfaceError *error = model->error;
    const int nodes = error->node_capacity;
    const int links = 9 * error->leaf_capacity,
              hinges = error->bending > 0.0 ? 6 * error->leaf_capacity : 0;
    error->driven = true;
    // Progress.
    LIST(&error->topology, 1, "topology");
    LIST(&error->level, 1, "level");
    LIST(&error->at, 1, "at");
    LIST(&error->stage, 1, "stage");
    LIST(&error->next, 1, "next");
    LIST(&error->iteration, 1, "iteration");
    // By nodes, springs and hinges.
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
    LIST(error->presses, nodes, "presses");
    LIST(error->tool, nodes, "tool");
    LIST(error->pull, links, "pull");
    if (hinges > 0)
        LIST(error->turn, hinges, "turn");
    if (error->swell != NULL)
        LIST(error->swell, nodes, "swell");
    // Numbers.
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
    LIST(&error->sums, 1, "sums");
    // Of complete rounds.
    LIST(error->kept, model->node_count, "kept");
    LIST(&error->size_of_last, 1, "size_of_last");
    LIST(&error->growth, 1, "growth");
    LIST(&error->rounds, 1, "rounds");
}

bool surface_error_is_current(const SurfaceModel *model)
{
    return model->error != NULL && model->error->driven &&
           model->error->topology == topology_of(model);
}

static bool is_progress(const SurfaceError *error)
{
    const Levels *levels = error->levels;
    const bool gathered = error->level == levels->finest + 1;
    return error->level >= 0 && error->level <= levels->finest + 1 && error->at >= 0 &&
           error->at <= (gathered ? 0 : levels->level[error->level].face_count) &&
           (int)error->stage >= ERROR_GATHER && error->stage < ERROR_STAGES &&
           (error->stage == ERROR_GATHER || gathered) && error->next >= 0 &&
           error->next <= 9 * error->leaf_capacity + error->node_capacity && // of any list
           error->iteration >= 0 && error->iteration <= SURFACE_ERROR_MOST &&
           error->tool_count >= 0 && error->tool_count <= ERROR_TOOLS;
}

bool surface_error_check(const SurfaceModel *model)
{
    const SurfaceError *error = model->error;
    if (error == NULL || !error->driven)
        return true;
    const unsigned char *presses = (const unsigned char *)error->presses;
    bool sound = is_progress(error);
    for (int i = 0; i < error->node_capacity && sound; i++)
        sound = error->tool[i] >= -1 && error->tool[i] < ERROR_TOOLS && presses[i] <= 1;
    return sound;
}

void surface_error_restored(SurfaceModel *model, bool is_current)
{
    SurfaceError *error = model->error;
    if (error == NULL || !error->driven || !is_progress(error))
        return;
    const int level = error->level, at = error->at;
    const int64_t topology = topology_of(model);
    surface_error_forget(error);
    if (!is_current) { // the next call begins again
        error->topology = error->topology == topology ? -1 : error->topology;
        error->level = level;
        error->at = at;
        return;
    }
    error->topology = topology;
    while (error->level < level || error->at < at) {
        if (error->at < error->levels->level[error->level].face_count)
            surface_error_add_leaf(model, error->level, error->at++);
        else
            error->level++, error->at = 0;
    }
}
