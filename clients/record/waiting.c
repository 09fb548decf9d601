#include "waiting.h"

#include <stdlib.h>
#include <string.h>

WaitingFrame *waiting_pop(Waiting *waiting)
{
    WaitingFrame *frame = waiting->first;
    if (!frame)
        return NULL;
    waiting->first = frame->next;
    if (!waiting->first)
        waiting->last = NULL;
    waiting->count--;
    waiting->bytes -= frame->bytes;
    return frame;
}

int waiting_push(Waiting *waiting, const RecordingFrame *from)
{
    size_t values = 3 * (size_t)from->node_count;
    size_t bytes = sizeof(WaitingFrame) + values * sizeof *from->position;
    int gone = 0;
    while (waiting->first &&
           (waiting->count == WAITING_FRAMES || waiting->bytes + bytes > WAITING_BYTES)) {
        free(waiting_pop(waiting));
        gone++;
    }
    WaitingFrame *frame = malloc(bytes);
    if (!frame)
        abort(); // waiting frames are bounded: the machine itself is out of memory
    *frame = (WaitingFrame){.frame = *from, .bytes = bytes};
    memcpy(frame->position, from->position, values * sizeof *from->position);
    frame->frame.position = frame->position;
    if (waiting->last)
        waiting->last->next = frame;
    else
        waiting->first = frame;
    waiting->last = frame;
    waiting->count++;
    waiting->bytes += bytes;
    return gone;
}

int waiting_drop(Waiting *waiting)
{
    int gone = waiting->count;
    for (WaitingFrame *frame; (frame = waiting_pop(waiting));)
        free(frame);
    return gone;
}
