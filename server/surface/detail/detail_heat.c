// SPDX-License-Identifier: MIT
// Heat of diathermy in a wall: an energy above body temperature for each face of the finest level,
// from which its temperature follows, up to boiling, where it stays while the latent heat of its
// water is given. Faces pass no heat on: blood cools them all alike. Step thread.
#include "surface/detail/detail.h"

#include "body/heat.h"

#include <math.h>

static double mass_of(const Detail *detail, int face)
{
    return detail->rules.areal_density *
           level_rules_area(&detail->rules, detail->set.levels.finest, face);
}

// Returns the energy with which all of a face's water is gone [J].
static double full(const Detail *detail, int face)
{
    return mass_of(detail, face) * (HEAT_CAPACITY * (HEAT_BOILING - HEAT_BODY) + HEAT_LATENT);
}

void detail_heat_create(Detail *detail, Arena *arena, StateList *state)
{
    const char *name = detail->options.body.name;
    const size_t faces = (size_t)detail->set.face_count;
    DetailHeat *heat = detail->set.cut->heat = ALLOCATE(ARENA_TOPOLOGY, 1, DetailHeat, "heat");
    heat->energy = ALLOCATE(ARENA_TOPOLOGY, faces + 1, double, "heat of faces");
    heat->step = ALLOCATE(ARENA_TOPOLOGY, 1, int64_t, "time of heat");
    state_add(state, heat->energy, faces * sizeof *heat->energy, "%s/heat", name);
    state_add(state, heat->step, sizeof *heat->step, "%s/heat_step", name);
}

// Blood has cooled all faces since the last call.
static void cool(Detail *detail, int64_t step, double tick)
{
    DetailHeat *heat = detail->set.cut->heat;
    const double passed = (double)(step - *heat->step) * tick;
    *heat->step = step;
    if (!(passed > 0.0))
        return; // the same tick, or time has begun again
    const double left = exp(-HEAT_PERFUSION * passed);
    for (int f = 0; f < detail->set.face_count; f++)
        heat->energy[f] *= left;
}

double detail_heat_give(Detail *detail, int64_t step, const Removal *removal, const int *face,
                        int count)
{
    DetailCut *cut = detail->set.cut;
    double *energy = cut->heat->energy, left = removal->heat, given = 0.0;
    if (count == 0)
        return 0.0;
    cool(detail, step, removal->tick);
    // By mass, none more than it can take: what is over goes to the others.
    for (int round = 0; round < count && left > 0.0; round++) {
        double open = 0.0, most = 1.0;
        for (int i = 0; i < count; i++)
            open += energy[face[i]] < full(detail, face[i]) ? mass_of(detail, face[i]) : 0.0;
        for (int i = 0; i < count; i++) {
            const double room = full(detail, face[i]) - energy[face[i]];
            if (room > 0.0)
                most = fmin(most, room * open / (left * mass_of(detail, face[i])));
        }
        // As much as fills the first of them, exactly.
        const double part = most * left;
        for (int i = 0; i < count && open > 0.0; i++) {
            const double whole = full(detail, face[i]), room = whole - energy[face[i]],
                         share = part * mass_of(detail, face[i]) / open;
            if (!(room > 0.0))
                continue;
            const double takes = share < room * (1.0 - 1e-12) ? share : room;
            energy[face[i]] = takes < room ? energy[face[i]] + takes : whole;
            given += takes;
        }
        left = open > 0.0 ? left - part : 0.0;
    }
    for (int i = 0; i < count; i++)
        if (energy[face[i]] >=
            mass_of(detail, face[i]) * HEAT_CAPACITY * (HEAT_COAGULATES - HEAT_BODY))
            cut->broken[face[i]] |= CUT_COAGULATED;
    return given;
}

bool detail_heat_boils_away(const Detail *detail, int face)
{
    return detail->set.cut->heat->energy[face] >= full(detail, face);
}

bool detail_heat_check(const Detail *detail)
{
    const DetailCut *cut = detail->set.cut;
    for (int f = 0; cut->heat != NULL && f < detail->set.face_count; f++)
        if (!(cut->heat->energy[f] >= 0.0 &&
              cut->heat->energy[f] <= (detail_cut_is_gone(cut, f) ? 0.0 : full(detail, f))))
            return false;
    return true;
}
