#include "run/recorder.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

size_t record_frame_bytes(Sim *sim)
{
    size_t bytes = sizeof(RecordFrame) + (size_t)sim_tool_count(sim) * sizeof(RecordTool);
    for (int i = 0; i < sim_body_count(sim); i++)
        bytes += 3 * (size_t)sim_body(sim, i)->mesh.node_count * sizeof(float);
    return bytes;
}

static void take_tool(RecordTool *tool, Sim *sim, int index)
{
    const ToolMotion *motion = sim_tool_motion(sim, index);
    const ToolWrench *wrench = sim_wrench(sim, index);
    Vec3 pose;
    tool->active = motion->active;
    tool_motion_at(motion, (double)(sim_steps(sim) - motion->pose_step) * sim_tick(sim), &pose,
                   &tool->sample.orientation);
    // Where the bodies felt it, which is not where the hand is while it pushes beyond max_force.
    tool->sample.position = wrench->contact ? wrench->position : pose;
    tool->sample.force = wrench->force;
}

float *record_frame_begin(RecordFrame *frame, Sim *sim)
{
    int tools = sim_tool_count(sim);
    frame->step = sim_steps(sim);
    frame->time = sim_time(sim);
    for (int i = 0; i < tools; i++)
        take_tool(&frame->tool[i], sim, i);
    return (float *)(frame->tool + tools);
}

void record_frame_take(RecordFrame *frame, Sim *sim)
{
    float *position = record_frame_begin(frame, sim);
    for (int i = 0; i < sim_body_count(sim); i++) {
        const Body *body = sim_body(sim, i);
        body->ops->snapshot(body->model, position, NULL);
        position += 3 * (size_t)body->mesh.node_count;
    }
}

// --- writing ---

static bool write_topologies(Recorder *recorder)
{
    bool ok = true;
    for (int i = 0; i < sim_body_count(recorder->sim) && ok; i++) {
        const BodyMesh *mesh = &sim_body(recorder->sim, i)->mesh;
        const RecordingTopology topology = {.number = mesh->topology,
                                            .node_count = mesh->node_count,
                                            .triangle_count = mesh->triangle_count,
                                            .node_id = mesh->id,
                                            .triangle = mesh->triangle};
        ok = recording_add_topology(recorder->recording, i, &topology);
    }
    return ok && recording_flush(recorder->recording);
}

bool recorder_create(Recorder *recorder, const char *path, World *world, const Scene *scene,
                     Status *status)
{
    Sim *sim = world->sim;
    int bodies = sim_body_count(sim), tools = sim_tool_count(sim);
    RecordingBody *body = calloc((size_t)bodies + 1, sizeof *body);
    int *tool = calloc((size_t)tools + 1, sizeof *tool);
    ASSERT(body != NULL && tool != NULL);
    for (int i = 0; i < bodies; i++) {
        const Body *from = sim_body(sim, i);
        body[i] = (RecordingBody){.name = from->name,
                                  .nodes = from->mesh.node_count,
                                  .triangles = from->mesh.triangle_count};
    }
    for (int i = 0; i < tools; i++)
        tool[i] = sim_tool(sim, i)->id;
    const RecordingOptions options = {.scene = scene->text,
                                      .created_by = "pliantd " PLIANT_VERSION,
                                      .body_count = bodies,
                                      .tool_count = tools,
                                      .body = body,
                                      .tool = tool};
    *recorder = (Recorder){.sim = sim, .recording = recording_create(path, &options, status)};
    free(body);
    free(tool);
    if (recorder->recording == NULL)
        return false;
    return write_topologies(recorder) ||
           status_fail(status, STATUS_INVALID, "%s", recording_status(recorder->recording)->text);
}

bool recorder_write_frame(Recorder *recorder, const RecordFrame *frame)
{
    Recording *recording = recorder->recording;
    Sim *sim = recorder->sim;
    int tools = sim_tool_count(sim);
    bool ok = true;
    for (int i = 0; i < tools && ok; i++)
        if (frame->tool[i].active)
            ok = recording_add_tool(recording, i, frame->time, &frame->tool[i].sample);
    const float *position = (const float *)(frame->tool + tools);
    for (int i = 0; i < sim_body_count(sim) && ok; i++) {
        const BodyMesh *mesh = &sim_body(sim, i)->mesh;
        const RecordingFrame of_body = {.step = frame->step,
                                        .time = frame->time,
                                        .topology = mesh->topology,
                                        .node_count = mesh->node_count,
                                        .position = position};
        ok = recording_add_frame(recording, i, &of_body);
        position += 3 * (size_t)mesh->node_count;
    }
    recorder->frames += ok;
    return ok;
}

bool recorder_write_event(Recorder *recorder, const EventOut *event)
{
    RecordingEvent out = {.time = (double)event->step * sim_tick(recorder->sim),
                          .step = event->step};
    if (event->body >= 0)
        snprintf(out.body, sizeof out.body, "%s", sim_body(recorder->sim, event->body)->name);
    snprintf(out.kind, sizeof out.kind, "%s", event->kind);
    snprintf(out.text, sizeof out.text, "%s", event->text);
    return recording_add_event(recorder->recording, &out);
}

bool recorder_close(Recorder *recorder, Status *status)
{
    Recording *recording = recorder->recording;
    recorder->recording = NULL;
    return recording == NULL || recording_close(recording, status);
}
