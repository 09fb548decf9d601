// SPDX-License-Identifier: MIT
// Reads mesh files to TriMesh: OBJ, OFF, STL, PLY, VTK, VTP, VTU and MSH, recognised by content,
// and TetGen's pairs, by name.
#ifndef PLIANT_IO_MESH_IMPORT_H
#define PLIANT_IO_MESH_IMPORT_H

#include "base/check.h"
#include "geometry/mesh_repair.h"

#include <stdbool.h>

// Contents of a file and the repairs that were needed.
typedef struct MeshImport {
    const char *format; // "binary STL"
    int node_count, face_count;
    MeshRepairs repairs;
    char remarks[512]; // what a user must know, apart by "; ", or ""
} MeshImport;

// Returns what a mesh file says of the patient's frame in its first lines, as 3D Slicer writes it:
// "states no frame", "states LPS", "states RAS and was turned to LPS".
const char *mesh_frame(const char *path);

// What is taken in spite of a fault, by request only.
typedef struct MeshMending {
    double weld;     // joins borders so far apart [units of the file]; 0: not more than rounding
    bool miscounted; // a binary STL: the triangles that its size holds, not those it announces
} MeshMending;

// Reads a mesh and makes it fit for simulation (geometry/mesh_repair.h): nodes in the order of the
// file, not scaled, in LPS as label volumes are: a file that states RAS is turned, which a remark
// says. Errors are one sentence that names the file and its line or element; faces and
// nodes count from 0 in the order of the file.
bool mesh_import(const char *path, TriMesh *mesh, MeshImport *import, Status *status);
bool mesh_import_mending(const char *path, const MeshMending *mending, TriMesh *mesh,
                         MeshImport *import, Status *status);

// --- units ---------------------------------------------------------------------------------------

// The length unit of a mesh file, which most formats do not state: guessed from its extent and from
// comments that some programs write. Load time only.
typedef struct Units {
    double scale;     // metres per unit of the file
    const char *name; // "mm"
    bool doubt;       // another unit is as likely
    char reason[256]; // a sentence without its full stop
} Units;

enum { UNITS_LENGTH = 32 };

// Parses "m", "dm", "cm", "mm" or "um"; returns false for anything else.
bool units_parse(const char *name, double *scale);
// Guesses the unit of a file whose mesh has this extent (longest side of its box, in file units).
// Searches the first lines of `path` for a unit.
Units units_guess(const char *path, double extent);
// Formats a length: "250 mm", "9 mm", "0.1 um", "3.2 m".
void units_length(double metres, char text[UNITS_LENGTH]);

#endif
