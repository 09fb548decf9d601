// SPDX-License-Identifier: MIT
// Who may send what: other hosts are refused unless the scene hears them, what is sent to the port
// alone never arrives, forged addresses do not help, STOP can be switched off, and no claim ends a
// daemon by its numbers.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "hosts.h"
#include "packet.h"
#include "receiver.h"

#include "pliant_claim_t.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#define GROUP "239.255.76.67"

static const char RATES[] = "rate_hz = 200.0; publish = { nodes_hz = 10.0; status_hz = 20.0; };";

typedef struct Rig {
    Process daemon;
    Client *near, *far; // beside the daemon, on the other host
    int sent;           // by send_until_refused
} Rig;

static Rig begin(const char *keys, const char *options)
{
    char head[256];
    Rig rig = {.sent = 0};
    snprintf(head, sizeof head, "%s %s", RATES, keys);
    rig.near = client_create();
    hosts_enter(HOST_CLIENT);
    rig.far = client_create();
    hosts_enter(HOST_SERVER);
    daemon_start(&rig.daemon, "%s %s", options, write_scene("border.cfg", head, PROBE_TOOL));
    client_wait_for_daemon(rig.near);
    client_wait_for_daemon(rig.far); // what it publishes leaves the host
    return rig;
}

static void end_clients(Rig *rig)
{
    client_destroy(rig->near);
    client_destroy(rig->far);
}

// It steps on, hears those beside it, and ends by a signal.
static void expect_unmoved(Rig *rig)
{
    int64_t step = rig->near->status.step;
    wait_until(rig->near, rig->near->status.step > step + 20);
    assert_true(command(rig->near, PLIANT_COMMAND_T_PAUSE, 0, "")->ok);
    process_end(&rig->daemon);
    end_clients(rig);
}

// Sends until one more is refused for that reason: a packet may get lost, or be counted twice when
// the daemon asks twice.
#define send_until_refused(rig, reason, send)                                                      \
    do {                                                                                           \
        const int64_t before_ = refused((rig)->near, reason);                                      \
        const double end_ = client_now() + 60.0;                                                   \
        while (refused((rig)->near, reason) <= before_ && client_now() < end_) {                   \
            send;                                                                                  \
            (rig)->sent++;                                                                         \
            client_listen((rig)->near, 100);                                                       \
        }                                                                                          \
        assert_true(refused((rig)->near, reason) > before_);                                       \
    } while (0)

// --- other hosts ---

AROUND_ALL(hosts_begin, hosts_end)

TEST(another_host_is_refused_and_counted)
{
    Rig rig = begin("", "");
    const double top[3] = {0.0, 0.0, 0.05}, push[3] = {0.0, 0.0, -1.0};
    pliant_tool_pose_t pose = make_pose(rig.far, top);
    const pliant_tie_t tie = make_tie(rig.far, PLIANT_TIE_T_PIN, top, 0.03, "");
    send_until_refused(&rig, "other_host", send_pose(rig.far, &pose));
    send_until_refused(&rig, "other_host", send_load(rig.far, top, 0.03, push, 10.0, ""));
    send_until_refused(&rig, "other_host", send_command(rig.far, PLIANT_COMMAND_T_STOP, 0, ""));
    send_until_refused(&rig, "other_host", pliant_tie_t_publish(rig.far->lcm, "PLIANT_TIE", &tie));
    wait_until(rig.near, saw_event(rig.near, "refused"));
    client_fresh_status(rig.near); // each of them is counted once
    assert_int_equal(refused(rig.near, "other_host"), rig.sent);
    assert_int_equal(rig.far->replies, 0);
    expect_unmoved(&rig);
    expect_in(rig.daemon.out, "other_host");
}

// What a user at the other host is told, in place of a bare time-out.
TEST(a_client_on_another_host_says_what_permits_it)
{
    static Process run;
    Rig rig = begin("max_ties = 4;", "");
    hosts_enter(HOST_CLIENT);
    process_run(&run, program_path("pliant-tie"), "--make pin --at 0,0,0.05 --radius 0.02");
    hosts_enter(HOST_SERVER);
    expect_ended(&run, 1, "messages of other hosts");
    expect_in(run.err, "remote = true in the scene, or pliantd --remote");
    // Beside it the same is done.
    process_run(&run, program_path("pliant-tie"), "--make pin --at 0,0,0.05 --radius 0.02");
    assert_string_equal(run.err, "");
    assert_int_equal(run.code, 0);
    expect_unmoved(&rig);
}

