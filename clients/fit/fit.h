// SPDX-License-Identifier: MIT
// A material from a uniaxial curve: reads a table of stress against strain, fits Young's modulus
// alone and with `stiffening`, pulls a strip of the result, and presents it.
// The law of uniaxial stress, nominal stress over nominal strain (server/body/stiffening.h):
//   s(e) = E e G'((e/strain)^2)
// of solids at any Poisson's ratio, and of surfaces that are pulled along edges of their triangles,
// whose other edges then carry nothing.
#ifndef PLIANT_FIT_FIT_H
#define PLIANT_FIT_FIT_H

#include "base/arguments.h"
#include "base/check.h"
#include "scene/scene.h"

#include <stdbool.h>

// --- the table -----------------------------------------------------------------------------------

enum { FIT_POINTS = 100000, FIT_POINTS_LEAST = 4 };

typedef struct FitTable {
    int count;
    double *strain; // [count] nominal, never falls; owned
    double *stress; // [count] nominal [Pa]; owned
    double peak;    // largest stress, positive or negative [Pa]
    bool has_time;  // a third column, which is checked and ignored
} FitTable;

// Reads comma-separated columns: strain [-], stress [Pa], and perhaps time [s]; a header, comments
// (#), blank lines, Windows' line ends and a byte-order mark are skipped. Refuses anything else by
// file and line.
bool fit_table_read(const char *path, FitTable *table, Status *status);
void fit_table_destroy(FitTable *table);

// --- the fit -------------------------------------------------------------------------------------

typedef struct FitLaw {
    double modulus;     // E [Pa]
    double strain, cap; // of stiffening; cap 1: linear
    double rms;         // of the difference from the table [Pa]
} FitLaw;

typedef enum FitShape {
    FIT_STRAIGHT, // no stiffening that the table determines
    FIT_STIFFENS,
    FIT_FLATTENS, // the slope falls: neither law has that
} FitShape;

typedef struct Fit {
    FitShape shape;
    FitLaw linear;
    FitLaw stiff;    // FIT_STIFFENS only
    bool cap_unmet;  // the table ends below the cap, which is the least that has no effect on it
    double slope[2]; // of the stiffening law at the table's start and end [Pa]
} Fit;

// Returns the uniaxial stress [Pa].
double fit_stress(const FitLaw *law, double strain);
// The same of a surface that is pulled across edges of its triangles, where it stiffens least.
double fit_stress_across(const FitLaw *law, double strain);
// Fits by least squares, with all values as they are printed (four digits). Refuses a table without
// a positive modulus. Deterministic.
bool fit_make(const FitTable *table, const char *path, Fit *fit, Status *status);

// --- the whole -----------------------------------------------------------------------------------

typedef struct FitOptions {
    const char *table_path; // NULL: no fit is asked for
    const char *model;      // "solid" or "surface"
    double thickness;       // of the wall [m]; 0: none given
    const char *out_folder; // NULL: fit-NAME
} FitOptions;

// --model and --thickness; the offset is that of a FitOptions.
extern const ArgumentRow FIT_ARGUMENTS[];
// Refuses options that do not go together.
bool fit_check(const FitOptions *options, Status *why);

// Reads, fits, simulates, prints, and writes tables and pictures.
bool fit_run(const FitOptions *options, Status *status);

#endif
