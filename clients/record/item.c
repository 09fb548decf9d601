#include "item.h"

#include <stdlib.h>
#include <string.h>

// Creates an item with `extra` bytes after it.
static Item *create(ItemKind kind, int index, size_t extra)
{
    Item *item = malloc(sizeof *item + extra);
    if (!item)
        abort();
    *item = (Item){.kind = kind, .index = index, .bytes = sizeof *item + extra};
    return item;
}

static void *behind(Item *item)
{
    return item + 1;
}

// Copies `size` bytes to *at and advances it; returns the copy.
static void *put(char **at, const void *from, size_t size)
{
    char *to = *at;
    if (size)
        memcpy(to, from, size);
    *at += size;
    return to;
}

Item *item_begin(const char *path, const RecordingOptions *options)
{
    size_t bodies = (size_t)options->body_count, tools = (size_t)options->tool_count;
    size_t extra = bodies * sizeof(RecordingBody) + tools * sizeof(int) + strlen(path) +
                   strlen(options->scene) + strlen(options->created_by) + 3;
    for (size_t i = 0; i < bodies; i++)
        extra += strlen(options->body[i].name) + 1;
    Item *item = create(ITEM_BEGIN, 0, extra);
    RecordingOptions *to = &item->as.begin.options;
    char *at = behind(item);
    *to = *options;
    RecordingBody *body = put(&at, options->body, bodies * sizeof *body); // strictest alignment
    to->tool = put(&at, options->tool, tools * sizeof *options->tool);
    for (size_t i = 0; i < bodies; i++)
        body[i].name = put(&at, body[i].name, strlen(body[i].name) + 1);
    to->body = body;
    to->scene = put(&at, options->scene, strlen(options->scene) + 1);
    to->created_by = put(&at, options->created_by, strlen(options->created_by) + 1);
    item->as.begin.path = put(&at, path, strlen(path) + 1);
    return item;
}

Item *item_topology(int body, const RecordingTopology *topology)
{
    size_t ids = (size_t)topology->node_count * sizeof *topology->node_id;
    size_t triangles = (size_t)topology->triangle_count * sizeof *topology->triangle;
    Item *item = create(ITEM_TOPOLOGY, body, ids + triangles);
    char *at = behind(item);
    item->as.topology = *topology;
    item->as.topology.node_id = put(&at, topology->node_id, ids);
    item->as.topology.triangle = put(&at, topology->triangle, triangles);
    return item;
}

Item *item_frame(int body, const RecordingFrame *frame, const RecordingMesh *mesh)
{
    size_t live = (size_t)mesh->live_count;
    Item *item = create(ITEM_FRAME, body, 3 * live * sizeof *frame->position);
    float *position = behind(item);
    recording_mesh_positions(mesh, frame->position, position);
    item->as.frame = *frame;
    item->as.frame.node_count = mesh->live_count;
    item->as.frame.position = position;
    return item;
}

Item *item_tool(int tool, double time, const RecordingTool *sample)
{
    Item *item = create(ITEM_TOOL, tool, 0);
    item->as.tool.time = time;
    item->as.tool.sample = *sample;
    return item;
}

Item *item_event(const RecordingEvent *event)
{
    Item *item = create(ITEM_EVENT, 0, 0);
    item->as.event = *event;
    return item;
}

Item *item_end(const RecordingCounts *counts, int body_count)
{
    size_t bytes = (size_t)body_count * sizeof *counts;
    Item *item = create(ITEM_END, 0, bytes);
    char *at = behind(item);
    item->as.counts = put(&at, counts, bytes);
    return item;
}

void item_destroy(Item *item)
{
    free(item);
}
