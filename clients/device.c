// SPDX-License-Identifier: MIT
#include "device.h"

#include <ctype.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;
static const double AGAIN = 3e-4;   // what comes again comes this much later [s]
static const double ROUNDED = 1e-9; // times are multiples of a tick up to this [s]

// --- options ---

typedef struct Item {
    const char *name, *value; // NULL: takes none
    size_t number[2];         // members that receive the values
    double low, high;         // of the first one
    double every;             // the second one is positive and at most this; 0: there is none
} Item;

#define AT(member) offsetof(DeviceOptions, member)

static const Item ITEMS[] = {
    {"noise", "=S", {AT(noise)}, 0.0, 1.0, 0.0},
    {"quantum", "=S", {AT(quantum)}, 0.0, 1.0, 0.0},
    {"rate", "=HZ", {AT(rate_hz)}, 1.0, 1e4, 0.0},
    {"gap", "=LENGTH/EVERY", {AT(gap_length), AT(gap_every)}, 0.0, 1e4, 1e4},
    {"jitter", "=S", {AT(jitter)}, 0.0, 1.0, 0.0},
    {"late", "=S", {AT(late)}, 0.0, 1.0, 0.0},
    {"loss", "=SHARE", {AT(loss)}, 0.0, 0.99, 0.0},
    {"reorder", "=S", {AT(reorder)}, 0.0, 1.0, 0.0},
    {"duplicate", NULL, {AT(duplicate)}, 0.0, 0.0, 0.0},
    {"wrong", "=D/EVERY", {AT(wrong), AT(wrong_every)}, 0.0, 10.0, 1e4},
    {"seed", "=N", {AT(seed)}, 0.0, 0x1p53, 0.0},
};
enum { ITEM_COUNT = sizeof ITEMS / sizeof *ITEMS, ITEM_TEXT = 64 };

static const Item *find_item(const char *text)
{
    const size_t length = strcspn(text, "=");
    for (int k = 0; k < ITEM_COUNT; k++) {
        if (strlen(ITEMS[k].name) == length && strncmp(ITEMS[k].name, text, length) == 0)
            return &ITEMS[k];
    }
    return NULL;
}

static bool refuse_unknown(const char *text, Status *why)
{
    char known[256] = "";
    for (int k = 0; k < ITEM_COUNT; k++) {
        strcat(known, k > 0 ? ", " : "");
        strcat(known, ITEMS[k].name);
    }
    return status_fail(why, STATUS_INVALID, "has '%s', which is none of %s", text, known);
}

// Reads a number up to the character `end`, and advances past it.
static bool take_number(const char **text, char end, double low, double high, double *number)
{
    char *after;
    *number = strtod(*text, &after);
    const bool ok = after != *text && !isspace((unsigned char)**text) && *number >= low &&
                    *number <= high && *after == end;
    *text = after + 1;
    return ok;
}

static bool read_values(const Item *item, const char *text, DeviceOptions *options)
{
    char *to = (char *)options;
    if (!item->value) {
        *(bool *)(to + item->number[0]) = true;
        return *text == '\0';
    }
    double *first = (double *)(to + item->number[0]), *second = (double *)(to + item->number[1]);
    const bool two = item->every > 0.0;
    return *text++ == '=' && take_number(&text, two ? '/' : '\0', item->low, item->high, first) &&
           (!two || take_number(&text, '\0', 1e-6, item->every, second));
}

static bool read_item(const char *text, DeviceOptions *options, unsigned *given, Status *why)
{
    const Item *item = find_item(text);
    if (!item)
        return refuse_unknown(text, why);
    const unsigned mask = 1u << (item - ITEMS);
    if (*given & mask)
        return status_fail(why, STATUS_INVALID, "has %s twice", item->name);
    *given |= mask;
    if (read_values(item, text + strlen(item->name), options))
        return true;
    if (!item->value)
        return status_fail(why, STATUS_INVALID, "has '%s': %s takes no value", text, item->name);
    return status_fail(why, STATUS_INVALID, "has '%s': expected %s%s, a number in [%g, %.16g]%s",
                       text, item->name, item->value, item->low, item->high,
                       item->every > 0.0 ? " and one in [1e-06, 10000] s" : "");
}

