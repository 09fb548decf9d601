// SPDX-License-Identifier: MIT
// Identifies the daemon that serves. One thread.
#include "client.h"
#include "wire.h"

#include <sys/random.h>

#include "pliant_claim_t.h"

enum {
    SURE_NS = 200000000,  // less than the 250 ms for which a daemon asks before it listens
    AHEAD_NS = 100000000, // asks again so long before the answer expires
};

static void on_claim(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Session *session = user;
    pliant_claim_t claim;
    if (!wire_check(&WIRE_CLAIM, buffer->data, buffer->data_size) ||
        pliant_claim_t_decode(buffer->data, 0, (int)buffer->data_size, &claim) < 0)
        return;
    if (session->question == 0 || claim.answers != session->question || claim.daemon == 0)
        return;
    session->question = 0;
    session->daemon = claim.daemon;
    session->sure_until_ns = session->asked_ns + SURE_NS; // the daemon ran when it was asked
    if (session->change)
        *session->change = true;
}

bool session_open(Session *session, Client *client, bool *change)
{
    *session = (Session){.client = client, .change = change};
    return client_subscribe(client, "CLAIM", NULL, 16, on_claim, session) != NULL;
}

void session_ask(Session *session)
{
    const int64_t now = client_now_ns();
    // A question is open, or the answer is still good for a while.
    const bool open = session->question != 0 && now - session->asked_ns < SURE_NS;
    if (open || session->sure_until_ns - now > AHEAD_NS)
        return;
    // Another number each time, so that an old answer answers nothing.
    int64_t question;
    if (getrandom(&question, sizeof question, 0) != sizeof question || question == 0)
        question = now;
    session->question = question;
    session->asked_ns = now;
    // Ask as a starting daemon does: the running one answers at once and takes us for no rival.
    const pliant_claim_t claim = {.utime = client_utime(),
                                  .daemon = session->client->sender,
                                  .question = question,
                                  .held = -1};
    char channel[CLIENT_CHANNEL_MAX];
    client_channel(session->client, "CLAIM", NULL, channel);
    pliant_claim_t_publish(session->client->lcm, channel, &claim);
}

bool session_is_sure(const Session *session, int64_t now_ns)
{
    return session->daemon != 0 && now_ns < session->sure_until_ns;
}
