#include "dynamics/vertex_ids.h"

#include "base/check.h"
#include "base/compare.h"

#include <stdlib.h>

VertexId *vertex_ids_sort(const int *id, int count)
{
    VertexId *sorted = calloc((size_t)count + 1, sizeof *sorted);
    ASSERT(sorted != NULL);
    for (int i = 0; i < count; i++)
        sorted[i] = (VertexId){id[i], i};
    qsort(sorted, (size_t)count, sizeof *sorted, compare_ints);
    return sorted;
}

int vertex_ids_find(const VertexId *sorted, int count, int id)
{
    const VertexId key = {id, 0};
    const VertexId *found = bsearch(&key, sorted, (size_t)count, sizeof *sorted, compare_ints);
    return found != NULL ? found->vertex : -1;
}

int vertex_ids_find_fixed(const VertexId *sorted, int count, int id, Status *status)
{
    int vertex = vertex_ids_find(sorted, count, id);
    if (vertex < 0)
        status_fail(status, STATUS_INVALID,
                    "fixed: node %d is not a vertex of the body (%d vertices)", id, count);
    return vertex;
}
