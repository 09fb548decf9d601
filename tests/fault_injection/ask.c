#include "ask.h"

int ask(Client *client, Client *also, int kind, int64_t value, const char *argument)
{
    pliant_command_t m = {.sender = client->sender,
                          .id = ++client->next_id,
                          .kind = kind,
                          .value = value,
                          .argument = (char *)(uintptr_t)argument};
    for (int sent = 1; sent < 1200; sent++) {
        assert_int_equal(pliant_command_t_publish(client->lcm, "PLIANT_COMMAND", &m), 0);
        for (double next = client_now() + 0.05; client_now() < next;) {
            client_listen(client, 5);
            if (also != NULL)
                client_listen(also, 0);
            const Reply *reply = find_reply(client, m.id);
            if (reply != NULL && reply->ok)
                return sent;
        }
    }
    fail_msg("no answer to command %d in a minute", kind);
    return 0;
}
