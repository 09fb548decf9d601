// One page's WebSocket.
#include "page.h"
#include "ask.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <civetweb.h>

enum { WS_FIN = 0x80, WS_OPCODE = 0x0f };

struct Page {
    const PageRoom *room;
    struct mg_connection *connection;
    BoardPage *slot;
    pthread_t writer;
    Round round; // of the writer
    // of the thread that reads
    int32_t sequence;
    pliant_tool_pose_t held[BOARD_TOOLS]; // newest poses of the tools that it has made active
    int held_count;
};

// --- to the page ---

static bool send(Page *page, const Parcel *parcel)
{
    int opcode = parcel->text ? MG_WEBSOCKET_OPCODE_TEXT : MG_WEBSOCKET_OPCODE_BINARY;
    return mg_websocket_write(page->connection, opcode, (const char *)parcel->data, parcel->size) >
           0;
}

static bool send_once(Page *page, Parcel *parcel)
{
    bool sent = send(page, parcel);
    parcel_drop(parcel);
    return sent;
}

// All that belongs to a round; parcels are dropped also after a failure.
static bool send_round(Page *page)
{
    Round *round = &page->round;
    bool ok = true;
    for (int k = 0; k < round->parcels; k++) {
        ok = ok && send(page, round->parcel[k]);
        parcel_drop(round->parcel[k]);
    }
    if (ok && round->contacts > 0)
        ok = send_once(page, text_contacts(round->contact, round->contacts));
    if (ok && round->poses > 0)
        ok = send_once(page, text_poses(round->pose, round->poses, page->slot->sender));
    return ok && send_once(page, text_round(round->number));
}

// Asks the page to close: 1001, going away. One that took nothing for so long that a write failed
// is asked again until it takes that or its connection ends; it will connect anew.
static void close_politely(Page *page)
{
    const struct timespec pause = {.tv_nsec = 200000000};
    while (mg_websocket_write(page->connection, MG_WEBSOCKET_OPCODE_CONNECTION_CLOSE, "\x03\xe9",
                              2) <= 0 &&
           !board_stopped(page->room->board, page->slot))
        nanosleep(&pause, NULL);
}

static void *write_rounds(void *user)
{
    Page *page = user;
    const PageRoom *room = page->room;
    const int64_t period_ns = (int64_t)(1e9 / room->hello.rate_hz);
    bool ok = send_once(page, text_hello(&room->hello));
    int64_t due_ns = client_now_ns();
    while (ok && board_next_round(room->board, page->slot, due_ns, &page->round)) {
        due_ns = client_now_ns() + period_ns;
        ok = send_round(page);
    }
    close_politely(page);
    return NULL;
}

// --- from the page ---

static void refuse(Page *page, const char *why)
{
    board_tell(page->room->board, page->slot->sender, text_error(why));
}

// Remembers what must be withdrawn when the page goes. False: it drives too many tools.
static bool hold(Page *page, const pliant_tool_pose_t *pose)
{
    int k = 0;
    while (k < page->held_count && page->held[k].tool != pose->tool)
        k++;
    if (!pose->active) {
        if (k < page->held_count)
            page->held[k] = page->held[--page->held_count];
        return true;
    }
    if (k == BOARD_TOOLS)
        return false;
    page->held[k] = *pose;
    page->held_count += k == page->held_count;
    return true;
}

static void publish_pose(Page *page, pliant_tool_pose_t *pose)
{
    char channel[CLIENT_CHANNEL_MAX];
    requests_channel(page->room->requests, "TOOL_POSE", channel);
    pose->utime = client_utime();
    pose->sender = page->slot->sender;
    pose->sequence = page->sequence++;
    pliant_tool_pose_t_publish(page->room->client->lcm, channel, pose);
}

static void move_tool(Page *page, const Ask *ask)
{
    pliant_tool_pose_t pose = {
        .tool = ask->pose.tool, .grip = ask->pose.grip, .active = ask->pose.active};
    memcpy(pose.position, ask->pose.position, sizeof pose.position);
    memcpy(pose.orientation, ask->pose.orientation, sizeof pose.orientation);
    if (!hold(page, &pose)) {
        refuse(page, "tool: this page drives too many tools");
        return;
    }
    publish_pose(page, &pose);
}

static void take_text(Page *page, const char *data, size_t size)
{
    Ask ask;
    ClientError why;
    if (!ask_parse(data, size, &ask, &why)) {
        refuse(page, why.text);
        return;
    }
    if (page->room->hello.read_only && ask.kind != ASK_DRAWN) {
        refuse(page, "this server only shows (--read-only)");
        return;
    }
    switch (ask.kind) {
    case ASK_DRAWN:
        board_drawn(page->room->board, page->slot, ask.round);
        break;
    case ASK_TOOL:
        move_tool(page, &ask);
        break;
    case ASK_CUT:
    case ASK_LOAD:
    case ASK_COMMAND:
        if (!requests_send(page->room->requests, page->slot->sender, &ask))
            refuse(page, "too many requests wait for an answer");
        break;
    }
}

bool page_take(Page *page, int bits, const char *data, size_t size)
{
    switch (bits & WS_OPCODE) {
    case MG_WEBSOCKET_OPCODE_TEXT:
        if (!(bits & WS_FIN) || size > ASK_BYTES_MAX)
            return false; // browsers send what is short in one frame
        take_text(page, data, size);
        return true;
    case MG_WEBSOCKET_OPCODE_PING: // answered by civetweb
    case MG_WEBSOCKET_OPCODE_PONG:
        return true;
    default: // close, binary, fragments
        return false;
    }
}

// --- begin and end ---

Page *page_open(const PageRoom *room, struct mg_connection *connection)
{
    Page *page = calloc(1, sizeof *page);
    BoardPage *slot = page ? board_add_page(room->board) : NULL;
    if (!slot) {
        free(page);
        return NULL;
    }
    page->room = room;
    page->connection = connection;
    page->slot = slot;
    if (pthread_create(&page->writer, NULL, write_rounds, page) != 0) {
        board_remove_page(room->board, slot);
        free(page);
        return NULL;
    }
    return page;
}

void page_close(Page *page)
{
    // First what others wait for: nobody drives these tools any more.
    for (int k = 0; k < page->held_count; k++) {
        page->held[k].active = false;
        publish_pose(page, &page->held[k]);
    }
    requests_forget(page->room->requests, page->slot->sender);
    board_stop_page(page->room->board, page->slot);
    pthread_join(page->writer, NULL);
    board_remove_page(page->room->board, page->slot);
    free(page);
}
