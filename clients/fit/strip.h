// SPDX-License-Identifier: MIT
// The tensile test: a strip clamped at one end and pulled at the other at a given rate, as a scene
// of either model. Strain is measured between two marks on the middle third, as an extensometer
// does, so that the clamps, which keep the ends from thinning, don't disturb it.
#ifndef PLIANT_FIT_STRIP_H
#define PLIANT_FIT_STRIP_H

#include "base/check.h"
#include "scene/scene.h"

// Writes the scene folder/name.cfg, and folder/name.off of a surface strip. `material`: the content
// of the group, as in a scene; with a `note`, a comment for the reader, or "".
bool strip_write(const char *folder, const char *name, SceneModel model, const char *material,
                 const char *note, Status *status);

// Force against stretch, from the unloaded strip on.
typedef struct StripCurve {
    int count;
    double *strain; // nominal, between the marks; owned
    double *stress; // force over the width at rest [N/m] (surface), or over the section [Pa]; owned
} StripCurve;

// Reads such a scene and pulls its strip to a nominal `strain` > 0, at `rate` per second of its
// length. False with `status`, also if the body was restored or does not reach the strain.
bool strip_pull(const char *path, double strain, double rate, StripCurve *curve, Status *status);
void strip_destroy(StripCurve *curve);
// Returns the stress at a strain by linear interpolation; NAN beyond the curve's end.
double strip_stress_at(const StripCurve *curve, double strain);

#endif
