// SPDX-License-Identifier: MIT
#include "play.h"

#include "error_lines.h"
#include "ledger_lines.h"
#include "pliant_event_t.h"
#include "pliant_hello_t.h"
#include "pliant_lcmtypes.h"
#include "pliant_playback_t.h"
#include "pliant_reply_t.h"
#include "pliant_status_t.h"

#include <math.h>
#include <string.h>

enum { MARK_TEXT = 40 };

void play_publish_reply(Play *play, const Answered *answer)
{
    char channel[CLIENT_CHANNEL_MAX];
    double time;
    const char *text = answer->describes ? play->describe : answer->text;
    const pliant_reply_t reply = {.utime = client_utime(),
                                  .sender = answer->sender,
                                  .id = answer->id,
                                  .ok = answer->ok,
                                  .step = sender_step(&play->sender, &time),
                                  .channel = (char *)(uintptr_t)answer->channel,
                                  .text = (char *)(uintptr_t)text};
    client_channel(&play->client, "REPLY", NULL, channel);
    pliant_reply_t_publish(play->client.lcm, channel, &reply);
}

void play_publish_event(Play *play, const RecordingEvent *event)
{
    char channel[CLIENT_CHANNEL_MAX];
    const pliant_event_t message = {.utime = client_utime(),
                                    .sequence = (int32_t)++play->event_sequence,
                                    .step = event->step,
                                    .body = (char *)(uintptr_t)event->body,
                                    .kind = (char *)(uintptr_t)event->kind,
                                    .text = (char *)(uintptr_t)event->text};
    client_channel(&play->client, "EVENT", NULL, channel);
    pliant_event_t_publish(play->client.lcm, channel, &message);
}

// Finds a body's model and integrator in the description.
static void describe_body(const Play *play, const char *name, char model[16], char integrator[24])
{
    char line[64];
    snprintf(model, 16, "surface");
    snprintf(integrator, 24, "recorded");
    snprintf(line, sizeof line, "\nbody %s: model ", name);
    const char *found = strstr(play->describe, line);
    if (found != NULL)
        sscanf(found + strlen(line), "%15[a-z], %23[a-z0-9_]", model, integrator);
}

// Says who publishes here, to programs of any version.
static void publish_hello(Play *play)
{
    static const char program[] = "pliant-play", version[] = PLIANT_VERSION;
    char channel[CLIENT_CHANNEL_MAX];
    const pliant_hello_t hello = {.utime = client_utime(),
                                  .program = (char *)(uintptr_t)program,
                                  .version = (char *)(uintptr_t)version,
                                  .types = PLIANT_LCMTYPES_COUNT,
                                  .prefix = play->client.prefix,
                                  .input_prefix = play->client.prefix};
    client_channel(&play->client, "HELLO", NULL, channel);
    pliant_hello_t_publish(play->client.lcm, channel, &hello);
}

void play_publish_status(Play *play)
{
    enum { BODIES = RECORDING_INFO_BODIES };
    char channel[CLIENT_CHANNEL_MAX], model[BODIES][16], integrator[BODIES][24];
    pliant_body_status_t body[BODIES];
    const Sender *sender = &play->sender;
    for (int i = 0; i < sender->bodies; i++) {
        const SenderBody *from = &sender->body[i];
        describe_body(play, timeline_body(play->timeline, i), model[i], integrator[i]);
        body[i] =
            (pliant_body_status_t){.name = (char *)(uintptr_t)timeline_body(play->timeline, i),
                                   .model = model[i],
                                   .integrator = integrator[i],
                                   .topology = from->has_mesh ? from->mesh.number : 0,
                                   .nodes = from->has_mesh ? from->mesh.node_count : 0,
                                   .elements = from->has_mesh ? from->mesh.triangle_count : 0,
                                   .pieces = from->pieces};
    }
    pliant_status_t status = {.utime = client_utime(),
                              .sequence = (int32_t)++play->status_sequence,
                              .scene = play->scene,
                              .state = (char *)(uintptr_t)(play->playing ? "running" : "paused"),
                              // It must not fall when the time does: viewers would take it for
                              // another server.
                              .step = sender->frames,
                              .rate_hz = play->rate_hz,
                              .real_time_factor = play->playing ? play->speed : 0.0,
                              .num_bodies = sender->bodies,
                              .body = body};
    sender_step(sender, &status.time);
    hold_note_status(&play->hold, status.utime);
    client_channel(&play->client, "STATUS", NULL, channel);
    pliant_status_t_publish(play->client.lcm, channel, &status);
    publish_hello(play);
}

