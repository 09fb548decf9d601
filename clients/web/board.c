// SPDX-License-Identifier: MIT
// Messages to pages, and the board on which the newest of each kind lie.
#include "board.h"

#include "client.h"

#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>

// --- parcels -------------------------------------------------------------------------------------

// Binary messages are written in memory order.
_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the page expects little-endian numbers");

enum {
    KIND_MESH = 1,
    KIND_NODES = 2,
    KIND_REST = 3,
    KIND_LOOK = 4,
    KIND_ERROR_MAP = 5,
    KIND_ELEMENTS = 6,
    HEADER_WORDS = 6
};

static Parcel *make(bool text, size_t size)
{
    Parcel *parcel = malloc(sizeof *parcel + size);
    if (!parcel)
        abort(); // messages are bounded: the machine itself is out of memory
    atomic_init(&parcel->holders, 1);
    parcel->text = text;
    parcel->size = size;
    return parcel;
}

// Copies `count` elements to *at and advances it.
static void put(unsigned char **at, const void *from, size_t count, size_t size)
{
    if (count)
        memcpy(*at, from, count * size);
    *at += count * size;
}

static void put_header(unsigned char **at, uint32_t kind, int body, int32_t topology, int nodes,
                       uint32_t fifth, uint32_t sixth)
{
    const uint32_t header[HEADER_WORDS] = {
        kind, (uint32_t)body, (uint32_t)topology, (uint32_t)nodes, fifth, sixth};
    put(at, header, kind == KIND_NODES ? 4 : HEADER_WORDS, sizeof *header);
}

Parcel *parcel_text(const char *text)
{
    size_t size = strlen(text);
    Parcel *parcel = make(true, size);
    memcpy(parcel->data, text, size);
    return parcel;
}

Parcel *parcel_mesh(int body, const MeshFrame *mesh, int first_wall)
{
    size_t n = (size_t)mesh->node_count, t = (size_t)mesh->triangle_count;
    size_t bytes = 0;
#define ADD_BYTES(name, type, width, of, ...) bytes += (width)*MESH_SLOTS_##of(n, t) * sizeof(type);
    MESH_COLUMNS(ADD_BYTES)
    Parcel *parcel = make(false, 4 * HEADER_WORDS + bytes);
    // A header, then arrays as they are: the page reads them without copying.
    unsigned char *at = parcel->data;
    put_header(&at, KIND_MESH, body, mesh->topology, mesh->node_count,
               (uint32_t)mesh->triangle_count, (uint32_t)first_wall);
#define PUT_COLUMN(name, type, width, of, ...)                                                     \
    put(&at, mesh->name, (width)*MESH_SLOTS_##of(n, t), sizeof(type));
    MESH_COLUMNS(PUT_COLUMN)
    return parcel;
}

Parcel *parcel_nodes(int body, const NodesFrame *nodes)
{
    const double times[3] = {nodes->time, (double)nodes->step, (double)nodes->head.utime};
    size_t n = (size_t)nodes->head.count;
    Parcel *parcel = make(false, 16 + sizeof times + 12 * n);
    unsigned char *at = parcel->data;
    put_header(&at, KIND_NODES, body, nodes->head.topology, nodes->head.count, 0, 0);
    put(&at, times, 3, sizeof *times);
    put(&at, nodes->position, 3 * n, sizeof *nodes->position);
    return parcel;
}

Parcel *parcel_rest(int body, const RestFrame *rest)
{
    size_t n = (size_t)rest->head.count;
    Parcel *parcel = make(false, 4 * HEADER_WORDS + (rest->textured ? 20 : 12) * n);
    unsigned char *at = parcel->data;
    put_header(&at, KIND_REST, body, rest->head.topology, rest->head.count, rest->textured, 0);
    put(&at, rest->position, 3 * n, sizeof *rest->position);
    put(&at, rest->texture, rest->textured ? 2 * n : 0, sizeof *rest->texture);
    return parcel;
}

Parcel *parcel_look(int body, const LookFrame *look)
{
    const size_t values = look->varies ? 3 * (size_t)look->head.count : 0;
    const size_t name = strlen(look->texture);
    Parcel *parcel = make(false, 4 * HEADER_WORDS + 6 + 2 * values + name);
    unsigned char *at = parcel->data;
    put_header(&at, KIND_LOOK, body, look->head.topology, look->head.count, look->varies,
               (uint32_t)name);
    put(&at, look->color, sizeof look->color, 1);
    put(&at, look->wall, sizeof look->wall, 1);
    put(&at, look->outside, values, 1);
    put(&at, look->inside, values, 1);
    put(&at, look->texture, name, 1);
    return parcel;
}

Parcel *parcel_error_map(int body, const ErrorMapFrame *map)
{
    const size_t n = (size_t)map->head.count;
    Parcel *parcel = make(false, 4 * HEADER_WORDS + n);
    unsigned char *at = parcel->data;
    put_header(&at, KIND_ERROR_MAP, body, map->head.topology, map->head.count, 0, 0);
    put(&at, map->share, n, 1);
    return parcel;
}

Parcel *parcel_elements(int body, const ElementsFrame *elements)
{
    const size_t n = (size_t)elements->head.count, levels = (size_t)elements->level_count;
    Parcel *parcel = make(false, 4 * HEADER_WORDS + 4 * levels + 3 * n);
    unsigned char *at = parcel->data;
    put_header(&at, KIND_ELEMENTS, body, elements->head.topology, elements->head.count,
               elements->level_count, 0);
    put(&at, elements->at_level, levels, 4);
    put(&at, elements->tag, n, 2);
    put(&at, elements->level, n, 1);
    return parcel;
}

Parcel *parcel_hold(Parcel *parcel)
{
    if (parcel)
        atomic_fetch_add_explicit(&parcel->holders, 1, memory_order_relaxed);
    return parcel;
}

void parcel_drop(Parcel *parcel)
{
    if (parcel && atomic_fetch_sub_explicit(&parcel->holders, 1, memory_order_acq_rel) == 1)
        free(parcel);
}

bool parcel_equal(const Parcel *a, const Parcel *b)
{
    return a && b && a->size == b->size && memcmp(a->data, b->data, a->size) == 0;
}

// --- the board -----------------------------------------------------------------------------------

void board_init(Board *board)
{
    *board = (Board){0};
    pthread_mutex_init(&board->lock, NULL);
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&board->news, &attributes);
    pthread_condattr_destroy(&attributes);
}

