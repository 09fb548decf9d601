// SPDX-License-Identifier: MIT
// Packs node positions into packets that stand alone (points_t). Pure function without thread,
// clock or socket.
#include "run/bus_points.h"

#include "base/check.h"

#include <math.h>

enum {
    GROUP_NODES = 8,
    WIDTH_BITS = 5,
    // Differences of such numbers, folded to be positive, have at most 31 bits. A float can hold
    // it.
    GRID_MOST = (1 << 29) - 32,
};

typedef struct BitWriter {
    uint8_t *data;
    int bytes;     // written
    uint64_t held; // its low bits are not written yet:
    int held_bits; // fewer than 8
} BitWriter;

// Appends the low bits of a number, the most significant first; at most 31.
static void bits_write(BitWriter *writer, uint32_t value, int width)
{
    writer->held = writer->held << width | value;
    writer->held_bits += width;
    while (writer->held_bits >= 8)
        writer->data[writer->bytes++] = (uint8_t)(writer->held >> (writer->held_bits -= 8));
}

static int bits_written(const BitWriter *writer)
{
    return 8 * writer->bytes + writer->held_bits;
}

static int width_of(uint32_t value)
{
    return value == 0 ? 0 : 32 - __builtin_clz(value);
}

// The nearest number of the grid, by its reciprocal, which is exact; 0 for what no grid can hold.
static int32_t round_to(float x, double per_grid)
{
    double scaled = (double)x * per_grid;
    return fabs(scaled) <= GRID_MOST ? (int32_t)lrint(scaled) : 0;
}

float points_grid(const float *position, const int *id, int count)
{
    float largest = 0.0f, grid = POINTS_GRID;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3 && id[i] >= 0; k++)
            if (fabsf(position[3 * i + k]) > largest) // never of a NaN
                largest = fabsf(position[3 * i + k]);
    while (largest > grid * (float)GRID_MOST && isfinite(largest))
        grid *= 2.0f;
    return grid;
}

// Folds the differences of a group's nodes to the node before into `u`, and `at`, the node before,
// becomes the last of them. Returns the bits that the group takes.
static int group_fold(const float *position, const int *id, int count, double per_grid,
                      int32_t at[3], uint32_t u[3 * GROUP_NODES], int width[3])
{
    uint32_t all[3] = {0};
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            // A free slot may hold anything: it repeats the node before.
            int32_t value = id[i] < 0 ? at[k] : round_to(position[3 * i + k], per_grid);
            int32_t difference = value - at[k];
            at[k] = value;
            // 0 -1 1 -2 2 become 0 1 2 3 4.
            u[3 * i + k] = (uint32_t)difference << 1 ^ (0u - (uint32_t)(difference < 0));
            all[k] |= u[3 * i + k];
        }
    for (int k = 0; k < 3; k++)
        width[k] = width_of(all[k]);
    return 3 * WIDTH_BITS + count * (width[0] + width[1] + width[2]);
}

int points_pack(const float *position, const int *id, int count, float grid, int bytes,
                int32_t origin[3], uint8_t *data, int *data_bytes)
{
    ASSERT(bytes >= POINTS_LEAST_BYTES);
    // From the first node in use: the first group is as narrow as the others.
    const double per_grid = 1.0 / (double)grid;
    BitWriter writer = {.data = data};
    int used = 0, taken = 0;
    while (used < count - 1 && id[used] < 0)
        used++;
    int32_t at[3];
    for (int k = 0; k < 3; k++)
        at[k] = origin[k] = count > 0 ? round_to(position[3 * used + k], per_grid) : 0;
    // Whole groups, as many as there is room for.
    while (taken < count && taken + GROUP_NODES <= POINTS_IN_PACKET) {
        uint32_t u[3 * GROUP_NODES];
        int width[3], nodes = count - taken < GROUP_NODES ? count - taken : GROUP_NODES;
        int more = group_fold(position + 3L * taken, id + taken, nodes, per_grid, at, u, width);
        if (bits_written(&writer) + more > 8 * bytes)
            break;
        for (int k = 0; k < 3; k++)
            bits_write(&writer, (uint32_t)width[k], WIDTH_BITS);
        for (int i = 0; i < nodes; i++)
            for (int k = 0; k < 3; k++)
                bits_write(&writer, u[3 * i + k], width[k]);
        taken += nodes;
    }
    // The last byte is filled with zeros.
    bits_write(&writer, 0, (8 - writer.held_bits) % 8);
    *data_bytes = writer.bytes;
    return taken;
}
