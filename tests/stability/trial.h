// SPDX-License-Identifier: MIT
// Private to the trials: files that scenes of the matrix name, and states that bodies start from.
#ifndef PLIANT_TESTS_STABILITY_TRIAL_H
#define PLIANT_TESTS_STABILITY_TRIAL_H

#include "matrix.h"

#include "scene/build.h"

// Writes the meshes and the volume that cases name.
void trial_write_files(const char *folder);
// Writes the `initial` file of a body: its rows at rest, moved as `start` says.
void trial_write_start(const char *path, const Body *body, const Model *model, Start start);
// The diagonal of the body's box at rest [m].
double trial_size(const Body *body);

#endif
