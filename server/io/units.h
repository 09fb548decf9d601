// The length unit of a mesh file, which most formats do not state: guessed from its extent and from
// comments that some programs write. Load time only.
#ifndef PLIANT_IO_UNITS_H
#define PLIANT_IO_UNITS_H

#include <stdbool.h>

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
