// SPDX-License-Identifier: MIT
// The smallest front end: prints where a body is, each time that all of its nodes have come.
//   watch BODY [FRAMES]          e.g.  watch stomach 100
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pliant_nodes_t.h"

enum { NODES_MOST = 100000 };
static float position[3 * NODES_MOST]; // of one frame [m]
static int32_t sequence, next_chunk;   // of the frame that is coming
static int frames_left = 1 << 30;

// A large body comes in several chunks of at most 4096 nodes; skips a frame with a lost chunk.
static void on_nodes(const lcm_recv_buf_t *buffer, const char *channel, const pliant_nodes_t *nodes,
                     void *user)
{
    (void)buffer, (void)channel, (void)user;
    // A frame comes in chunks: begin with the first, drop the frame if one is missing.
    if (nodes->chunk == 0)
        sequence = nodes->sequence, next_chunk = 0;
    if (nodes->sequence != sequence || nodes->chunk != next_chunk || nodes->first < 0 ||
        nodes->first > NODES_MOST || nodes->num_values < 0 ||
        nodes->num_values > 3 * (NODES_MOST - nodes->first))
        return;
    memcpy(&position[3 * nodes->first], nodes->position, sizeof(float) * nodes->num_values);
    if (++next_chunk < nodes->chunk_count)
        return;
    // All of it has come: print the box around it.
    double low[3] = {1e9, 1e9, 1e9}, high[3] = {-1e9, -1e9, -1e9};
    for (int i = 0; i < 3 * nodes->first + nodes->num_values; i++) {
        low[i % 3] = fmin(low[i % 3], (double)position[i]);
        high[i % 3] = fmax(high[i % 3], (double)position[i]);
    }
    printf("%.3f s: %d nodes from (%.4f %.4f %.4f) to (%.4f %.4f %.4f) m\n", nodes->time,
           nodes->node_count, low[0], low[1], low[2], high[0], high[1], high[2]);
    frames_left--;
}

int main(int argc, char **argv)
{
    lcm_t *lcm = argc == 2 || argc == 3 ? lcm_create(NULL) : NULL; // NULL: LCM_DEFAULT_URL
    if (!lcm)
        return fprintf(stderr, "usage: watch BODY [FRAMES], with an LCM network\n"), 2;
    char name[64];
    snprintf(name, sizeof name, "PLIANT_NODES_%s", argv[1]);
    frames_left = argc == 3 ? atoi(argv[2]) : frames_left;
    pliant_nodes_t_subscription_t *all = pliant_nodes_t_subscribe(lcm, name, on_nodes, NULL);
    while (frames_left > 0 && lcm_handle(lcm) == 0)
        ;
    pliant_nodes_t_unsubscribe(lcm, all);
    lcm_destroy(lcm);
    return 0;
}