// Reads the newest lines of what is shown if they are others than before, or `again`; `count` 0:
// not.
static bool read_lines(Play *play, RecordingList list, bool again, RecordingLedger *line,
                       int *count, Status *status)
{
    const int number = timeline_find_lines(play->timeline, list, play->shown);
    *count = 0;
    if (number == 0 || (number == play->lines[list] && !again))
        return true;
    play->lines[list] = number;
    play->lines_sequence[list]++;
    return timeline_lines(play->timeline, list, number, line, count, status);
}

bool play_publish_lines(Play *play, bool again, Status *status)
{
    RecordingLedger line[LEDGER_LINES];
    char channel[CLIENT_CHANNEL_MAX];
    int count;
    if (!read_lines(play, RECORDING_LEDGERS, again, line, &count, status))
        return false;
    if (count > 0) {
        LedgerParts parts;
        pliant_ledger_t message = ledger_message(line, count, &parts);
        message.utime = client_utime();
        message.sequence = (int32_t)play->lines_sequence[RECORDING_LEDGERS];
        client_channel(&play->client, "LEDGER", NULL, channel);
        pliant_ledger_t_publish(play->client.lcm, channel, &message);
    }
    if (!read_lines(play, RECORDING_ERRORS, again, line, &count, status))
        return false;
    if (count > 0) {
        ErrorParts parts;
        pliant_error_t message = error_message(line, count, &parts);
        message.utime = client_utime();
        message.sequence = (int32_t)play->lines_sequence[RECORDING_ERRORS];
        client_channel(&play->client, "ERROR", NULL, channel);
        pliant_error_t_publish(play->client.lcm, channel, &message);
    }
    return true;
}

_Static_assert((int)ERRORS_LINES <= (int)LEDGER_LINES, "either fits");

void play_publish_playback(Play *play, bool whole)
{
    char channel[CLIENT_CHANNEL_MAX], text[PLAY_MARKS][MARK_TEXT];
    double time[PLAY_MARKS], recorded;
    char *kinds[PLAY_MARKS], *texts[PLAY_MARKS];
    int32_t tool[RECORDING_INFO_TOOLS];
    int events, marks = 0, tools = whole ? timeline_tools(play->timeline) : 0;
    int64_t left_out;
    const TimelineEvent *event = timeline_events(play->timeline, &events, &left_out);
    // Of too many events every second, third, ... is a mark.
    const int every = (events + PLAY_MARKS - 1) / PLAY_MARKS;
    for (int i = 0; whole && i < events; i += every) {
        time[marks] =
            fmin(fmax(event[i].time, timeline_start(play->timeline)), timeline_end(play->timeline));
        snprintf(text[marks], MARK_TEXT, "%.*s", MARK_TEXT - 1, event[i].event.text);
        kinds[marks] = (char *)(uintptr_t)event[i].event.kind;
        texts[marks] = text[marks];
        marks++;
    }
    for (int i = 0; i < tools; i++)
        tool[i] = timeline_tool_id(play->timeline, i);
    const pliant_playback_t message = {.utime = client_utime(),
                                       .sequence = (int32_t)++play->playback_sequence,
                                       .parts = timeline_parts(play->timeline),
                                       .playing = play->playing,
                                       .loop = play->loop,
                                       .whole = whole,
                                       .start = timeline_start(play->timeline),
                                       .end = timeline_end(play->timeline),
                                       .first = play->from,
                                       .last = play->to,
                                       .time = play->time,
                                       .speed = play->speed,
                                       .frame_time = timeline_frame_time(play->timeline),
                                       .step = sender_step(&play->sender, &recorded),
                                       .left_out = whole ? (int32_t)(events - marks + left_out) : 0,
                                       .num_marks = marks,
                                       .mark_time = time,
                                       .mark_kind = kinds,
                                       .mark_text = texts,
                                       .num_tools = tools,
                                       .num_forces = tools * play->force_parts,
                                       .tool = tool,
                                       .force = play->force};
    client_channel(&play->client, "PLAYBACK", NULL, channel);
    pliant_playback_t_publish(play->client.lcm, channel, &message);
}