// By their prefixes, with what they publish, also from another host.
TEST(every_server_on_the_network_is_listed)
{
    static Process run, other;
    Rig rig = begin("", "");
    daemon_start(&other, "--prefix SECOND %s",
                 write_scene("second.cfg", "rate_hz = 100.0;", PROBE_TOOL));
    hosts_enter(HOST_CLIENT);
    process_run(&run, program_path("pliant-monitor"), "--list");
    assert_string_equal(run.err, "");
    assert_int_equal(run.code, 0);
    const char *first = strstr(run.out, "PLIANT "), *second = strstr(run.out, "\nSECOND ");
    assert_non_null(first);
    assert_non_null(second);
    assert_true(first == run.out);
    expect_in(first, "  running  200 Hz");
    expect_in(second, "  running  100 Hz");
    hosts_enter(HOST_SERVER);
    process_end(&other);
    expect_unmoved(&rig);
    process_run(&run, program_path("pliant-monitor"), "--list --duration 0.5");
    expect_ended(&run, 1, "no server was heard within 0.5 s");
}

TEST(a_scene_or_an_option_hears_all_hosts)
{
    static const char *const CASES[][2] = {{"remote = true;", ""}, {"", "--remote"}};
    for (int k = 0; k < 2; k++) {
        Rig rig = begin(CASES[k][0], CASES[k][1]);
        assert_true(command(rig.far, PLIANT_COMMAND_T_STOP, 0, "")->ok);
        process_wait(&rig.daemon);
        assert_int_equal(rig.daemon.code, 0);
        end_clients(&rig);
    }
}

// --- to the port alone ---

TEST(a_packet_for_the_port_alone_never_arrives)
{
    Rig rig = begin("remote = true;", "");
    unsigned char packet[512];
    for (int k = 0; k < 2; k++) {
        hosts_enter((Host)k);
        int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        hosts_enter(HOST_SERVER);
        assert_true(fd >= 0);
        size_t size = packet_stop(packet, 90);
        for (int i = 0; i < 10; i++)
            packet_send(fd, "10.77.0.1", packet, size);
        if (k == HOST_SERVER)
            packet_send(fd, "127.0.0.1", packet, size);
        close(fd);
    }
    expect_unmoved(&rig);
}

// --- forged addresses ---

static void forge(Client *client, const char *source)
{
    unsigned char packet[512] = {0x45, 0, 0, 0, 0, 1, 0, 0, 8, 17};
    size_t size = packet_stop(packet + 28, 91);
    const uint16_t total = htons((uint16_t)(28 + size)), port = htons(PACKET_PORT),
                   length = htons((uint16_t)(8 + size));
    memcpy(packet + 2, &total, 2);
    inet_pton(AF_INET, source, packet + 12);
    inet_pton(AF_INET, GROUP, packet + 16);
    memcpy(packet + 20, &port, 2);
    memcpy(packet + 22, &port, 2);
    memcpy(packet + 24, &length, 2); // the checksum behind it: 0, none
    uint32_t sum = 0;
    for (int i = 0; i < 20; i += 2)
        sum += (uint32_t)packet[i] << 8 | packet[i + 1];
    sum = ~(sum % 0xffff);
    packet[10] = (unsigned char)(sum >> 8);
    packet[11] = (unsigned char)sum;
    hosts_forge(HOST_SERVER, packet, 28 + size);
    client_listen(client, 20);
}

// The kernel refuses the host's own addresses from outside; ours refuses the rest.
TEST(a_forged_address_is_no_way_in)
{
    static const char *const OWN[] = {"10.77.0.1", "127.0.0.1", "0.0.0.0", "127.0.0.2"};
    Rig rig = begin("", "");
    // That what is forged here arrives at all.
    send_until_refused(&rig, "other_host", forge(rig.near, "10.77.0.2"));
    for (size_t i = 0; i < sizeof OWN / sizeof *OWN; i++)
        forge(rig.near, OWN[i]);
    expect_unmoved(&rig);
}

