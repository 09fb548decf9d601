// SPDX-License-Identifier: MIT
// The errors of bodies and of tools' forces that a server publishes.
#include "kit.h"

#include "wire.h"

#include <stdlib.h>

static PliantErrorOfBody *copy_bodies(const pliant_error_t *m)
{
    PliantErrorOfBody *body = calloc((size_t)m->num_bodies + 1, sizeof *body);
    for (int k = 0; k < m->num_bodies && body; k++)
        body[k] = (PliantErrorOfBody){.body = m->body[k].name,
                                      .space = m->body[k].space,
                                      .steps = m->body[k].steps,
                                      .total = m->body[k].total,
                                      .relative = m->body[k].relative,
                                      .age = m->body[k].age};
    return body;
}

static PliantErrorOfTool *copy_tools(const pliant_error_t *m)
{
    PliantErrorOfTool *tool = calloc((size_t)m->num_tools + 1, sizeof *tool);
    for (int k = 0; k < m->num_tools && tool; k++)
        tool[k] = (PliantErrorOfTool){.tool = m->tool[k].tool,
                                      .force = m->tool[k].force,
                                      .error = m->tool[k].error,
                                      .share = m->tool[k].share};
    return tool;
}

void kit_forget_errors(PliantClient *kit)
{
    if (kit->errors_message)
        pliant_error_t_destroy(kit->errors_message);
    kit->errors_message = NULL;
    free((void *)kit->errors.body);
    free((void *)kit->errors.tool);
    kit->errors = (PliantErrors){.step = 0};
}

void kit_take_errors(PliantClient *kit, const void *data, size_t size)
{
    pliant_error_t m;
    if (!wire_check(&WIRE_ERROR, data, size) || pliant_error_t_decode(data, 0, (int)size, &m) < 0)
        return;
    kit_forget_errors(kit);
    kit->errors_message = pliant_error_t_copy(&m);
    pliant_error_t_decode_cleanup(&m);
    const pliant_error_t *e = kit->errors_message;
    if (!e)
        return;
    kit->error_count++;
    kit->news++;
    kit->errors = (PliantErrors){.step = e->step,
                                 .time = e->time,
                                 .received = pliant_now(),
                                 .body = copy_bodies(e),
                                 .tool = copy_tools(e)};
    if (!kit->errors.body || !kit->errors.tool)
        abort(); // the machine is out of memory
    kit->errors.body_count = e->num_bodies;
    kit->errors.tool_count = e->num_tools;
}

const PliantErrors *pliant_errors(const PliantClient *kit)
{
    return kit->errors_message ? &kit->errors : NULL;
}

const PliantErrors *pliant_wait_errors(PliantClient *kit, double seconds)
{
    return kit_wait_published(kit, "ERROR", seconds, &kit->error_count,
                              "its scene has no publish.error_hz")
               ? &kit->errors
               : NULL;
}
