// SPDX-License-Identifier: MIT
// What a page may send: every number is checked before it goes anywhere.
#include "requests.h"
#include "test.h"

#include "pliant_command_t.h"
#include "pliant_tie_t.h"

// Parsed from a block of exactly its size, so that the sanitizer sees a read beyond it.
static bool parse(const char *text, Ask *ask, PliantError *error)
{
    size_t size = strlen(text);
    FREED char *exact = malloc(size ? size : 1);
    assert_non_null(exact);
    memcpy(exact, text, size);
    return ask_parse(exact, size, ask, error);
}

// What a text that is right asks for, until the next call.
static const Ask *asked(const char *text)
{
    static Ask ask;
    PliantError error;
    expect_ok(parse(text, &ask, &error), error);
    return &ask;
}

TEST(a_tool_message_becomes_a_pose)
{
    const Ask *ask = asked("{\"type\":\"tool\",\"tool\":3,\"position\":[0.5,-1,2e-3],"
                           "\"orientation\":[0,0,0,1.0005],\"grip\":0.25,\"active\":true}");
    assert_int_equal(ask->kind, ASK_TOOL);
    assert_int_equal(ask->pose.tool, 3);
    expect_near(ask->pose.position[0], 0.5, 0.0);
    expect_near(ask->pose.position[1], -1.0, 0.0);
    expect_near(ask->pose.position[2], 2e-3, 0.0);
    expect_near(ask->pose.orientation[3], 1.0, 1e-15); // made unit: one rounding
    expect_near(ask->pose.grip, 0.25, 0.0);
    assert_true(ask->pose.active);
    assert_true(ask->pose.time < 0.0); // not given
    ask = asked("{\"type\":\"tool\",\"tool\":3,\"position\":[0,0,0],\"orientation\":[1,0,0,0],"
                "\"time\":12.5,\"active\":true}");
    expect_near(ask->pose.time, 12.5, 0.0);
}

TEST(requests_keep_their_numbers_and_bodies)
{
    const Ask *ask = asked("{\"type\":\"cut\",\"id\":7,\"before\":[[1,2,3],[4,5,6]],"
                           "\"after\":[[7,8,9],[10,11,12]],\"body\":\"liver\"}");
    assert_int_equal(ask->kind, ASK_CUT);
    assert_int_equal(ask->id, 7);
    assert_string_equal(ask->text, "liver");
    for (int k = 0; k < 6; k++) {
        expect_near((&ask->cut.before[0][0])[k], k + 1, 0.0);
        expect_near((&ask->cut.after[0][0])[k], k + 7, 0.0);
    }
    ask = asked("{\"type\":\"load\",\"id\":8,\"center\":[1,2,3],\"radius\":0.1,"
                "\"force\":[0,0,-2],\"duration\":1.5}");
    assert_int_equal(ask->kind, ASK_LOAD);
    assert_string_equal(ask->text, "");
    expect_near(ask->load.force[2], -2.0, 0.0);
    expect_near(ask->load.duration, 1.5, 0.0);
    ask = asked("{\"type\":\"command\",\"id\":9,\"kind\":\"step\",\"value\":20}");
    assert_int_equal(ask->command.kind, PLIANT_COMMAND_T_STEP);
    assert_int_equal(ask->command.value, 20);
    ask = asked("{\"type\":\"command\",\"id\":9,\"kind\":\"set\","
                "\"argument\":\"gravity=0 0 -9.81\"}");
    assert_int_equal(ask->command.kind, PLIANT_COMMAND_T_SET);
    assert_string_equal(ask->text, "gravity=0 0 -9.81");
    ask = asked("{\"type\":\"tie\",\"id\":10,\"action\":\"make\",\"kind\":\"clip\","
                "\"center\":[1,2,3],\"radius\":0.1,\"body\":\"gall\",\"to_body\":\"liver\","
                "\"break_force\":2}");
    assert_int_equal(ask->kind, ASK_TIE);
    assert_int_equal(ask->tie.action, PLIANT_TIE_T_MAKE);
    assert_int_equal(ask->tie.kind, PLIANT_TIE_T_CLIP);
    assert_int_equal(ask->tie.number, 0);
    assert_string_equal(ask->text, "gall");
    assert_string_equal(ask->tie.to_body, "liver");
    expect_near(ask->tie.center[2], 3.0, 0.0);
    expect_near(ask->tie.stiffness, 0.3, 0.0); // the usual one
    expect_near(ask->tie.break_force, 2.0, 0.0);
    ask = asked("{\"type\":\"tie\",\"id\":11,\"action\":\"release\",\"tie\":4}");
    assert_int_equal(ask->tie.action, PLIANT_TIE_T_RELEASE);
    assert_int_equal(ask->tie.number, 4);
    ask = asked("{\"type\":\"drawn\",\"round\":41}");
    assert_int_equal(ask->round, 41);
}