bool device_parse(const char *text, DeviceOptions *options, Status *why)
{
    *options = (DeviceOptions){0};
    unsigned given = 0;
    for (const char *at = text;; at++) {
        char item[ITEM_TEXT];
        const size_t length = strcspn(at, ",");
        snprintf(item, sizeof item, "%.*s", (int)length, at);
        if (length >= sizeof item)
            return status_fail(why, STATUS_INVALID, "has '%s...', which is too long", item);
        if (!read_item(item, options, &given, why))
            return false;
        at += length;
        if (*at == '\0')
            break;
    }
    // What goes together.
    if (options->gap_every > 0.0 && options->gap_length >= options->gap_every)
        return status_fail(why, STATUS_INVALID, "has a gap of %g s in every %g s",
                           options->gap_length, options->gap_every);
    return options->seed == floor(options->seed) ||
           status_fail(why, STATUS_INVALID, "has the seed %g, which is no integer", options->seed);
}

// --- chance ---

// What is drawn for a sample; of a message's, for its second copy further on.
enum {
    DRAW_NOISE = 0, // two of each coordinate
    DRAW_WRONG = 6, // two
    DRAW_LOSS = 8,
    DRAW_REORDER,
    DRAW_JITTER, // two
    DRAW_AGAIN = 4,
};

// Mixes the bits of a number: the output function of Steele, Lea and Flood's splitmix64.
static uint64_t mix(uint64_t z)
{
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return z ^ z >> 31;
}

// Returns a number in [0, 1) for the sample of this time.
static double share(const Device *device, double time, int draw)
{
    const uint64_t step = UINT64_C(0x9e3779b97f4a7c15); // 2^64 over the golden ratio
    const uint64_t of_item = mix(((uint64_t)device->options.seed << 8 | (uint64_t)draw) + step);
    const uint64_t us = (uint64_t)llround(1e6 * time);
    return (double)(mix(of_item + step * (us + 1)) >> 11) * 0x1p-53;
}

// Returns a number of mean 0 and variance 1 by two draws (Box and Muller).
static double normal(const Device *device, double time, int draw)
{
    const double size = sqrt(-2.0 * log(1.0 - share(device, time, draw)));
    return size * cos(2.0 * PI * share(device, time, draw + 1));
}

// --- the way of a pose ---

static void enqueue(Device *device, const DevicePose *pose)
{
    if (device->end - device->first == DEVICE_WAITING) {
        device->lost++;
        return;
    }
    // Behind all that arrive no later: mostly at the end.
    unsigned at = device->end++;
    for (; at != device->first; at--) {
        const DevicePose *former = &device->waiting[(at - 1) % DEVICE_WAITING];
        if (former->arrives <= pose->arrives)
            break;
        device->waiting[at % DEVICE_WAITING] = *former;
    }
    device->waiting[at % DEVICE_WAITING] = *pose;
}

// Sends a sample over the network; `copy` 0 or 1.
static void transmit(Device *device, const DevicePose *sample, int copy)
{
    const DeviceOptions *options = &device->options;
    const int more = copy * DRAW_AGAIN;
    if (share(device, sample->time, DRAW_LOSS + more) < options->loss) {
        device->lost++;
        return;
    }
    DevicePose message = *sample;
    message.arrives = sample->time + options->late + copy * AGAIN +
                      options->jitter * fabs(normal(device, sample->time, DRAW_JITTER + more)) +
                      options->reorder * share(device, sample->time, DRAW_REORDER + more);
    enqueue(device, &message);
}

