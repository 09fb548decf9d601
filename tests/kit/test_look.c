// SPDX-License-Identifier: MIT
// Colours of bodies, from another process: of each node, live, recorded by the server and by
// pliant-record, and played.
#include "test.h"
#include "lcm_client.h"
#include "scratch.h"

#include "pliant/client.h"

#include "pliant_look_t.h"

enum { SIDE = 9, VOXELS = SIDE * SIDE * SIDE };

// Labels 1 and 2 side by side, and an image of another grey in each voxel.
static void write_volume(const char *name, bool image)
{
    FILE *file = fopen(scratch(name), "wb");
    assert_non_null(file);
    fprintf(file,
            "NRRD0004\ntype: uchar\ndimension: 3\nsizes: %d %d %d\nspacings: 5 5 5\nencoding: "
            "raw\n\n",
            SIDE, SIDE, SIDE);
    for (int at = 0; at < VOXELS; at++)
        fputc(image ? 40 * at % 251 : at % SIDE < SIDE / 2 ? 1 : 2, file);
    assert_int_equal(fclose(file), 0);
}

static const char SCENE[] =
    "start = \"paused\"; publish = { nodes_hz = 100.0; };\n"
    "bodies = ( { name = \"block\"; model = \"voxel\"; cuttable = true;\n"
    "    voxels = { file = \"labels.nrrd\"; label = [1, 2]; };\n"
    "    materials = ( { label = 2; color = [0.2, 0.4, 0.6]; } );\n"
    "    look = { color = [0.0, 0.0, 1.0]; image = \"image.nrrd\"; }; },\n"
    "  { name = \"one\"; mesh = { generator = \"ico_sphere\"; radius = 0.01;\n"
    "      place = { translation = [0.2, 0.0, 0.0]; }; };\n"
    "    look = { color = [0.0, 1.0, 0.0]; inside = [1.0, 0.0, 0.0]; }; },\n"
    "  { name = \"none\"; mesh = { generator = \"ico_sphere\"; radius = 0.01; }; } );\n";

typedef struct Heard {
    lcm_t *lcm;
    int32_t topology; // of the newest look of the block
    int looks[3];     // of block, one, and any other
} Heard;

static void on_look(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    Heard *heard = user;
    pliant_look_t look;
    assert_true(pliant_look_t_decode(buffer->data, 0, (int)buffer->data_size, &look) > 0);
    const int which = strcmp(channel, "PLIANT_LOOK_block") == 0 ? 0
                      : strcmp(channel, "PLIANT_LOOK_one") == 0 ? 1
                                                                : 2;
    heard->looks[which]++;
    assert_int_equal(look.chunk_count, 1);
    assert_int_equal(look.num_values, which == 0 ? 3 * look.node_count : 0);
    if (which == 0)
        heard->topology = look.topology;
    pliant_look_t_decode_cleanup(&look);
}

static void hear(Heard *heard)
{
    *heard = (Heard){.lcm = lcm_create(NULL)};
    assert_non_null(heard->lcm);
    lcm_subscribe(heard->lcm, "PLIANT_LOOK_.*", on_look, heard);
}

static PliantClient *open_client(void)
{
    PliantError error = {""};
    PliantClient *client = pliant_open(NULL, &error);
    if (!client)
        fail_msg("%s", error.text);
    return client;
}

