// A request as a client sends it that counts on loss: the same one again every 50 ms, until it is
// answered.
#ifndef PLIANT_TESTS_FAULT_INJECTION_ASK_H
#define PLIANT_TESTS_FAULT_INJECTION_ASK_H

#include "lcm_client.h"

// How often it was sent; the reply is that to client->next_id. `also` (may be NULL) is listened to
// meanwhile. Fails the test after a minute.
int ask(Client *client, Client *also, int kind, int64_t value, const char *argument);

#endif
