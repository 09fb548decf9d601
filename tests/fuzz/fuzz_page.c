// SPDX-License-Identifier: MIT
// What pages and browsers send to pliant-web: JSON texts, the headers of requests, names of meshes,
// the frames of a WebSocket, and what a daemon answers to DESCRIBE. The first byte says which.
#include "fuzz.h"

#include "requests.h"
#include "texts.h"
#include "door.h"
#include "folder.h"
#include "websocket.h"

#include <math.h>
#include <stdlib.h>

static void check_ask(const Ask *ask)
{
    MUST(memchr(ask->text, 0, sizeof ask->text) != NULL);
    if (ask->kind == ASK_TOOL) {
        double length = 0.0;
        for (int c = 0; c < 4; c++)
            length += ask->pose.orientation[c] * ask->pose.orientation[c];
        MUST(isfinite(ask->pose.position[0]) && fabs(sqrt(length) - 1.0) <= 1e-3);
        MUST(ask->pose.grip >= 0.0 && ask->pose.grip <= 1.0);
    } else if (ask->kind == ASK_TIE) {
        MUST(memchr(ask->tie.to_body, 0, sizeof ask->tie.to_body) != NULL);
        MUST(isfinite(ask->tie.radius) && isfinite(ask->tie.stiffness));
        MUST(ask->tie.action >= 1 && ask->tie.action <= 3 && ask->tie.number >= 0);
    } else if (ask->kind == ASK_LOAD) {
        MUST(isfinite(ask->load.radius) && isfinite(ask->load.duration));
    } else if (ask->kind == ASK_START) {
        MUST(ask->text[0] != '\0' && ask->folder <= ASK_RECORDINGS);
    }
}

static void read_ask(const char *text, size_t size)
{
    Ask ask;
    PliantError error = {{0}};
    if (ask_parse(text, size, &ask, &error)) {
        fuzz_print("asked");
        check_ask(&ask);
    } else {
        fuzz_print(error.text);
        MUST(error.text[0] != '\0');
    }
}

// Any name of a mesh becomes one that leads nowhere else.
static void name_mesh(const char *text)
{
    char name[FOLDER_NAME_MAX];
    PliantError error = {{0}};
    if (folder_name_clean(text, FOLDER_MESHES, name, &error))
        MUST(folder_name_valid(name, FOLDER_MESHES) && strchr(name, '/') == NULL);
    else
        MUST(error.text[0] != '\0');
}

static void knock(const char *text)
{
    static const Door door = {
        .host = "lab.example", .token = "0123456789abcdef", .cookie = "pliant8080"};
    // Two headers: host and origin.
    char *copy = strdup(text);
    MUST(copy != NULL);
    char *second = strchr(copy, '\n');
    if (second != NULL)
        *second++ = '\0';
    door_admits_host(&door, copy);
    door_admits_origin(&door, second, copy);
    door_admits(&door, copy);
    free(copy);
}

static void describe(const char *text)
{
    DescribedTool tool[DESCRIBE_TOOLS];
    int count = describe_tools(text, tool);
    MUST(count >= 0 && count <= DESCRIBE_TOOLS);
    for (int i = 0; i < count; i++) {
        MUST(memchr(tool[i].kind, 0, sizeof tool[i].kind) != NULL);
        MUST(tool[i].capsules >= 0 && tool[i].capsules <= DESCRIBE_CAPSULES);
    }
}

// Frames lie within what came, and are taken one after the other.
static void take_frames(const char *data, size_t size)
{
    static WebSocket socket;
    WebSocketFrame frame;
    websocket_init(&socket, -1, data, size);
    size_t end = socket.end;
    int taken;
    while ((taken = websocket_take(&socket, &frame)) == 1) {
        fuzz_print("frame");
        MUST(frame.size <= WEBSOCKET_FRAME_MAX && socket.begin <= end);
        MUST(frame.data + frame.size == (char *)socket.buffer + socket.begin);
    }
    MUST(taken == 0 || (taken <= -WEBSOCKET_GOING_AWAY && taken >= -WEBSOCKET_TOO_BIG));
    websocket_destroy(&socket);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
    char *text = malloc(size);
    MUST(text != NULL);
    memcpy(text, data + 1, size - 1);
    text[size - 1] = '\0';
    switch (data[0] % 4) {
    case 0:
        read_ask(text, size - 1);
        break;
    case 1:
        knock(text);
        name_mesh(text);
        break;
    case 2:
        describe(text);
        break;
    default:
        take_frames(text, size - 1);
    }
    free(text);
    return 0;
}
