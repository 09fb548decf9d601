// SPDX-License-Identifier: MIT
// The experiments of Choi et al. 2005; each writes tables and curves, tab-separated with a header
// line, into one folder. tests/accuracy/report.sh makes the report of them.
#ifndef PLIANT_TESTS_ACCURACY_ACCURACY_H
#define PLIANT_TESTS_ACCURACY_ACCURACY_H

#include "experiment.h"
#include "run.h"

const char *rule_name(SurfaceAdjust rule);

void masses_and_counts(const Experiment *experiment);     // Fig. 6, eqs 6 and 7, Table 1's counts
void collapse_and_recovery(const Experiment *experiment); // Fig. 8
void damping_of_shape_springs(const Experiment *experiment); // eq 10
void coarse_against_refined(const Experiment *experiment);   // Figs. 9 and 10
void displaced_region(const Experiment *experiment);         // Fig. 11
void cost_and_curves(const Experiment *experiment);          // Fig. 12 and Table 1
void curvature_thresholds(const Experiment *experiment);     // what the threshold of curvature buys
void constant_shape_springs(const Experiment *experiment);   // shape springs that no level changes

#endif