#define expect_done(client, call)                                                                  \
    do {                                                                                           \
        if (!(call))                                                                               \
            fail_msg("%s: %s", #call, pliant_error(client));                                       \
    } while (0)

// Steps until the newest frame of the block has the look of its own mesh.
static const PliantBody *settled(PliantClient *client, Heard *heard)
{
    const double limit = client_now() + 60.0;
    int fits = 0;
    while (fits < 3 && client_now() < limit) {
        expect_done(client, pliant_command(client, PLIANT_STEP, 10, NULL));
        pliant_wait(client, 0.02);
        while (lcm_handle_timeout(heard->lcm, 0) > 0)
            ;
        const PliantBody *body = pliant_body(client, "block");
        fits = body && body->color && body->topology == heard->topology ? fits + 1 : 0;
    }
    assert_int_equal(fits, 3);
    return pliant_body(client, "block");
}

// True if both have the same live nodes with the same colours; slots may differ.
static bool same_colours(const PliantBody *a, const PliantBody *b)
{
    int nodes = 0, same = 0;
    if (!a->color || !b->color)
        return a->color == b->color;
    for (int i = 0; i < a->node_count; i++) {
        if (a->id[i] < 0)
            continue;
        nodes++;
        for (int k = 0; k < b->node_count; k++)
            same += b->id[k] == a->id[i] && memcmp(a->color + 3 * i, b->color + 3 * k, 3) == 0 &&
                    memcmp(a->inside + 3 * i, b->inside + 3 * k, 3) == 0;
    }
    for (int k = 0; k < b->node_count; k++)
        nodes -= b->id[k] >= 0;
    return nodes == 0 && same > 0;
}

static int different(const PliantBody *body, const uint8_t *colours)
{
    int count = 0;
    for (int i = 1; i < body->node_count; i++)
        count += memcmp(colours + 3 * i, colours, 3) != 0;
    return count;
}

// Plays a recording to its end and expects the colours of the session there.
static void expect_replay(const char *path, const PliantBody *const session[3])
{
    Process play;
    PliantClient *client = open_client();
    process_start(&play, program_path("pliant-play"), "--paused %s", path);
    expect_done(client, pliant_wait_body(client, "block", 60.0));
    expect_done(client, pliant_command(client, PLIANT_SET, 0, "seek=1e9"));
    static const char *const name[3] = {"block", "one", "none"};
    const double limit = client_now() + 60.0;
    int same = 0;
    while (same < 3 && client_now() < limit) {
        pliant_wait(client, 0.05);
        same = 0;
        for (int k = 0; k < 3; k++) {
            const PliantBody *body = pliant_body(client, name[k]);
            same += body && same_colours(session[k], body);
        }
    }
    assert_int_equal(same, 3);
    pliant_close(client);
    process_signal(&play, SIGTERM);
    process_wait(&play);
}

TEST(a_replay_has_the_colours_of_the_session)
{
    Process daemon, recorder;
    Heard heard;
    write_volume("labels.nrrd", false);
    write_volume("image.nrrd", true);
    write_text(scratch("look.cfg"), SCENE);
    PliantClient *client = open_client();
    hear(&heard);
    process_start(&recorder, program_path("pliant-record"), "-o heard.h5");
    daemon_start(&daemon, "--record own.h5 %s", scratch("look.cfg"));
    expect_done(client, pliant_wait_body(client, "block", 60.0));
    // The sidecar is there when the file has begun; what came before is not in it.
    const double limit = client_now() + 60.0;
    while (access(scratch("heard.h5.xdmf"), F_OK) != 0 && client_now() < limit)
        pliant_wait(client, 0.05);
    const PliantBody *whole = pliant_body_keep(settled(client, &heard));
    // Two labels outside, and an image inside.
    assert_in_range(different(whole, whole->color), 50, whole->node_count - 50);
    assert_in_range(different(whole, whole->inside), 50, whole->node_count - 1);
    // A cut adds nodes, whose colours follow.
    static const double before[2][3] = {{0.018, -0.1, -0.1}, {0.018, -0.1, 0.1}};
    static const double after[2][3] = {{0.022, 0.1, -0.1}, {0.022, 0.1, 0.1}};
    const PliantReply *reply;
    expect_done(client, reply = pliant_cut(client, before, after, "block"));
    assert_true(reply->separated > 0 && reply->nodes_added > 0);
    const PliantBody *session[3] = {pliant_body_keep(settled(client, &heard)),
                                    pliant_body_keep(pliant_body(client, "one")),
                                    pliant_body_keep(pliant_body(client, "none"))};
    assert_true(session[0]->topology != whole->topology);
    assert_false(same_colours(session[0], whole));
    // A body of one colour has it everywhere; one without has none, and no message.
    const PliantBody *one = session[1];
    for (int i = 0; i < one->node_count; i++) {
        assert_memory_equal(one->color + 3 * i, "\x00\xff\x00", 3);
        assert_memory_equal(one->inside + 3 * i, "\xff\x00\x00", 3);
    }
    assert_null(session[2]->color);
    assert_true(heard.looks[0] > 1 && heard.looks[1] > 0 && heard.looks[2] == 0);
    pliant_close(client);
    lcm_destroy(heard.lcm);
    process_signal(&recorder, SIGINT);
    process_wait(&recorder);
    process_signal(&daemon, SIGTERM);
    process_wait(&daemon);
    expect_replay("own.h5", session);
    expect_replay("heard.h5", session);
    pliant_body_release(whole);
    for (int k = 0; k < 3; k++)
        pliant_body_release(session[k]);
}
