// The report of `pliant-prepare --check`: what a mesh file holds, what had to be repaired, how good
// its triangles are, and the time step that it allows. Load time only.
#ifndef PLIANT_FILES_MESH_REPORT_H
#define PLIANT_FILES_MESH_REPORT_H

#include "base/status.h"

#include <stdio.h>

// Prints the report of a mesh file whose unit is `scale` metres; 0: not known, taken as metres.
// False with one sentence in `status` when a scene could not use it; then nothing is printed.
bool mesh_report_print(const char *path, double scale, FILE *out, Status *status);

#endif
