// SPDX-License-Identifier: MIT
// Finds the faces of a voxel body that tear, by one of two rules (README.md, "Tearing").
//
// By stress: with P the nominal stress of an element (element.h) and N the normal of a face at
// rest, the traction on the face between elements A and B is T = (P_A + P_B) N / 2, and n = (R_A +
// R_B) N, scaled to length 1, is its current normal. The face breaks when it is in tension, T n >
// 0, beyond the strength of the tissue, |T| > stress, and borders by an edge on the free surface or
// on a broken face of the same plane: the front of a crack; elsewhere when |T| > 1.5 stress.
// Without this rule a crack would be several cells wide, because forces fall only after a face has
// broken. Faces of larger elements break as a whole, tested against the smaller of the two
// elements.
//
// By force: Miyazaki et al. (2004), section 3.2: a vertex on which an external force exceeds a
// threshold is released, so that the elements around it no longer share it: all faces around its
// lattice point break.
//
// Step thread, except cut_tear_create.
#ifndef PLIANT_VOXEL_CUT_CUT_TEAR_H
#define PLIANT_VOXEL_CUT_CUT_TEAR_H

#include "body/vertices.h"
#include "voxel/cut/cut_tension.h"
#include "voxel/cut/cut_windows.h"

// Most faces (of any elements) that tear per tick, those under the greatest stress first; so a body
// that splits into many pieces does so over several ticks, each of bounded time.
enum {
    TEAR_FACES = 64,
    TEAR_LOOKS = 512, // most elements whose faces are examined per tick; if more may tear, those
                      // after the last one of the tick before
};

typedef struct CutTear {
    const CutLattice *lattice;
    const CutWindows *windows;
    const Vertices *vertices;
    VoxelLaw law;
    const CutTension *tension; // which the stress includes, or NULL
    double stress;             // [Pa]; 0: no tearing by stress
    double force;              // [N]; 0: no tearing by force

    // --- part of the state ---
    int64_t *next; // the element at which the search starts; 0 as a rule
    double *felt;  // [vertex_capacity] square of the largest external force in the last tick [N2];
                   // NULL: no tearing by force

    // --- result of the last call ---
    int (*hit)[2]; // [hit_count] {cell, axis}
    int hit_count, hit_capacity;
    int *stressed, stressed_count; // leaves under the strength, or half of it if the body adapts

    // --- scratch ---
    unsigned char *hit_bits; // [cell] bit d: its face towards +d is in `hit`
    uint16_t *high;          // [batch]
    bool *is_looked_at;      // [element]
    struct TearStress *near; // stresses of a few elements
    int64_t look;            // number of searches
} CutTear;

// Load time. At least one of tear_stress and tear_force of the options is positive.
void cut_tear_create(CutTear *tear, const VoxelOptions *options, const CutWindows *windows,
                     const Vertices *vertices, Arena *arena, StateList *state);
// Finds the unbroken faces that tear at the current rows and by the forces recorded since the last
// call. False: none. `pass` as for cut_windows_stressed.
bool cut_tear_find(CutTear *tear, const VoxelPass *pass);
// Records external forces; call it in each evaluation, before the elements' forces are added, for
// bodies that tear by force.
void cut_tear_feel(CutTear *tear);
void cut_tear_forget(CutTear *tear);

#endif
