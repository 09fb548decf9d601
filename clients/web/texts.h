// The JSON messages of protocol.md. Each function returns a parcel with one reference, the
// caller's. Any thread.
#ifndef PLIANT_WEB_TEXTS_H
#define PLIANT_WEB_TEXTS_H

#include "parcel.h"

#include "pliant_contact_t.h"
#include "pliant_event_t.h"
#include "pliant_reply_t.h"
#include "pliant_status_t.h"
#include "pliant_tool_pose_t.h"

typedef struct HelloText {
    const char *prefix;
    bool read_only;
    double rate_hz;
    const char *const *texture; // [textures] names of bodies
    int textures;
} HelloText;

Parcel *text_hello(const HelloText *hello);
// Takes names and models of the bodies from `status`.
Parcel *text_scene(const pliant_status_t *status, const char *describe);
Parcel *text_link(bool daemon, double age_s);
Parcel *text_status(const pliant_status_t *status);
Parcel *text_contacts(const pliant_contact_t *contact, int count);
// `ours`: the poses of that sender.
Parcel *text_poses(const pliant_tool_pose_t *pose, int count, int32_t ours);
Parcel *text_event(const pliant_event_t *event);
Parcel *text_reply(const pliant_reply_t *reply);
Parcel *text_error(int32_t id, const char *text); // `id` of the request concerned, or 0
Parcel *text_round(int64_t round);

#endif
