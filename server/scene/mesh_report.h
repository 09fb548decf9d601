// The report of `pliant-prepare --check`: contents of a mesh file, necessary repairs, quality of
// its triangles, the time step that it allows, and the models that it fits. Load time only.
#ifndef PLIANT_SCENE_MESH_REPORT_H
#define PLIANT_SCENE_MESH_REPORT_H

#include "base/status.h"

#include <stdio.h>

// Prints the report of a mesh file whose unit is `scale` metres (0: guessed, io/units.h), or of
// a label volume, whose own units are multiplied by `scale` (0: 1), and whether it can be a wall or
// a solid (scene/proposal.h). Returns false with one sentence in `status` if it can be neither;
// prints nothing about a file that cannot be read.
bool mesh_report_print(const char *path, double scale, FILE *out, Status *status);

#endif
