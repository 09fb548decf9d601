// A part of a recording that the receiving thread hands to the writing one, in one block of memory
// owned by the thread that has it.
#ifndef PLIANT_CLIENTS_RECORD_ITEM_H
#define PLIANT_CLIENTS_RECORD_ITEM_H

#include "io/recording.h"

#include <stddef.h>

enum { ITEM_BODIES = 64, ITEM_TOOLS = 32 }; // most in a file: as many as in a scene

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
    size_t bytes; // of the whole item
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

// Each copies its arguments; aborts without memory, since the waiting items are bounded.
Item *item_begin(const char *path, const RecordingOptions *options);
Item *item_topology(int body, const RecordingTopology *topology);
// Makes a frame from the positions of all slots; the item has those of live nodes.
Item *item_frame(int body, const RecordingFrame *frame, const RecordingMesh *mesh);
Item *item_tool(int tool, double time, const RecordingTool *sample);
Item *item_event(const RecordingEvent *event);
Item *item_end(const RecordingCounts *counts, int body_count);
void item_destroy(Item *item);

#endif
