// SPDX-License-Identifier: MIT
// What a recording stores of meshes, maps and looks: rows without free slots.
#include "io/recording.h"

#include "io/recording_parts.h"

#include <string.h>

RecordingTopology recording_mesh_take(RecordingMesh *to, const RecordingSlots *slots)
{
    int triangles = 0;
    // Live nodes in the order of their slots, and where each slot went.
    to->topology = slots->topology;
    to->live_count = 0;
    for (int i = 0; i < slots->node_count; i++) {
        if (slots->id[i] < 0)
            continue;
        to->row[i] = to->live_count;
#define TAKE(name, type, width, of, empty, sent, recorded)                                         \
    MESH_IF_RECORDED(recorded, MESH_IF_NODE(of, memcpy(to->name + to->live_count, slots->name + i, \
                                                       sizeof *to->name);))
        MESH_COLUMNS(TAKE)
        to->live[to->live_count++] = i;
    }
    // Triangles with the new numbers; free slots are dropped.
    for (int t = 0; t < slots->triangle_count; t++) {
        const int *corner = slots->triangle[t];
        if (corner[0] == corner[1])
            continue;
        to->live_triangle[triangles] = t;
        for (int k = 0; k < 3; k++)
            to->triangle[triangles][k] = to->row[corner[k]];
        triangles++;
    }
    to->live_triangles = triangles;
    return (RecordingTopology){.number = slots->topology,
                               .node_count = to->live_count,
                               .triangle_count = triangles,
#define GIVE(name, type, width, of, empty, sent, recorded)                                         \
    MESH_IF_LATER(recorded, .node_##name = (void *)to->name, )
                               MESH_COLUMNS(GIVE).node_id = to->id,
                               .triangle = (const int(*)[3])to->triangle};
}

void recording_mesh_positions(const RecordingMesh *mesh, const float *slots, float *to)
{
    for (int i = 0; i < mesh->live_count; i++)
        memcpy(to + 3 * (size_t)i, slots + 3 * (size_t)mesh->live[i], 3 * sizeof *to);
}

const RecordingMapForm recording_map_form[RECORDING_MAPS] = {
    [RECORDING_ERROR_MAP] = {"error_map", 1, {"share"}, {1}, false},
    [RECORDING_ELEMENTS] = {"elements", 2, {"tag", "level"}, {sizeof(int16_t), 1}, true}};

void recording_mesh_map(const RecordingMesh *mesh, RecordingMapKind kind, RecordingMap *map,
                        const void *column[RECORDING_MAP_COLUMNS], unsigned char *to)
{
    const RecordingMapForm *form = &recording_map_form[kind];
    const int per_row = form->of_triangles ? 2 : 1; // both triangles of a square have its row
    const int *live = form->of_triangles ? mesh->live_triangle : mesh->live;
    map->count = live == NULL         ? per_row * map->count
                 : form->of_triangles ? mesh->live_triangles
                                      : mesh->live_count;
    for (int k = 0; k < form->columns; k++) {
        const size_t size = form->bytes[k];
        for (int i = 0; i < map->count; i++) {
            const int row = (live != NULL ? live[i] : i) / per_row;
            memcpy(to + size * (size_t)i, (const char *)column[k] + size * (size_t)row, size);
        }
        column[k] = to;
        to += size * (size_t)map->count;
    }
}

// Adds a row.
static void add_colour(RecordingLook *look, RecordingColours *to, int id,
                       const unsigned char colour[RECORDING_COLOURS])
{
    to->id[look->count] = id;
    memcpy(to->colour[look->count++], colour, RECORDING_COLOURS);
}

RecordingLook recording_colours_take(RecordingColours *to, int topology,
                                     const unsigned char own[RECORDING_COLOURS], int node_count,
                                     const int *id, const unsigned char (*outside)[3],
                                     const unsigned char (*inside)[3])
{
    RecordingLook look = {.topology = topology,
                          .id = to->id,
                          .colour = (const unsigned char(*)[RECORDING_COLOURS])to->colour};
    if (!to->begun)
        add_colour(&look, to, RECORDING_OF_BODY, own);
    to->begun = true;
    for (int i = 0; i < node_count; i++) {
        unsigned char colour[RECORDING_COLOURS];
        memcpy(colour, outside[i], 3);
        memcpy(colour + 3, inside[i], 3);
        const bool known = i < to->slots && to->known_id[i] == id[i] &&
                           memcmp(to->known[i], colour, sizeof colour) == 0;
        if (id[i] >= 0 && !known)
            add_colour(&look, to, id[i], colour);
        to->known_id[i] = id[i];
        memcpy(to->known[i], colour, sizeof colour);
    }
    to->slots = node_count > to->slots ? node_count : to->slots;
    return look;
}
