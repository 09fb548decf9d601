// SPDX-License-Identifier: MIT
// The score sheet of a session, from its recordings: what each tool did, how hard it pressed, what
// was cut and where (SCORE.md defines every measure, with sources). Computed after the session, in
// memory, by one thread; nothing of it runs in the server.
#ifndef PLIANT_CLIENTS_PLAY_SCORE_H
#define PLIANT_CLIENTS_PLAY_SCORE_H

#include "base/check.h"
#include "io/recording.h"
#include "scene/scene.h"
#include "timeline.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

// --- tools ---------------------------------------------------------------------------------------

enum {
    SCORE_TOOL_ROWS = 1 << 24, // most of one tool: four hours and a half at 1 kHz
    SCORE_CURVE = 720,         // points of a curve on the page
};

// A row of a tool in a recording. Times rise.
typedef struct ScoreRow {
    double time;   // [s]
    Vec3 position; // [m]
    Vec3 force;    // on the tool [N]
} ScoreRow;

// A curve for the page: the largest force of each part of the session, and positions along the
// path.
typedef struct ScoreCurve {
    int count, path_count;
    double time[SCORE_CURVE], force[SCORE_CURVE]; // [s], [N]; NaN: the tool was inactive
    Vec3 path[SCORE_CURVE];                       // [m]; x NaN: a gap
} ScoreCurve;

// NaN: not known, or without meaning.
typedef struct ScoreTool {
    int id;
    int64_t rows, gaps;    // gaps: times without rows, which count for nothing
    double rate_hz;        // of the rows, by their median distance
    double time_s;         // while active
    double path_m;         // length of the path
    double mean_speed_m_s; // path over time
    double idle_fraction;  // share of the time below SCORE_IDLE_SPEED
    int64_t movements;     // that the smoothness is of
    double smoothness;     // spectral arc length, mean over movements by their duration; <= 0
    double contact_time_s; // with a force
    double peak_force_n;   // and when
    double peak_time_s;
    double mean_force_n;        // during contact
    double force_time_n_s;      // integral of the force over time
    double over_limit_s;        // time above the limit; NaN: the scene has none
    double over_limit_fraction; // of the time in use
    int64_t over_limit_count;   // times that the limit was crossed upwards
    ScoreCurve curve;
} ScoreTool;

#define SCORE_IDLE_SPEED 0.005 // [m/s]

// Measures rows; force_limit [N], 0: none; from and to [s]: what the curves show. Sets all but
// `tool->id`.
void score_tool(const ScoreRow *row, int64_t rows, double force_limit, double from, double to,
                ScoreTool *tool);

// Returns the spectral arc length of a speed profile [m/s] sampled at `rate` [Hz], by
// Balasubramanian et al. 2015; NaN for a profile that is zero or shorter than four samples.
double score_spectral_arc_length(const double *speed, int count, double rate);

// --- tissue --------------------------------------------------------------------------------------

enum { SCORE_CUTS = 4096, SCORE_PIECES = 64 }; // most that are listed

// What was severed in one cut: metres of a wall's edge, or square metres of a solid's section.
typedef struct ScoreCut {
    double time_s; // of its event
    char body[RECORDING_BODY_TEXT];
    char kind[RECORDING_KIND_TEXT]; // "cut", "tear"; "": no event tells
    double inside, outside;         // of all regions; inside 0 if the scene has none
    bool solid;
} ScoreCut;

typedef struct ScorePiece {
    double size; // [m2], of a solid [m3], in the shape of the first frame
} ScorePiece;

typedef struct ScoreBody {
    char name[RECORDING_BODY_TEXT];
    bool solid;             // sections [m2] and volumes [m3]; else lengths [m] and areas [m2]
    double inside, outside; // severed in all
    int64_t cuts_inside, cuts_outside, cuts_both; // cuts and tears that severed something
    int64_t refused;                              // cuts refused
    int pieces_first, pieces_last;                // connected pieces in the first and last frame
    int removed;                     // pieces at the end that are neither the largest nor fixed
    double removed_size, whole_size; // [m2] or [m3]
    ScorePiece piece[SCORE_PIECES];  // the removed ones, the largest first
} ScoreBody;

// The fixed nodes of a body, as the scene names them.
typedef struct ScoreFixed {
    char body[BODY_NAME_MAX];
    const FixedRegion *region; // [count], owned
    int count;
} ScoreFixed;

// What a session is judged by.
typedef struct ScoreRules {
    SceneScore scene; // the scene's group `score`, of its regions those that are to be cut
    int fixed_count;  // bodies
    ScoreFixed *fixed;
} ScoreRules;

// Reads the rules from the text that a recording has: of its scene, or a description, whose fixed
// nodes are not known. `name` is for errors. A text that includes other files is refused: they are
// not in the recording. The caller destroys the rules.
bool score_rules_read(const char *text, const char *name, ScoreRules *rules, Status *status);
// The same from the file of a scene; reads only these groups.
bool score_rules_load(const char *path, ScoreRules *rules, Status *status);
void score_rules_destroy(ScoreRules *rules);

// Follows the meshes of one body. Returns NULL never; the caller destroys it.
typedef struct ScoreTissue ScoreTissue;
ScoreTissue *score_tissue_create(const ScoreRules *rules, const char *body, int first_wall);
void score_tissue_destroy(ScoreTissue *tissue);
// Takes the mesh of a frame and its positions [3 node_count] of that frame. The first is the
// reference shape. Returns what was severed since the mesh before, inside and outside of regions;
// restoring the body severs nothing.
typedef struct Severed {
    double inside, outside; // [m] or [m2]
} Severed;
Severed score_tissue_mesh(ScoreTissue *tissue, const RecordingTopology *mesh,
                          const float *position);
// Fills the pieces of `body` from the first and the last mesh.
void score_tissue_pieces(const ScoreTissue *tissue, ScoreBody *body);

// --- a session -----------------------------------------------------------------------------------

typedef struct Score {
    ScoreRules rules; // owned
    char scene[64];   // its name
    int part_count;
    char created_by[64];
    bool ended;             // every part ended cleanly
    bool fixed_known;       // which nodes are fixed is recorded
    int64_t missing;        // frames lost or dropped, of all bodies
    double first_s, last_s; // simulated time
    int tool_count, body_count, cut_count;
    ScoreTool *tool;         // [tool_count]
    ScoreBody *body;         // [body_count]
    ScoreCut *cut;           // [cut_count], by time
    int ledger_count;        // lines; 0: no body can be cut, or an older recording
    RecordingLedger *ledger; // the last one
    int64_t events;
} Score;

// Scores a session. `scene`: the file of a scene that names limit and regions, or NULL: the one
// recorded. Returns false with `status`.
bool score_read(Timeline *timeline, const char *scene, Score *score, Status *status);
void score_destroy(Score *score);

// Write the sheet: JSON, CSV and a page to print.
void score_write_json(const Score *score, FILE *out);
void score_write_csv(const Score *score, FILE *out);
void score_write_page(const Score *score, FILE *out);
// Prints what matters most, a line for each tool and body.
void score_print(const Score *score, FILE *out);
// Writes BASE.json, BASE.csv and BASE.html; replaces only its own. Returns false with `status`.
bool score_write(const Score *score, const char *base, Status *status);

#endif
