// SPDX-License-Identifier: MIT
// What pliantd makes of a proposal. Private to the files proposal*.c.
#ifndef PLIANT_SCENE_PROPOSAL_PARTS_H
#define PLIANT_SCENE_PROPOSAL_PARTS_H

#include "geometry/mesh_repair.h"
#include "scene/proposal.h"

typedef struct Built {
    int substeps, springs, nodes, pieces;
    double tick_s, contact_share;
    WorldCells cells;
    Box box, piece[PROPOSAL_PIECES];
    int largest, largest_nodes; // the piece with most of the nodes, as the mesh numbers it
} Built;

// Writes the scene to a private temporary file, reads and builds it. `surface`, if not NULL, gets
// the published mesh of its largest piece at rest, added to what it has.
bool proposal_build(const Proposal *proposal, Built *built, MeshDraft *surface, Status *status);

#endif