static void empty_slot(BoardSlot *slot)
{
    parcel_drop(slot->parcel);
    *slot = (BoardSlot){0};
}

static void empty_bodies(Board *board)
{
    for (int i = 0; i < BOARD_BODIES; i++)
        for (int k = 0; k < BOARD_BODY_KINDS; k++)
            empty_slot(&board->body[i][k]);
}

void board_destroy(Board *board)
{
    for (int k = 0; k < BOARD_KINDS; k++)
        empty_slot(&board->slot[k]);
    empty_bodies(board);
    pthread_cond_destroy(&board->news);
    pthread_mutex_destroy(&board->lock);
}

// --- the LCM thread ---

// Call under the lock, like all `static` functions below.
static void fill_slot(Board *board, BoardSlot *slot, Parcel *parcel)
{
    if (!parcel)
        return;
    parcel_drop(slot->parcel);
    *slot = (BoardSlot){parcel, ++board->version};
}

static void set_slot(Board *board, BoardSlot *slot, Parcel *parcel)
{
    pthread_mutex_lock(&board->lock);
    fill_slot(board, slot, parcel);
    pthread_cond_broadcast(&board->news);
    pthread_mutex_unlock(&board->lock);
}

void board_clear(Board *board)
{
    pthread_mutex_lock(&board->lock);
    empty_bodies(board);
    empty_slot(&board->slot[BOARD_LEDGER]);
    empty_slot(&board->slot[BOARD_ERRORS]);
    empty_slot(&board->slot[BOARD_RECORDING]);
    empty_slot(&board->slot[BOARD_PLAYBACK]);
    memset(board->contact, 0, sizeof board->contact);
    memset(board->pose, 0, sizeof board->pose);
    pthread_mutex_unlock(&board->lock);
}

void board_set(Board *board, BoardKind kind, Parcel *parcel)
{
    set_slot(board, &board->slot[kind], parcel);
}

void board_set_of_body(Board *board, int body, BoardBodyKind kind, Parcel *parcel)
{
    set_slot(board, &board->body[body][kind], parcel);
}

