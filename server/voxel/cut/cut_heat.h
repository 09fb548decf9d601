// SPDX-License-Identifier: MIT
// Heat in a voxel body that diathermy acts on: what an electrode gives, how it spreads, what it
// coagulates and what boils away (README.md, "Heat"). The state is one number for each finest cell,
// its energy above body temperature: the temperature follows from it, up to boiling, where it stays
// while the latent heat of the cell's water is given. Cells pass energy on in pairs, across faces
// that are not broken, so that what one loses the other gets.
//
// Step thread, except where marked as load time.
#ifndef PLIANT_VOXEL_CUT_CUT_HEAT_H
#define PLIANT_VOXEL_CUT_CUT_HEAT_H

#include "body/heat.h"
#include "body/remove.h"
#include "body/rows.h"
#include "voxel/cut/cut_centre.h"
#include "voxel/cut/cut_lattice.h"

// Perfusion ends where tissue coagulates.
// A cell is coagulated once the integral of A exp(-E / (R T)) over time is 1 (Henriques 1947,
// "Studies of thermal injury V", Arch. Pathol. 43, 489): in 1 s at 60 C, in 10 minutes at 51 C.
#define HEAT_FREQUENCY  3.1e98 // A [1/s]
#define HEAT_ACTIVATION 6.28e5 // E [J/mol]

enum {
    HEAT_VISITS = 512,  // cells a tick that pass heat on; more take their turns
    HEAT_WINDOWS = 128, // windows in which an electrode looks for cells
    HEAT_NEAR = 4096,   // cells that it heats
    HEAT_RATES = 228,   // temperatures with known rates of damage, up to boiling
};
#define HEAT_HARMLESS 43.0 // below that damage is not counted: 30 hours to coagulate [C]
#define HEAT_COOL     0.01 // a cell this little warmer than the body neither warms nor cools [K]

// A sum that keeps what its rounding loses (Neumaier).
typedef struct HeatSum {
    double sum, lost;
} HeatSum;

// Where the energy went [J], and the present round over the warm cells; plain data, state.
typedef struct HeatBooks {
    HeatSum given, perfused, removed;
    double since;    // time since the present round began [s]
    double span;     // time that it makes up for: what the one before it took [s]
    int64_t next;    // words that it has done; 0: a new one begins
    int64_t round;   // 0 or 1: from the first or from the last cell on
    int64_t refused; // ticks in which tissue could not take all heat, since load
} HeatBooks;

typedef struct CutHeat {
    // --- constant ---
    const CutLattice *lattice;
    double size;      // of a cell [m]
    double perfusion; // [1/s]
    double stiffer;   // stiffness of coagulated tissue over that before
    int cell_count, word_count, material_count;
    int (*beside)[6];           // [cell] neighbours -x +x -y +y -z +z; -1: void
    double *capacity;           // [material - 1] of a cell [J/K]
    float rate[HEAT_RATES + 1]; // of damage, from HEAT_HARMLESS to boiling [1/s]

    // --- state ---
    double *energy;  // [cell] [J]
    float *damage;   // [cell] from 1 on the cell is coagulated
    uint64_t *visit; // [word] cells of the present round, one bit each
    HeatBooks *books;

    // --- derived from it ---
    uint64_t *warm;               // [word] cells warmer than HEAT_COOL
    int warm_count, cooked_count; // cells that are warm, and that ever coagulated
    int *cooked;                  // [element] coagulated cells in it, also those taken away since
    unsigned char *stiff;         // [element] 1: most of its cells are
    int *coagulated;              // [material - 1] cells that are still there
    // --- not state: of what is published ---
    int shown_count; // cooked_count when it was shown
    double unshown;  // time since [s]

    // --- of the last call ---
    int *changed; // [changed_count] elements that became stiff: leaves
    int changed_count;

    // --- scratch ---
    int *window; // [HEAT_WINDOWS]
    int near_count;
    int *near;          // [HEAT_NEAR] cells
    double *near_share; // [HEAT_NEAR]
    int boiled_count;
    int *boiled; // [HEAT_NEAR] of the last cut_heat_give: cells whose water is gone, ascending
} CutHeat;

// Load time. `making`: the lattice and its materials.
void cut_heat_create(CutHeat *heat, const char *name, const CutLattice *lattice,
                     const VoxelMaking *making, Arena *arena, StateList *state);

// Gives a diathermy's heat to the cells near its electrode, in this state of the rows, if it
// touches any: evenly to cells within its radius a, and as (a / r)^4 beyond, as a current that
// spreads evenly heats. No cell takes more than it needs to boil away. Returns what was given [J].
double cut_heat_give(CutHeat *heat, const Rows *rows, const void *row, const Removal *removal);
// Lets heat spread for a tick [s]: HEAT_VISITS cells at most, in turns. Elements that became stiff
// are in `changed`. True if there are any.
bool cut_heat_spread(CutHeat *heat, double tick);
// True if the colours of a body are to follow what has coagulated: at most five times a second.
bool cut_heat_shows(CutHeat *heat, double tick);
// Takes away what cells hold that are removed.
void cut_heat_remove(CutHeat *heat, const int *cell, int count);

// Returns a cell's temperature [C].
double cut_heat_temperature(const CutHeat *heat, int cell);
static inline bool cut_heat_is_coagulated(const CutHeat *heat, int cell)
{
    return heat->damage[cell] >= 1.0f;
}
double cut_heat_coagulated(const CutHeat *heat); // volume at rest that is still there [m3]
// Returns the share of the cells around a vertex at rest that are coagulated, for its colour.
double cut_heat_share(const CutHeat *heat, int vertex);
double cut_heat_stored(const CutHeat *heat); // [J]; looks at every cell
static inline double heat_sum(const HeatSum *sum)
{
    return sum->sum + sum->lost;
}

// Derives what follows from the state. False: an impossible state (from a checkpoint).
bool cut_heat_derive(CutHeat *heat);

#endif
