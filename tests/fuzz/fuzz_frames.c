// SPDX-License-Identifier: MIT
// What a client receives: messages on all channels of a daemon, checked, decoded and put together.
// An input is a list of messages, each with its type and length in front; a type of 64 and more
// gets the right fingerprint, without which nothing happens.
#include "fuzz.h"

#include "frames.h"
#include "kit.h"
#include "view.h"
#include "program.h"
#include "wire.h"

#include "pliant_reply_t.h"

#include <stdio.h>
#include <stdlib.h>

typedef struct Receiver {
    NodesFrame nodes;
    MeshFrame mesh;
    RestFrame rest;
    LookFrame look;
    ErrorMapFrame error_map;
    ElementsFrame elements;
    PliantClient kit; // without connection
    View view;
    FILE *out; // nowhere
} Receiver;

enum { MESSAGE_MOST = 4096, KINDS = 15 };

static const WireType *const TYPES[KINDS] = {
    &WIRE_NODES,  &WIRE_MESH,  &WIRE_MESH_DELTA, &WIRE_CONTACT,   &WIRE_STATUS,
    &WIRE_EVENT,  &WIRE_REPLY, &WIRE_TOOL_POSE,  &WIRE_COMMAND,   &WIRE_REST,
    &WIRE_POINTS, &WIRE_LOOK,  &WIRE_ERROR,      &WIRE_ERROR_MAP, &WIRE_ELEMENTS};

static void check_nodes(const NodesFrame *frame)
{
    MUST(frame->head.count >= 1 && frame->head.count <= FRAMES_NODES_MAX);
    for (int i = 0; i < 3 * frame->head.count; i++)
        MUST(frame->position[i] - frame->position[i] == 0.0f);
}

static void check_mesh(const MeshFrame *mesh)
{
    for (int i = 0; i < 3 * mesh->triangle_count; i++)
        MUST(mesh->triangle[i] >= 0 && mesh->triangle[i] < mesh->node_count);
}

#define DECODE(type, taken)                                                                        \
    do {                                                                                           \
        pliant_##type message;                                                                     \
        MUST(pliant_##type##_decode(data, 0, (int)size, &message) == (int)size);                   \
        taken;                                                                                     \
        pliant_##type##_decode_cleanup(&message);                                                  \
    } while (0)

static void take(Receiver *receiver, int kind, const uint8_t *data, size_t size)
{
    bool right = wire_check(TYPES[kind], data, size);
    FramesResult result;
    fuzz_print(right ? "right" : "wrong");
    switch (kind) {
    case 0:
    case 10: // both are positions, whichever of the two it is
        right = wire_check(&WIRE_NODES, data, size) || wire_check(&WIRE_POINTS, data, size);
        result = nodes_frame_add(&receiver->nodes, data, size);
        MUST(right || result == FRAMES_REFUSED);
        if (receiver->nodes.head.started)
            check_nodes(&receiver->nodes);
        break;
    case 1:
    case 2:
        result = kind == 1 ? mesh_frame_add(&receiver->mesh, data, size)
                           : mesh_frame_add_delta(&receiver->mesh, data, size);
        MUST(right || result == FRAMES_REFUSED);
        if (receiver->mesh.whole)
            check_mesh(&receiver->mesh);
        break;
    case 3:
        kit_take_contact(&receiver->kit, data, size);
        break;
    case 4:
        kit_take_status(&receiver->kit, data, size);
        MUST(right == (pliant_status(&receiver->kit) != NULL) || receiver->view.statuses > 0);
        if (right)
            view_take_status(&receiver->view, pliant_status(&receiver->kit));
        break;
    case 5:
        kit_take_event(&receiver->kit, data, size);
        if (right)
            view_take_event(&receiver->view, pliant_next_event(&receiver->kit));
        break;
    case 6:
        if (right)
            DECODE(reply_t, program_print_text(receiver->out, message.text, true));
        break;
    case 9:
        result = rest_frame_add(&receiver->rest, data, size);
        MUST(right || result == FRAMES_REFUSED);
        if (result == FRAMES_WHOLE)
            for (int i = 0; i < 3 * receiver->rest.head.count; i++)
                MUST(receiver->rest.position[i] - receiver->rest.position[i] == 0.0f);
        break;
    case 11:
        result = look_frame_add(&receiver->look, data, size);
        MUST(right || result == FRAMES_REFUSED);
        MUST(!receiver->look.head.whole ||
             receiver->look.varies == (receiver->look.outside != NULL));
        break;
    case 12:
        kit_take_errors(&receiver->kit, data, size);
        MUST(!right || pliant_errors(&receiver->kit) != NULL);
        break;
    case 13:
        result = error_map_frame_add(&receiver->error_map, data, size);
        MUST(right || result == FRAMES_REFUSED);
        MUST(!receiver->error_map.head.whole || receiver->error_map.share != NULL);
        break;
    case 14:
        result = elements_frame_add(&receiver->elements, data, size);
        MUST(right || result == FRAMES_REFUSED);
        MUST(!receiver->elements.head.whole || receiver->elements.tag != NULL);
        break;
    default:
        break;
    }
}

static void show(Receiver *receiver)
{
    view_print(&receiver->view, &receiver->kit, receiver->out);
    if (receiver->view.statuses > 0)
        view_print_line(&receiver->view, &receiver->kit, receiver->out);
    if (receiver->view.events > 0)
        view_print_last_event(&receiver->view, receiver->out);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static FILE *nowhere;
    if (nowhere == NULL)
        nowhere = fopen("/dev/null", "w");
    MUST(nowhere != NULL);
    Receiver *receiver = calloc(1, sizeof *receiver);
    MUST(receiver != NULL);
    receiver->out = nowhere;
    Feed feed = {data, size};
    for (int messages = 0; feed.left > 0 && messages < 64; messages++) {
        uint8_t kind = feed_byte(&feed);
        Feed part = feed_part(&feed, MESSAGE_MOST);
        size_t length = part.left + (kind >= 64 ? 8 : 0);
        uint8_t *message = malloc(length > 0 ? length : 1);
        MUST(message != NULL);
        if (kind >= 64) {
            uint64_t fingerprint = (uint64_t)TYPES[kind % KINDS]->fingerprint();
            for (int i = 0; i < 8; i++)
                message[i] = (uint8_t)(fingerprint >> (56 - 8 * i));
        }
        if (part.left > 0)
            memcpy(message + length - part.left, part.at, part.left);
        take(receiver, kind % KINDS, message, length);
        free(message);
    }
    show(receiver);
    nodes_frame_destroy(&receiver->nodes);
    mesh_frame_destroy(&receiver->mesh);
    rest_frame_destroy(&receiver->rest);
    look_frame_destroy(&receiver->look);
    error_map_frame_destroy(&receiver->error_map);
    elements_frame_destroy(&receiver->elements);
    kit_forget(&receiver->kit);
    free(receiver);
    return 0;
}
