// SPDX-License-Identifier: MIT
// The state of pliant-play, and the messages that report it. One thread.
#ifndef PLIANT_PLAY_H
#define PLIANT_PLAY_H

#include "hold.h"
#include "sender.h"
#include "timeline.h"

enum {
    PLAY_MARKS = 512,
    PLAY_FORCE_VALUES = 4096, // with the marks below one datagram
    PLAY_FORCE_PARTS = 1024,  // of a tool, at most
    PLAY_ANSWERS = 64,
};

// A request that was answered, lest a repeated one is executed again.
typedef struct Answered {
    int32_t sender, id;
    bool ok, describes, waits; // waits: its reply is sent when the frame it asked for has left
    char channel[CLIENT_CHANNEL_MAX], text[200];
} Answered;

typedef struct Play {
    Client client;
    Hold hold;
    Timeline *timeline;
    Sender sender;
    // what is played
    double time, from, to, speed; // [s] on the timeline
    double shown;                 // time of what is shown: `time`, or a little before it
    bool playing, loop, once, skip_gaps;
    bool whole;        // the files could be read to their ends
    int64_t turned_ns; // last time that `time` was moved
    int event;         // the first one after `time`
    // requests
    bool changed, stop; // by a request: look at once; end
    bool wanted;        // the frames at `time`, when those before have left
    Answered answered[PLAY_ANSWERS];
    unsigned answers;
    // what is published and when next
    char *describe, scene[64];
    double rate_hz;
    float *force; // [tools][force_parts]
    int force_parts;
    uint32_t status_sequence, playback_sequence, event_sequence, lines_sequence[RECORDING_LISTS];
    int lines[RECORDING_LISTS]; // that were published last
    int64_t status_ns, playback_ns, whole_ns, tools_ns, frame_ns;
} Play;

void play_publish_reply(Play *play, const Answered *answer);
void play_publish_event(Play *play, const RecordingEvent *event);
// Also says who publishes here (hello_t), to programs of any version.
void play_publish_status(Play *play);
// Publishes ledger and errors of what is shown if they are others than before, or `again`. Returns
// false if the file cannot be read.
bool play_publish_lines(Play *play, bool again, Status *status);
// `whole`: with the marks of all events and the forces of all tools.
void play_publish_playback(Play *play, bool whole);

#endif