// This host's addresses may change while the daemon runs.
TEST(an_address_that_came_later_is_of_this_host)
{
    Rig rig = begin("", "");
    unsigned char packet[512];
    size_t size = packet_stop(packet, 92);
    struct sockaddr_in own = {.sin_family = AF_INET, .sin_addr.s_addr = inet_addr("10.77.0.77")};
    assert_int_equal(system("ip addr add 10.77.0.77/24 dev far0"), 0);
    int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    assert_int_equal(bind(fd, (const struct sockaddr *)&own, sizeof own), 0);
    for (int i = 0; i < 10; i++) { // the first that arrives ends it
        assert_int_equal(packet_send(fd, GROUP, packet, size), 0);
        client_listen(rig.near, 20);
    }
    close(fd);
    process_wait(&rig.daemon);
    assert_int_equal(rig.daemon.code, 0);
    assert_int_equal(system("ip addr del 10.77.0.77/24 dev far0"), 0);
    end_clients(&rig);
}

// A route, but nothing comes back: here because it goes to another port.
TEST(what_does_not_come_back_is_told_in_bounded_time)
{
    Network network;
    const ReceiverOptions options = {.remote = true};
    char why[RECEIVER_WHY_MAX] = "";
    lcm_t *lcm = lcm_create("udpm://" GROUP ":7668?ttl=0");
    assert_non_null(lcm);
    assert_true(network_read(&network, "udpm://" GROUP ":7669?ttl=0", why));
    assert_true(network_has_route(&network, why));
    assert_null(receiver_create(lcm, &network, &options, why)); // ctest's time limit is the bound
    expect_in(why, "does not come back");
    lcm_destroy(lcm);
}

// --- STOP ---

TEST(stop_can_be_switched_off)
{
    static const char *const CASES[][2] = {{"stop_command = false;", ""}, {"", "--no-stop"}};
    for (int k = 0; k < 2; k++) {
        Rig rig = begin(CASES[k][0], CASES[k][1]);
        const Reply *reply = command(rig.near, PLIANT_COMMAND_T_STOP, 0, "");
        assert_false(reply->ok);
        expect_in(reply->text, "switched off");
        wait_until(rig.near, refused(rig.near, "switched_off") > 0);
        expect_unmoved(&rig);
    }
}

// --- claims ---

typedef struct Liar {
    lcm_t *lcm;
    int64_t held;
    int answered;
} Liar;

HANDLER(on_question, pliant_claim_t, claim)
{
    Liar *liar = user;
    if (claim->question == 0 || claim->daemon == 7)
        return;
    const pliant_claim_t answer = {.daemon = 7, .answers = claim->question, .held = liar->held};
    pliant_claim_t_publish(liar->lcm, "PLIANT_CLAIM", &answer);
    liar->answered++;
}

// A foreign status makes the daemon ask who that is; the liar answers. What is meant for another
// daemon's question would not count.
static void lie(Client *from, int64_t held)
{
    Liar liar = {.lcm = from->lcm, .held = held};
    pliant_claim_t_subscription_t *on =
        pliant_claim_t_subscribe(from->lcm, "PLIANT_CLAIM", on_question, &liar);
    const char status[16] = "12345678abcdefg";
    double end = client_now() + 10.0, next = 0.0;
    while (liar.answered == 0 && client_now() < end) {
        // It comes back to the sender, too: not as fast as it comes, which would drown all else.
        if (client_now() >= next) {
            lcm_publish(from->lcm, "PLIANT_STATUS", status, sizeof status);
            next = client_now() + 0.05;
        }
        client_listen(from, 50);
    }
    assert_true(liar.answered > 0);
    pliant_claim_t_unsubscribe(from->lcm, on);
}

