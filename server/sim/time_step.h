// SPDX-License-Identifier: MIT
// Private to the module sim: the time steps of bodies, and the groups that take the same.
#ifndef PLIANT_SIM_TIME_STEP_H
#define PLIANT_SIM_TIME_STEP_H

#include "sim/sim_data.h"

// Lowers contact_lambda of an implicit body to what its step allows. Load time, before the
// contacts' stiffness is set.
void time_step_cap_contacts(const Sim *sim, Body *body);
// Chooses the time step at load time. Returns false if the scene's exceeds the bound of the body's
// finest level, or needs too many substeps.
bool time_step_choose(Sim *sim, Body *body, Status *status);
// Sets time_step_limit, substeps and h after the body's bounds or scales have changed. A time step
// of the scene that exceeds the bound is shortened, unless it is unsafe_time_step.
void time_step_follow(Sim *sim, Body *body);
// Gives joined bodies the same steps, the shortest of any. Load time, once every body has chosen.
void time_step_join(Sim *sim);
// Returns the largest stable step of a body at its finest level, with all tools [s].
double time_step_bound(const Sim *sim, const Body *body);
// True if the body's step at its finest level allows these scales; sets the allowed step and its
// step [s].
bool time_step_allows(const Sim *sim, const Body *body, double stiffness_scale,
                      double damping_scale, double *limit, double *step);
// Writes ", or <key> of at most <value>": the smallest change of a single key that lets the body
// take steps of h [s], or "" if there is none. Load time.
void time_step_advise(Sim *sim, Body *body, double h, char *text, size_t size);
// Merges the groups of two bodies, which advance together from then on.
void time_step_group(Sim *sim, int a, int b);

#endif
