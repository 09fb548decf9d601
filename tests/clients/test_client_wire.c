// SPDX-License-Identifier: MIT
// Raw messages are refused unless lcm-gen's decoder is safe with them.
#include "test.h"
#include "wire.h"
#include "mesh_message.h"

#include "pliant_command_t.h"
#include "pliant_contact_t.h"
#include "pliant_elements_t.h"
#include "pliant_error_map_t.h"
#include "pliant_error_t.h"
#include "pliant_event_t.h"
#include "pliant_look_t.h"
#include "pliant_ledger_t.h"
#include "pliant_mesh_delta_t.h"
#include "pliant_nodes_t.h"
#include "pliant_playback_t.h"
#include "pliant_reply_t.h"
#include "pliant_rest_t.h"
#include "pliant_status_t.h"
#include "pliant_tool_pose_t.h"

// One encoded message in a block of exactly its size, so that the sanitizer sees a read beyond it.
typedef struct Raw {
    const WireType *type;
    unsigned char *data;
    size_t size;
    bool (*decode)(const void *data, size_t size); // decodes and cleans up
} Raw;

#define DEFINE_CODEC(name)                                                                         \
    static bool decode_##name(const void *data, size_t size)                                       \
    {                                                                                              \
        pliant_##name##_t message;                                                                 \
        if (pliant_##name##_t_decode(data, 0, (int)size, &message) < 0)                            \
            return false;                                                                          \
        pliant_##name##_t_decode_cleanup(&message);                                                \
        return true;                                                                               \
    }                                                                                              \
    static Raw encode_##name(const WireType *type, const pliant_##name##_t *message)               \
    {                                                                                              \
        Raw raw = {.type = type, .decode = decode_##name};                                         \
        raw.size = (size_t)pliant_##name##_t_encoded_size(message);                                \
        raw.data = malloc(raw.size);                                                               \
        assert_non_null(raw.data);                                                                 \
        assert_int_equal(pliant_##name##_t_encode(raw.data, 0, (int)raw.size, message), raw.size); \
        return raw;                                                                                \
    }

DEFINE_CODEC(tool_pose)
DEFINE_CODEC(command)
DEFINE_CODEC(reply)
DEFINE_CODEC(nodes)
DEFINE_CODEC(mesh)
DEFINE_CODEC(mesh_delta)
DEFINE_CODEC(contact)
DEFINE_CODEC(status)
DEFINE_CODEC(event)
DEFINE_CODEC(rest)
DEFINE_CODEC(playback)
DEFINE_CODEC(look)
DEFINE_CODEC(ledger)
DEFINE_CODEC(error)
DEFINE_CODEC(error_map)
DEFINE_CODEC(elements)

enum { TYPES = 16 };

static void make_all(Raw raw[TYPES])
{
    float position[6] = {0.5f, -1.0f, 2.0f, 0.0f, 1e-3f, 3.0f};
    int32_t triangle[3] = {0, 1, 1}, id[2] = {0, 1}, parent[4] = {0, 0, 1, 1};
    int8_t level[2] = {0, 0};
    char *stages[2] = {(char *)"forces", (char *)"contact"}, *reasons[1] = {(char *)"size"};
    double stage_us[2] = {1.0, 2.0};
    int64_t counts[1] = {7};
    pliant_body_status_t bodies[2] = {
        {.name = (char *)"a", .model = (char *)"surface", .integrator = (char *)"rk4", .mass = 1.0},
        {.name = (char *)"b", .model = (char *)"surface", .integrator = (char *)"", .nodes = 9}};
    raw[0] = encode_tool_pose(&WIRE_TOOL_POSE, &(pliant_tool_pose_t){.tool = 1});
    raw[1] = encode_command(&WIRE_COMMAND, &(pliant_command_t){.argument = (char *)"a.b=1"});
    raw[2] = encode_reply(
        &WIRE_REPLY, &(pliant_reply_t){.channel = (char *)"X_COMMAND", .text = (char *)"done"});
    raw[3] = encode_nodes(
        &WIRE_NODES, &(pliant_nodes_t){
                         .node_count = 2, .chunk_count = 1, .num_values = 6, .position = position});
    const pliant_mesh_t mesh = mesh_message(0, 0, 0, 2, id, parent, level, 1, triangle);
    raw[4] = encode_mesh(&WIRE_MESH, &mesh);
    raw[5] = encode_contact(&WIRE_CONTACT, &(pliant_contact_t){.tool = 1, .depth = 1e-3});
    raw[6] = encode_status(&WIRE_STATUS, &(pliant_status_t){.scene = (char *)"s",
                                                            .state = (char *)"running",
                                                            .num_stages = 2,
                                                            .stage = stages,
                                                            .stage_us = stage_us,
                                                            .num_bodies = 2,
                                                            .body = bodies,
                                                            .num_reasons = 1,
                                                            .reason = reasons,
                                                            .count = counts});
    raw[7] = encode_event(&WIRE_EVENT, &(pliant_event_t){.body = (char *)"",
                                                         .kind = (char *)"reset",
                                                         .text = (char *)"bad numbers"});
    raw[8] = encode_mesh_delta(&WIRE_MESH_DELTA, &(pliant_mesh_delta_t){.node_count = 2,
                                                                        .triangle_count = 1,
                                                                        .chunk_count = 1,
                                                                        .num_triangles = 1,
                                                                        .num_indices = 3,
                                                                        .triangle_slot = id,
                                                                        .triangle = triangle,
                                                                        .num_nodes = 2,
                                                                        .num_parents = 4,
                                                                        .node_slot = id,
                                                                        .id = id,
                                                                        .origin = id,
                                                                        .parent = parent,
                                                                        .piece = id,
                                                                        .level = level});
    raw[9] = encode_rest(&WIRE_REST, &(pliant_rest_t){.node_count = 2,
                                                      .chunk_count = 1,
                                                      .num_values = 6,
                                                      .position = position,
                                                      .num_coordinates = 4,
                                                      .texture = position});
    static double time[2] = {1.0, 2.0};
    static char *kind[2] = {(char *)"cut", (char *)"tear"}, *text[2] = {(char *)"a", (char *)""};
    raw[10] = encode_playback(&WIRE_PLAYBACK, &(pliant_playback_t){.whole = true,
                                                                   .num_marks = 2,
                                                                   .mark_time = time,
                                                                   .mark_kind = kind,
                                                                   .mark_text = text,
                                                                   .num_tools = 2,
                                                                   .num_forces = 6,
                                                                   .tool = id,
                                                                   .force = position});
    static uint8_t colour[6] = {0, 1, 2, 253, 254, 255};
    raw[12] = encode_look(&WIRE_LOOK, &(pliant_look_t){.node_count = 2,
                                                       .chunk_count = 1,
                                                       .texture = (char *)"skin.png",
                                                       .color = {1, 2, 3},
                                                       .num_values = 6,
                                                       .node_color = colour,
                                                       .node_inside = colour});
    static pliant_ledger_body_t sections[1] = {{.name = (char *)"a", .solid = true, .cut = 1e-4}};
    static pliant_ledger_tissue_t tissues[2] = {
        {.body = (char *)"a", .name = (char *)"liver", .density = 1060.0, .at_load = 1e-3},
        {.body = (char *)"a", .name = (char *)"", .removed = 1e-6}};
    static pliant_ledger_region_t regions[1] = {
        {.name = (char *)"tumour", .distance = -1.0, .body = (char *)"", .by = (char *)""}};
    raw[11] = encode_ledger(&WIRE_LEDGER, &(pliant_ledger_t){.num_bodies = 1,
                                                             .num_tissues = 2,
                                                             .num_regions = 1,
                                                             .body = sections,
                                                             .tissue = tissues,
                                                             .region = regions});
    static pliant_error_body_t errors[2] = {
        {.name = (char *)"a", .space = 1e-4, .steps = 1e-6, .total = 1.01e-4, .age = 24},
        {.name = (char *)"", .space = -1.0, .steps = -1.0, .age = -1}};
    static pliant_error_tool_t tools[1] = {{.tool = 7, .force = 0.5, .error = 0.1, .share = 0.2}};
    raw[13] = encode_error(
        &WIRE_ERROR,
        &(pliant_error_t){.num_bodies = 2, .num_tools = 1, .body = errors, .tool = tools});
    raw[14] = encode_error_map(
        &WIRE_ERROR_MAP,
        &(pliant_error_map_t){.node_count = 6, .chunk_count = 1, .num_values = 6, .share = colour});
    static int16_t tags[2] = {1, -2};
    static int32_t elements[1] = {7};
    raw[15] = encode_elements(&WIRE_ELEMENTS, &(pliant_elements_t){.square_count = 2,
                                                                   .chunk_count = 1,
                                                                   .num_levels = 1,
                                                                   .num_squares = 2,
                                                                   .elements = elements,
                                                                   .level = colour,
                                                                   .tag = tags});
}

static void free_all(Raw raw[TYPES])
{
    for (int k = 0; k < TYPES; k++)
        free(raw[k].data);
}

TEST(whole_messages_of_every_type_pass)
{
    Raw raw[TYPES];
    make_all(raw);
    for (int k = 0; k < TYPES; k++) {
        assert_true(wire_check(raw[k].type, raw[k].data, raw[k].size));
        assert_true(raw[k].decode(raw[k].data, raw[k].size));
    }
    free_all(raw);
}

TEST(messages_of_another_type_are_refused)
{
    Raw raw[TYPES];
    make_all(raw);
    for (int k = 0; k < TYPES; k++) {
        for (int j = 0; j < TYPES; j++)
            assert_int_equal(wire_check(raw[j].type, raw[k].data, raw[k].size), j == k);
    }
    free_all(raw);
}

TEST(shortened_and_lengthened_messages_are_refused)
{
    Raw raw[TYPES];
    make_all(raw);
    for (int k = 0; k < TYPES; k++) {
        for (size_t size = 0; size < raw[k].size; size++) {
            FREED unsigned char *part = malloc(size ? size : 1);
            memcpy(part, raw[k].data, size);
            assert_false(wire_check(raw[k].type, part, size));
        }
        FREED unsigned char *longer = calloc(raw[k].size + 1, 1);
        memcpy(longer, raw[k].data, raw[k].size);
        assert_false(wire_check(raw[k].type, longer, raw[k].size + 1));
    }
    free_all(raw);
}

// Whatever one byte is turned into: either refused, or decoded without harm (the sanitizers watch).
TEST(messages_with_a_corrupt_byte_are_refused_or_decode_safely)
{
    static const unsigned char values[] = {0x00, 0x01, 0x40, 0x7f, 0x80, 0xff};
    Raw raw[TYPES];
    make_all(raw);
    for (int k = 0; k < TYPES; k++) {
        for (size_t at = 0; at < raw[k].size; at++) {
            unsigned char kept = raw[k].data[at];
            for (size_t v = 0; v < sizeof values; v++) {
                raw[k].data[at] = values[v];
                if (wire_check(raw[k].type, raw[k].data, raw[k].size))
                    assert_true(raw[k].decode(raw[k].data, raw[k].size));
            }
            raw[k].data[at] = kept;
        }
    }
    free_all(raw);
}

TEST(non_finite_numbers_are_refused)
{
    float position[3] = {0.0f, (float)NAN, 0.0f};
    Raw raw = encode_nodes(&WIRE_NODES, &(pliant_nodes_t){.num_values = 3, .position = position});
    assert_false(wire_check(raw.type, raw.data, raw.size));
    free(raw.data);
    raw =
        encode_contact(&WIRE_CONTACT, &(pliant_contact_t){.force = {0.0, -(double)INFINITY, 0.0}});
    assert_false(wire_check(raw.type, raw.data, raw.size));
    free(raw.data);
}
