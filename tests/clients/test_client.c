// SPDX-License-Identifier: MIT
// What every client shares, as far as it needs no network.
#include "kit.h"
#include "program.h"
#include "test.h"

#include "pliant_lcmtypes.h"

TEST(the_url_is_the_option_else_the_environment_else_lcms_own)
{
    static const struct {
        const char *url, *fallback, *expected;
        int ttl, bytes;
    } cases[] = {
        {NULL, NULL, "udpm://239.255.76.67:7667?ttl=0", 0, 0},
        {NULL, "", "udpm://239.255.76.67:7667?ttl=0", 0, 0},
        {NULL, "udpm://239.1.1.1:9000?ttl=2", "udpm://239.1.1.1:9000?ttl=2", 2, 0},
        {"udpm://?ttl=1", "udpm://239.1.1.1:9000", "udpm://?ttl=1", 1, 0},
        {"udpm://?recv_buf_size=5&ttl=300", NULL, "udpm://?recv_buf_size=5&ttl=300", 255, 5},
        {"tcpq://localhost:7700", NULL, "tcpq://localhost:7700", 0, 0},
    };
    char why[RECEIVER_WHY_MAX];
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        Network network;
        if (cases[k].fallback)
            setenv("LCM_DEFAULT_URL", cases[k].fallback, 1);
        else
            unsetenv("LCM_DEFAULT_URL");
        assert_true(network_read(&network, cases[k].url, why));
        assert_string_equal(network.url, cases[k].expected);
        assert_int_equal(network.ttl, cases[k].ttl);
        assert_int_equal(network.receive_bytes, cases[k].bytes);
    }
    unsetenv("LCM_DEFAULT_URL");
}

TEST(an_interface_of_the_url_is_a_name_or_an_address)
{
    char why[RECEIVER_WHY_MAX];
    Network network;
    assert_true(network_read(&network, "udpm://239.1.1.1:9000?interface=lo&ttl=1", why));
    assert_string_equal(network.interface, "lo");
    assert_true(network_read(&network, "udpm://239.1.1.1:9000?ttl=1&interface=10.0.0.7", why));
    assert_string_equal(network.interface, "10.0.0.7");
    assert_false(network_read(&network, "udpm://239.1.1.1:9000?interface=&ttl=1", why));
    expect_in(why, "a name or an address");
    assert_false(network_read(
        &network, "udpm://239.1.1.1:9000?interface=a-name-that-no-interface-can-have", why));
}

TEST(url_that_does_not_fit_is_refused)
{
    char url[300] = "udpm://", why[RECEIVER_WHY_MAX];
    Network network;
    memset(url + 7, '1', sizeof url - 8);
    assert_false(network_read(&network, url, why));
}

TEST(addresses_that_are_no_multicast_group_are_refused_with_the_form_wanted)
{
    static const char *const urls[] = {"udpm://127.0.0.1:7667", "udpm://nonsense:1",
                                       "udpm://239.255.76.67:70000", "udpm://239.255.76.67:x"};
    for (size_t k = 0; k < sizeof urls / sizeof urls[0]; k++) {
        Client client;
        PliantError error;
        PliantOptions options = {.url = urls[k]};
        assert_false(client_connect(&client, &options, &error));
        expect_in(error.text, "udpm://GROUP:PORT");
    }
}

TEST(channels_name_prefix_message_and_body)
{
    Client client = {.prefix = "LAB"};
    char channel[CLIENT_CHANNEL_MAX];
    client_channel(&client, "NODES", "liver", channel);
    assert_string_equal(channel, "LAB_NODES_liver");
    client_channel(&client, "STATUS", NULL, channel);
    assert_string_equal(channel, "LAB_STATUS");
    assert_string_equal(client_body_of(&client, "NODES", "LAB_NODES_liver"), "liver");
    assert_null(client_body_of(&client, "NODES", "LAB_NODES_"));
    assert_null(client_body_of(&client, "NODES", "LAB_MESH_liver"));
    assert_string_equal(client_nodes_body(&client, "LAB_NODES_liver"), "liver");
    assert_string_equal(client_nodes_body(&client, "LAB_POINTS_liver"), "liver");
    assert_null(client_nodes_body(&client, "LAB_MESH_liver"));
}

