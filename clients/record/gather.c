// SPDX-License-Identifier: MIT
#include "gather.h"

#include "wire.h"

#include <math.h>
#include <string.h>

#include "pliant_contact_t.h"
#include "pliant_tool_pose_t.h"

void gather_restart(GatherTool *tool)
{
    // A tool whose orientation is unknown has NAN.
    const double none = (double)NAN;
    *tool = (GatherTool){.row_step = -1, .orientation = {none, none, none, none}};
}

static Vec3 vector(const double v[3])
{
    return (Vec3){v[0], v[1], v[2]};
}

bool gather_read_contact(const void *data, size_t size, int *id, GatherContact *contact)
{
    pliant_contact_t message;
    if (!wire_check(&WIRE_CONTACT, data, size) ||
        pliant_contact_t_decode(data, 0, (int)size, &message) < 0)
        return false;
    *id = message.tool;
    *contact = (GatherContact){.step = message.step,
                               .pose_utime = message.pose_utime,
                               .time = message.time,
                               .position = vector(message.position),
                               .force = vector(message.force)};
    return true;
}

bool gather_read_pose(const void *data, size_t size, int *id, GatherPose *pose)
{
    pliant_tool_pose_t message;
    if (!wire_check(&WIRE_TOOL_POSE, data, size) ||
        pliant_tool_pose_t_decode(data, 0, (int)size, &message) < 0)
        return false;
    const double *q = message.orientation;
    *id = message.tool;
    *pose = (GatherPose){.utime = message.utime, .orientation = {q[0], q[1], q[2], q[3]}};
    return true;
}

void gather_take_contact(GatherTool *tool, const GatherContact *contact)
{
    tool->contact[tool->contacts++ % GATHER_HISTORY] = *contact;
}

void gather_take_pose(GatherTool *tool, const GatherPose *pose)
{
    tool->pose[tool->poses++ % GATHER_HISTORY] = *pose;
}

void gather_want(GatherTool *tool, int64_t step)
{
    if (tool->waiting_count > 0 && tool->waiting[tool->waiting_count - 1] >= step)
        return;
    if (tool->waiting_count == GATHER_WAITING) // no contacts arrive: drop the oldest request
        memmove(tool->waiting, tool->waiting + 1,
                (size_t)--tool->waiting_count * sizeof *tool->waiting);
    tool->waiting[tool->waiting_count++] = step;
}

static int64_t kept(int64_t came)
{
    return came < GATHER_HISTORY ? came : GATHER_HISTORY;
}

// Returns the newest contact up to that tick; sets `reached` if one of that tick or later has
// arrived.
static const GatherContact *find_contact(const GatherTool *tool, int64_t step, bool *reached)
{
    const GatherContact *best = NULL;
    *reached = false;
    for (int64_t k = 1; k <= kept(tool->contacts); k++) {
        const GatherContact *contact = &tool->contact[(tool->contacts - k) % GATHER_HISTORY];
        *reached |= contact->step >= step;
        if (contact->step <= step && (!best || contact->step > best->step))
            best = contact;
    }
    return best;
}

// Returns the orientation of the pose that a contact refers to; the previous one if it is unknown.
static Quat find_turn(const GatherTool *tool, bool is_static, int64_t pose_utime)
{
    if (is_static)
        return (Quat){1.0, 0.0, 0.0, 0.0};
    for (int64_t k = 1; k <= kept(tool->poses); k++) {
        const GatherPose *pose = &tool->pose[(tool->poses - k) % GATHER_HISTORY];
        if (pose->utime == pose_utime)
            return pose->orientation;
    }
    return tool->orientation;
}

bool gather_next(GatherTool *tool, bool is_static, GatherRow *row)
{
    // Rows leave in the order of their ticks, so the oldest is waited for.
    while (tool->waiting_count > 0) {
        bool reached;
        const GatherContact *contact = find_contact(tool, tool->waiting[0], &reached);
        if (!reached)
            return false;
        memmove(tool->waiting, tool->waiting + 1,
                (size_t)--tool->waiting_count * sizeof *tool->waiting);
        // A tool that nobody moves has no row.
        bool driven = contact && (is_static || contact->pose_utime != 0);
        if (!driven || contact->step <= tool->row_step)
            continue;
        tool->row_step = contact->step;
        tool->orientation = find_turn(tool, is_static, contact->pose_utime);
        *row = (GatherRow){.time = contact->time,
                           .sample = {.position = contact->position,
                                      .orientation = tool->orientation,
                                      .force = contact->force}};
        return true;
    }
    return false;
}
