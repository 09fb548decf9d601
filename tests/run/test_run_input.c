// SPDX-License-Identifier: MIT
// Inputs on the wire and their values, without a daemon.
#include "test.h"
#include "run/input.h"

#include "pliant_command_t.h"

static size_t encode_command(int32_t kind, int64_t value, const char *argument, void *data)
{
    pliant_command_t m = {.utime = 12345,
                          .sender = -7,
                          .id = 9,
                          .kind = kind,
                          .value = value,
                          .argument = (char *)(uintptr_t)argument};
    return (size_t)pliant_command_t_encode(data, 0, INPUT_WIRE_MAX, &m);
}

TEST(what_is_encoded_decodes_to_the_same)
{
    Input inputs[INPUT_KINDS] = {
        {.kind = INPUT_POSE,
         .pose = {.tool = 3,
                  .position = {0.1, -0.2, 1.0 / 3.0},
                  .orientation = {0.9995, 0.001, -0.002, 0.003},
                  .twist = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0},
                  .grip = 0.25,
                  .twist_valid = true,
                  .active = true}},
        {.kind = INPUT_CUT,
         .cut = {.before = {{1.0, 2.0, 3.0}}, .after = {{4.0}}},
         .text = "liver"},
        {.kind = INPUT_LOAD,
         .load = {.center = {0.1, 0.2, 0.3}, .radius = 0.02, .force = {-1.0}, .duration = 0.5},
         .text = ""},
        {.kind = INPUT_COMMAND, .command = {.kind = PLIANT_COMMAND_T_STEP, .value = 77}},
        {.kind = INPUT_TIE,
         .tie = {.action = 1,
                 .tie = 3,
                 .kind = 2,
                 .tool = 7,
                 .node_count = 2,
                 .node = {11, 12},
                 .center = {0.1, 0.2, 0.3},
                 .radius = 0.02,
                 .stiffness = 1.0 / 3.0,
                 .damping_ratio = 0.5,
                 .break_force = 1.5,
                 .to_body = "gall"},
         .text = "liver"},
    };
    for (int k = 0; k < INPUT_KINDS; k++) {
        inputs[k].index = -1;
        inputs[k].sender = 5 + k;
        inputs[k].id = -k;
        inputs[k].utime = INT64_C(1700000000000000) + k;
        unsigned char data[INPUT_WIRE_MAX];
        size_t size = input_encode(&inputs[k], data);
        Input decoded;
        char why[INPUT_WHY_MAX];
        assert_int_equal(input_decode((InputKind)k, data, size, &decoded, why), ACCEPTED);
        unsigned char again[INPUT_WIRE_MAX];
        assert_int_equal(input_encode(&decoded, again), size);
        assert_memory_equal(again, data, size);
    }
}

TEST(a_setting_survives_being_logged_to_the_last_bit)
{
    unsigned char data[INPUT_WIRE_MAX];
    char why[INPUT_WHY_MAX];
    // The longest name of a body with the longest number.
    static const char longest[] =
        "try wall_with_a_name_of_31_letters_.stiffness_scale=-1.2345678901234567e-100";
    static const char *const settings[] = {"sphere.friction=0.1", "gravity=[0.1, -0.3, -9.81]",
                                           "try sphere.friction", "try gravity=0 0 -9.81", longest};
    static const char *const keys[] = {"sphere.friction", "gravity", "sphere.friction", "gravity",
                                       "wall_with_a_name_of_31_letters_.stiffness_scale"};
    static const int counts[] = {1, 3, 0, 3, 1};
    for (int i = 0; i < 5; i++) {
        size_t size = encode_command(PLIANT_COMMAND_T_SET, 0, settings[i], data);
        Input first, second;
        assert_int_equal(input_decode(INPUT_COMMAND, data, size, &first, why), ACCEPTED);
        assert_int_equal(input_check(&first, NULL, why), ACCEPTED);
        assert_string_equal(first.text, keys[i]);
        assert_int_equal(first.setting.count, counts[i]);
        assert_int_equal(first.setting.tries, i >= 2);
        size = input_encode(&first, data);
        assert_int_equal(input_decode(INPUT_COMMAND, data, size, &second, why), ACCEPTED);
        assert_int_equal(input_check(&second, NULL, why), ACCEPTED);
        assert_string_equal(second.text, first.text);
        assert_int_equal(second.setting.tries, first.setting.tries);
        assert_int_equal(second.setting.count, first.setting.count);
        // The same doubles: 17 digits are enough.
        assert_memory_equal(second.setting.value, first.setting.value, sizeof first.setting.value);
    }
}

TEST(settings_that_are_no_key_and_number_are_refused)
{
    char longest[2 * INPUT_TEXT_MAX];
    memset(longest, 'k', sizeof longest);
    strcpy(longest + INPUT_TEXT_MAX - 6, "=1");
    const char *const bad[] = {"",          "=",     "a",     "a=",     "a=b",
                               "a=1x",      "=1",    "a=nan", "a=inf",  "a=1 2",
                               "a=1 2 3 4", longest, "try ",  "try =1", "try a=b"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        unsigned char data[INPUT_WIRE_MAX];
        char why[INPUT_WHY_MAX];
        Input input;
        size_t size = encode_command(PLIANT_COMMAND_T_SET, 0, bad[i], data);
        assert_int_equal(input_decode(INPUT_COMMAND, data, size, &input, why), ACCEPTED);
        if (input_check(&input, NULL, why) == ACCEPTED)
            fail_msg("accepted: '%s'", bad[i]);
    }
}

TEST(no_length_and_no_single_corrupt_byte_is_read_out_of_bounds)
{
    // Exactly sized copies on the heap, so that a sanitizer sees the first byte beyond.
    unsigned char whole[INPUT_WIRE_MAX];
    size_t size = encode_command(PLIANT_COMMAND_T_SET, 0, "gravity_z=1", whole);
    char why[INPUT_WHY_MAX];
    Input input;
    for (size_t cut = 0; cut <= size; cut++) {
        FREED unsigned char *data = malloc(cut + 1);
        memcpy(data, whole, cut);
        Refusal refusal = input_decode(INPUT_COMMAND, data, cut, &input, why);
        assert_true((refusal == ACCEPTED) == (cut == size));
    }
    for (size_t at = 0; at < size; at++) {
        for (int value = 0; value < 256; value += 5) {
            FREED unsigned char *data = malloc(size);
            memcpy(data, whole, size);
            data[at] = (unsigned char)value;
            if (input_decode(INPUT_COMMAND, data, size, &input, why) == ACCEPTED)
                input_check(&input, NULL, why);
        }
    }
}

TEST(the_orientation_is_normalised)
{
    Input input = {.kind = INPUT_POSE, .pose = {.orientation = {1.0005, 0.0, 0.0, 0.0}}};
    Quat q = input_pose(&input).orientation;
    expect_near(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z, 1.0, 1e-15); // a few roundings
}
