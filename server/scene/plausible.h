// Warnings about scenes that can be simulated but are probably mistakes: lengths in millimetres
// read as metres, a body that nothing fixes. Load time only.
#ifndef PLIANT_SCENE_PLAUSIBLE_H
#define PLIANT_SCENE_PLAUSIBLE_H

#include "scene/build.h"

// Logs one warning for each unusual number of a scene, with the line of the scene file, the number
// and its likely cause, and one for each key without effect. Returns the number of warnings.
int plausible_warn(World *world, const Scene *scene);

#endif
