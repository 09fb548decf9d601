// The bodies of the scene as they come over LCM: assembles their meshes, nodes and rest positions,
// and puts on the board what belongs together. The LCM thread only.
#ifndef PLIANT_WEB_BODIES_H
#define PLIANT_WEB_BODIES_H

#include "board.h"

#include "pliant_status_t.h"

enum { BODY_NAME_MAX = 64 };

typedef struct Body {
    char name[BODY_NAME_MAX];
    MeshFrame mesh;
    NodesFrame nodes;
    RestFrame rest;
    bool new_mesh, new_nodes, new_rest; // since the board got them
    int32_t shown;                      // topology on the board; -1: none
    int64_t chunk_ns;                   // when a chunk of a mesh last came (CLOCK_MONOTONIC)
    int64_t unmatched_ns; // since when nodes lack a mesh (CLOCK_MONOTONIC); 0: they do not
} Body;

typedef struct Bodies {
    Board *board;
    Body *body; // [BOARD_BODIES]
    int count;
    bool open; // pages know this scene: bodies may go on the board
} Bodies;

void bodies_init(Bodies *bodies, Board *board);
void bodies_destroy(Bodies *bodies);

// Whether these are the bodies of a status, in its order.
bool bodies_are(const Bodies *bodies, const pliant_status_t *status);
// Forgets all, and takes the names of a status; closed until bodies_open.
void bodies_name(Bodies *bodies, const pliant_status_t *status);
void bodies_open(Bodies *bodies);

// Raw messages of the body of that name; others are dropped.
void bodies_take_mesh(Bodies *bodies, const char *name, const void *data, size_t size);
void bodies_take_delta(Bodies *bodies, const char *name, const void *data, size_t size);
void bodies_take_nodes(Bodies *bodies, const char *name, const void *data, size_t size);
void bodies_take_rest(Bodies *bodies, const char *name, const void *data, size_t size);

// For how long nodes of some body have come without their mesh, while none is under way [s]; 0:
// none.
double bodies_unmatched(const Bodies *bodies, int64_t now_ns);

#endif
