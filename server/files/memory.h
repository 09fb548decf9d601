// Whether the machine has the memory that a body will take, asked before it is taken: a scene that
// is too large is refused with a sentence, and not by the end of the program in the midst of it.
// Load time only; private to files.
#ifndef PLIANT_FILES_MEMORY_H
#define PLIANT_FILES_MEMORY_H

#include "files/scene.h"

// What may still be taken [bytes]: the least of what the machine, the limits of this process and
// its control group leave. HUGE_VAL where nothing is known.
double memory_free(void);

// Each is asked as soon as a size is known: `nodes` of level 0 of a surface body, `cells` of a
// voxel body. What they take is bounded from below, from figures that --explain prints for small
// scenes, so that nothing is refused that would have fitted. False with `status`.
bool memory_check_surface(const SceneBody *body, double nodes, Status *status);
bool memory_check_voxel(const SceneBody *body, double cells, Status *status);

// Nodes that a generator will make; 0: a file, which says so itself.
double memory_source_nodes(const MeshSource *source);

#endif
