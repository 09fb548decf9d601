// SPDX-License-Identifier: MIT
// Raw datagrams against the running programs: a million random and made-up ones, whole messages and
// fragments, to the group and to the port. Afterwards the server answers, pages are served, the
// recording is whole, and none of them has grown.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "figure.h"
#include "packet.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <time.h>

#define GROUP "239.255.76.67"

enum { SERVER, WEB, RECORD, MONITOR, PROGRAMS, FEW = 30000 };
static const char *const NAME[PROGRAMS] = {"pliantd", "pliant-web", "pliant-record",
                                           "pliant-monitor"};

// --- packets ---

static uint64_t random_state = 1;

static uint32_t draw(uint32_t below)
{
    random_state ^= random_state >> 12;
    random_state ^= random_state << 25;
    random_state ^= random_state >> 27;
    return (uint32_t)(random_state * UINT64_C(2685821657736338717) >> 32) % below;
}

static const char *draw_channel(void)
{
    static const char *const CHANNELS[] = {
        "PLIANT_TOOL_POSE",    "PLIANT_CUT",         "PLIANT_LOAD",         "PLIANT_COMMAND",
        "PLIANT_CLAIM",        "PLIANT_STATUS",      "PLIANT_REPLY",        "PLIANT_EVENT",
        "PLIANT_TIE",          "PLIANT_MESH_sphere", "PLIANT_NODES_sphere", "PLIANT_MESH_DELTA_x",
        "PLIANT_REST_another", "PLIANT_NODES_",      "LCM_SELF_TEST",       ""};
    static char channel[256];
    uint32_t kind = draw(20);
    if (kind < 16)
        return CHANNELS[kind];
    size_t length = kind < 18 ? 62 + draw(4) : draw(200);
    for (size_t i = 0; i < length; i++)
        channel[i] = (char)(1 + draw(255));
    channel[length] = '\0';
    return channel;
}

static size_t fill(unsigned char *at, size_t size)
{
    for (size_t i = 0; i < size; i++)
        at[i] = (unsigned char)draw(256);
    return size;
}

static uint32_t draw_number(void)
{
    static const uint32_t EDGES[] = {0,          1,          16,
                                     100,        65535,      65536,
                                     0x10000000, 1u << 28,   (1u << 28) + 1,
                                     0x7fffffff, 0x80000000, 0xffffffff,
                                     0xfffffe00, 0xfffffff0};
    return draw(2) ? EDGES[draw(sizeof EDGES / sizeof *EDGES)] : draw(UINT32_MAX);
}

// Of liblcm: the sum of offset and size wraps around, and 512 bytes are copied 4 GB further on.
static size_t make_wrapped(unsigned char *packet, const char *channel)
{
    size_t head = packet_fragment(packet, 600, 0xffffff00, 0, 1, channel);
    memset(packet + head, 'x', 546 - head);
    return 546;
}

// 137 bytes that claim 256 MB, which liblcm allocates.
static size_t make_claim(unsigned char *packet, const char *channel)
{
    size_t head = packet_fragment(packet, 1u << 28, 0, 0, 4100, channel);
    size_t size = head < 137 ? 137 : head;
    memset(packet + head, 'x', size - head);
    return size;
}

static size_t make(unsigned char *packet)
{
    static const size_t SIZES[] = {8, 64, 600, 1500};
    size_t most = draw(500) == 0 ? 65000 : SIZES[draw(4)];
    size_t size = draw((uint32_t)most + 1);
    switch (draw(8)) {
    case 0:
        return fill(packet, size);
    case 1: // a head of LCM's and no more
        packet_fragment(packet, draw_number(), 0, 0, 0, NULL);
        packet[3] = (unsigned char)(draw(2) ? '2' : '3');
        return draw(21);
    case 2: // a channel without end
        size = packet_whole(packet, "", "", 0);
        memset(packet + 8, 'P', 200);
        return 8 + draw(200);
    case 3:
        return make_wrapped(packet, draw_channel());
    case 4:
        return make_claim(packet, draw_channel());
    case 5:
    case 6:
        size = packet_fragment(packet, draw_number(), draw_number(), (uint16_t)draw(3),
                               (uint16_t)draw_number(), draw(4) ? draw_channel() : NULL);
        return size + fill(packet + size, draw((uint32_t)most + 1));
    default: {
        static unsigned char data[PACKET_MOST];
        const char *channel = draw_channel();
        fill(data, size);
        size = size > PACKET_MOST - 300 ? PACKET_MOST - 300 : size;
        return packet_whole(packet, channel, data, size);
    }
    }
}

// --- programs ---

// Largest memory so far [kB]: of the process, and of what it allocated.
static void memory_of(const Process *program, long kb[2])
{
    char name[64], line[256];
    snprintf(name, sizeof name, "/proc/%d/status", (int)program->pid);
    FILE *file = fopen(name, "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file) != NULL) {
        sscanf(line, "VmHWM: %ld", &kb[0]);
        sscanf(line, "VmPeak: %ld", &kb[1]);
    }
    fclose(file);
}

static void expect_running(Process *program, int kind, long sent)
{
    char name[64], state = 'Z';
    snprintf(name, sizeof name, "/proc/%d/stat", (int)program->pid);
    FILE *file = fopen(name, "r");
    if (file != NULL) {
        if (fscanf(file, "%*d (%*[^)]) %c", &state) != 1)
            state = '?';
        fclose(file);
    }
    if (state == 'Z') {
        process_wait(program);
        fail_msg("%s ended with %d after %ld datagrams: %s", NAME[kind], program->code, sent,
                 program->err);
    }
}

