// Packs node positions into packets that stand alone (points_t). Pure function without thread,
// clock or socket.
#include "run/bus_parts.h"

#include "base/check.h"

#include <math.h>
#include <string.h>

enum {
    GROUP_NODES = 8,
    WIDTH_BITS = 5,
    // Differences of such numbers, folded to be positive, have at most 31 bits.
    GRID_MOST = 1 << 29,
};

// Appends the low bits of a number, the most significant first; the bytes were zero.
static void bits_write(uint8_t *data, int *at, uint32_t value, int width)
{
    for (int left = width; left > 0;) {
        int room = 8 - *at % 8, take = left < room ? left : room;
        uint32_t part = value >> (left - take) & ((1u << take) - 1u);
        data[*at / 8] = (uint8_t)(data[*at / 8] | part << (room - take));
        *at += take;
        left -= take;
    }
}

static int width_of(uint32_t value)
{
    return value == 0 ? 0 : 32 - __builtin_clz(value);
}

// The nearest number of the grid; 0 for what no grid can hold.
static int32_t round_to(float x, double grid)
{
    double scaled = (double)x / grid;
    return fabs(scaled) <= GRID_MOST ? (int32_t)lrint(scaled) : 0;
}

float points_grid(const float *position, const int *id, int count)
{
    float largest = 0.0f, grid = POINTS_GRID;
    for (int i = 0; i < 3 * count; i++)
        if (id[i / 3] >= 0)
            largest = fmaxf(largest, fabsf(position[i]));
    while (largest > grid * (float)GRID_MOST && isfinite(largest))
        grid *= 2.0f;
    return grid;
}

// Folds the differences of a group's nodes to the node before into `u`, and `at`, the node before,
// becomes the last of them. Returns the bits that the group takes.
static int group_fold(const float *position, const int *id, int count, float grid, int32_t at[3],
                      uint32_t u[3 * GROUP_NODES], int width[3])
{
    uint32_t all[3] = {0};
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            // A free slot may hold anything: it repeats the node before.
            int32_t value = id[i] < 0 ? at[k] : round_to(position[3 * i + k], (double)grid);
            int32_t difference = value - at[k];
            at[k] = value;
            u[3 * i + k] = difference < 0 ? 2u * (uint32_t)(-(difference + 1)) + 1u
                                          : 2u * (uint32_t)difference;
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
    int used = 0, taken = 0, bits = 0;
    while (used < count - 1 && id[used] < 0)
        used++;
    int32_t at[3];
    for (int k = 0; k < 3; k++)
        at[k] = origin[k] = count > 0 ? round_to(position[3 * used + k], (double)grid) : 0;
    memset(data, 0, (size_t)bytes);
    // Whole groups, as many as there is room for.
    while (taken < count && taken + GROUP_NODES <= POINTS_IN_PACKET) {
        uint32_t u[3 * GROUP_NODES];
        int width[3], nodes = count - taken < GROUP_NODES ? count - taken : GROUP_NODES;
        int more = group_fold(position + 3L * taken, id + taken, nodes, grid, at, u, width);
        if (bits + more > 8 * bytes)
            break;
        for (int k = 0; k < 3; k++)
            bits_write(data, &bits, (uint32_t)width[k], WIDTH_BITS);
        for (int i = 0; i < 3 * nodes; i++)
            bits_write(data, &bits, u[i], width[i % 3]);
        taken += nodes;
    }
    *data_bytes = (bits + 7) / 8;
    return taken;
}
