// Look-up of vertices by id, for files and scenes that refer to them. Load time only.
#ifndef PLIANT_DYNAMICS_VERTEX_IDS_H
#define PLIANT_DYNAMICS_VERTEX_IDS_H

#include "base/status.h"

typedef struct VertexId {
    int id, vertex; // id first, for compare_ints
} VertexId;

// Returns [count] entries in ascending order of id; malloc'ed, the caller frees.
VertexId *vertex_ids_sort(const int *id, int count);
// Returns the vertex of an id; -1: none.
int vertex_ids_find(const VertexId *sorted, int count, int id);
// Returns the vertex that a scene fixes by its id; -1 with a status: the body has none of this id.
int vertex_ids_find_fixed(const VertexId *sorted, int count, int id, Status *status);

#endif
