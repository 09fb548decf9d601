// Comparing runs by cost and error.
#include "study/pareto.h"

#include "study/case.h"

#include <math.h>
#include <string.h>

double study_error(const StudyErrors *errors)
{
    return isnan(errors->patch) ? errors->surface : errors->patch;
}

void pareto_front(int count, const double *costs, const double *errors, bool *front)
{
    for (int i = 0; i < count; i++) {
        front[i] = isfinite(costs[i]) && isfinite(errors[i]);
        for (int j = 0; j < count && front[i]; j++)
            if (costs[j] <= costs[i] && errors[j] <= errors[i] &&
                (costs[j] < costs[i] || errors[j] < errors[i]))
                front[i] = false;
    }
}

void study_front_total(const StudyResult *result, bool *front)
{
    double costs[STUDY_CASES], errors[STUDY_CASES];
    for (int i = 0; i < result->run_count; i++) {
        const StudyRun *run = &result->run[i];
        costs[i] = run->verdict == STUDY_OK ? run->cpu_median : (double)NAN;
        errors[i] = study_error(&run->total);
    }
    pareto_front(result->run_count, costs, errors, front);
}

const StudyRun *study_scene_run(const StudyResult *result)
{
    for (int i = 0; i < result->run_count; i++)
        if (result->run[i].what.is_scene)
            return &result->run[i];
    return NULL;
}

const StudyReference *study_time_reference(const StudyResult *result, const StudyCase *of)
{
    for (int i = 0; i < result->mesh_count; i++) {
        const StudyMesh *mesh = &result->mesh[i];
        const StudyCase like = {.detail = mesh->detail,
                                .level = mesh->level,
                                .threshold = mesh->threshold,
                                .paper_rule = mesh->paper_rule};
        if (study_same_mesh(&like, of))
            return &mesh->reference;
    }
    return NULL;
}

const char *study_mesh_words(const StudyResult *result, const StudyCase *like)
{
    for (int i = 0; i < result->run_count; i++) {
        const char *comma = strchr(result->run[i].what.name, ',');
        if (comma != NULL && comma[1] == ' ' && study_same_mesh(&result->run[i].what, like))
            return comma + 2;
    }
    return "no case's";
}
