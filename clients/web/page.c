// SPDX-License-Identifier: MIT
// One page's WebSocket.
#include "site.h"
#include "path.h"
#include "requests.h"
#include "websocket.h"

#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

// A silent page gets a ping and answers it, even in a background tab.
static const int64_t ANSWER_NS = 4000000000;   // from the upgrade to its first bytes
static const int64_t ASK_NS = 4000000000;      // of silence, before the ping
static const int64_t SILENCE_NS = 10000000000; // of silence, before the page counts as gone
static const int64_t FRAME_NS = 10000000000;   // from a frame's first byte to its last
static const int64_t FAREWELL_NS = 1000000000; // for the page's close frame when the server ends
// A mouse sends a thousand poses per second at most. Faster ones wait in the network.
static const int64_t PACE_NS = 250000;     // per frame
static const int64_t BURST_NS = 500000000; // of frames at once
static const int LOOK_MS = 100;

typedef struct Page {
    const PageSite *shared;
    PageEnd end;
    BoardPage *slot;
    pthread_t writer;
    Round round; // of the writer
    // of the thread that reads
    int64_t opened_ns, asked_ns, frame_ns, stopped_ns, paced_ns; // 0: not (yet)
    bool answered;
    uint32_t sequence;
    ToolPath held[BOARD_TOOLS]; // of the tools that the page has activated
    int held_count;
    WebSocket socket;
} Page;

// --- to the page ---

static bool send_parcel(Page *page, const Parcel *parcel)
{
    return websocket_send(&page->socket, parcel->text ? WEBSOCKET_TEXT : WEBSOCKET_BINARY,
                          parcel->data, parcel->size);
}

static bool send_once(Page *page, Parcel *parcel)
{
    bool sent = send_parcel(page, parcel);
    parcel_drop(parcel);
    return sent;
}

// Sends a round; drops its parcels also after a failure.
static bool send_round(Page *page)
{
    Round *round = &page->round;
    bool ok = true;
    for (int k = 0; k < round->parcels; k++) {
        ok = ok && send_parcel(page, round->parcel[k]);
        parcel_drop(round->parcel[k]);
    }
    if (ok && round->contacts > 0)
        ok = send_once(page, text_contacts(round->contact, round->contacts));
    if (ok && round->poses > 0)
        ok = send_once(page, text_poses(round->pose, round->poses, page->slot->sender));
    return ok && send_once(page, text_round(round->number));
}

static void *write_rounds(void *user)
{
    Page *page = user;
    const PageSite *shared = page->shared;
    const int64_t period_ns = (int64_t)(1e9 / shared->hello.rate_hz);
    bool ok = send_once(page, text_hello(&shared->hello));
    int64_t due_ns = client_now_ns();
    while (ok && board_next_round(shared->board, page->slot, due_ns, &page->round)) {
        due_ns = client_now_ns() + period_ns;
        ok = send_round(page);
    }
    websocket_send_close(&page->socket, WEBSOCKET_GOING_AWAY);
    return NULL;
}

// --- from the page ---

// `id`: of the request, or 0.
static void refuse(Page *page, int32_t id, const char *why)
{
    board_send(page->shared->board, page->slot->sender, text_error(id, why));
}

static void publish_pose(Page *page, const pliant_tool_pose_t *placed)
{
    char channel[CLIENT_CHANNEL_MAX];
    requests_channel(page->shared->requests, "TOOL_POSE", channel);
    pliant_tool_pose_t pose = *placed;
    pose.utime = client_utime();
    pose.sender = page->slot->sender;
    pose.sequence = (int32_t)page->sequence++;
    pliant_tool_pose_t_publish(page->shared->client->lcm, channel, &pose);
}

