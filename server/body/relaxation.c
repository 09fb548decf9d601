// SPDX-License-Identifier: MIT
#include "body/relaxation.h"

#include <math.h>
#include <string.h>

// Returns the numbers of a group.
static size_t group_of(const Relaxation *relaxation)
{
    const RelaxationLayout *layout = &relaxation->layout;
    return (size_t)relaxation->count * (size_t)layout->strains * (size_t)layout->lanes;
}

static size_t size_of(const Relaxation *relaxation)
{
    const RelaxationLayout *layout = &relaxation->layout;
    const size_t real = layout->precision == PRECISION_SINGLE ? sizeof(float) : sizeof(double);
    return (size_t)layout->groups * group_of(relaxation) * real;
}

Relaxation *relaxation_create(int count, const MaxwellBranch *branch,
                              const RelaxationLayout *layout, const char *name, Arena *arena,
                              StateList *state)
{
    Relaxation *relaxation = ALLOCATE(ARENA_STEP, 1, Relaxation, "relaxation");
    relaxation->count = count;
    memcpy(relaxation->branch, branch, (size_t)count * sizeof *branch);
    relaxation->rigidity = maxwell_rigidity(count, branch);
    relaxation->layout = *layout;
    const size_t size = size_of(relaxation);
    for (int k = 0; k < 2; k++)
        relaxation->strain[k] =
            arena_allocate(arena, ARENA_STEP, size, 1, "%s/dashpots %d", name, k);
    state_add_pair(state, relaxation->strain[0], relaxation->strain[1], &relaxation->current, size,
                   "%s/dashpots", name);
    return relaxation;
}

static void set_branches(const Relaxation *relaxation, double h, RelaxationPass *pass)
{
    pass->count = relaxation->count;
    for (int i = 0; i < relaxation->count; i++) {
        const MaxwellBranch *branch = &relaxation->branch[i];
        pass->branch[i] = (RelaxationBranch){.stiffness = branch->share * relaxation->rigidity,
                                             .half = exp(-0.5 * h / branch->time),
                                             .volumetric = branch->volumetric};
    }
}

void relaxation_begin(Relaxation *relaxation, double h, RelaxationPass *pass)
{
    const int other = 1 - relaxation->current;
    set_branches(relaxation, h, pass);
    pass->from = relaxation->strain[relaxation->begun ? other : relaxation->current];
    pass->to = relaxation->strain[other];
    relaxation->begun = true;
}

void relaxation_measure(const Relaxation *relaxation, RelaxationPass *pass)
{
    set_branches(relaxation, 0.0, pass);
    pass->from =
        relaxation->strain[relaxation->begun ? 1 - relaxation->current : relaxation->current];
}

void relaxation_skip(const Relaxation *relaxation, int group, const RelaxationPass *from,
                     RelaxationPass *to)
{
    const size_t bytes = size_of(relaxation) / (size_t)relaxation->layout.groups * (size_t)group;
    to->from = (const char *)from->from + bytes;
    to->to = from->to == NULL ? NULL : (char *)from->to + bytes;
}

void relaxation_commit(Relaxation *relaxation)
{
    relaxation->current = relaxation->begun ? 1 - relaxation->current : relaxation->current;
    relaxation->begun = false;
}

void relaxation_abandon(Relaxation *relaxation)
{
    relaxation->begun = false;
}

void relaxation_forget(Relaxation *relaxation)
{
    for (int k = 0; k < 2; k++)
        memset(relaxation->strain[k], 0, size_of(relaxation));
}

static double get(const Relaxation *relaxation, size_t at)
{
    const void *strain = relaxation->strain[relaxation->current];
    return relaxation->layout.precision == PRECISION_SINGLE ? (double)((const float *)strain)[at]
                                                            : ((const double *)strain)[at];
}

bool relaxation_check(const Relaxation *relaxation)
{
    const size_t numbers = (size_t)relaxation->layout.groups * group_of(relaxation);
    for (size_t i = 0; i < numbers; i++)
        if (!(fabs(get(relaxation, i)) < 1e6)) // as far as no tissue is stretched
            return false;
    return true;
}

static size_t place_of(const Relaxation *relaxation, int lane, int number)
{
    const int lanes = relaxation->layout.lanes;
    return (size_t)(lane / lanes) * group_of(relaxation) + (size_t)(number * lanes + lane % lanes);
}

void relaxation_take(const Relaxation *relaxation, int lane, double strain[RELAXATION_NUMBERS])
{
    for (int i = 0; i < relaxation->count * relaxation->layout.strains; i++)
        strain[i] = get(relaxation, place_of(relaxation, lane, i));
}

// In both arrays: what is not in use any more is written in neither, and must be alike.
void relaxation_put(Relaxation *relaxation, int lane, const double strain[RELAXATION_NUMBERS])
{
    for (int i = 0; i < relaxation->count * relaxation->layout.strains; i++) {
        const size_t at = place_of(relaxation, lane, i);
        for (int k = 0; k < 2; k++)
            if (relaxation->layout.precision == PRECISION_SINGLE)
                ((float *)relaxation->strain[k])[at] = (float)strain[i];
            else
                ((double *)relaxation->strain[k])[at] = strain[i];
    }
}