void board_set_body(Board *board, int body, Parcel *mesh, Parcel *rest, Parcel *nodes)
{
    BoardSlot *to = board->body[body];
    pthread_mutex_lock(&board->lock);
    fill_slot(board, &to[BOARD_MESH], mesh);
    fill_slot(board, &to[BOARD_REST], rest);
    fill_slot(board, &to[BOARD_NODES], nodes);
    pthread_cond_broadcast(&board->news);
    pthread_mutex_unlock(&board->lock);
}

// Wakes no thread: contacts and poses come up to a thousand times per second, and the threads of
// pages poll often enough.
void board_set_contact(Board *board, const pliant_contact_t *contact)
{
    pthread_mutex_lock(&board->lock);
    for (int i = 0; i < BOARD_TOOLS; i++) {
        BoardContact *slot = &board->contact[i];
        if (slot->version != 0 && slot->contact.tool != contact->tool)
            continue;
        slot->version = ++board->version;
        slot->contact = *contact;
        break;
    }
    pthread_mutex_unlock(&board->lock);
}

void board_set_pose(Board *board, const pliant_tool_pose_t *pose)
{
    pthread_mutex_lock(&board->lock);
    for (int i = 0; i < BOARD_TOOLS; i++) {
        BoardPose *slot = &board->pose[i];
        if (slot->version != 0 && slot->pose.tool != pose->tool)
            continue;
        slot->version = ++board->version;
        slot->pose = *pose;
        break;
    }
    pthread_mutex_unlock(&board->lock);
}

static void push(BoardPage *page, Parcel *text)
{
    if (page->waiting == OUTBOX_MAX) {
        parcel_drop(page->outbox[page->first]);
        page->first = (page->first + 1) % OUTBOX_MAX;
        page->waiting--;
        page->dropped++;
    }
    page->outbox[(page->first + page->waiting++) % OUTBOX_MAX] = parcel_hold(text);
}

void board_send_all(Board *board, Parcel *text)
{
    pthread_mutex_lock(&board->lock);
    for (int i = 0; i < BOARD_PAGES; i++) {
        if (board->page[i].used)
            push(&board->page[i], text);
    }
    pthread_cond_broadcast(&board->news);
    pthread_mutex_unlock(&board->lock);
    parcel_drop(text);
}

bool board_send(Board *board, int32_t sender, Parcel *text)
{
    bool found = false;
    pthread_mutex_lock(&board->lock);
    // The page may be gone by now.
    for (int i = 0; i < BOARD_PAGES; i++) {
        if (!board->page[i].used || board->page[i].sender != sender)
            continue;
        push(&board->page[i], text);
        found = true;
    }
    pthread_cond_broadcast(&board->news);
    pthread_mutex_unlock(&board->lock);
    parcel_drop(text);
    return found;
}

int board_pages(Board *board)
{
    pthread_mutex_lock(&board->lock);
    int pages = board->pages;
    pthread_mutex_unlock(&board->lock);
    return pages;
}

void board_stop(Board *board)
{
    pthread_mutex_lock(&board->lock);
    for (int i = 0; i < BOARD_PAGES; i++)
        board->page[i].stop = true;
    pthread_cond_broadcast(&board->news);
    pthread_mutex_unlock(&board->lock);
}

// --- the threads of pages ---

// Draws a number that no page has; 31 bits, never 0, like those of other clients.
static int32_t draw_sender(const Board *board)
{
    for (;;) {
        uint32_t random;
        if (getrandom(&random, sizeof random, 0) != sizeof random)
            random = (uint32_t)client_now_ns() * 2654435761u;
        int32_t sender = (int32_t)(random >> 1 | 1u);
        bool taken = false;
        for (int i = 0; i < BOARD_PAGES; i++)
            taken = taken || (board->page[i].used && board->page[i].sender == sender);
        if (!taken)
            return sender;
    }
}

BoardPage *board_add_page(Board *board)
{
    BoardPage *page = NULL;
    pthread_mutex_lock(&board->lock);
    // A free place, and a sender's number that no other page has.
    for (int i = 0; i < BOARD_PAGES && !page; i++) {
        if (!board->page[i].used)
            page = &board->page[i];
    }
    if (page) {
        *page = (BoardPage){.used = true, .drawn = true, .sender = draw_sender(board)};
        board->pages++;
    }
    pthread_mutex_unlock(&board->lock);
    return page;
}

