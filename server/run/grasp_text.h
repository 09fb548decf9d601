// The kind and text of the event that a grasper has grasped or released nodes.
#ifndef PLIANT_RUN_GRASP_TEXT_H
#define PLIANT_RUN_GRASP_TEXT_H

#include "dynamics/sim.h"

#include <stdio.h>

enum { GRASP_TEXT = 64 };

static inline const char *grasp_kind(const GraspEvent *event)
{
    return event->nodes > 0 ? "grasp" : "release";
}

static inline void grasp_text(const Sim *sim, const GraspEvent *event, char text[GRASP_TEXT])
{
    int id = sim_tool(sim, event->tool)->id;
    if (event->nodes == 0)
        snprintf(text, GRASP_TEXT, "tool %d released", id);
    else
        snprintf(text, GRASP_TEXT, "tool %d grasped %d %s", id, event->nodes,
                 event->points ? "points of faces" : "nodes");
}

#endif