TEST(a_server_of_another_version_is_not_taken_for_none)
{
    Client client = {.prefix = "LAB"};
    char text[256];
    assert_false(client_tell_foreign(&client, text, sizeof text));
    // A status of a type that this program does not know,
    const unsigned char status[64] = {1, 2, 3, 4, 5, 6, 7, 8};
    client_note(&client, "LAB_STATUS", status, sizeof status);
    client_note(&client, "LAB_STATUS", status, 7); // no message at all
    assert_int_equal(client.foreign, 1);
    assert_true(client_tell_foreign(&client, text, sizeof text));
    assert_string_equal(text, "a server on LAB speaks another status_t than this program: update "
                              "the older of the two");
    // and who sent it.
    char program[] = "pliantd", version[] = "9.1.0", none[] = "";
    const pliant_hello_t hello = {.program = program,
                                  .version = version,
                                  .types = PLIANT_LCMTYPES_COUNT + 1,
                                  .prefix = none,
                                  .input_prefix = none};
    unsigned char data[128];
    const int size = pliant_hello_t_encode(data, 0, sizeof data, &hello);
    client_note(&client, "LAB_HELLO", data, (size_t)size);
    assert_true(client_tell_foreign(&client, text, sizeof text));
    assert_string_equal(text, "pliantd 9.1.0 on LAB speaks a newer status_t than this program: "
                              "update the program");
    assert_int_equal(client.foreign, 1);
}

// memq keeps only what somebody has subscribed to.
static void on_nothing(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)buffer;
    (void)channel;
    (void)user;
}

TEST(a_server_is_heard_by_contact_or_status_alone)
{
    PliantError error;
    PliantClient *client = pliant_open(&(const PliantOptions){.url = "memq://"}, &error);
    assert_non_null(client);
    lcm_subscribe(client->client.lcm, ".*", on_nothing, NULL);
    static const struct {
        const char *channel;
        bool heard;
    } cases[] = {{"PLIANT_STATUS", true},
                 {"PLIANT_NODES_liver", false},
                 {"OTHER_STATUS", false},
                 {"PLIANT_CONTACT", true}};
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        lcm_publish(client->client.lcm, cases[k].channel, "x", 1);
        assert_int_equal(pliant_wait_server(client, 0.01), cases[k].heard);
        const double start = pliant_now();
        assert_false(pliant_wait_server(client, 0.01)); // what was before does not count
        assert_non_null(
            strstr(pliant_error(client), "no message on PLIANT_CONTACT and PLIANT_STATUS"));
        assert_true(pliant_now() - start >= 0.01);
    }
    pliant_close(client);
}

TEST(who_waits_for_a_status_of_another_version_is_told_so)
{
    PliantError error;
    PliantClient *client = pliant_open(&(const PliantOptions){.url = "memq://"}, &error);
    assert_non_null(client);
    lcm_subscribe(client->client.lcm, ".*", on_nothing, NULL);
    assert_null(pliant_refusal(client));
    const unsigned char status[64] = {1, 2, 3, 4, 5, 6, 7, 8};
    lcm_publish(client->client.lcm, "PLIANT_STATUS", status, sizeof status);
    assert_null(pliant_wait_status(client, 0.01));
    expect_in(pliant_error(client), "speaks another status_t");
    expect_in(pliant_refusal(client), "speaks another status_t");
    pliant_close(client);
}

TEST(a_wait_ends_when_it_is_stopped_and_so_does_each_later_one)
{
    PliantError error;
    PliantClient *client = pliant_open(&(const PliantOptions){.url = "memq://"}, &error);
    assert_non_null(client);
    assert_true(pliant_wait(client, 0.0));
    pliant_stop(client);
    const double start = pliant_now();
    for (int k = 0; k < 2; k++) {
        assert_false(pliant_wait(client, 600.0));
        assert_string_equal(pliant_error(client), "interrupted");
        assert_int_equal(pliant_wait_next(client, 600.0), -1);
        assert_null(pliant_describe(client));
    }
    assert_true(pliant_now() - start < 60.0); // at once, on whatever machine
    pliant_close(client);
}

TEST(text_from_the_network_cannot_steer_the_terminal)
{
    FREED char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    program_print_text(out,
                       "a\033[2Jb\nc\x7f\xc2\x9b"
                       "d \xc3\xb6",
                       false);
    fclose(out);
    assert_string_equal(text, "a?[2Jb?c??\x9b"
                              "d \xc3\xb6");
}
