// SPDX-License-Identifier: MIT
// Requests of libpliant-client that are not waited for: each is sent when it can be, repeated with
// its number and time until it is answered, and given up after the last try.
#include "kit.h"

#include "wire.h"

#include "base/arguments.h"

#include <stdio.h>
#include <string.h>

static void answer(PliantClient *kit, KitPending *pending, const pliant_reply_t *reply)
{
    KitAnswer *to = &kit->answer[kit->answer_end++ % KIT_PENDING];
    *to = (KitAnswer){.answer = {.request = pending->cut.id, .sent = pending->sent}};
    if (reply)
        to->reply = pliant_reply_t_copy(reply);
    if (to->reply) {
        to->answer.answered = true;
        to->answer.done = reply->ok;
        to->answer.seconds = 1e-9 * (double)(client_now_ns() - pending->first_ns);
        to->answer.reply = (PliantReply){.step = reply->step,
                                         .separated = reply->separated,
                                         .nodes_added = reply->nodes_added,
                                         .pieces = reply->pieces,
                                         .text = to->reply->text};
    }
    pending->used = false;
    kit->in_progress--;
    kit->news++;
}

static void on_reply(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    PliantClient *kit = user;
    pliant_reply_t reply;
    if (!wire_check(&WIRE_REPLY, buffer->data, buffer->data_size) ||
        pliant_reply_t_decode(buffer->data, 0, (int)buffer->data_size, &reply) < 0)
        return;
    // To one of ours, however late.
    for (int k = 0; k < KIT_PENDING && reply.sender == kit->client.sender; k++) {
        KitPending *pending = &kit->pending[k];
        if (pending->used && pending->sent > 0 && pending->cut.id == reply.id)
            answer(kit, pending, &reply);
    }
    pliant_reply_t_decode_cleanup(&reply);
}

int32_t pliant_cut_begin(PliantClient *kit, const double before[2][3], const double after[2][3],
                         const char *body)
{
    enum { REPLIES = 256 };
    const char *name = body ? body : "";
    if (strlen(name) > ARGUMENT_NAME_MOST)
        return client_fail(&kit->error, "body '%.64s': a name has at most %d characters", name,
                           ARGUMENT_NAME_MOST);
    if (!pliant_bound(kit))
        return 0;
    if (kit->in_progress + (int)(kit->answer_end - kit->answer_first) >= KIT_PENDING)
        return client_fail(&kit->error, "%d requests lack their answer, or were not taken",
                           KIT_PENDING);
    if (!kit->hears_replies)
        kit->hears_replies =
            client_subscribe(&kit->client, "REPLY", NULL, REPLIES, on_reply, kit) != NULL;
    if (!kit->hears_replies)
        return client_fail(&kit->error, "LCM refuses to subscribe to %s_REPLY", kit->client.prefix);
    KitPending *pending = kit->pending;
    while (pending->used)
        pending++;
    *pending = (KitPending){.used = true,
                            .cut = {.utime = client_utime(),
                                    .sender = kit->client.sender,
                                    .id = ++kit->client.last_id}};
    snprintf(pending->body, sizeof pending->body, "%s", name);
    pending->cut.body = pending->body;
    memcpy(pending->cut.before, before, sizeof pending->cut.before);
    memcpy(pending->cut.after, after, sizeof pending->cut.after);
    kit->in_progress++;
    kit_pending_turn(kit, client_now_ns());
    return pending->cut.id;
}

static void send_cut(PliantClient *kit, KitPending *pending)
{
    char channel[CLIENT_CHANNEL_MAX];
    kit_input_channel(kit, "CUT", channel);
    pliant_cut_t_publish(kit->client.lcm, channel, &pending->cut);
    if (pending->sent++ == 0)
        pending->first_ns = client_now_ns();
    pending->waits = false;
}

int64_t kit_pending_turn(PliantClient *kit, int64_t now)
{
    enum { SECOND_NS = 1000000000, SOON_NS = 20000000 };
    int64_t next = now + SECOND_NS;
    for (int k = 0; k < KIT_PENDING && kit->in_progress > 0; k++) {
        KitPending *pending = &kit->pending[k];
        // No answer in time: once more, or give up.
        if (pending->used && pending->again_ns <= now) {
            if (pending->tries >= kit->tries) {
                answer(kit, pending, NULL);
                continue;
            }
            pending->tries++;
            pending->waits = true;
            pending->again_ns = now + (int64_t)(kit->try_s * 1e9);
        }
        if (pending->used && pending->waits) {
            if (kit_may_send(kit))
                send_cut(kit, pending);
            else if (now + SOON_NS < next)
                next = now + SOON_NS;
        }
        if (pending->used && pending->again_ns < next)
            next = pending->again_ns;
    }
    return next;
}

int pliant_in_progress(const PliantClient *kit)
{
    return kit->in_progress;
}

static void drop(KitAnswer *taken)
{
    if (taken->reply)
        pliant_reply_t_destroy(taken->reply);
    taken->reply = NULL;
}

const PliantAnswer *pliant_next_answer(PliantClient *kit)
{
    if (kit->answer_first == kit->answer_end)
        return NULL;
    drop(&kit->answer_taken);
    kit->answer_taken = kit->answer[kit->answer_first++ % KIT_PENDING];
    return &kit->answer_taken.answer;
}

void kit_pending_destroy(PliantClient *kit)
{
    while (kit->answer_first != kit->answer_end)
        drop(&kit->answer[kit->answer_first++ % KIT_PENDING]);
    drop(&kit->answer_taken);
}