static void move_tool(Page *page, const Ask *ask)
{
    pliant_tool_pose_t pose = {
        .tool = ask->pose.tool, .grip = ask->pose.grip, .active = ask->pose.active};
    memcpy(pose.position, ask->pose.position, sizeof pose.position);
    memcpy(pose.orientation, ask->pose.orientation, sizeof pose.orientation);
    const int64_t now = client_now_ns();
    int k = 0;
    while (k < page->held_count && page->held[k].last.tool != pose.tool)
        k++;
    if (k < page->held_count) {
        if (!path_take(&page->held[k], &pose, ask->pose.time, now))
            return; // later
    } else if (pose.active && k == BOARD_TOOLS) {
        refuse(page, 0, "tool: this page drives too many tools");
        return;
    } else if (pose.active) {
        path_begin(&page->held[page->held_count++], &pose, ask->pose.time, now);
    }
    publish_pose(page, &pose);
}

// Moves the page's tools along their paths.
static void move_on(Page *page)
{
    const int64_t now = client_now_ns();
    for (int k = page->held_count - 1; k >= 0; k--) {
        ToolPath *path = &page->held[k];
        pliant_tool_pose_t pose;
        if (path_turn(path, now, &pose))
            publish_pose(page, &pose);
        if (!path->last.active && path->count == 0)
            *path = page->held[--page->held_count];
    }
}

static void ask_workbench(Page *page, const Ask *ask)
{
    Workbench *workbench = page->shared->workbench;
    if (!workbench)
        refuse(page, ask->id, "this server starts no programs (--scenes)");
    else if (!workbench_ask(workbench, page->slot->sender, ask))
        refuse(page, ask->id, "too many requests wait for the workbench: try again");
}

static void take_text(Page *page, const char *data, size_t size)
{
    // Only what can be read and is allowed here.
    Ask ask;
    PliantError why;
    if (!ask_parse(data, size, &ask, &why)) {
        refuse(page, 0, why.text);
        return;
    }
    if (page->shared->hello.read_only && ask.kind != ASK_DRAWN) {
        refuse(page, ask.id, "this server only shows (--read-only)");
        return;
    }
    // Tools are moved at once; requests wait for their answer.
    switch (ask.kind) {
    case ASK_DRAWN:
        board_drawn(page->shared->board, page->slot, ask.round);
        break;
    case ASK_TOOL:
        move_tool(page, &ask);
        break;
    case ASK_CUT:
    case ASK_LOAD:
    case ASK_TIE:
    case ASK_COMMAND:
        if (!requests_send(page->shared->requests, page->slot->sender, &ask))
            refuse(page, ask.id, "too many requests wait for an answer: try again");
        break;
    case ASK_START:
    case ASK_END:
    case ASK_RECORD:
    case ASK_PROPOSE:
        ask_workbench(page, &ask);
        break;
    }
}

// Returns false if the page closes.
static bool take_frame(Page *page, const WebSocketFrame *frame)
{
    switch (frame->opcode) {
    case WEBSOCKET_TEXT:
        take_text(page, frame->data, frame->size);
        return true;
    case WEBSOCKET_PING:
        websocket_send_idle(&page->socket, WEBSOCKET_PONG, frame->data, frame->size);
        return true;
    case WEBSOCKET_PONG:
        return true;
    default:
        return false;
    }
}

// Waits if frames come faster than any page sends them.
static void keep_pace(Page *page)
{
    int64_t now = client_now_ns();
    if (page->paced_ns < now - BURST_NS)
        page->paced_ns = now - BURST_NS;
    page->paced_ns += PACE_NS;
    int64_t early = page->paced_ns - now;
    if (early > 0)
        nanosleep(&(struct timespec){.tv_nsec = early}, NULL);
}

// Takes all frames received: returns 0, or the reason to close the connection.
static int take_frames(Page *page)
{
    WebSocketFrame frame;
    int taken;
    while ((taken = websocket_take(&page->socket, &frame)) == 1) {
        page->frame_ns = 0;
        keep_pace(page);
        if (!take_frame(page, &frame))
            return WEBSOCKET_GOING_AWAY;
        move_on(page);
    }
    return -taken;
}

