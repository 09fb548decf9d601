// SPDX-License-Identifier: MIT
// One raw message on a channel that the daemon listens to, through the border check: the first byte
// says which channel; from 64 on the right fingerprint is put in front of the rest. What is let in
// survives being logged, to the last bit.
#include "fuzz.h"

#include "run/input.h"
#include "world.h"

enum { MESSAGE_MOST = 1024 };

static void put_fingerprint(InputKind kind, unsigned char at[8])
{
    unsigned char empty[INPUT_WIRE_MAX];
    input_encode(&(Input){.kind = kind}, empty);
    memcpy(at, empty, 8);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
    static FuzzWorld *world; // nothing in it changes
    if (world == NULL)
        world = fuzz_world();
    InputKind kind = (InputKind)(data[0] % INPUT_KINDS);
    unsigned char message[MESSAGE_MOST];
    size_t head = data[0] >= 64 ? 8 : 0;
    size = size - 1 < MESSAGE_MOST - head ? size - 1 : MESSAGE_MOST - head;
    put_fingerprint(kind, message);
    memcpy(message + head, data + 1, size);

    Input input;
    char why[INPUT_WHY_MAX] = "";
    Refusal refusal = input_decode(kind, message, head + size, &input, why);
    if (refusal == ACCEPTED)
        refusal = input_check(&input, world->world.sim, why);
    fuzz_print(refusal == ACCEPTED ? "accepted" : why);
    MUST(refusal_name(refusal)[0] != '\0');
    MUST((refusal == ACCEPTED) == (why[0] == '\0'));
    MUST(memchr(why, 0, sizeof why) != NULL);
    if (refusal != ACCEPTED)
        return 0;

    unsigned char wire[INPUT_WIRE_MAX], again[INPUT_WIRE_MAX];
    Input read;
    size_t length = input_encode(&input, wire);
    MUST(input_decode(kind, wire, length, &read, why) == ACCEPTED);
    MUST(input_check(&read, world->world.sim, why) == ACCEPTED);
    MUST(input_encode(&read, again) == length && memcmp(wire, again, length) == 0);
    return 0;
}
