// SPDX-License-Identifier: MIT
// A mesh as one message.
#ifndef PLIANT_TESTS_MESH_MESSAGE_H
#define PLIANT_TESTS_MESH_MESSAGE_H

#include "pliant_mesh_t.h"

// Nodes are their own origins, each in a piece by itself; arrays stay the caller's.
static inline pliant_mesh_t mesh_message(int32_t sequence, int64_t utime, int32_t topology,
                                         int nodes, const int32_t *id, const int32_t *parent,
                                         const int8_t *level, int triangles,
                                         const int32_t *triangle)
{
    return (pliant_mesh_t){.utime = utime,
                           .sequence = sequence,
                           .topology = topology,
                           .node_count = nodes,
                           .triangle_count = triangles,
                           .chunk_count = 1,
                           .num_indices = 3 * triangles,
                           .triangle = (int32_t *)(uintptr_t)triangle,
                           .num_nodes = nodes,
                           .num_parents = 2 * nodes,
                           .id = (int32_t *)(uintptr_t)id,
                           .origin = (int32_t *)(uintptr_t)id,
                           .parent = (int32_t *)(uintptr_t)parent,
                           .piece = (int32_t *)(uintptr_t)id,
                           .level = (int8_t *)(uintptr_t)level};
}

#endif
