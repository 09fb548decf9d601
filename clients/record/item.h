// What the receiving thread hands to the writing one: a piece of a recording with its data, in one
// block of memory that belongs to whoever holds it.
#ifndef PLIANT_CLIENTS_RECORD_ITEM_H
#define PLIANT_CLIENTS_RECORD_ITEM_H

#include "files/recording_mesh.h"

#include <stddef.h>

enum { ITEM_BODIES = 64, ITEM_TOOLS = 32 }; // in a file at most: as many as a scene has

typedef enum ItemKind {
    ITEM_BEGIN, // a file
    ITEM_TOPOLOGY,
    ITEM_FRAME,
    ITEM_TOOL,
    ITEM_EVENT,
    ITEM_END, // of the file
} ItemKind;

typedef struct Item {
    ItemKind kind;
    int index;    // of the body or the tool in the file
    size_t bytes; // of all of it
    struct Item *next;
    union {
        struct {
            const char *path;
            RecordingOptions options;
        } begin;
        RecordingTopology topology;
        RecordingFrame frame;
        struct {
            double time; // [s]
            RecordingTool sample;
        } tool;
        RecordingEvent event;
        const RecordingCounts *counts; // [body_count]
    } as;
} Item;

// Each copies what it is given. Abort when there is no memory: what waits is bounded.
Item *item_begin(const char *path, const RecordingOptions *options);
Item *item_topology(int body, const RecordingTopology *topology);
// The positions are those of all slots; the item holds those of live nodes.
Item *item_frame(int body, const RecordingFrame *frame, const RecordingMesh *mesh);
Item *item_tool(int tool, double time, const RecordingTool *sample);
Item *item_event(const RecordingEvent *event);
Item *item_end(const RecordingCounts *counts, int body_count);
void item_destroy(Item *item);

#endif
