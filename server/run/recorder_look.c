// SPDX-License-Identifier: MIT
// The colours of recorded bodies: as the bus sends them, for each mesh of the file.
#include "run/files_thread.h"

#include <string.h>

struct RecorderLook {
    RestCopy *rest; // of the body itself; NULL: one colour
    unsigned char (*outside)[3], (*inside)[3];
    RecordingColours colours;
};

#define RESERVE(count, type)                                                                       \
    arena_allocate(arena, ARENA_OUTPUT, count, sizeof(type), "run/recorded look of %s", body->name)

struct RecorderLook *recorder_look_reserve(const Body *body, Arena *arena)
{
    if (body->look == NULL)
        return NULL;
    struct RecorderLook *look = RESERVE(1, *look);
    const size_t nodes = rest_is_wanted(body, false) ? (size_t)mesh_most_nodes(body) : 0;
    // One row more: that of the body.
    look->colours.id = RESERVE(nodes + 1, int);
    look->colours.colour = RESERVE(nodes + 1, *look->colours.colour);
    if (nodes == 0)
        return look;
    look->rest = (RestCopy *)arena_allocate(arena, ARENA_OUTPUT, 1, rest_copy_bytes(body),
                                            "run/recorded rest of %s", body->name);
    look->outside = RESERVE(nodes, *look->outside);
    look->inside = RESERVE(nodes, *look->inside);
    look->colours.known_id = RESERVE(nodes, int);
    look->colours.known = RESERVE(nodes, *look->colours.known);
    return look;
}

RecordingLook recorder_look_take(struct RecorderLook *to, const Body *body, const BodyMesh *mesh,
                                 const RestCopy *rest)
{
    const BodyLook *look = body->look;
    unsigned char own[RECORDING_COLOURS];
    memcpy(own, look->usual.outside, 3);
    memcpy(own + 3, look->usual.inside, 3);
    const int nodes = to->rest != NULL ? mesh->node_count : 0;
    if (nodes > 0 && rest == NULL)
        rest_copy_follow(to->rest, body);
    rest = rest != NULL ? rest : to->rest;
    for (int i = 0; i < nodes; i++) {
        const LookColours colours = mesh->id[i] < 0 ? look->usual : rest_colours(rest, look, i);
        memcpy(to->outside[i], colours.outside, sizeof *to->outside);
        memcpy(to->inside[i], colours.inside, sizeof *to->inside);
    }
    return recording_colours_take(&to->colours, mesh->topology, own, nodes, mesh->id,
                                  (const unsigned char(*)[3])to->outside,
                                  (const unsigned char(*)[3])to->inside);
}
