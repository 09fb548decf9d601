// SPDX-License-Identifier: MIT
// Makes an even mesh of the outer surface of a closed mesh or a label: that of a solid of cells as
// large as its edges are to be. Load time only.
#include "scene/proposal_parts.h"

#include <math.h>

// About PROPOSAL_NODES are as good. Their number goes with the area over that of a cell, so that
// two or three tries suffice; others are for cells that touch in an edge alone, which smaller ones
// seldom do in the same place.
static const double EVEN_RANGE = 1.4, SMALLER = 0.95, MOST_OF_IT = 0.9;
enum { TRIES = 8 };

// Tries one size of cells, and sets the next one where the surface is none, or has too few or too
// many nodes. Returns false with a status where there is no surface at all.
static bool try_cells(Proposal *solid, TriMesh *mesh, bool *done, Status *status)
{
    Built built;
    MeshDraft draft = {0};
    MeshRepairs repairs;
    MeshFault fault;
    if (!proposal_build(solid, &built, &draft, status))
        return false;
    const double times = (double)draft.node_count / PROPOSAL_NODES;
    const bool even = times < EVEN_RANGE && times > 1.0 / EVEN_RANGE;
    *done = even && mesh_repair(&draft, mesh, &repairs, &fault);
    solid->cell = built.cells.size * (even ? SMALLER : sqrt(times));
    mesh_draft_destroy(&draft);
    // Crumbs are dropped; what is nothing but crumbs has no outside.
    if (*done && built.largest_nodes < MOST_OF_IT * built.nodes) {
        mesh_destroy(mesh);
        return status_fail(status, STATUS_INVALID,
                           "it is thinner than its cells, and would be in %d pieces", built.pieces);
    }
    return true;
}

bool proposal_even(const char *path, double scale, LabelChoice choice, TriMesh *mesh,
                   Status *status)
{
    Proposals all;
    if (!proposal_judge(path, scale, choice, &all, status))
        return false;
    const bool closed = all.subject.volume || all.volume > 0.0;
    Proposal solid = all.verdict[WAY_SOLID].proposal;
    proposals_destroy(&all);
    if (!closed)
        return status_fail(status, STATUS_INVALID,
                           "%s: its surface is not closed; ./dev remesh makes its edges even",
                           path);
    // Less to build, and nothing but its outside.
    solid.whole = solid.filled = true;
    bool done = false;
    Status said = {0};
    for (int i = 0; i < TRIES && !done; i++)
        if (!try_cells(&solid, mesh, &done, &said))
            return status_fail(status, said.code, "%s: %s", path, said.text);
    return done || status_fail(status, STATUS_INVALID,
                               "%s: its cells make no surface of about %d nodes that holds "
                               "together",
                               path, PROPOSAL_NODES);
}
