// SPDX-License-Identifier: MIT
// How the nodes of a body with levels are packed into the kernel's tables, and what each evaluation
// visits of them. Both follow from the set of refined faces. Private to the surface module.
#ifndef PLIANT_SURFACE_DETAIL_PACK_H
#define PLIANT_SURFACE_DETAIL_PACK_H

#include "base/isa.h"

#include <stdbool.h>
#include <stdint.h>

// Slots that are packed together: larger windows leave fewer lanes empty, smaller ones are packed
// faster.
enum { WINDOW_MOST = 1024, WINDOW_LEAST = 256 };

// Slots of a block: what no node of a block is on for is not visited. A window has one bit for each
// of its blocks.
enum { BLOCK = 32 };

// The springs of a node: slots of the other ends, ascending.
typedef struct NodeSprings {
    int count;
    int *neighbour;
    double *stiffness; // [N/m]
} NodeSprings;

// Results of packing one window; sums and maxima over its free nodes.
typedef struct Window {
    int free_count, hanging_count;
    int free_chunks; // the hanging nodes' chunks follow
    uint32_t used;   // bit b: block b has nodes that are on
    double mass;     // [kg]
    double lambda, damping;
    int spring_ends;
} Window;

// The packing of all nodes, on or off, in windows of slots.
typedef struct DetailPack {
    // --- constant ---
    int *of_slot; // [window_count * width] node of a slot, on or off; -1: padding
    int window_count;
    int width;         // slots of a window
    int window_chunks; // chunks per window: both the last chunk of free nodes and the last of
                       // hanging ones may be partly filled
    int spare_slot;    // + window: the rows of lanes without a node
    double shape_rate, shape_drag, node_drag; // by mass [1/s2], [1/s], [1/s]
    double rigidity;                          // of springs to fast strains (law.h)
    double least_lambda, least_damping;       // of level 0: bounds of a body that is entirely fixed

    // --- derived from the bits ---
    Window *window;     // [window_count]
    double *bound;      // [node_count] Carried.stiffness
    bool *is_dirty;     // [node_count] its springs or mass have changed: pack again
    bool *stale_window; // [window_count] has such a node, or one that was switched on or off
    double mass, lambda, damping;
    int spring_ends, on_count;

    // --- scratch ---
    NodeSprings springs[WINDOW_MOST]; // by slot
} DetailPack;

// Slots and chunks in use.
typedef struct DetailLists {
    int hanging_count;
    int *hanging;     // [node_count] slots of hanging nodes, finest level first
    int (*master)[2]; // [node_count] slots of their masters
    int *carrier;     // [carrier_count] slots of free masters, once per hanging node
    int carrier_count;
    unsigned char *carries; // [window_count * window_chunks] true if a chunk contains a master
    int *free_chunk, *hanging_chunk; // [window_count * window_chunks] in use, ascending
    int free_chunk_count, hanging_chunk_count;
    void *handed; // Real [slot_count][ROW], half of it used: forces of hanging nodes, and their
                  // masters' shares of them [N]; zero for other nodes that are on
} DetailLists;

// --- detail_rows.c ---
// Sets hanging rows to the means of their masters.
void detail_hang(const DetailLists *lists, Precision precision, void *rows);
// Adds half of each hanging node's force to each of its masters, whose rows were cleared.
void detail_clear_masters(const DetailLists *lists, Precision precision);
void detail_hand_over(const DetailLists *lists, Precision precision);

#endif
