// SPDX-License-Identifier: MIT
// The experiments of Miyazaki et al. 2004, and a real beam, but for the plane case's times
// (plane_cost.c); each writes tables, tab-separated with a header line, and what pictures are drawn
// from into one folder. tests/accuracy/voxel.sh makes the report of them.
#ifndef PLIANT_TESTS_ACCURACY_VOXEL_ACCURACY_H
#define PLIANT_TESTS_ACCURACY_VOXEL_ACCURACY_H

#include "experiment.h"

enum { LEVEL_COLOURS = 5 };
extern const unsigned LEVEL_COLOUR[LEVEL_COLOURS]; // RGB, of elements in pictures

void disc_layout(const Experiment *experiment);   // Fig. 4
void cube_layout(const Experiment *experiment);   // Figs 2 and 10
void press_test(const Experiment *experiment);    // Fig. 3 and the frame's cost ratio
void process_costs(const Experiment *experiment); // Table 1 and Fig. 11, in space
void beam_and_patches(const Experiment *experiment);
void cuts(const Experiment *experiment);      // Figs 6, 8 and 9
void real_beam(const Experiment *experiment); // reality.md: cells of 5 mm, then of 2.5, and the fit
void real_beam_finely(const Experiment *experiment);
void fit_to_the_beam(const Experiment *experiment);
void organ(const Experiment *experiment); // experiment->scenes/../../../config/organ-volume.cfg

#endif
