// Messages to pages, built once, shared by all and counted by references. Any thread; a parcel
// never changes.
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

// Copies `text`; the caller owns one reference.
Parcel *parcel_text(const char *text);
// Make the binary messages of protocol.md for body number `body`; the caller owns one reference.
// The frames are complete.
Parcel *parcel_mesh(int body, const MeshFrame *mesh);
Parcel *parcel_nodes(int body, const NodesFrame *nodes);
Parcel *parcel_rest(int body, const RestFrame *rest);

Parcel *parcel_hold(Parcel *parcel); // may be NULL; returns it
void parcel_drop(Parcel *parcel);    // may be NULL
bool parcel_equal(const Parcel *a, const Parcel *b);

#endif
