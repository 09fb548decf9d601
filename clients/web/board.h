// SPDX-License-Identifier: MIT
// Messages to pages, and the board on which the newest of each kind lie.
#ifndef PLIANT_WEB_BOARD_H
#define PLIANT_WEB_BOARD_H

#include "frames.h"

#include "pliant_contact_t.h"
#include "pliant_tool_pose_t.h"

#include <pthread.h>
#include <stdatomic.h>

// --- parcels -------------------------------------------------------------------------------------

// Messages to pages, built once, shared by all and counted by references. Any thread; a parcel
// never changes.

typedef struct Parcel {
    atomic_int holders;
    bool text; // else binary
    size_t size;
    unsigned char data[];
} Parcel;

// Copies `text`; the caller owns one reference.
Parcel *parcel_text(const char *text);
// Make the binary messages of protocol.md for body number `body`; the caller owns one reference.
// The frames are complete. Triangles from `first_wall` on are walls of cuts; 0: none, or unknown.
Parcel *parcel_mesh(int body, const MeshFrame *mesh, int first_wall);
Parcel *parcel_nodes(int body, const NodesFrame *nodes);
Parcel *parcel_rest(int body, const RestFrame *rest);
Parcel *parcel_look(int body, const LookFrame *look);
Parcel *parcel_error_map(int body, const ErrorMapFrame *map);
Parcel *parcel_elements(int body, const ElementsFrame *elements);

Parcel *parcel_hold(Parcel *parcel); // may be NULL; returns it
void parcel_drop(Parcel *parcel);    // may be NULL
bool parcel_equal(const Parcel *a, const Parcel *b);

// --- the board -----------------------------------------------------------------------------------

// The newest data of everything received over LCM, which every page takes when it is ready: the
// only place where the LCM thread and the threads of pages meet. One lock, taken only to copy
// pointers and a few numbers, never during a blocking system call, the allocation of a frame, or
// LCM.

enum {
    BOARD_BODIES = 64, // most in a scene
    BOARD_TOOLS = 32,
    BOARD_PAGES = 16,
    OUTBOX_MAX = 256, // events, replies and errors that wait for a page; the oldest are dropped
};

// The kinds of parcels, in the order in which pages get them: what describes the daemon first,
// since the rest refers to it.
typedef enum BoardKind {
    BOARD_SCENE,
    BOARD_LINK,
    BOARD_STATUS,
    BOARD_LEDGER,
    BOARD_ERRORS,
    BOARD_WORKBENCH,
    BOARD_RECORDING, // of pliant-play: what does not change,
    BOARD_PLAYBACK,  // and where it is now
    BOARD_KINDS
} BoardKind;

// Then of each body: the nodes are those of the mesh.
typedef enum BoardBodyKind {
    BOARD_LOOK,
    BOARD_MESH,
    BOARD_REST,
    BOARD_NODES,
    BOARD_ERROR_MAP,
    BOARD_ELEMENTS,
    BOARD_BODY_KINDS
} BoardBodyKind;

enum { ROUND_PARCELS = BOARD_KINDS + BOARD_BODY_KINDS * BOARD_BODIES + OUTBOX_MAX };

// The newest parcel of one kind.
typedef struct BoardSlot {
    Parcel *parcel;
    uint64_t version; // of the board when it was set
} BoardSlot;

typedef struct BoardContact {
    uint64_t version; // 0: none yet
    pliant_contact_t contact;
} BoardContact;

typedef struct BoardPose {
    uint64_t version; // 0: none yet
    pliant_tool_pose_t pose;
} BoardPose;

// The state of a page. The page's own threads and the LCM thread use it under the lock.
typedef struct BoardPage {
    bool used, stop;
    int32_t sender;             // its number as a sender on LCM
    bool drawn;                 // it has confirmed the last round
    int64_t round;              // number of the last round
    int64_t taken_ns;           // when it got that
    uint64_t seen;              // version of the board that the page has
    Parcel *outbox[OUTBOX_MAX]; // ring
    int first, waiting;
    int64_t dropped; // from the outbox
} BoardPage;

typedef struct Board {
    pthread_mutex_t lock;
    pthread_cond_t news; // wakes the threads that write to pages
    uint64_t version;    // grows with every change
    BoardSlot slot[BOARD_KINDS], body[BOARD_BODIES][BOARD_BODY_KINDS];
    BoardContact contact[BOARD_TOOLS];
    BoardPose pose[BOARD_TOOLS];
    BoardPage page[BOARD_PAGES];
    int pages; // used
} Board;

extern const int64_t BOARD_IDLE_NS;

// Data sent to a page at once, in this order: parcels, then contacts and poses.
typedef struct Round {
    int64_t number;
    Parcel *parcel[ROUND_PARCELS]; // held
    int parcels;
    pliant_contact_t contact[BOARD_TOOLS];
    int contacts;
    pliant_tool_pose_t pose[BOARD_TOOLS];
    int poses;
} Round;

void board_init(Board *board);
// Call when no page is left.
void board_destroy(Board *board);

// --- the LCM thread; the board takes over the caller's reference to a parcel ---

// Removes bodies, contacts, poses and playback, for another daemon.
void board_clear(Board *board);
// NULL: unchanged.
void board_set(Board *board, BoardKind kind, Parcel *parcel);
void board_set_of_body(Board *board, int body, BoardBodyKind kind, Parcel *parcel);
// Sets parcels of a body; a new mesh must come with nodes of it. NULL: unchanged.
void board_set_body(Board *board, int body, Parcel *mesh, Parcel *rest, Parcel *nodes);
void board_set_contact(Board *board, const pliant_contact_t *contact);
void board_set_pose(Board *board, const pliant_tool_pose_t *pose);
// To every page, or to the page of that sender (returns false if there is none).
void board_send_all(Board *board, Parcel *text);
bool board_send(Board *board, int32_t sender, Parcel *text);
int board_pages(Board *board);
// Ends board_next_round of every page.
void board_stop(Board *board);

// --- the threads of pages ---

// Returns NULL if the number of pages is at its limit. `sender` is random.
BoardPage *board_add_page(Board *board);
void board_remove_page(Board *board, BoardPage *page);
void board_drawn(Board *board, BoardPage *page, int64_t round);
// Ends board_next_round of the page.
void board_stop_page(Board *board, BoardPage *page);
bool board_stopped(Board *board, const BoardPage *page);
// Stops the page that has not drawn its last round for longest, if for more than BOARD_IDLE_NS by
// the clock of client_now_ns: it makes place for one that may. False: there is none.
bool board_stop_idle(Board *board, int64_t now_ns);
// Waits until `due_ns` (CLOCK_MONOTONIC) has passed, the page has drawn the last round and there is
// new data, and takes it. Returns false if the page has been stopped.
bool board_next_round(Board *board, BoardPage *page, int64_t due_ns, Round *round);

#endif
