#include "io/recording_mesh.h"

#include <string.h>

RecordingTopology recording_mesh_take(RecordingMesh *to, const RecordingSlots *slots)
{
    int triangles = 0;
    to->topology = slots->topology;
    to->live_count = 0;
    for (int i = 0; i < slots->node_count; i++) {
        if (slots->id[i] < 0)
            continue;
        to->row[i] = to->live_count;
        to->id[to->live_count] = slots->id[i];
        to->live[to->live_count++] = i;
    }
    for (int t = 0; t < slots->triangle_count; t++) {
        const int *corner = slots->triangle[t];
        if (corner[0] == corner[1])
            continue;
        for (int k = 0; k < 3; k++)
            to->triangle[triangles][k] = to->row[corner[k]];
        triangles++;
    }
    return (RecordingTopology){.number = slots->topology,
                               .node_count = to->live_count,
                               .triangle_count = triangles,
                               .node_id = to->id,
                               .triangle = (const int(*)[3])to->triangle};
}

void recording_mesh_positions(const RecordingMesh *mesh, const float *slots, float *to)
{
    for (int i = 0; i < mesh->live_count; i++)
        memcpy(to + 3 * (size_t)i, slots + 3 * (size_t)mesh->live[i], 3 * sizeof *to);
}