// Makes of a true position what a sensor with noise and steps reads.
static void measure(Device *device, DevicePose *sample)
{
    const DeviceOptions *options = &device->options;
    for (int k = 0; k < 3; k++) {
        double *x = &sample->pose.position[k];
        if (options->noise > 0.0)
            *x += options->noise * normal(device, sample->time, DRAW_NOISE + 2 * k);
        if (options->quantum > 0.0)
            *x = round(*x / options->quantum) * options->quantum;
    }
    // A wrong one, in any direction.
    const double passed =
        options->wrong_every > 0.0 ? floor((sample->time + ROUNDED) / options->wrong_every) : 0.0;
    if (passed <= device->wrongs)
        return;
    device->wrongs = passed;
    const double up = 2.0 * share(device, sample->time, DRAW_WRONG) - 1.0;
    const double turn = 2.0 * PI * share(device, sample->time, DRAW_WRONG + 1);
    const double flat = sqrt(1.0 - up * up);
    sample->pose.position[0] += options->wrong * flat * cos(turn);
    sample->pose.position[1] += options->wrong * flat * sin(turn);
    sample->pose.position[2] += options->wrong * up;
}

static void take_sample(Device *device, double time, const PliantPose *pose)
{
    const DeviceOptions *options = &device->options;
    DevicePose sample = {.time = time, .number = device->samples++, .pose = *pose};
    if (options->gap_every > 0.0 &&
        fmod(time + ROUNDED, options->gap_every) < options->gap_length) {
        device->silent++;
        return;
    }
    measure(device, &sample);
    for (int copy = 0; copy <= options->duplicate; copy++)
        transmit(device, &sample, copy);
}

// Finds the pose a `part` of the way from the last ideal pose to `ideal`.
static PliantPose between(const Device *device, double part, const PliantPose *ideal)
{
    PliantPose pose = *ideal;
    const PliantPose *from = &device->ideal;
    if (!device->begun || from->active != ideal->active)
        return pose;
    for (int k = 0; k < 3; k++) {
        pose.position[k] = from->position[k] + part * (ideal->position[k] - from->position[k]);
        pose.linear[k] = from->linear[k] + part * (ideal->linear[k] - from->linear[k]);
        pose.angular[k] = from->angular[k] + part * (ideal->angular[k] - from->angular[k]);
    }
    // The turn of a tick is small: its chord does, the short way round.
    double dot = 0.0, length = 0.0;
    for (int k = 0; k < 4; k++)
        dot += from->orientation[k] * ideal->orientation[k];
    for (int k = 0; k < 4; k++) {
        const double start = copysign(1.0, dot) * from->orientation[k];
        pose.orientation[k] = start + part * (ideal->orientation[k] - start);
        length += pose.orientation[k] * pose.orientation[k];
    }
    for (int k = 0; k < 4 && length > 0.0; k++) // all zero: not rotated
        pose.orientation[k] /= sqrt(length);
    return pose;
}

void device_begin(Device *device, const DeviceOptions *options)
{
    memset(device, 0, sizeof *device);
    device->options = *options;
}

void device_send(Device *device, double time, const PliantPose *ideal)
{
    const double rate = device->options.rate_hz;
    if (!device->begun)
        device->due = ceil((time - ROUNDED) * rate);
    if (rate == 0.0)
        take_sample(device, time, ideal);
    for (; rate > 0.0 && device->due <= (time + ROUNDED) * rate; device->due++) {
        const double at = device->due / rate, step = time - device->time;
        const double part = step > 0.0 ? fmin(1.0, (at - device->time) / step) : 1.0;
        const PliantPose pose = between(device, part, ideal);
        take_sample(device, at, &pose);
    }
    device->begun = true;
    device->time = time;
    device->ideal = *ideal;
}

double device_next(const Device *device)
{
    return device->first == device->end ? (double)INFINITY
                                        : device->waiting[device->first % DEVICE_WAITING].arrives;
}

bool device_take(Device *device, double time, DevicePose *pose)
{
    if (device->first == device->end || device_next(device) > time + ROUNDED)
        return false;
    *pose = device->waiting[device->first++ % DEVICE_WAITING];
    device->arrived++;
    device->overtaken += pose->number < device->newest;
    device->newest = pose->number > device->newest ? pose->number : device->newest;
    return true;
}
