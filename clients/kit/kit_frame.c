// SPDX-License-Identifier: MIT
// Frames of bodies as they are handed out: positions and their mesh, which frames of one topology
// share. Never changed, so that any thread may read them; freed with their last use.
#include "kit.h"

#include <stdlib.h>
#include <string.h>

void *kit_copy(const void *from, size_t bytes)
{
    void *memory = malloc(bytes > 0 ? bytes : 1);
    if (!memory)
        abort(); // the sizes are bounded: the machine itself is out of memory
    if (bytes > 0)
        memcpy(memory, from, bytes);
    return memory;
}

KitMesh *kit_mesh_create(const KitMesh *mesh)
{
    KitMesh *made = kit_copy(mesh, sizeof *mesh);
    atomic_init(&made->uses, 1);
    return made;
}

void kit_mesh_release(KitMesh *mesh)
{
    if (!mesh || atomic_fetch_sub(&mesh->uses, 1) > 1)
        return;
#define FREE_COLUMN(name, ...) free(mesh->name);
    MESH_COLUMNS(FREE_COLUMN)
    free(mesh->color);
    free(mesh->inside);
    free(mesh);
}

typedef struct Frame {
    PliantBody body; // first: the public part
    atomic_int uses;
    KitMesh *mesh;
    char name[CLIENT_CHANNEL_MAX];
} Frame;

const PliantBody *kit_frame_create(const PliantBody *body, KitMesh *mesh)
{
    Frame *frame = kit_copy(&(const Frame){.body = *body, .mesh = mesh}, sizeof *frame);
    atomic_init(&frame->uses, 1);
    atomic_fetch_add(&mesh->uses, 1);
    snprintf(frame->name, sizeof frame->name, "%s", body->name);
    frame->body.name = frame->name;
    frame->body.topology = mesh->topology;
    frame->body.node_count = mesh->node_count;
    frame->body.triangle_count = mesh->triangle_count;
    if (frame->body.first_wall > mesh->triangle_count)
        frame->body.first_wall = 0; // of another mesh
#define POINT_AT_COLUMN(name, ...) frame->body.name = mesh->name;
    MESH_COLUMNS(POINT_AT_COLUMN) // each has a member of PliantBody
    frame->body.color = mesh->color;
    frame->body.inside = mesh->inside;
    return &frame->body;
}

const PliantBody *pliant_body_keep(const PliantBody *body)
{
    Frame *frame = (Frame *)(uintptr_t)body;
    atomic_fetch_add(&frame->uses, 1);
    return body;
}

void pliant_body_release(const PliantBody *body)
{
    Frame *frame = (Frame *)(uintptr_t)body;
    if (!frame || atomic_fetch_sub(&frame->uses, 1) > 1)
        return;
    kit_mesh_release(frame->mesh);
    free((void *)(uintptr_t)frame->body.position);
    free(frame);
}
