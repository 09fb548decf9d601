// SPDX-License-Identifier: MIT
// Checks raw messages before they are decoded. Any thread; never allocates.
#include "wire.h"

#include <ctype.h>
#include <string.h>

#include "pliant_claim_t.h"
#include "pliant_command_t.h"
#include "pliant_contact_t.h"
#include "pliant_elements_t.h"
#include "pliant_error_map_t.h"
#include "pliant_error_t.h"
#include "pliant_event_t.h"
#include "pliant_hello_t.h"
#include "pliant_ledger_t.h"
#include "pliant_look_t.h"
#include "pliant_mesh_delta_t.h"
#include "pliant_mesh_t.h"
#include "pliant_nodes_t.h"
#include "pliant_points_t.h"
#include "pliant_playback_t.h"
#include "pliant_reply_t.h"
#include "pliant_rest_t.h"
#include "pliant_status_t.h"
#include "pliant_tool_pose_t.h"
#include "pliant_walls_t.h"

const WireType WIRE_TOOL_POSE = {"l iii 3d 4d 6d b d b", __pliant_tool_pose_t_get_hash,
                                 "tool_pose_t"};
const WireType WIRE_COMMAND = {"l iii l s", __pliant_command_t_get_hash, "command_t"};
const WireType WIRE_REPLY = {"l ii b l iii ss", __pliant_reply_t_get_hash, "reply_t"};
const WireType WIRE_NODES = {"l i l d iiiii n *0f", __pliant_nodes_t_get_hash, "nodes_t"};
const WireType WIRE_POINTS = {"l i l d iii h f 3i n *0b", __pliant_points_t_get_hash, "points_t"};
const WireType WIRE_MESH = {"l iiiiiii n *0i i nn *1i *1i *2i *1i *1b", __pliant_mesh_t_get_hash,
                            "mesh_t"};
const WireType WIRE_MESH_DELTA = {"l iiiiiii nn *0i *1i nn *2i *2i *2i *3i *2i *2b",
                                  __pliant_mesh_delta_t_get_hash, "mesh_delta_t"};
const WireType WIRE_REST = {"l iiiii i n *0f n *1f", __pliant_rest_t_get_hash, "rest_t"};
const WireType WIRE_WALLS = {"l iii", __pliant_walls_t_get_hash, "walls_t"};
const WireType WIRE_LOOK = {"l iiiii s 3b 3b i n *0b *0b", __pliant_look_t_get_hash, "look_t"};
const WireType WIRE_CONTACT = {"l ii l d ll b 3d 3d 3d 3d 3d d 9d d", __pliant_contact_t_get_hash,
                               "contact_t"};
const WireType WIRE_STATUS = {"l i ss l ddd lll 4d 4d n *0s *0d n *1(sss iiiiii dddddd) n *2s *2l",
                              __pliant_status_t_get_hash, "status_t"};
const WireType WIRE_HELLO = {"l ss i ss", __pliant_hello_t_get_hash, "hello_t"};
const WireType WIRE_CLAIM = {"lllll", __pliant_claim_t_get_hash, "claim_t"};
const WireType WIRE_PLAYBACK = {"l ii bbb 7d l i n *0d *0s *0s nn *1i *2f",
                                __pliant_playback_t_get_hash, "playback_t"};
const WireType WIRE_EVENT = {"l i l sss", __pliant_event_t_get_hash, "event_t"};
const WireType WIRE_LEDGER = {"l i l d nnn *0(sbdd) *1(ssdddddd) *2(sbbdddss)",
                              __pliant_ledger_t_get_hash, "ledger_t"};
const WireType WIRE_ERROR = {"l i l d nn *0(sddddl) *1(iddd)", __pliant_error_t_get_hash,
                             "error_t"};
const WireType WIRE_ERROR_MAP = {"l i l iiiii n *0b", __pliant_error_map_t_get_hash, "error_map_t"};
const WireType WIRE_ELEMENTS = {"l i l iiiii nn *0i *1b *1h", __pliant_elements_t_get_hash,
                                "elements_t"};

enum { WALK_COUNTS = 4 };

typedef struct Walk {
    const unsigned char *data;
    size_t size, at;
    uint32_t count[WALK_COUNTS]; // values of the n's read so far
    int counts;
} Walk;

// Reads a big-endian word, as LCM sends it.
static uint64_t word_at(const Walk *walk, size_t bytes)
{
    uint64_t word = 0;
    for (size_t k = 0; k < bytes; k++)
        word = word << 8 | walk->data[walk->at + k];
    return word;
}

static size_t item_bytes(char kind)
{
    switch (kind) {
    case 'b':
        return 1;
    case 'h':
        return 2;
    case 'l':
    case 'd':
        return 8;
    default:
        return 4; // i, f, n, and the length of s
    }
}

// Checks one number or string; returns false if it does not fit or is invalid.
static bool walk_item(Walk *walk, char kind)
{
    // The item must be there.
    size_t bytes = item_bytes(kind);
    if (walk->size - walk->at < bytes)
        return false;
    uint64_t word = word_at(walk, bytes);
    walk->at += bytes;
    // Then it must mean something: a number, a count or a text.
    switch (kind) {
    case 'f': // finite: the exponent is not all ones
        return (word & 0x7f800000u) != 0x7f800000u;
    case 'd':
        return (word & 0x7ff0000000000000u) != 0x7ff0000000000000u;
    case 'n':
        // Every element has at least one byte, so a count beyond the rest is false.
        if (walk->counts == WALK_COUNTS || word > walk->size - walk->at)
            return false;
        walk->count[walk->counts++] = (uint32_t)word;
        return true;
    case 's':
        // The length includes the terminator, which must be the only zero.
        if (word < 1 || word > walk->size - walk->at)
            return false;
        walk->at += word;
        return memchr(walk->data + walk->at - word, 0, word) == walk->data + walk->at - 1;
    default:
        return true;
    }
}

// Checks the fields of `shape` up to its end or its closing bracket.
static bool walk_shape(Walk *walk, const char *shape)
{
    for (; *shape && *shape != ')'; shape++) {
        if (*shape == ' ')
            continue;
        // How often the next field occurs.
        uint32_t times = 1;
        if (*shape == '*') {
            int index = shape[1] - '0';
            if (index >= walk->counts)
                return false;
            times = walk->count[index];
            shape += 2;
        } else if (isdigit((unsigned char)*shape)) {
            for (times = 0; isdigit((unsigned char)*shape); shape++)
                times = 10 * times + (uint32_t)(*shape - '0');
        }
        // A group is walked once for each time.
        for (uint32_t k = 0; k < times; k++) {
            if (*shape == '(' ? !walk_shape(walk, shape + 1) : !walk_item(walk, *shape))
                return false;
        }
        if (*shape == '(')
            shape = strchr(shape, ')');
    }
    return true;
}

bool wire_is(const WireType *type, const void *data, size_t size)
{
    const Walk walk = {.data = data, .size = size};
    return size >= 8 && word_at(&walk, 8) == (uint64_t)type->fingerprint();
}

bool wire_check(const WireType *type, const void *data, size_t size)
{
    Walk walk = {.data = data, .size = size, .at = 8};
    if (!wire_is(type, data, size))
        return false;
    return walk_shape(&walk, type->shape) && walk.at == walk.size;
}
