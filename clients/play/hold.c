// SPDX-License-Identifier: MIT
// Holds the prefix like a server. One thread.
#include "hold.h"

#include "sending.h"
#include "wire.h"

#include "pliant_claim_t.h"
#include "pliant_status_t.h"

#include <stdlib.h>
#include <sys/random.h>

enum { QUEUE = 16 };

static int64_t draw(void)
{
    int64_t number = 0;
    if (getrandom(&number, sizeof number, 0) != sizeof number || number == 0)
        number = client_now_ns();
    return number;
}

static int64_t held_us(const Hold *hold)
{
    return hold->since_ns == 0 ? -1 : (client_now_ns() - hold->since_ns) / 1000;
}

static void publish(const Hold *hold, int64_t question, int64_t answers)
{
    char channel[CLIENT_CHANNEL_MAX];
    const pliant_claim_t claim = {.utime = client_utime(),
                                  .daemon = hold->number,
                                  .question = question,
                                  .answers = answers,
                                  .held = held_us(hold)};
    client_channel(hold->client, "CLAIM", NULL, channel);
    pliant_claim_t_publish(hold->client->lcm, channel, &claim);
}

// At most once per second.
static void ask_rival(Hold *hold)
{
    const int64_t now = client_now_ns();
    if (hold->asked_ns != 0 && now - hold->asked_ns < 1000000000)
        return;
    hold->asked_ns = now;
    hold->question = draw();
    publish(hold, hold->question, 0);
}

static void on_claim(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Hold *hold = user;
    pliant_claim_t claim;
    if (!wire_check(&WIRE_CLAIM, buffer->data, buffer->data_size) ||
        pliant_claim_t_decode(buffer->data, 0, (int)buffer->data_size, &claim) < 0 ||
        claim.daemon == hold->number || claim.held < -1)
        return;
    if (claim.answers != 0 && claim.answers == hold->question) {
        // Before the start any answer decides; later the one that has held it for longer stays.
        hold->question = 0;
        if (hold->since_ns == 0)
            hold->taken = true;
        else if (claim_yields(held_us(hold), hold->number, claim.held, claim.daemon))
            hold->lost = true;
        return;
    }
    if (claim.question == 0 || hold->since_ns == 0)
        return;
    publish(hold, 0, claim.question);
    // A question of one that holds the prefix, too.
    if (claim.held >= 0)
        ask_rival(hold);
}

static void on_status(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Hold *hold = user;
    pliant_status_t status;
    if (!wire_check(&WIRE_STATUS, buffer->data, buffer->data_size) ||
        pliant_status_t_decode(buffer->data, 0, (int)buffer->data_size, &status) < 0)
        return;
    bool ours = false;
    for (int i = 0; i < HOLD_OWN; i++)
        ours = ours || hold->own[i] == status.utime;
    pliant_status_t_decode_cleanup(&status);
    if (hold->since_ns == 0)
        hold->taken = true;
    else if (!ours)
        ask_rival(hold);
}

void hold_note_status(Hold *hold, int64_t utime)
{
    hold->own[hold->statuses++ % HOLD_OWN] = utime;
}

bool hold_take(Hold *hold, Client *client, PliantError *error)
{
    *hold = (Hold){.client = client, .number = draw(), .question = draw()};
    if (!client_subscribe(client, "CLAIM", NULL, QUEUE, on_claim, hold) ||
        !client_subscribe(client, "STATUS", NULL, QUEUE, on_status, hold))
        return client_fail(error, "LCM refuses to subscribe to %s_CLAIM", client->prefix);
    // Ask a few times: a question may be lost.
    const int64_t end = client_now_ns() + CLAIM_WAIT_MS * INT64_C(1000000);
    for (int64_t now = client_now_ns(); now < end && !hold->taken; now = client_now_ns()) {
        publish(hold, hold->question, 0);
        if (!client_wait(client, now + CLAIM_ASK_AGAIN_MS * INT64_C(1000000), &hold->taken))
            return client_fail(error, client->broken ? "the LCM connection failed" : "interrupted");
    }
    if (hold->taken)
        return client_fail(error,
                           "a server publishes on %s_STATUS: give this player another --prefix",
                           client->prefix);
    hold->question = 0;
    hold->since_ns = client_now_ns();
    return true;
}
