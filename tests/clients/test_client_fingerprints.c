// SPDX-License-Identifier: MIT
// Message types never change (lcmtypes/README.md): each has the fingerprint that it was published
// with. A new type gets a row here; a changed one breaks every program that was built before.
#include "test.h"

#include "pliant_lcmtypes.h"

#include <inttypes.h>

typedef struct Fingerprint {
    const char *type;
    uint64_t value;
} Fingerprint;

static const Fingerprint PUBLISHED[] = {
    {"pliant_body_status_t", 0x991c11491664cb0b}, {"pliant_claim_t", 0xfe7a3f74a34be92f},
    {"pliant_command_t", 0xcb038eea8be21f52},     {"pliant_contact_t", 0x4e0376a28edf41da},
    {"pliant_cut_t", 0x6d0efac2cb844dd1},         {"pliant_elements_t", 0xa64d486f35ffdee5},
    {"pliant_error_body_t", 0xc464873dfdba2544},  {"pliant_error_map_t", 0x901507f425c711c1},
    {"pliant_error_t", 0x93cdc26d3c8e966f},       {"pliant_error_tool_t", 0xc55a2f9c9c49b23d},
    {"pliant_event_t", 0xce1dc83f7018c10d},       {"pliant_hello_t", 0x1021550bd19bf4a6},
    {"pliant_ledger_body_t", 0x9cfa83911e1844da}, {"pliant_ledger_region_t", 0x854b9fc064b0e070},
    {"pliant_ledger_t", 0x9e269b1299f33b3c},      {"pliant_ledger_tissue_t", 0x26df9e3681bdfe93},
    {"pliant_load_t", 0x82f1551aa90e215f},        {"pliant_look_t", 0x535de1fe520299d2},
    {"pliant_mesh_delta_t", 0x13e78e83dd7fe244},  {"pliant_mesh_t", 0x426ccbe492320638},
    {"pliant_nodes_t", 0xb6e1f452106590ca},       {"pliant_playback_t", 0x4b89f6052e08ea04},
    {"pliant_points_t", 0x04a34c3943030996},      {"pliant_reply_t", 0x28d391b0be52fb25},
    {"pliant_rest_t", 0xa773615f93fb3aa0},        {"pliant_status_t", 0x77398c262827a161},
    {"pliant_tie_t", 0x0ad4aa0074e6922e},         {"pliant_tool_pose_t", 0x869d9c7b8491ddd3},
    {"pliant_walls_t", 0x8f758205e5809fbe},
};

static const Fingerprint *find(const char *type)
{
    for (size_t i = 0; i < sizeof PUBLISHED / sizeof *PUBLISHED; i++)
        if (strcmp(PUBLISHED[i].type, type) == 0)
            return &PUBLISHED[i];
    fail_msg("%s is new: give it a row in %s", type, __FILE__);
    return NULL;
}

#define FINGERPRINT(name) {#name, (uint64_t)__##name##_get_hash()},

TEST(no_message_type_has_changed)
{
    const Fingerprint now[] = {PLIANT_LCMTYPES_LIST(FINGERPRINT)};
    for (size_t i = 0; i < sizeof now / sizeof *now; i++)
        if (find(now[i].type)->value != now[i].value)
            fail_msg("%s has changed: its fingerprint is %016" PRIx64
                     " now; a new field goes into a type of its own beside it",
                     now[i].type, now[i].value);
}

TEST(no_message_type_was_taken_away)
{
    assert_int_equal(PLIANT_LCMTYPES_COUNT, sizeof PUBLISHED / sizeof *PUBLISHED);
}
