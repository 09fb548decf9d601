// Checks that the machine has the memory of a body before it is allocated, so that a scene that is
// too large is refused with a sentence instead of being killed. Load time only; private to scene.
#ifndef PLIANT_SCENE_MEMORY_H
#define PLIANT_SCENE_MEMORY_H

#include "scene/scene.h"

// Returns the memory that can still be allocated [bytes]: the least of what the machine, the limits
// of this process and its control group leave. HUGE_VAL if unknown.
double memory_free(void);

// Check a body as soon as its size is known: `nodes` of level 0 of a surface body, `cells` of a
// voxel body. They use lower bounds, from figures that --explain prints for small scenes, so that
// no scene is refused that would fit. Return false with `status`.
bool memory_check_surface(const SceneBody *body, double nodes, Status *status);
bool memory_check_voxel(const SceneBody *body, double cells, Status *status);

// Returns the nodes that a generator will make; 0: a file, whose own size decides.
double memory_source_nodes(const MeshSource *source);

#endif