static void start_all(Process program[PROGRAMS])
{
    static const char HEAD[] =
        "rate_hz = 500.0; publish = { nodes_hz = 20.0; contact_hz = 100.0; status_hz = 10.0; };";
    daemon_start(&program[SERVER], "%s", write_scene("datagrams.cfg", HEAD, PROBE_TOOL));
    process_start(&program[WEB], program_path(NAME[WEB]), "--port 0");
    process_start(&program[RECORD], program_path(NAME[RECORD]), "-o %s", scratch("datagrams.h5"));
    process_start(&program[MONITOR], program_path(NAME[MONITOR]), "--duration 10000");
    Client *client = client_create();
    client_wait_for_daemon(client);
    // Pages and recordings begin when the whole mesh has come.
    struct stat facts;
    wait_until(client, client->mesh.whole > 1 && stat(scratch("datagrams.h5"), &facts) == 0);
    client_destroy(client); // it has liblcm inside
}

// The line that pliant-web began with names its port.
static void expect_page(const Process *web)
{
    char text[512] = "", answer[64] = "";
    int port = 0;
    FILE *out = fopen(process_output(web), "r");
    assert_non_null(out);
    size_t size = fread(text, 1, sizeof text - 1, out);
    text[size] = '\0';
    fclose(out);
    const char *at = strstr(text, "http://127.0.0.1:");
    assert_non_null(at);
    assert_int_equal(sscanf(at, "http://127.0.0.1:%d", &port), 1);
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    assert_int_equal(connect(fd, (const struct sockaddr *)&to, sizeof to), 0);
    static const char REQUEST[] = "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n";
    assert_int_equal(write(fd, REQUEST, sizeof REQUEST - 1), sizeof REQUEST - 1);
    assert_true(read(fd, answer, sizeof answer - 1) > 0);
    expect_in(answer, "HTTP/1.1 ");
    close(fd);
}

static void end_all(Process program[PROGRAMS])
{
    for (int k = PROGRAMS - 1; k >= 0; k--) {
        process_finish(&program[k], SIGTERM);
        if (program[k].code != 0)
            fail_msg("%s ended with %d: %s", NAME[k], program[k].code, program[k].err);
    }
}

static void pour(int fd, long count, Process program[PROGRAMS])
{
    static unsigned char packet[2 * 65536];
    const struct timespec pause = {.tv_nsec = 1000000};
    static const char *const CHANNELS[] = {"PLIANT_COMMAND", "PLIANT_STATUS"};
    for (int k = 0; k < 2; k++) { // both at first, so that each is seen
        packet_send(fd, GROUP, packet, make_claim(packet, CHANNELS[k]));
        packet_send(fd, GROUP, packet, make_wrapped(packet, CHANNELS[k]));
    }
    for (long n = 0; n < count; n++) {
        size_t size = make(packet);
        packet_send(fd, draw(16) ? GROUP : "127.0.0.1", packet, size);
        if (n % 64 == 0) // a kernel buffer holds some two hundred
            nanosleep(&pause, NULL);
        if (n % 10000 == 0)
            for (int k = 0; k < PROGRAMS; k++)
                expect_running(&program[k], k, n);
    }
}

TEST(every_program_outlives_a_million_hostile_datagrams)
{
    Process program[PROGRAMS];
    long before[PROGRAMS][2], after[PROGRAMS][2];
    const char *wanted = getenv("PLIANT_DATAGRAMS");
    long count = wanted != NULL ? atol(wanted) : FEW;
    start_all(program);
    for (int k = 0; k < PROGRAMS; k++)
        memory_of(&program[k], before[k]);
    int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    assert_true(fd >= 0);
    double start = client_now();
    pour(fd, count, program);
    double seconds = client_now() - start;
    close(fd);
    Client *client = client_create();
    int asked = insist(client, NULL, PLIANT_COMMAND_T_DESCRIBE, 0, "");
    wait_until(client, refused(client, "not_a_packet") > count / 100 &&
                           refused(client, "fragment") > count / 100);
    int64_t step = client->status.step;
    wait_until(client, client->status.step > step + 50);
    expect_page(&program[WEB]);
    for (int k = 0; k < PROGRAMS; k++) {
        expect_running(&program[k], k, count);
        memory_of(&program[k], after[k]);
        figure("%ld datagrams in %.0f s, %s: at most %ld kB of memory, %ld kB before them", count,
               seconds, NAME[k], after[k][0], before[k][0]);
#ifndef __SANITIZE_ADDRESS__
        // The server has locked all it needs; clients may still receive their first large frame,
        // and a thread of civetweb its first request. A claimed message would be 256 MB.
        expect_at_most((double)(after[k][0] - before[k][0]), 32768.0);
        expect_at_most((double)(after[k][1] - before[k][1]), 131072.0);
#endif
    }
    figure("a polite request answered after %d tries", asked);
    client_destroy(client);
    end_all(program);
    struct stat facts;
    assert_int_equal(stat(scratch("datagrams.h5"), &facts), 0);
    expect_at_least((double)facts.st_size, 10000.0);
}