#define TOOL_HEAD "{\"type\":\"tool\",\"tool\":1,"
#define TOOL_AT   TOOL_HEAD "\"position\":[0,0,0],"
#define TOOL_TAIL "\"orientation\":[1,0,0,0],\"grip\":0,\"active\":true}"
#define CUT_HEAD  "{\"type\":\"cut\",\"id\":1,"
#define TIE_HEAD  "{\"type\":\"tie\",\"id\":1"
#define TIE_AT    ",\"action\":\"make\",\"center\":[0,0,0],\"radius\":0.01"
#define LOAD_HEAD "{\"type\":\"load\",\"id\":1,\"center\":[0,0,0],"

TEST(what_is_wrong_is_refused_by_name)
{
    static const struct {
        const char *text, *says;
    } cases[] = {
        {"", "not JSON"},
        {"{", "not JSON"},
        {"[]", "expected a JSON object"},
        {"nul", "not JSON"},
        {"{\"type\":\"tool\"} x", "not JSON"},
        {"{\"type\":\"tool\",\"type\":\"cut\"}", "not JSON"}, // twice
        {"{}", "type: expected"},
        {"{\"type\":5}", "type: expected"},
        {"{\"type\":\"fly\"}", "type: expected one of drawn, tool, cut, load, tie, command, start, "
                               "end, record, propose"},
        {"{\"type\":\"drawn\"}", "round: expected an integer"},
        {"{\"type\":\"drawn\",\"round\":-1}", "round: expected"},
        {"{\"type\":\"drawn\",\"round\":1.5}", "round: expected"},
        {TOOL_HEAD TOOL_TAIL, "position: expected 3 numbers"},
        {TOOL_HEAD "\"position\":[0,0]," TOOL_TAIL, "position: expected 3"},
        {TOOL_HEAD "\"position\":[0,0,null]," TOOL_TAIL, "position: expected a number"},
        {TOOL_HEAD "\"position\":[0,0,\"1\"]," TOOL_TAIL, "position: expected a number"},
        {TOOL_HEAD "\"position\":[0,0,1001]," TOOL_TAIL,
         "position: expected a number in [-1000, 1000]"},
        {TOOL_HEAD "\"position\":[0,0,1e999]," TOOL_TAIL, "not JSON"}, // no double holds it
        {TOOL_HEAD "\"position\":[0,0,NaN]," TOOL_TAIL, "not JSON"},
        {TOOL_AT "\"orientation\":[1,0,0,0.1],\"active\":true}", "orientation: length 1.00499"},
        {TOOL_AT "\"orientation\":[0,0,0,0],\"active\":true}", "orientation: length 0"},
        {TOOL_AT "\"orientation\":[1,0,0],\"active\":true}", "orientation: expected 4"},
        {TOOL_AT "\"orientation\":[1,0,0,0],\"active\":1}", "active: expected true or false"},
        {"{\"type\":\"propose\",\"id\":4,\"name\":\"a.nrrd\",\"together\":1}",
         "together: expected true or false"},
        {TOOL_AT "\"orientation\":[1,0,0,0],\"grip\":2,\"active\":true}", "grip: expected"},
        {TOOL_AT "\"orientation\":[1,0,0,0],\"time\":-1,\"active\":true}", "time: expected"},
        {"{\"type\":\"tool\",\"tool\":1e9,\"position\":[0,0,0]," TOOL_TAIL,
         "tool: expected an integer"},
        {"{\"type\":\"tool\",\"tool\":4294967297,\"position\":[0,0,0]," TOOL_TAIL,
         "tool: expected"},
        {CUT_HEAD "\"before\":[[0,0,0]],\"after\":[[0,0,0],[1,1,1]]}",
         "before: expected two points"},
        {CUT_HEAD "\"before\":[[0,0,0],[1,1,1]],\"after\":[[0,0,0],[1,1]]}", "after: expected 3"},
        {CUT_HEAD "\"before\":[[0,0,0],[1,1,1]],\"after\":[[0,0,0],[1,1,1]],\"body\":\"a b\"}",
         "body: expected"},
        {CUT_HEAD "\"before\":[[0,0,0],[1,1,1]],\"after\":[[0,0,0],[1,1,1]],\"body\":7}",
         "body: expected"},
        {"{\"type\":\"cut\",\"before\":[[0,0,0],[1,1,1]],\"after\":[[0,0,0],[1,1,1]]}",
         "id: expected"},
        {LOAD_HEAD "\"radius\":0,\"force\":[0,0,0],\"duration\":1}", "radius: expected"},
        {LOAD_HEAD "\"radius\":1,\"force\":[0,0,1e7],\"duration\":1}", "force: expected"},
        {LOAD_HEAD "\"radius\":1,\"force\":[0,0,1],\"duration\":-1}", "duration: expected"},
        {LOAD_HEAD "\"radius\":1,\"force\":[0,0,1]}", "duration: expected"},
        {TIE_HEAD "}", "action: expected one of make, change, release"},
        {TIE_HEAD ",\"action\":\"release\"}", "tie: expected an integer"},
        {TIE_HEAD ",\"action\":\"release\",\"tie\":0}", "tie: expected an integer in [1, "},
        {TIE_HEAD ",\"action\":\"change\",\"tie\":1,\"stiffness\":0}", "stiffness: expected"},
        {TIE_HEAD ",\"action\":\"change\",\"tie\":1,\"damping_ratio\":3}",
         "damping_ratio: expected"},
        {TIE_HEAD ",\"action\":\"change\",\"tie\":1,\"break_force\":-1}", "break_force: expected"},
        {TIE_HEAD ",\"action\":\"make\",\"kind\":\"knot\"}", "kind: expected one of pin, tie"},
        {TIE_HEAD ",\"action\":\"make\",\"kind\":\"pin\"}", "center: expected 3"},
        {TIE_HEAD ",\"action\":\"make\",\"kind\":\"pin\",\"center\":[0,0,0]}", "radius: expected"},
        {TIE_HEAD TIE_AT ",\"kind\":\"tie\",\"to_body\":\"a b\"}", "to_body: expected"},
        {TIE_HEAD TIE_AT ",\"kind\":\"carry\"}", "tool: expected an integer"},
        {"{\"type\":\"command\",\"id\":1,\"kind\":\"explode\"}",
         "kind: expected one of pause, resume, step, reset, checkpoint, describe, set, stop"},
        {"{\"type\":\"command\",\"id\":1}", "kind: expected"},
        {"{\"type\":\"command\",\"id\":1,\"kind\":\"step\",\"value\":1e300}", "value: expected"},
        {"{\"type\":\"command\",\"id\":1,\"kind\":\"set\",\"argument\":\"a\\u0001b\"}",
         "argument: expected printable"},
        {"{\"type\":\"command\",\"id\":1,\"kind\":\"set\",\"argument\":\"a\\u0000b\"}", "not JSON"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        Ask ask;
        PliantError error = {0};
        if (parse(cases[k].text, &ask, &error))
            fail_msg("taken: %s", cases[k].text);
        if (strstr(error.text, cases[k].says) == NULL)
            fail_msg("%s: '%s' does not say '%s'", cases[k].text, error.text, cases[k].says);
    }
}

TEST(long_and_deep_messages_are_refused)
{
    char *text = malloc(ASK_BYTES_MAX + 2);
    assert_non_null(text);
    memset(text, '[', ASK_BYTES_MAX + 1);
    text[ASK_BYTES_MAX + 1] = '\0';
    Ask ask;
    PliantError error = {0};
    assert_false(parse(text, &ask, &error));
    expect_in(error.text, "more than 16384");
    text[ASK_BYTES_MAX] = '\0'; // of the length allowed, nested as deep as it is long
    assert_false(parse(text, &ask, &error));
    expect_in(error.text, "not JSON");
    free(text);
    char argument[512], name[200];
    memset(name, 'a', sizeof name - 1);
    name[sizeof name - 1] = '\0';
    snprintf(argument, sizeof argument,
             "{\"type\":\"command\",\"id\":1,\"kind\":\"set\",\"argument\":\"%s\"}", name);
    assert_false(parse(argument, &ask, &error));
    expect_in(error.text, "argument: expected a text of less than");
}

TEST(the_workbench_takes_names_and_words_of_its_lists)
{
    const Ask *ask =
        asked("{\"type\":\"start\",\"id\":1,\"folder\":\"uploads\",\"name\":\"a.cfg\"}");
    assert_int_equal(ask->kind, ASK_START);
    assert_int_equal(ask->folder, ASK_UPLOADS);
    assert_string_equal(ask->text, "a.cfg");
    ask = asked("{\"type\":\"end\",\"id\":2}");
    assert_int_equal(ask->kind, ASK_END);
    ask = asked("{\"type\":\"record\",\"id\":3,\"on\":true}");
    assert_true(ask->kind == ASK_RECORD && ask->record);
    ask = asked(
        "{\"type\":\"propose\",\"id\":4,\"name\":\"a.stl\",\"units\":\"mm\",\"together\":true}");
    assert_int_equal(ask->kind, ASK_PROPOSE);
    assert_string_equal(ask->propose.units, "mm");
    assert_null(ask->propose.model);
    assert_int_equal(ask->propose.label, 0);
    assert_true(ask->propose.together);
    ask = asked("{\"type\":\"propose\",\"id\":5,\"name\":\"a.nrrd\",\"model\":\"filled\","
                "\"cuttable\":\"no\",\"label\":7,\"layer\":2,\"even\":true}");
    assert_string_equal(ask->propose.model, "filled");
    assert_string_equal(ask->propose.cuttable, "no");
    assert_int_equal(ask->propose.label, 7);
    assert_int_equal(ask->propose.layer, 2);
    assert_true(ask->propose.even);
    static const char *const no[] = {
        "{\"type\":\"start\",\"id\":1,\"folder\":\"scenes\"}",
        "{\"type\":\"start\",\"id\":1,\"name\":\"a.cfg\"}",
        "{\"type\":\"start\",\"id\":1,\"folder\":\"..\",\"name\":\"a.cfg\"}",
        "{\"type\":\"start\",\"id\":1,\"folder\":0,\"name\":\"a.cfg\"}",
        "{\"type\":\"start\",\"folder\":\"scenes\",\"name\":\"a.cfg\"}",
        "{\"type\":\"start\",\"id\":1,\"folder\":\"scenes\",\"name\":\"a\\n.cfg\"}",
        "{\"type\":\"record\",\"id\":3}",
        "{\"type\":\"record\",\"id\":3,\"on\":\"yes\"}",
        "{\"type\":\"propose\",\"id\":4,\"name\":\"a.stl\",\"units\":\"--help\"}",
        "{\"type\":\"propose\",\"id\":4,\"name\":\"a.stl\",\"units\":\"\"}",
        "{\"type\":\"propose\",\"id\":4,\"name\":\"a.stl\",\"model\":\"plane\"}",
        "{\"type\":\"propose\",\"id\":4,\"name\":\"a.stl\",\"cuttable\":true}",
        "{\"type\":\"propose\",\"id\":4,\"name\":\"a.stl\",\"label\":0}",
        "{\"type\":\"propose\",\"id\":4,\"name\":\"a.stl\",\"even\":1}",
        "{\"type\":\"propose\",\"id\":4,\"name\":\"a.stl\",\"label\":\"liver\"}",
        "{\"type\":\"propose\",\"id\":4,\"name\":\"a.stl\",\"layer\":4294967297}",
        "{\"type\":\"propose\",\"id\":4}"};
    for (size_t k = 0; k < sizeof no / sizeof *no; k++) {
        Ask other;
        PliantError error;
        if (parse(no[k], &other, &error))
            fail_msg("taken: %s", no[k]);
    }
}
