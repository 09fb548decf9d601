// SPDX-License-Identifier: MIT
// The errors that a client reads.
#include "test.h"
#include "kit.h"

#include "pliant_error_t.h"

enum { DATA = 4096 };

// A client without a connection takes what a network would bring.
TEST(a_client_has_the_newest_errors)
{
    static PliantClient kit;
    unsigned char data[DATA];
    pliant_error_body_t body[2] = {{.name = (char *)"liver",
                                    .space = 1e-4,
                                    .steps = 2e-5,
                                    .total = 1.2e-4,
                                    .relative = 0.03,
                                    .age = 24},
                                   {.name = (char *)"skin", .space = -1.0, .age = -1}};
    pliant_error_tool_t tool[1] = {{.tool = 4, .force = 2.0, .error = 0.1, .share = 0.05}};
    pliant_error_t message = {
        .step = 99, .time = 0.099, .num_bodies = 2, .num_tools = 1, .body = body, .tool = tool};
    assert_null(pliant_errors(&kit));
    int size = pliant_error_t_encode(data, 0, DATA, &message);
    kit_take_errors(&kit, data, (size_t)size - 1); // cut off: not taken
    assert_null(pliant_errors(&kit));
    kit_take_errors(&kit, data, (size_t)size);
    const PliantErrors *errors = pliant_errors(&kit);
    assert_true(errors->step == 99 && errors->time == 0.099);
    assert_int_equal(errors->body_count, 2);
    assert_string_equal(errors->body[0].body, "liver");
    assert_true(errors->body[0].space == 1e-4 && errors->body[0].steps == 2e-5);
    assert_true(errors->body[0].total == 1.2e-4 && errors->body[0].relative == 0.03);
    assert_true(errors->body[0].age == 24 && errors->body[1].space == -1.0);
    assert_int_equal(errors->tool_count, 1);
    assert_true(errors->tool[0].tool == 4 && errors->tool[0].force == 2.0);
    assert_true(errors->tool[0].error == 0.1 && errors->tool[0].share == 0.05);
    // The next ones replace them.
    message.num_tools = 0;
    size = pliant_error_t_encode(data, 0, DATA, &message);
    kit_take_errors(&kit, data, (size_t)size);
    assert_int_equal(pliant_errors(&kit)->tool_count, 0);
    kit_forget(&kit);
    assert_null(pliant_errors(&kit));
}
