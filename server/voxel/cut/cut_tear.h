// Which faces of a voxel body tear, by one of two rules.
//
// By stress: with P the nominal stress of an element (element.h) and N the normal of a face at
// rest, the traction on the face between elements A and B is T = (P_A + P_B) N / 2, and n = (R_A +
// R_B) N, of length 1, is where its normal points now. The face breaks when it is pulled, T n > 0,
// beyond the strength of the tissue, |T| > stress, and it borders by an edge on the free surface or
// on a broken face of the same plane: the front of a crack; elsewhere when |T| > 1.5 stress. As
// forces fall only once a face has broken, a crack would else be several cells wide. Faces of
// larger elements break as a whole, tested against the smaller of the two elements.
//
// By force: Miyazaki et al. (2004), section 3.2: a vertex on which a force from outside exceeds a
// threshold is released, so that the elements around it no longer share it: all faces around its
// lattice point break.
//
// Step thread, but for cut_tear_create.
#ifndef PLIANT_VOXEL_CUT_CUT_TEAR_H
#define PLIANT_VOXEL_CUT_CUT_TEAR_H

#include "voxel/cut/cut_windows.h"
#include "voxel/vertices.h"

// Most faces (of any elements) that tear in a tick, those under the greatest stress first; so a
// body that goes to pieces does it over several ticks, each of bounded time.
enum {
    TEAR_FACES = 64,
    TEAR_LOOKS = 512, // most elements whose faces are looked at in a tick; of more under stress,
                      // those that follow the last of the tick before
};

typedef struct CutTear {
    const CutLattice *lattice;
    const CutWindows *windows;
    const Vertices *vertices;
    VoxelLaw law;
    double stress; // [Pa]; 0: does not tear by stress
    double force;  // [N]; 0: does not tear by force

    // --- part of the state ---
    int64_t *next; // the element from which on to look; 0 as a rule
    double *felt;  // [vertex_capacity] square of the largest force from outside in the last tick
                   // [N2]; NULL: does not tear by force

    // --- the last answer ---
    int (*hit)[2]; // [hit_count] {cell, axis}
    int hit_count, hit_capacity;

    // --- scratch ---
    unsigned char *hit_bits; // [cell] bit d: its face towards +d is among them
    uint16_t *high;          // [batch]
    int *stressed;           // [leaves] elements
    bool *is_looked_at;      // [element]
    struct TearStress *near; // a few elements' stresses
    int64_t look;            // how often was looked
} CutTear;

// Load time. At least one of stress and force is positive.
void cut_tear_create(CutTear *tear, const char *name, double stress, double force,
                     const CutWindows *windows, const Vertices *vertices, VoxelLaw law,
                     Arena *arena, StateList *state);
// The faces that tear by the present rows and by what was felt since the last time, none of which
// is broken. False: none. `pass` as for cut_windows_stressed.
bool cut_tear_find(CutTear *tear, const VoxelPass *pass);
// Before the elements' forces are added: what is there came from outside. Once an evaluation, of
// bodies that tear by force.
void cut_tear_feel(CutTear *tear);
void cut_tear_forget(CutTear *tear);

#endif