void board_remove_page(Board *board, BoardPage *page)
{
    pthread_mutex_lock(&board->lock);
    for (int i = 0; i < page->waiting; i++)
        parcel_drop(page->outbox[(page->first + i) % OUTBOX_MAX]);
    *page = (BoardPage){0};
    board->pages--;
    pthread_mutex_unlock(&board->lock);
}

void board_drawn(Board *board, BoardPage *page, int64_t round)
{
    pthread_mutex_lock(&board->lock);
    page->drawn = page->drawn || round == page->round;
    pthread_cond_broadcast(&board->news);
    pthread_mutex_unlock(&board->lock);
}

void board_stop_page(Board *board, BoardPage *page)
{
    pthread_mutex_lock(&board->lock);
    page->stop = true;
    pthread_cond_broadcast(&board->news);
    pthread_mutex_unlock(&board->lock);
}

const int64_t BOARD_IDLE_NS = 30000000000;

bool board_stop_idle(Board *board, int64_t now_ns)
{
    BoardPage *idle = NULL;
    pthread_mutex_lock(&board->lock);
    for (int i = 0; i < BOARD_PAGES; i++) {
        BoardPage *page = &board->page[i];
        if (page->used && !page->stop && !page->drawn && now_ns - page->taken_ns > BOARD_IDLE_NS &&
            (!idle || page->taken_ns < idle->taken_ns))
            idle = page;
    }
    if (idle)
        idle->stop = true;
    pthread_cond_broadcast(&board->news);
    pthread_mutex_unlock(&board->lock);
    return idle != NULL;
}

bool board_stopped(Board *board, const BoardPage *page)
{
    pthread_mutex_lock(&board->lock);
    bool stopped = page->stop;
    pthread_mutex_unlock(&board->lock);
    return stopped;
}

static void take_slot(const BoardSlot *slot, uint64_t seen, Round *round)
{
    if (slot->parcel && slot->version > seen)
        round->parcel[round->parcels++] = parcel_hold(slot->parcel);
}

static void take(Board *board, BoardPage *page, Round *round)
{
    uint64_t seen = page->seen;
    *round = (Round){.number = ++page->round};
    // What describes the daemon, then each body's newest set,
    for (int k = 0; k < BOARD_KINDS; k++)
        take_slot(&board->slot[k], seen, round);
    for (int i = 0; i < BOARD_BODIES; i++)
        for (int k = 0; k < BOARD_BODY_KINDS; k++)
            take_slot(&board->body[i][k], seen, round);
    // what waits for this page alone,
    for (; page->waiting > 0; page->waiting--) {
        round->parcel[round->parcels++] = page->outbox[page->first];
        page->first = (page->first + 1) % OUTBOX_MAX;
    }
    // and tools that have moved.
    for (int i = 0; i < BOARD_TOOLS; i++) {
        if (board->contact[i].version > seen)
            round->contact[round->contacts++] = board->contact[i].contact;
        if (board->pose[i].version > seen)
            round->pose[round->poses++] = board->pose[i].pose;
    }
    // From now on it has to draw before it gets more.
    page->seen = board->version;
    page->drawn = false;
    page->taken_ns = client_now_ns();
}

bool board_next_round(Board *board, BoardPage *page, int64_t due_ns, Round *round)
{
    const int64_t look_again_ns = 20000000; // contacts and poses wake no thread
    pthread_mutex_lock(&board->lock);
    while (!page->stop) {
        // Ready when the page has drawn, something is new, and it is time.
        int64_t now = client_now_ns();
        bool ready = page->drawn && (page->waiting > 0 || board->version > page->seen);
        if (ready && now >= due_ns) {
            take(board, page, round);
            break;
        }
        // Else sleep until it is time, or somebody has news.
        int64_t until = now < due_ns ? due_ns : now + look_again_ns;
        struct timespec t = {until / 1000000000, until % 1000000000};
        pthread_cond_timedwait(&board->news, &board->lock, &t);
    }
    bool going = !page->stop;
    pthread_mutex_unlock(&board->lock);
    return going;
}
