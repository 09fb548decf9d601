// SPDX-License-Identifier: MIT
// The texts of pages: the JSON messages of protocol.md, and the tools in the daemon's description.
#ifndef PLIANT_WEB_TEXTS_H
#define PLIANT_WEB_TEXTS_H

#include "board.h"
#include "folder.h"
#include "requests.h"

#include "pliant_contact_t.h"
#include "pliant_event_t.h"
#include "pliant_error_t.h"
#include "pliant_ledger_t.h"
#include "pliant_playback_t.h"
#include "pliant_reply_t.h"
#include "pliant_status_t.h"
#include "pliant_tool_pose_t.h"

#include <stdbool.h>

// --- tools ---------------------------------------------------------------------------------------

// The tools in a daemon's answer to DESCRIBE. Pure functions, any thread.

enum { DESCRIBE_TOOLS = 32, DESCRIBE_CAPSULES = 8 };

typedef struct DescribedCapsule {
    double from[3], to[3], radius; // tool frame [m]
} DescribedCapsule;

typedef struct DescribedTool {
    int id;
    char kind[16];    // "probe", "blade", "grasper", "remover", "static"
    char removes[16]; // by "suction", "drill", "diathermy"; "": no remover
    bool has_force, has_edge, has_plane, has_mouth;
    double max_force; // [N]
    int capsules;
    DescribedCapsule capsule[DESCRIBE_CAPSULES];
    DescribedCapsule mouth;
    double edge[2][3];          // tool frame [m]
    double point[3], normal[3]; // of a static plane, world frame [m]
} DescribedTool;

// Reads the tools; ignores other lines, and tools beyond DESCRIBE_TOOLS. Returns their number.
int describe_tools(const char *text, DescribedTool tool[DESCRIBE_TOOLS]);

// --- messages ------------------------------------------------------------------------------------

// The JSON messages of protocol.md. Each function returns a parcel with one reference, the
// caller's. Any thread.

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
Parcel *text_ledger(const pliant_ledger_t *ledger);
Parcel *text_errors(const pliant_error_t *error);
Parcel *text_status(const pliant_status_t *status);
Parcel *text_contacts(const pliant_contact_t *contact, int count);
// `ours`: the poses of that sender.
Parcel *text_poses(const pliant_tool_pose_t *pose, int count, int32_t ours);
Parcel *text_event(const pliant_event_t *event);
// The recording, from a whole message; and what changes while it is played, from any.
Parcel *text_recording(const pliant_playback_t *playback);
Parcel *text_playback(const pliant_playback_t *playback);
Parcel *text_reply(const pliant_reply_t *reply);
Parcel *text_error(int32_t id, const char *text); // `id` of the request concerned, or 0
Parcel *text_round(int64_t round);

// A program that the workbench runs.
typedef struct WorkbenchRun {
    const char *file; // that it was started with; "": never
    bool runs, asked; // `asked`: it has been asked to end
    bool over, failed;
    const char *how;  // it ended
    const char *text; // the last that it printed
} WorkbenchRun;

typedef struct WorkbenchText {
    const FolderList *scenes, *uploaded, *meshes, *recordings;
    bool plays;   // recordings can be started
    bool foreign; // a daemon runs that was not started here
    int64_t upload_bytes;
    WorkbenchRun daemon, recorder, prepare;
    AskFolder folder; // of the daemon's file
    const char *check, *scene, *scene_text;
} WorkbenchText;

Parcel *text_workbench(const WorkbenchText *workbench);

#endif