TEST(no_claim_ends_a_daemon_by_its_numbers)
{
    static const int64_t HELD[] = {INT64_C(1) << 62, INT64_MAX, INT64_MIN, -2};
    Rig rig = begin("", "");
    for (int k = 0; k < 4; k++) {
        send_until_refused(&rig, "out_of_range", lie(rig.near, HELD[k]));
    }
    expect_unmoved(&rig);
}

TEST(another_host_claims_in_vain_unless_it_is_heard)
{
    Rig rig = begin("", "");
    const pliant_claim_t question = {.daemon = 7, .question = 5, .held = 60000000};
    send_until_refused(&rig, "other_host",
                       pliant_claim_t_publish(rig.far->lcm, "PLIANT_CLAIM", &question));
    send_until_refused(&rig, "other_host",
                       lcm_publish(rig.far->lcm, "PLIANT_STATUS", "12345678abcdefg", 16));
    expect_unmoved(&rig);
    rig = begin("remote = true;", "");
    send_until_refused(&rig, "out_of_range", lie(rig.far, INT64_C(1) << 62));
    expect_unmoved(&rig);
}

// --- out ---

typedef struct Largest {
    char reply[65536];
    uint32_t size;
} Largest;

static void measure(const lcm_recv_buf_t *message, const char *channel, void *user)
{
    Largest *largest = user;
    if (message->data_size > largest->size)
        largest->size = message->data_size;
    if (strcmp(channel, "PLIANT_REPLY") == 0 && message->data_size <= sizeof largest->reply)
        memcpy(largest->reply, message->data, message->data_size);
}

// As many bodies and tools as a scene may have.
static const char *write_crowded(void)
{
    const char *path = scratch("crowded.cfg");
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file, "rate_hz = 20.0; name = \"crowded\"; bodies = (\n");
    for (int i = 0; i < 64; i++)
        fprintf(
            file,
            "%s{ name = \"body_with_quite_a_long_n%02d\"; mesh = { generator = \"ico_sphere\"; "
            "nodes = 42; radius = 0.01; }; cuttable = true; shape = {}; levels = 1; adapt = {}; "
            "tear = { stretch = 0.5; }; }",
            i > 0 ? ",\n" : "", i);
    fprintf(file, ");\ntools = (\n");
    for (int i = 0; i < 32; i++) {
        fprintf(file, "%s{ id = %d; kind = \"probe\"; capsules = (", i > 0 ? ",\n" : "", i + 1);
        for (int k = 0; k < 8; k++)
            fprintf(file,
                    "%s{ from = [%d.123456, 8.123456, 9.123456]; to = [%d.654321, 8.0, 9.0]; "
                    "radius = 0.00123456; }",
                    k > 0 ? ", " : "", 100 + i, 100 + i);
        fprintf(file, "); }");
    }
    fprintf(file, ");\nattachments = (\n");
    for (int i = 0; i < 64; i++)
        fprintf(file,
                "%s{ body = \"body_with_quite_a_long_n%02d\"; to = \"world\"; "
                "box = ([-1.0, -1.0, -1.0], [1.0, 1.0, 0.0]); }",
                i > 0 ? ",\n" : "", i);
    fprintf(file, ");\n");
    assert_int_equal(fclose(file), 0);
    return path;
}

// So that no client needs fragments.
TEST(no_message_is_longer_than_a_packet)
{
    static Largest largest;
    SCOPED_CLIENT Client *client = client_create();
    lcm_subscription_t *on = lcm_subscribe(client->lcm, "PLIANT_.*", measure, &largest);
    lcm_subscription_set_queue_capacity(on, 4096); // of 64 bodies, else the one answer is displaced
    server_start_for(client, &pliantd, "%s", write_crowded());
    assert_true(command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "")->ok);
    wait_until(client, client->status.count > 2 && largest.size > 45000);
    expect_at_most((double)largest.size, 65499.0); // longer ones liblcm sends in fragments
    char *text = memmem(largest.reply, sizeof largest.reply, "scene crowded", 13);
    assert_non_null(text);
    expect_in(text, "lines more than one message holds ...\n");
    expect_in(text, "units: m, kg");
    lcm_unsubscribe(client->lcm, on);
    process_end(&pliantd);
}
