// SPDX-License-Identifier: MIT
// A front end in a page of C, on LCM and the generated types alone: pushes tool 1 from a position
// along a vector and back in four seconds, and prints ten times per second the force and the
// position of the body.
//   touch BODY X Y Z DX DY DZ          [m], e.g.  touch stomach -0.10 -0.07 0 0.03 0.05 0
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include "pliant_contact_t.h"
#include "pliant_nodes_t.h"
#include "pliant_tool_pose_t.h"

static int64_t utime(void)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

static void on_contact(const lcm_recv_buf_t *buffer, const char *channel,
                       const pliant_contact_t *contact, void *newest)
{
    (void)buffer, (void)channel;
    if (contact->tool == 1) // one channel for all tools
        *(pliant_contact_t *)newest = *contact;
}

// A large body comes in several chunks: this one has num_values / 3 nodes from `first` on.
static void on_nodes(const lcm_recv_buf_t *buffer, const char *channel, const pliant_nodes_t *nodes,
                     void *node)
{
    (void)buffer, (void)channel;
    for (int k = 0; k < 3 && nodes->first == 0 && nodes->num_values >= 3; k++)
        ((float *)node)[k] = nodes->position[k];
}

int main(int argc, char **argv)
{
    lcm_t *lcm = argc == 8 ? lcm_create(NULL) : NULL; // NULL: LCM_DEFAULT_URL
    if (!lcm)
        return fprintf(stderr, "usage: touch BODY X Y Z DX DY DZ, with an LCM network\n"), 2;
    // Hear contacts and the body's nodes.
    pliant_contact_t felt = {0};
    float node[3] = {0};
    char channel[64];
    snprintf(channel, sizeof channel, "PLIANT_NODES_%s", argv[1]);
    pliant_contact_t_subscription_t *contacts =
        pliant_contact_t_subscribe(lcm, "PLIANT_CONTACT", on_contact, &felt);
    pliant_nodes_t_subscription_t *frames = pliant_nodes_t_subscribe(lcm, channel, on_nodes, node);
    pliant_tool_pose_t pose = {.sender = getpid(), .tool = 1, .orientation = {1}, .active = 1};
    for (pose.sequence = 0; pose.sequence <= 4000; pose.sequence++) { // one pose per millisecond
        double way = 0.5 - 0.5 * cos(6.283185307179586 * pose.sequence / 4000); // 0, 1, 0
        for (int k = 0; k < 3; k++)
            pose.position[k] = atof(argv[2 + k]) + way * atof(argv[5 + k]);
        pose.active = pose.sequence < 4000; // the last one withdraws the tool
        pose.utime = utime();
        pliant_tool_pose_t_publish(lcm, "PLIANT_TOOL_POSE", &pose);
        // Handle all messages until the next pose, so that none grows old in LCM's queues.
        while (lcm_handle_timeout(lcm, utime() - pose.utime < 1000) > 0 ||
               utime() - pose.utime < 1000)
            ;
        if (pose.sequence % 100 == 0)
            printf(
                "tool %6.3f %6.3f %6.3f m  force %6.3f %6.3f %6.3f N  node 0 %6.3f %6.3f %6.3f m\n",
                felt.position[0], felt.position[1], felt.position[2], felt.force[0], felt.force[1],
                felt.force[2], (double)node[0], (double)node[1], (double)node[2]);
    }
    pliant_contact_t_unsubscribe(lcm, contacts);
    pliant_nodes_t_unsubscribe(lcm, frames);
    lcm_destroy(lcm);
    return 0;
}