// Pings a silent page; returns false if it stays silent, sends a frame too slowly, or must end.
static bool page_lives(Page *page)
{
    // A page that was stopped gets a moment to say goodbye.
    int64_t now = client_now_ns();
    const WebSocket *socket = &page->socket;
    if (board_stopped(page->shared->board, page->slot)) {
        page->stopped_ns = page->stopped_ns ? page->stopped_ns : now;
        return now - page->stopped_ns < FAREWELL_NS;
    }
    // A frame that does not end, or no answer to the first ping.
    if (socket->end == socket->begin)
        page->frame_ns = 0;
    else if (page->frame_ns == 0)
        page->frame_ns = now;
    if ((page->frame_ns && now - page->frame_ns > FRAME_NS) ||
        (!page->answered && now - page->opened_ns > ANSWER_NS))
        return false;
    // A silent page is asked, and given up if it stays silent.
    int64_t silence = now - atomic_load(&socket->alive_ns);
    if (silence > ASK_NS && now - page->asked_ns > ASK_NS) {
        page->asked_ns = now;
        websocket_send_idle(&page->socket, WEBSOCKET_PING, NULL, 0);
    }
    return silence < SILENCE_NS;
}

// Reads until the page closes or the server ends. Returns the reason for the close frame.
static int read_frames(Page *page)
{
    while (page_lives(page)) {
        int reason = take_frames(page);
        if (reason)
            return reason;
        int come = websocket_read(&page->socket, page->held_count > 0 ? PATH_STEP_MS : LOOK_MS);
        move_on(page);
        if (come < 0)
            break;
        page->answered = page->answered || come > 0;
    }
    return WEBSOCKET_GOING_AWAY;
}

// --- begin and end ---

static void leave(Page *page, int reason)
{
    // First what others wait for: release its tools.
    for (int k = 0; k < page->held_count; k++) {
        page->held[k].last.active = false;
        publish_pose(page, &page->held[k].last);
    }
    requests_forget(page->shared->requests, page->slot->sender);
    if (reason != WEBSOCKET_GOING_AWAY) // else the writer sends it, unless it waits for the page
        websocket_send_close(&page->socket, reason);
    board_stop_page(page->shared->board, page->slot);
    shutdown(page->socket.fd, SHUT_RDWR); // ends a blocked writer
}

static void *run_page(void *user)
{
    Page *page = user;
    PageEnd end = page->end;
    leave(page, read_frames(page));
    pthread_join(page->writer, NULL);
    board_remove_page(page->shared->board, page->slot);
    websocket_destroy(&page->socket);
    free(page);
    end.call(end.site, end.connection);
    return NULL;
}

bool page_open(const PageSite *shared, int fd, const void *read, size_t size, PageEnd end)
{
    // A place on the board, then memory of its own.
    Page *page = calloc(1, sizeof *page);
    BoardPage *slot = page ? board_add_page(shared->board) : NULL;
    if (!slot) {
        free(page);
        return false;
    }
    page->shared = shared;
    page->end = end;
    page->slot = slot;
    page->opened_ns = client_now_ns();
    // The first ping shows whether somebody is there.
    websocket_init(&page->socket, fd, read, size);
    websocket_send_idle(&page->socket, WEBSOCKET_PING, NULL, 0);
    // One thread writes, the other reads and cleans up.
    if (pthread_create(&page->writer, NULL, write_rounds, page) == 0) {
        pthread_t reader; // frees the page
        if (pthread_create(&reader, NULL, run_page, page) == 0) {
            pthread_detach(reader);
            return true;
        }
        board_stop_page(shared->board, slot);
        shutdown(fd, SHUT_RDWR);
        pthread_join(page->writer, NULL);
    }
    board_remove_page(shared->board, slot);
    websocket_destroy(&page->socket);
    free(page);
    return false;
}
