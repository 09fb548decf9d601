// SPDX-License-Identifier: MIT
// Finds where to press a body. One thread.
#include "aim.h"

#include <math.h>
#include <string.h>

#define WAIT_S 3.0  // for a frame: a whole mesh comes each second
#define LEVEL  1e-3 // tolerance for coming first: this fraction of the body's extent along the press

static double along(const float x[3], const double direction[3])
{
    return direction[0] * (double)x[0] + direction[1] * (double)x[1] + direction[2] * (double)x[2];
}

void aim_choose(int count, const float *position, const int32_t *id, const double direction[3],
                double node[3])
{
    // How far the nodes reach along the direction.
    double first = HUGE_VAL, last = -HUGE_VAL, middle[3] = {0.0, 0.0, 0.0}, nearest = HUGE_VAL;
    int level = 0;
    for (int i = 0; i < count; i++) {
        if (id[i] < 0)
            continue;
        first = fmin(first, along(position + 3 * i, direction));
        last = fmax(last, along(position + 3 * i, direction));
    }
    // On a flat side many nodes come first: take the one in its middle, not at its corner.
    const double limit = first + LEVEL * (last - first);
    for (int i = 0; i < count; i++) {
        const float *x = position + 3 * i;
        if (id[i] < 0 || !(along(x, direction) <= limit))
            continue;
        level++;
        for (int k = 0; k < 3; k++)
            middle[k] += ((double)x[k] - middle[k]) / level;
    }
    // The node nearest to the mean of those that come first.
    for (int i = 0; i < count; i++) {
        const float *x = position + 3 * i;
        double distance = 0.0;
        for (int k = 0; k < 3; k++)
            distance += ((double)x[k] - middle[k]) * ((double)x[k] - middle[k]);
        if (id[i] < 0 || !(along(x, direction) <= limit) || distance >= nearest)
            continue;
        nearest = distance;
        for (int k = 0; k < 3; k++)
            node[k] = (double)x[k];
    }
}

// Waits for a frame of the body, of any if it has no name.
static const PliantBody *wait_frame(PliantClient *client, const char *body)
{
    const double end = pliant_now() + WAIT_S;
    for (double left = WAIT_S; body[0] == '\0' && left > 0.0; left = end - pliant_now()) {
        if (pliant_body_count(client) > 0)
            return pliant_body(client, pliant_body_name(client, 0));
        if (pliant_wait_next(client, left) < 0)
            return NULL;
    }
    return body[0] ? pliant_wait_body(client, body, WAIT_S) : NULL;
}

bool aim_find(PliantClient *client, const double direction[3], Aim *aim, PliantError *error)
{
    // The server is asked first: it then sends its meshes, and a name that it does not have will
    // never come.
    if (!pliant_hear_bodies(client, true) || !pliant_describe(client) ||
        (aim->body[0] && !pliant_find_body(client, aim->body)))
        return program_fail(error, "%s", pliant_error(client));
    const PliantBody *body = wait_frame(client, aim->body);
    if (!body && pliant_wait_next(client, 0.0) < 0)
        return program_fail(error, "interrupted");
    if (!body)
        return program_fail(error,
                            "the daemon answers, but no frame of %s%s came within %g s: is "
                            "publish.nodes_hz 0, or the daemon paused?",
                            aim->body[0] ? "body " : "a body", aim->body, WAIT_S);
    snprintf(aim->body, sizeof aim->body, "%s", body->name);
    aim_choose(body->node_count, body->position, body->id, direction, aim->node);
    return pliant_hear_bodies(client, false);
}
