// Messages to pages, built once and shared by all: whoever holds one drops it. Any thread; a parcel
// never changes after it was made.
#ifndef PLIANT_WEB_PARCEL_H
#define PLIANT_WEB_PARCEL_H

#include "frames.h"

#include <stdatomic.h>

typedef struct Parcel {
    atomic_int holders;
    bool text; // else binary
    size_t size;
    unsigned char data[];
} Parcel;

// A copy of `text`, held once by the caller.
Parcel *parcel_text(const char *text);
// The binary messages of protocol.md for body number `body`, held once by the caller; the frames
// are whole.
Parcel *parcel_mesh(int body, const MeshFrame *mesh);
Parcel *parcel_nodes(int body, const NodesFrame *nodes);
Parcel *parcel_rest(int body, const RestFrame *rest);

Parcel *parcel_hold(Parcel *parcel); // may be NULL; returns it
void parcel_drop(Parcel *parcel);    // may be NULL
bool parcel_equal(const Parcel *a, const Parcel *b);

#endif
