// Look-up of vertices by id, for files and scenes that refer to them. Load time only.
#ifndef PLIANT_VOXEL_VERTEX_IDS_H
#define PLIANT_VOXEL_VERTEX_IDS_H

#include <stdbool.h>

typedef struct VertexId {
    int id, vertex;
} VertexId;

// Returns [count] entries in ascending order of id; malloc'ed, the caller frees.
VertexId *vertex_ids_sort(const int *id, int count);
// Returns the vertex of an id; -1: none.
int vertex_ids_find(const VertexId *sorted, int count, int id);

#endif
